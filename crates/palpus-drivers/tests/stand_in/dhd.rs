// A stand-in for Force Dimension's libdhd. The stand-in exports the same names, and stores numbers
// instead of moving motors.

#![allow(non_snake_case)]

use std::ffi::{c_char, c_int, c_uchar, c_uint};

include!("slots.rs");

/// Time of the last write of a force.
static WRITTEN: std::sync::Mutex<Option<std::time::Instant>> = std::sync::Mutex::new(None);

fn of(id: c_char) {
    set(LAST_ID, f64::from(id));
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetDeviceCount() -> c_int {
    get(DEVICES) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdOpen() -> c_int {
    if get(OPEN_CODE) < 0.0 { -1 } else { 3 }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdOpenID(which: c_char) -> c_int {
    if f64::from(which) < get(DEVICES) { 3 + c_int::from(which) } else { -1 }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdClose(id: c_char) -> c_int {
    of(id);
    count(CLOSED);
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdErrorGetLastStr() -> *const c_char {
    c"the stand-in fails on request".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetSystemName(_: c_char) -> *const c_char {
    if get(ACTIVE_WRIST) > 0.0 { c"sigma.7 right".as_ptr() } else { c"omega.6".as_ptr() }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdHasActiveWrist(_: c_char) -> bool {
    get(ACTIVE_WRIST) > 0.0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableForce(on: c_uchar, id: c_char) -> c_int {
    of(id);
    if get(ENABLE_CODE) < 0.0 {
        return -1;
    }
    if get(SWITCHED_OFF) > 0.0 {
        // After this call the status no longer states the earlier cause.
        count(OVERRIDDEN);
        set(SWITCHED_OFF, 0.0);
    }
    set(ENABLED, f64::from(on));
    set(OFF_CAUSE, 4.0);
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdSetMaxForce(newtons: f64, _: c_char) -> c_int {
    set(MAX_FORCE, newtons);
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdSetMaxTorque(newton_metres: f64, _: c_char) -> c_int {
    set(MAX_TORQUE, newton_metres);
    0
}

/// # Safety
/// The pointers are valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetPositionAndOrientationFrame(
    x: *mut f64,
    y: *mut f64,
    z: *mut f64,
    frame: *mut [[f64; 3]; 3],
    id: c_char,
) -> c_int {
    of(id);
    count(READS);
    let hang = get(HANG_READ_MS);
    if hang > 0.0 {
        std::thread::sleep(std::time::Duration::from_secs_f64(hang * 1e-3));
    }
    unsafe {
        (*x, *y, *z) = (get(X), 0.02, 0.03);
        // A quarter turn about the maker's z.
        *frame = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    }
    get(READ_CODE) as c_int
}

/// # Safety
/// The pointers are valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetLinearVelocity(x: *mut f64, y: *mut f64, z: *mut f64, _: c_char) -> c_int {
    unsafe { (*x, *y, *z) = (0.1 * get(MOVING), 0.2 * get(MOVING), 0.3 * get(MOVING)) };
    if get(NO_VELOCITY) > 0.0 { -1 } else { 0 }
}

/// # Safety
/// The pointers are valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetAngularVelocityRad(x: *mut f64, y: *mut f64, z: *mut f64, _: c_char) -> c_int {
    unsafe { (*x, *y, *z) = (get(MOVING), 2.0 * get(MOVING), 3.0 * get(MOVING)) };
    if get(NO_VELOCITY) > 0.0 { -1 } else { 0 }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdConfigLinearVelocity(ms: c_int, _: c_int, _: c_char) -> c_int {
    set(WINDOW, f64::from(ms));
    0
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments, reason = "the maker's signature")]
pub extern "C" fn dhdSetForceAndTorqueAndGripperForce(
    fx: f64,
    fy: f64,
    fz: f64,
    tx: f64,
    ty: f64,
    tz: f64,
    fg: f64,
    id: c_char,
) -> c_int {
    of(id);
    count(WRITES);
    *WRITTEN.lock().unwrap() = Some(std::time::Instant::now());
    for (k, value) in [fx, fy, fz, tx, ty, tz].into_iter().enumerate() {
        set(FORCE + k, value);
        set(LARGEST, get(LARGEST).max(value.abs()));
    }
    set(GRIPPER, fg);
    get(WRITE_CODE) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetButtonMask(_: c_char) -> c_uint {
    get(BUTTONS) as c_uint
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableExpertMode() -> c_int {
    set(EXPERT, 1.0);
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdDisableExpertMode() -> c_int {
    set(EXPERT, 0.0);
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdSetWatchdog(steps: c_uchar, _: c_char) -> c_int {
    if get(EXPERT_ONLY) > 0.0 && get(EXPERT) < 1.0 {
        return -1;
    }
    set(WATCHDOG, f64::from(steps));
    0
}

/// # Safety
/// The buffer has room for 17 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetStatus(status: *mut c_int, _: c_char) -> c_int {
    // The watchdog acts when the status is read, if nothing was written within its time.
    let is_late = WRITTEN.lock().unwrap().is_some_and(|last| last.elapsed().as_micros() as f64 > 125.0 * get(WATCHDOG));
    if get(ENABLED) > 0.0 && get(WATCHDOG) > 0.0 && get(WATCHDOG_SLEEPS) < 1.0 && is_late {
        set(ENABLED, 0.0);
        set(OFF_CAUSE, 3.0);
    }
    // The words are: power, connected, started, reset, …
    let force = i32::from(get(ENABLED) > 0.0 && get(SWITCHED_OFF) < 1.0);
    let cause = if get(SWITCHED_OFF) > 0.0 { get(SWITCHED_OFF) } else { get(OFF_CAUSE) } as c_int;
    let cause = if force > 0 { 0 } else { cause };
    let reset = i32::from(get(OUT_OF_RESET) < 1.0);
    let words = [get(POWERED) as c_int, 1, 1, reset, 0, force, 0, 0, 1, 0, 0, 0, 1, 0, cause, 0, 0];
    for (k, word) in words.into_iter().enumerate() {
        unsafe { *status.add(k) = word };
    }
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetComFreq(_: c_char) -> f64 {
    4.0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableSimulator(on: bool) {
    set(SIMULATOR, f64::from(u8::from(on)));
}
