//! Messages to and from the service.
//!
//! A message is searched only for the needed fields. Entries of other devices, fields of other
//! versions and empty transforms (`{}`) are ignored. A needed number must be a finite JSON number;
//! a number written as a string is refused. The exception is `device_type`, which services write in
//! both ways.
//!
//! **Transforms.** Positions and forces are in the service's application space. Positions are not
//! in metres if there is a scale (`mount`, `transform`). +X does not point to the right if the
//! axes are permuted (`basis`) or the workspace is turned (`transform`). All these settings are
//! refused. A turned or shifted `mount` and a `preset` describe how the arm stands on the desk.
//! These settings only appear in the device's notes.

use std::fmt::Write;

use glam::{DQuat, DVec3};
use serde_json::Value;

use super::version::ForceKey;

/// Names of the arrays that contain grips. A grip may be in two of these arrays.
const GRIPS: [&str; 3] = ["custom_verse_grip", "wireless_verse_grip", "verse_grip"];

/// Names of buttons. The position in this list is the bit of the button.
const BUTTONS: [&str; 10] = ["a", "b", "c", "d", "e", "f", "down", "up", "right", "left"];
/// Number of buttons of the grips in each array. Services may omit buttons in the first message.
const BUTTONS_OF_GRIPS: [(&str, u8); 3] = [("custom_verse_grip", 3), ("wireless_verse_grip", 3), ("verse_grip", 1)];

/// Largest deviation of a quaternion from unit length. The service writes single precision, from
/// sensors with 14 bits.
const UNIT_SLACK: f64 = 1e-2;
/// Largest deviation of a transform's component from the identity, in single precision.
const TRANSFORM_SLACK: f64 = 1e-4;

/// An arm in the service's inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Id of the arm in messages; 1 to 64 bytes.
    pub id: String,
    /// Model of the arm.
    pub kind: ArmKind,
    /// The reason why the arm cannot be used; `None` if the arm can be used.
    pub trouble: Option<&'static str>,
    /// True if a session uses the arm. Before palpus has sent its first message, this is another
    /// program's session.
    pub in_use: bool,
    /// Settings of the arm for the recording.
    pub notes: Vec<String>,
}

/// Model of an arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmKind {
    /// The Inverse3.
    Inverse3,
    /// The Inverse3x.
    Inverse3x,
    /// The Minverse.
    Minverse,
    /// Another model, or one that the service does not name.
    Unknown,
}

/// A grip in the service's inventory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grip {
    /// Id of the grip in messages; 1 to 64 bytes.
    pub id: String,
    /// Name of the first array that contains the grip.
    pub kind: &'static str,
    /// Number of buttons that the loop sees, whether or not the message lists them.
    pub buttons: u8,
    /// Id of the arm with which the grip is paired, if the message states it.
    pub paired_with: Option<String>,
}

/// The devices that the service lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// Arms, in the order of the message.
    pub arms: Vec<Arm>,
    /// Grips; each appears once.
    pub grips: Vec<Grip>,
}

/// The parts of a state that palpus uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position of the cursor, m.
    pub position: DVec3,
    /// Velocity of the cursor, m/s.
    pub velocity: DVec3,
    /// Orientation of the grip, if the message has it.
    pub rotation: Option<DQuat>,
    /// Pressed buttons of the grip, if the message has them.
    pub buttons: Option<u32>,
    /// The reason why the arm gives no force now, whatever wrench is commanded.
    pub trouble: Option<&'static str>,
    /// The reason why the grip reports no orientation.
    pub grip_trouble: Option<&'static str>,
    /// The force that the arm gives according to the service, N.
    pub given: Option<DVec3>,
}

/// Reads the inventory from the service's first message.
///
/// # Errors
/// Returns a description of the problem if the text is not a valid inventory.
pub fn inventory(text: &str) -> Result<Inventory, String> {
    let root = parse(text)?;
    let mut inventory = Inventory::default();
    for entry in entries(&root, "inverse3") {
        if let Some(id) = id(entry) {
            let mut arm = arm(id, entry);
            arm.trouble = arm.trouble.or_else(|| turned_or_scaled(&root["session"]["config"]));
            inventory.arms.push(arm);
        }
    }
    for kind in GRIPS {
        for entry in entries(&root, kind) {
            let Some(id) = id(entry) else { continue };
            let buttons = count_of_buttons(kind, entry);
            let paired_with = paired(&entry["config"]["paired_with"], "inverse_id");
            match inventory.grips.iter_mut().find(|grip| grip.id == id) {
                Some(known) => {
                    known.buttons = known.buttons.max(buttons);
                    known.paired_with = known.paired_with.take().or(paired_with);
                }
                None => inventory.grips.push(Grip { id: id.to_owned(), kind, buttons, paired_with }),
            }
        }
    }
    if inventory.arms.is_empty() && root.get("inverse3").is_none() {
        return Err("its first message has no list `inverse3`".to_owned());
    }
    Ok(inventory)
}

