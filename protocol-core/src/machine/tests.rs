//! The arm in time: what begins when, what it answers, where it is.

extern crate std;
use super::*;
use crate::motion::{Coordinate, WideCoordinate, contains};

const A: Client = Client(0);
const B: Client = Client(1);

fn arm() -> Machine {
    Machine::new(ArmData::default(), Calibration::default())
}

fn line(x: i16, y: i16, z: i16) -> Errand {
    Errand::Move(Manner::Straight, Target::at(Position::from_units(x, y, z)))
}

fn moving(x: i16, y: i16, z: i16) -> Report {
    Report::Moving {
        end: Position::from_units(x, y, z),
        limited: None,
    }
}

/// Ticks each 10 ms up to and with `until`, in milliseconds, and gives the last set-point.
fn run(machine: &mut Machine, from: u64, until: u64) -> SetPoint {
    let mut last = machine.last;
    for at in (from..=until).step_by(10) {
        last = machine.tick(Micros::new(at * 1000));
    }
    last
}

#[test]
fn a_move_from_rest_is_answered_at_once() {
    let mut machine = arm();
    assert_eq!(
        machine.take(A, &line(1000, 1000, 0)),
        Some(moving(1000, 1000, 0))
    );
}

#[test]
fn a_move_in_motion_is_answered_when_the_prior_one_has_completed() {
    let mut machine = arm();
    // 100 units with the pen up: 7 steps, 70 ms.
    machine.take(A, &line(1100, 1000, 1000));
    assert_eq!(machine.take(A, &line(1100, 900, 1000)), None);
    run(&mut machine, 0, 60);
    assert_eq!(machine.next_report(), None);
    run(&mut machine, 70, 70);
    assert_eq!(machine.next_report(), Some((A, moving(1100, 900, 1000))));
    assert_eq!(
        run(&mut machine, 80, 140).position,
        Position::from_units(1100, 900, 1000)
    );
    assert!(!machine.is_busy());
}

#[test]
fn moves_follow_one_another_without_a_gap_whatever_the_frame() {
    for frame in [1_000, 3_003, 10_000, 20_000, 200_000] {
        let mut machine = arm();
        machine.take(A, &line(1015, 1000, 1000));
        machine.take(A, &line(1015, 985, 1000));
        machine.take(B, &line(1000, 985, 1000));
        let mut now = 0;
        while machine.is_busy() {
            now += frame;
            machine.tick(Micros::new(now));
        }
        // Three steps of 10 ms, seen at the first frame from then on.
        assert_eq!(
            machine.clock.max(Micros::new(30_000)),
            Micros::new(now),
            "{frame}"
        );
        assert_eq!(now, 30_000_u64.div_ceil(frame) * frame);
    }
}

#[test]
fn a_move_to_where_the_arm_is_takes_no_time() {
    let mut machine = arm();
    for _ in 0..3 {
        assert_eq!(
            machine.take(A, &line(1000, 1000, 1000)),
            Some(moving(1000, 1000, 1000))
        );
    }
}

#[test]
fn corners_are_reached_exactly() {
    let mut machine = arm();
    machine.take(A, &line(1100, 1000, 1000));
    machine.take(A, &line(1100, 900, 1000));
    assert_eq!(
        run(&mut machine, 0, 70).position,
        Position::from_units(1100, 1000, 1000)
    );
}

#[test]
fn clients_take_turns_in_the_order_they_came() {
    let mut machine = arm();
    machine.take(A, &line(1015, 1000, 1000));
    machine.take(B, &line(1030, 1000, 1000));
    machine.take(A, &line(1045, 1000, 1000));
    run(&mut machine, 0, 10);
    assert_eq!(machine.next_report(), Some((B, moving(1030, 1000, 1000))));
    run(&mut machine, 20, 20);
    assert_eq!(machine.next_report(), Some((A, moving(1045, 1000, 1000))));
}

#[test]
fn an_omitted_coordinate_is_the_arms_when_the_move_begins() {
    let mut machine = arm();
    machine.take(A, &line(1100, 1000, 1000));
    let lower = Target {
        z: Some(WideCoordinate::from_bits(0)),
        ..Target::default()
    };
    machine.take(B, &Errand::Move(Manner::Straight, lower));
    run(&mut machine, 0, 70);
    assert_eq!(machine.next_report(), Some((B, moving(1100, 1000, 0))));
}

