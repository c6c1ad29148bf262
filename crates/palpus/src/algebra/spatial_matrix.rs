//! Symmetric 6 × 6 matrices that map velocities of a rigid body to wrenches: inertias, stiffnesses,
//! dampings.

use glam::{DMat3, DVec3};

use super::{Twist, Wrench};

/// A symmetric matrix that maps twists to wrenches. Both have the same reference point and frame.
///
/// The matrix is stored as three blocks: torque from rotation, torque from translation, and force
/// from translation. The transpose of the second block gives the force from rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialMatrix {
    torque_turning: DMat3,
    torque_moving: DMat3,
    force_moving: DMat3,
}

impl SpatialMatrix {
    /// The zero matrix.
    pub const ZERO: Self = Self { torque_turning: DMat3::ZERO, torque_moving: DMat3::ZERO, force_moving: DMat3::ZERO };

    /// Returns the inertia of a rigid body about its centre of mass. `mass` is in kg; `inertia` is
    /// in kg·m², along the axes of the frame.
    pub fn of_body(mass: f64, inertia: DMat3) -> Self {
        Self {
            torque_turning: inertia,
            torque_moving: DMat3::ZERO,
            force_moving: DMat3::from_diagonal(DVec3::splat(mass)),
        }
    }

    /// Adds a spring or damper of strength `c` that acts along the unit vector `direction`, at
    /// `offset` from the reference point.
    pub fn add_along(&mut self, direction: DVec3, offset: DVec3, c: f64) {
        let turning = offset.cross(direction);
        self.torque_turning += outer(c * turning, turning);
        self.torque_moving += outer(c * turning, direction);
        self.force_moving += outer(c * direction, direction);
    }

    /// Adds an isotropic spring or damper of strength `c` that acts on translation, at `offset`
    /// from the reference point.
    pub fn add_at(&mut self, offset: DVec3, c: f64) {
        let cross = cross_matrix(offset);
        self.torque_turning += cross * cross.transpose() * c;
        self.torque_moving += cross * c;
        self.force_moving += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Adds an isotropic spring or damper of strength `c` that acts on rotation.
    pub fn add_turning(&mut self, c: f64) {
        self.torque_turning += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Returns this matrix about another reference point. The current reference point lies at
    /// `offset` from the new one.
    pub fn about(&self, offset: DVec3) -> Self {
        let cross = cross_matrix(offset);
        let moving = self.torque_moving + cross * self.force_moving;
        let turned = cross * self.torque_moving.transpose();
        Self {
            torque_turning: self.torque_turning + turned + turned.transpose() - cross * self.force_moving * cross,
            torque_moving: moving,
            force_moving: self.force_moving,
        }
    }

    /// Returns all 6 × 6 numbers, rotation before translation.
    pub fn to_rows(&self) -> [[f64; 6]; 6] {
        rows(&[self.torque_turning, self.torque_moving], &[self.torque_moving.transpose(), self.force_moving])
    }

    /// Returns the 6 × 6 numbers that map the twist of another body to the wrench about this
    /// matrix's reference point. This reference point lies at `offset` from the reference point of
    /// the twist.
    pub fn across(&self, offset: DVec3) -> [[f64; 6]; 6] {
        let cross = cross_matrix(offset);
        rows(
            &[self.torque_turning - self.torque_moving * cross, self.torque_moving],
            &[self.torque_moving.transpose() - self.force_moving * cross, self.force_moving],
        )
    }

    /// Returns the product of the matrix and `twist`.
    pub fn times(&self, twist: &Twist) -> Wrench {
        let Twist { angular, linear } = *twist;
        Wrench {
            torque: self.torque_turning * angular + self.torque_moving * linear,
            force: self.torque_moving.transpose() * angular + self.force_moving * linear,
        }
    }

    /// Returns the twist for which the product is `wrench`. `None` if the matrix is not positive
    /// definite within rounding.
    ///
    /// The method eliminates translation first, and then solves for rotation with the Schur
    /// complement.
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

/// Returns the 6 × 6 matrix of two rows of two blocks.
fn rows(upper: &[DMat3; 2], lower: &[DMat3; 2]) -> [[f64; 6]; 6] {
    let mut all = [[0.0; 6]; 6];
    for (i, row) in all.iter_mut().enumerate() {
        let blocks = if i < 3 { upper } else { lower };
        for (j, number) in row.iter_mut().enumerate() {
            *number = blocks[j / 3].col(j % 3)[i % 3];
        }
    }
    all
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

    fn numbers(wrench: &Wrench) -> [f64; 6] {
        let [torque, force] = [wrench.torque.to_array(), wrench.force.to_array()];
        std::array::from_fn(|i| if i < 3 { torque[i] } else { force[i - 3] })
    }

    fn product(rows: &[[f64; 6]; 6], twist: &Twist) -> [f64; 6] {
        let [angular, linear] = [twist.angular.to_array(), twist.linear.to_array()];
        rows.map(|row| (0..3).map(|k| row[k] * angular[k] + row[k + 3] * linear[k]).sum())
    }

    #[test]
    fn about_and_across_describe_the_same_spring() {
        let mut spring = SpatialMatrix::ZERO;
        spring.add_along(N, R, 40.0);
        spring.add_at(-R, 7.0);
        let offset = DVec3::new(-0.4, 0.1, 0.2);
        // The reference point of the spring lies at `offset` from the reference point of the twist.
        let seen = Twist { angular: TWIST.angular, linear: TWIST.at(offset) };
        let expected = spring.times(&seen);
        assert!(near(&spring.about(offset).times(&TWIST), &expected.about(-offset)));
        let close = |one: [f64; 6], other: [f64; 6]| one.iter().zip(&other).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(close(product(&spring.to_rows(), &seen), numbers(&expected)));
        assert!(close(product(&spring.across(offset), &TWIST), numbers(&expected)));
    }

    #[test]
    fn solve_is_the_inverse_of_times() {
        let mut matrix = SpatialMatrix::of_body(0.02, DMat3::from_diagonal(DVec3::new(1e-5, 2e-5, 1.5e-5)));
        matrix.add_at(R, 1e-3);
        matrix.add_turning(1e-6);
        matrix.add_along(N, -R, 5e-3);
        let twist = matrix.solve(&matrix.times(&TWIST)).expect("positive definite");
        assert!((twist.angular - TWIST.angular).length() < 1e-10 && (twist.linear - TWIST.linear).length() < 1e-11);
    }

    #[test]
    fn singular_matrices_have_no_solution() {
        let mut matrix = SpatialMatrix::ZERO;
        assert_eq!(matrix.solve(&Wrench::ZERO), None);
        matrix.add_along(N, R, 1.0);
        assert_eq!(matrix.solve(&Wrench::of_force_at(N, R)), None);
    }
}
