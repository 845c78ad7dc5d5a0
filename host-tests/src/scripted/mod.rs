//! A board in a script's hands: the firmware's services on devices that a script sees and moves, in virtual
//! time, in one thread. Power comes and goes; the flash, the air and the clients stay.

pub mod arm;
mod boot;
pub mod button;
mod firmware_tasks;
pub mod flash;
pub mod journal;
pub mod light;
pub mod power;
pub mod quiet;
pub mod radio;
pub mod release;
pub mod server;
pub mod slots;
pub mod tasks;
pub mod tcp;
pub mod wire;

use arm::ArmRecord;
use button::Contact;
use embassy_time::{Duration, Instant};
use firmware::boards::desktop::clock::HandTime;
use firmware::boards::scripted_radio::{Air, Pace};
use firmware::services::House;
use flash::Cells;
use light::LightRecord;
use power::Power;
use protocol_core::settings::Settings;
use protocol_core::wifi::Ssid;
use radio::RadioRecord;
use server::Server;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use tasks::Tasks;
use tcp::Port;

/// Time between two set-points of the servos, as on desktop and virt.
pub const FRAME: Duration = Duration::from_millis(10);
/// More polls than this without time going on, and the firmware runs in circles.
const POLLS_AT_MOST: usize = 200_000;

/// The devices, and the firmware while there is power.
pub struct Board {
    /// Supply, and what has gone wrong with the firmware.
    pub power: Power,
    /// What is in the air.
    pub air: Rc<Air>,
    /// What the radio did.
    pub radio: Rc<RadioRecord>,
    /// What the light did.
    pub light: Rc<LightRecord>,
    /// What the arm did.
    pub arm: Rc<ArmRecord>,
    /// What moves the button.
    pub button: Rc<Contact>,
    /// The memory.
    pub cells: Rc<RefCell<Cells>>,
    /// Where clients connect.
    pub port: Rc<Port>,
    /// Where updates come from; it is reached from a network that the machine has joined.
    pub server: Server,
    /// There are two places for firmware, else one.
    pub two_slots: bool,
    /// Starts that the firmware or the watchdog has asked for, for the script to take out.
    pub restarts: u32,
    /// What has been built: what it is called, and its image.
    built: Vec<(String, Vec<u8>)>,
    /// The firmware that runs.
    running: Option<String>,
    /// The firmware has asked for a start.
    restart: Rc<Cell<bool>>,
    /// It hangs, and will be restarted then.
    hangs_until: Option<Instant>,
    house: Rc<RefCell<Option<Rc<House>>>>,
    tasks: Tasks,
    /// The last to go.
    time: HandTime,
}

impl Board {
    /// The name under which the machine is found, without `.local`.
    pub fn found_as(&self) -> Option<String> {
        let house = self.house.borrow();
        let host = house.as_ref()?.discovery.host()?;
        Some(host.as_str().into())
    }

    /// A new machine in its box: nothing stored, no power. Time begins at 0, and belongs to this thread.
    pub fn new() -> Self {
        let air = Rc::new(Air::new(Pace::LIFELIKE));
        let radio = Rc::new(RadioRecord::default());
        let server = Server::default();
        let (way, joined) = (air.clone(), radio.clone());
        server.behind(move || joined.leads_on(&way));
        Self {
            power: Power::default(),
            air,
            radio,
            server,
            two_slots: true,
            restarts: 0,
            built: vec![("the old firmware".into(), slots::OLD.into())],
            running: None,
            restart: Rc::default(),
            hangs_until: None,
            light: Rc::default(),
            arm: Rc::default(),
            button: Rc::default(),
            cells: Rc::default(),
            port: Rc::default(),
            house: Rc::default(),
            tasks: Tasks::default(),
            time: HandTime::take(),
        }
    }

    /// Power comes, and the firmware starts for `reason`.
    pub fn power_on(&mut self, reason: &'static str) {
        self.cut_the_power();
        self.power.switch(true);
        self.boot(reason);
    }

