//! A scene, built-in or from a file, made ready to run: bodies prepared, settings in SI, a hand that knows where to go.

use std::path::Path;
use std::sync::Arc;

use anyhow::bail;
use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Limits, ProbeState, Saturation, Settings, VirtualCoupling};
use palpus_device::{DeviceSpec, HandImpedance, hand_preset};
use palpus_io::record::{FORMAT, MOST_SCENE_TEXT, RecordedBody, RecordedScene, SceneSource};
use palpus_io::scene::{
    CouplingMode, FilePolicy, ObjectMotion, SceneBody, SceneCoupling, SceneFile, SceneHand, SceneObject, SceneTool,
    read_scene,
};
use palpus_io::{ContentHash, RecordingHeader, read_mesh};
use palpus_scenes::{HandPath, Motion, Scene, Tremor};

use crate::approach::approach;
use crate::bodies::{self, Teller};
use crate::hand_path::{Following, follow};
use crate::{gaps, tools};

/// Everything that a run needs.
pub(crate) struct Stage {
    /// Body a.
    pub(crate) probe: Arc<Body>,
    /// Body b.
    pub(crate) environment: Arc<Body>,
    /// Of b in the world, which is also the device's frame.
    pub(crate) environment_pose: Pose,
    /// Of the engine, for direct rendering without a device's limits; see [`Stage::settings_for`].
    pub(crate) settings: Settings,
    /// What the scene says of the coupling.
    pub(crate) coupling: SceneCoupling,
    /// Where the simulated hand intends the probe (the frame of its mesh), in the world. The hand
    /// itself holds the grip: see [`Stage::intent`].
    pub(crate) path: HandPath,
    /// The hand that the scene asks for, if it does.
    pub(crate) hand: Option<&'static str>,
    /// Ticks per second that the scene asks for, if it does.
    pub(crate) rate_hz: Option<f64>,
    /// What a recording says of the scene.
    pub(crate) recorded: RecordedScene,
    /// What was chosen where the scene's file says nothing.
    pub(crate) notes: Vec<String>,
    /// What other hands hold.
    pub(crate) others: Vec<OtherTool>,
    /// What nobody holds, beside the environment.
    pub(crate) objects: Vec<StageObject>,
    /// m/s², along the world's axes.
    pub(crate) gravity: DVec3,
}

/// A body that nobody holds.
#[derive(Clone)]
pub(crate) struct StageObject {
    pub(crate) body: Arc<Body>,
    /// In the world, at the start.
    pub(crate) pose: Pose,
    pub(crate) motion: ObjectMotion,
}

/// A tool beside the probe, and its hand.
pub(crate) struct OtherTool {
    probe: Arc<Body>,
    settings: Settings,
    coupling: SceneCoupling,
    path: HandPath,
    hand: Option<&'static str>,
    recorded: RecordedBody,
}

impl Stage {
    /// The engine's settings on this device, at this many ticks per second: within the tighter of both limits, and with the
    /// coupling that the scene asks for; what it leaves open comes from the device.
    pub(crate) fn settings_for(&self, spec: &DeviceSpec, rate_hz: f64) -> Settings {
        self.settings_in(self.coupling.mode, spec, rate_hz)
    }

    /// The same, coupled or direct whatever the scene says.
    pub(crate) fn settings_in(&self, mode: CouplingMode, spec: &DeviceSpec, rate_hz: f64) -> Settings {
        let limits = Limits {
            force: self.settings.limits.force.min(spec.force_max),
            torque: self.settings.limits.torque.min(spec.torque_max),
        };
        let mut settings = Settings { limits, ..self.settings };
        if limits.torque <= 0.0 {
            // A torque that nobody can feel is shown, and not missed every tick.
            settings.saturation = Saturation::UnderActuated;
        }
        if mode == CouplingMode::Direct {
            return settings;
        }
        let SceneCoupling { stiffness, damping, angular_stiffness, angular_damping, skin, mass, .. } = self.coupling;
        let tuned = VirtualCoupling::tuned(&limits, 1.0 / rate_hz, settings.contact_tolerance);
        settings.coupling = Some(VirtualCoupling {
            stiffness: stiffness.unwrap_or(tuned.stiffness),
            damping: damping.unwrap_or(tuned.damping),
            angular_stiffness: angular_stiffness.unwrap_or(tuned.angular_stiffness),
            angular_damping: angular_damping.unwrap_or(tuned.angular_damping),
            skin: skin.unwrap_or(tuned.skin).min(settings.contact_tolerance),
            mass: mass.unwrap_or(tuned.mass),
        });
        let of_device = VirtualCoupling::contact_stiffness(&limits, settings.contact_tolerance);
        settings.stiffness = self.coupling.contact_stiffness.or(of_device).unwrap_or(settings.stiffness);
        if let Some(friction) = &mut settings.friction {
            friction.tangential_stiffness = self.coupling.friction_stiffness.unwrap_or(settings.stiffness);
        }
        settings
    }

