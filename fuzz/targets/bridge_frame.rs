//! Frames of the bridge. The numbers of an accepted frame are in range, and the frame is the same
//! after it is written and read again.
#![no_main]

use palpus_device::bridge_frames::{
    Body, Command, Frame, LONGEST, MOST_VALID_FOR_US, READY, State, WITHHELD, Welcome, decode, encode,
};
use palpus_device::{DeviceSpec, known_device};
use palpus_fuzz::{Allowance, Seed, target};

fn run(data: &[u8]) {
    check(data);
    // Checks the same frame with a valid CRC-32, so that mutations pass the check.
    let mut repaired = data.to_vec();
    if let Some(field) = repaired.get_mut(12..16) {
        field.fill(0);
        let check_sum = crc32fast::hash(&repaired);
        repaired[12..16].copy_from_slice(&check_sum.to_le_bytes());
        check(&repaired);
    }
}

fn check(bytes: &[u8]) {
    let frame = match decode(bytes) {
        Ok(frame) => frame,
        Err(refusal) => {
            let why = refusal.to_string();
            assert!(why.len() < 100 && !why.contains('\n'), "{why}");
            return;
        }
    };
    match &frame.body {
        Body::Hello { rate_hz } => assert!((1.0..=1e5).contains(rate_hz)),
        Body::Welcome(Welcome { rate_hz, spec, .. }) => {
            assert!((1.0..=1e5).contains(rate_hz));
            assert!((1..=64).contains(&spec.name.len()) && !spec.name.chars().any(char::is_control));
            assert!((0.0..=1e9).contains(&spec.force_max) && (0.0..=1e9).contains(&spec.torque_max));
            assert!(spec.buttons <= 30 && spec.actuated.translation <= 3 && spec.sensed.rotation <= 3);
        }
        Body::Command(Command { wrench, valid_for_us, .. }) => {
            assert!(wrench.is_finite() && *valid_for_us <= MOST_VALID_FOR_US);
        }
        Body::State(State { pose, twist, applied, buttons, flags, .. }) => {
            assert!(pose.is_valid() && applied.is_finite() && buttons >> 30 == 0 && flags & !(READY | WITHHELD) == 0);
            assert!(twist.linear.is_finite() && twist.angular.is_finite());
        }
        Body::Close(reason) => assert!(reason.len() <= 96 && !reason.chars().any(char::is_control)),
    }
    let mut buffer = [0; LONGEST];
    let again = encode(&frame, &mut buffer);
    assert_eq!(decode(again).as_ref(), Ok(&frame));
    assert_eq!(again.len(), bytes.len());
}

fn seeds() -> Vec<Seed> {
    let Some(spec) = known_device("Touch X") else { return Vec::new() };
    let spec = DeviceSpec { buttons: 2, delay: 0.001, ..spec };
    let state = State {
        time_ns: 1,
        pose: palpus::algebra::Pose::IDENTITY,
        twist: Default::default(),
        applied: Default::default(),
        echo: 3,
        buttons: 1,
        flags: READY,
    };
    let command = Command { echo: 1, time_ns: 1, valid_for_us: 20_000, ..Command::default() };
    let bodies = [
        ("hello", Body::Hello { rate_hz: 1000.0 }),
        ("welcome", Body::Welcome(Welcome { session: 9, rate_hz: 1000.0, spec })),
        ("command", Body::Command(command)),
        ("state", Body::State(state)),
        ("close", Body::Close("enough".into())),
    ];
    let seed = |(name, body): (&str, Body)| {
        let frame = Frame { nonce: 7, sequence: 8, body };
        (name.to_owned(), encode(&frame, &mut [0; LONGEST]).to_vec())
    };
    bodies.into_iter().map(seed).collect()
}

target!(run: run, allowance: Allowance { per_byte: 8, always: 1 << 12 }, seeds: seeds);
