//! Separation distance of two convex polytopes by Voronoi marching \[K02 §3.2; Lin and Canny 1991; Mirtich 1998\].
//!
//! The state is a pair of closed features, one on each body, and nothing else. A step finds the closest points of the two
//! features, then:
//!
//! 1. When a point lies on the boundary of its feature, the feature shrinks to that boundary (edge → vertex, face → edge).
//! 2. When a point violates a Voronoi plane of the other's feature, that feature grows across the most violated plane
//!    (vertex → edge, edge → face). The distance of the closed features strictly decreases.
//! 3. When an edge would pair with a face, it is clipped to the prism over the face. It crosses the face (the bodies overlap),
//!    or the derivative of its height names the end that is nearest: a vertex over the face, or an edge along a side.
//! 4. A vertex below a face is a local minimum. Either the vertex is inside of the whole body (they overlap), or some
//!    other face sees it from above and the march goes on there.
//! 5. Otherwise the pair is closest. The answer is not believed but proven: no vertex of either body may reach farther
//!    along the normal than the closest points do, which one ring per body decides.
//!
//! The next state depends on the state alone, so a repeated state means a cycle. A cycle, an exhausted budget or a failed proof
//! falls back to GJK, which answers under the same contract, and the stop reason says so. An overlap is always
//! witnessed: a vertex inside, an edge through a face, or features within touching distance.
//!
//! Deviations from V-Clip: features are closed and their closest points explicit, so that progress is a decrease of distance
//! rather than a chain of region tests; growth needs a gain above rounding and shrinking does not, so that parallel features
//! don't cycle; the scan of all faces at a local minimum is a climb over adjacent faces (a support query on the polar dual).
//! Plates need no case of their own but one: below the front is above the back.

use glam::DVec3;

use super::clip::{OverFace, SegmentParameters, closest_parameters, over_face};
use super::gjk::{centroid_line, gjk, position_noise, some_vertex};
use super::voronoi::{beyond_edge, beyond_face, beyond_vertex, lowest_cover};
use super::{Closest, Overlap, Proximity, StopReason};
use crate::algebra::Placement;
use crate::algebra::tolerance::{MARCH_NOISE, MARCH_PROOF, MARCH_STEPS, TOUCHING};
use crate::body::Feature::{Edge, Face, Vertex};
use crate::body::{Feature, FeaturePair, Polytope};

/// The answer of a distance query and where to start the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct March {
    /// Apart or overlapping, in b's frame.
    pub proximity: Proximity,
    /// Where to start from next time.
    pub features: FeaturePair,
    /// Feature pairs visited, the fallback's iterations included.
    pub steps: u32,
    /// `Converged` when the march answered; otherwise why the fallback did.
    pub stop: StopReason,
}

/// Finds the closest points of a and b; all of the answer is in b's frame. `pose_ba` is the frame of a in b.
///
/// `start` may be any features of the two; the last answer's make the query cheap. Bodies nearer than
/// [`TOUCHING`] times the sum of their radii count as overlapping.
pub fn march(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
    let pose_ab = pose_ba.inverse();
    let scale = Scale::of(a, b, pose_ba);
    let mut field = Field {
        a,
        b,
        pose_ba,
        pose_ab: &pose_ab,
        touching: scale.touching,
        noise: scale.noise,
        reach: scale.noise / MARCH_NOISE,
    };
    let start = FeaturePair { a: within(a, start.a), b: within(b, start.b) };
    let (first, steps) = field.walk(start);
    let candidate = match first {
        Walk::Overlap(overlap) => return answered(Proximity::Overlapping(overlap), overlap.features, steps),
        Walk::Apart(candidate) if candidate.excess <= scale.tight(candidate.closest.distance) => {
            return answered(Proximity::Disjoint(candidate.closest), candidate.closest.features, steps);
        }
        Walk::Apart(candidate) => candidate,
        Walk::Lost(pair, stop) => return fall_back(a, b, pose_ba, pair, steps, stop),
    };
    // Something reaches past the closest points, by little: features of the two are parallel but for an angle that the
    // dead zone of growth hides. Go on without it.
    field.noise = 0.0;
    let (second, more) = field.walk(candidate.closest.features);
    let steps = steps + more;
    let candidate = match second {
        Walk::Overlap(overlap) => return answered(Proximity::Overlapping(overlap), overlap.features, steps),
        Walk::Apart(sharper) if sharper.closest.distance <= candidate.closest.distance => sharper,
        _ => candidate,
    };
    if candidate.excess <= scale.loose(candidate.closest.distance) {
        return answered(Proximity::Disjoint(candidate.closest), candidate.closest.features, steps);
    }
    fall_back(a, b, pose_ba, candidate.closest.features, steps, StopReason::Stalled)
}

