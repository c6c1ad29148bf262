//! Checks the march by its own proof and against GJK, for every kind of body and pose.

use glam::{DQuat, DVec3, EulerRot};

use super::March;
use super::march::{initial_features, march};
use super::oracle::*;
use super::{Proximity, StopReason, gjk};
use crate::algebra::{Placement, Pose};
use crate::body::{Feature, FeaturePair, Polytope};

const SEED: u64 = 0x4D41_5243;

/// Checks a march by its own proof and against GJK. Returns the march, and the gap between the
/// distance and its proven lower bound, relative to the distance.
fn check(a: &Polytope, b: &Polytope, pose: &Placement, start: FeaturePair, what: &str) -> (March, f64) {
    let answer = march(a, b, pose, start);
    let expected = gjk(a, b, pose, start);
    // Hulls merge faces that are planar within COPLANAR only; the other bodies' faces are planar
    // within rounding.
    let flat_faces = !what.contains("hull");
    let context = || format!("{what}, seed {SEED:#x}\n{answer:?}\n{expected:?}");
    let off = if flat_faces { OFF_MARCH } else { OFF_MERGED };
    let missing = judge(a, b, pose, &answer, off).unwrap_or_else(|fault| panic!("{fault}: {}", context()));
    let loose = match judge(a, b, pose, &expected, off.max(OFF_GJK)) {
        Ok(loose) => loose,
        // GJK reports that it has not converged.
        Err(_) if expected.stop != StopReason::Converged => f64::INFINITY,
        Err(fault) => panic!("GJK {fault}: {}", context()),
    };
    let size = a.radius() + b.radius() + pose.translation.length();
    let rounding = 1e-14 * size;
    match (answer.proximity, expected.proximity) {
        (Proximity::Disjoint(p), Proximity::Disjoint(q)) => {
            // The true distance lies between each result's lower bound and its distance.
            assert!(p.distance - missing <= q.distance + rounding, "march is farther: {}", context());
            assert!(q.distance - loose <= p.distance + rounding, "march is nearer: {}", context());
            (answer, missing / p.distance)
        }
        (Proximity::Overlapping(_), Proximity::Overlapping(_)) => (answer, 0.0),
        // GJK reports that it has not converged.
        (Proximity::Disjoint(_), Proximity::Overlapping(_)) if expected.stop != StopReason::Converged => {
            (answer, missing)
        }
        // The march used its fallback, which may report an overlap for very near bodies.
        (Proximity::Overlapping(_), Proximity::Disjoint(q)) if answer.stop != StopReason::Converged => {
            assert!(q.distance < 1e-7 * size, "one is apart: {}", context());
            (answer, 0.0)
        }
        (p, q) => {
            let near = |x| if let Proximity::Disjoint(c) = x { c.distance } else { 0.0 };
            assert!(near(p) + near(q) < 1e-11 * size, "one is apart: {}", context());
            (answer, 0.0)
        }
    }
}

#[test]
fn march_is_correct_from_random_starts() {
    let mut random = Random::new(SEED);
    let zoo = menagerie(&mut random);
    for (name_a, a) in &zoo {
        for (name_b, b) in &zoo {
            for apart in [0.02, 0.3, 0.5, 0.8, 1.1, 3.0, 30.0] {
                let pose = random_pose(&mut random, a, b, apart);
                let start = FeaturePair { a: random.feature(a), b: random.feature(b) };
                check(a, b, &pose, start, &format!("{name_a}, {name_b}, {apart}"));
            }
        }
    }
}

