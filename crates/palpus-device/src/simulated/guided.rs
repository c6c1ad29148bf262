//! A simulated operator that follows a script until a person takes the grip in the window.
//!
//! 1. While a person *holds* the grip, the intended pose moves to the held pose: critically damped,
//!    and no faster than a hand moves. The script's time stands still.
//! 2. After *release*, the operator exerts no force: the intended pose is the grip's pose, so
//!    contacts push the grip out freely.
//! 3. When the grip is *given back*, the intended pose returns in the same way to the point where
//!    it left the script. Then the script starts again, and its time accelerates to normal speed.
//! 4. An operator that yields exerts no force until the grip has passed a given plane.
//! 5. Otherwise the intended pose is exactly the script's.
//!
//! So the intended pose has no jump for any motion of the mouse, except at a release. The newest
//! [`Guide`] is read once per tick. Between ticks the motion is a closed form: the offset from a
//! goal is e(t) = (e₀ + (v₀ + ω e₀) t) exp(−ω t), for translation and for rotation (as a rotation
//! vector). A goal farther away than 2 v/ω is replaced by a point at that distance on the way to
//! it, so the approach is no faster than v.

use glam::DVec3;
use palpus::algebra::{Pose, Twist, rotation_between};

use super::hand::Intent;
use crate::latest::Newest;

/// Command of a person in the window to the simulated operator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Guide {
    /// The operator follows the script.
    #[default]
    Script,
    /// The person holds the grip: the operator intends this pose of the grip, in the device's
    /// frame.
    Held(Pose),
    /// The person has released the grip: the operator exerts no force.
    Released,
}

/// Angular frequency ω, 1/s: a tenth of the initial distance is left after 0.16 s.
const FOLLOW: f64 = 25.0;
/// Largest speeds, m/s and rad/s. These speeds are brisk for a hand with a tool, and about a
/// tenth of the speeds that the safety chain accepts.
const FASTEST: f64 = 0.4;
const FASTEST_TURN: f64 = 5.0;
/// Distance from the script, m and rad, below which the script starts again.
const NEAR: f64 = 0.5e-3;
const NEAR_TURN: f64 = 0.02;
/// Time in which the script's time accelerates to normal speed, s.
const START: f64 = 0.5;
/// An offset smaller than this counts as zero. In m or rad; a velocity is first divided by ω.
const NOTHING: f64 = 1e-10;
/// Time step for the numeric derivative of the script, s.
const INSTANT: f64 = 1e-5;

/// A script and a person's commands; the module describes how they combine.
pub struct Guided<I> {
    script: I,
    guide: Newest<Guide>,
    /// The newest valid guide.
    guided: Guide,
    /// Time at which the present goal and offset were set, s.
    from: f64,
    goal: Goal,
    offset: Option<Offset>,
    /// The operator exerts no force before this plane: a point (m) and the normal, in the device's
    /// frame.
    yields_before: Option<[DVec3; 2]>,
}

/// The goal from which the offset is measured.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// The script, delayed by `lag`, s.
    Playing { lag: f64 },
    /// The script from time `at` (s) on. Its time starts at `pace` times normal speed and
    /// accelerates.
    Starting { at: f64, pace: f64 },
    /// A fixed pose, while the script stands at time `at`, s.
    Still { pose: Pose, at: f64 },
}

/// Offset of the intended pose from its goal, and the rate of this offset.
#[derive(Clone, Copy, Debug)]
struct Offset {
    /// Translation, m, and its rate, m/s.
    place: [DVec3; 2],
    /// Rotation vector from the goal to the intended pose, rad, and its rate, rad/s.
    turn: [DVec3; 2],
}

impl<I: Intent> Guided<I> {
    /// Returns an operator that follows `script` unless `guide` commands something else.
    pub fn new(script: I, guide: Newest<Guide>) -> Self {
        Self {
            script,
            guide,
            guided: Guide::Script,
            from: 0.0,
            goal: Goal::Playing { lag: 0.0 },
            offset: None,
            yields_before: None,
        }
    }

