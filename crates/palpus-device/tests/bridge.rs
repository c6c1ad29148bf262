//! Tests of devices behind the bridge: sessions and their ends, wrenches, and a driver that runs at
//! 4 kHz.
#![allow(clippy::print_stdout, reason = "the run of a minute prints its counts")]

mod bridge_driver;

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use bridge_driver::client::{comes_to, open, try_open, up};
use bridge_driver::{Behaviour, Defect, Seen, StandIn, WAYS, Way, new_path, pose};
use palpus::algebra::{Pose, Wrench};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::bridge_frames::Command;
use palpus_device::{
    BridgeAddress, BridgeCounts, BridgeDevice, DeviceError, DeviceState, HapticDevice, PlacedDevice, RunEnd,
    RunStatistics, Servo, ServoOptions, ServoTick, StepOutcome, WallTime, self_test,
};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Reads and writes in a loop until the driver applies `wrench`. Returns false if the driver never
/// applies it.
fn push(device: &mut BridgeDevice, driver: &StandIn, wrench: Wrench) -> bool {
    comes_to(|| {
        device.read().expect("the device returns a state");
        device.write(&wrench).expect("the driver accepts the write");
        driver.seen().applied.last() == Some(&wrench)
    })
}

/// Runs a loop with a floor at the start height for `seconds`. Also returns the number of
/// allocations after the first tick.
fn run(device: BridgeDevice, rate_hz: f64, seconds: f64) -> (RunStatistics, u64, BridgeCounts) {
    run_with(device, rate_hz, seconds, |state| {
        let depth = (-state.pose.translation.z).max(0.0);
        up(100.0 * depth)
    })
}

fn run_with(
    device: BridgeDevice,
    rate_hz: f64,
    seconds: f64,
    mut wrench: impl FnMut(&DeviceState) -> Wrench,
) -> (RunStatistics, u64, BridgeCounts) {
    let mut device = Counted { device: PlacedDevice::new(device, Pose::IDENTITY) };
    let mut servo = Servo::new(ServoOptions { rate_hz, duration: Some(seconds), ..Default::default() })
        .expect("the options are valid");
    let (mut first, mut last) = (None, 0);
    let mut observer = |_: &ServoTick, _: &()| {
        last = allocations_of_this_thread();
        first.get_or_insert(last);
    };
    let step = |state: &DeviceState, _: f64| StepOutcome::of(wrench(state));
    let statistics = servo.run(&mut device.device, step, &mut observer, &AtomicBool::new(false));
    let counts = device.counts();
    (statistics, last - first.unwrap_or(last), counts)
}

/// A placed device does not expose its inner device, so the counts are read by name.
struct Counted {
    device: PlacedDevice<BridgeDevice>,
}

impl Counted {
    fn counts(&self) -> BridgeCounts {
        let of = |name: &str| {
            let counts = self.device.counts();
            counts.iter().find(|count| count.0.contains(name)).map_or(0, |count| count.1)
        };
        BridgeCounts { lost: of("lost"), ignored: of("ignored"), unsent: of("not sent"), ..Default::default() }
    }
}

#[test]
fn loop_applies_force_without_allocating_and_ends_with_zero() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour::good(*way));
        let (statistics, allocations, counts) = run(open(&driver), 1000.0, 1.5);
        assert_eq!((statistics.end, allocations), (RunEnd::Duration, 0), "{way:?}");
        assert_eq!((counts.lost, counts.ignored), (0, 0), "{way:?}");
        let Seen { applied, commands, .. } = driver.end();
        assert!(applied.iter().all(|wrench| (0.0..=2.0 + 1e-6).contains(&wrench.force.z)), "{way:?}");
        assert!(applied.iter().any(|wrench| wrench.force.z > 0.0), "{way:?}: a force must have been applied");
        assert_eq!(commands.last().map(|command| command.wrench), Some(Wrench::ZERO), "{way:?}");
    }
}

#[test]
fn loop_gets_the_states_of_the_driver() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour::good(*way));
        let mut device = open(&driver);
        assert_eq!(device.spec(), &bridge_driver::spec());
        let first = device.read().expect("the device returns a state");
        assert!(comes_to(|| device.read().expect("the device returns a state").time > first.time + 0.05), "{way:?}");
        let state = device.read().expect("the device returns a state");
        let known = (1..=driver.seen().sent).any(|sequence| pose(sequence, 1000.0) == state.pose);
        assert!(known && state.time > 0.0, "{way:?}: {state:?}");
    }
}

