//! Executes the window's requests: controls the session, and starts the next session.
//!
//! A requested scene or mesh is prepared while the current run goes on ([`Loader`]). Then the
//! current run ends and the next run begins, with a recording if the current run has one. A
//! simulated device is created before the current run ends, so that a failure leaves this run as it
//! is. Hardware can be opened only once, so it is released first.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};

use anyhow::anyhow;
use palpus::render::Settings;
use palpus_device::{DeviceSpec, Guide, Newest};
use palpus_io::record::SceneSource;
use palpus_io::scene::FilePolicy;
use palpus_window::{
    Cap, ComparedTick, FileKind, Loading, Moment, Numbers, Painted, Preset, Run, Scene, SeenTick, Start, Wanted,
};

use super::caps::Caps;
use super::compare::Comparison;
use super::dropped::{self, Present};
use super::here::begin;
use super::loading::{Loader, Tell, one_line};
use super::recent::Recent;
use super::{saved, settings_text};
use crate::args::{RunArguments, file_policy};
use crate::bodies::Teller;
use crate::numbers::number_of;
use crate::output;
use crate::run::{self, Beginning, Ended, Live, Ready, Session, WatchedTick};
use crate::stage::{self, Stage};
use crate::untouched::Untouched;

/// Shortest time before a missing contact is reported, s. The hand has then followed its path once.
const SOON_TOUCHES: f64 = 5.0;

/// A run that the window steers.
pub(super) struct Steered<'a> {
    arguments: &'a RunArguments,
    stop: &'a Arc<AtomicBool>,
    /// `None` only if a device could not be opened again.
    session: Option<Session>,
    ended: Vec<Ended>,
    loader: Loader<Preparation>,
    /// The next scene and its moments, until the window takes them.
    next: Option<(Scene, Newest<Moment>)>,
    /// Device, settings and numbers of the session, as last shown.
    spec: DeviceSpec,
    settings: Settings,
    live: Live,
    /// True if the terminal has the message about a heavy pair.
    said_heavy: bool,
    /// The comparison run with other settings.
    comparison: Option<Comparison>,
    /// The background search for the reason of a missing contact.
    untouched: Option<Receiver<String>>,
    recent: Recent,
    /// True if the window chose the start: of the current run, and of the next run.
    is_moved: [bool; 2],
    /// Files that are being loaded; they enter the list of recent files if loading succeeds.
    opened: Vec<PathBuf>,
    cap: Caps,
}

/// Result of a preparation.
enum Preparation {
    /// A stage and its name. The device is not open yet, and may first lead the probe out.
    Stage { name: String, stage: Box<Stage>, lead_out: bool },
    /// A run with its open device.
    Run(Box<Ready>),
}

impl<'a> Steered<'a> {
    pub(super) fn new(
        arguments: &'a RunArguments,
        mut session: Session,
        recent: Recent,
        stop: &'a Arc<AtomicBool>,
    ) -> Self {
        Self {
            arguments,
            stop,
            ended: Vec::new(),
            loader: Loader::new(),
            next: None,
            spec: session.spec().clone(),
            settings: *session.settings(),
            live: session.live(),
            said_heavy: false,
            comparison: None,
            untouched: None,
            recent,
            is_moved: [false; 2],
            opened: Vec::new(),
            cap: Caps::default(),
            session: Some(session),
        }
    }

    /// Ends the current run and returns all runs.
    pub(super) fn end(mut self) -> anyhow::Result<Vec<Ended>> {
        self.end_session()?;
        Ok(self.ended)
    }

    /// Returns the current run.
    pub(super) fn into_session(self) -> Option<Session> {
        self.session
    }

    fn end_session(&mut self) -> anyhow::Result<()> {
        self.comparison = None;
        if let Some(session) = self.session.take() {
            self.ended.push(session.end()?);
        }
        Ok(())
    }

