//! One of the two bodies of a query.

use crate::body::{Hierarchy, Polytope};

/// One side of a traversal: a hierarchy over convex pieces.
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
