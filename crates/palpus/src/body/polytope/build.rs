//! Builds solid polytopes from faces and plates from polygons, and restores polytopes from stored
//! parts.
//!
//! 1. Number the edges in the order in which they first occur in the loops. Each edge occurs once
//!    in each direction.
//! 2. Pair each corner of a loop with the corner at which the same edge occurs in the opposite
//!    direction.
//! 3. Build the ring of each vertex: in each face, go from the edge that starts at the vertex to
//!    the edge that ends at the vertex.
//! 4. Write all indices into one list, and compute the centroid, the radius and the directory.

mod open_edges;

use glam::DVec3;

use super::numbers::{Numbers, SPOKE};
use super::{Edge, FACES_A_WORD, Lists, Polytope, PolytopeError, Provenance};
use crate::algebra::Plane;
use crate::algebra::tolerance::{CRISP, SHORT_EDGE};
use crate::body::polytope::directory::Directory;
use open_edges::OpenEdges;

impl Polytope {
    /// Builds a solid polytope from its merged planar faces.
    ///
    /// `loops[f]` has the vertices of face `f`, counter-clockwise as seen from outside. `planes[f]`
    /// and `provenance[f]` belong to the same face. The caller must ensure that the polytope is
    /// convex. This function checks the topology.
    ///
    /// # Errors
    /// Fails if the faces do not form a closed surface.
    pub fn from_faces(
        vertices: Vec<DVec3>,
        loops: &[Vec<u32>],
        planes: Vec<Plane>,
        provenance: Vec<Provenance>,
    ) -> Result<Self, PolytopeError> {
        let (loop_starts, loop_vertices) = flattened(loops);
        Self::from_loops(vertices, loop_starts, loop_vertices, planes, provenance)
    }

    /// Builds the same polytope as [`Self::from_faces`], from all loops in one list. The loop of
    /// face `f` is `loop_vertices[loop_starts[f] .. loop_starts[f + 1]]`.
    ///
    /// # Errors
    /// Fails if the faces do not form a closed surface.
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
        let mut open = OpenEdges::new(vertices.len(), loop_vertices.len() / 2);
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
        let topology = Topology { loop_starts, loop_vertices, loop_edges, edges };
        let original = |f: usize| provenance[f] == Provenance::Original;
        let mut polytope = topology.assembled(&mut AssemblyMemory::default(), vertices, planes, original, false)?;
        polytope.set_bulge(polytope.measured_bulge());
        Ok(polytope)
    }

    /// Builds a plate from a convex polygon. The polygon's vertices are counter-clockwise as seen
    /// from the side to which `normal` (unit) points.
    ///
    /// Face 0 is the front and has the provenance `front`. Face 1 is the back. Faces 2 … n + 1 are
    /// the rims; rim 2 + k lies along the side from vertex k to vertex k + 1. The back and the rims
    /// are virtual.
    ///
    /// # Errors
    /// Fails if the polygon has fewer than three vertices.
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
        // The loop of the back is n−1, n−2, …, 0. Its side k runs from vertex n−1−k to vertex
        // n−2−k. The front's side n−2−k runs in the opposite direction.
        loop_edges.extend((0..n).map(|k| n + (2 * n - 2 - k) % n));
        // The loop of a rim has the side head → tail along the front's edge, and the side tail →
        // head along the back's edge.
        for k in 0..n {
            loop_edges.extend([k, n + k]);
        }
        let (loop_starts, loop_vertices) = flattened(&loops);
        let topology = Topology { loop_starts, loop_vertices, loop_edges, edges };
        let original = |f: usize| f == 0 && front == Provenance::Original;
        let mut polytope = topology.assembled(&mut AssemblyMemory::default(), vertices, planes, original, true)?;
        polytope.set_bulge(polytope.measured_bulge());
        Ok(polytope)
    }

    fn set_bulge(&mut self, bulge: f64) {
        self.bulge = bulge;
        let length = |edge: super::Edge| self.vertex(edge.tail).distance(self.vertex(edge.head));
        let shortest = self.edges().map(length).fold(f64::INFINITY, f64::min);
        self.rough = bulge > CRISP * self.radius || bulge > SHORT_EDGE * shortest;
    }

    /// Computes the value of [`Self::bulge`].
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
}

/// Restores solid polytopes from their stored parts. One restorer can restore many polytopes and
/// reuses its memory.
#[derive(Debug, Default)]
pub struct PolytopeRestorer {
    topology: Topology,
    room: AssemblyMemory,
    originals: Vec<bool>,
    /// For each vertex, the last face in which it occurred.
    met: Vec<u32>,
}

impl PolytopeRestorer {
    /// Starts a polytope with the given number of vertices. The first face follows.
    pub fn begin(&mut self, vertices: usize) {
        let Topology { loop_starts, loop_vertices, loop_edges, edges } = &mut self.topology;
        for list in [&mut *loop_starts, loop_vertices, loop_edges] {
            list.clear();
        }
        loop_starts.push(0);
        edges.clear();
        self.originals.clear();
        self.met.clear();
        self.met.resize(vertices, u32::MAX);
    }

