//! Slabs about convex sets: how far they reach along thirteen axes, both ways.
//!
//! The Minkowski difference of two sets reaches exactly as far as the two together, so the least of
//! what is left along these axes bounds the depth of a translation in an obstacle from above. That
//! sorts out most obstacles, and tells which are promising: a cube's axes and the diagonals of its
//! sides and of its inside rank them far better than fewer do.
//!
//! Slabs only choose what is looked at first, so they are kept in single precision.

use glam::DVec3;

/// Number of axes, and as many lanes as hold them.
const AXES: usize = 13;
const LANES: usize = 16;

/// 1/√2 and 1/√3: the diagonals are unit, as are the axes of the frame.
const SIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;
const INSIDE: f64 = 0.577_350_269_189_625_8;

/// Coordinates of `p` along the axes.
fn along(p: DVec3) -> [f64; AXES] {
    let (s, d) = (p * SIDE, p * INSIDE);
    [
        p.x,
        p.y,
        p.z,
        d.x + d.y + d.z,
        d.x + d.y - d.z,
        d.x - d.y + d.z,
        d.y + d.z - d.x,
        s.x + s.y,
        s.x - s.y,
        s.y + s.z,
        s.y - s.z,
        s.z + s.x,
        s.z - s.x,
    ]
}

/// The extent of a set of points along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    low: [f32; LANES],
    high: [f32; LANES],
}

impl Slabs {
    /// The least slabs around `points`.
    pub(super) fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; AXES], [f64::NEG_INFINITY; AXES]);
        for p in points {
            for ((low, high), at) in low.iter_mut().zip(&mut high).zip(along(p)) {
                *low = low.min(at);
                *high = high.max(at);
            }
        }
        // Lanes without an axis repeat the first.
        let lane = |of: &[f64; AXES]| std::array::from_fn(|k| of[if k < AXES { k } else { 0 }] as f32);
        Self { low: lane(&low), high: lane(&high) }
    }

    /// The corners of the box along the frame's axes.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let corner = |at: &[f32; LANES]| DVec3::new(f64::from(at[0]), f64::from(at[1]), f64::from(at[2]));
        (corner(&self.low), corner(&self.high))
    }

    /// How deep `points` lie at most in the obstacle of a moving set and a fixed one with these
    /// slabs: an upper bound, which is not positive only if one of them lies outside.
    pub(super) fn depth(moving: &Self, fixed: &Self, points: &Self) -> f64 {
        let mut least = [f32::INFINITY; LANES];
        for k in 0..LANES {
            let above = fixed.high[k] - moving.low[k] - points.high[k];
            let below = points.low[k] - (fixed.low[k] - moving.high[k]);
            let both = if above < below { above } else { below };
            least[k] = if both < least[k] { both } else { least[k] };
        }
        f64::from(least.into_iter().fold(f32::INFINITY, |least, x| if x < least { x } else { least }))
    }

    /// False only if no translation of `points`' hull may lie in the obstacle.
    pub(super) fn may_meet(moving: &Self, fixed: &Self, points: &Self) -> bool {
        let mut meets = true;
        for k in 0..LANES {
            meets &= fixed.high[k] - moving.low[k] > points.low[k];
            meets &= fixed.low[k] - moving.high[k] < points.high[k];
        }
        meets
    }
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
    /// Second child; the first follows its parent. 0 for a leaf.
    second: u32,
    /// Number of a leaf's box.
    item: u32,
}

impl BoxTree {
    /// The tree over `boxes`, numbered in their order.
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

    /// Calls `visit` with the number of each box that overlaps the one from `low` to `high`.
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
