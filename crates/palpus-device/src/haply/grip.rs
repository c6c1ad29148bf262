//! The orientation of a grip whose sensor is slower than the loop.
//!
//! A grip without a wire brings a new orientation 50 to 60 times a second, and the service repeats
//! the last one in between. Differenced at the loop's rate that is rest, interrupted by one tick of
//! fifty rad/s. So:
//!
//! 1. Only orientations that differ from the last are samples; each is dated when it arrives.
//! 2. The rate of turn is that between samples at least 15 ms apart, so that neither the repeats
//!    nor the noise of a fast sensor is differentiated.
//! 3. Between samples the orientation is predicted by that rate, for no longer than 25 ms: then the
//!    grip is taken to be at rest.
//! 4. What comes out follows the prediction with a lag of 8 ms, rate likewise, so that a sample
//!    that the prediction missed is no jump.

use glam::{DQuat, DVec3};
use palpus::algebra::rotation_between;

/// s between the samples whose difference is the rate.
const BASELINE: f64 = 15e-3;
/// s for which a rate is used without a newer sample.
const HORIZON: f64 = 25e-3;
/// s: time constant of what comes out.
const LAG: f64 = 8e-3;
/// rad/s: no wrist turns faster (2000 °/s); a faster reading means that the sensor was reset.
const FASTEST: f64 = 35.0;
/// rad: a sample this far from the prediction is taken as it is, for the gate to judge: smoothing
/// would hide a jump.
const JUMP: f64 = 1.0;

/// Makes an even orientation out of an uneven one.
#[derive(Clone, Copy, Debug)]
pub(super) struct GripFilter {
    /// The last sample, and when it came.
    sample: DQuat,
    sampled: f64,
    /// Time from which the rate is measured.
    anchor: DQuat,
    anchored: f64,
    /// rad/s.
    rate: DVec3,
    /// Last result and its time.
    out: DQuat,
    out_rate: DVec3,
    time: f64,
}

impl GripFilter {
    /// At rest at the first sample.
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

    /// Orientation and rate of turn at `time`, when `rotation` is what the service says.
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
            // A rest between two samples is not part of the turn.
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

    /// Worst errors of angle and rate over the last half of a second at `turn` rad/s, the sensor at
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
    fn a_slow_sensor_does_not_make_it_rattle() {
        for sensor in [50.0, 60.0, 120.0, 1000.0] {
            let (angle, rate, step) = worst(2.0, sensor);
            // 2 rad/s: a tick is 2 mrad, a sample of 50 Hz 40 mrad. The rest is the lag.
            assert!(angle < 0.025 && rate < 0.3 && step < 0.005, "{sensor} Hz: {angle} rad, {rate} rad/s, {step} rad");
        }
    }

    #[test]
    fn it_comes_to_rest_with_the_grip() {
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
    fn a_jump_is_shown_and_not_smoothed_away() {
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
        // Differenced at the loop's rate it would be 2 rad/s.
        assert!(worst < 0.15, "{worst} rad/s");
    }
}
