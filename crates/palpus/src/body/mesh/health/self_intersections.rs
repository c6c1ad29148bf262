//! The pairs of a mesh's own triangles that cross, overlap or touch.

use std::ops::ControlFlow;

use crate::algebra::tolerance;
use crate::body::{Mesh, TrianglePair, TriangleTree};

/// Pairs of triangles that have more in common than a mesh's neighbours may.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelfIntersections {
    /// Pairs whose interiors cross.
    pub crossing_pairs: usize,
    /// Pairs that lie in one plane and overlap there.
    pub overlapping_pairs: usize,
    /// Pairs that touch beyond what they share, without crossing: a T-junction, or parts laid
    /// against each other.
    pub touching_pairs: usize,
    /// Triangles that take part in a crossing or an overlap.
    pub triangles: usize,
    /// All pairs were tested; if not, the counts are lower bounds.
    pub complete: bool,
}

impl SelfIntersections {
    /// Tests the mesh's own pairs of triangles, up to [`tolerance::SELF_PAIRS`] times as many as
    /// there are triangles.
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

    /// Any crossing or overlap?
    pub fn any(&self) -> bool {
        self.crossing_pairs + self.overlapping_pairs > 0
    }
}
