//! The safety chain limits each computed wrench before it reaches the hand, for every device and
//! every source of the wrench.
//!
//! The stages run in this order in every tick, and cannot be switched off:
//!
//! | stage | condition | effect on the wrench |
//! |---|---|---|
//! | 1 non-finite | the state or the wrench contains a non-finite number | zero; a fault |
//! | 2 gate | a jump, an implausible speed, a frozen state or a clock jump | zero; a fault |
//! | 3 limit cycle | an oscillation from 10 Hz up that the hand does not make | attenuation |
//! | 4 passivity | the hand has received more energy than it has put in | damping of the motion |
//! | 5 slew | the wrench changes faster than the limit (N/s, N·m/s) | a part of the change |
//! | 6 saturation | the wrench is beyond the device's peak | shorter, same direction |
//! | 7 heat | the wrench was above the continuous rating for too long | shorter, same direction |
//! | 8 start-up | the user has not enabled forces, or the ramp is not over | zero, or a part |
//! | 9 watchdog | the loop is late or has stalled | zero; a fault |
//!
//! A fault removes the wrench in the tick in which it is detected. Then the chain only damps the
//! grip, with at most a tenth of the peak. The damping acts against the part of the reported
//! velocity that agrees with the poses. The chain does not damp while the motion itself is
//! implausible. The force returns only through a start-up ([`Phase`]); after three faults in
//! ten seconds the user must also press a button or key.
//!
//! The commanded wrench never changes by more than the slew limit from one message to the next. So
//! the peak falls to zero within 2 ms after a fault.
//!
//! If the settings of the engine change, the wrench fades from the old to the new value within a
//! quarter of a second.
//!
//! While a device withholds its force ([`DeviceState::withheld`]), the commanded wrench falls to
//! zero. The wrench then returns from zero within 50 ms; after a long time the device must be
//! engaged again.
//!
//! A wrench that no stage has to change is returned bit for bit.
//!
//! **Inputs of the stages.** Stages 2 and 9 need the device and the clock ([`Gate`], [`Watch`]),
//! and report their findings to the chain ([`Cuts::INPUTS`]). All other stages
//! ([`SafetyChain::shape`]) depend only on the sequence of inputs, so a recording of states, cuts
//! and wrenches can be replayed bit for bit.
//!
//! The thresholds are in [`SafetyLimits`]; each is a formula over the device's description. After
//! construction nothing here allocates, waits or panics.

mod blend;
mod cuts;
mod energy;
mod gate;
mod heat;
mod latch;
mod limit_cycle;
mod limits;
mod motion;
mod options;
mod start_up;
mod watchdog;
mod withholding;

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus::render::{Limits, Saturation, saturate};

use crate::device::DeviceState;
use blend::Blend;
use heat::Heat;
use limit_cycle::LimitCycle;
use motion::Motion;
use start_up::{Event, Machine};
use withholding::Withholding;

pub use cuts::{Cut, Cuts, SafetyCounters};
pub use energy::{ContactAccount, EnergyAccount};
pub use gate::{Admitted, Gate};
pub use limits::{LimitLine, SafetyLimits};
pub use options::{AfterPanic, SafetyOptions};
pub use start_up::{AfterFault, DEVICE_BUTTONS, EnableMode, HOLD_KEY, Phase, REARM_KEY, Rearm};
pub use watchdog::Watch;
pub(crate) use watchdog::watch_until_over;

/// Relative rounding allowance on the slew limit.
const SLEW_ROUNDING: f64 = 1e-9;

/// Output of the safety chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaped {
    /// The wrench for the device.
    pub wrench: Wrench,
    /// Interventions of the chain, including the cuts that were reported to it.
    pub cuts: Cuts,
    /// Phase of the start-up.
    pub phase: Phase,
    /// Thermal limits of the motors in the next tick; infinite if heat does not limit the wrench.
    /// The coupling uses these limits for the next wrench.
    pub available: Limits,
}

/// Stages 3 to 8, and the reaction to the findings of all stages; see the module's description.
pub struct SafetyChain {
    limits: SafetyLimits,
    saturation: Saturation,
    after_fault: AfterFault,
    after_panic: AfterPanic,
    period: f64,
    /// Time since the last tick, s.
    elapsed: f64,
    machine: Machine,
    motion: Motion,
    blend: Blend,
    /// Fraction of the wrench that remains while the wrench fades out at the end.
    fade: f64,
    withholding: Withholding,
    heat_force: Heat,
    heat_torque: Heat,
    limit_cycle: LimitCycle,
    passivity: EnergyAccount,
    /// The last wrench after stages 3 to 7, from which the next slew is measured.
    shaped: Wrench,
    commanded: Wrench,
}

