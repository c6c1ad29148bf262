//! A convex piece: a closed convex polytope with the adjacency that walks need \[K02 §3.2, §3.3\].
//!
//! Faces are merged planar polygons, so that every arc of the Gauss map has a length. Adjacency is stored flat, in
//! rings and loops that lie contiguously:
//!
//! * vertex → ring of [`Spoke`]s, counter-clockwise seen from outside;
//! * edge → its end vertices and the faces on its two sides;
//! * face → loop of vertices and loop of edges, counter-clockwise seen from outside.
//!
//! A body has hundreds of thousands of small polytopes, so that what each costs beside its numbers counts: lists are of
//! exactly their length, and all that are of indices lie in one.
//!
//! A flat piece is a *plate*: its front and back polygon, and along each side a *rim*: a face of no width whose
//! normal points outward in the plate's plane and whose loop has two vertices. With rims, a plate's surface is a
//! sphere like any other polytope's (V − E + F = n − 2n + (n + 2) = 2), its Gauss arcs are a quarter circle long
//! instead of an ambiguous half, and no walk needs a special case: a rim's plane is a true supporting plane.

use std::ops::Range;

use glam::DVec3;

use super::directory::{Directory, Known};
use crate::algebra::Plane;

/// Where a face of a piece comes from \[K02 §3.4\].
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
    /// The face to the left of the direction vertex → neighbour, seen from outside; that to the right is the left one of the
    /// ring's spoke before.
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

/// Why faces do not make a polytope.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolytopeError {
    /// An edge does not have exactly one face on either side.
    #[error("the edge between vertices {0} and {1} does not lie between exactly two faces")]
    OpenEdge(u32, u32),
    /// A face has fewer than three corners, or a loop names a vertex that does not exist.
    #[error("face {0} is not a polygon over the given vertices")]
    BadFace(u32),
    /// The faces around a vertex do not close to one ring.
    #[error("the faces around vertex {0} do not form one ring")]
    OpenRing(u32),
}

/// A closed convex polytope; see the module's description for its layout.
#[derive(Clone, Debug)]
pub struct Polytope {
    vertices: Box<[DVec3]>,
    spokes: Box<[Spoke]>,
    edges: Box<[Edge]>,
    planes: Box<[Plane]>,
    indices: Indices,
    centroid: DVec3,
    radius: f64,
    bulge: f64,
    directory: Directory,
    flat: bool,
}

/// Where rings and loops begin, the loops' vertices and edges, and which faces are original, in one list.
#[derive(Clone, Debug)]
struct Indices {
    /// Where loops begin among loop vertices and edges (one more than faces), where rings begin among spokes (one more than
    /// vertices), loop vertices, loop edges, and a bit for each face.
    all: Box<[u32]>,
    ring_starts: u32,
    loop_vertices: u32,
    loop_edges: u32,
    originals: u32,
}

impl Indices {
    fn new(
        loop_starts: &[u32],
        ring_starts: &[u32],
        loop_vertices: &[u32],
        loop_edges: &[u32],
        provenance: &[Provenance],
    ) -> Self {
        let words = provenance.len().div_ceil(FACES_A_WORD);
        let count = loop_starts.len() + ring_starts.len() + loop_vertices.len() + loop_edges.len() + words;
        let mut all = Vec::with_capacity(count);
        let mut begin = |list: &[u32]| {
            let first = all.len() as u32;
            all.extend_from_slice(list);
            first
        };
        begin(loop_starts);
        let (ring_starts, loop_vertices, loop_edges) = (begin(ring_starts), begin(loop_vertices), begin(loop_edges));
        let originals = all.len() as u32;
        all.extend(provenance.chunks(FACES_A_WORD).map(|faces| {
            faces.iter().rev().fold(0, |word, &face| word << 1 | u32::from(face == Provenance::Original))
        }));
        Self { all: all.into_boxed_slice(), ring_starts, loop_vertices, loop_edges, originals }
    }

