//! A tool of a world: the probe that a device holds, its settings and its tick.

use glam::DVec3;

use super::super::tool::Tool;
use super::super::transient::Transient;
use super::super::{Limits, ProbeState, Settings, Tick, ToolCounters, VirtualCoupling, saturate};
use crate::algebra::{Pose, Twist, Wrench, rotation_between};
use crate::body::Body;

/// See the module's description.
#[derive(Clone, Debug)]
pub(super) struct Held {
    /// Index of the tool among the bodies.
    pub(super) thing: usize,
    pub(super) settings: Settings,
    /// The probe as a simulated body; unused without a coupling.
    pub(super) tool: Tool,
    pub(super) tick: Tick,
    /// Largest number of contacts in the tick.
    pub(super) room: usize,
    pub(super) transient: Transient,
    /// Without a coupling: the grip's pose in the last step, and the wrenches of tools and objects
    /// about the grip in that step.
    driven: Option<(Pose, [Wrench; 2])>,
    /// Crease angle at which shading can be turned on, rad.
    pub(super) crease_angle: Option<f64>,
}

impl Held {
    pub(super) fn new(thing: usize, probe: &Body, settings: &Settings) -> Self {
        Self {
            thing,
            tool: Tool::new(probe, settings.coupling.unwrap_or(VirtualCoupling::SLACK), settings),
            tick: Tick::new(0),
            room: 0,
            transient: Transient::STILL,
            driven: None,
            crease_angle: settings.shading.map(|shading| shading.crease_angle),
            settings: *settings,
        }
    }

    /// Allocates memory for `capacity` contacts in a tick.
    pub(super) fn make_room(&mut self, capacity: usize) {
        if self.room < capacity {
            self.room = capacity;
            self.tick = Tick::new(capacity);
        }
    }

    pub(super) fn clear(&mut self) {
        self.tool.clear();
        self.transient = Transient::STILL;
        self.driven = None;
    }

    /// Changes the settings, which are valid.
    pub(super) fn set_settings(&mut self, probe: &Body, settings: &Settings) {
        self.tool.set(probe, settings.coupling.unwrap_or(VirtualCoupling::SLACK), settings);
        // The tool is unused now. If a coupling is set later, the tool starts at the device's pose.
        if settings.coupling.is_none() {
            self.tool.clear();
        }
        if settings.material.is_none() {
            self.transient = Transient::STILL;
        }
        self.settings = *settings;
    }

    /// Begins a tick. Returns the pose for the query, the centre of mass, and its twist for
    /// damping. With a coupling, this is the pose of the tool, otherwise that of the probe. `None`
    /// if the state is invalid.
    pub(super) fn begin(
        &mut self,
        index: u64,
        probe: Option<&ProbeState>,
        center_a: DVec3,
        dt: f64,
    ) -> Option<(Pose, DVec3, Twist)> {
        let probe = probe.copied().unwrap_or(ProbeState::at(Pose::from_translation(DVec3::NAN)));
        self.tick.begin(index, &probe, dt);
        let unmoving = !(probe.twist.angular.is_finite() && probe.twist.linear.is_finite());
        self.tick.counters.bad_state = u32::from(unmoving || !probe.pose_ba.is_valid());
        if !probe.pose_ba.is_valid() {
            return None;
        }
        if unmoving {
            self.tick.probe.twist = Twist::default();
        }
        let (pose, twist) = match self.settings.coupling {
            // The tool's own step includes its damping.
            Some(_) => (self.tool.pose_ba(&self.tick.probe), Twist::default()),
            None => (self.tick.probe.pose_ba, self.tick.probe.twist),
        };
        self.tool.reach.begin(pose.rotation);
        self.tick.tool_ba = pose;
        let center = pose.point(center_a);
        let at_center = Twist { angular: twist.angular, linear: twist.at(center - self.grip(&pose)) };
        Some((pose, center, at_center))
    }

    /// Returns the grip's position for a tool at `pose`.
    pub(super) fn grip(&self, pose: &Pose) -> DVec3 {
        pose.point(self.settings.grip_a)
    }

    /// Without a coupling: computes the device's wrench from the wrench of contacts.
    pub(super) fn feel(&mut self, pose: &Pose, center: DVec3) {
        let grip = self.grip(pose);
        self.tick.computed = self.tick.forces.net.on_a.about(grip - center);
    }

    /// Without a coupling: computes the work of the last step's wrenches along the motion since
    /// then.
    pub(super) fn book(&mut self, pose: &Pose, center: DVec3) {
        let translation = self.grip(pose);
        let pose = Pose { translation, ..*pose };
        let acts = [self.tick.from_other, self.tick.from_objects].map(|wrench| wrench.about(translation - center));
        if let Some((before, acted)) = self.driven.replace((pose, acts)) {
            let turned = rotation_between(before.rotation, pose.rotation);
            let work = |acted: Wrench| [acted.force.dot(translation - before.translation), acted.torque.dot(turned)];
            (self.tick.work_from_other, self.tick.work_from_objects) = (work(acted[0]), work(acted[1]));
        }
    }

    /// With a coupling: moves the tool with `twist` for `h` s. `pose` and `center` (the centre of
    /// mass) are at the beginning of the step. `given` contains the impulses of other tools and of
    /// moving objects, about the centre of mass.
    pub(super) fn end(
        &mut self,
        (pose, center): (&Pose, DVec3),
        twist: Twist,
        h: f64,
        given: [Wrench; 2],
        counters: ToolCounters,
    ) {
        self.driven = None;
        let to_grip = self.tool.grip_offset();
        let work = |given: Wrench| {
            let at_grip = given.about(to_grip);
            [at_grip.force.dot(twist.at(to_grip)), at_grip.torque.dot(twist.angular)]
        };
        (self.tick.work_from_other, self.tick.work_from_objects) = (work(given[0]), work(given[1]));
        self.tick.computed = self.tool.end(pose, center, twist, h, counters.bounded > 0);
        self.tick.counters.tool = counters;
    }

    /// With a coupling, if the step has no solution: moves the tool to the device's pose.
    pub(super) fn reset(&mut self) {
        self.tool.clear();
        self.tick.counters.tool.reset = 1;
    }

    /// Advances the vibration of impacts by `h` s and adds it to the wrench.
    pub(super) fn ring(&mut self, h: f64) {
        let Some(material) = &self.settings.material else { return };
        let force = self.transient.ring(material, h, self.settings.limits.force);
        self.tick.transient = force;
        self.tick.computed.force += force;
    }

    /// Limits the wrench to the device's limits.
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

    pub(super) fn set_available(&mut self, available: &Limits) {
        self.tool.set_available(available);
    }
}
