//! Pairs of pieces that are apart and cannot have a contact before some motion.
//!
//! The direction u of the closest points of two pieces changes with the motion. Let d be their
//! distance. If one piece is translated by t, the closest points of their difference move by at
//! most t, so u turns by at most asin(t / d). If the piece then turns by θ about its closest point,
//! no point of the piece moves by more than h = θ ρ, where ρ is its largest extent. No gap along a
//! direction changes by more than h, and the gap along a direction is at most the distance times
//! the cosine of its angle to u. So u turns by at most acos(1 − 2 h / (d − t)). In the frame of the
//! other piece, u turns by another θ.
//!
//! Let φ be the sum of these angles. A pair that is apart has a contact only under some conditions
//! (`apart`). It has none if these three hold for one of its pieces:
//!
//! * The angle between u and all admissible normals of the piece is larger than φ.
//! * So is the angle between u and the flat faces that continue beyond the piece.
//! * No vertex of the other piece admits the normal of a valley of this piece. This only depends on
//!   the turn.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::part::PartSearch;
use super::query_input::QueryInput;
use crate::algebra::tolerance::{
    IDLE_ENOUGH, IDLE_LEAST, IDLE_ROUNDING, IDLE_SPARE, IDLE_TRIES, IDLE_TURN, IDLE_TURN_AHEAD, IDLE_TURN_FADE,
};
use crate::collision::{Closest, IdleReason, LeafPair, Pace};

