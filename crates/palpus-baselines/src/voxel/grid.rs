//! A block of voxels, and the mapping from points to voxels.

use glam::DVec3;
use palpus::body::Aabb;

use crate::BaselineError;

/// A block of equal cubes, numbered along x, then y, then z.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Corner of the block with the least coordinates, m.
    origin: DVec3,
    /// Edge length of a voxel, m.
    pub(super) size: f64,
    /// Number of voxels along each axis.
    counts: [i32; 3],
}

impl Grid {
    /// Makes a grid of voxels of `size` (m) around `bounds`, with `margin` additional layers on
    /// each side. Fails if the voxels, with `bytes` each, need more than `memory` bytes.
    ///
    /// The corner of `bounds` with the least coordinates lies at the centre of a voxel. So a flat
    /// side there belongs to one layer of voxels and not to two.
    pub(super) fn around(
        bounds: &Aabb,
        size: f64,
        margin: i32,
        bytes: usize,
        memory: usize,
    ) -> Result<Self, BaselineError> {
        let origin = bounds.min - DVec3::splat(size * (f64::from(margin) + 0.5));
        let counts = ((bounds.max - origin) / size).floor() + DVec3::splat(f64::from(margin) + 1.0);
        let needed = counts.x * counts.y * counts.z * bytes as f64;
        // With at most half as many voxels as u32 has values, no voxel's number equals the mark for
        // "no voxel", and counts fit into i32.
        if needed <= memory as f64 && needed < f64::from(u32::MAX / 2) * bytes as f64 {
            Ok(Self { origin, size, counts: whole(counts) })
        } else {
            Err(BaselineError::TooLarge { voxel: size, megabytes: needed * 1e-6, allowed: memory as f64 * 1e-6 })
        }
    }

    pub(super) fn len(&self) -> usize {
        self.counts.iter().map(|&count| count as usize).product()
    }

    /// Returns the voxel with these indices; `None` outside of the block.
    fn at(&self, [x, y, z]: [i32; 3]) -> Option<usize> {
        let [row, column, layers] = self.counts;
        let inside = (0..row).contains(&x) && (0..column).contains(&y) && (0..layers).contains(&z);
        inside.then(|| (z as usize * column as usize + y as usize) * row as usize + x as usize)
    }

    fn place(&self, voxel: usize) -> [i32; 3] {
        let (row, column) = (self.counts[0] as usize, self.counts[1] as usize);
        [(voxel % row) as i32, (voxel / row % column) as i32, (voxel / row / column) as i32]
    }

    /// Returns the voxel that contains a point; `None` outside of the block.
    pub(super) fn holding(&self, p: DVec3) -> Option<usize> {
        self.at(whole((p - self.origin) / self.size))
    }

    pub(super) fn center(&self, voxel: usize) -> DVec3 {
        self.origin + (DVec3::from_array(self.place(voxel).map(f64::from)) + DVec3::splat(0.5)) * self.size
    }

    /// Returns the voxels that share a face with `voxel`: six inside the block, fewer at its sides.
    pub(super) fn beside(&self, voxel: usize) -> impl Iterator<Item = usize> + '_ {
        let [x, y, z] = self.place(voxel);
        let places = [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]];
        places.into_iter().filter_map(|place| self.at(place))
    }

    /// Returns the voxels that share a corner with `voxel`: 26 inside the block, fewer at its
    /// sides.
    pub(super) fn around_voxel(&self, voxel: usize) -> impl Iterator<Item = usize> + '_ {
        let [x, y, z] = self.place(voxel);
        let places = (0..27).filter(|&k| k != 13).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        places.filter_map(|place| self.at(place))
    }

    /// Calls `visit` for each voxel that a triangle meets.
    pub(super) fn visit_met(&self, corners: &[DVec3; 3], mut visit: impl FnMut(usize)) {
        let bounds = Aabb::around(*corners);
        // One more voxel on each side, since the triangle may lie on the face between two voxels.
        let low = whole((bounds.min - self.origin) / self.size).map(|k| k - 1);
        let high = whole((bounds.max - self.origin) / self.size).map(|k| k + 1);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if let Some(voxel) = self.at([x, y, z])
                        && meets(corners, self.center(voxel), self.size / 2.0)
                    {
                        visit(voxel);
                    }
                }
            }
        }
    }
}

