//! Panics, invalid numbers, devices that fail: the force is taken away, and the run goes on or
//! ends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use glam::DVec3;
use palpus::algebra::{Pose, Twist};

use super::super::*;
use super::{Scribe, fast, go_on, guarded, pull, state_at};
use crate::device::{Brake, DeviceError};
use crate::safety::{AfterFault, AfterPanic, Cut, SafetyLimits};
use crate::{HandImpedance, ReplayDevice, SimulatedDevice, SimulationSettings};

#[test]
fn a_panic_in_the_step_ends_the_run_with_zero() {
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        assert!(state.time < 0.0095, "the tenth tick is not to be had");
        StepOutcome::of(pull(2.0))
    };
    let run = fast(1.0).run(&mut device, step, &mut (), &go_on());
    let said = |text: &str| text.starts_with("the tenth tick is not to be had (at ") && text.contains("faults.rs:");
    assert!(matches!(&run.end, RunEnd::Panicked(text) if said(text)), "{:?}", run.end);
    assert_eq!((run.ticks, run.safety.ticks(Cut::Panic), run.safety.faults()), (11, 1, 1));
    // Ten ticks, the one that panicked, a tenth of a second in which it would damp, and the last
    // word.
    assert_eq!(device.written.len(), 10 + 1 + 100 + 1);
    assert!(device.written[10..].iter().all(|wrench| *wrench == Wrench::ZERO));
}

/// Keeps every tick, and whether the step answered it.
struct Watcher(Vec<(ServoTick, bool)>);

impl TickObserver for Watcher {
    fn observe(&mut self, tick: &ServoTick, (): &()) {
        self.0.push((*tick, true));
    }

    fn unanswered(&mut self, tick: &ServoTick) {
        self.0.push((*tick, false));
    }
}

#[test]
fn panicking_tick_and_coast_are_observed() {
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        assert!(state.time < 0.0095, "the tenth tick is not to be had");
        StepOutcome::of(pull(2.0))
    };
    let mut watcher = Watcher(Vec::new());
    fast(1.0).run(&mut device, step, &mut watcher, &go_on());
    let seen = watcher.0;
    // Ten that were answered, the one that panicked, and a tenth of a second of damping.
    assert_eq!(seen.len(), 10 + 1 + 100);
    for (k, (tick, answered)) in seen.iter().enumerate() {
        assert_eq!((tick.index, *answered, tick.cuts.has(Cut::Panic)), (k as u64, k < 10, k == 10), "tick {k}");
        assert_eq!(tick.wrench, device.written[k], "tick {k}");
        assert_eq!(tick.phase == Phase::Stopped, k >= 10, "tick {k}");
    }
}

#[test]
fn a_refused_state_is_observed_as_it_was_read() {
    let mut device = Scribe::new();
    device.read = |tick| {
        let mut state = state_at(tick);
        state.pose.translation.y += if tick == 4 { f64::INFINITY } else { 0.0 };
        Ok(state)
    };
    let mut watcher = Watcher(Vec::new());
    fast(0.01).run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut watcher, &go_on());
    for (k, (tick, _)) in watcher.0.iter().enumerate() {
        assert_eq!(tick.read.time, state_at(k).time);
        assert_eq!((tick.read.pose == tick.state.pose, tick.state.pose.is_valid()), (k != 4, true), "tick {k}");
    }
}

#[test]
fn a_panic_outside_the_step_writes_zero_too() {
    let mut device = Scribe::new();
    let mut observer = |tick: &ServoTick, _: &()| assert!(tick.index < 3, "seen enough");
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        fast(1.0).run(&mut device, |_, _| StepOutcome::of(pull(2.0)), &mut observer, &go_on())
    }));
    assert!(outcome.is_err());
    assert_eq!(device.written.len(), 5);
    assert_eq!(device.written[4], Wrench::ZERO);
}

#[test]
fn a_panic_may_be_a_fault_like_any_other() {
    let mut device = Scribe::new();
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        assert!(tick != 300, "once");
        StepOutcome::of(pull(0.5))
    };
    let safety = SafetyOptions { after_panic: AfterPanic::AsFault, ..Default::default() };
    let mut servo = guarded(1.0, safety);
    let run = servo.run_in(&VirtualTime::default(), &mut device, step, &mut (), &go_on());
    assert_eq!((run.ticks, run.end), (1000, RunEnd::Duration));
    assert!(run.panic.is_some_and(|text| text.starts_with("once (at ")));
    assert_eq!((run.safety.faults(), run.safety.ticks(Cut::Panic)), (1, 1));
    assert_eq!(device.written[298], pull(0.5));
    assert!(device.written[299..549].iter().all(|wrench| *wrench == Wrench::ZERO));
    assert_eq!(device.written[999], pull(0.5));
}

