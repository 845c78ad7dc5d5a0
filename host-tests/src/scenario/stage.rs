//! Where a scenario is played: the board, the computer with its clients, and time.

use super::client::Client;
use super::command::{Action, ClientAction, Kept, Memory, Network};
use super::server;
use crate::scripted::Board;
use crate::scripted::journal::note;
use crate::scripted::light::{Hue, Pattern};
use crate::scripted::radio::{offered, shown};
use embassy_time::{Duration, Instant};
use firmware::boards::scripted_radio::OnAir;
use protocol_core::wifi::Ssid;

/// How long a press of the button takes.
const PRESS: Duration = Duration::from_millis(150);
/// A contact bounces: it is closed and open in turn for these times before it stays.
const BOUNCES: [Duration; 4] = [
    Duration::from_millis(1),
    Duration::from_micros(300),
    Duration::from_millis(3),
    Duration::from_micros(700),
];
/// Strength of a network of which nothing is said.
const SIGNAL_DBM: i8 = -50;

/// The board with what is around it.
pub struct Stage {
    /// The machine.
    pub board: Board,
    /// Connections so far, the ended ones too.
    pub clients: Vec<Client>,
    /// The network that the computer is in, as long as it is there.
    pub computer: Option<Ssid>,
    /// Networks of the script, in the air or not.
    networks: Vec<OnAir>,
    /// What the light has shown last.
    seen: Pattern,
    /// The last pattern of the light that was expected, since power came.
    pub looked: Option<Pattern>,
    /// When power came last, or the machine was seen to start again.
    pub powered: Instant,
    /// Attempts to join it need not be expected one by one.
    pub tries_allowed: Option<Ssid>,
    /// Starts need not be expected one by one.
    pub starts_allowed: bool,
    /// How much the arm had done when the script did something last.
    pub acted: usize,
    /// How far the nib's way has been followed.
    pub passed: usize,
}

impl Stage {
    /// A new machine, a computer in no network, and nothing in the air.
    pub fn new() -> Self {
        Self {
            board: Board::new(),
            clients: Vec::new(),
            computer: None,
            networks: Vec::new(),
            seen: Pattern::Steady(Hue::DARK),
            looked: None,
            powered: Instant::MIN,
            tries_allowed: None,
            starts_allowed: false,
            acted: 0,
            passed: 0,
        }
    }

    /// Notes what the light shows, when that has become something else.
    fn look(&mut self) {
        if let Some(pattern) = self.board.light.pattern()
            && self.seen != pattern
        {
            self.seen = pattern;
            note(format_args!("    light: {pattern}"));
        }
    }

    /// Lets everything happen that happens without time going on.
    fn settle(&mut self) {
        loop {
            let busy = self.board.settle();
            for client in &mut self.clients {
                let in_network = self.computer.as_ref() == Some(&client.network);
                client.pass(in_network && self.board.is_reachable(&client.network));
            }
            if !busy {
                return;
            }
        }
    }

    /// Lets time go on until `done`, at most for `time`; says whether it was done.
    ///
    /// # Errors
    /// When something happens that must never happen.
    pub fn pass_time(
        &mut self,
        time: Duration,
        mut done: impl FnMut(&mut Self) -> bool,
    ) -> Result<bool, String> {
        let until = Instant::now() + time;
        loop {
            self.settle();
            self.look();
            if let Some(offence) = self.board.power.offence() {
                return Err(offence);
            }
            if done(self) {
                return Ok(true);
            }
            if Instant::now() >= until {
                return Ok(false);
            }
            let ends = self.clients.iter().filter_map(Client::given_up_at);
            let next = ends.filter(|end| *end > Instant::now()).min();
            self.board.step(next.map_or(until, |end| end.min(until)));
        }
    }

    /// Lets time go on.
    ///
    /// # Errors
    /// As [`Self::pass_time`].
    pub fn wait(&mut self, time: Duration) -> Result<(), String> {
        self.pass_time(time, |_| false).map(|_| ())
    }

    /// The client of that name, in its last connection.
    ///
    /// # Errors
    /// When it was never connected.
    pub fn client(&mut self, name: char) -> Result<&mut Client, String> {
        let mut clients = self.clients.iter_mut().rev();
        clients
            .find(|client| client.name() == name)
            .ok_or(format!("{name} is not connected"))
    }

