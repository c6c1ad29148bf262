//! The budget between peak and continuous: I²t.
//!
//! Motors bear their peak for seconds and their continuous rating without limit. They are heated by
//! the square of the current, which is in proportion to the force. The temperature of a winding
//! follows that square like a first-order low-pass with the thermal time constant τ:
//!
//! h' = (F² − h) / τ,  and h must stay at most F_continuous².
//!
//! Up to ¾ of that the peak is free. From there to the whole the cap sinks to F_continuous, so that
//! it is reached gently and h cannot get beyond. Force and torque have a budget each: which motors
//! bear them is the device's affair.

/// Share of the allowed heat up to which the peak is free.
const FREE_SHARE: f64 = 0.75;

#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    peak: f64,
    continuous: f64,
    /// s.
    time: f64,
    heat: f64,
}

impl Heat {
    /// In windings with the time constant `time`, s.
    pub(super) fn new(peak: f64, continuous: f64, time: f64) -> Self {
        Self { peak, continuous: continuous.min(peak), time, heat: 0.0 }
    }

    /// The most there may be now; infinite while the budget does not bind.
    pub(super) fn cap(&self) -> f64 {
        let allowed = self.continuous * self.continuous;
        if self.heat <= FREE_SHARE * allowed {
            return f64::INFINITY;
        }
        let left = ((allowed - self.heat) / ((1.0 - FREE_SHARE) * allowed)).clamp(0.0, 1.0);
        (allowed + (self.peak * self.peak - allowed) * left).sqrt()
    }

    /// `size` was held for `elapsed` seconds.
    pub(super) fn spend(&mut self, size: f64, elapsed: f64) {
        self.heat += (size * size - self.heat) * (1.0 - (-elapsed / self.time).exp());
    }

    /// Share of the allowed heat that is used.
    pub(super) fn used(&self) -> f64 {
        let allowed = self.continuous * self.continuous;
        if allowed > 0.0 { self.heat / allowed } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_had_for_a_while_and_the_continuous_force_for_ever() {
        let mut heat = Heat::new(8.5, 1.4, 30.0);
        let (mut at_peak, mut last) = (0.0, 8.5);
        for _ in 0..120_000 {
            let force = heat.cap().min(8.5);
            at_peak += if force >= 8.5 { 1e-3 } else { 0.0 };
            assert!((last - force).abs() < 0.2, "the cap moves gently: {last} to {force}");
            heat.spend(force, 1e-3);
            assert!(heat.used() <= 1.0);
            last = force;
        }
        assert!((0.5..0.7).contains(&at_peak), "{at_peak} s at 8.5 N");
        assert!((last - 1.4).abs() < 0.02, "{last}");
        // A force that is never above the rating is never cut.
        let mut steady = Heat::new(8.5, 1.4, 30.0);
        for _ in 0..120_000 {
            assert!(steady.cap() >= 1.2);
            steady.spend(1.2, 1e-3);
        }
        assert!(steady.cap().is_infinite(), "0.73 of the allowed heat is free");
    }

    #[test]
    fn no_rating_means_no_force_and_no_division_by_it() {
        let mut heat = Heat::new(0.0, 0.0, 30.0);
        heat.spend(0.0, 1e-3);
        assert!(heat.cap().is_infinite() && heat.used() <= 0.0);
        heat.spend(1.0, 1e-3);
        assert!(heat.cap() <= 0.0);
    }
}
