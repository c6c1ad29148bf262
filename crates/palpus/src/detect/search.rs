//! All contacts of two bodies within the tolerance \[K02 §3.4, §4.1\].
//!
//! 1. The front over both hierarchies ([`Front`]) returns the leaf pairs within the tolerance.
//! 2. Pieces that are apart have a contact at their closest points. The contact is left out if
//!    these points are not on the surface, or if their direction is not a normal of both meshes
//!    there ([`Body::admits`]). For example, the far side of a thin wall cannot be touched from
//!    within the wall. Beyond the end of an edge's Gauss arc, the neighbouring piece is nearer.
//! 3. Pieces that overlap have a contact at their penetration depth. The depth walk starts from the
//!    pair's last normal, the normal of the march and the line of centroids. If the walk ends on a
//!    normal that one of the meshes does not have, the least depth along a shared normal is used
//!    instead ([`admissible_depth`](crate::depth::admissible_depth)). The contact is left out if
//!    the check of `confirm` rejects its depth, or if the pieces share no normal. If the bodies
//!    overlap and no depth is accepted, the query adds a replacement contact, from a witness point
//!    to the nearest surface.
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
//! features touch.
//!
//! Contacts are in the order in which they began; after a jump, in the order of the descent. The
//! same sequence of poses gives the same order.

use super::confirm::{LastOverlap, depth_is_confirmed, least_depth_is_confirmed, replacement};
use super::exact::{Placed, nearest_on_meshes, on_meshes, slack};
use super::guard::Guard;
use super::held::HeldContacts;
use super::pair::{Found, at_closest};
use super::prover::Prover;
use super::sample::{Range, Sample};
use super::{Contact, Proof, QueryCounters, QuerySettings};
use crate::algebra::tolerance::{WORK_ANSWER, WORK_BOUND};
use crate::algebra::{Clock, Placement, Pose, Quota};
use crate::body::{AdmissibleNormals, Body, Polytope};
use crate::collision::{Front, LeafPair, LeafPairs, PlacedPair, Proximity, Side};
use crate::depth::{AdmissibleScratch, DepthScratch, Patch};

/// Working memory of the queries between two bodies, and data cached from query to query.
#[derive(Clone, Debug)]
pub(super) struct PairSearch {
    pub(super) front: Front,
    /// Largest number of contacts of a query.
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
    /// True if `held` has memory.
    pub(super) holding: bool,
    pub(super) sample: Sample,
    /// Number of pairs with contacts in the current query.
    pub(super) touching: u32,
    /// Measure of the number of touching pairs in the last query, from 0 (few) to 1 (many).
    pub(super) rest_share: f64,
    /// The leaf pair with which the next query begins, if the quota was spent.
    pub(super) resume: Option<u32>,
    pub(super) unseen_separation: f64,
    pub(super) unexamined: f64,
}

/// Capacity of the front, in node pairs. A spoon in a cup has hundreds, two scans of 30 000
/// triangles have some thousands, and a nut on its thread has some ten thousands.
const NODE_PAIRS: usize = 1 << 17;

