//! Serves clients, browsers and a serial port.

use crate::home::{self, Flash};
use crate::named;
use crate::options::{Serve, Web};
use crate::place::{End, Firmware};
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use edge_nal::TcpAccept;
use embassy_executor::{SpawnError, Spawner};
use embassy_time::{Duration, Timer};
use firmware::board::{NoInputs, Vitals};
use firmware::boards::desktop::air;
use firmware::boards::desktop::bootloader::{self, Reset};
use firmware::boards::desktop::clock::{self, Speed};
use firmware::boards::desktop::flash::{self, FileFlash};
use firmware::boards::desktop::net::{Listener, Multicast, Outside};
use firmware::boards::desktop::pty::{self, Pty};
use firmware::boards::desktop::recorder::{Outputs, RecordedServos, Recorder};
use firmware::boards::desktop::slots::{self, FileSlots};
use firmware::boards::desktop::trial;
use firmware::boards::desktop::{NoAddress, VITALS, own_network};
use firmware::boards::scripted_radio::{Air, OnAir, Pace, ScriptedRadio};
use firmware::services::House;
use firmware::services::discovery::{self, Ports};
use firmware::services::drawings::Album;
use firmware::services::line_us::Server;
use firmware::services::serial::{self, ReadError};
use firmware::services::storage::Memory;
use firmware::services::{drawer, network, update, web};
use protocol_core::machine::{ArmData, Client, MAX_CLIENTS};
use protocol_core::motion::Micros;
use protocol_core::update::Standing;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Where the web interface is unless it is told otherwise.
const WEB: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// Bytes of a drawing that the machine holds.
const DRAWING: usize = 64 * 1024;

/// Serves until the program is told to stop, or the firmware wants to be started again.
pub fn until_end(options: Serve, firmware: Option<Firmware>) -> io::Result<End> {
    static STOP: AtomicBool = AtomicBool::new(false);
    let reset = firmware.as_ref().and_then(|_| bootloader::reset());
    let vitals = Vitals {
        reset_reason: reset.map_or(VITALS.reset_reason, Reset::name),
        ..VITALS
    };
    let listener = embassy_futures::block_on(Listener::bind(options.line_us))
        .map_err(|error| named(&options.line_us, error))?;
    let listener: &'static Listener = Box::leak(Box::new(listener));
    let open = |path: &Path, size| {
        FileFlash::open(path, size).map_err(|error| named(&path.display(), error))
    };
    let flash = open(&options.state, flash::SIZE)?;
    let drawings = options.drawings.clone();
    let drawings = drawings.unwrap_or_else(|| options.state.with_extension("drawings"));
    let drawings = open(&drawings, flash::DRAWINGS_SIZE)?;
    let (port, _link) = serial_port(&options)?;
    let multicast = options
        .mdns
        .then(|| Multicast::beside(options.line_us.ip()))
        .transpose()
        .map_err(|error| named(&"--mdns", error))?;
    let web = listen_for_browsers(options.web)?;
    let data = ArmData {
        lift_after: Micros::from_secs(options.lift_after),
        ..ArmData::default()
    };
    let outputs = Outputs {
        trace: options.common.trace.clone(),
        picture: Some(options.picture.clone()),
        go_on: reset.is_some(),
    };
    let (recorder, servos) = Recorder::start(outputs, data, options.speed == Speed::Max)?;
    if let Some(file) = &options.air {
        air::read(file).map_err(|error| named(&file.display(), error))?;
    }
    let (house, memory) = home::house(data, flash, options.air.is_none(), vitals)?;
    let album = home::album(drawings)?;
    let frame = options.common.frame();
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed)).map_err(io::Error::other)?;

    log::info!("{} is ready.", house.name().as_str());
    log::info!("  Line-us clients: {}", options.line_us);
    if let Some(path) = &options.serial {
        log::info!("  serial port:     {}", path.display());
    }
    if let Some(address) = &options.serial_tcp {
        log::info!("  serial port:     {address} (TCP)");
    }
    match &web {
        Some((address, _)) => log::info!("  page:            http://{address}/"),
        None => log::info!("  page:            none"),
    }
    log::info!("  picture:         {}", options.picture.display());
    log::info!("  stop with Ctrl-C");
    let ports = Ports {
        line_us: options.line_us.port(),
        web: web.as_ref().map(|(address, _)| address.port()),
    };
    let mut spawned = Ok(());
    let has_slots = firmware.is_some();
    clock::run(
        options.speed,
        |spawner| {
            spawned = serve_clients(
                spawner,
                house,
                (memory, album),
                servos,
                frame,
                listener,
                options.air,
            )
            .and_then(|()| serve_port(spawner, port, house))
            .and_then(|()| web.map_or(Ok(()), |web| serve_browsers(spawner, house, web)))
            .and_then(|()| {
                if let Some(multicast) = multicast {
                    spawner.spawn(discovery(house, multicast, ports)?);
                }
                if let Some(firmware) = firmware {
                    spawner.spawn(renew(house, firmware.slots, firmware.standing)?);
                }
                Ok(())
            });
        },
        || {
            if has_slots {
                trial::round(&house.update);
            }
            STOP.load(Ordering::Relaxed) || slots::restart_is_wanted()
        },
    );
    spawned.map_err(io::Error::other)?;
    // From here on the disk may take its time.
    trial::end();
    let finished = recorder.finish();
    if !slots::restart_is_wanted() || STOP.load(Ordering::Relaxed) {
        return finished.map(|_| End::Stopped);
    }
    if let Err(error) = finished {
        log::error!("the picture or the trace cannot be written: {error}");
    }
    Ok(End::Restart)
}

