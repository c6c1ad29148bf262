//! Admissible normals of pieces: normals of the source mesh instead of the hull \[K02 §3.4\].
//!
//! A piece is the hull of a patch. The faces that the hull added are *virtual*: they are not
//! part of the mesh, and no contact force may act along their normals. A normal is admissible if
//! the source mesh has this normal at the patch. The admissible normals are:
//!
//! * The normal of each face of the piece in which triangles of the patch lie. These faces are
//!   called *surface faces*.
//! * At an edge of a surface face where the mesh bends outward: the arc from the face's normal to
//!   the normal of the mesh on the other side. The other side may belong to another piece. The
//!   normal at the end of the arc is called *borrowed*.
//! * At an edge of a surface face where the mesh bends inward: only the face's normal.
//! * At a vertex: every direction along which no neighbouring mesh vertex is higher.
//!
//! A piece of a sheet ([`Mesh::is_sheet`]) is a plate, and both of its faces are surface faces. On
//! its back, the mesh bends outward where it bends inward on the front.
//!
//! Each admissible normal is a support direction of the piece. The piece lies within the solid, so
//! the hull's arc at a convex edge contains the arc of the mesh. At a boundary edge, the mesh has
//! no normal on the other side. The arc then spans a right angle, but ends at the latest where the
//! hull's arc ends.
//!
//! Borrowed normals make the minimum depth over a piece's normals continuous in the pose. When an
//! edge pair disappears at the end of an arc, the borrowed normal at this end has the same depth as
//! the edge pair. The neighbour's surface face also has this depth.
//!
//! Deviation from \[K02\]: the paper distinguishes original and virtual features, but does not
//! limit the arc of an edge.

mod apart;
mod border;
mod build;
mod cap;
mod flat;
#[cfg(test)]
mod tests;
mod valley;

pub(crate) use border::{Border, FaceRim, FlatAround, is_near};
use border::{InnerVertex, PartialSide};
pub use cap::Cap;
use glam::DVec3;
pub(crate) use valley::{Valley, gap_beside};

use crate::algebra::Plane;
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, ADMISSIBLE_TRIANGLES};
use crate::body::decompose::facet::NONE;
use crate::body::{Edge, Feature, Mesh, Piece, Polytope, Provenance};

/// The admissible normals of all pieces of a body, in flat arrays.
#[derive(Clone, Debug, Default)]
pub struct Admissible {
    pieces: Vec<Range>,
    faces: Vec<SurfaceFace>,
    borrowed: Vec<Borrowed>,
    arcs: Vec<SurfaceArc>,
    valleys: Vec<Valley>,
    /// By ascending index of their vertex in each piece.
    inner: Vec<InnerVertex>,
    /// By ascending index of face and side in each piece.
    partial: Vec<PartialSide>,
    /// For each vertex of each piece, the mesh vertex at the same position, or [`NONE`].
    corners: Vec<u32>,
    caps: Vec<Cap>,
    /// For each piece, a cap around the normals of the flat faces of the mesh that continue beyond
    /// the piece.
    continued: Vec<Cap>,
    /// The vectors from mesh vertex `v` to its neighbours are
    /// `edges[edge_starts[v] .. edge_starts[v + 1]]`.
    edge_starts: Vec<u32>,
    edges: Vec<DVec3>,
    /// Largest distance of the vertices of a planar face from its plane (m).
    noise: f64,
}

/// End of a piece's entries in each array.
#[derive(Clone, Copy, Debug, Default)]
struct Range {
    faces: u32,
    borrowed: u32,
    arcs: u32,
    valleys: u32,
    inner: u32,
    partial: u32,
    corners: u32,
}

/// A face of a piece in which triangles of its patch lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceFace {
    /// Index of the face in the polytope.
    pub face: u32,
    /// True if the triangles cover the whole face.
    pub whole: bool,
    /// True if the mesh covers at least half of the face, together with the triangles of other
    /// pieces.
    pub covered: bool,
    /// How the flat face of the mesh continues beyond this face.
    pub(crate) rim: FaceRim,
}

/// A borrowed normal of a piece. It is the normal of the mesh beyond an edge of the piece, at the
/// end of the edge's arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Borrowed {
    /// The supporting plane of the piece with that normal. The plane contains the edge. Its offset
    /// is in metres.
    pub plane: Plane,
    /// Index of the edge in the polytope.
    pub edge: u32,
}

/// The admissible normals at an edge: an arc of a great circle on the Gauss sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceArc {
    /// Index of the edge in the polytope.
    pub edge: u32,
    /// Number of the plane to the left of the edge. A number less than the face count is a face of
    /// the polytope. Otherwise the number minus the face count is an index into
    /// [`AdmissibleNormals::borrowed`].
    pub left: u32,
    /// Number of the plane to the right of the edge, counted as in `left`.
    pub right: u32,
}

