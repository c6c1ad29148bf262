//! Panics, invalid numbers and failing devices: the loop removes the force, and continues or ends
//! the run.

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
fn panic_in_step_ends_the_run_with_zero() {
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        assert!(state.time < 0.0095, "test panic in the tenth tick");
        StepOutcome::of(pull(2.0))
    };
    let run = fast(1.0).run(&mut device, step, &mut (), &go_on());
    let said = |text: &str| text.starts_with("test panic in the tenth tick (at ") && text.contains("faults.rs:");
    assert!(matches!(&run.end, RunEnd::Panicked(text) if said(text)), "{:?}", run.end);
    assert_eq!((run.ticks, run.safety.ticks(Cut::Panic), run.safety.faults()), (11, 1, 1));
    // The writes are: ten ticks, the tick that panicked, damping for 0.1 s, and the final zero.
    assert_eq!(device.written.len(), 10 + 1 + 100 + 1);
    assert!(device.written[10..].iter().all(|wrench| *wrench == Wrench::ZERO));
}

/// Keeps every tick, and whether the step returned a result in it.
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
        assert!(state.time < 0.0095, "test panic in the tenth tick");
        StepOutcome::of(pull(2.0))
    };
    let mut watcher = Watcher(Vec::new());
    fast(1.0).run(&mut device, step, &mut watcher, &go_on());
    let seen = watcher.0;
    // Ten ticks with a result, the tick that panicked, and damping for 0.1 s.
    assert_eq!(seen.len(), 10 + 1 + 100);
    for (k, (tick, answered)) in seen.iter().enumerate() {
        assert_eq!((tick.index, *answered, tick.cuts.has(Cut::Panic)), (k as u64, k < 10, k == 10), "tick {k}");
        assert_eq!(tick.wrench, device.written[k], "tick {k}");
        assert_eq!(tick.phase == Phase::Stopped, k >= 10, "tick {k}");
    }
}

#[test]
fn observer_gets_refused_state_as_read() {
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
fn panic_in_observer_writes_zero() {
    let mut device = Scribe::new();
    let mut observer = |tick: &ServoTick, _: &()| assert!(tick.index < 3, "test panic in the observer");
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        fast(1.0).run(&mut device, |_, _| StepOutcome::of(pull(2.0)), &mut observer, &go_on())
    }));
    assert!(outcome.is_err());
    assert_eq!(device.written.len(), 5);
    assert_eq!(device.written[4], Wrench::ZERO);
}

#[test]
fn panic_can_count_as_ordinary_fault() {
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
fn non_finite_wrench_becomes_zero_and_is_counted() {
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
fn step_never_gets_a_non_finite_state() {
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
fn failed_device_is_a_fault_but_end_of_recording_is_not() {
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
fn failed_device_gets_its_brake() {
    let mut device = Scribe::new();
    device.read = |tick| if tick < 5 { Ok(state_at(tick)) } else { Err(DeviceError::Lost("unplugged".into())) };
    fast(1.0).run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert!(device.brake.is_applied());
}

#[test]
fn run_can_end_at_first_fault() {
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
    // The reported velocity at the jump is not trusted. So the grip is damped only once its poses
    // show motion; then zero is written.
    assert!(device.written[300..302].iter().all(|wrench| *wrench == Wrench::ZERO));
    let damped = &device.written[302..401];
    assert!(damped.iter().all(|wrench| wrench.force.x < -0.1 && wrench.force.length() <= 0.85));
    assert_eq!(device.written[401], Wrench::ZERO);
}

/// A device that no operator holds comes to rest by the chain's damping.
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
            // Every 100 ticks the grip must be slower than before, until the encoders sense no
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
fn panic_is_printed_after_the_wrench_is_zero() {
    use std::sync::Mutex;
    /// Events in the loop's thread, in order.
    static SEEN: Mutex<Vec<&str>> = Mutex::new(Vec::new());
    std::thread::spawn(|| {
        let (this, usual) = (std::thread::current().id(), std::panic::take_hook());
        std::panic::set_hook(Box::new(move |panic| {
            if std::thread::current().id() == this {
                SEEN.lock().expect("no thread panics with this lock").push("hook");
            } else {
                usual(panic);
            }
        }));
        // A program may install its own hook later; the loop's hook is then placed before it.
        quiet::prepare_anew();
        let mut device = Scribe::new();
        device.write = |wrench| {
            if *wrench == Wrench::ZERO {
                SEEN.lock().expect("no thread panics with this lock").push("zero");
            }
            Ok(())
        };
        let step = |state: &DeviceState, _| {
            assert!(state.time < 0.0015, "once");
            StepOutcome::of(pull(2.0))
        };
        fast(1.0).run(&mut device, step, &mut (), &go_on());
        let _ = catch_unwind(|| panic!("a panic outside a step is printed"));
    })
    .join()
    .expect("all panics are caught");
    let seen = SEEN.lock().expect("no thread panics with this lock");
    assert_eq!(seen.iter().position(|what| *what == "hook"), Some(seen.len() - 1), "{seen:?}");
    assert!(seen.iter().filter(|what| **what == "zero").count() > 2);
}

#[test]
fn suspended_machine_is_a_fault() {
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
fn run_ends_within_slew_limit() {
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
