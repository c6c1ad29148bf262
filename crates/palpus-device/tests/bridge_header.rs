//! Tests that `include/palpus_bridge.h` and the Rust code use the same byte layout.
#![allow(clippy::print_stderr, reason = "a skipped test prints the reason")]

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus_device::bridge_frames::{self as frames, Body, Frame, LONGEST, READY, State, WITHHELD, Welcome, encode};
use palpus_device::{Axes, DeviceSpec};

/// Returns one frame of each kind; every field has a different value.
fn frames() -> Vec<Frame> {
    let spec = DeviceSpec {
        name: Cow::Borrowed("an arm"),
        force_max: 8.5,
        torque_max: 0.5,
        force_continuous: Some(1.5),
        torque_continuous: Some(0.25),
        actuated: Axes { translation: 3, rotation: 2, gripper: 1 },
        sensed: Axes { translation: 2, rotation: 3, gripper: 0 },
        buttons: 4,
        workspace: Some(DVec3::new(0.5, 0.75, 0.125)),
        delay: 0.0625,
        position_step: 0.0,
        angle_step: 0.0,
    };
    let command = frames::Command {
        echo: 51,
        time_ns: 52,
        wrench: Wrench { force: DVec3::new(1.5, 2.5, 3.5), torque: DVec3::new(4.5, 5.5, 6.5) },
        valid_for_us: 20_000,
    };
    let state = State {
        time_ns: 61,
        pose: Pose { translation: DVec3::new(1.25, 2.25, 3.25), rotation: DQuat::from_xyzw(0.5, -0.5, 0.5, -0.5) },
        twist: Twist { linear: DVec3::new(4.25, 5.25, 6.25), angular: DVec3::new(7.25, 8.25, 9.25) },
        applied: Wrench { force: DVec3::new(10.5, 11.5, 12.5), torque: DVec3::new(13.5, 14.5, 15.5) },
        echo: 62,
        buttons: 5,
        flags: READY | WITHHELD,
    };
    let bodies = [
        Body::Hello { rate_hz: 1000.5 },
        Body::Welcome(Welcome { session: 41, rate_hz: 2000.5, spec }),
        Body::Command(command),
        Body::State(state),
        Body::Close("enough".into()),
    ];
    let frame = |(k, body)| Frame { nonce: 100 + k, sequence: 200 + k, body };
    (0u64..).zip(bodies).map(frame).collect()
}

const EXPECTED: &str = "\
kind 1 size 40 version 1 nonce 100 sequence 200
rate_hz 1000.5
kind 2 size 184 version 1 nonce 101 sequence 201
session 41 name an arm
limits 8.5 0.5 1.5 0.25
workspace 0.5 0.75 0.125
delay_s 0.0625 rate_hz 2000.5
axes 3 2 1 2 3 0 buttons 4
kind 3 size 104 version 1 nonce 102 sequence 202
echo 51 time_ns 52
force 1.5 2.5 3.5
torque 4.5 5.5 6.5
valid_for_us 20000
sealed 1
kind 4 size 208 version 1 nonce 103 sequence 203
time_ns 61
position 1.25 2.25 3.25
orientation 0.5 -0.5 0.5 -0.5
linear 4.25 5.25 6.25
angular 7.25 8.25 9.25
applied_force 10.5 11.5 12.5
applied_torque 13.5 14.5 15.5
echo 62 buttons 5 flags 3
kind 5 size 128 version 1 nonce 104 sequence 204
reason enough
";

#[test]
fn c_header_reads_the_frames_of_rust() {
    let mut input = Vec::new();
    for frame in frames() {
        let mut buffer = [0; LONGEST];
        let bytes = encode(&frame, &mut buffer);
        assert_eq!(frames::decode(bytes).as_ref(), Ok(&frame));
        input.push(bytes.len() as u8);
        input.extend_from_slice(bytes);
    }
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (compiler, standard, language) in [("cc", "-std=c99", "c"), ("c++", "-std=c++17", "c++")] {
        let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bridge-header-{language}"));
        let mut command = Command::new(compiler);
        command.args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]).arg(manifest.join("../../include"));
        command.args(["-x", language]).arg(manifest.join("tests/bridge_header/check.c")).arg("-o").arg(&program);
        let Ok(compiled) = command.output() else {
            eprintln!("skipped: {compiler} is not installed");
            continue;
        };
        assert!(compiled.status.success(), "{standard}: {}", String::from_utf8_lossy(&compiled.stderr));
        let mut check =
            Command::new(&program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program starts");
        check.stdin.take().expect("the program has an input").write_all(&input).expect("the program reads the frames");
        let output = check.wait_with_output().expect("the program has an output");
        assert_eq!(String::from_utf8_lossy(&output.stdout), EXPECTED, "{standard}");
    }
}
