//! Queries with limited work: more due pairs are visited in the same query, and the gaps of those
//! that stay due are bounded.

use glam::DVec3;

use super::super::wakes::BLOCK;
use super::super::{Closest, LeafPairs, March, Overlap, Proximity, TraversalCounters, support_gap};
use super::due::DUE;
use super::{Front, NONE, Pair, PlacedPair};
use crate::algebra::tolerance::{NEAR_DUE, SPHERE_WAIT, WORK_BOUNDED};
use crate::algebra::{Placement, Quota};

impl Front {
    /// Visits more due pairs, up to `quota`. `found` and `counters` are the results of the last
    /// query, which was at the same pose; more results are added to them.
    pub(crate) fn go_on(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let (done, least) = (self.wake_due(query, quota, found, counters), self.least_due);
        self.finish(query, done, found, counters);
        self.least_due = least;
    }

    /// Computes the cheapest bounds of all pairs that are still due after the last query, which was
    /// at the same pose. Pairs that are apart by these bounds wait again, and those with the least
    /// bounds are visited, up to `quota`. The least bound of the other pairs is the new
    /// [`Self::unseen_separation`].
    pub(crate) fn bound_due(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let least = self.least_due(query, quota, found, counters);
        self.finish(query, false, found, counters);
        self.least_due = Some(least);
    }

    /// Returns the number of due pairs that the last query did not visit.
    pub(crate) fn still_due(&self) -> u32 {
        self.still_due
    }

    /// Counts what the query left out, and the size of the front. `done` means that all due pairs
    /// were visited.
    pub(super) fn finish(
        &mut self,
        query: &PlacedPair<'_>,
        done: bool,
        found: &LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        self.still_due = if done { 0 } else { self.wakes.count_below(self.blocks(), self.motion_bound.sum()) };
        self.least_due = None;
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
        } else if let Some(gap) = self.least_due {
            gap
        } else if least == 0 || self.was_full {
            f64::NEG_INFINITY
        } else {
            self.tolerance - self.motion_bound.since(least)
        }
    }

    /// Postpones due pairs that are apart by their cheapest bounds, and visits those with the least
    /// bounds, up to `quota`. Returns the least bound of the other due pairs, model units.
    fn least_due(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> f64 {
        let (mut least, mut block, blocks) = (self.tolerance, 0, self.blocks());
        let sum = self.motion_bound.sum();
        while block < blocks {
            let mut due = [0; DUE];
            let is_wanted = |block: usize| query.wants(self.thinnest_in[block]);
            let (count, next) = self.wakes.collect(block, blocks, sum, is_wanted, &mut due);
            let known = self.bounds(query, &due[..count]);
            for (&place, mut known) in due[..count].iter().zip(known) {
                let of_spheres = known.spheres.map(|gap| gap - SPHERE_WAIT * self.pace.motion);
                let mut gap = known.point.max(known.along.or(of_spheres).unwrap_or(f64::NEG_INFINITY));
                if gap <= query.tolerance {
                    known.point = known.point.max(self.gap_of_parents(query.pose_ba, place));
                    gap = gap.max(known.point);
                }
                if gap > query.tolerance {
                    self.look(query, place, known, found, counters);
                    continue;
                }
                let wake = self.wakes.get(place);
                let moved = if wake > 0 { self.motion_bound.since(wake) } else { f64::INFINITY };
                gap = gap.max(query.tolerance - moved);
                if gap > NEAR_DUE * query.tolerance
                    || quota.is_spent()
                    || self.wake(query, place, known, quota, found, counters)
                {
                    least = least.min(gap);
                }
            }
            quota.spend(count as u64 / WORK_BOUNDED);
            due[..count].iter().for_each(|&place| self.wakes.settle(place as usize / BLOCK));
            block = next;
        }
        least
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
