//! Whatever goes wrong, the hand is safe: thousands of seeded sequences of faults through the whole loop, in virtual time.
//!
//! Of every sequence it must hold that the commanded wrench
//! 1. is finite and within the peak of what may be believed of the device, whatever the device says of itself;
//! 2. changes by no more than the slew limit from tick to tick, but for the fall at a fault;
//! 3. is nothing but damping in the very tick of a fault, and not even that where the motion cannot be believed;
//! 4. comes back only through engagement: after a time without fault, from a small wrench, along the ramp;
//! 5. ends with zero, or with the device's brake applied;
//!
//! and that every fault is named in the counters of the run.

use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Wrench};
use palpus_device::{
    AfterFault, AfterPanic, Brake, Cut, Cuts, DeviceError, DeviceSpec, DeviceState, Fault, FaultyDevice, HandImpedance,
    HapticDevice, Phase, RunEnd, RunStatistics, SafetyLimits, SafetyOptions, Script, Servo, ServoOptions, ServoTick,
    SimulatedDevice, SimulationSettings, StepOutcome, VirtualTime, known_devices,
};

/// Of the sequences; printed with whatever fails.
const SEED: u64 = 0x5afe_7001;
/// In the default run.
const SEQUENCES: u64 = 1000;
/// In the long one.
const MANY_SEQUENCES: u64 = 20_000;
/// Of each sequence.
const TICKS: u64 = 600;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn direction(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0)).normalize_or(DVec3::X)
    }
}

/// Any fault, of a size that is one.
fn fault(random: &mut Random, limits: &SafetyLimits, rate_hz: f64) -> Fault {
    let stall = Duration::from_secs_f64(limits.stall * random.between(1.2, 4.0));
    let frozen = (limits.stale * rate_hz).ceil() as u32 + 3 + random.below(20) as u32;
    let wrench = 10f64.powf(random.between(0.0, 12.0));
    match random.below(18) {
        0 => Fault::NonFinitePose,
        1 => Fault::NonFiniteTwist,
        2 => Fault::NoRotation,
        3 => Fault::PoseJump(random.direction() * 10f64.powf(random.between(-1.5, 6.0))),
        4 => Fault::TurnJump(random.direction() * random.between(1.0, 3.0)),
        5 => Fault::Speed(limits.speed * random.between(2.0, 100.0)),
        6 => Fault::Frozen(frozen),
        7 => Fault::Stuck(frozen * 10),
        8 => Fault::DeviceClock(random.between(0.1, 1e6) * if random.unit() < 0.5 { -1.0 } else { 1.0 }),
        9 => Fault::LoopClock((random.between(-1.0, 1.0) * 1e10) as i64),
        10 => Fault::LateRead(stall),
        11 => Fault::LateStep(stall),
        12 => Fault::LateWrite(stall),
        13 if random.unit() < 0.3 => Fault::Dropped,
        13 | 14 => Fault::NonFiniteWrench,
        15 => Fault::Wrench(wrench, 0.01 * wrench),
        16 => Fault::Wrench(0.1, wrench),
        _ => Fault::Panic,
    }
}

/// What a device may say of itself, true or not.
fn claim(random: &mut Random, honest: &DeviceSpec) -> DeviceSpec {
    let lie = |random: &mut Random| [f64::INFINITY, f64::NAN, -5.0, 1e9, 0.0][random.below(5) as usize];
    let mut spec = honest.clone();
    match random.below(4) {
        0 => spec.force_max = lie(random),
        1 => spec.torque_max = lie(random),
        2 => {
            spec.name = Cow::Borrowed("unheard of");
            (spec.force_max, spec.torque_max) = (lie(random), lie(random));
            spec.force_continuous = Some(lie(random));
            spec.workspace = Some(DVec3::splat(lie(random)));
        }
        _ => {}
    }
    spec
}

/// A sequence of faults, and what is to be known to judge what came of it.
struct Sequence {
    seed: u64,
    rate_hz: f64,
    spec: DeviceSpec,
    limits: SafetyLimits,
    options: ServoOptions,
    faults: Vec<(u64, Fault)>,
}

