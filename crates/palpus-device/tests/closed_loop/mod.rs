//! Measurements of a simulated hand in a closed loop: whether contact is at rest in it, and the
//! energy it is given.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, rotation_between};
use palpus::render::Limits;
use palpus_device::{DeviceState, SimulationSettings};

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

/// The time since the state before, s, whose time `last` is; the nominal one where time has not
/// gone on, as at the first state.
pub(crate) fn elapsed(state: &DeviceState, last: &mut f64) -> f64 {
    let dt = if state.time > *last { state.time - *last } else { TICK };
    *last = state.time;
    dt
}

/// Root of the mean square of what is above 10 Hz, as a part of the mean, and the mean, N: a mean
/// over a tenth of a second is taken off.
pub(crate) fn cycle(forces: &[DVec3]) -> (f64, f64) {
    const WINDOW: usize = 101;
    let mean = forces.iter().sum::<DVec3>().length() / forces.len() as f64;
    let squares = forces
        .windows(WINDOW)
        .map(|window| (window[WINDOW / 2] - window.iter().sum::<DVec3>() / WINDOW as f64).length_squared());
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    ((sum / f64::from(count)).sqrt() / mean, mean)
}
