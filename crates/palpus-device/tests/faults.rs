//! Thousands of seeded sequences of faults run through the whole loop in virtual time. The hand
//! must be safe in all sequences. For every sequence the commanded wrench must satisfy these
//! conditions:
//! 1. The wrench is finite and within the plausible peak of the device, whatever the device states.
//! 2. The wrench changes by at most the slew limit from message to message, even at a fault or when
//!    a force is withheld.
//! 3. From 2 ms after a fault on, the wrench only damps the true motion of the grip.
//! 4. The force returns only through engagement: after a time without faults, from a small wrench,
//!    along the ramp.
//! 5. The run ends with zero, or with the device's brake applied.
//! 6. After three faults in ten seconds the force stays zero until the user presses a button or
//!    key.
//!
//! Every fault must also be named in the counters of the run.

mod fault_sequence;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use fault_sequence::judge::{judge, judge_names, within};
use fault_sequence::{Ran, Sequence};
use glam::DVec3;
use palpus::algebra::Random;
use palpus::algebra::{Pose, Wrench};
use palpus_device::{
    AfterPanic, Cut, Cuts, DeviceError, DeviceState, Fault, HapticDevice, Phase, RunEnd, RunStatistics, SafetyLimits,
    SafetyOptions, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings, StepOutcome, VirtualTime,
    known_devices,
};

/// Seed of the sequences; printed with each failure.
const SEED: u64 = 0x5afe_7001;
/// Number of sequences in the default run.
const SEQUENCES: u64 = 1000;
/// Number of sequences in the long run.
const MANY_SEQUENCES: u64 = 20_000;

fn try_sequence(seed: u64) -> RunStatistics {
    let sequence = Sequence::new(seed);
    let ran = sequence.run();
    judge(&sequence, &ran);
    let Ran { ticks, written, statistics, braked, .. } = ran;
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

/// Runs `count` sequences. Every cut that faults can cause must occur.
fn try_sequences(count: u64) {
    let mut random = Random::new(SEED);
    let mut seen = Cuts::NONE;
    let (mut faults, mut ends) = (0, [0u32; 4]);
    for _ in 0..count {
        let seed = random.bits();
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
            seen.has(cut) || matches!(cut, Cut::Passivity | Cut::Heat | Cut::Paused | Cut::LimitCycle),
            "{} was never seen",
            cut.name()
        );
    }
    assert!(faults > count && ends.iter().all(|end| u64::from(*end) * 100 > count), "{faults} faults, ends {ends:?}");
}

#[test]
fn hand_is_safe_in_every_fault_sequence() {
    try_sequences(SEQUENCES);
}

#[test]
#[ignore = "twenty thousand sequences take a minute"]
fn hand_is_safe_in_many_fault_sequences() {
    try_sequences(MANY_SEQUENCES);
}

/// Runs a sequence with one fault at tick `AT`; otherwise the device is engaged and there are no
/// faults.
fn single(fault: Fault, duration: f64) -> (Vec<ServoTick>, RunStatistics) {
    let mut sequence = Sequence::new(SEED);
    let rate_hz = 1000.0;
    let [premium, ..] = known_devices();
    let limits = SafetyLimits { ramp: 0.04, hold: 0.03, ..SafetyLimits::of(&premium, rate_hz) };
    let safety =
        SafetyOptions { limits: Some(limits), loosened: true, after_panic: AfterPanic::AsFault, ..Default::default() };
    let options = ServoOptions { rate_hz, duration: Some(duration), safety, ..Default::default() };
    (sequence.rate_hz, sequence.spec, sequence.limits, sequence.options) = (rate_hz, premium, limits, options);
    (sequence.ends_at, sequence.faults) = (None, vec![(AT, fault)]);
    let ran = sequence.run();
    judge(&sequence, &ran);
    let Ran { ticks, statistics, .. } = ran;
    (ticks, statistics)
}

const AT: u64 = 200;

