//! Symmetric 6 × 6 matrices that turn velocities of a rigid body into wrenches: inertias, stiffnesses, dampings.

use glam::{DMat3, DVec3};

use super::{Twist, Wrench};

/// A symmetric matrix from twists to wrenches, both about one and the same point, in one frame.
///
/// Kept as three blocks: torque from turning, torque from moving (its transpose is force from turning), force from moving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialMatrix {
    torque_turning: DMat3,
    torque_moving: DMat3,
    force_moving: DMat3,
}

impl SpatialMatrix {
    /// Nothing.
    pub const ZERO: Self = Self { torque_turning: DMat3::ZERO, torque_moving: DMat3::ZERO, force_moving: DMat3::ZERO };

    /// The inertia of a rigid body about its centre of mass: kg, and kg·m² in the axes of the frame.
    pub fn of_body(mass: f64, inertia: DMat3) -> Self {
        Self {
            torque_turning: inertia,
            torque_moving: DMat3::ZERO,
            force_moving: DMat3::from_diagonal(DVec3::splat(mass)),
        }
    }

    /// Adds a spring or damper of strength `c` that acts along the unit vector `direction` at `offset` from the point.
    pub fn add_along(&mut self, direction: DVec3, offset: DVec3, c: f64) {
        let turning = offset.cross(direction);
        self.torque_turning += outer(c * turning, turning);
        self.torque_moving += outer(c * turning, direction);
        self.force_moving += outer(c * direction, direction);
    }

    /// Adds a spring or damper of strength `c` that acts alike in all directions at `offset` from the point.
    pub fn add_at(&mut self, offset: DVec3, c: f64) {
        let cross = cross_matrix(offset);
        self.torque_turning += cross * cross.transpose() * c;
        self.torque_moving += cross * c;
        self.force_moving += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Adds a spring or damper against turning, alike about all axes.
    pub fn add_turning(&mut self, c: f64) {
        self.torque_turning += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Adds a spring or damper of strength `c` against turning about the unit vector `axis`.
    pub fn add_turning_about(&mut self, axis: DVec3, c: f64) {
        self.torque_turning += outer(c * axis, axis);
    }

    /// The wrench that belongs to `twist`.
    pub fn times(&self, twist: &Twist) -> Wrench {
        let Twist { angular, linear } = *twist;
        Wrench {
            torque: self.torque_turning * angular + self.torque_moving * linear,
            force: self.torque_moving.transpose() * angular + self.force_moving * linear,
        }
    }

    /// The twist to which `wrench` belongs; `None` if the matrix is not positive definite, by rounding or by nature.
    ///
    /// Moving is eliminated first, turning by its Schur complement.
    pub fn solve(&self, wrench: &Wrench) -> Option<Twist> {
        if self.force_moving.determinant() <= 0.0 {
            return None;
        }
        let moving = self.force_moving.inverse();
        let carried = self.torque_moving * moving;
        let turning = self.torque_turning - carried * self.torque_moving.transpose();
        if turning.determinant() <= 0.0 {
            return None;
        }
        let angular = turning.inverse() * (wrench.torque - carried * wrench.force);
        let linear = moving * (wrench.force - self.torque_moving.transpose() * angular);
        (angular.is_finite() && linear.is_finite()).then_some(Twist { angular, linear })
    }
}

impl std::ops::Add for SpatialMatrix {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            torque_turning: self.torque_turning + other.torque_turning,
            torque_moving: self.torque_moving + other.torque_moving,
            force_moving: self.force_moving + other.force_moving,
        }
    }
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The matrix of r × ….
fn cross_matrix(r: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, r.z, -r.y), DVec3::new(-r.z, 0.0, r.x), DVec3::new(r.y, -r.x, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: DVec3 = DVec3::new(0.03, -0.02, 0.05);
    const N: DVec3 = DVec3::new(0.6, 0.0, 0.8);
    const TWIST: Twist = Twist { angular: DVec3::new(1.0, -2.0, 0.5), linear: DVec3::new(0.1, 0.3, -0.2) };

    fn near(one: &Wrench, other: &Wrench) -> bool {
        (one.torque - other.torque).length() < 1e-12 && (one.force - other.force).length() < 1e-12
    }

    #[test]
    fn a_spring_answers_to_the_velocity_of_its_point() {
        let mut along = SpatialMatrix::ZERO;
        along.add_along(N, R, 40.0);
        let velocity = TWIST.at(R);
        assert!(near(&along.times(&TWIST), &Wrench::of_force_at(N * (40.0 * velocity.dot(N)), R)));
        let mut at = SpatialMatrix::ZERO;
        at.add_at(R, 40.0);
        at.add_turning(3.0);
        at.add_turning_about(N, 2.0);
        let twisting = Wrench { torque: N * (2.0 * TWIST.angular.dot(N)), force: DVec3::ZERO };
        let expected = twisting
            + Wrench::of_force_at(velocity * 40.0, R)
            + Wrench { torque: TWIST.angular * 3.0, force: DVec3::ZERO };
        assert!(near(&at.times(&TWIST), &expected));
    }

    #[test]
    fn solving_undoes_multiplying() {
        let mut matrix = SpatialMatrix::of_body(0.02, DMat3::from_diagonal(DVec3::new(1e-5, 2e-5, 1.5e-5)));
        matrix.add_at(R, 1e-3);
        matrix.add_turning(1e-6);
        matrix.add_along(N, -R, 5e-3);
        let twist = matrix.solve(&matrix.times(&TWIST)).expect("positive definite");
        assert!((twist.angular - TWIST.angular).length() < 1e-10 && (twist.linear - TWIST.linear).length() < 1e-11);
    }

    #[test]
    fn what_cannot_be_solved_is_said() {
        let mut matrix = SpatialMatrix::ZERO;
        assert_eq!(matrix.solve(&Wrench::ZERO), None);
        matrix.add_along(N, R, 1.0);
        assert_eq!(matrix.solve(&Wrench::of_force_at(N, R)), None);
    }
}
