use super::*;

fn near(got: [f64; 3], want: [f64; 3]) -> bool {
    (0..3).all(|i| (got[i] - want[i]).abs() < 1e-9)
}

fn last_report(gcode: &str) -> Report {
    reports(gcode).last().unwrap()
}

#[test]
fn counts() {
    assert_eq!(step_count([0.0; 3], [100.0, 100.0, 0.0], 3.0), 34);
    assert_eq!(step_count([0.0; 3], [0.0; 3], 3.0), 0);
    assert_eq!(step_count([0.0; 3], [0.0, -15.0, 0.0], 15.0), 1);
    assert_eq!(step_count([0.0; 3], [15.001, 0.0, 0.0], 15.0), 2);
    assert_eq!(step_count([3.3, 0.0, 0.0], [8.3, 0.0, 0.0], 5.0), 1); // 8.3 - 3.3 > 5 in f64
    assert_eq!(step_count([0.1, 0.0, 0.0], [0.4, 0.0, 0.0], 0.1), 3); // 0.4 - 0.1 > 0.3
    assert_eq!(step_count([0.0; 3], [5.000_001, 0.0, 0.0], 5.0), 2);
}

#[test]
fn starts_at_home_and_steps_every_10_ms() {
    let all: Vec<Step> = steps("").collect();
    assert_eq!(all.len(), 1);
    assert_eq!(
        (all[0].line, all[0].time_us, all[0].position, all[0].held),
        (0, 0, HOME, false)
    );
    assert!(near(all[0].pulses_us, [2000.0, 1000.0, 2000.0]));

    // 100 units: 7 steps with the pen up. Then down: 1000 units at 15. Then 20 at the pen-down step. No gaps.
    let all: Vec<Step> = steps("G01 X1100\n\nG54\nG1 Z0\nG1 X1120 Y999\nG1 X1120").collect();
    let of = |line| all.iter().filter(|s| s.line == line).count();
    assert_eq!([of(0), of(1), of(4), of(5), of(6)], [1, 7, 67, 4, 0]);
    assert!(
        all.iter()
            .enumerate()
            .all(|(i, s)| s.time_us == 10_000 * i as u64 && !s.held)
    );
    assert!(near(
        all[1].position,
        [1000.0 + 100.0 / 7.0, 1000.0, 1000.0]
    ));
    assert_eq!(all.last().unwrap().position, [1120.0, 999.0, 0.0]);
}

#[test]
fn pen_down_step_needs_both_ends_down() {
    let count = |program: &str| {
        let last = program.lines().count();
        steps(program).filter(|s| s.line == last).count()
    };
    assert_eq!(count("G1 Z0\nG1 X1300"), 60);
    assert_eq!(count("G1 Z499.9\nG94 S30\nG1 X1300"), 10);
    assert_eq!(count("G1 Z499.9\nG94 F3 P50\nG1 X1300"), 100);
    assert_eq!(count("G1 Z500\nG1 X1300"), 20);
    assert_eq!(count("G1 Z0\nG1 X1300 Z500"), 34);
    assert_eq!(count("G1 Z500\nG1 X1300 Z499"), 20);
    assert_eq!(count("G94 P50\nG1 X1300"), 6);
    assert_eq!(count("G1 X1300\nG28"), 20);
    assert_eq!(count("G1 Z-200\nG1 Z-100"), 0); // limited to 0
}

#[test]
fn rapid_servos_each_at_full_speed() {
    // Z alone: 45 degrees, 7.5 steps, so 8.
    let all: Vec<Step> = steps("G00 Z0").collect();
    assert_eq!(all.len(), 9);
    assert!(near(all[3].angles_deg, [135.0, 45.0, 117.0]));
    assert_eq!(all[8].position, [1000.0, 1000.0, 0.0]);

    // To S = E = 90: both 45 degrees, the pen 9.
    let all: Vec<Step> = steps("G00 X1414.213562373095 Y0 Z800").collect();
    assert_eq!(all.len(), 9);
    assert!(near(all[1].angles_deg, [129.0, 51.0, 129.0]));
    assert!(
        near(all[2].angles_deg, [123.0, 57.0, 126.0]),
        "the pen servo has arrived"
    );
    assert!(near(all[2].position, forward(all[2].angles_deg)));
    // Half-way between two steps; the pen servo has arrived there.
    let between = frames("G00 X1414.213562373095 Y0 Z800", 5_000)
        .nth(3)
        .unwrap();
    assert!(near(between.angles_deg, [126.0, 54.0, 126.0]));
}

#[test]
fn rapid_is_held_at_the_body() {
    // Up along the body: the servos' way bulges to x < 500.
    let program = "G00 X500 Y0\nG00 X500 Y900";
    let all: Vec<Step> = steps(program).filter(|s| s.line == 2).collect();
    assert_eq!((all.len(), all.iter().filter(|s| s.held).count()), (13, 12));
    for s in &all {
        assert!((s.position[0] - 500.0).abs() < 1e-9 && area::inside(s.position[0], s.position[1]));
        assert!(near(forward(s.angles_deg), s.position), "{s:?}");
    }
    assert_eq!(all[12].position, [500.0, 900.0, 1000.0]);
    assert!(
        last_report(program).limited,
        "the target was good, the way was not"
    );
}

