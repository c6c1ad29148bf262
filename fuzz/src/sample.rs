//! A small recording, used as a seed.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Settings, VirtualCoupling};
use palpus_io::record::{FORMAT, RawState, RecordedBody, RecordedScene, SceneSource, ServoRecord};
use palpus_io::{ContentHash, RecordRow, RecordingHeader};

/// Returns a header in which all fields are set; `more` contains the additional values of a
/// program.
pub fn header(more: toml::Table) -> RecordingHeader {
    let pose = Pose { rotation: DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8), translation: DVec3::new(0.25, -0.0, 1e-17) };
    let body = |mesh: &str| RecordedBody { mesh: mesh.to_owned(), content: ContentHash([7; 32]), pose };
    let coupling = VirtualCoupling {
        stiffness: 800.0,
        damping: 2.0,
        angular_stiffness: 2.0,
        angular_damping: 0.005,
        contact_offset: 1e-4,
        mass: 0.1,
    };
    let render = Settings {
        shading: Some(ShadingSettings { crease_angle: 0.7, most_turn: 0.3 }),
        friction: Some(FrictionSettings {
            static_coefficient: 0.4,
            dynamic_coefficient: 0.3,
            tangential_stiffness: 123.0,
        }),
        coupling: Some(coupling),
        time_budget: Some(123_456),
        ..Settings::default()
    };
    RecordingHeader {
        format: FORMAT,
        palpus_version: "0.1.0".to_owned(),
        device: "sim".to_owned(),
        rate_hz: 1000.0,
        start_utc: Some("2026-03-01T12:30:00Z".to_owned()),
        seed: u64::MAX,
        scene: RecordedScene {
            source: SceneSource::File("cup.toml".to_owned()),
            text: Some("unit = \"mm\"\n".to_owned()),
            metres_per_unit: 0.001,
            probe: body("spoon.obj"),
            environment: body("cup.obj"),
            objects: vec![body("nut.obj")],
            render,
            more,
        },
    }
}

/// Returns a row.
pub fn row(tick: u64) -> RecordRow {
    let x = tick as f64 / 3.0;
    let raw = RawState { pose: Pose::IDENTITY, twist: Twist { angular: DVec3::NAN, linear: DVec3::splat(x) } };
    RecordRow {
        tick,
        time_ns: tick * 1_000_000,
        dt: 1e-3,
        pose: Pose { rotation: DQuat::IDENTITY, translation: DVec3::splat(x) },
        twist: Twist { angular: DVec3::new(x, f64::NAN, -0.0), linear: DVec3::NEG_INFINITY },
        buttons: 1,
        wrench: Wrench { torque: DVec3::splat(1e-300), force: DVec3::Z },
        contacts: 3,
        clusters: 1,
        separation: f64::INFINITY,
        query_us: 12.5,
        depth_us: (tick > 0).then_some(3.25),
        force_us: 1.0,
        total_us: 17.0,
        saturated: tick > 0,
        faults: 5,
        tool: Some(Pose { rotation: DQuat::IDENTITY, translation: DVec3::splat(-x) }),
        servo: Some(ServoRecord {
            utc_ns: tick,
            stepped: true,
            raw: (tick > 0).then_some(raw),
            ..ServoRecord::default()
        }),
    }
}
