//! A spur gear with involute flanks.
//!
//! 1. Each tooth has two flanks of [`FLANK`] points. Above the base circle the flank is the
//!    involute. Below it the tooth widens a little, like a fillet.
//! 2. The outline is swept along y. Each end face is divided into strips in the teeth, and a fan in
//!    the disc within the roots.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::Surface;

/// Number of teeth of [`gear`].
pub const GEAR_TEETH: usize = 16;
/// Radius of the pitch circle, m. Two gears mesh if their axes are twice this distance apart.
pub const GEAR_PITCH_RADIUS: f64 = MODULE * GEAR_TEETH as f64 / 2.0;
/// Play between the flanks of two meshing gears, along the pitch circle, m.
pub const GEAR_BACKLASH: f64 = 0.0002;

const MODULE: f64 = 0.002;
const PRESSURE_ANGLE: f64 = 20.0 * PI / 180.0;
/// Radius of the tips, m. It is slightly reduced, so that tips do not touch the roots of the other
/// gear.
const TIP_RADIUS: f64 = GEAR_PITCH_RADIUS + 0.9 * MODULE;
/// Radius of the roots between the teeth, m.
const ROOT_RADIUS: f64 = GEAR_PITCH_RADIUS - 1.25 * MODULE;
/// Half of the gear's width, m.
const HALF_WIDTH: f64 = 0.005;
/// Number of points of a flank, from root to tip.
const FLANK: usize = 8;
/// Widening of the tooth below the base circle, relative to the distance below it.
const FILLET: f64 = 0.3;

/// Returns a gear of 16 teeth around the origin, with module 2 mm and a width of 10 mm along y. The
/// middle of one tooth points toward +z. The shape has 1024 triangles.
pub fn gear() -> PolygonSoup {
    let mut surface = Surface::default();
    let near = surface.ring(outline(-HALF_WIDTH));
    let far = surface.ring(outline(HALF_WIDTH));
    surface.band(&near, &far);
    face(&mut surface, &far, HALF_WIDTH, false);
    face(&mut surface, &near, -HALF_WIDTH, true);
    surface.finish()
}

/// Returns the outline, counter-clockwise about +y: for each tooth the rising flank, then the
/// falling flank.
fn outline(y: f64) -> impl Iterator<Item = DVec3> {
    (0..GEAR_TEETH).flat_map(move |tooth| {
        let middle = TAU * tooth as f64 / GEAR_TEETH as f64;
        (0..2 * FLANK).map(move |k| {
            let (place, side) = if k < FLANK { (k, -1.0) } else { (2 * FLANK - 1 - k, 1.0) };
            let radius = ROOT_RADIUS + (TIP_RADIUS - ROOT_RADIUS) * place as f64 / (FLANK - 1) as f64;
            let (sin, cos) = (middle + side * half_angle(radius)).sin_cos();
            DVec3::new(radius * sin, y, radius * cos)
        })
    })
}

/// Returns half the angle that a tooth takes at `radius` (m), rad.
fn half_angle(radius: f64) -> f64 {
    let involute = |angle: f64| angle.tan() - angle;
    let base = GEAR_PITCH_RADIUS * PRESSURE_ANGLE.cos();
    let at_pitch = FRAC_PI_2 / GEAR_TEETH as f64 - GEAR_BACKLASH / (4.0 * GEAR_PITCH_RADIUS) + involute(PRESSURE_ANGLE);
    if radius < base { at_pitch + FILLET * (base - radius) / base } else { at_pitch - involute((base / radius).acos()) }
}

fn face(surface: &mut Surface, ring: &[u32], y: f64, backward: bool) {
    let mut roots = Vec::with_capacity(2 * GEAR_TEETH);
    for tooth in ring.chunks(2 * FLANK) {
        for k in 0..FLANK - 1 {
            let [a, b, c, d] = [tooth[k], tooth[k + 1], tooth[2 * FLANK - 2 - k], tooth[2 * FLANK - 1 - k]];
            surface.quad(if backward { [d, c, b, a] } else { [a, b, c, d] });
        }
        roots.extend([tooth[0], tooth[2 * FLANK - 1]]);
    }
    let center = DVec3::Y * y;
    if backward { surface.point_start(&roots, center) } else { surface.point_end(&roots, center) }
}
