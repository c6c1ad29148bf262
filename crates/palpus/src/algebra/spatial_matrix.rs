//! 6 × 6 matrices that map velocities of a rigid body to wrenches: inertias, stiffnesses, dampings.

use glam::{DMat3, DVec3};

use super::{Twist, Wrench};

/// A matrix that maps twists to wrenches, as four blocks. Both have the same frame. They also have
/// the same reference point, except where a function states otherwise.
///
/// Inertias, springs and dampers are symmetric. A force whose size depends on the motion along
/// another direction is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialMatrix {
    torque_turning: DMat3,
    torque_moving: DMat3,
    force_turning: DMat3,
    force_moving: DMat3,
}

impl SpatialMatrix {
    /// The zero matrix.
    pub const ZERO: Self = Self {
        torque_turning: DMat3::ZERO,
        torque_moving: DMat3::ZERO,
        force_turning: DMat3::ZERO,
        force_moving: DMat3::ZERO,
    };

    /// Returns the inertia of a rigid body about its centre of mass. `mass` is in kg; `inertia` is
    /// in kg·m², along the axes of the frame.
    pub fn of_body(mass: f64, inertia: DMat3) -> Self {
        Self { torque_turning: inertia, force_moving: DMat3::from_diagonal(DVec3::splat(mass)), ..Self::ZERO }
    }

    /// Adds the matrix that maps a twist to `wrench` times the power of `gauge` in this twist.
    pub fn add_product(&mut self, wrench: &Wrench, gauge: &Wrench) {
        self.torque_turning += outer(wrench.torque, gauge.torque);
        self.torque_moving += outer(wrench.torque, gauge.force);
        self.force_turning += outer(wrench.force, gauge.torque);
        self.force_moving += outer(wrench.force, gauge.force);
    }

    /// Adds a spring or damper of strength `c` that acts along the unit vector `direction`, at
    /// `offset` from the reference point.
    pub fn add_along(&mut self, direction: DVec3, offset: DVec3, c: f64) {
        let gauge = Wrench::of_force_at(direction, offset);
        self.add_product(&(gauge * c), &gauge);
    }

    /// Adds an isotropic spring or damper of strength `c` that acts on translation, at `offset`
    /// from the reference point.
    pub fn add_at(&mut self, offset: DVec3, c: f64) {
        let cross = cross_matrix(offset);
        self.torque_turning += cross * cross.transpose() * c;
        self.torque_moving += cross * c;
        self.force_turning += cross.transpose() * c;
        self.force_moving += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Adds an isotropic spring or damper of strength `c` that acts on rotation.
    pub fn add_turning(&mut self, c: f64) {
        self.torque_turning += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Returns this matrix for the twist of another body. This matrix's reference point lies at
    /// `offset` from the reference point of that twist.
    pub fn from_twist_at(&self, offset: DVec3) -> Self {
        let cross = cross_matrix(offset);
        Self {
            torque_turning: self.torque_turning - self.torque_moving * cross,
            force_turning: self.force_turning - self.force_moving * cross,
            ..*self
        }
    }

    /// Returns this matrix for the wrench on another body. This matrix's reference point lies at
    /// `offset` from the reference point of that wrench.
    pub fn to_wrench_at(&self, offset: DVec3) -> Self {
        let cross = cross_matrix(offset);
        Self {
            torque_turning: self.torque_turning + cross * self.force_turning,
            torque_moving: self.torque_moving + cross * self.force_moving,
            ..*self
        }
    }

    /// Returns the product of the matrix and `twist`.
    pub fn times(&self, twist: &Twist) -> Wrench {
        let Twist { angular, linear } = *twist;
        Wrench {
            torque: self.torque_turning * angular + self.torque_moving * linear,
            force: self.force_turning * angular + self.force_moving * linear,
        }
    }

    /// Returns the inverse of the matrix; `None` if a block of the elimination is singular.
    ///
    /// The method eliminates translation first, and then inverts the Schur complement of rotation.
    pub fn inverse(&self) -> Option<SpatialInverse> {
        if self.force_moving.determinant() == 0.0 {
            return None;
        }
        let moving = self.force_moving.inverse();
        let (carried, carrying) = (self.torque_moving * moving, moving * self.force_turning);
        let left = self.torque_turning - carried * self.force_turning;
        if left.determinant() == 0.0 {
            return None;
        }
        let turning = left.inverse();
        (turning.is_finite() && moving.is_finite()).then_some(SpatialInverse { turning, carried, carrying, moving })
    }

    /// Returns the twist for which the product is `wrench`; `None` as in [`Self::inverse`].
    pub fn solve(&self, wrench: &Wrench) -> Option<Twist> {
        let twist = self.inverse()?.times(wrench);
        twist.is_finite().then_some(twist)
    }
}

/// The inverse of a [`SpatialMatrix`]: it maps wrenches to twists.
#[derive(Clone, Copy, Debug)]
pub struct SpatialInverse {
    /// Inverse of the Schur complement of rotation.
    turning: DMat3,
    /// Torque for each force, where nothing turns.
    carried: DMat3,
    /// Velocity against each angular velocity, where no force acts.
    carrying: DMat3,
    /// Inverse of the block of translation.
    moving: DMat3,
}

impl SpatialInverse {
    /// Returns the product of the inverse and `wrench`.
    pub fn times(&self, wrench: &Wrench) -> Twist {
        let angular = self.turning * (wrench.torque - self.carried * wrench.force);
        Twist { angular, linear: self.moving * wrench.force - self.carrying * angular }
    }

    /// Returns the product of `matrix`, this inverse and `other`.
    pub fn between(&self, matrix: &SpatialMatrix, other: &SpatialMatrix) -> SpatialMatrix {
        let angular = |torque: DMat3, force: DMat3| self.turning * (torque - self.carried * force);
        let turning = angular(other.torque_turning, other.force_turning);
        let turning_moving = angular(other.torque_moving, other.force_moving);
        let linear = self.moving * other.force_turning - self.carrying * turning;
        let linear_moving = self.moving * other.force_moving - self.carrying * turning_moving;
        SpatialMatrix {
            torque_turning: matrix.torque_turning * turning + matrix.torque_moving * linear,
            torque_moving: matrix.torque_turning * turning_moving + matrix.torque_moving * linear_moving,
            force_turning: matrix.force_turning * turning + matrix.force_moving * linear,
            force_moving: matrix.force_turning * turning_moving + matrix.force_moving * linear_moving,
        }
    }
}

impl std::ops::Add for SpatialMatrix {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            torque_turning: self.torque_turning + other.torque_turning,
            torque_moving: self.torque_moving + other.torque_moving,
            force_turning: self.force_turning + other.force_turning,
            force_moving: self.force_moving + other.force_moving,
        }
    }
}

