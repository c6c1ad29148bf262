//! Length limits of a pair, used by both the march and GJK.

use crate::algebra::Placement;
use crate::algebra::tolerance::{COPLANAR, MARCH_DOUBT, MARCH_NOISE, MARCH_PROOF, TOUCHING};
use crate::body::Polytope;

/// Length limits for the results of a pair, model units.
pub(super) struct Scale {
    /// Sum of the radii.
    pub(super) size: f64,
    /// Rounding error of a placed vertex.
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

    /// Returns the largest length by which a vertex may reach past the closest points without a
    /// second check.
    #[inline]
    pub(super) fn tight(&self, distance: f64) -> f64 {
        MARCH_PROOF * distance + self.noise
    }

    /// Returns the largest length by which a vertex may reach past the closest points after a
    /// second check. The error of the direction between near points is the rounding of the points
    /// over their distance. Merged faces are planar only within their merge distance. The limit is
    /// at most a fixed fraction of the distance, so the distance stays reliable.
    pub(super) fn loose(&self, distance: f64) -> f64 {
        (COPLANAR * (self.size + distance) + self.noise * self.size / distance).min(MARCH_DOUBT * distance)
    }
}

/// Returns the rounding error of a placed vertex, model units.
fn position_noise(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> f64 {
    let reach = |p: &Polytope| p.centroid().abs().element_sum() + p.radius();
    MARCH_NOISE * (reach(a) + reach(b) + pose_ba.translation.abs().element_sum())
}
