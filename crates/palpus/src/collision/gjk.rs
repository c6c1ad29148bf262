//! Distance of two convex polytopes by the algorithm of Gilbert, Johnson and Keerthi. It is the
//! fallback of the march, and the reference in the march's tests.
//!
//! 1. A *corner* is a point of the CSO `A ⊖ B`: a support vertex of a minus a support vertex of b.
//!    Begin with one corner, from vertices of the features that the caller passes.
//! 2. Find the point `v` of the simplex of corners nearest to the origin. Keep only the corners
//!    whose weight in `v` is positive.
//! 3. If `v` is the origin (within touching distance), or if four corners enclose the origin, the
//!    polytopes overlap.
//! 4. Otherwise add the corner farthest along `−v`. Its support plane gives a lower bound of the
//!    distance, and `|v|` is an upper bound. When the two bounds agree, or no step improves them,
//!    the closest points follow from the vertices of the kept corners.
//! 5. Determine the features from the vertices of these corners.
//!
//! Deviation from the textbook, for needles and slivers: the nearest sub-simplex is chosen by
//! comparing distances, not by signs of determinants. Every candidate is a convex combination of
//! corners, so it is a point of the CSO. A rounding error can make a candidate inaccurate, but
//! never the result invalid \[van den Bergen 1999, §4\].

mod simplex;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::scale::Scale;
use super::{Closest, March, Overlap, Proximity, StopReason};
use crate::algebra::Placement;
use crate::algebra::tolerance::{GJK_GAP, GJK_PLATEAU, GJK_STEPS};
use crate::body::{Feature, FeaturePair, Polytope};
use simplex::{Corner, Reduction, Simplex};

/// Returns the distance of a and b, in b's frame. `pose_ba` places a's frame in b's.
///
/// The vertices of the features `start` make the first corner. Any features are valid; the
/// features of the last result are fastest.
///
/// The stop reason is `Converged` when the two bounds of the distance agree within rounding.
/// Otherwise the stop reason is `Stalled` or `Budget`. Then the points are on the bodies and prove
/// the bodies apart, but they may not be the closest points. A pair that is not proven apart is
/// reported as overlapping, never as disjoint.
pub fn gjk(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
    let Scale { size, noise, touching } = Scale::of(a, b, pose_ba);
    let mut simplex = Simplex::new(Corner::new(a, b, pose_ba, start.a.some_vertex(a), start.b.some_vertex(b)), noise);
    // The simplex with the smallest difference of its two bounds.
    let mut best = (f64::INFINITY, simplex);
    let (mut steps, mut plateau) = (0, 0);
    loop {
        let length = simplex.nearest().length();
        if length <= touching {
            let direction = touching_direction(a, b, pose_ba, &simplex);
            return overlapping(a, b, pose_ba, &simplex, direction, steps, StopReason::Converged);
        }
        steps += 1;
        let normal = simplex.normal();
        let corner = Corner::new(a, b, pose_ba, a.support(pose_ba.inverse_vector(-normal)), b.support(normal));
        let gap = length - normal.dot(corner.difference);
        if gap < best.0 {
            best = (gap, simplex);
        }
        if gap <= (GJK_GAP * length).max(noise) {
            return disjoint(a, b, pose_ba, &simplex, steps, StopReason::Converged);
        }
        if steps == GJK_STEPS || simplex.contains(&corner) {
            break;
        }
        if let Reduction::Encloses(outward) = simplex.add(corner) {
            return overlapping(a, b, pose_ba, &simplex, -outward, steps, StopReason::Converged);
        }
        // Near the origin, a step may gain less than rounding and still improve the normal, so a
        // few such steps are allowed.
        let after = simplex.nearest().length();
        plateau = if after < length { 0 } else { plateau + 1 };
        if plateau > GJK_PLATEAU || after > length + noise {
            break;
        }
    }
    let (gap, simplex) = best;
    let (length, normal) = (simplex.nearest().length(), simplex.normal());
    if gap < length {
        let stop = if gap <= noise * size / length {
            StopReason::Converged
        } else if steps == GJK_STEPS {
            StopReason::Budget
        } else {
            StopReason::Stalled
        };
        return disjoint(a, b, pose_ba, &simplex, steps, stop);
    }
    let direction = if normal.is_finite() { normal } else { centroid_line(a, b, pose_ba) };
    overlapping(a, b, pose_ba, &simplex, direction, steps, StopReason::Stalled)
}

