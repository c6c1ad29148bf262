//! All contacts of two bodies within the tolerance \[K02 §3.4, §4.1\].
//!
//! 1. The front over both hierarchies ([`Front`]) returns the leaf pairs within the tolerance.
//! 2. Pieces that are apart have a contact at their closest points, if these points are on the
//!    surface and their direction is a normal of both meshes there ([`Body::admits`]). Beyond the
//!    end of an edge's Gauss arc, the neighbouring piece is nearer. If the settings request
//!    patches, the contact may also lie beyond the end of a piece (`apart`).
//! 3. Pieces that overlap have a contact at their penetration depth. The depth walk starts from the
//!    pair's last normal, the normal of the march and the line of centroids. If the walk ends on a
//!    normal that one of the meshes does not have, the least depth along a shared normal is used
//!    instead ([`admissible_depth`](crate::depth::admissible_depth)). The walk is skipped as long
//!    as the normal of the last walk shows that it would end so again. The contact is left out if
//!    the check of `confirm` rejects its depth, or if the pieces share no normal. If a body is
//!    open, the contact is also left out if it is deeper than the motion since the last query
//!    allows. If the bodies overlap and no depth is accepted, the query adds a replacement contact,
//!    from a witness point to the nearest surface.
//!
//! With [`Proof::Prove`], the query proves that each depth is the global minimum for its pair of
//! pieces, or replaces it by a proven depth. The proof comes before a depth is moved to a normal of
//! the meshes. A moved depth is therefore larger than the proven minimum.
//!
//! If the pose has jumped since the last query, or if a pair begins to overlap, its depth is
//! computed without cached data and with a proof ([`depth`](crate::depth::depth)).
//!
//! A pair of pieces has one contact at its exact witness points. If the settings request patches,
//! it has one contact for each corner of its *patch* ([`Patch`]), the region in which flush
//! features touch. A flat face may consist of several pieces. If another face is nearly flush with
//! it, each pair of their pieces that are apart has a patch, although the closest points of most
//! pairs lie inside the flat face, in a direction that is not its normal.
//!
//! Contacts are in the order in which they began; after a jump, in the order of the descent. The
//! same sequence of poses gives the same order.
//!
//! Where both bodies have many pieces, the query is divided into *parts* ([`Part`]), one for each
//! of a few nodes of the smaller body. Threads of the caller can compute parts at the same time
//! ([`Helper`]). The parts do not depend on the number of threads, and their contacts are joined in
//! a fixed order, so the results have the same bits for any number of threads.

mod divide;
mod quotas;

use std::sync::Arc;

use self::divide::divide;
use super::confirm::{LastOverlap, no_deeper, replacement};
use super::exact::{Placed, on_meshes};
use super::guard::Guard;
use super::part::{Part, PartSearch, RejectedContacts, Task};
use super::plane::PlaneSearch;
use super::query_input::{QueryInput, side};
use super::sample::Sample;
use super::{Contact, QueryCounters, QuerySettings};
use crate::algebra::tolerance::{CONFIRMED_SHARE, HELPED_WORK, NEW_PAIRS, REST_ALL, REST_FROM, WORK_ANSWER};
use crate::algebra::{Clock, Placement, Pose, Quota, Rounds};
use crate::body::Body;
use crate::collision::Thickness;

/// The parts of the queries between two bodies, and the data that all parts share.
#[derive(Debug)]
pub(super) struct Search {
    parts: Arc<Rounds<Part>>,
    /// Units of work of each part in the last query.
    costs: Vec<u64>,
    /// Units of work of the answer of a leaf pair in the last query, on average.
    answer_cost: u64,
    /// Largest number of contacts of a query.
    capacity: usize,
    contacts: Vec<Contact>,
    pub(super) last_pose: Option<Pose>,
    last_overlap: LastOverlap,
    /// The motion bound's sum in the last query. `None` without a last query.
    last_sum: Option<u64>,
    /// True if the last query saw all pairs.
    saw_all: bool,
    pub(super) guard: Option<Guard>,
    /// True if the parts have memory for contacts of earlier queries.
    holding: bool,
    sample: Sample,
    /// Measure of the number of touching pairs in the last query, from 0 (few) to 1 (many).
    rest_share: f64,
    /// Number of pairs of pieces in the last query that touched, and that were within tolerance.
    touching: u32,
    within: u32,
    /// True if a contact of the last query pressed.
    pressing: bool,
    unseen_separation: f64,
    unexamined: f64,
    pub(super) plane: PlaneSearch,
}

