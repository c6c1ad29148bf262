//! Opens a connection to the service and waits for the first complete state.
//!
//! 1. Connect, read the inventory and select the arm. An arm is refused if another program uses it,
//!    if it is not ready, or if its positions or forces are scaled or turned.
//! 2. Request the service's version, its force scale, and the grip that is paired with the arm.
//! 3. Send the first message, with the session's name and zero force. Repeat zero until an answer
//!    has the arm's position and the grip's orientation.

use std::borrow::Cow;
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::Value;

use super::address::Address;
use super::message::{self, Arm, ArmKind, Grip, Inventory, Sample};
use super::senses::Senses;
use super::version::{self, ForceKey, Identity};
use super::wire::{Failed, Received, Wire};
use super::{HaplyError, HaplyOptions, http};
use crate::device::{Axes, DeviceSpec, DeviceState, known_devices};

/// Time limit for the inventory, for the first state, and for the grip's first orientation.
const FIRST_ANSWER: Duration = Duration::from_secs(1);
/// Time between two messages while waiting for the grip's orientation.
const ASK_AGAIN: Duration = Duration::from_millis(10);
/// Assumed delay of service, cable and firmware, s: one USB frame. The maker does not document this
/// delay.
const ASSUMED_DELAY: f64 = 1e-3;
/// Force limit of arms whose limit is unknown, N.
const CAUTIOUS_FORCE: f64 = 3.0;
/// Tolerance of the service's force scale, which must be 1.
const SCALE_SLACK: f64 = 1e-6;

/// An open connection after its first complete state.
pub(super) struct Opened {
    pub(super) spec: DeviceSpec,
    pub(super) notes: Vec<String>,
    pub(super) first: DeviceState,
    pub(super) wire: Wire,
    pub(super) talk: MessageFormat,
    pub(super) senses: Senses,
}

/// Names and message format for one arm and its grip.
pub(super) struct MessageFormat {
    arm: String,
    arm_in_json: String,
    pub(super) grip: Option<String>,
    spelling: ForceKey,
    message: String,
}

/// Connects, selects arm and grip, and waits for the first complete state.
pub(super) fn open(options: &HaplyOptions) -> Result<Opened, HaplyError> {
    let address = Address::of(options)?;
    let written = || address.written.clone();
    let not_understood = |why: String| HaplyError::NotUnderstood { address: written(), why };
    let mut wire = Wire::open(&address).map_err(|failed| match failed {
        Failed::NoService(why) => HaplyError::NoService { address: written(), why },
        Failed::NotUnderstood(why) => not_understood(why),
    })?;
    let inventory = hear(&mut wire, "does not send its inventory")
        .and_then(|text| message::inventory(&text))
        .map_err(not_understood)?;
    let arm = choose(&inventory.arms, options, &address)?;
    let not_ready = |why: String| HaplyError::NotReady { device: format!("the arm {}", arm.id), why };
    let in_use = "in use by another program, whose forces would be added: close that program; if you have just closed it, try again";
    if let Some(why) = Some(in_use).filter(|_| arm.in_use).or(arm.trouble) {
        return Err(not_ready(why.to_owned()));
    }
    let Identity { version, note } = Identity::of(http::get(&address, "/version").as_ref()).map_err(not_understood)?;
    let scale = http::get(&address, "/settings/devices/force_scale").as_ref().and_then(http::number_of);
    if let Some(scale) = scale.filter(|scale| (scale - 1.0).abs() > SCALE_SLACK) {
        return Err(not_ready(format!(
            "set to {scale} times the commanded forces: set `devices/force_scale` of the service to 1"
        )));
    }
    let pairing = http::get(&address, &format!("/inverse3/{}/config/paired_with", http::in_path(&arm.id)));
    let (grip, paired) = grip_of(arm, &inventory, pairing.as_ref());
    let spelling = version::spelling(version.as_deref());
    let mut talk = MessageFormat {
        arm: arm.id.clone(),
        arm_in_json: message::in_json(&arm.id),
        grip: grip.map(|grip| grip.id.clone()),
        spelling,
        message: String::new(),
    };
    let sample = first_sample(&mut wire, &mut talk, version.is_some()).map_err(|failed| match failed {
        NoSample::NotUnderstood(why) => not_understood(why),
        NoSample::NotReady(device, why) => HaplyError::NotReady { device, why },
    })?;
    let mut senses = Senses::new(grip.is_some());
    let first = senses.state(&sample, Instant::now());
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
                "grip {} ({}), {paired}",
                grip.id, grip.kind
            ))
        ),
    ];
    notes.extend(note);
    if scale.is_none() {
        notes.push("the service does not report its force scale".to_owned());
    }
    notes.extend(arm.notes.iter().cloned());
    let others = inventory.arms.len().saturating_sub(1);
    if others > 0 {
        notes.push(format!("{others} other arms are not used"));
    }
    Ok(Opened { spec: spec_of(arm, grip), notes, first, wire, talk, senses })
}

