//! The engagement: when the device may push.
//!
//! ```text
//!          asked            small wrench          ramped in
//!   Idle ────────► Waiting ──────────────► Ramping ─────────► Engaged
//!    ▲ ◄──────────────┴──── not asked ────────┴──────────────────┘
//!    │                                                            any of them
//!    │ until it is asked for                                         │ fault
//!    └────────── Faulted ◄─────────────────────────────────────────┘
//!                 │ (held until free of faults; Waiting at once when engagement is automatic;
//!                 ▼  Stopped by policy; Latched at the third fault in ten seconds)
//!              Latched ─── a button or key is pressed ──► Faulted
//! ```
//!
//! There is a wrench in `Ramping` and `Engaged` only; how it grows in says `onset.rs`. A fault takes
//! it away from the tick on in which it is seen, whatever the phase. A pause leads to `Idle` like a
//! hand that lets go: buttons have to be pressed again, and without buttons it waits for a small
//! wrench when the pause is over.

use super::latch::Latch;

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

/// The bit of [`DeviceState::buttons`](crate::DeviceState) for the program's own key for force,
/// while it is held: see [`crate::RunControl::hold`].
pub const HOLD_KEY: u32 = 1 << 31;
/// The bit of the key that enables a latched device again: see [`crate::RunControl::rearm`].
pub const REARM_KEY: u32 = 1 << 30;
/// The bits that are a device's own.
pub const DEVICE_BUTTONS: u32 = !(HOLD_KEY | REARM_KEY);

/// Condition for enabling the force after three faults in ten seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rearm {
    /// A person, by pressing a button of the device or a key.
    #[default]
    ByPerson,
    /// The engagement, as after any other fault. For tests.
    Automatic,
}

/// Phase of the engagement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Force was not requested yet.
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
    /// Faults have taken the wrench away so often that a person has to ask for it.
    Latched,
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
            Self::Latched => "latched",
        }
    }

    /// True when there is a wrench, whole or in part.
    pub fn is_on(self) -> bool {
        matches!(self, Self::Ramping | Self::Engaged)
    }

    /// True when a fault keeps the wrench away.
    pub fn is_faulted(self) -> bool {
        matches!(self, Self::Faulted | Self::Stopped | Self::Latched)
    }
}

/// Reaction to a fault that the loop survives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterFault {
    /// Engaged again as at the beginning, once free of faults for a while.
    #[default]
    Reengage,
    /// The run ends.
    Stop,
}

/// Input of the engagement in one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) buttons: u32,
    /// The computed wrench is small enough to begin with.
    pub(super) small: bool,
    /// A fault, and whether it ends the run.
    pub(super) fault: Option<AfterFault>,
    /// The run is paused: no force.
    pub(super) paused: bool,
    pub(super) dt: f64,
}

/// The state machine.
#[derive(Clone, Debug)]
pub(super) struct Machine {
    engagement: Engagement,
    ramp: f64,
    hold: f64,
    latch: Latch,
    phase: Phase,
    asked: bool,
    buttons: Option<u32>,
    /// s in the phase.
    since: f64,
}

impl Machine {
    pub(super) fn new(engagement: Engagement, ramp: f64, hold: f64, rearm: Rearm) -> Self {
        let latch = Latch::new(rearm);
        Self { engagement, ramp, hold, latch, phase: Phase::Idle, asked: false, buttons: None, since: 0.0 }
    }

    pub(super) fn phase(&self) -> Phase {
        self.phase
    }