impl PartSearch {
    /// Makes a pair that is apart and has no contact idle, for as long as it cannot have one.
    pub(super) fn make_idle(&mut self, input: &QueryInput<'_>, leaf: &LeafPair, closest: &Closest) {
        if let Some((last, pace)) = self.front.idle_reason(leaf) {
            let limit = self.idle_limit(input, leaf, closest, &last, pace);
            self.front.set_idle(leaf, limit);
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

    /// Returns a motion before which the pair has no contact, and the reason. `None` if the bodies
    /// move that far in a few ticks. `last` is the last reason.
    fn idle_limit(
        &self,
        input: &QueryInput<'_>,
        leaf: &LeafPair,
        closest: &Closest,
        last: &IdleReason,
        pace: Pace,
    ) -> Option<(IdleReason, Pace)> {
        let (piece_a, piece_b) = input.pieces(leaf.piece_a, leaf.piece_b);
        let pair = NoContact {
            input,
            leaf,
            closest,
            extent: 2.0 * piece_a.radius().min(piece_b.radius()),
            pace,
            slope: self.patch_slope,
            idle_turn: self.idle_turn,
            turned: self.front.turned(),
        };
        let least = pair.turn_of_direction(Pace { motion: IDLE_LEAST * pace.motion, turn: IDLE_LEAST * pace.turn });
        // The directions of other pieces are seldom so far from the normals of a piece.
        if least >= 1.0 {
            return None;
        }
        let limit = |reason: IdleReason| Some((reason, pair.limit(&reason)?));
        limit(*last).or_else(|| limit(pair.reason(least, true)?)).or_else(|| limit(pair.reason(least, false)?))
    }
}

/// A pair of pieces that is apart and has no contact.
struct NoContact<'q> {
    input: &'q QueryInput<'q>,
    leaf: &'q LeafPair,
    closest: &'q Closest,
    /// Upper bound of the size of the smaller piece, model units.
    extent: f64,
    pace: Pace,
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

    fn turn_of_direction(&self, motion: Pace) -> f64 {
        turn_of_direction(self.closest.distance, self.extent, motion)
    }

    /// Returns a motion during which the reason holds. Motion and turn are in about the same ratio
    /// as now. `None` if it holds for a few ticks only.
    fn limit(&self, reason: &IdleReason) -> Option<Pace> {
        let outward = self.outward(reason.is_a);
        // The angle between two unit vectors is twice the arcsine of half their distance.
        let turned = 2.0 * asin_above(outward.distance(reason.outward.as_dvec3()) / 2.0);
        let mut angle = (f64::from(reason.angle) - turned - self.idle_turn).min(1.0);
        if let Some(slope) = self.slope {
            let [a, b] = self.input.admissible_normals(self.leaf);
            let piece = if reason.is_a { a } else { b };
            angle = angle.min(piece.angle_to_continued(outward, slope));
        }
        let Pace { motion, turn } = self.pace;
        let ratio = (turn / motion.max(f64::MIN_POSITIVE)).max(IDLE_SPARE / self.extent);
        let most = reason.valleys_until - self.turned;
        if angle <= 0.0 || most <= 0.0 {
            return None;
        }
        let begin = angle * self.closest.distance;
        let tried = (1..=IDLE_TRIES).map(|k| begin * 0.75f64.powi(k));
        let mut limits = tried.map(|motion| Pace { motion, turn: (ratio * motion).min(most) });
        let limit = limits.find(|limit| self.turn_of_direction(*limit) < angle)?;
        (limit.motion >= IDLE_LEAST * motion && limit.turn >= IDLE_LEAST * turn).then_some(limit)
    }
}

/// Returns an upper bound of the angle (rad) by which the direction of the closest points turns in
/// a motion, in either frame; infinite if the pieces may touch. The pieces are `distance` apart,
/// and the smaller one is at most `extent` long (model units).
fn turn_of_direction(distance: f64, extent: f64, Pace { motion, turn }: Pace) -> f64 {
    // The sum of motions bounds the motion of a or that of b. The closest points of the two are not
    // farther apart than the distance and this motion.
    let moved = motion + 2.0 * turn * distance;
    if moved >= distance {
        return f64::INFINITY;
    }
    // acos(1 − 2 y) is 2 asin(√y).
    let share = turn * extent / (distance - moved);
    asin_above(moved / distance) + 2.0 * asin_above(share.sqrt()) + turn
}

/// Returns an upper bound of the arcsine of `x`, which is not negative; at least π / 2 above 1.
fn asin_above(x: f64) -> f64 {
    // asin(x) − x has only positive coefficients from x³ on, whose sum is π / 2 − 1.
    x + (FRAC_PI_2 - 1.0) * x * x * x
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;

    use super::*;
    use crate::algebra::{Pose, Random};
    use crate::body::shapes::cuboid;
    use crate::body::{Body, BodySettings};
    use crate::detect::{ContactQuery, QuerySettings};

    const SEED: u64 = 0x7e57_1d1e;

    #[test]
    fn direction_turns_by_less_than_its_bound() {
        let mut random = Random::new(SEED);
        let mut most = 0.0f64;
        for round in 0..300 {
            let mut block = || {
                let size = random.vector().abs() + DVec3::splat(0.02);
                Arc::new(Body::build(cuboid(-size, size), &BodySettings::default(), &mut |_| ()).unwrap())
            };
            let (a, b) = (block(), block());
            let radius = |body: &Body| body.polytopes()[0].radius();
            let extent = 2.0 * radius(&a).min(radius(&b));
            let mut query = ContactQuery::new(a.clone(), b, QuerySettings::default());
            for _ in 0..40 {
                let pose = Pose::new(random.rotation(), random.vector() * 2.0);
                let Some(before) = query.nearest(&pose).filter(|nearest| nearest.separation > 1e-3) else { continue };
                let speed = before.separation * 10f64.powf(-2.5 * random.vector().x.abs());
                let turn = DQuat::from_scaled_axis(random.vector() * speed);
                let moved = Pose::new(turn * pose.rotation, pose.translation + random.vector() * speed);
                let Some(after) = query.nearest(&moved).filter(|nearest| nearest.separation > 0.0) else { continue };
                let corners = a.polytopes()[0].vertices().iter();
                let motion = corners.map(|&v| pose.point(v).distance(moved.point(v))).fold(0.0, f64::max);
                let pace = Pace { motion, turn: turn.to_scaled_axis().length() };
                let bound = turn_of_direction(before.separation, extent, pace);
                let in_a = |pose: &Pose, normal| pose.rotation.conjugate() * normal;
                let turned = before.normal.angle_between(after.normal);
                let turned_in_a = in_a(&pose, before.normal).angle_between(in_a(&moved, after.normal));
                let turned = turned.max(turned_in_a);
                assert!(turned <= bound + 1e-6, "seed {SEED:#x}, round {round}: {turned} > {bound}");
                most = most.max(turned / bound);
            }
        }
        assert!(most > 0.3, "the largest turn is {most} of the bound");
    }

    #[test]
    fn bound_of_the_arcsine_is_above_it() {
        for k in 0..=1000 {
            let x = f64::from(k) / 1000.0;
            assert!(asin_above(x) >= x.asin() - 1e-15, "{x}");
        }
    }
}
