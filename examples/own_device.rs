//! Your own device: implements the interface that palpus needs, and runs a servo loop with the
//! device.
//!
//! `cargo run --release -p palpus-examples --example own_device`

use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use palpus::glam::DVec3;
use palpus::{Pose, Twist, Wrench};
use palpus_device::{
    DeviceError, DeviceSpec, DeviceState, HapticDevice, Servo, ServoOptions, SimulationSettings, StepOutcome,
};

/// A device that moves up and down by itself and only stores the commanded wrench.
struct Swing {
    spec: DeviceSpec,
    since: Instant,
    commanded: Wrench,
}

impl HapticDevice for Swing {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        // Call your driver here. Axes without a sensor stay at rest.
        let time = self.since.elapsed().as_secs_f64();
        let pose = Pose::from_translation(DVec3::Z * 0.01 * (6.0 * time).sin());
        Ok(DeviceState { pose, twist: Twist::default(), buttons: 0, time, withheld: false })
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.commanded = *wrench;
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let exact = DeviceSpec { position_step: 0.0, angle_step: 0.0, ..SimulationSettings::default().spec };
    let spec = DeviceSpec { name: "swing".into(), force_max: 3.0, ..exact };
    let mut device = Swing { spec, since: Instant::now(), commanded: Wrench::default() };

    // The step renders a spring towards the origin. The safety chain limits every wrench of a step.
    let spring = |state: &DeviceState, _dt: f64| {
        StepOutcome::of(Wrench { force: state.pose.translation * -100.0, torque: DVec3::ZERO })
    };
    let mut servo = Servo::new(ServoOptions { duration: Some(1.0), ..ServoOptions::default() })?;
    let run = servo.run(&mut device, spring, &mut (), &AtomicBool::new(false));
    println!(
        "{} ticks, {:?}: largest force {:.2} N, last force {} N",
        run.ticks, run.end, run.force_max, device.commanded.force
    );
    Ok(())
}

#[test]
fn example_runs() {
    main().unwrap();
}
