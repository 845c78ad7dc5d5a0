//! The desktop arm: the firmware of the drawing arm with sockets, files and a picture.

use clap::{Args, Parser, Subcommand, ValueEnum};
use core::net::{AddrParseError, IpAddr, Ipv4Addr, SocketAddr};
use core::str::FromStr;
use edge_nal::TcpAccept;
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_executor::{SpawnError, Spawner};
use embassy_time::{Duration, Timer};
use firmware::board::{FirmwareSlots, NoInputs, Vitals};
use firmware::boards::desktop::air;
use firmware::boards::desktop::bootloader::{self, Reset, Running};
use firmware::boards::desktop::clock::{self, Speed};
use firmware::boards::desktop::draw::{self, Outcome, Script};
use firmware::boards::desktop::draw_lasaur::{self, Listener as Replies, Sender};
use firmware::boards::desktop::flash::{self, FileFlash};
use firmware::boards::desktop::net::{Listener, Multicast, Outside};
use firmware::boards::desktop::pty::{self, Pty};
use firmware::boards::desktop::recorder::{Outputs, RecordedServos, Recorder, Totals};
use firmware::boards::desktop::slots::{self, FileSlots};
use firmware::boards::desktop::trial;
use firmware::boards::desktop::{IDENTITY, NoAddress, VITALS, own_network};
use firmware::boards::scripted_radio::{Air, OnAir, Pace, ScriptedRadio};
use firmware::services::House;
use firmware::services::arm::TimedFrames;
use firmware::services::discovery::{self, Ports};
use firmware::services::drawings::Album;
use firmware::services::line_us::{Server, serve};
use firmware::services::serial::{self, ReadError};
use firmware::services::storage::Memory;
use firmware::services::{drawer, network, update, web};
use indicatif::{ProgressBar, ProgressStyle};
use protocol_core::machine::{ArmData, Client, MAX_CLIENTS, StopReason};
use protocol_core::motion::Micros;
use protocol_core::update::{KeyName, Standing};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

type Flash = BlockingAsync<FileFlash>;

/// A drawing arm without the arm: the real firmware on this computer.
///
/// Point any Line-us program at the address it prints, and watch the picture appear.
#[derive(Parser)]
#[command(name = "quill", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    serve: Serve,
}

#[derive(Subcommand)]
enum Command {
    /// Draw a G-code file as fast as possible, and tell what the arm did
    ///
    /// The file goes through the same session and the same arm as a client's commands. The exit status
    /// is 1 when a line was refused.
    Draw(Draw),
}

#[derive(Args)]
struct Serve {
    /// Where Line-us clients connect
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:1337")]
    line_us: SocketAddr,
    /// A serial port for laser software, made there and removed in the end
    #[arg(long, value_name = "PATH", conflicts_with = "serial_tcp")]
    serial: Option<PathBuf>,
    /// The serial port over TCP instead
    #[arg(long, value_name = "ADDR")]
    serial_tcp: Option<SocketAddr>,
    /// Announce the arm by name, so that clients find it without an address
    ///
    /// On the network of the address where clients connect: on this computer alone, unless that is another
    /// one.
    #[arg(long)]
    mdns: bool,
    /// Where browsers find the arm's page: an address, or 'none' [default: 127.0.0.1:8080, where it is free]
    #[arg(long, value_name = "ADDR")]
    web: Option<Web>,
    /// Where the arm keeps its name, calibration and network, made if it does not exist
    #[arg(long, value_name = "FILE", default_value = "quill.state")]
    state: PathBuf,
    /// Where the arm keeps drawings, made if it does not exist; beside the state if nothing is said
    #[arg(long, value_name = "FILE")]
    drawings: Option<PathBuf>,
    /// How fast the arm's time runs: a factor, or 'max' for as fast as possible
    #[arg(long, value_name = "FACTOR", default_value = "1")]
    speed: Speed,
    /// How long the pen stays down after its client has gone, in seconds
    #[arg(long, value_name = "SECONDS", default_value = "5")]
    lift_after: u32,
    /// The picture, SVG or PNG, rewritten whenever the arm comes to rest
    #[arg(long, value_name = "FILE", default_value = "drawing.svg")]
    picture: PathBuf,
    /// Networks that can be joined, a line each: name, password, strength in dBm, separated by tabs
    ///
    /// The file is read again when it changes. Without it, the arm is in the computer's own network.
    #[arg(long, value_name = "FILE")]
    air: Option<PathBuf>,
    /// Where there is place for other firmware: M997 updates the arm
    ///
    /// Two programs, and which of them starts. Made if it does not exist. Firmware that believes the published
    /// development key takes clients of this computer alone then.
    #[arg(long, value_name = "FOLDER")]
    firmware: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// Where the web interface is.
#[derive(Clone, Copy)]
enum Web {
    Nowhere,
    At(SocketAddr),
}

impl FromStr for Web {
    type Err = AddrParseError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "none" => Ok(Self::Nowhere),
            address => address.parse().map(Self::At),
        }
    }
}

