//! Cached values of pairs of pieces.

/// A table of values for pairs of indices. A pair replaces another pair with the same place, so
/// results must not depend on the values.
#[derive(Clone, Debug)]
pub(crate) struct PairTable<T> {
    places: Box<[([u32; 2], T)]>,
}

impl<T> PairTable<T> {
    /// Allocates `places` places with values that `none` returns.
    pub(crate) fn new(places: usize, none: impl Fn() -> T) -> Self {
        Self { places: (0..places).map(|_| ([u32::MAX; 2], none())).collect() }
    }

    /// Returns the value of a pair. If the place has the value of another pair, `forget` resets
    /// that value first.
    #[inline]
    pub(crate) fn of(&mut self, pair: [u32; 2], forget: impl FnOnce(&mut T)) -> &mut T {
        // Fibonacci hashing: the odd multiplier is 2³² divided by the golden ratio. It spreads
        // neighbouring pieces over all places.
        let hash = pair[0].wrapping_mul(31).wrapping_add(pair[1]).wrapping_mul(0x9E37_79B9);
        let place = ((u64::from(hash) * self.places.len() as u64) >> 32) as usize;
        let (owner, value) = &mut self.places[place];
        if *owner != pair {
            *owner = pair;
            forget(value);
        }
        value
    }

    /// Returns all values.
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.places.iter_mut().map(|(_, value)| value)
    }
}
