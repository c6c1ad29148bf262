//! Checks the depths of pieces against the surfaces of the solids, and replaces rejected depths.
//!
//! The depth in a piece can differ from the depth in the solid. For example, a probe that has
//! entered through the near wall of a thin part overlaps pieces of the far wall from behind. The
//! depth direction of these pieces leads through the whole part. Also, a large piece may bridge a
//! hollow, and its depth is large where the surface of another piece is near. The hand would feel
//! such depths as a kick.
//!
//! A depth D says that the witness point of one body lies D below the surface of the other body.
//! The depth is accepted only if
//!
//! 1. a's point lies inside b, and no surface of b is clearly nearer to this point than D, or
//! 2. b's point lies inside a, and no surface of a is clearly nearer to this point than D.
//!
//! If the depth is the least of its two pieces over all directions, surfaces of these pieces are
//! ignored. Such a surface may be nearer to the point, but the other piece would have to move
//! farther to leave through it. So a peg whose middle has passed a wall is still pushed back to the
//! side from which it came. (A depth that was moved to an admissible normal is checked against all
//! surfaces, because the search may have missed a nearer surface.)
//!
//! Least depths of pieces are checked only if they exceed the contact tolerance. The check costs a
//! search for the nearest surface, and smaller depths are within the tolerance of contacts anyway.
//!
//! An open body has no inside. For an open body, the check only requires that
//!
//! - no part of its surface is clearly nearer than D. Without this rule, a corner of a closed a
//!   below an open b could be confirmed only by b's point inside a. In a steep corner, this point
//!   is too near to the sides of the corner;
//! - its surface is near the place to which the depth moves the point. All points far from a small
//!   sheet are at a large distance from it.
//!
//! A sheet has two sides, so a's point confirms the depth only if D is at most half of the width of
//! a's piece. Depths in open bodies also grow no faster than the bodies move (`search`).
//!
//! Bodies that overlap must always have a contact. If no depth is accepted, the query adds a
//! *replacement contact*, from a witness point inside the other solid to the nearest surface. The
//! witness point belongs to the first available contact of this list: the shallowest rejected
//! depth; the deepest contact of the last overlap ([`LastOverlap`]), if its witness point is still
//! inside; the least depth of two pieces without a shared normal. If a rejected depth has no
//! witness point inside the other solid, the contact keeps its normal, and its depth grows no
//! faster than the bodies move. So a tool that is pushed through a thin wall is still held.
//!
//! Deviation: \[K02\] moves a depth to original features without such a check.

use glam::DVec3;

use super::Contact;
use super::clear::ClearBalls;
use super::found::Found;
use super::memory::PairMemory;
use super::query_input::QueryInput;
use crate::algebra::tolerance::{CONFIRMED_EDGE_SHARE, CONFIRMED_NEAR, CONFIRMED_SHARE, TOUCHING};
use crate::algebra::{Placement, closest_on_segment, closest_on_triangle};
use crate::body::{Body, Feature, FeaturePair, Polytope};

/// Returns the contact of two pieces along a shared normal, if its depth is accepted.
/// `clear` has balls of earlier queries.
pub(super) fn accepted(input: &QueryInput<'_>, found: &Found, clear: &mut ClearBalls) -> Option<Contact> {
    match found {
        Found::Admissible(contact) => Some(*contact).filter(|contact| least_depth_is_confirmed(input, contact)),
        Found::Moved(contact, facing) => confirmed(input, contact, facing, clear),
        _ => None,
    }
}

/// Returns `contact`, whose depth was moved to an admissible normal, if this depth agrees with the
/// surfaces of the solids. `facing` is the same contact with its points on its features.
///
/// Two features that share an admissible normal may lie side by side, for example two edges that
/// do not cross. Then the contact acts at the point that confirms the depth, or at the middle if
/// both points confirm it. So the tip of a tool above a plate is not pushed at a distant edge of
/// the plate.
fn confirmed(input: &QueryInput<'_>, contact: &Contact, facing: &Contact, clear: &mut ClearBalls) -> Option<Contact> {
    let (depth, points) = (-contact.separation, on_features(input, facing));
    let out = depth * contact.normal;
    let beside = points[0] + out - points[1];
    let crossing = TOUCHING * input.b.mesh().bounding_diagonal();
    let balls = clear.of([contact.piece_a, contact.piece_b]);
    let is_within = |k: usize, body: &Body, point, least| balls[k].lies_within(body, point, least, depth);
    let mut confirming = confirming(input, contact, points, CONFIRMED_SHARE, is_within);
    if beside.length() <= crossing {
        return confirming.any(|confirms| confirms).then_some(*contact);
    }
    let point_b = match [confirming.next(), confirming.next()] {
        [Some(true), Some(true)] => points[1] + 0.5 * beside,
        [Some(true), _] => points[1] + beside,
        [_, Some(true)] => points[1],
        _ => return None,
    };
    Some(Contact { point_a: point_b - out, point_b, ..*contact })
}

