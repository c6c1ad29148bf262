//! The sample: where surfaces fit closely, a few hundred of the touching pairs stand for all pairs.
//!
//! A nut that is pressed on its thread touches with five thousand pairs of pieces. Contacts that
//! push in the same direction share one stiffness, so their wrench is a mean over contacts
//! ([`crate::force::LoadSharing`]). A mean over an even sample is nearly the same, and costs less.
//!
//! 1. *Rank*: each pair of pieces has a rank, 0 to 1. Pairs with ranks below any limit are spread
//!    evenly over both surfaces and their directions. For this, the leaves of each hierarchy are
//!    sorted by the side to which they face. Neighbours stay together. The rank is the bit-reversed
//!    place of the smaller body's piece in this order, plus the golden ratio times the place of the
//!    other piece, without its integer part. If the rank depended on one piece only, a few pieces
//!    with all their pairs would be the sample.
//! 2. *Share*: a pair belongs to the sample if its rank is below the share. The share follows from
//!    the number of touching pairs. While a contact presses, the share changes slowly, but the
//!    sample never exceeds [`SAMPLE_MOST`] pairs. Up to [`SAMPLE_PAIRS`] pairs, all pairs belong to
//!    the sample.
//! 3. *Weight*: contacts with a rank near the share count less, so that they come and go gradually.
//! 4. *Represented pairs*: any other pair is only bounded. While it presses no harder than the
//!    sampled contacts of its direction, it is not measured ([`crate::collision::Represented`]). If
//!    it presses harder, it is measured. The harder it presses, the more its contacts count, from 0
//!    to 1. So a burr on a thread is felt, and so is a wall that no other pair touches.
//!    Contacts and pairs are compared by their engagement. It is relative to the tolerance, which
//!    follows the motion of the bodies ([`Sample::set_tolerance`]).
//! 5. *Few contacts*: as soon as only a few pairs touch, all of them are measured, while the share
//!    still grows. If the sample has only a few contacts, as in an impact of spinning bodies, they
//!    do not stand for pairs that are nearer than all of them ([`Sample::floor`]).
//! 6. *Outliers*: contacts of pairs at rest are extrapolated, and may have moved past the ends of
//!    their faces. The force follows the hardest contact of each direction, so a contact at rest
//!    that presses harder than nearly all others is measured again ([`Sample::is_outlier`]).

mod loads;
mod ranks;

use glam::DVec3;

use self::loads::Loads;
use self::ranks::Ranks;
use super::Contact;
use crate::algebra::tolerance::{
    FLOOR_RISE, REST_HARDEST, REST_OUTLIER, SAMPLE_EQUAL, SAMPLE_EXCESS, SAMPLE_FADE, SAMPLE_FULL_EXCESS, SAMPLE_LARGE,
    SAMPLE_LEAST, SAMPLE_MOST, SAMPLE_PACE, SAMPLE_PAIRS,
};
use crate::body::Body;

/// Decides which pairs are measured, and how much their contacts count.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    ranks: Ranks,
    /// Pairs with a rank below this belong to the sample. With [`Self::ALL`], all pairs belong to
    /// it and have full weight.
    share: f64,
    /// True if so many pairs touch that pairs outside the sample are only bounded.
    represents: bool,
    floor: Floor,
    /// The engagements in `loads` and `others` are relative to this separation, model units.
    tolerance: f64,
    /// The contacts of the sample, as of the last query. None if few pairs touch.
    loads: Loads,
    /// The contacts of other pairs.
    others: Loads,
}

impl Sample {
    /// The value of `share` at which all pairs belong to the sample with full weight.
    const ALL: f64 = 1.0 / (1.0 - SAMPLE_FADE);

    /// Returns a sample for two bodies. At first, all pairs belong to the sample.
    pub(super) fn new(a: &Body, b: &Body) -> Self {
        Self {
            ranks: Ranks::new(a, b),
            share: Self::ALL,
            represents: false,
            floor: Floor::NONE,
            tolerance: 0.0,
            loads: Loads::new(),
            others: Loads::new(),
        }
    }

