//! The tool: the probe as a rigid body between device and contacts, moved implicitly \[Colgate 1995; Otaduy and Lin 2006,
//! "OL06"\].
//!
//! Once a tick, after the contacts at the tool's present pose are known, one step of backward Euler over h seconds with one
//! Newton iteration. Every force is linearised in the velocity V′ that the tool has at the end of the step:
//!
//! 1. *Inertia*: M (V′ − V) / h, with M from nothing at the contact tolerance to the whole tool at the skin. A tool in free air
//!    has no mass: each step of the device's encoders would throw it, and the hand would feel that. Mass that comes in is at rest
//!    and mass that goes takes its momentum along, so that neither brings energy.
//! 2. *Coupling*: k (e − h v′) + b (v_d − v′) at the grip, the same for rotation, with e from the tool's grip to the device's.
//! 3. *Contacts*: k w − (h k + b) n·v′ along each cluster's normal, with b in proportion to k. One that would pull has let go and is left out, and one
//!    that does not push yet is in when the tool comes near enough; which ones press is found by solving again, a bounded number of times.
//! 4. *Friction*: −c (z + h v′) in the tangent plane and −c R² (φ + h ω′) about the normal, with c the contact's k_t while it
//!    sticks, and so small that both together are μ F_n when it slides. The same rounds find c.
//! 5. *Solve* the 6 × 6 system, move the tool, but no point of it farther than contacts were looked ahead for: that is at least
//!    two skins, and twice the way of the last step. So nothing can be jumped over, at any speed. Where the query's work is bounded and
//!    nothing is near, it does not come nearer than the skin to what was not looked at, and waits for it; among contacts it goes on
//!    slowly, since a force that holds it back there is one that no contact makes. The coupling's force in V′, reversed, is what the device feels.
//!
//! All matrices that are added are positive semi-definite, the coupling's is definite: the step has a solution at any stiffness,
//! mass 0 included, and no gain of it grows. The spring's force levels off at what the device can give as of now, so that a hand that presses
//! harder than the device can answer does not press the tool into the wall.
//!
//! Deviations from OL06: the derivatives of normals and lever arms are left out (they can make the matrix indefinite, and
//! are small over a tick), and so is the gyroscopic torque (at the speeds of a hand, less than a device's friction).

use glam::{DMat3, DQuat, DVec3};

use super::anchor::Anchor;
use super::touches::Touches;
use super::{Forces, Limits, ProbeState, Settings, VirtualCoupling};
use crate::algebra::tolerance::{COUPLING_ROUNDS, REACH_CREEP, REACH_FADE, REACH_GROWTH, REACH_LEAST, TOOL_FASTEST};
use crate::algebra::{Pose, SpatialMatrix, Twist, Wrench};
use crate::body::Body;

/// What happened in one step of the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ToolCounters {
    /// Times that the system was solved.
    pub rounds: u32,
    /// Clusters that let go within the step.
    pub released: u32,
    /// 1 if the last round still changed something.
    pub unsettled: u32,
    /// 1 if the step was cut, so that nothing moves beyond what was looked ahead for.
    pub bounded: u32,
    /// 1 if the system had no finite solution; the tool was put to where the device is.
    pub reset: u32,
}

/// The probe as a body of its own, and the memory for its step.
#[derive(Clone, Debug)]
pub struct Tool {
    coupling: VirtualCoupling,
    limits: Limits,
    /// What the device can give as of now, where that is less.
    available: Limits,
    /// In a's frame: where it is held.
    grip_a: DVec3,
    /// In a's frame: the centre of mass.
    center_a: DVec3,
    /// N/m: of a contact alone.
    contact_stiffness: f64,
    /// s: damping of contacts over their stiffness, so that those which share a stiffness share a damping alike.
    contact_lag: f64,
    /// kg·m² about the centre of mass, along a's axes.
    inertia_a: DMat3,
    /// a placed in b's frame; `None` before the first step.
    pose_ba: Option<Pose>,
    /// Its linear part is that of the centre of mass.
    twist: Twist,
    /// From the centre of mass to the farthest corner of the probe's box, m.
    radius: f64,
    /// m: no point of the tool moves farther in the next step. Contacts are looked for that much beyond the skin.
    reach: f64,
    /// m: the tool may move so far before it meets anything that this tick's query did not look at.
    clear: f64,
    anchor: Anchor,
    touches: Touches,
}

/// A step that has begun.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    /// Where the tool is.
    pose: Pose,
    bond: Bond,
    /// Steps 1 and 2.
    system: SpatialMatrix,
    /// Their right side times h.
    load: Wrench,
}

/// Step 2, ready to be added.
#[derive(Clone, Copy, Debug)]
struct Bond {
    /// From the centre of mass to the grip, m.
    offset: DVec3,
    /// From the tool's grip to the device's, m.
    stretch: DVec3,
    /// From the tool's orientation to the device's, rad.
    turn: DVec3,
    /// Of the device's grip.
    device: Twist,
    stiffness: f64,
    angular_stiffness: f64,
    damping: f64,
    angular_damping: f64,
}

