//! The conformance tester: it plays the part of palpus towards a driver and judges the driver's
//! answers.
//!
//! Every check uses the driver's frames, their sequence numbers and the driver's clock. So on a
//! busy machine the tester is slow but its results stay correct. Only silence is judged by the wall
//! clock. The tester commands at most a tenth of the device's peak force, and at most 0.5 N.

mod hostile;
mod peer;

use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Wrench;

use super::frame::{Body, Command, READY, State, WITHHELD};
use super::session::new_nonce;
use super::{BridgeAddress, BridgeError, SLOWEST};
use hostile::Hostile;
use peer::{Numbered, Peer};

/// Result for one rule of the specification.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// The tested rule.
    pub name: &'static str,
    /// `Ok` with the observed behaviour, or `Err` with what to change in the driver.
    pub outcome: Result<String, String>,
}

/// Largest commanded force, N.
const PUSH: f64 = 0.5;
/// Largest commanded force, as a fraction of the peak force.
const PUSH_SHARE: f64 = 0.1;
/// Allowed difference between the commanded and the applied force, N: a driver may report a rounded
/// or measured force.
const FORCE_SLACK: f64 = 0.05;
/// Below this force (N) and torque (N·m), the device counts as applying nothing.
const REST: (f64, f64) = (0.02, 1e-3);
/// Result for a device without motors.
const NO_FORCE: &str = "not tested: the device gives no force, or hardly any";
/// Number of states over which the rate is measured.
const RATE_STATES: u64 = 500;
/// Allowed relative error of the stated rate.
const RATE_SLACK: f64 = 0.2;
/// Time for which the wrenches of the tester are valid, µs.
const VALID_FOR_US: u32 = 20_000;
/// Number of states within which a driver must have accepted a command. The number covers the
/// states in transit and a tenth of a second at 1 kHz, since the tester itself may be late.
const PATIENCE_STATES: u64 = 100;
/// Number of hostile frames, on which no driver may act.
const HOSTILE_FRAMES: usize = 20_000;
/// Number of hostile frames between two states.
const HOSTILE_AT_ONCE: usize = 20;

/// Tests the driver at `address`, in about five seconds. The device gets at most 0.5 N for some
/// tenths of a second.
///
/// # Errors
/// Fails if no driver listens at `address`. A defect of the driver is not an error but a failed
/// [`Check`].
pub fn conformance(address: &BridgeAddress) -> Result<Vec<Check>, BridgeError> {
    let mut report = Report::default();
    let opened = Peer::open(address);
    let mut peer = match opened {
        Ok(peer) => peer,
        Err(error @ BridgeError::NoDriver { .. }) => return Err(error),
        Err(error) => {
            report.add("answers a hello with a welcome", Err(error.to_string()));
            return Ok(report.checks);
        }
    };
    report.add("answers a hello with a welcome", Ok(peer.description()));
    // The steps run in this order, since later steps need the results of earlier steps.
    let steps: [Step; 9] = [
        ("describes a device that can be used", usable),
        ("sends nothing before the first command", quiet_before),
        ("numbers states from 1, at the stated rate, by a clock that runs", rate),
        ("echoes commands and is ready", echoes),
        ("applies a valid wrench and says so", applies),
        ("goes to zero when the wrench is no longer valid", expires),
        ("applies no wrench that is based on a state before the last zero", stays_at_zero),
        ("applies no wrench that is older than its validity", refuses_stale),
        ("ignores damaged, old and foreign frames", ignores_hostile),
    ];
    for (name, step) in steps {
        let outcome = step(&mut peer);
        let failed = outcome.is_err();
        report.add(name, outcome);
        if failed && peer.is_gone() {
            return Ok(report.checks);
        }
    }
    report.add("ends a closed session and begins a new one", reopens(peer, address));
    Ok(report.checks)
}

