//! Lines with a checksum: any number of redundant ones, `^`, then a final one, `*`; the first right one
//! counts (`spec lasaurgrbl, Checksum and Error Correction`).
//!
//! Prefix and newline have no checksum, and they too can be damaged. A prefixed line is known by its
//! checksum byte, for nothing else is 128 or more; so what damage has made of one is known as well, and a
//! line is neither lost in silence nor taken for the one before it:
//!
//! - two lines that became one, their newline damaged: the second part is judged as the line it was;
//! - a line whose prefix is damaged is refused by the parser, and ends the group if a redundant line was
//!   right, because hosts send one redundant line, so that it was the final one;
//! - after a wrong redundant line it is the final line that failed.

use super::checksum::is_right;

/// What is to become of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict<'a> {
    /// Execute this body.
    Execute(&'a [u8]),
    /// It has been executed: a bare reply.
    Skip,
    /// A redundant line that is wrong: another one is to come.
    Wrong,
    /// A final line that is wrong: stop.
    Failed,
    /// What is no checksum: stop.
    NoChecksum,
}

/// Where a session is between redundant and final lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Nothing of a group has been received.
    #[default]
    Between,
    /// Only wrong redundant lines.
    Wrong,
    /// A redundant line was right: what follows up to the final line is the same.
    Done,
}

/// Judges the lines of a session.
#[derive(Clone, Copy, Debug, Default)]
pub struct Group {
    state: State,
}

impl Group {
    /// Between groups.
    pub const fn new() -> Self {
        Self {
            state: State::Between,
        }
    }

    /// A stop ends the group: the sender throws away what it had in mind, and its next line must not be
    /// taken for the end of that.
    pub const fn end(&mut self) {
        self.state = State::Between;
    }

    /// Judges one line.
    pub fn judge<'a>(&mut self, line: &'a [u8]) -> Verdict<'a> {
        match line {
            [b'^', rest @ ..] => self.prefixed(false, rest),
            [b'*', rest @ ..] => self.prefixed(true, rest),
            plain if plain.is_ascii() => Verdict::Execute(plain),
            damaged => self.without_its_prefix(damaged),
        }
    }

    fn prefixed<'a>(&mut self, last: bool, rest: &'a [u8]) -> Verdict<'a> {
        if self.state == State::Done {
            if last {
                self.end();
            }
            return Verdict::Skip;
        }
        match rest {
            [sum @ 128..=255, body @ ..] if is_right(*sum, body) => {
                self.state = if last { State::Between } else { State::Done };
                Verdict::Execute(body)
            }
            [128..=255, ..] if last => Verdict::Failed,
            [128..=255, body @ ..] => match second_line(body) {
                Some(second) => self.judge(second),
                None => {
                    self.state = State::Wrong;
                    Verdict::Wrong
                }
            },
            _ => Verdict::NoChecksum,
        }
    }

    fn without_its_prefix<'a>(&mut self, line: &'a [u8]) -> Verdict<'a> {
        if self.state == State::Wrong {
            return Verdict::Failed;
        }
        self.end();
        match second_line(line) {
            Some(second) => self.judge(second),
            // Its checksum is no letter.
            None => Verdict::Execute(line),
        }
    }
}

