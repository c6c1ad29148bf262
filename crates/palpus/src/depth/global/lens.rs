//! Finds a point deep in both bodies near a crossing of their surfaces.
//!
//! 1. Go from the crossing against both outward normals, in growing steps, as long as the nearer
//!    surface gets farther.
//! 2. Go on away from the nearer surface, by half of its distance, as long as that helps.
//!
//! Cells of both bodies grown about this point overlap there.

use glam::DVec3;

use super::scene::Scene;
use super::surfaces::Crossing;
use crate::algebra::tolerance::{LENS_CENTERING, LENS_FIRST_STEP, LENS_STEP_GROWTH, LENS_STEPS};

/// A point in both bodies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// In a's frame.
    pub(super) point_a: DVec3,
    /// In b's frame.
    pub(super) point_b: DVec3,
    /// The nearest point of both surfaces, in b's frame.
    nearest: DVec3,
    /// Its distance.
    pub(super) depth: f64,
}

impl Scene<'_> {
    /// A point deep in both bodies near a crossing of their surfaces, with a moved by `t`.
    pub(super) fn lens(&self, crossing: &Crossing, t: DVec3) -> Option<Lens> {
        let size = self.a.size().min(self.b.size());
        let outward_a = self.placement.vector(self.a.mesh().triangle_normal(crossing.moving));
        let outward_b = self.b.mesh().triangle_normal(crossing.fixed);
        let inward = -(outward_a + outward_b).normalize_or_zero();
        let mut best: Option<Lens> = None;
        let mut step = LENS_FIRST_STEP * size;
        for _ in 0..LENS_STEPS {
            let found = self.lens_at(crossing.point + inward * step, t);
            let better = found.is_some_and(|found| best.is_none_or(|best| found.depth > best.depth));
            if better {
                best = found;
            } else if best.is_some() {
                break;
            }
            step *= LENS_STEP_GROWTH;
        }
        let mut best = best?;
        for _ in 0..LENS_CENTERING {
            let away = (best.point_b - best.nearest).normalize_or_zero();
            match self.lens_at(best.point_b + away * (0.5 * best.depth), t) {
                Some(found) if found.depth > best.depth => best = found,
                _ => break,
            }
        }
        Some(best)
    }

    /// The point `z` (b's frame) if it lies in both bodies, with a moved by `t`.
    fn lens_at(&self, z: DVec3, t: DVec3) -> Option<Lens> {
        let point_a = self.placement.inverse_point(z - t);
        if !self.b.tree().inside(z) || !self.a.tree().inside(point_a) {
            return None;
        }
        let (p, q) = (self.a.tree().nearest(point_a)?, self.b.tree().nearest(z)?);
        let nearest = if p.distance < q.distance { self.placement.point(p.point) + t } else { q.point };
        Some(Lens { point_a, point_b: z, nearest, depth: p.distance.min(q.distance) })
    }
}
