//! Runs a step and stores its outcome with its files, so that the page can be made from them at any
//! time.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Context;
use serde::{Deserialize, Serialize};

use super::plan::{Step, Wanted};
use crate::doctor::load::load_average;
use crate::when;
use crate::{files, output};

/// Outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Outcome {
    Done,
    Failed,
    Skipped,
}

/// The outcome of a step, or the reason why it was skipped.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Ran {
    /// Start of the reproduction. Steps with the same value were measured in the same run.
    pub(super) run: String,
    pub(super) command: String,
    pub(super) outcome: Outcome,
    /// Why the step was skipped, or its error.
    pub(super) why: String,
    pub(super) seconds: f64,
    pub(super) finished: String,
    /// Load average at the start, which shows the load by other programs.
    pub(super) load: Option<f64>,
    pub(super) quick: bool,
}

/// The file in a step's folder.
pub(super) const FILE: &str = "ran.json";
/// Output of the command.
pub(super) const SAID: &str = "said.txt";

/// Runs the step. If the step fails, the page reports it, and the other steps still run.
pub(super) fn run(step: &Step, wanted: &Wanted<'_>, run: &str) -> anyhow::Result<Ran> {
    let folder = wanted.folder(step.id);
    // Removes the files of an earlier run, so that they do not count as results of this run.
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| format!("{} could not be emptied", folder.display()))?;
    }
    files::make_folder(&folder)?;
    let begin = Instant::now();
    let load = load_average();
    let (command, outcome, why) = match &step.command {
        Err(why) => (String::new(), Outcome::Skipped, why.clone()),
        Ok(invocation) => {
            let said = fs::File::create(folder.join(SAID)).context("the output of a step could not be stored")?;
            let mut command = Command::new(&invocation.program);
            command.args(&invocation.arguments).stdin(Stdio::null()).stdout(said);
            // Prevents a window, which would wait for the user to close it.
            command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
            let (outcome, why) = match command.status() {
                Ok(status) if status.success() || step.may_fail => (Outcome::Done, String::new()),
                Ok(status) => (Outcome::Failed, format!("it ended with {status}")),
                Err(error) => (Outcome::Failed, format!("it could not be started: {error}")),
            };
            (invocation.shown.clone(), outcome, why)
        }
    };
    let ran = Ran {
        run: run.to_owned(),
        command,
        outcome,
        why,
        seconds: begin.elapsed().as_secs_f64(),
        finished: when::now(),
        load,
        quick: step.is_quick,
    };
    keep(&folder.join(FILE), &ran)?;
    Ok(ran)
}

/// Writes `value` as JSON.
pub(super) fn keep(path: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    files::write(path, serde_json::to_string_pretty(value)?)
}

/// Shows the progress to the user.
pub(super) fn tell(k: usize, count: usize, step: &Step) {
    match &step.command {
        Ok(invocation) => {
            output::note(format!("[{}/{count}] {} (about {:.0} s): {}", k + 1, step.what, step.about, invocation.shown))
        }
        Err(why) => output::note(format!("[{}/{count}] {} is left out: {why}", k + 1, step.id)),
    }
}
