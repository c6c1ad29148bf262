//! The functions of 3D Systems' HDAPI that palpus calls, and the callback from its thread.
//!
//! The library runs a thread a thousand times per second. This thread calls
//! [`TurnCallbacks::serve`], through a function that catches every panic. Unwinding into C code
//! would end the process while the force is on.

use std::ffi::{CString, c_char, c_int, c_uint, c_ulong, c_ushort, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{Loaded, words};
use crate::error::DriverError;

type Nothing = unsafe extern "system" fn();
type OfHandle = unsafe extern "system" fn(c_uint);
type Callback = unsafe extern "system" fn(*mut c_void) -> c_uint;

/// Return value of a callback that must be called again.
const CONTINUE: c_uint = 1;
/// Return value of a callback that is not to be called again.
const DONE: c_uint = 0;
/// Priority of the callback that is called first in each turn of the thread.
const HIGHEST_PRIORITY: c_ushort = c_ushort::MAX;

/// Return value if no device was opened.
const INVALID_HANDLE: u32 = 0xffff_ffff;
/// Size of a buffer for the numbers of a parameter. A parameter has 16 numbers at most.
const ROOM: usize = 32;

/// An error of the library.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ErrorInfo {
    /// Error code. 0 means no error.
    pub(crate) code: c_uint,
    /// Error code of the driver.
    pub(crate) internal: c_int,
    /// Handle of the device.
    pub(crate) handle: c_uint,
}

/// A loaded HDAPI library. The functions are valid as long as `_library` exists.
pub(crate) struct Hd {
    init_device: unsafe extern "system" fn(*const c_char) -> c_uint,
    disable_device: OfHandle,
    make_current: OfHandle,
    begin_frame: OfHandle,
    end_frame: OfHandle,
    enable: OfHandle,
    disable: OfHandle,
    get_doubles: unsafe extern "system" fn(c_uint, *mut f64),
    get_integers: unsafe extern "system" fn(c_uint, *mut c_int),
    get_string: unsafe extern "system" fn(c_uint) -> *const c_char,
    set_doubles: unsafe extern "system" fn(c_uint, *const f64),
    get_error: unsafe extern "system" fn() -> ErrorInfo,
    start: Nothing,
    stop: Nothing,
    schedule: unsafe extern "system" fn(Callback, *mut c_void, c_ushort) -> c_ulong,
    unschedule: unsafe extern "system" fn(c_ulong),
    check_calibration: Option<unsafe extern "system" fn() -> c_uint>,
    update_calibration: Option<OfHandle>,
    _library: Loaded,
}

impl Hd {
    /// Looks up every function.
    ///
    /// # Errors
    /// Fails if a function is missing. The error names the function.
    pub(crate) fn of(library: Loaded, mend: &str) -> Result<Self, DriverError> {
        // SAFETY: each type is the type of the function in the maker's manual, and the library is
        // stored with the functions.
        unsafe {
            Ok(Self {
                init_device: library.function("hdInitDevice", mend)?,
                disable_device: library.function("hdDisableDevice", mend)?,
                make_current: library.function("hdMakeCurrentDevice", mend)?,
                begin_frame: library.function("hdBeginFrame", mend)?,
                end_frame: library.function("hdEndFrame", mend)?,
                enable: library.function("hdEnable", mend)?,
                disable: library.function("hdDisable", mend)?,
                get_doubles: library.function("hdGetDoublev", mend)?,
                get_integers: library.function("hdGetIntegerv", mend)?,
                get_string: library.function("hdGetString", mend)?,
                set_doubles: library.function("hdSetDoublev", mend)?,
                get_error: library.function("hdGetError", mend)?,
                start: library.function("hdStartScheduler", mend)?,
                stop: library.function("hdStopScheduler", mend)?,
                schedule: library.function("hdScheduleAsynchronous", mend)?,
                unschedule: library.function("hdUnschedule", mend)?,
                check_calibration: library.optional("hdCheckCalibration"),
                update_calibration: library.optional("hdUpdateCalibration"),
                _library: library,
            })
        }
    }

