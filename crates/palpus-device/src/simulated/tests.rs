use super::*;
use glam::{DQuat, DVec3};

const FRICTIONLESS: Apparatus = Apparatus { friction: 0.0, angular_friction: 0.0, ..Apparatus::LIGHT_ARM };

fn unlimited() -> DeviceSpec {
    DeviceSpec { force_max: f64::INFINITY, torque_max: f64::INFINITY, ..SimulationSettings::default().spec }
}

/// Settings without friction, limits and encoder steps, for which closed forms hold.
fn ideal(hand: HandImpedance) -> SimulationSettings {
    SimulationSettings {
        spec: unlimited(),
        hand,
        apparatus: FRICTIONLESS,
        encoder: Encoder::EXACT,
        ..SimulationSettings::default()
    }
}

fn still(_: f64) -> Pose {
    Pose::IDENTITY
}

fn run<I: Intent>(device: &mut SimulatedDevice<I>, ticks: usize, wrench: Wrench) -> DeviceState {
    for _ in 0..ticks {
        device.read().unwrap();
        device.write(&wrench).unwrap();
    }
    device.read().unwrap()
}

/// Returns the kinetic energy of device and hand, J.
fn energy<I: Intent>(device: &SimulatedDevice<I>) -> f64 {
    let SimulationSettings { hand, apparatus, .. } = &device.settings;
    let twist = device.true_twist();
    0.5 * (hand.mass + apparatus.mass) * twist.linear.length_squared()
        + 0.5 * (hand.inertia + apparatus.inertia) * twist.angular.length_squared()
}

#[test]
fn every_hand_settles_at_its_intended_pose() {
    let goal = Pose::new(DQuat::from_rotation_x(0.5) * DQuat::from_rotation_z(-0.4), DVec3::new(0.02, -0.01, 0.03));
    for (name, hand) in HAND_PRESETS.into_iter().filter(|(name, _)| *name != "none") {
        // The intent jumps after a rest, which is worse than any path.
        let intent = move |t: f64| if t < 0.01 { Pose::IDENTITY } else { goal };
        let mut device = SimulatedDevice::new(ideal(hand), intent).unwrap();
        let state = run(&mut device, 5000, Wrench::ZERO);
        assert!(state.pose.translation.distance(goal.translation) < 1e-9, "{name}");
        assert!(state.pose.rotation.dot(goal.rotation).abs() > 1.0 - 1e-12, "{name}");
        assert!(state.twist.linear.length() < 1e-6, "{name}");

        let mut rough = SimulatedDevice::new(SimulationSettings { hand, ..Default::default() }, intent).unwrap();
        let state = run(&mut rough, 5000, Wrench::ZERO);
        let stuck = Apparatus::LIGHT_ARM.friction / hand.stiffness + Encoder::TYPICAL.position_quantum;
        assert!(state.pose.translation.distance(goal.translation) <= stuck, "{name}");
    }
}

#[test]
fn step_of_intent_follows_damped_oscillator() {
    for (name, hand) in HAND_PRESETS.into_iter().filter(|(name, _)| *name != "none") {
        let start = 0.05;
        let height = 0.01;
        let mut device = SimulatedDevice::new(ideal(hand), |t: f64| {
            Pose::from_translation(DVec3::X * if t <= start + 1e-9 { 0.0 } else { height })
        })
        .unwrap();
        let mass = hand.mass + FRICTIONLESS.mass;
        let damping = hand.damping + FRICTIONLESS.damping;
        let rate = damping / (2.0 * mass);
        let frequency = (hand.stiffness / mass - rate * rate).sqrt();
        assert!(frequency > 0.0, "{name} must be underdamped");
        // The jump of the intent acts through the hand's damper as an impulse.
        let kick = hand.damping * height / mass;
        for tick in 0..600 {
            let state = device.read().unwrap();
            let t = f64::from(tick) * 1e-3 - start;
            if t > 0.0 {
                let (sin, cos) = (frequency * t).sin_cos();
                let x = height - (-rate * t).exp() * (height * cos + (rate * height - kick) / frequency * sin);
                assert!((state.pose.translation.x - x).abs() < 0.004 * height, "{name}: {x} at {t}");
            }
        }
    }
}

