//! Lines with a checksum: any number of redundant ones, `^`, then a final one, `*`; the first right one
//! counts (`spec lasaurgrbl, Checksum and Error Correction`).

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
#[derive(Clone, Copy, Debug, Default)]
pub struct Group {
    /// A redundant line was right: what follows up to the final line is the same.
    done: bool,
}

impl Group {
    /// Between groups.
    pub const fn new() -> Self {
        Self { done: false }
    }

    /// A stop ends the group: the sender throws away what it had in mind, and its next line must not be
    /// taken for the end of that.
    pub const fn end(&mut self) {
        self.done = false;
    }

    /// Judges one line.
    pub fn judge<'a>(&mut self, line: &'a [u8]) -> Verdict<'a> {
        let (last, rest) = match line {
            [b'^', rest @ ..] => (false, rest),
            [b'*', rest @ ..] => (true, rest),
            body => return Verdict::Execute(body),
        };
        if self.done {
            self.done = !last;
            return Verdict::Skip;
        }
        match rest {
            [sum @ 128..=255, body @ ..] if is_right(*sum, body) => {
                self.done = !last;
                Verdict::Execute(body)
            }
            [128..=255, ..] if last => Verdict::Failed,
            [128..=255, ..] => Verdict::Wrong,
            _ => Verdict::NoChecksum,
        }
    }
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
    fn a_stop_ends_the_group() {
        let mut group = Group::new();
        assert_eq!(group.judge(b"^\x98G90"), RIGHT);
        group.end();
        assert_eq!(group.judge(b"^\x9aM80"), Verdict::Execute(b"M80"));
        assert_eq!(group.judge(b"*\x9aM80"), Verdict::Skip);
    }
}
