//! Point bounds: cheap lower bounds of the gaps of pairs that are due. A point bound is computed
//! from one point and one direction.
//!
//! When the gap of a pair along a normal n (b's frame) has been measured, the front stores five
//! values: n, the centre c and the radius r of the sphere around a's node, the gap minus n·c, and
//! m, the normal in a's frame. At a later pose, n·c is different, and the normal in a's frame is
//! m'. The height m'·(p − c) of any point p of a differs from m·(p − c) by at most r |m' − m|. So
//! the gap along n is at least
//!
//! n·c + (gap − n·c at the earlier pose) − r |m' − m|.
//!
//! The bound is computed without reading any vertex. For parts that slide along each other, it
//! stays sufficient for many ticks. Rotations about the normal do not weaken it.
//!
//! If the bound does not suffice, the gap along n is measured again. The height of b along n does
//! not change, because n is fixed in b's frame. So only the vertices of a are read
//! ([`Side::lowest`](super::super::Side)).

use glam::{DVec3, Vec3};

use super::{Front, PlacedPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::POINT_BOUND_ROUNDING;

/// The stored bound of the pair at a place, in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointBound {
    normal: Vec3,
    /// The normal in a's frame, when the gap was measured.
    normal_in_a: Vec3,
    center: Vec3,
    /// The gap minus n·c, model units. Minus infinity if there is no bound.
    base: f32,
    radius: f32,
}

impl PointBound {
    /// No bound.
    pub(super) const NONE: Self =
        Self { normal: Vec3::ZERO, normal_in_a: Vec3::ZERO, center: Vec3::ZERO, base: f32::NEG_INFINITY, radius: 0.0 };

    /// False if this is no bound.
    pub(super) fn exists(&self) -> bool {
        self.normal != Vec3::ZERO
    }

    /// Returns the bound for a `gap` (model units) along the same normal at this pose.
    fn with_gap(self, pose_ba: &Placement, gap: f64) -> Self {
        let (normal, at) = (self.normal.as_dvec3(), pose_ba.point(self.center.as_dvec3()));
        // The rounded normal and centre are used as exact values. The rounding changes the gap and
        // the heights in a by less than [`POINT_BOUND_ROUNDING`] times the size.
        let size = at.length() + f64::from(self.radius);
        let base = gap - normal.dot(at) - POINT_BOUND_ROUNDING * size;
        Self { normal_in_a: pose_ba.inverse_vector(normal).as_vec3(), base: base as f32, ..self }
    }
}

impl Front {
    /// Stores `gap` (model units) as the gap of the pair at `place` along `normal` (unit vector in
    /// b's frame).
    pub(super) fn store_gap(&mut self, query: &PlacedPair<'_>, place: u32, normal: DVec3, gap: f64) {
        let bound = self.point_bound(query, place, normal.as_vec3(), gap);
        self.pairs[place as usize].set_bound(bound);
    }

    /// Computes the gap (model units) of the pair at `place` along the stored normal from its
    /// support vertices, and stores it. `None` if no normal is stored. The gap never exceeds the
    /// distance of the pair.
    pub(super) fn measure_gap(&mut self, query: &PlacedPair<'_>, place: u32) -> Option<f64> {
        let pair = &self.pairs[place as usize];
        if !pair.bound.exists() {
            return None;
        }
        let height = pair.height().unwrap_or_else(|| {
            let normal = pair.bound.normal.as_dvec3();
            normal.dot(query.b.polytope(pair.b).support_point(normal))
        });
        self.pairs[place as usize].set_height(height);
        let gap = self.gap_at(query, query.pose_ba, place)?;
        self.store_again(query, place, gap);
        Some(gap)
    }

    /// Stores `gap` (model units) as the present gap of the pair at `place` along the stored
    /// normal.
    pub(super) fn store_again(&mut self, query: &PlacedPair<'_>, place: u32, gap: f64) {
        let bound = &mut self.pairs[place as usize].bound;
        *bound = bound.with_gap(query.pose_ba, gap);
    }