/// Capacity of the front, in node pairs. A spoon in a cup has hundreds, two scans of 30 000
/// triangles have some thousands, and a nut on its thread has some ten thousands.
const NODE_PAIRS: usize = 1 << 17;

/// Capacity of the front of a query with little memory, relative to the number of pieces of both
/// bodies. A nut that turns on its thread has up to 25 at a tolerance of 0.6 mm, and 40 at 1 mm.
const PAIRS_PER_PIECE: usize = 48;

/// Largest capacity of the front of a query with little memory, in node pairs.
const MOST_SMALL: usize = 4 * NODE_PAIRS;

/// How many times as much room the parts of a divided query have together as a query in one part,
/// since the contacts may not be spread evenly over the parts.
const PART_ROOM: usize = 4;

impl Search {
    /// Allocates memory for queries with these settings.
    pub(super) fn new(a: &Arc<Body>, b: &Arc<Body>, settings: &QuerySettings) -> Self {
        Self::of_parts(a, b, settings, &divide(a, b, settings), NODE_PAIRS)
    }

    /// Allocates less memory, for a query in one part.
    pub(super) fn small(a: &Arc<Body>, b: &Arc<Body>, settings: &QuerySettings) -> Self {
        let pieces = a.polytopes().len() + b.polytopes().len();
        let nodes = [[a.hierarchy().root(), b.hierarchy().root()]];
        Self::of_parts(a, b, settings, &nodes, MOST_SMALL.min(pieces.saturating_mul(PAIRS_PER_PIECE)))
    }

    /// Allocates memory for a query in one part for each pair of `nodes`, with at most `places`
    /// node pairs.
    fn of_parts(a: &Arc<Body>, b: &Arc<Body>, settings: &QuerySettings, nodes: &[[u32; 2]], places: usize) -> Self {
        let capacity = settings.capacity.max(1);
        let sample = Sample::new(a, b);
        let thickness = Arc::new([Thickness::of(side(a)), Thickness::of(side(b))]);
        let room = if nodes.len() == 1 { 1 } else { PART_ROOM };
        let of_part = |most: usize| (room * most).div_ceil(nodes.len());
        let part = |&nodes: &[u32; 2]| {
            let room = [of_part(places), of_part(capacity)];
            Part::new(a, b, settings, PartSearch::new(a, b, settings, nodes, room, &sample, &thickness))
        };
        Self {
            parts: Arc::new(Rounds::new(nodes.iter().map(part).collect())),
            costs: vec![0; nodes.len()],
            answer_cost: WORK_ANSWER,
            capacity,
            contacts: Vec::with_capacity(capacity),
            last_pose: None,
            last_overlap: LastOverlap::default(),
            last_sum: None,
            saw_all: false,
            guard: settings.guard.then(|| Guard::new(capacity)),
            holding: settings.holding,
            sample,
            rest_share: 0.0,
            touching: 0,
            within: 0,
            pressing: false,
            unseen_separation: f64::INFINITY,
            unexamined: f64::INFINITY,
            plane: PlaneSearch::default(),
        }
    }

    /// Returns the parts for helper threads; `None` if the query is not divided.
    pub(super) fn parts(&self) -> Option<&Arc<Rounds<Part>>> {
        (self.costs.len() > 1).then_some(&self.parts)
    }

    /// Sets the angle (rad) of [`QuerySettings::patch_angle`].
    pub(super) fn set_patch_angle(&mut self, angle: Option<f64>) {
        self.parts.each(|part| part.search.set_patch_angle(angle));
    }

