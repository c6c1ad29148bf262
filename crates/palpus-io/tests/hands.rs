//! Files with the motion of a hand: formats, errors, and real files.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use palpus::algebra::Random;
use palpus_io::hand::{HandFile, RecordedHand, read_hand, read_hand_from};

fn recorded(text: &str) -> RecordedHand {
    match read_hand_from(text.as_bytes(), "hand.txt") {
        Ok(HandFile::Recorded(hand)) => hand,
        other => panic!("{other:?}"),
    }
}

fn error(text: &str) -> String {
    read_hand_from(text.as_bytes(), "hand.txt").expect_err("an error").to_string()
}

#[test]
fn hand_files_are_read_in_three_formats() {
    let tum =
        recorded("# remark\n100.5 1 2 3 0 0 0 1\n100.6 1 2 4 0 0 0 1\n100.6 9 9 9 0 0 0 1\n\n101 1 2 4 0 0 0.6 0.8\n");
    assert_eq!((tum.samples.len(), tum.repeated), (3, 1));
    assert_eq!(tum.samples[0].0, 0.0);
    assert!((tum.duration() - 0.5).abs() < 1e-9 && (tum.longest_gap() - 0.4).abs() < 1e-9);
    assert_eq!(tum.samples[1].1.translation, DVec3::new(1.0, 2.0, 4.0));
    assert_eq!(tum.reach(), 1.0);

    let robot = recorded("qw,qx,qy,qz,t_ms,px_mm,py_mm,pz_mm,grip\n1,0,0,0,0,1,2,3,x\n0,1,0,0,2,1,2,4,y\n");
    assert_eq!(robot.samples[1].0, 0.002);
    assert_eq!(robot.samples[1].1.translation, DVec3::new(0.001, 0.002, 0.004));
    assert_eq!(robot.samples[1].1.rotation, DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0));

    let poses = read_hand_from(b"tx,ty,tz,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "poses.csv");
    assert!(matches!(poses, Ok(HandFile::Poses(ref poses)) if poses.len() == 1), "{poses:?}");
}

#[test]
fn errors_name_problem_place_and_remedy() {
    let header = "t,tx,ty,tz,qx,qy,qz,qw\n";
    for (text, parts) in [
        (String::new(), vec!["hand.txt", "no poses"]),
        ("# only\n".into(), vec!["no poses"]),
        ("1 2 3\n".into(), vec!["line 1", "tz is missing"]),
        ("0 0 0 0 0 0 0 1 5\n".into(), vec!["line 1", "more than"]),
        ("0 0 0 0 0 0 0 1\n1 0 0 x 0 0 0 1\n".into(), vec!["line 2", "column tz", "\"x\" is not a finite number"]),
        ("0 0 0 0 0 0 0 1\n".into(), vec!["1 samples", "at least two"]),
        ("5 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 1\n".into(), vec!["line 2", "decreases", "sort"]),
        ("0 0 0 0 0 0 0 2\n".into(), vec!["line 1", "length 2", "normalise"]),
        ("0 0 0 0 0 0 0 NaN\n".into(), vec!["line 1", "column qw"]),
        ("0 1e9 0 0 0 0 0 1\n".into(), vec!["line 1", "unit"]),
        (format!("{header}0,0,0,0,0,0,0\n"), vec!["line 2", "7 cells", "should be 8"]),
        (format!("{header}0,0,0,0,0,0,0,inf\n"), vec!["line 2", "column qw"]),
        ("tx_mm,ty_mm,tz_mm,qx,qy,qz,qw\n".into(), vec!["line 1", "no time"]),
        ("a,b\n1,2\n".into(), vec!["line 1", "no column qx"]),
    ] {
        let said = error(&text);
        assert!(parts.iter().all(|part| said.contains(part)), "{text:?} gives {said}");
    }
    assert!(read_hand_from(b"\xff\xfe", "x").unwrap_err().to_string().contains("UTF-8"));
    assert!(read_hand(Path::new("no/such")).unwrap_err().to_string().contains("cannot be read"));
}

const SEED: u64 = 0x4a4d;

#[test]
fn damaged_hand_files_give_errors_or_valid_motions() {
    let good = "t_s,px_m,py_m,pz_m,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n";
    let tum = "# x\n0 1 2 3 0 0 0 1\n0.5 1 2 3 0 0 0 1\n";
    let mut random = Random::new(SEED);
    let mut draw = || random.bits() as usize;
    for _ in 0..4000 {
        let mut bytes = if draw() % 2 == 0 { good } else { tum }.as_bytes().to_vec();
        for _ in 0..1 + draw() % 4 {
            let place = draw() % bytes.len();
            match draw() % 3 {
                0 => bytes[place] = draw() as u8,
                1 => bytes.truncate(place.max(1)),
                _ => bytes.insert(place, b"0123456789,.-e \n#N"[draw() % 18]),
            }
        }
        if let Ok(HandFile::Recorded(hand)) = read_hand_from(&bytes, "bent") {
            assert!(hand.samples.windows(2).all(|pair| pair[0].0 < pair[1].0), "seed {SEED}");
            assert!(hand.samples.iter().all(|(time, pose)| time.is_finite() && pose.is_valid()), "seed {SEED}");
        }
    }
}

fn shared(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/trajectories")).join(name)
}

#[test]
fn real_hand_files_are_read() {
    for (name, samples, seconds, repeated) in [
        ("tum_fr2_desk_300hz.txt", 20_000..21_000, 99.36, true),
        ("ur_kinesthetic_teaching_500hz.csv", 5271..5272, 10.54, false),
    ] {
        let path = shared(name);
        if !path.exists() {
            continue;
        }
        let Ok(HandFile::Recorded(hand)) = read_hand(&path) else { panic!("{name}") };
        assert!(samples.contains(&hand.samples.len()), "{name}: {}", hand.samples.len());
        assert!((hand.duration() - seconds).abs() < 0.01, "{name}: {}", hand.duration());
        assert_eq!(hand.repeated > 0, repeated, "{name}");
        assert!(hand.reach() > 0.1 && hand.reach() < 5.0, "{name}: {}", hand.reach());
    }
}