    /// Ticks per second: what was typed, or what the scene asks for.
    pub(crate) fn rate_hz(&self, typed: Option<f64>) -> f64 {
        typed.or(self.rate_hz).unwrap_or(DEFAULT_RATE_HZ)
    }

    /// The name of the simulated hand: what was typed, or what the scene asks for.
    pub(crate) fn hand_name<'a>(&self, typed: Option<&'a str>) -> &'a str {
        typed.or(self.hand).unwrap_or("normal")
    }

    /// The simulated hand.
    pub(crate) fn hand(&self, typed: Option<&str>) -> anyhow::Result<HandImpedance> {
        let name = self.hand_name(typed);
        match hand_preset(name) {
            Some(hand) => Ok(hand),
            None => bail!("there is no hand `{name}`; hands are relaxed, normal, firm, tight and none"),
        }
    }

    /// Returns the pose of the grip, world, when the probe has this pose: what a device reports.
    pub(crate) fn grip(&self, probe: Pose) -> Pose {
        probe.with_origin(self.settings.grip_a)
    }

    /// Returns what the simulated hand intends: the grip's pose, world, by the time in seconds, so
    /// that the probe follows [`Stage::path`].
    pub(crate) fn intent(&self) -> impl Fn(f64) -> Pose + Send + use<> {
        let (path, grip_a) = (self.path.clone(), self.settings.grip_a);
        move |time| path.pose(time).with_origin(grip_a)
    }

    /// Returns the probe's state at `time` (s) on the path, world.
    pub(crate) fn scripted(&self, time: f64) -> ProbeState {
        scripted(&self.path, self.settings.grip_a, time)
    }

    /// What a recording says of a run of it on the device that is called so; safety chain and device add to it.
    pub(crate) fn header(&self, settings: Settings, device: &str, rate_hz: f64) -> RecordingHeader {
        RecordingHeader {
            format: FORMAT,
            start_utc: None,
            palpus_version: env!("CARGO_PKG_VERSION").to_owned(),
            device: device.to_owned(),
            rate_hz,
            seed: 0,
            scene: RecordedScene { render: settings, ..self.recorded.clone() },
        }
    }

    /// What all hands hold, the probe first, and where each begins (world).
    pub(crate) fn tools(&self) -> impl Iterator<Item = (&Arc<Body>, Pose)> {
        let others = self.others.iter().map(|tool| (&tool.probe, tool.path.pose(0.0)));
        std::iter::once((&self.probe, self.path.pose(0.0))).chain(others)
    }

    /// The same scene for each of the other hands: with its tool in the place of the probe, and no other tools.
    pub(crate) fn of_others(&self) -> impl Iterator<Item = Self> {
        self.others.iter().map(|OtherTool { probe, settings, coupling, path, hand, recorded }| Self {
            probe: probe.clone(),
            environment: self.environment.clone(),
            environment_pose: self.environment_pose,
            settings: *settings,
            coupling: *coupling,
            path: path.clone(),
            hand: *hand,
            rate_hz: self.rate_hz,
            recorded: RecordedScene { probe: recorded.clone(), ..self.recorded.clone() },
            // Told of with the first.
            notes: Vec::new(),
            others: Vec::new(),
            objects: self.objects.clone(),
            gravity: self.gravity,
        })
    }

    /// Has the simulated hand follow a file from now on, from where the scene begins.
    pub(crate) fn follow(&mut self, file: &Path, scale: f64, speed: f64) -> anyhow::Result<()> {
        let metres_per_unit = self.recorded.metres_per_unit;
        let (start, size) = (self.path.pose(0.0), self.probe.size());
        self.path = follow(file, &Following { start, metres_per_unit, scale, speed, size })?;
        Ok(())
    }

    /// rad: edges sharper than this stay sharp when shading is on, the scene's own or what is usual.
    pub(crate) fn crease_angle(&self) -> f64 {
        self.settings.shading.map_or(USUAL_CREASE_DEGREES.to_radians(), |shading| shading.crease_angle)
    }
}

