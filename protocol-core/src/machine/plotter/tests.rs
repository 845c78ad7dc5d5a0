//! The plan beside the errands: who moves when, and what becomes of a stop.

extern crate std;
use super::*;
use crate::machine::{ArmData, Calibration, Manner, SetPoint, Target};
use crate::motion::{Coordinate, HOME, Millimetres, PEN_UP, PLAN_SEGMENTS, STREAM_GAP};
use std::vec;
use std::vec::Vec;

const A: Client = Client(0);
const B: Client = Client(1);
const MS: u64 = 1_000;
/// Light contact and full pressure of the default pen.
const CONTACT: f64 = 400.0;

/// A machine with the time of its next frame.
struct Arm {
    machine: Machine,
    now: u64,
    frame: u64,
}

impl Arm {
    fn new() -> Self {
        Self {
            machine: Machine::new(ArmData::default(), Calibration::default()),
            now: 0,
            frame: 10 * MS,
        }
    }

    fn tick(&mut self) -> SetPoint {
        self.now += self.frame;
        self.machine.tick(Micros::new(self.now))
    }

    /// Frames until the arm rests, at most 100 s.
    fn rest(&mut self) -> SetPoint {
        for _ in 0..100_000_000 / self.frame {
            let set_point = self.tick();
            if !self.machine.is_busy() {
                return set_point;
            }
        }
        unreachable!("the arm does not come to rest")
    }

    fn run(&mut self, millis: u64) -> SetPoint {
        let mut last = self.machine.last;
        for _ in 0..millis * MS / self.frame {
            last = self.tick();
        }
        last
    }

    fn seek(&mut self, x: i16, y: i16) {
        self.plan(x, y, Intensity::OFF);
    }

    fn feed(&mut self, x: i16, y: i16) {
        self.plan(x, y, Intensity(255));
    }

    fn plan(&mut self, x: i16, y: i16, intensity: Intensity) {
        let segment = segment(x, y, intensity);
        assert_eq!(self.machine.plan(&segment), Ok(()));
    }

    fn at(&self) -> (f64, f64) {
        let TablePoint { x, y } = self.machine.table_position();
        (x.to_f64(), y.to_f64())
    }
}

fn segment(x: i16, y: i16, intensity: Intensity) -> Segment {
    Segment {
        to: TablePoint {
            x: Millimetres::new(x),
            y: Millimetres::new(y),
        },
        feed: Feed::new(3000),
        intensity,
    }
}

fn line(x: i16, y: i16, z: i16) -> Errand {
    let to = Position::from_units(x, y, z);
    Errand::Move(Manner::Straight, Target::at(to))
}

fn height(set_point: SetPoint) -> f64 {
    set_point.position.z.to_f64()
}

#[test]
fn a_plan_ends_exactly_with_the_pen_up() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.feed(20, 5);
    arm.feed(20, 30);
    let last = arm.rest();
    assert_eq!(last.position, Position::from_units(1110, -300, 1000));
    assert_eq!(arm.at(), (20.0, 30.0));
    assert!(arm.machine.plan_is_done());
}

#[test]
fn the_pen_is_down_before_a_stroke_and_up_before_a_travel() {
    let mut arm = Arm::new();
    arm.frame = MS;
    arm.seek(5, 5);
    arm.feed(25, 5);
    arm.seek(25, 40);
    let ends = [(810, -800), (1210, -800)].map(|(x, y)| Position::from_units(x, y, 0));
    let (mut strokes, mut travels, mut between) = (0, 0, 0);
    while arm.machine.is_busy() {
        let now = arm.tick().position;
        let stands = ends.iter().any(|end| (end.x, end.y) == (now.x, now.y));
        if now.z.to_f64() <= CONTACT {
            assert_eq!(now.y, Coordinate::from_units(-800));
            strokes += 1;
        } else if now.z == PEN_UP {
            let inside = now.x > ends[0].x && now.x < ends[1].x;
            assert!(!inside || now.y != ends[0].y, "{now:?} is on the stroke");
            travels += 1;
        } else {
            assert!(stands, "{now:?} moves with the pen between up and down");
            between += 1;
        }
    }
    assert!(strokes > 400 && travels > 600, "{strokes} {travels}");
    // 27 degrees at 600 degrees a second, down and up.
    assert!((88..=92).contains(&between), "{between}");
}

