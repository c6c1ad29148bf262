//! Makes a scene from meshes that were opened in the window: from two new meshes, or from one new
//! mesh and one of the current bodies.
//!
//! The scene gets a new folder next to the recordings, with both meshes and a scene file. The new
//! scene is then prepared, recorded, replayed and edited like any other scene.
//!
//! 1. An opened mesh is read and moved so that the middle of its box is its origin. Meshes from CAD
//!    may be far from their origin, and the hand holds a probe at the origin.
//! 2. A body that stays is written with its original content, so that it is not prepared again.
//! 3. The probe starts above the environment, at a distance from it. The hand has no path and moves
//!    to the environment from there. For two new meshes, the program chooses the start as for a
//!    scene file without start poses.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::algebra::tolerance::TOLERANCE_SHARE;
use palpus::body::PolygonSoup;
use palpus::render::Settings;
use palpus_io::record::SceneSource;
use palpus_io::scene::{FilePolicy, parse_scene};
use palpus_io::{read_scene, write_obj_groups};
use palpus_window::{FileKind, MeshFile};

use crate::stage::Stage;
use crate::{bodies, files, gaps};

/// Parts of the current run that the next run keeps.
pub(super) struct Present {
    source: SceneSource,
    /// The text of a scene without a file: of two meshes from the command line.
    text: Option<String>,
    /// Start pose of the probe and pose of the environment, in the world.
    probe: Pose,
    environment: Pose,
    settings: Settings,
}

/// One of the two bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Probe,
    Environment,
}

/// The polygons, and their unit in metres.
struct Shape {
    soup: PolygonSoup,
    metres_per_unit: f64,
}

/// Returns the kind of a file before it is loaded.
pub(super) fn kind(path: &Path) -> Result<FileKind, String> {
    if is_scene(path) {
        // The user is asked about files in other folders when the scene is loaded.
        return read_scene(path, FilePolicy::Anywhere).map(|_| FileKind::Scene).map_err(|error| error.to_string());
    }
    let soup = bodies::read_mesh(path).map_err(|error| error.to_string())?;
    let [low, high] = bounds(soup.vertices.iter().copied()).ok_or("the mesh is empty")?;
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
            text: stage.text_without_file().map(str::to_owned),
            probe: stage.path.pose(0.0),
            environment: stage.environment_pose,
            settings: stage.settings,
        }
    }

    /// Makes a scene in which these meshes are the probe and the environment, in a new folder below
    /// `folder`; a body without a new mesh stays as it is. Returns the scene file.
    pub(super) fn with(
        &self,
        probe: Option<&MeshFile>,
        environment: Option<&MeshFile>,
        folder: &Path,
    ) -> anyhow::Result<PathBuf> {
        let new = [probe, environment];
        let shape = |part: Part| match new[part as usize] {
            Some(file) => Shape::read(file),
            None => self.other(part),
        };
        let (held, touched) = (shape(Part::Probe)?, shape(Part::Environment)?);
        let standing = if environment.is_some() { Pose::IDENTITY } else { self.environment };
        let rotation = if probe.is_some() { glam::DQuat::IDENTITY } else { self.probe.rotation };
        let start = Pose { rotation, translation: above(&held, &touched, &standing) };
        // The old settings may not suit two new bodies.
        let kept = (probe.is_none() || environment.is_none()).then_some(([start, standing], &self.settings));
        let stems: Vec<String> = new.into_iter().flatten().map(MeshFile::stem).collect();
        let folder = files::free(&folder.join(stems.join("-")));
        let problem = || format!("{} could not be made", folder.display());
        fs::create_dir_all(&folder).with_context(problem)?;
        held.write(&folder.join("probe.obj")).with_context(problem)?;
        touched.write(&folder.join("environment.obj")).with_context(problem)?;
        let scene = folder.join("scene.toml");
        let smallest = held.size().min(touched.size());
        let text = text(&new, [held.metres_per_unit, touched.metres_per_unit], kept, smallest);
        fs::write(&scene, text).with_context(problem)?;
        Ok(scene)
    }

    /// Returns the body that stays, with its original content.
    fn other(&self, part: Part) -> anyhow::Result<Shape> {
        match &self.source {
            SceneSource::BuiltIn(name) => {
                let scene = palpus_scenes::scene(name).ok_or_else(|| anyhow!("there is no scene {name}"))?;
                let soup = if part == Part::Probe { scene.probe } else { scene.environment };
                Ok(Shape { soup, metres_per_unit: 1.0 })
            }
            SceneSource::File(path) => {
                let path = Path::new(path);
                let scene = match &self.text {
                    Some(text) => parse_scene(text, path, FilePolicy::Anywhere)?,
                    None => read_scene(path, FilePolicy::Anywhere)?,
                };
                let body = if part == Part::Probe { scene.probe } else { scene.environment };
                Ok(Shape { soup: bodies::read_mesh(&body.mesh)?, metres_per_unit: body.metres_per_unit })
            }
        }
    }
}

