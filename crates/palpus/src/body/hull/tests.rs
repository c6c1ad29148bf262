//! Checks the properties that every hull must have, on regular and degenerate point sets.

use glam::{DQuat, DVec3};

use super::*;
use crate::algebra::Random;

const SEED: u64 = 0x6875_6c6c;

fn rotation(random: &mut Random) -> DQuat {
    DQuat::from_xyzw(random.signed(), random.signed(), random.signed(), random.signed()).normalize()
}

fn size_of(points: &[DVec3]) -> f64 {
    points.iter().fold(0.0, |size: f64, p| size.max(p.abs().max_element()))
}

fn volume(polytope: &Polytope) -> f64 {
    let o = polytope.centroid();
    let mut sum = 0.0;
    for f in 0..polytope.face_count() as u32 {
        let corners = polytope.face_vertices(f);
        let at = |k: usize| polytope.vertex(corners.at(k)) - o;
        for k in 2..corners.len() {
            sum += at(0).dot(at(k - 1).cross(at(k)));
        }
    }
    sum / 6.0
}

/// Checks all properties of a hull of `points`. Failure messages start with `what`.
fn assert_hull(points: &[DVec3], hull: &Hull, coplanar: f64, what: &str) {
    let slack = 2.0 * coplanar + 1e-13 * size_of(points);
    match hull {
        Hull::Point { input } => {
            let p = points[*input as usize];
            assert!(points.iter().all(|q| q.distance(p) <= slack), "{what}: the points differ");
        }
        Hull::Segment { inputs } => {
            let [p, q] = inputs.map(|k| points[k as usize]);
            for &x in points {
                let nearest = p + (q - p) * crate::algebra::closest_on_segment(x, p, q);
                assert!(x.distance(nearest) <= slack, "{what}: {x} is off the segment");
            }
        }
        Hull::Polygon { polytope, inputs } | Hull::Solid { polytope, inputs } => {
            assert_eq!(polytope.validate(coplanar), Ok(()), "{what}");
            assert_eq!(polytope.is_flat(), matches!(hull, Hull::Polygon { .. }), "{what}");
            assert_eq!(inputs.len(), polytope.vertices().len(), "{what}");
            for (v, &k) in inputs.iter().enumerate() {
                assert_eq!(polytope.vertex(v as u32), points[k as usize], "{what}: vertex {v}");
            }
            for (f, plane) in polytope.planes().iter().enumerate() {
                for &p in points {
                    assert!(plane.height(p) <= slack, "{what}: {p} is {:e} above face {f}", plane.height(p));
                }
            }
        }
    }
}

fn solid(points: &[DVec3], coplanar: f64, what: &str) -> Polytope {
    let hull = convex_hull(points, coplanar).unwrap();
    assert_hull(points, &hull, coplanar, what);
    match hull {
        Hull::Solid { polytope, .. } => polytope,
        other => panic!("{what}: not a solid but {other:?}"),
    }
}

fn polygon(points: &[DVec3], coplanar: f64, what: &str) -> Polytope {
    let hull = convex_hull(points, coplanar).unwrap();
    assert_hull(points, &hull, coplanar, what);
    match hull {
        Hull::Polygon { polytope, .. } => polytope,
        other => panic!("{what}: not a polygon but {other:?}"),
    }
}

/// Returns the points of a grid in the unit cube, with `n` steps per side.
fn grid(n: u32) -> Vec<DVec3> {
    let steps = 0..=n;
    let mut points = Vec::new();
    for x in steps.clone() {
        for y in steps.clone() {
            for z in steps.clone() {
                points.push(DVec3::new(x.into(), y.into(), z.into()) / f64::from(n));
            }
        }
    }
    points
}

#[test]
fn rotated_grid_cube_has_six_faces() {
    let mut random = Random::new(SEED);
    for turn in 0..20 {
        let rotation = if turn == 0 { DQuat::IDENTITY } else { rotation(&mut random) };
        let points: Vec<DVec3> = grid(5).into_iter().map(|p| rotation * p * 7.0).collect();
        let cube = solid(&points, 1e-9, "cube");
        assert_eq!((cube.vertices().len(), cube.edges().len(), cube.face_count()), (8, 12, 6), "turn {turn}");
        assert!((volume(&cube) - 343.0).abs() < 1e-9);
    }
}

