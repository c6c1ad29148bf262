//! The wake values of all pairs. A pair's wake value decides when the pair is measured again.
//!
//! A pair is *due* when the sum of the motion bound exceeds the pair's wake value. Until then it is
//! not measured. The board has one value for each place of the front, and the least value of each
//! block of places. A tick reads one number for each block, and searches only blocks with a due
//! pair. Setting and clearing a value changes only two numbers.
//!
//! A heap would return the due pairs in order, which is not needed, at the cost of an update along
//! a path for each pair. A timer wheel sometimes moves many entries at once, which is too slow for
//! a loop at 1 kHz.

/// Number of places in a block. Larger blocks have more values to read for each due pair. Smaller
/// blocks have more lower bounds to read in each tick.
pub(super) const BLOCK: usize = 8;

/// The wake value of a pair that is never due.
pub(super) const NEVER: u64 = u64::MAX;

/// Wake values by place.
#[derive(Clone, Debug)]
pub(super) struct WakeBoard {
    values: Vec<u64>,
    /// A lower bound of the values of each block.
    least: Vec<u64>,
}

impl WakeBoard {
    /// Returns an empty board with memory for `places` places.
    pub(super) fn new(places: usize) -> Self {
        let blocks = places.div_ceil(BLOCK);
        Self { values: Vec::with_capacity(blocks * BLOCK), least: Vec::with_capacity(blocks) }
    }

    /// Extends the board to `places` places. The new ones are never due.
    pub(super) fn extend_to(&mut self, places: usize) {
        let blocks = places.div_ceil(BLOCK);
        self.values.resize(blocks * BLOCK, NEVER);
        self.least.resize(blocks, NEVER);
    }

    /// Makes the first `places` places never due.
    pub(super) fn clear(&mut self, places: usize) {
        let blocks = places.div_ceil(BLOCK);
        self.values[..blocks * BLOCK].fill(NEVER);
        self.least[..blocks].fill(NEVER);
    }

    /// Returns the wake value of a place.
    #[inline]
    pub(super) fn get(&self, place: u32) -> u64 {
        self.values[place as usize]
    }

    /// Returns true if the block's lower bound includes the value of this place.
    pub(super) fn is_known(&self, place: u32) -> bool {
        self.least[place as usize / BLOCK] <= self.get(place)
    }

    /// Sets the wake value of a place; [`NEVER`] if it is never due.
    #[inline]
    pub(super) fn set(&mut self, place: u32, value: u64) {
        self.values[place as usize] = value;
        let least = &mut self.least[place as usize / BLOCK];
        *least = (*least).min(value);
    }

    /// Writes places whose values are less than `sum` to `due`, in order, from block `from` up to
    /// block `to`, while `due` has room for a whole block. Leaves out blocks for which `is_wanted`
    /// returns false. Returns the number of places, and the block at which the search continues.
    /// If a block has no such place, sets its lower bound to its least value.
    pub(super) fn collect(
        &mut self,
        from: usize,
        to: usize,
        sum: u64,
        is_wanted: impl Fn(usize) -> bool,
        due: &mut [u32],
    ) -> (usize, usize) {
        let (mut count, mut block) = (0, from);
        while count + BLOCK <= due.len() {
            let Some(next) = self.least[block..to].iter().position(|&least| least < sum) else { return (count, to) };
            block += next + 1;
            if !is_wanted(block - 1) {
                continue;
            }
            let (before, begin) = (count, (block - 1) * BLOCK);
            for (k, &value) in self.values[begin..begin + BLOCK].iter().enumerate() {
                due[count] = (begin + k) as u32;
                count += usize::from(value < sum);
            }
            if count == before {
                self.settle(block - 1);
            }
        }
        (count, block)
    }

    /// Sets a block's lower bound to its least value.
    pub(super) fn settle(&mut self, block: usize) {
        let begin = block * BLOCK;
        self.least[block] = self.values[begin..begin + BLOCK].iter().copied().fold(NEVER, u64::min);
    }

    /// Returns how many values in the first `blocks` blocks are less than `sum`. Reads only the
    /// values of blocks that may contain one.
    pub(super) fn count_below(&self, blocks: usize, sum: u64) -> u32 {
        let below = |value: &&u64| **value < sum;
        let (blocks, _) = self.values[..blocks * BLOCK].as_chunks::<BLOCK>();
        let due = self.least.iter().zip(blocks).filter(|(least, _)| below(least));
        due.map(|(_, block)| block.iter().filter(below).count() as u32).sum()
    }

    /// Returns a lower bound of the values that are not below `sum`, in the first `blocks` blocks.
    /// The result is at least `sum`. Reads only the values of blocks that may contain a lower one.
    pub(super) fn least_from(&self, blocks: usize, sum: u64) -> u64 {
        let (blocks, _) = self.values[..blocks * BLOCK].as_chunks::<BLOCK>();
        let least_of = |(&least, block): (&u64, &[u64; BLOCK])| match least < sum {
            true => block.iter().copied().filter(|&value| value >= sum).fold(NEVER, u64::min),
            false => least,
        };
        self.least.iter().zip(blocks).map(least_of).fold(NEVER, u64::min)
    }

    /// Returns a lower bound of the values in the first `blocks` blocks.
    pub(super) fn least(&self, blocks: usize) -> u64 {
        self.least[..blocks].iter().copied().fold(NEVER, u64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::super::oracle::Random;
    use super::*;

    const SEED: u64 = 0x3A4E;

    #[test]
    fn all_values_below_the_sum_are_found() {
        let mut random = Random::new(SEED);
        let places = 5 * BLOCK - 3;
        let mut board = WakeBoard::new(places);
        board.extend_to(places);
        let mut model = vec![NEVER; places];
        for round in 0..400u64 {
            for _ in 0..20 {
                let place = random.below(places);
                let value = if random.below(4) == 0 { NEVER } else { round + random.below(60) as u64 };
                board.set(place as u32, value);
                model[place] = value;
            }
            let (mut found, mut block, blocks) = (Vec::new(), 0, places.div_ceil(BLOCK));
            while block < blocks {
                let mut due = [0; 2 * BLOCK];
                let (count, next) = board.collect(block, blocks, round, |_| true, &mut due);
                found.extend_from_slice(&due[..count]);
                for &place in &due[..count] {
                    assert_eq!(board.get(place), model[place as usize]);
                    board.set(place, NEVER);
                    model[place as usize] = NEVER;
                    board.settle(place as usize / BLOCK);
                }
                block = next;
            }
            let next = model.iter().copied().filter(|&value| value >= round + 30).min().unwrap_or(NEVER);
            let least = board.least_from(blocks, round + 30);
            assert!((round + 30..=next).contains(&least), "seed {SEED:#x}, round {round}");
            (0..blocks).for_each(|block| board.settle(block));
            assert_eq!(board.least_from(blocks, round + 30), next, "seed {SEED:#x}, round {round}");
            let expected = board.least(places.div_ceil(BLOCK)) >= round && model.iter().all(|&value| value >= round);
            assert!(expected, "seed {SEED:#x}, round {round}: {found:?}");
        }
        board.clear(places);
        assert_eq!(board.least(places.div_ceil(BLOCK)), NEVER);
    }
}
