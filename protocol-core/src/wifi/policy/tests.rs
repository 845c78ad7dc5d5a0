extern crate std;
use super::super::{Password, Security};
use super::*;
use proptest::prelude::*;
use std::string::{String as StdString, ToString};
use std::vec::Vec as StdVec;

const SERIAL: u32 = 123_456;
const NOW: Micros = Micros::from_secs(100);

fn ssid(name: &str) -> Ssid {
    Ssid::new(name.as_bytes()).unwrap()
}

fn network(name: &str) -> Network {
    Network {
        ssid: ssid(name),
        password: Password::new(b"correct horse"),
    }
}

fn settings(names: &[&str]) -> Settings {
    let mut settings = Settings::default();
    for name in names {
        settings.networks.put(network(name)).unwrap();
    }
    settings
}

fn heard(name: &str, signal_dbm: i8) -> Heard {
    Heard {
        ssid: ssid(name),
        security: Security::Password,
        signal_dbm,
    }
}

/// A policy with its settings, and what it does in words.
struct Bench {
    policy: Policy,
    settings: Settings,
}

impl Bench {
    fn new(settings: Settings) -> Self {
        Self {
            policy: Policy::new(&settings, SERIAL),
            settings,
        }
    }

    fn on(&mut self, event: Event<'_>) -> Option<Effect> {
        self.policy.on(event, &self.settings, NOW)
    }

    fn hears(&mut self, networks: &[Heard]) {
        assert_eq!(self.policy.job(), Job::Scan);
        assert_eq!(self.on(Event::Scanned(Some(networks))), None);
    }

    /// A press, which is confirmed.
    fn press(&mut self, gesture: Gesture) {
        assert_eq!(self.on(Event::Press(gesture)), Some(Effect::Confirm));
    }

    fn job(&self) -> StdString {
        let name = |ssid: &Ssid| StdString::from_utf8_lossy(ssid.as_bytes()).into_owned();
        match self.policy.job() {
            Job::Scan => "scan".to_string(),
            Job::Join(network) => std::format!("join {}", name(&network.ssid)),
            Job::Stay => "stay".to_string(),
            Job::Pause(until) => std::format!("pause {}", (until - NOW).get() / 1_000_000),
            Job::Open(own) => match &own.password {
                None => std::format!("open {}", name(&own.ssid)),
                Some(password) => std::format!(
                    "open {}, {}",
                    name(&own.ssid),
                    StdString::from_utf8_lossy(password.as_bytes())
                ),
            },
            Job::Host => "host".to_string(),
        }
    }

    fn connected(names: &[&str]) -> Self {
        let mut bench = Self::new(settings(names));
        bench.hears(&[]);
        bench.on(Event::Joined(Joined::Yes));
        assert_eq!(bench.job(), "stay");
        bench
    }

    fn hosting(settings: Settings) -> Self {
        let mut bench = Self::new(settings);
        if bench.policy.lamp() != Lamp::Setup {
            bench.press(Gesture::Long);
        }
        bench.hears(&[]);
        bench.on(Event::Opened(true));
        assert_eq!(bench.job(), "host");
        bench
    }
}

#[test]
fn the_own_network_has_the_password_that_is_set_when_it_is_opened() {
    let mut settings = settings(&[]);
    settings.own_password = Password::new(b"battery staple");
    let mut bench = Bench::new(settings);
    bench.hears(&[]);
    assert_eq!(bench.job(), "open Line-us-Setup, battery staple");
    bench.on(Event::Opened(true));
    // Guests are not thrown out.
    bench.settings.own_password = None;
    bench.on(Event::Changed);
    assert_eq!(bench.job(), "host");
    bench.on(Event::Restart);
    bench.hears(&[]);
    assert_eq!(bench.job(), "open Line-us-Setup");
}

#[test]
fn the_start_mode_decides_and_without_networks_it_is_setup() {
    for (start, names, lamp) in [
        (StartMode::Station, &["home"][..], Lamp::Searching),
        (StartMode::Station, &[], Lamp::Setup),
        (StartMode::StationLongPress, &["home"], Lamp::Searching),
        (StartMode::AccessPoint, &["home"], Lamp::Setup),
        (StartMode::AccessPointLocked, &["home"], Lamp::Setup),
    ] {
        let mut settings = settings(names);
        settings.start = start;
        let policy = Policy::new(&settings, SERIAL);
        assert_eq!(policy.lamp(), lamp, "{start:?} {names:?}");
        assert_eq!(policy.job(), Job::Scan);
    }
}

