//! Saves the scene of a run as a scene file with the current settings.
//!
//! 1. The text comes from the scene's file, or from the export of the built-in scene.
//! 2. The settings of the window replace the tables `contact` and `coupling`; other keys stay. The
//!    start and the grip of the probe are taken from the run.
//! 3. The new file is written into the folder of the original file, so that its meshes are found. A
//!    built-in scene gets its own folder. Nothing is overwritten.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use palpus::algebra::Pose;
use palpus::render::Settings;
use palpus_io::record::SceneSource;
use palpus_window::Start;
use toml::{Table, Value};

use super::settings_text;
use crate::approach::{Ways, approach};
use crate::stage::Stage;
use crate::{export, files};

/// Keys that the window may omit, since a missing key means that the option is off.
const OF_CONTACT: [&str; 4] = ["friction", "crease_angle", "shading_limit", "stiffness"];

/// Changes the start of the run of `stage`: another pose of the probe or another grip. From there,
/// the simulated hand moves towards the environment until the probe touches.
///
/// # Errors
///
/// Fails if the scene has several tools, whose hands work together.
pub(super) fn begin_at(stage: &mut Stage, start: &Start) -> anyhow::Result<()> {
    if !stage.others.is_empty() {
        bail!("a scene with several tools always starts as in its file; palpus run --lead-out leads them out");
    }
    if let Some(grip_a) = start.grip_a {
        stage.settings.grip_a = grip_a;
        stage.recorded.render.grip_a = grip_a;
    }
    if let Some(probe) = start.probe {
        let (tolerance, mode) = (stage.settings.contact_tolerance, stage.coupling.mode);
        let mut ways = Ways::new(&stage.probe, &stage.environment);
        stage.path = approach(&mut ways, probe, stage.environment_pose, tolerance, mode);
        stage.recorded.probe.pose = probe;
    }
    Ok(())
}

/// Writes the scene of `stage` with `settings`. A built-in scene is written to a new folder in
/// `below`. `is_moved`: the start was changed by [`begin_at`]. Returns the scene file.
pub(super) fn save(stage: &Stage, settings: &Settings, is_moved: bool, below: &Path) -> anyhow::Result<PathBuf> {
    let (text, metres_per_unit, file) = match &stage.recorded.source {
        SceneSource::BuiltIn(name) => {
            let scene = palpus_scenes::scene(name).ok_or_else(|| anyhow!("there is no scene {name}"))?;
            let folder = files::free(&below.join(name));
            export::write_scene(&scene, &folder)?;
            let file = folder.join(export::SCENE_FILE);
            (read(&file)?, 1e-3, file)
        }
        SceneSource::File(path) => {
            let text = stage.recorded.text.clone().map_or_else(|| read(Path::new(path)), Ok)?;
            (text, stage.recorded.metres_per_unit, files::free(Path::new(path)))
        }
    };
    let mut scene: Table = text.parse().with_context(|| format!("{} is not valid TOML", file.display()))?;
    let tables: Table =
        settings_text::toml(settings, metres_per_unit).parse().context("the settings are not valid TOML")?;
    for (name, values) in tables {
        let Value::Table(values) = values else { continue };
        let table = table_of(&mut scene, &name)?;
        if name == "contact" {
            OF_CONTACT.iter().for_each(|key| drop(table.remove(*key)));
        } else {
            table.clear();
        }
        table.extend(values);
    }
    if scene.contains_key("probe") {
        put_start(&mut scene, stage, settings, metres_per_unit)?;
        if is_moved {
            // A path of poses begins at another start, so it is removed.
            let hand = table_of(&mut scene, "hand")?;
            ["path", "path_scale", "path_speed"].iter().for_each(|key| drop(hand.remove(*key)));
        }
    }
    let text = format!("# Saved from the window of palpus.\n{}", toml::to_string(&scene)?);
    files::write(&file, text)?;
    Ok(file)
}

fn read(file: &Path) -> anyhow::Result<String> {
    fs::read_to_string(file).with_context(|| format!("{} could not be read", file.display()))
}

