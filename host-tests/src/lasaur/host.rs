//! Hosts as they are seen on the wire (`reference/lasaurgrbl.md`, section 6). They are told what
//! arrives, and say what they send; how it gets there is the test's affair.

use super::oracle::with_checksum;
use std::collections::VecDeque;

/// Bytes that LasaurApp sends for one 0x12.
const CHUNK: usize = 16;
const READY: u8 = 0x12;
const REQUEST_READY: u8 = 0x14;

/// LasaurApp, the host the protocol is from: it sends nothing until 0x12 is there, then 16 bytes at a
/// time, each line twice.
#[derive(Debug, Default)]
pub struct LasaurApp {
    queue: VecDeque<u8>,
    /// Bytes that may be sent for the last 0x12.
    allowed: usize,
    /// 0x14 was sent, and not yet answered.
    asked: bool,
    line: Vec<u8>,
    /// Lines from the machine, without newline and 0x12.
    pub lines: Vec<String>,
    /// Lines queued that have not been answered.
    pub unanswered: usize,
}

impl LasaurApp {
    /// Queues a line, once with `^` and once with `*`. With `!` in it, it replaces the queue.
    pub fn queue(&mut self, body: &str) {
        if body.contains('!') {
            self.queue.clear();
        }
        for prefix in *b"^*" {
            self.queue.extend(with_checksum(prefix, body.as_bytes()));
            self.queue.push_back(b'\n');
            self.unanswered += 1;
        }
    }

    /// Takes what the machine sent.
    pub fn receive(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                READY => {
                    self.allowed = CHUNK;
                    self.asked = false;
                }
                b'\n' => {
                    let line = String::from_utf8_lossy(&self.line).into_owned();
                    if !line.starts_with('#') {
                        self.unanswered = self.unanswered.saturating_sub(1);
                    }
                    self.lines.push(line);
                    self.line.clear();
                }
                byte => self.line.push(byte),
            }
        }
    }

    /// What it sends now.
    pub fn send(&mut self) -> Vec<u8> {
        if self.queue.is_empty() {
            return Vec::new();
        }
        if self.allowed == 0 {
            let ask = !self.asked;
            self.asked = true;
            return if ask { vec![REQUEST_READY] } else { Vec::new() };
        }
        let count = self.allowed.min(self.queue.len());
        self.allowed -= count;
        self.queue.drain(..count).collect()
    }

    /// Everything queued has been sent.
    pub fn is_idle(&self) -> bool {
        self.queue.is_empty()
    }
}

/// LaserWeb: plain lines, the next one when an empty reply is there.
#[derive(Debug, Default)]
pub struct LaserWeb {
    queue: VecDeque<String>,
    line: Vec<u8>,
    /// Lines from the machine.
    pub lines: Vec<String>,
}

impl LaserWeb {
    /// What it sends when the port is opened, to find out who is there.
    pub const PROBES: [&str; 4] = ["?", "M115", "version", "$fb"];

    /// Queues a line, and gives what is sent for it at once.
    pub fn queue(&mut self, lines: &[&str]) -> Vec<u8> {
        let idle = self.queue.is_empty();
        self.queue
            .extend(lines.iter().map(|line| (*line).to_string()));
        if idle { self.next() } else { Vec::new() }
    }

    /// Takes what the machine sent, and gives what is sent for it.
    pub fn receive(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut sent = Vec::new();
        for &byte in bytes {
            if byte != b'\n' {
                self.line.push(byte);
                continue;
            }
            let line = String::from_utf8_lossy(&self.line).into_owned();
            self.line.clear();
            if line.is_empty() {
                sent.extend(self.next());
            }
            self.lines.push(line);
        }
        sent
    }

    /// It knows the machine: a line that begins with `#` was there.
    pub fn knows_the_machine(&self) -> bool {
        self.lines.iter().any(|line| line.starts_with('#'))
    }

    /// Everything queued has been sent.
    pub fn is_idle(&self) -> bool {
        self.queue.is_empty()
    }

    fn next(&mut self) -> Vec<u8> {
        let line = self.queue.pop_front();
        line.map_or_else(Vec::new, |line| format!("{line}\n").into_bytes())
    }
}
