//! Functions for tests that compare the walk with the exhaustive oracle, for various shapes, scales
//! and paths.

mod admissible;
mod certificate;
mod cold;
mod flush;
mod reference;
mod rolling;

use glam::{DQuat, DVec3};

use super::*;
use crate::algebra::Random;
use crate::algebra::{Placement, Pose};
use crate::body::{Polytope, Provenance, convex_hull};

const SEED: u64 = 0x5eed_0de7;

fn rotation(rng: &mut Random) -> DQuat {
    let axis = rng.direction();
    DQuat::from_axis_angle(axis, std::f64::consts::TAU * rng.unit())
}

fn solid(points: &[DVec3]) -> Polytope {
    convex_hull(points, 1e-9 * points.iter().fold(0.0, |m: f64, p| m.max(p.length())))
        .unwrap()
        .into_polytope()
        .unwrap()
        .0
}

fn cuboid(half: DVec3) -> Polytope {
    let corner = |k: u32| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * half;
    solid(&(0..8).map(corner).collect::<Vec<_>>())
}

fn sign(bit: u32) -> f64 {
    if bit == 0 { -1.0 } else { 1.0 }
}

fn circle(n: u32, radius: f64, z: f64) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |k| {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
        DVec3::new(radius * c, radius * s, z)
    })
}

fn prism(n: u32, radius: f64, half: f64) -> Polytope {
    solid(&circle(n, radius, -half).chain(circle(n, radius, half)).collect::<Vec<_>>())
}

fn ellipsoid(rng: &mut Random, n: usize, radii: DVec3) -> Polytope {
    solid(&(0..n).map(|_| rng.direction() * radii).collect::<Vec<_>>())
}

fn plate(n: u32, radius: f64) -> Polytope {
    Polytope::from_polygon(circle(n, radius, 0.0).collect(), DVec3::Z, Provenance::Original).unwrap()
}

fn tetra(height: f64) -> Polytope {
    solid(&circle(3, 1.0, 0.0).chain([DVec3::new(0.1, 0.2, height)]).collect::<Vec<_>>())
}

pub(super) fn scaled(polytope: &Polytope, factor: f64) -> Polytope {
    if polytope.is_flat() {
        let points = polytope.face_vertices(0).iter().map(|v| polytope.vertex(v) * factor).collect();
        Polytope::from_polygon(points, polytope.plane(0).normal, Provenance::Original).unwrap()
    } else {
        solid(&polytope.vertices().iter().map(|&v| v * factor).collect::<Vec<_>>())
    }
}

pub(super) fn shapes() -> Vec<(&'static str, Polytope)> {
    let mut rng = Random::new(SEED);
    vec![
        ("cube", cuboid(DVec3::ONE)),
        ("box", cuboid(DVec3::new(1.0, 0.7, 0.3))),
        ("hexagonal prism", prism(6, 0.8, 0.5)),
        ("cylinder", prism(24, 0.6, 0.9)),
        ("needle", prism(8, 0.01, 1.5)),
        ("ellipsoid 20", ellipsoid(&mut rng, 20, DVec3::new(1.0, 0.7, 0.6))),
        ("ellipsoid 80", ellipsoid(&mut rng, 80, DVec3::new(0.9, 0.8, 0.5))),
        ("tetrahedron", tetra(1.2)),
        ("sliver", tetra(1e-4)),
        ("square plate", plate(4, 1.0)),
        ("triangle plate", plate(3, 0.9)),
        ("polygon plate", plate(11, 0.7)),
    ]
}

