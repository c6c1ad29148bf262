use super::*;
use crate::device::{Brake, BrakeFlag, DeviceError};
use crate::safety::{AfterFault, AfterPanic, Cut, SafetyLimits};
use crate::{DeviceSpec, HandImpedance, ReplayDevice, SimulatedDevice, SimulationSettings, known_devices};
use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};
use std::cell::RefCell;
use std::sync::Arc;

/// A device that stays where it is and remembers what it was told.
struct Scribe {
    spec: DeviceSpec,
    written: Vec<Wrench>,
    reads: usize,
    read: fn(usize) -> Result<DeviceState, DeviceError>,
    write: fn(&Wrench) -> Result<(), DeviceError>,
    brake: Arc<BrakeFlag>,
}

impl Scribe {
    fn new() -> Self {
        let [spec, ..] = known_devices();
        let brake = Arc::default();
        Self { spec, written: Vec::new(), reads: 0, read: |tick| Ok(state_at(tick)), write: |_| Ok(()), brake }
    }
}

impl HapticDevice for Scribe {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.reads += 1;
        (self.read)(self.reads - 1)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.written.push(*wrench);
        (self.write)(wrench)
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }
}

fn state_at(tick: usize) -> DeviceState {
    let time = tick as f64 * 1e-3;
    DeviceState {
        pose: Pose::from_translation(DVec3::X * (1e-3 * tick as f64)),
        twist: Twist::default(),
        buttons: 0,
        time,
    }
}

fn pull(newtons: f64) -> Wrench {
    Wrench { force: DVec3::X * newtons, torque: DVec3::ZERO }
}

/// A chain that lets every wrench through that is one, at once: what is tested here is the loop.
fn open() -> SafetyOptions {
    let [spec, ..] = known_devices();
    let limits = SafetyLimits {
        force_peak: f64::INFINITY,
        force_continuous: f64::INFINITY,
        force_slew: f64::INFINITY,
        engage_force: f64::INFINITY,
        ramp: 0.0,
        hold: 0.0,
        stall: f64::INFINITY,
        damping: 0.0,
        ..SafetyLimits::of(&spec, 1000.0)
    };
    SafetyOptions { limits: Some(limits), loosened: true, ..Default::default() }
}

fn fast(duration: f64) -> Servo {
    let options =
        ServoOptions { timing: Timing::Simulated, duration: Some(duration), safety: open(), ..Default::default() };
    Servo::new(options).unwrap()
}

fn go_on() -> AtomicBool {
    AtomicBool::new(false)
}

#[test]
fn a_run_lasts_its_ticks_and_ends_with_zero() {
    let mut device = Scribe::new();
    let run = fast(0.05).run(&mut device, |_, dt| StepOutcome::of(pull(1000.0 * dt)), &mut (), &go_on());
    assert_eq!((run.ticks, run.end, run.safety.faults()), (50, RunEnd::Duration, 0));
    assert!((run.duration_s - 0.05).abs() < 1e-12 && run.period_us.is_none());
    assert_eq!(device.written.len(), 51);
    assert!(device.written[..50].iter().all(|wrench| *wrench == pull(1.0)));
    assert_eq!(device.written[50], Wrench::ZERO);
}

#[test]
fn the_account_of_a_run_adds_up() {
    let mut device = Scribe::new();
    // 1, 2, 3, 1, 2, 3, … N along a motion of 1 mm a tick.
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        let newtons = f64::from((tick - 1) % 3 + 1);
        StepOutcome { wrench: pull(newtons), saturated: newtons > 2.5, detail: () }
    };
    let run = fast(0.03).run(&mut device, step, &mut (), &go_on());
    assert_eq!((run.force_max, run.force_step_max, run.torque_max), (3.0, 2.0, 0.0));
    assert_eq!(run.saturated_ticks, 10);
    // 29 steps of 1 mm: ten rounds of 6 N less the last wrench, which was not held to a next tick.
    assert!((run.energy.translation - (60.0 - 3.0) * 1e-3).abs() < 1e-12);
    assert_eq!(run.energy.highest, run.energy.translation);
}