    /// Returns an address that identifies the loaded library.
    pub(crate) fn place(&self) -> usize {
        self.start as usize
    }

    /// Opens the device with this name, or the default device if there is no name. `None` if the
    /// device cannot be opened.
    pub(crate) fn init_device(&self, name: Option<&str>) -> Option<u32> {
        let name = name.map(CString::new).transpose().ok()?;
        let pointer = name.as_ref().map_or(std::ptr::null(), |name| name.as_ptr());
        // SAFETY: the pointer is null or points to a text that lives through the call.
        let handle = unsafe { (self.init_device)(pointer) };
        (handle != INVALID_HANDLE).then_some(handle)
    }

    pub(crate) fn disable_device(&self, handle: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.disable_device)(handle) }
    }

    /// Selects the device for all later calls of this thread that have no handle.
    pub(crate) fn make_current(&self, handle: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.make_current)(handle) }
    }

    pub(crate) fn begin_frame(&self, handle: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.begin_frame)(handle) }
    }

    pub(crate) fn end_frame(&self, handle: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.end_frame)(handle) }
    }

    pub(crate) fn enable(&self, capability: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.enable)(capability) }
    }

    pub(crate) fn disable(&self, capability: u32) {
        // SAFETY: all arguments are passed by value.
        unsafe { (self.disable)(capability) }
    }

    /// Returns the first N numbers of a parameter. Numbers that the parameter does not have are
    /// NaN.
    pub(crate) fn doubles<const N: usize>(&self, parameter: u32) -> [f64; N] {
        let mut values = [f64::NAN; ROOM];
        // SAFETY: the buffer is larger than any parameter.
        unsafe { (self.get_doubles)(parameter, values.as_mut_ptr()) }
        std::array::from_fn(|k| values.get(k).copied().unwrap_or(f64::NAN))
    }

    pub(crate) fn integer(&self, parameter: u32) -> i32 {
        let mut values: [c_int; ROOM] = [0; ROOM];
        // SAFETY: the buffer is larger than any parameter.
        unsafe { (self.get_integers)(parameter, values.as_mut_ptr()) }
        values[0]
    }

    pub(crate) fn string(&self, parameter: u32) -> String {
        // SAFETY: the result is null or points to a text that belongs to the library and lives as
        // long as the library.
        unsafe { words((self.get_string)(parameter)) }
    }

    /// Sets a parameter of three numbers.
    pub(crate) fn set_three(&self, parameter: u32, values: [f64; 3]) {
        // SAFETY: the array lives through the call.
        unsafe { (self.set_doubles)(parameter, values.as_ptr()) }
    }

    /// Returns the oldest error that was not fetched yet.
    pub(crate) fn error(&self) -> Option<ErrorInfo> {
        // SAFETY: the function has no arguments. The result is returned by value.
        let info = unsafe { (self.get_error)() };
        (info.code != 0).then_some(info)
    }

    /// Returns the calibration state of the device. 0 if the library has no such function.
    pub(crate) fn calibration(&self) -> u32 {
        // SAFETY: the function has no arguments.
        self.check_calibration.map_or(0, |check| unsafe { check() })
    }

    /// Calibrates the device in this style. Returns false if the library has no such function.
    pub(crate) fn calibrate(&self, style: u32) -> bool {
        // SAFETY: all arguments are passed by value.
        self.update_calibration.map(|update| unsafe { update(style) }).is_some()
    }

    pub(crate) fn start(&self) {
        // SAFETY: the function has no arguments.
        unsafe { (self.start)() }
    }

    pub(crate) fn stop(&self) {
        // SAFETY: the function has no arguments.
        unsafe { (self.stop)() }
    }
}

/// Callbacks from the library's thread.
pub(crate) trait TurnCallbacks: Send + 'static {
    /// Does the work of one turn. Returns false if this was the last turn.
    fn serve(&mut self) -> bool;

    /// Sets the force to zero after a turn has panicked. No other call follows.
    fn panicked(&mut self);

    /// Returns a flag that is set after the last call has returned. From then on the callbacks may
    /// be dropped.
    fn ended(&self) -> Arc<AtomicBool>;
}

