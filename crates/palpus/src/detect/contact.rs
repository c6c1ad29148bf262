//! A contact: a pair of points, one on each body, within the tolerance \[K02 §4.1\].

use glam::DVec3;

use crate::body::FeaturePair;

/// A pair of points, one on each body, nearer than the contact tolerance; in b's frame.
///
/// `point_a − point_b = separation · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// Index of the convex piece of a.
    pub piece_a: u32,
    /// Index of the convex piece of b.
    pub piece_b: u32,
    /// The features of the two pieces on which the points lie.
    pub features: FeaturePair,
    /// p₁ of \[K02\], on a.
    pub point_a: DVec3,
    /// p₂ of \[K02\], on b.
    pub point_b: DVec3,
    /// Unit vector from b into a.
    pub normal: DVec3,
    /// d of \[K02\]: the distance if the bodies are apart, or minus the depth if they overlap, in
    /// model units (metres in a scene).
    pub separation: f64,
    /// Tangent of the tilt angle of the contact's patch, the region in which flush features touch:
    /// if the bodies are tilted by up to this angle, the other corners of the patch are contacts
    /// too. 0 if patches are not computed.
    pub slope: f64,
    /// The number of contacts that this contact represents in load sharing. It is usually 1. It is
    /// larger in a sample of many contacts, and smaller while a contact is added to or removed from
    /// a sample.
    #[cfg_attr(feature = "serde", serde(default = "one"))]
    pub count: f64,
    /// True if the contact is inside the region that two flat faces of the meshes have in common,
    /// or at its rim but not at a convex corner. However the bodies tilt, another point of the
    /// region is lower, so other contacts bear the load.
    #[cfg_attr(feature = "serde", serde(default))]
    pub inside: bool,
}

/// Returns the count of a contact that represents only one contact.
#[cfg(feature = "serde")]
fn one() -> f64 {
    1.0
}

impl Contact {
    /// Returns p̂ of \[K02\], the middle of the two points.
    pub fn midpoint(&self) -> DVec3 {
        (self.point_a + self.point_b) * 0.5 // Eq. 1
    }

    /// Returns true if both contacts are corners of one patch.
    pub(crate) fn shares_patch(&self, other: &Self) -> bool {
        self.slope > 0.0 && (self.piece_a, self.piece_b) == (other.piece_a, other.piece_b)
    }

    /// Returns true if points, normal and separation are finite. The squared distance of extremely
    /// distant bodies overflows.
    pub fn is_finite(&self) -> bool {
        self.point_a.is_finite() && self.point_b.is_finite() && self.normal.is_finite() && self.separation.is_finite()
    }
}

/// Returns the points on a and on b of a contact. They are half the separation away from the
/// midpoint, along the normal and against it.
#[inline]
pub(super) fn points_about(midpoint: DVec3, normal: DVec3, separation: f64) -> [DVec3; 2] {
    [midpoint + normal * (0.5 * separation), midpoint - normal * (0.5 * separation)]
}
