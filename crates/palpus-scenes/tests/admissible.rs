//! Tests that contact normals are normals of the meshes and not of the hulls of their pieces,
//! and that this rule loses no contact.
//!
//! The oracle uses only the mesh, the normals of its triangles, and the mesh triangles of each
//! piece. Limitation: for a depth on a face or an edge, the oracle only tests whether the piece has
//! the normal. It does not test whether the triangle with this normal is near the witness point.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Placement, Pose, Random};
use palpus::body::{Body, BodySettings, EdgeKind, Feature, PolygonSoup};
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus_scenes::{Scene, scenes};

/// Largest deviation of a normal from the mesh's normals, rad. The value covers rounding of
/// coordinates in files and the engine's tolerance.
const ANGLE: f64 = 2e-3;

/// A point nearer than this counts as on a triangle, relative to the body's size.
const NEAR: f64 = 1e-6;

/// Number of poses along each scene's path.
const POSES: usize = 400;

/// Number of poses for each pair of real models.
const MODEL_POSES: usize = 300;

fn bodies(scene: &Scene, flatness: f64) -> [Arc<Body>; 2] {
    let settings = BodySettings { flatness, ..BodySettings::default() };
    let body = |soup| Body::from_soup(soup, &settings, &mut |_| ()).expect("the mesh is a valid body");
    [&scene.probe, &scene.environment].map(|soup| Arc::new(body(soup)))
}

fn poses(scene: &Scene) -> impl Iterator<Item = Pose> {
    (0..POSES).map(|k| scene.path.pose(scene.path.duration() * k as f64 / POSES as f64))
}

/// One body's side of a contact, in the body's frame.
struct Half<'b> {
    body: &'b Body,
    piece: u32,
    feature: Feature,
    point: DVec3,
    outward: DVec3,
}

fn halves<'b>(a: &'b Body, b: &'b Body, place: &Placement, contact: &Contact) -> [Half<'b>; 2] {
    let Contact { piece_a, piece_b, features, point_a, point_b, normal, .. } = *contact;
    let outward = -place.inverse_vector(normal);
    [
        Half { body: a, piece: piece_a, feature: features.a, point: place.inverse_point(point_a), outward },
        Half { body: b, piece: piece_b, feature: features.b, point: point_b, outward: normal },
    ]
}

impl<'b> Half<'b> {
    /// Returns this side with its point at a vertex of the piece.
    fn at_vertex(&self, v: u32) -> Half<'b> {
        let point = self.body.polytopes()[self.piece as usize].vertex(v);
        Half { body: self.body, piece: self.piece, feature: self.feature, point, outward: self.outward }
    }

    fn patch(&self) -> &[u32] {
        self.body.pieces()[self.piece as usize].triangles()
    }

    /// Returns true if a triangle of the piece has this normal.
    fn has_normal(&self) -> bool {
        self.patch().iter().any(|&t| self.body.mesh().triangle_normal(t).angle_between(self.outward) < ANGLE)
    }

    /// Returns true if a mesh edge of the piece lies along the edge of its hull, and the normal is
    /// between the normals of the edge's triangles.
    fn has_arc(&self, edge: u32) -> bool {
        let (mesh, half_edges) = (self.body.mesh(), self.body.half_edges());
        let polytope = &self.body.polytopes()[self.piece as usize];
        let edge = polytope.edge(edge);
        let (tail, head) = (polytope.vertex(edge.tail), polytope.vertex(edge.head));
        let along = (head - tail).normalize();
        let off = |p: DVec3| {
            let s = (p - tail).dot(along).clamp(0.0, tail.distance(head));
            p.distance(tail + along * s)
        };
        let near = 100.0 * NEAR * self.body.size();
        self.patch().iter().flat_map(|&t| (0..3).map(move |k| (t, k))).any(|(t, k)| {
            let p = mesh.triangle_points(t);
            let (from, to) = (p[k], p[(k + 1) % 3]);
            if off(from).max(off(to)) > near {
                return false;
            }
            let here = mesh.triangle_normal(t);
            let side = (to - from).normalize();
            let angle_to = |n: DVec3| side.dot(here.cross(n)).atan2(here.dot(n));
            let end = match (half_edges.kind(t, k), half_edges.neighbour(t, k)) {
                (EdgeKind::Open | EdgeKind::NonManifold, _) | (_, None) => std::f64::consts::FRAC_PI_2,
                (_, Some((n, _))) => angle_to(mesh.triangle_normal(n)).max(0.0),
            };
            let angle = angle_to(self.outward);
            side.dot(self.outward).abs() < ANGLE && angle > -ANGLE && angle < end + ANGLE
        })
    }

    /// Returns true if the point lies on a triangle of the mesh with this normal. Also returns true
    /// if no part of the mesh near the point rises along the normal, and a triangle there faces
    /// along the normal.
    fn is_locally_nearest(&self) -> bool {
        let mesh = self.body.mesh();
        let near = NEAR * self.body.size();
        let (mut faces_it, mut rises) = (false, false);
        for t in 0..mesh.triangles().len() as u32 {
            let p = mesh.triangle_points(t);
            if !touches(p, self.point, near) {
                continue;
            }
            let normal = mesh.triangle_normal(t);
            if normal.angle_between(self.outward) < ANGLE {
                return true;
            }
            faces_it |= normal.dot(self.outward) > 0.0;
            rises |= p.iter().any(|&v| {
                let up = (v - self.point).dot(self.outward);
                up > 2.0 * near + ANGLE * v.distance(self.point)
            });
        }
        faces_it && !rises
    }
}

