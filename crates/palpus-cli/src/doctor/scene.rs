//! Measures how long the steps of a scene's closed loop take on this machine.

use std::sync::atomic::AtomicBool;

use palpus::render::{Settings, WorkLimit};
use palpus_device::{
    DeviceState, HapticDevice, RealTimeOptions, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings,
    claim,
};
use palpus_io::scene::FilePolicy;
use serde::Serialize;

use super::RATE_HZ;
use crate::engine::{Answer, Detail, Engine};
use crate::run::joined;
use crate::stage::{self, Stage};

/// Largest share of a period for step and lateness together. The rest is for the device's reads and
/// writes.
pub(super) const PERIOD_SHARE: f64 = 0.8;

/// Times of the steps of a scene, µs.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SceneTimes {
    pub(super) name: String,
    pub(super) ticks: u64,
    pub(super) p50_us: f64,
    pub(super) p99_us: f64,
    pub(super) p999_us: f64,
    pub(super) max_us: f64,
    /// Share of the ticks that reached the work limit, so that some contacts were extrapolated from
    /// the previous tick.
    pub(super) bounded_share: f64,
    /// Share of the ticks that wrote their wrench more than a period late.
    pub(super) overrun_share: f64,
    /// The fastest usual rate that the machine holds ([`super::rates`]). `None` before the
    /// measurement, and if the machine does not hold 500 Hz.
    pub(super) achievable_hz: Option<f64>,
}

impl SceneTimes {
    pub(super) fn in_words(&self) -> String {
        let Self { name, p50_us, p99_us, p999_us, max_us, achievable_hz, .. } = self;
        let rate = achievable_hz.map_or("with this timer not even 500 Hz".to_owned(), |hz| format!("up to {hz:.0} Hz"));
        format!(
            "{name}: a step takes {p50_us:.1} µs (median), {p99_us:.1} µs (p99), {p999_us:.1} µs (p99.9), {max_us:.0} µs (largest); {rate}"
        )
    }
}

/// Prepares the scene for a run. Preparing takes time at the first use.
pub(super) fn prepare(name: &str) -> anyhow::Result<Stage> {
    stage::prepare(name, FilePolicy::Inside)
}

/// Runs the scene's loop in real time for `duration` seconds on a thread of its own.
pub(super) fn measure(name: &str, stage: &Stage, duration: f64) -> anyhow::Result<SceneTimes> {
    let options = ServoOptions { rate_hz: RATE_HZ, duration: Some(duration), ..ServoOptions::default() };
    let (mut devices, mut settings) = (vec![simulated(stage)?], vec![usual(stage)]);
    let mut servo = Servo::new(options)?;
    for stage in stage.of_others() {
        devices.push(simulated(&stage)?);
        settings.push(usual(&stage));
        servo = servo.with_device(options.safety)?;
    }
    let mut engine = Engine::new(stage, &settings)?;
    engine.allow(WorkLimit::TimeBudget);
    let mut bounded = 0;
    let statistics = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("servo".to_owned()).spawn_scoped(scope, || {
            let _ = claim(&RealTimeOptions::default());
            let step = |states: &[DeviceState], dt: f64, answers: &mut [Answer]| engine.step(states, dt, answers);
            let mut observe = |tick: &ServoTick, detail: &Detail| {
                bounded += u64::from(tick.device == 0 && detail.tick.counters.query.traversal.postponed > 0);
            };
            let mut devices: Vec<&mut (dyn HapticDevice + Send)> =
                devices.iter_mut().map(|device| &mut **device).collect();
            servo.run_all(&mut devices, step, &mut observe, &AtomicBool::new(false))
        })?;
        anyhow::Ok(joined(thread.join())??.swap_remove(0))
    })?;
    let step = &statistics.step_us;
    Ok(SceneTimes {
        name: name.to_owned(),
        ticks: statistics.ticks,
        p50_us: step.p50,
        p99_us: step.p99,
        p999_us: step.p999,
        max_us: step.max,
        bounded_share: bounded as f64 / statistics.ticks.max(1) as f64,
        overrun_share: statistics.overruns as f64 / statistics.ticks.max(1) as f64,
        achievable_hz: None,
    })
}

/// Returns a tool's simulated device in the scene's simulated hand.
fn simulated(stage: &Stage) -> anyhow::Result<Box<dyn HapticDevice + Send>> {
    let settings = SimulationSettings { rate_hz: RATE_HZ, hand: stage.hand(None)?, ..SimulationSettings::default() };
    Ok(Box::new(SimulatedDevice::new(settings, stage.intent())?))
}

/// Returns the settings of a tool on this device.
fn usual(stage: &Stage) -> Settings {
    stage.settings_for(&SimulationSettings::default().spec, RATE_HZ)
}
