//! Prepares a scene, built-in or from a file, as a stage.

use std::path::Path;
use std::sync::Arc;

use anyhow::bail;
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::Settings;
use palpus_io::record::{MOST_SCENE_TEXT, RecordedBody, RecordedScene, SceneSource};
use palpus_io::scene::{FilePolicy, ObjectMotion, SceneBody, SceneCoupling, SceneFile, SceneHand};
use palpus_io::{ContentHash, MeshFormat, similar_name};
use palpus_scenes::{HandPath, Motion, Scene, Tremor};

use super::{OtherTool, Stage, StageObject};
use crate::approach::{Ways, approach};
use crate::bodies::{self, Teller};
use crate::hand_path::{Following, follow};
use crate::{gaps, tools};

use super::outside::read_asking;

/// Largest angle by which force shading turns a direction, so that the force cannot push into the
/// surface.
const MOST_SHADING_TURN_DEGREES: f64 = 45.0;

/// Finds and prepares the scene called `name`: a built-in scene, or a scene file by its path.
pub(crate) fn prepare(name: &str, policy: FilePolicy) -> anyhow::Result<Stage> {
    prepare_telling(name, policy, &Teller::Bar)
}

/// Finds and prepares the scene called `name`, and reports progress to `teller`.
pub(crate) fn prepare_telling(name: &str, policy: FilePolicy, teller: &Teller<'_>) -> anyhow::Result<Stage> {
    if let Some(scene) = palpus_scenes::scene(name) {
        return of_built_in(&scene, teller);
    }
    let path = Path::new(name);
    if MeshFormat::of_extension(path).is_some() {
        bail!(
            "{name} is a mesh, and a run needs two: name the mesh that it touches too (palpus run PROBE ENVIRONMENT), \
             or start palpus run and press O to open both"
        );
    }
    if path.exists() || path.extension().is_some() {
        let file = read_asking(path, policy)?;
        return of_file(path, file, &|_, body| Ok(bodies::read_mesh(&body.mesh)?), teller);
    }
    bail!("{}, or name a scene file (TOML)", no_scene(name))
}

/// Returns the error text for an unknown scene: a similar name, and all names.
pub(crate) fn no_scene(name: &str) -> String {
    let scenes = palpus_scenes::scenes();
    let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
    let similar = similar_name(name, &names).map_or(String::new(), |similar| format!("did you mean `{similar}`? "));
    format!("there is no scene called `{name}`; {similar}built-in scenes are {}", names.join(", "))
}

