//! The binary tree of hulls over the pieces \[K02 §3.2, EL01\].
//!
//! 1. From the root down, sort the pieces along the direction in which their centroids spread most.
//!    Split where the sum of surface times number over both parts is least. A leaf is one piece.
//! 2. From the leaves up, each node's volume is the convex hull of its children's hull vertices.
//! 3. A face of an inner hull is *free* (virtual: it spans empty space) unless it coincides with an
//!    original face of a piece.
//! 4. Each node also has a box and a ball that hold its hull, for quicker tests.
//!
//! With several workers, the tree's top is split level by level, each subtree below it is built by
//! one worker, and the top's hulls are then built level by level (`build_with`). The nodes' order
//! is the same as with one worker: left subtree, right subtree, node.
//!
//! Neither part of a split is ever smaller than a fixed share, which keeps the tree's depth
//! logarithmic whatever the model, so that a traversal's stack has a bound. Node pairs that a
//! traversal visits, measured on contacts of the real meshes, by the rule of the split: median 1,
//! midpoint 0.92, least surface times number 0.83.
//!
//! Merging may shave vertices off a hull by the merge distance, a little at each level. The balls
//! and boxes nevertheless hold every vertex of every piece, so that rejecting a pair by them is
//! always correct.

pub(super) mod bounds;
mod build;
mod validate;

use super::{HullError, Polytope};
use bounds::{OrientedBox, Sphere};

pub use validate::HierarchyFault;

/// Content of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeKind {
    /// One convex piece.
    Leaf {
        /// Its index among the body's pieces.
        piece: u32,
    },
    /// The pieces of two nodes; both have smaller indices than this one.
    Inner {
        /// First child.
        left: u32,
        /// Second child.
        right: u32,
    },
}

/// A node and its bounds.
#[derive(Clone, Debug)]
pub struct Node {
    /// Leaf or inner.
    pub kind: NodeKind,
    /// Holds every vertex of the node's pieces.
    pub sphere: Sphere,
    /// Holds every vertex of the node's pieces.
    pub oriented_box: OrientedBox,
    /// Index of an inner node's hull.
    hull: u32,
}

/// The tree; its root is the last node.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    hulls: Vec<Polytope>,
    depth: usize,
}

/// Why a tree over the pieces cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HierarchyError {
    /// There are no pieces.
    #[error("a hierarchy needs at least one piece")]
    Empty,
    /// The hull of a node could not be built.
    #[error("the hull over {pieces} pieces could not be built")]
    Hull {
        /// Pieces below the node.
        pieces: usize,
        /// The fault of the hull.
        #[source]
        source: HullError,
    },
}

impl Hierarchy {
    /// Makes a tree from its nodes, children before parents, and the hulls of its inner nodes in
    /// the nodes' order; `None` unless they form one tree with each of the `pieces` in exactly one
    /// leaf. The caller ensures that each volume holds its descendants.
    pub fn from_parts(
        nodes: impl IntoIterator<Item = (NodeKind, Sphere, OrientedBox)>,
        hulls: Vec<Polytope>,
        pieces: usize,
    ) -> Option<Self> {
        let mut free_pieces = vec![true; pieces];
        let count = (2 * pieces).checked_sub(1)?;
        let mut depths: Vec<usize> = Vec::with_capacity(count);
        // Nodes that have no parent yet.
        let mut free_nodes = vec![true; count];
        let mut answer = Vec::with_capacity(count);
        let mut inner = 0;
        for (k, (kind, sphere, oriented_box)) in nodes.into_iter().take(count + 1).enumerate() {
            let (depth, hull) = match kind {
                NodeKind::Leaf { piece } => {
                    std::mem::take(free_pieces.get_mut(piece as usize)?).then_some((1, u32::MAX))?
                }
                NodeKind::Inner { left, right } => {
                    let mut adopt = |child: u32| {
                        let below = (child as usize) < k && std::mem::take(&mut free_nodes[child as usize]);
                        below.then(|| depths[child as usize])
                    };
                    let depth = 1 + adopt(left)?.max(adopt(right)?);
                    inner += 1;
                    (depth, inner - 1)
                }
            };
            depths.push(depth);
            answer.push(Node { kind, sphere, oriented_box, hull });
        }
        let one_root = free_nodes.iter().rposition(|&free| free) == free_nodes.iter().position(|&free| free);
        let depth = *depths.last()?;
        let sound = one_root && answer.len() == count && inner as usize == hulls.len() && !free_pieces.contains(&true);
        sound.then_some(Self { nodes: answer, hulls, depth })
    }

