//! Random contacts for the tests of `force`.

use glam::{DQuat, DVec3};

use crate::algebra::Pose;
pub(crate) use crate::algebra::Random;
use crate::body::{Feature, FeaturePair};
use crate::detect::Contact;

impl Random {
    /// Returns a random point, uniform in the cube from −`half` to `half`.
    pub(crate) fn point(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    pub(crate) fn pose(&mut self, half: f64) -> Pose {
        Pose::new(DQuat::from_axis_angle(self.direction(), self.between(-3.0, 3.0)), self.point(half))
    }
}

/// Returns the contact with the given midpoint, normal and separation.
pub(crate) fn contact(pieces: (u32, u32), midpoint: DVec3, normal: DVec3, separation: f64) -> Contact {
    Contact {
        piece_a: pieces.0,
        piece_b: pieces.1,
        features: FeaturePair { a: Feature::Vertex(0), b: Feature::Face(0) },
        point_a: midpoint + normal * (0.5 * separation),
        point_b: midpoint - normal * (0.5 * separation),
        normal,
        separation,
        slope: 0.0,
        count: 1.0,
        inside: false,
    }
}

/// Returns the contact after everything is moved by `pose`.
pub(crate) fn moved(contact: &Contact, pose: &Pose) -> Contact {
    Contact {
        point_a: pose.point(contact.point_a),
        point_b: pose.point(contact.point_b),
        normal: pose.vector(contact.normal),
        ..*contact
    }
}
