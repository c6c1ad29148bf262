//! Tests of the Force Dimension driver with a stand-in for its library.

mod stand_in;

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::Wrench;
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    Cut, DeviceError, DeviceState, HapticDevice, RunEnd, SelfTestError, Servo, ServoOptions, ServoTick, StepOutcome,
    WallTime, self_test,
};
use palpus_drivers::{DriverError, ForceDimension, ForceDimensionOptions, Place};
use stand_in::{StandIn, build, keys::*};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Return value of the stand-in's `dhdOpen`.
const ID: f64 = 3.0;

fn ready() -> StandIn {
    let stand_in = StandIn::dhd();
    stand_in.set(DEVICES, 1.0).set(POWERED, 1.0).set(OUT_OF_RESET, 1.0).set(X, 0.01).set(MOVING, 1.0);
    stand_in
}

fn open(stand_in: &StandIn) -> Result<ForceDimension, DriverError> {
    ForceDimension::open(&ForceDimensionOptions {
        library: Place::File(stand_in.path()),
        simulator: false,
        which: None,
    })
}

fn push(force: DVec3) -> Wrench {
    Wrench { torque: DVec3::new(0.01, 0.02, 0.03), force }
}

#[test]
fn state_and_wrench_are_in_our_axes() {
    let stand_in = ready();
    stand_in.set(ACTIVE_WRIST, 1.0).set(BUTTONS, 5.0);
    let mut device = open(&stand_in).unwrap();
    assert_eq!(device.spec().name, "sigma.7");
    assert_eq!((device.spec().force_max, device.spec().torque_max), (12.0, 0.2));
    assert_eq!((stand_in.get(WINDOW), stand_in.get(WATCHDOG)), (4.0, 160.0));
    assert!(device.has_watchdog());
    assert_eq!(device.rate_hz(), 4000.0);
    // There is no force before the first write.
    let state = device.read().unwrap();
    assert_eq!(stand_in.get(ENABLED), 0.0);
    assert_eq!(state.pose.translation, DVec3::new(0.02, -0.01, 0.03));
    assert!(state.pose.rotation.angle_between(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) < 1e-7);
    assert_eq!((state.twist.linear, state.twist.angular), (DVec3::new(0.2, -0.1, 0.3), DVec3::new(2.0, -1.0, 3.0)));
    assert_eq!(state.buttons, 5);
    device.write(&push(DVec3::new(1.0, 2.0, 3.0))).unwrap();
    assert_eq!(stand_in.get(ENABLED), 1.0);
    assert_eq!(stand_in.three(FORCE), [-2.0, 1.0, 3.0]);
    assert_eq!(stand_in.three(TORQUE), [-0.02, 0.01, 0.03]);
    assert_eq!((stand_in.get(LAST_ID), stand_in.get(GRIPPER)), (ID, 0.0));
    drop(device);
    assert_eq!(stand_in.three(FORCE), [0.0; 3]);
    assert_eq!((stand_in.get(ENABLED), stand_in.get(CLOSED)), (0.0, 1.0));
}

#[test]
fn passive_wrist_gets_no_torque() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    assert_eq!(device.spec().name, "omega.6");
    assert_eq!((device.spec().torque_max, device.spec().actuated.rotation, device.spec().sensed.rotation), (0.0, 0, 3));
    device.write(&push(DVec3::X)).unwrap();
    assert_eq!(stand_in.three(TORQUE), [0.0; 3]);
}

#[test]
fn saturation_is_counted_and_repeated_samples_keep_time() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    stand_in.set(WRITE_CODE, 2.0);
    for _ in 0..3 {
        device.write(&push(DVec3::X)).unwrap();
    }
    assert_eq!(device.saturated(), 3);
    stand_in.set(WRITE_CODE, 1.0);
    device.write(&push(DVec3::X)).unwrap();
    assert_eq!(device.saturated(), 3);
    let first = device.read().unwrap();
    stand_in.set(READ_CODE, 1.0);
    assert_eq!(device.read().unwrap().time, first.time);
    stand_in.set(READ_CODE, 0.0);
    assert!(device.read().unwrap().time > first.time);
}

