//! The firmware on QEMU's virt machine.
#![no_std]
#![no_main]

use edge_nal::TcpBind;
use embassy_executor::{SpawnError, Spawner};
use embassy_futures::select::{Either, select};
use embassy_net::{Config, Runner, Stack, StackResources};
use embassy_time::{Duration, Timer};
use firmware::boards::embassy_tcp::{Buffers, Pool, Tcp};
use firmware::boards::embassy_udp::Multicast;
use firmware::boards::scripted_radio::{Air, OnAir, Pace, ScriptedRadio};
use firmware::boards::slots::PartitionedSlots;
use firmware::boards::virt::flash::Flash;
use firmware::boards::virt::net::VirtNet;
use firmware::boards::virt::slots::{self, FlashPartition};
use firmware::boards::virt::uart::{Receiver, Transmitter};
use firmware::boards::virt::world::button::Button;
use firmware::boards::virt::world::inputs::Inputs;
use firmware::boards::virt::world::light::Light;
use firmware::boards::virt::world::servos::Servos;
use firmware::boards::virt::world::{Lines, Recorder};
use firmware::boards::virt::{self, Wired, executor};
use firmware::boards::{DRAWINGS, SETTINGS};
use firmware::services::House;
use firmware::services::arm::TimedFrames;
use firmware::services::discovery::{self, Ports};
use firmware::services::drawings::Album;
use firmware::services::line_us::{ANYWHERE, PORT, Server};
use firmware::services::serial::{ReadError, serve};
use firmware::services::storage::Memory;
use firmware::services::{drawer, network, panel, update, web};
use protocol_core::lineus::Identity;
use protocol_core::machine::{ArmData, Client, MAX_CLIENTS};
use protocol_core::update::{Slot, Standing};
use static_cell::{ConstStaticCell, StaticCell};

/// As on the desktop, so that pulses can be compared bit by bit.
const FRAME: Duration = Duration::from_millis(10);
/// One connection for each client, and one to turn another away.
const CONNECTIONS: usize = MAX_CLIENTS + 1;
const BUFFER: usize = 2048;
/// Connections of browsers, and one to turn another away.
const WEB_CONNECTIONS: usize = web::CONNECTIONS + 1;
/// Sockets: these, and one each for updates, the DHCP client, the DNS client and discovery.
const SOCKETS: usize = CONNECTIONS + WEB_CONNECTIONS + 4;
/// Bytes of a drawing that the machine holds.
const DRAWING: usize = 64 * 1024;

type SerialPort = (Receiver, Transmitter);
type Connections = Tcp<CONNECTIONS, BUFFER, BUFFER>;
type WebConnections = Tcp<WEB_CONNECTIONS, BUFFER, BUFFER>;

/// Never returns.
#[riscv_rt::entry]
fn main() -> ! {
    let devices = virt::start();
    let tick = executor::start_servo_executor();
    executor::run(|spawner| {
        // Every task is spawned once, and its storage is its own.
        let started = devices.and_then(|devices| {
            spawner.spawn(records(devices.recorder).ok()?);
            spawner.spawn(host_lines(devices.lines).ok()?);
            let (card, disk, serial) = (devices.card, devices.disk, devices.serial);
            spawner.spawn(boot(spawner, tick, card, disk, serial).ok()?);
            Some(())
        });
        if started.is_none() {
            log::error!("a device is missing");
            virt::power::exit(virt::power::PANIC_STATUS);
        }
    })
}

