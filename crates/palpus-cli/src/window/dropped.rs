//! A mesh that was dropped on the window: a scene of it and of one of the two bodies that are
//! there.
//!
//! The scene is a folder of its own beside the recordings: both meshes and a scene file. So it is
//! prepared, recorded, replayed and edited like any other.
//!
//! 1. The dropped mesh is read and moved so that the middle of its box is its origin: meshes out of
//!    CAD lie anywhere, and the hand holds a probe at its origin.
//! 2. The other body is written as it was read, so that it is not prepared again.
//! 3. The probe starts above the environment, at a distance from it; without a path of its own, the
//!    hand feels its way from there.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::PolygonSoup;
use palpus::render::Settings;
use palpus_io::record::SceneSource;
use palpus_io::scene::FilePolicy;
use palpus_io::{read_scene, write_obj_groups};
use palpus_window::{FileKind, Part};

use crate::stage::Stage;
use crate::{bodies, files, gaps};

/// Parts of the current run that the next one keeps.
pub(super) struct Present {
    source: SceneSource,
    /// Start pose of the probe and pose of the environment, in the world.
    probe: Pose,
    environment: Pose,
    settings: Settings,
}

/// Polygons, and m of their unit.
struct Shape {
    soup: PolygonSoup,
    metres_per_unit: f64,
}

/// Finds out what kind of file is about to be loaded.
pub(super) fn kind(path: &Path) -> Result<FileKind, String> {
    if is_scene(path) {
        // Files elsewhere are asked for when the scene is loaded.
        return read_scene(path, FilePolicy::Anywhere).map(|_| FileKind::Scene).map_err(|error| error.to_string());
    }
    let soup = bodies::read_mesh(path).map_err(|error| error.to_string())?;
    let [low, high] = bounds(soup.vertices.iter().copied()).ok_or("there is nothing in it")?;
    let triangles = (0..soup.face_count()).map(|face| soup.face(face).len().saturating_sub(2)).sum();
    Ok(FileKind::Mesh { size: high - low, triangles })
}

fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

impl Present {
    pub(super) fn of(stage: &Stage) -> Self {
        Self {
            source: stage.recorded.source.clone(),
            probe: stage.path.pose(0.0),
            environment: stage.environment_pose,
            settings: stage.settings,
        }
    }

    /// Makes a scene in which the mesh `file` is `part`, in a new folder below `folder`; answers
    /// its scene file.
    pub(super) fn with(&self, file: &Path, part: Part, metres_per_unit: f64, folder: &Path) -> anyhow::Result<PathBuf> {
        if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
            bail!("{metres_per_unit} m is no unit");
        }
        let mut soup = bodies::read_mesh(file)?;
        let [low, high] = bounds(soup.vertices.iter().copied()).context("there is nothing in it")?;
        soup.vertices.iter_mut().for_each(|vertex| *vertex -= 0.5 * (low + high));
        let dropped = Shape { soup, metres_per_unit };
        let (probe, environment, standing) = match part {
            Part::Probe => (dropped, self.other(Part::Environment)?, self.environment),
            Part::Environment => (self.other(Part::Probe)?, dropped, Pose::IDENTITY),
        };
        let rotation = if part == Part::Probe { glam::DQuat::IDENTITY } else { self.probe.rotation };
        let start = Pose { rotation, translation: above(&probe, &environment, &standing) };
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = files::free(&folder.join(name));
        let problem = || format!("{} could not be made", folder.display());
        fs::create_dir_all(&folder).with_context(problem)?;
        probe.write(&folder.join("probe.obj")).with_context(problem)?;
        environment.write(&folder.join("environment.obj")).with_context(problem)?;
        let scene = folder.join("scene.toml");
        let units = [probe.metres_per_unit, environment.metres_per_unit];
        fs::write(&scene, text(file, units, [start, standing], &self.settings)).with_context(problem)?;
        Ok(scene)
    }

    /// The body that stays, as it was read.
    fn other(&self, part: Part) -> anyhow::Result<Shape> {
        match &self.source {
            SceneSource::BuiltIn(name) => {
                let scene = palpus_scenes::scene(name).ok_or_else(|| anyhow!("there is no scene {name}"))?;
                let soup = if part == Part::Probe { scene.probe } else { scene.environment };
                Ok(Shape { soup, metres_per_unit: 1.0 })
            }
            SceneSource::File(path) => {
                let scene = read_scene(Path::new(path), FilePolicy::Anywhere)?;
                let body = if part == Part::Probe { scene.probe } else { scene.environment };
                Ok(Shape { soup: bodies::read_mesh(&body.mesh)?, metres_per_unit: body.metres_per_unit })
            }
        }
    }
}