#[test]
fn out_of_reach_goes_to_the_closest_point_with_the_pen_up() {
    let mut machine = arm();
    let Some(Report::Moving { end, limited }) = machine.take(A, &line(2500, 0, 0)) else {
        unreachable!("the arm rests");
    };
    assert_eq!((end.x.rounded(), end.y.rounded(), end.z), (1950, 0, PEN_UP));
    assert_eq!(limited, Some(Limited::Target { lifted: true }));
    let last = run(&mut machine, 0, 2000);
    assert!(last.held && last.position == end);
}

#[test]
fn a_short_end_is_marked_also_when_the_next_move_follows_at_once() {
    let mut machine = arm();
    machine.take(A, &line(2500, 1000, 1000));
    machine.take(A, &line(1000, 1000, 1000));
    let marked = (0..400)
        .filter(|at| machine.tick(Micros::new(at * 10_000)).held)
        .count();
    assert_eq!(marked, 1);
}

#[test]
fn z_is_limited_without_a_word() {
    let mut machine = arm();
    assert_eq!(
        machine.take(A, &line(1000, 1000, -20)),
        Some(moving(1000, 1000, 0))
    );
    run(&mut machine, 0, 1000);
    assert_eq!(
        machine.take(A, &line(1000, 1000, 2000)),
        Some(moving(1000, 1000, 1000))
    );
}

#[test]
fn a_way_over_the_body_is_held_at_the_edge() {
    let mut machine = arm();
    machine.take(A, &line(510, 300, 1000));
    run(&mut machine, 0, 1000);
    let over = line(720, -300, 1000);
    let Some(Report::Moving { limited, .. }) = machine.take(A, &over) else {
        unreachable!("the arm rests");
    };
    assert_eq!(limited, Some(Limited::Way));
    let mut held = 0;
    for at in 101..=200 {
        let set_point = machine.tick(Micros::new(at * 10_000));
        assert!(contains(set_point.position.x, set_point.position.y));
        held += u32::from(set_point.held);
    }
    assert!(held > 5, "{held}");
    assert_eq!(machine.position(), Position::from_units(720, -300, 1000));
}

#[test]
fn a_rapid_way_over_the_body_is_held_and_told() {
    let mut machine = arm();
    machine.take(A, &line(510, 300, 1000));
    run(&mut machine, 0, 1000);
    let over = Errand::Move(
        Manner::Rapid,
        Target::at(Position::from_units(700, -900, 1000)),
    );
    let report = machine.take(A, &over);
    let mut held = false;
    for at in 1001..=1400 {
        let set_point = machine.tick(Micros::new(at * 1_000));
        assert!(
            contains(set_point.position.x, set_point.position.y),
            "{set_point:?}"
        );
        held |= set_point.held;
    }
    let Some(Report::Moving { limited, .. }) = report else {
        unreachable!("the arm rests")
    };
    assert_eq!((held, limited), (true, Some(Limited::Way)));
}

#[test]
fn an_abandoned_pen_is_lifted_after_five_seconds() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 0, 1000);
    machine.client_gone(A);
    assert!(run(&mut machine, 1010, 5990).position.pen_is_down());
    assert_eq!(run(&mut machine, 6000, 7000).position, HOME);
}

#[test]
fn another_clients_drawing_keeps_the_pen_down() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 0, 1000);
    machine.client_gone(A);
    machine.take(B, &line(1100, 1000, 0));
    assert!(run(&mut machine, 1010, 9000).position.pen_is_down());
}

#[test]
fn a_listener_that_leaves_does_not_lift_the_drawers_pen() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    machine.client_gone(B);
    assert!(run(&mut machine, 0, 9000).position.pen_is_down());
}

#[test]
fn a_rest_is_kept_until_it_is_released() {
    let mut machine = arm();
    machine.take(A, &line(1015, 1000, 1000));
    assert_eq!(machine.take(A, &Errand::Rest), None);
    assert_eq!(machine.take(B, &line(1030, 1000, 1000)), None);
    run(&mut machine, 0, 10);
    assert_eq!(machine.next_report(), Some((A, Report::Resting)));
    assert_eq!(
        run(&mut machine, 20, 500).position.x,
        Coordinate::from_units(1015)
    );
    machine.release(B);
    assert_eq!(
        run(&mut machine, 510, 600).position.x,
        Coordinate::from_units(1015)
    );
    machine.release(A);
    run(&mut machine, 610, 610);
    assert_eq!(machine.next_report(), Some((B, moving(1030, 1000, 1000))));
    assert_eq!(
        run(&mut machine, 620, 620).position.x,
        Coordinate::from_units(1030)
    );
}

