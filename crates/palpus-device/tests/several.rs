//! Tests of one loop around several devices. Without faults, each device behaves as in a loop of
//! its own. A fault of one device removes the force of this device only.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Random;
use palpus::algebra::{NoClock, Pose, Wrench};
use palpus::body::{Body, BodySettings};
use palpus::render::{Limits, Object, ProbeState, Settings, ToolId, VirtualCoupling, World};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    AfterFault, AfterPanic, Cut, DeviceState, Fault, FaultyDevice, HapticDevice, Intent, Phase, RunEnd, RunStatistics,
    SafetyOptions, Script, Servo, ServoError, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings,
    StepOutcome, Timing, VirtualTime,
};
use palpus_scenes::shape;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const SEED: u64 = 0xb07;
const RATE_HZ: f64 = 1000.0;

/// The results of a step for the devices.
type Answers<'a> = &'a mut [Option<StepOutcome>];

/// A simulated operator that moves into a wall below z = 0 and out again, half a period after the
/// previous operator.
fn simulated(which: usize) -> SimulatedDevice<impl Intent + Send> {
    let path = move |time: f64| Pose::from_translation(DVec3::Z * 0.02 * (4.0 * time + 3.1 * which as f64).cos());
    SimulatedDevice::new(SimulationSettings { rate_hz: RATE_HZ, ..Default::default() }, path)
        .expect("the settings are valid")
}

fn wall(state: &DeviceState) -> StepOutcome {
    StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::Z * (-200.0 * state.pose.translation.z).max(0.0) })
}

/// A step with one wall for each device.
fn walls(states: &[DeviceState], _: f64, answers: Answers<'_>) {
    for (answer, state) in answers.iter_mut().zip(states) {
        *answer = Some(wall(state));
    }
}

fn safety(after_fault: AfterFault) -> SafetyOptions {
    SafetyOptions { after_fault, after_panic: AfterPanic::AsFault, ..SafetyOptions::default() }
}

/// Returns a loop for this number of devices.
fn servo(devices: usize, duration: f64, after_fault: AfterFault) -> Servo {
    let safety = safety(after_fault);
    let options = ServoOptions { rate_hz: RATE_HZ, duration: Some(duration), safety, ..Default::default() };
    let one = Servo::new(options).expect("the options are valid");
    (1..devices).fold(one, |servo, _| servo.with_device(safety).expect("the thresholds are valid"))
}

/// Results of each device.
struct Ran {
    statistics: Vec<RunStatistics>,
    ticks: Vec<Vec<ServoTick>>,
    braked: Vec<bool>,
}

/// Runs two seconds with this number of devices. The first device and the step have these faults.
fn run(
    devices: usize,
    faults: &[(u64, Fault)],
    after_fault: AfterFault,
    step: impl FnMut(&[DeviceState], f64, Answers<'_>),
) -> Ran {
    let time = VirtualTime::default();
    let script = |which: usize| Script::new(if which == 0 { faults } else { &[] }, Some(&time));
    let mut hands: Vec<_> = (0..devices).map(|which| FaultyDevice::new(simulated(which), &script(which))).collect();
    let mut ticks = vec![Vec::new(); devices];
    let mut observe = |tick: &ServoTick, (): &()| ticks[tick.device].push(*tick);
    let statistics = servo(devices, 2.0, after_fault)
        .run_all_in(&time, &mut hands.iter_mut().collect::<Vec<_>>(), step, &mut observe, &AtomicBool::new(false))
        .expect("the number of devices is correct");
    let braked = hands.iter().map(|hand| hand.brake().is_some_and(|brake| brake.is_applied())).collect();
    Ran { statistics, ticks, braked }
}

#[test]
fn shared_loop_equals_separate_loops() {
    for devices in 1..=4 {
        let Ran { statistics, ticks, .. } = run(devices, &[], AfterFault::Reengage, walls);
        for (which, (statistics, ticks)) in statistics.into_iter().zip(ticks).enumerate() {
            let mut alone = Vec::new();
            let mut observe = |tick: &ServoTick, (): &()| alone.push(ServoTick { device: which, ..*tick });
            let expected = servo(1, 2.0, AfterFault::Reengage).run_in(
                &VirtualTime::default(),
                &mut simulated(which),
                |state: &DeviceState, _| wall(state),
                &mut observe,
                &AtomicBool::new(false),
            );
            assert!(ticks == alone, "device {which} of {devices}");
            assert_eq!(statistics, expected);
            assert!(statistics.force_max > 1.0 && statistics.end == RunEnd::Duration);
        }
    }
}

#[test]
fn wrong_number_of_devices_is_refused() {
    let mut one = simulated(0);
    let stop = AtomicBool::new(false);
    let refused = servo(2, 1.0, AfterFault::Reengage).run_all(&mut [&mut one], walls, &mut (), &stop);
    assert_eq!(refused.err(), Some(ServoError::Devices { made: 2, given: 1 }));
}

#[test]
fn device_without_a_result_gets_no_force() {
    let step = |states: &[DeviceState], dt: f64, answers: Answers<'_>| {
        walls(states, dt, answers);
        answers[1] = None;
    };
    let Ran { statistics, .. } = run(2, &[], AfterFault::Reengage, step);
    assert!(statistics[0].force_max > 1.0 && statistics[1].force_max == 0.0, "{statistics:?}");
}