#[test]
fn a_panic_in_the_step_ends_the_run_with_zero() {
    let mut device = Scribe::new();
    let step = |state: &DeviceState, _| {
        assert!(state.time < 0.0095, "the tenth tick is not to be had");
        StepOutcome::of(pull(2.0))
    };
    let run = fast(1.0).run(&mut device, step, &mut (), &go_on());
    assert_eq!(run.end, RunEnd::Panicked("the tenth tick is not to be had".into()));
    assert_eq!((run.ticks, run.safety.ticks(Cut::Panic), run.safety.faults()), (11, 1, 1));
    // Ten ticks, the one that panicked, a tenth of a second in which it would damp, and the last word.
    assert_eq!(device.written.len(), 10 + 1 + 100 + 1);
    assert!(device.written[10..].iter().all(|wrench| *wrench == Wrench::ZERO));
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
fn the_stop_flag_ends_a_run() {
    let stop = go_on();
    let mut device = Scribe::new();
    let mut observer = |tick: &ServoTick, _: &()| stop.store(tick.index == 20, Ordering::Relaxed);
    let options = ServoOptions { timing: Timing::Simulated, ..Default::default() };
    let run = Servo::new(options).unwrap().run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut observer, &stop);
    assert_eq!((run.ticks, run.end), (21, RunEnd::Stopped));
}

#[test]
fn in_real_time_every_tick_is_paced_and_accounted_for() {
    let options = ServoOptions { duration: Some(0.04), ..Default::default() };
    let mut device = Scribe::new();
    let mut late = 0.0f64;
    let mut observer = |tick: &ServoTick, _: &()| late = late.max(tick.lateness_s);
    let run = Servo::new(options).unwrap().run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut observer, &go_on());
    assert_eq!(run.ticks, 40);
    // The first tick begins at once: 39 periods at least have gone by.
    assert!(run.wall_s >= 0.039 - 1e-9 && run.duration_s == run.wall_s);
    let (period, lateness) = (run.period_us.unwrap(), run.lateness_us.unwrap());
    assert!(period.max >= period.p50 && period.p50 > 0.0);
    assert!(lateness.max * 1e-6 >= late * 0.99);
}

#[test]
fn a_step_that_takes_several_periods_is_an_overrun_and_skips_them() {
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
    // The tick that slept is late, and so is the next one, which was due while it slept.
    assert!(late.borrow().contains(&4) && late.borrow().contains(&5));
    assert_eq!((run.ticks, run.overruns), (10, late.borrow().len() as u64));
    assert!(run.skipped >= 2);
}

/// After a fault, with nobody holding it, the device comes to rest by the chain's damping.
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
            // Each tenth of a second is slower than the one before it, until the encoders see no motion.
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

/// A wall at x = 0, felt by a simulated hand that means to go into it.
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
fn a_run_and_its_replay_are_the_same_bit_for_bit_and_so_is_a_run_in_real_time() {
    let trace = |servo: &mut Servo, device: &mut dyn HapticDevice| {
        let rows = RefCell::new(Vec::new());
        let mut observer = |tick: &ServoTick, _: &()| rows.borrow_mut().push((tick.state, tick.wrench));
        let run = servo.run(device, wall, &mut observer, &go_on());
        (rows.into_inner(), run)
    };
    let (first, run) = trace(&mut fast(2.0), &mut hand());
    let (again, _) = trace(&mut fast(2.0), &mut hand());
    assert!(first == again && first.len() == 2000);
    assert!(run.force_max > 0.5, "the hand met the wall");
    assert!(run.energy.translation < 0.0, "a damped wall takes energy");

    let states: Vec<_> = first.iter().map(|(state, _)| *state).collect();
    let (replayed, replay) = trace(&mut fast(9.0), &mut ReplayDevice::new(hand().spec().clone(), states));
    assert!(replayed == first && replay.end == RunEnd::DeviceEnded);
    assert_eq!((replay.energy, replay.force_max), (run.energy, run.force_max));

    let options = ServoOptions { duration: Some(0.05), safety: open(), ..Default::default() };
    let (real, _) = trace(&mut Servo::new(options).unwrap(), &mut hand());
    assert!(real == first[..50]);
}

/// In virtual time, with the thresholds of the device.
fn guarded(duration: f64, safety: SafetyOptions) -> Servo {
    Servo::new(ServoOptions { duration: Some(duration), safety, ..Default::default() }).unwrap()
}

