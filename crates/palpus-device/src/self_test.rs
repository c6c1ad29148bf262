//! The self test of a device, before it may give force.
//!
//! The test writes only zero wrenches, so it does not move the user's hand. Its steps:
//!
//! 1. New states arrive, each with a valid pose and a new time. The device accepts a zero wrench
//!    after each state.
//! 2. The device's own watchdog removes the force when no wrench is written. This step is skipped
//!    if the device has no watchdog that can be queried.
//! 3. The brake can be applied and released, and reports both states. Meanwhile reads and writes
//!    work.
//! 4. The loop's watchdog, which runs in its own thread, applies the brake when the loop stalls.
//!
//! The result names the parts that the device does not have. All waits use the loop's clock.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use palpus::algebra::Wrench;

use crate::device::{Brake, DeviceError, DeviceState, HapticDevice};
use crate::safety::{SafetyLimits, Watch};
use crate::servo::LoopTime;

/// Time between two reads: one tick of a 1 kHz loop.
const TICK: Duration = Duration::from_millis(1);
/// Rate of these reads, Hz.
const RATE_HZ: f64 = 1000.0;
/// Number of new states that must arrive.
const FRESH_STATES: u32 = 20;
/// Time limit for the new states. The limit is long enough for a busy machine.
const FRESH_TIME: Duration = Duration::from_millis(500);
/// Extra time that a watchdog is given to trip. A thread without real-time priority wakes late on a
/// busy machine.
const PATIENCE: Duration = Duration::from_millis(500);

/// Result of a passed self test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfTest {
    /// The device has a brake, and the brake passed its test.
    pub brake: bool,
    /// Time after which the loop's watchdog applies the brake; `None` without a brake.
    pub watchdog: Option<Duration>,
    /// Time after which the device's own watchdog removes the force; `None` if this watchdog was
    /// not tested or cannot be queried.
    pub own_watchdog: Option<Duration>,
    /// The device gives no force now, so its own watchdog was not tested.
    pub withheld: bool,
}

/// The reason why a device must not be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SelfTestError {
    /// The device failed to read or write.
    #[error("{0}")]
    Device(#[from] DeviceError),
    /// Too few new states arrived.
    #[error(
        "it gave {fresh} new states in {} ms, and {FRESH_STATES} are needed: check its cable, or unplug it and plug it in again",
        FRESH_TIME.as_millis()
    )]
    NotFresh {
        /// Number of states with a valid pose and a new time.
        fresh: u32,
    },
    /// The device reports the wrong state of its brake.
    #[error("its brake was {0}, but the device does not report it: switch the device off and on again")]
    Brake(&'static str),
    /// The loop's watchdog did not apply the brake.
    #[error(
        "the watchdog thread did not apply its brake within {} ms, so a stalled loop would hold its force: check that this user may start threads (ulimit -u)",
        .0.as_millis()
    )]
    Watchdog(Duration),
    /// The device's own watchdog did not remove the force.
    #[error(
        "its own watchdog did not remove the force within {} ms, so the device would hold its force if this program were killed: switch the device off and on again",
        .0.as_millis()
    )]
    OwnWatchdog(Duration),
}

impl fmt::Display for SelfTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "self test passed: new states, zero accepted")?;
        match self.watchdog {
            Some(time) => write!(f, ", brake, watchdog ({} ms)", time.as_millis())?,
            None => write!(f, "; it has no brake for a watchdog to apply")?,
        }
        if let Some(time) = self.own_watchdog {
            write!(f, ", the device's own watchdog ({} ms)", time.as_millis())?;
        }
        if self.withheld {
            write!(f, "; the device gives no force now (not ready, or switched off by its own button)")?;
        }
        Ok(())
    }
}

/// Tests `device`, with `time` as the clock. Takes at most about two seconds and writes only zero
/// wrenches.
///
/// # Errors
/// Fails if a step of the test fails. The device must then not be used.
pub fn self_test<D: HapticDevice + ?Sized>(device: &mut D, time: &dyn LoopTime) -> Result<SelfTest, SelfTestError> {
    let mut bench = Bench { device, time };
    bench.see_fresh_states()?;
    let own_watchdog = if bench.is_withheld()? { None } else { bench.see_own_watchdog()? };
    let watchdog = match bench.device.brake() {
        Some(brake) => {
            bench.see_brake(brake.as_ref())?;
            Some(bench.see_watchdog(&brake)?)
        }
        None => None,
    };
    Ok(SelfTest { brake: watchdog.is_some(), watchdog, own_watchdog, withheld: bench.is_withheld()? })
}