    /// Finds the contacts; see [`ContactQuery::run_within`](super::ContactQuery::run_within).
    pub(super) fn run(&mut self, input: &QueryInput<'_>, quota: &Quota<'_>, clock: &impl Clock) -> QueryCounters {
        let begin = clock.now_ns();
        self.begin(input, quota);
        let mut counters = QueryCounters::default();
        let thin = self.sub_steps(input, &mut counters);
        self.move_to(input, thin);
        if counters.sub_steps > 0 {
            self.set(Task::Descend, &input.pose_ba);
        }
        self.round();
        self.visit_due(input, quota, &mut counters);
        self.begin_answers(input);
        let middle = clock.now_ns();
        self.round();
        let (rejected, touching) = self.join(quota, &mut counters);
        self.learn_answer_cost();
        self.plane.end(&input.place);
        self.sample.keep(&self.contacts, input.tolerance, self.rest_share > 0.0);
        let deepest = self.contacts.iter().map(|contact| contact.separation).fold(f64::INFINITY, f64::min);
        self.sample.set_floor(deepest, &input.range());
        self.pressing = deepest < input.range().offset;
        self.touching = touching;
        self.set_touching(self.expected_touching(touching, counters.unseen));
        self.hold_overlap(input, &rejected, &mut counters);
        let all = self.contacts.len();
        self.contacts.retain(Contact::is_finite);
        counters.non_finite += (all - self.contacts.len()) as u32;
        self.last_overlap.keep(&self.contacts, &input.place);
        self.last_sum = Some(self.parts.with_first(|part| part.search.front.motion_sum()));
        self.saw_all = counters.traversal.postponed == 0;
        if counters.sub_steps > 0 {
            self.compare_sides();
        }
        if let Some(guard) = &mut self.guard {
            counters.kept_side = guard.hold(input, &mut self.contacts);
        }
        counters.query_ns = middle - begin;
        counters.depth_ns = clock.now_ns() - middle;
        counters
    }

    /// Gives each part the input of the query, its first share of the quota, and what it needs from
    /// the last query.
    fn begin(&mut self, input: &QueryInput<'_>, quota: &Quota<'_>) {
        self.sample.set_tolerance(input.tolerance);
        let mut k = 0;
        self.parts.each(|part| {
            part.work = self.first_limit(quota, k);
            part.input = (input.pose_ba, *input.settings);
            part.task = Task::Descend;
            part.counters = QueryCounters::default();
            part.search.begin(&self.sample, self.rest_share, self.last_overlap.depth());
            part.search.set_turn(input.settings.turn);
            k += 1;
        });
    }

    /// Sets the task of all parts, and the pose.
    pub(super) fn set(&mut self, task: Task, pose_ba: &Pose) {
        self.parts.each(|part| {
            part.task = task;
            part.input.0 = *pose_ba;
        });
    }

    /// Does [`ContactQuery::use_all_memory`](super::ContactQuery::use_all_memory).
    pub(super) fn use_all_memory(&mut self) {
        self.parts.each(|part| part.search.use_all_memory());
    }

    /// Runs the task of all parts. Helpers take part if the last query had much work. Parts with
    /// much work are first, so that threads finish at about the same time.
    pub(super) fn round(&mut self) {
        if self.costs.len() == 1 || self.costs.iter().sum::<u64>() < HELPED_WORK {
            self.parts.run_alone();
        } else {
            self.parts.run(|part| self.costs[part]);
        }
    }

    /// Returns true if all parts have spent the quota of sub-steps.
    pub(super) fn are_sub_steps_spent(&self) -> bool {
        let mut spent = true;
        self.parts.each(|part| spent &= part.work.first_half().is_spent());
        spent
    }

    /// Joins the contacts of all parts at an intermediate pose.
    pub(super) fn join_sub_step(&mut self) {
        let Self { parts, contacts, capacity, .. } = self;
        contacts.clear();
        parts.each(|part| contacts.extend(part.search.contacts.iter().take(*capacity - contacts.len())));
    }

    /// Prepares the answers. If many pairs have come within the tolerance since the last query, the
    /// size of the sample is set before these pairs are measured: if a flat face lands on another,
    /// a thousand pairs begin to touch in one query.
    fn begin_answers(&mut self, input: &QueryInput<'_>) {
        let mut restarted = false;
        self.parts.each(|part| restarted |= part.counters.traversal.restarted > 0);
        let [within, due] = self.within_and_due();
        if restarted {
            (self.touching, self.within, self.pressing) = (0, 0, false);
        }
        // A depth in a closed body is confirmed by a point inside, so it needs no bound.
        let deepest = if input.is_open() { self.deepest_possible(input, restarted) } else { f64::INFINITY };
        self.parts.each(|part| part.search.deepest = deepest);
        let new = within.saturating_sub(self.within);
        let most = self.touching + new;
        self.within = within;
        let many = f64::from(new) > NEW_PAIRS * f64::from(within) && expected(most, within, due) > REST_FROM;
        if self.holding && (restarted || many) {
            let mut touching = 0;
            self.parts.each(|part| touching += part.search.may_touch(input));
            self.set_touching(expected(touching.min(most), within, due));
            let (sample, rest_share) = (&self.sample, self.rest_share);
            self.parts.each(|part| part.search.set_sample(sample, rest_share));
        }
    }

