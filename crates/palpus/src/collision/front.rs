//! The sleeping front: the cut of the tree of node pairs, kept from tick to tick.
//!
//! The full traversal ([`Traversal`]) finds the pairs of pieces within tolerance by walking down a tree of node pairs, whose shape does
//! not depend on the pose: which side of a pair is split, its nodes say. Below some cut of this tree everything is too far
//! apart. From one tick to the next that cut hardly moves, and most of what lies on it need not even be looked at:
//!
//! 1. A pair on the cut at distance D more than the tolerance t *sleeps*. It cannot matter before the bodies have moved D − t
//!    against each other; the [`Odometer`] sums up the motion, and the [`WakeBoard`] knows who is due.
//! 2. A pair that is due is measured again: by spheres, by boxes when these promise a short sleep only, by hulls when those do. When
//!    it is still apart, it goes on sleeping; otherwise it is split and its halves are measured.
//! 3. A pair of leaves within tolerance is *awake*: it is marched every tick, from the features on which it ended last time.
//! 4. Halves that both sleep long are *merged*: the pair that they came from is measured, and when it is far enough it sleeps
//!    in their place. When it is not, it says itself after how much motion it makes sense to try again.
//!
//! A frame so costs what is in contact and what is due, however large the models. The answer is that of the full
//! traversal: both split the same pairs by the same tests, but the front knows for most that their test would fail.
//!
//! A query may be given a *deadline*. Due pairs have the first half of the time, since what they find is new; then those awake are marched, in
//! turns from query to query, for a quarter of the rest, since what follows takes longer than a march does. What is left is as
//! overdue next time, and is looked at then; meanwhile
//! [`Front::unseen_separation`] says how near a pair that was not looked at can be, and the list of those unvisited which contacts were not.
//!
//! All memory is obtained at construction. A pair for which there is no room to split stays due every tick, and what is below it is searched
//! by the full traversal; that is slower and says so in the counters. After a jump the front begins anew at the roots, which
//! costs one full traversal.
//!
//! After the *front* of [Ehmann and Lin 2001, §5.2] and [Li and Chen, *Incremental 3D collision detection*, 1998], who keep the cut but
//! measure all of it each frame; and the wake times of [Hubbard 1995] and [Mirtich 1996], there for pairs of objects.

use glam::DVec3;

use super::bounds::{box_gap, sphere_gap};
use super::coherence::Memory;
use super::leaf_pairs::Home;
use super::march::{March, initial_features, march};
use super::odometer::Odometer;
use super::thickness::Thickness;
use super::traverse::distance;
use super::wakes::{BLOCK, NEVER, WakeBoard};
use super::{LeafPair, LeafPairs, Proximity, Side, StopReason, Traversal, TraversalCounters};
use crate::algebra::tolerance::{BOX_NAP, FRONT_JUMP, MERGE_CLEARANCE, MERGE_RETRY, PACE_FADE, SPHERE_NAP};
use crate::algebra::{Clock, Deadline, NoClock, Placement};
use crate::body::{Feature, FeaturePair, NodeKind};

/// The cut between what is looked at and what sleeps, for one pair of bodies.
#[derive(Clone, Debug)]
pub struct Front {
    /// The tree of node pairs down to the cut; the root is at place 0, halves are neighbours at places 2k and 2k + 1.
    pairs: Vec<Pair>,
    memories: Vec<Memory>,
    wakes: WakeBoard,
    odometer: Odometer,
    /// Of a and of b.
    thickness: [Thickness; 2],
    /// Places of leaf pairs within tolerance.
    awake: Vec<u32>,
    /// First places of pairs of halves that were merged.
    free: Vec<u32>,
    /// Places from here on were never used.
    fresh: u32,
    stack: Vec<u32>,
    /// Those of the last query: tolerance, and about how far the bodies move in a tick.
    tolerance: f64,
    pace: f64,
    /// The length of motion that is a jump.
    jump: f64,
    begun: bool,
    /// The first so many of those awake were not visited by the last query.
    unvisited: usize,
    /// Where the board is searched first.
    first_block: usize,
    /// There was no room for some pair since the front began: being due then says nothing about its distance.
    was_crowded: bool,
    /// Searches what is below pairs without room.
    full: Traversal,
}