/// Prepares a built-in scene.
pub(crate) fn of_built_in(scene: &Scene, teller: &Teller<'_>) -> anyhow::Result<Stage> {
    let contact = &scene.contact;
    let settings = Settings {
        contact_tolerance: contact.tolerance,
        cluster_radius: contact.cluster_radius,
        stiffness: contact.stiffness,
        shading: contact.shading.then(|| ShadingSettings {
            crease_angle: contact.crease,
            most_turn: MOST_SHADING_TURN_DEGREES.to_radians(),
        }),
        friction: contact.friction.map(|friction| FrictionSettings {
            static_coefficient: friction.static_coefficient,
            dynamic_coefficient: friction.dynamic_coefficient,
            // The tangential stiffness equals the normal stiffness.
            tangential_stiffness: contact.stiffness,
        }),
        ..Settings::default()
    };
    let body_settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let [probe, environment] = bodies::prepare_two(
        teller,
        |teller| bodies::prepare_soup_telling("the probe", &scene.probe, &body_settings, teller),
        |teller| bodies::prepare_soup_telling("the environment", &scene.environment, &body_settings, teller),
    )?;
    let body = |part: &str, content, pose| RecordedBody { mesh: format!("{}/{part}", scene.name), content, pose };
    let mut others = Vec::new();
    if let Some(tool) = &scene.second {
        let prepared = bodies::prepare_soup_telling("the second tool", &tool.probe, &body_settings, teller)?;
        others.push(OtherTool {
            probe: Arc::new(prepared.body),
            settings,
            coupling: SceneCoupling::default(),
            path: tool.path.clone(),
            hand: None,
            recorded: body("second", prepared.hash, tool.start),
        });
    }
    let mut shapes: Vec<(*const PolygonSoup, Arc<Body>, ContentHash)> = Vec::new();
    let mut objects = Vec::new();
    let mut recorded_objects = Vec::new();
    for object in &scene.objects {
        let shape = Arc::as_ptr(&object.shape);
        let known = shapes.iter().position(|(other, ..)| *other == shape);
        let at = match known {
            Some(at) => at,
            None => {
                let prepared = bodies::prepare_soup_telling("an object", &object.shape, &body_settings, teller)?;
                shapes.push((shape, Arc::new(prepared.body), prepared.hash));
                shapes.len() - 1
            }
        };
        let (_, shape, hash) = &shapes[at];
        let motion = match object.motion {
            Motion::Fixed => ObjectMotion::Fixed,
            Motion::Driven(twist) => ObjectMotion::Driven(twist),
            Motion::Free(density) => ObjectMotion::FreeOfDensity(density),
        };
        objects.push(StageObject { body: shape.clone(), pose: object.start, motion });
        recorded_objects.push(body(&format!("object-{}", at + 1), *hash, object.start));
    }
    let recorded = RecordedScene {
        source: SceneSource::BuiltIn(scene.name.to_owned()),
        text: None,
        metres_per_unit: 1.0,
        probe: body("probe", probe.hash, scene.start),
        environment: body("environment", environment.hash, Pose::IDENTITY),
        objects: recorded_objects,
        render: settings,
        more: Default::default(),
    };
    Ok(Stage {
        probe: Arc::new(probe.body),
        environment: Arc::new(environment.body),
        environment_pose: Pose::IDENTITY,
        settings,
        coupling: SceneCoupling::default(),
        path: scene.path.clone(),
        to_and_fro: false,
        has_file: true,
        hand: None,
        rate_hz: None,
        recorded,
        notes: Vec::new(),
        others,
        objects,
        gravity: scene.gravity,
    })
}

/// A body of a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// The probe.
    Probe,
    /// The environment.
    Environment,
    /// Another tool: its number after the probe.
    Other(usize),
    /// An object, by its number.
    Object(usize),
}

