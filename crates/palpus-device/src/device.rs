//! The seam to a haptic device, and what is known of devices that do not say it themselves.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use crate::safety::DEVICE_BUTTONS;

/// A device that is held: read where it is, tell it what to push with.
///
/// Poses are of the grip in the device's frame (right-handed); a wrench is about the grip's origin,
/// in the axes of the device's frame. Everything is in SI units. Both calls are made from the servo
/// thread once per tick and must not allocate or wait longer than a tick.
pub trait HapticDevice {
    /// Description of the device.
    fn spec(&self) -> &DeviceSpec;

    /// The newest state.
    ///
    /// # Errors
    /// [`DeviceError::Ended`] when there is nothing more to come; anything else ends the loop as a
    /// fault.
    fn read(&mut self) -> Result<DeviceState, DeviceError>;

    /// Pushes with `wrench` until the next write.
    ///
    /// # Errors
    /// When the device did not take it; the loop then ends as a fault.
    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError>;

    /// True if the device's time advances by reads alone: between reads nothing moves, and the
    /// wrench that it holds does nothing. A run with it can be paused.
    fn stands_unread(&self) -> bool {
        false
    }

    /// Counters of the device itself since it was opened, by name: saturated motors, lost answers.
    /// Read after a run; may obtain memory.
    fn counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }

    /// A handle by which another thread takes the force away when the loop does not answer any
    /// more; `None` when the device has no such way. It stays the same as long as the device is
    /// there.
    fn brake(&self) -> Option<Arc<dyn Brake>> {
        None
    }

    /// Action of the device's own watchdog, in the device or beside it, since the last write;
    /// `None` if it has none that can be queried. For the [self test](crate::self_test()).
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        None
    }
}

/// A watchdog of the device's own, which takes the force when nothing is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnWatchdog {
    /// The time without a write after which it bites.
    pub after: Duration,
    /// It has taken the force since the last write.
    pub has_bitten: bool,
}

/// Takes the force from a device, from any thread and at any time, without waiting.
pub trait Brake: Send + Sync {
    /// From now on the device gives no force but damping, whatever was or will be commanded.
    fn apply(&self);

    /// Enables forces again after a brake. Called from the servo thread only.
    fn release(&self);

    /// True between the two.
    fn is_applied(&self) -> bool;
}

/// A brake for a device that looks at a flag whenever it is about to push.
#[derive(Debug, Default)]
pub struct BrakeFlag(AtomicBool);

impl Brake for BrakeFlag {
    fn apply(&self) {
        self.0.store(true, Ordering::Release);
    }

    fn release(&self) {
        self.0.store(false, Ordering::Release);
    }

    fn is_applied(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

impl<D: HapticDevice + ?Sized> HapticDevice for Box<D> {
    fn spec(&self) -> &DeviceSpec {
        (**self).spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        (**self).read()
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        (**self).write(wrench)
    }

    fn stands_unread(&self) -> bool {
        (**self).stands_unread()
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        (**self).counts()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        (**self).brake()
    }

    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        (**self).own_watchdog()
    }
}

/// State of a device at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceState {
    /// The grip in the device's frame.
    pub pose: Pose,
    /// Velocity of the grip about its origin, in the device's frame.
    pub twist: Twist,
    /// Bit k is set while button k is pressed. The two highest bits are keys of the program, which
    /// the loop adds.
    pub buttons: u32,
    /// Seconds since the device was opened at which this state was sampled: a state that is handed
    /// out again keeps its time, so that one can see that there is no newer one.
    pub time: f64,
    /// The device gives no force now, whatever the command: it is not ready, has no power supply,
    /// was switched off by the person who holds it, or lost an answer.
    /// [`Cut::Withheld`](crate::Cut) follows.
    pub withheld: bool,
}

impl DeviceState {
    /// State of a device that has not reported one yet: its pose is NaN.
    pub(crate) const UNKNOWN: Self = Self {
        pose: Pose { rotation: DQuat::IDENTITY, translation: DVec3::NAN },
        twist: Twist { angular: DVec3::ZERO, linear: DVec3::ZERO },
        buttons: 0,
        time: 0.0,
        withheld: false,
    };

    /// Returns the state with the program's `keys` beside the device's own buttons.
    pub(crate) fn with_keys(self, keys: u32) -> Self {
        Self { buttons: self.buttons & DEVICE_BUTTONS | keys, ..self }
    }
}

