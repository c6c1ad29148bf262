//! Tests that contact through the coupling gives the hand no energy, that the statistics report no
//! energy, and that a ball joint turns without force steps.

mod bodies;
mod closed_loop;
mod judged;

use std::sync::atomic::AtomicBool;

use bodies::body;
use closed_loop::{TICK, limits};
use glam::DVec3;
use judged::Judged;
use palpus::algebra::NoClock;
use palpus::force::FrictionSettings;
use palpus::render::{Clustering, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_device::{
    DeviceState, HandImpedance, RunStatistics, Servo, ServoOptions, SimulatedDevice, SimulationSettings, StepOutcome,
    Timing,
};
use palpus_scenes::{Scene, scene};

/// Largest allowed energy, J.
const BAR: f64 = 1e-6;

/// Renders the scene through a coupling that the simulated device can render stably, with the
/// program's settings.
fn renderer(scene: &Scene) -> Renderer {
    let limits = limits();
    let stiffness =
        VirtualCoupling::contact_stiffness(&limits, scene.contact.tolerance).expect("the force limit is finite");
    let settings = Settings {
        contact_tolerance: scene.contact.tolerance,
        cluster_radius: scene.contact.cluster_radius,
        clustering: Clustering::Smooth,
        stiffness,
        friction: scene.contact.friction.map(|friction| FrictionSettings {
            static_coefficient: friction.static_coefficient,
            dynamic_coefficient: friction.dynamic_coefficient,
            tangential_stiffness: stiffness,
        }),
        limits,
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, scene.contact.tolerance)),
        ..Settings::default()
    };
    Renderer::new(body(&scene.probe), body(&scene.environment), settings).expect("the settings are valid")
}

/// Reported and true energy of a run, and what its contact was like.
struct Account {
    said: RunStatistics,
    /// Largest true energy given to the hand at any time, J.
    most: f64,
    /// Largest overlap of the tool, m.
    deepest: f64,
    /// Largest change of the rendered force in one tick, N.
    force_step: f64,
}

/// Follows the scene's path with the whole loop and its safety chain.
fn run(name: &str, hand: HandImpedance, seconds: f64) -> Account {
    let scene = scene(name).expect("the scene is built in");
    let mut renderer = renderer(&scene);
    let path = scene.path.clone();
    let settings = SimulationSettings { hand, ..SimulationSettings::default() };
    let device = SimulatedDevice::new(settings, move |time: f64| path.pose(time)).expect("the settings are valid");
    let mut device = Judged::new(device);
    let options = ServoOptions { timing: Timing::Simulated, duration: Some(seconds), ..ServoOptions::default() };
    let (mut deepest, mut force_step, mut last) = (0.0_f64, 0.0_f64, DVec3::ZERO);
    let step = |state: &DeviceState, dt: f64| {
        let probe = ProbeState { pose_ba: state.pose, twist: state.twist };
        let tick = renderer.step(&probe, dt, &NoClock);
        deepest = deepest.max(-tick.separation());
        force_step = force_step.max(tick.commanded.force.distance(last));
        last = tick.commanded.force;
        StepOutcome::of(tick.commanded)
    };
    let said =
        Servo::new(options).expect("the options are valid").run(&mut device, step, &mut (), &AtomicBool::new(false));
    Account { said, most: device.work.most, deepest, force_step }
}

fn assert_nothing_given(name: &str, hand: HandImpedance, seconds: f64) {
    let Account { said, most, .. } = run(name, hand, seconds);
    assert!(said.safety.faults() == 0, "{name}: {:?}", said.safety);
    assert!(most <= BAR, "{name}, {hand:?}: the true energy is {most} J");
    assert!(said.energy.highest <= BAR, "{name}, {hand:?}: reported {:?}, true {most} J", said.energy);
}

#[test]
fn sliding_gives_the_hand_no_energy() {
    for name in ["pen-sphere", "rails", "box-rest"] {
        assert_nothing_given(name, HandImpedance::RELAXED, 3.0);
    }
}

/// The ball has contacts on all sides within its play. Without the line search between the rounds
/// of a step, it ends deep in a wall in some ticks.
#[test]
fn turned_ball_stays_in_its_play() {
    let Account { deepest, force_step, .. } = run("ball-joint", HandImpedance::NORMAL, 6.0);
    assert!(deepest <= 20e-6, "the tool overlaps the socket by {deepest} m");
    assert!(force_step <= 0.2, "a force step of {force_step} N");
}

#[test]
#[ignore = "minutes in a debug build"]
fn no_scene_gives_any_hand_energy() {
    for entry in palpus_scenes::scenes().iter().chain(palpus_scenes::trials()) {
        // `rollers-200k` is `rollers` with more triangles.
        if !entry.build().is_of_two_bodies() || entry.name == "rollers-200k" {
            continue;
        }
        for hand in [HandImpedance::RELAXED, HandImpedance::NORMAL, HandImpedance::FIRM] {
            assert_nothing_given(entry.name, hand, 6.0);
        }
    }
}
