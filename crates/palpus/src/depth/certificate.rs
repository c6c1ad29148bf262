//! Proof that a depth is globally the least: the certificate, which goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction next to which h is nowhere smaller. That none is smaller anywhere is shown by a closed
//! surface within the CSO, around the origin, that keeps u = h(n) away from it (see the module on the inner surface). Where a
//! triangle comes nearer than u, the CSO is asked for its support along the triangle's normal n':
//!
//! * h(n') is less than u: a better direction was missed, and u is smaller from now on.
//! * h(n') is not: the support lies above the triangle, and the surface grows to it.
//!
//! So it goes on until no triangle is nearer than u, with the nearest always first: what then is grown was nearer than the depth, so
//! nothing is grown in vain, even while u is only the h of the seeds. From nothing it is the expanding polytope
//! algorithm (van den Bergen 2001), which finds depth and proof at once; a walk from the direction it ends in gives the exact
//! features. Along motion the walk comes first, and what is proven from is kept: the surface of the last tick, whose corners
//! are pairs of vertices of the bodies, is after a small motion still a surface within the CSO. It is judged anew and repaired
//! where motion brought it too near.
//!
//! 1. Touching pairs: a depth of no more than rounding needs no proof.
//! 2. Most of the kept surface is farther from the origin than u by more than anything has moved since it was measured; that part
//!    sleeps. Measure the rest at the new pose. If it keeps off, that was all.
//! 3. Else judge the whole kept surface at the new pose and grow it where it is too near; if repairing it takes too much,
//!    grow a new one from a tetrahedron.
//! 4. Keep the surface. One that has gathered many more triangles than it began with is dropped: what it gathered was for
//!    poses of the past.
//!
//! That sleeping triangles and measured ones make one surface around the origin: it was one when last judged whole, and no triangle of
//! it has passed over the origin since, as long as each has moved less than it was away at each measurement.
//!
//! Proven means: no direction has an h smaller than the depth by more than [`PROOF_RELATIVE`] of it or by rounding.

use super::cso::Cso;
use super::descent::settle;
use super::inner::{Joint, Refusal, Surface, judged};
use super::overlay::Corner;
use super::query::{answer_at, depth_once, lowest_start, scan, walk_from};
use super::seed::{Seed, Start};
use super::walk::Walked;
use super::{Antipodal, Certainty, Depth, HubPair, WalkScratch};
use crate::algebra::Placement;
use crate::algebra::tolerance::{
    KEPT_CORNERS, KEPT_TRIANGLES, PROOF_BEGIN, PROOF_BLIND, PROOF_GATHERED, PROOF_GROWTHS, PROOF_RELATIVE,
    PROOF_REPAIRS, PROOF_ROUNDING,
};
use crate::body::Polytope;
use crate::collision::StopReason;
use glam::DVec3;

/// What the proofs of one pair of polytopes hand on from tick to tick. It holds for that pair only; any pose will do, near
/// ones save time.
#[derive(Clone, Debug)]
pub struct CertificateMemory {
    hubs: Vec<HubPair>,
    triangles: Vec<Joint>,
    /// Of each triangle: its distance from the origin when it was measured, plus `moved` as it was then.
    awake_at: Vec<f64>,
    /// At least how far any point has moved since the surface was judged whole.
    moved: f64,
    /// The last pose.
    pose_ba: Placement,
    /// What tells one pair of polytopes from another.
    pair: [f64; 4],
    /// Triangles of the surface when it was new.
    fresh: usize,
}

impl CertificateMemory {
    /// Empty, with room for a surface of [`KEPT_CORNERS`] corners (about 12 kB). What needs more is proven from nothing each time.
    pub fn new() -> Self {
        Self {
            hubs: Vec::with_capacity(KEPT_CORNERS),
            triangles: Vec::with_capacity(KEPT_TRIANGLES),
            awake_at: Vec::with_capacity(KEPT_TRIANGLES),
            moved: 0.0,
            pose_ba: Placement::IDENTITY,
            pair: [0.0; 4],
            fresh: 0,
        }
    }

    /// Forgets the pair.
    pub fn clear(&mut self) {
        self.hubs.clear();
        self.triangles.clear();
        self.awake_at.clear();
    }

    /// True if it holds a surface, and of these two polytopes.
    fn serves(&self, cso: &Cso<'_>) -> bool {
        !self.triangles.is_empty() && self.pair == pair_of(cso)
    }

