//! Two rings linked like a chain.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::HandPath;
use crate::shape::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS, torus};

const PERIOD: f64 = 8.0;
const KEYS: usize = 48;
/// Distance by which the intended ring is pulled beyond first contact, m.
const PRESS: f64 = 0.0012;

pub(super) fn parts() -> Parts {
    Parts {
        probe: torus(),
        environment: torus(),
        contact: USUAL,
        path: HandPath::sampled_cycle(PERIOD, KEYS, linked),
        second: None,
        objects: Vec::new(),
    }
}

/// Returns a pose of the probe's ring. The ring is perpendicular to the environment's ring, is
/// pulled out and pushed in along x, and swings.
fn linked(phase: f64) -> Pose {
    // In the middle of its play, the tube passes through the centre of the other ring's hole.
    let play = TORUS_MAJOR_RADIUS - 2.0 * TORUS_MINOR_RADIUS;
    let angle = TAU * phase;
    let x = TORUS_MAJOR_RADIUS + (play + PRESS) * angle.sin();
    let y = 0.002 * (2.0 * angle).sin();
    let z = 0.003 * (angle + 0.4).cos();
    let swing = DQuat::from_rotation_y(0.08 * (2.0 * angle).sin()) * DQuat::from_rotation_z(0.1 * (3.0 * angle).sin());
    Pose::new(swing * DQuat::from_rotation_x(FRAC_PI_2), DVec3::new(x, y, z))
}
