//! Contact transients: a decaying vibration at each impact, which depends on the material and the
//! speed of approach \[Okamura, Cutkosky, Dennerlein 2001; Kuchenbecker, Fiene, Niemeyer 2006\].
//!
//! No device is as stiff as wood or steel, so every surface feels soft at an impact. But a hard
//! object vibrates, and a device can render the vibration. An impact at speed v adds the force n g
//! v e^(−βt) sin ωt, open loop, to the force of contacts and coupling. This is the impulse
//! response of a damped oscillator, so the vibrations of several impacts add up.
//!
//! *Impacts.* An impact occurs if a contact presses, and if no contact has pressed in a similar
//! direction for the last few milliseconds ([`IMPACT_REST`]). So a tool that rests, slides or rolls
//! does not vibrate, but a tool that slides along a floor into a wall does. The impact's speed is
//! the hand's speed towards the other body at the contact.
//!
//! The vibration is a force at the grip without a torque, since a hand cannot feel a direction of
//! rotation in vibrations of a stylus.

use glam::DVec3;

use crate::algebra::Twist;
use crate::algebra::tolerance::{IMPACT_CONE, IMPACT_REST, TRANSIENT_MOST, TRANSIENT_SAMPLES};

/// The vibration of a material at an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Material {
    /// Frequency of the vibration, Hz.
    pub frequency: f64,
    /// Decay rate, 1/s: the vibration falls to 1/e in the time 1/`decay`.
    pub decay: f64,
    /// Amplitude before the decay for each m/s of approach, N·s/m.
    pub gain: f64,
}

impl Material {
    /// A low frequency that decays within one oscillation.
    pub const RUBBER: Self = Self { frequency: 30.0, decay: 60.0, gain: 6.0 };
    /// A dull knock.
    pub const WOOD: Self = Self { frequency: 90.0, decay: 80.0, gain: 15.0 };
    /// The highest frequency that a 1 kHz loop and common devices can render. Real steel vibrates
    /// faster.
    pub const STEEL: Self = Self { frequency: 180.0, decay: 90.0, gain: 25.0 };

    /// The materials that scenes can name.
    pub const NAMED: [(&str, Self); 3] = [("rubber", Self::RUBBER), ("wood", Self::WOOD), ("steel", Self::STEEL)];
}

/// The present vibration of a tool, and the directions in which contacts pressed it recently.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transient {
    /// State of the oscillator, N; the second element is the force.
    state: [DVec3; 2],
    pressed: [Pressed; DIRECTIONS],
}

/// Largest number of stored directions. A tool in a corner has three; if there are more, the oldest
/// are dropped.
const DIRECTIONS: usize = 8;

/// A direction in which a contact presses or pressed recently.
#[derive(Clone, Copy, Debug)]
struct Pressed {
    normal: DVec3,
    /// Time since the last pressing contact, s.
    rested: f64,
    /// Speed of an impact in this tick, m/s.
    approach: f64,
}

impl Transient {
    /// No vibration and no pressing contact.
    pub(super) const STILL: Self = Self {
        state: [DVec3::ZERO; 2],
        pressed: [Pressed { normal: DVec3::ZERO, rested: f64::INFINITY, approach: 0.0 }; DIRECTIONS],
    };

    /// Adds a contact that presses the tool along `normal`. `approach` is the hand's speed toward
    /// the surface (m/s; negative if it moves away).
    pub(super) fn press(&mut self, normal: DVec3, approach: f64) {
        let known = self.pressed.iter_mut().filter(|pressed| pressed.rested < IMPACT_REST);
        let alike =
            known.map(|pressed| (pressed.normal.dot(normal), pressed)).filter(|(cosine, _)| *cosine > IMPACT_CONE);
        if let Some((_, pressed)) = alike.max_by(|x, y| x.0.total_cmp(&y.0)) {
            // The stored direction follows a tool that rolls. If several contacts belong to an
            // impact, the fastest one counts.
            let is_new = pressed.approach > 0.0;
            *pressed =
                Pressed { normal, rested: 0.0, approach: if is_new { pressed.approach.max(approach) } else { 0.0 } };
            return;
        }
        let oldest = self.pressed.iter_mut().max_by(|x, y| x.rested.total_cmp(&y.rested));
        if let Some(oldest) = oldest {
            *oldest = Pressed { normal, rested: 0.0, approach: approach.max(0.0) };
        }
    }

