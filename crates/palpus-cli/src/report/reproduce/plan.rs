//! The steps of a reproduction. Each step is a command of this program, or a script that compares
//! other libraries with it. Steps run one after another, since most of them measure times.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The parts of a reproduction to measure, and the folder for the results.
pub(super) struct Wanted<'a> {
    /// Absolute path.
    pub(super) out: &'a Path,
    /// Folder of meshes that may not be distributed.
    pub(super) models: Option<&'a Path>,
    pub(super) quick: bool,
}

/// A command and its purpose.
pub(super) struct Step {
    /// Name of the step and of its folder in `data`.
    pub(super) id: &'static str,
    pub(super) what: &'static str,
    /// Approximate duration on two idle cores, s.
    pub(super) about: f64,
    /// The command, or the reason to skip the step.
    pub(super) command: Result<Invocation, String>,
    /// True if only a part of the step is measured.
    pub(super) is_quick: bool,
    /// True if a nonzero exit status does not mean that the step failed.
    pub(super) may_fail: bool,
}

/// A program with its arguments, both as run and as shown on the page.
pub(super) struct Invocation {
    pub(super) program: OsString,
    pub(super) arguments: Vec<OsString>,
    pub(super) shown: String,
}

impl Invocation {
    fn new(program: impl Into<OsString>, shown: &str) -> Self {
        Self { program: program.into(), arguments: Vec::new(), shown: shown.to_owned() }
    }

    fn arg(mut self, argument: &str) -> Self {
        self.arguments.push(argument.into());
        self.shown += " ";
        self.shown += argument;
        self
    }

    fn args(self, arguments: &[&str]) -> Self {
        arguments.iter().fold(self, |invocation, argument| invocation.arg(argument))
    }

    /// Adds a path that is shown under another name, because pages must not reveal folders.
    fn path(mut self, path: impl Into<OsString>, shown: &str) -> Self {
        self.arguments.push(path.into());
        self.shown += " ";
        self.shown += shown;
        self
    }
}

/// Pairs that are timed with Coal too, with the ticks for palpus and for Coal, and the approximate
/// duration, s. Coal needs up to a second for a tick.
pub(super) const PAIRS: [(&str, &str, [u32; 2], f64); 6] = [
    ("coal-spoon-cup", "spoon-cup", [20_000, 2000], 6.0),
    ("coal-armadillo-intestine", "armadillo-intestine", [20_000, 1000], 25.0),
    ("coal-nut-bolt", "nut-bolt", [1000, 10], 60.0),
    ("coal-gears", "gears", [4000, 10], 25.0),
    ("coal-drill-blade", "drill-blade", [2000, 100], 60.0),
    ("coal-lucy-embryo", "lucy-embryo", [2000, 200], 90.0),
];

/// Numbers of ticks of the first of [`PAIRS`], for palpus and for Coal, in a quick reproduction.
const QUICK_PAIR: [u32; 2] = [4000, 500];

/// The steps of [`plan`], in their order.
pub(super) const STEPS: [&str; 16] = [
    "doctor",
    "figures",
    "run",
    "depth",
    "feel",
    "sweep",
    "triangles",
    "contacts",
    PAIRS[0].0,
    PAIRS[1].0,
    PAIRS[2].0,
    PAIRS[3].0,
    PAIRS[4].0,
    PAIRS[5].0,
    "conformal",
    "convex",
];

/// Returns all steps, in the order in which they run.
pub(super) fn plan(wanted: &Wanted<'_>) -> Vec<Step> {
    let quick = wanted.quick;
    let mut steps = vec![doctor(wanted), figures(wanted), run(wanted)];
    let depth = wanted.palpus(&["bench", "depth", "--out"]).path(wanted.folder("depth"), "DIR/data/depth");
    let what = "penetration depth: smoothness, and proven bounds";
    steps.push(Step { is_quick: false, ..wanted.step("depth", what, 1.0, Ok(depth)) });
    let feel = wanted.palpus(&["bench", "feel", "--out"]).path(wanted.folder("feel"), "DIR/data/feel");
    let feel = if quick { feel.arg("--quick") } else { feel };
    let what = "what contact feels like: every method on every scene in every hand";
    steps.push(wanted.step("feel", what, if quick { 25.0 } else { 290.0 }, Ok(feel)));
    let cases = if quick { "40" } else { "400" };
    let sweep = wanted.palpus(&["bench", "feel", "--sweep", cases, "--out"]);
    let what = "random parts with play: hum, energy and overlap";
    steps.push(wanted.step(
        "sweep",
        what,
        if quick { 3.0 } else { 30.0 },
        Ok(sweep.path(wanted.folder("sweep"), "DIR/data/sweep")),
    ));
    steps.extend(scale(wanted));
    steps.extend(pairs(wanted));
    steps.push(conformal(wanted));
    steps.push(convex(wanted));
    steps
}

