//! The parts of a body as bytes: what follows from the rest (rings, edges, rims) is left out and made again.
//!
//! 1. The table of all vertices; polytopes name its entries.
//! 2. Batches of pieces, then of inner hulls; each batch says how long it is, so that all hands can read at once.
//! 3. The nodes of the tree.

use std::collections::HashMap;
use std::io;

use glam::{DMat3, DVec3};
use palpus::algebra::{Plane, Workers, map_in_order};
use palpus::body::{Body, BodyParts, Hierarchy, NodeKind, OrientedBox, Piece, Polytope, Provenance, Sphere};

use super::bytes::{Reader, Writer};

/// Polytopes of one batch.
const BATCH: usize = 256;
/// Bytes of a node's bounds.
const BOUNDS_BYTES: usize = 8 * (4 + 15);

/// Gives the parts of a body to `sink`, a little at a time, to be read by [`decode`].
pub(super) fn encode(body: &Body, sink: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
    let (polytopes, pieces) = (body.polytopes(), body.pieces());
    let hulls = body.hierarchy().hulls();
    let table = Table::of(polytopes.iter().chain(hulls));
    let mut out = Writer::default();
    out.count(table.points.len());
    table.points.iter().for_each(|&point| out.vector(point));
    out.count(pieces.len());
    out.flush(sink)?;
    for (polytopes, pieces) in polytopes.chunks(BATCH).zip(pieces.chunks(BATCH)) {
        for (polytope, piece) in polytopes.iter().zip(pieces) {
            write_polytope(&mut out, polytope, &table);
            write_piece(&mut out, piece, polytope.face_count());
        }
        out.flush_with_length(sink)?;
    }
    out.count(hulls.len());
    out.flush(sink)?;
    for hulls in hulls.chunks(BATCH) {
        hulls.iter().for_each(|hull| write_polytope(&mut out, hull, &table));
        out.flush_with_length(sink)?;
    }
    write_nodes(&mut out, body.hierarchy());
    out.flush(sink)
}

/// The parts that [`encode`] wrote; `None` for any other bytes.
pub(super) fn decode(bytes: &[u8], workers: &dyn Workers) -> Option<BodyParts> {
    let mut from = Reader { rest: bytes };
    let table: Vec<DVec3> = (0..from.count(24)?).map(|_| from.vector()).collect::<Option<_>>()?;
    let piece = |from: &mut Reader<'_>| {
        let polytope = read_polytope(from, &table)?;
        let piece = read_piece(from, polytope.face_count())?;
        Some((polytope, piece))
    };
    let pieces: Vec<(Polytope, Piece)> = read_batches(&mut from, workers, piece)?;
    let hulls = read_batches(&mut from, workers, |from| read_polytope(from, &table))?;
    let hierarchy = read_nodes(&mut from, hulls, pieces.len())?;
    let (polytopes, pieces) = pieces.into_iter().unzip();
    from.rest.is_empty().then_some(BodyParts { polytopes, pieces, hierarchy })
}

/// Each vertex once.
#[derive(Default)]
struct Table {
    points: Vec<DVec3>,
    places: HashMap<[u64; 3], u32>,
}

impl Table {
    fn of<'a>(polytopes: impl Iterator<Item = &'a Polytope>) -> Self {
        let mut table = Self::default();
        for &point in polytopes.flat_map(Polytope::vertices) {
            table.places.entry(Self::bits(point)).or_insert_with(|| {
                table.points.push(point);
                table.points.len() as u32 - 1
            });
        }
        table
    }

    fn bits(point: DVec3) -> [u64; 3] {
        point.to_array().map(f64::to_bits)
    }

    fn place(&self, point: DVec3) -> u32 {
        self.places[&Self::bits(point)]
    }
}

