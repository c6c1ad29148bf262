//! Searches below a pair of nodes without stored data, for pairs that do not fit into the front and
//! for the nearest pair.
//!
//! 1. Go down from the pair of nodes, to the nearer half first. Drop every pair that is farther
//!    apart than the limit. The distance is tested with spheres, then with boxes, then with the
//!    nodes' hulls.
//! 2. March each pair of leaves. Its result may lower the limit.
//!
//! The search for the nearest pair starts in this way at each pair on the cut, at the pair with the
//! least bound first. A waiting pair has a bound from its last measurement, so most waiting pairs
//! are not examined.

use super::super::march::{completed, kept_by_half, march};
use super::super::wakes::NEVER;
use super::super::{LeafPair, LeafPairs, March, Proximity, StopReason, TraversalCounters};
use super::{Front, Pair, PlacedPair, State, piece_of};
use crate::algebra::Quota;
use crate::body::Feature;

/// A pair of nodes that the search has not examined yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodePair {
    nodes: [u32; 2],
    /// Lower bound of the distance between the two nodes, model units.
    bound: f64,
    /// The features at which the march starts, if they are known.
    known: [Option<Feature>; 2],
}

impl NodePair {
    /// A pair about which nothing else is known.
    fn new(nodes: [u32; 2], bound: f64) -> Self {
        Self { nodes, bound, known: [None; 2] }
    }
}

/// The nearest leaf pairs that a search has found so far.
struct Near<'f> {
    /// Pairs farther apart than this are ignored. The limit is the least distance found so far plus
    /// [`Self::slack`].
    limit: f64,
    slack: f64,
    /// Nodes of a leaf pair that is already in `found`.
    known: Option<[u32; 2]>,
    found: &'f mut LeafPairs,
}

impl Front {
    /// Adds to `found` the leaf pairs below a pair of nodes that overlap or are nearer than the
    /// tolerance. Returns false if what is left of the quota does not suffice for all of them.
    pub(super) fn search_below(
        &mut self,
        query: &PlacedPair<'_>,
        nodes: [u32; 2],
        quota: &Quota<'_>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> bool {
        let root = NodePair::new(nodes, 0.0);
        let mut below = std::mem::take(&mut self.below);
        let most = quota.left().map(|left| counters.work() + left);
        descend(query, root, query.tolerance, &mut below, most, counters, &mut |nodes, answer| {
            if answer.is_within(query.tolerance) {
                found.push(unremembered(query, nodes, answer), query, &self.memories);
            }
            query.tolerance
        });
        let done = below.is_empty();
        self.below = below;
        done
    }

    /// Writes the nearest of all leaf pairs to `found`, or an overlapping pair if there is one.
    /// Also writes the leaf pairs that are at most `slack` (model units) farther apart. `query`
    /// must be the query of the last call of [`Self::within`]. `found` is cleared first.
    pub fn nearest(
        &mut self,
        query: &PlacedPair<'_>,
        slack: f64,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        found.clear();
        let mut near = Near { limit: f64::INFINITY, slack, known: None, found };
        // The search begins below the last result, and continues below the pair with the least
        // bound. The limit that it finds there excludes most other pairs.
        let known = self.last_nearest;
        if let Some(nodes) = known {
            self.nearer(query, NodePair::new(nodes, 0.0), &mut near, counters);
            near.known = known;
        }
        if !self.begun {
            self.nearer(query, NodePair::new(self.nodes, 0.0), &mut near, counters);
            return;
        }
        let places = 0..self.fresh;
        let first = places.clone().filter_map(|place| self.on_cut(place)).min_by(|x, y| x.bound.total_cmp(&y.bound));
        if let Some(first) = first.filter(|first| first.bound < near.limit) {
            self.nearer(query, first, &mut near, counters);
        }
        for place in places {
            if let Some(pair) = self.on_cut(place)
                && pair.bound < near.limit
                && first.is_none_or(|first| first.nodes != pair.nodes)
            {
                self.nearer(query, pair, &mut near, counters);
            }
        }
    }

    /// Returns the pair at a place, and a lower bound of its distance. `None` if the pair is not on
    /// the cut.
    fn on_cut(&self, place: u32) -> Option<NodePair> {
        let Pair { a, b, state, .. } = self.pairs[place as usize];
        let wake = self.wakes.get(place);
        let bound = match state {
            State::Split => return None,
            State::Awake | State::Represented | State::Unsplit => 0.0,
            // This half was merged with the other half.
            State::Waiting if wake == NEVER => return None,
            State::Waiting => self.tolerance - self.motion_bound.since(wake),
            // The pair was not within the tolerance before it was due.
            State::Sliding => self.tolerance - self.motion_bound.since(wake).max(0.0),
        };
        Some(NodePair::new([a, b], bound))
    }

