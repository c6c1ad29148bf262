//! Files that a hand follows: poses, recorded hands in CSV, and as TUM's benchmark writes them.
#![no_main]

use palpus_fuzz::{Allowance, Seed, check, target};
use palpus_io::HandFile;
use palpus_io::hand::read_hand_from;

fn run(data: &[u8]) {
    match read_hand_from(data, "hand.csv") {
        Ok(HandFile::Poses(poses)) => assert!(poses.iter().all(|pose| pose.is_valid())),
        Ok(HandFile::Recorded(hand)) => {
            assert!(hand.samples.len() >= 2 && hand.samples[0].0 == 0.0);
            assert!(hand.samples.windows(2).all(|pair| pair[0].0 < pair[1].0));
            assert!(hand.samples.iter().all(|(time, pose)| time.is_finite() && pose.is_valid()));
            assert!(hand.duration().is_finite() && hand.longest_gap() > 0.0 && hand.reach().is_finite());
        }
        Err(error) => check::error(&error.to_string(), "hand.csv"),
    }
}

fn seeds() -> Vec<Seed> {
    let tum =
        "# timestamp tx ty tz qx qy qz qw\n1311868164.36 -0.1 -0.2 0.3 0 0 0.6 0.8\n1311868164.40 0 0 0 0 0 0 1\n";
    let robot = "t_s,px_m,py_m,pz_m,qw,qx,qy,qz,fx_N\n0.0,1,2,3,1,0,0,0,9\n0.002,1,2,3.1,0.8,0.6,0,0,9\n";
    let other = "\u{feff}\"qw\", qz, qy, qx, X_mm, y_mm, z_mm, Time_ns\r\n1,0,0,0,1e3,2,3,0\r\n1,0,0,0,1,2,3,0\r\n1,0,0,0,1,2,3,1000\r\n";
    let poses = "tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,1\n";
    [("tum", tum), ("robot", robot), ("other", other), ("poses", poses)]
        .map(|(name, text)| (name.to_owned(), text.into()))
        .into()
}

target!(run: run, allowance: Allowance { per_byte: 200, always: 1 << 20 }, seeds: seeds);