/// The last line in a body that became part of another line: a prefix and a checksum, neither of which
/// a body has.
fn second_line(body: &[u8]) -> Option<&[u8]> {
    let begins = |pair: &[u8]| matches!(pair, [b'^' | b'*', 128..=255]);
    let at = body.windows(2).rposition(begins)?;
    body.get(at..)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const RIGHT: Verdict<'static> = Verdict::Execute(b"G90");

    /// The verdicts on some lines in a row.
    fn judge<'a>(lines: &[&'a [u8]]) -> Vec<Verdict<'a>> {
        let mut group = Group::new();
        lines.iter().map(|line| group.judge(line)).collect()
    }

    #[test]
    fn every_row_of_the_table() {
        use Verdict::{Execute, Failed, NoChecksum, Skip, Wrong};
        for (lines, verdicts) in [
            (vec![&b"*\x98G90"[..]], vec![RIGHT]),
            (vec![b"^\x98G90"], vec![RIGHT]),
            (vec![b"^\x98G90", b"*\x98G90"], vec![RIGHT, Skip]),
            (
                vec![
                    b"^\x98G90",
                    b"^\x98G90",
                    b"^\x99xyz",
                    b"*\x99x",
                    b"*\x9aM80",
                ],
                vec![RIGHT, Skip, Skip, Skip, Execute(b"M80")],
            ),
            (vec![b"^\x99G90"], vec![Wrong]),
            (vec![b"^\x99G90", b"*\x98G90"], vec![Wrong, RIGHT]),
            (
                vec![b"^\x98G9", b"^\x98G90", b"*\x98G9"],
                vec![Wrong, RIGHT, Skip],
            ),
            (vec![b"*\x99G90"], vec![Failed]),
            (vec![b"^\x99G90", b"*\x99G90"], vec![Wrong, Failed]),
            (vec![b"*G90"], vec![NoChecksum]),
            (vec![b"^G90"], vec![NoChecksum]),
            (vec![b"*\x7fG90"], vec![NoChecksum]),
            (vec![b"*"], vec![NoChecksum]),
            (vec![b"^"], vec![NoChecksum]),
            (
                vec![b"^\x98G90", b"M80", b"*\x98G90"],
                vec![RIGHT, Execute(b"M80"), Skip],
            ),
            (vec![b"G90"], vec![RIGHT]),
            // Resuming: `~` has been taken out of it.
            (vec![b"^\x80", b"*\x80"], vec![Execute(b""), Skip]),
        ] {
            assert_eq!(judge(&lines), verdicts, "{lines:?}");
        }
    }

    #[test]
    fn a_right_sum_does_not_make_a_body_of_other_bytes_right() {
        // A flipped high bit vanishes in the sum: this one is that of `G90`.
        assert_eq!(super::super::checksum::checksum(b"\xc790"), 0x98);
        assert_eq!(
            judge(&[b"^\x98\xc790", b"*\x98G90"]),
            [Verdict::Wrong, RIGHT]
        );
    }

    #[test]
    fn two_lines_that_became_one() {
        use Verdict::{Execute, Failed, Skip, Wrong};
        for (lines, verdicts) in [
            // The redundant line's newline: the final line is right, or wrong.
            (
                vec![&b"^\x98G90x*\x98G90"[..], b"*\x9aM80"],
                vec![RIGHT, Execute(b"M80")],
            ),
            (vec![b"^\x98G90x*\x98G95"], vec![Failed]),
            (vec![b"^\x98G90x^\x98G95", b"*\x98G90"], vec![Wrong, RIGHT]),
            // The final line's: its group has been executed, and its own second half is skipped.
            (
                vec![b"^\x98G90", b"*\x98G90x^\x9aM80", b"*\x9aM80"],
                vec![RIGHT, Skip, Execute(b"M80")],
            ),
            // Its group has not.
            (vec![b"^\x98G9", b"*\x98G90x^\x9aM80"], vec![Wrong, Failed]),
        ] {
            assert_eq!(judge(&lines), verdicts, "{lines:?}");
        }
    }

    #[test]
    fn a_damaged_prefix() {
        use Verdict::{Execute, Failed, Wrong};
        for (lines, verdicts) in [
            (
                vec![&b"n\x98G90"[..], b"*\x98G90"],
                vec![Execute(b"n\x98G90"), RIGHT],
            ),
            // The next group is not taken for the end of this one.
            (
                vec![b"^\x98G90", b"n\x98G90", b"^\x9aM80"],
                vec![RIGHT, Execute(b"n\x98G90"), Execute(b"M80")],
            ),
            (vec![b"^\x98G9", b"n\x98G90"], vec![Wrong, Failed]),
            (vec![b"n\x98G90x*\x98G90"], vec![RIGHT]),
            (
                vec![b"^\x98G90", b"n\x98G90x^\x9aM80"],
                vec![RIGHT, Execute(b"M80")],
            ),
        ] {
            assert_eq!(judge(&lines), verdicts, "{lines:?}");
        }
    }

    #[test]
    fn a_stop_ends_the_group() {
        let mut group = Group::new();
        assert_eq!(group.judge(b"^\x98G90"), RIGHT);
        group.end();
        assert_eq!(group.judge(b"^\x9aM80"), Verdict::Execute(b"M80"));
        assert_eq!(group.judge(b"*\x9aM80"), Verdict::Skip);
    }
}