/// Reads the settings, then starts everything else.
#[embassy_executor::task]
async fn boot(
    spawner: Spawner,
    tick: embassy_executor::SendSpawner,
    card: VirtNet,
    disk: Flash,
    port: SerialPort,
) {
    let chip = slots::share(disk);
    let (settings, drawings) = (
        slots::partition(chip, SETTINGS),
        slots::partition(chip, DRAWINGS),
    );
    let whole = |part: &FlashPartition| 0..part.size();
    let (of_settings, of_drawings) = (whole(&settings), whole(&drawings));
    let memory = Memory::new(settings, of_settings);
    let album = Album::new(drawings, of_drawings);
    let (Some(memory), Some(album)) = (memory, album) else {
        log::error!("settings and drawings do not lie in whole pages");
        return;
    };
    static MEMORY: StaticCell<Memory<FlashPartition>> = StaticCell::new();
    let memory = MEMORY.init(memory);
    static ALBUM: StaticCell<Album<FlashPartition>> = StaticCell::new();
    let album = ALBUM.init(album);
    // QEMU that takes no sleep (`-icount sleep=off`) now and then forgets a disk that answers while no
    // alarm is set: so there is one.
    let alarm = async {
        loop {
            Timer::after_millis(1).await;
        }
    };
    let read = async {
        let mut choice = slots::choice(chip);
        let running = update::choice(&mut choice).await;
        let running = running.map_or(Slot::First, |choice| choice.slot());
        let Some(standing) = update::at_start(&mut choice, running).await else {
            log::info!("the new firmware did not confirm itself: back to the old one");
            virt::power::exit(virt::power::RESTART_STATUS);
        };
        album.open().await;
        (memory.load().await.0, running, standing)
    };
    let (settings, running, standing) = match select(read, alarm).await {
        Either::First(read) => read,
        Either::Second(never) => never,
    };
    let identity = Identity {
        mac: card.address(),
    };
    static HOUSE: StaticCell<House> = StaticCell::new();
    let house = HOUSE.init(House::new(
        ArmData::default(),
        settings,
        identity,
        virt::VITALS,
    ));
    let slots = slots::slots(chip, running);
    let updates = (slots, standing);
    let started = serial(house, port).map(|task| spawner.spawn(task));
    if started
        .and_then(|()| start(spawner, tick, house, (memory, album), card, updates))
        .is_err()
    {
        log::error!("a task does not fit");
    }
}

fn start(
    spawner: Spawner,
    tick: embassy_executor::SendSpawner,
    house: &'static House,
    (memory, album): (
        &'static mut Memory<FlashPartition>,
        &'static mut Album<FlashPartition>,
    ),
    card: VirtNet,
    (slots, standing): (PartitionedSlots<Flash>, Standing),
) -> Result<(), SpawnError> {
    static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
    static BUFFERS: ConstStaticCell<[Buffers<BUFFER, BUFFER>; CONNECTIONS]> =
        ConstStaticCell::new([const { Buffers::new() }; _]);
    static POOL: StaticCell<Pool<CONNECTIONS, BUFFER, BUFFER>> = StaticCell::new();

    tick.spawn(servo_tick(house)?);
    spawner.spawn(storage(house, memory)?);
    spawner.spawn(drawings(house, album)?);
    spawner.spawn(draw_stored(house)?);
    spawner.spawn(light(house)?);
    spawner.spawn(button(house)?);
    spawner.spawn(wifi(house)?);
    let resources = RESOURCES.init(StackResources::new());
    let (stack, runner) =
        embassy_net::new(card, Config::dhcpv4(Default::default()), resources, 1234);
    spawner.spawn(network_stack(runner)?);
    spawner.spawn(discovery(house, Multicast::new(stack))?);
    spawner.spawn(tell_address(house, stack)?);
    let tcp = Tcp::new(stack, POOL.init(Pool::new(BUFFERS.take())));
    for client in (0..).map_while(Client::new) {
        spawner.spawn(worker(tcp, client, house)?);
    }
    spawner.spawn(doorman(tcp)?);
    static UPDATE_BUFFERS: ConstStaticCell<[Buffers<BUFFER, BUFFER>; 1]> =
        ConstStaticCell::new([const { Buffers::new() }; _]);
    static UPDATE_POOL: StaticCell<Pool<1, BUFFER, BUFFER>> = StaticCell::new();
    let pool = UPDATE_POOL.init(Pool::new(UPDATE_BUFFERS.take()));
    spawner.spawn(updates(house, Tcp::new(stack, pool), slots, standing)?);
    serve_browsers(spawner, house, stack)
}

