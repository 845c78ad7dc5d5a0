//! What holds for any job, however its orders arrive.

use crate::jobs::line;
use crate::way::{Piece, Reading, Walk, corner_limit, pieces, place};
use host_tests::model::Order;
use host_tests::plotter::{Plotter, point};
use proptest::prelude::*;
use protocol_core::machine::{ArmData, Machine, NotPlanned, SetPoint, StopReason};
use protocol_core::motion::{Feed, Intensity, PLAN_SEGMENTS, Segment, Side};

const FRAME_US: u64 = 5_000;
const FRAME_S: f64 = FRAME_US as f64 / 1e6;
/// mm/s2.
const ACCELERATION: f64 = 500.0;
/// Full speed of the default servos, in degrees a second.
const SERVOS: f64 = 600.0;
/// Z of light contact and of the lifted pen.
const CONTACT: f64 = 400.0;
const UP: f64 = 1000.0;

/// An order, and how many frames its host takes to send it.
type Sent = (Order, u32);

fn any_order(feeds: std::ops::Range<f64>) -> impl Strategy<Value = Order> {
    let anywhere = (0.0..=50.0, 0.0..=90.0, feeds.clone(), any_intensity());
    let lines = anywhere.prop_map(|(x, y, feed, intensity)| line(x, y, feed, intensity));
    let dwells = (0.0..0.1, any_intensity())
        .prop_map(|(seconds, intensity)| Order::Dwell { seconds, intensity });
    prop_oneof![9 => lines, 1 => dwells]
}

fn any_intensity() -> impl Strategy<Value = u8> {
    prop_oneof![1 => Just(0), 2 => 1..=255u8]
}

fn beyond_the_table() -> impl Strategy<Value = (f64, f64)> {
    prop_oneof![
        (-100.0..-0.001, -100.0..190.0),
        (50.001..150.0, -100.0..190.0),
        (-100.0..150.0, -100.0..-0.001),
        (-100.0..150.0, 90.001..190.0),
    ]
}

/// A curve of short segments, as hosts send them.
fn any_curve() -> impl Strategy<Value = Vec<Order>> {
    let shape = (0.02..2.0, 0.0..6.2, -0.3..0.3, 5..60usize);
    (shape, 300.0..8000.0, any_intensity()).prop_map(
        |((length, mut angle, turn, count), feed, intensity): ((f64, f64, f64, usize), f64, u8)| {
            let (mut x, mut y) = (25.0, 45.0);
            let curve = (0..count).map(|_| {
                angle += turn;
                x = f64::clamp(x + length * angle.cos(), 0.0, 50.0);
                y = f64::clamp(y + length * angle.sin(), 0.0, 90.0);
                line(x, y, feed, intensity)
            });
            curve.collect()
        },
    )
}

/// A job whose orders come all at once, or with pauses.
fn any_job() -> impl Strategy<Value = Vec<Sent>> {
    let orders = prop_oneof![
        1 => prop::collection::vec(any_order(300.0..8000.0), 1..12),
        1 => any_curve(),
    ];
    let pauses = prop_oneof![
        Just(vec![0]),
        prop::collection::vec(0..4u32, 8),
        prop::collection::vec(prop_oneof![6 => Just(0), 1 => 0..200u32], 8),
    ];
    (orders, pauses)
        .prop_map(|(orders, pauses)| orders.into_iter().zip(pauses.into_iter().cycle()).collect())
}

/// Has a job done in frames, with its pauses; gives its way on the table, as planned.
fn draw(plotter: &mut Plotter, job: &[Sent]) -> Vec<Piece> {
    for (order, pause) in job {
        for _ in 0..*pause {
            plotter.tick();
        }
        while !plotter.plan(order) {
            plotter.tick();
        }
    }
    plotter.rest();
    let rounded: Vec<Order> = job.iter().map(|(order, _)| as_planned(order)).collect();
    pieces([0.0; 2], &rounded)
}

/// The same, as exact as the plan has it.
fn as_planned(order: &Order) -> Order {
    match *order {
        Order::Line {
            to,
            feed,
            intensity,
        } => {
            let to = point(to);
            line(to.x.to_f64(), to.y.to_f64(), feed, intensity)
        }
        dwell => dwell,
    }
}

/// Degrees of shoulder, elbow and pen.
fn angles(set_point: &SetPoint) -> [f64; 3] {
    set_point
        .pulses
        .map(|pulse| (pulse.to_f64() - 500.0) * 180.0 / 2000.0)
}

