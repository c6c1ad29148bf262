//! Fault injection: a device, a step and clocks that fail as a script says.
//!
//! A [`Script`] is a list of faults by tick, written by hand or drawn from a seed. The script is
//! applied to a device ([`FaultyDevice`]) and to a step ([`Script::step`]), to test that the safety
//! chain handles the faults.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::Wrench;

use crate::device::{Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice};
use crate::safety::Cut;
use crate::servo::{StepOutcome, VirtualTime};

/// A fault that starts in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A coordinate of the pose is NaN.
    NonFinitePose,
    /// A velocity is infinite.
    NonFiniteTwist,
    /// The rotation is not a unit quaternion.
    NoRotation,
    /// From now on the pose is shifted by this vector, m.
    PoseJump(DVec3),
    /// From now on the pose is rotated by this rotation vector, rad.
    TurnJump(DVec3),
    /// In this tick, the reported velocity along x is increased by this value, m/s.
    Speed(f64),
    /// The reported velocity is increased by this vector for this number of ticks, m/s.
    Velocity(DVec3, u32),
    /// The device withholds its force for this number of ticks, and its states say so.
    Withheld(u32),
    /// The device returns the same state with the same time for this number of ticks.
    Frozen(u32),
    /// The device returns the same state with new times for this number of ticks.
    Stuck(u32),
    /// The device's clock jumps by this time, s.
    DeviceClock(f64),
    /// The loop's clock jumps by this time, ns; needs virtual time.
    LoopClock(i64),
    /// The read takes this time.
    LateRead(Duration),
    /// The step takes this time.
    LateStep(Duration),
    /// Every step takes this time for this number of ticks.
    SlowSteps(u32, Duration),
    /// The machine is suspended for this time; needs virtual time.
    Suspended(Duration),
    /// From now on the step uses other settings, which scale its wrench by this factor.
    Settings(f64),
    /// The write takes this time.
    LateWrite(Duration),
    /// The connection is lost during a write. The wrench of this write may have arrived; no later
    /// read or write succeeds.
    Dropped,
    /// The step returns a wrench that is NaN.
    NonFiniteWrench,
    /// The step returns a wrench with this force (N) and torque (N·m), in fixed oblique directions.
    Wrench(f64, f64),
    /// The step panics.
    Panic,
}

impl Fault {
    /// Returns the cut with which the chain must report this fault, if the fault occurs alone and
    /// the grip hardly moves; `None` if the cut depends on the run.
    pub fn shown_as(&self) -> Option<Cut> {
        Some(match self {
            Self::NonFinitePose | Self::NonFiniteTwist | Self::NoRotation => Cut::NonFiniteState,
            Self::PoseJump(_) | Self::TurnJump(_) => Cut::PoseJump,
            Self::Speed(_) => Cut::Speed,
            Self::Withheld(_) => Cut::Withheld,
            Self::Suspended(_) => Cut::Suspended,
            Self::Settings(_) => Cut::Settings,
            Self::Frozen(_) => Cut::FrozenState,
            Self::DeviceClock(_) => Cut::DeviceClock,
            Self::LateRead(_) | Self::LateStep(_) | Self::LateWrite(_) => Cut::LateLoop,
            Self::Dropped => Cut::Device,
            Self::NonFiniteWrench => Cut::NonFiniteWrench,
            Self::Panic => Cut::Panic,
            Self::Stuck(_) | Self::LoopClock(_) | Self::Wrench(..) | Self::Velocity(..) | Self::SlowSteps(..) => {
                return None;
            }
        })
    }
}

/// Faults by tick. A device and a step share the script.
#[derive(Clone, Debug)]
pub struct Script {
    faults: Arc<[(u64, Fault)]>,
    /// Number of reads so far.
    reads: Arc<AtomicU64>,
    time: Option<VirtualTime>,
}

impl Script {
    /// Returns a script with these faults at these ticks (tick 0 is the first read), in virtual
    /// time or by the wall clock.
    pub fn new(faults: &[(u64, Fault)], time: Option<&VirtualTime>) -> Self {
        Self { faults: faults.into(), reads: Arc::default(), time: time.cloned() }
    }

