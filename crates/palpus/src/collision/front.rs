//! The front: the cut through the tree of node pairs, kept from tick to tick (front tracking).
//!
//! The pairs of pieces within tolerance can be found by walking down a tree of node pairs \[K02
//! §3.2; EL01\]. The shape of this tree does not depend on the pose: the two nodes of a pair decide
//! which of them is split. Below a cut through the tree, all pairs are too far apart. The cut
//! hardly changes from tick to tick, and most pairs on the cut need not be measured:
//!
//! 1. A pair on the cut whose distance D exceeds the tolerance t *waits*. It cannot come within
//!    the tolerance before the bodies have moved D − t relative to each other. The [`MotionBound`]
//!    adds up the motion, and the [`WakeBoard`] finds the pairs that are *due* (that may have come
//!    within the tolerance).
//! 2. A pair that is due is measured again. Each of these tests is made only if the tests before it
//!    allow just a short wait: spheres, the gap along the normal that last separated the pair,
//!    boxes, and hulls. If the pair is still apart, it waits again. If it is near but stays apart
//!    along the expected path of the bodies, it waits until they leave this path (`path`).
//!    Otherwise it is split, and its two halves are measured.
//! 3. A pair of leaves within the tolerance is *awake*. It is marched in every tick, from the
//!    features at which its last march ended. Pairs that cannot have a contact before some motion
//!    are idle (`idle`). If many pairs are awake, the pairs whose last results are still accurate
//!    enough are at rest (`rest`). Idle pairs and pairs at rest are not marched.
//! 4. If both halves of a split pair wait for a long motion, they are *merged*. The pair is
//!    measured as a whole. If it is far enough apart, it waits in place of its halves. Otherwise
//!    its distance decides after how much motion the merge is tried again.
//!
//! Step 2 is in the file `due`, step 3 in `awake`, `idle` and `rest`, and step 4 in `merge`.
//!
//! The cost of a query grows with the contacts and the pairs that are due, not with the size of the
//! models. The result equals the result of a search from the roots in each query. Both searches
//! split the same pairs by the same tests, but the front skips most tests, because it stores their
//! results.
//!
//! The caller may limit the work of a query by a [`Quota`]. Due pairs get the first half of the
//! quota, since their results are new. Awake pairs are then marched with a quarter of the rest, in
//! turns from query to query; the stages after a march cost more than the march itself. Of what is
//! left, more due pairs are visited (`limited`). While nothing is near, pairs that will soon be
//! near are split in advance (`prepare`). Pairs that the query does not reach stay due until
//! the next query. [`Front::unseen_separation`] is a lower bound of the separation of these pairs,
//! and the list of unvisited pairs contains the pairs with contacts.
//!
//! All memory is allocated when the front is created. If there is no room to split a pair, the pair
//! stays due in every tick, and its descendants are searched without stored data, up to the quota
//! (`below`). This search is slower, and a counter reports it. After a jump the front starts again
//! at the roots.
//!
//! The *front* follows [Ehmann and Lin 2001, §5.2] and [Li and Chen, *Incremental 3D collision
//! detection*, 1998]. They keep the cut, but measure all of it in each frame. The wake times follow
//! [Hubbard 1995] and [Mirtich 1996], who use wake times for pairs of objects.

mod awake;
mod below;
mod due;
mod idle;
mod limited;
mod merge;
mod pair;
mod path;
mod point_bound;
mod prepare;
mod represented;
mod rest;
mod validate;

use std::sync::Arc;

use glam::DVec3;

use super::march::{completed, kept_by_half, march};
use super::motion_bound::MotionBound;
use super::thickness::Thickness;
use super::wakes::{BLOCK, WakeBoard};
use super::{
    Closest, LeafPair, LeafPairs, March, PlacedPair, Proximity, Side, StopReason, TraversalCounters, WarmStart,
};
use crate::algebra::tolerance::{JUMP, JUMP_APART, PACE_FADE};
use crate::algebra::{Placement, Quota, Work};
use crate::body::{Feature, FeaturePair, NodeKind};
use below::NodePair;
use idle::Idle;
pub(crate) use idle::{IdleLimit, IdleReason, Pace};
use pair::{NONE, Pair, State};
use path::Paths;
use prepare::Preparation;
pub(crate) use represented::Represented;
use rest::Rest;

