//! The poses of `palpus query` and of the hand of a scene.
#![no_main]

use palpus_fuzz::{Allowance, Seed, check, target};
use palpus_io::query::read_poses_from;

fn run(data: &[u8]) {
    match read_poses_from(data, "poses.csv") {
        Ok(poses) => assert!(poses.iter().all(|pose| pose.is_valid())),
        Err(error) => check::error(&error.to_string(), "poses.csv"),
    }
}

fn seeds() -> Vec<Seed> {
    let plain = "tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1.5,-2e-3,.25,0.6,0,0,0.8\n";
    let other =
        "\u{feff}# a comment\nname, qw,qx,qy,qz,tz,ty,tx\r\na,1,0,0,0,1,2,3\r\n\r\nb,0,-1,0,0,1e300,inf,nan\r\n";
    vec![("plain".to_owned(), plain.into()), ("other".to_owned(), other.into())]
}

target!(run: run, allowance: Allowance { per_byte: 200, always: 1 << 20 }, seeds: seeds);
