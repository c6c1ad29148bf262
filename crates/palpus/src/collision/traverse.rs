//! The descent through two hierarchies \[K02 §3.2, §4.1; EL01\].
//!
//! 1. From the pair of roots, drop every pair of nodes whose volumes are farther apart than the tolerance: first by
//!    spheres, then by boxes, then by the nodes' hulls.
//! 2. Split the larger node of what remains.
//! 3. A pair of leaves is a pair of convex pieces: march to its distance, or to the knowledge that it overlaps.
//!
//! The answer is *all* leaf pairs within the tolerance, not the first and not only successively nearer ones. When there
//! is none, [`Traversal::nearest`] finds the nearest pair by branch and bound, nearer child first, started from the pair
//! that was nearest last time.
//!
//! Deviation from \[EL01\]: their rule "when the closest features of two node hulls are both original, that distance is
//! the answer for the pair" holds for the nearest distance only, and it names no pieces; here it decides which
//! side to split (the one whose feature is free), and the hull distance bounds the subtree.

use glam::DVec3;

use crate::algebra::Placement;
use crate::algebra::tolerance::{WORK_MARCH, WORK_STEP};
use crate::body::{Feature, FeaturePair, Node, NodeKind, Polytope, Provenance};

use super::bounds::{box_gap, sphere_gap};
use super::coherence::{Coherence, Memory};
use super::leaf_pairs::Home;
use super::march::{initial_features, march};
use super::{Closest, LeafPair, LeafPairs, March, Proximity, Side, StopReason};

/// What a traversal cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalCounters {
    /// Node pairs looked at, by bounds or hulls.
    pub node_pairs: u32,
    /// Distance marches between hulls of inner nodes.
    pub hull_tests: u32,
    /// Distance marches between leaf pieces.
    pub leaf_tests: u32,
    /// Steps of all marches.
    pub march_steps: u32,
    /// Marches that gave up and were answered by the fallback.
    pub march_fallbacks: u32,
    /// Leaf pairs within tolerance that were left out since there was no room, the least deep ones.
    pub dropped: u32,
    /// Pairs of the sleeping front that were due and looked at.
    pub woken: u32,
    /// Pairs of the front that were split, and that were merged back.
    pub split: u32,
    /// See `split`.
    pub merged: u32,
    /// Pairs that were searched in full since the front had no room to split them.
    pub crowded: u32,
    /// Pairs of the front that were due or awake and were left for the next query, since the work allowed was done.
    pub postponed: u32,
    /// 1 if the front began anew: in the first query, after a jump, or when it was told to forget.
    pub restarted: u32,
}

impl TraversalCounters {
    /// What all this comes to, in units of [`crate::algebra::Work`].
    pub fn work(&self) -> u64 {
        let marches = WORK_MARCH * (u64::from(self.hull_tests) + u64::from(self.leaf_tests));
        u64::from(self.node_pairs) + marches + WORK_STEP * u64::from(self.march_steps)
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
            crowded,
            postponed,
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
        self.crowded += crowded;
        self.postponed += postponed;
        self.restarted += restarted;
    }
}

/// The working memory of traversals between one pair of bodies.
#[derive(Clone, Debug)]
pub struct Traversal {
    stack: Vec<NodePair>,
    coherence: Coherence,
    last_nearest: Option<[u32; 2]>,
}

#[derive(Clone, Copy, Debug)]
struct NodePair {
    a: u32,
    b: u32,
    /// Lower bound of the distance between the two.
    bound: f64,
}

impl Traversal {
    /// Memory for traversals that remember about `pairs` node pairs.
    pub fn new(a: Side<'_>, b: Side<'_>, pairs: usize) -> Self {
        // Depth-first, each visit leaves at most one sibling behind for every level of either tree.
        let depth = a.hierarchy.depth() + b.hierarchy.depth() + 2;
        Self { stack: Vec::with_capacity(2 * depth), coherence: Coherence::new(pairs), last_nearest: None }
    }

    /// Forgets the past; the next answers are found from cold starts.
    pub fn clear(&mut self) {
        self.coherence.clear();
        self.last_nearest = None;
    }

    /// Writes to `found` every leaf pair that overlaps or is nearer than `tolerance`; `pose_ba` places a's frame in b's.
    ///
    /// `found` is cleared first; of more pairs than it has room for it keeps the deepest, and the others are counted as dropped.
    pub fn within(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        tolerance: f64,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        let mut counters = TraversalCounters::default();
        found.clear();
        self.begin_tick();
        let roots = [a.hierarchy.root(), b.hierarchy.root()];
        self.below(a, b, pose_ba, tolerance, roots, found, &mut counters);
        counters.dropped = found.dropped();
        counters
    }