/// A pair of nodes in the tree.
#[derive(Clone, Copy, Debug)]
struct Pair {
    a: u32,
    b: u32,
    /// Place of the pair that this is a half of.
    parent: u32,
    state: State,
    /// Whether something is remembered of the pair.
    known: bool,
    /// The odometer's sum up to which this is not to be merged back.
    retry: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// On the cut, apart.
    Asleep,
    /// On the cut, leaves within tolerance.
    Awake,
    /// Above the cut; the first half's place.
    Split(u32),
    /// On the cut, but in need of a split for which there is no room.
    Crowded,
}

/// What one query is about.
#[derive(Clone, Copy)]
struct Query<'a> {
    a: Side<'a>,
    b: Side<'a>,
    pose_ba: &'a Placement,
    tolerance: f64,
    /// Only pairs one of whose pieces is thinner than this are looked at.
    thinner_than: f64,
}

/// What measuring a pair found.
enum Measured {
    /// At least this distance, not less than the tolerance.
    Apart(f64),
    /// Leaves within tolerance.
    Within(March, Option<Memory>),
    /// Nodes within tolerance.
    Near,
}

const NONE: u32 = u32::MAX;

/// Node pairs that full searches remember: those of the nearest pair, and of what is below a few pairs for which there is no room.
const SEARCHED: usize = 1 << 15;

impl Front {
    /// A front between two bodies of at most `places` node pairs, and memory for a full traversal that remembers as many, up to a fixed size.
    pub fn new(a: Side<'_>, b: Side<'_>, places: usize) -> Self {
        // The whole tree of node pairs has one leaf for each pair of pieces.
        let leaves = a.pieces.len().saturating_mul(b.pieces.len());
        let places = places.min(leaves.saturating_mul(2)).next_multiple_of(BLOCK);
        let [root_a, root_b] = [a, b].map(|side| side.hierarchy.node(side.hierarchy.root()).oriented_box);
        let depth = a.hierarchy.depth() + b.hierarchy.depth() + 2;
        let vertex = Feature::Vertex(0);
        let features = FeaturePair { a: vertex, b: vertex };
        let blank = Memory { features, normal: DVec3::ZERO, hub: [0; 2], facet: None, admissible: None };
        Self {
            pairs: vec![Pair::of(0, 0, NONE); places],
            memories: vec![blank; places],
            wakes: WakeBoard::new(places),
            odometer: Odometer::new(root_a, root_b),
            thickness: [Thickness::of(a), Thickness::of(b)],
            awake: Vec::with_capacity(places),
            free: Vec::with_capacity(places / 2),
            fresh: 2,
            stack: Vec::with_capacity(2 * depth),
            tolerance: 0.0,
            pace: 0.0,
            jump: FRONT_JUMP * root_a.half.length().min(root_b.half.length()),
            begun: false,
            unvisited: 0,
            first_block: 0,
            was_crowded: false,
            full: Traversal::new(a, b, places.min(SEARCHED)),
        }
    }

    /// Forgets the past; the next query begins at the roots.
    pub fn clear(&mut self) {
        self.begun = false;
        self.odometer.clear();
        self.full.clear();
    }

    /// Writes to `found` every leaf pair that overlaps or is nearer than `tolerance`; `pose_ba` places a's frame in b's.
    ///
    /// a and b are those of [`Self::new`]. `found` is cleared first; of more pairs than it has room for it keeps the deepest,
    /// and the others are counted as dropped.
    pub fn within(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        tolerance: f64,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        self.within_until(a, b, pose_ba, tolerance, &Deadline::never(NoClock), found)
    }

    /// The same, as far as one gets until the deadline, and at least one pair farther than last time.
    pub fn within_until<C: Clock>(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        tolerance: f64,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        self.answer(&Query { a, b, pose_ba, tolerance, thinner_than: f64::INFINITY }, deadline, found)
    }

    /// The same, of pairs one of whose pieces is thinner than `thinner_than` (model units); the others are as overdue at the next query.
    #[allow(clippy::too_many_arguments, reason = "the six of every query, and of what it is content with")]
    pub(crate) fn thin_within_until<C: Clock>(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        tolerance: f64,
        thinner_than: f64,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        self.answer(&Query { a, b, pose_ba, tolerance, thinner_than }, deadline, found)
    }

