//! A ball that moves along the inside of an intestine.

use std::f64::consts::TAU;

use glam::DQuat;
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{CenterLine, intestine, sphere};
use crate::{ContactSettings, HandPath, Key, Tremor};

const TREMOR_SEED: u64 = 23;
/// Radius of the ball, m.
pub(crate) const BALL: f64 = 0.006;
/// Duration of the path, s.
const DURATION: f64 = 20.0;
/// Number of the path's segments.
const KEYS: usize = 160;
/// Largest intended depth of the ball in the wall, m.
const PRESS: f64 = 0.0015;

pub(super) fn parts() -> Parts {
    let key = |k: usize| {
        let part = k as f64 / KEYS as f64;
        let (time, pose) = (DURATION * part, inside(part));
        if k == 0 || k == KEYS { Key::rest(time, pose) } else { Key::through(time, pose) }
    };
    let keys: Vec<_> = (0..=KEYS).map(key).collect();
    Parts {
        probe: sphere(BALL, 2),
        environment: intestine(),
        contact: ContactSettings { stiffness: 400.0, ..USUAL },
        path: HandPath::through(&keys).with_tremor(Tremor::new(0.05e-3, TREMOR_SEED)),
        second: None,
        objects: Vec::new(),
    }
}

/// Returns the ball's pose at the fraction `part` (0 to 1) of its way along the tube. On this way,
/// the ball circles along the wall, and presses it and lifts off repeatedly.
fn inside(part: f64) -> Pose {
    let line = CenterLine;
    let u = 0.04 + 0.92 * part;
    let (level, steep) = line.across(u);
    let (sin, cos) = (TAU * 7.0 * part).sin_cos();
    let gap = -PRESS + 0.0035 * 0.5 * (1.0 + (TAU * 9.0 * part).cos());
    let offset = line.lumen_radius(u) - BALL - gap;
    let rotation = DQuat::from_rotation_z(2.0 * part) * DQuat::from_rotation_x(3.0 * part);
    Pose::new(rotation, line.point(u) + (level * cos + steep * sin) * offset)
}
