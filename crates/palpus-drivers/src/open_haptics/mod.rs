//! 3D Systems' Touch, Touch X and Phantom, through OpenHaptics' HDAPI.
//!
//! HDAPI runs the device's thread at 1000 Hz. That thread ([`callbacks`]) puts the newest state
//! into one slot and takes the newest wrench from another. Neither side ever waits. So a wrench
//! takes effect up to a millisecond after it was written, and states arrive at the rate of HDAPI's
//! thread.
//!
//! 1. A device is opened by name. If the user gives no name, the driver is first asked for its
//!    default device, which some drivers refuse. Then the two default names of the installers are
//!    tried.
//! 2. Each limit is the smaller of the device's value and the known value of its model. HDAPI
//!    states forces in N, torques in mN·m, lengths in mm.
//! 3. A wrench that is older than a few milliseconds is not applied. The thread then applies zero,
//!    the state is marked as withheld, and the loop increases the force from zero afterwards.
//! 4. The brake is a flag that the thread checks in every turn. While it is set, the thread applies
//!    damping.
//! 5. Force errors (too much, too fast, warm motors) are counted. Force errors end the run only
//!    if they persist. All other errors end the run at once. However the run ends, the thread's
//!    last wrench is zero.
//! 6. The driver's protections are switched on: the clamp of the force, and the limits of force, of
//!    the change of force and of velocity. An outdated calibration is updated. If the update fails,
//!    the device is rejected.
//!
//! HDAPI has one scheduler per process, and devices must be opened before it starts. If a device is
//! already open, the scheduler pauses while another device is opened or closed. No device applies a
//! force during that time. Each device has a separate callback.

mod callbacks;
mod errors;
mod model;

use std::borrow::Cow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpus::algebra::Wrench;
use palpus_device::{
    Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice, Newest, OwnWatchdog, Publisher, SafetyLimits, latest,
};

use crate::error::DriverError;
use crate::ffi::hd::{Hd, Scheduled};
use crate::library::{Known, Place};
use callbacks::{Command, Sample, Shared, Touch};
use model::spec;

/// Numbers of HDAPI's parameters and capabilities.
mod number {
    pub(super) const BUTTONS: u32 = 0x2000;
    pub(super) const VELOCITY: u32 = 0x2051;
    pub(super) const TRANSFORM: u32 = 0x2052;
    pub(super) const MODEL: u32 = 0x2501;
    pub(super) const USABLE_WORKSPACE: u32 = 0x2551;
    pub(super) const OUTPUT_DOF: u32 = 0x2554;
    pub(super) const CALIBRATION_STYLE: u32 = 0x2555;
    pub(super) const MAX_FORCE: u32 = 0x2603;
    pub(super) const CONTINUOUS_FORCE: u32 = 0x2604;
    pub(super) const MAX_TORQUE: u32 = 0x2622;
    pub(super) const CONTINUOUS_TORQUE: u32 = 0x2623;
    pub(super) const FORCE: u32 = 0x2700;
    pub(super) const TORQUE: u32 = 0x2701;
    pub(super) const FORCE_OUTPUT: u32 = 0x4000;
    /// Each protection clamps a force, or removes a force that exceeds the driver's limits.
    pub(super) const PROTECTIONS: [u32; 5] = [
        0x4001, // clamp of the largest force
        // gradual increase of the force when the scheduler starts, or continues after an error
        0x4002, 0x4003, // limit of the force
        0x2606, // limit of the velocity
        0x2607, // limit of the change of the force
    ];
    pub(super) const CALIBRATED: u32 = 0x5000;
    pub(super) const NEEDS_CALIBRATION: u32 = 0x5001;
    /// Styles of calibration that do not need a person to hold the arm in a certain pose, in
    /// order of preference: automatic, and in the inkwell.
    pub(super) const CALIBRATES_ITSELF: [u32; 2] = [2, 4];
}