/// Returns true if `q` is within `near` of the triangle.
fn touches(p: [DVec3; 3], q: DVec3, near: f64) -> bool {
    let (low, high) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
    if (low - q).max(q - high).max_element() > near {
        return false;
    }
    let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
    normal.dot(q - p[0]).abs() <= near
        && (0..3).all(|k| {
            let side = p[(k + 1) % 3] - p[k];
            normal.cross(side).dot(q - p[k]) >= -near * side.length()
        })
}

/// Returns the rule that a contact's normal breaks. `None` if both meshes have the normal.
fn violation(a: &Body, b: &Body, place: &Placement, contact: &Contact) -> Option<&'static str> {
    let [half_a, half_b] = halves(a, b, place, contact);
    if contact.separation > 0.0 {
        return [half_a, half_b].iter().any(|half| !half.is_locally_nearest()).then_some("closest point");
    }
    let [real_a, real_b] = [&half_a, &half_b].map(|half| match half.feature {
        Feature::Vertex(v) => half.at_vertex(v).is_locally_nearest(),
        // An edge that is flush with a neighbouring face may have that face's normal.
        Feature::Edge(e) => half.has_arc(e) || half.has_normal(),
        Feature::Face(_) => half.has_normal(),
    });
    (!real_a || !real_b).then_some("depth")
}

/// Numbers of contacts and of wrong normals for a pair of bodies at several poses.
#[derive(Debug, Default)]
struct Tally {
    seen: usize,
    wrong: Vec<String>,
    /// Number of poses at which the bodies overlap, but all depths were rejected or have a
    /// normal that one of the meshes lacks. The only contact is then the vector to the nearest
    /// surface point.
    rescued: usize,
    /// Number of poses at which the bodies are apart by less than the tolerance.
    apart: usize,
    /// Poses counted in `apart` at which the nearest pair of points is not among the contacts.
    lost: Vec<String>,
}

