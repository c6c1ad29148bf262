//! Compares proofs with the exhaustive oracle, in a sweep over difficult poses. Also tests proofs
//! with reused memory.

use super::*;
use crate::collision::{StopReason, initial_features, march};
use crate::depth::oracle::exhaustive_depth;

const SWEEP_SEED: u64 = 0x5eed_ce27;

/// The kinds of poses in a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Random,
    Aligned,
    Touching,
    Concentric,
    Contained,
    Coherent,
}

const KINDS: [Kind; 6] =
    [Kind::Random, Kind::Aligned, Kind::Touching, Kind::Concentric, Kind::Contained, Kind::Coherent];

/// Returns shapes with few edges, because the oracle tries all pairs of edges.
fn sweep_shapes(rng: &mut Random) -> Vec<(&'static str, Polytope)> {
    vec![
        ("cube", cuboid(DVec3::ONE)),
        ("box", cuboid(DVec3::new(1.0, 0.7, 0.3))),
        ("thin box", cuboid(DVec3::new(1.0, 0.8, 1e-3))),
        ("hexagonal prism", prism(6, 0.8, 0.5)),
        ("needle", prism(5, 0.01, 1.5)),
        ("long needle", prism(3, 1e-4, 1.5)),
        ("ellipsoid 12", ellipsoid(rng, 12, DVec3::new(1.0, 0.7, 0.6))),
        ("ellipsoid 20", ellipsoid(rng, 20, DVec3::new(0.9, 0.8, 0.5))),
        ("tetrahedron", tetra(1.2)),
        ("sliver", tetra(1e-4)),
        ("thinner sliver", tetra(1e-7)),
        ("square plate", plate(4, 1.0)),
        ("triangle plate", plate(3, 0.9)),
        ("polygon plate", plate(9, 0.7)),
    ]
}

fn aligned(rng: &mut Random) -> DQuat {
    let quarter = std::f64::consts::FRAC_PI_2;
    DQuat::from_rotation_x(quarter * rng.below(4) as f64) * DQuat::from_rotation_z(quarter * rng.below(4) as f64)
}

/// Returns a pose of the given kind. A coherent pose is a small motion from `last`.
fn sweep_pose(rng: &mut Random, kind: Kind, a: &Polytope, b: &Polytope, last: &Pose) -> Pose {
    let axis = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z][rng.below(6)];
    let (rotation, direction, depth) = match kind {
        Kind::Random => (rotation(rng), rng.direction(), rng.unit()),
        Kind::Aligned => (aligned(rng), axis, rng.unit()),
        Kind::Touching => {
            let rotation = if rng.below(2) == 0 { aligned(rng) } else { rotation(rng) };
            let direction = if rng.below(2) == 0 { axis } else { rng.direction() };
            (rotation, direction, 1e-3f64.powi(rng.below(5) as i32 + 1) * rng.unit())
        }
        Kind::Concentric => {
            let rotation = if rng.below(2) == 0 { aligned(rng) } else { rotation(rng) };
            (rotation, axis, 1.0)
        }
        Kind::Contained => (rotation(rng), rng.direction(), 0.9 + 0.1 * rng.unit()),
        Kind::Coherent => {
            let size = a.radius() + b.radius();
            let step = [1e-2, 1e-3, 1e-4, 1e-6][rng.below(4)];
            let turn = DQuat::from_scaled_axis(rng.direction() * (step * rng.unit()));
            let shift = rng.direction() * (step * size * rng.unit());
            return Pose { rotation: turn * last.rotation, translation: last.translation + shift };
        }
    };
    let centred = Pose { rotation, translation: b.centroid() - rotation * a.centroid() };
    let placement = centred.placement();
    let (_, reach) = cso::Cso { a, b, pose_ba: &placement }.support(HubPair { a: 0, b: 0 }, direction);
    Pose { translation: centred.translation + direction * (reach * (1.0 - depth)), ..centred }
}

/// Results of a sweep.
#[derive(Debug, Default)]
struct Sweep {
    poses: u64,
    overlapping: u64,
    walk_local: u64,
    worst_local: f64,
    fell_back: u64,
    longest_walk: u32,
    uncertified: u64,
    uncertified_budget: u64,
    worst_certified: f64,
    most_growths: u32,
}

impl Sweep {
    fn print(&self, title: &str) -> String {
        let per = |count: u64, of: u64| format!("{count} ({:.4} %)", 100.0 * count as f64 / of.max(1) as f64);
        format!(
            "{title}: {} poses, {} overlapping, walk only local in {} (worst excess {:.2e} of size), distance search fell back in {}, longest walk {} \
             moves, not certified {} of which {} for budget, worst certified excess {:.1e} of size, longest proof {} growths",
            self.poses,
            self.overlapping,
            per(self.walk_local, self.overlapping),
            self.worst_local,
            per(self.fell_back, self.poses),
            self.longest_walk,
            per(self.uncertified, self.overlapping),
            self.uncertified_budget,
            self.worst_certified,
            self.most_growths,
        )
    }
}

