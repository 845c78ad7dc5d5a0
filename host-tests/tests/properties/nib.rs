//! Where the nib really is, on a lift that moves it to the side, over paper that is not flat.

use host_tests::bench::Bench;
use host_tests::model::{Fitting, closest, forward};
use proptest::prelude::*;
use protocol_core::arm::Calibration;
use protocol_core::machine::SetPoint;

/// How far the nib may stray, in drawing units: 0.05 mm.
const STRAY: f64 = 1.0;
/// What is closer to an edge than the largest shift, and a half of it for paper that lies below Z = 0, may be held there.
/// Along the axes that is up to a half further.
const MARGIN: f64 = 90.0;

/// The nib of an arm that is built so, by its servos' pulses alone: x, y, and the height above Z = 0.
fn nib(set_point: &SetPoint, built: &Fitting) -> [f64; 3] {
    let angles = set_point
        .pulses
        .map(|pulse| (pulse.to_f64() - 500.0) * 180.0 / 2000.0);
    built.physical_nib(forward(angles))
}

/// An arm over a place, its pen up, with map and shift set as it is built, or with another shift.
fn over(x: f64, y: f64, built: &Fitting, set_mm: f64) -> Bench {
    let mut bench = Bench::new(7_000, Calibration::default());
    let [a, b, c, d] = built.map;
    bench.say(0, &format!("G31 S{a};{b};{c};{d} P{set_mm}"));
    bench.say(0, &format!("G01 X{x} Y{y}"));
    bench.rest();
    bench.frames.clear();
    bench
}

fn well_inside(x: f64, y: f64) -> bool {
    [(MARGIN, 0.0), (-MARGIN, 0.0), (0.0, MARGIN), (0.0, -MARGIN)]
        .iter()
        .all(|(dx, dy)| closest(x + dx, y + dy) == (x + dx, y + dy))
}

prop_compose! {
    fn place()(x in 590.0..1860.0, y in -1500.0..1500.0) -> Option<(f64, f64)> {
        let (x, y) = (f64::round(x), f64::round(y));
        well_inside(x, y).then_some((x, y))
    }
}

fn anywhere() -> impl Strategy<Value = (f64, f64)> {
    place().prop_filter_map("at an edge the arm is held", |place| place)
}

prop_compose! {
    fn built()(heights: [i16; 4], hundredths in -200i16..=200, flat: bool) -> Fitting {
        Fitting {
            map: if flat { [0.0; 4] } else { heights.map(|height| f64::from(height % 501)) },
            shift_mm: f64::from(hundredths) / 100.0,
            ..Fitting::NONE
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_nib_stays_put_while_the_pen_comes_down_and_rises((x, y) in anywhere(), built in built()) {
        let mut bench = over(x, y, &built, built.shift_mm);
        for line in ["G01 Z0", "G01 Z1000"] {
            bench.say(0, line);
            let last = bench.rest();
            if line == "G01 Z0" {
                let [_, _, height] = nib(&last, &built);
                let paper = built.height(x, y);
                prop_assert!((height - paper).abs() < 0.1, "the nib is at {height}, the paper at {paper}");
            }
        }
        prop_assert!(bench.frames.len() > 100);
        for frame in &bench.frames {
            let [nib_x, nib_y, _] = nib(&frame.set_point, &built);
            let strayed = (nib_x - x).hypot(nib_y - y);
            prop_assert!(strayed <= STRAY, "at {} us the nib is {strayed} units off", frame.time_us);
        }
    }

    #[test]
    fn with_a_wrong_setting_it_does_not((x, y) in anywhere(), built in built()) {
        let wrong = if built.shift_mm > 0.0 { built.shift_mm - 0.5 } else { built.shift_mm + 0.5 };
        let mut bench = over(x, y, &built, wrong);
        bench.say(0, "G01 Z0");
        let [nib_x, nib_y, height] = nib(&bench.rest(), &built);
        // Half a millimetre is 10 units over the whole lift.
        let expected = 10.0 * (1.0 - height / 1000.0);
        let strayed = (nib_x - x).hypot(nib_y - y);
        prop_assert!((strayed - expected).abs() < 0.1, "the nib is {strayed} units off, not {expected}");
    }

    #[test]
    fn strokes_are_straight((x, y) in anywhere(), (to_x, to_y) in anywhere(), built in built()) {
        let mut bench = over(x, y, &built, built.shift_mm);
        bench.say(0, "G94 S30");
        bench.say(0, "G01 Z0");
        bench.rest();
        bench.frames.clear();
        bench.say(0, &format!("G01 X{to_x} Y{to_y}"));
        bench.rest();
        let length = (to_x - x).hypot(to_y - y).max(1.0);
        for frame in &bench.frames {
            // Over the body's step, and where the arm would leave the area, it is held.
            let place = frame.set_point.position;
            if frame.set_point.held || !well_inside(place.x.to_f64(), place.y.to_f64()) {
                continue;
            }
            let [nib_x, nib_y, height] = nib(&frame.set_point, &built);
            let aside = ((nib_x - x) * (to_y - y) - (nib_y - y) * (to_x - x)).abs() / length;
            prop_assert!(aside <= STRAY, "at {} us the nib is {aside} units aside", frame.time_us);
            let paper = built.height(nib_x, nib_y);
            prop_assert!((height - paper).abs() < 1.0, "the nib is at {height}, the paper at {paper}");
        }
    }
}
