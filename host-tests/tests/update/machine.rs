//! An arm with two small slots, in virtual time.
//!
//! Of eight pages, two are the boot choice, and three are each slot.

use crate::chip::{Chip, ChipError};
use crate::server::Server;
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_futures::block_on;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};
use firmware::board::{FirmwareSlots, Servos, Vitals};
use firmware::boards::desktop::clock::HandTime;
use firmware::boards::desktop::flash::{FileFlash, SIZE};
use firmware::boards::desktop::{IDENTITY, NoAddress};
use firmware::boards::scripted_radio::{Air, OnAir, Pace, ScriptedRadio};
use firmware::services::arm::TimedFrames;
use firmware::services::storage::Memory;
use firmware::services::{House, network, update};
use host_tests::scripted::tasks::Tasks;
use protocol_core::machine::{ArmData, Client, Errand, Manner, SetPoint, Target};
use protocol_core::motion::{Micros, Position};
use protocol_core::settings::Settings;
use protocol_core::update::{BootChoice, ManifestAddress, Rejection, Slot, Standing, Version};
use protocol_core::wifi::{Network, Password, Ssid};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

pub const BOARD: &str = "scripted";
/// Bytes of a slot.
pub const SLOT: usize = 3 * 4096;
/// What runs.
pub const OLD: &[u8] = b"the old firmware";
/// The network that there is.
const HOME: &[u8] = b"home";
const FRAME: Duration = Duration::from_millis(10);

pub type Flash = Chip<4096>;

/// A new machine's flash: old firmware in the first slot.
pub fn flash() -> Flash {
    let mut cells = vec![0xff; Flash::SIZE];
    cells[2 * 4096..][..OLD.len()].copy_from_slice(OLD);
    // As a bootloader leaves it at its first start.
    cells[..4].copy_from_slice(&[1, 0, 0, 0]);
    cells[24..32].copy_from_slice(&[2, 0, 0, 0, 154, 152, 67, 71]);
    Flash::with(cells)
}

/// What is in a slot.
pub fn slot(flash: &Flash, slot: Slot) -> Vec<u8> {
    let start = start_of(slot) as usize;
    flash.state().cells[start..start + SLOT].to_vec()
}

pub fn choice(flash: &Flash) -> BootChoice {
    block_on(update::choice(&mut part(flash, 0, 2 * 4096))).expect("it has power")
}

fn start_of(slot: Slot) -> u32 {
    match slot {
        Slot::First => 2 * 4096,
        Slot::Second => 5 * 4096,
    }
}

/// Part of a chip.
pub struct Part {
    chip: Flash,
    start: u32,
    size: u32,
}

pub fn part(chip: &Flash, start: u32, size: u32) -> Part {
    let chip = chip.clone();
    Part { chip, start, size }
}

impl Part {
    fn place(&self, at: u32, length: usize) -> Result<u32, ChipError> {
        match at as usize + length <= self.size as usize {
            true => Ok(self.start + at),
            false => Err(ChipError::OutOfRange),
        }
    }
}

impl ErrorType for Part {
    type Error = ChipError;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = Flash::READ_SIZE;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), ChipError> {
        let place = self.place(at, bytes.len())?;
        self.chip.read(place, bytes).await
    }

    fn capacity(&self) -> usize {
        self.size as usize
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = Flash::WRITE_SIZE;
    const ERASE_SIZE: usize = Flash::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), ChipError> {
        let place = self.place(from, (to - from) as usize)?;
        self.chip.erase(place, place + (to - from)).await
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), ChipError> {
        let place = self.place(at, bytes.len())?;
        self.chip.write(place, bytes).await
    }
}

impl MultiwriteNorFlash for Part {}

struct Slots {
    running: Slot,
    other: Part,
    choice: Part,
    restarted: Rc<Cell<bool>>,
}

impl FirmwareSlots for Slots {
    type Slot = Part;
    type Choice = Part;

    fn board(&self) -> &'static str {
        BOARD
    }

    fn running(&self) -> Slot {
        self.running
    }

    fn other(&mut self) -> &mut Part {
        &mut self.other
    }

    fn choice(&mut self) -> &mut Part {
        &mut self.choice
    }

    async fn restart(&mut self) -> ! {
        self.restarted.set(true);
        std::future::pending().await
    }
}

struct NoServos;

impl Servos for NoServos {
    fn write(&mut self, _: Micros, _: &SetPoint) {}
}

/// A machine that runs.
pub struct Machine {
    time: HandTime,
    tasks: Tasks,
    pub house: Rc<House>,
    pub restarted: Rc<Cell<bool>>,
    pub standing: Standing,
}

/// What is around a machine.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct World {
    /// Whether its network is there.
    pub network: bool,
    /// Whether its servo tick runs.
    pub tick: bool,
}

pub const WORLD: World = World {
    network: true,
    tick: true,
};