    /// Ends the present run and begins the next run.
    fn follow(&mut self, next: Preparation) -> anyhow::Result<()> {
        let recorded = self.session.as_ref().is_some_and(|session| session.recording().is_some());
        self.end_session()?;
        let ready = match next {
            Preparation::Run(ready) => *ready,
            Preparation::Stage { name, stage, lead_out } => {
                let arguments = RunArguments { lead_out, ..self.arguments.clone() };
                Ready::new(&arguments, &name, *stage, true)?
            }
        };
        let record = recorded.then_some(self.arguments.record.as_path());
        // Earlier recordings of this window are kept.
        let mut beginning = Beginning { record, ..run::beginning(self.arguments) };
        beginning.keep.overwrite = false;
        let (session, scene, moments) = begin(ready, &beginning, self.stop)?;
        (self.spec, self.settings) = (session.spec().clone(), *session.settings());
        self.session = Some(session);
        self.untouched = None;
        self.said_heavy = false;
        self.is_moved[0] = self.is_moved[1];
        self.next = Some((scene, moments));
        Ok(())
    }

    /// Prepares the requested scene while the current run goes on. `text`: of a scene that has no
    /// file.
    fn begin_loading(&mut self, wanted: Wanted, text: Option<String>, start: Option<Start>) -> Result<(), String> {
        let session = self.session.as_ref().ok_or("the run is over")?;
        let lead_out = self.arguments.lead_out || start.is_some_and(|start| start.lead_out);
        let arguments = RunArguments { lead_out, ..self.arguments.clone() };
        let present = Present::of(session.stage());
        let words = match &wanted {
            Wanted::Scene(name) => format!("preparing {name}"),
            Wanted::SceneFile(file) => format!("reading {}", file.display()),
            Wanted::Meshes { .. } => "reading meshes".to_owned(),
        };
        self.loader.begin(&words, move |tell| {
            prepared(&wanted, text.as_deref(), start.as_ref(), &present, &arguments, tell)
        })?;
        self.is_moved[1] = start.is_some_and(|start| start.probe.is_some());
        Ok(())
    }

    fn session(&mut self) -> Result<&mut Session, String> {
        self.session.as_mut().filter(|session| !session.is_over()).ok_or_else(|| "the run is over".to_owned())
    }
}

/// Prepares the requested scene on its own thread.
fn prepared(
    wanted: &Wanted,
    text: Option<&str>,
    start: Option<&Start>,
    present: &Present,
    arguments: &RunArguments,
    tell: Tell<'_>,
) -> anyhow::Result<Preparation> {
    let (name, policy) = match wanted {
        Wanted::Scene(name) => (name.clone(), FilePolicy::Inside),
        Wanted::SceneFile(file) => (file.display().to_string(), file_policy(arguments.allow_outside)),
        Wanted::Meshes { probe, environment } => {
            let scene = present.with(probe.as_ref(), environment.as_ref(), &scenes_folder(arguments))?;
            (scene.display().to_string(), FilePolicy::Inside)
        }
    };
    let calls = |body: &str, done: f64| tell(&format!("preparing {body}"), Some(done));
    let teller = Teller::Calls(&calls);
    let mut stage = match text {
        Some(text) => stage::of_pair_again(Path::new(&name), text, &teller)?,
        None => stage::prepare_telling(&name, policy, &teller)?,
    };
    if let Some(start) = start {
        saved::begin_at(&mut stage, start)?;
    }
    tell("preparing the run", None);
    let is_hardware = |device: &String| device != "sim" && !device.starts_with("replay:");
    let mut devices = arguments.device.iter().chain(&arguments.second_device);
    if devices.any(is_hardware) {
        return Ok(Preparation::Stage { name, stage: Box::new(stage), lead_out: arguments.lead_out });
    }
    Ready::new(arguments, &name, stage, true).map(|ready| Preparation::Run(Box::new(ready)))
}

/// Returns the folder for scenes that are made in the window, next to the recordings.
fn scenes_folder(arguments: &RunArguments) -> PathBuf {
    arguments.record.parent().unwrap_or(Path::new("")).join("scenes")
}

