//! Shows a recording: in a window with a time line of the whole run, or one tick as a picture.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::bail;
use palpus_io::Recording;

use crate::args::ReplayArguments;
use crate::picture;
use crate::plots::seconds;
use crate::rerun::Rerun;
use crate::rerun::places::Places;

/// Draws the tick at `--at`, or the last tick.
pub(crate) fn write_tick(
    recording: &Recording,
    places: &Places<'_>,
    arguments: &ReplayArguments,
    file: &Path,
) -> anyhow::Result<()> {
    let (stage, mut again) = Rerun::new(recording, places)?;
    let wanted = chosen_tick(recording, arguments.at)?;
    let settings = again.first().header.scene.render;
    again.keep(wanted as u64);
    again.run(&mut |k, _| if k == wanted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })?;
    let moment = again.shown(1.0 / recording.header.rate_hz);
    picture::write_run(&name(recording), &stage, settings.limits.torque, moment, file, &arguments.picture)
}

/// Returns the last tick that is not after `at` seconds; without `at`, the last tick.
fn chosen_tick(recording: &Recording, at: Option<f64>) -> anyhow::Result<usize> {
    let Some(last) = recording.rows.last() else { bail!("the recording has no ticks") };
    let end = seconds(last);
    match at {
        None => Ok(recording.rows.len() - 1),
        Some(at) if (0.0..=end).contains(&at) => {
            Ok(recording.rows.partition_point(|row| seconds(row) <= at).saturating_sub(1))
        }
        Some(at) => bail!("--at {at}: the recording goes from 0 to {end:.3} s"),
    }
}

/// Returns the name of the recorded scene.
fn name(recording: &Recording) -> String {
    use palpus_io::record::SceneSource;
    match &recording.header.scene.source {
        SceneSource::BuiltIn(name) => name.clone(),
        SceneSource::File(path) => picture::model_name(Path::new(path)),
    }
}

/// Alternatives without a window.
#[cfg(feature = "window")]
const INSTEAD: &str = "--screenshot FILE --at S makes a picture without one";

/// Prints only the line with the alternatives, because this build has no windows.
#[cfg(not(feature = "window"))]
pub(crate) fn show(_: &Recording, _: &Places<'_>, _: &ReplayArguments) -> anyhow::Result<()> {
    crate::view_window::expect_one("--screenshot FILE --at S makes a picture without one")
}

#[cfg(feature = "window")]
pub(crate) use here::show;

#[cfg(feature = "window")]
mod here {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use palpus_device::{Cuts, latest_of};
    use palpus_io::RecordRow;
    use palpus_window::{Look, Moment, Moments, Replayed, ReplayedTick, Scene, Theme};

    use super::*;
    use crate::rerun::one::is_late;
    use crate::seen::Seen;
    use crate::stage::Stage;
    use crate::view_window;

    /// Memory limit of the shown ticks: ten minutes with thirty contacts fit. For longer runs,
    /// every second tick is dropped.
    const MOST_BYTES: usize = 1 << 30;

    /// Shows a recording in a window while a thread replays it.
    pub(crate) fn show(recording: &Recording, places: &Places<'_>, arguments: &ReplayArguments) -> anyhow::Result<()> {
        view_window::expect_one(INSTEAD)?;
        let (stage, again) = Rerun::new(recording, places)?;
        let begin = match arguments.at {
            Some(at) => chosen_tick(recording, Some(at))?,
            None => 0,
        };
        let moments = Arc::new(Moments::new(MOST_BYTES));
        let replayed = Replayed {
            scene: scene(recording, again.first(), &stage),
            ticks: ticks(recording, again.first()),
            moments: Arc::clone(&moments),
            begin,
        };
        let gone = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                if let Err(error) = run_behind(recording, again, &moments, &gone) {
                    moments.fail(format!("{error:#}"));
                }
            });
            let shown = view_window::show_replay(replayed, INSTEAD);
            gone.store(true, Ordering::Relaxed);
            shown
        })
    }

    /// Replays the recording until its end, or until the window is closed.
    fn run_behind(
        recording: &Recording,
        mut again: Rerun<'_>,
        moments: &Moments,
        gone: &AtomicBool,
    ) -> anyhow::Result<()> {
        let capacity = again.capacity();
        let (publisher, mut newest) = latest_of(move || Moment::new(capacity));
        again.publish(publisher);
        again.run(&mut |k, wrench| {
            moments.push(newest.get(), recording.rows[k].same_wrench(wrench));
            if gone.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    }

    /// Returns the scene. `first` is the recording of the tool that is drawn as the probe.
    fn scene(recording: &Recording, first: &Recording, stage: &Stage) -> Scene {
        let look = Look { xray: true, ..Look::default() };
        let limits = recording.header.scene.render.limits;
        let largest =
            recording.rows.iter().map(|row| row.wrench.force.length()).filter(|f| f.is_finite()).fold(0.0, f64::max);
        Scene {
            // The largest force of the run is drawn with the longest arrow.
            force_scale: if largest > 0.0 { largest } else { limits.force },
            torque_scale: limits.torque,
            title: name(recording),
            ..Seen::of(stage).scene(first.rows[0].pose, Theme::Dark, look)
        }
    }

    fn ticks(recording: &Recording, first: &Recording) -> Vec<ReplayedTick> {
        let tick = |(k, row): (usize, &RecordRow)| {
            let RecordRow { wrench, contacts, clusters, separation, query_us, total_us, faults, .. } = *row;
            ReplayedTick {
                time: seconds(row),
                pose: first.rows.get(k).unwrap_or(row).pose,
                force: wrench.force.length(),
                torque: wrench.torque.length(),
                contacts,
                clusters,
                separation,
                query: query_us * 1e-6,
                total: total_us * 1e-6,
                late: is_late(row.servo.as_ref()),
                cuts: Cuts::from_bits(faults),
            }
        };
        recording.rows.iter().enumerate().map(tick).collect()
    }
}