fn answered(proximity: Proximity, features: FeaturePair, steps: u32) -> March {
    March { proximity, features, steps, stop: StopReason::Converged }
}

#[cold]
fn fall_back(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    pair: FeaturePair,
    steps: u32,
    stop: StopReason,
) -> March {
    let answer = gjk(a, b, pose_ba, pair);
    March { steps: steps + answer.steps, stop, ..answer }
}

/// The lengths, in metres, against which a pair's answers are judged.
struct Scale {
    /// Sum of the radii.
    size: f64,
    /// Rounding of a placed vertex.
    noise: f64,
    /// At or below this distance the bodies overlap.
    touching: f64,
}

impl Scale {
    #[inline]
    fn of(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> Self {
        let size = a.radius() + b.radius();
        let noise = position_noise(a, b, pose_ba);
        Self { size, noise, touching: (TOUCHING * size).max(noise) }
    }

    /// How far a vertex may reach past the closest points of an answer that needs no second look.
    #[inline]
    fn tight(&self, distance: f64) -> f64 {
        MARCH_PROOF * distance + self.noise
    }

    /// How far at most: the direction between near points is only known to the rounding of the points over their distance.
    fn loose(&self, distance: f64) -> f64 {
        MARCH_PROOF * (self.size + distance) + self.noise * self.size / distance
    }
}

/// How a walk over feature pairs ended.
enum Walk {
    /// At a pair that no growth improves.
    Apart(Candidate),
    /// At a witness of overlap.
    Overlap(Overlap),
    /// Nowhere, for that reason.
    Lost(FeaturePair, StopReason),
}

/// Closest points that are yet to be believed.
#[derive(Clone, Copy)]
struct Candidate {
    closest: Closest,
    /// How far the bodies reach past the closest points along the normal, in sum: the distance is at most that much too long.
    excess: f64,
}

/// What a walk works on.
struct Field<'a> {
    a: &'a Polytope,
    b: &'a Polytope,
    pose_ba: &'a Placement,
    pose_ab: &'a Placement,
    touching: f64,
    noise: f64,
    reach: f64,
}

