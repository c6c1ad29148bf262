//! One step of a world: computes the wrenches of its tools from their states. Outline in `mod.rs`.

use glam::DVec3;

use super::held::Held;
use super::object::Role;
use super::pair::{LookAhead, Pair, mirrored, relative};
use super::{NONE, World, WorldCounters};
use crate::algebra::tolerance::BOX_SPARE;
use crate::algebra::{Clock, Quota, Twist, Work};
use crate::render::ProbeState;
use crate::render::pacer::WorkLimit;
use crate::render::reach::MostMotion;
use crate::render::tool::radius;
use crate::render::transient::approach;

impl World {
    /// Runs one step of the loop: computes the wrenches of all tools from their probes' states. The
    /// states are in the order in which the tools were added. `dt` is the time since the last step,
    /// s.
    ///
    /// With a running clock, as [`WallClock`](crate::algebra::WallClock), the step keeps to the
    /// time budget of its settings ([`WorkLimit`]), and its tick has the time of each stage.
    ///
    /// A tool with an invalid pose has a zero wrench and no contacts.
    pub fn step(&mut self, probes: &[ProbeState], dt: f64, clock: &impl Clock) {
        let begin = clock.now_ns();
        let time_budget = self.time_budget().filter(|_| clock.is_running());
        self.limit_work(time_budget);
        self.begin(probes, dt);
        self.find_near(dt);
        let work = self.query(dt, clock);
        let queried = clock.now_ns();
        self.force(dt);
        self.show();
        let forced = clock.now_ns();
        self.settle(dt);
        self.fall_asleep(length(dt));
        self.ring(dt);
        let coupled = clock.now_ns();
        self.tools.iter_mut().filter(|held| self.things[held.thing].there).for_each(Held::saturate);
        let saturated = clock.now_ns();
        for held in &mut self.tools {
            let times = &mut held.tick.times;
            times.force = forced - queried;
            times.couple = coupled - forced;
            times.saturate = saturated - coupled;
            times.total = saturated - begin;
        }
        if let Some(target) = time_budget {
            self.pacer.learn(target, work, queried - begin, saturated - queried);
        }
        self.steps += 1;
    }

    /// Returns the least time budget of the tools, ns.
    fn time_budget(&self) -> Option<u64> {
        self.tools.iter().filter_map(|held| held.settings.time_budget).min()
    }

    /// Sets the allowed work of a step. `time_budget` is the time that it should take at most, ns.
    fn limit_work(&mut self, time_budget: Option<u64>) {
        self.allowed = match self.limit {
            WorkLimit::TimeBudget => time_budget.map(|target| self.pacer.allowance(target)),
            WorkLimit::Units(units) => Some(units),
            WorkLimit::Unlimited => None,
        };
    }

    /// Runs step 1 of the module's description.
    fn begin(&mut self, probes: &[ProbeState], dt: f64) {
        self.counters = WorldCounters::default();
        let h = length(dt);
        for thing in &mut self.things {
            let last = thing.there.then_some(thing.pose);
            thing.last = last.filter(|_| self.steps > 0);
            match &mut thing.role {
                Role::Fixed => thing.part.begin(false),
                Role::Driven(driven) => {
                    thing.part.begin(false);
                    let (pose, twist) = driven.advance(h);
                    self.counters.overdue += u32::from(driven.is_overdue());
                    let to_center = pose.vector(thing.body.mass().center_of_mass);
                    thing.set_pose(pose);
                    thing.twist = Twist { angular: twist.angular, linear: twist.at(to_center) };
                }
                Role::Free(free) => {
                    free.reach.begin(thing.pose.rotation);
                    thing.part.begin(h > 0.0 && !free.stillness.is_asleep);
                    thing.set_pose(thing.pose);
                }
                Role::Tool(k) => {
                    let held = &mut self.tools[*k];
                    let begun = held.begin(self.steps, probes.get(*k), thing.body.mass().center_of_mass, dt);
                    thing.there = begun.is_some();
                    thing.part.begin(thing.there && held.settings.coupling.is_some() && h > 0.0);
                    match begun {
                        Some((pose, center, twist)) => {
                            (thing.pose, thing.center, thing.twist) = (pose, center, twist);
                        }
                        None => held.clear(),
                    }
                }
            }
        }
        let is_gone = |held: &Held| !self.things[held.thing].there;
        if self.tools.iter().any(is_gone) {
            for pair in self.pairs.iter_mut().filter(|pair| pair.bodies.iter().any(|&i| !self.things[i].there)) {
                pair.clear();
            }
        }
    }