    /// Advances the vibration by a tick of `h` s with the contacts added before. Returns its force
    /// at the grip, at most `most` (N).
    pub(super) fn ring(&mut self, material: &Material, h: f64, most: f64) -> DVec3 {
        let angle = std::f64::consts::TAU * material.frequency * h;
        for pressed in &mut self.pressed {
            // The vibration begins with a force away from the surface, like the vibration of a hard
            // object.
            self.state[0] += pressed.normal * (material.gain * std::mem::take(&mut pressed.approach));
            pressed.rested += h;
        }
        // The loop cannot render this frequency.
        if angle * TRANSIENT_SAMPLES > std::f64::consts::TAU {
            self.state = [DVec3::ZERO; 2];
            return DVec3::ZERO;
        }
        let (sine, cosine) = angle.sin_cos();
        let left = (-material.decay * h).exp();
        let [x, y] = self.state;
        self.state = [(x * cosine - y * sine) * left, (x * sine + y * cosine) * left];
        let most = TRANSIENT_MOST * most;
        let size = self.state[0].length_squared() + self.state[1].length_squared();
        if size > most * most {
            let share = most / size.sqrt();
            self.state = self.state.map(|part| part * share);
        }
        self.state[1]
    }
}

/// Returns the speed at which a point of the hand approaches a body, against `normal` (m/s). The
/// body moves with `other` at this point, and the hand moves with `hand` about `grip`.
pub(super) fn approach(hand: &Twist, grip: DVec3, point: DVec3, normal: DVec3, other: DVec3) -> f64 {
    (other - hand.at(point - grip)).dot(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 1e-3;

    fn rung(material: &Material, speed: f64, ticks: usize) -> Vec<f64> {
        let mut transient = Transient::STILL;
        let mut force = Vec::new();
        for _ in 0..ticks {
            transient.press(DVec3::Z, speed);
            force.push(transient.ring(material, H, 100.0).z);
        }
        force
    }

    #[test]
    fn impact_vibrates_like_its_material() {
        for (name, material) in Material::NAMED {
            let Material { frequency, decay, gain } = material;
            for (k, force) in rung(&material, 0.2, 100).into_iter().enumerate() {
                let time = H * (k + 1) as f64;
                let expected = 0.2 * gain * (-decay * time).exp() * (std::f64::consts::TAU * frequency * time).sin();
                assert!((force - expected).abs() < 1e-9, "{name}, {time} s: {force} N, not {expected}");
            }
        }
    }

    #[test]
    fn resting_sliding_and_rolling_do_not_vibrate() {
        let mut transient = Transient::STILL;
        let turned = |k: usize| DVec3::new((0.01 * k as f64).sin(), 0.0, (0.01 * k as f64).cos());
        transient.press(DVec3::Z, 0.0);
        for k in 0..600 {
            // In each tick, the tool rolls onto the next facet and approaches it at 0.05 m/s. In
            // every seventh tick the tool is off the surface.
            if k % 7 != 3 {
                transient.press(turned(k), 0.05);
            }
            assert_eq!(transient.ring(&Material::WOOD, H, 8.5), DVec3::ZERO, "tick {k}");
        }
        // Adds an impact on another wall.
        transient.press(turned(600).cross(DVec3::Y), 0.05);
        assert!(transient.ring(&Material::WOOD, H, 8.5).length() > 0.1);
    }

    #[test]
    fn vibration_stays_within_the_limit() {
        let force = rung(&Material::STEEL, 1e6, 50);
        assert!(force.iter().all(|force| force.abs() <= 100.0 / 3.0 + 1e-9) && force.iter().any(|force| *force > 20.0));
    }

    #[test]
    fn slow_loop_does_not_vibrate() {
        let mut transient = Transient::STILL;
        transient.press(DVec3::Z, 1.0);
        assert_eq!(transient.ring(&Material::STEEL, 2e-3, 8.5), DVec3::ZERO);
    }
}
