//! Impedances of hands, and the intended pose of a simulated operator.

use palpus::algebra::Pose;

/// Intended pose of a simulated operator.
pub trait Intent {
    /// Returns the intended pose of the grip at `time` (s), in the device's frame. Within a tick,
    /// the pose must be a pure function of time.
    fn pose(&self, time: f64) -> Pose;

    /// Updates the intent at the beginning of a tick, at `time` (s) with the grip at `_grip`. The
    /// intent may change only here.
    fn begin(&mut self, _time: f64, _grip: &Pose) {}
}

impl<F: Fn(f64) -> Pose> Intent for F {
    fn pose(&self, time: f64) -> Pose {
        self(time)
    }
}

/// Impedance of a hand that holds the device: its mass, and a spring–damper to the intended pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandImpedance {
    /// Mass that moves with the device, kg.
    pub mass: f64,
    /// Damping relative to the motion of the intended pose, N·s/m.
    pub damping: f64,
    /// Stiffness towards the intended position, N/m.
    pub stiffness: f64,
    /// Inertia, kg·m², the same about every axis.
    pub inertia: f64,
    /// Angular damping relative to the motion of the intended pose, N·m·s/rad.
    pub angular_damping: f64,
    /// Angular stiffness towards the intended orientation, N·m/rad.
    pub angular_stiffness: f64,
}

impl HandImpedance {
    /// Two fingers on a stylus.
    pub const RELAXED: Self = Self {
        mass: 0.10,
        damping: 2.0,
        stiffness: 50.0,
        inertia: 2e-5,
        angular_damping: 0.002,
        angular_stiffness: 0.15,
    };
    /// An ordinary grip.
    pub const NORMAL: Self = Self {
        mass: 0.35,
        damping: 6.0,
        stiffness: 150.0,
        inertia: 1e-4,
        angular_damping: 0.010,
        angular_stiffness: 0.6,
    };
    /// A firm grip.
    pub const FIRM: Self = Self {
        mass: 0.60,
        damping: 15.0,
        stiffness: 450.0,
        inertia: 3e-4,
        angular_damping: 0.030,
        angular_stiffness: 2.0,
    };
    /// The tightest grip of a person.
    pub const TIGHT: Self = Self {
        mass: 1.2,
        damping: 30.0,
        stiffness: 900.0,
        inertia: 1e-3,
        angular_damping: 0.08,
        angular_stiffness: 5.0,
    };
    /// No hand holds the device. Without a hand, stability is worst: only the device's own inertia
    /// and friction remain. The intended pose is only the start pose.
    pub const NONE: Self =
        Self { mass: 0.0, damping: 0.0, stiffness: 0.0, inertia: 0.0, angular_damping: 0.0, angular_stiffness: 0.0 };
}

/// Hand impedances by name. The values are engineering choices that span published measurements of
/// human hands.
pub const HAND_PRESETS: [(&str, HandImpedance); 5] = [
    ("relaxed", HandImpedance::RELAXED),
    ("normal", HandImpedance::NORMAL),
    ("firm", HandImpedance::FIRM),
    ("tight", HandImpedance::TIGHT),
    ("none", HandImpedance::NONE),
];

/// Returns the preset called `name`; `None` if the name is unknown.
pub fn hand_preset(name: &str) -> Option<HandImpedance> {
    HAND_PRESETS.iter().find(|(known, _)| *known == name).map(|&(_, hand)| hand)
}
