//! A run under way: the servo thread, and what it is steered by.
//!
//! Whoever has the session sets the newest settings, guides the simulated hand, pauses and steps, begins and ends recordings, reads the
//! newest numbers, and ends the run. None of it makes the servo thread wait.
//!
//! **Recordings.** A recording that begins with the run can be replayed bit for bit, changes of settings included. One that begins later cannot: what
//! engine, tool, friction and safety chain remember at that tick is not in it. They could be made to forget it all; but then friction would let go, the tool
//! be put where the device is, even behind a wall, and the force fall away and ramp up again, and all that because somebody wanted to
//! record what he felt. So such a recording keeps the numbers of its ticks, from which `palpus replay` sees
//! what it is and says so. Who wants to replay lets the run be recorded from its beginning, as it is if nobody says otherwise.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::thread::JoinHandle;

use palpus::render::{Settings, SettingsError};
use palpus_device::{DeviceSpec, Guide, RealTimeClaims, RealTimeOptions, Reins, RunEnd, leave_core};
use palpus_io::scene::CouplingMode;

use super::seat::{EndedSeat, Seat, Taken, preset};
use super::servo_thread::{ServoThread, Turned, Work, joined};
use super::{Live, Ready};
use crate::files;
use crate::recording::{self, Keep};
use crate::safety;
use crate::stage::Stage;
use crate::stopped::Stopped;
use crate::summary::Summary;
use crate::two::NAMES;

/// s for which a key is taken to be held after it was told: several frames of a window.
const HOLD_TIME: f64 = 0.3;

/// A run under way.
pub(crate) struct Session {
    name: String,
    stage: Stage,
    rate_hz: f64,
    first: Seat,
    second: Option<Seat>,
    reins: Arc<Reins>,
    claims: Option<RealTimeClaims>,
    thread: JoinHandle<Turned>,
}

/// How a run begins.
#[derive(Clone, Copy, Default)]
pub(crate) struct Beginning<'a> {
    /// Recorded to this file, or to one with a number if there is such a file and it is not to be written over; a second device to one beside it.
    pub(crate) record: Option<&'a Path>,
    /// What the servo thread asks of the system.
    pub(crate) claims: Option<RealTimeOptions>,
    /// It waits before its first tick.
    pub(crate) paused: bool,
    /// How recordings are kept.
    pub(crate) keep: Keep,
    /// Where faults are logged: `None` for no log, `Some(None)` for that of the user.
    pub(crate) fault_log: Option<Option<&'a Path>>,
}

/// What a run was like.
pub(crate) struct Ended {
    pub(crate) name: String,
    pub(crate) stage: Stage,
    pub(crate) rate_hz: f64,
    pub(crate) settings: Settings,
    pub(crate) summary: Summary,
    pub(crate) end: RunEnd,
    /// Files that were recorded.
    pub(crate) recordings: Vec<PathBuf>,
    /// What it was like for a second device.
    pub(crate) second: Option<EndedSeat>,
    /// As it is after its last step.
    pub(crate) engine: Stopped,
    /// What else there is to say.
    pub(crate) notes: Vec<String>,
}

impl Session {
    /// Starts the loop on a thread of its own. It ends when its duration is over, when it is told to, or with `stop`.
    pub(crate) fn start(ready: Ready, beginning: &Beginning<'_>, stop: &Arc<AtomicBool>) -> anyhow::Result<Self> {
        let Beginning { record, claims, paused, keep, .. } = *beginning;
        let plan = ready.plan();
        let (name, rate_hz, script) = (plan.name.clone(), plan.rate_hz, plan.script.clone());
        let (first, second, working, work, stage) = match ready {
            Ready::One(run) => {
                let (plan, mut engine) = *run;
                let record = record.map(|file| if keep.overwrite { file.to_owned() } else { recording::free(file) });
                let files = record.as_deref().map(|file| (file, None));
                let Taken { seat, working, newest, stage } =
                    Seat::take(plan, 0, files, engine.crease_angle(), beginning)?;
                engine.steer(newest);
                (seat, None, working, Work::One(Box::new(engine)), stage)
            }
            Ready::Two(run) => {
                let ([plan, other], mut engine) = *run;
                let record = record.map(|file| {
                    if keep.overwrite {
                        [file.to_owned(), files::beside(file, NAMES[1])]
                    } else {
                        recording::free_pair(file)
                    }
                });
                let files = record.as_ref().map(|[file, beside]| (file.as_path(), beside.as_path()));
                let crease_angle = engine.crease_angle();
                let first = Seat::take(plan, 0, files.map(|(one, other)| (one, Some(other))), crease_angle, beginning)?;
                let second =
                    Seat::take(other, 1, files.map(|(one, other)| (other, Some(one))), crease_angle, beginning)?;
                engine.steer([first.newest, second.newest]);
                let work = Work::Two(Box::new((engine, second.working)));
                (first.seat, Some(second.seat), first.working, work, first.stage)
            }
        };
        let reins = working.servo.reins();
        reins.pause(paused);
        let work = ServoThread { working, work, script, claims, stop: Arc::clone(stop) };
        let (granted, grants) = mpsc::channel();
        let thread = std::thread::Builder::new().name("servo".to_owned()).spawn(move || work.turn(&granted))?;
        let claims = grants.recv().ok().flatten();
        Ok(Self { name, stage, rate_hz, first, second, reins, claims, thread })
    }

    /// Says what the system granted.
    pub(crate) fn tell_claims(&self) {
        if let Some(claims) = &self.claims {
            safety::tell_claims(claims);
        }
    }

