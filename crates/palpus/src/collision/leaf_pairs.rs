//! The leaf pairs that a query found. If there are more pairs than the capacity, the deepest pairs
//! are kept.
//!
//! 1. Pairs are kept in the order in which they are found.
//! 2. When the list is full, a new pair replaces the least deep pair if the new pair is deeper.
//!    Pairs that are left out are counted.
//!
//! The depth of an overlapping pair is unknown before its depth walk. The list uses an estimate:
//! the overlap of the pieces along the direction of the last tick's depth, or along the
//! direction that the march reported.

use std::collections::BinaryHeap;

use glam::DVec3;

use super::{PlacedPair, Proximity, WarmStart, support_gap};

/// A pair of pieces and the result of its march.
#[derive(Clone, Copy, Debug)]
pub struct LeafPair {
    /// Piece of a.
    pub piece_a: u32,
    /// Piece of b.
    pub piece_b: u32,
    /// Index of the pair in the front; `None` if the front had no room for the pair.
    pub(crate) place: Option<u32>,
    /// Apart or overlapping.
    pub proximity: Proximity,
}

impl LeafPair {
    /// Returns the pair's warm start among `memories`, the warm starts at all places of the front.
    #[inline]
    pub(super) fn memory<'m>(&self, memories: &'m [WarmStart]) -> &'m WarmStart {
        self.place.map_or(&WarmStart::BLANK, |place| &memories[place as usize])
    }
}

/// Leaf pairs up to a capacity. The default value has no room; it stands in for a list in use.
#[derive(Clone, Debug, Default)]
pub struct LeafPairs {
    pairs: Vec<LeafPair>,
    capacity: usize,
    /// A heap with the least deep pair on top; empty until the list is full.
    ranks: BinaryHeap<Rank>,
    dropped: u32,
}

/// Estimated separation of a pair, and the pair's index.
#[derive(Clone, Copy, Debug)]
struct Rank {
    separation: f64,
    pair: u32,
}

impl LeafPairs {
    /// Allocates room for `capacity` pairs, at least one.
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

    /// Returns the pairs that were found.
    pub fn as_slice(&self) -> &[LeafPair] {
        &self.pairs
    }

    /// Removes the pairs that are apart by more than `limit`.
    pub(super) fn retain_within(&mut self, limit: f64) {
        self.pairs.retain(|pair| match pair.proximity {
            Proximity::Disjoint(closest) => closest.distance <= limit,
            Proximity::Overlapping(_) => true,
        });
        // The indices in the heap are outdated now.
        self.ranks.clear();
    }

    /// Moves the pairs for which `is_first` holds to the start of the list. Returns their number.
    pub(crate) fn partition(&mut self, mut is_first: impl FnMut(&LeafPair) -> bool) -> usize {
        let mut first = 0;
        for k in 0..self.pairs.len() {
            if is_first(&self.pairs[k]) {
                self.pairs.swap(k, first);
                first += 1;
            }
        }
        // The indices in the heap are outdated now. No pair is added after this.
        self.ranks.clear();
        first
    }

    /// Returns the number of pairs that were left out.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Adds a pair. If the list is full, leaves out the least deep pair. `memories` are the warm
    /// starts at all places of the front.
    #[inline]
    pub(super) fn push(&mut self, pair: LeafPair, placed: &PlacedPair<'_>, memories: &[WarmStart]) {
        if self.pairs.len() < self.capacity {
            self.pairs.push(pair);
        } else {
            self.replace(pair, placed, memories);
        }
    }

    #[cold]
    fn replace(&mut self, pair: LeafPair, placed: &PlacedPair<'_>, memories: &[WarmStart]) {
        self.dropped += 1;
        if self.ranks.is_empty() {
            for (k, pair) in self.pairs.iter().enumerate() {
                self.ranks.push(Rank { separation: likely_separation(pair, placed, memories), pair: k as u32 });
            }
        }
        let separation = likely_separation(&pair, placed, memories);
        if let Some(mut least_deep) = self.ranks.peek_mut()
            && separation < least_deep.separation
        {
            self.pairs[least_deep.pair as usize] = pair;
            least_deep.separation = separation;
        }
    }
}

