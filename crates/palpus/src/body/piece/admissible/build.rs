//! Computes the admissible normals of all pieces from the mesh.
//!
//! 1. For each triangle, find the face of its piece in which the triangle lies. The normal of that
//!    face then counts as the normal of the triangle.
//! 2. For each piece, find its surface faces, and how much of each face is covered by triangles.
//! 3. For each edge of a surface face, find the sides of the face's triangles along the edge, and
//!    how the mesh bends at these sides. If the mesh bends outward, add an arc; if it bends inward,
//!    add a valley.
//! 4. Find the mesh vertex at each vertex of a piece, and the neighbours of each mesh vertex.
//! 5. Compute a cap around all admissible normals of each piece (`cap`).
//! 6. For each piece, find the flat faces of the mesh that continue beyond it.
//! 7. Find how the mesh continues around each surface face (`flat`).

use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec3};

use super::{
    Admissible, AdmissibleNormals, Borrowed, Cap, FaceRim, Range, SurfaceArc, SurfaceFace, Valley, is_original,
};
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, COVERED_WHOLE, FOLDED, NORMALS_PER_PART, ON_FACE, OWNERS_PER_PART};
use crate::algebra::{Plane, Workers, both, map_in_order};
use crate::body::decompose::facet::NONE;
use crate::body::piece::face_area;
use crate::body::{EdgeKind, HalfEdges, Mesh, Piece, Polytope};

impl Admissible {
    /// Computes the admissible normals of all pieces. `noise` is the largest distance of the
    /// vertices of a planar face from its plane (m).
    pub(crate) fn new(
        mesh: &Mesh,
        half_edges: &HalfEdges,
        polytopes: &[Polytope],
        pieces: &[Piece],
        noise: f64,
        workers: &dyn Workers,
    ) -> Self {
        let source = Source::new(mesh, half_edges, polytopes, pieces, noise, workers);
        let batch = |k: usize| {
            let some = k * OWNERS_PER_PART..pieces.len().min((k + 1) * OWNERS_PER_PART);
            Self::of_some(&source, &polytopes[some.clone()], &pieces[some])
        };
        let parts = || map_in_order(workers, pieces.len().div_ceil(OWNERS_PER_PART), 1, batch, &mut |_| ());
        let (parts, (edge_starts, edges)) = both(workers, parts, || edges_of(mesh));
        let sum = |of: fn(&Self) -> usize| parts.iter().map(of).sum();
        let mut answer = Self {
            noise: ON_FACE * noise,
            pieces: Vec::with_capacity(pieces.len() + 1),
            faces: Vec::with_capacity(sum(|part| part.faces.len())),
            borrowed: Vec::with_capacity(sum(|part| part.borrowed.len())),
            arcs: Vec::with_capacity(sum(|part| part.arcs.len())),
            valleys: Vec::with_capacity(sum(|part| part.valleys.len())),
            corners: Vec::with_capacity(sum(|part| part.corners.len())),
            edge_starts,
            edges,
            ..Self::default()
        };
        answer.pieces.push(Range::default());
        parts.into_iter().for_each(|part| answer.append(part));
        answer.find_caps(mesh, half_edges, polytopes, workers);
        answer.find_continued(mesh, polytopes, workers);
        answer.find_inner(mesh, half_edges, &source.normals, polytopes, workers);
        answer
    }

    /// Does step 6.
    fn find_continued(&mut self, mesh: &Mesh, polytopes: &[Polytope], workers: &dyn Workers) {
        let around = |k: usize| {
            let polytope = &polytopes[k];
            let own = self.of(k as u32, polytope, mesh);
            let continues = |face: u32| {
                let count = polytope.face_vertices(face).len();
                (0..count).any(|i| self.is_continued_at(&own, face, i))
            };
            let faces = own.faces().iter().map(|own_face| own_face.face).filter(|&face| continues(face));
            let normals: Vec<DVec3> = faces.map(|face| polytope.plane(face).normal).collect();
            Cap::around(&normals)
        };
        self.continued = map_in_order(workers, polytopes.len(), OWNERS_PER_PART, around, &mut |_| ());
    }

