//! Force Dimension's devices, and the Falcon, through `libdhd`.
//!
//! 1. Opened, a device gives no force: that is switched on (a sigma.7 gives none otherwise) with
//!    the first write, and so is the device's own watchdog, which takes the force away [`WATCHDOG`]
//!    after the last write, whatever becomes of this program.
//! 2. A read is the pose and the velocities, estimated by the library over [`VELOCITY_WINDOW_MS`]
//!    instead of its usual 20 ms; where it knows none, they are estimated here. A sample that it
//!    hands out again (the time guard, code 1) keeps its time.
//! 3. A write is a wrench in one call. Saturated motors (code 2) are counted; they are the normal
//!    case and no failure.
//! 4. The brake switches the motors off, which short-circuits them: they damp. It never waits for a
//!    call that hangs; there the device's watchdog takes its part.
//! 5. The force is switched on from here only after this program, or the device's watchdog, has
//!    switched it off. If another cause did, the button on the device above all, it stays off:
//!    before each switching on, the status names the cause. The switch is watched, and while it is
//!    off the state is withheld, so that the loop returns from zero when it is on again.
//! 6. The library gets the largest force and torque, and gives no more.
//! 7. Whatever ends it, the last wrench is zero and the force is off.

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

/// Time of the device's own watchdog: longer than the loop's own watchdog waits at 12 N, so that it
/// is the second to act.
const WATCHDOG: Duration = Duration::from_millis(20);
/// In the device's steps of 125 µs.
const WATCHDOG_STEPS: u8 = 160;
/// Its lag is half of it; shorter ones let the steps of the encoders through.
const VELOCITY_WINDOW_MS: i32 = 4;
/// Hz: of the velocities that are estimated here.
const VELOCITY_CUTOFF_HZ: f64 = 50.0;
/// Reads from one look at the force switch to the next, which may cost an exchange with the device.
const READS_PER_STATUS: u32 = 32;
/// N: of a device that is not in the list, the least that any of the maker's has.
const UNKNOWN_FORCE: f64 = 8.0;
/// N·m: likewise, when its wrist has motors.
const UNKNOWN_TORQUE: f64 = 0.2;
/// Hz: what the library likes to be driven at when it does not say.
const USUAL_RATE_HZ: f64 = 1000.0;

/// The library returned the last sample again, or did not send: it was asked too soon.
const TIME_GUARD: i32 = 1;
/// At least one motor gives less than was asked for.
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

const MEND: &str = "install the Force Dimension SDK (forcedimension.com/software/sdk) and set FORCEDIM_SDK to its folder, or name the file: --device force-dimension:LIBRARY";

/// The device to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ForceDimensionOptions {
    /// Path of the library.
    pub library: Place,
    /// Take a device that the library simulates if there is no other.
    pub simulator: bool,
    /// Which of the devices, in the library's order, from 0; `None`: the first that is free.
    pub which: Option<u8>,
}

/// An open device of Force Dimension's.
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
    /// Until the next look at the force switch.
    reads_left: u32,
    /// The library has said that the force is on, and so will say that it is off.
    knows_switch: bool,
    /// The force has to be switched on again with the next write.
    switch_on: bool,
    /// Zero went out in place of the last wrench.
    interrupted: bool,
}

