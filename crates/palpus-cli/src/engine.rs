//! The engine as the step of a servo loop: device state in, wrench for the device out.

use palpus::algebra::{Pose, Twist};
use palpus::render::{ProbeState, Renderer, Settings, TickSummary};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{DeviceState, StepOutcome};

use crate::clock::WallClock;
use crate::stage::Stage;

/// A renderer between device and scene. The device's frame is the world's; the environment may be placed in it.
pub(crate) struct Engine {
    renderer: Renderer,
    environment_pose: Pose,
    world_to_environment: Pose,
    clock: WallClock,
}

/// What a step says beside its wrench.
#[derive(Clone, Copy)]
pub(crate) struct Detail {
    /// Of the engine's tick.
    pub(crate) tick: TickSummary,
    /// Times that the step obtained memory.
    pub(crate) allocations: u64,
}

impl Engine {
    /// An engine for the stage.
    pub(crate) fn new(stage: &Stage, settings: Settings) -> anyhow::Result<Self> {
        let renderer = Renderer::new(stage.probe.clone(), stage.environment.clone(), settings)?;
        Ok(Self {
            renderer,
            environment_pose: stage.environment_pose,
            world_to_environment: stage.environment_pose.inverse(),
            clock: WallClock::new(),
        })
    }

    /// One tick: what the device is to push with.
    pub(crate) fn step(&mut self, state: &DeviceState, dt: f64) -> StepOutcome<Detail> {
        let before = allocations_of_this_thread();
        let probe = self.probe_state(&state.pose, &state.twist);
        let tick = self.renderer.step(&probe, dt, &self.clock);
        let wrench = tick.commanded.rotated(&self.environment_pose);
        let saturated = tick.counters.saturated_force + tick.counters.saturated_torque > 0;
        let summary = tick.summary();
        let allocations = allocations_of_this_thread() - before;
        StepOutcome { wrench, saturated, detail: Detail { tick: summary, allocations } }
    }

    /// The probe in the environment's frame.
    fn probe_state(&self, pose: &Pose, twist: &Twist) -> ProbeState {
        if self.environment_pose == Pose::IDENTITY {
            // Not multiplied, so that a recorded pose reaches the engine bit for bit.
            return ProbeState { pose_ba: *pose, twist: *twist };
        }
        let turn = |v| self.world_to_environment.vector(v);
        ProbeState {
            pose_ba: self.world_to_environment * *pose,
            twist: Twist { angular: turn(twist.angular), linear: turn(twist.linear) },
        }
    }
}
