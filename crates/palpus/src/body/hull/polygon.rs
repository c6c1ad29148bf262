//! Computes the convex hull of points that lie in one plane, up to rounding.
//!
//! 1. Project the points along the coordinate axis nearest to the plane's normal. The projection
//!    only drops one coordinate, so it is exact.
//! 2. Compute the strictly convex hull with a monotone chain and exact orientation tests (Andrew
//!    1979).
//! 3. Drop corners that lie within the merge distance of the chord between the remaining corners.

use glam::DVec3;

use super::normal::{cross_of, unit};

/// Returns the corners of the convex polygon, counter-clockwise as seen from the side to which
/// `normal` points. Returns fewer than three corners if the points are collinear. `points` must be
/// distinct and in lexicographic order.
pub(super) fn convex_polygon_corners(points: &[DVec3], normal: DVec3, coplanar: f64) -> Vec<u32> {
    let steep = normal.abs();
    let axis = if steep.x >= steep.y && steep.x >= steep.z {
        0
    } else if steep.y >= steep.z {
        1
    } else {
        2
    };
    let flat: Vec<[f64; 2]> = points.iter().map(|p| [p[(axis + 1) % 3], p[(axis + 2) % 3]]).collect();
    let mut corners = monotone_chain(&flat);
    if normal[axis] < 0.0 {
        corners.reverse();
    }
    without_straight_corners(points, corners, coplanar)
}

/// Returns the unit normal of a convex polygon that is planar up to rounding. Of the two opposite
/// normals it returns the one nearer to `roughly`.
pub(super) fn fitted_normal(polygon: &[DVec3], roughly: DVec3) -> DVec3 {
    let area: DVec3 = polygon[1..].windows(2).map(|side| cross_of(polygon[0], side[0], side[1])).sum();
    let normal = unit(area);
    if normal == DVec3::ZERO {
        roughly
    } else if normal.dot(roughly) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// Returns true if three points lie exactly on one line.
pub(super) fn collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    (0..3).all(|axis| {
        let [a, b, c] = [a, b, c].map(|p| robust::Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] });
        robust::orient2d(a, b, c) == 0.0
    })
}

/// Returns the corners of the strictly convex hull of points in the plane, counter-clockwise.
fn monotone_chain(flat: &[[f64; 2]]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..flat.len() as u32).collect();
    let key = |k: u32| flat[k as usize].map(|x| x + 0.0);
    order.sort_by(|&i, &j| {
        let (p, q) = (key(i), key(j));
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1]))
    });
    order.dedup_by(|later, first| key(*later) == key(*first));
    if order.len() < 3 {
        return order;
    }
    let turns_left = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|k| robust::Coord { x: flat[k as usize][0], y: flat[k as usize][1] });
        robust::orient2d(a, b, c) > 0.0
    };
    let mut chain: Vec<u32> = Vec::new();
    let extend = |chain: &mut Vec<u32>, floor: usize, k: u32| {
        while chain.len() >= floor + 2 && !turns_left(chain[chain.len() - 2], chain[chain.len() - 1], k) {
            chain.pop();
        }
        chain.push(k);
    };
    for &k in &order {
        extend(&mut chain, 0, k);
    }
    let floor = chain.len() - 1;
    for &k in order.iter().rev().skip(1) {
        extend(&mut chain, floor, k);
    }
    chain.pop();
    chain
}

/// Drops corners that are nearly straight. A run of corners is dropped only if all of them lie
/// within the merge distance of the chord that replaces them.
fn without_straight_corners(points: &[DVec3], corners: Vec<u32>, coplanar: f64) -> Vec<u32> {
    let n = corners.len();
    if n <= 3 {
        return corners;
    }
    let at = |k: usize| points[corners[k % n] as usize];
    // Start at the corner farthest from the middle, because that corner is never nearly straight.
    let middle = corners.iter().map(|&v| points[v as usize]).sum::<DVec3>() / n as f64;
    let mut start = 0;
    for k in 1..n {
        if at(k).distance_squared(middle) > at(start).distance_squared(middle) {
            start = k;
        }
    }
    let misses = |from: usize, to: usize| {
        let along = unit(at(to) - at(from));
        (from + 1..to).any(|k| (at(k) - at(from)).cross(along).length() > coplanar)
    };
    let mut kept = vec![corners[start]];
    let mut from = start;
    for to in start + 2..=start + n {
        if misses(from, to) {
            from = to - 1;
            kept.push(corners[from % n]);
        }
    }
    if kept.len() < 3 { corners } else { kept }
}
