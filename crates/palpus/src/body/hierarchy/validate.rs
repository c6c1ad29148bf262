//! Checks the invariants of the tree.
//!
//! 1. The nodes form one tree: children come before their parent, every node except the root has
//!    one parent, and every piece is in one leaf.
//! 2. Each inner hull contains the hulls of its children, up to the merge distance.
//! 3. The sphere and the box of a node contain every vertex of the pieces below it.
//!
//! Steps 2 and 3 check a small tree completely, and evenly spaced samples of a large tree.

use glam::DVec3;

use super::{Hierarchy, Node, NodeKind};
use crate::algebra::Plane;
use crate::algebra::tolerance::{VALIDATED_HEIGHTS, VALIDATED_PIECES, WELL_FORMED_ROUNDING};
use crate::body::Polytope;

/// A broken invariant of a hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyFault {
    /// A child does not come before its parent, a node has two parents, or the tree has several
    /// roots.
    #[error("node {0} is not the child of exactly one later node")]
    Parent(u32),
    /// A piece is in no leaf or in several, or a leaf names a piece that does not exist.
    #[error("piece {0} is not in exactly one leaf")]
    Piece(u32),
    /// The hull index of an inner node is wrong.
    #[error("the n-th inner node, node {0}, does not refer to the n-th hull")]
    Hull(u32),
    /// [`Hierarchy::depth`] is not the number of nodes on the longest path from the root to a leaf.
    #[error("the depth is {found}, but the tree states {said}")]
    Depth {
        /// The depth that was counted.
        found: usize,
        /// The depth that the tree states.
        said: usize,
    },
    /// A vertex of a child's hull lies above a face of the node's hull.
    #[error("the hull of node {node} does not contain the hull of its child {child}: a vertex is {height:e} outside")]
    Enclosure {
        /// Index of the node.
        node: u32,
        /// Index of the child.
        child: u32,
        /// Height of the vertex above the plane of a face of the node's hull, in model units.
        height: f64,
    },
    /// A vertex of a piece is outside the sphere or the box of one of the nodes above it.
    #[error("the {bound} of node {node} does not contain piece {piece}")]
    Bound {
        /// Index of the node.
        node: u32,
        /// Index of the piece.
        piece: u32,
        /// `"sphere"` or `"box"`.
        bound: &'static str,
    },
}

impl Hierarchy {
    /// Checks the invariants of the tree. `pieces` and `coplanar` must be the arguments of
    /// [`Self::build`].
    ///
    /// # Errors
    /// Returns the first broken invariant, with its node or piece.
    pub fn validate(&self, pieces: &[Polytope], coplanar: f64) -> Result<(), HierarchyFault> {
        let parents = self.validate_tree(pieces.len())?;
        for node in 0..self.nodes.len() as u32 {
            if let NodeKind::Inner { left, right } = self.node(node).kind {
                self.validate_enclosure(node, left, pieces, coplanar)?;
                self.validate_enclosure(node, right, pieces, coplanar)?;
            }
        }
        let step = self.nodes.len().div_ceil(VALIDATED_PIECES);
        (0..self.nodes.len() as u32).step_by(step).try_for_each(|leaf| self.validate_bounds(leaf, pieces, &parents))
    }

    /// Does step 1. Returns the parent of each node; the root counts as its own parent.
    fn validate_tree(&self, pieces: usize) -> Result<Vec<u32>, HierarchyFault> {
        let mut parents: Vec<Option<u32>> = vec![None; self.nodes.len()];
        let mut depths = Vec::with_capacity(self.nodes.len());
        let mut in_leaf = vec![false; pieces];
        let mut inner = 0;
        for (k, node) in self.nodes.iter().enumerate() {
            let depth = match node.kind {
                NodeKind::Leaf { piece } => {
                    let seen = in_leaf.get_mut(piece as usize).ok_or(HierarchyFault::Piece(piece))?;
                    if std::mem::replace(seen, true) {
                        return Err(HierarchyFault::Piece(piece));
                    }
                    1
                }
                NodeKind::Inner { left, right } => {
                    for child in [left, right] {
                        let adopted = child as usize >= k || parents[child as usize].replace(k as u32).is_some();
                        if adopted {
                            return Err(HierarchyFault::Parent(child));
                        }
                    }
                    if node.hull != inner || node.hull as usize >= self.hulls.len() {
                        return Err(HierarchyFault::Hull(k as u32));
                    }
                    inner += 1;
                    1 + usize::max(depths[left as usize], depths[right as usize])
                }
            };
            depths.push(depth);
        }
        if let Some(piece) = in_leaf.iter().position(|&seen| !seen) {
            return Err(HierarchyFault::Piece(piece as u32));
        }
        let root = self.root();
        if let Some(orphan) = parents.iter().position(Option::is_none).filter(|&k| k as u32 != root) {
            return Err(HierarchyFault::Parent(orphan as u32));
        }
        match depths.last() {
            Some(&found) if found != self.depth => Err(HierarchyFault::Depth { found, said: self.depth }),
            _ => Ok(parents.into_iter().map(|parent| parent.unwrap_or(root)).collect()),
        }
    }

