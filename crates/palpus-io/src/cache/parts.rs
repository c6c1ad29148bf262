//! Converts the parts of a body to bytes and back. Derived data (rings, ends of edges, rims) is not
//! stored but computed again.
//!
//! 1. The head: the table of all vertices, to which polytopes refer by index, and the numbers of
//!    pieces and inner hulls.
//! 2. Batches of pieces, of inner hulls and of tree nodes. Several threads can read batches at the
//!    same time.
//!
//! A solid polytope is stored as its vertices, the corners of each face, the planes and the bulge.
//! A corner consists of a vertex and a flag that says whether the edge that starts there occurred
//! in an earlier face. If the flag is set, the number of that edge follows. Edges are numbered in
//! the order of their first occurrence.

use std::collections::HashMap;
use std::io;

use glam::{DMat3, DVec3};
use palpus::algebra::{Plane, Workers, map_in_order};
use palpus::body::{
    Body, BodyParts, Hierarchy, Node, NodeKind, OrientedBox, Piece, Polytope, PolytopeRestorer, Provenance, Sphere,
};

use super::bytes::{Reader, Writer};

/// Largest number of polytopes in one batch.
const BATCH: usize = 256;
/// Largest number of tree nodes in one batch.
const NODE_BATCH: usize = 2048;
/// Size of the bounds of a node, in bytes.
const BOUNDS_BYTES: usize = 8 * (4 + 15);
/// Size of a point, in bytes.
const POINT_BYTES: usize = 3 * 8;
/// Size of a plane, in bytes.
const PLANE_BYTES: usize = 4 * 8;

/// A node in the form that the tree takes.
type KeptNode = (NodeKind, Sphere, OrientedBox);

/// Passes the parts of a body to `sink` in batches, which [`decode`] reads.
pub(super) fn encode(body: &Body, sink: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
    let (polytopes, pieces) = (body.polytopes(), body.pieces());
    let hulls = body.hierarchy().hulls();
    let table = Table::of(polytopes.iter().chain(hulls));
    let mut out = Writer::default();
    out.count(table.points.len());
    table.points.iter().for_each(|&point| out.vector(point));
    out.count(pieces.len());
    out.count(hulls.len());
    out.flush(sink)?;
    for (polytopes, pieces) in polytopes.chunks(BATCH).zip(pieces.chunks(BATCH)) {
        for (polytope, piece) in polytopes.iter().zip(pieces) {
            write_polytope(&mut out, polytope, &table);
            write_piece(&mut out, piece, polytope.face_count());
        }
        out.flush(sink)?;
    }
    for hulls in hulls.chunks(BATCH) {
        hulls.iter().for_each(|hull| write_polytope(&mut out, hull, &table));
        out.flush(sink)?;
    }
    for nodes in body.hierarchy().nodes().chunks(NODE_BATCH) {
        nodes.iter().for_each(|node| write_node(&mut out, node));
        out.flush(sink)?;
    }
    Ok(())
}

/// Content of one batch.
enum Batch {
    Pieces(Vec<Polytope>, Vec<Piece>),
    Hulls(Vec<Polytope>),
    Nodes(Vec<KeptNode>),
}

/// Returns the parts that [`encode`] wrote; `None` if the bytes are invalid.
///
/// `with_batch` passes the bytes of a batch to its reader and returns the reader's result or the
/// reason of a failure.
pub(super) fn decode<E: Send + Sync>(
    batches: usize,
    with_batch: impl Fn(usize, &mut dyn FnMut(&[u8])) -> Result<(), E> + Sync,
    workers: &dyn Workers,
) -> Result<Option<BodyParts>, E> {
    let mut head = None;
    if batches > 0 {
        with_batch(0, &mut |bytes| head = read_head(bytes))?;
    }
    let Some((table, pieces, hulls)) = head else { return Ok(None) };
    let nodes = pieces + hulls;
    let of_kinds = [pieces.div_ceil(BATCH), hulls.div_ceil(BATCH), nodes.div_ceil(NODE_BATCH)];
    if batches != 1 + of_kinds.iter().sum::<usize>() {
        return Ok(None);
    }
    let read = |k: usize| -> Result<Option<Batch>, E> {
        let mut batch = None;
        with_batch(1 + k, &mut |bytes| {
            let mut from = Reader { rest: bytes };
            let made = if k < of_kinds[0] {
                read_pieces(&mut from, &table, BATCH.min(pieces - k * BATCH))
            } else if k < of_kinds[0] + of_kinds[1] {
                read_hulls(&mut from, &table, BATCH.min(hulls - (k - of_kinds[0]) * BATCH))
            } else {
                let first = (k - of_kinds[0] - of_kinds[1]) * NODE_BATCH;
                read_nodes(&mut from, NODE_BATCH.min(nodes - first))
            };
            batch = made.filter(|_| from.rest.is_empty());
        })?;
        Ok(batch)
    };
    let all =
        map_in_order(workers, batches - 1, 1, read, &mut |_| ()).into_iter().collect::<Result<Option<Vec<_>>, E>>()?;
    Ok(all.and_then(|all| joined(all, pieces, hulls)))
}

