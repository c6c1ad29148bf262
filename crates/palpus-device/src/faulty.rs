//! Faults on purpose: a device, a step and clocks that go wrong when a script says so.
//!
//! A [`Script`] is a list of faults by tick, written by hand or drawn from a seed. Wrapped around a
//! device ([`FaultyDevice`]) and a step ([`Script::step`]) it makes a run go through them: what the
//! safety chain has to survive.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::Wrench;

use crate::device::{Brake, DeviceError, DeviceSpec, DeviceState, HapticDevice};
use crate::safety::Cut;
use crate::servo::{StepOutcome, VirtualTime};

/// A fault in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A coordinate of the pose is not a number.
    NonFinitePose,
    /// A velocity is infinite.
    NonFiniteTwist,
    /// The rotation is no unit quaternion.
    NoRotation,
    /// From now on the pose is this far from where it was, m.
    PoseJump(DVec3),
    /// From now on it is turned by this, rad.
    TurnJump(DVec3),
    /// The stated velocity has this added, m/s.
    Speed(f64),
    /// For so many ticks the stated velocity has this added, m/s.
    Velocity(DVec3, u32),
    /// For so many ticks the device gives no force, whatever the command, and says so.
    Withheld(u32),
    /// For so many ticks the same state is read again and again, with its time.
    Frozen(u32),
    /// For so many ticks the same state is read again and again, with a time that goes on.
    Stuck(u32),
    /// The device's clock jumps by so many s.
    DeviceClock(f64),
    /// The loop's clock jumps by so many ns; needs virtual time.
    LoopClock(i64),
    /// The read takes so long.
    LateRead(Duration),
    /// The step takes so long.
    LateStep(Duration),
    /// For so many ticks every step takes so long.
    SlowSteps(u32, Duration),
    /// The machine is suspended for so long; needs virtual time.
    Suspended(Duration),
    /// From now on the step goes by other settings, which answer so many times the wrench.
    Settings(f64),
    /// The write takes so long.
    LateWrite(Duration),
    /// The connection is gone in the middle of a command: the wrench may or may not have arrived,
    /// nothing else does.
    Dropped,
    /// The step answers a wrench that is not a number.
    NonFiniteWrench,
    /// The step answers this force and torque, N and N·m, along odd directions.
    Wrench(f64, f64),
    /// The step panics.
    Panic,
}

impl Fault {
    /// The cut by which the chain is bound to show it, when it happens alone and the grip hardly
    /// moves; `None` where it depends on the run.
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

/// Faults by tick, shared by a device and a step.
#[derive(Clone, Debug)]
pub struct Script {
    faults: Arc<[(u64, Fault)]>,
    /// Reads so far.
    reads: Arc<AtomicU64>,
    time: Option<VirtualTime>,
}

impl Script {
    /// These faults at these ticks (0 is the first read), in virtual time or on the wall's.
    pub fn new(faults: &[(u64, Fault)], time: Option<&VirtualTime>) -> Self {
        Self { faults: faults.into(), reads: Arc::default(), time: time.cloned() }
    }

    /// The faults.
    pub fn faults(&self) -> &[(u64, Fault)] {
        &self.faults
    }

    /// `step`, with the faults that happen in it.
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

    /// The faults that happen in a step.
    pub fn in_step(&self) -> StepFaults {
        StepFaults { script: self.clone(), slow: 0, long: Duration::ZERO, gain: 1.0 }
    }

    /// Faults of the tick that was read last.
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

/// Faults of a [`Script`] that happen in a step and to its outcome.
pub struct StepFaults {
    script: Script,
    /// Steps that are still to be slow, and how slow.
    slow: u32,
    long: Duration,
    gain: f64,
}

impl StepFaults {
    /// Applies the script's fault of this tick to the `outcome` of its step.
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
                Fault::Panic => std::panic::resume_unwind(Box::new("a panic on purpose")),
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

/// A device that goes wrong as its script says.
#[derive(Debug)]
pub struct FaultyDevice<D> {
    device: D,
    script: Script,
    spec: DeviceSpec,
    /// Added to every pose and time from now on.
    moved: DVec3,
    turned: DQuat,
    clock: f64,
    last: Option<DeviceState>,
    held: u32,
    ticking: bool,
    /// m/s, and for how many ticks.
    velocity: (DVec3, u32),
    /// Ticks.
    withheld: u32,
    /// In this tick.
    withholds: bool,
    dropped: bool,
}

impl<D: HapticDevice> FaultyDevice<D> {
    /// `device`, with the faults of `script`.
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

    /// A device that says this of itself, true or not.
    #[must_use]
    pub fn claiming(mut self, spec: DeviceSpec) -> Self {
        self.spec = spec;
        self
    }

    /// The wrapped device.
    pub fn device(&self) -> &D {
        &self.device
    }

    fn lost() -> DeviceError {
        DeviceError::Lost(Cow::Borrowed("unplugged on purpose"))
    }

    /// Changes `state` as the fault requires.
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

    /// Starts the faults that last from this tick on.
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
        // The newest state says whether the device withholds its force, however old the rest of it
        // is.
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
