//! An endless hand motion: it moves back and forth along a scripted path and deviates from it.
//!
//! 1. The hand moves along the path at a varying speed, and sometimes backward. If the path is not
//!    cyclic, the hand returns along it after the end. The path is at rest at its ends, so the
//!    reversal is smooth.
//! 2. Position and rotation deviate from the path, so the hand also makes and breaks contacts that
//!    the script does not have.
//! 3. Progress and deviations are sums of sines up to 2 Hz. A seed gives the frequencies and
//!    phases. The same seed gives the same motion, which does not repeat within a year.
//! 4. The tremor of the script is kept. The tremor depends on the real time, not on the time along
//!    the path.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};

use super::{HandPath, Tremor};

/// Number of sines of each coordinate.
const SINES: usize = 8;
/// Lowest frequency, Hz. A hand stays at one place for about one period of this frequency.
const LOWEST_HZ: f64 = 0.05;
/// Highest frequency, Hz. Voluntary movements of a hand rarely contain higher frequencies.
const HIGHEST_HZ: f64 = 2.0;
/// Frequency above which the amplitudes decrease, Hz. So slow sines move the hand far, and fast
/// sines move it little.
const KNEE_HZ: f64 = 0.4;
/// Largest deviation of the speed along the path, as a multiple of the path's speed. The value is
/// above 1, so the hand sometimes moves backward.
const PACE: f64 = 1.4;
/// Time in which the deviation grows, s. At first the hand is at the start of the path.
const BEGINNING: f64 = 2.0;

/// An endless hand motion around a path. See the module's description for the details.
#[derive(Clone, Debug)]
pub struct Wander {
    /// The path without its tremor.
    path: HandPath,
    tremor: Option<Tremor>,
    pace: Waves,
    shift: [Waves; 3],
    turn: [Waves; 3],
    /// Point where the hand holds and rotates the probe, m, in the probe's frame.
    grip_a: DVec3,
}

/// A sum of sines that does not exceed an amplitude.
#[derive(Clone, Copy, Debug)]
struct Waves([Wave; SINES]);

#[derive(Clone, Copy, Debug, Default)]
struct Wave {
    amplitude: f64,
    /// Angular frequency, rad/s.
    frequency: f64,
    /// Phase, rad.
    phase: f64,
}

impl Waves {
    fn new(most: f64, random: &mut Random) -> Self {
        let mut waves = [Wave::default(); SINES];
        for wave in &mut waves {
            let hertz = LOWEST_HZ * (HIGHEST_HZ / LOWEST_HZ).powf(random.unit());
            *wave =
                Wave { amplitude: 1.0 / (1.0 + hertz / KNEE_HZ), frequency: TAU * hertz, phase: TAU * random.unit() };
        }
        let sum: f64 = waves.iter().map(|wave| wave.amplitude).sum();
        waves.iter_mut().for_each(|wave| wave.amplitude *= most / sum);
        Self(waves)
    }

    fn at(&self, time: f64) -> f64 {
        self.0.iter().map(|wave| wave.amplitude * (wave.frequency * time + wave.phase).sin()).sum()
    }

    /// Returns the integral from time 0 to `time`.
    fn integral(&self, time: f64) -> f64 {
        let one = |wave: &Wave| {
            wave.amplitude / wave.frequency * (wave.phase.cos() - (wave.frequency * time + wave.phase).cos())
        };
        self.0.iter().map(one).sum()
    }
}

impl Wander {
    /// Returns a motion around `path`. It deviates by at most `shift` (m) along each axis and
    /// `turn` (rad) about each axis, and usually by a quarter of these values.
    pub fn about(path: &HandPath, shift: f64, turn: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut waves = |most| Waves::new(most, &mut random);
        Self {
            path: HandPath { tremor: None, ..path.clone() },
            tremor: path.tremor,
            pace: waves(PACE),
            shift: [waves(shift), waves(shift), waves(shift)],
            turn: [waves(turn), waves(turn), waves(turn)],
            grip_a: DVec3::ZERO,
        }
    }

    /// Returns this motion with the probe held at `grip_a` (m, in the probe's frame; by default the
    /// origin). Rotations away from the path are about this point.
    #[must_use]
    pub fn turning_at(self, grip_a: DVec3) -> Self {
        Self { grip_a, ..self }
    }

