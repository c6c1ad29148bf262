//! Tests of the servo loop with a Haply arm behind a service: the loop does not allocate, and the
//! last force is always zero.

use std::net::{TcpListener, TcpStream};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_device::{
    Cut, DeviceState, HaplyDevice, HaplyOptions, PlacedDevice, RunEnd, RunStatistics, Servo, ServoOptions, ServoTick,
    StepOutcome,
};
use serde_json::{Value, json};
use tungstenite::Message;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Forces that a service received, N, with their times.
type Forces = Mutex<Vec<(Instant, f64)>>;

/// Answer of a service to each message, by the message's number.
type Script = fn(usize) -> Option<Value>;

/// Starts a service with an arm without a grip that moves up and down by 1 cm. Also returns the
/// received forces.
fn service(messages: usize, script: Script) -> (String, Arc<Forces>, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let address = format!("ws://{}", listener.local_addr().expect("the address is valid"));
    let forces = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&forces);
    let thread = std::thread::spawn(move || {
        let (stream, _) = listener.accept().expect("a client connects");
        drop(listener);
        serve(stream, messages, script, &log);
    });
    (address, forces, thread)
}

fn serve(stream: TcpStream, messages: usize, script: Script, forces: &Forces) {
    stream.set_nodelay(true).expect("the socket works");
    let mut socket = tungstenite::accept(stream).expect("the handshake succeeds");
    let mut answered = 0;
    let _ = socket.send(Message::text(state(0).to_string()));
    while answered < messages {
        match socket.read() {
            Ok(Message::Text(text)) => {
                let value: Value = serde_json::from_str(text.as_str()).expect("the message is valid");
                let force = &value["inverse3"][0]["commands"]["set_cursor_force"]["vector"]["z"];
                forces
                    .lock()
                    .expect("no thread has panicked")
                    .push((Instant::now(), force.as_f64().expect("the force is a number")));
                answered += 1;
                if let Some(answer) = script(answered) {
                    let _ = socket.send(Message::text(answer.to_string()));
                }
            }
            Ok(_) => {}
            Err(_) => return,
        }
    }
}

fn state(count: usize) -> Value {
    let (height, speed) = (0.01 * (0.02 * count as f64).sin(), 0.0);
    json!({ "inverse3": [{
        "device_id": "A",
        "config": { "type": "inverse3" },
        "state": { "cursor_position": { "x": 0, "y": 0, "z": height }, "cursor_velocity": { "x": 0, "y": 0, "z": speed } },
        "status": { "ready": true }
    }] })
}

/// Runs a loop with a floor at the start height for `seconds`. Also returns the number of
/// allocations after the first tick.
fn run(address: &str, seconds: f64) -> (RunStatistics, u64) {
    let floor = |state: &DeviceState, _: f64| 100.0 * (-state.pose.translation.z).max(0.0);
    run_with(address, seconds, floor)
}

/// Runs a loop with this force along z (N), a function of the state and the period.
fn run_with(address: &str, seconds: f64, mut force: impl FnMut(&DeviceState, f64) -> f64) -> (RunStatistics, u64) {
    let options = HaplyOptions { address: address.to_owned(), ..HaplyOptions::default() };
    let device = HaplyDevice::open(&options).expect("the device opens");
    let mut device = PlacedDevice::new(device, Pose::IDENTITY);
    let mut servo = Servo::new(ServoOptions { rate_hz: 500.0, duration: Some(seconds), ..Default::default() })
        .expect("the options are valid");
    let (mut first, mut last) = (None, 0);
    let mut observer = |_: &ServoTick, _: &()| {
        last = allocations_of_this_thread();
        first.get_or_insert(last);
    };
    let step = |state: &DeviceState, dt: f64| {
        StepOutcome::of(Wrench { force: DVec3::Z * force(state, dt), torque: DVec3::ZERO })
    };
    let statistics = servo.run(&mut device, step, &mut observer, &AtomicBool::new(false));
    (statistics, last - first.unwrap_or(last))
}

#[test]
fn loop_does_not_allocate_and_ends_with_zero() {
    let (address, forces, thread) = service(usize::MAX, |k| Some(state(k)));
    let (statistics, allocations) = run(&address, 2.0);
    thread.join().expect("the service does not panic");
    assert_eq!(statistics.end, RunEnd::Duration);
    assert_eq!(allocations, 0);
    let forces: Vec<f64> = forces.lock().expect("no thread has panicked").iter().map(|(_, force)| *force).collect();
    // The arm is at most 2 cm below its start height.
    assert!(forces.len() > 100 && forces.iter().all(|force| (0.0..=2.0 + 1e-6).contains(force)), "{forces:?}");
    assert!(forces.iter().any(|force| *force > 0.0), "a force must have been sent");
    assert_eq!(forces.last(), Some(&0.0));
}

#[test]
fn closed_service_ends_the_run_with_a_reason() {
    let (address, _, thread) = service(100, |k| Some(state(k)));
    let (statistics, _) = run(&address, 20.0);
    thread.join().expect("the service does not panic");
    let RunEnd::DeviceFailed(error) = &statistics.end else { panic!("{:?}", statistics.end) };
    assert!(error.to_string().contains("connection to the Inverse Service is lost"), "{error}");
}

/// Returns a state in which this status is false for 40 of every 300 messages.
fn without(status: &str, count: usize) -> Value {
    let mut state = state(count);
    state["inverse3"][0]["status"][status] = json!(!(200..240).contains(&(count % 300)));
    state
}

/// Slew of a returning force, N/s: from zero to the peak of the Inverse3 in 50 ms.
const RETURN_RATE: f64 = 10.0 / 0.05;

#[test]
fn withheld_force_returns_slowly() {
    let scripts: [(&str, Script); 5] = [
        ("not ready", |k| Some(without("ready", k))),
        ("without power", |k| Some(without("power_supply", k))),
        ("an answer lost", |k| if k % 100 == 0 { None } else { Some(state(k)) }),
        ("an answer late", |k| {
            if k % 100 == 0 {
                std::thread::sleep(Duration::from_millis(8));
            }
            Some(state(k))
        }),
        ("an invalid answer", |k| Some(if k % 100 == 0 { json!("no state") } else { state(k) })),
    ];
    for (name, script) in scripts {
        let (address, forces, thread) = service(usize::MAX, script);
        // The force goes between 0 and 6 N about twice per second.
        let mut time = 0.0;
        let wave = move |_: &DeviceState, dt: f64| {
            time += dt;
            3.0 - 3.0 * (12.0 * time).cos()
        };
        let (statistics, _) = run_with(&address, 1.5, wave);
        thread.join().expect("the service does not panic");
        assert!(statistics.safety.ticks(Cut::Withheld) > 0, "{name}: {:?}", statistics.safety);
        let forces = forces.lock().expect("no thread has panicked");
        for pair in forces.windows(2) {
            let [(before, last), (at, force)] = pair else { continue };
            let passed = (*at - *before).as_secs_f64();
            // A tick may be due just before and just after this time.
            let most = RETURN_RATE * (passed + 4e-3);
            assert!(force - last <= most, "{name}: from {last} to {force} N in {passed} s");
        }
        assert!(forces.iter().any(|(_, force)| *force > 3.0), "{name}: a force must be sent");
        assert_eq!(forces.last().map(|(_, force)| *force), Some(0.0), "{name}");
    }
}
