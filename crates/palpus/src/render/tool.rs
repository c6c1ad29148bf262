//! The tool: the probe as a rigid body between device and contacts, moved implicitly \[Colgate
//! 1995; Otaduy and Lin 2006, "OL06"\].
//!
//! In each tick, the tool makes one step of backward Euler over h seconds. The contacts at its
//! present pose are known. Every force is linearised in the velocity V′ of the tool at the end of
//! the step:
//!
//! 1. *Inertia*: M (V′ − V) / h. M is zero if the nearest contact is at the tolerance, and grows to
//!    the tool's mass at the contact offset. In free air the tool has no mass; otherwise each
//!    increment of the device's encoders would accelerate it, and the hand would feel that. Added
//!    mass starts at rest, and removed mass takes its momentum away, so neither adds energy.
//! 2. *Coupling*: k (e − h v′) + b (v_d − v′) at the grip, where e is the vector from the tool's
//!    grip to the device's grip. The formula for rotation is analogous.
//! 3. *Contacts*: k (w − h g·v′) − b n·v′ along each cluster's normal n, with b in proportion to k.
//!    g is the direction in which the gap widens, which differs from a shaded n. A contact that
//!    would pull is left out. A contact that does not push yet is included if the step brings the
//!    tool near enough.
//! 4. *Friction*: −k_t (z + h v′) in the tangent plane while the contact sticks. While it slides,
//!    the force has the size μ F_n, opposes z + h v′ and is linearised about the last solution
//!    (`contact_rows.rs`).
//!
//!    The system is solved again, in a bounded number of rounds, until the set of pressing contacts
//!    and the friction do not change. A round may throw the tool into the opposite wall of a close
//!    fit. Then the next round begins between the two (`world/line_search.rs`).
//! 5. *Solve* the 6 × 6 system and move the tool. No point of the tool moves farther than the
//!    distance within which the query finds contacts: at least two contact offsets, and twice the
//!    motion of the last step. So the tool cannot pass through anything at any speed. If the
//!    query's work is limited and nothing is near, the tool stops one contact offset before
//!    unexamined surfaces. In contact it moves on slowly, because a stop there would give a force
//!    without a contact. The device gets the reversed coupling force at V′.
//!
//! Without shading and sliding friction, all matrices of the sum are positive semi-definite, and
//! the coupling's matrix is definite. So the step has a solution at any stiffness, even with mass
//! 0, and errors do not grow. With them there is no such proof. The greatest stable stiffness and
//! the energy given to the hand are measured (`docs/feel.md`), and a step without a solution is
//! counted as a reset.
//!
//! The spring's force is limited to the device's present force limit. So a hand that is stronger
//! than the device does not press the tool into the wall.
//!
//! Deviations from OL06: the derivatives of normals and lever arms are left out, because they are
//! small over a tick and can make the matrix indefinite. The gyroscopic torque is left out, because
//! at the speeds of a hand it is smaller than a device's friction.

use glam::{DMat3, DQuat, DVec3};

use super::anchor::Anchor;
use super::reach::Reach;
use super::{Limits, ProbeState, Settings, VirtualCoupling};
use crate::algebra::{Pose, SpatialMatrix, Twist, Wrench};
use crate::body::Body;

/// The probe as a simulated body.
#[derive(Clone, Debug)]
pub(super) struct Tool {
    coupling: VirtualCoupling,
    limits: Limits,
    /// The device's present limits, if they are below the nominal limits.
    available: Limits,
    /// The grip, in a's frame.
    grip_a: DVec3,
    /// The centre of mass, in a's frame.
    center_a: DVec3,
    /// Inertia about the centre of mass, along a's axes, kg·m².
    inertia_a: DMat3,
    /// Pose of a in b's frame; `None` before the first step.
    pose_ba: Option<Pose>,
    /// Velocity; the linear part is that of the centre of mass.
    twist: Twist,
    /// Bound on the motion of the tool in a step.
    pub(super) reach: Reach,
    anchor: Anchor,
    /// The coupling's spring and damper in the current step.
    bond: CouplingTerms,
}

/// The coupling's terms of step 2.
#[derive(Clone, Copy, Debug, Default)]
struct CouplingTerms {
    /// Vector from the centre of mass to the grip, m.
    offset: DVec3,
    /// Vector from the tool's grip to the device's grip, m.
    stretch: DVec3,
    /// Rotation vector from the tool's orientation to the device's orientation, rad.
    turn: DVec3,
    /// Twist of the device's grip.
    device: Twist,
    stiffness: f64,
    angular_stiffness: f64,
    damping: f64,
    angular_damping: f64,
}

impl Tool {
    /// Returns a tool that starts at the device's first pose.
    pub(super) fn new(probe: &Body, coupling: VirtualCoupling, settings: &Settings) -> Self {
        let mut tool = Self {
            coupling,
            limits: settings.limits,
            available: Limits::UNLIMITED,
            grip_a: settings.grip_a,
            center_a: probe.mass().center_of_mass,
            inertia_a: DMat3::ZERO,
            pose_ba: None,
            twist: Twist::default(),
            reach: Reach::new(probe, coupling.contact_offset, radius(probe)),
            anchor: Anchor::AT_GRIP,
            bond: CouplingTerms::default(),
        };
        tool.set(probe, coupling, settings);
        tool
    }

