//! How the mesh continues around the surface faces of a piece.
//!
//! A flat face of the mesh may belong to several pieces. At each point of a piece, this module
//! returns how much of the point's neighbourhood belongs to the flat face ([`FlatAround`]). A
//! vertex is *inner* if it lies in a flat face but is not a convex corner of it: it lies inside, on
//! the line between two corners, or at a notch. The *rim* of a surface face is the part of its
//! sides along which the mesh bends or ends; along the rest, the flat face continues.
//!
//! If two flat faces touch, a point around which one of them is flat on all sides, and the other at
//! least on one side, is never the lowest point, however the bodies tilt.

use glam::DVec3;

use super::{Admissible, Range, SurfaceFace, Valley};
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, NORMALS_PER_PART};
use crate::algebra::{Workers, map_in_order};
use crate::body::{HalfEdges, Mesh, Polytope};

/// How much of the neighbourhood of a point belongs to a flat face of the mesh. The order is from
/// most to least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FlatAround {
    /// All of it.
    All,
    /// At least half of it, to one side of the point.
    Half,
    /// Less: the point is at a convex corner, or not in a flat face.
    Corner,
}

/// The mesh around the surface faces of one piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Border<'a> {
    all: &'a Admissible,
    piece: u32,
}

impl<'a> Border<'a> {
    /// Returns the edges where the mesh bends inward.
    pub(crate) fn valleys(&self) -> &'a [Valley] {
        self.all.valleys_of(self.piece)
    }

    /// Returns true if the piece has inner vertices. Most pieces of curved surfaces have none, and
    /// need no further work.
    #[inline]
    pub(crate) fn has_inner(&self) -> bool {
        let [from, to] = self.ends();
        from.inner < to.inner
    }

    /// Returns the ends of the entries of the piece before, and of this piece.
    #[inline]
    fn ends(&self) -> [Range; 2] {
        [self.piece, self.piece + 1].map(|k| self.all.pieces[k as usize])
    }

    /// Returns how much of the neighbourhood of `vertex` belongs to a flat face whose normal
    /// differs from `upward` by less than `slope` (tangent of the angle). `upward` is a unit vector
    /// in the piece's frame.
    pub(crate) fn around(&self, vertex: u32, upward: DVec3, slope: f64) -> FlatAround {
        let [from, to] = self.ends();
        let inner = &self.all.inner[from.inner as usize..to.inner as usize];
        let begin = inner.partition_point(|inner| inner.vertex < vertex);
        let mut of_vertex = inner[begin..].iter().take_while(|inner| inner.vertex == vertex);
        let found = of_vertex.find(|inner| is_near(inner.normal, upward, slope));
        found.map_or(FlatAround::Corner, |inner| inner.around)
    }

    /// Returns the surface face with index `face`; `None` if it is not a surface face.
    pub(crate) fn face(&self, face: u32) -> Option<&'a SurfaceFace> {
        let [from, to] = self.ends();
        let faces = &self.all.faces[from.faces as usize..to.faces as usize];
        faces.binary_search_by_key(&face, |own| own.face).ok().map(|k| &faces[k])
    }

    /// Returns the part of side `k` of a surface face along which the mesh is not flat, from 0 at
    /// its beginning to 1 at its end. The part is empty (its end is before its beginning) if the
    /// mesh is flat along the whole side.
    pub(crate) fn rim_of_side(&self, rim: FaceRim, face: u32, k: usize) -> [f64; 2] {
        if rim.flat >> k & 1 != 0 {
            return [1.0, 0.0];
        }
        if rim.partial >> k & 1 == 0 {
            return [0.0, 1.0];
        }
        let [from, to] = self.ends();
        let sides = &self.all.partial[from.partial as usize..to.partial as usize];
        let found = sides.binary_search_by_key(&(face, k as u32), |side| (side.face, side.side));
        found.map_or([0.0, 1.0], |found| sides[found].rim)
    }

    /// Returns the rim of a face. If the piece has no inner vertices, no face continues.
    #[inline]
    pub(crate) fn rim(&self, face: u32) -> FaceRim {
        if !self.has_inner() {
            return FaceRim::NONE;
        }
        self.face(face).map_or(FaceRim::NONE, |own| own.rim)
    }
}

/// How the flat face of the mesh continues beyond a surface face; one bit for each corner or side.
/// Corners after the first 64 have no bits, and sides of faces with more corners have none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FaceRim {
    /// The corners with [`FlatAround::All`].
    pub(super) all: u64,
    /// The corners with [`FlatAround::Half`].
    pub(super) half: u64,
    /// The sides along which the mesh is flat.
    pub(super) flat: u64,
    /// The sides along which the mesh is flat in some parts.
    pub(super) partial: u64,
}

impl FaceRim {
    /// Largest number of corners or sides that have bits.
    pub(crate) const MOST: usize = u64::BITS as usize;

    /// The rim of a face beyond which the mesh is flat nowhere.
    pub(crate) const NONE: Self = Self { all: 0, half: 0, flat: 0, partial: 0 };

    /// Returns true if a flat face of the mesh continues beyond the face.
    #[inline]
    pub(crate) fn continues(self) -> bool {
        self.all | self.half | self.flat | self.partial != 0
    }

    /// Returns how much of the neighbourhood of corner `k` belongs to a flat face.
    #[inline]
    pub(crate) fn around(self, k: usize) -> FlatAround {
        let has = |bits: u64| k < Self::MOST && bits >> k & 1 != 0;
        match (has(self.all), has(self.half)) {
            (true, _) => FlatAround::All,
            (false, true) => FlatAround::Half,
            (false, false) => FlatAround::Corner,
        }
    }
}

