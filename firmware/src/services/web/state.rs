//! What is told about the machine, as JSON.

use super::request::MAX_HEADERS;
use super::{MAX_BODY, SOCKETS};
use crate::services::House;
use crate::services::job::{self, Report};
use crate::services::storage::MemoryHealth;
use crate::services::update::KEY_NAME;
use crate::services::web::query::MAX_NAME_CHARACTERS;
use core::fmt;
use core::net::IpAddr;
use core::sync::atomic::Ordering;
use heapless::Vec;
use protocol_core::arm::Calibration;
use protocol_core::lineus::{InWords, VERSION};
use protocol_core::motion::{
    DEFAULT_STEPS, HOME, MAX_RADIUS, PEN_DOWN, PEN_DOWN_BELOW, PEN_UP, Position, StepSize, Steps,
};
use protocol_core::settings::MachineName;
use protocol_core::text::MAX_LINE;
use protocol_core::update::{self, KeyName, Progress, Version};
use protocol_core::wifi::{Joined, MAX_NETWORKS, Phase, Status};
use serde::{Serialize, Serializer};

/// Longest state in JSON: a test reads the longest one.
pub const MAX_STATE: usize = 1792;

/// Something in words.
pub struct Words<T>(pub T);

impl<T: fmt::Display> Serialize for Words<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

/// Bytes that are nearly always text.
pub struct Lossy<'a>(pub &'a [u8]);

impl fmt::Display for Lossy<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for chunk in self.0.utf8_chunks() {
            out.write_str(chunk.valid())?;
            if !chunk.invalid().is_empty() {
                out.write_str("\u{fffd}")?;
            }
        }
        Ok(())
    }
}

/// A place in whole units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    pub x: i32,
    pub y: i32,
    pub z: i32,
}

impl From<Position> for Place {
    fn from(position: Position) -> Self {
        Self {
            x: position.x.rounded(),
            y: position.y.rounded(),
            z: position.z.rounded(),
        }
    }
}

/// Steps in whole units.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Speed {
    pub pen_down: u32,
    pub pen_up: u32,
}

impl From<Steps> for Speed {
    fn from(steps: Steps) -> Self {
        let rounded = |step: StepSize| {
            let half = 1 << (StepSize::FRACTION_BITS - 1);
            step.bits().saturating_add(half) >> StepSize::FRACTION_BITS
        };
        Self {
            pen_down: rounded(steps.pen_down),
            pen_up: rounded(steps.pen_up),
        }
    }
}

/// What does not change.
#[derive(Serialize)]
pub struct Machine<'a> {
    name: &'a str,
    version: &'static str,
    firmware: Words<Version>,
    update_key: Words<KeyName>,
    serial: u32,
    units_per_mm: u32,
    home: Place,
    area: Area,
    steps: StepLimits,
    limits: Limits,
}

#[derive(Serialize)]
struct Area {
    radius: i32,
    link: i32,
    min_shoulder: i32,
    min_elbow: i32,
    min_x_above: i32,
    min_x_below: i32,
    pen_down: i32,
    pen_up: i32,
    pen_down_below: i32,
}

#[derive(Serialize)]
struct StepLimits {
    pen_down: StepLimit,
    pen_up: StepLimit,
    milliseconds: u32,
}

#[derive(Serialize)]
struct StepLimit {
    least: u8,
    most: u8,
    default: u32,
}

#[derive(Serialize)]
struct Limits {
    drawing: usize,
    line: usize,
    job_name: usize,
    jog: i32,
    body: usize,
    headers: usize,
    networks: usize,
    web_sockets: usize,
}