/// Where the web interface is unless it is told otherwise.
const WEB: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);
/// Bytes of a drawing that the machine holds.
const DRAWING: usize = 64 * 1024;

#[derive(Args)]
struct Draw {
    /// G-code, a command a line
    file: PathBuf,
    /// What language the file is in
    #[arg(long, value_enum, default_value_t = Dialect::LineUs)]
    dialect: Dialect,
    /// A picture of what the servos did, SVG or PNG
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

#[derive(Clone, Copy, ValueEnum)]
enum Dialect {
    /// Line-us G-code, in drawing units
    LineUs,
    /// LasaurGrbl's, in millimetres on the table
    Lasaur,
}

#[derive(Args)]
struct Common {
    /// A row for each servo frame of the moving arm: time, position, pulses
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    /// Time between two set-points of the servos, in microseconds
    #[arg(long, value_name = "N", default_value = "10000", value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    frame_us: u32,
}

impl Common {
    fn frame(&self) -> Duration {
        Duration::from_micros(self.frame_us.into())
    }
}

fn main() -> ExitCode {
    env_logger::Builder::new()
        .filter_level(log::LevelFilter::Info)
        // Of WiFi there is only news when somebody asks for a network that is not there.
        .filter_module("firmware::services::network", log::LevelFilter::Warn)
        .format(|out, record| writeln!(out, "{}", record.args()))
        .target(env_logger::Target::Stdout)
        .init();
    perform().unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}

fn perform() -> io::Result<ExitCode> {
    // Before anything that may fail, like options that this firmware does not know.
    let firmware = bootloader::running().map(Firmware::start).transpose()?;
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => match firmware.filter(|_| trial::lasts()) {
            Some(firmware) => {
                error.print()?;
                return Err(firmware.running.restart(Reset::Failure));
            }
            None => error.exit(),
        },
    };
    match cli.command {
        Some(Command::Draw(options)) => draw_file(options),
        None => run_arm(cli.serve, firmware),
    }
}

/// The firmware that runs where there is place for two.
struct Firmware {
    running: Running,
    slots: FileSlots,
    standing: Standing,
}

impl Firmware {
    /// Counts the start of a firmware on trial, or starts the other one.
    fn start(running: Running) -> io::Result<Self> {
        let mut slots = FileSlots::open(&running)?;
        let standing = update::at_start(slots.choice(), running.slot);
        let Some(standing) = embassy_futures::block_on(standing) else {
            log::info!("the new firmware did not confirm itself: back to the old one");
            return Err(running.restart(Reset::Firmware));
        };
        if let Standing::Trial { .. } = standing {
            trial::begin(&running);
        }
        Ok(Self {
            running,
            slots,
            standing,
        })
    }
}

/// How serving ends.
enum End {
    Stopped,
    /// The firmware wants to be started again.
    Restart,
}

