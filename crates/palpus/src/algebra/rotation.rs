//! Rotations as vectors.

use glam::{DQuat, DVec3};

/// Returns the rotation vector (axis times angle, rad) of the unit quaternion `q`. The angle is at
/// most π. The result is accurate for small angles too, where the arc cosine of w would lose
/// half of the digits.
pub fn rotation_vector(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let sine = q.xyz().length();
    if sine > 0.0 { q.xyz() * (2.0 * sine.atan2(q.w) / sine) } else { DVec3::ZERO }
}

/// Returns the rotation vector (rad) from `from` to `to`, in their common outer frame.
pub fn rotation_between(from: DQuat, to: DQuat) -> DVec3 {
    rotation_vector(to * from.conjugate())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_vector_restores_its_rotation() {
        for vector in [DVec3::ZERO, DVec3::new(1e-12, 0.0, -2e-12), DVec3::new(0.3, -1.0, 2.0), DVec3::X * 3.1] {
            let again = rotation_vector(-DQuat::from_scaled_axis(vector));
            assert!((again - vector).length() <= 1e-15 + 1e-15 * vector.length() * 4.0, "{vector} {again}");
        }
    }
}
