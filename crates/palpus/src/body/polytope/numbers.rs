//! Lists of indices with 16 bits per index, or 32 bits if an index is too large.
//!
//! Nearly all polytopes of a body have fewer than a hundred edges, and the indices take more than
//! half of a polytope's memory. Callers read 32-bit numbers for both widths. All indices of a
//! polytope have the same width.

use std::ops::Range;

use super::Spoke;

/// A list of indices with a fixed length.
#[derive(Clone, Debug)]
pub(super) enum Numbers {
    /// Every index is below 2¹⁶.
    Narrow(Box<[u16]>),
    /// Some index is 2¹⁶ or more.
    Wide(Box<[u32]>),
}

impl Numbers {
    pub(super) fn new(numbers: &[u32]) -> Self {
        let all = numbers.iter().fold(0, |all, number| all | number);
        if u16::try_from(all).is_ok() {
            Self::Narrow(numbers.iter().map(|&number| number as u16).collect())
        } else {
            Self::Wide(numbers.into())
        }
    }

    #[inline]
    pub(super) fn at(&self, k: usize) -> u32 {
        match self {
            Self::Narrow(numbers) => u32::from(numbers[k]),
            Self::Wide(numbers) => numbers[k],
        }
    }

    /// Returns `N` entries, starting at entry `k`.
    #[inline]
    pub(super) fn some<const N: usize>(&self, k: usize) -> [u32; N] {
        match self {
            Self::Narrow(numbers) => {
                let some = &numbers[k..k + N];
                std::array::from_fn(|i| u32::from(some[i]))
            }
            Self::Wide(numbers) => {
                let some = &numbers[k..k + N];
                std::array::from_fn(|i| some[i])
            }
        }
    }

    #[inline]
    pub(super) fn part(&self, range: Range<usize>) -> Part<'_> {
        match self {
            Self::Narrow(numbers) => Part::Narrow(&numbers[range]),
            Self::Wide(numbers) => Part::Wide(&numbers[range]),
        }
    }

    /// Sets entry `k`. `number` must fit the width of the list.
    pub(super) fn set(&mut self, k: usize, number: u32) {
        match self {
            Self::Narrow(numbers) => numbers[k] = number as u16,
            Self::Wide(numbers) => numbers[k] = number,
        }
    }
}

/// A slice of a list.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part<'a> {
    Narrow(&'a [u16]),
    Wide(&'a [u32]),
}

impl Part<'_> {
    #[inline]
    fn len(self) -> usize {
        match self {
            Self::Narrow(numbers) => numbers.len(),
            Self::Wide(numbers) => numbers.len(),
        }
    }
}

/// The vertices or edges around a face.
#[derive(Clone, Copy, Debug)]
pub struct Loop<'a>(pub(super) Part<'a>);

impl<'a> Loop<'a> {
    /// Returns the number of entries.
    #[inline]
    #[allow(clippy::len_without_is_empty, reason = "it is never empty")]
    pub fn len(self) -> usize {
        self.0.len()
    }

    /// Returns entry `k`, which must be less than [`Self::len`].
    #[inline]
    pub fn at(self, k: usize) -> u32 {
        match self.0 {
            Part::Narrow(numbers) => u32::from(numbers[k]),
            Part::Wide(numbers) => numbers[k],
        }
    }

    /// Returns the last entry.
    #[inline]
    pub fn last(self) -> u32 {
        self.at(self.len() - 1)
    }

    /// Returns true if `index` is an entry.
    #[inline]
    pub fn contains(self, index: u32) -> bool {
        self.iter().any(|other| other == index)
    }

    /// Returns the triangle fan over the polygon: one triangle from the first vertex to each
    /// side that does not contain this vertex.
    #[inline]
    pub fn fan(self) -> impl ExactSizeIterator<Item = [u32; 3]> {
        (2..self.len()).map(move |k| [self.at(0), self.at(k - 1), self.at(k)])
    }

    /// Returns an iterator over the entries.
    #[inline]
    pub fn iter(self) -> LoopIter<'a> {
        LoopIter(match self.0 {
            Part::Narrow(numbers) => Numbered::Narrow(numbers.iter()),
            Part::Wide(numbers) => Numbered::Wide(numbers.iter()),
        })
    }

    /// Copies the entries into a vector.
    pub fn to_vec(self) -> Vec<u32> {
        self.iter().collect()
    }
}

impl<'a> IntoIterator for Loop<'a> {
    type Item = u32;
    type IntoIter = LoopIter<'a>;

    #[inline]
    fn into_iter(self) -> LoopIter<'a> {
        self.iter()
    }
}

/// The iterator of [`Loop::iter`].
#[derive(Clone, Debug)]
pub struct LoopIter<'a>(Numbered<'a>);

#[derive(Clone, Debug)]
enum Numbered<'a> {
    Narrow(std::slice::Iter<'a, u16>),
    Wide(std::slice::Iter<'a, u32>),
}

impl Iterator for LoopIter<'_> {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        match &mut self.0 {
            Numbered::Narrow(numbers) => numbers.next().map(|&number| u32::from(number)),
            Numbered::Wide(numbers) => numbers.next().copied(),
        }
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        match &self.0 {
            Numbered::Narrow(numbers) => numbers.size_hint(),
            Numbered::Wide(numbers) => numbers.size_hint(),
        }
    }

    #[inline]
    fn fold<B, F: FnMut(B, u32) -> B>(self, first: B, mut step: F) -> B {
        match self.0 {
            Numbered::Narrow(numbers) => numbers.fold(first, |sum, &number| step(sum, u32::from(number))),
            Numbered::Wide(numbers) => numbers.fold(first, |sum, &number| step(sum, number)),
        }
    }
}

