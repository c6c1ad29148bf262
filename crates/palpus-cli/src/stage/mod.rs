//! A prepared scene, built-in or from a file: bodies, settings in SI units, and a simulated hand
//! with its path.

mod outside;
mod pair;
mod prepare;

use std::path::Path;
use std::sync::Arc;

use anyhow::bail;
use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::Body;
use palpus::render::{Limits, ProbeState, Settings};
use palpus_device::{DeviceSpec, HandImpedance, hand_preset};
use palpus_io::RecordingHeader;
use palpus_io::record::{FORMAT, RecordedBody, RecordedScene};
use palpus_io::scene::{CouplingMode, ObjectMotion, SceneCoupling};
use palpus_scenes::HandPath;

use crate::hand_path::{Following, follow};

#[cfg(feature = "window")]
pub(crate) use pair::of_pair_again;
pub(crate) use pair::{of_pair, pair_name};
#[cfg(feature = "window")]
pub(crate) use prepare::prepare_telling;
pub(crate) use prepare::{Part, no_scene, of_built_in, of_file, prepare};

/// Everything that a run needs.
#[derive(Clone)]
pub(crate) struct Stage {
    /// Body a.
    pub(crate) probe: Arc<Body>,
    /// Body b.
    pub(crate) environment: Arc<Body>,
    /// Pose of b in the world, which is also the device's frame.
    pub(crate) environment_pose: Pose,
    /// Settings of the engine for direct rendering without a device's limits; see
    /// [`Stage::settings_for`].
    pub(crate) settings: Settings,
    /// Coupling of the scene.
    pub(crate) coupling: SceneCoupling,
    /// The intended motion of the probe (the frame of its mesh), in the world. The hand itself
    /// holds the grip: see [`Stage::intent`].
    pub(crate) path: HandPath,
    /// True if the path is followed to its end, back to its start, and so on.
    pub(crate) to_and_fro: bool,
    /// False for a scene of two meshes from the command line: only its text is recorded.
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only a window starts a scene again"))]
    pub(crate) has_file: bool,
    /// Name of the scene's hand, if the scene states a hand.
    pub(crate) hand: Option<&'static str>,
    /// The scene's ticks per second, if the scene states them.
    pub(crate) rate_hz: Option<f64>,
    /// Description of the scene in a recording.
    pub(crate) recorded: RecordedScene,
    /// Notes on values that the scene file leaves out.
    pub(crate) notes: Vec<String>,
    /// Tools other than the probe.
    pub(crate) others: Vec<OtherTool>,
    /// Objects other than the environment.
    pub(crate) objects: Vec<StageObject>,
    /// Gravity along the world's axes, m/s².
    pub(crate) gravity: DVec3,
}

/// An object.
#[derive(Clone)]
pub(crate) struct StageObject {
    pub(crate) body: Arc<Body>,
    /// Pose at the start, world.
    pub(crate) pose: Pose,
    pub(crate) motion: ObjectMotion,
}

/// A tool other than the probe, and its hand.
#[derive(Clone)]
pub(crate) struct OtherTool {
    probe: Arc<Body>,
    settings: Settings,
    coupling: SceneCoupling,
    path: HandPath,
    hand: Option<&'static str>,
    recorded: RecordedBody,
}

impl Stage {
    /// Returns the engine's settings on this device at `rate_hz` ticks per second: within the
    /// limits of the scene and the device, and with the scene's coupling. Missing values are
    /// computed from the device.
    pub(crate) fn settings_for(&self, spec: &DeviceSpec, rate_hz: f64) -> Settings {
        self.settings_in(self.coupling.mode, spec, rate_hz)
    }

    /// Returns the engine's settings, coupled or direct, whatever mode the scene states.
    pub(crate) fn settings_in(&self, mode: CouplingMode, spec: &DeviceSpec, rate_hz: f64) -> Settings {
        let limits = Limits {
            force: self.settings.limits.force.min(spec.force_max),
            torque: self.settings.limits.torque.min(spec.torque_max),
        };
        let coupling = SceneCoupling { mode, ..self.coupling };
        coupling.settings(&Settings { limits, ..self.settings }, 1.0 / rate_hz)
    }

    /// Returns the text of a scene that has no file.
    #[cfg(feature = "window")]
    pub(crate) fn text_without_file(&self) -> Option<&str> {
        self.recorded.text.as_deref().filter(|_| !self.has_file)
    }

    /// Returns the ticks per second: the user's value, or the scene's.
    pub(crate) fn rate_hz(&self, typed: Option<f64>) -> f64 {
        typed.or(self.rate_hz).unwrap_or(DEFAULT_RATE_HZ)
    }