fn check_servos(frames: &[SetPoint], frame_s: f64, most: f64) -> Result<(), TestCaseError> {
    for pair in frames.windows(2) {
        for (a, b) in angles(&pair[0]).into_iter().zip(angles(&pair[1])) {
            // The tables' error of an angle, twice.
            let speed = ((b - a).abs() - 0.0006).max(0.0) / frame_s;
            prop_assert!(
                speed <= most * 1.001,
                "a servo turns at {speed} deg/s: {pair:?}"
            );
        }
    }
    Ok(())
}

fn check_table(frames: &[SetPoint]) -> Result<(), TestCaseError> {
    for frame in frames {
        let [x, y] = place(frame);
        prop_assert!(
            (0.0..=50.0).contains(&x) && (0.0..=90.0).contains(&y) && !frame.held,
            "({x}, {y}) is not on the table"
        );
    }
    Ok(())
}

/// Along the way: never back, never beside it, no more acceleration than allowed, no corner too fast, and
/// the pen where it should be.
fn check_way(frames: &[SetPoint], pieces: &[Piece]) -> Result<(), TestCaseError> {
    let mut walk = Walk::new(pieces);
    for frame in frames {
        let z = frame.position.z.to_f64();
        let keeps = walk.step(frame, |last, now| {
            keeps_its_acceleration(last, now)?;
            keeps_its_corners(pieces, last, now)?;
            keeps_its_pen(&pieces[now.index], now.distance, z)
        });
        keeps.map_err(TestCaseError::fail)?;
    }
    let whole = pieces
        .last()
        .map_or(0.0, |piece| piece.begins + piece.length);
    let end = walk.distance();
    prop_assert!((end - whole).abs() < 1e-4, "ends after {end} of {whole} mm");
    Ok(())
}

fn keeps_its_acceleration(last: &Reading, now: &Reading) -> Result<(), String> {
    let change = (now.step - last.step).abs() / FRAME_S / FRAME_S;
    // A percent, and what distances are good to: 2e-5 mm.
    if change <= ACCELERATION * 1.01 + 3.0 {
        return Ok(());
    }
    Err(format!("{change} mm/s2 after {} mm", now.distance))
}

fn keeps_its_corners(pieces: &[Piece], last: &Reading, now: &Reading) -> Result<(), String> {
    for pair in pieces.windows(2).take(now.index).skip(last.index) {
        let limit = corner_limit(&pair[0], &pair[1]);
        let most = limit + ACCELERATION * FRAME_S / 2.0 + 0.01;
        let speed = now.step / FRAME_S;
        if speed > most {
            let corner = pair[1].begins;
            return Err(format!(
                "{speed} mm/s through the corner after {corner} mm, {limit} is its limit"
            ));
        }
    }
    Ok(())
}

