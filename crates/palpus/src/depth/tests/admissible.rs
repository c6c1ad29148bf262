//! Compares the admissible depth of the pieces of a bumpy ball with an exhaustive search over their
//! admissible normals.

use super::*;
use crate::body::shapes::cuboid;
use crate::body::{AdmissibleNormals, Body, BodySettings, Feature, FeaturePair, PolygonSoup};
use crate::depth::cso::Cso;
use crate::depth::oracle::exhaustive_depth;
use crate::depth::{AdmissibleDepth, AdmissibleScratch, admissible_depth, least_admissible_depth};

/// Returns an octahedron whose triangles are subdivided twice. Its vertices are moved in and out by
/// up to `bumps`, so half of its edges are reflex.
fn bumpy_ball(rng: &mut Random, bumps: f64) -> Body {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    for k in 0..4 {
        triangles.push([axes[k], axes[(k + 1) % 4], DVec3::Z]);
        triangles.push([axes[(k + 1) % 4], axes[k], DVec3::NEG_Z]);
    }
    for _ in 0..2 {
        triangles = triangles
            .iter()
            .flat_map(|&[p, q, r]| {
                let [x, y, z] = [(p + q).normalize(), (q + r).normalize(), (r + p).normalize()];
                [[p, x, z], [x, q, y], [z, y, r], [x, y, z]]
            })
            .collect();
    }
    let mut soup = PolygonSoup::new();
    for triangle in triangles {
        let corners = triangle.map(|p| match soup.vertices.iter().position(|v| v.normalize().distance(p) < 1e-9) {
            Some(known) => known as u32,
            None => {
                soup.vertices.push(p * (1.0 + bumps * rng.signed()));
                soup.vertices.len() as u32 - 1
            }
        });
        soup.push_face(&corners);
    }
    Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).unwrap()
}

/// Returns true if `walked` is the global depth. If it is not, the admissible depth is also only a
/// local minimum.
fn is_global([a, b]: [&AdmissibleNormals<'_>; 2], placement: &Placement, walked: &Depth) -> bool {
    walked.depth - exhaustive_depth(a.polytope(), b.polytope(), placement).0 < 1e-9
}

/// Returns the least h over all normals that are admissible for both pieces, by exhaustive search.
fn exhaustive(a: &AdmissibleNormals<'_>, b: &AdmissibleNormals<'_>, pose_ba: &Placement) -> f64 {
    let cso = Cso { a: a.polytope(), b: b.polytope(), pose_ba };
    let support = |n: DVec3| (a.polytope().support(cso.toward_b(n)), b.polytope().support(n));
    let h = |n: DVec3| n.dot(b.polytope().vertex(support(n).1) - cso.point_a(support(n).0));
    let planes = |own: &AdmissibleNormals<'_>| -> Vec<DVec3> {
        let faces = own.faces().iter().map(|face| own.plane(face.face).normal);
        faces.chain(own.borrowed().iter().map(|borrowed| borrowed.plane.normal)).collect()
    };
    let mut least = f64::INFINITY;
    for n in planes(b).into_iter().filter(|&n| a.vertex_admits(support(n).0, cso.toward_b(n))) {
        least = least.min(h(n));
    }
    for n in planes(a).into_iter().map(|n| -pose_ba.vector(n)).filter(|&n| b.vertex_admits(support(n).1, n)) {
        least = least.min(h(n));
    }
    let along = |own: &AdmissibleNormals<'_>, e: u32| {
        let edge = own.polytope().edge(e);
        own.polytope().vertex(edge.head) - own.polytope().vertex(edge.tail)
    };
    let between = |[left, right]: [DVec3; 2], axis: DVec3, n: DVec3| {
        n.dot(left + right) > 0.0 && axis.dot(left.cross(n)) >= 0.0 && axis.dot(n.cross(right)) >= 0.0
    };
    for arc_a in a.arcs() {
        for arc_b in b.arcs() {
            let (axis_a, axis_b) = (along(a, arc_a.edge), along(b, arc_b.edge));
            let Some(n) = pose_ba.vector(axis_a).cross(axis_b).try_normalize() else { continue };
            for n in [n, -n] {
                // The left face is to the left of the direction from tail to head. So the rotation
                // about the edge from the left face's normal to the right face's normal is
                // positive.
                if between(a.ends(arc_a), axis_a, cso.toward_b(n)) && between(b.ends(arc_b), axis_b, n) {
                    least = least.min(h(n));
                }
            }
        }
    }
    least
}