/// Memory for the checks of a sweep.
struct Bench {
    scratch: DepthScratch,
    memory: CertificateMemory,
    /// Memory for proofs without an earlier surface.
    blank: CertificateMemory,
}

impl Bench {
    fn one(&mut self, a: &Polytope, b: &Polytope, pose_ba: &Placement, sweep: &mut Sweep, what: &dyn Fn() -> String) {
        let size = a.radius() + b.radius();
        sweep.poses += 1;
        let start = initial_features(a, b, pose_ba);
        sweep.fell_back += u64::from(march(a, b, pose_ba, start).stop != StopReason::Converged);
        let (exact, _) = exhaustive_depth(a, b, pose_ba);
        if exact < 0.0 {
            self.memory.clear();
            return;
        }
        sweep.overlapping += 1;
        let local = depth(a, b, pose_ba, &[], &mut self.scratch);
        sweep.longest_walk = sweep.longest_walk.max(local.steps);
        if local.depth > exact + 1e-8 * size {
            sweep.walk_local += 1;
            sweep.worst_local = sweep.worst_local.max((local.depth - exact) / size);
        }
        let proven = depth_proven(a, b, pose_ba, &[local.seed()], &mut self.memory, &mut self.scratch);
        assert_identities(a, b, pose_ba, &proven, &what());
        assert!(proven.depth <= local.depth + 1e-9 * size, "{}: {proven:?}", what());
        assert!(proven.depth >= exact - 1e-8 * size, "{}: {} below {exact}", what(), proven.depth);
        sweep.most_growths = sweep.most_growths.max(self.scratch.growths());
        self.blank.clear();
        let cold = depth_proven(a, b, pose_ba, &[], &mut self.blank, &mut self.scratch);
        assert_identities(a, b, pose_ba, &cold, &what());
        sweep.most_growths = sweep.most_growths.max(self.scratch.growths());
        for proven in [cold, proven] {
            sweep.judge(&proven, exact, size, what);
        }
    }
}

#[allow(clippy::print_stderr, reason = "shows the unproven poses")]
impl Sweep {
    fn judge(&mut self, proven: &Depth, exact: f64, size: f64, what: &dyn Fn() -> String) {
        match proven.certainty {
            Certainty::GloballyOptimal => {
                let off = (proven.depth - exact) / size;
                self.worst_certified = self.worst_certified.max(off);
                assert!(off.abs() <= 1e-8, "{}: {} certified, exact {exact}, size {size}", what(), proven.depth);
            }
            Certainty::LocallyOptimal => {
                eprintln!("not certified, exact {exact:e} of size {size:e}: {} {proven:?}", what());
                self.uncertified += 1;
                self.uncertified_budget += u64::from(proven.stop == StopReason::Budget);
                assert_ne!(proven.stop, StopReason::Converged, "{}", what());
            }
        }
    }
}

#[allow(clippy::print_stderr, reason = "shows the figures of a sweep")]
fn sweep(poses: u64) -> Sweep {
    let mut rng = Random::new(SWEEP_SEED);
    let shapes = sweep_shapes(&mut rng);
    let mut bench =
        Bench { scratch: DepthScratch::new(), memory: CertificateMemory::new(), blank: CertificateMemory::new() };
    let mut sums: Vec<Sweep> = KINDS.iter().map(|_| Sweep::default()).collect();
    let mut done = 0;
    while done < poses {
        let factors = [1.0, 1e-3, 1e3];
        let factor = factors[rng.below(3)];
        // The two scales may differ, so that one body can contain the other.
        let other = if rng.below(4) == 0 { factor * [0.1, 1e-3][rng.below(2)] } else { factor };
        let (name_a, a) = &shapes[rng.below(shapes.len())];
        let (name_b, b) = &shapes[rng.below(shapes.len())];
        let (a, b) = (scaled(a, other), scaled(b, factor));
        bench.memory.clear();
        let mut pose = sweep_pose(&mut rng, Kind::Random, &a, &b, &Pose::IDENTITY);
        for _ in 0..200 {
            // Half of the poses are coherent, so several coherent poses often follow each other.
            let k = rng.below(2 * KINDS.len() - 2).min(KINDS.len() - 1);
            pose = sweep_pose(&mut rng, KINDS[k], &a, &b, &pose);
            let what = || {
                format!(
                    "{name_a} × {other:e} on {name_b} × {factor:e}, {:?}, pose {done}, seed {SWEEP_SEED:#x}, {pose:?}",
                    KINDS[k]
                )
            };
            bench.one(&a, &b, &pose.placement(), &mut sums[k], &what);
            done += 1;
        }
    }
    let mut all = Sweep::default();
    for (kind, sum) in KINDS.iter().zip(&sums) {
        eprintln!("{}", sum.print(&format!("{kind:?}")));
        all.poses += sum.poses;
        all.overlapping += sum.overlapping;
        all.walk_local += sum.walk_local;
        all.worst_local = all.worst_local.max(sum.worst_local);
        all.fell_back += sum.fell_back;
        all.longest_walk = all.longest_walk.max(sum.longest_walk);
        all.uncertified += sum.uncertified;
        all.uncertified_budget += sum.uncertified_budget;
        all.worst_certified = all.worst_certified.max(sum.worst_certified);
        all.most_growths = all.most_growths.max(sum.most_growths);
    }
    eprintln!("{}", all.print(&format!("all, seed {SWEEP_SEED:#x}")));
    all
}