/// Returns the state at `time` (s) on `path` (world) of a probe that is held at `grip_a` (in its frame).
pub(crate) fn scripted(path: &HandPath, grip_a: DVec3, time: f64) -> ProbeState {
    let (pose_ba, Twist { angular, linear }) = (path.pose(time), path.twist(time));
    let to_grip = pose_ba.vector(grip_a);
    ProbeState { pose_ba, twist: Twist { angular, linear: linear + angular.cross(to_grip) } }
}

/// Ticks per second when nobody says.
const DEFAULT_RATE_HZ: f64 = 1000.0;

/// As scene files have it that do not say.
const USUAL_CREASE_DEGREES: f64 = 40.0;

/// Force shading turns a direction by no more than this, so that it cannot push into the surface.
const MOST_SHADING_TURN_DEGREES: f64 = 45.0;

/// Finds and prepares the scene called `name`: a built-in one, or a scene file by path.
pub(crate) fn prepare(name: &str, policy: FilePolicy) -> anyhow::Result<Stage> {
    prepare_telling(name, policy, &Teller::Bar)
}

/// The same, saying how far it has come as `teller` does.
pub(crate) fn prepare_telling(name: &str, policy: FilePolicy, teller: &Teller<'_>) -> anyhow::Result<Stage> {
    if let Some(scene) = palpus_scenes::scene(name) {
        return of_built_in(&scene, teller);
    }
    let path = Path::new(name);
    if path.exists() || path.extension().is_some() {
        let file = read_scene(path, policy)?;
        return of_file(path, file, &|_, body| Ok(read_mesh(&body.mesh)?), teller);
    }
    let names: Vec<&str> = palpus_scenes::scenes().iter().map(|scene| scene.name).collect();
    bail!("there is no scene called `{name}`; built-in scenes are {}, or name a scene file (TOML)", names.join(", "))
}

/// Prepares a scene that code has made.
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
            // As stiff sideways as into the surface.
            tangential_stiffness: contact.stiffness,
        }),
        ..Settings::default()
    };
    let body_settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let probe = bodies::prepare_soup_telling("the probe", &scene.probe, &body_settings, teller)?;
    let environment = bodies::prepare_soup_telling("the environment", &scene.environment, &body_settings, teller)?;
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
    /// What the first hand holds.
    Probe,
    /// What is touched.
    Environment,
    /// What another hand holds: the tool of this number beside the probe.
    Other(usize),
    /// What nobody holds: the object of this number.
    Object(usize),
}

