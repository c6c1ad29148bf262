//! The window beside a run, where there is a display and the program was built with one (feature `window`).

use palpus::render::Settings;

use crate::args::RunArguments;
use crate::engine::Engine;
use crate::stage::Stage;

/// Why a run goes without a window; none if it may have one.
pub(crate) fn reason_for_none(arguments: &RunArguments) -> Option<&'static str> {
    let asked = [
        (arguments.headless, "as asked"),
        (arguments.json, "for --json"),
        (arguments.fast, "for --fast"),
        (arguments.screenshot.is_some(), "for --screenshot"),
    ];
    asked.into_iter().find(|(asked, _)| *asked).map(|(_, why)| why).or(here::reason_for_none())
}

#[cfg(feature = "window")]
pub(crate) use here::Numbers;
pub(crate) use here::Window;

#[cfg(feature = "window")]
mod here {
    use std::path::{Path, PathBuf};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use palpus::algebra::Pose;
    use palpus_device::{DeviceSpec, Newest, SimulationSettings, latest_of};
    pub(crate) use palpus_window::Numbers;
    use palpus_window::{
        Cap, FileKind, Loading, Look, Moment, Preset, Run, Scene, ShownBody, Solid, Theme, Unit, Wanted, has_display,
        open,
    };

    use super::{Engine, Settings, Stage};

    pub(super) fn reason_for_none() -> Option<&'static str> {
        (!has_display()).then_some("no display")
    }

    /// What a window needs, made before the loop runs.
    pub(crate) struct Window {
        scene: Scene,
        moments: Newest<Moment>,
        settings: Settings,
        closes: bool,
    }

    impl Window {
        /// A window on `engine`, which from now on leaves its newest moment for it. `closes`: with the end of the run.
        pub(crate) fn on(name: &str, stage: &Stage, settings: &Settings, engine: &mut Engine, closes: bool) -> Self {
            let capacity = settings.capacity;
            let (publisher, moments) = latest_of(move || Moment::new(capacity));
            engine.publish(publisher);
            let colours = ShownBody::colours(Theme::Dark);
            let shown = |body, pose, colour, translucent| ShownBody {
                solid: Arc::new(Solid::of_body(body)),
                pose,
                colour,
                look: Look { translucent, ..Look::default() },
            };
            let start = stage.path.pose(0.0);
            let scene = Scene {
                bodies: vec![
                    shown(&stage.probe, start, colours[0], false),
                    shown(&stage.environment, stage.environment_pose, colours[1], true),
                ],
                moment_pose: stage.environment_pose,
                // An arrow of a quarter of the limit is as long as arrows are in pictures; larger forces are longer.
                force_scale: 0.25 * settings.limits.force,
                torque_scale: settings.limits.torque,
                title: name.to_owned(),
                unit: Unit::Metre,
                ..Scene::default()
            };
            Self { scene, moments, settings: *settings, closes }
        }

        /// Shows it until the user closes it, on the main thread.
        pub(crate) fn show(
            self,
            numbers: &mut dyn FnMut() -> Numbers,
            over: &AtomicBool,
            stop: &AtomicBool,
        ) -> Result<(), String> {
            let spec = SimulationSettings::default().spec;
            let mut run = Watched { numbers, over, stop, closes: self.closes, settings: self.settings, spec };
            open(self.scene, self.moments, &mut run).map_err(|error| error.to_string())
        }
    }

    /// A run that can be watched, and no more.
    struct Watched<'a> {
        numbers: &'a mut dyn FnMut() -> Numbers,
        over: &'a AtomicBool,
        stop: &'a AtomicBool,
        closes: bool,
        settings: Settings,
        spec: DeviceSpec,
    }

    const NOT_YET: &str = "this run cannot be steered yet";

    impl Run for Watched<'_> {
        fn numbers(&mut self) -> Numbers {
            (self.numbers)()
        }

        fn device(&self) -> &DeviceSpec {
            &self.spec
        }

        fn settings(&self) -> Settings {
            self.settings
        }

        fn set_settings(&mut self, _: &Settings) -> Result<(), String> {
            Err(NOT_YET.to_owned())
        }

        fn presets(&self) -> Vec<Preset> {
            vec![Preset { name: "palpus", settings: self.settings }]
        }

        fn can_guide(&self) -> bool {
            false
        }

        fn guide(&mut self, _: Option<Pose>) {}

        fn cap(&mut self) -> Cap {
            Cap::None
        }

        fn pause(&mut self, _: bool) -> Result<(), String> {
            Err(NOT_YET.to_owned())
        }

        fn is_paused(&self) -> bool {
            false
        }

        fn step(&mut self, _: u64) {}

        fn record(&mut self, _: bool) -> Result<PathBuf, String> {
            Err(NOT_YET.to_owned())
        }

        fn recording(&self) -> Option<PathBuf> {
            None
        }

        fn scenes(&self) -> Vec<(String, String)> {
            Vec::new()
        }

        fn reader(&self) -> fn(&Path) -> Result<FileKind, String> {
            |_| Err(NOT_YET.to_owned())
        }

        fn load(&mut self, _: Wanted) -> Result<(), String> {
            Err(NOT_YET.to_owned())
        }

        fn loading(&mut self) -> Loading {
            Loading::Idle
        }

        fn replaced(&mut self) -> Option<(Scene, Newest<Moment>)> {
            None
        }

        fn is_over(&self) -> bool {
            self.over.load(Ordering::Relaxed)
        }

        fn closes_when_over(&self) -> bool {
            self.closes || self.stop.load(Ordering::Relaxed)
        }
    }
}

#[cfg(not(feature = "window"))]
mod here {
    use std::sync::atomic::AtomicBool;

    use super::{Engine, Settings, Stage};

    pub(super) fn reason_for_none() -> Option<&'static str> {
        Some("built without the window: --no-default-features leaves it out")
    }

    /// There is none.
    pub(crate) enum Window {}

    impl Window {
        pub(crate) fn on(_: &str, _: &Stage, _: &Settings, _: &mut Engine, _: bool) -> Self {
            unreachable!("a program without the window gives a reason for it before every run")
        }

        pub(crate) fn show(self, _: &mut dyn FnMut() -> Numbers, _: &AtomicBool, _: &AtomicBool) -> Result<(), String> {
            match self {}
        }
    }

    /// Nothing reads them.
    pub(crate) struct Numbers;

    impl From<crate::run::Live> for Numbers {
        fn from(_: crate::run::Live) -> Self {
            Self
        }
    }
}
