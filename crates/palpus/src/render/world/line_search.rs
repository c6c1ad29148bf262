//! Line search between the rounds of a step.
//!
//! A round solves for the twists under the contacts that press and slide at its *guess*. If a body
//! moves farther than its play, the contacts of the other side are missing in this system. The
//! solution then lies deep in the other wall, and the rounds throw the body from wall to wall
//! without an end. A contact that slides at the guess can likewise slide backwards in the solution,
//! although its friction would hold it.
//!
//! Without friction, the step minimises a convex energy: that of inertia, coupling and pressing
//! contacts. Along the line from guess to solution, its slope is the product of the unbalanced
//! impulse and the direction of the line. If this slope is positive at the solution, the energy has
//! its lowest point before the solution. This point, found by false position, is the next guess. So
//! the energy falls in each round. With friction or shaded forces there is no energy, but the slope
//! is defined in the same way.

use std::ops::Range;

use super::World;
use super::object::WorldBody;
use super::pair::relative_twist;
use super::settle::relative_to;
use crate::algebra::Twist;
use crate::algebra::tolerance::{SEARCH_SLOPE, SEARCH_TRIES};

impl World {
    /// Sets the next guess of the bodies at `of`, whose twists are the solution of a round. If the
    /// solution is beyond the lowest point of the line from the guess, the twists are moved back to
    /// this point. If the line shows no lowest point, they are moved to its middle, and the limits
    /// of friction no longer follow the loads. The contact forces are predicted at the new twists.
    /// Returns true if the twists are moved.
    pub(super) fn search(&mut self, of: Range<usize>, group: u32, h: f64) -> bool {
        for k in of.clone() {
            let part = &mut self.things[self.islands.body(k)].part;
            part.residual = part.twist - part.guess;
        }
        let is_moved = self.move_back(of.clone(), group, h);
        for k in of {
            let part = &mut self.things[self.islands.body(k)].part;
            part.guess = part.twist;
        }
        is_moved
    }

    /// Moves the twists as [`Self::search`] describes.
    fn move_back(&mut self, of: Range<usize>, group: u32, h: f64) -> bool {
        let mut high = (1.0, self.slope(of.clone(), group, h));
        if high.1 <= 0.0 {
            return false;
        }
        let first = self.slope_at(0.0, of.clone(), group, h);
        if first >= 0.0 {
            // Friction can reverse the slope at the guess. Then the line shows no lowest point. The
            // middle of the line ends a cycle of two guesses. Where bodies jam, friction can grow
            // with a load that it causes itself. Limits that do not follow the load within a round
            // avoid this.
            self.limits_follow = false;
            self.slope_at(0.5, of, group, h);
            return true;
        }
        let mut low = (0.0, first);
        for _ in 0..SEARCH_TRIES {
            let share = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            let slope = self.slope_at(share, of.clone(), group, h);
            if slope.abs() <= SEARCH_SLOPE * first.abs() {
                break;
            }
            // The slope of the other end is halved, so that both ends move.
            if slope > 0.0 {
                (high, low.1) = ((share, slope), 0.5 * low.1);
            } else {
                (low, high.1) = ((share, slope), 0.5 * high.1);
            }
        }
        true
    }

    /// Moves the bodies to this share of the way from guess to solution, and returns the slope.
    fn slope_at(&mut self, share: f64, of: Range<usize>, group: u32, h: f64) -> f64 {
        for k in of.clone() {
            let part = &mut self.things[self.islands.body(k)].part;
            part.twist = part.guess + part.residual * share;
        }
        self.predict(group, h, |_| true);
        self.slope(of, group, h)
    }

    /// Returns the slope of the energy along the residual, J·s, at the present twists and the
    /// contact forces predicted for them.
    fn slope(&self, of: Range<usize>, group: u32, h: f64) -> f64 {
        let own = of.map(|k| {
            let part = &self.things[self.islands.body(k)].part;
            let (system, load) = &part.alone;
            (system.times(&part.twist) + -*load).power(&part.residual)
        });
        let touching = self.near.iter().map(|&k| &self.pairs[k as usize]).filter(|pair| pair.group == group);
        let given = touching.map(|pair| {
            let [a, b] = pair.bodies.map(|i| &self.things[i]);
            let along = |thing: &WorldBody| if thing.part.is_moved { thing.part.residual } else { Twist::default() };
            let step = relative_twist(&along(a), &along(b), a.center - b.center);
            pair.predicted_impulse(&relative_to(&self.things, pair.bodies), h).power(&step)
        });
        own.sum::<f64>() - given.sum::<f64>()
    }
}
