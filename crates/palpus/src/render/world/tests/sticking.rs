//! Tests the motion of a sticking tool behind a coupling.

use glam::DVec3;

use super::{DT, MU, at, cuboid, settings};
use crate::algebra::NoClock;
use crate::render::{Object, ProbeState, World};

/// Returns the sideways motion of a sticking tool's foot, divided by the motion that its friction
/// force and the stated stiffness predict.
///
/// The hand presses to `press` (m) below the plate's surface, and then pulls sideways by `pull`
/// (m).
fn give(press: f64, pull: f64) -> f64 {
    let mut world = World::new(settings()).unwrap();
    let plate = world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    let tool = world.add_tool(cuboid(DVec3::splat(0.02)), settings()).unwrap();
    let body = world.body_of(tool);
    let foot = |world: &World| world.pose(body).point(DVec3::Z * -0.01);
    let mut hold = |x: f64, z: f64, ticks: u32| {
        (0..ticks).for_each(|_| world.step(&[ProbeState::at(at(x, 0.0, z))], DT, &NoClock));
        (foot(&world).x, world.tick(tool).commanded.force)
    };
    // The tool starts in the air. If it started inside the plate, friction would act in the
    // middle of the overlap.
    hold(0.0, 0.0102, 20);
    let (before, _) = hold(0.0, 0.01 - press, 500);
    let (after, felt) = hold(pull, 0.01 - press, 500);
    let friction = world.settings_between(body, plate).and_then(|settings| settings.friction).unwrap();
    assert!(felt.x.abs() > 0.03 * MU * felt.z && felt.x.abs() < 0.8 * MU * felt.z, "it sticks: {felt}");
    (after - before) / (-felt.x / friction.tangential_stiffness)
}

/// With a larger `pull`, the tool presses more on one edge.
#[test]
fn coupled_tool_sticks_as_stiffly_as_stated() {
    for (press, pull) in [(0.004, 5e-4), (0.006, 2e-4), (0.002, -4e-4), (0.007, 1e-3)] {
        let share = give(press, pull);
        assert!((share - 1.0).abs() < 0.02, "pressed {press} m, pulled {pull} m: {share}");
    }
}