impl Sequence {
    fn new(seed: u64) -> Self {
        let random = &mut Random(seed);
        let rate_hz = [500.0, 1000.0, 1000.0, 4000.0, 10_000.0][random.below(5) as usize];
        let known = known_devices();
        let honest = &known[random.below(known.len() as u64) as usize];
        let spec = claim(random, honest);
        // As derived, but for the times: a sequence is to see more than one engagement.
        let ticks = |count: f64| count / rate_hz;
        let limits = SafetyLimits { ramp: ticks(40.0), hold: ticks(30.0), ..SafetyLimits::of(&spec, rate_hz) };
        let safety = SafetyOptions {
            limits: Some(limits),
            loosened: true,
            after_fault: if random.unit() < 0.9 { AfterFault::Reengage } else { AfterFault::Stop },
            after_panic: if random.unit() < 0.7 { AfterPanic::AsFault } else { AfterPanic::Stop },
            ..SafetyOptions::default()
        };
        let options =
            ServoOptions { rate_hz, duration: Some(TICKS as f64 / rate_hz), safety, ..ServoOptions::default() };
        let mut faults: Vec<(u64, Fault)> = Vec::new();
        for _ in 0..1 + random.below(6) {
            faults.push((random.below(TICKS), fault(random, &limits, rate_hz)));
        }
        faults.sort_by_key(|(tick, _)| *tick);
        Self { seed, rate_hz, spec, limits, options, faults }
    }

    /// Runs it; answers every tick, every written wrench and the account.
    fn run(&self) -> (Vec<ServoTick>, Vec<Wrench>, RunStatistics, bool) {
        let time = VirtualTime::default();
        // So that a clock may run backwards.
        time.pass(Duration::from_secs(20));
        let script = Script::new(&self.faults, Some(&time));
        let settings = SimulationSettings {
            spec: DeviceSpec {
                force_max: f64::INFINITY,
                torque_max: f64::INFINITY,
                ..SimulationSettings::default().spec
            },
            rate_hz: self.rate_hz,
            hand: HandImpedance::NORMAL,
            ..SimulationSettings::default()
        };
        let intent = |t: f64| {
            Pose::new(
                DQuat::from_rotation_y(0.2 * (9.0 * t).sin()),
                DVec3::new(0.01 * (12.0 * t).cos() - 0.008, 0.0, 0.02 * t),
            )
        };
        let hand = SimulatedDevice::new(settings, intent).expect("settings in range");
        let mut device =
            FaultyDevice::new(Scribe { device: hand, written: Vec::new() }, &script).claiming(self.spec.clone());
        let brake = device.brake().expect("a simulated device has one");
        let mut ticks = Vec::new();
        let mut observer = |tick: &ServoTick, (): &()| ticks.push(*tick);
        let mut servo = Servo::new(self.options).expect("options in range");
        let step = script.step(wall(self.seed));
        let statistics = servo.run_in(&time, &mut device, step, &mut observer, &AtomicBool::new(false));
        let written = device.device().written.clone();
        (ticks, written, statistics, brake.is_applied())
    }
}

/// A wall with a rough surface, a small pull everywhere, and now and then something larger than any device.
fn wall(seed: u64) -> impl FnMut(&DeviceState, f64) -> StepOutcome {
    let mut random = Random(seed ^ 0xf00d);
    move |state, _| {
        let depth = (-state.pose.translation.x).max(0.0);
        let rough = if random.unit() < 0.02 { random.between(0.0, 30.0) } else { 0.0 };
        let force = DVec3::X * (600.0 * depth).min(1e6) + random.direction() * (0.05 + rough);
        StepOutcome::of(Wrench { force, torque: random.direction() * (0.001 + 0.02 * rough) })
    }
}

/// Remembers what was written.
struct Scribe<D> {
    device: D,
    written: Vec<Wrench>,
}

impl<D: HapticDevice> HapticDevice for Scribe<D> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.device.read()
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.written.push(*wrench);
        self.device.write(wrench)
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }
}

/// Relative room for rounding.
const ROUNDING: f64 = 1e-6;

fn within(wrench: &Wrench, force: f64, torque: f64) -> bool {
    wrench.is_finite()
        && wrench.force.length() <= force * (1.0 + ROUNDING)
        && wrench.torque.length() <= torque * (1.0 + ROUNDING)
}