impl Wanted<'_> {
    /// Returns the folder of a step's files.
    pub(super) fn folder(&self, id: &str) -> PathBuf {
        self.out.join("data").join(id)
    }

    /// Returns a step that must succeed. It is quick if the whole reproduction is quick.
    fn step(&self, id: &'static str, what: &'static str, about: f64, command: Result<Invocation, String>) -> Step {
        Step { id, what, about, command, is_quick: self.quick, may_fail: false }
    }

    /// Returns this program with arguments.
    fn palpus(&self, arguments: &[&str]) -> Invocation {
        Invocation::new(program(), "palpus").args(arguments)
    }
}

/// Returns the path of this program. If the file has been replaced since the start, or Python runs
/// the program, the name of the program is returned.
fn program() -> PathBuf {
    let running = std::env::current_exe().ok().filter(|path| path.file_stem().is_some_and(|name| name == "palpus"));
    running.unwrap_or_else(|| "palpus".into())
}

fn doctor(wanted: &Wanted<'_>) -> Step {
    let seconds = if wanted.quick { "1.5" } else { "5" };
    let about = if wanted.quick { 8.0 } else { 20.0 };
    let command = Ok(wanted.palpus(&["doctor", "--json", "--duration", seconds]));
    Step { may_fail: true, ..wanted.step("doctor", "whether this machine holds 1 kHz", about, command) }
}

fn figures(wanted: &Wanted<'_>) -> Step {
    let command = wanted.palpus(&["bench", "figures", "--out"]).path(wanted.folder("figures"), "DIR/data/figures");
    let command = match wanted.models {
        Some(models) if !wanted.quick => command.arg("--models").path(models, "MODELS"),
        _ => command,
    };
    let about = if wanted.quick { 10.0 } else { 20.0 };
    let what = "the paper's Table 1 and Figures 4, 5 and 6";
    Step { is_quick: false, ..wanted.step("figures", what, about, Ok(command)) }
}

fn run(wanted: &Wanted<'_>) -> Step {
    let seconds = if wanted.quick { "3" } else { "10" };
    let about = if wanted.quick { 4.0 } else { 11.0 };
    let command = wanted
        .palpus(&["run", "spoon-cup", "--headless", "--duration", seconds, "--force", "--record"])
        .path(wanted.folder("run").join("run.csv"), "DIR/data/run/run.csv");
    wanted.step("run", "a spoon in a cup at 1 kHz in real time", about, Ok(command))
}

fn scale(wanted: &Wanted<'_>) -> Vec<Step> {
    let sweep = |id: &'static str, what, only: &str, about| {
        let command = wanted.palpus(&["bench", "scale", "--only", only, "--out"]);
        let command = command.path(wanted.folder(id), &format!("DIR/data/{id}"));
        let command = if wanted.quick { command.args(&["--ticks", "2000", "--passes", "2"]) } else { command };
        let too_long = wanted.quick && only == "triangles";
        let why = || "preparing 906 000 triangles takes longer than a quick reproduction".to_owned();
        wanted.step(id, what, about, if too_long { Err(why()) } else { Ok(command) })
    };
    let about = |full| if wanted.quick { 10.0 } else { full };
    vec![
        sweep("triangles", "the engine step against the number of triangles", "triangles", about(110.0)),
        sweep("contacts", "the engine step against the number of contacts", "contacts", about(30.0)),
    ]
}

