//! One step of the march, by the kinds of the two features.
//!
//! The code for each kind of pair treats a feature of p and a feature of q in q's frame. Each of
//! the two bodies can be p. Features are closed: a step first finds their closest points. Then the
//! step returns the next pair, or these points as the result.

use glam::DVec3;

use super::clip::{OverFace, SegmentParameters, closest_parameters, over_face};
use super::voronoi::{beyond_edge, beyond_face, beyond_vertex, lowest_cover};
use crate::algebra::Placement;
use crate::body::Feature::{Edge, Face, Vertex};
use crate::body::{Feature, Polytope};

/// Body p in body q's frame.
pub(super) struct View<'a> {
    pub(super) p: &'a Polytope,
    pub(super) q: &'a Polytope,
    pub(super) p_in_q: &'a Placement,
    pub(super) q_in_p: &'a Placement,
    pub(super) noise: f64,
    pub(super) touching: f64,
    pub(super) reach: f64,
}

/// Decision of one step of the march. Features are in the order p, q; vectors are in q's frame.
pub(super) enum Step {
    /// Continue with this pair.
    Move(Feature, Feature),
    /// The result: the closest points.
    Apart(ClosestPoints),
    /// The bodies overlap: features, and a direction from q into p (zero if the features define no
    /// direction).
    Overlap(Feature, Feature, DVec3),
}

#[derive(Clone, Copy)]
pub(super) struct ClosestPoints {
    pub(super) on_p: DVec3,
    pub(super) on_q: DVec3,
    /// Unit vector from q into p.
    pub(super) normal: DVec3,
}

impl ClosestPoints {
    #[inline]
    pub(super) fn mirrored(self, q_in_p: &Placement) -> Self {
        Self { on_p: q_in_p.point(self.on_q), on_q: q_in_p.point(self.on_p), normal: -q_in_p.vector(self.normal) }
    }
}

impl Step {
    /// Returns this decision with p and q exchanged. `q_in_p` is the old q's frame in the new q's
    /// frame.
    #[inline]
    pub(super) fn mirrored(self, q_in_p: &Placement) -> Self {
        match self {
            Self::Move(fp, fq) => Self::Move(fq, fp),
            Self::Apart(points) => Self::Apart(points.mirrored(q_in_p)),
            Self::Overlap(fp, fq, direction) => Self::Overlap(fq, fp, -q_in_p.vector(direction)),
        }
    }
}

#[inline]
pub(super) fn between_vertices(view: &View<'_>, v: u32, w: u32) -> ClosestPoints {
    let (on_p, on_q) = (view.p_in_q.point(view.p.vertex(v)), view.q.vertex(w));
    ClosestPoints { on_p, on_q, normal: (on_p - on_q).normalize_or_zero() }
}

#[inline]
pub(super) fn vertex_vertex(view: &View<'_>, v: u32, w: u32) -> Step {
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

/// Returns the closest points of vertex `v` of p and the line of edge `e` of q. Fails with the
/// end of the edge beyond which the vertex lies.
#[inline]
pub(super) fn vertex_over_edge(view: &View<'_>, v: u32, e: u32) -> Result<ClosestPoints, u32> {
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
    Ok(ClosestPoints { on_p, on_q, normal: across(on_p - on_q, d) })
}

/// Returns the unit vector along `r`, made perpendicular to `d`. So the rounding of two near points
/// does not tilt a normal along an edge.
#[inline]
pub(super) fn across(r: DVec3, d: DVec3) -> DVec3 {
    (r - d * (r.dot(d) / d.length_squared())).normalize_or_zero()
}

#[inline]
pub(super) fn vertex_edge(view: &View<'_>, v: u32, e: u32) -> Step {
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

/// Returns a direction (not unit) between the face normals of edge `e`.
fn outward_of_edge(polytope: &Polytope, e: u32) -> DVec3 {
    let crate::body::Edge { left, right, .. } = polytope.edge(e);
    polytope.plane(left).normal + polytope.plane(right).normal
}

#[inline]
pub(super) fn vertex_face(view: &View<'_>, v: u32, f: u32) -> Step {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    if let Some(side) = beyond_face(view.q, f, on_p) {
        return Step::Move(Vertex(v), Edge(view.q.face_edges(f).at(side)));
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

/// Returns the closest points of vertex `v` of p and face `f` of q if the vertex is over the face.
pub(super) fn vertex_over_face(view: &View<'_>, v: u32, f: u32) -> Option<ClosestPoints> {
    let on_p = view.p_in_q.point(view.p.vertex(v));
    let plane = view.q.plane(f);
    let height = plane.height(on_p);
    let over = height > 0.0 && beyond_face(view.q, f, on_p).is_none();
    over.then(|| ClosestPoints { on_p, on_q: on_p - plane.normal * height, normal: plane.normal })
}

/// Returns the edge of vertex `v` of p that descends most steeply along `normal` (in q's frame).
/// `None` if no edge descends by more than rounding.
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

/// Returns the step for a vertex below a face and within its prism, a local minimum of the march.
/// The vertex is inside q or over another face.
fn below_face(view: &View<'_>, v: u32, f: u32, on_p: DVec3) -> Step {
    if view.q.is_flat() {
        // A plate has no inside, and no prism over its rims: a point below the front (0) is above
        // the back (1).
        return Step::Move(Vertex(v), Face(u32::from(f == 0)));
    }
    let cover = lowest_cover(view.q, f, on_p);
    if cover.inside {
        Step::Overlap(Vertex(v), Face(cover.face), view.q.plane(cover.face).normal)
    } else {
        Step::Move(Vertex(v), Face(cover.face))
    }
}

/// Returns the closest points of the lines of two edges. Fails with the features to which clamping
/// shrinks the edges.
#[inline]
pub(super) fn between_edges(view: &View<'_>, e: u32, g: u32) -> Result<ClosestPoints, (Feature, Feature)> {
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
    // The relative error of the edges' cross product is an ulp over the sine of their angle. The
    // relative error of the line between the points is a few ulps of the coordinates over its
    // length.
    let cross = dp.cross(dq);
    let lengths = dp.length_squared() * dq.length_squared();
    let normal = if cross.length_squared() * (view.reach * view.reach) > r.length_squared() * lengths {
        // If the points are too near, the bodies' outward directions decide the sign.
        let sign = cross.dot(r);
        cross.normalize() * if sign == 0.0 { cross.dot(outward_of_edge(view.q, g)) } else { sign }.signum()
    } else {
        across(r, dq)
    };
    Ok(ClosestPoints { on_p, on_q, normal })
}

#[inline]
pub(super) fn edge_edge(view: &View<'_>, mirror: &View<'_>, e: u32, g: u32) -> Step {
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

/// Returns the vertex at a clamped parameter.
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

/// Returns the step for edge `e` of p and face `f` of q; `hint` is a point of the edge, in q's
/// frame.
pub(super) fn edge_face(view: &View<'_>, e: u32, f: u32, hint: Option<DVec3>) -> Step {
    let edge = view.p.edge(e);
    let tail = view.p_in_q.point(view.p.vertex(edge.tail));
    let head = view.p_in_q.point(view.p.vertex(edge.head));
    match over_face(view.q, f, tail, head, hint, view.touching) {
        OverFace::Crosses => Step::Overlap(Edge(e), Face(f), view.q.plane(f).normal),
        OverFace::Tail => Step::Move(Vertex(edge.tail), Face(f)),
        OverFace::Head => Step::Move(Vertex(edge.head), Face(f)),
        OverFace::Side(side) => Step::Move(Edge(e), Edge(view.q.face_edges(f).at(side))),
    }
}
