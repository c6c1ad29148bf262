//! The search for a proof: steps 1 to 4 of the parent module.

use glam::DVec3;

use super::super::antipodal::{Corner, Facet};
use super::super::cso::Cso;
use super::super::inner::{Joint, Refusal, Surface, judged};
use super::super::seed::Start;
use super::super::walk::{Walked, settle, walk};
use super::super::witness::{Clip, answer_at, answer_on};
use super::super::{Antipodal, Certainty, Depth, HubPair};
use super::CertificateMemory;
use crate::algebra::tolerance::{
    FLUSH_WITNESS, PROOF_BEGIN, PROOF_BLIND, PROOF_GROWTHS, PROOF_RELATIVE, PROOF_REPAIRS, PROOF_ROUNDING,
};
use crate::collision::StopReason;

/// The state of the pair, or the surface, on which a proof is based.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ground {
    /// The pair touches.
    Touching,
    /// A surface of an earlier tick. Only the triangles that may be too near to the origin were
    /// measured.
    PartlyMeasured,
    /// A surface of an earlier tick. The whole surface was measured and repaired.
    Kept,
    /// A surface grown from a tetrahedron.
    Grown,
}

pub(in super::super) struct Search<'s, 'p> {
    cso: &'s Cso<'p>,
    /// The direction with the least h found so far.
    best: Start,
    /// The answer along `best`. `None` if `best` was found after the last answer.
    answer: Option<Depth>,
    /// Corners of the triangle nearest to the origin. The triangle lies in the facet along `best`,
    /// or in another facet at the same distance.
    facet: Option<[HubPair; 3]>,
    /// Number of steps of all walks together.
    steps: u32,
    /// The first part of the tolerance: the rounding. The second part is [`PROOF_RELATIVE`] times
    /// the depth.
    rounding: f64,
    pub(in super::super) growths: u32,
    surface: &'s mut Surface,
    clip: &'s mut Clip,
}