/// Callbacks that the library's thread calls until they are dismissed.
pub(crate) struct Scheduled<S: TurnCallbacks> {
    api: Arc<Hd>,
    handle: c_ulong,
    callbacks: *mut S,
}

// SAFETY: this side uses the pointer only after the library's thread has made its last call.
unsafe impl<S: TurnCallbacks> Send for Scheduled<S> {}

impl<S: TurnCallbacks> Scheduled<S> {
    /// Starts the calls of `callbacks`, from the next turn of the scheduler on.
    pub(crate) fn new(api: Arc<Hd>, callbacks: S) -> Self {
        let callbacks = Box::into_raw(Box::new(callbacks));
        // SAFETY: the function has the type that the library calls. The callbacks live until
        // `dismiss`, or until the process ends.
        let handle = unsafe { (api.schedule)(turn::<S>, callbacks.cast(), HIGHEST_PRIORITY) };
        Self { api, handle, callbacks }
    }

    /// Ends the calls of the callbacks. `is_done` means that their last turn has returned, or that
    /// there was no turn because the scheduler does not run. Otherwise their memory is leaked on
    /// purpose, because the library's thread may still use it.
    pub(crate) fn dismiss(self, is_done: bool) {
        // SAFETY: the handle is what `schedule` returned.
        unsafe { (self.api.unschedule)(self.handle) };
        if is_done {
            // SAFETY: the pointer is from `Box::into_raw`, and the callbacks are no longer called.
            drop(unsafe { Box::from_raw(self.callbacks) });
        }
    }
}

unsafe extern "system" fn turn<S: TurnCallbacks>(data: *mut c_void) -> c_uint {
    // SAFETY: the pointer is from `Scheduled::new` and is valid until after the turn that returns
    // `DONE`. Only one thread calls at a time.
    let callbacks = unsafe { &mut *data.cast::<S>() };
    match catch_unwind(AssertUnwindSafe(|| callbacks.serve())) {
        Ok(true) => return CONTINUE,
        Ok(false) => {}
        // There is no caller to report to. The loop notices that no more states arrive.
        Err(_) => _ = catch_unwind(AssertUnwindSafe(|| callbacks.panicked())),
    }
    // The flag outlives the callbacks. The callbacks are not used after the flag is set.
    let ended = callbacks.ended();
    ended.store(true, Ordering::Release);
    DONE
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records the value of the end flag during each call.
    #[derive(Default)]
    struct Witness {
        ended: Arc<AtomicBool>,
        seen: Vec<bool>,
        turns: u32,
    }

    impl TurnCallbacks for Witness {
        fn serve(&mut self) -> bool {
            self.turns += 1;
            self.seen.push(self.ended.load(Ordering::Acquire));
            assert!(self.turns < 3, "panics on purpose");
            self.turns == 1
        }

        fn panicked(&mut self) {
            self.seen.push(self.ended.load(Ordering::Acquire));
        }

        fn ended(&self) -> Arc<AtomicBool> {
            Arc::clone(&self.ended)
        }
    }

    #[test]
    fn end_flag_is_set_after_the_last_call() {
        let mut witness = Witness::default();
        let data: *mut Witness = &mut witness;
        // SAFETY: the witness lives through the calls, and nothing else uses the witness during the
        // calls.
        let call = || unsafe { turn::<Witness>(data.cast()) };
        assert_eq!((call(), call()), (CONTINUE, DONE));
        assert_eq!((witness.seen.as_slice(), witness.ended.load(Ordering::Acquire)), ([false, false].as_slice(), true));
        let mut witness = Witness { turns: 2, ..Witness::default() };
        let data: *mut Witness = &mut witness;
        // SAFETY: same as above.
        assert_eq!(unsafe { turn::<Witness>(data.cast()) }, DONE);
        assert_eq!((witness.seen.as_slice(), witness.ended.load(Ordering::Acquire)), ([false, false].as_slice(), true));
    }
}
