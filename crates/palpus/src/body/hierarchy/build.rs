//! Builds the tree, by steps 1 to 4 of the parent module.

use std::ops::Range;

use glam::DVec3;

use super::super::{Aabb, HullError, Polytope, Provenance, convex_hull};
use super::{Hierarchy, HierarchyError, Node, NodeKind};
use crate::algebra::{Alone, Workers, eigen, map_in_order, tolerance};
use crate::body::hierarchy::bounds::{OrientedBox, Sphere, covariance};

impl Hierarchy {
    /// Builds the tree over `pieces`. Hull faces within the distance `coplanar` (model units) of
    /// each other merge.
    pub fn build(pieces: &[Polytope], coplanar: f64) -> Result<Self, HierarchyError> {
        Self::build_with(pieces, coplanar, &Alone, &mut |_| ())
    }

    /// Builds the same tree as [`Self::build`] on several `workers`, and calls `progress` with the
    /// finished fraction. The tree does not depend on the workers.
    ///
    /// # Errors
    /// Fails if there are no pieces, or if the hull of a node cannot be built.
    pub fn build_with(
        pieces: &[Polytope],
        coplanar: f64,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, HierarchyError> {
        if pieces.is_empty() {
            return Err(HierarchyError::Empty);
        }
        let builder = HierarchyBuilder { pieces, coplanar };
        let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
        let upper = UpperLevels::cut(&builder, &mut order, workers);
        progress(CUT_SHARE);
        let subtrees =
            upper.subtrees(&builder, &order, workers, &mut |done| progress(CUT_SHARE + SUBTREE_SHARE * done))?;
        let hulls = upper.hulls(&builder, &order, &subtrees, workers, &mut |done| {
            progress(CUT_SHARE + SUBTREE_SHARE + (1.0 - CUT_SHARE - SUBTREE_SHARE) * done);
        })?;
        let tree = upper.join(pieces, subtrees, hulls);
        debug_assert_eq!(tree.validate(pieces, coplanar), Ok(()));
        Ok(tree)
    }
}

/// Fractions of the work for the progress report: splitting the top, and building the subtrees. The
/// remaining work is the hulls of the top.
const CUT_SHARE: f64 = 0.1;
const SUBTREE_SHARE: f64 = 0.65;

/// The top of the tree. A part with too many pieces for one worker is split into two parts. One
/// worker builds each of the other parts as a subtree.
struct UpperLevels {
    /// All parts, level by level from the root.
    parts: Vec<Part>,
    /// Index of each level's first part, and the index after the last part.
    levels: Vec<usize>,
}

struct Part {
    /// Range of the part's pieces in `order`.
    range: Range<usize>,
    /// Indices of the two halves; `None` if one worker builds the part as a subtree.
    halves: Option<[usize; 2]>,
}

/// The hull and bounds of an inner node, before it has an index.
struct Volume {
    hull: Polytope,
    sphere: Sphere,
    oriented_box: OrientedBox,
}

impl UpperLevels {
    /// Splits `order` until no part has more than [`tolerance::SUBTREE_PIECES`] pieces.
    fn cut(builder: &HierarchyBuilder<'_>, order: &mut [u32], workers: &dyn Workers) -> Self {
        let mut upper = Self { parts: vec![Part { range: 0..order.len(), halves: None }], levels: vec![0, 1] };
        let mut level = 0..1;
        loop {
            let large = |&k: &usize| upper.parts[k].range.len() > tolerance::SUBTREE_PIECES;
            let cut: Vec<usize> = level.filter(large).collect();
            if cut.is_empty() {
                return upper;
            }
            let split = |k: usize| {
                let mut sorted = order[upper.parts[cut[k]].range.clone()].to_vec();
                let middle = builder.split(&mut sorted);
                (sorted, middle)
            };
            for (part, (sorted, middle)) in cut.iter().zip(map_in_order(workers, cut.len(), 1, split, &mut |_| ())) {
                let Range { start, end } = upper.parts[*part].range;
                order[start..end].copy_from_slice(&sorted);
                let first = upper.parts.len();
                upper.parts[*part].halves = Some([first, first + 1]);
                upper.parts.push(Part { range: start..start + middle, halves: None });
                upper.parts.push(Part { range: start + middle..end, halves: None });
            }
            level = upper.levels[upper.levels.len() - 1]..upper.parts.len();
            upper.levels.push(upper.parts.len());
        }
    }

