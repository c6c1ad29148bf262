//! Two tools in one scene, each held through a device of its own: both feel the environment, and they feel each other.
//!
//! A turn of both is one step, at one instant:
//!
//! 1. *Query* and *depth*, three times: each tool with the environment, and the tools with each other (once for both).
//! 2. *Force*, three times: every pair of bodies by itself (`between.rs`), so that what the one tool gives the other takes.
//! 3. *Couple*: where the tools do not touch, each as if it were alone, to the bit. Where they do, one implicit step moves both
//!    (`together.rs`); a tool without a coupling is where its device is and moves as that does.
//! 4. *Saturate*: each within its own device's limits.
//!
//! Why one step for both, and not two loops that tell each other where their tools were last? Because of what `together.rs` says at its end.
//! The devices may be as different as they like; the rate of the loop is the same for both.

use std::sync::Arc;

use super::between::{Between, mirrored};
use super::together::{Settled, Shared, Side, settle};
use super::{Limits, Motion, ProbeState, Renderer, Settings, SettingsError, Tick, ToolCounters};
use crate::algebra::{Clock, Pose, Work, Wrench, rotation_between};
use crate::body::Body;

/// Renders the contact of two probes with an environment and with each other. The environment's frame is the scene's.
#[derive(Clone, Debug)]
pub struct Duo {
    tools: [Renderer; 2],
    between: Between,
    /// Of tools without a coupling: the grip's pose in the last step, and what the other tool did there, about it.
    driven: [Option<(Pose, Wrench)>; 2],
    /// Units of work that the queries may do.
    allowed: Option<u64>,
}

/// Of the time for queries each of the three gets its part, and what those before it have left over.
const QUERIES: u64 = 3;

impl Duo {
    /// Two tools of these settings, which may differ; between the two the softer and nearer ones hold, and otherwise the first one's. Fails if a setting cannot be.
    pub fn new(probes: [Arc<Body>; 2], environment: Arc<Body>, settings: [Settings; 2]) -> Result<Self, SettingsError> {
        let between = Between::new([&probes[0], &probes[1]], &settings);
        let [first, second] = probes;
        let mut tools =
            [Renderer::new(first, environment.clone(), settings[0])?, Renderer::new(second, environment, settings[1])?];
        for tool in &mut tools {
            tool.make_room(between.settings().capacity);
        }
        Ok(Self { tools, between, driven: [None; 2], allowed: None })
    }

    /// The same, able to take up shading at this crease angle (rad) later on, by [`Self::set_settings`].
    #[must_use]
    pub fn with_surfaces(mut self, crease_angle: f64) -> Self {
        self.tools = self.tools.map(|tool| tool.with_surfaces(crease_angle));
        self.between.prepare_surfaces(crease_angle);
        self
    }

    /// Goes on with other settings of one tool (0 or 1) from the next step on: see [`Renderer::set_settings`].
    ///
    /// # Errors
    /// With the setting that cannot be; all are then as they were.
    pub fn set_settings(&mut self, tool: usize, settings: &Settings) -> Result<(), SettingsError> {
        self.tools[tool].set_settings(settings)?;
        self.between.set_settings(&[*self.tools[0].settings(), *self.tools[1].settings()]);
        Ok(())
    }

    /// One turn of the loop: what the states of both probes feel like. `dt` is the time since the last step, s.
    ///
    /// A probe whose pose is none feels nothing and is not there for the other one.
    pub fn step(&mut self, probes: &[ProbeState; 2], dt: f64, clock: &impl Clock) -> [&Tick; 2] {
        let begin = clock.now_ns();
        let motions = [0, 1].map(|k| self.tools[k].begin(&probes[k], dt));
        self.query(&motions, clock);
        let queried = clock.now_ns();
        for (tool, motion) in self.tools.iter_mut().zip(&motions) {
            if let Some(motion) = motion {
                tool.force(motion);
            }
        }
        if let [Some(first), Some(second)] = motions {
            let within = self.looked_ahead();
            self.between.force(&[first, second], within);
        }
        let forced = clock.now_ns();
        self.couple(&motions, dt);
        self.book_driven(&motions);
        let coupled = clock.now_ns();
        for (tool, _) in self.tools.iter_mut().zip(&motions).filter(|(_, motion)| motion.is_some()) {
            tool.saturate();
        }
        let saturated = clock.now_ns();
        for tool in &mut self.tools {
            let times = &mut tool.tick_mut().times;
            times.force = forced - queried;
            times.couple = coupled - forced;
            times.saturate = saturated - coupled;
            times.total = saturated - begin;
        }
        self.ticks()
    }

