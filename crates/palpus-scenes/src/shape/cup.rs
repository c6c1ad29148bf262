//! A cup: a real cavity, a wall of 3 mm and a handle, 500 triangles as in the paper's Table 1,
//! genus 1.
//!
//! 1. A profile is turned about z through 16 steps: up the outer wall, over the rim, down the inner
//!    wall to the floor.
//! 2. Two patches of the outer wall, one step wide and two rows high, are left open: each is
//!    bounded by six vertices.
//! 3. A hexagonal tube bridges the two openings: its first and last rings *are* the openings'
//!    boundaries, so the handle is joined as topology, not by overlap.

use std::f64::consts::PI;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::skin::{Skin, circle};

/// From the table to the rim, m.
pub const CUP_HEIGHT: f64 = 0.070;
/// Height of the cavity's floor above the table, m.
pub const CUP_FLOOR: f64 = 0.005;

/// Thickness of the wall at the rim, m.
pub const CUP_WALL: f64 = 0.003;

const SIDES: usize = 16;

/// Outer wall upwards, then inner wall downwards: (radius, height), mm.
const PROFILE: [(f64, f64); 13] = [
    (24.0, 0.0),
    (30.0, 15.0),
    (31.4, 21.0),
    (32.5, 27.0),
    (34.4, 45.0),
    (34.8, 51.0),
    (35.0, 57.0),
    (35.0, 70.0),
    (32.0, 70.0),
    (31.7, 51.0),
    (30.0, 30.0),
    (27.4, 15.0),
    (21.0, 5.0),
];

/// The row of the profile at which the lower opening begins; it is two rows high.
const LOWER_OPENING: usize = 1;
/// The row at which the upper opening begins.
const UPPER_OPENING: usize = 4;
/// The quad of each row that faces +x.
const HANDLE_SIDE: usize = SIDES - 1;

/// A cup standing on z = 0, its axis along z, its handle towards +x; 70 mm wide and high: 500
/// triangles, genus 1.
pub fn cup() -> PolygonSoup {
    let mut skin = Skin::default();
    let rings: Vec<_> = PROFILE
        .iter()
        .map(|&(r, z)| skin.ring(circle(DVec3::Z * z * 1e-3, DVec3::X, DVec3::Y, r * 1e-3, SIDES, 0.5)))
        .collect();
    skin.cap_start(&rings[0]);
    for row in 0..rings.len() - 1 {
        let open = [LOWER_OPENING, UPPER_OPENING].iter().any(|&first| (first..first + 2).contains(&row));
        skin.band_where(&rings[row], &rings[row + 1], |k| !(open && k == HANDLE_SIDE));
    }
    // The floor of the cavity faces up, which is the far end of the sweep that has turned downward:
    // a ring that is counter-clockwise about +z.
    skin.cap_end(&rings[12]);
    add_handle(&mut skin, &rings);
    skin.finish()
}

/// Radius of the cavity at height `z` (m), along its flats: how far from the axis a point may go
/// before it meets the wall.
pub fn cup_inner_radius(z: f64) -> f64 {
    let z = z * 1e3;
    let inner = &PROFILE[8..];
    let along = |k: usize| {
        let ((r0, z0), (r1, z1)) = (inner[k], inner[k + 1]);
        r0 + (r1 - r0) * ((z - z0) / (z1 - z0)).clamp(0.0, 1.0)
    };
    let k = (0..inner.len() - 2).find(|&k| z >= inner[k + 1].1).unwrap_or(inner.len() - 2);
    along(k) * (PI / SIDES as f64).cos() * 1e-3
}

/// The six vertices around an opening, counter-clockwise about the handle's direction of sweep;
/// `inward` is the row that lies on the inner side of the handle's bow.
fn opening(rings: &[Vec<u32>], outward_row: usize, inward_row: usize) -> [u32; 6] {
    let middle_row = (outward_row + inward_row) / 2;
    // Side −y is the last vertex of a ring, side +y the first.
    let (minus, plus) = (SIDES - 1, 0);
    [
        rings[outward_row][minus],
        rings[outward_row][plus],
        rings[middle_row][plus],
        rings[inward_row][plus],
        rings[inward_row][minus],
        rings[middle_row][minus],
    ]
}

/// The tube from the lower opening out, up and back into the upper one.
fn add_handle(skin: &mut Skin, rings: &[Vec<u32>]) {
    // Centre of each ring (x, z), mm, and its direction of sweep as an angle from +x towards +z.
    const BOW: [(f64, f64, f64); 7] = [
        (42.0, 20.5, 5.0),
        (49.5, 22.5, 30.0),
        (55.0, 28.0, 60.0),
        (57.0, 36.5, 90.0),
        (55.0, 45.0, 120.0),
        (49.5, 50.0, 150.0),
        (42.0, 51.8, 175.0),
    ];
    // Half the tube's size across the bow, and along y at the corners and at the middle, mm.
    const HALF_HEIGHT: f64 = 3.2;
    const HALF_WIDTH: f64 = 3.4;
    const HALF_WAIST: f64 = 4.6;
    let mut previous = opening(rings, LOWER_OPENING, LOWER_OPENING + 2).to_vec();
    for (x, z, angle) in BOW {
        let (sin, cos) = f64::to_radians(angle).sin_cos();
        let inward = DVec3::new(-sin, 0.0, cos);
        let at = |y: f64, w: f64| (DVec3::new(x, y, z) + inward * w) * 1e-3;
        let ring = skin.ring([
            at(-HALF_WIDTH, -HALF_HEIGHT),
            at(HALF_WIDTH, -HALF_HEIGHT),
            at(HALF_WAIST, 0.0),
            at(HALF_WIDTH, HALF_HEIGHT),
            at(-HALF_WIDTH, HALF_HEIGHT),
            at(-HALF_WAIST, 0.0),
        ]);
        skin.band(&previous, &ring);
        previous = ring;
    }
    skin.band(&previous, &opening(rings, UPPER_OPENING + 2, UPPER_OPENING));
}