#[test]
fn a_wrench_that_is_not_finite_becomes_zero_and_is_counted() {
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        let bad = (state.time * 1000.0).round() as u64 % 2 == 1;
        StepOutcome::of(if bad { pull(f64::NAN) } else { pull(1.0) })
    };
    let run = fast(0.01).run(&mut device, step, &mut (), &go_on());
    assert_eq!((run.ticks, run.safety.ticks(Cut::NonFiniteWrench), run.end), (10, 5, RunEnd::Duration));
    assert!(device.written.iter().skip(1).step_by(2).all(|wrench| *wrench == Wrench::ZERO));
    assert_eq!(run.force_max, 1.0);
}

#[test]
fn a_state_that_is_not_finite_is_not_stepped_on() {
    let mut device = Scribe::new();
    device.read = |tick| {
        let mut state = state_at(tick);
        if tick == 4 {
            state.pose.translation.y = f64::INFINITY;
        }
        Ok(state)
    };
    let step = |state: &DeviceState, _| {
        assert!(state.pose.is_valid());
        StepOutcome::of(pull(1.0))
    };
    let run = fast(0.01).run(&mut device, step, &mut (), &go_on());
    assert_eq!((run.ticks, run.safety.ticks(Cut::NonFiniteState), run.end), (10, 1, RunEnd::Duration));
    assert_eq!(device.written[4], Wrench::ZERO);
    assert!(run.energy.translation.is_finite());
}

