//! Seeded sequences of faults, and runs with these sequences.

pub(crate) mod judge;

use std::borrow::Cow;
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus_device::{
    AfterFault, AfterPanic, Brake, DeviceError, DeviceSpec, DeviceState, Fault, FaultyDevice, HandImpedance,
    HapticDevice, Intent, Rearm, RunStatistics, SafetyLimits, SafetyOptions, Script, Servo, ServoOptions, ServoTick,
    SimulatedDevice, SimulationSettings, StepOutcome, VirtualTime, known_devices,
};

use palpus::algebra::Random;

/// Number of ticks of each sequence.
const TICKS: u64 = 600;

/// A sequence of faults, and the data needed to judge its result.
pub(crate) struct Sequence {
    pub(crate) seed: u64,
    pub(crate) rate_hz: f64,
    pub(crate) spec: DeviceSpec,
    pub(crate) limits: SafetyLimits,
    pub(crate) options: ServoOptions,
    pub(crate) faults: Vec<(u64, Fault)>,
    /// Tick after which the run control ends the run.
    pub(crate) ends_at: Option<u64>,
}

impl Sequence {
    pub(crate) fn new(seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let rate_hz = [500.0, 1000.0, 1000.0, 4000.0, 10_000.0][random.below(5)];
        let known = known_devices();
        let honest = &known[random.below(known.len())];
        let spec = claim(random, honest);
        // The limits are derived from the device, with shorter times, so that a sequence has more
        // than one engagement.
        let ticks = |count: f64| count / rate_hz;
        let limits = SafetyLimits { ramp: ticks(40.0), hold: ticks(30.0), ..SafetyLimits::of(&spec, rate_hz) };
        let safety = SafetyOptions {
            limits: Some(limits),
            loosened: true,
            after_fault: if random.unit() < 0.9 { AfterFault::Reengage } else { AfterFault::Stop },
            after_panic: if random.unit() < 0.7 { AfterPanic::AsFault } else { AfterPanic::Stop },
            rearm: if random.unit() < 0.5 { Rearm::Automatic } else { Rearm::ByPerson },
            ..SafetyOptions::default()
        };
        let options =
            ServoOptions { rate_hz, duration: Some(TICKS as f64 / rate_hz), safety, ..ServoOptions::default() };
        let mut faults: Vec<(u64, Fault)> = Vec::new();
        for _ in 0..1 + random.below(8) {
            faults.push((random.below(TICKS as usize) as u64, fault(random, &limits, rate_hz)));
        }
        faults.sort_by_key(|(tick, _)| *tick);
        let ends_at = (random.unit() < 0.1).then(|| random.below(TICKS as usize) as u64);
        Self { seed, rate_hz, spec, limits, options, faults, ends_at }
    }

    /// Runs the sequence.
    pub(crate) fn run(&self) -> Ran {
        let time = VirtualTime::default();
        // The clock starts late enough that it can jump backwards.
        time.pass(Duration::from_secs(20));
        let script = Script::new(&self.faults, Some(&time));
        let settings = SimulationSettings {
            spec: DeviceSpec {
                force_max: f64::INFINITY,
                torque_max: f64::INFINITY,
                ..SimulationSettings::default().spec
            },
            rate_hz: self.rate_hz,
            hand: HandImpedance::NORMAL,
            ..SimulationSettings::default()
        };
        let intent = |t: f64| {
            Pose::new(
                DQuat::from_rotation_y(0.2 * (9.0 * t).sin()),
                DVec3::new(0.01 * (12.0 * t).cos() - 0.008, 0.0, 0.02 * t),
            )
        };
        let hand = SimulatedDevice::new(settings, intent).expect("the settings are valid");
        let moves = Rc::new(Cell::new(Twist::default()));
        let grip = Grip { device: hand, moves: Rc::clone(&moves) };
        let device = FaultyDevice::new(grip, &script).claiming(self.spec.clone());
        let mut device = Scribe { device, written: Vec::new() };
        let brake = device.brake().expect("a simulated device has a brake");
        let mut ticks = Vec::new();
        let mut motion = Vec::new();
        let mut servo = Servo::new(self.options).expect("the options are valid");
        let control = servo.control();
        let mut observer = |tick: &ServoTick, (): &()| {
            ticks.push(*tick);
            motion.push(moves.get());
            if self.ends_at == Some(tick.index) {
                control.end();
            }
        };
        let step = script.step(wall(self.seed));
        let statistics = servo.run_in(&time, &mut device, step, &mut observer, &AtomicBool::new(false));
        Ran { ticks, motion, written: device.written, statistics, braked: brake.is_applied() }
    }
}

