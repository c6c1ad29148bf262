//! A free body that falls, slides and spins against another body under the engine's forces.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::body::Body;
use palpus::render::{ProbeState, Renderer, Settings, Tick};

/// Acceleration of gravity, m/s².
pub(crate) const GRAVITY: f64 = 9.81;
/// Period of the loop, s.
pub(crate) const DT: f64 = 1e-3;

/// A free rigid body under gravity, the engine's wrench, and a little drag like that of a device.
pub(crate) struct Falling {
    pub(crate) renderer: Renderer,
    /// Mass, kg.
    pub(crate) mass: f64,
    inertia: DMat3,
    center: DVec3,
    /// Decay rate of the velocity along each axis, 1/s.
    pub(crate) drag: DVec3,
    /// Decay rate of the rotation about each axis, 1/s.
    pub(crate) spin_drag: DVec3,
    /// Gravity, m/s².
    pub(crate) gravity: DVec3,
    pub(crate) pose: Pose,
    /// Velocity of the centre of mass, and angular velocity.
    pub(crate) twist: Twist,
}

impl Falling {
    pub(crate) fn new(a: &Arc<Body>, b: &Arc<Body>, mass: f64, settings: Settings, pose: Pose) -> Self {
        let properties = a.mass();
        Self {
            renderer: Renderer::new(a.clone(), b.clone(), settings).expect("the settings are valid"),
            mass,
            inertia: properties.inertia * (mass / properties.volume),
            center: properties.center_of_mass,
            drag: DVec3::ZERO,
            spin_drag: DVec3::ZERO,
            gravity: DVec3::NEG_Z * GRAVITY,
            pose,
            twist: Twist::default(),
        }
    }

    /// Sets gravity for a plane that descends toward +x by `angle` (rad).
    pub(crate) fn tilt(&mut self, angle: f64) {
        self.gravity = GRAVITY * DVec3::new(angle.sin(), 0.0, -angle.cos());
    }

    /// Makes one tick: first updates the velocities with the wrench at the current pose, then the
    /// pose.
    pub(crate) fn step(&mut self) -> &Tick {
        let center = self.pose.point(self.center);
        let grip = self.pose.point(self.renderer.settings().grip_a);
        let at_grip = Twist { linear: self.twist.at(grip - center), ..self.twist };
        let wrench = self.renderer.step(&ProbeState { pose_ba: self.pose, twist: at_grip }, DT, &NoClock).computed;
        let about_center = wrench.about(center - grip);
        let turned = DMat3::from_quat(self.pose.rotation);
        let inertia = turned * self.inertia * turned.transpose();
        let spin = self.twist.angular;
        let turning = inertia.inverse() * (about_center.torque - spin.cross(inertia * spin));
        let faded = |drag: DVec3| DVec3::ONE / (DVec3::ONE + drag * DT);
        self.twist.linear += (about_center.force / self.mass + self.gravity) * DT;
        self.twist.linear *= faded(self.drag);
        self.twist.angular = (spin + turning * DT) * faded(self.spin_drag);
        let rotation = (DQuat::from_scaled_axis(self.twist.angular * DT) * self.pose.rotation).normalize();
        let center = center + self.twist.linear * DT;
        self.pose = Pose::new(rotation, center - rotation * self.center);
        self.renderer.tick()
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / DT) as u64 {
            self.step();
        }
    }
}