#[test]
fn steady_wrench_deflects_hand_by_its_compliance() {
    let wrench = Wrench { torque: DVec3::new(0.02, 0.0, -0.04), force: DVec3::new(1.0, -2.0, 0.5) };
    for (name, hand) in HAND_PRESETS.into_iter().filter(|(name, _)| *name != "none") {
        let mut device = SimulatedDevice::new(ideal(hand), still).unwrap();
        let state = run(&mut device, 6000, wrench);
        let turn = palpus::algebra::rotation_vector(state.pose.rotation);
        assert!(state.pose.translation.distance(wrench.force / hand.stiffness) < 1e-9, "{name}");
        assert!(turn.distance(wrench.torque / hand.angular_stiffness) < 1e-8, "{name}");
    }
}

#[test]
fn released_device_comes_to_rest() {
    for apparatus in [Apparatus::LIGHT_ARM, FRICTIONLESS] {
        let settings = SimulationSettings { apparatus, ..ideal(HandImpedance::NONE) };
        let mut device = SimulatedDevice::new(settings, still).unwrap();
        device.push(Twist { angular: DVec3::new(3.0, 1.0, -2.0), linear: DVec3::new(0.1, 0.2, -0.3) });
        let mut before = energy(&device);
        for _ in 0..4000 {
            run(&mut device, 1, Wrench::ZERO);
            assert!(energy(&device) <= before);
            before = energy(&device);
        }
        if apparatus.friction > 0.0 {
            assert_eq!(before, 0.0, "dry friction must stop the device");
        } else {
            // Without dry friction the velocity decays with e^(−b t / m), here over 4001 ms.
            let expected = (-4.0f64 * 2.0).exp() * 0.5 * 0.1 * 0.14;
            assert!(before < 1.1 * expected, "{before:e}");
        }
    }
}

#[test]
fn dry_friction_holds_against_smaller_force() {
    let settings = SimulationSettings { apparatus: Apparatus::LIGHT_ARM, ..ideal(HandImpedance::NONE) };
    let mut device = SimulatedDevice::new(settings, still).unwrap();
    let held = run(&mut device, 500, Wrench { force: DVec3::X * 0.039, torque: DVec3::Z * 0.9e-3 });
    assert_eq!(held.pose, Pose::IDENTITY);
    let moved = run(&mut device, 500, Wrench { force: DVec3::X * 0.041, torque: DVec3::Z * 1.1e-3 });
    assert!(moved.pose.translation.x > 0.0 && moved.pose.rotation != DQuat::IDENTITY);
}

#[test]
fn encoders_round_to_their_steps() {
    let encoder = Encoder::TYPICAL;
    let settings = SimulationSettings { encoder, ..ideal(HandImpedance::FIRM) };
    let path = |t: f64| {
        Pose::new(DQuat::from_rotation_y((3.0 * t).sin()), DVec3::new((2.0 * t).sin(), t.cos(), -t.sin()) * 0.05)
    };
    let mut device = SimulatedDevice::new(settings, path).unwrap();
    for _ in 0..500 {
        let state = run(&mut device, 1, Wrench::ZERO);
        let steps = state.pose.translation / encoder.position_quantum;
        assert!((steps - steps.round()).abs().max_element() < 1e-9);
        let off = (state.pose.translation - device.true_pose().translation).abs().max_element();
        assert!(off <= 0.5 * encoder.position_quantum * (1.0 + 1e-9));
        let turn = palpus::algebra::rotation_between(state.pose.rotation, device.true_pose().rotation);
        assert!(turn.length() < encoder.angle_quantum);
        // The filtered velocity follows the true velocity within its lag and one encoder step.
        assert!(state.twist.linear.distance(device.true_twist().linear) < 0.03);
    }
}

#[test]
fn written_wrench_acts_after_delay_for_one_tick() {
    for delay_ticks in [0, 1, 3] {
        let settings = SimulationSettings { delay_ticks, ..ideal(HandImpedance::NONE) };
        let mut device = SimulatedDevice::new(settings, still).unwrap();
        for tick in 0..8 {
            let state = device.read().unwrap();
            device.write(&Wrench { force: DVec3::X, torque: DVec3::ZERO }).unwrap();
            let moves = tick > delay_ticks;
            assert_eq!(state.pose.translation.x > 0.0, moves, "delay {delay_ticks}, tick {tick}");
        }
    }
}

