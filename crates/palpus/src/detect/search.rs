//! All contacts of two bodies within the tolerance \[K02 §3.4, §4.1\].
//!
//! 1. The front over both hierarchies ([`Front`]) returns the leaf pairs within the tolerance.
//! 2. A pair of pieces that is apart is a contact at its closest points. It is left out if these
//!    are not on the surface, or if their direction is not a normal of both meshes there
//!    ([`Body::owns`]). For example, the far side of a thin wall cannot be touched from within the
//!    wall; and beyond the end of an edge's Gauss arc the neighbouring piece is nearer.
//! 3. A pair that overlaps is a contact at its penetration depth, walked from the pair's last
//!    normal, the witness of the march and the line of centroids. If the walk ends on a normal that
//!    one of the meshes does not have, the depth is the least along a normal that both pieces own
//!    ([`admissible_depth`](crate::depth::admissible_depth)). The contact is left out if the
//!    check of `belief` rejects this depth. A pair without such a normal is no contact. If the
//!    bodies overlap and no depth counts, one contact stands in, from a witness point to the
//!    nearest surface.
//!
//! With [`Proof::Prove`], the query proves that each depth is the global minimum for its pair of
//! pieces, or replaces it by a proven one. This happens before virtual features are considered. A
//! depth that is later moved to a normal of the meshes is therefore not the least of the pair, but
//! the least is known.
//!
//! If the pose has jumped since the last query, or a pair begins to overlap, its depth is found
//! from nothing, with a proof ([`depth`](crate::depth::depth)).
//!
//! A pair of pieces is one contact, at its exact witness points, or on request the corners of its
//! *patch* ([`Patch`]): as many contacts as are needed to describe where flush features touch.
//!
//! Contacts are in the order in which they began; after a jump, in the order of the descent. The
//! same history gives the same order.

use super::belief::{LastOverlap, is_believed, is_believed_beyond, stand_in};
use super::guard::Guard;
use super::held::HeldContacts;
use super::pair::{Found, at_closest};
use super::prover::Prover;
use super::sample::{Range, Sample};
use super::{Contact, Proof, QueryCounters, QuerySettings};
use crate::algebra::tolerance::{WORK_ANSWER, WORK_BOUND};
use crate::algebra::{Clock, Placement, Pose, Quota};
use crate::body::{Body, OwnNormals, Polytope};
use crate::collision::{Front, LeafPair, LeafPairs, PlacedPair, Proximity, Side};
use crate::depth::{AdmissibleScratch, DepthScratch, Patch};

/// Working memory of the queries between two bodies, and data cached from query to query.
#[derive(Clone, Debug)]
pub(super) struct PairSearch {
    pub(super) front: Front,
    /// The most contacts of a query.
    pub(super) capacity: usize,
    pub(super) leaves: LeafPairs,
    pub(super) contacts: Vec<Contact>,
    pub(super) scratch: DepthScratch,
    pub(super) admissible: AdmissibleScratch,
    pub(super) prover: Option<Box<Prover>>,
    pub(super) last_pose: Option<Pose>,
    pub(super) last_overlap: LastOverlap,
    pub(super) guard: Option<Guard>,
    pub(super) patch_slope: Option<f64>,
    pub(super) patch: Patch,
    pub(super) held: HeldContacts,
    /// `held` has memory.
    pub(super) holding: bool,
    pub(super) sample: Sample,
    /// Pairs with contacts in the query that is under way.
    pub(super) touching: u32,
    /// How many pairs were in contact in the last query, as a value from 0 (few) to 1 (many).
    pub(super) crowd: f64,
    /// The leaf pair with which the next query begins, if the quota was spent.
    pub(super) resume: Option<u32>,
    pub(super) unseen_separation: f64,
    pub(super) unlooked: f64,
}

/// Node pairs of the front. A spoon in a cup has hundreds, two 30 000-triangle scans some
/// thousands, a nut on its thread some ten thousands.
const NODE_PAIRS: usize = 1 << 17;

