//! Bounding volumes of a node, for cheap tests. Their sizes are computed with the same arithmetic
//! as the tests of whether a point is inside: `distance(center)` for the sphere, and coordinates
//! along the axes for the box. Therefore rounding errors exclude no point of the node.
//!
//! The tests between two bounding volumes are in `collision`.

use glam::{DMat3, DVec3};

use crate::algebra::{eigen, tolerance::SPHERE_STEPS};
use crate::body::Polytope;

/// A bounding sphere of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre in the body's frame, in model units.
    pub center: DVec3,
    /// Radius in model units.
    pub radius: f64,
}

/// An oriented bounding box of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Centre in the body's frame, in model units.
    pub center: DVec3,
    /// A rotation matrix. Its columns are the unit axes of the box in the body's frame.
    pub axes: DMat3,
    /// Half of the side lengths along the axes, in model units.
    pub half: DVec3,
}

impl OrientedBox {
    /// Returns a small box around a polytope. Computes three boxes and returns the one with the
    /// smallest surface area. The first is aligned with the frame, the second with the principal
    /// axes of the vertices, and the third with the largest face and the longest side of that face.
    pub fn around(polytope: &Polytope) -> Self {
        let points = polytope.vertices();
        let mut best = Self::along(DMat3::IDENTITY, points);
        for axes in [Some(eigen(covariance(points)).1), flush_axes(polytope)].into_iter().flatten() {
            let tried = Self::along(axes, points);
            if tried.surface() < best.surface() {
                best = tried;
            }
        }
        best
    }

    fn along(axes: DMat3, points: &[DVec3]) -> Self {
        let to_box = axes.transpose();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in points {
            let q = to_box * p;
            low = low.min(q);
            high = high.max(q);
        }
        Self { center: axes * low.midpoint(high), axes, half: DVec3::ZERO }.holding(points.iter().copied())
    }

    /// Returns this box, enlarged so that it also contains `points`.
    pub fn holding(mut self, points: impl Iterator<Item = DVec3>) -> Self {
        let to_box = self.axes.transpose();
        for p in points {
            self.half = self.half.max((to_box * (p - self.center)).abs());
        }
        self
    }

    /// Returns an eighth of the surface area. The comparison of boxes uses areas, because the
    /// volume of a flat node is zero.
    fn surface(&self) -> f64 {
        let h = self.half;
        h.x * h.y + h.y * h.z + h.z * h.x
    }
}

impl Sphere {
    /// Returns a sphere around `points` that is nearly the smallest possible.
    ///
    /// The centre starts at `center`. In each iteration the centre moves toward the farthest point,
    /// by a decreasing fraction (Bădoiu and Clarkson 2003). The result is the smallest sphere of
    /// all iterations.
    pub fn around(points: &[DVec3], mut center: DVec3) -> Self {
        let mut best = Self { center, radius: f64::INFINITY };
        for step in 0..SPHERE_STEPS {
            let mut farthest = (center, 0.0);
            for &p in points {
                let d = p.distance_squared(center);
                if d > farthest.1 {
                    farthest = (p, d);
                }
            }
            let radius = farthest.0.distance(center);
            if radius < best.radius {
                best = Self { center, radius };
            }
            center += (farthest.0 - center) / f64::from(step + 4);
        }
        best.holding(points.iter().copied())
    }

    /// Returns this sphere, enlarged so that it also contains `points`.
    pub fn holding(mut self, points: impl Iterator<Item = DVec3>) -> Self {
        for p in points {
            self.radius = self.radius.max(p.distance(self.center));
        }
        self
    }
}

/// Returns the sum of d dᵀ over all points, where d is the offset from the mean.
pub(crate) fn covariance(points: &[DVec3]) -> DMat3 {
    let mean = points.iter().copied().sum::<DVec3>() / points.len().max(1) as f64;
    points.iter().fold(DMat3::ZERO, |sum, &p| {
        let d = p - mean;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    })
}

/// Returns axes along the normal of the largest face and along that face's longest side. `None` if
/// the side's component perpendicular to the normal is zero.
fn flush_axes(polytope: &Polytope) -> Option<DMat3> {
    let corner = |f: u32, k: usize| polytope.vertex(polytope.face_vertices(f).at(k));
    let area = |f: u32| {
        let area: DVec3 = (2..polytope.face_vertices(f).len())
            .map(|k| (corner(f, k - 1) - corner(f, 0)).cross(corner(f, k) - corner(f, 0)))
            .sum();
        area.length_squared()
    };
    let largest = (0..polytope.face_count() as u32).map(|f| (area(f), f)).max_by(|x, y| x.0.total_cmp(&y.0))?.1;
    let count = polytope.face_vertices(largest).len();
    let sides = (0..count).map(|k| corner(largest, (k + 1) % count) - corner(largest, k));
    let side = sides.max_by(|x, y| x.length_squared().total_cmp(&y.length_squared()))?;
    let normal = polytope.plane(largest).normal;
    let side = side.try_normalize()?.reject_from_normalized(normal).try_normalize()?;
    Some(DMat3::from_cols(normal, side, normal.cross(side)))
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::body::convex_hull;

    fn corners(half: DVec3, rotation: DQuat, center: DVec3) -> Vec<DVec3> {
        (0..8)
            .map(|k| {
                let sign = |bit: i32| if k & bit == 0 { -1.0 } else { 1.0 };
                center + rotation * (half * DVec3::new(sign(1), sign(2), sign(4)))
            })
            .collect()
    }

    #[test]
    fn a_turned_box_is_its_own_bounding_box() {
        for (half, angle) in [(DVec3::new(3.0, 2.0, 1.0), 0.4), (DVec3::ONE, 1.1), (DVec3::new(2.0, 2.0, 0.5), 2.0)] {
            let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -3.0).normalize(), angle);
            let points = corners(half, rotation, DVec3::new(5.0, -4.0, 1.0));
            let hull = convex_hull(&points, 1e-9).unwrap().into_polytope().unwrap().0;
            let bound = OrientedBox::around(&hull);
            let (mut found, mut expected) = (bound.half.to_array(), half.to_array());
            found.sort_by(f64::total_cmp);
            expected.sort_by(f64::total_cmp);
            for (f, e) in found.into_iter().zip(expected) {
                assert!((f - e).abs() < 1e-12, "{found:?} for {expected:?}");
            }
            assert!((bound.axes.determinant() - 1.0).abs() < 1e-14);
            assert!((bound.axes * bound.axes.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
        }
    }

    #[test]
    fn a_sphere_is_nearly_smallest() {
        let points = corners(DVec3::new(3.0, 2.0, 1.0), DQuat::IDENTITY, DVec3::X);
        let sphere = Sphere::around(&points, DVec3::X);
        assert!((sphere.radius - 14f64.sqrt()).abs() < 1e-12);
        // The centre starts at a corner of an equilateral triangle whose circumscribed circle has
        // radius 1.
        let angles = [0.3, 0.3 + std::f64::consts::TAU / 3.0, 0.3 - std::f64::consts::TAU / 3.0];
        let triangle = angles.map(|a: f64| DVec3::new(a.cos(), a.sin(), 7.0));
        let sphere = Sphere::around(&triangle, triangle[0]);
        assert!(sphere.radius < 1.06, "{}", sphere.radius);
        assert!(triangle.iter().all(|p| p.distance(sphere.center) <= sphere.radius));
    }
}
