use glam::DVec3;

use super::*;
use crate::algebra::Random;
use crate::body::PolygonSoup;
use crate::body::shapes::{cuboid, model, torus};
use crate::body::{MassProperties, ShadingNormals};

fn examine(soup: &PolygonSoup) -> Health {
    let (mesh, cleaning) = Mesh::from_soup(soup).unwrap();
    Health::full(&mesh, &HalfEdges::new(&mesh), &mesh.tree(), cleaning)
}

fn soup_of(meshes: &[&Mesh]) -> PolygonSoup {
    let mut soup = PolygonSoup::new();
    for mesh in meshes {
        let base = soup.vertices.len() as u32;
        soup.vertices.extend(mesh.vertices());
        mesh.triangles().iter().for_each(|t| soup.push_face(&t.map(|v| v + base)));
    }
    soup
}

#[test]
fn valid_shapes_have_no_warnings() {
    let (ring, block) = (torus(1.0, 0.4, 12, 8), cuboid(DVec3::splat(5.0), DVec3::splat(6.0)));
    let health = examine(&soup_of(&[&ring, &block, &ring]));
    // The second ring coincides with the first.
    assert_eq!(health.cleaning.duplicate_triangles, ring.triangles().len());
    assert_eq!((health.genus(), health.components.len(), health.closed), (Some(1), 2, true));
    assert_eq!(health.components[1], ComponentHealth { triangles: 12, closed: true, genus: Some(0) });
    assert_eq!(health.self_intersections, Some(SelfIntersections { complete: true, ..Default::default() }));
    assert!(health.notices().iter().all(|notice| !notice.is_warning()));
}

#[test]
fn crossing_touching_open_and_pinched_are_found() {
    let cube = |low: f64, high: f64| cuboid(DVec3::splat(low), DVec3::splat(high));
    let crossing = examine(&soup_of(&[&cube(0.0, 1.0), &cube(0.45, 1.55)]));
    assert!(crossing.self_intersections.unwrap().crossing_pairs > 0 && crossing.closed);
    assert!(matches!(crossing.notices()[0], Notice::SelfIntersecting(_)));

    let corner = examine(&soup_of(&[&cube(0.0, 1.0), &cube(1.0, 2.0)]));
    assert_eq!((corner.pinched_vertices, corner.genus()), (1, None));
    assert!(corner.components.iter().all(|c| c.closed && c.genus == Some(0)));
    assert!(!corner.self_intersections.unwrap().any());

    // Two boxes with a common edge, which four triangles use.
    let edge = examine(&soup_of(&[&cube(0.0, 1.0), &cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0))]));
    assert_eq!((edge.non_manifold_edges, edge.pinched_vertices, edge.boundary_edges), (1, 0, 0));
    assert!(edge.closed && !edge.is_manifold() && edge.components.len() == 2);

    let shelf = examine(&soup_of(&[&cube(0.0, 1.0), &cuboid(DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.8, 0.8, 2.0))]));
    assert!(shelf.self_intersections.unwrap().overlapping_pairs > 0);

    let closed = cube(0.0, 1.0);
    let open = examine(&PolygonSoup::from_triangles(closed.vertices().to_vec(), &closed.triangles()[1..]));
    assert_eq!((open.boundary_edges, open.closed, open.genus()), (3, false, None));
    assert_eq!(open.notices(), [Notice::Open(3)]);
    assert!(open.notices()[0].to_string().starts_with("3 edges at an open boundary"));
}

#[test]
fn random_soups_give_valid_results_everywhere() {
    const SEED: u64 = 0xbad_50b;
    let mut random = Random::new(SEED);
    let mut meshes = 0;
    for case in 0..3000 {
        let mut soup = PolygonSoup::new();
        let grid = 2 + random.below(3);
        let count = 3 + random.below(10);
        for _ in 0..count {
            // Uses few distinct positions. Therefore corners coincide, polygons fold, and some
            // triangles have no area.
            let jitter = random.vector() * if random.below(3) == 0 { 1e-10 } else { 0.0 };
            let place = [0; 3].map(|_| random.below(grid) as f64);
            soup.vertices.push(DVec3::from(place) + jitter);
        }
        for _ in 0..random.below(20) {
            let corners: Vec<u32> = (0..random.below(7)).map(|_| random.below(count) as u32).collect();
            soup.push_face(&corners);
        }
        let Ok((mesh, cleaning)) = Mesh::from_soup(&soup) else { continue };
        meshes += 1;
        let (edges, tree) = (HalfEdges::new(&mesh), mesh.tree());
        let health = Health::full(&mesh, &edges, &tree, cleaning);
        assert!(health.self_intersections.unwrap().complete);
        assert!(health.notices().iter().all(|notice| !notice.to_string().is_empty()));
        let mass = MassProperties::new(&mesh);
        assert!(mass.volume > 0.0 && mass.inertia.is_finite() && mass.center_of_mass.is_finite());
        let shading = ShadingNormals::new(&mesh, &edges, 0.7);
        for t in 0..mesh.triangles().len() as u32 {
            assert!((mesh.triangle_normal(t).length() - 1.0).abs() < 1e-12, "seed {SEED}, case {case}");
            let at = shading.at_point(&mesh, t, random.vector());
            assert!((at.length() - 1.0).abs() < 1e-12, "seed {SEED}, case {case}");
            for k in 0..3 {
                if let Some((other, j)) = edges.neighbour(t, k) {
                    assert_eq!(edges.neighbour(other, j), Some((t, k)), "seed {SEED}, case {case}");
                }
            }
        }
        if mesh.is_closed() {
            let p = (random.vector() + 1.0) * grid as f64 / 2.0;
            let winding = tree.winding_number(p);
            assert_eq!(tree.inside(p), winding > 0.5, "seed {SEED}, case {case}: {winding}");
        }
    }
    assert!(meshes > 1000, "{meshes}");
}