    /// Counts the motion from the last pose to this one.
    fn advance(&mut self, cso: &Cso<'_>) {
        let (from, to) = (&self.pose_ba, cso.pose_ba);
        let centre = cso.a.centroid();
        // Twice the sine of half the angle: how far a point at unit distance from the axis moves.
        let turn = (0..3).map(|k| (to.rotation.col(k) - from.rotation.col(k)).length_squared()).sum::<f64>() * 0.5;
        self.moved += to.point(centre).distance(from.point(centre)) + turn.sqrt() * cso.a.radius();
        self.pose_ba = *to;
    }

    fn keep(&mut self, cso: &Cso<'_>, surface: &Surface, bar: f64, new: bool) {
        self.clear();
        let count = surface.joints().len();
        if new {
            self.fresh = count;
        }
        let gathered = count > PROOF_GATHERED * (self.fresh + 1);
        if gathered || count > KEPT_TRIANGLES || surface.tips().len() > KEPT_CORNERS {
            return;
        }
        self.pair = pair_of(cso);
        self.pose_ba = *cso.pose_ba;
        self.moved = 0.0;
        self.hubs.extend(surface.tips().iter().map(|tip| tip.hub));
        self.triangles.extend_from_slice(surface.joints());
        let finite = |&offset: &f64| if offset < f64::INFINITY { offset } else { bar };
        self.awake_at.extend(surface.offsets().iter().map(finite));
    }
}

fn pair_of(cso: &Cso<'_>) -> [f64; 4] {
    let Cso { a, b, .. } = *cso;
    [a.vertices().len() as f64, b.vertices().len() as f64, a.radius(), b.radius()]
}

impl Default for CertificateMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// Working memory of proofs, of fixed size; one may serve any number of pairs, one after another.
#[derive(Clone, Debug)]
pub struct ProofScratch {
    surface: Surface,
    growths: u32,
}

impl ProofScratch {
    /// All the memory that any proof needs.
    pub fn new() -> Self {
        Self { surface: Surface::new(), growths: 0 }
    }

    /// What the last proof took: times that a surface grew.
    pub fn growths(&self) -> u32 {
        self.growths
    }
}

impl Default for ProofScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// The penetration depth of `a` and `b` with proof, as far as one is found.
///
/// With a surface of an earlier tick in the memory: one walk from the lowest of the seeds, then [`prove`]. Without one,
/// the walk is spared: the surface is grown first, which finds the direction, and the walk is only asked for the features there.
pub fn depth_proven(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    seeds: &[Seed],
    memory: &mut CertificateMemory,
    proof: &mut ProofScratch,
    walk: &mut WalkScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    if memory.serves(&cso) {
        let answer = depth_once(a, b, pose_ba, seeds, walk);
        return prove(a, b, pose_ba, &answer, memory, proof, walk);
    }
    walk.trail.clear();
    let mut search = Search::new(&cso, lowest_start(&cso, seeds), None, &mut proof.surface, walk);
    let answer = search.run(memory);
    proof.growths = search.growths;
    answer
}

/// Proves `answer`, which [`depth`](super::depth) gave for this pose, or finds a better one and proves that.
///
/// `memory` is that of the same two polytopes, from an earlier pose or empty. The certainty of what is returned is
/// [`Certainty::GloballyOptimal`] if the proof is complete; if not, it is the best known answer, and its `stop` says why the proof
/// ended. The memory is then empty. A pair that turns out to be apart (negative depth) isn't proven: that is for the
/// distance to say.
pub fn prove(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    answer: &Depth,
    memory: &mut CertificateMemory,
    proof: &mut ProofScratch,
    walk: &mut WalkScratch,
) -> Depth {
    let cso = Cso { a, b, pose_ba };
    walk.trail.clear();
    let start = Start { hub: answer.hub, normal: answer.normal, offset: answer.depth };
    let mut search = Search::new(&cso, start, Some(*answer), &mut proof.surface, walk);
    let answer = search.run(memory);
    proof.growths = search.growths;
    answer
}

/// What a proof rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ground {
    /// The pair touches.
    Touching,
    /// A surface of an earlier tick, measured where that was needed.
    Asleep,
    /// A surface of an earlier tick, judged whole and repaired.
    Kept,
    /// A surface grown from nothing.
    Grown,
}

struct Search<'s, 'p> {
    cso: &'s Cso<'p>,
    /// The direction of the least h found so far.
    best: Start,
    /// The answer there, unless the direction is newer.
    answer: Option<Depth>,
    /// Corners of the facet there, if a triangle of the surface lies in it.
    facet: Option<[HubPair; 3]>,
    /// Moves of walks.
    steps: u32,
    /// Heights nearer than this to the depth are as good, beside [`PROOF_RELATIVE`] of the depth.
    rounding: f64,
    growths: u32,
    surface: &'s mut Surface,
    walk: &'s mut WalkScratch,
}

