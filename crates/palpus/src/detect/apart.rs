//! The contact of two pieces that are apart.
//!
//! 1. If both meshes have the direction of the closest points as a normal there, the contact is at
//!    the closest points. If not, these points belong to another pair of pieces, or are not a
//!    contact: for example, the far side of a thin wall cannot be touched from within the wall.
//! 2. If the settings request patches, the contact may also lie beyond the end of a piece:
//!    - along the normal of a flat face that continues beyond the piece
//!      ([`AdmissibleNormals::continued_normal`]), or
//!    - along the normal of a face that ends at a valley ([`Valley`]). The closest points are at
//!      the valley, and the contact is between the face's plane and a vertex of the other piece.
//! 3. If the settings request patches, and the bodies may turn before the next query
//!    ([`QuerySettings::turn`](super::QuerySettings)), the direction of the closest points need
//!    only be a normal after such a turn.

use glam::DVec3;

use super::Contact;
use super::contact::points_about;
use super::found::{Found, at, at_closest};
use super::memory::PairMemory;
use super::query_input::QueryInput;
use crate::algebra::Plane;
use crate::algebra::tolerance::ADMISSIBLE_ANGLE;
use crate::body::{AdmissibleNormals, Body, Feature, FeaturePair, Valley};
use crate::collision::{Closest, LeafPair};

/// Two pieces that are apart.
struct Apart<'q> {
    input: &'q QueryInput<'q>,
    leaf: &'q LeafPair,
    closest: &'q Closest,
    /// The piece of a, and the piece of b.
    sides: [&'q Near<'q>; 2],
    /// For a and for b: true if the closest point lies on the mesh, and the direction of the
    /// closest points is a normal of the mesh there.
    admitted: [bool; 2],
}

/// One of the two pieces, near the other one. Vectors are in the frame of its body.
struct Near<'q> {
    body: &'q Body,
    piece: u32,
    normals: AdmissibleNormals<'q>,
    feature: Feature,
    /// The closest point of the piece.
    point: DVec3,
    /// The direction to the closest point of the other piece.
    outward: DVec3,
}

impl<'q> Near<'q> {
    fn new(body: &'q Body, piece: u32, feature: Feature, point: DVec3, outward: DVec3) -> Self {
        Self { body, piece, normals: body.admissible_normals(piece), feature, point, outward }
    }

    /// Returns true if the closest point lies on the mesh, and the direction of the closest points
    /// is within `angle` (rad) of a normal of the mesh there.
    fn admits(&self, angle: f64) -> bool {
        let piece = &self.body.pieces()[self.piece as usize];
        self.normals.holds_within(piece, self.feature, self.point, self.outward, angle)
    }

    /// Returns true if a flat face of the mesh may continue beyond the piece along the direction.
    fn may_continue(&self, slope: f64) -> bool {
        self.body.admissible().may_continue(self.piece, self.outward, slope)
    }

    /// Returns the normal of such a face.
    fn continued_normal(&self, slope: f64) -> Option<DVec3> {
        self.normals.continued_normal(self.feature, self.outward, slope)
    }

    /// Returns false only if the pieces have no contact, given that the mesh of this piece does not
    /// admit the direction.
    fn may_touch(&self, slope: f64, turn: f64) -> bool {
        self.may_continue(slope)
            || self.normals.valleys_at(self.feature).next().is_some()
            || turn > ADMISSIBLE_ANGLE && self.admits(turn)
    }
}

/// Returns the contact of two pieces that are apart. `patch_slope` is the tangent of the angle of
/// patches.
pub(super) fn contact_apart(
    input: &QueryInput<'_>,
    leaf: &LeafPair,
    closest: &Closest,
    patch_slope: Option<f64>,
) -> Found {
    let Closest { point_a, point_b, normal, features, .. } = *closest;
    let place = &input.place;
    let outward_a = place.inverse_vector(-normal);
    let side_a = Near::new(input.a, leaf.piece_a, features.a, place.inverse_point(point_a), outward_a);
    let admitted_a = side_a.admits(ADMISSIBLE_ANGLE);
    // Most pieces of curved surfaces end here.
    if !admitted_a && !patch_slope.is_some_and(|slope| side_a.may_touch(slope, input.settings.turn)) {
        return Found::Nothing;
    }
    let side_b = Near::new(input.b, leaf.piece_b, features.b, point_b, normal);
    let admitted = [admitted_a, side_b.admits(ADMISSIBLE_ANGLE)];
    if admitted == [true; 2] {
        return Found::Admissible(at_closest(leaf, closest));
    }
    let Some(slope) = patch_slope else { return Found::Nothing };
    let apart = Apart { input, leaf, closest, sides: [&side_a, &side_b], admitted };
    let continued = apart.on_continued(slope).map(Found::NearlyFlush);
    continued
        .or_else(|| apart.beside_valley().map(Found::BesideValley))
        .or_else(|| apart.after_turn().map(Found::NearlyFlush))
        .unwrap_or(Found::Nothing)
}

