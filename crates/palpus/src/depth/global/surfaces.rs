//! Queries on both surfaces: whether they cross, how far they are apart, and whether one lies
//! inside the other body.
//!
//! These queries verify every free translation. The queries do not use the cells that prove
//! translations to be blocked. Instead, they use exact predicates on pairs of triangles
//! ([`TrianglePair`]) and exact winding numbers.
//!
//! The first queries at a pose transform the moving body's boxes during the traversal, and these
//! boxes are slightly too large. After several queries, all boxes are computed once with their
//! exact size.

use std::cell::{Cell, OnceCell};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::containment::{Containment, containment};
use crate::algebra::tolerance::{COMMON_POINT, ESCAPE_STEPS, LOOSE_QUESTIONS, PLACED_BOX};
use crate::algebra::{Placement, Pose, closest_on_triangle, closest_segment_segment};
use crate::body::{Aabb, Body, TrianglePair, TriangleTree};

/// A pair of triangles that cross.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// A point near both triangles, in b's frame.
    pub(super) point: DVec3,
    /// Triangle of the moving body, as its index in the mesh.
    pub(super) moving: u32,
    /// Triangle of the fixed body, as its index in the mesh.
    pub(super) fixed: u32,
}

/// Two surfaces at a relative rotation.
pub(super) struct Surfaces<'a> {
    a: &'a Body,
    b: &'a Body,
    pose_ba: Pose,
    components_a: &'a [DVec3],
    components_b: &'a [DVec3],
    placement: Placement,
    /// Number of queries so far. After [`LOOSE_QUESTIONS`] queries, `exact` has the exact boxes of
    /// the moving body's tree in b's frame.
    questions: Cell<u32>,
    exact: OnceCell<Vec<Aabb>>,
}

/// Boxes of the moving body's tree in b's frame.
struct Boxes<'s> {
    exact: Option<&'s [Aabb]>,
    tree: &'s TriangleTree,
    placement: &'s Placement,
}

impl Boxes<'_> {
    fn of(&self, node: u32) -> Aabb {
        match self.exact {
            Some(exact) => exact[node as usize],
            None => placed(self.placement, &self.tree.nodes[node as usize].bounds),
        }
    }

    /// Returns false only if an axis of the moving body separates the box of `node`, moved by `t`,
    /// from `fixed`.
    fn overlap_turned(&self, node: u32, t: DVec3, fixed: &Aabb) -> bool {
        if self.exact.is_some() {
            return true;
        }
        let back = Placement { translation: self.placement.translation + t, ..*self.placement }.inverse();
        overlap(&self.tree.nodes[node as usize].bounds, DVec3::ZERO, &placed(&back, fixed))
    }
}

impl<'a> Surfaces<'a> {
    pub(super) fn new(
        (a, components_a): (&'a Body, &'a [DVec3]),
        (b, components_b): (&'a Body, &'a [DVec3]),
        pose_ba: &Pose,
    ) -> Self {
        Self {
            a,
            b,
            pose_ba: *pose_ba,
            components_a,
            components_b,
            placement: pose_ba.placement(),
            questions: Cell::new(0),
            exact: OnceCell::new(),
        }
    }

    /// Returns the box of the moving body at translation zero, in b's frame.
    pub(super) fn moving_box(&self) -> Aabb {
        Aabb::around(self.a.mesh().vertices().iter().map(|&p| self.placement.point(p)))
    }

