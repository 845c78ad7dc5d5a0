//! The drawing arm on an ESP32.
#![no_std]
#![no_main]

use core::future::pending;
use edge_nal::TcpBind;
use embassy_executor::{SpawnError, Spawner};
use embassy_time::{Duration, Ticker};
use firmware::board::Vitals;
use firmware::boards::esp::data::BOARD;
use firmware::boards::esp::flash::{Chip, FlashPartition};
use firmware::boards::esp::light::Light;
use firmware::boards::esp::net::{Connections, Net, NetRunner, UpdateConnection};
use firmware::boards::esp::radio::EspRadio;
use firmware::boards::esp::servos::{FRAME, ServoPorts};
use firmware::boards::esp::start::{self, Network, Parts};
use firmware::boards::esp::system::Watchdog;
use firmware::boards::esp::{Button, last_panic, pwm_timer, system};
use firmware::boards::slots::PartitionedSlots;
use firmware::services::House;
use firmware::services::line_us::{ANYWHERE, Server};
use firmware::services::storage::Memory;
use firmware::services::{network, panel, update};
use protocol_core::machine::{Client, MAX_CLIENTS};
use protocol_core::panel::Lamp;
use protocol_core::settings::Settings;
use protocol_core::update::Standing;
use static_cell::StaticCell;

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

    let mut memory = parts.settings.take().and_then(|partition| {
        let whole = 0..partition.size();
        Memory::new(partition, whole)
    });
    let settings = match &mut memory {
        Some(memory) => memory.load().await.0,
        None => Settings::default(),
    };
    static HOUSE: StaticCell<House> = StaticCell::new();
    let house = House::new(BOARD.arm(), settings, system::identity(), vitals);
    if spawn(spawner, HOUSE.init(house), memory, parts).is_err() {
        defmt::error!("a service does not run: more tasks of a kind than its pool holds");
    }
}

fn spawn(
    spawner: Spawner,
    house: &'static House,
    memory: Option<Memory<FlashPartition>>,
    parts: Parts,
) -> Result<(), SpawnError> {
    parts.urgent.spawn(arm(house, parts.servos)?);
    spawner.spawn(watch(parts.watchdog)?);
    spawner.spawn(storage(house, memory)?);
    spawner.spawn(light(house, parts.light)?);
    spawner.spawn(button(house, parts.button)?);
    // `parts.serial` is open; the dialect of the serial port attaches here.
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
    spawner.spawn(network_stack(runner)?);
    spawner.spawn(wifi(house, radio, net)?);
    for client in (0..).map_while(Client::new) {
        spawner.spawn(worker(tcp, client, house)?);
    }
    spawner.spawn(doorman(tcp)?);
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

/// The servo tick. Runs above everything else, on the stack of whatever it interrupts.
#[embassy_executor::task]
async fn arm(house: &'static House, ports: ServoPorts) {
    let (servos, frames) = ports.start();
    house.arm.tick(servos, frames, FRAME).await;
}

#[embassy_executor::task]
async fn storage(house: &'static House, memory: Option<Memory<FlashPartition>>) {
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
async fn light(house: &'static House, light: Light) {
    house.panel.shine(light).await;
}

#[embassy_executor::task]
async fn button(house: &'static House, button: Button) {
    panel::watch(house, button).await;
}

#[embassy_executor::task]
async fn network_stack(mut runner: NetRunner) {
    runner.run().await;
}

#[embassy_executor::task]
async fn wifi(house: &'static House, radio: EspRadio, net: Net) {
    network::run(house, radio, net).await;
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