    /// Where the ring of vertex `v` is among the spokes.
    #[inline]
    fn ring(&self, v: u32) -> Range<usize> {
        let k = (self.ring_starts + v) as usize;
        self.all[k] as usize..self.all[k + 1] as usize
    }

    /// Where the loop of face `f` is among loop vertices and edges.
    #[inline]
    fn face(&self, f: u32) -> Range<usize> {
        self.all[f as usize] as usize..self.all[f as usize + 1] as usize
    }

    /// Of a list that begins at `first`, what is at `range`.
    #[inline]
    fn part(&self, first: u32, range: Range<usize>) -> &[u32] {
        &self.all[first as usize + range.start..first as usize + range.end]
    }

    #[inline]
    fn is_original(&self, f: u32) -> bool {
        self.all[self.originals as usize + f as usize / FACES_A_WORD] >> (f as usize % FACES_A_WORD) & 1 == 1
    }

    fn set_original(&mut self, f: u32, original: bool) {
        let word = &mut self.all[self.originals as usize + f as usize / FACES_A_WORD];
        let bit = 1 << (f as usize % FACES_A_WORD);
        *word = if original { *word | bit } else { *word & !bit };
    }
}

/// Bits of an index.
const FACES_A_WORD: usize = 32;

impl Polytope {
    /// A solid polytope from its merged planar faces.
    ///
    /// `loops[f]` lists face `f`'s vertices counter-clockwise seen from outside; `planes` and `provenance` are
    /// parallel to it. Convexity is the caller's promise (the hull's); topology is checked here.
    pub fn from_faces(
        vertices: Vec<DVec3>,
        loops: &[Vec<u32>],
        planes: Vec<Plane>,
        provenance: Vec<Provenance>,
    ) -> Result<Self, PolytopeError> {
        let (loop_starts, loop_vertices) = flattened(loops);
        Self::from_loops(vertices, loop_starts, loop_vertices, planes, provenance)
    }

    /// As [`Self::from_faces`], with the loops in one list: that of face `f` is
    /// `loop_vertices[loop_starts[f] .. loop_starts[f + 1]]`.
    pub fn from_loops(
        vertices: Vec<DVec3>,
        loop_starts: Vec<u32>,
        loop_vertices: Vec<u32>,
        planes: Vec<Plane>,
        provenance: Vec<Provenance>,
    ) -> Result<Self, PolytopeError> {
        let faces = planes.len();
        let whole = loop_starts.first() == Some(&0) && loop_starts.last() == Some(&(loop_vertices.len() as u32));
        if !whole || loop_starts.len() != faces + 1 || provenance.len() != faces {
            return Err(PolytopeError::BadFace(faces as u32));
        }
        let mut edges: Vec<Edge> = Vec::with_capacity(loop_vertices.len() / 2);
        let mut loop_edges = Vec::with_capacity(loop_vertices.len());
        let mut open = OpenEdges::new(vertices.len());
        for f in 0..faces {
            let face = loop_vertices.get(loop_starts[f] as usize..loop_starts[f + 1] as usize).unwrap_or_default();
            let f = f as u32;
            if face.len() < 3 || face.iter().any(|&v| v as usize >= vertices.len()) {
                return Err(PolytopeError::BadFace(f));
            }
            for (k, &tail) in face.iter().enumerate() {
                let head = face[(k + 1) % face.len()];
                if let Some(e) = open.close(&edges, head, tail) {
                    edges[e as usize].right = f;
                    loop_edges.push(e);
                } else if open.open(&edges, tail, head) {
                    loop_edges.push(edges.len() as u32);
                    edges.push(Edge { tail, head, left: f, right: f });
                } else {
                    return Err(PolytopeError::OpenEdge(tail, head));
                }
            }
        }
        if let Some(e) = open.first() {
            let Edge { tail, head, .. } = edges[e as usize];
            return Err(PolytopeError::OpenEdge(tail, head));
        }
        Self::assemble(vertices, (loop_starts, loop_vertices), loop_edges, edges, planes, provenance, false)
    }