/// Why a device did not answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// A recording has been played to its end.
    #[error("there are no more recorded states")]
    Ended,
    /// The connection is gone.
    #[error("the device is lost: {0}")]
    Lost(Cow<'static, str>),
    /// The device refused the wrench.
    #[error("the device refused the wrench: {0}")]
    Refused(Cow<'static, str>),
}

/// How many axes of each kind a device has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes {
    /// 0 to 3.
    pub translation: u8,
    /// 0 to 3.
    pub rotation: u8,
    /// 0 or 1; palpus does not drive it.
    pub gripper: u8,
}

impl Axes {
    /// Position only.
    pub const TRANSLATION: Self = Self { translation: 3, rotation: 0, gripper: 0 };
    /// Position and orientation.
    pub const FULL: Self = Self { translation: 3, rotation: 3, gripper: 0 };
}

/// Capabilities and limits of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSpec {
    /// As its maker writes it.
    pub name: Cow<'static, str>,
    /// Largest force, N; infinite when unlimited.
    pub force_max: f64,
    /// Largest torque, N·m; 0 when it has none.
    pub torque_max: f64,
    /// Force that its motors bear continuously, N, if the maker states it.
    pub force_continuous: Option<f64>,
    /// Torque that its motors bear continuously, N·m, if the maker states it.
    pub torque_continuous: Option<f64>,
    /// Axes with motors.
    pub actuated: Axes,
    /// Axes with sensors.
    pub sensed: Axes,
    /// Buttons that the loop sees, 0 when none or not known: with buttons, forces are asked for by
    /// holding one.
    pub buttons: u8,
    /// Sides of the box that the grip can reach, m, when the maker states it.
    pub workspace: Option<DVec3>,
    /// From a write until it acts, beyond being held for a tick, s; 0 when not known.
    pub delay: f64,
    /// Smallest change of a sensed position, m; 0 when there is none or it is not known.
    pub position_step: f64,
    /// Smallest change of a sensed orientation, rad, likewise.
    pub angle_step: f64,
}

/// N, as the makers' data sheets state them.
const CONTINUOUS_FORCES: [(&str, f64); 6] = [
    ("Phantom Premium 1.5/6DOF", 1.4),
    ("Phantom Premium 3.0/6DOF", 3.0),
    ("Touch", 0.88),
    ("Touch X", 1.75),
    ("omega.6", 12.0),
    ("omega.7", 12.0),
];

/// Conservative limits for devices that do not report their own: force and torque as seen in
/// shipped drivers, continuous force and workspace as stated by the makers. Buttons are left to the
/// back ends, which see them.
pub fn known_devices() -> [DeviceSpec; 10] {
    let gripper = |rotation| Axes { translation: 3, rotation, gripper: 1 };
    let spec =
        |name: &'static str, force_max, torque_max, actuated, sensed, workspace_mm: Option<[f64; 3]>| DeviceSpec {
            name: Cow::Borrowed(name),
            force_max,
            torque_max,
            force_continuous: CONTINUOUS_FORCES.into_iter().find(|known| known.0 == name).map(|known| known.1),
            torque_continuous: None,
            actuated,
            sensed,
            buttons: 0,
            workspace: workspace_mm.map(|mm| DVec3::from_array(mm) * 1e-3),
            delay: 0.0,
            position_step: 0.0,
            angle_step: 0.0,
        };
    [
        spec("Phantom Premium 1.5/6DOF", 8.5, 0.188, Axes::FULL, Axes::FULL, Some([381.0, 267.0, 191.0])),
        spec("Phantom Premium 3.0/6DOF", 22.0, 0.188, Axes::FULL, Axes::FULL, Some([838.0, 584.0, 406.0])),
        spec("Touch", 3.3, 0.0, Axes::TRANSLATION, Axes::FULL, Some([160.0, 120.0, 70.0])),
        spec("Touch X", 7.9, 0.0, Axes::TRANSLATION, Axes::FULL, Some([160.0, 120.0, 120.0])),
        spec("omega.6", 12.0, 0.0, Axes::TRANSLATION, Axes::FULL, Some([160.0, 160.0, 110.0])),
        spec("omega.7", 12.0, 0.0, gripper(0), gripper(3), Some([160.0, 160.0, 110.0])),
        spec("sigma.7", 12.0, 0.2, gripper(3), gripper(3), None),
        spec("lambda.7", 12.0, 0.2, gripper(3), gripper(3), None),
        spec("Falcon", 8.0, 0.0, Axes::TRANSLATION, Axes::TRANSLATION, Some([102.0, 102.0, 102.0])),
        spec("Inverse3", 10.0, 0.0, Axes::TRANSLATION, Axes::FULL, None),
    ]
}