/// A device under test.
struct Bench<'a, D: HapticDevice + ?Sized> {
    device: &'a mut D,
    time: &'a dyn LoopTime,
}

impl<D: HapticDevice + ?Sized> Bench<'_, D> {
    /// Runs one tick of a loop that writes zero.
    fn tick(&mut self) -> Result<DeviceState, DeviceError> {
        self.wait(TICK);
        let state = self.device.read()?;
        self.device.write(&Wrench::ZERO)?;
        Ok(state)
    }

    /// Returns true if the device withholds its force for several ticks. A single answer may be
    /// late.
    fn is_withheld(&mut self) -> Result<bool, DeviceError> {
        for _ in 0..FRESH_STATES {
            if !self.tick()?.withheld {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn wait(&self, duration: Duration) {
        self.time.wait_until(self.time.now() + duration, Duration::ZERO);
    }

    /// Step 1: waits for new states.
    fn see_fresh_states(&mut self) -> Result<(), SelfTestError> {
        let until = self.time.now() + FRESH_TIME;
        let (mut last, mut fresh) = (f64::NEG_INFINITY, 0);
        while self.time.now() < until {
            let state = self.tick()?;
            if state.pose.is_valid() && state.time > last {
                (last, fresh) = (state.time, fresh + 1);
            }
            if fresh >= FRESH_STATES {
                return Ok(());
            }
        }
        Err(SelfTestError::NotFresh { fresh })
    }

    /// Step 2: waits for the device's own watchdog. The ticks afterwards let the device report
    /// again that it gives force.
    fn see_own_watchdog(&mut self) -> Result<Option<Duration>, SelfTestError> {
        let Some(watchdog) = self.device.own_watchdog() else { return Ok(None) };
        let until = self.time.now() + watchdog.after + PATIENCE;
        self.wait(watchdog.after);
        while !self.device.own_watchdog().is_some_and(|watchdog| watchdog.has_bitten) {
            if self.time.now() >= until {
                return Err(SelfTestError::OwnWatchdog(watchdog.after));
            }
            self.wait(TICK);
        }
        for _ in 0..FRESH_STATES {
            self.tick()?;
        }
        Ok(Some(watchdog.after))
    }

    /// Step 3: queries the brake through a second handle, since the watchdog has its own handle.
    fn see_brake(&mut self, brake: &dyn Brake) -> Result<(), SelfTestError> {
        let is_applied = |device: &D| device.brake().is_some_and(|brake| brake.is_applied());
        brake.apply();
        self.tick()?;
        if !is_applied(self.device) {
            return Err(SelfTestError::Brake("applied"));
        }
        brake.release();
        self.tick()?;
        if is_applied(self.device) {
            return Err(SelfTestError::Brake("released"));
        }
        Ok(())
    }

    /// Step 4: simulates a loop that writes a force once and then stalls.
    fn see_watchdog(&mut self, brake: &Arc<dyn Brake>) -> Result<Duration, SelfTestError> {
        let stall = SafetyLimits::of(self.device.spec(), RATE_HZ).stall;
        let stall = Duration::try_from_secs_f64(stall).unwrap_or(PATIENCE);
        let watch = Arc::new(Watch::new(Arc::clone(brake), stall));
        let thread = self.time.guard(Arc::clone(&watch));
        let begun = self.time.now();
        watch.beat(begun);
        while !brake.is_applied() && self.time.now() < begun + stall + PATIENCE {
            self.wait(TICK);
        }
        let has_bitten = brake.is_applied();
        watch.end();
        if let Some(thread) = thread {
            thread.thread().unpark();
            // A panic of this thread would show below as a brake that was not applied.
            let _ = thread.join();
        }
        brake.release();
        if has_bitten { Ok(stall) } else { Err(SelfTestError::Watchdog(stall + PATIENCE)) }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::thread::JoinHandle;

    use palpus::algebra::{Pose, Twist};

    use super::*;
    use crate::device::{BrakeFlag, DeviceSpec, OwnWatchdog, known_devices};
    use crate::servo::VirtualTime;

    /// A defect of the tested device.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Wrong {
        Nothing,
        Frozen,
        NoPose,
        Refuses,
        BrakeSticks,
        BrakeDoesNothing,
        OwnWatchdogSleeps,
    }

    /// A device on the virtual clock whose own watchdog trips after 20 ms.
    struct Bench {
        wrong: Wrong,
        spec: DeviceSpec,
        time: VirtualTime,
        brake: Arc<dyn Brake>,
        written: Cell<Duration>,
        withheld: bool,
        largest: f64,
    }

    /// A brake that cannot be applied, or cannot be released.
    struct Odd(BrakeFlag, Wrong);

    impl Brake for Odd {
        fn apply(&self) {
            if self.1 != Wrong::BrakeDoesNothing {
                self.0.apply();
            }
        }

        fn release(&self) {
            if self.1 != Wrong::BrakeSticks {
                self.0.release();
            }
        }

        fn is_applied(&self) -> bool {
            self.0.is_applied()
        }
    }

    fn bench(wrong: Wrong) -> Bench {
        let [spec, ..] = known_devices();
        let brake = Arc::new(Odd(BrakeFlag::default(), wrong));
        let time = VirtualTime::default();
        Bench { wrong, spec, time, brake, written: Cell::default(), withheld: false, largest: 0.0 }
    }

    impl HapticDevice for Bench {
        fn spec(&self) -> &DeviceSpec {
            &self.spec
        }

        fn read(&mut self) -> Result<DeviceState, DeviceError> {
            let time = if self.wrong == Wrong::Frozen { 0.0 } else { self.time.now().as_secs_f64() };
            let mut pose = Pose::IDENTITY;
            if self.wrong == Wrong::NoPose {
                pose.translation.x = f64::NAN;
            }
            Ok(DeviceState { pose, twist: Twist::default(), buttons: 0, time, withheld: self.withheld })
        }

        fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
            if self.wrong == Wrong::Refuses {
                return Err(DeviceError::Refused("it does not like zero".into()));
            }
            self.largest = self.largest.max(wrench.force.length() + wrench.torque.length());
            self.written.set(self.time.now());
            Ok(())
        }

        fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
            let after = Duration::from_millis(20);
            let is_late = self.time.now() - self.written.get() > after;
            Some(OwnWatchdog { after, has_bitten: is_late && self.wrong != Wrong::OwnWatchdogSleeps })
        }

        fn brake(&self) -> Option<Arc<dyn Brake>> {
            Some(Arc::clone(&self.brake))
        }
    }

    fn tested(wrong: Wrong) -> Result<SelfTest, SelfTestError> {
        let mut device = bench(wrong);
        let time = device.time.clone();
        let result = self_test(&mut device, &time);
        assert_eq!(device.largest, 0.0, "{wrong:?}: nothing but zero is written");
        assert!(time.now() < Duration::from_secs(2), "{wrong:?}: {:?}", time.now());
        result
    }

    #[test]
    fn good_device_passes_and_names_each_step() {
        let passed = tested(Wrong::Nothing).unwrap();
        assert_eq!(passed.own_watchdog, Some(Duration::from_millis(20)));
        assert!(passed.brake && passed.watchdog.is_some() && !passed.withheld);
        let words = passed.to_string();
        for part in ["new states", "zero accepted", "brake, watchdog (21 ms)", "own watchdog (20 ms)"] {
            assert!(words.contains(part), "{words}");
        }
    }

    #[test]
    fn each_failure_is_one_clear_error() {
        for (wrong, says) in [
            (Wrong::Frozen, "1 new states in 500 ms"),
            (Wrong::NoPose, "0 new states"),
            (Wrong::Refuses, "does not like zero"),
            (Wrong::BrakeDoesNothing, "its brake was applied"),
            (Wrong::BrakeSticks, "its brake was released"),
            (Wrong::OwnWatchdogSleeps, "its own watchdog"),
        ] {
            let error = tested(wrong).unwrap_err().to_string();
            assert!(error.contains(says) && error.lines().count() == 1, "{wrong:?}: {error}");
        }
    }

    /// A clock on which the watchdog thread does not start.
    struct Unguarded(VirtualTime);

    impl LoopTime for Unguarded {
        fn now(&self) -> Duration {
            self.0.now()
        }

        fn wait_until(&self, deadline: Duration, spin: Duration) {
            self.0.wait_until(deadline, spin);
        }

        fn guard(&self, _: Arc<Watch>) -> Option<JoinHandle<()>> {
            None
        }
    }

    #[test]
    fn watchdog_that_does_not_start_fails_the_test() {
        let mut device = bench(Wrong::Nothing);
        let time = Unguarded(device.time.clone());
        let error = self_test(&mut device, &time).unwrap_err();
        assert!(matches!(error, SelfTestError::Watchdog(_)), "{error}");
        assert!(!device.brake.is_applied());
    }

    #[test]
    fn withholding_device_passes_and_reports_it() {
        let mut device = Bench { withheld: true, ..bench(Wrong::OwnWatchdogSleeps) };
        let time = device.time.clone();
        let passed = self_test(&mut device, &time).unwrap();
        assert!(passed.withheld && passed.own_watchdog.is_none());
        assert!(passed.to_string().contains("gives no force now"));
    }
}
