//! Physiological tremor of a hand: a sum of sines between 8 and 12 Hz.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::algebra::Random;

const SINES: usize = 4;
const LOWEST_HZ: f64 = 8.0;
const HIGHEST_HZ: f64 = 12.0;

/// A tremor of the intended position. The same seed gives the same tremor. Along each axis, the
/// displacement never exceeds the amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tremor {
    /// Amplitude of each sine, m.
    share: f64,
    /// For each axis: (angular frequency in rad/s, phase in rad).
    sines: [[(f64, f64); SINES]; 3],
}

impl Tremor {
    /// Returns a tremor of at most `amplitude` (m) along each axis. A healthy hand has 0.05 to 0.1
    /// mm.
    pub fn new(amplitude: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let sines = std::array::from_fn(|_| {
            std::array::from_fn(|_| {
                let hertz = random.between(LOWEST_HZ, HIGHEST_HZ);
                (TAU * hertz, TAU * random.unit())
            })
        });
        Self { share: amplitude / SINES as f64, sines }
    }

    /// Returns the displacement by the tremor at `time` (s), m.
    pub fn displacement(&self, time: f64) -> DVec3 {
        DVec3::from_array(self.sines.map(|axis| axis.iter().map(|&(w, p)| (w * time + p).sin()).sum::<f64>()))
            * self.share
    }

    /// Returns the velocity of the tremor at `time` (s), m/s.
    pub fn velocity(&self, time: f64) -> DVec3 {
        DVec3::from_array(self.sines.map(|axis| axis.iter().map(|&(w, p)| w * (w * time + p).cos()).sum::<f64>()))
            * self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tremor_stays_small_and_is_reproducible() {
        let (tremor, same, other) = (Tremor::new(1e-4, 3), Tremor::new(1e-4, 3), Tremor::new(1e-4, 4));
        let mut largest: f64 = 0.0;
        for k in 0..2000 {
            let t = f64::from(k) * 1e-3;
            largest = largest.max(tremor.displacement(t).abs().max_element());
            assert_eq!(tremor.displacement(t), same.displacement(t));
        }
        assert!(largest <= 1e-4 && largest > 4e-5, "{largest:e}");
        assert!(tremor.displacement(0.5) != other.displacement(0.5));
    }
}