    /// Changes the coupling and the settings (of the same capacity); keeps the tool's pose and
    /// velocity.
    pub(super) fn set(&mut self, probe: &Body, coupling: VirtualCoupling, settings: &Settings) {
        let hard = settings.held().stiffness;
        self.coupling = coupling.softened(settings.stiffness, hard);
        self.limits = settings.limits;
        self.grip_a = settings.grip_a;
        let mass = probe.mass();
        self.inertia_a = mass.inertia * (coupling.mass / mass.volume);
        self.reach.set_contact_offset(coupling.contact_offset);
    }

    /// Limits the coupling to the device's present limits, `available`.
    pub(super) fn set_available(&mut self, available: &Limits) {
        self.available = *available;
    }

    /// Returns the tool's pose. Before the first step and after [`Self::clear`], returns the
    /// device's pose.
    pub(super) fn pose_ba(&mut self, device: &ProbeState) -> Pose {
        if let Some(pose) = self.pose_ba {
            return pose;
        }
        let to_center = device.pose_ba.vector(self.center_a - self.grip_a);
        self.twist = Twist { linear: device.twist.at(to_center), ..device.twist };
        self.anchor = Anchor::AT_GRIP;
        self.pose_ba = Some(device.pose_ba);
        device.pose_ba
    }

    /// Drops the state: the next step starts at the device's pose.
    pub(super) fn clear(&mut self) {
        self.pose_ba = None;
        self.reach.reset();
    }

    /// Begins a step of `h` s at the tool's pose. Returns the matrix and the right-hand side
    /// without contacts. `free` is true if nothing is near.
    pub(super) fn begin(&mut self, device: &ProbeState, free: bool, h: f64) -> (SpatialMatrix, Wrench) {
        let pose = self.pose_ba(device);
        if free {
            self.anchor.come_back(&device.twist, h);
        }
        self.bond = self.bond(device, &pose);
        self.unhindered(&pose, h)
    }

    /// Moves the tool with `twist`, the step's solution, and returns the wrench on the device about
    /// its grip. `pose` and `center` (the centre of mass) are at the beginning of the step.
    /// `is_cut` is true if [`Reach::share`] allowed only a part of the step.
    pub(super) fn end(&mut self, pose: &Pose, center: DVec3, twist: Twist, h: f64, is_cut: bool) -> Wrench {
        let felt = -self.bond.wrench(&twist, h);
        self.advance(pose, center, twist, h, is_cut);
        felt
    }

    /// Returns the vector from the centre of mass to the grip in the present step, m.
    pub(super) fn grip_offset(&self) -> DVec3 {
        self.bond.offset
    }

    fn bond(&mut self, device: &ProbeState, pose: &Pose) -> CouplingTerms {
        let VirtualCoupling { stiffness, damping, angular_stiffness, angular_damping, .. } = self.coupling;
        let most_force = self.limits.force.min(self.available.force);
        // With a torque limit of 0, the hand feels no torque, but the tool must still be aligned.
        let felt = self.limits.torque > 0.0;
        let most_torque = if felt { self.limits.torque.min(self.available.torque) } else { f64::INFINITY };
        let ahead = device.pose_ba.point(self.grip_a) - pose.point(self.grip_a);
        let stretch = self.anchor.stretch(ahead, most_force / stiffness);
        let turn = self.anchor.turn(pose.rotation, device.pose_ba.rotation, most_torque / angular_stiffness);
        CouplingTerms {
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

    /// Steps 1 and 2: returns the system without contacts; the right-hand side is multiplied by h.
    fn unhindered(&self, pose: &Pose, h: f64) -> (SpatialMatrix, Wrench) {
        let bond = &self.bond;
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

    /// Moves the tool from `pose` for `h` seconds.
    fn advance(&mut self, pose: &Pose, center: DVec3, twist: Twist, h: f64, is_cut: bool) {
        let rotation = (DQuat::from_scaled_axis(twist.angular * h) * pose.rotation).normalize();
        let center = center + twist.linear * h;
        self.pose_ba = Some(Pose { rotation, translation: center - rotation * self.center_a });
        self.twist = twist;
        self.reach.follow(&twist, h, is_cut.then(|| self.coupling.release(&self.limits, h)));
    }
}

impl CouplingTerms {
    /// Returns the coupling's wrench on the tool at the end of a step of `h` seconds with `twist`,
    /// about the grip.
    fn wrench(&self, twist: &Twist, h: f64) -> Wrench {
        let grip = twist.at(self.offset);
        Wrench {
            torque: (self.turn - twist.angular * h) * self.angular_stiffness
                + (self.device.angular - twist.angular) * self.angular_damping,
            force: (self.stretch - grip * h) * self.stiffness + (self.device.linear - grip) * self.damping,
        }
    }
}

/// Returns the distance from the body's centre of mass to the farthest corner of its box, m.
pub(super) fn radius(body: &Body) -> f64 {
    let (bounds, center) = (body.mesh().bounds(), body.mass().center_of_mass);
    (bounds.max - center).max(center - bounds.min).length()
}

/// Returns `stiffness`, reduced so that a spring stretched to `stretch` pulls with at most `most`.
fn levelled(stiffness: f64, stretch: DVec3, most: f64) -> f64 {
    let length = stretch.length();
    if stiffness * length > most { most / length } else { stiffness }
}
