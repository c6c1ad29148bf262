//! The open loop: every method gets the same poses, a thousand per second, and its wrench does not
//! affect the motion.
//!
//! * *Steps*: the change of force and torque from one millisecond to the next, and the angle by
//!   which the force turns.
//! * *Step over motion*: the force step divided by the stiffness and by the largest motion of a
//!   point of the probe in that millisecond. A single linear contact gives at most 1, a sum of n
//!   contacts at most n, and a jump any value.
//! * *Step while merging*, in the scene `rails`: the largest step while the depth stays the same
//!   and two contacts become one, relative to the mean force.
//! * *Truth*, for scenes with a known truth ([`super::truth`]).
//! * *Pop-through*: an episode in which the bodies overlap by more than a tenth of a millimetre,
//!   and too little is felt: the sum of the force and of the torque divided by the reach is less
//!   than a tenth of the expected force.

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus::render::ProbeState;

use super::ground::{Ground, JUDGED};
use super::method::{ContactOffset, Entry, FeltTick, Method, Tuning};
use super::row::{Rows, largest, mean, quantile};
use super::truth;
use crate::bench::TICK;

/// Smaller forces, relative to the largest force, have no meaningful direction.
pub(super) const FAINT: f64 = 0.05;
/// Smaller steps, relative to the largest force, are not divided by the motion, because step and
/// motion are then rounding errors.
const SMALL_STEP: f64 = 0.002;
/// Smallest motion in a millisecond by which a step is divided, m.
const LEAST_MOTION: f64 = 1e-6;
/// Overlaps deeper than this must be felt, m.
const MUST_BE_FELT: f64 = 1e-4;
/// Smallest share of stiffness times depth that must be felt.
const FELT_PART: f64 = 0.1;

/// Measures of all ticks.
#[derive(Default)]
pub(super) struct Curve {
    /// Time, s.
    pub(super) times: Vec<f64>,
    pub(super) wrenches: Vec<Wrench>,
}

/// Results of a method along a script.
#[derive(Default)]
pub(super) struct Played {
    pub(super) wrenches: Vec<Wrench>,
    /// Results with the probe at rest at every [`JUDGED`]th pose, if requested.
    pub(super) still: Vec<FeltTick>,
    /// Separation of the deepest contact according to the method, m.
    pub(super) deepest: f64,
}

/// Runs the method along the scene's script.
pub(super) fn measure(ground: &Ground, entry: &Entry, rows: &mut Rows) -> anyhow::Result<Curve> {
    let is_tool = matches!(entry.contact_offset, ContactOffset::Tool);
    let tuning = Tuning { friction: ground.truth.is_none(), ..Tuning::of(ground) };
    let played = play(ground, entry.build(ground, &tuning)?.as_mut(), ground.truth.is_some() && is_tool);
    rows.add("", "deepest seen", "m", played.deepest);
    judge(ground, &played.wrenches, rows);
    if ground.truth.is_some() {
        compare(ground, entry.contact_offset, &played, rows);
    } else if ground.refined.is_some() && is_tool {
        // Other methods are compared with this truth by `palpus bench open`.
        let tuning = Tuning { friction: false, ..tuning };
        compare(ground, entry.contact_offset, &play(ground, entry.build(ground, &tuning)?.as_mut(), true), rows);
    }
    let times = (0..played.wrenches.len()).map(|k| k as f64 * TICK).collect();
    Ok(Curve { times, wrenches: played.wrenches })
}

/// Returns the parameters of the methods for a comparison with the truth. Friction is as in the
/// scene, but is off in scenes with a known truth, because the truth has no friction.
pub(super) fn tuning(ground: &Ground) -> Tuning {
    Tuning { friction: ground.truth.is_none() && ground.refined.is_none(), ..Tuning::of(ground) }
}

/// Steps the method along the script. `is_held` also requests the results at rest.
pub(super) fn play(ground: &Ground, method: &mut dyn Method, is_held: bool) -> Played {
    let mut played = Played::default();
    for (k, probe) in ground.script.iter().enumerate() {
        let felt = method.step(probe, TICK);
        played.deepest = played.deepest.max(-felt.separation);
        played.wrenches.push(felt.wrench);
        if is_held && k % JUDGED == 0 {
            played.still.extend(method.at_rest(probe));
        }
    }
    played
}

/// Adds the measures of wrenches along the script, from any engine, that need no truth.
pub(super) fn judge(ground: &Ground, wrenches: &[Wrench], rows: &mut Rows) {
    let add = &mut |measure, unit, value| rows.add("", measure, unit, value);
    steps(ground, wrenches, add);
    if ground.name == "rails" {
        merging(ground, wrenches, add);
    }
    add("pop-throughs", "", pop_throughs(ground, wrenches) as f64);
}

