//! Tests that contact through the virtual coupling is stable in the hand, at rest and in motion,
//! and generates no energy.

mod bodies;
mod closed_loop;
mod own_loop;

use bodies::body;
use closed_loop::{HandWork, TICK, limits};
use glam::DVec3;
use own_loop::{cycle, elapsed};
use palpus::algebra::{NoClock, Pose, Wrench};
use palpus::force::FrictionSettings;
use palpus::render::{Clustering, Limits, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_device::{
    Cut, Cuts, EnableMode, HandImpedance, HapticDevice, Jitter, SafetyChain, SafetyLimits, SafetyOptions,
    SimulatedDevice, SimulationSettings,
};
use palpus_scenes::{Scene, scene};

const SEED: u64 = 0x501d;

/// Renders the scene through a coupling that the simulated device can render stably, with
/// contacts of `stiffness` N/m.
fn renderer(scene: &Scene, stiffness: f64) -> Renderer {
    let (a, b) = (body(&scene.probe), body(&scene.environment));
    let limits = limits();
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
    Renderer::new(a, b, settings).expect("the settings are valid")
}

/// Results of a loop.
struct Felt {
    forces: Vec<DVec3>,
    /// True positions of the grip, m.
    places: Vec<DVec3>,
    /// Work done on the hand.
    work: HandWork,
    /// Cuts of all ticks.
    cuts: Cuts,
}

/// Runs the closed loop for `seconds`, with the logged timing jitter. `load` (N) is a weight that
/// pulls in addition to the hand.
fn run(
    renderer: &mut Renderer,
    hand: HandImpedance,
    intent: impl Fn(f64) -> Pose,
    load: DVec3,
    mut chain: Option<SafetyChain>,
    seconds: f64,
) -> Felt {
    let default = SimulationSettings::default();
    let spec = palpus_device::DeviceSpec { force_max: f64::INFINITY, ..default.spec.clone() };
    let settings = SimulationSettings { hand, spec, jitter: Some(Jitter::logged(SEED)), ..default };
    let mut device = SimulatedDevice::new(settings, intent).expect("the settings are valid");
    let mut felt = Felt { forces: Vec::new(), places: Vec::new(), work: HandWork::default(), cuts: Cuts::NONE };
    let mut time = 0.0;
    for _ in 0..(seconds / TICK) as usize {
        let state = device.read().expect("a simulated device can be read");
        let pose = device.true_pose();
        felt.work.moved_to(&pose);
        let dt = elapsed(&state, &mut time);
        let computed = renderer.step(&ProbeState { pose_ba: state.pose, twist: state.twist }, dt, &NoClock).commanded;
        let wrench = chain.as_mut().map_or(computed, |chain| {
            let shaped = chain.shape(&state, &computed, Cuts::NONE, dt);
            renderer.set_available(&shaped.available);
            felt.cuts = felt.cuts.or(shaped.cuts);
            shaped.wrench
        });
        device.write(&Wrench { force: wrench.force + load, ..wrench }).expect("a finite wrench is accepted");
        let applied = device.applied();
        felt.work.act(pose, Wrench { force: applied.force - load, ..applied });
        felt.forces.push(wrench.force);
        felt.places.push(pose.translation);
    }
    felt
}

#[test]
fn contacts_of_5_kn_per_m_are_stable_in_every_hand() {
    let hands = [("none", HandImpedance::NONE), ("normal", HandImpedance::NORMAL), ("firm", HandImpedance::FIRM)];
    // Each row has a time on the scene's path with contact, the direction of pressing, and the
    // start distance (m). The peg is pressed against the side of its hole.
    let scenes = [
        ("box-table", 2.6, DVec3::NEG_Z, 2e-3),
        ("v-groove", 3.0, DVec3::NEG_Z, 2e-3),
        ("peg-hole", 4.6, DVec3::X, 0.0),
    ];
    for (name, when, press, from) in scenes {
        let scene = scene(name).expect("the scene is built in");
        for (hand_name, hand) in hands {
            let mut renderer = renderer(&scene, 5000.0);
            let held = hand.stiffness > 0.0;
            let pose = scene.path.pose(when);
            let above = Pose { translation: pose.translation - press * from, ..pose };
            let inside = if held { 1.5 / hand.stiffness } else { 0.0 };
            let goal = Pose { translation: pose.translation + press * inside, ..pose };
            let intent = |time: f64| {
                let s = (time / 0.5).min(1.0);
                Pose { translation: above.translation.lerp(goal.translation, s), ..pose }
            };
            let load = if held { DVec3::ZERO } else { press * 1.5 };
            let felt = run(&mut renderer, hand, intent, load, None, 5.0);
            let (share, mean) = cycle(&felt.forces[4000..]);
            assert!(mean > 0.1, "{name}, {hand_name}: the force is only {mean} N, seed {SEED:#x}");
            assert!(share < 0.01, "{name}, {hand_name}: {share} of {mean} N, seed {SEED:#x}");
        }
    }
}

#[test]
fn minute_of_contact_gives_the_hand_no_energy() {
    for name in ["spoon-cup", "torus-torus", "peg-hole", "box-table"] {
        let scene = scene(name).expect("the scene is built in");
        let limits = Limits { force: 8.5, torque: 0.188 };
        let stiffness =
            VirtualCoupling::contact_stiffness(&limits, scene.contact.tolerance).expect("the force limit is finite");
        let mut renderer = renderer(&scene, stiffness);
        let spec = SimulationSettings::default().spec;
        let limits = SafetyLimits { ramp: 0.0, ..SafetyLimits::of(&spec, 1.0 / TICK) };
        let chain = SafetyChain::new(&limits, EnableMode::Automatic, &SafetyOptions::default(), TICK);
        let path = scene.path.clone();
        let felt = run(&mut renderer, HandImpedance::NORMAL, |time| path.pose(time), DVec3::ZERO, Some(chain), 60.0);
        assert!(felt.work.most <= 1e-6, "{name}: {} J, seed {SEED:#x}", felt.work.most);
        assert!(!felt.cuts.has(Cut::LimitCycle), "{name}, seed {SEED:#x}");
    }
}

/// A hand does not feel forces below 1 mN and torques below 0.1 mN·m.
#[test]
fn nothing_is_felt_in_free_air() {
    let scene = scene("box-table").expect("the scene is built in");
    let mut renderer = renderer(&scene, 5000.0);
    let start = Pose { translation: scene.path.pose(0.0).translation + DVec3::Z * 0.2, ..Pose::IDENTITY };
    // Amplitudes (m) and frequencies (rad/s): from a slow motion with few encoder steps to a fast
    // motion of 0.4 m/s.
    for (reach, rate) in [(2e-3, 1.0), (0.02, 3.0), (0.1, 4.0)] {
        let intent = |time: f64| {
            let s = (rate * time).sin();
            let rotation = glam::DQuat::from_rotation_x(3.0 * reach * s);
            Pose { rotation, translation: start.translation + DVec3::new(reach, 0.3 * reach, 0.0) * s }
        };
        renderer.clear();
        let felt = run(&mut renderer, HandImpedance::NORMAL, intent, DVec3::ZERO, None, 4.0);
        let largest = felt.forces.iter().fold(0.0_f64, |most, force| most.max(force.length()));
        assert!(largest < 1e-3, "{largest} N at {} m/s, seed {SEED:#x}", reach * rate);
    }
}

/// The motors can hold 1.4 N continuously. A hand that presses a wall with 4 N for a minute sinks
/// in. On the way back, the hand must feel a force only for the first millimetres.
#[test]
fn hot_device_stays_near_its_tool() {
    let scene = scene("box-table").expect("the scene is built in");
    let limits = limits();
    let stiffness =
        VirtualCoupling::contact_stiffness(&limits, scene.contact.tolerance).expect("the force limit is finite");
    let mut renderer = renderer(&scene, stiffness);
    // The box lies flat. At 4 N, the hand and the coupling are both deflected.
    let flat = scene.path.pose(2.6);
    let hand = HandImpedance::NORMAL;
    let coupling = renderer.settings().coupling.expect("the renderer has a coupling");
    let depth = 4.0 / hand.stiffness + 4.0 / coupling.stiffness;
    // The operator moves down within one second, presses for a minute, moves 40 mm up within two
    // seconds, then moves in free air.
    let intent = |time: f64| {
        let down = (depth + 0.005) * time.min(1.0);
        let up = (depth + 0.04) * ((time - 61.0) / 2.0).clamp(0.0, 1.0);
        let about = 0.05 * (4.0 * (time - 63.0).max(0.0)).sin();
        Pose { translation: flat.translation + DVec3::new(about, 0.0, 0.005 - down + up), ..flat }
    };
    let spec = SimulationSettings::default().spec;
    let limits = SafetyLimits { ramp: 0.0, ..SafetyLimits::of(&spec, 1.0 / TICK) };
    let chain = SafetyChain::new(&limits, EnableMode::Automatic, &SafetyOptions::default(), TICK);
    let felt = run(&mut renderer, hand, intent, DVec3::ZERO, Some(chain), 68.0);
    let pressed = felt.forces[3000].length();
    assert!((3.5..4.5).contains(&pressed), "{pressed} N at first, seed {SEED:#x}");
    let turned = 61_000;
    let hot = felt.forces[turned - 1].length();
    assert!(hot < 1.5, "{hot} N after a minute, seed {SEED:#x}");
    let free =
        (turned..felt.forces.len()).find(|k| felt.forces[*k].length() < 0.05).expect("the tool leaves the contact");
    let way = felt.places[turned].distance(felt.places[free]);
    let sunk = flat.translation.z - felt.places[turned].z;
    // The deflection of the coupling is 1.4 mm, and the travel before its anchor slips is 3 mm.
    assert!(sunk > 0.015 && way < 5e-3, "{sunk} m in, felt for {way} m, seed {SEED:#x}");
    let step = felt.forces.windows(2).map(|pair| pair[1].distance(pair[0])).fold(0.0, f64::max);
    assert!(step < 0.5, "{step} N in a tick, seed {SEED:#x}");
    assert!(felt.work.most <= 1e-6, "{} J, seed {SEED:#x}", felt.work.most);
    // In free air the tool has returned to the device.
    let tick = renderer.tick();
    let apart = tick.tool_ba.translation.distance(tick.probe.pose_ba.translation);
    assert!(apart < 2e-3, "{apart} m, seed {SEED:#x}");
}