/// Returns a random pose of body a near b. In most cases the bodies overlap.
fn random_pose(rng: &mut Random, a: &Polytope, b: &Polytope) -> Pose {
    let rotation = match rng.below(4) {
        0 => DQuat::IDENTITY,
        1 => {
            // A rotation that permutes the axes, within rounding.
            let quarter = std::f64::consts::FRAC_PI_2;
            DQuat::from_rotation_x(quarter * rng.below(4) as f64)
                * DQuat::from_rotation_z(quarter * rng.below(4) as f64)
        }
        _ => rotation(rng),
    };
    let direction = match rng.below(4) {
        0 => [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z][rng.below(6)],
        _ => rng.direction(),
    };
    let centred = Pose { rotation, translation: b.centroid() - rotation * a.centroid() };
    let placement = centred.placement();
    let cso = cso::Cso { a, b, pose_ba: &placement };
    let (_, reach) = cso.support(HubPair { a: 0, b: 0 }, direction);
    let depth = match rng.below(4) {
        0 => 1.0,
        1 => 1e-3 * rng.unit(),
        _ => rng.unit(),
    };
    Pose { translation: centred.translation + direction * (reach * (1.0 - depth)), ..centred }
}

/// Returns the vertex that is farthest along `direction`, by testing all vertices.
fn farthest(polytope: &Polytope, direction: DVec3) -> u32 {
    let height = |v: &u32| direction.dot(polytope.vertex(*v));
    (0..polytope.vertices().len() as u32).max_by(|v, w| height(v).total_cmp(&height(w))).unwrap()
}

/// Asserts the identities that every answer must satisfy, even if it is not optimal.
fn assert_identities(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, what: &str) {
    assert_identities_within(a, b, pose_ba, answer, 1e-12, what);
}

/// Does the same as [`assert_identities`] for bodies whose supports are exact only within
/// `share` of the size.
fn assert_identities_within(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, share: f64, what: &str) {
    let size = a.radius() + b.radius();
    let Depth { point_a, point_b, normal, depth, hub, .. } = *answer;
    assert!(normal.is_finite() && point_a.is_finite() && point_b.is_finite(), "{what}: {answer:?}");
    assert!((normal.length() - 1.0).abs() < 1e-14, "{what}: {answer:?}");
    let cso = cso::Cso { a, b, pose_ba };
    let (reach_a, reach_b) = (farthest(a, cso.toward_b(normal)), farthest(b, normal));
    let scan = normal.dot(b.vertex(reach_b)) - normal.dot(cso.point_a(reach_a));
    assert!((depth - scan).abs() <= share * size, "{what}: depth {depth}, h(n) {scan}");
    assert!((normal.dot(cso.vertex(hub)) - scan).abs() <= share * size, "{what}: the hub does not support n");
    assert!((point_a - point_b + depth * normal).length() <= 1e-12 * size, "{what}: {answer:?}");
    let height_b = normal.dot(point_b) - normal.dot(b.vertex(reach_b));
    assert!(height_b.abs() <= (2e-9 + share) * size, "{what}: point_b off the supporting plane by {height_b}");
}

/// Returns how far `p` (in the polytope's frame) lies outside the polytope.
fn outside(polytope: &Polytope, p: DVec3) -> f64 {
    polytope.planes().iter().map(|plane| plane.height(p)).fold(f64::NEG_INFINITY, f64::max)
}

/// Asserts that both points lie on the surfaces, within `share` of the size.
fn assert_points_on_bodies(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, share: f64, what: &str) {
    let slack = share * (a.radius() + b.radius());
    let (a_out, b_out) = (outside(a, pose_ba.inverse_point(answer.point_a)), outside(b, answer.point_b));
    assert!(a_out.abs() <= slack && b_out.abs() <= slack, "{what}: {a_out} {b_out} {answer:?}");
}

#[derive(Default)]
struct Tally {
    poses: u32,
    local: u32,
    worst: f64,
}

impl Tally {
    fn add(&mut self, answer: f64, exact: f64, size: f64) {
        self.poses += 1;
        if answer > exact + 1e-9 * size {
            self.local += 1;
            self.worst = self.worst.max((answer - exact) / size);
        }
    }

    fn share(&self) -> f64 {
        f64::from(self.local) / f64::from(self.poses.max(1))
    }
}
