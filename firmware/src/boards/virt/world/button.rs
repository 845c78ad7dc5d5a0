//! The arm's button, pressed by the host. Low while pressed, like a button to ground with a pull-up.

use core::{
    convert::Infallible,
    future::poll_fn,
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
    task::Poll,
};

use embassy_sync::waitqueue::AtomicWaker;
use embedded_hal::digital::{ErrorType, InputPin};
use embedded_hal_async::digital::Wait;

static PRESSED: AtomicBool = AtomicBool::new(false);
/// Counts changes, so that a press shorter than a task's nap is still an edge.
static EDGES: AtomicU32 = AtomicU32::new(0);
static WAKER: AtomicWaker = AtomicWaker::new();

/// The host moves the button. Called by one task, so load and store need not be one step.
pub(super) fn set(pressed: bool) {
    if pressed != PRESSED.load(Ordering::Relaxed) {
        PRESSED.store(pressed, Ordering::Relaxed);
        EDGES.store(
            EDGES.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
        WAKER.wake();
    }
}

/// The button; for one task.
pub struct Button {
    seen: u32,
}

impl Button {
    /// The button of the board.
    #[expect(clippy::new_without_default, reason = "a device, not a value")]
    pub fn new() -> Self {
        Self {
            seen: EDGES.load(Ordering::Relaxed),
        }
    }

    async fn until(&mut self, ready: impl Fn(&mut Self) -> bool) {
        poll_fn(|cx| {
            WAKER.register(cx.waker());
            if ready(self) {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }

    async fn until_level(&mut self, pressed: bool) {
        self.until(|_| PRESSED.load(Ordering::Relaxed) == pressed)
            .await;
        self.seen = EDGES.load(Ordering::Relaxed);
    }

    /// Edges alternate, so an odd count of them from a known level ends at the other one.
    async fn until_edge_to(&mut self, pressed: bool) {
        loop {
            let edges = self.next_edges().await;
            if PRESSED.load(Ordering::Relaxed) == pressed || edges > 1 {
                return;
            }
        }
    }

    /// Waits for at least one edge since the last wait; returns how many.
    async fn next_edges(&mut self) -> u32 {
        self.until(|button| EDGES.load(Ordering::Relaxed) != button.seen)
            .await;
        let edges = EDGES.load(Ordering::Relaxed);
        edges.wrapping_sub(core::mem::replace(&mut self.seen, edges))
    }
}

impl ErrorType for Button {
    type Error = Infallible;
}

impl InputPin for Button {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(!PRESSED.load(Ordering::Relaxed))
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(PRESSED.load(Ordering::Relaxed))
    }
}

impl Wait for Button {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        self.until_level(false).await;
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        self.until_level(true).await;
        Ok(())
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        self.until_edge_to(false).await;
        Ok(())
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        self.until_edge_to(true).await;
        Ok(())
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        self.next_edges().await;
        Ok(())
    }
}
