//! The ground below a scene: a plane with a grid, and the soft shadow of the bodies on it.
//!
//! The ground is only drawn; bodies do not touch it. The shadow is like the shadow below a large
//! lamp overhead:
//!
//! 1. Each triangle is projected straight down into a map of the ground. A cell keeps the strongest
//!    shade of all triangles. The shade becomes weaker with the height of the triangle.
//! 2. The map is blurred, so that edges are soft.

use glam::{DVec2, DVec3};
use palpus::algebra::Pose;

use crate::paint::round_length;
use crate::scene::{Scene, Unit};
use crate::solid::Solid;

/// Width of a cell of the grid, relative to the scene's size.
const CELL: f64 = 0.11;
/// Reach of the lines of the grid, relative to the scene's size.
const REACH: f64 = 1.25;
/// Reach of the shadow, relative to the scene's size.
const SHADOW_REACH: f64 = 0.85;
/// Distance of the ground below the lowest point, relative to the scene's size.
const BELOW: f64 = 0.015;
/// Height at which the shade is weaker by a factor of e, relative to the scene's size.
const FADE: f64 = 0.45;
/// Number of cells along each side of the shadow's map, and radius of the blur in cells.
const SIDE: usize = 72;
const BLUR: usize = 2;

/// The ground of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ground {
    /// The point of the plane below the middle of the scene, world.
    pub(crate) middle: DVec3,
    /// Side of a grid cell, m.
    pub(crate) cell: f64,
    /// Distance from the middle at which grid lines have faded away, m.
    pub(crate) reach: f64,
    /// Diagonal of the scene's box, m.
    size: f64,
}

impl Ground {
    /// Returns the ground below `scene`; `None` if the scene is empty.
    pub(crate) fn below(scene: &Scene) -> Option<Self> {
        Self::below_points(scene.corners(), scene.unit)
    }

    fn below_points(points: impl Iterator<Item = DVec3>, unit: Unit) -> Option<Self> {
        let (low, high) = points.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
        let size = (high - low).length();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let (cell, _) = round_length(CELL * size, unit);
        let middle = (0.5 * (low + high)).with_z(low.z - BELOW * size);
        Some(Self { middle, cell, reach: REACH * size, size })
    }

    /// True if `eye` (world) sees the upper side of the plane.
    pub(crate) fn is_seen_from(&self, eye: DVec3) -> bool {
        eye.z > self.middle.z
    }

    /// Returns the strength of grid lines at `point` of the plane: 1 in the middle, 0 outside.
    pub(crate) fn strength(&self, point: DVec3) -> f64 {
        let part = 1.0 - (point - self.middle).truncate().length() / self.reach;
        part.clamp(0.0, 1.0)
    }

    /// Returns the lines of the grid: both ends of each (world), and whether it goes through the
    /// middle.
    #[cfg(feature = "gui")]
    pub(crate) fn lines(&self) -> impl Iterator<Item = ([DVec3; 2], bool)> {
        let count = (self.reach / self.cell) as i32;
        let Self { middle, cell, reach, .. } = *self;
        (-count..=count).flat_map(move |k| {
            let across = f64::from(k) * cell;
            let half = (reach * reach - across * across).max(0.0).sqrt();
            let along_x = [DVec3::new(-half, across, 0.0), DVec3::new(half, across, 0.0)];
            let along_y = [DVec3::new(across, -half, 0.0), DVec3::new(across, half, 0.0)];
            [along_x, along_y].map(|ends| (ends.map(|end| middle + end), k == 0))
        })
    }

    /// Returns the shadow of bodies, each given by its triangles and its pose in the world.
    pub(crate) fn shadow<'a>(&self, bodies: impl Iterator<Item = (&'a Solid, Pose)>) -> Shadow {
        let half = SHADOW_REACH * self.size;
        let mut shadow = Shadow {
            low: self.middle - DVec3::new(half, half, 0.0),
            cell: 2.0 * half / SIDE as f64,
            shades: vec![0.0; SIDE * SIDE],
        };
        let fade = shadow.cell / (FADE * self.size);
        for (solid, pose) in bodies {
            let in_cells = |v: &DVec3| (pose.point(*v) - shadow.low) / shadow.cell;
            let points: Vec<DVec3> = solid.vertices.iter().map(in_cells).collect();
            for triangle in &solid.triangles {
                shadow.shade(triangle.map(|v| points[v as usize]), fade);
            }
        }
        for _ in 0..2 {
            shadow.blur();
        }
        shadow
    }
}

/// A map of the shade on the ground.
#[derive(Clone, Debug)]
pub(crate) struct Shadow {
    /// Corner of the map, world.
    low: DVec3,
    /// Side of a cell, m.
    cell: f64,
    /// Row by row along y; 0 is no shadow, 1 the darkest.
    shades: Vec<f64>,
}

