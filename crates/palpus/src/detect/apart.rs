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
use crate::body::{AdmissibleNormals, Feature, FeaturePair, Valley};
use crate::collision::{Closest, LeafPair};

/// Two pieces that are apart.
pub(super) struct Apart<'q> {
    input: &'q QueryInput<'q>,
    leaf: &'q LeafPair,
    closest: &'q Closest,
    normals: [AdmissibleNormals<'q>; 2],
    /// The direction of the closest points out of a in a's frame, and out of b in b's frame.
    outward: [DVec3; 2],
    /// For a and for b: true if the closest point lies on the mesh, and the direction of the
    /// closest points is a normal of the mesh there.
    admitted: [bool; 2],
}

impl<'q> Apart<'q> {
    pub(super) fn new(input: &'q QueryInput<'q>, leaf: &'q LeafPair, closest: &'q Closest) -> Self {
        let outward = [input.place.inverse_vector(-closest.normal), closest.normal];
        let normals = input.admissible_normals(leaf);
        let mut apart = Self { input, leaf, closest, normals, outward, admitted: [false; 2] };
        apart.admitted = [apart.admits_a(ADMISSIBLE_ANGLE), apart.admits_b(ADMISSIBLE_ANGLE)];
        apart
    }

    /// Returns true if the closest point of a lies on the mesh, and the direction of the closest
    /// points is within `angle` (rad) of a normal of the mesh there.
    fn admits_a(&self, angle: f64) -> bool {
        let piece = &self.input.a.pieces()[self.leaf.piece_a as usize];
        let point = self.input.place.inverse_point(self.closest.point_a);
        self.normals[0].holds_within(piece, self.closest.features.a, point, self.outward[0], angle)
    }

    /// As [`Self::admits_a`], for b.
    fn admits_b(&self, angle: f64) -> bool {
        let piece = &self.input.b.pieces()[self.leaf.piece_b as usize];
        self.normals[1].holds_within(piece, self.closest.features.b, self.closest.point_b, self.outward[1], angle)
    }

    /// Returns the contact. `patch_slope` is the tangent of the angle of patches.
    pub(super) fn contact(&self, patch_slope: Option<f64>) -> Found {
        if self.admitted == [true; 2] {
            return Found::Admissible(at_closest(self.leaf, self.closest));
        }
        let Some(slope) = patch_slope else { return Found::Nothing };
        let continued = self.on_continued(slope).map(Found::NearlyFlush);
        continued
            .or_else(|| self.beside_valley().map(Found::BesideValley))
            .or_else(|| self.after_turn().map(Found::NearlyFlush))
            .unwrap_or(Found::Nothing)
    }

    /// Returns the contact along the normal of a flat face that continues beyond one of the pieces.
    /// `None` if the other piece does not admit the direction of the closest points, or is not of
    /// such a face either.
    fn on_continued(&self, slope: f64) -> Option<Contact> {
        let Closest { point_a, point_b, normal, features, distance, .. } = *self.closest;
        let (a, b) = (self.input.a.admissible(), self.input.b.admissible());
        let [outward_a, outward_b] = self.outward;
        // Most pieces of curved surfaces end here.
        if !(self.admitted[0] || a.may_continue(self.leaf.piece_a, outward_a, slope))
            || !(self.admitted[1] || b.may_continue(self.leaf.piece_b, outward_b, slope))
        {
            return None;
        }
        let [normals_a, normals_b] = &self.normals;
        let along_a = || Some(-self.input.place.vector(normals_a.continued_normal(features.a, outward_a, slope)?));
        let along_b = || normals_b.continued_normal(features.b, outward_b, slope);
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
        let may_touch = turn > ADMISSIBLE_ANGLE && (a || self.admits_a(turn)) && (b || self.admits_b(turn));
        may_touch.then(|| at_closest(self.leaf, self.closest))
    }

    /// Returns the contact of least separation beside a valley of one of the pieces. `None` if the
    /// other piece does not admit the direction of the closest points: then another piece of its
    /// body is nearer to the valley. `None` also if its lowest vertex is on the side of the face.
    /// The vertex is not over the face, or it would be the closest point. It is past another edge.
    fn beside_valley(&self) -> Option<Contact> {
        let nearest = |one: &Contact, other: &Contact| one.separation.total_cmp(&other.separation);
        let FeaturePair { a, b } = self.closest.features;
        let [normals_a, normals_b] = &self.normals;
        match self.admitted {
            [true, false] => {
                let beside = |valley| self.beside_valley_of_b(valley);
                normals_b.valleys_at(b).filter_map(beside).min_by(nearest)
            }
            [false, true] => {
                let beside = |valley| self.beside_valley_of_a(valley);
                normals_a.valleys_at(a).filter_map(beside).min_by(nearest)
            }
            _ => None,
        }
    }

    fn beside_valley_of_b(&self, valley: &Valley) -> Option<Contact> {
        let (QueryInput { place, tolerance, .. }, [a, b]) = (self.input, &self.normals);
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
        let (QueryInput { place, tolerance, .. }, [a, b]) = (self.input, &self.normals);
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
