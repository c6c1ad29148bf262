//! The binary tree of hulls over the pieces \[K02 §3.2, EL01\].
//!
//! 1. From the root down, sort the pieces along the direction in which their centroids spread most.
//!    Split them where the cost is lowest. The cost is the sum, over both parts, of the surface
//!    area times the number of pieces. A leaf has one piece.
//! 2. From the leaves up, compute each node's volume as the convex hull of its children's hull
//!    vertices.
//! 3. Tag a face of an inner hull as virtual, unless it coincides with an original face of a piece.
//!    Virtual faces span empty space.
//! 4. Compute a box and a sphere around each node's pieces, for faster tests.
//!
//! With several workers, `build_with` splits the top of the tree level by level. Then one worker
//! builds each subtree below the top. Finally, the workers build the hulls of the top, level by
//! level. The order of the nodes is always left subtree, right subtree, node.
//!
//! Each part of a split has at least a fixed fraction of the pieces. Therefore the depth of the
//! tree is logarithmic for every model, and the stack of a traversal has a bound. The split rule
//! was chosen by the number of node pairs that a traversal visits on contacts of real meshes. A
//! split at the midpoint visits 0.92 times as many pairs as a split at the median. A split at the
//! lowest cost of step 1 visits 0.83 times as many pairs as a split at the median.
//!
//! Merging faces may cut vertices off a hull, by up to the merge distance at each level. The
//! spheres and boxes still contain every vertex of every piece below the node. Therefore a pair of
//! nodes may be rejected if their spheres or boxes are disjoint.

pub(super) mod bounds;
mod build;
mod offsets;
mod validate;

use glam::DVec3;

use super::{HullError, Polytope};
use bounds::{OrientedBox, Sphere};
use offsets::Offsets;

pub use validate::HierarchyFault;

/// The kind of a node and its children or piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeKind {
    /// One convex piece.
    Leaf {
        /// Index of the piece in the body.
        piece: u32,
    },
    /// The pieces of two child nodes. The indices of both children are smaller than the index of
    /// this node.
    Inner {
        /// Index of the first child.
        left: u32,
        /// Index of the second child.
        right: u32,
    },
}

/// A node and its bounding volumes.
#[derive(Clone, Debug)]
pub struct Node {
    /// Leaf or inner node.
    pub kind: NodeKind,
    /// Sphere that contains every vertex of the node's pieces.
    pub sphere: Sphere,
    /// Box that contains every vertex of the node's pieces.
    pub oriented_box: OrientedBox,
    /// Index of an inner node's hull; `u32::MAX` for a leaf.
    hull: u32,
}

/// The binary tree of hulls over a body's pieces. Its root is the last node.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    hulls: Vec<Polytope>,
    offsets: Offsets,
    depth: usize,
}

/// The reason why a tree over the pieces cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HierarchyError {
    /// There are no pieces.
    #[error("a hierarchy needs at least one piece")]
    Empty,
    /// The hull of a node could not be built.
    #[error("the hull over {pieces} pieces could not be built")]
    Hull {
        /// Number of pieces below the node.
        pieces: usize,
        /// The error of the hull's construction.
        #[source]
        source: HullError,
    },
}

impl Hierarchy {
    /// Restores a tree from its nodes and the hulls of its inner nodes. Children come before
    /// parents, and the hulls are in the order of the nodes. Returns `None` unless the nodes form
    /// one tree and each of the `pieces` is in exactly one leaf. The caller must ensure that each
    /// volume contains the volumes below it.
    pub fn from_parts(
        nodes: impl IntoIterator<Item = (NodeKind, Sphere, OrientedBox)>,
        hulls: Vec<Polytope>,
        pieces: &[Polytope],
    ) -> Option<Self> {
        let mut free_pieces = vec![true; pieces.len()];
        let count = (2 * pieces.len()).checked_sub(1)?;
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
        sound.then(|| Self::new(answer, hulls, depth, pieces))
    }

    /// Returns the tree of these nodes. `hulls` are the hulls of its inner nodes.
    fn new(nodes: Vec<Node>, hulls: Vec<Polytope>, depth: usize, pieces: &[Polytope]) -> Self {
        let offsets = Offsets::of(&nodes, &hulls, pieces);
        Self { nodes, hulls, offsets, depth }
    }

