//! Proofs of depths, and their cached data.

use crate::algebra::{PairTable, Placement};
use crate::body::Polytope;
use crate::collision::LeafPair;
use crate::depth::{CertificateMemory, Depth, DepthScratch, Seed, depth_proven};

/// The proofs of the last query.
#[derive(Clone, Debug)]
pub(super) struct Prover(PairTable<CertificateMemory>);

impl Prover {
    /// Number of cached pairs, each of about 8 kB: enough for a few touching pieces.
    const PLACES: usize = 64;

    pub(super) fn new() -> Self {
        Self(PairTable::new(Self::PLACES, CertificateMemory::new))
    }

    pub(super) fn clear(&mut self) {
        self.0.values_mut().for_each(CertificateMemory::clear);
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
        let memory = self.0.of([leaf.piece_a, leaf.piece_b], CertificateMemory::clear);
        depth_proven(piece_a, piece_b, place, seeds, memory, scratch)
    }
}
