//! Measures whether a probe that is held in contact lies still.
//!
//! 1. The hand's target is so far inside that the hand presses with one newton. Without a hand, a
//!    weight of one newton presses.
//! 2. The *limit cycle* is the root mean square of the force above 10 Hz after a settling time. A
//!    limit cycle below a hundredth of the mean force is negligible.
//! 3. The *greatest stable stiffness* is searched from 100 N/m upward. The stiffness is doubled
//!    until the probe does not lie still, and then the interval is halved.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus_device::HandImpedance;

use super::closed::{Drive, LoopTick, run};
use super::ground::{Ground, Rest};
use super::method::{Entry, Tuning};
use crate::bench::TICK;

/// Press, N.
pub(super) const PRESS: f64 = 1.0;
/// Distance beyond the contact tolerance at which the probe is released, m.
const DROP: f64 = 0.1e-3;
/// Seconds of approach.
const APPROACH: f64 = 0.4;
/// Seconds of settling before the force is measured, with a hand and without.
const SETTLE: [f64; 2] = [1.2, 4.0];
/// Seconds of measurement.
const WATCHED: f64 = 1.0;
/// Limit cycle above which the probe does not lie still, as a share of the mean force.
pub(super) const STILL: f64 = 0.01;
/// Smallest share of the press that must be felt on average. If a smaller share is felt, the
/// contact was lost.
const KEPT: f64 = 0.3;
/// Range of the search, N/m.
const SOFTEST: f64 = 100.0;
pub(super) const HARDEST: f64 = 51_200.0;

/// Measures of a held probe.
pub(super) struct Held {
    pub(super) ticks: Vec<LoopTick>,
    /// Mean force, N.
    pub(super) mean_force: f64,
    /// Limit cycle of the force, N.
    pub(super) force_cycle: f64,
    /// Limit cycle of the torque, N·m.
    pub(super) torque_cycle: f64,
}

impl Held {
    /// Returns the limit cycle as a share of the mean force; NaN where the contact was lost.
    pub(super) fn share(&self) -> f64 {
        if self.state() == State::Lost { f64::NAN } else { self.force_cycle / self.mean_force }
    }

    fn state(&self) -> State {
        if self.mean_force <= KEPT * PRESS && self.force_cycle <= STILL * PRESS {
            State::Lost
        } else if self.mean_force > KEPT * PRESS && self.force_cycle <= STILL * self.mean_force {
            State::Still
        } else {
            State::Moving
        }
    }
}

/// State of a held probe.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Still,
    Moving,
    /// The probe passed through the surface, so that the force is small or zero.
    Lost,
}

/// Holds the probe at the scene's contact pose with `hand`.
pub(super) fn hold(
    ground: &Ground,
    entry: &Entry,
    rest: &Rest,
    hand: &HandImpedance,
    tuning: &Tuning,
) -> anyhow::Result<Held> {
    let depth = ground.judge().depth(&rest.pose);
    let moved = |by: f64| Pose { translation: rest.pose.translation + rest.press * by, ..rest.pose };
    let start = -(depth + ground.settings.contact_tolerance + DROP);
    let is_held = hand.stiffness > 0.0;
    let end = if is_held { PRESS / hand.stiffness - depth } else { start };
    let intent = |time: f64| {
        let s = (time / APPROACH).clamp(0.0, 1.0);
        moved(start + (end - start) * (s * s * s * (10.0 - s * (15.0 - 6.0 * s))))
    };
    let weight = if is_held { DVec3::ZERO } else { rest.press * PRESS };
    let load = Wrench { force: weight, torque: DVec3::ZERO };
    let settle = SETTLE[usize::from(!is_held)];
    let drive = Drive { hand: *hand, intent: &intent, load };
    let ticks = run(ground, entry, tuning, &drive, settle + WATCHED)?;
    let watched = ticks.iter().filter(|tick| tick.time >= settle).map(|tick| tick.felt);
    let watched: Vec<Wrench> = watched.collect();
    if watched.len() < (0.8 * WATCHED / TICK) as usize {
        let nothing = f64::INFINITY;
        return Ok(Held { ticks, mean_force: 0.0, force_cycle: nothing, torque_cycle: nothing });
    }
    let sum = watched.iter().map(|felt| felt.force).sum::<DVec3>();
    Ok(Held {
        ticks,
        mean_force: sum.length() / watched.len() as f64,
        force_cycle: cycle(&watched, |felt| felt.force),
        torque_cycle: cycle(&watched, |felt| felt.torque),
    })
}

/// Half the width of the moving average that is subtracted, in ticks. The whole width is a tenth of
/// a second, so frequencies from 10 Hz on remain.
const HALF_WINDOW: usize = 50;

/// Returns the root mean square of the components above 10 Hz.
pub(super) fn cycle(felt: &[Wrench], of: impl Fn(&Wrench) -> DVec3) -> f64 {
    let values: Vec<DVec3> = felt.iter().map(of).collect();
    let width = (2 * HALF_WINDOW + 1) as f64;
    let squares: Vec<f64> = values
        .windows(2 * HALF_WINDOW + 1)
        .map(|window| (window[HALF_WINDOW] - window.iter().sum::<DVec3>() / width).length_squared())
        .collect();
    super::row::mean(&squares).sqrt()
}

/// Returns the greatest stiffness at which the probe lies still, N/m; 0 if it does not lie still
/// even at the smallest stiffness. `halvings`: number of bisection steps after the doubling.
pub(super) fn greatest_stiffness(
    ground: &Ground,
    entry: &Entry,
    rest: &Rest,
    hand: &HandImpedance,
    damping: f64,
    halvings: usize,
) -> anyhow::Result<f64> {
    let state = |stiffness: f64| -> anyhow::Result<State> {
        let tuning = Tuning { stiffness: Some(stiffness), damping, ..Tuning::of(ground) };
        Ok(hold(ground, entry, rest, hand, &tuning)?.state())
    };
    let (mut still, mut moving) = (0.0, SOFTEST);
    loop {
        match state(moving)? {
            State::Still => still = moving,
            State::Moving => break,
            // The contact is too soft to carry the probe. This result says nothing about stability.
            State::Lost => {}
        }
        if moving >= HARDEST {
            return Ok(still);
        }
        moving *= 2.0;
    }
    if still == 0.0 {
        return Ok(0.0);
    }
    for _ in 0..halvings {
        let middle = (still * moving).sqrt();
        if state(middle)? == State::Still {
            still = middle;
        } else {
            moving = middle;
        }
    }
    Ok(still)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycle_contains_only_frequencies_above_ten_hertz() {
        let wave = |hertz: f64| -> Vec<Wrench> {
            (0..1000)
                .map(|k| {
                    let phase = std::f64::consts::TAU * hertz * f64::from(k) * 1e-3;
                    Wrench { force: DVec3::X * (2.0 + phase.sin()), torque: DVec3::ZERO }
                })
                .collect()
        };
        let of = |hertz: f64| cycle(&wave(hertz), |felt| felt.force);
        for hertz in [10.0, 37.0, 180.0] {
            assert!((of(hertz) - 0.5f64.sqrt()).abs() < 0.06, "{hertz} Hz: {}", of(hertz));
        }
        assert!(of(1.0) < 0.02);
        assert_eq!(cycle(&wave(10.0), |felt| felt.torque), 0.0);
    }
}
