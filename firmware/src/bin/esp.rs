//! The drawing arm on an ESP32.
#![no_std]
#![no_main]

use core::future::pending;
use edge_nal::TcpBind;
use embassy_executor::{SpawnError, Spawner};
use embassy_net::Stack;
use embassy_time::{Duration, Ticker};
use firmware::board::Vitals;
use firmware::boards::embassy_udp::Multicast;
use firmware::boards::esp::data::BOARD;
use firmware::boards::esp::flash::{Chip, FlashPartition};
use firmware::boards::esp::inputs::Inputs;
use firmware::boards::esp::light::Light;
use firmware::boards::esp::net::{Connections, Net, NetRunner, UpdateConnection, WebConnections};
use firmware::boards::esp::radio::EspRadio;
use firmware::boards::esp::serial::{SerialRx, SerialTx};
use firmware::boards::esp::servos::{FRAME, ServoPorts};
use firmware::boards::esp::start::{self, Network, Parts};
use firmware::boards::esp::system::Watchdog;
use firmware::boards::esp::{Button, last_panic, pwm_timer, system};
use firmware::boards::slots::PartitionedSlots;
use firmware::services::House;
use firmware::services::discovery::{self, Ports};
use firmware::services::drawings::Album;
use firmware::services::line_us::{ANYWHERE, PORT, Server};
use firmware::services::serial::{ReadError, serve};
use firmware::services::storage::Memory;
use firmware::services::{drawer, network, panel, update, web};
use protocol_core::machine::{Client, MAX_CLIENTS};
use protocol_core::panel::Lamp;
use protocol_core::settings::Settings;
use protocol_core::update::Standing;
use static_cell::{ConstStaticCell, StaticCell};

/// Bytes of a drawing that the machine holds: of what a chip has, this is what can be spared for good.
const DRAWING: usize = 16 * 1024;

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_rtos::main]
async fn main(spawner: Spawner) {
    let mut parts = start::parts();
    let vitals = Vitals {
        free_memory: system::free_heap,
        reset_reason: system::reset_reason(),
        last_panic: last_panic::take(),
    };
    defmt::info!(
        "{=str}, reset reason: {=str}, last panic: {=str}",
        BOARD.name,
        vitals.reset_reason,
        vitals.last_panic,
    );

    static MEMORY: StaticCell<Memory<FlashPartition>> = StaticCell::new();
    let mut memory = parts.settings.take().and_then(|partition| {
        let whole = 0..partition.size();
        Some(MEMORY.init(Memory::new(partition, whole)?))
    });
    let settings = match &mut memory {
        Some(memory) => memory.load().await.0,
        None => Settings::default(),
    };
    static ALBUM: StaticCell<Album<FlashPartition>> = StaticCell::new();
    let mut album = parts.drawings.take().and_then(|partition| {
        let whole = 0..partition.size();
        Some(ALBUM.init(Album::new(partition, whole)?))
    });
    if let Some(album) = &mut album {
        album.open().await;
    }
    static HOUSE: StaticCell<House> = StaticCell::new();
    let house = House::new(BOARD.arm(), settings, system::identity(), vitals);
    if spawn(spawner, HOUSE.init(house), (memory, album), parts).is_err() {
        defmt::error!("a service does not run: more tasks of a kind than its pool holds");
    }
}