/// Checks a contact along the least depth of its pieces, ignoring the surfaces of these pieces. The
/// check is needed only if the contact is deeper than the tolerance and a body has several pieces.
///
/// For two edges the required distance is smaller: if a point of an edge lies D beyond another
/// edge, the faces at these edges are nearer than D.
fn least_depth_is_confirmed(input: &QueryInput<'_>, contact: &Contact) -> bool {
    let QueryInput { a, b, tolerance, .. } = *input;
    let depth = -contact.separation;
    if depth <= tolerance || a.polytopes().len() == 1 && b.polytopes().len() == 1 {
        return true;
    }
    let share = if are_edges(contact) { CONFIRMED_EDGE_SHARE } else { CONFIRMED_SHARE };
    let own = [(b, contact.piece_b), (a, contact.piece_a)];
    let own = own.map(|(body, piece)| body.pieces()[piece as usize].triangles());
    let is_within = |k: usize, body: &Body, point, least| lies_within(body, own[k], point, least);
    confirming(input, contact, on_features(input, contact), share, is_within).any(|confirms| confirms)
}

fn are_edges(contact: &Contact) -> bool {
    matches!(contact.features, FeaturePair { a: Feature::Edge(_), b: Feature::Edge(_) })
}

/// Returns for each of a contact's points whether it confirms the contact's depth: the point is
/// inside the other body, and at least `share` of the depth away from its surface. If the other
/// body is open, the point has to leave it near its surface instead of being inside.
///
/// `is_within` tests the first condition for point 0 (of a, in b) or point 1 (of b, in a). It gets
/// the other body, and the point in the frame of this body, and the distance.
fn confirming<'q>(
    input: &'q QueryInput<'_>,
    contact: &'q Contact,
    [point_a, point_b]: [DVec3; 2],
    share: f64,
    mut is_within: impl FnMut(usize, &Body, DVec3, f64) -> bool + 'q,
) -> impl Iterator<Item = bool> + 'q {
    let QueryInput { a, b, place, .. } = input;
    let open = !a.mesh().is_closed() && !b.mesh().is_closed();
    let depth = -contact.separation;
    let [normal, point_b] = [place.inverse_vector(contact.normal), place.inverse_point(point_b)];
    let [of_a, of_b] = [(a, contact.piece_a), (b, contact.piece_b)];
    let points =
        [(of_b, point_a, depth * contact.normal, of_a, normal), (of_a, point_b, -depth * normal, of_b, contact.normal)];
    points.into_iter().enumerate().map(move |(k, ((body, piece), point, out, (other, other_piece), along))| {
        // The pieces of two sheets have no width that could tell the side.
        let is_far_side =
            || !open && is_sheet(body, piece) && depth > 0.5 * width(&other.polytopes()[other_piece as usize], along);
        is_near(body, point + out, depth) && is_within(k, body, point, share * depth) && !is_far_side()
    })
}

/// Returns true if the piece belongs to a sheet.
fn is_sheet(body: &Body, piece: u32) -> bool {
    body.mesh().is_sheet(body.pieces()[piece as usize].triangles()[0])
}

/// Returns the extent of the piece along a unit vector.
fn width(piece: &Polytope, along: DVec3) -> f64 {
    [along, -along].iter().map(|along| along.dot(piece.vertex(piece.support(*along)))).sum()
}

