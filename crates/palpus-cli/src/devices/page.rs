//! Output of `palpus devices`: a page for people, a document for programs.

use palpus_device::{Axes, DeviceSpec, Finding, FindingState, SafetyLimits};
use serde_json::{Map, Value, json};

/// Width of the page in columns: the narrowest common terminal has this width.
const WIDTH: usize = 80;
/// Width of the names of lines, in columns.
const MARGIN: usize = 14;

pub(super) fn page(findings: &[Finding]) -> Vec<String> {
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
    lines.extend(wrapped("More: docs/devices.md (tests of each device, several devices of one kind, sources of the limits); `palpus run --device DEVICE --limits` prints safety thresholds with their reasons; `palpus doctor` shows whether this machine holds the rate.", WIDTH));
    lines
}

/// Returns the opening sentence: which devices were found, and that palpus works without one.
fn opening(findings: &[Finding]) -> String {
    let hardware = |finding: &&Finding| finding.is_found() && finding.backend != "simulated";
    match findings.iter().filter(hardware).count() {
        0 => {
            "No haptic device was found on this machine. palpus works without one: `palpus run` uses a simulated hand."
        }
        1 => "A device was found on this machine.",
        _ => "Several devices were found on this machine.",
    }
    .to_owned()
}

/// Lists the requirements of a device, and the places that were searched.
fn missing(lines: &mut Vec<String>, backend: &str, (looked_for, why): (&str, &str), mend: &str) {
    if is_command(mend) {
        // The command is on its own line, so that it can be copied.
        entry(lines, "do this", "in a shell:");
        lines.push(format!("    {mend}"));
    } else {
        entry(lines, "do this", mend);
    }
    entry(lines, "then", &format!("palpus run --device {backend}"));
    entry(lines, "looked for", &format!("{looked_for}; {why}"));
}

/// Returns the title of a section: the name of the device.
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
        (true, Some(continuous)) if continuous < max => {
            Some(format!("{max} {unit} ({continuous} {unit} continuously)"))
        }
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
        1 => "; a button, which enables the force".to_owned(),
        more => format!("; {more} buttons, which enable the force"),
    };
    format!("driven: {}; sensed: {sensed}{buttons}", count(spec.actuated))
}

fn safety(spec: &DeviceSpec, rate_hz: f64) -> String {
    let limits = SafetyLimits::of(spec, rate_hz);
    let motion = format!(
        "plausible up to {:.1} m/s and {:.0} rad/s; a state older than {:.0} ms is ignored",
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
        "at most {:.1} N, {:.0} N/s{torque}; {:.1} N continuously; without a new wrench for at most {:.0} ms; {motion}",
        limits.force_peak,
        limits.force_slew,
        limits.force_continuous,
        limits.stall * 1e3
    )
}

/// Adds a named line with a hanging indent.
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

pub(super) fn document(findings: &[Finding]) -> Value {
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
    fn long_lines_are_wrapped_completely() {
        let text = "one two  three four five";
        let lines = wrapped(text, 9);
        assert_eq!(lines, ["one two", "three", "four five"]);
        assert_eq!(wrapped("", 9), [""]);
    }

    #[test]
    fn page_without_devices_offers_the_simulated_device() {
        let simulated = palpus_device::look().into_iter().filter(|finding| finding.backend == "simulated");
        let page = page(&simulated.collect::<Vec<_>>()).join("\n");
        assert!(page.starts_with("No haptic device was found") && page.contains("palpus run --device sim"), "{page}");
        assert!(!page.contains("IF YOU HAVE"), "{page}");
    }

    #[test]
    fn remedy_command_is_on_one_line() {
        let mend = "echo something long | sudo tee /a/file && ".repeat(4);
        let page = page(&[Finding::missing("backend", "some arm", "its library", "it is not there", mend.trim())]);
        assert!(page.iter().any(|line| line.trim() == mend.trim()));
        assert!(page.iter().any(|line| line == "  some arm (backend)"));
    }

    #[test]
    fn page_fits_a_narrow_terminal() {
        for line in page(&palpus_device::look()) {
            assert!(line.chars().count() <= WIDTH || is_command(&line), "{line}");
        }
    }

    #[test]
    fn found_device_lists_all_its_data() {
        let spec = palpus_device::known_device("Touch X").unwrap();
        let finding = Finding::found("openhaptics", "openhaptics", spec, 1000.0, "");
        let page = page(std::slice::from_ref(&finding)).join("\n");
        for part in [
            "palpus run --device openhaptics",
            "7.9 N (1.75 N continuously)",
            "no torque",
            "160 × 120 × 120 mm",
            "1000 Hz",
        ] {
            assert!(page.contains(part), "{part} is not in:\n{page}");
        }
        let document = document(&[finding]);
        assert_eq!(document["found"][0]["safety"]["force_peak"], 7.9);
        assert_eq!(document["missing"], json!([]));
    }
}