/// Serves until the program is told to stop. Where there is place for two firmwares, it is the bootloader
/// before that, unless it is the firmware in a slot already.
fn run_arm(options: Serve, firmware: Option<Firmware>) -> io::Result<ExitCode> {
    let firmware = match (firmware, &options.firmware) {
        (Some(firmware), _) => firmware,
        (None, Some(folder)) => {
            keep_strangers_out(&options)?;
            Firmware::start(bootloader::boot(folder)?)?
        }
        (None, None) => {
            serve_until_end(options, None)?;
            return Ok(ExitCode::SUCCESS);
        }
    };
    let running = firmware.running.clone();
    if trial::lasts() {
        trial::observe(&running, options.speed);
    }
    log::info!(
        "firmware {} of {}",
        slots::name(running.slot),
        running.folder.display()
    );
    // An image may believe another key than the bootloader.
    let ended =
        keep_strangers_out(&options).and_then(|()| serve_until_end(options, Some(firmware)));
    let on_trial = trial::lasts();
    trial::end();
    match ended {
        Ok(End::Stopped) => Ok(ExitCode::SUCCESS),
        Ok(End::Restart) => Err(running.restart(Reset::Firmware)),
        Err(error) if on_trial => {
            eprintln!("error: {error}");
            Err(running.restart(Reset::Failure))
        }
        Err(error) => Err(error),
    }
}

/// Whoever has the sources can sign with the development key, and an update is a program that runs as this
/// user: then only those who are on this computer may ask for one.
fn keep_strangers_out(options: &Serve) -> io::Result<()> {
    if update::KEY_NAME != KeyName::Development {
        return Ok(());
    }
    let web = match options.web {
        Some(Web::At(address)) => Some(address),
        None | Some(Web::Nowhere) => None,
    };
    let open = [
        ("--line-us", Some(options.line_us)),
        ("--web", web),
        ("--serial-tcp", options.serial_tcp),
    ];
    for (option, address) in open {
        let strange = address.filter(|address| !address.ip().to_canonical().is_loopback());
        if let Some(address) = strange {
            return Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                format!(
                    "{option} {address} with --firmware: this firmware believes the published development \
                     key, so whoever reaches it could run programs here. Build it with a key of your own \
                     (QUILL_UPDATE_KEY, see docs/update.md), or take an address of 127.0.0.1"
                ),
            ));
        }
    }
    Ok(())
}

