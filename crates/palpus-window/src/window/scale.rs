//! Lengths of arrows. They are scaled to the recent forces, so that a light touch on a strong
//! device is visible.

/// Time in which the recent largest force decays by a factor of e, s.
const MEMORY: f64 = 6.0;
/// Share of the device's limit below which forces never get an arrow of full length.
const LEAST: f64 = 0.02;

/// The largest recent value.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scale {
    peak: f64,
    time: f64,
}

impl Scale {
    /// Takes the `value` at `time` (s). Returns the value that is drawn with the longest arrow, on
    /// a device with this `limit`.
    pub(super) fn follow(&mut self, value: f64, time: f64, limit: f64) -> f64 {
        let passed = (time - self.time).max(0.0);
        self.time = time;
        let least = if limit.is_finite() { LEAST * limit } else { 0.0 };
        self.peak = value.max(self.peak * (-passed / MEMORY).exp()).max(least).max(f64::MIN_POSITIVE);
        self.peak
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrow_scale_follows_recent_forces() {
        let mut scale = Scale::default();
        assert_eq!(scale.follow(0.0, 0.0, 10.0), 0.2, "noise must not be magnified");
        assert_eq!(scale.follow(3.0, 1.0, 10.0), 3.0);
        let after = scale.follow(0.5, 2.0, 10.0);
        assert!(after > 2.0 && after < 3.0, "{after}");
        assert_eq!(scale.follow(0.5, 60.0, 10.0), 0.5);
    }
}
