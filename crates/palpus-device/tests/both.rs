//! One loop with two devices: each as if alone as long as nothing goes wrong, and what goes wrong
//! with one takes that one's force only.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Random;
use palpus::algebra::{NoClock, Pose, Wrench};
use palpus::body::{Body, BodySettings};
use palpus::render::{Duo, Limits, ProbeState, Settings, Tick, VirtualCoupling};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    AfterFault, AfterPanic, Cut, DeviceState, Fault, FaultyDevice, HapticDevice, Intent, Phase, RunEnd, RunStatistics,
    SafetyOptions, Script, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings, StepOutcome, Timing,
    ToolOutcome, VirtualTime,
};
use palpus_scenes::shape;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const SEED: u64 = 0xb07;
const RATE_HZ: f64 = 1000.0;

/// A hand that goes into a wall below z = 0 and out again, the second one half a turn later.
fn simulated(which: usize) -> SimulatedDevice<impl Intent + Send> {
    let path = move |time: f64| Pose::from_translation(DVec3::Z * 0.02 * (4.0 * time + 3.1 * which as f64).cos());
    SimulatedDevice::new(SimulationSettings { rate_hz: RATE_HZ, ..Default::default() }, path).expect("usual settings")
}

fn wall(state: &DeviceState) -> StepOutcome {
    StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::Z * (-200.0 * state.pose.translation.z).max(0.0) })
}

/// `walls` of both, as the step of one loop.
fn walls(states: &[DeviceState; 2], _: f64) -> [ToolOutcome; 2] {
    states.each_ref().map(|state| wall(state).into())
}

fn servo(duration: f64, after_fault: AfterFault) -> Servo {
    let safety = SafetyOptions { after_fault, after_panic: AfterPanic::AsFault, ..SafetyOptions::default() };
    Servo::new(ServoOptions { rate_hz: RATE_HZ, duration: Some(duration), safety, ..Default::default() })
        .expect("options in range")
}

/// Two seconds with these faults of the first device and in the step.
fn run(
    faults: &[(u64, Fault)],
    after_fault: AfterFault,
    step: impl FnMut(&[DeviceState; 2], f64) -> [ToolOutcome; 2],
) -> ([RunStatistics; 2], [Vec<ServoTick>; 2], [bool; 2]) {
    let time = VirtualTime::default();
    let mut first = FaultyDevice::new(simulated(0), &Script::new(faults, Some(&time)));
    let mut second = simulated(1);
    let mut ticks = [Vec::new(), Vec::new()];
    let mut observe = |which: usize, tick: &ServoTick, (): &()| ticks[which].push(*tick);
    let mut other = servo(2.0, after_fault);
    let statistics = servo(2.0, after_fault).run_both_in(
        &mut other,
        &time,
        [&mut first, &mut second],
        step,
        &mut observe,
        &AtomicBool::new(false),
    );
    let braked = [first.brake(), second.brake()].map(|brake| brake.is_some_and(|brake| brake.is_applied()));
    (statistics, ticks, braked)
}

#[test]
fn two_devices_in_one_loop_are_as_in_two() {
    let ([first, second], ticks, _) = run(&[], AfterFault::Reengage, walls);
    for (which, (statistics, ticks)) in [first, second].into_iter().zip(ticks).enumerate() {
        let mut alone = Vec::new();
        let mut observe = |tick: &ServoTick, (): &()| alone.push(*tick);
        let step = |state: &DeviceState, _| wall(state);
        let stop = AtomicBool::new(false);
        let expected = servo(2.0, AfterFault::Reengage).run_in(
            &VirtualTime::default(),
            &mut simulated(which),
            step,
            &mut observe,
            &stop,
        );
        assert!(ticks == alone, "device {which}");
        assert_eq!(statistics, expected);
        assert!(statistics.force_max > 1.0 && statistics.end == RunEnd::Duration);
    }
}