    /// Returns true if the mesh continues a surface face beyond its corner `i`: a neighbour of this
    /// vertex lies in the face's plane, but not between the face's sides.
    fn is_continued_at(&self, own: &AdmissibleNormals<'_>, face: u32, i: usize) -> bool {
        let (polytope, around) = (own.polytope, own.polytope.face_vertices(face));
        let (normal, count) = (polytope.plane(face).normal, around.len());
        let at = |i: usize| around.at(i % count);
        let side = |w: u32| polytope.vertex(w) - polytope.vertex(at(i));
        let (before, after) = (side(at(i + count - 1)), side(at(i + 1)));
        let is_beyond = |edge: DVec3| {
            let slack = -ADMISSIBLE_ANGLE * edge.length();
            normal.dot(after.cross(edge)) < slack * after.length()
                || normal.dot(edge.cross(before)) < slack * before.length()
        };
        let rises = |edge, normal| self.rises(edge, normal, ADMISSIBLE_ANGLE);
        let is_flat = |edge: DVec3| !rises(edge, normal) && !rises(edge, -normal);
        let v = own.corner(at(i));
        self.is_highest(v, normal, ADMISSIBLE_ANGLE)
            && self.edges(v).iter().any(|&edge| is_flat(edge) && is_beyond(edge))
    }

    /// Computes the admissible normals of some of the pieces, without rings and caps.
    fn of_some(source: &Source<'_>, polytopes: &[Polytope], pieces: &[Piece]) -> Self {
        let mut answer = Self::default();
        for (polytope, piece) in polytopes.iter().zip(pieces) {
            let first = answer.faces.len();
            surface_faces(source, polytope, piece, &mut answer.faces);
            answer.add_edges(source, polytope, piece, first);
            answer.add_rims(source, polytope, piece, first);
            corners(source.mesh, polytope, piece, &mut answer.corners);
            answer.pieces.push(answer.end());
        }
        answer
    }

    /// Appends the arcs, borrowed normals and valleys of one piece. Its surface faces begin at
    /// `first`.
    fn add_edges(&mut self, source: &Source<'_>, polytope: &Polytope, piece: &Piece, first: usize) {
        let Self { faces, borrowed, arcs, valleys, .. } = self;
        let (faces, first) = (&faces[first..], borrowed.len());
        let own = |face: u32| faces.binary_search_by_key(&face, |own| own.face).ok().map(|k| faces[k]);
        let sides = Sides::of(source, polytope, piece, faces);
        for (e, edge) in polytope.edges().enumerate() {
            let e = e as u32;
            let both = [own(edge.left), own(edge.right)];
            let (turned, mine, other) = match both {
                [None, None] => continue,
                [Some(left), Some(right)] => {
                    let is_outward =
                        |of_left| matches!(sides.bend(source, polytope, e, of_left), Some(Bend::Outward(_)));
                    if left.whole && right.whole || is_outward(true) || is_outward(false) {
                        arcs.push(SurfaceArc { edge: e, left: edge.left, right: edge.right });
                    }
                    continue;
                }
                [Some(_), None] => (true, edge.left, edge.right),
                [None, Some(_)] => (false, edge.right, edge.left),
            };
            match sides.bend(source, polytope, e, turned) {
                None => {}
                Some(Bend::Outward(normal)) => {
                    let theirs = (polytope.face_count() + borrowed.len() - first) as u32;
                    let offset = normal.dot(polytope.vertex(edge.tail)).max(normal.dot(polytope.vertex(edge.head)));
                    borrowed.push(Borrowed { plane: Plane { normal, offset }, edge: e });
                    let (left, right) = if turned { (mine, theirs) } else { (theirs, mine) };
                    arcs.push(SurfaceArc { edge: e, left, right });
                }
                Some(Bend::Inward(beyond)) => {
                    let plane = polytope.plane(mine);
                    let ends = if turned { [edge.tail, edge.head] } else { [edge.head, edge.tail] };
                    if plane.normal.dot(beyond) > 0.0 {
                        valleys.push(Valley { edge: e, ends, face: mine, other, plane, beyond });
                    }
                }
            }
        }
    }

