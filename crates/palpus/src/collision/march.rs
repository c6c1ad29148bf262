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
use crate::algebra::tolerance::{CROSSED, MARCH_PROOF, MARCH_STEPS, TOUCHING};
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
    let size = a.radius() + b.radius();
    let noise = position_noise(a, b, pose_ba);
    let touching = (TOUCHING * size).max(noise);
    let onto_b = View { p: a, q: b, p_in_q: pose_ba, q_in_p: &pose_ab, noise, touching };
    let onto_a = View { p: b, q: a, p_in_q: &pose_ab, q_in_p: pose_ba, noise, touching };
    let mut pair = FeaturePair { a: within(a, start.a), b: within(b, start.b) };
    let mut seen = pair;
    let mut next_mark = 2;
    let mut stop = StopReason::Budget;
    let mut steps = 0;
    while steps < MARCH_STEPS {
        steps += 1;
        let step = match (pair.a, pair.b) {
            (Vertex(v), Vertex(w)) => vertex_vertex(&onto_b, v, w),
            (Vertex(v), Edge(e)) => vertex_edge(&onto_b, v, e),
            (Vertex(v), Face(f)) => vertex_face(&onto_b, v, f),
            (Edge(e), Vertex(w)) => vertex_edge(&onto_a, w, e).mirrored(pose_ba),
            (Face(f), Vertex(w)) => vertex_face(&onto_a, w, f).mirrored(pose_ba),
            (Edge(e), Edge(g)) => edge_edge(&onto_b, &onto_a, e, g),
            (Edge(e), Face(f)) => edge_face(&onto_b, e, f, None),
            (Face(f), Edge(g)) => edge_face(&onto_a, g, f, None).mirrored(pose_ba),
            (Face(f), Face(g)) => Step::Move(Vertex(a.face_vertices(f)[0]), Face(g)),
        };
        match step {
            Step::Move(fa, fb) => {
                let next = FeaturePair { a: fa, b: fb };
                // Brent's cycle finder: compare with a state remembered at powers of two.
                if next == seen {
                    stop = StopReason::Stalled;
                    break;
                }
                if steps == next_mark {
                    seen = next;
                    next_mark *= 2;
                }
                pair = next;
            }
            Step::Apart(points) => {
                let distance = (points.on_p - points.on_q).dot(points.normal);
                let closest = Closest {
                    point_a: points.on_q + points.normal * distance,
                    point_b: points.on_q,
                    normal: points.normal,
                    distance,
                    features: pair,
                };
                if !is_proven(a, b, pose_ba, &closest, noise) {
                    stop = StopReason::Stalled;
                    break;
                }
                let proximity = Proximity::Disjoint(closest);
                return March { proximity, features: pair, steps, stop: StopReason::Converged };
            }
            Step::Overlap(fa, fb, direction) => {
                let features = FeaturePair { a: fa, b: fb };
                let direction = if direction == DVec3::ZERO { centroid_line(a, b, pose_ba) } else { direction };
                let proximity = Proximity::Overlapping(Overlap { features, direction });
                return March { proximity, features, steps, stop: StopReason::Converged };
            }
        }
    }
    let answer = gjk(a, b, pose_ba, pair);
    March { steps: steps + answer.steps, stop, ..answer }
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

struct ClosestPoints {
    on_p: DVec3,
    on_q: DVec3,
    /// Unit, from q into p.
    normal: DVec3,
}

impl Step {
    /// The same decision with p and q exchanged; `q_in_p` is the frame of the old q in the new one.
    #[inline]
    fn mirrored(self, q_in_p: &Placement) -> Self {
        match self {
            Self::Move(fp, fq) => Self::Move(fq, fp),
            Self::Apart(points) => Self::Apart(ClosestPoints {
                on_p: q_in_p.point(points.on_q),
                on_q: q_in_p.point(points.on_p),
                normal: -q_in_p.vector(points.normal),
            }),
            Self::Overlap(fp, fq, direction) => Self::Overlap(fq, fp, -q_in_p.vector(direction)),
        }
    }
}