impl Admissible {
    /// Returns the admissible normals of piece `k`, whose shape is `polytope`.
    #[inline]
    pub fn of<'a>(&'a self, k: u32, polytope: &'a Polytope, mesh: &'a Mesh) -> AdmissibleNormals<'a> {
        let [from, to] = [self.pieces[k as usize], self.pieces[k as usize + 1]];
        AdmissibleNormals {
            all: self,
            mesh,
            polytope,
            piece: k,
            faces: &self.faces[from.faces as usize..to.faces as usize],
            borrowed: &self.borrowed[from.borrowed as usize..to.borrowed as usize],
            arcs: &self.arcs[from.arcs as usize..to.arcs as usize],
        }
    }

    /// Returns true if a flat face of the mesh may continue beyond piece `k`, with a normal that
    /// differs from `outward` (unit, in the piece's frame) by less than `slope` (tangent of the
    /// angle). Otherwise [`AdmissibleNormals::continued_normal`] is `None` for each feature of the
    /// piece.
    #[inline]
    pub(crate) fn may_continue(&self, k: u32, outward: DVec3, slope: f64) -> bool {
        // The cosine falls by at most the sine of the added angle, which is less than its tangent.
        let Cap { axis, least } = self.continued[k as usize];
        axis.dot(outward) >= least - slope
    }

    /// Returns the largest number of arcs of a piece.
    pub fn most_arcs(&self) -> usize {
        self.pieces.windows(2).map(|pair| (pair[1].arcs - pair[0].arcs) as usize).max().unwrap_or(0)
    }

    /// Returns true if no neighbour of mesh vertex `v` is higher than `v` along `outward`, within
    /// `angle` (rad) and the noise.
    fn is_highest(&self, v: u32, outward: DVec3, angle: f64) -> bool {
        v != NONE && self.edges(v).iter().all(|&edge| !self.rises(edge, outward, angle))
    }

    /// Returns true if no neighbour of mesh vertex `v` is higher than `v` along `normal`, and each
    /// neighbour that is higher along `outward` lies in the plane with this normal.
    fn continues(&self, v: u32, normal: DVec3, outward: DVec3) -> bool {
        let rises = |edge, normal| self.rises(edge, normal, ADMISSIBLE_ANGLE);
        let is_flat = |&edge: &DVec3| !rises(edge, normal) && (edge.dot(outward) <= 0.0 || !rises(edge, -normal));
        v != NONE && self.edges(v).iter().all(is_flat)
    }

    /// Returns the vectors from mesh vertex `v` to its neighbours.
    fn edges(&self, v: u32) -> &[DVec3] {
        &self.edges[self.edge_starts[v as usize] as usize..self.edge_starts[v as usize + 1] as usize]
    }

    /// Returns true if `edge` rises along `outward` by more than `angle` (rad) and the noise.
    fn rises(&self, edge: DVec3, outward: DVec3, angle: f64) -> bool {
        let rise = edge.dot(outward) - self.noise;
        rise > 0.0 && rise * rise > angle * angle * edge.length_squared()
    }
}

/// The admissible normals of one piece.
#[derive(Clone, Copy, Debug)]
pub struct AdmissibleNormals<'a> {
    all: &'a Admissible,
    mesh: &'a Mesh,
    polytope: &'a Polytope,
    /// Index of the piece.
    piece: u32,
    faces: &'a [SurfaceFace],
    borrowed: &'a [Borrowed],
    arcs: &'a [SurfaceArc],
}