impl ForceDimension {
    /// Opens the first device that is free. It gives no force before the first write.
    ///
    /// # Errors
    /// When there is no library, or no device that could give a force, with what mends it.
    pub fn open(options: &ForceDimensionOptions) -> Result<Self, DriverError> {
        let api = Dhd::of(LIBRARY.open(&options.library)?, "install a newer Force Dimension SDK (3.14 or later)")?;
        if options.simulator && !api.enable_simulator() {
            return Err(no_device("this library has no simulator", "use the library of a newer SDK"));
        }
        let count = api.device_count();
        if count <= 0 && !options.simulator {
            return Err(no_device(
                "the library sees no device",
                "plug it in and switch it on; on Linux copy the SDK's udev rule to /etc/udev/rules.d so that you may use it without being root",
            ));
        }
        if let Some(which) = options.which.filter(|which| i32::from(*which) >= count.max(1)) {
            let why = format!("there is no device number {}; the library sees {count}", u32::from(which) + 1);
            return Err(no_device(why, "plug it in, or name another one: --device force-dimension#1"));
        }
        let opened = options.which.map_or_else(|| api.open(), |which| api.open_id(which));
        let Some(id) = i8::try_from(opened).ok().filter(|id| *id >= 0) else {
            let why = format!("the device could not be opened ({})", said(&api));
            return Err(no_device(why, "close other programs that use it, and see that you may use the USB device"));
        };
        let shared = Arc::new(Shared {
            api,
            id,
            line: Mutex::new(State::Silent),
            brake: BrakeFlag::default(),
            late_brake: AtomicBool::new(false),
            withheld: AtomicBool::new(false),
        });
        // From here on the device is closed by `Drop`.
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

    /// At which the device talks with the computer, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The device takes its force away by itself when this program has died.
    pub fn has_watchdog(&self) -> bool {
        self.has_watchdog
    }

    /// The library itself gives no more than the largest force.
    pub fn is_limited(&self) -> bool {
        self.is_limited
    }

    /// Writes that met saturated motors.
    pub fn saturated(&self) -> u64 {
        self.saturated
    }

    /// Looks at the force switch now and then, while the force should be on.
    fn watch_switch(&mut self, state: &mut State) {
        self.reads_left = self.reads_left.saturating_sub(1);
        let shared = &self.shared;
        let is_withheld = shared.withheld.load(Ordering::Acquire);
        // Off is where the brake wants it, and where nothing has switched it on.
        if self.reads_left > 0 || shared.brake.is_applied() || (*state != State::Driven && !is_withheld) {
            return;
        }
        self.reads_left = READS_PER_STATUS;
        let Some(words) = shared.api.status(shared.id) else { return };
        let is_on = words[status::FORCE] != 0;
        self.knows_switch |= is_on;
        if is_on {
            // The user has switched it on, if it was off.
            *state = State::Driven;
            shared.withheld.store(false, Ordering::Release);
        } else if matches!(words[status::FORCE_OFF_CAUSE], cause::WATCHDOG | cause::SOFTWARE) {
            self.switch_on = true;
        } else if self.knows_switch && !self.slept() {
            shared.withheld.store(true, Ordering::Release);
        }
    }

    /// The device's watchdog may have switched its force off since the last write.
    fn slept(&self) -> bool {
        self.written.is_none_or(|last| last.elapsed() > WATCHDOG)
    }

    /// Switches the force on, unless it is on, or was switched off by somebody else.
    fn switch_on(&mut self, state: &mut State) -> Result<(), DeviceError> {
        let shared = &self.shared;
        let switched = shared.switch_on();
        if let Switched::Failed = switched {
            let why = format!("its force could not be switched on ({})", said(&shared.api));
            return Err(DeviceError::Refused(Cow::Owned(why)));
        }
        // It was given for a while, and then not: the loop has to know before it is given again.
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

    /// The library's velocity where it knows one, else out of two poses.
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
                // An invalid state would affect all later estimates.
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
        vec![("writes that met saturated motors", self.saturated)]
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
        // It cannot be seen where the status does not tell of the force.
        let words =
            self.shared.api.status(self.shared.id).filter(|words| is_driven && words[status::CONNECTED] != 0)?;
        Some(OwnWatchdog { after: WATCHDOG, has_bitten: words[status::FORCE] == 0 })
    }
}

impl Drop for ForceDimension {
    fn drop(&mut self) {
        let Shared { api, id, .. } = &*self.shared;
        let mut line = self.shared.line();
        // The results of these calls do not matter any more.
        if *line == State::Driven {
            let _ = api.set_wrench([0.0; 3], [0.0; 3], *id);
            let _ = api.enable_force(false, *id);
        }
        let _ = api.close(*id);
        *line = State::Closed;
    }
}

/// Known properties of the device, by its name; the library states no limits.
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
            force_continuous: None,
            torque_continuous: None,
            actuated: rotation(active),
            sensed,
            buttons: 0,
            workspace: None,
            delay: 0.0,
            position_step: 0.0,
            angle_step: 0.0,
        }
    });
    if !active {
        spec.torque_max = 0.0;
        spec.actuated.rotation = 0;
    }
    spec
}

/// Refuses a device whose force would stay off, with what to do about it.
fn check_status(api: &Dhd, id: i8) -> Result<(), DriverError> {
    // A library that does not even say that the device is connected does not fill the status in.
    let Some(words) = api.status(id).filter(|words| words[status::CONNECTED] != 0) else { return Ok(()) };
    if words[status::POWER] == 0 {
        return Err(no_device("the device has no power", "switch it on and release its emergency switch"));
    }
    if words[status::RESET] != 0 {
        let mend = "push its calibration button, or run the maker's HapticInit or HapticDesk";
        return Err(no_device("the device does not know where it is", mend));
    }
    if words[status::ERROR] != 0 {
        let why = format!("the device reports an error ({})", said(api));
        return Err(no_device(why, "switch it off and on again; the maker's HapticDesk says more"));
    }
    Ok(())
}

fn no_device(why: impl Into<String>, mend: &str) -> DriverError {
    DriverError::NoDevice { why: why.into(), mend: mend.to_owned() }
}

/// The library's last error in words, whatever it left out.
fn said(api: &Dhd) -> String {
    let words = api.last_error();
    if words.is_empty() { "the library does not say why".to_owned() } else { words }
}
