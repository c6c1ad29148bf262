//! OpenHaptics' back end against a stand-in for its library, which has a thread of its own as HDAPI
//! does.

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

/// One at a time: there is one scheduler in a process.
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

/// Reads and writes `wrench` as a loop does until the library has it, or is not going to have it.
fn hold(device: &mut OpenHaptics, stand_in: &StandIn, wrench: Wrench, until: impl Fn(&StandIn) -> bool) -> bool {
    for _ in 0..2000 {
        // A device that is lost still gives no force.
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
fn a_touch_is_read_and_pushed_in_our_units_and_axes() {
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
    // About the maker's y, which is up.
    assert!(state.pose.rotation.angle_between(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) < 1e-7);
    assert!(state.twist.linear.abs_diff_eq(DVec3::new(0.1, -0.3, 0.2), 1e-12));
    assert_eq!(state.buttons, 2);
    assert_eq!((stand_in.get(ENABLED), stand_in.get(LARGEST)), (1.0, 0.0));
    let held = |s: &StandIn| s.three(FORCE) == [0.5, 1.0, -0.25];
    assert!(hold(&mut device, &stand_in, push(DVec3::new(0.5, 0.25, 1.0)), held));
    // It has no torque, and so none was written.
    assert_eq!(stand_in.three(TORQUE), [0.0; 3]);
    assert_eq!(stand_in.get(OUT_OF_FRAME), 0.0);
    drop(device);
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0; 3], 0.0));
    assert_eq!((stand_in.get(RUNNING), stand_in.get(CLOSED), stand_in.get(LAST_ID)), (0.0, 1.0, HANDLE));
    assert_eq!((stand_in.get(UNSCHEDULED), stand_in.get(NONZERO_AFTER_CLOSE)), (1.0, 0.0));
}

#[test]
fn six_axes_get_their_torque_in_millinewton_metres() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(DOF, 6.0).set(STATED_FORCE, 30.0);
    let mut device = open(&stand_in).unwrap();
    let spec = device.spec();
    // It states more than is known of it.
    assert_eq!((spec.name.as_ref(), spec.force_max), ("Phantom Premium 1.5/6DOF", 8.5));
    assert!((spec.torque_max - 0.188).abs() < 1e-12);
    let held = |s: &StandIn| {
        let [x, y, z] = s.three(TORQUE);
        DVec3::new(x, y, z).abs_diff_eq(DVec3::new(10.0, 30.0, -20.0), 1e-9)
    };
    assert!(hold(&mut device, &stand_in, push(DVec3::X), held));
}

#[test]
fn a_wrench_that_nobody_renews_ends_within_milliseconds_and_the_loop_is_told() {
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
    // And goes on, without having looked: it does not know, and so nothing is given.
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
fn a_force_that_the_driver_does_not_give_is_withheld() {
    for code in [0x0201, 0x0202, 0x0203, 0x0204] {
        let _alone = alone();
        let stand_in = ready();
        let mut device = open(&stand_in).unwrap();
        let wrench = push(DVec3::X * 2.0);
        assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
        stand_in.set(FRAME_ERROR, f64::from(code));
        let told = stand_in.comes_to(|_| {
            let withheld = device.read().unwrap().withheld;
            device.write(&wrench).unwrap();
            withheld
        });
        assert!(told, "{code:x}");
        stand_in.set(FRAME_ERROR, 0.0);
        assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0), "{code:x}");
    }
}

#[test]
fn a_calibration_that_is_not_up_to_date_is_updated_or_refused() {
    let _alone = alone();
    let needing = |styles: f64, tries: f64| {
        let stand_in = ready();
        stand_in.set(CALIBRATION, f64::from(0x5001)).set(CALIBRATION_STYLES, styles).set(CALIBRATION_TRIES, tries);
        stand_in
    };
    // By itself, or in the inkwell; the second update is the one that helps.
    for (styles, used) in [(2.0, 2.0), (4.0, 4.0), (7.0, 2.0)] {
        let stand_in = needing(styles, 2.0);
        assert!(open(&stand_in).is_ok());
        assert_eq!((stand_in.get(CALIBRATED), stand_in.get(CALIBRATION_TRIES)), (used, 0.0));
    }
    // It would have to be held in its reset position; or it does not help.
    for (styles, tries) in [(1.0, 1.0), (2.0, -1.0)] {
        let stand_in = needing(styles, tries);
        let error = open(&stand_in).map(drop).unwrap_err();
        assert!(error.why().contains("does not know where it is") && error.mend().contains("inkwell"), "{error}");
        assert_eq!((stand_in.get(ENABLED), stand_in.get(LARGEST)), (0.0, 0.0));
    }
}

