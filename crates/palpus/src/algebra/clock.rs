//! A clock that the caller provides. The engine has no clock of its own.

/// Counts nanoseconds since any fixed instant. The engine uses only differences between two
/// readings, and only to report the time of each stage of a tick.
pub trait Clock {
    /// Returns the time since the fixed instant (ns). The value must not decrease.
    fn now_ns(&self) -> u64;
}

/// A clock that always returns the same time. The reported time of every stage is then zero.
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