#[test]
fn wrench_is_clipped_keeping_its_direction() {
    let settings = SimulationSettings { spec: SimulationSettings::default().spec, ..ideal(HandImpedance::FIRM) };
    let mut device = SimulatedDevice::new(settings, still).unwrap();
    let wrench = Wrench { force: DVec3::new(30.0, 0.0, 40.0), torque: DVec3::Y * 7.0 };
    let state = run(&mut device, 6000, wrench);
    let expected = DVec3::new(0.6, 0.0, 0.8) * 8.5 / HandImpedance::FIRM.stiffness;
    assert!(state.pose.translation.distance(expected) < 1e-9);
    assert!(device.write(&Wrench { force: DVec3::NAN, torque: DVec3::ZERO }).is_err());
}

/// Returns the amplitude after a second, relative to the start, of a device without a hand on a
/// two-sided spring.
fn amplitude_on_spring(stiffness: f64, delay_ticks: usize) -> f64 {
    let settings = SimulationSettings { delay_ticks, ..ideal(HandImpedance::NONE) };
    let start = 0.001;
    let mut device = SimulatedDevice::new(settings, |_| Pose::from_translation(DVec3::X * start)).unwrap();
    let mut largest = 0.0f64;
    for tick in 0..4000 {
        let x = device.read().unwrap().pose.translation.x;
        device.write(&Wrench { force: DVec3::X * (-stiffness * x), torque: DVec3::ZERO }).unwrap();
        if tick >= 3000 {
            largest = largest.max(x.abs());
        }
    }
    largest / start
}

#[test]
fn sampled_spring_is_stable_up_to_the_known_limit() {
    // Holding a sample for T delays the spring by T/2 on average, and n ticks of delay add n T. The
    // spring K is stable while the device's damper b is larger than K (n + ½) T.
    for delay_ticks in [0, 1, 2] {
        let limit = FRICTIONLESS.damping / (1e-3 * (delay_ticks as f64 + 0.5));
        let (below, above) =
            (amplitude_on_spring(0.95 * limit, delay_ticks), amplitude_on_spring(1.05 * limit, delay_ticks));
        assert!(below < 0.99, "delay {delay_ticks}: {below} below the limit of {limit} N/m");
        assert!(above > 1.01, "delay {delay_ticks}: {above} above the limit of {limit} N/m");
    }
}

#[test]
fn same_operator_gives_identical_motion() {
    let path = |t: f64| Pose::new(DQuat::from_rotation_z(t), DVec3::new(t.sin(), 0.0, t.cos()) * 0.02);
    let record = || {
        let mut device = SimulatedDevice::new(SimulationSettings::default(), path).unwrap();
        (0..300)
            .map(|k| run(&mut device, 1, Wrench::of_force_at(DVec3::Y * f64::from(k % 7), DVec3::X * 0.01)))
            .collect::<Vec<_>>()
    };
    assert!(record() == record());
}

#[test]
fn uneven_reads_do_not_change_the_motion() {
    // Without a force, the closed form of the motion holds at every read.
    let settings = SimulationSettings { jitter: Some(Jitter::logged(3)), ..ideal(HandImpedance::NONE) };
    let mut device = SimulatedDevice::new(settings, still).unwrap();
    device.push(Twist { angular: DVec3::ZERO, linear: DVec3::X * 0.1 });
    let (mut last, mut uneven) = (0.0, false);
    for tick in 0..500 {
        let state = device.read().unwrap();
        let decay = FRICTIONLESS.damping / FRICTIONLESS.mass;
        let x = 0.1 / decay * (1.0 - (-decay * state.time).exp());
        assert!((state.pose.translation.x - x).abs() < 1e-9, "{x} at {}", state.time);
        uneven |= tick > 0 && (state.time - last - 1e-3).abs() > 1e-5;
        last = state.time;
    }
    assert!(uneven);
}