#[test]
fn a_loop_that_stalls_loses_its_force_to_the_watchdog_and_gets_it_back_by_engaging() {
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
            assert!(brake.is_applied(), "while the loop is still in its step");
            time.pass(Duration::from_millis(300));
        }
        // Once more than is small, so that it is not engaged at once.
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
    // The grip is at 1 mm a tick and its twist says at rest: nothing to damp.
    assert!(device.written[399..799].iter().all(|wrench| *wrench == Wrench::ZERO));
}

#[test]
fn the_watchdog_has_a_thread_of_its_own() {
    let mut device = Scribe::new();
    let brake = Arc::clone(&device.brake);
    let mut tick = 0;
    let step = |_: &DeviceState, _| {
        tick += 1;
        let begun = std::time::Instant::now();
        // A step that does not come back before the brake is applied; a minute is for ever.
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
fn without_a_brake_the_loop_itself_sees_that_it_stalled() {
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
fn a_loop_that_holds_nothing_may_be_late() {
    let mut device = Scribe::new();
    let time = VirtualTime::default();
    let step = |_: &DeviceState, _| {
        time.pass(Duration::from_millis(200));
        StepOutcome::of(Wrench::ZERO)
    };
    let run = guarded(0.05, SafetyOptions::default()).run_in(&time, &mut device, step, &mut (), &go_on());
    assert_eq!((run.safety.faults(), run.overruns), (0, 50));
    assert!(!device.brake.is_applied());
}

#[test]
fn a_clock_that_jumps_neither_hangs_the_loop_nor_holds_a_force() {
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
    assert_eq!((run.ticks, run.end, run.panic.as_deref()), (1000, RunEnd::Duration, Some("once")));
    assert_eq!((run.safety.faults(), run.safety.ticks(Cut::Panic)), (1, 1));
    assert_eq!(device.written[298], pull(0.5));
    assert!(device.written[299..549].iter().all(|wrench| *wrench == Wrench::ZERO));
    assert_eq!(device.written[999], pull(0.5));
}

#[test]
fn a_run_may_end_at_its_first_fault() {
    let mut device = Scribe::new();
    device.read = |tick| {
        let mut state = state_at(tick);
        state.pose.translation.y = if tick < 300 { 0.0 } else { 0.1 };
        state.twist.linear = DVec3::Z * 0.2;
        Ok(state)
    };
    let safety = SafetyOptions { after_fault: AfterFault::Stop, ..Default::default() };
    let step = |_: &DeviceState, _| StepOutcome::of(pull(0.5));
    let run = guarded(1.0, safety).run_in(&VirtualTime::default(), &mut device, step, &mut (), &go_on());
    assert!(matches!(run.end, RunEnd::Faulted(cuts) if cuts.has(Cut::PoseJump)), "{:?}", run.end);
    assert_eq!((run.ticks, device.written.len()), (301, 300 + 1 + 100 + 1));
    // After the jump, whose velocity may be no velocity, the grip is damped; then nothing is left.
    assert_eq!(device.written[300], Wrench::ZERO);
    let damped = &device.written[301..401];
    assert!(damped.iter().all(|wrench| wrench.force.z < -0.1 && wrench.force.length() <= 0.85));
    assert_eq!(device.written[401], Wrench::ZERO);
}

#[test]
fn a_device_that_fails_gets_its_brake() {
    let mut device = Scribe::new();
    device.read = |tick| if tick < 5 { Ok(state_at(tick)) } else { Err(DeviceError::Lost("unplugged".into())) };
    fast(1.0).run(&mut device, |_, _| StepOutcome::of(pull(1.0)), &mut (), &go_on());
    assert!(device.brake.is_applied());
}

#[test]
fn every_rate_of_a_servo_is_kept() {
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
fn options_out_of_range_are_refused() {
    let refuse = |options| Servo::new(options).err();
    assert_eq!(refuse(ServoOptions { rate_hz: 0.0, ..Default::default() }), Some(ServoError::Rate(0.0)));
    assert!(matches!(refuse(ServoOptions { rate_hz: f64::NAN, ..Default::default() }), Some(ServoError::Rate(_))));
    let negative = ServoOptions { duration: Some(-1.0), ..Default::default() };
    assert_eq!(refuse(negative), Some(ServoError::Duration(-1.0)));
    let limits = SafetyLimits { ramp: f64::NAN, ..open().limits.unwrap() };
    let safety = SafetyOptions { limits: Some(limits), loosened: true, ..Default::default() };
    assert_eq!(refuse(ServoOptions { safety, ..Default::default() }), Some(ServoError::Safety));
}
