//! The sliders: their units, their ranges, and settings that change together.
//!
//! The ranges follow from the settings that fit the device. A coupling is stable up to about twice
//! the stiffness that palpus chooses (see [`palpus::render::VirtualCoupling`]). Without a coupling,
//! the contact stiffness has this limit instead. The sliders end at this limit. Behind a coupling
//! the contact stiffness is not felt and may be much larger.

use palpus::render::Settings;

use super::run::Preset;

/// A number among the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Stiffness,
    Tolerance,
    Radius,
    StaticFriction,
    DynamicFriction,
    Crease,
    CouplingStiffness,
    CouplingDamping,
    TurningStiffness,
    TurningDamping,
}

/// The slider's range, in shown units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) logarithmic: bool,
}

/// Settings that fit the device, with and without a coupling, from which ranges and switches start.
#[derive(Clone, Debug)]
pub(super) struct Fitting {
    pub(super) coupled: Option<Settings>,
    pub(super) direct: Settings,
}

/// Sliders end at this multiple of the fitting value.
const QUIET: f64 = 2.0;
/// The sliders of a coupling's stiffness begin at this multiple of the fitting value.
const LOOSEST: f64 = 0.05;
/// The slider of the contact stiffness behind a coupling begins at this multiple.
const SOFTEST: f64 = 0.02;
/// The slider of the tolerance begins at this multiple.
const FINEST: f64 = 0.1;
/// The sliders of the tolerance and of the cluster radius end at this multiple.
const COARSEST: f64 = 5.0;
/// Range of the contact stiffness without a coupling, N/m.
const SOFTEST_DIRECT: f64 = 50.0;
/// Largest coefficient of friction: rubber on dry stone has about 1.
const MOST_FRICTION: f64 = 1.5;
/// Largest crease angle, degrees: above it, no edge is a crease.
const MOST_CREASE: f64 = 90.0;
/// Step of a key press: a share of the range, or a factor for logarithmic ranges.
const KEY_PART: f64 = 0.05;
const KEY_FACTOR: f64 = 1.1;

impl Fitting {
    /// Returns the settings of the first preset of each kind; without presets, `now`.
    pub(super) fn of(presets: &[Preset], now: &Settings) -> Self {
        let all = || presets.iter().map(|preset| preset.settings).chain([*now]);
        let direct = all().find(|settings| settings.coupling.is_none());
        Self {
            coupled: all().find(|settings| settings.coupling.is_some()),
            direct: direct.unwrap_or(Settings { coupling: None, stiffness: Settings::default().stiffness, ..*now }),
        }
    }

    /// Returns settings with the other mode and its contact stiffness; `None` if no coupling is
    /// possible.
    pub(super) fn switched(&self, now: &Settings) -> Option<Settings> {
        let other = if now.coupling.is_some() { self.direct } else { self.coupled? };
        let mut switched = Settings { coupling: other.coupling, ..*now };
        set_stiffness(&mut switched, other.stiffness);
        if let Some(coupling) = &mut switched.coupling {
            coupling.contact_offset = coupling.contact_offset.min(switched.contact_tolerance);
        }
        Some(switched)
    }
}

