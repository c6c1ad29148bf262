//! Length limits of a pair, which the march and GJK both use for their decisions.

use crate::algebra::Placement;
use crate::algebra::tolerance::{COPLANAR, MARCH_DOUBT, MARCH_NOISE, MARCH_PROOF, TOUCHING};
use crate::body::Polytope;

/// The lengths, in metres, against which a pair's answers are judged.
pub(super) struct Scale {
    /// Sum of the radii.
    pub(super) size: f64,
    /// Rounding of a placed vertex.
    pub(super) noise: f64,
    /// At or below this distance the bodies overlap.
    pub(super) touching: f64,
}

impl Scale {
    #[inline]
    pub(super) fn of(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> Self {
        let size = a.radius() + b.radius();
        let noise = position_noise(a, b, pose_ba);
        Self { size, noise, touching: (TOUCHING * size).max(noise) }
    }

    /// Returns how far a vertex may reach past the closest points. Up to this length, the result is
    /// accepted without a second check.
    #[inline]
    pub(super) fn tight(&self, distance: f64) -> f64 {
        MARCH_PROOF * distance + self.noise
    }

    /// Returns how far a vertex may reach past the closest points at most. The direction between
    /// near points is only as exact as the rounding of the points divided by their distance, and
    /// merged faces are planar only within their merge distance. The limit is at most a fixed
    /// share of the distance, so the distance stays reliable.
    pub(super) fn loose(&self, distance: f64) -> f64 {
        (COPLANAR * (self.size + distance) + self.noise * self.size / distance).min(MARCH_DOUBT * distance)
    }
}

/// Returns how far rounding may move a placed vertex, m. Shorter lengths are noise.
fn position_noise(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> f64 {
    let reach = |p: &Polytope| p.centroid().abs().element_sum() + p.radius();
    MARCH_NOISE * (reach(a) + reach(b) + pose_ba.translation.abs().element_sum())
}
