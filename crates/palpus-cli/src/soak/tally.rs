//! Statistics of the servo thread in intervals of fixed size. The thread publishes each interval
//! through a wait-free exchange.

use std::time::{Duration, Instant};

use palpus_device::{LATE, Phase, Publisher, SafetyCounters, ServoTick};

use super::buckets::Buckets;
use crate::engine::Detail;

/// Counts of an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Interval {
    /// Wall-clock time from the start of the loop to the interval's beginning and end, s.
    pub(super) span: [f64; 2],
    pub(super) ticks: u64,
    pub(super) lateness: Buckets,
    pub(super) step: Buckets,
    /// Number of ticks that began more than half a millisecond late.
    pub(super) late: u64,
    /// Number of ticks that wrote their wrench more than a period after they were due.
    pub(super) overruns: u64,
    pub(super) contacts: u64,
    pub(super) contacts_max: u32,
    /// Number of ticks with a contact.
    pub(super) touching: u64,
    /// Number of times that contact began.
    pub(super) touches: u64,
    /// Sum of the force over all ticks, N.
    pub(super) force: f64,
    pub(super) force_max: f64,
    pub(super) torque_max: f64,
    /// Largest depth, m.
    pub(super) depth_max: f64,
    pub(super) allocations: u64,
    pub(super) cuts: SafetyCounters,
    /// Number of faults that removed the wrench.
    pub(super) faults: u64,
    /// Numerical trouble: unconverged distance marches and depth walks, contacts beyond the
    /// capacity, tools reset to the device's pose.
    pub(super) trouble: u64,
}

/// Collects the statistics of the current interval.
pub(super) struct Tally {
    length: Duration,
    publisher: Publisher<Interval>,
    begun: Instant,
    end: Duration,
    now: Interval,
    touching: bool,
    /// For each device: true while a fault removes its wrench.
    faulted: Vec<bool>,
}

impl Tally {
    /// Creates the statistics for `devices` devices.
    pub(super) fn new(length: Duration, devices: usize, publisher: Publisher<Interval>) -> Self {
        Self {
            length,
            publisher,
            begun: Instant::now(),
            end: length,
            now: Interval::default(),
            touching: false,
            faulted: vec![false; devices],
        }
    }

    /// Sets the start of the loop.
    pub(super) fn begin(&mut self) {
        self.begun = Instant::now();
    }

    /// Adds a device's tick, and publishes the interval after its last tick.
    pub(super) fn add(&mut self, tick: &ServoTick, detail: &Detail) {
        let (now, engine) = (&mut self.now, &detail.tick);
        now.force_max = now.force_max.max(tick.wrench.force.length());
        now.torque_max = now.torque_max.max(tick.wrench.torque.length());
        now.depth_max = now.depth_max.max(-engine.separation);
        now.cuts.add(tick.cuts);
        let faulted = matches!(tick.phase, Phase::Faulted | Phase::Stopped | Phase::Latched);
        now.faults += u64::from(faulted && !self.faulted[tick.device]);
        self.faulted[tick.device] = faulted;
        let (query, tool) = (&engine.counters.query, &engine.counters.tool);
        now.trouble += u64::from(query.traversal.march_fallbacks)
            + u64::from(query.walk_stops)
            + u64::from(query.traversal.dropped)
            + u64::from(tool.reset);
        if tick.device == 0 {
            self.add_first(tick, detail);
        }
    }

    /// Adds the values of the loop and of the first tool.
    fn add_first(&mut self, tick: &ServoTick, detail: &Detail) {
        let now = &mut self.now;
        now.ticks += 1;
        now.lateness.add((tick.lateness_s * 1e9) as u64);
        now.step.add((tick.step_s * 1e9) as u64);
        now.late += u64::from(tick.lateness_s > LATE.as_secs_f64());
        now.overruns += u64::from(tick.overrun);
        let engine = &detail.tick;
        now.contacts += u64::from(engine.contacts);
        now.contacts_max = now.contacts_max.max(engine.contacts);
        let touching = engine.contacts > 0;
        now.touching += u64::from(touching);
        now.touches += u64::from(touching && !self.touching);
        self.touching = touching;
        now.force += tick.wrench.force.length();
        now.allocations += detail.allocations;
        let elapsed = self.begun.elapsed();
        if elapsed >= self.end {
            let mut done = self.finish_at(elapsed);
            self.publisher.publish_with(|slot| std::mem::swap(slot, &mut done));
        }
    }

    /// Returns the last, incomplete interval.
    pub(super) fn finish(mut self) -> Interval {
        let elapsed = self.begun.elapsed();
        self.finish_at(elapsed)
    }

    fn finish_at(&mut self, elapsed: Duration) -> Interval {
        let begin = elapsed.as_secs_f64();
        self.now.span[1] = begin;
        let done = self.now;
        self.now = Interval { span: [begin, begin], ..Interval::default() };
        // Skips whole intervals without a tick.
        while self.end <= elapsed {
            self.end += self.length;
        }
        done
    }
}
