//! A SpaceMouse as an input device: six axes, no force.
//!
//! The cap hardly moves; its deflection sets a velocity. In every read the pose moves on with this
//! velocity, as long as the cap is pushed.
//!
//! 1. Devices are found in the kernel's list of HID devices by vendor, product and kind (`hidraw`),
//!    and read through `/dev/hidraw*`. Reading needs no driver and no library, only the permission
//!    to read that file.
//! 2. Each read of the loop takes the reports that have arrived (`report`), without waiting.
//! 3. Small deflections count as zero. Beyond this dead zone, the speed rises linearly to its
//!    maximum at full deflection.
//! 4. A pushed cap sends reports many times a second. Without a report for a quarter of a second,
//!    the cap counts as released.
//!
//! The axes follow the convention of palpus: +X right, +Y away from the user, +Z up. The
//! reports are tested against documented byte sequences; no device was available. In a window, the
//! SpaceMouse moves the simulated operator, as the keyboard does. The window implements this
//! motion.

#[cfg(target_os = "linux")]
mod hidraw;
mod look;
mod report;

use std::borrow::Cow;
use std::io::{ErrorKind, Read};
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use crate::device::{Axes, DeviceError, DeviceSpec, DeviceState, HapticDevice};
use report::Cap;

pub(crate) use look::look;

/// Largest speed, m/s, at full deflection: the reach of a hand in a second and a half.
const FASTEST: f64 = 0.12;
/// Largest rotation speed, rad/s, at full deflection: about a quarter turn per second.
const FASTEST_TURN: f64 = 1.6;
/// Fraction of the full deflection that counts as zero. A cap at rest reports up to a twentieth,
/// and a push along one axis also shows on other axes.
const DEAD_ZONE: f64 = 0.08;
/// Without a report for this time, the cap counts as released.
const SILENCE: Duration = Duration::from_millis(250);
/// Longest time by which one read moves the pose, s.
const LONGEST_STEP: f64 = 0.05;
/// Largest number of reports that one read takes. Some hundreds of reports arrive per second.
const MOST_REPORTS: usize = 64;

/// The reason why there is no SpaceMouse.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SpaceMouseError {
    /// No SpaceMouse is connected.
    #[error("no SpaceMouse is plugged in")]
    None,
    /// A SpaceMouse is connected, but this user may not read it.
    #[error("this user may not read {path} ({why}); mend: {mend}")]
    Denied {
        /// Device file.
        path: String,
        /// Error of the system.
        why: String,
        /// Shell command that gives the permission.
        mend: String,
    },
    /// The device file cannot be opened.
    #[error("{path} cannot be opened: {why}")]
    Unusable {
        /// Device file.
        path: String,
        /// Error of the system.
        why: String,
    },
    /// This system is not supported.
    #[error("a SpaceMouse is read through Linux's hidraw, which this system does not have")]
    NotHere,
}

/// A SpaceMouse; the module describes how its reports set the pose.
pub struct SpaceMouse {
    source: Box<dyn Read + Send>,
    spec: DeviceSpec,
    cap: Cap,
    pose: Pose,
    opened: Instant,
    /// Time of the last read, and time of the last report.
    read: Instant,
    heard: Instant,
}

impl SpaceMouse {
    /// Opens the device at `path`, such as `/dev/hidraw3`; with `None`, the first device that is
    /// found.
    ///
    /// # Errors
    /// Fails if there is no device, or if it cannot be read. The error contains the command that
    /// fixes the problem.
    #[cfg(target_os = "linux")]
    pub fn open(path: Option<&str>) -> Result<Self, SpaceMouseError> {
        let (file, name) = hidraw::open(path)?;
        Ok(Self::of(Box::new(file), name, Instant::now()))
    }

    /// Opens the device at `path`, such as `/dev/hidraw3`; with `None`, the first device that is
    /// found.
    ///
    /// # Errors
    /// Always fails: this system has no hidraw.
    #[cfg(not(target_os = "linux"))]
    pub fn open(_: Option<&str>) -> Result<Self, SpaceMouseError> {
        Err(SpaceMouseError::NotHere)
    }

