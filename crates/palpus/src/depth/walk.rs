//! The walk over hub pairs \[K02 §3.3.3\].
//!
//! 1. Find the corner with the smallest offset in the overlap at the first hub.
//! 2. Test each hub of the facet at this corner once. Move to the lowest corner that is below the
//!    current one.
//! 3. Stop if there is no lower corner. Offsets decrease strictly, so the walk ends. The number of
//!    moves is also limited.
//!
//! Deviations from \[K02\]: The overlay lies on the sphere. From a facet of many corners (flush
//! faces), the walk tests only the side beyond which the origin lies, not every corner. This finds
//! a lower facet whenever a neighbouring one exists.

use super::HubPair;
use super::antipodal::Facet;
use super::cso::Cso;
use super::gauss_map::GaussMaps;
use super::overlay::{Corner, lowest_corner};
use super::seed::Start;
use crate::algebra::tolerance::{FACET_HUBS, FLUSH_FACET, OFFSET_SLACK, WALK_DECREASE, WALK_STEPS};
use crate::collision::StopReason;

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walked {
    pub(super) corner: Corner,
    /// True if it is known that only the antipodal features lie in the facet's plane.
    pub(super) alone: bool,
    pub(super) steps: u32,
    pub(super) stop: StopReason,
}

/// Working memory of the walk. It keeps its content within one query only.
#[derive(Clone, Debug)]
pub(super) struct Trail {
    pub(super) maps_a: GaussMaps,
    pub(super) maps_b: GaussMaps,
    visited: Visited,
}

impl Trail {
    pub(super) fn new() -> Self {
        Self { maps_a: GaussMaps::new(), maps_b: GaussMaps::new(), visited: Visited::new() }
    }

    /// Clears everything that belongs to the bodies of the previous query.
    pub(super) fn clear(&mut self) {
        self.maps_a.clear();
        self.maps_b.clear();
        self.visited.clear();
    }

    /// Returns the corner with the smallest offset at `hub`, if that offset is below `bar`.
    pub(super) fn lower_at(&mut self, cso: &Cso<'_>, hub: HubPair, bar: f64) -> Option<Corner> {
        lowest_corner(cso, &mut self.maps_a, &mut self.maps_b, hub, bar)
    }

    /// Walks from a start. `None` if no facet of the CSO was found there; then the hub supports no
    /// direction.
    pub(super) fn walk(&mut self, cso: &Cso<'_>, start: &Start) -> Option<Walked> {
        self.visited.clear();
        self.visited.insert(start.hub);
        let mut here = self.first_corner(cso, start)?;
        let decrease = WALK_DECREASE * cso.size();
        for steps in 0..WALK_STEPS {
            match self.lower_neighbour(cso, &here, here.offset - decrease) {
                Some(lower) => here = lower,
                None => return Some(Walked { corner: here, alone: false, steps, stop: StopReason::Converged }),
            }
        }
        Some(Walked { corner: here, alone: false, steps: WALK_STEPS, stop: StopReason::Budget })
    }

    /// Returns the corner with the smallest offset at the start's hub.
    pub(super) fn first_corner(&mut self, cso: &Cso<'_>, start: &Start) -> Option<Corner> {
        // The overlap contains the start's normal, so it has a corner that is not higher. The
        // offset of the start is therefore a bound that rejects most of the overlap.
        [start.offset + OFFSET_SLACK * cso.size(), f64::INFINITY]
            .into_iter()
            .find_map(|bar| lowest_corner(cso, &mut self.maps_a, &mut self.maps_b, start.hub, bar))
    }

    /// Returns the lowest corner below `bar` around the hubs of the facet of `here`.
    fn lower_neighbour(&mut self, cso: &Cso<'_>, here: &Corner, bar: f64) -> Option<Corner> {
        let mut look = Look { trail: self, cso, bar, found: None };
        let facet = Facet::at(cso, here, FLUSH_FACET);
        if facet.a.count * facet.b.count <= FACET_HUBS {
            for i in 0..facet.a.count {
                (0..facet.b.count).for_each(|j| look.at(HubPair { a: facet.a.corner(i), b: facet.b.corner(j) }));
            }
        } else if let Some(side) = facet.farthest_side(cso) {
            look.at(side.from);
            look.at(side.to);
        }
        look.found
    }
}

/// The search around the hubs of one facet.
struct Look<'l, 'p> {
    trail: &'l mut Trail,
    cso: &'l Cso<'p>,
    bar: f64,
    found: Option<Corner>,
}

impl Look<'_, '_> {
    fn at(&mut self, hub: HubPair) {
        if !self.trail.visited.insert(hub) {
            return;
        }
        let Trail { maps_a, maps_b, .. } = self.trail;
        if let Some(corner) = lowest_corner(self.cso, maps_a, maps_b, hub, self.bar) {
            self.bar = corner.offset;
            self.found = Some(corner);
        }
    }
}

/// The set of hubs that were already tested. If two hubs share a slot, the later one overwrites the
/// earlier. A hub may then be tested twice, which costs time but does not change the result.
#[derive(Clone, Debug)]
struct Visited {
    places: [(HubPair, u32); Self::PLACES],
    round: u32,
}

impl Visited {
    const PLACES: usize = 128;

    fn new() -> Self {
        Self { places: [(HubPair { a: 0, b: 0 }, 0); Self::PLACES], round: 0 }
    }

    fn clear(&mut self) {
        self.round = self.round.wrapping_add(1);
        if self.round == 0 {
            *self = Self::new();
            self.round = 1;
        }
    }

    /// Returns true if the hub is new.
    #[inline]
    fn insert(&mut self, hub: HubPair) -> bool {
        // Fibonacci hashing: the odd multiplier is 2³² over the golden ratio.
        let hash = (hub.a.wrapping_mul(31).wrapping_add(hub.b)).wrapping_mul(0x9E37_79B9);
        let place = &mut self.places[(hash >> 25) as usize];
        let new = *place != (hub, self.round);
        *place = (hub, self.round);
        new
    }
}