    /// Does step 2 for one child.
    fn validate_enclosure(
        &self,
        node: u32,
        child: u32,
        pieces: &[Polytope],
        coplanar: f64,
    ) -> Result<(), HierarchyFault> {
        let (hull, inside) = (self.polytope(node, pieces), self.polytope(child, pieces));
        let (planes, vertices) = (hull.planes(), inside.vertices());
        // Checks as many vertices as the limit allows, at least one, against all planes.
        let step = (planes.len() * vertices.len()).div_ceil(VALIDATED_HEIGHTS);
        let size = vertices.iter().fold(0.0, |size: f64, v| size.max(v.abs().max_element()));
        let limit = coplanar + WELL_FORMED_ROUNDING * size;
        match vertices.iter().step_by(step).map(|&v| highest(planes, v)).find(|&height| height > limit) {
            Some(height) => Err(HierarchyFault::Enclosure { node, child, height }),
            None => Ok(()),
        }
    }

    /// Does step 3 for one leaf and all nodes above it. Does nothing if `leaf` is an inner node.
    fn validate_bounds(&self, leaf: u32, pieces: &[Polytope], parents: &[u32]) -> Result<(), HierarchyFault> {
        let NodeKind::Leaf { piece } = self.node(leaf).kind else { return Ok(()) };
        let vertices = pieces[piece as usize].vertices();
        let mut node = leaf;
        loop {
            let Node { sphere, oriented_box, .. } = self.node(node);
            let in_sphere = |v: &DVec3| v.distance(sphere.center) <= sphere.radius;
            let to_box = oriented_box.axes.transpose();
            let in_box = |v: &DVec3| (to_box * (*v - oriented_box.center)).abs().cmple(oriented_box.half).all();
            if !vertices.iter().all(in_sphere) {
                return Err(HierarchyFault::Bound { node, piece, bound: "sphere" });
            }
            if !vertices.iter().all(in_box) {
                return Err(HierarchyFault::Bound { node, piece, bound: "box" });
            }
            if parents[node as usize] == node {
                return Ok(());
            }
            node = parents[node as usize];
        }
    }
}

fn highest(planes: &[Plane], point: DVec3) -> f64 {
    planes.iter().map(|plane| plane.height(point)).fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::body::convex_hull;

    const SEED: u64 = 0x7ee_fa17;
    const COPLANAR: f64 = 1e-10;

    fn random_pieces(random: &mut Random, count: usize) -> Vec<Polytope> {
        let cloud = |random: &mut Random| {
            let at = random.direction() * 10.0;
            let points: Vec<DVec3> = (0..8).map(|_| at + random.direction()).collect();
            convex_hull(&points, COPLANAR).unwrap().into_polytope().unwrap().0
        };
        (0..count).map(|_| cloud(random)).collect()
    }

    #[test]
    fn each_broken_invariant_is_named() {
        let mut random = Random::new(SEED);
        for case in 0..20 {
            let count = 3 + random.below(30);
            let pieces = random_pieces(&mut random, count);
            let whole = Hierarchy::build(&pieces, COPLANAR).unwrap();
            assert_eq!(whole.validate(&pieces, COPLANAR), Ok(()), "seed {SEED:#x}, case {case}");
            let inner = |k: usize| matches!(whole.nodes[k].kind, NodeKind::Inner { .. });
            let pick = |random: &mut Random, wanted: bool| {
                let fits: Vec<usize> = (0..whole.nodes.len()).filter(|&k| inner(k) == wanted).collect();
                fits[random.below(fits.len())]
            };
            let (leaf, node) = (pick(&mut random, false), pick(&mut random, true));
            let fault = |change: &dyn Fn(&mut Hierarchy)| {
                let mut broken = whole.clone();
                change(&mut broken);
                broken.validate(&pieces, COPLANAR).expect_err("validate accepts a broken tree")
            };
            let what = format!("seed {SEED:#x}, case {case}, leaf {leaf}, node {node}");

            let twice = fault(&|tree| {
                let NodeKind::Leaf { piece } = tree.nodes[leaf].kind else { unreachable!() };
                tree.nodes[leaf].kind = NodeKind::Leaf { piece: (piece + 1) % pieces.len() as u32 };
            });
            assert!(matches!(twice, HierarchyFault::Piece(_)), "{what}: {twice}");
            let shared = fault(&|tree| {
                let NodeKind::Inner { left, .. } = tree.nodes[node].kind else { unreachable!() };
                tree.nodes[node].kind = NodeKind::Inner { left, right: left };
            });
            assert!(matches!(shared, HierarchyFault::Parent(_)), "{what}: {shared}");
            let hull = fault(&|tree| tree.nodes[node].hull += 1);
            assert_eq!(hull, HierarchyFault::Hull(node as u32), "{what}");
            let depth = fault(&|tree| tree.depth += 1);
            assert!(matches!(depth, HierarchyFault::Depth { .. }), "{what}: {depth}");
            let sphere = fault(&|tree| tree.nodes[leaf].sphere.radius *= 0.9);
            assert!(matches!(sphere, HierarchyFault::Bound { bound: "sphere", .. }), "{what}: {sphere}");
            let boxed = fault(&|tree| tree.nodes[node].oriented_box.half.y *= 0.9);
            assert!(matches!(boxed, HierarchyFault::Bound { bound: "box", .. }), "{what}: {boxed}");
            let enclosure = fault(&|tree| {
                let hull = tree.nodes[node].hull as usize;
                let points: Vec<DVec3> = tree.hulls[hull].vertices().iter().map(|v| *v * 0.99).collect();
                tree.hulls[hull] = convex_hull(&points, COPLANAR).unwrap().into_polytope().unwrap().0;
            });
            assert!(matches!(enclosure, HierarchyFault::Enclosure { .. }), "{what}: {enclosure}");
        }
    }
}
