//! The normals that a piece owns: those of the source mesh, not of the hull \[K02 §3.4\].
//!
//! A piece is the hull of a patch. The surface that the hull added is *virtual*: it is not part of
//! the mesh, and no contact may push through it. The normals that a contact of the piece may have
//! are those that its patch has on the source mesh:
//!
//! * the normal of each face of the piece in which triangles of the patch lie;
//! * along an edge of such a face at which the mesh bends outward, the arc from that face's normal
//!   to the true normal on the other side, whichever piece that belongs to; the arc's end, the
//!   neighbour's normal, is owned too (*borrowed*);
//! * along an edge at which the mesh bends inward, nothing but the face's normal;
//! * at a vertex, every direction along which no neighbour of the vertex on the mesh lies higher.
//!
//! Each of these normals supports the piece: the piece lies within the solid, so the hull's arc at
//! a convex edge contains the true arc. At an edge where the mesh ends there is no true normal on
//! the other side. There the arc spans a right angle, or ends with the hull's arc.
//!
//! Borrowed normals make the minimum over a piece's normals continuous in the pose. Where an edge
//! pair ceases to exist at the end of an arc, the normal at that end has the same depth. So has the
//! neighbour's own face at the same pose.
//!
//! Deviation from \[K02\], which distinguishes original and virtual features but does not limit an
//! edge's arc.

mod apart;
mod build;
mod cap;
#[cfg(test)]
mod tests;

pub use cap::Cap;
use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, ADMISSIBLE_TRIANGLES};
use crate::body::decompose::facet::NONE;
use crate::body::{Feature, Mesh, Piece, Polytope, Provenance};

/// The own normals of all pieces of a body, in flat arrays.
#[derive(Clone, Debug, Default)]
pub struct Admissible {
    pieces: Vec<Range>,
    faces: Vec<OwnFace>,
    borrowed: Vec<Borrowed>,
    arcs: Vec<OwnArc>,
    /// For each piece's vertices the mesh vertex there, or [`NONE`].
    corners: Vec<u32>,
    caps: Vec<Cap>,
    ring_starts: Vec<u32>,
    ring: Vec<u32>,
    /// Largest distance of a plane's vertices from the plane, metres.
    noise: f64,
}

/// Ends of a piece's entries in each array.
#[derive(Clone, Copy, Debug, Default)]
struct Range {
    faces: u32,
    borrowed: u32,
    arcs: u32,
    corners: u32,
}

/// A face of a piece in which original triangles lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnFace {
    /// Index in the polytope.
    pub face: u32,
    /// True if the triangles cover all of it.
    pub whole: bool,
}

/// A normal that a piece owns as the end of an arc: that of the mesh beyond one of its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Borrowed {
    /// The supporting plane of the piece with that normal; it holds the edge.
    pub plane: Plane,
    /// Index in the polytope.
    pub edge: u32,
}

/// The normals that a piece owns along an edge: an arc of a great circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnArc {
    /// Index in the polytope.
    pub edge: u32,
    /// The plane to the left of the edge. Numbers below the face count are faces of the polytope;
    /// the following ones are borrowed planes.
    pub left: u32,
    /// The plane to the right.
    pub right: u32,
}

