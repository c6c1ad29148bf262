//! Finds the facets next to a facet: across its sides, or also at its vertices.

use crate::body::decompose::facet::{Bend, Facets};

/// The definition of the neighbours of a facet.
#[derive(Clone, Copy)]
pub(super) enum Neighbours<'a> {
    /// Facets across sides that are not reflex.
    Sides(&'a Facets),
    /// Facets across sides that are not reflex, and facets that share a vertex.
    Vertices(&'a Facets, &'a Touching),
}

impl<'a> Neighbours<'a> {
    pub(super) fn facets(self) -> &'a Facets {
        match self {
            Self::Sides(facets) | Self::Vertices(facets, _) => facets,
        }
    }

    /// Visits the neighbours of facet `f`; neighbours across sides come first. A facet may be
    /// visited twice.
    pub(super) fn of(self, f: u32, mut visit: impl FnMut(u32)) {
        for link in self.facets().links(f).iter().filter(|link| link.bend != Bend::Reflex) {
            visit(link.facet);
        }
        if let Self::Vertices(_, touching) = self {
            touching.of(f).iter().copied().for_each(visit);
        }
    }
}

/// For each facet, the facets that share a vertex with it.
pub(super) struct Touching {
    starts: Vec<u32>,
    facets: Vec<u32>,
}

impl Touching {
    pub(super) fn new(facets: &Facets) -> Self {
        let all = 0..facets.len() as u32;
        let vertices = all.clone().flat_map(|f| facets.corners(f)).max().map_or(0, |&v| v as usize + 1);
        let mut around = vec![Vec::new(); vertices];
        for f in all.clone() {
            for &v in facets.corners(f) {
                around[v as usize].push(f);
            }
        }
        let mut answer = Self { starts: vec![0], facets: Vec::new() };
        let mut near: Vec<u32> = Vec::new();
        for f in all {
            near.clear();
            for &v in facets.corners(f) {
                near.extend(around[v as usize].iter().filter(|&&g| g != f));
            }
            near.sort_unstable();
            near.dedup();
            answer.facets.extend_from_slice(&near);
            answer.starts.push(answer.facets.len() as u32);
        }
        answer
    }

    /// Returns the facets that share a vertex with facet `f`, by ascending index.
    fn of(&self, f: u32) -> &[u32] {
        &self.facets[self.starts[f as usize] as usize..self.starts[f as usize + 1] as usize]
    }
}