#[test]
fn the_strongest_comes_first_and_what_is_not_heard_last() {
    let mut bench = Bench::new(settings(&["hidden", "weak", "strong"]));
    bench.hears(&[
        heard("weak", -80),
        heard("stranger", -30),
        heard("strong", -60),
        heard("strong", -40),
    ]);
    for name in ["strong", "weak", "hidden"] {
        assert_eq!(bench.job(), std::format!("join {name}"));
        bench.on(Event::Joined(Joined::NotFound));
    }
    assert_eq!(bench.job(), "pause 5");
}

#[test]
fn pauses_grow_up_to_the_last_and_start_anew_after_a_success() {
    let mut bench = Bench::new(settings(&["home"]));
    for seconds in [5, 10, 20, 40, 60, 60, 60] {
        bench.hears(&[]);
        bench.on(Event::Joined(Joined::NotFound));
        assert_eq!(bench.job(), std::format!("pause {seconds}"));
        bench.on(Event::Elapsed);
    }
    bench.hears(&[]);
    bench.on(Event::Joined(Joined::Yes));
    bench.on(Event::Lost);
    assert_eq!(bench.policy.lamp(), Lamp::Searching);
    bench.hears(&[]);
    bench.on(Event::Joined(Joined::NotFound));
    assert_eq!(bench.job(), "pause 5");
}

#[test]
fn a_wrong_password_is_told_apart_from_a_network_that_is_not_there() {
    let mut bench = Bench::new(settings(&["home", "office"]));
    bench.hears(&[heard("home", -40)]);
    bench.on(Event::Joined(Joined::WrongPassword));
    assert_eq!(bench.job(), "join office");
    bench.on(Event::Joined(Joined::NotFound));
    let refused = bench.policy.status().refused;
    assert_eq!(refused, Some((ssid("home"), Joined::WrongPassword)));
    bench.on(Event::Elapsed);
    bench.hears(&[]);
    bench.on(Event::Joined(Joined::NotFound));
    let refused = bench.policy.status().refused;
    assert_eq!(refused, Some((ssid("home"), Joined::NotFound)));
    bench.on(Event::Joined(Joined::Yes));
    assert_eq!(bench.policy.status().refused, None);
}

#[test]
fn a_short_press_while_searching_tries_the_next_one() {
    let mut bench = Bench::new(settings(&["a", "b", "c"]));
    bench.press(Gesture::Short);
    for name in ["a", "b", "c", "a"] {
        assert_eq!(bench.job(), std::format!("join {name}"));
        bench.press(Gesture::Short);
    }
    // Those that follow are tried as well, each once.
    for name in ["b", "c", "a"] {
        assert_eq!(bench.job(), std::format!("join {name}"));
        bench.on(Event::Joined(Joined::NotFound));
    }
    assert_eq!(bench.job(), "pause 5");
    bench.press(Gesture::Short);
    assert_eq!(bench.job(), "join a");
}

#[test]
fn presses_in_the_network_and_in_setup() {
    let mut bench = Bench::connected(&["home"]);
    bench.press(Gesture::Short);
    assert_eq!(bench.job(), "stay");
    bench.press(Gesture::Long);
    assert_eq!(bench.policy.lamp(), Lamp::Setup);
    for gesture in [Gesture::Short, Gesture::Long] {
        let mut bench = Bench::hosting(settings(&["home"]));
        bench.press(gesture);
        assert_eq!(bench.policy.lamp(), Lamp::Searching, "{gesture:?}");
    }
    // There is nothing to go back to.
    let mut bench = Bench::hosting(settings(&[]));
    bench.press(Gesture::Short);
    assert_eq!(bench.job(), "host");
    bench.press(Gesture::Long);
    assert_eq!(bench.policy.lamp(), Lamp::Setup);
}

#[test]
fn with_a_drawing_to_draw_a_press_leaves_the_network_alone() {
    let mut bench = Bench::connected(&["home"]);
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Draw));
    assert_eq!(bench.job(), "stay");
    let mut bench = Bench::hosting(settings(&["home"]));
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Draw));
    assert_eq!(bench.job(), "host");
    let mut bench = Bench::new(settings(&[]));
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Draw));
    assert_eq!(bench.job(), "scan");
}

