//! The binary tree of hulls over the pieces \[K02 §3.2, EL01\].
//!
//! 1. From the root down, split the pieces at the middle of their centroids' order along the direction in which these
//!    spread most; a leaf is one piece.
//! 2. From the leaves up, each node's volume is the convex hull of its children's hull vertices.
//! 3. A face of an inner hull is *free* (virtual: it spans empty space) unless it coincides with an original face of
//!    a piece.
//! 4. In front of each hull stand a box and a ball that hold it.
//!
//! The median split keeps the tree's depth logarithmic whatever the model, so that a traversal's stack has a bound.

use glam::DVec3;

use super::bounds::{OrientedBox, Sphere, covariance};
use super::{HullError, Polytope, Provenance, convex_hull};
use crate::algebra::{eigen, tolerance};

/// What a node stands for.
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
    /// Holds the node's hull.
    pub sphere: Sphere,
    /// Holds the node's hull.
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

/// Why pieces make no tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HierarchyError {
    /// There is nothing to put in it.
    #[error("a hierarchy needs at least one piece")]
    Empty,
    /// The hull of a node could not be built.
    #[error("the hull over {pieces} pieces could not be built")]
    Hull {
        /// Pieces below the node.
        pieces: usize,
        /// What the hull says.
        #[source]
        source: HullError,
    },
}

impl Hierarchy {
    /// The tree over `pieces`; `coplanar` is the distance within which hull faces merge, in model units.
    pub fn build(pieces: &[Polytope], coplanar: f64) -> Result<Self, HierarchyError> {
        if pieces.is_empty() {
            return Err(HierarchyError::Empty);
        }
        let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
        let mut builder = Builder { pieces, coplanar, nodes: Vec::new(), hulls: Vec::new() };
        let (_, depth) = builder.node(&mut order)?;
        Ok(Self { nodes: builder.nodes, hulls: builder.hulls, depth })
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

    /// The node's volume: the piece itself at a leaf, else the hull over the node's pieces; `pieces` are those of
    /// [`Self::build`].
    #[inline]
    pub fn polytope<'a>(&'a self, node: u32, pieces: &'a [Polytope]) -> &'a Polytope {
        let node = self.node(node);
        match node.kind {
            NodeKind::Leaf { piece } => &pieces[piece as usize],
            NodeKind::Inner { .. } => &self.hulls[node.hull as usize],
        }
    }
}

struct Builder<'a> {
    pieces: &'a [Polytope],
    coplanar: f64,
    nodes: Vec<Node>,
    hulls: Vec<Polytope>,
}

