//! Contacts of the pairs that a query did not measure, because its quota was spent or because the
//! pairs rest: for some motion, their last results are extrapolated.

use glam::DVec3;

use super::QueryCounters;
use super::found::Found;
use super::part::PartSearch;
use super::query_input::QueryInput;
use crate::algebra::tolerance::{
    REPRESENTED_NEARER, REST_ERROR, REST_FIRST, REST_GROWTH, REST_SAFETY, REST_TRAVEL, SAMPLE_TRAVEL,
};
use crate::body::FeaturePair;
use crate::collision::{Closest, LeafPair, Proximity, Represented, WarmStart, support_gap};
use crate::depth::admissible_bound;

impl PartSearch {
    /// Extrapolates the contacts of the leaf pairs from index `first` on, because the quota is
    /// spent.
    #[cold]
    pub(super) fn hold_the_rest(
        &mut self,
        input: &QueryInput<'_>,
        leaves: &[LeafPair],
        first: usize,
        counters: &mut QueryCounters,
    ) {
        // Pairs whose wake time has come are first in the list and not part of the rotation. The
        // next query continues the rotation where this quota ended.
        let mut resumed = false;
        for (k, leaf) in leaves.iter().enumerate().skip(first) {
            let left = leaves.len() - k - 1;
            counters.traversal.postponed += 1;
            let Some(place) = leaf.place else {
                self.answer_unheld(input, leaf, left, counters);
                continue;
            };
            match self.hold(input, place, [leaf.piece_a, leaf.piece_b], left) {
                Some(held) => counters.held += held,
                None => self.answer_unheld(input, leaf, left, counters),
            }
            if !resumed {
                self.resume = Some(place);
                resumed = true;
            }
        }
    }

    /// Extrapolates the contacts of the pairs that were not marched. Pairs at rest whose contacts
    /// press harder than nearly all others are measured in the next query.
    pub(super) fn hold_unvisited(&mut self, input: &QueryInput<'_>, counters: &mut QueryCounters) {
        let [late, all] = self.front.unvisited();
        // Without work for more measurements, rests must not end early.
        let is_in_time = late == 0 && self.front.still_due() == 0;
        for k in 0..all {
            let (place, pieces) = self.front.unvisited_pair(k);
            let known = self.contacts.len();
            match self.hold(input, place, pieces, 0) {
                Some(held) if k < late => counters.held += held,
                Some(_) => {
                    let range = input.range();
                    let mut held = self.contacts[known..].iter();
                    if is_in_time && held.any(|contact| self.sample.is_outlier(contact, &range)) {
                        self.front.end_rest(place, pieces);
                    }
                }
                None => {
                    debug_assert!(k < late, "a resting pair has stored contacts");
                    counters.unseen += 1;
                    self.unseen_separation = f64::NEG_INFINITY;
                }
            }
        }
        if let Some(place) = self.resume.take() {
            self.front.resume_at(place);
        }
    }

    /// Adds a pair's extrapolated contacts of the last tick. Leaves room for one contact of each of
    /// the `left` remaining pairs. Returns the number of added contacts; `None` if the pair is not
    /// stored.
    fn hold(&mut self, input: &QueryInput<'_>, place: u32, pieces: [u32; 2], left: usize) -> Option<u32> {
        let most = self.capacity - left;
        let held = self.held.carry(place, pieces, input, most, &mut self.contacts);
        self.touching += u32::from(held.is_some_and(|held| held > 0));
        held
    }

    /// Sets the motion for which a pair's new result (the contacts from index `known` on) is
    /// extrapolated. `foretold` is the least separation extrapolated from the pair's last result.
    ///
    /// If the extrapolation was accurate, the pair rests longer this time, otherwise shorter.
    pub(super) fn rest(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, known: usize, foretold: Option<f64>) {
        let found = least_separation(self.contacts[known..].iter().map(|contact| contact.separation));
        if found == f64::INFINITY {
            // A contact may begin at any time, except for idle pairs.
            return;
        }
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let most = REST_TRAVEL * piece_a.radius().min(piece_b.radius());
        let length = match (foretold, self.front.motion_since_rest(leaf)) {
            (Some(foretold), Some(moved)) => {
                let error = (found - foretold).abs();
                let allowed = REST_ERROR * (input.tolerance + self.overlap.max(-found));
                let fits = moved * allowed / error.max(f64::MIN_POSITIVE);
                (REST_SAFETY * fits).min(REST_GROWTH * moved)
            }
            _ => REST_FIRST * most,
        };
        self.front.rest(leaf, length.min(most));
    }

    /// Returns the least separation of the pair's contacts of the last tick, extrapolated to this
    /// tick; infinite if the pair had no contacts. `None` if the pair is not stored.
    pub(super) fn foretell(&self, input: &QueryInput<'_>, leaf: &LeafPair) -> Option<f64> {
        let held = self.held.known(leaf.place?, [leaf.piece_a, leaf.piece_b])?;
        Some(least_separation(held.iter().map(|memory| memory.extrapolate(&input.place).separation)))
    }

