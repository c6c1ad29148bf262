//! Rounds of a step that swing to and fro.
//!
//! A round solves for the twists under the contacts that were predicted to press and slide, and
//! predicts them again for its solution. A sliding contact that lifts the body that it holds back
//! can swing: it presses, so that friction holds, so that it lifts off; then nothing holds, so that
//! it presses. In between there is a twist whose solution is itself.
//!
//! So where a round's solution comes back to the last but one, the next forces are predicted for
//! twists between guess and solution. The share of the way is Aitken's: that of a straight line
//! through the last two residuals \[Irons, Tuck 1969; Küttler, Wall 2008\]. Products of twists are
//! by the mass and the springs of each body alone, so that metres and radians can be added.

use std::ops::Range;

use super::World;
use super::object::Part;
use crate::algebra::tolerance::{RELAX_DRIFT, RELAX_LEAST};

/// Relaxation of the rounds of one group's step; see the module's description.
pub(super) struct Relaxation {
    /// Share of the way from guess to solution in the last round.
    share: f64,
    /// A solution has come back to the last but one.
    swings: bool,
}

impl Relaxation {
    /// Before the first round of the bodies `of`.
    pub(super) fn begin(world: &mut World, of: Range<usize>) -> Self {
        each(world, of, |part| part.guess = part.twist);
        Self { share: 1.0, swings: false }
    }

    /// After a `round`'s solution: sets the twists for which the next round predicts forces;
    /// true if they are not the solution.
    pub(super) fn step(&mut self, world: &mut World, of: Range<usize>, round: u32) -> bool {
        let (mut slope, mut change, mut size, mut drift) = (0.0, 0.0, 0.0, 0.0);
        each(world, of.clone(), |part| {
            let (last, residual) = (part.residual, part.twist - part.guess);
            let (difference, sum) = (residual - last, residual + last);
            let product = part.alone.0.times(&difference);
            slope += product.power(&last);
            change += product.power(&difference);
            size += part.alone.0.times(&residual).power(&residual);
            drift += part.alone.0.times(&sum).power(&sum);
            part.residual = residual;
        });
        self.swings |= round > 1 && drift < RELAX_DRIFT * RELAX_DRIFT * size;
        if self.swings && change > 0.0 {
            self.share = (-self.share * slope / change).clamp(RELAX_LEAST, 1.0);
        }
        let (share, swings) = (self.share, self.swings);
        each(world, of, |part| {
            if swings {
                part.twist = part.guess + part.residual * share;
            }
            part.guess = part.twist;
        });
        swings
    }
}

fn each(world: &mut World, of: Range<usize>, mut act: impl FnMut(&mut Part)) {
    for k in of {
        act(&mut world.things[world.islands.body(k)].part);
    }
}