#[test]
fn errors_contain_the_librarys_text() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.read().unwrap();
    stand_in.set(READ_CODE, -1.0);
    let Err(DeviceError::Lost(why)) = device.read() else { panic!("the read must fail") };
    assert!(why.contains("fails on request") && why.contains("cable"), "{why}");
    stand_in.set(WRITE_CODE, -1.0);
    let Err(DeviceError::Refused(why)) = device.write(&push(DVec3::X)) else { panic!("the write must fail") };
    assert!(why.contains("fails on request"), "{why}");
    drop(device);
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0; 3], 0.0));
}

#[test]
fn non_finite_wrench_never_reaches_the_library() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    assert!(matches!(device.write(&push(DVec3::NAN)), Err(DeviceError::Refused(_))));
    assert_eq!(stand_in.get(WRITES), 0.0);
}

#[test]
fn unusable_device_is_rejected_with_advice() {
    type Prepare = fn(&StandIn);
    let cases: [(&str, Prepare); 4] = [
        ("sees no device", |s| _ = s.set(DEVICES, 0.0)),
        ("could not be opened", |s| _ = s.set(OPEN_CODE, -1.0)),
        ("no power", |s| _ = s.set(POWERED, 0.0)),
        ("not calibrated", |s| _ = s.set(OUT_OF_RESET, 0.0)),
    ];
    for (words, prepare) in cases {
        let stand_in = ready();
        prepare(&stand_in);
        let error = open(&stand_in).map(drop).unwrap_err();
        assert!(matches!(error, DriverError::NoDevice { .. }) && error.why().contains(words), "{error}");
        assert!(!error.mend().is_empty() && !error.why().contains(error.mend()));
        assert_eq!((stand_in.get(WRITES), stand_in.get(ENABLED)), (0.0, 0.0), "{words}");
    }
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    stand_in.set(ENABLE_CODE, -1.0);
    assert!(matches!(device.write(&push(DVec3::X)), Err(DeviceError::Refused(_))));
}

#[test]
fn watchdog_is_set_even_in_expert_mode_only() {
    let stand_in = ready();
    stand_in.set(EXPERT_ONLY, 1.0);
    assert!(open(&stand_in).unwrap().has_watchdog());
    assert_eq!((stand_in.get(WATCHDOG), stand_in.get(EXPERT)), (160.0, 0.0));
}

#[test]
fn missing_velocities_are_estimated() {
    let stand_in = ready();
    stand_in.set(NO_VELOCITY, 1.0);
    let mut device = open(&stand_in).unwrap();
    let mut state = device.read().unwrap();
    assert_eq!(state.twist.linear, DVec3::ZERO);
    let begun = state.time;
    // The motion is along the maker's x, which is opposite to our y, at about 0.2 m/s.
    let mut fastest = DVec3::ZERO;
    for _ in 0..60 {
        std::thread::sleep(Duration::from_millis(1));
        stand_in.set(X, 0.01 + 0.2 * (state.time - begun));
        state = device.read().unwrap();
        fastest = fastest.min(state.twist.linear);
    }
    assert!(fastest.y < -0.02 && fastest.x.abs() < 1e-9, "{fastest}");
    // An invalid pose affects only its own velocity.
    stand_in.set(X, f64::NAN);
    assert!(!device.read().unwrap().pose.is_valid());
    stand_in.set(X, 0.01);
    device.read().unwrap();
    let state = device.read().unwrap();
    assert!(state.pose.is_valid() && state.twist.linear.is_finite() && state.twist.angular.is_finite());
}

