//! Scenes with free and driven bodies. Free bodies fall and slide, and tools or driven bodies push
//! and lift them.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use palpus::algebra::{Pose, Twist};
use palpus::body::PolygonSoup;

use super::{Parts, USUAL};
use crate::flush::Fit;
use crate::scene::{Motion, Object};
use crate::shape::{self, BOLT_LENGTH};
use crate::{ContactSettings, HandPath, Key};

/// Density of hard wood, kg/m³.
const WOOD: f64 = 700.0;
/// Density of aluminium, kg/m³.
const ALUMINIUM: f64 = 2700.0;
/// Density of steel, kg/m³.
const STEEL: f64 = 7800.0;

/// Height above the support at which objects start, m.
const DROP: f64 = 0.2e-3;

/// Returns the pose at x, y, z (mm), rotated about z by `turn` (rad).
fn at(x: f64, y: f64, z: f64, turn: f64) -> Pose {
    Pose::new(DQuat::from_rotation_z(turn), DVec3::new(x, y, z) * 1e-3)
}

fn object(shape: &Arc<PolygonSoup>, start: Pose, motion: Motion) -> Object {
    Object { shape: shape.clone(), start, motion }
}

/// A finger pushes the topmost of three stacked blocks, then pushes the whole stack, and then
/// presses on the stack.
pub(super) fn stack() -> Parts {
    const SIDE: f64 = 40.0;
    let block = Arc::new(shape::cuboid(DVec3::splat(SIDE * 1e-3)));
    let objects = (0..3).map(|k| {
        let level = f64::from(k);
        let z = SIDE * (level + 0.5) + DROP * 1e3 * (level + 1.0);
        object(&block, at(2.0 * level, 0.0, z, 0.05 * level), Motion::Free(WOOD))
    });
    let keys = [
        Key::rest(0.0, at(-50.0, 0.0, 110.0, 0.0)),
        Key::rest(1.0, at(-32.0, 0.0, 105.0, 0.0)),
        // The finger pushes the topmost block, which slides on the block below.
        Key::rest(2.5, at(-18.0, 2.0, 105.0, 0.0)),
        Key::rest(3.2, at(-50.0, 0.0, 105.0, 0.0)),
        Key::rest(4.0, at(-40.0, 0.0, 25.0, 0.0)),
        // The finger pushes the lowest block, and all three blocks move.
        Key::rest(5.5, at(-15.0, 0.0, 22.0, 0.0)),
        Key::rest(6.2, at(-60.0, 0.0, 60.0, 0.0)),
        Key::rest(7.2, at(12.0, 0.0, 145.0, 0.0)),
        Key::rest(8.2, at(12.0, 0.0, 127.0, 0.0)),
        Key::rest(9.0, at(-50.0, 0.0, 150.0, 0.0)),
    ];
    Parts {
        probe: shape::sphere(0.008, 2),
        environment: shape::table(),
        contact: ContactSettings { shading: false, ..USUAL },
        path: HandPath::through(&keys),
        second: None,
        objects: objects.collect(),
    }
}

/// A paddle moves around in a tray with 50 parts: twenty are loose, and thirty are fixed pins.
pub(super) fn tray() -> Parts {
    const LOOSE: u32 = 20;
    const PINS: u32 = 30;
    let wall = Arc::new(shape::sleeve(DVec3::new(0.180, 0.140, 0.020), DVec2::new(0.160, 0.120)));
    let cube = Arc::new(shape::cuboid(DVec3::new(0.012, 0.012, 0.010)));
    let bar = Arc::new(shape::cuboid(DVec3::new(0.018, 0.008, 0.008)));
    let pin = Arc::new(shape::cuboid(DVec3::new(0.004, 0.004, 0.012)));
    let mut objects = vec![object(&wall, at(0.0, 0.0, 20.0, 0.0), Motion::Fixed)];
    for k in 0..LOOSE {
        let (column, row) = (f64::from(k % 5), f64::from(k / 5));
        let (shape, height) = if k % 2 == 0 { (&cube, 10.0) } else { (&bar, 8.0) };
        let start = at(-44.0 + 22.0 * column, -30.0 + 20.0 * row, 0.5 * height + DROP * 1e3, 0.3 * f64::from(k));
        objects.push(object(shape, start, Motion::Free(ALUMINIUM)));
    }
    for k in 0..PINS {
        // The pins are along the walls, where the loose parts are pushed.
        let along = f64::from(k) / f64::from(PINS);
        let (sin, cos) = (TAU * along).sin_cos();
        objects.push(object(&pin, at(77.0 * cos, 57.0 * sin, 6.0, 0.0), Motion::Fixed));
    }
    let keys: Vec<Key> = (0..=24)
        .map(|k| {
            let part = f64::from(k) / 24.0;
            let angle = TAU * 1.5 * part;
            let (sin, cos) = angle.sin_cos();
            // The paddle goes down, moves in a spiral outward, and goes up.
            let out = (0.2 + part).min(0.75);
            let height = if k == 0 || k == 24 { 50.0 } else { 10.5 };
            let pose = at(66.0 * out * cos, 46.0 * out * sin, height, angle);
            if k == 0 || k == 24 { Key::rest(0.5 * f64::from(k), pose) } else { Key::through(0.5 * f64::from(k), pose) }
        })
        .collect();
    Parts {
        probe: shape::cuboid(DVec3::new(0.020, 0.004, 0.020)),
        environment: shape::table(),
        contact: ContactSettings { shading: false, tolerance: 0.5e-3, ..USUAL },
        path: HandPath::through(&keys),
        second: None,
        objects,
    }
}

