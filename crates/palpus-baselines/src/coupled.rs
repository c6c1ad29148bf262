//! A method behind a virtual coupling, as in \[MPT99\]: "force discontinuities arising from the
//! use of a simple penalty force model are mitigated by a dynamic simulation based on virtual
//! coupling" (abstract).
//!
//! 1. The probe is a separate rigid body. A spring and a damper tie it to the hand's pose, both for
//!    translation and for rotation.
//! 2. This body touches the environment: the inner method computes the contact wrench at the body's
//!    pose and velocity.
//! 3. Newton–Euler integration: the velocity follows from coupling and contacts, then the pose from
//!    the velocity. The integration is explicit, as in \[MPT99\], at the caller's rate.
//! 4. The hand feels only the coupling.
//!
//! Our choices:
//!
//! * The mass of the body is a setting. Its inertia equals that of a ball of the probe's size, and
//!   is equal about all axes. So there is no gyroscopic term.
//! * By default the dampers give critical damping of the free body.
//! * Velocities are computed before positions (semi-implicit Euler). In the other order, the
//!   coupling alone would gain energy.
//! * \[MPT99\] also bounds the stretch of the spring. Here the device's limits bound the force.
//! * Any method can be the inner method; in the paper it is [`Voxel`](crate::Voxel).

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::Body;

use crate::{Baseline, BaselineError, Felt, positive};

/// Settings of the coupling: a spring and a damper for translation, and a spring and a damper for
/// rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingSettings {
    /// Mass of the simulated probe, kg.
    pub mass: f64,
    /// Stiffness for translation, N/m.
    pub stiffness: f64,
    /// Stiffness for rotation, N·m/rad.
    pub angular_stiffness: f64,
    /// Damping relative to critical damping; 1 by default.
    pub damping_ratio: f64,
}

impl Default for CouplingSettings {
    /// Returns 50 g at 1000 N/m and 0.5 N·m/rad, which a Phantom Premium 1.5/6DOF can render.
    fn default() -> Self {
        Self { mass: 0.05, stiffness: 1000.0, angular_stiffness: 0.5, damping_ratio: 1.0 }
    }
}

/// A method behind a virtual coupling; the module describes the method.
#[derive(Clone, Debug)]
pub struct Coupled<B> {
    within: B,
    settings: CouplingSettings,
    /// Inertia about every axis, kg·m².
    inertia: f64,
    /// Centre of mass of the probe in its own frame, m. The coupling acts there, and the body
    /// rotates about it.
    center_a: DVec3,
    grip_a: DVec3,
    body: Option<Simulated>,
}

/// Pose and velocity of the simulated probe's centre, in b's frame.
#[derive(Clone, Copy, Debug)]
struct Simulated {
    rotation: DQuat,
    center: DVec3,
    twist: Twist,
}

/// Inertia of a ball of mass m and radius r: 2/5 m r².
const BALL: f64 = 0.4;
/// Radius of the ball relative to the probe's bounding diagonal.
const RADIUS: f64 = 0.25;

impl<B: Baseline> Coupled<B> {
    /// Puts a coupling around `within`, which must be made for the probe `a` and the grip `grip_a`
    /// (m).
    ///
    /// # Errors
    /// Fails if a setting is not positive and finite.
    pub fn new(within: B, a: &Arc<Body>, grip_a: DVec3, settings: CouplingSettings) -> Result<Self, BaselineError> {
        positive("mass", settings.mass)?;
        positive("stiffness", settings.stiffness)?;
        positive("angular_stiffness", settings.angular_stiffness)?;
        positive("damping_ratio", settings.damping_ratio)?;
        let radius = RADIUS * a.size();
        let inertia = BALL * settings.mass * radius * radius;
        Ok(Self { within, settings, inertia, center_a: a.mass().center_of_mass, grip_a, body: None })
    }

    /// Returns the wrench of the coupling on the simulated probe, about its centre.
    fn coupling(&self, body: &Simulated, hand: &Simulated) -> Wrench {
        let CouplingSettings { mass, stiffness, angular_stiffness, damping_ratio } = self.settings;
        let damping = 2.0 * damping_ratio * (stiffness * mass).sqrt();
        let angular_damping = 2.0 * damping_ratio * (angular_stiffness * self.inertia).sqrt();
        let turn = hand.rotation * body.rotation.conjugate();
        // Takes the shorter rotation.
        let turn = if turn.w < 0.0 { -turn } else { turn };
        Wrench {
            torque: turn.to_scaled_axis() * angular_stiffness
                + (hand.twist.angular - body.twist.angular) * angular_damping,
            force: (hand.center - body.center) * stiffness + (hand.twist.linear - body.twist.linear) * damping,
        }
    }
}

