//! The input of the search for near pairs of pieces: two bodies.

use super::bounds::{box_gap, sphere_gap};
use crate::algebra::Placement;
use crate::body::{Hierarchy, NodeKind, Polytope};

/// One body in a search for near pairs: a hierarchy over convex pieces.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The tree.
    pub hierarchy: &'a Hierarchy,
    /// The pieces at its leaves.
    pub pieces: &'a [Polytope],
}

impl<'a> Side<'a> {
    #[inline]
    pub(super) fn polytope(&self, node: u32) -> &'a Polytope {
        self.hierarchy.polytope(node, self.pieces)
    }
}

/// Two bodies at a pose, and the limits of the search for near pairs of pieces.
#[derive(Clone, Copy)]
pub struct PlacedPair<'a> {
    /// The body that is placed.
    pub a: Side<'a>,
    /// The body in whose frame the results are.
    pub b: Side<'a>,
    /// Places a's frame in b's.
    pub pose_ba: &'a Placement,
    /// Model units: pairs that overlap or are nearer are found.
    pub tolerance: f64,
    /// Model units: only pairs with a piece thinner than this are examined.
    pub(crate) thinner_than: f64,
}

impl<'a> PlacedPair<'a> {
    /// All pairs nearer than `tolerance`.
    pub fn new(a: Side<'a>, b: Side<'a>, pose_ba: &'a Placement, tolerance: f64) -> Self {
        Self { a, b, pose_ba, tolerance, thinner_than: f64::INFINITY }
    }

    /// Returns true if pairs whose thinnest piece has this thickness (model units) are examined.
    #[inline]
    pub(super) fn wants(&self, thickness: f32) -> bool {
        self.thinner_than == f64::INFINITY || f64::from(thickness) < self.thinner_than
    }

    /// A lower bound of the distance of two nodes: by their spheres, and by their boxes if the
    /// bound by spheres is not above `enough`.
    pub(super) fn bound(&self, nodes: [u32; 2], enough: f64) -> f64 {
        let (a, b) = (self.a.hierarchy.node(nodes[0]), self.b.hierarchy.node(nodes[1]));
        let gap = sphere_gap(&a.sphere, &b.sphere, self.pose_ba);
        if gap > enough { gap } else { gap.max(box_gap(&a.oriented_box, &b.oriented_box, self.pose_ba, enough)) }
    }

    /// The hulls of two nodes.
    pub(super) fn polytopes(&self, nodes: [u32; 2]) -> (&'a Polytope, &'a Polytope) {
        (self.a.polytope(nodes[0]), self.b.polytope(nodes[1]))
    }

    /// The two halves of a pair of nodes, of which the larger that can be split is; `None` for
    /// leaves.
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