fn tally([a, b]: [&Arc<Body>; 2], tolerance: f64, poses: impl Iterator<Item = Pose>) -> Tally {
    let settings = QuerySettings { tolerance, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    let mut tally = Tally::default();
    for (k, pose) in poses.enumerate() {
        let nearest = query.nearest(&pose);
        let (counters, contacts) = (query.counters(), query.found());
        let overlapping = contacts.iter().filter(|contact| contact.separation <= 0.0).count();
        tally.seen += contacts.len();
        for contact in contacts {
            match violation(a, b, &pose.placement(), contact) {
                Some("depth") if overlapping == 1 && counters.inadmissible + counters.stood_in > 0 => {
                    tally.rescued += 1
                }
                Some(what) => tally.wrong.push(format!("pose {k}: {what}, {contact:?}")),
                None => {}
            }
        }
        assert!(counters.walks == 0 || overlapping > 0, "pose {k}: overlapping bodies have no contact");
        let least = contacts.iter().map(|contact| contact.separation).fold(f64::INFINITY, f64::min);
        if let Some(nearest) = nearest
            && nearest.separation > 0.0
            && nearest.separation < tolerance
        {
            tally.apart += 1;
            if least - nearest.separation > 1e-9 * a.size() {
                tally.lost.push(format!("pose {k}: {nearest:?}, but the nearest contact has separation {least}"));
            }
        }
    }
    tally
}

impl Tally {
    fn assert_clean(&self, what: &str) {
        let Self { seen, wrong, apart, lost, .. } = self;
        assert!(wrong.is_empty(), "{what}: {} of {seen} normals are virtual: {:?}", wrong.len(), &wrong[..1]);
        assert!(lost.is_empty(), "{what}: {} of {apart} nearest pairs are lost: {:?}", lost.len(), &lost[..1]);
    }
}

#[test]
fn contact_normals_are_mesh_normals() {
    // In scenes with two tools or with objects, the first tool need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().is_of_two_bodies()) {
        let scene = entry.build();
        for flatness in [BodySettings::EXACT, BodySettings::HAPTIC] {
            let [a, b] = &bodies(&scene, flatness);
            let tally = tally([a, b], scene.contact.tolerance, poses(&scene));
            tally.assert_clean(scene.name);
            assert!(tally.seen > 100 && tally.apart > 0, "{}: {tally:?}", scene.name);
        }
    }
}

/// Seed of the poses of real models.
const SEED: u64 = 0xad15_51b1;

/// Returns a random point of a body's surface, and the normal there.
fn spot(body: &Body, random: &mut Random) -> (DVec3, DVec3) {
    let mesh = body.mesh();
    let t = (random.unit() * mesh.triangles().len() as f64) as u32;
    let [p, q, r] = mesh.triangle_points(t);
    let (u, v) = (random.unit(), random.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    (p + (q - p) * u + (r - p) * v, mesh.triangle_normal(t))
}

/// Returns a pose at which the bodies overlap at a random place by at most `depth` (m).
fn touching(a: &Body, b: &Body, depth: f64, random: &mut Random) -> Pose {
    let ((p, n), (q, m)) = (spot(a, random), spot(b, random));
    let rotation = DQuat::from_axis_angle(m, TAU * random.unit()) * DQuat::from_rotation_arc(n, -m);
    Pose::new(rotation, q - rotation * p + m * (depth * (2.0 * random.unit() - 1.0)))
}

/// Pairs of real models of about equal size in their units.
const PAIRS: [[&str; 2]; 4] = [
    ["paper/teaspoon_336.obj", "paper/teacup_500.obj"],
    ["parts/low_poly_bunny.obj", "parts/chess_knight_1000.obj"],
    ["parts/tooth_sofa.obj", "parts/plate_holes.obj"],
    ["parts/ur5_wrist1_collision.obj", "parts/low_poly_bunny.obj"],
];

#[test]
fn contact_normals_of_real_models_are_mesh_normals() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models");
    let mut random = Random::new(SEED);
    for pair in PAIRS {
        let read = |name| palpus_io::read_mesh(&std::path::Path::new(folder).join(name)).ok();
        let [Some(soup_a), Some(soup_b)] = pair.map(read) else { continue };
        let size = |soup: &PolygonSoup| {
            let [low, high] = [DVec3::min, DVec3::max].map(|pick| soup.vertices.iter().copied().reduce(pick).unwrap());
            low.distance(high)
        };
        // Both models are scaled to 10 cm.
        let make = |soup: &PolygonSoup, flatness| {
            let settings = BodySettings { scale: 0.1 / size(soup), flatness, ..BodySettings::default() };
            Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("the mesh is a valid body"))
        };
        for flatness in [BodySettings::EXACT, BodySettings::HAPTIC] {
            let (a, b) = (make(&soup_a, flatness), make(&soup_b, flatness));
            let poses: Vec<Pose> = (0..MODEL_POSES).map(|_| touching(&a, &b, 1e-3, &mut random)).collect();
            let tally = tally([&a, &b], 5e-4, poses.into_iter());
            tally.assert_clean(&format!("{pair:?}, seed {SEED:#x}"));
        }
    }
}
