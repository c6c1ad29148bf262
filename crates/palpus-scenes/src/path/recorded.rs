//! The path of a recorded hand motion.
//!
//! 1. Recordings are irregular (uneven times, positions rounded to 0.1 mm) and have gaps. Dense
//!    samples are averaged over 15 ms on each side with a triangular weight, and a key is set every
//!    10 ms. A movement of 12 Hz, the fastest of a hand, keeps 90 % of its amplitude, and the
//!    recorder's noise is removed. Sparse samples are used as keys.
//! 2. In a gap the motion of the hand is unknown. The path comes to rest, moves to the other end of
//!    the gap, and starts again with the velocity of the hand after the gap.
//! 3. At both ends the path starts from rest or comes to rest, within 0.3 s.
//! 4. Between keys the path is a [`HandPath`]: position, velocity and acceleration are continuous.
//!
//! The motion is placed so that it begins at the scene's start pose. Positions are shifted and
//! scaled, and the orientation of the grip is rotated. The world's axes stay the same.

use glam::{DQuat, DVec3, DVec4};
use palpus::algebra::{Pose, quantile};

use super::{HandPath, Key};

/// How a recorded hand motion is placed in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Start pose.
    pub start: Pose,
    /// Factor for the positions.
    pub scale: f64,
    /// Factor for the speed.
    pub speed: f64,
}

impl Placement {
    /// Returns the placement without scaling that begins at `start`.
    pub fn at(start: Pose) -> Self {
        Self { start, scale: 1.0, speed: 1.0 }
    }
}

/// Reason why samples do not give a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordedPathError {
    /// There are fewer than two samples.
    #[error("the path of a hand needs at least two samples")]
    TooFew,
    /// Times do not increase, or a pose or a time is not finite.
    #[error("the times of the samples must increase, and all numbers must be finite")]
    Samples,
    /// A value of the placement is not allowed.
    #[error("scale and speed of a recorded hand must be from 0.001 to 1000")]
    Placement,
    /// The path would need too many keys (gigabytes of memory), or its times are too large to
    /// resolve 10 ms.
    #[error("the recording is too long; cut it into parts")]
    TooLong,
}

/// Time between two keys where samples are dense, s.
const KEY: f64 = 0.01;
/// Half the width of the averaging window, s.
const WIDTH: f64 = 0.015;
/// Number of points on each side of the window. They are 2.5 ms apart, like typical samples.
const POINTS: i32 = 5;
/// Samples are dense if the median of their time steps is at most this, s.
const DENSE: f64 = 0.02;
/// An interval is a gap if it is longer than this time (s) and longer than [`GAP_MEDIANS`] median
/// steps. In shorter intervals the path is a straight line.
const GAP: f64 = 1.0;
/// See [`GAP`].
const GAP_MEDIANS: f64 = 8.0;
/// Time in which the hand comes to rest before a gap, and starts after it, s; at most a third of
/// the gap.
const STOP: f64 = 0.3;
/// If a sample follows another sample within this time (s), both count as one sample.
const SAME: f64 = 1e-4;
/// Largest value of scale and speed. The smallest is its inverse.
const FACTOR: f64 = 1e3;
/// Latest time of a key, s (thirty years). Beyond it, two keys could get the same time.
const LATEST: f64 = 1e9;
/// Maximum number of keys of a path: five hours.
const MOST_KEYS: usize = 2_000_000;

impl HandPath {
    /// Returns the path of a recorded hand. `samples` has times (s, increasing) and poses.
    ///
    /// # Errors
    /// Fails if there are too few or too many samples, if times do not increase, or if a number is
    /// not finite.
    pub fn recorded(samples: &[(f64, Pose)], placement: &Placement) -> Result<Self, RecordedPathError> {
        let samples = placed(samples, placement)?;
        let mut gaps: Vec<f64> = samples.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
        let median = quantile(&mut gaps, 0.5).unwrap_or(0.0);
        let longest = GAP.max(GAP_MEDIANS * median);
        let mut keys: Vec<Key> = Vec::new();
        for stretch in samples.chunk_by(|a, b| b.time - a.time <= longest) {
            let begin = keys.len();
            if median <= DENSE {
                averaged(stretch, &mut keys)?;
            } else {
                keys.extend(stretch.iter().map(|sample| Key::through(sample.time, sample.pose())));
            }
            joined(&mut keys, begin);
        }
        if keys.len() > MOST_KEYS {
            return Err(RecordedPathError::TooLong);
        }
        at_rest(&mut keys);
        Ok(Self::through(&keys))
    }
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    time: f64,
    translation: DVec3,
    /// Unit quaternion, with the sign that is nearer to the previous sample's quaternion.
    rotation: DVec4,
}

