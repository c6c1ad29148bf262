//! A cup with a real cavity, a wall of 3 mm and a handle. It has 500 triangles, like the model in
//! the paper's Table 1, and genus 1.
//!
//! 1. Turn a profile about z in 16 steps: up the outer wall, over the rim, down the inner wall to
//!    the floor.
//! 2. Leave two openings in the outer wall, one step wide and two rows high. Each opening has six
//!    vertices.
//! 3. Connect the two openings by a hexagonal tube. Its first and last rings are the boundaries of
//!    the openings, so the handle is connected to the wall without overlap.

use std::f64::consts::PI;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Height of the rim above the table, m.
pub const CUP_HEIGHT: f64 = 0.070;
/// Height of the cavity's floor above the table, m.
pub const CUP_FLOOR: f64 = 0.005;

/// Thickness of the wall at the rim, m.
pub const CUP_WALL: f64 = 0.003;

const SIDES: usize = 16;

/// Points (radius, height) of the outer wall upward, then of the inner wall downward, mm.
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

/// Row of the profile at which the lower opening begins. The opening is two rows high.
const LOWER_OPENING: usize = 1;
/// Row at which the upper opening begins.
const UPPER_OPENING: usize = 4;
/// The quad of each row that faces +x.
const HANDLE_SIDE: usize = SIDES - 1;

/// Returns a cup that stands on z = 0, with its axis along z and its handle toward +x. It is 70 mm
/// wide and high. The shape has 500 triangles and genus 1.
pub fn cup() -> PolygonSoup {
    let mut surface = Surface::default();
    let rings: Vec<_> = PROFILE
        .iter()
        .map(|&(r, z)| surface.ring(circle(DVec3::Z * z * 1e-3, DVec3::X, DVec3::Y, r * 1e-3, SIDES, 0.5)))
        .collect();
    surface.cap_start(&rings[0]);
    for row in 0..rings.len() - 1 {
        let open = [LOWER_OPENING, UPPER_OPENING].iter().any(|&first| (first..first + 2).contains(&row));
        surface.band_where(&rings[row], &rings[row + 1], |k| !(open && k == HANDLE_SIDE));
    }
    // The floor of the cavity faces up. It is the far end of the sweep.
    surface.cap_end(&rings[12]);
    add_handle(&mut surface, &rings);
    surface.finish()
}

/// Returns the distance (m) from the axis to the flat faces of the cavity at height `z` (m). A
/// point within this distance of the axis does not touch the wall.
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

/// Returns the six vertices around an opening, counter-clockwise about the direction in which the
/// handle is swept. `inward_row` is on the inner side of the handle's bow.
fn opening(rings: &[Vec<u32>], outward_row: usize, inward_row: usize) -> [u32; 6] {
    let middle_row = (outward_row + inward_row) / 2;
    // The side −y is the last vertex of a ring, and the side +y is the first.
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

/// Adds the tube from the lower opening out, up and back into the upper opening.
fn add_handle(surface: &mut Surface, rings: &[Vec<u32>]) {
    // Centre (x, z) of each ring, mm, and the direction of the sweep there as an angle from +x
    // toward +z (degrees).
    const BOW: [(f64, f64, f64); 7] = [
        (42.0, 20.5, 5.0),
        (49.5, 22.5, 30.0),
        (55.0, 28.0, 60.0),
        (57.0, 36.5, 90.0),
        (55.0, 45.0, 120.0),
        (49.5, 50.0, 150.0),
        (42.0, 51.8, 175.0),
    ];
    // Half the size of the tube's cross-section, mm: across the bow, along y at its corners, and
    // along y at its middle.
    const HALF_HEIGHT: f64 = 3.2;
    const HALF_WIDTH: f64 = 3.4;
    const HALF_WAIST: f64 = 4.6;
    let mut previous = opening(rings, LOWER_OPENING, LOWER_OPENING + 2).to_vec();
    for (x, z, angle) in BOW {
        let (sin, cos) = f64::to_radians(angle).sin_cos();
        let inward = DVec3::new(-sin, 0.0, cos);
        let at = |y: f64, w: f64| (DVec3::new(x, y, z) + inward * w) * 1e-3;
        let ring = surface.ring([
            at(-HALF_WIDTH, -HALF_HEIGHT),
            at(HALF_WIDTH, -HALF_HEIGHT),
            at(HALF_WAIST, 0.0),
            at(HALF_WIDTH, HALF_HEIGHT),
            at(-HALF_WIDTH, HALF_HEIGHT),
            at(-HALF_WAIST, 0.0),
        ]);
        surface.band(&previous, &ring);
        previous = ring;
    }
    surface.band(&previous, &opening(rings, UPPER_OPENING + 2, UPPER_OPENING));
}