/// What the machine is.
pub fn machine<'a>(name: &'a MachineName, house: &House) -> Machine<'a> {
    let default = Speed::from(DEFAULT_STEPS);
    Machine {
        name: name.as_str(),
        version: VERSION,
        firmware: Words(Version::FIRMWARE),
        update_key: Words(KEY_NAME),
        serial: house.identity.serial(),
        units_per_mm: 20,
        home: HOME.into(),
        // `reference/arm.md`, drawing area.
        area: Area {
            radius: MAX_RADIUS,
            link: 1000,
            min_shoulder: 10,
            min_elbow: 10,
            min_x_above: 500,
            min_x_below: 700,
            pen_down: PEN_DOWN.rounded(),
            pen_up: PEN_UP.rounded(),
            pen_down_below: PEN_DOWN_BELOW.rounded(),
        },
        steps: StepLimits {
            pen_down: StepLimit {
                least: 1,
                most: 30,
                default: default.pen_down,
            },
            pen_up: StepLimit {
                least: 1,
                most: 100,
                default: default.pen_up,
            },
            milliseconds: 10,
        },
        limits: Limits {
            drawing: house.job.capacity(),
            line: MAX_LINE,
            job_name: MAX_NAME_CHARACTERS,
            jog: super::by_hand::MAX_JOG,
            body: MAX_BODY,
            headers: MAX_HEADERS,
            networks: MAX_NETWORKS,
            web_sockets: SOCKETS,
        },
    }
}

/// How the machine is at one moment.
pub struct Snapshot {
    name: MachineName,
    uptime: u64,
    light: &'static str,
    wifi: Status,
    address: Option<IpAddr>,
    pub position: Position,
    pub moving: bool,
    steps: Steps,
    calibrated: bool,
    clients: u8,
    memory: MemoryHealth,
    last_panic: &'static str,
    update: update::Status,
    pub job: Option<Report>,
}

impl Snapshot {
    /// Now.
    pub fn of(house: &House) -> Self {
        let (position, moving, steps, calibration) = house.arm.with(|machine| {
            (
                machine.position(),
                machine.is_busy(),
                machine.steps(),
                machine.calibration(),
            )
        });
        Self {
            name: house.name(),
            uptime: house.uptime().as_secs(),
            light: house.panel.lamp().name(),
            wifi: house.wifi.status(),
            address: house.address.lock(core::cell::Cell::get),
            position,
            moving,
            steps,
            calibrated: calibration != Calibration::default(),
            clients: house.clients.load(Ordering::Relaxed),
            memory: house.store.health(),
            last_panic: house.vitals.last_panic,
            update: house.update.status(),
            job: house.job.report(),
        }
    }
}

/// The state as it is written.
#[derive(Serialize)]
pub struct State<'a> {
    name: &'a str,
    uptime: u64,
    light: &'a str,
    wifi: Wifi<'a>,
    addresses: &'a [Words<IpAddr>],
    position: Place,
    pen: &'static str,
    moving: bool,
    speed: Speed,
    calibrated: bool,
    clients: u8,
    memory: &'static str,
    problems: &'a [Problem<'a>],
    update: UpdateState,
    job: Option<JobState<'a>>,
}

#[derive(Serialize)]
struct UpdateState {
    phase: &'static str,
    version: Option<Words<Version>>,
    percent: Option<u8>,
    words: Words<update::Status>,
}

impl From<update::Status> for UpdateState {
    fn from(status: update::Status) -> Self {
        let (phase, version, percent) = match status.progress {
            Progress::Idle => ("idle", None, None),
            Progress::Asking => ("asking", None, None),
            Progress::Waiting(version) => ("waiting", Some(version), None),
            Progress::Loading { version, percent } => ("loading", Some(version), Some(percent)),
            Progress::Checking(version) => ("checking", Some(version), None),
            Progress::Restarting(version) => ("starting", Some(version), None),
        };
        Self {
            phase,
            version: version.map(Words),
            percent,
            words: Words(status),
        }
    }
}

#[derive(Serialize)]
struct Wifi<'a> {
    mode: &'static str,
    phase: &'static str,
    network: Option<Words<Lossy<'a>>>,
    refused: Option<Refused<'a>>,
    words: Words<InWords<'a>>,
}

#[derive(Serialize)]
struct Refused<'a> {
    network: Words<Lossy<'a>>,
    reason: Words<Outcome>,
}

struct Outcome(Joined);

