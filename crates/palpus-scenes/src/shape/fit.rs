//! Parts that fit into each other with flush faces: channel, sleeve, key, square peg.
//!
//! A sleeve or a channel holds the other part. The play is the gap on each side.

use glam::{DVec2, DVec3};
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// Cross-section of a [`channel`] in the yz plane, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelSection {
    /// Half the width of the slot.
    pub half_gap: f64,
    /// Half the width of the block.
    pub half_width: f64,
    /// z of the slot's floor; the top of the block is z = 0.
    pub floor: f64,
    /// z of the block's lower face.
    pub bottom: f64,
}

/// Returns a block of `length` (m) along x. Its top lies in the plane z = 0 and has a slot along x.
/// The shape has 28 triangles.
pub fn channel(length: f64, section: &ChannelSection) -> PolygonSoup {
    let ChannelSection { half_gap: gap, half_width: wide, floor, bottom } = *section;
    // The points are counter-clockwise about +x, the direction of the sweep.
    let profile = |x: f64| {
        [
            (-wide, bottom),
            (wide, bottom),
            (wide, 0.0),
            (gap, 0.0),
            (gap, floor),
            (-gap, floor),
            (-gap, 0.0),
            (-wide, 0.0),
        ]
        .map(|(y, z)| DVec3::new(x, y, z))
    };
    let mut surface = Surface::default();
    let (near, far) = (surface.ring(profile(-length / 2.0)), surface.ring(profile(length / 2.0)));
    surface.band(&near, &far);
    // The ends are not convex, so they are divided into two walls and the base.
    for [a, b, c] in [[1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7], [0, 1, 4], [0, 4, 5]] {
        surface.triangle(far[a], far[b], far[c]);
        surface.triangle(near[a], near[c], near[b]);
    }
    surface.finish()
}

/// Returns a block with side lengths `outer` (m) and its top in the plane z = 0. A rectangular hole
/// with side lengths `hole` (m) goes through it along the z axis. The shape has 32 triangles and
/// genus 1.
pub fn sleeve(outer: DVec3, hole: DVec2) -> PolygonSoup {
    let mut surface = Surface::default();
    let mut level = |z: f64| (surface.ring(rectangle(outer.truncate(), z)), surface.ring(rectangle(hole, z)));
    let (outer_low, hole_low) = level(-outer.z);
    let (outer_top, hole_top) = level(0.0);
    surface.band(&outer_low, &outer_top);
    surface.band(&outer_top, &hole_top);
    surface.band(&hole_top, &hole_low);
    surface.band(&hole_low, &outer_low);
    surface.finish()
}

/// Side length of the key's square shaft, m.
pub const KEY_SIDE: f64 = 0.006;
/// Distance from the key's grip down to the end of its shaft, m.
pub const KEY_TIP: f64 = 0.050;

/// Returns a key along z: a square shaft of 6 mm below a bow of 20 mm × 8 mm. The grip is in the
/// middle of the bow. The shape has 28 triangles.
pub fn key() -> PolygonSoup {
    const BOW: DVec2 = DVec2::new(0.020, 0.008);
    const BOW_HALF_HEIGHT: f64 = 0.010;
    let mut surface = Surface::default();
    let mut ring_at = |sides: DVec2, z: f64| surface.ring(rectangle(sides, z));
    let shaft = DVec2::splat(KEY_SIDE);
    let (tip, neck) = (ring_at(shaft, -KEY_TIP), ring_at(shaft, -BOW_HALF_HEIGHT));
    let (low, high) = (ring_at(BOW, -BOW_HALF_HEIGHT), ring_at(BOW, BOW_HALF_HEIGHT));
    surface.cap_start(&tip);
    surface.band(&tip, &neck);
    surface.band(&neck, &low);
    surface.band(&low, &high);
    surface.cap_end(&high);
    surface.finish()
}

/// Side lengths of the square peg's cross-section, m.
pub const SQUARE_PEG: DVec2 = DVec2::new(0.010, 0.006);

/// Returns a rectangular peg along z, 50 mm long, with a 0.5 mm chamfer at its lower end. The grip
/// is 40 mm above [`super::PEG_TIP`]. The shape has 20 triangles.
pub fn square_peg() -> PolygonSoup {
    const LENGTH: f64 = 0.050;
    const CHAMFER: f64 = 0.0005;
    let mut surface = Surface::default();
    let mut ring_at = |sides: DVec2, height: f64| surface.ring(rectangle(sides, super::PEG_TIP.z + height));
    let tip = ring_at(SQUARE_PEG - 2.0 * CHAMFER, 0.0);
    let (shoulder, top) = (ring_at(SQUARE_PEG, CHAMFER), ring_at(SQUARE_PEG, LENGTH));
    surface.cap_start(&tip);
    surface.band(&tip, &shoulder);
    surface.band(&shoulder, &top);
    surface.cap_end(&top);
    surface.finish()
}

/// Returns `soup`, rotated so that its z axis becomes x, its x axis becomes y, and its y axis
/// becomes z.
pub fn along_x(mut soup: PolygonSoup) -> PolygonSoup {
    for vertex in &mut soup.vertices {
        *vertex = DVec3::new(vertex.z, vertex.x, vertex.y);
    }
    soup
}

/// Returns a rectangle around the z axis at height `z`, counter-clockwise about +z.
fn rectangle(sides: DVec2, z: f64) -> [DVec3; 4] {
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .map(|(x, y)| DVec3::new(x * sides.x / 2.0, y * sides.y / 2.0, z))
}
