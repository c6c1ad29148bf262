//! Tests that proofs of depths do not allocate after their working memory has been created.

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Polytope, convex_hull};
use palpus::depth::{Certainty, CertificateMemory, DepthScratch, depth_proven};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns the hull of `n` points on an ellipsoid, along a spiral with even spacing.
fn ellipsoid(n: u32, radii: DVec3) -> Polytope {
    let point = |k: u32| {
        let (z, turn) = (1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(n), 2.4 * f64::from(k));
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * turn.cos(), radius * turn.sin(), z) * radii
    };
    let points: Vec<DVec3> = (0..n).map(point).collect();
    convex_hull(&points, 1e-9).expect("the points have a hull").into_polytope().expect("the hull is a solid").0
}

#[test]
fn proofs_do_not_allocate() {
    let (a, b) = (ellipsoid(300, DVec3::new(1.0, 0.9, 0.8)), ellipsoid(200, DVec3::new(0.8, 0.8, 0.7)));
    let (mut scratch, mut memory) = (DepthScratch::new(), CertificateMemory::new());
    let before = allocations_of_this_thread();
    assert!(before > 0, "the counting allocator is not installed");
    let mut growths = 0;
    for k in 0..400 {
        // One body moves slowly from side to side through the other body's middle, with a jump
        // every 100 poses.
        let s = f64::from(k) * 2e-3 + f64::from(k / 100);
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.3, -0.4, 1.0) * s);
        let placement = Pose::new(rotation, DVec3::new(1.2 * s.sin(), 0.1, 0.0)).placement();
        let answer = depth_proven(&a, &b, &placement, &[], &mut memory, &mut scratch);
        assert_eq!(answer.certainty, Certainty::GloballyOptimal, "pose {k}: {answer:?}");
        growths += scratch.growths();
    }
    assert_eq!(allocations_of_this_thread(), before);
    assert!(growths > 100, "{growths}");
}
