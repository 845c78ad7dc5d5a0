//! From reset to a board with everything in its place.

use super::Button;
use super::data::BOARD;
use super::flash::{self, Chip, FlashPartition};
use super::inputs::Inputs;
use super::interface::Interfaces;
use super::light::{Light, PwmPower};
use super::net::{Net, NetRunner};
use super::pins::pin;
use super::radio::EspRadio;
use super::serial::{self, SerialRx, SerialTx};
use super::servos::ServoPorts;
use super::system::Watchdog;
use crate::boards::slots::PartitionedSlots;
use crate::services::update;
use embassy_executor::SendSpawner;
use embassy_futures::block_on;
use esp_hal::clock::CpuClock;
use esp_hal::gpio::{Input, InputConfig, Pull};
use esp_hal::interrupt::Priority;
use esp_hal::system::software_reset;
use esp_hal::time::Duration;
use esp_hal::timer::timg::TimerGroup;
use esp_rtos::embassy::InterruptExecutor;
use protocol_core::update::{Slot, Standing};
use static_cell::StaticCell;

/// Memory that the bootloader no longer needs; the chips have 64 kB or a little more.
const HEAP_RECLAIMED: usize = 64 * 1024;
/// Heap out of ordinary RAM. The radio's buffers come from it: 10 x 1.6 kB at the start, up to 64
/// more of them under load, and its tasks' stacks. Where it runs out the driver drops packets.
const HEAP_MORE: usize = 72 * 1024;

/// How long the start may take, until somebody feeds the watchdog.
const PATIENCE_AT_START: Duration = Duration::from_secs(10);

/// The software interrupt of the servo tick. 0 is the scheduler's, 1 the second core's.
type UrgentExecutor = InterruptExecutor<2>;

/// The board, ready for its tasks.
pub struct Parts {
    /// Servo outputs, for the servo tick.
    pub servos: ServoPorts,
    /// Where the servo tick is spawned: above network and radio, whose interrupts have the lowest
    /// priority. Its tasks run on the stack of whatever they interrupt: keep their frames small.
    pub urgent: SendSpawner,
    /// Status light.
    pub light: Light,
    /// Button.
    pub button: Button,
    /// G-code from the computer; `None` if the port could not be opened.
    pub serial: Option<(SerialRx, SerialTx)>,
    /// Door, chiller and power, as far as the board has them.
    pub inputs: Inputs,
    /// Flash for the settings; `None` if the partition table has no such place.
    pub settings: Option<FlashPartition>,
    /// Flash for drawings; `None` if the partition table has no such place.
    pub drawings: Option<FlashPartition>,
    /// Radio and network stack; `None` if they could not be started.
    pub network: Option<Network>,
    /// The slots for firmware, and how the one that runs stands; `None` if the partition table has no two.
    pub slots: Option<(PartitionedSlots<Chip>, Standing)>,
    /// Watchdog, which runs.
    pub watchdog: Watchdog,
}

/// The way to the outside.
pub struct Network {
    /// The radio.
    pub radio: EspRadio,
    /// The network stack.
    pub net: Net,
    /// Its task.
    pub runner: NetRunner,
}

/// Starts clocks, memory, scheduler and all drivers. Call once, first thing in `main`.
pub fn parts() -> Parts {
    let chip = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
    // First of all, what ends a firmware that does not work: the watchdog, and the count of its starts.
    let timers = TimerGroup::new(chip.TIMG0);
    let mut watchdog = Watchdog::new(timers.wdt);
    watchdog.start(PATIENCE_AT_START);
    let names = ["settings", "drawings", "otadata", "ota_0", "ota_1"];
    let ([settings, drawings, choice, first, second], running) = flash::open(chip.FLASH, names);
    let slots = match (choice, first, second) {
        (Some(choice), Some(first), Some(second)) => {
            Some(firmware_slots(choice, [first, second], running))
        }
        _ => None,
    };

    heap();
    esp_rtos::start(timers.timer0, chip.FROM_CPU_INTR0);

    static URGENT: StaticCell<UrgentExecutor> = StaticCell::new();
    let urgent = URGENT
        .init(UrgentExecutor::new(chip.FROM_CPU_INTR2))
        .start(Priority::max());

    let power = PwmPower::on(chip.LEDC);
    let servos = ServoPorts {
        pins: [
            pin(BOARD.shoulder.pin),
            pin(BOARD.elbow.pin),
            pin(BOARD.pen.pin),
        ],
        outputs: BOARD.outputs.map(|output| output.map(pin)),
        power,
    };

    let pull_up = InputConfig::default().with_pull(Pull::Up);
    let serial = serial::open(chip.UART0, &BOARD.serial);
    if let Err(error) = &serial {
        defmt::error!("serial port: {}", error);
    }
    let network =
        EspRadio::start(chip.WIFI)
            .ok()
            .zip(Interfaces::take())
            .map(|(radio, interfaces)| {
                let (net, runner) = Net::start(interfaces);
                Network { radio, net, runner }
            });

    Parts {
        servos,
        urgent,
        light: Light::new(&BOARD.light, chip.RMT, power),
        button: Input::new(pin(BOARD.button_pin), pull_up),
        serial: serial.ok(),
        inputs: Inputs::open(),
        settings,
        drawings,
        network,
        slots,
        watchdog,
    }
}

/// Counts this start, if the firmware is on trial, and starts the other one if it has failed.
fn firmware_slots(
    mut choice: FlashPartition,
    [first, second]: [FlashPartition; 2],
    running: Option<u32>,
) -> (PartitionedSlots<Chip>, Standing) {
    let running = match running {
        Some(at) if at == second.offset() => Slot::Second,
        Some(_) => Slot::First,
        // Where the chip does not tell, it is what the bootloader was told.
        None => block_on(update::choice(&mut choice)).map_or(Slot::First, |choice| choice.slot()),
    };
    let Some(standing) = block_on(update::at_start(&mut choice, running)) else {
        software_reset();
    };
    let places = [first, second];
    let slots = PartitionedSlots::new(BOARD.update_name, running, places, choice, || {
        software_reset()
    });
    (slots, standing)
}

fn heap() {
    esp_alloc::heap_allocator!(#[esp_hal::ram(reclaimed)] size: HEAP_RECLAIMED);
    esp_alloc::heap_allocator!(size: HEAP_MORE);
}