impl Admissible {
    /// The own normals of piece `k`, whose shape is `polytope`.
    #[inline]
    pub fn of<'a>(&'a self, k: u32, polytope: &'a Polytope, mesh: &'a Mesh) -> OwnNormals<'a> {
        let (from, to) = (self.pieces[k as usize], self.pieces[k as usize + 1]);
        OwnNormals {
            all: self,
            mesh,
            polytope,
            faces: &self.faces[from.faces as usize..to.faces as usize],
            borrowed: &self.borrowed[from.borrowed as usize..to.borrowed as usize],
            arcs: &self.arcs[from.arcs as usize..to.arcs as usize],
            corners: &self.corners[from.corners as usize..to.corners as usize],
            // The list is empty while the caps are being found.
            cap: self.caps.get(k as usize).copied().unwrap_or(Cap::WHOLE),
        }
    }

    /// The most arcs that a piece has.
    pub fn most_arcs(&self) -> usize {
        self.pieces.windows(2).map(|pair| (pair[1].arcs - pair[0].arcs) as usize).max().unwrap_or(0)
    }

    /// True if no neighbour of mesh vertex `v` is higher than it along `outward`.
    fn is_highest(&self, mesh: &Mesh, v: u32, outward: DVec3) -> bool {
        if v == NONE {
            return false;
        }
        let at = mesh.vertices()[v as usize];
        let ring = &self.ring[self.ring_starts[v as usize] as usize..self.ring_starts[v as usize + 1] as usize];
        ring.iter().all(|&w| {
            let edge = mesh.vertices()[w as usize] - at;
            let rise = edge.dot(outward) - self.noise;
            rise <= 0.0 || rise * rise <= ADMISSIBLE_ANGLE * ADMISSIBLE_ANGLE * edge.length_squared()
        })
    }
}

/// The own normals of one piece.
#[derive(Clone, Copy, Debug)]
pub struct OwnNormals<'a> {
    all: &'a Admissible,
    mesh: &'a Mesh,
    polytope: &'a Polytope,
    faces: &'a [OwnFace],
    borrowed: &'a [Borrowed],
    arcs: &'a [OwnArc],
    corners: &'a [u32],
    cap: Cap,
}

