//! Tests of loops that are late or stall, and of clocks that jump.

use std::cell::RefCell;
use std::time::Duration;

use super::super::*;
use super::{Scribe, go_on, guarded, pull, state_at};
use crate::device::Brake;
use crate::safety::{Cut, SafetyLimits};
use crate::{ReplayDevice, known_devices};

#[test]
fn real_time_ticks_are_paced_and_counted() {
    let options = ServoOptions { duration: Some(0.04), ..Default::default() };
    let mut device = Scribe::new();
    let mut late = 0.0f64;
    let mut observer = |tick: &ServoTick, _: &()| late = late.max(tick.lateness_s);
    let run = Servo::new(options).unwrap().run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut observer, &go_on());
    assert_eq!(run.ticks, 40);
    // The first tick begins at once, so at least 39 periods have passed.
    assert!(run.wall_s >= 0.039 - 1e-9 && run.duration_s == run.wall_s);
    let (period, lateness) = (run.period_us.unwrap(), run.lateness_us.unwrap());
    assert!(period.max >= period.p50 && period.p50 > 0.0);
    assert!(lateness.max * 1e-6 >= late * 0.99);
}

#[test]
fn slow_step_is_an_overrun_and_skips_periods() {
    let options = ServoOptions { duration: Some(0.01), ..Default::default() };
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        if (0.0035..0.0045).contains(&state.time) {
            std::thread::sleep(Duration::from_micros(3500));
        }
        StepOutcome::of(pull(1.0))
    };
    let late = RefCell::new(Vec::new());
    let mut observer = |tick: &ServoTick, _: &()| late.borrow_mut().extend(tick.overrun.then_some(tick.index));
    let run = Servo::new(options).unwrap().run(&mut device, step, &mut observer, &go_on());
    // The tick that slept is late. The next tick is late too, since it was due during the sleep.
    assert!(late.borrow().contains(&4) && late.borrow().contains(&5));
    assert_eq!((run.ticks, run.overruns), (10, late.borrow().len() as u64));
    assert!(run.skipped >= 2);
}

#[test]
fn watchdog_brakes_a_stalled_loop_until_engaged_again() {
    let mut device = Scribe::new();
    let (time, brake) = (VirtualTime::default(), Arc::clone(&device.brake));
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        if tick == 400 {
            let stall = SafetyLimits::of(&known_devices()[0], 1000.0).stall;
            time.pass(Duration::from_secs_f64(0.9 * stall));
            assert!(!brake.is_applied());
            time.pass(Duration::from_secs_f64(0.1 * stall + 2e-3));
            assert!(brake.is_applied(), "the brake must be applied during the step");
            time.pass(Duration::from_millis(300));
        }
        // A force above the engage limit keeps the device from being engaged at once.
        StepOutcome::of(pull(if (400..800).contains(&tick) { 4.0 } else { 0.5 }))
    };
    let mut phases = Vec::new();
    let mut observer = |tick: &ServoTick, _: &()| {
        phases.push(tick.phase);
        assert_eq!(brake.is_applied(), (399..799).contains(&tick.index), "tick {}", tick.index);
    };
    let run = guarded(1.2, SafetyOptions::default()).run_in(&time, &mut device, step, &mut observer, &go_on());
    assert_eq!((run.safety.faults(), run.safety.ticks(Cut::Watchdog), run.safety.ticks(Cut::LateLoop)), (1, 1, 1));
    assert_eq!(run.end, RunEnd::Duration);
    phases.dedup();
    use Phase::{Engaged, Faulted, Ramping, Waiting};
    assert_eq!(phases, [Ramping, Engaged, Faulted, Waiting, Ramping, Engaged]);
    // The grip moves by 1 mm per tick, but its twist is zero: there is nothing to damp.
    assert!(device.written[399..799].iter().all(|wrench| *wrench == Wrench::ZERO));
}

#[test]
fn watchdog_runs_in_its_own_thread() {
    let mut device = Scribe::new();
    let brake = Arc::clone(&device.brake);
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        let begun = std::time::Instant::now();
        // The step lasts until the brake is applied, at most a minute.
        while tick == 20 && !brake.is_applied() && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(1));
        }
        StepOutcome::of(pull(0.5))
    };
    let limits = SafetyLimits { ramp: 0.01, ..SafetyLimits::of(&known_devices()[0], 1000.0) };
    let safety = SafetyOptions { limits: Some(limits), loosened: true, ..Default::default() };
    let run = guarded(0.05, safety).run(&mut device, step, &mut (), &go_on());
    assert!(run.safety.ticks(Cut::Watchdog) >= 1 && run.safety.ticks(Cut::LateLoop) >= 1, "{:?}", run.safety);
}

