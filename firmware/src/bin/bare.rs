//! What size comparisons start from: joins a network and echoes what comes over TCP, as short as
//! esp-radio allows. It uses nothing of this package.
#![no_std]
#![no_main]
#![expect(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "the shortest program, which is measured and not used"
)]

use embassy_executor::Spawner;
use embassy_net::tcp::TcpSocket;
use embassy_net::{Config, Runner, Stack, StackResources};
use embassy_time::{Duration, Timer};
use esp_radio::wifi::sta::StationConfig;
use esp_radio::wifi::{
    AuthenticationMethodConfig, Config as WifiConfig, ControllerConfig, Interface, WifiController,
};
use static_cell::StaticCell;

use esp_println as _;

esp_bootloader_esp_idf::esp_app_desc!();

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    esp_hal::system::software_reset()
}

#[embassy_executor::task]
async fn net_task(mut runner: Runner<'static, Interface>) -> ! {
    runner.run().await
}

#[embassy_executor::task]
async fn echo(stack: Stack<'static>) -> ! {
    let mut rx = [0; 1536];
    let mut tx = [0; 1536];
    let mut buffer = [0; 512];
    loop {
        let mut socket = TcpSocket::new(stack, &mut rx, &mut tx);
        if socket.accept(1337).await.is_err() {
            continue;
        }
        'connection: while let Ok(count @ 1..) = socket.read(&mut buffer).await {
            let mut rest = &buffer[..count];
            while !rest.is_empty() {
                let Ok(sent) = socket.write(rest).await else {
                    break 'connection;
                };
                rest = &rest[sent..];
            }
        }
        socket.close();
        let _ = socket.flush().await;
    }
}

fn heap() {
    esp_alloc::heap_allocator!(#[esp_hal::ram(reclaimed)] size: 64 * 1024);
    esp_alloc::heap_allocator!(size: 72 * 1024);
}

#[esp_rtos::main]
async fn main(spawner: Spawner) {
    let chip =
        esp_hal::init(esp_hal::Config::default().with_cpu_clock(esp_hal::clock::CpuClock::max()));
    heap();
    let timers = esp_hal::timer::timg::TimerGroup::new(chip.TIMG0);
    esp_rtos::start(timers.timer0, chip.FROM_CPU_INTR0);

    let network = StationConfig::default()
        .with_ssid("a network".try_into().expect("short enough"))
        .with_authentication(AuthenticationMethodConfig::Wpa2Personal(
            "a password".try_into().expect("short enough"),
        ));
    let config = ControllerConfig::default().with_initial_config(WifiConfig::Station(network));
    let mut controller = WifiController::new(chip.WIFI, config).expect("the radio starts");

    static RESOURCES: StaticCell<StackResources<3>> = StaticCell::new();
    let (stack, runner) = embassy_net::new(
        Interface::station(),
        Config::dhcpv4(Default::default()),
        RESOURCES.init(StackResources::new()),
        u64::from(esp_hal::rng::Rng::new().random()),
    );
    spawner.spawn(net_task(runner).expect("first of its kind"));
    spawner.spawn(echo(stack).expect("first of its kind"));
    loop {
        if controller.connect_async().await.is_ok() {
            let _ = controller.wait_for_disconnect_async().await;
        }
        Timer::after(Duration::from_secs(5)).await;
    }
}
