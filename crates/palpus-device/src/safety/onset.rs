//! The onset of the wrench after forces are enabled. The wrench grows without giving the hand
//! energy.
//!
//! If the whole wrench were multiplied by a rising gain, it would return more energy than it took:
//! the hand presses while the gain is small, and is pushed back when the gain is larger. So the
//! gain multiplies only changes of the wrench. Let w be the size of the computed wrench, and F the
//! size of the wrench that is output:
//!
//! 1. *Size*: w² is twice the energy of a spring that gives the wrench. The spring has the device's
//!    typical travel and rotation at its peak, like the virtual coupling. Force and torque have one
//!    common size, because energy that the hand gives by pushing may return by turning.
//! 2. *Growth*: F changes by the gain times the change of w, and is never negative.
//! 3. *Release*: the missing part, w − F, is at most w. So nothing is missing when the contact
//!    ends. If the gain is 1 by then, the whole wrench is output from then on.
//!
//! Because the gain only rises, F falls at least as fast as it rose. So in any cycle of w the hand
//! gets no more energy than it gave. If a contact is pressed during the whole ramp, its force stays
//! too small by a constant amount until the hand releases it.

use palpus::algebra::Wrench;

use super::SafetyLimits;
use super::energy::{CREDIT_TRAVEL, CREDIT_TURN};

/// A missing part below this share of the peak's size is not felt as a step (10 µN). Rounding is
/// far smaller.
const NEGLIGIBLE: f64 = 1e-6;

/// See the module's outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onset {
    /// J/N² and J/(N·m)²: twice the energy of a spring that gives a force or torque of 1.
    compliance: [f64; 2],
    /// A missing part below this size counts as zero, √J.
    negligible: f64,
    /// The size of the last computed wrench, √J.
    size: f64,
    /// The missing part of that size, √J.
    missing: f64,
}

impl Onset {
    /// The state before the first wrench.
    pub(super) fn new(limits: &SafetyLimits) -> Self {
        let compliance = |stretch: f64, peak: f64| if peak > 0.0 { 0.5 * stretch / peak } else { 0.0 };
        let [force, torque] =
            [compliance(CREDIT_TRAVEL, limits.force_peak), compliance(CREDIT_TURN, limits.torque_peak)];
        let negligible = NEGLIGIBLE * (force * limits.force_peak.powi(2)).sqrt();
        Self { compliance: [force, torque], negligible, size: 0.0, missing: 0.0 }
    }

    /// Begins an onset at `wrench`, all of which is missing from the output.
    pub(super) fn begin(&mut self, wrench: &Wrench) {
        self.size = self.size_of(wrench);
        self.missing = self.size;
    }

    /// Returns the part of `wrench` to output; the whole wrench once nothing is missing.
    pub(super) fn apply(&mut self, wrench: &Wrench, gain: f64) -> Wrench {
        let size = self.size_of(wrench);
        self.missing = (self.missing + (1.0 - gain) * (size - self.size)).clamp(0.0, size);
        self.size = size;
        if self.missing <= self.negligible {
            self.missing = 0.0;
            return *wrench;
        }
        let share = (size - self.missing) / size;
        Wrench { torque: wrench.torque * share, force: wrench.force * share }
    }

    fn size_of(&self, wrench: &Wrench) -> f64 {
        let [force, torque] = self.compliance;
        (force * wrench.force.length_squared() + torque * wrench.torque.length_squared()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use palpus::algebra::{Random, Wrench};

    use super::Onset;
    use crate::known_devices;
    use crate::safety::SafetyLimits;

    const SEED: u64 = 0x0A5E_0F01;

    fn limits() -> SafetyLimits {
        let [premium, ..] = known_devices();
        SafetyLimits::of(&premium, 1000.0)
    }

    fn push(newtons: f64) -> Wrench {
        Wrench { torque: DVec3::ZERO, force: DVec3::X * newtons }
    }

    #[test]
    fn a_rising_gain_gives_no_energy() {
        // A spring that pushes and turns, pressed to and fro at random while the gain rises.
        let mut random = Random::new(SEED);
        let limits = limits();
        let [stiffness, turning] = [limits.force_peak / 8e-3, limits.torque_peak / 0.2];
        for case in 0..100 {
            let mut onset = Onset::new(&limits);
            onset.begin(&Wrench::ZERO);
            let (mut given, mut place, mut goal) = (0.0, [0.0; 2], [0.0; 2]);
            for k in 0..20_000 {
                if k % 500 == 0 {
                    goal = [random.between(0.0, 6e-3), random.between(0.0, 0.15)];
                }
                let next = [0, 1].map(|j| place[j] + 0.01 * (goal[j] - place[j]));
                let middle = [0, 1].map(|j| 0.5 * (place[j] + next[j]));
                let computed =
                    Wrench { force: DVec3::X * (stiffness * middle[0]), torque: DVec3::Z * (turning * middle[1]) };
                let wrench = onset.apply(&computed, (f64::from(k) / 10_000.0).min(1.0));
                given -= wrench.force.x * (next[0] - place[0]) + wrench.torque.z * (next[1] - place[1]);
                place = next;
                // The sum is exact up to the steps of the motion.
                assert!(given < 1e-6, "{given} J in step {k} of case {case}, seed {SEED:#x}");
            }
        }
    }

    #[test]
    fn what_is_pressed_through_the_ramp_is_given_after_it_was_let_go() {
        let mut onset = Onset::new(&limits());
        onset.begin(&push(0.5));
        for k in 0..=100 {
            assert_eq!(onset.apply(&push(0.5), f64::from(k) / 100.0), Wrench::ZERO);
        }
        assert!((onset.apply(&push(2.5), 1.0).force.x - 2.0).abs() < 1e-12);
        assert!((onset.apply(&push(1.5), 1.0).force.x - 1.0).abs() < 1e-12);
        assert_eq!(onset.apply(&push(0.3), 1.0), Wrench::ZERO);
        assert!((onset.apply(&push(1.0), 1.0).force.x - 0.7).abs() < 1e-12);
        onset.apply(&Wrench::ZERO, 1.0);
        assert_eq!(onset.apply(&push(1.0), 1.0), push(1.0), "to the bit");
    }
}