    /// Returns a device that reads its reports from `source`, one report per read. Use this
    /// function for other systems and sources than Linux's hidraw.
    ///
    /// A read must not wait: without a report it must fail with [`ErrorKind::WouldBlock`]. Any
    /// other error, and an end of the source, means that the device is lost.
    pub fn of_reports(source: impl Read + Send + 'static, name: impl Into<String>) -> Self {
        Self::of(Box::new(source), name.into(), Instant::now())
    }

    fn of(source: Box<dyn Read + Send>, name: String, now: Instant) -> Self {
        let spec = spec_of(name);
        Self { source, spec, cap: Cap::default(), pose: Pose::IDENTITY, opened: now, read: now, heard: now }
    }

    /// Returns the state at `now`.
    fn read_at(&mut self, now: Instant) -> Result<DeviceState, DeviceError> {
        self.take_reports(now)?;
        if now.duration_since(self.heard) > SILENCE {
            self.cap.let_go();
        }
        let twist = speed(&self.cap);
        let passed = now.duration_since(self.read).as_secs_f64().min(LONGEST_STEP);
        self.pose.translation += twist.linear * passed;
        self.pose.rotation = (DQuat::from_scaled_axis(twist.angular * passed) * self.pose.rotation).normalize();
        self.read = now;
        let time = now.duration_since(self.opened).as_secs_f64();
        Ok(DeviceState { pose: self.pose, twist, buttons: self.cap.buttons, time, withheld: false })
    }

    fn take_reports(&mut self, now: Instant) -> Result<(), DeviceError> {
        let mut report = [0; report::LONGEST];
        for _ in 0..MOST_REPORTS {
            match self.source.read(&mut report) {
                Ok(0) => return Err(lost("its device file has ended")),
                Ok(length) => {
                    // Reports of other parts, such as a battery or a screen, are ignored.
                    if self.cap.take(&report[..length]) {
                        self.heard = now;
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(lost("it was unplugged")),
            }
        }
        Ok(())
    }
}

impl HapticDevice for SpaceMouse {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.read_at(Instant::now())
    }

    /// Does nothing, since the device has no motors.
    fn write(&mut self, _: &Wrench) -> Result<(), DeviceError> {
        Ok(())
    }
}

fn lost(why: &'static str) -> DeviceError {
    DeviceError::Lost(Cow::Borrowed(why))
}

fn spec_of(name: String) -> DeviceSpec {
    DeviceSpec {
        name: Cow::Owned(name),
        force_max: 0.0,
        torque_max: 0.0,
        force_continuous: None,
        torque_continuous: None,
        actuated: Axes { translation: 0, rotation: 0, gripper: 0 },
        sensed: Axes::FULL,
        // The device has buttons, but there is no force that they could enable.
        buttons: 0,
        workspace: None,
        delay: 0.0,
        position_step: 0.0,
        angle_step: 0.0,
    }
}

/// Returns the velocity for a deflection.
fn speed(cap: &Cap) -> Twist {
    let shaped = |axes: DVec3| {
        let beyond = |share: f64| share.signum() * ((share.abs() - DEAD_ZONE) / (1.0 - DEAD_ZONE)).clamp(0.0, 1.0);
        DVec3::new(beyond(axes.x), beyond(axes.y), beyond(axes.z))
    };
    Twist { angular: shaped(cap.turn) * FASTEST_TURN, linear: shaped(cap.push) * FASTEST }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::io;
    use std::sync::{Arc, Mutex};

    use super::*;

    /// A source of reports that the test puts in.
    #[derive(Clone, Default)]
    struct Bytes(Arc<Mutex<VecDeque<io::Result<Vec<u8>>>>>);

    impl Bytes {
        fn put(&self, report: &[u8]) {
            self.0.lock().unwrap().push_back(Ok(report.to_vec()));
        }
    }

    impl Read for Bytes {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let next = self.0.lock().unwrap().pop_front().unwrap_or(Err(ErrorKind::WouldBlock.into()))?;
            buffer[..next.len()].copy_from_slice(&next);
            Ok(next.len())
        }
    }

