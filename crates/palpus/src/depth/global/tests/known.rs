//! Tests known depths, and verifies every result on the surfaces.

use super::*;
use crate::depth::{Certainty, CertificateMemory, DepthScratch, depth_proven};

const SEED: u64 = 0x61_0ba1;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, y, z))
}

#[test]
fn bar_in_groove_has_its_known_depth() {
    let (a, b) = (body(&cuboid(DVec3::new(0.8, 0.8, 4.0))), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let settings = GlobalSettings { gap: 1e-6, ..GlobalSettings::new(&a, &b) };
    // The bar is in the left wall, in the floor, free in the groove, in the left wall from outside,
    // and in the corner.
    for (pose, depth) in [
        (at(0.7, 1.5, -1.0), 0.3),
        (at(1.1, 0.75, -1.0), 0.25),
        (at(1.1, 1.1, -1.0), 0.0),
        (at(-0.5, 1.5, -1.0), 0.3),
        (at(0.1, 0.1, -1.0), 0.9),
    ] {
        let answer = query.run(&pose, &settings, &mut GlobalMemory::default());
        assert!(answer.certified, "{answer:?}");
        assert!(answer.lower <= depth + 1e-9 && depth <= answer.upper + 1e-9, "{depth}: {answer:?}");
    }
}

#[test]
fn containment_counts_as_overlap() {
    let (small, large) = (body(&cuboid(DVec3::splat(0.2))), body(&cuboid(DVec3::splat(2.0))));
    let (inside_small, inside_large) = (interior(&small), interior(&large));
    let query = GlobalDepth::new(&small, &inside_small, &large, &inside_large);
    let settings = GlobalSettings::new(&small, &large);
    let answer = query.run(&at(0.3, 0.9, 0.9), &settings, &mut GlobalMemory::default());
    assert_eq!(answer.containment, Containment::AInB);
    assert!((answer.upper - 0.5).abs() < 1e-8 && (answer.lower - 0.5).abs() < 1e-8, "{answer:?}");
    assert!(answer.distance.is_some_and(|distance| (distance - 0.3).abs() < 1e-12));
    let query = ContainmentQuery::new(&large, &small);
    assert_eq!(query.run(&at(-0.3, -0.9, -0.9)), Containment::BInA);
    assert_eq!(query.run(&at(0.1, -0.9, -0.9)), Containment::Neither);
    assert_eq!(query.run(&at(5.0, -0.9, -0.9)), Containment::Neither);
}

#[test]
fn convex_pairs_get_the_certified_depth() {
    let mut random = Random::new(SEED);
    let hull = |random: &mut Random, n: usize| {
        let points: Vec<DVec3> = (0..n).map(|_| random.direction() * 0.8).collect();
        Body::from_convex(&points).expect("a convex body")
    };
    for case in 0..20 {
        let (a, b) = (hull(&mut random, 8 + case), hull(&mut random, 20 + 20 * case));
        let (inside_a, inside_b) = (interior(&a), interior(&b));
        let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
        let pose = Pose { translation: random.vector() * 0.4, ..random_pose(&mut random, 0.0) };
        let answer = query.run(&pose, &GlobalSettings::new(&a, &b), &mut GlobalMemory::default());
        let (mut memory, mut scratch) = (CertificateMemory::new(), DepthScratch::new());
        let (p, q) = (&a.polytopes()[0], &b.polytopes()[0]);
        let exact = depth_proven(p, q, &pose.placement(), &[], &mut memory, &mut scratch);
        assert_eq!(exact.certainty, Certainty::GloballyOptimal);
        let size = a.size().min(b.size());
        assert!(
            answer.upper - exact.depth <= 1e-8 * size,
            "seed {SEED}, case {case}: {answer:?}, exact {}",
            exact.depth
        );
        assert!(answer.evaluations <= 64, "seed {SEED}, case {case}: a convex pair needs no search, {answer:?}");
        assert!(
            exact.depth - answer.lower <= 1e-8 * size,
            "seed {SEED}, case {case}: {answer:?}, exact {}",
            exact.depth
        );
    }
}

#[test]
fn no_random_translation_beats_the_lower_bound() {
    let mut random = Random::new(SEED);
    let (a, b) = (body(&ell()), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let mut deep = 0;
    for case in 0..30 {
        let pose = random_pose(&mut random, 1.2);
        let answer = query.run(&pose, &GlobalSettings::new(&a, &b), &mut GlobalMemory::default());
        let surfaces = Surfaces::new((&a, &inside_a.components), (&b, &inside_b.components), &pose);
        assert!(surfaces.is_free(answer.translation), "seed {SEED}, case {case}: {answer:?}");
        assert!(answer.certified && (answer.translation.length() - answer.upper).abs() < 1e-12);
        for _ in 0..300 {
            let t = random.direction() * (answer.lower * random.unit().cbrt());
            assert!(answer.lower == 0.0 || !surfaces.is_free(t), "seed {SEED}, case {case}: {t} is free; {answer:?}");
        }
        deep += usize::from(answer.lower > 0.0);
    }
    assert!(deep > 10, "only {deep} poses overlap");
}

#[test]
fn bounds_stay_valid_when_budget_is_spent() {
    let (a, b) = (body(&ell()), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let pose = at(0.3, 0.4, 0.2);
    let full =
        query.run(&pose, &GlobalSettings { gap: 1e-6, ..GlobalSettings::new(&a, &b) }, &mut GlobalMemory::default());
    for budget in [0, 1, 30, 100] {
        let settings = GlobalSettings { gap: 1e-6, budget, outside: false };
        let answer = query.run(&pose, &settings, &mut GlobalMemory::default());
        assert!(answer.lower <= full.upper && full.lower <= answer.upper, "{budget}: {answer:?} {full:?}");
    }
}

#[test]
fn pocket_does_not_count_as_free_with_outside() {
    // A hollow box has two closed surfaces, and the inner surface is inside out.
    let mut shell = cuboid(DVec3::splat(3.0));
    let hollow = placed(cuboid(DVec3::splat(2.0)), &at(0.5, 0.5, 0.5));
    let first = shell.vertices.len() as u32;
    shell.vertices.extend(&hollow.vertices);
    for face in [[0, 1, 2, 3], [7, 6, 5, 4], [4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3]] {
        shell.push_face(&face.map(|v| first + v));
    }
    let (a, b) = (body(&cuboid(DVec3::ONE)), body(&shell));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let settings = GlobalSettings { gap: 1e-3, ..GlobalSettings::new(&a, &b) };
    // The first pose is free in the hollow; the second is 0.1 deep in the wall.
    for (x, depth) in [(1.0, 0.0), (0.4, 0.1)] {
        let answer = query.run(&at(x, 1.0, 1.0), &settings, &mut GlobalMemory::default());
        assert!((answer.upper - depth).abs() < 1e-6, "{answer:?}");
        let outer =
            query.run(&at(x, 1.0, 1.0), &GlobalSettings { outside: true, ..settings }, &mut GlobalMemory::default());
        assert!(outer.lower <= 1.0 + x && outer.upper >= 1.0 + x - 1e-9, "{outer:?}");
        assert!(outer.lower >= depth - 1e-6);
    }
}

#[test]
fn open_surface_has_no_inside() {
    // A square sheet that crosses the block with the groove.
    let mut sheet = PolygonSoup { vertices: vec![], ..PolygonSoup::new() };
    sheet.vertices.extend([(0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)].map(|(x, y)| DVec3::new(x, y, 0.0)));
    sheet.push_face(&[0, 1, 2, 3]);
    let (a, b) = (body(&sheet), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    assert_eq!(inside_a.cell_count(), 0);
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let answer = query.run(&at(-1.5, -1.5, 0.8), &GlobalSettings::new(&a, &b), &mut GlobalMemory::default());
    assert!(answer.lower <= 0.2 && (answer.upper - 0.2).abs() < 0.05, "{answer:?}");
}
