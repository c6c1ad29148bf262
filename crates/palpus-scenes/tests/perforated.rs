//! Tests flat faces that consist of many pieces: a plate with many holes lands on another one.
//!
//! Hundreds of pairs of pieces begin to touch in the same tick. If the plate is tilted, the closest
//! points of most pairs lie at ends of pieces inside the flat faces.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::body::{Body, PolygonSoup};
use palpus::render::{Limits, ProbeState, Renderer, Settings, VirtualCoupling};

const TICK: f64 = 1e-3;
/// Contact tolerance, m.
const TOLERANCE: f64 = 0.3e-3;
/// Half the thickness of the plates, m.
const HALF: f64 = 2e-3;

/// Returns a plate with `holes` × `holes` square holes. Holes and bars are `width` (m) wide.
fn plate(holes: usize, width: f64) -> Arc<Body> {
    let count = 2 * holes + 1;
    let is_solid = |i: usize, j: usize| i < count && j < count && (i.is_multiple_of(2) || j.is_multiple_of(2));
    let mut soup = PolygonSoup::new();
    for top in [HALF, -HALF] {
        for j in 0..=count {
            for i in 0..=count {
                let at = |k: usize| (k as f64 - 0.5 * count as f64) * width;
                soup.vertices.push(DVec3::new(at(i), at(j), top));
            }
        }
    }
    let vertex = |i: usize, j: usize, bottom: usize| ((bottom * (count + 1) + j) * (count + 1) + i) as u32;
    for j in 0..count {
        for i in 0..count {
            if !is_solid(i, j) {
                continue;
            }
            let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            soup.push_face(&ring.map(|(i, j)| vertex(i, j, 0)));
            soup.push_face(&[3, 2, 1, 0].map(|k: usize| vertex(ring[k].0, ring[k].1, 1)));
            let beyond = [(i, j.wrapping_sub(1)), (i + 1, j), (i, j + 1), (i.wrapping_sub(1), j)];
            for (side, (x, y)) in beyond.into_iter().enumerate() {
                if !is_solid(x, y) {
                    let (from, to) = (ring[side], ring[(side + 1) % 4]);
                    soup.push_face(&[
                        vertex(from.0, from.1, 1),
                        vertex(to.0, to.1, 1),
                        vertex(to.0, to.1, 0),
                        vertex(from.0, from.1, 0),
                    ]);
                }
            }
        }
    }
    body(&soup)
}

/// Returns the renderer of a plate above another one, behind the coupling.
fn renderer() -> Renderer {
    let limits = Limits { force: 8.5, torque: 0.188 };
    let settings = Settings {
        contact_tolerance: TOLERANCE,
        stiffness: VirtualCoupling::contact_stiffness(&limits, TOLERANCE).expect("the force limit is finite"),
        limits,
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, TOLERANCE)),
        ..Settings::default()
    };
    Renderer::new(plate(12, 2.5e-3), plate(14, 3.1e-3), settings).expect("the settings are valid")
}

/// The hand lowers the plate with a tilt, presses it 0.5 mm into the other plate, and holds it.
#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn tilted_plate_lands_without_rocking() {
    for (degrees, about) in [(0.0_f64, DVec3::X), (0.1, DVec3::X), (0.3, DVec3::new(0.8, 0.6, 0.0)), (1.0, DVec3::Y)] {
        let mut renderer = renderer();
        let rotation = DQuat::from_axis_angle(about, degrees.to_radians());
        let (mut deepest, mut steps, mut last) = (0.0_f64, [0.0_f64; 2], None);
        for k in 0..700 {
            let height = (3e-3 - 20e-3 * f64::from(k) * TICK).max(-0.5e-3);
            let speed = if height > -0.5e-3 { -20e-3 } else { 0.0 };
            let pose_ba = Pose::new(rotation, DVec3::new(0.4e-3, 0.7e-3, 2.0 * HALF + height));
            let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * speed };
            let tick = renderer.step(&ProbeState { pose_ba, twist }, TICK, &NoClock);
            deepest = deepest.max(-tick.separation());
            let wrench = tick.commanded;
            if let Some((force, torque)) = last {
                let [of_force, of_torque] = &mut steps;
                *of_force = of_force.max(wrench.force.distance(force));
                *of_torque = of_torque.max(wrench.torque.distance(torque));
            }
            last = Some((wrench.force, wrench.torque));
        }
        let [force, torque] = steps;
        eprintln!(
            "{degrees}°: overlap {:.2} µm, largest step {force:.3} N and {:.2} mN·m",
            1e6 * deepest,
            1e3 * torque
        );
        assert!(deepest <= 20e-6, "{degrees}°: the plates overlap by {deepest} m");
        assert!(force <= 0.15 && torque <= 1.5e-3, "{degrees}°: a step of {force} N and {torque} N·m");
    }
}
