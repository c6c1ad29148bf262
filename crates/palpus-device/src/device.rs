//! The interface to a haptic device, and the data sheets of devices that do not report their
//! limits.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use crate::safety::DEVICE_BUTTONS;

/// A haptic device: it reports the pose of its grip and applies a commanded wrench.
///
/// Poses are of the grip in the device's frame (right-handed). A wrench is about the grip's origin,
/// in the axes of the device's frame. All units are SI. The servo thread calls `read` and `write`
/// once per tick. The two functions must not allocate, and must not wait longer than a tick.
pub trait HapticDevice {
    /// Description of the device.
    fn spec(&self) -> &DeviceSpec;

    /// Returns the newest state.
    ///
    /// # Errors
    /// Fails with [`DeviceError::Ended`] if no more states will come. Any other error ends the loop
    /// as a fault.
    fn read(&mut self) -> Result<DeviceState, DeviceError>;

    /// Applies `wrench` until the next write.
    ///
    /// # Errors
    /// Fails if the device did not accept the wrench. The loop then ends as a fault.
    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError>;

    /// Returns true if the device's time advances only in a read. Between two reads nothing moves,
    /// and the commanded wrench has no effect. A run with such a device can be paused.
    fn stands_unread(&self) -> bool {
        false
    }

    /// Returns the device's own counters since it was opened, by name, such as saturated motors or
    /// lost answers. The loop's caller reads these counters after a run, so this function may
    /// allocate.
    fn counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }

    /// Returns a handle with which another thread can remove the force when the loop stops
    /// responding; `None` if the device has no such handle. The handle stays valid as long as the
    /// device exists.
    fn brake(&self) -> Option<Arc<dyn Brake>> {
        None
    }

    /// Returns the state of the device's own watchdog since the last write; `None` if the device
    /// has no watchdog that can be queried. The watchdog may run in the device or in its driver.
    /// The [self test](crate::self_test()) calls this function.
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        None
    }
}

/// State of a device's own watchdog, which removes the force when no wrench is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnWatchdog {
    /// The watchdog trips when no wrench was written for this time.
    pub after: Duration,
    /// True if the watchdog has removed the force since the last write.
    pub has_bitten: bool,
}

/// Removes the force of a device, from any thread and at any time, without waiting.
pub trait Brake: Send + Sync {
    /// Applies the brake: until it is released, the device gives no force but damping, whatever
    /// wrench is commanded.
    fn apply(&self);

    /// Releases the brake: the device gives force again. Only the servo thread calls this.
    fn release(&self);

    /// Returns true while the brake is applied.
    fn is_applied(&self) -> bool;
}

/// A brake for a device that checks this flag whenever it is about to give force.
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

/// State of a device at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceState {
    /// Pose of the grip in the device's frame.
    pub pose: Pose,
    /// Velocity of the grip (m/s at its origin, and rad/s), in the device's frame.
    pub twist: Twist,
    /// Bit k is set while button k is pressed. The two highest bits are keys of the program; the
    /// loop sets these bits.
    pub buttons: u32,
    /// Time at which this state was sampled, s since the device was opened. A state that `read`
    /// returns again keeps its time, so a repeated time shows that there is no newer state.
    pub time: f64,
    /// True if the device gives no force now, whatever wrench is commanded. The causes are: the
    /// device is not ready, it has no power, an answer was lost, or the user switched its force
    /// off. The safety chain then applies [`Cut::Withheld`](crate::Cut).
    pub withheld: bool,
}

impl DeviceState {
    /// State of a device that has not reported a state yet: its pose is NaN.
    pub(crate) const UNKNOWN: Self = Self {
        pose: Pose { rotation: DQuat::IDENTITY, translation: DVec3::NAN },
        twist: Twist { angular: DVec3::ZERO, linear: DVec3::ZERO },
        buttons: 0,
        time: 0.0,
        withheld: false,
    };

    /// Returns the state with the program's `keys` added to the device's own buttons.
    pub(crate) fn with_keys(self, keys: u32) -> Self {
        Self { buttons: self.buttons & DEVICE_BUTTONS | keys, ..self }
    }
}

/// The reason why a device did not answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// A recording has been played to its end.
    #[error("there are no more recorded states")]
    Ended,
    /// The connection to the device is lost.
    #[error("the device is lost: {0}")]
    Lost(Cow<'static, str>),
    /// The device refused the wrench.
    #[error("the device refused the wrench: {0}")]
    Refused(Cow<'static, str>),
}

/// Number of axes of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes {
    /// Number of translational axes, 0 to 3.
    pub translation: u8,
    /// Number of rotational axes, 0 to 3.
    pub rotation: u8,
    /// Number of grippers, 0 or 1. Grippers are not driven.
    pub gripper: u8,
}

impl Axes {
    /// Position only.
    pub const TRANSLATION: Self = Self { translation: 3, rotation: 0, gripper: 0 };
    /// Position and orientation.
    pub const FULL: Self = Self { translation: 3, rotation: 3, gripper: 0 };
}

/// Capabilities and limits of a device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceSpec {
    /// The name, as the maker writes it.
    pub name: Cow<'static, str>,
    /// Largest force, N; infinite if unlimited.
    pub force_max: f64,
    /// Largest torque, N·m; 0 if the device gives no torque.
    pub torque_max: f64,
    /// Force that the motors can hold continuously, N, if the maker states it.
    pub force_continuous: Option<f64>,
    /// Torque that the motors can hold continuously, N·m, if the maker states it.
    pub torque_continuous: Option<f64>,
    /// Axes with motors.
    pub actuated: Axes,
    /// Axes with sensors.
    pub sensed: Axes,
    /// Number of buttons that the loop sees; 0 without buttons or if the number is unknown. If a
    /// device has buttons, the user enables forces by holding one of them.
    pub buttons: u8,
    /// Sides of the box that the grip can reach, m, if the maker states them.
    pub workspace: Option<DVec3>,
    /// Time from a write until the wrench acts, s, not counting the one tick for which a wrench is
    /// held; 0 if unknown.
    pub delay: f64,
    /// Smallest change of a sensed position, m; 0 if the sensor has no steps or the step is
    /// unknown.
    pub position_step: f64,
    /// Smallest change of a sensed orientation, rad; 0 if the sensor has no steps or the step is
    /// unknown.
    pub angle_step: f64,
}

/// Continuous forces, N, from the makers' data sheets.
const CONTINUOUS_FORCES: [(&str, f64); 6] = [
    ("Phantom Premium 1.5/6DOF", 1.4),
    ("Phantom Premium 3.0/6DOF", 3.0),
    ("Touch", 0.88),
    ("Touch X", 1.75),
    ("omega.6", 12.0),
    ("omega.7", 12.0),
];

/// Returns conservative limits for devices that do not report their own. Force and torque are the
/// limits in shipped drivers; continuous force and workspace come from the makers' data sheets. The
/// number of buttons is 0, since the back ends read it from the device.
pub fn known_devices() -> [DeviceSpec; 10] {
    let gripper = |rotation| Axes { translation: 3, rotation, gripper: 1 };
    let spec =
        |name: &'static str, force_max, torque_max, actuated, sensed, workspace_mm: Option<[f64; 3]>| DeviceSpec {
            name: Cow::Borrowed(name),
            force_max,
            torque_max,
            force_continuous: CONTINUOUS_FORCES.into_iter().find(|known| known.0 == name).map(|known| known.1),
            actuated,
            sensed,
            workspace: workspace_mm.map(|mm| DVec3::from_array(mm) * 1e-3),
            ..DeviceSpec::default()
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
