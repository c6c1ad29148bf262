//! The shape of a convex piece: a closed convex polytope with the adjacency data for walks over its
//! surface \[K02 §3.2, §3.3\].
//!
//! Coplanar faces are merged into one polygon, so every arc of the Gauss map has a positive length.
//! Adjacency is stored in flat, contiguous rings and loops:
//!
//! * Each vertex has a ring of [`Spoke`]s, counter-clockwise as seen from outside.
//! * Each edge has its two end vertices and the faces on its two sides.
//! * Each face has a loop of vertices and a loop of edges, counter-clockwise as seen from outside.
//!
//! A body can have hundreds of thousands of small polytopes, so the memory of each one matters.
//! Lists have no spare capacity. All indices of a polytope are in one list. The indices have 16
//! bits each if all of them fit (`numbers`). The module `build` creates polytopes, and restores
//! them from stored parts.
//!
//! A flat piece is a *plate*. A plate has a front polygon, a back polygon, and a *rim* along each
//! side. A rim is a face of zero width. Its normal points outward in the plate's plane, and its
//! loop has two vertices.
//!
//! With rims, the surface of a plate has the topology of a sphere, like any other polytope: V − E +
//! F = n − 2n + (n + 2) = 2. Each arc of the plate's Gauss map is a quarter circle. Without rims,
//! the arcs between front and back would be half circles, whose course is ambiguous. The plane of a
//! rim is a supporting plane. Therefore walks need no special case for plates.

mod build;
mod climb;
pub(super) mod directory;
pub(super) mod feature;
mod numbers;
pub(super) mod validate;

use std::ops::Range;

use glam::DVec3;

use crate::algebra::Plane;
use directory::{Directory, Known};
use numbers::{Numbers, SPOKE};

pub use build::PolytopeRestorer;
pub use numbers::{Loop, LoopIter, Ring, RingIter};

/// Provenance of a face of a piece \[K02 §3.4\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Provenance {
    /// The face lies on the surface of the source mesh.
    Original,
    /// The face was added by the convex hull and is not a real surface.
    Virtual,
}

/// One entry of a vertex's ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoke {
    /// Index of the vertex at the other end of the edge.
    pub neighbour: u32,
    /// Index of the edge to that vertex.
    pub edge: u32,
    /// Index of the face to the left of the direction vertex → neighbour, as seen from outside. The
    /// face to the right is the left face of the previous spoke of the ring.
    pub left: u32,
}

/// An edge and its two faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Index of the first vertex.
    pub tail: u32,
    /// Index of the second vertex.
    pub head: u32,
    /// Index of the face to the left of tail → head, as seen from outside.
    pub left: u32,
    /// Index of the face to the right of tail → head, as seen from outside.
    pub right: u32,
}

/// The reason why faces do not form a polytope.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolytopeError {
    /// An edge does not have exactly one face on either side.
    #[error("the edge between vertices {0} and {1} does not lie between exactly two faces")]
    OpenEdge(u32, u32),
    /// A face has fewer than three corners, or a loop refers to a vertex that does not exist.
    #[error("face {0} is not a polygon over the given vertices")]
    BadFace(u32),
    /// The faces around a vertex do not form one closed ring.
    #[error("the faces around vertex {0} do not form one ring")]
    OpenRing(u32),
}

/// A closed convex polytope: a solid, or a plate without volume. Coordinates are in the frame and
/// the unit of its body.
#[derive(Clone, Debug)]
pub struct Polytope {
    vertices: Box<[DVec3]>,
    planes: Box<[Plane]>,
    lists: Lists,
    centroid: DVec3,
    radius: f64,
    bulge: f64,
    /// See [`Self::is_rough`].
    rough: bool,
    directory: Directory,
    flat: bool,
}

/// All indices of a polytope in one list. The list has these parts, in this order:
///
/// 1. The start of each face's loop of vertices (one entry more than faces).
/// 2. The start of each vertex's ring of spokes (one entry more than vertices).
/// 3. The vertices of the loops.
/// 4. The edges of the loops.
/// 5. The spokes.
/// 6. The edges.
/// 7. One bit per face, which is set if the face is original.
#[derive(Clone, Debug)]
struct Lists {
    all: Numbers,
    /// Offset of the starts of the rings.
    ring_starts: u32,
    /// Offset of the edges.
    edges: u32,
    /// Offset of the bits of the faces.
    originals: u32,
    /// Number of corners of all loops. This number is also the offset from a loop's vertices to its
    /// edges.
    corners: u32,
}

impl Lists {
    /// Returns the range of the spokes of vertex `v`.
    #[inline]
    fn ring(&self, v: u32) -> Range<usize> {
        let [from, to] = self.all.some((self.ring_starts + v) as usize);
        from as usize..to as usize
    }

    /// Returns the range of the vertices of face `f`.
    #[inline]
    fn face(&self, f: u32) -> Range<usize> {
        let [from, to] = self.all.some(f as usize);
        from as usize..to as usize
    }