#[test]
fn depth_follows_the_speed_and_is_light_contact_at_least() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.rest();
    arm.plan(45, 5, Intensity(128));
    // 45 ms to lower the pen, 100 ms to the nominal speed, 0.7 s at it.
    let steady = height(arm.run(500));
    let half = CONTACT * (1.0 - 127.0 / 254.0);
    assert!((steady - half).abs() < 0.1, "{steady}, not {half}");
    arm.run(600);
    let standing = height(arm.machine.last);
    assert_eq!(standing, CONTACT);
}

#[test]
fn a_change_of_the_intensity_neither_stops_nor_lifts() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.rest();
    arm.plan(25, 5, Intensity(200));
    arm.plan(45, 5, Intensity(20));
    arm.run(300);
    let mut last = arm.machine.last.position;
    for _ in 0..50 {
        let now = arm.tick().position;
        let speed = (now.x - last.x).to_f64() / 0.01 / 20.0;
        assert!((speed - 50.0).abs() < 0.1, "{speed} mm/s");
        assert!(now.z.to_f64() <= CONTACT);
        last = now;
    }
}

#[test]
fn a_slow_stream_does_not_stop_at_every_segment() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.rest();
    // One segment ahead of the one under way: from rest to rest, a millimetre would take 90 ms; two
    // ahead of a stop allow 45 mm/s, one 32 mm/s.
    let begun = arm.now;
    let mut x = 5;
    while x < 45 {
        if arm.machine.plan_room() == PLAN_SEGMENTS {
            x += 1;
            arm.feed(x, 5);
        }
        arm.tick();
    }
    let per_segment = (arm.now - begun) / 40 / MS;
    assert!((22..=32).contains(&per_segment), "{per_segment} ms");
}

#[test]
fn a_stroke_begins_where_the_host_knows_the_arm() {
    let mut arm = Arm::new();
    arm.seek(10, 10);
    arm.rest();
    arm.machine.take(A, &line(1500, 300, 1000));
    arm.rest();
    arm.feed(20, 10);
    let mut inked = None;
    while arm.machine.is_busy() {
        let set_point = arm.tick();
        if height(set_point) <= CONTACT {
            inked = inked.or(Some(set_point.position));
        }
    }
    let first = inked.map(|position| (position.x.rounded(), position.y));
    assert_eq!(first, Some((910, Coordinate::from_units(-700))));
    assert_eq!(arm.at(), (20.0, 10.0));
}

#[test]
fn home_is_the_tables_corner_from_anywhere() {
    let mut arm = Arm::new();
    // Beside the body's notch: the straight way would lead over it.
    for (x, y) in [(510, 300), (1000, 1000), (710, -1300)] {
        arm.machine.take(A, &line(x, y, 0));
        arm.rest();
        assert_eq!(arm.machine.home(), Ok(()));
        assert!(!arm.machine.plan_is_done());
        while arm.machine.is_busy() {
            let set_point = arm.tick();
            assert!(!set_point.held, "{set_point:?}");
        }
        assert_eq!(arm.at(), (0.0, 0.0));
        // Also when the host knows the arm there already.
    }
    assert_eq!(
        arm.machine.position(),
        Position::from_units(710, -900, 1000)
    );
}

