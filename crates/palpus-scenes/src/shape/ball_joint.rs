//! A ball on a stem, and the socket that holds it.

use std::f64::consts::PI;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Radius of the joint's ball, m.
pub const JOINT_RADIUS: f64 = 0.008;
/// Centre of the ball in the frame of [`ball_on_stem`], m.
pub const JOINT_CENTER: DVec3 = DVec3::new(0.0, 0.0, -0.040);

const SIDES: usize = 32;

/// Returns a ball of 8 mm radius below a stem of 3 mm radius along z. The grip is 40 mm above the
/// ball's centre. The shape has 958 triangles.
pub fn ball_on_stem() -> PolygonSoup {
    const STEM_RADIUS: f64 = 0.003;
    const STEM_TOP: f64 = 0.010;
    const RINGS: usize = 14;
    let mut surface = Surface::default();
    let mut ring_at = |radius: f64, z: f64| surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, radius, SIDES, 0.0));
    // Angles are measured from the ball's lowest point.
    let neck = PI - (STEM_RADIUS / JOINT_RADIUS).asin();
    let mut rings: Vec<Vec<u32>> = (1..=RINGS)
        .map(|k| {
            let angle = neck * k as f64 / RINGS as f64;
            ring_at(JOINT_RADIUS * angle.sin(), JOINT_CENTER.z - JOINT_RADIUS * angle.cos())
        })
        .collect();
    rings.push(ring_at(STEM_RADIUS, STEM_TOP));
    surface.point_start(&rings[0], JOINT_CENTER - DVec3::Z * JOINT_RADIUS);
    for pair in rings.windows(2) {
        surface.band(&pair[0], &pair[1]);
    }
    surface.cap_end(&rings[RINGS]);
    surface.finish()
}

/// Returns a socket around the origin that encloses the ball of [`ball_on_stem`] beyond its
/// equator. The ball has a play of at least `play` (m) on every side. The shape has 894 triangles.
pub fn socket(play: f64) -> PolygonSoup {
    const RINGS: usize = 12;
    const OUTER_RADIUS: f64 = 0.013;
    const BOTTOM: f64 = -0.012;
    const MOUTH: f64 = PI * 2.0 / 3.0;
    let step = MOUTH / RINGS as f64;
    // The flat faces of the hollow are nearer to its centre than its corners.
    let radius = (JOINT_RADIUS + play) / ((PI / SIDES as f64).cos() * (step / 2.0).cos());
    let mut surface = Surface::default();
    let mut ring_at = |radius: f64, z: f64| surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, radius, SIDES, 0.0));
    let hollow = |k: usize| {
        let angle = step * k as f64;
        (radius * angle.sin(), -radius * angle.cos())
    };
    let mut rings = vec![ring_at(OUTER_RADIUS, BOTTOM), ring_at(OUTER_RADIUS, hollow(RINGS).1)];
    rings.extend((1..=RINGS).rev().map(|k| {
        let (radius, z) = hollow(k);
        ring_at(radius, z)
    }));
    surface.cap_start(&rings[0]);
    for pair in rings.windows(2) {
        surface.band(&pair[0], &pair[1]);
    }
    surface.point_end(&rings[RINGS + 1], DVec3::Z * -radius);
    surface.finish()
}
