//! Limit cycles: an oscillation of the computed wrench that the hand does not make.
//!
//! A contact gives back what the hand puts in. Its wrench swings because the grip moves: over a
//! texture, through stick and slip, against a wall. A loop that feeds itself swings while the hand
//! holds still. Each axis of force and torque is looked at by itself, so that any period from two
//! ticks on is seen, and irregular cycles too:
//!
//! 1. *Turning points*: the wrench turns where it has come back from an extreme by [`LEAST_SWING`]
//!    of the peak. From one turning point to the next is a half cycle of at most [`LONGEST_HALF`].
//! 2. *Explained?* Motion is counted in travels that explain a swing of the whole peak
//!    ([`OWN_TRAVEL`], [`OWN_TURN`]). The hand explains a half cycle if the grip is displaced far
//!    enough within the cycle (texture, stick and slip), or if it goes far enough to and fro
//!    without being given energy by it (a tremor against a wall).
//! 3. *Sustained*: [`HALF_CYCLES`] half cycles that nothing explains, over [`LEAST_TIME`].
//! 4. *Attenuation*: while it lasts the gain of the force, or of the torque, falls to
//!    [`LEAST_GAIN`]. The gain multiplies the wrench and has no phase of its own; a filter would
//!    lag, and a lagging spring gives energy. The gain rises again only once the cycle is over and
//!    the wrench is small, as after a fault: a loaded spring that stiffens gives energy.
//!
//! A cycle is no fault, however strong: a fault drops the force in one tick and the tool with it,
//! and the reduced gain leaves as little force as the damping after a fault.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, rotation_between};

use super::SafetyLimits;
use crate::acting::Acting;

/// Share of the peak below which a swing is noise. Encoder steps in contact reach 0.01 of it.
const LEAST_SWING: f64 = 0.025;
/// s: half of the longest period that is looked for (0.1 s), and a fifth more for one that is not
/// even.
const LONGEST_HALF: f64 = 0.06;
/// m: displacement of the grip that explains a swing of the whole peak. Couplings need eight times
/// as much, direct contacts at the edge of stability twice.
const OWN_TRAVEL: f64 = 1e-3;
/// rad, likewise.
const OWN_TURN: f64 = 0.04;
/// Share of both thresholds above: motion within it adds nothing to a path, so that an encoder
/// between two of its steps (0.03 mm) goes nowhere.
const PLAY: f64 = 0.05;
/// Share of swing times path: work in a cycle beyond which the grip is driven. A passive wall that
/// acts 1.5 ms late has 0.04 at 10 Hz; a limit cycle has to pay for the hand's damping, 0.07 and
/// more.
const DRIVEN: f64 = 0.05;
/// In a row, up to two for each that is explained. An impact rings for two or three.
const HALF_CYCLES: u32 = 8;
/// s.
const LEAST_TIME: f64 = 0.05;
/// s: time constant with which the gain falls.
const FALL_TIME: f64 = 0.1;
/// The gain that is left.
const LEAST_GAIN: f64 = 0.1;

/// The detector and the gains of force and torque.
#[derive(Clone, Debug)]
pub(super) struct LimitCycle {
    period: f64,
    /// N, N·m.
    peaks: [f64; 2],
    /// N, N·m: at most so much is computed while a gain rises.
    small: [f64; 2],
    /// s, from no gain to the full one.
    ramp: f64,
    acting: Acting,
    pose: Option<Pose>,
    /// End of the path, which follows `History::place` with some play.
    trail: [DVec3; 2],
    history: History,
    axes: [[Axis; 3]; 2],
    gains: [f64; 2],
}

/// Sums since the last reset. Force and translation come first, torque and rotation second, all
/// relative to peaks and to travels that explain them.
#[derive(Clone, Copy, Debug, Default)]
struct History {
    ticks: u64,
    place: [DVec3; 2],
    path: [f64; 2],
    load: [DVec3; 2],
    work: [f64; 2],
}

/// A point at which a component of the wrench turns.
#[derive(Clone, Copy, Debug, Default)]
struct Turn {
    value: f64,
    at: History,
}

/// One component of the wrench.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// The last two turning points, the newer one first.
    turns: [Turn; 2],
    /// The extreme since then.
    extreme: Turn,
    rises: bool,
    /// Half cycles that nothing explains.
    count: u32,
    /// The tick of the first of them.
    since: u64,
}

impl LimitCycle {
    /// Nothing seen; for wrenches that are held for `period` seconds each.
    pub(super) fn new(limits: &SafetyLimits, period: f64) -> Self {
        Self {
            period,
            peaks: [limits.force_peak, limits.torque_peak],
            small: [limits.engage_force, limits.engage_torque],
            ramp: limits.ramp,
            acting: Acting::new(limits.delay, period),
            pose: None,
            trail: [DVec3::ZERO; 2],
            history: History::default(),
            axes: Default::default(),
            gains: [1.0; 2],
        }
    }