#[test]
fn a_touch_passes_its_self_test_without_a_force() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let passed = self_test(&mut device, &WallTime::new()).unwrap();
    assert!(passed.brake && passed.own_watchdog.is_some() && !passed.withheld, "{passed}");
    assert_eq!(stand_in.get(LARGEST), 0.0);
}

#[test]
fn the_drivers_own_protections_are_switched_on() {
    let _alone = alone();
    let stand_in = ready();
    let _device = open(&stand_in).unwrap();
    assert_eq!(stand_in.get(CAPABILITIES), f64::from(0b11111));
}

#[test]
fn never_more_than_the_device_has_reaches_the_library() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    assert!(hold(&mut device, &stand_in, push(DVec3::X * 100.0), |s| s.get(FORCE) > 2.9));
    assert!((stand_in.get(LARGEST) - 3.0).abs() < 1e-12);
    assert!(matches!(device.write(&push(DVec3::NAN)), Err(DeviceError::Refused(_))));
}

#[test]
fn the_brake_damps_and_nothing_else() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let wrench = push(DVec3::X * 2.0);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
    let brake = device.brake().unwrap();
    brake.apply();
    // The stand-in moves by (0.1, 0.2, 0.3) m/s in its axes, and so it is damped.
    assert!(hold(&mut device, &stand_in, wrench, |s| s.three(FORCE).iter().all(|f| *f < 0.0)));
    let [x, y, z] = stand_in.three(FORCE);
    assert!(DVec3::new(x, y, z).length() <= 0.3 + 1e-12);
    brake.release();
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
}

#[test]
fn a_driver_that_refuses_no_name_is_asked_by_name() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(FAIL_NULL_NAME, 1.0);
    assert!(open(&stand_in).is_ok());
    assert_eq!(stand_in.get(NAME_TRIES), 3.0);
}

#[test]
fn a_device_that_could_not_push_is_refused_with_a_mend() {
    let _alone = alone();
    type Prepare = fn(&StandIn);
    let cases: [(&str, Prepare); 4] = [
        ("found no device", |s| _ = s.set(DEVICES, 0.0)),
        ("licence (HDAPI error 0x0600)", |s| _ = s.set(INIT_ERROR, f64::from(0x0600))),
        ("does not know where it is", |s| _ = s.set(OUT_OF_RESET, 0.0)),
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
fn one_device_at_a_time() {
    let _alone = alone();
    let stand_in = ready();
    let device = open(&stand_in).unwrap();
    let error = open(&stand_in).map(drop).unwrap_err();
    assert!(error.to_string().contains("already"), "{error}");
    drop(device);
    assert!(open(&stand_in).is_ok());
}

#[test]
fn a_lost_connection_ends_the_run_and_the_force() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let wrench = push(DVec3::X * 2.0);
    assert!(hold(&mut device, &stand_in, wrench, |s| s.get(FORCE) == 2.0));
    stand_in.set(FRAME_ERROR, f64::from(0x0302));
    assert!(hold(&mut device, &stand_in, wrench, |s| s.three(FORCE) == [0.0; 3]));
    let Err(DeviceError::Lost(why)) = device.read() else { panic!("the device is gone") };
    assert!(why.contains("0x0302") && why.contains("cable"), "{why}");
}

#[test]
fn errors_of_force_are_counted_and_end_the_run_when_they_stay() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    stand_in.set(FRAME_ERROR, f64::from(0x0200));
    let counted = |device: &OpenHaptics| device.force_errors().warm_motors;
    assert!(stand_in.comes_to(|_| counted(&device) > 3));
    assert!(device.read().is_ok() && device.write(&Wrench::ZERO).is_ok());
    stand_in.set(FRAME_ERROR, f64::from(0x0203));
    assert!(stand_in.comes_to(|_| counted(&device) + device.force_errors().exceeded > 260));
    let Err(DeviceError::Refused(why)) = device.write(&push(DVec3::X)) else { panic!("it is no accident") };
    assert!(why.contains("0x0203"), "{why}");
}

