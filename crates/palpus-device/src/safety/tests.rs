use super::*;
use crate::{DeviceSpec, known_devices};
use palpus::algebra::{Pose, Twist};

const DT: f64 = 1e-3;

fn limits() -> SafetyLimits {
    let [premium, ..] = known_devices();
    SafetyLimits::of(&premium, 1000.0)
}

fn chain_of(limits: &SafetyLimits) -> SafetyChain {
    SafetyChain::new(limits, Engagement::Automatic, &SafetyOptions::default(), DT)
}

/// Engaged, with nothing computed so far.
fn engaged(limits: &SafetyLimits) -> SafetyChain {
    let mut chain = chain_of(limits);
    for _ in 0..400 {
        chain.shape(&at_rest(), &Wrench::ZERO, Cuts::NONE, DT);
    }
    assert_eq!(chain.phase(), Phase::Engaged);
    chain
}

fn at_rest() -> DeviceState {
    DeviceState { pose: Pose::IDENTITY, twist: Twist::default(), buttons: 0, time: 0.0, withheld: false }
}

fn moving(velocity: DVec3) -> DeviceState {
    DeviceState { twist: Twist { angular: velocity * 10.0, linear: velocity }, ..at_rest() }
}

fn force(newtons: DVec3) -> Wrench {
    Wrench { force: newtons, torque: DVec3::ZERO }
}

fn told(cut: Cut) -> Cuts {
    let mut cuts = Cuts::NONE;
    cuts.note(cut, true);
    cuts
}

#[test]
fn what_no_stage_has_a_reason_to_touch_comes_out_to_the_bit() {
    let mut chain = engaged(&limits());
    for k in 0..2000 {
        let t = f64::from(k) * DT;
        let wrench = Wrench {
            force: DVec3::new((9.0 * t).sin() + 0.1, 0.4 * (31.0 * t).cos(), 0.3) * 1.1,
            torque: DVec3::new(0.02 * (17.0 * t).sin(), -0.01, 0.1 / 3.0),
        };
        let shaped = chain.shape(&moving(DVec3::X * 0.3), &wrench, Cuts::NONE, DT);
        assert_eq!((shaped.wrench, shaped.cuts, shaped.phase), (wrench, Cuts::NONE, Phase::Engaged), "tick {k}");
    }
}

#[test]
fn a_jump_of_the_wrench_becomes_a_ramp() {
    let limits = limits();
    let mut chain = engaged(&limits);
    let step = limits.force_slew * DT;
    let target = DVec3::new(0.0, 6.0, -5.0);
    let mut last = DVec3::ZERO;
    for k in 0..3 {
        let shaped = chain.shape(&at_rest(), &force(target), Cuts::NONE, DT);
        assert!(shaped.wrench.force.distance(last) <= step * (1.0 + 1e-12), "tick {k}");
        assert_eq!(shaped.cuts.has(Cut::Slew), k < 1, "tick {k}");
        last = shaped.wrench.force;
    }
    assert_eq!(last, target);
    // And the other way round: through nothing, not over it.
    let shaped = chain.shape(&at_rest(), &force(-target), Cuts::NONE, DT);
    assert!(shaped.cuts.has(Cut::Slew) && shaped.wrench.force.dot(target) > 0.0);
}

#[test]
fn on_the_ramp_a_jump_of_the_wrench_is_slewed_before_the_ramp_takes_its_share() {
    let limits = limits();
    let mut chain = chain_of(&limits);
    for _ in 0..125 {
        chain.shape(&at_rest(), &Wrench::ZERO, Cuts::NONE, DT);
    }
    let mut last = 0.0;
    for _ in 0..2 {
        let shaped = chain.shape(&at_rest(), &force(DVec3::X * 8.0), Cuts::NONE, DT);
        let step = (shaped.wrench.force.x - last) / (limits.force_slew * DT);
        assert!(shaped.phase == Phase::Ramping && (0.4..0.55).contains(&step), "{step} of the slew limit");
        last = shaped.wrench.force.x;
    }
}

