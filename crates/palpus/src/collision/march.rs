//! Separation distance of two convex polytopes by Voronoi marching \[K02 §3.2; Lin and Canny 1991;
//! Mirtich 1998\].
//!
//! The state is a pair of closed features, one on each body. A step finds the closest points of the
//! two features, then:
//!
//! 1. If a point lies on the boundary of its feature, the feature shrinks to that boundary (edge →
//!    vertex, face → edge).
//! 2. If a point violates a Voronoi plane of the other body's feature, that feature grows across
//!    the most violated plane (vertex → edge, edge → face). The distance of the closed features
//!    strictly decreases.
//! 3. If an edge would pair with a face, it is clipped to the prism over the face. If the edge
//!    crosses the face, the bodies overlap. Otherwise the derivative of the edge's height shows
//!    which end of the clipped edge is nearest. The next pair is then a vertex and the face, or the
//!    edge and a side of the face.
//! 4. A vertex below a face is a local minimum. If the vertex is inside the whole body, the bodies
//!    overlap. Otherwise it lies above another face, and the march continues there.
//! 5. Otherwise the pair is closest. Then the result is checked: no vertex of a body may reach past
//!    the closest points along the normal. A test of one ring of vertices per body is sufficient.
//!    If a vertex reaches slightly farther, a second walk also follows gains that the first walk
//!    ignores as rounding.
//!
//! The next state depends only on the state, so a repeated state means a cycle. After a cycle, an
//! exhausted budget or a failed check, GJK computes the result. Its result satisfies the same
//! conditions, and the stop reason reports the fallback. Every overlap has a witness: a vertex
//! inside, an edge through a face, or features within touching distance.
//!
//! Deviations from V-Clip. Features are closed and have explicit closest points, so the distance
//! decreases in each step. Growth needs a gain above rounding and shrinking does not, so parallel
//! features do not cycle. At a local minimum, a climb over adjacent faces (a support query on the
//! polar dual) replaces the scan of all faces. Plates need only one special case: a point below the
//! front is above the back.

mod validate;

use glam::DVec3;

use super::gjk::{centroid_line, gjk};
use super::scale::Scale;
use super::step::{
    ClosestPoints, Step, View, across, between_edges, between_vertices, edge_edge, edge_face, vertex_edge, vertex_face,
    vertex_over_edge, vertex_over_face, vertex_vertex,
};
use super::{Closest, March, Overlap, Proximity, StopReason};
use crate::algebra::Placement;
use crate::algebra::tolerance::{MARCH_NOISE, MARCH_STEPS};
use crate::body::Feature::{Edge, Face, Vertex};
use crate::body::{Feature, FeaturePair, Polytope};

/// Finds the closest points of a and b, in b's frame. `pose_ba` places a's frame in b's.
///
/// `start` may be any features of the two bodies; the features of the last result make the query
/// fast. Bodies nearer than [`TOUCHING`](crate::algebra::tolerance::TOUCHING) times the sum of
/// their radii count as overlapping.
pub fn march(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
    let answer = proven(a, b, pose_ba, start);
    debug_assert!(
        !answer.is_sampled() || answer.validate(a, b, pose_ba) == Ok(()),
        "{:?}",
        answer.validate(a, b, pose_ba)
    );
    answer
}

/// Runs steps 1 to 5.
#[inline]
fn proven(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
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
    second_look(&mut field, &scale, candidate, steps)
}

