//! The result of one pair of pieces.

use glam::DVec3;

use super::Contact;
use crate::body::FeaturePair;
use crate::collision::{Closest, LeafPair};

/// Result of a pair of pieces within tolerance.
pub(super) enum Found {
    /// No contact: the closest points are not on both surfaces.
    Nothing,
    /// A contact along the direction of least distance or depth.
    Admissible(Contact),
    /// The pieces are apart. They belong to nearly flush faces that continue beyond them, and the
    /// contact is along the normal of such a face; or only a turn of the bodies would make their
    /// closest points a contact. Without a patch it is left out (`PartSearch::keep`).
    NearlyFlush(Contact),
    /// The pieces are apart, and a vertex of one is beside a valley of the other.
    BesideValley(Contact),
    /// A contact along the least depth among the shared normals of the pieces. The second value is
    /// this contact with its points on its features, for the check of its depth.
    Moved(Contact, Contact),
    /// An overlap without a shared normal: the contact along the least depth, if that was computed.
    Inadmissible(Option<Contact>),
}

/// Returns the contact at the closest points.
pub(super) fn at_closest(leaf: &LeafPair, closest: &Closest) -> Contact {
    let Closest { point_a, point_b, normal, features, distance, .. } = *closest;
    at(leaf, features, [point_a, point_b], normal, distance)
}

/// Returns the contact of a leaf pair at these points.
pub(super) fn at(
    leaf: &LeafPair,
    features: FeaturePair,
    points: [DVec3; 2],
    normal: DVec3,
    separation: f64,
) -> Contact {
    let (LeafPair { piece_a, piece_b, .. }, [point_a, point_b]) = (*leaf, points);
    Contact { piece_a, piece_b, features, point_a, point_b, normal, separation, slope: 0.0, count: 1.0, inside: false }
}
