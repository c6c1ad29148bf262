//! Who may be pushed, and from when on.
//!
//! ```text
//!          asked            small wrench          ramped in
//!   Idle ────────► Waiting ──────────────► Ramping ─────────► Engaged
//!    ▲ ◄──────────────┴──── not asked ────────┴──────────────────┘
//!    │                                                            any of them
//!    │ nobody asks by himself                                        │ fault
//!    └────────── Faulted ◄─────────────────────────────────────────┘
//!                 │ (held until free of faults; Waiting at once when engagement is automatic; Stopped by policy)
//! ```
//!
//! There is a wrench in `Ramping` (a growing share) and `Engaged` (all of it) only. A fault takes it away in the tick in which
//! it is seen, whatever the phase. A pause leads to `Idle` like a hand that lets go: buttons have to be pressed again, and
//! without buttons it waits for a small wrench when the pause is over.

/// How a person says that the device may push.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engagement {
    /// By holding it: as soon as the computed wrench is small.
    Automatic,
    /// By pressing one of these buttons (a bit each), and no more by pressing it again.
    Button(u32),
    /// By keeping one of these buttons pressed.
    DeadMan(u32),
}

/// Where the engagement stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Nobody has asked for forces.
    #[default]
    Idle,
    /// Asked for, but the computed wrench is too large to begin with.
    Waiting,
    /// The wrench grows in.
    Ramping,
    /// The whole wrench.
    Engaged,
    /// A fault has taken the wrench away; damping only.
    Faulted,
    /// A fault has taken the wrench away for good.
    Stopped,
}

impl Phase {
    /// As it stands in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Waiting => "waiting",
            Self::Ramping => "ramping",
            Self::Engaged => "engaged",
            Self::Faulted => "faulted",
            Self::Stopped => "stopped",
        }
    }

    /// True when there is a wrench, whole or in part.
    pub fn is_on(self) -> bool {
        matches!(self, Self::Ramping | Self::Engaged)
    }

    /// True when a fault keeps the wrench away.
    pub fn is_faulted(self) -> bool {
        matches!(self, Self::Faulted | Self::Stopped)
    }
}

/// What happens after a fault that the loop survives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterFault {
    /// Engaged again as at the beginning, once free of faults for a while.
    #[default]
    Reengage,
    /// The run ends.
    Stop,
}

/// What one tick brings to the engagement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) buttons: u32,
    /// The computed wrench is small enough to begin with.
    pub(super) small: bool,
    /// A fault, and whether it ends the run.
    pub(super) fault: Option<AfterFault>,
    /// Nobody may be pushed.
    pub(super) paused: bool,
    pub(super) dt: f64,
}

/// The state machine.
#[derive(Clone, Debug)]
pub(super) struct Machine {
    engagement: Engagement,
    ramp: f64,
    hold: f64,
    phase: Phase,
    asked: bool,
    buttons: Option<u32>,
    /// s in the phase.
    since: f64,
}

impl Machine {
    pub(super) fn new(engagement: Engagement, ramp: f64, hold: f64) -> Self {
        Self { engagement, ramp, hold, phase: Phase::Idle, asked: false, buttons: None, since: 0.0 }
    }

    pub(super) fn phase(&self) -> Phase {
        self.phase
    }

    /// The share of the wrench that is given, 0 to 1.
    pub(super) fn gain(&self) -> f64 {
        match self.phase {
            Phase::Engaged => 1.0,
            Phase::Ramping => (self.since / self.ramp).min(1.0),
            _ => 0.0,
        }
    }

    /// One tick on.
    pub(super) fn advance(&mut self, event: &Event) {
        self.since += event.dt;
        self.ask(event.buttons);
        if let Some(after) = event.fault {
            // Whoever asked before the fault has to ask again, and a button that is held is no new wish.
            self.asked = self.engagement == Engagement::Automatic;
            let stopped = self.phase == Phase::Stopped || after == AfterFault::Stop;
            return self.go(if stopped { Phase::Stopped } else { Phase::Faulted });
        }
        self.asked &= !event.paused;
        let idle = !self.asked;
        match self.phase {
            Phase::Stopped => {}
            Phase::Faulted if self.since < self.hold => {}
            _ if idle && self.phase != Phase::Idle => self.go(Phase::Idle),
            Phase::Idle | Phase::Faulted if self.asked => self.go(Phase::Waiting),
            _ => {}
        }
        // A tick is enough to go from Waiting on, and from a ramp without length.
        if self.phase == Phase::Waiting && event.small {
            self.go(Phase::Ramping);
        }
        if self.phase == Phase::Ramping && self.since >= self.ramp {
            self.go(Phase::Engaged);
        }
    }

    fn ask(&mut self, buttons: u32) {
        // A button that is down when the run begins has not been pressed for it.
        let before = self.buttons.replace(buttons).unwrap_or(buttons);
        let pressed = |mask: u32| buttons & !before & mask != 0;
        match self.engagement {
            Engagement::Automatic => self.asked = true,
            Engagement::Button(mask) => self.asked ^= pressed(mask),
            Engagement::DeadMan(mask) => self.asked = (self.asked || pressed(mask)) && buttons & mask != 0,
        }
    }

