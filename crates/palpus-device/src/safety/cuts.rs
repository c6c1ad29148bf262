//! Interventions of the safety chain, by name.

/// A reason for which the device got another wrench than was computed, in the order of the chain;
/// reasons from outside the chain come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Cut {
    /// The device's state held a number that is not finite, or an invalid rotation.
    NonFiniteState,
    /// The computed wrench held a number that is not finite.
    NonFiniteWrench,
    /// The grip went farther between two reads than a hand can move it.
    PoseJump,
    /// The grip moves faster than a hand moves.
    Speed,
    /// The device gives the same state again and again, or says that it moves and stays where it
    /// is.
    FrozenState,
    /// The device's own time ran backwards or leapt.
    DeviceClock,
    /// The passivity stage took energy away.
    Passivity,
    /// The wrench changed faster than it may.
    Slew,
    /// The wrench was larger than the device's peak.
    Saturation,
    /// The motors have been driven beyond their continuous rating for so long that their peak is no
    /// longer to be had.
    Heat,
    /// Not engaged, or not yet fully.
    Engagement,
    /// The loop held a wrench for too long, and noticed it itself.
    LateLoop,
    /// The loop held a wrench for too long, and the watchdog took it away.
    Watchdog,
    /// The step panicked.
    Panic,
    /// The device failed a read or a write.
    Device,
    /// Somebody has stopped the run for a while, with a device that does not stop with it.
    Paused,
    /// The wrench oscillates without the hand, and is attenuated. After the others because
    /// recordings name cuts by their place.
    LimitCycle,
    /// The device itself gives no force, whatever the command: see
    /// [`DeviceState::withheld`](crate::DeviceState).
    Withheld,
    /// More than a tenth of the loop's ticks in a quarter of a second were late.
    Overrun,
    /// The machine was suspended since the last tick.
    Suspended,
    /// The engine went on with other settings: the wrench is blended into the new one.
    Settings,
    /// The run is about to end, or another scene to follow: the wrench fades out.
    Ending,
}

impl Cut {
    /// All of them, in the order of the chain.
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
        Self::Engagement,
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

    /// As it stands in summaries.
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
            Self::Engagement => "engagement",
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

    /// True for a fault: all force goes within the tick, and comes back only through engagement.
    /// The others shape the wrench and go on.
    pub fn is_fault(self) -> bool {
        Cuts::FAULTS.has(self)
    }

    const fn bit(self) -> u32 {
        1 << self as u8
    }
}

/// The cuts of one tick: a set, one bit each in the order of [`Cut::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cuts(u32);

impl Cuts {
    /// Nothing was cut.
    pub const NONE: Self = Self(0);
    /// Faults: there is no force until engaged again.
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
    /// Inputs of the chain that it cannot find in states and wrenches: faults, a paused run, a
    /// device that withholds its force, new settings, a run that is about to end.
    pub const INPUTS: Self =
        Self(Self::FAULTS.0 | Cut::Paused.bit() | Cut::Withheld.bit() | Cut::Settings.bit() | Cut::Ending.bit());
    /// Faults after which the state's velocity is unreliable.
    pub(super) const BLIND: Self = Self(
        Cut::NonFiniteState.bit()
            | Cut::PoseJump.bit()
            | Cut::Speed.bit()
            | Cut::FrozenState.bit()
            | Cut::DeviceClock.bit(),
    );

    /// As recorded; bits without a meaning are dropped.
    pub fn from_bits(bits: u32) -> Self {
        Self(bits & ((1 << Cut::ALL.len()) - 1))
    }

    /// For a recording.
    pub fn bits(self) -> u32 {
        self.0
    }

    /// True if `cut` is among them.
    pub const fn has(self, cut: Cut) -> bool {
        self.0 & cut.bit() != 0
    }

    /// True if there is no cut.
    pub fn is_none(self) -> bool {
        self.0 == 0
    }

    /// True if a fault is among them.
    pub fn is_fault(self) -> bool {
        !self.and(Self::FAULTS).is_none()
    }

    /// Returns the cuts that are also among `others`.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// These and `others`.
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

    /// One after the other, in the order of the chain.
    pub fn iter(self) -> impl Iterator<Item = Cut> {
        Cut::ALL.into_iter().filter(move |cut| self.has(*cut))
    }
}

/// The cuts of a run, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SafetyCounters {
    ticks: [u64; Cut::ALL.len()],
    faults: u64,
    faulted: bool,
}

impl SafetyCounters {
    /// Counts a tick's cuts. Ticks of faults without one between them that was free of faults are
    /// one fault.
    pub fn add(&mut self, cuts: Cuts) {
        for cut in cuts.iter() {
            self.ticks[cut as usize] += 1;
        }
        self.faults += u64::from(cuts.is_fault() && !self.faulted);
        self.faulted = cuts.is_fault();
    }

    /// Ticks in which there was that cut.
    pub fn ticks(&self, cut: Cut) -> u64 {
        self.ticks[cut as usize]
    }

    /// Faults, each counted once however many ticks it lasted.
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// Every cut that there was, with its number of ticks, in the order of the chain.
    pub fn iter(&self) -> impl Iterator<Item = (Cut, u64)> + '_ {
        Cut::ALL.into_iter().map(|cut| (cut, self.ticks(cut))).filter(|(_, ticks)| *ticks > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_and_its_bits_are_the_same() {
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
    fn a_fault_that_lasts_is_one_fault() {
        let mut counters = SafetyCounters::default();
        let frozen = Cuts(Cut::FrozenState.bit());
        for cuts in [Cuts::NONE, frozen, frozen, Cuts(Cut::Engagement.bit()), frozen] {
            counters.add(cuts);
        }
        assert_eq!((counters.faults(), counters.ticks(Cut::FrozenState)), (2, 3));
        assert!(counters.iter().eq([(Cut::FrozenState, 3), (Cut::Engagement, 1)]));
    }
}
