//! Description of the recorded device, for replays.

use glam::DVec3;
use palpus_device::{Axes, DeviceSpec, SafetyLimits, SimulationSettings};
use toml::{Table, Value};

/// The key of the device's spec in a recording's header.
const SECTION: &str = "device_spec";

/// Writes the device's description to a recording's header. Infinite limits are TOML's `inf`.
pub(super) fn record_spec(spec: &DeviceSpec, into: &mut Table) {
    let mut table = Table::new();
    table.insert("name".into(), spec.name.as_ref().into());
    for (name, value) in [
        ("force_max", Some(spec.force_max)),
        ("torque_max", Some(spec.torque_max)),
        ("force_continuous", spec.force_continuous),
        ("torque_continuous", spec.torque_continuous),
        ("delay", Some(spec.delay)),
        ("position_step", Some(spec.position_step)),
        ("angle_step", Some(spec.angle_step)),
    ] {
        if let Some(value) = value {
            table.insert(name.into(), value.into());
        }
    }
    for (name, axes) in [("actuated", spec.actuated), ("sensed", spec.sensed)] {
        let counts = [axes.translation, axes.rotation, axes.gripper].map(|count| Value::from(i64::from(count)));
        table.insert(name.into(), counts.to_vec().into());
    }
    table.insert("buttons".into(), i64::from(spec.buttons).into());
    if let Some(sides) = spec.workspace {
        table.insert("workspace".into(), sides.to_array().to_vec().into());
    }
    into.insert(SECTION.into(), Value::Table(table));
}

/// Returns the description of the recorded device. If the header has no description, the limits of
/// its safety chain are used, or without these the limits of the simulated device.
pub(super) fn spec_of(more: &Table) -> DeviceSpec {
    let simulated = SimulationSettings::default().spec;
    if let Some(spec) = more.get(SECTION).and_then(Value::as_table).and_then(|table| written(table, &simulated)) {
        return spec;
    }
    let chain = more.get("safety").and_then(Value::as_table);
    let limits = chain
        .and_then(|table| SafetyLimits::from_values(|name| table.get(name).and_then(Value::as_float)))
        .filter(SafetyLimits::is_valid);
    let Some(limits) = limits else { return simulated };
    DeviceSpec {
        force_max: limits.force_peak,
        torque_max: limits.torque_peak,
        force_continuous: Some(limits.force_continuous),
        torque_continuous: Some(limits.torque_continuous),
        actuated: if limits.torque_peak > 0.0 { Axes::FULL } else { Axes::TRANSLATION },
        delay: limits.delay,
        position_step: limits.position_step,
        angle_step: limits.angle_step,
        ..simulated
    }
}

/// Reads the description that [`record_spec`] wrote; `None` if the description is incomplete or not
/// valid.
fn written(table: &Table, simulated: &DeviceSpec) -> Option<DeviceSpec> {
    let number = |name: &str| table.get(name).and_then(Value::as_float).filter(|value| *value >= 0.0);
    let counts = |name: &str| -> Option<Axes> {
        let list = table.get(name)?.as_array()?;
        let count = |k: usize, most: i64| {
            list.get(k)?.as_integer().filter(|n| (0..=most).contains(n)).and_then(|n| u8::try_from(n).ok())
        };
        Some(Axes { translation: count(0, 3)?, rotation: count(1, 3)?, gripper: count(2, 1)? })
    };
    let sides = table.get("workspace").and_then(Value::as_array).map(|list| {
        let side = |k: usize| list.get(k).and_then(Value::as_float).unwrap_or(f64::NAN);
        DVec3::new(side(0), side(1), side(2))
    });
    Some(DeviceSpec {
        name: table.get("name")?.as_str()?.to_owned().into(),
        force_max: number("force_max")?,
        torque_max: number("torque_max")?,
        force_continuous: number("force_continuous"),
        torque_continuous: number("torque_continuous"),
        actuated: counts("actuated")?,
        sensed: counts("sensed")?,
        buttons: table.get("buttons")?.as_integer().and_then(|count| u8::try_from(count).ok())?,
        workspace: sides,
        delay: number("delay").unwrap_or(simulated.delay),
        // Older recordings have no encoder steps.
        position_step: number("position_step").unwrap_or(0.0),
        angle_step: number("angle_step").unwrap_or(0.0),
    })
}

#[cfg(test)]
mod tests {
    use palpus_device::known_devices;

    use super::*;

    #[test]
    fn device_is_restored_from_a_header() {
        let endless = DeviceSpec { force_max: f64::INFINITY, ..SimulationSettings::default().spec };
        for spec in known_devices().into_iter().chain([endless]) {
            let mut more = Table::new();
            record_spec(&spec, &mut more);
            let text = toml::to_string(&more).expect("the TOML is valid");
            assert_eq!(spec_of(&toml::from_str(&text).expect("the TOML is valid")), spec);
        }
    }

    #[test]
    fn header_without_device_gives_limits_or_simulated_device() {
        let simulated = SimulationSettings::default().spec;
        assert_eq!(spec_of(&Table::new()), simulated);
        let [_, _, touch, ..] = known_devices();
        let mut chain = Table::new();
        for line in SafetyLimits::of(&touch, 1000.0).explained() {
            chain.insert(line.name.into(), line.value.into());
        }
        let mut more = Table::new();
        more.insert("safety".into(), Value::Table(chain));
        let spec = spec_of(&more);
        assert!((spec.force_max - touch.force_max).abs() < 1e-12 && spec.actuated == Axes::TRANSLATION);
        // Damaged values are ignored.
        more.insert(SECTION.into(), Value::Table(Table::from_iter([("name".to_owned(), Value::from("arm"))])));
        assert_eq!(spec_of(&more), spec);
    }
}
