//! Scene files: the documented example, errors of invalid files, and the files that a scene may
//! refer to.

use std::path::{Path, PathBuf};

use glam::DVec3;
use palpus::algebra::Twist;
use palpus::render::{Clustering, Limits, Material, Saturation, Settings};
use palpus_io::scene::{CouplingMode, HandPreset, ObjectMotion, SceneCoupling, parse_scene};
use palpus_io::{FilePolicy, SceneFile, read_scene};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Seed of all random tests in this file.
const SEED: [u8; 32] = *b"palpus-io scene files, damaged 1";

const EXPERIENCE: &str = r#"unit = "mm"
[probe]        # body a
mesh = "spoon.obj"
[environment]  # body b
mesh = "cup.obj"
[contact]
tolerance = 1.0        # mm
cluster_radius = 4.0
stiffness = 800        # N/m
friction = { static = 0.4, dynamic = 0.3 }
shading = true
[coupling]
mode = "coupled"       # or "direct"
"#;

/// Returns the scene in the description of the module.
fn documented() -> String {
    let source = include_str!("../src/scene/mod.rs");
    let lines = source.lines().skip_while(|line| *line != "//! ```toml").skip(1).take_while(|line| *line != "//! ```");
    lines.map(|line| line.strip_prefix("//!").unwrap_or(line).to_owned() + "\n").collect()
}

fn parse(text: &str) -> Result<SceneFile, String> {
    parse_scene(text, Path::new("set/tea.toml"), FilePolicy::Inside).map_err(|error| error.to_string())
}

#[test]
fn example_scene_is_converted_to_si() {
    let scene = parse(EXPERIENCE).unwrap();
    assert_eq!(scene.metres_per_unit, 1e-3);
    assert_eq!(scene.probe.mesh, PathBuf::from("set/spoon.obj"));
    assert_eq!(scene.environment.mesh, PathBuf::from("set/cup.obj"));
    assert_eq!((scene.render.contact_tolerance, scene.render.cluster_radius), (1e-3, 4e-3));
    let friction = scene.render.friction.unwrap();
    assert_eq!(
        (friction.static_coefficient, friction.dynamic_coefficient, friction.tangential_stiffness),
        (0.4, 0.3, 800.0)
    );
    assert_eq!(scene.render.shading.unwrap().crease_angle, 40f64.to_radians());
    assert_eq!(scene.coupling.mode, CouplingMode::Coupled);
}