/// Reads the state of `arm` and `grip` from a message.
///
/// # Errors
/// Returns a description of the problem if the message has no position and velocity of the arm.
pub fn sample(text: &str, arm: &str, grip: Option<&str>) -> Result<Sample, String> {
    let root = parse(text)?;
    let entry = entries(&root, "inverse3")
        .find(|entry| id(entry) == Some(arm))
        .ok_or_else(|| format!("a message without the arm {}", arm.escape_debug()))?;
    let state = &entry["state"];
    let vector_of =
        |key: &str| vector(&state[key]).ok_or_else(|| format!("a message without a usable `{key}` of the arm {arm}"));
    let mut sample = Sample {
        position: vector_of("cursor_position")?,
        velocity: vector_of("cursor_velocity")?,
        rotation: None,
        buttons: None,
        trouble: trouble(entry),
        grip_trouble: None,
        given: vector(&state["current_cursor_force"]),
    };
    let Some(grip) = grip else { return Ok(sample) };
    for kind in GRIPS {
        for entry in entries(&root, kind).filter(|entry| id(entry) == Some(grip)) {
            let state = &entry["state"];
            sample.grip_trouble = sample.grip_trouble.or(grip_trouble(entry));
            sample.rotation = sample.rotation.or_else(|| rotation(&state["orientation"]));
            if let Some(pressed) = buttons(state) {
                sample.buttons = Some(sample.buttons.unwrap_or(0) | pressed);
            }
        }
    }
    Ok(sample)
}

/// Overwrites `into` with a message that commands a force (N) on the arm with the id `id_in_json`.
pub(super) fn write_force(into: &mut String, id_in_json: &str, spelling: ForceKey, force: DVec3) {
    into.clear();
    into.push('{');
    write_device(into, id_in_json, spelling, force);
}

/// Overwrites `into` with the first message of a session. The message commands zero and names the
/// profile under which the service keeps this program's settings. The service's answer contains
/// these settings, while the inventory contained the previous settings.
pub(super) fn write_first(into: &mut String, id_in_json: &str, spelling: ForceKey) {
    into.clear();
    into.push_str(r#"{"session":{"configure":{"profile":{"name":"palpus"}},"force_render_full_state":{}},"#);
    write_device(into, id_in_json, spelling, DVec3::ZERO);
}

/// Appends the rest of a message, which is the part for the arm.
fn write_device(into: &mut String, id_in_json: &str, spelling: ForceKey, force: DVec3) {
    let (key, DVec3 { x, y, z }) = (spelling.key(), force);
    // Writing to a string cannot fail.
    let _ = write!(
        into,
        r#""inverse3":[{{"device_id":{id_in_json},"commands":{{"set_cursor_force":{{"{key}":{{"x":{x:.6},"y":{y:.6},"z":{z:.6}}}}}}}}}]}}"#
    );
}

/// Returns the id of the grip in the service's `answer` to a request for an arm's pairing.
pub(super) fn paired_grip(answer: &Value) -> Option<String> {
    paired(answer.get("data").unwrap_or(answer), "verse_grip_id")
}

/// Returns an id as a JSON string.
pub(super) fn in_json(id: &str) -> String {
    Value::from(id).to_string()
}

fn parse(text: &str) -> Result<Value, String> {
    serde_json::from_str(text).map_err(|error| format!("a message that is not JSON ({error})"))
}

fn entries<'a>(root: &'a Value, list: &str) -> impl Iterator<Item = &'a Value> {
    root.get(list).and_then(Value::as_array).into_iter().flatten()
}

/// Returns the id of an entry. The id must be short and printable, since messages show it in
/// lines of text.
fn id(entry: &Value) -> Option<&str> {
    entry.get("device_id")?.as_str().filter(|id| (1..=64).contains(&id.len()) && !id.contains(char::is_control))
}

fn arm(id: &str, entry: &Value) -> Arm {
    let config = &entry["config"];
    let kind = match (&config["device_info"]["device_type"], &config["type"]) {
        (Value::Null, kind) => kind_of(kind),
        (kind, other) => match kind_of(kind) {
            ArmKind::Unknown => kind_of(other),
            known => known,
        },
    };
    let trouble = trouble(entry).or_else(|| turned_or_scaled(config));
    let in_use = entry["status"]["in_use"] == Value::Bool(true);
    Arm { id: id.to_owned(), kind, trouble, in_use, notes: notes(config) }
}

fn kind_of(value: &Value) -> ArmKind {
    match (value.as_str(), value.as_u64()) {
        (Some("inverse3"), _) | (_, Some(4)) => ArmKind::Inverse3,
        (Some("inverse3x"), _) => ArmKind::Inverse3x,
        (Some("minverse"), _) | (_, Some(6)) => ArmKind::Minverse,
        _ => ArmKind::Unknown,
    }
}

/// Returns the reason why an arm gives no force. A missing status is no reason: without it, the arm
/// may still be usable.
fn trouble(entry: &Value) -> Option<&'static str> {
    let transform = &entry["state"]["transform"];
    says_no(
        entry,
        [
            ("power_supply", "without power: plug its supply in"),
            ("calibrated", "not calibrated: put it in its rest position and follow the service's calibration"),
            ("ready", "not ready: wait for its light, or plug it in again"),
        ],
    )
    .or_else(|| is_scaled(transform).then_some(SCALED))
    .or_else(|| is_turned(transform).then_some("turned by the service's workspace transform: reset `transform`"))
}

