//! Compares the corners of flush overlaps with known results.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DQuat, DVec3};

use super::*;
use crate::algebra::Pose;
use crate::algebra::Random;
use crate::body::{Admissible, Provenance, convex_hull};
use crate::collision::{Proximity, initial_features, march};

const SEED: u64 = 0xC012;
const SLOPE: f64 = 0.0875;
const WITHIN: f64 = 1e-3;

fn solid(points: &[DVec3]) -> Polytope {
    let (polytope, _) = convex_hull(points, 1e-10).unwrap().into_polytope().unwrap();
    polytope.with_provenance(|_, _| Provenance::Original)
}

fn cuboid(half: DVec3) -> Polytope {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    solid(&(0..8).map(|k| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * half).collect::<Vec<_>>())
}

/// Returns an upright prism with `sides` sides.
fn drum(sides: u32, radius: f64, half: f64) -> Polytope {
    let corner = |k: u32| {
        let angle = TAU * f64::from(k / 2) / f64::from(sides);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), if k.is_multiple_of(2) { half } else { -half })
    };
    solid(&(0..2 * sides).map(corner).collect::<Vec<_>>())
}

/// Returns the patch corners of two separate bodies, and the exact distance of the bodies.
fn corners(a: &Polytope, b: &Polytope, pose: &Pose) -> (Vec<Corner>, f64) {
    let place = pose.placement();
    let answer = march(a, b, &place, initial_features(a, b, &place));
    let Proximity::Disjoint(closest) = answer.proximity else { panic!("the bodies overlap") };
    let touch = Touch {
        features: closest.features,
        point_a: closest.point_a,
        point_b: closest.point_b,
        normal: closest.normal,
    };
    let mut patch = Patch::new();
    let none = Admissible::none();
    patch.find([a, b], &[none.border_of(0); 2], &place, &touch, SLOPE, WITHIN);
    (patch.corners().to_vec(), closest.distance)
}

/// Asserts that exactly one corner lies at each expected place (m, in the plane z = 0) and has the
/// separation (m) that is given with the place.
fn assert_corners(found: &[Corner], expected: &[(DVec3, f64)]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (place, separation) in expected {
        let is_it = |corner: &&Corner| (corner.midpoint - *place).truncate().length() < 1e-6;
        let corner = found.iter().find(is_it).unwrap_or_else(|| panic!("no corner at {place}: {found:?}"));
        assert!((corner.separation - separation).abs() < 1e-6, "{corner:?}, expected {separation}");
    }
}

const HALF: DVec3 = DVec3::new(0.03, 0.02, 0.01);

fn block() -> Polytope {
    cuboid(HALF)
}

/// Returns a table whose top is at z = 0.01.
fn table() -> Polytope {
    cuboid(DVec3::new(0.1, 0.1, 0.01))
}

#[test]
fn face_on_face_gives_corners_of_overlap() {
    let gap = 1e-4;
    let (found, distance) = corners(&block(), &table(), &Pose::from_translation(DVec3::Z * (0.02 + gap)));
    assert!((distance - gap).abs() < 1e-12);
    let at = |x: f64, y: f64| (DVec3::new(x, y, 0.0), gap);
    assert_corners(&found, &[at(0.03, 0.02), at(-0.03, 0.02), at(-0.03, -0.02), at(0.03, -0.02)]);
    // The block's middle lies over the table's edge.
    let (found, _) = corners(&block(), &table(), &Pose::from_translation(DVec3::new(0.1, 0.0, 0.02 + gap)));
    assert_corners(&found, &[at(0.1, 0.02), at(0.07, 0.02), at(0.07, -0.02), at(0.1, -0.02)]);
}

#[test]
fn tilted_block_has_a_gap_per_corner() {
    let angle = 0.3f64.to_radians();
    let lift = HALF.x * angle.sin() + HALF.z * angle.cos() + 0.01 + 1e-4;
    let (found, distance) = corners(&block(), &table(), &Pose::new(DQuat::from_rotation_y(angle), DVec3::Z * lift));
    assert!((distance - 1e-4).abs() < 1e-9);
    let (low, high) = (1e-4, 1e-4 + 2.0 * HALF.x * angle.sin());
    let (x, shift) = (HALF.x * angle.cos(), HALF.z * angle.sin());
    let at = |x: f64, y: f64, gap: f64| (DVec3::new(x - shift, y, 0.0), gap);
    assert_corners(&found, &[at(x, 0.02, low), at(x, -0.02, low), at(-x, 0.02, high), at(-x, -0.02, high)]);
}

