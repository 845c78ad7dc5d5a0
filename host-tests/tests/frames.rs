//! The arm at servo frames that are no multiple of a step: what happens between two frames happens at
//! its own time.

use host_tests::bench::Bench;
use protocol_core::arm::Calibration;
use protocol_core::motion::Position;

/// Servo frames in microseconds: finer than a step, odd, a step, a chip's, and far too slow.
const FRAMES_US: [u64; 6] = [1_000, 3_003, 10_000, 20_000, 50_000, 200_000];

fn arm(frame_us: u64) -> Bench {
    Bench::new(frame_us, Calibration::default())
}

#[test]
fn a_drawing_takes_the_same_time_at_every_frame() {
    for frame_us in FRAMES_US {
        let mut arm = arm(frame_us);
        // 1, 7, 10 and 67 steps without a gap.
        for line in ["G01 X1015", "G01 X1115", "G01 Y850", "G01 Z0"] {
            arm.say(0, line);
        }
        arm.rest();
        let last = arm.frames.last().map(|frame| frame.time_us);
        assert_eq!(
            last,
            Some(850_000_u64.next_multiple_of(frame_us)),
            "frames of {frame_us} us"
        );
    }
}

#[test]
fn calibrating_in_motion_takes_the_place_where_the_move_ends() {
    for frame_us in FRAMES_US {
        let mut arm = arm(frame_us);
        // One step, which ends between two frames of the slower ones.
        arm.say(0, "G01 X1015");
        arm.say(0, "M374");
        let expected = {
            let mut arm = self::arm(10_000);
            arm.say(0, "G01 X1015");
            arm.rest();
            arm.say(0, "M374");
            arm.machine().calibration()
        };
        let got = arm.machine().calibration();
        assert_eq!(got, expected, "frames of {frame_us} us");
        assert_eq!(
            arm.rest().position,
            Position::from_units(1000, 1000, 1000),
            "the calibration point is home, frames of {frame_us} us"
        );
    }
}

#[test]
fn clearing_the_calibration_in_motion_does_not_shorten_the_move() {
    for frame_us in FRAMES_US {
        let mut arm = arm(frame_us);
        arm.say(0, "G01 X1015");
        arm.say(0, "M374 Sclear");
        let x = arm.rest().position.x.to_f64();
        assert!((x - 1015.0).abs() < 0.01, "X {x}, frames of {frame_us} us");
    }
}

#[test]
fn the_frame_that_shows_a_move_complete_belongs_to_it() {
    for frame_us in FRAMES_US {
        let mut arm = arm(frame_us);
        arm.say(0, "G01 X1015");
        let last = arm.rest();
        assert_eq!(last.position, Position::from_units(1015, 1000, 1000));
        assert!(
            last.moving,
            "said to be at rest on its way, frames of {frame_us} us"
        );
        assert!(!arm.tick().moving, "frames of {frame_us} us");
    }
}
