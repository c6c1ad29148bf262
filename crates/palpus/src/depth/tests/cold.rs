//! Queries without a previous answer, at random poses: aligned, concentric, nearly aligned, deep
//! and shallow.

use super::*;
use crate::algebra::tolerance::FLUSH_WITNESS;
use crate::depth::oracle::exhaustive_depth;

#[test]
#[allow(clippy::print_stderr, reason = "the share of local answers is a measurement to be seen")]
fn answers_without_seed_are_nearly_always_global() {
    let shapes = shapes();
    let mut rng = Random::new(SEED);
    let mut scratch = DepthScratch::new();
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
                if exact < 0.0 {
                    // The oracle tries only normals of facets, and two bodies may be farther apart
                    // along another normal.
                    assert!(answer.depth <= 0.0, "{what}: {} deep, {exact} apart", answer.depth);
                    continue;
                }
                assert!(answer.depth >= exact - 1e-12 * size, "{what}: {} below {exact}", answer.depth);
                assert_eq!(answer.stop, crate::collision::StopReason::Converged, "{what}");
                assert_points_on_bodies(a, b, &placement, &answer, 2e-9, &what);
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

/// Rotates and shifts the bodies so little that cones, edges and faces nearly coincide.
#[test]
fn nearly_degenerate_poses_give_local_minima() {
    nearly_degenerate(SEED, 2);
}

#[test]
#[ignore = "a sweep of several minutes"]
fn nearly_degenerate_poses_give_local_minima_long() {
    for seed in 0..60 {
        nearly_degenerate(SEED + 1 + seed, 40);
    }
}

fn nearly_degenerate(seed: u64, rounds: usize) {
    let shapes = shapes();
    let mut rng = Random::new(seed);
    let mut scratch = DepthScratch::new();
    let mut total = Tally::default();
    for k in 0..rounds * shapes.len() * shapes.len() {
        let (name_a, a) = &shapes[k % shapes.len()];
        let (name_b, b) = &shapes[k / shapes.len() % shapes.len()];
        let factor = [1.0, 1e-3, 1e3][rng.below(3)];
        let (a, b) = (&scaled(a, factor), &scaled(b, factor));
        let mut pose = random_pose(&mut rng, a, b);
        let tilt = 10f64.powf(-16.0 + 14.0 * rng.unit());
        let axis = [DVec3::X, DVec3::Y, rng.direction()][rng.below(3)];
        pose.rotation = (DQuat::from_axis_angle(axis, tilt) * pose.rotation).normalize();
        if rng.below(2) == 0 {
            pose.translation += rng.direction() * factor * 10f64.powf(-14.0 + 12.0 * rng.unit());
        }
        let placement = pose.placement();
        let size = a.radius() + b.radius();
        let what = format!("{name_a} on {name_b}, pose {k}, tilt {tilt:e}, seed {seed:#x}, {pose:?}");
        let answer = depth(a, b, &placement, &[], &mut scratch);
        assert_identities(a, b, &placement, &answer, &what);
        let (exact, _) = exhaustive_depth(a, b, &placement);
        if exact >= 0.0 {
            assert!(answer.depth >= exact - 1e-12 * size, "{what}: {} below {exact}", answer.depth);
            assert_eq!(answer.stop, crate::collision::StopReason::Converged, "{what}");
            // If the end of a walk is a local minimum of h, the bodies have common points after the
            // separation. Flush features may be tilted by `tilt`. If a point then has an error x, h
            // changes only by x · `tilt`. The walk cannot detect changes below rounding.
            let stray = 2e-9 + 3.0 * tilt.min(FLUSH_WITNESS) + 3e-14 / tilt.max(FLUSH_WITNESS);
            assert_points_on_bodies(a, b, &placement, &answer, stray, &what);
            total.add(answer.depth, exact, size);
        }
    }
    assert!(total.share() < 0.04, "seed {seed:#x}: {} of {}", total.local, total.poses);
}

#[test]
fn moving_by_depth_separates_the_bodies_exactly() {
    let shapes = shapes();
    let mut rng = Random::new(SEED);
    let mut scratch = DepthScratch::new();
    for k in 0..300 {
        let (name_a, a) = &shapes[rng.below(shapes.len())];
        let (name_b, b) = &shapes[rng.below(shapes.len())];
        let size = a.radius() + b.radius();
        let pose = random_pose(&mut rng, a, b);
        let answer = depth(a, b, &pose.placement(), &[], &mut scratch);
        let (exact, _) = exhaustive_depth(a, b, &pose.placement());
        if exact < 1e-6 * size {
            continue;
        }
        let what = format!("{name_a} on {name_b}, pose {k}, seed {SEED:#x}");
        let left = |share: f64| {
            let moved = Pose { translation: pose.translation + answer.normal * (share * answer.depth), ..pose };
            exhaustive_depth(a, b, &moved.placement()).0
        };
        assert!(left(1.0) <= 1e-9 * size, "{what}: still {} deep", left(1.0));
        if answer.depth <= exact + 1e-9 * size {
            assert!(left(1.0) >= -1e-9 * size, "{what}: {} apart", left(1.0));
            assert!(left(0.9) > 0.05 * exact, "{what}: separated by less than the depth");
        }
    }
}

/// Tests bodies whose faces are flat only within the merge distance, like the faces of meshes.
#[test]
fn nearly_flat_faces_give_valid_depths() {
    rough_faces(SEED, 2500);
}

#[test]
#[ignore = "a sweep of several minutes"]
fn nearly_flat_faces_give_valid_depths_long() {
    for seed in 0..40 {
        rough_faces(SEED + 1 + seed, 5000);
    }
}

fn rough_faces(seed: u64, poses: u32) {
    let mut rng = Random::new(seed);
    let mut rough = |smooth: &Polytope, noise: f64| {
        let turn = rotation(&mut rng);
        solid(&smooth.vertices().iter().map(|v| turn * *v + rng.direction() * noise).collect::<Vec<_>>())
    };
    let bodies: Vec<Polytope> = [0.0, 1e-12, 3e-10]
        .into_iter()
        .flat_map(|noise| {
            let smooth = [cuboid(DVec3::new(1.0, 0.7, 0.3)), prism(6, 0.8, 0.5), prism(24, 0.6, 0.9)];
            smooth.map(|body| rough(&body, noise))
        })
        .collect();
    let mut scratch = DepthScratch::new();
    let mut total = Tally::default();
    let mut stalls = 0u32;
    for k in 0..poses {
        let (i, j) = (rng.below(bodies.len()), rng.below(bodies.len()));
        let (a, b) = (&bodies[i], &bodies[j]);
        // In half of the poses, a face of body a is flush with a face of b.
        let mut pose = random_pose(&mut rng, a, b);
        if rng.below(2) == 0 {
            let (n, m) =
                (b.plane(rng.below(b.face_count()) as u32).normal, a.plane(rng.below(a.face_count()) as u32).normal);
            pose.rotation = DQuat::from_axis_angle(n, rng.signed()) * DQuat::from_rotation_arc(m, -n);
        }
        let placement = pose.placement();
        let size = a.radius() + b.radius();
        let what = format!("{i} on {j}, pose {k}, seed {seed:#x}, {pose:?}");
        let answer = depth(a, b, &placement, &[], &mut scratch);
        // A climb follows edges. A merged face may have a corner to which no rising edge leads.
        assert_identities_within(a, b, &placement, &answer, 2e-8, &what);
        let (exact, _) = exhaustive_depth(a, b, &placement);
        if exact >= 0.0 {
            assert!(answer.depth >= exact - 2e-8 * size, "{what}: {} below {exact}", answer.depth);
            if answer.stop == crate::collision::StopReason::Converged {
                assert_points_on_bodies(a, b, &placement, &answer, 2e-7, &what);
            } else {
                stalls += 1;
            }
            total.add(answer.depth, exact + 2e-8 * size, size);
        }
    }
    assert!(total.share() < 0.02, "seed {seed:#x}: {} of {}", total.local, total.poses);
    // At rough faces, the overlaps of cones may be inconsistent, and the walk then stalls.
    assert!(f64::from(stalls) <= 1e-3 * f64::from(poses), "seed {seed:#x}: {stalls} stalls");
}
