//! The closed loop: a simulated hand holds a simulated device, which gets the method's wrench one
//! tick late. The tick lengths come from a recorded servo loop.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus::render::{Limits, ProbeState};
use palpus_device::{
    DeviceSpec, EnergyAccount, HandImpedance, HapticDevice, Jitter, Passivity, SafetyLimits, SimulatedDevice,
    SimulationSettings,
};

use super::ground::Ground;
use super::method::{Entry, Tuning};
use crate::bench::TICK;

/// Seed of the tick lengths.
pub(super) const PACE_SEED: u64 = 0xfee1_0001;

/// Hands by name.
pub(super) const HANDS: [(&str, HandImpedance); 4] = [
    ("none", HandImpedance::NONE),
    ("relaxed", HandImpedance::RELAXED),
    ("normal", HandImpedance::NORMAL),
    ("firm", HandImpedance::FIRM),
];

/// One tick of a closed loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopTick {
    /// Time of the tick, s.
    pub(super) time: f64,
    /// True pose of the probe.
    pub(super) pose: Pose,
    /// Pose at which the method shows the probe.
    pub(super) shown: Pose,
    /// Result of the method in this tick.
    pub(super) felt: Wrench,
    /// Net work that the method's forces and torques have done on the hand until now, J.
    pub(super) work: [f64; 2],
}

/// Influences on the motion of the device besides the method.
pub(super) struct Drive<'a> {
    pub(super) hand: HandImpedance,
    /// Intended pose of the probe as a function of the time in seconds.
    pub(super) intent: &'a dyn Fn(f64) -> Pose,
    /// A constant wrench about the grip in addition to the hand's wrench, such as a weight.
    pub(super) load: Wrench,
}

/// Returns the limits of the simulated device.
fn limits() -> Limits {
    let spec = SimulationSettings::default().spec;
    Limits { force: spec.force_max, torque: spec.torque_max }
}

/// Runs the method with the device's limits in the simulated hand for `seconds`. The run ends early
/// if a number is not finite.
pub(super) fn run(
    ground: &Ground,
    entry: &Entry,
    tuning: &Tuning,
    drive: &Drive<'_>,
    seconds: f64,
) -> anyhow::Result<Vec<LoopTick>> {
    let mut method = entry.build(ground, &Tuning { limits: limits(), ..*tuning })?;
    let default = SimulationSettings::default();
    // The load is not limited by the largest force of the device.
    let spec = DeviceSpec { force_max: f64::INFINITY, torque_max: f64::INFINITY, ..default.spec.clone() };
    let jitter = Some(Jitter::logged(PACE_SEED));
    let settings = SimulationSettings { hand: drive.hand, spec, jitter, ..default.clone() };
    let grip = ground.settings.grip_a;
    let mut device = SimulatedDevice::new(settings, |time: f64| (drive.intent)(time).with_origin(grip))?;
    let mut account = entry.is_passive.then(|| {
        let limits = SafetyLimits { allowance: 0.0, ..SafetyLimits::of(&default.spec, 1.0 / TICK) };
        EnergyAccount::new(&limits, TICK)
    });
    let count = (seconds / TICK) as usize;
    let mut ticks = Vec::with_capacity(count);
    let mut work = [0.0; 2];
    let (mut last_time, mut last_pose, mut acting) = (0.0, device.true_pose(), Wrench::ZERO);
    for k in 0..count {
        let state = device.read()?;
        let pose = device.true_pose();
        let moved = pose.translation - last_pose.translation;
        work[0] += acting.force.dot(moved);
        work[1] += acting.torque.dot(turned(&last_pose, &pose));
        let dt = if k == 0 { TICK } else { state.time - last_time };
        (last_time, last_pose) = (state.time, pose);
        let step = method.step(&ProbeState::of_grip(&state.pose, &state.twist, grip), dt);
        let mut felt = within_limits(&step.wrench);
        if let Some(account) = &mut account {
            felt = account.limit(&felt, &state, dt);
            account.commanded(&felt);
        }
        if !(felt.is_finite() && pose.is_valid()) {
            break;
        }
        device.write(&plus(&felt, &drive.load, 1.0))?;
        acting = plus(&device.applied(), &drive.load, -1.0);
        if k == 0 {
            // No wrench was written before the first tick.
            acting = Wrench::ZERO;
        }
        let pose = pose.with_origin(-grip);
        ticks.push(LoopTick { time: state.time, pose, shown: step.shown, felt, work });
    }
    Ok(ticks)
}

/// Returns `wrench` + `factor` · `load`.
fn plus(wrench: &Wrench, load: &Wrench, factor: f64) -> Wrench {
    let Wrench { torque, force } = *load;
    Wrench { torque: wrench.torque + torque * factor, force: wrench.force + force * factor }
}

/// Limits the wrench to what the device can give, for methods that have no limits of their own.
fn within_limits(felt: &Wrench) -> Wrench {
    let Limits { force, torque } = limits();
    Wrench { torque: felt.torque.clamp_length_max(torque), force: felt.force.clamp_length_max(force) }
}

/// Returns the rotation vector from one pose to the next, for small turns.
pub(super) fn turned(from: &Pose, to: &Pose) -> DVec3 {
    let turn = to.rotation * from.rotation.conjugate();
    turn.xyz() * (2.0 * turn.w.signum())
}