    /// Returns the name of the simulated hand: the user's, or the scene's.
    pub(crate) fn hand_name<'a>(&self, typed: Option<&'a str>) -> &'a str {
        typed.or(self.hand).unwrap_or("normal")
    }

    /// Returns the simulated hand.
    pub(crate) fn hand(&self, typed: Option<&str>) -> anyhow::Result<HandImpedance> {
        let name = self.hand_name(typed);
        match hand_preset(name) {
            Some(hand) => Ok(hand),
            None => bail!("there is no hand `{name}`; hands are relaxed, normal, firm, tight and none"),
        }
    }

    /// Returns the grip's pose (world) when the probe has this pose. A device reports the pose of
    /// its grip.
    pub(crate) fn grip(&self, probe: Pose) -> Pose {
        probe.with_origin(self.settings.grip_a)
    }

    /// Returns the intent of the simulated hand, the grip's pose (world) as a function of the time
    /// in seconds, with which the probe follows [`Stage::path`].
    pub(crate) fn intent(&self) -> impl Fn(f64) -> Pose + Send + use<> {
        let (path, grip_a) = (self.path.clone(), self.settings.grip_a);
        let again = self.to_and_fro && !path.is_cyclic();
        move |time| path.pose(if again { to_and_fro(time, path.duration()) } else { time }).with_origin(grip_a)
    }

    /// Returns the probe's state at `time` (s) on the path, world.
    pub(crate) fn scripted(&self, time: f64) -> ProbeState {
        scripted(&self.path, self.settings.grip_a, time)
    }

    /// Returns the header for a recording of a run on the device with this name. The safety chain
    /// and the device add their parts to it.
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

    /// Returns all tools, the probe first, with their start poses (world).
    pub(crate) fn tools(&self) -> impl Iterator<Item = (&Arc<Body>, Pose)> {
        let others = self.others.iter().map(|tool| (&tool.probe, tool.path.pose(0.0)));
        std::iter::once((&self.probe, self.path.pose(0.0))).chain(others)
    }

    /// Returns the same scene for each of the other hands: with its tool as the probe, and without
    /// other tools.
    pub(crate) fn of_others(&self) -> impl Iterator<Item = Self> {
        self.others.iter().map(|OtherTool { probe, settings, coupling, path, hand, recorded }| Self {
            probe: probe.clone(),
            settings: *settings,
            coupling: *coupling,
            path: path.clone(),
            hand: *hand,
            recorded: RecordedScene { probe: recorded.clone(), ..self.recorded.clone() },
            // The notes belong to the first hand.
            notes: Vec::new(),
            others: Vec::new(),
            ..self.clone()
        })
    }

    /// Lets the simulated hand follow a file from now on, from the start pose of the scene.
    pub(crate) fn follow(&mut self, file: &Path, scale: f64, speed: f64) -> anyhow::Result<()> {
        let metres_per_unit = self.recorded.metres_per_unit;
        let (start, size) = (self.path.pose(0.0), self.probe.size());
        self.path = follow(file, &Following { start, metres_per_unit, scale, speed, size })?;
        Ok(())
    }

    /// Returns the crease angle of shading, rad: the scene's own, or the default. Sharper edges
    /// stay sharp.
    pub(crate) fn crease_angle(&self) -> f64 {
        self.settings.shading.map_or(USUAL_CREASE_DEGREES.to_radians(), |shading| shading.crease_angle)
    }
}

/// Returns the time (s) on a path of this duration that is followed to its end, back to its start,
/// and so on.
fn to_and_fro(time: f64, duration: f64) -> f64 {
    let lap = time.rem_euclid(2.0 * duration);
    lap.min(2.0 * duration - lap)
}

/// Returns the state at `time` (s) on `path` (world) of a probe that is held at `grip_a` (in the
/// probe's frame).
pub(crate) fn scripted(path: &HandPath, grip_a: DVec3, time: f64) -> ProbeState {
    let (pose_ba, Twist { angular, linear }) = (path.pose(time), path.twist(time));
    let to_grip = pose_ba.vector(grip_a);
    ProbeState { pose_ba, twist: Twist { angular, linear: linear + angular.cross(to_grip) } }
}

/// Default rate, ticks per second.
const DEFAULT_RATE_HZ: f64 = 1000.0;

/// Default crease angle of scene files, degrees.
const USUAL_CREASE_DEGREES: f64 = 40.0;

/// Fails if the content of a mesh differs from the recorded content, because a replay needs the
/// same meshes.
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
