//! Pairs at rest: they are awake but not measured, since the extrapolated contacts of an earlier
//! query are accurate enough.
//!
//! Pieces that slide along each other keep their contacts for many ticks, and close-fitting
//! surfaces have thousands of contacts. When the caller measures a pair, it states after how much
//! motion the pair must be measured again. Until then the pair is *at rest*.
//!
//! The caller also decides how long pairs rest: see [`Front::set_rest_share`].

use super::Front;
use crate::algebra::spread;
use crate::algebra::tolerance::REST_SPREAD;
use crate::collision::LeafPair;

/// The last result of the pair at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Pieces of a and of b.
    pub(super) pieces: [u32; 2],
    /// The motion bound's sum when the pair was measured.
    pub(super) since: u64,
    /// The motion over which the result is kept, model units. 0 if the result is not kept.
    pub(super) length: f32,
    /// The least separation at which a represented pair stays represented, model units.
    pub(super) least: f32,
}

impl Rest {
    /// A pair that is measured in each query.
    pub(super) const NONE: Self = Self { pieces: [u32::MAX; 2], since: 0, length: 0.0, least: 0.0 };
}

/// Returns the share of its wait that the pair at `place` gets, so that pairs which begin to wait
/// in the same query are not all due in the same query.
pub(super) fn own_share(place: u32) -> f64 {
    1.0 - REST_SPREAD * spread(place)
}

impl Front {
    /// Sets the share of its rest that each pair gets from the next query on, 0 to 1. With 0, each
    /// query measures all pairs.
    pub(crate) fn set_rest_share(&mut self, share: f64) {
        self.rest_share = share;
    }

    /// True if the pair at `place` is at rest.
    pub(super) fn is_at_rest(&self, place: u32) -> bool {
        let rest = self.rests[place as usize];
        let length = self.rest_share * f64::from(rest.length);
        rest.since >= self.rests_from && self.motion_bound.since(rest.since) < length
    }

    /// Ends the rest of the pair of pieces at `place`: the pair is measured now, or in the next
    /// query.
    pub(crate) fn end_rest(&mut self, place: u32, pieces: [u32; 2]) {
        let rest = &mut self.rests[place as usize];
        rest.length = 0.0;
        if rest.pieces != pieces {
            *rest = Rest { pieces, ..Rest::NONE };
        }
    }

    /// Returns the motion since the rest of the pair began, model units. `None` if no rest of the
    /// pair is stored.
    pub(crate) fn motion_since_rest(&self, pair: &LeafPair) -> Option<f64> {
        let since = self.rests[pair.place? as usize].since;
        (since >= self.rests_from).then(|| self.motion_bound.since(since))
    }

    /// Puts `pair` at rest for a motion of `length` (model units) from now. Each pair rests for its
    /// own share of `length`, so that pairs which were measured in the same query, as after a jump,
    /// are not all due in the same query.
    pub(crate) fn rest(&mut self, pair: &LeafPair, length: f64) {
        if let Some(place) = pair.place {
            let (since, length) = (self.motion_bound.sum(), (own_share(place) * length) as f32);
            self.rests[place as usize] = Rest { since, length, ..self.rests[place as usize] };
        }
    }

    /// Ends all rests, because the results are no longer stored.
    pub(crate) fn end_rests(&mut self) {
        self.rests_from = self.motion_bound.sum() + 1;
    }

    /// Returns two counts of the pairs of pieces that were within the tolerance at their last
    /// visit, but that the last query did not visit. The first is the count of the pairs that were
    /// skipped because the quota was spent. The second is the count of all these pairs.
    pub(crate) fn unvisited(&self) -> [usize; 2] {
        [self.late, self.unvisited]
    }

    /// Returns the place and the pieces of unvisited pair `k`. The pairs that were skipped because
    /// the quota was spent come first.
    pub(crate) fn unvisited_pair(&self, k: usize) -> (u32, [u32; 2]) {
        let place = self.awake[k];
        (place, self.rests[place as usize].pieces)
    }
}
