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

    /// Does step 3 for pairs for which the quota did not suffice in this query.
    pub(super) fn visit_late(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        if self.late == 0 || quota.is_spent() {
            return;
        }
        let (count, resting, idle) = (self.late, self.unvisited - self.late, self.idle_count);
        let all = self.awake.len();
        self.visit_awake(query, count, quota, found, counters);
        if self.unvisited == 0 {
            // The pairs at rest come first again.
            let kept = count + self.awake.len() - all;
            self.awake.rotate_left(kept);
        }
        self.unvisited += resting;
        self.idle_count += idle;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::Side;
    use super::super::super::oracle::cuboid;
    use super::*;
    use crate::algebra::{Pose, Work};
    use crate::body::{Hierarchy, Polytope, convex_hull};

    #[test]
    fn late_pairs_are_visited_if_there_is_work_left() {
        const COUNT: u32 = 20;
        let plate = [cuboid(DVec3::new(40.0, 1.0, 1.0))];
        let piece = |k: u32| {
            let corners = cuboid(DVec3::splat(0.5)).vertices().to_vec();
            let points: Vec<_> =
                corners.iter().map(|corner| *corner + DVec3::X * (2.0 * f64::from(k) - 20.0)).collect();
            convex_hull(&points, 1e-10).unwrap().into_polytope().unwrap().0
        };
        let row: Vec<Polytope> = (0..COUNT).map(piece).collect();
        let hierarchies = [Hierarchy::build(&plate, 1e-9).unwrap(), Hierarchy::build(&row, 1e-9).unwrap()];
        let a = Side { hierarchy: &hierarchies[0], pieces: &plate };
        let b = Side { hierarchy: &hierarchies[1], pieces: &row };
        let (mut front, mut found) = (Front::new(a, b, 400), LeafPairs::new(100));
        for (tick, limit) in [None, Some(40), Some(40)].into_iter().enumerate() {
            let pose_ba = Pose::from_translation(DVec3::new(0.0, 0.0, 1.505 + 1e-4 * tick as f64)).placement();
            let query = PlacedPair::new(a, b, &pose_ba, 0.01);
            let mut counters = front.within_quota(&query, &Work::of(limit).all(), &mut found);
            assert_eq!(found.as_slice().len() + front.late(), COUNT as usize, "{tick}");
            assert_eq!(front.late() > 0, limit.is_some(), "{tick}");
            front.go_on(&query, &Work::of(Some(1000)).all(), &mut found, &mut counters);
            assert_eq!((found.as_slice().len(), front.late()), (COUNT as usize, 0), "{tick}");
            let mut pieces: Vec<u32> = found.as_slice().iter().map(|pair| pair.piece_b).collect();
            pieces.sort_unstable();
            assert_eq!(pieces, (0..COUNT).collect::<Vec<_>>());
        }
    }
}
