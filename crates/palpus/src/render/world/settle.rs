//! The implicit step of a world, which moves each group of touching bodies together. Outline in
//! `mod.rs`, step 4.

use std::ops::Range;

use super::free::Free;
use super::held::Held;
use super::object::{Role, WorldBody};
use super::pair::{Pair, relative_twist};
use super::stillness::Stillness;
use super::{NONE, World};
use crate::algebra::tolerance::COUPLING_ROUNDS;
use crate::algebra::{SpatialMatrix, Twist, Wrench};
use crate::render::ToolCounters;

impl World {
    /// Runs step 4 of `mod.rs` with the step length `h` (s).
    pub(super) fn settle(&mut self, h: f64) {
        self.begin_step(h);
        let mut first = 0;
        while first < self.islands.len() {
            let end = self.islands.end(first);
            self.counters.islands += 1;
            self.counters.largest = self.counters.largest.max((end - first) as u32);
            let mut counters = ToolCounters::default();
            if self.solve(first..end, h, &mut counters) {
                self.end_step(first..end, h, counters);
            } else {
                self.reset(first..end);
            }
            first = end;
        }
        for held in &mut self.tools {
            let thing = &self.things[held.thing];
            if thing.there && held.settings.coupling.is_none() {
                held.feel(&thing.pose, thing.center);
                held.book(&thing.pose, thing.center);
            }
        }
    }

    /// Finds the groups that move together, and sets the matrix and right-hand side of each body
    /// without contacts.
    fn begin_step(&mut self, h: f64) {
        self.islands.begin();
        for &k in &self.near {
            let pair = &self.pairs[k as usize];
            let [a, b] = pair.bodies;
            if pair.is_touching() && self.things[a].part.is_moved && self.things[b].part.is_moved {
                self.islands.join(a, b);
            }
        }
        self.islands.sort(|i| self.things[i].part.is_moved);
        for &k in &self.near {
            let pair = &mut self.pairs[k as usize];
            let moved = pair.bodies.iter().find(|&&i| self.things[i].part.is_moved).filter(|_| pair.is_touching());
            pair.group = moved.map_or(NONE, |&i| self.islands.group(i));
        }
        for thing in self.things.iter_mut().filter(|thing| thing.part.is_moved) {
            let touched = thing.part.is_touched;
            match &mut thing.role {
                Role::Tool(k) => {
                    let Held { tool, tick, .. } = &mut self.tools[*k];
                    if touched {
                        tool.reach.touch();
                    }
                    thing.part.alone = tool.begin(&tick.probe, !touched, h);
                }
                Role::Free(free) => {
                    if touched {
                        free.reach.touch();
                    }
                    thing.part.alone = free.begin(&thing.pose, self.gravity, h);
                }
                Role::Driven(_) | Role::Fixed => {}
            }
        }
    }

    /// Computes the velocities of the group `of` at the end of the step. Returns false if no finite
    /// solution exists.
    fn solve(&mut self, of: Range<usize>, h: f64, counters: &mut ToolCounters) -> bool {
        for (slot, k) in of.clone().enumerate() {
            self.things[self.islands.body(k)].part.slot = slot;
        }
        let group = self.islands.group(self.islands.body(of.start));
        self.limits_follow = true;
        // A contact that slides in one step mostly slides in the next step. A start with sticking
        // contacts would need many rounds.
        self.predict(group, h, |pair| pair.settings().friction.is_some());
        for k in of.clone() {
            let part = &mut self.things[self.islands.body(k)].part;
            part.guess = part.twist;
        }
        for round in 1..=COUPLING_ROUNDS {
            if !self.solve_once(of.clone(), group, h) {
                return false;
            }
            counters.rounds = round;
            if !self.predict(group, h, |_| true) {
                return true;
            }
            if self.search(of.clone(), group, h) && round == COUPLING_ROUNDS {
                // No system has this solution. Its impulses are the predicted ones.
                self.predict(group, h, |_| true);
            }
        }
        counters.unsettled = 1;
        self.counters.unsettled += 1;
        true
    }

    /// Predicts the contact forces of the `chosen` pairs of a group for the present twists. Returns
    /// true if the set of pressing contacts or a friction force has changed.
    pub(super) fn predict(&mut self, group: u32, h: f64, chosen: impl Fn(&Pair) -> bool) -> bool {
        let mut news = false;
        for &k in &self.near {
            let pair = &mut self.pairs[k as usize];
            if pair.group == group && chosen(pair) {
                news |= pair.revise(&relative_to(&self.things, pair.bodies), h, self.limits_follow);
            }
        }
        news
    }

