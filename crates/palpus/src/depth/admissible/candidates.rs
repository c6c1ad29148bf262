//! The candidates of a pair: the facets that can be the result after a small motion.
//!
//! If the bodies move by at most m relative to each other, the depth along each normal changes by
//! at most m. So a facet that was deeper than the result by more than a margin is not tested again
//! until the motion has used up the margin. Results do not depend on the stored candidates.

use crate::algebra::Placement;
use crate::algebra::tolerance::{CANDIDATE_MARGIN, CANDIDATE_TURN};

use super::super::cso::Cso;

/// Room for numbers of planes and arcs. A pair that needs more stores no candidates.
const ROOM: usize = 60;

/// Kinds of candidates, in the order of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    FaceOfB,
    FaceOfA,
    BorrowedByB,
    BorrowedByA,
    /// An arc of a and an arc of b that cross, or may cross after a small turn.
    Crossing,
}

const KINDS: usize = 5;

/// The candidates of one pair of pieces.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    /// The pose at which the candidates were found.
    pose_ba: Placement,
    /// All other facets were at least this deep at that pose. Minus infinity if no candidates are
    /// stored.
    others: f64,
    /// The end of each kind in `indices`.
    ends: [u8; KINDS],
    /// Numbers of planes, and pairs of places of arcs (of a, of b).
    indices: [u16; ROOM],
}

impl Candidates {
    pub(super) const NONE: Self =
        Self { pose_ba: Placement::IDENTITY, others: f64::NEG_INFINITY, ends: [0; KINDS], indices: [0; ROOM] };

    /// Returns the margin for a search in which candidates are found.
    pub(super) fn margin(cso: &Cso<'_>) -> f64 {
        CANDIDATE_MARGIN * cso.a.radius().min(cso.b.radius())
    }

    /// Returns a lower bound of the depths of all facets that are not candidates. Minus infinity if
    /// nothing is known.
    pub(super) fn others(&self, cso: &Cso<'_>) -> f64 {
        if self.others == f64::NEG_INFINITY {
            return self.others;
        }
        let (now, then) = (cso.pose_ba, &self.pose_ba);
        let change = now.rotation - then.rotation;
        let squares = [change.x_axis, change.y_axis, change.z_axis].map(|axis| axis.length_squared());
        // A vector turns by at most this share of its length: the square root of half the sum.
        let turn = (0.5 * squares.iter().sum::<f64>()).sqrt();
        if turn > CANDIDATE_TURN {
            return f64::NEG_INFINITY;
        }
        let (a, b) = (cso.a.centroid(), cso.b.centroid());
        let motion_a = now.point(a).distance(then.point(a)) + turn * cso.a.radius();
        let motion_b = now.inverse_point(b).distance(then.inverse_point(b)) + turn * cso.b.radius();
        self.others - motion_a.max(motion_b)
    }

    #[cfg(test)]
    pub(super) fn pose_ba(&self) -> Placement {
        self.pose_ba
    }

    pub(super) fn clear(&mut self) {
        self.others = f64::NEG_INFINITY;
    }

    /// Begins a search for candidates.
    pub(super) fn begin(&mut self) {
        self.ends = [0; KINDS];
    }

    /// Adds the numbers of a candidate. Kinds are added in their order.
    pub(super) fn add(&mut self, kind: Kind, numbers: &[usize]) {
        for &number in numbers {
            let end = usize::from(self.ends[KINDS - 1]);
            match (self.indices.get_mut(end), u16::try_from(number)) {
                (Some(place), Ok(number)) => {
                    *place = number;
                    self.ends[kind as usize..].fill(end as u8 + 1);
                }
                // There is no room: the last end shows it.
                _ => self.ends[KINDS - 1] = u8::MAX,
            }
        }
    }

    /// Ends a search at the pose `pose_ba`. All other facets are at least `others` deep.
    pub(super) fn end(&mut self, pose_ba: &Placement, others: f64) {
        let is_complete = usize::from(self.ends[KINDS - 1]) <= ROOM;
        (self.pose_ba, self.others) = (*pose_ba, if is_complete { others } else { f64::NEG_INFINITY });
    }

    /// Returns the numbers of the planes of one kind.
    pub(super) fn planes(&self, kind: Kind) -> impl Iterator<Item = u32> {
        self.of(kind).iter().map(|&index| u32::from(index))
    }

    /// Returns the places of the arcs (of a, of b) that may cross.
    pub(super) fn crossings(&self) -> impl Iterator<Item = [usize; 2]> {
        self.of(Kind::Crossing).as_chunks().0.iter().map(|pair| pair.map(usize::from))
    }

    fn of(&self, kind: Kind) -> &[u16] {
        let kind = kind as usize;
        let begin = if kind == 0 { 0 } else { self.ends[kind - 1] };
        &self.indices[usize::from(begin)..usize::from(self.ends[kind])]
    }
}
