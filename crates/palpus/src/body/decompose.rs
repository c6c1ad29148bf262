//! Convex surface decomposition: groups facets into convex pieces \[K02 §3.2, EL01\].
//!
//! A patch is a connected set of facets that all lie on the hull of their union, and that hull
//! stays in the solid.
//!
//! 1. *Crest distance.* A breadth-first search over the dual graph starts at all facets with a
//!    reflex side. It gives each facet its distance to the nearest valley.
//! 2. *Seeds.* The next patch starts at the free facet farthest from any valley; ties by index.
//! 3. *Growth.* From the seed over convex and coplanar sides, as long as the patch accepts (see
//!    `grow`). Each candidate is tried once: a facet that a patch has refused cannot join it later.
//! 4. *Handing out.* A small patch whose facets can all be taken by its neighbours is dissolved.
//! 5. *Ruin and recreate.* Small patches and their neighbours are grown again in other orders (see
//!    `regrow`).
//!
//! Parts of the surface that are convex as a whole are found first (see `whole`), since growth
//! costs the square of a patch's size.
//!
//! Deviations from \[EL01\]'s cresting search. Growth takes the candidate across the *sharpest*
//! side first, not in the order of discovery, because the most bent parts are hardest to place
//! later (armadillo 7304 → 7265 patches, teacup 198 → 193, torus 50). Step 4 is added (armadillo →
//! 7248, teacup → 192, teaspoon 123 → 115). Containment is decided by one test, see `contain`.
//! Tried and left out: choosing always the seed that now yields the largest patch took ten to
//! thirty times as long, for a count within 0.6 % either way on models of 2000 triangles and more
//! (teacup 189).

pub(super) mod contain;
pub(super) mod facet;
pub(super) mod grow;
mod growth;
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
use touching::Neighbours;

use crate::algebra::tolerance::{HANDED_OUT, HEIR_CORNERS};
use facet::{Bend, Facets, NONE};
use grow::{Grower, Verdict};
use whole::convex_parts;

/// A connected set of facets with a good hull.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pub(crate) facets: Vec<u32>,
}

/// Partitions all facets into patches; `progress` gets the fraction done, rising to one.
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
    for most in 1..=HANDED_OUT {
        hand_out(grower, &mut partition, sides, most);
    }
    regrow::improve(grower, &mut growth, &mut partition, &mut |done| {
        progress(GROWTH_SHARE + (1.0 - GROWTH_SHARE) * done);
    });
    progress(1.0);
    partition.patches.retain(|patch| !patch.facets.is_empty());
    partition.patches
}

/// The part of the work that growth is, for the progress report.
const GROWTH_SHARE: f64 = 0.6;

struct Partition {
    owner: Vec<u32>,
    /// A dissolved patch is left without facets.
    patches: Vec<Patch>,
}

impl Partition {
    fn add(&mut self, facets: Vec<u32>) {
        for &f in &facets {
            self.owner[f as usize] = self.patches.len() as u32;
        }
        self.patches.push(Patch { facets });
    }

    fn give(&mut self, f: u32, to: u32) {
        self.owner[f as usize] = to;
        self.patches[to as usize].facets.push(f);
    }
}

/// All facets, those farthest from a reflex side first.
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

/// Dissolves each patch of at most `most` facets if other patches accept all its facets.
fn hand_out(grower: &mut Grower<'_>, partition: &mut Partition, neighbours: Neighbours<'_>, most: usize) {
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
            left.retain(|&f| match find_heir(grower, partition, neighbours, giver, f) {
                Some(heir) => {
                    partition.give(f, heir);
                    given.push((f, heir));
                    false
                }
                None => true,
            });
            if left.is_empty() || left.len() == before {
                break;
            }
        }
        if !left.is_empty() {
            // No patch accepts some of the facets: restore all.
            for (f, heir) in given.into_iter().rev() {
                partition.patches[heir as usize].facets.pop();
                partition.owner[f as usize] = giver;
                left.push(f);
            }
            partition.patches[giver as usize].facets = left;
        }
    }
}

/// A patch next to facet `f`, other than `giver`, that accepts `f`. Very large patches are not
/// asked: they grew first and have already refused `f`.
fn find_heir(
    grower: &mut Grower<'_>,
    partition: &Partition,
    neighbours: Neighbours<'_>,
    giver: u32,
    f: u32,
) -> Option<u32> {
    let mut heirs: Vec<u32> = Vec::new();
    neighbours.of(f, |g| heirs.push(partition.owner[g as usize]));
    heirs.retain(|&k| k != giver && k != NONE);
    heirs.sort_unstable();
    heirs.dedup();
    heirs.into_iter().find(|&heir| {
        let patch = &partition.patches[heir as usize];
        let corners: usize = patch.facets.iter().map(|&f| grower.facets().corners(f).len()).sum();
        if corners > HEIR_CORNERS {
            return false;
        }
        grower.load(&patch.facets);
        grower.try_add(&[f]) == Verdict::Joined
    })
}
