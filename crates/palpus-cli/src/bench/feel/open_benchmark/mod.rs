//! `palpus bench open`: a benchmark of 6-DOF rendering in which any engine can take part.
//!
//! 1. For each scene, the folder gets the two meshes, the recorded motion and the parameters of the
//!    contact (`data`).
//! 2. palpus's own methods and the baselines compute their wrenches along each motion and write
//!    them. Other engines supply folders with the same files (`answers`).
//! 3. All answers are measured in the same way, with the measures of `palpus bench feel`: truth,
//!    steps, pop-throughs, and the net work along the motion. Methods that can be stepped are also
//!    held in a normal hand, for the energy of the closed loop.
//!
//! Only the times of steps differ from run to run.

mod answers;
mod clearance;
mod data;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, bail};
use palpus::algebra::Wrench;
use palpus::render::ProbeState;

use super::closed::turned;
use super::columns::{Column, column};
use super::ground::{Ground, SCENES};
use super::method::{ContactOffset, Entry, FeltTick, METHODS, Method};
use super::open::{self, Played};
use super::report::{Pick, Section, csv, markdown, table};
use super::row::{Row, Rows, quantile};
use super::{chosen, refine, scripted, shared_out};
use crate::table::Table;
use crate::{files, output};
use answers::Answers;
use clearance::{FITS, Fit};

/// The hand of the closed loop.
const HAND: &str = "normal";

/// Arguments of the command.
pub(in crate::bench) struct Asked<'a> {
    pub(in crate::bench) out: &'a Path,
    pub(in crate::bench) scene: Option<&'a str>,
    /// Folder with the models of parts with a known play; they may be in subfolders.
    pub(in crate::bench) models: Option<&'a Path>,
    /// Other engines: the name and the folder of answers of each engine.
    pub(in crate::bench) engines: &'a [(String, PathBuf)],
    /// Writes scenes and motions only.
    pub(in crate::bench) scenes_only: bool,
    /// Longest used part of each motion, s.
    pub(in crate::bench) seconds: f64,
}

/// Columns of the open loop.
const ALONG: [Column; 9] = [
    column("direction, p99 (°)", &["direction error p99"], 1.0, 2),
    column("size, p99 (%)", &["size error p99"], 1.0, 2),
    column("torque: line of action, p99 (mm)", &["line of action error p99"], 1e3, 2),
    column("force step, max (mN/ms)", &["force step max"], 1e3, 3),
    column("over motion × k", &["force step over motion"], 1.0, 3),
    column("torque step, max (mN·m/ms)", &["torque step max"], 1e3, 3),
    column("pop-throughs", &["pop-throughs"], 1.0, 3),
    column("energy along the motion (mJ)", &["energy along the motion"], 1e3, 3),
    column("step, p50 / p99 (µs)", &["step p50", "step p99"], 1.0, 3),
];
/// Columns of parts with a known play.
const FIT: [Column; 5] = [
    column("free travel, largest error (µm)", &["free travel error"], 1e6, 2),
    column("felt too early by, at most (µm)", &["free travel short by"], 1e6, 2),
    column("press over k × overlap", &["press over k"], 1.0, 3),
    column("press direction (°)", &["press direction error"], 1.0, 2),
    column("directions never felt", &["never felt"], 1.0, 1),
];
/// Column of the closed loop.
const IN_HAND: [Column; 1] = [column("energy in a normal hand (mJ)", &["energy generated"], 1e3, 3)];

