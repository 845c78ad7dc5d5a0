//! The firmware's services on the board's devices: the only place that starts them.

use super::arm::Servos;
use super::button::Button;
use super::flash::{Cells, Flash, SETTINGS, SIZE};
use super::light::Light;
use super::power::Power;
use super::quiet::Quiet;
use super::radio::{RadioRecord, RecordedAddress, RecordedRadio};
use super::slots::{Part, Slots};
use super::tcp::Acceptor;
use super::{Board, FRAME};
use firmware::board::Vitals;
use firmware::boards::scripted_radio::Air;
use firmware::services::House;
use firmware::services::arm::TimedFrames;
use firmware::services::discovery::{self, Ports};
use firmware::services::drawings::Album;
use firmware::services::line_us::{PORT, Server};
use firmware::services::storage::Memory;
use firmware::services::{drawer, network, panel, update};
use protocol_core::lineus::Identity;
use protocol_core::machine::{ArmData, Client};
use protocol_core::settings::Settings;
use protocol_core::update::Slot;
use std::cell::RefCell;
use std::rc::Rc;

/// Its serial number is 123456.
const IDENTITY: Identity = Identity {
    mac: [0x02, 0x51, 0x75, 0x01, 0xe2, 0x40],
};

fn memory(flash: Flash) -> Memory<Flash> {
    Memory::new(flash, 0..SETTINGS).expect("whole pages, at least two of them")
}

fn album(flash: Flash) -> Album<Flash> {
    Album::new(flash, SETTINGS..SIZE).expect("whole pages")
}

/// Starts everything, as the programs of the other boards do, with the firmware of this slot.
pub fn start(board: &Board, reason: &'static str, running: Slot) {
    let place = board.house.clone();
    let moves = |house: &Rc<House>| house.arm.with(|arm| arm.next_event().is_some());
    let moving = move || place.borrow().as_ref().is_some_and(moves);
    let moving: Rc<dyn Fn() -> bool> = Rc::new(moving);
    let flash = || Flash {
        cells: board.cells.clone(),
        power: board.power.clone(),
        moving: moving.clone(),
    };
    let (mut memory, mut album) = (memory(flash()), album(flash()));
    let (restart, power) = (board.restart.clone(), board.power.clone());
    let restart: Rc<dyn Fn()> = Rc::new(move || restart.set(power.is_on()));
    let slots = Slots::new(&flash(), SIZE as usize, running, restart.clone());
    let mut choice = Part::choice(flash(), SIZE as usize);
    let (web, two_slots) = (board.server.clone(), board.two_slots);
    let devices = Devices::of(board);
    let spawner = board.tasks.spawner();
    let place = board.house.clone();
    board.tasks.spawner().spawn(async move {
        let Some(standing) = update::at_start(&mut choice, running).await else {
            return restart();
        };
        let (settings, _) = memory.load().await;
        album.open().await;
        let vitals = Vitals {
            free_memory: || 100_000,
            reset_reason: reason,
            last_panic: "",
        };
        let house = House::new(ArmData::default(), settings, IDENTITY, vitals);
        let house = Rc::new(house);
        place.replace(Some(house.clone()));

        let served = house.clone();
        spawner.spawn(async move {
            let frames = TimedFrames::every(FRAME);
            served.arm.tick(devices.servos, frames, FRAME).await
        });
        let served = house.clone();
        spawner.spawn(async move { served.store.run(memory).await });
        let served = house.clone();
        spawner.spawn(async move { served.panel.shine(devices.light).await });
        let served = house.clone();
        spawner.spawn(async move { panel::watch(&served, devices.button).await });
        let served = house.clone();
        spawner.spawn(async move { network::run(&served, devices.radio, devices.address).await });
        let served = house.clone();
        spawner.spawn(async move {
            let ports = Ports {
                line_us: PORT,
                web: None,
            };
            let address = || devices.network.address(&devices.air);
            discovery::run(&served, &Quiet, address, ports).await
        });
        let server = Rc::new(Server::new());
        let acceptor = Rc::new(devices.acceptor);
        for client in (0..).map_while(Client::new) {
            let (served, server, acceptor) = (house.clone(), server.clone(), acceptor.clone());
            spawner.spawn(async move { server.work(&*acceptor, client, &served).await });
        }
        spawner.spawn(async move { server.turn_away(&*acceptor).await });
        let served = house.clone();
        spawner.spawn(async move { served.drawings.run(album).await });
        if two_slots {
            let served = house.clone();
            spawner.spawn(async move { update::run(&served, web, slots, standing).await });
        }
        spawner.spawn(async move { drawer::run(&house).await });
    });
}

struct Devices {
    servos: Servos,
    light: Light,
    button: Button,
    radio: RecordedRadio,
    address: RecordedAddress,
    network: Rc<RadioRecord>,
    air: Rc<Air>,
    acceptor: Acceptor,
}

impl Devices {
    fn of(board: &Board) -> Self {
        let power = || board.power.clone();
        Self {
            servos: Servos {
                record: board.arm.clone(),
                power: power(),
                frame: FRAME,
            },
            light: Light {
                record: board.light.clone(),
                power: power(),
            },
            button: Button::new(board.button.clone()),
            radio: RecordedRadio::new(board.air.clone(), board.radio.clone(), power()),
            address: RecordedAddress(board.radio.clone()),
            network: board.radio.clone(),
            air: board.air.clone(),
            acceptor: Acceptor {
                port: board.port.clone(),
                power: power(),
            },
        }
    }
}

/// What a start would find in these cells, which stay as they are.
pub fn remembered(cells: &Cells) -> Settings {
    let copy = Rc::new(RefCell::new(cells.clone()));
    embassy_futures::block_on(at_rest(&copy).load()).0
}

/// Changes what these cells hold.
pub fn remember(cells: &Rc<RefCell<Cells>>, change: impl FnOnce(&mut Settings)) {
    let mut memory = at_rest(cells);
    embassy_futures::block_on(async {
        let (mut settings, _) = memory.load().await;
        change(&mut settings);
        let stored = memory.store(&settings).await;
        stored.expect("the memory is well where a scenario begins");
    });
}

/// The memory in these cells, without the machine.
fn at_rest(cells: &Rc<RefCell<Cells>>) -> Memory<Flash> {
    memory(flash_at_rest(cells))
}

/// These cells, without the machine.
pub fn flash_at_rest(cells: &Rc<RefCell<Cells>>) -> Flash {
    Flash {
        cells: cells.clone(),
        power: Power::present(),
        moving: Rc::new(|| false),
    }
}
