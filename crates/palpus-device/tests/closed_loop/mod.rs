//! The energy that a simulated operator receives in a closed loop.

use palpus::algebra::{Pose, Wrench, rotation_between};
use palpus::render::Limits;
use palpus_device::SimulationSettings;

/// Nominal period of the loop, s.
pub(crate) const TICK: f64 = 1e-3;

/// Returns the limits of the simulated device.
pub(crate) fn limits() -> Limits {
    let spec = SimulationSettings::default().spec;
    Limits { force: spec.force_max, torque: spec.torque_max }
}

/// Net work on a hand, from the true wrench and the true motion.
#[derive(Clone, Copy, Default)]
pub(crate) struct HandWork {
    last: Option<(Pose, Wrench)>,
    /// Work done on the hand so far, J.
    pub(crate) given: f64,
    /// Largest value of `given` at any time, J.
    pub(crate) most: f64,
}

impl HandWork {
    /// Adds the work of the acting wrench up to `pose`.
    pub(crate) fn moved_to(&mut self, pose: &Pose) {
        if let Some((before, acted)) = self.last {
            self.given += acted.force.dot(pose.translation - before.translation);
            self.given += acted.torque.dot(rotation_between(before.rotation, pose.rotation));
            self.most = self.most.max(self.given);
        }
    }

    /// Sets the wrench that acts from `pose` on.
    pub(crate) fn act(&mut self, pose: Pose, wrench: Wrench) {
        self.last = Some((pose, wrench));
    }
}
