//! One frame for the devices of all makers: x to the user's right, y away from the user, z up.
//!
//! Axes are only permuted and negated, which is exact. The axes of the grip are converted in the
//! same way, so the maker's identity orientation is also the identity here.

use glam::{DMat3, DQuat, DVec3};
use palpus::algebra::Pose;

/// Directions of a maker's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axes {
    /// x toward the user, y to the user's right, z up.
    ForceDimension,
    /// x to the right, y up, z toward the user.
    OpenHaptics,
}

impl Axes {
    /// Converts a vector from the maker's frame to palpus's frame.
    pub(crate) fn ours(self, v: DVec3) -> DVec3 {
        match self {
            Self::ForceDimension => DVec3::new(v.y, -v.x, v.z),
            Self::OpenHaptics => DVec3::new(v.x, -v.z, v.y),
        }
    }

    /// Converts a vector from palpus's frame to the maker's frame.
    pub(crate) fn theirs(self, v: DVec3) -> DVec3 {
        match self {
            Self::ForceDimension => DVec3::new(-v.y, v.x, v.z),
            Self::OpenHaptics => DVec3::new(v.x, v.z, -v.y),
        }
    }

    /// Converts the pose of a grip from the maker's frame to palpus's frame. `rotation` has the
    /// grip's axes as columns.
    pub(crate) fn pose(self, rotation: DMat3, translation: DVec3) -> Pose {
        // The axis of a rotation is converted like a vector. The angle stays the same.
        let q = DQuat::from_mat3(&rotation);
        let axis = self.ours(DVec3::new(q.x, q.y, q.z));
        Pose {
            rotation: DQuat::from_xyzw(axis.x, axis.y, axis.z, q.w).normalize(),
            translation: self.ours(translation),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_invertible() {
        for axes in [Axes::ForceDimension, Axes::OpenHaptics] {
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| axes.ours(v));
            assert_eq!(x.cross(y), z, "{axes:?}");
            let v = DVec3::new(0.1, -2.0, 30.0);
            assert_eq!(axes.theirs(axes.ours(v)), v, "{axes:?}");
        }
        // Up stays up, and away stays away.
        assert_eq!(Axes::ForceDimension.ours(DVec3::Z), DVec3::Z);
        assert_eq!(Axes::ForceDimension.ours(DVec3::X), -DVec3::Y);
        assert_eq!(Axes::OpenHaptics.ours(DVec3::Y), DVec3::Z);
        assert_eq!(Axes::OpenHaptics.ours(DVec3::Z), -DVec3::Y);
    }

    #[test]
    fn rotations_convert_like_vectors() {
        for axes in [Axes::ForceDimension, Axes::OpenHaptics] {
            let turn = DVec3::new(0.3, -0.5, 0.7);
            let theirs = DMat3::from_quat(DQuat::from_scaled_axis(turn));
            let pose = axes.pose(theirs, DVec3::X);
            let v = DVec3::new(1.0, 2.0, 3.0);
            let expected = axes.ours(theirs * axes.theirs(v));
            assert!((pose.rotation * v).abs_diff_eq(expected, 1e-14), "{axes:?}");
        }
    }
}
