//! All working memory of the force stage, sized once.

use crate::force::{FrictionTracker, Linkage, LoadSharing, TiltShares, Tilted};

/// Working memory, and the adhesions that friction carries from tick to tick.
#[derive(Clone, Debug)]
pub struct Scratch {
    pub(super) linkage: Linkage,
    pub(super) tilted: Vec<Tilted>,
    pub(super) sharing: LoadSharing,
    /// Tilt shares of one patch at a time.
    pub(super) tilts: TiltShares,
    pub(super) friction: FrictionTracker,
    /// N: what the friction of each cluster rests on.
    pub(super) loads: Vec<f64>,
}

impl Scratch {
    /// Memory for `capacity` contacts a tick.
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
}
