//! A block with a V-shaped groove.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// Depth of the groove below the block's top, m. Half the width of the groove equals its depth, so
/// its angle is 90°.
pub const GROOVE_DEPTH: f64 = 0.020;

/// Returns a solid block of 80 mm × 120 mm × 40 mm with a right-angled V groove along y. The top of
/// the block lies in the plane z = 0. The bottom of the groove is at x = 0, z = −[`GROOVE_DEPTH`].
/// The shape has 24 triangles.
pub fn v_groove() -> PolygonSoup {
    const HALF_WIDTH: f64 = 0.040;
    const HALF_LENGTH: f64 = 0.060;
    const HEIGHT: f64 = 0.040;
    // The points are counter-clockwise about +y, the direction of the sweep.
    let profile = [
        (-HALF_WIDTH, -HEIGHT),
        (-HALF_WIDTH, 0.0),
        (-GROOVE_DEPTH, 0.0),
        (0.0, -GROOVE_DEPTH),
        (GROOVE_DEPTH, 0.0),
        (HALF_WIDTH, 0.0),
        (HALF_WIDTH, -HEIGHT),
    ];
    let mut surface = Surface::default();
    let near = surface.ring(profile.map(|(x, z)| DVec3::new(x, -HALF_LENGTH, z)));
    let far = surface.ring(profile.map(|(x, z)| DVec3::new(x, HALF_LENGTH, z)));
    surface.band(&near, &far);
    // The ends are not convex. Each end is divided so that no triangle spans the groove.
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 6], [3, 4, 6], [4, 5, 6]] {
        surface.triangle(far[a], far[b], far[c]);
        surface.triangle(near[a], near[c], near[b]);
    }
    surface.finish()
}