fn spawn(
    spawner: Spawner,
    house: &'static House,
    (memory, album): (
        Option<&'static mut Memory<FlashPartition>>,
        Option<&'static mut Album<FlashPartition>>,
    ),
    parts: Parts,
) -> Result<(), SpawnError> {
    parts.urgent.spawn(arm(house, parts.servos)?);
    spawner.spawn(watch(parts.watchdog)?);
    spawner.spawn(storage(house, memory)?);
    spawner.spawn(drawings(house, album)?);
    spawner.spawn(draw_stored(house)?);
    spawner.spawn(light(house, parts.light)?);
    spawner.spawn(button(house, parts.button)?);
    if let Some(port) = parts.serial {
        spawner.spawn(serial(house, port, parts.inputs)?);
    }
    let Some(Network { radio, net, runner }) = parts.network else {
        defmt::error!("no network: the radio does not start");
        house.panel.show(Lamp::Error);
        return Ok(());
    };
    let tcp = net.connections();
    match parts.slots {
        Some((slots, standing)) => {
            spawner.spawn(updates(house, net.update_connection(), slots, standing)?);
        }
        None => defmt::error!("no two slots for firmware: there are no updates"),
    }
    spawner.spawn(discovery(house, net.multicast())?);
    let web = net.web_connections();
    spawner.spawn(tell_address(house, net.stack())?);
    spawner.spawn(network_stack(runner)?);
    spawner.spawn(wifi(house, radio, net)?);
    for client in (0..).map_while(Client::new) {
        spawner.spawn(worker(tcp, client, house)?);
    }
    spawner.spawn(doorman(tcp)?);
    static ROOM: ConstStaticCell<[u8; DRAWING]> = ConstStaticCell::new([0; _]);
    spawner.spawn(job(house, ROOM.take())?);
    for client in (0..).map_while(Client::web) {
        spawner.spawn(web_worker(web, client, house)?);
    }
    spawner.spawn(web_doorman(web)?);
    Ok(())
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
async fn updates(
    house: &'static House,
    tcp: UpdateConnection,
    slots: PartitionedSlots<Chip>,
    standing: Standing,
) {
    update::run(house, tcp, slots, standing).await;
}

static WEB_SERVER: web::Server = web::Server::new();

#[embassy_executor::task(pool_size = web::CONNECTIONS)]
async fn web_worker(tcp: WebConnections, client: Client, house: &'static House) {
    if let Ok(acceptor) = tcp.bind(web::ANYWHERE).await {
        WEB_SERVER.work(&acceptor, client, house).await;
    }
}

#[embassy_executor::task]
async fn web_doorman(tcp: WebConnections) {
    if let Ok(acceptor) = tcp.bind(web::ANYWHERE).await {
        WEB_SERVER.turn_away(&acceptor).await;
    }
}

#[embassy_executor::task]
async fn job(house: &'static House, room: &'static mut [u8]) {
    house.job.run(house, room).await;
}

/// Keeps the address that is told to browsers up to date.
#[embassy_executor::task]
async fn tell_address(house: &'static House, stack: Stack<'static>) {
    loop {
        stack.wait_config_up().await;
        let own = stack
            .config_v4()
            .map(|config| config.address.address().into());
        house.address.lock(|place| place.set(own));
        stack.wait_config_down().await;
        house.address.lock(|place| place.set(None));
    }
}

/// The servo tick. Runs above everything else, on the stack of whatever it interrupts.
#[embassy_executor::task]
async fn arm(house: &'static House, ports: ServoPorts) {
    let (servos, frames) = ports.start();
    house.arm.tick(servos, frames, FRAME).await;
}

#[embassy_executor::task]
async fn storage(house: &'static House, memory: Option<&'static mut Memory<FlashPartition>>) {
    match memory {
        Some(memory) => {
            house.store.run(memory).await;
        }
        None => {
            defmt::error!("no partition for the settings: nothing is remembered");
            house.store.refuse().await;
        }
    }
}

#[embassy_executor::task]
async fn drawings(house: &'static House, album: Option<&'static mut Album<FlashPartition>>) {
    match album {
        Some(album) => house.drawings.run(album).await,
        None => {
            defmt::error!("no partition for drawings: none is kept");
            house.drawings.refuse().await;
        }
    }
}

#[embassy_executor::task]
async fn draw_stored(house: &'static House) {
    drawer::run(house).await;
}

#[embassy_executor::task]
async fn light(house: &'static House, light: Light) {
    house.panel.shine(light).await;
}

#[embassy_executor::task]
async fn button(house: &'static House, button: Button) {
    panel::watch(house, button).await;
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
async fn network_stack(mut runner: NetRunner) {
    runner.run().await;
}

#[embassy_executor::task]
async fn wifi(house: &'static House, radio: EspRadio, net: Net) {
    network::run(house, radio, net).await;
}

/// Laser software at the other end of a wire, of which nobody knows whether there is anybody.
#[embassy_executor::task]
async fn serial(house: &'static House, port: (SerialRx, SerialTx), mut inputs: Inputs) {
    let (from, to) = port;
    serve(from, to, ReadError::ByteLost, &mut inputs, house).await;
}

/// Feeds the watchdog as long as the servo tick lives, and this executor, and tells of frames that
/// got no set-point in time.
#[embassy_executor::task]
async fn watch(mut watchdog: Watchdog) {
    /// Erasing a sector of flash stops everything for 0.4 s at worst.
    const PATIENCE: esp_hal::time::Duration = esp_hal::time::Duration::from_secs(5);
    watchdog.start(PATIENCE);
    let mut ticker = Ticker::every(Duration::from_secs(1));
    let (mut served_before, mut late_before) = (0, 0);
    loop {
        ticker.next().await;
        let (begun, served) = pwm_timer::frames();
        if served == served_before {
            defmt::error!("the servo tick stands still: waiting for the watchdog");
            return pending().await;
        }
        watchdog.feed();
        served_before = served;
        let late = begun.wrapping_sub(served);
        if late != late_before {
            defmt::warn!("servo frames without a set-point so far: {=u32}", late);
            late_before = late;
        }
    }
}
