//! What one line leaves to the next: units, distances, offsets, rates, intensity; and with it, what a
//! command asks of the arm.
//!
//! Where the arm is belongs to the arm. A coordinate that is left out, a relative move and G10 L20 start
//! from where its plan ends at that moment, offsets included, whoever moved it and however a stop ended
//! that. So nothing a line does, or does not, can shift them.

use super::command::{Action, Command, Distance, Fault, Offset, Travel};
use super::units::{Unit, place, sum};
use crate::motion::{Assist, Feed, Intensity, Micros, Millimetres, Segment, TablePoint};
use heapless::Vec;

/// Both offsets of a new session.
pub const DEFAULT_OFFSET: TablePoint = place(5, 5);

/// Steps of one line at most: three outputs, home, a move.
pub const MAX_STEPS: usize = 5;

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Go there: within twice [`super::MAX_COORDINATE`], wherever the table ends.
    Move(Segment),
    /// Stay there.
    Dwell {
        /// For how long.
        time: Micros,
        /// Of the laser.
        intensity: Intensity,
    },
    /// Go to the physical home and make it zero. The move after it must not be seen from elsewhere.
    Home,
    /// Switch an output, at its place among the moves.
    Output(Assist, bool),
}

/// What a line asks for, in order.
pub type Steps = Vec<Step, MAX_STEPS>;

/// The modal state of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Modal {
    unit: Unit,
    distance: Distance,
    selected: Offset,
    table: TablePoint,
    custom: TablePoint,
    /// The last of G0 and G1: F before either is the feed rate.
    travel: Travel,
    seek: Feed,
    feed: Feed,
    intensity: Intensity,
}

impl Modal {
    /// G90 G21 G54, S0, the default rates and offsets.
    pub const DEFAULT: Self = Self {
        unit: Unit::Millimetre,
        distance: Distance::Absolute,
        selected: Offset::Table,
        table: DEFAULT_OFFSET,
        custom: DEFAULT_OFFSET,
        travel: Travel::Feed,
        seek: Feed::DEFAULT,
        feed: Feed::DEFAULT,
        intensity: Intensity::OFF,
    };

    /// What numbers are in.
    pub const fn unit(&self) -> Unit {
        self.unit
    }

    /// The state after `command`, and what is to be done; `planned` is where the plan ends.
    ///
    /// # Errors
    /// [`Fault::BadNumber`] for a target beyond every table.
    pub fn after(mut self, command: &Command, planned: TablePoint) -> Result<(Self, Steps), Fault> {
        self.unit = command.unit.unwrap_or(self.unit);
        self.distance = command.distance.unwrap_or(self.distance);
        self.selected = command.offset.unwrap_or(self.selected);
        self.travel = command.travel.unwrap_or(self.travel);
        self.intensity = command.intensity.unwrap_or(self.intensity);
        if let Some(rate) = command.feed {
            match self.travel {
                Travel::Seek => self.seek = rate,
                Travel::Feed => self.feed = rate,
            }
        }
        let mut steps = Steps::new();
        for (output, on) in Assist::ALL.into_iter().zip(command.outputs) {
            if let Some(on) = on {
                push(&mut steps, Step::Output(output, on));
            }
        }
        match command.action {
            Action::None => {}
            Action::Move(travel) => {
                if command.x.is_some() || command.y.is_some() {
                    let target = self.target(command, planned).ok_or(Fault::BadNumber)?;
                    push(&mut steps, self.travel_to(travel, target));
                }
            }
            Action::Dwell(time) => push(
                &mut steps,
                Step::Dwell {
                    time,
                    intensity: self.intensity,
                },
            ),
            Action::SetOffset(offset) => {
                let offset = self.offset_mut(offset);
                offset.x = command.x.unwrap_or(offset.x);
                offset.y = command.y.unwrap_or(offset.y);
            }
            Action::OffsetHere(offset) => *self.offset_mut(offset) = planned,
            Action::Home => {
                self.selected = Offset::Table;
                push(&mut steps, Step::Home);
                push(&mut steps, self.travel_to(Travel::Seek, self.table));
            }
        }
        Ok((self, steps))
    }

