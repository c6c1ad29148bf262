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
    /// Place of the first half of this pair, if it is split.
    pub(super) first: u32,
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
        Self { a, b, parent, first: NONE, bound: PointBound::NONE, state: State::Waiting, known: false }
    }
}
