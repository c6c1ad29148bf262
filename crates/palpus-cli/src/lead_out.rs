//! Leads the device's grip out of the part if the probe starts inside and the user requested it.
//!
//! 1. A goal moves along the way out at [`SPEED`]. The way out was computed before the run. The
//!    goal's distance ahead of the grip is limited by the spring's largest force, so a hand that
//!    holds on is not dragged.
//! 2. A spring and a damper pull the grip to the goal, with at most [`SHARE`] of the force at which
//!    the safety chain engages. The chain gets this wrench in place of the contact wrench, so ramp,
//!    limits, start-up and faults apply as to any other force.
//! 3. The spring's work comes from the goal and not from contacts, so the chain's energy account
//!    gets it. The spring's power is at most force times speed, a few hundredths of a watt.
//! 4. At the end of the way the engine clears its cached contacts. Once the probe is free, the
//!    contacts give the wrench again. If the grip was turned on the way, the probe may still
//!    overlap. The spring then holds the grip at the end of the way until the probe is free.

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{DeviceState, SafetyLimits};
use toml::{Table, Value};

use crate::way_out::InsideStart;

/// Speed of the goal, m/s.
const SPEED: f64 = 0.02;
/// Share of the force at which the chain engages.
const SHARE: f64 = 0.9;
/// Stiffness of the spring, N/m: soft for a hand, and stable on any device at a loop of at least
/// 500 Hz.
const STIFFNESS: f64 = 300.0;
/// Distance of the goal beyond the end of the way, so that the grip passes the end, m.
const BEYOND: f64 = 2e-3;

/// Name of the section in a recording's header.
const SECTION: &str = "lead_out";

/// Leads one device's grip; see the module's outline.
#[derive(Clone, Debug)]
pub(crate) struct LeadOut {
    /// Position of the grip at the start, world, m.
    from: DVec3,
    /// The way out, world, m.
    way: DVec3,
    /// Largest force, N.
    most: f64,
    /// Damping, N·s/m.
    damping: f64,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Before the first tick.
    Before,
    /// The grip moves along the way.
    Leading {
        /// Position of the goal along the way, m.
        goal: f64,
        /// Position of the grip in the last tick, world, m.
        last: DVec3,
        /// The goal has passed the end of the way.
        passed: bool,
    },
    /// Finished: the device gets the contact wrench.
    Over,
}

/// Action of a tick.
pub(crate) struct LeadOutTick {
    /// Wrench on the device, world.
    pub(crate) wrench: Wrench,
    /// Energy that the goal gave to the grip since the last tick, J; negative if the goal took
    /// energy.
    pub(crate) work: f64,
    /// True if the engine has to clear its cached contacts.
    pub(crate) forget: bool,
}

impl LeadOut {
    /// Leads out a probe that starts `inside`, with a safety chain with these `limits`.
    pub(crate) fn new(inside: &InsideStart, limits: &SafetyLimits) -> Self {
        let (from, way) = inside.way();
        Self { from, way, most: SHARE * limits.engage_force, damping: limits.damping, phase: Phase::Before }
    }

    /// Computes one tick of `dt` (s) for the device in `state`. `free`: the engine found the probe
    /// outside. `None` if the device gets the contact wrench.
    pub(crate) fn tick(&mut self, state: &DeviceState, dt: f64, free: bool) -> Option<LeadOutTick> {
        let (along, length) = (self.way.normalize_or_zero(), self.way.length());
        let grip = state.pose.translation;
        let done = (grip - self.from).dot(along);
        let (goal, last, passed) = match self.phase {
            Phase::Before if InsideStart::is_near(self.from, grip) => (0.0, grip, false),
            Phase::Leading { goal, last, passed } => (goal, last, passed),
            Phase::Before | Phase::Over => {
                self.phase = Phase::Over;
                return None;
            }
        };
        // In the tick of the reset, the engine has not searched for contacts yet.
        if passed && free {
            self.phase = Phase::Over;
            return None;
        }
        let now = done >= length;
        let goal = (goal + SPEED * dt).min(done + self.most / STIFFNESS).min(length + BEYOND).max(0.0);
        let pull = (self.from + goal * along - grip) * STIFFNESS - state.twist.linear * self.damping;
        let force = pull.clamp_length_max(self.most);
        self.phase = Phase::Leading { goal, last: grip, passed: passed || now };
        let most = self.most * SPEED * dt;
        let work = force.dot(grip - last).clamp(-most, most);
        Some(LeadOutTick { wrench: Wrench { force, ..Wrench::ZERO }, work, forget: now && !passed })
    }

