//! The ranks of pairs, by which a sample is spread evenly over two surfaces: step 1 of [`super`].

use std::sync::Arc;

use glam::DVec3;

use crate::algebra::spread;
use crate::body::{Body, NodeKind};

/// The ranks of all pairs.
#[derive(Clone, Debug)]
pub(super) struct Ranks {
    /// For each piece of a and of b, its part of the rank of a pair.
    parts: [Arc<[f32]>; 2],
}

impl Ranks {
    pub(super) fn new(a: &Body, b: &Body) -> Self {
        let reversed = |place: u32| f64::from(place.reverse_bits()) / 2f64.powi(32);
        let parts = match a.size() <= b.size() {
            true => [by_place(a, reversed), by_place(b, spread)],
            false => [by_place(a, spread), by_place(b, reversed)],
        };
        Self { parts }
    }

    /// Returns the rank of a pair of pieces, 0 to 1.
    pub(super) fn of(&self, [piece_a, piece_b]: [u32; 2]) -> f64 {
        let [of_a, of_b] = &self.parts;
        (f64::from(of_a[piece_a as usize]) + f64::from(of_b[piece_b as usize])).fract()
    }
}

/// Returns `value` of each piece's place in the order of step 1 of [`super`].
fn by_place(body: &Body, value: impl Fn(u32) -> f64) -> Arc<[f32]> {
    let hierarchy = body.hierarchy();
    let mut order = Vec::with_capacity(body.polytopes().len());
    let mut stack = vec![hierarchy.root()];
    while let Some(node) = stack.pop() {
        match hierarchy.node(node).kind {
            NodeKind::Leaf { piece } => order.push(piece),
            NodeKind::Inner { left, right } => stack.extend([right, left]),
        }
    }
    order.sort_by_key(|&piece| side(body.admissible_normals(piece).cap().axis));
    let mut values = vec![0.0; order.len()];
    for (place, piece) in order.into_iter().enumerate() {
        values[piece as usize] = value(place as u32) as f32;
    }
    values.into()
}

/// Returns the side of a cube, 0 to 5, to which a direction points.
fn side(direction: DVec3) -> usize {
    let axis = direction.abs().max_position();
    2 * axis + usize::from(direction[axis] < 0.0)
}
