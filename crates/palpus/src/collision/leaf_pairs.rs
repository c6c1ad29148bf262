//! The leaf pairs that a query found, as many as there is room for: of more, the deepest.
//!
//! 1. Pairs are kept in the order in which they are found.
//! 2. When there is no room any more, each newcomer takes the place of the pair that is least deep, if that one is less
//!    deep than itself; what was left out is counted.
//!
//! How deep an overlapping pair is, is not known before its depth walk. It is told from the direction in which it was deep
//! last tick, or in which the march noticed the overlap: how far the pieces overlap along that direction.

use std::collections::BinaryHeap;

use glam::DVec3;

use super::coherence::Memory;
use super::{Proximity, Side};
use crate::algebra::Placement;

/// A pair of pieces and what the march found of it.
#[derive(Clone, Copy, Debug)]
pub struct LeafPair {
    /// Piece of a.
    pub piece_a: u32,
    /// Piece of b.
    pub piece_b: u32,
    /// Where the pair is remembered.
    pub(crate) home: Home,
    /// Apart or overlapping.
    pub proximity: Proximity,
    /// What was remembered of the pair.
    pub memory: Option<Memory>,
}

/// Where a pair is remembered from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Home {
    /// In the table of the full traversal, under the leaves' nodes.
    Nodes(u32, u32),
    /// At this place of the front.
    Place(u32),
}

/// Leaf pairs up to a capacity.
#[derive(Clone, Debug)]
pub struct LeafPairs {
    pairs: Vec<LeafPair>,
    capacity: usize,
    /// The least deep on top; empty until there is no room.
    ranks: BinaryHeap<Rank>,
    dropped: u32,
}

/// Separation of a pair, by its index.
#[derive(Clone, Copy, Debug)]
struct Rank {
    separation: f64,
    pair: u32,
}

impl LeafPairs {
    /// Room for `capacity` pairs, at least one.
    pub fn new(capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self { pairs: Vec::with_capacity(capacity), capacity, ranks: BinaryHeap::with_capacity(capacity), dropped: 0 }
    }

    /// Empties the list.
    pub(super) fn clear(&mut self) {
        self.pairs.clear();
        self.ranks.clear();
        self.dropped = 0;
    }

    /// Those found.
    pub fn as_slice(&self) -> &[LeafPair] {
        &self.pairs
    }

    /// How many were left out.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Adds a pair, or leaves out the least deep of all.
    #[inline]
    pub(super) fn push(&mut self, pair: LeafPair, a: Side<'_>, b: Side<'_>, pose_ba: &Placement) {
        if self.pairs.len() < self.capacity {
            self.pairs.push(pair);
        } else {
            self.replace(pair, a, b, pose_ba);
        }
    }

    #[cold]
    fn replace(&mut self, pair: LeafPair, a: Side<'_>, b: Side<'_>, pose_ba: &Placement) {
        self.dropped += 1;
        if self.ranks.is_empty() {
            for (k, pair) in self.pairs.iter().enumerate() {
                self.ranks.push(Rank { separation: likely_separation(pair, a, b, pose_ba), pair: k as u32 });
            }
        }
        let separation = likely_separation(&pair, a, b, pose_ba);
        if let Some(mut least_deep) = self.ranks.peek_mut()
            && separation < least_deep.separation
        {
            self.pairs[least_deep.pair as usize] = pair;
            least_deep.separation = separation;
        }
    }
}

/// The distance of a pair that is apart; about minus the depth of one that overlaps.
fn likely_separation(pair: &LeafPair, a: Side<'_>, b: Side<'_>, pose_ba: &Placement) -> f64 {
    let overlap = match pair.proximity {
        Proximity::Disjoint(closest) => return closest.distance,
        Proximity::Overlapping(overlap) => overlap,
    };
    let (piece_a, piece_b) = (&a.pieces[pair.piece_a as usize], &b.pieces[pair.piece_b as usize]);
    let remembered = pair.memory.filter(|memory| memory.normal != DVec3::ZERO);
    let direction = remembered.map_or(overlap.direction, |memory| memory.normal).normalize_or(DVec3::Z);
    let hub = remembered.map_or([0; 2], |memory| memory.hub);
    let lowest_a = piece_a.support_from(hub[0], pose_ba.inverse_vector(-direction));
    let highest_b = piece_b.support_from(hub[1], direction);
    direction.dot(pose_ba.point(piece_a.vertex(lowest_a)) - piece_b.vertex(highest_b))
}

impl Ord for Rank {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.separation.total_cmp(&other.separation).then(self.pair.cmp(&other.pair))
    }
}

impl PartialOrd for Rank {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Rank {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Rank {}