/// Reads a count and the batches of so many things.
fn read_batches<T: Send + Sync>(
    from: &mut Reader<'_>,
    workers: &dyn Workers,
    read: impl Fn(&mut Reader<'_>) -> Option<T> + Sync,
) -> Option<Vec<T>> {
    let count = from.count(1)?;
    let mut batches = Vec::new();
    for _ in 0..count.div_ceil(BATCH) {
        let length = from.count(1)?;
        batches.push(Reader { rest: from.take(length)? });
    }
    let of_batch = |k: usize| -> Option<Vec<T>> {
        let mut from = batches[k];
        let things = (0..BATCH.min(count - k * BATCH)).map(|_| read(&mut from)).collect::<Option<Vec<T>>>()?;
        from.rest.is_empty().then_some(things)
    };
    let mut all = Vec::with_capacity(count);
    for things in map_in_order(workers, batches.len(), 1, of_batch, &mut |_| ()) {
        all.extend(things?);
    }
    Some(all)
}

/// The vertices, then of a plate the front's normal and which of front and back are original, of a solid each face.
fn write_polytope(out: &mut Writer, polytope: &Polytope, table: &Table) {
    out.count(polytope.vertices().len());
    for &vertex in polytope.vertices() {
        out.whole(u64::from(table.place(vertex)));
    }
    let original = |f: u32| u64::from(polytope.face_provenance(f) == Provenance::Original);
    if polytope.is_flat() {
        out.whole(0);
        out.vector(polytope.plane(0).normal);
        out.whole(original(0) | original(1) << 1);
        return;
    }
    out.count(polytope.face_count());
    for f in 0..polytope.face_count() as u32 {
        let corners = polytope.face_vertices(f);
        out.whole((corners.len() as u64) << 1 | original(f));
        corners.iter().for_each(|v| out.whole(u64::from(v)));
        let Plane { normal, offset } = polytope.plane(f);
        out.vector(normal);
        out.real(offset);
    }
}

fn read_polytope(from: &mut Reader<'_>, table: &[DVec3]) -> Option<Polytope> {
    let count = from.count(1)?;
    let vertices = (0..count).map(|_| table.get(from.index()? as usize).copied()).collect::<Option<Vec<DVec3>>>()?;
    let provenance = |original: bool| if original { Provenance::Original } else { Provenance::Virtual };
    // A face takes its number of corners, three of them, and its plane.
    let faces = from.count(4 + 32)?;
    if faces == 0 {
        let normal = from.vector()?;
        let original = from.whole()?;
        let plate = Polytope::from_polygon(vertices, normal, Provenance::Virtual).ok()?;
        return Some(plate.with_provenance(|_, f| provenance(original >> f & 1 == 1)));
    }
    let mut loop_starts = Vec::with_capacity(faces + 1);
    loop_starts.push(0);
    // A closed surface has at most three times as many edges as vertices, and two corners an edge.
    let mut loop_vertices = Vec::with_capacity(6 * count);
    let mut planes = Vec::with_capacity(faces);
    let mut provenances = Vec::with_capacity(faces);
    for _ in 0..faces {
        let head = from.whole()?;
        for _ in 0..head >> 1 {
            loop_vertices.push(from.index()?);
        }
        loop_starts.push(u32::try_from(loop_vertices.len()).ok()?);
        planes.push(Plane { normal: from.vector()?, offset: from.real()? });
        provenances.push(provenance(head & 1 == 1));
    }
    loop_vertices.shrink_to_fit();
    Polytope::from_loops(vertices, loop_starts, loop_vertices, planes, provenances).ok()
}

/// The triangles, and of each face how many lie in it and which (by their places among the triangles).
fn write_piece(out: &mut Writer, piece: &Piece, face_count: usize) {
    let triangles = piece.triangles();
    out.count(triangles.len());
    triangles.iter().for_each(|&t| out.whole(u64::from(t)));
    for f in 0..face_count as u32 {
        let inside = piece.face_triangles(f);
        out.count(inside.len());
        for t in inside {
            // Triangles are sorted, and those of the faces are among them.
            out.count(triangles.partition_point(|other| other < t));
        }
    }
}

fn read_piece(from: &mut Reader<'_>, face_count: usize) -> Option<Piece> {
    let count = from.count(1)?;
    let triangles = (0..count).map(|_| from.index()).collect::<Option<Vec<u32>>>()?;
    let mut face_starts = Vec::with_capacity(face_count + 1);
    face_starts.push(0);
    let mut face_triangles = Vec::with_capacity(count);
    for _ in 0..face_count {
        for _ in 0..from.count(1)? {
            face_triangles.push(*triangles.get(from.index()? as usize)?);
        }
        face_starts.push(u32::try_from(face_triangles.len()).ok()?);
    }
    Some(Piece::from_parts(&triangles, &face_starts, &face_triangles))
}

/// A leaf is twice its piece; an inner node is one more than twice its left child, then its right child.
fn write_nodes(out: &mut Writer, hierarchy: &Hierarchy) {
    out.count(hierarchy.nodes().len());
    for node in hierarchy.nodes() {
        match node.kind {
            NodeKind::Leaf { piece } => out.whole(u64::from(piece) << 1),
            NodeKind::Inner { left, right } => {
                out.whole(u64::from(left) << 1 | 1);
                out.whole(u64::from(right));
            }
        }
        out.vector(node.sphere.center);
        out.real(node.sphere.radius);
        let OrientedBox { center, axes, half } = node.oriented_box;
        [center, axes.x_axis, axes.y_axis, axes.z_axis, half].into_iter().for_each(|v| out.vector(v));
    }
}

fn read_nodes(from: &mut Reader<'_>, hulls: Vec<Polytope>, pieces: usize) -> Option<Hierarchy> {
    let count = from.count(1 + BOUNDS_BYTES)?;
    let mut nodes = Vec::with_capacity(count);
    for _ in 0..count {
        let head = from.whole()?;
        let first = u32::try_from(head >> 1).ok()?;
        let kind = match head & 1 {
            0 => NodeKind::Leaf { piece: first },
            _ => NodeKind::Inner { left: first, right: from.index()? },
        };
        let sphere = Sphere { center: from.vector()?, radius: from.real()? };
        let center = from.vector()?;
        let axes = DMat3::from_cols(from.vector()?, from.vector()?, from.vector()?);
        let half = from.vector()?;
        let finite = sphere.center.is_finite() && sphere.radius.is_finite() && center.is_finite();
        if !(finite && axes.is_finite() && half.is_finite()) {
            return None;
        }
        nodes.push((kind, sphere, OrientedBox { center, axes, half }));
    }
    Hierarchy::from_parts(nodes, hulls, pieces)
}
