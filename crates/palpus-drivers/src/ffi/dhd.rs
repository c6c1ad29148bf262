//! The functions of Force Dimension's DHD library that palpus calls.
//!
//! C has no default arguments, so every call passes the device number. In C++ the maker's header
//! fills in −1, the device that was opened last. Here, every call passes the number that `open`
//! returned.

use std::ffi::{c_char, c_int, c_uchar, c_uint};

use super::{Loaded, words};
use crate::error::DriverError;

type Number = unsafe extern "C" fn() -> c_int;
type OfDevice = unsafe extern "C" fn(c_char) -> c_int;
type Three = unsafe extern "C" fn(*mut f64, *mut f64, *mut f64, c_char) -> c_int;
type Frame = unsafe extern "C" fn(*mut f64, *mut f64, *mut f64, *mut [f64; 9], c_char) -> c_int;
type SetAll = unsafe extern "C" fn(f64, f64, f64, f64, f64, f64, f64, c_char) -> c_int;
type Configure = unsafe extern "C" fn(c_int, c_int, c_char) -> c_int;

/// Size of the status buffer: larger than the 16 or 17 integers that the SDKs write.
pub(crate) const STATUS_ROOM: usize = 32;

/// A loaded DHD library. The functions are valid as long as `_library` exists.
pub(crate) struct Dhd {
    device_count: Number,
    open: Number,
    open_id: Option<OfDevice>,
    close: OfDevice,
    last_error: unsafe extern "C" fn() -> *const c_char,
    system_name: unsafe extern "C" fn(c_char) -> *const c_char,
    has_active_wrist: unsafe extern "C" fn(c_char) -> c_uchar,
    has_wrist: Option<unsafe extern "C" fn(c_char) -> c_uchar>,
    enable_force: unsafe extern "C" fn(c_uchar, c_char) -> c_int,
    frame: Frame,
    linear_velocity: Three,
    angular_velocity: Option<Three>,
    configure_linear: Option<Configure>,
    configure_angular: Option<Configure>,
    set_all: SetAll,
    buttons: Option<unsafe extern "C" fn(c_char) -> c_uint>,
    watchdog: Option<unsafe extern "C" fn(c_uchar, c_char) -> c_int>,
    expert: Option<(Number, Number)>,
    status: unsafe extern "C" fn(*mut c_int, c_char) -> c_int,
    rate: Option<unsafe extern "C" fn(c_char) -> f64>,
    max_force: Option<unsafe extern "C" fn(f64, c_char) -> c_int>,
    max_torque: Option<unsafe extern "C" fn(f64, c_char) -> c_int>,
    simulator: Option<unsafe extern "C" fn(c_uchar)>,
    _library: Loaded,
}

impl Dhd {
    /// Looks up every function.
    ///
    /// # Errors
    /// Fails if a function is missing that is needed for force output. The error names the
    /// function.
    pub(crate) fn of(library: Loaded, mend: &str) -> Result<Self, DriverError> {
        // SAFETY: each type is the type of the function in the maker's manual, and the library is
        // stored with the functions. A C++ `bool` is read and written as a byte.
        unsafe {
            let expert = library.optional("dhdEnableExpertMode").zip(library.optional("dhdDisableExpertMode"));
            Ok(Self {
                device_count: library.function("dhdGetDeviceCount", mend)?,
                open: library.function("dhdOpen", mend)?,
                open_id: library.optional("dhdOpenID"),
                close: library.function("dhdClose", mend)?,
                last_error: library.function("dhdErrorGetLastStr", mend)?,
                system_name: library.function("dhdGetSystemName", mend)?,
                has_active_wrist: library.function("dhdHasActiveWrist", mend)?,
                has_wrist: library.optional("dhdHasWrist"),
                enable_force: library.function("dhdEnableForce", mend)?,
                frame: library.function("dhdGetPositionAndOrientationFrame", mend)?,
                linear_velocity: library.function("dhdGetLinearVelocity", mend)?,
                angular_velocity: library.optional("dhdGetAngularVelocityRad"),
                configure_linear: library.optional("dhdConfigLinearVelocity"),
                configure_angular: library.optional("dhdConfigAngularVelocity"),
                set_all: library.function("dhdSetForceAndTorqueAndGripperForce", mend)?,
                buttons: library.optional("dhdGetButtonMask"),
                watchdog: library.optional("dhdSetWatchdog"),
                expert,
                status: library.function("dhdGetStatus", mend)?,
                rate: library.optional("dhdGetComFreq"),
                max_force: library.optional("dhdSetMaxForce"),
                max_torque: library.optional("dhdSetMaxTorque"),
                simulator: library.optional("dhdEnableSimulator"),
                _library: library,
            })
        }
    }

    pub(crate) fn device_count(&self) -> i32 {
        // SAFETY: the function has no arguments.
        unsafe { (self.device_count)() }
    }

    /// Opens the first free device. Returns its number, or a negative number on failure.
    pub(crate) fn open(&self) -> i32 {
        // SAFETY: the function has no arguments.
        unsafe { (self.open)() }
    }

    /// Opens the device with this index in the library's list. Returns its number, or a negative
    /// number on failure.
    pub(crate) fn open_id(&self, which: u8) -> i32 {
        // SAFETY: for an index without a device the library returns −1.
        self.open_id.map_or(-1, |open| unsafe { open(which as c_char) })
    }

    pub(crate) fn close(&self, id: i8) -> i32 {
        // SAFETY: for a number without a device the library returns −1.
        unsafe { (self.close)(id as c_char) }
    }

