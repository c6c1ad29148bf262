//! The search of one part of a query: the leaf pairs below some pairs of nodes, and their contacts.
//!
//! A part has its own front, working memory and cached data. What depends on all contacts of the
//! query (the sample, the length of rests, the depth of the overlap) is copied into each part
//! before a query ([`PartSearch::begin`]).

use std::sync::Arc;

use super::clear::ClearBalls;
use super::confirm::{accepted, is_at_surfaces};
use super::exact::{Placed, nearest_on_meshes, slack};
use super::found::{Found, at_closest};
use super::held::HeldContacts;
use super::prover::Prover;
use super::query_input::{QueryInput, side};
use super::sample::Sample;
use super::{Contact, Proof, QueryCounters, QuerySettings};
use crate::algebra::tolerance::{WORK_ANSWER, WORK_BOUND};
use crate::algebra::{Job, Pose, Quota, Work};
use crate::body::Body;
use crate::collision::{Front, LeafPairs, PlacedPair, Proximity, Thickness};
use crate::depth::{AdmissibleScratch, DepthScratch, Patch};

/// A part of a query as a job: its search, the input of the query, and its results.
#[derive(Debug)]
pub(super) struct Part {
    a: Arc<Body>,
    b: Arc<Body>,
    /// The pose of a in b's frame, and the settings, of the query.
    pub(super) input: (Pose, QuerySettings),
    pub(super) task: Task,
    pub(super) work: Work,
    /// Units of work of the query's answers.
    pub(super) answer_work: u64,
    pub(super) search: PartSearch,
    pub(super) counters: QueryCounters,
    pub(super) rejected: RejectedContacts,
}

/// The work of a part in the present round.
#[derive(Clone, Copy, Debug)]
pub(super) enum Task {
    /// The contacts of pieces thinner than this (model units), at an intermediate pose.
    SubStep { thin: f64 },
    /// The leaf pairs within the tolerance.
    Descend,
    /// More of these leaf pairs, from pairs that are still due.
    GoOn,
    /// Bounds of the pairs that are still due.
    Bound,
    /// Splits of pairs that will soon be near.
    Prepare,
    /// The contacts of these leaf pairs.
    Answer,
}

impl Part {
    /// Returns a part for the leaf pairs below the pair of `nodes`.
    pub(super) fn new(a: &Arc<Body>, b: &Arc<Body>, settings: &QuerySettings, search: PartSearch) -> Self {
        Self {
            a: a.clone(),
            b: b.clone(),
            input: (Pose::IDENTITY, *settings),
            task: Task::Descend,
            work: Work::unlimited(),
            answer_work: 0,
            search,
            counters: QueryCounters::default(),
            rejected: RejectedContacts::default(),
        }
    }
}

impl Job for Part {
    fn run(&mut self) {
        let (pose_ba, settings) = &self.input;
        let input = QueryInput::new(&self.a, &self.b, pose_ba, settings);
        let (search, counters) = (&mut self.search, &mut self.counters);
        match self.task {
            Task::SubStep { thin } => search.sub_step(&input, thin, &self.work.first_half(), counters),
            Task::Descend => {
                let quota = self.work.all();
                counters.traversal = search.front.within_quota(&input.placed(), &quota, &mut search.leaves);
            }
            Task::GoOn => {
                let quota = self.work.all();
                search.front.go_on(&input.placed(), &quota, &mut search.leaves, &mut counters.traversal);
            }
            Task::Bound => {
                let quota = self.work.all();
                search.front.bound_due(&input.placed(), &quota, &mut search.leaves, &mut counters.traversal);
            }
            Task::Prepare => {
                search.front.prepare(&input.placed(), &self.work.all(), &mut counters.traversal);
            }
            Task::Answer => {
                let before = self.work.spent();
                self.rejected = search.answer(&input, &self.work.all(), counters);
                self.answer_work = self.work.spent() - before;
            }
        }
    }
}

impl Clone for Part {
    /// Between queries, only the search has data that is used again.
    fn clone(&self) -> Self {
        Self::new(&self.a, &self.b, &self.input.1, self.search.clone())
    }
}

/// Working memory of the search, and data cached from query to query.
#[derive(Clone, Debug)]
pub(super) struct PartSearch {
    pub(super) front: Front,
    /// Largest number of contacts of a query.
    pub(super) capacity: usize,
    pub(super) leaves: LeafPairs,
    pub(super) contacts: Vec<Contact>,
    pub(super) scratch: DepthScratch,
    pub(super) admissible: AdmissibleScratch,
    pub(super) prover: Option<Box<Prover>>,
    pub(super) patch_slope: Option<f64>,
    /// Pairs are idle for turns up to this ([`QuerySettings::turn`]), rad.
    pub(super) idle_turn: f64,
    pub(super) patch: Patch,
    pub(super) held: HeldContacts,
    clear_balls: ClearBalls,
    /// The sample of all parts.
    pub(super) sample: Sample,
    /// Depth of the last overlap, model units; 0 if the bodies did not overlap.
    pub(super) overlap: f64,
    /// Deeper contacts are impossible in this query, model units.
    pub(super) deepest: f64,
    /// Number of leaf pairs that the current query has answered.
    pub(super) answered: u64,
    /// Number of pairs with contacts in the current query.
    pub(super) touching: u32,
    /// Measure of the number of touching pairs in the last query, from 0 (few) to 1 (many).
    pub(super) rest_share: f64,
    /// The leaf pair with which the next query begins, if the quota was spent.
    pub(super) resume: Option<u32>,
    pub(super) unseen_separation: f64,
}

