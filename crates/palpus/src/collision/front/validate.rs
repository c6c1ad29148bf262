//! Checks the front's invariants.
//!
//! 1. The cut: each split pair has exactly its two halves at its two places. So the pairs that are
//!    not split cover each pair of pieces exactly once. Each used place is in this tree or free.
//! 2. States: an awake pair is a pair of leaves, is in the list of awake pairs, and is never due. A
//!    split pair is never due. Every other pair has a wake value, and its block is searched when
//!    the pair is due.
//! 3. Wake times: the distance of a waiting pair exceeds the tolerance by at least the motion for
//!    which it still waits. A sliding pair that is not due is on a path, and is not nearer than the
//!    tolerance.
//!
//! The checks allocate no memory, so they may run within a step. In debug builds, each query checks
//! a small front completely. In a large front, it checks a window of places, and measures one
//! waiting pair.

use super::super::PlacedPair;
use super::super::march::{initial_features, march};
use super::super::wakes::NEVER;
use super::{Front, NONE, Pair, State};
use crate::algebra::tolerance::{LATE_WAKE, VALIDATED_PLACES};
use crate::body::NodeKind;

/// An invariant of the front that is broken.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum FrontFault {
    /// The places of a split pair's halves do not contain its two halves.
    #[error("the places below the split pair at {0} do not hold its halves")]
    Halves(u32),
    /// The places in the tree and the free places together are not all places that were ever used,
    /// or the free list contains a place that is in use.
    #[error("the places in the tree and the free ones are not all places up to {0}")]
    Places(u32),
    /// An awake pair is not a pair of leaves, or is not in the list of awake pairs; or this list
    /// contains a pair that is not awake.
    #[error("the pair at {0} and the list of those awake disagree")]
    Awake(u32),
    /// The stored number of represented pairs is wrong.
    #[error("there are not {0} represented pairs")]
    Represented(u32),
    /// A pair that is never due has a wake value, a pair that can be due has none, or the lower
    /// bound of the pair's block does not include its value.
    #[error("the pair at {0} has a wake value that does not fit its state, or that its block does not know")]
    Wake(u32),
    /// A sliding pair that is not due is on no path.
    #[error("the pair at {0} slides along no path")]
    Path(u32),
    /// A pair is nearer than its wake value allows.
    #[error("the pair at {place} waits as if {promised:e} beyond the tolerance and is {clearance:e} beyond it")]
    LateWake {
        /// The pair's place.
        place: u32,
        /// Clearance that the wake value implies, model units.
        promised: f64,
        /// Measured distance beyond the tolerance, model units.
        clearance: f64,
    },
}

impl Front {
    /// Checks the whole front, measures every waiting pair, and returns the first broken invariant.
    #[cfg(test)]
    pub(super) fn validate(&self, query: &PlacedPair<'_>) -> Result<(), FrontFault> {
        self.validate_places()?;
        (0..self.fresh).try_for_each(|place| self.validate_place(query, place))?;
        (0..self.fresh).try_for_each(|place| self.validate_wait(query, place))
    }

    /// Does the part of the check that is fast enough for each query of a debug build.
    pub(super) fn validate_some(&self, query: &PlacedPair<'_>) -> Result<(), FrontFault> {
        if self.fresh <= VALIDATED_PLACES {
            self.validate_places()?;
        }
        let resting = self.awake.get(self.late..self.unvisited).unwrap_or(&[]);
        if let Some(&place) = resting.iter().find(|&&place| !self.is_at_rest(place)) {
            return Err(FrontFault::Awake(place));
        }
        // Each query checks another window: the motion bound's sum is used as a random number.
        let begin = (self.motion_bound.sum() % u64::from(self.fresh)) as u32;
        let window = (0..self.fresh.min(VALIDATED_PLACES)).map(|k| (begin + k) % self.fresh);
        window.clone().try_for_each(|place| self.validate_place(query, place))?;
        let waiting = window.into_iter().find(|&place| self.promised(place).is_some());
        waiting.map_or(Ok(()), |place| self.validate_wait(query, place))
    }

    /// Returns true if the place contains a pair of the present tree, not an old one.
    fn is_in_tree(&self, place: u32) -> bool {
        let parent = self.pairs[place as usize].parent;
        match place {
            0 => true,
            1 => false,
            _ if parent >= self.fresh => false,
            _ => {
                let parent = &self.pairs[parent as usize];
                parent.state == State::Split && parent.first() == place & !1
            }
        }
    }

