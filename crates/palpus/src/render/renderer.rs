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
//! With an allowance of work ([`Renderer::allow`]), what the query did not reach is felt as it was, carried along.
//!
//! Settings may change between two steps ([`Renderer::set_settings`]); what is remembered of contacts stays.
//!
//! Nothing is allocated after [`Renderer::new`], and nothing that a device can say makes a step panic: a pose that is none
//! gives no force, and is counted.

use std::sync::Arc;

use glam::DVec3;

use super::together::Side;
use super::{
    Forces, Limits, Motion, ProbeState, Scratch, Settings, SettingsError, Tick, Tool, VirtualCoupling, force, saturate,
};
use crate::algebra::{Clock, Pose, Quota, Twist, Work, Wrench};
use crate::body::Body;
use crate::detect::{Contact, ContactQuery, QuerySettings};
use crate::force::{Centers, ShadingSettings, SmoothBody, shade};

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
    /// What shading needs, whether or not it is on.
    surfaces: Option<Surfaces>,
    /// The probe as a body of its own; it rests while there is no coupling.
    tool: Tool,
    query: ContactQuery,
    scratch: Scratch,
    tick: Tick,
    steps: u64,
    /// Units of work that a query may do.
    allowed: Option<u64>,
}

/// The smooth surfaces of both bodies.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    a: SmoothBody,
    b: SmoothBody,
    /// For which they were made, rad.
    crease_angle: f64,
}

impl Renderer {
    /// A renderer of its own memory; fails if a setting cannot be.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: Settings) -> Result<Self, SettingsError> {
        settings.validate()?;
        Ok(Self {
            surfaces: settings.shading.map(|shading| Surfaces::new(&a, &b, shading.crease_angle)),
            tool: Tool::new(&a, settings.coupling.unwrap_or(VirtualCoupling::SLACK), &settings),
            query: query(&a, &b, &settings),
            allowed: None,
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

    /// The same, able to take up shading at this crease angle (rad) later on, by [`Self::set_settings`]. Makes no difference where shading is on
    /// from the start.
    #[must_use]
    pub fn with_surfaces(mut self, crease_angle: f64) -> Self {
        if self.surfaces.is_none() {
            self.surfaces = Some(Surfaces::new(&self.a, &self.b, crease_angle));
        }
        self
    }

    /// Goes on with other settings from the next step on. Contacts, friction and the tool are remembered and ticks counted on; a
    /// coupling that was not there begins where the device is.
    ///
    /// Obtains no memory. What would need some is refused, like what cannot be: another `capacity`, and shading at a crease angle other than that of [`Self::new`] or [`Self::with_surfaces`].
    ///
    /// # Errors
    /// With the setting that cannot be; all are then as they were.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        settings.validate()?;
        self.check_memory(settings)?;
        self.query.set_patch_angle(settings.patch_angle);
        self.tool.set(&self.a, settings.coupling.unwrap_or(VirtualCoupling::SLACK), settings);
        // What rests does not wake up where it was.
        if settings.coupling.is_none() {
            self.tool.clear();
        }
        if settings.friction.is_none() {
            self.scratch.clear();
        }
        self.settings = *settings;
        Ok(())
    }

    /// One turn of the loop: what the probe's state feels like. `dt` is the time since the last step, s.
    pub fn step(&mut self, probe: &ProbeState, dt: f64, clock: &impl Clock) -> &Tick {
        let begin = clock.now_ns();
        match self.begin(probe, dt) {
            Some(motion) => {
                let work = Work::of(self.allowed);
                self.tick.work_allowed = self.allowed;
                self.query(&motion.pose_ba, &work.all(), clock);
                self.tick.work = work.spent();
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
            }
            None => self.clear(),
        }
        self.tick.times.total = clock.now_ns() - begin;
        &self.tick
    }

    /// The device can give no more than `available` from now on: what the coupling does not hold, the hand takes. Without a
    /// coupling, nothing changes.
    pub fn set_available(&mut self, available: &Limits) {
        self.tool.set_available(available);
    }

    /// The queries of the next steps may do about so much work ([`Work`]); `None`: as much as there is. What is not reached is felt as it
    /// was, carried along ([`ContactQuery::run_within`]), and comes first in the step after.
    pub fn allow(&mut self, work: Option<u64>) {
        self.allowed = work;
    }

    /// The last tick.
    pub fn tick(&self) -> &Tick {
        &self.tick
    }

    /// Those of the next step.
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

    /// rad: the crease angle at which shading can be on.
    pub fn crease_angle(&self) -> Option<f64> {
        self.surfaces.as_ref().map(|surfaces| surfaces.crease_angle)
    }

    /// Forgets the past: after a jump of the probe, the next step is as the first was.
    pub fn clear(&mut self) {
        self.query.clear();
        self.scratch.clear();
        self.tool.clear();
    }

    /// Whether there is memory for these settings.
    fn check_memory(&self, settings: &Settings) -> Result<(), SettingsError> {
        let refused = |field, value, rule| Err(SettingsError { field, value, rule });
        if settings.capacity != self.settings.capacity {
            return refused("capacity", settings.capacity as f64, "what it was at the start");
        }
        let other = |shading: &ShadingSettings| self.crease_angle() != Some(shading.crease_angle);
        if let Some(shading) = settings.shading.filter(other) {
            return refused("shading.crease_angle", shading.crease_angle, "that for which surfaces were prepared");
        }
        Ok(())
    }

    /// Begins a tick: answers what [`Self::motion`] does.
    pub(super) fn begin(&mut self, probe: &ProbeState, dt: f64) -> Option<Motion> {
        self.tick.begin(self.steps, probe, dt);
        self.steps += 1;
        self.motion(probe)
    }

    /// The tool, which may have come near another one.
    pub(super) fn tool_mut(&mut self) -> &mut Tool {
        &mut self.tool
    }

    /// The tick under way.
    pub(super) fn tick_mut(&mut self) -> &mut Tick {
        &mut self.tick
    }

    /// Room in each tick for `capacity` contacts more.
    pub(super) fn make_room(&mut self, capacity: usize) {
        self.tick = Tick::new(self.settings.capacity + capacity);
    }

    /// In a step that moves another tool as well: a tool with a coupling as it has begun the step of `h` seconds, or how the
    /// probe moves. `apart`: the two tools are not near each other.
    pub(super) fn side(&mut self, motion: &Motion, apart: bool, h: f64) -> Side<'_> {
        if self.settings.coupling.is_none() {
            return Side::Driven(motion.twist);
        }
        let free = apart && self.tick.forces.clusters.is_empty();
        let begun = self.tool.begin(&self.tick.probe, &self.tick.forces, free, h);
        Side::Held(&mut self.tool, begun)
    }

