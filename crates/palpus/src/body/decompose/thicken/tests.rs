//! Tests how much of a solid the pieces cover, and how accurate the depths below their patches are.
//!
//! Limit: depths in these tests are depths below the planes of original faces. A test of the whole
//! pipeline is in the crate `palpus-scenes`.

use glam::DVec3;

use crate::algebra::Random;
use crate::body::shapes::{cuboid, torus};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup, Polytope, Provenance};

const SEED: u64 = 0x2002_0725;
/// Random displacement of the vertices (m) of a torus whose tube has radius 0.4.
const ROUGHNESS: f64 = 0.02;

fn build(mesh: Mesh, thick: bool) -> Body {
    let settings = BodySettings { thick, ..BodySettings::default() };
    Body::build(mesh, &settings, &mut |_| ()).unwrap()
}

/// Returns a torus with rough surface, whose patches are small and have thin hulls.
fn rough_torus() -> Mesh {
    let smooth = torus(1.0, 0.4, 48, 32);
    let mut random = Random::new(SEED);
    let vertices = smooth.vertices().iter().map(|v| v + ROUGHNESS * random.vector()).collect();
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
    smooth.triangles().iter().for_each(|t| soup.push_face(t));
    Mesh::from_soup(&soup).unwrap().0
}

fn holds(polytope: &Polytope, p: DVec3, slack: f64) -> bool {
    polytope.planes().iter().all(|plane| plane.height(p) <= slack)
}

/// Returns the depth of a point below the piece's original faces (m).
fn depth(polytope: &Polytope, p: DVec3) -> f64 {
    let original = (0..polytope.face_count() as u32).filter(|&f| polytope.face_provenance(f) == Provenance::Original);
    original.map(|f| -polytope.plane(f).height(p)).fold(f64::INFINITY, f64::min)
}

#[test]
fn thick_pieces_cover_a_torus_with_true_depths() {
    let (body, thin) = (build(rough_torus(), true), build(rough_torus(), false));
    assert_eq!(body.polytopes().len(), thin.polytopes().len());
    let mut random = Random::new(SEED);
    let (mut inside, mut seen, mut seen_by_thin, mut too_deep) = (0, 0, 0, 0);
    while inside < 300 {
        let p = random.vector() * DVec3::new(1.4, 1.4, 0.4);
        if !body.tree().inside(p) {
            continue;
        }
        inside += 1;
        let distance = body.tree().nearest(p).unwrap().distance;
        let depths = |body: &Body| {
            let over = body.polytopes().iter().filter(|piece| holds(piece, p, 1e-9));
            over.map(|piece| depth(piece, p)).collect::<Vec<f64>>()
        };
        let right = |depths: &[f64]| depths.iter().any(|depth| (depth - distance).abs() <= 0.1 * distance);
        seen += u32::from(right(&depths(&body)));
        seen_by_thin += u32::from(right(&depths(&thin)));
        let deepest = depths(&body).into_iter().fold(0.0, f64::max);
        too_deep += u32::from(deepest > 1.25 * distance + ROUGHNESS);
    }
    assert!(seen >= 285, "seed {SEED:#x}: {seen} of {inside} points have a correct depth");
    // The hulls of the large patches on the outer half of the ring are thick even without inner
    // corners, so some of their depths are too large. The contact query later rejects implausible
    // depths.
    assert!(too_deep <= 30, "seed {SEED:#x}: {too_deep} points have too large a depth");
    assert!(seen_by_thin < 100, "seed {SEED:#x}: {seen_by_thin} points have a correct depth in thin pieces");
}

#[test]
fn inner_corners_only_add_virtual_faces() {
    let body = build(rough_torus(), true);
    for (k, (polytope, piece)) in body.polytopes().iter().zip(body.pieces()).enumerate() {
        assert!(!polytope.is_flat(), "piece {k}");
        for f in 0..polytope.face_count() as u32 {
            let corners = polytope.face_vertices(f).iter().map(|v| polytope.vertex(v));
            let on_surface = corners.into_iter().all(|p| body.tree().nearest_within(p, 1e-9).is_some());
            let original = polytope.face_provenance(f) == Provenance::Original;
            assert!(!original || !piece.face_triangles(f).is_empty() && on_surface, "piece {k}, face {f}");
        }
        for &t in piece.triangles() {
            let middle = body.mesh().triangle_centroid(t);
            assert!(holds(polytope, middle, 1e-9) && depth(polytope, middle).abs() < 1e-9, "piece {k}, triangle {t}");
        }
    }
}

#[test]
fn convex_and_open_bodies_get_no_inner_corners() {
    let solid = build(cuboid(DVec3::ZERO, DVec3::ONE), true);
    assert_eq!((solid.polytopes().len(), solid.polytopes()[0].vertices().len()), (1, 8));
    let closed = torus(1.0, 0.4, 12, 8);
    let mut soup = PolygonSoup { vertices: closed.vertices().to_vec(), ..PolygonSoup::new() };
    closed.triangles().iter().skip(1).for_each(|t| soup.push_face(t));
    let open = Mesh::from_soup(&soup).unwrap().0;
    let (thick, thin) = (build(open.clone(), true), build(open, false));
    for (with, without) in thick.polytopes().iter().zip(thin.polytopes()) {
        assert_eq!(with.vertices(), without.vertices());
    }
}
