//! Parses the text of a scene file into a [`SceneFile`], with one function for each table of the
//! file.

use std::io::Read;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, Material, Saturation, Settings};
use toml::de::DeTable;

use super::keys::{Section, Source};
use super::objects::{read_gravity, read_objects};
use super::{
    CouplingMode, FilePolicy, HandPreset, SceneBody, SceneCoupling, SceneError, SceneFile, SceneGaps, SceneHand,
    SceneTool, unit,
};
use crate::one_line::one_line;

/// Size of the largest scene file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Default crease angle. The angle is larger than the bends of a coarse round mesh and smaller than
/// the bends of a box.
const CREASE_ANGLE_DEGREES: f64 = 40.0;
/// Default limit of the rotation of a force by shading.
const SHADING_LIMIT_DEGREES: f64 = 45.0;
/// Largest deviation of a quaternion's length from 1; sufficient for numbers with three decimals.
const QUATERNION_SLACK: f64 = 1e-3;
/// Default rate of the loop, in Hz.
const RATE_HZ: f64 = 1000.0;

/// Reads a scene file and checks that the files which it refers to exist.
pub fn read_scene(path: &Path, policy: FilePolicy) -> Result<SceneFile, SceneError> {
    let file = path.display().to_string();
    let whole = |problem: String| SceneError { file: file.clone(), line: 0, column: 0, problem };
    let unreadable = |error| whole(format!("cannot be read ({error}); check the path"));
    let mut bytes = Vec::new();
    std::fs::File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(whole("the file is larger than 1 MiB; is it a scene file?".to_owned()));
    }
    let text =
        String::from_utf8(bytes).map_err(|_| whole("the file is not UTF-8 text; is it a scene file?".to_owned()))?;
    parse(&text, path, policy, &|named| check_file(path, named, policy))
}

/// Parses the text of a scene file without reading other files. `path` is the path of the scene
/// file, used in error messages and to find the other files.
pub fn parse_scene(text: &str, path: &Path, policy: FilePolicy) -> Result<SceneFile, SceneError> {
    parse(text, path, policy, &|_| Ok(()))
}

/// Checks a file that the scene refers to; fails with a description of the problem.
type Check<'a> = &'a dyn Fn(&Path) -> Result<(), String>;

/// Location of a scene's files, and the check for each of them.
#[derive(Clone, Copy)]
pub(super) struct Files<'a> {
    folder: &'a Path,
    policy: FilePolicy,
    check: Check<'a>,
}

fn parse(text: &str, path: &Path, policy: FilePolicy, check: Check<'_>) -> Result<SceneFile, SceneError> {
    let file = path.display().to_string();
    let source = Source { file: &file, text };
    let root = DeTable::parse(text).map_err(|error| {
        let problem = format!("this is not valid TOML: {}", one_line(error.message()));
        source.error(&error.span().unwrap_or(0..0), problem)
    })?;
    let files = Files { folder: path.parent().unwrap_or(Path::new("")), policy, check };

    let keys = [
        "unit",
        "probe",
        "second",
        "tool",
        "environment",
        "object",
        "gravity",
        "contact",
        "coupling",
        "device",
        "hand",
    ];
    let top = Section::top(source, &root, &keys)?;
    let unit = read_unit(&top)?.ok_or_else(|| {
        top.error(
            "unit is missing: write unit = \"mm\" (or cm, m, inch, …) above the first section; it is the unit of the lengths in this file, and of the meshes without a unit of their own",
        )
    })?;
    let sections = tool_sections(&top)?;
    let environment_section = top.section("environment", &["mesh", "unit", "position", "orientation"])?;
    let environment = read_body(&environment_section, unit, files)?;
    let mut render = Settings::default();
    let mut coupling = read_coupling(&top, unit, &SceneCoupling::default())?;
    read_contact(&top, unit, &mut render, &mut coupling)?;
    let usual = ToolDefaults { coupling, limits: render.limits, saturation: render.saturation };
    let (usual, rate_hz) = read_device(&top, &["rate"], &usual)?;
    let read = |(tool, with_hand): &(Section<'_>, Section<'_>)| read_tool(tool, with_hand, unit, files, &usual);
    let mut others = sections.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let SceneTool { body: probe, grip, hand, coupling, limits, saturation } = others.remove(0);
    (render.grip_a, render.limits, render.saturation) = (grip.unwrap_or_default(), limits, saturation);
    let objects = read_objects(&top, unit, files)?;
    let gravity = read_gravity(&top, &objects)?;
    render.validate().map_err(|error| SceneError {
        file: file.clone(),
        line: 0,
        column: 0,
        problem: error.to_string(),
    })?;
    let places = ["position", "orientation"];
    let gaps = SceneGaps {
        tolerance: !top.says("contact", &["tolerance"]),
        cluster_radius: !top.says("contact", &["cluster_radius"]),
        places: !sections[0].0.has(&places) && !environment_section.has(&places),
        grip: grip.is_none(),
    };
    let text = text.to_owned();
    let metres_per_unit = unit;
    Ok(SceneFile {
        text,
        gaps,
        metres_per_unit,
        probe,
        environment,
        render,
        coupling,
        rate_hz,
        hand,
        others,
        objects,
        gravity,
    })
}

