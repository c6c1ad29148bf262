//! Closest points of two edges, and of an edge and a face, by clipping the edge to the prism over
//! the face \[Mirtich 1998, §3\].

use glam::DVec3;

use super::voronoi::beyond_face;
use crate::algebra::closest_segment_segment;
use crate::algebra::tolerance::NEARLY_PARALLEL;
use crate::body::{Edge, Polytope};

/// Closest points of two segments as parameters. A clamped parameter is exactly 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SegmentParameters {
    /// Parameter on the first segment.
    pub(super) s: f64,
    /// Parameter on the second segment.
    pub(super) t: f64,
}

/// Returns the closest points of the segments `p + s d` and `q + t e`, with s and t in \[0, 1\].
///
/// The least-squares system is solved by orthogonalising `d` against `e`, not by its determinant.
/// For nearly parallel segments, the remainder is solved once more. So the residual is of the
/// order of rounding at any angle. (The method of Ericson, *Real-Time Collision Detection*, §5.1.9,
/// loses half of the digits at 1e-8 rad.)
#[inline]
pub(super) fn closest_parameters(p: DVec3, d: DVec3, q: DVec3, e: DVec3) -> SegmentParameters {
    let r = p - q;
    let (dd, ee) = (d.length_squared(), e.length_squared());
    let ratio = d.dot(e) / ee;
    let across = d - e * ratio;
    let height_squared = across.length_squared();
    let mut s = 0.0;
    if height_squared > 0.0 {
        s = -across.dot(r) / height_squared;
        if height_squared < NEARLY_PARALLEL * NEARLY_PARALLEL * dd {
            s = s.clamp(0.0, 1.0);
            let t = (r + d * s).dot(e) / ee;
            s -= across.dot(r + d * s - e * t) / height_squared;
        }
        s = s.clamp(0.0, 1.0);
    }
    let t = (r + d * s).dot(e) / ee;
    if (0.0..=1.0).contains(&t) {
        return SegmentParameters { s, t };
    }
    let t = t.clamp(0.0, 1.0);
    SegmentParameters { s: ((e * t - r).dot(d) / dd).clamp(0.0, 1.0), t }
}

/// Position of the point that is nearest to a face's plane, on the part of an edge over the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OverFace {
    /// The edge crosses the face.
    Crosses,
    /// The point is the edge's first end.
    Tail,
    /// The point is the edge's second end.
    Head,
    /// The edge enters, leaves or misses the prism over this side (index into the face's loop).
    Side(usize),
}

/// Clips the edge `tail`–`head` (in the polytope's frame) to the prism over face `f`, and finds the
/// point of the clipped edge nearest to the face. `f` must not be a rim of a plate, since a rim has
/// no prism.
///
/// `hint` is a point of the edge. If the edge misses the prism, the result is the side of the face
/// nearest to `hint`, or without a hint, the side nearest to the edge.
#[inline]
pub(super) fn over_face(
    polytope: &Polytope,
    f: u32,
    tail: DVec3,
    head: DVec3,
    hint: Option<DVec3>,
    touching: f64,
) -> OverFace {
    let plane = polytope.plane(f);
    let corners = polytope.face_vertices(f);
    let (mut low, mut low_side) = (0.0, None);
    let (mut high, mut high_side) = (1.0, None);
    let mut missed = polytope.is_rim(f);
    let mut from = polytope.vertex(corners.last());
    for (k, corner) in corners.iter().enumerate() {
        if missed {
            break;
        }
        let to = polytope.vertex(corner);
        let inward = plane.normal.cross(to - from);
        let (at_tail, at_head) = (inward.dot(tail - from), inward.dot(head - from));
        let side = if k == 0 { corners.len() - 1 } else { k - 1 };
        from = to;
        if at_tail < 0.0 {
            if at_head < 0.0 {
                missed = true;
            } else {
                let enters = at_tail / (at_tail - at_head);
                if enters > low {
                    (low, low_side) = (enters, Some(side));
                }
            }
        } else if at_head < 0.0 {
            let leaves = at_tail / (at_tail - at_head);
            if leaves < high {
                (high, high_side) = (leaves, Some(side));
            }
        }
    }
    if missed || low > high {
        return OverFace::Side(nearest_side(polytope, f, tail, head, hint));
    }
    let (at_tail, at_head) = (plane.height(tail), plane.height(head));
    let (at_low, at_high) = (at_tail + (at_head - at_tail) * low, at_tail + (at_head - at_tail) * high);
    if at_low * at_high <= 0.0 || at_low.abs().min(at_high.abs()) <= touching {
        return OverFace::Crosses;
    }
    // The point nearest to the plane is the lower end of an edge above the plane, and the higher
    // end of an edge below it.
    if (at_head > at_tail) == (at_low > 0.0) {
        low_side.map_or(OverFace::Tail, OverFace::Side)
    } else {
        high_side.map_or(OverFace::Head, OverFace::Side)
    }
}

fn nearest_side(polytope: &Polytope, f: u32, tail: DVec3, head: DVec3, hint: Option<DVec3>) -> usize {
    if let Some(side) = hint.and_then(|x| beyond_face(polytope, f, x)) {
        return side;
    }
    let mut best = (f64::INFINITY, 0);
    for (k, e) in polytope.face_edges(f).iter().enumerate() {
        let Edge { tail: from, head: to, .. } = polytope.edge(e);
        let pair = closest_segment_segment(tail, head, polytope.vertex(from), polytope.vertex(to));
        let distance = pair.first.distance_squared(pair.second);
        if distance < best.0 {
            best = (distance, k);
        }
    }
    best.1
}
