//! Devices that sense six axes and push along three: what they feel beside a device that pushes
//! along all.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::FrictionSettings;
use palpus::render::{Limits, Object, ProbeState, Settings, ToolId, World};
use palpus_device::{DeviceSpec, Encoder, HandImpedance, HapticDevice, SimulatedDevice, SimulationSettings};
use palpus_scenes::{Scene, scene};

const TICK: f64 = 1e-3;

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a scene's mesh makes a body"))
}

fn settings(scene: &Scene, torque: f64) -> Settings {
    let limits = Limits { force: 8.5, torque };
    let settings = Settings::coupled(limits, TICK, scene.contact.tolerance);
    let friction = scene.contact.friction.map(|friction| FrictionSettings {
        static_coefficient: friction.static_coefficient,
        dynamic_coefficient: friction.dynamic_coefficient,
        tangential_stiffness: settings.stiffness,
    });
    Settings { friction, ..settings }
}

fn world(settings: Settings, [a, b]: [&Arc<Body>; 2]) -> (World, ToolId) {
    let mut world = World::new(settings).expect("settings");
    world.add(Object::fixed(b.clone(), Pose::IDENTITY)).expect("an environment");
    let tool = world.add_tool(a.clone(), settings).expect("a tool");
    (world, tool)
}

/// The forces of a run in a normal hand, N.
///
/// Encoders are exact: what their steps do to two runs that differ anywhere is not what is asked.
fn run(scene: &Scene, bodies: [&Arc<Body>; 2], torque: f64) -> Vec<DVec3> {
    let (mut world, tool) = world(settings(scene, torque), bodies);
    let default = SimulationSettings::default();
    let spec = DeviceSpec { torque_max: torque, ..default.spec.clone() };
    let path = scene.path.clone();
    let simulation = SimulationSettings { hand: HandImpedance::NORMAL, spec, encoder: Encoder::EXACT, ..default };
    let mut device = SimulatedDevice::new(simulation, move |time: f64| path.pose(time)).expect("a device");
    let mut tick = || {
        let state = device.read().expect("a state");
        world.step(&[ProbeState { pose_ba: state.pose, twist: state.twist }], TICK, &NoClock);
        let wrench = world.tick(tool).commanded;
        device.write(&wrench).expect("written");
        wrench.force
    };
    (0..5000).map(|_| tick()).collect()
}

#[test]
fn three_forces_are_those_of_the_whole_device() {
    // Of the mean force: the error's mean. The spoon's handle turns it most.
    for (name, most) in
        [("spoon-cup", 0.2), ("peg-hole", 0.1), ("torus-torus", 0.1), ("box-table", 0.1), ("v-groove", 0.1)]
    {
        let scene = scene(name).expect("a built-in scene");
        let bodies = [body(&scene.probe), body(&scene.environment)];
        let [full, three] = [0.188, 0.0].map(|torque| run(&scene, [&bodies[0], &bodies[1]], torque));
        let touched = || full.iter().zip(&three).filter(|(full, _)| full.length() > 0.2);
        let (count, force): (usize, f64) = (touched().count(), touched().map(|(full, _)| full.length()).sum());
        assert!(count > 10, "{name}: nothing is felt");
        let error: f64 = touched().map(|(full, three)| (*full - *three).length()).sum();
        assert!(
            error < most * force,
            "{name}: off by {} N in the mean, of {}",
            error / count as f64,
            force / count as f64
        );
    }
}

#[test]
fn a_hand_that_holds_a_block_askew_feels_nothing_along_the_plate() {
    let soup = |size: DVec3| {
        let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| [-0.5, 0.5].map(|z| DVec3::new(x, y, z) * size)));
        Arc::new(Body::from_convex(corners.as_flattened().as_flattened()).expect("a block"))
    };
    let (block, plate) = (soup(DVec3::new(0.04, 0.04, 0.02)), soup(DVec3::new(1.0, 1.0, 0.02)));
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.0 }, TICK, 2e-4);
    for tilt in [0.0, 0.05, 0.2] {
        let (mut world, tool) = world(settings, [&block, &plate]);
        for tick in 0..2000 {
            let time = TICK * f64::from(tick);
            let height = 0.02 + 0.02 * f64::max(1.0 - 4.0 * time, 0.0) - 0.002 * (4.0 * time).min(1.0);
            let pose = Pose::new(DQuat::from_rotation_y(tilt), DVec3::new(0.05 * time, 0.0, height));
            world.step(&[ProbeState::at(pose)], TICK, &NoClock);
            let force = world.tick(tool).commanded.force;
            if time > 0.5 {
                assert!(force.z > 1.0, "{tilt} rad, {time} s: {force} N");
                assert!(force.truncate().length() < 0.05, "{tilt} rad, {time} s: {force} N");
            }
        }
    }
}
