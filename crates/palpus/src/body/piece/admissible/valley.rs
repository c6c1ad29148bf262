//! Valleys: edges of surface faces where the mesh bends inward, by less than a right angle.
//!
//! A valley lies where one piece ends and another begins. A point of another body that lies on one
//! side of a valley, near it, is over the surface face of only one of the two pieces. Its closest
//! point on the other piece is the valley itself, and the direction to it is not a normal of the
//! mesh. But the point is also above the plane of the other piece's surface face, because the mesh
//! continues this plane into the solid. A small motion across the valley brings the point over the
//! other face. So both planes bound the motion of the point near the valley.
//!
//! The *gap* of a point beside the valley is its height h above the plane of the surface face, as
//! long as its distance d from the valley is at most [`VALLEY_SHARE`] of the contact tolerance.
//! Beyond it, the gap grows to d, which is the tolerance where the contact ends. At the valley, h
//! and d are the same. So the gap is continuous, and never less than the height. It also grows to
//! the tolerance for points that are behind a ridge, or past an end of the valley.

use glam::DVec3;

use super::{Admissible, AdmissibleNormals};
use crate::algebra::Plane;
use crate::algebra::tolerance::{VALLEY_BELOW, VALLEY_SHARE};
use crate::body::{Feature, Polytope};

/// An edge of a surface face where the mesh bends inward. All vectors are in the piece's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Valley {
    /// Index of the edge in the polytope.
    pub edge: u32,
    /// Indices of the edge's ends in the polytope. The surface face is to the left of the way from
    /// the first end to the second.
    pub ends: [u32; 2],
    /// Index of the surface face in the polytope.
    pub face: u32,
    /// Index of the face beyond the edge in the polytope. It is virtual.
    pub other: u32,
    /// Plane of the surface face, outward.
    pub plane: Plane,
    /// Unit normal of the mesh beyond the edge.
    pub beyond: DVec3,
}

impl Valley {
    /// Returns true if `feature` is this edge, or is at its side away from the surface face.
    fn is_at(&self, feature: Feature) -> bool {
        match feature {
            Feature::Vertex(vertex) => self.ends.contains(&vertex),
            Feature::Edge(edge) => self.edge == edge,
            Feature::Face(face) => self.other == face,
        }
    }

    /// Returns true if `point` is not on the side of the surface face, as seen from the valley.
    pub(crate) fn is_crossed(&self, polytope: &Polytope, point: DVec3) -> bool {
        let [tail, head] = self.ends.map(|v| polytope.vertex(v));
        self.across(head - tail, point - tail) >= 0.0
    }

    /// Returns how far `off` (from the first end) points away from the surface face, along the face
    /// and at right angles to the valley's direction `along`; in units of the length of `along`.
    fn across(&self, along: DVec3, off: DVec3) -> f64 {
        along.cross(self.plane.normal).dot(off)
    }

    /// Returns the gap between `point` and the plane of the surface face, for contacts within
    /// `tolerance` (length unit of the polytope). `None` if the gap is not less than `tolerance`.
    pub(crate) fn gap(&self, polytope: &Polytope, point: DVec3, tolerance: f64) -> Option<f64> {
        let [tail, head] = self.ends.map(|v| polytope.vertex(v));
        let length = tail.distance(head);
        let along = (head - tail) / length;
        let off = point - tail;
        let (height, far) = (self.plane.normal.dot(off), along.dot(off));
        // How far the point is past an end of the valley, and beside the surface face.
        let past = (-far).max(far - length).max(0.0);
        let beside = self.across(along, off).max(0.0);
        let distance = DVec3::new(height, past, beside).length();
        if distance >= tolerance {
            return None;
        }
        // A point below the mesh beyond the valley is not in the valley, but behind a ridge.
        let above = (1.0 + self.beyond.dot(off) / (VALLEY_BELOW * distance).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        // Beyond the ends, the valley continues only as far as the point is beside it.
        let within = if past > beside { (2.0 - past / beside).max(0.0) } else { 1.0 };
        let share = above * within;
        let gap = gap_beside(height, distance, tolerance) * share + tolerance * (1.0 - share);
        (gap < tolerance).then_some(gap)
    }
}

/// Returns the gap at a point that is `height` above the plane of a surface face, and `distance`
/// away from a valley of this face; see the module's description.
pub(crate) fn gap_beside(height: f64, distance: f64, tolerance: f64) -> f64 {
    let near = ((1.0 - distance / tolerance) / (1.0 - VALLEY_SHARE)).clamp(0.0, 1.0);
    distance - (distance - height.max(0.0)) * near
}

impl Admissible {
    /// Returns the valleys of piece `k`.
    pub(crate) fn valleys_of(&self, k: u32) -> &[Valley] {
        let [from, to] = [k, k + 1].map(|end| self.pieces[end as usize].valleys as usize);
        &self.valleys[from..to]
    }
}

impl<'a> AdmissibleNormals<'a> {
    /// Returns the valleys that are at `feature`, or border the virtual face `feature`.
    pub(crate) fn valleys_at(&self, feature: Feature) -> impl Iterator<Item = &'a Valley> {
        self.all.valleys_of(self.piece).iter().filter(move |valley| valley.is_at(feature))
    }

    /// Returns the normals of the surface faces that end at valleys.
    pub(crate) fn valley_normals(&self) -> impl Iterator<Item = DVec3> {
        let valleys = self.all.valleys_of(self.piece);
        // Most valleys of a face follow each other.
        let faces = valleys.chunk_by(|valley, next| valley.face == next.face);
        faces.map(|valleys| valleys[0].plane.normal)
    }

    /// Returns the vertex of the piece that is farthest along `outward` (unit, in the piece's
    /// frame), if this direction may be admissible and no vertex is farther than `limit` (length
    /// unit of the polytope). The search begins at `feature`.
    pub(crate) fn tip(&self, feature: Feature, outward: DVec3, limit: f64) -> Option<u32> {
        let from = feature.some_vertex(self.polytope);
        let is_beyond = |v: u32| outward.dot(self.polytope.vertex(v)) > limit;
        // Most pieces end here. The climb would take longer.
        if !self.cap().holds(outward)
            || is_beyond(from)
            || self.polytope.ring(from).iter().any(|spoke| is_beyond(spoke.neighbour))
        {
            return None;
        }
        let (tip, height) = self.polytope.climb(from, outward);
        (height <= limit).then_some(tip)
    }
}
