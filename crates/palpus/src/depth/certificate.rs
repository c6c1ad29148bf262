//! Proof that a depth is globally the least: the certificate, which goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction next to which h is nowhere smaller. That none is smaller anywhere
//! is shown by a closed surface within the CSO, around the origin, that keeps u = h(n) away from it
//! (see the module on the inner surface). Where a triangle comes nearer than u, the CSO is asked
//! for its support along the triangle's normal n':
//!
//! * h(n') is less than u: a better direction was missed, and u is smaller from now on.
//! * h(n') is not: the support lies above the triangle, and the surface grows to it.
//!
//! So it goes on until no triangle is nearer than u, with the nearest always first: what then is
//! grown was nearer than the depth, so nothing is grown in vain, even while u is only the h of the
//! seeds. From nothing it is the expanding polytope algorithm (van den Bergen 2001), which finds
//! depth and proof at once; a walk from the direction it ends in gives the exact features. Along
//! motion the walk comes first, and the proof starts from a stored surface: that of the last tick,
//! whose corners are pairs of vertices of the bodies, is after a small motion still a surface
//! within the CSO. It is judged anew and repaired where motion brought it too near.
//!
//! 1. Touching pairs: a depth of no more than rounding needs no proof.
//! 2. Most of the kept surface is farther from the origin than u by more than anything has moved
//!    since it was measured; that part sleeps. Measure the rest at the new pose. If it keeps off,
//!    that was all.
//! 3. Else judge the whole kept surface at the new pose and grow it where it is too near; if
//!    repairing it takes too much, grow a new one from a tetrahedron.
//! 4. Keep the surface. One that has gathered many more triangles than it began with is dropped:
//!    most of them were for poses of the past.
//!
//! Triangles that sleep and triangles that were measured together make one surface around the
//! origin. It was one when last judged whole, and no triangle of it has passed over the origin
//! since, as long as each has moved less than its distance at each measurement.
//!
//! Proven means: no direction has an h smaller than the depth by more than
//! [`PROOF_RELATIVE`](crate::algebra::tolerance::PROOF_RELATIVE) of it or by rounding.

mod memory;
mod search;

use super::cso::Cso;
use super::inner::Surface;
use super::query::{depth_once, lowest_start};
use super::seed::{Seed, Start};
use super::{Depth, WalkScratch};
use crate::algebra::Placement;
use crate::body::Polytope;
pub use memory::CertificateMemory;
use search::Search;

/// Working memory of proofs, of fixed size; one may serve any number of pairs, one after another.
#[derive(Clone, Debug)]
pub struct ProofScratch {
    surface: Surface,
    growths: u32,
}

impl ProofScratch {
    /// All the memory that any proof needs.
    pub fn new() -> Self {
        Self { surface: Surface::new(), growths: 0 }
    }

    /// Number of times that a surface grew in the last proof.
    pub fn growths(&self) -> u32 {
        self.growths
    }
}

impl Default for ProofScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// The penetration depth of `a` and `b` with proof, as far as one is found.
///
/// With a surface of an earlier tick in the memory: one walk from the lowest of the seeds, then
/// [`prove`]. Without one, the walk is spared: the surface is grown first, which finds the
/// direction, and the walk is only asked for the features there.
pub fn depth_proven(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    seeds: &[Seed],
    memory: &mut CertificateMemory,
    proof: &mut ProofScratch,
    walk: &mut WalkScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    if memory.serves(&cso) {
        let answer = depth_once(a, b, pose_ba, seeds, walk);
        return prove(a, b, pose_ba, &answer, memory, proof, walk);
    }
    proven(&cso, lowest_start(&cso, seeds), None, memory, proof, walk)
}

/// Proves `answer`, which [`depth`](super::depth) gave for this pose, or finds a better one and
/// proves that.
///
/// `memory` is that of the same two polytopes, from an earlier pose or empty. The certainty of what
/// is returned is [`GloballyOptimal`](super::Certainty::GloballyOptimal) if the proof is complete;
/// if not, it is the best known answer, and its `stop` says why the proof ended. The memory is then
/// empty. A pair that turns out to be apart (negative depth) isn't proven: that is for the distance
/// to say.
pub fn prove(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    answer: &Depth,
    memory: &mut CertificateMemory,
    proof: &mut ProofScratch,
    walk: &mut WalkScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    let start = Start { hub: answer.hub, normal: answer.normal, offset: answer.depth };
    proven(&cso, start, Some(*answer), memory, proof, walk)
}

/// The search for a proof from `best`, the direction of the least h that is known; `answer` is the
/// answer there, if it is.
fn proven(
    cso: &Cso<'_>,
    best: Start,
    answer: Option<Depth>,
    memory: &mut CertificateMemory,
    proof: &mut ProofScratch,
    walk: &mut WalkScratch,
) -> Depth {
    walk.trail.clear();
    let mut search = Search::new(cso, best, answer, &mut proof.surface, walk);
    let answer = search.run(memory);
    proof.growths = search.growths;
    answer
}