    /// Returns the faults.
    pub fn faults(&self) -> &[(u64, Fault)] {
        &self.faults
    }

    /// Wraps `step` so that the faults of the script act in it.
    pub fn step<T>(
        &self,
        mut step: impl FnMut(&DeviceState, f64) -> StepOutcome<T>,
    ) -> impl FnMut(&DeviceState, f64) -> StepOutcome<T> {
        let mut faults = self.in_step();
        move |state, dt| {
            let mut outcome = step(state, dt);
            faults.act(&mut outcome);
            outcome
        }
    }

    /// Returns the faults that act in a step.
    pub fn in_step(&self) -> StepFaults {
        StepFaults { script: self.clone(), slow: 0, long: Duration::ZERO, gain: 1.0 }
    }

    /// Returns the faults of the tick that was read last.
    fn now(&self) -> impl Iterator<Item = Fault> + '_ {
        let tick = self.reads.load(Ordering::Relaxed).wrapping_sub(1);
        self.faults.iter().filter(move |(at, _)| *at == tick).map(|(_, fault)| *fault)
    }

    fn wait(&self, duration: Duration) {
        match &self.time {
            Some(time) => time.pass(duration),
            None => std::thread::sleep(duration),
        }
    }
}

/// Faults of a [`Script`] that act in a step and on its outcome.
pub struct StepFaults {
    script: Script,
    /// Number of further slow steps.
    slow: u32,
    /// Time that each slow step takes.
    long: Duration,
    gain: f64,
}

impl StepFaults {
    /// Applies the faults of this tick to the `outcome` of its step.
    pub fn act<T>(&mut self, outcome: &mut StepOutcome<T>) {
        let Self { script, slow, long, gain } = self;
        for fault in script.now() {
            match fault {
                Fault::SlowSteps(ticks, duration) => (*slow, *long) = (ticks, duration),
                Fault::Settings(by) => {
                    *gain *= by;
                    outcome.changed = true;
                }
                Fault::Suspended(duration) => {
                    if let Some(time) = &script.time {
                        time.suspend(duration);
                    }
                }
                Fault::LateStep(duration) => script.wait(duration),
                Fault::NonFiniteWrench => outcome.wrench.force.y = f64::NAN,
                Fault::Wrench(force, torque) => {
                    let along = DVec3::new(0.6, -0.64, 0.48);
                    outcome.wrench = Wrench { force: along * force, torque: -along * torque };
                }
                Fault::Panic => std::panic::resume_unwind(Box::new("an injected panic")),
                _ => {}
            }
        }
        if *slow > 0 {
            *slow -= 1;
            script.wait(*long);
        }
        let Wrench { torque, force } = outcome.wrench;
        outcome.wrench = Wrench { torque: torque * *gain, force: force * *gain };
    }
}

/// A device that fails as its script says.
#[derive(Debug)]
pub struct FaultyDevice<D> {
    device: D,
    script: Script,
    spec: DeviceSpec,
    /// Shift of every pose from now on, m.
    moved: DVec3,
    /// Rotation of every pose from now on.
    turned: DQuat,
    /// Offset of the device's clock, s.
    clock: f64,
    /// The last state that was returned.
    last: Option<DeviceState>,
    /// Number of ticks for which the last state is still repeated.
    held: u32,
    /// True if the repeated states have new times.
    ticking: bool,
    /// Added velocity (m/s), and the number of ticks for which it is still added.
    velocity: (DVec3, u32),
    /// Number of ticks for which the force is still withheld.
    withheld: u32,
    /// True if the force is withheld in this tick.
    withholds: bool,
    dropped: bool,
}