/// Known properties of a real model: file, number of remaining triangles, closed, genus,
/// self-intersecting, number of components.
type Known = (&'static str, usize, bool, Option<usize>, bool, usize);

/// Reference values from other programs. The first program counted the triangles, and computed the
/// genus and whether the model is closed. A second program tested for self-intersections with exact
/// predicates. The second program does not detect coplanar overlaps, such as the overlaps at the
/// rim of the round hole.
const KNOWN: [Known; 17] = [
    ("paper/teacup_500.obj", 500, true, Some(1), false, 1),
    ("paper/teacup_4972.obj", 4972, true, Some(1), true, 1),
    ("paper/teaspoon_336.obj", 336, true, Some(0), false, 1),
    ("paper/teacup_newell_original.obj", 3328, false, None, true, 2),
    ("parts/fandisk.obj", 12946, true, Some(0), false, 1),
    ("parts/plate_holes.obj", 1252, true, Some(5), false, 1),
    ("parts/ur5_wrist1_collision.obj", 702, true, Some(0), false, 2),
    ("pairs/gear_base.obj", 4992, true, Some(4), false, 1),
    ("pairs/gear_small.obj", 20524, true, Some(2), true, 1),
    ("pairs/hole_round_8mm_factory.obj", 928, true, Some(1), true, 1),
    ("nasty/casting_inverted.obj", 10224, true, Some(9), false, 1),
    ("nasty/footbones_26_parts.obj", 4204, true, Some(0), true, 26),
    ("nasty/hourglass_pinched_vertex.obj", 40, true, None, false, 2),
    ("nasty/many_small_holes.obj", 3524, false, None, false, 1),
    ("nasty/non_manif_hole.obj", 755, false, None, false, 1),
    ("nasty/self_intersectA.obj", 17160, true, Some(0), true, 1),
    ("nasty/truck_shrec.obj", 4770, false, None, true, 66),
];

#[test]
fn real_models_have_their_known_properties() {
    for (name, triangles, closed, genus, self_intersecting, components) in KNOWN {
        let Some(soup) = model(name) else { continue };
        let health = examine(&soup);
        let own = health.self_intersections.unwrap();
        let count: usize = health.components.iter().map(|c| c.triangles).sum();
        let found = (name, count, health.closed, health.genus(), own.any(), health.components.len());
        assert_eq!(found, (name, triangles, closed, genus, self_intersecting, components));
    }
}

#[test]
fn counts_on_defective_models_match_other_programs() {
    let counts = |name: &str| model(name).map(|soup| examine(&soup));
    if let Some(health) = counts("nasty/colon_double_sheets.obj") {
        assert_eq!(health.cleaning.duplicate_triangles, 3240);
    }
    if let Some(health) = counts("nasty/self_intersectA.obj") {
        assert_eq!(health.self_intersections.unwrap().triangles, 334);
    }
    if let Some(health) = counts("nasty/many_small_holes.obj") {
        assert_eq!(health.boundary_edges, 556);
    }
    if let Some(health) = counts("nasty/casting_inverted.obj") {
        assert_eq!(health.notices(), [Notice::Inverted(1)]);
    }
    if let Some(health) = counts("pairs/gear_small.obj") {
        // The model has two triangles without area. Without these triangles, the surface is still
        // closed.
        assert_eq!((health.cleaning.exchanged_triangles, health.closed), (2, true));
    }
    if let Some(health) = counts("pairs/hole_round_8mm_factory.obj") {
        // The number comes from another program that uses rational arithmetic.
        assert_eq!(health.self_intersections.unwrap().overlapping_pairs, 559);
    }
}