impl Quantity {
    /// All quantities in the order of the panel.
    pub(super) const ALL: [Self; 10] = [
        Self::Stiffness,
        Self::Tolerance,
        Self::Radius,
        Self::StaticFriction,
        Self::DynamicFriction,
        Self::Crease,
        Self::CouplingStiffness,
        Self::CouplingDamping,
        Self::TurningStiffness,
        Self::TurningDamping,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Tolerance => "tolerance",
            Self::Radius => "cluster radius",
            Self::StaticFriction => "friction, rest",
            Self::DynamicFriction => "friction, slide",
            Self::Crease => "crease angle",
            Self::CouplingStiffness => "coupling",
            Self::CouplingDamping => "damping",
            Self::TurningStiffness => "rot. stiffness",
            Self::TurningDamping => "rot. damping",
        }
    }

    /// Explains the quantity in one sentence.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Stiffness => "force of a contact for each metre of depth",
            Self::Tolerance => "contacts exist where the surfaces are closer than this",
            Self::Radius => "contacts nearer to each other than this share a force, with linkage clustering",
            Self::StaticFriction => "friction coefficient of a contact that holds",
            Self::DynamicFriction => "friction coefficient of a contact that slides",
            Self::Crease => "edges with a smaller angle between their faces' normals feel smooth",
            Self::CouplingStiffness => "the spring between the device and the tool",
            Self::CouplingDamping => "the damper between the device and the tool",
            Self::TurningStiffness => "the spring against rotation between the device and the tool",
            Self::TurningDamping => "the damper against rotation between the device and the tool",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Stiffness | Self::CouplingStiffness => " N/m",
            Self::Tolerance | Self::Radius => " mm",
            Self::StaticFriction | Self::DynamicFriction => "",
            Self::Crease => "°",
            Self::CouplingDamping => " N·s/m",
            Self::TurningStiffness => " N·m/rad",
            Self::TurningDamping => " mN·m·s",
        }
    }

    /// Returns the value in its unit; `None` if the quantity does not apply.
    pub(super) fn get(self, settings: &Settings) -> Option<f64> {
        let (friction, coupling) = (settings.friction, settings.coupling);
        match self {
            Self::Stiffness => Some(settings.stiffness),
            Self::Tolerance => Some(settings.contact_tolerance * 1e3),
            Self::Radius => Some(settings.cluster_radius * 1e3),
            Self::StaticFriction => friction.map(|f| f.static_coefficient),
            Self::DynamicFriction => friction.map(|f| f.dynamic_coefficient),
            Self::Crease => settings.shading.map(|s| s.crease_angle.to_degrees()),
            Self::CouplingStiffness => coupling.map(|c| c.stiffness),
            Self::CouplingDamping => coupling.map(|c| c.damping),
            Self::TurningStiffness => coupling.map(|c| c.angular_stiffness),
            Self::TurningDamping => coupling.map(|c| c.angular_damping * 1e3),
        }
    }

    /// Sets the value and the settings that depend on it; does nothing if the quantity does not
    /// apply.
    pub(super) fn set(self, settings: &mut Settings, value: f64) {
        match self {
            Self::Stiffness => set_stiffness(settings, value),
            Self::Tolerance => set_tolerance(settings, value * 1e-3),
            Self::Radius => settings.cluster_radius = value * 1e-3,
            Self::Crease => {
                if let Some(shading) = &mut settings.shading {
                    shading.crease_angle = value.to_radians();
                }
            }
            Self::StaticFriction | Self::DynamicFriction => {
                let Some(friction) = &mut settings.friction else { return };
                // Dynamic friction is at most static friction.
                if self == Self::StaticFriction {
                    friction.static_coefficient = value;
                    friction.dynamic_coefficient = friction.dynamic_coefficient.min(value);
                } else {
                    friction.dynamic_coefficient = value;
                    friction.static_coefficient = friction.static_coefficient.max(value);
                }
            }
            Self::CouplingStiffness | Self::CouplingDamping | Self::TurningStiffness | Self::TurningDamping => {
                let Some(coupling) = &mut settings.coupling else { return };
                match self {
                    Self::CouplingStiffness => coupling.stiffness = value,
                    Self::CouplingDamping => coupling.damping = value,
                    Self::TurningStiffness => coupling.angular_stiffness = value,
                    _ => coupling.angular_damping = value * 1e-3,
                }
            }
        }
    }

    /// Returns the range on this device; it always includes `now`.
    pub(super) fn range(self, fitting: &Fitting, now: &Settings) -> Range {
        let logarithmic = |low, high| Range { low, high, logarithmic: true };
        let linear = |high| Range { low: 0.0, high, logarithmic: false };
        let coupled = fitting.coupled.as_ref().unwrap_or(now);
        let fits = self.get(coupled).unwrap_or(1.0);
        let range = match self {
            Self::Stiffness if now.coupling.is_some() => logarithmic(SOFTEST * fits, QUIET * fits),
            Self::Stiffness => {
                let of_device = coupled.coupling.map_or(0.0, |coupling| coupling.stiffness);
                logarithmic(SOFTEST_DIRECT, QUIET * of_device.max(fitting.direct.stiffness))
            }
            Self::Tolerance => logarithmic(FINEST * fits, COARSEST * fits),
            Self::Radius => linear(COARSEST * fits.max(1.0)),
            Self::StaticFriction | Self::DynamicFriction => linear(MOST_FRICTION),
            Self::Crease => linear(MOST_CREASE),
            Self::CouplingStiffness | Self::TurningStiffness => logarithmic(LOOSEST * fits, QUIET * fits),
            Self::CouplingDamping | Self::TurningDamping => linear(QUIET * fits),
        };
        match self.get(now) {
            Some(value) => Range { low: range.low.min(value), high: range.high.max(value), ..range },
            None => range,
        }
    }
}

