//! Tests of the OpenHaptics driver with a stand-in for its library. Like HDAPI, the stand-in has a
//! thread.

mod stand_in;

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::Wrench;
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    DeviceError, DeviceState, HapticDevice, RunEnd, Servo, ServoOptions, ServoTick, StepOutcome, WallTime, self_test,
};
use palpus_drivers::{DriverError, OpenHaptics, OpenHapticsOptions, Place};
use stand_in::{StandIn, build, keys::*};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Return value of the stand-in's `hdInitDevice`.
const HANDLE: f64 = 7.0;

/// Makes tests run one at a time, because a process has only one scheduler.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn ready() -> StandIn {
    let stand_in = StandIn::hd();
    stand_in
        .set(DEVICES, 1.0)
        .set(OUT_OF_RESET, 1.0)
        .set(X, 10.0)
        .set(STATED_FORCE, 3.0)
        .set(DOF, 3.0)
        .set(MOVING, 1.0);
    stand_in
}

fn open(stand_in: &StandIn) -> Result<OpenHaptics, DriverError> {
    OpenHaptics::open(&OpenHapticsOptions { library: Place::File(stand_in.path()), device: None })
}

fn open_second(stand_in: &StandIn) -> Result<OpenHaptics, DriverError> {
    OpenHaptics::open(&OpenHapticsOptions { library: Place::File(stand_in.path()), device: Some("Second".to_owned()) })
}

fn push(force: DVec3) -> Wrench {
    Wrench { torque: DVec3::new(0.01, 0.02, 0.03), force }
}

/// Reads and writes `wrench` as a loop does, until `until` is true. Returns false if `until` never
/// becomes true.
fn hold(device: &mut OpenHaptics, stand_in: &StandIn, wrench: Wrench, until: impl Fn(&StandIn) -> bool) -> bool {
    for _ in 0..2000 {
        // The read of a lost device fails, but its force must still become zero.
        let _ = device.read();
        device.write(&wrench).unwrap();
        if until(stand_in) {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

#[test]
fn state_and_wrench_are_in_our_units_and_axes() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(BUTTONS, 2.0);
    let mut device = open(&stand_in).unwrap();
    let spec = device.spec();
    assert_eq!((spec.name.as_ref(), spec.force_max, spec.torque_max, spec.buttons), ("Touch", 3.0, 0.0, 2));
    assert_eq!(spec.force_continuous, Some(0.5));
    assert!(spec.workspace.unwrap().abs_diff_eq(DVec3::new(0.16, 0.07, 0.12), 1e-12));
    let state = device.read().unwrap();
    assert!(state.pose.translation.abs_diff_eq(DVec3::new(0.01, -0.03, 0.02), 1e-12), "{state:?}");
    // The rotation is about the maker's y, which points up.
    assert!(state.pose.rotation.angle_between(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) < 1e-7);
    assert!(state.twist.linear.abs_diff_eq(DVec3::new(0.1, -0.3, 0.2), 1e-12));
    assert_eq!(state.buttons, 2);
    assert_eq!((stand_in.get(ENABLED), stand_in.get(LARGEST)), (1.0, 0.0));
    let held = |s: &StandIn| s.three(FORCE) == [0.5, 1.0, -0.25];
    assert!(hold(&mut device, &stand_in, push(DVec3::new(0.5, 0.25, 1.0)), held));
    // The device has no torque output, so no torque was written.
    assert_eq!(stand_in.three(TORQUE), [0.0; 3]);
    assert_eq!(stand_in.get(OUT_OF_FRAME), 0.0);
    drop(device);
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0; 3], 0.0));
    assert_eq!((stand_in.get(RUNNING), stand_in.get(CLOSED), stand_in.get(LAST_ID)), (0.0, 1.0, HANDLE));
    assert_eq!((stand_in.get(UNSCHEDULED), stand_in.get(NONZERO_AFTER_CLOSE)), (1.0, 0.0));
}

#[test]
fn torque_is_sent_in_millinewton_metres() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(DOF, 6.0).set(STATED_FORCE, 30.0);
    let mut device = open(&stand_in).unwrap();
    let spec = device.spec();
    // The device states more than the known limit of its model.
    assert_eq!((spec.name.as_ref(), spec.force_max), ("Phantom Premium 1.5/6DOF", 8.5));
    assert!((spec.torque_max - 0.188).abs() < 1e-12);
    let held = |s: &StandIn| {
        let [x, y, z] = s.three(TORQUE);
        DVec3::new(x, y, z).abs_diff_eq(DVec3::new(10.0, 30.0, -20.0), 1e-9)
    };
    assert!(hold(&mut device, &stand_in, push(DVec3::X), held));
}