impl Field<'_> {
    /// Steps from pair to pair until one is closest, with the number of steps.
    fn walk(&self, start: FeaturePair) -> (Walk, u32) {
        let mut pair = start;
        let mut seen = start;
        let mut next_mark = 2;
        for steps in 1..=MARCH_STEPS {
            match self.step(pair) {
                Step::Move(fa, fb) => {
                    pair = FeaturePair { a: fa, b: fb };
                    // Brent's cycle finder: compare with a state remembered at powers of two.
                    if pair == seen {
                        let walk = self.best_of_cycle(pair).map_or(Walk::Lost(pair, StopReason::Stalled), Walk::Apart);
                        return (walk, steps);
                    }
                    if steps == next_mark {
                        seen = pair;
                        next_mark *= 2;
                    }
                }
                Step::Apart(points) => return (Walk::Apart(self.candidate(pair, &points)), steps),
                Step::Overlap(fa, fb, direction) => {
                    let features = FeaturePair { a: fa, b: fb };
                    let known = direction != DVec3::ZERO;
                    let direction = if known { direction } else { centroid_line(self.a, self.b, self.pose_ba) };
                    return (Walk::Overlap(Overlap { features, direction }), steps);
                }
            }
        }
        (Walk::Lost(pair, StopReason::Budget), MARCH_STEPS)
    }

    /// Body a seen from b.
    #[inline]
    fn onto_b(&self) -> View<'_> {
        let Self { a, b, pose_ba, pose_ab, touching, noise, reach } = *self;
        View { p: a, q: b, p_in_q: pose_ba, q_in_p: pose_ab, noise, touching, reach }
    }

    /// Body b seen from a.
    #[inline]
    fn onto_a(&self) -> View<'_> {
        let Self { a, b, pose_ba, pose_ab, touching, noise, reach } = *self;
        View { p: b, q: a, p_in_q: pose_ab, q_in_p: pose_ba, noise, touching, reach }
    }

    #[inline]
    fn step(&self, pair: FeaturePair) -> Step {
        match (pair.a, pair.b) {
            (Vertex(v), Vertex(w)) => vertex_vertex(&self.onto_b(), v, w),
            (Vertex(v), Edge(e)) => vertex_edge(&self.onto_b(), v, e),
            (Vertex(v), Face(f)) => vertex_face(&self.onto_b(), v, f),
            (Edge(e), Vertex(w)) => vertex_edge(&self.onto_a(), w, e).mirrored(self.pose_ba),
            (Face(f), Vertex(w)) => vertex_face(&self.onto_a(), w, f).mirrored(self.pose_ba),
            (Edge(e), Edge(g)) => edge_edge(&self.onto_b(), &self.onto_a(), e, g),
            (Edge(e), Face(f)) => edge_face(&self.onto_b(), e, f, None),
            (Face(f), Edge(g)) => edge_face(&self.onto_a(), g, f, None).mirrored(self.pose_ba),
            (Face(f), Face(g)) => Step::Move(Vertex(self.a.face_vertices(f)[0]), Face(g)),
        }
    }

    /// The nearest of the pairs in the cycle through `pair`: parallel features may hand each other a distance that differs only in
    /// rounding. None when no pair of the cycle has closest points off its boundaries.
    #[cold]
    fn best_of_cycle(&self, pair: FeaturePair) -> Option<Candidate> {
        let mut best: Option<Candidate> = None;
        let mut here = pair;
        for _ in 0..MARCH_STEPS {
            let points = match (here.a, here.b) {
                (Vertex(v), Vertex(w)) => Some(between_vertices(&self.onto_b(), v, w)),
                (Vertex(v), Edge(e)) => vertex_over_edge(&self.onto_b(), v, e).ok(),
                (Edge(e), Vertex(w)) => vertex_over_edge(&self.onto_a(), w, e).ok().map(|p| p.mirrored(self.pose_ba)),
                (Vertex(v), Face(f)) => vertex_over_face(&self.onto_b(), v, f),
                (Face(f), Vertex(w)) => vertex_over_face(&self.onto_a(), w, f).map(|p| p.mirrored(self.pose_ba)),
                (Edge(e), Edge(g)) => between_edges(&self.onto_b(), e, g).ok(),
                _ => None,
            };
            if let Some(points) = points {
                let candidate = self.candidate(here, &points);
                let distance = candidate.closest.distance;
                if distance > self.touching && best.is_none_or(|b| distance < b.closest.distance) {
                    best = Some(candidate);
                }
            }
            match self.step(here) {
                Step::Move(fa, fb) => here = FeaturePair { a: fa, b: fb },
                _ => break,
            }
            if here == pair {
                break;
            }
        }
        best
    }

    /// The closest points of a pair, with how far other vertices reach past them: one ring per body shows it.
    #[inline]
    fn candidate(&self, pair: FeaturePair, points: &ClosestPoints) -> Candidate {
        let ClosestPoints { on_p, on_q, normal } = *points;
        let distance = (on_p - on_q).dot(normal);
        let closest = Closest { point_a: on_q + normal * distance, point_b: on_q, normal, distance, features: pair };
        let down = -self.pose_ab.vector(normal);
        let reach_a =
            climbed(self.a, some_vertex(self.a, pair.a), down) - down.dot(self.pose_ab.point(closest.point_a));
        let reach_b = climbed(self.b, some_vertex(self.b, pair.b), normal) - normal.dot(on_q);
        Candidate { closest, excess: reach_a.max(0.0) + reach_b.max(0.0) }
    }
}

/// A start for a pair without history: the vertices extreme along the line of the centroids.
pub fn initial_features(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> FeaturePair {
    let line = pose_ba.point(a.centroid()) - b.centroid();
    FeaturePair { a: Vertex(a.support_from(0, pose_ba.inverse_vector(-line))), b: Vertex(b.support_from(0, line)) }
}

/// Body p seen from body q's frame; each kind of feature pair is written once and used both ways round.
struct View<'a> {
    p: &'a Polytope,
    q: &'a Polytope,
    p_in_q: &'a Placement,
    q_in_p: &'a Placement,
    noise: f64,
    touching: f64,
    reach: f64,
}

