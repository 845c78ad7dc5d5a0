//! The picture of the table in `docs/`, drawn from the constants that the arm goes by.

use protocol_core::motion::{Coordinate, Millimetres, Table, TablePoint, contains};
use std::fmt::Write;

const PICTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/table.svg");
/// Set it to have the picture drawn anew.
const REDRAW: &str = "REDRAW_PICTURES";

/// Millimetres around the shoulder that the picture shows: from, to.
const SHOWN: [[f64; 2]; 2] = [[-18.0, -84.0], [106.0, 84.0]];

#[test]
fn the_picture_of_the_table_is_up_to_date() {
    let picture = draw(&Table::DEFAULT);
    if std::env::var_os(REDRAW).is_some() {
        std::fs::write(PICTURE, &picture).expect("the picture is written");
    }
    let stored = std::fs::read_to_string(PICTURE).unwrap_or_default();
    assert!(
        stored == picture,
        "docs/table.svg is not what the constants say; {REDRAW}=1 cargo test --test table_picture draws it"
    );
}

/// Seen from above, the body at the left, one unit a millimetre.
fn draw(table: &Table) -> String {
    let [[left, right], [top, bottom]] = [[SHOWN[0][0], SHOWN[1][0]], [-SHOWN[1][1], -SHOWN[0][1]]];
    let (width, height) = (right - left, bottom - top);
    let mut svg = String::new();
    let mut line = |text: std::fmt::Arguments<'_>| {
        writeln!(svg, "{text}").expect("a string takes everything");
    };
    line(format_args!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left} {top} {width} {height}" width="{}" height="{}" font-family="sans-serif" font-size="3.2">"#,
        width * 4.0,
        height * 4.0
    ));
    line(format_args!(
        r#"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="white"/>"#
    ));
    line(format_args!(
        r##"<path d="{}" fill="#eef3f8" stroke="#7890a8" stroke-width="0.3"/>"##,
        outline()
    ));
    // The body, and the axis of the arm servos (`reference/arm.md`).
    line(format_args!(
        r##"<rect x="-12.55" y="-28.2" width="25" height="96" fill="#dddddd" stroke="#888888" stroke-width="0.3"/>"##
    ));
    line(format_args!(
        r##"<circle cx="0" cy="0" r="1.6" fill="white" stroke="#888888" stroke-width="0.3"/>"##
    ));
    let (wide, high) = (table.width().to_f64(), table.height().to_f64());
    let corners =
        [[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high]].map(|corner| on_paper(table, corner));
    line(format_args!(
        r##"<polygon points="{}" fill="#fff7e0" stroke="#c07000" stroke-width="0.5"/>"##,
        corners.map(|[x, y]| format!("{x},{y}")).join(" ")
    ));
    let mut grid = |from: [f64; 2], to: [f64; 2]| {
        let ([x1, y1], [x2, y2]) = (on_paper(table, from), on_paper(table, to));
        line(format_args!(
            r##"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#e8d4a8" stroke-width="0.2"/>"##
        ));
    };
    for ten in 1..(wide / 10.0).ceil() as u32 {
        let x = f64::from(ten) * 10.0;
        grid([x, 0.0], [x, high]);
    }
    for ten in 1..(high / 10.0).ceil() as u32 {
        let y = f64::from(ten) * 10.0;
        grid([0.0, y], [wide, y]);
    }
    for (to, name) in [([20.0, 0.0], "X"), ([0.0, 20.0], "Y")] {
        let ([x1, y1], [x2, y2]) = (on_paper(table, [0.0, 0.0]), on_paper(table, to));
        line(format_args!(
            r##"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#c02020" stroke-width="0.9"/>"##
        ));
        let [x, y] = on_paper(table, [to[0] + to[0] / 10.0, to[1] + to[1] / 10.0]);
        line(format_args!(
            r##"<text x="{x}" y="{y}" fill="#c02020" text-anchor="middle" dominant-baseline="middle" font-weight="bold">{name}</text>"##
        ));
    }
    let [x, y] = on_paper(table, [0.0, 0.0]);
    line(format_args!(
        r##"<circle cx="{x}" cy="{y}" r="1.1" fill="#c02020"/>"##
    ));
    for (at, text) in [
        ([2.0, 3.5], "physical home, X0 Y0".to_owned()),
        (
            [wide / 2.0 - 10.0, high / 2.0],
            format!("{wide} x {high} mm"),
        ),
        ([wide - 18.0, high - 4.0], format!("X{wide} Y{high}")),
    ] {
        let [x, y] = on_paper(table, at);
        line(format_args!(
            r##"<text x="{x}" y="{y}" fill="#804800">{text}</text>"##
        ));
    }
    line(format_args!(
        r##"<text x="-9" y="62" fill="#555555">body</text>"##
    ));
    line(format_args!(
        r##"<text x="38" y="68" fill="#506880">drawing area</text>"##
    ));
    line(format_args!(
        r##"<text x="{}" y="{}" fill="#555555">you sit here</text>"##,
        48.0,
        bottom - 2.0
    ));
    line(format_args!("</svg>"));
    svg
}

/// A place of the table, in mm from the shoulder, y downwards.
fn on_paper(table: &Table, [x, y]: [f64; 2]) -> [f64; 2] {
    let bits = |value: f64| Millimetres::from_bits((value * 65536.0).round() as i32);
    let (x, y) = table.to_arm(TablePoint {
        x: bits(x),
        y: bits(y),
    });
    let mm = |bits: i64| (bits as f64 / 65536.0 / 20.0 * 1000.0).round() / 1000.0;
    [mm(x.bits()), -mm(y.bits())]
}

/// The drawing area as the arm tells it: row by row its first and last point inside.
fn outline() -> String {
    let row = |y: i16| {
        let inside = |x: &i16| contains(Coordinate::from_units(*x), Coordinate::from_units(y));
        let mut points = (0..=1960).filter(inside);
        let first = points.next()?;
        Some((first, points.next_back().unwrap_or(first), y))
    };
    let rows: Vec<_> = (-1600..=1600)
        .rev()
        .step_by(5)
        .chain([-1])
        .filter_map(row)
        .collect();
    let mut rows = rows;
    rows.sort_by_key(|(_, _, y)| -y);
    let mm = |units: i16| f64::from(units) / 20.0;
    let last = rows.iter().map(|(_, last, y)| (mm(*last), -mm(*y)));
    let first = rows.iter().rev().map(|(first, _, y)| (mm(*first), -mm(*y)));
    let points: Vec<String> = last
        .chain(first)
        .map(|(x, y)| format!("{x:.2},{y:.2}"))
        .collect();
    format!("M{}Z", points.join("L"))
}
