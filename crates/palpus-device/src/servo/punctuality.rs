//! Persistent overrun: a loop that is late again and again.
//!
//! A single late tick is held by the slew limit, and a stall by the watchdog. A loop that is late
//! in more than [`SHARE`] of its ticks is neither: it renders with old states, and contacts swing.
//! The judgement covers the last [`WINDOW`]; before that much time has passed there is no
//! judgement.

/// s.
const WINDOW: f64 = 0.25;
/// Share of the ticks in the window.
const SHARE: f64 = 0.1;
/// Number of ticks: one stall delays its own tick and the next.
const LEAST: usize = 3;

/// A tick that was made.
#[derive(Clone, Copy, Debug, Default)]
struct Made {
    /// s of the ticks' own time.
    at: f64,
    late: bool,
}

/// The ticks of the last quarter of a second; see the module's description.
#[derive(Debug)]
pub(super) struct Punctuality {
    /// As a ring.
    ticks: Vec<Made>,
    oldest: usize,
    count: usize,
    late: usize,
    /// s since the first tick.
    now: f64,
}

impl Punctuality {
    /// For a loop whose ticks are `period` seconds apart when it keeps its time.
    pub(super) fn new(period: f64) -> Self {
        // A loop that skips missed ticks makes no more ticks than there are periods, except at the
        // ends.
        let room = (WINDOW / period).ceil() as usize + 2;
        Self { ticks: vec![Made::default(); room], oldest: 0, count: 0, late: 0, now: 0.0 }
    }

    /// A tick begins, `elapsed` seconds after the last one.
    pub(super) fn begin(&mut self, elapsed: f64) {
        self.now += elapsed;
        while self.count > 0 && (self.count == self.ticks.len() || self.ticks[self.oldest].at < self.now - WINDOW) {
            self.late -= usize::from(self.ticks[self.oldest].late);
            self.oldest = (self.oldest + 1) % self.ticks.len();
            self.count -= 1;
        }
        let newest = (self.oldest + self.count) % self.ticks.len();
        self.ticks[newest] = Made { at: self.now, late: false };
        self.count += 1;
    }

    /// The tick under way is late.
    pub(super) fn is_late(&mut self) {
        if self.count > 0 {
            let newest = (self.oldest + self.count - 1) % self.ticks.len();
            self.late += usize::from(!self.ticks[newest].late);
            self.ticks[newest].late = true;
        }
    }

    /// True while too many ticks are late.
    pub(super) fn is_lost(&self) -> bool {
        self.now >= WINDOW && self.late >= LEAST && self.late as f64 > SHARE * self.count as f64
    }

    /// The loop stood still: what was before does not count.
    pub(super) fn forget(&mut self) {
        (self.oldest, self.count, self.late, self.now) = (0, 0, 0, 0.0);
    }
}