    /// Returns an upper bound of the depths of this query, model units. Infinite if the last query
    /// did not see everything.
    fn deepest_possible(&self, input: &QueryInput<'_>, restarted: bool) -> f64 {
        if !self.saw_all {
            return f64::INFINITY;
        }
        self.last_depth_grown(restarted) / CONFIRMED_SHARE + input.range().offset
    }

    /// Returns the depth of the last query and the motion since then, model units. Infinite without
    /// a last query.
    fn last_depth_grown(&self, restarted: bool) -> f64 {
        match self.last_sum {
            Some(sum) if !restarted => {
                let motion = self.parts.with_first(|part| part.search.front.motion_since(sum));
                self.last_overlap.depth() + motion
            }
            _ => f64::INFINITY,
        }
    }

    /// Joins the results of all parts. Returns the shallowest depths that were not accepted, and
    /// the number of pairs in contact.
    fn join(&mut self, quota: &Quota<'_>, counters: &mut QueryCounters) -> (RejectedContacts, u32) {
        let Self { parts, contacts, costs, capacity, .. } = self;
        contacts.clear();
        let (mut rejected, mut touching, mut k) = (RejectedContacts::default(), 0, 0);
        let (mut unseen, mut unexamined) = (f64::INFINITY, f64::INFINITY);
        parts.each(|part| {
            let search = &part.search;
            let room = *capacity - contacts.len();
            counters.traversal.dropped += search.contacts.len().saturating_sub(room) as u32;
            contacts.extend(search.contacts.iter().take(room));
            touching += search.touching + search.front.represented();
            rejected.add(&part.rejected);
            *counters += part.counters;
            unseen = unseen.min(search.unseen_separation);
            if part.counters.traversal.postponed > 0 {
                unexamined = unexamined.min(search.front.unseen_separation());
            }
            costs[k] = part.work.spent();
            quota.spend(costs[k]);
            k += 1;
        });
        counters.traversal.restarted = counters.traversal.restarted.min(1);
        if let Some(plane) = &self.plane.found {
            unexamined = unexamined.max(plane.gap);
        }
        (self.unseen_separation, self.unexamined) = (unseen.min(unexamined), unexamined);
        (rejected, touching)
    }

    /// Returns the number of touching pairs if the pairs without a result touch as often as the
    /// others: due pairs, and `unseen` of the leaf pairs that were found. `touching` of the others
    /// have a contact.
    fn expected_touching(&self, touching: u32, unseen: u32) -> f64 {
        let [within, due] = self.within_and_due();
        expected(touching, within.saturating_sub(unseen), unseen + due)
    }

    /// Returns the number of leaf pairs within the tolerance that were found, and the number of due
    /// pairs that were not visited.
    fn within_and_due(&self) -> [u32; 2] {
        let [mut within, mut due] = [0; 2];
        self.parts.each(|part| {
            within += part.search.within();
            due += part.search.front.still_due();
        });
        [within, due]
    }

    /// Sets how long pairs rest, and the size of the sample, by the number of touching pairs. The
    /// size changes gradually if a contact presses, and at once otherwise.
    fn set_touching(&mut self, touching: f64) {
        if self.holding {
            self.rest_share = ((touching - REST_FROM) / (REST_ALL - REST_FROM)).clamp(0.0, 1.0);
            self.sample.set_touching(touching, !self.pressing);
        }
    }

    /// How far the bodies move relative to each other up to this query, and the thickness of the
    /// thinnest piece, both in model units.
    pub(super) fn motion_to(&self, input: &QueryInput<'_>) -> Option<(f64, f64)> {
        self.parts.with_first(|part| {
            let front = &mut part.search.front;
            Some((front.motion_to(&input.place)?, front.thinnest()))
        })
    }

    /// Lists the last contacts of pieces thinner than `thin` (model units) that tunnel from the
    /// pose `last` to this query.
    pub(super) fn trace(&mut self, input: &QueryInput<'_>, thin: f64, last: &Placement) {
        let (Some(guard), contacts) = (&mut self.guard, &self.contacts) else { return };
        self.parts.with_first(|part| {
            let front = &part.search.front;
            let is_thin = |contact: &&Contact| front.thickness(contact.piece_a, contact.piece_b) < thin;
            guard.trace(input, contacts.iter().filter(is_thin), last);
        });
    }

    /// Lists the pairs whose normal has reversed since the last pose.
    pub(super) fn compare_sides(&mut self) {
        if let Some(guard) = &mut self.guard {
            guard.compare(&self.contacts);
        }
    }

