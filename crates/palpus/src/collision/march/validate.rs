//! Invariants of every result of the march, for any start.
//!
//! 1. The normal has the length 1, and point a is point b plus the distance times the normal.
//! 2. Each point lies on its feature.
//! 3. The planes through the points, perpendicular to the normal, separate the bodies: no vertex of
//!    a body reaches past its plane by more than the rounding that the march accepts. The fallback
//!    may stop before the closest points, but still proves the bodies apart.

use glam::DVec3;

use super::super::scale::Scale;
use super::super::{Closest, Proximity, StopReason};
use super::March;
use crate::algebra::tolerance::{COPLANAR, VALIDATED_ANSWERS, WELL_FORMED_ROUNDING};
use crate::algebra::{Placement, closest_on_segment};
use crate::body::Feature::{self, Edge, Face, Vertex};
use crate::body::Polytope;

/// A defect of a result of the march.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum MarchFault {
    /// The normal is not unit, or the difference of the points is not the distance times the
    /// normal.
    #[error("the difference of the points is not distance times normal: off by {0:e}")]
    Points(f64),
    /// A point is not on its feature.
    #[error("the point on {body} is {distance:e} away from its feature")]
    OffFeature {
        /// a or b.
        body: &'static str,
        /// Distance of the point from its feature, model units.
        distance: f64,
    },
    /// The bodies reach past the points along the normal.
    #[error("the bodies reach {excess:e} past the closest points, which are {distance:e} apart")]
    NotSeparating {
        /// Excess of both bodies together, model units.
        excess: f64,
        /// Distance of the points.
        distance: f64,
    },
}

impl March {
    /// Returns true for one result of every [`VALIDATED_ANSWERS`]. The last digits of the distance
    /// decide, so every run checks the same results.
    pub(super) fn is_sampled(&self) -> bool {
        match self.proximity {
            Proximity::Disjoint(Closest { distance, .. }) => {
                distance.is_finite() && distance.to_bits().is_multiple_of(VALIDATED_ANSWERS)
            }
            Proximity::Overlapping(_) => false,
        }
    }

    /// Returns the first defect of the result; an overlap needs no check.
    pub(super) fn validate(&self, a: &Polytope, b: &Polytope, pose_ba: &Placement) -> Result<(), MarchFault> {
        let Proximity::Disjoint(closest) = self.proximity else { return Ok(()) };
        let Closest { point_a, point_b, normal, distance, features } = closest;
        let scale = Scale::of(a, b, pose_ba);
        let pose_ab = pose_ba.inverse();
        let off = (point_a - point_b - normal * distance).length() + (normal.length() - 1.0).abs() * distance;
        if off.is_nan() || off > 2.0 * scale.noise + WELL_FORMED_ROUNDING * distance {
            return Err(MarchFault::Points(off));
        }
        // Merged faces are flat within their bulge. For nearly parallel features, rounding
        // decides where the points are.
        let allowed = scale.noise + COPLANAR * scale.size + a.bulge() + b.bulge();
        let on_a = (a, features.a, pose_ab.point(point_a), "a");
        for (polytope, feature, point, body) in [on_a, (b, features.b, point_b, "b")] {
            let distance = from_feature(polytope, feature, point);
            if distance > allowed {
                return Err(MarchFault::OffFeature { body, distance });
            }
        }
        let down = -pose_ab.vector(normal);
        let reach_a = a.climb(a.support(down), down).1 - down.dot(pose_ab.point(point_a));
        let reach_b = b.climb(b.support(normal), normal).1 - normal.dot(point_b);
        let excess = reach_a.max(0.0) + reach_b.max(0.0);
        let excused = match self.stop {
            StopReason::Converged => scale.loose(distance) + scale.tight(distance) + a.bulge() + b.bulge(),
            _ => distance,
        };
        if excess > excused { Err(MarchFault::NotSeparating { excess, distance }) } else { Ok(()) }
    }
}

/// Returns the approximate distance of a point from a feature. For a face, this is the height off
/// its plane, or above the planes of its neighbours.
///
/// A test against the edges of the face would be wrong. If a merged face bends and its neighbour is
/// nearly coplanar, their common edge is far from the intersection of their planes.
fn from_feature(polytope: &Polytope, feature: Feature, point: DVec3) -> f64 {
    match feature {
        Vertex(v) => polytope.vertex(v).distance(point),
        Edge(e) => from_edge(polytope, e, point),
        Face(f) => {
            let height = polytope.plane(f).height(point).abs();
            let above = polytope.face_edges(f).iter().map(|e| {
                let edge = polytope.edge(e);
                let other = if edge.left == f { edge.right } else { edge.left };
                polytope.plane(other).height(point)
            });
            above.fold(height, f64::max)
        }
    }
}

