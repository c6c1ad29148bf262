//! Tests the patches of simple shapes and real models with the checks of `contain::oracle`, and
//! compares the numbers of patches with the paper's Table 1.

use glam::DVec3;

use super::decompose;
use crate::algebra::Random;
use crate::body::decompose::contain::oracle::{assert_no_crossing, assert_partition, assert_samples_inside};
use crate::body::decompose::facet::{Facets, Surface};
use crate::body::decompose::grow::{Grower, Verdict};
use crate::body::precision::coordinate_step;
use crate::body::shapes::{model, torus};
use crate::body::{Body, BodySettings, HalfEdges, Mesh, PolygonSoup, Provenance};

const SEED: u64 = 0x2002_0606;
/// Relative to the body's size: distance up to which a point counts as on the hull or on the
/// surface. This distance is larger than the largest noise of a model.
const SLACK: f64 = 1e-4;
/// Relative to the slack: depth up to which the surface may enter a piece.
const CROSSING: f64 = 0.1;
/// The slack for the shapes that these tests build. These shapes have no noise.
const EXACT_SLACK: f64 = 1e-8;

fn build(soup: &PolygonSoup) -> Body {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Body::from_soup(soup, &settings, &mut |_| ()).unwrap()
}

fn judge(body: &Body, slack: f64) {
    assert_partition(body, slack * body.size());
    assert_no_crossing(body, CROSSING * slack * body.size());
    if body.mesh().is_closed() {
        assert_samples_inside(body, slack * body.size(), 20, SEED);
    }
}

/// Builds a prism over a simple polygon. The polygon is counter-clockwise in x, y.
fn prism(outline: &[(f64, f64)]) -> PolygonSoup {
    let n = outline.len() as u32;
    let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.iter().map(move |&(x, y)| DVec3::new(x, y, z))).collect();
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
    soup.push_face(&(0..n).rev().collect::<Vec<_>>());
    soup.push_face(&(n..2 * n).collect::<Vec<_>>());
    for k in 0..n {
        soup.push_face(&[k, (k + 1) % n, n + (k + 1) % n, n + k]);
    }
    soup
}

/// Builds a solid of revolution about z. The profile of (radius, z) starts and ends on the axis,
/// and the outside is to the right of the profile.
fn revolve(profile: &[(f64, f64)], segments: u32) -> PolygonSoup {
    let mut soup = PolygonSoup::new();
    for s in 0..segments {
        let (sin, cos) = (f64::from(s) / f64::from(segments) * std::f64::consts::TAU).sin_cos();
        soup.vertices.extend(profile.iter().map(|&(r, z)| DVec3::new(r * cos, r * sin, z)));
    }
    let rings = profile.len() as u32;
    for s in 0..segments {
        let (here, there) = (s * rings, (s + 1) % segments * rings);
        for k in 0..rings - 1 {
            soup.push_face(&[here + k, there + k, there + k + 1, here + k + 1]);
        }
    }
    soup
}

fn cup() -> PolygonSoup {
    revolve(&[(0.0, 0.0), (1.0, 0.0), (1.2, 2.0), (1.1, 2.0), (0.9, 0.2), (0.0, 0.2)], 24)
}

fn box_with_hole() -> PolygonSoup {
    let square = |half: f64, z: f64| {
        [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(x, y)| DVec3::new(half * f64::from(x), half * f64::from(y), z))
    };
    let vertices = [square(2.0, 0.0), square(1.0, 0.0), square(2.0, 1.0), square(1.0, 1.0)].concat();
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
    for k in 0..4 {
        let l = (k + 1) % 4;
        soup.push_face(&[k, l, 8 + l, 8 + k]);
        soup.push_face(&[4 + l, 4 + k, 12 + k, 12 + l]);
        soup.push_face(&[8 + k, 8 + l, 12 + l, 12 + k]);
        soup.push_face(&[l, k, 4 + k, 4 + l]);
    }
    soup
}

#[test]
fn pieces_do_not_cover_notches_of_prisms() {
    let l = prism(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]);
    let notch =
        prism(&[(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (2.0, 2.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]);
    let star = prism(
        &(0..10)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 5.0).sin_cos();
                let r = if k % 2 == 0 { 2.0 } else { 0.8 };
                (r * cos, r * sin)
            })
            .collect::<Vec<_>>(),
    );
    for (soup, most) in [(l, 2), (notch, 4), (star, 12)] {
        let body = build(&soup);
        judge(&body, EXACT_SLACK);
        assert!(body.polytopes().len() <= most, "{} pieces", body.polytopes().len());
    }
}