const SCALED: &str =
    "scaled by the service, so that positions are not in metres: reset the scale of `mount` and `transform` to 1";

/// Returns the reason why a grip reports no orientation.
fn grip_trouble(entry: &Value) -> Option<&'static str> {
    says_no(
        entry,
        [
            ("connected", "not connected: switch it on, or plug its receiver in"),
            ("awake", "asleep: press one of its buttons"),
            ("ready", "not ready: wait for its light"),
        ],
    )
}

/// Returns the text for the first status that is `false`.
fn says_no(entry: &Value, all: [(&str, &'static str); 3]) -> Option<&'static str> {
    all.into_iter().find(|(key, _)| entry["status"][*key] == Value::Bool(false)).map(|(_, trouble)| trouble)
}

/// Returns the text for a setting that scales or turns positions; else `None`.
fn turned_or_scaled(config: &Value) -> Option<&'static str> {
    let turned = permutation(config).is_some_and(|axes| axes != "XYZ");
    let turned = turned.then_some("turned by the service (`basis`), so that +X is not to the right: reset it to XYZ");
    turned.or_else(|| is_scaled(&config["mount"]).then_some(SCALED))
}

fn permutation(config: &Value) -> Option<&str> {
    let basis = if config["basis"].is_null() { &config["coordinate_system"] } else { &config["basis"] };
    basis["permutation"].as_str()
}

/// Returns true if a transform has a scale other than 1, or an invalid scale.
fn is_scaled(transform: &Value) -> bool {
    let scale = &transform["scale"];
    !scale.is_null() && vector(scale).is_none_or(|scale| (scale - 1.0).abs().max_element() > TRANSFORM_SLACK)
}

/// Returns true if a transform has a rotation other than the identity, or an invalid rotation.
fn is_turned(transform: &Value) -> bool {
    let turn = &transform["rotation"];
    !turn.is_null() && rotation(turn).is_none_or(|turn| 1.0 - turn.w.abs() > TRANSFORM_SLACK)
}

/// Returns the id of the paired device. A pairing is an id, or an object with the id at `key`.
fn paired(pairing: &Value, key: &str) -> Option<String> {
    let other = pairing.as_str().or_else(|| pairing.get(key)?.as_str())?;
    ((1..=64).contains(&other.len()) && !other.contains(char::is_control)).then(|| other.to_owned())
}

/// Returns the settings of the service that a hand can feel.
fn notes(config: &Value) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |name: &str, value: &Value| {
        if !value.is_null() && value.as_object().is_none_or(|fields| !fields.is_empty()) {
            let text: String = value.to_string().chars().take(160).collect();
            notes.push(format!("{name}: {text}"));
        }
    };
    note("firmware", &config["extended_firmware_version"]);
    note("handedness", &config["handedness"]);
    note("gravity compensation", &config["gravity_compensation"]);
    note("torque scaling", &config["torque_scaling"]);
    note("oscillation damper", &config["filters"]["damping"]);
    note("force gate", &config["filters"]["force_gate"]);
    note("origin", &config["coordinate_origin"]);
    note("cursor offset", &config["cursor_offset"]);
    note("mount", &config["mount"]);
    note("preset", &config["preset"]);
    note("axes", &permutation(config).into());
    notes
}

fn vector(value: &Value) -> Option<DVec3> {
    let part = |key: &str| value.get(key)?.as_f64().filter(|part| part.is_finite());
    Some(DVec3::new(part("x")?, part("y")?, part("z")?))
}

fn rotation(value: &Value) -> Option<DQuat> {
    let w = value.get("w")?.as_f64()?;
    let DVec3 { x, y, z } = vector(value)?;
    let rotation = DQuat::from_xyzw(x, y, z, w);
    ((rotation.length() - 1.0).abs() <= UNIT_SLACK).then(|| rotation.normalize())
}

fn buttons(state: &Value) -> Option<u32> {
    let pressed = |value: &Value| u32::from(value == &Value::Bool(true));
    if let Some(buttons) = state.get("buttons").and_then(Value::as_object) {
        let bit = |(k, name): (usize, &&str)| buttons.get(*name).map_or(0, pressed) << k;
        return Some(BUTTONS.iter().enumerate().map(bit).fold(0, |all, bit| all | bit));
    }
    state.get("button").filter(|button| button.is_boolean()).map(pressed)
}

fn count_of_buttons(kind: &str, entry: &Value) -> u8 {
    let usual = BUTTONS_OF_GRIPS.iter().find(|(grip, _)| *grip == kind).map_or(0, |(_, count)| *count);
    let has = |name: &&str| entry["state"]["buttons"].get(*name).is_some();
    let last = BUTTONS.iter().rposition(has).map_or(0, |place| place as u8 + 1);
    usual.max(last)
}
