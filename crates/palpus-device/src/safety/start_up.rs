//! The enable_mode: a state machine that decides when the device may give force.
//!
//! ```text
//!          requested        small wrench          ramp is over
//!   Idle ────────► Waiting ──────────────► Ramping ─────────► Engaged
//!    │               ▲                        │                  │
//!    │               └── large wrench, early ─┤                  │
//!    ▲ ◄──────────────┴─── not requested ─────┴──────────────────┘
//!    │                                                       any phase
//!    │ hold time is over                                         │ fault
//!    └────────── Faulted ◄─────────────────────────────────────────┘
//!                  │ third fault within ten seconds
//!                  ▼
//!               Latched ─── a button or key is pressed ──► Faulted
//! ```
//!
//! A wrench is given only in `Ramping` (a growing part) and in `Engaged` (the full wrench). In any
//! phase, a fault removes the wrench in the tick in which the fault is detected. After the hold
//! time, the start-up goes from `Faulted` directly to `Waiting`. With [`AfterFault::Stop`]
//! a fault leads to `Stopped`, which is final.
//!
//! A pause leads to `Idle`, as if the user had released the button. Buttons must then be pressed
//! again. Without buttons the device waits for a small wrench after the pause.
//!
//! A small wrench in one tick does not prove that the tool is free: a coupled tool begins at the
//! grip even if it overlaps a part there, and leaves the part in the next ticks. So if the wrench
//! becomes large in the first part of the ramp ([`EARLY`]), the start-up goes back to `Waiting`.

use super::latch::Latch;

/// The first part of the ramp, in which a large wrench ends the ramp. At most this fraction of the
/// wrench has been given then.
///
/// The ramp takes 250 ms, so this part takes 50 ms. A tool leaves a part within about 10 ms. With a
/// larger value, a hand that reaches a part soon after the start feels nothing.
const EARLY: f64 = 0.2;

/// How the user enables forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnableMode {
    /// Forces are enabled automatically as soon as the computed wrench is small.
    Automatic,
    /// A press of one of these buttons (one bit each) enables forces; the next press disables them.
    Button(u32),
    /// Forces are enabled while one of these buttons is held (one bit each).
    DeadMan(u32),
}

/// Bit of [`DeviceState::buttons`](crate::DeviceState) that is set while the program's own key for
/// force is held ([`crate::RunControl::hold`]).
pub const HOLD_KEY: u32 = 1 << 31;
/// Bit of the key that enables a latched device again ([`crate::RunControl::rearm`]).
pub const REARM_KEY: u32 = 1 << 30;
/// Bits of the device's own buttons.
pub const DEVICE_BUTTONS: u32 = !(HOLD_KEY | REARM_KEY);

/// How a device is enabled again after three faults in ten seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rearm {
    /// The user presses a button of the device or a key.
    #[default]
    ByPerson,
    /// The device engages again as after any other fault. This setting is meant for tests.
    Automatic,
}

/// Phase of the start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Forces are not requested.
    #[default]
    Idle,
    /// Forces are requested, but the computed wrench is too large to begin.
    Waiting,
    /// The wrench ramps up.
    Ramping,
    /// The full wrench is given.
    Engaged,
    /// A fault has removed the wrench; only damping remains.
    Faulted,
    /// A fault has removed the wrench for the rest of the run.
    Stopped,
    /// Repeated faults have removed the wrench until the user presses a button or key.
    Latched,
}

impl Phase {
    /// Returns the name used in summaries.
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

    /// Returns true if a wrench is given, in full or in part.
    pub fn is_on(self) -> bool {
        matches!(self, Self::Ramping | Self::Engaged)
    }

    /// Returns true if a fault keeps the wrench off.
    pub fn is_faulted(self) -> bool {
        matches!(self, Self::Faulted | Self::Stopped | Self::Latched)
    }
}

/// Reaction to a fault that the loop survives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterFault {
    /// The device engages again as at the start, after a time without faults.
    #[default]
    Reengage,
    /// The run ends.
    Stop,
}

/// Input of the start-up in one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) buttons: u32,
    /// True if the computed wrench is small enough to begin.
    pub(super) small: bool,
    /// A fault in this tick, with the required reaction.
    pub(super) fault: Option<AfterFault>,
    /// True if the run is paused, so no force may be given.
    pub(super) paused: bool,
    pub(super) dt: f64,
}

/// State machine of the start-up.
#[derive(Clone, Debug)]
pub(super) struct Machine {
    enable_mode: EnableMode,
    ramp: f64,
    hold: f64,
    latch: Latch,
    phase: Phase,
    requested: bool,
    buttons: Option<u32>,
    /// Time in this phase, s.
    since: f64,
}

impl Machine {
    pub(super) fn new(enable_mode: EnableMode, ramp: f64, hold: f64, rearm: Rearm) -> Self {
        let latch = Latch::new(rearm);
        Self { enable_mode, ramp, hold, latch, phase: Phase::Idle, requested: false, buttons: None, since: 0.0 }
    }

