//! Smooths the orientation of a grip whose sensor is slower than the loop.
//!
//! A wireless grip reports a new orientation 50 to 60 times a second, and the service repeats the
//! last orientation in between. Differences at the loop's rate would show rest, interrupted by
//! single ticks of some 50 rad/s. So:
//!
//! 1. Only an orientation that differs from the last sample is a new sample. The time of a
//!    sample is the time of its arrival.
//! 2. The angular velocity is measured between samples at least 15 ms apart. So neither repeated
//!    samples nor the noise of a fast sensor are differentiated.
//! 3. Between samples the orientation is predicted with this velocity, for at most 25 ms.
//!    After that the grip counts as being at rest.
//! 4. The returned orientation and velocity follow the prediction with a time constant of 8 ms. So
//!    a prediction error causes no jump at the next sample.

use glam::{DQuat, DVec3};
use palpus::algebra::rotation_between;

/// Shortest time between the two samples of a velocity measurement, s.
const BASELINE: f64 = 15e-3;
/// Longest time for which a velocity is used without a newer sample, s.
const HORIZON: f64 = 25e-3;
/// Time constant of the result, s.
const LAG: f64 = 8e-3;
/// Largest angular velocity, rad/s: no wrist turns faster (2000 °/s). A larger value means that the
/// sensor was reset.
const FASTEST: f64 = 35.0;
/// Difference from the prediction, rad, from which a sample is returned unsmoothed, so that the
/// gate sees the jump.
const JUMP: f64 = 1.0;

/// Filter of a grip's orientation.
#[derive(Clone, Copy, Debug)]
pub(super) struct GripFilter {
    /// The last sample, and the time of its arrival (s).
    sample: DQuat,
    sampled: f64,
    /// Sample from which the velocity is measured, and its time (s).
    anchor: DQuat,
    anchored: f64,
    /// Measured angular velocity, rad/s.
    rate: DVec3,
    /// Last result: orientation, angular velocity (rad/s) and time (s).
    out: DQuat,
    out_rate: DVec3,
    time: f64,
}

impl GripFilter {
    /// Starts at rest with the first sample.
    pub(super) fn new(rotation: DQuat, time: f64) -> Self {
        let (sample, sampled) = (rotation, time);
        Self {
            sample,
            sampled,
            anchor: rotation,
            anchored: time,
            rate: DVec3::ZERO,
            out: rotation,
            out_rate: DVec3::ZERO,
            time,
        }
    }

    /// Returns orientation and angular velocity (rad/s) at `time` (s), when the service reports
    /// `rotation`.
    pub(super) fn follow(&mut self, rotation: DQuat, time: f64) -> (DQuat, DVec3) {
        if rotation != self.sample {
            self.take(rotation, time);
        }
        let age = time - self.sampled;
        let rate = if age > HORIZON { DVec3::ZERO } else { self.rate };
        let predicted = DQuat::from_scaled_axis(rate * age.min(HORIZON)) * self.sample;
        let passed = (time - self.time).max(0.0);
        let share = 1.0 - (-passed / LAG).exp();
        let behind = rotation_between(self.out, predicted);
        if behind.length() > JUMP {
            *self = Self::new(rotation, time);
            return (self.out, self.out_rate);
        }
        self.out = (DQuat::from_scaled_axis(behind * share) * self.out).normalize();
        self.out_rate += (rate - self.out_rate) * share;
        self.time = time;
        (self.out, self.out_rate)
    }

    fn take(&mut self, rotation: DQuat, time: f64) {
        let since = time - self.anchored;
        if since >= BASELINE {
            // A rest between two samples must not reduce the velocity.
            let turned = rotation_between(self.anchor, rotation) / since.min(BASELINE + HORIZON);
            self.rate = turned.clamp_length_max(FASTEST);
            (self.anchor, self.anchored) = (rotation, time);
        }
        (self.sample, self.sampled) = (rotation, time);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1e-3;

    /// Returns the largest errors of angle (rad) and angular velocity (rad/s), and the largest step
    /// (rad), over the last half second. The grip turns at `turn` rad/s, and its sensor has
    /// `sensor` Hz.
    fn worst(turn: f64, sensor: f64) -> (f64, f64, f64) {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let truth = |time: f64| DQuat::from_scaled_axis(axis * (turn * time));
        let mut filter = GripFilter::new(truth(0.0), 0.0);
        let (mut angle, mut rate, mut step) = (0.0f64, 0.0f64, 0.0f64);
        let mut last = truth(0.0);
        for tick in 1..1000 {
            let time = f64::from(tick) * PERIOD;
            let held = (time * sensor).floor() / sensor;
            let (q, w) = filter.follow(truth(held), time);
            if tick > 500 {
                angle = angle.max(rotation_between(q, truth(time)).length());
                rate = rate.max((w - axis * turn).length());
                step = step.max(rotation_between(last, q).length());
            }
            last = q;
        }
        (angle, rate, step)
    }

    #[test]
    fn slow_sensor_gives_smooth_rotation() {
        for sensor in [50.0, 60.0, 120.0, 1000.0] {
            let (angle, rate, step) = worst(2.0, sensor);
            // At 2 rad/s the grip turns by 2 mrad in a tick, and by 40 mrad between two samples at
            // 50 Hz. The remaining error is the lag of the filter.
            assert!(angle < 0.025 && rate < 0.3 && step < 0.005, "{sensor} Hz: {angle} rad, {rate} rad/s, {step} rad");
        }
    }

    #[test]
    fn filter_comes_to_rest_with_the_grip() {
        let mut filter = GripFilter::new(DQuat::IDENTITY, 0.0);
        let end = DQuat::from_rotation_z(0.3);
        let mut last = (DQuat::IDENTITY, DVec3::ZERO);
        for tick in 1..400 {
            let time = f64::from(tick) * PERIOD;
            let angle = (0.02 * (time / 0.02).floor() * 3.0).min(0.3);
            last = filter.follow(DQuat::from_rotation_z(angle), time);
        }
        assert!(rotation_between(last.0, end).length() < 1e-9 && last.1.length() < 1e-9, "{last:?}");
    }

    #[test]
    fn jump_is_not_smoothed() {
        let mut filter = GripFilter::new(DQuat::IDENTITY, 0.0);
        let away = DQuat::from_rotation_y(2.0);
        assert_eq!(filter.follow(away, PERIOD), (away, DVec3::ZERO));
    }

    #[test]
    fn noise_of_a_fast_sensor_is_not_differentiated() {
        let mut filter = GripFilter::new(DQuat::IDENTITY, 0.0);
        let mut worst = 0.0f64;
        for tick in 1..1000 {
            let noise = if tick % 2 == 0 { 1e-3 } else { -1e-3 };
            worst = worst.max(filter.follow(DQuat::from_rotation_x(noise), f64::from(tick) * PERIOD).1.length());
        }
        // Differences at the loop's rate would be 2 rad/s.
        assert!(worst < 0.15, "{worst} rad/s");
    }
}
