//! Proof that a depth is globally the least: the certificate, which goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction n at a local minimum u = h(n). A proof that u is the global minimum
//! is a closed surface within the CSO, around the origin, that stays at least u away from the
//! origin (see the module on the inner surface). If a triangle comes nearer than u, compute the
//! CSO's support along the triangle's normal n':
//!
//! * h(n') is less than u: n' is a better direction, and u becomes h(n').
//! * Otherwise the support lies above the triangle, and the surface grows to it.
//!
//! This repeats, nearest triangle first, until no triangle is nearer than u. Every triangle that
//! grows was nearer than the depth, so no growth is wasted, even while u is only the h of the
//! seeds. Started from a tetrahedron, this is the expanding polytope algorithm (van den Bergen
//! 2001), which finds depth and proof at once; a walk from its final direction gives the exact
//! features. Along a motion the walk comes first, and the proof starts from the last tick's
//! surface. The corners of that surface are pairs of vertices of the bodies, so after a small
//! motion it is still a surface within the CSO. It is measured again, and repaired where it has
//! come too near.
//!
//! 1. Touching pairs: a depth of no more than rounding needs no proof.
//! 2. Most triangles of the kept surface are farther from the origin than u by more than any point
//!    has moved since they were measured; they need no test. Measure the others at the new pose. If
//!    none is too near, the proof is complete.
//! 3. Else measure the whole kept surface at the new pose and grow it where it is too near. If the
//!    repair takes too many growths, grow a new surface from a tetrahedron.
//! 4. Keep the surface. Drop it if it has many more triangles than when it was new: most of them
//!    served earlier poses.
//!
//! The skipped and the measured triangles together form a surface around the origin. It was one
//! when it was last measured as a whole. Since then no triangle has passed over the origin, as long
//! as each has moved less than its distance at its last measurement.
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

    /// Number of growths in the last proof.
    pub fn growths(&self) -> u32 {
        self.growths
    }
}

impl Default for ProofScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// The penetration depth of `a` and `b`, with a proof if one is found.
///
/// If the memory holds a surface of an earlier tick, walks once from the lowest of the seeds, then
/// calls [`prove`]. Otherwise grows the surface first, which finds the direction; a walk from there
/// only finds the features.
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
/// if not, the best known answer is returned, its `stop` says why the proof ended, and the memory
/// is empty. A pair that turns out to be apart (negative depth) is not proven; use a distance query
/// for it.
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

/// Searches a proof, starting from `best`, the direction of the least known h; `answer` is the
/// depth answer there, if it is known.
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