    /// Moves the leaf pairs of the sample to the start of the list, and returns their number.
    pub(super) fn begin_sampled(&mut self) -> usize {
        if !self.sample.represents() {
            return self.leaves.as_slice().len();
        }
        let sample = &self.sample;
        self.leaves.partition(|leaf| leaf.place.is_none() || sample.weight([leaf.piece_a, leaf.piece_b]) > 0.0)
    }

    /// Returns the bound of a pair outside the sample, and the pair's separation along this bound.
    /// `None` if the pair may press harder than the sample and has to be measured.
    pub(super) fn representation(&mut self, input: &QueryInput<'_>, leaf: &LeafPair) -> Option<(Represented, f64)> {
        let (normal, hub, separation) = match leaf.proximity {
            Proximity::Disjoint(Closest { normal, features, distance, .. }) => {
                (normal, supports(input, leaf, features), distance)
            }
            Proximity::Overlapping(_) if self.front.is_inadmissible(leaf) => {
                return Some((self.unbounded(input, leaf), 0.0));
            }
            Proximity::Overlapping(_) => {
                let [normals_a, normals_b] = input.admissible_normals(leaf);
                let WarmStart { hub, admissible: last, .. } = *self.front.memory(leaf);
                let bound = admissible_bound(&normals_a, &normals_b, &input.place, hub, last)?;
                self.front.remember_admissible(leaf, Some(bound.features));
                (bound.normal, bound.hub, -bound.depth)
            }
        };
        // The normal of closest points may be inadmissible; then it does not bound the depth.
        let nearest = if separation > 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let least = (input.tolerance - self.sample.stands_for(normal, [leaf.piece_a, leaf.piece_b], &input.range()))
            .max(nearest);
        let bound = Represented { normal, hub, least, ..self.unbounded(input, leaf) };
        (separation >= least).then_some((bound, separation))
    }

    /// Marks a measured pair outside the sample as represented if its contact (from index `known`
    /// on) presses no harder than the sample, or if it has no contact. A pair that is apart without
    /// a contact is measured again when it is nearer; in a small sample, it is measured in each
    /// query. Returns true if the pair is represented now.
    pub(super) fn represent_measured(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, known: usize) -> bool {
        let mut bound = self.unbounded(input, leaf);
        let mut separation = 0.0;
        if let Some(contact) = self.contacts.get(known) {
            let least =
                input.tolerance - self.sample.stands_for(contact.normal, [leaf.piece_a, leaf.piece_b], &input.range());
            if contact.separation < least {
                return false;
            }
            separation = contact.separation;
            let hub = supports(input, leaf, contact.features);
            bound = Represented { normal: contact.normal, hub, least, ..bound };
        } else if let Proximity::Disjoint(Closest { normal, features, distance, .. }) = leaf.proximity {
            // A contact may begin at any time, but it presses only if the pieces are near.
            if !self.sample.is_large() {
                return false;
            }
            separation = distance;
            let (hub, least) = (supports(input, leaf, features), REPRESENTED_NEARER * distance);
            bound = Represented { normal, hub, least, ..bound };
        }
        self.contacts.truncate(known);
        self.front.represent(&input.placed(), leaf, &bound, separation);
        true
    }

    /// Returns the representation of a pair without a contact. The pair is measured again after
    /// some motion.
    pub(super) fn unbounded(&self, input: &QueryInput<'_>, leaf: &LeafPair) -> Represented {
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let length = SAMPLE_TRAVEL * piece_a.radius().min(piece_b.radius());
        Represented { normal: DVec3::ZERO, hub: [0; 2], least: f64::NEG_INFINITY, length }
    }

    /// Adds the result of a pair without a stored contact: the contact of its march if the pieces
    /// are apart, otherwise only an upper bound of the depth.
    fn answer_unheld(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, left: usize, counters: &mut QueryCounters) {
        let Proximity::Overlapping(overlap) = leaf.proximity else {
            let known = self.contacts.len();
            let found = self.contact(input, leaf, counters);
            if let Found::Admissible(contact) | Found::NearlyFlush(contact) | Found::BesideValley(contact) = found {
                self.contacts.push(contact);
                self.keep(input, leaf, [known, left], &found, counters);
            }
            return;
        };
        counters.unseen += 1;
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let normal = overlap.direction.normalize_or(DVec3::Z);
        let (gap, _) = support_gap(piece_a, piece_b, &input.place, normal, [0; 2]);
        self.unseen_separation = self.unseen_separation.min(gap);
    }
}

fn least_separation(separations: impl Iterator<Item = f64>) -> f64 {
    separations.fold(f64::INFINITY, f64::min)
}

/// Returns a vertex of each feature. Both support the pieces along the normal of the features.
fn supports(input: &QueryInput<'_>, leaf: &LeafPair, features: FeaturePair) -> [u32; 2] {
    let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
    [features.a.some_vertex(piece_a), features.b.some_vertex(piece_b)]
}
