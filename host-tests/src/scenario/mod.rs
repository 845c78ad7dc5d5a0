//! Scenarios: what an owner does with the machine, and what it does then, as text. The language is
//! described in `tests/scenarios/README.md`.

mod client;
mod command;
mod expect;
mod parse;
mod server;
mod stage;
mod words;

use crate::scripted::journal::{Journal, note};
use command::Command;
use embassy_time::Duration;
use stage::Stage;
use std::fmt;

/// After the last line time goes on for this long, so that what nobody expects can happen.
const ENCORE: Duration = Duration::from_secs(3);
/// Entries of the journal that are told when a scenario fails.
const TOLD: usize = 40;

/// Why a scenario failed.
#[derive(Debug)]
pub struct Failure {
    /// Its name, and a value that it was played with.
    pub scenario: String,
    /// Counted from 1; the last line where something was left over.
    pub line: usize,
    /// The line, or what was to happen.
    pub expected: String,
    /// What happened.
    pub instead: String,
    /// What had happened before, with times.
    pub journal: Vec<String>,
}

impl fmt::Display for Failure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}:{}", self.scenario, self.line)?;
        writeln!(out, "  expected: {}", self.expected)?;
        writeln!(out, "  instead:  {}", self.instead)?;
        for entry in &self.journal {
            writeln!(out, "{entry}")?;
        }
        Ok(())
    }
}

/// Plays a scenario in virtual time, once or once for each of its values. `name` is for messages.
///
/// # Errors
/// The first line that did not come true.
pub fn play(name: &str, text: &str) -> Result<(), Box<Failure>> {
    let Some((values, rest)) = values(text) else {
        return play_once(name, text);
    };
    let (variable, values) = values.map_err(|why| {
        let line = text.lines().position(is_command).unwrap_or(0);
        Box::new(Failure {
            scenario: name.into(),
            line: line + 1,
            expected: "for each N from 1 to 9".into(),
            instead: why,
            journal: Vec::new(),
        })
    })?;
    values.iter().try_for_each(|value| {
        let played = rest.replace(&format!("<{variable}>"), value);
        play_once(&format!("{name} ({variable} = {value})"), &played)
    })
}

fn is_command(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

type Values = Result<(String, Vec<String>), String>;

/// Reads `for each N from 1 to 9` or `for each N in 0.5 2`, if it is the first line, and gives the text with that line blank.
fn values(text: &str) -> Option<(Values, String)> {
    let line = text.lines().find(|line| is_command(line))?;
    let mut words = words::Words::new(line);
    if !words.eat("for each") {
        return None;
    }
    let mut read = || {
        let variable = words.next_word().ok_or("a name is missing")?.to_owned();
        if words.eat("in") {
            let values = words.rest().split_whitespace().map(str::to_owned);
            return Ok((variable, values.collect()));
        }
        if !words.eat("from") {
            return Err("'from' or 'in' is missing".to_owned());
        }
        let first: u32 = words.number()?;
        if !words.eat("to") {
            return Err("'to' is missing".to_owned());
        }
        let last = words.number()?;
        words.end()?;
        let values = (first..=last).map(|value| value.to_string());
        Ok((variable, values.collect()))
    };
    Some((read(), text.replacen(line, "", 1)))
}

fn play_once(name: &str, text: &str) -> Result<(), Box<Failure>> {
    let journal = Journal::begin();
    let failure = |line: usize, expected: &str, instead: String| {
        Box::new(Failure {
            scenario: name.into(),
            line,
            expected: expected.into(),
            instead,
            journal: journal.last(TOLD),
        })
    };
    let lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| is_command(line));
    let mut commands = Vec::new();
    for (index, line) in lines {
        let command = parse::parse(line);
        let command = command.map_err(|why| {
            failure(
                index + 1,
                "a line of a scenario",
                format!("{line:?}: {why}"),
            )
        })?;
        commands.push((index + 1, line.trim(), command));
    }
    let mut stage = Stage::new();
    for (number, line, command) in &commands {
        note(format_args!("{number}: {line}"));
        let outcome = match command {
            Command::Do(action) => stage.act(action),
            Command::Expect(expectation, within) => {
                expect::expect(&mut stage, expectation, *within)
            }
        };
        outcome.map_err(|instead| failure(*number, line, instead))?;
        expect::forgive(&mut stage);
    }
    let last = commands.last().map_or(1, |(number, ..)| *number);
    note("the scenario's end");
    let ended = stage.wait(ENCORE);
    ended.map_err(|offence| failure(last, "nothing after the end", offence))?;
    expect::forgive(&mut stage);
    match stage.left_over() {
        Some(left_over) => Err(failure(last, "nothing that no line expected", left_over)),
        None => Ok(()),
    }
}