    /// Returns the library's message for the last error on this thread.
    pub(crate) fn last_error(&self) -> String {
        // SAFETY: the text belongs to the library and lives as long as the library.
        unsafe { words((self.last_error)()) }
    }

    pub(crate) fn system_name(&self, id: i8) -> String {
        // SAFETY: the text belongs to the library and lives as long as the library.
        unsafe { words((self.system_name)(id as c_char)) }
    }

    pub(crate) fn has_active_wrist(&self, id: i8) -> bool {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.has_active_wrist)(id as c_char) != 0 }
    }

    /// Returns whether the device senses rotation. `None` if the library has no such function.
    pub(crate) fn has_wrist(&self, id: i8) -> Option<bool> {
        // SAFETY: all arguments are passed by value.
        self.has_wrist.map(|has| unsafe { has(id as c_char) != 0 })
    }

    pub(crate) fn enable_force(&self, on: bool, id: i8) -> i32 {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.enable_force)(u8::from(on), id as c_char) }
    }

    /// Returns the code, the position (m), and the rows of the matrix with the grip's axes as
    /// columns.
    pub(crate) fn frame(&self, id: i8) -> (i32, [f64; 3], [f64; 9]) {
        let ([mut x, mut y, mut z], mut rows) = ([0.0; 3], [0.0; 9]);
        // SAFETY: the pointers point to three doubles and to a `double[3][3]`, which is nine
        // doubles in a row.
        let code = unsafe { (self.frame)(&mut x, &mut y, &mut z, &mut rows, id as c_char) };
        (code, [x, y, z], rows)
    }

    /// Returns the code and the linear velocity (m/s).
    pub(crate) fn linear_velocity(&self, id: i8) -> (i32, [f64; 3]) {
        three(self.linear_velocity, id)
    }

    /// Returns the code and the angular velocity (rad/s). `None` if the library is too old for this
    /// function.
    pub(crate) fn angular_velocity(&self, id: i8) -> Option<(i32, [f64; 3])> {
        self.angular_velocity.map(|function| three(function, id))
    }

    /// Sets the time window for the estimate of velocities, ms.
    pub(crate) fn velocity_window(&self, ms: i32, id: i8) {
        /// Uses the positions at both ends of a sliding window. The other mode has a growing
        /// window.
        const SLIDING: c_int = 0;
        for configure in [self.configure_linear, self.configure_angular].into_iter().flatten() {
            // SAFETY: all arguments are passed by value. If the call fails, the default window
            // stays.
            let _ = unsafe { configure(ms, SLIDING, id as c_char) };
        }
    }

    /// Sets the force (N) and the torque (N·m). The gripper force is zero.
    pub(crate) fn set_wrench(&self, force: [f64; 3], torque: [f64; 3], id: i8) -> i32 {
        let ([fx, fy, fz], [tx, ty, tz]) = (force, torque);
        // SAFETY: all arguments are passed by value.
        unsafe { (self.set_all)(fx, fy, fz, tx, ty, tz, 0.0, id as c_char) }
    }

    pub(crate) fn buttons(&self, id: i8) -> u32 {
        // SAFETY: all arguments are passed by value.
        self.buttons.map_or(0, |function| unsafe { function(id as c_char) })
    }

    /// Sets the device's watchdog: it switches off the force after this many intervals of 125 µs
    /// without a command. Returns true on success.
    pub(crate) fn set_watchdog(&self, steps: u8, id: i8) -> bool {
        let Some(set) = self.watchdog else { return false };
        // SAFETY: all arguments are passed by value.
        let mut code = unsafe { set(steps, id as c_char) };
        if code < 0
            && let Some((enable, disable)) = self.expert
        {
            // SAFETY: all arguments are passed by value. The expert mode only enables functions
            // such as `dhdSetWatchdog`.
            code = unsafe {
                enable();
                let code = set(steps, id as c_char);
                disable();
                code
            };
        }
        code >= 0
    }

    /// Returns the status words. `None` if the library cannot read the status.
    pub(crate) fn status(&self, id: i8) -> Option<[i32; STATUS_ROOM]> {
        let mut status = [0; STATUS_ROOM];
        // SAFETY: the buffer is larger than what any SDK writes.
        let code = unsafe { (self.status)(status.as_mut_ptr(), id as c_char) };
        (code >= 0).then_some(status)
    }

    /// Returns the communication rate of the device, kHz.
    pub(crate) fn rate(&self, id: i8) -> Option<f64> {
        // SAFETY: all arguments are passed by value.
        self.rate.map(|function| unsafe { function(id as c_char) })
    }

    /// Sets limits in the library, N and N·m. Returns true if the library accepts the force limit.
    pub(crate) fn set_most(&self, force: f64, torque: f64, id: i8) -> bool {
        let set = |most: Option<unsafe extern "C" fn(f64, c_char) -> c_int>, value: f64| {
            // SAFETY: all arguments are passed by value.
            most.is_some_and(|set| unsafe { set(value, id as c_char) } >= 0)
        };
        // If the library cannot limit the torque, the safety chain still limits the torque.
        set(self.max_torque, torque);
        set(self.max_force, force)
    }

    /// Makes the library also find simulated devices. Returns false if the library has no such
    /// function.
    pub(crate) fn enable_simulator(&self) -> bool {
        // SAFETY: all arguments are passed by value.
        self.simulator.map(|function| unsafe { function(1) }).is_some()
    }
}

fn three(function: Three, id: i8) -> (i32, [f64; 3]) {
    let [mut x, mut y, mut z] = [0.0; 3];
    // SAFETY: the pointers point to three doubles.
    let code = unsafe { function(&mut x, &mut y, &mut z, id as c_char) };
    (code, [x, y, z])
}