#[test]
fn brake_switches_the_force_off_and_on() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.write(&push(DVec3::X)).unwrap();
    let brake = device.brake().unwrap();
    std::thread::scope(|scope| scope.spawn(|| brake.apply()).join().unwrap());
    assert!(brake.is_applied());
    assert_eq!(stand_in.get(ENABLED), 0.0);
    device.write(&push(DVec3::X)).unwrap();
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0; 3], 0.0));
    brake.release();
    device.write(&push(DVec3::X)).unwrap();
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0, 1.0, 0.0], 1.0));
    // After the device is closed, the brake does nothing.
    drop(device);
    brake.release();
    assert_eq!(stand_in.get(ENABLED), 0.0);
}

#[test]
fn brake_does_not_wait_for_a_hanging_call() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.write(&push(DVec3::X)).unwrap();
    let brake = device.brake().unwrap();
    stand_in.set(HANG_READ_MS, 300.0);
    std::thread::scope(|scope| {
        let reads = stand_in.get(READS);
        let reading = scope.spawn(|| device.read().map(drop));
        assert!(stand_in.comes_to(|s| s.get(READS) > reads));
        brake.apply();
        // `apply` has returned while the read hangs. The brake takes effect as soon as the read
        // ends.
        assert_eq!(stand_in.get(ENABLED), 1.0);
        reading.join().unwrap().unwrap();
    });
    assert_eq!(stand_in.get(ENABLED), 0.0);
}

#[test]
fn force_returns_from_zero_after_a_pause() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.write(&push(DVec3::X)).unwrap();
    // The device's watchdog has switched off the force.
    stand_in.set(ENABLED, 0.0).set(OFF_CAUSE, 3.0);
    std::thread::sleep(Duration::from_millis(25));
    device.write(&push(DVec3::X)).unwrap();
    assert_eq!((stand_in.get(ENABLED), stand_in.three(FORCE)), (1.0, [0.0; 3]));
    assert!(device.read().unwrap().withheld, "the loop must know that there was no force");
    device.write(&push(DVec3::X)).unwrap();
    assert!(stand_in.three(FORCE) != [0.0; 3] && !device.read().unwrap().withheld);
}

#[test]
fn self_test_passes_or_rejects_the_device() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let passed = self_test(&mut device, &WallTime::new()).unwrap();
    assert_eq!(passed.own_watchdog, Some(Duration::from_millis(20)));
    assert!(passed.brake && !passed.withheld && stand_in.get(LARGEST) == 0.0, "{passed}");
    stand_in.set(WATCHDOG_SLEEPS, 1.0);
    let failed = self_test(&mut device, &WallTime::new()).unwrap_err();
    assert!(matches!(failed, SelfTestError::OwnWatchdog(_)), "{failed}");
    // A device that the user has switched off passes, with a note.
    stand_in.set(WATCHDOG_SLEEPS, 0.0).set(SWITCHED_OFF, 1.0);
    let mut device = open(&stand_in).unwrap();
    assert!(self_test(&mut device, &WallTime::new()).unwrap().withheld);
    assert_eq!(stand_in.get(OVERRIDDEN), 0.0);
}

#[test]
fn library_gets_the_limits_of_force_and_torque() {
    let stand_in = ready();
    stand_in.set(ACTIVE_WRIST, 1.0);
    let device = open(&stand_in).unwrap();
    assert_eq!((stand_in.get(MAX_FORCE), stand_in.get(MAX_TORQUE)), (12.0, 0.2));
    assert!(device.is_limited());
}

/// Writes and reads until `until` is true, for at most a thousand ticks. Returns true if `until`
/// became true.
fn ticks(device: &mut ForceDimension, until: impl Fn(&DeviceState) -> bool) -> bool {
    (0..1000).any(|_| {
        device.write(&push(DVec3::X)).unwrap();
        until(&device.read().unwrap())
    })
}