    /// With `before`, the operator exerts no force until the grip has passed that plane, so that a
    /// device can lead the grip. The plane is a point (m) and the normal, in the device's frame. If
    /// a person takes the grip, the operator exerts force at once.
    pub fn yielding(self, before: Option<[DVec3; 2]>) -> Self {
        Self { yields_before: before, ..self }
    }

    /// Returns the script's time at `time` (s), and the script's speed relative to normal time.
    fn script_time(&self, time: f64) -> (f64, f64) {
        let passed = time - self.from;
        match self.goal {
            Goal::Playing { lag } => (time - lag, 1.0),
            Goal::Starting { at, pace } => (at + passed * (pace + 0.5 * passed / START), pace + passed / START),
            Goal::Still { at, .. } => (at, 0.0),
        }
    }

    fn goal_pose(&self, time: f64) -> Pose {
        match self.goal {
            Goal::Still { pose, .. } => pose,
            _ => self.script.pose(self.script_time(time).0),
        }
    }

    fn goal_twist(&self, time: f64) -> Twist {
        let (at, pace) = self.script_time(time);
        if pace <= 0.0 {
            return Twist::default();
        }
        let (before, after) = (self.script.pose(at - INSTANT), self.script.pose(at + INSTANT));
        let rate = pace / (2.0 * INSTANT);
        Twist {
            angular: rotation_between(before.rotation, after.rotation) * rate,
            linear: (after.translation - before.translation) * rate,
        }
    }

    /// Returns the velocity of the intended pose at `time`.
    fn twist(&self, time: f64) -> Twist {
        let mut twist = self.goal_twist(time);
        if let Some(offset) = &self.offset {
            let Offset { place, turn } = offset.after(time - self.from);
            twist.linear += place[1];
            twist.angular += turn[1];
        }
        twist
    }

    /// From `time` on, moves towards `pose` while the script stands still.
    fn approach(&mut self, pose: &Pose, time: f64) {
        let (now, twist, at) = (self.pose(time), self.twist(time), self.script_time(time).0);
        let mut offset = Offset::of(&now, &twist, pose, &Twist::default());
        offset.place[0] = offset.place[0].clamp_length_max(2.0 * FASTEST / FOLLOW);
        offset.turn[0] = offset.turn[0].clamp_length_max(2.0 * FASTEST_TURN / FOLLOW);
        self.goal = Goal::Still { pose: offset.undone(&now), at };
        self.offset = Some(offset);
        self.from = time;
    }

    /// From `time` on, intends the grip's pose.
    fn release(&mut self, grip: &Pose, time: f64) {
        self.goal = Goal::Still { pose: *grip, at: self.script_time(time).0 };
        self.offset = None;
        self.from = time;
    }

    /// From `time` on, follows the script, at its present speed or from a standstill.
    fn resume(&mut self, time: f64) {
        let (now, twist) = (self.pose(time), self.twist(time));
        let (at, pace) = self.script_time(time);
        self.goal = if pace < 1.0 { Goal::Starting { at, pace } } else { Goal::Playing { lag: time - at } };
        self.from = time;
        let (goal, goal_twist) = (self.goal_pose(time), self.goal_twist(time));
        self.offset = Some(Offset::of(&now, &twist, &goal, &goal_twist)).filter(|offset| !offset.is_nothing());
    }
}

impl<I: Intent> Intent for Guided<I> {
    fn pose(&self, time: f64) -> Pose {
        let goal = self.goal_pose(time);
        match &self.offset {
            Some(offset) => offset.after(time - self.from).done(&goal),
            None => goal,
        }
    }

    fn begin(&mut self, time: f64, grip: &Pose) {
        match self.guide.take() {
            // An invalid pose is ignored.
            Some(Guide::Held(pose)) if !pose.is_valid() => {}
            Some(guide) => self.guided = *guide,
            None => {}
        }
        match self.guided {
            Guide::Held(pose) => {
                self.yields_before = None;
                return self.approach(&pose, time);
            }
            Guide::Released => return self.release(grip, time),
            Guide::Script => {}
        }
        self.yields_before =
            self.yields_before.filter(|[point, normal]| (grip.translation - *point).dot(*normal) < 0.0);
        if self.yields_before.is_some() {
            return self.release(grip, time);
        }
        match self.goal {
            Goal::Playing { .. } if self.offset.is_none() => {}
            Goal::Still { at, .. } => {
                let (now, back) = (self.pose(time), self.script.pose(at));
                let is_near = now.translation.distance(back.translation) < NEAR
                    && rotation_between(back.rotation, now.rotation).length() < NEAR_TURN;
                if is_near { self.resume(time) } else { self.approach(&back, time) }
            }
            _ => self.resume(time),
        }
    }
}