impl Tool {
    /// A tool that will begin where the device is first seen; memory for `settings.capacity` contacts.
    pub fn new(probe: &Body, coupling: VirtualCoupling, settings: &Settings) -> Self {
        let mut tool = Self {
            coupling,
            limits: settings.limits,
            available: Limits::UNLIMITED,
            contact_stiffness: 0.0,
            contact_lag: 0.0,
            grip_a: settings.grip_a,
            center_a: probe.mass().center_of_mass,
            inertia_a: DMat3::ZERO,
            pose_ba: None,
            twist: Twist::default(),
            radius: 0.0,
            reach: 0.0,
            clear: f64::INFINITY,
            anchor: Anchor::AT_GRIP,
            touches: Touches::new(settings.capacity),
        };
        tool.set(probe, coupling, settings);
        tool
    }

    /// Goes on with another coupling and other settings of the same capacity, where it is and as it moves.
    pub fn set(&mut self, probe: &Body, coupling: VirtualCoupling, settings: &Settings) {
        let hard = settings.held().stiffness;
        self.coupling = coupling.softened(settings.stiffness, hard);
        self.limits = settings.limits;
        self.contact_stiffness = hard;
        self.contact_lag = settings.damping / hard;
        self.grip_a = settings.grip_a;
        let mass = probe.mass();
        self.inertia_a = mass.inertia * (coupling.mass / mass.volume);
        let bounds = probe.mesh().bounds();
        self.radius = (bounds.max - self.center_a).max(self.center_a - bounds.min).length();
        self.reach = self.reach.max(REACH_LEAST * coupling.skin);
    }

    /// The device can give no more than `available` from now on.
    pub fn set_available(&mut self, available: &Limits) {
        self.available = *available;
    }

    /// Where it is; where the device is, before the first step and after [`Self::clear`].
    pub fn pose_ba(&mut self, device: &ProbeState) -> Pose {
        if let Some(pose) = self.pose_ba {
            return pose;
        }
        let to_center = device.pose_ba.vector(self.center_a - self.grip_a);
        self.twist = Twist { linear: device.twist.at(to_center), ..device.twist };
        self.anchor = Anchor::AT_GRIP;
        self.pose_ba = Some(device.pose_ba);
        device.pose_ba
    }

    /// Lets go of everything: the next step begins where the device is.
    pub fn clear(&mut self) {
        self.touches.clear();
        self.pose_ba = None;
    }

    /// One step of `h` seconds towards `device`, under the `forces` that contacts exert where the tool is now.
    ///
    /// Answers the wrench on the device about its grip, in b's frame.
    pub fn step(&mut self, device: &ProbeState, forces: &Forces, h: f64) -> (Wrench, ToolCounters) {
        if !(h > 0.0 && h.is_finite()) {
            return (Wrench::ZERO, ToolCounters::default());
        }
        let begun = self.begin(device, forces, forces.clusters.is_empty(), h);
        let mut counters = ToolCounters::default();
        let Some(twist) = self.settle(&begun, h, &mut counters) else {
            self.clear();
            counters.reset = 1;
            return (Wrench::ZERO, counters);
        };
        let share = self.share_within_reach(&twist, h);
        counters.bounded = u32::from(share < 1.0);
        (self.end(&begun, twist * share, h), counters)
    }

    /// N: what the hardest pressed contact bore alone at the end of the last step.
    pub(super) fn pressed(&self) -> f64 {
        self.touches.pressed(self.contact_stiffness)
    }

    /// m: no point of the tool moves farther in the next step.
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    /// What this tick's query did not look at is at least `clear` (m) beyond the skin.
    pub(super) fn see(&mut self, clear: f64) {
        self.clear = clear.max(0.0);
    }

    /// The same of another tool, which comes half of the way.
    pub(super) fn see_other(&mut self, clear: f64) {
        self.clear = self.clear.min(0.5 * clear.max(0.0));
    }

    /// The share of a step of `h` seconds with `twist`, at most 1, that keeps the tool within its reach, and away from what nobody looked at.
    /// What it was looked ahead for then is all that it can meet.
    pub(super) fn share_within_reach(&self, twist: &Twist, h: f64) -> f64 {
        let (travel, most) = (self.travel(twist, h), self.reach.min(self.clear));
        if travel > most { most / travel } else { 1.0 }
    }

    /// m: no point of the tool moves farther in `h` seconds with `twist`.
    fn travel(&self, twist: &Twist, h: f64) -> f64 {
        (twist.linear.length() + twist.angular.length() * self.radius) * h
    }

    /// The step's system as far as it does not depend on which contacts press and which slide. `free`: nothing is near.
    pub(super) fn begin(&mut self, device: &ProbeState, forces: &Forces, free: bool, h: f64) -> Begun {
        let pose = self.pose_ba(device);
        if !forces.clusters.is_empty() {
            self.clear = self.clear.max(REACH_CREEP * self.coupling.skin);
        }
        self.touches.gather(forces, pose.point(self.center_a), self.coupling.skin);
        if free {
            self.anchor.come_back(&device.twist, h);
        }
        let bond = self.bond(device, &pose);
        let (system, load) = self.unhindered(&bond, &pose, h);
        Begun { pose, bond, system, load }
    }