impl<'a> OwnNormals<'a> {
    /// The piece's shape.
    #[inline]
    pub fn polytope(&self) -> &'a Polytope {
        self.polytope
    }

    /// Holds every direction that the piece owns.
    #[inline]
    pub fn cap(&self) -> Cap {
        self.cap
    }

    /// Its faces with original triangles, by ascending index.
    #[inline]
    pub fn faces(&self) -> &'a [OwnFace] {
        self.faces
    }

    /// Its borrowed normals.
    #[inline]
    pub fn borrowed(&self) -> &'a [Borrowed] {
        self.borrowed
    }

    /// Its edges with arcs, by ascending index.
    #[inline]
    pub fn arcs(&self) -> &'a [OwnArc] {
        self.arcs
    }

    /// The normals at the two ends of an arc, left and right.
    #[inline]
    pub fn ends(&self, arc: &OwnArc) -> [DVec3; 2] {
        [arc.left, arc.right].map(|plane| self.plane(plane).normal)
    }

    /// The plane of a number as stored in the arcs.
    #[inline]
    pub fn plane(&self, index: u32) -> Plane {
        match (index as usize).checked_sub(self.polytope.face_count()) {
            None => self.polytope.plane(index),
            Some(borrowed) => self.borrowed[borrowed].plane,
        }
    }

    /// The own face of that index, if it is one.
    #[inline]
    pub fn own_face(&self, face: u32) -> Option<&'a OwnFace> {
        self.faces.binary_search_by_key(&face, |own| own.face).ok().map(|k| &self.faces[k])
    }

    /// The arc along an edge, if it has one.
    #[inline]
    pub fn arc_at(&self, edge: u32) -> Option<&'a OwnArc> {
        self.arcs.binary_search_by_key(&edge, |arc| arc.edge).ok().map(|k| &self.arcs[k])
    }

    /// The feature on which the plane of that number lies.
    #[inline]
    pub fn feature(&self, index: u32) -> Feature {
        match (index as usize).checked_sub(self.polytope.face_count()) {
            None => Feature::Face(index),
            Some(borrowed) => Feature::Edge(self.borrowed[borrowed].edge),
        }
    }

    /// The number of the plane that is borrowed along an edge, if one is.
    #[inline]
    pub fn borrowed_at(&self, edge: u32) -> Option<u32> {
        let found = self.borrowed.binary_search_by_key(&edge, |borrowed| borrowed.edge).ok()?;
        Some((self.polytope.face_count() + found) as u32)
    }

    /// True if the piece owns `direction` (unit, in its frame) along an edge that is perpendicular
    /// to it, within [`ADMISSIBLE_ANGLE`].
    pub fn edge_faces(&self, edge: u32, direction: DVec3) -> bool {
        match self.arc_at(edge) {
            Some(arc) => self.arc_holds(arc, direction),
            None => {
                let Sides { left, right } = self.sides(edge);
                [left, right].into_iter().any(|face| {
                    self.own_face(face).is_some()
                        && self.polytope.plane(face).normal.distance_squared(direction)
                            <= ADMISSIBLE_ANGLE * ADMISSIBLE_ANGLE
                })
            }
        }
    }

    fn sides(&self, edge: u32) -> Sides {
        let edge = self.polytope.edge(edge);
        Sides { left: edge.left, right: edge.right }
    }

    fn arc_holds(&self, arc: &OwnArc, direction: DVec3) -> bool {
        let [left, right] = self.ends(arc);
        let edge = self.polytope.edge(arc.edge);
        let along = self.polytope.vertex(edge.head) - self.polytope.vertex(edge.tail);
        let slack = ADMISSIBLE_ANGLE * along.length();
        // True between the two ends: not before the left one and not after the right one, along the
        // shorter arc.
        along.dot(left.cross(direction)) >= -slack
            && along.dot(direction.cross(right)) >= -slack
            && direction.dot(left + right) > 0.0
    }

    /// True if `point` on `feature` lies on the surface of the mesh and `outward` (unit; both in
    /// the piece's frame) is a direction that the surface has there, within [`ADMISSIBLE_ANGLE`]
    /// and the surface's noise. The direction is one that supports the piece there.
    pub fn holds(&self, piece: &Piece, feature: Feature, point: DVec3, outward: DVec3) -> bool {
        match feature {
            Feature::Face(face) => {
                self.own_face(face)
                    .is_some_and(|own| own.whole || lies_on(piece.face_triangles(face), self.mesh, point))
                    && self.polytope.plane(face).normal.dot(outward) > 0.0
            }
            Feature::Edge(edge) => self.edge_faces(edge, outward),
            Feature::Vertex(vertex) => self.vertex_owns(vertex, outward),
        }
    }

    /// True if the piece owns `direction` (unit, in its frame, one that supports it at the vertex):
    /// some face of the mesh there looks to its side, and no neighbour of the vertex on the mesh
    /// lies higher.
    pub fn vertex_owns(&self, vertex: u32, direction: DVec3) -> bool {
        self.vertex_faces(vertex, direction) && self.all.is_highest(self.mesh, self.corners[vertex as usize], direction)
    }

    /// True if an own face at the vertex looks to the side of `direction`.
    fn vertex_faces(&self, vertex: u32, direction: DVec3) -> bool {
        let faces_it = |face| self.own_face(face).is_some() && self.polytope.plane(face).normal.dot(direction) > 0.0;
        self.polytope.ring(vertex).iter().any(|spoke| faces_it(spoke.left))
    }
}

struct Sides {
    left: u32,
    right: u32,
}

/// True if `point`, in the plane of the triangles, lies on one of them; a point on a face with more
/// than [`ADMISSIBLE_TRIANGLES`] counts as on one.
fn lies_on(triangles: &[u32], mesh: &Mesh, point: DVec3) -> bool {
    triangles.len() > ADMISSIBLE_TRIANGLES
        || triangles.iter().any(|&t| {
            let p = mesh.triangle_points(t);
            let normal = mesh.triangle_normal(t);
            (0..3).all(|k| {
                let along = p[(k + 1) % 3] - p[k];
                normal.cross(along).dot(point - p[k]) >= -ADMISSIBLE_ANGLE * along.length_squared()
            })
        })
}

/// True if original triangles cover the face, wholly or for the larger part.
fn is_original(polytope: &Polytope, face: u32) -> bool {
    polytope.face_provenance(face) == Provenance::Original
}
