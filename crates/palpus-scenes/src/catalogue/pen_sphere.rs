//! A pen that is drawn over a sphere \[K02 Figure 6\].

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{PEN_TIP, pen, sphere};
use crate::{HandPath, Key};

pub(crate) const RADIUS: f64 = 0.040;
/// Number of subdivisions of the sphere. The sphere has 20 480 triangles, so the contact normal
/// turns in small steps.
const FINENESS: u32 = 5;
/// The arc extends by this angle to both sides of the sphere's top, rad.
const HALF_ARC: f64 = 0.9;
/// Duration of the path, s.
const DURATION: f64 = 6.0;
/// Number of the path's segments.
const KEYS: usize = 30;
/// Largest intended depth of the tip below the surface, m.
const PRESS: f64 = 0.0015;

pub(super) fn parts() -> Parts {
    let key = |k: usize| {
        let u = 2.0 * k as f64 / KEYS as f64 - 1.0;
        let time = DURATION * k as f64 / KEYS as f64;
        if k == 0 || k == KEYS { Key::rest(time, along_arc(u)) } else { Key::through(time, along_arc(u)) }
    };
    let keys: Vec<_> = (0..=KEYS).map(key).collect();
    Parts {
        probe: pen(),
        environment: sphere(RADIUS, FINENESS),
        contact: crate::ContactSettings { friction: None, ..USUAL },
        path: HandPath::through(&keys),
        second: None,
        objects: Vec::new(),
    }
}

/// Returns a pose on the arc: in from free space, over the top, partly below the surface, and out
/// again. `u` runs from −1 to 1.
fn along_arc(u: f64) -> Pose {
    let angle = HALF_ARC * u;
    let gap = -PRESS + (0.012 + PRESS) * u.powi(4);
    let tip = DVec3::new(angle.sin(), 0.0, angle.cos()) * (RADIUS + gap);
    // The pen leans by half the slope of the surface, and a little sideways.
    let rotation = DQuat::from_rotation_y(angle / 2.0) * DQuat::from_rotation_x(0.25);
    Pose::new(rotation, tip - rotation * PEN_TIP)
}