impl<'a> AdmissibleNormals<'a> {
    /// Returns the shape of the piece.
    #[inline]
    pub fn polytope(&self) -> &'a Polytope {
        self.polytope
    }

    /// Returns the index of the piece.
    #[inline]
    pub(crate) fn piece(&self) -> u32 {
        self.piece
    }

    /// Returns a cap that contains all admissible normals of the piece.
    #[inline]
    pub fn cap(&self) -> Cap {
        // While the caps are computed, their list is empty.
        self.all.caps.get(self.piece as usize).copied().unwrap_or(Cap::WHOLE)
    }

    /// Returns the faces in which triangles of the patch lie, by ascending index.
    #[inline]
    pub fn faces(&self) -> &'a [SurfaceFace] {
        self.faces
    }

    /// Returns the borrowed normals, by ascending index of their edge.
    #[inline]
    pub fn borrowed(&self) -> &'a [Borrowed] {
        self.borrowed
    }

    /// Returns the arcs, by ascending index of their edge.
    #[inline]
    pub fn arcs(&self) -> &'a [SurfaceArc] {
        self.arcs
    }

    /// Returns the mesh vertex at a vertex of the piece, or [`NONE`].
    #[inline]
    fn corner(&self, vertex: u32) -> u32 {
        self.all.corners[self.all.pieces[self.piece as usize].corners as usize + vertex as usize]
    }

    /// Returns the unit normals at the two ends of an arc, left and right.
    #[inline]
    pub fn ends(&self, arc: &SurfaceArc) -> [DVec3; 2] {
        [arc.left, arc.right].map(|plane| self.plane(plane).normal)
    }

    /// Returns the plane with the number `index`, as stored in [`SurfaceArc::left`].
    #[inline]
    pub fn plane(&self, index: u32) -> Plane {
        match (index as usize).checked_sub(self.polytope.face_count()) {
            None => self.polytope.plane(index),
            Some(borrowed) => self.borrowed[borrowed].plane,
        }
    }

    /// Returns the surface face with index `face`; `None` if no triangles of the patch lie in that
    /// face.
    #[inline]
    pub fn surface_face(&self, face: u32) -> Option<&'a SurfaceFace> {
        self.faces.binary_search_by_key(&face, |own| own.face).ok().map(|k| &self.faces[k])
    }

    /// Returns the arc of an edge; `None` if the edge has no arc.
    #[inline]
    pub fn arc_at(&self, edge: u32) -> Option<&'a SurfaceArc> {
        self.arcs.binary_search_by_key(&edge, |arc| arc.edge).ok().map(|k| &self.arcs[k])
    }

    /// Returns the feature in the plane with the number `index`: the face itself, or the edge of a
    /// borrowed normal.
    #[inline]
    pub fn feature(&self, index: u32) -> Feature {
        match (index as usize).checked_sub(self.polytope.face_count()) {
            None => Feature::Face(index),
            Some(borrowed) => Feature::Edge(self.borrowed[borrowed].edge),
        }
    }

    /// Returns the number of the borrowed plane of an edge; `None` if the edge has no borrowed
    /// plane.
    #[inline]
    pub fn borrowed_at(&self, edge: u32) -> Option<u32> {
        let found = self.borrowed.binary_search_by_key(&edge, |borrowed| borrowed.edge).ok()?;
        Some((self.polytope.face_count() + found) as u32)
    }

    /// Returns true if `direction` is admissible at `edge`, within [`ADMISSIBLE_ANGLE`].
    /// `direction` is a unit vector in the piece's frame, perpendicular to the edge.
    ///
    /// A plate has two edges at each of its sides, and a search may return either of them.
    pub fn edge_faces(&self, edge: u32, direction: DVec3) -> bool {
        self.edge_faces_within(edge, direction, ADMISSIBLE_ANGLE)
    }

    /// As [`Self::edge_faces`], within `angle` (rad).
    fn edge_faces_within(&self, edge: u32, direction: DVec3, angle: f64) -> bool {
        self.one_edge_faces(edge, direction, angle)
            || self.other_edge(edge).is_some_and(|other| self.one_edge_faces(other, direction, angle))
    }

    /// Returns the other edge at the same side of a plate; `None` if the piece is not a plate.
    fn other_edge(&self, edge: u32) -> Option<u32> {
        let Sides { left, right } = self.sides(edge);
        let rim = [left, right].into_iter().find(|&face| self.polytope.is_rim(face))?;
        self.polytope.face_edges(rim).iter().find(|&other| other != edge)
    }

    fn one_edge_faces(&self, edge: u32, direction: DVec3, angle: f64) -> bool {
        match self.arc_at(edge) {
            Some(arc) => self.arc_holds(arc, direction, angle),
            None => {
                let Sides { left, right } = self.sides(edge);
                [left, right].into_iter().any(|face| {
                    self.surface_face(face).is_some()
                        && self.polytope.plane(face).normal.distance_squared(direction) <= angle * angle
                })
            }
        }
    }

    fn sides(&self, edge: u32) -> Sides {
        let edge = self.polytope.edge(edge);
        Sides { left: edge.left, right: edge.right }
    }

    fn arc_holds(&self, arc: &SurfaceArc, direction: DVec3, angle: f64) -> bool {
        let [left, right] = self.ends(arc);
        let edge = self.polytope.edge(arc.edge);
        let along = self.polytope.vertex(edge.head) - self.polytope.vertex(edge.tail);
        let slack = angle * along.length();
        // The direction must lie after the left end and before the right end, on the shorter arc.
        along.dot(left.cross(direction)) >= -slack
            && along.dot(direction.cross(right)) >= -slack
            && direction.dot(left + right) > 0.0
    }

    /// Returns true if `point` on `feature` lies on the mesh and `outward` is an admissible normal
    /// at that point. The tolerances are [`ADMISSIBLE_ANGLE`] and the surface's noise. `outward`
    /// must be a unit vector and a support direction of the piece at `point`. Both vectors are in
    /// the piece's frame.
    pub fn holds(&self, piece: &Piece, feature: Feature, point: DVec3, outward: DVec3) -> bool {
        self.holds_within(piece, feature, point, outward, ADMISSIBLE_ANGLE)
    }

    /// Returns true if `outward` is within `angle` (rad) of an admissible normal at `point`;
    /// otherwise as [`Self::holds`].
    pub(crate) fn holds_within(
        &self,
        piece: &Piece,
        feature: Feature,
        point: DVec3,
        outward: DVec3,
        angle: f64,
    ) -> bool {
        match feature {
            Feature::Face(face) => {
                let normal = self.polytope.plane(face).normal;
                normal.dot(outward) > 0.0
                    && self
                        .surface_face(face)
                        .is_some_and(|own| own.whole || lies_on(piece.face_triangles(face), self.mesh, normal, point))
            }
            Feature::Edge(edge) => self.edge_faces_within(edge, outward, angle),
            Feature::Vertex(vertex) => self.vertex_admits_within(vertex, outward, angle),
        }
    }

    /// Returns true if `direction` is admissible at `vertex`. There are two conditions. The
    /// normal of a surface face at the vertex has a positive component along `direction`, and no
    /// neighbouring mesh vertex is higher along `direction`. `direction` must be a unit vector in
    /// the piece's frame and a support direction at the vertex.
    pub fn vertex_admits(&self, vertex: u32, direction: DVec3) -> bool {
        self.vertex_admits_within(vertex, direction, ADMISSIBLE_ANGLE)
    }

    /// As [`Self::vertex_admits`], within `angle` (rad).
    fn vertex_admits_within(&self, vertex: u32, direction: DVec3, angle: f64) -> bool {
        self.all.is_highest(self.corner(vertex), direction, angle) && self.vertex_faces(vertex, direction)
    }

    /// Returns the normal of a surface face at `feature` whose plane the mesh continues beyond the
    /// piece, in the piece's frame. The normal differs from `outward` by less than `slope` (tangent
    /// of the angle). `None` if there is no such face. `outward` must be a unit vector and a
    /// support direction of the piece at the feature.
    ///
    /// If a flat face of the mesh belongs to several pieces, and another face lies on it with a
    /// slight tilt, the closest points of most pieces lie at the ends of the pieces. Their
    /// direction is not a normal of the mesh there, but the faces are nearly flush.
    pub(crate) fn continued_normal(&self, feature: Feature, outward: DVec3, slope: f64) -> Option<DVec3> {
        let continues = |face: u32, vertices: &[u32]| {
            let normal = self.polytope.plane(face).normal;
            let is_flat = is_near(normal, outward, slope)
                && self.surface_face(face).is_some()
                && vertices.iter().all(|&v| self.all.continues(self.corner(v), normal, outward));
            is_flat.then_some(normal)
        };
        match feature {
            Feature::Edge(edge) if self.arc_at(edge).is_none() => {
                let Edge { tail, head, left, right, .. } = self.polytope.edge(edge);
                [left, right].into_iter().find_map(|face| continues(face, &[tail, head]))
            }
            Feature::Vertex(vertex) => {
                self.polytope.ring(vertex).iter().find_map(|spoke| continues(spoke.left, &[vertex]))
            }
            Feature::Face(_) | Feature::Edge(_) => None,
        }
    }

    /// Returns true if the normal of a surface face at the vertex has a positive component along
    /// `direction`.
    fn vertex_faces(&self, vertex: u32, direction: DVec3) -> bool {
        let faces_it =
            |face| self.surface_face(face).is_some() && self.polytope.plane(face).normal.dot(direction) > 0.0;
        self.polytope.ring(vertex).iter().any(|spoke| faces_it(spoke.left))
    }
}

struct Sides {
    left: u32,
    right: u32,
}

/// Returns true if `point` lies on one of the triangles. `point` must lie in their plane, which has
/// this unit normal. If there are more than [`ADMISSIBLE_TRIANGLES`] triangles, the result is true
/// without a test.
fn lies_on(triangles: &[u32], mesh: &Mesh, normal: DVec3, point: DVec3) -> bool {
    triangles.len() > ADMISSIBLE_TRIANGLES
        || triangles.iter().any(|&t| {
            let p = mesh.triangle_points(t);
            (0..3).all(|k| {
                let along = p[(k + 1) % 3] - p[k];
                normal.cross(along).dot(point - p[k]) >= -ADMISSIBLE_ANGLE * along.length_squared()
            })
        })
}

/// Returns true if triangles of the mesh cover at least half of the face.
fn is_original(polytope: &Polytope, face: u32) -> bool {
    polytope.face_provenance(face) == Provenance::Original
}
