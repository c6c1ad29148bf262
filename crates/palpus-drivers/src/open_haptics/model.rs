//! Capabilities of the maker's devices.

use std::borrow::Cow;

use glam::DVec3;
use palpus_device::{Axes, DeviceSpec, known_devices};

use super::{BUTTONS, DELAY, MILLI, forget_errors, number};
use crate::ffi::hd::Hd;

/// Returns the description of the device, within the known limits of its model.
pub(super) fn spec(api: &Hd) -> DeviceSpec {
    let model = api.string(number::MODEL);
    let six = api.integer(number::OUTPUT_DOF) >= 6;
    let mut spec = known_model(&model, six);
    let stated = |parameter: u32| Some(api.doubles::<1>(parameter)[0]).filter(|v| v.is_finite() && *v > 0.0);
    let least = |known: f64, stated: Option<f64>| stated.map_or(known, |stated| known.min(stated));
    spec.force_max = least(spec.force_max, stated(number::MAX_FORCE));
    let continuous = stated(number::CONTINUOUS_FORCE).or(spec.force_continuous);
    spec.force_continuous = continuous.map(|force| force.min(spec.force_max));
    if six {
        spec.torque_max = least(spec.torque_max, stated(number::MAX_TORQUE).map(|torque| torque * MILLI));
        spec.torque_continuous = stated(number::CONTINUOUS_TORQUE).map(|torque| (torque * MILLI).min(spec.torque_max));
    }
    let [x0, y0, z0, x1, y1, z1] = api.doubles::<6>(number::USABLE_WORKSPACE);
    let sides = crate::axes::Axes::OpenHaptics.ours(DVec3::new(x1 - x0, y1 - y0, z1 - z0)).abs() * MILLI;
    if sides.is_finite() && sides.min_element() > 0.0 {
        spec.workspace = Some(sides);
    }
    // Older drivers do not know all of these parameters.
    forget_errors(api);
    spec
}

/// Returns the known limits of a model. `model` is its name in the driver.
fn known_model(model: &str, six: bool) -> DeviceSpec {
    let lower = model.to_lowercase();
    let has = |part: &str| lower.contains(part);
    let name = if has("premium") && has("3.0") {
        "Phantom Premium 3.0/6DOF"
    } else if has("premium") {
        "Phantom Premium 1.5/6DOF"
    } else if has("touch x") || has("desktop") {
        "Touch X"
    } else {
        "Touch"
    };
    // The list contains all of these names.
    let known = known_devices().into_iter().find(|known| known.name == name);
    let mut spec = known.unwrap_or_else(|| known_devices()[0].clone());
    if !six {
        spec.torque_max = 0.0;
        spec.actuated = Axes::TRANSLATION;
    }
    if !model.is_empty() && !has("touch") && !has("premium") {
        // An unknown model keeps its name and gets the limits of the weakest model.
        spec.name = Cow::Owned(model.to_owned());
    }
    spec.buttons = BUTTONS;
    spec.delay = DELAY;
    spec
}
