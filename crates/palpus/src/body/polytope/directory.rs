//! Finds the start of a support query if the caller has no hint.
//!
//! * A small polytope stores the coordinates of its vertices in groups of four, and tests all
//!   vertices without branches.
//! * A larger polytope stores a map of the sphere of directions (an octahedral map on a square)
//!   with about one cell per vertex. Each cell stores the support vertex of its middle direction. A
//!   climb from this vertex visits one or two rings, for any number of vertices.

use glam::DVec3;

/// If a polytope has at most this number of vertices, all are tested. In measurements, this test
/// and a climb from a cell take equally long at about 30 vertices.
const SCAN_BELOW: usize = 32;

/// The data to start a support query without a hint.
#[derive(Clone, Debug)]
pub(in crate::body) enum Directory {
    /// All vertices in groups of four. Copies of the first vertex complete the last group.
    Scan(Box<[Four]>),
    /// The octahedral map of directions.
    Map {
        /// Number of cells along a side of the square.
        side: u32,
        /// The vertex of each cell, row by row.
        starts: Box<[u32]>,
    },
}

/// The coordinates of four vertices.
#[derive(Clone, Debug)]
pub(in crate::body) struct Four {
    x: [f64; 4],
    y: [f64; 4],
    z: [f64; 4],
}

impl Four {
    fn of(points: &[DVec3; 4]) -> Self {
        Self { x: points.map(|p| p.x), y: points.map(|p| p.y), z: points.map(|p| p.z) }
    }
}

/// Result of [`Directory::look`].
pub(in crate::body) enum Known {
    /// The support vertex.
    Farthest(u32),
    /// A vertex from which a climb is short.
    Near(u32),
}

impl Directory {
    /// Builds the directory of `vertices`. `climb` returns the support vertex for a start vertex
    /// and a direction.
    pub(in crate::body) fn new(vertices: &[DVec3], climb: impl Fn(u32, DVec3) -> u32) -> Self {
        if vertices.len() <= SCAN_BELOW {
            let (whole, rest) = vertices.as_chunks();
            let mut fours = Vec::with_capacity(vertices.len().div_ceil(4));
            fours.extend(whole.iter().map(Four::of));
            if !rest.is_empty() {
                fours.push(Four::of(&std::array::from_fn(|k| rest.get(k).copied().unwrap_or(vertices[0]))));
            }
            return Self::Scan(fours.into_boxed_slice());
        }
        let side = (vertices.len() as f64).sqrt().ceil() as usize;
        let mut starts = Vec::with_capacity(side * side);
        let mut row_start = 0;
        for row in 0..side {
            let mut start = row_start;
            for column in 0..side {
                let middle = |k: usize| (2 * k + 1) as f64 / side as f64 - 1.0;
                start = climb(start, unfolded(middle(column), middle(row)));
                if column == 0 {
                    row_start = start;
                }
                starts.push(start);
            }
        }
        Self::Map { side: side as u32, starts: starts.into_boxed_slice() }
    }

    /// Returns the support vertex along `direction` and its position if the polytope is small;
    /// `None` if the polytope has a map.
    #[inline]
    pub(in crate::body) fn scan(&self, direction: DVec3) -> Option<(u32, DVec3)> {
        match self {
            Self::Scan(fours) => {
                let v = farthest(fours, direction);
                let (four, k) = (&fours[v as usize / 4], v as usize % 4);
                Some((v, DVec3::new(four.x[k], four.y[k], four.z[k])))
            }
            Self::Map { .. } => None,
        }
    }

    /// Returns the support vertex along `direction` or a vertex near it. `direction` need not have
    /// unit length.
    #[inline]
    pub(in crate::body) fn look(&self, direction: DVec3) -> Known {
        match self {
            Self::Scan(fours) => Known::Farthest(farthest(fours, direction)),
            Self::Map { side, starts } => {
                let (u, v) = folded(direction);
                let cell = |t: f64| ((t + 1.0) * (0.5 * f64::from(*side))) as usize;
                let last = *side as usize - 1;
                let k = cell(v).min(last) * *side as usize + cell(u).min(last);
                Known::Near(starts[k])
            }
        }
    }
}

/// Returns the support vertex along `direction`.
#[inline]
fn farthest(fours: &[Four], direction: DVec3) -> u32 {
    let mut heights = [f64::NEG_INFINITY; 4];
    let mut places = [0.0_f64; 4];
    let mut place = 0.0;
    for four in fours {
        for k in 0..4 {
            let height = direction.x * four.x[k] + direction.y * four.y[k] + direction.z * four.z[k];
            let higher = height > heights[k];
            heights[k] = if higher { height } else { heights[k] };
            places[k] = if higher { place } else { places[k] };
        }
        place += 4.0;
    }
    let higher = |i: usize, j: usize| if heights[j] > heights[i] { j } else { i };
    let best = higher(higher(0, 1), higher(2, 3));
    places[best] as u32 + best as u32
}

/// Maps a direction to the square [−1, 1]². The map projects the octahedron |x| + |y| + |z| = 1
/// along z, with the lower faces folded outward.
#[inline]
fn folded(direction: DVec3) -> (f64, f64) {
    let DVec3 { x, y, z } = direction;
    let scale = 1.0 / (x.abs() + y.abs() + z.abs());
    let (u, v) = (x * scale, y * scale);
    let (over_u, over_v) = ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v));
    if z < 0.0 { (over_u, over_v) } else { (u, v) }
}

/// Returns the direction at a point of the square. The result is not a unit vector.
fn unfolded(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - u.abs() - v.abs();
    if z < 0.0 { DVec3::new((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v), z) } else { DVec3::new(u, v, z) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::convex_hull;

    /// Returns `n` points of a golden-angle lattice on a flattened sphere \[Swinbank and Purser
    /// 2006\].
    fn lattice(n: usize) -> Vec<DVec3> {
        let point = |k: usize| {
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let (s, c) = (2.399_963_229_728_653 * k as f64).sin_cos();
            DVec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), 0.4 * z)
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn unfolding_is_the_inverse_of_folding() {
        for d in lattice(97) {
            let (u, v) = folded(d);
            assert!((unfolded(u, v).normalize() - d.normalize()).length() < 1e-14, "{d}");
        }
    }

    #[test]
    fn support_agrees_with_a_scan_for_all_sizes() {
        for n in [4, 7, 20, 32, 33, 100, 700] {
            let polytope = convex_hull(&lattice(n), 1e-9).unwrap().into_polytope().unwrap().0;
            for d in lattice(311).into_iter().chain([DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z]) {
                let height = |v: &DVec3| d.dot(*v);
                let scan = polytope.vertices().iter().map(height).fold(f64::NEG_INFINITY, f64::max);
                let found = height(&polytope.vertex(polytope.support(d)));
                assert!(scan - found <= 1e-15, "{n} vertices, {d}: {found}, not {scan}");
            }
            // Every direction gives a valid vertex, even NaN.
            for d in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::splat(f64::MIN_POSITIVE)] {
                assert!((polytope.support(d) as usize) < polytope.vertices().len());
            }
        }
    }
}
