//! Blending: other settings of the engine do not make a step of the wrench.
//!
//! In the tick in which the settings are new, the wrench is as it was in the tick before; in
//! [`TIME`] the difference fades out. It fades with the contact as well: when the new wrench falls,
//! because the hand leaves the surface, the difference falls by the same share, so that nothing
//! pulls the hand back. Force and torque are blended each by itself.

use glam::DVec3;
use palpus::algebra::Wrench;

/// s: a quarter of a second, as from engagement to the full wrench.
const TIME: f64 = 0.25;
/// The difference follows the contact unless it is so many times the new wrench, which then says
/// little of the contact.
const LARGEST_RATIO: f64 = 3.0;

/// Remaining difference from the wrench under the last settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blend {
    /// The wrench of the last tick.
    last: Wrench,
    force: Offset,
    torque: Offset,
    /// s of the blending that are left.
    left: f64,
}

/// From the new force (or torque) to the old one.
#[derive(Clone, Copy, Debug, Default)]
struct Offset {
    by: DVec3,
    /// Size of the difference when the new one began.
    size: f64,
}

impl Blend {
    pub(super) fn new() -> Self {
        Self { last: Wrench::ZERO, force: Offset::default(), torque: Offset::default(), left: 0.0 }
    }

    /// True if [`Self::apply`] would change a wrench.
    pub(super) fn is_under_way(&self, changed: bool) -> bool {
        changed || self.left > 0.0
    }

    /// Returns the wrench for this tick. `changed`: it is the first one of other settings.
    pub(super) fn apply(&mut self, wrench: &Wrench, changed: bool) -> Wrench {
        if changed {
            self.force = Offset { by: self.last.force - wrench.force, size: wrench.force.length() };
            self.torque = Offset { by: self.last.torque - wrench.torque, size: wrench.torque.length() };
            self.left = TIME;
        }
        let share = self.left / TIME;
        Wrench {
            force: wrench.force + self.force.at(wrench.force) * share,
            torque: wrench.torque + self.torque.at(wrench.torque) * share,
        }
    }

    /// A tick of `dt` seconds ends, in which the wrench was this.
    pub(super) fn end_of_tick(&mut self, wrench: &Wrench, dt: f64) {
        self.last = *wrench;
        self.left = (self.left - dt).max(0.0);
    }

    /// Nothing is engaged: there is nothing to go on from.
    pub(super) fn reset(&mut self, wrench: &Wrench) {
        *self = Self { last: *wrench, ..Self::new() };
    }
}

impl Offset {
    fn at(&self, now: DVec3) -> DVec3 {
        let follows = self.by.length() <= LARGEST_RATIO * self.size && self.size > 0.0;
        if follows { self.by * (now.length() / self.size).min(1.0) } else { self.by }
    }
}
