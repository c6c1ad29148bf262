//! The penetration depth of two overlapping convex polytopes \[K02 §3.3\].
//!
//! 1. Every seed becomes a start: a hub pair and an upper bound of the depth.
//! 2. With the pair's previous answer among the seeds (warm), walk from the lowest start; without (cold), from each, and from the
//!    lowest of some face normals.
//! 3. Measure the end of the walk with true supports; if they say more than the walk did, walk on from them.
//! 4. Give it its witness points.
//!
//! Whatever the walk does, step 3 makes the depth the exact h of the normal that is returned: moving a by it separates the
//! pair. What a walk can miss is only a direction of still smaller h.

use glam::DVec3;

use super::antipodal::Facet;
use super::cso::Cso;
use super::original::lowest_face;
use super::overlay::{AdmitAll, Corner};
use super::seed::{Seed, Start};
use super::walk::{Trail, Walked};
use super::witness::{Clip, witness};
use super::{Antipodal, Certainty, Depth, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::{COLD_FACES, COLD_WALKS, OFFSET_SLACK, WALK_RESUMES};
use crate::body::Polytope;
use crate::collision::StopReason;

/// Working memory of depth queries, of fixed size; one may serve any number of pairs, one after another.
#[derive(Clone, Debug)]
pub struct WalkScratch {
    pub(super) trail: Trail,
    pub(super) clip: Clip,
}

impl WalkScratch {
    /// All the memory that any query needs.
    pub fn new() -> Self {
        Self { trail: Trail::new(), clip: Clip::new() }
    }
}

impl Default for WalkScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// The penetration depth of `a` and `b`, in b's frame, with `p_b = pose_ba.point(p_a)`.
///
/// The pair should overlap; for one that does not, the depth is negative and the pair apart by at least that much.
/// Without any seed the line between the centroids is one.
pub fn depth(a: &Polytope, b: &Polytope, pose_ba: &Placement, seeds: &[Seed], scratch: &mut WalkScratch) -> Depth {
    let cso = Cso { a, b, pose_ba };
    scratch.trail.clear();
    let warm = seeds.iter().any(|seed| matches!(seed, Seed::Previous { .. }));
    let best =
        if warm { walk_warm(&cso, seeds, &mut scratch.trail) } else { walk_cold(&cso, seeds, &mut scratch.trail) };
    let Walked { corner, steps, stop } = best.unwrap_or_else(|| scan(&cso));
    answer_at(&cso, &corner, steps, stop, &mut scratch.clip)
}

/// The depth where one walk ends that starts from the lowest of the seeds.
pub(super) fn depth_once(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    seeds: &[Seed],
    scratch: &mut WalkScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    scratch.trail.clear();
    let seeds = if seeds.is_empty() { &[Seed::CentroidLine] } else { seeds };
    let Walked { corner, steps, stop } = walk_warm(&cso, seeds, &mut scratch.trail).unwrap_or_else(|| scan(&cso));
    answer_at(&cso, &corner, steps, stop, &mut scratch.clip)
}

/// One walk, from the lowest of the seeds.
fn walk_warm(cso: &Cso<'_>, seeds: &[Seed], trail: &mut Trail) -> Option<Walked> {
    let mut lowest: Option<Start> = None;
    for seed in seeds {
        let hint = lowest.map_or(FIRST, |start| start.hub);
        if let Some(start) = Start::of(cso, seed, hint)
            && lowest.is_none_or(|best| start.offset < best.offset)
        {
            lowest = Some(start);
        }
    }
    walk_to_end(cso, lowest?.hub, trail)
}

/// A walk from every seed, and from the lowest of some face normals.
fn walk_cold(cso: &Cso<'_>, seeds: &[Seed], trail: &mut Trail) -> Option<Walked> {
    let seeds = if seeds.is_empty() { &[Seed::CentroidLine] } else { seeds };
    let mut best = Lowest { walked: None, steps: 0 };
    let mut hint = FIRST;
    for start in seeds.iter().filter_map(|seed| Start::of(cso, seed, FIRST)) {
        hint = start.hub;
        best.walk_from(cso, &start, trail);
    }
    for start in lowest_faces(cso, hint).iter().flatten() {
        best.walk_from(cso, start, trail);
    }
    best.walked.map(|walked| Walked { steps: best.steps, ..walked })
}

/// The best of several walks.
struct Lowest {
    walked: Option<Walked>,
    steps: u32,
}

impl Lowest {
    fn walk_from(&mut self, cso: &Cso<'_>, start: &Start, trail: &mut Trail) {
        let Some(walked) = walk_to_end(cso, start.hub, trail) else { return };
        self.steps += walked.steps;
        if self.walked.is_none_or(|best| walked.corner.offset < best.corner.offset) {
            self.walked = Some(walked);
        }
    }
}

/// The starts of least offset among evenly chosen face normals of both bodies.
fn lowest_faces(cso: &Cso<'_>, hint: HubPair) -> [Option<Start>; COLD_WALKS] {
    let mut lowest: [Option<Start>; COLD_WALKS] = [None; COLD_WALKS];
    let mut hint = hint;
    let mut attempt = |normal: DVec3| {
        let Some(mut start) = Start::along(cso, normal, hint) else { return };
        hint = start.hub;
        for place in &mut lowest {
            match place {
                Some(lower) if lower.offset <= start.offset => {}
                Some(higher) => std::mem::swap(higher, &mut start),
                None => {
                    *place = Some(start);
                    return;
                }
            }
        }
    };
    let stride = |polytope: &Polytope| polytope.face_count().div_ceil(COLD_FACES).max(1);
    for plane in cso.b.planes().iter().step_by(stride(cso.b)) {
        attempt(plane.normal);
    }
    for plane in cso.a.planes().iter().step_by(stride(cso.a)) {
        attempt(-cso.pose_ba.vector(plane.normal));
    }
    lowest
}

/// Where a climb starts that knows nothing.
const FIRST: HubPair = HubPair { a: 0, b: 0 };

/// Walks until true supports confirm the offset of the end.
pub(super) fn walk_to_end(cso: &Cso<'_>, hub: HubPair, trail: &mut Trail) -> Option<Walked> {
    let slack = OFFSET_SLACK * cso.size();
    let mut best: Option<Walked> = None;
    let mut hub = hub;
    let mut steps = 0;
    for _ in 0..=WALK_RESUMES {
        let Some(walked) = trail.walk(cso, hub) else { break };
        steps += walked.steps;
        let corner = measured(cso, &walked.corner);
        if best.is_none_or(|best| corner.offset < best.corner.offset) {
            best = Some(Walked { corner, ..walked });
        }
        if corner.offset - walked.corner.offset <= slack {
            break;
        }
        hub = corner.hub;
    }
    best.map(|best| Walked { steps, ..best })
}

/// The end of no walk: the best face of all.
fn scan(cso: &Cso<'_>) -> Walked {
    let corner = lowest_face(cso, FIRST, &AdmitAll).unwrap_or_else(|| {
        let antipodal = Antipodal::VertexFace { a: 0, b: 0 };
        measured(cso, &Corner { normal: DVec3::X, offset: 0.0, antipodal, hub: FIRST })
    });
    Walked { corner, steps: 0, stop: StopReason::Stalled }
}

/// The corner with its true offset and a hub pair that supports it.
pub(super) fn measured(cso: &Cso<'_>, corner: &Corner) -> Corner {
    let (hub, offset) = cso.support(corner.hub, corner.normal);
    Corner { hub, offset, ..*corner }
}

/// The answer at a corner that was measured.
pub(super) fn answer_at(cso: &Cso<'_>, corner: &Corner, steps: u32, stop: StopReason, clip: &mut Clip) -> Depth {
    let facet = Facet::at(cso, corner);
    let (point_a, point_b) = witness(cso, &facet, corner.offset, clip);
    Depth {
        point_a,
        point_b,
        normal: corner.normal,
        depth: corner.offset,
        antipodal: corner.antipodal,
        hub: corner.hub,
        certainty: Certainty::LocallyOptimal,
        steps,
        stop,
    }
}