impl PartSearch {
    /// Allocates memory for the search below the pair of `nodes`, for `places` pairs of nodes and
    /// `capacity` contacts. `sample` and `thickness` belong to a and b.
    pub(super) fn new(
        a: &Body,
        b: &Body,
        settings: &QuerySettings,
        nodes: [u32; 2],
        [places, capacity]: [usize; 2],
        sample: &Sample,
        thickness: &Arc<[Thickness; 2]>,
    ) -> Self {
        let front = Front::below(side(a), side(b), nodes, places, thickness);
        let held = if settings.holding { HeldContacts::new(front.places(), capacity) } else { HeldContacts::default() };
        Self {
            front,
            capacity,
            leaves: LeafPairs::new(capacity),
            contacts: Vec::with_capacity(capacity),
            scratch: DepthScratch::new(),
            admissible: AdmissibleScratch::new(a.admissible(), b.admissible()),
            prover: (settings.proof == Proof::Prove).then(|| Box::new(Prover::new())),
            patch_slope: settings.patch_angle.map(f64::tan),
            idle_turn: 0.0,
            patch: Patch::new(),
            held,
            clear_balls: ClearBalls::new(),
            sample: sample.another(),
            overlap: 0.0,
            deepest: f64::INFINITY,
            answered: 0,
            touching: 0,
            rest_share: 0.0,
            resume: None,
            unseen_separation: f64::INFINITY,
        }
    }

    /// Writes to the memory of all pairs of nodes.
    pub(super) fn use_all_memory(&mut self) {
        self.front.use_all_places();
        self.held.use_all_places();
    }

    /// Sets what the next query gets from all parts of the last query: the sample, the share of
    /// rests, and the depth of the overlap (model units).
    pub(super) fn begin(&mut self, sample: &Sample, rest_share: f64, overlap: f64) {
        self.sample.copy(sample);
        self.rest_share = rest_share;
        self.front.represent_above(sample.floor(), sample.is_large(), sample.has_receded());
        self.front.set_rest_share(rest_share);
        self.overlap = overlap;
    }

    /// Changes the sample and the share of rests in a query, before its measurements. Any pair may
    /// then be represented.
    pub(super) fn set_sample(&mut self, sample: &Sample, rest_share: f64) {
        self.sample.copy(sample);
        self.rest_share = rest_share;
        self.front.represent_above(f64::NEG_INFINITY, sample.is_large(), false);
    }

    /// Returns the number of pairs within the tolerance.
    pub(super) fn within(&self) -> u32 {
        let [_, unvisited] = self.front.unvisited();
        (self.leaves.as_slice().len() + unvisited) as u32 + self.front.represented() + self.front.idle()
    }

    /// Finds the contacts of the leaf pairs, and extrapolates those that the query did not visit.
    fn answer(&mut self, input: &QueryInput<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) -> RejectedContacts {
        self.held.begin_tick();
        self.unseen_separation = f64::INFINITY;
        let rejected = self.answer_leaves(input, quota, counters);
        self.hold_unvisited(input, counters);
        rejected
    }

    /// Finds the contacts of thin pieces at an intermediate pose, until the quota is spent.
    fn sub_step(&mut self, input: &QueryInput<'_>, thin: f64, quota: &Quota<'_>, counters: &mut QueryCounters) {
        self.contacts.clear();
        if quota.is_spent() {
            return;
        }
        let placed = PlacedPair { thinner_than: thin, ..input.placed() };
        self.front.within_quota(&placed, quota, &mut self.leaves);
        let leaves = std::mem::take(&mut self.leaves);
        for leaf in leaves.as_slice() {
            let before = counters.work();
            let found = self.contact(input, leaf, counters);
            self.contacts.extend(accepted(input, &found, &mut self.clear_balls));
            quota.spend(WORK_ANSWER + counters.work() - before);
        }
        self.leaves = leaves;
    }

