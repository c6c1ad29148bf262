//! A running session: the servo thread and its controls.
//!
//! The owner of a session sets the newest settings, guides the simulated hand, pauses and steps,
//! starts and ends recordings, reads the newest numbers, and ends the run. None of these makes the
//! servo thread wait.
//!
//! **Recordings.** A recording that begins with the run can be replayed bit for bit, including
//! changes of settings. A recording that begins later cannot be replayed, because it lacks the
//! state of engine, tool, friction and safety chain at its first tick. To reset this state would
//! release friction, move the tool to the device (even behind a wall) and ramp the force again,
//! which the user would feel. A recording that begins later keeps the run's tick numbers, by which
//! `palpus replay` recognises it. For a replay, record the run from its beginning, which is the
//! default.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::thread::JoinHandle;

use palpus::render::{Settings, SettingsError};
use palpus_device::{DeviceSpec, Guide, HelperThread, RealTimeClaims, RealTimeOptions, RunControl, Servo, leave_core};
use palpus_io::scene::CouplingMode;

use super::servo_thread::{ServoResults, ServoThread, joined};
use super::session_device::{EndedDevice, SessionDevice, preset};
use super::watched::WatchedTick;
use super::{Live, Ready};
use crate::engine::Engine;
use crate::output;
use crate::recording::{self, RecordingOptions};
use crate::safety;
use crate::stage::Stage;
use crate::untouched::Untouched;

/// Time for which a key counts as held after each message, s: several frames of a window.
const HOLD_TIME: f64 = 0.3;

/// A running session.
pub(crate) struct Session {
    name: String,
    stage: Stage,
    rate_hz: f64,
    /// The devices. The window shows and controls the first device.
    devices: Vec<SessionDevice>,
    control: Arc<RunControl>,
    claims: Option<RealTimeClaims>,
    thread: JoinHandle<ServoResults>,
    /// Takes part in the steps of close-fitting parts.
    helper: Option<HelperThread>,
}

/// Options of the start of a run.
#[derive(Clone, Copy, Default)]
pub(crate) struct Beginning<'a> {
    /// File of the recording of the first device. If this file exists and must not be overwritten,
    /// the recording gets a number. The recordings of other devices are in the same folder.
    pub(crate) record: Option<&'a Path>,
    /// Real-time options that the servo thread asks for.
    pub(crate) claims: Option<RealTimeOptions>,
    /// True if the loop waits before its first tick.
    pub(crate) paused: bool,
    /// True if every tick of the first device is kept for [`Session::watched`].
    pub(crate) watched: bool,
    /// Options of the recordings.
    pub(crate) keep: RecordingOptions,
    /// File of the fault log: `None` for no log, `Some(None)` for the user's default.
    pub(crate) fault_log: Option<Option<&'a Path>>,
}

/// Results of a run.
pub(crate) struct Ended {
    pub(crate) name: String,
    pub(crate) stage: Stage,
    pub(crate) rate_hz: f64,
    /// Engine settings of the first device's tool.
    pub(crate) settings: Settings,
    /// Results for each device.
    pub(crate) devices: Vec<EndedDevice>,
    /// The engine after its last step.
    pub(crate) engine: Engine,
    /// Further messages.
    pub(crate) notes: Vec<String>,
}