    /// Returns the gap of the pair along the stored normal at a placement of a in b's frame, model
    /// units. `None` if the height of b is unknown. The placement need not be rigid.
    pub(super) fn gap_at(&self, query: &PlacedPair<'_>, placement_ba: &Placement, place: u32) -> Option<f64> {
        let height = self.pairs[place as usize].height()?;
        let gap = self.height_of_a(query, place, placement_ba) - height;
        // The length of the normal is not exactly 1.
        Some(gap - f64::from(f32::EPSILON) * gap.abs())
    }

    /// Returns a lower bound of the heights of a at a placement, along the stored normal.
    #[inline]
    fn height_of_a(&self, query: &PlacedPair<'_>, place: u32, placement_ba: &Placement) -> f64 {
        let pair = &self.pairs[place as usize];
        let normal = pair.bound.normal.as_dvec3();
        // The bound's centre is the middle of a's node.
        let middle = placement_ba.point(pair.bound.center.as_dvec3());
        normal.dot(middle) + query.a.lowest(pair.a, placement_ba.inverse_vector(normal))
    }

    /// Returns the bound for the `gap` of the pair at `place` along `normal`.
    pub(super) fn point_bound(&self, query: &PlacedPair<'_>, place: u32, normal: Vec3, gap: f64) -> PointBound {
        let node = query.a.hierarchy.node(self.pairs[place as usize].a);
        let center = node.middle();
        let radius = (node.sphere.radius + center.distance(node.sphere.center)) as f32 * (1.0 + f32::EPSILON);
        PointBound { normal, center: center.as_vec3(), radius, ..PointBound::NONE }.with_gap(query.pose_ba, gap)
    }

    /// Returns an upper bound of the decrease of the gap of the pair at `place` in the last motion,
    /// as a share of this motion.
    pub(super) fn approach(&self, place: u32) -> f64 {
        let PointBound { normal, center, radius, .. } = self.pairs[place as usize].bound;
        self.motion_bound.approach(center.as_dvec3(), f64::from(radius), normal.as_dvec3())
    }

    /// Returns a lower bound of the pair's gap at a placement of a in b's frame, model units; minus
    /// infinity if nothing is stored. The placement need not be rigid.
    #[inline]
    pub(super) fn stored_gap(&self, placement_ba: &Placement, place: u32) -> f64 {
        let PointBound { normal, normal_in_a, center, base, radius } = self.pairs[place as usize].bound;
        let normal = normal.as_dvec3();
        let along = normal.dot(placement_ba.point(center.as_dvec3()));
        let turned = placement_ba.inverse_vector(normal).distance(normal_in_a.as_dvec3());
        along + f64::from(base) - f64::from(radius) * turned
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::super::oracle::cuboid;
    use super::super::super::{LeafPairs, Side};
    use super::*;
    use crate::algebra::{Pose, Random};
    use crate::body::Hierarchy;

    const SEED: u64 = 0x9015_7b0d;

    #[test]
    fn point_bound_is_never_above_the_gap() {
        let mut random = Random::new(SEED);
        let pieces = [cuboid(DVec3::new(1.0, 0.7, 0.2))];
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let corners = pieces[0].vertices();
        for round in 0..200 {
            let (mut front, mut found) = (Front::new(side, side, 16), LeafPairs::new(4));
            let mut pose = Pose::new(random.rotation(), random.vector() * 4.0);
            let normal = random.direction();
            let gap = |place: &Pose| {
                let low = corners.iter().map(|&v| normal.dot(place.placement().point(v))).fold(f64::INFINITY, f64::min);
                low - corners.iter().map(|&v| normal.dot(v)).fold(f64::NEG_INFINITY, f64::max)
            };
            front.within(&PlacedPair::new(side, side, &pose.placement(), 0.0), &mut found);
            front.store_gap(&PlacedPair::new(side, side, &pose.placement(), 0.0), 0, normal, gap(&pose));
            for _ in 0..20 {
                let turn = DQuat::from_scaled_axis(random.vector() * 0.02);
                pose = Pose::new(turn * pose.rotation, pose.translation + random.vector() * 0.05);
                front.motion_bound.advance(&pose.placement());
                let bound = front.stored_gap(&pose.placement(), 0);
                let true_gap = gap(&pose);
                assert!(bound <= true_gap, "seed {SEED:#x}, round {round}: {bound} > {true_gap}");
                assert!(bound > true_gap - 1.0, "seed {SEED:#x}, round {round}: {bound} is useless");
            }
        }
    }
}