#[test]
fn fault_removes_only_the_force_of_its_device() {
    let undisturbed = run(3, &[], AfterFault::Reengage, walls).ticks;
    let faults = [
        Fault::NonFinitePose,
        Fault::NoRotation,
        Fault::PoseJump(DVec3::X * 0.5),
        Fault::Speed(1e3),
        Fault::Frozen(60),
        Fault::DeviceClock(5.0),
        Fault::Dropped,
    ];
    for fault in faults {
        // The fault occurs during contact.
        let at = undisturbed[0].iter().position(|tick| tick.wrench.force.z > 1.5).expect("the run has contact") as u64;
        let Ran { statistics, ticks, braked } = run(3, &[(at, fault)], AfterFault::Reengage, walls);
        for other in [1, 2] {
            assert!(ticks[other] == undisturbed[other], "{fault:?}: device {other} must not be affected");
            assert_eq!(
                (statistics[other].safety.faults(), &statistics[other].end),
                (0, &RunEnd::Duration),
                "{fault:?}"
            );
        }
        if fault == Fault::Dropped {
            assert!(matches!(statistics[0].end, RunEnd::DeviceFailed(_)) && braked == [true, false, false]);
            let counts: Vec<u64> = statistics.iter().map(|statistics| statistics.ticks).collect();
            assert_eq!(counts, [at + 1, 2000, 2000]);
            let last = ticks[0].last().expect("there is a tick");
            assert!(last.cuts.has(Cut::Device) && last.wrench == Wrench::ZERO);
        } else {
            assert!(statistics[0].safety.faults() > 0, "{fault:?}");
            let fallen = ticks[0].iter().find(|tick| tick.phase == Phase::Faulted).expect("the device faults");
            assert!(fallen.wrench.force.length() < 1.0, "{fault:?}: {fallen:?}");
            assert_eq!((statistics[0].ticks, &statistics[0].end), (2000, &RunEnd::Duration));
        }
    }
}

#[test]
fn step_keeps_the_last_pose_of_a_lost_device() {
    let seen = RefCell::new(Vec::new());
    let step = |states: &[DeviceState], dt: f64, answers: Answers<'_>| {
        seen.borrow_mut().push(states[0]);
        walls(states, dt, answers);
    };
    run(2, &[(700, Fault::Dropped)], AfterFault::Reengage, step);
    let seen = seen.into_inner();
    assert_eq!(seen.len(), 2000);
    for state in &seen[701..] {
        assert_eq!((state.pose, state.twist.linear), (seen[700].pose, DVec3::ZERO));
    }
    // If every fault must end the run, this fault ends the run.
    let Ran { statistics, .. } = run(2, &[(700, Fault::Dropped)], AfterFault::Stop, walls);
    assert!(statistics.iter().all(|statistics| statistics.ticks <= 702), "{statistics:?}");
    assert!(matches!(statistics[0].end, RunEnd::DeviceFailed(_)) && statistics[1].end == RunEnd::Stopped);
}