impl Sample {
    fn pose(&self) -> Pose {
        Pose { rotation: DQuat::from_vec4(self.rotation).normalize(), translation: self.translation }
    }
}

fn placed(samples: &[(f64, Pose)], placement: &Placement) -> Result<Vec<Sample>, RecordedPathError> {
    let Placement { start, scale, speed } = placement;
    let is_size = |x: f64| (1.0 / FACTOR..=FACTOR).contains(&x);
    if !(is_size(*scale) && is_size(*speed) && start.is_valid()) {
        return Err(RecordedPathError::Placement);
    }
    let [(begun, first), _, ..] = samples else { return Err(RecordedPathError::TooFew) };
    let turn = first.rotation.conjugate() * start.rotation;
    let mut placed: Vec<Sample> = Vec::with_capacity(samples.len());
    for (time, pose) in samples {
        let sample = Sample {
            time: (time - begun) / speed,
            translation: start.translation + (pose.translation - first.translation) * *scale,
            rotation: (pose.rotation * turn).into(),
        };
        let last = placed.last();
        let later = last.is_none_or(|last| sample.time > last.time);
        if !(later && pose.is_valid() && sample.time.is_finite() && sample.translation.is_finite()) {
            return Err(RecordedPathError::Samples);
        }
        if sample.time > LATEST {
            return Err(RecordedPathError::TooLong);
        }
        if last.is_some_and(|last| sample.time < last.time + SAME) {
            continue;
        }
        let flip = last.is_some_and(|last| last.rotation.dot(sample.rotation) < 0.0);
        placed.push(Sample { rotation: if flip { -sample.rotation } else { sample.rotation }, ..sample });
    }
    if placed.len() < 2 { Err(RecordedPathError::TooFew) } else { Ok(placed) }
}

/// Adds a key every [`KEY`] seconds over dense samples, from the first to the last. Each key is a
/// weighted mean of the lines between samples.
fn averaged(stretch: &[Sample], keys: &mut Vec<Key>) -> Result<(), RecordedPathError> {
    let [first, .., last] = stretch else {
        keys.extend(stretch.iter().map(|sample| Key::through(sample.time, sample.pose())));
        return Ok(());
    };
    let span = last.time - first.time;
    if keys.len() as f64 + span / KEY > MOST_KEYS as f64 {
        return Err(RecordedPathError::TooLong);
    }
    let count = (span / KEY).floor().max(1.0) as usize;
    let mut from = 0;
    keys.push(Key::through(first.time, first.pose()));
    for k in 1..count {
        let time = first.time + span * k as f64 / count as f64;
        while from + 2 < stretch.len() && stretch[from + 1].time < time - WIDTH {
            from += 1;
        }
        let (mut at, mut weight, mut sum) = (from, 0.0, (DVec3::ZERO, DVec4::ZERO));
        for point in -POINTS..=POINTS {
            let part = f64::from(point) / f64::from(POINTS + 1);
            let share = 1.0 - part.abs();
            let then = (time + part * WIDTH).clamp(first.time, last.time);
            while at + 2 < stretch.len() && stretch[at + 1].time < then {
                at += 1;
            }
            let (translation, rotation) = between(&stretch[at], &stretch[at + 1], then);
            weight += share;
            sum = (sum.0 + translation * share, sum.1 + rotation * share);
        }
        keys.push(Key::through(time, Sample { time, translation: sum.0 / weight, rotation: sum.1 / weight }.pose()));
    }
    keys.push(Key::through(last.time, last.pose()));
    Ok(())
}

/// Returns the point on the line from one sample to the next.
fn between(a: &Sample, b: &Sample, time: f64) -> (DVec3, DVec4) {
    let part = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0);
    (a.translation.lerp(b.translation, part), a.rotation.lerp(b.rotation, part))
}

