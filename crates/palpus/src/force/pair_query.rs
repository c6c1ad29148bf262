//! All contacts of two bodies within the tolerance \[K02 §3.4, §4.1\].
//!
//! 1. The sleeping front over both hierarchies ([`Front`]) answers the leaf pairs within tolerance.
//! 2. A pair of pieces that is apart is a contact at its closest points, unless those are not of the surface or their direction is
//!    none that both meshes have there ([`Body::owns`]): the far side of a thin wall, seen from within the wall, is no surface to
//!    touch, and beyond the end of an edge's arc the neighbouring piece is the nearer one.
//! 3. A pair that overlaps is a contact at its penetration depth, walked from the pair's last normal, the witness of the
//!    march and the line of centroids; where the walk ends on a normal that not both meshes have, it is the least depth along one that
//!    both pieces own ([`admissible_depth`]), and then left out unless it is believed (`belief`); a pair without such a normal is no
//!    contact. When nothing else is left of an overlap, the shallowest of these stays.
//!
//! Asked to ([`Proof::Prove`]), the query proves each depth globally least for its pair of pieces, or replaces it by a better one that
//! it proves, before virtual features are looked at. A depth that was moved to a normal of the meshes afterwards is therefore not
//! the least of the pair, but the least is known.
//!
//! When the pose has jumped since the last query, what is remembered of a pair's depth is a guess like any other: the walk
//! then starts cold, from several seeds, and keeps the best end.
//!
//! The points of a contact are exact, or on request *blended*: moved to where they change
//! continuously as flat contact opens ([`blend`]). The nearest pair of [`PairQuery::nearest`] is a contact, and blended, where
//! the bodies are within tolerance.
//!
//! Contacts come in the order in which they began; after a jump, in that of the descent. The same history gives the same order.

use glam::DVec3;

use super::Contact;
use super::belief::{LastOverlap, corrected, is_believed, is_believed_beyond};
use super::guard::{Guard, between, sub_steps};
use super::held::{Held, HeldContacts, vertex_of};
use crate::algebra::tolerance::JUMP;
use crate::algebra::{Clock, Deadline, Placement, Pose};
use crate::body::{Aabb, Body, Polytope};
use crate::collision::{
    Closest, Front, Home, LeafPair, LeafPairs, Memory, Overlap, Proximity, Side, StopReason, TraversalCounters,
};
use crate::depth::{
    AdmissibleDepth, AdmissibleScratch, Antipodal, Certainty, CertificateMemory, Depth, HubPair, ProofScratch, Seed,
    Touch, WalkScratch, admissible_depth, blend, depth, depth_proven,
};

/// Whether depths are proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// The walk alone: the depth is locally least, as \[K02 §3.3\] has it. What a servo loop uses.
    #[default]
    None,
    /// The depth of every overlapping pair of pieces is proven globally least.
    Prove,
}

/// What a query cost and what happened in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryCounters {
    /// The descent, and the search for the nearest pair when one was asked for.
    pub traversal: TraversalCounters,
    /// Depth walks.
    pub walks: u32,
    /// Moves of all walks.
    pub walk_steps: u32,
    /// Walks that ended for another reason than having converged.
    pub walk_stops: u32,
    /// Depths that are not proven globally least: all of them unless the query was made to prove.
    pub unproven: u32,
    /// Depths whose direction is not the unconstrained one, since not both pieces own that on their meshes.
    pub moved: u32,
    /// Moved depths that the solids' own surfaces deny, left out.
    pub disbelieved: u32,
    /// Contacts of a witness point with the nearest surface, for want of a depth of pieces that is believed; 0 or 1.
    pub stood_in: u32,
    /// Overlaps without an admissible depth, left out: there is no normal that both pieces own.
    pub inadmissible: u32,
    /// Searches for an admissible depth that did not look at all edge pairs.
    pub admissible_stops: u32,
    /// Closest points that are not of the surface, or do not face the way that it does, which are no contact.
    pub virtual_closest: u32,
    /// Contacts that were carried from the last tick along their normals, since the deadline had passed.
    pub held: u32,
    /// Overlapping pairs that were not answered at all, since the deadline had passed and nothing was known of them.
    pub unseen: u32,
    /// Sub-steps into which a fast tick's motion was cut; 0 when it was taken whole.
    pub sub_steps: u32,
    /// Contacts that are held on the side from which they came, since they had been jumped over.
    pub kept_side: u32,
    /// Contacts whose witness is a blend, and not the exact one.
    pub blended: u32,
    /// Contacts whose witness stayed exact since the blend did not converge.
    pub blend_stops: u32,
    /// Time in the descent and the marches, ns.
    pub query_ns: u64,
    /// Time in the depth walks, ns.
    pub depth_ns: u64,
}

