//! Worlds: tools that are held through devices, and objects that are fixed, driven or free.

use std::sync::atomic::{AtomicU32, Ordering};

use palpus::glam::DVec3;
use palpus::{BodyId, NoClock, Object, Pose, ProbeState, Settings, Tick, ToolId, Twist, World};

use crate::body::{body_of, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::InArray;
use crate::result::{Fault, palpus_result};
use crate::value::{palpus_pose, palpus_twist, palpus_wrench};

/// Tools and objects, and the contacts between them. One thread at a time; any number of worlds at
/// once.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_world {
    /// 0 for none.
    pub id: u64,
}

/// An object or a tool's body in a world. Of other worlds it is refused.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_object {
    /// 0 for none.
    pub id: u64,
}

/// A tool of a world.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_tool {
    /// 0 for none.
    pub id: u64,
}

/// State of a device: pose and motion of its grip.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_probe {
    /// The grip in the world, with the tool's axes.
    pub pose: palpus_pose,
    /// Twist of the grip, along the world's axes. Only dampers use it.
    pub twist: palpus_twist,
}

/// Result of the last step for a tool.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_tick {
    /// Counts the steps from 0.
    pub index: u64,
    /// For the device: about the grip, along the world's axes, within the limits.
    pub wrench: palpus_wrench,
    /// The same before the limits.
    pub computed: palpus_wrench,
    /// Pose of the tool's frame in the world, at which contacts were looked for. With a coupling
    /// the tool is not where the device is.
    pub tool: palpus_pose,
    /// See palpus_world_contacts.
    pub contact_count: u64,
    /// Units of work that the step's query did.
    pub work: u64,
    /// Pairs that the step skipped to keep to its work are at least this far apart, m; infinite if
    /// it skipped none.
    pub unseen_separation: f64,
    /// 1 if the force was cut to its limit.
    pub saturated_force: u32,
    /// 1 if the torque was cut to its limit.
    pub saturated_torque: u32,
    /// 1 if the wrench was not finite; it is zero then.
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

/// A world and what its handles name.
pub(crate) struct Hosted {
    pub(crate) world: World,
    /// Differs between worlds, so that objects of others are known.
    serial: u32,
    objects: Vec<(BodyId, Motion)>,
    tools: Vec<ToolId>,
    /// States of the devices in the current step, kept for their memory.
    probes: Vec<ProbeState>,
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

/// Most bodies of one world: there is a pair for each two of them.
const MOST_BODIES: usize = 1 << 14;

impl Hosted {
    pub(crate) fn new(settings: Settings) -> Result<Self, Fault> {
        static NEXT: AtomicU32 = AtomicU32::new(1);
        let world = World::new(settings)?;
        let serial = NEXT.fetch_add(1, Ordering::Relaxed);
        Ok(Self { world, serial, objects: Vec::new(), tools: Vec::new(), probes: Vec::new() })
    }

    pub(crate) fn object(&self, object: palpus_object) -> Result<(BodyId, Motion), Fault> {
        let found = self.number(object.id, "object").and_then(|number| self.objects.get(number));
        found.copied().ok_or_else(|| wrong("object"))
    }

    pub(crate) fn tool(&self, tool: palpus_tool) -> Result<ToolId, Fault> {
        let found = self.number(tool.id, "tool").and_then(|number| self.tools.get(number));
        found.copied().ok_or_else(|| wrong("tool"))
    }

    /// The place that the id of an object or tool of this world says.
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

    /// The object that is a tool's body.
    pub(crate) fn object_of(&self, tool: palpus_tool) -> Result<palpus_object, Fault> {
        let body = self.world.body_of(self.tool(tool)?);
        let place = self.objects.iter().position(|(id, _)| *id == body).ok_or_else(|| wrong("tool"))?;
        Ok(palpus_object { id: self.id(place + 1, 0) })
    }

    /// Wrenches for the devices, in the tools' order.
    pub(crate) fn wrenches(&self) -> impl Iterator<Item = palpus_wrench> {
        self.tools.iter().map(|&tool| self.world.tick(tool).commanded.into())
    }

    fn check_room(&self) -> Result<(), Fault> {
        if self.objects.len() < MOST_BODIES {
            return Ok(());
        }
        Err(Fault::value(format!("the world has {MOST_BODIES} bodies already, the most that it can have")))
    }

    /// Makes one step; afterwards reports the first device whose state is invalid, if any.
    pub(crate) fn step(
        &mut self,
        probes: &InArray<palpus_probe>,
        count: usize,
        dt: f64,
    ) -> Result<Option<Fault>, Fault> {
        if count != self.tools.len() {
            let text = format!("there are {count} probes, but must be one for each of {} tools", self.tools.len());
            return Err(Fault::value(text));
        }
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(Fault::value(format!("dt is {dt}, but must be a time in s, more than 0")));
        }
        self.probes.clear();
        let mut bad = None;
        for ((k, probe), &tool) in probes.iter().enumerate().zip(&self.tools) {
            let grip = self.world.tool_settings(tool).grip_a;
            let state = match probe.checked() {
                Ok((pose, twist)) => ProbeState::of_grip(&pose, &twist, grip),
                Err(fault) => {
                    bad.get_or_insert(fault.of(&format!("probes[{k}]")));
                    // The engine gives such a tool no force, and goes on with the others.
                    ProbeState::at(Pose { translation: DVec3::NAN, ..Pose::IDENTITY })
                }
            };
            self.probes.push(state);
        }
        self.world.step(&self.probes, dt, &NoClock);
        Ok(bad)
    }
}

/// Marks the ids of tools.
const TOOL: u32 = 1 << 31;

fn wrong(kind: &str) -> Fault {
    Fault::new(palpus_result::PalpusErrorHandle, format!("the world has no such {kind}"))
}
