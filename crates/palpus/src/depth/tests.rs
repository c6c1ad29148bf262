//! The walk against the exhaustive oracle, over shapes, scales and paths.

mod certificate;

use glam::{DQuat, DVec3};

use super::oracle::exhaustive_depth;
use super::*;
use crate::algebra::{Placement, Pose};
use crate::body::{Polytope, Provenance, convex_hull};

const SEED: u64 = 0x5eed_0de7;

/// Steele, Lea, Flood 2014.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.signed(), self.signed(), self.signed());
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    fn rotation(&mut self) -> DQuat {
        let axis = self.direction();
        DQuat::from_axis_angle(axis, std::f64::consts::TAU * self.unit())
    }
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

fn ellipsoid(rng: &mut SplitMix64, n: usize, radii: DVec3) -> Polytope {
    solid(&(0..n).map(|_| rng.direction() * radii).collect::<Vec<_>>())
}

fn plate(n: u32, radius: f64) -> Polytope {
    Polytope::from_polygon(circle(n, radius, 0.0).collect(), DVec3::Z, Provenance::Original).unwrap()
}

fn tetra(height: f64) -> Polytope {
    solid(&circle(3, 1.0, 0.0).chain([DVec3::new(0.1, 0.2, height)]).collect::<Vec<_>>())
}

fn scaled(polytope: &Polytope, factor: f64) -> Polytope {
    if polytope.is_flat() {
        let points = polytope.face_vertices(0).iter().map(|&v| polytope.vertex(v) * factor).collect();
        Polytope::from_polygon(points, polytope.plane(0).normal, Provenance::Original).unwrap()
    } else {
        solid(&polytope.vertices().iter().map(|&v| v * factor).collect::<Vec<_>>())
    }
}

fn shapes() -> Vec<(&'static str, Polytope)> {
    let mut rng = SplitMix64(SEED);
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

/// A pose of a near b: most overlap, some not.
fn random_pose(rng: &mut SplitMix64, a: &Polytope, b: &Polytope) -> Pose {
    let rotation = match rng.below(4) {
        0 => DQuat::IDENTITY,
        1 => {
            // A turn that permutes the axes, up to rounding.
            let quarter = std::f64::consts::FRAC_PI_2;
            DQuat::from_rotation_x(quarter * rng.below(4) as f64)
                * DQuat::from_rotation_z(quarter * rng.below(4) as f64)
        }
        _ => rng.rotation(),
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

/// What every answer must hold, whatever its optimality.
fn assert_identities(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, what: &str) {
    let size = a.radius() + b.radius();
    let Depth { point_a, point_b, normal, depth, hub, .. } = *answer;
    assert!(normal.is_finite() && point_a.is_finite() && point_b.is_finite(), "{what}: {answer:?}");
    assert!((normal.length() - 1.0).abs() < 1e-14, "{what}: {answer:?}");
    let cso = cso::Cso { a, b, pose_ba };
    let scan = normal.dot(b.vertex(b.support(normal))) - normal.dot(cso.point_a(a.support(cso.toward_b(normal))));
    assert!((depth - scan).abs() <= 1e-12 * size, "{what}: depth {depth}, h(n) {scan}");
    assert!((normal.dot(cso.vertex(hub)) - scan).abs() <= 1e-12 * size, "{what}: the hub does not support n");
    assert!((point_a - point_b + depth * normal).length() <= 1e-12 * size, "{what}: {answer:?}");
    let height_b = normal.dot(point_b) - normal.dot(b.vertex(b.support(normal)));
    assert!(height_b.abs() <= 1e-9 * size, "{what}: point_b off the supporting plane by {height_b}");
}

/// How far `p` (local) lies outside the polytope.
fn outside(polytope: &Polytope, p: DVec3) -> f64 {
    polytope.planes().iter().map(|plane| plane.height(p)).fold(f64::NEG_INFINITY, f64::max)
}

fn assert_points_on_bodies(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, what: &str) {
    let size = a.radius() + b.radius();
    let (a_out, b_out) = (outside(a, pose_ba.inverse_point(answer.point_a)), outside(b, answer.point_b));
    assert!(a_out.abs() <= 2e-9 * size && b_out.abs() <= 2e-9 * size, "{what}: {a_out} {b_out} {answer:?}");
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

#[test]
#[allow(clippy::print_stderr)] // The share of local answers is a measurement to be seen.
fn cold_answers_hold_their_identities_and_are_nearly_always_global() {
    let shapes = shapes();
    let mut rng = SplitMix64(SEED);
    let mut scratch = WalkScratch::new();
    let mut total = Tally::default();
    for (name_a, a) in &shapes {
        for (name_b, b) in &shapes {
            let mut tally = Tally::default();
            for k in 0..30 {
                let factor = [1.0, 1e-3, 1e3][k % 3];
                let (a, b) = (&scaled(a, factor), &scaled(b, factor));
                let pose = random_pose(&mut rng, a, b);
                let placement = pose.placement();
                let size = a.radius() + b.radius();
                let what = format!("{name_a} on {name_b}, pose {k}, seed {SEED:#x}, {pose:?}");
                let (exact, _) = exhaustive_depth(a, b, &placement);
                let answer = depth(a, b, &placement, &[], &mut scratch);
                assert_identities(a, b, &placement, &answer, &what);
                assert!(answer.depth >= exact - 1e-12 * size, "{what}: {} below {exact}", answer.depth);
                if exact < 0.0 {
                    continue;
                }
                assert_eq!(answer.stop, crate::collision::StopReason::Converged, "{what}");
                assert_points_on_bodies(a, b, &placement, &answer, &what);
                tally.add(answer.depth, exact, size);
                total.add(answer.depth, exact, size);
            }
            if tally.local > 0 {
                eprintln!("{name_a} on {name_b}: {} of {} local only, by {:e}", tally.local, tally.poses, tally.worst);
            }
        }
    }
    eprintln!("cold: {} of {} local only, by {:e} of the size", total.local, total.poses, total.worst);
    assert!(total.share() < 0.02, "seed {SEED:#x}: {} of {}", total.local, total.poses);
}

/// The folders of reference pairs, if this checkout has them beside it.
fn reference_folders() -> Vec<std::path::PathBuf> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/convex");
    let Ok(entries) = std::fs::read_dir(root) else { return Vec::new() };
    let mut folders: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    folders.sort();
    folders
}

fn numbers(line: &str, separator: char) -> Vec<f64> {
    line.split(separator).filter_map(|word| word.trim().parse().ok()).collect()
}

fn read_hull(path: &std::path::Path) -> Polytope {
    let text = std::fs::read_to_string(path).unwrap();
    let points: Vec<DVec3> = text
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| DVec3::from_slice(&numbers(line, ' ')))
        .collect();
    solid(&points)
}

fn read_poses(path: &std::path::Path) -> Vec<Pose> {
    let text = std::fs::read_to_string(path).unwrap();
    let pose = |line: &str| {
        let n = numbers(line, ',');
        Pose::new(DQuat::from_xyzw(n[3], n[4], n[5], n[6]), DVec3::new(n[0], n[1], n[2]))
    };
    text.lines().skip(1).map(pose).collect()
}

/// (frame, depth) of a `.depth` file.
fn read_depths(path: &std::path::Path) -> Vec<(usize, f64)> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|line| numbers(line, ' ')).map(|n| (n[0] as usize, n[1])).collect()
}

