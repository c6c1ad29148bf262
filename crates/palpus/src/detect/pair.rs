//! The result of one pair of pieces: a contact at its closest points, a contact at its depth, or no
//! contact.

use super::apart::contact_apart;
use super::contact::points_about;
use super::found::{Found, at};
use super::part::PartSearch;
use super::query_input::QueryInput;
use super::{Contact, QueryCounters};
use crate::algebra::tolerance::OFFSET_SLACK;
use crate::body::FeaturePair;
use crate::collision::{Closest, LeafPair, Overlap, Proximity, StopReason, WarmStart, support_gap};
use crate::depth::{
    AdmissibleDepth, Antipodal, Certainty, Corner, Depth, HubPair, Seed, Touch, admissible_depth, depth,
    inadmissible_angle, least_admissible_depth,
};

impl PartSearch {
    /// Returns the number of pairs within the tolerance that may touch: all of them, except pairs
    /// of pieces that are apart and whose closest points are not a contact.
    pub(super) fn may_touch(&self, input: &QueryInput<'_>) -> u32 {
        let touches = |leaf: &&LeafPair| match &leaf.proximity {
            Proximity::Disjoint(closest) => {
                !matches!(contact_apart(input, leaf, closest, self.patch_slope), Found::Nothing)
            }
            Proximity::Overlapping(_) => !self.front.is_inadmissible(leaf),
        };
        let leaves = self.leaves.as_slice();
        self.within() - self.front.idle() - (leaves.len() - leaves.iter().filter(touches).count()) as u32
    }

    /// Finds the result of a leaf pair.
    pub(super) fn contact(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, counters: &mut QueryCounters) -> Found {
        let closest = match &leaf.proximity {
            Proximity::Disjoint(closest) => closest,
            Proximity::Overlapping(overlap) => return self.at_depth(input, leaf, overlap, counters),
        };
        // If the pieces overlap in the next tick, the walk starts from this normal.
        let Closest { normal, features, .. } = *closest;
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let hub = [features.a.some_vertex(piece_a), features.b.some_vertex(piece_b)];
        self.front.remember_depth(leaf, normal, hub, features);
        contact_apart(input, leaf, closest, self.patch_slope)
    }

    fn at_depth(
        &mut self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        overlap: &Overlap,
        counters: &mut QueryCounters,
    ) -> Found {
        if self.front.is_inadmissible(leaf) {
            return Found::Inadmissible(None);
        }
        if self.prover.is_none() && self.sample.represents() {
            return self.at_admissible_depth(input, leaf, counters);
        }
        let place = &input.place;
        let memory = Some(*self.front.memory(leaf)).filter(|memory| memory.facet.is_some());
        if let Some(memory) = memory
            && let Some(found) = self.moved_again(input, leaf, &memory, counters)
        {
            return found;
        }
        let walked = self.walk(input, leaf, overlap, memory);
        let has_cached = memory.is_some() || self.front.memory(leaf).inadmissible_until.is_finite();
        // The next walk starts at the end of this walk, even if its normal is not admissible.
        self.front.remember_depth(leaf, walked.normal, [walked.hub.a, walked.hub.b], walked.antipodal.features());
        counters.walks += 1;
        counters.walk_steps += walked.steps;
        counters.walk_stops += u32::from(walked.stop != StopReason::Converged);
        counters.unproven += u32::from(walked.certainty != Certainty::GloballyOptimal);
        let [normals_a, normals_b] = input.admissible_normals(leaf);
        let (admissible, walk) = (&mut self.admissible, &mut self.scratch);
        let last = memory.and_then(|memory| memory.admissible);
        let real = admissible_depth(&normals_a, &normals_b, place, &walked, last, admissible, walk);
        let moved_to = real.filter(|real| real.moved).map(|real| real.features);
        if moved_to != last {
            self.front.remember_admissible(leaf, moved_to);
        }
        let Some(real) = real else {
            // The angle costs about as much as the walk that it saves, so it is not computed for a
            // pair without cached data.
            if has_cached {
                let angle = inadmissible_angle(&normals_a, &normals_b, place);
                if angle > 0.0 {
                    self.front.remember_inadmissible(leaf, angle);
                }
            }
            let Depth { point_a, point_b, normal, depth, antipodal, .. } = walked;
            let contact = at(leaf, antipodal.features(), [point_a, point_b], normal, -depth);
            return Found::Inadmissible(Some(contact).filter(|contact| contact.separation < 0.0));
        };
        if real.moved {
            return moved(leaf, &real, counters);
        }
        Found::Admissible(at(leaf, real.features, [real.point_a, real.point_b], real.normal, -real.depth))
    }

    /// Finds the contact of an overlap whose last depth was moved to an admissible normal, without
    /// a walk. The depth along any normal is an upper bound of the least depth. So if the depth
    /// along the normal of the last walk is smaller than the depth along all admissible normals,
    /// the walk would end on a normal that is not admissible. `None` if it is not smaller. `memory`
    /// is of the last query.
    fn moved_again(
        &mut self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        memory: &WarmStart,
        counters: &mut QueryCounters,
    ) -> Option<Found> {
        if self.prover.is_some() || memory.admissible.is_none() {
            return None;
        }
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let (gap, hub) = support_gap(piece_a, piece_b, &input.place, memory.normal, memory.hub);
        let real = self.least_admissible(input, leaf, hub, memory.admissible)?;
        let slack = OFFSET_SLACK * (piece_a.radius() + piece_b.radius());
        if -gap >= real.depth - slack {
            return None;
        }
        self.front.remember_admissible(leaf, Some(real.features));
        counters.skipped_walks += 1;
        Some(moved(leaf, &real, counters))
    }