    /// Does what the script says.
    ///
    /// # Errors
    /// When it cannot be done, or something happens meanwhile that must never happen.
    pub fn act(&mut self, action: &Action) -> Result<(), String> {
        self.acted = self.board.arm.length();
        match action {
            Action::PowerOn { held } => {
                self.board.button.set(*held);
                self.board.power_on("power on");
                self.begin();
            }
            Action::CutThePower => {
                self.board.cut_the_power();
                self.looked = None;
            }
            Action::PowerFailsAfter(bytes) => self.board.cells.borrow_mut().fail_after(*bytes),
            Action::Remember(kept) => self.board.remember(|settings| match kept {
                Kept::Network(network) => {
                    let put = settings.networks.put(network.clone());
                    put.expect("a scenario does not fill the memory like this");
                }
                Kept::Name(name) => settings.name = name.clone(),
                Kept::Start(mode) => settings.start = *mode,
                Kept::AccessPoint(name) => settings.access_point = *name,
                Kept::Waves(on) => settings.waves = *on,
                Kept::UpdateAddress(address) => settings.update_address = Some(address.clone()),
            }),
            Action::Memory(memory) => {
                let mut cells = self.board.cells.borrow_mut();
                match memory {
                    Memory::Empty => cells.erase(),
                    Memory::Garbage => cells.fill_with_garbage(),
                    Memory::Wear(wear) => cells.wear(*wear),
                }
            }
            Action::Press => {
                self.move_button(true)?;
                self.wait(PRESS)?;
                self.move_button(false)?;
            }
            Action::Hold(time) => {
                self.move_button(true)?;
                self.wait(*time)?;
                self.move_button(false)?;
            }
            Action::Button(down) => self.move_button(*down)?,
            Action::Network(ssid, change) => self.change_network(ssid, change)?,
            Action::LoseTheLink => {
                if self.board.air.joined().is_none() {
                    return Err("the machine is in no network".into());
                }
                self.board.air.cut();
            }
            Action::RadioWorks(works) => self.board.air.set_fault(!works),
            Action::ScanTakes(time) => {
                let mut pace = self.board.air.pace();
                pace.scan = *time;
                self.board.air.set_pace(pace);
            }
            Action::JoinTakes(time) => {
                let mut pace = self.board.air.pace();
                pace.join = *time;
                self.board.air.set_pace(pace);
            }
            Action::ComputerLeaves => self.computer = None,
            Action::Client(name, action) => self.client_acts(*name, action)?,
            Action::Server(action) => server::act(&mut self.board, action),
            Action::OneSlot => self.board.two_slots = false,
            Action::Hang => self.board.hang(),
            Action::Wait(time) => self.wait(*time)?,
        }
        self.wait(Duration::MIN)
    }

    /// The machine has just started: what was seen of it before is over.
    pub fn begin(&mut self) {
        self.powered = Instant::now();
        self.acted = self.board.arm.length();
        self.passed = self.acted;
        self.looked = None;
        self.tries_allowed = None;
        self.starts_allowed = false;
    }

    fn client_acts(&mut self, name: char, action: &ClientAction) -> Result<(), String> {
        let client = self.client(name)?;
        if let Some(end) = client.end()
            && *action != ClientAction::Ignore
        {
            return Err(format!("{name} is disconnected ({end:?})"));
        }
        match action {
            ClientAction::Send(bytes) => client.send(bytes),
            ClientAction::StopSending => client.stop_sending(),
            ClientAction::Close => client.close(),
            ClientAction::Reset => client.reset(),
            ClientAction::Die => client.die(),
            ClientAction::Read(reads) => client.read(*reads),
            ClientAction::Ignore => client.ignore(),
        }
        Ok(())
    }

    fn move_button(&mut self, down: bool) -> Result<(), String> {
        for (index, bounce) in BOUNCES.into_iter().enumerate() {
            self.board.button.set(down == (index % 2 == 0));
            self.wait(bounce)?;
        }
        self.board.button.set(down);
        self.wait(Duration::MIN)
    }

    fn change_network(&mut self, ssid: &Ssid, change: &Network) -> Result<(), String> {
        let known = self.networks.iter().position(|old| old.ssid == *ssid);
        let mut network = match known {
            Some(index) => self.networks.remove(index),
            None if change.up == Some(true) => OnAir {
                ssid: ssid.clone(),
                password: None,
                signal_dbm: SIGNAL_DBM,
            },
            None => return Err(format!("network {} was never up", shown(ssid))),
        };
        if let Some(password) = &change.password {
            network.password.clone_from(password);
        }
        network.signal_dbm = change.signal_dbm.unwrap_or(network.signal_dbm);
        let was_up = self.board.air.find(ssid).is_some();
        if change.up.unwrap_or(was_up) {
            self.board.air.put(network.clone());
        } else {
            self.board.air.remove(ssid);
        }
        self.networks.push(network);
        Ok(())
    }

    /// Everything that the machine has done and no line has expected.
    pub fn left_over(&self) -> Option<String> {
        let mut clients = self.clients.iter();
        if let Some(left_over) = clients.find_map(Client::left_over) {
            return Some(left_over);
        }
        if self.board.restarts > 0 {
            return Some("the machine starts again".into());
        }
        let opened = self.board.radio.opened.borrow();
        if let Some(own) = opened.front() {
            return Some(format!("the machine opens {}", offered(own)));
        }
        let tries = self.board.radio.tries.borrow();
        if let Some((ssid, outcome)) = tries.front() {
            return Some(format!("the machine tries {}: {outcome:?}", shown(ssid)));
        }
        // Without power it is dark, whatever was seen before.
        let looked = self.looked.filter(|_| self.board.power.is_on())?;
        (self.board.light.pattern() != Some(looked))
            .then(|| format!("{} (it was {looked})", self.board.light.describe()))
    }
}

impl Default for Stage {
    fn default() -> Self {
        Self::new()
    }
}
