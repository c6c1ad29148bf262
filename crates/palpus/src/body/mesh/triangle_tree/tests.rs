//! Compares nearest points, rays and overlaps with a search through all triangles.

use super::ray::Ray;
use super::*;
use crate::algebra::Random;
use crate::algebra::closest_on_triangle;
use crate::body::shapes::torus;

const SEED: u64 = 0x51ab_77e0;

#[test]
fn tree_queries_agree_with_exhaustive_search() {
    let mesh = torus(1.0, 0.4, 37, 21);
    let tree = mesh.tree();
    let mut random = Random::new(SEED);
    for case in 0..300 {
        let p = random.vector() * 2.0;
        let all = (0..mesh.triangles().len() as u32).map(|t| (t, mesh.triangle_points(t)));
        let nearest = all.clone().map(|(_, [a, b, c])| closest_on_triangle(p, a, b, c).distance(p));
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        let found = tree.nearest(p).unwrap();
        let [a, b, c] = mesh.triangle_points(found.triangle);
        assert!((found.distance - nearest).abs() < 1e-15, "seed {SEED}, case {case}");
        assert_eq!(closest_on_triangle(p, a, b, c), found.point);
        assert_eq!(tree.nearest_within(p, nearest * 0.999), None);

        let query = Aabb::around([p, p + random.vector() * 0.5]);
        let mut overlapping: Vec<u32> =
            all.clone().filter(|(_, c)| Aabb::around(*c).overlaps(&query)).map(|(t, _)| t).collect();
        let mut visited = Vec::new();
        let _ = tree.visit_overlapping(&query, |t, _| {
            visited.push(t);
            ControlFlow::Continue(())
        });
        visited.sort_unstable();
        overlapping.sort_unstable();
        assert_eq!(visited, overlapping, "seed {SEED}, case {case}");

        let direction = random.vector();
        let ray = Ray::new(p, direction);
        let first = all.filter_map(|(_, c)| ray.meets_triangle(&c)).fold(f64::INFINITY, f64::min);
        assert_eq!(tree.ray_cast(p, direction, f64::INFINITY).map_or(f64::INFINITY, |hit| hit.t), first);
        assert_eq!(tree.ray_cast(p, direction, first * 0.999), None);
    }
}

#[test]
fn rays_from_inside_hit_vertices_and_edges() {
    // The rays go from the tube's centre to vertices and edge midpoints. At these points a leak is
    // most likely.
    let mesh = torus(1.0, 0.4, 12, 8);
    let tree = mesh.tree();
    for &v in mesh.vertices() {
        let center = DVec3::new(v.x, v.y, 0.0).normalize();
        let hit = tree.ray_cast(center, v - center, 2.0).unwrap();
        assert!((hit.t - 1.0).abs() < 1e-12, "{v}: {hit:?}");
    }
    for direction in [DVec3::X, DVec3::NEG_X, DVec3::Z] {
        let hit = tree.ray_cast(DVec3::X, direction, f64::INFINITY).unwrap();
        assert!((hit.t - 0.4).abs() < 1e-12);
    }
}

#[test]
fn each_overlapping_pair_is_visited_once() {
    let mesh = torus(1.0, 0.4, 9, 7);
    let bounds: Vec<Aabb> = (0..mesh.triangles().len() as u32).map(|t| Aabb::around(mesh.triangle_points(t))).collect();
    let mut pairs = Vec::new();
    let _ = mesh.tree().visit_own_pairs(|(i, _), (j, _)| {
        pairs.push((i.min(j), i.max(j)));
        ControlFlow::Continue(())
    });
    pairs.sort_unstable();
    let expected: Vec<(u32, u32)> = (0..bounds.len() as u32)
        .flat_map(|i| (i + 1..bounds.len() as u32).map(move |j| (i, j)))
        .filter(|&(i, j)| bounds[i as usize].overlaps(&bounds[j as usize]))
        .collect();
    assert_eq!(pairs, expected);
}
