//! Scripted hand motions: the intended pose of the probe as a pure function of time.
//!
//! 1. A script gives key poses and their times. Between two keys, every coordinate is the
//!    minimum-jerk quintic polynomial for the position, velocity and acceleration at both ends
//!    \[Flash & Hogan 1985\].
//! 2. At a key that the hand passes through, velocity and acceleration are those of the parabola
//!    through this key and its two neighbours. At a resting key, velocity and acceleration are
//!    zero. So the path is twice continuously differentiable.
//! 3. The rotation is interpolated in the four coordinates of the quaternion, which is then
//!    normalised. The rotation is as smooth as the coordinates if neighbouring keys differ by
//!    clearly less than half a turn.
//! 4. A tremor may be added: sines between 8 and 12 Hz, chosen from a seed.

mod quintic;
mod recorded;
mod tremor;
mod wander;

use glam::{DMat4, DQuat, DVec3, DVec4};
use palpus::algebra::{Pose, Twist};

use quintic::{Quintic, Reach};
pub use recorded::{Placement, RecordedPathError};
pub use tremor::Tremor;
pub use wander::Wander;

/// A pose that a scripted hand reaches at a given time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Time since the start of the path, s.
    pub time: f64,
    /// Intended pose of the probe in the environment's frame.
    pub pose: Pose,
    /// True if the hand stops here for an instant.
    pub rest: bool,
}

impl Key {
    /// Returns a key at which the hand stops.
    pub fn rest(time: f64, pose: Pose) -> Self {
        Self { time, pose, rest: true }
    }

    /// Returns a key that the hand passes through.
    pub fn through(time: f64, pose: Pose) -> Self {
        Self { time, pose, rest: false }
    }
}

/// Intended motion of the hand from its first key to its last key. The module's description has the
/// details.
#[derive(Clone, Debug)]
pub struct HandPath {
    /// Start time of each segment, s, strictly increasing.
    starts: Vec<f64>,
    segments: Vec<Segment>,
    duration: f64,
    cyclic: bool,
    tremor: Option<Tremor>,
}

#[derive(Clone, Copy, Debug)]
struct Segment {
    translation: Quintic<DVec3>,
    rotation: Quintic<DVec4>,
}

impl HandPath {
    /// Returns the path through `keys`. It starts at rest at the first key and ends at rest at the
    /// last key, where it stays.
    ///
    /// # Panics
    /// Panics if there are fewer than two keys, if the first time is not 0, or if the times do not
    /// increase. A script is code, so this is a programming error.
    pub fn through(keys: &[Key]) -> Self {
        Self::build(keys, false)
    }

    /// Returns the path that repeats `keys` without end. The pose of the last key must equal the
    /// pose of the first key.
    ///
    /// # Panics
    /// Panics like [`Self::through`], and if the last pose differs from the first pose.
    pub fn cyclic(keys: &[Key]) -> Self {
        Self::build(keys, true)
    }

    /// Returns the cyclic path through `count` samples of a motion at equal time steps. `motion`
    /// gives the pose for a phase in \[0, 1), and `duration` is its period (s).
    pub fn sampled_cycle(duration: f64, count: usize, motion: impl Fn(f64) -> Pose) -> Self {
        let key =
            |k: usize| Key::through(duration * k as f64 / count as f64, motion((k % count) as f64 / count as f64));
        Self::cyclic(&(0..=count).map(key).collect::<Vec<_>>())
    }

    /// Returns this path with an added tremor.
    pub fn with_tremor(self, tremor: Tremor) -> Self {
        Self { tremor: Some(tremor), ..self }
    }