#[test]
fn calibrating_keeps_the_servos_and_makes_their_place_home() {
    let mut machine = arm();
    machine.take(A, &line(1020, 990, 950));
    let before = run(&mut machine, 0, 1000);
    let calibration = machine.calibration_here();
    machine.set_calibration(calibration);
    let after = machine.tick(Micros::new(1_010_000));
    assert_eq!(after.position, HOME);
    for (before, after) in before.pulses.iter().zip(after.pulses) {
        // Within what the tables differ from the exact angles at home.
        assert!(
            before.get().abs_diff(after.get()) <= 50,
            "{before:?} {after:?}"
        );
    }
    machine.set_calibration(Calibration::default());
    let cleared = machine.tick(Micros::new(1_020_000));
    assert_eq!(
        (cleared.position.x.rounded(), cleared.position.y.rounded()),
        (1020, 990)
    );
    assert_eq!(cleared.position.z.rounded(), 950);
}

#[test]
fn pictures_see_what_the_pulses_say() {
    let mut machine = arm();
    machine.take(A, &line(1400, -300, 0));
    let last = run(&mut machine, 0, 2000);
    let seen = position_of(last.pulses, machine.data());
    assert!((seen.x.to_f64() - 1400.0).abs() < 0.05 && (seen.y.to_f64() + 300.0).abs() < 0.05);
    assert!(seen.z.to_f64() < 0.01);
}

#[test]
fn visitors_that_come_and_go_do_not_put_off_the_lift() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 0, 1000);
    machine.client_gone(A);
    for second in 1..5 {
        run(&mut machine, second * 1000, second * 1000 + 990);
        machine.client_gone(A);
    }
    assert!(!run(&mut machine, 5000, 7000).position.pen_is_down());
}

#[test]
fn a_jump_of_the_calibration_shows_in_the_frames() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 0, 1000);
    machine.set_calibration(machine.calibration_here());
    run(&mut machine, 1010, 1100);
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 1110, 2000);
    assert!(!run(&mut machine, 2010, 2010).moving);
    // The pen was told 45 degrees, which without calibration is below the paper.
    machine.set_calibration(Calibration::default());
    assert!(run(&mut machine, 2020, 2020).moving);
}

#[test]
fn a_wave_goes_to_both_sides_and_comes_back() {
    let mut machine = arm();
    assert_eq!(
        machine.take(Client::HOUSE, &Errand::Wave),
        Some(moving(1000, 1000, 1000))
    );
    let places: std::vec::Vec<Position> = (0..=80)
        .map(|frame| machine.tick(Micros::new(frame * 10_000)).position)
        .collect();
    let units = |position: &Position| position.y.to_f64();
    let most = places.iter().map(units).fold(0.0, f64::max);
    let least = places.iter().map(units).fold(2000.0, f64::min);
    assert!(most > 1140.0 && least < 860.0, "{least} to {most}");
    for step in places.windows(2) {
        let pace = (units(&step[1]) - units(&step[0])).abs();
        assert!(pace <= 15.0, "{pace} units in a frame");
    }
    assert!(
        places
            .iter()
            .all(|place| place.x == HOME.x && place.z == HOME.z)
    );
    assert_eq!(places.last(), Some(&HOME));
    assert!(!machine.is_busy());
}

#[test]
fn a_wave_stays_inside_the_area_and_is_none_with_the_pen_down() {
    let mut machine = arm();
    machine.take(A, &line(500, 10, 1000));
    run(&mut machine, 0, 2000);
    machine.take(Client::HOUSE, &Errand::Wave);
    for frame in 201..=281 {
        let place = machine.tick(Micros::new(frame * 10_000)).position;
        assert!(contains(place.x, place.y), "{place:?}");
    }
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 2820, 6000);
    machine.take(Client::HOUSE, &Errand::Wave);
    assert!(!machine.is_busy());
}

