//! Proofs of depths, and their cached data.

use crate::algebra::Placement;
use crate::body::Polytope;
use crate::collision::LeafPair;
use crate::depth::{CertificateMemory, Depth, DepthScratch, Seed, depth_proven};

/// The proofs of the last query.
#[derive(Clone, Debug)]
pub(super) struct Prover {
    /// Pieces of a and b, and their cached proof. A pair replaces another pair with the same hash
    /// and then starts without cached data.
    places: Vec<([u32; 2], CertificateMemory)>,
}

impl Prover {
    /// Number of cached pairs, each of about 8 kB: enough for a few touching pieces.
    const PLACES: usize = 64;

    pub(super) fn new() -> Self {
        let places = (0..Self::PLACES).map(|_| ([u32::MAX; 2], CertificateMemory::new())).collect();
        Self { places }
    }

    pub(super) fn clear(&mut self) {
        self.places.iter_mut().for_each(|(_, memory)| memory.clear());
    }

    pub(super) fn depth(
        &mut self,
        piece_a: &Polytope,
        piece_b: &Polytope,
        place: &Placement,
        leaf: &LeafPair,
        seeds: &[Seed],
        scratch: &mut DepthScratch,
    ) -> Depth {
        // Fibonacci hashing: the odd multiplier is 2³² divided by the golden ratio.
        let hash = leaf.piece_a.wrapping_mul(31).wrapping_add(leaf.piece_b).wrapping_mul(0x9E37_79B9);
        let (pieces, memory) = &mut self.places[(hash >> 26) as usize % Self::PLACES];
        if *pieces != [leaf.piece_a, leaf.piece_b] {
            *pieces = [leaf.piece_a, leaf.piece_b];
            memory.clear();
        }
        depth_proven(piece_a, piece_b, place, seeds, memory, scratch)
    }
}
