//! The query for two convex solids. The query returns the certified depth of their convex pieces,
//! or the distance of these pieces.
//!
//! The query verifies every free translation: a plane must lie between the vertices of the two
//! meshes. A piece may be slightly larger than its solid, because the coordinates in the file are
//! rounded. So the lower bound is reduced by the difference.

use glam::DVec3;

use super::GlobalDepth;
use crate::algebra::Pose;
use crate::algebra::tolerance::DEPTH_HAIR;
use crate::body::{Body, FeaturePair, Polytope};
use crate::collision::{Proximity, initial_features, march};
use crate::depth::{Certainty, CertificateMemory, DepthScratch, depth_proven};

/// Number of minima computed in parallel.
const LANES: usize = 8;

/// Working memory of the certified depth.
#[derive(Clone, Debug)]
pub(super) struct ConvexMemory {
    features: Option<FeaturePair>,
    certificate: CertificateMemory,
    scratch: DepthScratch,
}

/// Proven bounds of two convex bodies at a pose.
pub(super) enum ConvexPair {
    /// The bodies are separate, at this distance (model units).
    Apart(f64),
    /// The bodies overlap.
    Overlap {
        /// Lower bound of the depth.
        lower: f64,
        /// A verified free translation.
        free: DVec3,
        /// True if neither body lies in the other.
        partly: bool,
        evaluations: u64,
    },
}

/// Returns the result for `pose_ba`. `None` if a body is not convex, or if the result is not
/// proven.
pub(super) fn convex_pair(
    query: &GlobalDepth<'_>,
    pose_ba: &Pose,
    memory: &mut Option<Box<ConvexMemory>>,
) -> Option<ConvexPair> {
    let shortfall = query.interior_a.convex? + query.interior_b.convex?;
    let (a, b) = (&query.a.polytopes()[0], &query.b.polytopes()[0]);
    let ConvexMemory { features, certificate, scratch } = &mut **memory.get_or_insert_with(|| {
        Box::new(ConvexMemory {
            features: None,
            certificate: CertificateMemory::default(),
            scratch: DepthScratch::new(),
        })
    });
    let place = pose_ba.placement();
    let start = features.unwrap_or_else(|| initial_features(a, b, &place));
    let found = march(a, b, &place, start);
    *features = Some(found.features);
    if let Proximity::Disjoint(closest) = found.proximity {
        let free = parted(query, pose_ba, closest.normal, DVec3::ZERO);
        return free.then_some(ConvexPair::Apart(closest.distance));
    }
    let answer = depth_proven(a, b, &place, &[], certificate, scratch);
    if answer.certainty != Certainty::GloballyOptimal || answer.depth <= 0.0 {
        return None;
    }
    let free = answer.normal * (answer.depth + DEPTH_HAIR * query.a.size().min(query.b.size()));
    parted(query, pose_ba, answer.normal, free).then(|| ConvexPair::Overlap {
        lower: answer.depth - shortfall,
        free,
        partly: sticks_out(query.a, b, pose_ba) && sticks_out(query.b, a, &pose_ba.inverse()),
        evaluations: u64::from(answer.steps) + 1,
    })
}

/// Returns true if a plane perpendicular to `normal` separates the vertices of b's mesh from the
/// vertices of a's mesh, with body a moved by `t`.
fn parted(query: &GlobalDepth<'_>, pose_ba: &Pose, normal: DVec3, t: DVec3) -> bool {
    let normal_a = pose_ba.inverse().vector(normal);
    let (a, b) = (query.a.mesh().vertices(), query.b.mesh().vertices());
    let (low, high) = (lowest(a, normal_a), -lowest(b, -normal));
    low + normal.dot(pose_ba.translation + t) > high
}

/// Returns the least height of the points along `normal`. The processor computes several
/// independent minima in parallel: 1.1 µs for 2000 points, compared with 3.0 µs for a single
/// minimum.
fn lowest(points: &[DVec3], normal: DVec3) -> f64 {
    let mut least = [f64::INFINITY; LANES];
    let (chunks, rest) = points.as_chunks::<LANES>();
    for chunk in chunks {
        for (least, point) in least.iter_mut().zip(chunk) {
            let height = normal.dot(*point);
            *least = if height < *least { height } else { *least };
        }
    }
    rest.iter().map(|point| normal.dot(*point)).chain(least).fold(f64::INFINITY, f64::min)
}

/// Returns true if a vertex of `body` lies clearly outside `other`. `body` is placed at `pose` in
/// the frame of `other`.
fn sticks_out(body: &Body, other: &Polytope, pose: &Pose) -> bool {
    let hair = DEPTH_HAIR * body.size();
    let place = pose.placement();
    let outside = |p: DVec3| other.planes().iter().any(|plane| plane.height(p) > hair);
    body.mesh().vertices().iter().any(|&p| outside(place.point(p)))
}
