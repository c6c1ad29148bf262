//! Idle pairs: they are within the tolerance, but cannot have a contact before some motion.
//!
//! Most pairs of pieces within the tolerance are apart and have no contact: the direction of their
//! closest points is not a normal of the meshes. The caller states how far this direction must turn
//! before that can change ([`Front::set_idle`]). Until then, queries do not measure the pair.
//!
//! A query bounds the turn of the direction from the last closest points, p of a and q of b, and
//! their direction u, a unit vector. At the present pose, p and q are v apart. The vertices of the
//! smaller piece turn by at most θ about its closest point, and are at most ρ away from it. So the
//! gap along u is at least v·u − θ ρ. The distance is at most |v|, and the gap along u is at most
//! the distance times the cosine of the angle φ between u and the present direction. So cos φ is at
//! least (v·u − θ ρ) / |v|. Here, u is fixed in the frame of the larger piece. In the other frame,
//! the direction turns by at most φ + θ.
//!
//! The front also stores the caller's reason, because it may hold for longer.

use glam::{DVec3, Vec3};

use super::{Front, PlacedPair};
use crate::algebra::tolerance::{IDLE_RETRY, POINT_BOUND_ROUNDING};
use crate::collision::{Closest, LeafPair};

/// Until when the pair at a place is idle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Idle {
    /// The last closest points, each in its body's frame.
    point_a: Vec3,
    point_b: Vec3,
    /// The direction from b to a, in the frame of the larger piece's body.
    direction: Vec3,
    /// Cosine of the angle by which the direction must turn. Infinite if the pair is not idle.
    cosine: f32,
    /// Upper bound of the size of the smaller piece, model units.
    extent: f32,
    /// True if the larger piece is a's.
    is_a_larger: bool,
    /// The motion bound's sum of rotations (rad) at the last measurement.
    turned: f64,
    /// The motion bound's sum from which on the caller may make the pair idle again.
    retry: u64,
    reason: IdleReason,
}

/// How long a pair is idle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IdleLimit {
    pub(crate) reason: IdleReason,
    /// The angle (rad, at most 1) by which the direction of the closest points must turn.
    pub(crate) angle: f64,
    /// Upper bound of the size of the smaller piece, model units.
    pub(crate) extent: f64,
    /// True if the larger piece is a's.
    pub(crate) is_a_larger: bool,
}

/// Why a pair has no contact: one of the pieces does not admit the direction of the closest points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IdleReason {
    /// The motion bound's sum of rotations (rad) until which no valley of this piece can give a
    /// contact.
    pub(crate) valleys_until: f64,
    /// The direction at some query, from this piece, in its frame.
    pub(crate) outward: Vec3,
    /// The angle (rad) between `outward` and all admissible normals of this piece.
    pub(crate) angle: f32,
    /// True if this piece is a's.
    pub(crate) is_a: bool,
}

/// A relative motion of two bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// No distance changes by more, model units.
    pub(crate) motion: f64,
    /// Rotation, rad.
    pub(crate) turn: f64,
}

impl Idle {
    /// A pair that is not idle.
    pub(super) const NONE: Self = Self {
        point_a: Vec3::ZERO,
        point_b: Vec3::ZERO,
        direction: Vec3::ZERO,
        cosine: f32::INFINITY,
        extent: 0.0,
        is_a_larger: true,
        turned: 0.0,
        retry: 0,
        reason: IdleReason::NONE,
    };
}

impl IdleReason {
    /// No reason.
    const NONE: Self = Self { valleys_until: f64::NEG_INFINITY, outward: Vec3::ZERO, angle: 0.0, is_a: true };
}

impl Front {
    /// True if the pair at `place` is idle.
    #[inline]
    pub(super) fn is_idle(&self, query: &PlacedPair<'_>, place: u32) -> bool {
        let idle = &self.idle[place as usize];
        let turned = self.motion_bound.turned();
        if idle.cosine > 1.0 || turned > idle.reason.valleys_until {
            return false;
        }
        let turned = turned - idle.turned;
        let (at_a, point_b) = (query.pose_ba.point(idle.point_a.as_dvec3()), idle.point_b.as_dvec3());
        let direction = idle.direction.as_dvec3();
        let direction = if idle.is_a_larger { query.pose_ba.vector(direction) } else { direction };
        let apart = at_a - point_b;
        let noise = POINT_BOUND_ROUNDING * (at_a.length() + point_b.length());
        let gap = apart.dot(direction) - turned * f64::from(idle.extent) - noise;
        let farthest = apart.length() + noise;
        // A pair beyond the tolerance is measured, so that it may wait.
        gap > farthest * (f64::from(idle.cosine) + turned) && gap <= query.tolerance
    }

    /// Ends the idleness of the pair at `place`, which was not within the tolerance before. The
    /// caller may make it idle from the next query on: at a single pose, that would cost more than
    /// it saves.
    pub(super) fn end_idle(&mut self, place: u32) {
        self.idle[place as usize] = Idle { retry: self.motion_bound.sum(), ..Idle::NONE };
    }