/// Where the serial port leads.
enum Port {
    None,
    Terminal(Pty),
    Tcp(Listener),
}

fn serial_port(options: &Serve) -> io::Result<(Port, Option<pty::Link>)> {
    if let Some(path) = &options.serial {
        let opened = pty::open(path).map_err(|error| named(&path.display(), error));
        return opened.map(|(pty, link)| (Port::Terminal(pty), Some(link)));
    }
    let Some(address) = options.serial_tcp else {
        return Ok((Port::None, None));
    };
    let bound = embassy_futures::block_on(Listener::bind(address));
    let listener = bound.map_err(|error| named(&address, error))?;
    Ok((Port::Tcp(listener), None))
}

fn serve_port(spawner: Spawner, port: Port, house: &'static House) -> Result<(), SpawnError> {
    match port {
        Port::None => {}
        Port::Terminal(pty) => spawner.spawn(terminal(pty, house)?),
        Port::Tcp(listener) => spawner.spawn(serial_tcp(listener, house)?),
    }
    return Ok(());

    #[embassy_executor::task]
    async fn terminal(pty: Pty, house: &'static House) {
        loop {
            pty.opened().await;
            log::info!("serial port opened");
            serial::serve(&pty, &pty, ReadError::Ended, &mut NoInputs, house).await;
            log::info!("serial port closed");
        }
    }

    #[embassy_executor::task]
    async fn serial_tcp(listener: Listener, house: &'static House) {
        loop {
            let Ok((peer, socket)) = listener.accept().await else {
                Timer::after_millis(10).await;
                continue;
            };
            log::info!("serial port opened by {peer}");
            serial::serve(&socket, &socket, ReadError::Ended, &mut NoInputs, house).await;
            log::info!("serial port closed by {peer}");
        }
    }
}

