//! A LasaurGrbl file as a host: it sends a line when the one before it has been answered.

use super::draw::Outcome;
use crate::log::warning;
use core::convert::Infallible;
use core::future::poll_fn;
use core::task::{Poll, Waker};
use embedded_io_async::{ErrorType, Read, Write};
use indicatif::ProgressBar;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::rc::Rc;

/// What both ends know.
#[derive(Default)]
struct Wire {
    outcome: Outcome,
    /// Number of the line that was sent last.
    line: u64,
    /// The last line has not been answered.
    unanswered: bool,
    waiting: Option<Waker>,
}

/// The file, which is what the machine reads.
pub struct Sender {
    file: BufReader<File>,
    bar: ProgressBar,
    wire: Rc<RefCell<Wire>>,
    /// Something of the line that is being sent will be kept: it will be answered.
    kept: bool,
    ended: bool,
}

/// Who hears the machine's replies.
pub struct Listener {
    bar: ProgressBar,
    wire: Rc<RefCell<Wire>>,
    reply: Vec<u8>,
    /// The last reply said that the machine is stopped.
    stopped: bool,
}

/// Opens a file.
///
/// # Errors
/// When it cannot be read.
pub fn open(path: &Path, bar: ProgressBar) -> io::Result<(Sender, Listener)> {
    let file = super::draw::open_file(path, &bar)?;
    let wire = Rc::new(RefCell::new(Wire::default()));
    let listener = Listener {
        bar: bar.clone(),
        wire: wire.clone(),
        reply: Vec::new(),
        stopped: false,
    };
    let sender = Sender {
        file,
        bar,
        wire,
        kept: false,
        ended: false,
    };
    Ok((sender, listener))
}

impl Sender {
    /// A look at how it went, which remains when both ends are gone.
    pub fn outcome(&self) -> impl Fn() -> Outcome + use<> {
        let wire = self.wire.clone();
        move || wire.borrow().outcome
    }

    fn next(&mut self, buffer: &mut [u8]) -> usize {
        let mut wire = self.wire.borrow_mut();
        let bytes = self.file.fill_buf().unwrap_or_else(|error| {
            warning!("the file cannot be read any further: {}", error);
            wire.outcome.fail();
            &[]
        });
        // The last line may lack its end.
        let last = [b'\n'];
        let (bytes, of_file) = match (bytes, self.ended) {
            ([], true) => return 0,
            ([], false) => {
                self.ended = true;
                (&last[..], false)
            }
            (bytes, _) => (bytes, true),
        };
        let line = bytes.iter().position(|&byte| byte == b'\n');
        let length = line.map_or(bytes.len(), |end| end + 1).min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(bytes).take(length) {
            *to = *from;
            self.kept |= *from > b' ' && !matches!(from, b'!' | b'~');
            if *from == b'\n' {
                wire.line += 1;
                wire.unanswered = self.kept;
                self.kept = false;
            }
        }
        if of_file {
            self.file.consume(length);
            self.bar.inc(length as u64);
        }
        length
    }
}

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Read for Sender {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|context| {
            let mut wire = self.wire.borrow_mut();
            if !wire.unanswered {
                return Poll::Ready(());
            }
            wire.waiting = Some(context.waker().clone());
            Poll::Pending
        })
        .await;
        Ok(self.next(buffer))
    }
}

impl Listener {
    fn hear(&mut self) {
        let reply = String::from_utf8_lossy(&self.reply);
        if reply.starts_with('#') {
            return;
        }
        let mut wire = self.wire.borrow_mut();
        wire.unanswered = false;
        wire.waiting.take().into_iter().for_each(Waker::wake);
        let stopped = reply.starts_with('!');
        let what = match reply.as_bytes() {
            [b'!', ..] => Some(stop_reason(&reply)),
            [b'N', ..] => Some("a number is missing, garbled or out of range"),
            [b'E', ..] => Some("a capital letter is missing where a word should begin"),
            [b'U', ..] => Some("no such G or M word"),
            [b'*' | b'^', ..] => Some("the checksum is wrong"),
            _ => None,
        };
        wire.outcome.count(what.is_some());
        // A stopped machine says the same to every line.
        if let Some(what) = what
            && !(stopped && self.stopped)
        {
            let line = wire.line;
            self.bar
                .suspend(|| eprintln!("line {line}: {what} ({reply})"));
        }
        self.stopped = stopped;
    }
}

const fn stop_reason(reply: &str) -> &'static str {
    match reply.as_bytes() {
        [_, b'L', ..] => "stopped at the edge of the table",
        [_, b'R', ..] => "stopped by '!'",
        [_, b'I', ..] => "stopped by a line that is too long",
        [_, b'T', ..] => "stopped by a wrong checksum",
        _ => "stopped",
    }
}

impl ErrorType for Listener {
    type Error = Infallible;
}

impl Write for Listener {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for &byte in bytes {
            if byte == b'\n' {
                self.hear();
                self.reply.clear();
            } else {
                self.reply.push(byte);
            }
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