/// What one step of the march decides; features in the order p, q, geometry in q's frame.
enum Step {
    /// Go on with this pair.
    Move(Feature, Feature),
    /// The closest points.
    Apart(ClosestPoints),
    /// They overlap: features, and a direction from q into p (zero when the features have none).
    Overlap(Feature, Feature, DVec3),
}

#[derive(Clone, Copy)]
struct ClosestPoints {
    on_p: DVec3,
    on_q: DVec3,
    /// Unit, from q into p.
    normal: DVec3,
}

impl ClosestPoints {
    #[inline]
    fn mirrored(self, q_in_p: &Placement) -> Self {
        Self { on_p: q_in_p.point(self.on_q), on_q: q_in_p.point(self.on_p), normal: -q_in_p.vector(self.normal) }
    }
}

impl Step {
    /// The same decision with p and q exchanged; `q_in_p` is the frame of the old q in the new one.
    #[inline]
    fn mirrored(self, q_in_p: &Placement) -> Self {
        match self {
            Self::Move(fp, fq) => Self::Move(fq, fp),
            Self::Apart(points) => Self::Apart(points.mirrored(q_in_p)),
            Self::Overlap(fp, fq, direction) => Self::Overlap(fq, fp, -q_in_p.vector(direction)),
        }
    }
}

#[inline]
fn between_vertices(view: &View<'_>, v: u32, w: u32) -> ClosestPoints {
    let (on_p, on_q) = (view.p_in_q.point(view.p.vertex(v)), view.q.vertex(w));
    ClosestPoints { on_p, on_q, normal: (on_p - on_q).normalize_or_zero() }
}

#[inline]
fn vertex_vertex(view: &View<'_>, v: u32, w: u32) -> Step {
    let points = between_vertices(view, v, w);
    if let Some(e) = beyond_vertex(view.q, w, points.on_p, view.noise) {
        return Step::Move(Vertex(v), Edge(e));
    }
    if let Some(e) = beyond_vertex(view.p, v, view.q_in_p.point(points.on_q), view.noise) {
        return Step::Move(Edge(e), Vertex(w));
    }
    if (points.on_p - points.on_q).dot(points.normal) <= view.touching {
        return Step::Overlap(Vertex(v), Vertex(w), DVec3::ZERO);
    }
    Step::Apart(points)
}

/// The points of vertex `v` of p and the line of edge `e` of q, or the end beyond which the vertex lies.
#[inline]
fn vertex_over_edge(view: &View<'_>, v: u32, e: u32) -> Result<ClosestPoints, u32> {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    let edge = view.q.edge(e);
    let (tail, head) = (view.q.vertex(edge.tail), view.q.vertex(edge.head));
    let d = head - tail;
    let t = (on_p - tail).dot(d) / d.length_squared();
    if t <= 0.0 {
        return Err(edge.tail);
    }
    if t >= 1.0 {
        return Err(edge.head);
    }
    let on_q = tail + d * t;
    Ok(ClosestPoints { on_p, on_q, normal: (on_p - on_q).normalize_or_zero() })
}

#[inline]
fn vertex_edge(view: &View<'_>, v: u32, e: u32) -> Step {
    let points = match vertex_over_edge(view, v, e) {
        Ok(points) => points,
        Err(end) => return Step::Move(Vertex(v), Vertex(end)),
    };
    let r = points.on_p - points.on_q;
    if r.dot(points.normal) <= view.touching {
        return Step::Overlap(Vertex(v), Edge(e), outward_of_edge(view.q, e));
    }
    if let Some(f) = beyond_edge(view.q, e, r, view.noise) {
        return Step::Move(Vertex(v), Face(f));
    }
    if let Some(g) = beyond_vertex(view.p, v, view.q_in_p.point(points.on_q), view.noise) {
        return Step::Move(Edge(g), Edge(e));
    }
    Step::Apart(points)
}