#[test]
fn outdated_wrench_ends_and_is_reported() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let wrench = push(DVec3::X * 2.0);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
    // The loop stalls.
    assert!(stand_in.comes_to(|s| s.get(FORCE) == 0.0));
    let turns = stand_in.get(TURNS);
    assert!(stand_in.comes_to(|s| s.get(TURNS) > turns + 10.0));
    assert_eq!(stand_in.three(FORCE), [0.0; 3]);
    // The loop continues without a read. The loop does not know of the gap, so no force is applied.
    let turns = stand_in.get(TURNS);
    while stand_in.get(TURNS) < turns + 10.0 {
        device.write(&wrench).unwrap();
        assert_eq!(stand_in.three(FORCE), [0.0; 3]);
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(device.read().unwrap().withheld);
    assert!(!device.read().unwrap().withheld);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
}

#[test]
fn force_removed_by_the_driver_is_reported() {
    for code in [0x0201, 0x0202, 0x0203, 0x0204] {
        let _alone = alone();
        let stand_in = ready();
        let mut device = open(&stand_in).unwrap();
        let wrench = push(DVec3::X * 2.0);
        assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
        stand_in.set(FRAME_ERROR, f64::from(code));
        let reported = stand_in.comes_to(|_| {
            let withheld = device.read().unwrap().withheld;
            device.write(&wrench).unwrap();
            withheld
        });
        assert!(reported, "{code:x}");
        stand_in.set(FRAME_ERROR, 0.0);
        assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0), "{code:x}");
    }
}

#[test]
fn outdated_calibration_is_updated_or_rejected() {
    let _alone = alone();
    let needing = |styles: f64, tries: f64| {
        let stand_in = ready();
        stand_in.set(CALIBRATION, f64::from(0x5001)).set(CALIBRATION_STYLES, styles).set(CALIBRATION_TRIES, tries);
        stand_in
    };
    // The calibration is automatic or in the inkwell. The second update succeeds.
    for (styles, used) in [(2.0, 2.0), (4.0, 4.0), (7.0, 2.0)] {
        let stand_in = needing(styles, 2.0);
        assert!(open(&stand_in).is_ok());
        assert_eq!((stand_in.get(CALIBRATED), stand_in.get(CALIBRATION_TRIES)), (used, 0.0));
    }
    // The arm would have to be held in its reset position, or the update does not help.
    for (styles, tries) in [(1.0, 1.0), (2.0, -1.0)] {
        let stand_in = needing(styles, tries);
        let error = open(&stand_in).map(drop).unwrap_err();
        assert!(error.why().contains("not calibrated") && error.mend().contains("inkwell"), "{error}");
        assert_eq!((stand_in.get(ENABLED), stand_in.get(LARGEST)), (0.0, 0.0));
    }
}

#[test]
fn self_test_passes_without_force() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let passed = self_test(&mut device, &WallTime::new()).unwrap();
    assert!(passed.brake && passed.own_watchdog.is_some() && !passed.withheld, "{passed}");
    assert_eq!(stand_in.get(LARGEST), 0.0);
}

#[test]
fn protections_of_the_driver_are_on() {
    let _alone = alone();
    let stand_in = ready();
    let _device = open(&stand_in).unwrap();
    assert_eq!(stand_in.get(CAPABILITIES), f64::from(0b11111));
}

#[test]
fn force_is_clamped_to_the_device_limit() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    assert!(hold(&mut device, &stand_in, push(DVec3::X * 100.0), |s| s.get(FORCE) > 2.9));
    assert!((stand_in.get(LARGEST) - 3.0).abs() < 1e-12);
    assert!(matches!(device.write(&push(DVec3::NAN)), Err(DeviceError::Refused(_))));
}

#[test]
fn brake_only_damps() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let wrench = push(DVec3::X * 2.0);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
    let brake = device.brake().unwrap();
    brake.apply();
    // The stand-in moves by (0.1, 0.2, 0.3) m/s in its axes, so the damping force is negative.
    assert!(hold(&mut device, &stand_in, wrench, |s| s.three(FORCE).iter().all(|f| *f < 0.0)));
    let [x, y, z] = stand_in.three(FORCE);
    assert!(DVec3::new(x, y, z).length() <= 0.3 + 1e-12);
    brake.release();
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
}