    /// What is remembered from now on is younger than what was before.
    pub(super) fn begin_tick(&mut self) {
        self.coherence.begin_tick();
    }

    /// Adds to `found` the leaf pairs below a pair of nodes that overlap or are nearer than `tolerance`.
    #[allow(clippy::too_many_arguments, reason = "the four of every query, and what it is about")]
    pub(super) fn below(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        tolerance: f64,
        nodes: [u32; 2],
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        self.stack.clear();
        self.stack.push(NodePair { a: nodes[0], b: nodes[1], bound: 0.0 });
        while let Some(pair) = self.stack.pop() {
            counters.node_pairs += 1;
            let (node_a, node_b) = (a.hierarchy.node(pair.a), b.hierarchy.node(pair.b));
            if bound_of(node_a, node_b, pose_ba, tolerance) > tolerance {
                continue;
            }
            if let (NodeKind::Leaf { piece: piece_a }, NodeKind::Leaf { piece: piece_b }) = (node_a.kind, node_b.kind) {
                let (answer, memory) = self.leaf(a, b, pair, pose_ba, counters);
                if is_contact(&answer, tolerance) {
                    let home = Home::Nodes(pair.a, pair.b);
                    found.push(LeafPair { piece_a, piece_b, home, proximity: answer.proximity, memory }, a, b, pose_ba);
                }
                continue;
            }
            // A sixth to a quarter of the time of a step is saved by this on a spoon in a cup and on scans of 30 000 triangles.
            if distance(&self.hull(a, b, pair, pose_ba, counters)) > tolerance {
                continue;
            }
            self.split(a, b, pair, node_a.sphere.radius > node_b.sphere.radius);
        }
    }

    /// The nearest leaf pair of all, or an overlapping one when there is any.
    pub fn nearest(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        counters: &mut TraversalCounters,
    ) -> Option<LeafPair> {
        let mut best: Option<LeafPair> = None;
        let mut upper = f64::INFINITY;
        self.stack.clear();
        self.stack.push(NodePair { a: a.hierarchy.root(), b: b.hierarchy.root(), bound: 0.0 });
        if let Some([a, b]) = self.last_nearest {
            self.stack.push(NodePair { a, b, bound: 0.0 });
        }
        while let Some(pair) = self.stack.pop() {
            if pair.bound >= upper {
                continue;
            }
            counters.node_pairs += 1;
            let (node_a, node_b) = (a.hierarchy.node(pair.a), b.hierarchy.node(pair.b));
            if let (NodeKind::Leaf { piece: piece_a }, NodeKind::Leaf { piece: piece_b }) = (node_a.kind, node_b.kind) {
                let (answer, memory) = self.leaf(a, b, pair, pose_ba, counters);
                let distance = distance(&answer);
                if distance < upper {
                    upper = distance;
                    let home = Home::Nodes(pair.a, pair.b);
                    best = Some(LeafPair { piece_a, piece_b, home, proximity: answer.proximity, memory });
                    self.last_nearest = Some([pair.a, pair.b]);
                }
                continue;
            }
            let answer = self.hull(a, b, pair, pose_ba, counters);
            if distance(&answer) >= upper {
                continue;
            }
            let split_a = self.side_to_split(a, b, pair, &answer);
            self.split(a, b, pair, split_a);
            self.order_last_two(a, b, pose_ba, upper);
        }
        best
    }

    /// Keeps where the depth walk of a pair of leaves ended.
    pub(super) fn remember_depth(&mut self, [a, b]: [u32; 2], normal: DVec3, hub: [u32; 2], facet: FeaturePair) {
        if let Some(memory) = self.coherence.recall(a, b) {
            self.coherence.remember(a, b, Memory { normal, hub, facet: Some(facet), ..memory });
        }
    }

    /// Keeps the features of the depth along a normal that both of a pair of leaves own.
    pub(super) fn remember_admissible(&mut self, [a, b]: [u32; 2], admissible: Option<FeaturePair>) {
        if let Some(memory) = self.coherence.recall(a, b) {
            self.coherence.remember(a, b, Memory { admissible, ..memory });
        }
    }

    fn leaf(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pair: NodePair,
        pose_ba: &Placement,
        counters: &mut TraversalCounters,
    ) -> (March, Option<Memory>) {
        counters.leaf_tests += 1;
        self.march(a, b, pair, pose_ba, counters)
    }