#[test]
fn fault_of_the_step_removes_all_forces() {
    for panics in [false, true] {
        let mut count = 0;
        let step = |states: &[DeviceState], dt: f64, answers: Answers<'_>| {
            count += 1;
            walls(states, dt, answers);
            if count == 900 && panics {
                std::panic::resume_unwind(Box::new("test panic in the step"));
            }
            if let Some(answer) = answers[1].as_mut().filter(|_| count == 900) {
                answer.wrench.force.y = f64::NAN;
            }
        };
        let Ran { statistics, ticks, .. } = run(2, &[], AfterFault::Reengage, step);
        let cut = if panics { Cut::Panic } else { Cut::NonFiniteWrench };
        let cuts: Vec<u64> = statistics.iter().map(|statistics| statistics.safety.ticks(cut)).collect();
        assert_eq!(cuts, [u64::from(panics), 1], "{panics}");
        assert!(ticks[1][899].wrench.force.length() < 0.5);
        assert!(statistics.iter().all(|statistics| statistics.end == RunEnd::Duration));
    }
    // A device that blocks the loop delays both devices, and both are braked.
    let stall = Fault::LateRead(Duration::from_millis(200));
    let at = run(2, &[], AfterFault::Reengage, walls).ticks[1].iter().position(|tick| tick.wrench.force.z > 1.5);
    let Ran { statistics, .. } =
        run(2, &[(at.expect("the run has contact") as u64, stall)], AfterFault::Reengage, walls);
    assert_eq!(statistics[1].safety.ticks(Cut::Watchdog), 1, "{:?}", statistics[1].safety);
    assert!(statistics.iter().all(|statistics| statistics.safety.faults() <= 1));
}

#[test]
fn faults_of_one_device_do_not_affect_the_other() {
    let undisturbed = run(2, &[], AfterFault::Reengage, walls).ticks;
    let mut random = Random::new(SEED);
    for sequence in 0..100 {
        let faults: Vec<(u64, Fault)> = (0..1 + random.below(5))
            .map(|_| {
                let at = random.below(2000) as u64;
                let fault = match random.below(8) {
                    0 => Fault::NonFinitePose,
                    1 => Fault::NonFiniteTwist,
                    2 => Fault::NoRotation,
                    3 => Fault::PoseJump(DVec3::Y * random.below(1000) as f64),
                    4 => Fault::Frozen(random.below(100) as u32),
                    5 => Fault::Stuck(random.below(100) as u32),
                    6 => Fault::Speed(1e9),
                    _ => Fault::Dropped,
                };
                (at, fault)
            })
            .collect();
        let Ran { statistics, ticks, .. } = run(2, &faults, AfterFault::Reengage, walls);
        assert!(ticks[1] == undisturbed[1], "seed {SEED:#x}, sequence {sequence}: {faults:?}");
        assert_eq!(statistics[1].safety.faults(), 0);
        let force = |tick: &ServoTick| tick.wrench.force.length();
        assert!(ticks[0].iter().all(|tick| tick.wrench.is_finite() && force(tick) <= 8.5), "sequence {sequence}");
    }
}

/// Blocks above a table. The simulated operators press the blocks against each other.
struct Blocks {
    world: World,
    tools: Vec<ToolId>,
}

impl Blocks {
    /// Makes `count` blocks.
    fn new(count: usize) -> Self {
        let make =
            |soup| Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("the mesh is valid"));
        let block = make(shape::cuboid(DVec3::splat(0.03)));
        let limits = Limits { force: 8.5, torque: 0.188 };
        let settings = Settings {
            limits,
            stiffness: VirtualCoupling::contact_stiffness(&limits, 1e-3).expect("the force limit is finite"),
            coupling: Some(VirtualCoupling::tuned(&limits, 1.0 / RATE_HZ, 1e-3)),
            ..Settings::default()
        };
        let mut world = World::new(settings).expect("the settings are valid");
        world.add(Object::fixed(make(shape::table()), Pose::IDENTITY)).expect("the settings are valid");
        let tools =
            (0..count).map(|_| world.add_tool(block.clone(), settings).expect("the settings are valid")).collect();
        Self { world, tools }
    }

    fn step(&mut self, states: &[DeviceState], dt: f64, answers: Answers<'_>) {
        let mut probes = [ProbeState::at(Pose::IDENTITY); 3];
        for (probe, state) in probes.iter_mut().zip(states) {
            *probe = ProbeState { pose_ba: state.pose, twist: state.twist };
        }
        self.world.step(&probes[..states.len()], dt, &NoClock);
        for (answer, tool) in answers.iter_mut().zip(&self.tools) {
            let tick = self.world.tick(*tool);
            *answer = Some(StepOutcome { from_others: tick.work_from_other, ..StepOutcome::of(tick.commanded) });
        }
    }
}

