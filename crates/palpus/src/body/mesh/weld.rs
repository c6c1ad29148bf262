//! Welds equal vertices and removes degenerate triangles.
//!
//! 1. [`weld`] merges vertices that are closer than [`tolerance::WELD`] times the extent. The first
//!    vertex in the list stays.
//! 2. [`unbend_caps`] removes *caps*. A cap is a triangle without area whose middle corner lies on
//!    its longest side. The function cuts the neighbour across this longest side in two, at the
//!    middle corner. The cut closes the surface and moves no vertex.
//! 3. [`drop_empty`] drops the remaining triangles without area. [`drop_duplicates`] keeps the
//!    first of all triangles with the same three corners, in any order.

use std::collections::HashMap;

use glam::DVec3;

use crate::algebra::tolerance;
use crate::body::Aabb;
use crate::body::mesh::edge_uses::EdgeUses;

/// Returns for each vertex the first vertex within the tolerance. For most vertices, the result is
/// the vertex itself. `used` marks the vertices of faces; other vertices are not merged. The
/// tolerance is relative to the extent of the used vertices, which must not be 0.
pub(in crate::body) fn weld(vertices: &[DVec3], used: &[bool]) -> Vec<u32> {
    let mut answer: Vec<u32> = (0..vertices.len() as u32).collect();
    let bounds = Aabb::around(vertices.iter().zip(used).filter(|(_, used)| **used).map(|(p, _)| *p));
    let extent = (bounds.max - bounds.min).max_element();
    let reach = tolerance::WELD * extent;
    // The cells are much larger than the tolerance, so the search for nearly every vertex needs one
    // cell.
    let cell = tolerance::WELD_CELL * extent;
    let cell_of = |p: DVec3| ((p - bounds.min) / cell).to_array().map(|x| x.floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(vertices.len());
    for v in (0..vertices.len()).filter(|&v| used[v]) {
        let p = vertices[v];
        let (low, high) = (cell_of(p - reach), cell_of(p + reach));
        let near = cells_between(low, high)
            .filter_map(|key| cells.get(&key))
            .flatten()
            .filter(|&&other| vertices[other as usize].distance_squared(p) <= reach * reach)
            .min();
        match near {
            Some(&first) => answer[v] = first,
            None => cells.entry(cell_of(p)).or_default().push(v as u32),
        }
    }
    answer
}

/// Returns the keys of all cells from `low` to `high`, inclusive.
fn cells_between(low: [i64; 3], high: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (low[0]..=high[0])
        .flat_map(move |x| (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z])))
}

/// Returns the longest side `k` of a triangle without area; `None` if the triangle has an area. A
/// triangle has no area if its height over the longest side, divided by that side's length, is at
/// most [`tolerance::ZERO_AREA`].
pub(in crate::body) fn empty_over(corners: [DVec3; 3]) -> Option<usize> {
    let sides = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
    let longest = if sides[0].length_squared() >= sides[1].length_squared() { 0 } else { 1 };
    let longest = if sides[2].length_squared() > sides[longest].length_squared() { 2 } else { longest };
    let base = sides[longest].length_squared();
    let twice_area = sides[(longest + 1) % 3].cross(sides[(longest + 2) % 3]).length();
    (twice_area <= tolerance::ZERO_AREA * base).then_some(longest)
}

/// Replaces each cap and its neighbour across the longest side by two triangles that share the
/// cap's middle corner. Does not change a cap without a unique neighbour at that side. Returns the
/// number of replaced caps. Entry k of `sources` still belongs to triangle k afterwards.
pub(in crate::body) fn unbend_caps(vertices: &[DVec3], triangles: &mut [[u32; 3]], sources: &mut [u32]) -> usize {
    let mut repaired = 0;
    for _ in 0..tolerance::CAP_ROUNDS {
        let caps: Vec<(usize, usize)> = (0..triangles.len())
            .filter_map(|t| {
                let [a, b, c] = triangles[t];
                let side = empty_over(triangles[t].map(|v| vertices[v as usize]))?;
                (a != b && b != c && c != a).then_some((t, side))
            })
            .collect();
        if caps.is_empty() {
            break;
        }
        let longest: HashMap<u32, usize> = caps.iter().map(|&(t, k)| ((3 * t + k) as u32, t)).collect();
        let mut touched = vec![false; triangles.len()];
        let before = repaired;
        let uses: Vec<[u32; 2]> = EdgeUses::new(vertices.len(), triangles)
            .edges()
            .filter_map(|uses| <[u32; 2]>::try_from(uses).ok())
            .filter(|uses| uses.iter().any(|side| longest.contains_key(side)))
            .collect();
        for [first, second] in uses {
            let (side, across) = if longest.contains_key(&first) { (first, second) } else { (second, first) };
            let (t, u) = ((side / 3) as usize, (across / 3) as usize);
            let middle = triangles[t][(side as usize + 2) % 3];
            let k = (across % 3) as usize;
            let [from, to, apex] = [triangles[u][k], triangles[u][(k + 1) % 3], triangles[u][(k + 2) % 3]];
            if touched[t] || touched[u] || apex == middle {
                continue;
            }
            (touched[t], touched[u]) = (true, true);
            triangles[t] = [from, middle, apex];
            triangles[u] = [middle, to, apex];
            sources[t] = sources[u];
            repaired += 1;
        }
        if repaired == before {
            break;
        }
    }
    repaired
}

/// Drops the triangles without area and returns their number.
pub(in crate::body) fn drop_empty(vertices: &[DVec3], triangles: &mut Vec<[u32; 3]>, sources: &mut Vec<u32>) -> usize {
    let keep: Vec<bool> = triangles.iter().map(|t| empty_over(t.map(|v| vertices[v as usize])).is_none()).collect();
    retain(triangles, sources, &keep)
}

/// Drops every triangle that has the same three corners as an earlier triangle, and returns the
/// number of dropped triangles.
pub(in crate::body) fn drop_duplicates(triangles: &mut Vec<[u32; 3]>, sources: &mut Vec<u32>) -> usize {
    let mut keys: Vec<([u32; 3], u32)> = triangles
        .iter()
        .zip(0..)
        .map(|(&triangle, t)| {
            let mut corners = triangle;
            corners.sort_unstable();
            (corners, t)
        })
        .collect();
    keys.sort_unstable();
    let mut keep = vec![true; triangles.len()];
    for pair in keys.windows(2) {
        if pair[0].0 == pair[1].0 {
            keep[pair[1].1 as usize] = false;
        }
    }
    retain(triangles, sources, &keep)
}

fn retain(triangles: &mut Vec<[u32; 3]>, sources: &mut Vec<u32>, keep: &[bool]) -> usize {
    let before = triangles.len();
    let mut kept = keep.iter();
    triangles.retain(|_| kept.next().copied().unwrap_or(false));
    let mut kept = keep.iter();
    sources.retain(|_| kept.next().copied().unwrap_or(false));
    before - triangles.len()
}
