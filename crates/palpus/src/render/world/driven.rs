//! A body that a host program moves at the host's rate, such as a robot's link at 60 or 500 Hz, or
//! a conveyor.
//!
//! The host sends updates of pose and velocity. Between updates the body moves on, so that the hand
//! feels no update as a step:
//!
//! 1. *Catch up*: the body moves from its pose and velocity in the last step to the extrapolated
//!    pose of the update. This takes [`CATCH_UP`] times the interval between the last two
//!    updates. Position and velocity are continuous (Hermite's cubic). At a constant velocity, the
//!    body follows the host exactly.
//! 2. *Continue*: the body keeps the update's velocity until the next update.
//! 3. *Stop*: if no update comes for [`DRIVEN_PATIENCE`], the body slows down and stops after
//!    another [`DRIVEN_PATIENCE`].
//!
//! The velocity of a tick moves the body exactly to its next pose, so it agrees with the implicit
//! step.

use glam::{DQuat, DVec3};

use crate::algebra::tolerance::{DRIVEN_PATIENCE, DRIVEN_PERIOD};
use crate::algebra::{Pose, Twist, rotation_between};

/// Duration of the catch-up, relative to the interval between two updates. With 1, the body needs
/// ten times the host's acceleration. With 2, it lags a hand's swing at 60 Hz by a millimetre.
const CATCH_UP: f64 = 1.5;

/// See the module's description. The linear part of a twist is the velocity of the frame's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven {
    /// Pose after the last step, and the velocity in that step.
    next: (Pose, Twist),
    /// Length of the last step, s.
    step: f64,
    /// Pose and velocity at the start of the catch-up.
    from: (Pose, Twist),
    /// Time from the last update to the start of the catch-up, s.
    begins: f64,
    /// The last update.
    last: (Pose, Twist),
    /// Time since the last update, s.
    since: f64,
    /// Duration of the catch-up, s.
    lasts: f64,
}

impl Driven {
    /// Returns a body at rest.
    pub(super) fn at(pose: Pose) -> Self {
        let still = (pose, Twist::default());
        Self { next: still, step: 0.0, from: still, begins: 0.0, last: still, since: 0.0, lasts: DRIVEN_PERIOD }
    }

    /// Stores an update of the host: the body's present pose and velocity.
    pub(super) fn update(&mut self, pose: Pose, velocity: Twist) {
        let lasts =
            if self.last.1 == Twist::default() && self.since > DRIVEN_PATIENCE { DRIVEN_PERIOD } else { self.since };
        *self = Self {
            // The implicit step assumed that the body would reach this pose.
            from: self.next,
            begins: self.step,
            last: (pose, velocity),
            since: 0.0,
            // Two updates in one tick count as one.
            lasts: if lasts > 0.0 { CATCH_UP * lasts.min(DRIVEN_PATIENCE) } else { self.lasts },
            ..*self
        };
    }

    /// Moves the body by `dt` s (not negative). Returns the new pose, and the twist that leads from
    /// it to the pose another `dt` later.
    pub(super) fn advance(&mut self, dt: f64) -> (Pose, Twist) {
        self.since += dt;
        let pose = self.pose(self.since);
        let (mut next, mut twist) = (pose, Twist::default());
        if dt > 0.0 {
            next = self.pose(self.since + dt);
            twist.angular = rotation_between(pose.rotation, next.rotation) / dt;
            twist.linear = (next.translation - pose.translation) / dt;
            if !(twist.angular.length().is_finite() && twist.linear.length().is_finite()) {
                twist = Twist::default();
            }
        }
        (self.next, self.step) = ((next, twist), dt);
        (pose, twist)
    }

    /// Returns true if the last update is older than [`DRIVEN_PATIENCE`].
    pub(super) fn is_overdue(&self) -> bool {
        self.since > DRIVEN_PATIENCE && self.last.1 != Twist::default()
    }

    /// Returns the pose at `since` s after the last update. If it is not finite (a host may send
    /// any velocity), returns the update's pose.
    fn pose(&self, since: f64) -> Pose {
        let pose = self.on_the_way(since);
        if pose.is_valid() { pose } else { self.last.0 }
    }