    /// Power goes, in the middle of whatever the firmware does.
    pub fn cut_the_power(&mut self) {
        if self.power.is_on() {
            self.power.switch(false);
        }
        self.stop();
        self.cells.borrow_mut().stop_failing();
    }

    /// Nothing runs any more.
    fn stop(&mut self) {
        self.tasks = Tasks::default();
        self.time.forget_alarms();
        self.house.take();
        self.port.power_off();
        self.arm.power_off();
        self.light.show(Default::default());
        self.radio.asked.set(false);
        self.restart.set(false);
        self.hangs_until = None;
    }

    /// Lets the firmware do all that it does without time going on; says whether that was anything.
    pub fn settle(&mut self) -> bool {
        let mut polls = 0;
        while self.power.is_on() && self.go_on() {
            polls += 1;
            if polls > POLLS_AT_MOST {
                self.power
                    .offend("the firmware runs in circles: no time goes by");
                return false;
            }
        }
        if !self.power.is_on() && !self.tasks.is_empty() {
            // It failed by itself.
            self.cut_the_power();
        }
        polls > 0
    }

    /// One step of whatever runs, if there is any without time going on.
    fn go_on(&mut self) -> bool {
        if self.restart.take() {
            self.start_again("firmware");
            return true;
        }
        match self.hangs_until {
            Some(until) if Instant::now() < until => false,
            Some(_) => {
                self.start_again("watchdog");
                true
            }
            None => self.tasks.poll_one() || self.tasks_wait_for_now(),
        }
    }

    /// Rings alarms that are due already, and says whether some were.
    fn tasks_wait_for_now(&mut self) -> bool {
        self.time.next_alarm();
        self.tasks.poll_one()
    }

    /// Lets time go on to the next alarm, at most to `deadline`.
    pub fn step(&mut self, deadline: Instant) {
        let next = match self.hangs_until {
            Some(until) => until,
            None => self.time.next_alarm().unwrap_or(deadline),
        };
        self.time.go_on_to(next.min(deadline));
    }

    /// Whether a computer in this network reaches the machine.
    pub fn is_reachable(&self, network: &Ssid) -> bool {
        let joined = self.radio.asked.get() && self.air.joined().as_ref() == Some(network);
        let own = self.radio.serving.get() && self.air.own().as_ref() == Some(network);
        self.power.is_on() && (joined || own)
    }

    /// Whether a move is under way, or waits.
    pub fn arm_is_busy(&self) -> bool {
        let house = self.house.borrow();
        house
            .as_ref()
            .is_some_and(|house| house.arm.with(|arm| arm.is_busy()))
    }

    /// The memory, without the machine.
    fn at_rest(&self) -> flash::Flash {
        firmware_tasks::flash_at_rest(&self.cells)
    }

    /// Has the machine remember something, as if it had been told before.
    pub fn remember(&mut self, change: impl FnOnce(&mut Settings)) {
        firmware_tasks::remember(&self.cells, change);
    }

    /// What a restart would find in memory.
    pub fn remembered(&self) -> Settings {
        firmware_tasks::remembered(&self.cells.borrow())
    }
}

impl Default for Board {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::yield_now;

    #[test]
    fn a_firmware_that_runs_in_circles_is_told() {
        let mut board = Board::new();
        board.power_on("a test");
        board.settle();
        assert_eq!(board.power.offence(), None);
        board.tasks.spawner().spawn(async {
            loop {
                yield_now().await;
            }
        });
        board.settle();
        let offence = board.power.offence().unwrap();
        assert!(offence.contains("runs in circles"), "{offence}");
    }

    #[test]
    fn power_cycles_leave_nothing_behind() {
        let mut board = Board::new();
        for _ in 0..100 {
            board.power_on("a test");
            board.settle();
        }
        assert_eq!(board.power.offence(), None);
        board.cut_the_power();
        assert_eq!(board.time.next_alarm(), None);
        assert!(board.house.borrow().is_none());
        assert_eq!((board.air.own(), board.air.joined()), (None, None));
        assert_eq!(Rc::strong_count(&board.port), 1);
    }
}