#[test]
fn proofs_agree_with_exhaustive_search() {
    let all = sweep(6_000);
    assert!(all.uncertified * 1000 <= all.overlapping, "seed {SWEEP_SEED:#x}: {all:?}");
}

#[test]
#[ignore = "a million poses, minutes in release: cargo test --release -p palpus -- --ignored sweep"]
fn a_sweep_over_a_million_poses() {
    let all = sweep(1_000_000);
    assert!(all.uncertified * 1000 <= all.overlapping, "seed {SWEEP_SEED:#x}: {all:?}");
}

#[test]
fn cube_nearly_flush_with_needle_is_proven() {
    let (a, b) = (scaled(&cuboid(DVec3::ONE), 1e-3), scaled(&prism(3, 1e-4, 1.5), 1e-3));
    let rotation =
        DQuat::from_xyzw(0.49999996597598156, -0.5000003017053002, -0.49999991008475714, -0.49999982223382916);
    let translation = DVec3::new(-1.111693651337681e-9, -4.1496496740858246e-10, -0.00020722451523424952);
    let place = Pose { rotation, translation }.placement();
    let (mut scratch, mut memory) = (DepthScratch::new(), CertificateMemory::new());
    let local = depth(&a, &b, &place, &[], &mut scratch);
    let proven = depth_proven(&a, &b, &place, &[local.seed()], &mut memory, &mut scratch);
    assert_eq!(proven.certainty, Certainty::GloballyOptimal, "{proven:?}, {} growths", scratch.growths());
    memory.clear();
    let proven = depth_proven(&a, &b, &place, &[], &mut memory, &mut scratch);
    assert_eq!(proven.certainty, Certainty::GloballyOptimal, "{proven:?}, {} growths", scratch.growths());
}

/// Returns a polytope of points spread evenly over a sphere, along a spiral of golden angles
/// \[Swinbank and Purser 2006\].
fn ball(n: usize, radius: f64) -> Polytope {
    let point = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / n as f64;
        let (s, c) = (2.399_963_229_728_653 * k as f64).sin_cos();
        DVec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z) * radius
    };
    solid(&(0..n).map(point).collect::<Vec<_>>())
}

#[test]
fn concentric_balls_are_proven_or_stop_at_budget() {
    let mut rng = Random::new(SWEEP_SEED);
    let mut bench =
        Bench { scratch: DepthScratch::new(), memory: CertificateMemory::new(), blank: CertificateMemory::new() };
    for (n, off, proves) in [(500, 0.0, true), (2000, 1e-2, true), (2000, 0.0, false)] {
        let (a, b) = (ball(n, 1.0), ball(n, 0.9));
        let place = Pose { rotation: rotation(&mut rng), translation: rng.direction() * off }.placement();
        let Bench { scratch, memory, .. } = &mut bench;
        memory.clear();
        let proven = depth_proven(&a, &b, &place, &[], memory, scratch);
        let what = format!("{n} vertices, {off} off: {proven:?}, {} growths, seed {SWEEP_SEED:#x}", scratch.growths());
        assert_identities(&a, &b, &place, &proven, &what);
        let certified = proven.certainty == Certainty::GloballyOptimal;
        assert!(certified || !proves && proven.stop == StopReason::Budget, "{what}");
        // A lower bound of the depth: the face of each body that is nearest to the body's centre.
        let within = |body: &Polytope| body.planes().iter().map(|plane| plane.offset).fold(f64::INFINITY, f64::min);
        assert!(proven.depth >= within(&a) + within(&b) - off, "{what}");
        assert!(proven.depth <= 1.9, "{what}");
    }
}

#[test]
fn pose_with_nan_or_infinity_is_not_proven() {
    let body = cuboid(DVec3::ONE);
    for translation in [DVec3::NAN, DVec3::X * f64::INFINITY] {
        let place = Pose { rotation: DQuat::IDENTITY, translation }.placement();
        let (mut scratch, mut memory) = (DepthScratch::new(), CertificateMemory::new());
        let answer = depth_proven(&body, &body, &place, &[], &mut memory, &mut scratch);
        assert_eq!(answer.certainty, Certainty::LocallyOptimal, "{translation}: {answer:?}");
    }
}
