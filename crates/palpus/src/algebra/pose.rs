//! Rigid placements.

use glam::{DMat3, DQuat, DVec3};

use super::tolerance::WELL_FORMED_ROUNDING;

/// A rigid placement of one frame in another. `pose_ab * p_b` is the point `p_b` of frame b in the
/// coordinates of frame a.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Origin of the placed frame, in the units of the model (metres in a scene).
    pub translation: DVec3,
}

impl Pose {
    /// The identity placement.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// Creates a placement from its parts. Normalises `rotation`, so a recorded quaternion need not
    /// have exactly unit length.
    pub fn new(rotation: DQuat, translation: DVec3) -> Self {
        Self { rotation: rotation.normalize(), translation }
    }

    /// Creates a placement that only translates.
    pub fn from_translation(translation: DVec3) -> Self {
        Self { rotation: DQuat::IDENTITY, translation }
    }

    /// Transforms the point `p` from the placed frame to the outer frame.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// Transforms the free vector `v` from the placed frame to the outer frame.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.rotation * v
    }

    /// Returns the inverse placement: `pose_ab.inverse()` is `pose_ba`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Returns this placement with its rotation as a matrix, to transform many points.
    pub fn placement(&self) -> Placement {
        Placement { rotation: DMat3::from_quat(self.rotation), translation: self.translation }
    }

    /// Returns the frame with the axes of this frame and its origin at `point`, in this frame's
    /// coordinates. If `p` is a probe's pose, the grip's pose is `p.with_origin(grip_a)`. If `g` is
    /// a grip's pose, the probe's pose is `g.with_origin(-grip_a)`.
    #[must_use]
    pub fn with_origin(self, point: DVec3) -> Self {
        if point == DVec3::ZERO {
            // Adding zero would turn -0.0 into 0.0, but recordings must replay bit for bit.
            return self;
        }
        Self { translation: self.point(point), ..self }
    }

    /// Returns true if every number is finite and the quaternion has unit length within 1e-6.
    pub fn is_valid(&self) -> bool {
        self.rotation.is_finite() && self.translation.is_finite() && (self.rotation.length() - 1.0).abs() < 1e-6
    }

    /// Returns this placement with a quaternion of unit length. [`Self::is_valid`] must accept the
    /// placement. If the quaternion has unit length up to rounding, every bit stays the same.
    #[must_use]
    pub fn unstretched(self) -> Self {
        let off = (self.rotation.length() - 1.0).abs();
        if off > WELL_FORMED_ROUNDING { Self::new(self.rotation, self.translation) } else { self }
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;

    /// `pose_ab * pose_bc` is `pose_ac`.
    fn mul(self, inner: Self) -> Self {
        Self { rotation: (self.rotation * inner.rotation).normalize(), translation: self.point(inner.translation) }
    }
}

/// A [`Pose`] with its rotation as a matrix. The queries on pairs of pieces use this type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// A rotation matrix. Its columns are the placed frame's axes.
    pub rotation: DMat3,
    /// Origin of the placed frame.
    pub translation: DVec3,
}

impl Placement {
    /// The identity placement.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// Transforms the point `p` from the placed frame to the outer frame.
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// Transforms the free vector `v` from the placed frame to the outer frame.
    #[inline]
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.rotation * v
    }

    /// Transforms the point `p` from the outer frame to the placed frame.
    #[inline]
    pub fn inverse_point(&self, p: DVec3) -> DVec3 {
        self.inverse_vector(p - self.translation)
    }

    /// Transforms the free vector `v` from the outer frame to the placed frame.
    #[inline]
    pub fn inverse_vector(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.rotation.x_axis.dot(v), self.rotation.y_axis.dot(v), self.rotation.z_axis.dot(v))
    }

    /// Returns the inverse placement.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_and_its_inverse_cancel() {
        let pose = Pose::new(DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.2), DVec3::new(1.0, -2.0, 3.0));
        let p = DVec3::new(0.3, 0.4, -0.5);
        assert!((pose.inverse().point(pose.point(p)) - p).length() < 1e-15);
        assert!((pose.placement().inverse_point(pose.point(p)) - p).length() < 1e-15);
        assert!(((pose * pose.inverse()).translation).length() < 1e-14);
    }

    #[test]
    fn with_origin_keeps_points_and_undoes_itself() {
        let pose = Pose::new(DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.2), DVec3::new(1.0, -0.0, 3.0));
        let grip = DVec3::new(0.3, 0.4, -0.5);
        let held = pose.with_origin(grip);
        assert_eq!((held.rotation, held.translation), (pose.rotation, pose.point(grip)));
        assert!(held.with_origin(-grip).translation.distance(pose.translation) < 1e-15);
        // A grip at the origin must change no bit. Otherwise old recordings would not replay.
        let same = pose.with_origin(-DVec3::ZERO).translation.y;
        assert_eq!(same.to_bits(), (-0f64).to_bits());
    }
}
