//! What is to be said when: a value that is told messages and the time, and gives messages (RFC 6762).
//!
//! It claims its names three times, tells what it has three times, and answers from then on. Where somebody
//! else has one of its names, it takes another: `line-us`, then `line-us-2`, `line-us-3` and so on.

use super::messages::{Kind, Manner, Message, claim, tell};
use super::records::{Ports, RECORDS, Records, Set};
use core::fmt::Write;
use core::net::Ipv4Addr;
use heapless::String;
use protocol_core::motion::Micros;
use protocol_core::settings::MachineName;

/// How often names are claimed before they are the machine's.
const CLAIMS: u8 = 3;
/// Time between two claims, and the longest wait before the first.
const BETWEEN_CLAIMS: Micros = Micros::from_millis(250);
/// How often it is told what the machine has.
const TELLINGS: u8 = 3;
/// Time between the first two tellings; it doubles.
const BETWEEN_TELLINGS: Micros = Micros::from_secs(1);
/// Who claims a name at the same time and does not go first waits so long.
const STEP_BACK: Micros = Micros::from_secs(1);
/// Names that are taken before the machine slows down.
const MANY_CONFLICTS: u8 = 15;
/// Time before each name after that.
const SLOW: Micros = Micros::from_secs(5);
/// The same is not told to everybody more often.
const BETWEEN_ANSWERS: Micros = Micros::from_secs(1);
/// But a name is defended as often as this.
const BETWEEN_DEFENCES: Micros = Micros::from_millis(250);
/// Answers that others have as well wait 20 to 120 ms, so that not all speak at once.
const JITTER_MS: core::ops::Range<u32> = 20..120;
/// Highest number behind a name; after it comes 2 again.
const MAX_NUMBER: u16 = 9999;

/// Where the machine is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Another number for each time that a network was joined or opened.
    pub connection: u32,
    /// The machine's address there.
    pub address: Ipv4Addr,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// So many claims have been made; what comes next comes then.
    Claiming(u8, Micros),
    /// The names are the machine's. So often it has been told; the next time is then.
    Telling(u8, Micros),
    /// Everything has been told.
    Answering,
}

/// Names and services of the machine in one place.
#[derive(Debug)]
pub struct Responder {
    ports: Ports,
    name: MachineName,
    place: Option<Place>,
    /// Behind the name; 1 is none.
    number: u16,
    conflicts: u8,
    /// What there is to say where the machine is somewhere.
    records: Option<Records>,
    stage: Stage,
    /// What was told under a name that the machine no longer has.
    withdrawn: Option<Records>,
    told: [Option<Micros>; RECORDS],
    due: [Option<Micros>; RECORDS],
    dice: u32,
}

impl Responder {
    /// Nowhere yet. Machines that start at the same time should have different `dice`.
    pub fn new(ports: Ports, dice: u32) -> Self {
        Self {
            ports,
            name: MachineName::default(),
            place: None,
            number: 1,
            conflicts: 0,
            records: None,
            stage: Stage::Answering,
            withdrawn: None,
            told: [None; RECORDS],
            due: [None; RECORDS],
            dice: dice | 1,
        }
    }

    /// The name of the host, without `.local`, while it is the machine's.
    pub fn host(&self) -> Option<&str> {
        let claiming = matches!(self.stage, Stage::Claiming(..));
        let records = self.records.as_ref().filter(|_| !claiming);
        records.map(|records| records.host.as_str())
    }

    /// Tells how the machine is called, and where it is, if anywhere. Where one of these is new, it begins
    /// anew, with that very name.
    pub fn set(&mut self, name: &MachineName, place: Option<Place>, now: Micros) {
        if *name == self.name && place == self.place {
            return;
        }
        if place == self.place && self.host().is_some() {
            self.withdrawn = self.records.take();
        }
        self.name = name.clone();
        self.place = place;
        self.number = 1;
        self.conflicts = 0;
        let wait = self.roll(BETWEEN_CLAIMS);
        self.begin(now + wait);
    }

    /// Claims the name with its number.
    fn begin(&mut self, at: Micros) {
        self.stage = Stage::Claiming(0, at);
        self.told = [None; RECORDS];
        self.due = [None; RECORDS];
        self.records = self.place.map(|place| {
            let mut host = String::new();
            // It fits, see `MAX_HOST`.
            let _ = host.push_str(self.name.as_str());
            if self.number > 1 {
                let _ = write!(host, "-{}", self.number);
            }
            Records {
                host,
                address: place.address,
                ports: self.ports,
            }
        });
    }

    /// Takes a message. `one_shot`: it comes from somebody who does not know multicast, and waits for an
    /// answer of its own; then that is put into `buffer`, and its length given.
    pub fn take(
        &mut self,
        message: &[u8],
        one_shot: bool,
        now: Micros,
        buffer: &mut [u8],
    ) -> Option<usize> {
        let records = self.records.as_ref()?;
        let (kind, message) = Message::read(message)?;
        let claiming = matches!(self.stage, Stage::Claiming(..));
        match kind {
            Kind::Query if claiming => {
                if !one_shot && message.is_claim() && message.goes_first(records) {
                    self.stage = Stage::Claiming(0, now + STEP_BACK);
                }
                None
            }
            Kind::Query => {
                let asked = message.asked(records);
                if asked.is_empty() {
                    return None;
                }
                if one_shot {
                    let more = records.that_go_with(asked);
                    return tell(records, asked, more, Manner::OneShot(message), buffer);
                }
                let defence = message.is_claim();
                self.answer_later(asked, defence, now);
                None
            }
            // Whoever answers this way is no machine of this kind (RFC 6762, section 6).
            Kind::Response if one_shot => None,
            Kind::Response => {
                if message.contradicts(records, claiming) {
                    self.conflict(claiming, now);
                }
                None
            }
        }
    }

