//! Step 2 of the front: measures the pairs that are due again. A pair then waits again, becomes
//! awake, or is split.

use super::super::bounds::{box_gap, sphere_gap};
use super::super::wakes::{BLOCK, NEVER};
use super::super::{LeafPairs, March, TraversalCounters};
use super::{Front, Pair, PlacedPair, State};
use crate::algebra::Quota;
use crate::algebra::tolerance::{BOX_WAIT, SPHERE_WAIT, WORK_BOUNDED};
use crate::body::NodeKind;

/// Number of due pairs that are collected at a time.
pub(super) const DUE: usize = 64;

/// If the quota is spent, the next query resumes the search at the start of the same group of this
/// many blocks. So a small front is always searched from its start, and a pair that is due in each
/// query is measured in each query. If the search resumed at the same block instead, a tool with
/// little work that slides along the wall of a hole would overlap by 0.3 mm instead of 0.07 mm.
///
/// If a pair that has no room for its halves spent the quota, the next query resumes at the next
/// group: the search below this pair may spend the quota of each query.
const RESUMED: usize = 4;

/// Bounds of a pair that are computed before the pair is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// The stored bound, model units; minus infinity if nothing is stored.
    pub(super) point: f64,
    /// The gap along the stored normal, model units. `None` if it is not computed.
    pub(super) along: Option<f64>,
    /// The gap between the spheres around both nodes, model units. `None` if it is not computed.
    pub(super) spheres: Option<f64>,
}

impl Known {
    const NOTHING: Self = Self { point: f64::NEG_INFINITY, along: None, spheres: None };
}

/// Result of measuring a pair.
enum Measured {
    /// The pair is at least this far apart, and not nearer than the tolerance.
    Apart(f64),
    /// The pair is a pair of leaves within the tolerance.
    Within(March),
    /// The nodes are within the tolerance, and at least one of them is not a leaf.
    Near(March),
}

