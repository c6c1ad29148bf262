//! Invariants of every answer of the depth, whatever its start.
//!
//! 1. The normal is unit, and point a is point b minus the depth times the normal.
//! 2. The depth is the gap between the two supports along the normal.
//! 3. The witness points lie in the supporting planes, and that of b within the faces around its
//!    support.

use super::super::Depth;
use super::super::cso::Cso;
use crate::algebra::tolerance::{FLUSH_WITNESS, OFFSET_SLACK, PROOF_ROUNDING, VALIDATED_ANSWERS, WELL_FORMED_ROUNDING};

/// A defect of an answer.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(in crate::depth) enum DepthFault {
    /// The normal is not unit, or the points are not the depth apart along it.
    #[error("the points are not minus the depth apart along the normal: off by {0:e}")]
    Points(f64),
    /// The supports along the normal overlap by another length.
    #[error("the depth is {depth:e}, and the supports along the normal overlap by {gap:e}")]
    Gap {
        /// Depth of the answer, model units.
        depth: f64,
        /// Depth by the supports.
        gap: f64,
    },
    /// A witness is not in its body's supporting plane, or that of b is off b.
    #[error("a witness is {0:e} off its supporting feature")]
    Witness(f64),
}

impl Depth {
    /// True for one answer in [`VALIDATED_ANSWERS`], chosen by the last digits of the depth,
    /// so that the choice is the same in every run. Never for a pose that is not finite: its answer
    /// is only promised not to panic.
    pub(in crate::depth) fn is_sampled(&self) -> bool {
        let is_finite = self.point_a.is_finite() && self.point_b.is_finite() && self.depth.is_finite();
        is_finite && self.depth.to_bits().is_multiple_of(VALIDATED_ANSWERS)
    }

    /// Returns what is wrong with the answer.
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
    fn wrong_answers_are_named() {
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