    pub(super) fn phase(&self) -> Phase {
        self.phase
    }

    /// Returns the fraction of the wrench that is given, 0 to 1.
    pub(super) fn gain(&self) -> f64 {
        match self.phase {
            Phase::Engaged => 1.0,
            Phase::Ramping => (self.since / self.ramp).min(1.0),
            _ => 0.0,
        }
    }

    /// Advances by one tick.
    pub(super) fn advance(&mut self, event: &Event) {
        self.since += event.dt;
        self.latch.advance(event.dt);
        let rearmed = self.read_buttons(event.buttons);
        if let Some(after) = event.fault {
            // After a fault the user must request forces again; a button that is still held does
            // not count.
            self.requested = self.enable_mode == EnableMode::Automatic;
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
            self.latch.clear();
            self.go(Phase::Faulted);
        }
        self.requested &= !event.paused;
        let idle = !self.requested;
        match self.phase {
            Phase::Stopped => {}
            Phase::Faulted if self.since < self.hold => {}
            _ if idle && self.phase != Phase::Idle => self.go(Phase::Idle),
            Phase::Idle | Phase::Faulted if self.requested => self.go(Phase::Waiting),
            Phase::Ramping if !event.small && self.since <= EARLY * self.ramp => self.go(Phase::Waiting),
            _ => {}
        }
        // One tick may go through several phases, for example if the ramp has length 0.
        if self.phase == Phase::Waiting && event.small {
            self.go(Phase::Ramping);
        }
        if self.phase == Phase::Ramping && self.since >= self.ramp {
            self.go(Phase::Engaged);
        }
    }

