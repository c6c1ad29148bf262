//! Thickness of the pieces of a body, and of the thinnest piece below each node of its hierarchy.
//!
//! The thickness of a piece is the least width along its faces' normals. If the true least width is
//! a distance between two edges, the thickness slightly exceeds this width. A flat piece has
//! thickness 0.

use super::Side;
use crate::body::{NodeKind, Polytope};

/// Thicknesses of one body's pieces and nodes, model units.
#[derive(Clone, Debug)]
pub(crate) struct Thickness {
    pieces: Vec<f32>,
    nodes: Vec<f32>,
    /// The least of all.
    least: f32,
}

impl Thickness {
    /// Computes the thickness of all pieces and nodes.
    pub(crate) fn of(side: Side<'_>) -> Self {
        let pieces: Vec<f32> = side.pieces.iter().map(|piece| thickness(piece) as f32).collect();
        let mut nodes = vec![f32::INFINITY; side.hierarchy.nodes().len()];
        // Visits an inner node twice: before its halves and after them.
        let mut stack = vec![(side.hierarchy.root(), false)];
        while let Some((node, known)) = stack.pop() {
            match side.hierarchy.node(node).kind {
                NodeKind::Leaf { piece } => nodes[node as usize] = pieces[piece as usize],
                NodeKind::Inner { left, right } if known => {
                    nodes[node as usize] = nodes[left as usize].min(nodes[right as usize]);
                }
                NodeKind::Inner { left, right } => stack.extend([(node, true), (left, false), (right, false)]),
            }
        }
        let least = pieces.iter().copied().fold(f32::INFINITY, f32::min);
        Self { pieces, nodes, least }
    }

    /// Returns the thickness of the thinnest piece of the body.
    pub(super) fn of_all(&self) -> f64 {
        f64::from(self.least)
    }

    /// Thickness of a piece.
    #[inline]
    pub(super) fn of_piece(&self, piece: u32) -> f64 {
        f64::from(self.pieces[piece as usize])
    }

    /// Thickness of the thinnest piece below a node.
    #[inline]
    pub(super) fn of_node(&self, node: u32) -> f32 {
        self.nodes[node as usize]
    }
}

fn thickness(piece: &Polytope) -> f64 {
    let width = |face: u32| {
        let plane = piece.plane(face);
        piece.vertices().iter().map(|&p| -plane.height(p)).fold(0.0, f64::max)
    };
    (0..piece.face_count() as u32).map(width).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::oracle::cuboid;
    use super::*;
    use crate::body::Hierarchy;

    #[test]
    fn a_node_is_as_thin_as_its_thinnest_piece() {
        let halves = [3.0, 1.0, 2.0, 5.0, 4.0];
        let pieces: Vec<Polytope> = halves.iter().map(|&half| cuboid(DVec3::new(half, 9.0, 7.0))).collect();
        let hierarchy = Hierarchy::build(&pieces, 1e-9).unwrap();
        let thickness = Thickness::of(Side { hierarchy: &hierarchy, pieces: &pieces });
        for (piece, half) in halves.iter().enumerate() {
            assert!((thickness.of_piece(piece as u32) - 2.0 * half).abs() < 1e-5);
        }
        assert_eq!(f64::from(thickness.of_node(hierarchy.root())), thickness.of_piece(1));
    }
}
