//! Compares a felt wrench with the true wrench, in scenes whose true contacts are known: in closed
//! form, or refined ([`palpus_scenes::refined`]).
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
//! The transmitted truth is computed for a tool on springs. Translational and rotational springs
//! hold the tool to the hand at the grip, and rigid true contacts support it from the contact
//! offset on. The balance of forces is a linear complementarity problem. The problem is solved by
//! projected Gauss-Seidel, and linearised again at each pose of the iteration.
//!
//! Between several walls, a tool on springs may have more than one balance: the tool stays on the
//! side of a wall from which it came. With a refined truth, the search for the balance therefore
//! starts where palpus's tool is at rest. A pose is left out if the search does not end.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Wrench, rotation_between};
use palpus::render::{ProbeState, Settings};
use palpus_scenes::refined::{self, Refined};
use palpus_scenes::truth::{TrueContact, Truth};

use super::ground::{Ground, JUDGED};
use super::method::{ContactOffset, FeltTick};
use super::open::{Add, FAINT, angle_between};
use super::row::{largest, quantile};
use crate::bench::TICK;

/// Number of poses at which the balance is linearised, and number of Gauss-Seidel sweeps at each
/// pose.
const LINEARISED: usize = 8;
const SWEEPS: usize = 300;
/// Number of linearisations near a refined truth. Later steps go half the way, because the tool may
/// swing between two facets.
const LINEARISED_NEAR: usize = 24;
/// Distance within which refined contacts support the tool, m. No step of the search moves the
/// tool's grip farther.
const REACH: f64 = 0.3e-3;
/// The search has ended if a step changes the force by less than this share, plus [`ENDED_FORCE`].
const ENDED: f64 = 1e-3;
/// N.
const ENDED_FORCE: f64 = 1e-4;

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
/// results at rest at every [`JUDGED`]th pose, for a method behind palpus's coupling.
pub(super) fn measure(
    ground: &Ground,
    contact_offset: ContactOffset,
    wrenches: &[Wrench],
    still: &[FeltTick],
    add: Add<'_>,
) {
    let contact_offset = contact_offset.width(ground);
    let direct = |k: usize| match (&ground.truth, &ground.refined) {
        (Some(truth), _) => Some(direct(truth, &ground.settings, contact_offset, &ground.script[k])),
        (None, Some(_)) => shared(ground, contact_offset, k),
        (None, None) => None,
    };
    let (wanted, felt): (Vec<True>, Vec<Wrench>) =
        wrenches.iter().enumerate().filter_map(|(k, felt)| Some((direct(k)?, *felt))).unzip();
    let gain = compare(&wanted, &felt, None, &ALL, add);
    if let Some(gain) = gain.filter(|_| ground.truth.is_some()) {
        add("felt stiffness", "N/m", gain);
    }
    let Some(springs) = Springs::of(&ground.coupled).filter(|_| gain.is_some() && !still.is_empty()) else { return };
    let felt: Vec<Wrench> = wrenches.iter().copied().step_by(JUDGED).collect();
    let resting: Vec<Wrench> = still.iter().map(|still| still.wrench).collect();
    let sprung: Vec<Option<Wrench>> = ground
        .script
        .iter()
        .step_by(JUDGED)
        .zip(still)
        .map(|(probe, still)| match (&ground.truth, &ground.refined) {
            (Some(truth), _) => Some(springs.balance(truth, contact_offset, probe)),
            (None, Some(refined)) => springs.balance_near(&refined.law, contact_offset, probe, &still.shown),
            (None, None) => None,
        })
        .collect();
    let left_out = sprung.iter().filter(|sprung| sprung.is_none()).count();
    if ground.refined.is_some() {
        add("balance not found", "%", 100.0 * left_out as f64 / sprung.len().max(1) as f64);
    }
    let direct = |(k, sprung): (usize, &Option<Wrench>)| Some((direct(k * JUDGED)?, (*sprung)?));
    let (wanted, by_springs): (Vec<True>, Vec<Wrench>) = sprung.iter().enumerate().filter_map(direct).unzip();
    compare(&wanted, &by_springs, None, &SPRINGS, add);
    compare(&resting.iter().map(True::of).collect::<Vec<_>>(), &felt, Some(1.0), &MOTION, add);
    if let Some(lag) = lag(&resting, &felt) {
        add("lag", "s", lag);
    }
    let (sprung, resting): (Vec<True>, Vec<Wrench>) =
        sprung.iter().zip(&resting).filter_map(|(sprung, still)| Some((True::of(sprung.as_ref()?), *still))).unzip();
    compare(&sprung, &resting, Some(1.0), &REST, add);
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
    let contacts = ground.refined.as_ref()?.poses.get(k / JUDGED)?.as_ref()?;
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
        let mut tool = ToolDisplacement::default();
        let mut wrench = Wrench::ZERO;
        for _ in 0..LINEARISED {
            wrench = self.solved(self.rows(truth.supports(&tool.pose(self, probe)), contact_offset, probe, &tool));
            tool =
                ToolDisplacement { shift: wrench.force / self.stiffness, turn: wrench.torque / self.angular_stiffness };
        }
        wrench
    }

    /// Returns the wrench about the grip with which the contacts of a refined truth support the
    /// tool. The search starts with the tool at `start`; `None` if it does not end.
    fn balance_near(&self, law: &Refined, contact_offset: f64, probe: &ProbeState, start: &Pose) -> Option<Wrench> {
        let hand = &probe.pose_ba;
        let shift = start.point(self.grip_a) - hand.point(self.grip_a);
        let mut tool = ToolDisplacement { shift, turn: rotation_between(hand.rotation, start.rotation) };
        let mut last = Wrench::ZERO;
        for k in 0..LINEARISED_NEAR {
            let contacts = law.supports(&tool.pose(self, probe), REACH);
            let wrench = self.solved(self.rows(contacts, contact_offset, probe, &tool));
            let next =
                ToolDisplacement { shift: wrench.force / self.stiffness, turn: wrench.torque / self.angular_stiffness };
            let way = (next.shift - tool.shift).length();
            let change = wrench.force.distance(last.force);
            if k > 0 && way < REACH && change < ENDED * wrench.force.length() + ENDED_FORCE {
                return Some(wrench);
            }
            let share = if k < LINEARISED { 1.0 } else { 0.5 };
            tool = tool.towards(&next, (REACH / way).min(share));
            last = wrench;
        }
        None
    }

    /// Returns the contacts as constraints on the tool.
    fn rows(
        &self,
        contacts: impl IntoIterator<Item = TrueContact>,
        contact_offset: f64,
        probe: &ProbeState,
        tool: &ToolDisplacement,
    ) -> Vec<Row> {
        let grip = probe.pose_ba.point(self.grip_a) + tool.shift;
        let row = |contact: TrueContact| {
            let lever = (contact.point? - grip).cross(contact.normal);
            let offset = contact.separation - contact_offset - contact.normal.dot(tool.shift) - lever.dot(tool.turn);
            Some(Row { normal: contact.normal, lever, offset, push: 0.0 })
        };
        contacts.into_iter().filter_map(row).collect()
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

/// Displacement of the tool from the hand.
#[derive(Clone, Copy, Default)]
struct ToolDisplacement {
    /// Translation of the grip, m.
    shift: DVec3,
    /// Rotation vector, rad.
    turn: DVec3,
}

impl ToolDisplacement {
    fn pose(&self, springs: &Springs, probe: &ProbeState) -> Pose {
        let hand = &probe.pose_ba;
        let rotation = DQuat::from_scaled_axis(self.turn) * hand.rotation;
        Pose::new(rotation, hand.point(springs.grip_a) + self.shift - rotation * springs.grip_a)
    }

    /// Returns the displacement at this share of the way to `other`.
    fn towards(&self, other: &Self, share: f64) -> Self {
        Self { shift: self.shift.lerp(other.shift, share), turn: self.turn.lerp(other.turn, share) }
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
    /// The knife rests on both ridges, wherever the search starts. The balance is that of one
    /// spring.
    #[test]
    fn tool_on_springs_rests_on_refined_contacts() {
        let scene = palpus_scenes::scene("rails").expect("the scene is built in");
        let law = Refined::of(&scene).expect("the scene has a refined truth");
        let springs = Springs { stiffness: 400.0, angular_stiffness: 1.0, grip_a: DVec3::ZERO };
        let knife = |gap: f64, turn: f64| {
            let edge = law.supports(&Pose::IDENTITY, f64::INFINITY)[0].separation;
            Pose::new(DQuat::from_rotation_y(turn), DVec3::new(0.0, -0.01, gap - edge))
        };
        let hand = ProbeState { pose_ba: knife(-5e-4, 0.0), twist: palpus::algebra::Twist::default() };
        for start in [knife(0.0, 0.0), knife(2e-4, 0.01), knife(-2e-4, -0.01)] {
            let wrench = springs.balance_near(&law, 1e-5, &hand, &start).expect("the search ends");
            assert!((wrench.force - DVec3::Z * 400.0 * 5.1e-4).length() < 1e-5, "{wrench:?}");
        }
    }
}