pub(in crate::bench) fn run(asked: &Asked<'_>) -> anyhow::Result<ExitCode> {
    files::make_folder(asked.out)?;
    let mut known = SCENES.to_vec();
    known.extend(asked.models.iter().flat_map(|_| FITS.iter().map(|fit| fit.name)));
    let scenes = chosen("--scene", asked.scene, &known)?;
    if asked.models.is_none() && asked.scene.is_none() {
        output::line("parts with a known play are left out: --models names the folder of their models");
    }
    let entries: Vec<Entry> = METHODS.into_iter().filter(|entry| !entry.is_passive).collect();
    if let Some((name, _)) = asked.engines.iter().find(|(name, _)| entries.iter().any(|entry| entry.name == name)) {
        bail!("--engine {name} is the name of a built-in method; choose another name");
    }
    let mut grounds = Vec::new();
    for name in scenes {
        match (Fit::of(name), asked.models) {
            (Some(fit), Some(models)) => match fit.ground(models)? {
                Some(ground) => grounds.push(ground),
                None => output::line(format!("{name} is left out: {} does not have its models", models.display())),
            },
            _ => grounds.push(Ground::new(name, asked.seconds)?),
        }
    }
    refine(&mut grounds)?;
    data::describe(asked.out)?;
    for ground in &grounds {
        data::write(asked.out, ground)?;
    }
    if asked.scenes_only {
        output::line(format!("scenes and motions written to {}", asked.out.join("scenes").display()));
        return Ok(ExitCode::SUCCESS);
    }
    // Other engines come first, so that faults of their files are reported before the long work.
    let mut rows: BTreeMap<usize, Vec<Row>> = BTreeMap::new();
    for (k, ground) in grounds.iter().enumerate() {
        for (name, folder) in asked.engines {
            let file = folder.join(format!("{}.csv", ground.name));
            if file.exists() {
                rows.entry(k).or_default().extend(of_engine(ground, name, &file)?);
            }
        }
    }
    // Voxel methods are left out: their voxels would have to be finer than a play of 0.01 mm.
    let work: Vec<(usize, &Entry)> = (0..grounds.len())
        .flat_map(|k| entries.iter().map(move |entry| (k, entry)))
        .filter(|(k, entry)| !(entry.is_costly && Fit::of(grounds[*k].name).is_some()))
        .collect();
    let measured = shared_out(work.len(), |at| {
        let (ground, entry) = (&grounds[work[at].0], work[at].1);
        of_method(asked.out, ground, entry)
            .with_context(|| format!("{} on {} could not be measured", entry.name, ground.name))
    })?;
    for ((k, _), measured) in work.iter().zip(measured) {
        rows.entry(*k).or_default().extend(measured);
    }
    let rows: Vec<Row> = rows.into_values().flatten().collect();
    let names: Vec<&str> =
        entries.iter().map(|entry| entry.name).chain(asked.engines.iter().map(|(name, _)| name.as_str())).collect();
    let page = page(&grounds, &names, &rows);
    files::write(&asked.out.join("open.md"), &page)?;
    files::write(&asked.out.join("open.csv"), csv(&rows))?;
    files::write(&asked.out.join("open.json"), serde_json::to_string_pretty(&rows)?)?;
    output::line(page);
    output::line(format!("written to {}: open.md, open.csv, open.json, scenes and answers", asked.out.display()));
    Ok(ExitCode::SUCCESS)
}

/// Computes the answers of a method that can be stepped, and their measures.
fn of_method(out: &Path, ground: &Ground, entry: &Entry) -> anyhow::Result<Vec<Row>> {
    let mut method = Timed { inner: entry.build(ground, &open::tuning(ground))?, micros: Vec::new() };
    let played = open::play(ground, &mut method, false);
    let answers = Answers { wrenches: played.wrenches, micros: method.micros };
    let folder = out.join("answers").join(entry.name);
    files::make_folder(&folder)?;
    answers.write(&folder.join(format!("{}.csv", ground.name)))?;
    let mut rows = Rows::new(ground.name, entry.name);
    judged(ground, entry.contact_offset, answers, &mut rows);
    if Fit::of(ground.name).is_none() {
        scripted::measure(ground, entry, &[HAND], &mut rows)?;
    }
    Ok(rows.rows)
}

fn of_engine(ground: &Ground, name: &str, file: &Path) -> anyhow::Result<Vec<Row>> {
    let answers = Answers::read(file, ground.script.len())?;
    let mut rows = Rows::new(ground.name, name.to_owned());
    judged(ground, ContactOffset::Surface, answers, &mut rows);
    Ok(rows.rows)
}

/// Adds the measures of one scene's answers.
fn judged(ground: &Ground, contact_offset: ContactOffset, answers: Answers, rows: &mut Rows) {
    let Answers { wrenches, micros } = answers;
    rows.add("", "energy along the motion", "J", energy(ground, &wrenches));
    if !micros.is_empty() {
        rows.add("", "step p50", "µs", quantile(&micros, 0.5));
        rows.add("", "step p99", "µs", quantile(&micros, 0.99));
    }
    if let Some(fit) = Fit::of(ground.name) {
        fit.judge(ground, contact_offset, &wrenches, rows);
    }
    open::judge(ground, &wrenches, rows);
    open::compare(ground, contact_offset, &Played { wrenches, ..Played::default() }, rows);
}

/// Returns the largest net work that the wrenches had done on the hand at any time of the motion,
/// J. A wrench acts from its tick to the next.
fn energy(ground: &Ground, wrenches: &[Wrench]) -> f64 {
    let grip = |probe: &ProbeState| probe.pose_ba.point(ground.settings.grip_a);
    let (mut work, mut most) = (0.0_f64, 0.0_f64);
    for (pair, wrench) in ground.script.windows(2).zip(wrenches) {
        work += wrench.force.dot(grip(&pair[1]) - grip(&pair[0]));
        work += wrench.torque.dot(turned(&pair[0].pose_ba, &pair[1].pose_ba));
        most = most.max(work);
    }
    most
}