    /// Updates `requested` from the buttons. Returns true if a button was pressed that enables a
    /// latched device again.
    fn read_buttons(&mut self, buttons: u32) -> bool {
        // A button that is already down at the start of the run does not count as pressed.
        let before = self.buttons.replace(buttons).unwrap_or(buttons);
        let pressed = |mask: u32| buttons & !before & mask != 0;
        match self.enable_mode {
            EnableMode::Automatic => self.requested = true,
            EnableMode::Button(mask) => self.requested ^= pressed(mask),
            EnableMode::DeadMan(mask) => self.requested = (self.requested || pressed(mask)) && buttons & mask != 0,
        }
        pressed(match self.enable_mode {
            EnableMode::Automatic => u32::MAX,
            EnableMode::Button(mask) | EnableMode::DeadMan(mask) => mask | REARM_KEY,
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
    fn automatic_start_waits_for_small_wrench_and_ramps() {
        let mut machine = Machine::new(EnableMode::Automatic, 0.1, 0.05, Rearm::ByPerson);
        assert_eq!(ticks(&mut machine, 30, 0, false), Phase::Waiting);
        assert!(machine.gain() <= 0.0);
        assert_eq!(tick(&mut machine, 0, true), Phase::Ramping);
        // A wrench that grows at once comes from a tool that overlaps a part.
        assert_eq!(ticks(&mut machine, 18, 0, true), Phase::Ramping);
        assert_eq!(ticks(&mut machine, 30, 0, false), Phase::Waiting);
        assert!(machine.gain() <= 0.0);
        assert_eq!(ticks(&mut machine, 22, 0, true), Phase::Ramping);
        // Later the wrench may grow.
        assert_eq!(ticks(&mut machine, 29, 0, false), Phase::Ramping);
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
    fn button_must_be_pressed_again_after_a_fault() {
        let mut machine = Machine::new(EnableMode::Button(0b10), 0.0, 0.01, Rearm::ByPerson);
        assert_eq!(
            ticks(&mut machine, 5, 0b10, true),
            Phase::Idle,
            "a button that is down from the start does not count"
        );
        assert_eq!(tick(&mut machine, 0b01, true), Phase::Idle, "another button must not enable forces");
        assert_eq!(tick(&mut machine, 0b11, true), Phase::Engaged);
        assert_eq!(ticks(&mut machine, 5, 0, true), Phase::Engaged);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Idle, "a second press must disable forces");
        tick(&mut machine, 0, true);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Engaged);
        fault(&mut machine, 0b10, AfterFault::Reengage);
        assert_eq!(ticks(&mut machine, 100, 0b10, true), Phase::Idle);
        tick(&mut machine, 0, true);
        assert_eq!(tick(&mut machine, 0b10, true), Phase::Engaged);
    }

    #[test]
    fn device_must_be_engaged_again_after_a_pause() {
        for (enable_mode, button) in
            [(EnableMode::Automatic, 0), (EnableMode::Button(1), 1), (EnableMode::DeadMan(1), 1)]
        {
            let mut machine = Machine::new(enable_mode, 0.01, 0.01, Rearm::ByPerson);
            tick(&mut machine, 0, true);
            assert_eq!(ticks(&mut machine, 12, button, true), Phase::Engaged);
            for _ in 0..5 {
                machine.advance(&Event { buttons: button, small: true, fault: None, paused: true, dt: DT });
                assert_eq!(machine.phase(), Phase::Idle);
            }
            if button == 0 {
                assert_eq!(ticks(&mut machine, 30, 0, false), Phase::Waiting, "{enable_mode:?}");
            } else {
                assert_eq!(
                    ticks(&mut machine, 30, button, true),
                    Phase::Idle,
                    "{enable_mode:?}: a button that stays pressed does not count"
                );
                tick(&mut machine, 0, true);
            }
            assert_eq!(ticks(&mut machine, 12, button, true), Phase::Engaged, "{enable_mode:?}");
        }
        let mut machine = Machine::new(EnableMode::Automatic, 0.0, 0.01, Rearm::ByPerson);
        assert_eq!(fault(&mut machine, 0, AfterFault::Stop), Phase::Stopped);
        machine.advance(&Event { buttons: 0, small: true, fault: None, paused: true, dt: DT });
        assert_eq!(machine.phase(), Phase::Stopped);
    }

    #[test]
    fn dead_man_button_must_be_held() {
        let mut machine = Machine::new(EnableMode::DeadMan(1), 0.01, 0.01, Rearm::ByPerson);
        assert_eq!(tick(&mut machine, 0, true), Phase::Idle);
        assert_eq!(tick(&mut machine, 1, false), Phase::Waiting);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
        assert_eq!(tick(&mut machine, 0, true), Phase::Idle);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
        fault(&mut machine, 1, AfterFault::Reengage);
        assert_eq!(
            ticks(&mut machine, 100, 1, true),
            Phase::Idle,
            "a button held during a fault must not enable forces"
        );
        tick(&mut machine, 0, true);
        assert_eq!(ticks(&mut machine, 12, 1, true), Phase::Engaged);
    }

    /// Engages the device and then faults it, `count` times, `apart` ticks after each other.
    /// Returns the last phase.
    fn faults(machine: &mut Machine, count: usize, apart: usize) -> Phase {
        for _ in 0..count {
            assert_eq!(ticks(machine, apart, 0, true), Phase::Engaged);
            fault(machine, 0, AfterFault::Reengage);
        }
        machine.phase()
    }

    #[test]
    fn third_fault_in_ten_seconds_latches() {
        for (buttons, other) in [(REARM_KEY, 0), (1, 0), (HOLD_KEY, 1)] {
            let mut machine = Machine::new(EnableMode::Automatic, 0.01, 0.01, Rearm::ByPerson);
            assert_eq!(faults(&mut machine, 2, 4000), Phase::Faulted);
            assert_eq!(faults(&mut machine, 1, 1900), Phase::Latched);
            assert_eq!(
                ticks(&mut machine, 60_000, other, true),
                if other == 0 { Phase::Latched } else { Phase::Engaged }
            );
            tick(&mut machine, 0, true);
            tick(&mut machine, buttons, true);
            assert_eq!(ticks(&mut machine, 40, buttons, true), Phase::Engaged);
            // The count starts again.
            assert_eq!(faults(&mut machine, 2, 100), Phase::Faulted);
        }
    }

    #[test]
    fn rare_or_consecutive_faults_do_not_latch() {
        let mut machine = Machine::new(EnableMode::Automatic, 0.01, 0.01, Rearm::ByPerson);
        assert_eq!(faults(&mut machine, 5, 5001), Phase::Faulted);
        for _ in 0..100 {
            fault(&mut machine, 0, AfterFault::Reengage);
            tick(&mut machine, 0, true);
        }
        assert_eq!(ticks(&mut machine, 100, 0, true), Phase::Engaged);
        let mut machine = Machine::new(EnableMode::Automatic, 0.01, 0.01, Rearm::Automatic);
        assert_eq!(faults(&mut machine, 20, 100), Phase::Faulted);
    }

    #[test]
    fn latched_device_is_enabled_by_its_own_button() {
        let mut machine = Machine::new(EnableMode::DeadMan(1), 0.01, 0.01, Rearm::ByPerson);
        for _ in 0..3 {
            tick(&mut machine, 0, true);
            assert_eq!(ticks(&mut machine, 40, 1, true), Phase::Engaged);
            fault(&mut machine, 1, AfterFault::Reengage);
        }
        assert_eq!(ticks(&mut machine, 1000, 1, true), Phase::Latched, "a held button must not count as pressed");
        tick(&mut machine, 2, true);
        assert_eq!(ticks(&mut machine, 10, 2, true), Phase::Latched, "another button must not count");
        tick(&mut machine, 0, true);
        assert_eq!(ticks(&mut machine, 40, 1, true), Phase::Engaged);
    }
}