    /// Returns the last reason of a pair, and the approximate motion of the bodies in a tick, if
    /// the pair may become idle now.
    pub(crate) fn idle_reason(&self, pair: &LeafPair) -> Option<(IdleReason, Pace)> {
        let Idle { retry, reason, .. } = &self.idle[pair.place? as usize];
        (self.motion_bound.sum() > *retry).then_some((*reason, self.pace))
    }

    /// Makes a pair with these closest points idle. `None` if it may have a contact too soon; the
    /// caller then asks again after some ticks.
    pub(crate) fn set_idle(
        &mut self,
        query: &PlacedPair<'_>,
        pair: &LeafPair,
        closest: &Closest,
        limit: Option<IdleLimit>,
    ) {
        let Some(place) = pair.place else { return };
        let bound = &self.motion_bound;
        let in_a = |normal: DVec3| query.pose_ba.inverse_vector(normal);
        self.idle[place as usize] = match limit {
            Some(IdleLimit { reason, angle, extent, is_a_larger }) => Idle {
                point_a: query.pose_ba.inverse_point(closest.point_a).as_vec3(),
                point_b: closest.point_b.as_vec3(),
                direction: if is_a_larger { in_a(closest.normal) } else { closest.normal }.as_vec3(),
                cosine: (angle.cos() as f32).next_up(),
                extent: (extent as f32).next_up(),
                is_a_larger,
                turned: bound.turned(),
                retry: bound.sum(),
                reason,
            },
            None => Idle { retry: bound.due(IDLE_RETRY * self.pace.motion), ..Idle::NONE },
        };
    }

    /// Returns the sum of all rotations so far, rad.
    pub(crate) fn turned(&self) -> f64 {
        self.motion_bound.turned()
    }

    /// Ends the idleness of all pairs, because the limits were stated for other settings.
    pub(crate) fn end_all_idle(&mut self) {
        for k in 0..self.awake.len() {
            self.end_idle(self.awake[k]);
        }
    }

    /// Returns the number of pairs that were idle in the last query.
    pub(crate) fn idle(&self) -> u32 {
        self.idle_count
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::super::oracle::cuboid;
    use super::super::super::{LeafPairs, Proximity, Side};
    use super::*;
    use crate::algebra::{Placement, Pose, Random};
    use crate::body::{Hierarchy, Polytope};

    const SEED: u64 = 0x7e57_1d1e;

    /// Returns the only pair of two pieces, and its closest points. `None` if they overlap.
    fn measured(front: &mut Front, query: &PlacedPair<'_>) -> Option<(LeafPair, Closest)> {
        let mut found = LeafPairs::new(1);
        front.within(query, &mut found);
        let leaf = found.as_slice()[0];
        match leaf.proximity {
            Proximity::Disjoint(closest) => Some((leaf, closest)),
            Proximity::Overlapping(_) => None,
        }
    }

    #[test]
    fn direction_of_an_idle_pair_turns_by_less_than_its_angle() {
        let mut random = Random::new(SEED);
        let (mut most, mut idle) = (0.0f64, 0);
        for round in 0..2000 {
            let pieces = [(); 2].map(|()| [cuboid(random.vector().abs() + DVec3::splat(0.02))]);
            let hierarchies = [0, 1].map(|k| Hierarchy::build(&pieces[k], 1e-9).unwrap());
            let [a, b] = [0, 1].map(|k| Side { hierarchy: &hierarchies[k], pieces: &pieces[k] });
            let mut front = Front::new(a, b, 16);
            let pose = Pose::new(random.rotation(), random.vector() * 3.0);
            let placed = pose.placement();
            let query = PlacedPair::new(a, b, &placed, 10.0);
            let Some((leaf, before)) = measured(&mut front, &query) else { continue };
            let radius = |of: &[Polytope; 1]| of[0].radius();
            let limit = IdleLimit {
                reason: IdleReason { valleys_until: f64::INFINITY, ..IdleReason::NONE },
                angle: 0.5 * random.unit(),
                extent: 2.0 * radius(&pieces[0]).min(radius(&pieces[1])),
                is_a_larger: radius(&pieces[0]) > radius(&pieces[1]),
            };
            front.set_idle(&query, &leaf, &before, Some(limit));
            for _ in 0..20 {
                let speed = before.distance * 10f64.powf(-2.5 * random.unit());
                let turn = DQuat::from_scaled_axis(random.vector() * speed * random.unit());
                let moved = Pose::new(turn * pose.rotation, pose.translation + random.vector() * speed).placement();
                let mut at_moved = front.clone();
                at_moved.motion_bound.advance(&moved);
                let query = PlacedPair::new(a, b, &moved, 10.0);
                if at_moved.is_idle(&query, leaf.place.unwrap()) {
                    let after = measured(&mut Front::new(a, b, 16), &query).unwrap().1;
                    let in_a = |pose: &Placement, normal| pose.inverse_vector(normal);
                    let turned_in_a = in_a(&placed, before.normal).angle_between(in_a(&moved, after.normal));
                    let turned = before.normal.angle_between(after.normal).max(turned_in_a);
                    assert!(turned < limit.angle, "seed {SEED:#x}, round {round}: {turned} > {}", limit.angle);
                    most = most.max(turned / limit.angle);
                    idle += 1;
                }
            }
        }
        assert!(most > 0.9 && idle > 5000, "the largest turn is {most} of its bound, {idle} times idle");
    }
}
