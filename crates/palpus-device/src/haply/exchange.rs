//! The thread that exchanges messages with the service.
//!
//! In each turn the thread waits for a command of the loop, at most 5 ms. The thread discards
//! unrequested messages and sends the commanded force, or zero. Then the thread waits for the
//! state, at most 5 ms, and publishes it for the loop.
//!
//! States are numbered, and a command names the newest state on which its force is based. A force
//! is sent only if it is new, if no answer was lost after that state, and if that state is one of
//! the last three. Otherwise zero is sent.
//!
//! **Gaps.** If zero is sent in place of a force, the loop continues from a force that the hand
//! does not feel. So each such gap has a number, and the loop's next state is withheld. A
//! force that was computed before the loop read that state is not sent. Afterwards the loop starts
//! from zero.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::Shared;
use super::echo::{Echo, Given};
use super::message::Sample;
use super::opening::{MessageFormat, Opened};
use super::senses::Senses;
use super::wire::{Received, Wire};
use crate::device::{Brake, BrakeFlag, DeviceState};
use crate::latest::{Newest, Publisher};
use crate::realtime::{RealTimeOptions, claim};

/// Time limit for a state. A service on the same machine answers within a fraction of a
/// millisecond.
pub(super) const ANSWER_TIME: Duration = Duration::from_millis(5);
/// If the loop writes no command for this time, zero is sent.
pub(super) const IDLE_TIME: Duration = Duration::from_millis(5);
/// If no state arrives for this time, the device is lost.
const LOST_TIME: Duration = Duration::from_millis(250);
/// Largest number of states that are newer than the state on which a force is based.
const MOST_BEHIND: u64 = 2;
/// Largest number of unrequested messages between two turns. A correct service sends no such
/// messages.
const MOST_EXTRA: u64 = 64;

/// A state, with the number of states and the number of gaps so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) state: DeviceState,
    pub(super) index: u64,
    pub(super) gap: u64,
}

/// A command of the loop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Command {
    /// Number of the command, from 1; 0 before the first command.
    pub(super) serial: u64,
    /// Force, N.
    pub(super) force: DVec3,
    /// Number of the newest state on which the force is based.
    pub(super) knows: u64,
    /// Number of gaps that the loop has seen.
    pub(super) gap: u64,
}

impl Sensed {
    /// Makes the first state.
    pub(super) fn first(state: DeviceState) -> Self {
        Self { state, index: 1, gap: 0 }
    }
}

/// Result of waiting for a state.
enum Answer {
    State(Sample),
    Late,
    Bad(String),
}

/// The exchange thread's side of the device.
pub(super) struct Exchange {
    wire: Wire,
    talk: MessageFormat,
    senses: Senses,
    force_max: f64,
    states: Publisher<Sensed>,
    commands: Newest<Command>,
    shared: Arc<Shared>,
    brake: Arc<BrakeFlag>,
    /// The state that was published last.
    newest: Sensed,
    /// The force that was sent last, N.
    sent: DVec3,
    echo: Echo,
    /// A force must be based on a state with a larger number than this floor.
    floor: u64,
    /// Number of the last command that was handled.
    done: u64,
    last_good: Instant,
}

impl Exchange {
    pub(super) fn new(
        opened: Opened,
        states: Publisher<Sensed>,
        commands: Newest<Command>,
        shared: Arc<Shared>,
        brake: Arc<BrakeFlag>,
    ) -> Self {
        let Opened { spec, first, wire, talk, senses, .. } = opened;
        Self {
            wire,
            talk,
            senses,
            force_max: spec.force_max,
            states,
            commands,
            shared,
            brake,
            newest: Sensed::first(first),
            sent: DVec3::ZERO,
            echo: Echo::default(),
            floor: 0,
            done: 0,
            last_good: Instant::now(),
        }
    }

    /// Runs until the device is no longer needed, or is lost.
    pub(super) fn run(mut self, priority: Option<u8>) {
        if priority.is_some() {
            // If this priority is refused, the loop's priority was refused too, and its message
            // says how to fix it.
            claim(&RealTimeOptions { priority, lock_memory: false, pin: false });
        }
        // `Ended` also reports a panic of this thread.
        let shared = Arc::clone(&self.shared);
        let _ended = Ended(shared);
        let lost = loop {
            let force = self.next_force();
            if self.shared.over.load(Ordering::Acquire) {
                break None;
            }
            if let Err(why) = self.turn(force) {
                break Some(why);
            }
        };
        if let Some(why) = lost {
            let again =
                "palpus does not reconnect by itself, since the force would return unexpectedly: start the run again";
            let _ = self.shared.lost.set(Cow::Owned(format!("{why}; {again}")));
        }
        // If the service still reads, this message stops the force.
        let _ = self.wire.send(self.talk.force(DVec3::ZERO));
        self.wire.close();
    }