impl SafetyChain {
    /// Returns a chain for a loop with the nominal `period` (s).
    pub fn new(limits: &SafetyLimits, enable_mode: EnableMode, options: &SafetyOptions, period: f64) -> Self {
        // A device without torque should not report a saturation in every tick.
        let saturation = if limits.torque_peak > 0.0 { Saturation::Separate } else { Saturation::UnderActuated };
        Self {
            limits: *limits,
            saturation,
            after_fault: options.after_fault,
            after_panic: options.after_panic,
            period,
            elapsed: period,
            machine: Machine::new(enable_mode, limits.ramp, limits.hold, options.rearm),
            motion: Motion::default(),
            blend: Blend::new(),
            fade: 1.0,
            withholding: Withholding::new(limits.hold),
            heat_force: Heat::new(limits.force_peak, limits.force_continuous, limits.heating_time),
            heat_torque: Heat::new(limits.torque_peak, limits.torque_continuous, limits.heating_time),
            limit_cycle: LimitCycle::new(limits, period),
            passivity: EnergyAccount::new(limits, period),
            shaped: Wrench::ZERO,
            commanded: Wrench::ZERO,
        }
    }

    /// Returns the thresholds.
    pub fn limits(&self) -> &SafetyLimits {
        &self.limits
    }

    /// Returns the phase of the start-up.
    pub fn phase(&self) -> Phase {
        self.machine.phase()
    }

    /// Returns the fraction of the allowed heat that is used: the larger fraction of force and
    /// torque.
    pub fn heat(&self) -> f64 {
        self.heat_force.used().max(self.heat_torque.used())
    }

    /// Adds the work that moving bodies and other tools did on this tool in this tick, J, by
    /// translation and rotation ([`EnergyAccount::received`]). Call this function before
    /// [`Self::shape`].
    pub fn receive(&mut self, work: [f64; 2]) {
        if self.machine.phase().is_on() {
            self.passivity.received(work);
        }
    }

    /// Returns the wrench for the device in place of `computed`, for a grip in `state`. `reported`
    /// contains the cuts that the gate, the clock and the step have reported. `elapsed` is the time
    /// since the last call, for which the last wrench was held, s; energy, heat and slew depend on
    /// it.
    pub fn shape(&mut self, state: &DeviceState, computed: &Wrench, reported: Cuts, elapsed: f64) -> Shaped {
        self.elapsed = if elapsed >= 0.0 && elapsed.is_finite() { elapsed } else { self.period };
        self.heat_force.spend(self.commanded.force.length(), self.elapsed);
        self.heat_torque.spend(self.commanded.torque.length(), self.elapsed);
        let mut cuts = reported;
        // Stage 1.
        cuts.note(Cut::NonFiniteWrench, !computed.is_finite());
        let mut wrench = if cuts.has(Cut::NonFiniteWrench) { Wrench::ZERO } else { *computed };
        // Stages 2 and 9: faults from any source.
        let withheld = cuts.has(Cut::Withheld);
        self.withholding.advance(withheld, self.step());
        self.machine.advance(&Event {
            buttons: state.buttons,
            small: self.is_small(&wrench),
            fault: self.fault(cuts),
            paused: cuts.has(Cut::Paused) || self.withholding.is_long(),
            dt: self.step(),
        });
        let phase = self.machine.phase();
        self.motion.follow(&state.pose, self.elapsed.max(self.period), !cuts.and(Cuts::BLIND).is_none());
        if withheld {
            self.rest(&Wrench::ZERO);
            wrench = Wrench::ZERO;
        } else if phase.is_on() {
            wrench = self.blended(&wrench, cuts);
            wrench = self.attenuated(&wrench, state, &mut cuts);
            wrench = self.passive(&wrench, state, &mut cuts);
            wrench = self.slewed(&wrench, &mut cuts);
            wrench = self.saturated(&wrench, &mut cuts);
            wrench = self.cooled(&wrench, &mut cuts);
            wrench = self.returning(&wrench, &mut cuts);
            self.shaped = wrench;
            wrench = self.engaged(&wrench, &mut cuts);
        } else {
            cuts.note(Cut::StartUp, !phase.is_faulted() && wrench != Wrench::ZERO);
            self.rest(&wrench);
            wrench = if phase.is_faulted() { self.damping(state, cuts) } else { Wrench::ZERO };
        }
        // The slew limit holds for every message, since a step of the force is felt as a blow. The
        // peak falls to zero in 2 ms.
        let dt = if phase.is_on() && !withheld { self.step() } else { self.period };
        let (within, cut) = self.towards(&self.commanded, &wrench, dt);
        cuts.note(Cut::Slew, cut && phase.is_on() && !withheld);
        wrench = within;
        self.commanded = wrench;
        self.limit_cycle.commanded(&wrench);
        if phase.is_on() {
            self.passivity.commanded(&wrench);
        }
        Shaped { wrench, cuts, phase, available: self.heat_caps() }
    }

