//! The engine as the step of a servo loop: device state in, wrench for the device out.

use glam::DVec3;
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::render::{Limits, Object, Pacer, ProbeState, Settings, SettingsError, TickSummary, ToolId, World};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{DeviceState, Newest, Publisher, StepOutcome};
use palpus_window::Moment;

use crate::clock::WallClock;
use crate::objects::Objects;
use crate::shots::Shots;
use crate::stage::Stage;
use crate::way_out::WayOut;

/// A world between device and scene. The device's frame is the world's; the environment may be
/// placed in it. The device's pose and twist are those of the grip, which has the probe's axes.
pub(crate) struct Engine {
    world: World,
    tool: ToolId,
    objects: Objects,
    frame: Frame,
    clock: WallClock,
    shots: Shots,
    live: Option<Publisher<Moment>>,
    asked: Option<Newest<Settings>>,
    pacer: Option<Pacer>,
    /// Settings of which no detail has told yet.
    untold: Option<Settings>,
}

/// What a step says beside its wrench.
#[derive(Clone, Copy)]
pub(crate) struct Detail {
    /// Of the engine's tick.
    pub(crate) tick: TickSummary,
    /// Where the engine rendered the probe, world.
    pub(crate) tool: Pose,
    /// Times that the step obtained memory.
    pub(crate) allocations: u64,
    /// The settings that were new in this step.
    pub(crate) changed: Option<Settings>,
    /// The probe is inside the part.
    pub(crate) way_out: Option<WayOut>,
}

impl Engine {
    /// An engine for the stage.
    pub(crate) fn new(stage: &Stage, settings: Settings) -> anyhow::Result<Self> {
        let frame = Frame::new(stage.environment_pose);
        let mut world = World::new(settings)?;
        world.add(Object::fixed(stage.environment.clone(), Pose::IDENTITY))?;
        let objects = Objects::add(stage, &mut world, &frame)?;
        let tool = world.add_tool(stage.probe.clone(), settings)?;
        Ok(Self {
            world,
            tool,
            objects,
            frame,
            clock: WallClock::new(),
            shots: Shots::default(),
            live: None,
            asked: None,
            pacer: None,
            untold: None,
        })
    }

    /// The same, able to take up shading later on, at this crease angle (rad) if it has no other.
    pub(crate) fn with_surfaces(mut self, crease_angle: f64) -> Self {
        self.world.prepare_shading(self.tool, crease_angle);
        self
    }

    /// rad: at which shading can be on.
    pub(crate) fn crease_angle(&self) -> Option<f64> {
        self.world.crease_angle(self.tool)
    }

    /// Before each step the newest settings are taken from `asked`.
    pub(crate) fn steer(&mut self, asked: Newest<Settings>) {
        self.asked = Some(asked);
    }

