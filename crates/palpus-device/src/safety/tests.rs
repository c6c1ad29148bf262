use super::*;
use crate::{DeviceSpec, known_devices};
use palpus::algebra::{Pose, Twist};

const DT: f64 = 1e-3;

fn limits() -> SafetyLimits {
    let [premium, ..] = known_devices();
    SafetyLimits::of(&premium, 1000.0)
}

fn chain_of(limits: &SafetyLimits) -> SafetyChain {
    SafetyChain::new(limits, EnableMode::Automatic, &SafetyOptions::default(), DT)
}

/// Returns an engaged chain after a computed wrench of zero.
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

fn reported(cut: Cut) -> Cuts {
    let mut cuts = Cuts::NONE;
    cuts.note(cut, true);
    cuts
}

#[test]
fn harmless_wrench_passes_bit_for_bit() {
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
fn jump_of_the_wrench_becomes_a_ramp() {
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
    // The way to the opposite force goes through zero.
    let shaped = chain.shape(&at_rest(), &force(-target), Cuts::NONE, DT);
    assert!(shaped.cuts.has(Cut::Slew) && shaped.wrench.force.dot(target) > 0.0);
}

#[test]
fn jump_while_ramping_is_slewed_before_the_ramp() {
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
fn saturation_keeps_direction_and_counts_only_itself() {
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
fn device_without_torque_reports_no_saturation() {
    let touch = known_devices().into_iter().find(|spec| spec.name == "Touch").expect("the Touch is a known device");
    let limits = SafetyLimits::of(&touch, 1000.0);
    let mut chain = engaged(&limits);
    let wrench = Wrench { force: DVec3::X * 0.5, torque: DVec3::Y * 0.4 };
    let shaped = chain.shape(&at_rest(), &wrench, Cuts::NONE, DT);
    assert_eq!((shaped.wrench, shaped.cuts), (force(wrench.force), Cuts::NONE));
}

#[test]
fn force_above_the_rating_falls_to_it() {
    for (held, patience) in [(4.0, 2.0..4.0), (8.0, 0.5..1.0)] {
        let mut chain = engaged(&limits());
        let mut first = None;
        let mut shaped = chain.shape(&at_rest(), &Wrench::ZERO, Cuts::NONE, DT);
        for k in 0..60_000 {
            // The force first rises within the slew limit, then stays.
            let force = force(DVec3::X * (f64::from(k) * 2.0).min(held));
            shaped = chain.shape(&at_rest(), &force, Cuts::NONE, DT);
            if shaped.cuts.has(Cut::Heat) {
                first.get_or_insert(f64::from(k) * DT);
            }
            assert!(shaped.cuts.and(Cuts::FAULTS).is_none() && !shaped.cuts.has(Cut::Slew), "the cap must fall slowly");
        }
        let first = first.expect("a force above 1.4 N must be cut by heat");
        assert!(patience.contains(&first), "{held} N for {first} s");
        assert!((shaped.wrench.force.x - 1.4).abs() < 0.05 && chain.heat() <= 1.0);
    }
}

#[test]
fn fault_removes_force_at_once_and_leaves_damping() {
    let limits = limits();
    for cut in Cut::ALL.into_iter().filter(|cut| cut.is_fault() && *cut != Cut::NonFiniteWrench) {
        let mut chain = engaged(&limits);
        for k in 0..20 {
            chain.shape(&sample(k), &force(DVec3::X * 3.0), Cuts::NONE, DT);
        }
        let state = sample(20);
        let shaped = chain.shape(&state, &force(DVec3::X * 3.0), reported(cut), DT);
        let name = cut.name();
        assert_ne!(shaped.phase, Phase::Engaged, "{name}");
        assert!(shaped.wrench.force.length() <= limits.rest_force, "{name}");
        assert!(shaped.wrench.torque.length() <= limits.rest_torque, "{name}");
        assert!(shaped.wrench.power(&state.twist) <= 0.0, "{name}");
        assert_eq!(shaped.wrench == Wrench::ZERO, reported(cut).and(Cuts::BLIND) != Cuts::NONE, "{name}");
    }
}

#[test]
fn non_finite_wrench_of_step_is_a_fault() {
    let mut chain = engaged(&limits());
    let bad = Wrench { force: DVec3::X, torque: DVec3::new(0.0, f64::INFINITY, 0.0) };
    let shaped = chain.shape(&at_rest(), &bad, Cuts::NONE, DT);
    assert_eq!((shaped.wrench, shaped.phase), (Wrench::ZERO, Phase::Faulted));
    assert!(shaped.cuts.has(Cut::NonFiniteWrench));
}

#[test]
fn passivity_stage_is_applied_and_gets_the_final_wrench() {
    const SPEED: f64 = 0.1;
    const PUSH: f64 = 0.6;
    let mut chain = engaged(&SafetyLimits { allowance: 0.0, ..limits() });
    let mut given = 0.0;
    for k in 0..20 {
        let pose = Pose::from_translation(DVec3::X * (SPEED * DT * f64::from(k)));
        let state = DeviceState { pose, ..moving(DVec3::X * SPEED) };
        let shaped = chain.shape(&state, &force(DVec3::X * PUSH), Cuts::NONE, DT);
        // The first push has done no work yet.
        assert_eq!(shaped.cuts.has(Cut::Passivity), k > 0, "tick {k}");
        assert_eq!(shaped.wrench.force.x < PUSH, k > 0, "tick {k}");
        assert!((chain.passivity.given() - given).abs() < 1e-12, "tick {k}");
        given += shaped.wrench.force.x * SPEED * DT;
    }
    chain.shape(&at_rest(), &Wrench::ZERO, reported(Cut::Speed), DT);
    assert_eq!(chain.passivity.given(), 0.0);
}

#[test]
fn ramp_starts_at_zero_and_is_counted() {
    let limits = limits();
    let mut chain = chain_of(&limits);
    let large = chain.shape(&at_rest(), &force(DVec3::X * 2.0), Cuts::NONE, DT);
    assert_eq!((large.wrench, large.phase), (Wrench::ZERO, Phase::Waiting));
    assert!(large.cuts.iter().eq([Cut::StartUp]));
    let mut share = 0.0;
    for k in 0..250 {
        let shaped = chain.shape(&at_rest(), &force(DVec3::X * 0.8), Cuts::NONE, DT);
        assert!(shaped.cuts.iter().eq([Cut::StartUp]) && shaped.phase == Phase::Ramping, "tick {k}");
        let next = shaped.wrench.force.x / 0.8;
        assert!((next - share) * limits.ramp <= DT * (1.0 + 1e-9) && next <= 1.0, "tick {k}");
        share = next;
    }
    assert!((share - 1.0).abs() < 0.01);
    let whole = chain.shape(&at_rest(), &force(DVec3::X * 0.8), Cuts::NONE, DT);
    assert_eq!((whole.wrench.force.x, whole.phase, whole.cuts), (0.8, Phase::Engaged, Cuts::NONE));
}

#[test]
fn released_button_removes_force_within_slew_limit() {
    let options = SafetyOptions { enable_mode: Some(EnableMode::DeadMan(1)), ..Default::default() };
    let limits = SafetyLimits { ramp: 0.0, ..limits() };
    let mut chain = SafetyChain::new(&limits, EnableMode::DeadMan(1), &options, DT);
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
fn holding_any_button_enables_forces() {
    let [premium, ..] = known_devices();
    let options = SafetyOptions::default();
    let of = |buttons| options.enable_mode(&DeviceSpec { buttons, ..premium.clone() });
    let held = |buttons| EnableMode::DeadMan(buttons | HOLD_KEY);
    assert_eq!((of(0), of(1), of(3)), (EnableMode::Automatic, held(1), held(7)));
    assert_eq!((of(32), of(255)), (held(DEVICE_BUTTONS), held(DEVICE_BUTTONS)), "the rearm key must not enable forces");
}

/// States of a grip that moves at constant velocity.
fn sample(tick: u32) -> DeviceState {
    let velocity = DVec3::X * 0.2;
    let time = f64::from(tick) * DT;
    DeviceState { pose: Pose::from_translation(velocity * time), time, ..moving(velocity) }
}

#[test]
fn gate_accepts_motion_of_a_hand() {
    let mut gate = Gate::new(&limits());
    for tick in 0..1000 {
        let admitted = gate.admit(&sample(tick), DT);
        assert_eq!((admitted.state, admitted.cuts), (Some(sample(tick)), Cuts::NONE));
    }
    // The grip then rests for ten seconds with an unchanged pose and new samples. A last tick is
    // three periods late.
    let still = DeviceState { twist: Twist::default(), ..sample(999) };
    for tick in 0..10_000 {
        assert!(gate.admit(&DeviceState { time: sample(1000 + tick).time, ..still }, DT).cuts.is_none());
    }
    let mut later = sample(11_003);
    later.pose.translation = still.pose.translation + DVec3::X * 0.8e-3;
    assert!(gate.admit(&later, 4.0 * DT).cuts.is_none());
}

#[test]
fn gate_rejects_impossible_motion() {
    let spoilt = |spoil: fn(&mut DeviceState)| {
        let mut gate = Gate::new(&limits());
        gate.admit(&sample(0), DT);
        gate.admit(&sample(1), DT);
        let mut state = sample(2);
        spoil(&mut state);
        (gate.admit(&state, DT), gate.admit(&sample(3), DT))
    };
    let only = |cuts: Cuts, cut: Cut| cuts == reported(cut);
    let (bad, next) = spoilt(|state| state.twist.linear.z = f64::NAN);
    assert!(only(bad.cuts, Cut::NonFiniteState) && next.cuts.is_none());
    assert_eq!(
        bad.state,
        Some(DeviceState { twist: Twist::default(), ..sample(1) }),
        "the last valid state must be held, at rest"
    );
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
    // Before the first valid state, there is no state for the step.
    let mut gate = Gate::new(&limits());
    let bad = DeviceState { time: f64::NAN, ..sample(0) };
    let admitted = gate.admit(&bad, DT);
    assert_eq!((admitted.state, admitted.cuts), (None, reported(Cut::NonFiniteState)));
}

#[test]
fn gate_distinguishes_frozen_state_from_resting_hand() {
    let limits = limits();
    let mut gate = Gate::new(&limits);
    // The same sample is read repeatedly.
    let found = (0..100).position(|_| gate.admit(&sample(0), DT).cuts.has(Cut::FrozenState));
    assert!(found.is_some_and(|tick| (tick as f64 * DT - limits.stale).abs() <= 2.0 * DT), "{found:?}");
    assert!(gate.admit(&sample(1), DT).cuts.is_none());
    // New samples report 0.2 m/s while the pose does not change.
    let mut gate = Gate::new(&limits);
    let stuck = |tick: u32| DeviceState { pose: sample(0).pose, ..sample(tick) };
    let found = (0..100).position(|tick| gate.admit(&stuck(tick), DT).cuts.has(Cut::FrozenState));
    assert!(found.is_some_and(|tick| (tick as f64 * DT * 0.2 - limits.frozen_travel).abs() <= 1e-3), "{found:?}");
}

#[test]
fn heat_and_slew_use_the_elapsed_time() {
    // The ticks take 10 ms in a loop of 1 kHz, so each wrench heats the motors ten times as long.
    let limits = limits();
    let mut chain = engaged(&limits);
    let (mut heat, mut last) = (0.0, DVec3::ZERO);
    for _ in 0..12_000 {
        let given = chain.shape(&at_rest(), &force(DVec3::X * 8.0), Cuts::NONE, 10.0 * DT).wrench.force;
        heat += (given.length_squared() - heat) * (1.0 - (-10.0 * DT / limits.heating_time).exp());
        assert!(heat.sqrt() <= limits.force_continuous * 1.01, "{} N thermal", heat.sqrt());
        assert!(
            given.distance(last) <= limits.force_slew * DT * (1.0 + 1e-9),
            "two writes must not differ by more than the slew limit"
        );
        last = given;
    }
    // A tick after a tenth of a period may change the wrench by a tenth of the limit.
    let mut chain = engaged(&limits);
    let given = chain.shape(&at_rest(), &force(DVec3::X * 8.0), Cuts::NONE, 0.1 * DT).wrench.force;
    assert!((given.x - 0.1 * DT * limits.force_slew).abs() < 1e-9, "{given}");
}

#[test]
fn refused_velocity_causes_no_damping() {
    // A grip at rest whose device reports 5 m/s for 8.5 s.
    let limits = limits();
    let (mut gate, mut chain) = (Gate::new(&limits), engaged(&limits));
    for tick in 0..8500 {
        let state = DeviceState { time: sample(tick).time, ..moving(DVec3::X * 5.0) };
        let admitted = gate.admit(&state, DT);
        let shaped =
            chain.shape(&admitted.state.expect("a finite state is admitted"), &Wrench::ZERO, admitted.cuts, DT);
        assert_eq!(shaped.wrench, Wrench::ZERO, "tick {tick}");
    }
}

#[test]
fn damping_uses_only_confirmed_velocity() {
    let limits = limits();
    let at_fault = |state: fn(u32) -> DeviceState| {
        let mut chain = engaged(&limits);
        for k in 0..50 {
            chain.shape(&state(k), &Wrench::ZERO, Cuts::NONE, DT);
        }
        chain.shape(&state(50), &Wrench::ZERO, reported(Cut::LateLoop), DT).wrench.force
    };
    let true_one = at_fault(sample);
    assert!((true_one + DVec3::X * (0.2 * limits.damping)).length() < 0.01, "{true_one}");
    // A velocity without motion of the pose, and a velocity of the opposite sign, must not damp.
    assert_eq!(at_fault(|k| DeviceState { pose: Pose::IDENTITY, ..sample(k) }), DVec3::ZERO);
    assert_eq!(at_fault(|k| DeviceState { twist: moving(DVec3::X * -0.2).twist, ..sample(k) }), DVec3::ZERO);
    // If the velocity is too large, only the part that agrees with the poses counts.
    let large = at_fault(|k| DeviceState { twist: moving(DVec3::X * 0.39).twist, ..sample(k) });
    assert!(large.length() <= true_one.length() * 1.01, "{large}");
}

#[test]
fn changed_settings_fade_in() {
    let limits = limits();
    let mut chain = engaged(&limits);
    for _ in 0..10 {
        chain.shape(&at_rest(), &force(DVec3::X * 2.05), Cuts::NONE, DT);
    }
    let mut last = 2.05;
    for k in 0..260 {
        let reported = if k == 0 { reported(Cut::Settings) } else { Cuts::NONE };
        let shaped = chain.shape(&at_rest(), &force(DVec3::X * 6.3), reported, DT);
        let step = shaped.wrench.force.x - last;
        assert!((0.0..=4.25 * DT / 0.25 * 1.001).contains(&step) && shaped.phase == Phase::Engaged, "{step} N at {k}");
        last = shaped.wrench.force.x;
    }
    assert_eq!(last, 6.3, "the fade must end exactly at the new wrench");
    // The settings change back, and the hand leaves the contact: the difference must fall with the
    // contact.
    chain.shape(&at_rest(), &force(DVec3::X * 2.05), reported(Cut::Settings), DT);
    for k in 0..50 {
        let newtons = 2.05 * (1.0 - f64::from(k) / 49.0);
        last = chain.shape(&at_rest(), &force(DVec3::X * newtons), Cuts::NONE, DT).wrench.force.x;
        assert!(last >= 0.0 && last <= 3.1 * newtons + 1e-9, "got {last} N for a computed {newtons} N");
    }
    assert!(last.abs() < 1e-9);
}
