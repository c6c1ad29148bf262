//! `palpus run`: the closed loop.
//!
//! 1. The arguments and a stage become a [`Plan`] for each tool: device, thresholds, settings. The
//!    plans and an engine form a [`Ready`].
//! 2. A [`Session`] owns the servo thread and controls it through newest values.
//! 3. A window or a line in the terminal shows the session ([`live`]). The window can replace it by
//!    another session ([`crate::window`]).
//! 4. The summary is printed and the recording is plotted.

mod heavy;
mod keys;
mod live;
mod plan;
mod ready;
mod recordings;
mod replayed;
mod servo_thread;
mod session;
mod session_device;
#[cfg(test)]
mod session_tests;
mod watched;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
#[cfg(feature = "window")]
use std::sync::atomic::AtomicBool;
#[cfg(feature = "window")]
use std::time::{Duration, Instant};

use anyhow::bail;
use palpus_device::{RealTimeOptions, RunEnd};
use palpus_io::read_recording;
use serde::Serialize;

use crate::args::{RunArguments, file_policy};
use crate::interrupt::stop_at_signal;
use crate::recording::RecordingOptions;
use crate::summary::Summary;
use crate::{output, picture, plots, stage, summary, tools, window};

#[cfg(feature = "window")]
pub(crate) use heavy::words as words_of_heavy;
pub(crate) use live::Live;
pub(crate) use plan::Plan;
pub(crate) use ready::Ready;
pub(crate) use servo_thread::joined;
pub(crate) use session::{Beginning, Ended, Session};
#[cfg(feature = "window")]
pub(crate) use watched::WatchedTick;

