//! What holds for any bytes, however they are cut, while the plan is full or not.

use host_tests::lasaur::oracle::is_well_formed;
use host_tests::lasaur::rig::Rig;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use protocol_core::lasaur::{Effect, Session};
use protocol_core::machine::StopReason;
use protocol_core::motion::Side;
use std::fmt;

/// What happens to a session.
#[derive(Clone)]
enum Happening {
    Bytes(Vec<u8>),
    /// The machine does a move.
    Work,
    /// Something stops the machine that no byte tells of, or ends that.
    Machine(Effect),
}

impl fmt::Debug for Happening {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bytes(bytes) => write!(out, "\"{}\"", bytes.escape_ascii()),
            Self::Work => write!(out, "work"),
            Self::Machine(effect) => write!(out, "{effect:?}"),
        }
    }
}

fn happenings() -> impl Strategy<Value = Vec<Happening>> {
    let bytes = prop_oneof![
        6 => select(&[
            "G0X1Y1\n", "G1X2\n", "G91G1X1Y-1S9\n", "?\n", "G30\n", "M80\n", "G10L20P1\n", "G55\n",
            "^\u{98}G90\n", "*\u{98}G90\n", "!", "~", "\u{14}", "G2\n", "X\n", "g\n", "\n", " ", "G0X5",
        ][..]).prop_map(|text| text.chars().map(|byte| byte as u32 as u8).collect()),
        1 => vec(any::<u8>(), 0..20),
        1 => vec(prop_oneof![20 => Just(b'x'), 1 => any::<u8>()], 60..300),
        1 => vec(select(&b"G0X1\n!~\x14^*"[..]), 0..40),
    ];
    let one = prop_oneof![
        8 => bytes.prop_map(Happening::Bytes),
        2 => Just(Happening::Work),
        1 => select(&[
            Effect::Stop(StopReason::Limit(Side::Y2)), Effect::Stop(StopReason::Power), Effect::Resume,
        ][..]).prop_map(Happening::Machine),
    ];
    vec(one, 0..60)
}

/// Lets all of it happen; `cut` bytes at a time.
fn run(happenings: &[Happening], capacity: usize, cut: usize) -> Rig {
    let mut rig = Rig::new(capacity);
    for happening in happenings {
        match happening {
            Happening::Bytes(bytes) => bytes.chunks(cut).for_each(|piece| rig.receive(piece)),
            Happening::Work => rig.work(),
            Happening::Machine(effect) => rig.happens(*effect),
        }
    }
    rig
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn cutting_does_not_matter(
        happenings in happenings(), capacity in 0usize..4, one in 1usize..9, other in 1usize..300,
    ) {
        let (one, other) = (run(&happenings, capacity, one), run(&happenings, capacity, other));
        prop_assert_eq!(one.sent.escape_ascii().to_string(), other.sent.escape_ascii().to_string());
        prop_assert_eq!(one.taken, other.taken);
        prop_assert_eq!(one.facts, other.facts);
    }

    #[test]
    fn one_reply_for_each_line_and_a_stop_within_one_byte(
        happenings in happenings(), capacity in 1usize..4,
    ) {
        let mut rig = Rig::new(capacity);
        // Lines that ended, and whether something was kept of the one that has not; bytes that were
        // lost are in none.
        let (mut lines, mut kept) = (0, false);
        for happening in &happenings {
            match happening {
                Happening::Work => rig.work(),
                Happening::Machine(effect) => rig.happens(*effect),
                Happening::Bytes(bytes) => for &byte in bytes {
                    let lost = rig.lost;
                    rig.receive(&[byte]);
                    match byte {
                        // A long line that waited behind it may be the last cause.
                        b'!' => prop_assert!(matches!(
                            rig.facts.stop,
                            Some(StopReason::Requested | StopReason::LineOverflow)
                        )),
                        b'~' | 0x14 => {}
                        _ if rig.lost > lost => prop_assert!(rig.facts.stop.is_some()),
                        b'\n' => {
                            lines += usize::from(kept);
                            kept = false;
                        }
                        _ => kept |= byte > b' ',
                    }
                },
            }
        }
        rig.rest();
        prop_assert_eq!(rig.replies.len(), lines);
        for reply in &rig.replies {
            prop_assert!(is_well_formed(reply), "{}", reply.escape_ascii());
        }
    }

    #[test]
    fn what_was_complete_when_the_stop_came_is_never_executed(
        before in happenings(), capacity in 0usize..4, after in happenings(),
    ) {
        let mut rig = run(&before, capacity, 7);
        let (taken, answered) = (rig.taken.len(), rig.replies.len());
        rig.receive(b"!~");
        // The plan has room from now on, for whatever still wants into it.
        for _ in 0..300 {
            rig.work();
        }
        prop_assert_eq!(rig.taken.len(), taken);
        for reply in &rig.replies[answered..] {
            prop_assert!(reply.starts_with(b"!"), "{}", reply.escape_ascii());
        }
        // And it does go on afterwards.
        for happening in &after {
            match happening {
                Happening::Bytes(bytes) => rig.receive(bytes),
                Happening::Work => rig.work(),
                Happening::Machine(effect) => rig.happens(*effect),
            }
        }
        // A stop empties the buffer, so that there is room for the end of what is in it.
        rig.receive(b"!\n~");
        let answered = rig.replies.len();
        rig.receive(b"G90\n");
        prop_assert_eq!(&rig.replies[answered..], [b"\n"]);
    }
}

#[test]
fn a_session_has_a_fixed_size() {
    // What it receives is 254 and 78 bytes; the rest is state.
    assert!(size_of::<Session>() <= 640, "{}", size_of::<Session>());
}
