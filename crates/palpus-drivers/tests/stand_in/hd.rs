// A stand-in for OpenHaptics' libHD. The stand-in exports the same names, and has a thread that
// calls back a thousand times per second.

#![allow(non_snake_case)]

use std::collections::VecDeque;
use std::ffi::{CStr, c_char, c_int, c_uint, c_ulong, c_ushort, c_void};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;
use std::time::Duration;

include!("slots.rs");

#[repr(C)]
pub struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    handle: c_uint,
}

type Callback = extern "C" fn(*mut c_void) -> c_uint;

struct Job(Callback, *mut c_void);
// SAFETY: the caller's callback must allow that its data are used from another thread.
unsafe impl Send for Job {}

static ERRORS: Mutex<VecDeque<c_uint>> = Mutex::new(VecDeque::new());
/// The functions that the thread calls, with their numbers.
static JOBS: Mutex<Vec<(c_ulong, Job)>> = Mutex::new(Vec::new());
/// The current device of the whole process. The maker's manual may also mean one per thread; one
/// per process is the stricter reading.
static CURRENT: AtomicU64 = AtomicU64::new(0);
/// Handle of the device with the name `Second`.
const SECOND_HANDLE: c_uint = 8;
static THREAD: Mutex<Option<JoinHandle<()>>> = Mutex::new(None);
static STOP: AtomicBool = AtomicBool::new(false);
static IN_FRAME: AtomicBool = AtomicBool::new(false);

fn is_second() -> bool {
    CURRENT.load(Ordering::SeqCst) == u64::from(SECOND_HANDLE)
}

fn fail(code: c_uint) {
    ERRORS.lock().unwrap().push_back(code);
}

/// # Safety
/// `name` is null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdInitDevice(name: *const c_char) -> c_uint {
    count(NAME_TRIES);
    let error = get(INIT_ERROR) as c_uint;
    if error != 0 {
        fail(error);
        return 0xffff_ffff;
    }
    let named = !name.is_null() && unsafe { CStr::from_ptr(name) } == c"Default PHANToM";
    if get(DEVICES) >= 2.0 && !name.is_null() && unsafe { CStr::from_ptr(name) } == c"Second" {
        return SECOND_HANDLE;
    }
    if get(DEVICES) < 1.0 || (get(FAIL_NULL_NAME) > 0.0 && !named) {
        fail(0x0300);
        return 0xffff_ffff;
    }
    7
}

