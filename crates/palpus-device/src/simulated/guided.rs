//! A hand that follows its script until a person takes it by the window.
//!
//! 1. While it is *held*, it goes where the person holds it: critically damped, and no faster than
//!    hands go. The script's time stands still.
//! 2. *Released*, it holds nothing: it intends what the grip does, so that no force stays and
//!    contacts push the grip out freely.
//! 3. *Given back*, it goes back in the same way to where it left the script, which then starts
//!    again, faster and faster until its time runs as time does.
//! 4. Asked to yield, it is as released until the grip has passed a plane.
//! 5. Else it is the script, to the bit.
//!
//! So the intended pose has no step, whatever a mouse does, but for that by which a hand lets go.
//! Once a tick the newest [`Guide`] is looked at; between ticks the motion is a closed form: the
//! offset from a goal, e(t) = (e₀ + (v₀ + ω e₀) t) exp(−ω t), for translation, and for rotation as
//! a rotation vector. A goal that is farther than 2 v/ω is taken to be that near, on the way to it:
//! no faster than v is then how it is approached.

use glam::DVec3;
use palpus::algebra::{Pose, Twist, rotation_between};

use super::hand::Intent;
use crate::latest::Newest;

/// Actions of a person at the window on a simulated hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Guide {
    /// Nothing: the hand follows its script.
    #[default]
    Script,
    /// Holds it: the hand intends this pose of the grip, in the device's frame.
    Held(Pose),
    /// Lets go of it: the hand goes where the grip goes.
    Released,
}

/// ω, 1/s: it is within a tenth of its way after 0.16 s.
const FOLLOW: f64 = 25.0;
/// m/s and rad/s: brisk for a hand with a tool; a tenth of what the safety chain believes of one.
const FASTEST: f64 = 0.4;
const FASTEST_TURN: f64 = 5.0;
/// m and rad from the script: it starts again.
const NEAR: f64 = 0.5e-3;
const NEAR_TURN: f64 = 0.02;
/// s in which the script's time comes up to speed.
const START: f64 = 0.5;
/// m, rad, and both in a time of 1/ω: a smaller offset counts as zero.
const NOTHING: f64 = 1e-10;
/// s: over which the script's velocity is a difference.
const INSTANT: f64 = 1e-5;

/// A script, and what a person makes of it; see the module's outline.
pub struct Guided<I> {
    script: I,
    guide: Newest<Guide>,
    /// The newest guide that could be meant.
    guided: Guide,
    /// s: when the present goal and offset were set.
    from: f64,
    goal: Goal,
    offset: Option<Offset>,
    /// It holds nothing before this plane: a point (m) and the normal, device's frame.
    yields_before: Option<[DVec3; 2]>,
}

/// Reference of the offset.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// The script, this much behind time, s.
    Playing { lag: f64 },
    /// The script from time `at` (s) on, `pace` of time's pace at first and faster from there on.
    Starting { at: f64, pace: f64 },
    /// A pose, while the script stands at time `at`, s.
    Still { pose: Pose, at: f64 },
}

/// How far the intended pose is from its goal at first, and how that changes.
#[derive(Clone, Copy, Debug)]
struct Offset {
    /// m, and m/s.
    place: [DVec3; 2],
    /// Rotation vector, rad, from the goal to the hand; and rad/s.
    turn: [DVec3; 2],
}

impl<I: Intent> Guided<I> {
    /// A hand that follows `script` unless `guide` says otherwise.
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

    /// With `before`, the hand exerts no force until the grip has passed that plane, so that a
    /// device can lead the grip: a point (m) and the normal, in the device's frame. It exerts force
    /// at once if a person takes the grip.
    pub fn yielding(self, before: Option<[DVec3; 2]>) -> Self {
        Self { yields_before: before, ..self }
    }

    /// Time of the script at `time`, s, and how fast it runs.
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

    /// How the intended pose moves at `time`.
    fn twist(&self, time: f64) -> Twist {
        let mut twist = self.goal_twist(time);
        if let Some(offset) = &self.offset {
            let Offset { place, turn } = offset.after(time - self.from);
            twist.linear += place[1];
            twist.angular += turn[1];
        }
        twist
    }

    /// Goes on from `time` towards `pose`, the script standing.
    fn approach(&mut self, pose: &Pose, time: f64) {
        let (now, twist, at) = (self.pose(time), self.twist(time), self.script_time(time).0);
        let mut offset = Offset::of(&now, &twist, pose, &Twist::default());
        offset.place[0] = offset.place[0].clamp_length_max(2.0 * FASTEST / FOLLOW);
        offset.turn[0] = offset.turn[0].clamp_length_max(2.0 * FASTEST_TURN / FOLLOW);
        self.goal = Goal::Still { pose: offset.undone(&now), at };
        self.offset = Some(offset);
        self.from = time;
    }

    /// Intends at `time` what the grip does.
    fn release(&mut self, grip: &Pose, time: f64) {
        self.goal = Goal::Still { pose: *grip, at: self.script_time(time).0 };
        self.offset = None;
        self.from = time;
    }