/// Properties 1 to 4 over the ticks that were seen.
fn judge(sequence: &Sequence, ticks: &[ServoTick]) {
    let Sequence { limits, rate_hz, .. } = sequence;
    let period = 1.0 / rate_hz;
    let mut last = Wrench::ZERO;
    let (mut clean, mut ramp) = (f64::INFINITY, 0.0);
    let mut phase = Phase::Idle;
    let mut index = None;
    for tick in ticks {
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        let wrench = &tick.wrench;
        assert!(within(wrench, limits.force_peak, limits.torque_peak), "{at}: {wrench:?} beyond the peak");
        // Ticks that panicked are not seen.
        let follows = index.is_none_or(|index: u64| index + 1 == tick.index);
        if !follows {
            (clean, last, phase) = (0.0, Wrench { force: DVec3::NAN, torque: DVec3::NAN }, Phase::Faulted);
        }
        let step = (wrench.force.distance(last.force), wrench.torque.distance(last.torque));
        if !tick.cuts.is_fault() && follows {
            let most = (limits.force_slew * period, limits.torque_slew * period);
            let is_within = step.0 <= most.0 * (1.0 + ROUNDING) && step.1 <= most.1 * (1.0 + ROUNDING);
            assert!(is_within, "{at}: {step:?} in one tick, {most:?} allowed");
        }
        if tick.cuts.is_fault() {
            let is_rest =
                within(wrench, limits.rest_force, limits.rest_torque) && wrench.power(&tick.state.twist) <= 0.0;
            assert!(is_rest, "{at}: {wrench:?} at a fault");
            assert!(!tick.phase.is_on(), "{at}");
            clean = 0.0;
        } else {
            clean += period;
        }
        if tick.phase.is_on() {
            if !phase.is_on() {
                let free = clean >= limits.hold * (1.0 - ROUNDING);
                assert!(free, "{at}: engaged {clean} s after a fault");
                let small = tick.computed.force.length() <= limits.engage_force;
                assert!(small && tick.phase == Phase::Ramping, "{at}: engaged with {:?}", tick.computed);
                ramp = 0.0;
            }
            let share = (ramp / limits.ramp).min(1.0) + ROUNDING;
            assert!(within(wrench, limits.force_peak * share, limits.torque_peak * share), "{at}: ahead of the ramp");
            ramp += period;
        } else if !tick.cuts.is_fault() && clean > 3.0 * period {
            // Waiting, or faulted for a while: nothing, or damping.
            assert!(within(wrench, limits.rest_force, limits.rest_torque), "{at}: {wrench:?} while {:?}", tick.phase);
        }
        (last, phase, index) = (*wrench, tick.phase, Some(tick.index));
    }
}

/// Every fault that happened is named. When two meet, one may hide the other, so only those that are alone are looked for.
fn judge_names(sequence: &Sequence, ticks: &[ServoTick], statistics: &RunStatistics) {
    let reads = statistics.ticks;
    // Nothing is held too long when nothing is held.
    let is_held = |tick: u64| ticks.iter().any(|seen| seen.index == tick && seen.wrench != Wrench::ZERO);
    // Ticks are counted from the first state that was one.
    let counts_reads = sequence.faults.first().is_none_or(|(tick, _)| *tick > 0);
    let lasting = |fault: &Fault| match fault {
        Fault::Frozen(ticks) | Fault::Stuck(ticks) => u64::from(*ticks),
        _ => 0,
    };
    for (k, (tick, fault)) in sequence.faults.iter().enumerate() {
        let alone =
            sequence.faults.iter().enumerate().all(|(other, (at, its))| {
                other == k || *at > tick + lasting(fault) + 2 || at + lasting(its) + 2 < *tick
            });
        // The first read has nothing to be compared with, and the last ones' end is not seen.
        let seen = *tick > 0 && tick + lasting(fault) + 1 < reads;
        let seen = match fault {
            Fault::LateRead(_) | Fault::LateStep(_) => seen && counts_reads && is_held(tick - 1),
            Fault::LateWrite(_) => seen && counts_reads && is_held(*tick),
            _ => seen,
        };
        if let Some(cut) = fault.shown_as().filter(|_| alone && seen) {
            assert!(
                statistics.safety.ticks(cut) > 0,
                "sequence {:#x}: {fault:?} at tick {tick} is not in {:?}",
                sequence.seed,
                statistics.safety
            );
        }
    }
}