/// Reads the length of one unit in metres, for the whole file or for one mesh.
fn read_unit(section: &Section<'_>) -> Result<Option<f64>, SceneError> {
    if section.is_text("unit") {
        let (name, span) = section.text("unit")?.unwrap_or_default();
        let unknown = |names| {
            section.error_at(&span, format!("{name:?} is not a unit; use one of {names}, or metres as a number"))
        };
        return unit::metres(name).map(Some).map_err(unknown);
    }
    section.number("unit", "the metres in one unit, from 1e-9 to 1e9", |x| (1e-9..=1e9).contains(&x))
}

/// Keys of the table of a tool.
const TOOL_KEYS: [&str; 8] = ["mesh", "unit", "position", "orientation", "grip", "hand", "coupling", "device"];
/// Largest number of tools in a scene, because every pair of tools can touch and each tool needs a
/// device.
const MOST_TOOLS: usize = 16;

/// Returns the tables of all tools, each with the table of its hand. The tables are the `[[tool]]`
/// entries or, without them, `[probe]` and optionally `[second]`.
fn tool_sections<'a>(top: &Section<'a>) -> Result<Vec<(Section<'a>, Section<'a>)>, SceneError> {
    let tools = top.sections("tool", &TOOL_KEYS)?;
    let own = |tool: Section<'a>| (tool.clone(), tool);
    if let Some(one_too_many) = tools.get(MOST_TOOLS) {
        return Err(one_too_many.error(format!("a scene may have at most {MOST_TOOLS} tools")));
    }
    if tools.is_empty() {
        let probe = top.section("probe", &["mesh", "unit", "position", "orientation", "grip"])?;
        let second = top.section("second", &["mesh", "unit", "position", "orientation", "grip", "hand"])?;
        let second = second.exists().then(|| own(second));
        return Ok(std::iter::once((probe, top.clone())).chain(second).collect());
    }
    for (other_way, instead) in [
        ("probe", "make the probe the first [[tool]]"),
        ("second", "make the second tool a [[tool]]"),
        ("hand", "write hand = { … } in each [[tool]]"),
    ] {
        if let Some(place) = top.place(other_way) {
            let problem = format!("[{other_way}] and [[tool]] cannot be combined; {instead}");
            return Err(top.error_at(&place, problem));
        }
    }
    Ok(tools.into_iter().map(own).collect())
}

/// Reads a tool; values of the coupling and the device that its table does not set are taken from
/// `usual`.
fn read_tool(
    tool: &Section<'_>,
    with_hand: &Section<'_>,
    unit: f64,
    files: Files<'_>,
    usual: &ToolDefaults,
) -> Result<SceneTool, SceneError> {
    let body = read_body(tool, unit, files)?;
    let grip = tool.vector("grip")?.map(|grip| DVec3::from_array(grip.into_inner()) * unit);
    let hand = read_hand(with_hand, unit, files)?;
    let coupling = read_coupling(tool, unit, &usual.coupling)?;
    let ToolDefaults { limits, saturation, .. } = read_device(tool, &[], usual)?.0;
    Ok(SceneTool { body, grip, hand, coupling, limits, saturation })
}

