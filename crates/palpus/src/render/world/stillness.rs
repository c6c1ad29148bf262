//! How long a free body has been still.

use glam::{DQuat, DVec3};

use crate::algebra::rotation_between;

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stillness {
    /// The body's centre of mass and its rotation when it began to be still.
    from: (DVec3, DQuat),
    /// Time since then, s.
    since: f64,
    pub(super) is_asleep: bool,
}

impl Stillness {
    /// A body that has just moved.
    pub(super) const NONE: Self = Self { from: (DVec3::NAN, DQuat::IDENTITY), since: 0.0, is_asleep: false };

    /// Looks at the body after a step of `h` s. `radius` (m) is the largest distance of a point
    /// from its centre of mass, and a point that moves up to `most` (m) is still.
    pub(super) fn look(&mut self, (center, rotation): (DVec3, DQuat), radius: f64, most: f64, h: f64) {
        let turn = rotation_between(self.from.1, rotation).length();
        let is_still = center.distance(self.from.0) + turn * radius <= most;
        *self = if is_still {
            Self { since: self.since + h, ..*self }
        } else {
            Self { from: (center, rotation), ..Self::NONE }
        };
    }

    /// Returns the time for which the body has been still, s.
    pub(super) fn since(&self) -> f64 {
        self.since
    }
}
