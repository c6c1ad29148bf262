//! Finds the body under the mouse, and the point on it.

use glam::DVec3;
use palpus::algebra::Pose;

use super::view3d::Ray;
use crate::scene::{Scene, ShownBody};
use crate::solid::Solid;

/// Returns the point of the probe under `ray`, in the probe's frame: the nearest point on its
/// triangles or, for thin parts, a corner close to the ray. `None` if an opaque body hides this
/// point. `metres` returns the largest distance from the ray at a point of the world.
pub(super) fn probe_at(scene: &Scene, ray: &Ray, metres: impl Fn(DVec3) -> f64) -> Option<DVec3> {
    let probe = scene.bodies.first()?;
    let local = ray.within(&probe.pose);
    let (distance, point) = match first_hit(&probe.solid, &local) {
        Some(distance) => (distance, local.at(distance)),
        None => nearly(&probe.solid, &local, |point| metres(probe.pose.point(point)))?,
    };
    let hides = |body: &ShownBody| {
        !(body.look.translucent || body.look.xray)
            && first_hit(&body.solid, &ray.within(&body.pose)).is_some_and(|d| d < distance)
    };
    (!scene.bodies.iter().skip(1).any(hides)).then_some(point)
}

impl Ray {
    /// Returns the ray in the frame of a body at this pose.
    fn within(&self, pose: &Pose) -> Self {
        let inverse = pose.inverse();
        Self { origin: inverse.point(self.origin), direction: inverse.vector(self.direction) }
    }

    fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}

/// Returns the distance along the ray at which the solid begins.
fn first_hit(solid: &Solid, ray: &Ray) -> Option<f64> {
    let of = |triangle: &[u32; 3]| hit(triangle.map(|v| solid.vertices[v as usize]), ray);
    solid.triangles.iter().filter_map(of).min_by(f64::total_cmp)
}

/// Intersects a ray with a triangle \[Möller, Trumbore 1997\], from either side.
fn hit([a, b, c]: [DVec3; 3], ray: &Ray) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let p = ray.direction.cross(v);
    let determinant = u.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from_a = ray.origin - a;
    let along_u = from_a.dot(p) / determinant;
    let q = from_a.cross(u);
    let along_v = ray.direction.dot(q) / determinant;
    let distance = v.dot(q) / determinant;
    (along_u >= 0.0 && along_v >= 0.0 && along_u + along_v <= 1.0 && distance > 0.0).then_some(distance)
}

/// Returns the corner nearest to the camera, which is visible, among the corners within reach of
/// the ray.
fn nearly(solid: &Solid, ray: &Ray, reach: impl Fn(DVec3) -> f64) -> Option<(f64, DVec3)> {
    let along = |point: &DVec3| ((*point - ray.origin).dot(ray.direction), *point);
    let is_near =
        |(distance, point): &(f64, DVec3)| *distance > 0.0 && (*point - ray.at(*distance)).length() < reach(*point);
    solid.vertices.iter().map(along).filter(is_near).min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BodyPart, Look};
    use palpus::body::Body;
    use std::sync::Arc;

    fn cube(at: DVec3, translucent: bool) -> ShownBody {
        let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)) - 0.5;
        let points: Vec<DVec3> = (0..8).map(corner).collect();
        let solid = Arc::new(Solid::of_body(&Body::from_convex(&points).expect("the cube has a hull")));
        ShownBody {
            part: BodyPart::Probe,
            solid,
            pose: Pose::from_translation(at),
            colour: [0; 3],
            look: Look { translucent, ..Look::default() },
        }
    }

    #[test]
    fn nearest_face_is_hit_unless_opaque_body_hides_it() {
        let ray = |x: f64| Ray { origin: DVec3::new(x, 3.0, 10.0), direction: -DVec3::Z };
        let seen_by = |look, x| {
            let mut above = cube(DVec3::new(2.0, 3.0, 4.0), false);
            above.look = look;
            let scene = Scene { bodies: vec![cube(DVec3::new(2.0, 3.0, 0.0), false), above], ..Scene::default() };
            probe_at(&scene, &ray(x), |_| 0.1)
        };
        let pick = |translucent, x| seen_by(Look { translucent, ..Look::default() }, x);
        let on_top = pick(true, 2.25).expect("the cube is hit");
        assert!((on_top - DVec3::new(0.25, 0.0, 0.5)).length() < 1e-12, "{on_top}");
        assert_eq!(pick(false, 2.25), None);
        assert_eq!(
            seen_by(Look { xray: true, ..Look::default() }, 2.25),
            Some(on_top),
            "the visible point must be picked"
        );
        assert_eq!(pick(true, 3.5), None);
    }

    #[test]
    fn nearly_hit_corner_counts() {
        let scene = Scene { bodies: vec![cube(DVec3::ZERO, false)], ..Scene::default() };
        let ray = Ray { origin: DVec3::new(0.55, 0.5, 9.0), direction: -DVec3::Z };
        assert_eq!(probe_at(&scene, &ray, |_| 0.1), Some(DVec3::splat(0.5)));
        assert_eq!(probe_at(&scene, &ray, |_| 0.01), None);
    }
}