    /// A plate from a convex polygon, counter-clockwise seen from the side that `normal` (unit) points to.
    ///
    /// Face 0 is the front (of the given provenance), face 1 the back (virtual), faces 2 … n + 1 the rims along the
    /// sides (virtual); rim 2 + k lies along the side from vertex k to vertex k + 1.
    pub fn from_polygon(vertices: Vec<DVec3>, normal: DVec3, front: Provenance) -> Result<Self, PolytopeError> {
        let n = vertices.len() as u32;
        if n < 3 {
            return Err(PolytopeError::BadFace(0));
        }
        let offset = vertices.iter().map(|v| normal.dot(*v)).sum::<f64>() / f64::from(n);
        let mut planes = vec![Plane { normal, offset }, Plane { normal: -normal, offset: -offset }];
        let mut loops = vec![(0..n).collect::<Vec<_>>(), (0..n).rev().collect()];
        let mut edges = Vec::with_capacity(2 * n as usize);
        for k in 0..n {
            let (tail, head) = (k, (k + 1) % n);
            let side = vertices[head as usize] - vertices[tail as usize];
            let outward = side.cross(normal).normalize_or_zero();
            planes.push(Plane { normal: outward, offset: outward.dot(vertices[tail as usize]) });
            loops.push(vec![head, tail]);
            edges.push(Edge { tail, head, left: 0, right: 2 + k });
        }
        for k in 0..n {
            edges.push(Edge { tail: k, head: (k + 1) % n, left: 2 + k, right: 1 });
        }
        let mut loop_edges: Vec<u32> = (0..n).collect();
        // The back's loop is n−1, n−2, …, 0: its side k runs from n−1−k to n−2−k, the twin of side n−2−k.
        loop_edges.extend((0..n).map(|k| n + (2 * n - 2 - k) % n));
        // A rim's loop is head → tail (the front's edge, reversed) and tail → head (the back's edge).
        for k in 0..n {
            loop_edges.extend([k, n + k]);
        }
        let mut provenance = vec![Provenance::Virtual; 2 + n as usize];
        provenance[0] = front;
        Self::assemble(vertices, flattened(&loops), loop_edges, edges, planes, provenance, true)
    }

    /// The same polytope with each face tagged by `of`, which is given the polytope and the face. Rims, which have no
    /// width, stay virtual and are not asked about.
    pub fn with_provenance(mut self, of: impl Fn(&Self, u32) -> Provenance) -> Self {
        for f in 0..self.planes.len() as u32 {
            let provenance = if self.is_rim(f) { Provenance::Virtual } else { of(&self, f) };
            self.indices.set_original(f, provenance == Provenance::Original);
        }
        self
    }

