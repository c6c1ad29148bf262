//! Finds the point of a surface that is nearest to a given point.

use glam::DVec3;

use super::{Stack, TriangleTree};
use crate::algebra::closest_on_triangle;

/// The point of a surface nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of a triangle that contains the point. If several triangles contain the point, this is
    /// the first triangle found.
    pub triangle: u32,
    /// The nearest point, in model units.
    pub point: DVec3,
    /// Distance from the query point, in model units; not negative.
    pub distance: f64,
}

impl TriangleTree {
    /// Returns the point of the surface nearest to `p`; `None` if there are no triangles.
    pub fn nearest(&self, p: DVec3) -> Option<SurfacePoint> {
        self.nearest_within(p, f64::INFINITY)
    }

    /// Returns the point of the surface nearest to `p`; `None` if its distance is not less than
    /// `limit`.
    pub fn nearest_within(&self, p: DVec3, limit: f64) -> Option<SurfacePoint> {
        let mut best = None;
        let mut best_squared = limit * limit;
        let mut stack = Stack::from_root(&self.nodes);
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

    /// Returns some point of the surface that is nearer to `p` than `limit`; `None` if no point is
    /// nearer. Only the triangles for which `counts` returns true are searched. The point is
    /// usually close to the nearest one, but the search is cheaper.
    pub(crate) fn some_within(&self, p: DVec3, limit: f64, counts: impl Fn(u32) -> bool) -> Option<DVec3> {
        let mut best = None;
        let mut best_squared = limit * limit;
        let mut stack = Stack::from_root(&self.nodes);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.is_leaf() {
                for slot in node.slots() {
                    let [a, b, c] = self.corners[slot];
                    let point = closest_on_triangle(p, a, b, c);
                    let squared = point.distance_squared(p);
                    if squared < best_squared && counts(self.ids[slot]) {
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
}