impl PairSearch {
    /// Allocates memory for queries with these settings.
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
            rest_share: 0.0,
            resume: None,
            unseen_separation: f64::INFINITY,
            unexamined: f64::INFINITY,
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
        (self.unseen_separation, self.unexamined) = (f64::INFINITY, f64::INFINITY);
        let doubtful = self.answer_leaves(asked, quota, &mut counters);
        self.hold_unvisited(asked, &mut counters);
        self.sample.keep(&self.contacts, asked.tolerance);
        self.update_rest_share();
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
            self.unexamined = self.front.unseen_separation();
            self.unseen_separation = self.unseen_separation.min(self.unexamined);
        }
        counters.depth_ns = clock.now_ns() - middle;
        counters
    }

    /// Finds the contacts of the leaf pairs until the quota is spent. Returns the shallowest
    /// depths that were not accepted.
    fn answer_leaves(&mut self, asked: &Asked<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) -> Doubtful {
        self.contacts.clear();
        let mut doubtful = Doubtful::default();
        let rests = self.rest_share > 0.0;
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
                Found::Admissible(contact) if least_depth_is_confirmed(asked, &contact) => {
                    self.contacts.push(contact);
                }
                Found::Moved(contact, facing) if depth_is_confirmed(asked, &facing) => self.contacts.push(contact),
                Found::Admissible(contact) | Found::Moved(contact, _) => {
                    counters.rejected += 1;
                    doubtful.rejected = shallower(doubtful.rejected, contact);
                }
                Found::Inadmissible(contact) => {
                    counters.inadmissible += 1;
                    doubtful.unshared =
                        contact.map_or(doubtful.unshared, |contact| shallower(doubtful.unshared, contact));
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

    /// Adds a replacement contact if the bodies overlap and no depth is accepted. The contact
    /// replaces a rejected depth, the last overlap, or a depth along a normal that is not shared.
    fn hold_overlap(&mut self, asked: &Asked<'_>, doubtful: &Doubtful, counters: &mut QueryCounters) {
        if self.contacts.iter().any(|contact| contact.separation <= 0.0) {
            return;
        }
        let rejected = doubtful.rejected.map(|contact| replacement(asked, &contact).unwrap_or(contact));
        let still = || self.last_overlap.still(asked).filter(|_| counters.traversal.postponed == 0);
        let replaced = rejected.or_else(still).or_else(|| replacement(asked, &doubtful.unshared?));
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

    /// Returns the nearest pair of points at any distance, or the deepest contact. `asked` is the
    /// input of the last [`Self::run`]. A distance is that of the meshes (`exact`).
    pub(super) fn nearest(&mut self, asked: &Asked<'_>, counters: &mut QueryCounters) -> Option<Contact> {
        let meshes = Placed { a: asked.a, b: asked.b, place: &asked.place };
        let least = |x: &&Contact, y: &&Contact| x.separation.total_cmp(&y.separation);
        let contact = self.contacts.iter().min_by(least).and_then(|contact| on_meshes(&meshes, contact, f64::INFINITY));
        if contact.is_some_and(|contact| contact.separation <= 0.0) {
            return contact;
        }
        self.front.nearest(&asked.placed(), slack(asked.a, asked.b), &mut self.leaves, &mut counters.traversal);
        let overlap = self.leaves.as_slice().iter().find(|leaf| matches!(leaf.proximity, Proximity::Overlapping(_)));
        let nearest = match overlap.copied() {
            Some(leaf) => match self.contact(asked, &leaf, counters) {
                Found::Admissible(contact) | Found::Moved(contact, _) => Some(contact),
                Found::Inadmissible(contact) => contact,
                Found::Nothing => None,
            },
            None => {
                let apart = self.leaves.as_slice().iter().filter_map(|leaf| match leaf.proximity {
                    Proximity::Disjoint(closest) => Some(at_closest(leaf, &closest)),
                    Proximity::Overlapping(_) => None,
                });
                nearest_on_meshes(&meshes, apart)
            }
        };
        // If both are equally near, return the contact, since its features belong to the mesh.
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

/// The shallowest depths that were not accepted.
#[derive(Clone, Copy, Default)]
struct Doubtful {
    /// The contact contradicts the surfaces of the solids.
    rejected: Option<Contact>,
    /// The pieces do not share the contact's normal.
    unshared: Option<Contact>,
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
    /// Contacts are searched below this separation, in model units.
    pub(super) tolerance: f64,
    /// Contacts press below this separation, in model units.
    offset: f64,
}

impl<'q> Asked<'q> {
    /// Returns the input of a query with these settings at a pose.
    pub(super) fn new(a: &'q Body, b: &'q Body, pose_ba: &Pose, settings: &QuerySettings) -> Self {
        let QuerySettings { tolerance, contact_offset, .. } = *settings;
        let offset = contact_offset.map_or(tolerance, |offset| offset.min(tolerance));
        Self { a, b, pose_ba: *pose_ba, place: pose_ba.placement(), tolerance, offset }
    }

    /// Returns two separations: contacts are searched below the first, and press below the second.
    pub(super) fn range(&self) -> Range {
        Range { tolerance: self.tolerance, offset: self.offset }
    }

    /// Returns the pieces of a and of b at these indices.
    pub(super) fn pieces(&self, piece_a: u32, piece_b: u32) -> (&'q Polytope, &'q Polytope) {
        (&self.a.polytopes()[piece_a as usize], &self.b.polytopes()[piece_b as usize])
    }

    /// Returns the admissible normals of both pieces of a leaf pair.
    pub(super) fn admissible_normals(&self, leaf: &LeafPair) -> [AdmissibleNormals<'q>; 2] {
        [self.a.admissible_normals(leaf.piece_a), self.b.admissible_normals(leaf.piece_b)]
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

/// Returns the shallower of two overlaps; the first if both are equally deep.
fn shallower(least: Option<Contact>, contact: Contact) -> Option<Contact> {
    if least.is_some_and(|least| contact.separation <= least.separation) { least } else { Some(contact) }
}

fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}
