//! Detects persistent overrun: a loop that is late in many of its ticks.
//!
//! The slew limit handles a single late tick, and the watchdog handles a stall. Neither of these
//! covers a loop that is late in more than [`SHARE`] of its ticks. Such a loop renders from old
//! states, so contacts oscillate. The fraction is taken over the last [`WINDOW`]; nothing is
//! detected before that much time has passed.

/// Length of the window, s.
const WINDOW: f64 = 0.25;
/// Largest fraction of late ticks in the window.
const SHARE: f64 = 0.1;
/// Smallest number of late ticks that counts as persistent. One stall delays two ticks: its own and
/// the next.
const LEAST: usize = 3;

/// A tick in the window.
#[derive(Clone, Copy, Debug, Default)]
struct WindowTick {
    /// Time of the tick's start, s.
    at: f64,
    late: bool,
}

/// The ticks in the window.
#[derive(Debug)]
pub(super) struct Punctuality {
    /// Ring buffer.
    ticks: Vec<WindowTick>,
    oldest: usize,
    count: usize,
    late: usize,
    /// Time since the first tick, s.
    now: f64,
}

impl Punctuality {
    /// Takes the nominal `period` of the loop, s.
    pub(super) fn new(period: f64) -> Self {
        // A loop that skips missed ticks makes at most one tick per period, plus one at each end of
        // the window.
        let room = (WINDOW / period).ceil() as usize + 2;
        Self { ticks: vec![WindowTick::default(); room], oldest: 0, count: 0, late: 0, now: 0.0 }
    }

    /// Records the start of a tick, `elapsed` seconds after the previous tick.
    pub(super) fn begin(&mut self, elapsed: f64) {
        self.now += elapsed;
        while self.count > 0 && (self.count == self.ticks.len() || self.ticks[self.oldest].at < self.now - WINDOW) {
            self.late -= usize::from(self.ticks[self.oldest].late);
            self.oldest = (self.oldest + 1) % self.ticks.len();
            self.count -= 1;
        }
        let newest = (self.oldest + self.count) % self.ticks.len();
        self.ticks[newest] = WindowTick { at: self.now, late: false };
        self.count += 1;
    }

    /// Marks the current tick as late.
    pub(super) fn is_late(&mut self) {
        if self.count > 0 {
            let newest = (self.oldest + self.count - 1) % self.ticks.len();
            self.late += usize::from(!self.ticks[newest].late);
            self.ticks[newest].late = true;
        }
    }

    /// Returns true while too many ticks are late.
    pub(super) fn is_lost(&self) -> bool {
        self.now >= WINDOW && self.late >= LEAST && self.late as f64 > SHARE * self.count as f64
    }

    /// Empties the window after a pause.
    pub(super) fn clear(&mut self) {
        (self.oldest, self.count, self.late, self.now) = (0, 0, 0, 0.0);
    }
}