    fn boxes(&self) -> Boxes<'_> {
        self.questions.set(self.questions.get() + 1);
        let exact =
            (self.questions.get() > LOOSE_QUESTIONS).then(|| &self.exact.get_or_init(|| self.exact_boxes())[..]);
        Boxes { exact, tree: self.a.tree(), placement: &self.placement }
    }

    fn exact_boxes(&self) -> Vec<Aabb> {
        let tree = self.a.tree();
        let mut boxes = vec![Aabb::EMPTY; tree.nodes.len()];
        for (k, node) in tree.nodes.iter().enumerate().rev() {
            boxes[k] = if node.is_leaf() {
                Aabb::around(tree.corners[node.slots()].iter().flatten().map(|&p| self.placement.point(p)))
            } else {
                boxes[k + 1].union(&boxes[node.second as usize])
            };
        }
        boxes
    }

    /// Returns true if the surfaces have no common point with body a moved by `t`, and neither body
    /// lies in the other.
    pub(super) fn is_free(&self, t: DVec3) -> bool {
        let mut touching = false;
        self.visit_pairs(t, &mut |p, q, _| {
            touching = TrianglePair::new(p, q) != TrianglePair::Apart;
            touching
        });
        !touching && !self.nested(t)
    }

    /// Returns up to `most` pairs of triangles that cross or touch, with body a moved by `t`.
    pub(super) fn crossings(&self, t: DVec3, most: usize) -> Vec<Crossing> {
        let mut found = Vec::new();
        self.visit_pairs(t, &mut |p, q, (moving, fixed)| {
            if TrianglePair::new(p, q) != TrianglePair::Apart {
                found.push(Crossing { point: common_point(p, q), moving, fixed });
            }
            found.len() >= most
        });
        found
    }

    /// Returns which body lies completely in the other, with body a moved by `t`. The surfaces must
    /// not cross.
    pub(super) fn containment(&self, t: DVec3) -> Containment {
        containment(self.a, self.components_a, self.b, self.components_b, &self.pose_ba, t)
    }

    /// Returns true if a component of one surface lies in the other body, with body a moved by `t`.
    pub(super) fn nested(&self, t: DVec3) -> bool {
        let back = self.pose_ba.inverse();
        let closed = |body: &Body| body.mesh().is_closed();
        closed(self.b) && self.components_a.iter().any(|&p| self.b.tree().inside(self.pose_ba.point(p) + t))
            || closed(self.a) && self.components_b.iter().any(|&p| self.a.tree().inside(back.point(p - t)))
    }

    /// Moves body a by `t`, which must be free. Returns true if body a can then move along a
    /// straight line until the bounding boxes are separate. Each step is at most as long as the
    /// distance of the surfaces, so no step can pass through a surface.
    pub(super) fn escapes(&self, t: DVec3) -> bool {
        let axes = [t.normalize_or_zero(), DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        axes.into_iter().filter(|along| *along != DVec3::ZERO).any(|along| self.escapes_along(t, along))
    }

    fn escapes_along(&self, mut t: DVec3, along: DVec3) -> bool {
        let around = self.moving_box();
        for _ in 0..ESCAPE_STEPS {
            if !overlap(&around, t, &self.b.tree().bounds()) {
                return true;
            }
            t += along * self.distance(t);
        }
        false
    }

    /// Returns the distance of the two surfaces with body a moved by `t`. The surfaces must not
    /// cross.
    pub(super) fn distance(&self, t: DVec3) -> f64 {
        let (moving, fixed) = (self.a.tree(), self.b.tree());
        let mut best = f64::INFINITY;
        let mut heap = BinaryHeap::new();
        let boxes = self.boxes();
        let gap = |i: u32, j: u32| Ordered(box_distance_squared(&boxes.of(i), t, &fixed.nodes[j as usize].bounds));
        if !moving.nodes.is_empty() && !fixed.nodes.is_empty() {
            heap.push(Reverse((gap(0, 0), 0, 0)));
        }
        while let Some(Reverse((Ordered(squared), i, j))) = heap.pop() {
            if squared >= best {
                break;
            }
            let (first, second) = (&moving.nodes[i as usize], &fixed.nodes[j as usize]);
            if first.is_leaf() && second.is_leaf() {
                for p in first.slots() {
                    let p = moving.corners[p].map(|x| self.placement.point(x) + t);
                    for q in second.slots() {
                        best = best.min(triangle_distance_squared(&p, &fixed.corners[q]));
                    }
                }
            } else if second.is_leaf() || (!first.is_leaf() && first.count >= second.count) {
                for child in [i + 1, first.second] {
                    heap.push(Reverse((gap(child, j), child, j)));
                }
            } else {
                for child in [j + 1, second.second] {
                    heap.push(Reverse((gap(i, child), i, child)));
                }
            }
        }
        best.sqrt()
    }

    /// Calls `visit` with each pair of triangles whose boxes overlap, and with their indices in the
    /// meshes. Stops when `visit` returns true.
    fn visit_pairs(&self, t: DVec3, visit: &mut dyn FnMut([DVec3; 3], [DVec3; 3], (u32, u32)) -> bool) {
        let (moving, fixed): (&TriangleTree, &TriangleTree) = (self.a.tree(), self.b.tree());
        if moving.nodes.is_empty() || fixed.nodes.is_empty() {
            return;
        }
        let boxes = self.boxes();
        let mut stack = vec![(0_u32, boxes.of(0), 0_u32)];
        while let Some((i, around, j)) = stack.pop() {
            let (first, second) = (&moving.nodes[i as usize], &fixed.nodes[j as usize]);
            if !overlap(&around, t, &second.bounds) || !boxes.overlap_turned(i, t, &second.bounds) {
                continue;
            }
            if first.is_leaf() && second.is_leaf() {
                for p in first.slots() {
                    let corners = moving.corners[p].map(|x| self.placement.point(x) + t);
                    let around = Aabb::around(corners);
                    for q in second.slots() {
                        let other = fixed.corners[q];
                        if around.overlaps(&Aabb::around(other)) && visit(corners, other, (moving.ids[p], fixed.ids[q]))
                        {
                            return;
                        }
                    }
                }
            } else if second.is_leaf() || (!first.is_leaf() && first.count >= second.count) {
                stack.extend([(first.second, boxes.of(first.second), j), (i + 1, boxes.of(i + 1), j)]);
            } else {
                stack.extend([(i, around, second.second), (i, around, j + 1)]);
            }
        }
    }
}