    /// Returns a sample of the same bodies that begins with all pairs.
    pub(super) fn another(&self) -> Self {
        let (share, represents, floor) = (Self::ALL, false, Floor::NONE);
        let (loads, others) = (Loads::new(), Loads::new());
        Self { share, represents, floor, loads, others, ranks: self.ranks.clone(), ..*self }
    }

    /// Becomes equal to `other`, a sample of the same bodies.
    pub(super) fn copy(&mut self, other: &Self) {
        (self.share, self.represents, self.floor) = (other.share, other.represents, other.floor);
        self.tolerance = other.tolerance;
        self.loads.copy(&other.loads);
        self.others.copy(&other.others);
    }

    /// Starts again with all pairs in the sample.
    pub(super) fn clear(&mut self) {
        (self.share, self.represents, self.floor) = (Self::ALL, false, Floor::NONE);
        self.loads.clear();
        self.others.clear();
    }

    /// Returns true if some pairs are not in the sample.
    pub(super) fn is_partial(&self) -> bool {
        self.share < Self::ALL
    }

    /// True if pairs that are not in the sample are only bounded. Otherwise they are measured, too.
    pub(super) fn represents(&self) -> bool {
        debug_assert!(self.is_partial() || !self.represents);
        self.represents
    }

    /// Returns the separation (model units) that a represented pair must have at least; infinite if
    /// no pair is represented, and minus infinity if the sample is large enough to stand for any
    /// pair.
    pub(super) fn floor(&self) -> f64 {
        match self.represents() {
            false => f64::INFINITY,
            true if self.is_large() => f64::NEG_INFINITY,
            true => self.floor.separation,
        }
    }

    /// True if the bounds of all represented pairs must be tested, because these pairs may press
    /// harder than any contact that is left: the deepest contacts have ended or become shallower.
    pub(super) fn has_receded(&self) -> bool {
        self.floor.has_risen && !self.is_large()
    }

    /// True if the sample has many contacts. If a few contacts stand for many pairs, as when bodies
    /// hit each other at a corner, other contacts may take over at any time.
    pub(super) fn is_large(&self) -> bool {
        self.loads.count >= SAMPLE_LARGE
    }

    /// True if no contacts are stored with which other pairs can be compared.
    pub(super) fn is_blank(&self) -> bool {
        self.loads.count == 0
    }

    /// Step 2: sets the share for `touching` pairs in contact. The share changes gradually, except
    /// if `at_once`, and except that it never exceeds [`SAMPLE_MOST`] pairs. Up to [`SAMPLE_PAIRS`]
    /// pairs, all pairs are measured at once; only their weights change gradually.
    pub(super) fn set_touching(&mut self, touching: f64, at_once: bool) {
        let share_of = |pairs: f64| Self::ALL * (pairs / touching.max(1.0)).min(1.0);
        let target = share_of(SAMPLE_PAIRS);
        self.represents = touching > SAMPLE_PAIRS;
        self.share = match at_once {
            true => target,
            false => target
                .clamp(self.share * (1.0 - SAMPLE_PACE), self.share * (1.0 + SAMPLE_PACE))
                .min(share_of(SAMPLE_MOST)),
        };
    }

    /// Returns the mean weight of all pairs.
    fn part(&self) -> f64 {
        let full = self.share * (1.0 - SAMPLE_FADE);
        let last = ((self.share - 1.0) / (SAMPLE_FADE * self.share)).max(0.0);
        full + 0.5 * (self.share.min(1.0) - full) * (1.0 + last)
    }

    /// Step 3: returns the weight of the contacts of these pieces, 0 to 1.
    pub(super) fn weight(&self, pieces: [u32; 2]) -> f64 {
        ((self.share - self.ranks.of(pieces)) / (SAMPLE_FADE * self.share)).clamp(0.0, 1.0)
    }

    /// Step 4: returns the largest engagement (model units) along `normal` up to which contacts of
    /// these pieces need not be measured.
    pub(super) fn stands_for(&self, normal: DVec3, pieces: [u32; 2], range: &Range) -> f64 {
        let others = self.others.most(normal, |other| other != pieces);
        let known = self.represented(normal);
        (known + SAMPLE_EXCESS * range.pressing(known)).max(others - SAMPLE_EQUAL * range.pressing(others))
    }

