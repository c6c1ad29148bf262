//! All contacts of two bodies within the tolerance \[K02 §3.4, §4.1\].
//!
//! 1. The sleeping front over both hierarchies ([`Front`]) answers the leaf pairs within tolerance.
//! 2. A pair of pieces that is apart is a contact at its closest points, unless those are not of the surface or their direction is
//!    none that both meshes have there ([`Body::owns`]): the far side of a thin wall, seen from within the wall, is no surface to
//!    touch, and beyond the end of an edge's arc the neighbouring piece is the nearer one.
//! 3. A pair that overlaps is a contact at its penetration depth, walked from the pair's last normal, the witness of the
//!    march and the line of centroids; where the walk ends on a normal that not both meshes have, it is the least depth along one that
//!    both pieces own ([`admissible_depth`](crate::depth::admissible_depth)), and then left out unless it is believed (`belief`); a pair without such a normal is no
//!    contact. When nothing else is left of an overlap, the shallowest of these stays.
//!
//! Asked to ([`Proof::Prove`]), the query proves each depth globally least for its pair of pieces, or replaces it by a better one that
//! it proves, before virtual features are looked at. A depth that was moved to a normal of the meshes afterwards is therefore not
//! the least of the pair, but the least is known.
//!
//! When the pose has jumped since the last query, what is remembered of a pair's depth is a guess like any other: the walk
//! then starts cold, from several seeds, and keeps the best end.
//!
//! A pair of pieces is one contact, at its exact witness points, or on request the corners of its *patch* ([`Patch`]): as many contacts
//! as it takes to say where flush features touch.
//!
//! Contacts come in the order in which they began; after a jump, in that of the descent. The same history gives the same order.

mod counters;
mod late;
mod pair;
mod prover;
mod sub_step;

pub use counters::QueryCounters;

use self::pair::{Found, at_closest};
use self::prover::Prover;
use super::Contact;
use super::belief::{LastOverlap, corrected, is_believed, is_believed_beyond};
use super::guard::Guard;
use super::held::HeldContacts;
use crate::algebra::tolerance::WORK_ANSWER;
use crate::algebra::{Clock, Placement, Pose, Quota, Work};
use crate::body::{Body, Polytope};
use crate::collision::{Front, LeafPairs, Proximity, Side};
use crate::depth::{AdmissibleScratch, Patch, WalkScratch};

/// Whether depths are proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// The walk alone: the depth is locally least, as \[K02 §3.3\] has it. What a servo loop uses.
    #[default]
    None,
    /// The depth of every overlapping pair of pieces is proven globally least.
    Prove,
}

/// Pair queries between one body a and one body b: their working memory and what they remember from tick to tick.
#[derive(Clone, Debug)]
pub struct PairQuery {
    front: Front,
    /// The most contacts of a query.
    capacity: usize,
    leaves: LeafPairs,
    contacts: Vec<Contact>,
    /// Of the leaf pairs, those that overlap without an admissible depth.
    inadmissible: Vec<u32>,
    scratch: WalkScratch,
    admissible: AdmissibleScratch,
    prover: Option<Box<Prover>>,
    last_pose: Option<Pose>,
    last_overlap: LastOverlap,
    guard: Option<Guard>,
    coherent: bool,
    patch_slope: Option<f64>,
    patch: Patch,
    held: HeldContacts,
    /// The leaf pair with which the next query begins, if the quota was spent.
    resume: Option<u32>,
    unseen_separation: f64,
    unlooked: f64,
}

/// Node pairs of the front. A spoon in a cup has hundreds, two 30 000-triangle scans some thousands, a nut on its thread some ten
/// thousands.
const NODE_PAIRS: usize = 1 << 17;

impl PairQuery {
    /// Memory for at most `capacity` contacts a query, at least one.
    pub fn new(a: &Body, b: &Body, capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self {
            front: Front::new(side(a), side(b), NODE_PAIRS),
            capacity,
            leaves: LeafPairs::new(capacity),
            contacts: Vec::with_capacity(capacity),
            inadmissible: Vec::with_capacity(capacity),
            scratch: WalkScratch::new(),
            admissible: AdmissibleScratch::new(a.admissible(), b.admissible()),
            prover: None,
            last_pose: None,
            last_overlap: LastOverlap::default(),
            guard: None,
            coherent: false,
            patch_slope: None,
            patch: Patch::new(),
            held: HeldContacts::default(),
            resume: None,
            unseen_separation: f64::INFINITY,
            unlooked: f64::INFINITY,
        }
    }