/// Two simulated operators that press against each other. A third operator holds still beside the
/// two.
fn pressing(which: usize) -> SimulatedDevice<impl Intent + Send> {
    let intent = move |time: f64| {
        let press = 0.012 * (2.0 * time).min(1.0);
        let x = [press - 0.018, 0.018 - press, 0.1][which];
        Pose::from_translation(DVec3::new(x, 0.0, 0.1))
    };
    SimulatedDevice::new(SimulationSettings::default(), intent).expect("the settings are valid")
}

#[test]
fn tool_of_a_faulted_device_is_still_felt() {
    for devices in [2, 3] {
        let time = VirtualTime::default();
        let mut blocks = Blocks::new(devices);
        let script = Script::new(&[(1200, Fault::Speed(1e3)), (2000, Fault::Dropped)], Some(&time));
        let none = Script::new(&[], Some(&time));
        let mut hands: Vec<_> =
            (0..devices).map(|k| FaultyDevice::new(pressing(k), if k == 0 { &script } else { &none })).collect();
        let mut forces = vec![[DVec3::ZERO; 3000]; devices];
        let (mut first_count, mut last_count) = (None, 0);
        let mut observe = |tick: &ServoTick, (): &()| {
            forces[tick.device][tick.index as usize] = tick.wrench.force;
            // The error text of the lost device is allocated after this tick.
            if tick.index < 2000 {
                last_count = allocations_of_this_thread();
                first_count.get_or_insert(last_count);
            }
        };
        let statistics = servo(devices, 3.0, AfterFault::Reengage)
            .run_all_in(
                &time,
                &mut hands.iter_mut().collect::<Vec<_>>(),
                |states: &[DeviceState], dt: f64, answers: Answers<'_>| blocks.step(states, dt, answers),
                &mut observe,
                &AtomicBool::new(false),
            )
            .expect("the number of devices is correct");
        assert_eq!(last_count - first_count.expect("there is a tick"), 0);
        let [one, other] = [&forces[0], &forces[1]];
        assert!(one[1199].x < -0.5 && (one[1199] + other[1199]).length() < 0.1, "{} {}", one[1199], other[1199]);
        // Only the first device has lost its force.
        assert!(one[1201].length() < 0.3 && other[1201].x > 0.5, "{} {}", one[1201], other[1201]);
        assert_eq!(one[2001], DVec3::ZERO);
        assert!(other[2200].x > 0.5 && other[2999].x > 0.5, "{} {}", other[2200], other[2999]);
        // Energy from one operator to the other does not count as generated by the loop.
        for statistics in &statistics[1..] {
            assert_eq!((statistics.safety.faults(), statistics.safety.ticks(Cut::Passivity)), (0, 0));
        }
        // A third operator, who touches nothing, feels nothing.
        assert!(forces[2..].iter().flatten().all(|force| force.length() < 1e-9));
    }
}

#[test]
fn simulated_run_is_reproducible() {
    let run = || {
        let options = ServoOptions { timing: Timing::Simulated, duration: Some(1.0), ..Default::default() };
        let servo = Servo::new(options).and_then(|servo| servo.with_device(options.safety));
        let mut blocks = Blocks::new(2);
        let mut ticks = Vec::new();
        let mut observe = |tick: &ServoTick, (): &()| ticks.push((tick.device, tick.state, tick.wrench));
        let step = |states: &[DeviceState], dt: f64, answers: Answers<'_>| blocks.step(states, dt, answers);
        let [one, other]: &mut [&mut (dyn HapticDevice + Send); 2] = &mut [&mut pressing(0), &mut pressing(1)];
        let stop = AtomicBool::new(false);
        let ran =
            servo.expect("the options are valid").run_all(&mut [&mut **one, &mut **other], step, &mut observe, &stop);
        assert_eq!(ran.map(|statistics| statistics.len()), Ok(2));
        ticks
    };
    let first = run();
    assert_eq!(first.len(), 2000);
    assert!(first == run());
}