    /// Returns the least depth along the admissible normals. The search starts at the vertices
    /// `hub`; `last` has the features of the last result.
    fn least_admissible(
        &mut self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        [a, b]: [u32; 2],
        last: Option<FeaturePair>,
    ) -> Option<AdmissibleDepth> {
        let [normals_a, normals_b] = input.admissible_normals(leaf);
        let (admissible, walk) = (&mut self.admissible, &mut self.scratch);
        least_admissible_depth(&normals_a, &normals_b, &input.place, HubPair { a, b }, last, admissible, walk)
    }

    /// Finds the contact of an overlap along the least admissible normal, without a walk. Where
    /// surfaces fit closely, the walk mostly ends on a normal that is not admissible. There, a
    /// piece of one surface also overlaps, a little and at its sides, the pieces beside its
    /// counterpart.
    fn at_admissible_depth(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, counters: &mut QueryCounters) -> Found {
        let WarmStart { hub, admissible: last, .. } = *self.front.memory(leaf);
        let real = self.least_admissible(input, leaf, hub, last);
        self.front.remember_admissible(leaf, real.map(|real| real.features));
        real.map_or(Found::Inadmissible(None), |real| moved(leaf, &real, counters))
    }

    /// Computes the depth by a walk, with a proof if the settings request proofs.
    fn walk(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, overlap: &Overlap, memory: Option<WarmStart>) -> Depth {
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let witness = Seed::Witness { direction: overlap.direction };
        let seeds = match memory {
            Some(WarmStart { hub: [a, b], normal, facet, .. }) => {
                let antipodal = facet.and_then(Antipodal::of);
                [Seed::Previous { antipodal, hub: HubPair { a, b }, normal }, witness]
            }
            None => [witness, Seed::CentroidLine],
        };
        match &mut self.prover {
            Some(prover) => prover.depth(piece_a, piece_b, &input.place, leaf, &seeds, &mut self.scratch),
            None => depth(piece_a, piece_b, &input.place, &seeds, &mut self.scratch),
        }
    }

    /// Adds the other corners of a leaf pair's new contact, which is at index `known`. Stores all
    /// these contacts for ticks in which the quota is spent. Leaves room for one contact of each of
    /// the `left` remaining leaf pairs, so that corners of one pair do not displace another pair's
    /// contact. A contact of nearly flush pieces needs a patch. `found` is
    /// the result of the pair.
    pub(super) fn keep(
        &mut self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        [known, left]: [usize; 2],
        found: &Found,
        counters: &mut QueryCounters,
    ) {
        debug_assert!(self.contacts.len() + left <= self.capacity);
        if let Some(slope) = self.patch_slope
            && self.rest_share < 1.0
            && let Some(contact) = self.contacts.get(known).copied()
        {
            let room = self.capacity - known - left;
            // Many contacts together describe the surface as well as the corners of each contact
            // would.
            let has_patch = self.spread(input, &contact, slope * (1.0 - self.rest_share), room, counters);
            if matches!(found, Found::NearlyFlush(_)) && !has_patch {
                self.contacts.truncate(known);
            }
        }
        if let Some(place) = leaf.place {
            let (pieces, is_beside) = ([leaf.piece_a, leaf.piece_b], matches!(found, Found::BesideValley(_)));
            self.held.keep(place, pieces, &self.contacts[known..], is_beside, &input.place);
        }
    }
}

impl PartSearch {
    /// Replaces the last contact, `contact`, by the corners of its patch if there are at most
    /// `room` corners. Returns true if the patch has several corners.
    fn spread(
        &mut self,
        input: &QueryInput<'_>,
        contact: &Contact,
        slope: f64,
        room: usize,
        counters: &mut QueryCounters,
    ) -> bool {
        let Contact { features, point_a, point_b, normal, .. } = *contact;
        let (piece_a, piece_b) = input.pieces(contact.piece_a, contact.piece_b);
        let touch = Touch { features, point_a, point_b, normal };
        let (a, b) = (input.a.admissible(), input.b.admissible());
        let borders = [a.border_of(contact.piece_a), b.border_of(contact.piece_b)];
        let slope = self.patch.find([piece_a, piece_b], &borders, &input.place, &touch, slope, input.tolerance);
        counters.patches += 1;
        let corners = self.patch.corners();
        if corners.len() > room {
            return true;
        }
        self.contacts.pop();
        self.contacts.extend(corners.iter().map(|corner| {
            let [point_a, point_b] = points_about(corner.midpoint, normal, corner.separation);
            let Corner { features, separation, inside, .. } = *corner;
            Contact { features, point_a, point_b, separation, slope, inside, ..*contact }
        }));
        counters.corners += (corners.len() - 1) as u32;
        corners.len() > 1
    }
}

/// Returns the contact along the least depth among the shared normals of the pieces.
fn moved(leaf: &LeafPair, real: &AdmissibleDepth, counters: &mut QueryCounters) -> Found {
    counters.moved += 1;
    counters.admissible_stops += u32::from(real.stop != StopReason::Converged);
    let contact = at(leaf, real.features, [real.point_a, real.point_b], real.normal, -real.depth);
    let (point_a, point_b) = real.facing;
    Found::Moved(contact, Contact { point_a, point_b, ..contact })
}