    /// The gain on what the hand presses from now on, 0 to 1.
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
        self.latch.advance(event.dt);
        let rearmed = self.ask(event.buttons);
        if let Some(after) = event.fault {
            // After a fault the person must ask again; a button that is still held does not count.
            self.asked = self.engagement == Engagement::Automatic;
            let latched = self.phase == Phase::Latched || !self.phase.is_faulted() && self.latch.count();
            let stopped = self.phase == Phase::Stopped || after == AfterFault::Stop;
            return self.go(match (stopped, latched) {
                (true, _) => Phase::Stopped,
                (false, true) => Phase::Latched,
                (false, false) => Phase::Faulted,
            });
        }
        if self.phase == Phase::Latched {
            if !rearmed {
                return;
            }
            self.latch.forget();
            self.go(Phase::Faulted);
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

    /// Takes notice of the buttons; true if one was pressed by which a latched device is armed
    /// again.
    fn ask(&mut self, buttons: u32) -> bool {
        // A button that is down when the run begins has not been pressed for it.
        let before = self.buttons.replace(buttons).unwrap_or(buttons);
        let pressed = |mask: u32| buttons & !before & mask != 0;
        match self.engagement {
            Engagement::Automatic => self.asked = true,
            Engagement::Button(mask) => self.asked ^= pressed(mask),
            Engagement::DeadMan(mask) => self.asked = (self.asked || pressed(mask)) && buttons & mask != 0,
        }
        pressed(match self.engagement {
            Engagement::Automatic => u32::MAX,
            Engagement::Button(mask) | Engagement::DeadMan(mask) => mask | REARM_KEY,
        })
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
        let mut machine = Machine::new(Engagement::Automatic, 0.1, 0.05, Rearm::ByPerson);
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
        let mut machine = Machine::new(Engagement::Button(0b10), 0.0, 0.01, Rearm::ByPerson);
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
            let mut machine = Machine::new(engagement, 0.01, 0.01, Rearm::ByPerson);
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
        let mut machine = Machine::new(Engagement::Automatic, 0.0, 0.01, Rearm::ByPerson);
        assert_eq!(fault(&mut machine, 0, AfterFault::Stop), Phase::Stopped);
        machine.advance(&Event { buttons: 0, small: true, fault: None, paused: true, dt: DT });
        assert_eq!(machine.phase(), Phase::Stopped);
    }

    #[test]
    fn a_dead_mans_button_is_held() {
        let mut machine = Machine::new(Engagement::DeadMan(1), 0.01, 0.01, Rearm::ByPerson);
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

    /// Engaged, then faults `apart` ticks after each other; the phase after the last one.
    fn faults(machine: &mut Machine, count: usize, apart: usize) -> Phase {
        for _ in 0..count {
            assert_eq!(ticks(machine, apart, 0, true), Phase::Engaged);
            fault(machine, 0, AfterFault::Reengage);
        }
        machine.phase()
    }

    #[test]
    fn the_third_fault_in_ten_seconds_needs_a_person() {
        for (buttons, other) in [(REARM_KEY, 0), (1, 0), (HOLD_KEY, 1)] {
            let mut machine = Machine::new(Engagement::Automatic, 0.01, 0.01, Rearm::ByPerson);
            assert_eq!(faults(&mut machine, 2, 4000), Phase::Faulted);
            assert_eq!(faults(&mut machine, 1, 1900), Phase::Latched);
            assert_eq!(
                ticks(&mut machine, 60_000, other, true),
                if other == 0 { Phase::Latched } else { Phase::Engaged }
            );
            tick(&mut machine, 0, true);
            tick(&mut machine, buttons, true);
            assert_eq!(ticks(&mut machine, 40, buttons, true), Phase::Engaged);
            // The count begins anew.
            assert_eq!(faults(&mut machine, 2, 100), Phase::Faulted);
        }
    }

    #[test]
    fn faults_that_are_rare_or_follow_each_other_do_not_latch() {
        let mut machine = Machine::new(Engagement::Automatic, 0.01, 0.01, Rearm::ByPerson);
        assert_eq!(faults(&mut machine, 5, 5001), Phase::Faulted);
        for _ in 0..100 {
            fault(&mut machine, 0, AfterFault::Reengage);
            tick(&mut machine, 0, true);
        }
        assert_eq!(ticks(&mut machine, 100, 0, true), Phase::Engaged);
        let mut machine = Machine::new(Engagement::Automatic, 0.01, 0.01, Rearm::Automatic);
        assert_eq!(faults(&mut machine, 20, 100), Phase::Faulted);
    }

    #[test]
    fn a_latched_device_with_a_button_takes_that_button() {
        let mut machine = Machine::new(Engagement::DeadMan(1), 0.01, 0.01, Rearm::ByPerson);
        for _ in 0..3 {
            tick(&mut machine, 0, true);
            assert_eq!(ticks(&mut machine, 40, 1, true), Phase::Engaged);
            fault(&mut machine, 1, AfterFault::Reengage);
        }
        assert_eq!(ticks(&mut machine, 1000, 1, true), Phase::Latched, "held is not pressed");
        tick(&mut machine, 2, true);
        assert_eq!(ticks(&mut machine, 10, 2, true), Phase::Latched, "another button");
        tick(&mut machine, 0, true);
        assert_eq!(ticks(&mut machine, 40, 1, true), Phase::Engaged);
    }
}
