//! The engine as the step of a servo loop: it takes the states of all devices and returns a wrench
//! for each device.

use glam::DVec3;
use palpus::algebra::{Pose, Twist, WallClock, Wrench};
use palpus::detect::Helper;
use palpus::render::{Limits, Object, ProbeState, Settings, SettingsError, TickSummary, ToolId, WorkLimit, World};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{DeviceState, Newest, Publisher, StepOutcome};
use palpus_window::Moment;

use crate::lead_out::LeadOut;
use crate::objects::Objects;
use crate::shots::Shots;
use crate::stage::Stage;
use crate::way_out::WayOut;

/// Connects a world with devices. The devices' frame is the world frame of the scene; the
/// environment may have a pose in this frame. A device's pose and twist refer to the grip, whose
/// axes are the axes of the tool.
pub(crate) struct Engine {
    world: World,
    tools: Vec<Tool>,
    /// States of the tools in the current step, as passed to the world.
    probes: Vec<ProbeState>,
    objects: Objects,
    frame: Frame,
    clock: WallClock,
    shots: Shots,
    live: Option<Publisher<Moment>>,
}

/// One of the tools.
struct Tool {
    id: ToolId,
    asked: Option<Newest<Settings>>,
    /// New settings that no tick detail has reported yet.
    unreported: Option<Settings>,
    /// Leads the device out of the part; `None` unless requested.
    lead: Option<LeadOut>,
}

/// Result that the engine gives to the loop.
pub(crate) type Answer = Option<StepOutcome<Detail>>;

/// Results of a step besides its wrench.
#[derive(Clone, Copy)]
pub(crate) struct Detail {
    /// Summary of the engine's tick.
    pub(crate) tick: TickSummary,
    /// Pose at which the engine rendered the probe, world.
    pub(crate) tool: Pose,
    /// Number of allocations in the step.
    pub(crate) allocations: u64,
    /// Settings that were applied in this step.
    pub(crate) changed: Option<Settings>,
    /// The way out of the part if the probe is inside.
    pub(crate) way_out: Option<WayOut>,
    /// True if the device leads its grip out of the part.
    pub(crate) leading: bool,
}

impl Engine {
    /// Returns a helper, with which another thread can take part in the steps.
    pub(crate) fn helper(&self) -> Helper {
        self.world.helper()
    }

    /// Creates an engine for the first tools of a stage, one tool for each of the `settings`. Its
    /// work is not limited.
    pub(crate) fn new(stage: &Stage, settings: &[Settings]) -> anyhow::Result<Self> {
        let frame = Frame::new(stage.environment_pose);
        let mut world = World::new(settings.first().copied().unwrap_or_default())?;
        world.allow(WorkLimit::Unlimited);
        world.add(Object::fixed(stage.environment.clone(), Pose::IDENTITY))?;
        let objects = Objects::add(stage, &mut world, &frame)?;
        let mut tools = Vec::new();
        for ((probe, _), settings) in stage.tools().zip(settings) {
            let id = world.add_tool(probe.clone(), *settings)?;
            tools.push(Tool { id, asked: None, unreported: None, lead: None });
        }
        let probes = vec![ProbeState::at(Pose::IDENTITY); tools.len()];
        let (clock, shots) = (WallClock::new(), Shots::default());
        Ok(Self { world, tools, probes, objects, frame, clock, shots, live: None })
    }

    /// Gives the engine memory to turn shading on later. The crease angle is `crease_angle` (rad),
    /// or the angle of a tool that shades from the start.
    pub(crate) fn with_surfaces(mut self, crease_angle: f64) -> Self {
        let crease_angle = self.crease_angle().unwrap_or(crease_angle);
        self.tools.iter().for_each(|tool| self.world.prepare_shading(tool.id, crease_angle));
        self
    }

    /// Returns the crease angle for which shading can be turned on, rad.
    pub(crate) fn crease_angle(&self) -> Option<f64> {
        self.tools.iter().find_map(|tool| self.world.crease_angle(tool.id))
    }

