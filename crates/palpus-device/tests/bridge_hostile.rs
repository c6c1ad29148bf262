//! Tests that hostile frames in a session change no state and are never accepted as valid.

mod bridge_driver;

use std::time::Duration;

use bridge_driver::client::{comes_to, open, up};
use bridge_driver::{Behaviour, StandIn, WAYS, Way, repair};
use glam::DQuat;
use palpus::algebra::Random;
use palpus::algebra::{Pose, Twist, Wrench};
use palpus_device::HapticDevice;
use palpus_device::bridge_frames::{Body, Command, Frame, LONGEST, READY, State, decode, encode};

const HOSTILE_SEED: u64 = 0x0b5e_55ed_f4a3;
const HOSTILE: usize = 100_000;

/// Returns a damaged state with another pose and sequence number, or random bytes.
fn hostile(random: &mut Random, nonce: u64) -> Vec<u8> {
    let state = State {
        time_ns: random.bits() >> 20,
        pose: Pose {
            rotation: DQuat::from_rotation_y(random.between(-3.0, 3.0)),
            translation: 9.0 * random.direction(),
        },
        twist: Twist { angular: random.direction(), linear: random.direction() },
        applied: up(3.0),
        echo: random.below(1000) as u64,
        buttons: 0,
        flags: READY,
    };
    let command = Command { echo: 1, time_ns: state.time_ns, wrench: up(5.0), valid_for_us: 100_000 };
    let sequence = 1_000_000_000 + random.below(1_000_000) as u64;
    let whole =
        |nonce: u64, sequence: u64, body: Body| encode(&Frame { nonce, sequence, body }, &mut [0; LONGEST]).to_vec();
    match random.below(8) {
        0 => whole(nonce ^ (1 << random.below(64)), sequence, Body::State(state)),
        1 => whole(nonce, 0, Body::State(state)),
        2 => whole(nonce, sequence, Body::Command(command)),
        3 => whole(nonce ^ 1, sequence, Body::Close("nothing".into())),
        4 => {
            let mut bytes = whole(nonce, sequence, Body::State(state));
            let length = random.below(bytes.len());
            bytes.truncate(length.max(1));
            bytes
        }
        5 => (0..1 + random.below(270)).map(|_| random.bits() as u8).collect(),
        6 => {
            // One number is not finite or too large, and the CRC-32 is correct.
            let mut bytes = whole(nonce, sequence, Body::State(state));
            let at = 40 + 8 * random.below(19);
            let bad = [f64::NAN, f64::INFINITY, -1e300][random.below(3)];
            bytes[at..at + 8].copy_from_slice(&bad.to_le_bytes());
            repair(&mut bytes);
            bytes
        }
        _ => {
            let mut bytes = whole(nonce, sequence, Body::State(state));
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 + random.below(255) as u8;
            }
            bytes
        }
    }
}

#[test]
fn hostile_frames_change_no_state() {
    let driver = StandIn::start(Behaviour { rate_hz: 2000.0, ..Behaviour::good(WAYS[0]) });
    let mut device = open(&driver);
    let mut random = Random::new(HOSTILE_SEED);
    {
        let mut seen = driver.seen();
        let nonce = seen.session;
        seen.hostile.extend((0..HOSTILE).map(|_| hostile(&mut random, nonce)));
    }
    let (mut last, mut moved) = (device.read().expect("the device returns a state"), 0);
    while !driver.seen().hostile.is_empty() {
        let state = device.read().unwrap_or_else(|error| panic!("seed {HOSTILE_SEED:#x}: {error}"));
        device.write(&up(0.5)).expect("the driver accepts the write");
        assert!(state.pose.translation.length() <= 0.01, "seed {HOSTILE_SEED:#x}: {state:?}");
        assert_eq!((state.pose.rotation, state.twist), (DQuat::IDENTITY, Twist::default()), "seed {HOSTILE_SEED:#x}");
        assert!(state.time >= last.time, "seed {HOSTILE_SEED:#x}");
        moved += u32::from(state.pose != last.pose);
        last = state;
        std::thread::sleep(Duration::from_micros(200));
    }
    assert!(moved > 100, "the valid states must still arrive: {moved}");
    let applied = &driver.seen().applied;
    assert!(applied.iter().all(|wrench| *wrench == up(0.5) || *wrench == Wrench::ZERO), "seed {HOSTILE_SEED:#x}");
    if WAYS.contains(&Way::Path) {
        // Over UDP, some frames of a flood may be lost.
        let ignored = || device.counts().ignored;
        assert!(comes_to(|| ignored() >= HOSTILE as u64), "seed {HOSTILE_SEED:#x}: {} of {HOSTILE}", ignored());
        assert_eq!((ignored(), device.counts().lost), (HOSTILE as u64, 0), "seed {HOSTILE_SEED:#x}");
    }
}

const BENT_SEED: u64 = 0xb3a7_f4a3_e001;

#[test]
fn damaged_frame_is_refused_or_has_finite_values() {
    let mut random = Random::new(BENT_SEED);
    for round in 0..100_000 {
        let bytes = hostile(&mut random, 7);
        let Ok(frame) = decode(&bytes) else { continue };
        let mut buffer = [0; LONGEST];
        let again = encode(&frame, &mut buffer);
        let finite = match &frame.body {
            Body::State(state) => state.pose.is_valid() && state.twist.linear.is_finite() && state.applied.is_finite(),
            Body::Command(command) => command.wrench.is_finite(),
            _ => true,
        };
        assert!(finite && again.len() == bytes.len(), "seed {BENT_SEED:#x}, round {round}: {frame:?}");
    }
}