impl std::ops::Sub for SpatialMatrix {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            torque_turning: self.torque_turning - other.torque_turning,
            torque_moving: self.torque_moving - other.torque_moving,
            force_turning: self.force_turning - other.force_turning,
            force_moving: self.force_moving - other.force_moving,
        }
    }
}

/// Returns the matrix a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Returns the matrix of the cross product with `r` on the left.
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
    fn spring_acts_on_velocity_of_its_point() {
        let mut along = SpatialMatrix::ZERO;
        along.add_along(N, R, 40.0);
        let velocity = TWIST.at(R);
        assert!(near(&along.times(&TWIST), &Wrench::of_force_at(N * (40.0 * velocity.dot(N)), R)));
        let mut at = SpatialMatrix::ZERO;
        at.add_at(R, 40.0);
        at.add_turning(3.0);
        let turning = Wrench { torque: TWIST.angular * 3.0, force: DVec3::ZERO };
        let expected = Wrench::of_force_at(velocity * 40.0, R) + turning;
        assert!(near(&at.times(&TWIST), &expected));
    }

    /// Returns a matrix that is not symmetric.
    fn matrix() -> SpatialMatrix {
        let mut matrix = SpatialMatrix::of_body(0.02, DMat3::from_diagonal(DVec3::new(1e-5, 2e-5, 1.5e-5)));
        matrix.add_at(R, 1e-3);
        matrix.add_turning(1e-6);
        matrix.add_along(N, -R, 5e-3);
        matrix.add_product(&Wrench::of_force_at(N * 2e-3, R), &Wrench::of_force_at(DVec3::Y, -R));
        matrix
    }

    #[test]
    fn matrices_of_other_reference_points_describe_the_same_force() {
        let spring = matrix();
        let offset = DVec3::new(-0.4, 0.1, 0.2);
        let seen = Twist { angular: TWIST.angular, linear: TWIST.at(offset) };
        let expected = spring.times(&seen);
        assert!(near(&spring.from_twist_at(offset).times(&TWIST), &expected));
        assert!(near(&spring.to_wrench_at(offset).times(&seen), &expected.about(-offset)));
    }

    #[test]
    fn solve_is_the_inverse_of_times() {
        let matrix = matrix();
        let twist = matrix.solve(&matrix.times(&TWIST)).expect("not singular");
        assert!((twist.angular - TWIST.angular).length() < 1e-10 && (twist.linear - TWIST.linear).length() < 1e-11);
    }

    #[test]
    fn between_is_the_product_of_three() {
        let (matrix, mut other) = (matrix(), SpatialMatrix::ZERO);
        other.add_product(&Wrench::of_force_at(N, -R), &Wrench::of_force_at(DVec3::X, R));
        other.add_at(R, 0.3);
        let inverse = matrix.inverse().expect("not singular");
        let expected = other.times(&inverse.times(&matrix.times(&TWIST)));
        assert!(near(&inverse.between(&other, &matrix).times(&TWIST), &expected));
    }

    #[test]
    fn singular_matrices_have_no_solution() {
        let mut matrix = SpatialMatrix::ZERO;
        assert_eq!(matrix.solve(&Wrench::ZERO), None);
        matrix.add_along(N, R, 1.0);
        assert_eq!(matrix.solve(&Wrench::of_force_at(N, R)), None);
    }
}
