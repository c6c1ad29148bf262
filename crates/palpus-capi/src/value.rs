//! Poses, velocities, wrenches and contacts as C structures.

use palpus::glam::{DQuat, DVec3};
use palpus::{Contact, Pose, Twist, Wrench};
use palpus_io::pose_of;

use crate::result::Fault;

/// A rigid placement of one frame in another.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_pose {
    /// Origin of the placed frame in the other frame: x, y, z, m.
    pub position: [f64; 3],
    /// Unit quaternion x, y, z, w. The length may differ from 1 by up to 0.001.
    pub rotation: [f64; 4],
}

/// The velocity of a rigid body.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_twist {
    /// Linear velocity of the point that the function states, m/s.
    pub linear: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular: [f64; 3],
}

/// A force and a torque.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_wrench {
    /// Force, N.
    pub force: [f64; 3],
    /// Torque about the point that the function states, N m.
    pub torque: [f64; 3],
}

/// A pair of points, one on each body: point_a - point_b = separation * normal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_contact {
    /// Point on a, m.
    pub point_a: [f64; 3],
    /// Point on b, m.
    pub point_b: [f64; 3],
    /// Unit vector from b into a.
    pub normal: [f64; 3],
    /// Distance along the normal, m. Negative where the bodies overlap: minus the penetration
    /// depth.
    pub separation: f64,
    /// Index of the convex piece of a.
    pub piece_a: u32,
    /// Index of the convex piece of b.
    pub piece_b: u32,
}

impl palpus_pose {
    /// Returns the engine's pose. Fails if a number is not finite or the quaternion is not unit.
    pub(crate) fn checked(&self) -> Result<Pose, Fault> {
        let [tx, ty, tz] = self.position;
        let [qx, qy, qz, qw] = self.rotation;
        pose_of([tx, ty, tz, qx, qy, qz, qw]).map_err(Fault::value)?;
        // A quaternion whose length is 1 within rounding keeps its bits.
        let pose = Pose { rotation: DQuat::from_xyzw(qx, qy, qz, qw), translation: DVec3::new(tx, ty, tz) };
        Ok(pose.unstretched())
    }
}

impl From<Pose> for palpus_pose {
    fn from(pose: Pose) -> Self {
        Self { position: pose.translation.to_array(), rotation: pose.rotation.to_array() }
    }
}

impl palpus_twist {
    /// Returns the engine's twist. Fails if a number is not finite.
    pub(crate) fn checked(&self) -> Result<Twist, Fault> {
        let twist = Twist { linear: self.linear.into(), angular: self.angular.into() };
        if twist.linear.is_finite() && twist.angular.is_finite() {
            Ok(twist)
        } else {
            Err(Fault::value("a velocity contains a number that is not finite; correct it"))
        }
    }
}

impl From<Twist> for palpus_twist {
    fn from(twist: Twist) -> Self {
        Self { linear: twist.linear.to_array(), angular: twist.angular.to_array() }
    }
}

impl From<Wrench> for palpus_wrench {
    fn from(wrench: Wrench) -> Self {
        Self { force: wrench.force.to_array(), torque: wrench.torque.to_array() }
    }
}

impl From<&Contact> for palpus_contact {
    fn from(contact: &Contact) -> Self {
        Self {
            point_a: contact.point_a.to_array(),
            point_b: contact.point_b.to_array(),
            normal: contact.normal.to_array(),
            separation: contact.separation,
            piece_a: contact.piece_a,
            piece_b: contact.piece_b,
        }
    }
}
