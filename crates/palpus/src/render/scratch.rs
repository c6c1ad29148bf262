//! Working memory of the force stage, allocated once.

use crate::force::{FrictionTracker, Linkage, LoadSharing, TiltShares, Tilted};

/// Working memory, and the state of friction between ticks.
#[derive(Clone, Debug)]
pub struct Scratch {
    pub(super) linkage: Linkage,
    pub(super) tilted: Vec<Tilted>,
    pub(super) sharing: LoadSharing,
    /// Tilt shares of one patch at a time.
    pub(super) tilts: TiltShares,
    pub(super) friction: FrictionTracker,
    /// Load of each cluster that limits its friction, N.
    pub(super) loads: Vec<f64>,
}

impl Scratch {
    /// Allocates memory for `capacity` contacts in a tick.
    pub fn new(capacity: usize) -> Self {
        Self {
            linkage: Linkage::new(capacity),
            tilted: Vec::with_capacity(capacity),
            sharing: LoadSharing::new(capacity),
            tilts: TiltShares::new(capacity),
            friction: FrictionTracker::new(capacity),
            loads: Vec::with_capacity(capacity),
        }
    }

    /// Drops the friction state: the next tick begins without friction.
    pub fn clear(&mut self) {
        self.friction.clear();
    }

    /// Returns the state of friction.
    pub fn friction(&self) -> &FrictionTracker {
        &self.friction
    }
}
