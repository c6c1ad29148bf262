//! Reaction of the safety chain to a device that withholds its force.
//!
//! A device may withhold its force, whatever wrench is commanded
//! ([`DeviceState::withheld`](crate::DeviceState)). The causes are: the arm is not ready or has no
//! power, the user has switched the force off at the device, or an answer was late or lost. A
//! withheld force is no fault. While the device withholds its force, the commanded wrench falls to
//! zero within the slew limit. Afterwards:
//!
//! 1. The wrench returns from zero. The wrench is limited to a fraction of the peak that grows to
//!    the full peak within [`RETURN_TIME`]. A wrench that becomes smaller is not delayed.
//! 2. If the force was withheld for longer than [`SafetyLimits::hold`], the grip may be anywhere.
//!    The device must then be engaged again, as after a pause.
//!
//! [`SafetyLimits::hold`]: super::SafetyLimits::hold

/// Time in which the force returns from zero to the peak, s. A return in a tenth of this time would
/// be felt as a blow. With ten times this time, a wall would seem to vanish for a moment after a
/// single late answer.
const RETURN_TIME: f64 = 0.05;

/// Time for which the device has withheld its force, or time since it gives force again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Withholding {
    /// Longest time without force, s, after which the device need not be engaged again.
    longest: f64,
    state: State,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// The full force is allowed.
    No,
    /// Time for which the force has been withheld so far, s.
    Withheld(f64),
    /// The device has given force again for this time, s.
    Returning(f64),
}

impl Withholding {
    /// Starts with a device that gives force. The device must be engaged again after more than
    /// `longest` s without force.
    pub(super) fn new(longest: f64) -> Self {
        Self { longest, state: State::No }
    }

    /// Advances by a tick of `dt` s.
    pub(super) fn advance(&mut self, withheld: bool, dt: f64) {
        self.state = match self.state {
            State::Withheld(time) if withheld => State::Withheld(time + dt),
            _ if withheld => State::Withheld(dt),
            State::Withheld(_) => State::Returning(dt),
            State::Returning(time) if time + dt < RETURN_TIME => State::Returning(time + dt),
            State::Returning(_) | State::No => State::No,
        };
    }

    /// Returns true if the force is withheld for so long that the device must be engaged again.
    pub(super) fn is_long(&self) -> bool {
        matches!(self.state, State::Withheld(time) if time > self.longest)
    }

    /// Returns the fraction of the peak that is allowed while the wrench returns; `None` if the
    /// full peak is allowed.
    pub(super) fn share(&self) -> Option<f64> {
        match self.state {
            State::Returning(time) => Some(time / RETURN_TIME),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use palpus::algebra::{Pose, Twist, Wrench};

    use super::RETURN_TIME;
    use crate::safety::{Cut, Cuts, EnableMode, Phase, SafetyChain, SafetyLimits, SafetyOptions, Shaped};
    use crate::{DeviceState, known_devices};

    const DT: f64 = 1e-3;
    const NEWTONS: f64 = 6.0;

    fn chain() -> (SafetyChain, SafetyLimits) {
        let [premium, ..] = known_devices();
        let limits = SafetyLimits::of(&premium, 1.0 / DT);
        let mut chain = SafetyChain::new(&limits, EnableMode::Automatic, &SafetyOptions::default(), DT);
        for _ in 0..400 {
            tick(&mut chain, 0.0, false);
        }
        for _ in 0..10 {
            tick(&mut chain, NEWTONS, false);
        }
        assert_eq!(chain.phase(), Phase::Engaged);
        (chain, limits)
    }

    fn moving(withheld: bool) -> DeviceState {
        let twist = Twist { angular: DVec3::ZERO, linear: DVec3::X * 0.1 };
        DeviceState { pose: Pose::IDENTITY, twist, buttons: 0, time: 0.0, withheld }
    }

    fn tick(chain: &mut SafetyChain, newtons: f64, withheld: bool) -> Shaped {
        let mut reported = Cuts::NONE;
        reported.note(Cut::Withheld, withheld);
        chain.shape(&moving(withheld), &Wrench { force: DVec3::X * newtons, torque: DVec3::ZERO }, reported, DT)
    }

    #[test]
    fn withheld_force_falls_to_zero_and_returns_slowly() {
        for lost in [1, 3, 200] {
            let (mut chain, limits) = chain();
            let slew = limits.force_slew * DT;
            let mut last = NEWTONS;
            for _ in 0..lost {
                let shaped = tick(&mut chain, NEWTONS, true);
                assert!((shaped.wrench.force.x - (last - slew).max(0.0)).abs() < 1e-9, "{shaped:?}");
                assert!(shaped.cuts.has(Cut::Withheld) && !shaped.cuts.is_fault());
                last = shaped.wrench.force.x;
            }
            let mut ticks = 0;
            while ticks == 0 || last < NEWTONS {
                let shaped = tick(&mut chain, NEWTONS, false);
                ticks += 1;
                let returned = limits.force_peak * f64::from(ticks) * DT / RETURN_TIME;
                let most = returned.min(NEWTONS).max(last - slew);
                assert!((shaped.wrench.force.x - most).abs() < 1e-9, "{shaped:?}");
                assert!(!shaped.cuts.has(Cut::Withheld));
                last = shaped.wrench.force.x;
            }
            assert_eq!(ticks, (NEWTONS / limits.force_peak * RETURN_TIME / DT).ceil() as i32, "{lost} ticks without");
            assert_eq!(chain.phase(), Phase::Engaged);
        }
    }

    #[test]
    fn returning_force_can_fall_at_once() {
        let (mut chain, _) = chain();
        tick(&mut chain, NEWTONS, true);
        for _ in 0..20 {
            tick(&mut chain, NEWTONS, false);
        }
        assert_eq!(tick(&mut chain, 0.5, false).wrench.force.x, 0.5);
    }

    #[test]
    fn long_withholding_needs_engaging_again() {
        let (mut chain, limits) = chain();
        for _ in 0..(limits.hold / DT) as usize + 2 {
            tick(&mut chain, NEWTONS, true);
        }
        for _ in 0..1000 {
            assert_eq!(tick(&mut chain, NEWTONS, false).wrench, Wrench::ZERO);
        }
        assert_eq!(chain.phase(), Phase::Waiting);
        assert_eq!(tick(&mut chain, 0.1, false).phase, Phase::Ramping);
    }

    #[test]
    fn damping_is_zero_while_force_is_withheld() {
        let (mut chain, _) = chain();
        let mut reported = Cuts::NONE;
        reported.note(Cut::LateLoop, true);
        reported.note(Cut::Withheld, true);
        for _ in 0..2 {
            chain.shape(&moving(true), &Wrench::ZERO, reported, DT);
        }
        assert_eq!(chain.shape(&moving(true), &Wrench::ZERO, reported, DT).wrench, Wrench::ZERO);
    }
}
