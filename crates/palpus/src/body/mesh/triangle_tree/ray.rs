//! Intersects rays with the surface.

use std::ops::ControlFlow;

use glam::DVec3;

use super::{Stack, TriangleTree};
use crate::algebra::tolerance;
use crate::body::Aabb;

/// Intersection of a ray with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index of the triangle that the ray meets.
    pub triangle: u32,
    /// Ray parameter of the intersection, `origin + t * direction`; not negative.
    pub t: f64,
}

impl TriangleTree {
    /// Calls `visit` with each triangle that the ray `origin + t * direction` meets at `0 ≤ t ≤
    /// limit`, in any order, until `visit` breaks. `visit` returns the new limit. `direction` must
    /// not be zero, and need not have unit length. Both sides of the triangles count. A ray through
    /// an edge meets both adjacent triangles.
    pub fn visit_ray(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        mut visit: impl FnMut(RayHit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let ray = Ray::new(origin, direction);
        let mut limit = limit;
        let mut stack = Stack::from_root(&self.nodes);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if !ray.meets_box(&node.bounds, limit) {
                continue;
            }
            if node.is_leaf() {
                for slot in node.slots() {
                    if let Some(t) = ray.meets_triangle(&self.corners[slot]).filter(|&t| t <= limit) {
                        limit = visit(RayHit { triangle: self.ids[slot], t })?;
                    }
                }
                continue;
            }
            // An early hit lowers the limit.
            let [first, second] = [index + 1, node.second];
            let along = |child: u32| {
                let Aabb { min, max } = self.nodes[child as usize].bounds;
                direction.dot(min + max)
            };
            let (near, far) = if along(second) < along(first) { (second, first) } else { (first, second) };
            stack.push(far);
            stack.push(near);
        }
        ControlFlow::Continue(())
    }
}

/// A ray with the shear that maps its direction to the unit vector of its largest coordinate axis.
pub(super) struct Ray {
    origin: DVec3,
    inverse: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Ray {
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Self {
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
        // The slack allows for the rounding of the parameters at the box's faces, so that no
        // triangle is missed.
        enter <= leave + tolerance::RAY_SLACK * leave.abs()
    }

    /// Returns the ray parameter of the intersection with the closed triangle; `None` if the ray
    /// misses it.
    pub(super) fn meets_triangle(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            DVec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        // Both triangles at an edge compute the same value for the edge, up to the sign.
        let (u, v, w) = (c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        let t = (u * a.z + v * b.z + w * c.z) / sum;
        (t >= 0.0 && t.is_finite()).then_some(t)
    }
}