    /// Finds the contacts of the leaf pairs until the quota is spent. Returns the shallowest
    /// depths that were not accepted.
    fn answer_leaves(
        &mut self,
        input: &QueryInput<'_>,
        quota: &Quota<'_>,
        counters: &mut QueryCounters,
    ) -> RejectedContacts {
        self.contacts.clear();
        let mut rejected = RejectedContacts::default();
        let rests = self.rest_share > 0.0;
        self.touching = 0;
        let sampled = self.begin_sampled();
        let leaves = std::mem::take(&mut self.leaves);
        let count = leaves.as_slice().len();
        self.answered = count as u64;
        let mut spent = counters.work();
        for (k, leaf) in leaves.as_slice().iter().enumerate() {
            if k > 0 && quota.is_spent() {
                self.hold_the_rest(input, leaves.as_slice(), k, counters);
                self.answered = k as u64;
                break;
            }
            if k >= sampled {
                if k == sampled && self.sample.is_blank() {
                    self.sample.keep(&self.contacts, input.tolerance, rests);
                }
                if let Some((bound, separation)) = self.representation(input, leaf) {
                    self.front.represent(&input.placed(), leaf, &bound, separation);
                    counters.represented += 1;
                    quota.spend(WORK_BOUND);
                    continue;
                }
            }
            let known = self.contacts.len();
            let foretold = if rests { self.foretell(input, leaf) } else { None };
            let found = self.contact(input, leaf, counters);
            match found {
                Found::Nothing => {
                    counters.virtual_closest += 1;
                    if let Proximity::Disjoint(closest) = &leaf.proximity {
                        self.make_idle(input, leaf, closest);
                    }
                }
                Found::Admissible(contact) | Found::Moved(contact, _) if -contact.separation > self.deepest => {
                    counters.rejected += 1;
                }
                Found::NearlyFlush(contact) | Found::BesideValley(contact) => self.contacts.push(contact),
                Found::Admissible(contact) | Found::Moved(contact, _) => {
                    if let Some(contact) = accepted(input, &found, &mut self.clear_balls) {
                        self.contacts.push(contact);
                    } else {
                        counters.rejected += 1;
                        if is_at_surfaces(input, &contact) {
                            rejected.contradicted = shallower(rejected.contradicted, contact);
                        }
                    }
                }
                Found::Inadmissible(contact) => {
                    counters.inadmissible += 1;
                    rejected.unshared =
                        contact.map_or(rejected.unshared, |contact| shallower(rejected.unshared, contact));
                }
            }
            if k >= sampled && self.represent_measured(input, leaf, known) {
                counters.represented += 1;
                spent = counters.work();
                continue;
            }
            self.sample.weigh(&mut self.contacts[known..], &input.range());
            self.touching += u32::from(self.contacts.len() > known);
            self.keep(input, leaf, [known, count - k - 1], &found, counters);
            if rests {
                self.rest(input, leaf, known, foretold);
            }
            let work = counters.work();
            quota.spend(WORK_ANSWER + work - spent);
            spent = work;
        }
        self.leaves = leaves;
        rejected
    }

    /// Returns the part's nearest pair of points at any distance, or the depth of an overlap. A
    /// distance is that of the meshes (`exact`).
    pub(super) fn nearest(&mut self, input: &QueryInput<'_>, counters: &mut QueryCounters) -> Option<Contact> {
        self.front.nearest(&input.placed(), slack(input.a, input.b), &mut self.leaves, &mut counters.traversal);
        let overlap = self.leaves.as_slice().iter().find(|leaf| matches!(leaf.proximity, Proximity::Overlapping(_)));
        match overlap.copied() {
            Some(leaf) => match self.contact(input, &leaf, counters) {
                Found::Admissible(contact) | Found::Moved(contact, _) => Some(contact),
                Found::Inadmissible(contact) => contact,
                Found::NearlyFlush(_) | Found::BesideValley(_) | Found::Nothing => None,
            },
            None => {
                let apart = self.leaves.as_slice().iter().filter_map(|leaf| match leaf.proximity {
                    Proximity::Disjoint(closest) => Some(at_closest(leaf, &closest)),
                    Proximity::Overlapping(_) => None,
                });
                nearest_on_meshes(&Placed { a: input.a, b: input.b, place: &input.place }, apart)
            }
        }
    }

    /// Drops the contacts of the last query.
    pub(super) fn forget_contacts(&mut self) {
        self.contacts.clear();
        self.held.clear();
        self.front.end_rests();
    }

    /// Drops all cached data.
    pub(super) fn clear(&mut self) {
        self.front.clear();
        self.contacts.clear();
        self.held.clear();
        self.admissible.clear();
        if let Some(prover) = &mut self.prover {
            prover.clear();
        }
    }
}

/// The shallowest depths that were not accepted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RejectedContacts {
    /// The surfaces of the solids contradict the contact.
    pub(super) contradicted: Option<Contact>,
    /// The pieces do not share the contact's normal.
    pub(super) unshared: Option<Contact>,
}

impl RejectedContacts {
    /// Adds the depths of another part.
    pub(super) fn add(&mut self, other: &Self) {
        if let Some(contact) = other.contradicted {
            self.contradicted = shallower(self.contradicted, contact);
        }
        if let Some(contact) = other.unshared {
            self.unshared = shallower(self.unshared, contact);
        }
    }
}

/// Returns the shallower of two overlaps; the first if both are equally deep.
fn shallower(least: Option<Contact>, contact: Contact) -> Option<Contact> {
    if least.is_some_and(|least| contact.separation <= least.separation) { least } else { Some(contact) }
}
