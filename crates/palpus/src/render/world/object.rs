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

/// A body that no hand holds, to be added to a [`World`](super::World).
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
    /// kg.
    Free(f64),
}

impl Object {
    /// A body that never moves, its frame placed in the world by `pose`, m.
    pub fn fixed(body: Arc<Body>, pose: Pose) -> Self {
        Self { body, pose, kind: Kind::Fixed }
    }

    /// A body that a host moves: see [`World::drive`](super::World::drive). It is at rest at `pose`
    /// until the first update.
    pub fn driven(body: Arc<Body>, pose: Pose) -> Self {
        Self { body, pose, kind: Kind::Driven }
    }

    /// A body of this density (kg/m³) that moves under contact, friction and gravity. At `pose`, at
    /// rest.
    ///
    /// An open mesh has the mass of its [ground](crate::body::MassSource).
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
pub(super) struct Thing {
    pub(super) body: Arc<Body>,
    pub(super) role: Role,
    /// m: no point of the mesh is farther from the frame's origin.
    pub(super) radius: f64,
    /// In the world.
    pub(super) pose: Pose,
    /// The centre of mass in the world, when the step begins.
    pub(super) center: DVec3,
    /// In the step before this one, if it was there.
    pub(super) last: Option<Pose>,
    /// Twist of the centre of mass if it is known before the step; else zero.
    pub(super) twist: Twist,
    /// The body takes part in this step.
    pub(super) there: bool,
    pub(super) part: Part,
}

#[derive(Clone, Debug)]
pub(super) enum Role {
    /// Held through a device: its number among the tools.
    Tool(usize),
    Free(Free),
    Driven(Driven),
    Fixed,
}

/// A body's part in the implicit step under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// True if the step moves the body.
    pub(super) is_moved: bool,
    /// True if another body touches it.
    pub(super) is_touched: bool,
    /// Matrix and right side of the body alone; and those with the contacts of the current round.
    pub(super) alone: (SpatialMatrix, Wrench),
    pub(super) system: (SpatialMatrix, Wrench),
    /// Its place among the bodies that are solved for together.
    pub(super) slot: usize,
    /// At the end of the step, of the centre of mass.
    pub(super) twist: Twist,
    /// Twist for which the forces of the current round were predicted, and the last round's
    /// solution minus its own.
    pub(super) guess: Twist,
    pub(super) residual: Twist,
    /// N·s and N·m·s: impulse of contacts with tools in the step, about the body's centre of mass.
    pub(super) from_tools: Wrench,
    /// The impulse of contacts with driven and free bodies.
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
    /// Begins a step, in which the body moves or not. Mass and load are set when the step is made.
    pub(super) fn begin(&mut self, is_moved: bool) {
        self.is_moved = is_moved;
        self.is_touched = false;
        (self.from_tools, self.from_objects) = (Wrench::ZERO, Wrench::ZERO);
    }
}

impl Thing {
    pub(super) fn place(&self) -> Place<'_> {
        Place { body: &self.body, pose: self.pose, center: self.center, twist: self.twist }
    }

    /// Sets the body's pose at the beginning of a step.
    pub(super) fn set_pose(&mut self, pose: Pose) {
        self.pose = pose;
        self.center = pose.point(self.body.mass().center_of_mass);
    }

    /// In a pair, the one that comes first is a.
    pub(super) fn rank(&self) -> u32 {
        match self.role {
            Role::Tool(_) => 0,
            Role::Free(_) => 1,
            Role::Driven(_) => 2,
            Role::Fixed => 3,
        }
    }
}
