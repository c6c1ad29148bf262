//! The shapes of the bench, the same in every run.

use glam::{DQuat, DVec3};
use palpus::body::{Polytope, convex_hull};

/// The seed of all shapes and poses.
pub(crate) const SEED: u64 = 0x5EED_C03E;

/// Vertices of the ellipsoid hulls.
const SIZES: [usize; 5] = [8, 20, 100, 500, 2000];

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let mut coordinate = || self.between(-1.0, 1.0);
            let v = DVec3::new(coordinate(), coordinate(), coordinate());
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub(crate) fn rotation(&mut self) -> DQuat {
        DQuat::from_axis_angle(self.direction(), self.between(0.0, std::f64::consts::TAU))
    }
}

/// Two bodies that meet.
pub(crate) struct ShapePair {
    pub(crate) name: &'static str,
    pub(crate) a: Polytope,
    pub(crate) b: Polytope,
}

/// All pairs, small to large, then the special ones.
pub(crate) fn all() -> Vec<ShapePair> {
    let mut random = Random(SEED);
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
    convex_hull(&points, 1e-9).expect("finite points").into_polytope().expect("points in space").0
}

/// The faces as fans of triangles.
pub(crate) fn triangles(polytope: &Polytope) -> Vec<[u32; 3]> {
    (0..polytope.face_count() as u32).flat_map(|f| polytope.face_vertices(f).fan()).collect()
}
