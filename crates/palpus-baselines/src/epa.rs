//! One contact for each pair of convex pieces, from GJK and EPA, as a user of Coal or FCL would
//! have it.
//!
//! 1. All pairs of pieces nearer than the tolerance, from palpus's own query.
//! 2. A pair that is apart: its closest points. A pair that overlaps: the one witness of
//!    [`penetration`](crate::penetration).
//! 3. Each contact pushes with k (t − d) along its normal, half way between its points; all are
//!    added up.
//!
//! These are left out on purpose, since such a user does not have them: a check whether a normal is
//! one of the mesh's (pieces have virtual faces where they were cut), memory between steps,
//! blending of a flat contact's witness point, and clusters.
//!
//! Coal can return several contacts for a pair. They form a patch with a single normal, which is
//! not the "one EPA contact" that is measured here.

use std::sync::Arc;

use palpus::algebra::{Pose, Twist};
use palpus::body::Body;
use palpus::collision::Proximity;

use crate::pairs::Pairs;
use crate::{Baseline, BaselineError, Felt, Settings, penetration};

/// See the module's outline.
#[derive(Clone, Debug)]
pub struct Epa {
    a: Arc<Body>,
    b: Arc<Body>,
    settings: Settings,
    pairs: Pairs,
}

impl Epa {
    /// Fails if a setting is invalid.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: Settings) -> Result<Self, BaselineError> {
        settings.validate()?;
        Ok(Self { pairs: Pairs::new(&a, &b), a, b, settings })
    }
}

impl Baseline for Epa {
    fn name(&self) -> &'static str {
        "epa"
    }

    fn step(&mut self, pose_ba: &Pose, _twist: &Twist, _dt: f64) -> Felt {
        let mut felt = Felt::NOTHING;
        if !pose_ba.is_valid() {
            return felt;
        }
        let (place, Settings { tolerance, stiffness, grip_a }) = (pose_ba.placement(), self.settings);
        let grip = place.point(grip_a);
        for pair in self.pairs.within(&self.a, &self.b, &place, tolerance) {
            let (point, normal, separation) = match pair.proximity {
                Proximity::Disjoint(closest) => {
                    ((closest.point_a + closest.point_b) * 0.5, closest.normal, closest.distance)
                }
                Proximity::Overlapping(_) => {
                    let (piece_a, piece_b) = (pair.piece_a as usize, pair.piece_b as usize);
                    match penetration(&self.a.polytopes()[piece_a], &self.b.polytopes()[piece_b], &place) {
                        Some(deep) => ((deep.point_a + deep.point_b) * 0.5, deep.normal, -deep.depth),
                        None => continue,
                    }
                }
            };
            if separation < tolerance {
                felt.push(normal * (stiffness * (tolerance - separation)), point, separation, grip);
            }
        }
        felt
    }

    fn clear(&mut self) {
        self.pairs.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_ball_and_a_box_on_a_table_are_pushed_up() {
        testing::ball_on_table(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("good settings")));
        testing::box_on_table(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("good settings")));
    }

    #[test]
    fn the_same_steps_feel_the_same() {
        testing::same_again(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("good settings")));
    }

    #[test]
    fn a_setting_that_cannot_be_is_named() {
        let (ball, table) = (testing::ball(), testing::table());
        let error = Epa::new(ball, table, Settings { stiffness: -1.0, ..Settings::default() }).err();
        assert!(matches!(error, Some(BaselineError::Setting { field: "stiffness", .. })), "{error:?}");
    }
}