fn from_edge(polytope: &Polytope, e: u32, point: DVec3) -> f64 {
    let [tail, head] = [polytope.edge(e).tail, polytope.edge(e).head].map(|v| polytope.vertex(v));
    let along = closest_on_segment(point, tail, head);
    tail.lerp(head, along).distance(point)
}

#[cfg(test)]
mod tests {
    use super::super::super::oracle::{Random, cuboid};
    use super::super::{initial_features, march};
    use super::*;
    use crate::algebra::Pose;
    use crate::body::{Hull, convex_hull};

    const SEED: u64 = 0x3a4c_fa17;

    fn ball(random: &mut Random) -> Polytope {
        let points: Vec<DVec3> = (0..30).map(|_| random.direction()).collect();
        convex_hull(&points, 1e-9).ok().and_then(Hull::into_polytope).unwrap().0
    }

    #[test]
    fn wrong_answers_are_named() {
        let mut random = Random::new(SEED);
        let mut apart = 0;
        for case in 0..500 {
            let (a, b) = (ball(&mut random), cuboid(DVec3::new(1.0, 0.5, 0.2)));
            let pose_ba = Pose::new(random.rotation(), random.direction() * random.between(1.0, 4.0)).placement();
            let answer = march(&a, &b, &pose_ba, initial_features(&a, &b, &pose_ba));
            let what = format!("seed {SEED:#x}, case {case}");
            assert_eq!(answer.validate(&a, &b, &pose_ba), Ok(()), "{what}");
            let Proximity::Disjoint(closest) = answer.proximity else { continue };
            apart += 1;
            let fault = |closest: Closest| {
                let broken = March { proximity: Proximity::Disjoint(closest), ..answer };
                broken.validate(&a, &b, &pose_ba).expect_err("a wrong answer")
            };
            let longer = fault(Closest { distance: closest.distance * 1.01, ..closest });
            assert!(matches!(longer, MarchFault::Points(_)), "{what}: {longer}");
            let across = closest.normal.any_orthonormal_vector() * 0.5 * closest.distance;
            let beside = Closest { point_a: closest.point_a + across, point_b: closest.point_b + across, ..closest };
            assert!(matches!(fault(beside), MarchFault::OffFeature { .. }), "{what}");
            // The farthest pair of vertices lies on features, but does not separate the bodies.
            let far = |body: &Polytope, along: DVec3| body.vertex(body.support(along));
            let point_a = pose_ba.point(far(&a, pose_ba.inverse().vector(closest.normal)));
            let (v, w) = (a.support(pose_ba.inverse().vector(closest.normal)), b.support(-closest.normal));
            let point_b = b.vertex(w);
            let distance = point_a.distance(point_b);
            let farthest = Closest {
                point_a,
                point_b,
                distance,
                normal: (point_a - point_b) / distance,
                features: crate::body::FeaturePair { a: Vertex(v), b: Vertex(w) },
            };
            assert!(matches!(fault(farthest), MarchFault::NotSeparating { .. }), "{what}");
        }
        assert!(apart > 100, "seed {SEED:#x}: {apart}");
    }

    #[test]
    fn point_on_a_bent_merged_face_is_accepted() {
        let mut random = Random::new(SEED);
        let tip = ball(&mut random);
        for case in 0..2000 {
            // A nearly flat cap, with merged faces that are slightly bent.
            let mut cap: Vec<DVec3> = (0..40)
                .map(|_| DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0))
                .map(|at| DVec3 { z: -0.02 * at.length_squared(), ..at })
                .collect();
            cap.push(DVec3::NEG_Z);
            let (cap, _) = convex_hull(&cap, 1e-3).ok().and_then(Hull::into_polytope).unwrap();
            let place = DVec3::new(random.between(-0.8, 0.8), random.between(-0.8, 0.8), 1.0);
            let pose_ba = Pose::new(random.rotation(), place).placement();
            let answer = march(&tip, &cap, &pose_ba, initial_features(&tip, &cap, &pose_ba));
            assert_eq!(answer.validate(&tip, &cap, &pose_ba), Ok(()), "seed {SEED:#x}, case {case}");
        }
    }
}
