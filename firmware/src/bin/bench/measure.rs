//! Counting the instructions of a call.

use core::hint::black_box;

use firmware::boards::virt::{console, power};
use riscv::register::minstret;

/// Instructions of `work(input)`, the call itself and the reading of the counter included.
#[inline(never)]
fn raw<A, R>(work: fn(&A) -> R, input: &A) -> u32 {
    let (work, input) = (black_box(work), black_box(input));
    let before = minstret::read();
    black_box(work(input));
    let after = minstret::read();
    (after - before) as u32
}

#[inline(never)]
fn nothing<A>(_input: &A) {}

/// Prints the mean cost of `work` over `inputs`, less that of a call that does nothing.
pub fn report<A, R>(name: &str, inputs: &[A], work: fn(&A) -> R) {
    let total: u32 = inputs
        .iter()
        .map(|input| raw(work, input) - raw(nothing, input))
        .sum();
    console::write_unlocked(format_args!("{name};{}\n", total / inputs.len() as u32));
}

/// Ends the run with a status when what was measured does not do its work.
pub fn check(holds: bool, what: &str) {
    if !holds {
        console::write_unlocked(format_args!("wrong: {what}\n"));
        power::exit(1);
    }
}