#[test]
fn loop_without_brake_detects_its_own_stall() {
    let states = (0..1000).map(state_at).collect();
    let mut device = ReplayDevice::new(Scribe::new().spec, states);
    let time = VirtualTime::default();
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        time.pass(Duration::from_millis(if tick == 400 { 100 } else { 0 }));
        StepOutcome::of(pull(0.5))
    };
    let mut at_stall = None;
    let mut observer = |tick: &ServoTick, _: &()| at_stall = at_stall.or((tick.index == 399).then_some(tick.wrench));
    let run = guarded(1.0, SafetyOptions::default()).run_in(&time, &mut device, step, &mut observer, &go_on());
    assert_eq!((run.safety.ticks(Cut::LateLoop), run.safety.ticks(Cut::Watchdog), run.skipped), (1, 0, 99));
    assert_eq!(at_stall, Some(Wrench::ZERO));
}

#[test]
fn late_loop_without_force_is_no_fault() {
    let mut device = Scribe::new();
    let time = VirtualTime::default();
    let step = |_: &DeviceState, _| {
        time.pass(Duration::from_millis(200));
        StepOutcome::of(Wrench::ZERO)
    };
    let run = guarded(0.05, SafetyOptions::default()).run_in(&time, &mut device, step, &mut (), &go_on());
    assert_eq!((run.safety.ticks(Cut::LateLoop), run.safety.ticks(Cut::Watchdog), run.overruns), (0, 0, 50));
    assert!(!device.brake.is_applied());
}

/// Runs a loop of 1 kHz at 0.5 N for two seconds, in which every `every`-th step takes `long`.
fn run_with_late_ticks(every: u64, long: Duration) -> (RunStatistics, Vec<ServoTick>) {
    let mut device = Scribe::new();
    // The grip is at rest, so a pose that is read late is no jump.
    device.read = |tick| Ok(DeviceState { pose: palpus::algebra::Pose::IDENTITY, ..state_at(tick) });
    let time = VirtualTime::default();
    let mut count = 0;
    let step = |_: &DeviceState, _| {
        count += 1;
        time.pass(if count % every == 0 { long } else { Duration::ZERO });
        StepOutcome::of(pull(0.5))
    };
    let mut ticks = Vec::new();
    let mut observer = |tick: &ServoTick, _: &()| ticks.push(*tick);
    let mut servo = guarded(2.0, SafetyOptions::default());
    let run = servo.run_in(&time, &mut device, step, &mut observer, &go_on());
    (run, ticks)
}

#[test]
fn persistent_overrun_removes_the_force() {
    // Each tick takes three periods, which is too short for the watchdog.
    let (run, ticks) = run_with_late_ticks(1, Duration::from_millis(3));
    assert!(run.safety.ticks(Cut::Overrun) > 0 && run.safety.ticks(Cut::Watchdog) == 0, "{:?}", run.safety);
    let first = ticks.iter().position(|tick| tick.cuts.has(Cut::Overrun)).expect("a loop that stays late must overrun");
    assert!((80..=90).contains(&first), "the overrun must be found after a quarter of a second, not at tick {first}");
    assert!(ticks[first..].iter().all(|tick| tick.wrench == Wrench::ZERO), "the force must be zero from this tick on");
}

#[test]
fn one_late_tick_in_twelve_is_allowed_but_not_in_eight() {
    let long = Duration::from_micros(1100);
    let (run, ticks) = run_with_late_ticks(12, long);
    assert_eq!((run.safety.faults(), ticks.last().map(|tick| tick.phase)), (0, Some(Phase::Engaged)));
    let (run, _) = run_with_late_ticks(8, long);
    assert!(run.safety.ticks(Cut::Overrun) > 0, "{:?}", run.safety);
}

#[test]
fn clock_jump_neither_hangs_loop_nor_holds_force() {
    for nanos in [-3_600_000_000_000i64, 3_600_000_000_000, -2_000_000, 2_000_000] {
        let mut device = Scribe::new();
        let time = VirtualTime::default();
        time.pass(Duration::from_secs(7200));
        let mut tick = 0;
        let step = |_: &DeviceState, _| {
            tick += 1;
            if tick == 300 {
                time.leap(nanos);
            }
            StepOutcome::of(pull(0.5))
        };
        let run = guarded(0.5, SafetyOptions::default()).run_in(&time, &mut device, step, &mut (), &go_on());
        assert_eq!((run.ticks, run.end), (500, RunEnd::Duration), "{nanos}");
        let late = u64::from(nanos > 1_000_000_000);
        assert_eq!(run.safety.ticks(Cut::LateLoop), late, "{nanos}");
        assert_eq!(device.written.len(), 501);
    }
}
