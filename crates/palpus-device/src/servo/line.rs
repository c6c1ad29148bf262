//! The gate, safety chain, brake and watchdog between the loop and one device.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use palpus::algebra::Wrench;

use super::pace::Start;
use super::time::LoopTime;
use super::{ServoOptions, ServoTick, Timing};
use crate::device::{Brake, DeviceError, DeviceState, HapticDevice};
use crate::safety::{Admitted, Cut, Cuts, Gate, SafetyChain, SafetyLimits, Shaped, Watch};

/// Shorter suspensions are ignored: the two clocks that show a suspension are read one after the
/// other.
const SUSPENDED: Duration = Duration::from_millis(1);

/// Everything between the step and the device.
pub(super) struct Line<'a, D: HapticDevice + ?Sized> {
    end: ZeroAtEnd<'a, D>,
    gate: Gate,
    chain: SafetyChain,
    time: &'a dyn LoopTime,
    real: bool,
    period: f64,
    /// Longest time for which a wrench may be held.
    stall: Duration,
    /// Time at which the wrench that the device holds was written; `None` if this wrench is zero.
    held: Option<Duration>,
    /// True if the loop has seen the brake applied and has not released it.
    braked: bool,
    /// Total time for which the machine was suspended, up to the last tick.
    suspended: Duration,
}

impl<'a, D: HapticDevice + ?Sized> Line<'a, D> {
    pub(super) fn new(options: &ServoOptions, device: &'a mut D, time: &'a dyn LoopTime) -> Self {
        let ServoOptions { rate_hz, timing, safety, .. } = options;
        let period = 1.0 / rate_hz;
        // The limits are computed once, from the device's description at the start.
        let limits = safety.limits(device.spec(), *rate_hz);
        let enable_mode = safety.enable_mode(device.spec());
        let real = *timing == Timing::RealTime;
        let stall = Duration::try_from_secs_f64(limits.stall).unwrap_or(Duration::MAX);
        let brake = device.brake();
        let guard = brake.clone().filter(|_| real).map(|brake| Guard::new(brake, stall, time));
        let braked = brake.as_ref().is_some_and(|brake| brake.is_applied());
        Self {
            end: ZeroAtEnd { device, brake, guard, over: false },
            gate: Gate::new(&limits),
            chain: SafetyChain::new(&limits, enable_mode, safety, period),
            time,
            real,
            period,
            stall,
            held: None,
            braked,
            suspended: time.suspended(),
        }
    }

    /// Reads the device's state and passes it through the gate.
    pub(super) fn read(&mut self, start: &Start) -> Result<Admitted, DeviceError> {
        let state = self.end.device.read()?;
        let mut admitted = self.gate.admit(&state, start.elapsed(self.period).max(self.period));
        admitted.cuts.note(Cut::Withheld, state.withheld);
        Ok(admitted)
    }

    /// Writes zero to a device that has not returned a state yet.
    pub(super) fn hold_still(&mut self) -> Result<(), DeviceError> {
        self.write(&Wrench::ZERO)
    }

    /// Passes to the chain the work that another tool or a moving body did on this tool, J
    /// ([`SafetyChain::receive`]).
    pub(super) fn receive(&mut self, work: [f64; 2]) {
        self.chain.receive(work);
    }

    /// Passes a `computed` wrench through the chain and writes the result to the device. The tick
    /// began `elapsed` seconds after the previous tick.
    pub(super) fn answer(
        &mut self,
        state: &DeviceState,
        computed: &Wrench,
        found: Cuts,
        panicked: bool,
        elapsed: f64,
    ) -> Result<Shaped, DeviceError> {
        let mut reported = found;
        reported.note(Cut::Panic, panicked);
        reported.note(Cut::LateLoop, self.held.is_some_and(|since| self.time.now().saturating_sub(since) > self.stall));
        reported.note(Cut::Watchdog, self.is_newly_braked());
        reported.note(Cut::Suspended, self.real && self.was_suspended());
        let shaped = self.chain.shape(state, computed, reported, elapsed);
        if self.braked && shaped.phase.is_on() {
            // The device is engaged again, with a small wrench.
            self.braked = false;
            if let Some(brake) = &self.end.brake {
                brake.release();
            }
        }
        self.write(&shaped.wrench)?;
        Ok(shaped)
    }

    /// Drops the held wrench and stops the watchdog. The loop calls this in a pause that also stops
    /// the device's time. The held wrench then has no effect.
    pub(super) fn stand(&mut self) {
        self.held = None;
        if let Some(guard) = &self.end.guard {
            guard.watch.rest();
        }
    }