#[test]
fn wrench_ends_when_the_loop_stops_writing() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour::good(*way));
        let mut device = open(&driver);
        assert!(push(&mut device, &driver, up(1.0)), "{way:?}");
        assert!(comes_to(|| driver.seen().applied.last() == Some(&Wrench::ZERO)), "{way:?}");
        // The session stays open, and a wrench that is based on an earlier state is not applied.
        std::thread::sleep(Duration::from_millis(400));
        device.write(&up(1.0)).expect("the driver accepts the write");
        std::thread::sleep(Duration::from_millis(30));
        assert_eq!(driver.seen().applied.last(), Some(&Wrench::ZERO), "{way:?}");
        let withheld = device.read().expect("the device returns a state").withheld;
        assert!(withheld, "{way:?}: the loop must see the interruption");
        device.write(&Wrench::ZERO).expect("the driver accepts the write");
        assert!(comes_to(|| !device.read().expect("the device returns a state").withheld), "{way:?}");
        assert!(push(&mut device, &driver, up(1.0)), "{way:?}");
    }
}

#[test]
fn good_driver_passes_the_self_test() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour::good(*way));
        let passed = self_test(&mut open(&driver), &WallTime::new()).expect("the device passes the self test");
        assert!(passed.brake && passed.watchdog.is_some() && passed.own_watchdog.is_some(), "{way:?}: {passed:?}");
        assert!(driver.end().commands.iter().all(|command| command.wrench == Wrench::ZERO), "{way:?}");
    }
}

#[test]
fn ended_wrench_does_not_return_at_once() {
    let driver = StandIn::start(Behaviour::good(WAYS[0]));
    let mut device = open(&driver);
    assert!(push(&mut device, &driver, up(2.0)));
    device.read().expect("the device returns a state");
    device.write(&up(2.0)).expect("the driver accepts the write");
    // The step takes so long that the listener sends zero.
    let zero = |commands: &[Command]| commands.last().is_some_and(|command| command.wrench == Wrench::ZERO);
    assert!(comes_to(|| zero(&driver.seen().commands)));
    device.write(&up(2.0)).expect("the driver accepts the write");
    let count = driver.seen().commands.len();
    assert!(device.read().expect("the device returns a state").withheld);
    assert!(comes_to(|| driver.seen().commands.len() > count));
    assert!(zero(&driver.seen().commands), "{:?}", driver.seen().commands.last());
}

#[test]
fn brake_removes_the_wrench_from_any_thread() {
    let driver = StandIn::start(Behaviour::good(WAYS[0]));
    let mut device = open(&driver);
    assert!(push(&mut device, &driver, up(2.0)));
    let brake = device.brake().expect("the device has a brake");
    std::thread::scope(|scope| scope.spawn(|| brake.apply()).join()).expect("no thread has panicked");
    assert!(comes_to(|| driver.seen().applied.last() == Some(&Wrench::ZERO)));
    let from = driver.seen().applied.len();
    assert!(comes_to(|| {
        device.read().expect("the device returns a state");
        device.write(&up(2.0)).expect("the driver accepts the write");
        driver.seen().applied.len() > from + 20
    }));
    assert!(driver.seen().applied[from..].iter().all(|wrench| *wrench == Wrench::ZERO));
    brake.release();
    assert!(push(&mut device, &driver, up(2.0)));
}

#[test]
fn state_is_withheld_while_the_driver_withholds() {
    let driver = StandIn::start(Behaviour::good(WAYS[0]));
    let mut device = open(&driver);
    let mut reads = |withheld: bool| {
        comes_to(|| {
            let state = device.read().expect("the device returns a state");
            device.write(&Wrench::ZERO).expect("the driver accepts the write");
            state.withheld == withheld
        })
    };
    assert!(reads(false));
    driver.withhold(true);
    assert!(reads(true));
    driver.withhold(false);
    assert!(reads(false));
}

#[test]
fn withheld_force_returns_slowly() {
    // On a busy machine the loop may stall, and this fault removes the force for the rest of the
    // run. The run is then repeated.
    let forces = (0..5).find_map(|_| forces_around_withholding()).expect("one of five runs has no fault");
    let is_full = |force: &f64| (force - FULL).abs() < 1e-12;
    let at_full = forces.iter().position(is_full).expect("the full force must be applied first");
    let away = at_full + forces[at_full..].iter().position(|force| *force == 0.0).expect("the force must be withheld");
    let back = away + forces[away..].iter().position(|force| *force != 0.0).expect("the force must return");
    assert!(forces[back..].iter().any(is_full), "the full force must return");
    for (before, after) in forces[back - 1..].iter().zip(&forces[back..]) {
        // The limit is 5 N in 50 ms, plus the change of a few skipped ticks.
        assert!(after - before <= 0.5, "from {before} to {after} N in one message");
    }
}

/// Computed force before and after the withholding, N.
const FULL: f64 = 4.0;

