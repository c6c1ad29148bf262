//! A spoon in a cup \[K02 Figures 4 and 5\].
//!
//! The spoon goes down into the cavity. It stirs two turns, while the back of its bowl is
//! alternately pressed against the wall and lifted off. Then the tip goes down to the floor, the
//! handle leans on the rim, and the spoon comes out again.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{CUP_FLOOR, CUP_HEIGHT, SPOON_TIP, cup, cup_inner_radius, spoon};
use crate::{HandPath, Key, Tremor};

const TREMOR_SEED: u64 = 5;
/// Distance of the back of the bowl behind the tip, m, when the spoon is upright.
const BACK_OF_BOWL: f64 = 0.0083;
/// Height of the bowl's deepest section above the tip, m.
const BOWL_OVER_TIP: f64 = 0.022;
/// Number of keys per turn of stirring.
const PER_TURN: usize = 16;
/// Intended depth of the bowl in the wall, m.
const PRESS: f64 = 0.0012;
/// Distance of the bowl from the wall between two presses, m.
const LIFT: f64 = 0.0022;

pub(super) fn parts() -> Parts {
    let mut keys = vec![
        Key::rest(0.0, upright(DVec3::new(0.0, 0.0, CUP_HEIGHT + 0.020), PI, 0.0)),
        Key::rest(1.2, upright(DVec3::new(-0.004, 0.0, 0.018), PI, 0.0)),
    ];
    stir(&mut keys);
    let stirred = keys[keys.len() - 1].time;
    // The tip goes down, slightly into the floor, and moves along the floor.
    let centre = |x, z| DVec3::new(x, 0.0, z);
    keys.push(Key::rest(stirred + 0.8, upright(centre(-0.008, 0.016), PI, 0.0)));
    keys.push(Key::rest(stirred + 1.4, upright(centre(-0.006, CUP_FLOOR - 0.001), PI, 0.05)));
    keys.push(Key::rest(stirred + 2.0, upright(centre(0.004, CUP_FLOOR - 0.0006), PI, 0.05)));
    // The tip stays near the floor while the handle leans outward, until the handle lies on the
    // rim. The handle leans away from the back of the bowl.
    keys.push(Key::rest(stirred + 2.8, upright(centre(-0.006, CUP_FLOOR + 0.002), PI, 0.40)));
    keys.push(Key::rest(stirred + 3.6, upright(centre(-0.008, CUP_FLOOR + 0.001), PI, LEAN_ON_RIM)));
    keys.push(Key::rest(stirred + 4.2, upright(centre(-0.008, CUP_FLOOR + 0.001), PI, LEAN_ON_RIM + 0.02)));
    keys.push(Key::rest(stirred + 5.0, upright(centre(-0.004, 0.018), PI, 0.1)));
    keys.push(Key::rest(stirred + 6.2, upright(centre(0.0, CUP_HEIGHT + 0.020), PI, 0.0)));
    let path = HandPath::through(&keys).with_tremor(Tremor::new(0.05e-3, TREMOR_SEED));
    Parts { probe: spoon(), environment: cup(), contact: USUAL, path, second: None, objects: Vec::new() }
}

/// Lean angle at which the handle meets the rim with the tip on the floor, rad.
const LEAN_ON_RIM: f64 = 0.52;

/// Adds two turns of stirring. The bowl presses into the wall and lifts off three times per turn.
fn stir(keys: &mut Vec<Key>) {
    let begin = keys[keys.len() - 1].time;
    for k in 1..=2 * PER_TURN {
        let turn = k as f64 / PER_TURN as f64;
        let height = 0.016 + 0.004 * (TAU * turn / 2.0).sin();
        let clearance = -PRESS + (LIFT + PRESS) * 0.5 * (1.0 + (3.0 * TAU * turn).cos());
        let radius = cup_inner_radius(height + BOWL_OVER_TIP) - BACK_OF_BOWL - clearance;
        let angle = PI + TAU * turn;
        let tip = DVec3::new(radius * angle.cos(), radius * angle.sin(), height);
        keys.push(Key::through(begin + 0.2 * k as f64, upright(tip, angle, 0.0)));
    }
}

/// Returns the pose of the spoon with its tip at `tip`. The back of its bowl faces outward at
/// `angle` around the cup. Its handle leans from the vertical by `lean` (rad), against this
/// direction.
fn upright(tip: DVec3, angle: f64, lean: f64) -> Pose {
    let outward = DVec3::new(angle.cos(), angle.sin(), 0.0);
    let x = outward * lean.sin() - DVec3::Z * lean.cos();
    let z = -(outward * lean.cos() + DVec3::Z * lean.sin());
    let rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z));
    Pose::new(rotation, tip - rotation * SPOON_TIP)
}
