//! The thread that talks to the service.
//!
//! A turn: wait for a command of the loop, or for 5 ms; throw away what came unasked; send the
//! force, or zero; wait for the state, at most 5 ms, and leave it for the loop.
//!
//! States are counted, and a command says which was the newest state when its force was computed. A
//! force is sent if it is new, if no answer was lost after that state, and if that state is one of
//! the last three. Everything else is sent as zero.
//!
//! **Gaps.** If zero is sent in place of a force, the loop goes on from a force that the hand does
//! not feel. Each such gap therefore has a number, and the loop's next state is withheld. A force
//! computed before the loop read that state is not sent. After it, the loop starts from zero.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::Shared;
use super::echo::{Echo, Given};
use super::message::Sample;
use super::opening::{Opened, Talk};
use super::senses::Senses;
use super::wire::{Heard, Wire};
use crate::device::{Brake, BrakeFlag, DeviceState};
use crate::latest::{Newest, Publisher};
use crate::realtime::{RealTimeOptions, claim};

/// For a state: a service on the same machine answers within a fraction of a millisecond.
pub(super) const ANSWER_TIME: Duration = Duration::from_millis(5);
/// Without a command of the loop for this long, zero is sent.
pub(super) const IDLE_TIME: Duration = Duration::from_millis(5);
/// Without a state for this long, the device is lost.
const LOST_TIME: Duration = Duration::from_millis(250);
/// States that a force may not know yet.
const MOST_BEHIND: u64 = 2;
/// Most unrequested messages between two turns; a genuine service never sends more.
const MOST_EXTRA: u64 = 64;

/// A state, with the number of states and of gaps so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) state: DeviceState,
    pub(super) index: u64,
    pub(super) gap: u64,
}

/// Command of the loop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Command {
    /// 1, 2, 3, …; 0 before the first.
    pub(super) serial: u64,
    /// N.
    pub(super) force: DVec3,
    /// Index of the newest state that it knows.
    pub(super) knows: u64,
    /// Number of gaps that it knows of.
    pub(super) gap: u64,
}

impl Sensed {
    /// The first one.
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

/// The thread's side of the device.
pub(super) struct Exchange {
    wire: Wire,
    talk: Talk,
    senses: Senses,
    force_max: f64,
    states: Publisher<Sensed>,
    commands: Newest<Command>,
    shared: Arc<Shared>,
    brake: Arc<BrakeFlag>,
    /// As published last.
    newest: Sensed,
    /// N: as sent last.
    sent: DVec3,
    echo: Echo,
    /// Forces that know no newer state than this are not sent any more.
    floor: u64,
    /// Serial of the last command that was looked at.
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

    /// Until the device is not needed any more, or lost.
    pub(super) fn run(mut self, priority: Option<u8>) {
        if priority.is_some() {
            // If the priority is refused here, the loop's own was refused too, and its message
            // names the remedy.
            claim(&RealTimeOptions { priority, lock_memory: false, pin: false });
        }
        // Said also if this thread should panic.
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
                "palpus does not connect again by itself, since a force would come back unasked: start the run again";
            let _ = self.shared.lost.set(Cow::Owned(format!("{why}; {again}")));
        }
        // Tells a service that still listens to stop.
        let _ = self.wire.send(self.talk.force(DVec3::ZERO));
        self.wire.close();
    }

    /// Waits for the loop, and makes of what it wants what may be sent.
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
        let told = command.gap == gap;
        let current = command.knows > self.floor && command.knows + MOST_BEHIND >= index;
        let braked = self.brake.is_applied();
        if told && current && !state.withheld && !braked && command.force.is_finite() {
            return command.force.clamp_length_max(self.force_max);
        }
        self.add(|counts| &counts.withheld, 1);
        // The loop knows of its own brake, and of older gaps.
        if told && !braked {
            self.interrupt();
        }
        DVec3::ZERO
    }

    /// Tells the loop that zero is sent in place of its force.
    fn interrupt(&mut self) {
        self.newest.gap += 1;
        self.states.publish(self.newest);
    }

    /// An answer was lost: withholds the force until there is a newer state.
    fn miss(&mut self) {
        self.floor = self.newest.index;
        self.newest.state.withheld = true;
        self.interrupt();
    }

    /// Sends, and takes in what comes.
    fn turn(&mut self, force: DVec3) -> Result<(), String> {
        self.drain()?;
        self.wire.send(self.talk.force(force)).map_err(closed)?;
        self.sent = force;
        self.echo.commanded(force);
        let mut trouble = "it is silent".to_owned();
        let until = Instant::now() + ANSWER_TIME;
        match self.answer(until)? {
            Answer::State(sample) => {
                // The socket's own timer is coarse: what it let through may be late all the same.
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
        if self.echo.is_unasked(self.senses.time(now)) {
            return Err(
                "the Inverse Service reports a force although zero is commanded: close other programs that use the arm"
                    .to_owned(),
            );
        }
        if let Some(grip) = self.talk.grip.as_deref().filter(|_| self.senses.is_deaf(now)) {
            return Err(format!("the grip {grip} does not say how it is held any more: is it switched off?"));
        }
        Ok(())
    }

    /// Takes in what came unasked: answers that were late, or a service's mistakes. Were they left,
    /// all later states would be old.
    fn drain(&mut self) -> Result<(), String> {
        for _ in 0..MOST_EXTRA {
            if self.wire.hear(None).map_err(closed)? == Heard::Nothing {
                return Ok(());
            }
            self.add(|counts| &counts.extra, 1);
        }
        Err(format!("the Inverse Service sends more than {MOST_EXTRA} unrequested messages"))
    }

    /// The first message that comes by `until`.
    fn answer(&mut self, until: Instant) -> Result<Answer, String> {
        Ok(match self.wire.hear(Some(until)).map_err(closed)? {
            Heard::Text(text) => self.talk.sample(&text).map_or_else(Answer::Bad, Answer::State),
            Heard::Other(what) => Answer::Bad(what.to_owned()),
            Heard::Nothing => Answer::Late,
        })
    }

    fn take(&mut self, sample: &Sample) {
        let now = Instant::now();
        self.last_good = now;
        self.add(|counts| &counts.states, 1);
        let mut state = self.senses.state(sample, now);
        let time = self.senses.time(now);
        let given = sample.given.map(|given| self.echo.hear(given, time));
        if given.is_some_and(|given| given != Given::AsTold) {
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
    format!("the Inverse Service is gone: {why}")
}

/// Signals the loop that the connection to the service has ended.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.lost.set(Cow::Borrowed("the thread that talks to the Inverse Service has ended"));
    }
}