    fn hull(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pair: NodePair,
        pose_ba: &Placement,
        counters: &mut TraversalCounters,
    ) -> March {
        counters.hull_tests += 1;
        self.march(a, b, pair, pose_ba, counters).0
    }

    fn march(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pair: NodePair,
        pose_ba: &Placement,
        counters: &mut TraversalCounters,
    ) -> (March, Option<Memory>) {
        let (polytope_a, polytope_b) = (a.polytope(pair.a), b.polytope(pair.b));
        let memory = self.coherence.recall(pair.a, pair.b);
        let start = match memory {
            Some(memory) => memory.features,
            None => initial_features(polytope_a, polytope_b, pose_ba),
        };
        let answer = march(polytope_a, polytope_b, pose_ba, start);
        let features = answer.features;
        let new = Memory { features, normal: DVec3::ZERO, hub: [0; 2], facet: None, admissible: None };
        self.coherence.remember(pair.a, pair.b, memory.map_or(new, |memory| Memory { features, ..memory }));
        counters.march_steps += answer.steps;
        counters.march_fallbacks += u32::from(answer.stop != StopReason::Converged);
        (answer, memory)
    }

    fn split(&mut self, a: Side<'_>, b: Side<'_>, pair: NodePair, larger_is_a: bool) {
        let NodePair { a: node_a, b: node_b, bound } = pair;
        let (kind_a, kind_b) = (a.hierarchy.node(node_a).kind, b.hierarchy.node(node_b).kind);
        if let NodeKind::Inner { left, right } = kind_a
            && (larger_is_a || matches!(kind_b, NodeKind::Leaf { .. }))
        {
            self.stack.push(NodePair { a: right, b: node_b, bound });
            self.stack.push(NodePair { a: left, b: node_b, bound });
        } else if let NodeKind::Inner { left, right } = kind_b {
            self.stack.push(NodePair { a: node_a, b: right, bound });
            self.stack.push(NodePair { a: node_a, b: left, bound });
        }
    }

    /// \[EL01\]: split the side whose closest feature lies in empty space; the larger one when both or none do.
    fn side_to_split(&self, a: Side<'_>, b: Side<'_>, pair: NodePair, answer: &March) -> bool {
        let free_a = is_free(a.polytope(pair.a), answer.features.a);
        let free_b = is_free(b.polytope(pair.b), answer.features.b);
        if free_a != free_b {
            return free_a;
        }
        a.hierarchy.node(pair.a).sphere.radius > b.hierarchy.node(pair.b).sphere.radius
    }

    /// Bounds the two pairs pushed last and puts the nearer one on top.
    fn order_last_two(&mut self, a: Side<'_>, b: Side<'_>, pose_ba: &Placement, upper: f64) {
        let n = self.stack.len();
        if n < 2 {
            return;
        }
        for pair in &mut self.stack[n - 2..] {
            let bound = bound_of(a.hierarchy.node(pair.a), b.hierarchy.node(pair.b), pose_ba, upper);
            pair.bound = pair.bound.max(bound);
        }
        if self.stack[n - 1].bound > self.stack[n - 2].bound {
            self.stack.swap(n - 1, n - 2);
        }
    }
}

/// A lower bound of the distance of two nodes: by their spheres, and by their boxes where that is not `enough`.
pub(super) fn bound_of(a: &Node, b: &Node, pose_ba: &Placement, enough: f64) -> f64 {
    let gap = sphere_gap(&a.sphere, &b.sphere, pose_ba);
    if gap > enough { gap } else { gap.max(box_gap(&a.oriented_box, &b.oriented_box, pose_ba, enough)) }
}

/// Zero for what overlaps.
pub(super) fn distance(answer: &March) -> f64 {
    match answer.proximity {
        Proximity::Disjoint(Closest { distance, .. }) => distance,
        Proximity::Overlapping(_) => 0.0,
    }
}

/// True if the two overlap or are nearer than the tolerance.
pub(super) fn is_contact(answer: &March, tolerance: f64) -> bool {
    matches!(answer.proximity, Proximity::Overlapping(_)) || distance(answer) < tolerance
}

fn is_free(polytope: &Polytope, feature: Feature) -> bool {
    match feature {
        Feature::Vertex(_) => false,
        Feature::Edge(e) => polytope.edge_provenance(e) == Provenance::Virtual,
        Feature::Face(f) => polytope.face_provenance(f) == Provenance::Virtual,
    }
}