/// A direction within the normals of edge `e`, not unit.
fn outward_of_edge(polytope: &Polytope, e: u32) -> DVec3 {
    let crate::body::Edge { left, right, .. } = polytope.edge(e);
    polytope.plane(left).normal + polytope.plane(right).normal
}

#[inline]
fn vertex_face(view: &View<'_>, v: u32, f: u32) -> Step {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    if let Some(side) = beyond_face(view.q, f, on_p) {
        return Step::Move(Vertex(v), Edge(view.q.face_edges(f)[side]));
    }
    let plane = view.q.plane(f);
    let height = plane.height(on_p);
    if height.abs() <= view.touching {
        return Step::Overlap(Vertex(v), Face(f), plane.normal);
    }
    if height < 0.0 {
        return below_face(view, v, f, on_p);
    }
    match descending_edge(view, v, plane.normal) {
        Some(e) => edge_face(view, e, f, None),
        None => Step::Apart(ClosestPoints { on_p, on_q: on_p - plane.normal * height, normal: plane.normal }),
    }
}

/// The points of vertex `v` of p and face `f` of q when the vertex is over the face.
fn vertex_over_face(view: &View<'_>, v: u32, f: u32) -> Option<ClosestPoints> {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    let plane = view.q.plane(f);
    let height = plane.height(on_p);
    let over = height > 0.0 && beyond_face(view.q, f, on_p).is_none();
    over.then(|| ClosestPoints { on_p, on_q: on_p - plane.normal * height, normal: plane.normal })
}

/// The edge of vertex `v` of p that descends most steeply along `normal` (in q's frame), if by more than rounding.
#[inline]
fn descending_edge(view: &View<'_>, v: u32, normal: DVec3) -> Option<u32> {
    let down = -view.q_in_p.vector(normal);
    let origin = view.p.vertex(v);
    let mut best = None;
    let (mut best_drop_squared, mut best_length_squared) = (0.0, 1.0);
    for spoke in view.p.ring(v) {
        let d = view.p.vertex(spoke.neighbour) - origin;
        let drop = down.dot(d);
        if drop > view.noise {
            let (drop_squared, length_squared) = (drop * drop, d.length_squared());
            if drop_squared * best_length_squared > best_drop_squared * length_squared {
                best = Some(spoke.edge);
                (best_drop_squared, best_length_squared) = (drop_squared, length_squared);
            }
        }
    }
    best
}

/// A vertex under a face and within its prism, the local minimum of the march: inside of q, or over another face.
fn below_face(view: &View<'_>, v: u32, f: u32, on_p: DVec3) -> Step {
    if view.q.is_flat() {
        // Nothing is inside of a plate, nor over its rims: below the front (0) is above the back (1).
        return Step::Move(Vertex(v), Face(u32::from(f == 0)));
    }
    let cover = lowest_cover(view.q, f, on_p);
    if cover.inside {
        Step::Overlap(Vertex(v), Face(cover.face), view.q.plane(cover.face).normal)
    } else {
        Step::Move(Vertex(v), Face(cover.face))
    }
}

/// The points of the lines of two edges, or the features to which clamping shrinks them.
#[inline]
fn between_edges(view: &View<'_>, e: u32, g: u32) -> Result<ClosestPoints, (Feature, Feature)> {
    let (edge_p, edge_q) = (view.p.edge(e), view.q.edge(g));
    let tail_p = view.p_in_q.point(view.p.vertex(edge_p.tail));
    let dp = view.p_in_q.point(view.p.vertex(edge_p.head)) - tail_p;
    let tail_q = view.q.vertex(edge_q.tail);
    let dq = view.q.vertex(edge_q.head) - tail_q;
    let SegmentParameters { s, t } = closest_parameters(tail_p, dp, tail_q, dq);
    let (end_p, end_q) = (end_of(s, edge_p), end_of(t, edge_q));
    if end_p.is_some() || end_q.is_some() {
        return Err((end_p.unwrap_or(Edge(e)), end_q.unwrap_or(Edge(g))));
    }
    let (on_p, on_q) = (tail_p + dp * s, tail_q + dq * t);
    let r = on_p - on_q;
    // The edges' cross product is known to an ulp over the sine of their angle, the points' line to ulps of the reach over
    // its length.
    let cross = dp.cross(dq);
    let lengths = dp.length_squared() * dq.length_squared();
    let normal = if cross.length_squared() * (view.reach * view.reach) > r.length_squared() * lengths {
        // The sides tell the sign where the points are too near.
        let sign = cross.dot(r);
        cross.normalize() * if sign == 0.0 { cross.dot(outward_of_edge(view.q, g)) } else { sign }.signum()
    } else {
        r.normalize_or_zero()
    };
    Ok(ClosestPoints { on_p, on_q, normal })
}