    /// The devices can give no more than `available` from now on: see [`Renderer::set_available`].
    pub fn set_available(&mut self, available: &[Limits; 2]) {
        for (tool, available) in self.tools.iter_mut().zip(available) {
            tool.set_available(available);
        }
    }

    /// The last ticks. What they have in common, and the time of the whole step, is in both.
    pub fn ticks(&self) -> [&Tick; 2] {
        self.tools.each_ref().map(Renderer::tick)
    }

    /// Those of the next step.
    pub fn settings(&self) -> [&Settings; 2] {
        self.tools.each_ref().map(Renderer::settings)
    }

    /// What holds between the two tools.
    pub fn settings_between(&self) -> &Settings {
        self.between.settings()
    }

    /// Both probes.
    pub fn probes(&self) -> [&Body; 2] {
        self.tools.each_ref().map(Renderer::probe)
    }

    /// The environment.
    pub fn environment(&self) -> &Body {
        self.tools[0].environment()
    }

    /// The three queries of the next steps may do about so much work together: see [`Renderer::allow`].
    pub fn allow(&mut self, work: Option<u64>) {
        self.allowed = work;
    }

    /// Forgets the past: the next step is as the first was.
    pub fn clear(&mut self) {
        self.tools.iter_mut().for_each(Renderer::clear);
        self.between.clear();
        self.driven = [None; 2];
    }

    /// Stages 1 and 2 of the paper, for all three pairs of bodies.
    fn query(&mut self, motions: &[Option<Motion>; 2], clock: &impl Clock) {
        let work = Work::of(self.allowed);
        for (k, (tool, motion)) in self.tools.iter_mut().zip(motions).enumerate() {
            match motion {
                Some(motion) => tool.query(&motion.pose_ba, &work.share(QUERIES - k as u64), clock),
                None => tool.clear(),
            }
        }
        let [Some(first), Some(second)] = motions else {
            self.between.clear();
            return;
        };
        let counters = self.between.query(&[*first, *second], self.looked_ahead(), &work.all(), clock);
        for tool in &mut self.tools {
            tool.tool_mut().see_other(self.between.unlooked());
            let tick = tool.tick_mut();
            tick.counters.query += counters;
            tick.times.query += counters.query_ns;
            tick.times.depth += counters.depth_ns;
            tick.unseen_separation = tick.unseen_separation.min(self.between.unseen_separation());
            (tick.work, tick.work_allowed) = (work.spent(), self.allowed);
        }
    }

    /// m: how near contacts between the tools are looked for in this tick: with couplings, as near as the two can come to the skin.
    fn looked_ahead(&self) -> f64 {
        let settings = self.between.settings();
        match self.tools.each_ref().map(Renderer::reach) {
            [Some(one), Some(other)] => settings.skin() + one + other,
            _ => settings.contact_tolerance,
        }
    }

    /// Stage 3 of the module's outline.
    fn couple(&mut self, motions: &[Option<Motion>; 2], dt: f64) {
        let touching = !self.between.forces.clusters.is_empty();
        let [Some(first), Some(second)] = motions.each_ref().map(|motion| motion.as_ref().filter(|_| touching)) else {
            for (tool, motion) in self.tools.iter_mut().zip(motions) {
                if let Some(motion) = motion {
                    tool.couple(motion, dt);
                }
            }
            return;
        };
        let coupled = self.tools.each_ref().map(|tool| tool.settings().coupling.is_some());
        if coupled.contains(&true) {
            self.couple_together([first, second], dt);
        }
        self.share();
        for (k, motion) in [first, second].into_iter().enumerate().filter(|(k, _)| !coupled[*k]) {
            self.tools[k].couple(motion, dt);
        }
    }

