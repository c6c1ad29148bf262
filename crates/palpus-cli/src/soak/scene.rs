//! Scene and motion of a soak run.
//!
//! In scenes with a path (built-in scenes and files with `[hand] path`), the hand moves about along
//! this path. In a scene file without a path, the hand finds places of contact itself
//! ([`palpus_scenes::tour`]).

use std::fs;
use std::path::Path;

use anyhow::{Context, bail};
use palpus_io::read_scene;
use palpus_io::scene::FilePolicy;
use palpus_scenes::{HandPath, Wander, tour};

use crate::args::{SoakArguments, file_policy};
use crate::bench::find_model;
use crate::stage::{self, Stage};

/// Largest deviation of the hand from its path along each axis, in contact tolerances. The
/// deviation is usually a quarter of this value.
const STRAY_TOLERANCES: f64 = 12.0;
/// Largest rotation of the hand, rad.
const STRAY_TURN: f64 = 0.25;

/// The paper's pair, and its scale: metres per unit of each file.
const PAIR: [(&str, f64); 2] = [("armadillo_31240.obj", 0.15), ("intestine_colon_male_24846.obj", 1.0)];
/// Name of the scene.
const PAIR_NAME: &str = "armadillo-intestine";

/// A scene and the hands in it.
pub(super) struct Ground {
    pub(super) name: String,
    /// One path for each tool.
    pub(super) hands: Vec<Hand>,
}

/// A tool, and the hand that moves about with it.
pub(super) struct Hand {
    /// The stage with this tool as the probe.
    pub(super) stage: Stage,
    pub(super) wander: Wander,
}

pub(super) fn prepare(arguments: &SoakArguments) -> anyhow::Result<Ground> {
    let (name, scene, policy) = match &arguments.models {
        Some(folder) => (PAIR_NAME.to_owned(), write_pair(folder, &arguments.out)?, FilePolicy::Anywhere),
        None => (arguments.scene.clone(), arguments.scene.clone(), file_policy(arguments.allow_outside)),
    };
    let stage = stage::prepare(&scene, policy)?;
    let others: Vec<Stage> = stage.of_others().collect();
    let own_paths = if palpus_scenes::scene(&scene).is_some() {
        vec![true; 1 + others.len()]
    } else {
        let file = read_scene(Path::new(&scene), policy)?;
        let hands = std::iter::once(&file.hand).chain(file.others.iter().map(|tool| &tool.hand));
        hands.map(|hand| hand.path.is_some()).collect()
    };
    let hand = |(k, (stage, has_path)): (usize, (Stage, bool))| -> anyhow::Result<Hand> {
        let seed = arguments.seed.wrapping_add(k as u64);
        let path = if has_path { stage.path.clone() } else { found(&stage, seed)? };
        let shift = STRAY_TOLERANCES * stage.settings.contact_tolerance;
        let wander = Wander::about(&path, shift, STRAY_TURN, seed).turning_at(stage.settings.grip_a);
        Ok(Hand { stage, wander })
    };
    let hands = std::iter::once(stage).chain(others).zip(own_paths).enumerate().map(hand);
    Ok(Ground { name, hands: hands.collect::<Result<_, _>>()? })
}

/// Returns a path through places at which the probe touches, found by a search.
fn found(stage: &Stage, seed: u64) -> anyhow::Result<HandPath> {
    let start = stage.environment_pose.inverse() * stage.path.pose(0.0);
    let path = tour(&stage.probe, &stage.environment, start, stage.settings.contact_tolerance, seed);
    let Some(path) = path else {
        bail!(
            "the probe does not touch the environment on its way; set another `position`, or give the scene a [hand] path"
        );
    };
    Ok(path.placed(&stage.environment_pose))
}

/// Writes the scene file of the paper's pair, whose meshes are in `models` or in a subfolder;
/// returns its name.
fn write_pair(models: &Path, out: &Path) -> anyhow::Result<String> {
    let mut meshes = Vec::new();
    for (file, _) in PAIR {
        let Some(path) = find_model(models, file) else {
            bail!("{file} is neither in {} nor in a folder in it", models.display());
        };
        let path = path.canonicalize().with_context(|| format!("{} cannot be read", path.display()))?;
        let Some(path) = path.to_str() else { bail!("a scene file cannot name {}", path.display()) };
        meshes.push(toml::Value::from(path).to_string());
    }
    let [(_, probe), (_, environment)] = PAIR;
    let text = format!(
        "# The armadillo of [K02] at 15 cm, felt along a colon. Its meshes are elsewhere: palpus run FILE --allow-outside\n\
         unit = \"m\"\n\n\
         [probe]\nmesh = {}\nunit = {probe}\nposition = [0.013, 0.19, 0.32]\n\n\
         [environment]\nmesh = {}\nunit = {environment:?}\n\n\
         [contact]\ntolerance = 0.002\nfriction = {{ static = 0.4, dynamic = 0.3 }}\n",
        meshes[0], meshes[1]
    );
    let file = out.join(format!("{PAIR_NAME}.toml"));
    let problem = || format!("{} could not be written; name another folder with --out", file.display());
    fs::create_dir_all(out).with_context(problem)?;
    fs::write(&file, text).with_context(problem)?;
    Ok(file.to_string_lossy().into_owned())
}