    /// Builds the tree of each part that was not split; `None` for the other parts.
    fn subtrees(
        &self,
        builder: &HierarchyBuilder<'_>,
        order: &[u32],
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Option<Subtree>>, HierarchyError> {
        let build = |k: usize| {
            let part = &self.parts[k];
            part.halves.is_none().then(|| Subtree::over(builder, &mut order[part.range.clone()].to_vec())).transpose()
        };
        map_in_order(workers, self.parts.len(), 1, build, progress).into_iter().collect()
    }

    /// Computes the hull and bounds of each part that was split, from the last level to the root.
    /// `None` for the other parts.
    fn hulls(
        &self,
        builder: &HierarchyBuilder<'_>,
        order: &[u32],
        subtrees: &[Option<Subtree>],
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Option<Volume>>, HierarchyError> {
        let mut volumes: Vec<Option<Volume>> = self.parts.iter().map(|_| None).collect();
        for level in self.levels.windows(2).rev() {
            let polytope = |k: usize| match (&volumes[k], &subtrees[k]) {
                (Some(volume), _) => Some(&volume.hull),
                (None, Some(subtree)) => Some(subtree.polytope(builder, subtree.nodes.len() as u32 - 1)),
                (None, None) => None,
            };
            let join = |k: usize| {
                let Part { range, halves } = &self.parts[level[0] + k];
                let [left, right] = (*halves)?.map(polytope);
                Some(builder.volume(&order[range.clone()], left?, right?))
            };
            let joined = map_in_order(workers, level[1] - level[0], 1, join, &mut |_| ());
            for (k, volume) in joined.into_iter().enumerate() {
                volumes[level[0] + k] = volume.transpose()?;
            }
            progress(1.0 - level[0] as f64 / self.parts.len() as f64);
        }
        Ok(volumes)
    }

    /// Joins all nodes into one hierarchy.
    fn join(
        &self,
        pieces: &[Polytope],
        mut subtrees: Vec<Option<Subtree>>,
        mut volumes: Vec<Option<Volume>>,
    ) -> Hierarchy {
        let count = pieces.len();
        let mut whole =
            Subtree { nodes: Vec::with_capacity(2 * count - 1), hulls: Vec::with_capacity(count - 1), depth: 0 };
        let (_, depth) = self.append(0, &mut whole, &mut subtrees, &mut volumes);
        Hierarchy::new(whole.nodes, whole.hulls, depth, pieces)
    }

    /// Appends the nodes of a part and of all parts below it. Returns the index of the part's node
    /// and the depth of its subtree.
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

/// A tree or a part of a tree. Its root is the last node.
struct Subtree {
    nodes: Vec<Node>,
    hulls: Vec<Polytope>,
    depth: usize,
}

impl Subtree {
    /// Builds the tree over the pieces in `order`, which it reorders.
    fn over(builder: &HierarchyBuilder<'_>, order: &mut [u32]) -> Result<Self, HierarchyError> {
        let count = order.len();
        let mut tree =
            Self { nodes: Vec::with_capacity(2 * count - 1), hulls: Vec::with_capacity(count - 1), depth: 0 };
        (_, tree.depth) = tree.grow(builder, order)?;
        Ok(tree)
    }

    /// Builds the nodes over `order`. Returns the index of the top node and the depth.
    fn grow(&mut self, builder: &HierarchyBuilder<'_>, order: &mut [u32]) -> Result<(u32, usize), HierarchyError> {
        if let [piece] = *order {
            let (sphere, oriented_box) = bounds_of(&builder.pieces[piece as usize]);
            self.nodes.push(Node { kind: NodeKind::Leaf { piece }, sphere, oriented_box, hull: u32::MAX });
            return Ok((self.nodes.len() as u32 - 1, 1));
        }
        let middle = builder.split(order);
        let (first, second) = order.split_at_mut(middle);
        let (left, left_depth) = self.grow(builder, first)?;
        let (right, right_depth) = self.grow(builder, second)?;
        let volume = builder.volume(order, self.polytope(builder, left), self.polytope(builder, right))?;
        self.push(NodeKind::Inner { left, right }, volume);
        Ok((self.nodes.len() as u32 - 1, 1 + left_depth.max(right_depth)))
    }

    fn push(&mut self, kind: NodeKind, volume: Volume) {
        let Volume { hull, sphere, oriented_box } = volume;
        self.nodes.push(Node { kind, sphere, oriented_box, hull: self.hulls.len() as u32 });
        self.hulls.push(hull);
    }

    /// Appends the nodes of `other` to this tree.
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

    fn polytope<'a>(&'a self, builder: &HierarchyBuilder<'a>, node: u32) -> &'a Polytope {
        let node = &self.nodes[node as usize];
        match node.kind {
            NodeKind::Leaf { piece } => &builder.pieces[piece as usize],
            NodeKind::Inner { .. } => &self.hulls[node.hull as usize],
        }
    }
}

/// The input data of the construction.
struct HierarchyBuilder<'a> {
    pieces: &'a [Polytope],
    coplanar: f64,
}

impl HierarchyBuilder<'_> {
    /// Sorts the pieces along the direction of largest spread and returns where the second part
    /// begins.
    fn split(&self, order: &mut [u32]) -> usize {
        let centroids: Vec<DVec3> = order.iter().map(|&piece| self.pieces[piece as usize].centroid()).collect();
        let axes = eigen(covariance(&centroids)).1;
        let mut along: Vec<(f64, u32)> =
            order.iter().zip(&centroids).map(|(&piece, centroid)| (centroid.dot(axes.z_axis), piece)).collect();
        // Pieces at equal positions are sorted by index, so that the tree depends only on the
        // pieces.
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

    /// Computes the hull and bounds of the node over the pieces in `order`. `left` and `right` are
    /// the volumes of its two children.
    fn volume(&self, order: &[u32], left: &Polytope, right: &Polytope) -> Result<Volume, HierarchyError> {
        let hull = self.hull(left, right).map_err(|source| HierarchyError::Hull { pieces: order.len(), source })?;
        let (sphere, oriented_box) = bounds_of(&hull);
        // Merging may have cut vertices off the hull, so the bounds are enlarged to contain all
        // vertices.
        let vertices = || order.iter().flat_map(|&piece| self.pieces[piece as usize].vertices()).copied();
        Ok(Volume { hull, sphere: sphere.holding(vertices()), oriented_box: oriented_box.holding(vertices()) })
    }

    fn hull(&self, left: &Polytope, right: &Polytope) -> Result<Polytope, HullError> {
        let points: Vec<DVec3> = left.vertices().iter().chain(right.vertices()).copied().collect();
        // Merged faces are needed only for speed. If the merged hull has no volume, merge only
        // exactly coplanar faces.
        for coplanar in [self.coplanar, 0.0] {
            if let Some((polytope, inputs)) = convex_hull(&points, coplanar)?.into_polytope() {
                return Ok(tag(polytope, &inputs, left, right, self.coplanar));
            }
        }
        Err(HullError::Inconsistent)
    }
}

/// Returns where to split a row of boxes. The split minimises the expected cost of a traversal: the
/// sum, over both parts, of the surface area times the number of boxes.
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

/// Returns half the surface area of a box.
fn surface(extent: &Aabb) -> f64 {
    let side = extent.max - extent.min;
    side.x * side.y + side.y * side.z + side.z * side.x
}

fn bounds_of(polytope: &Polytope) -> (Sphere, OrientedBox) {
    let oriented_box = OrientedBox::around(polytope);
    (Sphere::around(polytope.vertices(), oriented_box.center), oriented_box)
}

/// Tags each face as original if an original face of one child covers it, else as virtual. A
/// child's face covers the face if all vertices of the face belong to that child and lie in the
/// plane of the child's face. This condition is sufficient because the child is convex.
fn tag(polytope: Polytope, inputs: &[u32], left: &Polytope, right: &Polytope, coplanar: f64) -> Polytope {
    let from_left = left.vertices().len() as u32;
    // Neighbouring pieces share vertices. For a shared vertex, `inputs` has the vertex's index in
    // the left child.
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
