//! Compares a felt wrench with the true wrench, in scenes whose true contacts are known in closed
//! form.
//!
//! Felt and true wrench are compared by three measures: the angle between their forces, their size
//! after scaling by the one factor that fits best, and the distance of their lines of action. For a
//! method behind palpus's coupling, the difference is divided into three parts:
//!
//! * *springs*: the difference between the true wrench transmitted by the coupling's springs and
//!   the true wrench. The tool tilts and yields as far as the springs allow. This is a felt
//!   stiffness, not an error.
//! * *motion*: the difference between the felt wrench and the wrench felt at the same pose when the
//!   hand holds still. The damper of the coupling pushes while the tool approaches or leaves. A
//!   delayed wrench would also appear here. The *lag* is the time shift with which the felt forces
//!   fit the forces at rest best. It is negative if the felt forces are early, as with a damper.
//! * *rest*: the difference between the wrench felt at rest and the true wrench transmitted by the
//!   springs. This is the engine's own error.
//!
//! The transmitted true wrench is computed for a tool on springs. Translational and rotational
//! springs hold the tool to the hand at the grip, and rigid true contacts support it from the
//! contact offset on. The balance of forces is a linear complementarity problem. The problem is
//! solved by projected Gauss-Seidel, and linearised again at each pose of the iteration.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Wrench};
use palpus::render::{ProbeState, Settings};
use palpus_scenes::refined;
use palpus_scenes::truth::Truth;

use super::ground::{Ground, JUDGED};
use super::method::ContactOffset;
use super::open::{Add, FAINT, angle_between};
use super::row::{largest, quantile};
use crate::bench::TICK;

/// Number of poses at which the balance is linearised, and number of Gauss-Seidel sweeps at each
/// pose.
const LINEARISED: usize = 8;
const SWEEPS: usize = 300;

/// A true force, and its torque about the grip if that is known.
#[derive(Clone, Copy)]
pub(super) struct True {
    pub(super) force: DVec3,
    pub(super) torque: Option<DVec3>,
}

impl True {
    fn of(wrench: &Wrench) -> Self {
        Self { force: wrench.force, torque: Some(wrench.torque) }
    }
}

