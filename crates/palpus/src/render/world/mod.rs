//! A world of many bodies: tools that devices move, and objects that are fixed, free, or driven by
//! a host program.
//!
//! ```
//! # use std::sync::Arc;
//! # use glam::DVec3;
//! # use palpus::algebra::{NoClock, Pose};
//! # use palpus::body::Body;
//! # use palpus::render::{Object, ProbeState, Settings, World};
//! # fn cube(side: f64) -> Arc<Body> {
//! #     let ends = [-0.5 * side, 0.5 * side];
//! #     let corners = ends.map(|x| ends.map(|y| ends.map(|z| DVec3::new(x, y, z))));
//! #     Arc::new(Body::from_convex(corners.as_flattened().as_flattened()).unwrap())
//! # }
//! # let (table, block, probe) = (cube(0.5), cube(0.04), cube(0.02));
//! let above = |z| Pose::from_translation(DVec3::Z * z);
//! let mut world = World::new(Settings::default())?;
//! world.add(Object::fixed(table, above(-0.25)))?;
//! let block = world.add(Object::free(block, above(0.0201), 700.0))?;
//! let tool = world.add_tool(probe, Settings::default())?;
//! world.set_gravity(DVec3::Z * -9.81);
//! for _ in 0..100 {
//!     world.step(&[ProbeState::at(above(0.049))], 1e-3, &NoClock);
//! }
//! assert!(world.tick(tool).commanded.force.z > 0.0, "the probe presses on the block");
//! assert!(world.pose(block).translation.z < 0.0201, "the block lies on the table");
//! # Ok::<(), palpus::render::SettingsError>(())
//! ```
//!
//! Each step moves all bodies:
//!
//! 1. *Begin*: tools with a coupling are at the pose of the last step, other tools are at their
//!    devices' poses. Driven bodies move on ([`World::drive`]).
//! 2. *Near*: find the bodies that may touch, by axis-aligned boxes (`broad.rs`).
//! 3. *Query* and *force*: compute contacts and forces separately for each pair of near bodies
//!    (`pair.rs`). Free bodies that lie still sleep: their contacts stay as they were, and no step
//!    moves them, until another body has a contact with them (`sleep.rs`). All queries of a step
//!    share the work limit. Pairs whose last query reached it come last, so they get what the
//!    others leave.
//! 4. *Step*: one implicit step moves each group of touching bodies (`solve.rs`). The step is
//!    linear in the velocities V′ at its end. Aᵢ and bᵢ are the matrix and the right-hand side of
//!    body i alone (a tool's coupling, a free body's mass and weight). K and l are the matrix and
//!    the right-hand side of the contacts between i and j, about i's centre of mass. T converts j's
//!    velocity into the velocity of j's point at i's centre of mass:
//!
//!    | Aᵢ + K   −K T        | Vᵢ′ = bᵢ + l
//!    | −Tᵀ K    Aⱼ + Tᵀ K T | Vⱼ′ = bⱼ − Tᵀ l
//!
//!    Without friction and shading, the matrix is symmetric and positive definite at any stiffness,
//!    mass and speed. Forces between two bodies are equal and opposite within the step, so contacts
//!    conserve the total momentum. If a tool touches no movable body, its wrench is bit-identical
//!    to the wrench in a world without movable bodies. If the queries do not allow the whole motion
//!    of a group (`reach.rs`), its bodies move by a fraction of the step. With a work limit, this
//!    can last for many steps; then the impulses on free bodies are multiplied by the fraction. So
//!    the group moves slower, and gains no energy.
//! 5. *Feel*: add the vibration of impacts to each tool's wrench, and limit it to the device's
//!    limits.
//!
//! A separate step for each body, with the last poses of the other bodies, would fail, because
//! contacts are very stiff. If a tool and a body move together at speed v, the body's outdated pose
//! would brake the tool with 2 k h v (34 N at 0.1 m/s on a usual device). If the step also used the
//! body's last velocity, the two bodies would oscillate.
//!
//! Memory is allocated when bodies are added. A step allocates no memory, and no input of a device
//! or a host makes it panic.

mod broad;
mod driven;
mod free;
mod held;
mod islands;
mod line_search;
mod object;
mod pair;
mod settle;
mod sleep;
mod solve;
mod stillness;
#[cfg(test)]
mod tests;
mod tools;
mod turn;

use std::sync::Arc;

use glam::DVec3;

use self::broad::Broad;
use self::driven::Driven;
use self::free::Free;
use self::held::Held;
use self::islands::Islands;
use self::object::{Kind, Part, Role, WorldBody};
use self::pair::{Pair, common, mirrored};
use self::solve::BlockSystem;
use super::pacer::{Pacer, WorkLimit};
use super::{Settings, SettingsError, VirtualCoupling};
use crate::algebra::tolerance::TOOL_OFFSET;
use crate::algebra::{Pose, Twist, Wrench};
use crate::body::Body;
use crate::detect::{Contact, Helper};