    /// The newest numbers: the first device's, with the faults of both.
    pub(crate) fn live(&mut self) -> Live {
        let live = *self.first.live.get();
        let of_second = self.second.as_mut().map_or(0, |second| second.live.get().faults);
        Live { faults: live.faults + of_second, ..live }
    }

    /// Pauses it, takes it on by single ticks, brings keys.
    pub(crate) fn reins(&self) -> Arc<Reins> {
        Arc::clone(&self.reins)
    }

    /// The loop has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// What it was like, when it is over.
    pub(crate) fn wait(self) -> anyhow::Result<Ended> {
        let Turned { first, second, engine } = joined(self.thread.join())?;
        let claims = self.claims.as_ref();
        let settings = self.first.settings;
        let (EndedSeat { summary, end, recordings }, mut notes) = self.first.end(first, claims, self.rate_hz);
        let mut of_second = None;
        if let Some((seat, worked)) = self.second.zip(second) {
            let (ended, more) = seat.end(worked, claims, self.rate_hz);
            notes.extend(more);
            of_second = Some(ended);
        }
        let Self { name, stage, rate_hz, .. } = self;
        Ok(Ended { name, stage, rate_hz, settings, summary, end, recordings, second: of_second, engine, notes })
    }
}

/// What only who has more than a terminal asks for.
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "a terminal steers nothing"))]
impl Session {
    /// Keeps the calling thread, and all that it starts from now on, off the servo thread's core, if that has one.
    pub(crate) fn leave_core(&self) {
        if let Some(claims) = &self.claims {
            leave_core(claims);
        }
    }

    /// Ends the loop before its next tick, and answers what it was like.
    pub(crate) fn end(self) -> anyhow::Result<Ended> {
        self.reins.end();
        self.wait()
    }

    /// What the first device says of itself.
    pub(crate) fn spec(&self) -> &DeviceSpec {
        &self.first.spec
    }

    /// What is run.
    pub(crate) fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The engine's settings from the next tick on, of the first device's tool.
    pub(crate) fn settings(&self) -> &Settings {
        &self.first.settings
    }

    /// Sets them. What the engine's memory, the device and the grip decide stays what it is: capacity, time budget, limits, grip and the crease angle
    /// of shading; the tool's skin is never wider than the tolerance. A second device's tool gets the same but for its coupling, which is there
    /// or not as the first one's is, and as its own device needs it.
    pub(crate) fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        let of_second = self.second.as_ref().map(|second| second.fit_of_other(settings));
        if let Some(settings) = &of_second {
            settings.validate()?;
        }
        self.first.set(&self.first.fit(settings))?;
        if let Some((second, settings)) = self.second.as_mut().zip(of_second) {
            second.set(&settings)?;
        }
        Ok(())
    }

    /// Settings by name: palpus's own for this scene on this device, and the paper's.
    pub(crate) fn presets(&self) -> [(&'static str, Settings); 2] {
        let of = |mode| preset(&self.stage, &self.first.spec, self.rate_hz, mode);
        [("palpus", of(CouplingMode::Coupled)), ("paper", of(CouplingMode::Direct))]
    }

    /// True if there is a simulated hand that can be moved. Of two it is the first.
    pub(crate) fn can_guide(&self) -> bool {
        self.first.guide.is_some()
    }

    /// Has the simulated hand hold the probe at a pose (of its mesh's frame, world), let go of it, or follow
    /// its script again. Does nothing unless [`Self::can_guide`].
    pub(crate) fn guide(&mut self, probe: Guide) {
        let grip_a = self.first.settings.grip_a;
        if let Some(guide) = &mut self.first.guide {
            guide.publish(match probe {
                Guide::Held(pose) => Guide::Held(pose.with_origin(grip_a)),
                other => other,
            });
        }
    }

    /// A person at the window holds the key for force, or does not. To be told again and again while it is held.
    pub(crate) fn hold(&self, held: bool) {
        let ticks = if held { (HOLD_TIME * self.rate_hz) as u64 } else { 0 };
        self.reins.hold(ticks);
    }

    /// The file that is being recorded to; of two devices the first one's.
    pub(crate) fn recording(&self) -> Option<&Path> {
        self.first.recordings.path()
    }

    /// What went wrong with the recording, if something did.
    #[cfg(feature = "window")]
    pub(crate) fn trouble(&self) -> Option<String> {
        self.first.recordings.trouble().or_else(|| self.second.as_ref().and_then(|second| second.recordings.trouble()))
    }

    /// Begins a recording with the next tick, in a file beside the one called `base` or in that, and not in one that exists; of two devices in two.
    /// Ends the one that is under way.
    pub(crate) fn record(&mut self, base: &Path) -> anyhow::Result<PathBuf> {
        self.stop_recording()?;
        let Some(second) = &mut self.second else {
            let path = files::free(base);
            self.first.recordings.begin(path.clone(), None, &self.first.settings)?;
            return Ok(path);
        };
        let [path, beside] = files::free_pair(base, NAMES[1]);
        self.first.recordings.begin(path.clone(), Some(&beside), &self.first.settings)?;
        let begun = second.recordings.begin(beside, Some(&path), &second.settings);
        if begun.is_err() {
            self.stop_recording()?;
        }
        begun.map(|()| path)
    }

    /// Ends the recording that is under way; answers its file.
    pub(crate) fn stop_recording(&mut self) -> anyhow::Result<Option<PathBuf>> {
        if let Some(second) = &mut self.second {
            second.recordings.stop()?;
        }
        self.first.recordings.stop()
    }
}