#[test]
fn edge_gives_two_corners_vertex_gives_one() {
    // The block stands on an edge along y.
    let turn = DQuat::from_rotation_y(FRAC_PI_4);
    let low = (HALF.x + HALF.z) * FRAC_PI_4.sin();
    let (found, _) = corners(&block(), &table(), &Pose::new(turn, DVec3::Z * (0.01 + low + 1e-4)));
    assert_eq!(found.len(), 2, "{found:?}");
    assert!((found[0].midpoint - found[1].midpoint).length() > 0.0399);
    // The block stands on a vertex.
    let turn = DQuat::from_rotation_x(0.6) * turn;
    let (found, _) = corners(&block(), &table(), &Pose::new(turn, DVec3::Z * 0.06));
    assert_eq!(found.len(), 1, "{found:?}");
}

#[test]
fn parallel_edges_give_ends_of_common_stretch() {
    let wedge = solid(&[
        DVec3::new(-0.02, 0.0, 0.0),
        DVec3::new(0.02, 0.0, 0.0),
        DVec3::new(-0.02, 0.01, 0.01),
        DVec3::new(0.02, 0.01, 0.01),
        DVec3::new(-0.02, -0.01, 0.01),
        DVec3::new(0.02, -0.01, 0.01),
    ]);
    let ridge = solid(&wedge.vertices().iter().map(|v| DVec3::new(1.5 * v.x, v.y, -v.z)).collect::<Vec<_>>());
    for angle in [0.0, 1e-9, 1e-6, 1e-3] {
        let (found, _) = corners(&wedge, &ridge, &Pose::new(DQuat::from_rotation_z(angle), DVec3::Z * 1e-4));
        let ends = found.iter().filter(|corner| corner.midpoint.x.abs() > 0.0199).count();
        assert_eq!(ends, 2, "{angle}: {found:?}");
        let lateral = 0.02 * f64::sin(angle);
        assert!(found.iter().all(|corner| corner.separation <= 1e-4 + lateral + 1e-9), "{angle}: {found:?}");
    }
    // Crossing edges touch at one point.
    let (found, _) = corners(&wedge, &ridge, &Pose::new(DQuat::from_rotation_z(0.5), DVec3::Z * 1e-4));
    assert_eq!(found.len(), 1, "{found:?}");
}

#[test]
fn corner_separation_is_at_least_the_distance() {
    let mut random = Random::new(SEED);
    let bodies = [block(), drum(7, 0.02, 0.01), drum(40, 0.02, 0.01), drum(3, 0.03, 0.01)];
    for round in 0..2000 {
        let pick = |share: f64| &bodies[(share * bodies.len() as f64) as usize];
        let (a, b) = (pick(random.unit()), pick(random.unit()));
        let tilt = random.vector() * 0.03;
        let turn = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_z(TAU * random.unit());
        let place = random.vector() * DVec3::new(0.03, 0.03, 0.0) + DVec3::Z * 0.0222;
        let pose = Pose::new(turn, place);
        let placement = pose.placement();
        let answer = march(a, b, &placement, initial_features(a, b, &placement));
        if !matches!(answer.proximity, Proximity::Disjoint(_)) {
            continue;
        }
        let (found, distance) = corners(a, b, &pose);
        assert!((found[0].separation - distance).abs() < 1e-12, "seed {SEED:#x}, round {round}");
        for corner in &found {
            assert!(corner.separation >= distance - 1e-12, "seed {SEED:#x}, round {round}: {corner:?}, {distance}");
        }
    }
}

#[test]
fn many_sided_faces_fit_in_a_patch() {
    let (found, _) = corners(&drum(100, 0.02, 0.01), &table(), &Pose::from_translation(DVec3::Z * 0.0201));
    assert!((8..=PATCH_CORNERS + 1).contains(&found.len()), "{}", found.len());
    let reach = found.iter().map(|corner| corner.midpoint.truncate().length()).fold(0.0, f64::max);
    assert!(reach > 0.0199);
}