type Step = (&'static str, fn(&mut Peer) -> Result<String, String>);

#[derive(Default)]
struct Report {
    checks: Vec<Check>,
}

impl Report {
    fn add(&mut self, name: &'static str, outcome: Result<String, String>) {
        self.checks.push(Check { name, outcome });
    }
}

/// Returns the force that the tester commands; `None` if the device gives no force.
fn push(peer: &Peer) -> Option<Wrench> {
    let force = PUSH.min(PUSH_SHARE * peer.welcome.spec.force_max);
    (force > 2.0 * REST.0).then_some(Wrench { force: DVec3::Z * force, torque: DVec3::ZERO })
}

fn is_pushing(state: &State) -> bool {
    state.applied.force.length() > REST.0 || state.applied.torque.length() > REST.1
}

fn applies_all_of(state: &State, wrench: Wrench) -> bool {
    is_pushing(state) && state.applied.force.distance(wrench.force) <= FORCE_SLACK
}

fn usable(peer: &mut Peer) -> Result<String, String> {
    let rate = peer.welcome.rate_hz;
    if rate < SLOWEST {
        return Err(format!("`rate_hz` is {rate}; send at least {SLOWEST} states a second"));
    }
    Ok(format!("{rate} states a second"))
}

fn quiet_before(peer: &mut Peer) -> Result<String, String> {
    match peer.state_within(Duration::from_millis(100))? {
        None => Ok("no state in 100 ms".to_owned()),
        Some(_) => Err("send states only after a command with the session's nonce has arrived".to_owned()),
    }
}

fn rate(peer: &mut Peer) -> Result<String, String> {
    let first = peer.begin()?;
    let mut last = first;
    while last.sequence < first.sequence + RATE_STATES {
        let next = peer.next_state()?;
        if next.sequence != last.sequence + 1 {
            let (from, to) = (last.sequence, next.sequence);
            return Err(format!("state {from} was followed by {to}: increase the sequence by one with each state"));
        }
        if next.state.time_ns <= last.state.time_ns {
            return Err(format!("`time_ns` does not increase from state {} to the next", last.sequence));
        }
        peer.answer(&next, Wrench::ZERO, VALID_FOR_US)?;
        last = next;
    }
    if first.sequence != 1 {
        return Err(format!("the first state has the sequence {}; count from 1 in each session", first.sequence));
    }
    let seconds = (last.state.time_ns - first.state.time_ns) as f64 * 1e-9;
    let (measured, stated) = (RATE_STATES as f64 / seconds, peer.welcome.rate_hz);
    if (measured / stated - 1.0).abs() > RATE_SLACK {
        return Err(format!("{measured:.0} states a second by `time_ns`, but `rate_hz` is {stated}"));
    }
    Ok(format!("{measured:.0} states a second"))
}

fn echoes(peer: &mut Peer) -> Result<String, String> {
    let sent = peer.tell(Command::default())?;
    let state = peer.state_where(|state| state.echo >= sent)?;
    match state {
        None => Err("`echo` must be the sequence of the newest command that was accepted".to_owned()),
        Some(state) if state.state.echo > sent => Err("`echo` names a command that was not sent".to_owned()),
        Some(state) if state.state.flags & READY == 0 => {
            Err("the READY flag is not set; switch the device on, calibrate it, and test again".to_owned())
        }
        Some(_) => Ok("ready".to_owned()),
    }
}

fn applies(peer: &mut Peer) -> Result<String, String> {
    let Some(wrench) = push(peer) else { return Ok(NO_FORCE.to_owned()) };
    let mut newest = peer.newest()?;
    let sent = peer.answer(&newest, wrench, VALID_FOR_US)?;
    for _ in 0..PATIENCE_STATES {
        newest = peer.next_state()?;
        if newest.state.echo >= sent && applies_all_of(&newest.state, wrench) {
            return Ok(format!("{:.2} N along +Z", newest.state.applied.force.z));
        }
        peer.answer(&newest, wrench, VALID_FOR_US)?;
    }
    Err(format!(
        "{:.2} N along +Z were commanded for {PATIENCE_STATES} states, but the applied force is {} N",
        wrench.force.z, newest.state.applied.force
    ))
}

/// Lets a wrench expire, and checks each state by the device's clock.
fn expires(peer: &mut Peer) -> Result<String, String> {
    let Some(wrench) = push(peer) else { return Ok(NO_FORCE.to_owned()) };
    let (knows, sent) = hold(peer, wrench)?;
    // After the expiry, the driver may take one period to react and one more to send a state.
    let periods = Duration::from_secs_f64(2.0 / peer.welcome.rate_hz).as_nanos() as u64;
    let end = knows.state.time_ns + u64::from(VALID_FOR_US) * 1000 + periods;
    loop {
        let state = peer.next_state()?;
        if state.state.time_ns <= end {
            continue;
        }
        if is_pushing(&state.state) {
            let late = (state.state.time_ns - end) / 1000;
            return Err(format!(
                "{late} µs after `time_ns + valid_for_us` of command {sent} the applied wrench is not zero"
            ));
        }
        if state.state.flags & WITHHELD == 0 {
            return Err("the wrench is zero, but the WITHHELD flag is missing; set it until a command has echoed a state with it".to_owned());
        }
        return Ok(format!("after {} ms", VALID_FOR_US / 1000));
    }
}

/// Checks that after an expiry, a force based on an older state is not applied.
fn stays_at_zero(peer: &mut Peer) -> Result<String, String> {
    let Some(wrench) = push(peer) else { return Ok(NO_FORCE.to_owned()) };
    let (knows, _) = hold(peer, wrench)?;
    let expired = peer
        .state_where(|state| state.flags & WITHHELD != 0)?
        .ok_or("the WITHHELD flag is not set when a wrench is no longer valid")?;
    // This command echoes an old state but has the newest time.
    let sent = peer.tell(Command {
        echo: knows.sequence,
        time_ns: expired.state.time_ns,
        wrench,
        valid_for_us: VALID_FOR_US,
    })?;
    never_pushes(peer, sent, "its `echo` is a state before the wrench expired: stay at zero")?;
    resume(peer)
}

fn refuses_stale(peer: &mut Peer) -> Result<String, String> {
    let Some(wrench) = push(peer) else { return Ok(NO_FORCE.to_owned()) };
    let old = peer.newest()?;
    let age = u64::from(VALID_FOR_US) * 1000;
    let newest = peer
        .state_where(|state| state.time_ns > old.state.time_ns + 2 * age)?
        .ok_or("the driver sends no further states")?;
    let sent =
        peer.tell(Command { echo: newest.sequence, time_ns: old.state.time_ns, wrench, valid_for_us: VALID_FOR_US })?;
    never_pushes(peer, sent, "its `time_ns + valid_for_us` had passed when it arrived: stay at zero")?;
    resume(peer)
}

fn ignores_hostile(peer: &mut Peer) -> Result<String, String> {
    let wrench = push(peer).unwrap_or_default();
    let mut hostile = Hostile::new(peer.session(), wrench);
    let mut newest = peer.newest()?;
    let mut sent = peer.answer(&newest, Wrench::ZERO, VALID_FOR_US)?;
    for k in 0..HOSTILE_FRAMES {
        peer.send_bytes(hostile.next(&newest, sent))?;
        if k % HOSTILE_AT_ONCE != 0 {
            continue;
        }
        newest = peer.next_state()?;
        if is_pushing(&newest.state) {
            return Err(format!("a force was applied after {}", hostile.last()));
        }
        if newest.state.echo > sent {
            return Err(format!("`echo` became {} after {}", newest.state.echo, hostile.last()));
        }
        sent = peer.answer(&newest, Wrench::ZERO, VALID_FOR_US)?;
    }
    // If the tester was late, it echoed an old state, and its command may have expired in transit.
    for _ in 0..PATIENCE_STATES {
        let newest = peer.newest()?;
        peer.answer(&newest, Wrench::ZERO, VALID_FOR_US)?;
        if peer.next_state()?.state.echo >= sent {
            return Ok(format!("{HOSTILE_FRAMES} frames"));
        }
    }
    Err(format!("no command was accepted after {}", hostile.last()))
}

fn reopens(mut peer: Peer, address: &BridgeAddress) -> Result<String, String> {
    let before = peer.session();
    peer.tell(Command::default())?;
    let _ = peer.send_body(Body::Close("the conformance tester ends the session".into()));
    if !peer.falls_silent() {
        return Err("the driver sent states after a close frame".to_owned());
    }
    drop(peer);
    let mut again = Peer::open(address).map_err(|error| format!("a second session: {error}"))?;
    if again.session() == before {
        return Err("the second session has the same nonce as the first; choose a new random nonce".to_owned());
    }
    let state = again.begin()?;
    let old = again.foreign_command(before, &state, push(&again).unwrap_or_default())?;
    never_pushes(&mut again, old, "the command belongs to the previous session")?;
    let _ = again.send_body(Body::Close("the conformance tester has finished".into()));
    Ok("the second session has another nonce".to_owned())
}

/// Makes the driver apply `wrench`. Returns the state that the last command echoed, and the
/// command's sequence.
fn hold(peer: &mut Peer, wrench: Wrench) -> Result<(Numbered, u64), String> {
    for _ in 0..PATIENCE_STATES {
        let newest = peer.newest()?;
        let sent = peer.answer(&newest, wrench, VALID_FOR_US)?;
        let state = peer.next_state()?;
        if applies_all_of(&state.state, wrench) {
            return Ok((newest, sent));
        }
    }
    Err("a valid wrench was not applied, so its end cannot be seen".to_owned())
}

/// Fails with `why` if the device applies a wrench in any state up to the echo of command `sent`,
/// or in the 20 states after it.
fn never_pushes(peer: &mut Peer, sent: u64, why: &str) -> Result<(), String> {
    let mut after = 0;
    for _ in 0..PATIENCE_STATES + 20 {
        let state = peer.next_state()?.state;
        if is_pushing(&state) {
            return Err(format!("a wrench was applied although {why}"));
        }
        after += u32::from(state.echo >= sent);
        if after > 20 {
            break;
        }
    }
    Ok(())
}

/// Sends zero commands until the driver is ready to apply a wrench again.
fn resume(peer: &mut Peer) -> Result<String, String> {
    for _ in 0..PATIENCE_STATES {
        let newest = peer.newest()?;
        peer.answer(&newest, Wrench::ZERO, VALID_FOR_US)?;
        if peer.next_state()?.state.flags == READY {
            return Ok("stays at zero".to_owned());
        }
    }
    Err("the driver stays at zero, but keeps the WITHHELD flag after a command has echoed a state with it".to_owned())
}

/// Returns a nonce that differs from `other`.
fn nonce_but(other: u64) -> u64 {
    match new_nonce() {
        nonce if nonce == other => nonce.wrapping_add(1),
        nonce => nonce,
    }
}
