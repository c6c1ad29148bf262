//! Interventions of the safety chain.

/// Reason why the device did not get the computed wrench. The order follows the stages of the
/// chain; reasons from outside the chain come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Cut {
    /// The device's state contained a non-finite number or an invalid rotation.
    NonFiniteState,
    /// The computed wrench contained a non-finite number.
    NonFiniteWrench,
    /// The grip moved farther between two reads than a hand can move it.
    PoseJump,
    /// The grip moves faster than a hand can move it.
    Speed,
    /// The device returns the same state repeatedly, or reports a velocity while its pose does not
    /// change.
    FrozenState,
    /// The device's clock ran backwards or jumped ahead.
    DeviceClock,
    /// The passivity stage removed energy.
    Passivity,
    /// The wrench changed faster than the slew limit.
    Slew,
    /// The wrench was larger than the device's peak.
    Saturation,
    /// The motors were driven beyond their continuous rating for so long that their peak is no
    /// longer available.
    Heat,
    /// The device is not engaged, or the ramp is not over, or a contact that was pressed during the
    /// ramp is being released: the passivity stage keeps the energy that the ramp has added.
    StartUp,
    /// The loop held a wrench for too long, and detected this itself.
    LateLoop,
    /// The loop held a wrench for too long, and the watchdog applied the brake.
    Watchdog,
    /// The step panicked.
    Panic,
    /// The device failed a read or a write.
    Device,
    /// The run is paused, but the device moves on.
    Paused,
    /// The wrench oscillates without motion of the hand, and is attenuated. This variant is out of
    /// order because recordings store each cut by its position.
    LimitCycle,
    /// The device withholds its force ([`DeviceState::withheld`](crate::DeviceState)).
    Withheld,
    /// More than a tenth of the loop's ticks within a quarter of a second were late.
    Overrun,
    /// The machine was suspended since the last tick.
    Suspended,
    /// The settings of the engine changed, and the wrench fades from the old to the new value.
    Settings,
    /// The run ends, or another scene follows: the wrench fades out.
    Ending,
}

impl Cut {
    /// All cuts, in the order of the chain.
    pub const ALL: [Self; 22] = [
        Self::NonFiniteState,
        Self::NonFiniteWrench,
        Self::PoseJump,
        Self::Speed,
        Self::FrozenState,
        Self::DeviceClock,
        Self::Passivity,
        Self::Slew,
        Self::Saturation,
        Self::Heat,
        Self::StartUp,
        Self::LateLoop,
        Self::Watchdog,
        Self::Panic,
        Self::Device,
        Self::Paused,
        Self::LimitCycle,
        Self::Withheld,
        Self::Overrun,
        Self::Suspended,
        Self::Settings,
        Self::Ending,
    ];

    /// Returns the name used in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFiniteState => "non_finite_state",
            Self::NonFiniteWrench => "non_finite_wrench",
            Self::PoseJump => "pose_jump",
            Self::Speed => "speed",
            Self::FrozenState => "frozen_state",
            Self::DeviceClock => "device_clock",
            Self::Passivity => "passivity",
            Self::Slew => "slew",
            Self::Saturation => "saturation",
            Self::Heat => "heat",
            Self::StartUp => "start_up_ramp",
            Self::LateLoop => "late_loop",
            Self::Watchdog => "watchdog",
            Self::Panic => "panic",
            Self::Device => "device",
            Self::Paused => "paused",
            Self::LimitCycle => "limit_cycle",
            Self::Withheld => "withheld",
            Self::Overrun => "overrun",
            Self::Suspended => "suspended",
            Self::Settings => "settings",
            Self::Ending => "ending",
        }
    }

    /// Returns true for a fault. A fault removes the force within the tick, and the device must be
    /// engaged again. Other cuts only change the wrench.
    pub fn is_fault(self) -> bool {
        Cuts::FAULTS.has(self)
    }

    const fn bit(self) -> u32 {
        1 << self as u8
    }
}

/// The cuts of one tick: a bit set in the order of [`Cut::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cuts(u32);