    /// The thickness of the thinner of two pieces, model units: the least width along one of its faces' normals.
    pub(crate) fn thickness(&self, piece_a: u32, piece_b: u32) -> f64 {
        self.thickness[0].of_piece(piece_a).min(self.thickness[1].of_piece(piece_b))
    }

    /// The thickness of the thinnest piece of both bodies.
    pub(crate) fn thinnest(&self) -> f64 {
        self.thickness[0].of_all().min(self.thickness[1].of_all())
    }

    fn answer<C: Clock>(
        &mut self,
        query: &Query<'_>,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
    ) -> TraversalCounters {
        let mut counters = TraversalCounters::default();
        found.clear();
        self.full.begin_tick();
        self.move_on(query, &mut counters);
        let before = self.awake.len();
        // With nothing awake, all of the time is for what is due.
        let done = match before {
            0 => self.wake_due(query, deadline, found, &mut counters),
            _ => self.wake_due(query, &deadline.halfway(), found, &mut counters),
        };
        self.visit_awake(query, before, &deadline.halfway().halfway(), found, &mut counters);
        if !done {
            counters.postponed += self.wakes.count_below(self.blocks(), self.odometer.sum());
        }
        counters.dropped = found.dropped();
        counters
    }

    /// Every pair of pieces that was neither found nor left for a later turn is at least this far apart (model units); minus
    /// infinity when nothing is known yet. Not less than the tolerance unless the deadline has passed.
    pub fn unseen_separation(&self) -> f64 {
        let least = self.wakes.least(self.blocks());
        if least >= self.odometer.sum() {
            self.tolerance
        } else if least == 0 || self.was_crowded {
            f64::NEG_INFINITY
        } else {
            self.tolerance - self.odometer.since(least)
        }
    }

    /// How many pairs of pieces were within tolerance at their last visit and not visited by the last query.
    pub(crate) fn unvisited(&self) -> usize {
        self.unvisited
    }

    /// Place and pieces of one of them.
    pub(crate) fn unvisited_pair(&self, a: Side<'_>, b: Side<'_>, k: usize) -> (u32, [u32; 2]) {
        (self.awake[k], self.pieces(a, b, self.awake[k]))
    }

    /// Places that pairs may be remembered at.
    pub(crate) fn places(&self) -> usize {
        self.pairs.len()
    }

    /// The next query begins with the leaf pair at `place`, for which there was no time after its march.
    pub(crate) fn resume_at(&mut self, place: u32) {
        if let Some(k) = self.awake.iter().position(|&awake| awake == place) {
            self.awake.rotate_left(k);
        }
        self.unvisited = 0;
    }

    /// The nearest leaf pair of all, or an overlapping one when there is any: see [`Traversal::nearest`].
    pub fn nearest(
        &mut self,
        a: Side<'_>,
        b: Side<'_>,
        pose_ba: &Placement,
        counters: &mut TraversalCounters,
    ) -> Option<LeafPair> {
        self.full.nearest(a, b, pose_ba, counters)
    }

    /// Keeps where the pair's depth walk ended, or its march when it is apart, for the next tick's walk: the normal (b's frame), vertices that support it or nearly
    /// so, and the features that it rests on.
    pub fn remember_depth(&mut self, pair: &LeafPair, normal: DVec3, hub: [u32; 2], facet: FeaturePair) {
        match pair.home {
            Home::Nodes(a, b) => self.full.remember_depth([a, b], normal, hub, facet),
            Home::Place(place) => {
                let memory = &mut self.memories[place as usize];
                *memory = Memory { normal, hub, facet: Some(facet), ..*memory };
            }
        }
    }

    /// Keeps the features of the pair's depth along a normal that both pieces own, where its walk ended on another.
    pub fn remember_admissible(&mut self, pair: &LeafPair, admissible: Option<FeaturePair>) {
        match pair.home {
            Home::Nodes(a, b) => self.full.remember_admissible([a, b], admissible),
            Home::Place(place) => self.memories[place as usize].admissible = admissible,
        }
    }

    /// Node pairs in the tree down to the cut.
    pub fn node_pairs(&self) -> usize {
        self.fresh as usize - 2 * self.free.len() - 1
    }

