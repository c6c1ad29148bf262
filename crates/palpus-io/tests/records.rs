//! Recordings: what is written reads back bit for bit, also after a crash.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::PolygonSoup;
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, Saturation, Settings, VirtualCoupling};
use palpus_io::record::{RecordedBody, RecordedScene, SceneSource, read_recording_from};
use palpus_io::{ContentHash, RecordRow, RecordingHeader, RecordingWriter, TableError, read_recording};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Seed of every random test here.
const SEED: [u8; 32] = *b"palpus-io recordings bit for bit";

fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &SEED))
}

/// Every field of the settings, none at its default: a field that the header forgets comes back changed.
fn settings() -> Settings {
    Settings {
        contact_tolerance: 0.1 + 0.2,
        cluster_radius: 1e-300,
        clustering: Clustering::Smooth,
        split_angle: None,
        stiffness: 1.0 / 3.0,
        damping: 2.5,
        blend_angle: Some(0.07),
        shading: Some(ShadingSettings { crease_angle: 0.7, most_turn: 0.3 }),
        friction: Some(FrictionSettings {
            static_coefficient: 0.4,
            dynamic_coefficient: 0.3,
            tangential_stiffness: 123.0,
        }),
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
            skin: 1e-5,
            mass: 0.0,
        }),
    }
}

fn header() -> RecordingHeader {
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
        palpus_version: "0.1.0".to_owned(),
        device: "sim".to_owned(),
        rate_hz: 1000.0,
        seed: u64::MAX,
        scene: RecordedScene {
            source: SceneSource::File("Tassen/süß, klein.toml".to_owned()),
            metres_per_unit: 0.001,
            probe: body("spoon.obj", 0.25),
            environment: body("cup.obj", 4.0),
            render: settings(),
            more,
        },
    }
}

fn row(bits: [u64; 25], whole: [u32; 5], depth: bool) -> RecordRow {
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
    }
}

/// All numbers of a row as bits, since NaN is not equal to itself.
fn bits(row: &RecordRow) -> Vec<u64> {
    let mut all = vec![row.tick, row.time_ns];
    let mut push = |values: &[f64]| all.extend(values.iter().map(|x| x.to_bits()));
    push(&row.pose.translation.to_array());
    push(&row.pose.rotation.to_array());
    for v in [row.twist.angular, row.twist.linear, row.wrench.torque, row.wrench.force] {
        push(&v.to_array());
    }
    push(&[row.dt, row.separation, row.query_us, row.depth_us.unwrap_or(-1.0), row.force_us, row.total_us]);
    let whole = [row.buttons, row.contacts, row.clusters, u32::from(row.saturated), row.faults];
    all.extend(whole.map(u64::from));
    all
}

fn recorded(rows: &[RecordRow]) -> Vec<u8> {
    let mut writer = RecordingWriter::new(Vec::new(), &header()).unwrap();
    rows.iter().for_each(|row| writer.write(row).unwrap());
    writer.finish().unwrap()
}

fn error(bytes: &[u8]) -> TableError {
    read_recording_from(bytes, "run.csv").unwrap_err()
}

fn plain() -> RecordRow {
    row([1f64.to_bits(); 25], [1; 5], true)
}

