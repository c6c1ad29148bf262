//! The binary tree of hulls over the pieces \[K02 §3.2, EL01\].
//!
//! 1. From the root down, split the pieces in the order of their centroids along the direction in which these spread
//!    most, where surface times number of both parts is least; a leaf is one piece.
//! 2. From the leaves up, each node's volume is the convex hull of its children's hull vertices.
//! 3. A face of an inner hull is *free* (virtual: it spans empty space) unless it coincides with an original face of
//!    a piece.
//! 4. In front of each hull stand a box and a ball that hold it.
//!
//! With several hands, the tree's top is cut level by level, the subtrees below it are built whole, and the hulls of the
//! top level by level again (`build_with`). The nodes' order is that of one hand: left subtree, right subtree, node.
//!
//! Neither part of a split is ever smaller than a fixed share, which keeps the tree's depth logarithmic whatever the
//! model, so that a traversal's stack has a bound. Cuts measured on contacts of the real meshes, node pairs that a
//! traversal looks at: median 1, midpoint 0.92, least surface times number 0.83.
//!
//! Merging may shave vertices off a hull by the merge distance, a little at each level. The balls and boxes are made to
//! hold every vertex of every piece all the same, so that dropping a pair by them is never wrong.

use std::ops::Range;

use glam::DVec3;

