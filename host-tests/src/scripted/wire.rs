//! A TCP connection between a client's computer and the machine, as far as either can tell: bytes in order,
//! windows that fill, and the ways in which it ends.

use super::journal::note;
use embassy_time::{Duration, Instant};
use std::collections::VecDeque;
use std::task::Waker;

/// Bytes that wait in one direction before the sender is held back, as on the chips.
pub const WINDOW: usize = 2048;
/// A side that hears nothing at all from the other gives up after this: the keep-alive of the chips
/// (`TIMEOUT` in `boards/embassy_tcp.rs`).
pub const GIVES_UP: Duration = Duration::from_secs(20);

/// How a connection ended, for one of its sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The other side closed it.
    Closed,
    /// The other side reset it.
    Reset,
    /// Nothing was heard of the other side for too long, or it has been without power.
    Lost,
}

/// One connection.
#[derive(Debug, Default)]
pub struct Wire {
    /// Given by the client's program, not taken by the window yet.
    pub unsent: VecDeque<u8>,
    /// At the machine, not read yet.
    pub arrived: VecDeque<u8>,
    /// The client sends nothing after `unsent`.
    pub client_finishes: bool,
    /// The client has reset it.
    pub client_resets: bool,
    /// The client's computer is there.
    pub client_lives: bool,
    /// The client's program takes what comes.
    pub client_reads: bool,
    /// Written by the machine, not taken by the client yet.
    pub outgoing: VecDeque<u8>,
    /// The machine writes nothing after `outgoing`.
    pub machine_finishes: bool,
    /// The machine has thrown its end away.
    pub machine_forgets: bool,
    /// It did so because its power failed.
    pub power_failed: bool,
    /// How it ended for the machine; what arrived before can still be read.
    pub machine_sees: Option<End>,
    /// How it ended for the client.
    pub client_sees: Option<End>,
    /// Since when nothing gets through.
    silent_since: Option<Instant>,
    wakers: Vec<Waker>,
}

impl Wire {
    /// Just connected.
    pub fn new() -> Self {
        Self {
            client_lives: true,
            client_reads: true,
            ..Self::default()
        }
    }

    /// Wakes this task of the machine when something changes for it.
    pub fn register(&mut self, waker: &Waker) {
        if !self.wakers.iter().any(|other| other.will_wake(waker)) {
            self.wakers.push(waker.clone());
        }
    }

    /// Whether the machine can write to it no more, and why.
    pub fn broken(&self) -> Option<End> {
        self.machine_sees.filter(|end| *end != End::Closed)
    }

    /// Room for what the machine writes.
    pub fn room(&self) -> usize {
        WINDOW - self.outgoing.len().min(WINDOW)
    }

    /// When it will be given up, if nothing gets through until then.
    pub fn given_up_at(&self) -> Option<Instant> {
        let over = self.client_sees.is_some() && self.machine_sees.is_some();
        self.silent_since
            .filter(|_| !over)
            .map(|since| since + GIVES_UP)
    }

    /// Lets everything get through that does, and gives what the client has heard. `reachable`: the
    /// machine has power, and is in the client's network.
    pub fn pass(&mut self, reachable: bool) -> Vec<u8> {
        if !(reachable && self.client_lives) {
            self.grow_silent();
            return Vec::new();
        }
        self.silent_since = None;
        let mut woken = false;
        if self.machine_forgets {
            // Whatever the client's system sends is answered with a reset.
            let end = match (self.power_failed, self.machine_finishes) {
                (true, _) => End::Lost,
                (false, true) => End::Closed,
                (false, false) => End::Reset,
            };
            self.client_sees.get_or_insert(end);
            return Vec::new();
        }
        if self.machine_sees.is_none() {
            let room = WINDOW - self.arrived.len().min(WINDOW);
            let fits = self.unsent.len().min(room);
            self.arrived.extend(self.unsent.drain(..fits));
            woken |= fits > 0;
            if self.client_resets {
                self.machine_sees = Some(End::Reset);
                woken = true;
            } else if self.client_finishes && self.unsent.is_empty() {
                self.machine_sees = Some(End::Closed);
                woken = true;
            }
        }
        let mut heard = Vec::new();
        if self.client_reads && self.client_sees.is_none() {
            woken |= !self.outgoing.is_empty();
            heard.extend(self.outgoing.drain(..));
            if self.machine_finishes {
                self.client_sees = Some(End::Closed);
                // A program that finds the end closes its own side.
                self.client_finishes = true;
            }
        }
        if woken {
            self.wake();
        }
        heard
    }