impl<'s, 'p> Search<'s, 'p> {
    pub(in super::super) fn new(
        cso: &'s Cso<'p>,
        best: Start,
        answer: Option<Depth>,
        surface: &'s mut Surface,
        clip: &'s mut Clip,
    ) -> Self {
        let Cso { a, b, pose_ba } = *cso;
        // Points of the CSO are differences of coordinates, and the rounding is relative to these
        // coordinates.
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
            clip,
        }
    }

    /// Runs the proof, first from the memory, then from a tetrahedron. Returns the proven answer.
    /// If no proof is found, returns the best known answer.
    pub(in super::super) fn run(&mut self, memory: &mut CertificateMemory) -> Depth {
        let outcome = match self.warm(memory) {
            Err(_) if self.answer.is_none() => self.cold(PROOF_BLIND).or_else(|_| {
                self.adopt_walk_end();
                self.cold(PROOF_GROWTHS)
            }),
            Err(_) => self.cold(PROOF_GROWTHS),
            warm => warm,
        };
        match outcome {
            Ok(ground) => {
                self.keep(memory, ground);
                self.proven()
            }
            Err(stop) => {
                memory.clear();
                Depth { certainty: Certainty::LocallyOptimal, stop, ..self.answer() }
            }
        }
    }

    /// Finds the depth without an earlier answer, in a bounded number of growth steps. Returns the
    /// proven answer. If the steps do not suffice, returns the answer along the best direction
    /// found.
    pub(in super::super) fn run_anew(&mut self) -> Depth {
        let outcome = self.cold(PROOF_BLIND);
        let answer = if outcome.is_ok() { self.proven() } else { self.answer() };
        Depth { steps: answer.steps + self.growths, ..answer }
    }

    fn proven(&mut self) -> Depth {
        Depth { certainty: Certainty::GloballyOptimal, stop: StopReason::Converged, ..self.answer() }
    }

    /// Searches for a proof that starts from the surface in the memory.
    fn warm(&mut self, memory: &mut CertificateMemory) -> Result<Ground, StopReason> {
        if self.touches()? {
            return Ok(Ground::Touching);
        }
        if !memory.serves(self.cso) {
            return Err(StopReason::Stalled);
        }
        memory.advance(self.cso);
        if self.is_still_proven(memory) {
            return Ok(Ground::PartlyMeasured);
        }
        self.surface.clear(self.slack(), true);
        memory.hubs.iter().for_each(|&hub| self.surface.push_tip(self.cso, hub));
        memory.triangles.iter().for_each(|&joint| self.surface.push_triangle(joint));
        self.grow(PROOF_REPAIRS)?;
        Ok(Ground::Kept)
    }

    /// Measures the triangles of the kept surface that may be too near to the origin. Returns true
    /// if no triangle is too near.
    fn is_still_proven(&self, memory: &mut CertificateMemory) -> bool {
        let bar = self.bar();
        let CertificateMemory { hubs, triangles, safe_until, moved, .. } = memory;
        if *moved * f64::EPSILON > self.slack() {
            // The rounding of the sum is too large. A new measurement resets the sum to zero.
            return false;
        }
        for (safe_until, Joint { tips, .. }) in safe_until.iter_mut().zip(triangles) {
            let distance = *safe_until - *moved;
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
            *safe_until = *moved + if offset.is_finite() { offset } else { bar };
        }
        true
    }

    /// Returns the distance from the origin at which a triangle needs no growth.
    #[inline]
    fn bar(&self) -> f64 {
        self.best.offset - self.tolerance()
    }

    /// Returns the tolerance. A height that differs from the depth by less than this counts as
    /// equal to the depth.
    #[inline]
    fn tolerance(&self) -> f64 {
        PROOF_RELATIVE * self.best.offset.max(0.0) + self.rounding
    }

    /// Returns the limit below which a height counts as rounding. It is a quarter of the tolerance
    /// if the answer is known, else a quarter of the rounding.
    fn slack(&self) -> f64 {
        0.25 * if self.answer.is_some() { self.tolerance() } else { self.rounding }
    }

    /// Walks from the best direction, and replaces the best direction by the direction at the
    /// end of the walk. With the exact depth, fewer triangles are near enough to grow. In
    /// particular, triangles of nearly flush features usually do not grow. Rounding may tear the
    /// surface at these triangles.
    fn adopt_walk_end(&mut self) {
        let Depth { hub, normal, depth, .. } = self.answer();
        self.best = Start { hub, normal, offset: depth };
    }

    /// Searches for a proof that starts from a tetrahedron, in at most `most` growth steps.
    fn cold(&mut self, most: u32) -> Result<Ground, StopReason> {
        if self.touches()? {
            return Ok(Ground::Touching);
        }
        self.surface.clear(self.slack(), false);
        if !self.begin()? {
            // The CSO has no volume. So h is zero within rounding along some direction, and the
            // search has found this direction.
            return if self.touches()? { Ok(Ground::Touching) } else { Err(StopReason::Stalled) };
        }
        self.grow(most)?;
        Ok(Ground::Grown)
    }

    /// Returns true if the depth is zero within rounding. Fails if the depth is negative.
    fn touches(&self) -> Result<bool, StopReason> {
        if self.best.offset < -self.tolerance() {
            return Err(StopReason::Stalled);
        }
        Ok(self.best.offset <= self.tolerance())
    }

    /// Creates a tetrahedron of supports. Returns false if the CSO has no volume.
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

    /// Returns the support along `direction` or its opposite, on the origin's side of `from`. If
    /// this support is nearly level with `from`, returns the farther of the two supports. Returns
    /// `known` if `direction` is zero.
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

    /// Returns the support along `normal`. Stores the direction as the best direction if its h is
    /// the least so far.
    #[inline]
    fn support(&mut self, normal: DVec3) -> HubPair {
        let (hub, offset) = self.cso.support_anew(normal);
        // A value that is lower only by rounding does not replace the answer, because the answer's
        // normal is exact.
        if offset < self.best.offset - 0.5 * self.tolerance() {
            self.best = Start { hub, normal, offset };
            self.answer = None;
        }
        hub
    }

    /// Returns the answer along the best direction. If a walk from this direction ends lower,
    /// returns the answer at the end of the walk.
    ///
    /// If features are parallel within rounding, the walk may end slightly above its start, because
    /// its tolerance for corners is larger than the tolerance of the proof. In this case the answer
    /// has the best direction.
    fn answer(&mut self) -> Depth {
        if let Some(answer) = self.answer {
            return answer;
        }
        let Start { hub, normal, offset } = self.best;
        let answer = match self.walk_to_answer() {
            Some(walked) if walked.corner.offset <= offset => {
                self.steps += walked.steps;
                answer_at(self.cso, &Walked { steps: self.steps, ..walked }, self.clip)
            }
            _ => {
                let (facet, antipodal) = Facet::supported(self.cso, hub, normal, FLUSH_WITNESS);
                let antipodal = antipodal.unwrap_or_else(|| Antipodal::beside(self.cso, hub));
                let corner = Corner { normal, offset, antipodal, hub };
                let walked = Walked { corner, alone: false, steps: self.steps, stop: StopReason::Stalled };
                answer_on(self.cso, &facet, &walked, self.clip)
            }
        };
        self.answer = Some(answer);
        answer
    }

    /// Returns the facet along the best direction if the facet is known. Otherwise walks from a
    /// facet beside the hub pair.
    fn walk_to_answer(&self) -> Option<Walked> {
        let known = self.facet.and_then(|hubs| Antipodal::spanned(self.cso.a, self.cso.b, hubs));
        let highest = self.best.offset + self.tolerance();
        known
            .and_then(|antipodal| settle(self.cso, antipodal))
            .filter(|walked| walked.corner.offset <= highest)
            .or_else(|| walk(self.cso, Antipodal::beside(self.cso, self.best.hub), None))
    }

    /// Grows the surface, nearest triangle first, until no triangle is nearer to the origin than
    /// the depth.
    fn grow(&mut self, most: u32) -> Result<(), StopReason> {
        let most = self.growths + most;
        loop {
            let low = self.surface.nearest();
            let near = low.offset < self.bar();
            if !near {
                self.facet = low.offset.is_finite().then(|| self.surface.hubs(low.triangle));
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
            debug_assert_eq!(self.surface.validate(self.cso), Ok(()));
            debug_assert!(self.surface.nearest().offset >= bar, "a triangle is nearer to the origin than the depth");
            memory.keep(self.cso, self.surface, bar, ground == Ground::Grown);
        }
    }
}