fn serve_browsers(
    spawner: Spawner,
    house: &'static House,
    stack: Stack<'static>,
) -> Result<(), SpawnError> {
    static BUFFERS: ConstStaticCell<[Buffers<BUFFER, BUFFER>; WEB_CONNECTIONS]> =
        ConstStaticCell::new([const { Buffers::new() }; _]);
    static POOL: StaticCell<Pool<WEB_CONNECTIONS, BUFFER, BUFFER>> = StaticCell::new();
    static ROOM: ConstStaticCell<[u8; DRAWING]> = ConstStaticCell::new([0; _]);
    static SERVER: web::Server = web::Server::new();

    spawner.spawn(job(house, ROOM.take())?);
    let tcp = Tcp::new(stack, POOL.init(Pool::new(BUFFERS.take())));
    for client in (0..).map_while(Client::web) {
        spawner.spawn(worker(tcp, client, house)?);
    }
    spawner.spawn(doorman(tcp)?);
    return Ok(());

    #[embassy_executor::task(pool_size = web::CONNECTIONS)]
    async fn worker(tcp: WebConnections, client: Client, house: &'static House) {
        if let Ok(acceptor) = tcp.bind(web::ANYWHERE).await {
            SERVER.work(&acceptor, client, house).await;
        }
    }

    #[embassy_executor::task]
    async fn doorman(tcp: WebConnections) {
        if let Ok(acceptor) = tcp.bind(web::ANYWHERE).await {
            SERVER.turn_away(&acceptor).await;
        }
    }

    #[embassy_executor::task]
    async fn job(house: &'static House, room: &'static mut [u8]) {
        house.job.run(house, room).await;
    }
}

#[embassy_executor::task]
async fn updates(
    house: &'static House,
    tcp: Tcp<1, BUFFER, BUFFER>,
    slots: PartitionedSlots<Flash>,
    standing: Standing,
) {
    update::run(house, tcp, slots, standing).await;
}

static SERVER: Server = Server::new();

#[embassy_executor::task(pool_size = MAX_CLIENTS)]
async fn worker(tcp: Connections, client: Client, house: &'static House) {
    if let Ok(acceptor) = tcp.bind(ANYWHERE).await {
        SERVER.work(&acceptor, client, house).await;
    }
}

#[embassy_executor::task]
async fn doorman(tcp: Connections) {
    if let Ok(acceptor) = tcp.bind(ANYWHERE).await {
        SERVER.turn_away(&acceptor).await;
    }
}

#[embassy_executor::task]
async fn servo_tick(house: &'static House) {
    house
        .arm
        .tick(Servos::default(), TimedFrames::every(FRAME), FRAME)
        .await;
}

#[embassy_executor::task]
async fn serial(house: &'static House, port: SerialPort) {
    let (from, to) = port;
    serve(from, to, ReadError::ByteLost, &mut Inputs, house).await;
}

#[embassy_executor::task]
async fn storage(house: &'static House, memory: &'static mut Memory<FlashPartition>) {
    house.store.run(memory).await;
}

#[embassy_executor::task]
async fn drawings(house: &'static House, album: &'static mut Album<FlashPartition>) {
    house.drawings.run(album).await;
}

#[embassy_executor::task]
async fn draw_stored(house: &'static House) {
    drawer::run(house).await;
}

#[embassy_executor::task]
async fn light(house: &'static House) {
    house.panel.shine(Light::default()).await;
}

#[embassy_executor::task]
async fn button(house: &'static House) {
    panel::watch(house, Button::new()).await;
}

#[embassy_executor::task]
async fn wifi(house: &'static House) {
    static AIR: Air = Air::new(Pace::INSTANT);
    if let Some(network) = OnAir::new(b"quill-test", Some(b"correct horse"), -50) {
        AIR.put(network);
    }
    network::run(house, ScriptedRadio::new(&AIR), Wired).await;
}

#[embassy_executor::task]
async fn network_stack(mut runner: Runner<'static, VirtNet>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn discovery(house: &'static House, multicast: Multicast) {
    let ports = Ports {
        line_us: PORT,
        web: Some(web::PORT),
    };
    discovery::run(house, &multicast, || multicast.address(), ports).await;
}

#[embassy_executor::task]
async fn tell_address(house: &'static House, stack: Stack<'static>) {
    stack.wait_config_up().await;
    if let Some(config) = stack.config_v4() {
        let own = config.address.address().into();
        house.address.lock(|place| place.set(Some(own)));
        log::info!("Line-us clients: {}:{}", config.address.address(), PORT);
    }
}

#[embassy_executor::task]
async fn records(recorder: Recorder) {
    recorder.run().await;
}

#[embassy_executor::task]
async fn host_lines(lines: Lines) {
    lines.run().await;
}