    /// Returns the wrench for the next write at the end of a run: one step of the slew limit closer
    /// to zero; `None` if the next wrench may be zero.
    pub fn release(&mut self) -> Option<Wrench> {
        let (wrench, cut) = self.towards(&self.commanded, &Wrench::ZERO, self.period);
        self.commanded = wrench;
        cut.then_some(wrench)
    }

    fn fault(&self, cuts: Cuts) -> Option<AfterFault> {
        if !cuts.is_fault() {
            return None;
        }
        let panicked = cuts.has(Cut::Panic) && self.after_panic == AfterPanic::Stop;
        Some(if panicked { AfterFault::Stop } else { self.after_fault })
    }

    fn is_small(&self, wrench: &Wrench) -> bool {
        let torque_felt = self.limits.torque_peak > 0.0;
        wrench.force.length() <= self.limits.engage_force
            && (!torque_felt || wrench.torque.length() <= self.limits.engage_torque)
    }

    /// Before stage 3: removes the step at a change of settings. Otherwise returns the wrench
    /// unchanged, bit for bit.
    fn blended(&mut self, wrench: &Wrench, cuts: Cuts) -> Wrench {
        let changed = cuts.has(Cut::Settings);
        let within = self.within_peak(wrench);
        let under_way = self.blend.is_under_way(changed);
        let blended = if under_way { self.blend.apply(&within, changed) } else { within };
        self.blend.end_of_tick(&blended, self.step());
        if under_way { blended } else { *wrench }
    }

    /// Stage 3. The wrench is limited to the peak first, since the hand feels nothing beyond it.
    fn attenuated(&mut self, wrench: &Wrench, state: &DeviceState, cuts: &mut Cuts) -> Wrench {
        let (attenuated, cut) = self.limit_cycle.attenuate(&self.within_peak(wrench), &state.pose, self.elapsed);
        cuts.note(Cut::LimitCycle, cut);
        if cut { attenuated } else { *wrench }
    }

    /// Stage 4. The wrench is limited to the peak first, as in stage 3.
    fn passive(&mut self, wrench: &Wrench, state: &DeviceState, cuts: &mut Cuts) -> Wrench {
        let within = self.within_peak(wrench);
        let onset = self.passivity.ramp(self.machine.gain());
        // A held load must not be reduced because the grip rests on the border of an encoder step.
        let twist = if onset { self.motion.confirmed(&state.twist) } else { state.twist };
        let limited = self.passivity.limit(&within, &DeviceState { twist, ..*state }, self.elapsed);
        if limited == within {
            return *wrench;
        }
        cuts.note(if onset { Cut::StartUp } else { Cut::Passivity }, true);
        cuts.note(Cut::NonFiniteWrench, !limited.is_finite());
        if limited.is_finite() { limited } else { Wrench::ZERO }
    }

    /// Stage 5. The slew is not reported as a cut if the next two stages give the same result with
    /// and without it.
    fn slewed(&self, wrench: &Wrench, cuts: &mut Cuts) -> Wrench {
        let (within, cut) = self.towards(&self.shaped, wrench, self.step());
        if !cut {
            return *wrench;
        }
        let (reached, meant) = (self.within_caps(&within), self.within_caps(wrench));
        let is_near = |a: DVec3, b: DVec3, size: f64| a.distance(b) <= SLEW_ROUNDING * size;
        let arrived = is_near(reached.force, meant.force, self.limits.force_peak)
            && is_near(reached.torque, meant.torque, self.limits.torque_peak);
        cuts.note(Cut::Slew, !arrived);
        within
    }

    /// Stage 6: limits the wrench to the peak.
    fn saturated(&self, wrench: &Wrench, cuts: &mut Cuts) -> Wrench {
        let peak = Limits { force: self.limits.force_peak, torque: self.limits.torque_peak };
        let answer = saturate(*wrench, &peak, self.saturation);
        cuts.note(Cut::Saturation, answer.force_cut || answer.torque_cut);
        answer.wrench
    }