    /// Searches below a pair for leaf pairs nearer than the limit.
    fn nearer(
        &mut self,
        query: &PlacedPair<'_>,
        pair: NodePair,
        near: &mut Near<'_>,
        counters: &mut TraversalCounters,
    ) {
        let mut last = self.last_nearest;
        let mut below = std::mem::take(&mut self.below);
        let limit = descend(query, pair, near.limit, &mut below, None, counters, &mut |nodes, answer| {
            let distance = answer.distance();
            if distance < near.limit && near.known != Some(nodes) {
                if distance + near.slack < near.limit {
                    near.limit = distance + near.slack;
                    near.found.retain_within(near.limit);
                    last = Some(nodes);
                }
                near.found.push(unremembered(query, nodes, answer), query, &self.memories);
            }
            // Nothing is nearer than an overlap.
            if matches!(answer.proximity, Proximity::Overlapping(_)) { f64::NEG_INFINITY } else { near.limit }
        });
        near.limit = limit;
        self.below = below;
        self.last_nearest = last;
    }
}

/// Calls `visit` with the leaf pairs below a pair that are no farther apart than the limit. Each
/// call returns a new limit. Returns the last limit. The search ends when the work of `counters`
/// exceeds `most`; then `below` contains the pairs that are left.
fn descend(
    query: &PlacedPair<'_>,
    pair: NodePair,
    mut limit: f64,
    below: &mut Vec<NodePair>,
    most: Option<u64>,
    counters: &mut TraversalCounters,
    visit: &mut impl FnMut([u32; 2], &March) -> f64,
) -> f64 {
    below.clear();
    below.push(pair);
    while most.is_none_or(|most| counters.work() <= most)
        && let Some(NodePair { nodes, bound, known }) = below.pop()
    {
        if bound > limit {
            continue;
        }
        let (polytope_a, polytope_b) = query.polytopes(nodes);
        let start = completed(polytope_a, polytope_b, query.pose_ba, known);
        let answer = march(polytope_a, polytope_b, query.pose_ba, start);
        let split = query.halves(nodes);
        counters.node_pairs += 1;
        counters.leaf_tests += u32::from(split.is_none());
        counters.hull_tests += u32::from(split.is_some());
        counters.march_steps += answer.steps;
        counters.march_fallbacks += u32::from(answer.stop != StopReason::Converged);
        if answer.distance() > limit {
            continue;
        }
        let Some(split) = split else {
            limit = visit(nodes, &answer);
            continue;
        };
        let [one, other] = split.map(|half| NodePair {
            nodes: half,
            bound: query.bound(half, limit),
            known: kept_by_half(nodes, answer.features, half),
        });
        let (near, far) = if other.bound < one.bound { (other, one) } else { (one, other) };
        below.extend([far, near]);
    }
    limit
}

/// Returns a leaf pair without a place in the front.
fn unremembered(query: &PlacedPair<'_>, nodes: [u32; 2], answer: &March) -> LeafPair {
    let (piece_a, piece_b) = (piece_of(query.a, nodes[0]), piece_of(query.b, nodes[1]));
    LeafPair { piece_a, piece_b, place: None, proximity: answer.proximity }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::Side;
    use super::super::super::oracle::cuboid;
    use super::*;
    use crate::algebra::{Pose, Work};
    use crate::body::{Hierarchy, convex_hull};

    #[test]
    fn search_without_room_keeps_to_the_quota() {
        // Two layers of 400 cubes, of which each touches up to nine.
        let corners = cuboid(DVec3::splat(0.5)).vertices().to_vec();
        let cube = |k: usize| {
            let at = DVec3::new((k % 20) as f64, (k / 20) as f64, 0.0);
            let moved: Vec<DVec3> = corners.iter().map(|&corner| at + corner).collect();
            convex_hull(&moved, 1e-10).unwrap().into_polytope().unwrap().0
        };
        let pieces: Vec<_> = (0..400).map(cube).collect();
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let (mut front, mut found) = (Front::new(side, side, 64), LeafPairs::new(4000));
        let pose_ba = Pose::from_translation(DVec3::new(0.3, 0.4, 1.01)).placement();
        let query = PlacedPair::new(side, side, &pose_ba, 0.02);
        let all = front.within(&query, &mut found);
        assert!(all.unsplit > 0 && all.work() > 20_000 && found.as_slice().len() > 1000, "{all:?}");
        front.clear();
        for _ in 0..100 {
            let counters = front.within_quota(&query, &Work::of(Some(200)).all(), &mut found);
            assert!(counters.postponed > 0 && counters.work() < 300, "{counters:?}");
        }
    }
}
