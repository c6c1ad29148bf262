//! The servo thread of a loop. The thread owns the world and the device until it ends. Python and
//! the thread exchange the newest values through triple buffers and a bounded queue. Once the loop
//! runs, nothing here waits, locks or allocates.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use palpus::{BodyId, Limits, Pose, ProbeState, Settings, ToolId, Twist, WallClock, World, Wrench};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{
    Cut, HapticDevice, Newest, Phase, Publisher, RealTimeOptions, RunStatistics, Servo, ServoTick, StepOutcome,
    TickObserver, claim,
};

/// State of a tick.
#[derive(Clone, Copy)]
pub(crate) struct Now {
    pub(crate) tick: u64,
    pub(crate) time: f64,
    /// Pose of the tool's frame in the world.
    pub(crate) tool: Pose,
    /// Pose of the grip in the world, as reported by the device.
    pub(crate) grip: Pose,
    /// Wrench sent to the device.
    pub(crate) wrench: Wrench,
    pub(crate) contacts: usize,
    pub(crate) phase: Phase,
}

/// An update of a driven body from Python: the body, its pose and its twist.
pub(crate) type Drive = (BodyId, Pose, Twist);

/// Everything that the thread needs.
pub(crate) struct ServoThread {
    pub(crate) servo: Servo,
    pub(crate) device: Box<dyn HapticDevice + Send>,
    pub(crate) world: World,
    pub(crate) tool: ToolId,
    /// Time that a step should take at most, ns. `None`: any time, and equal runs give equal bits.
    pub(crate) time_budget: Option<u64>,
    pub(crate) claims: bool,
    pub(crate) settings: Newest<Settings>,
    pub(crate) drives: rtrb::Consumer<Drive>,
    pub(crate) now: Publisher<Now>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// Result of a loop that has ended.
pub(crate) struct Ended {
    pub(crate) world: World,
    pub(crate) statistics: RunStatistics,
    /// Number of allocations during ticks.
    pub(crate) allocations: u64,
}

/// Details of a step for the observer.
struct Detail {
    tool: Pose,
    contacts: usize,
    allocations: u64,
}

impl ServoThread {
    /// Runs the loop from its first tick to its last.
    pub(crate) fn turn(self) -> Ended {
        let Self { mut servo, mut device, mut world, tool, time_budget, claims, mut settings, mut drives, now, stop } =
            self;
        if claims {
            claim(&RealTimeOptions::default());
        }
        let clock = WallClock::new();
        let set = |world: &mut World, settings: Settings| {
            world.set_tool_settings(tool, &Settings { time_budget, ..settings }).is_ok()
        };
        let first = *world.tool_settings(tool);
        set(&mut world, first);
        let carried = LastTick { available: Cell::new(Limits::UNLIMITED), panicked: Cell::new(false) };
        let step = |state: &palpus_device::DeviceState, dt: f64| {
            let before = allocations_of_this_thread();
            if carried.panicked.take() {
                world.clear();
            }
            world.set_available(tool, &carried.available.get());
            let asked = settings.take().is_some_and(|asked| set(&mut world, *asked));
            while let Ok((body, pose, twist)) = drives.pop() {
                world.drive(body, pose, twist);
            }
            let probe = ProbeState::of_grip(&state.pose, &state.twist, world.tool_settings(tool).grip_a);
            world.step(&[probe], dt, &clock);
            let tick = world.tick(tool);
            let allocations = allocations_of_this_thread() - before;
            let cut = tick.counters.saturated_force + tick.counters.saturated_torque > 0;
            StepOutcome {
                wrench: tick.commanded,
                saturated: cut,
                changed: asked,
                received: tick.work_from_objects,
                from_others: tick.work_from_other,
                detail: Detail { tool: tick.tool_ba, contacts: tick.contacts.len(), allocations },
            }
        };
        let mut watcher = Watcher { now, carried: &carried, last: None, allocations: 0 };
        let statistics = servo.run(&mut *device, step, &mut watcher, &stop);
        let allocations = watcher.allocations;
        Ended { world, statistics, allocations }
    }
}

/// Values of the last tick that the next step needs.
struct LastTick {
    available: Cell<Limits>,
    panicked: Cell<bool>,
}

/// Publishes every tick.
struct Watcher<'a> {
    now: Publisher<Now>,
    carried: &'a LastTick,
    /// The last pose of the tool, and its number of contacts.
    last: Option<(Pose, usize)>,
    allocations: u64,
}

impl Watcher<'_> {
    fn see(&mut self, tick: &ServoTick) {
        self.carried.available.set(tick.available);
        if tick.cuts.has(Cut::Panic) {
            self.carried.panicked.set(true);
        }
        let (tool, contacts) = self.last.unwrap_or((Pose::IDENTITY, 0));
        self.now.publish(Now {
            tick: tick.index,
            time: tick.time,
            tool,
            grip: tick.state.pose,
            wrench: tick.wrench,
            contacts,
            phase: tick.phase,
        });
    }
}

impl TickObserver<Detail> for Watcher<'_> {
    fn observe(&mut self, tick: &ServoTick, detail: &Detail) {
        self.last = Some((detail.tool, detail.contacts));
        self.allocations += detail.allocations;
        self.see(tick);
    }

    fn unanswered(&mut self, tick: &ServoTick) {
        self.see(tick);
    }
}
