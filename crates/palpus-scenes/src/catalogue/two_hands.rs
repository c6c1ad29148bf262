//! Two hands: one holds a block over a table, and the other puts a peg into the block's hole.

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{self, DEFAULT_CLEARANCE, PEG_TIP};
use crate::{ContactSettings, HandPath, Key};

/// Distance of the block's lower side below its frame's origin, m.
const BLOCK_HEIGHT: f64 = 0.025;

/// For each key: the time (s); the position of the block along x and above the table (mm) and its
/// lean (rad); the position of the peg's tip in the block's frame (mm); the lean of the peg (rad).
const KEYS: [(f64, [f64; 3], [f64; 3], f64); 11] = [
    (0.0, [0.0, 30.0, 0.0], [6.0, 1.0, 25.0], 0.06),
    (1.0, [2.0, 30.0, 0.0], [6.0, 1.0, 5.0], 0.06),
    // The peg touches the block's top and slides along it to the hole. The other hand holds the
    // block against the peg.
    (1.8, [2.0, 31.0, 0.02], [5.0, 0.6, -1.2], 0.06),
    (2.6, [0.0, 31.0, 0.02], [0.4, 0.0, -0.8], 0.04),
    (3.2, [-2.0, 31.0, 0.0], [0.0, 0.0, 0.2], 0.0),
    // The peg goes in, while the block is lifted and tilted.
    (4.2, [-5.0, 36.0, -0.05], [0.1, 0.1, -12.0], 0.002),
    (5.2, [-8.0, 32.0, -0.08], [-0.2, 0.1, -20.0], -0.002),
    // Block and peg go down onto the table together and slide along it.
    (6.4, [-10.0, -1.0, 0.0], [0.1, 0.0, -18.0], 0.0),
    (7.4, [15.0, -1.0, 0.0], [0.2, 0.0, -18.0], 0.0),
    // The peg comes out. If it sticks, it lifts the block a little.
    (8.6, [15.0, -0.5, 0.0], [0.0, 0.0, 2.0], 0.0),
    (9.6, [0.0, 30.0, 0.0], [6.0, 1.0, 25.0], 0.06),
];

/// One hand holds the block over the table. The peg touches the block and enters its hole. Then the
/// block is moved and put down on the table, and the peg comes out.
pub(super) fn parts() -> Parts {
    let block = |[x, above, lean]: [f64; 3]| {
        Pose::new(DQuat::from_rotation_y(lean), DVec3::new(x, 0.0, above) * 1e-3 + DVec3::Z * BLOCK_HEIGHT)
    };
    let peg = |tip: [f64; 3], lean: f64| {
        let rotation = DQuat::from_rotation_y(lean);
        Pose::new(rotation, DVec3::from_array(tip) * 1e-3 - rotation * PEG_TIP)
    };
    let last = KEYS.len() - 1;
    let key = |k: usize, pose: Pose| {
        let time = KEYS[k].0;
        if k == 0 || k == last { Key::rest(time, pose) } else { Key::through(time, pose) }
    };
    let held: Vec<Key> = KEYS.iter().enumerate().map(|(k, at)| key(k, block(at.1))).collect();
    let brought: Vec<Key> = KEYS.iter().enumerate().map(|(k, at)| key(k, block(at.1) * peg(at.2, at.3))).collect();
    Parts {
        probe: shape::peg(),
        environment: shape::table(),
        contact: ContactSettings { tolerance: 0.2e-3, cluster_radius: 2e-3, stiffness: 1500.0, ..USUAL },
        path: HandPath::cyclic(&brought),
        second: Some((shape::hole_block(DEFAULT_CLEARANCE), HandPath::cyclic(&held))),
        objects: Vec::new(),
    }
}