/// Continues the walk if a vertex reaches slightly past the closest points, because two features
/// are parallel within the dead zone of growth. The second walk has no dead zone. It accepts a
/// result in which vertices reach past the closest points by rounding only.
#[cold]
fn second_look(field: &mut Field<'_>, scale: &Scale, first: Candidate, steps: u32) -> March {
    field.noise = 0.0;
    let (second, more) = field.walk(first.closest.features);
    let steps = steps + more;
    let mut candidate = match second {
        Walk::Overlap(overlap) => return answered(Proximity::Overlapping(overlap), overlap.features, steps),
        Walk::Apart(sharper) if sharper.closest.distance <= first.closest.distance => sharper,
        _ => first,
    };
    if candidate.excess > scale.loose(candidate.closest.distance) {
        candidate = field.straightened(candidate);
    }
    let Candidate { closest, excess } = candidate;
    if excess <= scale.loose(closest.distance) {
        return answered(Proximity::Disjoint(closest), closest.features, steps);
    }
    fall_back(field.a, field.b, field.pose_ba, closest.features, steps, StopReason::Stalled)
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

/// How a walk over feature pairs ended.
enum Walk {
    /// The walk ended at a pair that no growth improves.
    Apart(Candidate),
    /// The walk found a witness of overlap.
    Overlap(Overlap),
    /// The walk ended without a result, for this reason.
    Lost(FeaturePair, StopReason),
}

/// Closest points before their check.
#[derive(Clone, Copy)]
struct Candidate {
    closest: Closest,
    /// Sum of the lengths by which both bodies reach past the closest points along the normal. The
    /// distance is too long by at most this length.
    excess: f64,
}

/// Input of a walk.
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
    /// Moves from pair to pair until a pair is closest. Also returns the number of steps.
    fn walk(&self, start: FeaturePair) -> (Walk, u32) {
        let mut pair = start;
        let mut seen = start;
        let mut next_mark = 2;
        for steps in 1..=MARCH_STEPS {
            match self.step(pair) {
                Step::Move(fa, fb) => {
                    pair = FeaturePair { a: fa, b: fb };
                    // Brent's cycle detection: compare with a stored state, which is replaced at
                    // steps 1, 2, 4, 8 and so on.
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

    /// Returns body a in b's frame.
    #[inline]
    fn onto_b(&self) -> View<'_> {
        let Self { a, b, pose_ba, pose_ab, touching, noise, reach } = *self;
        View { p: a, q: b, p_in_q: pose_ba, q_in_p: pose_ab, noise, touching, reach }
    }

    /// Returns body b in a's frame.
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
            (Face(f), Face(g)) => Step::Move(Vertex(self.a.face_vertices(f).at(0)), Face(g)),
        }
    }

    /// Returns the nearest of the pairs in the cycle through `pair`. Between parallel features, the
    /// walk may cycle through distances that differ only by rounding. `None` if no pair of the
    /// cycle has closest points off its boundaries.
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

    /// Returns the candidate with another normal, if the bodies reach less far past its points
    /// along that normal. It tries the normals of faces that contain a point, and normals
    /// perpendicular to edges that contain a point.
    ///
    /// Rounding may put a vertex beyond the end of a parallel face or edge. Then the line between
    /// the closest points is tilted.
    #[cold]
    fn straightened(&self, candidate: Candidate) -> Candidate {
        let Closest { point_a, point_b, features, .. } = candidate.closest;
        let r = point_a - point_b;
        let mut best = candidate;
        let mut consider = |normal: DVec3| {
            let distance = normal.dot(r);
            if distance > self.touching && (r - normal * distance).length() <= self.reach * MARCH_NOISE {
                let straight = self.candidate(features, &ClosestPoints { on_p: point_a, on_q: point_b, normal });
                if straight.excess < best.excess {
                    best = straight;
                }
            }
        };
        for_each_face(self.a, features.a, |f| consider(-self.pose_ba.vector(self.a.plane(f).normal)));
        for_each_face(self.b, features.b, |f| consider(self.b.plane(f).normal));
        for_each_edge(self.a, features.a, |d| consider(across(r, self.pose_ba.vector(d))));
        for_each_edge(self.b, features.b, |d| consider(across(r, d)));
        best
    }

    /// Returns the closest points of a pair, and how far vertices of one ring per body reach past
    /// them.
    #[inline]
    fn candidate(&self, pair: FeaturePair, points: &ClosestPoints) -> Candidate {
        let ClosestPoints { on_p, on_q, normal } = *points;
        let distance = (on_p - on_q).dot(normal);
        let closest = Closest { point_a: on_q + normal * distance, point_b: on_q, normal, distance, features: pair };
        let down = -self.pose_ab.vector(normal);
        let reach_a = self.a.climb(pair.a.some_vertex(self.a), down).1 - down.dot(self.pose_ab.point(closest.point_a));
        let reach_b = self.b.climb(pair.b.some_vertex(self.b), normal).1 - normal.dot(on_q);
        Candidate { closest, excess: reach_a.max(0.0) + reach_b.max(0.0) }
    }
}

/// Returns the start for a pair without cached data: the extreme vertices along the line of the
/// centroids.
pub fn initial_features(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> FeaturePair {
    completed(a, b, pose_ba, [None; 2])
}

/// Returns the start for a pair with one known feature or none. The unknown features are those of
/// [`initial_features`].
pub(super) fn completed(a: &Polytope, b: &Polytope, pose_ba: &Placement, known: [Option<Feature>; 2]) -> FeaturePair {
    let line = pose_ba.point(a.centroid()) - b.centroid();
    let [feature_a, feature_b] = known;
    FeaturePair {
        a: feature_a.unwrap_or_else(|| Vertex(a.support(pose_ba.inverse_vector(-line)))),
        b: feature_b.unwrap_or_else(|| Vertex(b.support(line))),
    }
}

/// Returns the features of a pair of nodes that are known for a half of this pair: the feature of
/// the node that is not split. In a close fit, the march of the half often ends there.
pub(super) fn kept_by_half(whole: [u32; 2], features: FeaturePair, half: [u32; 2]) -> [Option<Feature>; 2] {
    let FeaturePair { a, b } = features;
    [(half[0] == whole[0]).then_some(a), (half[1] == whole[1]).then_some(b)]
}

/// Calls `visit` with every face that contains `feature`.
fn for_each_face(polytope: &Polytope, feature: Feature, mut visit: impl FnMut(u32)) {
    match feature {
        Vertex(v) => polytope.ring(v).iter().for_each(|spoke| visit(spoke.left)),
        Edge(e) => [polytope.edge(e).left, polytope.edge(e).right].into_iter().for_each(visit),
        Face(f) => visit(f),
    }
}

/// Calls `visit` with the direction (not unit) of every edge that contains `feature`.
fn for_each_edge(polytope: &Polytope, feature: Feature, mut visit: impl FnMut(DVec3)) {
    match feature {
        Vertex(v) => {
            let origin = polytope.vertex(v);
            polytope.ring(v).iter().for_each(|spoke| visit(polytope.vertex(spoke.neighbour) - origin));
        }
        Edge(e) => visit(polytope.vertex(polytope.edge(e).head) - polytope.vertex(polytope.edge(e).tail)),
        Face(_) => {}
    }
}

/// Returns the feature if the polytope has it, otherwise the polytope's first vertex. An outdated
/// start is slow but not wrong.
fn within(polytope: &Polytope, feature: Feature) -> Feature {
    let exists = match feature {
        Vertex(v) => (v as usize) < polytope.vertices().len(),
        Edge(e) => (e as usize) < polytope.edge_count(),
        Face(f) => (f as usize) < polytope.face_count(),
    };
    if exists { feature } else { Vertex(0) }
}
