//! Two tools as the step of a servo loop: both devices' states in, a wrench for each out.

use palpus::algebra::Pose;
use palpus::render::{Limits, Object, Pacer, Settings, SettingsError, ToolId, World};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{DeviceState, Newest, Publisher, StepOutcome, ToolOutcome};
use palpus_window::Moment;

use crate::clock::WallClock;
use crate::engine::{Detail, Frame};
use crate::objects::Objects;
use crate::shots::Shots;
use crate::stage::Stage;
use crate::way_out::WayOut;

/// A world with two tools between two devices and a scene.
pub(crate) struct TwoEngine {
    world: World,
    tools: [ToolId; 2],
    objects: Objects,
    frame: Frame,
    clock: WallClock,
    shots: Shots,
    live: Option<Publisher<Moment>>,
    asked: Option<[Newest<Settings>; 2]>,
    /// Settings of which no detail has told yet.
    untold: [Option<Settings>; 2],
    crease_angle: Option<f64>,
    pacer: Option<Pacer>,
}

impl TwoEngine {
    /// An engine for both tools; the environment is the first stage's.
    pub(crate) fn new(stages: [&Stage; 2], settings: [Settings; 2]) -> anyhow::Result<Self> {
        let frame = Frame::new(stages[0].environment_pose);
        let mut world = World::new(settings[0])?;
        world.add(Object::fixed(stages[0].environment.clone(), Pose::IDENTITY))?;
        let objects = Objects::add(stages[0], &mut world, &frame)?;
        let mut tool = |k: usize| world.add_tool(stages[k].probe.clone(), settings[k]);
        let tools = [tool(0)?, tool(1)?];
        let crease_angle = settings.iter().find_map(|settings| Some(settings.shading?.crease_angle));
        let clock = WallClock::new();
        Ok(Self {
            world,
            tools,
            objects,
            frame,
            clock,
            shots: Shots::default(),
            live: None,
            asked: None,
            untold: [None; 2],
            crease_angle,
            pacer: None,
        })
    }

    /// The same, able to take up shading later on, at this crease angle (rad) if it has no other.
    pub(crate) fn with_surfaces(mut self, crease_angle: f64) -> Self {
        let crease_angle = *self.crease_angle.get_or_insert(crease_angle);
        self.tools.into_iter().for_each(|tool| self.world.prepare_shading(tool, crease_angle));
        self
    }

    /// rad: at which shading can be on.
    pub(crate) fn crease_angle(&self) -> Option<f64> {
        self.crease_angle
    }

    /// Before each step the newest settings of each tool are taken from `asked`.
    pub(crate) fn steer(&mut self, asked: [Newest<Settings>; 2]) {
        self.asked = Some(asked);
    }

    /// Goes on with other settings of tool `which` (0 or 1) from the next step on; see [`World::set_tool_settings`].
    pub(crate) fn set_settings(&mut self, which: usize, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tools[which], settings)
    }

    /// The settings that have been asked for since the last step, if they can be.
    fn changed(&mut self, which: usize) -> Option<Settings> {
        let settings = *self.asked.as_mut()?[which].take()?;
        self.set_settings(which, &settings).is_ok().then_some(settings)
    }

    /// Leaves what every tick has to show with `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: Publisher<Moment>) {
        self.live = Some(publisher);
    }

    /// Keeps what tick number `tick` has to show, for [`Self::shown`] and [`Self::kept`].
    pub(crate) fn keep(&mut self, tick: u64) {
        let moment = self.moment();
        self.shots.keep(tick, moment);
    }

    /// What the kept tick has to show, or the last one, if there is none; `period` is a tick's, s.
    pub(crate) fn shown(mut self, period: f64) -> Moment {
        self.kept(period).into_iter().next().unwrap_or_else(|| {
            let mut moment = self.moment();
            fill(&mut moment, &self.world, self.tools, &self.objects, period);
            moment
        })
    }

    /// What the kept ticks that came have to show, in the order in which they were asked for; `period` is a tick's, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        self.shots.kept(period)
    }

    fn settings(&self) -> [&Settings; 2] {
        self.tools.map(|tool| self.world.tool_settings(tool))
    }

    fn moment(&self) -> Moment {
        let capacity = self.settings().map(|settings| settings.capacity);
        Moment::new(capacity[0] + capacity[1])
    }

    /// Each step's work is bounded from now on, so that a loop of `rate_hz` has the time for it.
    pub(crate) fn pace(&mut self, rate_hz: f64) {
        self.pacer = Some(Pacer::of(self.settings()[0], rate_hz));
    }

    /// The next step may do so much work; see [`World::allow`].
    pub(crate) fn allow(&mut self, work: Option<u64>) {
        self.world.allow(work);
    }

    /// See [`Engine::forget`](crate::engine::Engine::forget).
    pub(crate) fn forget(&mut self) {
        self.world.clear();
        self.untold = self.settings().map(|settings| Some(*settings));
    }

    /// The devices can give no more than `available` from now on.
    pub(crate) fn set_available(&mut self, available: &[Limits; 2]) {
        for (tool, available) in self.tools.into_iter().zip(available) {
            self.world.set_available(tool, available);
        }
    }

    /// One tick of both: what each device is to push with.
    pub(crate) fn step(&mut self, states: &[DeviceState; 2], dt: f64) -> [ToolOutcome<Detail>; 2] {
        let before = allocations_of_this_thread();
        let changed = [0, 1].map(|which| self.changed(which).or(self.untold[which].take()));
        let grips = self.settings().map(|settings| settings.grip_a);
        let probes = [0, 1].map(|which| self.frame.probe(&states[which], grips[which]));
        if let Some(pacer) = &self.pacer {
            self.world.allow(Some(pacer.allowance()));
        }
        self.objects.drive(&mut self.world, dt);
        self.world.step(&probes, dt, &self.clock);
        let (world, tools, objects) = (&self.world, self.tools, &self.objects);
        let tick = world.tick(tools[0]);
        if let Some(pacer) = &mut self.pacer {
            pacer.learn(tick);
        }
        let index = tick.index;
        self.shots.take(index, |moment| fill(moment, world, tools, objects, dt));
        if let Some(live) = &mut self.live {
            live.publish_with(|moment| fill(moment, world, tools, objects, dt));
        }
        // Whose it is does not matter: it must be none.
        let allocations = allocations_of_this_thread() - before;
        let ticks = self.tools.map(|tool| self.world.tick(tool));
        let settings = self.settings();
        [0, 1].map(|which| {
            let (tick, changed) = (ticks[which], changed[which]);
            let way_out = WayOut::of(tick, settings[which], &self.frame, &states[which]);
            let tool = self.frame.in_world(&tick.tool_ba);
            ToolOutcome {
                outcome: StepOutcome {
                    wrench: self.frame.for_device(&tick.commanded),
                    saturated: tick.counters.saturated_force + tick.counters.saturated_torque > 0,
                    changed: changed.is_some(),
                    received: tick.work_from_objects,
                    detail: Detail { tick: tick.summary(), tool, allocations, changed, way_out },
                },
                received: tick.work_from_other,
            }
        })
    }
}

/// Both tools, and all that happens at them; the arrow at the grip is the first one's.
fn fill(moment: &mut Moment, world: &World, [first, second]: [ToolId; 2], objects: &Objects, period: f64) {
    let tick = world.tick(first);
    moment.fill(tick, tick.index as f64 * period, world.tool_settings(first).grip_a);
    moment.join(world.tick(second));
    moment.place_others(objects.poses(world));
}
