//! A simulated device in the whole loop, with an account of the true work on its hand.

use std::sync::Arc;

use palpus::algebra::Wrench;
use palpus_device::{Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice, Intent, SimulatedDevice};

use crate::closed_loop::HandWork;

/// A simulated device that keeps an account of the true work on its hand.
pub(crate) struct Judged<I> {
    device: SimulatedDevice<I>,
    pub(crate) work: HandWork,
}

impl<I> Judged<I> {
    pub(crate) fn new(device: SimulatedDevice<I>) -> Self {
        Self { device, work: HandWork::default() }
    }
}

impl<I: Intent> HapticDevice for Judged<I> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        let state = self.device.read()?;
        self.work.moved_to(&self.device.true_pose());
        Ok(state)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.device.write(wrench)?;
        self.work.act(self.device.true_pose(), self.device.applied());
        Ok(())
    }

    fn stands_unread(&self) -> bool {
        true
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }
}
