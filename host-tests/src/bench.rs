//! The core's sessions and machine wired as the firmware's services wire them, without sockets, tasks
//! and real time: a line in, a reply out, and every set-point on record.

use protocol_core::arm::{Calibration, Compensation, Directions};
use protocol_core::drawings::{ButtonDraws, Contents, Space};
use protocol_core::lineus::{Diagnostics, Identity, Reply, Request, Session};
use protocol_core::machine::{ArmData, Client, Errand, MAX_CLIENTS, Machine, Report, SetPoint};
use protocol_core::motion::{MOST_DWELL, Micros};
use protocol_core::settings::{MachineName, Settings};
use protocol_core::update;
use protocol_core::wifi::{Networks, Phase, Status};
use std::array;

/// Between two set-points where a test does not say otherwise, in microseconds.
pub const FRAME_US: u64 = 10_000;
/// No move takes longer than this many frames: the longest way, Z or across the sheet, is below 4000
/// units, at 1 unit and 10 ms a step 40 s.
const PATIENCE_US: u64 = 100_000_000;

const IDENTITY: Identity = Identity {
    mac: [0x02, 0, 0, 1, 2, 3],
};

/// What became of one line.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The whole message, terminator included.
    pub bytes: String,
    /// The line was refused.
    pub is_error: bool,
    /// The move it began.
    pub report: Option<Report>,
    /// When that move ends.
    pub end_us: Option<u64>,
}

impl Answer {
    /// The message without its terminator.
    pub fn text(&self) -> &str {
        self.bytes.trim_end_matches(['\r', '\n', '\0'])
    }
}

/// A set-point with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// From the start, in microseconds.
    pub time_us: u64,
    /// What the servos are told.
    pub set_point: SetPoint,
}

/// An arm with four clients that speak one at a time.
pub struct Bench {
    machine: Machine,
    sessions: [Session; MAX_CLIENTS],
    name: MachineName,
    frame_us: u64,
    next_us: u64,
    /// A dwell is cut off here, so that inputs of all kinds do not stand still for hours.
    pub longest_dwell: Micros,
    /// All set-points so far.
    pub frames: Vec<Frame>,
}

impl Default for Bench {
    fn default() -> Self {
        Self::new(FRAME_US, Calibration::default())
    }
}

impl Bench {
    /// An arm at home at time 0 that gives a set-point each `frame_us`.
    pub fn new(frame_us: u64, calibration: Calibration) -> Self {
        Self {
            machine: Machine::new(ArmData::default(), calibration),
            sessions: array::from_fn(|_| Session::new()),
            name: MachineName::default(),
            frame_us,
            next_us: 0,
            longest_dwell: MOST_DWELL,
            frames: Vec::new(),
        }
    }

    /// The arm itself.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Its name.
    pub fn name(&self) -> &str {
        self.name.as_str()
    }

    /// One line of a client, and its answer: the arm moves until there is one.
    ///
    /// # Panics
    /// When there is not exactly one.
    pub fn say(&mut self, client: u8, line: &str) -> Answer {
        let mut answers = self.send(client, format!("{line}\n").as_bytes());
        assert_eq!(answers.len(), 1, "{line:?} is answered by {answers:?}");
        answers.remove(0)
    }

    /// Bytes of a client, and the answers to the lines that end in them.
    pub fn send(&mut self, client: u8, bytes: &[u8]) -> Vec<Answer> {
        let (mut input, mut reply, mut answers) = (bytes, Reply::new(), Vec::new());
        let session = usize::from(client);
        while let Some(request) = self.sessions[session].next_request(&mut input, &mut reply) {
            let report = self.perform(request, client, &mut reply);
            let moving = matches!(report, Some(Report::Moving { .. }));
            answers.push(Answer {
                bytes: String::from_utf8(reply.as_bytes().to_vec()).expect("a reply is UTF-8"),
                is_error: reply.is_error(),
                report,
                end_us: self
                    .machine
                    .next_event()
                    .filter(|_| moving)
                    .map(Micros::get),
            });
        }
        answers
    }

    /// The next servo frame, and whatever begins before it.
    pub fn tick(&mut self) -> SetPoint {
        let now = self.next_us;
        while let Some(event) = self.machine.next_event().filter(|event| event.get() < now) {
            self.machine.advance(event);
        }
        self.frame(now)
    }

    /// Ticks until the arm rests, and gives the last set-point.
    pub fn rest(&mut self) -> SetPoint {
        let begun = self.next_us;
        loop {
            let set_point = self.tick();
            if !self.machine.is_busy() {
                return set_point;
            }
            assert!(
                self.next_us - begun < PATIENCE_US,
                "the arm does not come to rest"
            );
        }
    }

    fn frame(&mut self, now: u64) -> SetPoint {
        let set_point = self.machine.tick(Micros::new(now));
        self.frames.push(Frame {
            time_us: now,
            set_point,
        });
        self.next_us += self.frame_us;
        set_point
    }

