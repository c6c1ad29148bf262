//! Grows one patch from a seed facet over facets that belong to no patch \[EL01\].

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::touching::Neighbours;
use crate::body::decompose::facet::{Facets, NONE};
use crate::body::decompose::grow::{Grower, Verdict};

/// A facet that will be tried. The greatest entry of the heap is tried first.
#[derive(Clone, Copy)]
struct Candidate {
    /// Cosine of the bend angle at the side across which the facet was reached, plus jitter.
    /// Smaller values are tried first.
    rank: f64,
    arrival: u32,
    facet: u32,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.rank.total_cmp(&self.rank).then(other.arrival.cmp(&self.arrival))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// Buffers that successive calls of [`Growth::grow`] share.
pub(super) struct Growth {
    queue: BinaryHeap<Candidate>,
    postponed: Vec<Candidate>,
    /// For each facet, the last growth that visited it.
    seen: Vec<u32>,
    round: u32,
    arrivals: u32,
}

impl Growth {
    pub(super) fn new(facets: &Facets) -> Self {
        Self { queue: BinaryHeap::new(), postponed: Vec::new(), seen: vec![0; facets.len()], round: 0, arrivals: 0 }
    }

    /// Grows a patch in `grower` from `seed` over facets without an owner. Candidates across
    /// sharper sides are tried first. `jitter` returns a number for a facet. This number is added
    /// to the facet's rank.
    pub(super) fn grow(
        &mut self,
        grower: &mut Grower<'_>,
        neighbours: Neighbours<'_>,
        seed: u32,
        owner: &[u32],
        mut jitter: impl FnMut(u32) -> f64,
    ) {
        self.round += 1;
        self.arrivals = 0;
        self.queue.clear();
        self.postponed.clear();
        self.seen[seed as usize] = self.round;
        grower.load(&[seed]);
        self.reach(neighbours, seed, owner, &mut jitter);
        while let Some(candidate) = self.queue.pop() {
            let flat = grower.is_flat();
            match grower.try_add(&[candidate.facet]) {
                Verdict::Joined => {
                    self.reach(neighbours, candidate.facet, owner, &mut jitter);
                    if flat && !grower.is_flat() {
                        self.queue.extend(self.postponed.drain(..));
                    }
                }
                Verdict::Postponed => self.postponed.push(candidate),
                Verdict::Refused => {}
            }
        }
    }

    fn reach(&mut self, neighbours: Neighbours<'_>, from: u32, owner: &[u32], jitter: &mut impl FnMut(u32) -> f64) {
        let facets = neighbours.facets();
        neighbours.of(from, |facet| {
            let f = facet as usize;
            if owner[f] == NONE && self.seen[f] != self.round {
                self.seen[f] = self.round;
                self.arrivals += 1;
                let rank = facets.plane(from).normal.dot(facets.plane(facet).normal) + jitter(facet);
                self.queue.push(Candidate { rank, arrival: self.arrivals, facet });
            }
        });
    }
}
