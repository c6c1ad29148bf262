//! A free body, which moves under gravity, contact and friction.
//!
//! Its state is the momentum, not the velocity. The impulse that contacts add to one body is
//! subtracted from the other body exactly. So the total momentum is conserved, and a body that
//! tumbles freely needs no gyroscopic term.

use glam::{DMat3, DQuat, DVec3};

use super::super::reach::Reach;
use super::stillness::Stillness;
use crate::algebra::{Pose, SpatialMatrix, Twist, Wrench};
use crate::body::Body;

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free {
    /// Mass, kg.
    pub(super) mass: f64,
    /// Inertia about the centre of mass, along the body's axes, kg·m².
    inertia: DMat3,
    /// Inertia per kilogram along the body's axes, m². Its determinant cannot overflow or vanish
    /// for any mass.
    gyration: DMat3,
    /// Momentum, N·s, and N·m·s about the centre of mass.
    pub(super) momentum: Wrench,
    pub(super) reach: Reach,
    pub(super) stillness: Stillness,
}

impl Free {
    /// Returns a body of `mass` (kg) at rest. Contacts push below a separation of `contact_offset`
    /// (m).
    pub(super) fn new(body: &Body, mass: f64, contact_offset: f64) -> Self {
        let properties = body.mass();
        Self {
            mass,
            inertia: properties.inertia * (mass / properties.volume),
            gyration: properties.inertia * properties.volume.recip(),
            momentum: Wrench::ZERO,
            reach: Reach::new(body, contact_offset, 0.0),
            stillness: Stillness::NONE,
        }
    }

    /// Returns the matrix and right-hand side of a step of `h` s without contacts. The unknown is
    /// the velocity at the end of the step.
    pub(super) fn begin(&self, pose: &Pose, gravity: DVec3, h: f64) -> (SpatialMatrix, Wrench) {
        let weight = Wrench { torque: DVec3::ZERO, force: gravity * (self.mass * h) };
        (SpatialMatrix::of_body(self.mass, self.inertia_at(pose)), self.momentum + weight)
    }

    /// Returns the velocity for the present momentum.
    pub(super) fn twist(&self, pose: &Pose) -> Twist {
        let rotation = DMat3::from_quat(pose.rotation);
        let per_mass = rotation.transpose() * (self.momentum.torque / self.mass);
        let angular = rotation * (self.gyration.inverse() * per_mass);
        Twist { angular, linear: self.momentum.force / self.mass }
    }

    /// Sets the momentum from a velocity. Returns false, and changes nothing, if the momentum is
    /// not finite.
    pub(super) fn set_twist(&mut self, pose: &Pose, twist: &Twist) -> bool {
        let momentum = Wrench { torque: self.inertia_at(pose) * twist.angular, force: twist.linear * self.mass };
        let is_finite = momentum.is_finite();
        if is_finite {
            self.momentum = momentum;
        }
        is_finite
    }

    /// Returns the pose after `h` s with `twist`; `center` is the centre of mass in the body's
    /// frame.
    pub(super) fn moved(pose: &Pose, center: DVec3, twist: &Twist, h: f64) -> Pose {
        let rotation = (DQuat::from_scaled_axis(twist.angular * h) * pose.rotation).normalize();
        let center_after = pose.point(center) + twist.linear * h;
        Pose { rotation, translation: center_after - rotation * center }
    }

    fn inertia_at(&self, pose: &Pose) -> DMat3 {
        let rotation = DMat3::from_quat(pose.rotation);
        rotation * self.inertia * rotation.transpose()
    }
}