    /// Returns the current length of each array.
    fn end(&self) -> Range {
        Range {
            faces: self.faces.len() as u32,
            borrowed: self.borrowed.len() as u32,
            arcs: self.arcs.len() as u32,
            valleys: self.valleys.len() as u32,
            // Step 7 adds the inner vertices of all pieces.
            inner: 0,
            partial: self.partial.len() as u32,
            corners: self.corners.len() as u32,
        }
    }

    /// Appends the entries of the next pieces.
    fn append(&mut self, part: Self) {
        let Range { faces, borrowed, arcs, valleys, inner, partial, corners } = self.end();
        self.pieces.extend(part.pieces.into_iter().map(|end| Range {
            faces: faces + end.faces,
            borrowed: borrowed + end.borrowed,
            arcs: arcs + end.arcs,
            valleys: valleys + end.valleys,
            inner,
            partial: partial + end.partial,
            corners: corners + end.corners,
        }));
        self.faces.extend(part.faces);
        self.borrowed.extend(part.borrowed);
        self.arcs.extend(part.arcs);
        self.valleys.extend(part.valleys);
        self.partial.extend(part.partial);
        self.corners.extend(part.corners);
    }
}

/// The mesh, with the normal of the piece's face at each triangle.
pub(super) struct Source<'s> {
    pub(super) mesh: &'s Mesh,
    pub(super) half_edges: &'s HalfEdges,
    /// Geometric normal of each triangle.
    true_normals: Vec<DVec3>,
    /// For each triangle, the normal of the face in which it lies.
    normals: Vec<DVec3>,
    pub(super) noise: f64,
}

impl<'s> Source<'s> {
    fn new(
        mesh: &'s Mesh,
        half_edges: &'s HalfEdges,
        polytopes: &[Polytope],
        pieces: &[Piece],
        noise: f64,
        workers: &dyn Workers,
    ) -> Self {
        let normal = |t: usize| mesh.triangle_normal(t as u32);
        let true_normals = map_in_order(workers, mesh.triangles().len(), NORMALS_PER_PART, normal, &mut |_| ());
        let mut source = Self { mesh, half_edges, true_normals, normals: Vec::new(), noise };
        let mut normals = source.true_normals.clone();
        // An arc ends at the normal of the face in which the neighbouring triangle lies. Then both
        // pieces at the edge use the same normal for this triangle.
        let within = |part: usize| {
            let some = part * OWNERS_PER_PART..pieces.len().min((part + 1) * OWNERS_PER_PART);
            let mut within = Vec::new();
            for (k, polytope) in some.clone().zip(&polytopes[some]) {
                for face in 0..polytope.face_count() as u32 {
                    let plane = polytope.plane(face);
                    let lying = pieces[k]
                        .face_triangles(face)
                        .iter()
                        .filter(|&&t| source.lies_in(t, plane) && !source.is_back(t, plane));
                    within.extend(lying.map(|&t| (t, k as u32, face)));
                }
            }
            within
        };
        for part in map_in_order(workers, pieces.len().div_ceil(OWNERS_PER_PART), 1, within, &mut |_| ()) {
            for (t, piece, face) in part {
                normals[t as usize] = polytopes[piece as usize].plane(face).normal;
            }
        }
        source.normals = normals;
        source
    }

    /// Returns true if triangle `t` lies in `plane` and faces to the same side as the plane. A
    /// triangle of a sheet faces to both sides.
    pub(super) fn lies_in(&self, t: u32, plane: Plane) -> bool {
        let flat = self.mesh.triangle_points(t).iter().all(|p| plane.height(*p).abs() <= ON_FACE * self.noise);
        let cosine = plane.normal.dot(self.true_normals[t as usize]);
        flat && (cosine > FOLDED || cosine < -FOLDED && self.mesh.is_sheet(t))
    }

