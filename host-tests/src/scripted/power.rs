//! Whether the machine has power, and what must never happen while it has.

use super::journal::note;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// The supply; everybody has the same.
#[derive(Clone, Debug, Default)]
pub struct Power(Rc<State>);

#[derive(Debug, Default)]
struct State {
    on: Cell<bool>,
    offence: RefCell<Option<String>>,
}

impl Power {
    /// There is power, and there was before.
    pub fn present() -> Self {
        let power = Self::default();
        power.0.on.set(true);
        power
    }

    /// Whether there is power.
    pub fn is_on(&self) -> bool {
        self.0.on.get()
    }

    /// Switches it; off, nothing that the firmware still does has any effect.
    pub fn switch(&self, on: bool) {
        self.0.on.set(on);
        note(if on {
            "    power: on"
        } else {
            "    power: off"
        });
    }

    /// Does what the end of a firmware does, as if there were no power.
    pub fn interrupt(&self, end: impl FnOnce()) {
        self.0.on.set(false);
        end();
        self.0.on.set(true);
    }

    /// Something has happened that must never happen. The first such thing counts.
    pub fn offend(&self, what: impl Into<String>) {
        self.0
            .offence
            .borrow_mut()
            .get_or_insert_with(|| what.into());
    }

    /// What has happened that must never happen.
    pub fn offence(&self) -> Option<String> {
        self.0.offence.borrow().clone()
    }
}
