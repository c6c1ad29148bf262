//! Two ridges that converge, and the knife that lies across them.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// Half the length of the rails along y, m.
const HALF_LENGTH: f64 = 0.030;
/// Half the distance between the ridges at their two ends, m.
const WIDE: f64 = 0.005;
const NARROW: f64 = 0.0010;
/// Half the width of a ridge, m.
const RIDGE_HALF_WIDTH: f64 = 0.0005;
/// Height of a ridge, m.
const RIDGE_HEIGHT: f64 = 0.001;

/// Returns half the distance between the two ridges at `y`, m.
pub fn rails_half_gap(y: f64) -> f64 {
    WIDE + (NARROW - WIDE) * (y / HALF_LENGTH + 1.0) / 2.0
}

/// Returns a block with two sharp ridges along y. The ridges converge toward +y, and their edges
/// lie in the plane z = 0. The shape has 36 triangles.
pub fn rails() -> PolygonSoup {
    const HALF_WIDTH: f64 = 0.020;
    const BOTTOM: f64 = -0.010;
    // The points are counter-clockwise about +y, the direction of the sweep.
    let profile = |y: f64| {
        let (gap, side, floor) = (rails_half_gap(y), RIDGE_HALF_WIDTH, -RIDGE_HEIGHT);
        [
            (-HALF_WIDTH, BOTTOM),
            (-HALF_WIDTH, floor),
            (-gap - side, floor),
            (-gap, 0.0),
            (-gap + side, floor),
            (gap - side, floor),
            (gap, 0.0),
            (gap + side, floor),
            (HALF_WIDTH, floor),
            (HALF_WIDTH, BOTTOM),
        ]
        .map(|(x, z)| DVec3::new(x, y, z))
    };
    let mut surface = Surface::default();
    let near = surface.ring(profile(-HALF_LENGTH));
    let far = surface.ring(profile(HALF_LENGTH));
    surface.band(&near, &far);
    // The ends are not convex, so the ridges are cut off first.
    for [a, b, c] in [[2, 3, 4], [5, 6, 7], [0, 1, 2], [0, 2, 4], [0, 4, 5], [0, 5, 7], [0, 7, 8], [0, 8, 9]] {
        surface.triangle(far[a], far[b], far[c]);
        surface.triangle(near[a], near[c], near[b]);
    }
    surface.finish()
}

/// Distance from the knife's grip down to its edge, m.
pub const KNIFE_DEPTH: f64 = 0.010;

/// Returns a blunt blade, 30 mm along x, with its edge [`KNIFE_DEPTH`] below the grip. The shape
/// has 8 triangles.
pub fn knife() -> PolygonSoup {
    const HALF_LENGTH: f64 = 0.015;
    const HALF_WIDTH: f64 = 0.004;
    let mut surface = Surface::default();
    let mut ring_at = |x: f64| {
        surface.ring(
            [(0.0, -KNIFE_DEPTH), (HALF_WIDTH, KNIFE_DEPTH), (-HALF_WIDTH, KNIFE_DEPTH)]
                .map(|(y, z)| DVec3::new(x, y, z)),
        )
    };
    let (start, end) = (ring_at(-HALF_LENGTH), ring_at(HALF_LENGTH));
    surface.cap_start(&start);
    surface.band(&start, &end);
    surface.cap_end(&end);
    surface.finish()
}
