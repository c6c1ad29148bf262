//! Pauses, steps and ends a run from another thread.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

use crate::safety::{HOLD_KEY, REARM_KEY};

/// Pauses a run, advances it by single ticks, or ends it, from any thread and without waiting.
/// [`super::Servo::control`] returns it.
#[derive(Debug, Default)]
pub struct RunControl {
    paused: AtomicBool,
    /// Number of ticks that a paused run may still make.
    ticks: AtomicU64,
    ended: AtomicBool,
    /// Number of ticks for which [`HOLD_KEY`] is still held.
    held: AtomicU64,
    /// [`REARM_KEY`] if it was pressed and no tick has seen it yet; else 0.
    pressed: AtomicU32,
}

impl RunControl {
    /// Pauses the run before its next tick, or continues it.
    pub fn pause(&self, paused: bool) {
        self.ticks.store(0, Ordering::Relaxed);
        self.paused.store(paused, Ordering::Relaxed);
    }

    /// Returns true while the run is paused.
    pub fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed)
    }

    /// Lets a paused run make `ticks` more ticks and pause again. The call has no effect on a
    /// device that a person holds, since its loop keeps running.
    pub fn step(&self, ticks: u64) {
        if self.is_paused() {
            self.ticks.fetch_add(ticks, Ordering::Relaxed);
        }
    }

    /// Holds the program's own key for force for `ticks` ticks. The key counts as a button of the
    /// device ([`HOLD_KEY`]). Call this again before the ticks are over to keep holding; so a
    /// window that hangs releases the key. `ticks` = 0 releases the key at once.
    pub fn hold(&self, ticks: u64) {
        self.held.store(ticks, Ordering::Relaxed);
    }

    /// Presses the rearm key, which counts as a button that is pressed for one tick
    /// ([`REARM_KEY`]). A device that is latched after three faults can then be engaged again.
    pub fn rearm(&self) {
        self.pressed.store(REARM_KEY, Ordering::Relaxed);
    }

    /// Returns the pressed keys as button bits, for one tick.
    pub(super) fn take_keys(&self) -> u32 {
        let pressed = self.pressed.load(Ordering::Relaxed);
        if pressed != 0 {
            self.pressed.store(0, Ordering::Relaxed);
        }
        let fewer = |ticks: u64| ticks.checked_sub(1);
        let held = self.held.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fewer).is_ok();
        pressed | if held { HOLD_KEY } else { 0 }
    }

    /// Ends this run as soon as its wrenches have faded out (a quarter of a second), or before the
    /// next tick if there is no wrench. Later runs of the same loop end at once.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }

    /// Returns true if a tick may run. In a paused run, the call uses up one requested tick.
    pub(super) fn take_step(&self) -> bool {
        let fewer = |ticks: u64| ticks.checked_sub(1);
        !self.is_paused() || self.ticks.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fewer).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::Arc;
    use std::thread::JoinHandle;
    use std::time::Duration;

    use glam::DVec3;
    use palpus::algebra::{Pose, Wrench};

    use super::*;
    use crate::safety::{Cut, Cuts, EnableMode, Phase, SafetyChain, SafetyOptions, Watch};
    use crate::{
        DeviceError, DeviceSpec, DeviceState, HapticDevice, LoopTime, RunEnd, RunStatistics, Servo, ServoOptions,
        ServoTick, SimulatedDevice, SimulationSettings, StepOutcome, VirtualTime,
    };

    const RATE_HZ: f64 = 1000.0;

    /// Virtual time in which a simulated user acts on the run control. `acts` gets the number of
    /// times that the paused run has checked the control.
    struct Somebody<'a> {
        time: VirtualTime,
        control: Arc<RunControl>,
        looks: Cell<u32>,
        acts: &'a dyn Fn(u32, &RunControl),
    }

    impl LoopTime for Somebody<'_> {
        fn now(&self) -> Duration {
            self.time.now()
        }

        fn wait_until(&self, deadline: Duration, spin: Duration) {
            self.time.wait_until(deadline, spin);
            if self.control.is_paused() {
                self.looks.set(self.looks.get() + 1);
                (self.acts)(self.looks.get(), &self.control);
            }
        }

        fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>> {
            self.time.guard(watch)
        }
    }

    fn simulated() -> SimulatedDevice<impl crate::Intent> {
        let path = |time: f64| Pose::from_translation(DVec3::new(0.0, 0.0, 0.03 * (6.0 * time).cos()));
        SimulatedDevice::new(SimulationSettings { rate_hz: RATE_HZ, ..Default::default() }, path).unwrap()
    }

    /// A device with the same simulated operator. The device moves even when the loop does not
    /// read it.
    struct Real<D>(D);

    impl<D: HapticDevice> HapticDevice for Real<D> {
        fn spec(&self) -> &DeviceSpec {
            self.0.spec()
        }

        fn read(&mut self) -> Result<DeviceState, DeviceError> {
            self.0.read()
        }

        fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
            self.0.write(wrench)
        }
    }

    /// Force of a wall below z = 0.
    fn wall(state: &DeviceState) -> Wrench {
        Wrench { torque: DVec3::ZERO, force: DVec3::Z * (-200.0 * state.pose.translation.z).max(0.0) }
    }

    /// Runs one and a half seconds of contact with a wall, paused from tick `pause_at` until `acts`
    /// ends the pause.
    fn run(
        device: &mut dyn HapticDevice,
        pause_at: u64,
        acts: &dyn Fn(u32, &RunControl),
    ) -> (RunStatistics, Vec<ServoTick>) {
        let mut servo = Servo::new(ServoOptions { duration: Some(1.5), ..Default::default() }).unwrap();
        let control = servo.control();
        let time = Somebody { time: VirtualTime::default(), control: servo.control(), looks: Cell::new(0), acts };
        let mut ticks = Vec::new();
        let mut observe = |tick: &ServoTick, (): &()| {
            ticks.push(*tick);
            if tick.index == pause_at {
                control.pause(true);
            }
        };
        let step = |state: &DeviceState, _| StepOutcome::of(wall(state));
        let statistics = servo.run_in(&time, device, step, &mut observe, &AtomicBool::new(false));
        (statistics, ticks)
    }

    const NEVER: u64 = u64::MAX;

    #[test]
    fn pause_does_not_change_a_simulated_run() {
        let (_, unpaused) = run(&mut simulated(), NEVER, &|_, _| ());
        let pressed = unpaused.iter().position(|tick| tick.wrench.force.z > 1.0).unwrap() as u64;
        // A pause of two seconds during contact is longer than any watchdog waits.
        let (statistics, paused) = run(&mut simulated(), pressed, &|looks, control| control.pause(looks < 500));
        assert!(paused == unpaused);
        assert_eq!((statistics.late_ticks, statistics.overruns, statistics.skipped), (0, 0, 0));
        assert!(statistics.safety.faults() == 0 && statistics.end == RunEnd::Duration);
        let period = statistics.period_us.unwrap();
        assert!(period.max < 1001.0 && (statistics.duration_s - 1.5).abs() < 0.003, "{statistics:?}");
    }

    #[test]
    fn paused_run_makes_requested_ticks() {
        let made = Cell::new(0);
        let mut device = simulated();
        let mut servo = Servo::new(ServoOptions::default()).unwrap();
        let control = servo.control();
        let acts = |looks: u32, control: &RunControl| match looks {
            10 => {
                assert_eq!(made.get(), 51);
                control.step(3);
            }
            20 => {
                assert_eq!(made.get(), 54);
                control.step(1);
                control.step(1);
            }
            30 => {
                assert_eq!(made.get(), 56);
                control.end();
            }
            _ => {}
        };
        let time =
            Somebody { time: VirtualTime::default(), control: servo.control(), looks: Cell::new(0), acts: &acts };
        let mut observe = |tick: &ServoTick, (): &()| {
            made.set(tick.index + 1);
            if tick.index == 50 {
                control.step(7);
                control.pause(true);
            }
        };
        let step = |_: &DeviceState, _| StepOutcome::of(Wrench::ZERO);
        let statistics = servo.run_in(&time, &mut device, step, &mut observe, &AtomicBool::new(false));
        assert_eq!((statistics.ticks, statistics.end, statistics.late_ticks), (56, RunEnd::Stopped, 0));
    }

    #[test]
    fn hold_key_enables_force_and_rearm_key_rearms() {
        let safety = SafetyOptions { enable_mode: Some(EnableMode::DeadMan(HOLD_KEY)), ..Default::default() };
        let mut servo = Servo::new(ServoOptions { duration: Some(3.0), safety, ..Default::default() }).unwrap();
        let (control, mut phases) = (servo.control(), Vec::new());
        let mut observe = |tick: &ServoTick, (): &()| {
            phases.push(tick.phase);
            match tick.index {
                // The key is held for half a second, and renewed for another half.
                100 | 600 => control.hold(500),
                2000 => control.hold(600),
                2300 => control.hold(0),
                _ => {}
            }
        };
        let step = |_: &DeviceState, _| StepOutcome::of(Wrench::ZERO);
        servo.run_in(&VirtualTime::default(), &mut simulated(), step, &mut observe, &AtomicBool::new(false));
        let held = |tick: usize| (101..1101).contains(&tick) || (2001..2301).contains(&tick);
        for (tick, phase) in phases.iter().enumerate() {
            assert_eq!(*phase != Phase::Idle, held(tick), "{phase:?} in tick {tick}");
        }

        let mut servo = Servo::new(ServoOptions { duration: Some(4.0), ..Default::default() }).unwrap();
        let (control, mut phases) = (servo.control(), Vec::new());
        let mut observe = |tick: &ServoTick, (): &()| {
            phases.push(tick.phase);
            if tick.index == 3000 {
                control.rearm();
            }
        };
        let mut count = 0;
        let step = |_: &DeviceState, _| {
            count += 1;
            StepOutcome::of(Wrench {
                force: DVec3::X * if count % 700 == 0 && count < 2200 { f64::NAN } else { 0.0 },
                torque: DVec3::ZERO,
            })
        };
        servo.run_in(&VirtualTime::default(), &mut simulated(), step, &mut observe, &AtomicBool::new(false));
        assert!(phases[2099..=3000].iter().all(|phase| *phase == Phase::Latched));
        assert_eq!((phases[2098], phases[3001], phases[3999]), (Phase::Engaged, Phase::Faulted, Phase::Engaged));
    }

    #[test]
    fn end_of_run_fades_the_wrench_out() {
        let mut servo = Servo::new(ServoOptions { duration: Some(3.0), ..Default::default() }).unwrap();
        let (control, mut ticks) = (servo.control(), Vec::new());
        let mut observe = |tick: &ServoTick, (): &()| {
            ticks.push(*tick);
            if tick.index == 500 {
                control.end();
            }
        };
        let step = |_: &DeviceState, _| StepOutcome::of(Wrench { torque: DVec3::ZERO, force: DVec3::Z * 0.5 });
        let time = VirtualTime::default();
        let ended = servo.run_in(&time, &mut simulated(), step, &mut observe, &AtomicBool::new(false));
        assert_eq!((ended.end, ended.safety.faults(), ended.ticks), (RunEnd::Stopped, 0, 751));
        for pair in ticks[500..].windows(2) {
            let step = pair[0].wrench.force.z - pair[1].wrench.force.z;
            assert!(pair[1].cuts.has(Cut::Ending) && (0.0..0.0021).contains(&step), "{step} N");
        }
        assert!(ticks[500].wrench.force.z > 0.4 && ticks[750].wrench.force.z < 0.003);
    }

    #[test]
    fn pause_removes_force_until_device_is_engaged_again() {
        let (_, unpaused) = run(&mut simulated(), NEVER, &|_, _| ());
        let pressed = unpaused.iter().position(|tick| tick.wrench.force.z > 1.0).unwrap();
        let (statistics, ticks) =
            run(&mut Real(simulated()), pressed as u64, &|looks, control| control.pause(looks < 100));
        assert_eq!((statistics.ticks, statistics.safety.faults()), (1500, 0));
        assert_eq!(statistics.safety.ticks(Cut::Paused), 99);
        let limits = SafetyOptions::default().limits(simulated().spec(), RATE_HZ);
        let steps = ticks.windows(2).map(|pair| pair[1].wrench.force.distance(pair[0].wrench.force));
        assert!(steps.fold(0.0, f64::max) <= limits.force_slew / RATE_HZ * (1.0 + 1e-9));
        let pause = &ticks[pressed + 1..pressed + 100];
        assert!(pause.iter().all(|tick| tick.phase == Phase::Idle && tick.cuts.has(Cut::Paused)));
        assert!(pause[10..].iter().all(|tick| tick.wrench == Wrench::ZERO));
        // After the pause the chain waits, since the probe still presses on the wall. Then the
        // force ramps up.
        assert_eq!(ticks[pressed + 101].phase, Phase::Waiting);
        assert!(ticks[pressed + 101..].iter().any(|tick| tick.phase == Phase::Ramping));
        assert_eq!(ticks.last().unwrap().phase, Phase::Engaged);
        // The recorded inputs suffice to compute the wrenches again.
        let mut chain = SafetyChain::new(&limits, EnableMode::Automatic, &SafetyOptions::default(), 1.0 / RATE_HZ);
        for tick in &ticks {
            let reported = Cuts::from_bits(tick.cuts.bits()).and(Cuts::INPUTS);
            assert_eq!(
                chain.shape(&tick.state, &tick.computed, reported, tick.elapsed_s).wrench,
                tick.wrench,
                "tick {}",
                tick.index
            );
        }
    }
}