    /// Waits for a command of the loop, and returns the force that may be sent.
    fn next_force(&mut self) -> DVec3 {
        let until = Instant::now() + IDLE_TIME;
        loop {
            let command = *self.commands.get();
            if command.serial > self.done {
                self.done = command.serial;
                return self.admit(&command);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || self.shared.over.load(Ordering::Acquire) {
                self.add(|counts| &counts.idle, 1);
                if self.sent != DVec3::ZERO {
                    self.interrupt();
                }
                return DVec3::ZERO;
            }
            std::thread::park_timeout(left);
        }
    }

    fn admit(&mut self, command: &Command) -> DVec3 {
        let Sensed { state, index, gap } = self.newest;
        if command.force == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let informed = command.gap == gap;
        let current = command.knows > self.floor && command.knows + MOST_BEHIND >= index;
        let braked = self.brake.is_applied();
        if informed && current && !state.withheld && !braked && command.force.is_finite() {
            return command.force.clamp_length_max(self.force_max);
        }
        self.add(|counts| &counts.withheld, 1);
        // The loop already knows about its own brake and about older gaps.
        if informed && !braked {
            self.interrupt();
        }
        DVec3::ZERO
    }

    /// Informs the loop that zero is sent in place of its force.
    fn interrupt(&mut self) {
        self.newest.gap += 1;
        self.states.publish(self.newest);
    }

    /// Handles a lost answer: withholds the force until a newer state arrives.
    fn miss(&mut self) {
        self.floor = self.newest.index;
        self.newest.state.withheld = true;
        self.interrupt();
    }

    /// Sends the force and handles the answer.
    fn turn(&mut self, force: DVec3) -> Result<(), String> {
        self.drain()?;
        self.wire.send(self.talk.force(force)).map_err(closed)?;
        self.sent = force;
        self.echo.commanded(force);
        let mut trouble = "it does not answer".to_owned();
        let until = Instant::now() + ANSWER_TIME;
        match self.answer(until)? {
            Answer::State(sample) => {
                // The socket's timer is coarse, so a received message may still be late.
                if Instant::now() > until {
                    self.add(|counts| &counts.late, 1);
                    self.miss();
                }
                self.take(&sample);
            }
            Answer::Late => {
                self.add(|counts| &counts.late, 1);
                self.miss();
            }
            Answer::Bad(why) => {
                self.add(|counts| &counts.bad, 1);
                self.miss();
                trouble = why;
            }
        }
        if self.last_good.elapsed() > LOST_TIME {
            return Err(format!("the Inverse Service has given no state for {} ms: {trouble}", LOST_TIME.as_millis()));
        }
        let now = Instant::now();
        if self.echo.is_uncommanded(self.senses.time(now)) {
            return Err(
                "the Inverse Service reports a force although zero is commanded: close other programs that use the arm"
                    .to_owned(),
            );
        }
        if let Some(grip) = self.talk.grip.as_deref().filter(|_| self.senses.is_deaf(now)) {
            return Err(format!("the grip {grip} no longer reports its orientation: check that it is switched on"));
        }
        Ok(())
    }

    /// Discards unrequested messages: late answers, or errors of a service. If these messages were
    /// kept, all later states would be old.
    fn drain(&mut self) -> Result<(), String> {
        for _ in 0..MOST_EXTRA {
            if self.wire.hear(None).map_err(closed)? == Received::Nothing {
                return Ok(());
            }
            self.add(|counts| &counts.extra, 1);
        }
        Err(format!("the Inverse Service sends more than {MOST_EXTRA} unrequested messages"))
    }

    /// Returns the first message that arrives before `until`.
    fn answer(&mut self, until: Instant) -> Result<Answer, String> {
        Ok(match self.wire.hear(Some(until)).map_err(closed)? {
            Received::Text(text) => self.talk.sample(&text).map_or_else(Answer::Bad, Answer::State),
            Received::Other(what) => Answer::Bad(what.to_owned()),
            Received::Nothing => Answer::Late,
        })
    }

    fn take(&mut self, sample: &Sample) {
        let now = Instant::now();
        self.last_good = now;
        self.add(|counts| &counts.states, 1);
        let mut state = self.senses.state(sample, now);
        let time = self.senses.time(now);
        let given = sample.given.map(|given| self.echo.hear(given, time));
        if given.is_some_and(|given| given != Given::AsCommanded) {
            self.add(|counts| &counts.otherwise, 1);
        }
        state.withheld |= self.echo.withholds(time);
        self.newest = Sensed { state, index: self.newest.index + 1, ..self.newest };
        self.states.publish(self.newest);
    }

    fn add(&self, count: impl Fn(&super::Counts) -> &AtomicU64, more: u64) {
        count(&self.shared.counts).fetch_add(more, Ordering::Relaxed);
    }
}

fn closed(why: String) -> String {
    format!("the connection to the Inverse Service is lost: {why}")
}

/// Marks the device as lost when the exchange thread ends.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.lost.set(Cow::Borrowed("the thread that exchanges messages with the Inverse Service has ended"));
    }
}
