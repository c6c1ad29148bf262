//! Removes the step of the wrench at a change of settings: the wrench fades from the old to the new
//! value.
//!
//! In the tick of the change, the wrench stays as in the previous tick. The difference from the new
//! wrench then fades out within [`TIME`]. If the new wrench falls because the hand leaves the
//! surface, the difference falls in proportion, so that it does not pull the hand back. Force and
//! torque are treated separately.

use glam::DVec3;
use palpus::algebra::Wrench;

/// Time of the fade, s: as long as the ramp from zero to the full wrench at a start-up.
const TIME: f64 = 0.25;
/// The difference falls in proportion to the new wrench only if its size is at most this
/// multiple of the new wrench. A small new wrench says little about the contact.
const LARGEST_RATIO: f64 = 3.0;

/// The remaining difference from the wrench under the old settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blend {
    /// The wrench of the last tick.
    last: Wrench,
    force: Offset,
    torque: Offset,
    /// Remaining time of the fade, s.
    left: f64,
}

/// Difference from the new to the old force (or torque).
#[derive(Clone, Copy, Debug, Default)]
struct Offset {
    by: DVec3,
    /// Size of the new force (or torque) when the fade began.
    size: f64,
}

impl Blend {
    pub(super) fn new() -> Self {
        Self { last: Wrench::ZERO, force: Offset::default(), torque: Offset::default(), left: 0.0 }
    }

    /// Returns true if [`Self::apply`] would change a wrench.
    pub(super) fn is_under_way(&self, changed: bool) -> bool {
        changed || self.left > 0.0
    }

    /// Returns the wrench for this tick. `changed` is true in the first tick with new settings.
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

    /// Ends a tick of `dt` seconds with this wrench.
    pub(super) fn end_of_tick(&mut self, wrench: &Wrench, dt: f64) {
        self.last = *wrench;
        self.left = (self.left - dt).max(0.0);
    }

    /// Ends the fade while the device is not engaged.
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
