//! Thermal limit between peak and continuous rating (I²t).
//!
//! Motors can hold their peak for seconds and their continuous rating without limit. The heat is
//! proportional to the square of the current, and the current is proportional to the force. The
//! temperature of a winding follows this square like a first-order low-pass with the thermal time
//! constant τ:
//!
//! h' = (F² − h) / τ, where h must stay at or below F_continuous².
//!
//! Up to ¾ of that value the peak is allowed. Above that level the cap falls to F_continuous,
//! so that the limit is approached smoothly and h cannot exceed it. Force and torque have separate
//! limits, since it is not known which motors produce the force and which the torque.

/// Fraction of the allowed heat up to which the full peak is allowed.
const FREE_SHARE: f64 = 0.75;

/// Thermal state of the force or of the torque.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    peak: f64,
    continuous: f64,
    /// Thermal time constant, s.
    time: f64,
    heat: f64,
}

impl Heat {
    /// Starts cold. `time` is the thermal time constant of the windings, s. `peak` and `continuous`
    /// are the peak and the continuous force (N) or torque (N·m).
    pub(super) fn new(peak: f64, continuous: f64, time: f64) -> Self {
        Self { peak, continuous: continuous.min(peak), time, heat: 0.0 }
    }

    /// Returns the largest force or torque allowed now; infinite while there is no thermal limit.
    pub(super) fn cap(&self) -> f64 {
        let allowed = self.continuous * self.continuous;
        if self.heat <= FREE_SHARE * allowed {
            return f64::INFINITY;
        }
        let left = ((allowed - self.heat) / ((1.0 - FREE_SHARE) * allowed)).clamp(0.0, 1.0);
        (allowed + (self.peak * self.peak - allowed) * left).sqrt()
    }

    /// Adds the heat of `size` (N or N·m), held for `elapsed` seconds.
    pub(super) fn spend(&mut self, size: f64, elapsed: f64) {
        self.heat += (size * size - self.heat) * (1.0 - (-elapsed / self.time).exp());
    }

    /// Returns the fraction of the allowed heat that is used.
    pub(super) fn used(&self) -> f64 {
        let allowed = self.continuous * self.continuous;
        if allowed > 0.0 { self.heat / allowed } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_is_limited_in_time_and_continuous_force_is_not() {
        let mut heat = Heat::new(8.5, 1.4, 30.0);
        let (mut at_peak, mut last) = (0.0, 8.5);
        for _ in 0..120_000 {
            let force = heat.cap().min(8.5);
            at_peak += if force >= 8.5 { 1e-3 } else { 0.0 };
            assert!((last - force).abs() < 0.2, "the cap must change smoothly, not from {last} to {force}");
            heat.spend(force, 1e-3);
            assert!(heat.used() <= 1.0);
            last = force;
        }
        assert!((0.5..0.7).contains(&at_peak), "{at_peak} s at 8.5 N");
        assert!((last - 1.4).abs() < 0.02, "{last}");
        // A force that is never above the continuous rating is never cut.
        let mut steady = Heat::new(8.5, 1.4, 30.0);
        for _ in 0..120_000 {
            assert!(steady.cap() >= 1.2);
            steady.spend(1.2, 1e-3);
        }
        assert!(steady.cap().is_infinite(), "1.2 N uses 0.73 of the allowed heat, where the full peak is allowed");
    }

    #[test]
    fn zero_rating_gives_no_force_and_no_nan() {
        let mut heat = Heat::new(0.0, 0.0, 30.0);
        heat.spend(0.0, 1e-3);
        assert!(heat.cap().is_infinite() && heat.used() <= 0.0);
        heat.spend(1.0, 1e-3);
        assert!(heat.cap() <= 0.0);
    }
}