    /// Appends a corner to the current face. `edge` is the index of the edge that starts at the
    /// corner. `edge` is `None` if this edge occurs for the first time.
    #[inline]
    pub fn corner(&mut self, vertex: u32, edge: Option<u32>) {
        let fresh = self.topology.edges.len() as u32;
        self.topology.loop_vertices.push(vertex);
        self.topology.loop_edges.push(edge.unwrap_or(fresh));
        if edge.is_none() {
            // The head and the right face of the edge are set later.
            self.topology.edges.push(Edge {
                tail: vertex,
                head: u32::MAX,
                left: self.originals.len() as u32,
                right: u32::MAX,
            });
        }
    }

    /// Ends the current face; `original` says whether it is an original face. Returns `None` if the
    /// face is degenerate or contradicts the earlier faces at an edge.
    pub fn end_face(&mut self, original: bool) -> Option<()> {
        let face = self.originals.len() as u32;
        let begin = *self.topology.loop_starts.last()? as usize;
        let (corners, loop_edges) = (&self.topology.loop_vertices[begin..], &self.topology.loop_edges[begin..]);
        if corners.len() < 3 {
            return None;
        }
        for (k, (&tail, &e)) in corners.iter().zip(loop_edges).enumerate() {
            let head = corners[if k + 1 == corners.len() { 0 } else { k + 1 }];
            if std::mem::replace(self.met.get_mut(tail as usize)?, face) == face {
                return None;
            }
            let edge = self.topology.edges.get_mut(e as usize)?;
            if edge.left == face && edge.head == u32::MAX {
                edge.head = head;
            } else if (edge.tail, edge.head, edge.right) == (head, tail, u32::MAX) && edge.left != face {
                edge.right = face;
            } else {
                return None;
            }
        }
        self.topology.loop_starts.push(self.topology.loop_vertices.len() as u32);
        self.originals.push(original);
        Some(())
    }

    /// Returns the polytope of all faces since [`Self::begin`]. `planes` are the planes of the
    /// faces, and `bulge` is the value of [`Polytope::bulge`] (m). Returns `None` if the faces do
    /// not form a closed surface, or if a number is not finite.
    pub fn finish(&mut self, vertices: Vec<DVec3>, planes: Vec<Plane>, bulge: f64) -> Option<Polytope> {
        let Self { topology, room, originals, .. } = self;
        let euler = vertices.len() + planes.len() == topology.edges.len() + 2;
        let closed = topology.edges.iter().all(|edge| edge.right != u32::MAX);
        let finite =
            bulge.is_finite() && planes.iter().all(|plane| plane.normal.is_finite() && plane.offset.is_finite());
        if !(euler && closed && finite && vertices.len() == self.met.len() && planes.len() == originals.len()) {
            return None;
        }
        let mut polytope = topology.assembled(room, vertices, planes, |f| originals[f], false).ok()?;
        polytope.set_bulge(bulge);
        // If a vertex had only two corners, the surface would be folded at the vertex. If a vertex
        // is not finite, the centroid or the radius is not finite either.
        let whole = (0..polytope.vertices.len() as u32).all(|v| polytope.ring(v).len() >= 3);
        (whole && polytope.centroid.is_finite() && polytope.radius.is_finite()).then_some(polytope)
    }
}

/// A closed surface: loops of vertices, loops of edges, and the edges.
#[derive(Debug, Default)]
struct Topology {
    loop_starts: Vec<u32>,
    loop_vertices: Vec<u32>,
    /// The edges of all loops. Each edge occurs twice.
    loop_edges: Vec<u32>,
    edges: Vec<Edge>,
}

/// Working memory of [`Topology::assembled`].
#[derive(Debug, Default)]
struct AssemblyMemory {
    /// For each edge, the last corner at which the edge started in a loop.
    met: Vec<u32>,
    /// For each corner, the corner at which the same edge starts in the opposite direction.
    twins: Vec<u32>,
    /// For each corner, the index of its face.
    faces: Vec<u32>,
    /// For each corner, the next corner around its vertex.
    onward: Vec<u32>,
    /// For each vertex, its first corner in the loops.
    first: Vec<u32>,
    all: Vec<u32>,
}

impl Topology {
    /// Builds the polytope with this surface. The caller must set the bulge afterwards.
    fn assembled(
        &self,
        room: &mut AssemblyMemory,
        vertices: Vec<DVec3>,
        planes: Vec<Plane>,
        is_original: impl Fn(usize) -> bool,
        flat: bool,
    ) -> Result<Polytope, PolytopeError> {
        self.pair_corners(room, vertices.len());
        let lists = self.lists(room, vertices.len(), planes.len(), is_original)?;
        let centroid = vertices.iter().copied().sum::<DVec3>() / vertices.len() as f64;
        let radius = vertices.iter().map(|v| v.distance_squared(centroid)).fold(0.0, f64::max).sqrt();
        let mut polytope = Polytope {
            vertices: vertices.into_boxed_slice(),
            planes: planes.into_boxed_slice(),
            lists,
            centroid,
            radius,
            bulge: 0.0,
            rough: false,
            directory: Directory::Scan(Box::default()),
            flat,
        };
        polytope.directory = Directory::new(&polytope.vertices, |from, direction| polytope.climb(from, direction).0);
        Ok(polytope)
    }

