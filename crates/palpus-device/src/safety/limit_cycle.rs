//! Detects and attenuates limit cycles: oscillations of the computed wrench that the hand's motion
//! does not cause.
//!
//! In a passive contact the wrench oscillates only because the hand moves the grip: over a texture,
//! in stick-slip, or against a wall. In a limit cycle the wrench oscillates while the hand holds
//! still. Each axis of force and torque is examined separately, so that any period from two ticks
//! up is detected, even if the period is irregular:
//!
//! 1. *Turning points*: a component of the wrench has a turning point where it has come back from
//!    an extreme by [`LEAST_SWING`] of the peak. A half cycle goes from one turning point to the
//!    next and lasts at most [`LONGEST_HALF`].
//! 2. *Explained by the hand*: motion is measured relative to the travel that explains a swing of
//!    the whole peak ([`OWN_TRAVEL`], [`OWN_TURN`]). The hand explains a half cycle if the grip is
//!    displaced far enough within the cycle (texture, stick-slip). The hand also explains a half
//!    cycle if the grip's path is long enough and the wrench puts no energy into the grip (tremor
//!    against a wall).
//! 3. *Sustained*: a limit cycle needs [`HALF_CYCLES`] unexplained half cycles over [`LEAST_TIME`].
//! 4. *Attenuation*: during a limit cycle the gain of the force, or of the torque, falls to
//!    [`LEAST_GAIN`]. A gain has no phase; a filter would lag, and a lagging spring generates
//!    energy. The gain rises again only when the cycle is over and the wrench is small, as after a
//!    fault: a loaded spring that stiffens generates energy.
//!
//! A limit cycle is no fault, however strong it is. A fault would remove the force in one tick,
//! so that a held tool would fall. The reduced gain leaves as little force as the damping after a
//! fault.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, rotation_between};

use super::SafetyLimits;
use crate::acting::Acting;

/// Fraction of the peak below which a swing is noise. Encoder steps in contact reach 0.01 of the
/// peak.
const LEAST_SWING: f64 = 0.025;
/// Longest half cycle that is examined, s: half of the longest period (0.1 s), plus a fifth for
/// asymmetric cycles.
const LONGEST_HALF: f64 = 0.06;
/// m: if the grip moves this far, its motion explains a swing of the force from zero to the peak. A
/// coupling needs eight times this travel for such a swing. A direct contact at the limit of
/// stability needs twice this travel.
const OWN_TRAVEL: f64 = 1e-3;
/// rad: like [`OWN_TRAVEL`] for rotation.
const OWN_TURN: f64 = 0.04;
/// Play, as a fraction of both thresholds above. Motion within the play adds nothing to the path,
/// so an encoder that alternates between two steps (0.03 mm) has no path.
const PLAY: f64 = 0.05;
/// The wrench drives the grip if its work in a cycle is more than this share of the product of
/// swing and path. A passive wall with a delay of 1.5 ms has a ratio of 0.04 at 10 Hz. A limit
/// cycle must supply the losses of the hand's damping, which are 0.07 and more.
const DRIVEN: f64 = 0.05;
/// Number of unexplained half cycles of a limit cycle. Each explained half cycle reduces the number
/// by two. An impact rings for two or three half cycles.
const HALF_CYCLES: u32 = 8;
/// Shortest duration of a limit cycle, s.
const LEAST_TIME: f64 = 0.05;
/// Time constant with which the gain falls, s.
const FALL_TIME: f64 = 0.1;
/// Smallest gain.
const LEAST_GAIN: f64 = 0.1;

/// The limit-cycle detector, and the gains of force and torque.
#[derive(Clone, Debug)]
pub(super) struct LimitCycle {
    period: f64,
    /// Peak force (N) and peak torque (N·m).
    peaks: [f64; 2],
    /// Largest computed force (N) and torque (N·m) at which a gain may rise.
    small: [f64; 2],
    /// Time in which a gain rises from 0 to 1, s.
    ramp: f64,
    acting: Acting,
    pose: Option<Pose>,
    /// End of the path, which follows `History::place` with some play.
    trail: [DVec3; 2],
    history: History,
    axes: [[Axis; 3]; 2],
    gains: [f64; 2],
}

/// Sums since the last reset. Index 0 is force and translation, index 1 is torque and rotation.
/// Loads are relative to the peaks, motions relative to [`OWN_TRAVEL`] and [`OWN_TURN`].
#[derive(Clone, Copy, Debug, Default)]
struct History {
    ticks: u64,
    place: [DVec3; 2],
    path: [f64; 2],
    load: [DVec3; 2],
    work: [f64; 2],
}

/// A turning point of a component of the wrench.
#[derive(Clone, Copy, Debug, Default)]
struct Turn {
    value: f64,
    at: History,
}

/// Detector for one component of the wrench.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// The last two turning points, newest first.
    turns: [Turn; 2],
    /// The extreme since the last turning point.
    extreme: Turn,
    rises: bool,
    /// Number of unexplained half cycles.
    count: u32,
    /// Tick of the first unexplained half cycle.
    since: u64,
}

impl LimitCycle {
    /// Returns a detector without history. Each wrench is held for `period` seconds.
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

    /// Attenuates `computed`, a wrench within the peaks, for a grip at `pose`, `elapsed` seconds
    /// after the last tick. The flag is true if a gain is below 1; else the result is `computed`,
    /// bit for bit.
    pub(super) fn attenuate(&mut self, computed: &Wrench, pose: &Pose, elapsed: f64) -> (Wrench, bool) {
        self.move_to(pose, elapsed);
        let parts = [computed.force, computed.torque];
        let ticks = |time: f64| (time / self.period) as u64;
        let (longest, least) = (ticks(LONGEST_HALF).max(1), ticks(LEAST_TIME));
        for (kind, part) in parts.into_iter().enumerate() {
            // A device without torque has no torque that could oscillate.
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

    /// Stores the wrench that was commanded in this tick.
    pub(super) fn commanded(&mut self, wrench: &Wrench) {
        self.acting.write(wrench);
    }

    /// Starts again while the device is not engaged.
    pub(super) fn reset(&mut self) {
        self.acting.clear();
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
    /// Takes the next `value` of a component of force (kind 0) or torque (kind 1). `now`: the
    /// history up to this tick.
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

    /// Records that the extreme was a turning point.
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

/// Returns true if the hand's own motion between the two histories explains a `swing` of force
/// (kind 0) or torque (kind 1).
fn is_explained(kind: usize, swing: f64, from: &History, to: &History) -> bool {
    let moved = [0, 1].map(|k| to.place[k] - from.place[k]);
    if swing <= moved[0].length() + moved[1].length() {
        return true;
    }
    let path = [0, 1].map(|k| to.path[k] - from.path[k]);
    let ticks = (to.ticks - from.ticks).max(1) as f64;
    let mean = (to.load[kind] - from.load[kind]) / ticks;
    let work = to.work[kind] - from.work[kind] - mean.dot(moved[kind]);
    // The path of a cycle goes back and forth, so it counts both swings.
    2.0 * swing <= path[0] + path[1] && work <= DRIVEN * swing * path[kind]
}

#[cfg(test)]
mod tests;
