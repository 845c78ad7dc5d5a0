//! Job times against the model, which looks ahead over the whole job.

use crate::jobs::{DRAWING, circle, example, line, polylines, spiral};
use host_tests::model::{self, Order};
use host_tests::plotter::Plotter;

/// A job's time may differ from the model's by this part.
const TOLERANCE: f64 = 0.03;
const FRAME_US: u64 = 2_000;

#[test]
fn job_times_are_those_of_the_model() {
    let straight = [100, 1000, 8000].map(|feed| {
        let orders = vec![
            line(5.0, 5.0, 8000.0, 0),
            line(45.0, 85.0, f64::from(feed), 255),
            line(5.0, 5.0, 8000.0, 0),
        ];
        (format!("a diagonal at F{feed}"), orders)
    });
    let staircase = (0..200)
        .map(|step: i32| {
            let (right, up) = ((step + 1) / 2, step / 2);
            line(f64::from(right) / 4.0, f64::from(up) / 4.0, 3000.0, 255)
        })
        .collect();
    let dots = (0..20)
        .flat_map(|i| {
            let dwell = Order::Dwell {
                seconds: 0.05,
                intensity: 200,
            };
            [line(f64::from(i) * 2.0 + 1.0, 40.0, 8000.0, 0), dwell]
        })
        .collect();
    let mut jobs: Vec<(String, Vec<Order>)> = ["feather", "hello", "rose", "hatching", "edges"]
        .map(|name| (format!("{name}.gcode"), example(name)))
        .into();
    jobs.extend(straight);
    jobs.extend([
        (
            "polylines at F1500".to_owned(),
            polylines(1, 20, 12, DRAWING),
        ),
        (
            "polylines at F8000".to_owned(),
            polylines(2, 20, 12, 8000.0),
        ),
        ("a staircase".to_owned(), staircase),
        ("dots, with a dwell each".to_owned(), dots),
        (
            "circle, 0.05 mm segments, F1500".to_owned(),
            circle(15.0, 0.05, DRAWING),
        ),
        (
            "circle, 0.2 mm segments, F4000".to_owned(),
            circle(20.0, 0.2, 4000.0),
        ),
        (
            "circle, 1 mm segments, F8000".to_owned(),
            circle(20.0, 1.0, 8000.0),
        ),
        (
            "spiral, 0.1 mm segments, F1500".to_owned(),
            spiral(10.0, 0.1, DRAWING),
        ),
        (
            "spiral, 0.5 mm segments, F6000".to_owned(),
            spiral(11.0, 0.5, 6000.0),
        ),
    ]);
    println!("| job | segments | model | machine | difference |");
    println!("|---|---|---|---|---|");
    let mut wrong = Vec::new();
    for (name, orders) in jobs {
        let expected = model::job_seconds([0.0; 2], &orders);
        let took = Plotter::new(FRAME_US).draw(&orders);
        let difference = took / expected - 1.0;
        let percent = difference * 100.0;
        let count = orders.len();
        println!("| {name} | {count} | {expected:.3} s | {took:.3} s | {percent:+.2} % |");
        if difference.abs() > TOLERANCE {
            wrong.push(format!(
                "{name}: {took:.3} s, the model takes {expected:.3} s"
            ));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