#[test]
fn leaving_the_table_stops_at_its_edge() {
    for ((x, y), side, edge) in [
        ((-10, 45), Side::X1, (0.0, 45.0)),
        ((60, 45), Side::X2, (50.0, 45.0)),
        ((25, -10), Side::Y1, (25.0, 0.0)),
        ((25, 100), Side::Y2, (25.0, 90.0)),
    ] {
        let mut arm = Arm::new();
        arm.seek(25, 45);
        arm.feed(x, y);
        // Never reached.
        arm.feed(30, 30);
        arm.rest();
        assert_eq!(arm.machine.stopped(), Some(StopReason::Limit(side)));
        assert_eq!(arm.machine.limit(), Some(side));
        assert_eq!((arm.at(), arm.machine.position().z), (edge, PEN_UP));
        // Still there, and still beyond.
        arm.machine.resume();
        assert_eq!(arm.machine.limit(), None);
        arm.feed(x, y);
        arm.tick();
        assert_eq!(arm.machine.stopped(), Some(StopReason::Limit(side)));
        arm.machine.resume();
        arm.seek(25, 45);
        arm.rest();
        assert_eq!((arm.at(), arm.machine.stopped()), ((25.0, 45.0), None));
    }
}

#[test]
fn a_stop_halts_a_plan_and_lifts_the_pen_in_place() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.feed(45, 5);
    while height(arm.machine.last) > CONTACT {
        arm.tick();
    }
    let halted = arm.run(300).position;
    assert!(halted.z.to_f64() < CONTACT, "{halted:?}");
    arm.machine.stop(StopReason::Requested);
    while arm.machine.is_busy() {
        let now = arm.tick().position;
        assert_eq!((now.x, now.y), (halted.x, halted.y));
    }
    assert_eq!(arm.machine.position().z, PEN_UP);
    assert!(arm.machine.plan_is_done() && arm.machine.plan_has_changed());
    assert_eq!(
        arm.machine.plan(&segment(5, 5, Intensity::OFF)),
        Err(NotPlanned::Stopped)
    );
}

#[test]
fn a_stop_halts_errands_and_answers_those_that_wait() {
    let mut arm = Arm::new();
    arm.machine.take(A, &line(1000, 1000, 0));
    arm.rest();
    arm.machine.take(A, &line(1000, -500, 0));
    assert_eq!(arm.machine.take(B, &line(1500, 0, 0)), None);
    arm.run(500);
    let halted = arm.machine.last.position;
    arm.machine.stop(StopReason::Requested);
    assert_eq!(arm.machine.next_report(), Some((B, Report::Stopped)));
    assert_eq!(
        arm.machine.take(A, &line(1000, 0, 0)),
        Some(Report::Stopped)
    );
    let last = arm.rest().position;
    assert_eq!((last.x, last.y, last.z), (halted.x, halted.y, PEN_UP));
    arm.machine.resume();
    assert!(matches!(
        arm.machine.take(A, &line(1000, 0, 0)),
        Some(Report::Moving { .. })
    ));
}

#[test]
fn the_last_reason_to_stop_counts_and_the_limit_stays_known() {
    let mut arm = Arm::new();
    arm.seek(60, 0);
    arm.rest();
    arm.machine.stop(StopReason::Requested);
    assert_eq!(arm.machine.stopped(), Some(StopReason::Requested));
    assert_eq!(arm.machine.limit(), Some(Side::X2));
}

#[test]
fn errands_wait_for_a_plan_and_are_answered_when_they_begin() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.feed(10, 5);
    assert_eq!(arm.machine.take(A, &line(1000, 1000, 1000)), None);
    assert_eq!(arm.machine.take(B, &Errand::Rest), None);
    while !arm.machine.plan_is_done() {
        assert_eq!(arm.machine.next_report(), None);
        arm.tick();
    }
    // The host goes on in time, before anybody else.
    arm.seek(5, 5);
    arm.run(400);
    assert!(arm.machine.plan_is_done());
    assert_eq!(arm.machine.next_report(), None);
    arm.run(STREAM_GAP.get() / MS);
    assert!(matches!(
        arm.machine.next_report(),
        Some((A, Report::Moving { end: HOME, .. }))
    ));
    assert_eq!(arm.machine.next_report(), None);
    arm.run(2000);
    assert_eq!(arm.machine.next_report(), Some((B, Report::Resting)));
    // A plan waits for the end of the rest.
    arm.seek(25, 5);
    assert_eq!(arm.run(500).position, HOME);
    arm.machine.release(B);
    arm.rest();
    assert_eq!(arm.at(), (25.0, 5.0));
}

