//! A device whose workspace is moved to the start of a scene.
//!
//! A device has its own origin, somewhere in its arm, and starts with any orientation of the grip.
//! So this device maps the first valid grip pose to the start pose of the scene. It adds a constant
//! shift to each position, and applies a constant rotation in the grip's own frame. The axes of the
//! device are the axes of the scene. Velocities and wrenches refer to the grip's origin in these
//! axes, so they are not changed.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Wrench};

use crate::device::{Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog};

/// A device whose first valid pose becomes the start pose of a scene.
#[derive(Clone, Debug)]
pub struct PlacedDevice<D> {
    device: D,
    start: Pose,
    /// The shift added to each position (m), and the rotation applied in the grip's own frame;
    /// `None` before the first valid state.
    placed: Option<(DVec3, DQuat)>,
}

impl<D: HapticDevice> PlacedDevice<D> {
    /// Wraps `device` so that its first valid pose becomes `start`.
    pub fn new(device: D, start: Pose) -> Self {
        Self { device, start, placed: None }
    }
}

impl<D: HapticDevice> HapticDevice for PlacedDevice<D> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        let mut state = self.device.read()?;
        if self.placed.is_none() && state.pose.is_valid() {
            let shift = self.start.translation - state.pose.translation;
            self.placed = Some((shift, state.pose.rotation.conjugate() * self.start.rotation));
        }
        if let Some((shift, turn)) = self.placed {
            state.pose.translation += shift;
            state.pose.rotation = (state.pose.rotation * turn).normalize();
        }
        Ok(state)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.device.write(wrench)
    }

    fn stands_unread(&self) -> bool {
        self.device.stands_unread()
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        self.device.counts()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }

    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        self.device.own_watchdog()
    }
}

#[cfg(test)]
mod tests {
    use palpus::algebra::{Twist, rotation_between};

    use super::*;
    use crate::replay::ReplayDevice;
    use crate::simulated::SimulationSettings;

    #[test]
    fn first_pose_becomes_start_and_motion_is_kept() {
        let poses = [
            Pose { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, f64::NAN), translation: DVec3::ZERO },
            Pose { rotation: DQuat::from_rotation_x(0.4), translation: DVec3::new(0.1, 0.2, 0.3) },
            Pose {
                rotation: DQuat::from_rotation_z(0.2) * DQuat::from_rotation_x(0.4),
                translation: DVec3::new(0.1, 0.25, 0.3),
            },
        ];
        let state =
            |pose: &Pose| DeviceState { pose: *pose, twist: Twist::default(), buttons: 1, time: 0.0, withheld: false };
        let recorded = ReplayDevice::new(SimulationSettings::default().spec, poses.iter().map(state).collect());
        let start = Pose { rotation: DQuat::from_rotation_y(1.0), translation: DVec3::new(0.0, 0.0, 0.05) };
        let mut device = PlacedDevice::new(recorded, start);
        assert!(!device.read().unwrap().pose.is_valid());
        let first = device.read().unwrap().pose;
        assert!(first.translation.distance(start.translation) < 1e-15);
        assert!(rotation_between(first.rotation, start.rotation).length() < 1e-7);
        let second = device.read().unwrap().pose;
        assert!((second.translation - first.translation).distance(DVec3::new(0.0, 0.05, 0.0)) < 1e-15);
        // A rotation of the grip rotates the probe by the same angle about the same world axis.
        let turned = rotation_between(first.rotation, second.rotation);
        assert!(turned.distance(DVec3::new(0.0, 0.0, 0.2)) < 1e-7, "{turned}");
    }
}