/// A side of a surface face along which the mesh is flat in some parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartialSide {
    /// Index of the face in the polytope.
    pub(super) face: u32,
    /// Index of the side in the face.
    pub(super) side: u32,
    /// The part outside of which the mesh is flat, from 0 at the beginning of the side to 1 at its
    /// end.
    pub(super) rim: [f64; 2],
}

/// A vertex of a piece that is inner in a flat face of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct InnerVertex {
    /// Index in the polytope.
    vertex: u32,
    around: FlatAround,
    /// Unit normal of the flat face, in the piece's frame.
    normal: DVec3,
}

/// Returns true if two unit vectors differ by less than `slope` (tangent of the angle).
pub(crate) fn is_near(one: DVec3, other: DVec3, slope: f64) -> bool {
    let along = one.dot(other);
    along > 0.0 && (other - one * along).length() < slope * along
}

impl Admissible {
    /// Returns the border of piece `k`.
    #[inline]
    pub(crate) fn border_of(&self, k: u32) -> Border<'_> {
        Border { all: self, piece: k }
    }

    /// Returns the admissible normals of one piece without surface faces.
    #[cfg(test)]
    pub(crate) fn none() -> Self {
        Self { pieces: vec![Range::default(); 2], ..Self::default() }
    }

    /// Finds the inner vertices of all pieces, and the rims of all surface faces. `normals` are the
    /// normals of the triangles.
    pub(super) fn find_inner(
        &mut self,
        mesh: &Mesh,
        half_edges: &HalfEdges,
        normals: &[DVec3],
        polytopes: &[Polytope],
        workers: &dyn Workers,
    ) {
        let triangles = mesh.triangles();
        let mut open = vec![false; mesh.vertices().len()];
        for (t, k) in (0..triangles.len()).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            if half_edges.neighbour(t as u32, k).is_none() {
                open[triangles[t][k] as usize] = true;
                open[triangles[t][(k + 1) % 3] as usize] = true;
            }
        }
        let of_triangle = |t: usize| triangles[t].map(|v| self.flat_around(v, normals[t], open[v as usize]));
        let found = map_in_order(workers, triangles.len(), NORMALS_PER_PART, of_triangle, &mut |_| ());
        let mut known: Vec<(u32, InnerVertex)> = Vec::new();
        for (t, around) in found.into_iter().enumerate() {
            let normal = normals[t];
            let inner = triangles[t].into_iter().zip(around).filter(|corner| corner.1 != FlatAround::Corner);
            known.extend(inner.map(|(v, around)| (v, InnerVertex { vertex: 0, around, normal })));
        }
        known.sort_by_key(|known| known.0);
        let is_parallel = |one: DVec3, other: DVec3| one.distance_squared(other) < ADMISSIBLE_ANGLE * ADMISSIBLE_ANGLE;
        known.dedup_by(|one, other| one.0 == other.0 && is_parallel(one.1.normal, other.1.normal));
        for k in 1..self.pieces.len() {
            let [from, to] = [k - 1, k].map(|end| self.pieces[end].corners as usize);
            for (vertex, &v) in (0_u32..).zip(&self.corners[from..to]) {
                let begin = known.partition_point(|known| known.0 < v);
                let of_corner = known[begin..].iter().take_while(|known| known.0 == v);
                self.inner.extend(of_corner.map(|known| InnerVertex { vertex, ..known.1 }));
            }
            self.pieces[k].inner = self.inner.len() as u32;
        }
        self.inner.shrink_to_fit();
        for (k, polytope) in (0..).zip(polytopes) {
            let [from, to] = [k, k + 1].map(|end: u32| self.pieces[end as usize].faces as usize);
            for i in from..to {
                let (face, border) = (self.faces[i].face, self.border_of(k));
                let corners = polytope.face_vertices(face);
                let normal = polytope.plane(face).normal;
                let around = |i: usize| border.around(corners.at(i), normal, ADMISSIBLE_ANGLE);
                let bits = |kind| {
                    let of_kind = (0..corners.len().min(FaceRim::MOST)).filter(|&i| around(i) == kind);
                    of_kind.fold(0, |bits, i| bits | 1 << i)
                };
                let (all, half) = (bits(FlatAround::All), bits(FlatAround::Half));
                let rim = &mut self.faces[i].rim;
                (rim.all, rim.half) = (all, half);
            }
        }
    }

    /// Returns how much of the neighbourhood of mesh vertex `v` belongs to a flat face with this
    /// normal. `open` is true for a vertex at a boundary.
    fn flat_around(&self, v: u32, normal: DVec3, open: bool) -> FlatAround {
        let edges = self.edges(v);
        let flat = edges.iter().filter(|&&edge| !self.rises(edge, -normal, 0.0));
        let count = flat.clone().count();
        if count < 2 || edges.iter().any(|&edge| self.rises(edge, normal, ADMISSIBLE_ANGLE)) {
            return FlatAround::Corner;
        }
        if count == edges.len() && !open {
            return FlatAround::All;
        }
        // At a convex corner, all flat edges are within half a turn from one of them.
        let is_left = |edge: DVec3, other: DVec3| {
            let across = normal.dot(edge.cross(other));
            let slack = ADMISSIBLE_ANGLE * edge.length() * other.length();
            across > slack || across >= -slack && edge.dot(other) > 0.0
        };
        match flat.clone().any(|&edge| flat.clone().all(|&other| is_left(edge, other))) {
            true => FlatAround::Corner,
            false => FlatAround::Half,
        }
    }
}
