//! Tests of devices with six sensed and three actuated axes: their forces are compared with the
//! forces of a fully actuated device.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Twist};
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

/// Returns the forces of a run of `seconds` with a simulated hand, N. The encoders are exact, since
/// encoder steps would amplify small differences between two runs.
fn run(scene: &Scene, bodies: [&Arc<Body>; 2], settings: Settings, hand: HandImpedance, seconds: f64) -> Vec<DVec3> {
    let torque = settings.limits.torque;
    let (mut world, tool) = world(settings, bodies);
    let default = SimulationSettings::default();
    let spec = DeviceSpec { torque_max: torque, ..default.spec.clone() };
    let path = scene.path.clone();
    let simulation = SimulationSettings { hand, spec, encoder: Encoder::EXACT, ..default };
    let mut device =
        SimulatedDevice::new(simulation, move |time: f64| path.pose(time)).expect("the settings are valid");
    let mut tick = || {
        let state = device.read().expect("the device returns a state");
        world.step(&[ProbeState { pose_ba: state.pose, twist: state.twist }], TICK, &NoClock);
        let wrench = world.tick(tool).commanded;
        device.write(&wrench).expect("the wrench is accepted");
        wrench.force
    };
    (0..(seconds / TICK) as usize).map(|_| tick()).collect()
}

/// Returns `hand` with the wrist of an ordinary hand, multiplied by `factor` in stiffness. A device
/// without torque cannot sense the wrist, so the coupling stands for an ordinary one.
fn with_ordinary_wrist(hand: HandImpedance, factor: f64) -> HandImpedance {
    let HandImpedance { inertia, angular_damping, angular_stiffness, .. } = HandImpedance::NORMAL;
    HandImpedance { inertia, angular_damping, angular_stiffness: angular_stiffness * factor, ..hand }
}

/// Returns the mean difference of `felt` from `reference`, relative to the mean force, over the
/// ticks in which the reference has more than 0.2 N. `None` if there are fewer than ten.
fn difference(felt: &[DVec3], reference: &[DVec3]) -> Option<f64> {
    let touched: Vec<usize> = (0..reference.len()).filter(|&k| reference[k].length() > 0.2).collect();
    let force: f64 = touched.iter().map(|&k| reference[k].length()).sum();
    (touched.len() >= 10).then(|| touched.iter().map(|&k| felt[k].distance(reference[k])).sum::<f64>() / force)
}

const HANDS: [(&str, HandImpedance); 3] =
    [("relaxed", HandImpedance::RELAXED), ("ordinary", HandImpedance::NORMAL), ("firm", HandImpedance::FIRM)];

/// Asserts that the forces of a device with three actuated axes differ by less than a tenth from
/// the forces of a fully actuated device. The hand on the fully actuated device has an ordinary
/// wrist. Prints the figures, also for the hand's own wrist.
///
/// Asserts nothing and returns false if there is hardly any force, or if the reference is not
/// defined: if it changes by more than a tenth with a wrist that is stiffer by a thousandth.
#[expect(clippy::print_stderr, reason = "figures for docs/feel.md")]
fn assert_alike(name: &str, seconds: f64, (grip, hand): (&str, HandImpedance)) -> bool {
    let scene = scene(name).expect("a built-in scene");
    let bodies = [body(&scene.probe), body(&scene.environment)];
    let usual = settings(&scene, 0.0);
    let coupling = usual.coupling.expect("coupled");
    let stiff = VirtualCoupling { angular_stiffness: 5.0, angular_damping: 0.015, ..coupling };
    let stiff = Settings { coupling: Some(stiff), ..usual };
    let full = settings(&scene, 0.188);
    let of = |settings, hand| run(&scene, [&bodies[0], &bodies[1]], settings, hand, seconds);
    let reference = of(full, with_ordinary_wrist(hand, 1.0));
    let own_wrist = of(full, hand);
    let felt = of(usual, hand);
    let percent = |off: Option<f64>| off.map_or("-".to_owned(), |off| format!("{:.1}", 100.0 * off));
    let (same_wrist, sensitive) =
        (difference(&felt, &reference), difference(&of(full, with_ordinary_wrist(hand, 1.001)), &reference));
    let with_stiff = difference(&of(stiff, hand), &reference);
    eprintln!(
        "| {name}, {seconds} s | {grip} | {} | {} | {} | {} | {} |",
        percent(same_wrist),
        percent(sensitive),
        percent(difference(&felt, &own_wrist)),
        percent(difference(&reference, &own_wrist)),
        percent(with_stiff),
    );
    if let (Some(off), Some(sensitive), Some(with_stiff)) = (same_wrist, sensitive, with_stiff)
        && sensitive < 0.1
    {
        assert!(off < 0.1 && off < with_stiff + 0.01, "{name}, {grip}: {off}, with a stiff spring {with_stiff}");
        return true;
    }
    false
}

#[test]
fn three_forces_agree_with_full_actuation() {
    // The spoon's handle causes the largest rotation.
    for name in ["spoon-cup", "peg-hole", "torus-torus", "box-table", "v-groove"] {
        assert!(assert_alike(name, 5.0, HANDS[1]), "{name} has no force to compare");
    }
}

#[test]
#[ignore = "minutes in a debug build"]
fn three_forces_agree_with_full_actuation_on_all_scenes() {
    for entry in palpus_scenes::scenes().iter().chain(palpus_scenes::trials()) {
        // `rollers-200k` has the shape of `rollers`, with more triangles.
        let built = entry.build();
        if built.is_of_two_bodies() && entry.name != "rollers-200k" {
            let whole = built.path.duration().min(12.0);
            // The spoon's first touch is short, and has its own row.
            for seconds in [5.0, whole].into_iter().skip(usize::from(entry.name != "spoon-cup")) {
                for hand in HANDS {
                    assert_alike(entry.name, seconds, hand);
                }
            }
        }
    }
}

#[test]
fn tilted_block_is_not_pushed_along_the_plate() {
    // The hand holds the block at a tilt, and rocks it.
    let [block, plate] = [DVec3::new(0.04, 0.04, 0.02), DVec3::new(1.0, 1.0, 0.02)].map(|size| body(&cuboid(size)));
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.0 }, TICK, 2e-4);
    for (tilt, rocked) in [(0.0, 0.0), (0.05, 0.0), (0.2, 0.0), (0.1, 0.1), (0.2, 0.05)] {
        let (mut world, tool) = world(settings, [&block, &plate]);
        for tick in 0..2000 {
            let time = TICK * f64::from(tick);
            let height = 0.02 + 0.02 * f64::max(1.0 - 4.0 * time, 0.0) - 0.002 * (4.0 * time).min(1.0);
            let tilt = tilt + rocked * (6.0 * time).sin();
            let pose = Pose::new(DQuat::from_rotation_y(tilt), DVec3::new(0.05 * time, 0.0, height));
            let linear = DVec3::X * 0.05;
            let twist = Twist { angular: DVec3::Y * (6.0 * rocked * (6.0 * time).cos()), linear };
            world.step(&[ProbeState { pose_ba: pose, twist }], TICK, &NoClock);
            let force = world.tick(tool).commanded.force;
            if time > 0.5 {
                assert!(force.z > 1.0, "{tilt} rad, {time} s: {force} N");
                assert!(force.truncate().length() < 0.05, "{tilt} rad, {time} s: {force} N");
            }
        }
    }
}