#[test]
fn direction_of_a_shallow_overlap_points_outward() {
    // A corner of a turned cube overlaps the top of a box. Either of the two is body a.
    let (below, above) = (cuboid(DVec3::new(2.0, 2.0, 0.5)), cuboid(DVec3::ONE));
    let turned = DQuat::from_rotation_arc(DVec3::ONE.normalize(), -DVec3::Z);
    let pose = Pose::new(turned, DVec3::new(0.1, 0.2, 0.5 + 3f64.sqrt() - 0.01));
    let mut random = Random::new(SEED + 6);
    for _ in 0..200 {
        let start = FeaturePair { a: random.feature(&above), b: random.feature(&below) };
        let Proximity::Overlapping(up) = march(&above, &below, &pose.placement(), start).proximity else { panic!() };
        assert!(up.direction.normalize().z > 0.5, "{up:?}, seed {SEED:#x}");
        let (inverse, start) = (pose.inverse(), FeaturePair { a: start.b, b: start.a });
        let Proximity::Overlapping(down) = march(&below, &above, &inverse.placement(), start).proximity else {
            panic!()
        };
        assert!(pose.vector(down.direction.normalize()).z < -0.5, "{down:?}, seed {SEED:#x}");
    }
}

/// Result of the march with a bound: a sufficient bound, or the full march.
enum Bounded {
    Within(March),
    /// The bodies are farther apart than the bound by at least this length (m). The unit direction
    /// (from b into a, in b's frame) proves it.
    Beyond {
        lower: f64,
        normal: DVec3,
    },
}

/// Returns the march, or a proof that the distance exceeds `upper`, if the first features give one.
fn march_within(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair, upper: f64) -> Bounded {
    if let (Feature::Vertex(v), Feature::Vertex(w)) = (start.a, start.b) {
        let (point_a, point_b) = (pose_ba.point(a.vertex(v)), b.vertex(w));
        let r = point_a - point_b;
        let distance = r.length();
        if distance > upper {
            let normal = r / distance;
            let down = -pose_ba.inverse_vector(normal);
            let reach_a = a.climb(v, down).1 - down.dot(a.vertex(v));
            let reach_b = b.climb(w, normal).1 - normal.dot(point_b);
            let lower = distance - reach_a - reach_b;
            if lower > upper {
                return Bounded::Beyond { lower, normal };
            }
        }
    }
    Bounded::Within(march(a, b, pose_ba, start))
}

#[test]
fn bound_is_proven_or_march_is_complete() {
    let mut random = Random::new(SEED + 5);
    let zoo = menagerie(&mut random);
    let mut beyond = 0;
    for (name_a, a) in &zoo {
        for (name_b, b) in &zoo {
            for apart in [0.5, 1.5, 4.0] {
                let pose = random_pose(&mut random, a, b, apart);
                let upper = random.between(0.0, 2.0);
                let full = march(a, b, &pose, initial_features(a, b, &pose));
                match march_within(a, b, &pose, initial_features(a, b, &pose), upper) {
                    Bounded::Within(answer) => assert_eq!(answer, full),
                    Bounded::Beyond { lower, normal } => {
                        beyond += 1;
                        let Proximity::Disjoint(closest) = full.proximity else {
                            panic!("{name_a}, {name_b}, {apart}, seed {SEED:#x}: {full:?}")
                        };
                        assert!(lower > upper && lower <= closest.distance * (1.0 + 1e-14), "{name_a}, {name_b}");
                        assert!((normal.length() - 1.0).abs() < 1e-14);
                    }
                }
            }
        }
    }
    assert!(beyond > zoo.len() * zoo.len(), "{beyond} proofs, seed {SEED:#x}");
}

/// Returns a special pose of `a` relative to `b`: aligned, turned by 90°, or turned slightly, at a
/// random gap (negative: overlapping).
fn contact_pose(random: &mut Random, a: &Polytope, b: &Polytope) -> Placement {
    let quarter = std::f64::consts::FRAC_PI_2;
    let turns = DVec3::new(random.below(5) as f64, random.below(5) as f64, random.below(5) as f64) * quarter * 0.5;
    let mut rotation = DQuat::from_euler(EulerRot::XYZ, turns.x, turns.y, turns.z);
    match random.below(4) {
        0 => {}
        1 => rotation = DQuat::IDENTITY,
        2 => {
            let off = 10f64.powf(random.between(-16.0, -1.0));
            rotation = DQuat::from_axis_angle(random.direction(), off) * rotation;
        }
        _ => {
            // A random face of a lies flat on a random face of b.
            let n = a.plane(random.below(a.face_count()) as u32).normal;
            let m = b.plane(random.below(b.face_count()) as u32).normal;
            rotation = DQuat::from_axis_angle(m, random.between(0.0, 6.0)) * DQuat::from_rotation_arc(n, -m);
        }
    }
    let toward = [DVec3::X, DVec3::Y, DVec3::Z, random.direction()][random.below(4)];
    let size = a.radius() + b.radius();
    let centre = b.centroid() + toward * size * 1.5;
    let pose = Pose::new(rotation, centre - rotation * a.centroid());
    let gap = size * 10f64.powf(random.between(-14.0, -1.0)) * if random.below(4) == 0 { -1.0 } else { 1.0 };
    let start = initial_features(a, b, &pose.placement());
    let Proximity::Disjoint(closest) = gjk(a, b, &pose.placement(), start).proximity else {
        return pose.placement();
    };
    Pose { translation: pose.translation - closest.normal * (closest.distance - gap), ..pose }.placement()
}