    /// Step 1: what has moved since the last query is spent. A wider tolerance spends clearances just so.
    fn move_on(&mut self, query: &Query<'_>, counters: &mut TraversalCounters) {
        let moved = self.odometer.advance(query.pose_ba);
        let wider = query.tolerance - self.tolerance;
        let spent = wider <= 0.0 || self.odometer.spend(wider);
        self.tolerance = query.tolerance;
        match moved {
            Some(moved) if self.begun && spent && moved <= self.jump => {
                self.pace = self.pace * PACE_FADE + moved * (1.0 - PACE_FADE);
            }
            _ => {
                self.restart(query);
                counters.restarted = 1;
            }
        }
    }

    /// Only the pair of roots, and that due.
    fn restart(&mut self, query: &Query<'_>) {
        self.wakes.clear(self.fresh as usize);
        self.free.clear();
        self.awake.clear();
        self.fresh = 2;
        self.unvisited = 0;
        self.first_block = 0;
        self.was_crowded = false;
        self.pairs[0] = Pair::of(query.a.hierarchy.root(), query.b.hierarchy.root(), NONE);
        // A wake value of 0 is due whenever the sum is not.
        self.odometer.spend(0.0);
        self.wakes.set(0, 0);
        self.pace = 0.0;
        self.begun = true;
    }

    /// Step 3, of the first `count` pairs; those that are not visited in time come first, here and next time.
    fn visit_awake<C: Clock>(
        &mut self,
        query: &Query<'_>,
        count: usize,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) {
        let (mut kept, mut visited) = (0, 0);
        while visited < count && (visited == 0 || !deadline.passed()) {
            let place = self.awake[visited];
            visited += 1;
            if !self.is_wanted(query, place) {
                self.awake[kept] = place;
                kept += 1;
                continue;
            }
            counters.node_pairs += 1;
            counters.leaf_tests += 1;
            let (answer, memory) = self.march(query, place, counters);
            if is_contact(&answer, query.tolerance) {
                self.awake[kept] = place;
                kept += 1;
                found.push(self.leaf_pair(query, place, answer, memory), query.a, query.b, query.pose_ba);
            } else {
                // When they meet again it may be anywhere.
                self.memories[place as usize].normal = DVec3::ZERO;
                self.sleep(query, place, distance(&answer));
            }
        }
        let gone = visited - kept;
        if gone > 0 {
            self.awake.copy_within(visited.., kept);
            self.awake.truncate(self.awake.len() - gone);
        }
        self.unvisited = count - visited;
        counters.postponed += self.unvisited as u32;
        if self.unvisited > 0 {
            self.awake.rotate_left(kept);
        }
    }

    /// Step 2, and 4 where a pair goes on sleeping; false if the deadline passes before all is done.
    fn wake_due<C: Clock>(
        &mut self,
        query: &Query<'_>,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> bool {
        // Places that are taken during the round are looked at as soon as they are.
        let blocks = self.blocks();
        let first = self.first_block.min(blocks);
        for (begin, end) in [(first, blocks), (0, first)] {
            let mut block = begin;
            while let Some(next) = self.wakes.next_block(block, end, self.odometer.sum()) {
                if !self.wake_block(query, next, deadline, found, counters) {
                    self.first_block = next;
                    return false;
                }
                block = next + 1;
            }
        }
        self.first_block = 0;
        true
    }

    /// Step 2 for what is due in one block.
    fn wake_block<C: Clock>(
        &mut self,
        query: &Query<'_>,
        block: usize,
        deadline: &Deadline<C>,
        found: &mut LeafPairs,
        counters: &mut TraversalCounters,
    ) -> bool {
        let mut due = [0; BLOCK];
        let count = self.wakes.open(block, self.odometer.sum(), &mut due);
        let mut late = false;
        for &place in &due[..count] {
            self.stack.push(place);
            counters.woken += u32::from(self.is_wanted(query, place));
            while let Some(place) = self.stack.pop() {
                if !self.is_wanted(query, place) {
                    continue;
                }
                self.look(query, place, found, counters);
                late = deadline.passed();
                if late {
                    break;
                }
            }
            if late {
                break;
            }
        }
        // What is left on it is as overdue as what it was split from.
        self.stack.clear();
        if count > 0 {
            self.wakes.settle(block);
        }
        !late
    }