/// A method whose steps are timed.
struct Timed {
    inner: Box<dyn Method>,
    /// Time of each step, µs.
    micros: Vec<f64>,
}

impl Method for Timed {
    fn step(&mut self, probe: &ProbeState, dt: f64) -> FeltTick {
        let begin = Instant::now();
        let felt = self.inner.step(probe, dt);
        self.micros.push(begin.elapsed().as_secs_f64() * 1e6);
        felt
    }
}

fn page(grounds: &[Ground], names: &[&str], rows: &[Row]) -> String {
    let names_of_rows = ["scene", "method"];
    let mut fits = table("Parts with a known play", &names_of_rows, &FIT, []);
    let mut all = table("All scenes", &names_of_rows, &ALONG, []);
    all.head.extend(IN_HAND.iter().map(|column| column.head.to_owned()));
    for ground in grounds {
        let pick = Pick { rows, scene: ground.name };
        for name in names {
            let first = [ground.name.to_owned(), (*name).to_owned()].into_iter();
            fits.rows.push(first.clone().chain(pick.cells(name, "", &FIT)).collect());
            let cells = pick.cells(name, "", &ALONG).into_iter().chain(pick.cells(name, HAND, &IN_HAND));
            all.rows.push(first.chain(cells).collect());
        }
    }
    let text = "docs/open-benchmark.md describes the measures and how an engine takes part. A cell is empty if \
               the scene has no known truth, or if the engine takes part with files.";
    let mut tables = vec![all.without_empty(), fits.without_empty(), refined(grounds)];
    tables.retain(|table| !table.rows.is_empty());
    let section = Section { title: "Open benchmark".to_owned(), text: text.to_owned(), tables, figures: &[] };
    markdown(&[section])
}

/// Returns how many poses the refined truths of the scenes leave out.
fn refined(grounds: &[Ground]) -> Table {
    let row = |ground: &Ground| {
        let poses = &ground.refined.as_ref()?.poses;
        let left_out = poses.iter().filter(|contacts| contacts.is_none()).count();
        Some(vec![ground.name.to_owned(), poses.len().to_string(), left_out.to_string()])
    };
    Table::new(&["scene", "judged poses", "left out"], 1, grounds.iter().filter_map(row)).titled("Refined truth")
}

#[cfg(test)]
mod tests {
    use super::super::ground::JUDGED;
    use super::super::truth;
    use super::*;

    /// The paper's method, judged from files, must get the same figures as the built-in method.
    #[test]
    fn engine_from_files_is_judged_like_the_method() {
        let out = std::env::temp_dir().join(format!("palpus-open-{}", std::process::id()));
        let ground = Ground::new("box-rest", 1.0).expect("the scene is built in");
        let own = of_method(&out, &ground, &METHODS[0]).expect("the method can be measured");
        let file = out.join("answers").join("paper").join("box-rest.csv");
        let theirs = of_engine(&ground, "other", &file).expect("the file can be read");
        std::fs::remove_dir_all(&out).expect("the folder can be deleted");
        let value = |rows: &[Row], measure| rows.iter().find(|row| row.measure == measure).map(|row| row.value);
        for measure in ["force step max", "torque step max", "pop-throughs", "energy along the motion", "peak force"] {
            assert_eq!(value(&own, measure), value(&theirs, measure), "{measure}");
            assert!(value(&own, measure).is_some(), "{measure}");
        }
    }

    /// Answers equal to the refined truth have no error. Turned forces have an error of the same
    /// angle.
    #[test]
    fn refined_truth_is_judged() {
        let mut ground = Ground::new("rails", 1.5).expect("a built-in scene");
        ground.refined = ground.refined_truth();
        let stiffness = ground.settings.stiffness;
        let off = |turn: f64| {
            let wrench = |k: usize| {
                let unit = truth::shared(&ground, 0.0, k - k % JUDGED).expect("known");
                let force = glam::DQuat::from_rotation_x(turn) * (unit.force * stiffness);
                Wrench { force, torque: unit.torque.expect("known") * stiffness }
            };
            let wrenches = (0..ground.script.len()).map(wrench).collect();
            let mut rows = Rows::new("rails", "truth");
            judged(&ground, ContactOffset::Surface, Answers { wrenches, micros: Vec::new() }, &mut rows);
            ["direction error max", "size error max", "line of action error max"]
                .map(|measure| rows.rows.iter().find(|row| row.measure == measure).expect("judged").value)
        };
        assert!(off(0.0).iter().all(|error| *error < 1e-9), "{:?}", off(0.0));
        assert!((off(0.1)[0] - 0.1_f64.to_degrees()).abs() < 1e-6, "{:?}", off(0.1));
        assert!(page(&[ground], &[], &[]).contains("| rails | 301 | 0 |"));
    }
}
