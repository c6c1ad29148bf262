//! The candidates of a pair: the facets that can be the result after a small motion.
//!
//! If the bodies move by at most m relative to each other, the depth along each normal changes by
//! at most m. So a facet that was deeper than the result by more than a margin is not tested again
//! until the motion has used up the margin. Results do not depend on the stored candidates.

use super::super::cso::Cso;
use crate::algebra::Placement;
use crate::algebra::tolerance::{CANDIDATE_LEAST, CANDIDATE_PATH, CANDIDATE_SEARCHES, CANDIDATE_TURN};

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

/// A relative motion of two pieces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// No point of one piece moves farther relative to the other piece, model units.
    pub(super) path: f64,
    /// No unit vector changes by more than this.
    pub(super) turn: f64,
}

impl Motion {
    pub(super) const NONE: Self = Self { path: 0.0, turn: 0.0 };
}

/// The candidates of one pair of pieces.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    /// The pose at which the candidates were found.
    pose_ba: Placement,
    /// All other facets were at least this deep at that pose. Minus infinity if no candidates are
    /// stored.
    others: f64,
    /// No unit vector may change by more than this since that pose.
    turn: f64,
    /// Number of searches in which only the candidates were tried.
    searches: u32,
    /// Number of searches for which the next candidates should stay valid.
    ahead: f64,
    /// The end of each kind in `indices`.
    ends: [u8; KINDS],
    /// Numbers of planes, and pairs of places of arcs (of a, of b).
    indices: [u16; ROOM],
}

impl Candidates {
    pub(super) const NONE: Self = Self {
        pose_ba: Placement::IDENTITY,
        others: f64::NEG_INFINITY,
        turn: 0.0,
        searches: 0,
        ahead: CANDIDATE_SEARCHES,
        ends: [0; KINDS],
        indices: [0; ROOM],
    };

    /// Returns the motion to the pose of `cso` since the candidates were found.
    pub(super) fn motion(&self, cso: &Cso<'_>) -> Motion {
        let (now, then) = (cso.pose_ba, &self.pose_ba);
        let change = now.rotation - then.rotation;
        let squares = [change.x_axis, change.y_axis, change.z_axis].map(|axis| axis.length_squared());
        // A unit vector changes by at most the square root of half the sum.
        let turn = (0.5 * squares.iter().sum::<f64>()).sqrt();
        let (a, b) = (cso.a.centroid(), cso.b.centroid());
        let path_a = now.point(a).distance(then.point(a)) + turn * cso.a.radius();
        let path_b = now.inverse_point(b).distance(then.inverse_point(b)) + turn * cso.b.radius();
        Motion { path: path_a.max(path_b), turn }
    }

    /// Returns a lower bound of the depths of all facets that are not candidates, after a motion.
    /// Minus infinity if nothing is known.
    pub(super) fn others(&self, motion: &Motion) -> f64 {
        if motion.turn > self.turn { f64::NEG_INFINITY } else { self.others - motion.path }
    }

    /// Counts a search in which only the candidates were tried.
    pub(super) fn count(&mut self) {
        self.searches += 1;
    }

    /// Returns the motion for which the next candidates should stay valid, if the bodies go on as
    /// in `motion`. `None` in fast motion, in which there would be too many candidates.
    pub(super) fn reach(&self, cso: &Cso<'_>, motion: &Motion) -> Option<Motion> {
        let radius = cso.a.radius().min(cso.b.radius());
        let share = self.ahead / f64::from(self.searches + 1);
        let path = (share * motion.path).max(CANDIDATE_LEAST * radius);
        let turn = (share * motion.turn).max(CANDIDATE_LEAST);
        (path <= CANDIDATE_PATH * radius && turn <= CANDIDATE_TURN).then_some(Motion { path, turn })
    }

    #[cfg(test)]
    pub(super) fn pose_ba(&self) -> Placement {
        self.pose_ba
    }

    pub(super) fn clear(&mut self) {
        *self = Self::NONE;
    }

    /// Begins a search for candidates.
    pub(super) fn begin(&mut self) {
        (self.ends, self.searches) = ([0; KINDS], 0);
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

    /// Ends a search at the pose `pose_ba`. Until no unit vector changes by more than `turn`, all
    /// other facets are at least `others` deep, minus the path of the motion.
    pub(super) fn end(&mut self, pose_ba: &Placement, others: f64, turn: f64) {
        let is_complete = usize::from(self.ends[KINDS - 1]) <= ROOM;
        (self.pose_ba, self.turn) = (*pose_ba, turn);
        self.others = if is_complete { others } else { f64::NEG_INFINITY };
        // The next candidates are fewer if there was no room for these.
        self.ahead = if is_complete { (1.25 * self.ahead).min(CANDIDATE_SEARCHES) } else { 0.5 * self.ahead };
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
