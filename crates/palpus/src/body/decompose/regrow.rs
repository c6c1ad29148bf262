//! Ruin and recreate: a few neighbouring patches are dissolved and their facets grown again in
//! another order \[G. Schrimpf et al., Record breaking optimization results using the ruin and
//! recreate principle, 2000\].
//!
//! Greedy growth never revises a choice: two later patches may fail to become one because an
//! earlier patch took a facet that they need.
//!
//! 1. *Ruin.* Round after round, each small patch, the smallest first, is dissolved with a few
//!    random neighbours.
//! 2. *Recreate.* In every other trial the patches around are first asked to take some of the free
//!    facets. The rest is grown from seeds in random order, in every other trial with a jittered
//!    ranking too. Here facets that share only a vertex may join: such a patch is connected, and
//!    its hull passes the same tests.
//! 3. *Judge.* A trial with fewer patches is kept. A trial with as many is kept if the sum of the
//!    squared patch sizes has not shrunk: a later trial can dissolve a small patch beside a large
//!    one. Any other trial is undone.
//!
//! The work is bounded by the number of facets tried, never by a clock, and the random numbers
//! start from a constant: the same model gives the same pieces.

use super::growth::Growth;
use super::touching::{Neighbours, Touching};
use super::{Partition, find_heir};
use crate::algebra::Random;
use crate::algebra::tolerance::{
    REGROWN_CENTRE, REGROWN_MEMBER, REGROWN_PATCHES, REGROWTH_JITTER, REGROWTH_KEPT_BACK, REGROWTH_MOST,
    REGROWTH_PER_FACET, REGROWTH_SEED,
};
use crate::body::decompose::facet::NONE;
use crate::body::decompose::grow::Grower;

/// Reduces the number of patches of a partition; `progress` gets the fraction done.
pub(super) fn improve(
    grower: &mut Grower<'_>,
    growth: &mut Growth,
    partition: &mut Partition,
    progress: &mut dyn FnMut(f64),
) {
    let facets = grower.facets();
    let touching = Touching::new(facets);
    let neighbours = Neighbours::Vertices(facets, &touching);
    let budget = (REGROWTH_PER_FACET * facets.len()).min(REGROWTH_MOST);
    let first = grower.tries();
    let mut random = Random::new(REGROWTH_SEED);
    loop {
        let before = grower.tries();
        for centre in small_patches(partition) {
            let spent = grower.tries() - first;
            if spent >= budget {
                return;
            }
            // An earlier trial of this round may have changed the patch.
            if is_size(partition, centre, REGROWN_CENTRE) {
                let region = ruin_region(neighbours, partition, centre, &mut random);
                if region.len() > 1 {
                    Trial::begin(partition, region).run(grower, growth, partition, neighbours, &mut random);
                }
                progress(spent as f64 / budget as f64);
            }
        }
        if grower.tries() == before {
            return;
        }
    }
}

fn is_size(partition: &Partition, k: u32, most: usize) -> bool {
    (1..=most).contains(&partition.patches[k as usize].facets.len())
}

fn small_patches(partition: &Partition) -> Vec<u32> {
    let all = 0..partition.patches.len() as u32;
    let mut small: Vec<u32> = all.filter(|&k| is_size(partition, k, REGROWN_CENTRE)).collect();
    small.sort_by_key(|&k| partition.patches[k as usize].facets.len());
    small
}

/// A patch, and a few of its neighbours and of their neighbours.
fn ruin_region(neighbours: Neighbours<'_>, partition: &Partition, centre: u32, random: &mut Random) -> Vec<u32> {
    let most = 2 + random.below(REGROWN_PATCHES - 1);
    let mut region = vec![centre];
    let mut near = Vec::new();
    while region.len() < most {
        near.clear();
        for &f in &partition.patches[region[random.below(region.len())] as usize].facets {
            neighbours.of(f, |g| {
                let k = partition.owner[g as usize];
                if !region.contains(&k) && is_size(partition, k, REGROWN_MEMBER) {
                    near.push(k);
                }
            });
        }
        if near.is_empty() {
            break;
        }
        region.push(near[random.below(near.len())]);
    }
    region
}

/// A set of dissolved patches, with the data to undo the trial.
struct Trial {
    /// The dissolved patches.
    region: Vec<u32>,
    /// The earlier facets of each changed patch: the patches of the region, and the patches that
    /// took some of its facets.
    before: Vec<(u32, Vec<u32>)>,
    free: Vec<u32>,
}

impl Trial {
    fn begin(partition: &mut Partition, region: Vec<u32>) -> Self {
        let mut take = |k: u32| (k, std::mem::take(&mut partition.patches[k as usize].facets));
        let before: Vec<_> = region.iter().map(|&k| take(k)).collect();
        let free: Vec<u32> = before.iter().flat_map(|(_, facets)| facets.iter().copied()).collect();
        for &f in &free {
            partition.owner[f as usize] = NONE;
        }
        Self { region, before, free }
    }

    fn run(
        mut self,
        grower: &mut Grower<'_>,
        growth: &mut Growth,
        partition: &mut Partition,
        neighbours: Neighbours<'_>,
        random: &mut Random,
    ) {
        random.shuffle(&mut self.free);
        if random.below(2) == 0 {
            self.offer(grower, partition, neighbours, random);
        }
        let jitter = if random.below(2) == 0 { 0.0 } else { REGROWTH_JITTER };
        let count = self.recreate(grower, growth, partition, neighbours, &mut || jitter * random.unit());
        let better = count.is_some_and(|count| count < self.region.len() || !self.has_shrunk(partition));
        if !better {
            self.undo(partition);
        }
    }

    /// Offers most of the free facets to the patches around the region.
    fn offer(
        &mut self,
        grower: &mut Grower<'_>,
        partition: &mut Partition,
        neighbours: Neighbours<'_>,
        random: &mut Random,
    ) {
        for &f in &self.free {
            if random.unit() < REGROWTH_KEPT_BACK {
                continue;
            }
            if let Some(heir) = find_heir(grower, partition, neighbours, NONE, f) {
                if self.before.iter().all(|(k, _)| *k != heir) {
                    self.before.push((heir, partition.patches[heir as usize].facets.clone()));
                }
                partition.give(f, heir);
            }
        }
    }

    /// Grows patches over the free facets and returns their number; `None` if that would be more
    /// than the region had.
    fn recreate(
        &self,
        grower: &mut Grower<'_>,
        growth: &mut Growth,
        partition: &mut Partition,
        neighbours: Neighbours<'_>,
        jitter: &mut dyn FnMut() -> f64,
    ) -> Option<usize> {
        let mut count = 0;
        for &seed in &self.free {
            if partition.owner[seed as usize] == NONE {
                let k = *self.region.get(count)?;
                growth.grow(grower, neighbours, seed, &partition.owner, |_| jitter());
                for &f in grower.members() {
                    partition.give(f, k);
                }
                count += 1;
            }
        }
        Some(count)
    }

    fn has_shrunk(&self, partition: &Partition) -> bool {
        let square = |facets: &[u32]| facets.len() * facets.len();
        let then: usize = self.before.iter().map(|(_, facets)| square(facets)).sum();
        let now: usize = self.before.iter().map(|(k, _)| square(&partition.patches[*k as usize].facets)).sum();
        now < then
    }

    fn undo(self, partition: &mut Partition) {
        for (k, facets) in self.before {
            for &f in &facets {
                partition.owner[f as usize] = k;
            }
            partition.patches[k as usize].facets = facets;
        }
    }
}