/// Adds the differences from the truth, if the scene has one.
pub(super) fn compare(ground: &Ground, contact_offset: ContactOffset, played: &Played, rows: &mut Rows) {
    let Played { wrenches, still, .. } = played;
    truth::measure(ground, contact_offset, wrenches, still, &mut |measure, unit, value| {
        rows.add("", measure, unit, value);
    });
}

pub(super) type Add<'a> = &'a mut dyn FnMut(&'static str, &'static str, f64);

fn steps(ground: &Ground, wrenches: &[Wrench], add: Add<'_>) {
    let peak = largest(&wrenches.iter().map(|w| w.force.length()).collect::<Vec<_>>());
    let peak_torque = largest(&wrenches.iter().map(|w| w.torque.length()).collect::<Vec<_>>());
    let touching: Vec<f64> = wrenches.iter().map(|w| w.force.length()).filter(|force| *force > FAINT * peak).collect();
    let typical = quantile(&touching, 0.5);
    let (mut force, mut torque, mut turn) = (Vec::new(), Vec::new(), Vec::new());
    let (mut over_motion, mut torque_over_motion) = (0.0f64, 0.0f64);
    for (pair, probes) in wrenches.windows(2).zip(ground.script.windows(2)) {
        let step = pair[1].force.distance(pair[0].force);
        let torque_step = pair[1].torque.distance(pair[0].torque);
        let motion = motion(&probes[0], &probes[1], ground.reach).max(LEAST_MOTION) * ground.settings.stiffness;
        force.push(step);
        torque.push(torque_step);
        if step > SMALL_STEP * peak {
            over_motion = over_motion.max(step / motion);
        }
        if torque_step > SMALL_STEP * peak_torque {
            torque_over_motion = torque_over_motion.max(torque_step / (motion * ground.reach));
        }
        if pair.iter().all(|w| w.force.length() > FAINT * peak) {
            turn.push(angle_between(pair[0].force, pair[1].force));
        }
    }
    add("peak force", "N", peak);
    add("median force", "N", typical);
    add("force step p99", "N/ms", quantile(&force, 0.99));
    add("force step max", "N/ms", largest(&force));
    add("torque step p99", "N·m/ms", quantile(&torque, 0.99));
    add("torque step max", "N·m/ms", largest(&torque));
    add("turn p99", "°/ms", quantile(&turn, 0.99));
    add("turn max", "°/ms", largest(&turn));
    add("force step over motion", "", over_motion);
    add("torque step over motion", "", torque_over_motion);
}

/// Times (s) at which the knife on the rails reaches its final depth, and at which it leaves the
/// rails.
const MERGING: [f64; 2] = [0.9, 3.5];

/// Adds the largest step while the knife stays at its depth and its two contacts approach each
/// other.
fn merging(ground: &Ground, wrenches: &[Wrench], add: Add<'_>) {
    let [first, last] = MERGING.map(|time| (((time - ground.begin) / TICK).max(0.0) as usize).min(wrenches.len()));
    let within = &wrenches[first..last.max(first)];
    let forces: Vec<f64> = within.iter().map(|w| w.force.length()).collect();
    let steps: Vec<f64> = within.windows(2).map(|pair| pair[1].force.distance(pair[0].force)).collect();
    if !steps.is_empty() {
        add("step while merging", "%", 100.0 * largest(&steps) / mean(&forces));
    }
}

/// Returns the angle in degrees. It is exact for small angles, unlike an angle from the cosine.
pub(super) fn angle_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Returns an upper bound of the motion of any point of the probe, m.
fn motion(from: &ProbeState, to: &ProbeState, reach: f64) -> f64 {
    let turned = to.pose_ba.rotation.angle_between(from.pose_ba.rotation);
    to.pose_ba.translation.distance(from.pose_ba.translation) + reach * turned
}

fn pop_throughs(ground: &Ground, wrenches: &[Wrench]) -> usize {
    let (mut episodes, mut inside) = (0, false);
    for (depth, wrench) in ground.depths.iter().zip(wrenches.iter().step_by(JUDGED)) {
        let missing = is_missing(ground, *depth, wrench, ground.settings.stiffness);
        episodes += usize::from(missing && !inside);
        inside = missing;
    }
    episodes
}

/// True if the force is much smaller than the force of one contact of this stiffness at `depth`.
pub(super) fn is_missing(ground: &Ground, depth: f64, wrench: &Wrench, stiffness: f64) -> bool {
    let felt = wrench.force.length() + wrench.torque.length() / ground.reach;
    depth > MUST_BE_FELT && felt < FELT_PART * stiffness * depth
}
