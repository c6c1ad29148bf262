//! Preparation: pairs that will soon be near are split before the bodies touch.
//!
//! If a flat face lands on another, thousands of pairs come within the tolerance in one query, and
//! the tree above them must be searched, too. With limited work, this takes many queries, during
//! which the tool is held. Before that, nothing was near, and the queries had no work. So they use
//! a part of it to search this tree in advance:
//!
//! 1. The bodies are expected to repeat their last motion. The search goes through the poses after
//!    one, two and more of these motions, and leaves out poses where the gaps show that nothing is
//!    near. It ends a few tolerances of motion after the first pose with a near leaf pair.
//! 2. Waiting pairs that are near at such a pose are split, and so are their halves. The halves
//!    keep the wake value of the pair. Leaf pairs are marched, so that their next march has a
//!    start. Other pairs store their gap. *Near* means within a multiple of the tolerance, since
//!    the motion is not known exactly.
//! 3. The search pauses for about half of these motions. It begins again then, since the motion may
//!    have changed.
//!
//! Preparation changes the cost of later queries, not their results. The bounds of all pairs stay
//! valid, whatever the motion is.

use super::super::wakes::BLOCK;
use super::super::{Closest, PlacedPair, Proximity, TraversalCounters};
use super::due::DUE;
use super::{Front, Pair, State};
use crate::algebra::Quota;
use crate::algebra::tolerance::{
    PREPARED_DEPTH, PREPARED_PAUSE, PREPARED_SHARE, PREPARED_TICKS, PREPARED_TOLERANCE, WORK_BOUNDED,
};

/// The progress of the preparation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Preparation {
    /// Number of motions from the present pose to the pose of the search.
    left: u32,
    /// The block of `wakes` at which the search continues.
    block: usize,
    /// For this motion from the pose of the search, no other pair is near, model units.
    gap: f64,
    /// True if the search at this pose has found a near leaf pair.
    found: bool,
    /// Number of motions from the present pose to the last pose of the search.
    last: u32,
    /// Number of queries until the search begins again; 0 during a search.
    pause: u32,
    /// The motion to the pose of the search, model units. Pairs that are nearer are not merged.
    pub(super) reach: f64,
}

impl Preparation {
    /// The search begins in the next query.
    pub(super) const NONE: Self =
        Self { left: 1, block: 0, gap: f64::INFINITY, found: false, last: PREPARED_TICKS, pause: 1, reach: 0.0 };
}

impl Front {
    /// Begins the preparation of a query: the bodies have moved on to the pose of the search.
    /// Nothing is prepared while pairs are awake.
    pub(super) fn begin_preparation(&mut self) {
        if !self.awake.is_empty() {
            self.preparation = Preparation::NONE;
            return;
        }
        let Preparation { left, last, pause, .. } = &mut self.preparation;
        if *pause == 0 {
            *left = left.saturating_sub(1).max(1);
            *last = last.saturating_sub(1);
            return;
        }
        *pause -= 1;
        if *pause == 0 {
            self.preparation = Preparation { pause: 0, ..Preparation::NONE };
        }
    }

    /// Returns true if the preparation is not over.
    pub(crate) fn is_preparing(&self) -> bool {
        self.preparation.pause == 0 && self.awake.is_empty() && self.still_due == 0
    }

    /// Splits pairs that will soon be near, up to `quota`. The last query must have been at the
    /// same pose.
    pub(crate) fn prepare(&mut self, query: &PlacedPair<'_>, quota: &Quota<'_>, counters: &mut TraversalCounters) {
        while self.is_preparing() && !quota.is_spent() {
            let Some((pose_ba, motion)) = self.motion_bound.expected(self.preparation.left) else { return };
            self.preparation.reach = motion;
            let expected = PlacedPair { pose_ba: &pose_ba, tolerance: PREPARED_TOLERANCE * query.tolerance, ..*query };
            if !self.prepare_at(&expected, motion, quota, counters) {
                break;
            }
            let Preparation { left, gap, found, last, .. } = self.preparation;
            let ticks = |length: f64| (f64::from(left) * length / motion).clamp(1.0, f64::from(PREPARED_TICKS)) as u32;
            let last = if found { last.min(left + ticks(PREPARED_DEPTH * query.tolerance)) } else { last };
            let next = left + ticks(gap);
            self.preparation = match next > last {
                true => Preparation { pause: PREPARED_PAUSE.max(left / 2), reach: motion, ..Preparation::NONE },
                false => Preparation { left: next, last, pause: 0, reach: motion, ..Preparation::NONE },
            };
        }
        counters.front = self.node_pairs() as u32;
    }

