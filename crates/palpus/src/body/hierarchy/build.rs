//! Making the tree: see steps 1 to 4 of the parent module.

use std::ops::Range;

use glam::DVec3;

use super::super::{Aabb, HullError, Polytope, Provenance, convex_hull};
use super::{Hierarchy, HierarchyError, Node, NodeKind};
use crate::algebra::{Alone, Workers, eigen, map_in_order, tolerance};
use crate::body::hierarchy::bounds::{OrientedBox, Sphere, covariance};

impl Hierarchy {
    /// The tree over `pieces`; `coplanar` is the distance within which hull faces merge, in model
    /// units.
    pub fn build(pieces: &[Polytope], coplanar: f64) -> Result<Self, HierarchyError> {
        Self::build_with(pieces, coplanar, &Alone, &mut |_| ())
    }

    /// As [`Self::build`], on `workers`; `progress` is called with the fraction done. The tree does
    /// not depend on the workers.
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
        let tree = crown.join(pieces.len(), subtrees, hulls);
        debug_assert_eq!(tree.validate(pieces, coplanar), Ok(()));
        Ok(tree)
    }
}

/// Shares of the work for the progress report: the top's splits, and the subtrees. The top's hulls
/// are the rest.
const CUT_SHARE: f64 = 0.1;
const SUBTREE_SHARE: f64 = 0.65;

/// The top of the tree, whose parts are too large for one worker.
struct Crown {
    /// The root first, then level by level.
    parts: Vec<Part>,
    /// Begin of each level among the parts, and the end of the last one.
    levels: Vec<usize>,
}

struct Part {
    /// Range of its pieces in the order.
    range: Range<usize>,
    /// The two parts that it was split into; `None` for a subtree.
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

    /// Appends a part and all below it; returns its node and depth.
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

    /// Builds the node over `order` and returns its index and depth.
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

/// Parts from which nodes are made.
struct Maker<'a> {
    pieces: &'a [Polytope],
    coplanar: f64,
}

impl Maker<'_> {
    /// Sorts the pieces along the direction of largest spread and returns where the second part
    /// begins.
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
        // Merging only makes walks shorter. If the merged hull has no volume, merge only exactly
        // coplanar faces.
        for coplanar in [self.coplanar, 0.0] {
            if let Some((polytope, inputs)) = convex_hull(&points, coplanar)?.into_polytope() {
                return Ok(tag(polytope, &inputs, left, right, self.coplanar));
            }
        }
        Err(HullError::Inconsistent)
    }
}

/// Splits a row of boxes where the sum of surface times number over both parts is least: the
/// expected cost of a traversal below them.
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

/// Tags a face original when an original face of one child covers it: all its vertices are
/// vertices of that child and lie in that face's plane, the child being convex.
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
