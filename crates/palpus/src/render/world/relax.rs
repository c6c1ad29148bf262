//! Relaxes the rounds of a step whose solutions oscillate.
//!
//! A round first predicts from given twists (the *guess*) which contacts press and slide. Then the
//! round solves for the twists under these contacts. The next round uses this solution as its
//! guess. The rounds can oscillate if the friction of a sliding contact lifts the body. Friction
//! lifts the body off, so the next round has no friction, and the contact presses again. Between
//! the two twists there is a twist whose solution equals the guess.
//!
//! So if a round's solution returns to the solution of two rounds before, the next guess is between
//! the guess and the solution. The fraction between them follows from a straight line through the
//! last two residuals (Aitken's method) \[Irons, Tuck 1969; Küttler, Wall 2008\]. The scalar
//! product of two twists is weighted with each body's mass and springs, so that metres and radians
//! can be added.

use std::ops::Range;

use super::World;
use super::object::Part;
use crate::algebra::tolerance::{RELAX_DRIFT, RELAX_LEAST};

/// Relaxation of the rounds of one group's step; see the module's description.
pub(super) struct Relaxation {
    /// Fraction of the way from guess to solution in the last round.
    share: f64,
    /// True if a solution has returned to the solution of two rounds before.
    swings: bool,
}

impl Relaxation {
    /// Begins the rounds of the bodies at `of` in the order of the groups.
    pub(super) fn begin(world: &mut World, of: Range<usize>) -> Self {
        each(world, of, |part| part.guess = part.twist);
        Self { share: 1.0, swings: false }
    }

    /// Sets the twists for which the next round predicts forces, after the solution of `round`.
    /// Returns true if these twists are not the solution.
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