    /// Returns true if `plane` is on the back of triangle `t`, which lies in it.
    fn is_back(&self, t: u32, plane: Plane) -> bool {
        plane.normal.dot(self.true_normals[t as usize]) < 0.0
    }
}

/// Appends the surface faces of one piece.
fn surface_faces(source: &Source<'_>, polytope: &Polytope, piece: &Piece, faces: &mut Vec<SurfaceFace>) {
    for face in (0..polytope.face_count() as u32).filter(|&face| !polytope.is_rim(face)) {
        let real = piece.face_triangles(face).iter().filter(|&&t| source.lies_in(t, polytope.plane(face)));
        let covered: f64 = real.map(|&t| source.mesh.triangle_area(t)).sum();
        if is_original(polytope, face) || covered > 0.0 {
            let whole = covered >= COVERED_WHOLE * face_area(polytope, face);
            let covered = is_original(polytope, face);
            faces.push(SurfaceFace { face, whole, covered, rim: FaceRim::NONE });
        }
    }
}

/// The sides of triangles along the borders of a piece's surface faces.
struct Sides {
    /// Tuples of face, tail point, head point, triangle and number of the side in the triangle;
    /// sorted by face.
    sides: Vec<(u32, DVec3, DVec3, u32, usize)>,
}

impl Sides {
    fn of(source: &Source<'_>, polytope: &Polytope, piece: &Piece, faces: &[SurfaceFace]) -> Self {
        let mut sides = Vec::new();
        for own in faces {
            let virtual_beside = polytope.face_edges(own.face).iter().any(|e| {
                let edge = polytope.edge(e);
                let other = if edge.left == own.face { edge.right } else { edge.left };
                faces.binary_search_by_key(&other, |own| own.face).is_err()
            });
            if own.whole && !virtual_beside {
                continue;
            }
            for &t in piece.face_triangles(own.face) {
                let p = source.mesh.triangle_points(t);
                for k in 0..3 {
                    let beyond = source.half_edges.neighbour(t, k);
                    if beyond.is_some_and(|(n, _)| source.normals[n as usize] == source.normals[t as usize]) {
                        continue;
                    }
                    sides.push((own.face, p[k], p[(k + 1) % 3], t, k));
                }
            }
        }
        Self { sides }
    }

    /// Returns how the mesh bends across edge `e`, as seen from its left face if `of_left`, else
    /// from its right face. If the mesh bends outward at a part of the edge, it counts as bent
    /// outward. `None` if the mesh is flat there.
    fn bend(&self, source: &Source<'_>, polytope: &Polytope, e: u32, of_left: bool) -> Option<Bend> {
        let edge = polytope.edge(e);
        let (face, other) = if of_left { (edge.left, edge.right) } else { (edge.right, edge.left) };
        let (tail, head) = if of_left { (edge.tail, edge.head) } else { (edge.head, edge.tail) };
        let (tail, head) = (polytope.vertex(tail), polytope.vertex(head));
        let along = (head - tail).try_normalize()?;
        let length = tail.distance(head);
        let tolerance = ON_FACE * source.noise;
        let plane = polytope.plane(face);
        let normal = plane.normal;
        let angle_to = |n: DVec3| along.dot(normal.cross(n)).atan2(normal.dot(n));
        let begin = self.sides.partition_point(|side| side.0 < face);
        let mut widest = 0.0_f64;
        // The normal beyond the valley where the mesh bends least.
        let mut beyond: Option<DVec3> = None;
        for &(_, p, q, t, k) in self.sides[begin..].iter().take_while(|side| side.0 == face) {
            // On the back of a sheet, the sides run the other way, and ridges are valleys.
            let back = source.is_back(t, plane);
            let (p, q, sign) = if back { (q, p, -1.0) } else { (p, q, 1.0) };
            let off = |x: DVec3| (x - tail).cross(along).length();
            let (s, e) = (along.dot(p - tail), along.dot(q - tail));
            if e <= s || e <= tolerance || s >= length - tolerance || off(p).max(off(q)) > tolerance {
                continue;
            }
            let [ridge, valley] = [EdgeKind::Convex, EdgeKind::Reflex];
            let [ridge, valley] = if back { [valley, ridge] } else { [ridge, valley] };
            match (source.half_edges.kind(t, k), source.half_edges.neighbour(t, k)) {
                (EdgeKind::Open | EdgeKind::NonManifold, _) | (_, None) => widest = widest.max(FRAC_PI_2),
                (kind, Some((n, _))) => {
                    let theirs = sign * source.normals[n as usize];
                    if kind == ridge {
                        widest = widest.max(angle_to(theirs));
                    } else if kind == valley && beyond.is_none_or(|beyond| normal.dot(theirs) > normal.dot(beyond)) {
                        beyond = Some(theirs);
                    }
                }
            }
        }
        if widest <= 0.0 {
            return beyond.map(Bend::Inward);
        }
        let limit = angle_to(polytope.plane(other).normal);
        Some(Bend::Outward(DQuat::from_axis_angle(along, widest.min(limit)) * normal))
    }
}