    fn mouse() -> (SpaceMouse, Bytes, Instant) {
        let (bytes, now) = (Bytes::default(), Instant::now());
        (SpaceMouse::of(Box::new(bytes.clone()), "SpaceMouse".to_owned(), now), bytes, now)
    }

    /// Reads once per millisecond from `from` on, `ticks` times. A `report` arrives before every
    /// hundredth read.
    fn push(mouse: &mut SpaceMouse, bytes: &Bytes, from: Instant, ticks: u64, report: &[u8]) -> DeviceState {
        let mut last = None;
        for tick in 1..=ticks {
            if tick % 100 == 1 {
                bytes.put(report);
            }
            last = Some(mouse.read_at(from + Duration::from_millis(tick)).unwrap());
        }
        last.unwrap()
    }

    /// Full deflection along the device's first axis, -350 along the second, 0 along the third.
    const PUSHED: [u8; 7] = [1, 0x5e, 0x01, 0xa2, 0xfe, 0, 0];

    #[test]
    fn push_sets_a_speed() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 1000, &PUSHED);
        // The device's second axis points towards the user, which is -Y in palpus.
        assert!(state.twist.linear.distance(DVec3::new(FASTEST, FASTEST, 0.0)) < 1e-12, "{:?}", state.twist);
        assert!(state.pose.translation.distance(DVec3::new(FASTEST, FASTEST, 0.0)) < 1e-9, "{:?}", state.pose);
        assert_eq!((state.pose.rotation, state.twist.angular), (DQuat::IDENTITY, DVec3::ZERO));
        assert!((state.time - 1.0).abs() < 1e-12);
    }

    #[test]
    fn twist_of_cap_sets_a_rotation_speed() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 5000, &[2, 0, 0, 0, 0, 0xa2, 0xfe]);
        assert!(state.twist.angular.distance(DVec3::new(0.0, 0.0, FASTEST_TURN)) < 1e-12);
        let turned = DQuat::from_rotation_z(5.0 * FASTEST_TURN);
        assert!(state.pose.rotation.dot(turned).abs() > 1.0 - 1e-9 && state.pose.is_valid());
    }

    #[test]
    fn cap_at_rest_does_not_drift() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 1000, &[1, 20, 0, 0xec, 0xff, 9, 0, 27, 0, 0, 0, 0xe5, 0xff]);
        assert_eq!((state.pose, state.twist), (Pose::IDENTITY, Twist::default()));
    }

    #[test]
    fn silent_cap_counts_as_released() {
        let (mut mouse, bytes, now) = mouse();
        push(&mut mouse, &bytes, now, 100, &PUSHED);
        let later = mouse.read_at(now + Duration::from_millis(400)).unwrap();
        assert_eq!(later.twist, Twist::default());
        assert!(later.pose.translation.x < 0.1 * FASTEST + 1e-6, "the pose must stop: {:?}", later.pose);
    }

    #[test]
    fn buttons_are_read_and_unknown_reports_ignored() {
        let (mut mouse, bytes, now) = mouse();
        for report in [&[3, 0b10, 0][..], &[23, 99], &[1], &[1, 2, 3], &[]] {
            if !report.is_empty() {
                bytes.put(report);
            }
        }
        let state = mouse.read_at(now + Duration::from_millis(1)).unwrap();
        assert_eq!((state.buttons, state.twist), (0b10, Twist::default()));
    }

    #[test]
    fn unplugged_mouse_is_lost() {
        let (mut mouse, bytes, now) = mouse();
        bytes.0.lock().unwrap().push_back(Err(ErrorKind::NotFound.into()));
        assert!(matches!(mouse.read_at(now), Err(DeviceError::Lost(_))));
        bytes.put(&[]);
        assert!(matches!(mouse.read_at(now), Err(DeviceError::Lost(_))));
    }
}