impl Builder<'_> {
    /// Builds the node over `order` (pieces, which are reordered) and answers its index and depth.
    fn node(&mut self, order: &mut [u32]) -> Result<(u32, usize), HierarchyError> {
        if let [piece] = *order {
            let bounds = bounds_of(self.pieces[piece as usize].vertices());
            return Ok((self.push(NodeKind::Leaf { piece }, bounds, u32::MAX), 1));
        }
        let middle = self.split(order);
        let count = order.len();
        let (first, second) = order.split_at_mut(middle);
        let (left, left_depth) = self.node(first)?;
        let (right, right_depth) = self.node(second)?;
        let hull = self.hull(left, right).map_err(|source| HierarchyError::Hull { pieces: count, source })?;
        let bounds = bounds_of(hull.vertices());
        let index = self.hulls.len() as u32;
        self.hulls.push(hull);
        let node = self.push(NodeKind::Inner { left, right }, bounds, index);
        Ok((node, 1 + left_depth.max(right_depth)))
    }

    fn push(&mut self, kind: NodeKind, (sphere, oriented_box): (Sphere, OrientedBox), hull: u32) -> u32 {
        self.nodes.push(Node { kind, sphere, oriented_box, hull });
        self.nodes.len() as u32 - 1
    }

    /// Sorts the pieces along the direction of largest spread and answers where the second half begins.
    fn split(&self, order: &mut [u32]) -> usize {
        let centroid = |piece: u32| self.pieces[piece as usize].centroid();
        let centroids: Vec<DVec3> = order.iter().map(|&piece| centroid(piece)).collect();
        let direction = eigen(covariance(&centroids)).1.z_axis;
        let middle = order.len() / 2;
        // Equal heights are ordered by piece, so that the tree is a function of the pieces alone.
        order.select_nth_unstable_by(middle, |&p, &q| {
            centroid(p).dot(direction).total_cmp(&centroid(q).dot(direction)).then(p.cmp(&q))
        });
        middle
    }

    fn polytope(&self, node: u32) -> &Polytope {
        let node = &self.nodes[node as usize];
        match node.kind {
            NodeKind::Leaf { piece } => &self.pieces[piece as usize],
            NodeKind::Inner { .. } => &self.hulls[node.hull as usize],
        }
    }

    fn hull(&self, left: u32, right: u32) -> Result<Polytope, HullError> {
        let (left, right) = (self.polytope(left), self.polytope(right));
        let points: Vec<DVec3> = left.vertices().iter().chain(right.vertices()).copied().collect();
        // Merging is a convenience for walks; where it finds no volume, exact coplanarity decides.
        for coplanar in [self.coplanar, 0.0] {
            if let Some((polytope, inputs)) = convex_hull(&points, coplanar)?.into_polytope() {
                return Ok(tag(polytope, &inputs, left, right, self.coplanar));
            }
        }
        Err(HullError::Inconsistent)
    }
}

fn bounds_of(points: &[DVec3]) -> (Sphere, OrientedBox) {
    let oriented_box = OrientedBox::around(points);
    (Sphere::around(points, oriented_box.center), oriented_box)
}

/// Tags a face original when all its vertices come from one child and an original face there lies in its plane.
fn tag(polytope: Polytope, inputs: &[u32], left: &Polytope, right: &Polytope, coplanar: f64) -> Polytope {
    let from_left = left.vertices().len() as u32;
    polytope.with_provenance(|polytope, face| {
        let loop_vertices = polytope.face_vertices(face);
        let plane = polytope.plane(face);
        let all_left = loop_vertices.iter().all(|&v| inputs[v as usize] < from_left);
        let all_right = loop_vertices.iter().all(|&v| inputs[v as usize] >= from_left);
        if !all_left && !all_right {
            return Provenance::Virtual;
        }
        let (child, base) = if all_left { (left, 0) } else { (right, from_left) };
        let first = inputs[loop_vertices[0] as usize] - base;
        let lies_in = |face: u32| {
            child.face_provenance(face) == Provenance::Original
                && child.plane(face).normal.dot(plane.normal) > tolerance::SAME_FACE
                && loop_vertices.iter().all(|&v| child.plane(face).height(polytope.vertex(v)).abs() <= coplanar)
        };
        if child.ring(first).iter().any(|spoke| lies_in(spoke.left)) {
            Provenance::Original
        } else {
            Provenance::Virtual
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: u64 = 0x41e2_a2c4;

    fn random_pieces(count: usize) -> Vec<Polytope> {
        let mut state = SEED;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut vector = move || DVec3::new(random(), random(), random());
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
        assert!(tree.depth() <= 7, "seed {SEED:#x}: depth {}", tree.depth());
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
        assert!(p.distance(sphere.center) <= sphere.radius * (1.0 + 1e-12), "seed {SEED:#x}");
        let local = oriented_box.axes.transpose() * (p - oriented_box.center);
        assert!((local.abs() - oriented_box.half).max_element() < 1e-12, "seed {SEED:#x}");
        let highest = tree.polytope(node, pieces).planes().iter().map(|plane| plane.height(p)).fold(f64::MIN, f64::max);
        assert!(highest < 1e-9, "seed {SEED:#x}: {highest} outside");
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
}
