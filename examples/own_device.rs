//! A device of your own: what palpus asks of it, and the test that it passes before anybody is
//! given a force by it.
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

/// Moves up and down by itself, and only shows the commanded wrench.
struct Swing {
    spec: DeviceSpec,
    since: Instant,
    told: Wrench,
}

impl HapticDevice for Swing {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        // A driver's call goes here; what a device does not sense stays at rest.
        let time = self.since.elapsed().as_secs_f64();
        let pose = Pose::from_translation(DVec3::Z * 0.01 * (6.0 * time).sin());
        Ok(DeviceState { pose, twist: Twist::default(), buttons: 0, time, withheld: false })
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.told = *wrench;
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let exact = DeviceSpec { position_step: 0.0, angle_step: 0.0, ..SimulationSettings::default().spec };
    let spec = DeviceSpec { name: "swing".into(), force_max: 3.0, ..exact };
    let mut device = Swing { spec, since: Instant::now(), told: Wrench::default() };

    // Something to feel: a spring towards the middle. The safety chain stands behind it, as behind
    // anything.
    let spring = |state: &DeviceState, _dt: f64| {
        StepOutcome::of(Wrench { force: state.pose.translation * -100.0, torque: DVec3::ZERO })
    };
    let mut servo = Servo::new(ServoOptions { duration: Some(1.0), ..ServoOptions::default() })?;
    let run = servo.run(&mut device, spring, &mut (), &AtomicBool::new(false));
    println!("{} ticks, {:?}: at most {:.2} N; at last {}", run.ticks, run.end, run.force_max, device.told.force);
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
