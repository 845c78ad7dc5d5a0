//! A plotter's plan: how long a job takes, by textbook formulas, with look-ahead over the whole job.
//!
//! Written from `reference/lasaurgrbl.md` section 5 (acceleration 500 mm/s2, junction deviation 0.006 mm) and
//! `reference/arm.md` (the pen's servo) alone. Units: mm, s.

const ACCELERATION: f64 = 500.0;
const JUNCTION_DEVIATION: f64 = 0.006;
/// From lifted, Z 1000, to light contact, Z 400: 27 of the pen servo's 45 degrees, at 600 degrees a second.
const PEN_SECONDS: f64 = 27.0 / 600.0;

/// Something a plotter is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// A straight line to (x, y), at mm a minute, with the pen down unless the intensity is 0.
    Line {
        to: [f64; 2],
        feed: f64,
        intensity: u8,
    },
    /// So many seconds where it is.
    Dwell { seconds: f64, intensity: u8 },
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    length: f64,
    direction: [f64; 2],
    nominal: f64,
    down: bool,
    dwell: f64,
}

/// Seconds from rest at `start`, pen up, to the end of the last order; the pen stays as it is there.
pub fn job_seconds(start: [f64; 2], orders: &[Order]) -> f64 {
    let legs = legs(start, orders);
    let entries = entries(&legs);
    let (mut down, mut time) = (false, 0.0);
    for (i, leg) in legs.iter().enumerate() {
        if leg.down != down {
            time += PEN_SECONDS;
            down = leg.down;
        }
        let exit = entries.get(i + 1).copied().unwrap_or(0.0);
        time += leg_seconds(leg.length, entries[i], leg.nominal, exit) + leg.dwell;
    }
    time
}

/// How fast a corner may be passed: as an arc that touches both ways and stays within the deviation of the corner.
pub fn corner_speed(turn: f64) -> f64 {
    // The arc's radius r, from r / cos(turn / 2) - r = deviation; centripetal acceleration v^2 / r.
    let cosine = (turn / 2.0).cos().max(0.0);
    let radius = JUNCTION_DEVIATION * cosine / (1.0 - cosine);
    (ACCELERATION * radius).sqrt()
}

fn legs(start: [f64; 2], orders: &[Order]) -> Vec<Leg> {
    let mut at = start;
    let mut legs = Vec::new();
    for order in orders {
        match *order {
            Order::Line {
                to,
                feed,
                intensity,
            } => {
                let way = [to[0] - at[0], to[1] - at[1]];
                let length = way[0].hypot(way[1]);
                if length > 0.0 {
                    legs.push(Leg {
                        length,
                        direction: way.map(|part| part / length),
                        nominal: feed / 60.0,
                        down: intensity > 0,
                        dwell: 0.0,
                    });
                }
                at = to;
            }
            Order::Dwell { seconds, intensity } => legs.push(Leg {
                length: 0.0,
                direction: [0.0; 2],
                nominal: 0.0,
                down: intensity > 0,
                dwell: seconds,
            }),
        }
    }
    legs
}

/// Speeds at which the legs begin.
fn entries(legs: &[Leg]) -> Vec<f64> {
    let mut entries: Vec<f64> = legs
        .iter()
        .enumerate()
        .map(|(i, leg)| {
            if i == 0 {
                0.0
            } else {
                junction(&legs[i - 1], leg)
            }
        })
        .collect();
    let reach = |speed: f64, length: f64| (speed * speed + 2.0 * ACCELERATION * length).sqrt();
    let mut exit = 0.0;
    for (entry, leg) in entries.iter_mut().zip(legs).rev() {
        *entry = entry.min(reach(exit, leg.length));
        exit = *entry;
    }
    for i in 1..legs.len() {
        entries[i] = entries[i].min(reach(entries[i - 1], legs[i - 1].length));
    }
    entries
}

fn junction(before: &Leg, after: &Leg) -> f64 {
    if before.down != after.down || before.length == 0.0 || after.length == 0.0 {
        return 0.0;
    }
    let [ax, ay] = before.direction;
    let [bx, by] = after.direction;
    let turn = (ax * by - ay * bx).atan2(ax * bx + ay * by).abs();
    before.nominal.min(after.nominal).min(corner_speed(turn))
}

fn leg_seconds(length: f64, entry: f64, nominal: f64, exit: f64) -> f64 {
    if length == 0.0 {
        return 0.0;
    }
    let ramp = |from: f64, to: f64| (to * to - from * from).abs() / (2.0 * ACCELERATION);
    let (rise, fall) = (ramp(entry, nominal), ramp(exit, nominal));
    if rise + fall <= length {
        return (nominal - entry) / ACCELERATION
            + (length - rise - fall) / nominal
            + (nominal - exit) / ACCELERATION;
    }
    let peak = ((entry * entry + exit * exit) / 2.0 + ACCELERATION * length).sqrt();
    (peak - entry) / ACCELERATION + (peak - exit) / ACCELERATION
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(x: f64, y: f64, feed: f64, intensity: u8) -> Order {
        Order::Line {
            to: [x, y],
            feed,
            intensity,
        }
    }

    fn assert_seconds(orders: &[Order], expected: f64) {
        let found = job_seconds([0.0; 2], orders);
        assert!(
            (found - expected).abs() < 1e-9,
            "{found} s, not {expected} s"
        );
    }

    #[test]
    fn jobs_one_can_check_by_hand() {
        // 50 mm/s is reached after 0.1 s and 2.5 mm; 45 mm are left.
        assert_seconds(&[line(50.0, 0.0, 3000.0, 0)], 0.2 + 45.0 / 50.0);
        // The same with the pen down, in two pieces, straight on.
        let stroke = [line(20.0, 0.0, 3000.0, 9), line(50.0, 0.0, 3000.0, 200)];
        assert_seconds(&stroke, PEN_SECONDS + 0.2 + 45.0 / 50.0);
        // There and back needs a stop.
        let back = [line(50.0, 0.0, 3000.0, 0), line(0.0, 0.0, 3000.0, 0)];
        assert_seconds(&back, 2.0 * (0.2 + 45.0 / 50.0));
        // Too short for its feed.
        assert_seconds(&[line(0.5, 0.0, 3000.0, 0)], 2.0 * (0.5_f64 / 500.0).sqrt());
        let dwell = Order::Dwell {
            seconds: 0.3,
            intensity: 0,
        };
        assert_seconds(&[dwell], 0.3);
    }

    #[test]
    fn a_quarter_turn() {
        // 0.006 * 0.70711 / 0.29289 = 0.014485 mm of radius.
        let speed = corner_speed(std::f64::consts::FRAC_PI_2);
        assert!((speed - 2.6912).abs() < 1e-4, "{speed}");
    }
}