    /// Runs one tick, number `index`, that damps device number `device` without a step. Returns
    /// `None` if the device fails or has no valid state.
    pub(super) fn damp(&mut self, start: &Start, index: u64, device: usize) -> Option<ServoTick> {
        let admitted = self.read(start).ok()?;
        let (state, elapsed_s) = (admitted.state?, start.elapsed(self.period));
        let answered = self.answer(&state, &Wrench::ZERO, admitted.cuts, false, elapsed_s);
        let Shaped { wrench, cuts, phase, available } = answered.ok()?;
        Some(ServoTick {
            device,
            index,
            time: index as f64 * self.period,
            state,
            read: admitted.read,
            computed: Wrench::ZERO,
            wrench,
            cuts,
            phase,
            available,
            saturated: false,
            elapsed_s,
            step_s: 0.0,
            lateness_s: start.lateness.as_secs_f64(),
            overrun: start.skipped > 0,
        })
    }

    /// Returns true while the device may get a wrench other than damping.
    pub(super) fn is_on(&self) -> bool {
        self.chain.phase().is_on()
    }

    /// Returns the time in which the wrench fades out at the end, s.
    pub(super) fn fading(&self) -> f64 {
        self.chain.limits().ramp
    }

    /// Returns the thresholds of the safety chain.
    pub(super) fn limits(&self) -> &SafetyLimits {
        self.chain.limits()
    }

    /// Writes a wrench that is one step of the slew limit closer to zero. Returns false if the next
    /// wrench may be zero.
    pub(super) fn release(&mut self) -> Result<bool, DeviceError> {
        let Some(wrench) = self.chain.release() else { return Ok(false) };
        self.write(&wrench)?;
        Ok(true)
    }

    /// Returns the device's own counters.
    pub(super) fn counts(&self) -> Vec<(&'static str, u64)> {
        self.end.device.counts()
    }

    /// Writes the last wrench, which is zero; if the device `failed`, also applies its brake.
    pub(super) fn finish(mut self, failed: bool) -> Result<(), DeviceError> {
        self.end.finish(failed)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !self.real {
            return self.end.device.write(wrench);
        }
        // The time that the write itself takes counts as time for which the wrench is held.
        let begun = self.time.now();
        self.end.device.write(wrench)?;
        self.held = (*wrench != Wrench::ZERO).then_some(begun);
        if let Some(guard) = &self.end.guard {
            match self.held {
                Some(since) => guard.watch.beat(since),
                None => guard.watch.rest(),
            }
        }
        Ok(())
    }

    fn was_suspended(&mut self) -> bool {
        let suspended = self.time.suspended();
        let before = self.suspended;
        self.suspended = before.max(suspended);
        suspended > before + SUSPENDED
    }

    fn is_newly_braked(&mut self) -> bool {
        let applied = !self.braked && self.end.brake.as_ref().is_some_and(|brake| brake.is_applied());
        self.braked |= applied;
        applied
    }
}

/// The watchdog of a run. Dropping this value ends the watchdog thread.
struct Guard {
    watch: Arc<Watch>,
    thread: Option<JoinHandle<()>>,
}

impl Guard {
    fn new(brake: Arc<dyn Brake>, stall: Duration, time: &dyn LoopTime) -> Self {
        let watch = Arc::new(Watch::new(brake, stall));
        let thread = time.guard(Arc::clone(&watch));
        Self { watch, thread }
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.watch.end();
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // This thread does not panic, and a panic would need no reaction.
            let _ = thread.join();
        }
    }
}

/// Writes zero to the device at the end of the run, and also when a panic unwinds through the loop.
struct ZeroAtEnd<'a, D: HapticDevice + ?Sized> {
    device: &'a mut D,
    brake: Option<Arc<dyn Brake>>,
    guard: Option<Guard>,
    over: bool,
}

impl<D: HapticDevice + ?Sized> ZeroAtEnd<'_, D> {
    fn finish(&mut self, failed: bool) -> Result<(), DeviceError> {
        self.over = true;
        self.guard = None;
        let written = self.device.write(&Wrench::ZERO);
        if let Some(brake) = self.brake.as_ref().filter(|_| failed || written.is_err()) {
            brake.apply();
        }
        written
    }
}

impl<D: HapticDevice + ?Sized> Drop for ZeroAtEnd<'_, D> {
    fn drop(&mut self) {
        if !self.over {
            if let Some(brake) = &self.brake {
                brake.apply();
            }
            // An error here cannot be reported: a panic is already unwinding.
            let _ = self.device.write(&Wrench::ZERO);
        }
    }
}
