//! Convex surface decomposition: partitions the facets into patches, one for each convex piece
//! \[K02 §3.2, EL01\].
//!
//! A patch is a connected set of facets. All its facets lie on the hull of their union, and this
//! hull stays in the solid.
//!
//! 1. *Crest distance.* Compute the distance of each facet from the nearest facet with a reflex
//!    side, by breadth-first search over neighbouring facets.
//! 2. *Seeds.* The next patch starts at the free facet with the largest crest distance. Ties go to
//!    the smaller index.
//! 3. *Growth.* From the seed, try to add neighbouring facets across convex and coplanar sides (see
//!    `grow`). Each candidate is tried only once: a facet that does not fit the patch does not fit
//!    the patch after further growth either.
//! 4. *Handing out.* Dissolve a small patch if its neighbours can take all its facets.
//! 5. *Ruin and recreate.* Dissolve small patches together with neighbours, and grow them again in
//!    other orders (see `regrow`).
//!
//! Convex connected parts of the surface are found first (see `whole`), because the time to grow a
//! patch is quadratic in its size.
//!
//! Deviations from the cresting search of \[EL01\]:
//!
//! * Growth tries the candidate across the *sharpest* side first, not in the order of discovery.
//!   Facets at sharp sides are the hardest to add to a patch later. The new order reduced the
//!   armadillo from 7304 to 7265 patches and the teacup from 198 to 193; the torus kept its 50
//!   patches.
//! * Step 4 is not in \[EL01\]. This step reduced the armadillo to 7248 patches, the teacup to 192,
//!   and the teaspoon from 123 to 115.
//! * A single test decides whether a hull stays in the solid (see `contain`).
//!
//! Another choice of seeds was tried and rejected: always the seed that gives the largest patch.
//! This choice took ten to thirty times as long. On models of 2000 and more triangles, the
//! number of patches changed by at most 0.6 %, up or down. The teacup had 189 patches.

pub(super) mod contain;
pub(super) mod facet;
pub(super) mod grow;
mod growth;
mod refusals;
mod regrow;
#[cfg(test)]
mod tests;
pub(super) mod thicken;
mod touching;
pub(super) mod trial_hull;
pub(super) mod whole;
pub(super) mod wide_hull;

use std::cmp::Reverse;
use std::collections::VecDeque;

use growth::Growth;
use refusals::Refusals;
use touching::Neighbours;

use crate::algebra::tolerance::{DISSOLVED_FACETS, RECEIVER_CORNERS};
use facet::{Bend, Facets, NONE};
use grow::{Grower, Verdict};
use whole::convex_parts;

/// A connected set of facets whose hull is the shape of one piece.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pub(crate) facets: Vec<u32>,
}

/// Partitions all facets into patches. Calls `progress` with the finished fraction, which rises to
/// 1.
pub(crate) fn decompose(grower: &mut Grower<'_>, progress: &mut dyn FnMut(f64)) -> Vec<Patch> {
    let facets = grower.facets();
    let mut partition = Partition { owner: vec![NONE; facets.len()], patches: Vec::new() };
    let mut growth = Growth::new(facets);
    let sides = Neighbours::Sides(facets);
    let mut done = 0;
    let (surface, tree) = grower.ground();
    for part in convex_parts(&surface, facets, tree) {
        done += part.len();
        partition.add(part);
    }
    for seed in seeds(facets) {
        if partition.owner[seed as usize] != NONE {
            continue;
        }
        growth.grow(grower, sides, seed, &partition.owner, |_| 0.0);
        partition.add(grower.members().to_vec());
        done += grower.members().len();
        progress(GROWTH_SHARE * done as f64 / facets.len() as f64);
    }
    let mut refusals = Refusals::new(facets.len(), partition.patches.len());
    for most in 1..=DISSOLVED_FACETS {
        hand_out(grower, &mut partition, &mut refusals, sides, most);
    }
    regrow::improve(grower, &mut growth, &mut partition, &mut |done| {
        progress(GROWTH_SHARE + (1.0 - GROWTH_SHARE) * done);
    });
    progress(1.0);
    partition.patches.retain(|patch| !patch.facets.is_empty());
    partition.patches
}

