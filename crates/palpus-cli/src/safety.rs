//! Prints and records the safety chain, and restores it for a replay.

use palpus_device::{
    AfterFault, AfterPanic, Claimed, Cut, DeviceSpec, EnableMode, LimitLine, RealTimeClaims, Rearm, SafetyChain,
    SafetyCounters, SafetyLimits, SafetyOptions,
};
use serde::Serialize;
use toml::{Table, Value};

use crate::output;

/// Key of the chain in a recording's header.
const SECTION: &str = "safety";

/// Safety part of a summary.
#[derive(Debug, Default, Serialize)]
pub(crate) struct SafetyReport {
    /// Number of ticks for each kind of cut.
    cuts: serde_json::Map<String, serde_json::Value>,
    /// Thresholds by name, in SI units.
    limits: serde_json::Map<String, serde_json::Value>,
    /// Real-time features that the operating system granted.
    real_time: Option<serde_json::Map<String, serde_json::Value>>,
}

impl SafetyReport {
    pub(crate) fn new(counters: &SafetyCounters, limits: &SafetyLimits, claims: Option<&RealTimeClaims>) -> Self {
        let text = |claims: &RealTimeClaims| {
            claims.lines().iter().map(|(name, claimed)| ((*name).to_owned(), claimed.to_string().into())).collect()
        };
        Self {
            cuts: counters.iter().map(|(cut, ticks)| (cut.name().to_owned(), ticks.into())).collect(),
            limits: limits.explained().iter().map(|line| (line.name.to_owned(), line.value.into())).collect(),
            real_time: claims.map(text),
        }
    }

    /// Returns the interventions in words.
    pub(crate) fn cuts(&self) -> String {
        cuts_in_words(&self.cuts)
    }
}

/// Returns the number of ticks for each intervention, for people.
pub(crate) fn cuts_in_words(cuts: &serde_json::Map<String, serde_json::Value>) -> String {
    if cuts.is_empty() {
        return "no interventions".to_owned();
    }
    // Every run begins with a ramp, so the text says what the start-up does instead of its name.
    let start_up = Cut::StartUp.name();
    let each = cuts.iter().map(|(name, ticks)| match name.as_str() {
        name if name == start_up => format!("start-up: no or reduced force in {ticks} ticks"),
        name => format!("{}: {ticks} ticks", name.replace('_', " ")),
    });
    each.collect::<Vec<_>>().join(", ")
}

/// Prints the thresholds for a device, one for each line.
pub(crate) fn print(spec: &DeviceSpec, limits: &SafetyLimits, json: bool) -> anyhow::Result<()> {
    if json {
        let values: serde_json::Map<_, serde_json::Value> =
            limits.explained().iter().map(|line| (line.name.to_owned(), line.value.into())).collect();
        return output::json(&values);
    }
    output::line(format!("safety thresholds for the device `{}`", spec.name));
    for LimitLine { name, value, unit, why } in limits.explained() {
        output::line(format!("{name:>18}  {value:10.4} {unit:10}  {why}"));
    }
    Ok(())
}

/// Prints the rights that the operating system did not grant, one line for each right, with a
/// remedy.
pub(crate) fn tell_claims(claims: &RealTimeClaims) {
    let granted: Vec<String> = claims
        .lines()
        .iter()
        .filter_map(|(name, claimed)| match claimed {
            Claimed::Granted(what) => Some(format!("{name}: {what}")),
            _ => None,
        })
        .collect();
    if !granted.is_empty() {
        output::note(format!("real time: {}", granted.join("; ")));
    }
    for (name, claimed) in claims.lines() {
        if let Claimed::Refused { why, mend } = claimed {
            output::note(format!("note: no {name} ({why}); {mend}"));
        }
    }
}

/// Writes all parameters of the chain into a recording's header.
pub(crate) fn recorded(limits: &SafetyLimits, enable_mode: EnableMode, options: &SafetyOptions, into: &mut Table) {
    let mut table = Table::new();
    let (how, buttons) = match enable_mode {
        EnableMode::Automatic => ("automatic", None),
        EnableMode::Button(mask) => ("button", Some(mask)),
        EnableMode::DeadMan(mask) => ("dead-man", Some(mask)),
    };
    table.insert("engagement".into(), how.into());
    if let Some(mask) = buttons {
        table.insert("buttons".into(), i64::from(mask).into());
    }
    table.insert("stop_after_fault".into(), (options.after_fault == AfterFault::Stop).into());
    table.insert("latch".into(), (options.rearm == Rearm::ByPerson).into());
    table.insert("stop_after_panic".into(), (options.after_panic == AfterPanic::Stop).into());
    for line in limits.explained() {
        table.insert(line.name.into(), line.value.into());
    }
    into.insert(SECTION.into(), Value::Table(table));
}

/// Reads the chain of a recording; `None` for a recording without a chain.
pub(crate) fn of_recording(more: &Table, period: f64) -> anyhow::Result<Option<SafetyChain>> {
    let Some(table) = more.get(SECTION).and_then(Value::as_table) else { return Ok(None) };
    let problem = || anyhow::anyhow!("the recording's header lacks values of its safety chain");
    let limits = SafetyLimits::from_values(|name| table.get(name).and_then(Value::as_float)).ok_or_else(problem)?;
    let mask = || table.get("buttons").and_then(Value::as_integer).and_then(|mask| u32::try_from(mask).ok());
    let enable_mode = match table.get("engagement").and_then(Value::as_str) {
        Some("automatic") => EnableMode::Automatic,
        Some("button") => EnableMode::Button(mask().ok_or_else(problem)?),
        Some("dead-man") => EnableMode::DeadMan(mask().ok_or_else(problem)?),
        _ => return Err(problem()),
    };
    let is_set = |name: &str| table.get(name).and_then(Value::as_bool).ok_or_else(problem);
    let options = SafetyOptions {
        enable_mode: Some(enable_mode),
        limits: Some(limits),
        loosened: false,
        after_fault: if is_set("stop_after_fault")? { AfterFault::Stop } else { AfterFault::Reengage },
        after_panic: if is_set("stop_after_panic")? { AfterPanic::Stop } else { AfterPanic::AsFault },
        // Older recordings, which had no latch, do not have this value.
        rearm: match table.get("latch").and_then(Value::as_bool) {
            Some(true) => Rearm::ByPerson,
            _ => Rearm::Automatic,
        },
    };
    if !limits.is_valid() {
        return Err(problem());
    }
    Ok(Some(SafetyChain::new(&limits, enable_mode, &options, period)))
}
