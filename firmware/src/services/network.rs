//! WiFi: does with the radio what the policy of the core says, and tells the policy how it went.
//!
//! Commands and the button reach the policy as inputs, at any time; what the radio is doing is given up
//! when there is something else to do.

use super::House;
use crate::board::{Address, Radio};
use crate::log::{info, warning};
use core::cell::RefCell;
use core::pin::pin;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use heapless::Vec;
use protocol_core::machine::Client;
use protocol_core::motion::Micros;
use protocol_core::panel::Gesture;
use protocol_core::settings::Settings;
use protocol_core::wifi::{
    Effect, Event, Heard, Job, Joined, MAX_HEARD, Network, Phase, Policy, Status,
};

/// Time for the reply to `M587` or `M171` to reach its client before the network changes.
const GRACE: Duration = Duration::from_millis(500);
/// Longest time that a list of networks takes; clients wait 5 s for a reply.
const LIST_AT_MOST: Duration = Duration::from_secs(4);
/// Inputs that may wait; a press or a command more than that is lost.
const INPUTS: usize = 4;

/// What comes from outside the radio.
enum Input {
    Press(Gesture),
    Try(Network),
    Changed,
    Restart,
    /// Somebody wants to know what is in the air.
    List,
}

/// The way of the other services to the network.
pub struct Wifi {
    inputs: Channel<CriticalSectionRawMutex, Input, INPUTS>,
    /// Networks that were joined and are to be remembered as soon as the arm rests.
    joined: Channel<CriticalSectionRawMutex, Network, 1>,
    status: Mutex<CriticalSectionRawMutex, RefCell<Status>>,
    heard: Mutex<CriticalSectionRawMutex, RefCell<Vec<Heard, MAX_HEARD>>>,
    /// The radio has time to listen.
    idle: AtomicBool,
    /// Networks that were joined or opened so far.
    connection: AtomicU32,
    listed: Signal<CriticalSectionRawMutex, ()>,
}

impl Default for Wifi {
    fn default() -> Self {
        Self::new()
    }
}

impl Wifi {
    /// With nothing known.
    pub const fn new() -> Self {
        Self {
            inputs: Channel::new(),
            joined: Channel::new(),
            status: Mutex::new(RefCell::new(Status {
                setup: false,
                phase: Phase::Searching,
                refused: None,
            })),
            heard: Mutex::new(RefCell::new(Vec::new())),
            idle: AtomicBool::new(false),
            connection: AtomicU32::new(0),
            listed: Signal::new(),
        }
    }

    /// What the network is doing.
    pub fn status(&self) -> Status {
        self.status.lock(|status| status.borrow().clone())
    }

    /// Another number for each time that a network was joined, or the own one opened.
    pub fn connection(&self) -> u32 {
        self.connection.load(Ordering::Relaxed)
    }

    fn connected(&self) {
        // Nobody else writes it.
        let connection = self.connection().wrapping_add(1);
        self.connection.store(connection, Ordering::Relaxed);
    }

    /// Whether the machine is on its own network, for setup.
    pub fn is_setup(&self) -> bool {
        self.status.lock(|status| status.borrow().setup)
    }

    /// Leaves the own network for this one, a little later; it is remembered if it can be joined.
    pub fn attempt(&self, network: Network) {
        self.put(Input::Try(network));
    }

    /// The remembered networks have changed.
    pub(super) fn changed(&self) {
        self.put(Input::Changed);
    }

    /// Everything has been forgotten: begins anew, a little later.
    pub fn restart(&self) {
        self.put(Input::Restart);
    }

    /// The button was pressed.
    pub fn press(&self, gesture: Gesture) {
        self.put(Input::Press(gesture));
    }

    /// Does something with the networks in the air, strongest first: as they are heard now, or where the
    /// radio is busy with something else, as they were heard last.
    pub async fn with_heard<T>(&self, f: impl FnOnce(&[Heard]) -> T) -> T {
        if self.idle.load(Ordering::Relaxed) {
            self.listed.reset();
            self.put(Input::List);
            // A radio that takes longer is told about as it was.
            let _ = with_timeout(LIST_AT_MOST, self.listed.wait()).await;
        }
        self.heard.lock(|heard| f(&heard.borrow()))
    }

    /// Stores a network that was joined, as soon as the arm rests.
    fn remember(&self, network: Network) {
        if self.joined.try_send(network).is_err() {
            warning!("the network that was joined is not remembered: another one waits");
        }
    }

    fn put(&self, input: Input) {
        if self.inputs.try_send(input).is_err() {
            warning!("the network has too much to do: a press or a command is lost");
        }
    }
}

/// The network service, for ever.
pub async fn run(house: &House, radio: impl Radio, address: impl Address) -> ! {
    let policy = house.settings(|settings| Policy::new(settings, house.identity.serial()));
    let service = Service {
        house,
        radio,
        address,
        policy,
        heard: Vec::new(),
        is_open: false,
        is_joined: false,
    };
    join(service.run(), remember(house)).await.0
}

/// Stores networks that were joined; apart from the radio's jobs, because the arm may draw for hours.
async fn remember(house: &House) -> ! {
    loop {
        let network = house.wifi.joined.receive().await;
        let put = |settings: &mut Settings| {
            if settings.networks.put(network).is_err() {
                warning!("there is no place for the network that was joined");
            }
        };
        if house.change(Client::HOUSE, put).await.is_err() {
            warning!("the network that was joined could not be stored");
        }
    }
}

struct Service<'a, R, A> {
    house: &'a House,
    radio: R,
    address: A,
    policy: Policy,
    heard: Vec<Heard, MAX_HEARD>,
    /// The own network is open.
    is_open: bool,
    /// A network is joined, or an attempt to join was given up.
    is_joined: bool,
}

