//! What becomes of the pairs that a deadline left.

use glam::DVec3;

use super::super::held::Held;
use super::pair::Found;
use super::{Asked, PairQuery, QueryCounters, pieces, side};
use crate::collision::{Home, LeafPair, Proximity};

impl PairQuery {
    /// The deadline has passed before leaf pair `first`: it and those after it are answered from the last tick.
    #[cold]
    pub(super) fn hold_the_rest(&mut self, asked: &Asked<'_>, first: usize, counters: &mut QueryCounters) {
        // Those that woke just now come first and are not in turn; the others go on where time ran out.
        let mut resumed = false;
        for k in first..self.leaves.as_slice().len() {
            let leaf = self.leaves.as_slice()[k];
            counters.traversal.postponed += 1;
            let Home::Place(home) = leaf.home else {
                self.answer_unheld(asked, &leaf, counters);
                continue;
            };
            if !self.hold(asked, home, [leaf.piece_a, leaf.piece_b], counters) {
                self.answer_unheld(asked, &leaf, counters);
            }
            if !resumed {
                self.resume = Some(home);
                resumed = true;
            }
        }
    }

    /// Those for whose march there was no time.
    pub(super) fn hold_unvisited(&mut self, asked: &Asked<'_>, counters: &mut QueryCounters) {
        for k in 0..self.front.unvisited() {
            let (home, pieces) = self.front.unvisited_pair(side(asked.a), side(asked.b), k);
            if !self.hold(asked, home, pieces, counters) {
                counters.unseen += 1;
                self.unseen_separation = f64::NEG_INFINITY;
            }
        }
        if let Some(home) = self.resume.take() {
            self.front.resume_at(home);
        }
    }

    /// Answers a pair from the last tick; false if nothing is known of it.
    fn hold(
        &mut self,
        asked: &Asked<'_>,
        home: u32,
        [piece_a, piece_b]: [u32; 2],
        counters: &mut QueryCounters,
    ) -> bool {
        match self.held.carry(
            home,
            [piece_a, piece_b],
            pieces(asked.a, asked.b, piece_a, piece_b),
            &asked.place,
            asked.tolerance,
        ) {
            Held::Unknown => return false,
            Held::NoContact => {}
            Held::Contact(contact) if self.contacts.len() < self.contacts.capacity() => {
                counters.held += 1;
                self.contacts.push(contact);
            }
            Held::Contact(_) => counters.traversal.dropped += 1,
        }
        true
    }

    /// A pair of which the last tick knew nothing: the march's answer if it is apart, otherwise only how deep it is at most.
    fn answer_unheld(&mut self, asked: &Asked<'_>, leaf: &LeafPair, counters: &mut QueryCounters) {
        let Proximity::Overlapping(overlap) = leaf.proximity else {
            if let Found::Admissible(contact) = self.contact(asked, leaf, counters) {
                self.contacts.push(contact);
            }
            return;
        };
        counters.unseen += 1;
        let Asked { a, b, place, .. } = *asked;
        let (piece_a, piece_b) = pieces(a, b, leaf.piece_a, leaf.piece_b);
        let normal = overlap.direction.normalize_or(DVec3::Z);
        let support_a = piece_a.support_from(0, place.inverse_vector(-normal));
        let support_b = piece_b.support_from(0, normal);
        let gap = normal.dot(place.point(piece_a.vertex(support_a)) - piece_b.vertex(support_b));
        self.unseen_separation = self.unseen_separation.min(gap);
    }
}
