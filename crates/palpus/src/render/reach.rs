//! Limits the motion of a body in an implicit step.
//!
//! The query searches contacts only as far as the body may move in the next step: twice the motion
//! of the last step, and at least two contact offsets. No step moves the body farther, so it
//! cannot pass through a surface that the query did not examine. The motion of a body is that of
//! the fastest corner of its box: a peg that spins in its hole moves little. The turn is limited in
//! the same way: the query finds places whose normal faces the other body only after such a turn.
//!
//! If the work limit ends the query before it has examined everything, the body may move as far as
//! it certainly touches nothing else. A plane between the hulls of two bodies allows any motion
//! along the plane and away from it. Otherwise the body may only creep in this step, and the hand
//! pulls it ahead in the next. Then the body would move far in a step, the query would search
//! farther, and would be ended again. So the bound of a body in contact is halved after such a
//! query, and then grows slowly. A body that was held moves on gradually, because the force of the
//! coupling would otherwise vanish in one step.

use glam::{DQuat, DVec3};

use crate::algebra::Twist;
use crate::algebra::tolerance::{
    REACH_CREEP, REACH_CUT, REACH_FADE, REACH_GROWTH, REACH_LEAST, REACH_RECOVERY, TOOL_FASTEST,
};
use crate::body::Body;

/// What a query knows of the parts of another body that it did not examine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance {
    /// Distance beyond the contact offset of everything that it did not examine, m.
    pub(super) all: f64,
    /// A plane that separates the bodies.
    pub(super) plane: Option<PlaneClearance>,
}

/// A plane beyond which another body lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneClearance {
    /// Unit normal in the world, away from the other body.
    pub(super) away: DVec3,
    /// Distance of the body to the plane, beyond the contact offset, m.
    pub(super) clear: f64,
}

/// A box around a body, in the body's frame.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Centre of the box relative to the body's centre of mass, m.
    center: DVec3,
    /// Half edges, m.
    half_edges: [DVec3; 3],
}

impl Extent {
    /// Returns the box of `body`.
    fn of(body: &Body) -> Self {
        let hierarchy = body.hierarchy();
        let about = hierarchy.node(hierarchy.root()).oriented_box;
        let half_edges = [0, 1, 2].map(|k| about.axes.col(k) * about.half[k]);
        Self { center: about.center - body.mass().center_of_mass, half_edges }
    }

    /// Returns the corners relative to the body's centre of mass, m.
    fn corners(&self) -> impl Iterator<Item = DVec3> {
        let [one, two, three] = self.half_edges;
        let side = |k: usize, bit: usize, edge: DVec3| if k >> bit & 1 == 1 { edge } else { -edge };
        let center = self.center;
        (0..8).map(move |k| center + side(k, 0, one) + side(k, 1, two) + side(k, 2, three))
    }

