//! Memory of one contact, and its extrapolation to a later pose.
//!
//! Each of the two points moves with its body. The normal moves with the body whose face touches,
//! otherwise with b. The extrapolated separation is the distance of the two points along the
//! normal. Distances and depths both change by the relative motion of the witness points along the
//! normal. So the separation is correct to first order in the motion.

use glam::DVec3;

use super::Contact;
use super::contact::points_about;
use crate::algebra::Placement;
use crate::body::{Feature, FeaturePair};

/// A contact of an earlier pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairMemory {
    /// Pieces of a and of b.
    pub(super) pieces: [u32; 2],
    pub(super) features: FeaturePair,
    /// Point on a, in a's frame.
    pub(super) point_a: DVec3,
    /// Point on b, in b's frame.
    pub(super) point_b: DVec3,
    /// Unit vector from b into a, in the frame of the body with which the normal turns.
    normal: DVec3,
    turns_with_a: bool,
    slope: f64,
    count: f64,
    inside: bool,
}

impl PairMemory {
    /// Stores `contact`, found at the pose `pose_ba`.
    pub(super) fn of(contact: &Contact, pose_ba: &Placement) -> Self {
        let turns_with_a = matches!(contact.features.a, Feature::Face(_));
        Self {
            pieces: [contact.piece_a, contact.piece_b],
            features: contact.features,
            point_a: pose_ba.inverse_point(contact.point_a),
            point_b: contact.point_b,
            normal: if turns_with_a { pose_ba.inverse_vector(contact.normal) } else { contact.normal },
            turns_with_a,
            slope: contact.slope,
            count: contact.count,
            inside: contact.inside,
        }
    }

    /// Returns the contact at another pose.
    pub(super) fn extrapolate(&self, pose_ba: &Placement) -> Contact {
        let normal = if self.turns_with_a { pose_ba.vector(self.normal) } else { self.normal };
        let point_a = pose_ba.point(self.point_a);
        let separation = normal.dot(point_a - self.point_b);
        self.contact(point_a.midpoint(self.point_b), normal, separation)
    }

    /// Returns a contact with this midpoint, normal and separation, and with the stored pieces and
    /// features.
    pub(super) fn contact(&self, midpoint: DVec3, normal: DVec3, separation: f64) -> Contact {
        let [point_a, point_b] = points_about(midpoint, normal, separation);
        let [piece_a, piece_b] = self.pieces;
        Contact {
            piece_a,
            piece_b,
            features: self.features,
            point_a,
            point_b,
            normal,
            separation,
            slope: self.slope,
            count: self.count,
            inside: self.inside,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::algebra::Pose;
    use crate::algebra::Random;

    const SEED: u64 = 0xE7_4A;

    #[test]
    fn extrapolation_is_exact_to_first_order() {
        let mut random = Random::new(SEED);
        for features in [
            FeaturePair { a: Feature::Vertex(0), b: Feature::Face(0) },
            FeaturePair { a: Feature::Face(0), b: Feature::Vertex(0) },
        ] {
            for _ in 0..200 {
                let pose = random.pose(1.0);
                let (normal, separation) = (random.direction(), random.between(-1e-3, 1e-3));
                let [point_a, point_b] = points_about(random.point(1.0), normal, separation);
                let (piece_a, piece_b, slope) = (3, 4, 0.1);
                let contact = Contact {
                    piece_a,
                    piece_b,
                    features,
                    point_a,
                    point_b,
                    normal,
                    separation,
                    slope,
                    count: 1.0,
                    inside: false,
                };
                let memory = PairMemory::of(&contact, &pose.placement());
                let same = memory.extrapolate(&pose.placement());
                assert!((same.separation - separation).abs() < 1e-12, "seed {SEED:#x}: {same:?}");
                assert!(same.point_a.distance(point_a) < 1e-12 && same.normal.distance(normal) < 1e-12);
                // A rotation about the contact changes its separation only to second order; a
                // translation changes it by its component along the normal.
                let step = 1e-5;
                let turn = DQuat::from_scaled_axis(random.direction() * step);
                let shift = random.direction() * step;
                let about = Pose::new(turn, point_a - turn * point_a + shift);
                let moved = memory.extrapolate(&(about * pose).placement());
                let expected = separation + normal.dot(shift);
                assert!(
                    (moved.separation - expected).abs() < 10.0 * step * step.max(separation.abs()),
                    "seed {SEED:#x}"
                );
                let gap = moved.point_a - moved.point_b - moved.normal * moved.separation;
                assert!(gap.length() < 1e-12, "seed {SEED:#x}");
            }
        }
    }
}