    fn perform(&mut self, request: Request, client: u8, reply: &mut Reply) -> Option<Report> {
        match request {
            Request::Answered | Request::HangUp => {}
            Request::Errand(errand) => {
                let errand = match errand {
                    Errand::Dwell(time) => Errand::Dwell(time.min(self.longest_dwell)),
                    other => other,
                };
                let report = self.errand(client, errand);
                reply.report(&report);
                return Some(report);
            }
            Request::SetSpeed { pen_down, pen_up } => {
                self.machine.change_steps(pen_down, pen_up);
                reply.ok();
            }
            Request::Position => reply.position(self.machine.position()),
            Request::Angles => reply.angles(self.machine.angles()),
            Request::Capabilities => reply.capabilities(&self.name, false),
            Request::Diagnostics => reply.diagnostics(&Diagnostics {
                name: &self.name,
                host: None,
                identity: IDENTITY,
                uptime: Micros::new(self.next_us),
                position: self.machine.position(),
                calibration: self.machine.calibration(),
                compensation: self.machine.compensation(),
                directions: self.machine.directions(),
                wifi: &Status {
                    setup: false,
                    phase: Phase::Searching,
                    refused: None,
                },
                networks: 0,
                free_memory: 0,
                reset_reason: "a test",
                memory: "none",
                update: &update::Status::NONE,
                update_key: update::KeyName::Development,
                space: Space::default(),
                last_panic: "",
            }),
            Request::Name => reply.name(&self.name),
            Request::Rename(name) => {
                self.at_rest(client, |bench| bench.name = name);
                reply.name(&self.name);
            }
            // Networks and starts are nothing that the arm does.
            Request::Start => reply.start(&Settings::default()),
            Request::Waves => reply.waves(true),
            Request::Networks => reply.networks(&[], &Networks::new()),
            Request::OwnNetwork => reply.own_network(&Settings::default()),
            // Nor are drawings that are kept.
            Request::Drawings => reply.drawings(&Contents::EMPTY),
            Request::Space => reply.space(Space::default()),
            Request::Button => reply.button(ButtonDraws::default()),
            Request::Replaying => reply.replay(None),
            Request::SetButton(_)
            | Request::Draw(_)
            | Request::StopDrawing
            | Request::BeginRecording(_)
            | Request::RecordLine
            | Request::EndRecording
            | Request::Delete(_)
            | Request::SetReplay(_)
            | Request::SetStart { .. }
            | Request::ProtectOwnNetwork(_)
            | Request::SetWaves(_)
            | Request::Remember { .. }
            | Request::Forget(_)
            | Request::ForgetAll
            | Request::SetUpdateAddress(_) => reply.ok(),
            Request::Update => reply.error(format_args!("{}", update::Rejection::NoSlots)),
            Request::Compensation => {
                let now = self.machine.compensation();
                reply.compensation(now.map(), now.shift());
            }
            Request::SetCompensation { map, shift } => {
                self.at_rest(client, |bench| {
                    let now = bench.machine.compensation();
                    let map = map.unwrap_or(now.map());
                    let shift = shift.unwrap_or(now.shift());
                    let new = Compensation::new(map, shift);
                    bench.machine.set_compensation(new);
                });
                reply.ok();
            }
            Request::Directions => reply.directions(self.machine.directions()),
            Request::SetDirections(servos) => {
                self.at_rest(client, |bench| {
                    let mut new = bench.machine.directions();
                    for (new, wanted) in new.reversed.iter_mut().zip(servos) {
                        *new = wanted.unwrap_or(*new);
                    }
                    bench.machine.set_directions(new);
                });
                reply.ok();
            }
            Request::FactoryReset => {
                self.at_rest(client, |bench| {
                    bench.name = MachineName::default();
                    bench.machine.set_calibration(Calibration::default());
                    bench.machine.set_compensation(Compensation::default());
                    bench.machine.set_directions(Directions::default());
                });
                reply.ok();
            }
            Request::Calibrate => {
                self.at_rest(client, |bench| {
                    let here = bench.machine.calibration_here();
                    bench.machine.set_calibration(here);
                });
                reply.ok();
            }
            Request::ClearCalibration => {
                self.at_rest(client, |bench| {
                    bench.machine.set_calibration(Calibration::default());
                });
                reply.ok();
            }
        }
        None
    }

    fn at_rest(&mut self, client: u8, f: impl FnOnce(&mut Self)) {
        self.errand(client, Errand::Rest);
        f(self);
        self.machine.release(slot(client));
    }

    fn errand(&mut self, client: u8, errand: Errand) -> Report {
        if let Some(report) = self.machine.take(slot(client), &errand) {
            return report;
        }
        let begun = self.next_us;
        loop {
            match self.machine.next_event() {
                Some(event) if event.get() < self.next_us => self.machine.advance(event),
                _ => {
                    self.frame(self.next_us);
                }
            }
            if let Some((whose, report)) = self.machine.next_report() {
                assert_eq!(
                    whose,
                    slot(client),
                    "a report for a client that waits for none"
                );
                return report;
            }
            assert!(
                self.next_us - begun < PATIENCE_US,
                "{errand:?} is never reported"
            );
        }
    }
}

fn slot(client: u8) -> Client {
    Client::new(client).expect("there are four clients")
}
