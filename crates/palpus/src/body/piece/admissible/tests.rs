//! Tests the admissible normals of the two pieces of an L-shaped block.

use glam::{DQuat, DVec2, DVec3};

use super::{FaceRim, FlatAround};

use crate::algebra::Random;
use crate::body::{Body, BodySettings, Feature, PolygonSoup};

/// Builds an L-shaped block of thickness 1.
fn l_block() -> Body {
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
    soup.push_face(&[5, 4, 3, 2, 1, 0]);
    soup.push_face(&[6, 7, 8, 9, 10, 11]);
    for k in 0..6 {
        soup.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]);
    }
    Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).unwrap()
}

/// Returns true if the plane is one of the planes of the block.
fn is_real(normal: DVec3, offset: f64) -> bool {
    let planes = [
        (DVec3::X, 2.0),
        (DVec3::X, 1.0),
        (DVec3::NEG_X, 0.0),
        (DVec3::Y, 2.0),
        (DVec3::Y, 1.0),
        (DVec3::NEG_Y, 0.0),
        (DVec3::Z, 1.0),
        (DVec3::NEG_Z, 0.0),
    ];
    planes.iter().any(|plane| plane.0.distance(normal) < 1e-9 && (plane.1 - offset).abs() < 1e-9)
}

#[test]
fn l_block_faces_are_its_admissible_planes() {
    let body = l_block();
    for k in 0..body.pieces().len() as u32 {
        let own = body.admissible_normals(k);
        assert!(!own.faces().is_empty());
        for face in own.faces() {
            let plane = own.plane(face.face);
            assert!(is_real(plane.normal, plane.offset), "piece {k}: {plane:?}");
        }
        for borrowed in own.borrowed() {
            assert!(is_real(borrowed.plane.normal, borrowed.plane.offset), "piece {k}: {borrowed:?}");
            let heights = own.polytope().vertices().iter().map(|&v| borrowed.plane.height(v));
            assert!(
                heights.fold(f64::NEG_INFINITY, f64::max) < 1e-9,
                "piece {k}: {borrowed:?} is not a supporting plane"
            );
        }
        for arc in own.arcs() {
            let [left, right] = own.ends(arc);
            assert!(left.dot(right).abs() < 1e-9, "piece {k}: an arc is not a right angle");
        }
    }
}

#[test]
fn inner_edge_has_no_normal_into_the_notch() {
    let body = l_block();
    let inner = |p: DVec3| (p.x - 1.0).abs() < 1e-9 && (p.y - 1.0).abs() < 1e-9;
    let diagonal = DVec3::new(1.0, 1.0, 0.0).normalize();
    let mut inner_edges = 0;
    for (k, polytope) in body.polytopes().iter().enumerate() {
        for (e, edge) in polytope.edges().enumerate() {
            let (tail, head) = (polytope.vertex(edge.tail), polytope.vertex(edge.head));
            if inner(tail) && inner(head) {
                inner_edges += 1;
                assert!(!body.admits(k as u32, Feature::Edge(e as u32), 0.5 * (tail + head), diagonal));
            }
        }
        for (v, &p) in polytope.vertices().iter().enumerate() {
            // Along the diagonal, the neighbours of the inner corner are higher than the corner.
            // Along z, the neighbours of an upper corner are not higher.
            let admits = |outward| body.admits(k as u32, Feature::Vertex(v as u32), p, outward);
            if inner(p) {
                assert!(!admits(diagonal));
                assert_eq!(admits(DVec3::Z), p.z > 0.5);
            } else {
                let out = DVec3::new(p.x - 0.9, p.y - 0.9, p.z - 0.5).normalize();
                let true_corner = [0.0, 2.0].contains(&p.x) && [0.0, 2.0].contains(&p.y);
                assert!(!true_corner || admits(out), "piece {k}, {p}, {out}");
            }
        }
    }
    assert!(inner_edges > 0);
}

/// Seed of the random directions.
const SEED: u64 = 0xa9_a27;