#[test]
fn a_plan_waits_for_the_errands_before_it() {
    let mut arm = Arm::new();
    arm.machine.take(A, &line(1000, 0, 0));
    arm.machine.take(B, &line(1200, 0, 0));
    arm.feed(5, 5);
    arm.machine.take(A, &line(1300, 0, 1000));
    arm.run(1000);
    assert!(matches!(arm.machine.next_report(), Some((B, _))));
    let mut reports = 0;
    while arm.machine.is_busy() {
        let z = height(arm.tick());
        if let Some((client, _)) = arm.machine.next_report() {
            assert_eq!(client, A);
            assert!(arm.machine.plan_is_done());
            assert_eq!(z, 1000.0);
            reports += 1;
        }
    }
    assert_eq!(reports, 1);
}

#[test]
fn a_pen_that_is_left_down_is_lifted_after_the_gap() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.feed(10, 5);
    while !arm.machine.plan_is_done() {
        arm.tick();
    }
    assert_eq!(height(arm.run(STREAM_GAP.get() / MS - 20)), CONTACT);
    assert_eq!(height(arm.run(100)), 1000.0);
    assert!(!arm.machine.is_busy());
}

#[test]
fn a_dwell_keeps_the_arm_and_its_pen() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.rest();
    assert_eq!(
        arm.machine.dwell(Micros::new(300 * MS), Intensity(9)),
        Ok(())
    );
    arm.feed(6, 5);
    // 45 ms down, 300 ms dwelling, 72 ms up and down the ramps of the stroke.
    let contact = arm.run(60);
    assert_eq!(height(contact), CONTACT);
    assert_eq!(arm.run(270).position, contact.position);
    assert_ne!(arm.run(40).position, contact.position);
    assert!(
        arm.machine
            .dwell(Micros::new(20 * MS), Intensity::OFF)
            .is_ok()
    );
    arm.run(200);
    assert_eq!(height(arm.machine.last), 1000.0);
}

#[test]
fn a_full_plan_says_so_and_tells_when_there_is_room() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.rest();
    let mut planned = 0;
    while arm.machine.plan_room() > 0 {
        arm.seek(6 - planned % 2, 5);
        planned += 1;
    }
    // The first has begun.
    assert_eq!(planned as usize, PLAN_SEGMENTS + 1);
    let next = segment(30, 5, Intensity::OFF);
    assert_eq!(arm.machine.plan(&next), Err(NotPlanned::Full));
    while arm.machine.plan_room() == 0 {
        arm.machine.plan_has_changed();
        arm.tick();
    }
    assert!(arm.machine.plan_has_changed());
    assert_eq!(arm.machine.plan(&next), Ok(()));
    arm.rest();
    assert_eq!(arm.at(), (30.0, 5.0));
}

#[test]
fn a_host_that_leaves_has_its_plan_done() {
    let mut arm = Arm::new();
    arm.seek(5, 5);
    arm.feed(40, 80);
    arm.machine.client_gone(Client::SERIAL);
    let last = arm.rest();
    assert_eq!((arm.at(), last.position.z), ((40.0, 80.0), PEN_UP));
}