fn try_sequence(seed: u64) -> RunStatistics {
    let sequence = Sequence::new(seed);
    let (ticks, written, statistics, braked) = sequence.run();
    judge(&sequence, &ticks);
    judge_names(&sequence, &ticks, &statistics);
    for wrench in &written {
        let limits = &sequence.limits;
        assert!(within(wrench, limits.force_peak, limits.torque_peak), "sequence {seed:#x}: {wrench:?} was written");
    }
    let failed = matches!(statistics.end, RunEnd::DeviceFailed(_));
    assert!(
        braked || !failed && written.last() == Some(&Wrench::ZERO),
        "sequence {seed:#x} ended with {:?}, {:?}",
        statistics.end,
        written.last()
    );
    statistics
}

/// How often each cut was seen over many sequences; each of those that faults lead to must be among them.
fn try_sequences(count: u64) {
    let mut random = Random(SEED);
    let mut seen = Cuts::NONE;
    let (mut faults, mut ends) = (0, [0u32; 4]);
    for _ in 0..count {
        let seed = random.next();
        let statistics = try_sequence(seed);
        for (cut, _) in statistics.safety.iter() {
            seen.note(cut, true);
        }
        faults += statistics.safety.faults();
        ends[match statistics.end {
            RunEnd::Duration => 0,
            RunEnd::DeviceFailed(_) => 1,
            RunEnd::Panicked(_) => 2,
            _ => 3,
        }] += 1;
    }
    for cut in Cut::ALL {
        assert!(
            seen.has(cut) || matches!(cut, Cut::Passivity | Cut::Heat | Cut::Paused),
            "{} was never seen",
            cut.name()
        );
    }
    assert!(faults > count && ends.iter().all(|end| u64::from(*end) * 100 > count), "{faults} faults, ends {ends:?}");
}

#[test]
fn whatever_goes_wrong_the_hand_is_safe() {
    try_sequences(SEQUENCES);
}

#[test]
#[ignore = "twenty thousand sequences take a minute"]
fn whatever_goes_wrong_the_hand_is_safe_at_length() {
    try_sequences(MANY_SEQUENCES);
}

/// One fault at a known place of a run that is otherwise quiet and engaged.
fn single(fault: Fault, duration: f64) -> (Vec<ServoTick>, RunStatistics) {
    let mut sequence = Sequence::new(SEED);
    let rate_hz = 1000.0;
    let [premium, ..] = known_devices();
    let limits = SafetyLimits { ramp: 0.04, hold: 0.03, ..SafetyLimits::of(&premium, rate_hz) };
    let safety =
        SafetyOptions { limits: Some(limits), loosened: true, after_panic: AfterPanic::AsFault, ..Default::default() };
    let options = ServoOptions { rate_hz, duration: Some(duration), safety, ..Default::default() };
    (sequence.rate_hz, sequence.spec, sequence.limits, sequence.options) = (rate_hz, premium, limits, options);
    sequence.faults = vec![(AT, fault)];
    let (ticks, _, statistics, _) = sequence.run();
    judge(&sequence, &ticks);
    (ticks, statistics)
}

const AT: u64 = 200;

