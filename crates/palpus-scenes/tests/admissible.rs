//! Contact normals are normals of the meshes, not of the hulls of their pieces, and no contact is lost by that.
//!
//! The oracle looks at nothing but the mesh, its triangles' own normals and the patch of each piece. Weakness: where a depth rests on
//! a face or an edge, it asks whether the patch has such a normal there, not whether the witness lies next to it.

use glam::DVec3;
use palpus::algebra::{NoClock, Placement, Pose};
use palpus::body::{Body, BodySettings, EdgeKind, Feature};
use palpus::force::{Contact, PairQuery};
use palpus_scenes::{Scene, scenes};

/// Radians by which a normal may leave the mesh's: planes bent by a file's few digits, and the engine's own slack.
const ANGLE: f64 = 2e-3;

/// Relative to a body's size: how near a point is on a triangle.
const NEAR: f64 = 1e-6;

/// Poses along each scene's path.
const POSES: usize = 1500;

fn bodies(scene: &Scene, flatness: f64) -> [Body; 2] {
    let settings = BodySettings { flatness, ..BodySettings::default() };
    [&scene.probe, &scene.environment].map(|soup| Body::from_soup(soup, &settings, &mut |_| ()).expect("it is a body"))
}

fn poses(scene: &Scene) -> impl Iterator<Item = Pose> {
    (0..POSES).map(|k| scene.path.pose(scene.path.duration() * k as f64 / POSES as f64))
}

/// One body's side of a contact, in its frame.
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

impl Half<'_> {
    fn patch(&self) -> &[u32] {
        self.body.pieces()[self.piece as usize].triangles()
    }

    /// A triangle of the patch has this normal.
    fn has_normal(&self) -> bool {
        self.patch().iter().any(|&t| self.body.mesh().triangle_normal(t).angle_between(self.outward) < ANGLE)
    }

    /// A mesh edge of the patch lies along the piece's edge, and the normal is between those of its triangles.
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

    /// The point lies on the mesh, on a triangle that looks along the normal; or no part of the mesh near it rises along the normal
    /// and some looks to that side.
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

/// True if `q` is within `near` of the triangle.
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

/// What a contact's normal breaks; none if it is one of the meshes'.
fn violation(a: &Body, b: &Body, place: &Placement, contact: &Contact) -> Option<&'static str> {
    let [half_a, half_b] = halves(a, b, place, contact);
    if contact.separation > 0.0 {
        return [half_a, half_b].iter().any(|half| !half.is_locally_nearest()).then_some("closest point");
    }
    let real = match (half_a.feature, half_b.feature) {
        (Feature::Vertex(_), Feature::Face(_)) => half_b.has_normal(),
        (Feature::Face(_), Feature::Vertex(_)) => half_a.has_normal(),
        (Feature::Vertex(_), Feature::Edge(e)) => half_b.has_arc(e),
        (Feature::Edge(e), Feature::Vertex(_)) => half_a.has_arc(e),
        (Feature::Edge(e), Feature::Edge(f)) => half_a.has_arc(e) && half_b.has_arc(f),
        _ => false,
    };
    (!real).then_some("depth")
}

#[test]
#[allow(clippy::print_stdout)]
fn no_normal_points_out_through_a_virtual_face() {
    for entry in scenes() {
        let scene = entry.build();
        for flatness in [BodySettings::EXACT, BodySettings::HAPTIC] {
            let [a, b] = &bodies(&scene, flatness);
            let mut query = PairQuery::new(a, b, 4096);
            let mut seen = [0; 2];
            let mut bad = [0; 2];
            for (k, pose) in poses(&scene).enumerate() {
                query.run(a, b, &pose, scene.contact.tolerance, &NoClock);
                for contact in query.contacts() {
                    seen[usize::from(contact.separation > 0.0)] += 1;
                    if let Some(what) = violation(a, b, &pose.placement(), contact) {
                        bad[usize::from(contact.separation > 0.0)] += 1;
                        if let (Feature::Face(f), 1..3) = (contact.features.b, bad.iter().sum::<i32>()) {
                            let (p, q) = (&b.polytopes()[contact.piece_b as usize], &b.pieces()[contact.piece_b as usize]);
                            println!("face {f} {:?} rim {} own {:?}", p.plane(f), p.is_rim(f), b.own_normals(contact.piece_b).own_face(f));
                            println!("  corners {:?}", p.face_vertices(f).iter().map(|&v| p.vertex(v)).collect::<Vec<_>>());
                            for &t in q.triangles() {
                                println!("  tri {t} in face {} normal {} angle {:.2e} {:?}", q.face_triangles(f).contains(&t), b.mesh().triangle_normal(t), b.mesh().triangle_normal(t).angle_between(contact.normal), b.mesh().triangle_points(t));
                            }
                        }
                        if bad.iter().sum::<i32>() < 5 {
                            println!("{} pose {k}: {what}, {contact:?}", scene.name);
                        }
                    }
                }
            }
            println!("{} {flatness}: {bad:?} of {seen:?}", scene.name);
        }
    }
}

#[test]
#[allow(clippy::print_stdout)]
fn the_nearest_pair_is_among_the_contacts() {
    for entry in scenes() {
        let scene = entry.build();
        for flatness in [BodySettings::EXACT, BodySettings::HAPTIC] {
            let [a, b] = &bodies(&scene, flatness);
            let mut query = PairQuery::new(a, b, 4096);
            let (mut apart, mut lost) = (0, 0);
            let mut empty = 0;
            for (k, pose) in poses(&scene).enumerate() {
                let mut counters = query.run(a, b, &pose, scene.contact.tolerance, &NoClock);
                let least = query.contacts().iter().map(|c| c.separation).fold(f64::INFINITY, f64::min);
                empty += usize::from(counters.walks > 0 && query.contacts().is_empty());
                let Some(nearest) = query.nearest(a, b, &pose, &mut counters) else { continue };
                if nearest.separation <= 0.0 || nearest.separation > scene.contact.tolerance {
                    continue;
                }
                apart += 1;
                if least - nearest.separation > 1e-9 * a.size() {
                    lost += 1;
                    if lost < 4 {
                        println!("{} pose {k}: {least} but {nearest:?}", scene.name);
                    }
                }
            }
            println!("{} {flatness}: lost {lost} of {apart}, {empty} empty", scene.name);
        }
    }
}
