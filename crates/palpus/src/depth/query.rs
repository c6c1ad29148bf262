//! The penetration depth of two overlapping convex polytopes \[K02 §3.3\].
//!
//! 1. If the seeds contain the pair's previous answer, walk downhill from the facet of that answer.
//!    If no other seed has a smaller offset than the end of the walk, the end is the answer. The
//!    answer is then a local minimum of h.
//! 2. Otherwise grow a new surface inside the CSO (see `certificate`), starting with the lowest
//!    seed. The surface gives the direction of the depth, and in most cases a proof.
//! 3. Compute the witness points.
//!
//! The depth is always the exact h of the returned normal: moving body a by the depth along the
//! normal separates the pair. A result of the walk alone may miss a direction with a smaller h.
//!
//! Deviation from \[K02\]: without a previous answer, the paper walks from one start. At some
//! percent of random poses, this walk ends in a local minimum that is not the global minimum. With
//! more starts, local minima are rare, but the walks then cost two to three times as much as the
//! surface. The surface nearly always finds the smallest depth.

use super::certificate::{CertificateMemory, Search};
use super::cso::Cso;
use super::inner::Surface;
use super::seed::{Seed, Start};
use super::walk::{Overlays, Walked, walk};
use super::witness::{Clip, answer_at};
use super::{Depth, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::OFFSET_SLACK;
use crate::body::Polytope;

/// Working memory of depth queries, of fixed size. Any number of pairs can use it, one after
/// another.
#[derive(Clone, Debug)]
pub struct DepthScratch {
    pub(super) clip: Clip,
    overlays: Overlays,
    surface: Surface,
    growths: u32,
}

impl DepthScratch {
    /// Allocates all the memory that a query needs.
    pub fn new() -> Self {
        Self { clip: Clip::new(), overlays: Overlays::new(), surface: Surface::new(), growths: 0 }
    }

    /// Returns the number of growth steps in the last query that used a surface.
    pub fn growths(&self) -> u32 {
        self.growths
    }

    /// Searches with a surface, starting from `best`, the direction of the least known h. `answer`
    /// is the depth answer along `best`, if known.
    fn search(
        &mut self,
        cso: &Cso<'_>,
        best: Start,
        answer: Option<Depth>,
        run: impl FnOnce(&mut Search<'_, '_>) -> Depth,
    ) -> Depth {
        let mut search = Search::new(cso, best, answer, &mut self.surface, &mut self.clip);
        let answer = run(&mut search);
        self.growths = search.growths;
        answer
    }
}

impl Default for DepthScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the penetration depth of `a` and `b`, in b's frame, with `p_b = pose_ba.point(p_a)`.
///
/// The pair should overlap. If the pair is apart, the depth is negative, and the distance is at
/// least its absolute value. If `seeds` is empty, the search starts along the line between the
/// centroids.
pub fn depth(a: &Polytope, b: &Polytope, pose_ba: &Placement, seeds: &[Seed], scratch: &mut DepthScratch) -> Depth {
    let cso = Cso { a, b, pose_ba };
    match coherent(&cso, seeds, Some(&mut scratch.overlays)) {
        Some(walked) => answer_at(&cso, &walked, &mut scratch.clip),
        None => scratch.search(&cso, lowest_start(&cso, seeds), None, |search| search.run_anew()),
    }
}

/// Returns the penetration depth of `a` and `b`, with a proof if one is found.
///
/// `memory` must belong to the same two polytopes at an earlier pose, or be empty. If it contains a
/// surface of an earlier tick, the query walks downhill from the previous answer and repairs the
/// surface. Otherwise the query grows a new surface, which gives the direction.
///
/// If the proof is complete, the certainty of the returned depth is
/// [`GloballyOptimal`](super::Certainty::GloballyOptimal). If the proof is incomplete, the query
/// returns the best known answer and clears the memory. The `stop` of the answer states why the
/// proof ended. A result with negative depth (a separate pair) is not proven; use a distance query
/// for separate pairs.
pub fn depth_proven(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    seeds: &[Seed],
    memory: &mut CertificateMemory,
    scratch: &mut DepthScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    let walked = if memory.serves(&cso) { coherent(&cso, seeds, None) } else { None };
    let answer = walked.map(|walked| answer_at(&cso, &walked, &mut scratch.clip));
    let best = match answer {
        Some(Depth { hub, normal, depth, .. }) => Start { hub, normal, offset: depth },
        None => lowest_start(&cso, seeds),
    };
    scratch.search(&cso, best, answer, |search| search.run(memory))
}

/// Returns the end of a walk downhill from the previous answer. `None` if the seeds contain no
/// facet of that answer, if the walk finds no depth, or if another seed has a smaller offset.
#[inline]
fn coherent(cso: &Cso<'_>, seeds: &[Seed], overlays: Option<&mut Overlays>) -> Option<Walked> {
    let last = seeds.iter().find_map(|seed| match *seed {
        Seed::Previous { antipodal, .. } => antipodal,
        _ => None,
    });
    let walked = walk(cso, last?, overlays)?;
    let bar = walked.corner.offset - OFFSET_SLACK * cso.size();
    let mut others = seeds.iter().filter(|seed| !matches!(seed, Seed::Previous { .. }));
    let is_lower = |seed: &Seed| Start::of(cso, seed, walked.corner.hub).is_some_and(|start| start.offset < bar);
    (!others.any(is_lower)).then_some(walked)
}

/// Returns the start with the smallest offset of all seeds. If no seed gives a direction, returns
/// the start along the line between the centroids. If the centroids coincide too, returns the start
/// along x.
fn lowest_start(cso: &Cso<'_>, seeds: &[Seed]) -> Start {
    const FIRST: HubPair = HubPair { a: 0, b: 0 };
    let starts = seeds.iter().filter_map(|seed| Start::of(cso, seed, FIRST));
    let lowest = starts.reduce(|lowest, start| if start.offset < lowest.offset { start } else { lowest });
    lowest.or_else(|| Start::of(cso, &Seed::CentroidLine, FIRST)).unwrap_or_else(|| {
        let (hub, offset) = cso.support_anew(glam::DVec3::X);
        Start { hub, normal: glam::DVec3::X, offset }
    })
}