/// The front of one pair of bodies.
#[derive(Clone, Debug)]
pub struct Front {
    /// The nodes of the pair at place 0.
    nodes: [u32; 2],
    /// Number of places at which pairs can be stored. The lists below have memory for all of them,
    /// and grow within it.
    places: usize,
    /// The tree of node pairs down to the cut. The pair of `nodes` is at place 0. The two halves of
    /// a pair are at places 2k and 2k + 1.
    pairs: Vec<Pair>,
    memories: Vec<WarmStart>,
    rests: Vec<Rest>,
    idle: Vec<Idle>,
    /// Number of pairs that were idle in the last query.
    idle_count: u32,
    /// For each two halves: they are not merged until the motion bound's sum reaches this.
    retries: Vec<u64>,
    wakes: WakeBoard,
    motion_bound: MotionBound,
    paths: Paths,
    /// Thicknesses of a and of b.
    thickness: Arc<[Thickness; 2]>,
    /// Thickness of the thinnest piece of the pair at each place, model units. This list is
    /// separate from `pairs`, so that sub-steps read less memory.
    thinnest_at: Vec<f32>,
    /// The least value of `thinnest_at` in each block of places.
    thinnest_in: Vec<f32>,
    /// Places of leaf pairs within tolerance.
    awake: Vec<u32>,
    /// Free places: for each two halves that were merged, the place of the first half.
    free: Vec<u32>,
    /// Places from this index on have never been used.
    fresh: u32,
    stack: Vec<u32>,
    /// Tolerance of the last query, model units.
    tolerance: f64,
    /// The approximate motion of the bodies in a tick.
    pace: Pace,
    /// Half diagonal of the smaller body, model units.
    size: f64,
    begun: bool,
    /// Number of awake pairs that the last query did not visit. They are at the start of `awake`.
    unvisited: usize,
    /// Number of unvisited pairs that had to wait because the quota was spent. They are at the
    /// start of `awake`; the other unvisited pairs are at rest.
    late: usize,
    /// Number of due pairs that the last query did not visit.
    still_due: u32,
    /// The search for pairs that will soon be near, in queries with limited work.
    preparation: Preparation,
    /// Working memory of the query, for places that are then moved to `awake`.
    sorted: [Vec<u32>; 2],
    /// In this query, two halves may be merged if their wake values are at least this.
    merged_from: u64,
    rest_share: f64,
    /// All rests that began at a smaller sum of the motion bound are over.
    rests_from: u64,
    /// Number of represented pairs.
    represented: u32,
    /// The represented pairs of each block of places, one bit each.
    represented_in: Vec<u8>,
    /// No pair with a smaller separation stays represented, model units.
    floor: f64,
    /// True if represented pairs that do not approach fast wait as if all surfaces slid along each
    /// other.
    slides: bool,
    /// True if `awake` still contains pairs that have become represented since the last query.
    is_mixed: bool,
    /// The block of `wakes` at which the search for due pairs starts.
    first_block: usize,
    /// The block at which the next query goes on to bound due pairs.
    first_bounded: usize,
    /// True if the front has had no room to split a pair since it started. Such a pair is due at
    /// any distance.
    was_full: bool,
    /// Stack of the search below a pair of nodes.
    below: Vec<NodePair>,
    /// Nodes of the pair that was nearest in the last search for the nearest pair.
    last_nearest: Option<[u32; 2]>,
}

/// The front makes so many places usable at a time when it grows.
const PLACES_STEP: usize = 64 * BLOCK;

impl Front {
    /// Creates a front for two bodies, with room for at most `places` node pairs.
    pub fn new(a: Side<'_>, b: Side<'_>, places: usize) -> Self {
        let nodes = [a.hierarchy.root(), b.hierarchy.root()];
        Self::below(a, b, nodes, places, &Arc::new([Thickness::of(a), Thickness::of(b)]))
    }