    /// Returns the neighbours of vertex `v`. `all` are the entries of `self.all`.
    #[inline]
    fn neighbours<N: Copy + Into<u32>>(&self, all: &[N], v: u32) -> impl Iterator<Item = u32> {
        let k = (self.ring_starts + v) as usize;
        let (from, to): (u32, u32) = (all[k].into(), all[k + 1].into());
        all[from as usize..to as usize].as_chunks::<SPOKE>().0.iter().map(|spoke| spoke[0].into())
    }

    #[inline]
    fn edge_count(&self) -> u32 {
        (self.originals - self.edges) / 4
    }

    #[inline]
    fn edge(&self, e: u32) -> Edge {
        debug_assert!(e < self.edge_count());
        let [tail, head, left, right] = self.all.some((self.edges + 4 * e) as usize);
        Edge { tail, head, left, right }
    }

    #[inline]
    fn is_original(&self, f: u32) -> bool {
        self.all.at((self.originals + f / FACES_A_WORD) as usize) >> (f % FACES_A_WORD) & 1 == 1
    }

    fn set_original(&mut self, f: u32, original: bool) {
        let word = (self.originals + f / FACES_A_WORD) as usize;
        let bit = 1 << (f % FACES_A_WORD);
        let bits = self.all.at(word);
        self.all.set(word, if original { bits | bit } else { bits & !bit });
    }
}

/// Number of face bits per entry of the list. An entry has 16 or 32 bits.
const FACES_A_WORD: u32 = 16;

impl Polytope {
    /// Returns this polytope with new provenances. Calls `of` with the polytope and a face to get
    /// the provenance of the face. Rims stay virtual, and `of` is not called for them.
    pub fn with_provenance(mut self, of: impl Fn(&Self, u32) -> Provenance) -> Self {
        for f in 0..self.planes.len() as u32 {
            let provenance = if self.is_rim(f) { Provenance::Virtual } else { of(&self, f) };
            self.lists.set_original(f, provenance == Provenance::Original);
        }
        self
    }

    /// Returns the vertex positions, in the body's frame.
    #[inline]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Returns the position of vertex `v`, in the body's frame.
    #[inline]
    pub fn vertex(&self, v: u32) -> DVec3 {
        self.vertices[v as usize]
    }

    /// Returns all edges.
    #[inline]
    pub fn edges(&self) -> impl ExactSizeIterator<Item = Edge> {
        (0..self.lists.edge_count()).map(|e| self.lists.edge(e))
    }

    /// Returns the number of edges.
    #[inline]
    pub fn edge_count(&self) -> usize {
        self.lists.edge_count() as usize
    }

    /// Returns edge `e`.
    #[inline]
    pub fn edge(&self, e: u32) -> Edge {
        self.lists.edge(e)
    }

    /// Returns the outward planes of the faces.
    #[inline]
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// Returns the outward plane of face `f`.
    #[inline]
    pub fn plane(&self, f: u32) -> Plane {
        self.planes[f as usize]
    }

    /// Returns the number of faces, including rims.
    #[inline]
    pub fn face_count(&self) -> usize {
        self.planes.len()
    }