#[test]
fn material_is_a_name_or_three_numbers() {
    let with = |material: &str| parse(&EXPERIENCE.replace("shading = true", &format!("material = {material}")));
    assert_eq!(with("\"steel\"").unwrap().render.material, Some(Material::STEEL));
    let own = with("{ frequency = 120, decay = 70.5, gain = 9 }").unwrap().render.material;
    assert_eq!(own, Some(Material { frequency: 120.0, decay: 70.5, gain: 9.0 }));
    assert_eq!(parse(EXPERIENCE).unwrap().render.material, None);
    for (wrong, problem) in [
        ("\"glass\"", "material is \"glass\" but must be \"rubber\" or \"wood\" or \"steel\""),
        ("{ frequency = 120 }", "a material needs frequency, decay and gain"),
        ("{ frequency = 0, decay = 1, gain = 1 }", "from 1 to 1000 Hz"),
        ("3", "a table"),
    ] {
        let error = with(wrong).unwrap_err();
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn all_documented_keys_are_read() {
    let scene = parse(&documented()).unwrap();
    assert_eq!((scene.rate_hz, scene.hand.preset, scene.hand.seed), (1000.0, HandPreset::Normal, 1));
    assert_eq!(scene.hand.path.as_deref(), Some(Path::new("set/stir.csv")));
    assert_eq!((scene.hand.path_scale, scene.hand.path_speed), (Some(1.0), Some(1.0)));
    assert_eq!((scene.coupling.angular_damping, scene.render.time_budget), (Some(0.005), Some(300_000)));
    assert_eq!((scene.coupling.contact_offset, scene.render.material), (Some(0.1e-3), Some(Material::WOOD)));
    assert_eq!(
        (scene.render.limits, scene.render.split_angle),
        (Settings::default().limits, Settings::default().split_angle)
    );
    let [second] = &scene.others[..] else { panic!("one tool beside the probe") };
    assert_eq!((second.body.mesh.clone(), second.hand.preset), (PathBuf::from("set/lid.obj"), HandPreset::Firm));
    assert_eq!((second.body.pose.translation, second.grip), (DVec3::Z * 0.05, None));
    assert_eq!((scene.objects.len(), scene.gravity.z), (2, -9.81));
    let motions = [ObjectMotion::FreeOfDensity(7800.0), scene.objects[1].motion];
    assert!(scene.objects[0].motion == motions[0] && matches!(motions[1], ObjectMotion::Driven(_)));
    assert_eq!(
        documented().lines().filter(|line| line.contains('=')).count(),
        51,
        "a key was added: check its value above"
    );
}

#[test]
fn objects_are_free_or_driven_or_fixed() {
    let text = EXPERIENCE.to_owned()
        + "[[object]]\nmesh = \"nut.obj\"\nposition = [20, 0, 5]\ndensity = 7800\n\
           [[object]]\nmesh = \"nut.obj\"\nmass = 0.02\n\
           [[object]]\nmesh = \"arm.obj\"\nmotion = \"driven\"\nvelocity = [100, 0, 0]\nangular_velocity = [0, 0, 2]\n\
           [[object]]\nmesh = \"wall.obj\"\nmotion = \"fixed\"\n\
           [[object]]\nmesh = \"cork.obj\"\n";
    let scene = parse(&text).unwrap();
    let motions: Vec<_> = scene.objects.iter().map(|object| object.motion).collect();
    let driven = Twist { angular: DVec3::Z * 2.0, linear: DVec3::X * 0.1 };
    let expected = [
        ObjectMotion::FreeOfDensity(7800.0),
        ObjectMotion::FreeOfMass(0.02),
        ObjectMotion::Driven(driven),
        ObjectMotion::Fixed,
        ObjectMotion::FreeOfDensity(1000.0),
    ];
    assert_eq!(motions, expected);
    assert_eq!(scene.objects[0].body.pose.translation, DVec3::new(0.02, 0.0, 0.005));
    assert_eq!(scene.gravity, DVec3::new(0.0, 0.0, -9.81));
    assert_eq!(parse(EXPERIENCE).unwrap().gravity, DVec3::ZERO);
    let floating = parse(&format!("gravity = [0, 0, 0]\n{text}")).unwrap();
    assert_eq!(floating.gravity, DVec3::ZERO);
    for (wrong, said) in [
        ("[[object]]\nmotion = \"free\"\n", "[[object]] has no mesh"),
        ("[[object]]\nmesh = \"a.obj\"\ndensity = 0\n", "density is 0.0 but must be greater than 0 kg/m³"),
        ("[[object]]\nmesh = \"a.obj\"\ndensity = 1\nmass = 1\n", "either density or mass"),
        ("[[object]]\nmesh = \"a.obj\"\nmotion = \"fixed\"\nmass = 1\n", "remove them"),
        ("[[object]]\nmesh = \"a.obj\"\nvelocity = [1, 0, 0]\n", "motion = \"driven\""),
        ("[[object]]\nmesh = \"a.obj\"\nmotion = \"loose\"\n", "\"free\" or \"driven\" or \"fixed\""),
        ("[[object]]\nmesh = \"a.obj\"\nweight = 1\n", "did you mean"),
        ("[object]\nmesh = \"a.obj\"\n", "each starting with [[object]]"),
    ] {
        let error = parse(&(EXPERIENCE.to_owned() + wrong)).unwrap_err();
        assert!(error.contains(said) && error.contains("line "), "{wrong}: {error}");
    }
}

/// Three tools: the first has only a mesh, the second sets all keys, and the third sets its
/// position.
const TOOLS: &str = r#"unit = "mm"
[coupling]
stiffness = 700
contact_offset = 0.2
[device]
force_limit = 6
rate = 500
[environment]
mesh = "cup.obj"
[contact]
stiffness = 900
[[tool]]
mesh = "spoon.obj"
[[tool]]
mesh = "lid.obj"
unit = "cm"
position = [0, 0, 50]
grip = [1, 0, 0]
hand = { preset = "firm", seed = 7, path = "lid.csv" }
coupling = { mode = "direct", stiffness = 300 }
device = { torque_limit = 0.1, saturation = "joint" }
[[tool]]
mesh = "spoon.obj"
position = [0, 0, 90]
"#;

#[test]
fn each_tool_has_its_hand_coupling_and_device() {
    let scene = parse(TOOLS).unwrap();
    let of_scene = SceneCoupling {
        stiffness: Some(700.0),
        contact_offset: Some(2e-4),
        contact_stiffness: Some(900.0),
        ..SceneCoupling::default()
    };
    assert_eq!((scene.coupling, scene.rate_hz), (of_scene, 500.0));
    assert_eq!((scene.render.limits.force, scene.render.grip_a), (6.0, DVec3::ZERO));
    let [second, third] = &scene.others[..] else { panic!("three tools") };
    assert_eq!((second.body.metres_per_unit, second.body.pose.translation.z), (0.01, 0.05));
    assert_eq!((second.grip, second.hand.preset, second.hand.seed), (Some(DVec3::X * 1e-3), HandPreset::Firm, 7));
    assert_eq!(second.hand.path.as_deref(), Some(Path::new("set/lid.csv")));
    let own = SceneCoupling { mode: CouplingMode::Direct, stiffness: Some(300.0), ..of_scene };
    assert_eq!((second.coupling, second.limits), (own, Limits { force: 6.0, torque: 0.1 }));
    assert_eq!((second.saturation, third.saturation), (Saturation::Joint, scene.render.saturation));
    assert_eq!((third.coupling, third.limits.force, &third.hand), (of_scene, 6.0, &scene.hand));
    assert!(scene.gaps.places && scene.gaps.grip);
}

#[test]
fn tool_tables_equal_probe_and_second() {
    let around = "unit = \"mm\"\n[environment]\nmesh = \"cup.obj\"\n";
    let probe = "mesh = \"spoon.obj\"\nposition = [0, 0, 9]\n";
    let second = "mesh = \"lid.obj\"\ngrip = [1, 2, 3]\n";
    let old = format!(
        "{around}[probe]\n{probe}[hand]\npreset = \"firm\"\n[second]\n{second}[second.hand]\npreset = \"tight\"\n"
    );
    let new = format!(
        "{around}[[tool]]\n{probe}hand = {{ preset = \"firm\" }}\n[[tool]]\n{second}hand = {{ preset = \"tight\" }}\n"
    );
    let [old, new] = [old, new].map(|text| SceneFile { text: String::new(), ..parse(&text).unwrap() });
    assert_eq!(old, new);
    for (wrong, said) in [
        ("[probe]\nmesh = \"a.obj\"\n", "[probe] and [[tool]] cannot be combined"),
        ("[second]\nmesh = \"a.obj\"\n", "[second] and [[tool]] cannot be combined"),
        ("[hand]\nseed = 1\n", "write hand = { … } in each [[tool]]"),
        ("[[tool]]\ngrip = [0, 0, 0]\n", "[[tool]] has no mesh"),
        ("[[tool]]\nmesh = \"a.obj\"\ndevice = { rate = 500 }\n", "no key \"rate\""),
        ("[[tool]]\nmesh = \"a.obj\"\ntremor = 1\n", "did you mean"),
    ] {
        let error = parse(&(TOOLS.to_owned() + wrong)).unwrap_err();
        assert!(error.contains(said) && error.contains("line "), "{wrong}: {error}");
    }
    let many = "[[tool]]\nmesh = \"a.obj\"\n".repeat(14);
    assert!(parse(&(TOOLS.to_owned() + &many)).unwrap_err().contains("may have at most 16 tools"));
    let none = parse(&format!("tool = []\n{around}")).unwrap_err();
    assert!(none.contains("[probe] has no mesh"), "{none}");
}

#[test]
fn missing_keys_have_documented_defaults() {
    let scene = parse("unit = 0.08\nprobe.mesh = 'a.obj'\nenvironment = { mesh = 'b.obj' }\n").unwrap();
    assert_eq!(scene.metres_per_unit, 0.08);
    assert_eq!(scene.render, Settings::default());
    assert_eq!((scene.coupling.mode, scene.coupling.stiffness, scene.rate_hz), (CouplingMode::Coupled, None, 1000.0));
    assert_eq!((scene.hand.preset, scene.hand.path, scene.hand.tremor), (HandPreset::Normal, None, 0.0));
}

#[test]
fn all_lengths_follow_the_unit() {
    let text = r#"
        unit = "inch"
        [probe]
        mesh = "a.obj"
        position = [1, 2.0, -3]
        orientation = [0, 0, 0.7071, 0.7071]
        grip = [0, 10, 0]
        [environment]
        mesh = "b.obj"
        unit = 0.15
        position = [1, 0, 0]
        [contact]
        tolerance = 0.5
        cluster_radius = 0
        split_angle = false
        clustering = "smooth"
        [hand]
        tremor = 0.01
    "#;
    let scene = parse(text).unwrap();
    assert_eq!(scene.probe.pose.translation, DVec3::new(1.0, 2.0, -3.0) * 0.0254);
    assert!(scene.probe.pose.is_valid());
    assert_eq!(scene.render.grip_a, DVec3::Y * 10.0 * 0.0254);
    // A mesh may have a separate unit, but its position uses the scene's unit.
    assert_eq!((scene.probe.metres_per_unit, scene.environment.metres_per_unit), (0.0254, 0.15));
    assert_eq!(scene.environment.pose.translation, DVec3::X * 0.0254);
    assert_eq!((scene.render.contact_tolerance, scene.render.cluster_radius), (0.5 * 0.0254, 0.0));
    assert_eq!((scene.render.split_angle, scene.hand.tremor), (None, 0.01 * 0.0254));
    assert_eq!(scene.render.clustering, Clustering::Smooth);
}

#[test]
fn errors_name_problem_place_and_remedy() {
    let change = |from: &str, to: &str| parse(&EXPERIENCE.replace(from, to)).unwrap_err();
    let cases = [
        (
            change("tolerance", "tolerence"),
            "line 7, column 1: [contact] has no key \"tolerence\"; did you mean \"tolerance\"? (valid keys: tolerance, \
          cluster_radius, clustering, split_angle, stiffness, damping, friction, material, shading, crease_angle, shading_limit, \
          time_budget)",
        ),
        (
            change("[coupling]", "[cuopling]"),
            "line 12, column 2: a scene file has no key \"cuopling\"; did you mean \"coupling\"? (valid keys: unit, probe, \
          second, tool, environment, object, gravity, contact, coupling, device, hand)",
        ),
        (
            change("dynamic = 0.3", "kinetic = 0.3"),
            "line 10, column 28: [contact], friction has no key \"kinetic\"; did you mean \"static\"? (valid keys: static, \
          dynamic, stiffness)",
        ),
        (change("tolerance = 1.0", "tolerance = 0"), "line 7, column 13: tolerance is 0.0 but must be greater than 0"),
        (
            change("tolerance = 1.0", "tolerance = nan"),
            "line 7, column 13: tolerance is NaN but must be greater than 0",
        ),
        (change("= 800 ", "= \"800\""), "line 9, column 13: stiffness must be a number but has type string"),
        (
            change("\"coupled\"", "\"couple\""),
            "line 13, column 8: mode is \"couple\" but must be \"coupled\" or \"direct\"",
        ),
        (
            change("static = 0.4", "static = 0.2"),
            "line 10, column 12: static friction is 0.2 but must not be less than the dynamic friction 0.3",
        ),
        (
            change("\"mm\"", "\"mil\""),
            "line 1, column 8: \"mil\" is not a unit; use one of \"mm\", \"cm\", \"m\", \"inch\", \"um\", \"dm\", \"km\", \"ft\", \
          or metres as a number",
        ),
        (
            change("unit = \"mm\"", ""),
            "line 1, column 1: unit is missing: write unit = \"mm\" (or cm, m, inch, …) above the first section; it is the unit of the lengths in this file, and of the meshes without a unit of their own",
        ),
        (
            change("mesh = \"spoon.obj\"", ""),
            "line 2, column 1: [probe] has no mesh; add mesh = \"FILE\" under [probe]",
        ),
        (
            change("shading = true", "shading = 1"),
            "line 11, column 11: shading must be true or false but has type integer",
        ),
        (
            change("shading = true", "crease_angle = 30"),
            "line 6, column 1: crease_angle and shading_limit need shading; add shading = true (or false) to [contact]",
        ),
        (
            change("mesh = \"cup.obj\"", "mesh = \"cup.obj\"\norientation = [0, 0, 0, 2]"),
            "line 6, column 15: orientation has length 2.0 but must have 1; normalise it (the order is x, y, z, w)",
        ),
        (
            change("mesh = \"cup.obj\"", "mesh = \"cup.obj\"\nposition = [0, 0]"),
            "line 6, column 12: position must be a list of 3 finite numbers",
        ),
        // This case was found by fuzzing: the error had two lines.
        (
            change("\"cup.obj\"", "\"cup.o\\nbj\""),
            "line 5, column 8: a file name is expected here, without control characters",
        ),
        (change("[contact]", "[contact"), "line 6, column 9: this is not valid TOML: unclosed table, expected `]`"),
    ];
    for (found, expected) in cases {
        assert_eq!(found, format!("set/tea.toml, {expected}"));
    }
}

#[test]
fn files_outside_the_folder_need_permission() {
    for named in ["../cup.obj", "/etc/passwd", "a/../../cup.obj", "C:cup.obj", "a\\..\\..\\cup.obj"] {
        let text = EXPERIENCE.replace("\"cup.obj\"", &format!("'{named}'"));
        let error = parse(&text).unwrap_err();
        assert!(
            error.starts_with("set/tea.toml, line 5, column 8: ") && error.contains("outside the scene file's folder"),
            "{error}"
        );
        let scene = parse_scene(&text, Path::new("set/tea.toml"), FilePolicy::Anywhere).unwrap();
        assert_eq!(scene.environment.mesh, Path::new("set").join(named));
    }
    assert!(parse(&EXPERIENCE.replace("\"cup.obj\"", "\"./cups/big cup.obj\"")).is_ok());
}

#[test]
fn files_must_exist_and_links_must_stay_inside() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_files");
    std::fs::create_dir_all(folder.join("in")).unwrap();
    let scene = folder.join("in/tea.toml");
    std::fs::write(&scene, EXPERIENCE).unwrap();
    std::fs::write(folder.join("in/spoon.obj"), "").unwrap();
    let cup = folder.join("in/cup.obj");
    let _ = std::fs::remove_file(&cup);
    let read = |policy| read_scene(&scene, policy).map_err(|error| error.to_string());
    let error = read(FilePolicy::Inside).unwrap_err();
    assert!(error.contains("tea.toml, line 5, column 8: ") && error.contains("cup.obj cannot be found"), "{error}");
    std::fs::write(&cup, "").unwrap();
    assert_eq!(read(FilePolicy::Inside).unwrap().environment.mesh, cup);
    #[cfg(unix)]
    {
        std::fs::remove_file(&cup).unwrap();
        std::fs::write(folder.join("outside.obj"), "").unwrap();
        std::os::unix::fs::symlink(folder.join("outside.obj"), &cup).unwrap();
        assert!(read(FilePolicy::Inside).unwrap_err().contains("outside the scene file's folder"));
        assert!(read(FilePolicy::Anywhere).is_ok());
        std::fs::remove_file(&cup).unwrap();
    }
}

#[test]
fn damaged_scenes_never_panic() {
    let config = Config { cases: 1500, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &SEED));
    let piece = prop::sample::select(vec![
        "",
        "\n",
        "\"",
        "=",
        "[",
        "]",
        "{",
        "}",
        "-1",
        "1e999",
        "nan",
        "0x7F",
        "true",
        "é",
        "'",
        ".",
        "#",
        "1979-05-27",
        "mesh",
        "unit",
        "99999999999999999999",
        "[[probe]]",
    ]);
    let edits = prop::collection::vec((any::<prop::sample::Index>(), 0..4usize, piece), 1..5);
    let run = runner.run(&edits, |edits| {
        let mut letters: Vec<char> = documented().chars().collect();
        for (at, removed, piece) in edits {
            let at = at.index(letters.len());
            letters.splice(at..(at + removed).min(letters.len()), piece.chars());
        }
        if let Err(error) = parse(&letters.into_iter().collect::<String>()) {
            prop_assert!(error.starts_with("set/tea.toml") && !error.contains('\n'), "{}", error);
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}
