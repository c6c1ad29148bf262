//! The thread that talks to the service.
//!
//! A turn: wait for a command of the loop, or for 5 ms; throw away what came unasked; send the force, or zero; wait for the
//! state, at most 5 ms, and leave it for the loop.
//!
//! States are counted, and a command says which was the newest that its force knows. A force is sent if it is new, if no
//! answer was lost after the state that it knows, and if that state is one of the last three. Everything else is sent as zero.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};

use super::address::Address;
use super::grip::GripFilter;
use super::message::{self, Arm, ArmKind, Grip, Sample};
use super::version::{self, Spelling};
use super::wire::{Failed, Heard, Wire};
use super::{HaplyError, HaplyOptions, Shared};
use crate::device::{Axes, Brake, BrakeFlag, DeviceSpec, DeviceState, known_devices};
use crate::latest::{Newest, Publisher};
use crate::realtime::{RealTimeOptions, claim};

/// For the inventory after connecting, and for the first state.
const FIRST_ANSWER: Duration = Duration::from_secs(1);
/// For a state: a service on the same machine answers within a fraction of a millisecond.
pub(super) const ANSWER_TIME: Duration = Duration::from_millis(5);
/// Without a command of the loop for this long, zero is sent.
const IDLE_TIME: Duration = Duration::from_millis(5);
/// Without a state for this long, the device is lost.
const LOST_TIME: Duration = Duration::from_millis(250);
/// Without an orientation for this long, the grip is.
const GRIP_LOST_TIME: f64 = 0.25;
/// States that a force may not know yet.
const MOST_BEHIND: u64 = 2;
/// Messages between two turns that nobody asked for: more are none of the service's.
const MOST_EXTRA: u64 = 64;
/// s: what service, cable and firmware take is not stated; a USB frame.
const ASSUMED_DELAY: f64 = 1e-3;
/// N: for arms of which no limit is known.
const CAUTIOUS_FORCE: f64 = 3.0;

/// A state, and how many there have been.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) state: DeviceState,
    pub(super) index: u64,
}

/// What the loop wants.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Command {
    /// 1, 2, 3, …; 0 before the first.
    pub(super) serial: u64,
    /// N.
    pub(super) force: DVec3,
    /// Index of the newest state that it knows.
    pub(super) knows: u64,
}

/// A connection that has gone around once.
pub(super) struct Opened {
    pub(super) spec: DeviceSpec,
    pub(super) notes: Vec<String>,
    pub(super) first: Sensed,
    wire: Wire,
    talk: Talk,
    senses: Senses,
}

/// How to address the arm.
struct Talk {
    arm: String,
    arm_in_json: String,
    grip: Option<String>,
    spelling: Spelling,
    message: String,
}

/// From samples to states.
struct Senses {
    origin: Instant,
    filter: Option<GripFilter>,
    rotation: DQuat,
    /// When the grip was heard last, s.
    heard: f64,
    buttons: u32,
}

