//! Which depths count, by the surfaces of the bodies, and what stands in if none does.
//!
//! The depth of a piece can differ from that of the solid. A probe that has entered through the
//! near wall of a thin part overlaps pieces of the far wall from behind, and the depth direction of
//! these leads through the whole part. A large piece may bridge a hollow and report a large
//! depth where the surface of another piece is near. The hand would feel such depths as a kick.
//!
//! A depth D along n means that one body's witness point lies D inside the other body. The depth is
//! accepted only if
//!
//! 1. a's point lies inside b, and no surface of b is clearly nearer to it than D, or
//! 2. b's point lies inside a, and no surface of a is clearly nearer to it than D.
//!
//! If the depth is the least of its two pieces over all directions, surfaces of the piece itself do
//! not count. Such a surface may be nearer to the point, but to leave through it is longer for the
//! other piece as a whole. So a peg whose middle has passed a wall is still pushed back to the side
//! from which it came. (This does not hold for a depth that was moved to an admissible normal: the
//! nearer surface may not have been tried.)
//!
//! Depths along the pieces' direction of least depth are checked only if they are larger than the
//! contact tolerance. The check costs a search for the nearest surface, and smaller depths are
//! within the tolerance of contacts anyway.
//!
//! A body that is not closed has no inside. For such a body it is enough that no part of its
//! surface is clearly nearer than D. Without this rule, for a corner of a closed a below an open b,
//! only b's point inside a could confirm the depth, and this point is too near to the sides of a
//! steep corner.
//!
//! Bodies that overlap must always have a contact. If no depth counts, one contact *stands in*,
//! from a witness point that is inside the other solid to the nearest surface. It is the witness of
//! the first of these that there is: the shallowest rejected depth; the last overlap
//! ([`LastOverlap`]), since as long as its witness is inside, the bodies still overlap, even where
//! the probe is between pieces; the least depth of two pieces that share no normal.
//!
//! Deviation: \[K02\] moves a depth to original features without such a check.

use glam::DVec3;

use super::Contact;
use super::memory::PairMemory;
use super::search::Asked;
use crate::algebra::tolerance::{BELIEVED_EDGE_SHARE, BELIEVED_SHARE, TOUCHING};
use crate::algebra::{Placement, closest_on_segment, closest_on_triangle};
use crate::body::{Body, Feature, FeaturePair, Polytope};

/// Returns true if the contact's depth agrees with the surfaces of the solids.
pub(super) fn is_believed(asked: &Asked<'_>, contact: &Contact) -> bool {
    has_depth(asked, contact, BELIEVED_SHARE * -contact.separation, false)
}

/// The same check for a contact along the least depth of its pieces. It is needed only if the
/// contact is deeper than the tolerance and one of the bodies has several pieces.
///
/// If a point of an edge lies D beyond another edge, its distance to the faces at either edge is
/// smaller than D.
pub(super) fn is_believed_beyond(asked: &Asked<'_>, contact: &Contact) -> bool {
    let Asked { a, b, tolerance, .. } = *asked;
    let depth = -contact.separation;
    if depth <= tolerance || a.polytopes().len() == 1 && b.polytopes().len() == 1 {
        return true;
    }
    let edges = matches!(contact.features, FeaturePair { a: Feature::Edge(_), b: Feature::Edge(_) });
    let share = if edges { BELIEVED_EDGE_SHARE } else { BELIEVED_SHARE };
    has_depth(asked, contact, share * depth, true)
}

/// Returns true if one of the contact's points is inside the other body, and at least `depth` away
/// from its surface. With `but_of_piece`, the surface of the contact's own piece does not count.
fn has_depth(asked: &Asked<'_>, contact: &Contact, depth: f64, but_of_piece: bool) -> bool {
    let Asked { a, b, place, .. } = asked;
    let [own_a, own_b] = [(a, contact.piece_a), (b, contact.piece_b)]
        .map(|(body, piece)| if but_of_piece { body.pieces()[piece as usize].triangles() } else { &[] });
    if !a.mesh().is_closed() && !b.mesh().is_closed() {
        return true;
    }
    let [point_a, point_b] = on_features(asked, contact);
    lies_within(b, own_b, point_a, depth) || lies_within(a, own_a, place.inverse_point(point_b), depth)
}

/// The points of the contact's features that are nearest to its witness points, which may lie
/// beside them; in b's frame.
fn on_features(asked: &Asked<'_>, contact: &Contact) -> [DVec3; 2] {
    let (piece_a, piece_b) = asked.pieces(contact.piece_a, contact.piece_b);
    let point_a = on_feature(piece_a, contact.features.a, asked.place.inverse_point(contact.point_a));
    [asked.place.point(point_a), on_feature(piece_b, contact.features.b, contact.point_b)]
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
/// body except those of `own`, and, if the body is closed, inside it.
fn lies_within(body: &Body, own: &[u32], point: DVec3, depth: f64) -> bool {
    let denies = |triangle: u32| own.binary_search(&triangle).is_err();
    body.tree().nearest_among(point, depth, denies).is_none() && (!body.mesh().is_closed() || body.tree().inside(point))
}

/// The contact from the deeper of a contact's witness points to the nearest surface. `None` if
/// neither point is inside the other body.
pub(super) fn stand_in(asked: &Asked<'_>, contact: &Contact) -> Option<Contact> {
    let Asked { a, b, place, .. } = asked;
    let [point_a, point_b] = on_features(asked, contact);
    let of_a = way_out(b, point_a).map(|out| (out, [point_a, point_a + out]));
    // b's point goes out of a: a moves the other way.
    let out_of_a = way_out(a, place.inverse_point(point_b)).map(|out| -place.vector(out));
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

/// The way from a point inside a closed body to the nearest surface.
fn way_out(body: &Body, point: DVec3) -> Option<DVec3> {
    if !body.mesh().is_closed() || !body.tree().inside(point) {
        return None;
    }
    // A way that is as short as the rounding has no direction.
    let least = TOUCHING * body.mesh().bounding_diagonal();
    body.tree().nearest(point).map(|near| near.point - point).filter(|out| out.length() > least)
}

/// The deepest contact of the last query in which the bodies overlapped.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastOverlap {
    contact: Option<PairMemory>,
    /// Its depth, model units; 0 without one.
    depth: f64,
}

impl LastOverlap {
    /// Drops the stored overlap.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Its depth, model units; 0 if the bodies did not overlap.
    pub(super) fn depth(&self) -> f64 {
        self.depth
    }

    /// Keeps the deepest of this query's contacts, if bodies overlap.
    pub(super) fn keep(&mut self, contacts: &[Contact], pose_ba: &Placement) {
        let overlapping = contacts.iter().filter(|contact| contact.separation < 0.0);
        let deepest = overlapping.min_by(|x, y| x.separation.total_cmp(&y.separation));
        self.contact = deepest.map(|contact| PairMemory::of(contact, pose_ba));
        self.depth = deepest.map_or(0.0, |contact| -contact.separation);
    }

    /// Its stand-in at the present pose, if one of its witness points is still inside the other
    /// body.
    pub(super) fn still(&self, asked: &Asked<'_>) -> Option<Contact> {
        stand_in(asked, &self.contact?.extrapolate(&asked.place))
    }
}