    /// Returns this path in another frame. `pose` places the old frame in the new frame.
    #[must_use]
    pub fn placed(mut self, pose: &Pose) -> Self {
        let turn = DMat4::from_cols(
            (pose.rotation * DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)).into(),
            (pose.rotation * DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0)).into(),
            (pose.rotation * DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0)).into(),
            (pose.rotation * DQuat::from_xyzw(0.0, 0.0, 0.0, 1.0)).into(),
        );
        for segment in &mut self.segments {
            segment.translation = segment.translation.map(|c| pose.rotation * c);
            segment.translation.shift(pose.translation);
            segment.rotation = segment.rotation.map(|c| turn * c);
        }
        self
    }

    /// Returns the time from the first key to the last key, s. For a cyclic path this is one
    /// period.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Returns true if the path starts again after [`Self::duration`].
    pub fn is_cyclic(&self) -> bool {
        self.cyclic
    }

    /// Returns the intended pose at `time` (s). Before the start and after the end of a path that
    /// is not cyclic, returns the pose at that end.
    pub fn pose(&self, time: f64) -> Pose {
        let (segment, s) = self.locate(time);
        let mut translation = segment.translation.at(s);
        if let Some(tremor) = &self.tremor {
            translation += tremor.displacement(time);
        }
        Pose { rotation: DQuat::from_vec4(segment.rotation.at(s).normalize()), translation }
    }

    /// Returns the twist of the intended pose at `time` (s), in the environment's frame. The linear
    /// part is the velocity of the probe's origin. The derivative is exact.
    pub fn twist(&self, time: f64) -> Twist {
        let held = !self.cyclic && !(0.0..=self.duration).contains(&time);
        let (segment, s) = self.locate(time);
        let mut linear = if held { DVec3::ZERO } else { segment.translation.rate(s) };
        if let Some(tremor) = &self.tremor {
            linear += tremor.velocity(time);
        }
        let angular = if held {
            DVec3::ZERO
        } else {
            // ω = 2 q̇ q⁻¹. The part of q̇ along q only changes the length of q, and does not
            // affect the vector part.
            let (q, rate) = (segment.rotation.at(s), segment.rotation.rate(s));
            let spin = DQuat::from_vec4(rate) * DQuat::from_vec4(q).conjugate();
            spin.xyz() * (2.0 / q.length_squared())
        };
        Twist { angular, linear }
    }

    /// Returns the segment that contains `time`, and the time since its start (s).
    fn locate(&self, time: f64) -> (&Segment, f64) {
        let time = if self.cyclic { time.rem_euclid(self.duration) } else { time.clamp(0.0, self.duration) };
        let k = self.starts.partition_point(|&start| start <= time).saturating_sub(1);
        (&self.segments[k], time - self.starts[k])
    }

    fn build(keys: &[Key], cyclic: bool) -> Self {
        assert!(keys.len() >= 2, "a path must have at least two keys");
        assert!(keys[0].time == 0.0, "a path must start at time 0");
        assert!(keys.windows(2).all(|pair| pair[0].time < pair[1].time), "the times of a path's keys must increase");
        let (first, last) = (keys[0].pose, keys[keys.len() - 1].pose);
        let joined = first.translation.abs_diff_eq(last.translation, 1e-12)
            && first.rotation.dot(last.rotation).abs() > 1.0 - 1e-12;
        assert!(!cyclic || joined, "a cyclic path must end where it begins");
        let translations: Vec<DVec3> = keys.iter().map(|key| key.pose.translation).collect();
        let (rotations, closing) = same_hemisphere(keys);
        let duration = keys[keys.len() - 1].time;
        let translation = |k: usize| reach(keys, cyclic, k, |j, _| translations[j]);
        let rotation =
            |k: usize| reach(keys, cyclic, k, |j, laps| rotations[j] * if laps == 0 { 1.0 } else { closing });
        let segments = (0..keys.len() - 1)
            .map(|k| {
                let span = keys[k + 1].time - keys[k].time;
                Segment {
                    translation: Quintic::between(translation(k), translation(k + 1), span),
                    rotation: Quintic::between(rotation(k), rotation(k + 1), span),
                }
            })
            .collect();
        let starts = keys[..keys.len() - 1].iter().map(|key| key.time).collect();
        Self { starts, segments, duration, cyclic, tremor: None }
    }
}

/// Returns the quaternions of the keys, each with the sign that is nearer to the previous
/// quaternion. Also returns the sign change over one whole period.
fn same_hemisphere(keys: &[Key]) -> (Vec<DVec4>, f64) {
    let mut rotations: Vec<DVec4> = Vec::with_capacity(keys.len());
    for key in keys {
        let q = DVec4::from(key.pose.rotation);
        let flip = rotations.last().is_some_and(|previous| previous.dot(q) < 0.0);
        rotations.push(if flip { -q } else { q });
    }
    let closing = rotations[0].dot(rotations[keys.len() - 1]).signum();
    (rotations, closing)
}

