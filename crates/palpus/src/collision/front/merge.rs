//! Step 4 of the front: merges the halves of a pair if both wait for a long motion.

use super::super::TraversalCounters;
use super::super::wakes::NEVER;
use super::{Front, NONE, Pair, PlacedPair, State};
use crate::algebra::Quota;
use crate::algebra::tolerance::{MERGE_CLEARANCE, MERGE_RETRY};

impl Front {
    /// Returns the clearance that both halves need before they are merged, model units. Pairs that
    /// were split because they will soon be near stay split until then.
    fn merge_clearance(&self, query: &PlacedPair<'_>) -> f64 {
        MERGE_CLEARANCE * query.tolerance + self.preparation.reach
    }

    /// Computes the wake value that both halves need before they are merged in this query.
    pub(super) fn begin_merges(&mut self, query: &PlacedPair<'_>) {
        self.merged_from = self.motion_bound.due(self.merge_clearance(query));
    }

    /// Does step 4: merges the half at `place` with the other half, if both wait for a long motion
    /// and the whole pair is far enough apart. Repeats this for the merged pair, until the quota is
    /// spent.
    pub(super) fn merge(
        &mut self,
        query: &PlacedPair<'_>,
        mut place: u32,
        quota: &Quota<'_>,
        counters: &mut TraversalCounters,
    ) {
        let (long, until) = (self.merge_clearance(query), self.merged_from);
        while !quota.is_spent() && self.wakes.get(place) >= until && self.waits_until(place ^ 1, until) {
            let parent = self.pairs[place as usize].parent;
            if parent == NONE {
                return;
            }
            let first = place & !1;
            let Pair { a, b, .. } = self.pairs[parent as usize];
            counters.node_pairs += 1;
            let enough = query.tolerance + long;
            let gap = query.bound([a, b], enough);
            if gap <= enough {
                self.retries[first as usize / 2] = self.motion_bound.due((enough - gap).max(MERGE_RETRY * long));
                return;
            }
            counters.merged += 1;
            self.wakes.set(first, NEVER);
            self.wakes.set(first + 1, NEVER);
            self.free.push(first);
            self.pairs[parent as usize].unite();
            self.postpone(query, parent, gap);
            place = parent;
        }
    }

    /// Returns true if the pair at `place` waits at least until `sum`, and no merge of it has been
    /// refused shortly before.
    fn waits_until(&self, place: u32, sum: u64) -> bool {
        // The wake value is near the values just read. The pair is not, and a pair that is split or
        // awake is never due.
        let wake = self.wakes.get(place);
        let is_long = wake >= sum && wake != NEVER && self.retries[place as usize / 2] <= self.motion_bound.sum();
        is_long && self.pairs[place as usize].state == State::Waiting
    }
}