/// Counts of a sweep.
#[derive(Default)]
struct Tally {
    queries: u64,
    overlaps: u64,
    steps: u64,
    /// Gap between distance and proven lower bound, relative to the distance, for each decade of
    /// distance over size.
    shortfall: [f64; 16],
    fallbacks: std::collections::BTreeMap<String, u64>,
}

impl Tally {
    fn count(&mut self, (answer, shortfall): (March, f64), size: f64, what: impl Fn() -> String) {
        if let Proximity::Disjoint(closest) = answer.proximity {
            let decade = (-(closest.distance / size).log10()).clamp(0.0, 15.0) as usize;
            self.shortfall[decade] = self.shortfall[decade].max(shortfall);
        }
        self.queries += 1;
        self.steps += u64::from(answer.steps);
        self.overlaps += u64::from(matches!(answer.proximity, Proximity::Overlapping(_)));
        if answer.stop != StopReason::Converged {
            *self.fallbacks.entry(what()).or_insert(0) += 1;
        }
    }

    fn fallback_count(&self) -> u64 {
        self.fallbacks.values().sum()
    }

    #[allow(clippy::print_stderr, reason = "sweeps are run to be read")]
    fn print(&self, title: &str) {
        let Self { queries, overlaps, steps, .. } = self;
        let fallbacks = self.fallback_count();
        eprintln!("{title}: {queries} queries, {overlaps} overlapping, {steps} steps, {fallbacks} fallbacks");
        for (decade, shortfall) in self.shortfall.iter().enumerate() {
            eprintln!("  distance below 1e-{decade} of the size: proven within {shortfall:.1e}");
        }
        let mut worst: Vec<_> = self.fallbacks.iter().collect();
        worst.sort_by_key(|entry| std::cmp::Reverse(*entry.1));
        for (what, count) in worst.iter().take(20) {
            eprintln!("  {count} {what}");
        }
    }
}

fn start_of(random: &mut Random, a: &Polytope, b: &Polytope, pose: &Placement) -> FeaturePair {
    match random.below(2) {
        0 => initial_features(a, b, pose),
        _ => FeaturePair { a: random.feature(a), b: random.feature(b) },
    }
}

fn sweep_random(tally: &mut Tally, random: &mut Random, rounds: usize) {
    for _ in 0..rounds {
        let scale = 10f64.powf(random.between(-3.0, 3.0));
        let zoo = menagerie(random);
        for (name_a, a) in &zoo {
            let a = scaled(a, scale);
            for (name_b, b) in &zoo {
                let b = scaled(b, scale);
                for _ in 0..4 {
                    let apart = 10f64.powf(random.between(-2.0, 1.0));
                    let pose = random_pose(random, &a, &b, apart);
                    let start = start_of(random, &a, &b, &pose);
                    let what = || format!("{name_a}, {name_b}, {apart}, scale {scale}");
                    let answer = check(&a, &b, &pose, start, &what());
                    tally.count(answer, a.radius() + b.radius(), || format!("{name_a}, {name_b} {:?}", answer.0.stop));
                }
            }
        }
    }
}

