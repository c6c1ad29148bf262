//! A convex piece: a closed convex polytope with the adjacency that walks need \[K02 §3.2, §3.3\].
//!
//! Faces are merged planar polygons, so that every arc of the Gauss map has a length. Adjacency is
//! stored flat, in rings and loops that lie contiguously:
//!
//! * vertex → ring of [`Spoke`]s, counter-clockwise seen from outside;
//! * edge → its end vertices and the faces on its two sides;
//! * face → loop of vertices and loop of edges, counter-clockwise seen from outside.
//!
//! A body has hundreds of thousands of small polytopes, so the memory overhead of each one matters.
//! Lists have no spare capacity, and all indices lie in one list, with 16 bits each where they fit
//! (`numbers`). `build` makes polytopes, and restores them from stored parts.
//!
//! A flat piece is a *plate*: its front and back polygon, and along each side a *rim*: a face of no
//! width whose normal points outward in the plate's plane and whose loop has two vertices. With
//! rims, a plate's surface is a sphere like any other polytope's (V − E + F = n − 2n + (n + 2) =
//! 2), its Gauss arcs are a quarter circle long instead of an ambiguous half, and no walk needs a
//! special case: a rim's plane is a true supporting plane.

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
    /// Lies on the surface of the source mesh.
    Original,
    /// Made by the hull; not a real surface.
    Virtual,
}

/// One entry of a vertex's ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoke {
    /// The vertex at the other end.
    pub neighbour: u32,
    /// The edge to it.
    pub edge: u32,
    /// The face to the left of the direction vertex → neighbour, seen from outside; the face to the
    /// right is the left face of the previous spoke of the ring.
    pub left: u32,
}

/// An edge and its two faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// First vertex.
    pub tail: u32,
    /// Second vertex.
    pub head: u32,
    /// The face to the left of tail → head, seen from outside.
    pub left: u32,
    /// The face to the right.
    pub right: u32,
}

/// Why faces do not form a polytope.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolytopeError {
    /// An edge does not have exactly one face on either side.
    #[error("the edge between vertices {0} and {1} does not lie between exactly two faces")]
    OpenEdge(u32, u32),
    /// A face has fewer than three corners, or a loop names a vertex that does not exist.
    #[error("face {0} is not a polygon over the given vertices")]
    BadFace(u32),
    /// The faces around a vertex do not form one closed ring.
    #[error("the faces around vertex {0} do not form one ring")]
    OpenRing(u32),
}

/// A closed convex polytope; see the module's description for its layout.
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

/// All indices in one list: where the loops' vertices begin in it (one more than faces), where the
/// rings' spokes do (one more than vertices), loop vertices, loop edges, spokes, edges, and a bit
/// for each face that is original.
#[derive(Clone, Debug)]
struct Lists {
    all: Numbers,
    /// Offsets of the rings' beginnings, the edges and the bits.
    ring_starts: u32,
    edges: u32,
    originals: u32,
    /// Number of corners of all loops: the offset from a loop's vertices to its edges.
    corners: u32,
}

impl Lists {
    /// Range of the spokes of vertex `v`.
    #[inline]
    fn ring(&self, v: u32) -> Range<usize> {
        let [from, to] = self.all.some((self.ring_starts + v) as usize);
        from as usize..to as usize
    }

    /// Range of the vertices of face `f`.
    #[inline]
    fn face(&self, f: u32) -> Range<usize> {
        let [from, to] = self.all.some(f as usize);
        from as usize..to as usize
    }

    /// The neighbours of vertex `v`; `all` is the list itself.
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

/// Bits of the shorter kind of index.
const FACES_A_WORD: u32 = 16;

impl Polytope {
    /// The same polytope with each face tagged by `of`, which is given the polytope and the face.
    /// Rims, which have no width, stay virtual and are not asked about.
    pub fn with_provenance(mut self, of: impl Fn(&Self, u32) -> Provenance) -> Self {
        for f in 0..self.planes.len() as u32 {
            let provenance = if self.is_rim(f) { Provenance::Virtual } else { of(&self, f) };
            self.lists.set_original(f, provenance == Provenance::Original);
        }
        self
    }

    /// Vertex positions in the body's frame.
    #[inline]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Position of vertex `v`.
    #[inline]
    pub fn vertex(&self, v: u32) -> DVec3 {
        self.vertices[v as usize]
    }