    fn assemble(
        vertices: Vec<DVec3>,
        (loop_starts, loop_vertices): (Vec<u32>, Vec<u32>),
        loop_edges: Vec<u32>,
        edges: Vec<Edge>,
        planes: Vec<Plane>,
        provenance: Vec<Provenance>,
        flat: bool,
    ) -> Result<Self, PolytopeError> {
        // For each edge, where it stands in its left and in its right face's loop.
        let mut places = vec![[u32::MAX; 2]; edges.len()];
        let mut face_of = Vec::with_capacity(loop_vertices.len());
        for f in 0..planes.len() {
            for k in loop_starts[f]..loop_starts[f + 1] {
                face_of.push(f as u32);
                let e = loop_edges[k as usize] as usize;
                let side = usize::from(edges[e].left as usize != f || edges[e].tail != loop_vertices[k as usize]);
                places[e][side] = k;
            }
        }
        let mut first_corner = vec![u32::MAX; vertices.len()];
        let mut corners = vec![0usize; vertices.len()];
        for (k, &v) in loop_vertices.iter().enumerate() {
            first_corner[v as usize] = first_corner[v as usize].min(k as u32);
            corners[v as usize] += 1;
        }
        let mut ring_starts = Vec::with_capacity(vertices.len() + 1);
        ring_starts.push(0);
        let mut spokes = Vec::with_capacity(loop_vertices.len());
        for v in 0..vertices.len() as u32 {
            let begin = spokes.len();
            let mut k = first_corner[v as usize];
            if k == u32::MAX {
                return Err(PolytopeError::OpenRing(v));
            }
            // Counter-clockwise: from the edge that leaves v in face f, across f, to the edge that enters v.
            loop {
                let f = face_of[k as usize];
                let edge = loop_edges[k as usize];
                let Edge { tail, head, .. } = edges[edge as usize];
                spokes.push(Spoke { neighbour: if tail == v { head } else { tail }, edge, left: f });
                let (start, end) = (loop_starts[f as usize], loop_starts[f as usize + 1]);
                let entering = if k == start { end - 1 } else { k - 1 };
                let edge = loop_edges[entering as usize] as usize;
                let across = usize::from(places[edge][0] == entering);
                k = places[edge][across];
                if k == first_corner[v as usize] || spokes.len() - begin > corners[v as usize] || k == u32::MAX {
                    break;
                }
            }
            if k != first_corner[v as usize] || spokes.len() - begin != corners[v as usize] {
                return Err(PolytopeError::OpenRing(v));
            }
            ring_starts.push(spokes.len() as u32);
        }
        let centroid = vertices.iter().copied().sum::<DVec3>() / vertices.len() as f64;
        let radius = vertices.iter().map(|v| v.distance_squared(centroid)).fold(0.0, f64::max).sqrt();
        let mut polytope = Self {
            vertices: vertices.into_boxed_slice(),
            spokes: spokes.into_boxed_slice(),
            edges: edges.into_boxed_slice(),
            planes: planes.into_boxed_slice(),
            indices: Indices::new(&loop_starts, &ring_starts, &loop_vertices, &loop_edges, &provenance),
            centroid,
            radius,
            bulge: 0.0,
            directory: Directory::Scan(Box::default()),
            flat,
        };
        polytope.bulge = polytope.measured_bulge();
        polytope.directory = Directory::new(&polytope.vertices, |from, direction| polytope.climb(from, direction).0);
        Ok(polytope)
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
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Edge `e`.
    #[inline]
    pub fn edge(&self, e: u32) -> Edge {
        self.edges[e as usize]
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
    pub fn ring(&self, v: u32) -> &[Spoke] {
        &self.spokes[self.indices.ring(v)]
    }

    /// How far any vertex stands off the plane of a face around it, or an end of its edges outside of that plane: the most by
    /// which a face's plane may differ from a supporting one, in metres. It is rounding unless faces were merged that are not quite flat.
    #[inline]
    pub fn bulge(&self) -> f64 {
        self.bulge
    }

    fn measured_bulge(&self) -> f64 {
        let mut bulge = 0.0_f64;
        for v in 0..self.vertices.len() as u32 {
            for face in self.ring(v).iter().map(|spoke| self.plane(spoke.left)) {
                bulge = bulge.max(face.height(self.vertex(v)).abs());
                let beside = self.ring(v).iter().map(|spoke| face.height(self.vertex(spoke.neighbour)));
                bulge = beside.fold(bulge, f64::max);
            }
        }
        bulge
    }

    /// The vertices of face `f`, counter-clockwise seen from outside.
    #[inline]
    pub fn face_vertices(&self, f: u32) -> &[u32] {
        self.indices.part(self.indices.loop_vertices, self.indices.face(f))
    }

    /// The edges of face `f`; edge k runs from vertex k of the loop to the next.
    #[inline]
    pub fn face_edges(&self, f: u32) -> &[u32] {
        self.indices.part(self.indices.loop_edges, self.indices.face(f))
    }

    /// True for a face of no width along the side of a plate.
    #[inline]
    pub fn is_rim(&self, f: u32) -> bool {
        self.indices.face(f).len() == 2
    }

    /// True for a plate (no volume).
    #[inline]
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// Where face `f` comes from.
    #[inline]
    pub fn face_provenance(&self, f: u32) -> Provenance {
        if self.indices.is_original(f) { Provenance::Original } else { Provenance::Virtual }
    }

    /// Where edge `e` comes from: original when at least one of its faces is.
    #[inline]
    pub fn edge_provenance(&self, e: u32) -> Provenance {
        let Edge { left, right, .. } = self.edges[e as usize];
        let original = self.indices.is_original(left) || self.indices.is_original(right);
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

    /// The same, for one who has a vertex near to it: climbs from `hint`, unless looking at all is quicker.
    #[inline]
    pub fn support_from(&self, hint: u32, direction: DVec3) -> u32 {
        self.directory.scan(direction).unwrap_or_else(|| self.climb(hint, direction).0)
    }

    /// The vertex farthest along `direction` and its height there, by climbing from vertex `from`.
    ///
    /// A climb ends at a global maximum, since the polytope is convex; it moves only to strictly higher vertices, so a
    /// plateau cannot make it cycle. From the vertex of a near direction it looks at one or two rings, which is less than
    /// [`Self::support`] does; from any other, more.
    #[inline]
    pub fn climb(&self, from: u32, direction: DVec3) -> (u32, f64) {
        let mut best = from;
        let mut height = direction.dot(self.vertex(best));
        loop {
            let here = best;
            for spoke in self.ring(here) {
                let h = direction.dot(self.vertex(spoke.neighbour));
                if h > height {
                    height = h;
                    best = spoke.neighbour;
                }
            }
            if best == here {
                return (best, height);
            }
        }
    }

    /// The same, and the height of the highest of the neighbours there.
    #[inline]
    pub fn climb_apart(&self, from: u32, direction: DVec3) -> (u32, f64, f64) {
        let mut best = from;
        let mut height = direction.dot(self.vertex(best));
        loop {
            let here = best;
            let mut next = f64::NEG_INFINITY;
            for spoke in self.ring(here) {
                let h = direction.dot(self.vertex(spoke.neighbour));
                if h > height {
                    height = h;
                    best = spoke.neighbour;
                } else {
                    next = next.max(h);
                }
            }
            if best == here {
                return (best, height, next);
            }
        }
    }
}

/// Loops in one list, and where each begins.
fn flattened(loops: &[Vec<u32>]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = Vec::with_capacity(loops.len() + 1);
    let mut vertices = Vec::with_capacity(loops.iter().map(Vec::len).sum());
    starts.push(0);
    for face in loops {
        vertices.extend_from_slice(face);
        starts.push(vertices.len() as u32);
    }
    (starts, vertices)
}

/// The edges that have one face so far, in a chain for each tail vertex.
struct OpenEdges {
    first: Vec<u32>,
    /// For each edge, the next of its chain.
    next: Vec<u32>,
}

impl OpenEdges {
    const END: u32 = u32::MAX;

    fn new(vertices: usize) -> Self {
        Self { first: vec![Self::END; vertices], next: Vec::new() }
    }

    /// Takes the open edge `tail → head` out, if there is one.
    fn close(&mut self, edges: &[Edge], tail: u32, head: u32) -> Option<u32> {
        let (mut before, mut e) = (Self::END, self.first[tail as usize]);
        while e != Self::END {
            let after = self.next[e as usize];
            if edges[e as usize].head == head {
                if before == Self::END {
                    self.first[tail as usize] = after;
                } else {
                    self.next[before as usize] = after;
                }
                return Some(e);
            }
            (before, e) = (e, after);
        }
        None
    }

    /// Opens the edge that is about to be pushed; false when it is open already.
    fn open(&mut self, edges: &[Edge], tail: u32, head: u32) -> bool {
        let mut e = self.first[tail as usize];
        while e != Self::END {
            if edges[e as usize].head == head {
                return false;
            }
            e = self.next[e as usize];
        }
        self.next.push(self.first[tail as usize]);
        self.first[tail as usize] = edges.len() as u32;
        true
    }

    /// The open edge of least index.
    fn first(&self) -> Option<u32> {
        let edge = |e: u32| (e != Self::END).then_some(e);
        let chain = |&first: &u32| std::iter::successors(edge(first), |&e| edge(self.next[e as usize]));
        self.first.iter().flat_map(chain).min()
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
                let right = ring[(k + ring.len() - 1) % ring.len()].left;
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