    /// Lets every step take the newest settings of tool `which` from `asked`.
    pub(crate) fn steer(&mut self, which: usize, asked: Newest<Settings>) {
        self.tools[which].asked = Some(asked);
    }

    /// Leads the device of tool `which` out of the part from the next step on; `None` stops this.
    pub(crate) fn lead_out(&mut self, which: usize, lead: Option<LeadOut>) {
        self.tools[which].lead = lead;
    }

    /// Sets the settings of tool `which` from the next step on; see [`World::set_tool_settings`].
    pub(crate) fn set_settings(&mut self, which: usize, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tools[which].id, settings)
    }

    /// Applies the settings that were requested since the last step, if they are valid.
    fn take_settings(&mut self) {
        for Tool { id, asked, unreported, .. } in &mut self.tools {
            if let Some(settings) = asked.as_mut().and_then(Newest::take)
                && self.world.set_tool_settings(*id, settings).is_ok()
            {
                *unreported = Some(*settings);
            }
        }
    }

    /// Returns the capacity that a [`Moment`] needs for a tick of this engine.
    pub(crate) fn capacity(&self) -> usize {
        self.tools.iter().map(|tool| self.world.tool_settings(tool.id).capacity).sum()
    }

    /// Keeps the moment of tick number `tick` for [`Engine::shown`] and [`Engine::kept`].
    pub(crate) fn keep(&mut self, tick: u64) {
        self.shots.keep(tick, Moment::new(self.capacity()));
    }

    /// Publishes the moment of every tick through `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: Publisher<Moment>) {
        self.live = Some(publisher);
    }

    /// Returns the kept tick for display, or the last tick if no tick was kept. `period`: length of
    /// a tick, s.
    pub(crate) fn shown(mut self, period: f64) -> Moment {
        self.kept(period).into_iter().next().unwrap_or_else(|| {
            let mut moment = Moment::new(self.capacity());
            fill(&mut moment, &self.world, &self.tools, &self.objects, period);
            moment
        })
    }

    /// Returns the kept ticks for display, in the order of the requests. `period`: length of a
    /// tick, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        self.shots.kept(period)
    }

    /// Sets the work limit of the next steps; see [`World::allow`].
    pub(crate) fn allow(&mut self, limit: WorkLimit) {
        self.world.allow(limit);
    }

    /// Resets the engine after a step that panicked, because its state may be inconsistent. The
    /// next step then acts like the first step.
    pub(crate) fn forget(&mut self) {
        self.world.clear();
        // The failed step may have applied other settings, so the next detail reports them.
        for tool in &mut self.tools {
            tool.unreported = Some(*self.world.tool_settings(tool.id));
        }
    }

    /// Limits the wrench of tool `which` to `available` from now on.
    pub(crate) fn set_available(&mut self, which: usize, available: &Limits) {
        self.world.set_available(self.tools[which].id, available);
    }

    /// Computes one tick: takes the states of all devices, and writes the result for each device
    /// into `answers`.
    pub(crate) fn step(&mut self, states: &[DeviceState], dt: f64, answers: &mut [Answer]) {
        let before = allocations_of_this_thread();
        self.take_settings();
        for ((probe, state), tool) in self.probes.iter_mut().zip(states).zip(&self.tools) {
            *probe = self.frame.probe(state, self.world.tool_settings(tool.id).grip_a);
        }
        self.objects.drive(&mut self.world, dt);
        self.world.step(&self.probes, dt, &self.clock);
        self.show(dt);
        let allocations = allocations_of_this_thread() - before;
        let mut forget = false;
        for ((tool, state), answer) in self.tools.iter_mut().zip(states).zip(answers) {
            let (tick, settings) = (self.world.tick(tool.id), self.world.tool_settings(tool.id));
            let changed = tool.unreported.take();
            let way_out = WayOut::of(tick, settings, &self.frame, state);
            let led = tool.lead.as_mut().and_then(|lead| lead.tick(state, dt, way_out.is_none()));
            forget |= led.as_ref().is_some_and(|led| led.forget);
            let detail = Detail {
                tick: tick.summary(),
                tool: self.frame.in_world(&tick.tool_ba),
                allocations,
                changed,
                way_out,
                leading: led.is_some(),
            };
            *answer = Some(StepOutcome {
                wrench: led.as_ref().map_or_else(|| self.frame.for_device(&tick.commanded), |led| led.wrench),
                saturated: led.is_none() && tick.counters.saturated_force + tick.counters.saturated_torque > 0,
                changed: changed.is_some(),
                received: led.as_ref().map_or(tick.work_from_objects, |led| [led.work, 0.0]),
                from_others: if led.is_some() { [0.0; 2] } else { tick.work_from_other },
                detail,
            });
        }
        if forget {
            self.world.clear();
        }
    }

    /// Publishes the moment of the last step.
    fn show(&mut self, dt: f64) {
        let Self { world, tools, objects, shots, live, .. } = self;
        let Some(first) = tools.first().map(|tool| world.tick(tool.id)) else { return };
        shots.take(first.index, |moment| fill(moment, world, tools, objects, dt));
        if let Some(live) = live {
            live.publish_with(|moment| fill(moment, world, tools, objects, dt));
        }
    }
}

