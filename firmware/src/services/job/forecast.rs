//! A drawing before it is drawn: whether its lines are such that a drawing may have, where it is out of
//! reach, how long it takes.
//!
//! The time is that of a machine like the arm's own, which is told that every move has ended as soon as
//! it has begun.

use protocol_core::arm::Calibration;
use protocol_core::lineus::{Reply, Request, Session};
use protocol_core::machine::{ArmData, Client, Errand, Limited, Machine, Report};
use protocol_core::motion::{Micros, Steps};

/// Longest reason, in bytes: errors about a line are shorter.
pub const MAX_REASON: usize = 256;

/// A line of a drawing that is not taken.
#[derive(Debug, PartialEq, Eq)]
pub struct RefusedLine {
    /// Its number, from 1.
    pub line: u32,
    /// Why.
    pub reason: heapless::String<MAX_REASON>,
}

/// What belongs into a drawing: moves, dwells, speed, scale and origin.
fn belongs(request: &Request, reply: &Reply) -> Result<(), &'static str> {
    match request {
        Request::Errand(Errand::Move(..) | Errand::Uncalibrated(..) | Errand::Dwell(_))
        | Request::SetSpeed { .. } => Ok(()),
        Request::Answered if !reply.is_error() => Ok(()),
        _ => Err("a drawing has G00, G01, G4, G28, G40, G54, G94 and comments alone"),
    }
}

/// Looks at the lines of a piece while it arrives.
pub(super) struct Check {
    session: Session,
    line: u32,
}

impl Check {
    /// Of lines that come after those of `forecast`.
    pub(super) fn after(forecast: &Forecast) -> Self {
        Self {
            session: forecast.session.clone(),
            line: forecast.line,
        }
    }

    pub(super) fn take(&mut self, mut input: &[u8], reply: &mut Reply) -> Result<(), RefusedLine> {
        let mut before = input;
        while let Some(request) = self.session.next_request(&mut input, reply) {
            self.line += ends(before, input);
            before = input;
            if let Err(reason) = belongs(&request, reply) {
                let reason = reply.reason().unwrap_or(reason);
                return Err(RefusedLine {
                    line: self.line,
                    reason: heapless::String::try_from(reason).unwrap_or_default(),
                });
            }
        }
        self.line += ends(before, input);
        Ok(())
    }
}

/// Ends of lines in what was taken from `before` to leave `after`.
pub(super) fn ends(before: &[u8], after: &[u8]) -> u32 {
    let taken = before.len().saturating_sub(after.len());
    let ends = before.iter().take(taken).filter(|byte| **byte == b'\n');
    ends.count() as u32
}

/// What is known of the drawing so far.
pub(super) struct Forecast {
    machine: Machine,
    session: Session,
    /// Ends of lines.
    pub(super) line: u32,
    pub(super) time: Micros,
    /// Lines that do not go where they say.
    pub(super) limited: u32,
    /// The first of them.
    pub(super) first: Option<(u32, Limited)>,
}

impl Forecast {
    /// Nothing yet.
    pub(super) fn new(data: ArmData, steps: Steps) -> Self {
        let mut machine = Machine::new(data, Calibration::default());
        machine.set_steps(steps);
        Self {
            machine,
            session: Session::new(),
            line: 0,
            time: Micros::default(),
            limited: 0,
            first: None,
        }
    }

    /// Lines that have been checked.
    pub(super) fn take(&mut self, mut input: &[u8], reply: &mut Reply) {
        let mut before = input;
        while let Some(request) = self.session.next_request(&mut input, reply) {
            self.line += ends(before, input);
            before = input;
            match request {
                Request::Errand(errand) => self.travel(&errand),
                Request::SetSpeed { pen_down, pen_up } => {
                    self.machine.change_steps(pen_down, pen_up);
                }
                _ => {}
            }
        }
        self.line += ends(before, input);
    }

    fn travel(&mut self, errand: &Errand) {
        let report = self.machine.take(Client::JOB, errand);
        if let Some(end) = self.machine.next_event() {
            self.machine.advance(end);
            self.time = end;
        }
        if let Some(Report::Moving {
            limited: Some(limited),
            ..
        }) = report
        {
            self.limited += 1;
            self.first.get_or_insert((self.line, limited));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_core::motion::DEFAULT_STEPS;

    fn forecast(text: &str) -> Forecast {
        let mut forecast = Forecast::new(ArmData::default(), DEFAULT_STEPS);
        forecast.take(text.as_bytes(), &mut Reply::new());
        forecast
    }

    fn refused(text: &str) -> Option<RefusedLine> {
        let mut check = Check::after(&forecast(""));
        check.take(text.as_bytes(), &mut Reply::new()).err()
    }

    #[test]
    fn the_time_is_that_of_the_steps() {
        // From (1000, 1000, 1000): 500 / 15 = 34 steps, 1000 / 15 = 67, then 300 / 5 = 60, and at 3: 100.
        for (text, steps) in [
            ("G01 X1500\n", 34),
            ("G01 X1500\nG01 Z0\n", 34 + 67),
            ("G01 X1500\nG01 Z0\nG01 X1200\n", 34 + 67 + 60),
            ("G01 X1500\nG01 Z0\nG94 S3\nG01 X1200\n", 34 + 67 + 100),
            ("G54 X500\nG01 X1000\n; nothing\n", 34),
        ] {
            assert_eq!(
                forecast(text).time,
                Micros::from_millis(10 * steps),
                "{text}"
            );
        }
    }

    #[test]
    fn lines_out_of_reach_are_counted_and_the_first_is_kept() {
        let forecast = forecast("G28\n\n(far)\r\nG01 X5000 Z0\nG01 X0\n");
        assert_eq!((forecast.line, forecast.limited), (5, 2));
        assert_eq!(forecast.first, Some((4, Limited::Target { lifted: true })));
    }

    #[test]
    fn a_line_that_is_wrong_is_named() {
        let refused = |text| refused(text).map(|refused| (refused.line, refused.reason));
        let only = "a drawing has G00, G01, G4, G28, G40, G54, G94 and comments alone";
        assert_eq!(
            refused("G28\nG01 X1 Y2 Z3\nG00 X5\nG54 S2\nG94 S5\nG4 P1\n\n(a)\n"),
            None
        );
        for (text, line, reason) in [
            ("G28\n\nG5 P500\n", 3, "unknown command 'G5'"),
            ("G01 X1 X2\nG5\n", 1, "parameter X is repeated"),
            ("G28\nM550 Px\n", 2, only),
            ("M114\n", 1, only),
        ] {
            assert_eq!(
                refused(text),
                Some((line, reason.try_into().unwrap())),
                "{text}"
            );
        }
    }

    #[test]
    fn a_line_may_come_in_two_pieces() {
        let mut forecast = forecast("G01 X15");
        forecast.take(b"00\n", &mut Reply::new());
        assert_eq!(
            (forecast.line, forecast.time),
            (1, Micros::from_millis(340))
        );
    }
}