    /// Checks invariants 1 and 2 for the front as a whole.
    fn validate_places(&self) -> Result<(), FrontFault> {
        let in_tree = (0..self.fresh).filter(|&place| self.is_in_tree(place)).count();
        let is_free = |&first: &u32| first & 1 == 0 && first + 1 < self.fresh && !self.is_in_tree(first);
        if in_tree != self.node_pairs() || !self.free.iter().all(is_free) {
            return Err(FrontFault::Places(self.fresh));
        }
        let is_awake = |place: u32| self.pairs[place as usize].state == State::Awake;
        if let Some(&place) = self.awake.iter().find(|&&place| !(self.is_in_tree(place) && is_awake(place))) {
            return Err(FrontFault::Awake(place));
        }
        let is_represented = |place: u32| self.pairs[place as usize].state == State::Represented;
        let represented = (0..self.fresh).filter(|&place| self.is_in_tree(place) && is_represented(place)).count();
        let marked = self.represented_in.iter().map(|bits| bits.count_ones()).sum::<u32>();
        if represented != self.represented as usize || marked != self.represented {
            return Err(FrontFault::Represented(self.represented));
        }
        let awake = (0..self.fresh).filter(|&place| self.is_in_tree(place) && is_awake(place)).count();
        if awake == self.awake.len() { Ok(()) } else { Err(FrontFault::Awake(NONE)) }
    }

    /// Checks invariants 1 and 2 for one place.
    fn validate_place(&self, query: &PlacedPair<'_>, place: u32) -> Result<(), FrontFault> {
        if !self.is_in_tree(place) {
            // A place outside the tree must never be due.
            return if self.wakes.get(place) == NEVER { Ok(()) } else { Err(FrontFault::Wake(place)) };
        }
        let Pair { a, b, state, .. } = self.pairs[place as usize];
        let is_due_at_times = match state {
            State::Split => {
                let first = self.pairs[place as usize].first();
                let whole = first & 1 == 0 && first + 1 < self.fresh;
                let same = |half: [u32; 2], at: u32| {
                    let Pair { a, b, parent, .. } = self.pairs[at as usize];
                    ([a, b], parent) == (half, place)
                };
                let halves = query.halves([a, b]);
                let held = halves.is_some_and(|[one, other]| whole && same(one, first) && same(other, first + 1));
                if !held {
                    return Err(FrontFault::Halves(place));
                }
                false
            }
            State::Awake => {
                let [kind_a, kind_b] = [query.a.hierarchy.node(a).kind, query.b.hierarchy.node(b).kind];
                let leaves = matches!((kind_a, kind_b), (NodeKind::Leaf { .. }, NodeKind::Leaf { .. }));
                if !leaves || !self.awake.contains(&place) {
                    return Err(FrontFault::Awake(place));
                }
                false
            }
            State::Waiting | State::Sliding | State::Represented | State::Unsplit => true,
        };
        let wake = self.wakes.get(place);
        let fits = (wake != NEVER) == is_due_at_times && self.wakes.is_known(place);
        let slides = state == State::Sliding && wake >= self.motion_bound.sum();
        if !fits {
            Err(FrontFault::Wake(place))
        } else if slides && !self.paths.contain(place, wake) {
            Err(FrontFault::Path(place))
        } else {
            Ok(())
        }
    }

    /// Returns the length (model units) by which the distance of a pair exceeds the tolerance,
    /// according to its wake value; negative if the pair is due. `None` if the wake value is no
    /// bound.
    fn promised(&self, place: u32) -> Option<f64> {
        let wake = self.wakes.get(place);
        let waits = -self.motion_bound.since(wake);
        match self.pairs[place as usize].state {
            State::Waiting if wake > 0 && self.is_in_tree(place) => Some(waits),
            State::Sliding if waits >= 0.0 => Some(0.0),
            _ => None,
        }
    }

    /// Checks invariant 3 for one place.
    fn validate_wait(&self, query: &PlacedPair<'_>, place: u32) -> Result<(), FrontFault> {
        let Some(promised) = self.promised(place) else { return Ok(()) };
        let Pair { a, b, .. } = self.pairs[place as usize];
        let (polytope_a, polytope_b) = (query.a.polytope(a), query.b.polytope(b));
        let start = initial_features(polytope_a, polytope_b, query.pose_ba);
        let clearance = march(polytope_a, polytope_b, query.pose_ba, start).distance() - query.tolerance;
        let size = polytope_a.radius() + polytope_b.radius() + query.pose_ba.translation.length();
        if promised <= clearance + LATE_WAKE * size {
            return Ok(());
        }
        Err(FrontFault::LateWake { place, promised, clearance })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::super::super::{LeafPairs, Represented, Side};
    use super::*;
    use crate::algebra::Random;
    use crate::algebra::{Placement, Pose};
    use crate::body::{Hierarchy, Polytope, convex_hull};

    const SEED: u64 = 0xf207_fa17;
    const TOLERANCE: f64 = 0.2;

    struct Bodies {
        pieces: Vec<Polytope>,
        hierarchy: Hierarchy,
    }

    impl Bodies {
        /// Returns a body of pieces that are scattered over a sphere. Two such bodies meet in many
        /// places.
        fn new(random: &mut Random, count: usize) -> Self {
            let piece = |random: &mut Random| {
                let at = random.direction() * 3.0;
                let points: Vec<DVec3> = (0..7).map(|_| at + random.direction() * 0.5).collect();
                convex_hull(&points, 1e-10).unwrap().into_polytope().unwrap().0
            };
            let pieces: Vec<Polytope> = (0..count).map(|_| piece(random)).collect();
            let hierarchy = Hierarchy::build(&pieces, 1e-10).unwrap();
            Self { pieces, hierarchy }
        }

        fn side(&self) -> Side<'_> {
            Side { hierarchy: &self.hierarchy, pieces: &self.pieces }
        }
    }