impl<B: Baseline> Baseline for Coupled<B> {
    fn name(&self) -> &'static str {
        self.within.name()
    }

    fn step(&mut self, pose_ba: &Pose, twist: &Twist, dt: f64) -> Felt {
        if !pose_ba.is_valid() {
            return Felt::NOTHING;
        }
        let center = pose_ba.point(self.center_a);
        let lever = center - pose_ba.point(self.grip_a);
        let of_center = Twist { angular: twist.angular, linear: twist.at(lever) };
        let hand = Simulated { rotation: pose_ba.rotation, center, twist: of_center };
        let mut body = self.body.unwrap_or(hand);
        let pose = Pose::new(body.rotation, body.center - body.rotation * self.center_a);
        let to_grip = pose.point(self.grip_a) - body.center;
        let of_grip = Twist { angular: body.twist.angular, linear: body.twist.at(to_grip) };
        let felt = self.within.step(&pose, &of_grip, dt);
        let coupling = self.coupling(&body, &hand);
        let total = coupling + felt.wrench.about(-to_grip);
        body.twist.linear += total.force * (dt / self.settings.mass);
        body.twist.angular += total.torque * (dt / self.inertia);
        body.center += body.twist.linear * dt;
        body.rotation = (DQuat::from_scaled_axis(body.twist.angular * dt) * body.rotation).normalize();
        self.body = Some(body);
        Felt { wrench: (-coupling).about(-lever), ..felt }
    }

    fn clear(&mut self) {
        self.within.clear();
        self.body = None;
    }
}

#[cfg(test)]
mod tests {
    use palpus_scenes::shape;

    use super::*;
    use crate::{Epa, Settings, testing};

    fn coupled(a: Arc<Body>, b: Arc<Body>, settings: Settings) -> Coupled<Epa> {
        let within = Epa::new(a.clone(), b, settings).expect("the settings are valid");
        Coupled::new(within, &a, settings.grip_a, CouplingSettings::default()).expect("the settings are valid")
    }

    #[test]
    fn coupling_and_contact_act_in_series_at_rest() {
        let settings = Settings { stiffness: 500.0, ..testing::SETTINGS };
        let mut method = coupled(testing::ball(), testing::table(), settings);
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 0.5));
        let height = -1e-3;
        let pose = Pose::new(turn, DVec3::Z * (height - testing::lowest_of_ball(turn)));
        let mut felt = Felt::NOTHING;
        for _ in 0..3000 {
            felt = method.step(&pose, &Twist::default(), 1e-3);
        }
        // 1000 N/m in series with 500 N/m act over 2 mm: 1 mm of depth and 1 mm of tolerance. The
        // corner of the ball also moves a little when the ball rotates.
        let expected = (1000.0 * 500.0 / 1500.0) * 2e-3;
        assert!((felt.wrench.force.z - expected).abs() < 0.02 * expected, "{felt:?} against {expected}");
        assert!(felt.deepest > height, "the simulated ball must be less deep than the hand");
    }

    #[test]
    fn only_the_mass_is_felt_without_contact() {
        let mut method = coupled(testing::ball(), testing::table(), testing::SETTINGS);
        let at = |z: f64| Pose::from_translation(DVec3::new(0.0, 0.0, z));
        for _ in 0..100 {
            assert!(method.step(&at(0.05), &Twist::default(), 1e-3).wrench.force.length() < 1e-12);
        }
        // At 1 m/s² for 0.2 s, a mass of 50 g needs 50 mN.
        let mut felt = Felt::NOTHING;
        for tick in 1..=200 {
            let t = 1e-3 * f64::from(tick);
            let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * t };
            felt = method.step(&at(0.05 + 0.5 * t * t), &twist, 1e-3);
        }
        assert!((felt.wrench.force.z + 0.05).abs() < 1e-3, "{felt:?}");
    }

    #[test]
    fn coupling_resists_rotation() {
        let block = testing::body(&shape::cuboid(DVec3::new(0.060, 0.040, 0.030)));
        let settings = Settings { grip_a: DVec3::ZERO, ..testing::SETTINGS };
        let mut method = coupled(block, testing::table(), settings);
        let _ = method.step(&Pose::from_translation(DVec3::Z * 0.05), &Twist::default(), 1e-3);
        let turned = Pose::new(DQuat::from_rotation_z(0.01), DVec3::Z * 0.05);
        let felt = method.step(&turned, &Twist::default(), 1e-3);
        assert!((felt.wrench.torque.z + 0.5 * 0.01).abs() < 1e-6, "{felt:?}");
    }

    #[test]
    fn same_steps_give_identical_results() {
        testing::same_again(|a, b, settings| Box::new(coupled(a, b, settings)));
    }
}