impl PairSearch {
    /// Memory for queries with these settings.
    pub(super) fn new(a: &Body, b: &Body, settings: &QuerySettings) -> Self {
        let capacity = settings.capacity.max(1);
        let front = Front::new(side(a), side(b), NODE_PAIRS);
        let held = if settings.holding { HeldContacts::new(front.places(), capacity) } else { HeldContacts::default() };
        Self {
            front,
            capacity,
            leaves: LeafPairs::new(capacity),
            contacts: Vec::with_capacity(capacity),
            scratch: DepthScratch::new(),
            admissible: AdmissibleScratch::new(a.admissible(), b.admissible()),
            prover: (settings.proof == Proof::Prove).then(|| Box::new(Prover::new())),
            last_pose: None,
            last_overlap: LastOverlap::default(),
            guard: settings.guard.then(|| Guard::new(capacity)),
            patch_slope: settings.patch_angle.map(f64::tan),
            patch: Patch::new(),
            held,
            holding: settings.holding,
            sample: Sample::new(a, b),
            touching: 0,
            crowd: 0.0,
            resume: None,
            unseen_separation: f64::INFINITY,
            unlooked: f64::INFINITY,
        }
    }

    /// Sets the angle (rad) of [`QuerySettings::patch_angle`].
    pub(super) fn set_patch_angle(&mut self, angle: Option<f64>) {
        self.patch_slope = angle.map(f64::tan);
    }

    /// Finds the contacts; see [`ContactQuery::run_within`](super::ContactQuery::run_within).
    pub(super) fn run(&mut self, asked: &Asked<'_>, quota: &Quota<'_>, clock: &impl Clock) -> QueryCounters {
        let begin = clock.now_ns();
        let mut counters = QueryCounters::default();
        let thin = self.sub_steps(asked, quota, &mut counters);
        self.move_to(asked, thin);
        counters.traversal = self.front.within_quota(&asked.placed(), quota, &mut self.leaves);
        let middle = clock.now_ns();
        counters.query_ns = middle - begin;
        self.held.begin_tick();
        (self.unseen_separation, self.unlooked) = (f64::INFINITY, f64::INFINITY);
        let doubtful = self.answer_leaves(asked, quota, &mut counters);
        self.hold_unvisited(asked, &mut counters);
        self.sample.keep(&self.contacts, asked.tolerance);
        self.count_crowd();
        self.hold_overlap(asked, &doubtful, &mut counters);
        let all = self.contacts.len();
        self.contacts.retain(Contact::is_finite);
        counters.non_finite += (all - self.contacts.len()) as u32;
        self.last_overlap.keep(&self.contacts, &asked.place);
        if let Some(guard) = &mut self.guard {
            if counters.sub_steps > 0 {
                guard.compare(&self.contacts);
            }
            counters.kept_side = guard.hold(asked, &mut self.contacts);
        }
        if counters.traversal.postponed > 0 {
            self.unlooked = self.front.unseen_separation();
            self.unseen_separation = self.unseen_separation.min(self.unlooked);
        }
        counters.depth_ns = clock.now_ns() - middle;
        counters
    }

