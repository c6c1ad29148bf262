//! Checks a decomposition with independent code. Every triangle must belong to one piece and lie
//! on that piece's hull. Each piece must lie inside the solid. To check this, the code tests random
//! points inside each piece, and whether its faces cross the surface.
//!
//! Limits: samples miss parts that are thinner than the sample spacing. Before the test for
//! crossings, each hull is shrunk slightly toward its centroid, so that touching does not count. If
//! a piece leaves the solid by less than the shrinkage, the test does not detect it.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::algebra::Random;
use crate::body::{Aabb, Body, Polytope, TrianglePair};

/// Smallest share of its size by which a piece is shrunk before its faces are tested.
const SHRINK: f64 = 1e-3;

/// Asserts that each triangle belongs to one piece and lies within `slack` (m) of the
/// surface of that piece's hull.
pub(in crate::body) fn assert_partition(body: &Body, slack: f64) {
    let mut owners = vec![0; body.mesh().triangles().len()];
    for (k, (polytope, piece)) in body.polytopes().iter().zip(body.pieces()).enumerate() {
        for &t in piece.triangles() {
            owners[t as usize] += 1;
            let corners = body.mesh().triangle_points(t);
            let above = |p: DVec3| polytope.planes().iter().map(|plane| plane.height(p)).fold(f64::MIN, f64::max);
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            for p in corners.into_iter().chain([middle]) {
                let height = above(p);
                assert!(height.abs() <= slack, "piece {k}, triangle {t}: a point is {height:e} from the hull");
            }
        }
    }
    assert!(owners.iter().all(|&n| n == 1), "a triangle belongs to no piece or to several");
}

/// Asserts that random points of the pieces are inside the solid, or within `slack` (m) of its
/// surface. The surface must be closed.
pub(in crate::body) fn assert_samples_inside(body: &Body, slack: f64, per_piece: usize, seed: u64) {
    let mut random = Random::new(seed);
    for (k, polytope) in body.polytopes().iter().enumerate() {
        for _ in 0..per_piece {
            let p = random_point(polytope, &mut random);
            let inside = body.tree().inside(p) || body.tree().nearest_within(p, slack).is_some();
            assert!(inside, "seed {seed}: piece {k} leaves the solid at {p}");
        }
    }
}

/// Asserts that no face of a piece crosses the surface by more than `slack` (m). Each piece is
/// shrunk until each face has moved by `slack`. Pieces that are too thin for this are skipped.
pub(in crate::body) fn assert_no_crossing(body: &Body, slack: f64) {
    for (k, polytope) in body.polytopes().iter().enumerate() {
        let centroid = polytope.centroid();
        let depth = polytope.planes().iter().map(|plane| -plane.height(centroid)).fold(f64::MAX, f64::min);
        let shrink = SHRINK.max(slack / depth);
        if polytope.is_flat() || shrink > 0.5 {
            continue;
        }
        let shrunk = |v: u32| centroid + (polytope.vertex(v) - centroid) * (1.0 - shrink);
        for f in 0..polytope.face_count() as u32 {
            let corners = polytope.face_vertices(f);
            for corners in corners.fan() {
                let face = corners.map(&shrunk);
                let crossed = body.tree().visit_overlapping(&Aabb::around(face), |_, triangle| {
                    let crossing = TrianglePair::new(face, *triangle) == TrianglePair::Crossing;
                    if crossing { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                });
                assert!(crossed.is_continue(), "piece {k}, face {f} crosses the surface");
            }
        }
    }
}

/// Returns a random point in the hull of up to four random vertices.
fn random_point(polytope: &Polytope, random: &mut Random) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut total = 0.0;
    for _ in 0..4 {
        let weight = 1.0 + random.signed();
        sum += weight * polytope.vertex(random.below(polytope.vertices().len()) as u32);
        total += weight;
    }
    if total > 0.0 { sum / total } else { polytope.centroid() }
}