/// Returns the distance of a pair that is apart, or minus the estimated depth of an overlapping
/// pair.
fn likely_separation(pair: &LeafPair, placed: &PlacedPair<'_>, memories: &[WarmStart]) -> f64 {
    let overlap = match pair.proximity {
        Proximity::Disjoint(closest) => return closest.distance,
        Proximity::Overlapping(overlap) => overlap,
    };
    let (piece_a, piece_b) = (&placed.a.pieces[pair.piece_a as usize], &placed.b.pieces[pair.piece_b as usize]);
    let remembered = Some(pair.memory(memories)).filter(|memory| memory.facet.is_some());
    let direction = remembered.map_or(overlap.direction, |memory| memory.normal).normalize_or(DVec3::Z);
    let hub = remembered.map_or([0; 2], |memory| memory.hub);
    support_gap(piece_a, piece_b, placed.pose_ba, direction, hub).0
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

#[cfg(test)]
mod tests {
    use super::super::oracle::{Random, cuboid};
    use super::super::{Closest, Overlap, Side};
    use super::*;
    use crate::algebra::Placement;
    use crate::body::{Feature, FeaturePair, Hierarchy};

    const SEED: u64 = 0xD00F;

    #[test]
    fn deepest_pairs_are_kept_at_full_capacity() {
        // All pieces are unit cubes. The pieces of a are at the origin, and the pieces of b are
        // lower by up to 2.
        let mut random = Random::new(SEED);
        let count = 50;
        let separations: Vec<f64> = (0..count).map(|_| random.between(-1.0, 1.0)).collect();
        let pieces = vec![cuboid(DVec3::splat(0.5)); count];
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let features = FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) };
        let placed = PlacedPair::new(side, side, &Placement::IDENTITY, 1.0);
        let mut found = LeafPairs::new(7);
        for (k, &separation) in separations.iter().enumerate() {
            let closest = Closest {
                point_a: DVec3::ZERO,
                point_b: DVec3::ZERO,
                normal: DVec3::Z,
                distance: separation,
                features,
            };
            let proximity = if separation > 0.0 {
                Proximity::Disjoint(closest)
            } else {
                Proximity::Overlapping(Overlap { features, direction: DVec3::Z })
            };
            let (place, piece_a, piece_b) = (Some(0), 0, k as u32);
            // At this pose all overlapping pairs are equally deep, and deeper than pairs that are
            // apart.
            found.push(LeafPair { piece_a, piece_b, place, proximity }, &placed, &[WarmStart::BLANK]);
        }
        let overlapping = separations.iter().filter(|&&separation| separation <= 0.0).count();
        assert!(overlapping > 7, "seed {SEED:#x}");
        assert!(found.as_slice().iter().all(|pair| matches!(pair.proximity, Proximity::Overlapping(_))));
        assert_eq!((found.as_slice().len(), found.dropped() as usize), (7, count - 7));
        found.clear();
        for (k, &distance) in separations.iter().enumerate() {
            let closest = Closest { point_a: DVec3::ZERO, point_b: DVec3::ZERO, normal: DVec3::Z, distance, features };
            let (place, piece_a, piece_b) = (Some(0), 0, k as u32);
            let proximity = Proximity::Disjoint(closest);
            found.push(LeafPair { piece_a, piece_b, place, proximity }, &placed, &[WarmStart::BLANK]);
        }
        let mut sorted = separations.clone();
        sorted.sort_by(f64::total_cmp);
        let kept = found.as_slice().iter().map(|pair| separations[pair.piece_b as usize]).fold(f64::MIN, f64::max);
        assert_eq!(kept, sorted[6], "seed {SEED:#x}");
    }
}