/// Fills `moment` with all tools. The arrow at the grip belongs to the first tool. `period`:
/// length of a tick, s.
fn fill(moment: &mut Moment, world: &World, tools: &[Tool], objects: &Objects, period: f64) {
    let Some(first) = tools.first() else { return };
    let tick = world.tick(first.id);
    moment.fill(tick, tick.index as f64 * period, world.tool_settings(first.id).grip_a);
    for (k, tool) in tools.iter().enumerate().skip(1) {
        let body = world.body_of(tool.id);
        // Contacts with earlier tools are already in the list.
        let known = tools[..k].iter().map(|other| world.contacts(body, world.body_of(other.id)).count()).sum();
        moment.join(world.tick(tool.id), known);
    }
    moment.place_others(objects.poses(world));
}

/// Transforms between the world (the devices' frame) and the environment's frame.
pub(crate) struct Frame {
    environment: Pose,
    from_world: Pose,
}

impl Frame {
    /// Creates the transforms for an environment with this pose.
    pub(crate) fn new(environment: Pose) -> Self {
        Self { environment, from_world: environment.inverse() }
    }

    /// Converts a wrench to the device's frame.
    pub(crate) fn for_device(&self, wrench: &Wrench) -> Wrench {
        wrench.rotated(&self.environment)
    }

    /// Returns the probe's state in the environment's frame, for a device that holds the probe at
    /// `grip_a` (m, in the probe's frame).
    pub(crate) fn probe(&self, state: &DeviceState, grip_a: DVec3) -> ProbeState {
        if self.environment == Pose::IDENTITY {
            // Skips the multiplication, so that a recorded pose reaches the engine bit for bit.
            return ProbeState::of_grip(&state.pose, &state.twist, grip_a);
        }
        let turn = |v| self.from_world.vector(v);
        let twist = Twist { angular: turn(state.twist.angular), linear: turn(state.twist.linear) };
        ProbeState::of_grip(&(self.from_world * state.pose), &twist, grip_a)
    }

    /// Converts a pose from the world to the environment's frame.
    pub(crate) fn placed(&self, pose: &Pose) -> Pose {
        if self.environment == Pose::IDENTITY { *pose } else { self.from_world * *pose }
    }

    /// Converts a direction from the world to the environment's frame.
    pub(crate) fn directed(&self, vector: DVec3) -> DVec3 {
        self.from_world.vector(vector)
    }

    /// Converts a direction from the environment's frame to the world.
    pub(crate) fn vector_in_world(&self, vector: DVec3) -> DVec3 {
        self.environment.vector(vector)
    }

    /// Converts a pose from the environment's frame to the world.
    pub(crate) fn in_world(&self, pose: &Pose) -> Pose {
        if self.environment == Pose::IDENTITY { *pose } else { self.environment * *pose }
    }
}