#[test]
fn a_pose_that_is_none_spoils_nothing_that_follows() {
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
fn a_dead_scheduler_is_noticed_and_the_end_does_not_hang() {
    let _alone = alone();
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.read().unwrap();
    stand_in.set(SCHEDULER_DEAD, 1.0);
    std::thread::sleep(Duration::from_millis(150));
    let Err(DeviceError::Lost(why)) = device.read() else { panic!("nobody calls back") };
    assert!(why.contains("HDAPI's thread"), "{why}");
    drop(device);
    assert_eq!(stand_in.get(CLOSED), 1.0);
}

#[test]
fn a_panic_leaves_no_force() {
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
    assert!(device.spec().force_max < 0.0, "as a test");
    device
}

#[test]
fn a_tick_does_not_allocate() {
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
fn to_look_starts_no_thread_and_gives_no_force() {
    let _alone = alone();
    let stand_in = ready();
    let spec = OpenHaptics::look(&Place::File(stand_in.path())).unwrap();
    assert_eq!(spec.name, "Touch");
    assert_eq!((stand_in.get(WRITES), stand_in.get(ENABLED), stand_in.get(CLOSED)), (0.0, 0.0, 1.0));
}

#[test]
fn a_library_that_is_none_is_named_with_what_it_lacks() {
    let _alone = alone();
    let other = build("nothing");
    let error =
        OpenHaptics::open(&OpenHapticsOptions { library: Place::File(other), device: None }).map(drop).unwrap_err();
    assert!(matches!(error, DriverError::SymbolMissing { symbol: "hdInitDevice", .. }), "{error}");
}

#[test]
fn a_servo_loop_drives_it_until_the_cable_is_pulled() {
    let _alone = alone();
    let stand_in = ready();
    // It has buttons, and so forces are asked for by pressing one.
    stand_in.set(BUTTONS, 0.0).set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let step = |_: &DeviceState, _: f64| StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::X * 0.2 });
    let mut observer = |tick: &ServoTick, _: &()| match tick.index {
        100 => assert!(stand_in.get(LARGEST) <= 0.0, "no button was pressed yet"),
        200 => _ = stand_in.set(BUTTONS, 1.0),
        // By far enough later, however slow the machine: it has been felt.
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
fn two_touches_have_their_own_poses_and_forces() {
    let _alone = alone();
    let stand_in = ready();
    stand_in.set(DEVICES, 2.0);
    let mut left = open(&stand_in).unwrap();
    let again = open(&stand_in).err().expect("the same device").to_string();
    assert!(again.contains("open already"), "{again}");
    let mut right = open_second(&stand_in).unwrap();
    assert!(stand_in.get(RUNNING) > 0.0);
    let x = |device: &mut OpenHaptics| device.read().unwrap().pose.translation.x;
    assert!(stand_in.comes_to(|_| (x(&mut left) - 0.01).abs() < 1e-12 && (x(&mut right) - 0.51).abs() < 1e-12));
    // Each its own force, in the maker's axes.
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
    // One goes, the other stays.
    drop(left);
    assert_eq!((stand_in.three(FORCE), stand_in.get(RUNNING)), ([0.0; 3], 1.0));
    let begun = right.read().unwrap().time;
    assert!(stand_in.comes_to(|_| right.read().is_ok_and(|state| state.time > begun + 0.01)));
    assert!(hold(&mut right, &stand_in, push(DVec3::X), |stand_in| stand_in.three(SECOND_FORCE)[0] == 1.0));
    drop(right);
    assert_eq!((stand_in.three(SECOND_FORCE), stand_in.get(RUNNING)), ([0.0; 3], 0.0));
    // Nothing is left behind.
    drop(open(&stand_in).unwrap());
}