pub(super) fn read_body(section: &Section<'_>, unit: f64, files: Files<'_>) -> Result<SceneBody, SceneError> {
    let missing = || section.error(format!("{0} has no mesh; add mesh = \"FILE\" under {0}", section.title()));
    let (mesh, span) = section.text("mesh")?.ok_or_else(missing)?;
    let mesh = resolve(section, mesh, &span, files)?;
    let translation =
        section.vector("position")?.map_or(DVec3::ZERO, |position| DVec3::from_array(position.into_inner()) * unit);
    let mut rotation = DQuat::IDENTITY;
    if let Some(quaternion) = section.vector("orientation")? {
        rotation = DQuat::from_array(*quaternion.get_ref());
        let length = rotation.length();
        if (length - 1.0).abs() > QUATERNION_SLACK {
            let problem =
                format!("orientation has length {length:?} but must have 1; normalise it (the order is x, y, z, w)");
            return Err(section.error_at(&quaternion.span(), problem));
        }
    }
    let metres_per_unit = read_unit(section)?.unwrap_or(unit);
    Ok(SceneBody { mesh, metres_per_unit, pose: Pose::new(rotation, translation) })
}

fn read_contact(
    top: &Section<'_>,
    unit: f64,
    render: &mut Settings,
    coupling: &mut SceneCoupling,
) -> Result<(), SceneError> {
    let keys = [
        "tolerance",
        "cluster_radius",
        "clustering",
        "split_angle",
        "stiffness",
        "damping",
        "friction",
        "material",
        "shading",
        "crease_angle",
        "shading_limit",
        "time_budget",
    ];
    let contact = top.section("contact", &keys)?;
    if let Some(tolerance) = contact.number("tolerance", "greater than 0", |x| x > 0.0)? {
        render.contact_tolerance = tolerance * unit;
    }
    if let Some(radius) = contact.number("cluster_radius", "0 or greater", |x| x >= 0.0)? {
        render.cluster_radius = radius * unit;
    }
    let clusterings = [("linkage", Clustering::Linkage), ("smooth", Clustering::Smooth)];
    if let Some(clustering) = contact.choice("clustering", &clusterings)? {
        render.clustering = clustering;
    }
    if contact.is_false("split_angle") {
        render.split_angle = None;
    } else if let Some(angle) =
        contact.number("split_angle", "from 60 to 170 degrees", |x| (60.0..=170.0).contains(&x))?
    {
        render.split_angle = Some(angle.to_radians());
    }
    if let Some(stiffness) = contact.number("stiffness", "greater than 0 N/m", |x| x > 0.0)? {
        render.stiffness = stiffness;
        coupling.contact_stiffness = Some(stiffness);
    }
    if let Some(damping) = contact.number("damping", "0 or greater N·s/m", |x| x >= 0.0)? {
        render.damping = damping;
    }
    if let Some(micros) = contact.number("time_budget", "from 1 to 1000000 µs", |x| (1.0..=1e6).contains(&x))? {
        render.time_budget = Some((micros * 1e3) as u64);
    }
    (render.friction, coupling.friction_stiffness) = read_friction(&contact, render.stiffness)?;
    render.material = read_material(&contact)?;
    let crease = contact.number("crease_angle", "from 0 to 180 degrees", |x| (0.0..=180.0).contains(&x))?;
    let limit = contact.number("shading_limit", "from 0 to 89 degrees", |x| (0.0..=89.0).contains(&x))?;
    let shading = contact.boolean("shading")?;
    if shading.is_none() && crease.or(limit).is_some() {
        return Err(
            contact.error("crease_angle and shading_limit need shading; add shading = true (or false) to [contact]")
        );
    }
    render.shading = shading.unwrap_or(false).then(|| ShadingSettings {
        crease_angle: crease.unwrap_or(CREASE_ANGLE_DEGREES).to_radians(),
        most_turn: limit.unwrap_or(SHADING_LIMIT_DEGREES).to_radians(),
    });
    Ok(())
}