    fn answer_later(&mut self, asked: Set, defence: bool, now: Micros) {
        let shared = self.records.as_ref().is_some_and(|records| {
            let mut asked = asked.iter().filter_map(|number| records.get(number));
            asked.any(|record| !record.is_unique())
        });
        let wait = match shared {
            true => {
                let spread = Micros::from_millis(JITTER_MS.end - JITTER_MS.start);
                Micros::from_millis(JITTER_MS.start) + self.roll(spread)
            }
            false => Micros::default(),
        };
        let pause = match defence {
            true => BETWEEN_DEFENCES,
            false => BETWEEN_ANSWERS,
        };
        for (number, (due, told)) in self.due.iter_mut().zip(&self.told).enumerate() {
            if !asked.has(number) {
                continue;
            }
            let at = told.map_or(now, |told| told + pause).max(now + wait);
            *due = Some(due.map_or(at, |due| due.min(at)));
        }
    }

    /// Somebody else has one of the names. What was only claimed is theirs; what was the machine's is claimed
    /// once more, and so it is by the other.
    fn conflict(&mut self, claiming: bool, now: Micros) {
        if claiming {
            self.number = match self.number {
                MAX_NUMBER => 2,
                number => number + 1,
            };
        }
        self.conflicts = self.conflicts.saturating_add(1);
        let wait = match self.conflicts >= MANY_CONFLICTS {
            true => SLOW,
            false => self.roll(BETWEEN_CLAIMS),
        };
        self.begin(now + wait);
    }

    /// When there is something to say next.
    pub fn next(&self) -> Option<Micros> {
        if self.withdrawn.is_some() {
            return Some(Micros::default());
        }
        self.records.as_ref()?;
        let stage = match self.stage {
            Stage::Claiming(_, at) | Stage::Telling(_, at) => Some(at),
            Stage::Answering => None,
        };
        stage
            .into_iter()
            .chain(self.due.into_iter().flatten())
            .min()
    }

    /// What is to be said to everybody now: puts it into `buffer`, and gives its length. To be called until
    /// there is nothing more.
    pub fn say(&mut self, now: Micros, buffer: &mut [u8]) -> Option<usize> {
        if let Some(old) = self.withdrawn.take() {
            let its = old.of_its_name();
            return tell(&old, its, Set::NONE, Manner::Withdrawn, buffer);
        }
        let records = self.records.as_ref()?;
        if let Stage::Claiming(made, at) = self.stage {
            if at > now {
                return None;
            }
            if made < CLAIMS {
                self.stage = Stage::Claiming(made + 1, now + BETWEEN_CLAIMS);
                return claim(records, buffer);
            }
            self.stage = Stage::Telling(0, now);
        }
        match self.stage {
            Stage::Telling(times, at) if at <= now => self.tell_all(times, now, buffer),
            _ => self.answer(now, buffer),
        }
    }

    /// Tells everything, after it has been told so often.
    fn tell_all(&mut self, times: u8, now: Micros, buffer: &mut [u8]) -> Option<usize> {
        let times = times + 1;
        if times < TELLINGS {
            let pause = Micros::new(BETWEEN_TELLINGS.get() << (times - 1));
            self.stage = Stage::Telling(times, now + pause);
        } else {
            self.stage = Stage::Answering;
            self.conflicts = 0;
        }
        self.told = [Some(now); RECORDS];
        self.due = [None; RECORDS];
        let records = self.records.as_ref()?;
        tell(records, Set::ALL, Set::NONE, Manner::Told, buffer)
    }

    /// Tells what was asked for, as far as its time has come.
    fn answer(&mut self, now: Micros, buffer: &mut [u8]) -> Option<usize> {
        let mut answers = Set::NONE;
        for (number, due) in self.due.iter_mut().enumerate() {
            if due.is_some_and(|due| due <= now) {
                *due = None;
                answers |= Set::of(number);
            }
        }
        if answers.is_empty() {
            return None;
        }
        let records = self.records.as_ref()?;
        let more = records.that_go_with(answers);
        for (number, told) in self.told.iter_mut().enumerate() {
            if (answers | more).has(number) {
                *told = Some(now);
            }
        }
        tell(records, answers, more, Manner::Told, buffer)
    }

    /// A time below `most`, by chance (Marsaglia's xorshift).
    fn roll(&mut self, most: Micros) -> Micros {
        self.dice ^= self.dice << 13;
        self.dice ^= self.dice >> 17;
        self.dice ^= self.dice << 5;
        let most = most.get();
        Micros::new(u64::from(self.dice) % most.max(1))
    }
}

#[cfg(test)]
mod tests;
