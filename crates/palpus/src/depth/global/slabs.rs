//! Slabs around convex sets: the least and the greatest coordinate of a set along many axes.
//!
//! Along an axis, the extent of a Minkowski difference is the sum of the extents of both sets. A
//! translation has a distance to both ends of this extent. The least distance over all axes is an
//! upper bound of the depth of the translation in an obstacle. This bound rejects most obstacles
//! and ranks the others. With only the seven axes through the faces and corners of a cube, the best
//! obstacle was rarely among the first twelve. With the axes used here, the best obstacle usually
//! is among the first twelve.
//!
//! Slabs only reject and rank obstacles, so they are stored in single precision.

use glam::{DVec3, Vec3};

/// Directions of the axes, not of unit length. The directions are along the edges of a cube, to its
/// corners, to the middles of its edges, and between these directions. The last axes repeat the
/// first axes, to fill the last block.
#[rustfmt::skip]
const AXES: [[i8; 3]; LANES] = [
    [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -1, -1], [1, -1, 1], [1, 1, -1], [1, 1, 1], [0, 1, -1],
    [0, 1, 1], [1, -1, 0], [1, 0, -1], [1, 0, 1], [1, 1, 0], [0, 1, -2], [0, 1, 2], [0, 2, -1],
    [0, 2, 1], [1, -2, 0], [1, 0, -2], [1, 0, 2], [1, 2, 0], [2, -1, 0], [2, 0, -1], [2, 0, 1],
    [2, 1, 0], [1, -2, -1], [1, -2, 1], [1, -1, -2], [1, -1, 2], [1, 1, -2], [1, 1, 2], [1, 2, -1],
    [1, 2, 1], [2, -1, -1], [2, -1, 1], [2, 1, -1], [2, 1, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0],
];

const LANES: usize = 40;

/// Number of axes that are compared at once.
const BLOCK: usize = 8;

/// The axes as unit vectors, with one array per coordinate.
const UNIT: [[f32; LANES]; 3] = {
    let mut unit = [[0.0; LANES]; 3];
    let mut k = 0;
    while k < LANES {
        let [x, y, z] = AXES[k];
        // The reciprocal of the axis's length.
        let scale = match x * x + y * y + z * z {
            1 => 1.0,
            2 => std::f32::consts::FRAC_1_SQRT_2,
            3 => 0.577_350_26,
            5 => 0.447_213_6,
            _ => 0.408_248_28,
        };
        unit[0][k] = x as f32 * scale;
        unit[1][k] = y as f32 * scale;
        unit[2][k] = z as f32 * scale;
        k += 1;
    }
    unit
};

/// The extent of a set of points along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    low: [f32; LANES],
    high: [f32; LANES],
}

impl Slabs {
    /// Returns the smallest slabs around `points`.
    pub(super) fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut slabs = Self { low: [f32::INFINITY; LANES], high: [f32::NEG_INFINITY; LANES] };
        for p in points {
            let Vec3 { x, y, z } = p.as_vec3();
            let [ux, uy, uz] = &UNIT;
            let reach = slabs.low.iter_mut().zip(&mut slabs.high);
            for ((((low, high), ux), uy), uz) in reach.zip(ux).zip(uy).zip(uz) {
                let at = ux * x + uy * y + uz * z;
                *low = lesser(at, *low);
                *high = -lesser(-at, -*high);
            }
        }
        slabs
    }

    /// Returns the lowest and the highest corner of the box along the axes of the frame.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let corner = |at: &[f32; LANES]| Vec3::new(at[0], at[1], at[2]).as_dvec3();
        (corner(&self.low), corner(&self.high))
    }

    /// Returns an upper bound of the depth of `points` in the obstacle of a moving and a fixed set.
    /// If the bound is not positive, at least one point lies outside.
    pub(super) fn depth(moving: &Self, fixed: &Self, points: &Self) -> f64 {
        let mut least = f32::INFINITY;
        for block in 0..LANES / BLOCK {
            let mut lanes = [0.0_f32; BLOCK];
            for (lane, k) in lanes.iter_mut().zip(block * BLOCK..) {
                let above = fixed.high[k] - moving.low[k] - points.high[k];
                let below = points.low[k] - (fixed.low[k] - moving.high[k]);
                *lane = lesser(above, below);
            }
            least = lanes.into_iter().fold(least, lesser);
            if least <= 0.0 {
                break;
            }
        }
        f64::from(least)
    }

    /// Returns false only if no translation in the hull of `points` lies in the obstacle.
    pub(super) fn may_meet(moving: &Self, fixed: &Self, points: &Self) -> bool {
        (0..LANES / BLOCK).all(|block| {
            let mut meets = true;
            for k in block * BLOCK..(block + 1) * BLOCK {
                meets &= fixed.high[k] - moving.low[k] > points.low[k];
                meets &= fixed.low[k] - moving.high[k] < points.high[k];
            }
            meets
        })
    }
}

/// Returns the smaller value. This function is faster than `min`, because it does not handle NaN.
fn lesser(p: f32, q: f32) -> f32 {
    if p < q { p } else { q }
}

/// Boxes in a binary tree, in flat arrays.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxTree {
    nodes: Vec<BoxNode>,
}

#[derive(Clone, Copy, Debug)]
struct BoxNode {
    low: DVec3,
    high: DVec3,
    /// Index of the second child. The first child follows its parent. 0 for a leaf.
    second: u32,
    /// Number of the box of a leaf.
    item: u32,
}

impl BoxTree {
    /// Returns the tree over `boxes`. The number of a box is its index.
    pub(super) fn new(boxes: &[(DVec3, DVec3)]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        if !items.is_empty() {
            tree.grow(boxes, &mut items);
        }
        tree
    }

    fn grow(&mut self, boxes: &[(DVec3, DVec3)], items: &mut [u32]) {
        let around = |items: &[u32]| {
            items.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &k| {
                let (l, h) = boxes[k as usize];
                (low.min(l), high.max(h))
            })
        };
        let (low, high) = around(items);
        let index = self.nodes.len();
        self.nodes.push(BoxNode { low, high, second: 0, item: items[0] });
        if items.len() == 1 {
            return;
        }
        let axis = (high - low).max_position();
        let middle = |k: u32| boxes[k as usize].0[axis] + boxes[k as usize].1[axis];
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |&p, &q| middle(p).total_cmp(&middle(q)).then(p.cmp(&q)));
        let (first, second) = items.split_at_mut(half);
        self.grow(boxes, first);
        self.nodes[index].second = self.nodes.len() as u32;
        self.grow(boxes, second);
    }

    /// Calls `visit` with the number of each box that overlaps the box from `low` to `high`.
    pub(super) fn visit(&self, low: DVec3, high: DVec3, visit: &mut dyn FnMut(u32)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0_u32; 64];
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let index = stack[len];
            let node = &self.nodes[index as usize];
            if !(node.low.cmple(high).all() && low.cmple(node.high).all()) {
                continue;
            }
            if node.second == 0 {
                visit(node.item);
            } else {
                stack[len] = node.second;
                stack[len + 1] = index + 1;
                len += 2;
            }
        }
    }
}
