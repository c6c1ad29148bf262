//! Working memory of the force stage, allocated once.

use crate::algebra::tolerance::OBJECT_CONTACTS;
use crate::force::{FrictionTracker, Linkage, LoadSharing, TiltShares, Tilted};

/// Working memory, and the state of friction between ticks.
#[derive(Clone, Debug)]
pub struct Scratch {
    pub(super) linkage: Linkage,
    /// Limit of the number of contacts, besides that of the settings.
    pub(super) most: usize,
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
            most: usize::MAX,
            tilted: Vec::with_capacity(capacity),
            sharing: LoadSharing::new(capacity),
            tilts: TiltShares::new(capacity),
            friction: FrictionTracker::new(capacity),
            loads: Vec::with_capacity(capacity),
        }
    }

    /// Allocates memory for `capacity` contacts in a tick of two bodies that no hand holds.
    pub(super) fn of_objects(capacity: usize) -> Self {
        Self { most: OBJECT_CONTACTS, ..Self::new(capacity) }
    }

    /// Drops the friction state: the next tick begins without friction.
    pub fn clear(&mut self) {
        self.friction.clear();
    }
}