/// Prepares a scene `file` that lies at `path`; `read` reads its meshes.
pub(crate) fn of_file(
    path: &Path,
    mut file: SceneFile,
    read: &dyn Fn(Part, &SceneBody) -> anyhow::Result<PolygonSoup>,
    teller: &Teller<'_>,
) -> anyhow::Result<Stage> {
    let prepare = |part: Part, body: &SceneBody| -> anyhow::Result<(Arc<Body>, ContentHash)> {
        let settings =
            BodySettings { scale: body.metres_per_unit, flatness: BodySettings::HAPTIC, ..BodySettings::default() };
        let prepared = bodies::prepare_mesh_telling(&body.mesh, &read(part, body)?, &settings, teller)?;
        Ok((Arc::new(prepared.body), prepared.hash))
    };
    let (probe, probe_hash) = prepare(Part::Probe, &file.probe)?;
    let (environment, environment_hash) = prepare(Part::Environment, &file.environment)?;
    let mut notes = gaps::fill(&mut file, &probe, &environment);
    let hand = file.hand.preset.name();
    let path_of_hand = intended(&file, &file.hand, &file.probe, &probe, &environment)?;
    let body = |mesh: &Path, content, pose| RecordedBody { mesh: absolute(mesh), content, pose };
    let mut others: Vec<OtherTool> = Vec::new();
    for (k, tool) in file.others.iter().enumerate() {
        // Tools that are alike share their body.
        let alike = |other: &SceneTool| {
            other.body.mesh == tool.body.mesh && other.body.metres_per_unit == tool.body.metres_per_unit
        };
        let (probe, hash) = match file.others[..k].iter().position(alike) {
            Some(other) => (others[other].probe.clone(), others[other].recorded.content),
            None => prepare(Part::Other(k), &tool.body)?,
        };
        let grip_a = tool.grip.or_else(|| gaps::grip(&probe, &tools::name(k + 1), &mut notes)).unwrap_or_default();
        others.push(OtherTool {
            settings: Settings { grip_a, limits: tool.limits, saturation: tool.saturation, ..file.render },
            coupling: tool.coupling,
            path: intended(&file, &tool.hand, &tool.body, &probe, &environment)?,
            hand: Some(tool.hand.preset.name()),
            recorded: body(&tool.body.mesh, hash, tool.body.pose),
            probe,
        });
    }
    let mut objects: Vec<StageObject> = Vec::new();
    let mut recorded_objects: Vec<RecordedBody> = Vec::new();
    for (k, object) in file.objects.iter().enumerate() {
        // Objects that are alike share their body.
        let alike = |other: &SceneObject| {
            other.body.mesh == object.body.mesh && other.body.metres_per_unit == object.body.metres_per_unit
        };
        let (shape, hash) = match file.objects[..k].iter().position(alike) {
            Some(other) => (objects[other].body.clone(), recorded_objects[other].content),
            None => prepare(Part::Object(k), &object.body)?,
        };
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
        hand: Some(hand),
        rate_hz: Some(file.rate_hz),
        recorded,
        notes,
        others,
        objects,
        gravity: file.gravity,
    })
}

/// So that it can be found from any folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

/// Where the scene's file says that a hand moves a body which it holds.
fn intended(
    file: &SceneFile,
    hand: &SceneHand,
    held: &SceneBody,
    probe: &Arc<Body>,
    environment: &Arc<Body>,
) -> anyhow::Result<HandPath> {
    let path = match &hand.path {
        Some(poses) => follow(
            poses,
            &Following {
                start: held.pose,
                metres_per_unit: file.metres_per_unit,
                scale: hand.path_scale.unwrap_or(1.0),
                speed: hand.path_speed.unwrap_or(1.0),
                size: probe.size(),
            },
        )?,
        None => approach(probe, environment, held.pose, file.environment.pose, file.render.contact_tolerance),
    };
    let trembles = hand.tremor > 0.0;
    Ok(if trembles { path.with_tremor(Tremor::new(hand.tremor, u64::from(hand.seed))) } else { path })
}

/// The content of the meshes of a recorded scene as they are now, to refuse a replay on others.
pub(crate) fn check_content(stage: &Stage, recorded: &RecordedScene) -> anyhow::Result<()> {
    if stage.recorded.objects.len() != recorded.objects.len() {
        let (now, then) = (stage.recorded.objects.len(), recorded.objects.len());
        bail!("the scene has {now} objects and the recording {then}; replay needs the same scene");
    }
    let objects = stage.recorded.objects.iter().zip(&recorded.objects);
    let held = [(&stage.recorded.probe, &recorded.probe), (&stage.recorded.environment, &recorded.environment)];
    for (now, then) in held.into_iter().chain(objects) {
        if now.content != then.content {
            bail!(
                "{} is not the mesh of the recording (its content hash is {}, recorded was {}); replay needs the same mesh",
                now.mesh,
                now.content,
                then.content
            );
        }
    }
    Ok(())
}
