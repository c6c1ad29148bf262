//! The servo thread's side of a session. Nothing here waits, locks or, once the loop runs, obtains memory: newest values come and go through
//! exchanges of three slots, files to record to through a queue.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::thread;

use anyhow::anyhow;
use palpus::render::{Limits, Settings};
use palpus_device::{
    BothObserver, Cut, DeviceState, FaultyDevice, HapticDevice, Publisher, RealTimeClaims, RealTimeOptions,
    RunStatistics, Script, Servo, ServoTick, StepOutcome, TickObserver, ToolOutcome, claim,
};

use super::Live;
use crate::engine::{Detail, Engine};
use crate::fault_log::FaultWatch;
use crate::recording::Rows;
use crate::stopped::Stopped;
use crate::summary::Gatherer;
use crate::two::TwoEngine;

/// A recording to go on with, and the settings that its header tells of; `None`: none.
pub(super) type Order = Option<(Rows, Settings)>;

/// Orders that may wait: while a run is paused nobody takes them, and people press buttons.
pub(super) const ORDERS: usize = 64;

/// All that the thread needs.
pub(super) struct ServoThread {
    pub(super) working: Working,
    pub(super) work: Work,
    pub(super) script: Script,
    pub(super) claims: Option<RealTimeOptions>,
    pub(super) stop: Arc<AtomicBool>,
}

/// What steps, and a second device if there is one.
pub(super) enum Work {
    One(Box<Engine>),
    Two(Box<(TwoEngine, Working)>),
}

/// What one device needs.
pub(super) struct Working {
    pub(super) servo: Servo,
    pub(super) device: FaultyDevice<Box<dyn HapticDevice + Send>>,
    pub(super) gatherer: Gatherer,
    pub(super) log: Log,
    pub(super) live: (Publisher<Live>, Live),
    pub(super) faults: Option<FaultWatch>,
}

/// What the thread leaves behind.
pub(super) struct Turned {
    pub(super) first: Worked,
    pub(super) second: Option<Worked>,
    pub(super) engine: Stopped,
}

/// What it leaves of one device.
pub(super) struct Worked {
    pub(super) statistics: RunStatistics,
    pub(super) gatherer: Gatherer,
}

/// What a thread of a servo loop leaves behind when it is joined.
pub(crate) fn joined<T>(result: thread::Result<T>) -> anyhow::Result<T> {
    result.map_err(|_| anyhow!("the servo thread failed outside of a step; please report this"))
}

impl ServoThread {
    /// The loop, from its first tick to its last; before the first, `granted` is told what the system grants.
    pub(super) fn turn(self, granted: &mpsc::Sender<Option<RealTimeClaims>>) -> Turned {
        let Self { working, work, script, claims, stop } = self;
        // The other end is there until it was told.
        let _ = granted.send(claims.as_ref().map(claim));
        match work {
            Work::One(engine) => one(working, engine, script, &stop),
            Work::Two(both) => {
                let (engine, second) = *both;
                two([working, second], engine, script, &stop)
            }
        }
    }
}

fn one(working: Working, mut engine: Box<Engine>, script: Script, stop: &AtomicBool) -> Turned {
    let Working { mut servo, mut device, gatherer, log, live, faults } = working;
    let told = Told::default();
    let step = script.step(|state: &DeviceState, dt| {
        if told.panicked.take() {
            engine.forget();
        }
        engine.set_available(&told.available[0].get());
        engine.step(state, dt)
    });
    let mut watcher = Watcher { sights: [Sight { gatherer, log, live, faults }], told: &told };
    let statistics = servo.run(&mut device, step, &mut watcher, stop);
    let [sight] = watcher.sights;
    Turned { first: Worked { statistics, gatherer: sight.gatherer }, second: None, engine: Stopped::One(engine) }
}

fn two(working: [Working; 2], mut engine: TwoEngine, script: Script, stop: &AtomicBool) -> Turned {
    let [first, second] = working.map(|Working { servo, device, gatherer, log, live, faults }| {
        (servo, device, Sight { gatherer, log, live, faults })
    });
    let ((mut servo, mut device, sight), (mut other_servo, mut other_device, other_sight)) = (first, second);
    // What goes wrong in the step on purpose does so around that of the first tool.
    let aside = Cell::new(None);
    let told = Told::default();
    let mut scripted = script.step(|state: &DeviceState, dt| {
        if told.panicked.take() {
            engine.forget();
        }
        engine.set_available(&told.available.each_ref().map(Cell::get));
        let [first, second] = engine.step(&[*state, aside.take().unwrap_or(*state)], dt);
        let StepOutcome { wrench, saturated, changed, received, detail } = first.outcome;
        StepOutcome { wrench, saturated, changed, received, detail: (detail, first.received, second) }
    });
    let step = |states: &[DeviceState; 2], dt: f64| {
        aside.set(Some(states[1]));
        let outcome = scripted(&states[0], dt);
        let StepOutcome { wrench, saturated, changed, received, detail: (detail, from_other, second) } = outcome;
        let outcome = StepOutcome { wrench, saturated, changed, received, detail };
        [ToolOutcome { outcome, received: from_other }, second]
    };
    let mut watcher = Watcher { sights: [sight, other_sight], told: &told };
    let statistics = servo.run_both(&mut other_servo, [&mut device, &mut other_device], step, &mut watcher, stop);
    drop(scripted);
    let ([first, second], [sight, other_sight]) = (statistics, watcher.sights);
    Turned {
        first: Worked { statistics: first, gatherer: sight.gatherer },
        second: Some(Worked { statistics: second, gatherer: other_sight.gatherer }),
        engine: Stopped::Two(Box::new(engine)),
    }
}

/// What the next step is told of the last tick.
struct Told {
    available: [Cell<Limits>; 2],
    panicked: Cell<bool>,
}

impl Default for Told {
    fn default() -> Self {
        Self { available: [const { Cell::new(Limits::UNLIMITED) }; 2], panicked: Cell::new(false) }
    }
}

/// Sees every tick of one device, or of two.
struct Watcher<'a, const N: usize> {
    sights: [Sight; N],
    told: &'a Told,
}

impl<const N: usize> Watcher<'_, N> {
    fn see(&mut self, which: usize, tick: &ServoTick, detail: Option<&Detail>) {
        self.told.available[which].set(tick.available);
        if tick.cuts.has(Cut::Panic) {
            self.told.panicked.set(true);
        }
        self.sights[which].see(tick, detail);
    }
}

impl TickObserver<Detail> for Watcher<'_, 1> {
    fn observe(&mut self, tick: &ServoTick, detail: &Detail) {
        self.see(0, tick, Some(detail));
    }

    fn unanswered(&mut self, tick: &ServoTick) {
        self.see(0, tick, None);
    }
}

impl BothObserver<Detail> for Watcher<'_, 2> {
    fn observe(&mut self, which: usize, tick: &ServoTick, detail: &Detail) {
        self.see(which, tick, Some(detail));
    }

    fn unanswered(&mut self, which: usize, tick: &ServoTick) {
        self.see(which, tick, None);
    }
}

/// What sees every tick of a device; without a detail, ticks whose step gave no answer.
struct Sight {
    gatherer: Gatherer,
    log: Log,
    live: (Publisher<Live>, Live),
    faults: Option<FaultWatch>,
}

impl Sight {
    fn see(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        if let Some(detail) = detail {
            self.gatherer.add(tick, detail);
        }
        self.log.add(tick, detail);
        if let Some(faults) = &mut self.faults {
            faults.see(tick);
        }
        let (publisher, now) = &mut self.live;
        *now = now.after(tick, detail);
        publisher.publish(*now);
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
