//! TCP echo on the virt machine's network stack: the floor for the cost of a reply.
#![no_std]
#![no_main]

use edge_nal::{TcpAccept, TcpBind};
use embassy_executor::Spawner;
use embassy_net::{Config, Runner, StackResources};
use embedded_io_async::{Read, Write};
use firmware::boards::embassy_tcp::{Buffers, Pool, Tcp};
use firmware::boards::virt::net::VirtNet;
use firmware::boards::virt::world::{Lines, Recorder};
use firmware::boards::virt::{self, executor};
use firmware::services::line_us::ANYWHERE;
use firmware::services::web;
use protocol_core::machine::MAX_CLIENTS;
use static_cell::{ConstStaticCell, StaticCell};

/// As many sockets as the firmware has, with those of discovery and updates: the stack looks through all of
/// them at each packet.
const CONNECTIONS: usize = (MAX_CLIENTS + 1) + (web::CONNECTIONS + 1) + 2;

type Connections = Tcp<CONNECTIONS, 2048, 2048>;

/// Never returns.
#[riscv_rt::entry]
fn main() -> ! {
    let devices = virt::start();
    executor::run(|spawner| {
        let started = devices.and_then(|devices| {
            spawner.spawn(records(devices.recorder).ok()?);
            spawner.spawn(host_lines(devices.lines).ok()?);
            spawner.spawn(boot(spawner, devices.card).ok()?);
            Some(())
        });
        if started.is_none() {
            log::error!("a device is missing");
            virt::power::exit(virt::power::PANIC_STATUS);
        }
    })
}

#[embassy_executor::task]
async fn boot(spawner: Spawner, card: VirtNet) {
    static RESOURCES: StaticCell<StackResources<{ CONNECTIONS + 2 }>> = StaticCell::new();
    static BUFFERS: ConstStaticCell<[Buffers<2048, 2048>; CONNECTIONS]> =
        ConstStaticCell::new([const { Buffers::new() }; _]);
    static POOL: StaticCell<Pool<CONNECTIONS, 2048, 2048>> = StaticCell::new();
    let resources = RESOURCES.init(StackResources::new());
    let (stack, runner) =
        embassy_net::new(card, Config::dhcpv4(Default::default()), resources, 1234);
    let tcp = Tcp::new(stack, POOL.init(Pool::new(BUFFERS.take())));
    if let Ok(network) = network(runner) {
        spawner.spawn(network);
    }
    for echo in (0..CONNECTIONS).filter_map(|_| echo(tcp).ok()) {
        spawner.spawn(echo);
    }
    stack.wait_config_up().await;
    log::info!("Line-us clients: here they hear themselves");
}

#[embassy_executor::task(pool_size = CONNECTIONS)]
async fn echo(tcp: Connections) {
    let Ok(acceptor) = tcp.bind(ANYWHERE).await else {
        return;
    };
    loop {
        let Ok((_, mut socket)) = acceptor.accept().await else {
            continue;
        };
        let mut buffer = [0; 512];
        while let Ok(length @ 1..) = socket.read(&mut buffer).await {
            let heard = buffer.get(..length).unwrap_or_default();
            if socket.write_all(heard).await.is_err() {
                break;
            }
        }
    }
}

#[embassy_executor::task]
async fn network(mut runner: Runner<'static, VirtNet>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn records(recorder: Recorder) {
    recorder.run().await;
}

#[embassy_executor::task]
async fn host_lines(lines: Lines) {
    lines.run().await;
}
