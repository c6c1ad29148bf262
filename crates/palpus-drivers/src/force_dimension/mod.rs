//! Force Dimension's devices and the Falcon, through `libdhd`.
//!
//! 1. After opening, the device's force is off. The first write switches the force on (a sigma.7
//!    needs this call). The device's watchdog is set as well: it switches off the force
//!    [`WATCHDOG`] after the last write, even if this program has died.
//! 2. A read returns the pose and the velocities. The library estimates velocities over
//!    [`VELOCITY_WINDOW_MS`] instead of its default of 20 ms. Velocities that the library does not
//!    have are estimated here. If it returns the previous sample again (time guard, code 1), the
//!    sample keeps its time.
//! 3. A write sets the whole wrench in one call. Saturated motors (code 2) are counted.
//!    Saturation is normal and not an error.
//! 4. The brake switches the motors off. The switched-off motors are short-circuited, so they damp.
//!    The brake never waits for a call that hangs; in that case the device's watchdog acts.
//! 5. The program switches the force on again only if this program or the device's watchdog has
//!    switched it off. After any other cause, such as the button on the device, the force stays
//!    off. Before the driver switches the force on, it reads the cause from the status. The driver
//!    also monitors whether the force is on. While the force is off, the state is marked as
//!    withheld, so that the loop increases the force from zero afterwards.
//! 6. The library gets limits of force and torque, and does not exceed them.
//! 7. However the driver ends, the last wrench is zero and the force is off.

mod switch;

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::{DMat3, DVec3};
use palpus::algebra::{Pose, Twist, Wrench, rotation_between};
use palpus_device::{
    Axes as AxisCount, Brake, BrakeFlag, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog, known_devices,
};

use crate::axes::Axes;
use crate::error::DriverError;
use crate::ffi::dhd::Dhd;
use crate::library::{Known, Place};
use switch::{Shared, State, Switched, cause, status};

/// Timeout of the device's watchdog. The timeout is longer than the timeout of the loop's watchdog
/// at 12 N, so the device's watchdog acts second.
const WATCHDOG: Duration = Duration::from_millis(20);
/// The same timeout in the device's intervals of 125 µs.
const WATCHDOG_STEPS: u8 = 160;
/// Time window of the velocity estimate, ms. The velocity lags by half of this window. Shorter
/// windows show the steps of the encoders.
const VELOCITY_WINDOW_MS: i32 = 4;
/// Cutoff frequency of the velocities that are estimated here, Hz.
const VELOCITY_CUTOFF_HZ: f64 = 50.0;
/// Number of reads between two checks of the force switch. A check may need communication with the
/// device.
const READS_PER_STATUS: u32 = 32;
/// Force limit of a device that is not in the list, N. No device of this maker has a lower limit.
const UNKNOWN_FORCE: f64 = 8.0;
/// Torque limit of such a device with a motorised wrist, N·m. No device of this maker has a lower
/// limit.
const UNKNOWN_TORQUE: f64 = 0.2;
/// Rate if the library states no rate, Hz.
const USUAL_RATE_HZ: f64 = 1000.0;

/// The library returned the previous sample again, or did not send, because the call came too soon.
const TIME_GUARD: i32 = 1;
/// At least one motor applies less than commanded.
const SATURATED: i32 = 2;

pub(crate) const LIBRARY: Known = Known {
    names: if cfg!(windows) {
        &["dhd64.dll", "drd64.dll"]
    } else if cfg!(target_os = "macos") {
        &["libdhd.dylib", "libdrd.dylib"]
    } else {
        &["libdhd.so", "libdhd.so.3", "libdrd.so", "libdrd.so.3"]
    },
    kit: ("FORCEDIM_SDK", &["lib", "lib/release/*"]),
    mend: MEND,
};

const MEND: &str = "install the Force Dimension SDK (forcedimension.com/software/sdk) and set FORCEDIM_SDK to its folder, or give the file: --device force-dimension:LIBRARY";

/// Selects the device to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ForceDimensionOptions {
    /// Location of the library.
    pub library: Place,
    /// If true, a device that the library simulates is used if there is no other.
    pub simulator: bool,
    /// Index of the device in the library's order, from 0. `None` means the first free device.
    pub which: Option<u8>,
}