impl<'s, 'p> Search<'s, 'p> {
    fn new(
        cso: &'s Cso<'p>,
        best: Start,
        answer: Option<Depth>,
        surface: &'s mut Surface,
        walk: &'s mut WalkScratch,
    ) -> Self {
        let Cso { a, b, pose_ba } = *cso;
        // Rounding is relative to the coordinates of which the CSO's points are differences.
        let coordinates =
            cso.size() + pose_ba.point(a.centroid()).length() + a.centroid().length() + b.centroid().length();
        let steps = answer.map_or(0, |answer| answer.steps);
        Self {
            cso,
            best,
            answer,
            facet: None,
            steps,
            rounding: PROOF_ROUNDING * coordinates,
            growths: 0,
            surface,
            walk,
        }
    }

    /// The proof, warm or cold, and the answer that is proven or the best known.
    fn run(&mut self, memory: &mut CertificateMemory) -> Depth {
        let outcome = match self.warm(memory) {
            Err(_) if self.answer.is_none() => self.cold(PROOF_BLIND).or_else(|_| {
                self.believe_walk();
                self.cold(PROOF_GROWTHS)
            }),
            Err(_) => self.cold(PROOF_GROWTHS),
            warm => warm,
        };
        match outcome {
            Ok(ground) => {
                self.keep(memory, ground);
                Depth { certainty: Certainty::GloballyOptimal, ..self.answer() }
            }
            Err(stop) => {
                memory.clear();
                Depth { certainty: Certainty::LocallyOptimal, stop, ..self.answer() }
            }
        }
    }

    /// Proof from the surface that the memory holds.
    fn warm(&mut self, memory: &mut CertificateMemory) -> Result<Ground, StopReason> {
        if self.touches()? {
            return Ok(Ground::Touching);
        }
        if !memory.serves(self.cso) {
            return Err(StopReason::Stalled);
        }
        memory.advance(self.cso);
        if self.sleeps(memory) {
            return Ok(Ground::Asleep);
        }
        self.surface.clear(self.slack(), true);
        memory.hubs.iter().for_each(|&hub| self.surface.push_tip(self.cso, hub));
        memory.triangles.iter().for_each(|&joint| self.surface.push_triangle(joint));
        self.grow(PROOF_REPAIRS)?;
        Ok(Ground::Kept)
    }

    /// True if those triangles of the kept surface that may have come too near have not.
    fn sleeps(&self, memory: &mut CertificateMemory) -> bool {
        let bar = self.bar();
        let CertificateMemory { hubs, triangles, awake_at, moved, .. } = memory;
        if *moved * f64::EPSILON > self.slack() {
            return false; // The sums have become too coarse; they begin anew.
        }
        for (awake_at, Joint { tips, .. }) in awake_at.iter_mut().zip(triangles) {
            let distance = *awake_at - *moved;
            if distance >= bar {
                continue;
            }
            if distance <= 0.0 {
                return false;
            }
            let (_, offset) = judged(tips.map(|tip| self.cso.vertex(hubs[usize::from(tip)])), self.slack());
            if offset < bar {
                return false;
            }
            *awake_at = *moved + if offset.is_finite() { offset } else { bar };
        }
        true
    }

    /// What is no nearer than this needs no growth.
    #[inline]
    fn bar(&self) -> f64 {
        self.best.offset - self.tolerance()
    }

    /// Heights nearer than this to the depth are as good.
    #[inline]
    fn tolerance(&self) -> f64 {
        PROOF_RELATIVE * self.best.offset.max(0.0) + self.rounding
    }

    /// Lengths below this are rounding; of a depth that is known, part of what the proof may leave.
    fn slack(&self) -> f64 {
        0.25 * if self.answer.is_some() { self.tolerance() } else { self.rounding }
    }

    /// Goes on from where a walk ends that starts from the best direction. With the depth known exactly, fewer triangles come near enough to be
    /// grown, and those of nearly flush features, which rounding may tear, mostly not.
    fn believe_walk(&mut self) {
        let Depth { hub, normal, depth, .. } = self.answer();
        self.best = Start { hub, normal, offset: depth };
    }

    /// Proof from nothing, in at most so many growths.
    fn cold(&mut self, most: u32) -> Result<Ground, StopReason> {
        if self.touches()? {
            return Ok(Ground::Touching);
        }
        self.surface.clear(self.slack(), false);
        if !self.begin()? {
            // No volume: then some direction has an h of rounding, and it was found.
            return if self.touches()? { Ok(Ground::Touching) } else { Err(StopReason::Stalled) };
        }
        self.grow(most)?;
        Ok(Ground::Grown)
    }

    /// True if the depth is zero within rounding; an error if it is negative.
    fn touches(&self) -> Result<bool, StopReason> {
        if self.best.offset < -self.tolerance() {
            return Err(StopReason::Stalled);
        }
        Ok(self.best.offset <= self.tolerance())
    }