fn joined(batches: Vec<Batch>, piece_count: usize, hull_count: usize) -> Option<BodyParts> {
    let (mut polytopes, mut pieces) = (Vec::with_capacity(piece_count), Vec::with_capacity(piece_count));
    let mut hulls = Vec::with_capacity(hull_count);
    let mut nodes = Vec::new();
    for batch in batches {
        match batch {
            Batch::Pieces(some_polytopes, some_pieces) => {
                polytopes.extend(some_polytopes);
                pieces.extend(some_pieces);
            }
            Batch::Hulls(some) => hulls.extend(some),
            Batch::Nodes(some) => nodes.push(some),
        }
    }
    let hierarchy = Hierarchy::from_parts(nodes.into_iter().flatten(), hulls, &polytopes)?;
    Some(BodyParts { polytopes, pieces, hierarchy })
}

/// Returns the vertex table and the numbers of pieces and hulls.
fn read_head(bytes: &[u8]) -> Option<(Vec<DVec3>, usize, usize)> {
    let mut from = Reader { rest: bytes };
    let count = from.count(POINT_BYTES)?;
    let (points, _) = from.take(count * POINT_BYTES)?.as_chunks::<POINT_BYTES>();
    let table = points.iter().map(|bytes| Reader { rest: bytes }.vector()).collect::<Option<_>>()?;
    let (pieces, hulls) = (from.index()? as usize, from.index()? as usize);
    from.rest.is_empty().then_some((table, pieces, hulls))
}

fn read_pieces(from: &mut Reader<'_>, table: &[DVec3], count: usize) -> Option<Batch> {
    let (mut polytopes, mut pieces) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let (mut restorer, mut lists) = (PolytopeRestorer::default(), PieceLists::default());
    for _ in 0..count {
        let polytope = read_polytope(from, table, &mut restorer)?;
        pieces.push(lists.read(from, polytope.face_count())?);
        polytopes.push(polytope);
    }
    Some(Batch::Pieces(polytopes, pieces))
}

fn read_hulls(from: &mut Reader<'_>, table: &[DVec3], count: usize) -> Option<Batch> {
    let mut restorer = PolytopeRestorer::default();
    let hulls = (0..count).map(|_| read_polytope(from, table, &mut restorer));
    let mut answer = Vec::with_capacity(count);
    for hull in hulls {
        answer.push(hull?);
    }
    Some(Batch::Hulls(answer))
}

/// A table of vertices without duplicates.
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

/// Writes the vertices. For a plate, the normal of its front follows, and a number that
/// says whether the front or the back is original. For a solid, its faces follow.
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
    let mut met = 0;
    for f in 0..polytope.face_count() as u32 {
        let corners = polytope.face_vertices(f);
        out.whole((corners.len() as u64) << 1 | original(f));
        for (v, e) in corners.iter().zip(polytope.face_edges(f)) {
            let again = e < met;
            out.whole(u64::from(v) << 1 | u64::from(again));
            if again {
                out.whole(u64::from(e));
            } else {
                met += 1;
            }
        }
    }
    for plane in polytope.planes() {
        out.vector(plane.normal);
        out.real(plane.offset);
    }
    out.real(polytope.bulge());
}