fn serve_clients(
    spawner: Spawner,
    house: &'static House,
    (memory, album): (Memory<Flash>, Album<Flash>),
    servos: RecordedServos,
    frame: Duration,
    listener: &'static Listener,
    air: Option<PathBuf>,
) -> Result<(), SpawnError> {
    static SERVER: Server = Server::new();
    spawner.spawn(home::arm(house, servos, frame)?);
    spawner.spawn(home::storage(house, memory)?);
    spawner.spawn(home::drawings(house, album)?);
    spawner.spawn(draw_stored(house)?);
    spawner.spawn(wifi(house, air)?);
    for client in (0..).map_while(Client::new) {
        spawner.spawn(worker(listener, client, house)?);
    }
    spawner.spawn(doorman(listener)?);
    return Ok(());

    #[embassy_executor::task(pool_size = MAX_CLIENTS)]
    async fn worker(listener: &'static Listener, client: Client, house: &'static House) {
        SERVER.work(listener, client, house).await;
    }

    #[embassy_executor::task]
    async fn doorman(listener: &'static Listener) {
        SERVER.turn_away(listener).await;
    }
}

/// Unless it was asked for, the web interface is where it is free, or not at all.
fn listen_for_browsers(web: Option<Web>) -> io::Result<Option<(SocketAddr, &'static Listener)>> {
    let address = match web {
        None => WEB,
        Some(Web::At(address)) => address,
        Some(Web::Nowhere) => return Ok(None),
    };
    let bound = embassy_futures::block_on(Listener::bind(address));
    match bound {
        Ok(listener) => Ok(Some((address, Box::leak(Box::new(listener))))),
        Err(error) if web.is_none() => {
            log::warn!("no page at {address}: {error}");
            Ok(None)
        }
        Err(error) => Err(io::Error::new(error.kind(), format!("{address}: {error}"))),
    }
}

fn serve_browsers(
    spawner: Spawner,
    house: &'static House,
    (address, listener): (SocketAddr, &'static Listener),
) -> Result<(), SpawnError> {
    static SERVER: web::Server = web::Server::new();
    let own = Some(address.ip()).filter(|own| !own.is_unspecified());
    house.address.lock(|place| place.set(own));
    for client in (0..).map_while(Client::web) {
        spawner.spawn(worker(listener, client, house)?);
    }
    spawner.spawn(doorman(listener)?);
    spawner.spawn(job(house, vec![0; DRAWING].leak())?);
    return Ok(());

    #[embassy_executor::task(pool_size = web::CONNECTIONS)]
    async fn worker(listener: &'static Listener, client: Client, house: &'static House) {
        SERVER.work(listener, client, house).await;
    }

    #[embassy_executor::task]
    async fn doorman(listener: &'static Listener) {
        SERVER.turn_away(listener).await;
    }

    #[embassy_executor::task]
    async fn job(house: &'static House, room: &'static mut [u8]) {
        house.job.run(house, room).await;
    }
}

/// There is no radio here: the network policy runs on one that hears the computer's own network alone, or
/// what is in a file.
#[embassy_executor::task]
async fn wifi(house: &'static House, networks: Option<PathBuf>) {
    static OWN: Air = Air::new(Pace::INSTANT);
    static SCRIPTED: Air = Air::new(Pace::LIFELIKE);
    if let Some(file) = networks {
        let radio = ScriptedRadio::new(&SCRIPTED);
        let policy = network::run(house, radio, NoAddress);
        embassy_futures::join::join(policy, air::follow(&SCRIPTED, &file)).await;
        return;
    }
    let own = own_network();
    OWN.put(OnAir {
        ssid: own.ssid,
        password: own.password,
        signal_dbm: -30,
    });
    network::run(house, ScriptedRadio::new(&OWN), NoAddress).await;
}

#[embassy_executor::task]
async fn renew(house: &'static House, slots: FileSlots, standing: Standing) {
    update::run(house, Outside, slots, standing).await;
}

#[embassy_executor::task]
async fn discovery(house: &'static House, multicast: Multicast, ports: Ports) {
    discovery::run(house, &multicast, || Some(multicast.address()), ports).await;
}

#[embassy_executor::task]
async fn draw_stored(house: &'static House) {
    drawer::run(house).await;
}
