//! Tests of undisturbed runs and their statistics.

use std::cell::RefCell;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::super::*;
use super::{Scribe, fast, go_on, open, pull, state_at};
use crate::{
    Cut, EnableMode, HandImpedance, ReplayDevice, SafetyChain, SafetyLimits, SimulatedDevice, SimulationSettings,
};

#[test]
fn run_lasts_its_duration_and_ends_with_zero() {
    let mut device = Scribe::new();
    let run = fast(0.05).run(&mut device, |_, dt| StepOutcome::of(pull(1000.0 * dt)), &mut (), &go_on());
    assert_eq!((run.ticks, run.end, run.safety.faults()), (50, RunEnd::Duration, 0));
    assert!((run.duration_s - 0.05).abs() < 1e-12 && run.period_us.is_none());
    assert_eq!(device.written.len(), 51);
    assert!(device.written[..50].iter().all(|wrench| *wrench == pull(1.0)));
    assert_eq!(device.written[50], Wrench::ZERO);
}

#[test]
fn statistics_of_a_run_are_correct() {
    let mut device = Scribe::new();
    // The force is 1, 2, 3, 1, 2, 3, … N along a motion of 1 mm per tick.
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        let newtons = f64::from((tick - 1) % 3 + 1);
        StepOutcome {
            wrench: pull(newtons),
            saturated: newtons > 2.5,
            changed: false,
            received: [0.0; 2],
            from_others: [0.0; 2],
            detail: (),
        }
    };
    let run = fast(0.03).run(&mut device, step, &mut (), &go_on());
    assert_eq!((run.force_max, run.force_step_max, run.torque_max), (3.0, 2.0, 0.0));
    assert_eq!(run.saturated_ticks, 10);
    // The motion has 29 steps of 1 mm: ten rounds of 6 N, without the last wrench, which acts over
    // no step.
    assert!((run.energy.translation - (60.0 - 3.0) * 1e-3).abs() < 1e-12);
    assert_eq!(run.energy.highest, run.energy.translation);
}

#[test]
fn withheld_force_is_counted_and_replayed() {
    let mut device = Scribe::new();
    device.read = |tick| Ok(DeviceState { withheld: (400..403).contains(&tick), ..state_at(tick / 10) });
    let options = ServoOptions { timing: Timing::Simulated, duration: Some(0.5), ..Default::default() };
    let mut servo = Servo::new(options).unwrap();
    let mut ticks = Vec::new();
    let step = |state: &DeviceState, _| StepOutcome::of(pull(if state.time > 0.03 { 4.0 } else { 0.0 }));
    let run = servo.run(&mut device, step, &mut |tick: &ServoTick, _: &()| ticks.push(*tick), &go_on());
    assert_eq!((run.safety.ticks(Cut::Withheld), run.safety.faults()), (3, 0));
    assert_eq!(ticks[399].wrench, pull(4.0));
    assert!(ticks[400..403].iter().all(|tick| tick.wrench == Wrench::ZERO));
    assert!(ticks[403].wrench.force.x > 0.0 && ticks[403].wrench.force.x < 0.2, "{:?}", ticks[403].wrench);
    assert_eq!(ticks[499].wrench, pull(4.0));
    let limits = SafetyOptions::default().limits(device.spec(), 1000.0);
    let mut chain = SafetyChain::new(&limits, EnableMode::Automatic, &SafetyOptions::default(), 1e-3);
    for tick in &ticks {
        let reported = Cuts::from_bits(tick.cuts.bits()).and(Cuts::INPUTS);
        assert_eq!(
            chain.shape(&tick.state, &tick.computed, reported, tick.elapsed_s).wrench,
            tick.wrench,
            "tick {}",
            tick.index
        );
    }
}

#[test]
fn stop_flag_ends_a_run() {
    let stop = go_on();
    let mut device = Scribe::new();
    let mut observer = |tick: &ServoTick, _: &()| stop.store(tick.index == 20, Ordering::Relaxed);
    let options = ServoOptions { timing: Timing::Simulated, ..Default::default() };
    let run = Servo::new(options).unwrap().run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut observer, &stop);
    assert_eq!((run.ticks, run.end), (21, RunEnd::Stopped));
}

