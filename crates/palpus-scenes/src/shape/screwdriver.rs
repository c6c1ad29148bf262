//! A screwdriver that is held at its handle.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Distance from the screwdriver's grip down to the end of its blade, m.
pub const SCREWDRIVER_TIP: f64 = 0.120;
/// Thickness of the screwdriver's blade, m.
pub const BLADE_THICKNESS: f64 = 0.0008;

const BLADE_WIDTH: f64 = 0.005;

/// Returns a flat-bladed screwdriver along z, with its blade across x. The grip is in the middle of
/// its handle. The shape has 92 triangles.
pub fn screwdriver() -> PolygonSoup {
    const BLADE_LENGTH: f64 = 0.003;
    const FLARE: f64 = 0.009;
    const SHAFT_RADIUS: f64 = 0.003;
    const HANDLE_RADIUS: f64 = 0.012;
    const HANDLE_LOW: f64 = -0.045;
    const HANDLE_HIGH: f64 = 0.040;
    let mut surface = Surface::default();
    let tip = surface.ring(blade(-SCREWDRIVER_TIP));
    let shoulder = surface.ring(blade(-SCREWDRIVER_TIP + BLADE_LENGTH));
    let mut octagon = |radius: f64, z: f64| surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, radius, 8, 0.5));
    let rings = [
        octagon(SHAFT_RADIUS, -SCREWDRIVER_TIP + BLADE_LENGTH + FLARE),
        octagon(SHAFT_RADIUS, HANDLE_LOW),
        octagon(HANDLE_RADIUS, HANDLE_LOW),
        octagon(HANDLE_RADIUS, HANDLE_HIGH),
    ];
    // Four of the blade's vertices lie on straight sides, so a fan would have triangles without
    // area.
    for [a, b, c, d] in [[0, 7, 6, 1], [1, 6, 5, 2], [2, 5, 4, 3]] {
        surface.quad([tip[a], tip[b], tip[c], tip[d]]);
    }
    surface.band(&tip, &shoulder);
    surface.band(&shoulder, &rings[0]);
    for pair in rings.windows(2) {
        surface.band(&pair[0], &pair[1]);
    }
    surface.cap_end(&rings[3]);
    surface.finish()
}

/// Returns the blade's outline at height `z` (m). It has eight points, like the octagon above it.
fn blade(z: f64) -> [DVec3; 8] {
    let (wide, thick) = (BLADE_WIDTH / 2.0, BLADE_THICKNESS / 2.0);
    [(1.0, 1.0), (0.4, 1.0), (-0.4, 1.0), (-1.0, 1.0), (-1.0, -1.0), (-0.4, -1.0), (0.4, -1.0), (1.0, -1.0)]
        .map(|(x, y)| DVec3::new(x * wide, y * thick, z))
}