    /// m: with a coupling, no point of the tool moves farther in the next step.
    pub(super) fn reach(&self) -> Option<f64> {
        self.settings.coupling.map(|_| self.tool.reach())
    }

    /// m: how near contacts are looked for in this tick. With a coupling, as near as the tool can come to the skin.
    fn looked_ahead(&self) -> f64 {
        self.reach().map_or(self.settings.contact_tolerance, |reach| self.settings.skin() + reach)
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
        let (pose_ba, twist) = match self.settings.coupling {
            // What damps the tool is part of its own step.
            Some(_) => (self.tool.pose_ba(&self.tick.probe), Twist::default()),
            None => (self.tick.probe.pose_ba, self.tick.probe.twist),
        };
        self.tick.tool_ba = pose_ba;
        let centers = Centers { a: pose_ba.point(self.center_a), b: self.center_b };
        let grip = pose_ba.point(self.settings.grip_a);
        let at_center = Twist { angular: twist.angular, linear: twist.at(centers.a - grip) };
        let pressed = self.settings.coupling.map_or(0.0, |_| self.tool.pressed());
        Some(Motion { pose_ba, centers, twist: at_center, pressed })
    }

    /// Stages 1 and 2.
    pub(super) fn query(&mut self, pose_ba: &Pose, quota: &Quota<'_>, clock: &impl Clock) {
        self.query.set_tolerance(self.looked_ahead());
        let counters = *self.query.run_within(pose_ba, quota, clock);
        self.tick.unseen_separation = self.query.unseen_separation();
        self.tool.see(self.query.unlooked_separation() - self.settings.skin());
        self.tick.times.query = counters.query_ns;
        self.tick.times.depth = counters.depth_ns;
        self.tick.counters.query = counters;
        self.tick.contacts.extend(self.query.found().iter().take(self.settings.capacity));
    }

    /// Stage 3.
    pub(super) fn force(&mut self, motion: &Motion) {
        let contact_tolerance = self.looked_ahead().max(self.settings.contact_tolerance);
        let Tick { contacts, forces, .. } = &mut self.tick;
        let shading = self.surfaces.as_ref().zip(self.settings.shading);
        let direction = |contact: &Contact| match shading {
            Some((surfaces, ShadingSettings { most_turn, .. })) => {
                surfaces.direction(contact, [&self.a, &self.b], &motion.pose_ba, most_turn)
            }
            None => contact.normal,
        };
        let settings = Settings { contact_tolerance, ..self.settings.held() };
        force(contacts, motion, &settings, direction, &mut self.scratch, forces);
        let Forces { linkage, adhesion, cancelled_normals, .. } = *forces;
        let counters = &mut self.tick.counters;
        (counters.linkage, counters.friction, counters.cancelled_normals) = (linkage, adhesion, cancelled_normals);
    }

    /// Stage 4.
    pub(super) fn couple(&mut self, motion: &Motion, dt: f64) {
        let Tick { probe, forces, counters, computed, .. } = &mut self.tick;
        if self.settings.coupling.is_some() {
            (*computed, counters.tool) = self.tool.step(probe, forces, dt);
        } else {
            let grip = motion.pose_ba.point(self.settings.grip_a);
            *computed = forces.net.on_a.about(grip - motion.centers.a);
        }
    }

    /// Stage 5.
    pub(super) fn saturate(&mut self) {
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

/// The query of a pair of bodies.
pub(super) fn query(a: &Arc<Body>, b: &Arc<Body>, settings: &Settings) -> ContactQuery {
    let settings = QuerySettings {
        tolerance: settings.contact_tolerance,
        capacity: settings.capacity,
        patch_angle: settings.patch_angle,
        guard: true,
        holding: true,
        ..QuerySettings::default()
    };
    ContactQuery::new(a.clone(), b.clone(), settings)
}

impl Surfaces {
    pub(super) fn new(a: &Body, b: &Body, crease_angle: f64) -> Self {
        let smooth = |body: &Body| SmoothBody::new(body, crease_angle);
        Self { a: smooth(a), b: smooth(b), crease_angle }
    }

    /// Where `contact` pushes a, in b's frame.
    pub(super) fn direction(&self, contact: &Contact, [a, b]: [&Body; 2], pose_ba: &Pose, most_turn: f64) -> DVec3 {
        let point_a = pose_ba.inverse().point(contact.point_a);
        let mut side_a = self.a.at(a, contact.piece_a, contact.features.a, point_a);
        if let Some(side) = &mut side_a {
            side.normal = pose_ba.vector(side.normal);
        }
        let side_b = self.b.at(b, contact.piece_b, contact.features.b, contact.point_b);
        let mut direction = shade(contact.normal, side_a, side_b, most_turn);
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
