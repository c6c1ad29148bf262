//! A bounding-volume tree over the triangles of a mesh.
//!
//! The tree is a binary tree of axis-aligned boxes in flat arrays. Each node is split along its
//! longest axis, at the median of the triangles' centroids. Therefore the depth is logarithmic in
//! the number of triangles. The first child of a node directly follows the node. The corners of the
//! triangles are copied in leaf order, so a query reads no other data. Queries do not allocate.
//!
//! * Overlap: finds the triangles whose boxes overlap a given box, and the pairs of triangles whose
//!   boxes overlap each other.
//! * Nearest point: branch and bound, with the nearer child first.
//! * Rays: the test is watertight, so a ray cannot pass between two triangles with a common edge
//!   (S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, 2013).
//! * Inside test and winding number: the module `winding` describes them.

mod nearest;
mod ray;
#[cfg(test)]
mod tests;
mod winding;

use std::ops::ControlFlow;

use glam::DVec3;

use crate::algebra::{Plane, tolerance};
use crate::body::Aabb;
pub use nearest::SurfacePoint;
pub use ray::RayHit;
use winding::Dipole;

/// A node of the tree with its bounding box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) bounds: Aabb,
    /// Position of the first triangle below, in leaf order.
    pub(crate) first: u32,
    /// Number of triangles below.
    pub(crate) count: u32,
    /// Index of the second child; 0 for a leaf.
    pub(crate) second: u32,
}

impl Node {
    #[inline]
    pub(crate) fn is_leaf(&self) -> bool {
        self.second == 0
    }

    /// Returns the positions of the triangles below, in leaf order.
    #[inline]
    pub(crate) fn slots(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// A bounding-volume tree over triangles, for overlap, nearest-point, ray and inside queries.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    pub(crate) nodes: Vec<Node>,
    /// Far-field approximation of each node.
    dipoles: Vec<Dipole>,
    /// Corners of the triangles, in leaf order.
    pub(crate) corners: Vec<[DVec3; 3]>,
    /// Indices of the triangles in the mesh, in leaf order.
    pub(crate) ids: Vec<u32>,
    /// True if the triangles have no boundary and agree on which side is outside.
    pub(in crate::body) closed: bool,
}

impl TriangleTree {
    /// Builds the tree over the triangles with the indices `ids`. `closed` says whether each edge
    /// is used equally often in both directions.
    pub(crate) fn over(vertices: &[DVec3], triangles: &[[u32; 3]], mut ids: Vec<u32>, closed: bool) -> Self {
        let corners_of = |id: u32| triangles[id as usize].map(|v| vertices[v as usize]);
        let mut items: Vec<(DVec3, u32)> =
            ids.iter().map(|&id| (corners_of(id).iter().sum::<DVec3>() / 3.0, id)).collect();
        let (nodes, corners) = (Vec::with_capacity(ids.len()), Vec::with_capacity(ids.len()));
        let mut tree = Self { nodes, dipoles: Vec::new(), corners, ids: Vec::new(), closed };
        if !items.is_empty() {
            tree.grow(&corners_of, &mut items);
        }
        ids.clear();
        ids.extend(items.iter().map(|&(_, id)| id));
        tree.ids = ids;
        tree.dipoles = Dipole::of_nodes(&tree.nodes, &tree.corners);
        tree
    }

    /// Appends the subtree over `items` (centroid and index of each triangle) and returns its box.
    /// Sorts `items` into leaf order.
    fn grow(&mut self, corners_of: &impl Fn(u32) -> [DVec3; 3], items: &mut [(DVec3, u32)]) -> Aabb {
        let index = self.nodes.len();
        let (first, count) = (self.corners.len() as u32, items.len() as u32);
        self.nodes.push(Node { bounds: Aabb::EMPTY, first, count, second: 0 });
        let bounds = if items.len() <= tolerance::LEAF_TRIANGLES {
            self.corners.extend(items.iter().map(|&(_, id)| corners_of(id)));
            Aabb::around(items.iter().flat_map(|&(_, id)| corners_of(id)))
        } else {
            let spread = Aabb::around(items.iter().map(|&(middle, _)| middle));
            let axis = (spread.max - spread.min).max_position();
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |i, j| i.0[axis].total_cmp(&j.0[axis]).then(i.1.cmp(&j.1)));
            let (low, high) = items.split_at_mut(half);
            let bounds = self.grow(corners_of, low);
            self.nodes[index].second = self.nodes.len() as u32;
            bounds.union(&self.grow(corners_of, high))
        };
        self.nodes[index].bounds = bounds;
        bounds
    }