fn keeps_its_pen(piece: &Piece, distance: f64, z: f64) -> Result<(), String> {
    let (before, after) = (
        distance - piece.begins,
        piece.begins + piece.length - distance,
    );
    let right = match piece.intensity {
        _ if before < 1e-4 || after < 1e-4 => true,
        0 => z == UP,
        _ => z <= CONTACT,
    };
    if right {
        return Ok(());
    }
    Err(format!("Z {z} after {distance} mm, on {piece:?}"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_job_keeps_to_its_way_its_acceleration_and_its_pen(job in any_job()) {
        let mut plotter = Plotter::new(FRAME_US);
        let pieces = draw(&mut plotter, &job);
        check_table(&plotter.frames)?;
        check_servos(&plotter.frames, FRAME_S, SERVOS)?;
        if let Some(end) = pieces.last() {
            check_way(&plotter.frames, &pieces)?;
            let at = plotter.machine.table_position();
            prop_assert_eq!([at.x.to_f64(), at.y.to_f64()], end.to);
        }
    }

    #[test]
    fn every_segment_ends_exactly(
        ends in prop::collection::vec((0.0..=50.0, 0.0..=90.0, 6.0..30000.0, any_intensity()), 1..6),
    ) {
        let mut plotter = Plotter::new(20_000);
        for (x, y, feed, intensity) in ends {
            // Slow feeds for short ways only, to be quick.
            let feed = f64::max(feed, 600.0);
            plotter.plan(&line(x, y, feed, intensity));
            while !plotter.machine.plan_is_done() {
                plotter.tick();
            }
            prop_assert_eq!(plotter.machine.table_position(), point([x, y]));
        }
    }

    #[test]
    fn servos_are_never_faster_than_they_can_be(
        orders in prop::collection::vec(any_order(1000.0..30000.0), 1..8), frame in 1_000..20_000u64,
        full_speed in 20..800u16,
    ) {
        // The limit of the board's servos is far below most of these feeds.
        let data = ArmData { full_speed, ..ArmData::default() };
        let mut plotter = Plotter::of(data, frame);
        plotter.draw(&orders);
        plotter.rest();
        check_servos(&plotter.frames, frame as f64 / 1e6, full_speed.into())?;
        check_table(&plotter.frames)?;
    }

    #[test]
    fn a_stop_halts_within_a_frame_wherever_it_comes(job in any_job(), after in 0..2000usize) {
        let mut plotter = Plotter::new(FRAME_US);
        let mut orders = job.iter().map(|(order, _)| order).peekable();
        for _ in 0..after {
            while orders.peek().is_some_and(|order| plotter.plan(order)) {
                orders.next();
            }
            plotter.tick();
        }
        let before = *plotter.frames.last().expect("there are frames");
        plotter.machine.stop(StopReason::Requested);
        let mut last = before.position;
        while plotter.machine.is_busy() {
            let now = plotter.tick().position;
            prop_assert_eq!((now.x, now.y), (last.x, last.y));
            prop_assert!(now.z >= last.z);
            last = now;
        }
        prop_assert_eq!(last.z.to_f64(), UP);
        prop_assert!(plotter.machine.plan_is_done());
        prop_assert_eq!(plotter.machine.plan_room(), PLAN_SEGMENTS);
        // And it goes on from there.
        plotter.machine.resume();
        let end = line(20.0, 30.0, 8000.0, 0);
        plotter.draw(&[end]);
        prop_assert_eq!(plotter.machine.table_position(), point([20.0, 30.0]));
        check_table(&plotter.frames)?;
        check_servos(&plotter.frames, FRAME_S, SERVOS)?;
    }

    #[test]
    fn a_job_that_leaves_the_table_stops_at_its_edge(
        job in prop::collection::vec(any_order(300.0..8000.0), 0..5),
        (x, y) in beyond_the_table(), intensity in any_intensity(),
    ) {
        let beyond = [(Side::X1, x < 0.0), (Side::X2, x > 50.0), (Side::Y1, y < 0.0), (Side::Y2, y > 90.0)];
        let mut plotter = Plotter::new(FRAME_US);
        for order in job.iter().chain(&[line(x, y, 3000.0, intensity), line(9.0, 9.0, 3000.0, 0)]) {
            // The first way out of the table may be none at all, and stops at once.
            if plotter.machine.stopped().is_none() {
                prop_assert!(plotter.plan(order));
            }
        }
        plotter.rest();
        let Some(StopReason::Limit(side)) = plotter.machine.stopped() else {
            return Err(TestCaseError::fail("no limit was reached"));
        };
        prop_assert!(beyond.contains(&(side, true)), "({x}, {y}) is not beyond {side:?}");
        let at = plotter.machine.table_position();
        let (edge, place) = match side {
            Side::X1 => (0.0, at.x),
            Side::X2 => (50.0, at.x),
            Side::Y1 => (0.0, at.y),
            Side::Y2 => (90.0, at.y),
        };
        prop_assert_eq!(place.to_f64(), edge);
        check_table(&plotter.frames)?;
        prop_assert_eq!(plotter.machine.position().z.to_f64(), UP);
    }
}

#[test]
fn the_plan_takes_so_many_segments_and_no_memory_beyond() {
    let mut plotter = Plotter::new(FRAME_US);
    let mut planned = 0;
    let segment = |number: u32| Segment {
        to: point([10.0 + f64::from(number % 2), 10.0]),
        feed: Feed::DEFAULT,
        intensity: Intensity::OFF,
    };
    while plotter.machine.plan(&segment(planned)).is_ok() {
        planned += 1;
    }
    // One of them has begun.
    assert_eq!(planned as usize, PLAN_SEGMENTS + 1);
    assert_eq!(
        plotter.machine.plan(&segment(planned)),
        Err(NotPlanned::Full)
    );
    // Everything is within the value itself; there is no allocator in the core.
    assert!(size_of::<Machine>() < 6_000, "{}", size_of::<Machine>());
}
