//! A bounding-volume tree over the triangles of a mesh.
//!
//! A binary tree of axis-aligned boxes in flat arrays, split at the median centroid of the longest axis, so its depth is
//! at most the logarithm of the number of triangles; a node's first child follows it directly. The triangles' corners
//! are copied in leaf order, so a query touches nothing else and allocates nothing.
//!
//! * Overlap: the triangles whose boxes overlap a box; the pairs of the mesh's own triangles whose boxes overlap.
//! * Nearest point: branch and bound, nearer child first.
//! * Rays: watertight, in that a ray cannot slip through between two triangles with a common edge (S. Woop, C. Benthin,
//!   I. Wald, *Watertight Ray/Triangle Intersection*, 2013).
//! * Inside and winding number: in `winding`.

use std::ops::ControlFlow;

use glam::DVec3;

use super::Mesh;
use super::winding::Dipole;
use crate::algebra::{Plane, closest_on_triangle, tolerance};

/// An axis-aligned box, closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The box of nothing: overlaps no box, grows to whatever is added.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The least box around `points`.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The least box around both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Any common point?
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Is `p` in the box?
    #[inline]
    pub fn holds(&self, p: DVec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Square of the distance of `p` from the box, 0 inside.
    #[inline]
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (p.max(self.min).min(self.max) - p).length_squared()
    }
}

/// The point of a surface nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of a triangle that holds the point; of several the one first met.
    pub triangle: u32,
    /// On that triangle.
    pub point: DVec3,
    /// From the query point, ≥ 0.
    pub distance: f64,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index of the triangle that is met.
    pub triangle: u32,
    /// In lengths of the ray's direction from its origin, ≥ 0.
    pub t: f64,
}

/// One box of the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) bounds: Aabb,
    /// First triangle below, in leaf order.
    pub(super) first: u32,
    /// Number of triangles below.
    pub(super) count: u32,
    /// Second child; 0 for a leaf.
    pub(super) second: u32,
}

impl Node {
    #[inline]
    pub(super) fn is_leaf(&self) -> bool {
        self.second == 0
    }

    /// The triangles below, in leaf order.
    #[inline]
    pub(super) fn slots(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// The tree; see the module's description.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    pub(super) nodes: Vec<Node>,
    /// What a far point sees of each node.
    pub(super) dipoles: Vec<Dipole>,
    /// Corners in leaf order.
    pub(super) corners: Vec<[DVec3; 3]>,
    /// Index in the mesh, in leaf order.
    ids: Vec<u32>,
    /// The triangles have no boundary and agree about which side is outside.
    pub(super) closed: bool,
}

impl TriangleTree {
    /// The tree over all triangles of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let ids = (0..mesh.triangles().len() as u32).collect();
        Self::over(mesh.vertices(), mesh.triangles(), ids, mesh.is_closed())
    }

    /// The tree over the triangles `ids` out of `triangles`; `closed` when each edge is used as often in either direction.
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

    /// Appends the subtree over `items` (centroid and index, which it sorts into leaf order) and returns its box.
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

    /// The box around everything; [`Aabb::EMPTY`] without triangles.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Walks down all nodes that `enter` accepts, and gives `visit` the place (in leaf order) of each triangle of the
    /// leaves reached, until it breaks.
    pub(super) fn descend(
        &self,
        mut enter: impl FnMut(&Aabb) -> bool,
        mut visit: impl FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(0);
        }
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

    /// Calls `visit` with the index and the corners of each triangle whose own box overlaps `query`, until it breaks.
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