impl Cuts {
    /// Nothing was cut.
    pub const NONE: Self = Self(0);
    /// All faults. After a fault there is no force until the device is engaged again.
    pub const FAULTS: Self = Self(
        Cut::NonFiniteState.bit()
            | Cut::NonFiniteWrench.bit()
            | Cut::PoseJump.bit()
            | Cut::Speed.bit()
            | Cut::FrozenState.bit()
            | Cut::DeviceClock.bit()
            | Cut::LateLoop.bit()
            | Cut::Watchdog.bit()
            | Cut::Panic.bit()
            | Cut::Device.bit()
            | Cut::Overrun.bit()
            | Cut::Suspended.bit(),
    );
    /// Cuts that are inputs of the chain, since the chain cannot derive them from states and
    /// wrenches: faults, pauses, withheld forces, new settings, and the coming end of a run.
    pub const INPUTS: Self =
        Self(Self::FAULTS.0 | Cut::Paused.bit() | Cut::Withheld.bit() | Cut::Settings.bit() | Cut::Ending.bit());
    /// Faults after which the velocity of the state is unreliable.
    pub(super) const BLIND: Self = Self(
        Cut::NonFiniteState.bit()
            | Cut::PoseJump.bit()
            | Cut::Speed.bit()
            | Cut::FrozenState.bit()
            | Cut::DeviceClock.bit(),
    );

    /// Returns the cuts with these bits, as stored in a recording. Undefined bits are ignored.
    pub fn from_bits(bits: u32) -> Self {
        Self(bits & ((1 << Cut::ALL.len()) - 1))
    }

    /// Returns the bits for a recording.
    pub fn bits(self) -> u32 {
        self.0
    }

    /// Returns true if `cut` is in the set.
    pub const fn has(self, cut: Cut) -> bool {
        self.0 & cut.bit() != 0
    }

    /// Returns true if the set is empty.
    pub fn is_none(self) -> bool {
        self.0 == 0
    }

    /// Returns true if the set contains a fault.
    pub fn is_fault(self) -> bool {
        !self.and(Self::FAULTS).is_none()
    }

    /// Returns the cuts that are in both sets.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// Returns the cuts that are in either set.
    #[must_use]
    pub fn or(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Adds `cut` if `happened`.
    pub fn note(&mut self, cut: Cut, happened: bool) {
        if happened {
            self.0 |= cut.bit();
        }
    }

    /// Iterates over the cuts in the order of the chain.
    pub fn iter(self) -> impl Iterator<Item = Cut> {
        Cut::ALL.into_iter().filter(move |cut| self.has(*cut))
    }
}

/// Counts of the cuts in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SafetyCounters {
    ticks: [u64; Cut::ALL.len()],
    faults: u64,
    faulted: bool,
}

impl SafetyCounters {
    /// Counts the cuts of a tick. Successive ticks with faults count as one fault.
    pub fn add(&mut self, cuts: Cuts) {
        for cut in cuts.iter() {
            self.ticks[cut as usize] += 1;
        }
        self.faults += u64::from(cuts.is_fault() && !self.faulted);
        self.faulted = cuts.is_fault();
    }

    /// Returns the number of ticks with this cut.
    pub fn ticks(&self, cut: Cut) -> u64 {
        self.ticks[cut as usize]
    }

    /// Returns the number of faults. Each fault counts once, however many ticks it lasts.
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// Iterates over the cuts that occurred, with their numbers of ticks, in the order of the
    /// chain.
    pub fn iter(&self) -> impl Iterator<Item = (Cut, u64)> + '_ {
        Cut::ALL.into_iter().map(|cut| (cut, self.ticks(cut))).filter(|(_, ticks)| *ticks > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_and_its_bits_agree() {
        let mut cuts = Cuts::NONE;
        cuts.note(Cut::Slew, true);
        cuts.note(Cut::Speed, false);
        assert!(!cuts.is_fault() && cuts.has(Cut::Slew) && !cuts.has(Cut::Speed));
        cuts.note(Cut::Watchdog, true);
        assert!(cuts.is_fault() && Cuts::from_bits(cuts.bits()) == cuts);
        assert!(cuts.iter().eq([Cut::Slew, Cut::Watchdog]));
        assert_eq!(Cuts::from_bits(u32::MAX).iter().count(), Cut::ALL.len());
        for (k, cut) in Cut::ALL.into_iter().enumerate() {
            assert_eq!(cut as usize, k, "{}", cut.name());
        }
    }

    #[test]
    fn lasting_fault_counts_once() {
        let mut counters = SafetyCounters::default();
        let frozen = Cuts(Cut::FrozenState.bit());
        for cuts in [Cuts::NONE, frozen, frozen, Cuts(Cut::StartUp.bit()), frozen] {
            counters.add(cuts);
        }
        assert_eq!((counters.faults(), counters.ticks(Cut::FrozenState)), (2, 3));
        assert!(counters.iter().eq([(Cut::FrozenState, 3), (Cut::StartUp, 1)]));
    }
}