/// Rate of HDAPI's thread, Hz.
pub(crate) const RATE_HZ: f64 = 1000.0;
/// Metres per mm, and N·m per mN·m.
const MILLI: f64 = 1e-3;
/// Default device names, passed to `hdInitDevice` one after the other.
const NAMES: [Option<&str>; 3] = [None, Some("Default Device"), Some("Default PHANToM")];
/// Timeout for the scheduler's first turn.
const FIRST_TURN: Duration = Duration::from_secs(2);
/// Timeout for the thread's last turn.
const LAST_TURN: Duration = Duration::from_millis(200);
/// Time without a turn after which HDAPI's thread counts as lost, s.
const SILENCE: f64 = 0.1;
/// Number of consecutive turns with force errors after which the run ends.
const FORCE_ERRORS_IN_A_ROW: u32 = 200;
/// Maximum number of errors fetched at a time, because the library may add new errors meanwhile.
const ERRORS_AT_A_TIME: usize = 16;
/// Maximum number of calibration updates, and the time between two updates.
const CALIBRATIONS: u32 = 10;
const CALIBRATION_TIME: Duration = Duration::from_millis(10);
/// Mean additional time from a write to its effect, s: half a turn, because HDAPI's thread has its
/// own timing.
const DELAY: f64 = 0.5e-3;
/// Number of buttons on the maker's styluses and handles. Encoder gimbals have one button or no
/// button.
const BUTTONS: u8 = 2;

pub(crate) const LIBRARY: Known = Known {
    names: if cfg!(windows) {
        &["hd.dll"]
    } else if cfg!(target_os = "macos") {
        &["libHD.dylib", "HD.framework/HD"]
    } else {
        &["libHD.so", "libHD.so.3.4", "libHD.so.3.0"]
    },
    kit: ("OH_SDK_BASE", &["lib", "bin/x64", "lib/lin-x86_64", "usr/lib"]),
    mend: "install OpenHaptics and the Touch device driver (support.3dsystems.com, \"Haptics\"), or give the file: --device openhaptics:LIBRARY",
};

const TOO_OLD: &str = "install OpenHaptics 3.4 or later";

/// The devices that HDAPI's scheduler calls.
static SCHEDULER: Mutex<Called> = Mutex::new(Called { library: 0, open: Vec::new() });

/// Devices of HDAPI that the process has open.
struct Called {
    /// Identifies the library by the address of one of its functions.
    library: usize,
    /// Handles of the open devices.
    open: Vec<u32>,
}

/// Selects the device to open: by its name in the maker's setup tool, or the default device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OpenHapticsOptions {
    /// Location of the library.
    pub library: Place,
    /// Name of the device. `None` means the driver's default.
    pub device: Option<String>,
}

/// How often the driver did not apply the commanded wrench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ForceErrors {
    /// Number of turns in which the motors were too warm for the commanded force.
    pub warm_motors: u64,
    /// Number of turns in which a force, its change or the velocity exceeded the driver's limits.
    /// The driver then applies no force.
    pub exceeded: u64,
}

/// An open device of 3D Systems.
pub struct OpenHaptics {
    spec: DeviceSpec,
    api: Arc<Hd>,
    handle: u32,
    shared: Arc<Shared>,
    commands: Publisher<Command>,
    samples: Newest<Sample>,
    scheduled: Option<Scheduled<Touch>>,
    /// Number of the last gap that was reported to the loop; [`callbacks`] describes gaps.
    gap: u64,
    /// Number of turns with an outdated wrench, up to the last write.
    stale: u64,
}