    /// Returns bounds on the motion of body `i` in this step; `None` if no bound is known.
    fn reach(&self, i: usize, dt: f64) -> Option<MostMotion> {
        let thing = &self.things[i];
        match &thing.role {
            Role::Fixed => Some(MostMotion::default()),
            Role::Free(free) => Some(free.reach.most()),
            Role::Tool(k) => {
                let held = &self.tools[*k];
                held.settings.coupling.map(|_| held.tool.reach.most())
            }
            Role::Driven(_) => {
                let Twist { angular, linear } = thing.twist;
                let still = angular == DVec3::ZERO && linear == DVec3::ZERO;
                let radius = if still { 0.0 } else { radius(&thing.body) };
                let turn = angular.length();
                Some(MostMotion { travel: (linear.length() + turn * radius) * dt, turn: turn * dt })
            }
        }
    }

    /// Returns which contacts a pair's query searches: those within the contact offset plus the
    /// largest motion of both bodies in this step, if these motions are known. Otherwise no step
    /// moves the bodies, and the query searches within the contact tolerance.
    fn looked_ahead(&self, pair: &Pair, dt: f64) -> LookAhead {
        let settings = pair.settings();
        match pair.bodies.map(|i| self.reach(i, dt)) {
            [Some(one), Some(other)] => {
                LookAhead { within: settings.contact_offset() + one.travel + other.travel, turn: one.turn + other.turn }
            }
            _ => LookAhead { within: settings.contact_tolerance, turn: 0.0 },
        }
    }

    /// Runs step 2 of the module's description.
    fn find_near(&mut self, dt: f64) {
        for i in 0..self.things.len() {
            let thing = &self.things[i];
            if matches!(thing.role, Role::Fixed) && self.boxed_with == self.margin {
                continue;
            }
            // The hand may be fast and the work limit small. So a tool's pairs are queried as soon
            // as the distance is below the tool's size. Then cached results exist when the bodies
            // touch. The tool's bound relies on this distance, too.
            let ahead = if matches!(thing.role, Role::Tool(_)) { radius(&thing.body) } else { 0.0 };
            let margin = self.reach(i, dt).unwrap_or_default().travel + ahead + self.margin;
            if !thing.there {
                self.broad.take_away(i);
            } else if self.boxed_with != self.margin || !self.broad.holds(i, &thing.pose, thing.radius, margin) {
                let spare = BOX_SPARE * if ahead > 0.0 { ahead } else { self.margin };
                self.broad.put(i, &thing.body.mesh().bounds(), &thing.pose, margin + spare);
            }
        }
        self.boxed_with = self.margin;
        if !self.broad.take_stale() {
            self.counters.pairs = self.near.len() as u32;
            return;
        }
        std::mem::swap(&mut self.near, &mut self.were_near);
        self.near.clear();
        let (near, table) = (&mut self.near, &self.table);
        self.broad.each_pair(|i, j| {
            let (low, high) = (i.min(j), i.max(j));
            let pair = table[high * (high - 1) / 2 + low];
            if pair != NONE {
                near.push(pair);
            }
        });
        near.sort_unstable();
        for &k in self.were_near.iter().filter(|k| self.near.binary_search(k).is_err()) {
            self.pairs[k as usize].part();
        }
        self.counters.pairs = self.near.len() as u32;
    }

    /// Queries contacts and depths of all near pairs of which a body may move. A contact wakes
    /// sleeping bodies, which have other pairs. Returns the work of all queries.
    fn query(&mut self, dt: f64, clock: &impl Clock) -> u64 {
        let work = Work::of(self.allowed);
        loop {
            self.query_active(&work, dt, clock);
            if !self.wake_touched(length(dt)) {
                break;
            }
        }
        for held in &mut self.tools {
            (held.tick.work, held.tick.work_allowed) = (work.spent(), self.allowed);
        }
        work.spent()
    }

    /// Queries the near pairs of active bodies that were not yet queried in this step. Pairs whose
    /// last query reached the work limit come last, and share what the others leave of the limit.
    fn query_active(&mut self, work: &Work, dt: f64, clock: &impl Clock) {
        let mut left = self.near.iter().filter(|&&k| self.is_due(k as usize)).count() as u64;
        for were_cut in [false, true] {
            for n in 0..self.near.len() {
                let k = self.near[n] as usize;
                if self.is_due(k) && self.pairs[k].is_cut() == were_cut {
                    let quota = work.share(left);
                    left -= 1;
                    self.query_pair(k, &quota, dt, clock);
                }
            }
        }
    }

