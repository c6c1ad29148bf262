//! A pair of nodes in the tree of node pairs.

/// A pair of nodes in the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) a: u32,
    pub(super) b: u32,
    /// Place of the pair that this is a half of.
    pub(super) parent: u32,
    pub(super) state: State,
    /// True if the pair has memory.
    pub(super) known: bool,
    /// If this is the first half of a pair: the motion bound's sum before which the halves are not
    /// merged.
    pub(super) retry: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// On the cut, apart.
    Waiting,
    /// On the cut, leaves within tolerance.
    Awake,
    /// On the cut, leaves within tolerance whose force other pairs account for; due after some
    /// motion.
    Represented,
    /// Above the cut; the first half's place.
    Split(u32),
    /// On the cut, but in need of a split for which there is no room.
    Unsplit,
}

/// The place of no pair.
pub(super) const NONE: u32 = u32::MAX;

impl Pair {
    pub(super) fn of(a: u32, b: u32, parent: u32) -> Self {
        Self { a, b, parent, state: State::Waiting, known: false, retry: 0 }
    }
}
