//! Computes the penetration depth of two overlapping convex polytopes \[K02 §3.3\].
//!
//! 1. Every seed gives a start: a hub pair and an upper bound of the depth.
//! 2. If the seeds contain the pair's previous answer (warm start), descend from the facet of that
//!    answer. If the descent fails, or if another seed has a smaller offset, walk from the lowest
//!    start. Without a previous answer (cold start), walk from each seed, and from the lowest of
//!    some face normals.
//! 3. Measure the end of the walk with true supports. If the supports give a larger offset than the
//!    walk, continue the walk from them. If the end is not a local minimum, continue the walk from
//!    a tilted normal.
//! 4. Compute the witness points.
//!
//! Because of step 3, the depth is always the exact h of the returned normal: moving a by the depth
//! along the normal separates the pair. A walk can only miss a direction that has a smaller h.

mod validate;

use glam::DVec3;

use super::antipodal::Facet;
use super::cso::Cso;
use super::descent::{Bottom, descend};
use super::overlay::Corner;
use super::seed::{Seed, Start};
use super::walk::{Trail, Walked};
use super::witness::{Clip, witness};
use super::{Antipodal, Certainty, Depth, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::{
    COLD_FACES, COLD_WALKS, FLUSH_WITNESS, OFFSET_SLACK, STRAY, TILT_SHRINK, TILTS, WALK_DECREASE, WALK_RESUMES,
};
use crate::body::Polytope;
use crate::collision::StopReason;

/// Working memory of depth queries, of fixed size. One value serves any number of pairs, one after
/// another.
#[derive(Clone, Debug)]
pub struct WalkScratch {
    pub(super) trail: Trail,
    pub(super) clip: Clip,
}

impl WalkScratch {
    /// Allocates all the memory that a query needs.
    pub fn new() -> Self {
        Self { trail: Trail::new(), clip: Clip::new() }
    }
}

impl Default for WalkScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the penetration depth of `a` and `b` in b's frame, in the length unit of the polytopes;
/// `p_b = pose_ba.point(p_a)`.
///
/// The pair should overlap. If it does not, the depth is negative, and the distance is at least its
/// absolute value. If `seeds` is empty, the walk starts along the line between the centroids.
pub fn depth(a: &Polytope, b: &Polytope, pose_ba: &Placement, seeds: &[Seed], scratch: &mut WalkScratch) -> Depth {
    let cso = Cso { a, b, pose_ba };
    scratch.trail.clear();
    // The usual case: a contact that already existed in the previous tick.
    if let [Seed::Previous { antipodal: Some(antipodal), .. }] = *seeds
        && let Some(walked) = walk_downhill(&cso, antipodal, true, &mut scratch.trail)
    {
        return answer_at(&cso, &walked, &mut scratch.clip);
    }
    let warm = seeds.iter().any(|seed| matches!(seed, Seed::Previous { .. }));
    let best = if warm {
        walk_warm(&cso, seeds, true, &mut scratch.trail)
    } else {
        walk_cold(&cso, seeds, &mut scratch.trail)
    };
    let walked = best.unwrap_or_else(|| scan(&cso));
    answer_at(&cso, &walked, &mut scratch.clip)
}

/// Returns the depth at the end of one walk from the lowest seed. The caller proves the result.
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
    let walked = walk_warm(&cso, seeds, false, &mut scratch.trail).unwrap_or_else(|| scan(&cso));
    answer_at(&cso, &walked, &mut scratch.clip)
}

/// Returns the start with the smallest offset among all seeds. If no seed gives a direction,
/// returns the start along the line between the centroids. If the centroids coincide, returns the
/// start along x.
pub(super) fn lowest_start(cso: &Cso<'_>, seeds: &[Seed]) -> Start {
    let starts = seeds.iter().filter_map(|seed| Start::of(cso, seed, FIRST));
    let lowest = starts.reduce(|lowest, start| if start.offset < lowest.offset { start } else { lowest });
    lowest.or_else(|| Start::of(cso, &Seed::CentroidLine, FIRST)).unwrap_or_else(|| {
        let (hub, offset) = cso.support_anew(DVec3::X);
        Start { hub, normal: DVec3::X, offset }
    })
}

