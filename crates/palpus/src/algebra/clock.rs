//! A clock that the caller provides. The engine has no clock of its own.

/// Nanoseconds since any fixed instant. The engine uses only differences, and only to report the
/// time of each stage of a tick.
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