    /// The step's system with the contacts that press and hold as of now.
    pub(super) fn hindered(&self, begun: &Begun, h: f64) -> (SpatialMatrix, Wrench) {
        let (mut system, mut load) = (begun.system, begun.load);
        self.touches.add_to(&mut system, &mut load, h, self.contact_lag);
        (system, load)
    }

    /// Which contacts press and slide if the tool moves with `twist`; true if that is news.
    pub(super) fn revise(&mut self, twist: &Twist, h: f64) -> bool {
        self.touches.revise(twist, h, self.contact_lag)
    }

    /// Contacts that let go within the step.
    pub(super) fn released(&self) -> u32 {
        self.touches.released()
    }

    /// Moves the tool with `twist`, the step's solution; answers the wrench on the device about its grip.
    pub(super) fn end(&mut self, begun: &Begun, twist: Twist, h: f64) -> Wrench {
        let felt = -begun.bond.wrench(&twist, h);
        self.advance(&begun.pose, twist, h);
        felt
    }

    fn bond(&mut self, device: &ProbeState, pose: &Pose) -> Bond {
        let VirtualCoupling { stiffness, damping, angular_stiffness, angular_damping, .. } = self.coupling;
        let most_force = self.limits.force.min(self.available.force);
        // A torque limit of 0 says that no torque is felt; the tool is to be aligned all the same.
        let felt = self.limits.torque > 0.0;
        let most_torque = if felt { self.limits.torque.min(self.available.torque) } else { f64::INFINITY };
        let ahead = device.pose_ba.point(self.grip_a) - pose.point(self.grip_a);
        let stretch = self.anchor.stretch(ahead, most_force / stiffness);
        let turn = self.anchor.turn(pose.rotation, device.pose_ba.rotation, most_torque / angular_stiffness);
        Bond {
            offset: pose.vector(self.grip_a - self.center_a),
            stretch,
            turn,
            device: device.twist,
            stiffness: levelled(stiffness, stretch, most_force),
            angular_stiffness: levelled(angular_stiffness, turn, most_torque),
            damping,
            angular_damping,
        }
    }

    /// Steps 1 and 2: the system without contacts, its right side times h.
    fn unhindered(&self, bond: &Bond, pose: &Pose, h: f64) -> (SpatialMatrix, Wrench) {
        let rotation = DMat3::from_quat(pose.rotation);
        let mut system = SpatialMatrix::of_body(self.coupling.mass, rotation * self.inertia_a * rotation.transpose());
        let momentum = system.times(&self.twist);
        system.add_at(bond.offset, h * (h * bond.stiffness + bond.damping));
        system.add_turning(h * (h * bond.angular_stiffness + bond.angular_damping));
        let force = bond.stretch * bond.stiffness + bond.device.linear * bond.damping;
        let torque = bond.turn * bond.angular_stiffness + bond.device.angular * bond.angular_damping;
        let pull = Wrench::of_force_at(force * h, bond.offset);
        (system, momentum + pull + Wrench { torque: torque * h, force: DVec3::ZERO })
    }

    /// Steps 3 to 5: the velocity at the end of the step.
    fn settle(&mut self, begun: &Begun, h: f64, counters: &mut ToolCounters) -> Option<Twist> {
        let mut twist = Twist::default();
        for round in 1..=COUPLING_ROUNDS {
            let (system, load) = self.hindered(begun, h);
            twist = system.solve(&load)?;
            counters.rounds = round;
            if !self.revise(&twist, h) {
                counters.released = self.released();
                return Some(twist);
            }
        }
        counters.unsettled = 1;
        counters.released = self.released();
        Some(twist)
    }

    /// Moves the tool from `pose` for `h` seconds.
    fn advance(&mut self, pose: &Pose, twist: Twist, h: f64) {
        let rotation = (DQuat::from_scaled_axis(twist.angular * h) * pose.rotation).normalize();
        let center = pose.point(self.center_a) + twist.linear * h;
        self.pose_ba = Some(Pose { rotation, translation: center - rotation * self.center_a });
        self.twist = twist;
        let needed = (REACH_GROWTH * self.travel(&twist, h)).max(REACH_FADE * self.reach);
        self.reach = needed.min(TOOL_FASTEST * h).max(REACH_LEAST * self.coupling.skin);
    }
}

impl Bond {
    /// On the tool at the end of a step of `h` seconds with `twist`, about the grip.
    fn wrench(&self, twist: &Twist, h: f64) -> Wrench {
        let grip = twist.at(self.offset);
        Wrench {
            torque: (self.turn - twist.angular * h) * self.angular_stiffness
                + (self.device.angular - twist.angular) * self.angular_damping,
            force: (self.stretch - grip * h) * self.stiffness + (self.device.linear - grip) * self.damping,
        }
    }
}

/// The stiffness with which a spring of `stiffness` stretched to `stretch` pulls with no more than `most`.
fn levelled(stiffness: f64, stretch: DVec3, most: f64) -> f64 {
    let length = stretch.length();
    if stiffness * length > most { most / length } else { stiffness }
}
