//! A body as the search for near pairs sees it.

use super::bounds::{box_gap, sphere_gap};
use crate::algebra::Placement;
use crate::body::{Hierarchy, Node, NodeKind, Polytope};

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

/// A lower bound of the distance of two nodes: by their spheres, and by their boxes where that is not `enough`.
pub(super) fn bound_of(a: &Node, b: &Node, pose_ba: &Placement, enough: f64) -> f64 {
    let gap = sphere_gap(&a.sphere, &b.sphere, pose_ba);
    if gap > enough { gap } else { gap.max(box_gap(&a.oriented_box, &b.oriented_box, pose_ba, enough)) }
}

/// The two halves of a pair of nodes, of which the larger that can be split is; `None` for leaves.
pub(super) fn halves(a: Side<'_>, b: Side<'_>, nodes: [u32; 2]) -> Option<[[u32; 2]; 2]> {
    let (node_a, node_b) = (a.hierarchy.node(nodes[0]), b.hierarchy.node(nodes[1]));
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
