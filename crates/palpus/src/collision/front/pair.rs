//! A pair of nodes in the tree of node pairs.

use super::point_bound::PointBound;

/// A pair of nodes in the tree. All that is read of a pair that is due is in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Pair {
    pub(super) a: u32,
    pub(super) b: u32,
    /// Place of the pair of which this pair is a half.
    pub(super) parent: u32,
    /// Place of the first half of this pair if it is split. Otherwise the bits of the height of b
    /// along the normal of `bound`; not a number if it is unknown.
    first_or_height: u32,
    pub(super) bound: PointBound,
    pub(super) state: State,
    /// True if results of the pair are stored.
    pub(super) known: bool,
}

const _: () = assert!(size_of::<Pair>() == 64);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// The pair is on the cut and apart.
    Waiting,
    /// As [`Self::Waiting`], but the wake value is no bound of the distance, since the pair slides
    /// along the expected path of the bodies.
    Sliding,
    /// The pair is on the cut, and is a pair of leaves within the tolerance.
    Awake,
    /// As [`Self::Awake`], but other pairs account for the pair's force. The pair is due after some
    /// motion.
    Represented,
    /// The pair is above the cut.
    Split,
    /// The pair is on the cut and should be split, but there is no room for its halves.
    Unsplit,
}

/// A value that is not a place.
pub(super) const NONE: u32 = u32::MAX;

impl Pair {
    pub(super) fn of(a: u32, b: u32, parent: u32) -> Self {
        Self { a, b, parent, first_or_height: NONE, bound: PointBound::NONE, state: State::Waiting, known: false }
    }

    /// Place of the first half of this pair, if it is split.
    #[inline]
    pub(super) fn first(&self) -> u32 {
        debug_assert_eq!(self.state, State::Split);
        self.first_or_height
    }

    /// Makes this a split pair.
    pub(super) fn split(&mut self, first: u32) {
        (self.state, self.first_or_height) = (State::Split, first);
    }

    /// Makes this a pair that waits, and was split before.
    pub(super) fn unite(&mut self) {
        (self.state, self.first_or_height) = (State::Waiting, NONE);
    }

    /// The height of b along the normal of the bound, model units: no vertex of b is farther along
    /// the normal. `None` if it is unknown.
    #[inline]
    pub(super) fn height(&self) -> Option<f64> {
        let height = f32::from_bits(self.first_or_height);
        (self.state != State::Split && !height.is_nan()).then(|| f64::from(height))
    }

    /// Sets a bound along another normal.
    pub(super) fn set_bound(&mut self, bound: PointBound) {
        debug_assert_ne!(self.state, State::Split);
        (self.bound, self.first_or_height) = (bound, NONE);
    }

    /// Sets the height of b along the normal of the bound, model units.
    pub(super) fn set_height(&mut self, height: f64) {
        debug_assert_ne!(self.state, State::Split);
        self.first_or_height = (height as f32).next_up().to_bits();
    }
}