impl Machine {
    /// Starts what the bootloader chooses; `None` when the firmware restarts at once.
    pub fn start(flash: &Flash, server: &Server, address: &str, world: World) -> Option<Self> {
        let time = HandTime::take();
        let running = choice(flash).slot();
        let mut boot_choice = part(flash, 0, 2 * 4096);
        let standing = block_on(update::at_start(&mut boot_choice, running))?;
        let mut settings = Settings {
            update_address: ManifestAddress::new(address),
            ..Settings::default()
        };
        let home = Network {
            ssid: Ssid::new(HOME).unwrap(),
            password: Password::new(b"correct horse"),
        };
        settings.networks.put(home).unwrap();
        let vitals = Vitals {
            free_memory: || 0,
            reset_reason: "test",
            last_panic: "",
        };
        let house = Rc::new(House::new(ArmData::default(), settings, IDENTITY, vitals));
        let restarted = Rc::new(Cell::new(false));
        let slots = Slots {
            running,
            other: part(flash, start_of(running.other()), SLOT as u32),
            choice: boot_choice,
            restarted: restarted.clone(),
        };
        let tasks = Tasks::default();
        let spawner = tasks.spawner();
        if world.tick {
            let served = house.clone();
            spawner.spawn(async move {
                let frames = TimedFrames::every(FRAME);
                served.arm.tick(NoServos, frames, FRAME).await
            });
        }
        let served = house.clone();
        spawner.spawn(async move {
            let flash = BlockingAsync::new(FileFlash::in_memory(SIZE));
            let memory = Memory::new(flash, 0..SIZE).unwrap();
            served.store.run(memory).await
        });
        let air = Rc::new(Air::new(Pace::INSTANT));
        if world.network {
            air.put(OnAir::new(HOME, Some(b"correct horse"), -50).unwrap());
        }
        let served = house.clone();
        spawner
            .spawn(async move { network::run(&served, ScriptedRadio::new(air), NoAddress).await });
        let (served, server) = (house.clone(), server.clone());
        spawner.spawn(async move { update::run(&served, server, slots, standing).await });
        Some(Self {
            time,
            tasks,
            house,
            restarted,
            standing,
        })
    }

    /// Lets time go on until `done`, at most for `limit`; says whether it was done.
    pub fn pass(&mut self, limit: Duration, mut done: impl FnMut() -> bool) -> bool {
        let end = Instant::now() + limit;
        loop {
            while self.tasks.poll_one() || self.rings() {}
            if done() {
                return true;
            }
            if Instant::now() >= end {
                return false;
            }
            let next = self.time.next_alarm().unwrap_or(end);
            self.time.go_on_to(next.min(end));
        }
    }

    fn rings(&mut self) -> bool {
        self.time.next_alarm();
        self.tasks.poll_one()
    }

    /// M997, and its outcome; panics where there is none.
    pub fn update(&mut self) -> Result<Version, Rejection> {
        let outcome = self.ask();
        let limit = Duration::from_secs(1000);
        assert!(self.pass(limit, || outcome.borrow().is_some()), "no answer");
        outcome.take().unwrap()
    }

    /// M997, and where its outcome will be.
    pub fn ask(&mut self) -> Rc<RefCell<Option<Result<Version, Rejection>>>> {
        let outcome = Rc::new(RefCell::new(None));
        let (house, place) = (self.house.clone(), outcome.clone());
        self.tasks.spawner().spawn(async move {
            let result = house.update.ask().await;
            place.replace(Some(result));
        });
        outcome
    }

    /// Hands over a file, a piece of some bytes a second, and gives where its outcome will be. Whoever hands over goes
    /// away after the last piece where `leaves` says so.
    pub fn hand_over(
        &mut self,
        manifest: &str,
        length: usize,
        image: &[u8],
        leaves: bool,
    ) -> Rc<RefCell<Option<Result<Version, Rejection>>>> {
        let outcome = Rc::new(RefCell::new(None));
        let (house, place) = (self.house.clone(), outcome.clone());
        let (manifest, image) = (manifest.to_owned(), image.to_vec());
        self.tasks.spawner().spawn(async move {
            let handover = match house.update.offer(manifest.as_bytes(), length as u32) {
                Ok(handover) => handover,
                Err(rejection) => {
                    place.replace(Some(Err(rejection)));
                    return;
                }
            };
            let pieces = async {
                for piece in image.chunks(700) {
                    handover.push(piece).await;
                    Timer::after_secs(1).await;
                }
                if !leaves {
                    std::future::pending::<()>().await;
                }
            };
            if let Either::First(outcome) = select(handover.outcome(), pieces).await {
                place.replace(Some(outcome));
            }
        });
        outcome
    }

    /// A client moves the pen.
    pub fn move_to(&mut self, x: i16, y: i16, z: i16) {
        let house = self.house.clone();
        let target = Target::at(Position::from_units(x, y, z));
        self.tasks.spawner().spawn(async move {
            let client = Client::new(0).unwrap();
            let errand = Errand::Move(Manner::Straight, target);
            house.arm.errand(client, &errand).await;
        });
        self.pass(Duration::from_millis(20), || false);
    }

    /// The text of M122.
    pub fn told(&self) -> String {
        self.house.update.status().to_string()
    }
}