    /// Returns the spokes of vertex `v`, counter-clockwise as seen from outside.
    #[inline]
    pub fn ring(&self, v: u32) -> Ring<'_> {
        Ring(self.lists.all.part(self.lists.ring(v)))
    }

    /// Returns the bulge (m): the largest distance of a vertex from the plane of an adjacent face,
    /// or of a neighbouring vertex above that plane. The bulge bounds how far a face's plane
    /// differs from a supporting plane. The bulge consists only of rounding errors, unless the
    /// merged faces were not exactly coplanar.
    #[inline]
    pub fn bulge(&self) -> f64 {
        self.bulge
    }

    /// Returns true if a climb along edges can end at a vertex that is not the highest one. There
    /// are two possible reasons. The merged faces were not exactly coplanar, or an edge is so
    /// short that its direction consists of rounding errors.
    #[inline]
    pub fn is_rough(&self) -> bool {
        self.rough
    }

    /// Returns the vertices of face `f`, counter-clockwise as seen from outside.
    #[inline]
    pub fn face_vertices(&self, f: u32) -> Loop<'_> {
        Loop(self.lists.all.part(self.lists.face(f)))
    }

    /// Returns the edges of face `f`. Edge k runs from vertex k of the loop to the next vertex.
    #[inline]
    pub fn face_edges(&self, f: u32) -> Loop<'_> {
        let Range { start, end } = self.lists.face(f);
        let ahead = self.lists.corners as usize;
        Loop(self.lists.all.part(start + ahead..end + ahead))
    }

    /// Returns true if face `f` is a rim, which is a face of zero width along a side of a plate.
    #[inline]
    pub fn is_rim(&self, f: u32) -> bool {
        self.lists.face(f).len() == 2
    }

    /// Returns true if the polytope is a plate, without volume.
    #[inline]
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// Returns the provenance of face `f`.
    #[inline]
    pub fn face_provenance(&self, f: u32) -> Provenance {
        if self.lists.is_original(f) { Provenance::Original } else { Provenance::Virtual }
    }

    /// Returns the provenance of edge `e`. An edge is original if at least one of its faces is
    /// original.
    #[inline]
    pub fn edge_provenance(&self, e: u32) -> Provenance {
        let Edge { left, right, .. } = self.edge(e);
        let original = self.lists.is_original(left) || self.lists.is_original(right);
        if original { Provenance::Original } else { Provenance::Virtual }
    }

    /// Returns the mean of the vertices, in the body's frame. The mean is in the interior of a
    /// solid, or on a plate.
    #[inline]
    pub fn centroid(&self) -> DVec3 {
        self.centroid
    }

    /// Returns the radius of the smallest sphere about [`Self::centroid`] that contains all
    /// vertices.
    #[inline]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the support vertex: the vertex farthest along `direction`, which need not have unit
    /// length.
    #[inline]
    pub fn support(&self, direction: DVec3) -> u32 {
        match self.directory.look(direction) {
            Known::Farthest(v) => v,
            Known::Near(v) => self.climb(v, direction).0,
        }
    }

    /// Returns the support vertex along `direction`. Tests all vertices if the polytope is small,
    /// else climbs from vertex `hint`.
    #[inline]
    pub fn support_from(&self, hint: u32, direction: DVec3) -> u32 {
        self.support_point_from(hint, direction).0
    }

    /// Returns the position of the vertex farthest along `direction`.
    #[inline]
    pub(crate) fn support_point(&self, direction: DVec3) -> DVec3 {
        let climb = || self.vertex(self.support(direction));
        self.directory.scan(direction).map_or_else(climb, |(_, point)| point)
    }

    /// As [`Self::support_from`], with the position of the vertex. If all vertices are tested, the
    /// position is in memory that was just read, and [`Self::vertex`] reads other memory.
    #[inline]
    pub(crate) fn support_point_from(&self, hint: u32, direction: DVec3) -> (u32, DVec3) {
        self.directory.scan(direction).unwrap_or_else(|| {
            let v = self.climb(hint, direction).0;
            (v, self.vertex(v))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Polytope {
        let vertices =
            (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from((k >> 1) & 1), f64::from((k >> 2) & 1))).collect();
        let loops = vec![
            vec![0, 2, 3, 1],
            vec![4, 5, 7, 6],
            vec![0, 1, 5, 4],
            vec![2, 6, 7, 3],
            vec![0, 4, 6, 2],
            vec![1, 3, 7, 5],
        ];
        let plane = |normal, offset| Plane { normal, offset };
        let planes = vec![
            plane(-DVec3::Z, 0.0),
            plane(DVec3::Z, 1.0),
            plane(-DVec3::Y, 0.0),
            plane(DVec3::Y, 1.0),
            plane(-DVec3::X, 0.0),
            plane(DVec3::X, 1.0),
        ];
        Polytope::from_faces(vertices, &loops, planes, vec![Provenance::Original; 6]).unwrap()
    }

    fn assert_rings(polytope: &Polytope) {
        let euler = polytope.vertices().len() as i64 - polytope.edges().len() as i64 + polytope.face_count() as i64;
        assert_eq!(euler, 2);
        for v in 0..polytope.vertices().len() as u32 {
            let ring = polytope.ring(v);
            for (k, spoke) in ring.iter().enumerate() {
                let right = ring.at((k + ring.len() - 1) % ring.len()).left;
                let edge = polytope.edge(spoke.edge);
                let forward = edge.tail == v && edge.left == spoke.left && edge.right == right;
                let backward = edge.head == v && edge.right == spoke.left && edge.left == right;
                assert!(forward || backward, "vertex {v}, spoke {k}");
            }
        }
    }

    #[test]
    fn rings_of_box_and_plate_are_complete() {
        assert_rings(&unit_box());
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let plate = Polytope::from_polygon(corners, DVec3::Z, Provenance::Original).unwrap();
        assert_rings(&plate);
        assert_eq!(plate.ring(0).len(), 4);
        assert_eq!(plate.plane(2).normal, -DVec3::Y);
        assert_eq!(plate.edge_provenance(0), Provenance::Original);
        assert_eq!(plate.edge_provenance(4), Provenance::Virtual);
    }

    #[test]
    fn open_faces_give_an_error() {
        let loops = vec![vec![0, 1, 2], vec![0, 2, 1], vec![0, 1, 3]];
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let plane = Plane { normal: DVec3::Z, offset: 0.0 };
        let answer = Polytope::from_faces(vertices, &loops, vec![plane; 3], vec![Provenance::Original; 3]);
        assert!(matches!(answer, Err(PolytopeError::OpenEdge(..))));
    }
}