/// Connects, chooses, and goes around once.
pub(super) fn open(options: &HaplyOptions) -> Result<Opened, HaplyError> {
    let address = Address::of(options)?;
    let written = || address.written.clone();
    let not_understood = |why: String| HaplyError::NotUnderstood { address: written(), why };
    let mut wire = Wire::open(&address).map_err(|failed| match failed {
        Failed::NoService(why) => HaplyError::NoService { address: written(), why },
        Failed::NotUnderstood(why) => not_understood(why),
    })?;
    let inventory =
        hear(&mut wire, "tells no inventory").and_then(|text| message::inventory(&text)).map_err(not_understood)?;
    let arm = choose(&inventory.arms, options, &address)?;
    let device = format!("the arm {}", arm.id);
    if let Some(why) = &arm.trouble {
        return Err(HaplyError::NotReady { device, why: why.clone() });
    }
    // With a grip for each arm, they belong together in the service's order.
    let place = inventory.arms.iter().position(|other| other.id == arm.id).unwrap_or(0);
    let grip = inventory.grips.get(place).or(inventory.grips.first());
    let version = version::ask(&address);
    let spelling = version::spelling(version.as_deref());
    let mut talk = Talk {
        arm: arm.id.clone(),
        arm_in_json: message::in_json(&arm.id),
        grip: grip.map(|grip| grip.id.clone()),
        spelling,
        message: String::new(),
    };
    wire.send(talk.force(DVec3::ZERO)).map_err(not_understood)?;
    let text = hear(&mut wire, "does not answer a command").map_err(not_understood)?;
    let sample = talk.sample(&text).map_err(|why| not_understood(format!("it sends {why}")))?;
    let mut senses = Senses::new();
    let state = senses.state(&sample, Instant::now());
    let mut notes = vec![
        format!(
            "service {} at {}, forces spelled `{}`",
            version.as_deref().unwrap_or("of an unknown version"),
            address.written,
            spelling.key()
        ),
        format!(
            "arm {}; {}",
            arm.id,
            grip.map_or("no grip: rotation is not sensed".to_owned(), |grip| format!(
                "grip {} ({})",
                grip.id, grip.kind
            ))
        ),
    ];
    notes.extend(arm.notes.iter().cloned());
    let others = inventory.arms.len().saturating_sub(1);
    if others > 0 {
        notes.push(format!("{others} other arms are not used"));
    }
    Ok(Opened { spec: spec_of(arm, grip), notes, first: Sensed { state, index: 1 }, wire, talk, senses })
}

/// The next text within [`FIRST_ANSWER`].
fn hear(wire: &mut Wire, missing: &str) -> Result<String, String> {
    match wire.hear(Some(Instant::now() + FIRST_ANSWER))? {
        Heard::Text(text) => Ok(text),
        Heard::Other(what) => Err(format!("it sends {what}")),
        Heard::Nothing => Err(format!("it {missing} within {} s", FIRST_ANSWER.as_secs())),
    }
}

fn choose<'a>(arms: &'a [Arm], options: &HaplyOptions, address: &Address) -> Result<&'a Arm, HaplyError> {
    let none = |why: String| HaplyError::NoDevice { address: address.written.clone(), why };
    match &options.arm {
        None => arms.first().ok_or_else(|| none("no arm: plug one in, and wait for its light".to_owned())),
        Some(wanted) => arms.iter().find(|arm| arm.id == *wanted).ok_or_else(|| {
            let all: Vec<&str> = arms.iter().map(|arm| arm.id.as_str()).collect();
            none(format!(
                "no arm `{wanted}`; it has: {}",
                if all.is_empty() { "none".to_owned() } else { all.join(", ") }
            ))
        }),
    }
}

fn spec_of(arm: &Arm, grip: Option<&Grip>) -> DeviceSpec {
    let known = known_devices().into_iter().find(|known| known.name == "Inverse3");
    let (name, force_max) = match (arm.kind, known) {
        (ArmKind::Inverse3, Some(known)) => ("Inverse3", known.force_max),
        (ArmKind::Inverse3x, Some(known)) => ("Inverse3x", known.force_max),
        (ArmKind::Minverse, _) => ("Minverse", CAUTIOUS_FORCE),
        _ => ("Haply arm of an unknown kind", CAUTIOUS_FORCE),
    };
    DeviceSpec {
        name: Cow::Borrowed(name),
        force_max,
        torque_max: 0.0,
        force_continuous: None,
        torque_continuous: None,
        actuated: Axes::TRANSLATION,
        sensed: if grip.is_some() { Axes::FULL } else { Axes::TRANSLATION },
        buttons: grip.map_or(0, |grip| grip.buttons),
        workspace: None,
        delay: ASSUMED_DELAY,
    }
}

impl Talk {
    fn force(&mut self, force: DVec3) -> &str {
        message::write_force(&mut self.message, &self.arm_in_json, self.spelling, force);
        &self.message
    }

    fn sample(&self, text: &str) -> Result<Sample, String> {
        message::sample(text, &self.arm, self.grip.as_deref())
    }
}

impl Senses {
    fn new() -> Self {
        Self { origin: Instant::now(), filter: None, rotation: DQuat::IDENTITY, heard: 0.0, buttons: 0 }
    }