/// An open device of Force Dimension.
pub struct ForceDimension {
    shared: Arc<Shared>,
    spec: DeviceSpec,
    rate_hz: f64,
    has_watchdog: bool,
    is_limited: bool,
    saturated: u64,
    opened: Instant,
    written: Option<Instant>,
    last: Option<DeviceState>,
    /// Number of reads until the next check of the force switch.
    reads_left: u32,
    /// True if the library has reported that the force is on. Such a library also reports when the
    /// force is off.
    knows_switch: bool,
    /// True if the next write must switch the force on again.
    switch_on: bool,
    /// True if the last write sent zero instead of the wrench.
    interrupted: bool,
}

impl ForceDimension {
    /// Opens a device. The device applies no force before the first write.
    ///
    /// # Errors
    /// Fails if there is no library, or no device that can apply a force. The error says how to fix
    /// the problem.
    pub fn open(options: &ForceDimensionOptions) -> Result<Self, DriverError> {
        let api = Dhd::of(LIBRARY.open(&options.library)?, "install a newer Force Dimension SDK (3.14 or later)")?;
        if options.simulator && !api.enable_simulator() {
            return Err(no_device("this library has no simulator", "use the library of a newer SDK"));
        }
        let count = api.device_count();
        if count <= 0 && !options.simulator {
            return Err(no_device(
                "the library sees no device",
                "plug it in and switch it on; on Linux copy the SDK's udev rule to /etc/udev/rules.d, which lets users other than root access it",
            ));
        }
        if let Some(which) = options.which.filter(|which| i32::from(*which) >= count.max(1)) {
            let why = format!("there is no device number {}; the library sees {count}", u32::from(which) + 1);
            return Err(no_device(why, "plug it in, or choose another one: --device force-dimension#1"));
        }
        let opened = options.which.map_or_else(|| api.open(), |which| api.open_id(which));
        let Some(id) = i8::try_from(opened).ok().filter(|id| *id >= 0) else {
            let why = format!("the device could not be opened ({})", said(&api));
            return Err(no_device(
                why,
                "close other programs that use it, and check your permission for the USB device",
            ));
        };
        let shared = Arc::new(Shared {
            api,
            id,
            line: Mutex::new(State::Silent),
            brake: BrakeFlag::default(),
            late_brake: AtomicBool::new(false),
            withheld: AtomicBool::new(false),
        });
        // From here on `Drop` closes the device.
        let mut device = Self {
            spec: spec(&shared.api, id),
            rate_hz: shared.api.rate(id).map(|khz| khz * 1e3).filter(|hz| *hz >= 100.0).unwrap_or(USUAL_RATE_HZ),
            shared,
            has_watchdog: false,
            is_limited: false,
            saturated: 0,
            opened: Instant::now(),
            written: None,
            last: None,
            reads_left: READS_PER_STATUS,
            knows_switch: false,
            switch_on: true,
            interrupted: false,
        };
        check_status(&device.shared.api, id)?;
        device.shared.api.velocity_window(VELOCITY_WINDOW_MS, id);
        device.has_watchdog = device.shared.api.set_watchdog(WATCHDOG_STEPS, id);
        device.is_limited = device.shared.api.set_most(device.spec.force_max, device.spec.torque_max, id);
        Ok(device)
    }

    /// Returns the rate at which the device communicates with the computer, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// True if the device switches off its force by itself after this program has died.
    pub fn has_watchdog(&self) -> bool {
        self.has_watchdog
    }

    /// True if the library itself limits the force.
    pub fn is_limited(&self) -> bool {
        self.is_limited
    }

    /// Returns the number of writes at which motors were saturated.
    pub fn saturated(&self) -> u64 {
        self.saturated
    }

    /// Checks the force switch from time to time, while the force should be on.
    fn watch_switch(&mut self, state: &mut State) {
        self.reads_left = self.reads_left.saturating_sub(1);
        let shared = &self.shared;
        let is_withheld = shared.withheld.load(Ordering::Acquire);
        // The force is off on purpose if the brake is applied, or if it was never switched on.
        if self.reads_left > 0 || shared.brake.is_applied() || (*state != State::Driven && !is_withheld) {
            return;
        }
        self.reads_left = READS_PER_STATUS;
        let Some(words) = shared.api.status(shared.id) else { return };
        let is_on = words[status::FORCE] != 0;
        self.knows_switch |= is_on;
        if is_on {
            // If the force was off, the user has switched it on.
            *state = State::Driven;
            shared.withheld.store(false, Ordering::Release);
        } else if matches!(words[status::FORCE_OFF_CAUSE], cause::WATCHDOG | cause::SOFTWARE) {
            self.switch_on = true;
        } else if self.knows_switch && !self.slept() {
            shared.withheld.store(true, Ordering::Release);
        }
    }

