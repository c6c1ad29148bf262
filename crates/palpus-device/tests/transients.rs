//! Tests of impacts that ring, in a loop with a simulated device and the safety chain.

mod bodies;
mod closed_loop;
mod judged;

use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

use bodies::body;
use closed_loop::{TICK, limits};
use glam::{DVec2, DVec3};
use judged::Judged;
use palpus::algebra::{NoClock, Pose};
use palpus::render::{Material, Object, ProbeState, Settings, Tick, ToolId, World};
use palpus_device::{
    Cut, Cuts, DeviceState, HandImpedance, HapticDevice, RunStatistics, Servo, ServoOptions, ServoTick,
    SimulatedDevice, SimulationSettings, StepOutcome, Timing, hand_preset,
};
use palpus_scenes::shape::cuboid;

/// Amplitude of the hand's motion, m. The motion reaches as far above the plate's surface as below.
const SWING: f64 = 0.01;
/// Time until the chain is engaged, s.
const QUIET: f64 = 1.5;

/// A plate, and a tool above it.
struct Plate {
    world: World,
    tool: ToolId,
}

impl Plate {
    fn new(material: Option<Material>) -> Self {
        let settings = Settings { material, ..Settings::coupled(limits(), TICK, 2e-4) };
        let mut world = World::new(settings).expect("the settings are valid");
        world.add(Object::fixed(body(&cuboid(DVec3::new(0.1, 0.1, 0.02))), Pose::IDENTITY)).expect("the body is added");
        let tool = world.add_tool(body(&cuboid(DVec3::new(0.01, 0.01, 0.02))), settings).expect("the tool is added");
        Self { world, tool }
    }

    fn step(&mut self, state: &DeviceState) -> &Tick {
        self.world.step(&[ProbeState { pose_ba: state.pose, twist: state.twist }], TICK, &NoClock);
        self.world.tick(self.tool)
    }
}

/// Returns a device whose simulated operator rests above the plate for `quiet` s, then taps it
/// with about `speed` (m/s).
fn tapping(hand: HandImpedance, speed: f64, quiet: f64) -> SimulatedDevice<impl Fn(f64) -> Pose> {
    let settings = SimulationSettings { hand, ..SimulationSettings::default() };
    let intent = move |time: f64| {
        let angle = speed / SWING * (time - quiet).max(0.0);
        Pose::from_translation(DVec3::Z * (0.0205 + SWING * angle.cos()))
    };
    SimulatedDevice::new(settings, intent).expect("the settings are valid")
}

/// Results of four taps with the whole loop and its safety chain.
struct Taps {
    /// Largest force of a transient, N.
    loudest: f64,
    cuts: Cuts,
    statistics: RunStatistics,
    /// Largest true energy given to the hand at any time, J.
    given: f64,
}

fn tap(hand: &str, speed: f64, quiet: f64, material: Option<Material>) -> Taps {
    let mut device = Judged::new(tapping(hand_preset(hand).expect("the preset exists"), speed, quiet));
    let mut plate = Plate::new(material);
    let duration = Some(quiet + 4.0 * TAU * SWING / speed);
    let options = ServoOptions { timing: Timing::Simulated, duration, ..ServoOptions::default() };
    let (mut loudest, mut cuts): (f64, Cuts) = (0.0, Cuts::NONE);
    let mut observer = |tick: &ServoTick, (): &()| cuts = cuts.or(tick.cuts);
    let statistics = Servo::new(options).expect("options").run(
        &mut device,
        |state: &DeviceState, _| {
            let tick = plate.step(state);
            loudest = loudest.max(tick.transient.length());
            StepOutcome::of(tick.commanded)
        },
        &mut observer,
        &AtomicBool::new(false),
    );
    Taps { loudest, cuts, statistics, given: device.work.most }
}

const HANDS: [&str; 4] = ["relaxed", "normal", "firm", "tight"];
/// Speeds of the taps, m/s.
const SPEEDS: [f64; 4] = [0.05, 0.1, 0.2, 0.3];

#[test]
fn taps_give_the_hand_no_energy() {
    for (name, material) in Material::NAMED {
        for hand in HANDS {
            for speed in SPEEDS {
                let Taps { loudest, cuts, statistics, given } = tap(hand, speed, QUIET, Some(material));
                let energy = statistics.energy;
                let what = format!("{name}, {hand}, {speed} m/s: {loudest} N, {energy:?}, truly {given} J, {cuts:?}");
                assert!(loudest > 0.1, "there must be a transient: {what}");
                assert!(given <= 1e-6 && energy.highest <= 1e-6, "{what}");
                let shaped = [Cut::Passivity, Cut::Slew, Cut::LimitCycle, Cut::Saturation];
                assert!(!cuts.is_fault() && !shaped.iter().any(|&cut| cuts.has(cut)), "{what}");
            }
        }
    }
}