impl OpenHaptics {
    /// Opens a device and starts the calls from HDAPI's thread. The device applies no force before
    /// the first write.
    ///
    /// # Errors
    /// Fails if there is no library, if no device answers, or if the device is already open. The
    /// error says how to fix the problem.
    pub fn open(options: &OpenHapticsOptions) -> Result<Self, DriverError> {
        let api = Arc::new(Hd::of(LIBRARY.open(&options.library)?, TOO_OLD)?);
        let mut standing = PausedScheduler::begin(&api)?;
        let handle = init(&api, options.device.as_deref())?;
        if standing.called.open.contains(&handle) {
            let mend = "choose another one: --device openhaptics#NAME, with its name in the maker's Touch Setup";
            return Err(no_device("this program already has that device open", mend));
        }
        api.make_current(handle);
        let spec = spec(&api);
        if !calibrate(&api) {
            api.disable_device(handle);
            let mend = "put the stylus into its inkwell and try again, or run the maker's Touch Diagnostic";
            return Err(no_device("the device is not calibrated", mend));
        }
        for protection in number::PROTECTIONS {
            api.enable(protection);
        }
        // Older drivers report errors for protections that they do not know.
        forget_errors(&api);
        let shared = Arc::new(Shared::new(Instant::now()));
        let (commands, newest_command) = latest(Command::NONE);
        let (publisher, samples) = latest(Sample::default());
        let limits = SafetyLimits::of(&spec, RATE_HZ);
        let has_torque = spec.torque_max > 0.0;
        let touch =
            Touch::new(Arc::clone(&api), handle, has_torque, limits, Arc::clone(&shared), newest_command, publisher);
        let scheduled = Some(Scheduled::new(Arc::clone(&api), touch));
        api.enable(number::FORCE_OUTPUT);
        standing.called.open.push(handle);
        // From here on `Drop` cleans up. `Drop` needs the scheduler, which continues here.
        let mut device = Self { spec, api, handle, shared, commands, samples, scheduled, gap: 0, stale: 0 };
        drop(standing);
        device.wait_for_first_turn()?;
        Ok(device)
    }

    /// Describes the device without starting its thread, so there is no force.
    ///
    /// # Errors
    /// As [`OpenHaptics::open`]. Also fails while another device is open.
    pub fn look(library: &Place) -> Result<DeviceSpec, DriverError> {
        let api = Arc::new(Hd::of(LIBRARY.open(library)?, TOO_OLD)?);
        let standing = PausedScheduler::begin(&api)?;
        if !standing.called.open.is_empty() {
            return Err(no_device("this program already uses an OpenHaptics device", "close it first"));
        }
        let handle = init(&api, None)?;
        api.make_current(handle);
        let spec = spec(&api);
        api.disable_device(handle);
        Ok(spec)
    }

    /// Returns how often the driver did not apply the commanded wrench.
    pub fn force_errors(&self) -> ForceErrors {
        self.shared.force_errors()
    }

    fn wait_for_first_turn(&mut self) -> Result<(), DriverError> {
        let begun = Instant::now();
        loop {
            if let Some(code) = self.shared.failure() {
                let (why, mend) = errors::in_words(code);
                return Err(no_device(why, mend));
            }
            if self.samples.take().is_some() {
                return Ok(());
            }
            if begun.elapsed() > FIRST_TURN {
                let (why, mend) = self.api.error().map_or(
                    ("HDAPI's thread does not start".into(), "unplug the device, plug it in again, and try again"),
                    |error| errors::in_words(error.code),
                );
                return Err(no_device(why, mend));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl HapticDevice for OpenHaptics {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        let ForceErrors { warm_motors, exceeded } = self.force_errors();
        vec![("turns with warm motors", warm_motors), ("turns beyond the driver's limits", exceeded)]
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        if let Some(code) = self.shared.failure() {
            let (why, mend) = errors::in_words(code);
            return Err(DeviceError::Lost(Cow::Owned(format!("{why}; {mend}"))));
        }
        let Sample { mut state, gap } = *self.samples.get();
        state.withheld |= gap != self.gap;
        self.gap = gap;
        if self.shared.now() - state.time > SILENCE {
            return Err(DeviceError::Lost(Cow::Borrowed("HDAPI's thread no longer calls the device; start again")));
        }
        Ok(state)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !wrench.is_finite() {
            return Err(DeviceError::Refused(Cow::Borrowed("it is not finite")));
        }
        if self.shared.force_errors_in_a_row() > FORCE_ERRORS_IN_A_ROW {
            let (why, mend) = errors::in_words(self.shared.last_force_error());
            return Err(DeviceError::Refused(Cow::Owned(format!("{why}; {mend}"))));
        }
        self.stale = self.shared.stale();
        self.commands.publish(Command { wrench: *wrench, time: self.shared.now(), gap: self.gap });
        Ok(())
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.shared.brake())
    }

    /// HDAPI's thread applies zero if the loop does not write.
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        let after = Duration::from_secs_f64(callbacks::STALE);
        Some(OwnWatchdog { after, has_bitten: self.shared.stale() > self.stale })
    }
}

impl Drop for OpenHaptics {
    fn drop(&mut self) {
        let mut called = SCHEDULER.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scheduled) = self.scheduled.take() {
            let is_done = self.shared.end_and_wait(LAST_TURN);
            self.api.stop();
            scheduled.dismiss(is_done);
            self.api.make_current(self.handle);
            self.api.disable(number::FORCE_OUTPUT);
        }
        self.api.disable_device(self.handle);
        called.open.retain(|handle| *handle != self.handle);
        if !called.open.is_empty() {
            self.api.start();
        }
    }
}