    fn grow_silent(&mut self) {
        let since = *self.silent_since.get_or_insert_with(Instant::now);
        if Instant::now() < since + GIVES_UP {
            return;
        }
        if self.machine_sees.is_none() && !self.machine_forgets {
            note("    a connection is given up by the machine: nothing gets through");
        }
        self.machine_sees.get_or_insert(End::Lost);
        self.client_sees.get_or_insert(End::Lost);
        self.wake();
    }

    fn wake(&mut self) {
        self.wakers.drain(..).for_each(Waker::wake);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::boards::desktop::clock::HandTime;

    #[test]
    fn windows_hold_the_sender_back() {
        let _time = HandTime::take();
        let mut wire = Wire::new();
        wire.unsent.extend([7; WINDOW + 10]);
        wire.pass(true);
        assert_eq!((wire.arrived.len(), wire.unsent.len()), (WINDOW, 10));
        wire.arrived.clear();
        wire.pass(true);
        assert_eq!((wire.arrived.len(), wire.unsent.len()), (10, 0));
        wire.client_reads = false;
        wire.outgoing.extend([7; WINDOW]);
        assert_eq!(wire.pass(true).len(), 0);
        assert_eq!(wire.room(), 0);
        wire.client_reads = true;
        assert_eq!(wire.pass(true).len(), WINDOW);
        assert_eq!(wire.room(), WINDOW);
    }

    #[test]
    fn what_was_sent_before_the_end_arrives_before_it() {
        let _time = HandTime::take();
        let mut wire = Wire::new();
        wire.unsent.extend([7; WINDOW + 1]);
        wire.client_finishes = true;
        wire.pass(true);
        assert_eq!(wire.machine_sees, None);
        wire.arrived.clear();
        wire.pass(true);
        assert_eq!(
            (wire.arrived.len(), wire.machine_sees),
            (1, Some(End::Closed))
        );
    }

    #[test]
    fn a_silence_of_20_s_ends_it_for_both() {
        let time = HandTime::take();
        let mut wire = Wire::new();
        wire.unsent.extend([7]);
        for (at, ended) in [(0, false), (19, false), (20, true)] {
            time.go_on_to(Instant::from_secs(at));
            wire.pass(false);
            assert_eq!(wire.machine_sees.is_some(), ended, "{at}");
            assert_eq!(wire.client_sees.is_some(), ended, "{at}");
        }
        // A shorter one delays only.
        let mut wire = Wire::new();
        wire.unsent.extend([7]);
        wire.pass(false);
        time.go_on_to(Instant::from_secs(39));
        wire.pass(true);
        time.go_on_to(Instant::from_secs(41));
        wire.pass(false);
        assert_eq!((wire.arrived.len(), wire.machine_sees), (1, None));
    }

    #[test]
    fn a_machine_that_forgets_resets_unless_it_has_closed() {
        let _time = HandTime::take();
        for (finished, failed, end) in [
            (false, false, End::Reset),
            (true, false, End::Closed),
            (false, true, End::Lost),
        ] {
            let mut wire = Wire::new();
            wire.machine_forgets = true;
            wire.machine_finishes = finished;
            wire.power_failed = failed;
            wire.pass(true);
            assert_eq!(wire.client_sees, Some(end));
        }
    }
}