#[test]
fn pieces_do_not_cover_a_cups_cavity() {
    let body = build(&cup());
    judge(&body, EXACT_SLACK);
    let tea = DVec3::new(0.1, 0.2, 1.0);
    assert!(body.polytopes().iter().all(|p| p.planes().iter().any(|plane| plane.height(tea) > 0.0)));
    // The wall of the cavity needs a piece for each of its 24 segments.
    assert!(body.polytopes().len() <= 40, "{} pieces", body.polytopes().len());
}

#[test]
fn pieces_do_not_cover_a_hole() {
    let body = build(&box_with_hole());
    judge(&body, EXACT_SLACK);
    assert_eq!(body.polytopes().len(), 4);
}

#[test]
fn convex_solid_has_one_piece_with_original_faces() {
    let body = build(&revolve(&[(0.0, -1.0), (0.7, -0.7), (1.0, 0.0), (0.7, 0.7), (0.0, 1.0)], 40));
    judge(&body, EXACT_SLACK);
    assert_eq!(body.polytopes().len(), 1);
    let polytope = &body.polytopes()[0];
    assert_eq!(polytope.face_count(), 160);
    assert!((0..160).all(|f| polytope.face_provenance(f) == Provenance::Original));
}

#[test]
fn an_open_prism_has_valid_pieces() {
    let mut soup = prism(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]);
    // Remove the top face.
    let lid = soup.face(1).to_vec();
    soup = PolygonSoup {
        vertices: soup.vertices.clone(),
        ..(0..soup.face_count()).filter(|&f| f != 1).fold(PolygonSoup::new(), |mut open, f| {
            open.push_face(soup.face(f));
            open
        })
    };
    assert_eq!(lid.len(), 6);
    let body = build(&soup);
    judge(&body, EXACT_SLACK);
}

#[test]
fn torus_pieces_do_not_exceed_table_1() {
    let mesh = torus(1.0, 0.4, 50, 20);
    assert_eq!(mesh.triangles().len(), 2000);
    let body = Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap();
    judge(&body, EXACT_SLACK);
    assert!(body.polytopes().len() <= 67, "{} pieces", body.polytopes().len());
}

#[test]
fn small_models_have_few_valid_pieces() {
    for (name, most) in [
        ("paper/teacup_500.obj", 178),
        // The paper's spoon has 78 pieces. The test `this_spoon_needs_more_patches_than_the_papers`
        // shows that this spoon needs more.
        ("paper/teaspoon_336.obj", 110),
        ("parts/chess_knight_1000.obj", 145),
        ("parts/low_poly_bunny.obj", 400),
        ("parts/plate_holes.obj", 200),
        ("pairs/hole_round_8mm_factory.obj", 400),
        ("nasty/hourglass_pinched_vertex.obj", 40),
    ] {
        let Some(soup) = model(name) else { return };
        let body = build(&soup);
        judge(&body, SLACK);
        assert!(body.polytopes().len() <= most, "{name}: {} pieces", body.polytopes().len());
    }
}

#[test]
fn the_same_model_gives_the_same_pieces() {
    let [one, other] = [build(&cup()), build(&cup())];
    let triangles = |body: &Body| body.pieces().iter().map(|piece| piece.triangles().to_vec()).collect::<Vec<_>>();
    assert_eq!(triangles(&one), triangles(&other));
}

/// Builds a smooth egg with one dent.
fn dented_egg(rings: u32, segments: u32) -> PolygonSoup {
    let point = |polar: f64, turn: f64| {
        let unit = DVec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos());
        let from_dent = 1.0 - unit.dot(DVec3::new(0.6, 0.3, 0.74).normalize());
        let height = 1.0 - 0.12 * (-from_dent / 0.01).exp();
        let width = 1.0 + 0.15 * unit.z;
        unit * DVec3::new(width, width, 1.4) * height
    };
    let mut soup = PolygonSoup::new();
    let (turn, ring) = (std::f64::consts::TAU / f64::from(segments), std::f64::consts::PI / f64::from(rings));
    for k in 1..rings {
        soup.vertices.extend((0..segments).map(|s| point(ring * f64::from(k), turn * f64::from(s))));
    }
    soup.vertices.extend([point(0.0, 0.0), point(std::f64::consts::PI, 0.0)]);
    let (top, bottom) = ((rings - 1) * segments, (rings - 1) * segments + 1);
    for s in 0..segments {
        let next = (s + 1) % segments;
        soup.push_face(&[top, s, next]);
        soup.push_face(&[bottom, top - segments + next, top - segments + s]);
        for k in 0..rings - 2 {
            let (above, below) = (k * segments, (k + 1) * segments);
            soup.push_face(&[above + s, below + s, below + next]);
            soup.push_face(&[above + s, below + next, above + next]);
        }
    }
    soup
}