#[inline]
fn vertex_vertex(view: &View<'_>, v: u32, w: u32) -> Step {
    let on_q = view.q.vertex(w);
    let on_p = view.p_in_q.point(view.p.vertex(v));
    if let Some(e) = beyond_vertex(view.q, w, on_p, view.noise) {
        return Step::Move(Vertex(v), Edge(e));
    }
    if let Some(e) = beyond_vertex(view.p, v, view.q_in_p.point(on_q), view.noise) {
        return Step::Move(Edge(e), Vertex(w));
    }
    let r = on_p - on_q;
    let distance = r.length();
    if distance <= view.touching {
        return Step::Overlap(Vertex(v), Vertex(w), DVec3::ZERO);
    }
    Step::Apart(ClosestPoints { on_p, on_q, normal: r / distance })
}

#[inline]
fn vertex_edge(view: &View<'_>, v: u32, e: u32) -> Step {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    let edge = view.q.edge(e);
    let (tail, head) = (view.q.vertex(edge.tail), view.q.vertex(edge.head));
    let d = head - tail;
    let t = (on_p - tail).dot(d) / d.length_squared();
    if t <= 0.0 {
        return Step::Move(Vertex(v), Vertex(edge.tail));
    }
    if t >= 1.0 {
        return Step::Move(Vertex(v), Vertex(edge.head));
    }
    let on_q = tail + d * t;
    let r = on_p - on_q;
    let distance = r.length();
    if distance <= view.touching {
        let direction = view.q.plane(edge.left).normal + view.q.plane(edge.right).normal;
        return Step::Overlap(Vertex(v), Edge(e), direction);
    }
    if let Some(f) = beyond_edge(view.q, e, r, view.noise) {
        return Step::Move(Vertex(v), Face(f));
    }
    if let Some(g) = beyond_vertex(view.p, v, view.q_in_p.point(on_q), view.noise) {
        return Step::Move(Edge(g), Edge(e));
    }
    Step::Apart(ClosestPoints { on_p, on_q, normal: r / distance })
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
        // Nothing is inside of a plate: below the front (0) is above the back (1); a rim's only company is their plane.
        return Step::Move(Vertex(v), Face(u32::from(f == 0)));
    }
    let cover = lowest_cover(view.q, f, on_p);
    if cover.inside {
        Step::Overlap(Vertex(v), Face(cover.face), view.q.plane(cover.face).normal)
    } else {
        Step::Move(Vertex(v), Face(cover.face))
    }
}