    /// Finds the contacts of the leaf pairs until the quota is spent; returns the shallowest of the
    /// depths that do not count.
    fn answer_leaves(&mut self, asked: &Asked<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) -> Doubtful {
        self.contacts.clear();
        let mut doubtful = Doubtful::default();
        let rests = self.crowd > 0.0;
        self.touching = 0;
        let count = self.leaves.as_slice().len();
        if self.holding && counters.traversal.restarted > 0 {
            self.sample.set_touching(count as f64, true);
        }
        let sampled = self.begin_sampled();
        for k in 0..count {
            let leaf = self.leaves.as_slice()[k];
            if k > 0 && quota.is_spent() {
                self.hold_the_rest(asked, k, counters);
                break;
            }
            if k >= sampled {
                if k == sampled && self.sample.is_blank() {
                    self.sample.keep(&self.contacts, asked.tolerance);
                }
                if let Some((bound, separation)) = self.representation(asked, &leaf) {
                    self.front.represent(&asked.placed(), &leaf, &bound, separation);
                    counters.represented += 1;
                    quota.spend(WORK_BOUND);
                    continue;
                }
            }
            let known = self.contacts.len();
            let before = counters.work();
            let foretold = if rests { self.foretell(asked, &leaf) } else { None };
            match self.contact(asked, &leaf, counters) {
                Found::Nothing => counters.virtual_closest += 1,
                Found::Admissible(contact) if is_believed_beyond(asked, &contact) => {
                    self.contacts.push(contact);
                }
                Found::Moved(contact, facing) if is_believed(asked, &facing) => self.contacts.push(contact),
                Found::Admissible(contact) | Found::Moved(contact, _) => {
                    counters.disbelieved += 1;
                    doubtful.rejected = shallower(doubtful.rejected, contact);
                }
                Found::Inadmissible(contact) => {
                    counters.inadmissible += 1;
                    doubtful.unowned = contact.map_or(doubtful.unowned, |contact| shallower(doubtful.unowned, contact));
                }
            }
            if k >= sampled && self.represent_measured(asked, &leaf, known) {
                counters.represented += 1;
                continue;
            }
            self.sample.weigh(&mut self.contacts[known..], &asked.range());
            self.touching += u32::from(self.contacts.len() > known);
            self.keep(asked, &leaf, known, count - k - 1, counters);
            if rests {
                self.rest(asked, &leaf, known, foretold);
            }
            quota.spend(WORK_ANSWER + counters.work() - before);
        }
        doubtful
    }

    /// Adds a contact if bodies overlap and no depth counts: the stand-in of a rejected depth, of
    /// the last overlap, or of a depth along a normal that the pieces do not own.
    fn hold_overlap(&mut self, asked: &Asked<'_>, doubtful: &Doubtful, counters: &mut QueryCounters) {
        if self.contacts.iter().any(|contact| contact.separation <= 0.0) {
            return;
        }
        let rejected = doubtful.rejected.map(|contact| stand_in(asked, &contact).unwrap_or(contact));
        let still = || self.last_overlap.still(asked).filter(|_| counters.traversal.postponed == 0);
        let stands_in = rejected.or_else(still).or_else(|| stand_in(asked, &doubtful.unowned?));
        // Nothing is added beyond the memory that was allocated at construction. If it is full of
        // contacts that are apart, these hold the bodies.
        let room = self.capacity - self.contacts.len();
        counters.stood_in += u32::from(stands_in.is_some() && room > 0);
        self.contacts.extend(stands_in.into_iter().take(room));
    }

    /// See [`ContactQuery::unseen_separation`](super::ContactQuery::unseen_separation).
    pub(super) fn unseen_separation(&self) -> f64 {
        self.unseen_separation
    }

    /// See [`ContactQuery::unlooked_separation`](super::ContactQuery::unlooked_separation).
    pub(super) fn unlooked_separation(&self) -> f64 {
        self.unlooked
    }

    /// The contacts of the last query.
    pub(super) fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// The nearest pair of points at any distance, or the deepest contact. `asked` is the input of
    /// the last [`Self::run`].
    pub(super) fn nearest(&mut self, asked: &Asked<'_>, counters: &mut QueryCounters) -> Option<Contact> {
        let least = |x: &&Contact, y: &&Contact| x.separation.total_cmp(&y.separation);
        let contact = self.contacts.iter().min_by(least).copied();
        if contact.is_some_and(|contact| contact.separation <= 0.0) {
            return contact;
        }
        let leaf = self.front.nearest(&asked.placed(), &mut counters.traversal)?;
        let nearest = match leaf.proximity {
            Proximity::Disjoint(closest) => Some(at_closest(&leaf, &closest)),
            Proximity::Overlapping(_) => match self.contact(asked, &leaf, counters) {
                Found::Admissible(contact) | Found::Moved(contact, _) => Some(contact),
                Found::Inadmissible(contact) => contact,
                Found::Nothing => None,
            },
        };
        // If both are equally near, take the contact, whose features are original.
        match (contact, nearest) {
            (Some(c), Some(n)) if c.separation <= n.separation => Some(c),
            (c, n) => n.or(c),
        }
    }