fn sweep_contacts(tally: &mut Tally, random: &mut Random, rounds: usize) {
    for _ in 0..rounds {
        let zoo = menagerie(random);
        for (name_a, a) in &zoo {
            for (name_b, b) in &zoo {
                for _ in 0..4 {
                    let pose = contact_pose(random, a, b);
                    let start = start_of(random, a, b, &pose);
                    let answer = check(a, b, &pose, start, &format!("{name_a}, {name_b}"));
                    tally.count(answer, a.radius() + b.radius(), || format!("{name_a}, {name_b} {:?}", answer.0.stop));
                }
            }
        }
    }
}

#[test]
fn march_is_correct_for_aligned_and_touching_bodies() {
    let mut tally = Tally::default();
    sweep_contacts(&mut tally, &mut Random::new(SEED), 1);
    assert!(tally.fallback_count() * 1000 <= tally.queries, "{:?}, seed {SEED:#x}", tally.fallbacks);
}

/// `a` slowly slides and turns past `b`. A march from the last features must equal a march from new
/// features.
fn sweep_coherent(tally: &mut Tally, random: &mut Random, frames: u32, zoo: &[(&str, Polytope)]) {
    for (name_a, a) in zoo {
        for (name_b, b) in zoo {
            let (rotation, axis) = (random.rotation(), random.direction());
            let (from, to) = (random.direction() * random.between(0.1, 1.2), random.direction());
            let mut last = FeaturePair { a: random.feature(a), b: random.feature(b) };
            for k in 0..frames {
                let t = f64::from(k) / f64::from(frames);
                let turned = DQuat::from_axis_angle(axis, t) * rotation;
                let centre = b.centroid() + from.lerp(to, t) * (a.radius() + b.radius());
                let pose = Pose::new(turned, centre - turned * a.centroid()).placement();
                let what = || format!("{name_a}, {name_b}, frame {k} of {frames}");
                let (warm, missing) = check(a, b, &pose, last, &what());
                let cold = march(a, b, &pose, initial_features(a, b, &pose));
                if let (Proximity::Disjoint(p), Proximity::Disjoint(q)) = (warm.proximity, cold.proximity) {
                    let fault = (p.distance - q.distance).abs();
                    assert!(fault <= 1e-10 * q.distance + 1e-14, "{}, seed {SEED:#x}: {warm:?} {cold:?}", what());
                }
                last = warm.features;
                tally.count((warm, missing), a.radius() + b.radius(), || format!("{name_a}, {name_b} {:?}", warm.stop));
            }
        }
    }
}

#[test]
fn march_from_last_features_equals_a_new_march() {
    let mut random = Random::new(SEED + 3);
    let mut tally = Tally::default();
    let zoo = menagerie(&mut random);
    sweep_coherent(&mut tally, &mut random, 20, &zoo);
    assert!(tally.fallback_count() * 1000 <= tally.queries, "{:?}, seed {SEED:#x}", tally.fallbacks);
}

/// Hulls of many points. The other tests leave them out because they are slow.
fn large_hulls(random: &mut Random) -> Vec<(&'static str, Polytope)> {
    let sizes = [200, 500];
    ["hull of 200", "hull of 500"].into_iter().zip(sizes.map(|n| random_hull(random, n))).collect()
}

#[test]
#[ignore = "minutes of random queries, with a count of fallbacks by pair"]
fn sweeps() {
    let rounds = std::env::var("SWEEPS").map_or(20, |s| s.parse().unwrap());
    let mut tally = Tally::default();
    sweep_random(&mut tally, &mut Random::new(SEED + 1), rounds);
    tally.print("random");
    let mut tally = Tally::default();
    sweep_contacts(&mut tally, &mut Random::new(SEED + 2), rounds);
    tally.print("contacts");
    let mut tally = Tally::default();
    let mut random = Random::new(SEED + 4);
    for _ in 0..rounds.div_ceil(50) {
        let mut zoo = menagerie(&mut random);
        zoo.extend(large_hulls(&mut random));
        sweep_coherent(&mut tally, &mut random, 200, &zoo);
    }
    tally.print("coherent");
}
