//! Counts pairs of triangles of one mesh that cross, overlap or touch.

use std::ops::ControlFlow;

use crate::algebra::tolerance;
use crate::body::{Mesh, TrianglePair, TriangleTree};

/// Counts of triangle pairs with common points outside a shared vertex or edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelfIntersections {
    /// Number of pairs of triangles whose interiors cross.
    pub crossing_pairs: usize,
    /// Number of pairs of coplanar triangles that overlap.
    pub overlapping_pairs: usize,
    /// Number of pairs that touch outside a shared vertex or edge, but do not cross. Examples are
    /// T-junctions, and two parts that lie against each other.
    pub touching_pairs: usize,
    /// Number of triangles that cross or overlap another triangle.
    pub triangles: usize,
    /// True if all pairs were tested. If false, the counts are lower bounds.
    pub complete: bool,
}

impl SelfIntersections {
    /// Tests all pairs of triangles whose boxes overlap. The number of tests is at most
    /// [`tolerance::SELF_PAIRS`] times the number of triangles.
    pub fn count(mesh: &Mesh, tree: &TriangleTree) -> Self {
        let mut answer = Self { complete: true, ..Self::default() };
        let mut involved = vec![false; mesh.triangles().len()];
        let mut left = tolerance::SELF_PAIRS.saturating_mul(mesh.triangles().len());
        let _ = tree.visit_own_pairs(|(first, first_corners), (second, second_corners)| {
            if left == 0 {
                answer.complete = false;
                return ControlFlow::Break(());
            }
            left -= 1;
            match TrianglePair::new(*first_corners, *second_corners) {
                TrianglePair::Apart => return ControlFlow::Continue(()),
                TrianglePair::Touching => {
                    answer.touching_pairs += 1;
                    return ControlFlow::Continue(());
                }
                TrianglePair::Crossing => answer.crossing_pairs += 1,
                TrianglePair::CoplanarOverlap => answer.overlapping_pairs += 1,
            }
            (involved[first as usize], involved[second as usize]) = (true, true);
            ControlFlow::Continue(())
        });
        answer.triangles = involved.iter().filter(|&&involved| involved).count();
        answer
    }

    /// Returns true if there is a crossing or an overlap.
    pub fn any(&self) -> bool {
        self.crossing_pairs + self.overlapping_pairs > 0
    }
}