#[test]
#[allow(clippy::print_stderr)] // The share of local answers is a measurement to be seen.
fn reference_poses_are_nearly_always_global_and_sliding_ones_always() {
    let mut scratch = WalkScratch::new();
    let (mut random, mut sliding) = (Tally::default(), Tally::default());
    for folder in reference_folders() {
        let (a, b) = (read_hull(&folder.join("a.obj")), read_hull(&folder.join("b.obj")));
        let size = a.radius() + b.radius();
        let (mut cold, mut warm) = (Tally::default(), Tally::default());
        let poses = read_poses(&folder.join("random.csv"));
        for (frame, exact) in read_depths(&folder.join("random.depth")) {
            let placement = poses[frame].placement();
            let answer = depth(&a, &b, &placement, &[], &mut scratch);
            let what = format!("{folder:?} random {frame}");
            assert_identities(&a, &b, &placement, &answer, &what);
            assert!(answer.depth >= exact - 1e-9 * size, "{what}: {} below {exact}", answer.depth);
            if exact >= 0.0 {
                cold.add(answer.depth, exact, size);
                random.add(answer.depth, exact, size);
            }
        }
        let exact: std::collections::HashMap<_, _> = read_depths(&folder.join("sliding.depth")).into_iter().collect();
        let mut previous: Option<Depth> = None;
        let mut steps = 0;
        for (frame, pose) in read_poses(&folder.join("sliding.csv")).into_iter().enumerate() {
            let placement = pose.placement();
            let seed = previous.map_or(Seed::CentroidLine, |d| Seed::Previous { hub: d.hub, normal: d.normal });
            let answer = depth(&a, &b, &placement, &[seed], &mut scratch);
            let what = format!("{folder:?} sliding {frame}");
            assert_identities(&a, &b, &placement, &answer, &what);
            if let Some(&exact) = exact.get(&frame) {
                assert!(answer.depth >= exact - 1e-9 * size, "{what}: {} below {exact}", answer.depth);
                if exact >= 0.0 {
                    warm.add(answer.depth, exact, size);
                    sliding.add(answer.depth, exact, size);
                }
            }
            steps += answer.steps;
            previous = Some(answer);
        }
        let name = folder.file_name().unwrap_or_default().display();
        let Tally { poses, local, worst } = cold;
        eprintln!(
            "{name}: random {local}/{poses} local only (by {worst:.1e}), sliding {}/{} (by {:.1e}), {steps} moves",
            warm.local, warm.poses, warm.worst
        );
    }
    eprintln!("all: random {}/{} local only, sliding {}/{}", random.local, random.poses, sliding.local, sliding.poses);
    assert!(random.share() <= 0.01);
    assert_eq!(sliding.local, 0);
}
