//! A program through the core and through the model, compared step by step.

use host_tests::bench::{Answer, Bench};
use host_tests::model::{self, Fitting, Step};
use protocol_core::arm::{Angles, Calibration};
use protocol_core::machine::{Report, SetPoint};
use protocol_core::motion::{Microdegrees, Position};

/// Positions agree within this, in drawing units.
const POSITION_TOLERANCE: f64 = 0.01;
/// Pulses agree within this, in microseconds.
const PULSE_TOLERANCE: f64 = 0.1;

/// Set-points and replies of the core, against the model; gives how many set-points there are.
pub fn against_model(name: &str, program: &str, frame_us: u64) -> Result<usize, String> {
    programs(name, program, program, frame_us, Fitting::NONE)
}

/// The same of an arm that is not exact.
pub fn fitted_against_model(
    name: &str,
    program: &str,
    frame_us: u64,
    fitting: Fitting,
) -> Result<usize, String> {
    compare(
        bench(frame_us, &fitting),
        name,
        program,
        program,
        frame_us,
        fitting,
    )
}

fn bench(frame_us: u64, fitting: &Fitting) -> Bench {
    let microdegrees = fitting
        .offsets_deg
        .map(|offset| Microdegrees::new((offset * 1e6) as i32));
    let calibration = Calibration {
        offsets: Angles::from_array(microdegrees),
    };
    let mut bench = Bench::new(frame_us, calibration);
    if (fitting.map, fitting.shift_mm) != (Fitting::NONE.map, Fitting::NONE.shift_mm) {
        let [a, b, c, d] = fitting.map;
        let answer = bench.say(0, &format!("G31 S{a};{b};{c};{d} P{}", fitting.shift_mm));
        assert_eq!(answer.text(), "ok ");
    }
    bench
}

/// The core draws one program, the model another: for the test of this comparison itself.
pub fn programs(
    name: &str,
    core: &str,
    model: &str,
    frame_us: u64,
    fitting: Fitting,
) -> Result<usize, String> {
    compare(
        bench(frame_us, &Fitting::NONE),
        name,
        core,
        model,
        frame_us,
        fitting,
    )
}

fn compare(
    mut bench: Bench,
    name: &str,
    core: &str,
    model: &str,
    frame_us: u64,
    fitting: Fitting,
) -> Result<usize, String> {
    let mut reports = model::reports_fitted(model, fitting);
    let mut begun_us = 0;
    let mut lines = 0;
    for (number, line) in (1..).zip(core.lines()) {
        let Some(answer) = bench.send(0, format!("{line}\n").as_bytes()).pop() else {
            continue;
        };
        let at = || format!("{name}, line {number}, `{line}`");
        if line.trim_start().starts_with([';', '(']) {
            if answer.text() != "ok " {
                return Err(format!("{}: a comment is answered {answer:?}", at()));
            }
            continue;
        }
        lines += 1;
        let Some(expected) = reports.next() else {
            return Err(format!("{}: one of the replies is too many", at()));
        };
        begun_us = reply(&answer, &expected, begun_us).map_err(|off| format!("{}: {off}", at()))?;
    }
    if reports.next().is_some() {
        return Err(format!("{name}: more than {lines} replies expected"));
    }
    bench.rest();

    let expected: Vec<Step> = model::frames_fitted(model, frame_us, fitting).collect();
    for (index, step) in expected.iter().enumerate() {
        let at = || {
            let line = model.lines().nth(step.line.wrapping_sub(1)).unwrap_or("");
            format!(
                "{name}, line {}, `{line}`, set-point {index} at {} us",
                step.line, step.time_us
            )
        };
        let Some(frame) = bench.frames.get(index) else {
            return Err(format!("{}: the arm is at rest already", at()));
        };
        if frame.time_us != step.time_us {
            return Err(format!("{}: the core says {} us", at(), frame.time_us));
        }
        set_point(&frame.set_point, step).map_err(|off| format!("{}: {off}", at()))?;
    }
    match bench.frames.len() - expected.len() {
        0 => Ok(expected.len()),
        more => Err(format!("{name}: {more} set-points more than expected")),
    }
}

/// A reply and the move it is about; gives when the move ends.
fn reply(answer: &Answer, expected: &model::Report, begun_us: u64) -> Result<u64, String> {
    if answer.is_error {
        return Err(format!("refused: {}", answer.text()));
    }
    let Some(Report::Moving { end, limited }) = &answer.report else {
        return Ok(begun_us);
    };
    let end_us = answer.end_us.unwrap_or(begun_us);
    let [steps, expected_steps] = [end_us, expected.end_us].map(|end| (end - begun_us) / 10_000);
    if end_us != expected.end_us {
        return Err(format!("{steps} steps, expected {expected_steps}"));
    }
    position(*end, expected.target).map_err(|off| format!("the move's end, {off}"))?;
    if limited.is_some() != expected.limited {
        return Err(format!(
            "limited {limited:?}, expected {}",
            expected.limited
        ));
    }
    if answer.text().contains("INFO:\"") != expected.limited {
        return Err(format!("`{}`, limited {limited:?}", answer.text()));
    }
    Ok(end_us)
}

fn set_point(got: &SetPoint, expected: &Step) -> Result<(), String> {
    position(got.position, expected.position)?;
    for (servo, (got, expected)) in ["shoulder", "elbow", "pen"]
        .iter()
        .zip(got.pulses.iter().zip(expected.pulses_us))
    {
        let got = got.to_f64();
        if (got - expected).abs() > PULSE_TOLERANCE {
            return Err(format!("{servo} {got:.4} us, expected {expected:.4} us"));
        }
    }
    Ok(())
}

fn position(got: Position, expected: [f64; 3]) -> Result<(), String> {
    let got = [got.x, got.y, got.z].map(|coordinate| coordinate.to_f64());
    for (axis, (got, expected)) in ["X", "Y", "Z"].iter().zip(got.iter().zip(expected)) {
        if (got - expected).abs() > POSITION_TOLERANCE {
            return Err(format!("{axis} {got:.4}, expected {expected:.4}"));
        }
    }
    Ok(())
}