#[test]
fn out_of_range_settings_are_refused() {
    let refuse = |change: fn(&mut SimulationSettings)| {
        let mut settings = SimulationSettings::default();
        change(&mut settings);
        SimulatedDevice::new(settings, still).err()
    };
    assert_eq!(refuse(|s| s.rate_hz = 0.0), Some(SimulationError::Rate(0.0)));
    assert_eq!(refuse(|s| s.delay_ticks = 9), Some(SimulationError::Delay(9)));
    assert_eq!(refuse(|s| s.hand.damping = -1.0), Some(SimulationError::Mechanics));
    assert_eq!(refuse(|s| s.hand.stiffness = f64::NAN), Some(SimulationError::Mechanics));
    assert_eq!(refuse(|s| s.encoder.angle_quantum = f64::INFINITY), Some(SimulationError::Encoder));
    assert_eq!(refuse(|s| s.spec.force_max = f64::NAN), Some(SimulationError::Limits));
    let refuse_jitter = |jitter| {
        let settings = SimulationSettings { jitter: Some(jitter), ..SimulationSettings::default() };
        SimulatedDevice::new(settings, still).err()
    };
    assert_eq!(refuse_jitter(Jitter::logged(1)), None);
    assert_eq!(refuse_jitter(Jitter { wander: f64::NAN, ..Jitter::logged(1) }), Some(SimulationError::Jitter));
    assert_eq!(refuse_jitter(Jitter { late: [0.5, 1.0], ..Jitter::logged(1) }), Some(SimulationError::Jitter));
    let massless = Apparatus { mass: 0.0, ..Apparatus::LIGHT_ARM };
    let settings = SimulationSettings { hand: HandImpedance::NONE, apparatus: massless, ..Default::default() };
    assert_eq!(SimulatedDevice::new(settings.clone(), still).err(), Some(SimulationError::Mechanics));
    let settings = SimulationSettings { apparatus: Apparatus { mass: 1e-15, ..massless }, ..settings };
    assert_eq!(SimulatedDevice::new(settings, still).err(), Some(SimulationError::TooFast));
    let nowhere = |_: f64| Pose::from_translation(DVec3::NAN);
    assert_eq!(SimulatedDevice::new(SimulationSettings::default(), nowhere).err(), Some(SimulationError::Start));
}

#[test]
fn presets_are_found_by_name() {
    assert_eq!(hand_preset("firm"), Some(HandImpedance::FIRM));
    assert_eq!(hand_preset("iron"), None);
}

#[test]
fn braked_device_damps_for_every_command() {
    let settings = SimulationSettings { hand: HandImpedance::NONE, apparatus: FRICTIONLESS, ..Default::default() };
    let mut device = SimulatedDevice::new(settings, still).unwrap();
    device.push(Twist { angular: DVec3::new(0.0, 2.0, 0.0), linear: DVec3::new(0.1, 0.0, 0.1) });
    let brake = device.brake().unwrap();
    let pushed = Wrench { force: DVec3::X * 5.0, torque: DVec3::Y * 0.1 };
    brake.apply();
    let mut before = energy(&device);
    for _ in 0..600 {
        device.read().unwrap();
        device.write(&pushed).unwrap();
        let now = energy(&device);
        assert!(now <= before, "the brake must only take energy");
        before = now;
    }
    assert!(before < 1e-9, "{before} J are left");
    assert!(!device.clone().brake().unwrap().is_applied(), "a clone must have its own brake");
    brake.release();
    run(&mut device, 10, pushed);
    assert!(device.true_twist().linear.x > 0.1);
}

#[test]
fn releasing_a_pressed_grip_leaves_no_force() {
    let (mut publisher, guide) = crate::latest(Guide::Script);
    let script = |_: f64| Pose::from_translation(DVec3::X * 0.01);
    let mut device = SimulatedDevice::new(SimulationSettings::default(), Guided::new(script, guide)).unwrap();
    let mut force = |guide: Guide, ticks: u32| {
        publisher.publish(guide);
        let mut last = 0.0;
        for _ in 0..ticks {
            let state = device.read().unwrap();
            // A wall below x = 0.
            last = (-500.0 * state.pose.translation.x).max(0.0);
            device.write(&Wrench { torque: DVec3::ZERO, force: DVec3::X * last }).unwrap();
        }
        last
    };
    let pressed = force(Guide::Held(Pose::from_translation(DVec3::X * -0.03)), 1000);
    assert!(pressed > 2.0, "{pressed}");
    let released = force(Guide::Released, 1000);
    // Dry friction can hold this much force.
    assert!(released <= Apparatus::LIGHT_ARM.friction, "{released} N");
}
