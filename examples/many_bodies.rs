//! Many bodies: a stack of two blocks lies on a table, and a conveyor belt moves a third block. A
//! tool pushes the lower block from the side.
//!
//! `cargo run --release -p palpus-examples --example many_bodies`

use std::error::Error;
use std::sync::Arc;

use palpus::algebra::Twist;
use palpus::glam::DVec3;
use palpus::{Body, BodyError, Limits, NoClock, Object, Pose, ProbeState, Settings, World};

const PERIOD: f64 = 1e-3;
const WOOD: f64 = 700.0;

fn main() -> Result<(), Box<dyn Error>> {
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, PERIOD, 4e-4).with_friction(0.4, 0.3);
    let mut world = World::new(settings)?;
    world.set_gravity(DVec3::Z * -9.81);

    world.add(Object::fixed(block(DVec3::new(0.6, 0.6, 0.02))?, at(0.0, 0.0, -0.01)))?;
    let belt = world.add(Object::driven(block(DVec3::new(2.0, 0.06, 0.02))?, at(0.0, 0.4, -0.01)))?;
    let cube = block(DVec3::splat(0.04))?;
    let lower = world.add(Object::free(cube.clone(), at(0.0, 0.0, 0.0201), WOOD))?;
    let upper = world.add(Object::free(cube.clone(), at(0.0, 0.0, 0.0603), WOOD))?;
    let carried = world.add(Object::free(cube, at(-0.5, 0.4, 0.0202), WOOD))?;
    let tool = world.add_tool(block(DVec3::splat(0.02))?, settings)?;
    let speed = Twist { linear: DVec3::X * 0.1, angular: DVec3::ZERO };
    for tick in 0..2000 {
        let time = f64::from(tick) * PERIOD;
        // About 60 times per second, the program sets the pose and the velocity of the belt.
        if tick % 17 == 0 {
            world.drive(belt, at(0.1 * time, 0.4, -0.01), speed);
        }
        // The device moves sideways, 20 mm above the table.
        world.step(&[ProbeState::at(at(-0.04 + 0.03 * time, 0.0, 0.02))], PERIOD, &NoClock);
        if tick % 500 == 499 {
            let [lower, upper] = [lower, upper].map(|body| world.pose(body).translation * 1e3);
            let (force, way) = (world.tick(tool).commanded.force, world.pose(carried).translation.x * 1e3);
            println!("{:.1} s: {force:.2} N; lower {lower:.2} mm, upper {upper:.2} mm, carried {way:.1} mm", time);
        }
    }
    Ok(())
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, y, z))
}

fn block(size: DVec3) -> Result<Arc<Body>, BodyError> {
    let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| [-0.5, 0.5].map(|z| DVec3::new(x, y, z) * size)));
    Body::from_convex(corners.as_flattened().as_flattened()).map(Arc::new)
}

#[test]
fn example_runs() {
    main().unwrap();
}