    /// Returns `computed`, a wrench within the peaks for a grip at `pose`, `elapsed` seconds after
    /// the last tick, attenuated where it cycles, and whether it was: `computed` itself, to the
    /// bit, where it was not.
    pub(super) fn attenuate(&mut self, computed: &Wrench, pose: &Pose, elapsed: f64) -> (Wrench, bool) {
        self.move_to(pose, elapsed);
        let parts = [computed.force, computed.torque];
        let ticks = |time: f64| (time / self.period) as u64;
        let (longest, least) = (ticks(LONGEST_HALF).max(1), ticks(LEAST_TIME));
        for (kind, part) in parts.into_iter().enumerate() {
            // A device without torque has no torque that could cycle.
            if self.peaks[kind] <= 0.0 {
                continue;
            }
            let values = (part / self.peaks[kind]).to_array();
            let mut cycles = false;
            for (axis, value) in self.axes[kind].iter_mut().zip(values) {
                axis.follow(kind, value, &self.history, longest);
                cycles |= axis.count >= HALF_CYCLES && self.history.ticks - axis.since >= least;
            }
            let gain = &mut self.gains[kind];
            if cycles {
                *gain += (LEAST_GAIN - *gain) * (1.0 - (-self.period / FALL_TIME).exp());
            } else if *gain < 1.0 && part.length() <= self.small[kind] {
                *gain = if self.ramp > 0.0 { (*gain + self.period / self.ramp).min(1.0) } else { 1.0 };
            }
        }
        let [force, torque] = self.gains;
        if force >= 1.0 && torque >= 1.0 {
            return (*computed, false);
        }
        (Wrench { torque: computed.torque * torque, force: computed.force * force }, true)
    }

    /// `wrench` was commanded in this tick.
    pub(super) fn commanded(&mut self, wrench: &Wrench) {
        self.acting.write(wrench);
    }

    /// Nothing is engaged: what was seen does not count any more.
    pub(super) fn reset(&mut self) {
        self.acting.forget();
        self.pose = None;
        self.trail = [DVec3::ZERO; 2];
        self.history = History::default();
        self.axes = Default::default();
        self.gains = [1.0; 2];
    }

    fn move_to(&mut self, pose: &Pose, elapsed: f64) {
        self.history.ticks += 1;
        let acted = self.acting.over(elapsed);
        let Some(last) = self.pose.replace(*pose) else { return };
        let turned = rotation_between(last.rotation, pose.rotation) / OWN_TURN;
        let moved = [(pose.translation - last.translation) / OWN_TRAVEL, turned];
        let History { place, path, load, work, .. } = &mut self.history;
        for (kind, part) in [acted.force, acted.torque].into_iter().enumerate() {
            let relative = if self.peaks[kind] > 0.0 { part / self.peaks[kind] } else { DVec3::ZERO };
            place[kind] += moved[kind];
            let behind = place[kind] - self.trail[kind];
            let drawn = behind - behind.clamp_length_max(PLAY);
            self.trail[kind] += drawn;
            path[kind] += drawn.length();
            load[kind] += relative;
            work[kind] += relative.dot(moved[kind]);
        }
    }
}

impl Axis {
    /// Goes on to `value`, of force (0) or torque (1), in a tick with that history.
    fn follow(&mut self, kind: usize, value: f64, now: &History, longest: u64) {
        let way = if self.rises { value - self.extreme.value } else { self.extreme.value - value };
        if way >= 0.0 {
            self.extreme = Turn { value, at: *now };
        } else if -way > LEAST_SWING {
            self.turn(kind, now.ticks, longest);
            self.rises = !self.rises;
            self.extreme = Turn { value, at: *now };
        }
        if now.ticks - self.turns[0].at.ticks > 2 * longest {
            self.count = 0;
        }
    }

    /// The extreme was a turning point.
    fn turn(&mut self, kind: usize, now: u64, longest: u64) {
        let (last, before) = (self.turns[0], self.turns[1]);
        self.turns = [self.extreme, last];
        let swing = (self.extreme.value - last.value).abs();
        if self.extreme.at.ticks - last.at.ticks > longest {
            self.count = 0;
        } else if is_explained(kind, swing, &before.at, &self.extreme.at) {
            self.count = self.count.saturating_sub(2);
        } else {
            self.since = if self.count == 0 { now } else { self.since };
            self.count = self.count.saturating_add(1);
        }
    }
}

/// True if the hand's own motion in the cycle between the two histories explains a `swing` of force
/// (0) or torque (1).
fn is_explained(kind: usize, swing: f64, from: &History, to: &History) -> bool {
    let moved = [0, 1].map(|k| to.place[k] - from.place[k]);
    if swing <= moved[0].length() + moved[1].length() {
        return true;
    }
    let path = [0, 1].map(|k| to.path[k] - from.path[k]);
    let ticks = (to.ticks - from.ticks).max(1) as f64;
    let mean = (to.load[kind] - from.load[kind]) / ticks;
    let work = to.work[kind] - from.work[kind] - mean.dot(moved[kind]);
    // A cycle's path goes to and fro.
    2.0 * swing <= path[0] + path[1] && work <= DRIVEN * swing * path[kind]
}

#[cfg(test)]
mod tests;