#[inline]
fn edge_edge(view: &View<'_>, mirror: &View<'_>, e: u32, g: u32) -> Step {
    let points = match between_edges(view, e, g) {
        Ok(points) => points,
        Err((fp, fq)) => return Step::Move(fp, fq),
    };
    let distance = (points.on_p - points.on_q).dot(points.normal);
    if distance <= view.touching {
        let outward = outward_of_edge(view.q, g);
        let direction = if points.normal.dot(outward) < 0.0 { -points.normal } else { points.normal };
        return Step::Overlap(Edge(e), Edge(g), direction);
    }
    let r = points.normal * distance;
    if let Some(f) = beyond_edge(view.q, g, r, view.noise) {
        return edge_face(view, e, f, Some(points.on_p));
    }
    if let Some(f) = beyond_edge(view.p, e, -view.q_in_p.vector(r), view.noise) {
        return edge_face(mirror, g, f, Some(view.q_in_p.point(points.on_q))).mirrored(view.p_in_q);
    }
    Step::Apart(points)
}

/// The vertex at which a clamped parameter lies.
#[inline]
fn end_of(parameter: f64, edge: crate::body::Edge) -> Option<Feature> {
    if parameter <= 0.0 {
        Some(Vertex(edge.tail))
    } else if parameter >= 1.0 {
        Some(Vertex(edge.head))
    } else {
        None
    }
}

/// Edge `e` of p against face `f` of q; `hint` is a point of the edge, in q's frame.
fn edge_face(view: &View<'_>, e: u32, f: u32, hint: Option<DVec3>) -> Step {
    let edge = view.p.edge(e);
    let tail = view.p_in_q.point(view.p.vertex(edge.tail));
    let head = view.p_in_q.point(view.p.vertex(edge.head));
    match over_face(view.q, f, tail, head, hint, view.touching) {
        OverFace::Crosses => Step::Overlap(Edge(e), Face(f), view.q.plane(f).normal),
        OverFace::Tail => Step::Move(Vertex(edge.tail), Face(f)),
        OverFace::Head => Step::Move(Vertex(edge.head), Face(f)),
        OverFace::Side(side) => Step::Move(Edge(e), Edge(view.q.face_edges(f)[side])),
    }
}

/// The greatest height along `direction` that a climb from vertex `from` reaches.
#[inline]
fn climbed(polytope: &Polytope, from: u32, direction: DVec3) -> f64 {
    let mut best = from;
    let mut height = direction.dot(polytope.vertex(from));
    loop {
        let here = best;
        for spoke in polytope.ring(here) {
            let h = direction.dot(polytope.vertex(spoke.neighbour));
            if h > height {
                (height, best) = (h, spoke.neighbour);
            }
        }
        if best == here {
            return height;
        }
    }
}

