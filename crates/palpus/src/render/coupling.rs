//! The virtual coupling, which connects the tool to the device, and its largest stable stiffness
//! \[Colgate, Stanley, Brown 1995\].
//!
//! The loop of a device samples positions, holds forces for a period, and delays them. So its mass
//! and damping limit the stiffness and damping that it can render stably. Contacts are far stiffer.
//! A coupling is a spring and damper between the device and the *tool*: the probe as a simulated
//! body (`tool.rs`). Only the tool touches other bodies. The hand feels at most the coupling's
//! stiffness, for any number of contacts.
//!
//! [`VirtualCoupling::tuned`] derives a coupling from the device, in this order:
//!
//! 1. *Stiffness*: the largest force is reached at a stretch of 8 mm, and the largest torque at 0.2
//!    rad. The stiffness is at most a hundredth of apparent mass over the square of the period. In
//!    simulations over stiffness, damping and grip (from no hand to a firm grip), a device with dry
//!    friction did not vibrate up to twice that stiffness.
//! 2. *Damping*: three periods times the stiffness. A force that is held for a tick, with one
//!    tick of delay, lags by 1.5 periods. This lag acts as negative damping of 1.5 periods times
//!    the stiffness. The rest is margin for the lag of the velocity filter.
//! 3. *Mass*: zero. The tool moves to the pose where all forces balance. So in free air it follows
//!    the device without force, even with coarse encoders, and it stores no energy that contacts
//!    could return to the hand. (A mass would not improve stability: the step is implicit, and
//!    flush contacts resist rotation at their corners.)
//! 4. *Contact offset*: contacts push below a tenth of the tolerance, so that a peg fits
//!    into a hole with little clearance. The query also finds contacts beyond this offset, as far
//!    as the tool can move in the next step. Such a contact pushes if the tool would come within
//!    the offset.
//! 5. *Contact stiffness*: under the largest force, the tool sinks in by half the contact offset.
//!    So the bodies never overlap, and contacts have distances, not depths.
//!
//! A scene may request softer contacts ([`Settings::stiffness`](super::Settings::stiffness)). Then
//! contacts keep the stiffness of step 5, and the coupling is softened instead. Contact and
//! softened coupling in series are as stiff as the softer contact and the original coupling. So the
//! feel changes, but the tool does not sink in farther. (A tool that sank in by millimetres would
//! leave a thin part on the other side.)

use super::Limits;
use crate::algebra::tolerance::{
    APPARENT_INERTIA, APPARENT_MASS, COUPLING_ALIGNMENT, COUPLING_ALIGNMENT_LEAD, COUPLING_LEAD, COUPLING_SAMPLED,
    COUPLING_STRETCH, COUPLING_TURN, REACH_RELEASE, TOOL_OFFSET, TOOL_SINKS,
};

/// The springs and dampers between the grips of device and tool, for translation and for rotation,
/// and the mass of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct VirtualCoupling {
    /// Stiffness for translation, N/m; positive.
    pub stiffness: f64,
    /// Damping of translation, N·s/m; not negative.
    pub damping: f64,
    /// Stiffness for rotation, N·m/rad; positive.
    pub angular_stiffness: f64,
    /// Damping of rotation, N·m·s/rad; not negative.
    pub angular_damping: f64,
    /// Contact offset, m: contacts push below this separation. Positive and at most the contact
    /// tolerance.
    #[cfg_attr(feature = "serde", serde(alias = "skin"))]
    pub contact_offset: f64,
    /// Mass of the tool, kg. The inertia is computed from the probe's mesh with this mass. With 0
    /// the tool has no mass and rests where all forces balance.
    pub mass: f64,
}

impl VirtualCoupling {
    /// A coupling without stiffness, for direct rendering.
    pub(super) const SLACK: Self = Self {
        stiffness: 0.0,
        damping: 0.0,
        angular_stiffness: 0.0,
        angular_damping: 0.0,
        contact_offset: 0.0,
        mass: 0.0,
    };

    /// Returns the coupling for a device with these limits, a loop period of `period` seconds, and
    /// contacts of this tolerance (m).
    pub fn tuned(limits: &Limits, period: f64, contact_tolerance: f64) -> Self {
        let per_square = COUPLING_SAMPLED / (period * period);
        let stiffness = (limits.force / COUPLING_STRETCH).min(per_square * APPARENT_MASS);
        // With a force limit of 0 the hand feels nothing, but the tool must still follow the
        // device.
        let stiffness = if stiffness > 0.0 { stiffness } else { per_square * APPARENT_MASS };
        let lead = COUPLING_LEAD * period;
        let (angular_stiffness, angular_lead) = if limits.torque > 0.0 {
            ((limits.torque / COUPLING_TURN).min(per_square * APPARENT_INERTIA), lead)
        } else {
            // The device gives no torque, so no limit of the device applies. This spring alone
            // aligns the tool with the device.
            (COUPLING_ALIGNMENT, lead.max(COUPLING_ALIGNMENT_LEAD))
        };
        let (damping, angular_damping) = (lead * stiffness, angular_lead * angular_stiffness);
        let contact_offset = TOOL_OFFSET * contact_tolerance;
        Self { stiffness, damping, angular_stiffness, angular_damping, contact_offset, mass: 0.0 }
    }

    /// Returns the contact stiffness of step 5 (N/m) for contacts of this tolerance (m); `None`
    /// without a force limit.
    pub fn contact_stiffness(limits: &Limits, contact_tolerance: f64) -> Option<f64> {
        let stiffness = limits.force / (TOOL_SINKS * TOOL_OFFSET * contact_tolerance);
        (stiffness.is_finite() && stiffness > 0.0).then_some(stiffness)
    }

    /// Returns by how much the motion of a tool that was held may grow from one step of `h` seconds
    /// to the next, m. Infinite if the device gives no force, so that nothing is felt.
    pub(super) fn release(&self, limits: &Limits, h: f64) -> f64 {
        let change = REACH_RELEASE * limits.force;
        if change > 0.0 { change / (self.stiffness + self.damping / h) } else { f64::INFINITY }
    }

    /// Returns a softer coupling. In series with contacts of `hard` (N/m), it is as stiff as this
    /// coupling in series with contacts of `stiffness` (N/m).
    pub(super) fn softened(self, stiffness: f64, hard: f64) -> Self {
        let compliance = 1.0 / self.stiffness + 1.0 / stiffness - 1.0 / hard;
        let share = 1.0 / (self.stiffness * compliance);
        Self { stiffness: self.stiffness * share, damping: self.damping * share, ..self }
    }
}
