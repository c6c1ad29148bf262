//! Step 3 of the front: the pairs within tolerance, marched every tick.

use super::super::{LeafPairs, TraversalCounters};
use super::{Front, PlacedPair};
use crate::algebra::Quota;

impl Front {
    /// Step 3, of the first `count` pairs; those that are not visited come first, here and next
    /// time.
    pub(super) fn visit_awake(
        &mut self,
        query: &PlacedPair<'_>,
        count: usize,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let (mut kept, mut visited) = (0, 0);
        while visited < count && (visited == 0 || !quota.is_spent()) {
            let place = self.awake[visited];
            visited += 1;
            if !self.is_wanted(query, place) {
                self.awake[kept] = place;
                kept += 1;
                continue;
            }
            let before = counters.work();
            counters.node_pairs += 1;
            counters.leaf_tests += 1;
            let (answer, memory) = self.march(query, place, counters);
            quota.spend(counters.work() - before);
            if answer.is_within(query.tolerance) {
                self.awake[kept] = place;
                kept += 1;
                found.push(self.leaf_pair(query, place, answer, memory), query);
            } else {
                self.sleep(query, place, answer.distance());
            }
        }
        let gone = visited - kept;
        if gone > 0 {
            self.awake.copy_within(visited.., kept);
            self.awake.truncate(self.awake.len() - gone);
        }
        self.unvisited = count - visited;
        counters.postponed += self.unvisited as u32;
        if self.unvisited > 0 {
            self.awake.rotate_left(kept);
        }
    }
}