    /// False for a pair whose pieces are all thicker than what the query is about.
    #[inline]
    fn is_wanted(&self, query: &Query<'_>, place: u32) -> bool {
        let Pair { a, b, .. } = self.pairs[place as usize];
        query.thinner_than == f64::INFINITY
            || self.thickness[0].of_node(a).min(self.thickness[1].of_node(b)) < query.thinner_than
    }

    /// Blocks of the board that are in use.
    fn blocks(&self) -> usize {
        (self.fresh as usize).div_ceil(BLOCK)
    }

    /// Measures a pair and puts it where it belongs; its halves go onto the stack.
    fn look(&mut self, query: &Query<'_>, place: u32, found: &mut LeafPairs, counters: &mut TraversalCounters) {
        match self.measure(query, place, counters) {
            Measured::Apart(distance) => {
                self.sleep(query, place, distance);
                self.merge(query, place, counters);
            }
            Measured::Within(answer, memory) => {
                self.pairs[place as usize].state = State::Awake;
                self.wakes.set(place, NEVER);
                self.awake.push(place);
                found.push(self.leaf_pair(query, place, answer, memory), query.a, query.b, query.pose_ba);
            }
            Measured::Near if self.split(query, place) => counters.split += 1,
            Measured::Near => {
                counters.crowded += 1;
                self.was_crowded = true;
                let Pair { a, b, .. } = self.pairs[place as usize];
                self.pairs[place as usize].state = State::Crowded;
                self.wakes.set(place, self.odometer.sum());
                self.full.below(query.a, query.b, query.pose_ba, query.tolerance, [a, b], found, counters);
            }
        }
    }

    /// The pair's distance, or a bound of it from below that lets it sleep for a while: the cheaper the bound the longer must the sleep be that
    /// it promises, or the next is tried.
    fn measure(&mut self, query: &Query<'_>, place: u32, counters: &mut TraversalCounters) -> Measured {
        counters.node_pairs += 1;
        let Pair { a, b, .. } = self.pairs[place as usize];
        let (node_a, node_b) = (query.a.hierarchy.node(a), query.b.hierarchy.node(b));
        let gap = sphere_gap(&node_a.sphere, &node_b.sphere, query.pose_ba);
        if gap > query.tolerance + SPHERE_NAP * self.pace {
            return Measured::Apart(gap);
        }
        let enough = query.tolerance + BOX_NAP * self.pace;
        let gap = gap.max(box_gap(&node_a.oriented_box, &node_b.oriented_box, query.pose_ba, 2.0 * enough));
        if gap > enough {
            return Measured::Apart(gap);
        }
        let leaves = [node_a, node_b].iter().all(|node| matches!(node.kind, NodeKind::Leaf { .. }));
        counters.leaf_tests += u32::from(leaves);
        counters.hull_tests += u32::from(!leaves);
        let (answer, memory) = self.march(query, place, counters);
        match (leaves, distance(&answer)) {
            (true, _) if is_contact(&answer, query.tolerance) => Measured::Within(answer, memory),
            (false, apart) if apart <= query.tolerance => Measured::Near,
            (_, apart) => Measured::Apart(apart),
        }
    }

    fn sleep(&mut self, query: &Query<'_>, place: u32, distance: f64) {
        self.pairs[place as usize].state = State::Asleep;
        self.wakes.set(place, self.odometer.due(distance - query.tolerance));
    }

    /// Puts both halves of a pair onto the stack; false if there is no room for them.
    fn split(&mut self, query: &Query<'_>, place: u32) -> bool {
        let Pair { a, b, .. } = self.pairs[place as usize];
        let (node_a, node_b) = (query.a.hierarchy.node(a), query.b.hierarchy.node(b));
        let halves = match (node_a.kind, node_b.kind) {
            (NodeKind::Inner { left, right }, kind_b)
                if node_a.sphere.radius > node_b.sphere.radius || matches!(kind_b, NodeKind::Leaf { .. }) =>
            {
                [Pair::of(left, b, place), Pair::of(right, b, place)]
            }
            (_, NodeKind::Inner { left, right }) => [Pair::of(a, left, place), Pair::of(a, right, place)],
            _ => return false,
        };
        let Some(first) = self.take_places() else { return false };
        let wake = self.wakes.get(place);
        for (half, place) in halves.into_iter().zip([first, first + 1]) {
            self.pairs[place as usize] = half;
            // What held for the whole holds for its halves: they are as overdue.
            self.wakes.set(place, wake);
            self.stack.push(place);
        }
        self.pairs[place as usize].state = State::Split(first);
        self.wakes.set(place, NEVER);
        true
    }