    /// Returns a bound on the speed of all points of the body, m/s: a speed is largest at a corner.
    fn speed(&self, twist: &Twist) -> f64 {
        self.corners().map(|corner| twist.at(corner).length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// Returns a bound on the velocity of all points of the body along `direction`, m/s. Negative
    /// if all points move the other way.
    fn speed_along(&self, direction: DVec3, twist: &Twist) -> f64 {
        self.corners().map(|corner| twist.at(corner).dot(direction)).fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Clearance {
    /// Returns these distances times `part`.
    pub(super) fn times(self, part: f64) -> Self {
        let plane = self.plane.map(|plane| PlaneClearance { clear: part * plane.clear, ..plane });
        Self { all: part * self.all, plane }
    }
}

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    extent: Extent,
    /// Rotation of the body in this step, in the world.
    rotation: DQuat,
    /// Distance from the centre of mass to the farthest corner of the body's box, m.
    radius: f64,
    /// Separation below which contacts push, m.
    contact_offset: f64,
    /// Bodies that are not near are farther away than `most` plus this distance, m.
    spare: f64,
    /// Bound on the motion of all points of the body in the next step, m.
    most: f64,
    /// The turn in the next step that follows from the last turns, rad.
    turning: f64,
    /// Bound on `most` that follows from earlier queries that the work limit ended, m. Infinite for
    /// a body that touches nothing.
    limit: f64,
    /// Distance that the body may move before it can touch anything that this tick's query did not
    /// examine, m.
    clear: f64,
    /// The same for one of the other bodies, which a plane separates from this body. The other
    /// bodies have a part in `clear`.
    apart: Option<(f64, PlaneClearance)>,
    /// Bound on the motion in the next step of a body that was held, m. Otherwise infinite.
    released: f64,
    /// Number of other bodies that are near.
    others: u32,
    /// True if the body is in contact.
    touches: bool,
}

/// Bounds on the motion of a body in one step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MostMotion {
    /// Bound on the motion of each point, m.
    pub(super) travel: f64,
    /// Bound on the turn, rad.
    pub(super) turn: f64,
}

impl Reach {
    /// Returns the largest distance of a point of the body from its centre of mass, m.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the bound for `body` at rest. Contacts push below a separation of `contact_offset`
    /// (m). All bodies that may be nearer than the bound plus `spare` (m) are near.
    pub(super) fn new(body: &Body, contact_offset: f64, spare: f64) -> Self {
        Self::around(Extent::of(body), contact_offset, spare)
    }

    fn around(extent: Extent, contact_offset: f64, spare: f64) -> Self {
        let radius = extent.corners().map(DVec3::length).fold(0.0, f64::max);
        let most = REACH_LEAST * contact_offset;
        Self {
            extent,
            rotation: DQuat::IDENTITY,
            radius,
            contact_offset,
            spare,
            most,
            turning: 0.0,
            limit: f64::INFINITY,
            clear: f64::INFINITY,
            apart: None,
            released: f64::INFINITY,
            others: 0,
            touches: false,
        }
    }

    /// Sets the contact offset (m).
    pub(super) fn set_contact_offset(&mut self, contact_offset: f64) {
        self.contact_offset = contact_offset;
        self.most = self.most.max(REACH_LEAST * contact_offset);
    }

    /// Returns the bounds on the body's motion in the next step.
    pub(super) fn most(&self) -> MostMotion {
        MostMotion { travel: self.most, turn: self.turn() }
    }

    /// Returns to the bounds for a body at rest.
    pub(super) fn reset(&mut self) {
        *self = Self::around(self.extent, self.contact_offset, self.spare);
    }

    /// Starts a tick of a body that is turned by `rotation` (world). Until [`Self::see`] is called,
    /// everything counts as examined.
    pub(super) fn begin(&mut self, rotation: DQuat) {
        self.rotation = rotation;
        self.clear = f64::INFINITY;
        self.apart = None;
        self.others = 0;
        self.touches = false;
    }

    /// Sets what a query of this tick did not examine.
    pub(super) fn see(&mut self, clearance: &Clearance) {
        let all = clearance.all.max(0.0);
        self.others += 1;
        match clearance.plane {
            Some(plane) if self.apart.is_none() => self.apart = Some((all, plane)),
            _ => self.clear = self.clear.min(all),
        }
    }

    /// Allows a slow motion of a body in contact, even if the query did not examine everything.
    pub(super) fn touch(&mut self) {
        self.touches = true;
    }

    /// Returns the allowed fraction (at most 1) of a step of `h` seconds with `twist`. Within it,
    /// the body touches only contacts that the query has found.
    pub(super) fn share(&self, twist: &Twist, h: f64) -> f64 {
        let creep = if self.touches { REACH_CREEP * self.contact_offset } else { 0.0 };
        let travel = self.travel(twist, h);
        let within = |most: f64| part_of(travel, most);
        let turn = part_of(twist.angular.length() * h, self.turn());
        let all = turn.min(within(self.most.min(self.clear.max(creep)).min(self.released)));
        let Some((clear, plane)) = self.apart else { return all };
        let from_plane = part_of(self.nearer(&plane, twist, h), plane.clear.max(0.0));
        match self.others {
            // There is nothing else near that the body could touch.
            1 => {
                let freed = from_plane.min(within(self.released.min(self.most + self.spare)));
                all.min(within(clear.max(creep))).max(freed)
            }
            _ => all.min(within(clear.max(creep)).max(from_plane)),
        }
    }

    /// Updates the bounds after a motion with `twist` for `h` seconds. `gain` (m) is given if the
    /// step was cut short: if that follows from a query that the work limit ended, the motion may
    /// grow by so much in the next step.
    pub(super) fn follow(&mut self, twist: &Twist, h: f64, gain: Option<f64>) {
        let is_held = self.clear.min(self.limit).min(self.released) < f64::INFINITY || self.apart.is_some();
        let gain = gain.filter(|_| is_held).unwrap_or(f64::INFINITY);
        self.released = self.travel(twist, h) + gain;
        let clear = match self.apart {
            Some((clear, plane)) if self.nearer(&plane, twist, h) > 0.0 => clear.min(self.clear),
            _ => self.clear,
        };
        self.limit = match self.touches {
            false => f64::INFINITY,
            true if clear < self.most => (REACH_CUT * self.most).max(clear),
            true => REACH_RECOVERY * self.limit,
        };
        let least = REACH_LEAST * self.contact_offset;
        let needed = (REACH_GROWTH * self.travel(twist, h)).max(REACH_FADE * self.most);
        self.most = needed.min(self.limit).min(TOOL_FASTEST * h).max(least);
        let turning = (REACH_GROWTH * twist.angular.length() * h).max(REACH_FADE * self.turning);
        self.turning = turning.min(TOOL_FASTEST * h / self.radius);
    }

    /// Returns a bound on the turn in the next step, rad. All points may move by [`Self::most`], so
    /// a body that hits something at its side may begin to turn as fast.
    fn turn(&self) -> f64 {
        self.turning.max(self.most / self.radius)
    }

    /// Returns a bound on the motion of all points of the body in `h` seconds with `twist`, m.
    pub(super) fn travel(&self, twist: &Twist, h: f64) -> f64 {
        self.extent.speed(&self.along_body(twist)) * h
    }

    /// Returns a bound on the motion of all points of the body towards `plane` in `h` seconds with
    /// `twist`, m. Negative if all points move away.
    fn nearer(&self, plane: &PlaneClearance, twist: &Twist, h: f64) -> f64 {
        let towards = self.rotation.inverse() * -plane.away;
        self.extent.speed_along(towards, &self.along_body(twist)) * h
    }

    /// Returns a twist in the world along the axes of the body.
    fn along_body(&self, twist: &Twist) -> Twist {
        let inverse = self.rotation.inverse();
        Twist { angular: inverse * twist.angular, linear: inverse * twist.linear }
    }
}

/// Returns the fraction of a motion that is at most `most`.
fn part_of(motion: f64, most: f64) -> f64 {
    if motion > most { most / motion } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFFSET: f64 = 1e-4;

    /// Does a step of a body that tries to move by `travel` (m). Its query examined everything up
    /// to `clear` (m).
    fn step(reach: &mut Reach, touches: bool, clear: f64, travel: f64) {
        reach.begin(DQuat::IDENTITY);
        reach.see(&Clearance { all: clear, plane: None });
        if touches {
            reach.touch();
        }
        let twist = Twist { angular: DVec3::ZERO, linear: DVec3::X * travel };
        let allowed = Twist { linear: twist.linear * reach.share(&twist, 1.0), ..twist };
        reach.follow(&allowed, 1.0, None);
    }

    /// Returns the bound for a body that has moved fast for some steps.
    fn moving() -> Reach {
        let mut reach = Reach::around(cube(), OFFSET, 0.1);
        for _ in 0..4 {
            step(&mut reach, true, f64::INFINITY, 1e-3);
        }
        reach
    }

    /// A plane below the body, which the body may approach by `clear` (m).
    fn plane(clear: f64) -> Clearance {
        Clearance { all: 0.0, plane: Some(PlaneClearance { away: DVec3::Z, clear }) }
    }

    /// A box of 0.2 m.
    fn cube() -> Extent {
        Extent { center: DVec3::ZERO, half_edges: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 0.1 * axis) }
    }

    fn shift(linear: DVec3) -> Twist {
        Twist { angular: DVec3::ZERO, linear }
    }

    #[test]
    fn motion_is_that_of_the_fastest_corner() {
        // A pin of 2 × 2 × 40 mm that is turned by 90° about y, so that it lies along x.
        let pin = Extent { center: DVec3::ZERO, half_edges: [DVec3::X * 1e-3, DVec3::Y * 1e-3, DVec3::Z * 2e-2] };
        let mut reach = Reach::around(pin, OFFSET, 0.1);
        reach.begin(DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2));
        let [spin, swing] =
            [DVec3::X, DVec3::Z].map(|axis| reach.travel(&Twist { angular: axis, linear: DVec3::ZERO }, 1.0));
        assert!((spin - 2f64.sqrt() * 1e-3).abs() < 1e-12 && (swing - 20.025e-3).abs() < 1e-6, "{spin} {swing}");
        // A spin looks less far ahead than a swing, and may go on.
        let twist = Twist { angular: DVec3::X, linear: DVec3::ZERO };
        reach.follow(&twist, 1.0, None);
        assert!(reach.most().turn >= 2.0 && reach.most().travel < 3e-3, "{:?}", reach.most());
        assert_eq!(reach.share(&twist, 1.0), 1.0);
        reach.reset();
        assert!(reach.most().travel <= REACH_LEAST * OFFSET && reach.share(&twist, 1.0) < 0.1, "{:?}", reach.most());
    }