    /// True if the device's watchdog may have switched off the force since the last write.
    fn slept(&self) -> bool {
        self.written.is_none_or(|last| last.elapsed() > WATCHDOG)
    }

    /// Switches the force on, unless it is already on or was switched off by the user or the
    /// device.
    fn switch_on(&mut self, state: &mut State) -> Result<(), DeviceError> {
        let shared = &self.shared;
        let switched = shared.switch_on();
        if let Switched::Failed = switched {
            let why = format!("its force could not be switched on ({})", said(&shared.api));
            return Err(DeviceError::Refused(Cow::Owned(why)));
        }
        // If the force was on before and then off, the loop must know this before the force is on
        // again.
        self.interrupted = *state == State::Driven && switched != Switched::WasOn;
        shared.withheld.store(switched == Switched::Forbidden, Ordering::Release);
        if switched != Switched::Forbidden {
            *state = State::Driven;
        }
        self.switch_on = false;
        Ok(())
    }

    fn lost(&self) -> DeviceError {
        DeviceError::Lost(Cow::Owned(format!(
            "{}; check its cable, power and emergency switch",
            said(&self.shared.api)
        )))
    }

    /// Returns the library's velocity. Estimates the velocity from two poses if the library does
    /// not have it.
    fn twist(&self, pose: &Pose, time: f64) -> Twist {
        let Shared { api, id, .. } = &*self.shared;
        let known = |(code, v): (i32, [f64; 3])| {
            let v = Axes::ForceDimension.ours(DVec3::from_array(v));
            (code >= 0 && v.is_finite()).then_some(v)
        };
        let linear = known(api.linear_velocity(*id));
        let angular = api.angular_velocity(*id).and_then(known);
        let estimated = |before: &DeviceState| {
            let dt = time - before.time;
            let share = 1.0 - (-std::f64::consts::TAU * VELOCITY_CUTOFF_HZ * dt).exp();
            let towards = |old: DVec3, way: DVec3| if dt > 0.0 { old + (way / dt - old) * share } else { old };
            Twist {
                angular: towards(before.twist.angular, rotation_between(before.pose.rotation, pose.rotation)),
                linear: towards(before.twist.linear, pose.translation - before.pose.translation),
            }
        };
        match (angular, linear) {
            (Some(angular), Some(linear)) => Twist { angular, linear },
            (angular, linear) => {
                // An invalid state would spoil all later estimates.
                let is_one = |last: &&DeviceState| {
                    last.pose.is_valid() && last.twist.angular.is_finite() && last.twist.linear.is_finite()
                };
                let own = self.last.as_ref().filter(is_one).map(estimated).unwrap_or_default();
                Twist { angular: angular.unwrap_or(own.angular), linear: linear.unwrap_or(own.linear) }
            }
        }
    }
}

