//! All results of one step of the loop.
//!
//! **Frames.** Contacts, clusters, forces and wrenches are in b's frame, which is the scene's
//! frame, because the environment does not move. In a [`World`](super::World) they are in the
//! world's frame. The probe's pose `pose_ba` places a in b's frame. A caller whose device or camera
//! uses another frame must convert. A device measures the grip; [`ProbeState::of_grip`] converts
//! the grip's pose into the probe's pose. Wrenches for the device are about the grip
//! ([`super::Settings::grip_a`]). Wrenches in [`Forces::net`] are about each body's centre of mass.

use glam::DVec3;

use super::Forces;
use crate::algebra::{Pose, Twist, Wrench};
use crate::detect::{Contact, QueryCounters};
use crate::force::{FrictionCounters, LinkageCounters};

/// Pose and twist of the probe, in b's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ProbeState {
    /// The pose of the frame of the probe's mesh (not of the grip) in b's frame.
    pub pose_ba: Pose,
    /// The probe's velocity along b's axes, m/s and rad/s; the linear part is the grip's velocity.
    /// Only damping uses it.
    pub twist: Twist,
}

impl ProbeState {
    /// Returns a probe at rest.
    pub fn at(pose_ba: Pose) -> Self {
        Self { pose_ba, twist: Twist::default() }
    }

    /// Returns the state of a probe from the pose and twist of its grip in b's frame, as a device
    /// measures them. The grip is at `grip_a` ([`super::Settings::grip_a`]) and has the probe's
    /// axes.
    pub fn of_grip(grip_b: &Pose, twist: &Twist, grip_a: DVec3) -> Self {
        Self { pose_ba: grip_b.with_origin(-grip_a), twist: *twist }
    }
}

/// Times of the stages of a tick, ns, measured with the caller's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// The descent through both hierarchies and the distance marches.
    pub query: u64,
    /// The depth walks.
    pub depth: u64,
    /// Shading, clusters, penalty forces and friction.
    pub force: u64,
    /// Computation of the device's wrench from the wrench of the contacts.
    pub couple: u64,
    /// Limiting the wrench.
    pub saturate: u64,
    /// The whole step.
    pub total: u64,
}

/// Events in one step of the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ToolCounters {
    /// Number of times that the system was solved.
    pub rounds: u32,
    /// Number of clusters that lost contact within the step.
    pub released: u32,
    /// 1 if the last round still changed the set of pressing contacts or a friction force.
    pub unsettled: u32,
    /// 1 if the step was shortened, so that no point moves farther than the distance within which
    /// contacts are searched.
    pub bounded: u32,
    /// 1 if the system had no finite solution; the tool was then moved to the device's pose.
    pub reset: u32,
}

/// Counters of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Counters of the queries.
    pub query: QueryCounters,
    /// Numbers of admitted contacts, of contacts that were left out, and of groups that were cut.
    pub linkage: LinkageCounters,
    /// Numbers of contacts that slide, that took over the strain of another contact, and that began
    /// without strain.
    pub friction: FrictionCounters,
    /// Number of clusters whose normals cancelled, so that the deepest member's normal was used.
    pub cancelled_normals: u32,
    /// Counters of the tool's step.
    pub tool: ToolCounters,
    /// 1 if the force was reduced to its limit.
    pub saturated_force: u32,
    /// 1 if the torque was reduced to its limit.
    pub saturated_torque: u32,
    /// 1 if the computed wrench was not finite; then a zero wrench was commanded.
    pub non_finite_wrench: u32,
    /// 1 if the probe's pose was invalid (then nothing was queried), or if its twist was not finite
    /// (then it was replaced by rest).
    pub bad_state: u32,
}

/// Results of one step of the loop. See the module's description for frames.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Index of the step; 0 for the first step of a renderer.
    pub index: u64,
    /// Length of the step, as given by the caller, s.
    pub dt: f64,
    /// The probe's state, as given by the caller. A twist that was not finite is replaced by rest.
    pub probe: ProbeState,
    /// The pose of the query: a placed in b's frame. With a coupling, this is the tool's pose,
    /// otherwise the probe's pose.
    pub tool_ba: Pose,
    /// The wrench for the device, about the grip and within the limits.
    pub commanded: Wrench,
    /// The wrench about the grip, before the limits are applied.
    pub computed: Wrench,
    /// The part of the force that comes from the vibration of impacts ([`super::Material`]), N.
    pub transient: DVec3,
    /// All contacts nearer than the tolerance.
    pub contacts: Vec<Contact>,
    /// Number of units of work ([`crate::algebra::Work`]) that the query did.
    pub work: u64,
    /// The work limit of the query; `None` if it was unlimited.
    pub work_allowed: Option<u64>,
    /// Lower bound of the separation of everything that the step did not examine because it reached
    /// its work limit ([`super::Renderer::allow`]), m. Infinite if the step examined everything.
    pub unseen_separation: f64,
    /// Clusters, their forces, and the wrenches on both bodies.
    pub forces: Forces,
    /// Number of contacts with other tools. In these contacts, `piece_b` is the index of the other
    /// tool's piece.
    pub contacts_between: u32,
    /// Wrench from other tools, about this tool's centre of mass; part of [`Forces::net`].
    pub from_other: Wrench,
    /// Work of other tools on this tool, J: by translation of the grip and by rotation. With a
    /// coupling, this is the work during the step, otherwise the work since the last step.
    pub work_from_other: [f64; 2],
    /// Wrench from driven and free objects, about the tool's centre of mass; part of
    /// [`Forces::net`].
    pub from_objects: Wrench,
    /// Work of driven and free objects on the tool, J, defined like [`Self::work_from_other`].
    pub work_from_objects: [f64; 2],
    /// Times of the stages.
    pub times: StageTimes,
    /// Counters.
    pub counters: Counters,
}

