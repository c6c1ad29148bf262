//! The work of HDAPI's thread in each of its turns.
//!
//! 1. Begin a frame. Read transform, velocity and buttons, and convert them to our units and axes.
//! 2. Take the newest wrench. If the wrench is too old, apply zero. If the brake is applied, apply
//!    damping instead. Also apply zero if the wrench was computed before the loop knew of the last
//!    gap (see below).
//! 3. Write the wrench. End the frame.
//! 4. Fetch the errors. Force errors are counted. Any other error is a failure, and after it the
//!    wrench is zero.
//! 5. Publish the state.
//!
//! **Gaps.** A gap is a time in which zero is applied instead of the written wrench, or in which
//! the driver applies no force because of its limits. After a gap, the loop would continue from a
//! wrench that the user does not feel. So each gap gets a number and is reported to the loop: the
//! next state is marked as withheld. A wrench that was computed before that report is not applied.
//! After the report the loop increases the force from zero.
//!
//! When the program requests the end, the thread writes a force of zero, and the maker's library
//! does not call it again. The thread never waits and never allocates.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::{DMat3, DVec3};
use palpus::algebra::{Pose, Twist, Wrench, rotation_between};
use palpus_device::{Brake, BrakeFlag, DeviceState, Newest, Publisher, SafetyLimits};

use super::{ERRORS_AT_A_TIME, ForceErrors, MILLI, errors, number};
use crate::axes::Axes;
use crate::ffi::hd::{Hd, TurnCallbacks};

/// Maximum age of a wrench that is applied, s. The limit allows four late ticks of a loop at 1 kHz.
/// In that time the largest force of a Touch moves a light hand by 0.2 mm.
pub(super) const STALE: f64 = 5e-3;
/// Cutoff frequency of the angular velocity, Hz. The angular velocity is estimated here because
/// HDAPI's angular velocity is not documented well enough.
const TURN_CUTOFF_HZ: f64 = 50.0;
/// Shortest time between turns from which a velocity is computed, s.
const SHORTEST_TURN: f64 = 0.1e-3;

/// A wrench, and the time at which it was written (s).
#[derive(Clone, Copy)]
pub(super) struct Command {
    pub(super) wrench: Wrench,
    pub(super) time: f64,
    /// Number of the last gap that the loop knew.
    pub(super) gap: u64,
}

impl Command {
    /// The value before the first write.
    pub(super) const NONE: Self = Self { wrench: Wrench::ZERO, time: f64::NEG_INFINITY, gap: 0 };
}

/// A state for the loop.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) state: DeviceState,
    /// Number of gaps so far.
    pub(super) gap: u64,
}

impl Default for Sample {
    fn default() -> Self {
        Self {
            state: DeviceState {
                pose: Pose::IDENTITY,
                twist: Twist::default(),
                buttons: 0,
                time: 0.0,
                withheld: false,
            },
            gap: 0,
        }
    }
}

/// Flags and counters that both threads use.
pub(super) struct Shared {
    origin: Instant,
    brake: Arc<BrakeFlag>,
    ending: AtomicBool,
    ended: Arc<AtomicBool>,
    /// Code of the error that ended the run, or 0.
    failure: AtomicU32,
    warm_motors: AtomicU64,
    exceeded: AtomicU64,
    /// Number of turns in which the wrench was too old.
    stale: AtomicU64,
    in_a_row: AtomicU32,
    last_force_error: AtomicU32,
}

impl Shared {
    pub(super) fn new(origin: Instant) -> Self {
        Self {
            origin,
            brake: Arc::default(),
            ending: AtomicBool::new(false),
            ended: Arc::default(),
            failure: AtomicU32::new(0),
            warm_motors: AtomicU64::new(0),
            exceeded: AtomicU64::new(0),
            stale: AtomicU64::new(0),
            in_a_row: AtomicU32::new(0),
            last_force_error: AtomicU32::new(0),
        }
    }

    /// Returns the time since the device was opened, s.
    pub(super) fn now(&self) -> f64 {
        self.origin.elapsed().as_secs_f64()
    }

    pub(super) fn brake(&self) -> Arc<dyn Brake> {
        self.brake.clone()
    }

    /// Returns the code of the error that ended the run.
    pub(super) fn failure(&self) -> Option<u32> {
        Some(self.failure.load(Ordering::Acquire)).filter(|code| *code != 0)
    }

    pub(super) fn force_errors(&self) -> ForceErrors {
        ForceErrors {
            warm_motors: self.warm_motors.load(Ordering::Relaxed),
            exceeded: self.exceeded.load(Ordering::Relaxed),
        }
    }

    /// Returns the number of turns in which the wrench was too old.
    pub(super) fn stale(&self) -> u64 {
        self.stale.load(Ordering::Relaxed)
    }

    pub(super) fn force_errors_in_a_row(&self) -> u32 {
        self.in_a_row.load(Ordering::Relaxed)
    }

    pub(super) fn last_force_error(&self) -> u32 {
        self.last_force_error.load(Ordering::Relaxed)
    }

    /// Requests the last turn. Returns true if the last turn came in time.
    pub(super) fn end_and_wait(&self, most: Duration) -> bool {
        self.ending.store(true, Ordering::Release);
        let begun = Instant::now();
        while !self.ended.load(Ordering::Acquire) {
            if begun.elapsed() > most {
                return false;
            }
            std::thread::sleep(Duration::from_micros(500));
        }
        true
    }

    fn take_error(&self, code: u32) {
        if !errors::is_of_force(code) {
            // Keeps the first error, because it caused the later errors.
            let _ = self.failure.compare_exchange(0, code, Ordering::AcqRel, Ordering::Relaxed);
            return;
        }
        let counter = if code == errors::WARM_MOTORS { &self.warm_motors } else { &self.exceeded };
        counter.fetch_add(1, Ordering::Relaxed);
        self.last_force_error.store(code, Ordering::Relaxed);
    }
}