/// Reads the friction and, if the file sets it, its stiffness.
fn read_friction(contact: &Section<'_>, stiffness: f64) -> Result<(Option<FrictionSettings>, Option<f64>), SceneError> {
    let friction = contact.section("friction", &["static", "dynamic", "stiffness"])?;
    if !friction.exists() {
        return Ok((None, None));
    }
    let rule = "from 0 to 10";
    let in_range = |x: f64| (0.0..=10.0).contains(&x);
    let sticking = friction.number("static", rule, in_range)?;
    let sliding = friction.number("dynamic", rule, in_range)?;
    let Some(dynamic_coefficient) = sliding.or(sticking) else {
        return Err(friction.error("friction has no coefficient; write friction = { static = 0.4, dynamic = 0.3 }"));
    };
    let static_coefficient = sticking.unwrap_or(dynamic_coefficient);
    if static_coefficient < dynamic_coefficient {
        let problem = format!(
            "static friction is {static_coefficient:?} but must not be less than the dynamic friction {dynamic_coefficient:?}"
        );
        return Err(friction.error(problem));
    }
    let chosen = friction.number("stiffness", "greater than 0 N/m", |x| x > 0.0)?;
    let tangential_stiffness = chosen.unwrap_or(stiffness);
    Ok((Some(FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness }), chosen))
}

/// Reads the vibration after impacts: the name of a material, or its three numbers.
fn read_material(contact: &Section<'_>) -> Result<Option<Material>, SceneError> {
    if contact.is_text("material") {
        return contact.choice("material", &Material::NAMED);
    }
    let material = contact.section("material", &["frequency", "decay", "gain"])?;
    if !material.exists() {
        return Ok(None);
    }
    let said = [
        material.number("frequency", "from 1 to 1000 Hz", |x| (1.0..=1e3).contains(&x))?,
        material.number("decay", "from 1 to 10000 1/s", |x| (1.0..=1e4).contains(&x))?,
        material.number("gain", "from 0 to 1000 N·s/m", |x| (0.0..=1e3).contains(&x))?,
    ];
    match said {
        [Some(frequency), Some(decay), Some(gain)] => Ok(Some(Material { frequency, decay, gain })),
        _ => Err(material.error("a material needs frequency, decay and gain; or write material = \"wood\"")),
    }
}

/// Values for tools whose tables do not set them.
struct ToolDefaults {
    coupling: SceneCoupling,
    limits: Limits,
    saturation: Saturation,
}

/// Former name of the key `contact_offset`, which scenes and recordings may still have.
const OLD_OFFSET: &str = "skin";

/// Reads the table `coupling`; missing values are taken from `usual`.
fn read_coupling(top: &Section<'_>, unit: f64, usual: &SceneCoupling) -> Result<SceneCoupling, SceneError> {
    let keys =
        ["mode", "stiffness", "damping", "angular_stiffness", "angular_damping", "contact_offset", OLD_OFFSET, "mass"];
    let coupling = top.section("coupling", &keys)?;
    let positive = |key, unit: &str| coupling.number(key, &format!("greater than 0 {unit}"), |x| x > 0.0);
    let not_negative = |key, unit: &str| coupling.number(key, &format!("0 or greater {unit}"), |x| x >= 0.0);
    let modes = [("coupled", CouplingMode::Coupled), ("direct", CouplingMode::Direct)];
    let length = |key| coupling.number(key, "greater than 0", |x| x > 0.0);
    let offset = length("contact_offset")?.or(length(OLD_OFFSET)?);
    Ok(SceneCoupling {
        mode: coupling.choice("mode", &modes)?.unwrap_or(usual.mode),
        stiffness: positive("stiffness", "N/m")?.or(usual.stiffness),
        damping: not_negative("damping", "N·s/m")?.or(usual.damping),
        angular_stiffness: positive("angular_stiffness", "N·m/rad")?.or(usual.angular_stiffness),
        angular_damping: not_negative("angular_damping", "N·m·s/rad")?.or(usual.angular_damping),
        contact_offset: offset.map(|offset| offset * unit).or(usual.contact_offset),
        mass: not_negative("mass", "kg")?.or(usual.mass),
        ..*usual
    })
}

/// Names of the values of `saturation`.
const SATURATIONS: [(&str, Saturation); 3] =
    [("separate", Saturation::Separate), ("joint", Saturation::Joint), ("under-actuated", Saturation::UnderActuated)];