/// Adds the keys for a gap: from rest before the gap to rest after it. `begin` is the first key
/// after the gap.
fn joined(keys: &mut Vec<Key>, begin: usize) {
    if begin == 0 || begin >= keys.len() {
        return;
    }
    let (before, after) = (keys[begin - 1], keys[begin]);
    let stop = STOP.min((after.time - before.time) / 3.0);
    // A constant deceleration covers half of the distance.
    let ended = moved(&before, begin.checked_sub(2).map(|k| &keys[k]), stop);
    let begun = moved(&after, keys.get(begin + 1), -stop);
    keys.splice(begin..begin, [ended, begun]);
}

/// Returns the resting key that a constant deceleration reaches `after` seconds from `key`. The
/// velocity at `key` is the mean velocity between `key` and `other`.
fn moved(key: &Key, other: Option<&Key>, after: f64) -> Key {
    let mut pose = key.pose;
    if let Some(other) = other {
        let velocity = (key.pose.translation - other.pose.translation) / (key.time - other.time);
        pose.translation += velocity * (after / 2.0);
    }
    Key::rest(key.time + after, pose)
}

/// Makes the path start at rest at the first key and end at rest at the last key. Removes the keys
/// near both ends, so that the hand starts with one smooth motion and stops with one. Shifts the
/// times to begin at 0.
fn at_rest(keys: &mut Vec<Key>) {
    let (Some(first), Some(last)) = (keys.first().copied(), keys.last().copied()) else { return };
    let near = STOP.min((last.time - first.time) / 4.0);
    let is_end = |key: &Key| key.time <= first.time || key.time >= last.time;
    keys.retain(|key| is_end(key) || (key.time >= first.time + near && key.time <= last.time - near));
    for key in keys.iter_mut() {
        key.rest |= is_end(key);
        key.time -= first.time;
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use palpus::algebra::{Random, rotation_between};

    use super::*;

    const SEED: u64 = 0x4a4e;

    /// Returns a hand motion in the shape of an 8, sampled at uneven times and rounded as recorders
    /// do.
    fn drawn(rate_hz: f64, seconds: f64, gap: Option<[f64; 2]>) -> Vec<(f64, Pose)> {
        let mut random = Random::new(SEED);
        let mut samples = Vec::new();
        for k in 0..(seconds * rate_hz) as u32 {
            let time = (f64::from(k) + 0.8 * random.unit()) / rate_hz;
            if gap.is_some_and(|[begin, end]| (begin..end).contains(&time)) {
                continue;
            }
            let pose = eight(time);
            let rounded = (pose.translation * 1e4).round() / 1e4;
            samples.push((time, Pose { translation: rounded, ..pose }));
        }
        samples
    }

    fn eight(time: f64) -> Pose {
        let (a, b) = ((TAU * 0.7 * time).sin(), (TAU * 1.4 * time).sin());
        Pose::new(DQuat::from_scaled_axis(DVec3::new(a, 0.3 * b, 0.0)), DVec3::new(0.1 * a, 0.05 * b, 1.0))
    }

    /// Returns the largest change of velocity and of angular velocity in a millisecond.
    fn steps(path: &HandPath) -> [f64; 2] {
        let mut largest = [0f64; 2];
        let mut last = path.twist(0.0);
        for k in 1..(path.duration() * 1e3) as u32 {
            let twist = path.twist(f64::from(k) * 1e-3);
            largest[0] = largest[0].max(twist.linear.distance(last.linear));
            largest[1] = largest[1].max(twist.angular.distance(last.angular));
            last = twist;
        }
        largest
    }

    #[test]
    fn irregular_recording_gives_the_true_motion() {
        for rate in [300.0, 500.0, 1000.0, 30.0] {
            let samples = drawn(rate, 4.0, None);
            let first = samples[0];
            let path = HandPath::recorded(&samples, &Placement::at(first.1)).expect("a path");
            let [linear, angular] = steps(&path);
            assert!(linear < 0.03 && angular < 0.3, "{rate} Hz: {linear} m/s, {angular} rad/s, seed {SEED}");
            for k in 0..310 {
                let time = 0.4 + f64::from(k) * 0.01;
                let (now, then) = (path.pose(time - first.0), eight(time));
                let far = now.translation.distance(then.translation);
                assert!(far < 0.7e-3, "{rate} Hz at {time} s: {far} m, seed {SEED}");
                let turned = rotation_between(now.rotation, then.rotation).length();
                assert!(turned < 0.02, "{rate} Hz at {time} s: {turned} rad");
            }
        }
    }

    #[test]
    fn hand_rests_in_a_gap_and_continues() {
        let samples = drawn(300.0, 20.0, Some([6.3, 17.1]));
        let path = HandPath::recorded(&samples, &Placement::at(samples[0].1)).expect("a path");
        let [linear, angular] = steps(&path);
        assert!(linear < 0.03 && angular < 0.3, "{linear} m/s, {angular} rad/s, seed {SEED}");
        // The path never leaves the range of the hand, and ends where the hand ended.
        for k in 0..2000 {
            let pose = path.pose(f64::from(k) * 0.01);
            assert!(pose.translation.distance(DVec3::Z) < 0.25, "{}", pose.translation);
        }
        let far = path.pose(19.0 - samples[0].0).translation.distance(eight(19.0).translation);
        assert!(far < 1e-3, "{far}, seed {SEED}");
    }

    #[test]
    fn placement_shifts_scales_and_speeds_up() {
        let samples = drawn(500.0, 4.0, None);
        let start = Pose::new(DQuat::from_rotation_x(1.0), DVec3::new(0.0, 0.0, 0.1));
        let placement = Placement { start, scale: 0.1, speed: 2.0 };
        let path = HandPath::recorded(&samples, &placement).expect("a path");
        assert!(path.pose(0.0).translation.distance(start.translation) < 1e-3);
        assert!(rotation_between(path.pose(0.0).rotation, start.rotation).length() < 0.02);
        assert!((path.duration() - 2.0).abs() < 0.01, "{}", path.duration());
        for k in 0..200 {
            assert!(path.pose(f64::from(k) * 0.01).translation.distance(start.translation) < 0.03);
        }
    }

    #[test]
    fn invalid_recordings_give_errors() {
        let pose = Pose::IDENTITY;
        let at = Placement::at(pose);
        let error = |samples: &[(f64, Pose)], at: &Placement| HandPath::recorded(samples, at).expect_err("an error");
        assert_eq!(error(&[(0.0, pose)], &at), RecordedPathError::TooFew);
        assert_eq!(error(&[(0.0, pose), (0.0, pose)], &at), RecordedPathError::Samples);
        assert_eq!(error(&[(0.0, pose), (f64::NAN, pose)], &at), RecordedPathError::Samples);
        let two = [(0.0, pose), (1.0, pose)];
        for scale in [0.0, -1.0, 1e-4, f64::NAN, f64::INFINITY] {
            assert_eq!(error(&two, &Placement { scale, ..at }), RecordedPathError::Placement);
        }
        assert!(HandPath::recorded(&two, &at).is_ok());
        assert_eq!(error(&[(0.0, pose), (1e-9, pose)], &at), RecordedPathError::TooFew);
        // The samples are a millisecond apart, except for the last sample, which is years later.
        let far = [(0.0, pose), (1e-3, pose), (2e-3, pose), (1e9, pose)];
        assert!(HandPath::recorded(&far, &at).is_ok());
    }

    /// A case from fuzzing: keys had equal times, and the path's constructor panics in that case.
    #[test]
    fn very_late_samples_give_an_error() {
        let pose = |x: f64| Pose::from_translation(DVec3::new(x, 0.0, 0.0));
        let mut samples: Vec<(f64, Pose)> = (0..20).map(|k| (f64::from(k) * 1e-5, pose(f64::from(k)))).collect();
        samples.extend([(1e12, pose(0.0)), (1e12_f64.next_up(), pose(1.0))]);
        let slow = Placement { speed: 1e-3, ..Placement::at(Pose::IDENTITY) };
        assert_eq!(HandPath::recorded(&samples, &slow).err(), Some(RecordedPathError::TooLong));
    }

    /// A case from fuzzing: each part may be as long as a whole path. The total length was checked
    /// only after the memory had been allocated.
    #[test]
    fn long_recordings_fail_before_using_much_memory() {
        let mut samples = Vec::new();
        for stretch in 0..3 {
            for k in 0..8_000 {
                let time = f64::from(stretch) * 1e6 + f64::from(k);
                // The samples come in groups, so half of the time steps are short and the samples
                // count as dense.
                samples.extend([time, time + 1e-3, time + 2e-3].map(|time| (time, Pose::IDENTITY)));
            }
        }
        assert_eq!(
            HandPath::recorded(&samples, &Placement::at(Pose::IDENTITY)).err(),
            Some(RecordedPathError::TooLong)
        );
    }
}