pub(crate) fn run(arguments: &RunArguments) -> anyhow::Result<ExitCode> {
    if arguments.list {
        list();
        return Ok(ExitCode::SUCCESS);
    }
    let headless = window::reason_for_none(arguments);
    let (name, mut stage) = match &arguments.environment {
        Some(environment) => {
            let files = [arguments.scene.as_str(), environment];
            (stage::pair_name(files), stage::of_pair(files, &arguments.unit)?)
        }
        None => (arguments.scene.clone(), stage::prepare(&arguments.scene, file_policy(arguments.allow_outside))?),
    };
    if let Some(file) = &arguments.hand_path {
        stage.follow(file, arguments.hand_scale, arguments.hand_speed)?;
    }
    let mut ready = Ready::new(arguments, &name, stage, headless.is_none())?;
    if arguments.limits {
        ready.print_limits(arguments.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(at) = arguments.at {
        let tick = tick_at(at, arguments.duration.unwrap_or(DEFAULT_SECONDS), ready.plan().rate_hz)?;
        ready.engine.keep(tick);
    }
    let said_heavy = !arguments.json && ready.announce(arguments, headless)?;
    let stop = stop_at_signal();
    let ended = match headless {
        Some(_) => {
            let mut session = Session::start(ready, &beginning(arguments), &stop)?;
            if !arguments.json {
                session.tell_claims();
                live::watch(&mut session, &stop, None, said_heavy);
            }
            vec![session.wait()?]
        }
        None => window::run(arguments, ready, &stop)?,
    };
    finish(arguments, ended)
}

/// Default length of a run without a window, s.
const DEFAULT_SECONDS: f64 = 10.0;

/// Returns the tick at the time `at` (s), in a run of `seconds`.
fn tick_at(at: f64, seconds: f64, rate_hz: f64) -> anyhow::Result<u64> {
    if !(0.0..seconds).contains(&at) {
        bail!("--at {at} is not within the {seconds} s of the run; see --duration");
    }
    Ok((at * rate_hz).round() as u64)
}

/// Returns true if this end of a run is a failure of the command.
fn has_failed(end: &RunEnd) -> bool {
    matches!(end, RunEnd::DeviceFailed(_) | RunEnd::Panicked(_) | RunEnd::Faulted(_))
}

fn list() {
    for scene in palpus_scenes::scenes() {
        output::line(format!("{:12} {}", scene.name, scene.summary));
    }
}

/// Returns the start options of a run, from its arguments.
pub(crate) fn beginning(arguments: &RunArguments) -> Beginning<'_> {
    Beginning {
        record: (!arguments.no_record).then_some(arguments.record.as_path()),
        claims: (!arguments.fast && !arguments.no_realtime).then(RealTimeOptions::default),
        paused: false,
        watched: false,
        keep: RecordingOptions { overwrite: arguments.keep.force, limit: arguments.keep.record_limit.0 },
        fault_log: arguments.keep.fault_log(),
    }
}

/// Continues a session in the terminal, because no window could be opened for it.
#[cfg(feature = "window")]
pub(crate) fn go_on_without_window(
    arguments: &RunArguments,
    mut session: Session,
    why: &str,
    stop: &AtomicBool,
) -> anyhow::Result<Ended> {
    output::note(format!("no window could be opened here ({why}); headless"));
    let end = arguments.duration.is_none().then(|| Instant::now() + Duration::from_secs_f64(DEFAULT_SECONDS));
    live::watch(&mut session, stop, end, false);
    session.wait()
}

/// Prints the summaries of the runs, one after the other.
fn finish(arguments: &RunArguments, ended: Vec<Ended>) -> anyhow::Result<ExitCode> {
    let mut failed = false;
    let strict = !arguments.lenient && arguments.fault.is_empty();
    for run in ended {
        run.notes.iter().for_each(output::note);
        report(arguments, &run)?;
        for complaint in run.devices.iter().filter_map(|device| device.summary.complaint(run.rate_hz)) {
            let advice = if strict { "; --lenient accepts this, and `palpus doctor` gives advice" } else { "" };
            output::note(format!("note: {complaint}{advice}"));
            failed |= strict;
        }
        failed |= run.devices.iter().any(|device| has_failed(&device.end));
        if let Some(file) = &arguments.screenshot {
            let Ended { name, stage, engine, settings, rate_hz, .. } = run;
            let moment = engine.shown(1.0 / rate_hz);
            picture::write_run(&name, &stage, settings.limits.torque, moment, file, &arguments.picture)?;
        }
    }
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Summaries and recordings of all devices. The first device's summary is at the top level of the
/// document, as in a run with one device. The other summaries are below the names of their tools.
#[derive(Serialize)]
struct Summaries<'a> {
    #[serde(flatten)]
    first: &'a Summary,
    #[serde(flatten)]
    others: BTreeMap<Cow<'static, str>, &'a Summary>,
    /// Files; the first device's files come first.
    recordings: Vec<&'a Path>,
}

fn report(arguments: &RunArguments, run: &Ended) -> anyhow::Result<()> {
    if arguments.json {
        let recordings = run.devices.iter().flat_map(|device| &device.recordings).map(|file| &**file).collect();
        let others = run.devices.iter().enumerate().skip(1);
        let others = others.map(|(k, device)| (tools::name(k), &device.summary)).collect();
        return output::json(&Summaries { first: &run.devices[0].summary, others, recordings });
    }
    for (k, device) in run.devices.iter().enumerate() {
        if run.devices.len() > 1 {
            output::line(format!("{:>14}", format!("{} hand", tools::name(k))));
        }
        summary::print(&device.summary);
    }
    for (k, device) in run.devices.iter().enumerate() {
        let name = if k == 0 { run.name.clone() } else { format!("{}, {} hand", run.name, tools::name(k)) };
        device.recordings.iter().for_each(|file| report_recording(&name, file, k == 0));
    }
    Ok(())
}

/// Size of the largest recording that is plotted, bytes. A plot needs the whole recording in
/// memory.
const MOST_PLOTTED: u64 = 500_000_000;

/// Plots a recording of the scene `name`. Prints the paths of recording and plot, and the command
/// for a replay. Errors are printed and do not affect the run's result.
fn report_recording(name: &str, file: &Path, with_replay: bool) {
    if std::fs::metadata(file).is_ok_and(|file| file.len() > MOST_PLOTTED) {
        output::line(format!("{:>14}  {} (too large for a plot)", "recorded", file.display()));
        return;
    }
    let recording = match read_recording(file) {
        Ok(recording) => recording,
        Err(error) => return output::note(format!("note: {error}")),
    };
    if let Some(notice) = &recording.notice {
        output::note(format!("note: {notice}"));
    }
    if recording.rows.len() > 1 {
        let plot = file.with_extension("svg");
        let plotted = match plots::write_svg(&plots::run_figure(name, &recording.rows), &plot) {
            Ok(()) => format!("(plot: {})", plot.display()),
            Err(error) => format!("(no plot: {error:#})"),
        };
        output::line(format!("{:>14}  {} {plotted}", "recorded", file.display()));
        // A recording from a later tick on cannot be replayed.
        if with_replay && recording.rows[0].tick == 0 {
            output::line(format!("{:>14}  palpus replay {}", "again", file.display()));
        }
    }
}
