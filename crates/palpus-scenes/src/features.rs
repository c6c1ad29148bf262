//! Finds all contacts of two polyhedra by testing every pair of features, without pieces, hulls,
//! fronts or cached results.
//!
//! A pair is a vertex of one mesh and a face of the other, or two edges. A pair is a contact if
//!
//! 1. its direction is the face's normal, or perpendicular to both edges,
//! 2. near the pair, each body's surface lies on its own side of the plane perpendicular to this
//!    direction, so no other points nearby are nearer to each other,
//! 3. the two points lie within the face, or within both edges,
//! 4. between the points there is only air if the bodies are apart. If they overlap, there is
//!    material of the entered body, or for two edges, material of both bodies.
//!
//! If a vertex is inside the other body, only the contact with the nearest face counts.
//!
//! The contacts are checked: the probe is moved by the shortest translation that ends all contacts,
//! and the edges of both bodies are sampled there. If an edge is still far inside the other body,
//! the result is `None`. Sometimes a shorter translation, which ends only one contact, also
//! separates the bodies. If the shorter translation is at most half as long, the contacts that
//! remain after it are dropped, because they belong to another side. Otherwise the result is
//! `None`.

#[cfg(test)]
mod tests;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::{Mesh, PolygonSoup, TriangleTree};

use crate::truth::TrueContact;

/// Tolerance of the test whether a direction points above or below a plane, as a cosine to the
/// plane's normal.
const LEVEL: f64 = 1e-6;
/// The same tolerance for corners that may become contacts after a small rotation: 6°.
const NEARLY_LEVEL: f64 = 0.1;
/// Two edges are parallel, and two normals are equal, if the sine of their angle is below this.
const PARALLEL: f64 = 1e-6;
/// Allowed distance of a point outside a face or an edge, relative to its size.
const OUTSIDE: f64 = 1e-9;

/// Overlap that may remain after the contacts have ended: this length (m) plus the fraction
/// [`SLACK_SHARE`] of the deepest contact. The fraction is needed because no translation frees a
/// tilted part between two walls.
const SLACK: f64 = 30e-6;
const SLACK_SHARE: f64 = 0.5;
/// The translation that ends a single contact is compared with the translation that ends all
/// contacts. The two translations count as different if the ratio of their lengths and the cosine
/// between them are below [`SHORTER`]. The shorter translation is the right one if the ratio is at
/// most [`MUCH_SHORTER`].
const SHORTER: f64 = 0.9;
const MUCH_SHORTER: f64 = 0.5;
/// Distance between samples along an edge, m.
const SPACING: f64 = 0.5e-3;
/// Number of rounds of the search for the shortest translation.
const SWEEPS: usize = 100;

/// Distance by which a point between two edges is moved into a body, relative to the separation.
const INWARD: f64 = 1e-3;

/// Two polyhedra.
#[derive(Debug)]
pub(crate) struct Features {
    a: Polyhedron,
    b: Polyhedron,
    /// Thickness of the thinnest wall, m. For a contact deeper than half of this thickness, the
    /// nearest surface may be on the other side of the wall.
    wall: f64,
}

#[derive(Debug)]
struct Polyhedron {
    faces: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    /// The vertices of convex edges, each with its range in `spokes`.
    corners: Vec<(u32, std::ops::Range<usize>)>,
    placed: Placed,
    tree: TriangleTree,
}

/// The vectors of a polyhedron in one frame.
#[derive(Clone, Debug)]
struct Placed {
    vertices: Vec<DVec3>,
    /// Unit normals of the faces.
    normals: Vec<DVec3>,
    /// For each edge, the two unit vectors perpendicular to the edge that point into its two faces.
    into: Vec<[DVec3; 2]>,
    /// Unit vectors from each corner to its neighbours.
    spokes: Vec<DVec3>,
}

impl Placed {
    fn at(&self, pose: &Pose) -> Self {
        let turned = |list: &[DVec3]| list.iter().map(|&v| pose.vector(v)).collect();
        Self {
            vertices: self.vertices.iter().map(|&v| pose.point(v)).collect(),
            normals: turned(&self.normals),
            into: self.into.iter().map(|into| into.map(|v| pose.vector(v))).collect(),
            spokes: turned(&self.spokes),
        }
    }
}

