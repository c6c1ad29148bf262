//! Represented pairs: they are within tolerance, but other pairs stand for them, so that they are not
//! measured.
//!
//! Such a pair is due again after some motion, and is first bounded along the normal of its last
//! bound. If it is no deeper than what stands for it, it goes on; the nearer it comes to that, the
//! sooner it is due again. After a longer motion, or if it may be deeper, it is measured.

use glam::DVec3;

use super::super::TraversalCounters;
use super::{Front, Pair, PlacedPair, State};
use crate::algebra::tolerance::{REPRESENTED_LEAST, REPRESENTED_SLOPE, REST_SPREAD};
use crate::collision::front::rest::{GOLDEN, Rest};
use crate::collision::{LeafPair, support_gap};

/// Bound of a pair that is represented.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Represented {
    /// Unit, from b into a, in b's frame: the direction of the bound; zero without one.
    pub(crate) normal: DVec3,
    /// Vertices of a and b that support it.
    pub(crate) hub: [u32; 2],
    /// The least separation along the normal (model units) for which others stand.
    pub(crate) least: f64,
    /// The motion (model units) after which the pair is measured again.
    pub(crate) length: f64,
}

impl Front {
    /// Leaves `pair`, which this query has found, out.
    pub(crate) fn represent(&mut self, query: &PlacedPair<'_>, pair: &LeafPair, bound: &Represented, separation: f64) {
        let Some(place) = pair.place else { return };
        if bound.normal != DVec3::ZERO {
            let memory = &mut self.memories[place as usize];
            (memory.normal, memory.hub) = (bound.normal, bound.hub);
            self.sight(query, place, bound.normal, separation);
        }
        let share = 1.0 - REST_SPREAD * (f64::from(place) * GOLDEN).fract();
        self.rests[place as usize] = Rest {
            pieces: [pair.piece_a, pair.piece_b],
            since: self.motion_bound.sum(),
            length: (share * bound.length) as f32,
            least: bound.least as f32,
        };
        self.pairs[place as usize].state = State::Represented;
        self.represented += 1;
        self.is_mixed = true;
        self.wait(place, separation);
    }

    /// True if the pair at `place`, which is due, is still represented; otherwise it is an ordinary
    /// pair again.
    pub(super) fn is_represented_still(
        &mut self,
        query: &PlacedPair<'_>,
        place: u32,
        counters: &mut TraversalCounters,
    ) -> bool {
        let rest = self.rests[place as usize];
        let Pair { a, b, .. } = self.pairs[place as usize];
        let memory = &self.memories[place as usize];
        if memory.normal != DVec3::ZERO && self.motion_bound.since(rest.since) < f64::from(rest.length) {
            let gap = self.sighted_gap(query, place);
            if gap >= f64::from(rest.least) && gap < query.tolerance {
                counters.sighted += 1;
                self.wait(place, gap);
                return true;
            }
            counters.bounded += 1;
            let memory = &mut self.memories[place as usize];
            let (hull_a, hull_b) = query.polytopes([a, b]);
            let (gap, hub) = support_gap(hull_a, hull_b, query.pose_ba, memory.normal, memory.hub);
            memory.hub = hub;
            let normal = memory.normal;
            self.sight(query, place, normal, gap);
            if gap >= f64::from(rest.least) && gap < query.tolerance {
                self.wait(place, gap);
                return true;
            }
        }
        self.represented -= 1;
        self.pairs[place as usize].state = State::Asleep;
        false
    }

    /// The pair is due when it may come near its bound.
    fn wait(&mut self, place: u32, separation: f64) {
        let Rest { length, least, .. } = self.rests[place as usize];
        let (length, margin) = (f64::from(length), separation - f64::from(least));
        let until = (margin / REPRESENTED_SLOPE).clamp(REPRESENTED_LEAST * length, length);
        self.wakes.set(place, self.motion_bound.due(until));
    }

    /// How many pairs are represented.
    pub(crate) fn represented(&self) -> u32 {
        self.represented
    }

    /// Takes represented pairs off the list of those awake.
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
