//! Newest values of a running loop, and the line in the terminal.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use palpus_device::{Cuts, Phase, ServoTick};

use super::{Session, heavy, keys};
use crate::engine::Detail;
use crate::output;
use crate::way_out::{InsideStart, WayOut};

/// Values that the live line and the window show.
#[derive(Clone, Copy, Default)]
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only the window shows all of it"))]
pub(crate) struct Live {
    pub(crate) ticks: u64,
    pub(crate) rate_hz: f64,
    pub(crate) time: f64,
    pub(crate) query_ns: u64,
    pub(crate) force_ns: u64,
    pub(crate) contacts: u32,
    /// True if some tick had a contact.
    pub(crate) touched: bool,
    pub(crate) clusters: u32,
    pub(crate) separation: f64,
    pub(crate) force: f64,
    pub(crate) torque: f64,
    /// Recent step time divided by the period, and recent share of extrapolated contacts.
    pub(crate) load: f64,
    pub(crate) carried: f64,
    pub(crate) overruns: u64,
    pub(crate) faults: u64,
    pub(crate) cuts: Cuts,
    pub(crate) phase: Phase,
    /// Motion of the probe that enables the force, while the start-up waits for it.
    pub(crate) way_out: Option<WayOut>,
    /// The motion that enables the force, as computed in the first tick.
    pub(crate) start: Option<WayOut>,
    /// True if the device leads the probe out of the part, or has done so.
    pub(crate) led: bool,
    /// Way out that was computed at the start, as long as the probe is inside.
    pub(super) inside: Option<InsideStart>,
}

impl Live {
    /// Creates the values before the first tick of a run that starts inside the part.
    pub(crate) fn new(rate_hz: f64, inside: Option<InsideStart>) -> Self {
        Self { rate_hz, separation: f64::INFINITY, inside, ..Self::default() }
    }

    /// Returns the message for a probe that starts inside the part. `otherwise`: how the device can
    /// lead it out.
    pub(crate) fn start_in_words(&self, otherwise: &str) -> Option<String> {
        let start = self.start.filter(|start| start.depth > 0.0)?;
        let depth = start.depth * 1e3;
        Some(if self.led {
            format!("the probe overlaps the part by {depth:.1} mm: the device leads it out; let it {}", start.words())
        } else {
            let words = start.words();
            format!("the probe overlaps the part by {depth:.1} mm: {words} to enable force, or {otherwise}")
        })
    }

    /// Updates the values after one more tick. Without a `detail`, the tick's step gave no answer.
    pub(crate) fn after(&self, tick: &ServoTick, detail: Option<&Detail>) -> Self {
        let faulted = tick.phase == Phase::Faulted && self.phase != Phase::Faulted;
        let now = Self {
            ticks: tick.index + 1,
            time: tick.time,
            force: tick.wrench.force.length(),
            torque: tick.wrench.torque.length(),
            load: self.load + OF_LATE * (tick.step_s * self.rate_hz - self.load),
            carried: self.carried + OF_LATE * (detail.map_or(0.0, |detail| detail.tick.carried()) - self.carried),
            overruns: self.overruns + u64::from(tick.overrun),
            faults: self.faults + u64::from(faulted),
            cuts: tick.cuts,
            phase: tick.phase,
            ..*self
        };
        let Some(Detail { tick: engine, way_out, leading, .. }) = detail else { return now };
        let grip = tick.state.pose.translation;
        let inside = self.inside.filter(|inside| tick.index > 0 || inside.is_at(grip));
        let left = inside.and_then(|inside| inside.left(grip));
        let contained = inside.is_some_and(|inside| inside.contained);
        Self {
            inside: inside.filter(|_| left.is_some()),
            query_ns: engine.times.query + engine.times.depth,
            force_ns: engine.times.force,
            contacts: engine.contacts,
            touched: self.touched || engine.contacts > 0,
            clusters: engine.clusters,
            separation: engine.separation,
            way_out: left
                .or(*way_out)
                .filter(|_| tick.phase == Phase::Waiting || *leading || (contained && left.is_some())),
            led: self.led || *leading,
            start: if tick.index == 0 { inside.map(|inside| inside.out).or(*way_out) } else { self.start },
            ..now
        }
    }
}

/// Smoothing factor of the shown values for each tick.
const OF_LATE: f64 = 0.02;

/// Time between two live lines.
const LIVE_PERIOD: Duration = Duration::from_millis(100);

/// Shows the newest values until the run is over, as a line that is redrawn on a terminal; without
/// a terminal, prints nothing. Stops the run at `end`. `said_heavy`: a note about a heavy pair was
/// printed before.
pub(super) fn watch(session: &mut Session, stop: &AtomicBool, end: Option<Instant>, said_heavy: bool) {
    let shown = output::watched();
    keys::take(session.control());
    let (mut reported, mut reported_heavy) = (false, said_heavy);
    let mut last = session.live().ticks;
    while !session.is_over() {
        std::thread::sleep(LIVE_PERIOD);
        if end.is_some_and(|end| Instant::now() >= end) {
            stop.store(true, Ordering::Relaxed);
        }
        let live = session.live();
        tell_start(&live, &mut reported);
        if let Some(words) = heavy::words(&live).filter(|_| !reported_heavy) {
            reported_heavy = true;
            output::note(words);
        }
        if shown {
            output::live(&format!(
                "{:6.0} Hz   load {:3.0} %   {:3} contacts   {:5.2} N   {}",
                (live.ticks - last) as f64 / LIVE_PERIOD.as_secs_f64(),
                100.0 * live.load,
                live.contacts,
                live.force,
                live.way_out.map_or_else(|| said(live.phase).to_owned(), |out| out.words()),
            ));
        }
        last = live.ticks;
    }
    tell_start(&session.live(), &mut reported);
    if shown {
        output::live_end();
    }
}

/// Reports once that the probe started inside the part.
fn tell_start(live: &Live, reported: &mut bool) {
    if let Some(words) = live.start_in_words("use --lead-out").filter(|_| !*reported) {
        *reported = true;
        output::note(words);
    }
}

/// Returns the reason for a missing or reduced force.
fn said(phase: Phase) -> &'static str {
    match phase {
        Phase::Engaged => "",
        Phase::Idle => "hold a button to enable force",
        Phase::Waiting => "move clear of the part to enable force",
        Phase::Ramping => "force is rising",
        Phase::Faulted => "fault: no force",
        Phase::Stopped => "stopped by a fault",
        Phase::Latched => "three faults in ten seconds: press a button, or r and Enter, to enable force",
    }
}
