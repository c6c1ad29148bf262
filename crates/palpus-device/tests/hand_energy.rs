//! Contact behind the coupling gives a hand no energy, and the summary of a run says so.

mod bodies;
mod closed_loop;
mod judged;

use std::sync::atomic::AtomicBool;

use bodies::body;
use closed_loop::{TICK, limits};
use judged::Judged;
use palpus::algebra::NoClock;
use palpus::force::FrictionSettings;
use palpus::render::{Clustering, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_device::{
    DeviceState, HandImpedance, RunStatistics, Servo, ServoOptions, SimulatedDevice, SimulationSettings, StepOutcome,
    Timing,
};
use palpus_scenes::{Scene, scene};

/// J.
const BAR: f64 = 1e-6;

/// The scene through a coupling as the simulated device bears it, as a program renders it.
fn renderer(scene: &Scene) -> Renderer {
    let limits = limits();
    let stiffness = VirtualCoupling::contact_stiffness(&limits, scene.contact.tolerance).expect("a limit");
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
    Renderer::new(body(&scene.probe), body(&scene.environment), settings).expect("valid settings")
}

/// What a run says and what is true, J.
struct Account {
    said: RunStatistics,
    /// The most that the hand was given at any time.
    most: f64,
}

/// The hand's way through a scene with the whole loop and its safety chain.
fn run(name: &str, hand: HandImpedance, seconds: f64) -> Account {
    let scene = scene(name).expect("a built-in scene");
    let mut renderer = renderer(&scene);
    let path = scene.path.clone();
    let settings = SimulationSettings { hand, ..SimulationSettings::default() };
    let device = SimulatedDevice::new(settings, move |time: f64| path.pose(time)).expect("usual settings");
    let mut device = Judged::new(device);
    let options = ServoOptions { timing: Timing::Simulated, duration: Some(seconds), ..ServoOptions::default() };
    let step = |state: &DeviceState, dt: f64| {
        let probe = ProbeState { pose_ba: state.pose, twist: state.twist };
        StepOutcome::of(renderer.step(&probe, dt, &NoClock).commanded)
    };
    let said = Servo::new(options).expect("valid options").run(&mut device, step, &mut (), &AtomicBool::new(false));
    Account { said, most: device.work.most }
}

fn assert_nothing_given(name: &str, hand: HandImpedance, seconds: f64) {
    let Account { said, most } = run(name, hand, seconds);
    assert!(said.safety.faults() == 0, "{name}: {:?}", said.safety);
    assert!(most <= BAR, "{name}, {hand:?}: {most} J truly");
    assert!(said.energy.highest <= BAR, "{name}, {hand:?}: {:?} said, {most} J truly", said.energy);
}

#[test]
fn sliding_gives_a_hand_no_energy_and_the_summary_says_so() {
    for name in ["pen-sphere", "rails", "box-rest"] {
        assert_nothing_given(name, HandImpedance::RELAXED, 3.0);
    }
}

#[test]
#[ignore = "minutes in a debug build"]
fn no_scene_gives_any_hand_energy() {
    for entry in palpus_scenes::scenes().iter().chain(palpus_scenes::trials()) {
        // The large rollers are those of `rollers` with more triangles.
        if !entry.build().is_of_two_bodies() || entry.name == "rollers-200k" {
            continue;
        }
        for hand in [HandImpedance::RELAXED, HandImpedance::NORMAL, HandImpedance::FIRM] {
            assert_nothing_given(entry.name, hand, 6.0);
        }
    }
}
