//! Machine parts and a tool: box on a plate, screwdriver, rollers, ball joint, gears.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{
    self, BLADE_THICKNESS, ChannelSection, GEAR_PITCH_RADIUS, GEAR_TEETH, JOINT_CENTER, KNURL_HEIGHT, ROLLER_RADIUS,
    SCREWDRIVER_TIP,
};
use crate::{ContactSettings, HandPath, Key};

/// Returns the intended depth (m) with which the normal simulated operator (150 N/m) presses with
/// `newtons`.
const fn press(newtons: f64) -> f64 {
    newtons / 150.0
}

/// A box comes down flat on a plate and slides along it, pressed with 4 N.
pub(super) fn box_slide() -> Parts {
    const SIZE: DVec3 = DVec3::new(0.040, 0.030, 0.020);
    let at = |x: f64, above: f64| Pose::from_translation(DVec3::new(x, 0.0, SIZE.z / 2.0 + above));
    let down = -press(4.0);
    Parts {
        probe: shape::cuboid(SIZE),
        environment: shape::table(),
        contact: ContactSettings { shading: false, ..USUAL },
        path: HandPath::through(&[
            Key::rest(0.0, at(-0.03, 0.02)),
            Key::rest(1.0, at(-0.03, down)),
            Key::rest(1.4, at(-0.03, down)),
            Key::rest(3.2, at(0.02, down)),
            Key::rest(4.4, at(0.02, down)),
            Key::rest(5.4, at(0.02, 0.02)),
        ]),
        second: None,
        objects: Vec::new(),
    }
}

/// The blade goes into the screw's slot, is twisted to both sides, and is tilted.
pub(super) fn screwdriver() -> Parts {
    const SLOT_DEPTH: f64 = 0.002;
    const TWIST: f64 = 25.0 * PI / 180.0;
    const TILT: f64 = 6.0 * PI / 180.0;
    let at = |above: f64, rotation: DQuat| Pose::new(rotation, DVec3::Z * (SCREWDRIVER_TIP - SLOT_DEPTH + above));
    let down = -press(0.5);
    let turned = |turn: f64| at(down, DQuat::from_rotation_z(turn));
    let tilted = |tilt: f64| at(down, DQuat::from_rotation_x(tilt));
    let free = at(0.010, DQuat::IDENTITY);
    let section = ChannelSection {
        half_gap: BLADE_THICKNESS / 2.0 + 0.1e-3,
        half_width: 0.006,
        floor: -SLOT_DEPTH,
        bottom: -0.010,
    };
    Parts {
        probe: shape::screwdriver(),
        environment: shape::channel(0.012, &section),
        contact: ContactSettings { tolerance: 0.3e-3, cluster_radius: 2e-3, shading: false, ..USUAL },
        path: HandPath::through(&[
            Key::rest(0.0, free),
            Key::rest(1.0, turned(0.0)),
            Key::rest(1.8, turned(TWIST)),
            Key::rest(3.2, turned(TWIST)),
            Key::rest(4.4, turned(-TWIST)),
            Key::rest(5.4, turned(-TWIST)),
            Key::rest(6.2, tilted(0.0)),
            Key::rest(6.8, tilted(TILT)),
            Key::rest(8.0, tilted(TILT)),
            Key::rest(8.6, tilted(0.0)),
            Key::rest(9.6, free),
        ]),
        second: None,
        objects: Vec::new(),
    }
}

/// Returns the pose of a wheel that rolls on another wheel of the same size. `angle` (rad) is
/// measured from the top. `distance` is the distance of the axes (m), which are parallel to y.
fn rolling(angle: f64, distance: f64, phase: f64) -> Pose {
    let (sin, cos) = angle.sin_cos();
    Pose::new(DQuat::from_rotation_y(2.0 * angle + phase), DVec3::new(sin, 0.0, cos) * distance)
}

