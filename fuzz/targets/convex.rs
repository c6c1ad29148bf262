//! Two convex polytopes at any pose. Distance and depth are finite and consistent.
//!
//! The march and GJK compute distances by different methods, so their results are compared. If a
//! march reports an overlap, there is a depth, and a proven depth does not exceed the depth found
//! by a walk.
#![no_main]

use glam::DVec3;
use palpus::body::{Polytope, convex_hull};
use palpus::collision::{Closest, Proximity, StopReason, gjk, initial_features, march};
use palpus::depth::{Certainty, CertificateMemory, Depth, DepthScratch, Seed as From, depth, depth_proven};
use palpus_fuzz::{Allowance, Bytes, Seed, target};

/// Allowed difference of two methods for a distance, relative to the sizes and the length of the
/// translation.
const AGREE: f64 = 1e-6;

fn polytope(bytes: &mut Bytes<'_>) -> Option<Polytope> {
    let count = 3 + bytes.below(30);
    let scale = if bytes.rarely() { bytes.between(1e-6, 1e6) } else { 1.0 };
    let points: Vec<DVec3> = (0..count).map(|_| bytes.point() * scale).collect();
    let extent = points.iter().fold(0.0f64, |most, p| most.max(p.length()));
    Some(convex_hull(&points, 1e-9 * extent).ok()?.into_polytope()?.0)
}

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (Some(a), Some(b)) = (polytope(&mut bytes), polytope(&mut bytes)) else { return };
    for polytope in [&a, &b] {
        assert_eq!(polytope.validate_topology(), Ok(()));
    }
    let (mut scratch, mut memory) = (DepthScratch::new(), CertificateMemory::new());
    let mut start = None;
    for _ in 0..4 {
        let pose = bytes.pose(a.radius().max(b.radius()));
        let place = pose.placement();
        let size = a.radius() + b.radius() + pose.translation.length();
        let first = start.unwrap_or_else(|| initial_features(&a, &b, &place));
        let (marched, other) = (march(&a, &b, &place, first), gjk(&a, &b, &place, first));
        start = Some(marched.features);
        let near = |closest: &Closest| {
            let gap = closest.point_a - closest.point_b - closest.distance * closest.normal;
            assert!(gap.length() <= 1e-9 * size && (closest.normal.length() - 1.0).abs() < 1e-9, "{closest:?}");
            assert!(closest.distance.is_finite() && closest.distance > 0.0, "{closest:?}");
        };
        match (&marched.proximity, &other.proximity) {
            (Proximity::Disjoint(one), Proximity::Disjoint(two)) => {
                near(one);
                near(two);
                let agreed = (one.distance - two.distance).abs() <= AGREE * size;
                let sure = other.stop == StopReason::Converged;
                assert!(agreed || !sure, "{} and {} of {size}", one.distance, two.distance);
            }
            (Proximity::Disjoint(one), Proximity::Overlapping(_)) => {
                near(one);
                let sure = other.stop == StopReason::Converged;
                assert!(one.distance <= AGREE * size || !sure, "{} of {size}, and an overlap", one.distance);
            }
            (Proximity::Overlapping(_), Proximity::Disjoint(two)) => {
                near(two);
                assert!(two.distance <= AGREE * size, "an overlap, and {} of {size}", two.distance);
            }
            (Proximity::Overlapping(_), Proximity::Overlapping(_)) => {}
        }
        if let Proximity::Overlapping(overlap) = marched.proximity {
            let seeds = [From::Witness { direction: overlap.direction }, From::CentroidLine];
            let walked = depth(&a, &b, &place, &seeds, &mut scratch);
            sane(&walked, size);
            let proven = depth_proven(&a, &b, &place, &[walked.seed()], &mut memory, &mut scratch);
            sane(&proven, size);
            if proven.certainty == Certainty::GloballyOptimal {
                assert!(proven.depth <= walked.depth + 1e-9 * size, "{walked:?}\n{proven:?}");
            }
        }
    }
}

fn sane(depth: &Depth, size: f64) {
    let gap = depth.point_a - depth.point_b + depth.depth * depth.normal;
    assert!(gap.length() <= 1e-9 * size && (depth.normal.length() - 1.0).abs() < 1e-9, "of {size}: {depth:?}");
    assert!(
        depth.depth.is_finite() && depth.depth >= -AGREE * size && depth.depth <= 2.0 * size,
        "of {size}: {depth:?}"
    );
}

fn seeds() -> Vec<Seed> {
    let mut cubes = Vec::new();
    for _ in 0..2 {
        cubes.extend([5, 0]);
        for k in 0..8u8 {
            cubes.extend([0, 1, 2].map(|axis| 84 + 32 * (k >> axis & 1)));
        }
    }
    cubes.extend([0, 110, 100, 100, 64, 103, 100, 100, 110, 105, 100, 0, 132, 132, 132]);
    vec![("cubes".to_owned(), cubes)]
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 8 << 20 }, seeds: seeds);
