//! Tests of the loop with a device that records the written wrenches.

mod faults;
mod lateness;
mod run;

use glam::DVec3;
use palpus::algebra::{Pose, Twist};

use super::*;
use crate::device::{Brake, BrakeFlag, DeviceError};
use crate::safety::SafetyLimits;
use crate::{DeviceSpec, known_devices};

/// A device that moves along x by 1 mm per read and records the written wrenches.
struct Scribe {
    spec: DeviceSpec,
    written: Vec<Wrench>,
    reads: usize,
    read: fn(usize) -> Result<DeviceState, DeviceError>,
    write: fn(&Wrench) -> Result<(), DeviceError>,
    brake: Arc<BrakeFlag>,
}

impl Scribe {
    fn new() -> Self {
        let [spec, ..] = known_devices();
        let brake = Arc::default();
        Self { spec, written: Vec::new(), reads: 0, read: |tick| Ok(state_at(tick)), write: |_| Ok(()), brake }
    }
}

impl HapticDevice for Scribe {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.reads += 1;
        (self.read)(self.reads - 1)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.written.push(*wrench);
        (self.write)(wrench)
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }
}

fn state_at(tick: usize) -> DeviceState {
    let time = tick as f64 * 1e-3;
    DeviceState {
        pose: Pose::from_translation(DVec3::X * (1e-3 * tick as f64)),
        twist: Twist::default(),
        buttons: 0,
        time,
        withheld: false,
    }
}

fn pull(newtons: f64) -> Wrench {
    Wrench { force: DVec3::X * newtons, torque: DVec3::ZERO }
}

/// Returns a chain that passes every valid wrench unchanged, since these tests are about the loop.
fn open() -> SafetyOptions {
    let [spec, ..] = known_devices();
    let limits = SafetyLimits {
        force_peak: f64::INFINITY,
        force_continuous: f64::INFINITY,
        force_slew: f64::INFINITY,
        engage_force: f64::INFINITY,
        ramp: 0.0,
        hold: 0.0,
        stall: f64::INFINITY,
        damping: 0.0,
        ..SafetyLimits::of(&spec, 1000.0)
    };
    SafetyOptions { limits: Some(limits), loosened: true, ..Default::default() }
}

fn fast(duration: f64) -> Servo {
    let options =
        ServoOptions { timing: Timing::Simulated, duration: Some(duration), safety: open(), ..Default::default() };
    Servo::new(options).unwrap()
}

/// Returns a loop in virtual time with the default thresholds of the device.
fn guarded(duration: f64, safety: SafetyOptions) -> Servo {
    Servo::new(ServoOptions { duration: Some(duration), safety, ..Default::default() }).unwrap()
}

fn go_on() -> AtomicBool {
    AtomicBool::new(false)
}