    /// Solves the system of a group with the present prediction of contacts. Returns false if no
    /// solution exists.
    fn solve_once(&mut self, of: Range<usize>, group: u32, h: f64) -> bool {
        let Self { things, islands, pairs, near, system, .. } = self;
        for k in of.clone() {
            let part = &mut things[islands.body(k)].part;
            part.system = part.alone;
        }
        let is_alone = of.len() == 1;
        system.begin(if is_alone { 0 } else { of.len() });
        for pair in near.iter().map(|&k| &pairs[k as usize]).filter(|pair| pair.group == group) {
            let [a, b] = pair.bodies;
            let moved = [a, b].map(|i| things[i].part.is_moved);
            if moved == [true, false] && things[b].twist == Twist::default() {
                let (own, load) = &mut things[a].part.system;
                pair.add_to(own, load, h);
                continue;
            }
            let (mut between, mut given) = (SpatialMatrix::ZERO, Wrench::ZERO);
            pair.add_to(&mut between, &mut given, h);
            let shift = things[a].center - things[b].center;
            // Terms with known velocities are on the right-hand side.
            let still = |i: usize| if things[i].part.is_moved { Twist::default() } else { things[i].twist };
            given = given + -between.times(&relative_twist(&still(a), &still(b), shift));
            let on_b = between.to_wrench_at(shift);
            if moved[0] {
                let (own, load) = &mut things[a].part.system;
                (*own, *load) = (*own + between, *load + given);
            }
            if moved[1] {
                let (own, load) = &mut things[b].part.system;
                (*own, *load) = (*own + on_b.from_twist_at(shift), *load + -given.about(-shift));
            }
            if moved == [true, true] {
                let [row, column] = [a, b].map(|i| things[i].part.slot);
                system.take(row, column, between.from_twist_at(shift));
                system.take(column, row, on_b);
            }
        }
        if is_alone {
            let part = &mut things[islands.body(of.start)].part;
            let (own, load) = &part.system;
            let solved = own.solve(load);
            part.twist = solved.unwrap_or_default();
            return solved.is_some();
        }
        for (slot, k) in of.clone().enumerate() {
            let (own, load) = things[islands.body(k)].part.system;
            system.set_own(slot, own, load);
        }
        if !system.solve() {
            return false;
        }
        for (slot, k) in of.enumerate() {
            things[islands.body(k)].part.twist = system.twist(slot);
        }
        true
    }

    /// Moves the bodies of a group.
    fn end_step(&mut self, of: Range<usize>, h: f64, mut counters: ToolCounters) {
        let group = self.islands.group(self.islands.body(of.start));
        for &k in &self.near {
            let pair = &self.pairs[k as usize];
            if pair.group != group {
                continue;
            }
            counters.released += pair.released();
            let [a, b] = pair.bodies;
            // Only tools record impulses, and a tool is the first body of a pair.
            let is_booked = matches!(self.things[a].role, Role::Tool(_));
            if !is_booked || matches!(self.things[b].role, Role::Fixed) {
                continue;
            }
            let impulse = pair.impulse(&relative_to(&self.things, [a, b]), h);
            if matches!(self.things[b].role, Role::Tool(_)) {
                let shift = self.things[a].center - self.things[b].center;
                for (i, given) in [(a, impulse), (b, -impulse.about(-shift))] {
                    let part = &mut self.things[i].part;
                    part.from_tools = part.from_tools + given;
                }
            } else {
                let part = &mut self.things[a].part;
                part.from_objects = part.from_objects + impulse;
            }
        }
        // All bodies of a group move the same fraction of the step, so contacts between them stay
        // consistent.
        let reach = |k: usize| {
            let WorldBody { role, part, .. } = &self.things[self.islands.body(k)];
            match role {
                Role::Tool(tool) => self.tools[*tool].tool.reach.share(&part.twist, h),
                Role::Free(free) => free.reach.share(&part.twist, h),
                Role::Driven(_) | Role::Fixed => 1.0,
            }
        };
        let share = of.clone().map(reach).fold(1.0, f64::min);
        counters.bounded = u32::from(share < 1.0);
        self.counters.bounded += counters.bounded;
        for k in of {
            let WorldBody { role, part, pose, center, body, .. } = &mut self.things[self.islands.body(k)];
            let twist = part.twist * share;
            match role {
                Role::Tool(tool) => {
                    let given = [part.from_tools, part.from_objects];
                    self.tools[*tool].end((pose, *center), twist, h, given, counters);
                    part.twist = twist;
                }
                Role::Free(free) => {
                    // With a work limit, a group may be held for many steps. The forces then act for
                    // the same fraction of the step, so the group gains no energy, and the total
                    // momentum is conserved. Without a limit, only a motion that begins suddenly is
                    // cut, for a few steps, and the impulse of an impact stays whole.
                    let before = free.momentum;
                    if free.set_twist(pose, &part.twist) && share < 1.0 && self.allowed.is_some() {
                        free.momentum = before + (free.momentum + -before) * share;
                    }
                    free.reach.follow(&twist, h, None);
                    if share < 1.0 {
                        free.stillness = Stillness::NONE;
                    }
                    *pose = Free::moved(pose, body.mass().center_of_mass, &twist, h);
                }
                Role::Driven(_) | Role::Fixed => {}
            }
        }
    }

    /// Stops the bodies of a group whose step has no solution.
    fn reset(&mut self, of: Range<usize>) {
        self.counters.reset += 1;
        for k in of {
            let WorldBody { role, part, .. } = &mut self.things[self.islands.body(k)];
            part.twist = Twist::default();
            match role {
                Role::Tool(tool) => self.tools[*tool].reset(),
                Role::Free(free) => (free.momentum, free.stillness) = (Wrench::ZERO, Stillness::NONE),
                Role::Driven(_) | Role::Fixed => {}
            }
        }
    }
}

/// Returns the velocity of the first body relative to the second body at the end of the step, about
/// the first body's centre of mass.
pub(super) fn relative_to(things: &[WorldBody], [a, b]: [usize; 2]) -> Twist {
    let [a, b] = [&things[a], &things[b]];
    let known = |thing: &WorldBody| if thing.part.is_moved { thing.part.twist } else { thing.twist };
    relative_twist(&known(a), &known(b), a.center - b.center)
}