impl Offset {
    /// Returns the offset of an operator at `pose` with `twist` from a moving `goal`.
    fn of(pose: &Pose, twist: &Twist, goal: &Pose, goal_twist: &Twist) -> Self {
        Self {
            place: [pose.translation - goal.translation, twist.linear - goal_twist.linear],
            turn: [rotation_between(goal.rotation, pose.rotation), twist.angular - goal_twist.angular],
        }
    }

    /// Returns the offset after `seconds`.
    fn after(&self, seconds: f64) -> Self {
        let fading = (-FOLLOW * seconds).exp();
        let later = |[offset, rate]: [DVec3; 2]| {
            let drive = rate + offset * FOLLOW;
            [(offset + drive * seconds) * fading, (rate - drive * (FOLLOW * seconds)) * fading]
        };
        Self { place: later(self.place), turn: later(self.turn) }
    }

    /// Returns `goal` moved by this offset.
    fn done(&self, goal: &Pose) -> Pose {
        Pose {
            rotation: (glam::DQuat::from_scaled_axis(self.turn[0]) * goal.rotation).normalize(),
            translation: goal.translation + self.place[0],
        }
    }

    /// Returns the goal from which `pose` has this offset.
    fn undone(&self, pose: &Pose) -> Pose {
        Pose {
            rotation: (glam::DQuat::from_scaled_axis(-self.turn[0]) * pose.rotation).normalize(),
            translation: pose.translation - self.place[0],
        }
    }

