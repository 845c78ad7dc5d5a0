//! What the documentation and the core say that may happen has its scenario.

use protocol_core::drawings::Slot;
use protocol_core::lineus::Refusal;
use protocol_core::text::WordError;

#[test]
fn every_transition_of_the_documentation_has_its_scenario() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenarios");
    let mut played: Vec<String> = std::fs::read_dir(folder)
        .expect("there are scenarios")
        .map(|entry| entry.expect("a folder can be read").file_name())
        .filter_map(|name| name.to_str()?.get(..3).map(str::to_owned))
        .filter(|start| start.ends_with('-') && start.starts_with(|c: char| c.is_ascii_digit()))
        .collect();
    played.sort();
    let table = include_str!("../../../docs/wifi.md");
    let rows: Vec<String> = table
        .lines()
        .filter_map(|line| line.strip_prefix("| "))
        .filter(|row| row.starts_with(|c: char| c.is_ascii_digit()))
        .filter_map(|row| row.get(..2).map(|number| format!("{number}-")))
        .collect();
    assert!(rows.len() >= 30, "{rows:?}");
    assert_eq!(rows, played);
}

/// What all scenarios with such a beginning of their name say.
fn scenarios(beginning: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenarios");
    let files = std::fs::read_dir(folder).expect("there are scenarios");
    let mut texts = String::new();
    for file in files {
        let path = file.expect("a folder can be read").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(beginning) && name.ends_with(".scenario") {
            texts += &std::fs::read_to_string(&path).expect("a scenario is text");
        }
    }
    texts
}

/// Errors that these scenarios expect, and what M122 says of a refused update, with `#` for each number: those of
/// a table are examples.
fn expected<'a>(texts: &'a str, before: &str) -> Vec<String> {
    let told = |line: &'a str| Some(line.split_once(before)?.1.split_once('"')?.0);
    texts
        .lines()
        .filter_map(told)
        .map(without_numbers)
        .collect()
}

fn without_numbers(text: &str) -> String {
    let parts = text.split(|c: char| c.is_ascii_digit());
    let mut told = String::new();
    for (index, part) in parts.enumerate() {
        if index > 0 && !told.ends_with('#') {
            told.push('#');
        }
        told += part;
    }
    told
}

#[test]
fn every_reason_of_the_documentation_for_no_update_has_its_scenario() {
    // Of these three M122 says what the update under way or the trial does, or that there is none.
    let not_begun = [
        "this board has no place for another firmware",
        "an update is under way",
        "the firmware is on trial, try again in a minute",
    ];
    let table = include_str!("../../../docs/update.md");
    let table = table.split("## Why there is no update").nth(1);
    let table = table.and_then(|rest| rest.split("\n## ").next());
    let rows = table.expect("there is a table of them").lines();
    let reasons = rows.filter_map(|line| line.strip_prefix("| `")?.split('|').next());
    let reasons: Vec<&str> = reasons
        .flat_map(|cell| cell.split('`').step_by(2))
        .collect();
    let reasons = reasons
        .into_iter()
        .filter(|reason| !reason.trim().is_empty());
    let reasons: Vec<&str> = reasons.collect();
    assert!(reasons.len() >= 25, "{reasons:?}");
    let texts = scenarios("update-");
    let (answers, told) = (
        expected(&texts, "hears error INFO:\""),
        expected(&texts, "Update:\"refused: "),
    );
    for reason in reasons {
        let numberless = without_numbers(reason);
        assert!(
            answers.contains(&numberless),
            "no M997 is answered: {reason}"
        );
        assert!(
            not_begun.contains(&reason) || told.contains(&numberless),
            "no M122 says: {reason}"
        );
    }
}

