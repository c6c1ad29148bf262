//! A surface with the noise of a scanner, with any number of triangles.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::algebra::Random;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};
use super::torus::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS};

/// Largest error of a point, as a fraction of the edge length. Scanners measure each point a little
/// too high or too low. With this value, about half of the edges are reflex, so no smooth part
/// becomes one large convex piece.
const ROUGHNESS: f64 = 0.1;
/// Number of points around the ring, divided by the number of points around the tube. With this
/// ratio, triangles are about equilateral.
const ASPECT: f64 = TORUS_MAJOR_RADIUS / TORUS_MINOR_RADIUS;

/// Returns the [`torus`](super::torus) as a scan of about `triangles` triangles (at least 100).
/// Each point has noise. Every call returns the same shape.
pub fn scanned_torus(triangles: usize) -> PolygonSoup {
    let sides = ((triangles.max(100) as f64 / (2.0 * ASPECT)).sqrt().round() as usize).max(3);
    let sections = (triangles.max(100) as f64 / (2.0 * sides as f64)).round() as usize;
    let edge = TAU * TORUS_MINOR_RADIUS / sides as f64;
    let mut surface = Surface::default();
    let mut random = Random::new(0);
    let rings: Vec<_> = (0..sections)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / sections as f64).sin_cos();
            let radial = DVec3::new(cos, sin, 0.0);
            let center = radial * TORUS_MAJOR_RADIUS;
            surface.ring(
                circle(center, DVec3::Z, radial, TORUS_MINOR_RADIUS, sides, 0.0)
                    .map(|point| point + (point - center) * (ROUGHNESS * edge / TORUS_MINOR_RADIUS * random.signed())),
            )
        })
        .collect();
    for k in 0..sections {
        surface.band(&rings[k], &rings[(k + 1) % sections]);
    }
    surface.finish()
}
