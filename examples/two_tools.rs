//! Two tools grip a free block and lift it. Each hand feels the other hand through the block.
//!
//! `cargo run --release -p palpus-examples --example two_tools`

use std::error::Error;
use std::sync::Arc;

use palpus::glam::DVec3;
use palpus::{Body, BodyError, Limits, NoClock, Object, Pose, ProbeState, Settings, World};

const PERIOD: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, PERIOD, 2e-4).with_friction(0.8, 0.6);
    let mut world = World::new(settings)?;
    world.set_gravity(DVec3::Z * -9.81);
    world.add(Object::fixed(block(DVec3::new(0.5, 0.5, 0.02))?, at(0.0, -0.01)))?;
    let lifted = world.add(Object::free_of_mass(block(DVec3::splat(0.04))?, at(0.0, 0.0201), 0.1))?;
    let finger = block(DVec3::new(0.01, 0.02, 0.02))?;
    let tools = [world.add_tool(finger.clone(), settings)?, world.add_tool(finger, settings)?];

    for tick in 0..3000 {
        let time = f64::from(tick) * PERIOD;
        // In the first second both hands close, to target poses 5 mm inside the block. Then they
        // move up.
        let apart = 0.035 - 0.015 * time.min(1.0);
        let height = 0.02 + 0.02 * (time - 1.0).clamp(0.0, 1.0);
        let hands = [-apart, apart].map(|x| ProbeState::at(at(x, height)));
        world.step(&hands, PERIOD, &NoClock);
        if tick % 500 == 499 {
            let [left, right] = tools.map(|tool| world.tick(tool).commanded.force);
            let block = world.pose(lifted).translation.z * 1e3;
            println!("{time:.1} s: left {left:.2} N, right {right:.2} N, the block at {block:.2} mm");
        }
    }
    let height = world.pose(lifted).translation.z;
    if height < 0.038 { Err(format!("the block was not lifted: {height} m").into()) } else { Ok(()) }
}

fn at(x: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, 0.0, z))
}

fn block(size: DVec3) -> Result<Arc<Body>, BodyError> {
    let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| [-0.5, 0.5].map(|z| DVec3::new(x, y, z) * size)));
    Body::from_convex(corners.as_flattened().as_flattened()).map(Arc::new)
}

#[test]
fn example_lifts_the_block() {
    main().unwrap();
}
