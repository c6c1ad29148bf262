//! A device set down where a scene begins.
//!
//! A device has its own origin, somewhere in its arm, and a grip is held as it is held. So the
//! grip's first pose is taken to be the one where the scene wants its hand to begin: positions are
//! shifted by a constant, the grip is turned within the hand by a constant. The device's axes stay
//! the scene's axes; velocities and wrenches, which are about the grip in those axes, are not
//! touched.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Wrench};

use crate::device::{Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog};

/// A device whose first pose is that of the scene's beginning.
#[derive(Clone, Debug)]
pub struct PlacedDevice<D> {
    device: D,
    start: Pose,
    /// Added to every position, and turned before every rotation; `None` before the first state.
    placed: Option<(DVec3, DQuat)>,
}

impl<D: HapticDevice> PlacedDevice<D> {
    /// `device`, of which the first valid pose that is read becomes `start`.
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
    fn the_first_pose_is_the_start_and_motion_is_the_same() {
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
        // A turn of the grip is the same turn of the probe, about the same axis of the world.
        let turned = rotation_between(first.rotation, second.rotation);
        assert!(turned.distance(DVec3::new(0.0, 0.0, 0.2)) < 1e-7, "{turned}");
    }
}