use super::bounds::{OrientedBox, Sphere, covariance};
use super::{Aabb, HullError, Polytope, Provenance, convex_hull};
use crate::algebra::{Alone, Workers, eigen, map_in_order, tolerance};

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
        Self::build_with(pieces, coplanar, &Alone, &mut |_| ())
    }

    /// As [`Self::build`], with the hands of `workers`; `progress` is told the fraction done. The tree is the same
    /// whoever they are.
    pub fn build_with(
        pieces: &[Polytope],
        coplanar: f64,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, HierarchyError> {
        if pieces.is_empty() {
            return Err(HierarchyError::Empty);
        }
        let maker = Maker { pieces, coplanar };
        let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
        let crown = Crown::cut(&maker, &mut order, workers);
        progress(CUT_SHARE);
        let subtrees =
            crown.subtrees(&maker, &order, workers, &mut |done| progress(CUT_SHARE + SUBTREE_SHARE * done))?;
        let hulls = crown.hulls(&maker, &order, &subtrees, workers, &mut |done| {
            progress(CUT_SHARE + SUBTREE_SHARE + (1.0 - CUT_SHARE - SUBTREE_SHARE) * done);
        })?;
        Ok(crown.join(pieces.len(), subtrees, hulls))
    }

    /// A tree from its nodes, children before parents, and the hulls of its inner nodes in the nodes' order; `None` unless
    /// it is one tree with each of so many `pieces` in one leaf. That its volumes hold what is below is the caller's promise.
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

/// The parts of the work that the top's cuts and the subtrees are, for the progress report; the top's hulls are the rest.
const CUT_SHARE: f64 = 0.1;
const SUBTREE_SHARE: f64 = 0.65;

/// The top of the tree, whose parts are too large for one hand.
struct Crown {
    /// The root first, then level by level.
    parts: Vec<Part>,
    /// Where each level begins among the parts, and where the last one ends.
    levels: Vec<usize>,
}

struct Part {
    /// Its pieces in the order.
    range: Range<usize>,
    /// The parts that it was cut into; none for one that is a subtree.
    halves: Option<[usize; 2]>,
}

/// An inner node that is not in a tree yet.
struct Volume {
    hull: Polytope,
    sphere: Sphere,
    oriented_box: OrientedBox,
}

impl Crown {
    /// Cuts `order` until no part has more than [`tolerance::SUBTREE_PIECES`] pieces.
    fn cut(maker: &Maker<'_>, order: &mut [u32], workers: &dyn Workers) -> Self {
        let mut crown = Self { parts: vec![Part { range: 0..order.len(), halves: None }], levels: vec![0, 1] };
        let mut level = 0..1;
        loop {
            let large = |&k: &usize| crown.parts[k].range.len() > tolerance::SUBTREE_PIECES;
            let cut: Vec<usize> = level.filter(large).collect();
            if cut.is_empty() {
                return crown;
            }
            let split = |k: usize| {
                let mut sorted = order[crown.parts[cut[k]].range.clone()].to_vec();
                let middle = maker.split(&mut sorted);
                (sorted, middle)
            };
            for (part, (sorted, middle)) in cut.iter().zip(map_in_order(workers, cut.len(), 1, split, &mut |_| ())) {
                let Range { start, end } = crown.parts[*part].range;
                order[start..end].copy_from_slice(&sorted);
                let first = crown.parts.len();
                crown.parts[*part].halves = Some([first, first + 1]);
                crown.parts.push(Part { range: start..start + middle, halves: None });
                crown.parts.push(Part { range: start + middle..end, halves: None });
            }
            level = crown.levels[crown.levels.len() - 1]..crown.parts.len();
            crown.levels.push(crown.parts.len());
        }
    }

    /// For each part that was not cut, its tree.
    fn subtrees(
        &self,
        maker: &Maker<'_>,
        order: &[u32],
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Option<Subtree>>, HierarchyError> {
        let build = |k: usize| {
            let part = &self.parts[k];
            part.halves.is_none().then(|| Subtree::over(maker, &mut order[part.range.clone()].to_vec())).transpose()
        };
        map_in_order(workers, self.parts.len(), 1, build, progress).into_iter().collect()
    }

    /// For each part that was cut, its node, from the last level up.
    fn hulls(
        &self,
        maker: &Maker<'_>,
        order: &[u32],
        subtrees: &[Option<Subtree>],
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Option<Volume>>, HierarchyError> {
        let mut volumes: Vec<Option<Volume>> = self.parts.iter().map(|_| None).collect();
        for level in self.levels.windows(2).rev() {
            let polytope = |k: usize| match (&volumes[k], &subtrees[k]) {
                (Some(volume), _) => Some(&volume.hull),
                (None, Some(subtree)) => Some(subtree.polytope(maker, subtree.nodes.len() as u32 - 1)),
                (None, None) => None,
            };
            let join = |k: usize| {
                let Part { range, halves } = &self.parts[level[0] + k];
                let [left, right] = (*halves)?.map(polytope);
                Some(maker.volume(&order[range.clone()], left?, right?))
            };
            let joined = map_in_order(workers, level[1] - level[0], 1, join, &mut |_| ());
            for (k, volume) in joined.into_iter().enumerate() {
                volumes[level[0] + k] = volume.transpose()?;
            }
            progress(1.0 - level[0] as f64 / self.parts.len() as f64);
        }
        Ok(volumes)
    }

    /// One list of all nodes.
    fn join(&self, pieces: usize, mut subtrees: Vec<Option<Subtree>>, mut volumes: Vec<Option<Volume>>) -> Hierarchy {
        let mut whole =
            Subtree { nodes: Vec::with_capacity(2 * pieces - 1), hulls: Vec::with_capacity(pieces - 1), depth: 0 };
        let (_, depth) = self.append(0, &mut whole, &mut subtrees, &mut volumes);
        Hierarchy { nodes: whole.nodes, hulls: whole.hulls, depth }
    }

    /// Appends a part and all below it; answers its node and depth.
    fn append(
        &self,
        part: usize,
        whole: &mut Subtree,
        subtrees: &mut [Option<Subtree>],
        volumes: &mut [Option<Volume>],
    ) -> (u32, usize) {
        let Some([first, second]) = self.parts[part].halves else {
            let subtree = subtrees[part].take();
            let depth = subtree.as_ref().map_or(0, |subtree| subtree.depth);
            subtree.into_iter().for_each(|subtree| whole.extend(subtree));
            return (whole.nodes.len() as u32 - 1, depth);
        };
        let (left, left_depth) = self.append(first, whole, subtrees, volumes);
        let (right, right_depth) = self.append(second, whole, subtrees, volumes);
        if let Some(volume) = volumes[part].take() {
            whole.push(NodeKind::Inner { left, right }, volume);
        }
        (whole.nodes.len() as u32 - 1, 1 + left_depth.max(right_depth))
    }
}

/// A tree, or a part of one: its last node is its root.
struct Subtree {
    nodes: Vec<Node>,
    hulls: Vec<Polytope>,
    depth: usize,
}

impl Subtree {
    /// The tree over `order` (pieces, which are reordered).
    fn over(maker: &Maker<'_>, order: &mut [u32]) -> Result<Self, HierarchyError> {
        let count = order.len();
        let mut tree =
            Self { nodes: Vec::with_capacity(2 * count - 1), hulls: Vec::with_capacity(count - 1), depth: 0 };
        (_, tree.depth) = tree.grow(maker, order)?;
        Ok(tree)
    }

    /// Builds the node over `order` and answers its index and depth.
    fn grow(&mut self, maker: &Maker<'_>, order: &mut [u32]) -> Result<(u32, usize), HierarchyError> {
        if let [piece] = *order {
            let (sphere, oriented_box) = bounds_of(&maker.pieces[piece as usize]);
            self.nodes.push(Node { kind: NodeKind::Leaf { piece }, sphere, oriented_box, hull: u32::MAX });
            return Ok((self.nodes.len() as u32 - 1, 1));
        }
        let middle = maker.split(order);
        let (first, second) = order.split_at_mut(middle);
        let (left, left_depth) = self.grow(maker, first)?;
        let (right, right_depth) = self.grow(maker, second)?;
        let volume = maker.volume(order, self.polytope(maker, left), self.polytope(maker, right))?;
        self.push(NodeKind::Inner { left, right }, volume);
        Ok((self.nodes.len() as u32 - 1, 1 + left_depth.max(right_depth)))
    }

    fn push(&mut self, kind: NodeKind, volume: Volume) {
        let Volume { hull, sphere, oriented_box } = volume;
        self.nodes.push(Node { kind, sphere, oriented_box, hull: self.hulls.len() as u32 });
        self.hulls.push(hull);
    }

    /// Appends another tree's nodes after this one's.
    fn extend(&mut self, other: Self) {
        let (nodes, hulls) = (self.nodes.len() as u32, self.hulls.len() as u32);
        self.nodes.extend(other.nodes.into_iter().map(|node| match node.kind {
            NodeKind::Leaf { .. } => node,
            NodeKind::Inner { left, right } => Node {
                kind: NodeKind::Inner { left: left + nodes, right: right + nodes },
                hull: node.hull + hulls,
                ..node
            },
        }));
        self.hulls.extend(other.hulls);
    }

    fn polytope<'a>(&'a self, maker: &Maker<'a>, node: u32) -> &'a Polytope {
        let node = &self.nodes[node as usize];
        match node.kind {
            NodeKind::Leaf { piece } => &maker.pieces[piece as usize],
            NodeKind::Inner { .. } => &self.hulls[node.hull as usize],
        }
    }
}

/// What nodes are made from.
struct Maker<'a> {
    pieces: &'a [Polytope],
    coplanar: f64,
}

impl Maker<'_> {
    /// Sorts the pieces along the direction of largest spread and answers where the second part begins.
    fn split(&self, order: &mut [u32]) -> usize {
        let centroids: Vec<DVec3> = order.iter().map(|&piece| self.pieces[piece as usize].centroid()).collect();
        let axes = eigen(covariance(&centroids)).1;
        let mut along: Vec<(f64, u32)> =
            order.iter().zip(&centroids).map(|(&piece, centroid)| (centroid.dot(axes.z_axis), piece)).collect();
        // Equal heights are ordered by piece, so that the tree is a function of the pieces alone.
        along.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        for (place, &(_, piece)) in order.iter_mut().zip(&along) {
            *place = piece;
        }
        let to_axes = axes.transpose();
        let extents: Vec<Aabb> = order
            .iter()
            .map(|&piece| Aabb::around(self.pieces[piece as usize].vertices().iter().map(|&v| to_axes * v)))
            .collect();
        cheapest_cut(&extents)
    }

    /// The node over `order`, whose two parts have the volumes `left` and `right`.
    fn volume(&self, order: &[u32], left: &Polytope, right: &Polytope) -> Result<Volume, HierarchyError> {
        let hull = self.hull(left, right).map_err(|source| HierarchyError::Hull { pieces: order.len(), source })?;
        let (sphere, oriented_box) = bounds_of(&hull);
        // Merging may have shaved vertices off the hull, but not off the bounds.
        let vertices = || order.iter().flat_map(|&piece| self.pieces[piece as usize].vertices()).copied();
        Ok(Volume { hull, sphere: sphere.holding(vertices()), oriented_box: oriented_box.holding(vertices()) })
    }

    fn hull(&self, left: &Polytope, right: &Polytope) -> Result<Polytope, HullError> {
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

/// Where to cut a row of boxes in two so that surface times number, summed over both parts, is least: what a traversal
/// is likely to spend below them.
fn cheapest_cut(extents: &[Aabb]) -> usize {
    let count = extents.len();
    let mut costs = vec![0.0; count];
    let mut left = Aabb::EMPTY;
    for k in 1..count {
        left = left.union(&extents[k - 1]);
        costs[k] += surface(&left) * k as f64;
    }
    let mut right = Aabb::EMPTY;
    for k in (1..count).rev() {
        right = right.union(&extents[k]);
        costs[k] += surface(&right) * (count - k) as f64;
    }
    let least = (count / tolerance::SPLIT_SHARE).max(1);
    (least..=count - least).min_by(|&i, &j| costs[i].total_cmp(&costs[j])).unwrap_or(count / 2)
}

/// Half the surface of a box.
fn surface(extent: &Aabb) -> f64 {
    let side = extent.max - extent.min;
    side.x * side.y + side.y * side.z + side.z * side.x
}

fn bounds_of(polytope: &Polytope) -> (Sphere, OrientedBox) {
    let oriented_box = OrientedBox::around(polytope);
    (Sphere::around(polytope.vertices(), oriented_box.center), oriented_box)
}

/// Tags a face original when an original face of one child covers it: all its vertices are vertices of that child and
/// lie in that face's plane, the child being convex.
fn tag(polytope: Polytope, inputs: &[u32], left: &Polytope, right: &Polytope, coplanar: f64) -> Polytope {
    let from_left = left.vertices().len() as u32;
    // Neighbouring pieces share vertices; the hull names the left one's.
    let place = |v: &DVec3| v.to_array().map(f64::to_bits);
    let mut rights: Vec<([u64; 3], u32)> = right.vertices().iter().map(place).zip(0..).collect();
    rights.sort_unstable();
    let right_at = |v: [u64; 3]| rights.binary_search_by_key(&v, |&(at, _)| at).ok().map(|k| rights[k].1);
    let in_left = |v: u32| Some(inputs[v as usize]).filter(|&k| k < from_left);
    let in_right = |v: u32| match inputs[v as usize].checked_sub(from_left) {
        None => right_at(place(&polytope.vertex(v))),
        inside => inside,
    };
    let covered = |child: &Polytope, first: Option<u32>, face: u32| {
        let plane = polytope.plane(face);
        let covers = |cover: u32| {
            child.face_provenance(cover) == Provenance::Original
                && child.plane(cover).normal.dot(plane.normal) > tolerance::SAME_FACE
                && polytope
                    .face_vertices(face)
                    .iter()
                    .all(|v| child.plane(cover).height(polytope.vertex(v)).abs() <= coplanar)
        };
        first.is_some_and(|first| child.ring(first).iter().any(|spoke| covers(spoke.left)))
    };
    let original: Vec<bool> = (0..polytope.face_count() as u32)
        .map(|face| {
            let corners = polytope.face_vertices(face);
            let all = |of: &dyn Fn(u32) -> Option<u32>| corners.iter().all(|v| of(v).is_some());
            all(&in_left) && covered(left, in_left(corners.at(0)), face)
                || all(&in_right) && covered(right, in_right(corners.at(0)), face)
        })
        .collect();
    polytope.with_provenance(|_, face| match original[face as usize] {
        true => Provenance::Original,
        false => Provenance::Virtual,
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
        // The second is a pyramid on the first one's top: each of its slopes runs down to vertices of both.
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
                assert_eq!(volume.check_well_formed(COPLANAR), Ok(()), "node {k}");
                for &piece in &under[k] {
                    pieces[piece as usize].vertices().iter().for_each(|&p| assert_holds(&tree, k as u32, &pieces, p));
                }
            }
        }
    }
}