impl Session {
    /// Starts the loop on its own thread. The loop ends after its duration, on request, or with
    /// `stop`.
    pub(crate) fn start(ready: Ready, beginning: &Beginning<'_>, stop: &Arc<AtomicBool>) -> anyhow::Result<Self> {
        let Beginning { record, claims, paused, keep, .. } = *beginning;
        let Ready { plans, mut engine } = ready;
        let (name, rate_hz) = (plans[0].name.clone(), plans[0].rate_hz);
        let (script, options) = (plans[0].script.clone(), plans[0].options);
        let safeties = plans.iter().skip(1).map(|plan| plan.options.safety);
        let servo = safeties.fold(Servo::new(options), |servo, safety| servo?.with_device(safety))?;
        let files = record.map(|file| recording::of_run(file, plans.len(), &keep));
        let crease_angle = engine.crease_angle();
        let (mut devices, mut working, mut stages) = (Vec::new(), Vec::new(), Vec::new());
        for (which, plan) in plans.into_iter().enumerate() {
            let taken = SessionDevice::take(plan, which, files.as_deref(), crease_angle, beginning)?;
            engine.steer(which, taken.newest);
            devices.push(taken.device);
            working.push(taken.working);
            stages.push(taken.stage);
        }
        let stage = stages.swap_remove(0);
        let control = servo.control();
        control.pause(paused);
        let (wanted, helper) = (claims, engine.helper());
        let work = ServoThread { servo, working, engine, script, claims, stop: Arc::clone(stop) };
        let (granted, grants) = mpsc::channel();
        let thread = std::thread::Builder::new().name("servo".to_owned()).spawn(move || work.turn(&granted))?;
        let claims = grants.recv().ok().flatten();
        let helper = wanted.and_then(|wanted| HelperThread::start(helper, wanted.priority, claims.as_ref()));
        Ok(Self { name, stage, rate_hz, devices, control, claims, thread, helper })
    }

    /// Prints the real-time rights that the system granted.
    pub(crate) fn tell_claims(&self) {
        if let Some(claims) = &self.claims {
            safety::tell_claims(claims);
        }
        if self.helper.is_some() {
            output::note("real time: a second thread helps with close-fitting parts");
        }
    }

    /// Returns the newest numbers of the first device, with the faults of all devices.
    pub(crate) fn live(&mut self) -> Live {
        let faults = self.devices.iter_mut().map(|device| device.live.get().faults).sum();
        Live { faults, ..*self.devices[0].live.get() }
    }

    /// Returns the run control, which pauses the loop, runs single ticks and passes keys.
    pub(crate) fn control(&self) -> Arc<RunControl> {
        Arc::clone(&self.control)
    }

    /// True if the loop has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for the end and returns the results.
    pub(crate) fn wait(self) -> anyhow::Result<Ended> {
        let ServoResults { worked, engine } = joined(self.thread.join())?;
        let settings = self.devices[0].settings;
        let scripted = self.devices[0].guide.is_some();
        let (mut devices, mut notes) = (Vec::new(), Vec::new());
        for (device, worked) in self.devices.into_iter().zip(worked) {
            let (ended, more) = device.end(worked, self.claims.as_ref(), self.rate_hz);
            devices.push(ended);
            notes.extend(more);
        }
        let Self { name, stage, rate_hz, .. } = self;
        let first: &mut EndedDevice = &mut devices[0];
        if first.summary.is_untouched() {
            let why = Untouched::of(&stage).reason(scripted, first.summary.duration_s);
            first.summary.no_contact = Some(why);
        }
        Ok(Ended { name, stage, rate_hz, settings, devices, engine, notes })
    }
}

/// Functions for the window.
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "a terminal steers nothing"))]
impl Session {
    /// Keeps the calling thread, and all threads that it starts later, off the servo thread's core,
    /// if the servo thread has its own core.
    pub(crate) fn leave_core(&self) {
        if let Some(claims) = &self.claims {
            leave_core(claims);
        }
    }

    /// Ends the loop before its next tick, and returns the results.
    pub(crate) fn end(self) -> anyhow::Result<Ended> {
        self.control.end();
        self.wait()
    }