impl<D: HapticDevice> FaultyDevice<D> {
    /// Wraps `device` with the faults of `script`.
    pub fn new(device: D, script: &Script) -> Self {
        let spec = device.spec().clone();
        Self {
            device,
            script: script.clone(),
            spec,
            moved: DVec3::ZERO,
            turned: DQuat::IDENTITY,
            clock: 0.0,
            last: None,
            held: 0,
            ticking: false,
            velocity: (DVec3::ZERO, 0),
            withheld: 0,
            withholds: false,
            dropped: false,
        }
    }

    /// Replaces the description that the device reports, to test wrong descriptions.
    #[must_use]
    pub fn claiming(mut self, spec: DeviceSpec) -> Self {
        self.spec = spec;
        self
    }

    /// Returns the wrapped device.
    pub fn device(&self) -> &D {
        &self.device
    }

    fn lost() -> DeviceError {
        DeviceError::Lost(Cow::Borrowed("unplugged by an injected fault"))
    }

    /// Applies a fault that acts on `state` in this tick only.
    fn disturb(&mut self, state: &mut DeviceState, fault: Fault) {
        match fault {
            Fault::NonFinitePose => state.pose.translation.z = f64::NAN,
            Fault::NonFiniteTwist => state.twist.angular.x = f64::NEG_INFINITY,
            Fault::NoRotation => state.pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
            Fault::Speed(speed) => state.twist.linear.x += speed,
            Fault::LateRead(duration) => self.script.wait(duration),
            Fault::LoopClock(nanos) => {
                if let Some(time) = &self.script.time {
                    time.leap(nanos);
                }
            }
            _ => {}
        }
    }

    /// Starts a fault that lasts for several ticks.
    fn begin(&mut self, fault: Fault) {
        match fault {
            Fault::PoseJump(by) => self.moved += by,
            Fault::TurnJump(by) => self.turned = (DQuat::from_scaled_axis(by) * self.turned).normalize(),
            Fault::DeviceClock(by) => self.clock += by,
            Fault::Velocity(by, ticks) => self.velocity = (by, ticks),
            Fault::Withheld(ticks) => self.withheld = ticks,
            Fault::Frozen(ticks) => (self.held, self.ticking) = (ticks, false),
            Fault::Stuck(ticks) => (self.held, self.ticking) = (ticks, true),
            _ => {}
        }
    }
}

impl<D: HapticDevice> HapticDevice for FaultyDevice<D> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        if self.script.faults.is_empty() {
            return self.device.read();
        }
        if self.dropped {
            return Err(Self::lost());
        }
        let mut state = self.device.read()?;
        self.script.reads.fetch_add(1, Ordering::Relaxed);
        let script = self.script.clone();
        for fault in script.now() {
            self.begin(fault);
        }
        state.pose.translation += self.moved;
        state.pose.rotation = (self.turned * state.pose.rotation).normalize();
        state.time += self.clock;
        if let Some(last) = self.last.filter(|_| self.held > 0) {
            self.held -= 1;
            state = DeviceState { time: if self.ticking { state.time } else { last.time }, ..last };
        }
        self.last = Some(state);
        let (velocity, ticks) = &mut self.velocity;
        if *ticks > 0 {
            *ticks -= 1;
            state.twist.linear += *velocity;
        }
        // `withheld` is always current, even if the other fields repeat an old state.
        state.withheld = self.withheld > 0;
        self.withheld = self.withheld.saturating_sub(1);
        self.withholds = state.withheld;
        for fault in script.now() {
            self.disturb(&mut state, fault);
        }
        Ok(state)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if self.script.faults.is_empty() {
            return self.device.write(wrench);
        }
        if self.dropped {
            return Err(Self::lost());
        }
        let script = self.script.clone();
        for fault in script.now() {
            match fault {
                Fault::LateWrite(duration) => script.wait(duration),
                Fault::Dropped => self.dropped = true,
                _ => {}
            }
        }
        self.device.write(if self.withholds { &Wrench::ZERO } else { wrench })?;
        if self.dropped { Err(Self::lost()) } else { Ok(()) }
    }

    fn stands_unread(&self) -> bool {
        self.device.stands_unread()
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        self.device.counts()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }
}
