//! A surface as a scanner leaves it, with as many triangles as one asks for.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::algebra::Random;
use palpus::body::PolygonSoup;

use super::skin::{Skin, circle};
use super::torus::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS};

/// Scanners see each point a little too high or too low: by up to this share of an edge here,
/// so that roughly every second edge is reflex and no smooth part becomes one large convex piece.
const ROUGHNESS: f64 = 0.1;
/// Triangles are about equilateral when the long way round has this many times the points of the
/// short one.
const ASPECT: f64 = TORUS_MAJOR_RADIUS / TORUS_MINOR_RADIUS;

/// The [`torus`](super::torus) again, as a scan of about `triangles` triangles (at least 100), each
/// point off by noise that is the same on every call.
pub fn scanned_torus(triangles: usize) -> PolygonSoup {
    let sides = ((triangles.max(100) as f64 / (2.0 * ASPECT)).sqrt().round() as usize).max(3);
    let sections = (triangles.max(100) as f64 / (2.0 * sides as f64)).round() as usize;
    let edge = TAU * TORUS_MINOR_RADIUS / sides as f64;
    let mut skin = Skin::default();
    let mut random = Random::new(0);
    let rings: Vec<_> = (0..sections)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / sections as f64).sin_cos();
            let radial = DVec3::new(cos, sin, 0.0);
            let center = radial * TORUS_MAJOR_RADIUS;
            skin.ring(
                circle(center, DVec3::Z, radial, TORUS_MINOR_RADIUS, sides, 0.0)
                    .map(|point| point + (point - center) * (ROUGHNESS * edge / TORUS_MINOR_RADIUS * random.signed())),
            )
        })
        .collect();
    for k in 0..sections {
        skin.band(&rings[k], &rings[(k + 1) % sections]);
    }
    skin.finish()
}
