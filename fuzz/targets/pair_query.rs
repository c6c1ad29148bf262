//! Two small bodies with a sequence of arbitrary poses. Contacts and the nearest pair are finite
//! and consistent, with and without proofs, patches and a limit of work.
#![no_main]

use std::sync::Arc;

use palpus::algebra::{NoClock, Pose, Work};
use palpus::detect::{ContactQuery, Proof, QuerySettings};
use palpus_fuzz::{Allowance, Bytes, Seed, check, target};

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let unit = if bytes.rarely() { bytes.between(1e-9, 1e9) } else { 1.0 };
    let (Some(a), Some(b)) = (bytes.body(unit), bytes.body(unit)) else { return };
    let flags = bytes.byte();
    let proof = if flags & 1 != 0 { Proof::Prove } else { Proof::None };
    let patch_angle = (flags & 2 != 0).then(|| bytes.between(1.8e-3, 0.35));
    let capacity = if flags & 4 != 0 { 1 + bytes.below(8) } else { 256 };
    let (guard, hurried) = (flags & 8 != 0, flags & 16 != 0);
    let scale = a.size().max(b.size());
    let tolerance = scale * bytes.between(1e-6, 0.3);
    let size = a.size() + b.size();
    let settings =
        QuerySettings { tolerance, capacity, proof, patch_angle, guard, holding: hurried, ..QuerySettings::default() };
    let mut query = ContactQuery::new(Arc::new(a), Arc::new(b), settings);
    let mut pose = Pose::IDENTITY;
    for _ in 0..6 {
        // The next pose is a small step or a jump.
        pose = if bytes.byte() < 128 {
            let step = bytes.pose(scale * 1e-2);
            Pose::new(step.rotation, pose.translation + step.translation)
        } else {
            bytes.pose(0.5 * scale)
        };
        let work = Work::of(hurried.then(|| u64::from(bytes.short()) / 16));
        query.run_within(&pose, &work.all(), &NoClock);
        let size = size + pose.translation.length();
        assert!(query.found().len() <= capacity);
        check::contacts(query.found(), tolerance, size);
        assert!(!query.unseen_separation().is_nan());
        if !hurried {
            let nearest = query.nearest(&pose);
            check::contacts(nearest.as_slice(), f64::INFINITY, size);
        }
        if bytes.rarely() {
            query.clear();
        }
        if bytes.is_empty() {
            break;
        }
    }
}

fn seeds() -> Vec<Seed> {
    // Two stars that move into each other.
    let star = [1, 3, 0, 128, 64, 120, 64, 120, 64, 120, 64];
    let way: Vec<u8> = (0..6u8).flat_map(|k| [200, 70 + k, 103, 100, 100, 120 - k, 100, 110 - 3 * k, 0, 0]).collect();
    let all = |flags: u8| [&[0][..], &star, &star, &[flags, 9, 200, 128, 3], &way].concat();
    [0, 1, 2, 10, 16, 31].map(|flags| (format!("stars-{flags}"), all(flags))).into()
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 128 << 20 }, seeds: seeds);
