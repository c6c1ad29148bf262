//! Conditions for every tick, as listed on top of `faults.rs`.

use palpus::algebra::{Twist, Wrench};
use palpus_device::{Cut, Fault, Phase, Rearm, RunStatistics, ServoTick};

use super::{Ran, Sequence};

/// Relative room for rounding.
const ROUNDING: f64 = 1e-6;

pub(crate) fn within(wrench: &Wrench, force: f64, torque: f64) -> bool {
    wrench.is_finite()
        && wrench.force.length() <= force * (1.0 + ROUNDING)
        && wrench.torque.length() <= torque * (1.0 + ROUNDING)
}

/// m/s and rad/s: a device's velocity is filtered and comes late, so that damping may push for an
/// instant when the grip turns round.
const TURNS: (f64, f64) = (0.02, 0.4);

/// All properties but the names.
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

/// How long ago the force was taken away.
struct Fall {
    /// In which the slew limit takes the peak away.
    ticks: u64,
    /// The tick after the last one in which the device was given a computed wrench.
    since: u64,
}

impl Fall {
    fn new(sequence: &Sequence) -> Self {
        let Sequence { limits, rate_hz, .. } = sequence;
        let seconds = (limits.force_peak / limits.force_slew).max(limits.torque_peak / limits.torque_slew);
        // A limit on something that is zero.
        let seconds = if seconds.is_finite() { seconds } else { limits.force_peak / limits.force_slew };
        Self { ticks: (seconds * rate_hz * (1.0 - ROUNDING)).ceil() as u64, since: 0 }
    }

    /// True if in this tick, the next one that is looked at, nothing computed can be left.
    fn is_over(&mut self, tick: &ServoTick) -> bool {
        if tick.phase.is_on() && !tick.cuts.has(Cut::Withheld) {
            self.since = tick.index + 1;
            return false;
        }
        // The tick in which it begins takes the first step.
        tick.index + 1 >= self.since + self.ticks
    }
}

/// Property 3 by the true motion: what is left at a fault does not push.
fn judge_damping(sequence: &Sequence, tick: &ServoTick, motion: &Twist) {
    let limits = &sequence.limits;
    if tick.cuts.is_fault() {
        let pushed = tick.wrench.force.dot(motion.linear) - limits.rest_force * TURNS.0;
        let turned = tick.wrench.torque.dot(motion.angular) - limits.rest_torque * TURNS.1;
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        assert!(pushed <= 0.0 && turned <= 0.0, "{at}: {:?} pushes a grip that moves by {motion:?}", tick.wrench);
    }
}

/// Property 2: no message differs from the one before by more than a step of the slew limit.
fn judge_messages(sequence: &Sequence, ran: &Ran) {
    let Sequence { limits, rate_hz, seed, .. } = sequence;
    let most = (limits.force_slew / rate_hz, limits.torque_slew / rate_hz);
    for (k, pair) in ran.written.windows(2).enumerate() {
        let step = (pair[1].force.distance(pair[0].force), pair[1].torque.distance(pair[0].torque));
        let is_step = step.0 <= most.0 * (1.0 + ROUNDING) && step.1 <= most.1 * (1.0 + ROUNDING);
        assert!(is_step, "message {} of sequence {seed:#x}: {pair:?}, {most:?} allowed", k + 1);
    }
}

/// Property 6.
fn judge_latch(sequence: &Sequence, ticks: &[ServoTick]) {
    let (mut faults, mut before, mut latched) = (0, Phase::Idle, false);
    for tick in ticks {
        let at = format!("tick {} of sequence {:#x}", tick.index, sequence.seed);
        faults += u32::from(tick.phase.is_faulted() && !before.is_faulted());
        latched |= tick.phase == Phase::Latched;
        assert!(!(latched && tick.phase.is_on()), "{at}: on after it was latched");
        let automatic = sequence.options.safety.rearm == Rearm::Automatic;
        assert!(automatic || latched || faults < 3 || tick.phase == Phase::Stopped, "{at}: {faults} faults");
        before = tick.phase;
    }
}

/// Properties 1 to 4 over the ticks that were seen.
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
        // Ticks that panicked are not seen; their messages are ([`judge_messages`]).
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
            assert_eq!(*wrench, Wrench::ZERO, "{at}: the device withholds its force");
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
        } else if !tick.cuts.is_fault() && is_fallen {
            // Waiting, or faulted for a while: nothing, or damping.
            assert!(within(wrench, limits.rest_force, limits.rest_torque), "{at}: {wrench:?} while {:?}", tick.phase);
        }
        (phase, index) = (tick.phase, Some(tick.index));
    }
}

/// Every fault that happened is named. When two meet, one may hide the other, so only those that
/// are alone are looked for.
pub(crate) fn judge_names(sequence: &Sequence, ticks: &[ServoTick], statistics: &RunStatistics) {
    let reads = statistics.ticks;
    // Nothing is held too long when nothing is held.
    let is_held = |tick: u64| ticks.iter().any(|seen| seen.index == tick && seen.wrench != Wrench::ZERO);
    // Ticks are counted from the first state that was one.
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
