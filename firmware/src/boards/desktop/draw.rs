//! A G-code file as a client: the same session and the same arm, as fast as possible.

use crate::log::warning;
use core::convert::Infallible;
use embedded_io_async::{ErrorType, Read, Write};
use indicatif::ProgressBar;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::rc::Rc;

/// What was drawn, as its replies tell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Lines that were commands, comments included.
    pub commands: u64,
    /// Commands that were refused.
    pub errors: u64,
    /// Moves that did not go where they were told to.
    pub limited: u64,
    line: u64,
    failed: bool,
}

impl Outcome {
    /// Whether everything was read, and nothing was refused.
    pub const fn is_clean(&self) -> bool {
        self.errors == 0 && !self.failed
    }

    /// One more reply.
    pub(super) const fn count(&mut self, is_error: bool) {
        self.commands += 1;
        self.errors += is_error as u64;
    }

    /// The file could not be read to its end.
    pub(super) const fn fail(&mut self) {
        self.failed = true;
    }
}

/// The file as a client: it sends a line at a time, and hears the replies.
pub struct Script {
    file: BufReader<File>,
    bar: ProgressBar,
    outcome: Rc<RefCell<Outcome>>,
    ended: bool,
    /// The last read stopped inside a line.
    in_line: bool,
}

/// Opens a G-code file.
///
/// # Errors
/// When it cannot be read.
pub fn open(path: &Path, bar: ProgressBar) -> io::Result<(Script, Rc<RefCell<Outcome>>)> {
    let file = open_file(path, &bar)?;
    let outcome = Rc::new(RefCell::new(Outcome::default()));
    let script = Script {
        file,
        bar,
        outcome: outcome.clone(),
        ended: false,
        in_line: false,
    };
    Ok((script, outcome))
}

pub(super) fn open_file(path: &Path, bar: &ProgressBar) -> io::Result<BufReader<File>> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(io::Error::other("is a folder"));
    }
    bar.set_length(file.metadata()?.len());
    Ok(BufReader::new(file))
}

impl ErrorType for Script {
    type Error = Infallible;
}

impl Read for Script {
    /// Never more than a line, so that a reply belongs to the line read last.
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let mut outcome = self.outcome.borrow_mut();
        let bytes = self.file.fill_buf().unwrap_or_else(|error| {
            warning!("the file cannot be read any further: {}", error);
            outcome.failed = true;
            &[]
        });
        if bytes.is_empty() {
            // The last line may lack its end.
            let last = usize::from(!self.ended);
            self.ended = true;
            buffer.iter_mut().take(last).for_each(|byte| *byte = b'\n');
            return Ok(last);
        }
        let line = bytes
            .iter()
            .position(|&byte| byte == b'\n')
            .map_or(bytes.len(), |end| end + 1);
        let length = line.min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(bytes).take(length) {
            *to = *from;
        }
        if !self.in_line {
            outcome.line += 1;
        }
        self.in_line = length < line || !bytes.contains(&b'\n');
        self.file.consume(length);
        self.bar.inc(length as u64);
        Ok(length)
    }
}

impl Write for Script {
    /// One reply each time; the first is the greeting.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let message = String::from_utf8_lossy(bytes);
        let message = message.trim_end_matches(['\r', '\n', '\0']);
        let mut outcome = self.outcome.borrow_mut();
        if message.starts_with("hello ") {
            return Ok(bytes.len());
        }
        let is_error = message.starts_with("error");
        outcome.count(is_error);
        let info = message
            .split_once("INFO:")
            .map(|(_, info)| info.trim_matches('"'));
        match (is_error, info) {
            (true, info) => {
                let line = outcome.line;
                self.bar
                    .suspend(|| eprintln!("line {line}: {}", info.unwrap_or(message)));
            }
            (false, Some(_)) => outcome.limited += 1,
            (false, None) => {}
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
