//! Tests that loop, simulated device and recorder do not allocate while they run.

use std::sync::atomic::AtomicBool;

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    DeviceState, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings, StepOutcome, Timing, latest,
    record,
};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn run_does_not_allocate() {
    for (timing, duration) in [(Timing::Simulated, 2.0), (Timing::RealTime, 0.05)] {
        let options = ServoOptions { timing, duration: Some(duration), ..Default::default() };
        let mut servo = Servo::new(options).expect("the options are valid");
        let intent = |t: f64| Pose::from_translation(DVec3::X * 0.02 * (5.0 * t).cos());
        let mut device = SimulatedDevice::new(SimulationSettings::default(), intent).expect("the settings are valid");
        let (mut recorder, recording) = record(4096, |_: &(f64, Wrench)| Ok(()));
        let (mut publisher, mut newest) = latest(Wrench::ZERO);
        // The watchdog thread is started before the first tick and joined after the last tick.
        let (mut first, mut last) = (None, 0);
        let mut observer = |tick: &ServoTick, _: &()| {
            recorder.push((tick.time, tick.wrench));
            publisher.publish(tick.wrench);
            last = allocations_of_this_thread();
            first.get_or_insert(last);
        };
        let step = |state: &DeviceState, _: f64| {
            let depth = (-state.pose.translation.x).max(0.0);
            StepOutcome::of(Wrench { force: DVec3::X * 400.0 * depth, torque: DVec3::ZERO })
        };
        let stop = AtomicBool::new(false);
        let run = servo.run(&mut device, step, &mut observer, &stop);
        assert_eq!(last - first.expect("there is a tick"), 0, "{timing:?}");
        assert!(newest.get().is_finite());
        assert!(run.ticks >= 50 && run.force_max > 0.0 || timing == Timing::RealTime);
        let summary = recording.finish();
        assert_eq!(summary.written + summary.dropped, run.ticks);
    }
}
