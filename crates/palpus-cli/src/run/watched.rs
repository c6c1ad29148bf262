//! Passes every tick of the first device to observers through a queue. The servo thread never
//! waits; an observer that is too slow misses ticks.

use palpus::algebra::Wrench;
use palpus_device::{DeviceState, ServoTick};

use crate::engine::Detail;

/// Number of ticks that may wait: several seconds at 1 kHz.
const ROOM: usize = 1 << 12;

/// Data of a tick for observers.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only the window watches"))]
pub(crate) struct WatchedTick {
    /// Time since the run began, s.
    pub(crate) time: f64,
    /// Input of the engine.
    pub(crate) state: DeviceState,
    /// Wrench that was written, world.
    pub(crate) wrench: Wrench,
    /// Time of the engine's query, ns; 0 in ticks without an answer.
    pub(crate) query_ns: u64,
    pub(crate) force_ns: u64,
    pub(crate) contacts: u32,
    /// Separation of the deepest contact, m; infinite without contact.
    pub(crate) separation: f64,
}

/// Creates a queue and returns its ends.
pub(super) fn queue() -> (Watched, rtrb::Consumer<WatchedTick>) {
    let (producer, consumer) = rtrb::RingBuffer::new(ROOM);
    (Watched(producer), consumer)
}

/// The servo thread's end of the queue.
pub(super) struct Watched(rtrb::Producer<WatchedTick>);

impl Watched {
    /// Passes a tick to the queue. Never allocates or waits.
    pub(super) fn see(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        let engine = detail.map(|detail| &detail.tick);
        let watched = WatchedTick {
            time: tick.time,
            state: tick.state,
            wrench: tick.wrench,
            query_ns: engine.map_or(0, |engine| engine.times.query + engine.times.depth),
            force_ns: engine.map_or(0, |engine| engine.times.force),
            contacts: engine.map_or(0, |engine| engine.contacts),
            separation: engine.map_or(f64::INFINITY, |engine| engine.separation),
        };
        // If the queue is full, the observer misses the tick.
        let _ = self.0.push(watched);
    }
}