/// The feature itself when the polytope has it, otherwise its first vertex: a stale start is slow, not wrong.
fn within(polytope: &Polytope, feature: Feature) -> Feature {
    let exists = match feature {
        Vertex(v) => (v as usize) < polytope.vertices().len(),
        Edge(e) => (e as usize) < polytope.edges().len(),
        Face(f) => (f as usize) < polytope.face_count(),
    };
    if exists { feature } else { Vertex(0) }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, EulerRot};

    use super::super::oracle::*;
    use super::*;
    use crate::algebra::Pose;

    const SEED: u64 = 0x4D41_5243;

    /// March against its own proof and against GJK; also how much the proof falls short, relative to the distance.
    fn check(a: &Polytope, b: &Polytope, pose: &Placement, start: FeaturePair, what: &str) -> (March, f64) {
        let answer = march(a, b, pose, start);
        let expected = gjk(a, b, pose, start);
        let context = || format!("{what}, seed {SEED:#x}\n{answer:?}\n{expected:?}");
        let missing = judge(a, b, pose, &answer, OFF_MARCH).unwrap_or_else(|fault| panic!("{fault}: {}", context()));
        let loose = match judge(a, b, pose, &expected, OFF_GJK) {
            Ok(loose) => loose,
            // GJK says itself when it has not converged.
            Err(_) if expected.stop != StopReason::Converged => f64::INFINITY,
            Err(fault) => panic!("GJK {fault}: {}", context()),
        };
        let size = a.radius() + b.radius() + pose.translation.length();
        let rounding = 1e-14 * size;
        match (answer.proximity, expected.proximity) {
            (Proximity::Disjoint(p), Proximity::Disjoint(q)) => {
                // Each distance is between its own two bounds.
                assert!(p.distance - missing <= q.distance + rounding, "march is farther: {}", context());
                assert!(q.distance - loose <= p.distance + rounding, "march is nearer: {}", context());
                (answer, missing / p.distance)
            }
            (Proximity::Overlapping(_), Proximity::Overlapping(_)) => (answer, 0.0),
            // GJK says itself when it can't tell.
            (Proximity::Disjoint(_), Proximity::Overlapping(_)) if expected.stop != StopReason::Converged => {
                (answer, missing)
            }
            (p, q) => {
                let near = |x| if let Proximity::Disjoint(c) = x { c.distance } else { 0.0 };
                assert!(near(p) + near(q) < 1e-11 * size, "one is apart: {}", context());
                (answer, 0.0)
            }
        }
    }

    #[test]
    fn random_starts_on_every_pair_of_bodies() {
        let mut random = Random(SEED);
        let zoo = menagerie(&mut random);
        for (name_a, a) in &zoo {
            for (name_b, b) in &zoo {
                for apart in [0.02, 0.3, 0.5, 0.8, 1.1, 3.0, 30.0] {
                    let pose = random_pose(&mut random, a, b, apart);
                    let start = FeaturePair { a: random.feature(a), b: random.feature(b) };
                    check(a, b, &pose, start, &format!("{name_a}, {name_b}, {apart}"));
                }
            }
        }
    }

    /// A pose of `a` that is special to `b`: aligned, quarter-turned or a hair off, at a chosen gap (negative: overlapping).
    fn contact_pose(random: &mut Random, a: &Polytope, b: &Polytope) -> Placement {
        let quarter = std::f64::consts::FRAC_PI_2;
        let turns = DVec3::new(random.below(5) as f64, random.below(5) as f64, random.below(5) as f64) * quarter * 0.5;
        let mut rotation = DQuat::from_euler(EulerRot::XYZ, turns.x, turns.y, turns.z);
        match random.below(4) {
            0 => {}
            1 => rotation = DQuat::IDENTITY,
            2 => {
                let off = 10f64.powf(random.between(-16.0, -1.0));
                rotation = DQuat::from_axis_angle(random.direction(), off) * rotation;
            }
            _ => {
                // Some face of a flat against some face of b.
                let n = a.plane(random.below(a.face_count()) as u32).normal;
                let m = b.plane(random.below(b.face_count()) as u32).normal;
                rotation = DQuat::from_axis_angle(m, random.between(0.0, 6.0)) * DQuat::from_rotation_arc(n, -m);
            }
        }
        let toward = [DVec3::X, DVec3::Y, DVec3::Z, random.direction()][random.below(4)];
        let size = a.radius() + b.radius();
        let centre = b.centroid() + toward * size * 1.5;
        let pose = Pose::new(rotation, centre - rotation * a.centroid());
        let gap = size * 10f64.powf(random.between(-14.0, -1.0)) * if random.below(4) == 0 { -1.0 } else { 1.0 };
        let start = initial_features(a, b, &pose.placement());
        let Proximity::Disjoint(closest) = gjk(a, b, &pose.placement(), start).proximity else {
            return pose.placement();
        };
        Pose { translation: pose.translation - closest.normal * (closest.distance - gap), ..pose }.placement()
    }

    /// Counts of a sweep.
    #[derive(Default)]
    struct Tally {
        queries: u64,
        overlaps: u64,
        steps: u64,
        /// Shortfall of the proof relative to the distance, by decade of distance over size.
        shortfall: [f64; 16],
        fallbacks: std::collections::BTreeMap<String, u64>,
    }

    impl Tally {
        fn count(&mut self, (answer, shortfall): (March, f64), size: f64, what: impl Fn() -> String) {
            if let Proximity::Disjoint(closest) = answer.proximity {
                let decade = (-(closest.distance / size).log10()).clamp(0.0, 15.0) as usize;
                self.shortfall[decade] = self.shortfall[decade].max(shortfall);
            }
            self.queries += 1;
            self.steps += u64::from(answer.steps);
            self.overlaps += u64::from(matches!(answer.proximity, Proximity::Overlapping(_)));
            if answer.stop != StopReason::Converged {
                *self.fallbacks.entry(what()).or_insert(0) += 1;
            }
        }

        fn fallback_count(&self) -> u64 {
            self.fallbacks.values().sum()
        }

        #[allow(clippy::print_stderr, reason = "sweeps are run to be read")]
        fn print(&self, title: &str) {
            let Self { queries, overlaps, steps, .. } = self;
            let fallbacks = self.fallback_count();
            eprintln!("{title}: {queries} queries, {overlaps} overlapping, {steps} steps, {fallbacks} fallbacks");
            for (decade, shortfall) in self.shortfall.iter().enumerate() {
                eprintln!("  distance below 1e-{decade} of the size: proven within {shortfall:.1e}");
            }
            let mut worst: Vec<_> = self.fallbacks.iter().collect();
            worst.sort_by_key(|entry| std::cmp::Reverse(*entry.1));
            for (what, count) in worst.iter().take(20) {
                eprintln!("  {count} {what}");
            }
        }
    }

    fn start_of(random: &mut Random, a: &Polytope, b: &Polytope, pose: &Placement) -> FeaturePair {
        match random.below(2) {
            0 => initial_features(a, b, pose),
            _ => FeaturePair { a: random.feature(a), b: random.feature(b) },
        }
    }

    fn sweep_random(tally: &mut Tally, random: &mut Random, rounds: usize) {
        for _ in 0..rounds {
            let scale = 10f64.powf(random.between(-3.0, 3.0));
            let zoo = menagerie(random);
            for (name_a, a) in &zoo {
                let a = scaled(a, scale);
                for (name_b, b) in &zoo {
                    let b = scaled(b, scale);
                    for _ in 0..4 {
                        let apart = 10f64.powf(random.between(-2.0, 1.0));
                        let pose = random_pose(random, &a, &b, apart);
                        let start = start_of(random, &a, &b, &pose);
                        let what = || format!("{name_a}, {name_b}, {apart}, scale {scale}");
                        let answer = check(&a, &b, &pose, start, &what());
                        tally.count(answer, a.radius() + b.radius(), || {
                            format!("{name_a}, {name_b} {:?}", answer.0.stop)
                        });
                    }
                }
            }
        }
    }

    fn sweep_contacts(tally: &mut Tally, random: &mut Random, rounds: usize) {
        for _ in 0..rounds {
            let zoo = menagerie(random);
            for (name_a, a) in &zoo {
                for (name_b, b) in &zoo {
                    for _ in 0..4 {
                        let pose = contact_pose(random, a, b);
                        let start = start_of(random, a, b, &pose);
                        let answer = check(a, b, &pose, start, &format!("{name_a}, {name_b}"));
                        tally.count(answer, a.radius() + b.radius(), || {
                            format!("{name_a}, {name_b} {:?}", answer.0.stop)
                        });
                    }
                }
            }
        }
    }

    #[test]
    fn aligned_grazing_and_touching_bodies() {
        let mut tally = Tally::default();
        sweep_contacts(&mut tally, &mut Random(SEED), 1);
        assert!(tally.fallback_count() * 1000 <= tally.queries, "{:?}, seed {SEED:#x}", tally.fallbacks);
    }

    #[test]
    #[ignore = "minutes of random queries, with a count of fallbacks by pair"]
    fn sweeps() {
        let rounds = std::env::var("SWEEPS").map_or(20, |s| s.parse().unwrap());
        let mut tally = Tally::default();
        sweep_random(&mut tally, &mut Random(SEED + 1), rounds);
        tally.print("random");
        let mut tally = Tally::default();
        sweep_contacts(&mut tally, &mut Random(SEED + 2), rounds);
        tally.print("contacts");
    }
}