/// Returns an axis-aligned box around a transformed box.
fn placed(placement: &Placement, bounds: &Aabb) -> Aabb {
    let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
    let Placement { rotation, translation } = placement;
    let middle = placement.point(middle);
    let half = rotation.x_axis.abs() * half.x + rotation.y_axis.abs() * half.y + rotation.z_axis.abs() * half.z;
    // Enlarges the box by more than the rounding error of transformed corners.
    let half = half + (half + middle.abs() + translation.abs()) * PLACED_BOX;
    Aabb { min: middle - half, max: middle + half }
}

fn overlap(moving: &Aabb, t: DVec3, fixed: &Aabb) -> bool {
    (moving.min + t).cmple(fixed.max).all() && fixed.min.cmple(moving.max + t).all()
}

fn box_distance_squared(moving: &Aabb, t: DVec3, fixed: &Aabb) -> f64 {
    let gap = (fixed.min - (moving.max + t)).max((moving.min + t) - fixed.max).max(DVec3::ZERO);
    gap.length_squared()
}

/// Returns the squared distance of two triangles that do not cross.
fn triangle_distance_squared(p: &[DVec3; 3], q: &[DVec3; 3]) -> f64 {
    let mut best = f64::INFINITY;
    for k in 0..3 {
        best = best.min(closest_on_triangle(p[k], q[0], q[1], q[2]).distance_squared(p[k]));
        best = best.min(closest_on_triangle(q[k], p[0], p[1], p[2]).distance_squared(q[k]));
        for l in 0..3 {
            best = best.min(closest_segment_segment(p[k], p[(k + 1) % 3], q[l], q[(l + 1) % 3]).squared());
        }
    }
    best
}

/// Returns a point near the middle of the intersection of two triangles. The point is the mean of
/// the points where a side of one triangle crosses the other triangle.
fn common_point(p: [DVec3; 3], q: [DVec3; 3]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut count = 0.0;
    for (one, other) in [(&p, &q), (&q, &p)] {
        let normal = (other[1] - other[0]).cross(other[2] - other[0]);
        for k in 0..3 {
            let (from, to) = (one[k], one[(k + 1) % 3]);
            let (hf, ht) = (normal.dot(from - other[0]), normal.dot(to - other[0]));
            if (hf > 0.0) == (ht > 0.0) {
                continue;
            }
            let x = from + (to - from) * (hf / (hf - ht));
            let nearest = closest_on_triangle(x, other[0], other[1], other[2]);
            if nearest.distance_squared(x) <= COMMON_POINT * (to - from).length_squared() {
                sum += x;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { closest_on_triangle(p[0], q[0], q[1], q[2]) }
}

/// A distance as a sort key.
#[derive(Clone, Copy, PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}