/// Fraction of the work that growth takes, for the progress report.
const GROWTH_SHARE: f64 = 0.6;

struct Partition {
    /// The patch of each facet, or [`NONE`].
    owner: Vec<u32>,
    /// All patches. A dissolved patch stays in the list without facets.
    patches: Vec<Patch>,
}

impl Partition {
    fn add(&mut self, facets: Vec<u32>) {
        for &f in &facets {
            self.owner[f as usize] = self.patches.len() as u32;
        }
        self.patches.push(Patch { facets });
    }

    /// Adds facet `f` to patch `to`.
    fn give(&mut self, f: u32, to: u32) {
        self.owner[f as usize] = to;
        self.patches[to as usize].facets.push(f);
    }
}

/// Returns all facets by descending crest distance (step 1).
fn seeds(facets: &Facets) -> Vec<u32> {
    let mut distance = vec![NONE; facets.len()];
    let mut front = VecDeque::new();
    for f in 0..facets.len() as u32 {
        if facets.links(f).iter().any(|link| link.bend == Bend::Reflex) {
            distance[f as usize] = 0;
            front.push_back(f);
        }
    }
    while let Some(f) = front.pop_front() {
        for link in facets.links(f) {
            if distance[link.facet as usize] == NONE {
                distance[link.facet as usize] = distance[f as usize] + 1;
                front.push_back(link.facet);
            }
        }
    }
    let mut order: Vec<u32> = (0..facets.len() as u32).collect();
    order.sort_by_key(|&f| (Reverse(distance[f as usize]), f));
    order
}

/// Dissolves each patch of at most `most` facets if neighbouring patches accept all its facets.
fn hand_out(
    grower: &mut Grower<'_>,
    partition: &mut Partition,
    refusals: &mut Refusals,
    neighbours: Neighbours<'_>,
    most: usize,
) {
    let small = |patch: &Patch| (1..=most).contains(&patch.facets.len());
    let order: Vec<u32> =
        (0..partition.patches.len() as u32).filter(|&k| small(&partition.patches[k as usize])).collect();
    for giver in order {
        if !small(&partition.patches[giver as usize]) {
            continue;
        }
        let mut left = std::mem::take(&mut partition.patches[giver as usize].facets);
        let mut given = Vec::new();
        loop {
            let before = left.len();
            left.retain(|&f| {
                let mut others = receivers(partition, neighbours, giver, f).into_iter();
                match others.find(|&other| refusals.accepts(grower, partition, other, f)) {
                    Some(receiver) => {
                        partition.give(f, receiver);
                        given.push((f, receiver, refusals.change(receiver)));
                        false
                    }
                    None => true,
                }
            });
            if left.is_empty() || left.len() == before {
                break;
            }
        }
        if !left.is_empty() {
            // No patch accepts the remaining facets, so give all facets back.
            for (f, receiver, version) in given.into_iter().rev() {
                partition.patches[receiver as usize].facets.pop();
                refusals.restore(receiver, version);
                partition.owner[f as usize] = giver;
                left.push(f);
            }
            partition.patches[giver as usize].facets = left;
            refusals.change(giver);
        }
    }
}

/// Returns the patches next to facet `f`, other than `giver`.
fn receivers(partition: &Partition, neighbours: Neighbours<'_>, giver: u32, f: u32) -> Vec<u32> {
    let mut receivers: Vec<u32> = Vec::new();
    neighbours.of(f, |g| receivers.push(partition.owner[g as usize]));
    receivers.retain(|&k| k != giver && k != NONE);
    receivers.sort_unstable();
    receivers.dedup();
    receivers
}

/// Returns true if `receiver` accepts facet `f`. Very large patches do not: they grew first and
/// have already refused `f`.
fn accepts(grower: &mut Grower<'_>, partition: &Partition, receiver: u32, f: u32) -> bool {
    let patch = &partition.patches[receiver as usize];
    let corners: usize = patch.facets.iter().map(|&f| grower.facets().corners(f).len()).sum();
    if corners > RECEIVER_CORNERS {
        return false;
    }
    grower.load(&patch.facets);
    grower.try_add(&[f]) == Verdict::Joined
}
