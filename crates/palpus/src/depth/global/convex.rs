//! Two convex solids: the certified depth of the pair is the answer.

use glam::DVec3;

use super::scene::Scene;
use super::{GlobalDepth, GlobalMemory};
use crate::algebra::Pose;
use crate::algebra::tolerance::DEPTH_ROUNDING;
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
    if !query.interior_a.convex || !query.interior_b.convex {
        return None;
    }
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
    let size = query.a.size().max(query.b.size());
    scene.verified(free).then_some((answer.depth - DEPTH_ROUNDING * size, free))
}