    /// Goes on from `time` along the script, at the pace that it has or from a stand.
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
    /// Offset of a hand at `pose` with `twist` from a `goal` that moves as well.
    fn of(pose: &Pose, twist: &Twist, goal: &Pose, goal_twist: &Twist) -> Self {
        Self {
            place: [pose.translation - goal.translation, twist.linear - goal_twist.linear],
            turn: [rotation_between(goal.rotation, pose.rotation), twist.angular - goal_twist.angular],
        }
    }

    /// Returns the offset `seconds` later.
    fn after(&self, seconds: f64) -> Self {
        let fading = (-FOLLOW * seconds).exp();
        let later = |[offset, rate]: [DVec3; 2]| {
            let drive = rate + offset * FOLLOW;
            [(offset + drive * seconds) * fading, (rate - drive * (FOLLOW * seconds)) * fading]
        };
        Self { place: later(self.place), turn: later(self.turn) }
    }

    /// The pose that is off `goal` by this.
    fn done(&self, goal: &Pose) -> Pose {
        Pose {
            rotation: (glam::DQuat::from_scaled_axis(self.turn[0]) * goal.rotation).normalize(),
            translation: goal.translation + self.place[0],
        }
    }

    /// The goal that `pose` is off by this.
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
    /// Steps between two ticks, as the dynamics take them.
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

    /// Every pose of `ticks` ticks from tick `from` on.
    fn poses(hand: &mut Guided<impl Intent>, from: u32, ticks: u32) -> Vec<Pose> {
        let mut all = Vec::new();
        for tick in from..from + ticks {
            let time = f64::from(tick) * DT;
            hand.begin(time, &hand.pose(time));
            all.extend((0..BETWEEN).map(|k| hand.pose(time + DT * f64::from(k) / f64::from(BETWEEN))));
        }
        all
    }

    /// Messages at ticks: a grip that is taken, thrown about, released and taken again.
    const TOLD: [(u32, Option<f64>); 8] = [
        (200, Some(0.0)),
        (400, Some(0.5)),
        (420, Some(-0.5)),
        (700, None),
        (760, Some(0.02)),
        (761, None),
        (2500, Some(0.1)),
        (2900, None),
    ];

    fn told() -> Vec<Pose> {
        let (mut hand, mut publisher) = hand();
        let (mut all, mut from) = (Vec::new(), 0);
        for (tick, guide) in TOLD {
            all.extend(poses(&mut hand, from, tick - from));
            publisher.publish(guide.map_or(Guide::Script, held));
            from = tick;
        }
        all.extend(poses(&mut hand, from, 4000));
        all
    }

    #[test]
    fn a_hand_that_is_left_alone_is_its_script_to_the_bit() {
        let (mut hand, mut publisher) = hand();
        publisher.publish(Guide::Script);
        for (k, pose) in poses(&mut hand, 0, 500).iter().enumerate() {
            let (tick, part) = (k as u32 / BETWEEN, k as u32 % BETWEEN);
            assert_eq!(*pose, script(f64::from(tick) * DT + DT * f64::from(part) / f64::from(BETWEEN)));
        }
    }

    #[test]
    fn a_held_hand_goes_where_it_is_held_and_stays() {
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
    fn nothing_that_it_is_told_makes_a_step_or_is_too_fast() {
        let all = told();
        // The script's own speed counts while an offset from it fades.
        let (fastest, fastest_turn) = (FASTEST + 0.12, FASTEST_TURN + 2.5);
        let step = DT / f64::from(BETWEEN);
        for (k, pair) in all.windows(2).enumerate() {
            let speed = pair[0].translation.distance(pair[1].translation) / step;
            let turn = rotation_between(pair[0].rotation, pair[1].rotation).length() / step;
            assert!(speed < fastest && turn < fastest_turn, "{speed} m/s, {turn} rad/s at {k}");
        }
        // Nor does its velocity.
        for (k, three) in all.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]].map(|pose| pose.translation);
            let jump = (c - b - (b - a)).length() / step;
            assert!(jump < 0.02, "{jump} m/s at {k}");
        }
    }

    #[test]
    fn let_go_of_it_comes_back_and_the_script_goes_on_where_it_stood() {
        let (mut hand, mut publisher) = hand();
        poses(&mut hand, 0, 500);
        publisher.publish(held(-0.1));
        poses(&mut hand, 500, 1000);
        publisher.publish(Guide::Script);
        poses(&mut hand, 1500, 4000);
        // It stood for a second, and came back and up to speed in less than two.
        let Goal::Playing { lag } = hand.goal else { unreachable!("it plays again") };
        assert!(hand.offset.is_none() && (1.0..3.0).contains(&lag), "{lag} s");
        assert_eq!(hand.pose(9.0), script(9.0 - lag));
    }

    #[test]
    fn released_it_goes_where_the_grip_goes() {
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
        // Taken again, it starts from there; given back, it finds its script.
        publisher.publish(held(-0.05));
        let taken = poses(&mut hand, 400, 1);
        assert!(taken[0].translation.distance(DVec3::Y * 0.0399) < 1e-9);
        publisher.publish(Guide::Script);
        poses(&mut hand, 401, 4000);
        assert!(matches!(hand.goal, Goal::Playing { .. }));
    }

    #[test]
    fn the_same_guides_at_the_same_ticks_move_it_the_same_bit_for_bit() {
        assert!(told() == told());
    }
}
