//! A renderer under any settings that are valid, driven with any states: the wrench that it commands is finite and within the
//! limits, in every tick.
#![no_main]

use std::cell::{Cell, OnceCell};
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Clock;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, ProbeState, Renderer, Saturation, Settings, VirtualCoupling};
use palpus_fuzz::{Allowance, Bytes, Seed, check, target};

/// A clock that goes by leaps, and never back.
struct Leaps(Cell<u64>, u64);

impl Clock for Leaps {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get().saturating_add(self.1));
        self.0.get()
    }
}

thread_local! {
    static BODIES: OnceCell<Vec<Arc<Body>>> = const { OnceCell::new() };
}

/// A block, a tetrahedron, an L, a sheet: 2 cm to 4 cm large.
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
        .map(|body| Arc::new(body.expect("a sound mesh")))
        .into()
}

/// A positive number: usual, or of any size.
fn positive(bytes: &mut Bytes<'_>, usual: f64) -> f64 {
    match bytes.byte() {
        0..=150 => usual,
        151..=220 => bytes.between(1e-3 * usual, 1e3 * usual),
        _ => bytes.any().abs(),
    }
}

/// The same, or zero.
fn not_negative(bytes: &mut Bytes<'_>, usual: f64) -> f64 {
    if bytes.byte() < 60 { 0.0 } else { positive(bytes, usual) }
}

fn settings(bytes: &mut Bytes<'_>) -> Settings {
    let flags = bytes.byte();
    let tolerance = positive(bytes, 1e-3);
    let coupling = (flags & 1 != 0).then(|| VirtualCoupling {
        stiffness: positive(bytes, 800.0),
        damping: not_negative(bytes, 2.0),
        angular_stiffness: positive(bytes, 2.0),
        angular_damping: not_negative(bytes, 5e-3),
        skin: tolerance * bytes.between(1e-3, 1.0),
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
        blend_angle: (flags & 32 != 0).then(|| 2e-3 + 0.34 * bytes.share()),
        shading,
        friction,
        coupling,
        limits: Limits { force: not_negative(bytes, 8.5), torque: not_negative(bytes, 0.188) },
        saturation: [Saturation::Separate, Saturation::Joint, Saturation::UnderActuated][bytes.below(3)],
        grip_a: if flags & 64 != 0 { 0.05 * bytes.point() } else { DVec3::ZERO },
        capacity: if bytes.rarely() { 1 + bytes.below(4) } else { 64 },
        time_budget: (flags & 128 != 0).then(|| 1000 + u64::from(bytes.short())),
    }
}

fn state(bytes: &mut Bytes<'_>, last: &ProbeState) -> ProbeState {
    let kind = bytes.byte();
    let pose_ba = match kind {
        0..=99 => {
            let step = bytes.pose(2e-4);
            palpus::algebra::Pose::new(last.pose_ba.rotation, last.pose_ba.translation + step.translation)
        }
        100..=219 => bytes.pose(0.01),
        220..=239 => bytes.pose(bytes_scale(kind)),
        _ => bytes.wild_pose(),
    };
    ProbeState { pose_ba, twist: bytes.twist() }
}

/// Near, far, and absurdly far.
fn bytes_scale(kind: u8) -> f64 {
    10f64.powi(i32::from(kind - 220) * 3 - 12)
}

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (a, b) = BODIES.with(|all| {
        let all = all.get_or_init(bodies);
        (Arc::clone(&all[bytes.below(4)]), Arc::clone(&all[bytes.below(4)]))
    });
    let settings = settings(&mut bytes);
    let size = a.size() + b.size();
    let Ok(mut renderer) = Renderer::new(a, b, settings) else { return };
    let clock = Leaps(Cell::new(0), u64::from(bytes.byte()) * 64);
    let mut probe = ProbeState::at(bytes.pose(0.01));
    for _ in 0..24 {
        let dt = match bytes.byte() {
            0..=200 => 1e-3,
            201..=230 => bytes.between(1e-7, 10.0),
            _ => bytes.any(),
        };
        let tick = renderer.step(&probe, dt, &clock);
        let wrench = tick.commanded;
        assert!(wrench.is_finite() && tick.computed.is_finite(), "{wrench:?} in tick {}", tick.index);
        assert!(wrench.force.length() <= settings.limits.force, "{wrench:?} of {:?}", settings.limits);
        assert!(wrench.torque.length() <= settings.limits.torque, "{wrench:?} of {:?}", settings.limits);
        assert!(tick.contacts.len() <= settings.capacity);
        let reach = size + tick.tool_ba.translation.length();
        check::contacts(&tick.contacts, settings.contact_tolerance, reach);
        assert!(!tick.separation().is_nan());
        if bytes.rarely() {
            renderer.clear();
        }
        if bytes.is_empty() {
            break;
        }
        let next = state(&mut bytes, &probe);
        probe = next;
    }
}

fn seeds() -> Vec<Seed> {
    // A block into an L, step by step, under settings of each kind.
    let mut seeds = Vec::new();
    for flags in [0, 1, 2, 4, 8 | 16, 32, 64, 128, 1 | 2 | 4, 255] {
        let mut input = vec![0, 2, flags];
        input.extend([60; 24]);
        input.extend([0, 100, 100, 120]);
        for k in 0..20u8 {
            input.extend([0, 0, 50, 0, 100, 100 + (k & 1), 90, 100, 100, 100, 0, 100, 100, 100]);
        }
        seeds.push((format!("block-{flags}"), input));
    }
    seeds
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 128 << 20 }, seeds: seeds);
