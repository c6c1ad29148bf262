//! Cost of the search for near pairs.

use crate::algebra::tolerance::{WORK_MARCH, WORK_STEP};

/// Cost of a search for near pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalCounters {
    /// Number of node pairs that were examined by bounds or hulls.
    pub node_pairs: u32,
    /// Number of distance marches between hulls of inner nodes.
    pub hull_tests: u32,
    /// Number of distance marches between leaf pieces.
    pub leaf_tests: u32,
    /// Number of steps of all marches.
    pub march_steps: u32,
    /// Number of marches without a result; the fallback (GJK) gave the result.
    pub march_fallbacks: u32,
    /// Number of leaf pairs within tolerance that were left out because there was no room. The
    /// deepest pairs are kept.
    pub dropped: u32,
    /// Number of pairs of the front that were due and measured.
    pub woken: u32,
    /// Number of pairs of the front that were split.
    pub split: u32,
    /// Number of pairs of the front that were merged back.
    pub merged: u32,
    /// Number of pairs that were searched without cached data, because the front had no room to
    /// split them.
    pub unsplit: u32,
    /// Number of pairs of the front that should have been measured, but were postponed to the next
    /// query because the work limit was reached.
    pub postponed: u32,
    /// Number of pairs within tolerance that were not measured: their contacts are extrapolated
    /// from an earlier query.
    pub resting: u32,
    /// Number of pairs within tolerance that were not measured, because they cannot have a contact.
    pub idle: u32,
    /// Number of due pairs for which a stored point gave a sufficient bound.
    pub bounded_by_point: u32,
    /// Number of due represented pairs whose gap was computed from support vertices.
    pub bounded_by_supports: u32,
    /// Number of node pairs of the tree that the front stores.
    pub front: u32,
    /// Number of leaf pairs of the front within tolerance.
    pub near: u32,
    /// 1 if the front started from the roots: in the first query, after a jump, or after it was
    /// cleared.
    pub restarted: u32,
}

impl TraversalCounters {
    /// Returns the total cost, in units of [`crate::algebra::Work`].
    pub fn work(&self) -> u64 {
        let bounds = u64::from(self.node_pairs) + u64::from(self.bounded_by_supports);
        let marches = WORK_MARCH * (u64::from(self.hull_tests) + u64::from(self.leaf_tests));
        bounds + marches + WORK_STEP * u64::from(self.march_steps)
    }
}

impl std::ops::AddAssign for TraversalCounters {
    fn add_assign(&mut self, other: Self) {
        let Self {
            node_pairs,
            hull_tests,
            leaf_tests,
            march_steps,
            march_fallbacks,
            dropped,
            woken,
            split,
            merged,
            unsplit,
            postponed,
            resting,
            idle,
            bounded_by_point,
            bounded_by_supports,
            front,
            near,
            restarted,
        } = other;
        self.node_pairs += node_pairs;
        self.hull_tests += hull_tests;
        self.leaf_tests += leaf_tests;
        self.march_steps += march_steps;
        self.march_fallbacks += march_fallbacks;
        self.dropped += dropped;
        self.woken += woken;
        self.split += split;
        self.merged += merged;
        self.unsplit += unsplit;
        self.postponed += postponed;
        self.resting += resting;
        self.idle += idle;
        self.bounded_by_point += bounded_by_point;
        self.bounded_by_supports += bounded_by_supports;
        self.front += front;
        self.near += near;
        self.restarted += restarted;
    }
}
