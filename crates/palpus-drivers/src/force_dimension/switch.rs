//! The state of the device's force: on or off, and the cause that switched it off.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use palpus_device::{Brake, BrakeFlag};

use crate::ffi::dhd::{Dhd, STATUS_ROOM};

/// Indices of the status words that are used.
pub(super) mod status {
    pub(in super::super) const POWER: usize = 0;
    pub(in super::super) const CONNECTED: usize = 1;
    pub(in super::super) const RESET: usize = 3;
    pub(in super::super) const FORCE: usize = 5;
    pub(in super::super) const ERROR: usize = 9;
    pub(in super::super) const FORCE_OFF_CAUSE: usize = 14;
}

/// Why the force is off, as in the status. A program must not override the other causes (1: the
/// button on the device, 2: too fast a motion, 6: the dead-man's switch).
pub(super) mod cause {
    /// No cause is known.
    pub(in super::super) const NONE: i32 = 0;
    /// The device's watchdog.
    pub(in super::super) const WATCHDOG: i32 = 3;
    /// This program.
    pub(in super::super) const SOFTWARE: i32 = 4;
}

/// State that the threads of the loop and of the watchdog share.
pub(super) struct Shared {
    pub(super) api: Dhd,
    pub(super) id: i8,
    /// Lock that is held during every call for the device.
    pub(super) line: Mutex<State>,
    pub(super) brake: BrakeFlag,
    /// True if the brake was applied while a call was running; it could then only set this flag.
    pub(super) late_brake: AtomicBool,
    /// True if the force was switched off by something other than this program.
    pub(super) withheld: AtomicBool,
}

/// Result of an attempt to switch the force on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Switched {
    On,
    /// The force was already on.
    WasOn,
    /// The user or the device has switched the force off.
    Forbidden,
    /// The library refused.
    Failed,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// The device is open, and its force was never on.
    Silent,
    Driven,
    Closed,
}

impl Shared {
    pub(super) fn line(&self) -> MutexGuard<'_, State> {
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Switches the force on if it is off and no other cause forbids it. The caller holds the lock
    /// `line`.
    pub(super) fn switch_on(&self) -> Switched {
        if let Some(words) = self.api.status(self.id) {
            if words[status::FORCE] != 0 {
                return Switched::WasOn;
            }
            if is_forbidden(&words) {
                return Switched::Forbidden;
            }
        }
        if self.api.enable_force(true, self.id) < 0 { Switched::Failed } else { Switched::On }
    }

    /// Switches the force off. If the force is already off, does nothing: the device stores the
    /// cause that switched its force off, and another command would erase this cause.
    fn switch_off(&self) {
        let off = self.api.status(self.id).is_some_and(|words| is_forbidden(&words));
        if off {
            self.withheld.store(true, Ordering::Release);
            return;
        }
        // If this command fails, the device's watchdog acts.
        let _ = self.api.enable_force(false, self.id);
    }

    /// Applies a brake that came during a call. The caller holds the lock `line`, at the end of its
    /// call.
    pub(super) fn brake_late(&self) {
        if self.late_brake.swap(false, Ordering::AcqRel) {
            self.switch_off();
        }
    }
}

impl Brake for Shared {
    fn apply(&self) {
        self.brake.apply();
        let line = match self.line.try_lock() {
            Ok(line) => line,
            Err(TryLockError::Poisoned(line)) => line.into_inner(),
            Err(TryLockError::WouldBlock) => {
                self.late_brake.store(true, Ordering::Release);
                return;
            }
        };
        if *line == State::Driven {
            self.switch_off();
        }
    }

    fn release(&self) {
        let line = self.line();
        self.late_brake.store(false, Ordering::Release);
        self.brake.release();
        if *line == State::Driven && !self.withheld.load(Ordering::Acquire) {
            // If the force cannot be switched on, there is no force, and the next write reports why
            // after the device's watchdog has acted.
            let forbidden = self.switch_on() == Switched::Forbidden;
            self.withheld.store(forbidden, Ordering::Release);
        }
    }

    fn is_applied(&self) -> bool {
        self.brake.is_applied()
    }
}

/// True if the force is off for a cause that a program must not override.
fn is_forbidden(words: &[i32; STATUS_ROOM]) -> bool {
    let cause = words[status::FORCE_OFF_CAUSE];
    words[status::FORCE] == 0 && !matches!(cause, cause::NONE | cause::WATCHDOG | cause::SOFTWARE)
}