#[test]
fn default_names_are_tried() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(FAIL_NULL_NAME, 1.0);
    assert!(open(&stand_in).is_ok());
    assert_eq!(stand_in.get(NAME_TRIES), 3.0);
}

#[test]
fn unusable_device_is_rejected_with_advice() {
    let _alone = alone();
    type Prepare = fn(&StandIn);
    let cases: [(&str, Prepare); 4] = [
        ("found no device", |s| _ = s.set(DEVICES, 0.0)),
        ("licence (HDAPI error 0x0600)", |s| _ = s.set(INIT_ERROR, f64::from(0x0600))),
        ("not calibrated", |s| _ = s.set(OUT_OF_RESET, 0.0)),
        ("thread does not start", |s| _ = s.set(SCHEDULER_DEAD, 1.0)),
    ];
    for (words, prepare) in cases {
        let stand_in = ready();
        prepare(&stand_in);
        let error = open(&stand_in).map(drop).unwrap_err();
        assert!(error.why().contains(words) && !error.mend().is_empty(), "{error}");
        assert_eq!((stand_in.get(LARGEST), stand_in.get(ENABLED), stand_in.get(RUNNING)), (0.0, 0.0, 0.0), "{words}");
    }
}

#[test]
fn device_opens_only_once() {
    let _alone = alone();
    let stand_in = ready();
    let device = open(&stand_in).unwrap();
    let error = open(&stand_in).map(drop).unwrap_err();
    assert!(error.to_string().contains("already"), "{error}");
    drop(device);
    assert!(open(&stand_in).is_ok());
}

#[test]
fn lost_connection_ends_the_run_and_the_force() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let wrench = push(DVec3::X * 2.0);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
    stand_in.set(FRAME_ERROR, f64::from(0x0302));
    assert!(hold(&mut device, &stand_in, wrench, |s| s.three(FORCE) == [0.0; 3]));
    let Err(DeviceError::Lost(why)) = device.read() else { panic!("the read must fail") };
    assert!(why.contains("0x0302") && why.contains("cable"), "{why}");
}

#[test]
fn persistent_force_errors_end_the_run() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    stand_in.set(FRAME_ERROR, f64::from(0x0200));
    let counted = |device: &OpenHaptics| device.force_errors().warm_motors;
    assert!(stand_in.comes_to(|_| counted(&device) > 3));
    assert!(device.read().is_ok() && device.write(&Wrench::ZERO).is_ok());
    stand_in.set(FRAME_ERROR, f64::from(0x0203));
    assert!(stand_in.comes_to(|_| counted(&device) + device.force_errors().exceeded > 260));
    let Err(DeviceError::Refused(why)) = device.write(&push(DVec3::X)) else {
        panic!("the write must fail after many errors")
    };
    assert!(why.contains("0x0203"), "{why}");
}

#[test]
fn invalid_pose_does_not_affect_later_states() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    stand_in.set(X, f64::NAN);
    assert!(stand_in.comes_to(|s| s.get(TURNS) > 0.0 && !device.read().unwrap().pose.is_valid()));
    stand_in.set(X, 10.0);
    let turns = stand_in.get(TURNS);
    assert!(stand_in.comes_to(|s| s.get(TURNS) > turns + 3.0));
    let state = device.read().unwrap();
    assert!(state.pose.is_valid() && state.twist.linear.is_finite() && state.twist.angular.is_finite(), "{state:?}");
}

#[test]
fn dead_scheduler_is_noticed_without_hanging() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.read().unwrap();
    stand_in.set(SCHEDULER_DEAD, 1.0);
    std::thread::sleep(Duration::from_millis(150));
    let Err(DeviceError::Lost(why)) = device.read() else { panic!("the read must fail") };
    assert!(why.contains("HDAPI's thread"), "{why}");
    drop(device);
    assert_eq!(stand_in.get(CLOSED), 1.0);
}

#[test]
fn panic_leaves_no_force() {
    let _alone = alone();
    let stand_in = ready();
    let device = open(&stand_in).unwrap();
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        let mut device = device;
        assert!(hold(&mut device, &stand_in, push(DVec3::X), |s| s.get(FORCE) == 1.0));
        device = panic_with(device);
        drop(device);
    }));
    assert!(panicked.is_err());
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED), stand_in.get(RUNNING)), ([0.0; 3], 0.0, 0.0));
}

