//! A device that plays a recorded motion.

use palpus::algebra::Wrench;

use crate::device::{DeviceError, DeviceSpec, DeviceState, HapticDevice};

/// Returns recorded states, one per tick, and ends after the last state. Written wrenches have no
/// effect on the motion.
#[derive(Clone, Debug)]
pub struct ReplayDevice {
    spec: DeviceSpec,
    states: Vec<DeviceState>,
    next: usize,
}

impl ReplayDevice {
    /// Returns a device with description `spec` that plays `states`.
    pub fn new(spec: DeviceSpec, states: Vec<DeviceState>) -> Self {
        Self { spec, states, next: 0 }
    }
}

impl HapticDevice for ReplayDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        let state = self.states.get(self.next).copied().ok_or(DeviceError::Ended)?;
        self.next += 1;
        Ok(state)
    }

    fn write(&mut self, _: &Wrench) -> Result<(), DeviceError> {
        Ok(())
    }

    fn stands_unread(&self) -> bool {
        true
    }
}