    /// Writes a description into a recording's header.
    pub(crate) fn record(&self, into: &mut Table) {
        let vector = |v: DVec3| Value::from(v.to_array().to_vec());
        let mut table = Table::new();
        table.insert("from".into(), vector(self.from));
        table.insert("way".into(), vector(self.way));
        table.insert("force".into(), self.most.into());
        table.insert("damping".into(), self.damping.into());
        into.insert(SECTION.into(), Value::Table(table));
    }

    /// Reads the description from a recording's header; `None` if the run had no lead-out.
    pub(crate) fn of_recording(more: &Table) -> Option<Self> {
        let table = more.get(SECTION)?.as_table()?;
        let number = |name: &str| table.get(name)?.as_float().filter(|value| value.is_finite() && *value >= 0.0);
        let vector = |name: &str| {
            let list = table.get(name)?.as_array()?;
            let value = |k: usize| list.get(k)?.as_float().filter(|value| value.is_finite());
            Some(DVec3::new(value(0)?, value(1)?, value(2)?))
        };
        Some(Self {
            from: vector("from")?,
            way: vector("way")?,
            most: number("force")?,
            damping: number("damping")?,
            phase: Phase::Before,
        })
    }
}

#[cfg(test)]
mod tests {
    use palpus::algebra::{Pose, Twist};

    use super::*;

    const DT: f64 = 1e-3;

    fn lead() -> LeadOut {
        LeadOut { from: DVec3::X, way: DVec3::Z * 0.01, most: 0.7, damping: 2.0, phase: Phase::Before }
    }

    fn at(z: f64) -> DeviceState {
        let pose = Pose::from_translation(DVec3::X + DVec3::Z * z);
        DeviceState { pose, twist: Twist::default(), buttons: 0, time: 0.0, withheld: false }
    }

    #[test]
    fn held_grip_is_pulled_softly_without_energy() {
        let mut lead = lead();
        for _ in 0..5000 {
            let led = lead.tick(&at(0.0), DT, false).expect("the device leads the grip");
            assert!(led.wrench.force.length() <= 0.7 + 1e-12 && led.work == 0.0 && !led.forget);
        }
    }

    #[test]
    fn lead_out_stops_past_the_end_when_probe_is_free() {
        let mut lead = lead();
        assert!(lead.tick(&at(0.0), DT, true).is_some(), "deep inside, where no contact is found, it must lead");
        assert!(lead.tick(&at(0.0101), DT, true).expect("the device leads the grip").forget);
        assert!(!lead.tick(&at(0.0101), DT, false).expect("the probe was rotated").forget);
        assert!(lead.tick(&at(0.0101), DT, true).is_none());
        assert!(lead.tick(&at(0.0), DT, false).is_none(), "the lead-out must not start again");
    }

    #[test]
    fn device_that_starts_elsewhere_is_not_led() {
        let mut lead = lead();
        assert!(lead.tick(&at(0.005), DT, false).is_none() && lead.tick(&at(0.0), DT, false).is_none());
    }

    #[test]
    fn header_stores_the_lead_out_exactly() {
        let lead = LeadOut { way: DVec3::new(0.1, 1.0 / 3.0, -1e-9), ..lead() };
        let mut more = Table::new();
        lead.record(&mut more);
        let read = toml::from_str(&toml::to_string(&more).expect("the TOML is valid")).expect("the TOML is valid");
        let again = LeadOut::of_recording(&read).expect("the header has a lead-out");
        assert!((again.from, again.way) == (lead.from, lead.way) && again.most == lead.most);
        assert!(LeadOut::of_recording(&Table::new()).is_none());
    }
}