/// The part that the device's thread uses.
pub(super) struct Touch {
    api: Arc<Hd>,
    handle: u32,
    has_torque: bool,
    limits: SafetyLimits,
    shared: Arc<Shared>,
    commands: Newest<Command>,
    samples: Publisher<Sample>,
    last: Option<DeviceState>,
    /// Number of gaps so far.
    gap: u64,
    /// True if a wrench was applied in the last turn.
    given: bool,
}

impl Touch {
    pub(super) fn new(
        api: Arc<Hd>,
        handle: u32,
        has_torque: bool,
        limits: SafetyLimits,
        shared: Arc<Shared>,
        commands: Newest<Command>,
        samples: Publisher<Sample>,
    ) -> Self {
        Self { api, handle, has_torque, limits, shared, commands, samples, last: None, gap: 0, given: false }
    }

    fn sense(&self) -> DeviceState {
        let time = self.shared.now();
        let m: [f64; 16] = self.api.doubles(number::TRANSFORM);
        let velocity = DVec3::from_array(self.api.doubles(number::VELOCITY)) * MILLI;
        let buttons = self.api.integer(number::BUTTONS) as u32;
        // The matrix has columns of four numbers. The last column is the position in mm.
        let rotation = DMat3::from_cols_array(&[m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]]);
        let pose = Axes::OpenHaptics.pose(rotation, DVec3::new(m[12], m[13], m[14]) * MILLI);
        let twist = Twist { angular: self.turn(&pose, time), linear: Axes::OpenHaptics.ours(velocity) };
        DeviceState { pose, twist, buttons, time, withheld: false }
    }

    /// Returns the angular velocity (rad/s), estimated from two poses.
    fn turn(&self, pose: &Pose, time: f64) -> DVec3 {
        let Some(last) = self.last.filter(|last| last.pose.is_valid()) else { return DVec3::ZERO };
        let dt = time - last.time;
        if dt < SHORTEST_TURN {
            return last.twist.angular;
        }
        let share = 1.0 - (-std::f64::consts::TAU * TURN_CUTOFF_HZ * dt).exp();
        let raw = rotation_between(last.pose.rotation, pose.rotation) / dt;
        last.twist.angular + (raw - last.twist.angular) * share
    }

    /// Returns the wrench of this turn.
    fn wrench(&mut self, state: &DeviceState) -> Wrench {
        let Command { wrench, time, gap } = *self.commands.get();
        if self.shared.failure().is_some() {
            return Wrench::ZERO;
        }
        if self.shared.brake.is_applied() {
            // The loop knows of the brake and starts again from zero.
            self.given = false;
            return self.damping(&state.twist);
        }
        // The comparison also rejects NaN.
        let is_fresh = state.time - time <= STALE;
        if !is_fresh {
            self.shared.stale.fetch_add(1, Ordering::Relaxed);
            self.gap += u64::from(self.given);
        }
        self.given = is_fresh && gap == self.gap && wrench != Wrench::ZERO;
        if !self.given {
            return Wrench::ZERO;
        }
        Wrench {
            torque: wrench.torque.clamp_length_max(self.limits.torque_peak),
            force: wrench.force.clamp_length_max(self.limits.force_peak),
        }
    }

    fn damping(&self, twist: &Twist) -> Wrench {
        let wrench = Wrench {
            torque: (twist.angular * -self.limits.angular_damping).clamp_length_max(self.limits.rest_torque),
            force: (twist.linear * -self.limits.damping).clamp_length_max(self.limits.rest_force),
        };
        if wrench.is_finite() { wrench } else { Wrench::ZERO }
    }

    fn give(&self, wrench: &Wrench) {
        self.api.set_three(number::FORCE, Axes::OpenHaptics.theirs(wrench.force).to_array());
        if self.has_torque {
            self.api.set_three(number::TORQUE, (Axes::OpenHaptics.theirs(wrench.torque) / MILLI).to_array());
        }
    }

    /// Fetches the library's errors. Returns true if an error removed the force in this turn.
    fn take_errors(&self) -> bool {
        let (mut any, mut none) = (false, false);
        for _ in 0..ERRORS_AT_A_TIME {
            let Some(error) = self.api.error() else { break };
            any |= errors::is_of_force(error.code);
            none |= errors::gives_none(error.code);
            self.shared.take_error(error.code);
        }
        let row = if any { self.shared.in_a_row.load(Ordering::Relaxed).saturating_add(1) } else { 0 };
        self.shared.in_a_row.store(row, Ordering::Relaxed);
        none
    }
}

impl TurnCallbacks for Touch {
    fn serve(&mut self) -> bool {
        let is_last = self.shared.ending.load(Ordering::Acquire);
        // The previous turn may have been for another device.
        self.api.make_current(self.handle);
        self.api.begin_frame(self.handle);
        let state = self.sense();
        let wrench = if is_last { Wrench::ZERO } else { self.wrench(&state) };
        self.give(&wrench);
        self.api.end_frame(self.handle);
        if self.take_errors() && self.given {
            (self.gap, self.given) = (self.gap + 1, false);
        }
        self.last = Some(state);
        self.samples.publish(Sample { state, gap: self.gap });
        !is_last
    }

    fn panicked(&mut self) {
        self.api.make_current(self.handle);
        // The frame may still be open. The error of a second begin is ignored.
        self.api.begin_frame(self.handle);
        self.give(&Wrench::ZERO);
        self.api.end_frame(self.handle);
    }

    fn ended(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.shared.ended)
    }
}
