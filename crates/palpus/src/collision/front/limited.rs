//! Queries with limited work: more due pairs are visited in the same query, and the gaps of those
//! that stay due are bounded.

use glam::DVec3;

use super::super::wakes::BLOCK;
use super::super::{Closest, LeafPairs, March, Overlap, Proximity, TraversalCounters, support_gap};
use super::due::{DUE, Known};
use super::{Front, NONE, Pair, PlacedPair};
use crate::algebra::tolerance::{BOUNDED_READS, CLEAR_LEAST, CLEAR_MOTIONS, SPHERE_WAIT, WORK_BOUNDED};
use crate::algebra::{Placement, Quota, spread};

/// Up to this number, due pairs are counted in each stage of a query.
const COUNTED_DUE: u32 = 1024;

impl Front {
    /// Visits more due pairs and late pairs, up to `quota`. `found` and `counters` are the results
    /// of the last query, which was at the same pose; more results are added to them.
    pub(crate) fn go_on(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let woken = counters.woken;
        let done = self.wake_due(query, quota, found, counters);
        self.visit_late(query, quota, found, counters);
        self.visited_due(done, counters.woken - woken);
        self.finish(query, found, counters);
    }

    /// Computes the cheapest bounds of the pairs that limit [`Self::unseen_separation`] most. They
    /// are still due after the last query, which was at the same pose. Pairs that are apart by
    /// these bounds wait again, and those with the least bounds are visited, up to `quota`. The
    /// others are due since their bound, so the next query knows it.
    ///
    /// If `quota` does not suffice for all due pairs, the next query goes on with the others.
    pub(crate) fn bound_due(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let (blocks, needed, woken) = (self.blocks(), self.needed_gap(query), counters.woken);
        let first = std::mem::take(&mut self.first_bounded).min(blocks);
        'rounds: for (begin, end) in [(first, blocks), (0, first)] {
            let mut block = begin;
            while block < end {
                if quota.is_spent() {
                    self.first_bounded = block;
                    break 'rounds;
                }
                let mut due = [0; DUE];
                let is_wanted = |block: usize| query.wants(self.thinnest_in[block]);
                let (count, next) = self.wakes.collect(block, end, self.motion_bound.sum(), is_wanted, &mut due);
                self.bound_some(query, &mut due[..count], needed, quota, found, counters);
                block = next;
            }
        }
        self.visited_due(false, counters.woken - woken);
        self.finish(query, found, counters);
    }

    /// Does [`Self::bound_due`] for the pairs `due`. Overwrites the list.
    fn bound_some(
        &mut self,
        query: &PlacedPair<'_>,
        due: &mut [u32],
        needed: f64,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let mut chosen = 0;
        for k in 0..due.len() {
            due[chosen] = due[k];
            let enough = needed + (query.tolerance - needed) * spread(due[k]);
            chosen += usize::from(self.gap_of_due(query, due[k]) < enough);
        }
        quota.spend((chosen + due.len() / BOUNDED_READS) as u64 / WORK_BOUNDED);
        let due = &due[..chosen];
        let known = self.bounds(query, due, needed);
        for (&place, mut known) in due.iter().zip(known) {
            let gap = self.refresh(query, place, &mut known, needed);
            if gap > query.tolerance || gap <= needed && !quota.is_spent() {
                self.wake(query, place, known, quota, found, counters);
            }
        }
        due.iter().for_each(|&place| self.wakes.settle(place as usize / BLOCK));
    }

    /// Sets the number of due pairs after `visited` of them were visited; `done` means that all
    /// were. Many pairs are not counted again, because this reads the wake values of all of them.
    fn visited_due(&mut self, done: bool, visited: u32) {
        self.still_due = match self.still_due.saturating_sub(visited) {
            _ if done => 0,
            many if many > COUNTED_DUE => many,
            _ => self.count_due(),
        };
    }

    /// Returns the number of due pairs.
    pub(super) fn count_due(&self) -> u32 {
        self.wakes.count_below(self.blocks(), self.motion_bound.sum())
    }

    /// Returns the number of due pairs that the last query did not visit. If there are many, the
    /// halves of pairs that the later stages of the query split are not counted.
    pub(crate) fn still_due(&self) -> u32 {
        self.still_due
    }

    /// Returns the number of pairs within the tolerance for which the quota of the last query did
    /// not suffice.
    pub(crate) fn late(&self) -> usize {
        self.late
    }

    /// Counts what the query left out, and the size of the front.
    pub(super) fn finish(&mut self, query: &PlacedPair<'_>, found: &LeafPairs, counters: &mut TraversalCounters) {
        counters.postponed = self.late as u32 + self.still_due;
        if query.is_of_all() {
            self.paths.due = counters.woken;
        }
        counters.dropped = found.dropped();
        counters.front = self.node_pairs() as u32;
        counters.near = self.awake.len() as u32;
        debug_assert_eq!(self.validate_some(query), Ok(()));
    }

    /// Returns a lower bound of the separation (model units) of every pair of pieces that the last
    /// query did not find, except for pairs in the list of unvisited pairs. Minus infinity before
    /// the first query. The bound is at least the tolerance unless the quota was spent.
    pub fn unseen_separation(&self) -> f64 {
        let least = self.wakes.least(self.blocks());
        if least >= self.motion_bound.sum() {
            self.tolerance
        } else if least == 0 || self.was_full {
            f64::NEG_INFINITY
        } else {
            self.tolerance - self.motion_bound.since(least)
        }
    }

    /// Returns the gap that due pairs need so that the bodies can move on as in the last step,
    /// model units.
    fn needed_gap(&self, query: &PlacedPair<'_>) -> f64 {
        // The search goes so far beyond the contact offset.
        let ahead = query.tolerance - query.offset;
        query.offset + (CLEAR_MOTIONS * self.motion_bound.last_motion()).max(CLEAR_LEAST * ahead).min(ahead)
    }

    /// Returns a lower bound of the gap of a due pair, model units.
    fn gap_of_due(&self, query: &PlacedPair<'_>, place: u32) -> f64 {
        match self.wakes.get(place) {
            0 => f64::NEG_INFINITY,
            wake => query.tolerance - self.motion_bound.since(wake),
        }
    }

    /// Computes the cheapest bounds of the due pair at `place`, up to `needed`, and lets it be due
    /// since the best of them. Returns this bound, model units.
    fn refresh(&mut self, query: &PlacedPair<'_>, place: u32, known: &mut Known, needed: f64) -> f64 {
        let of_spheres = known.spheres.map(|gap| gap - SPHERE_WAIT * self.pace.motion);
        let mut gap = known.point.max(known.along.or(of_spheres).unwrap_or(f64::NEG_INFINITY));
        if gap <= needed {
            known.point = known.point.max(self.gap_of_parents(query.pose_ba, place));
            gap = gap.max(known.point);
        }
        if gap > query.tolerance {
            return gap;
        }
        let wake = self.motion_bound.due_since(query.tolerance - gap);
        self.wakes.set(place, wake.max(self.wakes.get(place)));
        self.gap_of_due(query, place)
    }

    /// Stores the gap of a pair that was split, as a bound for halves that are not measured yet. An
    /// earlier bound stays: it is of a normal along which the pair was apart.
    pub(super) fn store_split_gap(&mut self, query: &PlacedPair<'_>, place: u32, answer: &March) {
        let Pair { a, b, bound, .. } = self.pairs[place as usize];
        if bound.exists() {
            return;
        }
        let (normal, gap) = match answer.proximity {
            Proximity::Disjoint(Closest { normal, distance, .. }) => (normal, distance),
            Proximity::Overlapping(Overlap { direction, .. }) => {
                let (polytope_a, polytope_b) = query.polytopes([a, b]);
                let normal = direction.normalize_or_zero();
                (normal, support_gap(polytope_a, polytope_b, query.pose_ba, normal, [0; 2]).0)
            }
        };
        if normal != DVec3::ZERO {
            self.pairs[place as usize].bound = self.point_bound(query, place, normal.as_vec3(), gap);
        }
    }

    /// Returns a lower bound of the gap of a pair (model units), from the stored gaps of the pairs
    /// of which it is a part. Minus infinity if nothing is stored.
    fn gap_of_parents(&self, placement_ba: &Placement, mut place: u32) -> f64 {
        let mut gap = f64::NEG_INFINITY;
        while gap == f64::NEG_INFINITY && self.pairs[place as usize].parent != NONE {
            place = self.pairs[place as usize].parent;
            gap = self.stored_gap(placement_ba, place);
        }
        gap
    }
}
