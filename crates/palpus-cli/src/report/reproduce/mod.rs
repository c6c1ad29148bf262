//! The page of the whole reproduction: every table and figure of the paper with the results
//! measured here, and the further benchmarks.
//!
//! 1. *Plan* ([`plan`]): one command for each step, as a user would type it.
//! 2. *Run* ([`ran`]): the steps run one after another, because most of them measure times. The
//!    outcome of a step is stored with its files.
//! 3. *Page* ([`page`], [`summary`], [`paper`], [`sections`]): the page is made from these files
//!    ([`data`]), so it can be made again without measuring. Every section states whether its
//!    figures were measured in this run, by which command, and how long it took. Figures from the
//!    documentation ([`stored`]) are marked.

mod data;
mod machine;
mod paper;
mod plan;
mod ran;
mod sections;
mod stored;
mod summary;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use self::data::Data;
use self::plan::{STEPS, Wanted, plan};
use self::ran::{Outcome, keep};
use super::html::{Html, Tone};
use crate::args::ReportArguments;
use crate::durations::duration;
use crate::output;

/// Description of a reproduction.
#[derive(Debug, Serialize, Deserialize)]
struct Reproduction {
    /// Start time, which identifies the reproduction.
    run: String,
    command: String,
    quick: bool,
    seconds: f64,
    machine: Vec<(String, String)>,
    versions: Vec<(String, String)>,
}

/// File in the folder of a reproduction.
const FILE: &str = "reproduction.json";

/// True if the folder holds a reproduction.
pub(super) fn is_in(folder: &Path) -> bool {
    folder.join(FILE).is_file()
}

/// Runs all steps and writes their page to `folder`.
pub(super) fn reproduce(arguments: &ReportArguments, folder: &Path) -> anyhow::Result<()> {
    // Some steps run in another folder (cargo's benches) and need an absolute path.
    let out = std::path::absolute(folder).context("the folder of the report has no path")?;
    let models = arguments.models.as_deref().map(std::path::absolute).transpose().context("--models has no path")?;
    if let Some(models) = models.as_deref().filter(|models| !models.is_dir()) {
        bail!("--models {} is not a folder", models.display());
    }
    let wanted = Wanted { out: &out, models: models.as_deref(), quick: arguments.quick };
    let steps = plan(&wanted);
    if let Some(only) = arguments.only.iter().find(|only| steps.iter().all(|step| step.id != only.as_str())) {
        bail!(
            "there is no step {only}; the steps are {}",
            steps.iter().map(|step| step.id).collect::<Vec<_>>().join(", ")
        );
    }
    let steps: Vec<_> = steps
        .iter()
        .filter(|step| arguments.only.is_empty() || arguments.only.iter().any(|only| only == step.id))
        .collect();
    std::fs::create_dir_all(&out).with_context(|| format!("{} could not be created", folder.display()))?;
    let run = crate::when::now();
    let begin = Instant::now();
    let about: f64 = steps.iter().filter(|step| step.command.is_ok()).map(|step| step.about).sum();
    output::note(format!(
        "{} steps, about {} on two quiet cores; the page has all steps that succeed",
        steps.len(),
        duration(about)
    ));
    let mut failed = 0;
    for (k, step) in steps.iter().enumerate() {
        ran::tell(k, steps.len(), step);
        let ran = ran::run(step, &wanted, &run)?;
        match ran.outcome {
            Outcome::Done => output::note(format!("      done in {}", duration(ran.seconds))),
            Outcome::Failed => {
                failed += 1;
                output::note(format!("      failed after {}: {}", duration(ran.seconds), ran.why));
            }
            Outcome::Skipped => {}
        }
    }
    let reproduction = Reproduction {
        run,
        command: command(arguments),
        quick: arguments.quick,
        seconds: begin.elapsed().as_secs_f64(),
        machine: machine::facts(),
        versions: machine::versions(),
    };
    keep(&out.join(FILE), &reproduction)?;
    if failed > 0 {
        output::note(format!("{failed} of {} steps failed; the page names them", steps.len()));
    }
    Ok(())
}

/// Returns the command as typed, without folders.
fn command(arguments: &ReportArguments) -> String {
    let mut command = "palpus report DIR --reproduce".to_owned();
    if arguments.quick {
        command += " --quick";
    }
    if arguments.models.is_some() {
        command += " --models MODELS";
    }
    for only in &arguments.only {
        command += " --only ";
        command += only;
    }
    command
}