fn read_polytope(from: &mut Reader<'_>, table: &[DVec3], restorer: &mut PolytopeRestorer) -> Option<Polytope> {
    let count = from.count(1)?;
    let mut vertices = Vec::with_capacity(count);
    for _ in 0..count {
        vertices.push(*table.get(from.index()? as usize)?);
    }
    // Each face needs at least its number of corners (1 byte), three corners (1 byte each), and its
    // plane.
    let faces = from.count(4 + PLANE_BYTES)?;
    if faces == 0 {
        return read_plate(from, vertices);
    }
    restorer.begin(count);
    for _ in 0..faces {
        let head = from.whole()?;
        for _ in 0..head >> 1 {
            let corner = from.index()?;
            let edge = if corner & 1 == 1 { Some(from.index()?) } else { None };
            restorer.corner(corner >> 1, edge);
        }
        restorer.end_face(head & 1 == 1)?;
    }
    let (bytes, _) = from.take(faces * PLANE_BYTES)?.as_chunks::<PLANE_BYTES>();
    let mut planes = Vec::with_capacity(faces);
    for bytes in bytes {
        let mut from = Reader { rest: bytes };
        planes.push(Plane { normal: from.vector()?, offset: from.real()? });
    }
    restorer.finish(vertices, planes, from.real()?)
}

fn read_plate(from: &mut Reader<'_>, vertices: Vec<DVec3>) -> Option<Polytope> {
    let normal = from.vector()?;
    let original = from.whole()?;
    let provenance = |original: bool| if original { Provenance::Original } else { Provenance::Virtual };
    let plate = Polytope::from_polygon(vertices, normal, Provenance::Virtual).ok()?;
    let plate = plate.with_provenance(|_, f| provenance(original >> f & 1 == 1));
    plate.validate_topology().is_ok().then_some(plate)
}

/// Writes the triangles (each as the difference from the previous triangle) and then, for each
/// face, the number of its triangles and their positions in that list.
fn write_piece(out: &mut Writer, piece: &Piece, face_count: usize) {
    let triangles = piece.triangles();
    out.count(triangles.len());
    let mut last = 0;
    for &t in triangles {
        // The difference is not negative, because triangles are sorted.
        out.whole(u64::from(t - last));
        last = t;
    }
    for f in 0..face_count as u32 {
        let inside = piece.face_triangles(f);
        out.count(inside.len());
        for t in inside {
            // This list also contains the triangles of the faces.
            out.count(triangles.partition_point(|other| other < t));
        }
    }
}

/// Buffers for the lists of a piece, reused for the next piece.
#[derive(Default)]
struct PieceLists {
    triangles: Vec<u32>,
    face_starts: Vec<u32>,
    face_triangles: Vec<u32>,
}

impl PieceLists {
    fn read(&mut self, from: &mut Reader<'_>, face_count: usize) -> Option<Piece> {
        let Self { triangles, face_starts, face_triangles } = self;
        for list in [&mut *triangles, &mut *face_starts, &mut *face_triangles] {
            list.clear();
        }
        let mut last = 0_u32;
        for _ in 0..from.count(1)? {
            last = last.checked_add(from.index()?)?;
            triangles.push(last);
        }
        face_starts.push(0);
        for _ in 0..face_count {
            for _ in 0..from.count(1)? {
                face_triangles.push(*triangles.get(from.index()? as usize)?);
            }
            face_starts.push(u32::try_from(face_triangles.len()).ok()?);
        }
        Some(Piece::from_parts(triangles, face_starts, face_triangles))
    }
}

/// Writes a leaf as twice its piece, and an inner node as twice its left child plus one, followed
/// by its right child.
fn write_node(out: &mut Writer, node: &Node) {
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

fn read_nodes(from: &mut Reader<'_>, count: usize) -> Option<Batch> {
    let mut nodes = Vec::with_capacity(count);
    for _ in 0..count {
        let head = from.whole()?;
        let first = u32::try_from(head >> 1).ok()?;
        let kind = match head & 1 {
            0 => NodeKind::Leaf { piece: first },
            _ => NodeKind::Inner { left: first, right: from.index()? },
        };
        let mut from = Reader { rest: from.take(BOUNDS_BYTES)? };
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
    Some(Batch::Nodes(nodes))
}