/// Returns the position, velocity and acceleration of the coordinates at key `k`. At a resting key,
/// velocity and acceleration are zero. At other keys, velocity and acceleration are those of the
/// parabola through the key and its two neighbours. `value(j, laps)` returns the coordinates at key
/// `j` in the previous (−1), the present (0) or the next period (1).
fn reach<V>(keys: &[Key], cyclic: bool, k: usize, value: impl Fn(usize, i32) -> V) -> Reach<V>
where
    V: Copy + std::ops::Sub<Output = V> + std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    let last = keys.len() - 1;
    let here = value(k, 0);
    let at_end = k == 0 || k == last;
    if keys[k].rest || (at_end && !cyclic) {
        return Reach { position: here, velocity: here * 0.0, acceleration: here * 0.0 };
    }
    let (before, span_before) = if k == 0 {
        (value(last - 1, -1), keys[last].time - keys[last - 1].time)
    } else {
        (value(k - 1, 0), keys[k].time - keys[k - 1].time)
    };
    let (after, span_after) = if k == last {
        (value(1, 1), keys[1].time - keys[0].time)
    } else {
        (value(k + 1, 0), keys[k + 1].time - keys[k].time)
    };
    let slope_before = (here - before) * (1.0 / span_before);
    let slope_after = (after - here) * (1.0 / span_after);
    let whole = span_before + span_after;
    Reach {
        position: here,
        velocity: slope_before * (span_after / whole) + slope_after * (span_before / whole),
        acceleration: (slope_after - slope_before) * (2.0 / whole),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, turn: f64) -> Pose {
        Pose::new(DQuat::from_rotation_y(turn), DVec3::new(x, 2.0 * x, -x))
    }

    fn wandering() -> HandPath {
        HandPath::through(&[
            Key::rest(0.0, at(0.0, 0.0)),
            Key::through(0.5, at(0.1, 0.8)),
            Key::through(0.8, at(0.05, 1.3)),
            Key::rest(1.5, at(-0.1, 0.1)),
        ])
    }

    fn stir() -> HandPath {
        HandPath::sampled_cycle(2.0, 16, |phase| {
            let (sin, cos) = (std::f64::consts::TAU * phase).sin_cos();
            Pose::new(DQuat::from_rotation_z(std::f64::consts::TAU * phase), DVec3::new(cos, sin, 0.0) * 0.03)
        })
    }

    #[test]
    fn keys_are_reached_on_time() {
        let path = wandering();
        assert!((path.pose(0.5).translation - at(0.1, 0.8).translation).length() < 1e-15);
        assert!((path.pose(0.8).rotation.dot(at(0.05, 1.3).rotation).abs() - 1.0).abs() < 1e-14);
        assert_eq!(path.pose(-1.0), path.pose(0.0));
        assert_eq!(path.pose(9.0), path.pose(1.5));
        assert_eq!(path.twist(9.0), Twist::default());
    }

    #[test]
    fn single_move_has_minimum_jerk() {
        let path = HandPath::through(&[Key::rest(0.0, at(0.0, 0.0)), Key::rest(2.0, at(1.0, 0.0))]);
        for s in [0.1f64, 0.4, 0.9] {
            let expected = 10.0 * s.powi(3) - 15.0 * s.powi(4) + 6.0 * s.powi(5);
            assert!((path.pose(2.0 * s).translation.x - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn twist_is_the_continuous_derivative() {
        let h = 1e-6;
        for path in [wandering(), stir(), wandering().with_tremor(Tremor::new(1e-4, 7))] {
            let mut previous = path.twist(0.0);
            for k in 1..2000 {
                let t = k as f64 * 2e-3 * path.duration() / 2.0;
                let (before, after, twist) = (path.pose(t - h), path.pose(t + h), path.twist(t));
                let linear = (after.translation - before.translation) / (2.0 * h);
                let turn = after.rotation * before.rotation.conjugate();
                let angular = turn.xyz() * (2.0 * turn.w.signum()) / (2.0 * h);
                let ended = !path.is_cyclic() && (t - path.duration()).abs() < 2.0 * h;
                assert!(ended || (linear - twist.linear).length() < 1e-6, "{t}");
                assert!(ended || (angular - twist.angular).length() < 1e-6, "{t}");
                assert!((twist.linear - previous.linear).length() < 0.05, "{t}");
                assert!((twist.angular - previous.angular).length() < 0.2, "{t}");
                previous = twist;
            }
        }
    }

    #[test]
    fn cycle_is_smooth_if_its_quaternion_changes_sign() {
        let path = stir();
        assert!((path.pose(2.0).translation - path.pose(0.0).translation).length() < 1e-15);
        for phase in [0.0, 0.31, 0.5, 0.97] {
            let twist = path.twist(2.0 * phase);
            assert!((twist.linear.length() - std::f64::consts::PI * 0.03).abs() < 5e-3, "{phase}");
            assert!((twist.angular.z - std::f64::consts::PI).abs() < 5e-2, "{phase}");
        }
    }
}