/// Returns the patches of a soup. Patches with at least `wide_from` points use a wide hull.
fn patches(soup: &PolygonSoup, wide_from: usize) -> Vec<Vec<u32>> {
    let (mesh, _) = Mesh::from_soup(soup).unwrap();
    let (edges, tree) = (HalfEdges::new(&mesh), mesh.tree());
    let surface = Surface::new(&mesh, &edges, coordinate_step(mesh.vertices()), BodySettings::HAPTIC);
    let facets = Facets::of(&surface);
    let mut grower = Grower::new(surface, &facets, &tree).with_wide_from(wide_from);
    decompose(&mut grower, &mut |_| ()).into_iter().map(|patch| patch.facets).collect()
}

#[test]
fn wide_and_small_hulls_give_the_same_patches() {
    let models = ["paper/teacup_500.obj", "parts/low_poly_bunny.obj", "parts/chess_knight_1000.obj"];
    let soups = models.iter().filter_map(|name| model(name)).chain([dented_egg(36, 40), cup(), box_with_hole()]);
    for (k, soup) in soups.enumerate() {
        assert_eq!(patches(&soup, 4), patches(&soup, usize::MAX), "model {k}");
    }
}

#[test]
fn a_dented_egg_has_few_large_pieces() {
    let body = build(&dented_egg(60, 60));
    judge(&body, EXACT_SLACK);
    assert!(body.polytopes().len() <= 80, "{} pieces", body.polytopes().len());
    let largest = body.pieces().iter().map(|piece| piece.triangles().len()).max().unwrap();
    assert!(largest > 2000, "{largest} triangles");
}

/// Returns a lower bound of the number of patches. The bound is the size of a set of facets,
/// because each patch can contain only one facet of this set. Patches need not be connected for
/// this bound. Tabu search enlarges this independent set. Each step adds the best facet that is not
/// tabu, and removes the facets that could share a patch with the added one.
fn fewest_patches(soup: &PolygonSoup, steps: usize) -> usize {
    let (mesh, _) = Mesh::from_soup(soup).unwrap();
    let (edges, tree) = (HalfEdges::new(&mesh), mesh.tree());
    let surface = Surface::new(&mesh, &edges, coordinate_step(mesh.vertices()), BodySettings::default().flatness);
    let facets = Facets::of(&surface);
    let mut grower = Grower::new(surface, &facets, &tree);
    let n = facets.len();
    let mut friends: Vec<Vec<usize>> = vec![Vec::new(); n];
    for f in 0..n {
        for g in 0..f {
            grower.load(&[f as u32]);
            if grower.try_add(&[g as u32]) != Verdict::Refused {
                friends[f].push(g);
                friends[g].push(f);
            }
        }
    }
    let mut random = Random::new(SEED);
    let (mut chosen, mut tabu, mut best) = (vec![false; n], vec![0; n], 0);
    for step in 1..=steps {
        let cost = |f: usize| friends[f].iter().filter(|&&g| chosen[g]).count();
        let open = (0..n).filter(|&f| !chosen[f] && tabu[f] < step);
        let Some((_, _, f)) = open.map(|f| (cost(f), random.bits(), f)).min() else { continue };
        for &g in &friends[f] {
            if std::mem::take(&mut chosen[g]) {
                tabu[g] = step + 5 + random.below(10);
            }
        }
        chosen[f] = true;
        best = best.max(chosen.iter().filter(|&&c| c).count());
    }
    best
}

#[test]
fn this_spoon_needs_more_patches_than_the_papers() {
    let Some(spoon) = model("paper/teaspoon_336.obj") else { return };
    // A long search finds a lower bound of 102 patches. The spoon of the paper has 78 patches. The
    // paper's spoon is another mesh with the same number of triangles.
    assert!(fewest_patches(&spoon, 1500) > 90);
}

#[test]
#[ignore = "takes a minute in the development profile"]
fn large_model_pieces_do_not_exceed_table_1() {
    for (name, most) in [
        ("paper/armadillo_31240.obj", 6950),
        ("paper/intestine_colon_male_24846.obj", 4980),
        // The paper's intestine is another model and has 9913 patches. The bound here follows from
        // palpus' own result.
        ("paper/intestine_small_female_24846.obj", 10_650),
        ("parts/fandisk.obj", 4000),
        ("pairs/peg_round_8mm.obj", 1),
        ("pairs/bolt_m16_loose.obj", 3200),
    ] {
        let Some(soup) = model(name) else { return };
        let body = build(&soup);
        judge(&body, SLACK);
        assert!(body.polytopes().len() <= most, "{name}: {} pieces", body.polytopes().len());
    }
}
