//! A scene file of your own in a world of your own: what is read of it, and a way down into the part.
//!
//! `cargo run --release -p palpus-examples --example own_scene -- SCENE.toml`

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use palpus::glam::DVec3;
use palpus::{Body, BodySettings, NoClock, Object, Pose, ProbeState, Settings, World};
use palpus_io::scene::SceneBody;
use palpus_io::{FilePolicy, read_mesh, read_scene};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scene.toml");

fn main() -> Result<(), Box<dyn Error>> {
    feel(Path::new(&std::env::args().nth(1).unwrap_or_else(|| SCENE.to_owned())))
}

fn feel(file: &Path) -> Result<(), Box<dyn Error>> {
    let scene = read_scene(file, FilePolicy::Inside)?;
    let period = 1.0 / scene.rate_hz;
    let coupled = Settings::coupled(scene.render.limits, period, scene.render.contact_tolerance);
    let settings = Settings { friction: scene.render.friction, ..coupled };

    let mut world = World::new(settings)?;
    world.add(Object::fixed(load(&scene.environment)?, scene.environment.pose))?;
    let probe = load(&scene.probe)?;
    let (start, size) = (scene.probe.pose, probe.size());
    let tool = world.add_tool(probe, settings)?;

    // Down by a third of the probe's size within a second.
    for tick in 0..scene.rate_hz as u32 {
        let time = f64::from(tick) * period;
        let pose = Pose { translation: start.translation - DVec3::Z * size / 3.0 * time, ..start };
        world.step(&[ProbeState::at(pose)], period, &NoClock);
        if tick % 200 == 0 {
            let felt = world.tick(tool);
            let (force, count) = (felt.commanded.force, felt.contacts.len());
            println!(
                "{time:.1} s: {force:.2} N, of {count} contacts; the probe at {:.2}",
                felt.tool_ba.translation * 1e3
            );
        }
    }
    Ok(())
}

fn load(body: &SceneBody) -> Result<Arc<Body>, Box<dyn Error>> {
    // Of noise in a file's digits as much as a hand cannot feel.
    let settings =
        BodySettings { scale: body.metres_per_unit, flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Ok(Arc::new(Body::from_soup(&read_mesh(&body.mesh)?, &settings, &mut |_| ())?))
}

#[test]
fn feels() {
    feel(Path::new(SCENE)).unwrap();
}