#[test]
fn a_device_that_fails_is_a_fault_and_a_recording_that_ends_is_not() {
    let mut lost = Scribe::new();
    lost.read = |tick| if tick < 5 { Ok(state_at(tick)) } else { Err(DeviceError::Lost("unplugged".into())) };
    let run = fast(1.0).run(&mut lost, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert_eq!(run.end, RunEnd::DeviceFailed(DeviceError::Lost("unplugged".into())));
    assert_eq!((run.ticks, run.safety.ticks(Cut::Device)), (5, 1));
    assert_eq!(lost.written.last(), Some(&Wrench::ZERO));

    let mut refusing = Scribe::new();
    refusing.write = |wrench| {
        if *wrench == Wrench::ZERO { Ok(()) } else { Err(DeviceError::Refused("too warm".into())) }
    };
    let run = fast(1.0).run(&mut refusing, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert_eq!((run.ticks, run.end), (0, RunEnd::DeviceFailed(DeviceError::Refused("too warm".into()))));
    assert_eq!(refusing.written.last(), Some(&Wrench::ZERO));

    let mut recorded = ReplayDevice::new(Scribe::new().spec, (0..7).map(state_at).collect());
    let run = fast(1.0).run(&mut recorded, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert_eq!((run.ticks, run.end, run.safety.faults()), (7, RunEnd::DeviceEnded, 0));
}

#[test]
fn a_device_that_fails_gets_its_brake() {
    let mut device = Scribe::new();
    device.read = |tick| if tick < 5 { Ok(state_at(tick)) } else { Err(DeviceError::Lost("unplugged".into())) };
    fast(1.0).run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert!(device.brake.is_applied());
}

#[test]
fn a_run_may_end_at_its_first_fault() {
    let mut device = Scribe::new();
    device.read = |tick| {
        let mut state = state_at(tick);
        state.pose.translation.y = if tick < 300 { 0.0 } else { 0.1 };
        state.twist.linear = DVec3::X;
        Ok(state)
    };
    let safety = SafetyOptions { after_fault: AfterFault::Stop, ..Default::default() };
    let step = |_: &DeviceState, _| StepOutcome::of(pull(0.5));
    let run = guarded(1.0, safety).run_in(&VirtualTime::default(), &mut device, step, &mut (), &go_on());
    assert!(matches!(run.end, RunEnd::Faulted(cuts) if cuts.has(Cut::PoseJump)), "{:?}", run.end);
    assert_eq!((run.ticks, device.written.len()), (301, 300 + 1 + 100 + 1));
    // After the jump, whose velocity may be no velocity, the grip is damped once its poses say that
    // it moves; then nothing is left.
    assert!(device.written[300..302].iter().all(|wrench| *wrench == Wrench::ZERO));
    let damped = &device.written[302..401];
    assert!(damped.iter().all(|wrench| wrench.force.x < -0.1 && wrench.force.length() <= 0.85));
    assert_eq!(device.written[401], Wrench::ZERO);
}

/// After a fault, without a hand, the device comes to rest by the chain's damping.
#[test]
fn damping_after_a_fault_only_takes_energy() {
    for (speed, spin) in [(0.1, 1.0), (0.5, 5.0), (2.0, 20.0)] {
        let settings = SimulationSettings { hand: HandImpedance::NONE, ..Default::default() };
        let mut device = SimulatedDevice::new(settings, |_: f64| Pose::IDENTITY).unwrap();
        device.push(Twist { angular: DVec3::Z * spin, linear: DVec3::X * speed });
        let hold = SafetyLimits { hold: 10.0, ..SafetyLimits::of(device.spec(), 1000.0) };
        let safety = SafetyOptions { limits: Some(hold), ..Default::default() };
        let mut tick = 0;
        let step = |_: &DeviceState, _| {
            tick += 1;
            StepOutcome::of(pull(if tick == 3 { f64::NAN } else { 0.0 }))
        };
        let mut last = f64::INFINITY;
        let mut observer = |tick: &ServoTick, _: &()| {
            // Each tenth of a second is slower than the one before it, until the encoders see no
            // motion.
            if tick.index % 100 == 99 {
                let now = tick.state.twist.linear.length() + 0.1 * tick.state.twist.angular.length();
                assert!(now < last.max(1e-3), "{now} after {last} at {speed} m/s");
                last = now;
            }
        };
        let run = guarded(1.5, safety).run_in(&VirtualTime::default(), &mut device, step, &mut observer, &go_on());
        assert_eq!(run.safety.faults(), 1);
        assert!(run.energy.highest <= 0.0, "{:?}", run.energy);
        assert!(device.true_twist().linear.length() < 1e-3 && device.true_twist().angular.length() < 0.05);
    }
}

#[test]
fn a_panic_is_told_of_when_the_wrench_is_zero() {
    use std::sync::Mutex;
    /// Events in the loop's thread, in order.
    static SEEN: Mutex<Vec<&str>> = Mutex::new(Vec::new());
    std::thread::spawn(|| {
        let (this, usual) = (std::thread::current().id(), std::panic::take_hook());
        std::panic::set_hook(Box::new(move |panic| {
            if std::thread::current().id() == this {
                SEEN.lock().expect("nobody panics here").push("hook");
            } else {
                usual(panic);
            }
        }));
        // As a program does that has a hook of its own: the loop's is put before it.
        quiet::prepare_anew();
        let mut device = Scribe::new();
        device.write = |wrench| {
            if *wrench == Wrench::ZERO {
                SEEN.lock().expect("nobody panics here").push("zero");
            }
            Ok(())
        };
        let step = |state: &DeviceState, _| {
            assert!(state.time < 0.0015, "once");
            StepOutcome::of(pull(2.0))
        };
        fast(1.0).run(&mut device, step, &mut (), &go_on());
        let _ = catch_unwind(|| panic!("outside of a step it is printed"));
    })
    .join()
    .expect("what panics is caught");
    let seen = SEEN.lock().expect("nobody panics here");
    assert_eq!(seen.iter().position(|what| *what == "hook"), Some(seen.len() - 1), "{seen:?}");
    assert!(seen.iter().filter(|what| **what == "zero").count() > 2);
}

#[test]
fn a_machine_that_was_suspended_is_a_fault() {
    let mut device = Scribe::new();
    let time = VirtualTime::default();
    time.suspend(Duration::from_secs(60));
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        if tick == 400 {
            time.suspend(Duration::from_secs(3600));
        }
        StepOutcome::of(pull(0.5))
    };
    let run = guarded(1.0, SafetyOptions::default()).run_in(&time, &mut device, step, &mut (), &go_on());
    assert_eq!((run.safety.faults(), run.safety.ticks(Cut::Suspended)), (1, 1));
    assert!(device.written[398] == pull(0.5) && device.written[399] == Wrench::ZERO);
}

#[test]
fn a_run_ends_within_the_slew_limit() {
    let limits = SafetyLimits::of(&Scribe::new().spec, 1000.0);
    let mut device = Scribe::new();
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        StepOutcome::of(pull(if tick > 400 { 8.5 } else { 0.5 }))
    };
    guarded(0.5, SafetyOptions::default()).run_in(&VirtualTime::default(), &mut device, step, &mut (), &go_on());
    assert!(device.written.iter().any(|wrench| wrench.force.x > 8.0));
    for pair in device.written.windows(2) {
        let step = pair[1].force.distance(pair[0].force);
        assert!(step <= limits.force_slew * 1e-3 * (1.0 + 1e-9), "{step} N between two messages");
    }
    assert_eq!(device.written.last(), Some(&Wrench::ZERO));
}