/// The reason why there is no first sample.
enum NoSample {
    NotUnderstood(String),
    /// The name of the arm or grip, and the reason why it is not ready.
    NotReady(String, String),
}

/// Returns the first sample. If there is a grip, the sample includes the orientation of the grip.
/// The session's name is sent only to services that state their version, since older services may
/// not accept it.
fn first_sample(wire: &mut Wire, talk: &mut MessageFormat, named: bool) -> Result<Sample, NoSample> {
    let until = Instant::now() + FIRST_ANSWER;
    let mut message = if named { talk.first() } else { talk.force(DVec3::ZERO) };
    loop {
        wire.send(message).map_err(NoSample::NotUnderstood)?;
        let text = hear(wire, "does not answer a command").map_err(NoSample::NotUnderstood)?;
        if let Some(why) = talk.trouble(&text) {
            return Err(NoSample::NotReady(format!("the arm {}", talk.arm), why.to_owned()));
        }
        let sample = talk.sample(&text).map_err(|why| NoSample::NotUnderstood(format!("it sends {why}")))?;
        let Some(grip) = &talk.grip else { return Ok(sample) };
        if sample.rotation.is_some() && sample.grip_trouble.is_none() {
            return Ok(sample);
        }
        if Instant::now() >= until {
            let silent = "not reporting its orientation: move it, and check that it is switched on";
            return Err(NoSample::NotReady(
                format!("the grip {grip}"),
                sample.grip_trouble.unwrap_or(silent).to_owned(),
            ));
        }
        std::thread::sleep(ASK_AGAIN);
        message = talk.force(DVec3::ZERO);
    }
}

/// Returns the grip that belongs to `arm`, and the reason for the choice.
///
/// The arm or the grip may state a pairing, which decides. If the paired grip is missing, no
/// other grip is used. Arms and grips without a pairing are matched in the service's order.
fn grip_of<'a>(arm: &Arm, inventory: &'a Inventory, pairing: Option<&Value>) -> (Option<&'a Grip>, &'static str) {
    let Inventory { arms, grips } = inventory;
    if let Some(id) = pairing.and_then(message::paired_grip) {
        return (grips.iter().find(|grip| grip.id == id), "paired with it");
    }
    let is_of = |grip: &Grip, arm: &Arm| grip.paired_with.as_ref() == Some(&arm.id);
    if let Some(grip) = grips.iter().find(|grip| is_of(grip, arm)) {
        return (Some(grip), "paired with it");
    }
    let mut alone = arms.iter().filter(|arm| !grips.iter().any(|grip| is_of(grip, arm)));
    let place = alone.position(|other| other.id == arm.id).unwrap_or(0);
    let mut free = grips.iter().filter(|grip| grip.paired_with.is_none());
    let first = free.clone().next();
    // A single grip without a pairing is used with every arm.
    (free.nth(place).or(first), "by the service's order, since no pairing is stated")
}

/// Returns the next text message that arrives within [`FIRST_ANSWER`].
fn hear(wire: &mut Wire, missing: &str) -> Result<String, String> {
    match wire.hear(Some(Instant::now() + FIRST_ANSWER))? {
        Received::Text(text) => Ok(text),
        Received::Other(what) => Err(format!("it sends {what}")),
        Received::Nothing => Err(format!("it {missing} within {} s", FIRST_ANSWER.as_secs())),
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
        actuated: Axes::TRANSLATION,
        sensed: if grip.is_some() { Axes::FULL } else { Axes::TRANSLATION },
        buttons: grip.map_or(0, |grip| grip.buttons),
        delay: ASSUMED_DELAY,
        ..DeviceSpec::default()
    }
}

impl MessageFormat {
    /// Returns the message that commands a force, N.
    pub(super) fn force(&mut self, force: DVec3) -> &str {
        message::write_force(&mut self.message, &self.arm_in_json, self.spelling, force);
        &self.message
    }

    /// Returns the message that names the session.
    fn first(&mut self) -> &str {
        message::write_first(&mut self.message, &self.arm_in_json, self.spelling);
        &self.message
    }

    /// Returns the reason why the arm cannot be used with the settings in `text`, if `text`
    /// contains settings.
    fn trouble(&self, text: &str) -> Option<&'static str> {
        message::inventory(text).ok()?.arms.into_iter().find(|arm| arm.id == self.arm)?.trouble
    }

    /// Reads the state of the arm and its grip from `text`.
    pub(super) fn sample(&self, text: &str) -> Result<Sample, String> {
        message::sample(text, &self.arm, self.grip.as_deref())
    }
}