/// Returns the points of the contact's features nearest to its witness points, in b's frame.
/// Witness points may lie beside their features.
fn on_features(input: &QueryInput<'_>, contact: &Contact) -> [DVec3; 2] {
    let (piece_a, piece_b) = input.pieces(contact.piece_a, contact.piece_b);
    let point_a = on_feature(piece_a, contact.features.a, input.place.inverse_point(contact.point_a));
    [input.place.point(point_a), on_feature(piece_b, contact.features.b, contact.point_b)]
}

fn on_feature(piece: &Polytope, feature: Feature, point: DVec3) -> DVec3 {
    match feature {
        Feature::Vertex(v) => piece.vertex(v),
        Feature::Edge(e) => {
            let edge = piece.edge(e);
            let (tail, head) = (piece.vertex(edge.tail), piece.vertex(edge.head));
            tail.lerp(head, closest_on_segment(point, tail, head))
        }
        Feature::Face(f) => {
            let fan = piece.face_vertices(f).fan().map(|corners| {
                let [a, b, c] = corners.map(|v| piece.vertex(v));
                closest_on_triangle(point, a, b, c)
            });
            let nearer = |x: &DVec3, y: &DVec3| x.distance_squared(point).total_cmp(&y.distance_squared(point));
            fan.min_by(nearer).unwrap_or(point)
        }
    }
}

/// Returns true if `point` (in the body's frame) is at least `depth` away from all triangles of the
/// body except the triangles `own`. If the body is closed, the point must also be inside it.
fn lies_within(body: &Body, own: &[u32], point: DVec3, depth: f64) -> bool {
    let denies = |triangle: u32| own.binary_search(&triangle).is_err();
    body.tree().some_within(point, depth, denies).is_none() && (!body.mesh().is_closed() || body.tree().inside(point))
}

/// Returns true if a rejected contact may still hold the bodies apart: it is at the surface of each
/// open body. Otherwise it may be far from the places where the bodies overlap.
pub(super) fn is_at_surfaces(input: &QueryInput<'_>, contact: &Contact) -> bool {
    let QueryInput { a, b, place, .. } = input;
    let depth = -contact.separation;
    let [point_a, point_b] = on_features(input, contact);
    let out = depth * contact.normal;
    is_near(b, point_a + out, depth) && is_near(a, place.inverse_point(point_b - out), depth)
}

/// Returns true if the body is closed, or if its surface is near `point` (in the body's frame),
/// relative to the depth. This point is where a witness point leaves the body.
fn is_near(body: &Body, point: DVec3, depth: f64) -> bool {
    let limit = CONFIRMED_NEAR * depth + TOUCHING * body.mesh().bounding_diagonal();
    body.mesh().is_closed() || body.tree().some_within(point, limit, |_| true).is_some()
}

/// Returns the replacement of `contact`: a contact from the deeper witness point of `contact` to
/// the nearest surface. `None` if neither point is inside the other body.
pub(super) fn replacement(input: &QueryInput<'_>, contact: &Contact) -> Option<Contact> {
    let QueryInput { a, b, place, .. } = input;
    let [point_a, point_b] = on_features(input, contact);
    let of_a = to_surface(b, point_a).map(|out| (out, [point_a, point_a + out]));
    // If b's point has to leave a, then a moves in the opposite direction.
    let out_of_a = to_surface(a, place.inverse_point(point_b)).map(|out| -place.vector(out));
    let of_b = out_of_a.map(|out| (out, [point_b - out, point_b]));
    let (out, [point_a, point_b]) = match (of_a, of_b) {
        (Some(x), Some(y)) => {
            if x.0.length_squared() >= y.0.length_squared() {
                x
            } else {
                y
            }
        }
        (x, y) => x.or(y)?,
    };
    let depth = out.length();
    Some(Contact { point_a, point_b, normal: out / depth, separation: -depth, ..*contact })
}

/// Returns `contact` with at most this depth (model units). Its point on b stays.
pub(super) fn no_deeper(contact: &Contact, depth: f64) -> Contact {
    let separation = contact.separation.max(-depth);
    Contact { point_a: contact.point_b + separation * contact.normal, separation, ..*contact }
}

/// Returns the vector from a point inside a closed body to the nearest surface.
fn to_surface(body: &Body, point: DVec3) -> Option<DVec3> {
    if !body.mesh().is_closed() || !body.tree().inside(point) {
        return None;
    }
    // A vector as short as the rounding errors has no direction.
    let least = TOUCHING * body.mesh().bounding_diagonal();
    body.tree().nearest(point).map(|near| near.point - point).filter(|out| out.length() > least)
}

