//! What becomes of the pairs for which the quota did not suffice.

use glam::DVec3;

use super::QueryCounters;
use super::pair::Found;
use super::search::{Asked, PairSearch};
use crate::collision::{LeafPair, Proximity, support_gap};

impl PairSearch {
    /// The quota was spent before leaf pair `first`: it and those after it are answered from the
    /// last tick.
    #[cold]
    pub(super) fn hold_the_rest(&mut self, asked: &Asked<'_>, first: usize, counters: &mut QueryCounters) {
        // Those that woke just now come first and are not in turn; the others go on where the quota
        // ended.
        let mut resumed = false;
        let count = self.leaves.as_slice().len();
        for k in first..count {
            let leaf = self.leaves.as_slice()[k];
            let left = count - k - 1;
            counters.traversal.postponed += 1;
            let Some(place) = leaf.place else {
                self.answer_unheld(asked, &leaf, left, counters);
                continue;
            };
            if !self.hold(asked, place, [leaf.piece_a, leaf.piece_b], left, counters) {
                self.answer_unheld(asked, &leaf, left, counters);
            }
            if !resumed {
                self.resume = Some(place);
                resumed = true;
            }
        }
    }

    /// Those that were not marched.
    pub(super) fn hold_unvisited(&mut self, asked: &Asked<'_>, counters: &mut QueryCounters) {
        for k in 0..self.front.unvisited() {
            let (place, pieces) = self.front.unvisited_pair(&asked.placed(), k);
            if !self.hold(asked, place, pieces, 0, counters) {
                counters.unseen += 1;
                self.unseen_separation = f64::NEG_INFINITY;
            }
        }
        if let Some(place) = self.resume.take() {
            self.front.resume_at(place);
        }
    }

    /// Answers a pair from the last tick, and leaves room for one contact of each of the pairs
    /// `left`; false if nothing is known of it.
    fn hold(
        &mut self,
        asked: &Asked<'_>,
        place: u32,
        pieces: [u32; 2],
        left: usize,
        counters: &mut QueryCounters,
    ) -> bool {
        let most = self.capacity - left;
        let carried = self.held.carry(place, pieces, &asked.place, asked.tolerance, most, &mut self.contacts);
        counters.held += carried.unwrap_or(0);
        carried.is_some()
    }

    /// A pair of which the last tick knew nothing: the march's answer if it is apart, otherwise
    /// only how deep it is at most.
    fn answer_unheld(&mut self, asked: &Asked<'_>, leaf: &LeafPair, left: usize, counters: &mut QueryCounters) {
        let Proximity::Overlapping(overlap) = leaf.proximity else {
            let known = self.contacts.len();
            if let Found::Admissible(contact) = self.contact(asked, leaf, counters) {
                self.contacts.push(contact);
                self.keep(asked, leaf, known, left, counters);
            }
            return;
        };
        counters.unseen += 1;
        let (piece_a, piece_b) = asked.pieces(leaf.piece_a, leaf.piece_b);
        let normal = overlap.direction.normalize_or(DVec3::Z);
        let (gap, _) = support_gap(piece_a, piece_b, &asked.place, normal, [0; 2]);
        self.unseen_separation = self.unseen_separation.min(gap);
    }
}