impl Front {
    /// Does step 2, and step 4 for pairs that wait again. Returns false if the quota is spent
    /// before all due pairs are visited.
    pub(super) fn wake_due(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> bool {
        // Pairs that are added during this round are measured at once.
        let blocks = self.blocks();
        let first = self.first_block.min(blocks);
        for (begin, end) in [(first, blocks), (0, first)] {
            let mut block = begin;
            while block < end {
                let mut due = [0; DUE];
                let is_wanted = |block: usize| query.wants(self.thinnest_in[block]);
                let (count, next) = self.wakes.collect(block, end, self.motion_bound.sum(), is_wanted, &mut due);
                if let Some(late) = self.wake_some(query, &due[..count], quota, found, counters) {
                    let unsplit = self.pairs[late as usize].state == State::Unsplit;
                    let group = late as usize / BLOCK / RESUMED + usize::from(unsplit);
                    self.first_block = group * RESUMED;
                    return false;
                }
                block = next;
            }
        }
        self.first_block = 0;
        true
    }

    /// Does step 2 for the pairs `due`. If the quota is spent, returns the place of the pair at
    /// which this happened.
    fn wake_some(
        &mut self,
        query: &PlacedPair<'_>,
        due: &[u32],
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> Option<u32> {
        let known = self.bounds(query, due, query.tolerance);
        for (k, (&place, &known)) in due.iter().zip(&known).enumerate() {
            let block = place as usize / BLOCK;
            quota.spend(u64::from(k as u64 % WORK_BOUNDED == WORK_BOUNDED - 1));
            let late = self.is_wanted(query, place) && self.wake(query, place, known, quota, found, counters);
            if late || due.get(k + 1).is_none_or(|&next| next as usize / BLOCK != block) {
                self.wakes.settle(block);
            }
            if late {
                return Some(place);
            }
        }
        None
    }

    /// Computes the cheapest bounds of the pairs `due`: the stored bound, and another one if the
    /// stored bound does not exceed `enough` (model units). The places of the pairs are far apart
    /// in memory. The reads of each loop do not depend on each other, so the processor waits for
    /// several of them at a time. The first loop does little else, so it waits for the most.
    pub(super) fn bounds(&self, query: &PlacedPair<'_>, due: &[u32], enough: f64) -> [Known; DUE] {
        let mut known = [Known::NOTHING; DUE];
        let mut measured = [None; DUE];
        for (nodes, &place) in measured.iter_mut().zip(due) {
            let Pair { a, b, state, .. } = self.pairs[place as usize];
            // A represented pair is seldom measured.
            *nodes = (state != State::Represented).then_some([a, b]);
        }
        for (known, &place) in known.iter_mut().zip(due) {
            known.point = self.stored_gap(query.pose_ba, place);
        }
        for ((known, nodes), &place) in known.iter_mut().zip(measured).zip(due) {
            if let Some([a, b]) = nodes
                && known.point <= enough
            {
                known.along = self.gap_at(query, query.pose_ba, place);
                if known.along.is_some() {
                    continue;
                }
                let (node_a, node_b) = (query.a.hierarchy.node(a), query.b.hierarchy.node(b));
                known.spheres = Some(sphere_gap(&node_a.sphere, &node_b.sphere, query.pose_ba));
            }
        }
        known
    }

    /// Does step 2 for one pair with the bounds `known`, and for the halves into which it is
    /// split. Returns true if the quota is spent.
    pub(super) fn wake(
        &mut self,
        query: &PlacedPair<'_>,
        place: u32,
        mut known: Known,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> bool {
        counters.woken += 1;
        let mut late = false;
        self.stack.push(place);
        while !late && let Some(place) = self.stack.pop() {
            // Halves have no bounds yet.
            let known = std::mem::replace(&mut known, Known::NOTHING);
            if self.is_wanted(query, place) {
                let before = counters.work();
                self.look(query, place, known, quota, found, counters);
                quota.spend(counters.work() - before);
                late = quota.is_spent();
            }
        }
        // Pairs that remain on the stack keep the wake time of the pair from which they were split.
        self.stack.clear();
        late
    }

    /// Measures a pair with the bounds `known`, and sets its new state. If the pair is split,
    /// its halves are put onto the stack.
    pub(super) fn look(
        &mut self,
        query: &PlacedPair<'_>,
        place: u32,
        known: Known,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let mut gap = known.point;
        if self.pairs[place as usize].state == State::Represented {
            match self.no_longer_represented(query, place, gap, counters) {
                Some(bound) => gap = bound,
                None => return,
            }
        }
        if gap > query.tolerance {
            counters.bounded_by_point += 1;
            self.postpone(query, place, gap);
            self.merge(query, place, quota, counters);
            self.slide(query, place, gap - query.tolerance, false);
            return;
        }
        match self.measure(query, place, known, counters) {
            Measured::Apart(distance) => {
                self.postpone(query, place, distance);
                self.merge(query, place, quota, counters);
                self.slide(query, place, distance - query.tolerance, true);
            }
            Measured::Within(answer) => {
                self.pairs[place as usize].state = State::Awake;
                self.wakes.set(place, NEVER);
                self.end_idle(place);
                self.awake.push(place);
                let leaf = self.leaf_pair(query, place, &answer);
                found.push(leaf, query, &self.memories);
            }
            Measured::Near(answer) if self.split(query, place) => {
                counters.split += 1;
                self.store_split_gap(query, place, &answer);
            }
            Measured::Near(_) => {
                counters.unsplit += 1;
                self.was_full = true;
                let Pair { a, b, .. } = self.pairs[place as usize];
                self.pairs[place as usize].state = State::Unsplit;
                let done = self.search_below(query, [a, b], quota, found, counters);
                self.wakes.set(place, if done { self.motion_bound.sum() } else { 0 });
            }
        }
    }

    /// Returns the pair's distance, or a lower bound of it that lets the pair wait for a while. The
    /// cheapest bound is tried first. It is accepted if it allows a sufficiently long wait;
    /// otherwise the next bound is tried.
    fn measure(
        &mut self,
        query: &PlacedPair<'_>,
        place: u32,
        known: Known,
        counters: &mut TraversalCounters,
    ) -> Measured {
        counters.node_pairs += 1;
        if let Some(gap) = known.along
            && gap > query.tolerance
        {
            self.store_again(query, place, gap);
            return Measured::Apart(gap);
        }
        let Pair { a, b, .. } = self.pairs[place as usize];
        let (node_a, node_b) = (query.a.hierarchy.node(a), query.b.hierarchy.node(b));
        let gap = known.spheres.unwrap_or_else(|| sphere_gap(&node_a.sphere, &node_b.sphere, query.pose_ba));
        if gap > query.tolerance + SPHERE_WAIT * self.pace.motion {
            return Measured::Apart(gap);
        }
        if self.pairs[place as usize].bound.exists() {
            // Parts that slide along each other keep their distance along this normal, however far
            // they slide.
            let gap = known.along.or_else(|| self.measure_gap(query, place));
            if let Some(gap) = gap.filter(|&gap| gap > query.tolerance) {
                return Measured::Apart(gap);
            }
        } else {
            let enough = query.tolerance + BOX_WAIT * self.pace.motion;
            let boxes = box_gap(&node_a.oriented_box, &node_b.oriented_box, query.pose_ba, 2.0 * enough);
            if boxes.gap > query.tolerance - self.pace.motion {
                self.store_gap(query, place, boxes.axis.normalize(), boxes.gap);
            }
            let gap = gap.max(boxes.gap);
            if gap > enough {
                return Measured::Apart(gap);
            }
            // The hulls inside the boxes are farther apart along the same axis.
            if let Some(gap) = self.measure_gap(query, place)
                && gap > query.tolerance + self.pace.motion
            {
                return Measured::Apart(gap);
            }
        }
        let leaves = [node_a, node_b].iter().all(|node| matches!(node.kind, NodeKind::Leaf { .. }));
        counters.leaf_tests += u32::from(leaves);
        counters.hull_tests += u32::from(!leaves);
        let answer = self.march(query, place, counters);
        match (leaves, answer.distance()) {
            (true, _) if answer.is_within(query.tolerance) => Measured::Within(answer),
            (false, apart) if apart <= query.tolerance => Measured::Near(answer),
            (_, apart) => Measured::Apart(apart),
        }
    }

    /// Puts both halves of a pair onto the stack; returns false if there is no room for them.
    pub(super) fn split(&mut self, query: &PlacedPair<'_>, place: u32) -> bool {
        let Pair { a, b, .. } = self.pairs[place as usize];
        let Some(halves) = query.halves([a, b]) else { return false };
        let Some(first) = self.take_places() else { return false };
        let wake = self.wakes.get(place);
        let parent = place;
        for (half, place) in halves.into_iter().zip([first, first + 1]) {
            self.occupy(place, half, parent);
            // The halves keep the wake time of the pair.
            self.wakes.set(place, wake);
            self.stack.push(place);
        }
        self.pairs[place as usize].split(first);
        self.wakes.set(place, NEVER);
        true
    }

    fn take_places(&mut self) -> Option<u32> {
        self.free.pop().or_else(|| {
            let first = self.fresh;
            (first as usize + 2 <= self.places).then(|| {
                self.fresh += 2;
                self.use_places(self.fresh as usize);
                first
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::Side;
    use super::super::super::oracle::cuboid;
    use super::*;
    use crate::algebra::Pose;
    use crate::body::Hierarchy;

    #[test]
    fn pieces_sliding_past_each_other_are_not_marched() {
        let pieces = [cuboid(DVec3::new(1.0, 1.0, 0.1))];
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let (mut front, mut found) = (Front::new(side, side, 100), LeafPairs::new(10));
        let mut marched = 0;
        for tick in 0..100 {
            // One piece is above the other. The gap is slightly larger than the tolerance: a tick's
            // motion could close the difference.
            let pose_ba = Pose::from_translation(DVec3::new(0.005 * f64::from(tick), 0.0, 0.212)).placement();
            let query = PlacedPair::new(side, side, &pose_ba, 0.01);
            let counters = front.within(&query, &mut found);
            assert!(found.as_slice().is_empty());
            marched += counters.leaf_tests;
        }
        assert_eq!(marched, 0);
        // The pair is found when it is within the tolerance.
        let pose_ba = Pose::from_translation(DVec3::new(0.5, 0.0, 0.209)).placement();
        front.within(&PlacedPair::new(side, side, &pose_ba, 0.01), &mut found);
        assert_eq!(found.as_slice().len(), 1);
    }

    #[test]
    fn small_body_that_flies_past_does_not_start_the_front_again() {
        let pieces = [0.1, 2.0].map(|half| [cuboid(DVec3::splat(half))]);
        let hierarchies = [0, 1].map(|k| Hierarchy::build(&pieces[k], 1e-9).unwrap());
        let [a, b] = [0, 1].map(|k| Side { hierarchy: &hierarchies[k], pieces: &pieces[k] });
        let (mut front, mut found) = (Front::new(a, b, 100), LeafPairs::new(10));
        let mut restarted = |x: f64, z: f64| {
            let pose_ba = Pose::from_translation(DVec3::new(x, 0.0, z)).placement();
            front.within(&PlacedPair::new(a, b, &pose_ba, 0.01), &mut found).restarted
        };
        // In each query, the small body moves by half of its size.
        let far = [0, 1, 2, 3].map(|k| restarted(0.1 * f64::from(k), 4.0));
        assert_eq!(far, [1, 0, 0, 0]);
        // Where the bodies are near each other, cached depths may be those of another side.
        let near = [0, 1, 2].map(|k| restarted(0.1 * f64::from(k), 2.105));
        assert_eq!(near, [1, 1, 1]);
    }
}