/// Exclusive access to HDAPI's paused scheduler. When this value is dropped, the scheduler
/// continues if there is a device to call.
struct PausedScheduler {
    api: Arc<Hd>,
    called: MutexGuard<'static, Called>,
}

impl PausedScheduler {
    fn begin(api: &Arc<Hd>) -> Result<Self, DriverError> {
        let mut called = SCHEDULER.lock().unwrap_or_else(PoisonError::into_inner);
        if called.open.is_empty() {
            called.library = api.place();
        } else if called.library != api.place() {
            let mend = "use the same library for all of OpenHaptics' devices";
            return Err(no_device("this program already uses another OpenHaptics library", mend));
        } else {
            api.stop();
        }
        Ok(Self { api: Arc::clone(api), called })
    }
}

impl Drop for PausedScheduler {
    fn drop(&mut self) {
        if !self.called.open.is_empty() {
            self.api.start();
        }
    }
}

/// Opens the device with that name, or tries the default names.
fn init(api: &Hd, name: Option<&str>) -> Result<u32, DriverError> {
    forget_errors(api);
    let mut worst = None;
    let usual = if name.is_some() { &NAMES[..0] } else { &NAMES[..] };
    for name in name.map(Some).into_iter().chain(usual.iter().copied()) {
        let handle = api.init_device(name);
        let error = api.error();
        forget_errors(api);
        match (handle, error) {
            (Some(handle), None) => return Ok(handle),
            (Some(handle), Some(error)) if errors::is_of_force(error.code) => {
                // Warm motors at the start are not an error.
                let _ = error.internal;
                return Ok(handle);
            }
            (handle, error) => {
                if let Some(handle) = handle {
                    api.disable_device(handle);
                    forget_errors(api);
                }
                worst = worst.or(error);
            }
        }
    }
    let (why, mend) = worst.map_or(
        ("the library sees no device".into(), "plug it in, switch it on, and pair it with the maker's Touch Setup"),
        |error| errors::in_words(error.code),
    );
    Err(no_device(why, mend))
}

/// Returns true if the device is calibrated, or if the library cannot tell.
fn calibrate(api: &Hd) -> bool {
    for _ in 0..CALIBRATIONS {
        match api.calibration() {
            0 | number::CALIBRATED => return true,
            number::NEEDS_CALIBRATION => {}
            // The calibration needs a person to hold the arm in a certain pose.
            _ => return false,
        }
        let styles = api.integer(number::CALIBRATION_STYLE) as u32;
        let Some(style) = number::CALIBRATES_ITSELF.into_iter().find(|style| styles & style != 0) else { return false };
        if !api.calibrate(style) {
            return false;
        }
        std::thread::sleep(CALIBRATION_TIME);
        forget_errors(api);
    }
    false
}

fn forget_errors(api: &Hd) {
    for _ in 0..ERRORS_AT_A_TIME {
        if api.error().is_none() {
            return;
        }
    }
}

fn no_device(why: impl Into<String>, mend: &str) -> DriverError {
    DriverError::NoDevice { why: why.into(), mend: mend.to_owned() }
}