    /// See [`super::ContactQuery::came_from`].
    pub(super) fn came_from(&mut self, pose_ba: &Pose) {
        self.contacts.clear();
        self.held.clear();
        self.sample.clear();
        self.front.end_rests();
        if let Some(guard) = &mut self.guard {
            guard.clear();
        }
        self.last_overlap.clear();
        self.last_pose = Some(*pose_ba);
    }

    /// Drops all cached data.
    pub(super) fn clear(&mut self) {
        self.front.clear();
        self.contacts.clear();
        self.held.clear();
        self.sample.clear();
        if let Some(guard) = &mut self.guard {
            guard.clear();
        }
        self.last_pose = None;
        self.last_overlap.clear();
        if let Some(prover) = &mut self.prover {
            prover.clear();
        }
    }
}

/// The shallowest of the depths that do not count.
#[derive(Clone, Copy, Default)]
struct Doubtful {
    /// Contradicts the surfaces of the solids.
    rejected: Option<Contact>,
    /// Its normal is not owned by both pieces.
    unowned: Option<Contact>,
}

/// Input of a query.
#[derive(Clone, Copy)]
pub(super) struct Asked<'q> {
    pub(super) a: &'q Body,
    pub(super) b: &'q Body,
    /// a placed in b's frame.
    pub(super) pose_ba: Pose,
    /// `pose_ba` as a matrix.
    pub(super) place: Placement,
    /// Model units.
    pub(super) tolerance: f64,
    /// Contacts press below this separation, model units.
    offset: f64,
}

impl<'q> Asked<'q> {
    /// Input of a query with these settings at a pose.
    pub(super) fn new(a: &'q Body, b: &'q Body, pose_ba: &Pose, settings: &QuerySettings) -> Self {
        let QuerySettings { tolerance, contact_offset, .. } = *settings;
        let offset = contact_offset.map_or(tolerance, |offset| offset.min(tolerance));
        Self { a, b, pose_ba: *pose_ba, place: pose_ba.placement(), tolerance, offset }
    }

    /// Returns the separations below which contacts are searched, and below which they press.
    pub(super) fn range(&self) -> Range {
        Range { tolerance: self.tolerance, offset: self.offset }
    }

    /// Returns the pieces of a and of b at these indices.
    pub(super) fn pieces(&self, piece_a: u32, piece_b: u32) -> (&'q Polytope, &'q Polytope) {
        (&self.a.polytopes()[piece_a as usize], &self.b.polytopes()[piece_b as usize])
    }

    /// Returns the admissible normals of both pieces of a leaf pair.
    pub(super) fn own_normals(&self, leaf: &LeafPair) -> [OwnNormals<'q>; 2] {
        [self.a.own_normals(leaf.piece_a), self.b.own_normals(leaf.piece_b)]
    }

    /// Returns this input in the form that the front needs.
    pub(super) fn placed(&self) -> PlacedPair<'_> {
        PlacedPair::new(side(self.a), side(self.b), &self.place, self.tolerance)
    }

    /// Returns this input at another pose.
    pub(super) fn at(self, pose_ba: &Pose) -> Self {
        Self { pose_ba: *pose_ba, place: pose_ba.placement(), ..self }
    }
}

/// The shallower of two overlaps, the first if they are as deep.
fn shallower(least: Option<Contact>, contact: Contact) -> Option<Contact> {
    if least.is_some_and(|least| contact.separation <= least.separation) { least } else { Some(contact) }
}

fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}
