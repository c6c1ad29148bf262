//! Step 3 of the front: marches the pairs within the tolerance in every tick, except idle pairs.

use super::super::{LeafPairs, TraversalCounters};
use super::{Front, PlacedPair};
use crate::algebra::Quota;

impl Front {
    /// Does step 3 for the first `count` pairs of the list. Moves the pairs that are not visited to
    /// the start of the list: first the pairs for which the quota did not suffice, then the pairs
    /// at rest. So the next query begins with these pairs.
    pub(super) fn visit_awake(
        &mut self,
        query: &PlacedPair<'_>,
        count: usize,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let mut sorted = std::mem::take(&mut self.sorted);
        let [late, resting] = &mut sorted;
        late.clear();
        resting.clear();
        let mut kept = 0;
        let mut visited = false;
        let mut spent = counters.work();
        self.idle_count = 0;
        for k in 0..count {
            let place = self.awake[k];
            if self.is_idle(query, place) {
                self.awake[kept] = place;
                kept += 1;
                self.idle_count += 1;
                continue;
            }
            if self.rest_share > 0.0 && self.is_at_rest(place) {
                resting.push(place);
                continue;
            }
            if visited && quota.is_spent() {
                late.push(place);
                continue;
            }
            visited = true;
            if !self.is_wanted(query, place) {
                self.awake[kept] = place;
                kept += 1;
                continue;
            }
            counters.node_pairs += 1;
            counters.leaf_tests += 1;
            let answer = self.march(query, place, counters);
            let work = counters.work();
            quota.spend(work - spent);
            spent = work;
            if answer.is_within(query.tolerance) {
                self.awake[kept] = place;
                kept += 1;
                let leaf = self.leaf_pair(query, place, &answer);
                found.push(leaf, query, &self.memories);
            } else {
                self.postpone(query, place, answer.distance());
            }
        }
        // The visited pairs, and the pairs that woke in this query, are at the end of the list.
        let gone = count - kept;
        if gone > 0 {
            self.awake.copy_within(count.., kept);
            self.awake.truncate(self.awake.len() - gone);
        }
        self.late = late.len();
        self.unvisited = late.len() + resting.len();
        if self.unvisited > 0 {
            self.awake.rotate_left(kept);
            self.awake.extend(late.iter().chain(resting.iter()));
            self.awake.rotate_right(self.unvisited);
        }
        counters.resting += resting.len() as u32;
        counters.idle += self.idle_count;
        self.sorted = sorted;
    }
}