    /// Returns the largest engagement (model units) of the sample along `normal`.
    fn represented(&self, normal: DVec3) -> f64 {
        self.loads.most(normal, |_| true)
    }

    /// Sets the count of the contacts of a pair.
    pub(super) fn weigh(&self, contacts: &mut [Contact], range: &Range) {
        if !self.is_partial() {
            return;
        }
        let part = self.part();
        for contact in contacts {
            let count = self.weight([contact.piece_a, contact.piece_b]) / part;
            contact.count = if count < 1.0 { count.max(self.excess(contact, range)) } else { count };
        }
    }

    /// Sets the floor for the next query. `deepest` is the least separation (model units) of all
    /// contacts of this query.
    pub(super) fn set_floor(&mut self, deepest: f64, range: &Range) {
        self.floor.follow(deepest.min(range.tolerance), range);
        if self.is_large() {
            // If the sample becomes small, all bounds are tested.
            self.floor.lowest = f64::NEG_INFINITY;
        }
    }

    /// Begins a query with another tolerance (model units). The tolerance follows the motion of the
    /// bodies, and engagements are relative to it.
    pub(super) fn set_tolerance(&mut self, tolerance: f64) {
        if tolerance != self.tolerance {
            self.loads.deepen(tolerance - self.tolerance);
            self.others.deepen(tolerance - self.tolerance);
            self.tolerance = tolerance;
        }
    }

    /// Stores the contacts with which other pairs are compared. Stores none if the sample has all
    /// pairs and no pair `rests`.
    pub(super) fn keep(&mut self, contacts: &[Contact], tolerance: f64, rests: bool) {
        self.tolerance = tolerance;
        self.loads.clear();
        self.others.clear();
        if !self.is_partial() && !rests {
            return;
        }
        for contact in contacts.iter().filter(|contact| contact.separation < tolerance) {
            let Contact { normal, piece_a, piece_b, count, separation, .. } = *contact;
            let pieces = [piece_a, piece_b];
            let list = if self.weight(pieces) > 0.0 { &mut self.loads } else { &mut self.others };
            list.push(normal, count.min(1.0) * (tolerance - separation), pieces);
        }
    }

    /// Step 6: returns true if the contact presses clearly harder along its normal than all but a
    /// few contacts of other pairs.
    pub(super) fn is_outlier(&self, contact: &Contact, range: &Range) -> bool {
        let pieces = [contact.piece_a, contact.piece_b];
        let engagement = contact.count.min(1.0) * (range.tolerance - contact.separation);
        // The contact presses harder than this by the share of `REST_OUTLIER`.
        let as_hard = engagement - REST_OUTLIER / (1.0 + REST_OUTLIER) * range.pressing(engagement);
        let count = |loads: &Loads| loads.count_from(as_hard, contact.normal, REST_HARDEST, |other| other != pieces);
        count(&self.loads) + count(&self.others) < REST_HARDEST
    }

    /// Returns by how much the contact presses harder than the sample, 0 to 1.
    fn excess(&self, contact: &Contact, range: &Range) -> f64 {
        let (engagement, known) = (range.tolerance - contact.separation, self.represented(contact.normal));
        let scale = range.pressing(known);
        ((engagement - known - SAMPLE_EXCESS * scale) / (SAMPLE_FULL_EXCESS * scale)).clamp(0.0, 1.0)
    }
}

/// The least separation of all contacts. A represented pair is never nearer.
#[derive(Clone, Copy, Debug)]
struct Floor {
    /// Model units.
    separation: f64,
    /// The least value of `separation` since it last rose clearly.
    lowest: f64,
    /// True if it rose clearly in the last query.
    has_risen: bool,
}

impl Floor {
    const NONE: Self = Self { separation: f64::INFINITY, lowest: f64::INFINITY, has_risen: false };

