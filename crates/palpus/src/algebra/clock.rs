//! A clock that the caller lends: the engine has none of its own.

/// Nanoseconds since any fixed instant. The engine only takes differences, and only to report where a tick's time went.
pub trait Clock {
    /// Must not decrease.
    fn now_ns(&self) -> u64;
}

/// The clock that stands still: every stage takes no time.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    #[inline]
    fn now_ns(&self) -> u64 {
        0
    }
}

impl<C: Clock + ?Sized> Clock for &C {
    #[inline]
    fn now_ns(&self) -> u64 {
        (**self).now_ns()
    }
}

/// An instant of a lent clock by which to be done, if any.
#[derive(Clone, Copy, Debug)]
pub struct Deadline<C> {
    clock: C,
    until_ns: Option<u64>,
}

impl<C: Clock> Deadline<C> {
    /// There is no hurry; the clock is never read.
    pub fn never(clock: C) -> Self {
        Self { clock, until_ns: None }
    }

    /// The instant `until_ns` of the clock.
    pub fn at(clock: C, until_ns: u64) -> Self {
        Self { clock, until_ns: Some(until_ns) }
    }

    /// The clock's time.
    #[inline]
    pub fn now_ns(&self) -> u64 {
        self.clock.now_ns()
    }

    /// True from that instant on.
    #[inline]
    pub fn passed(&self) -> bool {
        self.until_ns.is_some_and(|until| self.clock.now_ns() >= until)
    }

    /// The instant half way between now and this one.
    pub fn halfway(&self) -> Deadline<&C> {
        let half = |until: u64| {
            let now = self.clock.now_ns();
            now + until.saturating_sub(now) / 2
        };
        Deadline { clock: &self.clock, until_ns: self.until_ns.map(half) }
    }
}