impl Shadow {
    /// Adds the shade of a triangle (step 1). `points` are in cells, `fade` is per cell of height.
    fn shade(&mut self, points: [DVec3; 3], fade: f64) {
        let low = points[0].min(points[1]).min(points[2]).floor().max(DVec3::ZERO);
        let high = points[0].max(points[1]).max(points[2]).floor().min(DVec3::splat(SIDE as f64 - 1.0));
        let height = (points[0].z + points[1].z + points[2].z) / 3.0;
        let shade = (-fade * height.max(0.0)).exp();
        let flat = points.map(|p| p.truncate());
        let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
        for row in low.y as usize..(high.y + 1.0).max(0.0) as usize {
            for column in low.x as usize..(high.x + 1.0).max(0.0) as usize {
                let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let side = |i: usize, j: usize| (flat[j] - flat[i]).perp_dot(at - flat[i]) * area;
                // A triangle that is smaller than a cell shades the whole cell.
                let is_small = area.abs() < 1.0;
                if is_small || (side(0, 1) >= 0.0 && side(1, 2) >= 0.0 && side(2, 0) >= 0.0) {
                    let cell = &mut self.shades[row * SIDE + column];
                    *cell = cell.max(shade);
                }
            }
        }
    }

    /// Blurs the map once: each cell gets the mean over a square around it (step 2 does this
    /// twice).
    fn blur(&mut self) {
        for (stride, between) in [(1, SIDE), (SIDE, 1)] {
            let before = self.shades.clone();
            for line in 0..SIDE {
                let first = line * between;
                for k in 0..SIDE {
                    let near = k.saturating_sub(BLUR)..(k + BLUR + 1).min(SIDE);
                    let sum: f64 = near.map(|j| before[first + j * stride]).sum();
                    self.shades[first + k * stride] = sum / (2 * BLUR + 1) as f64;
                }
            }
        }
    }

    /// Returns the map's vertices (position in the world, shade), row by row, and the number of
    /// vertices in a row.
    #[cfg(feature = "gui")]
    pub(crate) fn vertices(&self) -> (impl Iterator<Item = (DVec3, f64)> + '_, usize) {
        let place = |k: usize| self.low + self.cell * DVec3::new((k % SIDE) as f64 + 0.5, (k / SIDE) as f64 + 0.5, 0.0);
        (self.shades.iter().enumerate().map(move |(k, shade)| (place(k), *shade)), SIDE)
    }

    /// Returns the shade at a point of the plane (world), interpolated between cells; 0 outside of
    /// the map.
    pub(crate) fn at(&self, point: DVec3) -> f64 {
        let place = (point - self.low) / self.cell - 0.5;
        let (column, row) = (place.x.floor(), place.y.floor());
        let last = SIDE as f64 - 1.0;
        if !(column >= 0.0 && row >= 0.0 && column < last && row < last) {
            return 0.0;
        }
        let (x, y) = (place.x - column, place.y - row);
        let first = row as usize * SIDE + column as usize;
        let mix = |k: usize| self.shades[k] * (1.0 - x) + self.shades[k + 1] * x;
        mix(first) * (1.0 - y) + mix(first + SIDE) * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus::body::Body;

    fn cube() -> Solid {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64 - 0.5;
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
        Solid::of_body(&Body::from_convex(&points).expect("the box has a hull"))
    }

    #[test]
    fn shadow_is_below_the_body_and_fades_with_height() {
        let corners = [DVec3::splat(-0.5), DVec3::splat(0.5)];
        let ground = Ground::below_points(corners.into_iter(), Unit::Metre).expect("the points have a box");
        assert!(ground.middle.z < -0.5 && ground.is_seen_from(DVec3::Z) && !ground.is_seen_from(-DVec3::Z));
        let cube = cube();
        let at_height = |z: f64| {
            let pose = Pose::from_translation(DVec3::new(0.0, 0.0, z));
            ground.shadow([(&cube, pose)].into_iter())
        };
        let (near, far) = (at_height(0.0), at_height(2.0));
        assert!(near.at(ground.middle) > 0.5 && far.at(ground.middle) < 0.7 * near.at(ground.middle));
        // The shadow is soft: half as dark at the edge, and zero at a body's width.
        let edge = near.at(ground.middle + 0.5 * DVec3::X) / near.at(ground.middle);
        assert!((0.3..0.8).contains(&edge), "{edge}");
        assert!(near.at(ground.middle + DVec3::X) < 1e-9 && near.at(ground.middle + 100.0 * DVec3::X) == 0.0);
    }

    #[cfg(feature = "gui")]
    #[test]
    fn grid_lines_stay_within_reach_and_fade() {
        let corners = [DVec3::ZERO, DVec3::splat(0.1)];
        let ground = Ground::below_points(corners.into_iter(), Unit::Metre).expect("the points have a box");
        assert_eq!(ground.cell, 0.01, "the cell must be a round length");
        for (ends, _) in ground.lines() {
            assert!(ends.iter().all(|end| ground.strength(*end) < 1e-9));
        }
        assert_eq!(ground.strength(ground.middle), 1.0);
    }
}