    /// Returns the first device's new ticks, oldest first, if it is watched.
    pub(crate) fn watched(&mut self) -> impl Iterator<Item = WatchedTick> + '_ {
        self.devices[0].watched.iter_mut().flat_map(|queue| std::iter::from_fn(|| queue.pop().ok()))
    }

    /// Returns the ticks per second.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Returns the description of the first device.
    pub(crate) fn spec(&self) -> &DeviceSpec {
        &self.devices[0].spec
    }

    /// Returns the stage.
    pub(crate) fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Returns the settings of the first device's tool from the next tick on.
    pub(crate) fn settings(&self) -> &Settings {
        &self.devices[0].settings
    }

    /// Changes the settings. Capacity, time budget, limits, grip and the crease angle of shading
    /// stay the same, because the engine's memory, the device and the grip decide them. The tool's
    /// contact offset is at most the tolerance. Other devices' tools get the same settings except
    /// for the coupling: their coupling is switched on or off with the first tool's coupling, and
    /// has the values for their own devices.
    pub(crate) fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        let fit = |(k, device): (usize, &SessionDevice)| {
            if k == 0 { device.fit(settings) } else { device.fit_of_other(settings) }
        };
        let fit: Vec<Settings> = self.devices.iter().enumerate().map(fit).collect();
        fit.iter().try_for_each(Settings::validate)?;
        self.devices.iter_mut().zip(&fit).try_for_each(|(device, settings)| device.set(settings))
    }

    /// Returns the settings `wanted`, limited to what the first device's tool allows.
    pub(crate) fn fitted(&self, wanted: &Settings) -> Settings {
        self.devices[0].fit(wanted)
    }

    /// Returns settings by name: palpus's own for this scene on this device, and the paper's.
    pub(crate) fn presets(&self) -> [(&'static str, Settings); 2] {
        let of = |mode| preset(&self.stage, &self.devices[0].spec, self.rate_hz, mode);
        [("palpus", of(CouplingMode::Coupled)), ("paper", of(CouplingMode::Direct))]
    }

    /// True if there is a simulated hand that can be moved. If there are several hands, the first
    /// hand is moved.
    pub(crate) fn can_guide(&self) -> bool {
        self.devices[0].guide.is_some()
    }

    /// Lets the simulated hand hold the probe at a pose (of its mesh's frame, world), release it,
    /// or follow its script again. Does nothing unless [`Self::can_guide`].
    pub(crate) fn guide(&mut self, probe: Guide) {
        let grip_a = self.devices[0].settings.grip_a;
        if let Some(guide) = &mut self.devices[0].guide {
            guide.publish(match probe {
                Guide::Held(pose) => Guide::Held(pose.with_origin(grip_a)),
                other => other,
            });
        }
    }

    /// Sets whether a person at the window holds the key for force. Call it repeatedly while the
    /// key is held.
    pub(crate) fn hold(&self, held: bool) {
        let ticks = if held { (HOLD_TIME * self.rate_hz) as u64 } else { 0 };
        self.control.hold(ticks);
    }

    /// Returns the file of the current recording of the first device.
    pub(crate) fn recording(&self) -> Option<&Path> {
        self.devices[0].recordings.path()
    }

    /// Returns the error of the recording, if any.
    #[cfg(feature = "window")]
    pub(crate) fn trouble(&self) -> Option<String> {
        self.devices.iter().find_map(|device| device.recordings.trouble())
    }

    /// Starts a recording of each device with the next tick. The file is `base`, or a new name in
    /// the same folder if `base` exists. Ends the current recording. Returns the first device's
    /// file.
    pub(crate) fn record(&mut self, base: &Path) -> anyhow::Result<PathBuf> {
        self.stop_recording()?;
        let files = recording::free(base, self.devices.len());
        let begun = self.devices.iter_mut().try_for_each(|device| device.recordings.begin(&files, &device.settings));
        if begun.is_err() {
            self.stop_recording()?;
        }
        begun.map(|()| files[0].clone())
    }

    /// Ends the current recording; returns the first device's file.
    pub(crate) fn stop_recording(&mut self) -> anyhow::Result<Option<PathBuf>> {
        let stopped: Vec<_> =
            self.devices.iter_mut().map(|device| device.recordings.stop()).collect::<Result<_, _>>()?;
        Ok(stopped.into_iter().next().flatten())
    }
}