    fn state(&mut self, sample: &Sample, now: Instant) -> DeviceState {
        let time = now.duration_since(self.origin).as_secs_f64();
        if let Some(rotation) = sample.rotation {
            (self.rotation, self.heard) = (rotation, time);
        }
        self.buttons = sample.buttons.unwrap_or(self.buttons);
        let filter = self.filter.get_or_insert_with(|| GripFilter::new(self.rotation, time));
        let (rotation, angular) = filter.follow(self.rotation, time);
        DeviceState {
            pose: Pose { rotation, translation: sample.position },
            twist: Twist { angular, linear: sample.velocity },
            buttons: self.buttons,
            time,
            withheld: false,
        }
    }

    /// s since the grip was heard.
    fn deaf(&self, now: Instant) -> f64 {
        now.duration_since(self.origin).as_secs_f64() - self.heard
    }
}

/// What came of waiting for a state.
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
    /// States so far.
    count: u64,
    /// Forces that know no newer state than this are not sent any more.
    floor: u64,
    /// Serial of the last command that was looked at.
    done: u64,
    /// The arm can push.
    ready: bool,
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
            count: first.index,
            floor: 0,
            done: 0,
            ready: true,
            last_good: Instant::now(),
        }
    }

    /// Until the device is not needed any more, or lost.
    pub(super) fn run(mut self, priority: Option<u8>) {
        if priority.is_some() {
            // Where it is not granted, the loop's own was not either, and says what mends it.
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
        // A service that still listens is told to stop; one that does not has nobody to push.
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
                return DVec3::ZERO;
            }
            std::thread::park_timeout(left);
        }
    }

    fn admit(&self, command: &Command) -> DVec3 {
        let current = command.knows > self.floor && command.knows + MOST_BEHIND >= self.count;
        if current && self.ready && !self.brake.is_applied() && command.force.is_finite() {
            return command.force.clamp_length_max(self.force_max);
        }
        if command.force != DVec3::ZERO {
            self.add(|counts| &counts.withheld, 1);
        }
        DVec3::ZERO
    }

    /// Sends, and takes in what comes.
    fn turn(&mut self, force: DVec3) -> Result<(), String> {
        self.drain()?;
        self.wire.send(self.talk.force(force)).map_err(closed)?;
        let mut trouble = "it is silent".to_owned();
        match self.answer(Instant::now() + ANSWER_TIME)? {
            Answer::State(sample) => self.take(&sample),
            Answer::Late => {
                self.add(|counts| &counts.late, 1);
                self.floor = self.count;
            }
            Answer::Bad(why) => {
                self.add(|counts| &counts.bad, 1);
                self.floor = self.count;
                trouble = why;
            }
        }
        if self.last_good.elapsed() > LOST_TIME {
            return Err(format!("the Inverse Service has given no state for {} ms: {trouble}", LOST_TIME.as_millis()));
        }
        if let Some(grip) = self.talk.grip.as_deref().filter(|_| self.senses.deaf(Instant::now()) > GRIP_LOST_TIME) {
            return Err(format!("the grip {grip} does not say how it is held any more: is it switched off?"));
        }
        Ok(())
    }

    /// Takes in what came unasked: answers that were late, or a service's mistakes. Were they left, all later states would be old.
    fn drain(&mut self) -> Result<(), String> {
        for _ in 0..MOST_EXTRA {
            if self.wire.hear(None).map_err(closed)? == Heard::Nothing {
                return Ok(());
            }
            self.add(|counts| &counts.extra, 1);
        }
        Err(format!("the Inverse Service sends more than {MOST_EXTRA} messages that nobody asked for"))
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
        self.ready = sample.ready;
        self.count += 1;
        self.add(|counts| &counts.states, 1);
        let state = self.senses.state(sample, now);
        self.states.publish(Sensed { state, index: self.count });
    }

    fn add(&self, count: impl Fn(&super::Counts) -> &AtomicU64, more: u64) {
        count(&self.shared.counts).fetch_add(more, Ordering::Relaxed);
    }
}

fn closed(why: String) -> String {
    format!("the Inverse Service is gone: {why}")
}

/// Tells the loop that there is nobody to talk to the service any more.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.lost.set(Cow::Borrowed("the thread that talks to the Inverse Service has ended"));
    }
}