    const fn offset_mut(&mut self, offset: Offset) -> &mut TablePoint {
        match offset {
            Offset::Table => &mut self.table,
            Offset::Custom => &mut self.custom,
        }
    }

    fn target(&self, command: &Command, planned: TablePoint) -> Option<TablePoint> {
        let offset = match self.selected {
            Offset::Table => self.table,
            Offset::Custom => self.custom,
        };
        let coordinate = |written: Option<Millimetres>, offset, planned| match written {
            None => Some(planned),
            Some(written) => {
                let from = match self.distance {
                    Distance::Absolute => offset,
                    Distance::Relative => planned,
                };
                sum(written, from)
            }
        };
        Some(TablePoint {
            x: coordinate(command.x, offset.x, planned.x)?,
            y: coordinate(command.y, offset.y, planned.y)?,
        })
    }

    const fn travel_to(&self, travel: Travel, to: TablePoint) -> Step {
        let (feed, intensity) = match travel {
            Travel::Seek => (self.seek, Intensity::OFF),
            Travel::Feed => (self.feed, self.intensity),
        };
        Step::Move(Segment {
            to,
            feed,
            intensity,
        })
    }
}

/// [`MAX_STEPS`] is what a command can ask for.
fn push(steps: &mut Steps, step: Step) {
    let _ = steps.push(step);
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::command::parse;
    use super::*;
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    /// A session's state and an arm that is always where the plan ends.
    struct Arm {
        modal: Modal,
        at: TablePoint,
    }

    impl Arm {
        fn new() -> Self {
            Self {
                modal: Modal::DEFAULT,
                at: TablePoint::default(),
            }
        }

        fn try_line(&mut self, line: &str) -> Result<Steps, Fault> {
            let body: Vec<u8> = line.bytes().filter(|&byte| byte > b' ').collect();
            let command = parse(&body, self.modal.unit())?;
            let (modal, steps) = self.modal.after(&command, self.at)?;
            self.modal = modal;
            for step in &steps {
                match step {
                    Step::Move(segment) => self.at = segment.to,
                    Step::Home => self.at = TablePoint::default(),
                    Step::Dwell { .. } | Step::Output(..) => {}
                }
            }
            Ok(steps)
        }

        fn lines(&mut self, lines: &[&str]) -> Steps {
            let mut last = Steps::new();
            for line in lines {
                last = self.try_line(line).unwrap();
            }
            last
        }
    }

    fn after(lines: &[&str]) -> Vec<Step> {
        Arm::new().lines(lines).iter().copied().collect()
    }

    fn seek(x: i16, y: i16, rate: u16) -> Step {
        feed(x, y, rate, 0)
    }

    fn feed(x: i16, y: i16, rate: u16, intensity: u8) -> Step {
        Step::Move(Segment {
            to: place(x, y),
            feed: Feed::new(rate),
            intensity: Intensity(intensity),
        })
    }

    #[test]
    fn what_holds_at_the_start() {
        // G90 G21 G54 with its offset (5, 5), 8000 mm/min either way, S0.
        assert_eq!(after(&["G0X10Y20"]), [seek(15, 25, 8000)]);
        assert_eq!(after(&["G1X10Y20"]), [feed(15, 25, 8000, 0)]);
        assert_eq!(after(&["G55", "G0X10Y20"]), [seek(15, 25, 8000)]);
    }

    #[test]
    fn the_rows_of_the_page() {
        for (lines, expected) in [
            (&["G0 X120 Y150"][..], vec![seek(125, 155, 8000)]),
            (&["G0 F2000", "G0X1Y1"], vec![seek(6, 6, 2000)]),
            (&["G1 X120 Y150"], vec![feed(125, 155, 8000, 0)]),
            (&["G1 F2000", "G1X1Y1"], vec![feed(6, 6, 2000, 0)]),
            (&["S0", "G1X1Y1"], vec![feed(6, 6, 8000, 0)]),
            (&["S255", "G1X1Y1"], vec![feed(6, 6, 8000, 255)]),
            (
                &["S9", "G4 P0.5"],
                vec![Step::Dwell {
                    time: Micros::new(500_000),
                    intensity: Intensity(9),
                }],
            ),
            (
                &["G0X20Y30", "G10 L20 P0", "G0X1Y1"],
                vec![seek(26, 36, 8000)],
            ),
            (
                &["G0X20Y30", "G10 L20 P1", "G55", "G0X1Y1"],
                vec![seek(26, 36, 8000)],
            ),
            (&["G10 L2 P0 X20 Y20", "G0X1Y1"], vec![seek(21, 21, 8000)]),
            (
                &["G10 L2 P1 X220 Y140", "G55", "G0X1Y1"],
                vec![seek(221, 141, 8000)],
            ),
            (&["G30"], vec![Step::Home, seek(5, 5, 8000)]),
            (&["G55", "G54", "G0X1Y1"], vec![seek(6, 6, 8000)]),
            (&["G0X10Y10", "G91", "G0X1Y-2"], vec![seek(16, 13, 8000)]),
            (&["G91", "G90", "G0X1Y1"], vec![seek(6, 6, 8000)]),
            (&["M80"], vec![Step::Output(Assist::Air, true)]),
            (&["M81"], vec![Step::Output(Assist::Air, false)]),
            (&["M82"], vec![Step::Output(Assist::Aux1, true)]),
            (&["M83"], vec![Step::Output(Assist::Aux1, false)]),
            (&["M84"], vec![Step::Output(Assist::Aux2, true)]),
            (&["M85"], vec![Step::Output(Assist::Aux2, false)]),
        ] {
            assert_eq!(after(lines), expected, "{lines:?}");
        }
    }

    #[test]
    fn motion_is_not_modal() {
        for lines in [
            &["G1X1", "X5Y5"][..],
            &["G0X1", "X5"],
            &["X5Y5"],
            &["G0"],
            &["G1F100S9"],
            &["G1Z5"],
            &["G90X5"],
            &["M80", "Y9F5"],
        ] {
            assert_eq!(after(lines), [], "{lines:?}");
        }
    }

    #[test]
    fn coordinates_of_a_line_that_does_not_move_shift_nothing() {
        for still in ["X40Y40", "G90X40", "G10L2P1X40Y40", "G4P1X40", "G54X40Y40"] {
            let lines = ["G0X10Y10", still, "G0X20"];
            assert_eq!(after(&lines), [seek(25, 15, 8000)], "{still}");
            let lines = ["G0X10Y10", still, "G91", "G0X1Y1"];
            assert_eq!(after(&lines), [seek(16, 16, 8000)], "{still}");
        }
    }

    #[test]
    fn f_belongs_to_the_last_of_g0_and_g1() {
        assert_eq!(after(&["F100", "G1X1Y1"]), [feed(6, 6, 100, 0)]);
        assert_eq!(after(&["F100", "G0X1Y1"]), [seek(6, 6, 8000)]);
        assert_eq!(after(&["G0", "F100", "G0X1Y1"]), [seek(6, 6, 100)]);
        assert_eq!(after(&["G0", "F100", "G1X1Y1"]), [feed(6, 6, 8000, 0)]);
        assert_eq!(
            after(&["G0F100", "G1F200", "F300", "G0X1Y1"]),
            [seek(6, 6, 100)]
        );
        assert_eq!(
            after(&["G0F100", "G1F200", "F300", "G1X1Y1"]),
            [feed(6, 6, 300, 0)]
        );
        assert_eq!(after(&["G20", "F10", "G1X0Y0"]), [feed(5, 5, 254, 0)]);
    }

    #[test]
    fn a_refused_line_changes_nothing() {
        for refused in [
            "G1F-5",
            "G1F0",
            "S256",
            "G91G99",
            "G20X1G2",
            "G55M3",
            "G10L2P0X7F0",
            "M80F0",
            "G1X5YF",
            "G0F500S300",
        ] {
            let mut arm = Arm::new();
            arm.lines(&["G0F700X1Y1", "G1F600S77"]);
            let before = arm.modal;
            assert!(arm.try_line(refused).is_err(), "{refused}");
            assert_eq!(arm.modal, before, "{refused}");
        }
    }

    #[test]
    fn g0_is_with_the_laser_off_and_keeps_the_intensity() {
        assert_eq!(after(&["S99", "G0X1Y1"]), [seek(6, 6, 8000)]);
        assert_eq!(after(&["S99", "G0X9", "G1X1Y1"]), [feed(6, 6, 8000, 99)]);
        assert_eq!(after(&["G1X1Y1S99"]), [feed(6, 6, 8000, 99)]);
    }

    #[test]
    fn g10_l2_sets_what_is_given_and_keeps_the_rest() {
        assert_eq!(after(&["G10L2P0X20", "G0X0Y0"]), [seek(20, 5, 8000)]);
        assert_eq!(after(&["G10L2P0Y20", "G0X0Y0"]), [seek(5, 20, 8000)]);
        assert_eq!(after(&["G10L2X20Y20", "G55", "G0X0Y0"]), [seek(5, 5, 8000)]);
        // As written, also where moves are relative.
        let relative = ["G0X10Y10", "G91", "G10L2P0X20Y20", "G90", "G0X0Y0"];
        assert_eq!(after(&relative), [seek(20, 20, 8000)]);
    }

    #[test]
    fn switching_and_setting_offsets_moves_nothing_and_keeps_omitted_axes() {
        for change in ["G55", "G10L2P0X40Y40", "G10L20P0", "G30"] {
            let mut arm = Arm::new();
            arm.lines(&["G10L2P1X50Y60", "G0X10Y10"]);
            let before = arm.at;
            arm.lines(&[change]);
            let at = if change == "G30" { place(5, 5) } else { before };
            assert_eq!(arm.at, at, "{change}");
            arm.lines(&["G91", "G1X1", "G90"]);
            assert_eq!(arm.at.y, at.y, "{change}");
        }
    }

    #[test]
    fn home_selects_the_table_and_goes_to_its_offset() {
        let lines = ["G10L2P0X7Y8", "G10L2P1X50Y60", "G55", "G0F500X9Y9", "G30"];
        assert_eq!(after(&lines), [Step::Home, seek(7, 8, 500)]);
        let then = [&lines[..], &["G0X1Y1"]].concat();
        assert_eq!(after(&then), [seek(8, 9, 500)]);
        // Whatever else the line selects or moves.
        let same = [&lines[..4], &["G55X40G91G30"]].concat();
        assert_eq!(after(&same), [Step::Home, seek(7, 8, 500)]);
    }

    #[test]
    fn relative_targets_too_are_limited() {
        let mut arm = Arm::new();
        let far = ["G91", "G0X10000", "G0X9995"];
        arm.lines(&far);
        assert_eq!(arm.at.x, Millimetres::new(19_995));
        assert_eq!(arm.try_line("G0X5.1"), Err(Fault::BadNumber));
        assert_eq!(arm.try_line("G0X5").unwrap(), [seek(20_000, 0, 8000)]);
    }

    #[test]
    fn inches() {
        assert_eq!(after(&["G20", "G0X10Y-5"]), [seek(259, -122, 8000)]);
        assert_eq!(
            after(&["G20", "G10L2P0X10Y5", "G21", "G0X0Y0"]),
            [seek(254, 127, 8000)]
        );
        assert_eq!(
            after(&["G20", "G91", "G0X10", "G0X-10"]),
            [seek(0, 0, 8000)]
        );
    }

    proptest! {
        #[test]
        fn anything_is_done_in_few_steps_and_within_the_limits(
            lines in prop::collection::vec("([GMXYFSPL](0|1|4|2|10|20|30|54|55|80|83|84|90|91|9999|-9999.5)){1,8}", 1..40)
        ) {
            let mut arm = Arm::new();
            for line in &lines {
                if let Ok(steps) = arm.try_line(line) {
                    prop_assert!(steps.len() <= MAX_STEPS);
                }
                let most = Millimetres::new(20_000);
                prop_assert!(arm.at.x <= most && arm.at.y <= most, "{:?}", arm.at);
            }
        }
    }
}