    /// Returns the box around all triangles; [`Aabb::EMPTY`] for a tree without triangles.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Descends into all nodes whose box `enter` accepts. Calls `visit` with the position (in leaf
    /// order) of each triangle in the visited leaves, until `visit` breaks.
    pub(crate) fn descend(
        &self,
        mut enter: impl FnMut(&Aabb) -> bool,
        mut visit: impl FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut stack = Stack::from_root(&self.nodes);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if !enter(&node.bounds) {
                continue;
            }
            if node.is_leaf() {
                node.slots().try_for_each(&mut visit)?;
            } else {
                stack.push(node.second);
                stack.push(index + 1);
            }
        }
        ControlFlow::Continue(())
    }

    /// Calls `visit` with the index and the corners of each triangle whose bounding box overlaps
    /// `query`, until `visit` breaks.
    pub fn visit_overlapping(
        &self,
        query: &Aabb,
        mut visit: impl FnMut(u32, &[DVec3; 3]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.descend(
            |bounds| bounds.overlaps(query),
            |slot| {
                let corners = &self.corners[slot];
                if Aabb::around(*corners).overlaps(query) {
                    visit(self.ids[slot], corners)
                } else {
                    ControlFlow::Continue(())
                }
            },
        )
    }

    /// Returns true if `is_one` accepts a triangle near `query`. Calls `is_one` for the
    /// triangles of each leaf whose box meets two conditions. The box overlaps `query`, and a
    /// part of the box lies deeper than `depth` below each plane of `planes`.
    pub(in crate::body) fn any_below(
        &self,
        query: &Aabb,
        planes: &[Plane],
        depth: f64,
        mut is_one: impl FnMut(u32, &[DVec3; 3]) -> bool,
    ) -> bool {
        let reaches_below = |bounds: &Aabb| {
            let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
            planes.iter().all(|plane| plane.height(middle) - plane.normal.abs().dot(half) < -depth)
        };
        let visit = |slot: usize| match is_one(self.ids[slot], &self.corners[slot]) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        self.descend(|bounds| bounds.overlaps(query) && reaches_below(bounds), visit).is_break()
    }

    /// Calls `visit` once with each pair of different triangles whose boxes overlap, until `visit`
    /// breaks.
    pub fn visit_own_pairs(
        &self,
        mut visit: impl FnMut((u32, &[DVec3; 3]), (u32, &[DVec3; 3])) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if self.nodes.is_empty() { ControlFlow::Continue(()) } else { self.pairs_below(0, 0, &mut visit) }
    }

    /// Visits the pairs of one triangle below node `i` and a different triangle below node `j`.
    /// Either `i` equals `j`, or the triangles of `i` come first in leaf order.
    fn pairs_below<'a>(
        &'a self,
        i: usize,
        j: usize,
        visit: &mut impl FnMut((u32, &'a [DVec3; 3]), (u32, &'a [DVec3; 3])) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (first, second) = (&self.nodes[i], &self.nodes[j]);
        if !first.bounds.overlaps(&second.bounds) {
            return ControlFlow::Continue(());
        }
        if first.is_leaf() && second.is_leaf() {
            for slot in first.slots() {
                let bounds = Aabb::around(self.corners[slot]);
                for other in second.slots().filter(|&other| other > slot) {
                    if Aabb::around(self.corners[other]).overlaps(&bounds) {
                        visit((self.ids[slot], &self.corners[slot]), (self.ids[other], &self.corners[other]))?;
                    }
                }
            }
            return ControlFlow::Continue(());
        }
        if i == j {
            let (low, high) = (i + 1, first.second as usize);
            self.pairs_below(low, low, visit)?;
            self.pairs_below(low, high, visit)?;
            return self.pairs_below(high, high, visit);
        }
        if second.is_leaf() || (!first.is_leaf() && first.count >= second.count) {
            self.pairs_below(i + 1, j, visit)?;
            self.pairs_below(first.second as usize, j, visit)
        } else {
            self.pairs_below(i, j + 1, visit)?;
            self.pairs_below(i, second.second as usize, visit)
        }
    }
}

/// The stack of nodes that a traversal has not visited yet. The stack cannot overflow, because the
/// depth of the tree is at most 33.
pub(in crate::body) struct Stack {
    nodes: [u32; 64],
    len: usize,
}

impl Stack {
    /// Creates a stack with the root (node 0), or an empty stack if there are no nodes.
    #[inline]
    pub(in crate::body) fn from_root(nodes: &[Node]) -> Self {
        Self { nodes: [0; 64], len: usize::from(!nodes.is_empty()) }
    }

    #[inline]
    pub(in crate::body) fn push(&mut self, node: u32) {
        self.nodes[self.len] = node;
        self.len += 1;
    }

    #[inline]
    pub(in crate::body) fn pop(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        Some(self.nodes[self.len])
    }
}
