//! Tests that the rim of a flat face bears its load, however the face is cut into pieces and
//! triangles.

use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::force::{LoadSharing, Tilted};

/// Half the width of the plate with a hole, m. The hole has a third of its width.
const HALF: f64 = 0.03;

/// Returns a square plate with a square hole. Both flat faces consist of eight squares.
fn plate_with_hole() -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let index = |i: u32, j: u32, k: u32| (k * 4 + j) * 4 + i;
    for (k, j, i) in (0..2).flat_map(|k| (0..4).flat_map(move |j| (0..4).map(move |i| (k, j, i)))) {
        let at = |i: u32| HALF * (f64::from(i) / 1.5 - 1.0);
        soup.vertices.push(DVec3::new(at(i), at(j), 0.005 * f64::from(k)));
    }
    let is_solid = |i: i32, j: i32| (0..3).contains(&i) && (0..3).contains(&j) && (i, j) != (1, 1);
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|&(i, j)| is_solid(i, j)) {
        let (x, y) = (i as u32, j as u32);
        let around = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        soup.push_face(&around.map(|(x, y)| index(x, y, 1)));
        soup.push_face(&[3, 2, 1, 0].map(|k: usize| index(around[k].0, around[k].1, 0)));
        for (k, (di, dj)) in [(0, -1), (1, 0), (0, 1), (-1, 0)].into_iter().enumerate() {
            if !is_solid(i + di, j + dj) {
                let (p, q) = (around[k], around[(k + 1) % 4]);
                soup.push_face(&[index(p.0, p.1, 0), index(q.0, q.1, 0), index(q.0, q.1, 1), index(p.0, p.1, 1)]);
            }
        }
    }
    Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).unwrap())
}

/// Returns the contacts of two bodies and their shares of the load. The tolerance is a thousandth
/// of `size` (m).
fn loads(bodies: [&Arc<Body>; 2], pose: &Pose, size: f64) -> Vec<(Contact, f64)> {
    let [a, b] = bodies.map(Arc::clone);
    let mut query = ContactQuery::new(a, b, QuerySettings::default());
    query.set_patch_angle(Some(0.05));
    query.set_tolerance(1e-3 * size);
    let contacts = query.contacts(pose).to_vec();
    let tilted: Vec<Tilted> = contacts.iter().map(|contact| Tilted::of(contact, 1e-5 * size)).collect();
    let mut sharing = LoadSharing::new(tilted.len());
    let shares = sharing.run(&tilted, None, 0.0);
    contacts.into_iter().zip(shares.iter().copied()).collect()
}

/// Returns a table with its top at z = 0.
fn table(half: f64) -> Arc<Body> {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0;
    let corners: Vec<DVec3> = (0..8).map(|k| (corner(k) - DVec3::new(1.0, 1.0, 2.0)) * half).collect();
    Arc::new(Body::from_convex(&corners).unwrap())
}

#[test]
fn plate_with_a_hole_stands_on_its_corners() {
    let plate = plate_with_hole();
    assert!(plate.pieces().len() > 2);
    let pose = Pose::new(DQuat::from_rotation_z(0.2), DVec3::Z * -1e-7);
    for (contact, share) in loads([&plate, &table(1.0)], &pose, HALF) {
        let place = pose.inverse().point(contact.midpoint());
        let is_corner = (place.truncate().abs() - HALF).abs().max_element() < 1e-6;
        let expected = if is_corner { 0.25 } else { 0.0 };
        // Several pieces may have a contact at a corner. One of them bears the load.
        assert!(share < 1e-4 || (share - expected).abs() < 1e-3, "{share} at {place}");
    }
}

