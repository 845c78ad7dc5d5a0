//! Calibrated, mirrored, and compensated arms.

extern crate std;
use crate::arm::{
    Angles, Calibration, Compensation, Directions, HOME_ANGLES, NibShift, ServoRange, ZMap,
};
use crate::machine::{
    ArmData, Bare, Client, Errand, Limited, Machine, Manner, Report, SetPoint, Target, nib_of,
};
use crate::motion::{
    Feed, HOME, Intensity, Microdegrees, Micros, Millimetres, PEN_UP, Position, PulseWidth,
    Segment, TablePoint, WideCoordinate,
};
use proptest::prelude::*;

const A: Client = Client(0);
const ALL: Bare = Bare { xy: true, z: true };

fn fitted(calibration: [i32; 3], map: [i16; 4], hundredths: i16) -> Machine {
    let offsets = Angles::from_array(calibration.map(Microdegrees::new));
    let mut machine = Machine::new(ArmData::default(), Calibration { offsets });
    machine.set_compensation(Compensation::new(
        ZMap::new(map).unwrap(),
        NibShift::from_hundredths(hundredths).unwrap(),
    ));
    machine
}

fn to(x: i16, y: i16, z: i16) -> Target {
    Target::at(Position::from_units(x, y, z))
}

/// Runs to the end of everything, and gives the last set-point.
fn rest(machine: &mut Machine) -> SetPoint {
    let mut now = machine.frame;
    loop {
        now = now + Micros::from_millis(10);
        let set_point = machine.tick(now);
        if !machine.is_busy() {
            return set_point;
        }
    }
}

/// The pulses of an arm without offsets with the nib there.
fn bare_pulses(x: i16, y: i16, z: i16) -> [PulseWidth; 3] {
    let mut machine = fitted([0; 3], [0; 4], 0);
    machine.take(A, &Errand::Move(Manner::Straight, to(x, y, z)));
    rest(&mut machine).pulses
}

/// Within 0.02 us, which is 0.02 mm of the nib at most.
fn assert_same(found: [PulseWidth; 3], expected: [PulseWidth; 3], what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        let off = found.get().abs_diff(expected.get());
        assert!(off <= 200, "{what}: {found:?}, not {expected:?}");
    }
}

#[test]
fn home_is_home_whatever_paper_and_lift_are() {
    let mut machine = fitted([0; 3], [500, -500, 300, 200], 200);
    assert_eq!(rest(&mut machine).pulses, bare_pulses(1000, 1000, 1000));
    assert_eq!(
        machine.calibration_here(),
        fitted([0; 3], [0; 4], 0).calibration_here()
    );
}

#[test]
fn a_move_ends_where_paper_and_lift_want_it() {
    // 100 up the paper, and 1 mm (20 units) of shift less what the paper takes of it.
    let mut machine = fitted([0; 3], [100; 4], 100);
    let begun = machine.take(A, &Errand::Move(Manner::Straight, to(1400, 0, 0)));
    let end = Position::from_units(1400, 0, 0);
    assert_eq!(begun, Some(Report::Moving { end, limited: None }));
    let last = rest(&mut machine);
    assert_eq!(last.position, end);
    assert_same(last.pulses, bare_pulses(1382, 0, 100), "1400, 0");
    let seen = nib_of(last.pulses, machine.data(), machine.compensation());
    assert!(
        (seen.x.to_f64() - 1400.0).abs() < 0.05 && seen.z.to_f64().abs() < 0.05,
        "{seen:?}"
    );
}

#[test]
fn a_plan_is_on_the_same_paper() {
    let point = |x, y| TablePoint {
        x: Millimetres::new(x),
        y: Millimetres::new(y),
    };
    let drawn = |map| {
        let mut machine = fitted([0; 3], map, 0);
        for (x, intensity) in [(25, Intensity::OFF), (60, Intensity(255))] {
            let segment = Segment {
                to: point(x, 45),
                feed: Feed::DEFAULT,
                intensity,
            };
            machine.plan(&segment).unwrap();
        }
        let mut lowest = PEN_UP;
        let mut least = u32::MAX;
        for at in 1..400 {
            let set_point = machine.tick(Micros::new(at * 10_000));
            lowest = lowest.min(set_point.position.z);
            least = least.min(set_point.pulses[2].get());
        }
        (lowest, least)
    };
    let ((flat_z, flat), (raised_z, raised)) = (drawn([0; 4]), drawn([200; 4]));
    assert!(flat_z.to_f64() < 500.0, "the pen comes down to {flat_z:?}");
    assert_eq!(flat_z, raised_z);
    // 500 us are 1000 units of Z; what is left of the height up there is 1 - Z / 1000 of it.
    let expected = 100.0 * (1.0 - flat_z.to_f64() / 1000.0);
    let found = f64::from(raised - flat) / 10_000.0;
    assert!(
        (found - expected).abs() < 0.05,
        "{found} us higher, not {expected}"
    );
}

