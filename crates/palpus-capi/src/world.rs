//! Worlds: tools that are held through devices, and objects that are fixed, driven or free.

use std::sync::atomic::{AtomicU32, Ordering};

use palpus::glam::DVec3;
use palpus::{BodyId, Object, Pose, ProbeState, Settings, Tick, ToolId, Twist, WallClock, World};

use crate::body::{body_of, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::InArray;
use crate::result::{Fault, palpus_result};
use crate::value::{palpus_pose, palpus_twist, palpus_wrench};

/// Tools and objects, and the contacts between them. Only one thread may use a world at a time;
/// different worlds can run in parallel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_world {
    /// 0 if there is no world.
    pub id: u64,
}

/// An object in a world, or the body of a tool. Other worlds reject the handle with an error.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_object {
    /// 0 if there is no object.
    pub id: u64,
}

/// A tool of a world.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_tool {
    /// 0 if there is no tool.
    pub id: u64,
}

/// State of a device: pose and velocity of its grip.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_probe {
    /// Pose of the grip in the world. The axes of the grip are the tool's axes.
    pub pose: palpus_pose,
    /// Velocity of the grip, in the world's axes. Only dampers use the velocity.
    pub twist: palpus_twist,
}

/// Result of the last step for a tool.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_tick {
    /// Number of the step, counted from 0.
    pub index: u64,
    /// Wrench for the device: about the grip, in the world's axes, within the limits.
    pub wrench: palpus_wrench,
    /// The same wrench before the limits were applied.
    pub computed: palpus_wrench,
    /// Pose of the tool's frame in the world at which contacts were found. With a coupling, the
    /// tool's pose differs from the device's pose.
    pub tool: palpus_pose,
    /// Number of contacts. palpus_world_contacts returns them.
    pub contact_count: u64,
    /// Units of work that the query of this step took.
    pub work: u64,
    /// The pairs that the step skipped to stay within its work limit are at least this far apart,
    /// m. Infinite if the step skipped no pair.
    pub unseen_separation: f64,
    /// 1 if the force was reduced to its limit.
    pub saturated_force: u32,
    /// 1 if the torque was reduced to its limit.
    pub saturated_torque: u32,
    /// 1 if the wrench was not finite. The commanded wrench is then zero.
    pub non_finite_wrench: u32,
    /// 1 if the device's pose or twist was not valid.
    pub bad_state: u32,
}

impl palpus_probe {
    fn checked(&self) -> Result<(Pose, Twist), Fault> {
        Ok((self.pose.checked()?, self.twist.checked()?))
    }
}

impl From<&Tick> for palpus_tick {
    fn from(tick: &Tick) -> Self {
        let counters = &tick.counters;
        Self {
            index: tick.index,
            wrench: tick.commanded.into(),
            computed: tick.computed.into(),
            tool: tick.tool_ba.into(),
            contact_count: tick.contacts.len() as u64,
            work: tick.work,
            unseen_separation: tick.unseen_separation,
            saturated_force: counters.saturated_force,
            saturated_torque: counters.saturated_torque,
            non_finite_wrench: counters.non_finite_wrench,
            bad_state: counters.bad_state,
        }
    }
}

/// A world, and its objects and tools in the order of their handles.
pub(crate) struct Hosted {
    pub(crate) world: World,
    /// Differs between worlds, so that objects of other worlds are detected.
    serial: u32,
    objects: Vec<(BodyId, Motion)>,
    tools: Vec<ToolId>,
    /// States of the devices in the current step. The list is kept to reuse its memory.
    probes: Vec<ProbeState>,
    clock: WallClock,
}

/// How an object moves.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    Fixed,
    Driven,
    Free,
    Held,
}

pub(crate) static WORLDS: Table<Hosted> = Table::new(Kind::World);

/// Maximum number of bodies in one world. Every two bodies need memory for their pair.
const MOST_BODIES: usize = 1 << 14;

impl Hosted {
    pub(crate) fn new(settings: Settings) -> Result<Self, Fault> {
        static NEXT: AtomicU32 = AtomicU32::new(1);
        let world = World::new(settings)?;
        let serial = NEXT.fetch_add(1, Ordering::Relaxed);
        Ok(Self { world, serial, objects: Vec::new(), tools: Vec::new(), probes: Vec::new(), clock: WallClock::new() })
    }