    /// As [`Self::visit_overlapping`], leaving out boxes that lie wholly above one of `planes` lowered by `depth`.
    pub(super) fn visit_below(
        &self,
        query: &Aabb,
        planes: &[Plane],
        depth: f64,
        mut visit: impl FnMut(u32, &[DVec3; 3]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let reaches_below = |bounds: &Aabb| {
            let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
            planes.iter().all(|plane| plane.height(middle) - plane.normal.abs().dot(half) < -depth)
        };
        self.descend(
            |bounds| bounds.overlaps(query) && reaches_below(bounds),
            |slot| visit(self.ids[slot], &self.corners[slot]),
        )
    }

    /// Calls `visit` once with each pair of different triangles whose boxes overlap, until it breaks.
    pub fn visit_own_pairs(
        &self,
        mut visit: impl FnMut((u32, &[DVec3; 3]), (u32, &[DVec3; 3])) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if self.nodes.is_empty() { ControlFlow::Continue(()) } else { self.pairs_below(0, 0, &mut visit) }
    }

    /// The pairs of one triangle below node `i` and a different one below node `j`, where `i == j` or `i` comes first.
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

    /// The point of the surface nearest to `p`; `None` only without triangles.
    pub fn nearest(&self, p: DVec3) -> Option<SurfacePoint> {
        self.nearest_within(p, f64::INFINITY)
    }

    /// The point of the surface nearest to `p` if its distance is less than `limit`.
    pub fn nearest_within(&self, p: DVec3, limit: f64) -> Option<SurfacePoint> {
        let mut best = None;
        let mut best_squared = limit * limit;
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(0);
        }
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.bounds.distance_squared(p) >= best_squared {
                continue;
            }
            if !node.is_leaf() {
                let (first, second) = (index + 1, node.second);
                let distance = |child: u32| self.nodes[child as usize].bounds.distance_squared(p);
                let (near, far) = if distance(second) < distance(first) { (second, first) } else { (first, second) };
                stack.push(far);
                stack.push(near);
                continue;
            }
            for slot in node.slots() {
                let [a, b, c] = self.corners[slot];
                let point = closest_on_triangle(p, a, b, c);
                let squared = point.distance_squared(p);
                if squared < best_squared {
                    best_squared = squared;
                    best = Some(SurfacePoint { triangle: self.ids[slot], point, distance: squared.sqrt() });
                }
            }
        }
        best
    }

    /// Some point of the surface nearer to `p` than `limit`, or none if there is none: cheaper than the nearest, and near it.
    pub(super) fn some_within(&self, p: DVec3, limit: f64) -> Option<DVec3> {
        let mut best = None;
        let mut best_squared = limit * limit;
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(0);
        }
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.is_leaf() {
                for [a, b, c] in &self.corners[node.slots()] {
                    let point = closest_on_triangle(p, *a, *b, *c);
                    let squared = point.distance_squared(p);
                    if squared < best_squared {
                        best_squared = squared;
                        best = Some(point);
                    }
                }
                if best.is_some() {
                    break;
                }
                continue;
            }
            let distance = |child: u32| self.nodes[child as usize].bounds.distance_squared(p);
            let (first, second) = (distance(index + 1), distance(node.second));
            let (near, far) = if second < first { (node.second, index + 1) } else { (index + 1, node.second) };
            if first.max(second) < best_squared {
                stack.push(far);
            }
            if first.min(second) < best_squared {
                stack.push(near);
            }
        }
        best
    }

    /// Where the ray from `origin` along `direction` (not zero, need not be unit) first meets the surface at
    /// `0 ≤ t ≤ limit`, from either side.
    pub fn ray_cast(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<RayHit> {
        let mut best: Option<RayHit> = None;
        let _ = self.visit_ray(origin, direction, limit, |hit| {
            if best.is_none_or(|b| hit.t < b.t) {
                best = Some(hit);
            }
            ControlFlow::Continue(best.map_or(limit, |b| b.t))
        });
        best
    }

    /// Calls `visit` with each triangle that the ray meets at `0 ≤ t ≤ limit`, in no order, until it breaks; `visit`
    /// returns the limit from there on. A ray through an edge meets the triangles on both sides.
    pub fn visit_ray(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        mut visit: impl FnMut(RayHit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let ray = Ray::new(origin, direction);
        let limit = std::cell::Cell::new(limit);
        self.descend(
            |bounds| ray.meets_box(bounds, limit.get()),
            |slot| {
                if let Some(t) = ray.meets_triangle(&self.corners[slot]).filter(|&t| t <= limit.get()) {
                    limit.set(visit(RayHit { triangle: self.ids[slot], t })?);
                }
                ControlFlow::Continue(())
            },
        )
    }
}

/// Nodes still to visit. The tree's depth is at most 33, so this never overflows.
pub(super) struct Stack {
    nodes: [u32; 64],
    len: usize,
}

impl Stack {
    pub(super) fn new() -> Self {
        Self { nodes: [0; 64], len: 0 }
    }

    #[inline]
    pub(super) fn push(&mut self, node: u32) {
        self.nodes[self.len] = node;
        self.len += 1;
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        Some(self.nodes[self.len])
    }
}

/// A ray, sheared so that its direction is the unit vector of its largest axis.
struct Ray {
    origin: DVec3,
    inverse: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Ray {
    fn new(origin: DVec3, direction: DVec3) -> Self {
        let z = direction.abs().max_position();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = DVec3::new(direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]);
        Self { origin, inverse: direction.recip(), axes: [x, y, z], shear }
    }

    fn meets_box(&self, bounds: &Aabb, limit: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, limit);
        for axis in 0..3 {
            let (low, high) = (bounds.min[axis] - self.origin[axis], bounds.max[axis] - self.origin[axis]);
            if self.inverse[axis].is_infinite() {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (first, second) = (low * self.inverse[axis], high * self.inverse[axis]);
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        // A slab's bounds are rounded: allow for it, so that no triangle is lost.
        enter <= leave + tolerance::RAY_SLACK * leave.abs()
    }

    /// The ray's parameter where it meets the closed triangle, if it is not negative.
    fn meets_triangle(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            DVec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        // Each is computed alike, up to its sign, for both triangles of an edge.
        let (u, v, w) = (c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        let t = (u * a.z + v * b.z + w * c.z) / sum;
        (t >= 0.0 && t.is_finite()).then_some(t)
    }
}

#[cfg(test)]
mod tests;
