//! The button: low while it is pressed.

use super::journal::note;
use embedded_hal::digital::{ErrorType, InputPin};
use embedded_hal_async::digital::Wait;
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::{Poll, Waker};

/// The contact, as a finger moves it.
#[derive(Debug, Default)]
pub struct Contact {
    pressed: Cell<bool>,
    /// Changes so far, so that one shorter than a task's nap is still an edge.
    edges: Cell<u32>,
    waker: RefCell<Option<Waker>>,
}

impl Contact {
    /// Opens or closes it.
    pub fn set(&self, pressed: bool) {
        if self.pressed.replace(pressed) != pressed {
            self.edges.set(self.edges.get() + 1);
            note(if pressed {
                "    button: down"
            } else {
                "    button: up"
            });
            if let Some(waker) = self.waker.take() {
                waker.wake();
            }
        }
    }
}

/// The button of the board; for one task.
pub struct Button {
    contact: Rc<Contact>,
    seen: u32,
}

impl Button {
    /// On this contact.
    pub fn new(contact: Rc<Contact>) -> Self {
        let seen = contact.edges.get();
        Self { contact, seen }
    }

    async fn until_level(&mut self, pressed: bool) {
        poll_fn(|context| {
            if self.contact.pressed.get() == pressed {
                return Poll::Ready(());
            }
            self.contact.waker.replace(Some(context.waker().clone()));
            Poll::Pending
        })
        .await;
        self.seen = self.contact.edges.get();
    }

    /// Waits for an edge since the last wait; gives how many there were.
    async fn edges(&mut self) -> u32 {
        poll_fn(|context| {
            if self.contact.edges.get() != self.seen {
                return Poll::Ready(());
            }
            self.contact.waker.replace(Some(context.waker().clone()));
            Poll::Pending
        })
        .await;
        let edges = self.contact.edges.get();
        edges - std::mem::replace(&mut self.seen, edges)
    }

    /// Edges alternate: of two, one goes each way.
    async fn until_edge_to(&mut self, pressed: bool) {
        while self.edges().await < 2 && self.contact.pressed.get() != pressed {}
    }
}

impl ErrorType for Button {
    type Error = Infallible;
}

impl InputPin for Button {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(!self.contact.pressed.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.contact.pressed.get())
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
        self.edges().await;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::poll_once;

    #[test]
    fn levels_and_edges() {
        let contact = Rc::new(Contact::default());
        let mut button = Button::new(contact.clone());
        assert!(button.is_high().unwrap());
        assert!(poll_once(button.wait_for_high()).is_ready());
        assert!(poll_once(button.wait_for_low()).is_pending());
        assert!(poll_once(button.wait_for_any_edge()).is_pending());
        contact.set(true);
        assert!(button.is_low().unwrap());
        assert!(poll_once(button.wait_for_rising_edge()).is_pending());
        contact.set(false);
        // It was down meanwhile.
        contact.set(true);
        contact.set(false);
        assert!(poll_once(button.wait_for_falling_edge()).is_ready());
        assert!(poll_once(button.wait_for_falling_edge()).is_pending());
    }
}