#[test]
fn force_switched_off_by_a_person_stays_off() {
    // The causes are the button, too fast a motion, and the dead-man's switch.
    for by in [1.0, 2.0, 6.0] {
        let stand_in = ready();
        let mut device = open(&stand_in).unwrap();
        let brake = device.brake().unwrap();
        assert!(!ticks(&mut device, |state| state.withheld));
        stand_in.set(SWITCHED_OFF, by);
        assert!(ticks(&mut device, |state| state.withheld));
        // Neither a pause nor the release of a brake switches the force on.
        std::thread::sleep(Duration::from_millis(25));
        assert!(!ticks(&mut device, |state| !state.withheld));
        brake.apply();
        brake.release();
        assert!(!ticks(&mut device, |state| !state.withheld));
        assert_eq!((stand_in.get(OVERRIDDEN), stand_in.three(FORCE)), (0.0, [0.0; 3]), "cause {by}");
        // The person switches the force on.
        stand_in.set(SWITCHED_OFF, 0.0).set(ENABLED, 1.0);
        assert!(ticks(&mut device, |state| !state.withheld));
        assert!(ticks(&mut device, |_| stand_in.three(FORCE) != [0.0; 3]));
    }
}

#[test]
fn force_switched_off_at_start_stays_off() {
    let stand_in = ready();
    stand_in.set(SWITCHED_OFF, 1.0);
    let mut device = open(&stand_in).unwrap();
    device.write(&push(DVec3::X)).unwrap();
    assert!(device.read().unwrap().withheld);
    assert!(!ticks(&mut device, |state| !state.withheld));
    assert_eq!((stand_in.get(OVERRIDDEN), stand_in.get(ENABLED), stand_in.get(LARGEST)), (0.0, 0.0, 0.0));
    stand_in.set(SWITCHED_OFF, 0.0).set(ENABLED, 1.0);
    assert!(ticks(&mut device, |state| !state.withheld));
    drop(device);
    assert_eq!(stand_in.get(ENABLED), 0.0);
}

#[test]
fn panic_leaves_no_force() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
        device.write(&push(DVec3::X)).unwrap();
        panic!("panics on purpose");
    }));
    assert!(panicked.is_err());
    assert_eq!((stand_in.get(LARGEST), stand_in.three(FORCE), stand_in.get(ENABLED)), (1.0, [0.0; 3], 0.0));
}

#[test]
fn tick_does_not_allocate() {
    let stand_in = ready();
    let mut device = open(&stand_in).unwrap();
    device.read().unwrap();
    device.write(&push(DVec3::X)).unwrap();
    let before = allocations_of_this_thread();
    for _ in 0..100 {
        let _ = std::hint::black_box(device.read());
        let _ = std::hint::black_box(device.write(&Wrench::ZERO));
    }
    assert_eq!(allocations_of_this_thread() - before, 0);
}

#[test]
fn simulator_is_enabled_on_request() {
    let stand_in = ready();
    stand_in.set(DEVICES, 0.0);
    let options = ForceDimensionOptions { library: Place::File(stand_in.path()), simulator: true, which: None };
    assert!(ForceDimension::open(&options).is_ok());
    assert_eq!(stand_in.get(SIMULATOR), 1.0);
}

#[test]
fn missing_or_wrong_library_gives_an_error() {
    let of = |path: &str| {
        ForceDimension::open(&ForceDimensionOptions {
            library: Place::File(path.into()),
            simulator: false,
            which: None,
        })
    };
    let missing = of("no/such/library.so").map(drop).unwrap_err();
    assert!(matches!(&missing, DriverError::LibraryMissing { looked_for, .. } if looked_for == "no/such/library.so"));
    let broken = of(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).map(drop).unwrap_err();
    assert!(matches!(broken, DriverError::LibraryBroken { .. }), "{broken}");
    let other = build("nothing");
    let error = of(other.to_str().unwrap()).map(drop).unwrap_err();
    assert!(matches!(error, DriverError::SymbolMissing { symbol: "dhdOpen", .. }), "{error}");
    assert!(error.to_string().contains("`dhdOpen`") && error.to_string().contains("install"), "{error}");
}