/// Names of the measures of a comparison: direction, size, line of action; p99 and max.
type Names = [[&'static str; 2]; 3];

const ALL: Names = [
    ["direction error p99", "direction error max"],
    ["size error p99", "size error max"],
    ["line of action error p99", "line of action error max"],
];
const SPRINGS: Names = [
    ["direction by springs p99", "direction by springs max"],
    ["size by springs p99", "size by springs max"],
    ["line of action by springs p99", "line of action by springs max"],
];
const MOTION: Names = [
    ["direction by motion p99", "direction by motion max"],
    ["size by motion p99", "size by motion max"],
    ["line of action by motion p99", "line of action by motion max"],
];
const REST: Names = [
    ["direction left p99", "direction left max"],
    ["size left p99", "size left max"],
    ["line of action left p99", "line of action left max"],
];

/// Adds the differences of `wrenches` from the truth, if the scene has a known truth. `still`: the
/// wrenches at rest at every [`JUDGED`]th pose, for a method behind palpus's coupling.
pub(super) fn measure(
    ground: &Ground,
    contact_offset: ContactOffset,
    wrenches: &[Wrench],
    still: &[Wrench],
    add: Add<'_>,
) {
    let contact_offset = contact_offset.width(ground);
    if ground.refined.is_some() {
        let at = |k: usize| Some((shared(ground, contact_offset, k)?, *wrenches.get(k)?));
        let (wanted, felt): (Vec<True>, Vec<Wrench>) = (0..wrenches.len()).filter_map(at).unzip();
        compare(&wanted, &felt, None, &ALL, add);
        return;
    }
    let Some(truth) = &ground.truth else { return };
    let direct: Vec<True> =
        ground.script.iter().map(|probe| direct(truth, &ground.settings, contact_offset, probe)).collect();
    if let Some(gain) = compare(&direct, wrenches, None, &ALL, add) {
        add("felt stiffness", "N/m", gain);
    }
    let Some(springs) = Springs::of(&ground.coupled).filter(|_| !still.is_empty()) else { return };
    let judged = || ground.script.iter().step_by(JUDGED);
    let sprung: Vec<Wrench> = judged().map(|probe| springs.balance(truth, contact_offset, probe)).collect();
    let direct: Vec<True> = direct.into_iter().step_by(JUDGED).collect();
    compare(&direct, &sprung, None, &SPRINGS, add);
    let felt: Vec<Wrench> = wrenches.iter().copied().step_by(JUDGED).collect();
    let resting: Vec<True> = still.iter().map(True::of).collect();
    compare(&resting, &felt, Some(1.0), &MOTION, add);
    if let Some(lag) = lag(still, &felt) {
        add("lag", "s", lag);
    }
    let sprung: Vec<True> = sprung.iter().map(True::of).collect();
    compare(&sprung, still, Some(1.0), &REST, add);
}

/// Returns the true wrench on contacts of unit stiffness.
pub(super) fn direct(truth: &Truth, settings: &Settings, contact_offset: f64, probe: &ProbeState) -> True {
    let grip = probe.pose_ba.point(settings.grip_a);
    let mut sum = True { force: DVec3::ZERO, torque: Some(DVec3::ZERO) };
    for contact in truth.contacts(&probe.pose_ba) {
        let push = contact.normal * (contact_offset - contact.separation).max(0.0);
        sum.force += push;
        sum.torque = sum.torque.zip(contact.point).map(|(sum, point)| sum + (point - grip).cross(push));
    }
    sum
}

/// Returns the wrench of a refined truth on contacts of unit stiffness in tick `k`. `None` if the
/// tick is not judged, or if the two searches for its contacts disagree.
pub(super) fn shared(ground: &Ground, contact_offset: f64, k: usize) -> Option<True> {
    if !k.is_multiple_of(JUDGED) {
        return None;
    }
    let contacts = ground.refined.as_ref()?.get(k / JUDGED)?.as_ref()?;
    let (force, torque) =
        refined::push(contacts, contact_offset, ground.script[k].pose_ba.point(ground.settings.grip_a));
    Some(True { force, torque })
}

/// Compares the wrenches after scaling by `gain`, or by the least-squares factor; returns the
/// factor.
fn compare(wanted: &[True], felt: &[Wrench], gain: Option<f64>, names: &Names, add: Add<'_>) -> Option<f64> {
    let pairs = || wanted.iter().zip(felt);
    let peak = largest(&wanted.iter().map(|wanted| wanted.force.length()).collect::<Vec<_>>());
    if peak == 0.0 {
        return None;
    }
    let product: f64 = pairs().map(|(wanted, felt)| wanted.force.length() * felt.force.length()).sum();
    let square: f64 = wanted.iter().map(|wanted| wanted.force.length_squared()).sum();
    let gain = gain.unwrap_or(product / square);
    let (mut angle, mut size, mut lever) = (Vec::new(), Vec::new(), Vec::new());
    for (True { force, torque }, felt) in pairs() {
        if force.length() < FAINT * peak {
            continue;
        }
        let none = felt.force.length() == 0.0;
        angle.push(if none { 180.0 } else { angle_between(felt.force, *force) });
        size.push((felt.force.length() / (gain * force.length()) - 1.0).abs() * 100.0);
        if let Some(torque) = torque {
            lever.push(felt.torque.distance(*torque * gain) / (gain * force.length()));
        }
    }
    for ((names, unit), values) in names.iter().zip(["°", "%", "m"]).zip([angle, size, lever]) {
        if !values.is_empty() {
            add(names[0], unit, quantile(&values, 0.99));
            add(names[1], unit, largest(&values));
        }
    }
    Some(gain)
}

/// Returns the time (s) by which the `felt` forces are later than the forces at rest, by least
/// squares. Both are given at every [`JUDGED`]th tick. `None` if the forces at rest never change.
fn lag(still: &[Wrench], felt: &[Wrench]) -> Option<f64> {
    let (mut product, mut square) = (0.0, 0.0);
    for (around, felt) in still.windows(3).zip(felt.iter().skip(1)) {
        let rate = (around[2].force - around[0].force) / (2.0 * JUDGED as f64 * TICK);
        product += rate.dot(around[1].force - felt.force);
        square += rate.length_squared();
    }
    (square > 0.0).then(|| product / square)
}

/// The springs between hand and tool.
struct Springs {
    /// Stiffness of the coupling and the contacts in series, N/m.
    stiffness: f64,
    /// Rotational stiffness of the coupling, N·m/rad.
    angular_stiffness: f64,
    grip_a: DVec3,
}

impl Springs {
    fn of(settings: &Settings) -> Option<Self> {
        let coupling = settings.coupling?;
        let stiffness = 1.0 / (1.0 / coupling.stiffness + 1.0 / settings.stiffness);
        Some(Self { stiffness, angular_stiffness: coupling.angular_stiffness, grip_a: settings.grip_a })
    }

    /// Returns the wrench about the grip with which true contacts support the tool.
    fn balance(&self, truth: &Truth, contact_offset: f64, probe: &ProbeState) -> Wrench {
        let hand = probe.pose_ba;
        let grip = hand.point(self.grip_a);
        let (mut shift, mut turn) = (DVec3::ZERO, DVec3::ZERO);
        let mut wrench = Wrench::ZERO;
        for _ in 0..LINEARISED {
            let rotation = DQuat::from_scaled_axis(turn) * hand.rotation;
            let tool = Pose::new(rotation, grip + shift - rotation * self.grip_a);
            let contacts: Vec<Row> = truth
                .supports(&tool)
                .into_iter()
                .filter_map(|contact| {
                    let lever = (contact.point? - grip - shift).cross(contact.normal);
                    let offset = contact.separation - contact_offset - contact.normal.dot(shift) - lever.dot(turn);
                    Some(Row { normal: contact.normal, lever, offset, push: 0.0 })
                })
                .collect();
            wrench = self.solved(contacts);
            (shift, turn) = (wrench.force / self.stiffness, wrench.torque / self.angular_stiffness);
        }
        wrench
    }

    /// Returns the sum of the contacts' forces. No contact pulls or overlaps, and contacts that
    /// push just touch.
    fn solved(&self, mut rows: Vec<Row>) -> Wrench {
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..SWEEPS {
            for row in &mut rows {
                let (linear, angular) = (force / self.stiffness, torque / self.angular_stiffness);
                let gap = row.offset + row.normal.dot(linear) + row.lever.dot(angular);
                let compliance = 1.0 / self.stiffness + row.lever.length_squared() / self.angular_stiffness;
                let push = (row.push - gap / compliance).max(0.0);
                force += row.normal * (push - row.push);
                torque += row.lever * (push - row.push);
                row.push = push;
            }
        }
        Wrench { force, torque }
    }
}

/// A contact of the tool on springs.
struct Row {
    normal: DVec3,
    /// Torque of a unit force along the normal about the grip, m.
    lever: DVec3,
    /// Distance of the tool from touch when the springs are relaxed, m.
    offset: f64,
    /// Force of the contact, N.
    push: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lag_is_the_shift_of_time() {
        let at = |time: f64| Wrench { force: DVec3::Z * (3.0 * time).sin(), torque: DVec3::ZERO };
        let times = || (0..200).map(|k| k as f64 * JUDGED as f64 * TICK);
        let still: Vec<Wrench> = times().map(at).collect();
        for shift in [-0.003, 0.0, 0.002] {
            let felt: Vec<Wrench> = times().map(|time| at(time - shift)).collect();
            let lag = lag(&still, &felt).expect("the forces change");
            assert!((lag - shift).abs() < 2e-5, "{lag} for {shift}");
        }
    }

    /// A box that overhangs the table's edge by more than half must tilt as far as its springs
    /// allow.
    #[test]
    fn tool_on_springs_tilts_over_the_edge() {
        let scene = palpus_scenes::scene("box-edge").expect("the scene is built in");
        let truth = Truth::of(&scene).expect("the scene has a truth");
        let springs = Springs { stiffness: 400.0, angular_stiffness: 1.0, grip_a: DVec3::ZERO };
        let probe = |x: f64| ProbeState {
            pose_ba: Pose::from_translation(DVec3::new(x, 0.0, 0.0145)),
            twist: palpus::algebra::Twist::default(),
        };
        let flat = springs.balance(&truth, 0.0, &probe(0.0));
        assert!((flat.force - DVec3::Z * 0.2).length() < 1e-6, "{flat:?}");
        assert!(flat.torque.length() < 1e-6, "{flat:?}");
        // The table's edge is 15 mm from the box's centre, towards −x.
        let leaning = springs.balance(&truth, 0.0, &probe(0.165));
        let share = 1.0 / (1.0 + 400.0 * 0.015 * 0.015);
        assert!((leaning.force.z - 0.2 * share).abs() < 0.01 * 0.2, "{leaning:?}");
        assert!((leaning.torque.y / leaning.force.z - 0.015).abs() < 1e-4, "{leaning:?}");
    }
}
