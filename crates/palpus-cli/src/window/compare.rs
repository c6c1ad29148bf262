//! Compares a run with other settings: a second engine on its own thread gets the same device poses
//! as the first engine, tick by tick. The wrench of the second engine is not sent to the device.
//!
//! The hand feels only the first engine, so the hand's motion depends only on that engine. The
//! comparison therefore shows two wrenches for the same motion.

use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::thread::JoinHandle;

use anyhow::{Context, bail};
use palpus::render::Settings;
use palpus_device::{Newest, latest_of};
use palpus_window::{ComparedTick, Moment};

use crate::engine::Engine;
use crate::run::WatchedTick;
use crate::stage::Stage;

/// Largest number of batches of ticks that wait; each frame of the window adds one batch.
const MOST_BATCHES: usize = 16;

/// See the module's description.
pub(super) struct Comparison {
    /// `None` while the comparison ends.
    ticks: Option<SyncSender<Vec<WatchedTick>>>,
    answers: Receiver<Vec<ComparedTick>>,
    moments: Newest<Moment>,
    has_answered: bool,
    thread: Option<JoinHandle<()>>,
}

impl Comparison {
    /// Starts the comparison with the next tick that arrives.
    pub(super) fn begin(stage: &Stage, settings: &Settings, rate_hz: f64) -> anyhow::Result<Self> {
        if stage.tools().count() > 1 {
            bail!("scenes with several devices cannot be compared");
        }
        let mut engine = Engine::new(stage, &[*settings])?;
        let capacity = engine.capacity();
        let (publisher, moments) = latest_of(move || Moment::new(capacity));
        engine.publish(publisher);
        let (ticks, given) = sync_channel::<Vec<WatchedTick>>(MOST_BATCHES);
        let (answer, answers) = channel();
        let work = move || {
            let mut outcome = [None];
            for batch in given {
                let compared = |tick: &WatchedTick| {
                    engine.step(&[tick.state], 1.0 / rate_hz, &mut outcome);
                    let wrench = outcome[0].as_ref().map_or_else(Default::default, |outcome| outcome.wrench);
                    ComparedTick { time: tick.time, force: wrench.force, torque: wrench.torque }
                };
                if answer.send(batch.iter().map(compared).collect()).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new().name("compare".to_owned()).spawn(work);
        let thread = thread.context("no thread to compare on")?;
        Ok(Self { ticks: Some(ticks), answers, moments, has_answered: false, thread: Some(thread) })
    }

    /// Passes these ticks to the second engine; drops them if its queue is full.
    pub(super) fn give(&self, batch: Vec<WatchedTick>) {
        if let Some(ticks) = &self.ticks {
            let _ = ticks.try_send(batch);
        }
    }

    /// Passes the ticks since the last call to `each`, and returns the newest for display; `None`
    /// before the first tick.
    pub(super) fn take(&mut self, each: &mut dyn FnMut(ComparedTick)) -> Option<&Moment> {
        for tick in self.answers.try_iter().flatten() {
            self.has_answered = true;
            each(tick);
        }
        if self.has_answered { Some(self.moments.get()) } else { None }
    }
}

impl Drop for Comparison {
    fn drop(&mut self) {
        self.ticks = None;
        if let Some(thread) = self.thread.take() {
            // The thread of the second engine has no messages.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use glam::DVec3;
    use palpus::algebra::{Twist, Wrench};
    use palpus_device::{DeviceState, SimulationSettings};
    use palpus_io::scene::{CouplingMode, FilePolicy};

    use super::*;
    use crate::stage;

    /// Time limit on a busy machine.
    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn second_engine_gets_the_same_poses() {
        crate::bodies::use_cache(false);
        let stage = stage::prepare("box-table", FilePolicy::Inside).expect("the scene is built in");
        let (spec, rate) = (SimulationSettings::default().spec, 1000.0);
        let settings = stage.settings_in(CouplingMode::Direct, &spec, rate);
        let mut comparison = Comparison::begin(&stage, &settings, rate).expect("the comparison starts");
        let tick = |k: u32| {
            let time = f64::from(k) / rate;
            let (pose, twist) =
                (stage.grip(stage.path.pose(time)), Twist { linear: DVec3::ZERO, angular: DVec3::ZERO });
            let state = DeviceState { pose, twist, buttons: 0, time, withheld: false };
            let wrench = Wrench::ZERO;
            WatchedTick { time, state, wrench, query_ns: 0, force_ns: 0, contacts: 0, separation: f64::INFINITY }
        };
        let ticks: Vec<WatchedTick> = (0..2000).map(tick).collect();
        assert!(comparison.take(&mut |_| ()).is_none(), "without ticks there must be no result");
        comparison.give(ticks.clone());
        let (mut compared, begin) = (Vec::new(), Instant::now());
        while compared.len() < ticks.len() && begin.elapsed() < PATIENCE {
            comparison.take(&mut |tick| compared.push(tick));
            std::thread::sleep(Duration::from_millis(5));
        }
        // A second engine with equal settings must give identical wrenches.
        let mut engine = Engine::new(&stage, &[settings]).expect("the settings are valid");
        let mut outcome = [None];
        for (tick, compared) in ticks.iter().zip(&compared) {
            engine.step(&[tick.state], 1.0 / rate, &mut outcome);
            let wrench = outcome[0].as_ref().expect("the engine returns a wrench").wrench;
            assert_eq!((compared.time, compared.force, compared.torque), (tick.time, wrench.force, wrench.torque));
        }
        assert!(
            compared.len() == ticks.len() && compared.iter().any(|tick| tick.force.length() > 0.1),
            "there must be contact"
        );
    }
}
