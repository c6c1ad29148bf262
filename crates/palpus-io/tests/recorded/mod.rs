//! Sample recordings for the tests.
#![allow(dead_code, unreachable_pub, reason = "each test file uses a part of it")]

use std::num::NonZeroU64;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::PolygonSoup;
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, Material, Saturation, Settings, VirtualCoupling};
use palpus_io::record::{FORMAT, RawState, RecordedBody, RecordedScene, SceneSource, ServoRecord};
use palpus_io::{ContentHash, RecordRow, RecordingHeader};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Seed of all random tests of recordings.
pub const SEED: [u8; 32] = *b"palpus-io recordings bit for bit";

pub fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &SEED))
}

/// Returns settings in which every field differs from its default, so that a field that the header
/// omits is read back with another value.
pub fn settings() -> Settings {
    Settings {
        contact_tolerance: 0.1 + 0.2,
        cluster_radius: 1e-300,
        clustering: Clustering::Smooth,
        split_angle: None,
        stiffness: 1.0 / 3.0,
        damping: 2.5,
        patch_angle: Some(0.07),
        shading: Some(ShadingSettings { crease_angle: 0.7, most_turn: 0.3 }),
        friction: Some(FrictionSettings {
            static_coefficient: 0.4,
            dynamic_coefficient: 0.3,
            tangential_stiffness: 123.0,
        }),
        material: Some(Material { frequency: 250.0 / 3.0, decay: 1e4, gain: 0.1 }),
        limits: Limits { force: f64::INFINITY, torque: 0.1 },
        saturation: Saturation::UnderActuated,
        grip_a: DVec3::new(-0.0, 0.5, 3e-9),
        capacity: 77,
        time_budget: Some(123_456),
        coupling: Some(VirtualCoupling {
            stiffness: 1000.0 / 3.0,
            damping: 0.0,
            angular_stiffness: 0.1,
            angular_damping: 1e-9,
            contact_offset: 1e-5,
            mass: 0.0,
        }),
    }
}

pub fn header() -> RecordingHeader {
    let body = |mesh: &str, x| RecordedBody {
        mesh: mesh.to_owned(),
        content: ContentHash::of_soup(&PolygonSoup::from_triangles(vec![DVec3::splat(x)], &[[0, 0, 0]])),
        pose: Pose {
            rotation: DQuat::from_xyzw(0.1, 0.2, 0.3, 0.927_361_849_549_570_4),
            translation: DVec3::new(x, -0.0, 1e-17),
        },
    };
    let mut more = toml::Table::new();
    more.insert("coupling".to_owned(), toml::Table::from_iter([("mass".to_owned(), toml::Value::Float(0.1))]).into());
    more.insert("note".to_owned(), "two\nlines # and\t\"quotes\" \u{2028}".into());
    RecordingHeader {
        format: FORMAT,
        palpus_version: "0.1.0".to_owned(),
        device: "sim".to_owned(),
        rate_hz: 1000.0,
        start_utc: Some("2026-03-01T12:30:00.5Z".to_owned()),
        seed: u64::MAX,
        scene: RecordedScene {
            source: SceneSource::File("Tassen/süß, klein.toml".to_owned()),
            text: Some("unit = \"mm\"  \r\n\n# süß \\ \"\"\" \'\'\'\t\n ".to_owned()),
            metres_per_unit: 0.001,
            probe: body("spoon.obj", 0.25),
            environment: body("cup.obj", 4.0),
            objects: Vec::new(),
            render: settings(),
            more,
        },
    }
}