#[test]
fn no_direction_within_the_bound_is_admissible() {
    let body = l_block();
    let mut random = Random::new(SEED);
    let (mut apart, mut differ) = (0, 0);
    for k in 0..body.pieces().len() as u32 {
        let own = body.admissible_normals(k);
        let polytope = own.polytope();
        for _ in 0..2000 {
            let direction = random.direction();
            let near = random.unit() * 0.2;
            let tilted = direction.cross(random.direction()).normalize();
            let tilted = DQuat::from_axis_angle(tilted, near * random.unit()) * direction;
            if own.vertices_differ_from(direction, near) {
                differ += 1;
                let admits = |v| own.vertex_admits(v, tilted);
                let any = (0..polytope.vertices().len() as u32).any(admits);
                assert!(!any, "seed {SEED:#x}, piece {k}: {direction}, {near}, {tilted}");
            }
            let (whole, most) = (own.angle_to(direction), random.unit());
            let part = own.angle_between(direction, [0.0, most]);
            assert!(
                part <= most + 1e-15 && (whole <= 0.0 || part >= whole.min(most) - 1e-15),
                "{whole}, {part} of {most}"
            );
            let angle = if random.unit() < 0.5 { whole } else { part };
            if angle <= 0.0 {
                continue;
            }
            apart += 1;
            let axis = direction.cross(random.direction()).normalize();
            let turned = DQuat::from_axis_angle(axis, angle * random.unit()) * direction;
            let what = format!("seed {SEED:#x}, piece {k}: {direction}, {angle}, {turned}");
            let vertices = 0..polytope.vertices().len() as u32;
            assert!(!vertices.into_iter().any(|v| own.vertex_admits(v, turned)), "{what}");
            // `edge_faces` only accepts directions that are perpendicular to the edge.
            for (e, edge) in polytope.edges().enumerate() {
                let along = (polytope.vertex(edge.head) - polytope.vertex(edge.tail)).normalize();
                let across = (turned - along * along.dot(turned)).normalize();
                let is_near = across.angle_between(direction) < angle;
                assert!(!is_near || !own.edge_faces(e as u32, across), "{what}: edge {e}");
            }
            assert!(own.faces().iter().all(|face| own.plane(face.face).normal.distance(turned) > 0.0), "{what}");
        }
    }
    assert!(apart > 500 && differ > 500, "seed {SEED:#x}: {apart}, {differ}");
}

#[test]
fn only_the_first_corners_of_large_faces_have_bits() {
    let rim = FaceRim { all: u64::MAX, ..FaceRim::NONE };
    assert!([0, FaceRim::MOST - 1].iter().all(|&k| rim.around(k) == FlatAround::All));
    assert!([FaceRim::MOST, 1000].iter().all(|&k| rim.around(k) == FlatAround::Corner));
}

#[test]
fn only_the_notch_and_the_cut_of_an_l_face_are_inner() {
    let body = l_block();
    assert_eq!(body.pieces().len(), 2);
    let (mut notches, mut cuts) = (0, 0);
    for (k, polytope) in (0..).zip(body.polytopes()) {
        let border = body.admissible().border_of(k);
        for own in body.admissible_normals(k).faces() {
            let (corners, normal) = (polytope.face_vertices(own.face), polytope.plane(own.face).normal);
            if normal.z.abs() < 0.5 {
                continue;
            }
            for i in 0..corners.len() {
                let [p, q] = [i, (i + 1) % corners.len()].map(|i| polytope.vertex(corners.at(i)).truncate());
                let is_notch = p.distance(DVec2::ONE) < 1e-12;
                assert_eq!(own.rim.around(i), if is_notch { FlatAround::Half } else { FlatAround::Corner }, "{p}");
                let middle = p.midpoint(q);
                let inside = middle.cmpgt(DVec2::splat(1e-9)).all() && middle.max_element() < 1.0 - 1e-9;
                let expected = if inside { [1.0, 0.0] } else { [0.0, 1.0] };
                assert_eq!(border.rim_of_side(own.rim, own.face, i), expected, "{p} {q}");
                notches += u32::from(is_notch);
                cuts += u32::from(inside);
            }
        }
    }
    // Two pieces, with two faces each.
    assert_eq!([notches, cuts], [4, 4]);
}
