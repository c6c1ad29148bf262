//! A clock that needs no machine.

use std::cell::Cell;

use palpus::algebra::Clock;

/// Takes as long for each look at it, whatever was done meanwhile: the same on every machine.
pub(crate) struct CountingClock {
    now: Cell<u64>,
    per_look: u64,
}

impl CountingClock {
    /// From 0, `per_look` ns for each look.
    pub(crate) fn new(per_look: u64) -> Self {
        Self { now: Cell::new(0), per_look }
    }
}

impl Clock for CountingClock {
    fn now_ns(&self) -> u64 {
        self.now.set(self.now.get() + self.per_look);
        self.now.get()
    }
}