#[test]
fn while_a_network_is_looked_for_a_press_is_about_that() {
    let mut bench = Bench::new(settings(&["home", "work"]));
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Confirm));
    assert_eq!(bench.job(), "join home");
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Confirm));
    assert_eq!(bench.job(), "join work");
    let mut bench = Bench::hosting(settings(&[]));
    bench.on(Event::Try(network("new")));
    assert_eq!(bench.on(Event::PressToDraw), Some(Effect::Confirm));
    assert_eq!(bench.policy.lamp(), Lamp::Setup);
}

#[test]
fn a_locked_access_point_ignores_the_long_press() {
    let mut locked = settings(&["home"]);
    locked.start = StartMode::AccessPointLocked;
    let mut bench = Bench::hosting(locked);
    assert_eq!(bench.on(Event::Press(Gesture::Long)), None);
    assert_eq!(bench.job(), "host");
}

#[test]
fn a_network_tried_in_setup_is_remembered_only_when_it_was_joined() {
    for outcome in [Joined::WrongPassword, Joined::NotFound, Joined::Failed(8)] {
        let mut bench = Bench::hosting(settings(&[]));
        assert_eq!(bench.on(Event::Try(network("new"))), None);
        assert_eq!(bench.job(), "join new");
        assert_eq!(bench.policy.lamp(), Lamp::Searching);
        assert!(bench.policy.status().setup);
        assert_eq!(bench.on(Event::Joined(outcome)), None);
        assert_eq!(bench.policy.lamp(), Lamp::Setup);
        let refused = bench.policy.status().refused;
        assert_eq!(refused, Some((ssid("new"), outcome)));
    }
    let mut bench = Bench::hosting(settings(&[]));
    bench.on(Event::Try(network("new")));
    let effect = bench.on(Event::Joined(Joined::Yes));
    assert_eq!(effect, Some(Effect::Remember(network("new"))));
    assert_eq!(bench.policy.lamp(), Lamp::Connected);
    assert!(!bench.policy.status().setup);
}

#[test]
fn a_press_gives_up_the_attempt() {
    for gesture in [Gesture::Short, Gesture::Long] {
        let mut bench = Bench::hosting(settings(&["home"]));
        bench.on(Event::Try(network("new")));
        bench.press(gesture);
        assert_eq!(bench.policy.lamp(), Lamp::Setup, "{gesture:?}");
    }
}

#[test]
fn an_attempt_that_comes_too_late_is_dropped() {
    let mut bench = Bench::connected(&["home"]);
    assert_eq!(bench.on(Event::Try(network("new"))), None);
    assert_eq!(bench.job(), "stay");
}

#[test]
fn changed_networks_matter_while_searching_alone() {
    let mut bench = Bench::connected(&["home"]);
    bench.settings = settings(&[]);
    bench.on(Event::Changed);
    assert_eq!(bench.job(), "stay");
    bench.on(Event::Lost);
    assert_eq!(bench.policy.lamp(), Lamp::Setup);

    let mut bench = Bench::new(settings(&["home"]));
    bench.hears(&[]);
    bench.settings = settings(&["home", "new"]);
    bench.on(Event::Changed);
    assert_eq!(bench.job(), "scan");
    bench.settings = settings(&[]);
    bench.on(Event::Changed);
    assert_eq!(bench.policy.lamp(), Lamp::Setup);

    let mut bench = Bench::hosting(settings(&[]));
    bench.settings = settings(&["new"]);
    bench.on(Event::Changed);
    assert_eq!(bench.job(), "host");
}