    fn follow(&mut self, separation: f64, range: &Range) {
        let scale = range.offset.max(range.offset - self.lowest);
        self.separation = separation;
        self.has_risen = separation > self.lowest + FLOOR_RISE * scale || self.lowest == f64::NEG_INFINITY;
        self.lowest = if self.has_risen { separation } else { self.lowest.min(separation) };
    }
}

/// The separations below which contacts are searched, and below which they press, model units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// Contacts are found below this separation.
    pub(super) tolerance: f64,
    /// Contacts press below this separation.
    pub(super) offset: f64,
}

impl Range {
    /// Returns the part of an engagement that presses; at least a small part of the contact offset.
    fn pressing(&self, engagement: f64) -> f64 {
        (engagement - (self.tolerance - self.offset)).max(SAMPLE_LEAST * self.offset).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::BodySettings;
    use crate::body::{Feature, FeaturePair, Mesh, PolygonSoup};

    fn body() -> Body {
        let mut soup = PolygonSoup::new();
        for k in 0..40 {
            let at = DVec3::new(f64::from(k), 0.0, 0.0);
            let corners = [DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5];
            let first = soup.vertices.len() as u32;
            soup.vertices.extend(corners.map(|corner| at + corner));
            for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
                soup.push_face(&face.map(|corner| first + corner));
            }
        }
        let (mesh, _) = Mesh::from_soup(&soup).unwrap();
        Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap()
    }