    /// A front for the leaf pairs below the pair of `nodes`. `thickness` belongs to a and b.
    pub(crate) fn below(
        a: Side<'_>,
        b: Side<'_>,
        nodes: [u32; 2],
        places: usize,
        thickness: &Arc<[Thickness; 2]>,
    ) -> Self {
        // The whole tree of node pairs has one leaf for each pair of pieces.
        let leaves = a.pieces.len().saturating_mul(b.pieces.len());
        let places = places.min(leaves.saturating_mul(2)).next_multiple_of(BLOCK);
        let [root_a, root_b] = [a, b].map(|side| side.hierarchy.node(side.hierarchy.root()).oriented_box);
        let depth = a.hierarchy.depth() + b.hierarchy.depth() + 2;
        let mut front = Self {
            nodes,
            places,
            pairs: Vec::with_capacity(places),
            memories: Vec::with_capacity(places),
            rests: Vec::with_capacity(places),
            idle: Vec::with_capacity(places),
            idle_count: 0,
            retries: Vec::with_capacity(places / 2),
            wakes: WakeBoard::new(places),
            motion_bound: MotionBound::new(root_a, root_b),
            paths: Paths::new(root_a, places),
            thickness: thickness.clone(),
            thinnest_at: Vec::with_capacity(places),
            thinnest_in: Vec::with_capacity(places / BLOCK),
            awake: Vec::with_capacity(places),
            free: Vec::with_capacity(places / 2),
            fresh: 2,
            stack: Vec::with_capacity(2 * depth),
            tolerance: 0.0,
            pace: Pace { motion: 0.0, turn: 0.0 },
            size: root_a.half.length().min(root_b.half.length()),
            begun: false,
            unvisited: 0,
            late: 0,
            still_due: 0,
            preparation: Preparation::NONE,
            sorted: [(); 2].map(|()| Vec::with_capacity(places)),
            merged_from: 0,
            rest_share: 0.0,
            rests_from: 0,
            represented: 0,
            represented_in: Vec::with_capacity(places / BLOCK),
            floor: f64::INFINITY,
            slides: false,
            is_mixed: false,
            first_block: 0,
            first_bounded: 0,
            was_full: false,
            below: Vec::with_capacity(2 * depth),
            last_nearest: None,
        };
        front.use_places(2);
        front
    }

    /// Writes to the memory of all places, so that the system provides all of it now. Otherwise it
    /// provides memory when the front grows.
    pub(crate) fn use_all_places(&mut self) {
        self.use_places(self.places);
    }

    /// Makes the first `count` places usable, and some more.
    fn use_places(&mut self, count: usize) {
        if count <= self.pairs.len() {
            return;
        }
        let count = count.next_multiple_of(PLACES_STEP).min(self.places);
        debug_assert!(count.is_multiple_of(BLOCK));
        self.pairs.resize(count, Pair::of(0, 0, NONE));
        self.memories.resize(count, WarmStart::BLANK);
        self.rests.resize(count, Rest::NONE);
        self.idle.resize(count, Idle::NONE);
        self.retries.resize(count / 2, 0);
        self.wakes.extend_to(count);
        self.thinnest_at.resize(count, f32::INFINITY);
        self.thinnest_in.resize(count / BLOCK, f32::INFINITY);
        self.represented_in.resize(count / BLOCK, 0);
    }

    /// Drops all cached data; the next query starts at the roots.
    pub fn clear(&mut self) {
        self.begun = false;
        self.motion_bound.clear();
        self.last_nearest = None;
    }

    /// Writes to `found` every leaf pair that overlaps or is nearer than the tolerance. Idle pairs
    /// and pairs at rest are left out.
    ///
    /// The bodies must be the bodies that were given to [`Self::new`]. `found` is cleared first. If
    /// `found` has too little room, it keeps the deepest pairs and counts the others as dropped.
    pub fn within(&mut self, placed: &PlacedPair<'_>, found: &mut LeafPairs) -> TraversalCounters {
        self.within_quota(placed, &Work::unlimited().all(), found)
    }

    /// Does the work of [`Self::within`] up to `quota`, and visits at least one pair more than the
    /// last query. Pairs thicker than `thinner_than` stay due until the next query.
    pub fn within_quota(
        &mut self,
        query: &PlacedPair<'_>,
        quota: &Quota<'_>,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        let mut counters = TraversalCounters::default();
        found.clear();
        self.move_on(query, &mut counters);
        self.follow_paths(query);
        self.part_represented();
        if query.is_of_all() {
            self.begin_preparation();
        }
        self.begin_merges(query);
        let before = self.awake.len();
        // If no pair is awake, the due pairs get all of the quota.
        let of_due = if before == 0 { *quota } else { quota.half() };
        let done = self.wake_due(query, &of_due, found, &mut counters);
        self.visit_awake(query, before, &quota.half().half(), found, &mut counters);
        self.still_due = if done { 0 } else { self.count_due() };
        self.finish(query, found, &mut counters);
        counters
    }

    /// Returns the thickness of the thinner of two pieces, model units. The thickness of a piece is
    /// its least width along the normals of its faces.
    pub(crate) fn thickness(&self, piece_a: u32, piece_b: u32) -> f64 {
        self.thickness[0].of_piece(piece_a).min(self.thickness[1].of_piece(piece_b))
    }

    /// Returns the thickness of the thinnest piece of both bodies, model units.
    pub(crate) fn thinnest(&self) -> f64 {
        self.thickness[0].of_all().min(self.thickness[1].of_all())
    }

