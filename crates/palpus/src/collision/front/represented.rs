//! Represented pairs: pairs within tolerance that are not measured, because the contacts of other
//! pairs already account for their force.
//!
//! The caller provides a direction and a limit. Other contacts account for the pair while the
//! pair's gap along the direction is at least the limit. After some motion the pair is due, and
//! this gap is computed. If the gap is at least the limit, the pair stays represented. The nearer
//! the gap is to the limit, the sooner the pair is due again. If the gap is below the limit, or
//! after a longer motion, the pair is measured like any other.
//!
//! If only a few contacts account for the pairs ([`Front::represent_above`]), another pair may
//! press harder at any time. Then no pair stays represented that is nearer than the deepest of
//! these contacts, and a pair that approaches is due sooner. If many contacts account for them,
//! only pairs that approach fast, as in an impact, are due sooner.

use glam::DVec3;

use super::super::TraversalCounters;
use super::super::wakes::BLOCK;
use super::point_bound::PointBound;
use super::rest::{Rest, own_share};
use super::{Front, PlacedPair, State};
use crate::algebra::tolerance::{
    REPRESENTED_APPROACH, REPRESENTED_IMPACT, REPRESENTED_LEAST, REPRESENTED_PAUSE, REPRESENTED_SLOPE,
};
use crate::collision::LeafPair;

/// Bound of a pair that is represented.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Represented {
    /// Direction of the bound: a unit vector from b into a, in b's frame. Zero if there is no
    /// bound.
    pub(crate) normal: DVec3,
    /// Support vertices of a and b along the normal.
    pub(crate) hub: [u32; 2],
    /// The pair stays represented while its separation along the normal is at least this (model
    /// units).
    pub(crate) least: f64,
    /// The motion (model units) after which the pair is measured again.
    pub(crate) length: f64,
}

/// Returns the bit of a place within its block.
fn bit(place: u32) -> u8 {
    1 << (place as usize % BLOCK)
}

impl Front {
    /// Marks `pair`, which this query has found, as represented. `separation` (model units) is its
    /// gap along the direction of the bound.
    pub(crate) fn represent(&mut self, query: &PlacedPair<'_>, pair: &LeafPair, bound: &Represented, separation: f64) {
        let Some(place) = pair.place else { return };
        if bound.normal != DVec3::ZERO {
            let memory = &mut self.memories[place as usize];
            (memory.normal, memory.hub) = (bound.normal, bound.hub);
            self.store_gap(query, place, bound.normal, separation);
        } else {
            self.pairs[place as usize].set_bound(PointBound::NONE);
        }
        self.rests[place as usize] = Rest {
            pieces: [pair.piece_a, pair.piece_b],
            since: self.motion_bound.sum(),
            length: (own_share(place) * bound.length) as f32,
            least: bound.least as f32,
        };
        self.pairs[place as usize].state = State::Represented;
        self.represented += 1;
        self.represented_in[place as usize / BLOCK] |= bit(place);
        self.is_mixed = true;
        self.wait(place, separation);
    }

    /// Tests whether the represented pair at `place`, which is due, stays represented. `gap` (model
    /// units) is its stored bound. Returns `None` if the pair stays represented. Otherwise the pair
    /// becomes an ordinary pair, and the function returns its present bound.
    pub(super) fn no_longer_represented(
        &mut self,
        query: &PlacedPair<'_>,
        place: u32,
        mut gap: f64,
        counters: &mut TraversalCounters,
    ) -> Option<f64> {
        let rest = self.rests[place as usize];
        if self.pairs[place as usize].bound.exists() && self.motion_bound.since(rest.since) < f64::from(rest.length) {
            let least = f64::from(rest.least).max(self.floor);
            let holds = |gap: f64| gap >= least && gap < query.tolerance;
            if holds(gap) {
                counters.bounded_by_point += 1;
                self.wait(place, gap);
                return None;
            }
            // A pair that is beyond the tolerance, as where a tool lifts off, waits like any other.
            if gap < query.tolerance {
                counters.bounded_by_supports += 1;
                let along = self.measure_gap(query, place).unwrap_or(f64::NEG_INFINITY);
                if holds(along) {
                    self.wait(place, along);
                    return None;
                }
                gap = along;
            }
        }
        self.represented -= 1;
        self.represented_in[place as usize / BLOCK] &= !bit(place);
        self.pairs[place as usize].state = State::Waiting;
        Some(gap)
    }