    #[test]
    fn the_mean_weight_is_what_a_sampled_contact_stands_for() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        for touching in [1.0, SAMPLE_PAIRS, 1.1 * SAMPLE_PAIRS, 2.0 * SAMPLE_PAIRS, 50.0 * SAMPLE_PAIRS] {
            sample.set_touching(touching, true);
            let steps = 100_000;
            let weight = |k: u32| {
                let rank = (f64::from(k) + 0.5) / f64::from(steps);
                ((sample.share - rank) / (SAMPLE_FADE * sample.share)).clamp(0.0, 1.0)
            };
            let mean = (0..steps).map(weight).sum::<f64>() / f64::from(steps);
            assert!((mean - sample.part()).abs() < 1e-3, "{touching}: {mean} and {}", sample.part());
        }
    }

    #[test]
    fn all_pairs_count_fully_until_there_are_many() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        sample.set_touching(SAMPLE_PAIRS, false);
        assert!(!sample.is_partial());
        assert!((0..body.polytopes().len() as u32).all(|piece| sample.weight([piece, 0]) == 1.0));
    }

    #[test]
    fn the_sample_changes_gradually() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        for touching in [1e4, 1.0] {
            sample.set_touching(touching, false);
            assert!(sample.share <= Sample::ALL * (SAMPLE_MOST / touching).min(1.0));
            for _ in 0..400 {
                let before = sample.share;
                sample.set_touching(touching, false);
                assert!((sample.share / before - 1.0).abs() <= 1.01 * SAMPLE_PACE);
            }
        }
        assert!(!sample.is_partial());
    }

    fn contact(separation: f64) -> Contact {
        Contact {
            piece_a: 0,
            piece_b: 0,
            features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
            point_a: DVec3::ZERO,
            point_b: DVec3::ZERO,
            normal: DVec3::Z,
            separation,
            slope: 0.0,
            count: 1.0,
            inside: false,
        }
    }

    /// The deepest contact moves through `path`. Returns whether the sample receded, in each query.
    fn recedes(path: &[f64], contacts: usize) -> Vec<bool> {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        sample.set_touching(1e4, true);
        let range = Range { tolerance: 2.0, offset: 1.0 };
        let has_receded = path.iter().map(|&separation| {
            sample.keep(&vec![contact(separation); contacts], range.tolerance, false);
            sample.set_floor(separation, &range);
            sample.has_receded()
        });
        has_receded.collect()
    }

    #[test]
    fn a_small_sample_recedes_with_its_deepest_contact() {
        let path = [0.5, -1.0, -0.9, -0.6, -0.3, 0.1, 0.05, 1.5];
        assert_eq!(recedes(&path, 1), [false, false, false, false, true, true, false, true]);
        assert_eq!(recedes(&path, SAMPLE_LARGE), [false; 8]);
    }

    #[test]
    fn only_a_large_sample_stands_for_nearer_pairs() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        assert_eq!(sample.floor(), f64::INFINITY);
        sample.set_touching(1e4, true);
        let range = Range { tolerance: 2.0, offset: 1.0 };
        for (count, floor) in [(1, 0.5), (SAMPLE_LARGE, f64::NEG_INFINITY)] {
            sample.keep(&vec![contact(0.5); count], range.tolerance, false);
            sample.set_floor(0.5, &range);
            assert_eq!(sample.floor(), floor);
        }
        sample.set_touching(SAMPLE_PAIRS, false);
        assert!(sample.is_partial());
        assert_eq!(sample.floor(), f64::INFINITY);
    }

    #[test]
    fn sample_stands_for_the_same_separations_at_any_tolerance() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        sample.set_touching(1e4, true);
        sample.keep(&[contact(0.5)], 2.0, false);
        for tolerance in [2.0, 1.6, 1.1, 3.0] {
            sample.set_tolerance(tolerance);
            let least = tolerance - sample.stands_for(DVec3::Z, [1, 1], &Range { tolerance, offset: 1.0 });
            // The contact presses by 0.5. A pair may press a little harder.
            assert!((least - (0.5 - SAMPLE_EXCESS * 0.5)).abs() < 1e-12, "{least} at a tolerance of {tolerance}");
        }
        // A contact beyond the tolerance stands for nothing.
        sample.set_tolerance(0.4);
        let range = Range { tolerance: 0.4, offset: 0.4 };
        assert!(sample.stands_for(DVec3::Z, [1, 1], &range) < 2.0 * SAMPLE_LEAST * range.offset);
    }

    #[test]
    fn contact_at_rest_that_presses_hardest_is_an_outlier() {
        let body = body();
        let mut sample = Sample::new(&body, &body);
        let range = Range { tolerance: 2.0, offset: 1.0 };
        let others = [1, 2].map(|piece_a| Contact { piece_a, ..contact(0.5) });
        // Two others press as hard as the contact, or nearly. What is stored of the contact itself
        // does not matter.
        sample.keep(&[contact(0.0), others[0], others[1]], range.tolerance, true);
        let margin = REST_OUTLIER * 0.5;
        for (separation, normal, is_outlier) in [
            (0.5 - 1.1 * margin, DVec3::Z, true),
            (0.5 - 0.9 * margin, DVec3::Z, false),
            (0.6, DVec3::Z, false),
            (0.6, DVec3::X, true),
        ] {
            let extrapolated = Contact { normal, ..contact(separation) };
            assert_eq!(sample.is_outlier(&extrapolated, &range), is_outlier, "{extrapolated:?}");
        }
        // One other may have moved past the end of its face, too.
        sample.keep(&others[..1], range.tolerance, true);
        assert!(sample.is_outlier(&contact(0.5), &range));
    }

    #[test]
    fn the_first_ranks_are_spread_over_all_pairs() {
        let body = body();
        let ranks = Ranks::new(&body, &body);
        let count = body.polytopes().len() as u32;
        // Forty tetrahedra lie in a row, and each consists of one or more pieces. In each of these
        // rows of pairs, every tetrahedron is near a pair with a rank in the lowest quarter.
        let rows: [&dyn Fn(u32) -> [u32; 2]; 4] = [&|k| [k, 0], &|k| [k, 7], &|k| [11, k], &|k| [k, k]];
        for (row, pair) in rows.iter().enumerate() {
            let centers: Vec<f64> = (0..count)
                .filter(|&k| ranks.of(pair(k)) < 0.25)
                .map(|k| body.polytopes()[k as usize].centroid().x)
                .collect();
            let farthest = (0..40)
                .map(|k| centers.iter().map(|x| (x - f64::from(k)).abs()).fold(f64::INFINITY, f64::min))
                .fold(0.0, f64::max);
            assert!(farthest < 8.0, "row {row}: {farthest}");
        }
    }
}