fn table_of<'a>(scene: &'a mut Table, name: &str) -> anyhow::Result<&'a mut Table> {
    let table = scene.entry(name).or_insert_with(|| Value::Table(Table::new()));
    table.as_table_mut().with_context(|| format!("`{name}` is not a table"))
}

/// Writes the start and the grip of the probe.
fn put_start(scene: &mut Table, stage: &Stage, settings: &Settings, metres_per_unit: f64) -> anyhow::Result<()> {
    let Pose { translation, rotation } = stage.recorded.probe.pose;
    let numbers = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
    let lengths = |metres: glam::DVec3| numbers(&(metres / metres_per_unit).to_array());
    let probe = table_of(scene, "probe")?;
    probe.insert("position".to_owned(), lengths(translation));
    probe.insert("orientation".to_owned(), numbers(&rotation.normalize().to_array()));
    probe.insert("grip".to_owned(), lengths(settings.grip_a));
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use palpus::force::FrictionSettings;
    use palpus_device::SimulationSettings;
    use palpus_io::scene::{CouplingMode, FilePolicy};

    use super::*;
    use crate::stage;

    fn near(one: f64, other: f64) {
        assert!((one - other).abs() <= 1e-9 * other.abs().max(1e-9), "{one} {other}");
    }

    #[test]
    fn saved_scene_runs_with_the_same_settings() {
        crate::bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-saved-{}", std::process::id()));
        let spec = SimulationSettings::default().spec;
        let mut stage = stage::prepare("box-table", FilePolicy::Inside).expect("the scene is built in");
        // Saves a built-in scene, then the saved file; the second time with another start.
        for (round, mode) in [CouplingMode::Coupled, CouplingMode::Direct].into_iter().enumerate() {
            let mut settings = stage.settings_in(mode, &spec, 1000.0);
            settings.contact_tolerance *= 0.7;
            settings.stiffness *= 1.3;
            settings.friction = (round == 0).then_some(FrictionSettings {
                static_coefficient: 0.7,
                dynamic_coefficient: 0.6,
                tangential_stiffness: 500.0,
            });
            if round == 1 {
                let probe = Pose { translation: DVec3::new(0.01, -0.02, 0.2), rotation: DQuat::from_rotation_x(0.4) };
                let grip_a = DVec3::new(0.001, 0.002, 0.003);
                begin_at(&mut stage, &Start { probe: Some(probe), grip_a: Some(grip_a), lead_out: false })
                    .expect("the scene has one tool");
                settings.grip_a = grip_a;
            }
            let file = save(&stage, &settings, round == 1, &folder).expect("the scene can be saved");
            let name = file.display().to_string();
            let again = stage::prepare(&name, FilePolicy::Inside).expect("the scene can be prepared");
            let read = again.settings_for(&spec, 1000.0);
            near(read.contact_tolerance, settings.contact_tolerance);
            near(read.cluster_radius, settings.cluster_radius);
            near(read.stiffness, settings.stiffness);
            assert_eq!((read.clustering, read.friction), (settings.clustering, settings.friction));
            assert_eq!(read.shading.is_some(), settings.shading.is_some());
            assert_eq!(read.coupling.is_some(), settings.coupling.is_some());
            if let (Some(read), Some(coupling)) = (&read.coupling, &settings.coupling) {
                near(read.stiffness, coupling.stiffness);
                near(read.contact_offset, coupling.contact_offset);
            }
            let (one, other) = (again.path.pose(0.0), stage.path.pose(0.0));
            assert!((one.translation - other.translation).length() < 1e-9, "the start must not change");
            assert!(one.rotation.angle_between(other.rotation) < 1e-6);
            assert!((read.grip_a - settings.grip_a).length() < 1e-9, "the grip must not change");
            stage = again;
        }
        assert!(folder.join("box-table/scene.toml").is_file() && folder.join("box-table/scene-2.toml").is_file());
        let _ = fs::remove_dir_all(&folder);
    }
}
