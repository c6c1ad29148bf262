//! Invariants of every depth answer, for any start of the search.
//!
//! 1. The normal has unit length, and `point_a = point_b − depth · normal`.
//! 2. The depth is the overlap of the two supports along the normal.
//! 3. The witness points lie in the supporting planes. The witness point on b is below the
//!    planes of the faces around b's support vertex.

use super::super::Depth;
use super::super::cso::Cso;
use crate::algebra::tolerance::{FLUSH_WITNESS, OFFSET_SLACK, PROOF_ROUNDING, VALIDATED_ANSWERS, WELL_FORMED_ROUNDING};

/// A broken invariant of an answer.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(in crate::depth) enum DepthFault {
    /// The normal is not unit, or `point_a − point_b` is not `−depth · normal`.
    #[error("point_a - point_b differs from -depth * normal by {0:e}")]
    Points(f64),
    /// The overlap of the supports along the normal is not equal to the depth.
    #[error("the depth is {depth:e}, but the supports along the normal overlap by {gap:e}")]
    Gap {
        /// Depth of the answer (length unit of the polytopes).
        depth: f64,
        /// Overlap of the supports along the normal, in the same unit.
        gap: f64,
    },
    /// The witness point on b is not in b's supporting plane, or it lies outside b.
    #[error("the witness point on b is {0:e} away from its supporting feature")]
    Witness(f64),
}

impl Depth {
    /// Returns true for one answer in [`VALIDATED_ANSWERS`]. The last bits of the depth decide, so
    /// the choice is the same in every run. Returns false for an answer that is not finite. If the
    /// pose is not finite, a query guarantees only that it does not panic.
    pub(in crate::depth) fn is_sampled(&self) -> bool {
        let is_finite = self.point_a.is_finite() && self.point_b.is_finite() && self.depth.is_finite();
        is_finite && self.depth.to_bits().is_multiple_of(VALIDATED_ANSWERS)
    }

    /// Returns the first invariant that the answer breaks, as an error.
    pub(in crate::depth) fn validate(&self, cso: &Cso<'_>) -> Result<(), DepthFault> {
        let Self { point_a, point_b, normal, depth, .. } = *self;
        let Cso { a, b, pose_ba } = *cso;
        let coordinates = cso.size() + pose_ba.translation.length() + a.centroid().length() + b.centroid().length();
        let rounding = PROOF_ROUNDING * coordinates;
        let off = (point_a - point_b + normal * depth).length() + (normal.length() - 1.0).abs() * cso.size();
        if off.is_nan() || off > rounding + WELL_FORMED_ROUNDING * depth.abs() {
            return Err(DepthFault::Points(off));
        }
        let (hub, gap) = cso.support_anew(normal);
        if (gap - depth).abs() > OFFSET_SLACK * cso.size() + rounding {
            return Err(DepthFault::Gap { depth, gap });
        }
        let flush = FLUSH_WITNESS * cso.size() + b.bulge() + rounding;
        let below = (normal.dot(b.vertex(hub.b)) - normal.dot(point_b)).abs();
        let outside = b.ring(hub.b).iter().map(|spoke| b.plane(spoke.left).height(point_b)).fold(below, f64::max);
        if outside > flush { Err(DepthFault::Witness(outside)) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::{DepthScratch, depth};
    use super::*;
    use crate::algebra::Pose;
    use crate::algebra::Random;
    use crate::body::{Polytope, convex_hull};

    const SEED: u64 = 0xdee9_fa17;

    fn ball(random: &mut Random) -> Polytope {
        let points: Vec<DVec3> = (0..30).map(|_| random.direction()).collect();
        convex_hull(&points, 1e-9).unwrap().into_polytope().unwrap().0
    }

    #[test]
    fn validate_names_the_broken_invariant() {
        let mut random = Random::new(SEED);
        let mut scratch = DepthScratch::new();
        for case in 0..200 {
            let (a, b) = (ball(&mut random), ball(&mut random));
            let turn = glam::DQuat::from_axis_angle(random.direction(), random.between(-3.0, 3.0));
            let pose_ba = Pose::new(turn, random.direction() * random.between(0.3, 1.5)).placement();
            let cso = Cso { a: &a, b: &b, pose_ba: &pose_ba };
            let answer = depth(&a, &b, &pose_ba, &[], &mut scratch);
            let what = format!("seed {SEED:#x}, case {case}");
            assert_eq!(answer.validate(&cso), Ok(()), "{what}");
            let fault = |broken: Depth| broken.validate(&cso).expect_err("a wrong answer");
            let across = answer.normal.any_orthonormal_vector() * 0.5;
            let beside = Depth { point_a: answer.point_a + across, ..answer };
            assert!(matches!(fault(beside), DepthFault::Points(_)), "{what}");
            let deeper = 0.01 * answer.normal;
            let deep = Depth { depth: answer.depth + 0.01, point_a: answer.point_a - deeper, ..answer };
            assert!(matches!(fault(deep), DepthFault::Gap { .. }), "{what}");
            let (point_a, point_b) = (answer.point_a - deeper, answer.point_b - deeper);
            assert!(matches!(fault(Depth { point_a, point_b, ..answer }), DepthFault::Witness(_)), "{what}");
        }
    }
}