    fn go(&mut self, phase: Phase) {
        self.phase = phase;
        self.since = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;

    fn tick(machine: &mut Machine, buttons: u32, small: bool) -> Phase {
        machine.advance(&Event { buttons, small, fault: None, paused: false, dt: DT });
        machine.phase()
    }

    fn fault(machine: &mut Machine, buttons: u32, after: AfterFault) -> Phase {
        machine.advance(&Event { buttons, small: true, fault: Some(after), paused: false, dt: DT });
        machine.phase()
    }

    fn ticks(machine: &mut Machine, count: usize, buttons: u32, small: bool) -> Phase {
        for _ in 0..count {
            tick(machine, buttons, small);
        }
        machine.phase()
    }

    #[test]
    fn by_itself_it_waits_for_a_small_wrench_and_ramps() {
        let mut machine = Machine::new(Engagement::Automatic, 0.1, 0.05);
        assert_eq!(ticks(&mut machine, 30, 0, false), Phase::Waiting);
        assert!(machine.gain() <= 0.0);
        assert_eq!(tick(&mut machine, 0, true), Phase::Ramping);
        // Once it ramps, the wrench may grow.
        assert_eq!(ticks(&mut machine, 50, 0, false), Phase::Ramping);
        assert!((machine.gain() - 0.5).abs() < 1e-9);
        assert_eq!(ticks(&mut machine, 51, 0, false), Phase::Engaged);
        assert_eq!(fault(&mut machine, 0, AfterFault::Reengage), Phase::Faulted);
        assert_eq!(ticks(&mut machine, 49, 0, true), Phase::Faulted);
        assert_eq!(ticks(&mut machine, 2, 0, true), Phase::Ramping);
        assert_eq!(fault(&mut machine, 0, AfterFault::Stop), Phase::Stopped);
        assert_eq!(ticks(&mut machine, 500, 0, true), Phase::Stopped);
        assert_eq!(fault(&mut machine, 0, AfterFault::Reengage), Phase::Stopped);
    }

    #[test]
    fn a_button_is_pressed_again_after_a_fault() {
        let mut machine = Machine::new(Engagement::Button(0b10), 0.0, 0.01);
        assert_eq!(ticks(&mut machine, 5, 0b10, true), Phase::Idle, "it was down from the start");
        assert_eq!(tick(&mut machine, 0b01, true), Phase::Idle, "another button");
        assert_eq!(tick(&mut machine, 0b11, true), Phase::Engaged);
        assert_eq!(ticks(&mut machine, 5, 0, true), Phase::Engaged);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Idle, "pressed again");
        tick(&mut machine, 0, true);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Engaged);
        fault(&mut machine, 0b10, AfterFault::Reengage);
        assert_eq!(ticks(&mut machine, 100, 0b10, true), Phase::Idle);
        tick(&mut machine, 0, true);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Engaged);
    }

    #[test]
    fn after_a_pause_it_is_engaged_anew() {
        for (engagement, button) in
            [(Engagement::Automatic, 0), (Engagement::Button(1), 1), (Engagement::DeadMan(1), 1)]
        {
            let mut machine = Machine::new(engagement, 0.01, 0.01);
            tick(&mut machine, 0, true);
            assert_eq!(ticks(&mut machine, 12, button, true), Phase::Engaged);
            for _ in 0..5 {
                machine.advance(&Event { buttons: button, small: true, fault: None, paused: true, dt: DT });
                assert_eq!(machine.phase(), Phase::Idle);
            }
            if button == 0 {
                assert_eq!(ticks(&mut machine, 30, 0, false), Phase::Waiting, "{engagement:?}");
            } else {
                assert_eq!(ticks(&mut machine, 30, button, true), Phase::Idle, "{engagement:?}: it is still pressed");
                tick(&mut machine, 0, true);
            }
            assert_eq!(ticks(&mut machine, 12, button, true), Phase::Engaged, "{engagement:?}");
        }
        let mut machine = Machine::new(Engagement::Automatic, 0.0, 0.01);
        assert_eq!(fault(&mut machine, 0, AfterFault::Stop), Phase::Stopped);
        machine.advance(&Event { buttons: 0, small: true, fault: None, paused: true, dt: DT });
        assert_eq!(machine.phase(), Phase::Stopped);
    }

    #[test]
    fn a_dead_mans_button_is_held() {
        let mut machine = Machine::new(Engagement::DeadMan(1), 0.01, 0.01);
        assert_eq!(tick(&mut machine, 0, true), Phase::Idle);
        assert_eq!(tick(&mut machine, 1, false), Phase::Waiting);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
        assert_eq!(tick(&mut machine, 0, true), Phase::Idle);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
        fault(&mut machine, 1, AfterFault::Reengage);
        assert_eq!(ticks(&mut machine, 100, 1, true), Phase::Idle, "held through a fault is not asked anew");
        tick(&mut machine, 0, true);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
    }
}