/// The deepest contact of the last query in which the bodies overlapped.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastOverlap {
    contact: Option<PairMemory>,
    /// Depth of the contact, model units; 0 without a contact.
    depth: f64,
}

impl LastOverlap {
    /// Drops the stored overlap.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Returns the depth of the last overlap, model units; 0 if the bodies did not overlap.
    pub(super) fn depth(&self) -> f64 {
        self.depth
    }

    /// Stores the deepest contact of this query if the bodies overlap.
    pub(super) fn keep(&mut self, contacts: &[Contact], pose_ba: &Placement) {
        let overlapping = contacts.iter().filter(|contact| contact.separation < 0.0);
        let deepest = overlapping.min_by(|x, y| x.separation.total_cmp(&y.separation));
        self.contact = deepest.map(|contact| PairMemory::of(contact, pose_ba));
        self.depth = deepest.map_or(0.0, |contact| -contact.separation);
    }

    /// Returns the replacement of the stored contact at the present pose. `None` if neither of its
    /// witness points is inside the other body now.
    pub(super) fn still(&self, input: &QueryInput<'_>) -> Option<Contact> {
        replacement(input, &self.contact?.extrapolate(&input.place))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;

    use super::*;
    use crate::algebra::{NoClock, Pose, Random};
    use crate::body::{BodySettings, Mesh, PolygonSoup};
    use crate::detect::{ContactQuery, QuerySettings};

    const SEED: u64 = 1;

    /// Returns a ring around z with `sides` sides: a nut without a thread.
    fn ring(sides: usize, [inner, outer]: [f64; 2], half_height: f64) -> Arc<Body> {
        let mut soup = PolygonSoup::new();
        for k in 0..sides {
            let angle = std::f64::consts::TAU * k as f64 / sides as f64;
            let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let up = DVec3::Z * half_height;
            soup.vertices.extend([inner * out - up, outer * out - up, outer * out + up, inner * out + up]);
        }
        for k in 0..sides {
            let [from, to] = [k, (k + 1) % sides].map(|k| 4 * k as u32);
            for side in 0..4 {
                let next = (side + 1) % 4;
                soup.push_face(&[from + side, to + side, to + next, from + next]);
            }
        }
        let (mesh, _) = Mesh::from_soup(&soup).unwrap();
        assert!(mesh.is_closed());
        Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
    }

    /// True if a point on a feature of the contact is inside the other body.
    fn has_point_inside(input: &QueryInput<'_>, contact: &Contact) -> bool {
        let [point_a, point_b] = on_features(input, contact);
        input.b.tree().inside(point_a) || input.a.tree().inside(input.place.inverse_point(point_b))
    }

    #[test]
    fn depth_without_a_point_inside_grows_with_the_motion() {
        let settings = QuerySettings { tolerance: 1e-3, capacity: 256, ..QuerySettings::default() };
        let (a, b) = (ring(7, [0.5, 1.0], 0.2), ring(9, [1.2, 2.0], 0.5));
        let mut random = Random::new(SEED);
        let (step, reach) = (4e-3, 3.2);
        let motion = 3_f64.sqrt() * step * (1.0 + reach);
        let mut outside = 0;
        for _ in 0..8000 {
            let mut pose = Pose::new(DQuat::from_scaled_axis(3.0 * random.vector()), 1.2 * random.vector());
            let way = Pose::new(DQuat::from_scaled_axis(step * random.vector()), step * random.vector());
            let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
            let mut last = f64::INFINITY;
            for _ in 0..6 {
                query.run(&pose, &NoClock);
                let input = QueryInput::new(&a, &b, &pose, &settings);
                for contact in query.found().iter().filter(|contact| contact.separation < 0.0) {
                    if !has_point_inside(&input, contact) {
                        let most = (last + motion).max(settings.tolerance);
                        assert!(-contact.separation <= most, "seed {SEED}: {contact:?} at {pose:?}");
                        outside += u32::from(last < f64::INFINITY);
                    }
                }
                last = query.found().iter().map(|contact| -contact.separation).fold(0.0, f64::max);
                pose = way * pose;
            }
        }
        assert!(outside > 0);
    }
}
