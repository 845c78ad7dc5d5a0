//! A client: a program on the computer that speaks to the machine.

use crate::scripted::journal::note;
use crate::scripted::wire::{End, Wire};
use protocol_core::wifi::Ssid;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// What ends each message of the machine (`reference/line-us.md`, section 2).
const TERMINATOR: &[u8] = b"\r\n\0";

/// One connection of a client.
pub struct Client {
    name: char,
    /// The network in which it was connected.
    pub network: Ssid,
    wire: Rc<RefCell<Wire>>,
    /// The beginning of a message.
    partial: Vec<u8>,
    /// Messages that no line has expected yet.
    pub heard: VecDeque<String>,
    ignores: bool,
    /// It has ended this connection itself.
    gone: bool,
    /// A line has said that it was disconnected.
    pub end_expected: bool,
}

impl Client {
    /// Just connected.
    pub fn new(name: char, network: Ssid, wire: Rc<RefCell<Wire>>) -> Self {
        Self {
            name,
            network,
            wire,
            partial: Vec::new(),
            heard: VecDeque::new(),
            ignores: false,
            gone: false,
            end_expected: false,
        }
    }

    /// How the script calls it.
    pub const fn name(&self) -> char {
        self.name
    }

    /// Lets bytes get through in both directions.
    pub fn pass(&mut self, reachable: bool) {
        let before = self.end();
        let heard = self.wire.borrow_mut().pass(reachable);
        if self.gone || self.ignores {
            return;
        }
        self.partial.extend(heard);
        while let Some(end) = find(&self.partial, TERMINATOR) {
            let rest = self.partial.split_off(end + TERMINATOR.len());
            let message = std::mem::replace(&mut self.partial, rest);
            let message = String::from_utf8_lossy(message.get(..end).unwrap_or_default());
            note(format_args!("    {} hears {message}", self.name));
            self.heard.push_back(message.into_owned());
        }
        if let (None, Some(end)) = (before, self.end()) {
            note(format_args!("    {} is disconnected: {end:?}", self.name));
        }
    }

    /// How it ended, for the client.
    pub fn end(&self) -> Option<End> {
        self.wire.borrow().client_sees
    }

    /// Whether neither side has ended it, as far as the client knows.
    pub fn is_connected(&self) -> bool {
        !self.gone && self.end().is_none()
    }

    /// What is heard and no line has expected, or an end that none has.
    pub fn left_over(&self) -> Option<String> {
        let name = self.name;
        if let Some(message) = self.heard.front() {
            return Some(format!("{name} hears {message}"));
        }
        if !self.partial.is_empty() {
            let partial = self.partial.escape_ascii();
            return Some(format!("{name} hears an unfinished message: {partial}"));
        }
        match self.end() {
            Some(end @ (End::Closed | End::Reset)) if !self.gone && !self.end_expected => {
                Some(format!("{name} is disconnected ({end:?})"))
            }
            _ => None,
        }
    }

    /// When it will be given up if nothing gets through until then.
    pub fn given_up_at(&self) -> Option<embassy_time::Instant> {
        self.wire.borrow().given_up_at()
    }

    /// Sends bytes, as fast as the machine takes them.
    pub fn send(&self, bytes: &[u8]) {
        self.wire.borrow_mut().unsent.extend(bytes);
    }

    /// Sends nothing more, and goes on listening.
    pub fn stop_sending(&self) {
        self.wire.borrow_mut().client_finishes = true;
    }

    /// Closes; what was sent before still arrives.
    pub fn close(&mut self) {
        self.gone = true;
        let mut wire = self.wire.borrow_mut();
        wire.client_finishes = true;
        wire.client_reads = true;
    }

    /// Resets the connection.
    pub fn reset(&mut self) {
        self.gone = true;
        self.wire.borrow_mut().client_resets = true;
    }

    /// Its computer is gone without a word.
    pub fn die(&mut self) {
        self.gone = true;
        self.wire.borrow_mut().client_lives = false;
    }

    /// Takes what comes, or lets it wait in the window.
    pub fn read(&self, reads: bool) {
        self.wire.borrow_mut().client_reads = reads;
    }

    /// Whatever it has heard and will hear does not matter.
    pub fn ignore(&mut self) {
        self.ignores = true;
        self.heard.clear();
        self.partial.clear();
    }
}

fn find(bytes: &[u8], part: &[u8]) -> Option<usize> {
    bytes.windows(part.len()).position(|window| window == part)
}

/// Whether a message is as expected; `...` in what is expected stands for anything.
pub fn is_like(message: &str, expected: &str) -> bool {
    let mut parts = expected.split("...");
    let Some(mut rest) = message.strip_prefix(parts.next().unwrap_or_default()) else {
        return false;
    };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else {
        return rest.is_empty();
    };
    for part in parts {
        match rest.find(part) {
            Some(at) => rest = rest.get(at + part.len()..).unwrap_or_default(),
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_stand_for_anything() {
        for (message, expected, like) in [
            ("ok ", "ok ", true),
            ("ok X:1", "ok ", false),
            ("ok X:1 Y:2", "ok X:... Y:2", true),
            ("ok X:1 Y:2", "ok X:... Y:3", false),
            ("ok X:1 Y:2", "ok ...", true),
            ("ok X:1 Y:2", "...Y...", true),
            ("aa", "a...aa", false),
            ("", "...", true),
        ] {
            assert_eq!(is_like(message, expected), like, "{message:?} {expected:?}");
        }
    }
}