/// Reads the table `device` and, if `more` contains that key, the rate of the loop in Hz. Missing
/// values are taken from `usual`.
fn read_device(top: &Section<'_>, more: &[&str], usual: &ToolDefaults) -> Result<(ToolDefaults, f64), SceneError> {
    let device = top.section("device", &[&["force_limit", "torque_limit", "saturation"], more].concat())?;
    let limits = Limits {
        force: device.number("force_limit", "0 or greater N", |x| x >= 0.0)?.unwrap_or(usual.limits.force),
        torque: device.number("torque_limit", "0 or greater N·m", |x| x >= 0.0)?.unwrap_or(usual.limits.torque),
    };
    let saturation = device.choice("saturation", &SATURATIONS)?.unwrap_or(usual.saturation);
    let rate_hz = device.number("rate", "from 1 to 100000 Hz", |x| (1.0..=1e5).contains(&x))?;
    Ok((ToolDefaults { limits, saturation, ..*usual }, rate_hz.unwrap_or(RATE_HZ)))
}

fn read_hand(top: &Section<'_>, unit: f64, files: Files<'_>) -> Result<SceneHand, SceneError> {
    let hand = top.section("hand", &["preset", "path", "path_scale", "path_speed", "tremor", "seed"])?;
    use HandPreset::{Firm, None as NoHand, Normal, Relaxed, Tight};
    let presets = [Relaxed, Normal, Firm, Tight, NoHand].map(|preset| (preset.name(), preset));
    let path = match hand.text("path")? {
        Some((path, span)) => Some(resolve(&hand, path, &span, files)?),
        None => None,
    };
    let factor = |key| hand.number(key, "from 0.001 to 1000", |x| (1e-3..=1e3).contains(&x));
    let (path_scale, path_speed) = (factor("path_scale")?, factor("path_speed")?);
    let whole = |x: f64| x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x);
    Ok(SceneHand {
        preset: hand.choice("preset", &presets)?.unwrap_or_default(),
        path,
        path_scale,
        path_speed,
        tremor: hand.number("tremor", "0 or greater", |x| x >= 0.0)?.unwrap_or(0.0) * unit,
        seed: hand.number("seed", "a whole number from 0 to 4294967295", whole)?.unwrap_or(0.0) as u32,
    })
}

/// Returns the path of a file that the scene refers to.
fn resolve(section: &Section<'_>, named: &str, span: &Range<usize>, files: Files<'_>) -> Result<PathBuf, SceneError> {
    // Error messages contain the name and must be one line.
    if named.is_empty() || named.contains(char::is_control) {
        return Err(section.error_at(span, "a file name is expected here, without control characters"));
    }
    let relative = Path::new(named);
    // A backslash separates folders only on Windows. Backslashes are rejected on all systems,
    // so that a scene has the same meaning everywhere.
    let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let stays = stays && !named.contains('\\') && !has_drive(named);
    if files.policy == FilePolicy::Inside && !stays {
        return Err(section.error_at(span, outside(named)));
    }
    let path = files.folder.join(relative);
    (files.check)(&path).map_err(|problem| section.error_at(span, problem))?;
    Ok(path)
}

/// Returns true for names of the form `c:…`.
fn has_drive(named: &str) -> bool {
    named.as_bytes().get(1) == Some(&b':')
}

fn outside(named: &str) -> String {
    format!(
        "{named:?} is outside the scene file's folder; move it there, or allow files from anywhere if you trust the scene"
    )
}

/// Checks that a file which the scene refers to exists and, after all links are resolved, is in an
/// allowed folder.
fn check_file(scene: &Path, named: &Path, policy: FilePolicy) -> Result<(), String> {
    let missing = |error| format!("{} cannot be found ({error}); check the name", named.display());
    let real = named.canonicalize().map_err(missing)?;
    if !real.is_file() {
        return Err(format!("{} is not a file; name a file", named.display()));
    }
    if policy == FilePolicy::Anywhere {
        return Ok(());
    }
    let folder = match scene.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize().map_err(missing)?;
    if real.starts_with(folder) { Ok(()) } else { Err(outside(&named.display().to_string())) }
}
