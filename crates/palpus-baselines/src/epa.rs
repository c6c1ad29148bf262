//! One contact for each pair of convex pieces, by GJK and EPA, as Coal or FCL compute it.
//!
//! 1. Find all pairs of pieces nearer than the tolerance, with palpus's own query.
//! 2. A disjoint pair gives its closest points. An overlapping pair gives the single witness of
//!    [`penetration`](crate::penetration).
//! 3. Each contact gives the force k (t − d) along its normal, at the midpoint of its two points.
//!    All forces are added up.
//!
//! Coal and FCL lack some parts of palpus, so this method lacks them too: the check that a normal
//! belongs to the mesh (pieces have virtual faces where they were cut), memory between steps,
//! several contacts for a patch, and clusters.
//!
//! Coal can also return several contacts for a pair, a patch with one normal. This method returns
//! only one contact.

use std::sync::Arc;

use palpus::algebra::{Pose, Twist};
use palpus::body::Body;
use palpus::collision::Proximity;

use crate::pairs::Pairs;
use crate::{Baseline, BaselineError, Felt, Settings, penetration};

/// The EPA method; the module describes its steps.
#[derive(Clone, Debug)]
pub struct Epa {
    a: Arc<Body>,
    b: Arc<Body>,
    settings: Settings,
    pairs: Pairs,
}

impl Epa {
    /// Makes the method for probe `a` and environment `b`.
    ///
    /// # Errors
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
    fn ball_and_box_on_a_table_are_pushed_up() {
        testing::ball_on_table(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("the settings are valid")));
        testing::box_on_table(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("the settings are valid")));
    }

    #[test]
    fn same_steps_give_identical_results() {
        testing::same_again(|a, b, settings| Box::new(Epa::new(a, b, settings).expect("the settings are valid")));
    }

    #[test]
    fn invalid_setting_is_named() {
        let (ball, table) = (testing::ball(), testing::table());
        let error = Epa::new(ball, table, Settings { stiffness: -1.0, ..Settings::default() }).err();
        assert!(matches!(error, Some(BaselineError::Setting { field: "stiffness", .. })), "{error:?}");
    }
}
