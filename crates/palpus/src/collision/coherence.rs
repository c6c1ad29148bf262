//! What a pair of nodes remembers of the last tick.
//!
//! Coherence is a value that a query reads and writes, and that may be cleared at any time: it decides where searches
//! start, not what they find. It is a fixed table with four places for each key; a newcomer takes the place that was
//! unused for longest, so that it never grows and never allocates.

use glam::DVec3;

use crate::body::{Feature, FeaturePair};

/// What is remembered of one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// The last closest features: where the march starts.
    pub features: FeaturePair,
    /// The normal of the last depth, or of the last closest points within tolerance: unit, from b into a, in b's frame; zero when there
    /// is none.
    pub normal: DVec3,
    /// Vertices of a and b that support that normal.
    pub hub: [u32; 2],
    /// The features that the last depth, or the last closest points, rest on; none when there are none.
    pub facet: Option<FeaturePair>,
    /// The features of the last depth along a normal that both pieces own, where that was not the least depth.
    pub admissible: Option<FeaturePair>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    key: u64,
    stamp: u32,
    memory: Memory,
}

const EMPTY: u64 = u64::MAX;
const WAYS: usize = 4;

/// A fixed table from pairs of nodes to their [`Memory`].
#[derive(Clone, Debug)]
pub(super) struct Coherence {
    places: Vec<Place>,
    mask: usize,
    stamp: u32,
}

impl Coherence {
    /// A table that holds about `pairs` pairs (rounded up to a power of two).
    pub(super) fn new(pairs: usize) -> Self {
        let sets = pairs.div_ceil(WAYS).next_power_of_two();
        let feature = Feature::Vertex(0);
        let empty = Place {
            key: EMPTY,
            stamp: 0,
            memory: Memory {
                features: FeaturePair { a: feature, b: feature },
                normal: DVec3::ZERO,
                hub: [0; 2],
                facet: None,
                admissible: None,
            },
        };
        Self { places: vec![empty; sets * WAYS], mask: sets - 1, stamp: 0 }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        for place in &mut self.places {
            place.key = EMPTY;
        }
    }

    /// Begins a tick: what is used from now on is younger than what was used before.
    pub(super) fn begin_tick(&mut self) {
        self.stamp = self.stamp.wrapping_add(1);
    }

    /// What is remembered of the pair, if anything.
    #[inline]
    pub(super) fn recall(&mut self, a: u32, b: u32) -> Option<Memory> {
        let key = key(a, b);
        let stamp = self.stamp;
        let place = self.set(key).iter_mut().find(|place| place.key == key)?;
        place.stamp = stamp;
        Some(place.memory)
    }

    /// Remembers the pair.
    #[inline]
    pub(super) fn remember(&mut self, a: u32, b: u32, memory: Memory) {
        let key = key(a, b);
        let stamp = self.stamp;
        let set = self.set(key);
        let mut chosen = 0;
        let mut oldest = 0;
        for (k, place) in set.iter().enumerate() {
            if place.key == key {
                chosen = k;
                break;
            }
            let age = if place.key == EMPTY { u32::MAX } else { stamp.wrapping_sub(place.stamp) };
            if k == 0 || age > oldest {
                oldest = age;
                chosen = k;
            }
        }
        set[chosen] = Place { key, stamp, memory };
    }

    fn set(&mut self, key: u64) -> &mut [Place] {
        // Fibonacci hashing: neighbouring indices must not share a set.
        let start = ((key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & self.mask) * WAYS;
        &mut self.places[start..start + WAYS]
    }
}

fn key(a: u32, b: u32) -> u64 {
    u64::from(a) << 32 | u64::from(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(k: u32) -> Memory {
        Memory {
            features: FeaturePair { a: Feature::Vertex(k), b: Feature::Edge(k) },
            normal: DVec3::X,
            hub: [k; 2],
            facet: None,
            admissible: None,
        }
    }

    #[test]
    fn what_was_used_lately_is_recalled_and_the_oldest_gives_way() {
        let mut coherence = Coherence::new(4); // One set of four places.
        for tick in 0..4 {
            coherence.begin_tick();
            coherence.remember(tick, 7, memory(tick));
        }
        coherence.begin_tick();
        assert_eq!(coherence.recall(0, 7), Some(memory(0)));
        coherence.remember(9, 9, memory(9));
        assert_eq!(coherence.recall(1, 7), None, "pair (1, 7) was unused for longest");
        assert_eq!(coherence.recall(0, 7), Some(memory(0)));
        assert_eq!(coherence.recall(9, 9), Some(memory(9)));
        coherence.clear();
        assert_eq!(coherence.recall(9, 9), None);
    }

    #[test]
    fn remembering_again_replaces() {
        let mut coherence = Coherence::new(64);
        coherence.remember(1, 2, memory(1));
        coherence.remember(1, 2, memory(5));
        assert_eq!(coherence.recall(1, 2), Some(memory(5)));
        assert_eq!(coherence.recall(2, 1), None);
    }
}