    /// All edges.
    #[inline]
    pub fn edges(&self) -> impl ExactSizeIterator<Item = Edge> {
        (0..self.lists.edge_count()).map(|e| self.lists.edge(e))
    }

    /// Number of edges.
    #[inline]
    pub fn edge_count(&self) -> usize {
        self.lists.edge_count() as usize
    }

    /// Edge `e`.
    #[inline]
    pub fn edge(&self, e: u32) -> Edge {
        self.lists.edge(e)
    }

    /// Outward planes of the faces.
    #[inline]
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// Outward plane of face `f`.
    #[inline]
    pub fn plane(&self, f: u32) -> Plane {
        self.planes[f as usize]
    }

    /// Number of faces, rims included.
    #[inline]
    pub fn face_count(&self) -> usize {
        self.planes.len()
    }

    /// The spokes of vertex `v`, counter-clockwise seen from outside.
    #[inline]
    pub fn ring(&self, v: u32) -> Ring<'_> {
        Ring(self.lists.all.part(self.lists.ring(v)))
    }

    /// Largest distance of a vertex from the plane of a face around it, or of a neighbouring vertex
    /// above that plane, metres. It bounds the deviation of a face's plane from a supporting plane.
    /// It is rounding unless faces were merged that are not quite flat.
    #[inline]
    pub fn bulge(&self) -> f64 {
        self.bulge
    }

    /// True where a local maximum of the vertices joined by edges need not be the global one: faces
    /// were merged that are not quite flat, or an edge is so short that rounding decides which way
    /// it leads.
    #[inline]
    pub fn is_rough(&self) -> bool {
        self.rough
    }

    /// The vertices of face `f`, counter-clockwise seen from outside.
    #[inline]
    pub fn face_vertices(&self, f: u32) -> Loop<'_> {
        Loop(self.lists.all.part(self.lists.face(f)))
    }

    /// The edges of face `f`; edge k runs from vertex k of the loop to the next.
    #[inline]
    pub fn face_edges(&self, f: u32) -> Loop<'_> {
        let Range { start, end } = self.lists.face(f);
        let ahead = self.lists.corners as usize;
        Loop(self.lists.all.part(start + ahead..end + ahead))
    }

    /// True for a face of no width along the side of a plate.
    #[inline]
    pub fn is_rim(&self, f: u32) -> bool {
        self.lists.face(f).len() == 2
    }

    /// True for a plate (no volume).
    #[inline]
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// Provenance of face `f`.
    #[inline]
    pub fn face_provenance(&self, f: u32) -> Provenance {
        if self.lists.is_original(f) { Provenance::Original } else { Provenance::Virtual }
    }

    /// Provenance of edge `e`: original if at least one of its faces is.
    #[inline]
    pub fn edge_provenance(&self, e: u32) -> Provenance {
        let Edge { left, right, .. } = self.edge(e);
        let original = self.lists.is_original(left) || self.lists.is_original(right);
        if original { Provenance::Original } else { Provenance::Virtual }
    }

    /// Mean of the vertices: a point of the interior (of the plate, for a flat one).
    #[inline]
    pub fn centroid(&self) -> DVec3 {
        self.centroid
    }

    /// Radius of the sphere about [`Self::centroid`] that holds every vertex.
    #[inline]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The vertex farthest along `direction` (need not be unit).
    #[inline]
    pub fn support(&self, direction: DVec3) -> u32 {
        match self.directory.look(direction) {
            Known::Farthest(v) => v,
            Known::Near(v) => self.climb(v, direction).0,
        }
    }

    /// Returns the support vertex. It climbs from `hint` unless testing all vertices is quicker.
    #[inline]
    pub fn support_from(&self, hint: u32, direction: DVec3) -> u32 {
        self.directory.scan(direction).unwrap_or_else(|| self.climb(hint, direction).0)
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
    fn a_box_and_a_plate_have_whole_rings() {
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
    fn an_open_box_is_refused() {
        let loops = vec![vec![0, 1, 2], vec![0, 2, 1], vec![0, 1, 3]];
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let plane = Plane { normal: DVec3::Z, offset: 0.0 };
        let answer = Polytope::from_faces(vertices, &loops, vec![plane; 3], vec![Provenance::Original; 3]);
        assert!(matches!(answer, Err(PolytopeError::OpenEdge(..))));
    }
}
