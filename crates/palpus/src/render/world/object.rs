//! Objects that a user adds to a world, and their state.

use std::sync::Arc;

use glam::DVec3;

use super::driven::Driven;
use super::free::Free;
use super::pair::Place;
use crate::algebra::{Pose, SpatialMatrix, Twist, Wrench};
use crate::body::Body;

/// Identifies a body of a world, tools included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub(super) usize);

/// Identifies a tool of a world; the first tool that was added is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ToolId(pub(super) usize);

/// A body that is not a tool, for [`World::add`](super::World::add).
#[derive(Clone, Debug)]
pub struct Object {
    pub(super) body: Arc<Body>,
    pub(super) pose: Pose,
    pub(super) kind: Kind,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Fixed,
    Driven,
    /// Mass, kg.
    Free(f64),
}

impl Object {
    /// A body that never moves. `pose` places its frame in the world (m).
    pub fn fixed(body: Arc<Body>, pose: Pose) -> Self {
        Self { body, pose, kind: Kind::Fixed }
    }

    /// A body that a host program moves: see [`World::drive`](super::World::drive). It rests at
    /// `pose` until the first update.
    pub fn driven(body: Arc<Body>, pose: Pose) -> Self {
        Self { body, pose, kind: Kind::Driven }
    }

    /// A body of this density (kg/m³) that moves under contact, friction and gravity. It starts at
    /// rest at `pose`. If it overlaps another body there, it moves out of it slowly, at about
    /// 50 mm/s.
    ///
    /// The volume of an open mesh depends on its [mass source](crate::body::MassSource).
    pub fn free(body: Arc<Body>, pose: Pose, density: f64) -> Self {
        let mass = density * body.mass().volume;
        Self { body, pose, kind: Kind::Free(mass) }
    }

    /// A free body of this mass (kg), at rest at `pose`. See [`Self::free`].
    pub fn free_of_mass(body: Arc<Body>, pose: Pose, mass: f64) -> Self {
        Self { body, pose, kind: Kind::Free(mass) }
    }
}

/// A body of a world.
#[derive(Clone, Debug)]
pub(super) struct WorldBody {
    pub(super) body: Arc<Body>,
    pub(super) role: Role,
    /// Largest distance of a point of the mesh from the frame's origin, m.
    pub(super) radius: f64,
    /// Pose in the world.
    pub(super) pose: Pose,
    /// The centre of mass in the world, when the step begins.
    pub(super) center: DVec3,
    /// Pose in the last step, if the body took part in that step.
    pub(super) last: Option<Pose>,
    /// Twist of the centre of mass if it is known before the step; otherwise zero.
    pub(super) twist: Twist,
    /// True if the body takes part in this step.
    pub(super) there: bool,
    pub(super) part: Part,
}

#[derive(Clone, Debug)]
pub(super) enum Role {
    /// A tool, with its index among the tools.
    Tool(usize),
    Free(Free),
    Driven(Driven),
    Fixed,
}

/// State of a body in the current implicit step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// True if the step moves the body.
    pub(super) is_moved: bool,
    /// True if another body touches it.
    pub(super) is_touched: bool,
    /// Matrix and right-hand side of the body without contacts.
    pub(super) alone: (SpatialMatrix, Wrench),
    /// Matrix and right-hand side with the contacts of the current round.
    pub(super) system: (SpatialMatrix, Wrench),
    /// Index of the body in its group.
    pub(super) slot: usize,
    /// Twist of the centre of mass at the end of the step.
    pub(super) twist: Twist,
    /// Twist for which the forces of the current round were predicted.
    pub(super) guess: Twist,
    /// The last round's solution minus the last round's `guess`.
    pub(super) residual: Twist,
    /// Impulse of contacts with tools in the step, N·s, and N·m·s about the body's centre of mass.
    pub(super) from_tools: Wrench,
    /// Impulse of contacts with driven and free bodies, in the same units.
    pub(super) from_objects: Wrench,
}

const STILL: Twist = Twist { angular: DVec3::ZERO, linear: DVec3::ZERO };

impl Part {
    pub(super) const NONE: Self = Self {
        is_moved: false,
        is_touched: false,
        alone: (SpatialMatrix::ZERO, Wrench::ZERO),
        system: (SpatialMatrix::ZERO, Wrench::ZERO),
        slot: usize::MAX,
        twist: STILL,
        guess: STILL,
        residual: STILL,
        from_tools: Wrench::ZERO,
        from_objects: Wrench::ZERO,
    };
}

impl Part {
    /// Begins a step. `is_moved` is true if the step moves the body. Matrix and right-hand side are
    /// set later.
    pub(super) fn begin(&mut self, is_moved: bool) {
        self.is_moved = is_moved;
        self.is_touched = false;
        (self.from_tools, self.from_objects) = (Wrench::ZERO, Wrench::ZERO);
    }
}

impl WorldBody {
    pub(super) fn place(&self) -> Place<'_> {
        Place { body: &self.body, pose: self.pose, center: self.center, twist: self.twist }
    }

    /// Sets the body's pose at the beginning of a step.
    pub(super) fn set_pose(&mut self, pose: Pose) {
        self.pose = pose;
        self.center = pose.point(self.body.mass().center_of_mass);
    }

    /// Returns the rank of the body's kind: in a pair, the body with the lower rank is a.
    pub(super) fn rank(&self) -> u32 {
        match self.role {
            Role::Tool(_) => 0,
            Role::Free(_) => 1,
            Role::Driven(_) => 2,
            Role::Fixed => 3,
        }
    }
}