    pub(crate) fn object(&self, object: palpus_object) -> Result<(BodyId, Motion), Fault> {
        let found = self.number(object.id, "object").and_then(|number| self.objects.get(number));
        found.copied().ok_or_else(|| wrong("object"))
    }

    pub(crate) fn tool(&self, tool: palpus_tool) -> Result<ToolId, Fault> {
        let found = self.number(tool.id, "tool").and_then(|number| self.tools.get(number));
        found.copied().ok_or_else(|| wrong("tool"))
    }

    /// Returns the index that is encoded in the id of an object or tool. `None` if the id belongs
    /// to another world or kind.
    fn number(&self, id: u64, kind: &str) -> Option<usize> {
        let number = (id as u32 & !TOOL) as usize;
        let is_own = (id >> 32) as u32 == self.serial && (id as u32 & TOOL != 0) == (kind == "tool");
        number.checked_sub(1).filter(|_| is_own)
    }

    fn id(&self, count: usize, mark: u32) -> u64 {
        u64::from(self.serial) << 32 | u64::from(count as u32 | mark)
    }

    pub(crate) fn add(&mut self, object: Object, motion: Motion) -> Result<palpus_object, Fault> {
        self.check_room()?;
        let id = self.world.add(object)?;
        self.objects.push((id, motion));
        Ok(palpus_object { id: self.id(self.objects.len(), 0) })
    }

    pub(crate) fn add_tool(&mut self, body: palpus_body, settings: Settings) -> Result<palpus_tool, Fault> {
        self.check_room()?;
        let tool = self.world.add_tool(body_of(body)?.body.clone(), settings)?;
        self.tools.push(tool);
        self.objects.push((self.world.body_of(tool), Motion::Held));
        self.probes.reserve(self.tools.len());
        Ok(palpus_tool { id: self.id(self.tools.len(), TOOL) })
    }

    /// Returns the object that is a tool's body.
    pub(crate) fn object_of(&self, tool: palpus_tool) -> Result<palpus_object, Fault> {
        let body = self.world.body_of(self.tool(tool)?);
        let place = self.objects.iter().position(|(id, _)| *id == body).ok_or_else(|| wrong("tool"))?;
        Ok(palpus_object { id: self.id(place + 1, 0) })
    }

    /// Returns the wrenches for the devices, in the order of the tools.
    pub(crate) fn wrenches(&self) -> impl Iterator<Item = palpus_wrench> {
        self.tools.iter().map(|&tool| self.world.tick(tool).commanded.into())
    }

    fn check_room(&self) -> Result<(), Fault> {
        if self.objects.len() < MOST_BODIES {
            return Ok(());
        }
        Err(Fault::value(format!("the world already has {MOST_BODIES} bodies, the maximum")))
    }

    /// Makes one step. Returns a fault for the first device whose state is invalid, if there is
    /// such a device.
    pub(crate) fn step(
        &mut self,
        probes: &InArray<palpus_probe>,
        count: usize,
        dt: f64,
    ) -> Result<Option<Fault>, Fault> {
        if count != self.tools.len() {
            let text = format!(
                "there are {count} probes, but the world has {} tools; pass one probe for each",
                self.tools.len()
            );
            return Err(Fault::value(text));
        }
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(Fault::value(format!("dt is {dt}, but must be a time above 0 s")));
        }
        self.probes.clear();
        let mut bad = None;
        for ((k, probe), &tool) in probes.iter().enumerate().zip(&self.tools) {
            let grip = self.world.tool_settings(tool).grip_a;
            let state = match probe.checked() {
                Ok((pose, twist)) => ProbeState::of_grip(&pose, &twist, grip),
                Err(fault) => {
                    bad.get_or_insert(fault.of(&format!("probes[{k}]")));
                    // The engine gives such a tool no force and continues with the other tools.
                    ProbeState::at(Pose { translation: DVec3::NAN, ..Pose::IDENTITY })
                }
            };
            self.probes.push(state);
        }
        self.world.step(&self.probes, dt, &self.clock);
        Ok(bad)
    }
}

/// Bit that marks the ids of tools.
const TOOL: u32 = 1 << 31;

fn wrong(kind: &str) -> Fault {
    Fault::new(palpus_result::PalpusErrorHandle, format!("the world has no such {kind}"))
}
