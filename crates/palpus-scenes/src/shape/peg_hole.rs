//! A round peg, and the block with its hole.
//!
//! The cross-sections of both are 32-gons with the same angles. The diameter of the hole's
//! inscribed circle exceeds the diameter of the peg's circumscribed circle by the clearance. So the
//! peg fits at any rotation about its axis.

use std::f64::consts::PI;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Radius of the peg's circumscribed circle, m (an 8 mm peg).
pub const PEG_RADIUS: f64 = 0.004;
/// Hole diameter minus peg diameter, m: 0.05 mm for 8 mm.
pub const DEFAULT_CLEARANCE: f64 = 0.05e-3;
/// Middle of the peg's lower face in the peg's frame, m.
pub const PEG_TIP: DVec3 = DVec3::new(0.0, 0.0, -0.040);

const SIDES: usize = 32;

/// Returns an 8 mm peg along z, 50 mm long, with a 0.5 mm chamfer at its lower end. The grip is 40
/// mm above [`PEG_TIP`]. The shape has 188 triangles.
pub fn peg() -> PolygonSoup {
    const LENGTH: f64 = 0.050;
    const CHAMFER: f64 = 0.0005;
    let mut surface = Surface::default();
    let mut ring_at = |height: f64, radius: f64| {
        surface.ring(circle(PEG_TIP + DVec3::Z * height, DVec3::X, DVec3::Y, radius, SIDES, 0.0))
    };
    let tip = ring_at(0.0, PEG_RADIUS - CHAMFER);
    let shoulder = ring_at(CHAMFER, PEG_RADIUS);
    let top = ring_at(LENGTH, PEG_RADIUS);
    surface.cap_start(&tip);
    surface.band(&tip, &shoulder);
    surface.band(&shoulder, &top);
    surface.cap_end(&top);
    surface.finish()
}

/// Returns a block of 40 mm × 40 mm × 25 mm with its top in the plane z = 0. A hole goes through it
/// along the z axis, and leaves a diametral `clearance` (m) around [`peg`]. The shape has 144
/// triangles and genus 1.
pub fn hole_block(clearance: f64) -> PolygonSoup {
    const HALF_SIDE: f64 = 0.020;
    const HEIGHT: f64 = 0.025;
    let inscribed = PEG_RADIUS + clearance / 2.0;
    let circumscribed = inscribed / (PI / SIDES as f64).cos();
    let mut surface = Surface::default();
    let square = |z| {
        [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, y)| DVec3::new(x * HALF_SIDE, y * HALF_SIDE, z))
    };
    let mut level = |z: f64| {
        let outline = surface.ring(square(z));
        let mouth = surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, circumscribed, SIDES, 0.0));
        (outline, mouth)
    };
    let (low_outline, low_mouth) = level(-HEIGHT);
    let (top_outline, top_mouth) = level(0.0);
    surface.band(&low_outline, &top_outline);
    // The wall of the hole faces the axis, so its band is swept downward.
    surface.band(&top_mouth, &low_mouth);
    frame(&mut surface, &top_outline, &top_mouth, false);
    frame(&mut surface, &low_outline, &low_mouth, true);
    surface.finish()
}

/// Adds the flat face between the square and the round hole. Each corner has a fan over its
/// quarter of the hole, and one triangle per side connects two corners. The face points toward +z,
/// or toward −z if `downward`.
fn frame(surface: &mut Surface, outline: &[u32], mouth: &[u32], downward: bool) {
    let quarter = SIDES / 4;
    let mut put = |a, b, c| if downward { surface.triangle(a, c, b) } else { surface.triangle(a, b, c) };
    for corner in 0..4 {
        for k in corner * quarter..(corner + 1) * quarter {
            put(outline[corner], mouth[(k + 1) % SIDES], mouth[k]);
        }
        let next = (corner + 1) % 4;
        put(outline[corner], outline[next], mouth[next * quarter]);
    }
}