/// Pair queries between one body a and one body b: their working memory and what they remember from tick to tick.
#[derive(Clone, Debug)]
pub struct PairQuery {
    front: Front,
    leaves: LeafPairs,
    contacts: Vec<Contact>,
    scratch: WalkScratch,
    admissible: AdmissibleScratch,
    prover: Option<Box<Prover>>,
    last_pose: Option<Pose>,
    last_overlap: LastOverlap,
    guard: Option<Guard>,
    coherent: bool,
    blend_angle: Option<f64>,
    held: HeldContacts,
    /// The leaf pair with which the next query begins, if time has run out.
    resume: Option<u32>,
    unseen_separation: f64,
}

/// Node pairs of the front, and those that full searches remember. A spoon in a cup has hundreds, two 30 000-triangle scans
/// some thousands.
const NODE_PAIRS: usize = 1 << 15;

impl PairQuery {
    /// Memory for at most `capacity` contacts a query.
    pub fn new(a: &Body, b: &Body, capacity: usize) -> Self {
        Self {
            front: Front::new(side(a), side(b), NODE_PAIRS),
            leaves: LeafPairs::new(capacity),
            contacts: Vec::with_capacity(capacity),
            scratch: WalkScratch::new(),
            admissible: AdmissibleScratch::new(a.admissible(), b.admissible()),
            prover: None,
            last_pose: None,
            last_overlap: LastOverlap::default(),
            guard: None,
            coherent: false,
            blend_angle: None,
            held: HeldContacts::default(),
            resume: None,
            unseen_separation: f64::INFINITY,
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

    /// The same, with contacts that are blended over tilts up to `angle` (rad, above 0 and below a right angle; `None`: exact).
    ///
    /// The witness points of [`Self::contacts`] then move continuously through flat contact: see [`blend`].
    pub fn with_blend(self, angle: Option<f64>) -> Self {
        Self { blend_angle: angle, ..self }
    }

    /// The same, with memory to hold contacts when a deadline passes: see [`Self::run_until`].
    pub fn with_holding(self) -> Self {
        let held = HeldContacts::new(self.front.places());
        Self { held, ..self }
    }

    /// The same, guarded against tunnelling: contacts are not jumped over when a hand is fast and a part thin.
    pub fn with_guard(self) -> Self {
        Self { guard: Some(Guard::new(self.contacts.capacity())), ..self }
    }

    /// Finds every contact nearer than `tolerance` (model units); `pose_ba` places a in b's frame.
    ///
    /// The answer stands in [`Self::contacts`] until the next query.
    pub fn run(&mut self, a: &Body, b: &Body, pose_ba: &Pose, tolerance: f64, clock: &impl Clock) -> QueryCounters {
        self.run_until(a, b, pose_ba, tolerance, &Deadline::never(clock))
    }

    /// The same, but when the deadline passes, pairs that were not reached are answered from the last query and come first in the next.
    ///
    /// A contact of the last query is *held*: carried along with the bodies, its separation measured anew along its normal
    /// (`held`), which is never more than the true one. Pairs that were not in contact may be nearer by now than the tolerance, but
    /// not nearer than [`Self::unseen_separation`]. No contact is made of the hulls of whole parts: that of a cup is
    /// full, and a spoon in it would be thrown out.
    pub fn run_until<C: Clock>(
        &mut self,
        a: &Body,
        b: &Body,
        pose_ba: &Pose,
        tolerance: f64,
        deadline: &Deadline<C>,
    ) -> QueryCounters {
        let begin = deadline.now_ns();
        let mut counters = QueryCounters::default();
        self.sub_steps(a, b, pose_ba, tolerance, deadline, &mut counters);
        let place = pose_ba.placement();
        self.move_to(a, b, pose_ba, counters.sub_steps > 0);
        counters.traversal = self.front.within_until(side(a), side(b), &place, tolerance, deadline, &mut self.leaves);
        let middle = deadline.now_ns();
        counters.query_ns = middle - begin;
        self.contacts.clear();
        self.held.begin_tick();
        self.unseen_separation = f64::INFINITY;
        let mut doubtful: Option<Contact> = None;
        for k in 0..self.leaves.as_slice().len() {
            let leaf = self.leaves.as_slice()[k];
            if k > 0 && deadline.passed() {
                self.hold_the_rest(a, b, &place, tolerance, k, &mut counters);
                break;
            }
            let known = self.contacts.len();
            match self.contact(a, b, &place, &leaf, &mut counters) {
                Found::Nothing => counters.virtual_closest += 1,
                Found::Admissible(contact) if is_believed_beyond(a, b, &place, &contact, tolerance) => {
                    self.contacts.push(contact);
                }
                Found::Moved(contact, facing) if is_believed(a, b, &place, &facing) => self.contacts.push(contact),
                Found::Admissible(contact) | Found::Moved(contact, _) => {
                    counters.disbelieved += 1;
                    if doubtful.is_none_or(|least| contact.separation > least.separation) {
                        doubtful = Some(contact);
                    }
                }
                Found::Inadmissible(contact) => {
                    counters.inadmissible += 1;
                    if doubtful.is_none_or(|least| contact.separation > least.separation) {
                        doubtful = Some(contact);
                    }
                }
            }
            self.keep(a, b, &place, &leaf, known, &mut counters);
        }
        self.hold_unvisited(a, b, &place, tolerance, &mut counters);
        // Bodies that overlap must not be let go of, however doubtful the way out.
        if !self.contacts.iter().any(|contact| contact.separation <= 0.0) {
            let stands_in = match doubtful {
                Some(contact) => Some(corrected(a, b, &place, &contact)),
                None if counters.traversal.postponed == 0 => self.last_overlap.still(a, b, &place),
                None => None,
            };
            // Within the memory made at construction: full of contacts that are apart, the bodies are held by those.
            let room = self.contacts.capacity() - self.contacts.len();
            counters.stood_in += u32::from(stands_in.is_some() && room > 0);
            self.contacts.extend(stands_in.into_iter().take(room));
        }
        self.last_overlap.keep(&self.contacts, &place);
        if let Some(guard) = &mut self.guard {
            if counters.sub_steps > 0 {
                guard.compare(&self.contacts);
            }
            counters.kept_side = guard.hold(a, b, &place, tolerance, &mut self.contacts);
        }
        if counters.traversal.postponed > 0 {
            self.unseen_separation = self.unseen_separation.min(self.front.unseen_separation());
        }
        counters.depth_ns = deadline.now_ns() - middle;
        counters
    }

    /// What the last query did not look at since its deadline had passed is at least this far apart, model units: infinite when it
    /// looked at everything, minus infinite when it had just begun.
    ///
    /// Contacts that are held, and pairs that were none at their last visit since only virtual features were near, are looked at in this
    /// sense.
    pub fn unseen_separation(&self) -> f64 {
        self.unseen_separation
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
        let place = pose_ba.placement();
        let leaf = self.front.nearest(side(a), side(b), &place, &mut counters.traversal)?;
        let nearest = match leaf.proximity {
            Proximity::Disjoint(closest) => Some(at_closest(&leaf, &closest)),
            Proximity::Overlapping(_) => match self.contact(a, b, &place, &leaf, counters) {
                Found::Admissible(contact) | Found::Moved(contact, _) | Found::Inadmissible(contact) => Some(contact),
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

    /// A fast tick's poses on the way, so that nothing is jumped over; the deadline may cut them short.
    fn sub_steps<C: Clock>(
        &mut self,
        a: &Body,
        b: &Body,
        pose_ba: &Pose,
        tolerance: f64,
        deadline: &Deadline<C>,
        counters: &mut QueryCounters,
    ) {
        let (Some(_), Some(last)) = (&self.guard, self.last_pose) else { return };
        let parts = sub_steps(travel(a, &last.placement(), &pose_ba.placement()), tolerance);
        if parts <= 1 {
            return;
        }
        counters.sub_steps = parts;
        let deadline = deadline.halfway();
        for part in 1..parts {
            if deadline.passed() {
                return;
            }
            let pose = between(&last, pose_ba, f64::from(part) / f64::from(parts));
            let place = pose.placement();
            self.move_to(a, b, &pose, true);
            self.front.within_until(side(a), side(b), &place, tolerance, &deadline, &mut self.leaves);
            self.contacts.clear();
            for k in 0..self.leaves.as_slice().len() {
                let leaf = self.leaves.as_slice()[k];
                if let Found::Admissible(contact) | Found::Moved(contact, _) =
                    self.contact(a, b, &place, &leaf, counters)
                {
                    self.contacts.push(contact);
                }
            }
            if let Some(guard) = &mut self.guard {
                guard.compare(&self.contacts);
            }
        }
    }

    /// Notes the pose, whether the way to it is coherent, and in fast motion which of the last contacts tunnel on that way.
    fn move_to(&mut self, a: &Body, b: &Body, pose_ba: &Pose, fast: bool) {
        let place = pose_ba.placement();
        self.coherent = false;
        if let Some(last) = self.last_pose.replace(*pose_ba) {
            let last = last.placement();
            self.coherent = travel(a, &last, &place) <= JUMP * a.size().min(b.size());
            if let Some(guard) = &mut self.guard
                && fast
            {
                guard.trace(a, b, &self.contacts, &last, &place);
            }
        }
    }

    /// Blends the contact that a leaf pair has added to those `known`, and keeps it for when there is no time.
    fn keep(
        &mut self,
        a: &Body,
        b: &Body,
        place: &Placement,
        leaf: &LeafPair,
        known: usize,
        counters: &mut QueryCounters,
    ) {
        self.blend_from(a, b, place, known, counters);
        if let Home::Place(home) = leaf.home {
            let contact = self.contacts.get(known);
            self.held.keep(
                home,
                [leaf.piece_a, leaf.piece_b],
                contact,
                pieces(a, b, leaf.piece_a, leaf.piece_b),
                place,
            );
        }
    }

    fn blend_from(&mut self, a: &Body, b: &Body, place: &Placement, known: usize, counters: &mut QueryCounters) {
        if let Some(angle) = self.blend_angle {
            for contact in &mut self.contacts[known..] {
                blend_witness(a, b, place, contact, angle, counters);
            }
        }
    }

    /// The deadline has passed before leaf pair `first`: it and those after it are answered from the last tick.
    #[cold]
    fn hold_the_rest(
        &mut self,
        a: &Body,
        b: &Body,
        place: &Placement,
        tolerance: f64,
        first: usize,
        counters: &mut QueryCounters,
    ) {
        // Those that woke just now come first and are not in turn; the others go on where time ran out.
        let mut resumed = false;
        for k in first..self.leaves.as_slice().len() {
            let leaf = self.leaves.as_slice()[k];
            counters.traversal.postponed += 1;
            let Home::Place(home) = leaf.home else {
                self.answer_unheld(a, b, place, &leaf, counters);
                continue;
            };
            if !self.hold(a, b, place, tolerance, home, [leaf.piece_a, leaf.piece_b], counters) {
                self.answer_unheld(a, b, place, &leaf, counters);
            }
            if !resumed {
                self.resume = Some(home);
                resumed = true;
            }
        }
    }

    /// Those for whose march there was no time.
    fn hold_unvisited(&mut self, a: &Body, b: &Body, place: &Placement, tolerance: f64, counters: &mut QueryCounters) {
        for k in 0..self.front.unvisited() {
            let (home, pieces) = self.front.unvisited_pair(side(a), side(b), k);
            if !self.hold(a, b, place, tolerance, home, pieces, counters) {
                counters.unseen += 1;
                self.unseen_separation = f64::NEG_INFINITY;
            }
        }
        if let Some(home) = self.resume.take() {
            self.front.resume_at(home);
        }
    }

    /// Answers a pair from the last tick; false if nothing is known of it.
    #[allow(clippy::too_many_arguments, reason = "the bodies, where they are, and the pair")]
    fn hold(
        &mut self,
        a: &Body,
        b: &Body,
        place: &Placement,
        tolerance: f64,
        home: u32,
        [piece_a, piece_b]: [u32; 2],
        counters: &mut QueryCounters,
    ) -> bool {
        match self.held.carry(home, [piece_a, piece_b], pieces(a, b, piece_a, piece_b), place, tolerance) {
            Held::Unknown => return false,
            Held::NoContact => {}
            Held::Contact(contact) if self.contacts.len() < self.contacts.capacity() => {
                counters.held += 1;
                self.contacts.push(contact);
            }
            Held::Contact(_) => counters.traversal.dropped += 1,
        }
        true
    }

    /// A pair of which the last tick knew nothing: the march's answer if it is apart, otherwise only how deep it is at most.
    fn answer_unheld(&mut self, a: &Body, b: &Body, place: &Placement, leaf: &LeafPair, counters: &mut QueryCounters) {
        let Proximity::Overlapping(overlap) = leaf.proximity else {
            if let Found::Admissible(contact) = self.contact(a, b, place, leaf, counters) {
                self.contacts.push(contact);
            }
            return;
        };
        counters.unseen += 1;
        let (piece_a, piece_b) = pieces(a, b, leaf.piece_a, leaf.piece_b);
        let normal = overlap.direction.normalize_or(DVec3::Z);
        let support_a = piece_a.support_from(0, place.inverse_vector(-normal));
        let support_b = piece_b.support_from(0, normal);
        let gap = normal.dot(place.point(piece_a.vertex(support_a)) - piece_b.vertex(support_b));
        self.unseen_separation = self.unseen_separation.min(gap);
    }

    fn contact(
        &mut self,
        a: &Body,
        b: &Body,
        place: &Placement,
        leaf: &LeafPair,
        counters: &mut QueryCounters,
    ) -> Found {
        if let Proximity::Disjoint(Closest { normal, features, .. }) = leaf.proximity {
            // Should they overlap in the next tick, they do so along this normal.
            let (piece_a, piece_b) = pieces(a, b, leaf.piece_a, leaf.piece_b);
            let hub = [vertex_of(piece_a, features.a), vertex_of(piece_b, features.b)];
            self.front.remember_depth(leaf, normal, hub, features);
        }
        match leaf.proximity {
            Proximity::Disjoint(closest) if is_surface(a, b, place, leaf, &closest) => {
                Found::Admissible(at_closest(leaf, &closest))
            }
            Proximity::Disjoint(_) => Found::Nothing,
            Proximity::Overlapping(overlap) => self.at_depth(a, b, place, leaf, &overlap, counters),
        }
    }

    fn at_depth(
        &mut self,
        a: &Body,
        b: &Body,
        place: &Placement,
        leaf: &LeafPair,
        overlap: &Overlap,
        counters: &mut QueryCounters,
    ) -> Found {
        let (piece_a, piece_b) = (&a.polytopes()[leaf.piece_a as usize], &b.polytopes()[leaf.piece_b as usize]);
        let witness = Seed::Witness { direction: overlap.direction };
        let seeds = match leaf.memory.filter(|memory| self.coherent && memory.normal != DVec3::ZERO) {
            Some(Memory { hub: [a, b], normal, facet, .. }) => {
                let antipodal = facet.and_then(Antipodal::of);
                [Seed::Previous { antipodal, hub: HubPair { a, b }, normal }, witness]
            }
            None => [witness, Seed::CentroidLine],
        };
        let walked = match &mut self.prover {
            Some(prover) => prover.depth(piece_a, piece_b, place, leaf, &seeds, &mut self.scratch),
            None => depth(piece_a, piece_b, place, &seeds, &mut self.scratch),
        };
        // The walk goes on from where it ended, whatever is admissible.
        self.front.remember_depth(leaf, walked.normal, [walked.hub.a, walked.hub.b], walked.antipodal.features());
        counters.walks += 1;
        counters.walk_steps += walked.steps;
        counters.walk_stops += u32::from(walked.stop != StopReason::Converged);
        counters.unproven += u32::from(walked.certainty != Certainty::GloballyOptimal);
        let (normals_a, normals_b) = (a.own_normals(leaf.piece_a), b.own_normals(leaf.piece_b));
        let (admissible, walk) = (&mut self.admissible, &mut self.scratch);
        let Some(real) = admissible_depth(&normals_a, &normals_b, place, &walked, None, admissible, walk) else {
            return Found::Nothing;
        };
        counters.moved += u32::from(real.moved);
        counters.admissible_stops += u32::from(real.moved && real.stop != StopReason::Converged);
        let contact = Contact {
            piece_a: leaf.piece_a,
            piece_b: leaf.piece_b,
            features: real.features,
            point_a: real.point_a,
            point_b: real.point_b,
            normal: real.normal,
            separation: -real.depth,
            extent: 0.0,
        };
        match real {
            AdmissibleDepth { moved: false, .. } => Found::Admissible(contact),
            AdmissibleDepth { owned: true, facing: (point_a, point_b), .. } => {
                Found::Moved(contact, Contact { point_a, point_b, ..contact })
            }
            _ => Found::Inadmissible(contact),
        }
    }
}

/// What a pair of pieces within tolerance comes to.
enum Found {
    /// Closest points that are no contact of this pair.
    Nothing,
    /// A contact along the direction of least distance or depth.
    Admissible(Contact),
    /// A contact along another direction, the least that the pieces own; and with its points on its features, to be believed or not.
    Moved(Contact, Contact),
    /// An overlap without a normal that both pieces own; the contact along the best that one does.
    Inadmissible(Contact),
}

/// What proofs need: working memory, and what they remember of the pairs that were proven last.
#[derive(Clone, Debug)]
struct Prover {
    scratch: ProofScratch,
    /// Pieces of a and b; pairs that share a place take turns, and then begin anew each time.
    places: Vec<([u32; 2], CertificateMemory)>,
}

impl Prover {
    /// Pairs remembered: those of a handful of touching pieces, at about 8 kB each.
    const PLACES: usize = 64;

    fn new() -> Self {
        let places = (0..Self::PLACES).map(|_| ([u32::MAX; 2], CertificateMemory::new())).collect();
        Self { scratch: ProofScratch::new(), places }
    }

    fn clear(&mut self) {
        self.places.iter_mut().for_each(|(_, memory)| memory.clear());
    }

    fn depth(
        &mut self,
        piece_a: &Polytope,
        piece_b: &Polytope,
        place: &Placement,
        leaf: &LeafPair,
        seeds: &[Seed],
        walk: &mut WalkScratch,
    ) -> Depth {
        // Fibonacci hashing: the odd multiplier is 2³² over the golden ratio.
        let hash = leaf.piece_a.wrapping_mul(31).wrapping_add(leaf.piece_b).wrapping_mul(0x9E37_79B9);
        let (pieces, memory) = &mut self.places[(hash >> 26) as usize % Self::PLACES];
        if *pieces != [leaf.piece_a, leaf.piece_b] {
            *pieces = [leaf.piece_a, leaf.piece_b];
            memory.clear();
        }
        depth_proven(piece_a, piece_b, place, seeds, memory, &mut self.scratch, walk)
    }
}

/// The farthest that any point of the body's bounding box moves from one placement to another.
///
/// The displacement field of a rigid motion is affine, so its norm is largest at a corner.
fn travel(body: &Body, from: &Placement, to: &Placement) -> f64 {
    let Aabb { min, max } = body.mesh().bounds();
    let corner = |k: u32| {
        let pick = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 1 { high } else { low };
        let p = DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z));
        to.point(p).distance_squared(from.point(p))
    };
    (0..8).map(corner).fold(0.0, f64::max).sqrt()
}

fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}

fn pieces<'a>(a: &'a Body, b: &'a Body, piece_a: u32, piece_b: u32) -> (&'a Polytope, &'a Polytope) {
    (&a.polytopes()[piece_a as usize], &b.polytopes()[piece_b as usize])
}

fn at_closest(leaf: &LeafPair, closest: &Closest) -> Contact {
    Contact {
        piece_a: leaf.piece_a,
        piece_b: leaf.piece_b,
        features: closest.features,
        point_a: closest.point_a,
        point_b: closest.point_b,
        normal: closest.normal,
        separation: closest.distance,
        extent: 0.0,
    }
}

/// Moves the points of `contact` to where they change continuously.
fn blend_witness(
    a: &Body,
    b: &Body,
    place: &Placement,
    contact: &mut Contact,
    angle: f64,
    counters: &mut QueryCounters,
) {
    let Contact { piece_a, piece_b, features, point_a, point_b, normal, separation, .. } = *contact;
    let (piece_a, piece_b) = (&a.polytopes()[piece_a as usize], &b.polytopes()[piece_b as usize]);
    let blend = blend(piece_a, piece_b, place, &Touch { features, point_a, point_b, normal }, angle);
    counters.blended += u32::from(blend.rounds > 0);
    counters.blend_stops += u32::from(!blend.converged);
    contact.extent = blend.extent;
    let midpoint = contact.midpoint() + blend.shift;
    contact.point_a = midpoint + normal * (0.5 * separation);
    contact.point_b = midpoint - normal * (0.5 * separation);
}

/// True if the closest points lie on the surfaces of both meshes and their direction is one that both own there: else they are a
/// contact of another pair of pieces, or of none.
fn is_surface(a: &Body, b: &Body, place: &Placement, leaf: &LeafPair, closest: &Closest) -> bool {
    let Closest { point_a, point_b, normal, features, .. } = *closest;
    a.owns(leaf.piece_a, features.a, place.inverse_point(point_a), place.inverse_vector(-normal))
        && b.owns(leaf.piece_b, features.b, point_b, normal)
}
