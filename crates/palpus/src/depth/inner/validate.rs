//! Checks the invariants of the inner surface.
//!
//! 1. Closed and oriented: the triangle across each edge was not removed, runs along the edge in
//!    the opposite direction, and has this triangle as its neighbour at the edge.
//! 2. Support points: each tip is the difference of the two vertices of its hub pair, so the CSO
//!    contains it.
//! 3. Measured: each triangle has a unit normal, and its offset is not more than the height of
//!    any of its tips along the normal.

use super::super::cso::Cso;
use super::{Half, Joint, Surface};
use crate::algebra::tolerance::WELL_FORMED_ROUNDING;

/// A broken invariant of an inner surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(in crate::depth) enum SurfaceFault {
    /// A triangle has a tip that does not exist, or has the same tip twice.
    #[error("triangle {0} does not have three tips of the surface")]
    Tips(usize),
    /// The triangle across an edge was removed, runs along the edge in the same direction, or has a
    /// different neighbour at the edge.
    #[error("side {side} of triangle {triangle} does not lie between two triangles that run opposite ways")]
    Open {
        /// The triangle.
        triangle: usize,
        /// Its side.
        side: usize,
    },
    /// A tip is not the difference of its two vertices at this pose.
    #[error("tip {0} is not the difference of the two vertices of its hub pair")]
    Support(usize),
    /// The normal is not unit, or the height of a tip along the normal is less than the offset.
    #[error("the normal or the offset of triangle {0} does not fit its tips")]
    Judged(usize),
}

impl Surface {
    /// Checks the whole surface at the pose of `cso`. Returns the first broken invariant.
    pub(in crate::depth) fn validate(&self, cso: &Cso<'_>) -> Result<(), SurfaceFault> {
        (0..self.joints.len()).filter(|&k| self.joints[k].alive).try_for_each(|k| {
            self.validate_joint(k)?;
            self.validate_judgement(k)
        })?;
        let stays = |(k, tip): (usize, &super::Tip)| {
            let known = (tip.hub.a as usize) < cso.a.vertices().len() && (tip.hub.b as usize) < cso.b.vertices().len();
            if known && tip.at == cso.vertex(tip.hub) { Ok(()) } else { Err(SurfaceFault::Support(k)) }
        };
        self.tips.iter().enumerate().try_for_each(stays)
    }

    /// Checks invariant 1 for one triangle.
    fn validate_joint(&self, triangle: usize) -> Result<(), SurfaceFault> {
        let Joint { tips, across, .. } = self.joints[triangle];
        let [p, q, r] = tips;
        if p == q || q == r || r == p || tips.iter().any(|&tip| usize::from(tip) >= self.tips.len()) {
            return Err(SurfaceFault::Tips(triangle));
        }
        let is_joined = |side: usize, half: Half| {
            let Some(other) = self.joints.get(half.triangle()).filter(|joint| joint.alive) else { return false };
            let (there, back) = (half.side(), other.across[half.side()]);
            let opposite = other.tips[there] == tips[(side + 1) % 3] && other.tips[(there + 1) % 3] == tips[side];
            opposite && (back.triangle(), back.side()) == (triangle, side)
        };
        match across.iter().enumerate().find(|&(side, &half)| half.side() > 2 || !is_joined(side, half)) {
            Some((side, _)) => Err(SurfaceFault::Open { triangle, side }),
            None => Ok(()),
        }
    }

    /// Checks invariant 3 for one triangle. A triangle of zero height has no normal.
    fn validate_judgement(&self, triangle: usize) -> Result<(), SurfaceFault> {
        let (normal, offset) = (self.normals[triangle], self.offsets[triangle]);
        let height = |&tip: &u16| normal.dot(self.tips[usize::from(tip)].at);
        let reaches = |tip: &u16| height(tip) >= offset - self.slack;
        let sound = match offset.is_finite() {
            true => {
                (normal.length() - 1.0).abs() <= WELL_FORMED_ROUNDING && self.joints[triangle].tips.iter().all(reaches)
            }
            false => offset == f64::INFINITY,
        };
        if sound { Ok(()) } else { Err(SurfaceFault::Judged(triangle)) }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::HubPair;
    use super::*;
    use crate::algebra::Placement;
    use crate::algebra::Random;
    use crate::body::{Polytope, convex_hull};

    const SEED: u64 = 0x5eed_fa17;

    fn ball(random: &mut Random, count: usize) -> Polytope {
        let points: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
        convex_hull(&points, 1e-10).unwrap().into_polytope().unwrap().0
    }

    /// Returns a surface that was grown several times from a tetrahedron.
    fn grown(cso: &Cso<'_>, random: &mut Random) -> Surface {
        let mut surface = Surface::new();
        surface.clear(1e-12, false);
        for normal in [DVec3::X, -DVec3::X, DVec3::Y, DVec3::Z] {
            surface.push_tip(cso, cso.support_anew(normal).0);
        }
        assert!(surface.close_tetrahedron(), "seed {SEED:#x}");
        for _ in 0..3 + random.below(12) {
            let low = surface.nearest();
            let (hub, offset) = cso.support_anew(low.normal);
            if offset <= low.offset + 1e-9 {
                break;
            }
            surface.grow(cso, low.triangle, hub).unwrap();
        }
        surface
    }

    #[test]
    fn validate_names_the_broken_invariant() {
        let mut random = Random::new(SEED);
        for case in 0..50 {
            let (a, b) = (ball(&mut random, 20), ball(&mut random, 30));
            let pose_ba = Placement::IDENTITY;
            let cso = Cso { a: &a, b: &b, pose_ba: &pose_ba };
            let surface = grown(&cso, &mut random);
            let what = format!("seed {SEED:#x}, case {case}");
            assert_eq!(surface.validate(&cso), Ok(()), "{what}");
            let alive: Vec<usize> = (0..surface.joints.len()).filter(|&k| surface.joints[k].alive).collect();
            let (k, side) = (alive[random.below(alive.len())], random.below(3));
            let fault = |change: &dyn Fn(&mut Surface)| {
                let mut broken = surface.clone();
                change(&mut broken);
                broken.validate(&cso).expect_err("a broken surface")
            };
            let open = fault(&|surface| surface.joints[k].alive = false);
            assert!(matches!(open, SurfaceFault::Open { .. }), "{what}: {open}");
            let turned = fault(&|surface| surface.joints[k].tips.swap(0, 1));
            assert!(matches!(turned, SurfaceFault::Open { .. }), "{what}: {turned}");
            let crossed = fault(&|surface| surface.joints[k].across.swap(side, (side + 1) % 3));
            assert!(matches!(crossed, SurfaceFault::Open { .. }), "{what}: {crossed}");
            let double = fault(&|surface| surface.joints[k].tips[side] = surface.joints[k].tips[(side + 1) % 3]);
            assert!(matches!(double, SurfaceFault::Tips(_) | SurfaceFault::Open { .. }), "{what}: {double}");
            let lifted = fault(&|surface| surface.offsets[k] += 0.1);
            assert_eq!(lifted, SurfaceFault::Judged(k), "{what}");
            let tip = random.below(surface.tips.len());
            let moved = fault(&|surface| {
                let HubPair { a, b } = surface.tips[tip].hub;
                surface.tips[tip].hub = HubPair { a: (a + 1) % 20, b };
            });
            assert_eq!(moved, SurfaceFault::Support(tip), "{what}");
        }
    }
}