    /// The hulls of the inner nodes, in the nodes' order.
    pub fn hulls(&self) -> &[Polytope] {
        &self.hulls
    }

    /// Index of the root.
    pub fn root(&self) -> u32 {
        self.nodes.len() as u32 - 1
    }

    /// Node `node`.
    #[inline]
    pub fn node(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// All nodes, children before parents.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Nodes on the longest way from the root to a leaf.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// The node's volume: the piece itself at a leaf, else the hull over the node's pieces;
    /// `pieces` are those of [`Self::build`].
    #[inline]
    pub fn polytope<'a>(&'a self, node: u32, pieces: &'a [Polytope]) -> &'a Polytope {
        let node = self.node(node);
        match node.kind {
            NodeKind::Leaf { piece } => &pieces[piece as usize],
            NodeKind::Inner { .. } => &self.hulls[node.hull as usize],
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::algebra::Random;
    use crate::body::{Provenance, convex_hull};

    const SEED: u64 = 0x41e2_a2c4;

    fn random_pieces(count: usize) -> Vec<Polytope> {
        let mut random = Random::new(SEED);
        let mut vector = move || 0.5 * (random.vector() + 1.0);
        (0..count)
            .map(|_| {
                let at = vector() * 10.0;
                let points: Vec<DVec3> = (0..7).map(|_| at + vector()).collect();
                convex_hull(&points, 1e-12).unwrap().into_polytope().unwrap().0
            })
            .collect()
    }

    #[test]
    fn every_piece_is_in_one_leaf_and_in_all_volumes_above_it() {
        let pieces = random_pieces(41);
        let tree = Hierarchy::build(&pieces, 1e-10).unwrap();
        assert_eq!(tree.nodes().len(), 2 * pieces.len() - 1);
        assert!(tree.depth() <= 10, "seed {SEED:#x}: depth {}", tree.depth());
        let mut seen = vec![0; pieces.len()];
        let mut stack = vec![(tree.root(), Vec::new())];
        while let Some((node, mut above)) = stack.pop() {
            above.push(node);
            match tree.node(node).kind {
                NodeKind::Inner { left, right } => stack.extend([(left, above.clone()), (right, above)]),
                NodeKind::Leaf { piece } => {
                    seen[piece as usize] += 1;
                    for &p in pieces[piece as usize].vertices() {
                        above.iter().for_each(|&node| assert_holds(&tree, node, &pieces, p));
                    }
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1), "seed {SEED:#x}");
    }

    fn assert_holds(tree: &Hierarchy, node: u32, pieces: &[Polytope], p: DVec3) {
        let Node { sphere, oriented_box, .. } = tree.node(node);
        assert!(p.distance(sphere.center) <= sphere.radius, "seed {SEED:#x}");
        let local = oriented_box.axes.transpose() * (p - oriented_box.center);
        assert!(local.abs().cmple(oriented_box.half).all(), "seed {SEED:#x}");
        let highest = tree.polytope(node, pieces).planes().iter().map(|plane| plane.height(p)).fold(f64::MIN, f64::max);
        assert!(highest < 2e-9, "seed {SEED:#x}: {highest} outside");
    }

    #[test]
    fn coplanar_plates_make_a_plate() {
        let plate = |x: f64| {
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)].map(|(u, v)| DVec3::new(x + u, v, 0.0));
            Polytope::from_polygon(corners.to_vec(), DVec3::Z, Provenance::Original).unwrap()
        };
        let pieces = [plate(0.0), plate(3.0)];
        let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
        assert!(tree.polytope(tree.root(), &pieces).is_flat());
    }

    #[test]
    fn faces_of_an_inner_hull_are_free_unless_a_piece_has_them() {
        let cube = |x: f64| {
            let corners: Vec<DVec3> = (0..8)
                .map(|k| DVec3::new(x + f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)))
                .collect();
            convex_hull(&corners, 1e-12).unwrap().into_polytope().unwrap().0
        };
        let pieces = [cube(0.0), cube(5.0)];
        let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
        let hull = tree.polytope(tree.root(), &pieces);
        for face in 0..hull.face_count() as u32 {
            let at_an_end = hull.plane(face).normal.x.abs() > 0.5;
            let original = hull.face_provenance(face) == Provenance::Original;
            assert_eq!(original, at_an_end, "only the two ends are faces of a piece");
        }
    }

    #[test]
    fn touching_pieces_keep_their_faces_where_they_share_vertices() {
        let cuboid = |low: f64, high: f64| {
            let corners: Vec<DVec3> = (0..8)
                .map(|k| DVec3::new(if k & 1 == 0 { low } else { high }, f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)))
                .collect();
            convex_hull(&corners, 1e-12).unwrap().into_polytope().unwrap().0
        };
        // The second is a pyramid on the first one's top: each of its slopes runs down to
        // vertices of both.
        let base = cuboid(0.0, 1.0);
        let apex = DVec3::new(0.5, 0.5, 1.2);
        let top: Vec<DVec3> = base.vertices().iter().copied().filter(|v| v.z > 0.5).chain([apex]).collect();
        let roof = convex_hull(&top, 1e-12).unwrap().into_polytope().unwrap().0;
        for pieces in [[base.clone(), roof.clone()], [roof, base]] {
            let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
            let hull = tree.polytope(tree.root(), &pieces);
            assert_eq!(hull.face_count(), 9);
            assert!((0..9).all(|face| hull.face_provenance(face) == Provenance::Original));
        }
        // Two cuboids side by side: no piece covers their common sides, each covers its end.
        let pieces = [cuboid(0.0, 1.0), cuboid(1.0, 3.0)];
        let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
        let hull = tree.polytope(tree.root(), &pieces);
        for face in 0..hull.face_count() as u32 {
            let end = hull.plane(face).normal.x.abs() > 0.5;
            assert_eq!(hull.face_provenance(face) == Provenance::Original, end);
        }
    }

