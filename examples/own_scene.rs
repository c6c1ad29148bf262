//! Your own scene file in your own loop: loads the world of the file, and moves the probe down into
//! the part.
//!
//! `cargo run --release -p palpus-examples --example own_scene -- SCENE.toml`

use std::error::Error;
use std::path::Path;

use palpus::glam::DVec3;
use palpus::{Limits, NoClock, Pose, ProbeState};
use palpus_io::{BodyCache, FilePolicy, SceneWorld, Threads};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scene.toml");

fn main() -> Result<(), Box<dyn Error>> {
    feel(Path::new(&std::env::args().nth(1).unwrap_or_else(|| SCENE.to_owned())), BodyCache::of_user())
}

fn feel(file: &Path, cache: Option<BodyCache>) -> Result<(), Box<dyn Error>> {
    // Limits of the device. The limits in the scene file apply as well.
    let device = Limits { force: 8.5, torque: 0.19 };
    let mut scene = SceneWorld::open(file, FilePolicy::Inside, &device, cache.as_ref(), &Threads::all())?;
    let (tool, start, rate) = (scene.tools[0], scene.starts[0], scene.file.rate_hz);
    let size = scene.world.body(scene.world.body_of(tool)).size();

    // The probe moves down by a third of its size within a second.
    for tick in 0..rate as u32 {
        let time = f64::from(tick) / rate;
        let pose = Pose { translation: start.translation - DVec3::Z * size / 3.0 * time, ..start };
        scene.drive();
        scene.world.step(&[ProbeState::at(pose)], 1.0 / rate, &NoClock);
        if tick % 200 == 0 {
            let felt = scene.world.tick(tool);
            let (force, count) = (felt.commanded.force, felt.contacts.len());
            println!(
                "{time:.1} s: {force:.2} N from {count} contacts; the probe is at {:.2} mm",
                felt.tool_ba.translation * 1e3
            );
        }
    }
    Ok(())
}

#[test]
fn example_runs() {
    feel(Path::new(SCENE), None).unwrap();
}