/// Summary of a tick without lists, cheap to copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickSummary {
    /// See [`Tick::index`].
    pub index: u64,
    /// See [`Tick::dt`].
    pub dt: f64,
    /// See [`Tick::probe`].
    pub probe: ProbeState,
    /// See [`Tick::tool_ba`].
    pub tool_ba: Pose,
    /// See [`Tick::commanded`].
    pub commanded: Wrench,
    /// See [`Tick::computed`].
    pub computed: Wrench,
    /// Number of contacts.
    pub contacts: u32,
    /// Number of contacts with other tools.
    pub contacts_between: u32,
    /// Number of clusters.
    pub clusters: u32,
    /// Separation of the deepest contact, m; infinite without contacts.
    pub separation: f64,
    /// See [`Tick::work`].
    pub work: u64,
    /// See [`Tick::work_allowed`].
    pub work_allowed: Option<u64>,
    /// See [`Tick::unseen_separation`].
    pub unseen_separation: f64,
    /// See [`Tick::work_from_other`].
    pub work_from_other: [f64; 2],
    /// See [`Tick::work_from_objects`].
    pub work_from_objects: [f64; 2],
    /// See [`Tick::times`].
    pub times: StageTimes,
    /// See [`Tick::counters`].
    pub counters: Counters,
}

impl TickSummary {
    /// Returns the fraction of the contacts that were extrapolated from the last step because the
    /// work limit was reached.
    pub fn carried(&self) -> f64 {
        if self.contacts > 0 { f64::from(self.counters.query.held) / f64::from(self.contacts) } else { 0.0 }
    }
}

impl Tick {
    /// Returns an empty tick with memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            index: 0,
            dt: 0.0,
            probe: ProbeState::at(Pose::IDENTITY),
            tool_ba: Pose::IDENTITY,
            commanded: Wrench::ZERO,
            computed: Wrench::ZERO,
            transient: DVec3::ZERO,
            contacts: Vec::with_capacity(capacity),
            work: 0,
            work_allowed: None,
            unseen_separation: f64::INFINITY,
            contacts_between: 0,
            from_other: Wrench::ZERO,
            work_from_other: [0.0; 2],
            from_objects: Wrench::ZERO,
            work_from_objects: [0.0; 2],
            forces: Forces::new(capacity),
            times: StageTimes::default(),
            counters: Counters::default(),
        }
    }

    /// Returns the separation of the deepest contact, m; infinite without contacts.
    pub fn separation(&self) -> f64 {
        self.forces.clusters.iter().map(|cluster| cluster.separation).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if the step reached its work limit: some contacts are extrapolated from the
    /// last step, or some parts were not examined.
    pub fn is_late(&self) -> bool {
        self.counters.query.traversal.postponed > 0
    }

    /// Returns a summary without lists.
    pub fn summary(&self) -> TickSummary {
        TickSummary {
            index: self.index,
            dt: self.dt,
            probe: self.probe,
            tool_ba: self.tool_ba,
            commanded: self.commanded,
            computed: self.computed,
            contacts: self.contacts.len() as u32,
            contacts_between: self.contacts_between,
            clusters: self.forces.clusters.len() as u32,
            separation: self.separation(),
            work: self.work,
            work_allowed: self.work_allowed,
            unseen_separation: self.unseen_separation,
            work_from_other: self.work_from_other,
            work_from_objects: self.work_from_objects,
            times: self.times,
            counters: self.counters,
        }
    }

    /// Empties the tick for the next step, keeping its memory.
    pub(super) fn begin(&mut self, index: u64, probe: &ProbeState, dt: f64) {
        self.index = index;
        self.dt = dt;
        // A single-precision quaternion from a device is not exactly unit, and would scale vectors.
        let pose_ba = if probe.pose_ba.is_valid() { probe.pose_ba.unstretched() } else { probe.pose_ba };
        self.probe = ProbeState { pose_ba, ..*probe };
        self.tool_ba = pose_ba;
        self.commanded = Wrench::ZERO;
        self.computed = Wrench::ZERO;
        self.transient = DVec3::ZERO;
        self.contacts.clear();
        self.work = 0;
        self.work_allowed = None;
        self.unseen_separation = f64::INFINITY;
        self.contacts_between = 0;
        self.from_other = Wrench::ZERO;
        self.work_from_other = [0.0; 2];
        self.from_objects = Wrench::ZERO;
        self.work_from_objects = [0.0; 2];
        self.forces.clear();
        self.times = StageTimes::default();
        self.counters = Counters::default();
    }
}