pub use object::{BodyId, Object, ToolId};

/// Renders the contact of tools with objects and with each other. See the module's description.
#[derive(Clone, Debug)]
pub struct World {
    /// Settings of contacts between objects.
    settings: Settings,
    /// m/s².
    gravity: DVec3,
    things: Vec<WorldBody>,
    tools: Vec<Held>,
    pairs: Vec<Pair>,
    /// Index of the pair of bodies i > j, at i (i − 1) / 2 + j.
    table: Vec<u32>,
    /// The pairs that are near in this step.
    near: Vec<u32>,
    /// The near pairs of the last step.
    were_near: Vec<u32>,
    broad: Broad,
    islands: Islands,
    system: BlockSystem,
    /// True if the systems of the next rounds contain the change of friction limits with the loads
    /// (`line_search.rs`).
    limits_follow: bool,
    /// Bodies farther apart than this plus their motion do not touch, m.
    margin: f64,
    /// The margin of the boxes of fixed bodies, m; NaN if one of these bodies was added or moved.
    boxed_with: f64,
    steps: u64,
    limit: WorkLimit,
    pacer: Pacer,
    /// Allowed work of the queries in this step.
    allowed: Option<u64>,
    counters: WorldCounters,
}

/// Counts of a world's step. Other counts are in the ticks of its tools.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldCounters {
    /// Number of pairs of bodies that were queried.
    pub pairs: u32,
    /// Number of pairs of bodies with contacts.
    pub touching: u32,
    /// Number of groups of touching bodies, each moved by one implicit step.
    pub islands: u32,
    /// Number of bodies in the largest group.
    pub largest: u32,
    /// Number of groups in which the last round still changed the set of pressing contacts or a
    /// friction force.
    pub unsettled: u32,
    /// Number of groups whose step was shortened, so that no point moves farther than the distance
    /// within which contacts are searched.
    pub bounded: u32,
    /// Number of groups without a solution. Their free bodies stop, and their tools move to the
    /// devices' poses.
    pub reset: u32,
    /// Number of driven bodies whose last update is too old.
    pub overdue: u32,
    /// Number of free bodies that lie still, so that the step does not move them.
    pub asleep: u32,
}

/// No pair.
const NONE: u32 = u32::MAX;
/// Approximate largest number of corners of a patch, used to allocate memory.
const CORNERS: usize = 64;
/// Largest number of contacts of two objects. A sample has some hundreds of pairs of pieces, with
/// a few corners each.
const OBJECTS_CAPACITY: usize = 4096;
/// Largest number of contacts in a tool's tick, as a multiple of the capacity in its settings.
const SHOWN: usize = 4;

