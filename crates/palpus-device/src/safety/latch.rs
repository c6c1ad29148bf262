//! The latch: after repeated faults, the device gives no force until the user presses a button or
//! key.
//!
//! A fault lasts from the loss of the force until the force may return. A fault counts once,
//! however many ticks and causes it has.

use super::Rearm;

/// Number of faults within [`TIME`] at which the device latches.
const FAULTS: usize = 3;
/// Time within which these faults are counted, s.
const TIME: f64 = 10.0;

/// Times of the last faults.
#[derive(Clone, Debug)]
pub(super) struct Latch {
    rearm: Rearm,
    /// Time since the start, s.
    now: f64,
    /// Times of the last faults, s, newest first; minus infinity for no fault.
    faults: [f64; FAULTS],
}

impl Latch {
    pub(super) fn new(rearm: Rearm) -> Self {
        Self { rearm, now: 0.0, faults: [f64::NEG_INFINITY; FAULTS] }
    }

    /// Advances by a tick of `dt` seconds.
    pub(super) fn advance(&mut self, dt: f64) {
        self.now += dt;
    }

    /// Counts a fault. Returns true if the device must latch.
    pub(super) fn count(&mut self) -> bool {
        self.faults.rotate_right(1);
        self.faults[0] = self.now;
        self.rearm == Rearm::ByPerson && self.now - self.faults[FAULTS - 1] <= TIME
    }

    /// Empties the list of faults, when the user enables the device again.
    pub(super) fn clear(&mut self) {
        self.faults = [f64::NEG_INFINITY; FAULTS];
    }
}