/// What a refusal says in any case. A new one has no text here, and so no scenario: this is where it is missed.
const fn always_says(refusal: &Refusal<'_>) -> &'static str {
    match refusal {
        Refusal::TooLong => "line longer than",
        Refusal::Http => "this is HTTP",
        Refusal::Words(WordError::NotUtf8) => "line is not UTF-8 text",
        Refusal::Words(WordError::NoCode(_)) => "unknown command",
        Refusal::Words(WordError::OpenComment) => "comment without closing bracket",
        Refusal::Words(WordError::OpenQuote(_)) => "has no closing quote",
        Refusal::Words(WordError::NoLetter(_)) => "where a parameter letter should be",
        Refusal::Words(WordError::NoNumber(_)) => "has no number",
        Refusal::Words(WordError::NotANumber(..)) => "not a decimal number",
        Refusal::Words(WordError::NoValue(_)) => "has no value",
        Refusal::Words(WordError::Value(..)) => "takes no value, but has",
        Refusal::Reserved(_) => "is reserved and does nothing here",
        Refusal::NotHere(_) => "is refused over the WebSocket",
        Refusal::UnknownParameter(_) => "unknown parameter",
        Refusal::Missing(_) => "is missing",
        Refusal::Repeated(_) => "is repeated",
        Refusal::OutOfRange { .. } => "is out of range",
        Refusal::ZeroScale => "S must not be zero",
        Refusal::NoChoice(..) => "must be a whole number, 1 to 2",
        Refusal::NotWhole { .. } => "must be a whole number, 1 to 32",
        Refusal::OnlyWith(..) => "goes with S2 only",
        Refusal::NotRecorded(_) => "cannot be part of a drawing",
        Refusal::NoSuchDrawing(_) => "is stored",
        Refusal::BadText(..) => "it may be 'confirm'",
        Refusal::BadMap(_) => "it may be 'clear' or four whole numbers",
        Refusal::BadPassword => "P must be 8 to 63 bytes",
        Refusal::BadName(_) => "a name is 1 to 32 letters",
        Refusal::BadAddress(_) => "an address is http://",
        Refusal::TooManyNetworks => "networks are remembered, no more fit",
        Refusal::NoSuchNetwork(_) => "no network '",
    }
}

#[test]
fn every_refusal_of_a_line_has_its_scenario() {
    let words = [
        WordError::NotUtf8,
        WordError::NoCode("x"),
        WordError::OpenComment,
        WordError::OpenQuote('S'),
        WordError::NoLetter('!'),
        WordError::NoNumber('S'),
        WordError::NotANumber('S', "x"),
        WordError::NoValue('S'),
        WordError::Value('S', "x"),
    ];
    let refusals = [
        Refusal::TooLong,
        Refusal::Http,
        Refusal::Reserved(170),
        Refusal::UnknownParameter('S'),
        Refusal::Missing('S'),
        Refusal::Repeated('S'),
        Refusal::OutOfRange {
            letter: 'S',
            least: 1,
            most: 2,
        },
        Refusal::ZeroScale,
        Refusal::NoChoice('S', 2),
        Refusal::NotWhole {
            letter: 'S',
            least: 1,
            most: 32,
        },
        Refusal::OnlyWith('K', "S2"),
        Refusal::NotRecorded("M28"),
        Refusal::NoSuchDrawing(Slot::FIRST),
        Refusal::BadText('S', b"x", "'confirm'"),
        Refusal::BadMap(b"x"),
        Refusal::BadPassword,
        Refusal::BadName(b"x"),
        Refusal::BadAddress(b"x"),
        Refusal::TooManyNetworks,
        Refusal::NoSuchNetwork(b"x"),
        // Not NotHere: a scenario has no WebSocket.
    ];
    let texts = scenarios("");
    for refusal in words.map(Refusal::Words).into_iter().chain(refusals) {
        let part = always_says(&refusal);
        assert!(refusal.to_string().contains(part), "{refusal}: {part}");
        let expects = |line: &str| line.contains(" hears error ") && line.contains(part);
        assert!(texts.lines().any(expects), "no scenario expects: {refusal}");
    }
}