#[test]
fn compensation_comes_into_force_in_place() {
    let mut machine = fitted([0; 3], [0; 4], 0);
    machine.take(A, &Errand::Move(Manner::Straight, to(1200, 300, 0)));
    rest(&mut machine);
    machine.set_compensation(Compensation::new(
        ZMap::new([100; 4]).unwrap(),
        NibShift::NONE,
    ));
    let after = machine.tick(machine.frame + Micros::from_millis(10));
    assert_eq!(after.position, Position::from_units(1200, 300, 0));
    assert!(after.moving, "the servos are on their way");
    assert_same(after.pulses, bare_pulses(1200, 300, 100), "1200, 300");
}

#[test]
fn a_servo_that_turns_the_other_way_is_mirrored_at_90_degrees() {
    let mut machine = fitted([3_000_000, 0, 0], [0; 4], 0);
    let before = rest(&mut machine);
    machine.set_directions(Directions {
        reversed: [true, false, true],
    });
    let after = machine.tick(machine.frame + Micros::from_millis(10));
    assert_eq!(after.position, HOME);
    let centre = 2 * 15_000_000;
    let [shoulder, elbow, pen] = before.pulses.map(PulseWidth::get);
    for (found, expected) in
        after
            .pulses
            .map(PulseWidth::get)
            .into_iter()
            .zip([centre - shoulder, elbow, centre - pen])
    {
        assert!(found.abs_diff(expected) <= 1, "{found}, not {expected}");
    }
    // The model knows nothing of it: neither angles nor calibration.
    assert_eq!(
        machine.calibration().offsets.shoulder,
        Microdegrees::from_degrees(3)
    );
    assert_eq!(machine.angles(), fitted([0; 3], [0; 4], 0).angles());
    machine.set_directions(Directions::default());
    assert_eq!(machine.data().servos, [ServoRange::default(); 3]);
}

#[test]
fn bare_moves_tell_the_servos_what_an_arm_without_offsets_is_told() {
    for (calibration, map, shift) in [
        ([0; 3], [0; 4], 0),
        ([3_500_000, -2_250_000, 1_500_000], [0; 4], 0),
        ([0; 3], [100, -50, 300, 200], 0),
        ([0; 3], [0; 4], 150),
        ([-2_000_000, 1_000_000, 500_000], [0, 100, 300, 200], -80),
    ] {
        for (x, y, z) in [
            (1400, -300, 700),
            (1100, 800, 500),
            (1600, 200, 900),
            (1000, 1000, 1000),
        ] {
            let mut machine = fitted(calibration, map, shift);
            let report = machine.take(A, &Errand::Uncalibrated(to(x, y, z), ALL));
            let what = std::format!("{calibration:?} {map:?} {shift}, ({x}, {y}, {z})");
            let Some(Report::Moving { end, limited: None }) = report else {
                panic!("{what}: {report:?}");
            };
            let last = rest(&mut machine);
            assert_eq!(last.position, end, "{what}");
            assert_same(last.pulses, bare_pulses(x, y, z), &what);
        }
    }
}