impl<R: Radio, A: Address> Service<'_, R, A> {
    async fn run(mut self) -> ! {
        loop {
            self.tell();
            self.give_up_what_does_not_fit().await;
            if let Some(input) = self.work().await {
                self.take(input).await;
            }
        }
    }

    fn tell(&self) {
        let wifi = &self.house.wifi;
        wifi.status
            .lock(|status| *status.borrow_mut() = self.policy.status());
        let idle = matches!(self.policy.job(), Job::Stay | Job::Pause(_) | Job::Host);
        wifi.idle.store(idle, Ordering::Relaxed);
        self.house.panel.show(self.policy.lamp());
    }

    /// Leaves the network, or closes the own one, when the job is another one now.
    async fn give_up_what_does_not_fit(&mut self) {
        let job = self.policy.job();
        if self.is_joined && job != Job::Stay {
            self.radio.leave().await;
            self.is_joined = false;
        }
        if self.is_open && job != Job::Host {
            if self.radio.close_access_point().await.is_err() {
                warning!("setup network not closed");
            }
            self.is_open = false;
        }
    }

    /// Does the job until it is done, or there is an input.
    async fn work(&mut self) -> Option<Input> {
        let inputs = &self.house.wifi.inputs;
        match self.policy.job() {
            Job::Scan => {
                let scan = self.radio.scan(&mut self.heard);
                match select(scan, inputs.receive()).await {
                    Either::First(scanned) => {
                        keep_heard(&self.heard, &self.house.wifi);
                        let heard = core::mem::take(&mut self.heard);
                        self.on(Event::Scanned(scanned.is_ok().then_some(&heard)));
                        None
                    }
                    Either::Second(input) => Some(input),
                }
            }
            Job::Join(network) => match select(self.radio.join(network), inputs.receive()).await {
                Either::First(joined) => {
                    match joined {
                        Joined::Yes => {
                            info!("network joined");
                            self.address.ask();
                            self.house.wifi.connected();
                            self.is_joined = true;
                        }
                        Joined::NotFound => warning!("network not found"),
                        Joined::WrongPassword => warning!("network refuses the password"),
                        Joined::Unfit => warning!("network has another protection"),
                        Joined::Failed(reason) => warning!("network not joined, reason {}", reason),
                    }
                    self.on(Event::Joined(joined));
                    None
                }
                Either::Second(input) => {
                    self.is_joined = true;
                    Some(input)
                }
            },
            Job::Stay => match select(self.radio.lost(), inputs.receive()).await {
                Either::First(()) => {
                    warning!("network lost");
                    self.is_joined = false;
                    self.on(Event::Lost);
                    None
                }
                Either::Second(input) => Some(input),
            },
            Job::Pause(until) => {
                let until = Instant::from_micros(until.get());
                match select(Timer::at(until), inputs.receive()).await {
                    Either::First(()) => {
                        self.on(Event::Elapsed);
                        None
                    }
                    Either::Second(input) => Some(input),
                }
            }
            Job::Open(own) => {
                self.is_open = self.radio.open_access_point(own).await.is_ok();
                match self.is_open {
                    true => {
                        self.house.wifi.connected();
                        info!("setup network opened");
                    }
                    false => warning!("setup network not opened"),
                }
                self.on(Event::Opened(self.is_open));
                None
            }
            Job::Host => {
                // Guests get their addresses also while the radio listens.
                let mut serving = pin!(self.address.serve_guests());
                loop {
                    let input = match select(&mut serving, inputs.receive()).await {
                        Either::First(never) => never,
                        Either::Second(Input::List) => {
                            let scan = self.radio.scan(&mut self.heard);
                            let _ = select(&mut serving, scan).await;
                            keep_heard(&self.heard, &self.house.wifi);
                            self.house.wifi.listed.signal(());
                            continue;
                        }
                        // The own network goes on until the reply to M587 has reached its client.
                        Either::Second(input @ Input::Try(_)) => {
                            select(&mut serving, Timer::after(GRACE)).await;
                            input
                        }
                        Either::Second(input) => input,
                    };
                    return Some(input);
                }
            }
        }
    }

    async fn take(&mut self, input: Input) {
        match input {
            Input::Press(Gesture::Short) if self.house.drawing_for_button().is_some() => {
                self.on(Event::PressToDraw);
            }
            Input::Press(gesture) => self.on(Event::Press(gesture)),
            Input::Try(network) => self.on(Event::Try(network)),
            Input::Changed => self.on(Event::Changed),
            Input::Restart => {
                // The network goes on until the reply to M171 has reached its client.
                Timer::after(GRACE).await;
                self.on(Event::Restart);
            }
            Input::List => {
                if self.house.wifi.idle.load(Ordering::Relaxed)
                    && self.radio.scan(&mut self.heard).await.is_ok()
                {
                    keep_heard(&self.heard, &self.house.wifi);
                }
                self.house.wifi.listed.signal(());
            }
        }
    }

    fn on(&mut self, event: Event<'_>) {
        let now = Micros::new(Instant::now().as_micros());
        let policy = &mut self.policy;
        let effect = self
            .house
            .settings(|settings| policy.on(event, settings, now));
        match effect {
            Some(Effect::Remember(network)) => self.house.wifi.remember(network),
            Some(Effect::Confirm) => {
                self.house.wave();
            }
            Some(Effect::Draw) => self.house.draw_by_button(),
            None => {}
        }
    }
}

/// For whoever asks.
fn keep_heard(heard: &Vec<Heard, MAX_HEARD>, wifi: &Wifi) {
    wifi.heard.lock(|kept| kept.borrow_mut().clone_from(heard));
}