impl fmt::Display for Outcome {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Joined::Yes => Ok(()),
            Joined::NotFound => out.write_str("not found"),
            Joined::WrongPassword => out.write_str("wrong password"),
            Joined::Unfit => out.write_str("another protection"),
            Joined::Failed(reason) => write!(out, "failed, reason {reason}"),
        }
    }
}

type Problem<'a> = Words<ProblemText<'a>>;

#[derive(Clone, Copy)]
enum ProblemText<'a> {
    Radio,
    Memory(&'static str),
    Panic(&'a str),
}

/// Longest piece of a panic's text, in characters.
const MAX_PANIC: usize = 100;

impl fmt::Display for ProblemText<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Radio => out.write_str("the radio does not work"),
            Self::Memory(how) => write!(out, "the memory is {how}"),
            Self::Panic(text) => write!(out, "the firmware ended before: {text:.MAX_PANIC$}"),
        }
    }
}

/// A drawing as it is written.
#[derive(Serialize)]
pub struct JobState<'a> {
    id: u32,
    name: &'a str,
    state: &'static str,
    lines: Lines,
    bytes: Bytes,
    seconds: Seconds,
    out_of_reach: OutOfReach,
    whole: bool,
}

#[derive(Serialize)]
struct Lines {
    done: u32,
    total: Option<u32>,
}

#[derive(Serialize)]
struct Bytes {
    received: usize,
    drawn: usize,
    free: usize,
}

#[derive(Serialize)]
struct Seconds {
    drawn: u64,
    left: Option<u64>,
}

#[derive(Serialize)]
struct OutOfReach {
    count: u32,
    line: Option<u32>,
    note: Option<&'static str>,
}

impl<'a> From<&'a job::Report> for JobState<'a> {
    fn from(report: &'a job::Report) -> Self {
        Self {
            id: report.id,
            name: &report.name,
            state: report.state.name(),
            lines: Lines {
                done: report.lines_done,
                total: report.lines_total,
            },
            bytes: Bytes {
                received: report.received,
                drawn: report.drawn,
                free: report.free,
            },
            seconds: Seconds {
                drawn: report.time.as_secs(),
                left: report.left.map(|left| left.as_secs()),
            },
            out_of_reach: OutOfReach {
                count: report.limited,
                line: report.first_limited.map(|(line, _)| line),
                note: report.first_limited.map(|(_, limited)| limited.text()),
            },
            whole: report.whole,
        }
    }
}

/// Does something with a snapshot as it is written.
pub async fn with_state<T>(snapshot: &Snapshot, f: impl AsyncFnOnce(&State<'_>) -> T) -> T {
    let problems = problems(snapshot);
    let addresses = snapshot.address.map(Words);
    f(&state(snapshot, addresses.as_slice(), &problems)).await
}

/// Writes a snapshot into `out`; gives how many bytes, none if it does not fit.
pub fn write_state(snapshot: &Snapshot, out: &mut [u8]) -> usize {
    #[derive(Serialize)]
    struct Message<'a> {
        state: State<'a>,
    }
    let problems = problems(snapshot);
    let addresses = snapshot.address.map(Words);
    let state = state(snapshot, addresses.as_slice(), &problems);
    serde_json_core::to_slice(&Message { state }, out).unwrap_or(0)
}

fn problems(snapshot: &Snapshot) -> Vec<Problem<'_>, 3> {
    let radio = (snapshot.wifi.phase == Phase::Fault).then_some(ProblemText::Radio);
    let memory = match snapshot.memory {
        MemoryHealth::Fresh | MemoryHealth::Sound | MemoryHealth::Repaired => None,
        health => Some(ProblemText::Memory(health.text())),
    };
    let panic = match snapshot.last_panic {
        "" => None,
        text => Some(ProblemText::Panic(text)),
    };
    [radio, memory, panic]
        .into_iter()
        .flatten()
        .map(Words)
        .collect()
}