/// A wall at x = 0, into which the simulated operator moves.
fn wall(state: &DeviceState, _: f64) -> StepOutcome {
    let depth = (-state.pose.translation.x).max(0.0);
    StepOutcome::of(Wrench { force: DVec3::X * (400.0 * depth - 0.5 * state.twist.linear.x), torque: DVec3::ZERO })
}

fn hand() -> SimulatedDevice<impl crate::Intent> {
    let intent =
        |t: f64| Pose::new(DQuat::from_rotation_z((2.0 * t).sin()), DVec3::new(0.02 * (5.0 * t).cos(), 0.01 * t, 0.0));
    let settings = SimulationSettings { hand: HandImpedance::NORMAL, ..Default::default() };
    SimulatedDevice::new(settings, intent).unwrap()
}

#[test]
fn run_replay_and_real_time_run_are_identical() {
    let trace = |servo: &mut Servo, device: &mut dyn HapticDevice| {
        let rows = RefCell::new(Vec::new());
        let mut observer = |tick: &ServoTick, _: &()| rows.borrow_mut().push((tick.state, tick.wrench));
        let run = servo.run(device, wall, &mut observer, &go_on());
        (rows.into_inner(), run)
    };
    let (first, run) = trace(&mut fast(2.0), &mut hand());
    let (again, _) = trace(&mut fast(2.0), &mut hand());
    assert!(first == again && first.len() == 2000);
    assert!(run.force_max > 0.5, "the operator must touch the wall");
    assert!(run.energy.translation < 0.0, "a damped wall must take energy");

    let states: Vec<_> = first.iter().map(|(state, _)| *state).collect();
    let (replayed, replay) = trace(&mut fast(9.0), &mut ReplayDevice::new(hand().spec().clone(), states));
    assert!(replayed == first && replay.end == RunEnd::DeviceEnded);
    assert_eq!((replay.energy, replay.force_max), (run.energy, run.force_max));

    let options = ServoOptions { duration: Some(0.05), safety: open(), ..Default::default() };
    let (real, _) = trace(&mut Servo::new(options).unwrap(), &mut hand());
    assert!(real == first[..50]);
}

#[test]
fn loop_keeps_every_rate() {
    for rate_hz in [500.0, 1000.0, 4000.0, 10_000.0] {
        let options = ServoOptions { rate_hz, duration: Some(0.2), ..Default::default() };
        let mut device = Scribe::new();
        let step = |_: &DeviceState, _| StepOutcome::of(pull(0.1));
        let time = VirtualTime::default();
        let run = Servo::new(options).unwrap().run_in(&time, &mut device, step, &mut (), &go_on());
        assert_eq!(run.ticks, (0.2 * rate_hz) as u64);
        let period = run.period_us.unwrap();
        assert!((period.p50 * rate_hz * 1e-6 - 1.0).abs() < 2e-3 && (period.max * rate_hz * 1e-6 - 1.0).abs() < 2e-3);
        assert_eq!((run.overruns, run.late_ticks, run.skipped), (0, 0, 0));
    }
}

#[test]
fn out_of_range_options_are_refused() {
    let refuse = |options| Servo::new(options).err();
    assert_eq!(refuse(ServoOptions { rate_hz: 0.0, ..Default::default() }), Some(ServoError::Rate(0.0)));
    assert!(matches!(refuse(ServoOptions { rate_hz: f64::NAN, ..Default::default() }), Some(ServoError::Rate(_))));
    let negative = ServoOptions { duration: Some(-1.0), ..Default::default() };
    assert_eq!(refuse(negative), Some(ServoError::Duration(-1.0)));
    let limits = SafetyLimits { ramp: f64::NAN, ..open().limits.unwrap() };
    let safety = SafetyOptions { limits: Some(limits), loosened: true, ..Default::default() };
    assert_eq!(refuse(ServoOptions { safety, ..Default::default() }), Some(ServoError::Safety));
}