    fn take_places(&mut self) -> Option<u32> {
        self.free.pop().or_else(|| {
            let first = self.fresh;
            (first as usize + 2 <= self.pairs.len()).then(|| {
                self.fresh += 2;
                first
            })
        })
    }

    /// Step 4: merges the pair with its other half as long as both sleep long and what they came from may.
    fn merge(&mut self, query: &Query<'_>, mut place: u32, counters: &mut TraversalCounters) {
        let long = MERGE_CLEARANCE * query.tolerance;
        loop {
            let parent = self.pairs[place as usize].parent;
            let until = self.odometer.due(long);
            if parent == NONE || self.wakes.get(place) < until || !self.sleeps_until(place ^ 1, until) {
                return;
            }
            let Pair { a, b, retry, .. } = self.pairs[parent as usize];
            if retry > self.odometer.sum() {
                return;
            }
            counters.node_pairs += 1;
            let (node_a, node_b) = (query.a.hierarchy.node(a), query.b.hierarchy.node(b));
            let enough = query.tolerance + long;
            let mut gap = sphere_gap(&node_a.sphere, &node_b.sphere, query.pose_ba);
            if gap <= enough {
                gap = gap.max(box_gap(&node_a.oriented_box, &node_b.oriented_box, query.pose_ba, enough));
            }
            if gap <= enough {
                self.pairs[parent as usize].retry = self.odometer.due((enough - gap).max(MERGE_RETRY * long));
                return;
            }
            counters.merged += 1;
            let first = place & !1;
            self.wakes.set(first, NEVER);
            self.wakes.set(first + 1, NEVER);
            self.free.push(first);
            self.sleep(query, parent, gap);
            place = parent;
        }
    }

    fn sleeps_until(&self, place: u32, sum: u64) -> bool {
        self.pairs[place as usize].state == State::Asleep && self.wakes.get(place) >= sum
    }

    /// Marches a pair from where it ended last, or cold.
    fn march(&mut self, query: &Query<'_>, place: u32, counters: &mut TraversalCounters) -> (March, Option<Memory>) {
        let pair = &mut self.pairs[place as usize];
        let (polytope_a, polytope_b) = (query.a.polytope(pair.a), query.b.polytope(pair.b));
        let memory = &mut self.memories[place as usize];
        let before = pair.known.then_some(*memory);
        let start = before.map_or_else(|| initial_features(polytope_a, polytope_b, query.pose_ba), |m| m.features);
        let answer = march(polytope_a, polytope_b, query.pose_ba, start);
        if !pair.known {
            *memory = Memory { normal: DVec3::ZERO, facet: None, admissible: None, ..*memory };
            pair.known = true;
        }
        memory.features = answer.features;
        counters.march_steps += answer.steps;
        counters.march_fallbacks += u32::from(answer.stop != StopReason::Converged);
        (answer, before)
    }

    fn leaf_pair(&self, query: &Query<'_>, place: u32, answer: March, memory: Option<Memory>) -> LeafPair {
        let [piece_a, piece_b] = self.pieces(query.a, query.b, place);
        LeafPair { piece_a, piece_b, home: Home::Place(place), proximity: answer.proximity, memory }
    }

    /// Those of a pair of leaves.
    fn pieces(&self, a: Side<'_>, b: Side<'_>, place: u32) -> [u32; 2] {
        let pair = self.pairs[place as usize];
        [(a, pair.a), (b, pair.b)].map(|(side, node)| match side.hierarchy.node(node).kind {
            NodeKind::Leaf { piece } => piece,
            NodeKind::Inner { .. } => unreachable!("only leaves are awake"),
        })
    }
}

impl Pair {
    fn of(a: u32, b: u32, parent: u32) -> Self {
        Self { a, b, parent, state: State::Asleep, known: false, retry: 0 }
    }
}

fn is_contact(answer: &March, tolerance: f64) -> bool {
    matches!(answer.proximity, Proximity::Overlapping(_)) || distance(answer) < tolerance
}