fn disjoint(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex, steps: u32, stop: StopReason) -> March {
    let normal = simplex.normal();
    let distance = simplex.nearest().dot(normal);
    let point_b = simplex.weighted(|c| c.point_b);
    let features = carriers(a, b, pose_ba, simplex, normal);
    let closest = Closest { point_a: point_b + normal * distance, point_b, normal, distance, features };
    March { proximity: Proximity::Disjoint(closest), features, steps, stop }
}

fn overlapping(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    simplex: &Simplex,
    direction: DVec3,
    steps: u32,
    stop: StopReason,
) -> March {
    let features = if simplex.count == 4 {
        FeaturePair { a: Feature::Vertex(simplex.newest().a), b: Feature::Vertex(simplex.newest().b) }
    } else {
        carriers(a, b, pose_ba, simplex, direction)
    };
    March { proximity: Proximity::Overlapping(Overlap { features, direction }), features, steps, stop }
}

/// Returns the direction of an overlap if the origin is on the simplex: perpendicular to the
/// simplex, or between the centroids.
fn touching_direction(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex) -> DVec3 {
    let apart = centroid_line(a, b, pose_ba);
    if simplex.count != 3 {
        return apart;
    }
    let [p, q, r] = [0, 1, 2].map(|k| simplex.corners[k].difference);
    let across = (q - p).cross(r - p).normalize_or(apart);
    if across.dot(apart) < 0.0 { -across } else { across }
}

/// Returns the unit vector from b's centroid to a's centroid, in b's frame; any unit vector if they
/// coincide.
pub(super) fn centroid_line(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> DVec3 {
    (pose_ba.point(a.centroid()) - b.centroid()).normalize_or(DVec3::X)
}

/// Returns the smallest features that contain the vertices of the nearest point.
fn carriers(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex, normal: DVec3) -> FeaturePair {
    let corners = &simplex.corners[..simplex.count];
    FeaturePair {
        a: carrier(a, corners.iter().map(|c| c.a), pose_ba.inverse_vector(-normal)),
        b: carrier(b, corners.iter().map(|c| c.b), normal),
    }
}

/// Returns the smallest feature whose closure contains the given vertices, preferring faces that
/// look along `outward`.
fn carrier(polytope: &Polytope, vertices: impl Iterator<Item = u32>, outward: DVec3) -> Feature {
    let mut distinct = [0; 4];
    let mut count = 0;
    for v in vertices {
        if !distinct[..count].contains(&v) {
            distinct[count] = v;
            count += 1;
        }
    }
    let (first, others) = (distinct[0], &distinct[1..count]);
    if others.is_empty() {
        return Feature::Vertex(first);
    }
    let ring = polytope.ring(first);
    if others.len() == 1
        && let Some(spoke) = ring.iter().find(|s| s.neighbour == others[0])
    {
        return Feature::Edge(spoke.edge);
    }
    // A face that was merged within rounding may lack one of the vertices. So take the face that
    // contains most of the vertices.
    let mut best = (0, f64::NEG_INFINITY, ring.at(0).left);
    for spoke in ring {
        let face = polytope.face_vertices(spoke.left);
        let held = others.iter().filter(|&&v| face.contains(v)).count();
        let facing = polytope.plane(spoke.left).normal.dot(outward);
        if (held, facing) > (best.0, best.1) {
            best = (held, facing, spoke.left);
        }
    }
    Feature::Face(best.2)
}