impl Apart<'_> {
    /// Returns the contact along the normal of a flat face that continues beyond one of the pieces.
    /// `None` if the other piece does not admit the direction of the closest points, or is not of
    /// such a face either.
    fn on_continued(&self, slope: f64) -> Option<Contact> {
        let Closest { point_a, point_b, normal, features, distance, .. } = *self.closest;
        let [a, b] = self.sides;
        if !(self.admitted[0] || a.may_continue(slope)) || !(self.admitted[1] || b.may_continue(slope)) {
            return None;
        }
        let along_a = || Some(-self.input.place.vector(a.continued_normal(slope)?));
        let along_b = || b.continued_normal(slope);
        let flat = match self.admitted {
            [true, true] => return None,
            [false, true] => along_a()?,
            [true, false] => along_b()?,
            [false, false] => (along_a()? + along_b()?).normalize(),
        };
        let separation = distance * normal.dot(flat);
        let points = points_about(point_a.midpoint(point_b), flat, separation);
        Some(at(self.leaf, features, points, flat, separation))
    }

    /// Returns the contact at the closest points, if a turn of the bodies can make their direction
    /// a normal of both meshes.
    fn after_turn(&self) -> Option<Contact> {
        let (turn, [a, b]) = (self.input.settings.turn, self.admitted);
        let [side_a, side_b] = self.sides;
        let may_touch = turn > ADMISSIBLE_ANGLE && (a || side_a.admits(turn)) && (b || side_b.admits(turn));
        may_touch.then(|| at_closest(self.leaf, self.closest))
    }

    /// Returns the contact of least separation beside a valley of one of the pieces. `None` if the
    /// other piece does not admit the direction of the closest points: then another piece of its
    /// body is nearer to the valley. `None` also if its lowest vertex is on the side of the face.
    /// The vertex is not over the face, or it would be the closest point. It is past another edge.
    fn beside_valley(&self) -> Option<Contact> {
        let nearest = |one: &Contact, other: &Contact| one.separation.total_cmp(&other.separation);
        let FeaturePair { a, b } = self.closest.features;
        let [side_a, side_b] = self.sides;
        match self.admitted {
            [true, false] => {
                let beside = |valley| self.beside_valley_of_b(valley);
                side_b.normals.valleys_at(b).filter_map(beside).min_by(nearest)
            }
            [false, true] => {
                let beside = |valley| self.beside_valley_of_a(valley);
                side_a.normals.valleys_at(a).filter_map(beside).min_by(nearest)
            }
            _ => None,
        }
    }

    fn beside_valley_of_b(&self, valley: &Valley) -> Option<Contact> {
        let QueryInput { place, tolerance, .. } = self.input;
        let [Near { normals: a, .. }, Near { normals: b, .. }] = self.sides;
        let Plane { normal, offset } = valley.plane;
        let outward = place.inverse_vector(-normal);
        let limit = normal.dot(place.translation) - offset + tolerance;
        let tip = a.tip(self.closest.features.a, outward, limit)?;
        let point = place.point(a.polytope().vertex(tip));
        let separation = valley.gap(b.polytope(), point, *tolerance)?;
        let features = FeaturePair { a: Feature::Vertex(tip), b: Feature::Face(valley.face) };
        let points = [point, point - normal * separation];
        (valley.is_crossed(b.polytope(), point) && a.vertex_admits(tip, outward))
            .then(|| at(self.leaf, features, points, normal, separation))
    }

    fn beside_valley_of_a(&self, valley: &Valley) -> Option<Contact> {
        let QueryInput { place, tolerance, .. } = self.input;
        let [Near { normals: a, .. }, Near { normals: b, .. }] = self.sides;
        let Plane { normal, offset } = valley.plane;
        let outward = -place.vector(normal);
        let limit = outward.dot(place.translation) - offset + tolerance;
        let tip = b.tip(self.closest.features.b, outward, limit)?;
        let point = b.polytope().vertex(tip);
        let point_in_a = place.inverse_point(point);
        let separation = valley.gap(a.polytope(), point_in_a, *tolerance)?;
        let features = FeaturePair { a: Feature::Face(valley.face), b: Feature::Vertex(tip) };
        let points = [point + outward * separation, point];
        (valley.is_crossed(a.polytope(), point_in_a) && b.vertex_admits(tip, outward))
            .then(|| at(self.leaf, features, points, outward, separation))
    }
}

/// Returns a contact beside a valley of an earlier pose at this pose. The separation of such a
/// contact also depends on how far it is beside the valley.
pub(super) fn beside_valley_again(input: &QueryInput<'_>, memory: &PairMemory) -> Contact {
    let place = &input.place;
    let contact = memory.extrapolate(place);
    let (piece_a, piece_b) = input.pieces(contact.piece_a, contact.piece_b);
    let (valleys_a, valleys_b) =
        (input.a.admissible().valleys_of(contact.piece_a), input.b.admissible().valleys_of(contact.piece_b));
    let (on_a, on_b) = (place.point(memory.point_a), place.inverse_point(memory.point_b));
    let sides = [(contact.features.a, piece_a, valleys_a, on_b), (contact.features.b, piece_b, valleys_b, on_a)];
    let separation = sides
        .into_iter()
        .flat_map(|(feature, piece, valleys, point)| {
            let of_face = valleys.iter().filter(move |valley| Feature::Face(valley.face) == feature);
            of_face.filter_map(move |valley| valley.gap(piece, point, input.tolerance))
        })
        .fold(f64::INFINITY, f64::min);
    memory.contact(contact.midpoint(), contact.normal, separation)
}
