//! A simplified solid, for software rendering.
//!
//! 1. Corners in the same cell of a grid whose normals point to the same side are merged into one
//!    corner in their middle. The two sides of a thin wall therefore stay separate.
//! 2. Triangles with fewer than three different corners are removed, and so are duplicates.
//! 3. The size of the cells is searched so that at most the requested number of triangles remains,
//!    before duplicates are removed.
//!
//! J. Rossignac, P. Borrel, *Multi-resolution 3D approximations for rendering complex scenes*,
//! 1993, with the sides of step 1 added. The simplified solid is only drawn: the engine uses the
//! whole mesh.

use ahash::{HashMap, HashSet};
use glam::DVec3;

use crate::solid::Solid;

/// Bisection steps of the search for the cell size.
const ROUNDS: usize = 6;
/// Largest number of cells along the longest side.
const MOST_CELLS: f64 = 2048.0;
/// Bits of a cell's number along an axis, and of a side.
const CELL_BITS: u32 = 12;
const SIDE_BITS: u32 = 3;

/// The corners of a solid in one cell, on one side.
struct Corner {
    sum: DVec3,
    normal: DVec3,
    count: f64,
}

/// A solid with the side of each corner's normal.
struct Sided<'a> {
    solid: &'a Solid,
    sides: Vec<[u8; 3]>,
    low: DVec3,
    /// Longest side of the solid's box.
    size: f64,
}

impl Solid {
    /// Returns this solid with at most `most` triangles, for drawing only.
    pub fn coarse(&self, most: usize) -> Option<Self> {
        if self.triangles.len() <= most {
            return None;
        }
        let (low, high) = self.bounds();
        let sides = self.normals.iter().map(|normals| normals.map(side)).collect();
        let sided = Sided { solid: self, sides, low, size: (high - low).max_element().max(f64::MIN_POSITIVE) };
        let (mut few, mut many) = (1.0, MOST_CELLS);
        for _ in 0..ROUNDS {
            let cells = f64::sqrt(few * many);
            if sided.count(cells) <= most {
                few = cells;
            } else {
                many = cells;
            }
        }
        Some(sided.in_cells(few))
    }
}

impl Sided<'_> {
    /// Returns the cell of each vertex in a grid of `cells` cells along the longest side.
    fn cells(&self, cells: f64) -> Vec<u64> {
        let scale = cells / self.size;
        let cell = |vertex: &DVec3| {
            let parts = ((*vertex - self.low) * scale).to_array().map(|part| part as u64);
            (parts[0] << CELL_BITS | parts[1]) << CELL_BITS | parts[2]
        };
        self.solid.vertices.iter().map(cell).collect()
    }

    /// Returns the keys of the corners of triangle `t`: cell and side.
    fn keys(&self, cells: &[u64], t: usize) -> [u64; 3] {
        let triangle = self.solid.triangles[t];
        [0, 1, 2].map(|k| cells[triangle[k] as usize] << SIDE_BITS | u64::from(self.sides[t][k]))
    }

    /// Returns the number of triangles that remain in a grid of `cells` cells, with duplicates.
    fn count(&self, cells: f64) -> usize {
        let cells = self.cells(cells);
        let remains = |t: &usize| {
            let [a, b, c] = self.keys(&cells, *t);
            a != b && b != c && c != a
        };
        (0..self.solid.triangles.len()).filter(remains).count()
    }

    /// Does steps 1 and 2 with a grid of `cells` cells along the longest side.
    fn in_cells(&self, cells: f64) -> Solid {
        let solid = self.solid;
        let cells = self.cells(cells);
        // The standard hash takes most of the time of a simplification.
        let mut numbers = HashMap::default();
        let mut corners: Vec<Corner> = Vec::new();
        let mut seen = HashSet::default();
        let mut coarse = Solid::default();
        let mut of_triangle = Vec::new();
        for (t, triangle) in solid.triangles.iter().enumerate() {
            let points = triangle.map(|v| solid.vertices[v as usize]);
            let [a, b, c] = points;
            let area = (b - a).cross(c - a).length();
            let keys = self.keys(&cells, t);
            let mut kept = [0; 3];
            for k in 0..3 {
                let number = *numbers.entry(keys[k]).or_insert_with(|| {
                    corners.push(Corner { sum: DVec3::ZERO, normal: DVec3::ZERO, count: 0.0 });
                    corners.len() as u32 - 1
                });
                let corner = &mut corners[number as usize];
                corner.sum += points[k];
                corner.normal += solid.normals[t][k] * area;
                corner.count += 1.0;
                kept[k] = number;
            }
            let [a, b, c] = kept;
            if a == b || b == c || c == a {
                continue;
            }
            // Normalised so that the order of the corners does not matter.
            let turn = (0..3).min_by_key(|k| kept[*k]).unwrap_or(0);
            if seen.insert([kept[turn], kept[(turn + 1) % 3], kept[(turn + 2) % 3]]) {
                coarse.triangles.push(kept);
                coarse.pieces.push(solid.pieces[t]);
                of_triangle.push(t);
            }
        }
        coarse.vertices = corners.iter().map(|corner| corner.sum / corner.count).collect();
        let normal = |number: u32, own: DVec3| corners[number as usize].normal.normalize_or(own);
        coarse.normals = (coarse.triangles.iter().zip(of_triangle))
            .map(|(kept, t)| [0, 1, 2].map(|k| normal(kept[k], solid.normals[t][k])))
            .collect();
        coarse
    }
}

/// Returns the nearest of the six face directions of a cube.
fn side(normal: DVec3) -> u8 {
    let size = normal.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    2 * axis + u8::from(normal[usize::from(axis)] < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a ball of radius 1, made of rings.
    fn ball(rings: u32, round: u32) -> Solid {
        let mut solid = Solid::default();
        for i in 0..=rings {
            let (sin, cos) = (f64::from(i) / f64::from(rings) * std::f64::consts::PI).sin_cos();
            for k in 0..round {
                let (y, x) = (f64::from(k) / f64::from(round) * std::f64::consts::TAU).sin_cos();
                solid.vertices.push(DVec3::new(x * sin, y * sin, cos));
            }
        }
        for i in 0..rings {
            for k in 0..round {
                let at = |i: u32, k: u32| i * round + k % round;
                for triangle in [[at(i, k), at(i + 1, k), at(i + 1, k + 1)], [at(i, k), at(i + 1, k + 1), at(i, k + 1)]]
                {
                    solid.triangles.push(triangle);
                    solid.normals.push(triangle.map(|v| solid.vertices[v as usize].normalize()));
                    solid.pieces.push(0);
                }
            }
        }
        solid
    }

    #[test]
    fn coarse_ball_keeps_its_shape() {
        let fine = ball(100, 200);
        let most = 10_000;
        let coarse = fine.coarse(most).expect("the ball has enough triangles");
        assert!(coarse.triangles.len() <= most && coarse.triangles.len() > most / 4, "{}", coarse.triangles.len());
        assert_eq!(coarse.normals.len(), coarse.triangles.len());
        assert_eq!(coarse.pieces.len(), coarse.triangles.len());
        for triangle in &coarse.triangles {
            for v in triangle {
                let r = coarse.vertices[*v as usize].length();
                assert!((0.97..1.0 + 1e-9).contains(&r), "{r}");
            }
        }
        assert!(coarse.coarse(most).is_none());
    }
}