fn solve(
    [a, b]: [&AdmissibleNormals<'_>; 2],
    placement: &Placement,
    last: Option<FeaturePair>,
    scratch: &mut (AdmissibleScratch, DepthScratch),
) -> (Depth, Option<AdmissibleDepth>) {
    let walked = depth(a.polytope(), b.polytope(), placement, &[], &mut scratch.1);
    (walked, admissible_depth(a, b, placement, &walked, last, &mut scratch.0, &mut scratch.1))
}

#[test]
fn admissible_depth_agrees_with_exhaustive_search() {
    let mut rng = Random::new(SEED);
    let bodies = [bumpy_ball(&mut rng, 0.1), bumpy_ball(&mut rng, 0.02), bumpy_ball(&mut rng, 0.0)];
    let (mut moved, mut none) = (0, 0);
    for k in 0..6000 {
        let (a, b) = (&bodies[rng.below(3)], &bodies[rng.below(3)]);
        let mut scratch = (AdmissibleScratch::new(a.admissible(), b.admissible()), DepthScratch::new());
        let own_a = a.admissible_normals(rng.below(a.pieces().len()) as u32);
        let own_b = b.admissible_normals(rng.below(b.pieces().len()) as u32);
        let placement = random_pose(&mut rng, own_a.polytope(), own_b.polytope()).placement();
        let what = format!("pose {k}, seed {SEED:#x}");
        let (walked, answer) = solve([&own_a, &own_b], &placement, None, &mut scratch);
        if walked.depth < 0.0 || !is_global([&own_a, &own_b], &placement, &walked) {
            continue;
        }
        let least = exhaustive(&own_a, &own_b, &placement);
        let Some(answer) = answer else {
            assert!(least == f64::INFINITY, "{what}: no answer, but exhaustive search finds {least}");
            none += 1;
            continue;
        };
        moved += u32::from(answer.moved);
        assert!((answer.depth - least).abs() < 1e-9, "{what}: {answer:?}, least {least}");
        assert!(answer.depth >= walked.depth - 1e-9, "{what}: {answer:?}, {walked:?}");
        let gap = answer.point_a - answer.point_b + answer.normal * answer.depth;
        assert!(gap.length() < 1e-9, "{what}: {answer:?}");
        let again = solve([&own_a, &own_b], &placement, Some(answer.features), &mut scratch).1.unwrap();
        assert!((again.depth - answer.depth).abs() < 1e-12, "{what}: {again:?}, {answer:?}");
    }
    assert!(moved > 500 && none > 20, "{moved} {none}");
}

#[test]
fn admissible_depth_of_convex_probe_is_continuous() {
    let mut rng = Random::new(SEED);
    let probe = bumpy_ball(&mut rng, 0.0);
    let ball = bumpy_ball(&mut rng, 0.1);
    let mut scratch = (AdmissibleScratch::new(probe.admissible(), ball.admissible()), DepthScratch::new());
    let own_a = probe.admissible_normals(0);
    assert_eq!(probe.pieces().len(), 1);
    let (mut pairs, mut worst, mut jumps) = (0, 0.0_f64, 0);
    for _ in 0..60 {
        let own_b = ball.admissible_normals(rng.below(ball.pieces().len()) as u32);
        // The probe rolls over the piece without losing contact.
        let middle = own_b.polytope().centroid();
        let (axis, start) = (rng.direction(), rotation(&mut rng));
        let along = rng.direction().cross(middle).normalize() * 0.3;
        let pose = |s: f64| {
            let turn = DQuat::from_axis_angle(axis, 0.3 * s) * start;
            Pose::new(turn, middle + middle.normalize() * 0.9 + along * (s - 0.5))
        };
        let step = 1.0 / 2000.0;
        let mut last: Option<f64> = None;
        for i in 0..2000 {
            let (s, t) = (i as f64 * step, (i as f64 - 1.0) * step);
            let placement = pose(s).placement();
            let (walked, answer) = solve([&own_a, &own_b], &placement, None, &mut scratch);
            let depth = answer.filter(|_| walked.depth > 0.0).map(|answer| answer.depth);
            let motion = (0.3 * step) * 1.0 + pose(t).translation.distance(pose(s).translation);
            if let (Some(depth), Some(last)) = (depth, last) {
                let rate = (depth - last).abs() / motion;
                if rate > 1.5 && !is_global([&own_a, &own_b], &placement, &walked) {
                    continue;
                }
                pairs += 1;
                worst = worst.max(rate);
                jumps += u32::from(rate > 1.5);
            }
            last = depth;
        }
    }
    // A jump can occur when a normal becomes admissible at a vertex, if the normal lies on the
    // arc of an edge between two neighbouring pieces. The piece itself does not have this arc.
    assert!(
        jumps <= pairs / 50_000 && pairs > 20_000,
        "{jumps} jumps of {pairs}, up to {worst} motions, seed {SEED:#x}"
    );
}

#[test]
fn candidates_of_earlier_poses_do_not_change_the_depth() {
    let mut rng = Random::new(SEED);
    let bodies = [bumpy_ball(&mut rng, 0.1), bumpy_ball(&mut rng, 0.02)];
    let (mut found, mut again) = (0, 0);
    for walk in 0..400 {
        let (a, b) = (&bodies[rng.below(2)], &bodies[rng.below(2)]);
        let new = || (AdmissibleScratch::new(a.admissible(), b.admissible()), DepthScratch::new());
        let mut scratch = new();
        let own_a = a.admissible_normals(rng.below(a.pieces().len()) as u32);
        let own_b = b.admissible_normals(rng.below(b.pieces().len()) as u32);
        let mut pose = random_pose(&mut rng, own_a.polytope(), own_b.polytope());
        let mut last = None;
        // Slow motions use the margin up, and fast ones exceed it.
        let [speed, spin] = [10.0_f64.powf(rng.between(-4.0, -1.5)), 10.0_f64.powf(rng.between(-5.0, -2.0))];
        for tick in 0..200 {
            let turn = DQuat::from_scaled_axis(rng.vector() * spin);
            pose = Pose::new(turn * pose.rotation, pose.translation + rng.vector() * speed);
            let placement = pose.placement();
            let stored = scratch.0.candidates_found_at([&own_a, &own_b]);
            let answer = solve([&own_a, &own_b], &placement, last, &mut scratch).1;
            again += u32::from(scratch.0.candidates_found_at([&own_a, &own_b]) == stored);
            let anew = solve([&own_a, &own_b], &placement, None, &mut new()).1;
            let what = format!("walk {walk}, tick {tick}, seed {SEED:#x}");
            assert_eq!(answer.is_some(), anew.is_some(), "{what}");
            last = answer.filter(|answer| answer.moved).map(|answer| answer.features);
            if let (Some(answer), Some(anew)) = (answer, anew) {
                assert!((answer.depth - anew.depth).abs() < 1e-12, "{what}: {answer:?}, {anew:?}");
                found += u32::from(answer.moved);
            }
        }
    }
    assert!(found > 5_000 && (20_000..70_000).contains(&again), "{found} found, {again} of 80000 near the last");
}

#[test]
fn plane_is_preferred_to_a_crossing_of_the_same_depth() {
    // An edge of a lies in the top face of b, parallel to it. Along the top's normal, the edge also
    // crosses two edges of b.
    let [high, wide] = [DVec3::new(0.1, 0.05, 0.1), DVec3::new(0.3, 0.2, 0.07)];
    let [a, b] =
        [high, wide].map(|half| Body::build(cuboid(-half, half), &BodySettings::default(), &mut |_| ()).unwrap());
    let [own_a, own_b] = [a.admissible_normals(0), b.admissible_normals(0)];
    let mut scratch = (AdmissibleScratch::new(a.admissible(), b.admissible()), DepthScratch::new());
    let mut last = None;
    for tick in 0..1000 {
        let pose = |s: f64| {
            let turn = DQuat::from_rotation_y(0.6 + 0.3 * s);
            let low = turn.mul_vec3(DVec3::new(0.1, 0.0, -0.1)).z.min(turn.mul_vec3(DVec3::new(-0.1, 0.0, -0.1)).z);
            Pose::new(turn, DVec3::new(0.05 * s, 0.02, 0.07 - 0.01 * (1.1 + s.sin()) - low))
        };
        let placement = pose(0.01 * f64::from(tick)).placement();
        let walked = depth(own_a.polytope(), own_b.polytope(), &placement, &[], &mut scratch.1);
        let (candidates, depths) = (&mut scratch.0, &mut scratch.1);
        let answer = least_admissible_depth(&own_a, &own_b, &placement, walked.hub, last, candidates, depths).unwrap();
        let FeaturePair { a: feature_a, b: feature_b } = answer.features;
        assert!(
            matches!(
                (feature_a, feature_b),
                (Feature::Vertex(_), Feature::Face(_)) | (Feature::Face(_), Feature::Vertex(_))
            ),
            "tick {tick}: {answer:?}"
        );
        last = Some(answer.features);
    }
}
