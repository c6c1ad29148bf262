//! Tests of devices with six sensed and three actuated axes: their forces are compared with the
//! forces of a fully actuated device.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::Body;
use palpus::render::{Limits, Object, ProbeState, Settings, ToolId, VirtualCoupling, World};
use palpus_device::{DeviceSpec, Encoder, HandImpedance, HapticDevice, SimulatedDevice, SimulationSettings};
use palpus_scenes::shape::cuboid;
use palpus_scenes::{Scene, scene};

const TICK: f64 = 1e-3;

fn settings(scene: &Scene, torque: f64) -> Settings {
    let settings = Settings::coupled(Limits { force: 8.5, torque }, TICK, scene.contact.tolerance);
    match scene.contact.friction {
        Some(friction) => settings.with_friction(friction.static_coefficient, friction.dynamic_coefficient),
        None => settings,
    }
}

fn world(settings: Settings, [a, b]: [&Arc<Body>; 2]) -> (World, ToolId) {
    let mut world = World::new(settings).expect("the settings are valid");
    world.add(Object::fixed(b.clone(), Pose::IDENTITY)).expect("the body is added");
    let tool = world.add_tool(a.clone(), settings).expect("the tool is added");
    (world, tool)
}

/// Returns the forces of a run with a normal hand, N. The encoders are exact, since encoder steps
/// would amplify small differences between two runs.
fn run(scene: &Scene, bodies: [&Arc<Body>; 2], settings: Settings) -> Vec<DVec3> {
    let torque = settings.limits.torque;
    let (mut world, tool) = world(settings, bodies);
    let default = SimulationSettings::default();
    let spec = DeviceSpec { torque_max: torque, ..default.spec.clone() };
    let path = scene.path.clone();
    let simulation = SimulationSettings { hand: HandImpedance::NORMAL, spec, encoder: Encoder::EXACT, ..default };
    let mut device =
        SimulatedDevice::new(simulation, move |time: f64| path.pose(time)).expect("the settings are valid");
    let mut tick = || {
        let state = device.read().expect("the device returns a state");
        world.step(&[ProbeState { pose_ba: state.pose, twist: state.twist }], TICK, &NoClock);
        let wrench = world.tick(tool).commanded;
        device.write(&wrench).expect("the wrench is accepted");
        wrench.force
    };
    (0..5000).map(|_| tick()).collect()
}

#[test]
#[expect(clippy::print_stderr, reason = "figures for docs/feel.md")]
fn three_forces_agree_with_full_actuation() {
    // Largest mean error relative to the mean force. The spoon's handle causes the largest
    // rotation.
    for (name, most) in
        [("spoon-cup", 0.2), ("peg-hole", 0.1), ("torus-torus", 0.1), ("box-table", 0.1), ("v-groove", 0.1)]
    {
        let scene = scene(name).expect("the scene is built in");
        let bodies = [body(&scene.probe), body(&scene.environment)];
        let usual = settings(&scene, 0.0);
        let stiff = VirtualCoupling { angular_stiffness: 5.0, ..usual.coupling.expect("the settings have a coupling") };
        let stiff = Settings { coupling: Some(stiff), ..usual };
        let [full, three, stiff] =
            [settings(&scene, 0.188), usual, stiff].map(|settings| run(&scene, [&bodies[0], &bodies[1]], settings));
        let touched = |k: &usize| full[*k].length() > 0.2;
        let force: f64 = (0..full.len()).filter(touched).map(|k| full[k].length()).sum();
        assert!((0..full.len()).filter(touched).count() > 10, "{name}: there must be a force");
        let off = |felt: &[DVec3]| {
            let error: f64 = (0..full.len()).filter(touched).map(|k| felt[k].distance(full[k])).sum();
            error / force
        };
        let (own, stiff) = (off(&three), off(&stiff));
        eprintln!("{name}: error {:.1} % of the force; with a spring of 5 N·m/rad {:.1} %", 100.0 * own, 100.0 * stiff);
        assert!(own < most && own < stiff + 0.01, "{name}: {own} of the force, with a stiff spring {stiff}");
    }
}

#[test]
fn tilted_block_is_not_pushed_along_the_plate() {
    let [block, plate] = [DVec3::new(0.04, 0.04, 0.02), DVec3::new(1.0, 1.0, 0.02)].map(|size| body(&cuboid(size)));
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
