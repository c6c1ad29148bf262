//! Random contacts for this room's tests.

use glam::{DQuat, DVec3};

use super::Contact;
use crate::algebra::Pose;
use crate::body::{Feature, FeaturePair};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in \[0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// Uniform in the cube of the given half side.
    pub(crate) fn point(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point(1.0);
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }

    pub(crate) fn pose(&mut self, half: f64) -> Pose {
        Pose::new(DQuat::from_axis_angle(self.direction(), self.between(-3.0, 3.0)), self.point(half))
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for k in (1..items.len()).rev() {
            items.swap(k, self.below(k + 1));
        }
    }
}

/// The contact with the given midpoint, normal and separation.
pub(crate) fn contact(pieces: (u32, u32), midpoint: DVec3, normal: DVec3, separation: f64) -> Contact {
    Contact {
        piece_a: pieces.0,
        piece_b: pieces.1,
        features: FeaturePair { a: Feature::Vertex(0), b: Feature::Face(0) },
        point_a: midpoint + normal * (0.5 * separation),
        point_b: midpoint - normal * (0.5 * separation),
        normal,
        separation,
        extent: 0.0,
    }
}

/// The same contact after moving everything by `pose`.
pub(crate) fn moved(contact: &Contact, pose: &Pose) -> Contact {
    Contact {
        point_a: pose.point(contact.point_a),
        point_b: pose.point(contact.point_b),
        normal: pose.vector(contact.normal),
        ..*contact
    }
}
