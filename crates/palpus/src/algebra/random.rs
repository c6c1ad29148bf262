//! A random number generator that gives the same numbers on every machine and in every run.
//!
//! The generator is SplitMix64 of the crate `rand_xoshiro`, a fixed algorithm (Steele, Lea, Flood
//! 2014). The distributions are implemented here, because the distributions of the crate `rand` may
//! change between its versions. The decomposition of models into pieces depends on these numbers.

use glam::DVec3;
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A seeded random number generator. Do not use it for cryptography.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Random(SplitMix64);

impl Random {
    /// Creates the generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a number below `n`, which must not be 0. The relative error of each number's
    /// probability is at most `n`/2⁶⁴.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Returns a number with uniform distribution in \[0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number with uniform distribution in \[−1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Returns a number with uniform distribution in \[low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a vector with uniform distribution in the cube \[−1, 1)³.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// Returns a unit vector with uniform distribution on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.vector();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// Puts the items in a random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for k in (1..items.len()).rev() {
            items.swap(k, self.below(k + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected values are the first numbers that the authors' C program prints for this seed.
    /// The pieces of models and the scenes depend on these numbers.
    #[test]
    fn numbers_of_a_seed_stay_the_same() {
        let mut random = Random::new(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([(); 3].map(|()| random.bits()), expected);
        assert_eq!(Random::new(7).unit(), 0.389_829_748_391_271_5);
    }
}