/// How the mesh bends at an edge of a surface face.
enum Bend {
    /// The normal of the mesh beyond the edge, at most that of the other face.
    Outward(DVec3),
    /// The normal of the mesh beyond the edge.
    Inward(DVec3),
}

/// Appends the mesh vertex at each vertex of the piece, or [`NONE`]. Searches the corners of the
/// piece's triangles.
fn corners(mesh: &Mesh, polytope: &Polytope, piece: &Piece, corners: &mut Vec<u32>) {
    // Hulls and meshes may differ in the sign of zero. Adding positive zero removes negative zeros.
    let key = |p: DVec3| (p + DVec3::ZERO).to_array();
    let order =
        |p: &[f64; 3], q: &[f64; 3]| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2]));
    let mut known: Vec<u32> = piece.triangles().iter().flat_map(|&t| mesh.triangles()[t as usize]).collect();
    known.sort_unstable();
    known.dedup();
    let place = |v: u32| key(mesh.vertices()[v as usize]);
    known.sort_by(|&v, &w| order(&place(v), &place(w)));
    corners.extend(polytope.vertices().iter().map(|&p| {
        let found = known.binary_search_by(|&v| order(&place(v), &key(p)));
        found.map_or(NONE, |k| known[k])
    }));
}

/// Returns the vectors from each mesh vertex to its neighbours, in ascending order of the
/// neighbours, as two flat arrays: the start of each vertex's entries, and all entries.
fn edges_of(mesh: &Mesh) -> (Vec<u32>, Vec<DVec3>) {
    let sides = || mesh.triangles().iter().flat_map(|t| (0..3).map(move |k| (t[k], t[(k + 1) % 3])));
    // Does a counting sort of the two ends of each side. A neighbour occurs once for each side that
    // leads to it.
    let mut next = vec![0_u32; mesh.vertices().len() + 1];
    for (v, w) in sides() {
        next[v as usize + 1] += 1;
        next[w as usize + 1] += 1;
    }
    for v in 0..mesh.vertices().len() {
        next[v + 1] += next[v];
    }
    let mut ring = vec![0_u32; 6 * mesh.triangles().len()];
    let mut begins = next.clone();
    for (v, w) in sides() {
        for (at, other) in [(v, w), (w, v)] {
            ring[begins[at as usize] as usize] = other;
            begins[at as usize] += 1;
        }
    }
    let mut starts = Vec::with_capacity(next.len());
    starts.push(0);
    // In a closed mesh, each edge has two sides.
    let mut edges = Vec::with_capacity(ring.len() / 2);
    for (v, ends) in next.windows(2).enumerate() {
        let (from, to) = (ends[0] as usize, ends[1] as usize);
        ring[from..to].sort_unstable();
        let neighbours = ring[from..to].chunk_by(|w, x| w == x).map(|same| mesh.vertices()[same[0] as usize]);
        edges.extend(neighbours.map(|neighbour| neighbour - mesh.vertices()[v]));
        starts.push(edges.len() as u32);
    }
    edges.shrink_to_fit();
    (starts, edges)
}