/// Returns the forces of all commands in a run in which the driver withholds for 60 ms; `None`
/// after a fault.
fn forces_around_withholding() -> Option<Vec<f64>> {
    let driver = StandIn::start(Behaviour::good(WAYS[0]));
    let device = open(&driver);
    let mut ticks = 0u32;
    let step = |_: &DeviceState| {
        ticks += 1;
        driver.withhold((1000..1060).contains(&ticks));
        // The force is small until the device is engaged.
        if ticks > 600 { up(FULL) } else { Wrench::ZERO }
    };
    let (statistics, ..) = run_with(device, 1000.0, 1.5, step);
    assert_eq!(statistics.end, RunEnd::Duration);
    let commands = driver.end().commands;
    (statistics.safety.faults() == 0).then(|| commands.iter().map(|command| command.wrench.force.z).collect())
}

#[test]
fn silent_driver_is_withheld_and_then_lost() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour::good(*way));
        let mut device = open(&driver);
        driver.fall_silent();
        let mut withheld = 0;
        let lost = comes_to(|| match device.read() {
            Ok(state) => {
                withheld += u32::from(state.withheld);
                false
            }
            Err(DeviceError::Lost(why)) => why.contains("no state for 250 ms") && why.contains("start the run again"),
            Err(_) => false,
        });
        assert!(lost && withheld > 0, "{way:?}: {withheld}");
        assert!(matches!(device.write(&Wrench::ZERO), Err(DeviceError::Lost(_))), "{way:?}");
    }
}

#[test]
fn closed_session_loses_the_device_with_the_reason() {
    for way in WAYS {
        let driver = StandIn::start(Behaviour { closes_after: Some(50), ..Behaviour::good(*way) });
        let (statistics, ..) = run(open(&driver), 1000.0, 20.0);
        let RunEnd::DeviceFailed(error) = &statistics.end else { panic!("{way:?}: {:?}", statistics.end) };
        assert!(error.to_string().contains("ended the session: out of oil"), "{way:?}: {error}");
        let driver = StandIn::start(Behaviour::good(*way));
        let mut device = open(&driver);
        driver.end();
        assert!(comes_to(|| matches!(device.read(), Err(DeviceError::Lost(_)))), "{way:?}");
    }
}

#[test]
fn uncommanded_force_loses_the_device() {
    let driver = StandIn::start(Behaviour { defect: Some(Defect::PushesUnasked), ..Behaviour::good(WAYS[0]) });
    let mut device = open(&driver);
    let lost = |error: &DeviceError| error.to_string().contains("applies 1.0 N although the command is zero");
    assert!(comes_to(|| device.read().is_err_and(|error| lost(&error))));
}

#[test]
fn unusable_driver_gives_a_named_error() {
    let error = |address: &BridgeAddress| try_open(address).err().expect("the session must not open").to_string();
    let nowhere = if WAYS.contains(&Way::Path) {
        BridgeAddress::Path(new_path())
    } else {
        BridgeAddress::parse("udp:127.0.0.1:9").expect("the address is valid")
    };
    assert!(error(&nowhere).contains("no driver listens at"), "{}", error(&nowhere));
    let slow = StandIn::start(Behaviour { rate_hz: 60.0, ..Behaviour::good(WAYS[0]) });
    assert!(error(&slow.address).contains("500 are needed"), "{}", error(&slow.address));
    let newer = StandIn::start(Behaviour { defect: Some(Defect::SpeaksVersion2), ..Behaviour::good(WAYS[0]) });
    assert!(error(&newer.address).contains("version 2 of the protocol"), "{}", error(&newer.address));
    // A driver accepts only one session at a time.
    let busy = StandIn::start(Behaviour::good(Way::Udp));
    let _first = open(&busy);
    assert!(error(&busy.address).contains("session with another program"), "{}", error(&busy.address));
}

/// Runs a driver and a loop at 4 kHz. No frame may be lost, even if one side is late.
fn four_kilohertz(way: Way, seconds: f64) {
    let driver = StandIn::start(Behaviour { rate_hz: 4000.0, ..Behaviour::good(way) });
    let (statistics, allocations, counts) = run(open(&driver), 4000.0, seconds);
    assert_eq!((statistics.end, allocations), (RunEnd::Duration, 0), "{way:?}");
    assert_eq!((counts.lost, counts.ignored, counts.unsent), (0, 0, 0), "{way:?}");
    let Seen { sent, commands, lost_commands, .. } = driver.end();
    println!("{way:?}: {sent} states, {} commands, none lost", commands.len());
    assert_eq!(lost_commands, 0, "{way:?}");
    assert!(sent > 0 && commands.len() as u64 > statistics.ticks / 2, "{way:?}: {sent}, {}", commands.len());
}

#[test]
fn no_frame_is_lost_at_four_kilohertz() {
    for way in WAYS {
        four_kilohertz(*way, 1.0);
    }
}

#[test]
#[ignore = "takes a minute for each kind of socket"]
fn no_frame_is_lost_in_a_minute() {
    for way in WAYS {
        four_kilohertz(*way, 60.0);
    }
}