#[test]
fn exactly_coplanar_facets_merge_at_distance_zero() {
    let cube = solid(&grid(6), 0.0, "exact cube");
    assert_eq!((cube.vertices().len(), cube.face_count()), (8, 6));
}

#[test]
fn flat_sets_give_polygons() {
    let square: Vec<DVec3> = grid(4).into_iter().map(|p| DVec3::new(p.x, p.y, 3.0)).collect();
    let plate = polygon(&square, 0.0, "square");
    assert_eq!(plate.vertices().len(), 4);
    let mut random = Random::new(SEED);
    for _ in 0..20 {
        let (rotation, shift) = (rotation(&mut random), random.vector() * 10.0);
        let turned: Vec<DVec3> = square.iter().map(|&p| rotation * p + shift + random.vector() * 1e-10).collect();
        let plate = polygon(&turned, 1e-9, "turned square");
        assert_eq!(plate.vertices().len(), 4);
        let normal = rotation * DVec3::Z;
        let up = convex_polygon(&turned, normal, 1e-9).unwrap().into_polytope().unwrap().0;
        assert!(up.plane(0).normal.dot(normal) > 0.999);
        let down = convex_polygon(&turned, -normal, 1e-9).unwrap().into_polytope().unwrap().0;
        assert!(down.plane(0).normal.dot(normal) < -0.999);
    }
    assert_eq!(convex_polygon(&grid(2), DVec3::Z, 1e-9).unwrap_err(), HullError::NotFlat);
}

