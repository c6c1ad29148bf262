//! Blocks: a peg and its hole, a box on a table, a ball in a groove.

use std::f64::consts::SQRT_2;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{self, DEFAULT_CLEARANCE, GROOVE_DEPTH, PEG_TIP};
use crate::{ContactSettings, HandPath, Key, Tremor};

const TREMOR_SEED: u64 = 11;

/// The tilted peg moves down onto the block beside the hole. It slides along the top to the hole,
/// becomes upright, goes in, and comes out.
pub(super) fn peg_hole() -> Parts {
    let tip_at = |x: f64, y: f64, z: f64, lean: f64| {
        let rotation = DQuat::from_rotation_y(lean);
        Pose::new(rotation, DVec3::new(x, y, z) * 1e-3 - rotation * PEG_TIP)
    };
    let keys = [
        Key::rest(0.0, tip_at(6.0, 1.0, 15.0, 0.06)),
        Key::rest(1.0, tip_at(6.0, 1.0, -0.6, 0.06)),
        Key::through(1.6, tip_at(3.0, 0.4, -0.6, 0.05)),
        Key::rest(2.2, tip_at(0.4, 0.0, -0.5, 0.04)),
        Key::rest(2.8, tip_at(0.0, 0.0, 0.2, 0.0)),
        Key::through(3.4, tip_at(0.10, 0.06, -5.0, 0.002)),
        Key::through(4.0, tip_at(-0.12, 0.08, -10.0, -0.003)),
        Key::through(4.6, tip_at(0.08, -0.12, -15.0, 0.002)),
        Key::rest(5.2, tip_at(0.05, 0.0, -20.0, 0.0)),
        Key::through(5.8, tip_at(-0.10, 0.0, -12.0, 0.003)),
        Key::rest(6.6, tip_at(0.0, 0.0, 1.0, 0.0)),
        Key::rest(7.4, tip_at(0.0, 0.0, 15.0, 0.0)),
    ];
    Parts {
        probe: shape::peg(),
        environment: shape::hole_block(DEFAULT_CLEARANCE),
        // The tolerance must be small compared with the part, but it may exceed the clearance. Then
        // opposite walls of the hole are within the tolerance, and their forces balance.
        contact: ContactSettings { tolerance: 0.2e-3, cluster_radius: 2e-3, stiffness: 1500.0, ..USUAL },
        path: HandPath::through(&keys).with_tremor(Tremor::new(0.05e-3, TREMOR_SEED)),
        second: None,
        objects: Vec::new(),
    }
}

/// The box comes down on one edge, lies flat, slides along the table, stands on the other edge,
/// slides back, and lifts off.
pub(super) fn box_table() -> Parts {
    const SIZE: DVec3 = DVec3::new(0.060, 0.040, 0.030);
    // If the box leans about y, its lowest edge is this much lower than its middle.
    let reach = |lean: f64| SIZE.x / 2.0 * lean.abs().sin() + SIZE.z / 2.0 * lean.cos();
    let pressed = |x: f64, press: f64, lean: f64, turn: f64| {
        let rotation = DQuat::from_rotation_z(turn) * DQuat::from_rotation_y(lean);
        Pose::new(rotation, DVec3::new(x, 0.0, reach(lean) - press))
    };
    let keys = [
        Key::rest(0.0, pressed(-0.03, -0.020, 0.25, 0.0)),
        Key::rest(1.0, pressed(-0.03, 0.0010, 0.25, 0.0)),
        Key::rest(1.8, pressed(-0.03, 0.0008, 0.0, 0.0)),
        Key::through(2.6, pressed(0.0, 0.0015, 0.0, 0.3)),
        Key::rest(3.4, pressed(0.04, 0.0010, 0.0, 0.5)),
        Key::rest(4.2, pressed(0.04, 0.0010, -0.25, 0.5)),
        Key::through(5.0, pressed(0.01, 0.0015, -0.12, 0.2)),
        Key::rest(5.8, pressed(-0.02, 0.0010, 0.0, 0.0)),
        Key::rest(6.8, pressed(-0.03, -0.020, 0.0, 0.0)),
    ];
    Parts {
        probe: shape::cuboid(SIZE),
        environment: shape::table(),
        contact: ContactSettings { shading: false, ..USUAL },
        path: HandPath::through(&keys),
        second: None,
        objects: Vec::new(),
    }
}

/// The ball goes down into the groove, moves along it while swaying sideways, and comes out.
pub(super) fn v_groove() -> Parts {
    const RADIUS: f64 = 0.012;
    const PRESS: f64 = 0.0012;
    // A ball touches both walls of a right-angled groove when its centre is √2 radii above the
    // bottom.
    let rest = RADIUS * SQRT_2 - GROOVE_DEPTH;
    let at = |x: f64, y: f64, above: f64| {
        Pose::new(DQuat::from_rotation_y(20.0 * x) * DQuat::from_rotation_x(-10.0 * y), DVec3::new(x, y, rest + above))
    };
    let keys = [
        Key::rest(0.0, at(0.003, -0.035, 0.025)),
        Key::rest(0.8, at(0.003, -0.035, 0.002)),
        Key::rest(1.2, at(0.0, -0.030, -PRESS)),
        Key::through(1.9, at(0.0008, -0.012, -PRESS)),
        Key::through(2.6, at(-0.0008, 0.006, -PRESS)),
        Key::rest(3.4, at(0.0, 0.030, -PRESS)),
        Key::through(4.2, at(0.002, 0.010, 0.0025)),
        Key::rest(5.0, at(-0.002, -0.010, 0.0006)),
        Key::rest(5.8, at(0.0, -0.010, 0.025)),
    ];
    Parts {
        probe: shape::sphere(RADIUS, 2),
        environment: shape::v_groove(),
        contact: USUAL,
        path: HandPath::through(&keys),
        second: None,
        objects: Vec::new(),
    }
}