impl World {
    /// Returns an empty world without gravity. `settings` apply to contacts between objects; each
    /// tool has its own settings.
    ///
    /// Contacts between objects are as stiff as contacts of a tool with a coupling, since an
    /// implicit step moves the objects.
    ///
    /// # Errors
    /// Fails if a setting is invalid.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings.validate()?;
        let contact_offset = TOOL_OFFSET * settings.contact_tolerance;
        let coupling = settings.coupling.unwrap_or(VirtualCoupling { contact_offset, ..VirtualCoupling::SLACK });
        Ok(Self {
            settings: Settings { coupling: Some(coupling), ..settings },
            gravity: DVec3::ZERO,
            things: Vec::new(),
            tools: Vec::new(),
            pairs: Vec::new(),
            table: Vec::new(),
            near: Vec::new(),
            were_near: Vec::new(),
            broad: Broad::default(),
            islands: Islands::default(),
            system: BlockSystem::new(0),
            limits_follow: true,
            margin: settings.contact_tolerance,
            boxed_with: f64::NAN,
            steps: 0,
            limit: WorkLimit::default(),
            pacer: Pacer::NEW,
            allowed: None,
            counters: WorldCounters::default(),
        })
    }

    /// Adds an object.
    ///
    /// # Errors
    /// Fails if the pose is invalid, or if the density or mass is not finite and positive.
    pub fn add(&mut self, object: Object) -> Result<BodyId, SettingsError> {
        let Object { body, pose, kind } = object;
        let refused = |field, value, rule| Err(SettingsError { field, value, rule });
        if !pose.is_valid() {
            return refused("pose", pose.rotation.length(), "finite, with a quaternion of length 1");
        }
        let role = match kind {
            Kind::Fixed => Role::Fixed,
            Kind::Driven => Role::Driven(Driven::at(pose)),
            Kind::Free(mass) if mass > 0.0 && mass.is_finite() => {
                Role::Free(Free::new(&body, mass, self.settings.contact_offset()))
            }
            Kind::Free(mass) => return refused("mass", mass, "finite and greater than 0"),
        };
        Ok(self.add_thing(body, role, pose.unstretched()))
    }

    /// Adds a tool with its own body and settings. The tool's state is appended to the probe
    /// states of [`Self::step`].
    ///
    /// # Errors
    /// Fails if a setting is invalid.
    pub fn add_tool(&mut self, probe: Arc<Body>, settings: Settings) -> Result<ToolId, SettingsError> {
        settings.validate()?;
        let number = self.tools.len();
        self.margin = self.margin.max(settings.contact_tolerance);
        self.tools.push(Held::new(self.things.len(), &probe, &settings));
        self.add_thing(probe, Role::Tool(number), Pose::IDENTITY);
        Ok(ToolId(number))
    }

    /// Sets the gravity of free bodies, m/s², along the world's axes. A vector that is not finite
    /// counts as zero.
    pub fn set_gravity(&mut self, gravity: DVec3) {
        self.gravity = if gravity.is_finite() { gravity } else { DVec3::ZERO };
        self.wake_all();
    }

    /// Sets the pose and the velocity of a driven body (m/s and rad/s; the linear part is the
    /// velocity of its frame's origin).
    ///
    /// Call this at the host's rate. Between two calls the body moves on, so the hand does not feel
    /// the calls as steps. Returns false, and changes nothing, if the body is not driven or a
    /// number is not finite.
    pub fn drive(&mut self, body: BodyId, pose: Pose, velocity: Twist) -> bool {
        let Some(thing) = self.things.get_mut(body.0) else { return false };
        let is_finite = velocity.angular.is_finite() && velocity.linear.is_finite();
        let Role::Driven(driven) = &mut thing.role else { return false };
        if !(pose.is_valid() && is_finite) {
            return false;
        }
        driven.update(pose.unstretched(), velocity);
        true
    }

    /// Moves an object to another pose, at rest, and drops its contact state. Returns false for a
    /// tool or an invalid pose.
    pub fn put(&mut self, body: BodyId, pose: Pose) -> bool {
        let contact_offset = self.settings.contact_offset();
        let Some(thing) = self.things.get_mut(body.0).filter(|_| pose.is_valid()) else { return false };
        let pose = pose.unstretched();
        match &mut thing.role {
            Role::Tool(_) => return false,
            Role::Free(free) => *free = Free::new(&thing.body, free.mass, contact_offset),
            Role::Driven(driven) => *driven = Driven::at(pose),
            Role::Fixed => {}
        }
        (thing.last, thing.twist) = (None, Twist::default());
        thing.set_pose(pose);
        self.boxed_with = f64::NAN;
        self.wake_all();
        for pair in self.pairs.iter_mut().filter(|pair| pair.bodies.contains(&body.0)) {
            pair.clear();
        }
        true
    }

    /// Sets the velocity of a free body (m/s and rad/s, of its centre of mass). Returns false if
    /// the body is not free, or if the velocity or its momentum is not finite.
    pub fn throw(&mut self, body: BodyId, twist: Twist) -> bool {
        let Some(thing) = self.things.get_mut(body.0) else { return false };
        let WorldBody { role: Role::Free(free), pose, .. } = thing else { return false };
        let is_finite = twist.angular.is_finite() && twist.linear.is_finite();
        let is_thrown = is_finite && free.set_twist(pose, &twist);
        if is_thrown {
            thing.wake();
        }
        is_thrown
    }

    /// Returns the pose of a body in the world. For a tool with a coupling, this is the tool's
    /// pose, not the device's.
    pub fn pose(&self, body: BodyId) -> Pose {
        self.things[body.0].pose
    }

    /// Returns the velocity of a body's centre of mass and its angular velocity, m/s and rad/s.
    pub fn twist(&self, body: BodyId) -> Twist {
        let thing = &self.things[body.0];
        match &thing.role {
            Role::Free(free) => free.twist(&thing.pose),
            Role::Tool(_) if thing.part.is_moved => thing.part.twist,
            _ => thing.twist,
        }
    }

    /// Returns the momentum of a free body (N·s, and N·m·s about its centre of mass); zero for any
    /// other body.
    pub fn momentum(&self, body: BodyId) -> Wrench {
        match &self.things[body.0].role {
            Role::Free(free) => free.momentum,
            _ => Wrench::ZERO,
        }
    }

    /// Returns the contacts of two bodies in the last step, in the world's frame. In these
    /// contacts, `of` is body a.
    pub fn contacts(&self, of: BodyId, with: BodyId) -> impl Iterator<Item = Contact> {
        let pair = self.pair(of.0, with.0).map(|k| &self.pairs[k]);
        let turned = pair.is_some_and(|pair| pair.bodies[0] != of.0);
        let contacts = pair.map_or(&[][..], |pair| &pair.contacts);
        contacts.iter().map(move |contact| if turned { mirrored(contact) } else { *contact })
    }

    /// Returns the counts of the last step.
    pub fn counters(&self) -> &WorldCounters {
        &self.counters
    }

    /// Returns the settings of the contacts of two bodies; `None` if each of
    /// them is fixed or driven.
    pub fn settings_between(&self, one: BodyId, other: BodyId) -> Option<&Settings> {
        self.pair(one.0, other.0).map(|k| self.pairs[k].settings())
    }

    /// Returns the geometry of a body.
    pub fn body(&self, body: BodyId) -> &Arc<Body> {
        &self.things[body.0].body
    }

    /// Returns a helper, with which another thread can take part in the steps from now on. It helps
    /// only with pairs of bodies that are in the world now.
    pub fn helper(&self) -> Helper {
        self.pairs.iter().fold(Helper::default(), |helper, pair| helper.and(pair.helper()))
    }

    /// Limits the work of all queries in each of the next steps. At first, the limit is
    /// [`WorkLimit::TimeBudget`]. Pairs that the queries do not reach keep their contacts,
    /// extrapolated, and come first in the next step.
    pub fn allow(&mut self, limit: WorkLimit) {
        self.limit = limit;
    }

    /// Drops all state except the poses and velocities of objects. The next step runs like the
    /// first step.
    pub fn clear(&mut self) {
        self.pairs.iter_mut().for_each(Pair::clear);
        self.tools.iter_mut().for_each(Held::clear);
        for thing in &mut self.things {
            thing.last = None;
            // The next step would begin its rounds with this twist.
            thing.part.twist = Twist::default();
        }
        self.wake_all();
    }

    fn add_thing(&mut self, body: Arc<Body>, role: Role, pose: Pose) -> BodyId {
        let number = self.things.len();
        self.boxed_with = f64::NAN;
        self.wake_all();
        self.broad.add();
        self.islands.add();
        let center = pose.point(body.mass().center_of_mass);
        let bounds = body.mesh().bounds();
        let radius = bounds.max.abs().max(bounds.min.abs()).length();
        self.things.push(WorldBody {
            radius,
            body,
            role,
            pose,
            center,
            last: None,
            twist: Twist::default(),
            there: true,
            part: Part::NONE,
        });
        for other in 0..number {
            let ranks = [other, number].map(|i| self.things[i].rank());
            // Two fixed or driven bodies do not interact.
            let pair = if ranks.iter().all(|&rank| rank >= 2) {
                NONE
            } else {
                let bodies = if ranks[0] <= ranks[1] { [other, number] } else { [number, other] };
                let law = self.law(bodies);
                let most = bodies.iter().map(|&i| self.things[i].body.polytopes().len()).product::<usize>();
                let law = Settings { capacity: law.capacity.min(most.saturating_mul(CORNERS)), ..law };
                let has_tool = ranks.contains(&0);
                self.pairs.push(Pair::new(bodies, bodies.map(|i| self.things[i].body.clone()), law, has_tool));
                self.pairs.len() as u32 - 1
            };
            self.table.push(pair);
        }
        for list in [&mut self.near, &mut self.were_near] {
            list.clear();
            list.reserve(self.pairs.len());
        }
        self.make_room();
        BodyId(number)
    }

    /// Allocates memory for the contacts in tools' ticks, and for the largest group.
    fn make_room(&mut self) {
        for held in &mut self.tools {
            let own = self.pairs.iter().filter(|pair| pair.bodies.contains(&held.thing));
            let all: usize = own.map(|pair| pair.settings().capacity).sum();
            held.make_room(all.min(SHOWN * held.settings.capacity));
        }
        let moved = self.things.iter().filter(|thing| thing.rank() < 2).count();
        self.system = BlockSystem::new(moved);
    }

    /// Returns the settings of the contacts of two bodies.
    fn law(&self, bodies: [usize; 2]) -> Settings {
        let own = bodies.map(|i| match self.things[i].role {
            Role::Tool(k) => Some(&self.tools[k].settings),
            _ => None,
        });
        match own {
            [Some(one), Some(other)] => common([one, other]),
            [Some(settings), None] | [None, Some(settings)] => settings.held(),
            [None, None] => {
                let law = self.settings.held();
                Settings { capacity: law.capacity.min(OBJECTS_CAPACITY), ..law }
            }
        }
    }

    /// Returns the index of the pair of two bodies; `None` if these bodies do not interact.
    fn pair(&self, i: usize, j: usize) -> Option<usize> {
        let (low, high) = (i.min(j), i.max(j));
        let place = (high * high.saturating_sub(1) / 2 + low, low < high && high < self.things.len());
        Some(place)
            .filter(|(_, is_pair)| *is_pair)
            .map(|(at, _)| self.table[at])
            .filter(|&k| k != NONE)
            .map(|k| k as usize)
    }
}
