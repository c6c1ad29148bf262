//! The wake values of all sleeping pairs, which decide when each is measured again; searched block
//! by block.
//!
//! A pair's wake value is the motion bound's sum up to which it may sleep. The board keeps one
//! value for each place and the least value of each block of places. A tick reads one number for
//! each block and opens only the blocks in which a pair is due. Setting and clearing a value touch
//! two numbers, so that pairs come and go at no cost.
//!
//! A heap would return the due pairs in order, which is not needed, and would have to be updated
//! along a path for each of them. A wheel of buckets moves many entries at once when it turns over,
//! which a loop at 1 kHz feels.

/// Number of places in a block. With larger blocks, more values are read for each pair that is due;
/// with smaller ones, a tick reads more least values.
pub(super) const BLOCK: usize = 8;

/// Never due.
pub(super) const NEVER: u64 = u64::MAX;

/// Wake values by place.
#[derive(Clone, Debug)]
pub(super) struct WakeBoard {
    values: Vec<u64>,
    /// At most the least value of each block.
    least: Vec<u64>,
}

impl WakeBoard {
    /// A board of `places` places that are never due.
    pub(super) fn new(places: usize) -> Self {
        let blocks = places.div_ceil(BLOCK);
        Self { values: vec![NEVER; blocks * BLOCK], least: vec![NEVER; blocks] }
    }

    /// Makes the first `places` places never due.
    pub(super) fn clear(&mut self, places: usize) {
        let blocks = places.div_ceil(BLOCK);
        self.values[..blocks * BLOCK].fill(NEVER);
        self.least[..blocks].fill(NEVER);
    }

    /// The wake value of a place.
    #[inline]
    pub(super) fn get(&self, place: u32) -> u64 {
        self.values[place as usize]
    }

    /// Returns true if the place's block is opened when the place is due.
    pub(super) fn is_known(&self, place: u32) -> bool {
        self.least[place as usize / BLOCK] <= self.get(place)
    }

    /// Sets the wake value of a place; with [`NEVER`] it is never due.
    #[inline]
    pub(super) fn set(&mut self, place: u32, value: u64) {
        self.values[place as usize] = value;
        let least = &mut self.least[place as usize / BLOCK];
        *least = (*least).min(value);
    }

    /// Collects places whose values are less than `sum`, from block `from` up to block `to`, in
    /// order, while `due` has room for a whole block. Leaves out blocks for which `is_wanted` is
    /// false. Returns how many places were written to `due`, and the block at which the search goes
    /// on. Corrects the least value of each block in which it finds none.
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

    /// Corrects a block's least value after its places were set.
    pub(super) fn settle(&mut self, block: usize) {
        let begin = block * BLOCK;
        self.least[block] = self.values[begin..begin + BLOCK].iter().copied().fold(NEVER, u64::min);
    }

    /// Returns how many values in the first `blocks` blocks are less than `sum`.
    pub(super) fn count_below(&self, blocks: usize, sum: u64) -> u32 {
        self.values[..blocks * BLOCK].iter().map(|&value| u32::from(value < sum)).sum()
    }

    /// At most the least value in the first `blocks` blocks.
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
    fn exactly_the_values_below_the_sum_are_found() {
        let mut random = Random::new(SEED);
        let places = 5 * BLOCK - 3;
        let mut board = WakeBoard::new(places);
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
            let expected = board.least(places.div_ceil(BLOCK)) >= round && model.iter().all(|&value| value >= round);
            assert!(expected, "seed {SEED:#x}, round {round}: {found:?}");
        }
        board.clear(places);
        assert_eq!(board.least(places.div_ceil(BLOCK)), NEVER);
    }
}
