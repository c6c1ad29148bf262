//! The gate and the safety chain, for a device with arbitrary specifications and states, and for
//! arbitrary wrenches. Results are finite, within the peak limits, and zero while the start-up is
//! idle.
#![no_main]

use std::borrow::Cow;

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{
    AfterFault, AfterPanic, Axes, Cut, Cuts, DeviceSpec, DeviceState, EnableMode, Gate, Phase, SafetyChain,
    SafetyLimits, SafetyOptions, known_devices,
};
use palpus_fuzz::{Allowance, Bytes, Seed, check, target};

/// Allowed excess of a wrench over its limit, relative to the limit. [`SMALLEST`] is the absolute
/// allowance for subnormal numbers, which have few digits.
const ROUNDING: f64 = 1e-12;
const SMALLEST: f64 = 1e-300;
/// Allowed rounding of the change that the slew limit allows, relative to the change.
const SLEW_ROUNDING: f64 = 1e-6;

/// Returns a number as a device may report it.
fn stated(bytes: &mut Bytes<'_>, usual: f64) -> f64 {
    match bytes.byte() {
        0..=150 => usual,
        151..=210 => bytes.between(1e-6 * usual, 1e6 * usual),
        _ => bytes.any(),
    }
}

fn spec(bytes: &mut Bytes<'_>) -> DeviceSpec {
    let axes =
        |bytes: &mut Bytes<'_>| Axes { translation: bytes.byte(), rotation: bytes.byte(), gripper: bytes.byte() };
    let names: Vec<Cow<'static, str>> = known_devices().into_iter().map(|known| known.name).collect();
    let known = bytes.below(2 * names.len());
    DeviceSpec {
        name: names.get(known).cloned().unwrap_or(Cow::Borrowed("another")),
        force_max: stated(bytes, 8.5),
        torque_max: stated(bytes, 0.2),
        force_continuous: bytes.rarely().then(|| stated(bytes, 1.4)),
        torque_continuous: bytes.rarely().then(|| stated(bytes, 0.05)),
        actuated: axes(bytes),
        sensed: axes(bytes),
        buttons: bytes.byte(),
        workspace: bytes.rarely().then(|| DVec3::new(stated(bytes, 0.2), stated(bytes, 0.2), stated(bytes, 0.2))),
        delay: stated(bytes, 1e-3),
        position_step: stated(bytes, 3e-5),
        angle_step: stated(bytes, 2.5e-4),
    }
}

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let spec = spec(&mut bytes);
    let rate = [500.0, 1000.0, 4000.0, 10_000.0][bytes.below(4)];
    let flags = bytes.byte();
    let options = SafetyOptions {
        enable_mode: match flags & 3 {
            0 => None,
            1 => Some(EnableMode::Automatic),
            2 => Some(EnableMode::Button(u32::from(bytes.byte()))),
            _ => Some(EnableMode::DeadMan(u32::from(bytes.byte()))),
        },
        after_fault: if flags & 4 == 0 { AfterFault::default() } else { AfterFault::Stop },
        after_panic: if flags & 8 == 0 { AfterPanic::Stop } else { AfterPanic::AsFault },
        ..SafetyOptions::default()
    };
    let limits = SafetyLimits::of(&spec, rate);
    assert!(
        limits.is_valid() && limits.explained().iter().all(|line| line.value.is_finite()),
        "{limits:?} of {spec:?}"
    );
    let period = 1.0 / rate;
    let mut chain = SafetyChain::new(&limits, options.enable_mode(&spec), &options, period);
    let mut gate = Gate::new(&limits);
    let mut state =
        DeviceState { pose: bytes.pose(0.1), twist: Default::default(), buttons: 1, time: 0.0, withheld: false };
    let (mut before, mut last) = (Wrench::ZERO, Wrench::ZERO);
    for _ in 0..400 {
        match bytes.byte() {
            0..=120 => {
                state.pose.translation += 1e-5 * bytes.point();
                state.time += period;
            }
            121..=180 => state.time += period,
            181..=210 => state.twist = bytes.twist(),
            211..=220 => state.buttons = u32::from(bytes.byte()),
            221..=230 => state.time = bytes.any(),
            231..=240 => state.pose = bytes.pose(0.1),
            _ => state.pose = bytes.wild_pose(),
        }
        let elapsed = if bytes.rarely() { bytes.any() } else { period };
        let admitted = gate.admit(&state, elapsed);
        let usable = admitted.state.unwrap_or(DeviceState { twist: Default::default(), ..state });
        if let Some(good) = admitted.state {
            assert!(good.pose.is_valid(), "{good:?}");
        }
        let bits = u32::from(bytes.short()) | u32::from(bytes.byte()) << 16;
        let inputs = if bytes.rarely() { Cuts::from_bits(bits).and(Cuts::INPUTS) } else { Cuts::NONE };
        let wrench = match bytes.byte() {
            0..=100 => before,
            101..=220 => Wrench { force: 10.0 * bytes.point(), torque: 0.1 * bytes.point() },
            _ => Wrench { force: DVec3::new(bytes.any(), bytes.any(), bytes.any()), torque: DVec3::splat(bytes.any()) },
        };
        before = wrench;
        let shaped = chain.shape(&usable, &wrench, admitted.cuts.or(inputs), elapsed);
        let given = shaped.wrench;
        assert!(given.is_finite(), "{shaped:?}");
        let slack = 1.0 + ROUNDING;
        let within = [(given.force, limits.force_peak), (given.torque, limits.torque_peak)];
        assert!(within.iter().all(|&(v, most)| check::within(v, slack * most + SMALLEST)), "{shaped:?} of {limits:?}");
        // The force falls as fast as the slew limit allows, until it is below the limit for rest.
        let is_falling = given.force.length() <= slack * last.force.length().max(limits.rest_force)
            && given.force.distance(last.force) >= (1.0 - SLEW_ROUNDING) * limits.force_slew * period;
        if shaped.cuts.has(Cut::Withheld) {
            assert!(given.force == DVec3::ZERO || is_falling, "{shaped:?} after {last:?} of {limits:?}");
        }
        if shaped.cuts.is_fault() {
            assert!(matches!(shaped.phase, Phase::Faulted | Phase::Stopped | Phase::Latched), "{shaped:?}");
            let is_rest = check::within(given.force, slack * limits.rest_force + SMALLEST);
            assert!(is_rest || is_falling, "{shaped:?} after {last:?} of {limits:?}");
        }
        last = given;
        assert!(chain.heat().is_finite());
        if bytes.is_empty() {
            break;
        }
    }
}

fn seeds() -> Vec<Seed> {
    let head = [0, 100, 100, 0, 0, 3, 3, 0, 3, 3, 0, 1, 0, 100, 1, 1, 0, 100, 100, 100];
    let engaged: Vec<u8> =
        (0..200u8).flat_map(|k| [10, 100, 100, 101, 0, 0, 110, 100 + k / 16, 100, 100, 100, 100, 100]).collect();
    let faults: Vec<u8> =
        (0..60u8).flat_map(|k| [k, 100, 100, 101, 0, 255 - k, 4, 110, 100, 100, 120, 100, 100, 100]).collect();
    vec![("engaged".to_owned(), [&head[..], &engaged].concat()), ("faults".to_owned(), [&head[..], &faults].concat())]
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 1 << 20 }, seeds: seeds);
