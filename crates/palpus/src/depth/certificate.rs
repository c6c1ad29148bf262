//! Proof that a depth is the global minimum (the certificate). It goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction n at a local minimum u = h(n). To prove that u is the global
//! minimum, the certificate uses a closed surface inside the CSO and around the origin. If every
//! triangle of the surface is at least u away from the origin, u is the global minimum (see the
//! module on the inner surface). If a triangle comes nearer than u, compute the CSO's support along
//! the triangle's normal n':
//!
//! * If h(n') is less than u, n' is a better direction, and u becomes h(n').
//! * Otherwise the support lies above the triangle, and the surface grows to the support.
//!
//! This repeats, nearest triangle first, until no triangle is nearer than u. Every triangle that
//! grows was nearer than the depth, so no growth is wasted, even while u is only the h of the
//! seeds.
//!
//! If the surface starts as a tetrahedron, this is the expanding polytope algorithm (van den Bergen
//! 2001), which finds depth and proof together. A walk from its final direction gives the exact
//! features. Along a motion the walk comes first, and the proof starts from the surface of the
//! previous tick. The corners of that surface are pairs of vertices of the bodies, so after a small
//! motion it still lies inside the CSO. It is measured again, and repaired where it has come too
//! near.
//!
//! 1. Touching pairs: a depth within rounding of zero needs no proof.
//! 2. Most triangles of the kept surface are farther from the origin than u, by more than any point
//!    has moved since they were measured. They need no test. Measure the other triangles at the new
//!    pose. If none is too near, the proof is complete.
//! 3. Otherwise measure the whole kept surface at the new pose, and grow it where it is too near.
//!    If the repair takes too many growths, grow a new surface from a tetrahedron.
//! 4. Keep the surface. Drop it if it has many more triangles than when it was new, because most of
//!    them served earlier poses.
//!
//! The skipped and the measured triangles together still form a surface around the origin. It was
//! one when it was last measured as a whole. Since then no triangle has passed over the origin,
//! because each has moved less than its distance at its last measurement.
//!
//! A proven depth means: no direction has an h that is smaller by more than rounding and a fraction
//! [`PROOF_RELATIVE`](crate::algebra::tolerance::PROOF_RELATIVE) of the depth.

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

/// Working memory of proofs, of fixed size. One value serves any number of pairs, one after
/// another.
#[derive(Clone, Debug)]
pub struct ProofScratch {
    surface: Surface,
    growths: u32,
}

impl ProofScratch {
    /// Allocates all the memory that a proof needs.
    pub fn new() -> Self {
        Self { surface: Surface::new(), growths: 0 }
    }

    /// Returns the number of growths in the last proof.
    pub fn growths(&self) -> u32 {
        self.growths
    }
}

impl Default for ProofScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the penetration depth of `a` and `b`, with a proof if one is found.
///
/// If `memory` contains a surface of an earlier tick, walks once from the lowest seed, then calls
/// [`prove`]. Otherwise grows the surface first, which finds the direction. A walk from that
/// direction then finds the features.
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

/// Proves `answer`, which [`depth`](super::depth) returned for this pose, or finds a better answer
/// and proves that one.
///
/// `memory` belongs to the same two polytopes at an earlier pose, or it is empty. If the proof is
/// complete, the certainty of the returned depth is
/// [`GloballyOptimal`](super::Certainty::GloballyOptimal). If not, the best known answer is
/// returned, its `stop` tells why the proof ended, and the memory is cleared. A pair that is in
/// fact separate (negative depth) is not proven; use a distance query for it.
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

/// Searches for a proof from `best`, the direction of the least known h. `answer` is the depth
/// answer along `best`, if it is known.
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