#[unsafe(no_mangle)]
pub extern "C" fn hdDisableDevice(handle: c_uint) {
    set(LAST_ID, f64::from(handle));
    count(CLOSED);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdMakeCurrentDevice(handle: c_uint) {
    CURRENT.store(u64::from(handle), Ordering::SeqCst);
    set(LAST_ID, f64::from(handle));
}

#[unsafe(no_mangle)]
pub extern "C" fn hdBeginFrame(_: c_uint) {
    IN_FRAME.store(true, Ordering::SeqCst);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdEndFrame(_: c_uint) {
    IN_FRAME.store(false, Ordering::SeqCst);
    let error = get(FRAME_ERROR) as c_uint;
    if error != 0 {
        fail(error);
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdEnable(capability: c_uint) {
    if capability == 0x4000 {
        set(ENABLED, 1.0);
    }
    if let Some(bit) = [0x4001, 0x4002, 0x4003, 0x2606, 0x2607].iter().position(|known| *known == capability) {
        set(CAPABILITIES, f64::from(get(CAPABILITIES) as u32 | 1 << bit));
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdDisable(capability: c_uint) {
    if capability == 0x4000 {
        set(ENABLED, 0.0);
    }
}

/// # Safety
/// The buffer is large enough.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetDoublev(parameter: c_uint, values: *mut f64) {
    let write = |numbers: &[f64]| {
        for (k, number) in numbers.iter().enumerate() {
            unsafe { *values.add(k) = *number };
        }
    };
    match parameter {
        0x2050 | 0x2051 => write(&[100.0, 200.0, 300.0].map(|v| v * get(MOVING))),
        0x2052 => {
            if !IN_FRAME.load(Ordering::SeqCst) {
                count(OUT_OF_FRAME);
            }
            let x = if is_second() { get(X) + 500.0 } else { get(X) };
            // A quarter turn about the maker's y, column by column.
            write(&[0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, x, 20.0, 30.0, 1.0]);
        }
        0x2603 => write(&[get(STATED_FORCE)]),
        0x2604 => write(&[0.5]),
        0x2622 => write(&[188.0]),
        0x2623 => write(&[48.0]),
        0x2551 => write(&[-80.0, -60.0, -35.0, 80.0, 60.0, 35.0]),
        _ => fail(0x0100),
    }
}

/// # Safety
/// The buffer is large enough.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetIntegerv(parameter: c_uint, values: *mut c_int) {
    unsafe {
        *values = match parameter {
            0x2000 => get(BUTTONS) as c_int,
            0x2554 => get(DOF) as c_int,
            0x2555 => get(CALIBRATION_STYLES) as c_int,
            _ => 0,
        }
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetString(_: c_uint) -> *const c_char {
    if get(DOF) >= 6.0 { c"PHANTOM Premium 6DOF 1.5".as_ptr() } else { c"Touch".as_ptr() }
}

/// # Safety
/// `values` points to three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdSetDoublev(parameter: c_uint, values: *const f64) {
    if !IN_FRAME.load(Ordering::SeqCst) {
        count(OUT_OF_FRAME);
    }
    let slot = match (parameter, is_second()) {
        (0x2700, true) => SECOND_FORCE,
        (0x2700, false) => FORCE,
        _ => TORQUE,
    };
    for k in 0..3 {
        let value = unsafe { *values.add(k) };
        set(slot + k, value);
        set(LARGEST, get(LARGEST).max(value.abs()));
        if get(CLOSED) > 0.0 && value != 0.0 {
            count(NONZERO_AFTER_CLOSE);
        }
    }
    count(WRITES);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetError() -> ErrorInfo {
    ErrorInfo { code: ERRORS.lock().unwrap().pop_front().unwrap_or(0), internal: -11, handle: 7 }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStartScheduler() {
    if get(SCHEDULER_DEAD) > 0.0 {
        return;
    }
    set(RUNNING, 1.0);
    STOP.store(false, Ordering::SeqCst);
    let turn = || {
        while !STOP.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_micros(900));
            if get(SCHEDULER_DEAD) > 0.0 {
                continue;
            }
            JOBS.lock().unwrap().retain(|(_, Job(callback, data))| {
                count(TURNS);
                callback(*data) != 0
            });
        }
    };
    *THREAD.lock().unwrap() = Some(std::thread::spawn(turn));
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStopScheduler() {
    STOP.store(true, Ordering::SeqCst);
    if let Some(thread) = THREAD.lock().unwrap().take() {
        thread.join().unwrap();
    }
    set(RUNNING, 0.0);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdScheduleAsynchronous(callback: Callback, data: *mut c_void, _: c_ushort) -> c_ulong {
    let mut jobs = JOBS.lock().unwrap();
    let number = jobs.last().map_or(42, |(number, _)| number + 1);
    jobs.push((number, Job(callback, data)));
    number
}

#[unsafe(no_mangle)]
pub extern "C" fn hdUnschedule(handle: c_ulong) {
    assert!(handle >= 42);
    count(UNSCHEDULED);
    JOBS.lock().unwrap().retain(|(number, _)| *number != handle);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdCheckCalibration() -> c_uint {
    if get(CALIBRATION) > 0.0 {
        get(CALIBRATION) as c_uint
    } else if get(OUT_OF_RESET) < 1.0 {
        0x5002
    } else {
        0x5000
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdUpdateCalibration(style: c_uint) {
    set(CALIBRATED, f64::from(style));
    if get(CALIBRATION_TRIES) == 1.0 {
        set(CALIBRATION, 0.0);
    }
    set(CALIBRATION_TRIES, get(CALIBRATION_TRIES) - 1.0);
}