impl HapticDevice for ForceDimension {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        vec![("writes with saturated motors", self.saturated)]
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        let shared = Arc::clone(&self.shared);
        let mut line = shared.line();
        let (code, position, rows) = shared.api.frame(shared.id);
        if code < 0 {
            return Err(self.lost());
        }
        let now = self.opened.elapsed().as_secs_f64();
        let time = self.last.filter(|_| code == TIME_GUARD).map_or(now, |last| last.time);
        let rotation = DMat3::from_cols_array(&rows).transpose();
        let pose = Axes::ForceDimension.pose(rotation, DVec3::from_array(position));
        let twist = self.twist(&pose, time);
        self.watch_switch(&mut line);
        let withheld = shared.withheld.load(Ordering::Acquire) | std::mem::take(&mut self.interrupted);
        let state = DeviceState { pose, twist, buttons: shared.api.buttons(shared.id), time, withheld };
        shared.brake_late();
        self.last = Some(state);
        Ok(state)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !wrench.is_finite() {
            return Err(DeviceError::Refused(Cow::Borrowed("it is not finite")));
        }
        let shared = Arc::clone(&self.shared);
        let mut line = shared.line();
        let slept = self.slept();
        self.written = Some(Instant::now());
        let braked = shared.brake.is_applied();
        let withheld = shared.withheld.load(Ordering::Acquire);
        if !braked && !withheld && (slept || self.switch_on) {
            self.switch_on(&mut line)?;
        }
        let is_given = !braked && !self.interrupted && !shared.withheld.load(Ordering::Acquire);
        let wrench = if is_given { *wrench } else { Wrench::ZERO };
        let torque = if self.spec.torque_max > 0.0 { wrench.torque } else { DVec3::ZERO };
        let [force, torque] = [wrench.force, torque].map(|v| Axes::ForceDimension.theirs(v).to_array());
        let code = shared.api.set_wrench(force, torque, shared.id);
        shared.brake_late();
        match code {
            SATURATED => self.saturated += 1,
            code if code < 0 => return Err(DeviceError::Refused(Cow::Owned(said(&shared.api)))),
            _ => {}
        }
        Ok(())
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.shared.clone())
    }

    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        let line = self.shared.line();
        let is_driven = self.has_watchdog && *line == State::Driven;
        // The watchdog cannot be observed if the status does not contain the force.
        let words =
            self.shared.api.status(self.shared.id).filter(|words| is_driven && words[status::CONNECTED] != 0)?;
        Some(OwnWatchdog { after: WATCHDOG, has_bitten: words[status::FORCE] == 0 })
    }
}

impl Drop for ForceDimension {
    fn drop(&mut self) {
        let Shared { api, id, .. } = &*self.shared;
        let mut line = self.shared.line();
        // The results of these calls no longer matter.
        if *line == State::Driven {
            let _ = api.set_wrench([0.0; 3], [0.0; 3], *id);
            let _ = api.enable_force(false, *id);
        }
        let _ = api.close(*id);
        *line = State::Closed;
    }
}

/// Returns the known properties of the device, found by its name. The library states no limits.
fn spec(api: &Dhd, id: i8) -> DeviceSpec {
    let name = api.system_name(id);
    let wanted = name.to_lowercase();
    let known = known_devices().into_iter().find(|known| wanted.contains(&known.name.to_lowercase()));
    let active = api.has_active_wrist(id);
    let mut spec = known.unwrap_or_else(|| {
        let rotation = |has: bool| AxisCount { translation: 3, rotation: if has { 3 } else { 0 }, gripper: 0 };
        let sensed = rotation(api.has_wrist(id).unwrap_or(active));
        let name = if name.is_empty() { "Force Dimension device".to_owned() } else { name };
        DeviceSpec {
            name: Cow::Owned(name),
            force_max: UNKNOWN_FORCE,
            torque_max: UNKNOWN_TORQUE,
            actuated: rotation(active),
            sensed,
            ..DeviceSpec::default()
        }
    });
    if !active {
        spec.torque_max = 0.0;
        spec.actuated.rotation = 0;
    }
    spec
}

/// Fails if the force of the device would stay off. The error says how to fix the problem.
fn check_status(api: &Dhd, id: i8) -> Result<(), DriverError> {
    // A library that does not report the device as connected does not fill in the status.
    let Some(words) = api.status(id).filter(|words| words[status::CONNECTED] != 0) else { return Ok(()) };
    if words[status::POWER] == 0 {
        return Err(no_device("the device has no power", "switch it on and release its emergency switch"));
    }
    if words[status::RESET] != 0 {
        let mend = "press its calibration button, or run the maker's HapticInit or HapticDesk";
        return Err(no_device("the device is not calibrated", mend));
    }
    if words[status::ERROR] != 0 {
        let why = format!("the device reports an error ({})", said(api));
        return Err(no_device(why, "switch it off and on again; the maker's HapticDesk has details"));
    }
    Ok(())
}

fn no_device(why: impl Into<String>, mend: &str) -> DriverError {
    DriverError::NoDevice { why: why.into(), mend: mend.to_owned() }
}

/// Returns the text of the library's last error.
fn said(api: &Dhd) -> String {
    let words = api.last_error();
    if words.is_empty() { "the library gives no reason".to_owned() } else { words }
}