    /// Returns an upper bound of the relative motion of the bodies since the last query, model
    /// units. No distance between a point of a and a point of b has changed by more. `None` before
    /// the first query.
    pub(crate) fn motion_to(&mut self, pose_ba: &Placement) -> Option<f64> {
        self.motion_bound.motion_to(pose_ba)
    }

    /// Returns the motion bound's sum.
    pub(crate) fn motion_sum(&self) -> u64 {
        self.motion_bound.sum()
    }

    /// Returns the motion since the motion bound's sum was `from`, model units.
    pub(crate) fn motion_since(&self, from: u64) -> f64 {
        self.motion_bound.since(from)
    }

    /// Returns the number of places at which pairs can be stored.
    pub(crate) fn places(&self) -> usize {
        self.places
    }

    /// Makes the next query begin with the leaf pair at `place`, for which no quota was left after
    /// its march.
    pub(crate) fn resume_at(&mut self, place: u32) {
        if let Some(k) = self.awake.iter().position(|&awake| awake == place) {
            self.awake.rotate_left(k);
        }
        (self.unvisited, self.late) = (0, 0);
    }

    /// Returns the stored results of a pair.
    #[inline]
    pub fn memory(&self, pair: &LeafPair) -> &WarmStart {
        pair.memory(&self.memories)
    }

    /// Stores the end of the pair's depth walk (or of its march, if the pair is apart), from which
    /// the next tick's walk starts. `normal` is in b's frame. `hub` are vertices that support the
    /// normal, at least nearly.
    pub fn remember_depth(&mut self, pair: &LeafPair, normal: DVec3, hub: [u32; 2], facet: FeaturePair) {
        if let Some(place) = pair.place {
            let memory = &mut self.memories[place as usize];
            *memory = WarmStart { normal, hub, facet: Some(facet), ..*memory };
        }
    }

    /// Stores the features of the pair's depth along a normal that is admissible for both pieces,
    /// if its walk ended on another normal.
    pub fn remember_admissible(&mut self, pair: &LeafPair, admissible: Option<FeaturePair>) {
        if let Some(place) = pair.place {
            self.memories[place as usize].admissible = admissible;
        }
    }

    /// Stores that the two pieces have no shared normal, at any position, until the bodies have
    /// turned by another `angle` (rad).
    pub(crate) fn remember_inadmissible(&mut self, pair: &LeafPair, angle: f64) {
        if let Some(place) = pair.place {
            let inadmissible_until = self.motion_bound.turned() + angle;
            // Until then, there is no walk for this pair.
            let memory = &mut self.memories[place as usize];
            *memory = WarmStart { inadmissible_until, facet: None, ..*memory };
        }
    }

    /// Returns true if a stored result says that the pair has no shared normal, and the result is
    /// still valid.
    pub(crate) fn is_inadmissible(&self, pair: &LeafPair) -> bool {
        self.memory(pair).inadmissible_until >= self.motion_bound.turned()
    }

    /// Returns the number of node pairs in the tree down to the cut.
    pub fn node_pairs(&self) -> usize {
        self.fresh as usize - 2 * self.free.len() - 1
    }

    /// Step 1: subtracts the motion since the last query from all clearances. A larger tolerance
    /// has the same effect.
    fn move_on(&mut self, query: &PlacedPair<'_>, counters: &mut TraversalCounters) {
        let turned = self.motion_bound.turned();
        let moved = self.motion_bound.advance(query.pose_ba);
        let wider = query.tolerance - self.tolerance;
        let spent = wider <= 0.0 || self.motion_bound.spend(wider);
        self.tolerance = query.tolerance;
        let is_apart = self.awake.is_empty() && self.represented == 0;
        let jump = self.size * if is_apart { JUMP_APART } else { JUMP };
        match moved {
            Some(moved) if self.begun && spent && moved <= jump => {
                let Pace { motion, turn } = &mut self.pace;
                *motion = *motion * PACE_FADE + moved * (1.0 - PACE_FADE);
                *turn = *turn * PACE_FADE + (self.motion_bound.turned() - turned) * (1.0 - PACE_FADE);
            }
            _ => {
                self.restart();
                counters.restarted = 1;
            }
        }
    }

    /// Starts the tree again: it contains only the pair of `nodes`, which is due.
    fn restart(&mut self) {
        self.wakes.clear(self.fresh as usize);
        self.free.clear();
        self.awake.clear();
        self.fresh = 2;
        self.paths.clear();
        (self.unvisited, self.late) = (0, 0);
        (self.first_block, self.first_bounded) = (0, 0);
        self.was_full = false;
        (self.represented, self.is_mixed) = (0, false);
        self.represented_in.fill(0);
        self.preparation = Preparation::NONE;
        self.occupy(0, self.nodes, NONE);
        // A pair with wake value 0 is due at any sum above 0.
        self.motion_bound.spend(0.0);
        self.wakes.set(0, 0);
        self.pace = Pace { motion: 0.0, turn: 0.0 };
        self.begun = true;
        self.end_rests();
        self.idle_count = 0;
    }

