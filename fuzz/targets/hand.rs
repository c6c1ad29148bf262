//! Files with the motion of a hand: poses, and recorded motions in CSV and in the format of TUM's
//! benchmark. Each valid file is converted to a path.
#![no_main]

use palpus::algebra::Pose;
use palpus_fuzz::{Allowance, Bytes, Seed, check, target};
use palpus_io::HandFile;
use palpus_io::hand::read_hand_from;
use palpus_scenes::{HandPath, Placement};

fn run(data: &[u8]) {
    match read_hand_from(data, "hand.csv") {
        Ok(HandFile::Poses(poses)) => assert!(poses.iter().all(|pose| pose.is_valid())),
        Ok(HandFile::Recorded(hand)) => {
            assert!(hand.samples.len() >= 2 && hand.samples[0].0 == 0.0);
            assert!(hand.samples.windows(2).all(|pair| pair[0].0 < pair[1].0));
            assert!(hand.samples.iter().all(|(time, pose)| time.is_finite() && pose.is_valid()));
            assert!(hand.duration().is_finite() && hand.longest_gap() > 0.0 && hand.reach().is_finite());
            // Takes scale and speed from the last bytes, which rarely affect the motion.
            let mut bytes = Bytes::new(data.get(data.len() - 4..).unwrap_or_default());
            let (scale, speed) = (bytes.between(1e-3, 1e3), bytes.between(1e-3, 1e3));
            follow(&hand.samples, &Placement { start: Pose::IDENTITY, scale, speed });
            follow(&hand.samples, &Placement::at(Pose::IDENTITY));
        }
        Err(error) => check::error(&error.to_string(), "hand.csv"),
    }
}

fn follow(samples: &[(f64, Pose)], placement: &Placement) {
    match HandPath::recorded(samples, placement) {
        Ok(path) => {
            for part in [-1.0, 0.0, 1e-3, 0.3, 0.5, 0.9, 1.0, 2.0] {
                let time = part * path.duration();
                let (pose, twist) = (path.pose(time), path.twist(time));
                assert!(pose.is_valid() && twist.linear.is_finite() && twist.angular.is_finite(), "{pose:?} {twist:?}");
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
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

// Sixteen bytes may describe one second of a motion, which gives a hundred keys and segments of a
// path.
target!(run: run, allowance: Allowance { per_byte: 8000, always: 8 << 20 }, seeds: seeds);