    /// The same query with or without proofs; memory for them is made here.
    pub fn with_proof(self, proof: Proof) -> Self {
        let prover = match proof {
            Proof::None => None,
            Proof::Prove => Some(Box::new(Prover::new())),
        };
        Self { prover, ..self }
    }

    /// The same query with the corners of patches as contacts, for tilts up to `angle` (rad, above 0 and below a right angle;
    /// `None`: one exact contact for each pair of pieces). See [`Patch`].
    pub fn with_patches(mut self, angle: Option<f64>) -> Self {
        self.set_patches(angle);
        self
    }

    /// Sets the angle of [`Self::with_patches`] from the next query on.
    pub fn set_patches(&mut self, angle: Option<f64>) {
        self.patch_slope = angle.map(f64::tan);
    }

    /// The same, with memory to hold contacts of pairs for which the quota does not suffice: see [`Self::run_within`].
    pub fn with_holding(self) -> Self {
        let held = HeldContacts::new(self.front.places(), self.capacity);
        Self { held, ..self }
    }

    /// The same, guarded against tunnelling: contacts are not jumped over when a hand is fast and a part thin.
    pub fn with_guard(self) -> Self {
        Self { guard: Some(Guard::new(self.capacity)), ..self }
    }

    /// Finds every contact nearer than `tolerance` (model units); `pose_ba` places a in b's frame.
    ///
    /// The answer stands in [`Self::contacts`] until the next query.
    pub fn run(&mut self, a: &Body, b: &Body, pose_ba: &Pose, tolerance: f64, clock: &impl Clock) -> QueryCounters {
        self.run_within(a, b, pose_ba, tolerance, &Work::unlimited().all(), clock)
    }

    /// The same with at most about `quota` of work: pairs that were not reached are answered from the last query and come first in the
    /// next.
    ///
    /// A contact of the last query is *held*: carried along with the bodies, its separation measured anew along its normal
    /// (`held`), which is right to first order in the motion. Pairs that were not in contact may be nearer by now than the tolerance, but
    /// not nearer than [`Self::unseen_separation`]. No contact is made of the hulls of whole parts: that of a cup is
    /// full, and a spoon in it would be thrown out.
    pub fn run_within(
        &mut self,
        a: &Body,
        b: &Body,
        pose_ba: &Pose,
        tolerance: f64,
        quota: &Quota<'_>,
        clock: &impl Clock,
    ) -> QueryCounters {
        let begin = clock.now_ns();
        let mut counters = QueryCounters::default();
        let asked = Asked { a, b, pose_ba: *pose_ba, place: pose_ba.placement(), tolerance };
        let thin = self.sub_steps(&asked, quota, &mut counters);
        self.move_to(&asked, thin);
        let place = &asked.place;
        counters.traversal = self.front.within_quota(side(a), side(b), place, tolerance, quota, &mut self.leaves);
        let middle = clock.now_ns();
        counters.query_ns = middle - begin;
        self.held.begin_tick();
        (self.unseen_separation, self.unlooked) = (f64::INFINITY, f64::INFINITY);
        let doubtful = self.answer_leaves(&asked, quota, &mut counters);
        self.hold_unvisited(&asked, &mut counters);
        self.hold_overlap(&asked, doubtful, &mut counters);
        let all = self.contacts.len();
        self.contacts.retain(Contact::is_finite);
        counters.non_finite += (all - self.contacts.len()) as u32;
        self.last_overlap.keep(&self.contacts, place);
        if let Some(guard) = &mut self.guard {
            if counters.sub_steps > 0 {
                guard.compare(&self.contacts);
            }
            counters.kept_side = guard.hold(a, b, place, tolerance, &mut self.contacts);
        }
        if counters.traversal.postponed > 0 {
            self.unlooked = self.front.unseen_separation();
            self.unseen_separation = self.unseen_separation.min(self.unlooked);
        }
        counters.depth_ns = clock.now_ns() - middle;
        counters
    }

    /// The contacts of the leaf pairs, as far as the quota goes; answers the shallowest of those that were not believed.
    fn answer_leaves(&mut self, asked: &Asked<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) -> Option<Contact> {
        let Asked { a, b, place, tolerance, .. } = asked;
        self.contacts.clear();
        self.inadmissible.clear();
        let mut doubtful = None;
        let count = self.leaves.as_slice().len();
        for k in 0..count {
            let leaf = self.leaves.as_slice()[k];
            if k > 0 && quota.is_spent() {
                self.hold_the_rest(asked, k, counters);
                break;
            }
            let known = self.contacts.len();
            let before = counters.work();
            match self.contact(asked, &leaf, counters) {
                Found::Nothing => counters.virtual_closest += 1,
                Found::Admissible(contact) if is_believed_beyond(a, b, place, &contact, *tolerance) => {
                    self.contacts.push(contact);
                }
                Found::Moved(contact, facing) if is_believed(a, b, place, &facing) => self.contacts.push(contact),
                Found::Admissible(contact) | Found::Moved(contact, _) => {
                    counters.disbelieved += 1;
                    doubtful = shallower(doubtful, contact);
                }
                Found::Inadmissible => {
                    counters.inadmissible += 1;
                    self.inadmissible.push(k as u32);
                }
            }
            self.keep(asked, &leaf, known, count - k - 1, counters);
            quota.spend(WORK_ANSWER + counters.work() - before);
        }
        doubtful
    }

