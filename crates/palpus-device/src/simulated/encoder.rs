//! Model of a device's encoders.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};

use palpus::algebra::{rotation_between, rotation_vector};

/// Resolution of the encoders, and the filter of the velocities derived from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Smallest step of each coordinate, m; 0 means exact.
    pub position_quantum: f64,
    /// Smallest step of each component of the rotation vector, rad; 0 means exact.
    pub angle_quantum: f64,
    /// Cut-off frequency of the first-order low-pass filter on the position differences, Hz; `None`
    /// means no filter.
    pub velocity_cutoff_hz: Option<f64>,
}

impl Encoder {
    /// A fine arm: 0.03 mm, about 0.015°, velocities filtered at 100 Hz.
    pub const TYPICAL: Self =
        Self { position_quantum: 0.03e-3, angle_quantum: 2.5e-4, velocity_cutoff_hz: Some(100.0) };
    /// No rounding and no filter; velocities are still position differences.
    pub const EXACT: Self = Self { position_quantum: 0.0, angle_quantum: 0.0, velocity_cutoff_hz: None };

    /// Returns the pose as the encoders report it.
    pub(super) fn sense(&self, pose: &Pose) -> Pose {
        let rotation = if self.angle_quantum > 0.0 {
            DQuat::from_scaled_axis(round_to(rotation_vector(pose.rotation), self.angle_quantum))
        } else {
            pose.rotation
        };
        Pose { rotation, translation: round_to(pose.translation, self.position_quantum) }
    }

    /// Returns the next velocity estimate, from two sensed poses `period` seconds apart and the
    /// `previous` estimate.
    pub(super) fn estimate(&self, previous: &Twist, from: &Pose, to: &Pose, period: f64) -> Twist {
        let share = match self.velocity_cutoff_hz {
            Some(hertz) => 1.0 - (-std::f64::consts::TAU * hertz * period).exp(),
            None => 1.0,
        };
        let linear = (to.translation - from.translation) / period;
        let angular = rotation_between(from.rotation, to.rotation) / period;
        Twist {
            angular: previous.angular + (angular - previous.angular) * share,
            linear: previous.linear + (linear - previous.linear) * share,
        }
    }
}

fn round_to(v: DVec3, quantum: f64) -> DVec3 {
    if quantum > 0.0 { (v / quantum).round() * quantum } else { v }
}
