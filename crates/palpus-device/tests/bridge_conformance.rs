//! Tests that the conformance tester finds each defect, and that the test driver and the examples
//! pass.
#![allow(clippy::print_stderr, reason = "a skipped test prints the reason")]

mod bridge_driver;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use bridge_driver::{Behaviour, DEFECTS, Defect, StandIn, WAYS, Way, new_path};
use palpus_device::{BridgeAddress, Check, conformance};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn failures(checks: &[Check]) -> Vec<String> {
    let failed = |check: &Check| check.outcome.as_ref().err().map(|why| format!("{}: {why}", check.name));
    checks.iter().filter_map(failed).collect()
}

fn assert_conforms(address: &BridgeAddress) {
    let checks = conformance(address).expect("the driver listens");
    assert_eq!(failures(&checks), [""; 0], "{address}");
    assert_eq!(checks.len(), 11, "{address}");
}

#[test]
fn good_driver_passes() {
    for way in WAYS {
        assert_conforms(&StandIn::start(Behaviour::good(*way)).address);
    }
    assert_conforms(&StandIn::start(Behaviour { rate_hz: 4000.0, ..Behaviour::good(WAYS[0]) }).address);
    // An input device without motors also passes.
    assert_conforms(&StandIn::start(Behaviour { force_max: 0.0, ..Behaviour::good(WAYS[0]) }).address);
}

#[test]
fn every_defect_is_found() {
    let named = |defect| match defect {
        Defect::SpeaksVersion2 => "answers a hello",
        Defect::StreamsEarly => "sends nothing before",
        Defect::HalfTheRate | Defect::SkipsNumbers | Defect::ClockStands => "numbers states from 1",
        Defect::EchoesNothing => "echoes commands",
        Defect::PushesAskew | Defect::PushesUnasked => "applies a valid wrench",
        Defect::NeverExpires | Defect::ExpiresUnsaid => "goes to zero",
        Defect::PushesUnknowing => "before the last zero",
        Defect::PushesStale => "older than its validity",
        Defect::IgnoresCheck | Defect::IgnoresSequence | Defect::IgnoresNonce => "ignores damaged",
        Defect::SameSession | Defect::GoesOnAfterClose => "ends a closed session",
    };
    std::thread::scope(|scope| {
        // Two tests run at a time, since each mostly waits for its driver.
        for defects in DEFECTS.chunks(DEFECTS.len().div_ceil(2)) {
            scope.spawn(move || {
                for defect in defects {
                    let driver = StandIn::start(Behaviour { defect: Some(*defect), ..Behaviour::good(WAYS[0]) });
                    let found = failures(&conformance(&driver.address).expect("the driver listens"));
                    let is_named = found.iter().any(|failure| failure.contains(named(*defect)));
                    assert!(is_named, "{defect:?} was not found; the tester found {found:?}");
                }
            });
        }
    });
}

/// An example program that runs until the end of its test.
struct Program(Child);

impl Program {
    /// Starts the program, and waits until it listens.
    fn start(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program starts");
        let mut line = String::new();
        let heard = BufReader::new(child.stdout.take().expect("the program has an output")).read_line(&mut line);
        let program = Self(child);
        assert!(heard.is_ok() && line.starts_with("listening at"), "{line}");
        program
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns the addresses at which an example is tested: a path, and a free port.
fn addresses() -> Vec<BridgeAddress> {
    let port =
        std::net::UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("there is a free port");
    let of = |way: &Way| match way {
        Way::Path => BridgeAddress::Path(new_path()),
        Way::Udp => BridgeAddress::Udp(port),
    };
    WAYS.iter().map(of).collect()
}

/// Returns the first of these programs that is installed.
fn first_of(programs: &[&str]) -> Option<String> {
    let works = |name: &&&str| {
        let version = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        version.is_ok_and(|status| status.success())
    };
    let found = programs.iter().find(works).map(|name| (*name).to_owned());
    if found.is_none() {
        eprintln!("skipped: none of {programs:?} is installed");
    }
    found
}

#[test]
fn python_example_passes() {
    let Some(python) = first_of(&["python3", "python"]) else { return };
    for address in addresses() {
        let script = root().join("examples/bridge/driver.py");
        let mut command = Command::new(&python);
        // Half the usual rate, since other tests run at the same time.
        command.arg("-B").arg(script).arg(address.to_string()).args(["--rate", "500"]);
        let _driver = Program::start(&mut command);
        assert_conforms(&address);
    }
}

#[test]
fn c_example_passes() {
    let Some(compiler) = first_of(&["cc", "gcc", "clang"]).filter(|_| cfg!(target_os = "linux")) else { return };
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bridge-driver");
    let mut command = Command::new(compiler);
    command.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-I"]).arg(root().join("include"));
    command.arg("-o").arg(&program).arg(root().join("examples/bridge/driver.c")).arg("-lm");
    let compiled = command.output().expect("the compiler runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    for address in addresses() {
        let _driver = Program::start(Command::new(&program).arg(address.to_string()));
        assert_conforms(&address);
    }
}

#[test]
fn ros_2_adapter_is_valid_python() {
    let Some(python) = first_of(&["python3", "python"]) else { return };
    let script = root().join("examples/bridge/ros2/palpus_ros2.py");
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut command = Command::new(python);
    command.env("PYTHONPYCACHEPREFIX", cache).args(["-m", "py_compile"]).arg(script);
    let compiled = command.output().expect("python runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}