impl Polyhedron {
    fn new(soup: &PolygonSoup) -> Option<Self> {
        let (mesh, _) = Mesh::from_soup(soup).ok()?;
        let vertices = mesh.vertices().to_vec();
        let faces = mesh.triangles().to_vec();
        let normals: Vec<DVec3> = (0..faces.len() as u32).map(|t| mesh.triangle_normal(t)).collect();
        // Half edges with their sorted ends. Each edge of a closed mesh has two half edges.
        let mut halves: Vec<([u32; 2], u32, u32)> = Vec::new();
        for (t, &[a, b, c]) in (0u32..).zip(&faces) {
            for (from, to, third) in [(a, b, c), (b, c, a), (c, a, b)] {
                halves.push(([from.min(to), from.max(to)], third, t));
            }
        }
        halves.sort_unstable();
        let at = |v: u32| vertices[v as usize];
        let (mut edges, mut into) = (Vec::new(), Vec::new());
        for pair in halves.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            let ends = pair[0].0;
            let along = (at(ends[1]) - at(ends[0])).normalize();
            let inward = [pair[0].1, pair[1].1].map(|third| (at(third) - at(ends[0])).reject_from(along).normalize());
            // The edge is convex if each face falls off below the plane of the other face.
            if inward[1].dot(normals[pair[0].2 as usize]) < -PARALLEL {
                edges.push(ends);
                into.push(inward);
            }
        }
        let mut neighbours = vec![Vec::new(); vertices.len()];
        for (ends, ..) in &halves {
            neighbours[ends[0] as usize].push(ends[1]);
            neighbours[ends[1] as usize].push(ends[0]);
        }
        let mut is_corner = vec![false; vertices.len()];
        edges.iter().flatten().for_each(|&v| is_corner[v as usize] = true);
        let (mut corners, mut spokes) = (Vec::new(), Vec::new());
        for (v, others) in (0u32..).zip(&mut neighbours) {
            others.sort_unstable();
            others.dedup();
            if is_corner[v as usize] {
                let first = spokes.len();
                spokes.extend(others.iter().map(|&other| (at(other) - at(v)).normalize()));
                corners.push((v, first..spokes.len()));
            }
        }
        Some(Self { faces, edges, corners, placed: Placed { vertices, normals, into, spokes }, tree: mesh.tree() })
    }

    /// Returns true if some point of an edge of `other`, placed by `pose`, is deeper than `depth`
    /// (m) inside this body.
    fn is_entered(&self, other: &Self, pose: &Pose, depth: f64) -> bool {
        let at = |v: u32| pose.point(other.placed.vertices[v as usize]);
        other.edges.iter().any(|&[from, to]| {
            let (from, to) = (at(from), at(to));
            let parts = (from.distance(to) / SPACING).ceil().max(1.0) as usize;
            (0..=parts)
                .map(|k| from.lerp(to, k as f64 / parts as f64))
                .any(|p| self.contains(p) && self.tree.nearest(p).is_some_and(|near| near.distance > depth))
        })
    }

    fn contains(&self, p: DVec3) -> bool {
        self.tree.bounds().holds(p) && self.tree.inside(p)
    }
}

/// A polyhedron in the frame of the search.
#[derive(Clone, Copy)]
struct Side<'a> {
    shape: &'a Polyhedron,
    placed: &'a Placed,
}

/// A feature's bounding box, enlarged by the reach of the search.
#[derive(Clone, Copy)]
struct Near {
    low: DVec3,
    high: DVec3,
}