pub fn row(bits: [u64; NUMBERS], whole: [u32; 6], depth: bool) -> RecordRow {
    let x = |k: usize| f64::from_bits(bits[k]);
    let vec = |k: usize| DVec3::new(x(k), x(k + 1), x(k + 2));
    RecordRow {
        tick: bits[0],
        time_ns: bits[1],
        dt: x(24),
        pose: Pose { rotation: DQuat::from_xyzw(x(3), x(4), x(5), x(6)), translation: vec(0) },
        twist: Twist { angular: vec(7), linear: vec(10) },
        buttons: whole[0],
        wrench: Wrench { torque: vec(13), force: vec(16) },
        contacts: whole[1],
        clusters: whole[2],
        separation: x(19),
        query_us: x(20),
        depth_us: depth.then(|| x(21)),
        force_us: x(22),
        total_us: x(23),
        saturated: whole[3] % 2 == 1,
        faults: whole[4],
        tool: Some(Pose { rotation: DQuat::from_xyzw(x(28), x(29), x(30), x(31)), translation: vec(25) }),
        servo: Some(ServoRecord {
            utc_ns: bits[32],
            lateness_s: x(33),
            elapsed_s: x(34),
            phase: whole[5],
            stepped: whole[3] / 2 % 2 == 1,
            work: bits[49],
            work_allowed: NonZeroU64::new(bits[49] ^ bits[32]),
            device_time_s: x(35),
            raw: (whole[3] / 4 % 2 == 1).then(|| RawState {
                pose: Pose { rotation: DQuat::from_xyzw(x(39), x(40), x(41), x(42)), translation: vec(36) },
                twist: Twist { angular: vec(43), linear: vec(46) },
            }),
        }),
    }
}

/// Number of 64-bit values in a row.
pub const NUMBERS: usize = 50;

/// Returns all numbers of a row as bits, because NaN is not equal to itself.
pub fn bits(row: &RecordRow) -> Vec<u64> {
    let mut all = vec![row.tick, row.time_ns];
    let mut push = |values: &[f64]| all.extend(values.iter().map(|x| x.to_bits()));
    push(&row.pose.translation.to_array());
    push(&row.pose.rotation.to_array());
    for v in [row.twist.angular, row.twist.linear, row.wrench.torque, row.wrench.force] {
        push(&v.to_array());
    }
    // A recording of format 1 has no tool pose.
    if let Some(tool) = row.tool {
        push(&tool.translation.to_array());
        push(&tool.rotation.to_array());
    }
    // Recordings of formats 1 and 2 have no servo values.
    if let Some(servo) = row.servo {
        let ServoRecord { utc_ns, lateness_s, elapsed_s, phase, stepped, work, work_allowed, device_time_s, raw } =
            servo;
        push(&[lateness_s, elapsed_s, device_time_s, f64::from(phase), f64::from(u8::from(stepped))]);
        if let Some(RawState { pose, twist }) = raw {
            push(&pose.rotation.to_array());
            [pose.translation, twist.angular, twist.linear].iter().for_each(|v| push(&v.to_array()));
        }
        let allowed = work_allowed.map_or(0, NonZeroU64::get);
        push(&[utc_ns, work, allowed].map(f64::from_bits));
    }
    push(&[row.dt, row.separation, row.query_us, row.depth_us.unwrap_or(-1.0), row.force_us, row.total_us]);
    let whole = [row.buttons, row.contacts, row.clusters, u32::from(row.saturated), row.faults];
    all.extend(whole.map(u64::from));
    all
}

/// Returns a row with ones in all fields.
pub fn plain() -> RecordRow {
    row([1f64.to_bits(); NUMBERS], [1; 6], true)
}

/// Generates rows with arbitrary bits, where special values are frequent.
pub fn any_row() -> impl Strategy<Value = RecordRow> {
    let special = prop::sample::select(vec![0.0, -0.0, f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324]);
    let number = prop_oneof![special.prop_map(f64::to_bits), any::<u64>(), any::<f64>().prop_map(f64::to_bits)];
    (
        prop::collection::vec(number, NUMBERS).prop_map(|bits| <[u64; NUMBERS]>::try_from(bits).unwrap()),
        any::<[u32; 6]>(),
        any::<bool>(),
    )
        .prop_map(|(bits, whole, depth)| row(bits, whole, depth))
}