/// Serves until the program is told to stop, or the firmware wants to be started again.
fn serve_until_end(options: Serve, firmware: Option<Firmware>) -> io::Result<End> {
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
    let (house, memory) = house(data, flash, options.air.is_none(), vitals)?;
    let album = album(drawings)?;
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

fn named(what: &dyn std::fmt::Display, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{what}: {error}"))
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
    spawner.spawn(arm(house, servos, frame)?);
    spawner.spawn(storage(house, memory)?);
    spawner.spawn(drawings(house, album)?);
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

#[embassy_executor::task]
async fn arm(house: &'static House, servos: RecordedServos, frame: Duration) {
    house
        .arm
        .tick(servos.of(&house.arm), TimedFrames::every(frame), frame)
        .await;
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
async fn storage(house: &'static House, memory: Memory<Flash>) {
    house.store.run(memory).await;
}

#[embassy_executor::task]
async fn drawings(house: &'static House, album: Album<Flash>) {
    house.drawings.run(album).await;
}

#[embassy_executor::task]
async fn draw_stored(house: &'static House) {
    drawer::run(house).await;
}

/// The drawings in a flash.
fn album(flash: FileFlash) -> io::Result<Album<Flash>> {
    let album = Album::new(BlockingAsync::new(flash), 0..flash::DRAWINGS_SIZE);
    let mut album = album.ok_or_else(|| io::Error::other("the flash does not hold whole pages"))?;
    embassy_futures::block_on(album.open());
    Ok(album)
}

/// An arm with what its flash remembers, in the computer's own network where it is `at_home` and remembers none.
fn house(
    data: ArmData,
    flash: FileFlash,
    at_home: bool,
    vitals: Vitals,
) -> io::Result<(&'static House, Memory<Flash>)> {
    let memory = Memory::new(BlockingAsync::new(flash), 0..flash::SIZE);
    let mut memory =
        memory.ok_or_else(|| io::Error::other("the flash does not hold whole pages"))?;
    let (mut settings, _) = embassy_futures::block_on(memory.load());
    if at_home && settings.networks.is_empty() {
        let _ = settings.networks.put(own_network());
    }
    let house = House::new(data, settings, IDENTITY, vitals);
    Ok((Box::leak(Box::new(house)), memory))
}

/// A file that speaks to the arm.
enum Host {
    LineUs(Script),
    Lasaur(Sender, Replies),
}

/// Draws one file in virtual time.
fn draw_file(options: Draw) -> io::Result<ExitCode> {
    static FINISHED: AtomicBool = AtomicBool::new(false);
    let bar = ProgressBar::new(0);
    let style = ProgressStyle::with_template("{bar:40} {percent}% of {bytes_total}, {eta} left");
    bar.set_style(style.map_err(io::Error::other)?);
    let path = &options.file;
    let named = |error: io::Error| named(&path.display(), error);
    let (host, outcome): (_, Box<dyn Fn() -> Outcome>) = match options.dialect {
        Dialect::LineUs => {
            let (script, outcome) = draw::open(path, bar.clone()).map_err(named)?;
            (Host::LineUs(script), Box::new(move || *outcome.borrow()))
        }
        Dialect::Lasaur => {
            let (sender, replies) = draw_lasaur::open(path, bar.clone()).map_err(named)?;
            let outcome = sender.outcome();
            (Host::Lasaur(sender, replies), Box::new(outcome))
        }
    };
    let data = ArmData::default();
    let outputs = Outputs {
        trace: options.common.trace.clone(),
        picture: options.picture.clone(),
        go_on: false,
    };
    let (recorder, servos) = Recorder::start(outputs, data, false)?;
    let (house, memory) = house(data, FileFlash::in_memory(flash::SIZE), true, VITALS)?;
    let album = album(FileFlash::in_memory(flash::DRAWINGS_SIZE))?;
    let frame = options.common.frame();

    // Nobody watches: time may always jump.
    clock::hurry(true);
    let mut spawned = Ok(());
    let spawn = |spawner: Spawner| {
        spawner.spawn(arm(house, servos, frame)?);
        spawner.spawn(storage(house, memory)?);
        spawner.spawn(drawings(house, album)?);
        spawner.spawn(client(host, house)?);
        Ok::<_, SpawnError>(())
    };
    clock::run(
        Speed::Max,
        |spawner| spawned = spawn(spawner),
        || FINISHED.load(Ordering::Relaxed),
    );
    spawned.map_err(io::Error::other)?;
    let totals = recorder.finish()?;
    bar.finish_and_clear();
    let outcome = outcome();
    // Nobody has to listen.
    let _ = tell(&outcome, &totals);
    let stopped = house.arm.with(|machine| machine.stopped());
    if let Some(StopReason::Limit(side)) = stopped {
        eprintln!("the arm was stopped at the edge of the table, {side:?}");
    }
    return Ok(if outcome.is_clean() && stopped.is_none() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    });

    #[embassy_executor::task]
    async fn client(host: Host, house: &'static House) {
        match (host, Client::new(0)) {
            (Host::LineUs(script), Some(client)) => serve(script, client, house).await,
            (Host::LineUs(_), None) => {}
            (Host::Lasaur(sender, replies), _) => {
                serial::serve(sender, replies, ReadError::Ended, &mut NoInputs, house).await;
            }
        }
        while house.arm.with(|machine| machine.is_busy()) {
            Timer::after_millis(1).await;
        }
        FINISHED.store(true, Ordering::Relaxed);
    }
}

fn tell(outcome: &Outcome, totals: &Totals) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let seconds = totals.moving.as_secs_f64();
    writeln!(out, "commands        {}", outcome.commands)?;
    writeln!(out, "errors          {}", outcome.errors)?;
    writeln!(out, "strokes         {}", totals.strokes)?;
    writeln!(out, "pen down        {:.1} mm", totals.pen_down_mm)?;
    writeln!(out, "pen up          {:.1} mm", totals.pen_up_mm)?;
    writeln!(out, "points limited  {}", outcome.limited)?;
    writeln!(
        out,
        "time of the arm {:.0} min {:.1} s",
        (seconds / 60.0).floor(),
        seconds % 60.0
    )?;
    Ok(())
}