#[test]
fn a_move_sent_during_a_wave_waits_for_its_end() {
    let mut machine = arm();
    machine.take(Client::HOUSE, &Errand::Wave);
    assert_eq!(machine.take(A, &line(1000, 900, 0)), None);
    run(&mut machine, 0, 790);
    assert_eq!(machine.next_report(), None);
    run(&mut machine, 800, 800);
    assert_eq!(machine.next_report(), Some((A, moving(1000, 900, 0))));
}

#[test]
fn a_dwell_takes_its_turn_and_its_time() {
    let mut machine = arm();
    machine.take(A, &line(1015, 1000, 1000));
    let dwell = Errand::Dwell(Micros::from_millis(250));
    assert_eq!(machine.take(A, &dwell), None);
    run(&mut machine, 0, 10);
    // It has begun, and is answered; what comes after it waits for its end.
    assert_eq!(machine.next_report(), Some((A, moving(1015, 1000, 1000))));
    assert_eq!(machine.take(A, &line(1030, 1000, 1000)), None);
    let last = run(&mut machine, 20, 250);
    assert_eq!(last.position, Position::from_units(1015, 1000, 1000));
    assert!(last.moving && !last.held);
    assert_eq!(machine.next_report(), None);
    let last = run(&mut machine, 260, 270);
    assert_eq!(machine.next_report(), Some((A, moving(1030, 1000, 1000))));
    assert_eq!(last.position, Position::from_units(1030, 1000, 1000));
}

#[test]
fn a_dwell_is_never_longer_than_an_hour_and_may_be_nothing() {
    let mut machine = arm();
    machine.take(A, &Errand::Dwell(Micros::new(u64::MAX)));
    assert_eq!(machine.next_event(), Some(Micros::from_secs(3600)));
    let mut machine = arm();
    machine.take(A, &Errand::Dwell(Micros::default()));
    assert_eq!(
        machine.take(A, &line(1015, 1000, 1000)),
        Some(moving(1015, 1000, 1000))
    );
}

#[test]
fn a_pen_left_down_rises_in_the_middle_of_a_dwell() {
    let mut machine = arm();
    machine.take(A, &line(1000, 1000, 0));
    run(&mut machine, 0, 1000);
    machine.take(B, &Errand::Dwell(Micros::from_secs(3600)));
    machine.client_gone(A);
    assert!(run(&mut machine, 1010, 5990).position.pen_is_down());
    assert!(!run(&mut machine, 6000, 7000).position.pen_is_down());
}

#[test]
fn a_stop_ends_a_dwell_and_answers_one_that_waits() {
    let mut machine = arm();
    machine.take(A, &Errand::Dwell(Micros::from_secs(10)));
    machine.take(B, &Errand::Dwell(Micros::from_secs(10)));
    run(&mut machine, 0, 100);
    machine.stop(StopReason::Requested);
    assert_eq!(machine.next_report(), Some((B, Report::Stopped)));
    assert!(!machine.is_busy());
    assert_eq!(
        machine.take(A, &Errand::Dwell(Micros::default())),
        Some(Report::Stopped)
    );
}

#[test]
fn an_errand_that_waits_can_be_taken_back_and_one_that_has_begun_cannot() {
    let mut machine = arm();
    let there = |x| line(x, 0, 1000);
    assert!(machine.take(Client::JOB, &there(1200)).is_some());
    assert_eq!(machine.take(Client::JOB, &there(1400)), None);
    assert!(machine.withdraw(Client::JOB));
    assert!(!machine.withdraw(Client::JOB));
    let end = machine.next_event().unwrap();
    machine.advance(end);
    assert_eq!(machine.next_report(), None);
    assert_eq!(machine.position(), Position::from_units(1200, 0, 1000));

    machine.take(Client::JOB, &there(1400));
    machine.take(Client::JOB, &there(1600));
    let end = machine.next_event().unwrap();
    machine.advance(end);
    assert!(!machine.withdraw(Client::JOB));
    assert!(matches!(
        machine.next_report(),
        Some((Client::JOB, Report::Moving { .. }))
    ));
}

#[test]
fn everybody_has_a_place_of_his_own() {
    let network = (0..).map_while(Client::new);
    let web = (0..).map_while(Client::web);
    let others = [Client::SERIAL, Client::HOUSE, Client::JOB, Client::DRAWER];
    let mut slots: std::vec::Vec<usize> =
        network.chain(web).chain(others).map(Client::slot).collect();
    slots.sort_unstable();
    assert_eq!(slots, (0..MAX_ASKERS).collect::<std::vec::Vec<_>>());
}