    /// Queries pair `k`.
    fn query_pair(&mut self, k: usize, quota: &Quota<'_>, dt: f64, clock: &impl Clock) {
        let begin = self.steps.checked_sub(1);
        let looked_ahead = self.looked_ahead(&self.pairs[k], dt);
        let pair = &mut self.pairs[k];
        let [a, b] = pair.bodies;
        let (things, tools) = (&mut self.things, &mut self.tools);
        if pair.looked_at.is_some()
            && pair.looked_at != begin
            && let Some((last_a, last_b)) = things[a].last.zip(things[b].last)
        {
            pair.came_from(&relative(&last_a, &last_b));
        }
        pair.looked_at = Some(self.steps);
        pair.query(&things[a].place(), &things[b].place(), looked_ahead, quota, clock);
        if [a, b].iter().any(|&i| matches!(things[i].role, Role::Free(_))) {
            pair.ease_start(length(dt));
        }
        // If both bodies move, each may move half of the distance.
        let both = [a, b].iter().all(|&i| things[i].rank() < 2);
        let part = if both { 0.5 } else { 1.0 };
        let clear = [0, 1].map(|of| pair.clearance(of, &things[b].pose).times(part));
        for (i, clear) in [a, b].into_iter().zip(clear) {
            match &mut things[i].role {
                Role::Tool(k) => {
                    let Held { tool, tick, .. } = &mut tools[*k];
                    tool.reach.see(&clear);
                    tick.unseen_separation = tick.unseen_separation.min(pair.unseen_separation());
                    tick.counters.query += pair.counters;
                    tick.times.query += pair.counters.query_ns;
                    tick.times.depth += pair.counters.depth_ns;
                }
                Role::Free(free) => free.reach.see(&clear),
                Role::Driven(_) | Role::Fixed => {}
            }
        }
    }

    /// Returns true if pair `k` was not yet queried in this step, and one of its bodies is active.
    fn is_due(&self, k: usize) -> bool {
        let pair = &self.pairs[k];
        pair.looked_at != Some(self.steps) && pair.bodies.iter().any(|&i| self.things[i].is_active())
    }

    /// Computes the forces of all near pairs.
    fn force(&mut self, dt: f64) {
        for k in self.near.iter().map(|&k| k as usize) {
            let pair = &mut self.pairs[k];
            let [a, b] = pair.bodies;
            let implicit = self.things[a].part.is_moved || self.things[b].part.is_moved;
            // The forces between bodies that sleep stay as they were.
            if pair.looked_at == Some(self.steps) {
                pair.force(&self.things[a].place(), &self.things[b].place(), dt, implicit);
            }
            if pair.is_touching() {
                self.counters.touching += 1;
                self.things[a].part.is_touched = true;
                self.things[b].part.is_touched = true;
            }
        }
    }

    /// Writes each tool's contacts and forces to its tick.
    fn show(&mut self) {
        for held in &mut self.tools {
            for pair in self.near.iter().map(|&k| &self.pairs[k as usize]) {
                if !pair.bodies.contains(&held.thing) || pair.contacts.is_empty() {
                    continue;
                }
                let turned = pair.bodies[1] == held.thing;
                let partner = &self.things[pair.bodies[usize::from(!turned)]];
                let tick = &mut held.tick;
                let own = tick.contacts.len();
                let fits = own + pair.contacts.len() <= held.room;
                if fits {
                    tick.contacts
                        .extend(pair.contacts.iter().map(|contact| if turned { mirrored(contact) } else { *contact }));
                    tick.forces.append(&pair.forces, own, turned);
                } else {
                    tick.forces.append_net(&pair.forces, turned);
                }
                let net = &pair.forces.net;
                let on_tool = if turned { net.on_b } else { net.on_a };
                match partner.role {
                    Role::Tool(_) => {
                        tick.from_other = tick.from_other + on_tool;
                        // The tick's list of contacts contains these contacts too.
                        tick.contacts_between += if fits { pair.contacts.len() as u32 } else { 0 };
                    }
                    Role::Free(_) | Role::Driven(_) => tick.from_objects = tick.from_objects + on_tool,
                    Role::Fixed => {}
                }
                tick.counters.linkage += pair.forces.linkage;
                tick.counters.friction += pair.forces.adhesion;
                tick.counters.cancelled_normals += pair.forces.cancelled_normals;
            }
        }
    }

    /// Starts the vibrations of this step's impacts.
    fn ring(&mut self, dt: f64) {
        for held in self.tools.iter_mut().filter(|held| held.settings.material.is_some() && length(dt) > 0.0) {
            let grip = held.tick.probe.pose_ba.point(held.settings.grip_a);
            let hand = held.tick.probe.twist;
            for pair in self.near.iter().map(|&k| &self.pairs[k as usize]) {
                let Some(place) = pair.bodies.iter().position(|&i| i == held.thing) else { continue };
                let [a, other] = [pair.bodies[0], pair.bodies[1 - place]].map(|i| &self.things[i]);
                let implicit = pair.bodies.iter().any(|&i| self.things[i].part.is_moved);
                let side = if place == 0 { 1.0 } else { -1.0 };
                pair.each_pressing(a.center, implicit, |normal, point| {
                    let normal = normal * side;
                    let moves = other.twist.at(point - other.center);
                    held.transient.press(normal, approach(&hand, grip, point, normal, moves));
                });
            }
            held.ring(dt);
        }
    }
}

/// Returns the length of a step (s) for the time `dt` since the last step; 0 if `dt` is no time in
/// which bodies move.
fn length(dt: f64) -> f64 {
    if dt > 0.0 && dt.is_finite() { dt } else { 0.0 }
}
