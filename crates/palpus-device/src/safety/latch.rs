//! The latch: a device that faults again and again gives no force until a person asks for it.
//!
//! A fault is one from when the force goes until it might come back, however many ticks and reasons
//! it has.

use super::Rearm;

/// So many faults
const FAULTS: usize = 3;
/// within so many s.
const TIME: f64 = 10.0;

/// When the last faults were.
#[derive(Clone, Debug)]
pub(super) struct Latch {
    rearm: Rearm,
    /// s since the start.
    now: f64,
    /// Times of the faults, the newest first; minus infinity for none.
    faults: [f64; FAULTS],
}

impl Latch {
    pub(super) fn new(rearm: Rearm) -> Self {
        Self { rearm, now: 0.0, faults: [f64::NEG_INFINITY; FAULTS] }
    }

    /// A tick of `dt` seconds.
    pub(super) fn advance(&mut self, dt: f64) {
        self.now += dt;
    }

    /// A fault has taken the force away. True if it is to stay away until a person asks for it.
    pub(super) fn count(&mut self) -> bool {
        self.faults.rotate_right(1);
        self.faults[0] = self.now;
        self.rearm == Rearm::ByPerson && self.now - self.faults[FAULTS - 1] <= TIME
    }

    /// A person has asked for force.
    pub(super) fn forget(&mut self) {
        self.faults = [f64::NEG_INFINITY; FAULTS];
    }
}