/// Returns a path that goes down, to one side, to the other side, and up. `free` and `pressed` are
/// the distances of the axes without and with contact, m.
fn roll_path(free: f64, pressed: f64, phase: f64) -> HandPath {
    const REACH: f64 = 0.45;
    let at = |angle: f64| rolling(angle, pressed, phase);
    HandPath::through(&[
        Key::rest(0.0, rolling(0.0, free, phase)),
        Key::rest(0.8, at(0.0)),
        Key::through(1.5, at(REACH / 2.0)),
        Key::rest(2.2, at(REACH)),
        Key::rest(3.4, at(REACH)),
        Key::through(4.5, at(0.0)),
        Key::rest(5.6, at(-REACH)),
        Key::through(6.2, at(-REACH / 2.0)),
        Key::rest(6.8, at(0.0)),
        Key::rest(7.6, rolling(0.0, free, phase)),
    ])
}

/// Two knurled rollers of `around` × `along` quads roll on each other.
fn rollers_of(around: usize, along: usize) -> Parts {
    let touching = 2.0 * (ROLLER_RADIUS + KNURL_HEIGHT);
    Parts {
        probe: shape::knurled_roller(around, along),
        environment: shape::knurled_roller(around, along),
        contact: ContactSettings { tolerance: 0.1e-3, cluster_radius: 1e-3, ..USUAL },
        path: roll_path(touching + 0.003, touching - press(1.5), 0.0),
        second: None,
        objects: Vec::new(),
    }
}

/// Two knurled rollers of 2016 triangles roll on each other.
pub(super) fn rollers() -> Parts {
    rollers_of(48, 20)
}

/// Two knurled rollers of 200 000 triangles each roll on each other.
pub(super) fn fine_rollers() -> Parts {
    rollers_of(500, 199)
}

/// Rotation that places a tooth of one gear in a gap of the other gear, rad.
const GEAR_PHASE: f64 = PI / GEAR_TEETH as f64;

/// Returns the pose of the gear without load, rolled by `angle` from the top.
#[cfg(test)]
pub(super) fn meshed_gears(angle: f64) -> Pose {
    rolling(angle, 2.0 * GEAR_PITCH_RADIUS, GEAR_PHASE)
}

/// Two gears roll on each other with their teeth engaged.
pub(super) fn gears() -> Parts {
    let distance = 2.0 * GEAR_PITCH_RADIUS;
    Parts {
        probe: shape::gear(),
        environment: shape::gear(),
        contact: ContactSettings { tolerance: 0.2e-3, cluster_radius: 1e-3, shading: false, ..USUAL },
        path: roll_path(distance + 0.006, distance - press(0.75), GEAR_PHASE),
        second: None,
        objects: Vec::new(),
    }
}

/// A ball joint is pulled against its socket and turned about its centre.
pub(super) fn ball_joint() -> Parts {
    const PLAY: f64 = 0.1e-3;
    const TILT: f64 = 0.35;
    let at = |tilt: DVec3, shift: DVec3| {
        let rotation = DQuat::from_scaled_axis(tilt);
        Pose::new(rotation, shift - rotation * JOINT_CENTER)
    };
    let pull = DVec3::Z * press(1.0);
    let aside = DVec3::new(press(1.0), 0.0, 0.0);
    Parts {
        probe: shape::ball_on_stem(),
        environment: shape::socket(PLAY),
        // The tolerance is half of the play, so the ball is not in contact all around.
        contact: ContactSettings { tolerance: PLAY / 2.0, cluster_radius: 2e-3, ..USUAL },
        path: HandPath::through(&[
            Key::rest(0.0, at(DVec3::ZERO, DVec3::ZERO)),
            Key::rest(0.6, at(DVec3::ZERO, pull)),
            Key::rest(1.4, at(DVec3::X * TILT, pull)),
            Key::rest(2.6, at(DVec3::X * TILT, pull)),
            Key::rest(3.6, at(DVec3::new(-0.5, 0.5, 0.3) * TILT, aside)),
            Key::rest(4.6, at(DVec3::new(-0.5, 0.5, 0.3) * TILT, aside)),
            Key::rest(5.4, at(DVec3::ZERO, DVec3::ZERO)),
        ]),
        second: None,
        objects: Vec::new(),
    }
}