fn pairs(wanted: &Wanted<'_>) -> Vec<Step> {
    let missing = if wanted.models.is_none() {
        Some("it needs --models FOLDER with the real meshes, which may not be distributed".to_owned())
    } else {
        script_missing("coal_scale.py", "numpy, coal")
    };
    let step = |k: usize| {
        let (id, name, ticks, about) = PAIRS[k];
        let [ticks, of_coal] = if wanted.quick { QUICK_PAIR } else { ticks };
        let command = match (&missing, wanted.models, wanted.quick && k > 0) {
            (Some(why), ..) => Err(why.clone()),
            (_, _, true) => Err("left out of a quick reproduction".to_owned()),
            (_, None, _) => Err(String::new()),
            (None, Some(models), false) => Ok(Invocation::new("python3", "python3")
                .arg("benches/peers/coal_scale.py")
                .path(program(), "palpus")
                .path(models, "MODELS")
                .arg("--out")
                .path(wanted.folder(id), &format!("DIR/data/{id}"))
                .args(&["--only", name, "--ticks", &ticks.to_string(), "--coal-ticks", &of_coal.to_string()])),
        };
        wanted.step(id, "the engine step compared with Coal's query on the same poses", about, command)
    };
    (0..PAIRS.len()).map(step).collect()
}

/// Times a nut that is pressed on its thread, and compares its wrench with the truth.
fn conformal(wanted: &Wanted<'_>) -> Step {
    let command = match wanted.models {
        None => Err("it needs --models FOLDER with the meshes of a nut and its bolt".to_owned()),
        Some(_) if wanted.quick => Err("left out of a quick reproduction".to_owned()),
        Some(models) => Ok(wanted
            .palpus(&["bench", "conformal", "--models"])
            .path(models, "MODELS")
            .args(&["--only", "nut", "--ticks", "2000", "--truths", "6", "--out"])
            .path(wanted.folder("conformal"), "DIR/data/conformal")),
    };
    wanted.step("conformal", "a nut pressed on its thread: time of a step, and error of the wrench", 70.0, command)
}

fn convex(wanted: &Wanted<'_>) -> Step {
    let with_peers = script_missing("convex_peers.py", "numpy, coal, mujoco");
    let has_cargo = runs("cargo", &["--version"]);
    let here = Path::new("crates/palpus/benches/convex/main.rs").is_file();
    let command = if wanted.quick {
        Err("left out of a quick reproduction: the bench has to be built first".to_owned())
    } else if !has_cargo || !here {
        Err("it needs cargo and a clone of palpus".to_owned())
    } else if with_peers.is_none() {
        Ok(Invocation::new("python3", "python3")
            .args(&["benches/peers/convex_peers.py", "--markdown"])
            .path(wanted.folder("convex").join("convex.md"), "DIR/data/convex/convex.md"))
    } else {
        Ok(Invocation::new("cargo", "cargo")
            .args(&["bench", "-q", "-p", "palpus", "--bench", "convex", "--", "--out"])
            .path(wanted.folder("convex").join("convex.csv"), "DIR/data/convex/convex.csv"))
    };
    wanted.step("convex", "convex pairs compared with parry, Coal and MuJoCo", 240.0, command)
}

/// Returns why a script of the source tree cannot run; `None` if it can.
fn script_missing(script: &str, modules: &str) -> Option<String> {
    if !Path::new("benches/peers").join(script).is_file() {
        return Some(format!("benches/peers/{script} is missing; run this in a clone of palpus"));
    }
    let can = runs("python3", &["-c", &format!("import {modules}")]);
    (!can).then(|| format!("python3 with {modules} is missing (pip install {})", modules.replace(',', "")))
}

fn runs(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_commands_contain_no_paths() {
        for quick in [false, true] {
            let wanted = Wanted { out: Path::new("/secret/out"), models: Some(Path::new("/secret/models")), quick };
            let steps = plan(&wanted);
            for step in &steps {
                if let Ok(command) = &step.command {
                    assert!(!command.shown.contains("/secret"), "{}", command.shown);
                    assert!(
                        command.shown.starts_with("palpus ")
                            || command.shown.contains("python3")
                            || command.shown.contains("cargo")
                    );
                }
            }
            assert_eq!(steps.iter().map(|step| step.id).collect::<Vec<_>>(), STEPS);
        }
    }

    #[test]
    fn planned_reproduction_takes_under_twenty_minutes() {
        let of = |quick| plan(&Wanted { out: Path::new("o"), models: Some(Path::new("m")), quick });
        let about = |quick| of(quick).iter().filter(|step| step.command.is_ok()).map(|step| step.about).sum::<f64>();
        assert!(about(false) < 1140.0 && about(true) < 110.0, "{} {}", about(false), about(true));
    }
}
