//! Conditions for every tick, as listed at the top of `faults.rs`.

use palpus::algebra::{Twist, Wrench};
use palpus_device::{Cut, Fault, Phase, Rearm, RunStatistics, ServoTick};

use super::{Ran, Sequence};

/// Relative tolerance for rounding.
const ROUNDING: f64 = 1e-6;

pub(crate) fn within(wrench: &Wrench, force: f64, torque: f64) -> bool {
    wrench.is_finite()
        && wrench.force.length() <= force * (1.0 + ROUNDING)
        && wrench.torque.length() <= torque * (1.0 + ROUNDING)
}

/// Speeds (m/s and rad/s) at which damping may push. A device's velocity is filtered and late, so
/// damping may push for a moment when the grip changes direction.
const TURNS: (f64, f64) = (0.02, 0.4);

/// Checks all conditions except the names of the faults.
pub(crate) fn judge(sequence: &Sequence, ran: &Ran) {
    judge_ticks(sequence, &ran.ticks);
    judge_latch(sequence, &ran.ticks);
    judge_messages(sequence, ran);
    let mut fall = Fall::new(sequence);
    for (tick, motion) in ran.ticks.iter().zip(&ran.motion) {
        if fall.is_over(tick) {
            judge_damping(sequence, tick, motion);
        }
    }
}

/// Time since the force was removed.
struct Fall {
    /// Number of ticks in which the slew limit reduces the peak to zero.
    ticks: u64,
    /// Index after the last tick in which the device got a computed wrench.
    since: u64,
}

impl Fall {
    fn new(sequence: &Sequence) -> Self {
        let Sequence { limits, rate_hz, .. } = sequence;
        let seconds = (limits.force_peak / limits.force_slew).max(limits.torque_peak / limits.torque_slew);
        // The torque limits may both be zero.
        let seconds = if seconds.is_finite() { seconds } else { limits.force_peak / limits.force_slew };
        Self { ticks: (seconds * rate_hz * (1.0 - ROUNDING)).ceil() as u64, since: 0 }
    }

    /// Takes the next `tick`. Returns true if no computed wrench can remain in this tick.
    fn is_over(&mut self, tick: &ServoTick) -> bool {
        if tick.phase.is_on() && !tick.cuts.has(Cut::Withheld) {
            self.since = tick.index + 1;
            return false;
        }
        // The wrench already falls by one step in the tick in which the fall begins.
        tick.index + 1 >= self.since + self.ticks
    }
}

/// Condition 3, for the true motion: after a fault, the remaining wrench does not push.
fn judge_damping(sequence: &Sequence, tick: &ServoTick, motion: &Twist) {
    let limits = &sequence.limits;
    if tick.cuts.is_fault() {
        let pushed = tick.wrench.force.dot(motion.linear) - limits.rest_force * TURNS.0;
        let turned = tick.wrench.torque.dot(motion.angular) - limits.rest_torque * TURNS.1;
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        assert!(pushed <= 0.0 && turned <= 0.0, "{at}: {:?} pushes a grip that moves by {motion:?}", tick.wrench);
    }
}

/// Condition 2: successive messages differ by at most one step of the slew limit.
fn judge_messages(sequence: &Sequence, ran: &Ran) {
    let Sequence { limits, rate_hz, seed, .. } = sequence;
    let most = (limits.force_slew / rate_hz, limits.torque_slew / rate_hz);
    for (k, pair) in ran.written.windows(2).enumerate() {
        let step = (pair[1].force.distance(pair[0].force), pair[1].torque.distance(pair[0].torque));
        let is_step = step.0 <= most.0 * (1.0 + ROUNDING) && step.1 <= most.1 * (1.0 + ROUNDING);
        assert!(is_step, "message {} of sequence {seed:#x}: {pair:?}, {most:?} allowed", k + 1);
    }
}

/// Condition 6: the force stays off after three faults.
fn judge_latch(sequence: &Sequence, ticks: &[ServoTick]) {
    let (mut faults, mut before, mut latched) = (0, Phase::Idle, false);
    for tick in ticks {
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        faults += u32::from(tick.phase.is_faulted() && !before.is_faulted());
        latched |= tick.phase == Phase::Latched;
        assert!(!(latched && tick.phase.is_on()), "{at}: a force was given after the latch");
        let automatic = sequence.options.safety.rearm == Rearm::Automatic;
        assert!(automatic || latched || faults < 3 || tick.phase == Phase::Stopped, "{at}: {faults} faults");
        before = tick.phase;
    }
}

/// Checks conditions 1 to 4 for the observed ticks.
fn judge_ticks(sequence: &Sequence, ticks: &[ServoTick]) {
    let Sequence { limits, rate_hz, .. } = sequence;
    let period = 1.0 / rate_hz;
    let mut fall = Fall::new(sequence);
    let (mut clean, mut ramp) = (f64::INFINITY, 0.0);
    let mut phase = Phase::Idle;
    let mut index = None;
    for tick in ticks {
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        let wrench = &tick.wrench;
        assert!(within(wrench, limits.force_peak, limits.torque_peak), "{at}: {wrench:?} beyond the peak");
        // A tick that panicked is missing in `ticks`; `judge_messages` checks its message.
        let follows = index.is_none_or(|index: u64| index + 1 == tick.index);
        if !follows {
            (clean, phase) = (0.0, Phase::Faulted);
        }
        let is_fallen = fall.is_over(tick);
        if tick.cuts.is_fault() {
            let rests = !is_fallen || within(wrench, limits.rest_force, limits.rest_torque);
            assert!(rests, "{at}: {wrench:?} at a fault");
            assert!(!tick.phase.is_on(), "{at}");
            clean = 0.0;
        } else {
            clean += period;
        }
        if tick.cuts.has(Cut::Withheld) && is_fallen {
            assert_eq!(*wrench, Wrench::ZERO, "{at}: the wrench must be zero while the device withholds its force");
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
            assert!(
                within(wrench, limits.force_peak * share, limits.torque_peak * share),
                "{at}: the wrench is above the ramp"
            );
            ramp += period;
        } else if !tick.cuts.is_fault() && is_fallen {
            // While waiting or faulted, the wrench is zero or damping.
            assert!(within(wrench, limits.rest_force, limits.rest_torque), "{at}: {wrench:?} while {:?}", tick.phase);
        }
        (phase, index) = (tick.phase, Some(tick.index));
    }
}

/// Checks that every fault is named in the counters. If two faults meet, one may hide the other, so
/// only separate faults are checked.
pub(crate) fn judge_names(sequence: &Sequence, ticks: &[ServoTick], statistics: &RunStatistics) {
    let reads = statistics.ticks;
    // A wrench is held for too long only if it is not zero.
    let is_held = |tick: u64| ticks.iter().any(|seen| seen.index == tick && seen.wrench != Wrench::ZERO);
    // Ticks are counted from the first valid state.
    let counts_reads = sequence.faults.first().is_none_or(|(tick, _)| *tick > 0);
    let lasting = |fault: &Fault| match fault {
        Fault::Frozen(ticks)
        | Fault::Stuck(ticks)
        | Fault::Withheld(ticks)
        | Fault::SlowSteps(ticks, _)
        | Fault::Velocity(_, ticks) => u64::from(*ticks),
        _ => 0,
    };
    for (k, (tick, fault)) in sequence.faults.iter().enumerate() {
        let alone =
            sequence.faults.iter().enumerate().all(|(other, (at, its))| {
                other == k || *at > tick + lasting(fault) + 2 || at + lasting(its) + 2 < *tick
            });
        // The first read cannot be compared with an earlier read, and the effect of the last faults
        // may come after the end.
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