    /// Returns the hulls of the inner nodes, in the order of the nodes.
    pub fn hulls(&self) -> &[Polytope] {
        &self.hulls
    }

    /// Returns the index of the root.
    pub fn root(&self) -> u32 {
        self.nodes.len() as u32 - 1
    }

    /// Returns the node with index `node`.
    #[inline]
    pub fn node(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// Returns all nodes, children before parents.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the number of nodes on the longest path from the root to a leaf.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Returns the node's volume: the piece of a leaf, or the hull over the pieces of an inner
    /// node. `pieces` must be the pieces that were given to [`Self::build`].
    #[inline]
    pub fn polytope<'a>(&'a self, node: u32, pieces: &'a [Polytope]) -> &'a Polytope {
        self.node(node).polytope(&self.hulls, pieces)
    }

    /// Returns a lower bound of the heights of the vertices of a node's volume above the node's
    /// middle ([`Node::middle`]), along `direction`, model units times the length of `direction`.
    /// `pieces` are the same as for [`Self::polytope`].
    #[inline]
    pub(crate) fn lowest(&self, node: u32, pieces: &[Polytope], direction: DVec3) -> f64 {
        self.offsets.lowest(node, direction).unwrap_or_else(|| {
            let lowest = self.polytope(node, pieces).support_point(-direction);
            direction.dot(lowest - self.node(node).middle())
        })
    }
}

impl Node {
    /// Returns the node's volume. `hulls` are the hulls of the inner nodes of its tree.
    #[inline]
    fn polytope<'a>(&self, hulls: &'a [Polytope], pieces: &'a [Polytope]) -> &'a Polytope {
        match self.kind {
            NodeKind::Leaf { piece } => &pieces[piece as usize],
            NodeKind::Inner { .. } => &hulls[self.hull as usize],
        }
    }

    /// Returns the centre of the node's sphere, rounded to single precision.
    #[inline]
    pub(crate) fn middle(&self) -> DVec3 {
        self.sphere.center.as_vec3().as_dvec3()
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
    fn each_piece_is_in_one_leaf_and_ancestors() {
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
        assert!(highest < 2e-9, "seed {SEED:#x}: a vertex is {highest} outside the hull");
    }

    #[test]
    fn the_hull_over_coplanar_plates_is_flat() {
        let plate = |x: f64| {
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)].map(|(u, v)| DVec3::new(x + u, v, 0.0));
            Polytope::from_polygon(corners.to_vec(), DVec3::Z, Provenance::Original).unwrap()
        };
        let pieces = [plate(0.0), plate(3.0)];
        let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
        assert!(tree.polytope(tree.root(), &pieces).is_flat());
    }

    #[test]
    fn inner_hull_faces_are_virtual_unless_pieces_have_them() {
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
            assert_eq!(original, at_an_end, "only the faces at the two ends are faces of a piece");
        }
    }

    #[test]
    fn faces_stay_original_if_pieces_share_vertices() {
        let cuboid = |low: f64, high: f64| {
            let corners: Vec<DVec3> = (0..8)
                .map(|k| DVec3::new(if k & 1 == 0 { low } else { high }, f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)))
                .collect();
            convex_hull(&corners, 1e-12).unwrap().into_polytope().unwrap().0
        };
        // The second piece is a pyramid on top of the first one. Each sloping face has two
        // vertices that belong to both pieces.
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
        // Two cuboids lie side by side. No single piece covers a long side of the hull. Each piece
        // covers one end.
        let pieces = [cuboid(0.0, 1.0), cuboid(1.0, 3.0)];
        let tree = Hierarchy::build(&pieces, 1e-9).unwrap();
        let hull = tree.polytope(tree.root(), &pieces);
        for face in 0..hull.face_count() as u32 {
            let end = hull.plane(face).normal.x.abs() > 0.5;
            assert_eq!(hull.face_provenance(face) == Provenance::Original, end);
        }
    }

    #[test]
    fn every_level_contains_a_torus_of_grid_patches() {
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