impl Shape {
    /// Reads an opened mesh (step 1).
    fn read(opened: &MeshFile) -> anyhow::Result<Self> {
        let MeshFile { file, metres_per_unit } = opened;
        if !(*metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
            bail!("{metres_per_unit} m is not a valid unit");
        }
        let mut soup = bodies::read_mesh(file)?;
        let [low, high] = bounds(soup.vertices.iter().copied()).context("the mesh is empty")?;
        soup.vertices.iter_mut().for_each(|vertex| *vertex -= 0.5 * (low + high));
        Ok(Self { soup, metres_per_unit: *metres_per_unit })
    }

    /// Returns the diagonal of the body's box, m.
    fn size(&self) -> f64 {
        bounds(self.points()).map_or(0.0, |[low, high]| low.distance(high))
    }

    fn write(&self, path: &Path) -> std::io::Result<()> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        write_obj_groups(BufWriter::new(File::create(path)?), [(name, self.soup.clone())])
    }

    fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.soup.vertices.iter().map(|vertex| *vertex * self.metres_per_unit)
    }
}

/// Returns a pose in which the probe does not overlap the environment in any orientation.
fn above(probe: &Shape, environment: &Shape, standing: &Pose) -> DVec3 {
    let reach = probe.points().map(DVec3::length).fold(0.0, f64::max);
    let box_of = bounds(environment.points().map(|point| standing.point(point)));
    gaps::clear_above(box_of.unwrap_or([DVec3::ZERO; 2]), reach)
}

fn bounds(points: impl Iterator<Item = DVec3>) -> Option<[DVec3; 2]> {
    points.map(|point| [point; 2]).reduce(|[low, high], [point, _]| [low.min(point), high.max(point)])
}

/// Returns the text of the scene file. `kept`: poses of both bodies, and settings that stay;
/// `smallest` is the size of the smaller body, m.
fn text(new: &[Option<&MeshFile>; 2], units: [f64; 2], kept: Option<([Pose; 2], &Settings)>, smallest: f64) -> String {
    let names = new.iter().flatten().map(|opened| opened.file.to_string_lossy());
    // Keeps the comment on one line, whatever the file name contains.
    let names = names.collect::<Vec<_>>().join(" and ");
    let names: String = names.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let body = |k: usize, part: &str| {
        let place = kept.map_or(String::new(), |(poses, _)| {
            let ([x, y, z], q) = (poses[k].translation.to_array(), poses[k].rotation.normalize());
            format!("position = [{x:?}, {y:?}, {z:?}]\norientation = [{:?}, {:?}, {:?}, {:?}]\n", q.x, q.y, q.z, q.w)
        });
        format!("[{part}]\nmesh = \"{part}.obj\"\nunit = {:?}\n{place}\n", units[k])
    };
    let contact = kept.map_or(String::new(), |(_, settings)| {
        let friction = settings.friction.map_or(String::new(), |friction| {
            let (at_rest, sliding) = (friction.static_coefficient, friction.dynamic_coefficient);
            format!("friction = {{ static = {at_rest:?}, dynamic = {sliding:?} }}\n")
        });
        // The tolerance must also suit the new body.
        let finer = (TOLERANCE_SHARE * smallest / settings.contact_tolerance).min(1.0);
        format!(
            "[contact]\ntolerance = {:?}\ncluster_radius = {:?}\n{friction}shading = {}\n",
            finer * settings.contact_tolerance,
            finer * settings.cluster_radius,
            settings.shading.is_some()
        )
    });
    format!(
        "# Made when {names} was opened in the window.\nunit = \"m\"\n\n{}{}{contact}",
        body(0, "probe"),
        body(1, "environment")
    )
}