    /// Adds a replacement contact if the bodies overlap and no depth is accepted. The contact
    /// replaces a rejected depth, the last overlap, or a depth along a normal that is not shared.
    fn hold_overlap(&mut self, input: &QueryInput<'_>, rejected: &RejectedContacts, counters: &mut QueryCounters) {
        if self.contacts.iter().any(|contact| contact.separation <= 0.0) {
            return;
        }
        let contradicted = rejected.contradicted.map(|contact| {
            replacement(input, &contact).unwrap_or_else(|| {
                let restarted = counters.traversal.restarted > 0;
                no_deeper(&contact, self.last_depth_grown(restarted))
            })
        });
        let still = || self.last_overlap.still(input).filter(|_| counters.traversal.postponed == 0);
        let replaced = contradicted.or_else(still).or_else(|| replacement(input, &rejected.unshared?));
        // The query never exceeds the memory of its construction. If this memory is full of
        // contacts that are apart, these contacts keep the bodies apart.
        let room = self.capacity - self.contacts.len();
        counters.stood_in += u32::from(replaced.is_some() && room > 0);
        self.contacts.extend(replaced.into_iter().take(room));
    }

    /// See [`ContactQuery::unseen_separation`](super::ContactQuery::unseen_separation).
    pub(super) fn unseen_separation(&self) -> f64 {
        self.unseen_separation
    }

    /// See [`ContactQuery::unexamined_separation`](super::ContactQuery::unexamined_separation).
    pub(super) fn unexamined_separation(&self) -> f64 {
        self.unexamined
    }

    /// Returns the contacts of the last query.
    pub(super) fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Returns the nearest pair of points at any distance, or the deepest contact. `input` is the
    /// input of the last [`Self::run`]. A distance is that of the meshes (`exact`).
    pub(super) fn nearest(&mut self, input: &QueryInput<'_>, counters: &mut QueryCounters) -> Option<Contact> {
        let meshes = Placed { a: input.a, b: input.b, place: &input.place };
        let least = |x: &&Contact, y: &&Contact| x.separation.total_cmp(&y.separation);
        let contact = self.contacts.iter().min_by(least).and_then(|contact| on_meshes(&meshes, contact, f64::INFINITY));
        if contact.is_some_and(|contact| contact.separation <= 0.0) {
            return contact;
        }
        let mut nearest: Option<Contact> = None;
        self.parts.each(|part| {
            let found = part.search.nearest(input, counters);
            nearest = nearest.into_iter().chain(found).min_by(|x, y| x.separation.total_cmp(&y.separation));
        });
        // If both are equally near, return the contact, since its features belong to the mesh.
        match (contact, nearest) {
            (Some(c), Some(n)) if c.separation <= n.separation => Some(c),
            (c, n) => n.or(c),
        }
    }

    /// See [`super::ContactQuery::came_from`].
    pub(super) fn came_from(&mut self, pose_ba: &Pose) {
        self.forget();
        self.parts.each(|part| part.search.forget_contacts());
        self.last_pose = Some(*pose_ba);
    }

    /// Drops all cached data.
    pub(super) fn clear(&mut self) {
        self.forget();
        self.parts.each(|part| part.search.clear());
        self.last_pose = None;
    }

    /// Drops the contacts of the last query that all parts share.
    fn forget(&mut self) {
        self.contacts.clear();
        self.sample.clear();
        if let Some(guard) = &mut self.guard {
            guard.clear();
        }
        self.last_overlap.clear();
        self.plane.clear();
        (self.last_sum, self.saw_all) = (None, false);
    }
}

impl Clone for Search {
    /// The copy has parts of its own, without helpers.
    fn clone(&self) -> Self {
        let Self { costs, contacts, last_overlap, guard, sample, .. } = self;
        Self {
            parts: Arc::new(Rounds::clone(&self.parts)),
            costs: costs.clone(),
            contacts: contacts.clone(),
            last_overlap: *last_overlap,
            guard: guard.clone(),
            sample: sample.clone(),
            ..*self
        }
    }
}

/// Returns the number of touching pairs among all pairs, if `touching` of the `seen` pairs touch
/// and the `unseen` pairs touch as often.
fn expected(touching: u32, seen: u32, unseen: u32) -> f64 {
    f64::from(touching) * (1.0 + f64::from(unseen) / f64::from(seen.max(1)))
}