#[test]
fn a_fault_takes_the_force_of_its_own_device() {
    let (_, undisturbed, _) = run(&[], AfterFault::Reengage, walls);
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
        // In the midst of contact.
        let at = undisturbed[0].iter().position(|tick| tick.wrench.force.z > 1.5).expect("a contact") as u64;
        let (statistics, ticks, braked) = run(&[(at, fault)], AfterFault::Reengage, walls);
        assert!(ticks[1] == undisturbed[1], "{fault:?}: the other device feels it");
        assert_eq!((statistics[1].safety.faults(), &statistics[1].end), (0, &RunEnd::Duration), "{fault:?}");
        if fault == Fault::Dropped {
            assert!(matches!(statistics[0].end, RunEnd::DeviceFailed(_)) && braked == [true, false]);
            assert_eq!((statistics[0].ticks, statistics[1].ticks), (at + 1, 2000));
            let last = ticks[0].last().expect("a tick");
            assert!(last.cuts.has(Cut::Device) && last.wrench == Wrench::ZERO);
        } else {
            assert!(statistics[0].safety.faults() > 0, "{fault:?}");
            let fallen = ticks[0].iter().find(|tick| tick.phase == Phase::Faulted).expect("a fault");
            assert!(fallen.wrench.force.length() < 1.0, "{fault:?}: {fallen:?}");
            assert_eq!((statistics[0].ticks, &statistics[0].end), (2000, &RunEnd::Duration));
        }
    }
}

#[test]
fn the_step_goes_on_with_a_lost_device_where_it_was() {
    let seen = RefCell::new(Vec::new());
    let step = |states: &[DeviceState; 2], dt: f64| {
        seen.borrow_mut().push(states[0]);
        walls(states, dt)
    };
    run(&[(700, Fault::Dropped)], AfterFault::Reengage, step);
    let seen = seen.into_inner();
    assert_eq!(seen.len(), 2000);
    for state in &seen[701..] {
        assert_eq!((state.pose, state.twist.linear), (seen[700].pose, DVec3::ZERO));
    }
    // Where any fault is to end the run, this one does.
    let (statistics, ..) = run(&[(700, Fault::Dropped)], AfterFault::Stop, walls);
    assert!(statistics.iter().all(|statistics| statistics.ticks <= 702), "{statistics:?}");
    assert!(matches!(statistics[0].end, RunEnd::DeviceFailed(_)));
}

#[test]
fn what_the_loop_does_wrong_is_felt_by_neither() {
    for panics in [false, true] {
        let mut count = 0;
        let step = |states: &[DeviceState; 2], dt: f64| {
            count += 1;
            let mut outcomes = walls(states, dt);
            if count == 900 && panics {
                std::panic::resume_unwind(Box::new("on purpose"));
            }
            if count == 900 {
                outcomes[1].outcome.wrench.force.y = f64::NAN;
            }
            outcomes
        };
        let (statistics, ticks, _) = run(&[], AfterFault::Reengage, step);
        let cut = if panics { Cut::Panic } else { Cut::NonFiniteWrench };
        assert_eq!(statistics.each_ref().map(|s| s.safety.ticks(cut)), [u64::from(panics), 1], "{panics}");
        assert!(ticks[1][899].wrench.force.length() < 0.5);
        assert!(statistics.iter().all(|statistics| statistics.end == RunEnd::Duration));
    }
    // A device that lets the loop wait is late for both, and both are braked.
    let stall = Fault::LateRead(Duration::from_millis(200));
    let at = run(&[], AfterFault::Reengage, walls).1[1].iter().position(|tick| tick.wrench.force.z > 1.5);
    let (statistics, ..) = run(&[(at.expect("a contact") as u64, stall)], AfterFault::Reengage, walls);
    assert_eq!(statistics[1].safety.ticks(Cut::Watchdog), 1, "{:?}", statistics[1].safety);
    assert!(statistics.iter().all(|statistics| statistics.safety.faults() <= 1));
}

#[test]
fn whatever_one_device_goes_through_the_other_is_as_ever() {
    let (_, undisturbed, _) = run(&[], AfterFault::Reengage, walls);
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
        let (statistics, ticks, _) = run(&faults, AfterFault::Reengage, walls);
        assert!(ticks[1] == undisturbed[1], "seed {SEED:#x}, sequence {sequence}: {faults:?}");
        assert_eq!(statistics[1].safety.faults(), 0);
        let force = |tick: &ServoTick| tick.wrench.force.length();
        assert!(ticks[0].iter().all(|tick| tick.wrench.is_finite() && force(tick) <= 8.5), "sequence {sequence}");
    }
}

