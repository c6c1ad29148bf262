//! Symmetric 6 × 6 matrices that turn velocities of a rigid body into wrenches: inertias,
//! stiffnesses, dampings.

use glam::{DMat3, DVec3};

use super::{Twist, Wrench};

/// A symmetric matrix from twists to wrenches, both about the same point and in the same frame.
///
/// Stored as three blocks: torque from rotation, torque from translation (its transpose is force
/// from rotation), force from translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialMatrix {
    torque_turning: DMat3,
    torque_moving: DMat3,
    force_moving: DMat3,
}

impl SpatialMatrix {
    /// Nothing.
    pub const ZERO: Self = Self { torque_turning: DMat3::ZERO, torque_moving: DMat3::ZERO, force_moving: DMat3::ZERO };

    /// The inertia of a rigid body about its centre of mass: kg, and kg·m² in the axes of the
    /// frame.
    pub fn of_body(mass: f64, inertia: DMat3) -> Self {
        Self {
            torque_turning: inertia,
            torque_moving: DMat3::ZERO,
            force_moving: DMat3::from_diagonal(DVec3::splat(mass)),
        }
    }

    /// Adds a spring or damper of strength `c` that acts along the unit vector `direction` at
    /// `offset` from the point.
    pub fn add_along(&mut self, direction: DVec3, offset: DVec3, c: f64) {
        let turning = offset.cross(direction);
        self.torque_turning += outer(c * turning, turning);
        self.torque_moving += outer(c * turning, direction);
        self.force_moving += outer(c * direction, direction);
    }

    /// Adds an isotropic spring or damper of strength `c` that acts on translation at `offset` from
    /// the point.
    pub fn add_at(&mut self, offset: DVec3, c: f64) {
        let cross = cross_matrix(offset);
        self.torque_turning += cross * cross.transpose() * c;
        self.torque_moving += cross * c;
        self.force_moving += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// Adds an isotropic spring or damper against rotation.
    pub fn add_turning(&mut self, c: f64) {
        self.torque_turning += DMat3::from_diagonal(DVec3::splat(c));
    }

    /// The same matrix about another point of the body; the present point lies at `offset` from it.
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

    /// All 6 × 6 numbers, rotation before translation.
    pub fn to_rows(&self) -> [[f64; 6]; 6] {
        rows(&[self.torque_turning, self.torque_moving], &[self.torque_moving.transpose(), self.force_moving])
    }

    /// The 6 × 6 numbers that give the wrench about this matrix's point for the twist of another
    /// body. The twist is stated for a point of that body, from which this matrix's point lies at
    /// `offset`.
    pub fn across(&self, offset: DVec3) -> [[f64; 6]; 6] {
        let cross = cross_matrix(offset);
        rows(
            &[self.torque_turning - self.torque_moving * cross, self.torque_moving],
            &[self.torque_moving.transpose() - self.force_moving * cross, self.force_moving],
        )
    }

    /// The wrench that belongs to `twist`.
    pub fn times(&self, twist: &Twist) -> Wrench {
        let Twist { angular, linear } = *twist;
        Wrench {
            torque: self.torque_turning * angular + self.torque_moving * linear,
            force: self.torque_moving.transpose() * angular + self.force_moving * linear,
        }
    }

    /// The twist that gives `wrench` (the inverse); `None` if the matrix is not positive definite,
    /// be it only by rounding.
    ///
    /// Translation is eliminated first, then rotation by its Schur complement.
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

/// Two rows of two blocks.
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
    fn another_point_and_another_body_see_the_same_spring() {
        let mut spring = SpatialMatrix::ZERO;
        spring.add_along(N, R, 40.0);
        spring.add_at(-R, 7.0);
        let offset = DVec3::new(-0.4, 0.1, 0.2);
        // The stated point lies at `offset` from the other one.
        let seen = Twist { angular: TWIST.angular, linear: TWIST.at(offset) };
        let expected = spring.times(&seen);
        assert!(near(&spring.about(offset).times(&TWIST), &expected.about(-offset)));
        let close = |one: [f64; 6], other: [f64; 6]| one.iter().zip(&other).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(close(product(&spring.to_rows(), &seen), numbers(&expected)));
        assert!(close(product(&spring.across(offset), &TWIST), numbers(&expected)));
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
