//! A knurled roller: bumps in a diamond pattern around a cylinder.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// Mean radius of [`knurled_roller`], m.
pub const ROLLER_RADIUS: f64 = 0.010;
/// Height of a bump above the mean radius, m.
pub const KNURL_HEIGHT: f64 = 0.0002;

/// Number of bumps around the roller.
const AROUND: f64 = 24.0;
/// Number of bumps along the roller.
const ALONG: f64 = 10.0;
/// Length of the roller, m.
const LENGTH: f64 = 0.026;

/// Returns a roller of 26 mm along y around the origin, with `around` × `along` quads on its side.
/// It has 2 · `around` · (`along` + 1) triangles. The bumps need at least 48 × 20 quads.
pub fn knurled_roller(around: usize, along: usize) -> PolygonSoup {
    let mut surface = Surface::default();
    let rings: Vec<Vec<u32>> = (0..=along)
        .map(|j| {
            let part = j as f64 / along as f64;
            let wave = (TAU * ALONG * part).cos();
            let point = |i: usize| {
                let angle = TAU * i as f64 / around as f64;
                let radius = ROLLER_RADIUS + KNURL_HEIGHT * (AROUND * angle).cos() * wave;
                // The angle runs from z to x, which is counter-clockwise about +y, the direction of
                // the sweep.
                DVec3::new(radius * angle.sin(), LENGTH * (part - 0.5), radius * angle.cos())
            };
            surface.ring((0..around).map(point))
        })
        .collect();
    surface.point_start(&rings[0], DVec3::Y * (-LENGTH / 2.0));
    for pair in rings.windows(2) {
        surface.band(&pair[0], &pair[1]);
    }
    surface.point_end(&rings[along], DVec3::Y * (LENGTH / 2.0));
    surface.finish()
}
