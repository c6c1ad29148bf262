//! Hands by their impedance, and what they intend.

use palpus::algebra::Pose;

/// Pose of the grip that a hand intends.
pub trait Intent {
    /// The intended pose at `time` (s) in the device's frame: a pure function of time, until the
    /// next tick begins.
    fn pose(&self, time: f64) -> Pose;

    /// A tick begins at `time`, with the grip at this pose: what the hand intends may change now.
    fn begin(&mut self, _time: f64, _grip: &Pose) {}
}

impl<F: Fn(f64) -> Pose> Intent for F {
    fn pose(&self, time: f64) -> Pose {
        self(time)
    }
}

/// A hand that holds the device: its mass, and a spring–damper to its intended pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandImpedance {
    /// kg, moving with the device.
    pub mass: f64,
    /// N·s/m, against motion relative to the intended one.
    pub damping: f64,
    /// N/m, towards the intended position.
    pub stiffness: f64,
    /// kg·m², the same about every axis.
    pub inertia: f64,
    /// N·m·s/rad.
    pub angular_damping: f64,
    /// N·m/rad.
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
    /// As tight as a person holds.
    pub const TIGHT: Self = Self {
        mass: 1.2,
        damping: 30.0,
        stiffness: 900.0,
        inertia: 1e-3,
        angular_damping: 0.08,
        angular_stiffness: 5.0,
    };
    /// No hand holds the device. This is the worst case for stability: only the device's own
    /// inertia and friction remain. The intended pose is where it is released.
    pub const NONE: Self =
        Self { mass: 0.0, damping: 0.0, stiffness: 0.0, inertia: 0.0, angular_damping: 0.0, angular_stiffness: 0.0 };
}

/// The presets by name: engineering choices that span published measurements of human hands.
pub const HAND_PRESETS: [(&str, HandImpedance); 5] = [
    ("relaxed", HandImpedance::RELAXED),
    ("normal", HandImpedance::NORMAL),
    ("firm", HandImpedance::FIRM),
    ("tight", HandImpedance::TIGHT),
    ("none", HandImpedance::NONE),
];

/// The preset of that name.
pub fn hand_preset(name: &str) -> Option<HandImpedance> {
    HAND_PRESETS.iter().find(|(known, _)| *known == name).map(|&(_, hand)| hand)
}