    /// Sets the separation (model units) below which no pair stays represented; infinite to measure
    /// all pairs. If `slides` is true, pairs that do not approach fast wait as if all surfaces slid
    /// along each other. If `now` is true, the next query tests all represented pairs.
    pub(crate) fn represent_above(&mut self, floor: f64, slides: bool, now: bool) {
        self.slides = slides;
        let before = std::mem::replace(&mut self.floor, floor);
        let is_over = floor == f64::INFINITY && before < f64::INFINITY;
        if self.represented > 0 && (now || is_over) {
            for (block, &bits) in self.represented_in[..self.blocks()].iter().enumerate() {
                for k in (0..BLOCK).filter(|k| bits >> k & 1 == 1) {
                    self.wakes.set((block * BLOCK + k) as u32, self.motion_bound.sum());
                }
            }
        }
    }

    /// Sets when the pair is due again. The nearer `separation` is to the least separation, the
    /// sooner the pair is due.
    fn wait(&mut self, place: u32, separation: f64) {
        let Rest { length, least, .. } = self.rests[place as usize];
        let (length, margin) = (f64::from(length), separation - f64::from(least).max(self.floor));
        let expected = match self.approach(place) {
            approach if !self.slides => REPRESENTED_APPROACH * approach,
            // The other contacts keep the bodies from speeding up.
            approach if approach >= REPRESENTED_IMPACT => approach,
            _ => 0.0,
        };
        let slope = expected.max(REPRESENTED_SLOPE);
        let shortest = REPRESENTED_LEAST * length * (REPRESENTED_SLOPE / slope);
        let shortest = shortest.max(REPRESENTED_PAUSE * self.tolerance).min(length);
        let until = (margin / slope).clamp(shortest, length);
        self.wakes.set(place, self.motion_bound.due(until));
    }

    /// Returns the number of represented pairs.
    pub(crate) fn represented(&self) -> u32 {
        self.represented
    }

    /// Removes represented pairs from the list of awake pairs.
    pub(super) fn part_represented(&mut self) {
        if self.is_mixed {
            self.is_mixed = false;
            let pairs = &self.pairs;
            let is_awake = |place: &u32| pairs[*place as usize].state == State::Awake;
            debug_assert!(self.awake[..self.unvisited].iter().all(is_awake));
            self.awake.retain(is_awake);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::oracle::cuboid;
    use super::super::super::{LeafPairs, Side};
    use super::*;
    use crate::algebra::Pose;
    use crate::body::Hierarchy;

    const TOLERANCE: f64 = 1.1;
    /// The longest pause, and the motion of a query.
    const LATE: f64 = REPRESENTED_PAUSE * TOLERANCE + 0.01;

    /// Moves one piece to another, 0.01 nearer in each query and `aside`, while the pair is
    /// represented down to the separation `least`. Returns the separation at which it is measured
    /// again.
    fn measured_at(floor: f64, slides: bool, least: f64, aside: f64) -> f64 {
        let pieces = [cuboid(DVec3::new(2.0, 20.0, 1.0))];
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let side = Side { hierarchy: &hierarchy, pieces: &pieces };
        let (mut front, mut found) = (Front::new(side, side, 100), LeafPairs::new(10));
        front.represent_above(floor, slides, false);
        for query in 0..300 {
            let separation = 1.0 - 0.01 * f64::from(query);
            let at = DVec3::new(0.0, aside * f64::from(query), 2.0 + separation);
            let pose_ba = Pose::from_translation(at).placement();
            let query = PlacedPair::new(side, side, &pose_ba, TOLERANCE);
            front.within(&query, &mut found);
            let Some(leaf) = found.as_slice().first() else { continue };
            if separation < 0.95 {
                return separation;
            }
            let bound = Represented { normal: DVec3::Z, hub: [0, 7], least, length: 20.0 };
            front.represent(&query, leaf, &bound, separation);
        }
        panic!("the pair is never measured");
    }

    #[test]
    fn pair_that_approaches_is_measured_at_its_limit() {
        for (slides, aside) in [(false, 0.0), (false, 0.06), (true, 0.0)] {
            let nearest = measured_at(f64::NEG_INFINITY, slides, 0.5, aside);
            assert!(nearest > 0.5 - LATE && nearest <= 0.5, "{nearest}");
        }
        // If many contacts account for it, a pair that slides waits for longer.
        let nearest = measured_at(f64::NEG_INFINITY, true, 0.5, 0.06);
        assert!(nearest < 0.0, "{nearest}");
    }

    #[test]
    fn no_pair_stays_represented_below_the_floor() {
        let nearest = measured_at(0.3, false, -10.0, 0.0);
        assert!(nearest > 0.3 - LATE && nearest < 0.3, "{nearest}");
        assert!(measured_at(f64::INFINITY, false, -10.0, 0.0) > 0.95 - LATE);
    }
}
