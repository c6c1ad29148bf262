//! A SpaceMouse as a hand: six axes of input, no force.
//!
//! The cap hardly moves; a push on it is a speed. So the device's pose moves on by that speed in
//! every read, for as long as the cap is pushed.
//!
//! 1. Devices are found in the kernel's list of HID devices by vendor, product and kind (`hidraw`),
//!    and read through `/dev/hidraw*`. No driver and no library is needed, but the permission to
//!    read that file.
//! 2. Each read of the loop takes in the reports that have come (`report`), without waiting.
//! 3. Small deflections count as none; from there on the speed rises to its largest at full
//!    deflection.
//! 4. A cap that is pushed says so many times a second. One that has not for a quarter of a second
//!    counts as let go.
//!
//! Axes are palpus's for hands: +X right, +Y away from the user, +Z up. The reports are tested
//! against bytes as documented; no device was at hand. In a window it moves the simulated hand, as
//! the keyboard does; that is the window's.

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

/// m/s at full deflection: a hand's span in a second and a half.
const FASTEST: f64 = 0.12;
/// rad/s at full deflection: a quarter turn in a second.
const FASTEST_TURN: f64 = 1.6;
/// Share of the full deflection that counts as none: caps rest within a twentieth, and a push along
/// one axis leaks into others.
const DEAD_ZONE: f64 = 0.08;
/// Without a report for this long, the cap counts as let go.
const SILENCE: Duration = Duration::from_millis(250);
/// s: the most that the pose goes on by in one read.
const LONGEST_STEP: f64 = 0.05;
/// Reports that are taken in by one read; they come at most some hundreds of times a second.
const MOST_REPORTS: usize = 64;

/// Why there is no SpaceMouse.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SpaceMouseError {
    /// None is plugged in.
    #[error("no SpaceMouse is plugged in")]
    None,
    /// There is one that may not be read.
    #[error("{path} may not be read ({why}); mend: {mend}")]
    Denied {
        /// Its file.
        path: String,
        /// Error of the system.
        why: String,
        /// One line for a shell.
        mend: String,
    },
    /// Something else is in the way.
    #[error("{path} cannot be opened: {why}")]
    Unusable {
        /// Its file.
        path: String,
        /// Error of the system.
        why: String,
    },
    /// Not on this system.
    #[error("SpaceMouse devices are read through Linux's hidraw, which this system has not")]
    NotHere,
}

/// A SpaceMouse; see the module's outline.
pub struct SpaceMouse {
    source: Box<dyn Read + Send>,
    spec: DeviceSpec,
    cap: Cap,
    pose: Pose,
    opened: Instant,
    /// When it was read, and when a report came, last.
    read: Instant,
    heard: Instant,
}

impl SpaceMouse {
    /// The device at `path`, such as `/dev/hidraw3`; `None`: the first that is found.
    ///
    /// # Errors
    /// Fails without a device, or if it cannot be read; the error has the line that mends it.
    #[cfg(target_os = "linux")]
    pub fn open(path: Option<&str>) -> Result<Self, SpaceMouseError> {
        let (file, name) = hidraw::open(path)?;
        Ok(Self::of(Box::new(file), name, Instant::now()))
    }

    /// The device at `path`, such as `/dev/hidraw3`; `None`: the first that is found.
    ///
    /// # Errors
    /// Always: there is no way to read it here.
    #[cfg(not(target_os = "linux"))]
    pub fn open(_: Option<&str>) -> Result<Self, SpaceMouseError> {
        Err(SpaceMouseError::NotHere)
    }

    /// A device whose reports come out of `source`, one a read: for systems and ways other than
    /// Linux's hidraw.
    ///
    /// A read must not wait: without a report it fails as [`ErrorKind::WouldBlock`]. Any other
    /// failure, and an end, is a device that is lost.
    pub fn of_reports(source: impl Read + Send + 'static, name: impl Into<String>) -> Self {
        Self::of(Box::new(source), name.into(), Instant::now())
    }

    fn of(source: Box<dyn Read + Send>, name: String, now: Instant) -> Self {
        let spec = spec_of(name);
        Self { source, spec, cap: Cap::default(), pose: Pose::IDENTITY, opened: now, read: now, heard: now }
    }

    /// The state at `now`.
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
                Ok(0) => return Err(lost("its file has ended")),
                Ok(length) => {
                    // Reports of other parts (a battery, a screen) are passed over.
                    if self.cap.take(&report[..length]) {
                        self.heard = now;
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(lost("it is not plugged in any more")),
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

    /// Nothing: it has no motors.
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
        // It has some, but there is no force to ask for by pressing them.
        buttons: 0,
        workspace: None,
        delay: 0.0,
        position_step: 0.0,
        angle_step: 0.0,
    }
}

/// Speed that a deflection asks for.
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

    /// Reports that come when they are put in.
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

    /// Reads every millisecond from `from` for `ticks`, with `report` coming before each hundredth.
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

    /// Full deflection along the device's first axis, -350 along its second, none along its third.
    const PUSHED: [u8; 7] = [1, 0x5e, 0x01, 0xa2, 0xfe, 0, 0];

    #[test]
    fn a_push_is_a_speed() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 1000, &PUSHED);
        // Towards the user is the device's second axis and palpus's -Y.
        assert!(state.twist.linear.distance(DVec3::new(FASTEST, FASTEST, 0.0)) < 1e-12, "{:?}", state.twist);
        assert!(state.pose.translation.distance(DVec3::new(FASTEST, FASTEST, 0.0)) < 1e-9, "{:?}", state.pose);
        assert_eq!((state.pose.rotation, state.twist.angular), (DQuat::IDENTITY, DVec3::ZERO));
        assert!((state.time - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_turn_is_a_rate_of_turn_and_stays_a_rotation() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 5000, &[2, 0, 0, 0, 0, 0xa2, 0xfe]);
        assert!(state.twist.angular.distance(DVec3::new(0.0, 0.0, FASTEST_TURN)) < 1e-12);
        let turned = DQuat::from_rotation_z(5.0 * FASTEST_TURN);
        assert!(state.pose.rotation.dot(turned).abs() > 1.0 - 1e-9 && state.pose.is_valid());
    }

    #[test]
    fn a_cap_at_rest_does_not_creep() {
        let (mut mouse, bytes, now) = mouse();
        let state = push(&mut mouse, &bytes, now, 1000, &[1, 20, 0, 0xec, 0xff, 9, 0, 27, 0, 0, 0, 0xe5, 0xff]);
        assert_eq!((state.pose, state.twist), (Pose::IDENTITY, Twist::default()));
    }

    #[test]
    fn a_cap_that_says_nothing_is_let_go() {
        let (mut mouse, bytes, now) = mouse();
        push(&mut mouse, &bytes, now, 100, &PUSHED);
        let later = mouse.read_at(now + Duration::from_millis(400)).unwrap();
        assert_eq!(later.twist, Twist::default());
        assert!(later.pose.translation.x < 0.1 * FASTEST + 1e-6, "it must not run on: {:?}", later.pose);
    }

    #[test]
    fn buttons_are_seen_and_strange_reports_are_not() {
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
    fn a_mouse_that_is_unplugged_is_lost() {
        let (mut mouse, bytes, now) = mouse();
        bytes.0.lock().unwrap().push_back(Err(ErrorKind::NotFound.into()));
        assert!(matches!(mouse.read_at(now), Err(DeviceError::Lost(_))));
        bytes.put(&[]);
        assert!(matches!(mouse.read_at(now), Err(DeviceError::Lost(_))));
    }
}
