//! A surface as a scanner leaves it, with as many triangles as one asks for.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::skin::{Skin, circle};
use super::torus::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS};

/// Scanners see each point a little too high or too low: by up to this share of an edge here, so that roughly every second
/// edge is reflex and no smooth part becomes one large convex piece.
const ROUGHNESS: f64 = 0.1;
/// Triangles are about equilateral when the long way round has this many times the points of the short one.
const ASPECT: f64 = TORUS_MAJOR_RADIUS / TORUS_MINOR_RADIUS;

/// The [`torus`](super::torus) again, as a scan of about `triangles` triangles (at least 100), each point off by noise that
/// is the same on every call.
pub fn scanned_torus(triangles: usize) -> PolygonSoup {
    let sides = ((triangles.max(100) as f64 / (2.0 * ASPECT)).sqrt().round() as usize).max(3);
    let sections = (triangles.max(100) as f64 / (2.0 * sides as f64)).round() as usize;
    let edge = TAU * TORUS_MINOR_RADIUS / sides as f64;
    let mut skin = Skin::default();
    let mut index = 0;
    let rings: Vec<_> = (0..sections)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / sections as f64).sin_cos();
            let radial = DVec3::new(cos, sin, 0.0);
            let center = radial * TORUS_MAJOR_RADIUS;
            skin.ring(circle(center, DVec3::Z, radial, TORUS_MINOR_RADIUS, sides, 0.0).map(|point| {
                index += 1;
                point + (point - center) * (ROUGHNESS * edge / TORUS_MINOR_RADIUS * noise(index))
            }))
        })
        .collect();
    for k in 0..sections {
        skin.band(&rings[k], &rings[(k + 1) % sections]);
    }
    skin.finish()
}

/// In \[−1, 1), of a number: SplitMix64's output.
fn noise(index: u64) -> f64 {
    let z = index.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