#[test]
fn load_of_stacked_plates_is_at_the_corners_of_their_overlap() {
    let plate = plate_with_hole();
    for angle in [0.0, 0.1, 0.3, 0.7] {
        let pose = Pose::new(DQuat::from_rotation_z(angle), DVec3::Z * (0.005 - 1e-7));
        let loads = loads([&plate, &plate], &pose, HALF);
        let pressed: Vec<_> = loads.iter().filter(|load| load.1 > 1e-4 && load.0.normal.z > 0.9).collect();
        let sum: f64 = pressed.iter().map(|load| load.1).sum();
        assert!((sum - 1.0).abs() < 1e-2, "angle {angle}: {sum}");
        let on_rim = |place: DVec3| {
            let far = place.truncate().abs().max_element();
            (far - HALF).abs() < 1e-6 || (far - HALF / 3.0).abs() < 1e-6
        };
        for (contact, share) in &pressed {
            let place = contact.midpoint();
            let is_corner = on_rim(place) && on_rim(pose.inverse().point(place));
            assert!(is_corner, "angle {angle}: {share} at {place}");
        }
        // The outer sides cross at eight places, and the sides of the holes too.
        assert!(pressed.len() == 16 || angle == 0.0, "angle {angle}: {} contacts", pressed.len());
    }
}

/// Returns the outward normal and the triangles of the largest flat face on which a body can stand.
fn foot(body: &Body) -> (DVec3, Vec<u32>) {
    let mesh = body.mesh();
    let tolerance = 1e-6 * mesh.bounding_diagonal();
    let all = 0..mesh.triangles().len() as u32;
    let in_plane = |t: u32| {
        let (normal, place) = (mesh.triangle_normal(t), mesh.triangle_points(t)[0]);
        let is_in = |other: &u32| {
            let height = |p: DVec3| normal.dot(p - place).abs();
            mesh.triangle_normal(*other).dot(normal) > 0.99
                && mesh.triangle_points(*other).into_iter().all(|p| height(p) < tolerance)
        };
        all.clone().filter(is_in).collect::<Vec<u32>>()
    };
    let stands = |t: &u32| {
        let (normal, place) = (mesh.triangle_normal(*t), mesh.triangle_points(*t)[0]);
        mesh.vertices().iter().all(|p| normal.dot(*p - place) < tolerance)
    };
    let area = |face: &Vec<u32>| face.iter().map(|&t| mesh.triangle_area(t)).sum::<f64>();
    let mut largest: Vec<u32> = Vec::new();
    for t in all.clone().filter(stands) {
        if !largest.contains(&t) {
            let face = in_plane(t);
            largest = if area(&face) > area(&largest) { face } else { largest };
        }
    }
    (mesh.triangle_normal(largest[0]), largest)
}

#[test]
fn real_parts_stand_on_the_convex_corners_of_their_faces() {
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models"));
    for name in ["parts/plate_holes.obj", "pairs/gear_base.obj"] {
        let Ok(soup) = palpus_io::read_mesh(&models.join(name)) else { continue };
        let body = Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).unwrap());
        let (mesh, size) = (body.mesh(), body.mesh().bounding_diagonal());
        let (normal, face) = foot(&body);
        let turn = DQuat::from_rotation_arc(normal, DVec3::NEG_Z);
        let low = turn * mesh.triangle_points(face[0])[0];
        let pose = Pose::new(turn, -low - DVec3::Z * (1e-6 * size));
        let loads = loads([&body, &table(2.0 * size)], &pose, size);
        assert!(loads.iter().map(|load| load.1).sum::<f64>() > 0.99, "{name}");
        for (contact, share) in loads.into_iter().filter(|load| load.1 > 1e-4) {
            let place = pose.inverse().point(contact.midpoint());
            let place = place + normal * normal.dot(mesh.triangle_points(face[0])[0] - place);
            // The angle of the face at this corner.
            let angle: f64 = face
                .iter()
                .filter_map(|&t| {
                    let p = mesh.triangle_points(t);
                    let k = (0..3).find(|&k| p[k].distance(place) < 2e-6 * size)?;
                    Some((p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]))
                })
                .sum();
            assert!(angle < std::f64::consts::PI - 1e-3, "{name}: {share} at {place}, where the angle is {angle}");
        }
    }
}
