//! Facts of a recording's header, as names and values.

use palpus::render::{Clustering, Saturation, Settings};
use palpus_io::RecordingHeader;
use palpus_io::record::SceneSource;
use toml::Value;

use crate::numbers::said;

type Facts = Vec<(String, String)>;

fn fact(name: &str, value: impl Into<String>) -> (String, String) {
    (name.to_owned(), value.into())
}

/// Returns scene, device and version.
pub(super) fn of_header(header: &RecordingHeader) -> Facts {
    let scene = &header.scene;
    let source = match &scene.source {
        SceneSource::BuiltIn(name) => format!("{name} (built in)"),
        SceneSource::File(path) => file_name(path).to_owned(),
    };
    vec![
        fact("scene", source),
        fact("device", header.device.clone()),
        fact("rate", format!("{} Hz", said(header.rate_hz, 4))),
        fact("probe", format!("{}, content {}", file_name(&scene.probe.mesh), scene.probe.content)),
        fact("environment", format!("{}, content {}", file_name(&scene.environment.mesh), scene.environment.content)),
        fact("unit of the mesh files", format!("{} m", said(scene.metres_per_unit, 6))),
        fact("seed", header.seed.to_string()),
        fact("recorded by", format!("palpus {}", header.palpus_version)),
        fact("recorded at", header.start_utc.clone().unwrap_or_else(|| "not said".to_owned())),
    ]
}

/// Returns the scene's name for the title of the page.
pub(super) fn name(header: &RecordingHeader) -> &str {
    match &header.scene.source {
        SceneSource::BuiltIn(name) => name,
        SceneSource::File(path) => file_name(path),
    }
}

/// Returns the name without folders, for privacy. Recordings may come from systems with other
/// separators.
fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Returns the engine's settings.
pub(super) fn of_settings(settings: &Settings) -> Facts {
    let millimetres = |metres: f64| format!("{} mm", said(metres * 1e3, 4));
    let degrees = |radians: f64| format!("{}°", said(radians.to_degrees(), 4));
    let none = || "none".to_owned();
    let grip = settings.grip_a * 1e3;
    let mut facts = vec![
        fact("contact tolerance", millimetres(settings.contact_tolerance)),
        fact("cluster radius", millimetres(settings.cluster_radius)),
        fact(
            "clustering",
            match settings.clustering {
                Clustering::Linkage => "exact linkage (the paper's)",
                Clustering::Smooth => "smooth",
            },
        ),
        fact("clusters are split beyond", settings.split_angle.map_or_else(none, degrees)),
        fact("contact stiffness", format!("{} N/m", said(settings.stiffness, 4))),
        fact("contact damping", format!("{} N·s/m", said(settings.damping, 4))),
        fact("faces are flush up to", settings.patch_angle.map_or_else(none, degrees)),
        fact(
            "force shading",
            settings.shading.map_or_else(none, |shading| {
                format!(
                    "creases from {}, turns by at most {}",
                    degrees(shading.crease_angle),
                    degrees(shading.most_turn)
                )
            }),
        ),
        fact(
            "friction",
            settings.friction.map_or_else(none, |friction| {
                format!(
                    "static {}, dynamic {}, {} N/m",
                    said(friction.static_coefficient, 3),
                    said(friction.dynamic_coefficient, 3),
                    said(friction.tangential_stiffness, 4)
                )
            }),
        ),
    ];
    facts.push(fact(
        "virtual coupling",
        settings.coupling.map_or_else(
            || "none: direct rendering (the paper's)".to_owned(),
            |coupling| {
                format!(
                    "{} N/m, {} N·s/m, {} N·m/rad, {} N·m·s/rad, contact offset {}, tool of {} g",
                    said(coupling.stiffness, 4),
                    said(coupling.damping, 3),
                    said(coupling.angular_stiffness, 3),
                    said(coupling.angular_damping, 3),
                    millimetres(coupling.contact_offset),
                    said(coupling.mass * 1e3, 3)
                )
            },
        ),
    ));
    facts.extend([
        fact(
            "device's limits",
            format!("{} N, {} mN·m", said(settings.limits.force, 3), said(settings.limits.torque * 1e3, 3)),
        ),
        fact(
            "kept by",
            match settings.saturation {
                Saturation::Separate => "separate factors for force and torque",
                Saturation::Joint => "one factor for force and torque",
                Saturation::UnderActuated => "without torque, because the device drives three axes",
            },
        ),
        fact(
            "grip, in the probe's frame",
            format!("{} / {} / {} mm", said(grip.x, 4), said(grip.y, 4), said(grip.z, 4)),
        ),
        fact("room for contacts", settings.capacity.to_string()),
        fact(
            "time budget of a step",
            settings.time_budget.map_or_else(|| "none".to_owned(), |ns| format!("{} µs", said(ns as f64 / 1e3, 4))),
        ),
    ]);
    facts
}

/// Lists the settings that differ, by name: old and new value.
pub(super) fn changed(before: &Settings, after: &Settings) -> String {
    let pairs = of_settings(before).into_iter().zip(of_settings(after));
    let each = pairs.filter(|(then, now)| then != now).map(|(then, now)| format!("{}: {} → {}", then.0, then.1, now.1));
    each.collect::<Vec<_>>().join("; ")
}

/// Returns all other parameters of the run, by dotted names.
pub(super) fn of_more(table: &toml::Table) -> Facts {
    let mut facts = Vec::new();
    flatten("", table, &mut facts);
    facts
}

fn flatten(prefix: &str, table: &toml::Table, facts: &mut Facts) {
    for (name, value) in table {
        let name = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        match value {
            Value::Table(inner) => flatten(&name, inner, facts),
            Value::String(text) => facts.push((name, text.clone())),
            Value::Float(number) => facts.push((name, said(*number, 5))),
            other => facts.push((name, other.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_changed_settings_are_listed() {
        let before = Settings::default();
        let after = Settings { stiffness: 1200.0, ..before };
        assert_eq!(changed(&before, &after), "contact stiffness: 800 N/m → 1200 N/m");
        assert_eq!(changed(&before, &before), "");
    }

    #[test]
    fn tables_within_tables_have_dotted_names() {
        let table: toml::Table = toml::from_str("a = 1\n[b]\nc = \"<x>\"\n[b.d]\ne = true").unwrap();
        let facts = of_more(&table);
        assert_eq!(facts, [fact("a", "1"), fact("b.c", "<x>"), fact("b.d.e", "true")]);
    }
}