#[test]
fn three_points_give_a_two_sided_triangle() {
    for scale in [1e-6, 1.0, 1e3] {
        let points = [DVec3::X * scale, DVec3::Y * scale, DVec3::Z * scale];
        let plate = polygon(&points, 1e-9 * scale, "triangle");
        assert_eq!((plate.vertices().len(), plate.face_count()), (3, 5));
        assert!((plate.plane(0).normal.dot(DVec3::ONE.normalize()).abs() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn points_and_segments_are_recognised() {
    let p = DVec3::new(0.1, 0.2, 0.3);
    assert!(matches!(convex_hull(&[p], 0.0), Ok(Hull::Point { input: 0 })));
    assert!(matches!(convex_hull(&[p, p, p], 0.0), Ok(Hull::Point { input: 0 })));
    assert!(matches!(convex_hull(&[p, p + DVec3::X * 1e-12], 1e-9), Ok(Hull::Point { .. })));
    let line: Vec<DVec3> = (0..9).map(|k| DVec3::ONE * f64::from((k * 4) % 9)).collect();
    let Ok(Hull::Segment { mut inputs }) = convex_hull(&line, 0.0) else { panic!("the hull is not a segment") };
    inputs.sort_unstable();
    assert_eq!(inputs.map(|k| line[k as usize].x), [0.0, 8.0]);
}

#[test]
fn bad_input_gives_an_error() {
    assert_eq!(convex_hull(&[], 1e-9).unwrap_err(), HullError::Empty);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let points = [DVec3::ZERO, DVec3::new(0.0, bad, 0.0)];
        assert_eq!(convex_hull(&points, 1e-9).unwrap_err(), HullError::NotFinite(1));
    }
    assert_eq!(convex_hull(&[DVec3::X * 1e200], 1e-9).unwrap_err(), HullError::TooLarge(0));
}

#[test]
fn the_hull_does_not_depend_on_point_order() {
    let mut random = Random::new(SEED);
    for round in 0..60 {
        let n = 4 + random.below(40);
        let mut points: Vec<DVec3> =
            (0..n).map(|_| if round % 2 == 0 { random.vector() } else { (random.vector() * 2.5).round() }).collect();
        let sorted = |points: &[DVec3]| match convex_hull(points, 1e-9).unwrap() {
            Hull::Point { .. } | Hull::Segment { .. } => Vec::new(),
            hull => hull.into_polytope().unwrap().0.vertices().to_vec(),
        };
        let first = sorted(&points);
        for _ in 0..5 {
            random.shuffle(&mut points);
            assert_eq!(first, sorted(&points), "seed {SEED:#x}, round {round}");
        }
    }
}

#[test]
fn random_sets_of_every_kind_have_valid_hulls() {
    let mut random = Random::new(SEED);
    for round in 0..4000 {
        let n = 1 + random.below(60);
        let kind = random.below(8);
        let stretch = match random.below(4) {
            0 => DVec3::ONE,
            1 => DVec3::new(1.0, 1.0, 1e-8),
            2 => DVec3::new(1.0, 1e-5, 1e-5),
            _ => DVec3::new(1.0, 1e-3, 1e-7),
        };
        let scale = 10f64.powi(random.below(10) as i32 - 6);
        let rotation = rotation(&mut random);
        let shift = if random.below(2) == 0 { DVec3::ZERO } else { random.vector() * scale };
        let points: Vec<DVec3> = (0..n)
            .map(|k| {
                let p = match kind {
                    0 => random.vector(),
                    1 => random.vector().normalize_or_zero(),
                    2 => (random.vector() * 2.5).round(),
                    3 => (random.vector() * 1.5).round() + random.vector() * 1e-12,
                    4 => {
                        let angle = k as f64 * std::f64::consts::TAU / n as f64;
                        DVec3::new(angle.cos(), angle.sin(), random.vector().z.signum())
                    }
                    5 => random.vector() * if random.below(3) == 0 { 1.0 } else { 1e-9 },
                    6 => (random.vector() * 1.5).round() * 0.5 + random.vector() * 2e-9,
                    _ => {
                        let p = random.vector();
                        DVec3::new(p.x, p.y, p.x * p.x * 1e-7)
                    }
                };
                if kind == 2 { p } else { rotation * (p * stretch) * scale + shift }
            })
            .collect();
        let coplanar = if random.below(4) == 0 { 0.0 } else { 1e-9 * size_of(&points) };
        let what = format!("seed {SEED:#x}, round {round}, kind {kind}, stretch {stretch}, scale {scale}");
        let hull = convex_hull(&points, coplanar).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_hull(&points, &hull, coplanar, &what);
    }
}

#[test]
fn extreme_scales_never_panic() {
    let mut random = Random::new(SEED);
    let mut refused = 0;
    for _ in 0..3000 {
        let n = 1 + random.below(20);
        let scale = 10f64.powi(random.below(138) as i32 - 69);
        let points: Vec<DVec3> = (0..n)
            .map(|_| {
                let mut wild = || random.signed().signum() * 10f64.powi(random.below(9) as i32 * 40 - 320);
                let p = DVec3::new(wild(), wild(), wild());
                match random.below(3) {
                    0 => p,
                    1 => random.vector() * scale,
                    _ => (random.vector() * 1.5).round() * scale,
                }
            })
            .collect();
        refused += u32::from(matches!(convex_hull(&points, 0.0), Err(HullError::Inconsistent)));
        let _ = convex_polygon(&points, points[0], 1e-9 * scale);
    }
    assert!(refused < 300, "seed {SEED:#x}: {refused} sets gave an error");
}

#[test]
fn many_sphere_points_have_a_valid_hull() {
    let mut random = Random::new(SEED);
    let points: Vec<DVec3> = (0..3000).map(|_| random.vector().normalize_or_zero()).collect();
    let ball = solid(&points, 1e-9, "sphere");
    assert!(ball.vertices().len() > 2990);
    assert!((volume(&ball) - 4.0 / 3.0 * std::f64::consts::PI).abs() < 0.02);
}

/// Regression test: lattices away from the origin have rounding errors of an ulp. An earlier
/// version returned [`HullError::Inconsistent`] for them.
#[test]
fn a_lattice_with_rounding_errors_has_a_hull() {
    let mut random = Random::new(SEED);
    for case in 0..3000 {
        let n = 8 + random.below(120);
        let points: Vec<DVec3> =
            (0..n).map(|_| (random.vector() * 3.0).round() / 3.0 + DVec3::new(0.1, 0.2, 0.3)).collect();
        for coplanar in [0.0, 1e-12, 1e-9] {
            let hull = convex_hull(&points, coplanar);
            let hull = hull.unwrap_or_else(|error| panic!("seed {SEED:#x}, case {case}, {coplanar}: {error}"));
            if let Some((polytope, _)) = hull.into_polytope() {
                let checked = polytope.validate_topology();
                assert!(checked.is_ok(), "seed {SEED:#x}, case {case}, {coplanar}: {checked:?}");
            }
        }
    }
}