    /// Returns the intended pose of the probe (not of the grip) at `time` (s, not negative). At
    /// time 0, this is the start of the path.
    pub fn pose(&self, time: f64) -> Pose {
        let time = time.max(0.0);
        let script = self.path.pose(self.along(time)).with_origin(self.grip_a);
        let begun = (time / BEGINNING).min(1.0);
        let begun = begun * begun * begun * (10.0 + begun * (6.0 * begun - 15.0));
        let strayed = |waves: &[Waves; 3]| DVec3::from_array([0, 1, 2].map(|axis| waves[axis].at(time))) * begun;
        let mut translation = script.translation + strayed(&self.shift);
        if let Some(tremor) = &self.tremor {
            translation += tremor.displacement(time);
        }
        let turned = DQuat::from_scaled_axis(strayed(&self.turn));
        Pose { rotation: (turned * script.rotation).normalize(), translation }.with_origin(-self.grip_a)
    }

    /// Returns the time along the path, s.
    fn along(&self, time: f64) -> f64 {
        let along = time + self.pace.integral(time);
        if self.path.is_cyclic() {
            return along;
        }
        let whole = self.path.duration();
        let lap = along.rem_euclid(2.0 * whole);
        if lap <= whole { lap } else { 2.0 * whole - lap }
    }
}

#[cfg(test)]
mod tests {
    use palpus::algebra::rotation_between;

    use super::*;
    use crate::scene;

    const SEED: u64 = 0x50a1;
    const SHIFT: f64 = 5e-3;
    const TURN: f64 = 0.2;

    #[test]
    fn seed_determines_the_motion() {
        let path = scene("spoon-cup").expect("a built-in scene").path;
        let [hand, same, other] = [SEED, SEED, SEED + 1].map(|seed| Wander::about(&path, SHIFT, TURN, seed));
        assert!(hand.pose(0.0).translation.distance(path.pose(0.0).translation) < 1e-12);
        for time in [0.5, 77.0, 3600.0] {
            assert_eq!(hand.pose(time), same.pose(time), "seed {SEED}");
            assert!(hand.pose(time).translation.distance(other.pose(time).translation) > 1e-5, "{time}, seed {SEED}");
        }
    }

    #[test]
    fn deviation_does_not_grow_with_the_grip_distance() {
        let path = scene("spoon-cup").expect("a built-in scene").path;
        let hand = Wander::about(&path, SHIFT, TURN, SEED);
        let grip = DVec3::new(0.24, 0.0, 0.1);
        let far = hand.clone().turning_at(grip);
        for time in [0.5, 77.0, 3600.0] {
            let (near, far) = (hand.pose(time), far.pose(time));
            assert!(near.rotation.dot(far.rotation).abs() > 1.0 - 1e-12, "{time}, seed {SEED}");
            let script = hand.path.pose(hand.along(time));
            let strayed = far.point(grip) - script.point(grip);
            assert!(strayed.distance(near.translation - script.translation) < 1e-12, "{time}, seed {SEED}");
        }
    }

    #[test]
    fn endless_motion_is_smooth_and_near_its_path() {
        for name in ["spoon-cup", "torus-torus", "intestine"] {
            let path = scene(name).expect("a built-in scene").path;
            let hand = Wander::about(&path, SHIFT, TURN, SEED);
            for hour in [0.0, 1.0, 100.0] {
                let (begin, h) = (hour * 3600.0, 1e-3);
                let mut last: Option<DVec3> = None;
                let mut moved: f64 = 0.0;
                for k in 0..20_000 {
                    let time = begin + f64::from(k) * h;
                    let (now, next) = (hand.pose(time), hand.pose(time + h));
                    assert!(now.is_valid(), "{name} at {time}, seed {SEED}");
                    let velocity = (next.translation - now.translation) / h;
                    let turned = rotation_between(now.rotation, next.rotation).length() / h;
                    assert!(
                        velocity.length() < 0.6 && turned < 12.0,
                        "{name} at {time}, seed {SEED}: {velocity}, {turned}"
                    );
                    // The velocity has no jump: its change in one tick agrees with a normal
                    // acceleration of a hand.
                    let step = last.map_or(0.0, |last| last.distance(velocity));
                    assert!(step < 0.03, "{name} at {time}, seed {SEED}: {step} m/s in a millisecond");
                    last = Some(velocity);
                    moved = moved.max(velocity.length());
                    let script = hand.path.pose(hand.along(time)).translation;
                    assert!(now.translation.distance(script) < 3f64.sqrt() * (SHIFT + 1e-4), "{name} at {time}");
                }
                assert!(moved > 0.01, "{name} does not move after {hour} h, seed {SEED}");
            }
        }
    }
}