#[test]
fn excluded_axes_move_as_always() {
    let calibration = [3_500_000, -2_250_000, -1_500_000];
    let (map, shift) = ([0, 100, 300, 200], 100);
    let usual = {
        let mut machine = fitted(calibration, map, shift);
        machine.take(A, &Errand::Move(Manner::Straight, to(1400, -300, 200)));
        rest(&mut machine).pulses
    };
    let bare = bare_pulses(1400, -300, 200);
    for (axes, expected) in [
        (
            Bare {
                xy: false,
                z: false,
            },
            usual,
        ),
        (Bare { xy: false, z: true }, [usual[0], usual[1], bare[2]]),
        (Bare { xy: true, z: false }, [bare[0], bare[1], usual[2]]),
    ] {
        let mut machine = fitted(calibration, map, shift);
        machine.take(A, &Errand::Uncalibrated(to(1400, -300, 200), axes));
        let found = rest(&mut machine).pulses;
        // Whichever is usual may be off by what paper and lift differ from place to place.
        for (found, expected) in found.iter().zip(expected) {
            let off = f64::from(found.get().abs_diff(expected.get())) / 10_000.0;
            assert!(off < 4.0, "{axes:?}: {found:?}, not {expected:?}");
        }
    }
}

#[test]
fn what_is_left_out_of_a_bare_move_stays_where_the_servos_are() {
    let calibration = [3_500_000, -2_250_000, 0];
    let mut machine = fitted(calibration, [0; 4], 0);
    machine.take(A, &Errand::Uncalibrated(to(1400, -300, 700), ALL));
    rest(&mut machine);
    let only_y = Target {
        y: Some(WideCoordinate::from_bits(200 << 16)),
        ..Target::default()
    };
    machine.take(A, &Errand::Uncalibrated(only_y, ALL));
    assert_same(
        rest(&mut machine).pulses,
        bare_pulses(1400, 200, 700),
        "Y alone",
    );
    let before = machine.position();
    machine.take(A, &Errand::Uncalibrated(Target::default(), ALL));
    assert_eq!(rest(&mut machine).position, before);
}

#[test]
fn a_bare_place_out_of_reach_is_told_and_lifts_the_pen() {
    let mut machine = fitted([1_000_000, 0, 0], [0; 4], 0);
    let report = machine.take(A, &Errand::Uncalibrated(to(3000, 0, 0), ALL));
    let Some(Report::Moving { end, limited }) = report else {
        panic!("{report:?}");
    };
    assert_eq!(limited, Some(Limited::Target { lifted: true }));
    assert_eq!(end.z, PEN_UP);
    // Without any offsets it is a move like any other.
    let mut machine = fitted([0; 3], [0; 4], 0);
    let bare = machine.take(A, &Errand::Uncalibrated(to(3000, 0, 0), ALL));
    let usual = fitted([0; 3], [0; 4], 0).take(A, &Errand::Move(Manner::Straight, to(3000, 0, 0)));
    assert_eq!(bare, usual);
}

proptest! {
    #[test]
    fn no_bare_move_panics_or_leaves_the_area(
        offsets: [i32; 3], corners: [i16; 4], hundredths in -200i16..=200,
        x in -3000i16..3000, y in -3000i16..3000, z in -500i16..1500, xy: bool, bare_z: bool,
    ) {
        let mut machine = fitted(offsets, corners.map(|corner| corner % 501), hundredths);
        let report = machine.take(A, &Errand::Uncalibrated(to(x, y, z), Bare { xy, z: bare_z }));
        let Some(Report::Moving { end, .. }) = report else {
            panic!("{report:?}");
        };
        prop_assert!(crate::motion::contains(end.x, end.y));
        prop_assert!((0..=1000 << 16).contains(&end.z.bits()));
    }

    #[test]
    fn calibrating_anywhere_and_clearing_comes_back(x in 900i16..1500, y in -600i16..600, z in 0i16..1000, hundredths in -200i16..=200) {
        let mut machine = fitted([0; 3], [0, 100, 300, 200], hundredths);
        machine.take(A, &Errand::Move(Manner::Straight, to(x, y, z)));
        rest(&mut machine);
        let here = machine.calibration_here();
        machine.set_calibration(here);
        prop_assert_eq!(machine.position(), HOME);
        prop_assert_eq!(machine.angles().to_array().map(Microdegrees::centidegrees), HOME_ANGLES.to_array().map(Microdegrees::centidegrees));
        machine.set_calibration(Calibration::default());
        let back = machine.position();
        let off = (back.x.to_f64() - f64::from(x)).hypot(back.y.to_f64() - f64::from(y));
        prop_assert!(off < 0.1 && (back.z.to_f64() - f64::from(z)).abs() < 0.1, "{:?}", back);
    }
}