#[test]
fn every_fault_is_named_and_acts_in_its_tick() {
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
        Fault::Suspended(Duration::from_secs(60)),
        Fault::NonFiniteWrench,
        Fault::Panic,
    ] {
        let (ticks, statistics) = single(fault, 0.6);
        let cut = fault.shown_as().expect("the fault has a cut");
        assert!(statistics.safety.ticks(cut) > 0, "{fault:?}: {:?}", statistics.safety);
        assert_eq!((statistics.ticks, &statistics.end), (600, &RunEnd::Duration), "{fault:?}");
        let before = ticks.iter().find(|tick| tick.index == AT - 1).expect("the tick is observed");
        assert_eq!(before.phase, Phase::Engaged, "{fault:?}");
        let fell =
            ticks.iter().find(|tick| tick.index >= AT && tick.phase == Phase::Faulted).expect("the device must fault");
        // A state counts as frozen after ten ticks. A late write is detected in the next tick.
        let patience = match fault {
            Fault::Frozen(_) => 10,
            Fault::LateWrite(_) | Fault::Panic => 1,
            _ => 0,
        };
        assert!(fell.index - AT <= patience, "{fault:?}: at tick {}", fell.index);
        assert_eq!(
            ticks.last().map(|tick| tick.phase),
            Some(Phase::Engaged),
            "the device must engage again after {fault:?}"
        );
    }
}

#[test]
fn stuck_sensor_is_found_by_its_velocity() {
    let (_, statistics) = single(Fault::Stuck(1500), 2.0);
    assert!(statistics.safety.ticks(Cut::FrozenState) > 0, "{:?}", statistics.safety);
}

#[test]
fn excessive_torque_is_cut_without_a_fault() {
    let (ticks, statistics) = single(Fault::Wrench(0.5, 1e3), 0.6);
    assert_eq!(statistics.safety.faults(), 0);
    let cut = ticks.iter().find(|tick| tick.index == AT).expect("the tick is observed");
    assert!(cut.cuts.has(Cut::Slew) || cut.cuts.has(Cut::Saturation));
    assert!(cut.wrench.torque.length() <= 0.188);
}

#[test]
fn dropped_connection_ends_the_run_with_the_brake() {
    let mut sequence = Sequence::new(SEED);
    (sequence.ends_at, sequence.faults) = (None, vec![(AT, Fault::Dropped)]);
    let ran = sequence.run();
    judge(&sequence, &ran);
    let Ran { statistics, braked, .. } = ran;
    assert!(matches!(statistics.end, RunEnd::DeviceFailed(DeviceError::Lost(_))), "{:?}", statistics.end);
    assert!(braked && statistics.safety.ticks(Cut::Device) == 1 && statistics.ticks == AT);
}

#[test]
fn repeated_fault_prevents_engaging() {
    let faults: Vec<(u64, Fault)> = (0..20).map(|k| (AT + 20 * k, Fault::NonFiniteWrench)).collect();
    let mut sequence = Sequence::new(SEED);
    let [premium, ..] = known_devices();
    sequence.limits = SafetyLimits { ramp: 0.04, hold: 0.03, ..SafetyLimits::of(&premium, 1000.0) };
    let safety = SafetyOptions { limits: Some(sequence.limits), loosened: true, ..Default::default() };
    sequence.options = ServoOptions { rate_hz: 1000.0, duration: Some(0.6), safety, ..Default::default() };
    (sequence.rate_hz, sequence.spec, sequence.faults, sequence.ends_at) = (1000.0, premium, faults, None);
    let ran = sequence.run();
    judge(&sequence, &ran);
    let Ran { ticks, statistics, .. } = ran;
    assert!(ticks[AT as usize..].iter().all(|tick| !tick.phase.is_on()));
    assert_eq!(statistics.safety.faults(), 20);
}

#[test]
fn panic_in_observer_brakes_and_propagates() {
    let time = VirtualTime::default();
    let mut device =
        SimulatedDevice::new(SimulationSettings::default(), |_: f64| Pose::IDENTITY).expect("the settings are valid");
    let brake = device.brake().expect("a simulated device has a brake");
    let mut observer = |tick: &ServoTick, (): &()| {
        if tick.index == 5 {
            std::panic::resume_unwind(Box::new("test panic in the observer"));
        }
    };
    let mut servo = Servo::new(ServoOptions::default()).expect("the options are valid");
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let step = |_: &DeviceState, _: f64| StepOutcome::of(Wrench::ZERO);
        servo.run_in(&time, &mut device, step, &mut observer, &AtomicBool::new(false))
    }));
    assert!(outcome.is_err() && brake.is_applied());
}