#[test]
fn the_own_network_has_a_name_of_its_own() {
    let long = "abcdefghijklmnopqrstuvwxyz012345";
    for (access_point, machine, around, name) in [
        (AccessPointName::Setup, "rob", "", "Line-us-Setup"),
        (
            AccessPointName::Setup,
            "rob",
            "Line-us-Setup",
            "Line-us-Setup-123456",
        ),
        (AccessPointName::Setup, "rob", "rob", "Line-us-Setup"),
        (AccessPointName::Machine, "rob", "Line-us-Setup", "rob"),
        (AccessPointName::Machine, "rob", "rob", "rob-123456"),
        (AccessPointName::Machine, long, "", long),
        (
            AccessPointName::Machine,
            long,
            long,
            "abcdefghijklmnopqrstuvwxy-123456",
        ),
    ] {
        let mut settings = settings(&[]);
        settings.access_point = access_point;
        settings.name = crate::settings::MachineName::new(machine).unwrap();
        let mut bench = Bench::new(settings);
        let around: StdVec<_> = (!around.is_empty())
            .then(|| heard(around, -50))
            .into_iter()
            .collect();
        bench.hears(&around);
        assert_eq!(bench.job(), std::format!("open {name}"));
    }
}

#[test]
fn a_radio_that_does_not_work_is_shown_and_tried_again() {
    let mut bench = Bench::hosting(settings(&["home"]));
    bench.press(Gesture::Long);
    assert_eq!(bench.on(Event::Scanned(None)), None);
    assert_eq!(
        (bench.policy.lamp(), bench.job()),
        (Lamp::Error, "pause 5".into())
    );
    assert_eq!(bench.policy.status().phase, Phase::Fault);
    bench.on(Event::Elapsed);
    bench.hears(&[]);
    assert_eq!(bench.policy.lamp(), Lamp::Searching);

    let mut bench = Bench::new(settings(&[]));
    bench.on(Event::Scanned(None));
    assert_eq!(bench.job(), "open Line-us-Setup");
    bench.on(Event::Opened(false));
    assert_eq!(
        (bench.policy.lamp(), bench.job()),
        (Lamp::Error, "pause 5".into())
    );
    assert!(bench.policy.status().setup);
    bench.on(Event::Elapsed);
    bench.hears(&[]);
    bench.on(Event::Opened(true));
    assert_eq!(bench.policy.lamp(), Lamp::Setup);
}

#[test]
fn forgetting_everything_starts_anew() {
    let mut bench = Bench::connected(&["home"]);
    bench.settings = Settings::default();
    bench.on(Event::Restart);
    assert_eq!(bench.policy.lamp(), Lamp::Setup);
}

fn any_event() -> impl Strategy<Value = u8> {
    0..15u8
}

proptest! {
    /// Whatever happens in whatever order: a network is remembered only right after it was joined, the
    /// own network is opened in setup alone, and what is joined by a station is a remembered network.
    #[test]
    fn no_order_of_events_leads_astray(
        events in proptest::collection::vec(any_event(), 0..60),
        known in 0..3usize,
        start in 1..=4u8,
    ) {
        let mut known = settings(["a", "b", "c"].get(..known).unwrap());
        known.start = StartMode::from_number(start).unwrap();
        let mut bench = Bench::new(known);
        for event in events {
            let around = [heard("b", -50), heard("a", -60)];
            let event = match event {
                0 => Event::Scanned(Some(&around)),
                1 => Event::Scanned(None),
                2 => Event::Joined(Joined::Yes),
                3 => Event::Joined(Joined::NotFound),
                4 => Event::Joined(Joined::WrongPassword),
                5 => Event::Lost,
                6 => Event::Opened(true),
                7 => Event::Opened(false),
                8 => Event::Elapsed,
                9 => Event::Press(Gesture::Short),
                10 => Event::Press(Gesture::Long),
                11 => Event::Try(network("new")),
                14 => Event::PressToDraw,
                12 => {
                    bench.settings.networks.clear();
                    Event::Changed
                }
                _ => {
                    let _ = bench.settings.networks.put(network("c"));
                    Event::Changed
                }
            };
            let joining = bench.job();
            let success = event == Event::Joined(Joined::Yes);
            let effect = bench.on(event);
            if let Some(Effect::Remember(network)) = effect {
                prop_assert!(success);
                prop_assert_eq!(joining, std::format!("join {}", std::str::from_utf8(network.ssid.as_bytes()).unwrap()));
                bench.settings.networks.put(network).unwrap();
            }
            let status = bench.policy.status();
            match bench.policy.job() {
                Job::Open(_) | Job::Host => prop_assert!(status.setup),
                Job::Join(network) if !status.setup => {
                    prop_assert!(bench.settings.networks.find(&network.ssid).is_some());
                }
                Job::Stay => prop_assert!(!status.setup),
                _ => {}
            }
        }
    }
}