#[test]
fn outputs_are_switched_at_their_place_in_the_plan() {
    let mut arm = Arm::new();
    arm.seek(10, 10);
    assert_eq!(arm.machine.switch(Assist::Air, true), Ok(()));
    arm.seek(30, 10);
    assert_eq!(arm.machine.switch(Assist::Aux2, true), Ok(()));
    assert_eq!(arm.machine.switch(Assist::Air, false), Ok(()));
    let mut seen = vec![(arm.tick().outputs, arm.at())];
    while arm.machine.is_busy() {
        let outputs = arm.tick().outputs;
        if seen.last().is_some_and(|(last, _)| *last != outputs) {
            seen.push((outputs, arm.at()));
        }
    }
    let (outputs, places): (Vec<_>, Vec<_>) = seen.into_iter().unzip();
    assert_eq!(
        outputs,
        [[false; 3], [true, false, false], [false, false, true]]
    );
    // Within a frame of where the segments end, at 50 mm/s at most.
    assert!((places[1].0 - 10.0).abs() < 0.6, "{places:?}");
    assert!((places[2].0 - 30.0).abs() < 0.6, "{places:?}");
}

#[test]
fn outputs_do_not_slow_a_stroke() {
    let time = |switching: bool| {
        let mut arm = Arm::new();
        arm.feed(0, 10);
        arm.rest();
        let begun = arm.now;
        for x in [10, 20, 30, 40] {
            arm.feed(x, 10);
            if switching {
                assert_eq!(arm.machine.switch(Assist::Aux1, x % 20 == 0), Ok(()));
            }
        }
        arm.rest();
        arm.now - begun
    };
    assert_eq!(time(true), time(false));
}

#[test]
fn outputs_of_an_arm_at_rest_are_switched_at_once() {
    let mut arm = Arm::new();
    for assist in Assist::ALL {
        assert_eq!(arm.machine.switch(assist, true), Ok(()));
    }
    assert_eq!(arm.machine.outputs(), [true; 3]);
    assert_eq!(arm.machine.switch(Assist::Aux1, false), Ok(()));
    assert_eq!(arm.tick().outputs, [true, false, true]);
    // With a dwell before it, after that.
    assert_eq!(
        arm.machine.dwell(Micros::new(200 * MS), Intensity::OFF),
        Ok(())
    );
    assert_eq!(arm.machine.switch(Assist::Aux1, true), Ok(()));
    assert_eq!(arm.run(100).outputs, [true, false, true]);
    assert_eq!(arm.rest().outputs, [true; 3]);
}

#[test]
fn a_stop_keeps_what_is_switched_and_forgets_what_is_not() {
    let mut arm = Arm::new();
    assert_eq!(arm.machine.switch(Assist::Air, true), Ok(()));
    arm.seek(10, 10);
    assert_eq!(arm.machine.switch(Assist::Air, false), Ok(()));
    arm.seek(30, 10);
    assert_eq!(arm.machine.switch(Assist::Aux1, true), Ok(()));
    arm.run(50);
    arm.machine.stop(StopReason::Requested);
    assert_eq!(
        arm.machine.switch(Assist::Aux2, true),
        Err(NotPlanned::Stopped)
    );
    arm.rest();
    arm.machine.resume();
    arm.seek(5, 5);
    assert_eq!(arm.rest().outputs, [true, false, false]);
}

#[test]
fn the_planned_position_is_where_the_host_knows_the_arm() {
    let mut arm = Arm::new();
    let planned = |arm: &Arm| {
        let TablePoint { x, y } = arm.machine.planned_position();
        (x.to_f64(), y.to_f64())
    };
    // The arm's own home lies off the table.
    assert_eq!(planned(&arm), (14.5, 90.0));
    arm.seek(10, 20);
    arm.seek(30, 40);
    assert_eq!(planned(&arm), (30.0, 40.0));
    arm.run(50);
    arm.machine.stop(StopReason::Requested);
    assert_eq!(planned(&arm).0, arm.at().0);
    arm.machine.resume();
    // Over the edge: where the arm will stand.
    arm.seek(10, 20);
    arm.seek(-10, 20);
    assert_eq!(planned(&arm), (0.0, 20.0));
}
