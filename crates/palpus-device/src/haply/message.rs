//! What the service says, and what it is told.
//!
//! A message is looked at for what is needed and no further: entries of other devices, fields of other versions and empty
//! transforms (`{}`) are passed over. What is needed must be a finite number of the kind that it is; a number written as text is
//! none. The exception is `device_type`, which services write either way.

use std::fmt::Write;

use glam::{DQuat, DVec3};
use serde_json::Value;

use super::version::Spelling;

/// Arrays in which grips stand. The same grip may be in two.
const GRIPS: [&str; 3] = ["custom_verse_grip", "wireless_verse_grip", "verse_grip"];

/// Buttons by the bit that they get.
const BUTTONS: [&str; 3] = ["a", "b", "c"];

/// How far the length of a quaternion may be from 1: the service writes single precision, of sensors with 14 bits.
const UNIT_SLACK: f64 = 1e-2;

/// An arm of the inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// What it is called in messages; 1 to 64 bytes.
    pub id: String,
    /// Which it is.
    pub kind: ArmKind,
    /// What keeps it from being used.
    pub trouble: Option<String>,
    /// Worth writing down.
    pub notes: Vec<String>,
}

/// Which arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmKind {
    /// The Inverse3.
    Inverse3,
    /// The Inverse3x.
    Inverse3x,
    /// The Minverse.
    Minverse,
    /// Another, or one of which it is not said.
    Unknown,
}

/// A grip of the inventory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grip {
    /// What it is called in messages; 1 to 64 bytes.
    pub id: String,
    /// The array that it was found in first.
    pub kind: &'static str,
    /// How many the loop sees.
    pub buttons: u8,
}

/// What there is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// In the order of the message.
    pub arms: Vec<Arm>,
    /// Each once.
    pub grips: Vec<Grip>,
}

/// A state, as far as it is of use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// Of the grip, when the message has it.
    pub rotation: Option<DQuat>,
    /// Of the grip, likewise.
    pub buttons: Option<u32>,
    /// The arm says that it can push.
    pub ready: bool,
}

/// The inventory that comes first.
///
/// # Errors
/// In words, when the text is none.
pub fn inventory(text: &str) -> Result<Inventory, String> {
    let root = parse(text)?;
    let mut inventory = Inventory::default();
    for entry in entries(&root, "inverse3") {
        if let Some(id) = id(entry) {
            inventory.arms.push(arm(id, entry));
        }
    }
    for kind in GRIPS {
        for entry in entries(&root, kind) {
            let Some(id) = id(entry) else { continue };
            let buttons = count_of_buttons(entry);
            match inventory.grips.iter_mut().find(|grip| grip.id == id) {
                Some(known) => known.buttons = known.buttons.max(buttons),
                None => inventory.grips.push(Grip { id: id.to_owned(), kind, buttons }),
            }
        }
    }
    if inventory.arms.is_empty() && root.get("inverse3").is_none() {
        return Err("its first message has no list `inverse3`".to_owned());
    }
    Ok(inventory)
}

/// What a message says of `arm` and `grip`.
///
/// # Errors
/// In words, when it does not say where the arm is.
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
        ready: trouble(entry).is_none(),
    };
    let Some(grip) = grip else { return Ok(sample) };
    for kind in GRIPS {
        for entry in entries(&root, kind).filter(|entry| id(entry) == Some(grip)) {
            let state = &entry["state"];
            sample.rotation = sample.rotation.or_else(|| rotation(&state["orientation"]));
            if let Some(pressed) = buttons(state) {
                sample.buttons = Some(sample.buttons.unwrap_or(0) | pressed);
            }
        }
    }
    Ok(sample)
}

/// Overwrites `into` with the message that sets a force, N, on the arm whose id is `id_in_json`.
pub(super) fn write_force(into: &mut String, id_in_json: &str, spelling: Spelling, force: DVec3) {
    into.clear();
    let (key, DVec3 { x, y, z }) = (spelling.key(), force);
    // A string takes everything.
    let _ = write!(
        into,
        r#"{{"inverse3":[{{"device_id":{id_in_json},"commands":{{"set_cursor_force":{{"{key}":{{"x":{x:.6},"y":{y:.6},"z":{z:.6}}}}}}}}}]}}"#
    );
}

/// An id as it stands in a message.
pub(super) fn in_json(id: &str) -> String {
    Value::from(id).to_string()
}

fn parse(text: &str) -> Result<Value, String> {
    serde_json::from_str(text).map_err(|error| format!("a message that is no JSON ({error})"))
}

fn entries<'a>(root: &'a Value, list: &str) -> impl Iterator<Item = &'a Value> {
    root.get(list).and_then(Value::as_array).into_iter().flatten()
}

/// An id is shown in lines of text, and is a short word.
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
    Arm { id: id.to_owned(), kind, trouble: trouble(entry), notes: notes(config) }
}

fn kind_of(value: &Value) -> ArmKind {
    match (value.as_str(), value.as_u64()) {
        (Some("inverse3"), _) | (_, Some(4)) => ArmKind::Inverse3,
        (Some("inverse3x"), _) => ArmKind::Inverse3x,
        (Some("minverse"), _) | (_, Some(6)) => ArmKind::Minverse,
        _ => ArmKind::Unknown,
    }
}

/// Why an arm cannot push. A status that is not told is no obstacle: the service then simply does not push.
fn trouble(entry: &Value) -> Option<String> {
    let status = &entry["status"];
    let says_no = |key: &str| status[key] == Value::Bool(false);
    [
        ("power_supply", "without power: plug its supply in"),
        ("calibrated", "not calibrated: put it in its rest position and follow the service's calibration"),
        ("ready", "not ready: wait for its light, or plug it in again"),
    ]
    .into_iter()
    .find(|(key, _)| says_no(key))
    .map(|(_, trouble)| trouble.to_owned())
}

/// Settings of the service that a hand feels.
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
    let basis = if config["basis"].is_null() { &config["coordinate_system"] } else { &config["basis"] };
    note("axes", &basis["permutation"]);
    if basis["permutation"].as_str().is_some_and(|permutation| permutation != "XYZ") {
        notes.push("the service turns the axes: +X may not be to the right, nor +Z up".to_owned());
    }
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

fn count_of_buttons(entry: &Value) -> u8 {
    let state = &entry["state"];
    if state["buttons"].is_object() { BUTTONS.len() as u8 } else { u8::from(state["button"].is_boolean()) }
}