/// Runs the servo loop in real time with a force of 0.5 N. Calls `at` after each tick.
fn run(device: &mut ForceDimension, seconds: f64, at: impl Fn(&ServoTick)) -> RunEnd {
    let options = ServoOptions { duration: Some(seconds), ..ServoOptions::default() };
    let step = |_: &DeviceState, _: f64| StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::X * 0.5 });
    let mut observer = |tick: &ServoTick, _: &()| at(tick);
    let stop = AtomicBool::new(false);
    Servo::new(options).unwrap().run(device, step, &mut observer, &stop).end
}

#[test]
fn servo_loop_ends_with_zero_force() {
    let stand_in = ready();
    stand_in.set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    assert_eq!(run(&mut device, 0.6, |_| {}), RunEnd::Duration);
    assert!(stand_in.get(LARGEST) > 0.0, "there must be a force during the run");
    assert_eq!(stand_in.three(FORCE), [0.0; 3]);
}

#[test]
fn force_rises_gradually_after_switching_on() {
    let stand_in = ready();
    stand_in.set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let (off, on) = (700, 800);
    // The force rises to 4 N within 0.1 s, long after the ramp of the engagement.
    let mut tick = 0u32;
    let step = |_: &DeviceState, _: f64| {
        tick += 1;
        let newtons = 0.04 * f64::from(tick.saturating_sub(400).min(100));
        StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::X * newtons })
    };
    let mut forces = Vec::new();
    let mut observer = |tick: &ServoTick, _: &()| {
        match tick.index {
            at if at == off => _ = stand_in.set(SWITCHED_OFF, 1.0),
            at if at == on => _ = stand_in.set(SWITCHED_OFF, 0.0).set(ENABLED, 1.0),
            _ => {}
        }
        forces.push((tick.index, tick.wrench.force.x));
    };
    let options = ServoOptions { duration: Some(1.2), ..ServoOptions::default() };
    let run = Servo::new(options).unwrap().run(&mut device, step, &mut observer, &AtomicBool::new(false));
    assert!(run.safety.ticks(Cut::Withheld) >= 50, "{:?}", run.safety);
    assert_eq!(stand_in.get(OVERRIDDEN), 0.0);
    // The force may rise from zero to the omega's 12 N in 50 ms at the fastest.
    let most = 12.0 / 50.0 * (1.0 + 1e-9);
    for pair in forces.windows(2).filter(|pair| pair[0].0 > off) {
        let [(_, last), (at, force)] = pair else { continue };
        assert!(force - last <= most, "tick {at}: from {last} to {force} N");
    }
}

#[test]
fn pulled_cable_ends_the_run_without_force() {
    let stand_in = ready();
    stand_in.set(MOVING, 0.0);
    let mut device = open(&stand_in).unwrap();
    let end = run(&mut device, 5.0, |tick| {
        if tick.index == 400 {
            stand_in.set(READ_CODE, -1.0);
        }
    });
    assert!(matches!(end, RunEnd::DeviceFailed(DeviceError::Lost(_))), "{end:?}");
    // Zero was written, and the motors are off.
    assert_eq!((stand_in.three(FORCE), stand_in.get(ENABLED)), ([0.0; 3], 0.0));
}

#[test]
fn two_devices_are_selected_by_number() {
    let stand_in = ready();
    stand_in.set(DEVICES, 2.0);
    let open = |which| {
        let library = Place::File(stand_in.path());
        ForceDimension::open(&ForceDimensionOptions { library, simulator: false, which: Some(which) })
    };
    let (first, second) = (open(0).unwrap(), open(1).unwrap());
    let none = open(2).err().expect("there are only two devices").to_string();
    assert!(none.contains("number 3") && none.contains("sees 2"), "{none}");
    drop(second);
    let closed = stand_in.get(LAST_ID);
    drop(first);
    assert_eq!((closed, stand_in.get(LAST_ID)), (4.0, 3.0));
}
