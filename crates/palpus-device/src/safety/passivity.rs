//! The place of the passivity observer and controller in the chain: the fourth stage, after the
//! gate and before the slew limit. There the wrench is still the engine's and the motion has passed
//! the gate.

use palpus::algebra::Wrench;

use crate::device::DeviceState;

/// A stage that takes away energy that a passive environment could not have given.
pub trait Passivity: Send {
    /// `computed`, or what may be commanded in its place, for a grip in `state`. `elapsed`: s since
    /// the last call, for which the last commanded wrench was held; the next one is taken to be
    /// held as long. Must answer finite numbers, and `computed` itself, to the bit, when there is
    /// nothing to take away: anything else is counted as [`super::Cut::Passivity`].
    fn limit(&mut self, computed: &Wrench, state: &DeviceState, elapsed: f64) -> Wrench;

    /// The grip's tool was given this work in this tick by another one that somebody moves, J, by
    /// moving and by turning it; negative: gave it. What came from there may go on into the hand.
    /// Adds received work; called before [`Self::limit`].
    fn received(&mut self, _: [f64; 2]) {}

    /// Takes the wrench that was commanded in this tick after all later stages, for the account of
    /// the energy.
    fn commanded(&mut self, wrench: &Wrench);

    /// Nothing is engaged: the account begins anew.
    fn reset(&mut self);
}
