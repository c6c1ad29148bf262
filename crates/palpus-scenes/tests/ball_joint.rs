//! Tests the ball joint behind the coupling. The ball has contacts on all sides within its play.

mod bodies;

use bodies::body;
use palpus::algebra::{NoClock, Twist};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_scenes::scene;

const TICK: f64 = 1e-3;

/// The hand turns the ball by up to 0.4 rad/s and pulls it from one side of the socket to another.
#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn turned_ball_stays_in_its_play() {
    let scene = scene("ball-joint").expect("a built-in scene");
    let limits = Limits { force: 8.5, torque: 0.188 };
    let stiffness =
        VirtualCoupling::contact_stiffness(&limits, scene.contact.tolerance).expect("the force limit is finite");
    let settings = Settings {
        contact_tolerance: scene.contact.tolerance,
        cluster_radius: scene.contact.cluster_radius,
        clustering: Clustering::Smooth,
        stiffness,
        shading: Some(ShadingSettings { crease_angle: 40_f64.to_radians(), most_turn: 45_f64.to_radians() }),
        friction: scene.contact.friction.map(|friction| FrictionSettings {
            static_coefficient: friction.static_coefficient,
            dynamic_coefficient: friction.dynamic_coefficient,
            tangential_stiffness: stiffness,
        }),
        limits,
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, scene.contact.tolerance)),
        ..Settings::default()
    };
    let mut renderer =
        Renderer::new(body(&scene.probe), body(&scene.environment), settings).expect("the settings are valid");
    let (mut deepest, mut largest, mut last) = (0.0_f64, 0.0_f64, None);
    for k in 0..4000 {
        let time = f64::from(k) * TICK;
        let [from, to] = [time, time + TICK].map(|time| scene.path.pose(time));
        let turn = to.rotation * from.rotation.conjugate();
        let twist = Twist {
            angular: turn.xyz() * (2.0 * turn.w.signum() / TICK),
            linear: (to.translation - from.translation) / TICK,
        };
        let tick = renderer.step(&ProbeState { pose_ba: from, twist }, TICK, &NoClock);
        deepest = deepest.max(-tick.separation());
        let force = tick.commanded.force;
        largest = last.map_or(largest, |last| force.distance(last).max(largest));
        last = Some(force);
    }
    eprintln!("overlap {:.2} µm, largest force step {:.3} N", 1e6 * deepest, largest);
    assert!(deepest <= 20e-6, "the tool overlaps the socket by {deepest} m");
    assert!(largest <= 0.2, "a force step of {largest} N");
}