    /// Splits the pairs within the tolerance at the pose of `query`, which is at most `motion`
    /// (model units) from the present pose. Returns false if the quota is spent before.
    fn prepare_at(
        &mut self,
        query: &PlacedPair<'_>,
        motion: f64,
        quota: &Quota<'_>,
        counters: &mut TraversalCounters,
    ) -> bool {
        let margin = query.tolerance - self.tolerance;
        let (sum, blocks) = (self.motion_bound.due(motion + margin).saturating_add(1), self.blocks());
        while self.preparation.block < blocks {
            let mut due = [0; DUE];
            let (count, next) = self.wakes.collect(self.preparation.block, blocks, sum, |_| true, &mut due);
            quota.spend(count as u64 / WORK_BOUNDED);
            for &first in &due[..count] {
                if self.pairs[first as usize].state != State::Waiting {
                    continue;
                }
                self.stack.push(first);
                while let Some(place) = self.stack.pop() {
                    let before = counters.work();
                    let gap = self.prepare_pair(query, place, counters);
                    self.preparation.gap = self.preparation.gap.min(gap);
                    quota.spend(counters.work() - before);
                    if quota.is_spent() {
                        self.stack.clear();
                        self.preparation.block = first as usize / BLOCK;
                        return false;
                    }
                }
            }
            self.preparation.block = next;
        }
        let later = -self.motion_bound.since(self.wakes.least_from(blocks, sum)) - motion - margin;
        self.preparation.gap = self.preparation.gap.min(later);
        true
    }

