//! The window of a run, if there is a display and the program was built with the feature `window`.
//!
//! The window runs on the main thread. It draws what the servo thread publishes, and sends its
//! requests to a [`steered::Steered`], which owns the session. The requests concern settings, the
//! hand, pauses, recordings, and a next scene, which a background thread prepares ([`loading`]).

#[cfg(feature = "window")]
mod caps;
#[cfg(feature = "window")]
mod compare;
#[cfg(feature = "window")]
mod dropped;
#[cfg(feature = "window")]
mod loading;
#[cfg(feature = "window")]
mod recent;
#[cfg(feature = "window")]
mod saved;
#[cfg(feature = "window")]
mod settings_text;
#[cfg(feature = "window")]
mod steered;
#[cfg(all(feature = "window", test))]
mod steered_tests;

use crate::args::RunArguments;

/// Returns why a run has no window; `None` if it may have a window.
pub(crate) fn reason_for_none(arguments: &RunArguments) -> Option<&'static str> {
    let asked = [
        (arguments.headless, "as asked"),
        (arguments.json, "for --json"),
        (arguments.fast, "for --fast"),
        (arguments.screenshot.is_some(), "for --screenshot"),
    ];
    asked.into_iter().find(|(asked, _)| *asked).map(|(_, why)| why).or(here::reason_for_none())
}

pub(crate) use here::run;

#[cfg(feature = "window")]
mod here {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use palpus_device::{Newest, latest_of};
    use palpus_window::{Look, Moment, Scene, Theme, has_display, open};

    use super::recent::Recent;
    use super::steered::Steered;
    use crate::args::RunArguments;
    use crate::run::{self, Beginning, Ended, Plan, Ready, Session};
    use crate::seen::Seen;

    pub(super) fn reason_for_none() -> Option<&'static str> {
        (!has_display()).then_some("no display")
    }

    /// Runs `ready`, and further runs, in a window until the window is closed. If no window can be
    /// opened, the run is in the terminal.
    pub(crate) fn run(arguments: &RunArguments, ready: Ready, stop: &Arc<AtomicBool>) -> anyhow::Result<Vec<Ended>> {
        let (session, scene, moments) = begin(ready, &run::beginning(arguments), stop)?;
        session.tell_claims();
        let mut steered = Steered::new(arguments, session, Recent::of_user(), stop);
        match open(scene, moments, &mut steered) {
            Ok(()) => steered.end(),
            Err(why) => match steered.into_session() {
                Some(session) => Ok(vec![run::go_on_without_window(arguments, session, &why.to_string(), stop)?]),
                None => anyhow::bail!("no window could be opened here ({why})"),
            },
        }
    }

    /// Starts a session with a display. The calling thread draws, and keeps off the loop's core
    /// from then on. Without a graphics card, the graphics library starts threads, which keep off
    /// this core too.
    pub(super) fn begin(
        mut ready: Ready,
        beginning: &Beginning<'_>,
        stop: &Arc<AtomicBool>,
    ) -> anyhow::Result<(Session, Scene, Newest<Moment>)> {
        let capacity = ready.engine.capacity();
        let (publisher, moments) = latest_of(move || Moment::new(capacity));
        ready.engine.publish(publisher);
        let scene = scene(ready.plan());
        let session = Session::start(ready, &Beginning { watched: true, ..*beginning }, stop)?;
        session.leave_core();
        Ok((session, scene, moments))
    }

    /// Returns the content of the window before the run.
    fn scene(plan: &Plan) -> Scene {
        let (stage, limits) = (&plan.stage, &plan.settings.limits);
        let look = Look { xray: true, ..Look::default() };
        Scene {
            // A quarter of the force limit has the usual arrow length. Larger forces have longer
            // arrows.
            force_scale: 0.25 * limits.force,
            torque_scale: limits.torque,
            title: plan.name.clone(),
            ..Seen::of(stage).scene(stage.path.pose(0.0), Theme::Dark, look)
        }
    }
}

#[cfg(not(feature = "window"))]
mod here {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use crate::args::RunArguments;
    use crate::run::{Ended, Ready};

    pub(super) fn reason_for_none() -> Option<&'static str> {
        Some("built without the window (--no-default-features)")
    }

    pub(crate) fn run(_: &RunArguments, _: Ready, _: &Arc<AtomicBool>) -> anyhow::Result<Vec<Ended>> {
        unreachable!("a program without the window gives a reason for it before every run")
    }
}