#[cfg(test)]
mod tests {
    use palpus_scenes::scene;

    use super::*;
    use crate::stage;

    #[test]
    fn dropped_mesh_and_kept_body_make_a_scene() {
        bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-dropped-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("the folder can be created");
        // The cube has sides of 20 mm and is far from its origin.
        let mut cube = String::new();
        for k in 0..8u32 {
            let side = |bit: u32| 500.0 + 20.0 * f64::from(k >> bit & 1);
            cube += &format!("v {} {} {}\n", side(0), side(1), side(2));
        }
        cube += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        let file = folder.join("a cube.obj");
        fs::write(&file, cube).expect("the file can be written");
        assert_eq!(kind(&file), Ok(FileKind::Mesh { size: DVec3::splat(20.0), triangles: 12 }));

        let before = stage::prepare("pen-sphere", FilePolicy::Inside).expect("the scene is built in");
        let present = Present::of(&before);
        let opened = MeshFile { file: file.clone(), metres_per_unit: 1e-3 };
        for part in [Part::Probe, Part::Environment] {
            let as_part = |which| (part == which).then_some(&opened);
            let scene_file =
                present.with(as_part(Part::Probe), as_part(Part::Environment), &folder).expect("the scene can be read");
            assert_eq!(kind(&scene_file), Ok(FileKind::Scene));
            let stage = stage::prepare(&scene_file.display().to_string(), FilePolicy::Inside)
                .expect("the scene can be prepared");
            let (new, kept, kept_before) = match part {
                Part::Probe => (&stage.probe, &stage.recorded.environment, &before.recorded.environment),
                Part::Environment => (&stage.environment, &stage.recorded.probe, &before.recorded.probe),
            };
            assert!((new.mass().volume - 8e-6).abs() < 1e-12 && new.mass().center_of_mass.length() < 1e-9);
            assert_eq!(kept.content, kept_before.content, "the kept mesh must not change");
            let settings = stage.settings_for(&palpus_device::SimulationSettings::default().spec, 1000.0);
            let mut engine = palpus::render::Renderer::new(stage.probe.clone(), stage.environment.clone(), settings)
                .expect("the scene can be rendered");
            let start = stage.environment_pose.inverse() * stage.path.pose(0.0);
            let state = palpus::render::ProbeState::at(start);
            let tick = engine.step(&state, 1e-3, &palpus::algebra::NoClock);
            assert!(tick.contacts.is_empty(), "the bodies must start apart");
        }
        assert!(folder.join("a cube").is_dir() && folder.join("a cube-2").is_dir(), "no folder may be overwritten");
        let nothing = folder.join("nothing.obj");
        assert!(kind(&nothing).expect_err("the file does not exist").contains("nothing.obj"));
        assert!(present.with(Some(&MeshFile { metres_per_unit: 0.0, ..opened.clone() }), None, &folder).is_err());
        // Both meshes are replaced: a start is chosen, and the hand's path touches.
        let both = present.with(Some(&opened), Some(&opened), &folder).expect("the scene can be read");
        let stage = stage::prepare(&both.display().to_string(), FilePolicy::Inside).expect("the scene can be prepared");
        assert!((stage.probe.mass().volume - stage.environment.mass().volume).abs() < 1e-15);
        assert!((stage.settings.contact_tolerance - 0.2e-3 * 3f64.sqrt()).abs() < 1e-9);
        assert!(!stage.notes.is_empty() && stage.path.duration() <= 4.0);
        assert!(scene("pen-sphere").is_some());
        let _ = fs::remove_dir_all(&folder);
    }
}
