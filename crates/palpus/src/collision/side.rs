//! The input of the search for near pairs of pieces.

use glam::DVec3;

use super::bounds::{box_gap, sphere_gap};
use crate::algebra::Placement;
use crate::body::{Hierarchy, NodeKind, Polytope};

/// One body in a search for near pairs: a hierarchy over convex pieces.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The tree of pieces.
    pub hierarchy: &'a Hierarchy,
    /// The pieces at its leaves.
    pub pieces: &'a [Polytope],
}

impl<'a> Side<'a> {
    #[inline]
    pub(super) fn polytope(&self, node: u32) -> &'a Polytope {
        self.hierarchy.polytope(node, self.pieces)
    }

    /// Returns a lower bound of the heights of a node's vertices above the node's middle, along
    /// `direction`, model units times the length of `direction`.
    #[inline]
    pub(super) fn lowest(&self, node: u32, direction: DVec3) -> f64 {
        self.hierarchy.lowest(node, self.pieces, direction)
    }
}

/// Two bodies at a pose, and the limits of the search for near pairs of pieces.
#[derive(Clone, Copy)]
pub struct PlacedPair<'a> {
    /// The body whose frame `pose_ba` places.
    pub a: Side<'a>,
    /// The body in whose frame the results are.
    pub b: Side<'a>,
    /// Places a's frame in b's.
    pub pose_ba: &'a Placement,
    /// Pairs that overlap, or are nearer than this, are found; model units.
    pub tolerance: f64,
    /// Pairs nearer than this may press; model units. If the work is limited, pairs that may soon
    /// be so near are bounded first.
    pub(crate) offset: f64,
    /// Only pairs with a piece thinner than this are examined; model units.
    pub(crate) thinner_than: f64,
}

impl<'a> PlacedPair<'a> {
    /// Returns a search for all pairs nearer than `tolerance` (model units).
    pub fn new(a: Side<'a>, b: Side<'a>, pose_ba: &'a Placement, tolerance: f64) -> Self {
        Self { a, b, pose_ba, tolerance, offset: tolerance, thinner_than: f64::INFINITY }
    }

    /// Returns true if pairs whose thinnest piece has this thickness (model units) are examined.
    #[inline]
    pub(super) fn wants(&self, thickness: f32) -> bool {
        self.is_of_all() || f64::from(thickness) < self.thinner_than
    }

    /// Returns true if all pairs are examined.
    pub(super) fn is_of_all(&self) -> bool {
        self.thinner_than == f64::INFINITY
    }

    /// Returns a lower bound of the distance of two nodes. The bound is computed from their
    /// spheres, and from their boxes if the spheres' bound does not exceed `enough`.
    pub(super) fn bound(&self, nodes: [u32; 2], enough: f64) -> f64 {
        let (a, b) = (self.a.hierarchy.node(nodes[0]), self.b.hierarchy.node(nodes[1]));
        let gap = sphere_gap(&a.sphere, &b.sphere, self.pose_ba);
        if gap > enough { gap } else { gap.max(box_gap(&a.oriented_box, &b.oriented_box, self.pose_ba, enough).gap) }
    }

    /// Returns the hulls of two nodes.
    pub(super) fn polytopes(&self, nodes: [u32; 2]) -> (&'a Polytope, &'a Polytope) {
        (self.a.polytope(nodes[0]), self.b.polytope(nodes[1]))
    }

    /// Splits the larger node of a pair, or the other node if the larger one is a leaf. Returns the
    /// two new pairs; `None` if both nodes are leaves.
    pub(super) fn halves(&self, nodes: [u32; 2]) -> Option<[[u32; 2]; 2]> {
        let (node_a, node_b) = (self.a.hierarchy.node(nodes[0]), self.b.hierarchy.node(nodes[1]));
        match (node_a.kind, node_b.kind) {
            (NodeKind::Inner { left, right }, kind_b)
                if node_a.sphere.radius > node_b.sphere.radius || matches!(kind_b, NodeKind::Leaf { .. }) =>
            {
                Some([[left, nodes[1]], [right, nodes[1]]])
            }
            (_, NodeKind::Inner { left, right }) => Some([[nodes[0], left], [nodes[0], right]]),
            _ => None,
        }
    }
}