/// Descends from the facet of the previous answer. If that fails, or if another seed is lower,
/// walks from the lowest seed. If not `thorough`, facets that share only a corner are not tested; a
/// proof tests them later.
#[inline]
fn walk_warm(cso: &Cso<'_>, seeds: &[Seed], thorough: bool, trail: &mut Trail) -> Option<Walked> {
    let last = seeds.iter().find_map(|seed| match *seed {
        Seed::Previous { antipodal, .. } => walk_downhill(cso, antipodal?, thorough, trail),
        _ => None,
    });
    let hint = last.map_or(FIRST, |walked| walked.corner.hub);
    let others = seeds.iter().filter(|seed| last.is_none() || !matches!(seed, Seed::Previous { .. }));
    let mut lowest: Option<Start> = None;
    for seed in others {
        let hint = lowest.map_or(hint, |start| start.hub);
        if let Some(start) = Start::of(cso, seed, hint)
            && lowest.is_none_or(|best| start.offset < best.offset)
        {
            lowest = Some(start);
        }
    }
    match (last, lowest) {
        // Another seed has a smaller offset than the facet of the previous answer.
        (Some(last), Some(start)) if start.offset < last.corner.offset => {
            walk_from(cso, start, thorough, trail).or(Some(last))
        }
        (Some(last), _) => Some(last),
        (None, start) => walk_from(cso, start?, thorough, trail),
    }
}

/// Descends from the facet of `antipodal`. If a lower facet lies beyond a corner, continues with
/// the walk over hubs.
#[inline]
fn walk_downhill(cso: &Cso<'_>, antipodal: Antipodal, thorough: bool, trail: &mut Trail) -> Option<Walked> {
    let Bottom { walked, doubt } = descend(cso, antipodal, thorough)?;
    let bar = walked.corner.offset - WALK_DECREASE * cso.size();
    match doubt.hubs().iter().find_map(|&hub| trail.lower_at(cso, hub, bar)) {
        None => Some(walked),
        Some(Corner { normal, offset, hub, .. }) => walk_to_end(cso, Start { hub, normal, offset }, trail),
    }
}

/// Descends from the lowest facet at a start. If the descent fails, walks over hubs.
pub(super) fn walk_from(cso: &Cso<'_>, start: Start, thorough: bool, trail: &mut Trail) -> Option<Walked> {
    let first = trail.first_corner(cso, &start)?;
    walk_downhill(cso, first.antipodal, thorough, trail).or_else(|| walk_to_end(cso, start, trail))
}

/// Walks from every seed, and from the lowest of some face normals.
fn walk_cold(cso: &Cso<'_>, seeds: &[Seed], trail: &mut Trail) -> Option<Walked> {
    let seeds = if seeds.is_empty() { &[Seed::CentroidLine] } else { seeds };
    let mut best = Lowest { walked: None, steps: 0 };
    for start in seeds.iter().filter_map(|seed| Start::of(cso, seed, FIRST)) {
        best.walk_from(cso, &start, trail);
    }
    for start in lowest_faces(cso).iter().flatten() {
        best.walk_from(cso, start, trail);
    }
    best.walked.map(|walked| Walked { steps: best.steps, ..walked })
}

/// The lowest end of several walks, and the number of steps of all of them.
struct Lowest {
    walked: Option<Walked>,
    steps: u32,
}

impl Lowest {
    fn walk_from(&mut self, cso: &Cso<'_>, start: &Start, trail: &mut Trail) {
        let Some(walked) = walk_from(cso, *start, true, trail) else { return };
        self.steps += walked.steps;
        if self.walked.is_none_or(|best| walked.corner.offset < best.corner.offset) {
            self.walked = Some(walked);
        }
    }
}

