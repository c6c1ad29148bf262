//! A spoon: a bowl with a real cavity, and a handle. It has 336 triangles, like the model in the
//! paper's Table 1.
//!
//! The surface consists of cross-sections at fixed x with twelve vertices each, from the end of the
//! handle to the tip of the bowl. The sections lie in parallel planes and none intersects itself,
//! so the surface cannot intersect itself.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// The tip of the bowl in the spoon's frame, m.
pub const SPOON_TIP: DVec3 = DVec3::new(0.070, 0.0, -0.0066);

/// One cross-section; all values are in mm. The values in order: position along x; half the width;
/// height of the edges; height of the upper side's middle above the edges (negative: a cavity);
/// depth of the lower side's middle below the edges; thickness at the edges.
struct Section(f64, f64, f64, f64, f64, f64);

const SECTIONS: [Section; 14] = [
    Section(-49.0, 3.5, 0.6, 0.6, 0.5, 1.0),
    Section(-44.0, 6.0, 0.6, 0.8, 0.7, 1.0),
    Section(-30.0, 5.0, 0.6, 0.8, 0.7, 1.1),
    Section(-20.0, 4.2, 0.6, 0.8, 0.7, 1.15),
    Section(-8.0, 3.5, 0.6, 0.8, 0.7, 1.2),
    Section(8.0, 2.9, 0.6, 0.8, 0.7, 1.4),
    Section(20.0, 2.6, -2.0, 0.6, 0.8, 1.5),
    Section(28.0, 3.4, -5.0, 0.2, 1.2, 1.4),
    Section(33.0, 9.0, -6.0, -3.2, 3.6, 1.2),
    Section(40.0, 12.8, -6.0, -6.4, 6.7, 1.2),
    Section(48.0, 14.0, -6.0, -7.4, 7.7, 1.2),
    Section(57.0, 12.6, -6.0, -6.3, 6.6, 1.2),
    Section(65.0, 8.2, -6.0, -3.0, 3.3, 1.2),
    Section(69.2, 3.0, -6.0, -0.5, 0.8, 1.2),
];

/// Positions of a section's vertices across, from edge to edge, as fractions of half the width.
const ACROSS: [f64; 6] = [-1.0, -0.62, -0.22, 0.22, 0.62, 1.0];

/// Returns a spoon of 120 mm along x with its tip at [`SPOON_TIP`]. The cavity of the bowl opens
/// toward +z. The grip is on the handle, at the origin. The shape has 336 triangles.
pub fn spoon() -> PolygonSoup {
    let mut surface = Surface::default();
    let rings: Vec<_> = SECTIONS.iter().map(|section| surface.ring(outline(section))).collect();
    surface.point_start(&rings[0], DVec3::new(-0.050, 0.0, 0.0));
    for pair in rings.windows(2) {
        surface.band(&pair[0], &pair[1]);
    }
    surface.point_end(&rings[13], SPOON_TIP);
    surface.finish()
}

/// Returns the outline, counter-clockwise about +x: the lower side from left to right, then the
/// upper side back.
fn outline(&Section(x, half_width, edge, crown, belly, thickness): &Section) -> impl Iterator<Item = DVec3> {
    let at = move |s: f64, z: f64| DVec3::new(x, s * half_width, z) * 1e-3;
    let lower = ACROSS.iter().map(move |&s| at(s, edge - thickness - belly * (1.0 - s * s)));
    let upper = ACROSS.iter().rev().map(move |&s| at(s, edge + crown * (1.0 - s * s)));
    lower.chain(upper)
}
