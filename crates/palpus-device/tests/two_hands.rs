//! Tests of two simulated operators with one tool each. Tools that are pressed against each other
//! must rest. A tool that is pushed along must not be braked. No hand may receive energy.

mod closed_loop;
mod own_loop;

use std::sync::Arc;

use closed_loop::{HandWork, TICK, limits};
use glam::DVec3;
use own_loop::{cycle, elapsed};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, BodySettings};
use palpus::force::FrictionSettings;
use palpus::render::{Object, ProbeState, Settings, ToolId, VirtualCoupling, World};
use palpus_device::{HandImpedance, HapticDevice, Jitter, SimulatedDevice, SimulationSettings};
use palpus_scenes::shape;

const SEED: u64 = 0xd0e;
/// Edge lengths of the blocks, m.
const SIZE: DVec3 = DVec3::new(0.04, 0.03, 0.02);

/// Two blocks, through couplings that the simulated device can render stably, far above a table.
fn blocks(friction: bool) -> (World, [ToolId; 2]) {
    let make =
        |soup| Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("the mesh is valid"));
    let (block, table) = (make(shape::cuboid(SIZE)), make(shape::table()));
    let limits = limits();
    let usual = Settings::default();
    let stiffness =
        VirtualCoupling::contact_stiffness(&limits, usual.contact_tolerance).expect("the force limit is finite");
    let settings = Settings {
        stiffness,
        limits,
        friction: friction.then_some(FrictionSettings {
            static_coefficient: 0.4,
            dynamic_coefficient: 0.3,
            tangential_stiffness: stiffness,
        }),
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, usual.contact_tolerance)),
        ..usual
    };
    let mut world = World::new(settings).expect("the settings are valid");
    world.add(Object::fixed(table, Pose::IDENTITY)).expect("the settings are valid");
    let tools = [0, 1].map(|_| world.add_tool(block.clone(), settings).expect("the settings are valid"));
    (world, tools)
}

/// Results of a loop.
struct Felt {
    forces: [Vec<DVec3>; 2],
    /// Work done on each hand.
    work: [HandWork; 2],
    /// Largest energy given to both hands together at any time, J.
    together: f64,
    touched: u32,
}

/// Runs the closed loop with two operators for `seconds`, with the logged timing jitter.
fn run(
    (mut world, tools): (World, [ToolId; 2]),
    hands: [HandImpedance; 2],
    intent: impl Fn(usize, f64) -> Pose + Copy,
    seconds: f64,
) -> Felt {
    let default = SimulationSettings::default();
    let mut devices = [0, 1].map(|k| {
        let settings = SimulationSettings { hand: hands[k], jitter: Some(Jitter::logged(SEED)), ..default.clone() };
        SimulatedDevice::new(settings, move |time: f64| intent(k, time)).expect("the settings are valid")
    });
    let mut felt = Felt { forces: [Vec::new(), Vec::new()], work: [HandWork::default(); 2], together: 0.0, touched: 0 };
    let mut time = 0.0;
    for _ in 0..(seconds / TICK) as usize {
        let states = devices.each_mut().map(|device| device.read().expect("a simulated device can be read"));
        for (work, device) in felt.work.iter_mut().zip(&devices) {
            work.moved_to(&device.true_pose());
        }
        felt.together = felt.together.max(felt.work[0].given + felt.work[1].given);
        let dt = elapsed(&states[0], &mut time);
        let probes = states.map(|state| ProbeState { pose_ba: state.pose, twist: state.twist });
        world.step(&probes, dt, &NoClock);
        let ticks = tools.map(|tool| world.tick(tool));
        felt.touched += u32::from(ticks[0].from_other.force != DVec3::ZERO);
        for k in 0..2 {
            devices[k].write(&ticks[k].commanded).expect("a finite wrench is accepted");
            felt.work[k].act(devices[k].true_pose(), devices[k].applied());
            felt.forces[k].push(ticks[k].commanded.force);
        }
    }
    felt
}

/// Returns the intended pose of tool `k`: pressed `press` m into the other tool, and shifted by
/// `along`.
fn opposed(k: usize, press: f64, along: DVec3) -> Pose {
    let side = if k == 0 { -1.0 } else { 1.0 };
    Pose::from_translation(DVec3::new(side * (SIZE.x / 2.0 - press), 0.0, 0.1) + along)
}

#[test]
fn pressed_tools_are_stable_in_all_hands() {
    let hands = [HandImpedance::RELAXED, HandImpedance::NORMAL, HandImpedance::FIRM, HandImpedance::TIGHT];
    for first in hands {
        for second in hands {
            for friction in [false, true] {
                let stiffness = 1.0 / (1.0 / first.stiffness + 1.0 / second.stiffness);
                // The hands press with 1.5 N.
                let press = 0.5 * 1.5 / stiffness;
                let intent =
                    |k: usize, time: f64| opposed(k, (press + 2e-3) * (time / 0.5).min(1.0) - 2e-3, DVec3::ZERO);
                let felt = run(blocks(friction), [first, second], intent, 5.0);
                for forces in &felt.forces {
                    let (share, mean) = cycle(&forces[4000..]);
                    let hands = format!("{} and {} N/m, seed {SEED:#x}", first.stiffness, second.stiffness);
                    assert!(mean > 0.5, "{hands}: {mean} N");
                    assert!(share < 0.01, "{hands}: {share} of {mean} N");
                }
                let (one, other) = (felt.forces[0][4999], felt.forces[1][4999]);
                assert!((one + other).length() < 0.05 * one.length(), "{one} and {other}, seed {SEED:#x}");
            }
        }
    }
}

#[test]
fn hands_that_push_each_other_get_no_energy() {
    for friction in [false, true] {
        let intent = |k: usize, time: f64| {
            let along = DVec3::new((3.0 * time).sin(), 0.5 * (2.0 * time).sin(), 0.3 * (5.0 * time).sin()) * 0.02;
            let press = 0.004 * (time / 0.5).min(1.0) * (1.0 + 0.9 * (7.0 * time).sin());
            opposed(k, press - 1e-3, along)
        };
        let felt = run(blocks(friction), [HandImpedance::NORMAL; 2], intent, 30.0);
        assert!(felt.touched > 20_000, "{} ticks", felt.touched);
        // One hand may move the other, but both together must get no energy.
        assert!(felt.together <= 1e-6, "{} J, {:?}, seed {SEED:#x}", felt.together, felt.work.map(|work| work.most));
    }
}
