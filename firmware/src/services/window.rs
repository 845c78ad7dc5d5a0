//! The window of a service: many ask, one at a time, and one task does what is asked for.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::{Mutex, MutexGuard};
use embassy_sync::signal::Signal;

/// Counts what is asked for, so that nobody takes an earlier outcome for his own: who has asked may have gone
/// before it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Ticket(u32);

/// Nobody else asks as long as this lives.
pub(super) type Turn<'a> = MutexGuard<'a, CriticalSectionRawMutex, Ticket>;

/// What is asked for lies elsewhere, and belongs to whose turn it is; `T` is what comes of it.
pub(super) struct Window<T> {
    turn: Mutex<CriticalSectionRawMutex, Ticket>,
    request: Signal<CriticalSectionRawMutex, Ticket>,
    outcome: Signal<CriticalSectionRawMutex, (Ticket, T)>,
}

impl<T: Send> Window<T> {
    /// With nobody at it.
    pub(super) const fn new() -> Self {
        Self {
            turn: Mutex::new(Ticket(0)),
            request: Signal::new(),
            outcome: Signal::new(),
        }
    }

    /// Waits until nobody else asks.
    pub(super) async fn turn(&self) -> Turn<'_> {
        self.turn.lock().await
    }

    /// Has it done, and gives what came of it.
    pub(super) async fn ask(&self, turn: &mut Ticket) -> T {
        *turn = Ticket(turn.0.wrapping_add(1));
        self.request.signal(*turn);
        loop {
            let (ticket, outcome) = self.outcome.wait().await;
            if ticket == *turn {
                return outcome;
            }
        }
    }

    /// Of the service: waits until somebody asks.
    pub(super) async fn next(&self) -> Ticket {
        self.request.wait().await
    }

    /// Of the service: tells what came of it.
    pub(super) fn tell(&self, ticket: Ticket, outcome: T) {
        self.outcome.signal((ticket, outcome));
    }
}
