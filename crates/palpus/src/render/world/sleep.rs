//! Free bodies that lie still *sleep*: no step moves them, and the contacts between two bodies that
//! do not move are not computed. So the cost of a step follows the bodies that move.
//!
//! * A body is *still* while no point of it has moved farther than [`SLEEP_MOTION`] for
//!   [`SLEEP_AFTER`].
//! * A group of touching bodies falls asleep if all of them are still, one of them presses on a
//!   fixed body (or a driven body that does not move), and none of them touches a tool or a driven
//!   body that moves. Bodies that press on no fixed body keep their momentum, and may drift slowly.
//! * A body wakes in the step in which a query finds a contact with a body that is awake, before a
//!   force acts. All sleeping bodies that touch it wake, too. The query looks as far ahead as if the
//!   body were awake. So the contact feels the same as with a body that never slept.
//! * Every body wakes if the host moves an object, or changes gravity or settings.

use super::World;
use super::object::{Role, WorldBody};
use super::stillness::Stillness;
use crate::algebra::tolerance::{SLEEP_AFTER, SLEEP_MOTION};
use crate::algebra::{Twist, Wrench};

impl WorldBody {
    /// Returns true for a free body that sleeps.
    pub(super) fn is_asleep(&self) -> bool {
        matches!(&self.role, Role::Free(free) if free.stillness.is_asleep)
    }

    /// Returns true if this body may change its contacts in this step.
    pub(super) fn is_active(&self) -> bool {
        match &self.role {
            Role::Tool(_) => self.there,
            Role::Free(free) => !free.stillness.is_asleep,
            Role::Driven(_) => self.twist != Twist::default() || self.last != Some(self.pose),
            Role::Fixed => false,
        }
    }

    fn fall_asleep(&mut self) {
        let Role::Free(free) = &mut self.role else { return };
        free.momentum = Wrench::ZERO;
        free.stillness.is_asleep = true;
        self.part.twist = Twist::default();
    }

    /// Ends the sleep of a body. Returns true if it slept.
    pub(super) fn wake(&mut self) -> bool {
        match &mut self.role {
            Role::Free(free) if free.stillness.is_asleep => {
                free.stillness = Stillness::NONE;
                true
            }
            _ => false,
        }
    }
}

impl World {
    /// Wakes all bodies. None of them is still for the next [`SLEEP_AFTER`].
    pub(super) fn wake_all(&mut self) {
        for thing in &mut self.things {
            if let Role::Free(free) = &mut thing.role {
                free.stillness = Stillness::NONE;
            }
        }
    }

    /// Wakes the sleeping bodies that have a contact with an active body, and those that touch a
    /// woken body. They take part in this step of `h` s. Returns true if a body woke.
    pub(super) fn wake_touched(&mut self, h: f64) -> bool {
        let mut any = false;
        let mut more = self.things.iter().any(WorldBody::is_asleep);
        while more {
            more = false;
            for pair in self.near.iter().map(|&k| &self.pairs[k as usize]) {
                let is_active = pair.bodies.iter().any(|&i| self.things[i].is_active());
                if pair.contacts.is_empty() || !is_active {
                    continue;
                }
                for thing in pair.bodies {
                    if self.things[thing].wake() {
                        self.things[thing].part.is_moved = h > 0.0;
                        more = true;
                    }
                }
            }
            any |= more;
        }
        any
    }

    /// Lets the groups that are still fall asleep at the end of a step of `h` s.
    pub(super) fn fall_asleep(&mut self, h: f64) {
        if h > 0.0 {
            self.look_for_still_bodies(h);
            let mut first = 0;
            while first < self.islands.len() {
                let end = self.islands.end(first);
                if (first..end).all(|k| self.is_still(self.islands.body(k))) && self.lies(self.islands.body(first)) {
                    (first..end).for_each(|k| self.things[self.islands.body(k)].fall_asleep());
                }
                first = end;
            }
        }
        self.counters.asleep = self.things.iter().filter(|thing| thing.is_asleep()).count() as u32;
    }

    fn look_for_still_bodies(&mut self, h: f64) {
        let most = SLEEP_MOTION * self.settings.contact_offset();
        for thing in &mut self.things {
            let WorldBody { role: Role::Free(free), pose, body, .. } = thing else { continue };
            if !free.stillness.is_asleep {
                let at = (pose.point(body.mass().center_of_mass), pose.rotation);
                free.stillness.look(at, free.reach.radius(), most, h);
            }
        }
    }

    /// Returns true for a free body that has been still for long enough.
    fn is_still(&self, i: usize) -> bool {
        matches!(&self.things[i].role, Role::Free(free) if free.stillness.since() >= SLEEP_AFTER)
    }

    /// Returns true if the group of body `i` presses on a fixed body or on a driven body that does
    /// not move, and touches no tool and no driven body that moves.
    fn lies(&self, i: usize) -> bool {
        let group = self.islands.group(i);
        let mut is_held = false;
        for pair in self.near.iter().map(|&k| &self.pairs[k as usize]).filter(|pair| pair.group == group) {
            for other in pair.bodies.map(|i| &self.things[i]) {
                match other.role {
                    Role::Free(_) => {}
                    Role::Tool(_) => return false,
                    Role::Fixed | Role::Driven(_) if other.is_active() => return false,
                    Role::Fixed | Role::Driven(_) => is_held |= pair.is_pressing(),
                }
            }
        }
        is_held
    }
}
