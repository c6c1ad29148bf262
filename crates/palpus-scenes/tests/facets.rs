//! Tests friction over the facets of a shaded surface: the friction force on a ball that slides
//! over a faceted ball must stay steady.

mod bodies;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Limits, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_scenes::shape;

const TICK: f64 = 1e-3;
/// Radii of the two balls, m.
const RADII: [f64; 2] = [0.008, 0.05];
/// Sliding speed, m/s.
const SPEED: f64 = 0.1;
/// Distance that the device moves on after the first contact, m.
const PRESSED: f64 = 1.5e-3;
/// Dynamic coefficient of friction.
const DYNAMIC: f64 = 0.3;

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn friction_stays_steady_over_facet_edges() {
    let [ball, ground] = [body(&shape::sphere(RADII[0], 3)), body(&shape::sphere(RADII[1], 4))];
    let limits = Limits { force: 8.5, torque: 0.188 };
    let tolerance = 0.2e-3;
    let stiffness = VirtualCoupling::contact_stiffness(&limits, tolerance).expect("a finite force limit");
    let settings = Settings {
        contact_tolerance: tolerance,
        stiffness,
        limits,
        shading: Some(ShadingSettings { crease_angle: 0.7, most_turn: 0.78 }),
        friction: Some(FrictionSettings {
            static_coefficient: 0.4,
            dynamic_coefficient: DYNAMIC,
            tangential_stiffness: stiffness,
        }),
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, tolerance)),
        ..Settings::default()
    };
    let mut renderer = Renderer::new(ball, ground, settings).expect("valid settings");
    let about = DVec3::new(0.3, 1.0, 0.0).normalize();
    let reach = RADII[0] + RADII[1];
    let mut last = DVec3::ZERO;
    let (mut least, mut step) = (f64::INFINITY, 0.0f64);
    for k in 0..900 {
        // The ball moves down, rests, and then slides along a great circle.
        let slid = (f64::from(k) - 300.0).max(0.0) * TICK * SPEED;
        let pressed = (f64::from(k) / 200.0).min(1.0) * (PRESSED + 1e-3) - 1e-3;
        let up = DQuat::from_axis_angle(about, slid / RADII[1]) * DVec3::Z;
        let along = about.cross(up);
        let linear = if slid > 0.0 { along * SPEED } else { DVec3::ZERO };
        let probe = ProbeState {
            pose_ba: Pose::from_translation(up * (reach - pressed)),
            twist: Twist { linear, ..Twist::default() },
        };
        let force = renderer.step(&probe, TICK, &NoClock).commanded.force;
        // Friction needs several ticks to build up.
        if k > 350 {
            let friction = -force.dot(along) / (DYNAMIC * force.dot(up));
            least = least.min(friction);
            step = step.max((force - last).length() / force.length());
        }
        last = force;
    }
    eprintln!("friction is at least {least:.2} of dynamic friction; the largest step is {:.1} %", 100.0 * step);
    assert!(least > 0.7 && step < 0.1, "{least}, {step}");
}
