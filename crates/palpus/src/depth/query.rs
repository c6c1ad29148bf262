//! The penetration depth of two overlapping convex polytopes \[K02 §3.3\].
//!
//! 1. With an answer of the last tick, walk downhill from its facet. If no other seed is lower than
//!    the end of the walk, that end is the answer, a local minimum of h.
//! 2. Otherwise grow a surface within the CSO from nothing (see the certificate), from the lowest
//!    of the seeds. It finds the direction of the depth, and mostly proves it.
//! 3. Compute the witness points.
//!
//! In any case the depth is the exact h of the returned normal: moving a by the depth along it
//! separates the pair. Only a walk can miss a direction of smaller h.
//!
//! Deviation from \[K02\], which walks from one start also when there is no last answer. A cold
//! walk ends in a local minimum for some percent of random poses. With enough starts to make this
//! rare, walks cost two to three times as much as the surface, which nearly always finds the least
//! depth.

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

/// Working memory of depth queries, of fixed size; one may serve any number of pairs, one after
/// another.
#[derive(Clone, Debug)]
pub struct DepthScratch {
    pub(super) clip: Clip,
    overlays: Overlays,
    surface: Surface,
    growths: u32,
}

impl DepthScratch {
    /// All the memory that any query needs.
    pub fn new() -> Self {
        Self { clip: Clip::new(), overlays: Overlays::new(), surface: Surface::new(), growths: 0 }
    }

    /// How often the surface grew in the last query that used one.
    pub fn growths(&self) -> u32 {
        self.growths
    }

    /// Searches with a surface, starting from `best`, the direction of the least known h; `answer`
    /// is the depth answer there, if it is known.
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

/// The penetration depth of `a` and `b`, in b's frame, with `p_b = pose_ba.point(p_a)`.
///
/// The pair should overlap; for one that does not, the depth is negative and the pair apart by at
/// least that much. Without any seed the line between the centroids is one.
pub fn depth(a: &Polytope, b: &Polytope, pose_ba: &Placement, seeds: &[Seed], scratch: &mut DepthScratch) -> Depth {
    let cso = Cso { a, b, pose_ba };
    match coherent(&cso, seeds, Some(&mut scratch.overlays)) {
        Some(walked) => answer_at(&cso, &walked, &mut scratch.clip),
        None => scratch.search(&cso, lowest_start(&cso, seeds), None, |search| search.run_anew()),
    }
}

/// The penetration depth of `a` and `b`, with a proof if one is found.
///
/// `memory` is that of the same two polytopes, from an earlier pose or empty. If it holds a surface
/// of an earlier tick, this walks downhill from the last answer and repairs the surface. Otherwise
/// the surface is grown first, which finds the direction.
///
/// The certainty of what is returned is
/// [`GloballyOptimal`](super::Certainty::GloballyOptimal) if the proof is complete; if not, the
/// best known answer is returned, its `stop` says why the proof ended, and the memory is empty. A
/// pair that turns out to be apart (negative depth) is not proven; use a distance query for it.
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

/// The end of a walk downhill from the last answer. None without a facet of it, if the walk gives
/// no answer, or if another seed is lower.
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

/// The lowest start of all seeds; without any, or if none has a direction, that along the line
/// between the centroids, or any.
fn lowest_start(cso: &Cso<'_>, seeds: &[Seed]) -> Start {
    const FIRST: HubPair = HubPair { a: 0, b: 0 };
    let starts = seeds.iter().filter_map(|seed| Start::of(cso, seed, FIRST));
    let lowest = starts.reduce(|lowest, start| if start.offset < lowest.offset { start } else { lowest });
    lowest.or_else(|| Start::of(cso, &Seed::CentroidLine, FIRST)).unwrap_or_else(|| {
        let (hub, offset) = cso.support_anew(glam::DVec3::X);
        Start { hub, normal: glam::DVec3::X, offset }
    })
}