#[test]
fn transform() {
    // Scale first, then offset; Z never; G28 not at all; what is omitted stays.
    assert_eq!(
        last_report("G54 X100 Y0 S2.5\nG01 X200 Y100 Z7").target,
        [600.0, 250.0, 7.0]
    );
    assert_eq!(
        last_report("G54 X100 S2.5\nG01 X200 Y100\nG1 Z0").target,
        [600.0, 250.0, 0.0]
    );
    assert_eq!(
        last_report("G54 X100 S2\nG54 Y50\nG01 X300 Y100").target,
        [700.0, 250.0, 1000.0]
    );
    assert_eq!(
        last_report("G54 X100 S2\nG01 X300 Y100 Z3\nG28").target,
        HOME
    );
}

#[test]
fn targets_outside() {
    let limited = |program, target| {
        let report = last_report(program);
        report.limited && near(report.target, target)
    };
    assert!(limited("G01 X3000 Y0 Z600", [1950.0, 0.0, 600.0]));
    assert!(limited("G01 X3000 Y0 Z499", [1950.0, 0.0, 1000.0]));
    assert!(limited("G00 X0 Y0 Z1000", [500.0, 0.0, 1000.0]));
    assert!(!last_report("G01 X1950 Y0 Z-5").limited);
    assert_eq!(last_report("G01 X1950 Y0 Z-5").target, [1950.0, 0.0, 0.0]);
}

#[test]
fn crossing_the_notch_is_held() {
    let program = "G01 X510 Y300\nG01 Z0\nG01 X720 Y-300";
    assert!(last_report(program).limited);
    assert!(!reports(program).nth(1).unwrap().limited);
    assert!(!last_report("G01 X710 Y300\nG01 X720 Y-300").limited);
    let crossing: Vec<Step> = steps(program).filter(|s| s.line == 3).collect();
    assert_eq!(crossing.len(), 120);
    assert!(
        crossing
            .iter()
            .all(|s| area::inside(s.position[0], s.position[1]) && s.position[2] == 0.0)
    );
    // The line is in the notch from y = 0, exclusive, until x = 700: y = 300 - 600/210 * 190 = -242.86.
    assert_eq!(crossing.iter().filter(|s| s.held).count(), 48);
    // On y = 0 at first, then on x = 700.
    assert!(near(
        crossing[60].position,
        [510.0 + 210.0 * 61.0 / 120.0, 0.0, 0.0]
    ));
    assert!(near(crossing[107].position, [700.0, -240.0, 0.0]));
    assert!(!crossing[108].held);
}

#[test]
fn frames_between_steps() {
    let far_off = Fitting {
        offsets_deg: [1.8, 0.0, 180.0],
        ..Fitting::NONE
    };
    // 20 units down at 5: 4 steps, 40 ms. Frames of 7 ms, the last one at rest.
    let all: Vec<Step> = frames_fitted("G1 Z0\nG1 X1020", 7_000, far_off).collect();
    let end = 10_000 * (67 + 4);
    assert_eq!(all.last().unwrap().time_us, 714_000);
    assert!(
        all.iter()
            .enumerate()
            .all(|(i, s)| s.time_us == 7_000 * i as u64 && s.time_us < end + 7_000)
    );
    let at = |us: u64| all[(us / 7_000) as usize];
    assert!(near(at(672_000).position, [1001.0, 1000.0, 0.0]));
    assert!(near(at(707_000).position, [1018.5, 1000.0, 0.0]));
    assert_eq!(at(714_000).position, [1020.0, 1000.0, 0.0]);
    let s = at(707_000);
    assert!(near(s.angles_deg, inverse(1018.5, 1000.0, 0.0)));
    assert!(
        (s.pulses_us[0] - pulse(s.angles_deg[0]) - 20.0).abs() < 1e-9 && s.pulses_us[2] == 2500.0
    );
    assert_eq!(frames("G1 Z0", 1_000_000).count(), 2);
}

#[test]
fn a_dwell_stays_for_its_time() {
    let all: Vec<Report> = reports("G1 X1015\nG4 P0.5\nG4 S0.0015\nG1 X1000").collect();
    let ends: Vec<u64> = all.iter().map(|report| report.end_us).collect();
    assert_eq!(ends, [10_000, 510_000, 511_500, 521_500]);
    assert_eq!(all[2].target, [1015.0, 1000.0, 1000.0]);
}

#[test]
fn a_bare_move_tells_the_servos_what_an_exact_arm_is_told() {
    let odd = Fitting {
        offsets_deg: [3.0, -2.0, 1.0],
        map: [0.0, 100.0, 300.0, 200.0],
        shift_mm: 0.85,
    };
    let last = |program| frames_fitted(program, STEP_US, odd).last().unwrap();
    let told = |x, y, z| inverse(x, y, z).map(pulse);
    assert!(near(
        last("G40 X1400 Y-300 Z700").pulses_us,
        told(1400.0, -300.0, 700.0)
    ));
    // What is left out stays.
    let step = last("G40 X1400 Y-300 Z700\nG54 S2 X9\nG40 Y200");
    assert!(near([step.pulses_us[0], step.pulses_us[1], 0.0], {
        let [s, e, _] = told(1400.0, 200.0, 0.0);
        [s, e, 0.0]
    }));
}
