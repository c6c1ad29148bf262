//! Reduces the number of patches by ruin and recreate: dissolves a few neighbouring patches and
//! grows their facets again in another order \[G. Schrimpf et al., Record breaking optimization
//! results using the ruin and recreate principle, 2000\].
//!
//! Greedy growth never revises a decision. Two patches may stay separate only because an earlier
//! patch took a facet that both need.
//!
//! 1. *Ruin.* In each round, take each small patch, the smallest first, and dissolve it together
//!    with a few random neighbours.
//! 2. *Recreate.* Grow patches over the free facets from seeds in random order. In half of the
//!    trials, first offer most of the free facets to the surrounding patches. In half of the
//!    trials, add jitter to the ranking of candidates. A facet that shares only a vertex with the
//!    patch may join too. The patch is then still connected, and its hull must pass the same tests.
//! 3. *Judge.* Keep a trial that gives fewer patches. Keep a trial with an equal number if the
//!    sum of the squared patch sizes has not decreased: small patches next to large ones are easier
//!    to dissolve later. Undo any other trial.
//!
//! The work ends after a number of tried facets instead of after a time. The seed of the random
//! numbers is constant. Therefore the same model always gives the same pieces.

use super::growth::Growth;
use super::touching::{Neighbours, Touching};
use super::{Partition, accepts, receivers};
use crate::algebra::Random;
use crate::algebra::tolerance::{
    REGROWN_CENTRE, REGROWN_MEMBER, REGROWN_PATCHES, REGROWTH_JITTER, REGROWTH_KEPT_BACK, REGROWTH_MOST,
    REGROWTH_PER_FACET, REGROWTH_SEED,
};
use crate::body::decompose::facet::NONE;
use crate::body::decompose::grow::Grower;

/// Reduces the number of patches of a partition. Calls `progress` with the finished fraction.
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

/// Returns patch `centre` with a few random patches around it.
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

/// A trial: a set of dissolved patches, with the data to undo it.
struct Trial {
    /// The dissolved patches.
    region: Vec<u32>,
    /// For each changed patch, its facets before the change. The changed patches are the patches of
    /// the region, and the patches that took facets of the region.
    before: Vec<(u32, Vec<u32>)>,
    /// The facets of the dissolved patches.
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

    /// Offers most of the free facets to the surrounding patches.
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
            let mut around = receivers(partition, neighbours, NONE, f).into_iter();
            if let Some(receiver) = around.find(|&other| accepts(grower, partition, other, f)) {
                if self.before.iter().all(|(k, _)| *k != receiver) {
                    self.before.push((receiver, partition.patches[receiver as usize].facets.clone()));
                }
                partition.give(f, receiver);
            }
        }
    }

    /// Grows patches over the free facets and returns their number; `None` if it would exceed the
    /// number of dissolved patches.
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

    /// Returns true if the sum of the squared sizes of the changed patches has decreased.
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
