//! A haptic loop at 1 kHz in real time: a simulated operator presses a peg onto a plate with a
//! simulated device.
//!
//! `cargo run --release -p palpus-examples --example haptic_loop`

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use palpus::glam::DVec3;
use palpus::{Body, BodyError, Limits, Object, Pose, ProbeState, Settings, WallClock, World, contact_tolerance};
use palpus_device::{
    HapticDevice, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings, StepOutcome, Timing,
};

fn main() -> Result<(), Box<dyn Error>> {
    run(Timing::RealTime)
}

fn run(timing: Timing) -> Result<(), Box<dyn Error>> {
    // The operator moves down by 40 mm in a second. The last 10 mm are inside the plate.
    let intent = |time: f64| Pose::from_translation(DVec3::Z * (0.05 - 0.04 * time.min(1.0)));
    let mut device = SimulatedDevice::new(SimulationSettings::default(), intent)?;

    let (plate, peg) = (block(DVec3::new(0.1, 0.1, 0.02))?, block(DVec3::new(0.01, 0.01, 0.04))?);
    // The largest stiffness that this device can render, with a contact tolerance for these bodies.
    let limits = Limits { force: device.spec().force_max, torque: device.spec().torque_max };
    let tolerance = contact_tolerance(&peg, &plate, &Pose::from_translation(DVec3::Z * 0.03));
    let settings = Settings::coupled(limits, 1e-3, tolerance);
    let mut world = World::new(settings)?;
    world.add(Object::fixed(plate, Pose::IDENTITY))?;
    let tool = world.add_tool(peg, settings)?;

    // With a clock, the step limits its work so that it takes at most 0.6 of the period.
    let clock = WallClock::new();
    let mut strongest: f64 = 0.0;
    let mut servo = Servo::new(ServoOptions { timing, duration: Some(2.0), ..ServoOptions::default() })?;
    let statistics = servo.run(
        &mut device,
        |state, dt| {
            let probe = ProbeState { pose_ba: state.pose, twist: state.twist };
            world.step(&[probe], dt, &clock);
            StepOutcome::of(world.tick(tool).commanded)
        },
        // The observer gets every tick, on the servo thread.
        &mut |tick: &ServoTick, (): &()| strongest = strongest.max(tick.wrench.force.length()),
        &AtomicBool::new(false),
    );
    println!("{} ticks, {:?}; largest force {strongest:.2} N", statistics.ticks, statistics.end);
    Ok(())
}

fn block(size: DVec3) -> Result<Arc<Body>, BodyError> {
    let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| [-0.5, 0.5].map(|z| DVec3::new(x, y, z) * size)));
    Body::from_convex(corners.as_flattened().as_flattened()).map(Arc::new)
}

#[test]
fn example_runs() {
    run(Timing::Simulated).unwrap();
}
