//! Opens a scene file as a world: all bodies, settings from the device's limits, driven objects,
//! errors.

use std::path::{Path, PathBuf};

use glam::DVec3;
use palpus::algebra::{NoClock, Pose};
use palpus::render::{Limits, ProbeState};
use palpus_io::{FilePolicy, OpenError, SceneWorld, Threads};

const DEVICE: Limits = Limits { force: 4.0, torque: 0.1 };

const BOX: &str = "v -5 -5 -5\nv 5 -5 -5\nv 5 5 -5\nv -5 5 -5\nv -5 -5 5\nv 5 -5 5\nv 5 5 5\nv -5 5 5
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

const SCENE: &str = r#"unit = "mm"
[probe]
mesh = "box.obj"
position = [0, 0, 10.5]
[environment]
mesh = "box.obj"
[second]
mesh = "box.obj"
position = [100, 0, 0]
[device]
force_limit = 3
torque_limit = 9
rate = 500
[[object]]
mesh = "box.obj"
position = [0, 200, 0]
motion = "driven"
velocity = [100, 0, 0]
[[object]]
mesh = "box.obj"
position = [0, 400, 0]
motion = "free"
"#;

fn folder(name: &str, scene: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("box.obj"), BOX).unwrap();
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    folder.join("scene.toml")
}

fn open(file: &Path) -> Result<SceneWorld, OpenError> {
    SceneWorld::open(file, FilePolicy::Inside, &DEVICE, None, &Threads::of(1))
}

#[test]
fn opened_scene_can_be_stepped() {
    let mut scene = open(&folder("world", SCENE)).unwrap();
    assert_eq!((scene.tools.len(), scene.starts.len(), scene.objects.len()), (2, 2, 2));
    let settings = *scene.world.tool_settings(scene.tools[0]);
    assert_eq!(settings.limits, Limits { force: 3.0, torque: 0.1 }, "the smaller of both limits");
    let whole = scene.file.coupling.settings(&settings, 1.0 / 500.0);
    assert_eq!(settings.coupling, whole.coupling, "tuned for the scene's rate");

    // Simulates one second, in which the first tool is pressed half a millimetre into the
    // environment.
    let down = Pose { translation: scene.starts[0].translation - DVec3::Z * 1e-3, ..scene.starts[0] };
    let probes = [ProbeState::at(down), ProbeState::at(scene.starts[1])];
    for _ in 0..500 {
        scene.drive();
        scene.world.step(&probes, 1.0 / scene.file.rate_hz, &NoClock);
    }
    let pressed = scene.world.tick(scene.tools[0]).commanded.force;
    assert!(pressed.z > 0.1 && pressed.x.abs() < 1e-6, "{pressed} N");
    assert_eq!(scene.world.tick(scene.tools[1]).commanded.force, DVec3::ZERO);
    let [driven, free] = [0, 1].map(|k| scene.world.pose(scene.objects[k]).translation);
    assert!((driven - DVec3::new(0.1, 0.2, 0.0)).length() < 2e-3, "{driven} m");
    assert!(free.z < -3.0, "it falls: {free} m");
    assert!(scene.world.contacts(scene.environment, scene.world.body_of(scene.tools[0])).count() >= 4);
}

#[test]
fn errors_name_the_file() {
    let wrong = open(&folder("key", &SCENE.replace("force_limit", "force_limits"))).err().unwrap().to_string();
    assert!(wrong.contains("scene.toml, line 11") && wrong.contains("did you mean"), "{wrong}");
    let flat = folder("flat", SCENE);
    std::fs::write(flat.with_file_name("box.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap();
    let wrong = open(&flat).err().unwrap();
    assert!(wrong.to_string().contains("box.obj cannot be prepared"), "{wrong}");
}