fn panic_with(device: OpenHaptics) -> OpenHaptics {
    assert!(device.spec().force_max < 0.0, "panics on purpose");
    device
}

#[test]
fn tick_does_not_allocate() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let before = allocations_of_this_thread();
    for _ in 0..100 {
        let _ = std::hint::black_box(device.read());
        let _ = std::hint::black_box(device.write(&push(DVec3::X)));
    }
    assert_eq!(allocations_of_this_thread() - before, 0);
}

#[test]
fn look_starts_no_thread_and_no_force() {
    let _alone = alone();
    let stand_in = ready();
    let spec = OpenHaptics::look(&Place::File(stand_in.path())).unwrap();
    assert_eq!(spec.name, "Touch");
    assert_eq!((stand_in.get(WRITES), stand_in.get(ENABLED), stand_in.get(CLOSED)), (0.0, 0.0, 1.0));
}

#[test]
fn wrong_library_gives_an_error() {
    let _alone = alone();
    let other = build("nothing");
    let error =
        OpenHaptics::open(&OpenHapticsOptions { library: Place::File(other), device: None }).map(drop).unwrap_err();
    assert!(matches!(error, DriverError::SymbolMissing { symbol: "hdInitDevice", .. }), "{error}");
}

#[test]
fn servo_loop_ends_when_the_cable_is_pulled() {
    let _alone = alone();
    let stand_in = ready();
    // The device has buttons, so the user enables forces by pressing a button.
    stand_in.set(BUTTONS, 0.0).set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let step = |_: &DeviceState, _: f64| StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::X * 0.2 });
    let mut observer = |tick: &ServoTick, _: &()| match tick.index {
        100 => assert!(stand_in.get(LARGEST) <= 0.0, "no force before a button is pressed"),
        200 => _ = stand_in.set(BUTTONS, 1.0),
        // Pulls the cable as soon as there is a force, also on a slow machine.
        _ if stand_in.get(FORCE) > 0.1 => _ = stand_in.set(FRAME_ERROR, f64::from(0x0302)),
        _ => {}
    };
    let options = ServoOptions { duration: Some(10.0), ..ServoOptions::default() };
    let stop = AtomicBool::new(false);
    let end = Servo::new(options).unwrap().run(&mut device, step, &mut observer, &stop).end;
    assert!(matches!(end, RunEnd::DeviceFailed(DeviceError::Lost(_))), "{end:?}");
    assert!(stand_in.comes_to(|s| s.three(FORCE) == [0.0; 3]));
}

#[test]
fn two_devices_have_separate_poses_and_forces() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(DEVICES, 2.0);
    let mut left = open(&stand_in).unwrap();
    let again = open(&stand_in).err().expect("the device is already open").to_string();
    assert!(again.contains("already has that device open"), "{again}");
    let mut right = open_second(&stand_in).unwrap();
    assert!(stand_in.get(RUNNING) > 0.0);
    let x = |device: &mut OpenHaptics| device.read().unwrap().pose.translation.x;
    assert!(stand_in.comes_to(|_| (x(&mut left) - 0.01).abs() < 1e-12 && (x(&mut right) - 0.51).abs() < 1e-12));
    // Each device has a different force, in the maker's axes.
    let mut both = false;
    for _ in 0..2000 {
        left.write(&push(DVec3::new(1.0, 0.0, 0.0))).unwrap();
        right.write(&push(DVec3::new(-2.0, 0.0, 0.0))).unwrap();
        both = stand_in.three(FORCE)[0] == 1.0 && stand_in.three(SECOND_FORCE)[0] == -2.0;
        if both {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(both, "{:?} {:?}", stand_in.three(FORCE), stand_in.three(SECOND_FORCE));
    // One device is closed, and the other continues.
    drop(left);
    assert_eq!((stand_in.three(FORCE), stand_in.get(RUNNING)), ([0.0; 3], 1.0));
    let begun = right.read().unwrap().time;
    assert!(stand_in.comes_to(|_| right.read().is_ok_and(|state| state.time > begun + 0.01)));
    assert!(hold(&mut right, &stand_in, push(DVec3::X), |stand_in| stand_in.three(SECOND_FORCE)[0] == 1.0));
    drop(right);
    assert_eq!((stand_in.three(SECOND_FORCE), stand_in.get(RUNNING)), ([0.0; 3], 0.0));
    // Afterwards a device can be opened again.
    drop(open(&stand_in).unwrap());
}
