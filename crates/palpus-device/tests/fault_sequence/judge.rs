//! What must hold of every tick, as the page on top of `faults.rs` lists it.

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{Fault, Phase, RunStatistics, ServoTick};

use super::Sequence;

/// Relative room for rounding.
const ROUNDING: f64 = 1e-6;

pub(crate) fn within(wrench: &Wrench, force: f64, torque: f64) -> bool {
    wrench.is_finite()
        && wrench.force.length() <= force * (1.0 + ROUNDING)
        && wrench.torque.length() <= torque * (1.0 + ROUNDING)
}

/// Properties 1 to 4 over the ticks that were seen.
pub(crate) fn judge(sequence: &Sequence, ticks: &[ServoTick]) {
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
pub(crate) fn judge_names(sequence: &Sequence, ticks: &[ServoTick], statistics: &RunStatistics) {
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