/// A driven turntable moves four parts around. A finger blocks the parts one after the other.
pub(super) fn conveyor() -> Parts {
    const RADIUS: f64 = 0.090;
    const HEIGHT: f64 = 10.0;
    // Angular velocity of the turntable, rad/s.
    const SPEED: f64 = 0.8;
    let disc = Arc::new(shape::disc(RADIUS, HEIGHT * 1e-3, 48));
    let part = Arc::new(shape::cuboid(DVec3::new(0.020, 0.020, 0.016)));
    let turning = Twist { angular: DVec3::Z * SPEED, linear: DVec3::ZERO };
    let mut objects = vec![object(&disc, at(0.0, 0.0, 6.0, 0.0), Motion::Driven(turning))];
    for k in 0..4 {
        let angle = 0.5 * PI * f64::from(k) + 0.9;
        let (sin, cos) = angle.sin_cos();
        let start = at(60.0 * cos, 60.0 * sin, 6.0 + 0.5 * HEIGHT + 8.0 + DROP * 1e3, angle);
        objects.push(object(&part, start, Motion::Free(ALUMINIUM)));
    }
    let keys = [
        Key::rest(0.0, at(85.0, 0.0, 60.0, 0.0)),
        // The finger goes down on the turntable, which drags it along.
        Key::rest(1.0, at(72.0, -10.0, 18.5, 0.0)),
        Key::rest(2.0, at(60.0, -6.0, 18.5, 0.0)),
        // The finger blocks the parts.
        Key::rest(3.0, at(60.0, 10.0, 22.0, 0.0)),
        Key::rest(6.0, at(60.0, 0.0, 22.0, 0.0)),
        Key::rest(7.0, at(85.0, 0.0, 60.0, 0.0)),
    ];
    Parts {
        probe: shape::sphere(0.008, 2),
        environment: shape::table(),
        contact: ContactSettings { shading: false, ..USUAL },
        path: HandPath::through(&keys),
        second: None,
        objects,
    }
}

/// A finger pushes a free drawer into its frame from one end, and out of it from the other end.
pub(super) fn drawer_slides() -> Parts {
    let fit = Fit::Drawer.usual().scene();
    let drawer = Arc::new(fit.probe);
    // The drawer starts in the middle of its play, half inserted.
    let start = Pose::from_translation(DVec3::X * -0.010);
    let push = |x: f64, y: f64, z: f64| at(x, y, z, 0.0);
    let keys = [
        Key::rest(0.0, push(-70.0, 0.0, 0.0)),
        Key::rest(1.0, push(-49.0, 2.0, 1.0)),
        Key::rest(3.0, push(-30.0, 2.0, 1.0)),
        Key::rest(3.6, push(-60.0, 0.0, 0.0)),
        // The finger moves around the frame to the other end.
        Key::rest(4.6, push(-60.0, 0.0, 60.0)),
        Key::rest(5.6, push(70.0, 0.0, 60.0)),
        Key::rest(6.4, push(65.0, 0.0, 0.0)),
        // The finger pushes off-centre, so the drawer sticks and slides.
        Key::rest(7.4, push(48.0, 10.0, -2.0)),
        Key::rest(9.4, push(25.0, 10.0, -2.0)),
        Key::rest(10.0, push(70.0, 0.0, 0.0)),
    ];
    Parts {
        probe: shape::sphere(0.007, 2),
        environment: fit.environment,
        contact: ContactSettings { friction: USUAL.friction, ..fit.contact },
        path: HandPath::through(&keys),
        second: None,
        objects: vec![object(&drawer, start, Motion::Free(WOOD))],
    }
}

/// A nut lies beside its bolt. Two fingers grip it, lift it, and set it on the bolt's end.
pub(super) fn nut_table() -> Parts {
    const BOLT_AT: f64 = 35.0;
    let nut = shape::nut();
    let lowest = |soup: &PolygonSoup| soup.vertices.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let bolt = shape::bolt();
    let lying = -lowest(&nut) * 1e3;
    let standing = -lowest(&bolt) * 1e3;
    let objects = vec![
        object(&Arc::new(bolt), at(BOLT_AT, 0.0, standing, 0.0), Motion::Fixed),
        object(&Arc::new(nut), at(-20.0, 0.0, lying + DROP * 1e3, 0.0), Motion::Free(STEEL)),
    ];
    // The fingers touch the nut at this distance from its axis, mm: half the width of the nut plus
    // half the width of a finger.
    let touch = 12.0 + 5.0;
    let top = standing + BOLT_LENGTH * 1e3 + lying + 1.0;
    // Time (s), position of the nut along x and its height (mm), and distance of each finger
    // outside the nut (mm).
    let way = [
        (0.0, -20.0, 20.0, 15.0),
        (1.0, -20.0, 0.0, 15.0),
        (2.0, -20.0, 0.0, -4.0),
        (3.2, -20.0, top, -4.0),
        (4.6, BOLT_AT, top, -4.0),
        (5.6, BOLT_AT, top - lying - 1.0, -4.0),
        (6.2, BOLT_AT, top - lying - 1.0, 10.0),
        (7.0, -20.0, 40.0, 15.0),
    ];
    let finger = |side: f64| {
        let key = |&(time, x, height, outside): &(f64, f64, f64, f64)| {
            Key::rest(time, at(x, side * (touch + outside), lying + height, 0.0))
        };
        HandPath::through(&way.iter().map(key).collect::<Vec<_>>())
    };
    let shape = shape::cuboid(DVec3::new(0.014, 0.010, 0.008));
    Parts {
        probe: shape.clone(),
        environment: shape::table(),
        contact: ContactSettings { shading: false, tolerance: 0.2e-3, cluster_radius: 2e-3, ..USUAL },
        path: finger(-1.0),
        second: Some((shape, finger(1.0))),
        objects,
    }
}
