//! The servo thread's side of a session. Nothing here waits, locks or, once the loop runs, obtains memory: newest values come and go through
//! exchanges of three slots, files to record to through a queue.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::thread;

use anyhow::anyhow;
use palpus::render::Settings;
use palpus_device::{
    DeviceState, FaultyDevice, HapticDevice, Publisher, RealTimeClaims, RealTimeOptions, RunStatistics, Script, Servo,
    ServoTick, claim,
};

use super::Live;
use crate::engine::{Detail, Engine};
use crate::recording::Rows;
use crate::summary::Gatherer;

/// A recording to go on with, and the settings that its header tells of; `None`: none.
pub(super) type Order = Option<(Rows, Settings)>;

/// Orders that may wait: while a run is paused nobody takes them, and people press buttons.
pub(super) const ORDERS: usize = 64;

/// All that the thread needs.
pub(super) struct ServoThread {
    pub(super) servo: Servo,
    pub(super) engine: Engine,
    pub(super) device: FaultyDevice<Box<dyn HapticDevice + Send>>,
    pub(super) script: Script,
    pub(super) gatherer: Gatherer,
    pub(super) log: Log,
    pub(super) live: (Publisher<Live>, Live),
    pub(super) claims: Option<RealTimeOptions>,
    pub(super) stop: Arc<AtomicBool>,
}

/// What it leaves behind.
pub(super) struct Turned {
    pub(super) statistics: RunStatistics,
    pub(super) gatherer: Gatherer,
    /// As it is after its last step.
    pub(super) engine: Engine,
}

/// What a thread of a servo loop leaves behind when it is joined.
pub(crate) fn joined<T>(result: thread::Result<T>) -> anyhow::Result<T> {
    result.map_err(|_| anyhow!("the servo thread failed outside of a step; please report this"))
}

impl ServoThread {
    /// The loop, from its first tick to its last; before the first, `granted` is told what the system grants.
    pub(super) fn turn(self, granted: &mpsc::Sender<Option<RealTimeClaims>>) -> Turned {
        let Self { mut servo, mut engine, mut device, script, mut gatherer, mut log, live, claims, stop } = self;
        let (mut publisher, mut now) = live;
        let mut observe = |tick: &ServoTick, detail: &Detail| {
            gatherer.add(tick, detail);
            log.add(tick, detail);
            now = now.after(tick, detail);
            publisher.publish(now);
        };
        // The other end is there until it was told.
        let _ = granted.send(claims.as_ref().map(claim));
        let step = script.step(|state: &DeviceState, dt| engine.step(state, dt));
        let statistics = servo.run(&mut device, step, &mut observe, &stop);
        Turned { statistics, gatherer, engine }
    }
}

/// What is recorded of the ticks.
pub(super) struct Log {
    pub(super) rows: Option<Rows>,
    /// The engine's settings.
    pub(super) in_force: Settings,
    pub(super) orders: rtrb::Consumer<Order>,
    /// Recordings that are over go back, to be freed elsewhere.
    pub(super) over: rtrb::Producer<Rows>,
}

impl Log {
    fn add(&mut self, tick: &ServoTick, detail: &Detail) {
        if let Some(settings) = &detail.changed {
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

    /// Goes on with another recording, or none, from tick `index` on.
    fn begin(&mut self, order: Order, index: u64) {
        if let Some(rows) = self.rows.take() {
            // There is room for as many as were ordered.
            let _ = self.over.push(rows);
        }
        self.rows = order.map(|(mut rows, told)| {
            if told != self.in_force {
                rows.change(index, &self.in_force);
            }
            rows
        });
    }
}