impl Range {
    /// Returns the value after one key press.
    pub(super) fn pressed(&self, value: f64, more: bool) -> f64 {
        let goes_to = match (self.logarithmic, more) {
            (true, true) => value * KEY_FACTOR,
            (true, false) => value / KEY_FACTOR,
            (false, true) => value + KEY_PART * (self.high - self.low),
            (false, false) => value - KEY_PART * (self.high - self.low),
        };
        goes_to.clamp(self.low, self.high)
    }
}

/// Sets the contact stiffness and keeps the ratio of tangential to normal stiffness.
fn set_stiffness(settings: &mut Settings, stiffness: f64) {
    if let Some(friction) = &mut settings.friction {
        friction.tangential_stiffness *= stiffness / settings.stiffness;
    }
    settings.stiffness = stiffness;
}

/// Sets the tolerance. With a coupling, contacts push from a share of the tolerance on, with a
/// stiffness that reaches the device's largest force within this distance. The distance and the
/// stiffness therefore change with the tolerance.
fn set_tolerance(settings: &mut Settings, tolerance: f64) {
    let times = tolerance / settings.contact_tolerance;
    if let Some(coupling) = &mut settings.coupling {
        coupling.contact_offset = (coupling.contact_offset * times).min(tolerance);
        set_stiffness(settings, settings.stiffness / times);
    }
    settings.contact_tolerance = tolerance;
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus::force::{FrictionSettings, ShadingSettings};
    use palpus::render::VirtualCoupling;

    fn all_enabled() -> Settings {
        let coupling = VirtualCoupling {
            stiffness: 1000.0,
            damping: 3.0,
            angular_stiffness: 0.9,
            angular_damping: 3e-3,
            contact_offset: 1e-4,
            mass: 0.01,
        };
        Settings {
            stiffness: 170e3,
            shading: Some(ShadingSettings { crease_angle: 0.7, most_turn: 0.7 }),
            friction: Some(FrictionSettings {
                static_coefficient: 0.4,
                dynamic_coefficient: 0.3,
                tangential_stiffness: 170e3,
            }),
            coupling: Some(coupling),
            ..Settings::default()
        }
    }

    #[test]
    fn slider_ends_are_valid_and_read_back() {
        let coupled = all_enabled();
        let presets = [
            Preset { name: "palpus", settings: coupled },
            Preset { name: "the paper", settings: Settings { coupling: None, stiffness: 800.0, ..coupled } },
        ];
        let fitting = Fitting::of(&presets, &coupled);
        for preset in &presets {
            for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.get(&preset.settings).is_some()) {
                let range = quantity.range(&fitting, &preset.settings);
                for value in [range.low, range.high] {
                    let mut settings = preset.settings;
                    quantity.set(&mut settings, value);
                    assert_eq!(settings.validate(), Ok(()), "{quantity:?} {value}");
                    let read = quantity.get(&settings).expect("the quantity applies");
                    assert!((read - value).abs() < 1e-9 * value.max(1.0), "{quantity:?} {read} {value}");
                }
            }
        }
    }

    #[test]
    fn mode_sets_its_own_stiffness() {
        let coupled = all_enabled();
        let paper = Settings { coupling: None, stiffness: 800.0, friction: None, ..coupled };
        let presets = [Preset { name: "palpus", settings: coupled }, Preset { name: "the paper", settings: paper }];
        let fitting = Fitting::of(&presets, &coupled);
        let direct = fitting.switched(&coupled).expect("the mode can be switched");
        assert!(direct.coupling.is_none() && (direct.stiffness - 800.0).abs() < 1e-9);
        assert!(direct.friction.is_some_and(|friction| (friction.tangential_stiffness - 800.0).abs() < 1e-9));
        let back = fitting.switched(&direct).expect("the mode can be switched");
        assert!(back.coupling == coupled.coupling && (back.stiffness - coupled.stiffness).abs() < 1e-6);
    }
}
