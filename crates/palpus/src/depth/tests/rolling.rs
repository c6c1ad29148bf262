//! Queries that start from the answer of the previous tick.

use super::*;
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::depth::oracle::exhaustive_depth;

/// Returns a support point that moves smoothly with the direction: a weighted mean of the vertices,
/// with larger weights for higher vertices.
fn soft_support(polytope: &Polytope, direction: DVec3) -> DVec3 {
    let weight = |v: &DVec3| (30.0 * direction.dot(*v - polytope.centroid()) / polytope.radius()).exp();
    let total: f64 = polytope.vertices().iter().map(weight).sum();
    polytope.vertices().iter().map(|v| *v * weight(v)).sum::<DVec3>() / total
}

/// Returns a pose at which the soft supports of bodies a and b coincide and the offset along
/// `normal` is `depth`. So the penetration depth is at most `depth`.
fn pose_at_depth(a: &Polytope, b: &Polytope, rotation: DQuat, normal: DVec3, depth: f64) -> Pose {
    let rest = soft_support(b, normal) - rotation * soft_support(a, rotation.conjugate() * -normal);
    let rested = Pose { rotation, translation: rest };
    let placement = rested.placement();
    let (_, reach) = cso::Cso { a, b, pose_ba: &placement }.support(HubPair { a: 0, b: 0 }, normal);
    Pose { translation: rest + normal * (reach - depth), ..rested }
}

#[test]
#[allow(clippy::print_stderr, reason = "the share of local answers is a measurement to be seen")]
fn previous_answer_keeps_global_depth_while_rolling() {
    let shapes = shapes();
    let mut rng = Random::new(SEED);
    let mut scratch = DepthScratch::new();
    let mut total = Tally::default();
    for (name_a, a) in &shapes {
        for (name_b, b) in &shapes {
            let size = a.radius() + b.radius();
            let (from, to, axis) = (rng.direction(), rng.direction(), rng.direction());
            let start = rotation(&mut rng);
            let mut previous: Option<Depth> = None;
            for tick in 0..300 {
                let s = f64::from(tick) / 300.0;
                let normal = from.lerp(to, s).normalize();
                let rotation = DQuat::from_axis_angle(axis, 2.0 * s) * start;
                let placement = pose_at_depth(a, b, rotation, normal, 0.002 * size).placement();
                let seed = previous.map_or(Seed::CentroidLine, |d| d.seed());
                let answer = depth(a, b, &placement, &[seed], &mut scratch);
                previous = Some(answer);
                if tick % 20 == 0 {
                    let what = format!("{name_a} on {name_b}, tick {tick}, seed {SEED:#x}");
                    assert_identities(a, b, &placement, &answer, &what);
                    let (exact, _) = exhaustive_depth(a, b, &placement);
                    if exact >= 0.0 {
                        assert_points_on_bodies(a, b, &placement, &answer, 2e-9, &what);
                        let local = total.local;
                        total.add(answer.depth, exact, size);
                        if total.local > local {
                            eprintln!("{what}: {} of {exact}", answer.depth);
                        }
                    }
                }
            }
        }
    }
    eprintln!("rolling: {} of {} local only, by {:e} of the size", total.local, total.poses, total.worst);
    assert_eq!(total.local, 0, "seed {SEED:#x}");
}

#[test]
fn walks_between_rough_pieces_find_an_end() {
    // The faces of these pieces are merged from facets that are not exactly coplanar. Therefore a
    // face's plane may have a lower offset than the measured offset.
    let mut rng = Random::new(SEED);
    let mut soup = PolygonSoup::new();
    let n = 40_u32;
    for k in 0..n * n {
        let (u, v) = (f64::from(k % n) / f64::from(n - 1), f64::from(k / n) / f64::from(n - 1));
        let height = 0.05 * (7.0 * u).sin() * (5.0 * v).cos() + 2e-4 * rng.signed();
        soup.vertices.push(DVec3::new(u, v, height));
    }
    for k in (0..n * (n - 1)).filter(|k| k % n < n - 1) {
        soup.push_face(&[k, k + 1, k + n + 1]);
        soup.push_face(&[k, k + n + 1, k + n]);
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let body = Body::build(mesh, &settings, &mut |_| ()).unwrap();
    let pieces = body.polytopes();
    let mut scratch = DepthScratch::new();
    let (mut overlays, mut lost, mut total) = (walk::Overlays::new(), 0u32, 0u32);
    for _ in 0..3000 {
        let (a, b) = (&pieces[rng.below(pieces.len())], &pieces[rng.below(pieces.len())]);
        let size = a.radius() + b.radius();
        let start = rotation(&mut rng);
        let (axis, along) = (rng.direction(), 1e-2 * size * rng.direction());
        let mut previous: Option<Depth> = None;
        for tick in 0..20 {
            let rotation = DQuat::from_axis_angle(axis, 1e-2 * f64::from(tick)) * start;
            let place = b.centroid() - rotation * a.centroid() + along * f64::from(tick);
            let placement = Pose::new(rotation, place).placement();
            if let Some(previous) = previous {
                let cso = cso::Cso { a, b, pose_ba: &placement };
                total += 1;
                lost += u32::from(walk::walk(&cso, previous.antipodal, Some(&mut overlays)).is_none());
            }
            let seed = previous.map_or(Seed::CentroidLine, |d| d.seed());
            previous = Some(depth(a, b, &placement, &[seed], &mut scratch));
        }
    }
    assert!(f64::from(lost) < 1e-3 * f64::from(total), "seed {SEED:#x}: {lost} of {total} walks without an end");
}