impl ExactSizeIterator for LoopIter<'_> {}

/// Number of list entries per spoke.
pub(super) const SPOKE: usize = 3;

/// The spokes of a vertex, counter-clockwise as seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Ring<'a>(pub(super) Part<'a>);

impl<'a> Ring<'a> {
    /// Returns the number of spokes.
    #[inline]
    #[allow(clippy::len_without_is_empty, reason = "it is never empty")]
    pub fn len(self) -> usize {
        self.0.len() / SPOKE
    }

    /// Returns spoke `k`, which must be less than [`Self::len`].
    #[inline]
    pub fn at(self, k: usize) -> Spoke {
        match self.0 {
            Part::Narrow(numbers) => narrow_spoke(&numbers.as_chunks().0[k]),
            Part::Wide(numbers) => wide_spoke(&numbers.as_chunks().0[k]),
        }
    }

    /// Returns the last spoke.
    #[inline]
    pub fn last(self) -> Spoke {
        self.at(self.len() - 1)
    }

    /// Returns the spokes with the indices in `places`.
    #[inline]
    pub fn part(self, places: Range<usize>) -> Self {
        let numbers = SPOKE * places.start..SPOKE * places.end;
        Self(match self.0 {
            Part::Narrow(spokes) => Part::Narrow(&spokes[numbers]),
            Part::Wide(spokes) => Part::Wide(&spokes[numbers]),
        })
    }

    /// Returns an iterator over the spokes.
    #[inline]
    pub fn iter(self) -> RingIter<'a> {
        RingIter(match self.0 {
            Part::Narrow(numbers) => Spoken::Narrow(numbers.as_chunks().0.iter()),
            Part::Wide(numbers) => Spoken::Wide(numbers.as_chunks().0.iter()),
        })
    }
}

impl<'a> IntoIterator for Ring<'a> {
    type Item = Spoke;
    type IntoIter = RingIter<'a>;

    #[inline]
    fn into_iter(self) -> RingIter<'a> {
        self.iter()
    }
}

#[inline]
fn narrow_spoke(numbers: &[u16; SPOKE]) -> Spoke {
    let [neighbour, edge, left] = numbers.map(u32::from);
    Spoke { neighbour, edge, left }
}

#[inline]
fn wide_spoke(&[neighbour, edge, left]: &[u32; SPOKE]) -> Spoke {
    Spoke { neighbour, edge, left }
}

/// The iterator of [`Ring::iter`].
#[derive(Clone, Debug)]
pub struct RingIter<'a>(Spoken<'a>);

#[derive(Clone, Debug)]
enum Spoken<'a> {
    Narrow(std::slice::Iter<'a, [u16; SPOKE]>),
    Wide(std::slice::Iter<'a, [u32; SPOKE]>),
}

impl Iterator for RingIter<'_> {
    type Item = Spoke;

    #[inline]
    fn next(&mut self) -> Option<Spoke> {
        match &mut self.0 {
            Spoken::Narrow(spokes) => spokes.next().map(narrow_spoke),
            Spoken::Wide(spokes) => spokes.next().map(wide_spoke),
        }
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        match &self.0 {
            Spoken::Narrow(spokes) => spokes.size_hint(),
            Spoken::Wide(spokes) => spokes.size_hint(),
        }
    }

    #[inline]
    fn fold<B, F: FnMut(B, Spoke) -> B>(self, first: B, mut step: F) -> B {
        match self.0 {
            Spoken::Narrow(spokes) => spokes.fold(first, |sum, spoke| step(sum, narrow_spoke(spoke))),
            Spoken::Wide(spokes) => spokes.fold(first, |sum, spoke| step(sum, wide_spoke(spoke))),
        }
    }
}

impl ExactSizeIterator for RingIter<'_> {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_and_wide_lists_give_the_same_values() {
        for largest in [u32::from(u16::MAX), u32::from(u16::MAX) + 1] {
            let list = [7, 0, 3, largest, 5, 9];
            let mut numbers = Numbers::new(&list);
            assert_eq!(matches!(numbers, Numbers::Narrow(_)), largest <= u32::from(u16::MAX));
            assert_eq!((numbers.at(3), numbers.some(0)), (largest, list));
            let around = Loop(numbers.part(1..6));
            assert_eq!((around.len(), around.at(2), around.to_vec()), (5, largest, list[1..].to_vec()));
            assert_eq!(around.iter().len(), 5);
            let ring = Ring(numbers.part(0..6));
            let spokes = [Spoke { neighbour: 7, edge: 0, left: 3 }, Spoke { neighbour: largest, edge: 5, left: 9 }];
            assert_eq!((ring.len(), ring.at(1), ring.iter().len()), (2, spokes[1], 2));
            assert!(ring.iter().eq(spokes) && ring.iter().fold(0, |sum, spoke| sum + spoke.edge) == 5);
            numbers.set(3, 1);
            assert_eq!(numbers.at(3), 1);
        }
    }
}
