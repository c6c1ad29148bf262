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
    pub(super) vertex: u32,
    pub(super) around: FlatAround,
    /// Unit normal of the flat face, in the piece's frame.
    pub(super) normal: DVec3,
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
}
