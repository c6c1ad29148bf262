//! How far a tool that sticks gives way behind a coupling.

use glam::DVec3;

use super::{DT, MU, at, cuboid, settings};
use crate::algebra::NoClock;
use crate::render::{Object, ProbeState, World};

#[test]
fn a_coupled_tool_sticks_about_as_stiffly_as_stated() {
    let mut world = World::new(settings()).unwrap();
    let plate = world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    let tool = world.add_tool(cuboid(DVec3::splat(0.02)), settings()).unwrap();
    let body = world.body_of(tool);
    let foot = |world: &World| world.pose(body).point(DVec3::Z * -0.01);
    let mut push = |x: f64, ticks: u32| {
        (0..ticks).for_each(|_| world.step(&[ProbeState::at(at(x, 0.0, 0.006))], DT, &NoClock));
        (foot(&world).x, world.tick(tool).commanded.force)
    };
    let (before, _) = push(0.0, 500);
    let (after, felt) = push(5e-4, 500);
    let friction = world.settings_between(body, plate).and_then(|settings| settings.friction).unwrap();
    let (moved, expected) = (after - before, -felt.x / friction.tangential_stiffness);
    assert!(felt.x < 0.0 && -felt.x < 0.8 * MU * felt.z, "it sticks: {felt}");
    // The stiffness is stated for one cluster; corners that share a tilted load hold harder together, by 23 % here.
    assert!((moved - expected).abs() < 0.25 * expected, "{moved} m, not {expected}");
}
