//! `palpus run`: the closed loop.
//!
//! 1. What was typed and a stage become a [`Plan`]: device, thresholds, settings.
//! 2. A plan becomes a [`Session`], which owns the servo thread and is steered by newest values.
//! 3. A window or a line in the terminal shows it ([`live`]); the window may have it followed by another one ([`crate::window`]).
//! 4. What it was like is printed and plotted.

mod live;
mod plan;
mod replayed;
mod servo_thread;
mod session;
#[cfg(test)]
mod session_tests;

use std::process::ExitCode;
#[cfg(feature = "window")]
use std::sync::atomic::AtomicBool;
#[cfg(feature = "window")]
use std::time::{Duration, Instant};

use anyhow::bail;
use palpus_device::{RealTimeOptions, RunEnd};
use palpus_io::read_recording;

use crate::args::{RunArguments, file_policy};
use crate::interrupt::stop_at_ctrl_c;
use crate::{output, picture, plots, safety, stage, summary, two, window};

pub(crate) use live::Live;
pub(crate) use plan::Plan;
pub(crate) use servo_thread::joined;
pub(crate) use session::{Beginning, Ended, Session};

pub(crate) fn run(arguments: &RunArguments) -> anyhow::Result<ExitCode> {
    if arguments.list {
        list();
        return Ok(ExitCode::SUCCESS);
    }
    let headless = window::reason_for_none(arguments);
    let mut stage = stage::prepare(&arguments.scene, file_policy(arguments.allow_outside))?;
    if let Some(file) = &arguments.hand_path {
        stage.follow(file, arguments.hand_scale, arguments.hand_speed)?;
    }
    if stage.second.is_some() {
        return two::run(arguments, stage, &stop_at_ctrl_c());
    }
    for (given, name) in [(&arguments.second_device, "--second-device"), (&arguments.second_hand, "--second-hand")] {
        if given.is_some() {
            bail!("{name} needs a scene with a second tool, such as two-hands; {} has one tool", arguments.scene);
        }
    }
    let plan = Plan::new(arguments, &arguments.scene, stage, headless.is_none())?;
    if arguments.limits {
        safety::print(plan.spec(), &plan.limits, arguments.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut engine = plan.engine(headless.is_none())?;
    if let Some(at) = arguments.at {
        engine.keep(tick_at(at, arguments.duration.unwrap_or(DEFAULT_SECONDS), plan.rate_hz)?);
    }
    if !arguments.json {
        plan.announce(arguments, headless);
    }
    let stop = stop_at_ctrl_c();
    let ended = match headless {
        Some(_) => {
            let mut session = Session::start(plan, engine, &beginning(arguments), &stop)?;
            if !arguments.json {
                session.tell_claims();
                live::watch(&mut session, &stop, None);
            }
            vec![session.wait()?]
        }
        None => window::run(arguments, plan, engine, &stop)?,
    };
    finish(arguments, ended)
}

/// How long a run without a window goes when nobody says, s.
const DEFAULT_SECONDS: f64 = 10.0;

/// The tick that `--at` names, in a run of so many seconds.
pub(crate) fn tick_at(at: f64, seconds: f64, rate_hz: f64) -> anyhow::Result<u64> {
    if !(0.0..seconds).contains(&at) {
        bail!("--at {at} is not within the {seconds} s of the run; see --duration");
    }
    Ok((at * rate_hz).round() as u64)
}

/// True if a run that ended so is a failure of the command.
pub(crate) fn has_failed(end: &RunEnd) -> bool {
    matches!(end, RunEnd::DeviceFailed(_) | RunEnd::Panicked(_) | RunEnd::Faulted(_))
}

fn list() {
    for scene in palpus_scenes::scenes() {
        output::line(format!("{:12} {}", scene.name, scene.summary));
    }
}

/// How a run begins that was typed so.
pub(crate) fn beginning(arguments: &RunArguments) -> Beginning<'_> {
    Beginning {
        record: (!arguments.no_record).then_some(arguments.record.as_path()),
        claims: (!arguments.fast && !arguments.no_realtime).then(RealTimeOptions::default),
        paused: false,
    }
}

/// Goes on in the terminal with a session for which no window could be opened.
#[cfg(feature = "window")]
pub(crate) fn go_on_without_window(
    arguments: &RunArguments,
    mut session: Session,
    why: &str,
    stop: &AtomicBool,
) -> anyhow::Result<Ended> {
    output::note(format!("no window could be opened here ({why}); headless"));
    let end = arguments.duration.is_none().then(|| Instant::now() + Duration::from_secs_f64(DEFAULT_SECONDS));
    live::watch(&mut session, stop, end);
    session.wait()
}

/// Says what the runs were like, one after the other.
fn finish(arguments: &RunArguments, ended: Vec<Ended>) -> anyhow::Result<ExitCode> {
    let mut failed = false;
    for run in ended {
        run.notes.iter().for_each(output::note);
        report(arguments, &run)?;
        if let Some(file) = &arguments.screenshot {
            let Ended { name, stage, engine, settings, rate_hz, .. } = run;
            let moment = engine.shown(1.0 / rate_hz);
            picture::write_run(&name, &stage, settings.limits.torque, moment, file, &arguments.picture)?;
        }
        failed |= has_failed(&run.end);
    }
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn report(arguments: &RunArguments, run: &Ended) -> anyhow::Result<()> {
    if arguments.json {
        return output::json(&run.summary);
    }
    summary::print(&run.summary);
    for file in &run.recordings {
        let plot = file.with_extension("svg");
        let recording = read_recording(file)?;
        if recording.rows.len() > 1 {
            plots::write_svg(&plots::run_figure(&run.name, &recording.rows), &plot)?;
            output::line(format!("{:>14}  {} (plot: {})", "recorded", file.display(), plot.display()));
            // What came before its first tick is not in it.
            if recording.rows[0].tick == 0 {
                output::line(format!("{:>14}  palpus replay {}", "again", file.display()));
            }
        }
    }
    Ok(())
}