    /// Goes on with other settings from the next step on; see [`World::set_tool_settings`].
    pub(crate) fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tool, settings)
    }

    fn settings(&self) -> &Settings {
        self.world.tool_settings(self.tool)
    }

    /// The settings that have been asked for since the last step, if they can be.
    fn changed(&mut self) -> Option<Settings> {
        let settings = *self.asked.as_mut()?.take()?;
        self.set_settings(&settings).is_ok().then_some(settings)
    }

    /// Keeps what tick number `tick` has to show, for [`Engine::shown`] and [`Engine::kept`].
    pub(crate) fn keep(&mut self, tick: u64) {
        self.shots.keep(tick, Moment::new(self.settings().capacity));
    }

    /// Leaves what every tick has to show with `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: Publisher<Moment>) {
        self.live = Some(publisher);
    }

    /// What the kept tick has to show, or the last one, if there is none; `period` is a tick's, s.
    pub(crate) fn shown(mut self, period: f64) -> Moment {
        if let Some(moment) = self.kept(period).into_iter().next() {
            return moment;
        }
        let tick = self.world.tick(self.tool);
        let mut moment = Moment::new(tick.contacts.len().max(self.objects.poses(&self.world).count()));
        fill(&mut moment, &self.world, self.tool, &self.objects, period);
        moment
    }

    /// What the kept ticks that came have to show, in the order in which they were asked for; `period` is a tick's, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        self.shots.kept(period)
    }

    /// Each step's work is bounded from now on, so that a loop of `rate_hz` has the time for it.
    pub(crate) fn pace(&mut self, rate_hz: f64) {
        self.pacer = Some(Pacer::of(self.settings(), rate_hz));
    }

    /// The next step may do so much work; see [`World::allow`].
    pub(crate) fn allow(&mut self, work: Option<u64>) {
        self.world.allow(work);
    }

    /// Forgets the past after a step that panicked, of which the memory may be half done. The next step is as the first was.
    pub(crate) fn forget(&mut self) {
        self.world.clear();
        // Whether that step took up others, nobody was told.
        self.untold = Some(*self.settings());
    }

    /// The device can give no more than `available` from now on.
    pub(crate) fn set_available(&mut self, available: &Limits) {
        self.world.set_available(self.tool, available);
    }

    /// One tick: what the device is to push with.
    pub(crate) fn step(&mut self, state: &DeviceState, dt: f64) -> StepOutcome<Detail> {
        let before = allocations_of_this_thread();
        let changed = self.changed().or(self.untold.take());
        let settings = *self.settings();
        let probe = self.frame.probe(state, settings.grip_a);
        if let Some(pacer) = &self.pacer {
            self.world.allow(Some(pacer.allowance()));
        }
        self.objects.drive(&mut self.world, dt);
        self.world.step(std::slice::from_ref(&probe), dt, &self.clock);
        let (world, tool, objects) = (&self.world, self.tool, &self.objects);
        let tick = world.tick(tool);
        if let Some(pacer) = &mut self.pacer {
            pacer.learn(tick);
        }
        self.shots.take(tick.index, |moment| fill(moment, world, tool, objects, 0.0));
        if let Some(live) = &mut self.live {
            live.publish_with(|moment| fill(moment, world, tool, objects, dt));
        }
        let wrench = self.frame.for_device(&tick.commanded);
        let way_out = WayOut::of(tick, &settings, &self.frame, state);
        let saturated = tick.counters.saturated_force + tick.counters.saturated_torque > 0;
        let (summary, pose) = (tick.summary(), self.frame.in_world(&tick.tool_ba));
        let allocations = allocations_of_this_thread() - before;
        let detail = Detail { tick: summary, tool: pose, allocations, changed, way_out };
        StepOutcome { wrench, saturated, changed: changed.is_some(), received: tick.work_from_objects, detail }
    }
}

/// What a tick has to show; `period` is its length, s.
fn fill(moment: &mut Moment, world: &World, tool: ToolId, objects: &Objects, period: f64) {
    let tick = world.tick(tool);
    moment.fill(tick, tick.index as f64 * period, world.tool_settings(tool).grip_a);
    moment.place_others(objects.poses(world));
}

/// Between the world, which is a device's frame, and the environment's.
pub(crate) struct Frame {
    environment: Pose,
    from_world: Pose,
}

impl Frame {
    /// For an environment that is placed so.
    pub(crate) fn new(environment: Pose) -> Self {
        Self { environment, from_world: environment.inverse() }
    }

    /// A wrench as its device gets it.
    pub(crate) fn for_device(&self, wrench: &Wrench) -> Wrench {
        wrench.rotated(&self.environment)
    }

    /// Returns the probe's state in the environment's frame, of a device that holds it at `grip_a`
    /// (m, in the probe's frame).
    pub(crate) fn probe(&self, state: &DeviceState, grip_a: DVec3) -> ProbeState {
        if self.environment == Pose::IDENTITY {
            // Not multiplied, so that a recorded pose reaches the engine bit for bit.
            return ProbeState::of_grip(&state.pose, &state.twist, grip_a);
        }
        let turn = |v| self.from_world.vector(v);
        let twist = Twist { angular: turn(state.twist.angular), linear: turn(state.twist.linear) };
        ProbeState::of_grip(&(self.from_world * state.pose), &twist, grip_a)
    }

    /// Returns the pose in the environment's frame of what stands at `pose` in the world.
    pub(crate) fn placed(&self, pose: &Pose) -> Pose {
        if self.environment == Pose::IDENTITY { *pose } else { self.from_world * *pose }
    }

    /// Returns the direction in the environment's frame of one in the world.
    pub(crate) fn directed(&self, vector: DVec3) -> DVec3 {
        self.from_world.vector(vector)
    }

    /// Returns the world direction of one in the environment's frame.
    pub(crate) fn vector_in_world(&self, vector: DVec3) -> DVec3 {
        self.environment.vector(vector)
    }

    /// Returns the world pose of what stands at `pose` in the environment's frame.
    pub(crate) fn in_world(&self, pose: &Pose) -> Pose {
        if self.environment == Pose::IDENTITY { *pose } else { self.environment * *pose }
    }
}
