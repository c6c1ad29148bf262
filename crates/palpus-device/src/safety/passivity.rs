//! The interface of the passivity stage, which is stage 4 of the safety chain: after the
//! limit-cycle detector and before the slew limit.

use palpus::algebra::Wrench;

use crate::device::DeviceState;

/// A stage that removes energy which a passive environment could not have supplied.
pub trait Passivity: Send {
    /// Returns `computed`, or the wrench that may be commanded instead, for a grip in `state`.
    ///
    /// `elapsed` is the time since the last call, s. The last commanded wrench was held for this
    /// time, and the next wrench will be held as long. The result must be finite. If no energy must
    /// be removed, it must equal `computed` bit for bit; any other result counts as
    /// [`super::Cut::Passivity`].
    fn limit(&mut self, computed: &Wrench, state: &DeviceState, elapsed: f64) -> Wrench;

    /// Takes the gain of the engagement, by which the result of [`Self::limit`] will be multiplied:
    /// below 1 while the device ramps. Returns true if the next result removes energy that the ramp
    /// adds; this counts as [`super::Cut::Engagement`]. Called before [`Self::limit`], whose state
    /// then has only the velocity that the poses confirm.
    fn ramp(&mut self, _: f64) -> bool {
        false
    }

    /// Adds the work that moving bodies and the tools of other devices did on this tool in this
    /// tick, J, by translation and by rotation. The work is negative if the tool did work on the
    /// others. The hand may receive this energy. The chain calls this function before
    /// [`Self::limit`].
    fn received(&mut self, _: [f64; 2]) {}

    /// Takes the wrench that was commanded in this tick, after all later stages, for the energy
    /// account.
    fn commanded(&mut self, wrench: &Wrench);

    /// Starts the account again while the device is not engaged.
    fn reset(&mut self);
}
