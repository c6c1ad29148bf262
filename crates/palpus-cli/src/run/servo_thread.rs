//! The servo thread's side of a session. This code never waits or locks, and does not allocate once
//! the loop runs: newest values pass through triple buffers, and new recordings pass through a
//! queue.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::thread;

use anyhow::anyhow;
use palpus::render::{Limits, Settings};
use palpus_device::{
    Cut, DeviceState, FaultyDevice, HapticDevice, Publisher, RealTimeClaims, RealTimeOptions, RunStatistics, Script,
    Servo, ServoTick, TickObserver, claim,
};

use super::Live;
use super::watched::Watched;
use crate::engine::{Answer, Detail, Engine};
use crate::fault_log::FaultWatch;
use crate::recording::Rows;
use crate::summary::Gatherer;

/// A recording to continue with and the settings in its header; `None` ends recording.
pub(super) type RecordingRequest = Option<(Rows, Settings)>;

/// Capacity of the queue of requests. A paused run does not read requests, but people may still
/// press buttons.
pub(super) const ORDERS: usize = 64;

/// All data that the thread needs.
pub(super) struct ServoThread {
    pub(super) servo: Servo,
    /// Parts for each device.
    pub(super) working: Vec<Working>,
    pub(super) engine: Engine,
    pub(super) script: Script,
    pub(super) claims: Option<RealTimeOptions>,
    pub(super) stop: Arc<AtomicBool>,
}

/// Parts of the loop for one device.
pub(super) struct Working {
    pub(super) device: FaultyDevice<Box<dyn HapticDevice + Send>>,
    pub(super) sight: ServoObserver,
}

/// Results of the thread.
pub(super) struct ServoResults {
    pub(super) worked: Vec<Worked>,
    pub(super) engine: Engine,
}

/// Results for one device.
pub(super) struct Worked {
    pub(super) statistics: RunStatistics,
    pub(super) gatherer: Gatherer,
}

/// Returns the results of a servo thread.
pub(crate) fn joined<T>(result: thread::Result<T>) -> anyhow::Result<T> {
    result.map_err(|_| anyhow!("the servo thread failed outside of a step; please report this"))
}

impl ServoThread {
    /// Runs the loop from its first to its last tick. Before the first tick it sends the real-time
    /// rights that the system grants to `granted`.
    pub(super) fn turn(self, granted: &mpsc::Sender<Option<RealTimeClaims>>) -> ServoResults {
        let Self { mut servo, working, mut engine, script, claims, stop } = self;
        // The receiver exists until it has got this message.
        let _ = granted.send(claims.as_ref().map(claim));
        let previous = PreviousTick::of(working.len());
        let (mut devices, sights): (Vec<_>, Vec<_>) =
            working.into_iter().map(|Working { device, sight }| (device, sight)).unzip();
        let mut faults = script.in_step();
        let step = |states: &[DeviceState], dt: f64, answers: &mut [Answer]| {
            if previous.panicked.take() {
                engine.forget();
            }
            for (which, available) in previous.available.iter().enumerate() {
                engine.set_available(which, &available.get());
            }
            engine.step(states, dt, answers);
            // Injected faults of the step apply to the first tool's step.
            if let Some(answer) = &mut answers[0] {
                faults.act(answer);
            }
        };
        let mut watcher = Watcher { sights, previous: &previous };
        let statistics = servo.run_all(&mut devices.iter_mut().collect::<Vec<_>>(), step, &mut watcher, &stop);
        let statistics = statistics.expect("the loop was made for these devices");
        let worked =
            |(statistics, sight): (RunStatistics, ServoObserver)| Worked { statistics, gatherer: sight.gatherer };
        ServoResults { worked: statistics.into_iter().zip(watcher.sights).map(worked).collect(), engine }
    }
}

/// Results of the previous tick that the next step needs.
struct PreviousTick {
    /// Available force and torque of each device.
    available: Vec<Cell<Limits>>,
    panicked: Cell<bool>,
}

impl PreviousTick {
    fn of(devices: usize) -> Self {
        Self { available: vec![Cell::new(Limits::UNLIMITED); devices], panicked: Cell::new(false) }
    }
}

/// Observes every tick of every device.
struct Watcher<'a> {
    sights: Vec<ServoObserver>,
    previous: &'a PreviousTick,
}

impl Watcher<'_> {
    fn see(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        self.previous.available[tick.device].set(tick.available);
        if tick.cuts.has(Cut::Panic) {
            self.previous.panicked.set(true);
        }
        self.sights[tick.device].see(tick, detail);
    }
}

impl TickObserver<Detail> for Watcher<'_> {
    fn observe(&mut self, tick: &ServoTick, detail: &Detail) {
        self.see(tick, Some(detail));
    }

    fn unanswered(&mut self, tick: &ServoTick) {
        self.see(tick, None);
    }
}

/// Observer of every tick of a device; ticks without an answer have no detail.
pub(super) struct ServoObserver {
    pub(super) gatherer: Gatherer,
    pub(super) log: Log,
    pub(super) live: (Publisher<Live>, Live),
    pub(super) faults: Option<FaultWatch>,
    pub(super) watched: Option<Watched>,
}

impl ServoObserver {
    fn see(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        if let Some(detail) = detail {
            self.gatherer.add(tick, detail);
        }
        self.log.add(tick, detail);
        if let Some(faults) = &mut self.faults {
            faults.see(tick);
        }
        if let Some(watched) = &mut self.watched {
            watched.see(tick, detail);
        }
        let (publisher, now) = &mut self.live;
        *now = now.after(tick, detail);
        publisher.publish(*now);
    }
}

/// Recorder of the ticks.
pub(super) struct Log {
    pub(super) rows: Option<Rows>,
    /// The engine's settings.
    pub(super) in_force: Settings,
    pub(super) orders: rtrb::Consumer<RecordingRequest>,
    /// Finished recordings, which another thread frees.
    pub(super) over: rtrb::Producer<Rows>,
}

impl Log {
    fn add(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        let changed = detail.and_then(|detail| detail.changed.as_ref());
        if let Some(settings) = changed.filter(|settings| **settings != self.in_force) {
            self.in_force = *settings;
            if let Some(rows) = &mut self.rows {
                rows.change(tick.index, settings);
            }
        }
        while let Ok(order) = self.orders.pop() {
            self.begin(order, tick.index);
        }
        if let Some(rows) = &mut self.rows {
            rows.row(tick, detail);
        }
    }

    /// Continues with another recording, or without a recording, from tick `index` on.
    fn begin(&mut self, order: RecordingRequest, index: u64) {
        if let Some(rows) = self.rows.take() {
            // The queue has room for all requested recordings.
            let _ = self.over.push(rows);
        }
        self.rows = order.map(|(mut rows, settings)| {
            if settings != self.in_force {
                rows.change(index, &self.in_force);
            }
            rows
        });
    }
}
