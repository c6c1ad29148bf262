//! Which of the written wrenches is acting.

use palpus::algebra::Wrench;

/// More ticks of delay than any servo loop has.
pub(crate) const DELAY_MAX: usize = 8;

/// The last written wrenches, and how late they act.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Acting {
    /// The newest first.
    written: [Wrench; DELAY_MAX + 1],
    /// Ticks.
    delay: usize,
}

impl Acting {
    /// For wrenches that act `delay` seconds after they were written, rounded to ticks of `period` seconds, at most
    /// [`DELAY_MAX`].
    pub(crate) fn new(delay: f64, period: f64) -> Self {
        let ticks = (delay / period).round().clamp(0.0, DELAY_MAX as f64);
        Self { written: [Wrench::ZERO; DELAY_MAX + 1], delay: ticks as usize }
    }

    /// Once a tick.
    pub(crate) fn write(&mut self, wrench: &Wrench) {
        self.written.copy_within(0..DELAY_MAX, 1);
        self.written[0] = *wrench;
    }

    /// What acts from the last write to the next.
    pub(crate) fn wrench(&self) -> Wrench {
        self.written[self.delay]
    }

    /// Nothing was written.
    pub(crate) fn forget(&mut self) {
        self.written = [Wrench::ZERO; DELAY_MAX + 1];
    }
}
