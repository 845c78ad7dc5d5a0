//! Bytes as they arrive: some take effect at once, the rest become lines.
//!
//! ```text
//! byte -> real-time?  yes: takes effect, and is in no line
//!         no:  receive buffer, 254 bytes -> line, 78 kept characters -> one line at a time
//! ```
//!
//! The buffer is what the sender may run ahead: bytes leave it for the line as soon as they come, until a
//! line is complete; then they stay until that line is done with. While the plan is full, the buffer is
//! what fills, and 0x12 says when it has room again. What is stopped is stopped for good: a line that was
//! complete when a stop came, or that was ended in stop mode, or that lost a byte, is *void* and will not be
//! executed, however soon stop mode is left.

use crate::machine::StopReason;
use heapless::{Deque, Vec};

/// Bytes that may wait behind a line that is being executed; one more is lost, and stops the machine.
pub const RECEIVE_BUFFER: usize = 254;
/// Characters of a line, prefix and checksum included, blanks not; one more stops the machine.
pub const MAX_LINE: usize = 78;
/// What is sent after a ready byte at a time: more than this must be free for one.
pub const CHUNK: usize = 16;

/// Stop at once (real-time).
const STOP: u8 = b'!';
/// Leave stop mode (real-time).
const RESUME: u8 = b'~';
/// The sender asks for [`READY`] (real-time).
const REQUEST_READY: u8 = 0x14;
/// Says that [`CHUNK`] bytes may be sent.
pub const READY: u8 = 0x12;

/// What must happen at once, before the next byte is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Stop the machine: motion ends, laser off, the plan is flushed.
    Stop(StopReason),
    /// Leave stop mode.
    Resume,
}

/// Bytes received, up to a complete line.
#[derive(Debug)]
pub struct Receiver {
    waiting: Deque<u8, RECEIVE_BUFFER>,
    /// Bytes at the front of `waiting` up to the end of its last line.
    complete: usize,
    /// Bytes at the front of `waiting` whose lines are void; never in the middle of a line.
    doomed: usize,
    /// A byte of the line that is arriving has been lost.
    torn: bool,
    line: Vec<u8, MAX_LINE>,
    /// `line` was longer than it may be.
    too_long: bool,
    line_complete: bool,
    line_void: bool,
    stopped: bool,
    ready_requested: bool,
}

impl Receiver {
    /// Nothing received.
    pub const fn new() -> Self {
        Self {
            waiting: Deque::new(),
            complete: 0,
            doomed: 0,
            torn: false,
            line: Vec::new(),
            too_long: false,
            line_complete: false,
            line_void: false,
            stopped: false,
            ready_requested: false,
        }
    }

    /// Takes one byte; what it does at once must be done before the next one.
    pub fn receive(&mut self, byte: u8) -> Option<Effect> {
        match byte {
            STOP => {
                self.stop();
                return Some(Effect::Stop(StopReason::Requested));
            }
            RESUME => {
                self.stopped = false;
                return Some(Effect::Resume);
            }
            REQUEST_READY => {
                self.ready_requested = true;
                return None;
            }
            _ => {}
        }
        if self.waiting.push_back(byte).is_err() {
            return Some(self.lose_byte());
        }
        if byte == b'\n' {
            self.complete = self.waiting.len();
            if self.stopped || self.torn {
                self.doomed = self.complete;
            }
            self.torn = false;
        }
        self.assemble()
    }

    /// A byte is lost: the line that is arriving is void.
    pub fn lose_byte(&mut self) -> Effect {
        self.torn = true;
        self.stop();
        Effect::Stop(StopReason::ReceiveOverflow)
    }

    /// Stop mode has begun: lines that are complete are void.
    pub fn stop(&mut self) {
        self.stopped = true;
        self.doomed = self.complete;
        self.line_void |= self.line_complete;
    }

    /// Whether the machine is in stop mode, where something else than a byte may have changed it.
    pub fn set_stopped(&mut self, stopped: bool) {
        if stopped {
            self.stop();
        }
        self.stopped = stopped;
    }

    /// Whether a [`READY`] is to be sent now; true once for each time.
    pub fn take_ready(&mut self) -> bool {
        let free = RECEIVE_BUFFER - self.waiting.len();
        let ready = self.ready_requested && free > CHUNK;
        self.ready_requested &= !ready;
        ready
    }

    /// The line that is complete, without newline and blanks, never empty.
    pub fn line(&self) -> Option<&[u8]> {
        self.line_complete.then_some(&self.line)
    }

    /// The complete line must not be executed.
    pub const fn is_void(&self) -> bool {
        self.line_void
    }

    /// The complete line must not be executed, for a reason from outside.
    pub const fn discard_line(&mut self) {
        self.line_void = true;
    }

    /// The complete line is done with; the next one may be complete at once.
    #[must_use]
    pub fn finish_line(&mut self) -> Option<Effect> {
        self.restart_line();
        self.assemble()
    }

    fn restart_line(&mut self) {
        self.line.clear();
        self.too_long = false;
        self.line_complete = false;
        self.line_void = false;
    }

    /// Moves bytes into the line until it is complete or there are none. One line can overflow only
    /// once, so there is at most one effect.
    fn assemble(&mut self) -> Option<Effect> {
        let mut effect = None;
        while !self.line_complete {
            let Some(byte) = self.waiting.pop_front() else {
                break;
            };
            self.complete = self.complete.saturating_sub(1);
            if self.doomed > 0 {
                self.doomed -= 1;
                self.line_void = true;
            }
            match byte {
                b'\n' if self.line.is_empty() => self.restart_line(),
                b'\n' => {
                    self.line_complete = true;
                    self.line_void |= self.too_long;
                }
                0..=b' ' => {}
                kept => {
                    if self.line.push(kept).is_err() && !self.too_long {
                        self.too_long = true;
                        self.stop();
                        effect = Some(Effect::Stop(StopReason::LineOverflow));
                    }
                }
            }
        }
        effect
    }
}