/// Result of a sequence.
pub(crate) struct Ran {
    pub(crate) ticks: Vec<ServoTick>,
    /// The true velocity of the grip in each tick.
    pub(crate) motion: Vec<Twist>,
    /// Every message that the device accepted.
    pub(crate) written: Vec<Wrench>,
    pub(crate) statistics: RunStatistics,
    /// True if the brake was applied at the end.
    pub(crate) braked: bool,
}

/// Returns a random fault that is large enough to be detected.
fn fault(random: &mut Random, limits: &SafetyLimits, rate_hz: f64) -> Fault {
    let stall = Duration::from_secs_f64(limits.stall * random.between(1.2, 4.0));
    let frozen = (limits.stale * rate_hz).ceil() as u32 + 3 + random.below(20) as u32;
    let wrench = 10f64.powf(random.between(0.0, 12.0));
    let period = Duration::from_secs_f64(1.0 / rate_hz);
    match random.below(24) {
        0 => Fault::NonFinitePose,
        1 => Fault::NonFiniteTwist,
        2 => Fault::NoRotation,
        3 => Fault::PoseJump(random.direction() * 10f64.powf(random.between(-1.5, 6.0))),
        4 => Fault::TurnJump(random.direction() * random.between(1.0, 3.0)),
        5 => Fault::Speed(limits.speed * random.between(2.0, 100.0)),
        6 => Fault::Frozen(frozen),
        7 => Fault::Stuck(frozen * 10),
        8 => Fault::DeviceClock(random.between(0.1, 1e6) * if random.unit() < 0.5 { -1.0 } else { 1.0 }),
        9 => Fault::LoopClock((random.between(-1.0, 1.0) * 1e10) as i64),
        10 => Fault::LateRead(stall),
        11 => Fault::LateStep(stall),
        12 => Fault::LateWrite(stall),
        13 if random.unit() < 0.3 => Fault::Dropped,
        13 | 14 => Fault::NonFiniteWrench,
        15 => Fault::Wrench(wrench, 0.01 * wrench),
        16 => Fault::Wrench(0.1, wrench),
        17 => {
            Fault::Velocity(random.direction() * limits.speed * random.between(0.02, 3.0), 1 + random.below(300) as u32)
        }
        18 => Fault::Withheld(1 + random.below(100) as u32),
        19 => Fault::SlowSteps(1 + random.below(TICKS as usize) as u32, period.mul_f64(random.between(0.5, 4.0))),
        20 => Fault::Suspended(Duration::from_secs_f64(10f64.powf(random.between(-2.0, 5.0)))),
        21 | 22 => Fault::Settings(10f64.powf(random.between(-1.5, 1.5))),
        _ => Fault::Panic,
    }
}

/// Returns a description that a device may state, true or not.
fn claim(random: &mut Random, honest: &DeviceSpec) -> DeviceSpec {
    let lie = |random: &mut Random| [f64::INFINITY, f64::NAN, -5.0, 1e9, 0.0][random.below(5)];
    let mut spec = honest.clone();
    match random.below(4) {
        0 => spec.force_max = lie(random),
        1 => spec.torque_max = lie(random),
        2 => {
            spec.name = Cow::Borrowed("unheard of");
            (spec.force_max, spec.torque_max) = (lie(random), lie(random));
            spec.force_continuous = Some(lie(random));
            spec.workspace = Some(DVec3::splat(lie(random)));
        }
        _ => {}
    }
    spec
}

/// A wall with a rough surface, with a small force everywhere and sometimes a force larger than any
/// device can give.
fn wall(seed: u64) -> impl FnMut(&DeviceState, f64) -> StepOutcome {
    let mut random = Random::new(seed ^ 0xf00d);
    move |state, _| {
        let depth = (-state.pose.translation.x).max(0.0);
        let rough = if random.unit() < 0.02 { random.between(0.0, 30.0) } else { 0.0 };
        let force = DVec3::X * (600.0 * depth).min(1e6) + random.direction() * (0.05 + rough);
        StepOutcome::of(Wrench { force, torque: random.direction() * (0.001 + 0.02 * rough) })
    }
}

/// Stores the true velocity of the grip.
struct Grip<I> {
    device: SimulatedDevice<I>,
    moves: Rc<Cell<Twist>>,
}

impl<I: Intent> HapticDevice for Grip<I> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        let state = self.device.read();
        self.moves.set(self.device.true_twist());
        state
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.device.write(wrench)
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }
}

/// Stores the written wrenches.
struct Scribe<D> {
    device: D,
    written: Vec<Wrench>,
}

impl<D: HapticDevice> HapticDevice for Scribe<D> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.device.read()
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.device.write(wrench)?;
        self.written.push(*wrench);
        Ok(())
    }

    fn stands_unread(&self) -> bool {
        self.device.stands_unread()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.device.brake()
    }
}
