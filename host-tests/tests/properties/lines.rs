//! Lines as clients write them, and as they had better not.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// A line, and who says it.
#[derive(Clone, Debug)]
pub struct Said {
    /// One of four.
    pub client: u8,
    /// Without a terminator, and not blank.
    pub line: String,
}

/// Some lines of any kind, mostly right.
pub fn any_lines(most: usize) -> impl Strategy<Value = Vec<Said>> {
    vec(
        said(prop_oneof![4 => right(), 1 => nearly(), 1 => garbage()]),
        1..most,
    )
}

/// Right lines with nearly right ones in between.
pub fn sprinkled(most: usize) -> impl Strategy<Value = Vec<Said>> {
    vec(said(prop_oneof![1 => right(), 1 => nearly()]), 1..most)
}

fn said(line: impl Strategy<Value = String>) -> impl Strategy<Value = Said> {
    // Mostly one of them, as it is.
    (prop_oneof![3 => Just(0u8), 1 => 0u8..4], line)
        .prop_map(|(client, line)| Said { client, line })
        .prop_filter("a blank line is none", |said| {
            said.line.bytes().any(|byte| !matches!(byte, b' ' | b'\t'))
        })
}

/// A line that is to be accepted.
fn right() -> BoxedStrategy<String> {
    prop_oneof![
        8 => a_move(),
        1 => Just("G28".into()),
        2 => (maybe(number(-400.0, 1500.0)), maybe(number(-800.0, 800.0)), maybe(scale()))
            .prop_map(|(x, y, s)| words("G54", &[("X", x), ("Y", y), ("S", s)])),
        // Fast steps mostly: the tests take their time, but not for ever.
        2 => (maybe(number(5.0, 30.0)), maybe(number(15.0, 100.0)))
            .prop_map(|(s, p)| words("G94", &[("S", s), ("P", p)])),
        1 => select(&["M114", "M114 S", "M115", "M122", "M550", "; nothing", "(nothing)"][..]).prop_map(Into::into),
        1 => (number(0.0, 0.2)).prop_map(|seconds| format!("G4 P{seconds}")),
        1 => (maybe(number(450.0, 2000.0)), maybe(number(-1600.0, 1600.0)), maybe(number(-100.0, 1100.0)), select(&["", " Kxy", " KZ"][..]))
            .prop_map(|(x, y, z, k)| words("G40", &[("X", x), ("Y", y), ("Z", z)]) + k),
        1 => select(&["G31", "G31 S0;100;300;200", "G31 S-500;500;0;7 P2", "G31 P-1.5", "G31 Sclear P0"][..]).prop_map(Into::into),
        1 => select(&["M280", "M280 S2", "M280 E2 P2", "M280 S1 E1 P1"][..]).prop_map(Into::into),
        1 => select(&["M374", "M374 Sclear", "m374 s\"clear\""][..]).prop_map(Into::into),
        1 => "[a-z0-9][a-z0-9-]{0,30}[a-z0-9]".prop_map(|name| format!("M550 P\"{name}\"")),
    ]
    .boxed()
}

fn a_move() -> impl Strategy<Value = String> {
    (
        select(&["G01", "G1", "g01", "G00", "G0"][..]),
        maybe(prop_oneof![6 => number(450.0, 2000.0), 1 => number(-1e6, 1e6)]),
        maybe(prop_oneof![6 => number(-1600.0, 1600.0), 1 => number(-1e6, 1e6)]),
        maybe(prop_oneof![
            2 => Just("0".to_string()),
            2 => Just("1000".to_string()),
            2 => number(-100.0, 1100.0)
        ]),
        maybe(number(0.0, 9999.0)),
    )
        .prop_map(|(code, x, y, z, f)| words(code, &[("X", x), ("Y", y), ("Z", z), ("F", f)]))
}

fn scale() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => number(0.1, 3.0),
        1 => number(-3.0, -0.1),
        1 => Just("1".to_string()),
        1 => number(-1000.0, 1000.0),
    ]
}

/// A number in one of the ways that clients write numbers.
fn number(least: f64, most: f64) -> impl Strategy<Value = String> {
    (least..most, 0..5).prop_map(|(value, way)| match way {
        0 => format!("{value:.0}"),
        1 => format!("{value:.3}"),
        2 => format!("{value}"),
        3 => format!("{value:e}"),
        _ => format!("\"{value:.1}\""),
    })
}

fn maybe(value: impl Strategy<Value = String>) -> impl Strategy<Value = Option<String>> {
    proptest::option::weighted(0.7, value)
}

fn words(code: &str, parameters: &[(&str, Option<String>)]) -> String {
    let mut line = code.to_string();
    for (letter, value) in parameters {
        if let Some(value) = value {
            line += &format!(" {letter}{value}");
        }
    }
    line
}

/// A right line with something wrong, or at least odd, about it.
fn nearly() -> impl Strategy<Value = String> {
    let odd = select(
        &[
            " X", " X5 X6", " Q1", " Snan", " Yinf", " X0x10", " Z--1", " 7", " (open", " P\"open",
            " S0", " X1e30", " S1e-40", " F", "\u{e9}", " S31", " P0.5", "1", "e", "-",
        ][..],
    );
    (right(), odd, any::<prop::sample::Index>(), 0..4).prop_map(|(line, odd, at, way)| {
        let at = at.index(line.len() + 1);
        let (front, back) = line.split_at_checked(at).unwrap_or((&line, ""));
        match way {
            0 => format!("{line}{odd}"),
            1 => format!("{front}{odd}{back}"),
            2 => front.to_string(),
            _ => back.to_string(),
        }
    })
}

fn garbage() -> impl Strategy<Value = String> {
    prop_oneof![
        "[GMgmXYZSFP0-9.eE+\\-\" ();]{1,40}",
        "[^\r\n\0]{1,300}",
        Just("undefined".to_string()),
    ]
}
