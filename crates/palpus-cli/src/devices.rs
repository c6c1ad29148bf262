//! `palpus devices`: what is there, and what it would take to have the rest; and `--device`, by name.

use std::process::ExitCode;

use anyhow::{Context, bail};
use palpus::algebra::Pose;
use palpus_device::{
    Axes, DeviceSpec, Finding, FindingState, HAPLY_ADDRESS, HaplyDevice, HaplyOptions, HapticDevice, PlacedDevice,
    RealTimeOptions, SafetyLimits, SpaceMouse, WallTime, self_test,
};
use palpus_drivers::{ForceDimension, ForceDimensionOptions, OpenHaptics, OpenHapticsOptions, Place};
use serde_json::{Map, Value, json};
use toml::Table;

use crate::args::DevicesArguments;
use crate::output;

/// Columns of the page: those of the narrowest terminal that is common.
const WIDTH: usize = 80;
/// Columns of the names of lines.
const MARGIN: usize = 14;

pub(crate) fn devices(arguments: &DevicesArguments) -> anyhow::Result<ExitCode> {
    let mut findings = palpus_device::look();
    findings.extend(palpus_drivers::look());
    if arguments.json {
        output::json(&document(&findings))?;
    } else {
        for line in page(&findings) {
            output::line(line);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What `--device` can be, for who typed something else.
pub(crate) const NAMES: &str = "sim, replay:FILE, haply[#ARM][:ws://HOST:PORT], spacemouse[:/dev/hidrawN], \
    force-dimension[#1][:LIBRARY], force-dimension-simulator[:LIBRARY], openhaptics[#NAME][:LIBRARY]";

/// The hardware called `name`, tested, and set down so that the grip begins at `start` (world);
/// `None` when it is no hardware's name.
///
/// `notes` gets what is worth writing down of it; with `real_time`, threads of the device ask for priority like the loop does.
pub(crate) fn open(
    name: &str,
    start: Pose,
    real_time: bool,
    notes: &mut Vec<String>,
) -> anyhow::Result<Option<Box<dyn HapticDevice + Send>>> {
    let Wanted { kind, which, place } = Wanted::of(name);
    if which.is_some() && !matches!(kind, "haply" | "force-dimension" | "openhaptics") {
        bail!("of `{kind}` there is one; leave the # out");
    }
    let mut device: Box<dyn HapticDevice + Send> = match kind {
        "haply" => {
            let device = HaplyDevice::open(&haply(which, place, real_time)).with_context(|| refused(name))?;
            notes.extend_from_slice(device.notes());
            Box::new(device)
        }
        "spacemouse" => Box::new(SpaceMouse::open(place).with_context(|| refused(name))?),
        "force-dimension" | "force-dimension-simulator" => {
            let simulator = kind.ends_with("simulator");
            let options = ForceDimensionOptions { library: library(place), simulator, which: number(which)? };
            let device = ForceDimension::open(&options).with_context(|| refused(name))?;
            if !device.has_watchdog() {
                output::note(
                    "note: this device has no watchdog of its own; if the program is killed, it may hold its force",
                );
            }
            Box::new(device)
        }
        "openhaptics" => {
            let options = OpenHapticsOptions { library: library(place), device: which.map(str::to_owned) };
            Box::new(OpenHaptics::open(&options).with_context(|| refused(name))?)
        }
        _ => return Ok(None),
    };
    let failed = || format!("the device `{name}` failed its self test");
    notes.push(self_test(&mut device, &WallTime::new()).with_context(failed)?.to_string());
    Ok(Some(Box::new(PlacedDevice::new(device, start))))
}

/// What is typed behind `--device`: `KIND`, `KIND#WHICH`, `KIND:PLACE` or `KIND#WHICH:PLACE`.
#[derive(Debug, PartialEq)]
struct Wanted<'a> {
    kind: &'a str,
    which: Option<&'a str>,
    place: Option<&'a str>,
}

impl<'a> Wanted<'a> {
    fn of(name: &'a str) -> Self {
        let (front, place) = name.split_once(':').map_or((name, None), |(front, place)| (front, Some(place)));
        let (kind, which) = front.split_once('#').map_or((front, None), |(kind, which)| (kind, Some(which)));
        Self { kind, which, place }
    }
}

/// From 0, out of a number that counts from 1.
fn number(which: Option<&str>) -> anyhow::Result<Option<u8>> {
    let Some(text) = which else { return Ok(None) };
    match text.parse::<u8>() {
        Ok(number @ 1..) => Ok(Some(number - 1)),
        _ => bail!("devices are counted from 1, such as force-dimension#2, and `{text}` is no such number"),
    }
}

/// For a recording's header: what the device said of itself.
pub(crate) fn recorded(notes: &[String], into: &mut Table) {
    if !notes.is_empty() {
        into.insert("device".into(), notes.to_vec().into());
    }
}

fn refused(name: &str) -> String {
    format!("the device `{name}` cannot be used; `palpus devices` says what mends it")
}

fn library(place: Option<&str>) -> Place {
    place.map_or(Place::Usual, |file| Place::File(file.into()))
}

/// Who names a service may name one on another machine.
fn haply(which: Option<&str>, place: Option<&str>, real_time: bool) -> HaplyOptions {
    let above = |priority: u8| priority + 1;
    HaplyOptions {
        address: place.unwrap_or(HAPLY_ADDRESS).to_owned(),
        beyond_loopback: place.is_some(),
        arm: which.map(str::to_owned),
        priority: RealTimeOptions::default().priority.filter(|_| real_time).map(above),
    }
}

/// Says what a device can do, if that is less than six driven axes.
pub(crate) fn not_felt(spec: &DeviceSpec) -> Option<String> {
    match (spec.force_max > 0.0, spec.actuated.rotation, spec.sensed.rotation) {
        (false, ..) => Some(format!("{} gives no force: contacts are found and counted, not felt", spec.name)),
        (true, _, 0) => Some(format!("{} does not sense rotation: the probe keeps its own", spec.name)),
        (true, 0, _) => Some(format!("{} does not drive rotation: torques are not felt", spec.name)),
        _ => None,
    }
}

fn page(findings: &[Finding]) -> Vec<String> {
    let mut lines = wrapped(&opening(findings), WIDTH);
    lines.extend([String::new(), "READY TO USE".to_owned()]);
    for finding in findings {
        if let FindingState::Found { device, spec, rate_hz, note } = &finding.state {
            lines.push(String::new());
            lines.push(title(finding));
            found(&mut lines, device, spec, *rate_hz, note);
        }
    }
    if findings.iter().any(|finding| !finding.is_found()) {
        lines.extend([String::new(), "IF YOU HAVE ONE OF THESE".to_owned()]);
    }
    for finding in findings {
        if let FindingState::Missing { looked_for, why, mend } = &finding.state {
            lines.push(String::new());
            lines.push(title(finding));
            missing(&mut lines, finding.backend, (looked_for, why), mend);
        }
    }
    lines.push(String::new());
    lines.extend(wrapped("More: docs/devices.md (how each was tested, two of a kind, where limits come from); `palpus run --device DEVICE --limits` prints safety thresholds with their reasons; `palpus doctor` tells whether this machine keeps the pace.", WIDTH));
    lines
}

/// In a sentence: what there is, and that nothing is needed.
fn opening(findings: &[Finding]) -> String {
    let hardware = |finding: &&Finding| finding.is_found() && finding.backend != "simulated";
    match findings.iter().filter(hardware).count() {
        0 => "No haptic device answers on this machine, and none is needed: `palpus run` is held by a simulated hand.",
        1 => "A device answers on this machine.",
        _ => "Several devices answer on this machine.",
    }
    .to_owned()
}

/// What it takes to have one, first of all; then what was looked for.
fn missing(lines: &mut Vec<String>, backend: &str, (looked_for, why): (&str, &str), mend: &str) {
    if is_command(mend) {
        // On a line of its own, to be copied.
        entry(lines, "do this", "in a shell:");
        lines.push(format!("    {mend}"));
    } else {
        entry(lines, "do this", mend);
    }
    entry(lines, "then", &format!("palpus run --device {backend}"));
    entry(lines, "looked for", &format!("{looked_for}; {why}"));
}

/// As the name of a section.
fn title(finding: &Finding) -> String {
    let Finding { backend, name, .. } = finding;
    if name == backend { format!("  {name}") } else { format!("  {name} ({backend})") }
}

fn is_command(mend: &str) -> bool {
    mend.contains("sudo ")
}

fn found(lines: &mut Vec<String>, device: &str, spec: &DeviceSpec, rate_hz: f64, note: &str) {
    entry(lines, "use it", &format!("palpus run --device {device}"));
    entry(lines, "limits", &limits(spec));
    entry(lines, "axes", &axes(spec));
    if let Some(sides) = spec.workspace.map(|sides| sides * 1e3) {
        entry(lines, "reach", &format!("{:.0} × {:.0} × {:.0} mm", sides.x, sides.y, sides.z));
    }
    let delay =
        if spec.delay > 0.0 { format!("; a force acts {:.1} ms late", spec.delay * 1e3) } else { String::new() };
    entry(lines, "rate", &format!("{rate_hz:.0} Hz{delay}"));
    entry(lines, "safety", &safety(spec, rate_hz));
    if !note.is_empty() {
        entry(lines, "note", note);
    }
}

fn limits(spec: &DeviceSpec) -> String {
    let one = |max: f64, continuous: Option<f64>, unit: &str| match (max > 0.0, continuous) {
        (false, _) => None,
        (true, Some(continuous)) if continuous < max => Some(format!("{max} {unit} ({continuous} {unit} for ever)")),
        (true, _) => Some(format!("{max} {unit}")),
    };
    let force = one(spec.force_max, spec.force_continuous, "N").unwrap_or_else(|| "no force".to_owned());
    let torque = one(spec.torque_max, spec.torque_continuous, "N·m").unwrap_or_else(|| "no torque".to_owned());
    format!("{force}, {torque}")
}

fn axes(spec: &DeviceSpec) -> String {
    let count = |axes: Axes| match axes {
        Axes { translation: 0, rotation: 0, gripper: 0 } => "none".to_owned(),
        Axes { translation, rotation, gripper } => {
            let gripper = if gripper > 0 { " and a gripper" } else { "" };
            format!("{translation} of translation, {rotation} of rotation{gripper}")
        }
    };
    let sensed = if spec.sensed == spec.actuated { "the same".to_owned() } else { count(spec.sensed) };
    let buttons = match spec.buttons {
        0 => String::new(),
        1 => "; a button, which asks for force".to_owned(),
        more => format!("; {more} buttons, which ask for force"),
    };
    format!("driven: {}; sensed: {sensed}{buttons}", count(spec.actuated))
}

fn safety(spec: &DeviceSpec, rate_hz: f64) -> String {
    let limits = SafetyLimits::of(spec, rate_hz);
    let motion = format!(
        "believed up to {:.1} m/s and {:.0} rad/s; a state older than {:.0} ms is none",
        limits.speed,
        limits.turn,
        limits.stale * 1e3
    );
    if limits.force_peak <= 0.0 {
        return motion;
    }
    let torque = if limits.torque_peak > 0.0 {
        format!(" and {:.3} N·m, {:.0} N·m/s", limits.torque_peak, limits.torque_slew)
    } else {
        String::new()
    };
    format!(
        "at most {:.1} N, {:.0} N/s{torque}; {:.1} N for ever; held for {:.0} ms at most; {motion}",
        limits.force_peak,
        limits.force_slew,
        limits.force_continuous,
        limits.stall * 1e3
    )
}

/// A named line, wrapped behind its name.
fn entry(lines: &mut Vec<String>, name: &str, text: &str) {
    for (k, part) in wrapped(text, WIDTH - MARGIN - 4).into_iter().enumerate() {
        lines.push(format!("  {:>MARGIN$}  {part}", if k == 0 { name } else { "" }));
    }
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

fn document(findings: &[Finding]) -> Value {
    let mut found = Vec::new();
    let mut missing = Vec::new();
    for Finding { backend, name, state } in findings {
        match state {
            FindingState::Found { device, spec, rate_hz, note } => {
                found.push(found_document(backend, name, device, spec, *rate_hz, note));
            }
            FindingState::Missing { looked_for, why, mend } => missing
                .push(json!({ "backend": backend, "name": name, "looked_for": looked_for, "why": why, "mend": mend })),
        }
    }
    json!({ "found": found, "missing": missing })
}

fn found_document(backend: &str, name: &str, device: &str, spec: &DeviceSpec, rate_hz: f64, note: &str) -> Value {
    let axes =
        |axes: Axes| json!({ "translation": axes.translation, "rotation": axes.rotation, "gripper": axes.gripper });
    let thresholds: Map<String, Value> = SafetyLimits::of(spec, rate_hz)
        .explained()
        .iter()
        .map(|line| (line.name.to_owned(), line.value.into()))
        .collect();
    json!({
        "backend": backend,
        "name": name,
        "device": device,
        "force_max_n": spec.force_max,
        "torque_max_nm": spec.torque_max,
        "force_continuous_n": spec.force_continuous,
        "torque_continuous_nm": spec.torque_continuous,
        "driven": axes(spec.actuated),
        "sensed": axes(spec.sensed),
        "buttons": spec.buttons,
        "workspace_m": spec.workspace.map(|sides| sides.to_array()),
        "delay_s": spec.delay,
        "rate_hz": rate_hz,
        "note": note,
        "safety": thresholds,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_several_devices_can_be_named() {
        let of = |name| {
            let Wanted { kind, which, place } = Wanted::of(name);
            (kind, which, place)
        };
        assert_eq!(of("haply"), ("haply", None, None));
        assert_eq!(of("haply#049D:ws://localhost:10001"), ("haply", Some("049D"), Some("ws://localhost:10001")));
        assert_eq!(of("force-dimension#2"), ("force-dimension", Some("2"), None));
        assert_eq!(of("openhaptics:/a#b/libHD.so"), ("openhaptics", None, Some("/a#b/libHD.so")));
        assert_eq!(of("openhaptics#Right Device"), ("openhaptics", Some("Right Device"), None));
        assert_eq!((number(None).unwrap(), number(Some("2")).unwrap()), (None, Some(1)));
        assert!(number(Some("0")).is_err() && number(Some("x")).is_err());
    }

    #[test]
    fn long_lines_are_wrapped_and_lose_nothing() {
        let text = "one two  three four five";
        let lines = wrapped(text, 9);
        assert_eq!(lines, ["one two", "three", "four five"]);
        assert_eq!(wrapped("", 9), [""]);
    }

    #[test]
    fn who_has_no_device_is_told_that_none_is_needed() {
        let simulated = palpus_device::look().into_iter().filter(|finding| finding.backend == "simulated");
        let page = page(&simulated.collect::<Vec<_>>()).join("\n");
        assert!(page.starts_with("No haptic device answers") && page.contains("palpus run --device sim"), "{page}");
        assert!(!page.contains("IF YOU HAVE"), "{page}");
    }

    #[test]
    fn a_command_that_mends_stands_on_one_line() {
        let mend = "echo something long | sudo tee /a/file && ".repeat(4);
        let page = page(&[Finding::missing("backend", "some arm", "its library", "it is not there", mend.trim())]);
        assert!(page.iter().any(|line| line.trim() == mend.trim()));
        assert!(page.iter().any(|line| line == "  some arm (backend)"));
    }

    #[test]
    fn the_page_fits_a_narrow_terminal() {
        for line in page(&palpus_device::look()) {
            assert!(line.chars().count() <= WIDTH || is_command(&line), "{line}");
        }
    }

    #[test]
    fn a_found_device_says_all_that_it_is_asked_for() {
        let spec = palpus_device::known_device("Touch X").unwrap();
        let finding = Finding::found("openhaptics", "openhaptics", spec, 1000.0, "");
        let page = page(std::slice::from_ref(&finding)).join("\n");
        for part in
            ["palpus run --device openhaptics", "7.9 N (1.75 N for ever)", "no torque", "160 × 120 × 120 mm", "1000 Hz"]
        {
            assert!(page.contains(part), "{part} is not in:\n{page}");
        }
        let document = document(&[finding]);
        assert_eq!(document["found"][0]["safety"]["force_peak"], 7.9);
        assert_eq!(document["missing"], json!([]));
    }
}
