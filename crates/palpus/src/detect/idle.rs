//! Pairs of pieces that are apart and cannot have a contact before some motion.
//!
//! A pair that is apart has a contact only under some conditions (`apart`). It has none while the
//! direction u of the closest points has turned by less than an angle γ, if these three hold for
//! one of its pieces:
//!
//! * The angle between u and all admissible normals of the piece is larger than γ.
//! * So is the angle between u and the flat faces that continue beyond the piece.
//! * No vertex of the other piece admits the normal of a valley of this piece. This only depends on
//!   the turn.
//!
//! The front bounds by which angle the direction has turned (`collision/front/idle.rs`).

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::part::PartSearch;
use super::query_input::QueryInput;
use crate::algebra::tolerance::{IDLE_ENOUGH, IDLE_LEAST, IDLE_ROUNDING, IDLE_TURN, IDLE_TURN_AHEAD, IDLE_TURN_FADE};
use crate::collision::{Closest, IdleLimit, IdleReason, LeafPair, Pace};

impl PartSearch {
    /// Makes a pair that is apart and has no contact idle, for as long as it cannot have one.
    pub(super) fn make_idle(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, closest: &Closest) {
        if let Some((last, pace)) = self.front.idle_reason(leaf) {
            let limit = self.idle_limit(input, leaf, closest, &last, pace);
            self.front.set_idle(&input.placed(), leaf, closest, limit);
        }
    }

    /// Sets [`QuerySettings::patch_angle`](super::QuerySettings).
    pub(super) fn set_patch_angle(&mut self, angle: Option<f64>) {
        self.patch_slope = angle.map(f64::tan);
        self.front.end_all_idle();
    }

    /// Sets [`QuerySettings::turn`](super::QuerySettings) of the next query.
    pub(super) fn set_turn(&mut self, turn: f64) {
        if turn > self.idle_turn {
            self.front.end_all_idle();
        }
        self.idle_turn = (IDLE_TURN_AHEAD * turn).max(IDLE_TURN_FADE * self.idle_turn);
    }

    /// Returns the angle by which the direction must turn before the pair has a contact, and the
    /// reason. `None` if the direction may turn that far in a few ticks. `last` is the last reason.
    fn idle_limit(
        &self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        closest: &Closest,
        last: &IdleReason,
        pace: Pace,
    ) -> Option<IdleLimit> {
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let pair = NoContact {
            input,
            leaf,
            closest,
            slope: self.patch_slope,
            idle_turn: self.idle_turn,
            turned: self.front.turned(),
        };
        let (is_a_larger, extent) = (piece_a.radius() > piece_b.radius(), 2.0 * piece_a.radius().min(piece_b.radius()));
        let Pace { motion, turn } = pace;
        let least =
            likely_turn(closest.distance, extent, Pace { motion: IDLE_LEAST * motion, turn: IDLE_LEAST * turn });
        // The directions of other pieces are seldom so far from the normals of a piece.
        if least >= 1.0 {
            return None;
        }
        let limit = |reason: IdleReason| {
            let angle = pair.angle(&reason).filter(|&angle| angle > least)?;
            Some(IdleLimit { reason, angle, extent, is_a_larger })
        };
        limit(*last).or_else(|| limit(pair.reason(least, true)?)).or_else(|| limit(pair.reason(least, false)?))
    }
}

/// A pair of pieces that is apart and has no contact.
struct NoContact<'q> {
    input: &'q QueryInput<'q>,
    leaf: &'q LeafPair,
    closest: &'q Closest,
    /// See [`PartSearch::patch_slope`].
    slope: Option<f64>,
    /// See [`PartSearch::idle_turn`].
    idle_turn: f64,
    /// The sum of all rotations, rad.
    turned: f64,
}

impl NoContact<'_> {
    /// Returns the direction from the piece of a (or of b) to the other piece, in its body's
    /// frame.
    fn outward(&self, is_a: bool) -> DVec3 {
        let normal = self.closest.normal;
        if is_a { self.input.place.inverse_vector(-normal) } else { normal }
    }

    /// Returns why the piece of a (or of b) gives no contact before the direction of the closest
    /// points has turned by `least` (rad). `None` if it may give one.
    fn reason(&self, least: f64, is_a: bool) -> Option<IdleReason> {
        let [a, b] = self.input.admissible_normals(self.leaf);
        let (piece, other) = if is_a { (a, b) } else { (b, a) };
        let outward = self.outward(is_a);
        let least = least + self.idle_turn;
        if self.slope.is_some_and(|slope| piece.angle_to_continued(outward, slope) <= least) {
            return None;
        }
        let angle = piece.angle_between(outward, [least, IDLE_ENOUGH * least]);
        if angle <= least {
            return None;
        }
        let place = &self.input.place;
        let to_other = |normal| if is_a { place.vector(normal) } else { place.inverse_vector(normal) };
        let is_clear = |normal: DVec3| other.vertices_differ_from(-to_other(normal), IDLE_TURN);
        let valleys_until = match self.slope {
            None => f64::INFINITY,
            Some(_) if piece.valley_normals().all(is_clear) => self.turned + IDLE_TURN,
            Some(_) => return None,
        };
        let angle = (angle - IDLE_ROUNDING) as f32;
        Some(IdleReason { valleys_until, outward: outward.as_vec3(), angle, is_a })
    }

    /// Returns the angle (rad, at most 1) by which the direction must turn before the reason no
    /// longer holds. `None` if it does not hold now.
    fn angle(&self, reason: &IdleReason) -> Option<f64> {
        let outward = self.outward(reason.is_a);
        // The angle between two unit vectors is twice the arcsine of half their distance.
        let turned = 2.0 * asin_above(outward.distance(reason.outward.as_dvec3()) / 2.0);
        let mut angle = (f64::from(reason.angle) - turned - self.idle_turn).min(1.0);
        if let Some(slope) = self.slope {
            let [a, b] = self.input.admissible_normals(self.leaf);
            let piece = if reason.is_a { a } else { b };
            angle = angle.min(piece.angle_to_continued(outward, slope));
        }
        (angle > 0.0 && reason.valleys_until > self.turned).then_some(angle)
    }
}

/// Returns the angle (rad) by which a motion may turn the direction of the closest points of two
/// pieces that are `distance` apart; infinite if the pieces may touch. The smaller piece is at most
/// `extent` long (model units).
fn likely_turn(distance: f64, extent: f64, Pace { motion, turn }: Pace) -> f64 {
    let gap = distance - motion - turn * extent;
    if gap <= 0.0 { f64::INFINITY } else { asin_above(motion / distance) + turn * (1.0 + extent / distance) }
}

/// Returns an upper bound of the arcsine of `x`, which is not negative; at least π / 2 above 1.
fn asin_above(x: f64) -> f64 {
    // asin(x) − x has only positive coefficients from x³ on, whose sum is π / 2 − 1.
    x + (FRAC_PI_2 - 1.0) * x * x * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bound_of_the_arcsine_is_above_it() {
        for k in 0..=1000 {
            let x = f64::from(k) / 1000.0;
            assert!(asin_above(x) >= x.asin() - 1e-15, "{x}");
        }
    }
}
