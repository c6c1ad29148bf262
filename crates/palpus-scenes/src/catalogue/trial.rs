//! Scenes for measurements. Each scene shows one effect.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::{Parts, USUAL};
use crate::shape::{self, BOLT_LENGTH, KNIFE_DEPTH, NUT_GRIP, THREAD_PITCH};
use crate::{ContactSettings, HandPath, Key};

/// Side lengths of the box on the table, m.
pub(crate) const BOX: DVec3 = DVec3::new(0.060, 0.040, 0.030);

/// Returns the pose of the box on the table. The middle of its lower face is at `x` (m) and `press`
/// (m) below the table's top. `about_y` and `about_x` are its tilts (rad).
fn on_table(x: f64, press: f64, about_y: f64, about_x: f64) -> Pose {
    let rotation = DQuat::from_rotation_y(about_y) * DQuat::from_rotation_x(about_x);
    Pose::new(rotation, DVec3::new(x, 0.0, -press) + rotation * (DVec3::Z * (BOX.z / 2.0)))
}

fn box_on_table(keys: &[Key]) -> Parts {
    Parts {
        probe: shape::cuboid(BOX),
        environment: shape::table(),
        contact: ContactSettings { shading: false, ..USUAL },
        path: HandPath::through(keys),
        second: None,
        objects: Vec::new(),
    }
}

/// The box is pressed 0.5 mm deep. It is tilted through the flat position over its long side, its
/// short side, and a corner.
pub(super) fn box_tilt() -> Parts {
    const LEAN: f64 = 0.05;
    const PRESS: f64 = 0.0005;
    let mut keys =
        vec![Key::rest(0.0, on_table(0.0, -0.010, LEAN, 0.0)), Key::rest(0.8, on_table(0.0, PRESS, LEAN, 0.0))];
    let tilts = [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.7, 0.7), (-0.7, -0.7), (0.0, 0.0)];
    for (k, (about_y, about_x)) in tilts.into_iter().enumerate() {
        keys.push(Key::rest(1.6 + 0.8 * k as f64, on_table(0.0, PRESS, LEAN * about_y, LEAN * about_x)));
    }
    keys.push(Key::rest(7.2, on_table(0.0, -0.010, 0.0, 0.0)));
    box_on_table(&keys)
}

/// The box is flat and pressed 0.5 mm deep. It slides over the table's end until more than half of
/// it is beyond the end, and then slides back.
pub(super) fn box_edge() -> Parts {
    const PRESS: f64 = 0.0005;
    box_on_table(&[
        Key::rest(0.0, on_table(0.09, -0.005, 0.0, 0.0)),
        Key::rest(0.6, on_table(0.09, PRESS, 0.0, 0.0)),
        Key::rest(2.6, on_table(0.165, PRESS, 0.0, 0.0)),
        Key::rest(4.6, on_table(0.10, PRESS, 0.0, 0.0)),
        Key::rest(5.2, on_table(0.10, -0.005, 0.0, 0.0)),
    ])
}

/// The box comes down flat and stays there.
pub(super) fn box_rest() -> Parts {
    box_on_table(&[
        Key::rest(0.0, on_table(0.0, -0.005, 0.0, 0.0)),
        Key::rest(0.6, on_table(0.0, 0.0005, 0.0, 0.0)),
        Key::rest(2.6, on_table(0.0, 0.0005, 0.0, 0.0)),
        Key::rest(3.2, on_table(0.0, -0.005, 0.0, 0.0)),
    ])
}

/// A knife slides over two converging ridges at constant depth. Its two contacts become one.
pub(super) fn rails() -> Parts {
    let at = |y: f64, press: f64| Pose::from_translation(DVec3::new(0.0, y, KNIFE_DEPTH - press));
    const PRESS: f64 = 0.0003;
    Parts {
        probe: shape::knife(),
        environment: shape::rails(),
        contact: ContactSettings { shading: false, friction: None, ..USUAL },
        path: HandPath::through(&[
            Key::rest(0.0, at(-0.020, -0.005)),
            Key::rest(0.6, at(-0.020, PRESS)),
            Key::rest(3.6, at(0.027, PRESS)),
            Key::rest(4.2, at(0.027, -0.005)),
        ]),
        second: None,
        objects: Vec::new(),
    }
}

/// A nut comes down on its bolt and is screwed on. During this motion it is pushed and pulled along
/// the thread and across it.
pub(super) fn nut_bolt() -> Parts {
    const STEPS_A_TURN: usize = 12;
    const TURNS: f64 = 4.0;
    const SECONDS: f64 = 10.0;
    const PUSH: f64 = 0.0003;
    const ACROSS: f64 = 0.00035;
    // The lower end of the nut is 0.5 mm above the upper end of the bolt when it begins to turn.
    let start = (BOLT_LENGTH - 0.001 + 0.0005) / THREAD_PITCH;
    let count = (TURNS * STEPS_A_TURN as f64) as usize;
    let pose = |k: usize| {
        let part = k as f64 / count as f64;
        let turn = start - TURNS * part;
        // The push increases as the threads engage.
        let engaged = (1.5 * part).min(1.0);
        let push = -PUSH * engaged * (TAU * 3.0 * part).sin();
        let (sin, cos) = (TAU * 5.0 * part).sin_cos();
        let across = DVec3::new(cos, sin, 0.0) * (ACROSS * engaged * (TAU * 1.5 * part).sin().max(0.0));
        Pose::new(DQuat::from_rotation_z(TAU * turn), across + DVec3::Z * (NUT_GRIP + THREAD_PITCH * turn + push))
    };
    let key = |k: usize| {
        let time = SECONDS * k as f64 / count as f64;
        if k == 0 || k == count { Key::rest(time, pose(k)) } else { Key::through(time, pose(k)) }
    };
    Parts {
        probe: shape::nut(),
        environment: shape::bolt(),
        // The tolerance is small compared with the clearance: in the middle of its play, the nut
        // touches nothing.
        contact: ContactSettings {
            tolerance: 0.05e-3,
            cluster_radius: 2e-3,
            stiffness: 1500.0,
            shading: false,
            ..USUAL
        },
        path: HandPath::through(&(0..=count).map(key).collect::<Vec<_>>()),
        second: None,
        objects: Vec::new(),
    }
}
