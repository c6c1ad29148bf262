//! The shapes of the bench. Every run uses the same shapes.

use glam::{DQuat, DVec3};
use palpus::algebra::Random;
use palpus::body::{Polytope, convex_hull};

/// The seed of all shapes and poses.
pub(crate) const SEED: u64 = 0x5EED_C03E;

/// Numbers of vertices of the ellipsoid hulls.
const SIZES: [usize; 5] = [8, 20, 100, 500, 2000];

/// Returns a random rotation.
pub(crate) fn rotation(random: &mut Random) -> DQuat {
    DQuat::from_axis_angle(random.direction(), random.between(0.0, std::f64::consts::TAU))
}

/// A pair of shapes.
pub(crate) struct ShapePair {
    pub(crate) name: &'static str,
    pub(crate) a: Polytope,
    pub(crate) b: Polytope,
}

/// Returns all pairs: ellipsoids from small to large, then boxes, cylinders and needles.
pub(crate) fn all() -> Vec<ShapePair> {
    let mut random = Random::new(SEED);
    let names = ["hull 8", "hull 20", "hull 100", "hull 500", "hull 2000"];
    let mut pairs: Vec<_> = names
        .into_iter()
        .zip(SIZES)
        .map(|(name, n)| {
            let a = ellipsoid(&mut random, n, DVec3::new(1.0, 0.8, 0.6));
            ShapePair { name, a, b: ellipsoid(&mut random, n, DVec3::new(0.9, 0.9, 0.7)) }
        })
        .collect();
    let boxed = |half: DVec3| solid((0..8).map(|k| half * DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4))).collect());
    pairs.push(ShapePair { name: "boxes", a: boxed(DVec3::new(0.7, 0.5, 0.4)), b: boxed(DVec3::new(0.8, 0.6, 0.3)) });
    pairs.push(ShapePair { name: "cylinders", a: prism(32, 0.5, 0.7), b: prism(32, 0.7, 0.4) });
    pairs.push(ShapePair { name: "needles", a: prism(8, 0.02, 1.0), b: prism(6, 0.03, 0.8) });
    pairs
}

fn sign(bit: u32) -> f64 {
    if bit == 0 { -1.0 } else { 1.0 }
}

fn ellipsoid(random: &mut Random, n: usize, radii: DVec3) -> Polytope {
    solid((0..n).map(|_| random.direction() * radii).collect())
}

fn prism(sides: u32, radius: f64, half: f64) -> Polytope {
    let corner = |k: u32| {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(k >> 1) / f64::from(sides)).sin_cos();
        DVec3::new(radius * cosine, radius * sine, half * sign(k & 1))
    };
    solid((0..2 * sides).map(corner).collect())
}

fn solid(points: Vec<DVec3>) -> Polytope {
    convex_hull(&points, 1e-9).expect("the points are finite").into_polytope().expect("the points span a volume").0
}

/// Returns the faces as triangles.
pub(crate) fn triangles(polytope: &Polytope) -> Vec<[u32; 3]> {
    (0..polytope.face_count() as u32).flat_map(|f| polytope.face_vertices(f).fan()).collect()
}
