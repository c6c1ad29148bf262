//! Measures how much longer a step takes through the C library than the same step in Rust: `cargo
//! bench -p palpus-capi`.
#![allow(unsafe_code, reason = "the C library's functions take pointers")]
#![allow(clippy::print_stdout, reason = "a bench prints")]

use std::sync::Arc;
use std::time::Instant;

use palpus::glam::DVec3;
use palpus::{Body, Limits, NoClock, Object, Pose, ProbeState, Settings, World};
use palpus_capi::body::{palpus_body, palpus_body_from_convex};
use palpus_capi::settings::palpus_settings;
use palpus_capi::value::palpus_wrench;
use palpus_capi::world::{palpus_object, palpus_probe, palpus_tool, palpus_world};
use palpus_capi::world_functions as functions;

const ROUNDS: usize = 41;
const STEPS: u32 = 5000;

fn pose(k: u32) -> Pose {
    Pose::from_translation(DVec3::Z * (0.0295 + 0.0002 * (f64::from(k) * 0.01).sin()))
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let points = |size: DVec3| -> Vec<[f64; 3]> {
        (0..8_u32)
            .map(|k| ((DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) - 0.5) * size).to_array())
            .collect()
    };
    let [plate, finger] = [DVec3::new(0.1, 0.1, 0.02), DVec3::new(0.01, 0.01, 0.04)].map(points);
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, 1e-3, 2e-4);
    let body = |points: &[[f64; 3]]| {
        let points: Vec<DVec3> = points.iter().copied().map(DVec3::from_array).collect();
        Arc::new(Body::from_convex(&points).expect("a valid block"))
    };
    let mut world = World::new(settings).expect("valid settings");
    world.add(Object::fixed(body(&plate), Pose::IDENTITY)).expect("a plate");
    let tool = world.add_tool(body(&finger), settings).expect("a tool");

    let [mut plate_c, mut finger_c] = [palpus_body::default(); 2];
    let (mut world_c, mut object, mut tool_c) =
        (palpus_world::default(), palpus_object::default(), palpus_tool::default());
    let settings_c = palpus_settings::from(&settings);
    // SAFETY: the pointers point to arrays of eight points, to values, and to memory for results.
    unsafe {
        palpus_body_from_convex(plate.as_flattened().as_ptr(), 8, &mut plate_c);
        palpus_body_from_convex(finger.as_flattened().as_ptr(), 8, &mut finger_c);
        functions::palpus_world_create(&settings_c, &mut world_c);
        functions::palpus_world_add_fixed(world_c, plate_c, &Pose::IDENTITY.into(), &mut object);
        functions::palpus_world_add_tool(world_c, finger_c, &settings_c, &mut tool_c);
    }
    let (mut rust, mut c) = (Vec::new(), Vec::new());
    let mut sums = [0.0; 2];
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        for k in 0..STEPS {
            world.step(&[ProbeState::at(pose(k))], 1e-3, &NoClock);
            sums[0] += world.tick(tool).commanded.force.z;
        }
        rust.push(begin.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS));
        let begin = Instant::now();
        for k in 0..STEPS {
            let probe = palpus_probe { pose: pose(k).into(), ..palpus_probe::default() };
            let mut wrench = palpus_wrench::default();
            // SAFETY: the pointers point to one probe and to memory for one wrench.
            unsafe { functions::palpus_world_step(world_c, &probe, &mut wrench, 1, 1e-3) };
            sums[1] += wrench.force[2];
        }
        c.push(begin.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS));
    }
    assert!(sums[0].to_bits() == sums[1].to_bits(), "Rust and C must give the same forces");
    let (rust, c) = (median(rust), median(c));
    println!("a step in Rust {rust:.0} ns, through C {c:.0} ns: {:.0} ns more (medians of {ROUNDS} rounds)", c - rust);
}