    /// Stage 7: limits the wrench to what the motors can give at their heat.
    fn cooled(&self, wrench: &Wrench, cuts: &mut Cuts) -> Wrench {
        let answer = saturate(*wrench, &self.heat_caps(), Saturation::Separate);
        cuts.note(Cut::Heat, answer.force_cut || answer.torque_cut);
        answer.wrench
    }

    /// Limits a wrench that returns after the device has withheld its force.
    fn returning(&self, wrench: &Wrench, cuts: &mut Cuts) -> Wrench {
        let Some(share) = self.withholding.share() else { return *wrench };
        let most = Limits { force: self.limits.force_peak * share, torque: self.limits.torque_peak * share };
        let answer = saturate(*wrench, &most, Saturation::Separate);
        cuts.note(Cut::Slew, answer.force_cut || answer.torque_cut);
        answer.wrench
    }

    /// Stage 8: gives the part of the wrench that the start-up allows.
    fn engaged(&mut self, wrench: &Wrench, cuts: &mut Cuts) -> Wrench {
        if cuts.has(Cut::Ending) {
            let ramp = self.limits.ramp;
            self.fade = if ramp > 0.0 { (self.fade - self.step() / ramp).max(0.0) } else { 0.0 };
        }
        let is_engaged = self.machine.phase() == Phase::Engaged;
        if is_engaged && self.fade >= 1.0 {
            return *wrench;
        }
        cuts.note(Cut::StartUp, !is_engaged && *wrench != Wrench::ZERO);
        let gain = self.machine.gain() * self.fade;
        Wrench { torque: wrench.torque * gain, force: wrench.force * gain }
    }

    /// While the device is not engaged, passes the computed wrench to the stages as their start
    /// value.
    fn rest(&mut self, wrench: &Wrench) {
        self.shaped = self.within_peak(wrench);
        self.blend.reset(&self.shaped);
        self.limit_cycle.reset();
        self.passivity.reset();
    }

    /// Returns the damping that remains after a fault.
    fn damping(&self, state: &DeviceState, cuts: Cuts) -> Wrench {
        if !cuts.and(Cuts::BLIND).is_none() {
            return Wrench::ZERO;
        }
        let SafetyLimits { damping, angular_damping, rest_force, rest_torque, .. } = self.limits;
        let twist = self.motion.confirmed(&state.twist);
        let against = Wrench { torque: twist.angular * -angular_damping, force: twist.linear * -damping };
        saturate(against, &Limits { force: rest_force, torque: rest_torque }, Saturation::Separate).wrench
    }

    fn within_peak(&self, wrench: &Wrench) -> Wrench {
        let peak = Limits { force: self.limits.force_peak, torque: self.limits.torque_peak };
        saturate(*wrench, &peak, self.saturation).wrench
    }

    fn heat_caps(&self) -> Limits {
        Limits { force: self.heat_force.cap(), torque: self.heat_torque.cap() }
    }

    fn within_caps(&self, wrench: &Wrench) -> Wrench {
        saturate(self.within_peak(wrench), &self.heat_caps(), Saturation::Separate).wrench
    }

    /// Returns the time for ramps and slew, s: the elapsed time, but at most one period. So two
    /// successive writes never differ by more than the slew limit of one period, however late the
    /// second write is.
    fn step(&self) -> f64 {
        self.elapsed.min(self.period)
    }

    /// Moves the wrench `from` towards `to`, as far as the slew limit allows in `dt` s. The flag is
    /// true if the end was not reached.
    fn towards(&self, from: &Wrench, to: &Wrench, dt: f64) -> (Wrench, bool) {
        let (force, force_cut) = step_towards(from.force, to.force, self.limits.force_slew * dt);
        let (torque, torque_cut) = step_towards(from.torque, to.torque, self.limits.torque_slew * dt);
        (Wrench { torque, force }, force_cut || torque_cut)
    }
}

/// Moves from `from` towards `to`, by at most `most`. The flag is true if the end was not reached.
fn step_towards(from: DVec3, to: DVec3, most: f64) -> (DVec3, bool) {
    let way = to - from;
    // Scales first, since squares and differences of finite numbers may overflow.
    let largest = way.abs().max_element();
    if largest <= 0.0 {
        return (to, false);
    }
    if !largest.is_finite() {
        return (from, true);
    }
    let scaled = way / largest;
    let length = scaled.length();
    if length * largest <= most * (1.0 + SLEW_ROUNDING) {
        return (to, false);
    }
    (from + scaled * (most / length), true)
}

#[cfg(test)]
mod tests;