impl Shape {
    fn write(&self, path: &Path) -> std::io::Result<()> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        write_obj_groups(BufWriter::new(File::create(path)?), [(name, self.soup.clone())])
    }

    fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.soup.vertices.iter().map(|vertex| *vertex * self.metres_per_unit)
    }
}

/// A pose in which the probe is clear of the environment in any orientation.
fn above(probe: &Shape, environment: &Shape, standing: &Pose) -> DVec3 {
    let reach = probe.points().map(DVec3::length).fold(0.0, f64::max);
    let box_of = bounds(environment.points().map(|point| standing.point(point)));
    gaps::clear_above(box_of.unwrap_or([DVec3::ZERO; 2]), reach)
}

fn bounds(points: impl Iterator<Item = DVec3>) -> Option<[DVec3; 2]> {
    points.map(|point| [point; 2]).reduce(|[low, high], [point, _]| [low.min(point), high.max(point)])
}

fn text(file: &Path, units: [f64; 2], poses: [Pose; 2], settings: &Settings) -> String {
    // One line, whatever a file is called.
    let name: String = file.to_string_lossy().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let body = |part: &str, unit: f64, pose: &Pose| {
        let ([x, y, z], q) = (pose.translation.to_array(), pose.rotation.normalize());
        format!(
            "[{part}]\nmesh = \"{part}.obj\"\nunit = {unit:?}\nposition = [{x:?}, {y:?}, {z:?}]\norientation = [{:?}, {:?}, {:?}, {:?}]\n\n",
            q.x, q.y, q.z, q.w
        )
    };
    let friction = settings.friction.map_or(String::new(), |friction| {
        let (at_rest, sliding) = (friction.static_coefficient, friction.dynamic_coefficient);
        format!("friction = {{ static = {at_rest:?}, dynamic = {sliding:?} }}\n")
    });
    format!(
        "# Made when {name} was dropped on the window.\nunit = \"m\"\n\n{}{}[contact]\ntolerance = {:?}\ncluster_radius = {:?}\n{friction}shading = {}\n",
        body("probe", units[0], &poses[0]),
        body("environment", units[1], &poses[1]),
        settings.contact_tolerance,
        settings.cluster_radius,
        settings.shading.is_some(),
    )
}

#[cfg(test)]
mod tests {
    use palpus_scenes::scene;

    use super::*;
    use crate::stage;

    #[test]
    fn a_dropped_mesh_and_a_body_that_stays_are_a_scene() {
        bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-dropped-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a temporary folder");
        // A cube of 20 mm, far from its origin.
        let mut cube = String::new();
        for k in 0..8u32 {
            let side = |bit: u32| 500.0 + 20.0 * f64::from(k >> bit & 1);
            cube += &format!("v {} {} {}\n", side(0), side(1), side(2));
        }
        cube += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        let file = folder.join("a cube.obj");
        fs::write(&file, cube).expect("a file");
        assert_eq!(kind(&file), Ok(FileKind::Mesh { size: DVec3::splat(20.0), triangles: 12 }));

        let before = stage::prepare("pen-sphere", FilePolicy::Inside).expect("a built-in scene");
        let present = Present::of(&before);
        for part in [Part::Probe, Part::Environment] {
            let scene_file = present.with(&file, part, 1e-3, &folder).expect("a scene");
            assert_eq!(kind(&scene_file), Ok(FileKind::Scene));
            let stage =
                stage::prepare(&scene_file.display().to_string(), FilePolicy::Inside).expect("it can be prepared");
            let (new, kept, kept_before) = match part {
                Part::Probe => (&stage.probe, &stage.recorded.environment, &before.recorded.environment),
                Part::Environment => (&stage.environment, &stage.recorded.probe, &before.recorded.probe),
            };
            assert!((new.mass().volume - 8e-6).abs() < 1e-12 && new.mass().center_of_mass.length() < 1e-9);
            assert_eq!(kept.content, kept_before.content, "what stays is the same mesh");
            let settings = stage.settings_for(&palpus_device::SimulationSettings::default().spec, 1000.0);
            let mut engine = palpus::render::Renderer::new(stage.probe.clone(), stage.environment.clone(), settings)
                .expect("it can be felt");
            let start = stage.environment_pose.inverse() * stage.path.pose(0.0);
            let state = palpus::render::ProbeState::at(start);
            let tick = engine.step(&state, 1e-3, &palpus::algebra::NoClock);
            assert!(tick.contacts.is_empty(), "it starts clear of the other");
        }
        assert!(folder.join("a cube").is_dir() && folder.join("a cube-2").is_dir(), "nothing is overwritten");
        let nothing = folder.join("nothing.obj");
        assert!(kind(&nothing).expect_err("it is not there").contains("nothing.obj"));
        assert!(present.with(&file, Part::Probe, 0.0, &folder).is_err());
        assert!(scene("pen-sphere").is_some());
        let _ = fs::remove_dir_all(&folder);
    }
}