    #[test]
    fn body_may_part_from_a_plane_and_slide_along_it() {
        let mut reach = Reach::around(cube(), OFFSET, 0.2);
        reach.begin(DQuat::IDENTITY);
        reach.see(&plane(2e-3));
        let share = |reach: &Reach, twist| reach.share(&twist, 1.0);
        assert_eq!(share(&reach, shift(DVec3::new(0.1, 0.0, 0.05))), 1.0);
        assert_eq!(share(&reach, shift(DVec3::new(0.1, 0.0, -2e-3))), 1.0);
        assert_eq!(share(&reach, shift(DVec3::new(0.1, 0.0, -4e-3))), 0.5);
        // A turn about y moves one side of the box down by a tenth of the angle. If the body turns
        // about this side, the side stays where it is.
        let turn = Twist { angular: DVec3::Y * 0.04, linear: DVec3::ZERO };
        assert!((share(&reach, turn) - 0.5).abs() < 1e-12);
        assert_eq!(share(&reach, Twist { linear: DVec3::Z * 4e-3, ..turn }), 1.0);
        // Another body may be on any side.
        reach.see(&Clearance { all: 0.0, plane: None });
        assert_eq!(share(&reach, shift(DVec3::Z)), 0.0);
    }

    #[test]
    fn body_that_was_held_moves_on_gradually() {
        let mut reach = moving();
        let mut moves = Vec::new();
        for k in 0..6 {
            reach.begin(DQuat::IDENTITY);
            reach.see(&Clearance { all: if k == 0 { 0.0 } else { f64::INFINITY }, plane: None });
            let twist = shift(DVec3::X * 1e-3);
            let share = reach.share(&twist, 1.0);
            moves.push(share * 1e-3);
            reach.follow(&(twist * share), 1.0, (share < 1.0).then_some(3e-4));
        }
        let expected = [0.0, 3e-4, 6e-4, 9e-4, 1e-3, 1e-3];
        let fits = moves.iter().zip(expected).all(|(moved, expected)| (moved - expected).abs() < 1e-12);
        assert!(fits, "{moves:?}");
    }

    #[test]
    fn body_in_contact_looks_less_far_ahead_after_a_query_that_was_cut() {
        let mut reach = moving();
        let before = reach.most().travel;
        assert!(before > 1e-3, "{before}");
        step(&mut reach, true, 0.0, 1e-3);
        let cut = reach.most().travel;
        assert_eq!(cut, REACH_CUT * before);
        step(&mut reach, true, f64::INFINITY, 1e-3);
        let next = reach.most().travel;
        assert!((next - REACH_RECOVERY * cut).abs() < 1e-15, "{next}");
        // The body keeps the distance that the query did examine, and a least distance.
        step(&mut reach, true, 0.9 * next, 1e-3);
        assert_eq!(reach.most().travel, 0.9 * next);
        for _ in 0..20 {
            step(&mut reach, true, 0.0, 1e-3);
        }
        assert_eq!(reach.most().travel, REACH_LEAST * OFFSET);
    }

    #[test]
    fn body_in_the_air_keeps_its_speed_after_a_query_that_was_cut() {
        let mut reach = moving();
        let before = reach.most().travel;
        step(&mut reach, false, 0.0, 1e-3);
        assert!(reach.most().travel >= REACH_FADE * before);
    }
}
