//! A simulated hand in a closed loop: the energy it is given.

use palpus::algebra::{Pose, Wrench, rotation_between};
use palpus::render::Limits;
use palpus_device::SimulationSettings;

/// s: the loop's, nominally.
pub(crate) const TICK: f64 = 1e-3;

/// Limits of the simulated device.
pub(crate) fn limits() -> Limits {
    let spec = SimulationSettings::default().spec;
    Limits { force: spec.force_max, torque: spec.torque_max }
}

/// The net work on a hand, by what truly acted over what truly moved.
#[derive(Clone, Copy, Default)]
pub(crate) struct HandWork {
    last: Option<(Pose, Wrench)>,
    /// J.
    pub(crate) given: f64,
    /// The most at any time, J.
    pub(crate) most: f64,
}

impl HandWork {
    /// The hand has come to `pose` under the wrench that acted last.
    pub(crate) fn moved_to(&mut self, pose: &Pose) {
        if let Some((before, acted)) = self.last {
            self.given += acted.force.dot(pose.translation - before.translation);
            self.given += acted.torque.dot(rotation_between(before.rotation, pose.rotation));
            self.most = self.most.max(self.given);
        }
    }

    /// From `pose` on, `wrench` acts.
    pub(crate) fn act(&mut self, pose: Pose, wrench: Wrench) {
        self.last = Some((pose, wrench));
    }
}