/// Returns the page of the reproduction in `folder`.
pub(super) fn page(folder: &Path) -> anyhow::Result<String> {
    let file = folder.join(FILE);
    let text = std::fs::read_to_string(&file).with_context(|| format!("{} could not be read", file.display()))?;
    let reproduction: Reproduction =
        serde_json::from_str(&text).with_context(|| format!("{} does not describe a reproduction", file.display()))?;
    let data = Data { folder };
    let run = reproduction.run.as_str();
    let title = "Six-degree-of-freedom haptic display, reproduced";
    let mut page = Html::new();
    page.element("header", "", |header| head(header, title, &data, &reproduction));
    summary::summary(&mut page, &data);
    page.contents(&CONTENTS.map(|(id, title)| (id, title.to_owned())));
    paper::claims(&mut page, &data);
    paper::table_1(&mut page, &data, run);
    paper::figure_4(&mut page, &data, run);
    paper::figure_5(&mut page, &data, run);
    paper::figure_6(&mut page, &data, run);
    sections::run(&mut page, &data, run)?;
    sections::feel(&mut page, &data, run);
    sections::scale(&mut page, &data, run);
    sections::pairs(&mut page, &data, run);
    sections::conformal(&mut page, &data, run);
    sections::convex(&mut page, &data, run);
    sections::depth(&mut page, &data, run);
    summary::conclusion(&mut page, &data);
    sections::made(&mut page, &data, &reproduction);
    page.text_in("footer", "", "This page loads no other files, so it can be mailed and stored. Its colours follow the reader's system, and it can be printed.");
    Ok(page.page(title))
}

const CONTENTS: [(&str, &str); 13] = [
    ("table1", "Table 1"),
    ("figure4", "Figure 4"),
    ("figure5", "Figure 5"),
    ("figure6", "Figure 6"),
    ("run", "In real time"),
    ("feel", "Feel"),
    ("scale", "Scale"),
    ("pairs", "Real pairs"),
    ("conformal", "Nut on its thread"),
    ("convex", "Convex pairs"),
    ("depth", "Penetration depth"),
    ("conclusion", "Conclusion"),
    ("made", "How this was made"),
];

fn head(html: &mut Html, title: &str, data: &Data<'_>, reproduction: &Reproduction) {
    html.text_in("h1", "", title);
    html.text_in(
        "p",
        "lead",
        "palpus beside Kim, Otaduy, Lin, Manocha: Six-Degree-of-Freedom Haptic Display Using Localized \
            Contact Computations (2002): its table and figures, measured again, and further benchmarks.",
    );
    let here = |id: &&&'static str| {
        data.ran(id).is_some_and(|ran| ran.outcome == Outcome::Done && ran.run == reproduction.run)
    };
    let measured = STEPS.iter().filter(here).count();
    html.element("p", "", |badges| {
        badges.badge(Tone::Plain, &reproduction.run);
        let tone = if measured == STEPS.len() { Tone::Good } else { Tone::Plain };
        badges.badge(tone, &format!("{measured} of {} steps measured in this run", STEPS.len()));
        if reproduction.quick {
            badges.badge(Tone::Warning, "the quick form: fewer ticks, fewer hands");
        }
        if let Some((tone, words)) = sections::fitness(data) {
            badges.badge(tone, words);
        }
        badges.badge(Tone::Plain, &format!("took {}", duration(reproduction.seconds)));
    });
}

/// Writes the line below a section's title: whether its figures were measured in this run, by which
/// command, and how long it took.
fn origin(html: &mut Html, data: &Data<'_>, id: &str, run: &str) {
    let Some(ran) = data.ran(id) else {
        html.element("p", "origin", |p| {
            p.badge(Tone::Warning, "not measured");
        });
        return;
    };
    html.element("p", "origin", |p| {
        match ran.outcome {
            Outcome::Done if ran.run == run => p.badge(Tone::Good, "measured in this run"),
            Outcome::Done => p.badge(Tone::Warning, &format!("not measured in this run: measured {}", ran.finished)),
            Outcome::Failed => p.badge(Tone::Bad, "failed"),
            Outcome::Skipped => p.badge(Tone::Warning, "not measured in this run"),
        };
        if ran.quick && ran.outcome == Outcome::Done {
            p.badge(Tone::Warning, "quick");
        }
        if !ran.why.is_empty() {
            p.text(&ran.why).text(". ");
        }
        if !ran.command.is_empty() {
            p.text_in("code", "", &ran.command);
            p.text(&format!(" took {}", duration(ran.seconds)));
        }
    });
}
