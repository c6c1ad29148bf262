//! A spur gear with involute flanks.
//!
//! 1. Each tooth has two flanks of [`FLANK`] points; where the flank lies above the base circle it
//!    is the involute, below it the tooth widens a little, as a fillet would.
//! 2. The outline is swept along y. A face is cut into the teeth, by strips, and the disc within
//!    the roots, by a fan.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::skin::Skin;

/// Teeth of [`gear`].
pub const GEAR_TEETH: usize = 16;
/// Radius of the pitch circle, m: two gears mesh at twice this distance.
pub const GEAR_PITCH_RADIUS: f64 = MODULE * GEAR_TEETH as f64 / 2.0;
/// Play between the flanks of two gears that mesh, m along the pitch circle.
pub const GEAR_BACKLASH: f64 = 0.0002;

const MODULE: f64 = 0.002;
const PRESSURE_ANGLE: f64 = 20.0 * PI / 180.0;
/// Shortened a little, so that tips stay clear of the mating gear's roots.
const TIP_RADIUS: f64 = GEAR_PITCH_RADIUS + 0.9 * MODULE;
const ROOT_RADIUS: f64 = GEAR_PITCH_RADIUS - 1.25 * MODULE;
const HALF_WIDTH: f64 = 0.005;
/// Points of a flank from root to tip.
const FLANK: usize = 8;
/// Widening of the tooth below the base circle, in parts of the way down.
const FILLET: f64 = 0.3;

/// A gear of 16 teeth, module 2 mm and 10 mm width along y about the origin, one tooth's middle
/// towards +z: 1024 triangles.
pub fn gear() -> PolygonSoup {
    let mut skin = Skin::default();
    let near = skin.ring(outline(-HALF_WIDTH));
    let far = skin.ring(outline(HALF_WIDTH));
    skin.band(&near, &far);
    face(&mut skin, &far, HALF_WIDTH, false);
    face(&mut skin, &near, -HALF_WIDTH, true);
    skin.finish()
}

/// Counter-clockwise about +y: a tooth's rising flank, then its falling one.
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

/// Half the angle that a tooth takes at `radius`, rad.
fn half_angle(radius: f64) -> f64 {
    let involute = |angle: f64| angle.tan() - angle;
    let base = GEAR_PITCH_RADIUS * PRESSURE_ANGLE.cos();
    let at_pitch = FRAC_PI_2 / GEAR_TEETH as f64 - GEAR_BACKLASH / (4.0 * GEAR_PITCH_RADIUS) + involute(PRESSURE_ANGLE);
    if radius < base { at_pitch + FILLET * (base - radius) / base } else { at_pitch - involute((base / radius).acos()) }
}

fn face(skin: &mut Skin, ring: &[u32], y: f64, backward: bool) {
    let mut roots = Vec::with_capacity(2 * GEAR_TEETH);
    for tooth in ring.chunks(2 * FLANK) {
        for k in 0..FLANK - 1 {
            let [a, b, c, d] = [tooth[k], tooth[k + 1], tooth[2 * FLANK - 2 - k], tooth[2 * FLANK - 1 - k]];
            skin.quad(if backward { [d, c, b, a] } else { [a, b, c, d] });
        }
        roots.extend([tooth[0], tooth[2 * FLANK - 1]]);
    }
    let center = DVec3::Y * y;
    if backward { skin.point_start(&roots, center) } else { skin.point_end(&roots, center) }
}