#[inline]
fn edge_edge(view: &View<'_>, mirror: &View<'_>, e: u32, g: u32) -> Step {
    let (edge_p, edge_q) = (view.p.edge(e), view.q.edge(g));
    let tail_p = view.p_in_q.point(view.p.vertex(edge_p.tail));
    let dp = view.p_in_q.point(view.p.vertex(edge_p.head)) - tail_p;
    let tail_q = view.q.vertex(edge_q.tail);
    let dq = view.q.vertex(edge_q.head) - tail_q;
    let SegmentParameters { s, t } = closest_parameters(tail_p, dp, tail_q, dq);
    let shrunk_p = end_of(s, edge_p);
    let shrunk_q = end_of(t, edge_q);
    if shrunk_p.is_some() || shrunk_q.is_some() {
        return Step::Move(shrunk_p.unwrap_or(Edge(e)), shrunk_q.unwrap_or(Edge(g)));
    }
    let (on_p, on_q) = (tail_p + dp * s, tail_q + dq * t);
    let r = on_p - on_q;
    let distance = r.length();
    let cross = dp.cross(dq);
    if distance <= view.touching {
        let outward = view.q.plane(edge_q.left).normal + view.q.plane(edge_q.right).normal;
        let direction = if cross.dot(outward) < 0.0 { -cross } else { cross };
        return Step::Overlap(Edge(e), Edge(g), direction);
    }
    if let Some(f) = beyond_edge(view.q, g, r, view.noise) {
        return edge_face(view, e, f, Some(on_p));
    }
    if let Some(f) = beyond_edge(view.p, e, -view.q_in_p.vector(r), view.noise) {
        return edge_face(mirror, g, f, Some(view.q_in_p.point(on_q))).mirrored(view.p_in_q);
    }
    // Edges that cross steeply know their normal better than two near points do.
    let sine_squared = cross.length_squared() / (dp.length_squared() * dq.length_squared());
    let normal =
        if sine_squared > CROSSED * CROSSED { cross.normalize() * cross.dot(r).signum() } else { r / distance };
    Step::Apart(ClosestPoints { on_p, on_q, normal })
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

/// True when the closest points' normal separates the bodies by their distance, within rounding: then no points are closer.
#[inline]
fn is_proven(a: &Polytope, b: &Polytope, pose_ba: &Placement, closest: &Closest, noise: f64) -> bool {
    let size = a.radius() + b.radius();
    // The direction between near points is only known to the rounding of the points over their distance.
    let allowed = MARCH_PROOF * (size + closest.distance) + noise * size / closest.distance;
    let down = -pose_ba.inverse_vector(closest.normal);
    let reach_a =
        climbed(a, some_vertex(a, closest.features.a), down) - down.dot(pose_ba.inverse_point(closest.point_a));
    let reach_b = climbed(b, some_vertex(b, closest.features.b), closest.normal) - closest.normal.dot(closest.point_b);
    reach_a <= allowed && reach_b <= allowed
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
    use super::super::oracle::*;
    use super::*;

    const SEED: u64 = 0x4D41_5243;

    /// March against its own proof and against GJK.
    fn check(a: &Polytope, b: &Polytope, pose: &Placement, start: FeaturePair, what: &str) -> March {
        let answer = march(a, b, pose, start);
        let judged = judge(a, b, pose, &answer);
        assert!(judged.is_ok(), "{what}, seed {SEED:#x}: {judged:?}\n{answer:?}");
        let expected = gjk(a, b, pose, start);
        let size = a.radius() + b.radius() + pose.translation.length();
        match (answer.proximity, expected.proximity) {
            (Proximity::Disjoint(p), Proximity::Disjoint(q)) => {
                let fault = (p.distance - q.distance).abs();
                assert!(fault <= 1e-10 * q.distance + 1e-14 * size, "{what}: {} {}", p.distance, q.distance);
            }
            (Proximity::Overlapping(_), Proximity::Overlapping(_)) => {}
            (p, q) => {
                let near = |x| if let Proximity::Disjoint(c) = x { c.distance } else { 0.0 };
                assert!(near(p) + near(q) < 1e-11 * size, "{what}, seed {SEED:#x}: {p:?} {q:?}");
            }
        }
        answer
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

    #[test]
    #[ignore = "a minute of random queries, with a count of fallbacks by pair"]
    #[allow(clippy::print_stderr, reason = "the count is the point")]
    fn sweep_of_fallbacks() {
        let mut random = Random(SEED + 1);
        let mut fallbacks = std::collections::BTreeMap::new();
        let (mut queries, mut total, mut overlaps, mut steps) = (0, 0, 0, 0u64);
        for _ in 0..std::env::var("SWEEPS").map_or(20, |s| s.parse().unwrap()) {
            let zoo = menagerie(&mut random);
            for (name_a, a) in &zoo {
                for (name_b, b) in &zoo {
                    for _ in 0..40 {
                        let apart = 10f64.powf(random.between(-2.0, 1.0));
                        let pose = random_pose(&mut random, a, b, apart);
                        for cold in [false, true] {
                            let start = if cold {
                                initial_features(a, b, &pose)
                            } else {
                                FeaturePair { a: random.feature(a), b: random.feature(b) }
                            };
                            let answer = check(a, b, &pose, start, &format!("{name_a}, {name_b}, {apart}"));
                            queries += 1;
                            steps += u64::from(answer.steps);
                            overlaps += u32::from(matches!(answer.proximity, Proximity::Overlapping(_)));
                            if answer.stop != StopReason::Converged {
                                total += 1;
                                *fallbacks
                                    .entry((*name_a, *name_b, format!("{:?} {cold}", answer.stop)))
                                    .or_insert(0) += 1;
                            }
                        }
                    }
                }
            }
        }
        eprintln!("{queries} queries, {overlaps} overlapping, {} steps each, {total} fallbacks", steps / queries);
        let mut worst: Vec<_> = fallbacks.into_iter().collect();
        worst.sort_by_key(|entry| std::cmp::Reverse(entry.1));
        for (pair, count) in worst.iter().take(30) {
            eprintln!("{count} {pair:?}");
        }
    }
}
