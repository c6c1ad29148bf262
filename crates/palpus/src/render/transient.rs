//! Contact transients: a decaying vibration at each impact, by material and speed of approach
//! \[Okamura, Cutkosky, Dennerlein 2001; Kuchenbecker, Fiene, Niemeyer 2006\].
//!
//! No device is as stiff as wood or steel, so every surface feels soft at the tick of impact. A
//! real hard object vibrates, and a device can render the vibration: an impact at speed v adds the
//! force n g v e^(−βt) sin ωt, open loop, to the force of contacts and coupling. It is the impulse
//! response of one damped oscillator, so several impacts simply add up, and each vibration decays
//! to zero.
//!
//! *What counts as an impact.* A contact presses, and no contact has pressed in a similar direction
//! for the last few milliseconds ([`IMPACT_REST`]). So a tool that rests, slides or rolls does not
//! vibrate; one that slides along a floor into a wall does. The speed of the impact is that of the
//! hand towards the other body at the contact.
//!
//! The vibration is a force at the grip without a torque, since a hand cannot feel a direction of
//! rotation in vibrations of a stylus.

use glam::DVec3;

use crate::algebra::Twist;
use crate::algebra::tolerance::{IMPACT_CONE, IMPACT_REST, TRANSIENT_MOST, TRANSIENT_SAMPLES};

/// How a material rings when it is hit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Material {
    /// Hz: frequency of the vibration.
    pub frequency: f64,
    /// 1/s: decay rate; the vibration falls to 1/e in the time 1/`decay`.
    pub decay: f64,
    /// N for each m/s of approach: the vibration's size before it decays.
    pub gain: f64,
}

impl Material {
    /// A low vibration that ends after one oscillation.
    pub const RUBBER: Self = Self { frequency: 30.0, decay: 60.0, gain: 6.0 };
    /// A knock.
    pub const WOOD: Self = Self { frequency: 90.0, decay: 80.0, gain: 15.0 };
    /// A high vibration: the highest that a 1 kHz loop and common devices can render; real steel is
    /// higher.
    pub const STEEL: Self = Self { frequency: 180.0, decay: 90.0, gain: 25.0 };

    /// The materials that scenes know by name.
    pub const NAMED: [(&str, Self); 3] = [("rubber", Self::RUBBER), ("wood", Self::WOOD), ("steel", Self::STEEL)];
}

/// The vibration that a tool feels now, and where it was last pressed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transient {
    /// N: the oscillator, whose second part is the force.
    state: [DVec3; 2],
    pressed: [Pressed; DIRECTIONS],
}

/// Most stored directions. A solid in a corner has three; if there are more, the oldest are
/// dropped.
const DIRECTIONS: usize = 8;

/// A direction in which a contact presses, or pressed recently.
#[derive(Clone, Copy, Debug)]
struct Pressed {
    normal: DVec3,
    /// s since then.
    rested: f64,
    /// m/s: of an impact in this tick.
    approach: f64,
}

impl Transient {
    /// Still, and nowhere pressed.
    pub(super) const STILL: Self = Self {
        state: [DVec3::ZERO; 2],
        pressed: [Pressed { normal: DVec3::ZERO, rested: f64::INFINITY, approach: 0.0 }; DIRECTIONS],
    };

    /// A contact presses the tool along `normal`, which the hand approaches with `approach` (m/s;
    /// negative: leaves).
    pub(super) fn press(&mut self, normal: DVec3, approach: f64) {
        let known = self.pressed.iter_mut().filter(|pressed| pressed.rested < IMPACT_REST);
        let alike =
            known.map(|pressed| (pressed.normal.dot(normal), pressed)).filter(|(cosine, _)| *cosine > IMPACT_CONE);
        if let Some((_, pressed)) = alike.max_by(|x, y| x.0.total_cmp(&y.0)) {
            // Follows a tool that rolls; of an impact, the fastest contact counts.
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

    /// The transient's force at the grip, N and at most `most`, after a tick of `h` s with the
    /// contacts given before.
    pub(super) fn ring(&mut self, material: &Material, h: f64, most: f64) -> DVec3 {
        let angle = std::f64::consts::TAU * material.frequency * h;
        for pressed in &mut self.pressed {
            // The vibration starts with a push away from the surface, as a blow on a hard object
            // does.
            self.state[0] += pressed.normal * (material.gain * std::mem::take(&mut pressed.approach));
            pressed.rested += h;
        }
        // A frequency that the loop cannot sample is left out.
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

/// m/s: the speed of approach, against `normal`, of a point of the hand to a body that moves there
/// with `other`. The hand moves with `hand` about `grip`.
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
    fn an_impact_rings_as_its_material_does() {
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
    fn what_rests_slides_and_rolls_does_not_ring() {
        let mut transient = Transient::STILL;
        let turned = |k: usize| DVec3::new((0.01 * k as f64).sin(), 0.0, (0.01 * k as f64).cos());
        transient.press(DVec3::Z, 0.0);
        for k in 0..600 {
            // The tool rolls onto the next facet in each tick and approaches it at 0.05 m/s. In
            // every seventh tick it is off the surface.
            if k % 7 != 3 {
                transient.press(turned(k), 0.05);
            }
            assert_eq!(transient.ring(&Material::WOOD, H, 8.5), DVec3::ZERO, "tick {k}");
        }
        // Another wall.
        transient.press(turned(600).cross(DVec3::Y), 0.05);
        assert!(transient.ring(&Material::WOOD, H, 8.5).length() > 0.1);
    }

    #[test]
    fn a_ring_leaves_the_device_to_the_contact() {
        let force = rung(&Material::STEEL, 1e6, 50);
        assert!(force.iter().all(|force| force.abs() <= 100.0 / 3.0 + 1e-9) && force.iter().any(|force| *force > 20.0));
    }

    #[test]
    fn a_slow_loop_does_not_ring() {
        let mut transient = Transient::STILL;
        transient.press(DVec3::Z, 1.0);
        assert_eq!(transient.ring(&Material::STEEL, 2e-3, 8.5), DVec3::ZERO);
    }
}
