//! The tester's end of a session: it sends and receives single frames in the role of palpus.

use std::time::{Duration, Instant};

use palpus::algebra::Wrench;

use crate::bridge::frame::{self, Body, Command, Frame, LONGEST, State, Welcome};
use crate::bridge::listener::gone;
use crate::bridge::session::{BUFFER, Session};
use crate::bridge::socket::Received;
use crate::bridge::{BridgeAddress, BridgeError, USUAL_RATE};

/// If no state arrives for this time, the driver counts as stopped.
const SILENCE: Duration = Duration::from_millis(500);
/// Longest time for which a state can be in transit.
const SOON: Duration = Duration::from_millis(150);
/// Time (s) and number of states within which an expected reaction must occur.
const MOST_TIME: f64 = 0.2;
const MOST_STATES: u64 = 200;

/// A state and its sequence number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbered {
    pub(super) sequence: u64,
    pub(super) state: State,
}

pub(super) struct Peer {
    session: Session,
    address: BridgeAddress,
    pub(super) welcome: Welcome,
    /// True if the driver no longer answers.
    gone: bool,
}

impl Peer {
    pub(super) fn open(address: &BridgeAddress) -> Result<Self, BridgeError> {
        let (session, welcome) = Session::open(address, USUAL_RATE)?;
        Ok(Self { session, address: address.clone(), welcome, gone: false })
    }

    pub(super) fn description(&self) -> String {
        let spec = &self.welcome.spec;
        format!("{}, {} N, {} N·m", spec.name, spec.force_max, spec.torque_max)
    }

    pub(super) fn session(&self) -> u64 {
        self.session.nonce
    }

    pub(super) fn is_gone(&self) -> bool {
        self.gone
    }

    /// Begins the session and returns the first state.
    pub(super) fn begin(&mut self) -> Result<Numbered, String> {
        let (sequence, state) = self.session.begin(&self.address).map_err(|error| {
            self.gone = true;
            error.to_string()
        })?;
        Ok(Numbered { sequence, state })
    }

    /// Waits at most `patience` for the next state; `None` if none arrives. Fails if a frame does
    /// not follow the specification.
    pub(super) fn state_within(&mut self, patience: Duration) -> Result<Option<Numbered>, String> {
        let (begun, mut buffer) = (Instant::now(), BUFFER);
        while begun.elapsed() < patience {
            let heard = self.session.socket.receive(&mut buffer).map_err(|error| self.lost(gone(&error)))?;
            let Received::Frame(length) = heard else { continue };
            match frame::decode(&buffer[..length]) {
                Ok(Frame { nonce, sequence, body: Body::State(state) }) if nonce == self.session.nonce => {
                    return Ok(Some(Numbered { sequence, state }));
                }
                // A driver answers each hello, so a second welcome may arrive.
                Ok(Frame { body: Body::Welcome(_), .. }) => {}
                Ok(Frame { body: Body::Close(reason), .. }) => {
                    return Err(self.lost(format!("the driver ends the session: {reason}")));
                }
                Ok(_) => {
                    return Err("it sends a frame with another nonce, or a frame that only palpus may send".to_owned());
                }
                Err(refusal) => return Err(format!("it sends an invalid frame: {refusal}")),
            }
        }
        Ok(None)
    }

    pub(super) fn next_state(&mut self) -> Result<Numbered, String> {
        let state = self.state_within(SILENCE)?;
        state.ok_or_else(|| self.lost(format!("no state in {} ms", SILENCE.as_millis())))
    }

    /// Reads the waiting states and returns the newest state.
    pub(super) fn newest(&mut self) -> Result<Numbered, String> {
        let mut newest = self.next_state()?;
        // The number of reads is bounded, since the driver keeps sending.
        for _ in 0..self.most_states() {
            let begun = Instant::now();
            newest = self.next_state()?;
            if begun.elapsed() > Duration::from_micros(100) {
                break;
            }
        }
        Ok(newest)
    }

    /// Returns the first of the next states for which `what` is true; `None` if no state matches.
    pub(super) fn state_where(&mut self, what: impl Fn(&State) -> bool) -> Result<Option<Numbered>, String> {
        for _ in 0..self.most_states() {
            let next = self.next_state()?;
            if what(&next.state) {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    fn most_states(&self) -> u64 {
        MOST_STATES.max((MOST_TIME * self.welcome.rate_hz) as u64)
    }

    /// Sends a command and returns its sequence.
    pub(super) fn tell(&mut self, command: Command) -> Result<u64, String> {
        self.send_body(Body::Command(command))
    }

    /// Sends a command that is based on `state`, and returns its sequence.
    pub(super) fn answer(&mut self, state: &Numbered, wrench: Wrench, valid_for_us: u32) -> Result<u64, String> {
        self.tell(Command { echo: state.sequence, time_ns: state.state.time_ns, wrench, valid_for_us })
    }

    /// Sends a command with the nonce of another session, then a command of this session without a
    /// wrench. Returns the sequence of the second command.
    pub(super) fn foreign_command(&mut self, nonce: u64, knows: &Numbered, wrench: Wrench) -> Result<u64, String> {
        let command =
            Command { echo: knows.sequence, time_ns: knows.state.time_ns, wrench, valid_for_us: super::VALID_FOR_US };
        let frame = Frame { nonce, sequence: self.session.next() + 1000, body: Body::Command(command) };
        self.send_bytes(frame::encode(&frame, &mut [0; LONGEST]))?;
        self.tell(Command::default())
    }

    pub(super) fn send_body(&mut self, body: Body) -> Result<u64, String> {
        let sequence = self.session.next();
        self.session.send(sequence, body).map_err(|error| self.lost(gone(&error)))?;
        Ok(sequence)
    }

    /// Sends arbitrary bytes.
    pub(super) fn send_bytes(&mut self, bytes: &[u8]) -> Result<(), String> {
        // A full queue, or a datagram that is too large for the system, is not the driver's fault.
        self.session.socket.send(bytes).map(|_| ()).map_err(|error| self.lost(gone(&error)))
    }

    /// Returns true if the driver soon stops sending states, by the device's clock. States in
    /// transit are ignored. A driver that missed the close ends the session a quarter of a second
    /// after the last command.
    pub(super) fn falls_silent(&mut self) -> bool {
        let mut first = None;
        while let Ok(Some(Numbered { state, .. })) = self.state_within(SOON) {
            let first = *first.get_or_insert(state.time_ns);
            if state.time_ns.saturating_sub(first) > SOON.as_nanos() as u64 {
                return false;
            }
        }
        true
    }

    fn lost(&mut self, why: String) -> String {
        self.gone = true;
        why
    }
}
