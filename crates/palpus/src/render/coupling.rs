//! The virtual coupling, which connects the tool to the device, and its largest stable stiffness
//! \[Colgate, Stanley, Brown 1995\].
//!
//! A device samples, holds and delays. So it renders stably only up to a stiffness and damping that
//! its own mass and damping allow; contacts are far stiffer than that. So the device holds one
//! end of a spring and damper. The other end holds the *tool*: the probe as a body of its own
//! (`tool.rs`). Only the tool meets the contacts. The hand feels at most the coupling's stiffness,
//! however many contacts there are.
//!
//! [`VirtualCoupling::tuned`] derives one from the device, in this order:
//!
//! 1. *Stiffness* so that the largest force comes at a stretch of 8 mm (the largest torque at 0.2
//!    rad), but no more than a hundredth of apparent mass over the square of the period. The damped
//!    and delayed loop of a device with dry friction does not vibrate up to twice that stiffness
//!    (simulated over stiffness and damping, from no hand to a firm grip).
//! 2. *Damping* of three periods times the stiffness. A force that is constant over a tick, with
//!    one tick of delay, lags by one and a half periods. This lag acts as negative damping of one
//!    and a half periods times the stiffness. The rest is margin for the lag of the velocity
//!    filter.
//! 3. *Mass*: none. The tool is where all forces balance. So in free air it follows the device
//!    without any force, even with coarse encoders, and it stores no energy that contacts could
//!    return to the hand. (A mass would not improve stability either: the step is implicit, and
//!    flush contacts resist rotation at their corners.)
//! 4. *Contact offset* (`skin`): contacts push below a tenth of the tolerance, so that a peg fits
//!    into a hole with little clearance. Beyond this offset, the query only looks ahead, as far as
//!    the tool can move in the next step; such a contact pushes if the tool would come within the
//!    offset.
//! 5. *Contact stiffness* so that the tool sinks half the contact offset under the largest force.
//!    The bodies then never overlap, and contacts have distances, not depths.
//!
//! A scene may ask for softer contacts ([`Settings::stiffness`](super::Settings::stiffness)). This
//! changes the feel, not how far the tool sinks in: contacts keep the stiffness of step 5, and the
//! coupling is softened. Contact and coupling in series are then as stiff as the softer contact and
//! the original coupling. (A tool that sank by millimetres would leave a thin part on its other
//! side.)

use super::Limits;
use crate::algebra::tolerance::{
    APPARENT_INERTIA, APPARENT_MASS, COUPLING_ALIGNMENT, COUPLING_ALIGNMENT_LEAD, COUPLING_LEAD, COUPLING_SAMPLED,
    COUPLING_STRETCH, COUPLING_TURN, TOOL_SINKS, TOOL_SKIN,
};

/// A spring and damper for translation between the grip of the device and that of the tool, another
/// for rotation, and the mass of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct VirtualCoupling {
    /// N/m; positive.
    pub stiffness: f64,
    /// N·s/m; not negative.
    pub damping: f64,
    /// N·m/rad; positive.
    pub angular_stiffness: f64,
    /// N·m·s/rad; not negative.
    pub angular_damping: f64,
    /// m, positive and at most the contact tolerance: the contact offset; contacts push below this
    /// separation.
    pub skin: f64,
    /// Mass of the tool, kg. Its inertia is that of the probe's mesh with this mass. With 0 the
    /// tool has no mass and rests where all forces balance.
    pub mass: f64,
}

impl VirtualCoupling {
    /// A coupling without stiffness, for direct rendering.
    pub(super) const SLACK: Self =
        Self { stiffness: 0.0, damping: 0.0, angular_stiffness: 0.0, angular_damping: 0.0, skin: 0.0, mass: 0.0 };

    /// The coupling for a device with these limits, a loop period of `period` seconds, and
    /// contacts of this tolerance (m).
    pub fn tuned(limits: &Limits, period: f64, contact_tolerance: f64) -> Self {
        let per_square = COUPLING_SAMPLED / (period * period);
        let stiffness = (limits.force / COUPLING_STRETCH).min(per_square * APPARENT_MASS);
        // With a force limit of 0 nothing is felt, but the tool still has to follow.
        let stiffness = if stiffness > 0.0 { stiffness } else { per_square * APPARENT_MASS };
        let lead = COUPLING_LEAD * period;
        let (angular_stiffness, angular_lead) = if limits.torque > 0.0 {
            ((limits.torque / COUPLING_TURN).min(per_square * APPARENT_INERTIA), lead)
        } else {
            // The device gives no torque, so no limit of the device applies. This spring replaces
            // the hand, too.
            (COUPLING_ALIGNMENT, lead.max(COUPLING_ALIGNMENT_LEAD))
        };
        let (damping, angular_damping) = (lead * stiffness, angular_lead * angular_stiffness);
        let skin = TOOL_SKIN * contact_tolerance;
        Self { stiffness, damping, angular_stiffness, angular_damping, skin, mass: 0.0 }
    }

    /// N/m: the contact stiffness of step 5, for contacts of this tolerance (m); `None` without a
    /// force limit.
    pub fn contact_stiffness(limits: &Limits, contact_tolerance: f64) -> Option<f64> {
        let stiffness = limits.force / (TOOL_SINKS * TOOL_SKIN * contact_tolerance);
        (stiffness.is_finite() && stiffness > 0.0).then_some(stiffness)
    }

    /// The coupling that, in series with contacts of `hard` (N/m), is as stiff as this one in
    /// series with contacts of `stiffness` (N/m).
    pub(super) fn softened(self, stiffness: f64, hard: f64) -> Self {
        let compliance = 1.0 / self.stiffness + 1.0 / stiffness - 1.0 / hard;
        let share = 1.0 / (self.stiffness * compliance);
        Self { stiffness: self.stiffness * share, damping: self.damping * share, ..self }
    }
}
