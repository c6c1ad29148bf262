//! Two tools in one scene, each held through a device of its own: both feel the environment, and they feel each other. A [`World`] of three
//! bodies.
//!
//! The devices may be as different as they like; the rate of the loop is the same for both.

use std::sync::Arc;

use super::{Limits, Object, ProbeState, Settings, SettingsError, Tick, ToolId, World};
use crate::algebra::{Clock, Pose};
use crate::body::Body;

/// Renders the contact of two probes with an environment and with each other. The environment's frame is the scene's.
#[derive(Clone, Debug)]
pub struct Duo {
    world: World,
    tools: [ToolId; 2],
    probes: [Arc<Body>; 2],
    environment: Arc<Body>,
}

impl Duo {
    /// Two tools of these settings, which may differ; between the two the softer and nearer ones hold, and otherwise the first one's. Fails if a setting cannot be.
    pub fn new(probes: [Arc<Body>; 2], environment: Arc<Body>, settings: [Settings; 2]) -> Result<Self, SettingsError> {
        let mut world = World::new(settings[0])?;
        world.add(Object::fixed(environment.clone(), Pose::IDENTITY))?;
        let tools = [world.add_tool(probes[0].clone(), settings[0])?, world.add_tool(probes[1].clone(), settings[1])?];
        Ok(Self { world, tools, probes, environment })
    }

    /// The same, able to take up shading at this crease angle (rad) later on, by [`Self::set_settings`].
    #[must_use]
    pub fn with_surfaces(mut self, crease_angle: f64) -> Self {
        self.tools.into_iter().for_each(|tool| self.world.prepare_shading(tool, crease_angle));
        self
    }

    /// Goes on with other settings of one tool (0 or 1) from the next step on: see [`World::set_tool_settings`].
    ///
    /// # Errors
    /// With the setting that cannot be; all are then as they were.
    pub fn set_settings(&mut self, tool: usize, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tools[tool], settings)
    }

    /// One turn of the loop: what the states of both probes feel like. `dt` is the time since the last step, s.
    ///
    /// A probe whose pose is none feels nothing and is not there for the other one.
    pub fn step(&mut self, probes: &[ProbeState; 2], dt: f64, clock: &impl Clock) -> [&Tick; 2] {
        self.world.step(probes, dt, clock);
        self.ticks()
    }

    /// The devices can give no more than `available` from now on: see [`World::set_available`].
    pub fn set_available(&mut self, available: &[Limits; 2]) {
        for (tool, available) in self.tools.into_iter().zip(available) {
            self.world.set_available(tool, available);
        }
    }

    /// The last ticks. What they have in common, and the time of the whole step, is in both.
    pub fn ticks(&self) -> [&Tick; 2] {
        self.tools.map(|tool| self.world.tick(tool))
    }

    /// Those of the next step.
    pub fn settings(&self) -> [&Settings; 2] {
        self.tools.map(|tool| self.world.tool_settings(tool))
    }

    /// What holds between the two tools.
    pub fn settings_between(&self) -> &Settings {
        let [one, other] = self.tools.map(|tool| self.world.body_of(tool));
        self.world.settings_between(one, other).expect("two tools have to do with each other")
    }

    /// Both probes.
    pub fn probes(&self) -> [&Body; 2] {
        self.probes.each_ref().map(|probe| &**probe)
    }

    /// The environment.
    pub fn environment(&self) -> &Body {
        &self.environment
    }

    /// The queries of the next steps may do about so much work together: see [`World::allow`].
    pub fn allow(&mut self, work: Option<u64>) {
        self.world.allow(work);
    }

    /// Forgets the past: the next step is as the first was.
    pub fn clear(&mut self) {
        self.world.clear();
    }
}