    fn is_nothing(&self) -> bool {
        let most = |[offset, rate]: [DVec3; 2]| offset.length().max(rate.length() / FOLLOW);
        most(self.place).max(most(self.turn)) < NOTHING
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::latest::{Publisher, latest};

    const DT: f64 = 1e-3;
    /// Number of integration steps per tick, as in the dynamics.
    const BETWEEN: u32 = 10;

    fn script(time: f64) -> Pose {
        let turn = DQuat::from_rotation_z(0.8 * (2.0 * time).sin()) * DQuat::from_rotation_x(0.5 * time);
        Pose::new(turn, DVec3::new(0.03 * (3.0 * time).sin(), 0.02 * (2.0 * time).cos(), 0.01 * time.sin()))
    }

    fn hand() -> (Guided<impl Intent>, Publisher<Guide>) {
        let (publisher, guide) = latest(Guide::Script);
        (Guided::new(script, guide), publisher)
    }

    fn held(x: f64) -> Guide {
        Guide::Held(Pose::new(DQuat::from_rotation_y(1.2 * x.signum()), DVec3::new(x, 0.05, -0.04)))
    }

    /// Returns the poses of `ticks` ticks, from tick `from` on.
    fn poses(hand: &mut Guided<impl Intent>, from: u32, ticks: u32) -> Vec<Pose> {
        let mut all = Vec::new();
        for tick in from..from + ticks {
            let time = f64::from(tick) * DT;
            hand.begin(time, &hand.pose(time));
            all.extend((0..BETWEEN).map(|k| hand.pose(time + DT * f64::from(k) / f64::from(BETWEEN))));
        }
        all
    }

    /// Guides by tick: the grip is taken, moved fast, given back and taken again.
    const GUIDES: [(u32, Option<f64>); 8] = [
        (200, Some(0.0)),
        (400, Some(0.5)),
        (420, Some(-0.5)),
        (700, None),
        (760, Some(0.02)),
        (761, None),
        (2500, Some(0.1)),
        (2900, None),
    ];

    fn guided() -> Vec<Pose> {
        let (mut hand, mut publisher) = hand();
        let (mut all, mut from) = (Vec::new(), 0);
        for (tick, guide) in GUIDES {
            all.extend(poses(&mut hand, from, tick - from));
            publisher.publish(guide.map_or(Guide::Script, held));
            from = tick;
        }
        all.extend(poses(&mut hand, from, 4000));
        all
    }

    #[test]
    fn unguided_operator_follows_script_exactly() {
        let (mut hand, mut publisher) = hand();
        publisher.publish(Guide::Script);
        for (k, pose) in poses(&mut hand, 0, 500).iter().enumerate() {
            let (tick, part) = (k as u32 / BETWEEN, k as u32 % BETWEEN);
            assert_eq!(*pose, script(f64::from(tick) * DT + DT * f64::from(part) / f64::from(BETWEEN)));
        }
    }

    #[test]
    fn held_operator_goes_to_held_pose_and_stays() {
        let (mut hand, mut publisher) = hand();
        poses(&mut hand, 0, 100);
        publisher.publish(held(0.07));
        let last = *poses(&mut hand, 100, 1500).last().unwrap();
        let Guide::Held(goal) = held(0.07) else { unreachable!() };
        assert!(last.translation.distance(goal.translation) < 1e-9, "{last:?}");
        assert!(rotation_between(last.rotation, goal.rotation).length() < 1e-7, "{last:?}");
        publisher.publish(Guide::Held(Pose::from_translation(DVec3::NAN)));
        assert!(poses(&mut hand, 1600, 10).iter().all(|pose| pose.translation.distance(goal.translation) < 1e-9));
    }

    #[test]
    fn no_guide_causes_a_jump_or_excessive_speed() {
        let all = guided();
        // While an offset from the script fades, the script's own speed adds to the speed.
        let (fastest, fastest_turn) = (FASTEST + 0.12, FASTEST_TURN + 2.5);
        let step = DT / f64::from(BETWEEN);
        for (k, pair) in all.windows(2).enumerate() {
            let speed = pair[0].translation.distance(pair[1].translation) / step;
            let turn = rotation_between(pair[0].rotation, pair[1].rotation).length() / step;
            assert!(speed < fastest && turn < fastest_turn, "{speed} m/s, {turn} rad/s at {k}");
        }
        // The velocity must not jump either.
        for (k, three) in all.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]].map(|pose| pose.translation);
            let jump = (c - b - (b - a)).length() / step;
            assert!(jump < 0.02, "{jump} m/s at {k}");
        }
    }

    #[test]
    fn script_continues_after_grip_is_given_back() {
        let (mut hand, mut publisher) = hand();
        poses(&mut hand, 0, 500);
        publisher.publish(held(-0.1));
        poses(&mut hand, 500, 1000);
        publisher.publish(Guide::Script);
        poses(&mut hand, 1500, 4000);
        // The script stood for a second, and returned to normal speed within two more.
        let Goal::Playing { lag } = hand.goal else { unreachable!("the script must run again") };
        assert!(hand.offset.is_none() && (1.0..3.0).contains(&lag), "{lag} s");
        assert_eq!(hand.pose(9.0), script(9.0 - lag));
    }

    #[test]
    fn released_operator_follows_the_grip() {
        let (mut hand, mut publisher) = hand();
        poses(&mut hand, 0, 100);
        publisher.publish(held(0.07));
        poses(&mut hand, 100, 200);
        publisher.publish(Guide::Released);
        for tick in 300..400u32 {
            let (time, grip) = (f64::from(tick) * DT, Pose::from_translation(DVec3::Y * 1e-4 * f64::from(tick)));
            hand.begin(time, &grip);
            assert_eq!(hand.pose(time + 0.5 * DT), grip);
        }
        // When the grip is taken again, the operator starts from its pose. When the grip is given
        // back, the operator returns to the script.
        publisher.publish(held(-0.05));
        let taken = poses(&mut hand, 400, 1);
        assert!(taken[0].translation.distance(DVec3::Y * 0.0399) < 1e-9);
        publisher.publish(Guide::Script);
        poses(&mut hand, 401, 4000);
        assert!(matches!(hand.goal, Goal::Playing { .. }));
    }

    #[test]
    fn same_guides_give_identical_motion() {
        assert!(guided() == guided());
    }
}
