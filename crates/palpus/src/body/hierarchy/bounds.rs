//! Bounding volumes of a node: cheap to test. Each holds every point of its node by the arithmetic
//! of its own test: `distance(center)` for the sphere, coordinates along the axes for the box.
//! Rounding therefore excludes no point.
//!
//! The tests between pairs of them belong to the collision room.

use glam::{DMat3, DVec3};

use crate::algebra::{eigen, tolerance::SPHERE_STEPS};
use crate::body::Polytope;

/// A ball that holds a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// In the body's frame.
    pub center: DVec3,
    /// Model units.
    pub radius: f64,
}

/// A box that holds a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// In the body's frame.
    pub center: DVec3,
    /// Its columns are the box's axes, unit and right-handed.
    pub axes: DMat3,
    /// Half the sides along the axes.
    pub half: DVec3,
}

impl OrientedBox {
    /// A small box around a polytope: along the frame's axes, along the principal axes of its
    /// vertices, or flush with its largest face and that face's longest side, whichever has the
    /// least surface.
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

    /// The same box, wide enough to hold these points too.
    pub fn holding(mut self, points: impl Iterator<Item = DVec3>) -> Self {
        let to_box = self.axes.transpose();
        for p in points {
            self.half = self.half.max((to_box * (p - self.center)).abs());
        }
        self
    }

    /// Compares surfaces, because the volume of a flat node is zero.
    fn surface(&self) -> f64 {
        let h = self.half;
        h.x * h.y + h.y * h.z + h.z * h.x
    }
}

impl Sphere {
    /// A nearly smallest ball around points.
    ///
    /// From `center`, the centre steps toward the farthest point, by less each time (Bădoiu and
    /// Clarkson 2003); the best one met on the way wins.
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

    /// The same ball, wide enough to hold these points too.
    pub fn holding(mut self, points: impl Iterator<Item = DVec3>) -> Self {
        for p in points {
            self.radius = self.radius.max(p.distance(self.center));
        }
        self
    }
}

/// Second moments about the mean.
pub(crate) fn covariance(points: &[DVec3]) -> DMat3 {
    let mean = points.iter().copied().sum::<DVec3>() / points.len().max(1) as f64;
    points.iter().fold(DMat3::ZERO, |sum, &p| {
        let d = p - mean;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    })
}

/// The normal of the largest face and the direction of its longest side.
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
    fn the_box_of_a_turned_box_is_itself() {
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
        // Started at a corner of an equilateral triangle with a circumscribed circle of radius 1.
        let angles = [0.3, 0.3 + std::f64::consts::TAU / 3.0, 0.3 - std::f64::consts::TAU / 3.0];
        let triangle = angles.map(|a: f64| DVec3::new(a.cos(), a.sin(), 7.0));
        let sphere = Sphere::around(&triangle, triangle[0]);
        assert!(sphere.radius < 1.06, "{}", sphere.radius);
        assert!(triangle.iter().all(|p| p.distance(sphere.center) <= sphere.radius));
    }
}