#[test]
fn every_kind_of_fault_is_named_cuts_in_its_tick_and_passes() {
    let long = Duration::from_millis(40);
    for fault in [
        Fault::NonFinitePose,
        Fault::NonFiniteTwist,
        Fault::NoRotation,
        Fault::PoseJump(DVec3::Y * 0.02),
        Fault::TurnJump(DVec3::Z * 0.5),
        Fault::Speed(5.0),
        Fault::Frozen(30),
        Fault::DeviceClock(-3.0),
        Fault::DeviceClock(3.0),
        Fault::LateRead(long),
        Fault::LateStep(long),
        Fault::LateWrite(long),
        Fault::NonFiniteWrench,
        Fault::Panic,
    ] {
        let (ticks, statistics) = single(fault, 0.6);
        let cut = fault.shown_as().expect("it is bound to be shown");
        assert!(statistics.safety.ticks(cut) > 0, "{fault:?}: {:?}", statistics.safety);
        assert_eq!((statistics.ticks, &statistics.end), (600, &RunEnd::Duration), "{fault:?}");
        let before = ticks.iter().find(|tick| tick.index == AT - 1).expect("it was seen");
        assert_eq!(before.phase, Phase::Engaged, "{fault:?}");
        let fell = ticks.iter().find(|tick| tick.index >= AT && tick.phase == Phase::Faulted).expect("it faulted");
        // A state may be old for ten ticks before it is frozen; a late write is noticed by the next tick.
        let patience = match fault {
            Fault::Frozen(_) => 10,
            Fault::LateWrite(_) | Fault::Panic => 1,
            _ => 0,
        };
        assert!(fell.index - AT <= patience, "{fault:?}: at tick {}", fell.index);
        assert_eq!(ticks.last().map(|tick| tick.phase), Some(Phase::Engaged), "{fault:?} passes");
    }
}

#[test]
fn a_stuck_sensor_is_found_when_it_says_that_it_moves() {
    let (_, statistics) = single(Fault::Stuck(1500), 2.0);
    assert!(statistics.safety.ticks(Cut::FrozenState) > 0, "{:?}", statistics.safety);
}

#[test]
fn a_torque_beyond_the_device_is_cut_and_is_no_fault() {
    let (ticks, statistics) = single(Fault::Wrench(0.5, 1e3), 0.6);
    assert_eq!(statistics.safety.faults(), 0);
    let cut = ticks.iter().find(|tick| tick.index == AT).expect("it was seen");
    assert!(cut.cuts.has(Cut::Slew) || cut.cuts.has(Cut::Saturation));
    assert!(cut.wrench.torque.length() <= 0.188);
}

#[test]
fn a_connection_dropped_in_mid_command_ends_the_run_with_the_brake() {
    let mut sequence = Sequence::new(SEED);
    sequence.faults = vec![(AT, Fault::Dropped)];
    let (ticks, _, statistics, braked) = sequence.run();
    judge(&sequence, &ticks);
    assert!(matches!(statistics.end, RunEnd::DeviceFailed(DeviceError::Lost(_))), "{:?}", statistics.end);
    assert!(braked && statistics.safety.ticks(Cut::Device) == 1 && statistics.ticks == AT);
}

#[test]
fn a_fault_that_comes_again_and_again_never_lets_it_engage() {
    let faults: Vec<(u64, Fault)> = (0..20).map(|k| (AT + 20 * k, Fault::NonFiniteWrench)).collect();
    let mut sequence = Sequence::new(SEED);
    let [premium, ..] = known_devices();
    sequence.limits = SafetyLimits { ramp: 0.04, hold: 0.03, ..SafetyLimits::of(&premium, 1000.0) };
    let safety = SafetyOptions { limits: Some(sequence.limits), loosened: true, ..Default::default() };
    sequence.options = ServoOptions { rate_hz: 1000.0, duration: Some(0.6), safety, ..Default::default() };
    (sequence.rate_hz, sequence.spec, sequence.faults) = (1000.0, premium, faults);
    let (ticks, _, statistics, _) = sequence.run();
    judge(&sequence, &ticks);
    assert!(ticks[AT as usize..].iter().all(|tick| !tick.phase.is_on()));
    assert_eq!(statistics.safety.faults(), 20);
}

#[test]
fn a_panic_in_the_observer_brakes_and_goes_on_up() {
    let time = VirtualTime::default();
    let mut device = SimulatedDevice::new(SimulationSettings::default(), |_: f64| Pose::IDENTITY).expect("in range");
    let brake = device.brake().expect("a simulated device has one");
    let mut observer = |tick: &ServoTick, (): &()| {
        if tick.index == 5 {
            std::panic::resume_unwind(Box::new("on purpose"));
        }
    };
    let mut servo = Servo::new(ServoOptions::default()).expect("options in range");
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let step = |_: &DeviceState, _: f64| StepOutcome::of(Wrench::ZERO);
        servo.run_in(&time, &mut device, step, &mut observer, &AtomicBool::new(false))
    }));
    assert!(outcome.is_err() && brake.is_applied());
}