    /// Runs steps 1 to 3 of the module's description.
    fn on_the_way(&self, since: f64) -> Pose {
        let ends_at = self.begins + self.lasts;
        if since >= ends_at {
            return self.extrapolated(since);
        }
        let end = self.extrapolated(ends_at);
        let ((from, begins), (_, ends)) = (self.from, self.last);
        let turn = rotation_between(from.rotation, end.rotation);
        let share = ((since - self.begins) / self.lasts).max(0.0);
        let cubic = |way: DVec3, begins: DVec3, ends: DVec3| {
            // This is Hermite's cubic from 0 to `way`.
            let (square, cube) = (share * share, share * share * share);
            way * (3.0 * square - 2.0 * cube)
                + (begins * (cube - 2.0 * square + share) + ends * (cube - square)) * self.lasts
        };
        let moved = cubic(end.translation - from.translation, begins.linear, ends.linear);
        let turned = cubic(turn, begins.angular, ends.angular);
        Pose {
            rotation: (DQuat::from_scaled_axis(turned) * from.rotation).normalize(),
            translation: from.translation + moved,
        }
    }

    /// Extrapolates the last update to `since` s after it.
    fn extrapolated(&self, since: f64) -> Pose {
        let (pose, twist) = self.last;
        let late = ((since - DRIVEN_PATIENCE) / DRIVEN_PATIENCE).clamp(0.0, 1.0);
        // If the next update is late, the velocity falls to zero. `time` is the time in which the
        // full velocity would cover the distance.
        let time = since.min(DRIVEN_PATIENCE) + DRIVEN_PATIENCE * late * (1.0 - 0.5 * late);
        if twist == Twist::default() {
            return pose;
        }
        Pose {
            rotation: (DQuat::from_scaled_axis(twist.angular * time) * pose.rotation).normalize(),
            translation: pose.translation + twist.linear * time,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;

    /// The host has 60 Hz, and its body swings and turns.
    #[test]
    fn motion_between_updates_is_continuous() {
        let swing = |t: f64| 0.05 * (9.0 * t).sin();
        let rate = |t: f64| 0.45 * (9.0 * t).cos();
        let pose = |t: f64| Pose::new(DQuat::from_rotation_z(10.0 * swing(t)), DVec3::X * swing(t));
        let twist = |t: f64| Twist { angular: DVec3::Z * 10.0 * rate(t), linear: DVec3::X * rate(t) };
        let mut driven = Driven::at(pose(0.0));
        let mut now = (pose(0.0), Twist::default());
        let (mut next, mut most, mut off) = (0.0, 0.0f64, 0.0f64);
        for k in 0..2000 {
            let t = f64::from(k) * DT;
            if t >= next {
                driven.update(pose(t), twist(t));
                next += 1.0 / 60.0;
            }
            let before = now;
            now = driven.advance(DT);
            if t > 0.1 {
                most = most.max((now.1.linear - before.1.linear).length());
                off = off.max(now.0.translation.distance(pose(t + DT).translation));
            }
        }
        // The swing's own acceleration is 4.05 m/s².
        assert!(most < 5.0 * 4.05 * DT, "{most} m/s in a tick");
        assert!(off < 1e-3, "{off} m from the truth");
    }

    #[test]
    fn constant_velocity_is_followed_exactly() {
        let velocity = Twist { angular: DVec3::ZERO, linear: DVec3::X * 2.0 };
        let mut driven = Driven::at(Pose::IDENTITY);
        driven.update(Pose::IDENTITY, velocity);
        for k in 1..=1000 {
            let now = driven.advance(DT);
            if k % 17 == 0 {
                let place = Pose::from_translation(DVec3::X * 2.0 * f64::from(k) * DT);
                if k > 51 {
                    assert!(now.0.translation.distance(place.translation) < 1e-9, "{now:?}");
                    assert!((now.1.linear.x - 2.0).abs() < 1e-9, "{now:?}");
                }
                driven.update(place, velocity);
            }
        }
    }

    #[test]
    fn body_stops_without_updates() {
        let mut driven = Driven::at(Pose::IDENTITY);
        let velocity = Twist { angular: DVec3::Y, linear: DVec3::X };
        driven.update(Pose::IDENTITY, velocity);
        let mut fastest = 0.0f64;
        let mut last = (Pose::IDENTITY, velocity);
        for tick in 0..500 {
            let now = driven.advance(DT);
            // The body starts at rest, and needs some ticks to catch up.
            if tick > 50 {
                fastest = fastest.max((now.1.linear - last.1.linear).length());
            }
            last = now;
        }
        assert!(last.1.linear.length() < 1e-12 && driven.is_overdue(), "{last:?}");
        assert!(fastest < 0.02, "the body must slow down gently: {fastest}");
        assert!((last.0.translation.x - 1.5 * DRIVEN_PATIENCE).abs() < 1e-9, "{last:?}");
    }
}