#[test]
fn beyond_the_peak_the_direction_stays_and_only_the_peak_is_counted() {
    let mut limits = limits();
    limits.force_continuous = limits.force_peak;
    let mut chain = engaged(&limits);
    let wanted = Wrench { force: DVec3::new(30.0, 0.0, 40.0), torque: DVec3::Y };
    let mut shaped = chain.shape(&at_rest(), &wanted, Cuts::NONE, DT);
    assert!(shaped.cuts.has(Cut::Slew));
    for _ in 0..5 {
        shaped = chain.shape(&at_rest(), &wanted, Cuts::NONE, DT);
    }
    assert!(shaped.cuts.iter().eq([Cut::Saturation]), "{:?}", shaped.cuts);
    assert!((shaped.wrench.force.normalize() - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
    assert!(shaped.wrench.force.length() <= 8.5 && shaped.wrench.force.length() > 8.499);
    assert!(shaped.wrench.torque.length() <= 0.188 && shaped.wrench.torque.y > 0.187);
}

#[test]
fn a_device_without_torque_misses_none() {
    let touch = known_devices().into_iter().find(|spec| spec.name == "Touch").expect("it is known");
    let limits = SafetyLimits::of(&touch, 1000.0);
    let mut chain = engaged(&limits);
    let wrench = Wrench { force: DVec3::X * 0.5, torque: DVec3::Y * 0.4 };
    let shaped = chain.shape(&at_rest(), &wrench, Cuts::NONE, DT);
    assert_eq!((shaped.wrench, shaped.cuts), (force(wrench.force), Cuts::NONE));
}

#[test]
fn held_beyond_the_rating_the_force_sinks_to_it() {
    for (held, patience) in [(4.0, 2.0..4.0), (8.0, 0.5..1.0)] {
        let mut chain = engaged(&limits());
        let mut first = None;
        let mut shaped = chain.shape(&at_rest(), &Wrench::ZERO, Cuts::NONE, DT);
        for k in 0..60_000 {
            // On its way up within the slew limit, then held.
            let force = force(DVec3::X * (f64::from(k) * 2.0).min(held));
            shaped = chain.shape(&at_rest(), &force, Cuts::NONE, DT);
            if shaped.cuts.has(Cut::Heat) {
                first.get_or_insert(f64::from(k) * DT);
            }
            assert!(shaped.cuts.and(Cuts::FAULTS).is_none() && !shaped.cuts.has(Cut::Slew), "the cap sinks gently");
        }
        let first = first.expect("it stays beyond 1.4 N");
        assert!(patience.contains(&first), "{held} N for {first} s");
        assert!((shaped.wrench.force.x - 1.4).abs() < 0.05 && chain.heat() <= 1.0);
    }
}

#[test]
fn a_fault_takes_everything_at_once_and_leaves_damping() {
    let limits = limits();
    for cut in Cut::ALL.into_iter().filter(|cut| cut.is_fault() && *cut != Cut::NonFiniteWrench) {
        let mut chain = engaged(&limits);
        for k in 0..20 {
            chain.shape(&sample(k), &force(DVec3::X * 3.0), Cuts::NONE, DT);
        }
        let state = sample(20);
        let shaped = chain.shape(&state, &force(DVec3::X * 3.0), told(cut), DT);
        let name = cut.name();
        assert_ne!(shaped.phase, Phase::Engaged, "{name}");
        assert!(shaped.wrench.force.length() <= limits.rest_force, "{name}");
        assert!(shaped.wrench.torque.length() <= limits.rest_torque, "{name}");
        assert!(shaped.wrench.power(&state.twist) <= 0.0, "{name}");
        assert_eq!(shaped.wrench == Wrench::ZERO, told(cut).and(Cuts::BLIND) != Cuts::NONE, "{name}");
    }
}

#[test]
fn a_wrench_that_is_none_is_a_fault_and_so_is_one_of_the_third_stage() {
    struct Broken;
    impl Passivity for Broken {
        fn limit(&mut self, computed: &Wrench, _: &DeviceState, _: f64) -> Wrench {
            Wrench { torque: DVec3::splat(f64::NAN), ..*computed }
        }
        fn commanded(&mut self, _: &Wrench) {}
        fn reset(&mut self) {}
    }
    let mut chain = engaged(&limits());
    let bad = Wrench { force: DVec3::X, torque: DVec3::new(0.0, f64::INFINITY, 0.0) };
    let shaped = chain.shape(&at_rest(), &bad, Cuts::NONE, DT);
    assert_eq!((shaped.wrench, shaped.phase), (Wrench::ZERO, Phase::Faulted));
    assert!(shaped.cuts.has(Cut::NonFiniteWrench));
    let mut chain = chain_of(&SafetyLimits { ramp: 0.0, ..limits() }).with_passivity(Some(Box::new(Broken)));
    let shaped = chain.shape(&at_rest(), &force(DVec3::X * 0.1), Cuts::NONE, DT);
    assert!(shaped.cuts.has(Cut::NonFiniteWrench) && shaped.wrench == Wrench::ZERO);
}

#[test]
fn the_third_stage_is_heard_counted_and_told_what_became_of_it() {
    use std::sync::{Arc, Mutex};
    #[derive(Clone, Default)]
    struct Halving(Arc<Mutex<Vec<Wrench>>>);
    impl Passivity for Halving {
        fn limit(&mut self, computed: &Wrench, state: &DeviceState, _: f64) -> Wrench {
            let share = if state.twist.linear.x > 0.0 { 0.5 } else { 1.0 };
            Wrench { torque: computed.torque * share, force: computed.force * share }
        }
        fn commanded(&mut self, wrench: &Wrench) {
            self.0.lock().expect("no one panicked").push(*wrench);
        }
        fn reset(&mut self) {
            self.0.lock().expect("no one panicked").clear();
        }
    }
    let stage = Halving::default();
    let limits = SafetyLimits { ramp: 0.0, ..limits() };
    let mut chain = chain_of(&limits).with_passivity(Some(Box::new(stage.clone())));
    let still = chain.shape(&at_rest(), &force(DVec3::X * 0.6), Cuts::NONE, DT);
    let moved = chain.shape(&moving(DVec3::X), &force(DVec3::X * 0.6), Cuts::NONE, DT);
    assert_eq!((still.wrench.force.x, moved.wrench.force.x), (0.6, 0.3));
    assert!(still.cuts.is_none() && moved.cuts.iter().eq([Cut::Passivity]));
    assert_eq!(*stage.0.lock().expect("no one panicked"), [still.wrench, moved.wrench]);
    chain.shape(&at_rest(), &Wrench::ZERO, told(Cut::Speed), DT);
    assert!(stage.0.lock().expect("no one panicked").is_empty());
}

#[test]
fn the_ramp_begins_with_nothing_and_is_counted() {
    let limits = limits();
    let mut chain = chain_of(&limits);
    let large = chain.shape(&at_rest(), &force(DVec3::X * 2.0), Cuts::NONE, DT);
    assert_eq!((large.wrench, large.phase), (Wrench::ZERO, Phase::Waiting));
    assert!(large.cuts.iter().eq([Cut::Engagement]));
    let begun = chain.shape(&at_rest(), &force(DVec3::X * 0.8), Cuts::NONE, DT);
    assert_eq!((begun.wrench, begun.phase), (Wrench::ZERO, Phase::Ramping));
    // What is pressed on top of that is given in a growing share.
    let mut last = 0.0;
    for k in 1..250 {
        let shaped = chain.shape(&at_rest(), &force(DVec3::X * (0.8 + 0.01 * f64::from(k))), Cuts::NONE, DT);
        assert!(shaped.cuts.iter().eq([Cut::Engagement]) && shaped.phase == Phase::Ramping, "tick {k}");
        let share = (shaped.wrench.force.x - last) / 0.01;
        assert!((share - f64::from(k) * DT / limits.ramp).abs() < 1e-9, "tick {k}");
        last = shaped.wrench.force.x;
    }
    let next = chain.shape(&at_rest(), &force(DVec3::X * 3.3), Cuts::NONE, DT);
    assert!(next.wrench.force.x < 3.3 && next.phase == Phase::Engaged && next.cuts.iter().eq([Cut::Engagement]));
    chain.shape(&at_rest(), &Wrench::ZERO, Cuts::NONE, DT);
    let whole = chain.shape(&at_rest(), &force(DVec3::X * 0.8), Cuts::NONE, DT);
    assert_eq!((whole.wrench.force.x, whole.phase, whole.cuts), (0.8, Phase::Engaged, Cuts::NONE));
}

#[test]
fn released_it_lets_go_within_the_slew_limit() {
    let options = SafetyOptions { engagement: Some(Engagement::DeadMan(1)), ..Default::default() };
    let limits = SafetyLimits { ramp: 0.0, ..limits() };
    let mut chain = SafetyChain::new(&limits, Engagement::DeadMan(1), &options, DT);
    let holding = |buttons| DeviceState { buttons, ..at_rest() };
    chain.shape(&holding(0), &Wrench::ZERO, Cuts::NONE, DT);
    for _ in 0..10 {
        chain.shape(&holding(1), &force(DVec3::X * 0.8), Cuts::NONE, DT);
    }
    let mut last = DVec3::X * 0.8;
    for _ in 0..10 {
        last = chain.shape(&holding(1), &force(DVec3::X * 8.0), Cuts::NONE, DT).wrench.force;
    }
    assert!((last.x - 8.0).abs() < 1e-12);
    let mut ticks = 0;
    while last != DVec3::ZERO && ticks < 10 {
        let shaped = chain.shape(&holding(0), &force(DVec3::X * 8.0), Cuts::NONE, DT);
        assert!(shaped.phase == Phase::Idle && !shaped.cuts.has(Cut::Slew));
        assert!(shaped.wrench.force.distance(last) <= limits.force_slew * DT * (1.0 + 1e-9));
        last = shaped.wrench.force;
        ticks += 1;
    }
    assert_eq!(ticks, 2);
}

#[test]
fn forces_are_asked_for_by_holding_any_button() {
    let [premium, ..] = known_devices();
    let options = SafetyOptions::default();
    let of = |buttons| options.engagement(&DeviceSpec { buttons, ..premium.clone() });
    let held = |buttons| Engagement::DeadMan(buttons | HOLD_KEY);
    assert_eq!((of(0), of(1), of(3)), (Engagement::Automatic, held(1), held(7)));
    assert_eq!((of(32), of(255)), (held(DEVICE_BUTTONS), held(DEVICE_BUTTONS)), "the other key is for rearming");
}

/// States of a grip that moves steadily.
fn sample(tick: u32) -> DeviceState {
    let velocity = DVec3::X * 0.2;
    let time = f64::from(tick) * DT;
    DeviceState { pose: Pose::from_translation(velocity * time), time, ..moving(velocity) }
}

#[test]
fn the_gate_believes_a_hand() {
    let mut gate = Gate::new(&limits());
    for tick in 0..1000 {
        let admitted = gate.admit(&sample(tick), DT);
        assert_eq!((admitted.state, admitted.cuts), (Some(sample(tick)), Cuts::NONE));
    }
    // At rest for ten seconds, to the bit, with new samples; and a tick that came late by three.
    let still = DeviceState { twist: Twist::default(), ..sample(999) };
    for tick in 0..10_000 {
        assert!(gate.admit(&DeviceState { time: sample(1000 + tick).time, ..still }, DT).cuts.is_none());
    }
    let mut later = sample(11_003);
    later.pose.translation = still.pose.translation + DVec3::X * 0.8e-3;
    assert!(gate.admit(&later, 4.0 * DT).cuts.is_none());
}

#[test]
fn the_gate_finds_what_no_hand_does() {
    let spoilt = |spoil: fn(&mut DeviceState)| {
        let mut gate = Gate::new(&limits());
        gate.admit(&sample(0), DT);
        gate.admit(&sample(1), DT);
        let mut state = sample(2);
        spoil(&mut state);
        (gate.admit(&state, DT), gate.admit(&sample(3), DT))
    };
    let only = |cuts: Cuts, cut: Cut| cuts == told(cut);
    let (bad, next) = spoilt(|state| state.twist.linear.z = f64::NAN);
    assert!(only(bad.cuts, Cut::NonFiniteState) && next.cuts.is_none());
    assert_eq!(bad.state, Some(DeviceState { twist: Twist::default(), ..sample(1) }), "held, at rest");
    assert!(only(spoilt(|state| state.time = f64::INFINITY).0.cuts, Cut::NonFiniteState));
    assert!(only(spoilt(|state| state.pose.rotation *= 2.0).0.cuts, Cut::NonFiniteState));
    let (there, back) = spoilt(|state| state.pose.translation.y += 5e-3);
    assert!(only(there.cuts, Cut::PoseJump) && only(back.cuts, Cut::PoseJump));
    assert!(only(spoilt(|state| state.pose.translation.y = f64::MAX).0.cuts, Cut::PoseJump));
    assert!(only(spoilt(|state| state.pose.rotation = glam::DQuat::from_rotation_x(0.1)).0.cuts, Cut::PoseJump));
    assert!(only(spoilt(|state| state.twist.linear.y = 4.0).0.cuts, Cut::Speed));
    assert!(only(spoilt(|state| state.twist.angular.y = 50.0).0.cuts, Cut::Speed));
    let (there, back) = spoilt(|state| state.time -= 1.0);
    assert!(only(there.cuts, Cut::DeviceClock) && only(back.cuts, Cut::DeviceClock));
    assert!(only(spoilt(|state| state.time += 1.0).0.cuts, Cut::DeviceClock));
    // No state at all so far: nothing to go on with.
    let mut gate = Gate::new(&limits());
    let bad = DeviceState { time: f64::NAN, ..sample(0) };
    let admitted = gate.admit(&bad, DT);
    assert_eq!((admitted.state, admitted.cuts), (None, told(Cut::NonFiniteState)));
}

#[test]
fn the_gate_tells_a_frozen_state_from_a_hand_that_rests() {
    let limits = limits();
    let mut gate = Gate::new(&limits);
    // The same sample again and again.
    let found = (0..100).position(|_| gate.admit(&sample(0), DT).cuts.has(Cut::FrozenState));
    assert!(found.is_some_and(|tick| (tick as f64 * DT - limits.stale).abs() <= 2.0 * DT), "{found:?}");
    assert!(gate.admit(&sample(1), DT).cuts.is_none());
    // New samples that say 0.2 m/s and stay where they are.
    let mut gate = Gate::new(&limits);
    let stuck = |tick: u32| DeviceState { pose: sample(0).pose, ..sample(tick) };
    let found = (0..100).position(|tick| gate.admit(&stuck(tick), DT).cuts.has(Cut::FrozenState));
    assert!(found.is_some_and(|tick| (tick as f64 * DT * 0.2 - limits.frozen_travel).abs() <= 1e-3), "{found:?}");
}

#[test]
fn slow_ticks_heat_and_slew_by_the_time_that_passed() {
    // Ticks of 10 ms in a loop of 1 kHz: what is held for ten times as long heats ten times as
    // much.
    let limits = limits();
    let mut chain = engaged(&limits);
    let (mut heat, mut last) = (0.0, DVec3::ZERO);
    for _ in 0..12_000 {
        let given = chain.shape(&at_rest(), &force(DVec3::X * 8.0), Cuts::NONE, 10.0 * DT).wrench.force;
        heat += (given.length_squared() - heat) * (1.0 - (-10.0 * DT / limits.heating_time).exp());
        assert!(heat.sqrt() <= limits.force_continuous * 1.01, "{} N thermal", heat.sqrt());
        assert!(given.distance(last) <= limits.force_slew * DT * (1.0 + 1e-9), "no two writes differ by more");
        last = given;
    }
    // A tick that follows the last one after a tenth of a period may change by a tenth.
    let mut chain = engaged(&limits);
    let given = chain.shape(&at_rest(), &force(DVec3::X * 8.0), Cuts::NONE, 0.1 * DT).wrench.force;
    assert!((given.x - 0.1 * DT * limits.force_slew).abs() < 1e-9, "{given}");
}

#[test]
fn a_velocity_that_the_gate_refuses_damps_nothing() {
    // A still grip whose device says 5 m/s, for 8.5 s.
    let limits = limits();
    let (mut gate, mut chain) = (Gate::new(&limits), engaged(&limits));
    for tick in 0..8500 {
        let state = DeviceState { time: sample(tick).time, ..moving(DVec3::X * 5.0) };
        let admitted = gate.admit(&state, DT);
        let shaped = chain.shape(&admitted.state.expect("it is finite"), &Wrench::ZERO, admitted.cuts, DT);
        assert_eq!(shaped.wrench, Wrench::ZERO, "tick {tick}");
    }
}

#[test]
fn damping_goes_by_the_velocity_that_the_poses_confirm() {
    let limits = limits();
    let at_fault = |state: fn(u32) -> DeviceState| {
        let mut chain = engaged(&limits);
        for k in 0..50 {
            chain.shape(&state(k), &Wrench::ZERO, Cuts::NONE, DT);
        }
        chain.shape(&state(50), &Wrench::ZERO, told(Cut::LateLoop), DT).wrench.force
    };
    let true_one = at_fault(sample);
    assert!((true_one + DVec3::X * (0.2 * limits.damping)).length() < 0.01, "{true_one}");
    // One that is within all limits and is no motion, and one the wrong way round.
    assert_eq!(at_fault(|k| DeviceState { pose: Pose::IDENTITY, ..sample(k) }), DVec3::ZERO);
    assert_eq!(at_fault(|k| DeviceState { twist: moving(DVec3::X * -0.2).twist, ..sample(k) }), DVec3::ZERO);
    // One that is too large.
    let large = at_fault(|k| DeviceState { twist: moving(DVec3::X * 0.39).twist, ..sample(k) });
    assert!(large.length() <= true_one.length() * 1.01, "{large}");
}

#[test]
fn other_settings_are_blended_in() {
    let limits = limits();
    let mut chain = engaged(&limits);
    for _ in 0..10 {
        chain.shape(&at_rest(), &force(DVec3::X * 2.05), Cuts::NONE, DT);
    }
    let mut last = 2.05;
    for k in 0..260 {
        let told = if k == 0 { told(Cut::Settings) } else { Cuts::NONE };
        let shaped = chain.shape(&at_rest(), &force(DVec3::X * 6.3), told, DT);
        let step = shaped.wrench.force.x - last;
        assert!((0.0..=4.25 * DT / 0.25 * 1.001).contains(&step) && shaped.phase == Phase::Engaged, "{step} N at {k}");
        last = shaped.wrench.force.x;
    }
    assert_eq!(last, 6.3, "to the bit");
    // Back again, and out of contact on the way: the difference goes with the contact.
    chain.shape(&at_rest(), &force(DVec3::X * 2.05), told(Cut::Settings), DT);
    for k in 0..50 {
        let newtons = 2.05 * (1.0 - f64::from(k) / 49.0);
        last = chain.shape(&at_rest(), &force(DVec3::X * newtons), Cuts::NONE, DT).wrench.force.x;
        assert!(last >= 0.0 && last <= 3.1 * newtons + 1e-9, "{last} N where {newtons} N are computed");
    }
    assert!(last.abs() < 1e-9);
}
