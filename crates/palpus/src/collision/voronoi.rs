//! Voronoi regions of the features of a polytope: finds the plane of a feature that a point
//! violates most.
//!
//! The region of a feature is the set of points outside the polytope for which this feature is
//! nearest. Planes through the feature bound the region. Each plane is shared with the region of a
//! neighbouring feature \[Mirtich 1998, §2\]:
//!
//! * vertex: one plane per edge at the vertex, perpendicular to the edge; beyond the plane is the
//!   edge's region;
//! * edge: two planes at its ends (handled by clamping), and one plane per face, perpendicular to
//!   the face; beyond a face's plane is the face's region;
//! * face: one plane per side, perpendicular to the face; beyond the plane is the region of the
//!   side's edge.
//!
//! A walk moves to a *larger* feature only if the violation exceeds the rounding of the positions
//! (`noise`, m), and to a *smaller* feature at any violation. This dead zone prevents cycles
//! between parallel features.
//!
//! A point over a face may also lie below the face's plane. [`lowest_cover`] determines whether
//! such a point lies inside the whole polytope, without a scan of all faces.
//!
//! All points are in the polytope's own frame.

use glam::DVec3;

use crate::body::{Edge, Polytope};

/// Returns the edge of vertex `v` whose plane `x` violates most. `None` if no plane is violated by
/// more than `noise`.
#[inline]
pub(super) fn beyond_vertex(polytope: &Polytope, v: u32, x: DVec3, noise: f64) -> Option<u32> {
    let origin = polytope.vertex(v);
    let r = x - origin;
    let mut best = None;
    // The violation is along / length. Squares are compared, without roots or divisions.
    let (mut best_along_squared, mut best_length_squared) = (noise * noise, 1.0);
    for spoke in polytope.ring(v) {
        let d = polytope.vertex(spoke.neighbour) - origin;
        let along = r.dot(d);
        if along > 0.0 {
            let (along_squared, length_squared) = (along * along, d.length_squared());
            if along_squared * best_length_squared > best_along_squared * length_squared {
                best = Some(spoke.edge);
                (best_along_squared, best_length_squared) = (along_squared, length_squared);
            }
        }
    }
    best
}

/// Returns the face of edge `e` into whose region the vector `toward` leads from a point of the
/// edge. `None` if it leads into no region by more than `noise`.
///
/// If the planes of both faces are violated, the point lies low beside the edge. Then a face with
/// the point above its plane is preferred.
#[inline]
pub(super) fn beyond_edge(polytope: &Polytope, e: u32, toward: DVec3, noise: f64) -> Option<u32> {
    let Edge { tail, head, left, right } = polytope.edge(e);
    let d = polytope.vertex(head) - polytope.vertex(tail);
    let across = d.cross(toward);
    // The value is toward · (normal × d), where normal × d points into the left face.
    let (left_normal, right_normal) = (polytope.plane(left).normal, polytope.plane(right).normal);
    let (into_left, into_right) = (left_normal.dot(across), -right_normal.dot(across));
    if into_left <= 0.0 && into_right <= 0.0 {
        return None;
    }
    let threshold = noise * noise * d.length_squared();
    let violates = |into: f64| into > 0.0 && into * into > threshold;
    match (violates(into_left), violates(into_right)) {
        (true, true) => {
            let (above_left, above_right) = (left_normal.dot(toward) > 0.0, right_normal.dot(toward) > 0.0);
            let choose_left = if above_left == above_right { into_left >= into_right } else { above_left };
            Some(if choose_left { left } else { right })
        }
        (true, false) => Some(left),
        (false, true) => Some(right),
        (false, false) => None,
    }
}

/// Returns the side (index into the loop) of face `f` whose plane `x` violates most; `None` if `x`
/// is over the face.
///
/// For a convex polygon, the most violated side contains the point of the closed face nearest to
/// `x`. A rim of a plate has no width, so the result is always one of its two sides.
#[inline]
pub(super) fn beyond_face(polytope: &Polytope, f: u32, x: DVec3) -> Option<usize> {
    let corners = polytope.face_vertices(f);
    let normal = polytope.plane(f).normal;
    if corners.len() == 2 {
        let (tail, head) = (polytope.vertex(corners.at(0)), polytope.vertex(corners.at(1)));
        return Some(usize::from((head - tail).cross(normal).dot(x - tail) <= 0.0));
    }
    let mut best = None;
    let (mut best_out_squared, mut best_length_squared) = (0.0, 1.0);
    let mut tail = polytope.vertex(corners.last());
    for (k, corner) in corners.iter().enumerate() {
        let head = polytope.vertex(corner);
        let d = head - tail;
        let out = d.cross(normal).dot(x - tail);
        if out > 0.0 {
            let (out_squared, length_squared) = (out * out, d.length_squared());
            if out_squared * best_length_squared > best_out_squared * length_squared {
                best = Some(if k == 0 { corners.len() - 1 } else { k - 1 });
                (best_out_squared, best_length_squared) = (out_squared, length_squared);
            }
        }
        tail = head;
    }
    best
}

/// Result of [`lowest_cover`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cover {
    /// The face.
    pub(super) face: u32,
    /// True if the point lies in the polytope (on or below every face).
    pub(super) inside: bool,
}

/// Returns the face through which the ray from the centroid through `x` leaves the solid. The
/// search climbs from face `from`.
///
/// This face maximises the gauge `normal · (x − c) / height of the face over c`, where c is the
/// centroid. The search is a support query on the polar dual polytope, whose vertices are the faces
/// and whose edges are the edges. So a climb over adjacent faces ends at the global maximum. The
/// point is inside exactly if the gauge is at most 1. For an inside point, a second climb by height
/// leads to a nearer face, which is a better estimate of the depth direction. The function is not
/// valid for plates.
pub(super) fn lowest_cover(polytope: &Polytope, from: u32, x: DVec3) -> Cover {
    let centre = polytope.centroid();
    let gauge = |f: u32| {
        let plane = polytope.plane(f);
        plane.normal.dot(x - centre) / (-plane.height(centre)).max(f64::MIN_POSITIVE)
    };
    let (face, greatest) = climb_faces(polytope, from, gauge);
    if greatest > 1.0 {
        return Cover { face, inside: false };
    }
    let (face, _) = climb_faces(polytope, face, |f| polytope.plane(f).height(x));
    Cover { face, inside: true }
}

/// Climbs from face to adjacent face while `value` increases.
fn climb_faces(polytope: &Polytope, from: u32, value: impl Fn(u32) -> f64) -> (u32, f64) {
    let (mut best, mut greatest) = (from, value(from));
    loop {
        let here = best;
        for e in polytope.face_edges(here) {
            let Edge { left, right, .. } = polytope.edge(e);
            let across = if left == here { right } else { left };
            let v = value(across);
            if v > greatest {
                (best, greatest) = (across, v);
            }
        }
        if best == here {
            return (best, greatest);
        }
    }
}
