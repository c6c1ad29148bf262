//! Creates a world that a loop can step from a scene file.
//!
//! 1. The file is read ([`super::read_scene`]), and each mesh is converted to a body. The body is
//!    prepared with all cores or loaded from the cache. Bodies with the same mesh and unit are
//!    shared.
//! 2. The world receives the environment, the objects in the order of the file, and the tools.
//! 3. The settings of each tool are computed from the limits of its device
//!    ([`super::SceneCoupling::settings`]).
//!
//! For missing keys ([`super::SceneGaps`]), this module uses fixed defaults. The program `palpus`
//! computes these values from the meshes instead: a finer tolerance for small bodies and for
//! close-fitting parts, a free place above the environment, and a grip within the tool. Other
//! programs should set these keys in the file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use palpus::algebra::{Pose, Twist, Workers};
use palpus::body::{Body, BodyError, BodySettings};
use palpus::render::{BodyId, Limits, Object, Settings, SettingsError, ToolId, World};

use super::{FilePolicy, ObjectMotion, SceneBody, SceneError, SceneFile, read_scene};
use crate::cache::{BodyCache, prepared};
use crate::mesh::{MeshFileError, read_mesh};

/// The world of a scene. The frame of the world is the frame of the scene, in metres.
pub struct SceneWorld {
    /// The world, which contains all bodies.
    pub world: World,
    /// The content of the scene file.
    pub file: SceneFile,
    /// The probe, then the other tools in the order of the file.
    pub tools: Vec<ToolId>,
    /// Start pose of each tool's mesh frame in the world (m). The grip of a device starts at
    /// `pose.with_origin(grip_a)`, where `grip_a` is [`Settings::grip_a`] of the tool.
    pub starts: Vec<Pose>,
    /// The environment.
    pub environment: BodyId,
    /// The objects in the order of the file.
    pub objects: Vec<BodyId>,
    driven: Vec<(BodyId, Twist)>,
}

/// Why a scene cannot be opened. The message names the file, the problem and how to fix it.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The scene file is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mesh file is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// The mesh does not form a valid body.
    #[error("{} cannot be prepared", .file.display())]
    Body {
        /// The mesh file.
        file: PathBuf,
        /// The defect of the body.
        source: BodyError,
    },
    /// The settings computed from the scene and the device's limits are invalid.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

impl SceneWorld {
    /// Opens the scene file at `path` for devices with the limits `device` (N, N·m) and a loop with
    /// the rate of the scene. Prepared bodies are stored in `cache` and loaded from it.
    ///
    /// # Errors
    /// Fails if a file cannot be read, a mesh cannot be prepared, or a setting is out of range.
    pub fn open(
        path: &Path,
        policy: FilePolicy,
        device: &Limits,
        cache: Option<&BodyCache>,
        workers: &dyn Workers,
    ) -> Result<Self, OpenError> {
        let file = read_scene(path, policy)?;
        let mut meshes = Meshes { known: Vec::new(), cache, workers };
        let settings = |limits: &Limits, coupling: &super::SceneCoupling, of: Settings| {
            let limits = Limits { force: limits.force.min(device.force), torque: limits.torque.min(device.torque) };
            coupling.settings(&Settings { limits, ..of }, 1.0 / file.rate_hz)
        };
        let of_probe = settings(&file.render.limits, &file.coupling, file.render);

        let mut world = World::new(of_probe)?;
        world.set_gravity(file.gravity);
        let environment = world.add(Object::fixed(meshes.body(&file.environment)?, file.environment.pose))?;
        let (mut objects, mut driven) = (Vec::new(), Vec::new());
        for object in &file.objects {
            let (body, pose) = (meshes.body(&object.body)?, object.body.pose);
            let id = world.add(object.motion.object(body, pose))?;
            if let ObjectMotion::Driven(velocity) = object.motion {
                driven.push((id, velocity));
            }
            objects.push(id);
        }
        let mut tools = vec![world.add_tool(meshes.body(&file.probe)?, of_probe)?];
        let mut starts = vec![file.probe.pose];
        for tool in &file.others {
            let grip_a = tool.grip.unwrap_or_default();
            let of = Settings { grip_a, saturation: tool.saturation, ..file.render };
            tools.push(world.add_tool(meshes.body(&tool.body)?, settings(&tool.limits, &tool.coupling, of))?);
            starts.push(tool.body.pose);
        }
        Ok(Self { world, file, tools, starts, environment, objects, driven })
    }

    /// Sets the velocities of the driven objects from the scene file. Call this function before
    /// each step, or at least ten times a second; otherwise driven objects stop.
    pub fn drive(&mut self) {
        for &(body, velocity) in &self.driven {
            let pose = self.world.pose(body);
            self.world.drive(body, pose, velocity);
        }
    }
}

/// Bodies by mesh and unit.
struct Meshes<'a> {
    known: Vec<(SceneBody, Arc<Body>)>,
    cache: Option<&'a BodyCache>,
    workers: &'a dyn Workers,
}

impl Meshes<'_> {
    fn body(&mut self, wanted: &SceneBody) -> Result<Arc<Body>, OpenError> {
        let alike =
            |(other, _): &&(SceneBody, _)| other.mesh == wanted.mesh && other.metres_per_unit == wanted.metres_per_unit;
        if let Some((_, body)) = self.known.iter().find(alike) {
            return Ok(body.clone());
        }
        let settings =
            BodySettings { scale: wanted.metres_per_unit, flatness: BodySettings::HAPTIC, ..BodySettings::default() };
        let soup = read_mesh(&wanted.mesh)?;
        let body = prepared(&soup, &settings, self.cache, self.workers, &mut |_| ())
            .map_err(|source| OpenError::Body { file: wanted.mesh.clone(), source })?;
        let body = Arc::new(body);
        self.known.push((wanted.clone(), body.clone()));
        Ok(body)
    }
}