/// Prepares a scene `file` whose path is `path`; `read` reads its meshes.
pub(crate) fn of_file(
    path: &Path,
    mut file: SceneFile,
    read: &(dyn Fn(Part, &SceneBody) -> anyhow::Result<PolygonSoup> + Sync),
    teller: &Teller<'_>,
) -> anyhow::Result<Stage> {
    let prepared = |part: Part, body: &SceneBody, teller: &Teller<'_>| {
        let settings =
            BodySettings { scale: body.metres_per_unit, flatness: BodySettings::HAPTIC, ..BodySettings::default() };
        bodies::prepare_mesh_telling(&body.mesh, &read(part, body)?, &settings, teller)
    };
    let shared = |prepared: bodies::Prepared| (Arc::new(prepared.body), prepared.hash);
    let [(probe, probe_hash), (environment, environment_hash)] = if is_alike(&file.probe, &file.environment) {
        let both = shared(prepared(Part::Probe, &file.probe, teller)?);
        [both.clone(), both]
    } else {
        let both = bodies::prepare_two(
            teller,
            |teller| prepared(Part::Probe, &file.probe, teller),
            |teller| prepared(Part::Environment, &file.environment, teller),
        )?;
        both.map(shared)
    };
    // Equal meshes share a body.
    let mut known = vec![
        (file.probe.clone(), probe.clone(), probe_hash),
        (file.environment.clone(), environment.clone(), environment_hash),
    ];
    let mut prepare = |part: Part, body: &SceneBody| match known.iter().find(|(other, ..)| is_alike(other, body)) {
        Some((_, shape, hash)) => Ok((shape.clone(), *hash)),
        None => {
            let (shape, hash) = shared(prepared(part, body, teller)?);
            known.push((body.clone(), shape.clone(), hash));
            anyhow::Ok((shape, hash))
        }
    };
    let mut tools = Vec::new();
    for (k, tool) in file.others.iter().enumerate() {
        tools.push(prepare(Part::Other(k), &tool.body)?);
    }
    let mut shapes = Vec::new();
    for (k, object) in file.objects.iter().enumerate() {
        shapes.push(prepare(Part::Object(k), &object.body)?);
    }
    let mut ways = Ways::new(&probe, &environment);
    let more: Vec<Arc<Body>> = tools.iter().chain(&shapes).map(|(body, _)| body.clone()).collect();
    let mut notes = gaps::fill(&mut file, &mut ways, &more);
    let hand = file.hand.preset.name();
    let path_of_hand = intended(&file, &file.hand, &file.probe, &mut ways)?;
    let body = |mesh: &Path, content, pose| RecordedBody { mesh: absolute(mesh), content, pose };
    let mut others: Vec<OtherTool> = Vec::new();
    for (k, (tool, (probe, hash))) in file.others.iter().zip(tools).enumerate() {
        let what = format!("{} tool", tools::name(k + 1));
        let grip_a = tool.grip.or_else(|| gaps::grip(&probe, &what, &mut notes)).unwrap_or_default();
        others.push(OtherTool {
            settings: Settings { grip_a, limits: tool.limits, saturation: tool.saturation, ..file.render },
            coupling: tool.coupling,
            path: intended(&file, &tool.hand, &tool.body, &mut Ways::new(&probe, &environment))?,
            hand: Some(tool.hand.preset.name()),
            recorded: body(&tool.body.mesh, hash, tool.body.pose),
            probe,
        });
    }
    let mut objects: Vec<StageObject> = Vec::new();
    let mut recorded_objects: Vec<RecordedBody> = Vec::new();
    for (object, (shape, hash)) in file.objects.iter().zip(shapes) {
        objects.push(StageObject { body: shape, pose: object.body.pose, motion: object.motion });
        recorded_objects.push(body(&object.body.mesh, hash, object.body.pose));
    }
    let recorded = RecordedScene {
        source: SceneSource::File(absolute(path)),
        text: Some(file.text).filter(|text| text.len() <= MOST_SCENE_TEXT),
        metres_per_unit: file.metres_per_unit,
        probe: body(&file.probe.mesh, probe_hash, file.probe.pose),
        environment: body(&file.environment.mesh, environment_hash, file.environment.pose),
        objects: recorded_objects,
        render: file.render,
        more: Default::default(),
    };
    Ok(Stage {
        probe,
        environment,
        environment_pose: file.environment.pose,
        settings: file.render,
        coupling: file.coupling,
        path: path_of_hand,
        to_and_fro: false,
        has_file: true,
        hand: Some(hand),
        rate_hz: Some(file.rate_hz),
        recorded,
        notes,
        others,
        objects,
        gravity: file.gravity,
    })
}

/// True if both bodies have the same mesh in the same unit.
fn is_alike(one: &SceneBody, other: &SceneBody) -> bool {
    one.mesh == other.mesh && one.metres_per_unit == other.metres_per_unit
}

/// Returns the absolute path, which is valid from any folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

/// Returns the path that the scene file gives a hand.
fn intended(file: &SceneFile, hand: &SceneHand, held: &SceneBody, ways: &mut Ways) -> anyhow::Result<HandPath> {
    let path = match &hand.path {
        Some(poses) => follow(
            poses,
            &Following {
                start: held.pose,
                metres_per_unit: file.metres_per_unit,
                scale: hand.path_scale.unwrap_or(1.0),
                speed: hand.path_speed.unwrap_or(1.0),
                size: ways.probe.size(),
            },
        )?,
        None => {
            let (tolerance, mode) = (file.render.contact_tolerance, file.coupling.mode);
            approach(ways, held.pose, file.environment.pose, tolerance, mode)
        }
    };
    let trembles = hand.tremor > 0.0;
    Ok(if trembles { path.with_tremor(Tremor::new(hand.tremor, u64::from(hand.seed))) } else { path })
}