fn state<'a>(
    snapshot: &'a Snapshot,
    addresses: &'a [Words<IpAddr>],
    problems: &'a [Problem<'a>],
) -> State<'a> {
    let (phase, network) = match &snapshot.wifi.phase {
        Phase::Searching => ("searching", None),
        Phase::Connected(ssid) => ("connected", Some(ssid)),
        Phase::Setup => ("setup", None),
        Phase::Trying(ssid) => ("trying", Some(ssid)),
        Phase::Fault => ("fault", None),
    };
    let refused = snapshot.wifi.refused.as_ref();
    State {
        name: snapshot.name.as_str(),
        uptime: snapshot.uptime,
        light: snapshot.light,
        wifi: Wifi {
            mode: match snapshot.wifi.setup {
                true => "setup",
                false => "station",
            },
            phase,
            network: network.map(|ssid| Words(Lossy(ssid.as_bytes()))),
            refused: refused.map(|(ssid, outcome)| Refused {
                network: Words(Lossy(ssid.as_bytes())),
                reason: Words(Outcome(*outcome)),
            }),
            words: Words(InWords(&snapshot.wifi)),
        },
        addresses,
        position: snapshot.position.into(),
        pen: match snapshot.position.pen_is_down() {
            true => "down",
            false => "up",
        },
        moving: snapshot.moving,
        speed: snapshot.steps.into(),
        calibrated: snapshot.calibrated,
        clients: snapshot.clients,
        memory: snapshot.memory.text(),
        problems,
        update: snapshot.update.into(),
        job: snapshot.job.as_ref().map(JobState::from),
    }
}

impl Snapshot {
    /// The same without what changes all the time, to see whether anything else has changed.
    pub fn at_rest(&mut self) -> (u64, Position, bool) {
        (
            core::mem::take(&mut self.uptime),
            core::mem::replace(&mut self.position, HOME),
            core::mem::take(&mut self.moving),
        )
    }

    /// With that again.
    pub fn restore(&mut self, (uptime, position, moving): (u64, Position, bool)) {
        self.uptime = uptime;
        self.position = position;
        self.moving = moving;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_time::Duration;
    use protocol_core::machine::Limited;
    use protocol_core::wifi::Ssid;

    #[test]
    fn the_longest_state_fits() {
        // Every byte of a name in the longest form that JSON has for it.
        let ssid = Ssid::new(&[1; 32]).unwrap();
        let snapshot = Snapshot {
            name: MachineName::new(&"x".repeat(32)).unwrap(),
            uptime: u64::MAX / 1_000_000,
            light: "red, three short flashes",
            wifi: Status {
                setup: true,
                phase: Phase::Trying(ssid.clone()),
                refused: Some((ssid, Joined::Failed(u16::MAX))),
            },
            address: Some("255.255.255.255".parse().unwrap()),
            position: Position::from_units(-1950, -1950, 1000),
            moving: false,
            steps: DEFAULT_STEPS,
            calibrated: false,
            clients: u8::MAX,
            memory: MemoryHealth::Single,
            last_panic: &"\"".repeat(200).leak()[..],
            update: update::Status {
                refused: Some(update::Rejection::WrongLength {
                    offered: u32::MAX,
                    expected: u32::MAX,
                }),
                ..update::Status::NONE
            },
            job: Some(Report {
                id: u32::MAX,
                name: heapless::String::try_from("\u{1f4}".repeat(32).as_str()).unwrap(),
                state: job::State::Stopping,
                lines_done: u32::MAX,
                lines_total: Some(u32::MAX),
                received: u32::MAX as usize,
                drawn: u32::MAX as usize,
                free: u32::MAX as usize,
                time: Duration::MAX,
                left: Some(Duration::MAX),
                limited: u32::MAX,
                first_limited: Some((u32::MAX, Limited::Target { lifted: true })),
                whole: false,
            }),
        };
        let mut out = [0; MAX_STATE];
        let length = write_state(&snapshot, &mut out);
        assert!(length > 1000, "{length}");
    }

    #[test]
    fn names_that_are_no_text() {
        let mut out = [0; 64];
        let length = serde_json_core::to_slice(&Words(Lossy(b"a\"\xff\n")), &mut out).unwrap();
        assert_eq!(&out[..length], "\"a\\\"\u{fffd}\\n\"".as_bytes());
    }
}