    #[test]
    fn a_torus_of_grid_patches_is_held_at_every_level() {
        const COPLANAR: f64 = 1e-9;
        let n = 24;
        let point = |i: usize, j: usize| {
            let [a, b] = [i, j].map(|k| k as f64 / n as f64 * std::f64::consts::TAU);
            DVec3::new((2.0 + b.cos()) * a.cos(), (2.0 + b.cos()) * a.sin(), b.sin())
        };
        for (across, along) in [(1, 1), (2, 4), (3, 1)] {
            let mut pieces = Vec::new();
            for i in (0..n).step_by(across) {
                for j in (0..n).step_by(along) {
                    let steps = (0..=across).flat_map(|x| (0..=along).map(move |y| (x, y)));
                    let corners: Vec<DVec3> = steps.map(|(x, y)| point(i + x, j + y)).collect();
                    pieces.push(convex_hull(&corners, COPLANAR).unwrap().into_polytope().unwrap().0);
                }
            }
            let tree = Hierarchy::build(&pieces, COPLANAR).unwrap();
            let root = tree.node(tree.root());
            assert!(root.sphere.radius < 3.1 && root.oriented_box.half.max_element() < 3.0 + 1e-12);
            let mut under = vec![Vec::new(); tree.nodes().len()];
            for (k, node) in tree.nodes().iter().enumerate() {
                under[k] = match node.kind {
                    NodeKind::Leaf { piece } => vec![piece],
                    NodeKind::Inner { left, right } => [left, right].map(|c| under[c as usize].clone()).concat(),
                };
                let volume = tree.polytope(k as u32, &pieces);
                assert_eq!(volume.validate(COPLANAR), Ok(()), "node {k}");
                for &piece in &under[k] {
                    pieces[piece as usize].vertices().iter().for_each(|&p| assert_holds(&tree, k as u32, &pieces, p));
                }
            }
        }
    }
}
