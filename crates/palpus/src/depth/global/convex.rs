//! Two convex solids: the certified depth of the pair is the answer.
//!
//! A piece may reach beyond the solid by rounding of the file. The cell lies within the solid, and the
//! lower bound is that of the cells.

use glam::DVec3;

use super::scene::Scene;
use super::{GlobalDepth, GlobalMemory};
use crate::algebra::Pose;
use crate::depth::{Certainty, CertificateMemory, ProofScratch, WalkScratch, depth_proven};

/// Working memory of the certified depth.
#[derive(Clone, Debug)]
pub(super) struct ConvexMemory {
    certificate: CertificateMemory,
    proof: ProofScratch,
    walk: WalkScratch,
}

/// The lower bound and a verified free translation, if both bodies are convex and the depth is
/// proven.
pub(super) fn convex_depth(
    query: &GlobalDepth<'_>,
    pose_ba: &Pose,
    scene: &mut Scene<'_>,
    memory: &mut GlobalMemory,
) -> Option<(f64, DVec3)> {
    let shortfall = query.interior_a.convex? + query.interior_b.convex?;
    let memory = memory.convex.get_or_insert_with(|| {
        Box::new(ConvexMemory {
            certificate: CertificateMemory::default(),
            proof: ProofScratch::new(),
            walk: WalkScratch::new(),
        })
    });
    let (a, b) = (&query.a.polytopes()[0], &query.b.polytopes()[0]);
    let ConvexMemory { certificate, proof, walk } = &mut **memory;
    let answer = depth_proven(a, b, &pose_ba.placement(), &[], certificate, proof, walk);
    if answer.certainty != Certainty::GloballyOptimal || answer.depth <= 0.0 {
        return None;
    }
    scene.evaluations += u64::from(answer.steps) + 1;
    let free = answer.normal * (answer.depth + scene.hair);
    scene.verified(free).then_some((answer.depth - shortfall, free))
}