    /// Computes the first corner of each vertex, and for each corner the next corner around its
    /// vertex.
    fn pair_corners(&self, room: &mut AssemblyMemory, vertices: usize) {
        const NONE: u32 = u32::MAX;
        let corners = self.loop_vertices.len();
        let AssemblyMemory { met, twins, faces, onward, first, .. } = room;
        for (list, length) in [(&mut *met, self.edges.len()), (&mut *twins, corners), (&mut *first, vertices)] {
            list.clear();
            list.resize(length, NONE);
        }
        for (k, &e) in self.loop_edges.iter().enumerate() {
            let before = std::mem::replace(&mut met[e as usize], k as u32);
            if before != NONE {
                twins[before as usize] = k as u32;
                twins[k] = before;
            }
        }
        for list in [&mut *faces, onward] {
            list.clear();
            list.reserve(corners);
        }
        for (f, ends) in self.loop_starts.windows(2).enumerate() {
            let (begin, end) = (ends[0] as usize, ends[1] as usize);
            // The next corner counter-clockwise lies across the edge that enters the vertex in this
            // face.
            onward.push(twins[end - 1]);
            onward.extend_from_slice(&twins[begin..end - 1]);
            faces.resize(end, f as u32);
        }
        for (k, &v) in self.loop_vertices.iter().enumerate().rev() {
            first[v as usize] = k as u32;
        }
    }

    /// Writes all indices into one list.
    fn lists(
        &self,
        room: &mut AssemblyMemory,
        vertices: usize,
        faces: usize,
        is_original: impl Fn(usize) -> bool,
    ) -> Result<Lists, PolytopeError> {
        let corners = self.loop_vertices.len();
        let AssemblyMemory { twins, faces: face_of, onward, first, all, .. } = room;
        all.clear();
        let ring_starts = self.loop_starts.len();
        let loops = ring_starts + vertices + 1;
        let words = faces.div_ceil(FACES_A_WORD as usize);
        all.reserve(loops + (2 + SPOKE) * corners + 4 * self.edges.len() + words);
        all.extend(self.loop_starts.iter().map(|start| loops as u32 + start));
        all.resize(loops, 0);
        all.extend_from_slice(&self.loop_vertices);
        all.extend_from_slice(&self.loop_edges);
        let spokes = all.len();
        all[ring_starts] = spokes as u32;
        for (v, &begin) in first.iter().enumerate() {
            let mut k = begin as usize;
            if k >= corners {
                return Err(PolytopeError::OpenRing(v as u32));
            }
            // The walk returns to its first corner, because no two corners have the same successor.
            loop {
                let neighbour = self.loop_vertices[twins[k] as usize];
                all.extend([neighbour, self.loop_edges[k], face_of[k]]);
                k = onward[k] as usize;
                if k == begin as usize || all.len() > spokes + SPOKE * corners {
                    break;
                }
            }
            all[ring_starts + v + 1] = all.len() as u32;
        }
        if all.len() != spokes + SPOKE * corners {
            return Err(PolytopeError::OpenRing(self.torn_vertex(&all[ring_starts..=ring_starts + vertices])));
        }
        let edges = all.len();
        all.extend(self.edges.iter().flat_map(|&Edge { tail, head, left, right }| [tail, head, left, right]));
        let originals = all.len();
        let word = |word: usize| {
            let bit = |k: usize| {
                let f = word * FACES_A_WORD as usize + k;
                u32::from(f < faces && is_original(f)) << k
            };
            (0..FACES_A_WORD as usize).fold(0, |bits, k| bits | bit(k))
        };
        all.extend((0..words).map(word));
        Ok(Lists {
            all: Numbers::new(all),
            ring_starts: ring_starts as u32,
            edges: edges as u32,
            originals: originals as u32,
            corners: corners as u32,
        })
    }

    /// Returns the first vertex whose ring does not contain all of its corners.
    fn torn_vertex(&self, ring_starts: &[u32]) -> u32 {
        let mut corners = vec![0; ring_starts.len() - 1];
        self.loop_vertices.iter().for_each(|&v| corners[v as usize] += 1);
        let torn = ring_starts
            .windows(2)
            .zip(&corners)
            .position(|(ends, &corners)| ends[1] - ends[0] != corners * SPOKE as u32);
        torn.unwrap_or(0) as u32
    }
}

/// Returns the start of each loop (one entry more than loops), and all loops in one list.
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