/// Two blocks pressed against each other, each by a hand of its own.
fn blocks() -> Duo {
    let make = |soup| Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("a body"));
    let block = make(shape::cuboid(DVec3::splat(0.03)));
    let limits = Limits { force: 8.5, torque: 0.188 };
    let settings = Settings {
        limits,
        stiffness: VirtualCoupling::contact_stiffness(&limits, 1e-3).expect("a limit"),
        coupling: Some(VirtualCoupling::tuned(&limits, 1.0 / RATE_HZ, 1e-3)),
        ..Settings::default()
    };
    Duo::new([block.clone(), block], make(shape::table()), [settings; 2]).expect("valid settings")
}

fn felt(tick: &Tick) -> ToolOutcome {
    ToolOutcome { outcome: StepOutcome::of(tick.commanded), received: tick.work_from_other }
}

fn pressing(which: usize) -> SimulatedDevice<impl Intent + Send> {
    let side = if which == 0 { -1.0 } else { 1.0 };
    let intent = move |time: f64| {
        let press = 0.012 * (2.0 * time).min(1.0);
        Pose::from_translation(DVec3::new(side * (0.018 - press), 0.0, 0.1))
    };
    SimulatedDevice::new(SimulationSettings::default(), intent).expect("usual settings")
}

#[test]
fn a_tool_is_felt_on_when_its_own_hand_feels_nothing_and_nothing_is_allocated() {
    let time = VirtualTime::default();
    let mut duo = blocks();
    let script = Script::new(&[(1200, Fault::Speed(1e3)), (2000, Fault::Dropped)], Some(&time));
    let (mut first, mut second) = (FaultyDevice::new(pressing(0), &script), pressing(1));
    let step = |states: &[DeviceState; 2], dt: f64| {
        let probes = states.map(|state| ProbeState { pose_ba: state.pose, twist: state.twist });
        duo.step(&probes, dt, &NoClock).map(felt)
    };
    let mut forces = [[DVec3::ZERO; 3000]; 2];
    let (mut first_count, mut last_count) = (None, 0);
    let mut observe = |which: usize, tick: &ServoTick, (): &()| {
        forces[which][tick.index as usize] = tick.wrench.force;
        // A device that is lost is told of in words.
        if tick.index < 2000 {
            last_count = allocations_of_this_thread();
            first_count.get_or_insert(last_count);
        }
    };
    let statistics = servo(3.0, AfterFault::Reengage).run_both_in(
        &mut servo(3.0, AfterFault::Reengage),
        &time,
        [&mut first, &mut second],
        step,
        &mut observe,
        &AtomicBool::new(false),
    );
    assert_eq!(last_count - first_count.expect("a tick"), 0);
    let [one, other] = forces;
    assert!(one[1199].x < -0.5 && (one[1199] + other[1199]).length() < 0.1, "{} {}", one[1199], other[1199]);
    // The first hand's force is gone, the second's is not.
    assert!(one[1201].length() < 0.3 && other[1201].x > 0.5, "{} {}", one[1201], other[1201]);
    assert_eq!(one[2001], DVec3::ZERO);
    assert!(other[2200].x > 0.5 && other[2999].x > 0.5, "{} {}", other[2200], other[2999]);
    // What the one hand gives the other is no energy of the loop's.
    let safety = &statistics[1].safety;
    assert_eq!((safety.faults(), safety.ticks(Cut::Passivity)), (0, 0));
}

#[test]
fn as_fast_as_it_goes_the_same_run_is_the_same() {
    let run = || {
        let options = ServoOptions { timing: Timing::Simulated, duration: Some(1.0), ..Default::default() };
        let servo = || Servo::new(options).expect("options in range");
        let mut duo = blocks();
        let mut ticks = Vec::new();
        let mut observe = |which: usize, tick: &ServoTick, (): &()| ticks.push((which, tick.state, tick.wrench));
        let step = |states: &[DeviceState; 2], dt: f64| {
            let probes = states.map(|state| ProbeState { pose_ba: state.pose, twist: state.twist });
            duo.step(&probes, dt, &NoClock).map(felt)
        };
        let stop = AtomicBool::new(false);
        servo().run_both(&mut servo(), [&mut pressing(0), &mut pressing(1)], step, &mut observe, &stop);
        ticks
    };
    let first = run();
    assert_eq!(first.len(), 2000);
    assert!(first == run());
}
