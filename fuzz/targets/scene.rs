//! Scene files. All values are in range. With [`FilePolicy::Inside`], a scene refers to no file
//! outside its folder, neither by its text nor through links on the disk.
#![no_main]

use std::cell::OnceCell;
use std::path::{Component, Path};

use palpus_fuzz::{Allowance, Folder, Seed, check, target};
use palpus_io::scene::{SceneFile, parse_scene};
use palpus_io::{FilePolicy, read_scene};

thread_local! {
    static FOLDER: OnceCell<Folder> = const { OnceCell::new() };
}

/// Creates the folder of a scene with a mesh, a subfolder, and links to both, to the folder itself
/// and out of it. Another mesh is beside the folder.
fn folder() -> Folder {
    let folder = Folder::new("scene");
    let scenes = folder.path().join("scenes");
    std::fs::create_dir_all(scenes.join("sub")).expect("a writable folder");
    for file in ["a.obj", "scenes/a.obj", "scenes/sub/b.obj", "scenes/sub/path.csv"] {
        folder.file(file, b"v 0 0 0\n");
    }
    #[cfg(unix)]
    {
        let link = |to: &Path, name: &str| {
            std::os::unix::fs::symlink(to, scenes.join(name)).expect("support for links");
        };
        link(Path::new("sub/b.obj"), "in.obj");
        link(Path::new("../a.obj"), "out.obj");
        link(Path::new(".."), "up");
        link(Path::new("."), "here");
        link(Path::new("loop"), "loop");
        link(Path::new("/etc"), "etc");
        link(Path::new("/etc/passwd"), "sub/p.obj");
    }
    folder
}

fn named(scene: &SceneFile) -> impl Iterator<Item = &Path> {
    let others = scene.others.iter().flat_map(|tool| [Some(&tool.body.mesh), tool.hand.path.as_ref()]);
    let objects = scene.objects.iter().map(|object| Some(&object.body.mesh));
    [Some(&scene.probe.mesh), Some(&scene.environment.mesh), scene.hand.path.as_ref()]
        .into_iter()
        .chain(others)
        .chain(objects)
        .flatten()
        .map(|path| path.as_path())
}

fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let parsed = parse_scene(text, Path::new("/scenes/x.toml"), FilePolicy::Inside);
    let anywhere = parse_scene(text, Path::new("/scenes/x.toml"), FilePolicy::Anywhere);
    match &parsed {
        Ok(scene) => {
            sane(scene);
            for path in named(scene) {
                let inside = path.strip_prefix("/scenes").expect("a file in the scene's folder");
                assert!(inside.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)));
            }
            assert_eq!(
                anywhere.as_ref().ok(),
                Some(scene),
                "a file that is allowed inside is allowed anywhere, with the same path"
            );
        }
        Err(error) => check::error(&error.to_string(), "/scenes/x.toml"),
    }
    if anywhere.is_err() {
        return;
    }
    FOLDER.with(|own| {
        let own = own.get_or_init(folder);
        let path = own.file("scenes/x.toml", data);
        let inside = path.parent().and_then(|folder| folder.canonicalize().ok()).expect("the folder of the scene");
        match read_scene(&path, FilePolicy::Inside) {
            Ok(scene) => {
                for file in named(&scene) {
                    let real = file.canonicalize().expect("an existing file");
                    assert!(real.starts_with(&inside) && real.is_file(), "{} is {}", file.display(), real.display());
                }
            }
            Err(error) => check::error(&error.to_string(), "x.toml"),
        }
    });
}

/// Checks the guarantees of a scene.
fn sane(scene: &SceneFile) {
    assert!(scene.metres_per_unit.is_finite() && scene.metres_per_unit > 0.0);
    assert!(scene.probe.pose.is_valid() && scene.environment.pose.is_valid(), "{scene:?}");
    assert_eq!(scene.render.validate(), Ok(()));
    assert!((1.0..=1e5).contains(&scene.rate_hz));
    let others = scene.others.iter().map(|tool| (&tool.hand, &tool.coupling));
    for (hand, coupling) in std::iter::once((&scene.hand, &scene.coupling)).chain(others) {
        assert!(hand.tremor.is_finite() && hand.tremor >= 0.0);
        let gains = [coupling.stiffness, coupling.damping, coupling.angular_stiffness, coupling.angular_damping];
        let others = [coupling.contact_offset, coupling.mass, coupling.contact_stiffness, coupling.friction_stiffness];
        assert!(gains.into_iter().chain(others).flatten().all(|x| x.is_finite() && x >= 0.0), "{coupling:?}");
    }
    for tool in &scene.others {
        assert!(tool.body.pose.is_valid() && tool.limits.force >= 0.0 && tool.limits.torque >= 0.0, "{tool:?}");
    }
}

fn seeds() -> Vec<Seed> {
    let bodies = |probe: &str, environment: &str| {
        format!("[probe]\nmesh = \"{probe}\"\n[environment]\nmesh = \"{environment}\"\n")
    };
    let full = "unit = \"mm\"\n[probe]\nmesh = \"a.obj\"\nposition = [0, 0, 1.5]\norientation = [0, 0.6, 0, 0.8]\ngrip = [0, 1, 0]\n\
        [environment]\nmesh = \"sub/b.obj\"\n[contact]\ntolerance = 1.0\ncluster_radius = 4.0\nclustering = \"smooth\"\n\
        split_angle = 130\nstiffness = 800\ndamping = 0\nfriction = { static = 0.4, dynamic = 0.3, stiffness = 800 }\n\
        shading = true\ncrease_angle = 40\nshading_limit = 45\ntime_budget = 300\n[coupling]\nmode = \"coupled\"\n\
        stiffness = 800\ndamping = 2\nangular_stiffness = 2\nangular_damping = 0.005\ncontact_offset = 0.1\nmass = 0.1\n\
        [device]\nforce_limit = 8.5\ntorque_limit = 0.188\nsaturation = \"under-actuated\"\nrate = 1000\n\
        [hand]\npreset = \"normal\"\npath = \"sub/path.csv\"\ntremor = 0.1\nseed = 1\n";
    let tools = "unit = \"mm\"\n[environment]\nmesh = \"sub/b.obj\"\n[[tool]]\nmesh = \"a.obj\"\ngrip = [0, 1, 0]\n\
        hand = { preset = \"firm\", path = \"sub/path.csv\" }\n[[tool]]\nmesh = \"a.obj\"\nposition = [9, 0, 0]\n\
        coupling = { mode = \"direct\", contact_offset = 0.1 }\ndevice = { force_limit = 3, saturation = \"joint\" }\n";
    let mut seeds = vec![("full.toml".to_owned(), full.into()), ("tools.toml".to_owned(), tools.into())];
    let pairs = [
        ("a.obj", "sub/b.obj"),
        ("in.obj", "here/a.obj"),
        ("out.obj", "up/a.obj"),
        ("etc/passwd", "sub/p.obj"),
        ("./sub/../a.obj", "/etc/passwd"),
        ("C:a.obj", "..\\\\a.obj"),
        ("loop", "sub"),
        ("%2e%2e/a.obj", "a.obj\\u0000"),
    ];
    for (k, (probe, environment)) in pairs.into_iter().enumerate() {
        seeds.push((format!("{k}.toml"), format!("unit = 0.001\n{}", bodies(probe, environment)).into()));
    }
    seeds
}

target!(run: run, allowance: Allowance { per_byte: 400, always: 1 << 20 }, seeds: seeds);