#[test]
fn taps_during_the_ramp_give_the_hand_no_energy() {
    // The hand reaches the plate 50 to 750 ms after the start. The ramp takes 250 ms.
    let materials = [None].into_iter().chain(Material::NAMED.map(|(_, material)| Some(material)));
    for material in materials {
        for hand in HANDS {
            for speed in SPEEDS {
                for quiet in (0..9).map(|k| 0.03 * f64::from(k)) {
                    let Taps { cuts, statistics, given, .. } = tap(hand, speed, quiet, material);
                    let energy = statistics.energy;
                    let what = format!("{material:?}, {hand}, {speed} m/s after {quiet} s");
                    assert!(!cuts.is_fault() && !cuts.has(Cut::Passivity), "{what}: {cuts:?}");
                    assert!(given <= 1e-6 && energy.highest <= 1e-6, "{what}: {energy:?}, truly {given} J");
                }
            }
        }
    }
}

#[test]
fn load_that_is_held_during_the_ramp_is_given_in_full() {
    // The hand rests 0.7 mm in the plate from the start, or presses 6 mm deep within 0.2 s.
    for (first, last) in [(-0.7e-3, -0.7e-3), (2e-3, -6e-3)] {
        for hand in HANDS {
            let settings =
                SimulationSettings { hand: hand_preset(hand).expect("the preset exists"), ..Default::default() };
            let intent = move |time: f64| {
                let share = (time / 0.2).min(1.0);
                Pose::from_translation(DVec3::Z * (0.02 + first + share * (last - first)))
            };
            let mut device = Judged::new(SimulatedDevice::new(settings, intent).expect("the settings are valid"));
            let mut plate = Plate::new(None);
            let options = ServoOptions { timing: Timing::Simulated, duration: Some(2.0), ..ServoOptions::default() };
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            let mut observer = |tick: &ServoTick, (): &()| {
                if tick.time > 1.5 {
                    assert_eq!((tick.wrench, tick.cuts), (tick.computed, Cuts::NONE), "{hand}, {} s", tick.time);
                    (least, most) = (least.min(tick.wrench.force.z), most.max(tick.wrench.force.z));
                }
            };
            Servo::new(options).expect("options").run(
                &mut device,
                |state: &DeviceState, _| StepOutcome::of(plate.step(state).commanded),
                &mut observer,
                &AtomicBool::new(false),
            );
            assert!(least > 0.05 && most - least < 0.05, "{hand}: {least} to {most} N");
        }
    }
}

/// Returns the true accelerations of the grip (m/s²) from the first impact on, and the first
/// force of the transient (N).
fn struck(hand: HandImpedance, material: Material) -> (Vec<f64>, f64) {
    let mut device = tapping(hand, 0.1, QUIET);
    let mut plate = Plate::new(Some(material));
    let (mut accelerations, mut ring, mut last) = (Vec::new(), None, 0.0);
    while accelerations.len() < WINDOW {
        let state = device.read().expect("the device returns a state");
        let velocity = device.true_twist().linear.z;
        if ring.is_some() {
            accelerations.push((velocity - last) / TICK);
        }
        last = velocity;
        let tick = plate.step(&state);
        ring = ring.or(Some(tick.transient.z).filter(|force| *force != 0.0));
        device.write(&tick.commanded).expect("the wrench is accepted");
    }
    (accelerations, ring.expect("the tool hits the plate"))
}

/// Number of ticks of an impact that are evaluated.
const WINDOW: usize = 80;

#[test]
fn grip_vibrates_as_the_material_does() {
    for (name, material) in Material::NAMED {
        for preset in HANDS {
            let hand = hand_preset(preset).expect("the preset exists");
            let mass = hand.mass + SimulationSettings::default().apparatus.mass;
            let Material { frequency, decay, gain } = material;
            // The reference is the same tap with a transient so small that it only marks the
            // time of the impact.
            let (rung, first) = struck(hand, material);
            let (quiet, _) = struck(hand, Material { gain: 1e-9, ..material });
            let own = TAU * frequency;
            let speed = first / (gain * (-decay * TICK).exp() * (own * TICK).sin());
            // At low frequencies and in a relaxed hand, the spring of the coupling resonates with
            // the hand's mass.
            for (share, most) in [(0.8, 3.5), (0.9, 3.0), (1.0, 3.0), (1.25, 3.0)] {
                let angular = own * share;
                let part = |(k, (rung, quiet)): (usize, (f64, f64))| {
                    DVec2::from_angle(-angular * TICK * k as f64) * ((rung - quiet) * TICK)
                };
                let measured: DVec2 = rung.iter().copied().zip(quiet.iter().copied()).enumerate().map(part).sum();
                let damped = DVec2::new(decay * decay + own * own - angular * angular, 2.0 * decay * angular);
                let target = gain * speed / mass * own / damped.length();
                let level = 20.0 * (measured.length() / target).log10();
                assert!(level.abs() < most, "{name}, {preset}, {} Hz: {level} dB", frequency * share);
            }
        }
    }
}