    /// Returns false if all pieces of the pair are thicker than the query's limit.
    #[inline]
    fn is_wanted(&self, query: &PlacedPair<'_>, place: u32) -> bool {
        query.wants(self.thinnest_at[place as usize])
    }

    /// Puts the pair of these nodes at a place. The pair is a half of the pair at `parent`, or the
    /// root if `parent` is `NONE`.
    fn occupy(&mut self, place: u32, [a, b]: [u32; 2], parent: u32) {
        self.pairs[place as usize] = Pair::of(a, b, parent);
        self.retries[place as usize / 2] = 0;
        self.thinnest_at[place as usize] = self.thickness[0].of_node(a).min(self.thickness[1].of_node(b));
        let block = place as usize / BLOCK;
        let thicknesses = self.thinnest_at[block * BLOCK..][..BLOCK].iter().copied();
        self.thinnest_in[block] = thicknesses.fold(f32::INFINITY, f32::min);
    }

    /// Returns the number of blocks of `wakes` that are in use.
    fn blocks(&self) -> usize {
        (self.fresh as usize).div_ceil(BLOCK)
    }

    fn postpone(&mut self, query: &PlacedPair<'_>, place: u32, distance: f64) {
        self.pairs[place as usize].state = State::Waiting;
        self.wakes.set(place, self.motion_bound.due(distance - query.tolerance));
    }

    /// Marches a pair from the end of its last march. A pair without stored results starts at the
    /// features of the pair of which it is a half.
    fn march(&mut self, query: &PlacedPair<'_>, place: u32, counters: &mut TraversalCounters) -> March {
        let Pair { a, b, known, .. } = self.pairs[place as usize];
        let (polytope_a, polytope_b) = query.polytopes([a, b]);
        if !known {
            let features = completed(polytope_a, polytope_b, query.pose_ba, self.features_of_whole(place));
            self.memories[place as usize] = WarmStart { features, ..WarmStart::BLANK };
            self.pairs[place as usize].known = true;
        }
        let memory = &mut self.memories[place as usize];
        let answer = march(polytope_a, polytope_b, query.pose_ba, memory.features);
        memory.features = answer.features;
        // If a pair that is apart overlaps again later, its depth may have any direction.
        if let Proximity::Disjoint(Closest { normal, features, distance, .. }) = answer.proximity
            && distance >= query.tolerance
        {
            let hub = [features.a.some_vertex(polytope_a), features.b.some_vertex(polytope_b)];
            *memory = WarmStart { normal, hub, facet: None, ..*memory };
            self.store_gap(query, place, normal, distance);
        }
        counters.march_steps += answer.steps;
        counters.march_fallbacks += u32::from(answer.stop != StopReason::Converged);
        answer
    }

    /// Returns the known features of the pair of which the pair at `place` is a half.
    fn features_of_whole(&self, place: u32) -> [Option<Feature>; 2] {
        let Pair { a, b, parent, .. } = self.pairs[place as usize];
        if parent == NONE {
            return [None; 2];
        }
        let whole = &self.pairs[parent as usize];
        debug_assert!(whole.known, "a pair is marched before it is split");
        kept_by_half([whole.a, whole.b], self.memories[parent as usize].features, [a, b])
    }

    fn leaf_pair(&mut self, query: &PlacedPair<'_>, place: u32, answer: &March) -> LeafPair {
        let [piece_a, piece_b] = self.pieces(query, place);
        self.end_rest(place, [piece_a, piece_b]);
        LeafPair { piece_a, piece_b, place: Some(place), proximity: answer.proximity }
    }

    /// Returns the pieces of a pair of leaves.
    fn pieces(&self, placed: &PlacedPair<'_>, place: u32) -> [u32; 2] {
        let pair = self.pairs[place as usize];
        [piece_of(placed.a, pair.a), piece_of(placed.b, pair.b)]
    }
}

/// Returns the piece at a leaf.
fn piece_of(side: Side<'_>, node: u32) -> u32 {
    match side.hierarchy.node(node).kind {
        NodeKind::Leaf { piece } => piece,
        NodeKind::Inner { .. } => unreachable!("only leaves are awake"),
    }
}
