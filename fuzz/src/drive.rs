//! Generates the inputs of a renderer: bodies, settings, states and a clock.

use std::cell::{Cell, OnceCell};
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Clock, Pose};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, ProbeState, Saturation, Settings, Tick, VirtualCoupling};

use crate::{Bytes, check};

/// A clock that advances in steps and never goes back.
pub struct Leaps(Cell<u64>, u64);

impl Leaps {
    /// Returns a clock that advances by `leap` ns on each call.
    pub fn of(leap: u64) -> Self {
        Self(Cell::new(0), leap)
    }
}

impl Clock for Leaps {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get().saturating_add(self.1));
        self.0.get()
    }
}

thread_local! {
    static BODIES: OnceCell<Vec<Arc<Body>>> = const { OnceCell::new() };
}

/// Returns a block, a tetrahedron, an L and a sheet, with sizes of 2 cm to 4 cm.
fn bodies() -> Vec<Arc<Body>> {
    let block: Vec<DVec3> =
        (0..8).map(|k| 0.02 * DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
    let tetrahedron = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| 0.03 * p);
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let mut l = PolygonSoup::new();
    l.vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
    l.push_face(&[5, 4, 3, 2, 1, 0]);
    l.push_face(&[6, 7, 8, 9, 10, 11]);
    (0..6).for_each(|k| l.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]));
    let sheet = PolygonSoup::from_triangles(
        [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.1 * x * y)).into(),
        &[[0, 1, 2], [0, 2, 3]],
    );
    let settings = BodySettings { scale: 0.02, ..BodySettings::default() };
    let of = |soup: &PolygonSoup| Body::from_soup(soup, &settings, &mut |_| ());
    [Body::from_convex(&block), Body::from_convex(&tetrahedron), of(&l), of(&sheet)]
        .map(|body| Arc::new(body.expect("a valid mesh")))
        .into()
}

/// Returns one of the four small bodies.
pub fn body(bytes: &mut Bytes<'_>) -> Arc<Body> {
    BODIES.with(|all| Arc::clone(&all.get_or_init(bodies)[bytes.below(4)]))
}

/// Returns a positive number: a multiple of `usual`, or any magnitude.
pub fn positive(bytes: &mut Bytes<'_>, usual: f64) -> f64 {
    match bytes.byte() {
        0..=150 => usual,
        151..=220 => bytes.between(1e-3 * usual, 1e3 * usual),
        _ => bytes.any().abs(),
    }
}

/// Returns a positive number like [`positive`], or zero.
fn not_negative(bytes: &mut Bytes<'_>, usual: f64) -> f64 {
    if bytes.byte() < 60 { 0.0 } else { positive(bytes, usual) }
}

/// Returns settings, most of which are valid.
pub fn settings(bytes: &mut Bytes<'_>) -> Settings {
    let flags = bytes.byte();
    let tolerance = positive(bytes, 1e-3);
    let coupling = (flags & 1 != 0).then(|| VirtualCoupling {
        stiffness: positive(bytes, 800.0),
        damping: not_negative(bytes, 2.0),
        angular_stiffness: positive(bytes, 2.0),
        angular_damping: not_negative(bytes, 5e-3),
        contact_offset: tolerance * bytes.between(1e-3, 1.0),
        mass: not_negative(bytes, 0.1),
    });
    let dynamic_coefficient = not_negative(bytes, 0.3);
    let friction = (flags & 2 != 0).then(|| FrictionSettings {
        static_coefficient: dynamic_coefficient + not_negative(bytes, 0.1),
        dynamic_coefficient,
        tangential_stiffness: positive(bytes, 800.0),
    });
    let shading =
        (flags & 4 != 0).then(|| ShadingSettings { crease_angle: 3.1 * bytes.share(), most_turn: 1.5 * bytes.share() });
    Settings {
        contact_tolerance: tolerance,
        cluster_radius: not_negative(bytes, 4e-3),
        clustering: if flags & 8 != 0 { Clustering::Linkage } else { Clustering::Smooth },
        split_angle: (flags & 16 != 0).then(|| 1.05 + 1.9 * bytes.share()),
        stiffness: positive(bytes, 800.0),
        damping: not_negative(bytes, 1.0),
        patch_angle: (flags & 32 != 0).then(|| 2e-3 + 0.34 * bytes.share()),
        shading,
        friction,
        coupling,
        material: None,
        limits: Limits { force: not_negative(bytes, 8.5), torque: not_negative(bytes, 0.188) },
        saturation: [Saturation::Separate, Saturation::Joint, Saturation::UnderActuated][bytes.below(3)],
        grip_a: if flags & 64 != 0 { 0.05 * bytes.point() } else { DVec3::ZERO },
        capacity: if bytes.rarely() { 1 + bytes.below(4) } else { 64 },
        time_budget: (flags & 128 != 0)
            .then(|| if bytes.rarely() { bytes.any().to_bits() } else { 1000 + u64::from(bytes.short()) }),
    }
}

/// Returns the next state after `last`: near it, anywhere, far away, or invalid.
pub fn state(bytes: &mut Bytes<'_>, last: &ProbeState) -> ProbeState {
    let kind = bytes.byte();
    let pose_ba = match kind {
        0..=99 => {
            let step = bytes.pose(2e-4);
            Pose::new(last.pose_ba.rotation, last.pose_ba.translation + step.translation)
        }
        100..=219 => bytes.pose(0.01),
        220..=239 => bytes.pose(bytes_scale(kind)),
        _ => bytes.wild_pose(),
    };
    ProbeState { pose_ba, twist: bytes.twist() }
}

/// Returns a scale: near, far, or absurdly far.
fn bytes_scale(kind: u8) -> f64 {
    10f64.powi(i32::from(kind - 220) * 3 - 12)
}

/// Returns a step length in seconds: usual, of any magnitude, or an arbitrary number.
pub fn step_length(bytes: &mut Bytes<'_>) -> f64 {
    match bytes.byte() {
        0..=200 => 1e-3,
        201..=230 => bytes.between(1e-7, 10.0),
        _ => bytes.any(),
    }
}

/// Checks the guarantees of every tick; `size` is the total size of the bodies.
pub fn check_tick(tick: &Tick, settings: &Settings, size: f64) {
    let wrench = tick.commanded;
    assert!(wrench.is_finite() && tick.computed.is_finite(), "{wrench:?} in tick {}", tick.index);
    assert!(check::within(wrench.force, settings.limits.force), "{wrench:?} of {:?}", settings.limits);
    assert!(check::within(wrench.torque, settings.limits.torque), "{wrench:?} of {:?}", settings.limits);
    // With a coupling, contacts are detected as far ahead as the tool may move in its next step.
    let within = if settings.coupling.is_some() { f64::INFINITY } else { settings.contact_tolerance };
    check::contacts(&tick.contacts, within, size + tick.tool_ba.translation.length());
    assert!(!tick.separation().is_nan());
}