impl Run for Steered<'_> {
    fn numbers(&mut self) -> Numbers {
        if let Some(session) = &mut self.session {
            self.live = session.live();
        }
        let live = self.live;
        if let Some(words) = run::words_of_heavy(&live).filter(|_| !self.said_heavy) {
            self.said_heavy = true;
            output::note(words);
        }
        Numbers {
            ticks: live.ticks,
            rate_hz: live.rate_hz,
            time: live.time,
            force: live.force,
            torque: live.torque,
            query: live.query_ns as f64 * 1e-9,
            force_time: live.force_ns as f64 * 1e-9,
            load: live.load,
            carried: live.carried,
            overruns: live.overruns,
            faults: live.faults,
            contacts: live.contacts,
            clusters: live.clusters,
            separation: live.separation,
            cuts: live.cuts,
            phase: live.phase,
            way_out: live.way_out.map(|out| out.way),
        }
    }

    fn ticks(&mut self, each: &mut dyn FnMut(SeenTick)) {
        let Some(session) = &mut self.session else { return };
        let batch: Vec<WatchedTick> = session.watched().collect();
        for tick in &batch {
            each(SeenTick {
                time: tick.time,
                force: tick.wrench.force,
                torque: tick.wrench.torque,
                query: tick.query_ns as f64 * 1e-9,
                force_time: tick.force_ns as f64 * 1e-9,
                contacts: tick.contacts,
                separation: tick.separation,
            });
        }
        if let Some(comparison) = &self.comparison {
            comparison.give(batch);
        }
    }

    fn compare(&mut self, with: Option<&Settings>) -> Result<(), String> {
        // Ends the thread of the previous comparison first.
        self.comparison = None;
        let (Some(settings), Some(session)) = (with, &self.session) else { return Ok(()) };
        let settings = session.fitted(settings);
        let begun = Comparison::begin(session.stage(), &settings, session.rate_hz());
        self.comparison = Some(begun.map_err(|error| one_line(&error))?);
        Ok(())
    }

    fn compared(&mut self, each: &mut dyn FnMut(ComparedTick)) -> Option<&Moment> {
        self.comparison.as_mut().and_then(|comparison| comparison.take(each))
    }

    fn settings_as_toml(&self) -> String {
        let metres_per_unit = self.session.as_ref().map_or(1.0, |session| session.stage().recorded.metres_per_unit);
        settings_text::toml(&self.settings(), metres_per_unit)
    }

    fn device(&self) -> &DeviceSpec {
        &self.spec
    }

    fn settings(&self) -> Settings {
        self.session.as_ref().map_or(self.settings, |session| *session.settings())
    }

    fn set_settings(&mut self, settings: &Settings) -> Result<(), String> {
        self.session()?.set_settings(settings).map_err(|error| error.to_string())
    }

    fn presets(&self) -> Vec<Preset> {
        let presets = self.session.as_ref().map(Session::presets);
        presets.into_iter().flatten().map(|(name, settings)| Preset { name, settings }).collect()
    }

    fn can_guide(&self) -> bool {
        self.session.as_ref().is_some_and(Session::can_guide)
    }

    fn guide(&mut self, guide: Guide) {
        if let Some(session) = &mut self.session {
            session.guide(guide);
        }
    }

    fn hold(&mut self, held: bool) {
        if let Some(session) = &self.session {
            session.hold(held);
        }
    }

    fn start(&self) -> Option<String> {
        self.live.start_in_words("press F4")
    }

    fn waits_for(&self) -> Option<String> {
        self.live.way_out.map(|out| format!("{}, or F4", out.words()))
    }

    fn untouched(&mut self) -> Option<String> {
        if let Some(receiver) = &self.untouched {
            return receiver.try_recv().ok();
        }
        let seconds = self.live.time;
        let session = self.session.as_ref().filter(|_| !self.live.touched)?;
        if seconds < SOON_TOUCHES.max(session.stage().path.duration()) {
            return None;
        }
        let untouched = Untouched::of(session.stage());
        let (tell, receiver) = channel();
        // Many queries on large meshes take longer than a frame.
        let work = move || tell.send(untouched.reason(true, seconds));
        let begun = session.can_guide() && std::thread::Builder::new().spawn(work).is_ok();
        self.untouched = begun.then_some(receiver);
        None
    }

    fn cap(&mut self) -> Cap {
        if !self.can_guide() {
            return Cap::None;
        }
        self.cap.get()
    }

    fn pause(&mut self, paused: bool) -> Result<(), String> {
        self.session()?.control().pause(paused);
        Ok(())
    }

    fn is_paused(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.control().is_paused())
    }

    fn step(&mut self, ticks: u64) {
        if let Some(session) = &self.session {
            session.control().step(ticks);
        }
    }

    fn record(&mut self, on: bool) -> Result<PathBuf, String> {
        let base = &self.arguments.record;
        let session = self.session.as_mut().filter(|session| !(on && session.is_over())).ok_or("the run is over")?;
        let file = if on {
            session.record(base)
        } else {
            session.stop_recording().and_then(|file| file.ok_or_else(|| anyhow!("nothing is being recorded")))
        };
        file.map_err(|error| one_line(&error))
    }

    fn recording(&self) -> Option<PathBuf> {
        self.session.as_ref().and_then(Session::recording).map(Path::to_owned)
    }

    fn recording_trouble(&self) -> Option<String> {
        self.session.as_ref().and_then(Session::trouble)
    }

    fn scenes(&self) -> Vec<(String, String)> {
        palpus_scenes::scenes().iter().map(|scene| (scene.name.to_owned(), scene.summary.to_owned())).collect()
    }

    fn reader(&self) -> fn(&Path) -> Result<FileKind, String> {
        dropped::kind
    }

    fn load(&mut self, wanted: Wanted) -> Result<(), String> {
        let opened = match &wanted {
            Wanted::Scene(_) => Vec::new(),
            Wanted::SceneFile(file) => vec![file.clone()],
            Wanted::Meshes { probe, environment } => {
                environment.iter().chain(probe).map(|opened| opened.file.clone()).collect()
            }
        };
        self.begin_loading(wanted, None, None)?;
        self.opened = opened;
        Ok(())
    }

    fn restart(&mut self, at: Option<Start>) -> Result<(), String> {
        let session = self.session.as_ref().ok_or("the run is over")?;
        let wanted = match &session.stage().recorded.source {
            SceneSource::BuiltIn(name) => Wanted::Scene(name.clone()),
            SceneSource::File(path) => Wanted::SceneFile(PathBuf::from(path)),
        };
        let text = session.stage().text_without_file().map(str::to_owned);
        self.begin_loading(wanted, text, at)
    }

    fn save(&mut self) -> Result<PathBuf, String> {
        let session = self.session.as_ref().ok_or("the run is over")?;
        let saved = saved::save(session.stage(), session.settings(), self.is_moved[0], &scenes_folder(self.arguments));
        let file = saved.map_err(|error| one_line(&error))?;
        self.recent.add(&file);
        Ok(file)
    }

    fn recent(&self) -> Vec<PathBuf> {
        self.recent.files()
    }

    fn loading(&mut self) -> Loading {
        if let Some(result) = self.loader.take() {
            let result = result.and_then(|next| self.follow(next));
            let opened = std::mem::take(&mut self.opened);
            if result.is_ok() {
                opened.iter().for_each(|file| self.recent.add(file));
            }
            self.loader.end(result);
        }
        self.loader.progress()
    }

    fn replaced(&mut self) -> Option<(Scene, Newest<Moment>)> {
        self.next.take()
    }

    fn is_over(&self) -> bool {
        self.session.as_ref().is_none_or(Session::is_over)
    }

    fn closes_when_over(&self) -> bool {
        self.arguments.duration.is_some() || self.stop.load(Ordering::Relaxed)
    }

    fn painted(&mut self, painted: Painted) {
        let Painted { rate_hz, renderer, triangles, samples, .. } = painted;
        output::note(format!(
            "window: {rate_hz:.1} frames/s of {triangles} triangles, {} in each pixel, drawn by {renderer}",
            number_of(samples.into(), "sample")
        ));
    }
}