    /// A tetrahedron of supports. False if the CSO has no volume.
    fn begin(&mut self) -> Result<bool, StopReason> {
        let Start { hub: first, normal, .. } = self.best;
        let second = self.support(-normal);
        let [p, q] = [first, second].map(|hub| self.cso.vertex(hub));
        let third = self.support_off(second, p, (q - p).any_orthogonal_vector());
        let r = self.cso.vertex(third);
        let fourth = self.support_off(third, p, (q - p).cross(r - p));
        [first, second, third, fourth].iter().for_each(|&hub| self.surface.push_tip(self.cso, hub));
        Ok(self.surface.close_tetrahedron())
    }

    /// The support along ± `direction` on the side of `from` where the origin is, or on the other if there is none off
    /// `from`; `known` if there is no direction.
    fn support_off(&mut self, known: HubPair, from: DVec3, direction: DVec3) -> HubPair {
        let Some(normal) = direction.try_normalize() else { return known };
        let normal = if normal.dot(from) <= 0.0 { normal } else { -normal };
        let toward = self.support(normal);
        if normal.dot(self.cso.vertex(toward) - from) > PROOF_BEGIN * self.cso.size() {
            return toward;
        }
        let away = self.support(-normal);
        let [one, other] = [toward, away].map(|hub| normal.dot(self.cso.vertex(hub) - from).abs());
        if one >= other { toward } else { away }
    }

    /// The support along `normal`, which is noted if h is less there than anywhere else so far.
    #[inline]
    fn support(&mut self, normal: DVec3) -> HubPair {
        let (hub, offset) = self.cso.support_anew(normal);
        // What is lower by no more than rounding is no better than the answer with its exact normal.
        if offset < self.best.offset - 0.5 * self.tolerance() {
            self.best = Start { hub, normal, offset };
            self.answer = None;
        }
        hub
    }

    /// The answer at the best direction: where a walk from there ends.
    ///
    /// Where features are parallel but for rounding, the walk tells corners apart less finely than the proof does and may
    /// end a little above where it began. Then the direction itself is the answer, next to the features where the walk ended.
    fn answer(&mut self) -> Depth {
        if let Some(answer) = self.answer {
            return answer;
        }
        let mut walked = self.walk_to_answer();
        if walked.corner.offset > self.best.offset {
            let Start { hub, normal, offset } = self.best;
            walked = Walked { corner: Corner { normal, offset, hub, ..walked.corner }, alone: false, ..walked };
        }
        self.steps += walked.steps;
        let answer = answer_at(self.cso, &Walked { steps: self.steps, ..walked }, &mut self.walk.clip);
        self.answer = Some(answer);
        answer
    }

    /// Where a walk from the best direction ends, begun at the facet there if that is known.
    fn walk_to_answer(&mut self) -> Walked {
        let known = self.facet.and_then(|hubs| Antipodal::spanned(self.cso.a, self.cso.b, hubs));
        let highest = self.best.offset + self.tolerance();
        known
            .and_then(|antipodal| settle(self.cso, antipodal))
            .filter(|walked| walked.corner.offset <= highest)
            .or_else(|| walk_from(self.cso, self.best, false, &mut self.walk.trail))
            .unwrap_or_else(|| scan(self.cso))
    }

    /// Grows the surface, nearest triangle first, until it keeps the depth away from the origin.
    fn grow(&mut self, most: u32) -> Result<(), StopReason> {
        let most = self.growths + most;
        loop {
            let low = self.surface.nearest();
            let near = low.offset < self.bar();
            if !near {
                self.facet = (low.normal == self.best.normal).then(|| self.surface.hubs(low.triangle));
                return if low.offset.is_finite() { Ok(()) } else { Err(StopReason::Stalled) };
            }
            if self.growths == most {
                return Err(StopReason::Budget);
            }
            self.growths += 1;
            let hub = self.support(low.normal);
            if self.best.offset < -self.tolerance() {
                return Err(StopReason::Stalled);
            }
            let near = low.offset < self.bar();
            if !near {
                continue;
            }
            self.surface.grow(self.cso, low.triangle, hub).map_err(|refusal| match refusal {
                Refusal::Full => StopReason::Budget,
                Refusal::Torn => StopReason::Stalled,
            })?;
        }
    }

    fn keep(&mut self, memory: &mut CertificateMemory, ground: Ground) {
        if ground == Ground::Kept || ground == Ground::Grown {
            self.surface.compact();
            let bar = self.bar();
            memory.keep(self.cso, self.surface, bar, ground == Ground::Grown);
        }
    }
}
