//! One turn of the loop in five named calls \[K02 §4, §5\].
//!
//! 1. *Query*: all contacts of the two bodies within the tolerance; and in the same pass
//! 2. *depth*: how deep those that overlap do.
//! 3. *Force*: clusters, penalty, shading, friction; the wrenches on both bodies.
//! 4. *Couple*: what of it the device is to feel. Direct rendering, the paper's: the wrench itself, about the grip. With a
//!    virtual coupling, contacts were looked for where the *tool* is; it moves on under them and the coupling, and the device
//!    feels the coupling.
//! 5. *Saturate*: within the device's limits.
//!
//! With a time budget, the query ends in time, and what it did not reach is felt as it was (see [`Settings::time_budget`]).
//!
//! Nothing is allocated after [`Renderer::new`], and nothing that a device can say makes a step panic: a pose that is none
//! gives no force, and is counted.

use std::sync::Arc;

use glam::DVec3;

use super::{Forces, Motion, ProbeState, Scratch, Settings, SettingsError, Tick, Tool, force, saturate};
use crate::algebra::{Clock, Deadline, Pose, Twist, Wrench};
use crate::body::Body;
use crate::force::{Centers, Contact, PairQuery, ShadingSettings, SmoothBody, shade};

/// Renders the contact of a probe (a) with an environment (b). The environment's frame is the scene's.
#[derive(Clone, Debug)]
pub struct Renderer {
    a: Arc<Body>,
    b: Arc<Body>,
    settings: Settings,
    /// Centre of mass of the probe, in its frame.
    center_a: DVec3,
    /// Centre of mass of the environment.
    center_b: DVec3,
    shading: Option<Shading>,
    /// The probe as a body of its own, with a coupling.
    tool: Option<Tool>,
    query: PairQuery,
    scratch: Scratch,
    tick: Tick,
    steps: u64,
    /// What the stages after the depth took last time, ns.
    after_query: u64,
}

/// The smooth surfaces of both bodies.
#[derive(Clone, Debug)]
struct Shading {
    a: SmoothBody,
    b: SmoothBody,
    most_turn: f64,
}