    /// Splits a pair if it is within the tolerance at the pose of `query`, and puts its halves onto
    /// the stack. Otherwise returns the motion from there after which the pair may be within the
    /// tolerance, model units.
    fn prepare_pair(&mut self, query: &PlacedPair<'_>, place: u32, counters: &mut TraversalCounters) -> f64 {
        let Pair { a, b, known, .. } = self.pairs[place as usize];
        let stored = self.stored_gap(query.pose_ba, place);
        if stored > query.tolerance {
            return stored - query.tolerance;
        }
        let is_leaf = query.halves([a, b]).is_none();
        if is_leaf && known && stored > 0.0 {
            self.preparation.found = true;
            return f64::INFINITY;
        }
        counters.node_pairs += 1;
        let gap = query.bound([a, b], query.tolerance);
        if gap > query.tolerance {
            return gap - query.tolerance;
        }
        counters.leaf_tests += u32::from(is_leaf);
        counters.hull_tests += u32::from(!is_leaf);
        let answer = self.march(query, place, counters);
        if answer.distance() > query.tolerance {
            return answer.distance() - query.tolerance;
        }
        let has_room = (self.node_pairs() as f64) < PREPARED_SHARE * self.places() as f64;
        if is_leaf {
            self.preparation.found = true;
            if let Proximity::Disjoint(Closest { normal, distance, .. }) = answer.proximity {
                self.store_gap(query, place, normal, distance);
            }
        } else if has_room && self.split(query, place) {
            counters.split += 1;
            self.store_split_gap(query, place, &answer);
        }
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::{LeafPairs, Side};
    use super::*;
    use crate::algebra::{Placement, Pose, Work};
    use crate::body::{Hierarchy, Polytope, convex_hull};

    const TOLERANCE: f64 = 0.02;
    const PLACES: usize = 20_000;

    /// Returns a board of `count` × `count` tiles of width 1. Its top is at z = 0.
    fn board(count: u32) -> Vec<Polytope> {
        let tile = |at: DVec3| {
            let corner = |k: u32| at + DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), -0.2 * f64::from(k >> 2));
            let corners: Vec<DVec3> = (0..8).map(corner).collect();
            convex_hull(&corners, 1e-10).unwrap().into_polytope().unwrap().0
        };
        (0..count * count).map(|k| tile(DVec3::new(f64::from(k % count), f64::from(k / count), 0.0))).collect()
    }

    /// Returns the pose in tick `tick` of a board that falls onto another one, turned over.
    fn falling(tick: u32) -> Placement {
        let height = 0.5 - 0.01 * f64::from(tick);
        let turned = glam::DQuat::from_rotation_x(std::f64::consts::PI);
        Pose::new(turned, DVec3::new(0.4, 12.3, height)).placement()
    }

    #[test]
    fn landing_board_finds_its_pairs_prepared() {
        let pieces = board(12);
        let hierarchy = Hierarchy::build(&pieces, 1e-10).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let mut found = [(); 2].map(|()| LeafPairs::new(2000));
        let mut fronts = [(); 2].map(|()| Front::new(side, side, PLACES));
        let mut split = [0, 0];
        for tick in 0..50 {
            let pose_ba = falling(tick);
            let query = PlacedPair::new(side, side, &pose_ba, TOLERANCE);
            for ((front, found), (k, split)) in fronts.iter_mut().zip(&mut found).zip(split.iter_mut().enumerate()) {
                let mut counters = front.within(&query, found);
                *split = counters.split;
                if k == 1 && found.as_slice().is_empty() {
                    let work = Work::of(Some(1000));
                    front.prepare(&query, &work.all(), &mut counters);
                    assert!(work.spent() < 1100, "tick {tick}: {} units", work.spent());
                }
                assert_eq!(front.validate(&query), Ok(()), "tick {tick}");
            }
            let [pairs, prepared] = found.each_ref().map(|found| {
                let mut pairs: Vec<_> = found.as_slice().iter().map(|leaf| (leaf.piece_a, leaf.piece_b)).collect();
                pairs.sort_unstable();
                pairs
            });
            assert_eq!(pairs, prepared, "tick {tick}");
            if !pairs.is_empty() {
                break;
            }
        }
        let [all, prepared] = split;
        assert!(all > 500 && prepared * 20 < all, "{all} pairs are split without preparation, and {prepared} with it");
    }

    #[test]
    fn front_grows_within_the_memory_that_it_has() {
        let pieces = board(12);
        let hierarchy = Hierarchy::build(&pieces, 1e-10).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let (mut front, mut found) = (Front::new(side, side, PLACES), LeafPairs::new(2000));
        let mut all_used = front.clone();
        all_used.use_all_places();
        let (memory, usable) = (front.pairs.as_ptr(), front.pairs.len());
        assert!(usable < 1000 && all_used.pairs.len() == front.places());
        for tick in 0..50 {
            let pose_ba = falling(tick);
            let query = PlacedPair::new(side, side, &pose_ba, TOLERANCE);
            let counters = front.within(&query, &mut found);
            let pairs: Vec<_> = found.as_slice().iter().map(|leaf| (leaf.piece_a, leaf.piece_b)).collect();
            assert_eq!(all_used.within(&query, &mut found), counters, "tick {tick}");
            assert!(found.as_slice().iter().map(|leaf| (leaf.piece_a, leaf.piece_b)).eq(pairs));
        }
        assert!(front.pairs.len() > usable && front.pairs.len() < front.places());
        assert_eq!(front.pairs.as_ptr(), memory, "the lists have moved");
    }

    #[test]
    fn board_that_moves_away_prepares_nothing() {
        let pieces = board(12);
        let hierarchy = Hierarchy::build(&pieces, 1e-10).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let (mut front, mut found) = (Front::new(side, side, PLACES), LeafPairs::new(2000));
        for tick in (0..47).rev() {
            let pose_ba = falling(tick);
            let query = PlacedPair::new(side, side, &pose_ba, TOLERANCE);
            let mut counters = front.within(&query, &mut found);
            let before = counters.split;
            front.prepare(&query, &Work::of(Some(1000)).all(), &mut counters);
            assert_eq!(counters.split, before, "tick {tick}");
        }
    }
}
