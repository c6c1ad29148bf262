//! Tests steps in which friction lifts the sliding body.

use glam::{DQuat, DVec3};

use super::{DT, at, cuboid, settings};
use crate::algebra::{NoClock, Pose, Twist};
use crate::force::FrictionSettings;
use crate::render::{Object, ProbeState, World};

/// Drags a stick that leans by `lean` (rad) over a plate, tip first, at `speed` (m/s). Returns the
/// number of unsettled steps.
fn drag(lean: f64, speed: f64) -> u32 {
    let mut settings = settings();
    settings.friction =
        Some(FrictionSettings { static_coefficient: 1.2, dynamic_coefficient: 1.2, tangential_stiffness: 5000.0 });
    let mut world = World::new(settings).unwrap();
    world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    let tool = world.add_tool(cuboid(DVec3::new(0.006, 0.006, 0.12)), settings).unwrap();
    let rotation = DQuat::from_rotation_y(lean);
    let height = 0.06 * lean.cos() + 0.003 * lean.sin().abs();
    let mut unsettled = 0;
    for k in 0..600 {
        let time = f64::from(k) * DT;
        let sink = (time * 0.05 - 0.005).min(0.004);
        let translation = DVec3::new(speed * time, 0.0, height - sink);
        let linear = DVec3::new(speed, 0.0, if sink < 0.004 { -0.05 } else { 0.0 });
        let twist = Twist { linear, ..Twist::default() };
        let device = ProbeState { pose_ba: Pose { rotation, translation }, twist };
        world.step(&[device], DT, &NoClock);
        unsettled += world.tick(tool).counters.tool.unsettled;
    }
    unsettled
}

/// A lifted contact has no friction, so its body presses again. Rounds that use each solution as
/// the next guess oscillate between two solutions in 35 of 600 steps.
#[test]
fn step_with_lifting_friction_settles() {
    let unsettled = drag(0.8, 0.3);
    assert!(unsettled <= 6, "{unsettled} steps");
}
