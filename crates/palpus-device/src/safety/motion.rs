//! The velocity that damping after a fault may use.
//!
//! The velocity that a device reports may be wrong, because of a driver's filter after a jump, a
//! stuck sensor, or a number that the gate has just refused. Damping against a wrong velocity would
//! push the hand. So damping uses only the *confirmed* part of the reported velocity, which agrees
//! with the poses of the last ticks. It is the component along the mean velocity of these poses,
//! limited to their mean speed. After a tick with an implausible velocity, the confirmed part is
//! zero until new poses show motion.

use glam::DVec3;
use palpus::algebra::{Pose, Twist, rotation_between};

/// Time constant of the mean velocity of the poses, s. An encoder step of 0.03 mm in 1 ms counts as
/// 3 mm/s.
const MEAN_TIME: f64 = 0.01;

/// Mean velocity of the grip, from its poses.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    pose: Option<Pose>,
    mean: Twist,
}

impl Motion {
    /// Takes the grip's `pose`, `elapsed` seconds (more than 0) after the last tick. `blind` is
    /// true if the grip's motion is implausible.
    pub(super) fn follow(&mut self, pose: &Pose, elapsed: f64, blind: bool) {
        if blind {
            *self = Self::default();
            return;
        }
        if let Some(last) = self.pose.replace(*pose) {
            let share = elapsed / (elapsed + MEAN_TIME);
            let linear = (pose.translation - last.translation) / elapsed;
            let angular = rotation_between(last.rotation, pose.rotation) / elapsed;
            self.mean.linear += (linear - self.mean.linear) * share;
            self.mean.angular += (angular - self.mean.angular) * share;
        }
    }

    /// Returns the part of the `stated` velocity that agrees with the poses.
    pub(super) fn confirmed(&self, stated: &Twist) -> Twist {
        Twist {
            linear: confirmed(stated.linear, self.mean.linear),
            angular: confirmed(stated.angular, self.mean.angular),
        }
    }
}

fn confirmed(stated: DVec3, mean: DVec3) -> DVec3 {
    let speed = mean.length();
    if !(speed > 0.0 && speed.is_finite()) {
        return DVec3::ZERO;
    }
    let along = mean / speed;
    along * stated.dot(along).clamp(0.0, speed)
}