#[test]
fn every_bit_of_header_and_rows_comes_back() {
    let special = prop::sample::select(vec![0.0, -0.0, f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324]);
    let number = prop_oneof![special.prop_map(f64::to_bits), any::<u64>(), any::<f64>().prop_map(f64::to_bits)];
    let strategy = (
        prop::collection::vec(number, 25).prop_map(|bits| <[u64; 25]>::try_from(bits).unwrap()),
        any::<[u32; 5]>(),
        any::<bool>(),
    );
    let run = runner(300).run(&prop::collection::vec(strategy, 0..5), |rows| {
        let rows: Vec<RecordRow> = rows.into_iter().map(|(bits, whole, depth)| row(bits, whole, depth)).collect();
        let read = read_recording_from(recorded(&rows).as_slice(), "run.csv").unwrap();
        prop_assert_eq!(&read.header, &header());
        prop_assert_eq!(read.notice, None);
        let both = |rows: &[RecordRow]| rows.iter().map(bits).collect::<Vec<_>>();
        prop_assert_eq!(both(&read.rows), both(&rows));
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}

#[test]
fn the_file_is_a_table_behind_comments() {
    let text = String::from_utf8(recorded(&[plain()])).unwrap();
    let table: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(table.len(), 2, "{text}");
    assert_eq!(table[0].split(',').count(), table[1].split(',').count());
    assert!(text.starts_with("# format = 1\n# palpus_version = \"0.1.0\"\n# device = \"sim\"\n"), "{text}");
}

#[test]
fn a_recording_cut_anywhere_is_read_up_to_its_last_whole_line() {
    let bytes = recorded(&[plain(); 3]);
    let text = String::from_utf8(bytes.clone()).unwrap();
    let start = text.find("\ntick,").unwrap() + 1;
    let table = start + text[start..].find('\n').unwrap() + 1;
    for length in 0..table {
        let error = error(&bytes[..length]).to_string();
        assert!(error.starts_with("run.csv") && !error.contains('\n'), "{error}");
    }
    for length in table..=bytes.len() {
        let read = read_recording_from(&bytes[..length], "run.csv").unwrap();
        let whole = text[table..length].matches('\n').count();
        assert_eq!(read.rows, vec![plain(); whole], "cut at {length}");
        assert_eq!(read.notice.is_some(), !text[..length].ends_with('\n'), "cut at {length}");
    }
    let read = read_recording_from(&bytes[..bytes.len() - 3], "run.csv").unwrap();
    let notice = read.notice.unwrap();
    assert!(notice.ends_with("the last line was cut off and is left out; 2 ticks are whole"), "{notice}");
}

#[test]
fn errors_name_line_and_column() {
    let text = String::from_utf8(recorded(&[plain()])).unwrap();
    let header = text.lines().filter(|line| line.starts_with('#')).count();
    let row = header + 2;
    let change = |from: &str, to: &str| error(text.replace(from, to).as_bytes()).to_string();
    let last = text.lines().last().unwrap();
    let broken = last.replacen(",1.0,1.0", ",1.0,one", 1);
    assert_eq!(
        change(last, &broken),
        format!("run.csv, line {row}, column device_tx: \"one\" is not a number; correct it")
    );
    let short = last.rsplit_once(',').unwrap().0;
    assert_eq!(
        change(last, short),
        format!("run.csv, line {row}: there are 31 cells and should be 32; correct or remove the line")
    );
    assert_eq!(
        change("format = 1", "format = 2"),
        "run.csv, line 1: recordings of format 2 are not read, only 1; use the palpus that wrote it"
    );
    let error = change("stiffness = 0.3333333333333333", "stiffness = -1.0");
    assert!(error.contains("the header is wrong: setting `stiffness` is -1"), "{error}");
    let error = change("seed = \"18446744073709551615\"", "seed = \"x\"");
    assert!(error.starts_with("run.csv, line 5: the header is wrong: invalid digit"), "{error}");
    let error = change("tick,time_ns", "tick,time_ms");
    assert!(error.contains(&format!("line {}: the columns must be tick,time_ns,", header + 1)), "{error}");
    assert!(self::error(b"tx,ty,tz\n0,0,0\n").to_string().starts_with("run.csv, line 1: the columns must be"));
    let missing = read_recording("no such file.csv".as_ref()).unwrap_err().to_string();
    assert!(missing.starts_with("no such file.csv: cannot be read"), "{missing}");
}

#[test]
fn changes_of_settings_come_back_at_their_ticks() {
    let at = |tick| RecordRow { tick, ..plain() };
    let stiffer = |stiffness| Settings { stiffness, ..settings() };
    let mut writer = RecordingWriter::new(Vec::new(), &header()).unwrap();
    writer.change(0, &stiffer(1.0));
    writer.write(&at(0)).unwrap();
    writer.change(1, &stiffer(2.0));
    writer.change(1, &stiffer(0.1 + 0.2));
    writer.change(3, &Settings { limits: Limits { force: f64::INFINITY, torque: 0.0 }, ..Settings::default() });
    (1..5).for_each(|tick| writer.write(&at(tick)).unwrap());
    writer.change(5, &stiffer(4.0));
    let bytes = writer.finish().unwrap();
    let read = read_recording_from(bytes.as_slice(), "run.csv").unwrap();
    assert_eq!(read.rows.len(), 5);
    let last = Settings { limits: Limits { force: f64::INFINITY, torque: 0.0 }, ..Settings::default() };
    assert_eq!(read.changes, [(0, stiffer(1.0)), (1, stiffer(0.1 + 0.2)), (3, last)]);
    let text = String::from_utf8(bytes).unwrap();
    let wrong = error(text.replace("stiffness = 0.30000000000000004", "stiffness = -1").as_bytes()).to_string();
    assert!(
        wrong.contains("the change of settings is wrong: setting `stiffness` is -1") && !wrong.contains('\n'),
        "{wrong}"
    );
    let line = text.lines().find(|line| line.starts_with("# change")).unwrap();
    assert!(line.starts_with("# change = {") && line.contains("tick = 0") && line.contains("settings = {"), "{line}");
}

#[test]
fn any_bytes_are_read_or_refused() {
    let good = recorded(&[plain(); 2]);
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4);
    let run = runner(1000).run(&(edits, prop::collection::vec(any::<u8>(), 0..200)), |(edits, noise)| {
        let mut bytes = good.clone();
        for (at, byte) in edits {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        for bytes in [bytes, noise] {
            if let Err(error) = read_recording_from(bytes.as_slice(), "run.csv") {
                prop_assert!(!error.to_string().contains('\n'), "{}", error);
            }
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}