    /// Bodies that overlap must not be let go of, however doubtful the way out.
    fn hold_overlap(&mut self, asked: &Asked<'_>, mut doubtful: Option<Contact>, counters: &mut QueryCounters) {
        if self.contacts.iter().any(|contact| contact.separation <= 0.0) {
            return;
        }
        let Asked { a, b, place, .. } = asked;
        for k in 0..self.inadmissible.len() {
            let leaf = self.leaves.as_slice()[self.inadmissible[k] as usize];
            if let Some(contact) = self.half_admissible(asked, &leaf) {
                doubtful = shallower(doubtful, contact);
            }
        }
        let stands_in = match doubtful {
            Some(contact) => Some(corrected(a, b, place, &contact)),
            None if counters.traversal.postponed == 0 => self.last_overlap.still(a, b, place),
            None => None,
        };
        // Within the memory made at construction: full of contacts that are apart, the bodies are held by those.
        let room = self.capacity - self.contacts.len();
        counters.stood_in += u32::from(stands_in.is_some() && room > 0);
        self.contacts.extend(stands_in.into_iter().take(room));
    }

    /// What the last query did not look at since its quota was spent is at least this far apart, model units: infinite when it
    /// looked at everything, minus infinite when it had just begun.
    ///
    /// Contacts that are held, and pairs that were none at their last visit since only virtual features were near, are looked at in this
    /// sense.
    pub fn unseen_separation(&self) -> f64 {
        self.unseen_separation
    }

    /// The same of the pairs that may have come near since they were last looked at: not of those that were within tolerance then, and whose
    /// contacts are carried or dropped.
    pub fn unlooked_separation(&self) -> f64 {
        self.unlooked
    }

    /// The contacts of the last query.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// The nearest pair of points of the two bodies, whatever the distance; when bodies overlap, the deepest contact.
    ///
    /// `pose_ba` is that of the last [`Self::run`].
    pub fn nearest(&mut self, a: &Body, b: &Body, pose_ba: &Pose, counters: &mut QueryCounters) -> Option<Contact> {
        let least = |x: &&Contact, y: &&Contact| x.separation.total_cmp(&y.separation);
        let contact = self.contacts.iter().min_by(least).copied();
        if contact.is_some_and(|contact| contact.separation <= 0.0) {
            return contact;
        }
        let asked = Asked { a, b, pose_ba: *pose_ba, place: pose_ba.placement(), tolerance: 0.0 };
        let leaf = self.front.nearest(side(a), side(b), &asked.place, &mut counters.traversal)?;
        let nearest = match leaf.proximity {
            Proximity::Disjoint(closest) => Some(at_closest(&leaf, &closest)),
            Proximity::Overlapping(_) => match self.contact(&asked, &leaf, counters) {
                Found::Admissible(contact) | Found::Moved(contact, _) => Some(contact),
                Found::Inadmissible => self.half_admissible(&asked, &leaf),
                Found::Nothing => None,
            },
        };
        // Equally near: the contact, whose features are original.
        match (contact, nearest) {
            (Some(c), Some(n)) if c.separation <= n.separation => Some(c),
            (c, n) => n.or(c),
        }
    }

    /// Forgets the past.
    pub fn clear(&mut self) {
        self.front.clear();
        self.contacts.clear();
        self.held.clear();
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

/// What is asked of a pair query.
#[derive(Clone, Copy)]
struct Asked<'q> {
    a: &'q Body,
    b: &'q Body,
    /// a placed in b's frame.
    pose_ba: Pose,
    /// The same, as a matrix.
    place: Placement,
    /// Model units.
    tolerance: f64,
}

impl Asked<'_> {
    /// The same at another pose.
    fn at(self, pose_ba: &Pose) -> Self {
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

fn pieces<'a>(a: &'a Body, b: &'a Body, piece_a: u32, piece_b: u32) -> (&'a Polytope, &'a Polytope) {
    (&a.polytopes()[piece_a as usize], &b.polytopes()[piece_b as usize])
}