/// Rounds down to integers; saturates out of range.
fn whole(v: DVec3) -> [i32; 3] {
    v.floor().to_array().map(|k| k as i32)
}

/// Returns true if a triangle meets a cube. The test uses 13 separating axes (Akenine-Möller, *Fast
/// 3D Triangle–Box Overlap Testing*, 2001).
fn meets(corners: &[DVec3; 3], center: DVec3, half: f64) -> bool {
    let [p, q, r] = corners.map(|corner| corner - center);
    let sides = [q - p, r - q, p - r];
    let apart_along = |axis: DVec3| {
        let [x, y, z] = [p, q, r].map(|corner| corner.dot(axis));
        let reach = half * axis.abs().element_sum();
        x.min(y).min(z) > reach || x.max(y).max(z) < -reach
    };
    !(DVec3::AXES.into_iter().any(apart_along)
        || apart_along(sides[0].cross(sides[1]))
        || sides.iter().any(|side| DVec3::AXES.into_iter().any(|axis| apart_along(axis.cross(*side)))))
}

#[cfg(test)]
mod tests {
    use palpus::algebra::closest_on_triangle;

    use super::*;
    use palpus::algebra::Random;

    const SEED: u64 = 0x6A1D;

    #[test]
    fn triangle_meets_the_voxels_of_its_points() {
        let mut random = Random::new(SEED);
        let bounds = Aabb { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
        let grid = Grid::around(&bounds, 0.25, 1, 1, 1 << 20).expect("the grid is small enough");
        for round in 0..60 {
            let corners = [(); 3].map(|()| random.vector());
            let mut met = vec![false; grid.len()];
            grid.visit_met(&corners, |voxel| met[voxel] = true);
            let [p, q, r] = corners;
            // The voxels of points on the triangle must be met.
            for _ in 0..200 {
                let [u, v] = [random.vector(), random.vector()].map(|w| w.x.abs());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let inside = p + (q - p) * u + (r - p) * v;
                assert!(
                    met[grid.holding(inside).expect("the point lies in the grid")],
                    "seed {SEED:#x}, round {round}"
                );
            }
            // The triangle does not meet a voxel if it misses the voxel's circumscribed sphere. It
            // meets the voxel if it touches the voxel's inscribed sphere.
            for (voxel, &met) in met.iter().enumerate() {
                let center = grid.center(voxel);
                let distance = closest_on_triangle(center, p, q, r).distance(center);
                assert!(!met || distance <= 0.125 * 3f64.sqrt() + 1e-12, "seed {SEED:#x}, round {round}");
                assert!(met || distance >= 0.125 - 1e-12, "seed {SEED:#x}, round {round}");
            }
        }
    }

    #[test]
    fn voxel_contains_its_own_centre() {
        let bounds = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(1.0, 0.5, 2.1) };
        let grid = Grid::around(&bounds, 0.1, 2, 5, 1 << 20).expect("the grid is small enough");
        assert!((0..grid.len()).all(|voxel| grid.holding(grid.center(voxel)) == Some(voxel)));
        assert!((0..grid.len()).all(|voxel| grid.around_voxel(voxel).all(|other| {
            let steps = (grid.center(other) - grid.center(voxel)).abs() / 0.1;
            other != voxel && steps.max_element() < 1.5
        })));
        let corners = [bounds.min, bounds.max];
        assert!(
            corners
                .into_iter()
                .all(|p| grid.around_voxel(grid.holding(p).expect("the corner lies in the grid")).count() == 26)
        );
        assert_eq!(grid.holding(DVec3::splat(1e300)), None);
    }
}
