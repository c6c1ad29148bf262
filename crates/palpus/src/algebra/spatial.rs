//! Spatial vectors: velocities and forces of rigid bodies.

use glam::DVec3;

use super::Pose;

/// The velocity of a rigid body: angular in rad/s, and linear in m/s at a reference point. Each use
/// states its reference point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Twist {
    /// Angular velocity, rad/s.
    pub angular: DVec3,
    /// Velocity of the reference point, m/s.
    pub linear: DVec3,
}

impl Twist {
    /// Returns the velocity (m/s) of the body's point at `offset` from the reference point.
    pub fn at(&self, offset: DVec3) -> DVec3 {
        self.linear + self.angular.cross(offset)
    }

    /// Returns true if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.angular.is_finite() && self.linear.is_finite()
    }
}

/// A force in newtons, and a torque in newton-metres about a reference point. Each use states its
/// reference point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// Torque about the reference point, N·m.
    pub torque: DVec3,
    /// Force, N.
    pub force: DVec3,
}

impl Wrench {
    /// No force and no torque.
    pub const ZERO: Self = Self { torque: DVec3::ZERO, force: DVec3::ZERO };

    /// Returns the wrench of a `force` that acts at `offset` from the reference point.
    pub fn of_force_at(force: DVec3, offset: DVec3) -> Self {
        Self { torque: offset.cross(force), force }
    }

    /// Returns this wrench about another reference point, which lies at `offset` from the current
    /// one.
    pub fn about(&self, offset: DVec3) -> Self {
        Self { torque: self.torque - offset.cross(self.force), force: self.force }
    }

    /// Returns this wrench in the outer frame of `pose`. `pose` places the current frame in the
    /// outer frame. The reference point does not change.
    pub fn rotated(&self, pose: &Pose) -> Self {
        Self { torque: pose.vector(self.torque), force: pose.vector(self.force) }
    }

    /// Returns the power (W) that the wrench gives to a body that moves with `twist`. Both must
    /// have the same reference point.
    pub fn power(&self, twist: &Twist) -> f64 {
        self.force.dot(twist.linear) + self.torque.dot(twist.angular)
    }

    /// Returns true if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }
}

impl std::ops::Mul<f64> for Twist {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { angular: self.angular * factor, linear: self.linear * factor }
    }
}

impl std::ops::Add for Twist {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl std::ops::Sub for Twist {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }
}

impl std::ops::Mul<f64> for Wrench {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { torque: self.torque * factor, force: self.force * factor }
    }
}

impl std::ops::Add for Wrench {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { torque: self.torque + other.torque, force: self.force + other.force }
    }
}

impl std::ops::Neg for Wrench {
    type Output = Self;

    fn neg(self) -> Self {
        Self { torque: -self.torque, force: -self.force }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_does_not_depend_on_the_reference_point() {
        let offset = DVec3::new(0.1, -0.4, 0.25);
        let wrench = Wrench { torque: DVec3::new(0.3, 0.1, -0.2), force: DVec3::new(1.0, 2.0, -3.0) };
        let twist = Twist { angular: DVec3::new(-1.0, 0.5, 2.0), linear: DVec3::new(0.2, 0.0, 0.7) };
        let moved = Twist { angular: twist.angular, linear: twist.at(offset) };
        assert!((wrench.power(&twist) - wrench.about(offset).power(&moved)).abs() < 1e-14);
    }
}