impl Near {
    fn around(points: impl IntoIterator<Item = DVec3>, by: f64) -> Self {
        let (low, high) =
            points.into_iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        Self { low: low - by, high: high + by }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

impl Features {
    /// Returns the features of two closed meshes. `wall` is the thickness of the thinnest wall that
    /// contacts enter, m. `None` if a mesh is invalid.
    pub(crate) fn new(probe: &PolygonSoup, environment: &PolygonSoup, wall: f64) -> Option<Self> {
        Some(Self { a: Polyhedron::new(probe)?, b: Polyhedron::new(environment)?, wall })
    }

    /// Returns the contacts with a separation below `reach` (m). `None` in three cases: a contact
    /// is deeper than half a wall; the contacts do not explain the overlap; two translations that
    /// separate the bodies are about equally short.
    pub(crate) fn contacts(&self, pose_ba: &Pose, reach: f64) -> Option<Vec<TrueContact>> {
        let mut found = self.found(pose_ba, &(-self.wall..reach), LEVEL);
        let deepest = found.iter().map(|contact| -contact.separation).fold(0.0, f64::max);
        let is_free = |way: DVec3, left: f64| {
            let moved = Pose { translation: pose_ba.translation + way, ..*pose_ba };
            !self.b.is_entered(&self.a, &moved, left) && !self.a.is_entered(&self.b, &moved.inverse(), left)
        };
        let way = way_out(&found);
        if !is_free(way, SLACK + SLACK_SHARE * deepest) {
            return None;
        }
        let single = |contact: &TrueContact| {
            let own = contact.normal * -contact.separation;
            let aside = contact.separation < -SLACK && contact.normal.dot(way) < SHORTER * way.length();
            (aside && own.length() < SHORTER * way.length() && is_free(own, SLACK)).then_some(own)
        };
        let shorter = found.iter().filter_map(single).min_by(|a, b| a.length().total_cmp(&b.length()));
        if let Some(own) = shorter {
            if own.length() > MUCH_SHORTER * way.length() {
                return None;
            }
            found.retain(|contact| contact.separation + contact.normal.dot(own) >= -SLACK);
        }
        found.iter().all(|contact| contact.separation >= -0.5 * self.wall).then_some(found)
    }

    /// Returns the contacts that the probe may get after a motion of less than `reach` (m). The
    /// corners include those that are the lowest of their neighbourhood only after a small
    /// rotation.
    pub(crate) fn supports(&self, pose_ba: &Pose, reach: f64) -> Vec<TrueContact> {
        self.found(pose_ba, &(-reach..reach), NEARLY_LEVEL)
    }

    /// Returns the contacts whose separation is in `range` (m), before any check. `level` is the
    /// tolerance of the test for corners whether a direction points above or below a face.
    fn found(&self, pose_ba: &Pose, range: &std::ops::Range<f64>, level: f64) -> Vec<TrueContact> {
        let placed = self.a.placed.at(pose_ba);
        let (a, b) = (Side { shape: &self.a, placed: &placed }, Side { shape: &self.b, placed: &self.b.placed });
        let to_a = pose_ba.inverse();
        let in_a = |p: DVec3| self.a.contains(to_a.point(p));
        let in_b = |p: DVec3| self.b.contains(p);
        let in_air = |p: DVec3| !in_a(p) && !in_b(p);
        let mut found = corners_on_faces(a, b, range, level, |p, is_deep| if is_deep { in_b(p) } else { in_air(p) });
        let corners_of_b = corners_on_faces(b, a, range, level, |p, is_deep| if is_deep { in_a(p) } else { in_air(p) });
        // Normals point from the environment to the probe.
        found.extend(corners_of_b.into_iter().map(|contact| TrueContact { normal: -contact.normal, ..contact }));
        found.extend(edges_on_edges(a, b, range, |[own, other], is_deep| match is_deep {
            true => in_a(own) && in_b(other),
            false => in_air(own),
        }));
        found
    }
}

/// Returns the shortest translation that ends all overlaps of `contacts`. If no such translation
/// exists, returns a translation that nearly ends them.
fn way_out(contacts: &[TrueContact]) -> DVec3 {
    let mut way = DVec3::ZERO;
    let mut pushes = vec![0.0; contacts.len()];
    for _ in 0..SWEEPS {
        for (contact, push) in contacts.iter().zip(&mut pushes) {
            let gap = contact.separation + contact.normal.dot(way);
            let next = (*push - gap).max(0.0);
            way += contact.normal * (next - *push);
            *push = next;
        }
    }
    way
}

/// Returns the contacts of corners of `own` with faces of `other`, each with its normal from
/// `other` to `own`. `joins` gets the middle of the two points of a contact, and true if the
/// contact is an overlap. `joins` returns true if there is material at the middle of an overlap, or
/// air at the middle of a gap.
fn corners_on_faces(
    own: Side<'_>,
    other: Side<'_>,
    range: &std::ops::Range<f64>,
    level: f64,
    joins: impl Fn(DVec3, bool) -> bool,
) -> Vec<TrueContact> {
    let by = range.end.max(-range.start);
    let at = |v: u32| other.placed.vertices[v as usize];
    let boxes: Vec<Near> = other.shape.faces.iter().map(|face| Near::around(face.map(at), by)).collect();
    let all = Near::around(other.placed.vertices.iter().copied(), by);
    let is_one = |contact: &TrueContact, normal: DVec3| contact.normal.cross(normal).length() < PARALLEL;
    let mut found: Vec<TrueContact> = Vec::new();
    for (vertex, spokes) in &own.shape.corners {
        let p = own.placed.vertices[*vertex as usize];
        let point = Near { low: p, high: p };
        if !all.meets(&point) {
            continue;
        }
        let spokes = &own.placed.spokes[spokes.clone()];
        let first = found.len();
        for (k, face) in other.shape.faces.iter().enumerate().filter(|&(k, _)| boxes[k].meets(&point)) {
            let normal = other.placed.normals[k];
            let separation = normal.dot(p - at(face[0]));
            let foot = p - normal * separation;
            if range.contains(&separation)
                && spokes.iter().all(|spoke| spoke.dot(normal) >= -level)
                && is_within(foot, face.map(at), normal)
                // Coplanar triangles give one contact.
                && !found[first..].iter().any(|contact| is_one(contact, normal))
                && joins(0.5 * (p + foot), separation < 0.0)
            {
                found.push(TrueContact { point: Some(foot), normal, separation });
            }
        }
        // If the corner is inside the other body, only the nearest face counts.
        let nearest = found[first..].iter().map(|contact| contact.separation).fold(f64::NEG_INFINITY, f64::max);
        let mut k = first;
        while k < found.len() {
            if found[k].separation < 0.0 && found[k].separation < nearest - OUTSIDE {
                found.swap_remove(k);
            } else {
                k += 1;
            }
        }
    }
    found
}

/// Returns true if `p`, which lies in the plane of a triangle, lies in the triangle.
fn is_within(p: DVec3, corners: [DVec3; 3], normal: DVec3) -> bool {
    (0..3).all(|k| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        normal.cross(to - from).dot(p - from) >= -OUTSIDE * (to - from).length()
    })
}

/// Returns the contacts of convex edges. `joins` gets the middle of the two points twice, moved a
/// little into each body, because both bodies may have a face there.
fn edges_on_edges(
    a: Side<'_>,
    b: Side<'_>,
    range: &std::ops::Range<f64>,
    joins: impl Fn([DVec3; 2], bool) -> bool,
) -> Vec<TrueContact> {
    let by = range.end.max(-range.start);
    let ends = |side: &Side<'_>, edge: &[u32; 2]| edge.map(|v| side.placed.vertices[v as usize]);
    let all = Near::around(b.placed.vertices.iter().copied(), by);
    let boxes: Vec<Near> = b.shape.edges.iter().map(|edge| Near::around(ends(&b, edge), by)).collect();
    let mut found = Vec::new();
    for (i, edge) in a.shape.edges.iter().enumerate() {
        let [p, q] = ends(&a, edge);
        let own = Near::around([p, q], 0.0);
        if !all.meets(&own) {
            continue;
        }
        for (j, other) in b.shape.edges.iter().enumerate().filter(|&(j, _)| boxes[j].meets(&own)) {
            let [r, s] = ends(&b, other);
            let (u, v) = (q - p, s - r);
            let across = u.cross(v);
            if across.length() < PARALLEL * u.length() * v.length() {
                continue;
            }
            let is_between = |normal: DVec3| {
                a.placed.into[i].iter().all(|into| into.dot(normal) >= -LEVEL)
                    && b.placed.into[j].iter().all(|into| into.dot(normal) <= LEVEL)
            };
            let unit = across.normalize();
            let Some(normal) = [unit, -unit].into_iter().find(|normal| is_between(*normal)) else { continue };
            let square = across.length_squared();
            let along_a = (r - p).cross(v).dot(across) / square;
            let along_b = (r - p).cross(u).dot(across) / square;
            let inside = -OUTSIDE..=1.0 + OUTSIDE;
            if !(inside.contains(&along_a) && inside.contains(&along_b)) {
                continue;
            }
            let (on_a, on_b) = (p + u * along_a, r + v * along_b);
            let separation = normal.dot(on_a - on_b);
            let aside = INWARD * separation.abs();
            let moved = |into: [DVec3; 2]| 0.5 * (on_a + on_b) + (into[0] + into[1]) * aside;
            let middles = [moved(a.placed.into[i]), moved(b.placed.into[j])];
            if range.contains(&separation) && joins(middles, separation < 0.0) {
                found.push(TrueContact { point: Some(on_b), normal, separation });
            }
        }
    }
    found
}
