//! Finds a point deep inside both bodies, near a crossing of their surfaces.
//!
//! 1. Start at the crossing and go inward, against both outward normals, in growing steps. Stop
//!    when the distance to the nearer surface no longer grows.
//! 2. Then move away from the nearer surface by half of the distance to it, as long as that
//!    increases the distance.
//!
//! A cell of each body is then grown around the found point, so the two cells overlap.

use glam::DVec3;

use super::scene::Scene;
use super::surfaces::Crossing;
use crate::algebra::tolerance::{LENS_CENTERING, LENS_FIRST_STEP, LENS_STEP_GROWTH, LENS_STEPS};

/// A point inside both bodies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// The point in a's frame.
    pub(super) point_a: DVec3,
    /// The point in b's frame.
    pub(super) point_b: DVec3,
    /// The point of either surface that is nearest to this point, in b's frame.
    nearest: DVec3,
    /// Distance to that nearest point.
    pub(super) depth: f64,
}

impl Scene<'_> {
    /// Returns a point deep inside both bodies near a crossing of their surfaces, with body a moved
    /// by `t`. `None` if the search finds no point.
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

    /// Returns the lens of the point `z` (in b's frame), with body a moved by `t`. `None` if `z`
    /// does not lie in both bodies.
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
