//! Tests that cycles of every period are attenuated, and that forces caused by the hand's motion
//! stay unchanged, bit for bit.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::*;
use crate::simulated::SimulationSettings;

const PERIOD: f64 = 1e-3;
/// Amplitude relative to the peak. The peak-to-peak value is 0.85 N or 19 mN·m.
const AMPLITUDE: f64 = 0.05;
/// Step of an encoder, m.
const STEP: f64 = 3e-5;

fn limits() -> SafetyLimits {
    SafetyLimits::of(&SimulationSettings::default().spec, 1.0 / PERIOD)
}

/// Returns a pose at `x` as encoders report it.
fn at(x: f64) -> Pose {
    Pose::from_translation(DVec3::X * ((x / STEP).round() * STEP))
}

fn force(newtons: f64) -> Wrench {
    Wrench { torque: DVec3::ZERO, force: DVec3::X * newtons }
}

/// Runs the detector for `seconds` on the wrench and pose of `tick`. Returns the number of changed
/// wrenches.
fn changed(seconds: f64, mut tick: impl FnMut(f64) -> (Wrench, Pose)) -> usize {
    let mut stage = LimitCycle::new(&limits(), PERIOD);
    let ticks = 0..(seconds / PERIOD) as u32;
    ticks
        .filter(|k| {
            let (computed, pose) = tick(f64::from(*k) * PERIOD);
            let (answer, cut) = stage.attenuate(&computed, &pose, PERIOD);
            stage.commanded(&answer);
            assert!(cut || answer == computed);
            cut
        })
        .count()
}

#[test]
fn cycles_of_any_period_are_attenuated() {
    let peaks = limits();
    for period in [2, 3, 7, 15, 50, 100] {
        for turns in [false, true] {
            let mut stage = LimitCycle::new(&peaks, PERIOD);
            let load = Wrench { torque: DVec3::Z * 0.05, force: DVec3::X * 3.0 };
            let (mut seen, mut last) = (None, 0.0);
            for k in 0..2000_u32 {
                let value = AMPLITUDE * (TAU * f64::from(k) / f64::from(period) + 0.4).cos();
                let mut computed = load;
                if turns {
                    computed.torque += DVec3::Y * (value * peaks.torque_peak);
                } else {
                    computed.force += DVec3::Y * (value * peaks.force_peak);
                }
                // The encoder is at the border of a step.
                let pose = at(STEP * (0.5 + 0.2 * f64::from(k % 2) - 0.1));
                let (answer, cut) = stage.attenuate(&computed, &pose, PERIOD);
                stage.commanded(&answer);
                assert!(cut || answer == computed);
                seen = seen.or(cut.then_some(k));
                let gain = answer.force.length() / computed.force.length();
                let of_torque = answer.torque.length() / computed.torque.length();
                let (touched, other) = if turns { (of_torque, gain) } else { (gain, of_torque) };
                assert!((other - 1.0).abs() < 1e-12, "period {period}: the gain of the other kind must stay 1");
                assert!((0.1 - 1e-12..=1.0 + 1e-12).contains(&touched) && (k == 0 || touched <= last + 1e-12));
                last = touched;
            }
            let seen = seen.expect("a cycle of any period is detected");
            assert!(seen < 50 + 5 * period.max(10) && last < 0.11, "period {period}: at tick {seen}, gain {last}");
            // The cycle ends under load, so the gain stays low. Without load the gain rises to 1.
            let pose = at(0.0);
            for _ in 0..300 {
                stage.attenuate(&load, &pose, PERIOD);
            }
            assert!(stage.attenuate(&load, &pose, PERIOD).1);
            for _ in 0..400 {
                stage.attenuate(&Wrench::ZERO, &pose, PERIOD);
            }
            assert_eq!(stage.attenuate(&load, &pose, PERIOD), (load, false), "period {period}");
        }
    }
}

#[test]
fn cycle_that_shakes_the_hand_is_attenuated() {
    // A force of 2 N drives 0.3 kg at 11, 20 and 60 Hz, damped by the hand.
    for rate in [11.0, 20.0, 60.0] {
        let pulse = TAU * rate;
        let cut = changed(2.0, |time| {
            let lag = (4.0 / (0.3 * pulse)).atan();
            let size = 2.0 / (0.3 * pulse * pulse).hypot(4.0 * pulse);
            (force(2.0 + 2.0 * (pulse * time).sin()), at(-size * (pulse * (time - PERIOD) + lag).sin()))
        });
        assert!(cut > 1000, "{rate} Hz: {cut} ticks");
    }
}

#[test]
fn tremor_against_a_wall_is_not_attenuated() {
    // Springs of 1 kN/m (with its damper) and 4 kN/m, pressed with a tremor of 3 to 12 Hz. Some of
    // these motions tap on the wall.
    for (stiffness, damping) in [(1000.0, 3.0), (4000.0, 0.0)] {
        for rate in [3.0, 6.0, 9.0, 12.0] {
            for size in [2e-4, 1e-3, 4e-3] {
                let mut last = 0.0;
                let cut = changed(3.0, |time| {
                    let pose = at(5e-4 - size * (TAU * rate * time).sin());
                    let x = pose.translation.x;
                    let speed = (x - last) / PERIOD;
                    last = x;
                    let push = if x < 0.0 { (-stiffness * x - 0.1 * damping * speed).max(0.0) } else { 0.0 };
                    (force(push.min(8.5)), pose)
                });
                assert_eq!(cut, 0, "{stiffness} N/m, {rate} Hz, {size} m");
            }
        }
    }
}

#[test]
fn stick_slip_and_textures_are_not_attenuated() {
    for speed in [2e-3, 0.02, 0.2] {
        // The force is a saw tooth of 1 N: a spring of 1 kN/m in stick-slip.
        let slip = changed(4.0, |time| (force(-2.0 - (speed * time * 1e3).fract()), at(speed * time)));
        // A texture with waves of 0.1 mm every 0.5 mm.
        let wave = changed(4.0, |time| {
            let height = 1e-4 * (TAU * speed * time / 5e-4).sin();
            let wrench = Wrench { torque: DVec3::Y * (0.03 * height * 1e3), force: DVec3::Z * (1.0 + 1e3 * height) };
            (wrench, Pose { rotation: DQuat::from_rotation_y(height), ..at(speed * time) })
        });
        assert_eq!((slip, wave), (0, 0), "{speed} m/s");
    }
}

#[test]
fn impacts_and_encoder_steps_are_not_attenuated() {
    // Taps every 0.1 s, each of which rings for a few milliseconds.
    let taps = changed(4.0, |time| {
        let since = time % 0.1;
        (force(2.0 + 2.0 * (-since / 4e-3).exp() * (TAU * 150.0 * since).cos()), at(0.0))
    });
    // An encoder that alternates at rest, felt through 1 kN/m and its damper.
    let steps = changed(4.0, |time| {
        let flip = f64::from((time * 1e3).round() as u32 % 2);
        (force(2.0 + 0.1 * flip), at(STEP * flip))
    });
    assert_eq!((taps, steps), (0, 0));
}