    /// Returns the pose at time `t` of a motion past and through b.
    fn path(t: f64) -> Placement {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), t);
        Pose::new(turn, DVec3::new(6.5 * (0.7 * t).cos(), 1.0 - t, 0.3)).placement()
    }

    #[test]
    fn each_broken_invariant_is_named() {
        let mut random = Random::new(SEED);
        for case in 0..6 {
            let (one, other) = (Bodies::new(&mut random, 20 + 5 * case), Bodies::new(&mut random, 25));
            let (a, b) = (one.side(), other.side());
            // In half of the cases the front has little room, so that some pairs cannot be split.
            let mut front = Front::new(a, b, if case % 2 == 0 { 2000 } else { 60 });
            let mut found = LeafPairs::new(500);
            let mut broken = [0; 4];
            for tick in 0..200 {
                let pose_ba = path(0.01 * f64::from(tick));
                let query = PlacedPair::new(a, b, &pose_ba, TOLERANCE);
                front.within(&query, &mut found);
                let what = format!("seed {SEED:#x}, case {case}, tick {tick}");
                assert_eq!(front.validate(&query), Ok(()), "{what}");
                if tick % 7 == 0 {
                    let bound = Represented { normal: DVec3::ZERO, hub: [0; 2], least: f64::NEG_INFINITY, length: 0.2 };
                    found.as_slice().iter().step_by(3).for_each(|leaf| front.represent(&query, leaf, &bound, 0.0));
                    front.part_represented();
                    assert_eq!(front.validate(&query), Ok(()), "{what}, with represented pairs");
                }
                if tick % 10 == 0 {
                    let counts = break_each(&front, &query, &mut random, &what);
                    broken.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
                }
            }
            assert!(broken.iter().all(|&count| count > 0), "seed {SEED:#x}, case {case}: {broken:?}");
        }
    }

    /// Breaks the front in each way that its state allows. Returns the number of times that each
    /// way was tried.
    fn break_each(front: &Front, query: &PlacedPair<'_>, random: &mut Random, what: &str) -> [u32; 4] {
        let mut pick = |wanted: &dyn Fn(u32) -> bool| {
            let fits: Vec<u32> = (0..front.fresh).filter(|&place| front.is_in_tree(place) && wanted(place)).collect();
            (!fits.is_empty()).then(|| fits[random.below(fits.len())])
        };
        let state = |place: u32| front.pairs[place as usize].state;
        let fault = |change: &dyn Fn(&mut Front)| {
            let mut broken = front.clone();
            change(&mut broken);
            broken.validate(query).expect_err("a broken front")
        };
        let counted = fault(&|front| front.represented += 1);
        assert!(matches!(counted, FrontFault::Represented(_)), "{what}: {counted}");
        let mut counts = [0; 4];
        // If a pair is stored before its parent, changing it would break another invariant first.
        let follows = |place: u32| place > 0 && front.pairs[place as usize].parent < place;
        if let Some(place) = pick(&|place| follows(place) && state(place) != State::Split) {
            let torn = fault(&|front| front.pairs[place as usize].a ^= 1);
            assert!(matches!(torn, FrontFault::Halves(_)), "{what}: {torn}");
            let silent = fault(&|front| {
                let value = if state(place) == State::Awake { 1 } else { NEVER };
                front.wakes.set(place, value);
            });
            assert_eq!(silent, FrontFault::Wake(place), "{what}");
            let freed = fault(&|front| front.free.push(place & !1));
            assert!(matches!(freed, FrontFault::Places(_)), "{what}: {freed}");
            counts[0] += 1;
        }
        if let Some(place) = pick(&|place| state(place) == State::Awake) {
            let forgotten = fault(&|front| front.awake.retain(|&awake| awake != place));
            assert!(matches!(forgotten, FrontFault::Awake(_)), "{what}: {forgotten}");
            counts[1] += 1;
        }
        if let Some(place) = pick(&|place| front.promised(place).is_some_and(|promised| promised > 0.0)) {
            let late = front.motion_bound.due(1e3);
            let late_wake = fault(&|front| front.wakes.set(place, late));
            assert!(matches!(late_wake, FrontFault::LateWake { .. }), "{what}: {late_wake}");
            counts[2] += 1;
        }
        if let Some(place) = pick(&|place| state(place) == State::Split) {
            let lost = fault(&|front| front.pairs[place as usize].state = State::Waiting);
            assert!(matches!(lost, FrontFault::Places(_)), "{what}: {lost}");
            counts[3] += 1;
        }
        counts
    }
}