/// Returns the starts with the smallest offset among evenly spaced face normals of both bodies.
fn lowest_faces(cso: &Cso<'_>) -> [Option<Start>; COLD_WALKS] {
    let mut lowest: [Option<Start>; COLD_WALKS] = [None; COLD_WALKS];
    let mut attempt = |normal: DVec3| {
        let Some(mut start) = Start::anew(cso, normal) else { return };
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

/// Hub pair from which a climb starts without a hint.
const FIRST: HubPair = HubPair { a: 0, b: 0 };

/// Walks until the end is confirmed, and returns the lowest end that was measured.
pub(super) fn walk_to_end(cso: &Cso<'_>, start: Start, trail: &mut Trail) -> Option<Walked> {
    let slack = OFFSET_SLACK * cso.size();
    let mut best: Option<Walked> = None;
    let mut next = Some(start);
    let mut steps = 0;
    for _ in 0..=WALK_RESUMES {
        let Some(walked) = next.and_then(|start| trail.walk(cso, &start)) else { break };
        steps += walked.steps;
        let corner = measured(cso, &walked.corner);
        if best.is_none_or(|best| corner.offset < best.corner.offset) {
            best = Some(Walked { corner, ..walked });
        }
        next = if corner.offset - walked.corner.offset > slack {
            Some(Start { hub: corner.hub, normal: corner.normal, offset: corner.offset })
        } else {
            lower_beside(cso, &corner)
        };
    }
    best.map(|best| Walked { steps, stop: if next.is_none() { best.stop } else { StopReason::Stalled }, ..best })
}

/// Returns a lower start next to a corner that is not a local minimum of h. `None` if the
/// corner is a local minimum.
///
/// Overlaps of normal cones are only as accurate as the faces are flat. Inaccurate overlaps may
/// leave a gap, and then a walk stops too early. In that case the origin lies beyond a side of the
/// facet, and tilting the normal toward that side decreases h.
fn lower_beside(cso: &Cso<'_>, corner: &Corner) -> Option<Start> {
    let side = Facet::at(cso, corner, FLUSH_WITNESS).farthest_side(cso)?;
    let size = cso.size();
    if side.beyond <= STRAY * STRAY * size * size {
        return None;
    }
    let outward = side.outward.normalize_or_zero();
    let mut tilt = side.beyond.sqrt() / size;
    for _ in 0..TILTS {
        let start = Start::along(cso, corner.normal + outward * tilt, corner.hub)?;
        if start.offset < corner.offset - WALK_DECREASE * size {
            return Some(start);
        }
        tilt *= TILT_SHRINK;
    }
    None
}

/// Returns the lowest face of both bodies, as an answer without a walk.
pub(super) fn scan(cso: &Cso<'_>) -> Walked {
    let corner = lowest_face(cso).unwrap_or_else(|| {
        let antipodal = Antipodal::VertexFace { a: 0, b: 0 };
        measured(cso, &Corner { normal: DVec3::X, offset: 0.0, antipodal, hub: FIRST })
    });
    Walked { corner, alone: false, steps: 0, stop: StopReason::Stalled }
}

/// Returns the corner with its true offset and with a hub pair that supports its normal.
pub(super) fn measured(cso: &Cso<'_>, corner: &Corner) -> Corner {
    let (hub, offset) = cso.support(corner.hub, corner.normal);
    Corner { hub, offset, ..*corner }
}

/// Returns the face with the smallest offset among all faces of both bodies, with its true support.
/// Unlike a walk, this search needs no hub pair to start from.
fn lowest_face(cso: &Cso<'_>) -> Option<Corner> {
    let mut found: Option<Corner> = None;
    let mut hub = FIRST;
    let mut look = |antipodal: fn(u32, HubPair) -> Antipodal, face: u32| {
        let Some(start) = cso.face_normal(antipodal(face, hub)).and_then(|normal| Start::along(cso, normal, hub))
        else {
            return;
        };
        hub = start.hub;
        if found.is_none_or(|best| start.offset < best.offset) {
            found = Some(Corner { normal: start.normal, offset: start.offset, antipodal: antipodal(face, hub), hub });
        }
    };
    for face in 0..cso.b.face_count() as u32 {
        look(|face, hub| Antipodal::VertexFace { a: hub.a, b: face }, face);
    }
    for face in 0..cso.a.face_count() as u32 {
        look(|face, hub| Antipodal::FaceVertex { a: face, b: hub.b }, face);
    }
    found
}

/// Returns the answer at the measured end of a walk.
#[inline]
pub(super) fn answer_at(cso: &Cso<'_>, walked: &Walked, clip: &mut Clip) -> Depth {
    let Walked { corner, alone, steps, stop } = walked;
    let facet = if *alone { Facet::spanned(cso, corner) } else { Facet::at(cso, corner, FLUSH_WITNESS) };
    let (point_a, point_b) = witness(cso, &facet, corner, clip);
    let answer = Depth {
        point_a,
        point_b,
        normal: corner.normal,
        depth: corner.offset,
        antipodal: corner.antipodal,
        hub: corner.hub,
        certainty: Certainty::LocallyOptimal,
        steps: *steps,
        stop: *stop,
    };
    debug_assert!(!answer.is_sampled() || answer.validate(cso) == Ok(()), "{:?}", answer.validate(cso));
    answer
}
