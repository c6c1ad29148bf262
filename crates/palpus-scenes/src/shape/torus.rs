//! A torus: the paper's first test model, 2000 triangles.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Distance from the axis to the tube's centre line, m.
pub const TORUS_MAJOR_RADIUS: f64 = 0.040;
/// Radius of the tube, m.
pub const TORUS_MINOR_RADIUS: f64 = 0.012;

const SECTIONS: usize = 50;
const SIDES: usize = 20;

/// Returns a torus around the z axis, with its centre at the origin. The shape has 2000 triangles.
pub fn torus() -> PolygonSoup {
    let mut surface = Surface::default();
    let rings: Vec<_> = (0..SECTIONS)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / SECTIONS as f64).sin_cos();
            let radial = DVec3::new(cos, sin, 0.0);
            surface.ring(circle(radial * TORUS_MAJOR_RADIUS, DVec3::Z, radial, TORUS_MINOR_RADIUS, SIDES, 0.0))
        })
        .collect();
    for k in 0..SECTIONS {
        surface.band(&rings[k], &rings[(k + 1) % SECTIONS]);
    }
    surface.finish()
}
