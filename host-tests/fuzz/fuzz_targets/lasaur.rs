//! Whatever bytes a serial line brings, while the plan is full or not: one reply for each line that is
//! not empty, a stop within one byte, nothing executed in stop mode (the rig sees to that).
//!
//! The input is what the host sends, except for three bytes, so that the corpus can be read and written by
//! hand: 0x01 lets the machine do a move of its plan, 0x02 stops it by a limit, 0x03 resumes it by a button.
//!
//! ```text
//! cargo +nightly fuzz run lasaur -- -max_total_time=60        (in host-tests/)
//! ```

#![no_main]

use host_tests::lasaur::oracle::is_well_formed;
use host_tests::lasaur::rig::Rig;
use libfuzzer_sys::fuzz_target;
use protocol_core::lasaur::Effect;
use protocol_core::machine::StopReason;
use protocol_core::motion::Side;

/// So few that a plan is full before the input ends.
const PLAN: usize = 2;

fuzz_target!(|input: &[u8]| {
    let mut rig = Rig::new(PLAN);
    // Lines that ended, and whether something was kept of the one that has not.
    let (mut lines, mut kept) = (0, false);
    for &byte in input {
        let lost = rig.lost;
        match byte {
            1 => rig.work(),
            2 => rig.happens(Effect::Stop(StopReason::Limit(Side::X1))),
            3 => rig.happens(Effect::Resume),
            byte => rig.receive(&[byte]),
        }
        match byte {
            b'!' => assert!(matches!(
                rig.facts.stop,
                // A long line that waited behind it may be the last cause.
                Some(StopReason::Requested | StopReason::LineOverflow)
            )),
            1..=3 | b'~' | 0x14 => {}
            _ if rig.lost > lost => assert!(rig.facts.stop.is_some()),
            b'\n' => {
                lines += usize::from(kept);
                kept = false;
            }
            byte => kept |= byte > b' ',
        }
    }
    rig.rest();
    assert_eq!(rig.replies.len(), lines, "{}", input.escape_ascii());
    for reply in &rig.replies {
        assert!(is_well_formed(reply), "{}", reply.escape_ascii());
    }
});