    /// The step of both.
    fn couple_together(&mut self, [first, second]: [&Motion; 2], h: f64) {
        if !(h > 0.0 && h.is_finite()) {
            return;
        }
        let damping = self.between.settings();
        let lag = damping.damping / damping.stiffness;
        let shift = first.centers.a - second.centers.a;
        let apart = self.between.forces.clusters.is_empty();
        let [one, other] = &mut self.tools;
        let mut sides = [one.side(first, apart, h), other.side(second, apart, h)];
        let mut shared = Shared { touches: &mut self.between.touches, shift, lag };
        let mut counters = ToolCounters::default();
        let settled = settle(&mut sides, &mut shared, h, &mut counters);
        let between = shared.touches.released();
        // One share for both, so that what holds between them holds on the way.
        let mut share = 1.0f64;
        if let Some(Settled { twists, .. }) = &settled {
            for (side, twist) in sides.iter().zip(twists) {
                if let Side::Held(tool, _) = side {
                    share = share.min(tool.share_within_reach(twist, h));
                }
            }
        }
        counters.bounded = u32::from(share < 1.0);
        let mut felt = [None; 2];
        for (k, side) in sides.into_iter().enumerate() {
            felt[k] = match (side, settled) {
                (Side::Driven(_), _) => None,
                (Side::Held(tool, begun), Some(settled)) => {
                    let released = tool.released() + between;
                    Some((tool.end(&begun, settled.twists[k] * share, h), ToolCounters { released, ..counters }))
                }
                (Side::Held(tool, _), None) => {
                    tool.clear();
                    Some((Wrench::ZERO, ToolCounters { reset: 1, ..counters }))
                }
            };
        }
        let Settled { twists, impulse } = settled.unwrap_or_default();
        let twists = twists.map(|twist| twist * share);
        let impulses = [impulse, -impulse.about(-shift)];
        for (k, (tool, motion)) in self.tools.iter_mut().zip([first, second]).enumerate() {
            let Some((computed, counters)) = felt[k] else { continue };
            let grip = motion.pose_ba.point(tool.settings().grip_a) - motion.centers.a;
            let at_grip = impulses[k].about(grip);
            let work = [at_grip.force.dot(twists[k].at(grip)), at_grip.torque.dot(twists[k].angular)];
            let tick = tool.tick_mut();
            (tick.computed, tick.counters.tool, tick.work_from_other) = (computed, counters, work);
        }
    }

    /// The work on tools without a coupling: what acted since the last step, along the way since then.
    fn book_driven(&mut self, motions: &[Option<Motion>; 2]) {
        for ((tool, motion), last) in self.tools.iter_mut().zip(motions).zip(&mut self.driven) {
            let coupled = tool.settings().coupling.is_some();
            let Some(motion) = motion.filter(|_| !coupled) else {
                *last = None;
                continue;
            };
            let translation = motion.pose_ba.point(tool.settings().grip_a);
            let pose = Pose { translation, ..motion.pose_ba };
            let tick = tool.tick_mut();
            let acts = tick.from_other.about(translation - motion.centers.a);
            if let Some((before, acted)) = last.replace((pose, acts)) {
                let turned = rotation_between(before.rotation, pose.rotation);
                tick.work_from_other = [acted.force.dot(translation - before.translation), acted.torque.dot(turned)];
            }
        }
    }

    /// Shows each tool's tick what happened between the two.
    fn share(&mut self) {
        let Between { contacts, forces, .. } = &self.between;
        for (k, tool) in self.tools.iter_mut().enumerate() {
            let turned = k == 1;
            let tick = tool.tick_mut();
            let own = tick.contacts.len();
            tick.forces.append(forces, own, turned);
            tick.contacts.extend(contacts.iter().map(|contact| if turned { mirrored(contact) } else { *contact }));
            tick.contacts_between = contacts.len() as u32;
            tick.from_other = if turned { forces.net.on_b } else { forces.net.on_a };
            tick.counters.linkage += forces.linkage;
            tick.counters.friction += forces.adhesion;
            tick.counters.cancelled_normals += forces.cancelled_normals;
        }
    }
}