impl Renderer {
    /// A renderer of its own memory; fails if a setting cannot be.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: Settings) -> Result<Self, SettingsError> {
        settings.validate()?;
        Ok(Self {
            shading: settings.shading.map(|shading| Shading::new(&a, &b, &shading)),
            tool: settings.coupling.map(|coupling| Tool::new(a.mass(), coupling, &settings)),
            query: query(&a, &b, &settings),
            after_query: 0,
            scratch: Scratch::new(settings.capacity),
            tick: Tick::new(settings.capacity),
            steps: 0,
            center_a: a.mass().center_of_mass,
            center_b: b.mass().center_of_mass,
            settings,
            a,
            b,
        })
    }

    /// One turn of the loop: what the probe's state feels like. `dt` is the time since the last step, s.
    pub fn step(&mut self, probe: &ProbeState, dt: f64, clock: &impl Clock) -> &Tick {
        let begin = clock.now_ns();
        self.tick.begin(self.steps, probe, dt);
        self.steps += 1;
        match self.motion(probe) {
            Some(motion) => {
                self.query(&motion.pose_ba, &self.deadline(begin, clock));
                let queried = clock.now_ns();
                self.force(&motion);
                let forced = clock.now_ns();
                self.couple(&motion, dt);
                let coupled = clock.now_ns();
                self.saturate();
                self.tick.times.force = forced - queried;
                self.tick.times.couple = coupled - forced;
                let saturated = clock.now_ns();
                self.tick.times.saturate = saturated - coupled;
                self.after_query = saturated - queried;
            }
            None => self.clear(),
        }
        self.tick.times.total = clock.now_ns() - begin;
        &self.tick
    }

    /// The last tick.
    pub fn tick(&self) -> &Tick {
        &self.tick
    }

    /// As given at construction.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The probe.
    pub fn probe(&self) -> &Body {
        &self.a
    }

    /// The environment.
    pub fn environment(&self) -> &Body {
        &self.b
    }

    /// Forgets the past: after a jump of the probe, the next step is as the first was.
    pub fn clear(&mut self) {
        self.query.clear();
        self.scratch.clear();
        if let Some(tool) = &mut self.tool {
            tool.clear();
        }
    }

    /// Where the probe, or the tool in its place, is looked for; `None` if its state means nothing.
    fn motion(&mut self, probe: &ProbeState) -> Option<Motion> {
        let unmoving = !(probe.twist.angular.is_finite() && probe.twist.linear.is_finite());
        self.tick.counters.bad_state = u32::from(unmoving || !probe.pose_ba.is_valid());
        if !probe.pose_ba.is_valid() {
            return None;
        }
        if unmoving {
            self.tick.probe.twist = Twist::default();
        }
        let (pose_ba, twist) = match &mut self.tool {
            // What damps the tool is part of its own step.
            Some(tool) => (tool.pose_ba(&self.tick.probe), Twist::default()),
            None => (probe.pose_ba, self.tick.probe.twist),
        };
        self.tick.tool_ba = pose_ba;
        let centers = Centers { a: pose_ba.point(self.center_a), b: self.center_b };
        let grip = pose_ba.point(self.settings.grip_a);
        let at_center = Twist { angular: twist.angular, linear: twist.at(centers.a - grip) };
        Some(Motion { pose_ba, centers, twist: at_center })
    }

    /// When the query has to end, for a step that began at `begin`.
    fn deadline<C: Clock>(&self, begin: u64, clock: C) -> Deadline<C> {
        match self.settings.time_budget {
            Some(budget) => Deadline::at(clock, begin + budget.saturating_sub(self.after_query)),
            None => Deadline::never(clock),
        }
    }

    /// Stages 1 and 2.
    fn query<C: Clock>(&mut self, pose_ba: &Pose, deadline: &Deadline<C>) {
        let tolerance = self.settings.contact_tolerance;
        let counters = self.query.run_until(&self.a, &self.b, pose_ba, tolerance, deadline);
        self.tick.unseen_separation = self.query.unseen_separation();
        self.tick.times.query = counters.query_ns;
        self.tick.times.depth = counters.depth_ns;
        self.tick.counters.query = counters;
        self.tick.contacts.extend(self.query.contacts().iter().take(self.settings.capacity));
    }

    /// Stage 3.
    fn force(&mut self, motion: &Motion) {
        let Tick { contacts, forces, .. } = &mut self.tick;
        let direction = |contact: &Contact| match &self.shading {
            Some(shading) => shading.direction(contact, &self.a, &self.b, &motion.pose_ba),
            None => contact.normal,
        };
        force(contacts, motion, &self.settings, direction, &mut self.scratch, forces);
        let Forces { linkage, adhesion, cancelled_normals, .. } = *forces;
        let counters = &mut self.tick.counters;
        (counters.linkage, counters.friction, counters.cancelled_normals) = (linkage, adhesion, cancelled_normals);
    }

    /// Stage 4.
    fn couple(&mut self, motion: &Motion, dt: f64) {
        let Tick { probe, forces, counters, computed, .. } = &mut self.tick;
        if let Some(tool) = &mut self.tool {
            (*computed, counters.tool) = tool.step(probe, forces, dt);
        } else {
            let grip = motion.pose_ba.point(self.settings.grip_a);
            *computed = forces.net.on_a.about(grip - motion.centers.a);
        }
    }

    /// Stage 5.
    fn saturate(&mut self) {
        let saturated = saturate(self.tick.computed, &self.settings.limits, self.settings.saturation);
        self.tick.commanded = saturated.wrench;
        let counters = &mut self.tick.counters;
        counters.saturated_force = u32::from(saturated.force_cut);
        counters.saturated_torque = u32::from(saturated.torque_cut);
        counters.non_finite_wrench = u32::from(saturated.non_finite);
        if saturated.non_finite {
            self.tick.computed = Wrench::ZERO;
        }
    }
}

fn query(a: &Body, b: &Body, settings: &Settings) -> PairQuery {
    let query = PairQuery::new(a, b, settings.capacity).with_blend(settings.blend_angle).with_guard();
    if settings.time_budget.is_some() { query.with_holding() } else { query }
}

impl Shading {
    fn new(a: &Body, b: &Body, settings: &ShadingSettings) -> Self {
        let smooth = |body: &Body| SmoothBody::new(body, settings.crease_angle);
        Self { a: smooth(a), b: smooth(b), most_turn: settings.most_turn }
    }

    fn direction(&self, contact: &Contact, a: &Body, b: &Body, pose_ba: &Pose) -> DVec3 {
        let point_a = pose_ba.inverse().point(contact.point_a);
        let mut side_a = self.a.at(a, contact.piece_a, contact.features.a, point_a);
        if let Some(side) = &mut side_a {
            side.normal = pose_ba.vector(side.normal);
        }
        let side_b = self.b.at(b, contact.piece_b, contact.features.b, contact.point_b);
        let mut direction = shade(contact.normal, side_a, side_b, self.most_turn);
        if side_a.is_none() {
            let local = |v: DVec3| pose_ba.inverse().vector(-v);
            let (normal, goal) = (local(contact.normal), local(direction));
            direction = -pose_ba.vector(SmoothBody::confine(a, contact.piece_a, contact.features.a, normal, goal));
        }
        if side_b.is_none() {
            direction = SmoothBody::confine(b, contact.piece_b, contact.features.b, contact.normal, direction);
        }
        direction
    }
}
