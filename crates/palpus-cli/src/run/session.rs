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
use std::time::{Duration, Instant};

use anyhow::anyhow;
use palpus::render::{Clustering, Settings, SettingsError};
use palpus_device::{
    DeviceSpec, Guide, HapticDevice, Newest, Publisher, RealTimeClaims, RealTimeOptions, Reins, RunEnd, SafetyLimits,
    Servo, latest, leave_core,
};
use palpus_io::RecordingHeader;
use palpus_io::scene::CouplingMode;

use super::servo_thread::{Log, ORDERS, Order, ServoThread, Turned, joined};
use super::{Live, Plan};
use crate::engine::Engine;
use crate::recording::{Recording, Rows, Writing};
use crate::stage::Stage;
use crate::summary::{Gatherer, Summary};
use crate::{files, safety};

/// A run under way.
pub(crate) struct Session {
    name: String,
    stage: Stage,
    spec: DeviceSpec,
    rate_hz: f64,
    limits: SafetyLimits,
    /// Those of the next tick.
    settings: Settings,
    crease_angle: Option<f64>,
    asked: Publisher<Settings>,
    guide: Option<Publisher<Guide>>,
    live: Newest<Live>,
    reins: Arc<Reins>,
    recordings: Recordings,
    claims: Option<RealTimeClaims>,
    thread: JoinHandle<Turned>,
}

/// How a run begins.
#[derive(Clone, Copy, Default)]
pub(crate) struct Beginning<'a> {
    /// Recorded to this file, which is overwritten.
    pub(crate) record: Option<&'a Path>,
    /// What the servo thread asks of the system.
    pub(crate) claims: Option<RealTimeOptions>,
    /// It waits before its first tick.
    pub(crate) paused: bool,
}

/// What a run was like.
pub(crate) struct Ended {
    pub(crate) name: String,
    pub(crate) stage: Stage,
    pub(crate) rate_hz: f64,
    pub(crate) settings: Settings,
    pub(crate) summary: Summary,
    pub(crate) end: RunEnd,
    /// As it is after its last step.
    pub(crate) engine: Engine,
    /// Files that were recorded.
    pub(crate) recordings: Vec<PathBuf>,
    /// What else there is to say.
    pub(crate) notes: Vec<String>,
}

impl Session {
    /// Starts the loop on a thread of its own. It ends when its duration is over, when it is told to, or with `stop`.
    pub(crate) fn start(
        plan: Plan,
        mut engine: Engine,
        beginning: &Beginning<'_>,
        stop: &Arc<AtomicBool>,
    ) -> anyhow::Result<Self> {
        let Beginning { record, claims, paused } = *beginning;
        let stop = Arc::clone(stop);
        let Plan { name, stage, rate_hz, options, limits, settings, device, guide, script, header, .. } = plan;
        let servo = Servo::new(options)?;
        let (reins, spec) = (servo.reins(), device.spec().clone());
        reins.pause(paused);
        let (asked, newest) = latest(settings);
        let crease_angle = engine.crease_angle();
        engine.steer(newest);
        let (publisher, live) = latest(Live::new(rate_hz));
        let (mut recordings, orders, over) = Recordings::new(header);
        let rows = record.map(|path| recordings.start(path.to_owned(), &settings)).transpose()?;
        let log = Log { rows, in_force: settings, orders, over };
        let live_end = (publisher, Live::new(rate_hz));
        let gatherer = Gatherer::new()?;
        let work = ServoThread { servo, engine, device, script, gatherer, log, live: live_end, claims, stop };
        let (granted, grants) = mpsc::channel();
        let thread = std::thread::Builder::new().name("servo".to_owned()).spawn(move || work.turn(&granted))?;
        let claims = grants.recv().ok().flatten();
        Ok(Self {
            name,
            stage,
            spec,
            rate_hz,
            limits,
            settings,
            crease_angle,
            asked,
            guide,
            live,
            reins,
            recordings,
            claims,
            thread,
        })
    }

    /// Says what the system granted.
    pub(crate) fn tell_claims(&self) {
        if let Some(claims) = &self.claims {
            safety::tell_claims(claims);
        }
    }

    /// The newest numbers.
    pub(crate) fn live(&mut self) -> Live {
        *self.live.get()
    }

    /// The loop has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// What it was like, when it is over.
    pub(crate) fn wait(self) -> anyhow::Result<Ended> {
        let Turned { statistics, gatherer, engine } = joined(self.thread.join())?;
        let (recordings, notes) = self.recordings.finish()?;
        Ok(Ended {
            name: self.name,
            stage: self.stage,
            rate_hz: self.rate_hz,
            settings: self.settings,
            summary: gatherer.finish(&statistics, &self.limits, self.claims.as_ref()),
            end: statistics.end,
            engine,
            recordings,
            notes,
        })
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

    /// What the device says of itself.
    pub(crate) fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// What is run.
    pub(crate) fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The engine's settings from the next tick on.
    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Sets them. What the engine's memory, the device and the grip decide stays what it is: capacity, time budget, limits, grip and the crease angle
    /// of shading; the tool's skin is never wider than the tolerance.
    pub(crate) fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        let Settings { capacity, time_budget, limits, grip_a, .. } = self.settings;
        let mut settings = Settings { capacity, time_budget, limits, grip_a, ..*settings };
        if let (Some(shading), Some(crease_angle)) = (&mut settings.shading, self.crease_angle) {
            shading.crease_angle = crease_angle;
        }
        if let Some(coupling) = &mut settings.coupling {
            coupling.skin = coupling.skin.min(settings.contact_tolerance);
        }
        settings.validate()?;
        if settings != self.settings {
            self.settings = settings;
            self.asked.publish(settings);
        }
        Ok(())
    }

    /// Settings by name: palpus's own for this scene on this device, and the paper's.
    pub(crate) fn presets(&self) -> [(&'static str, Settings); 2] {
        let of = |mode, clustering| Settings { clustering, ..self.stage.settings_in(mode, &self.spec, self.rate_hz) };
        [
            ("palpus", of(CouplingMode::Coupled, Clustering::Smooth)),
            ("paper", of(CouplingMode::Direct, Clustering::Linkage)),
        ]
    }

    /// True if there is a simulated hand that can be moved.
    pub(crate) fn can_guide(&self) -> bool {
        self.guide.is_some()
    }

    /// Moves the simulated hand; `None` when there is none that can be moved.
    pub(crate) fn guide(&mut self) -> Option<&mut Publisher<Guide>> {
        self.guide.as_mut()
    }

    /// Pauses it, takes it on by single ticks.
    pub(crate) fn reins(&self) -> &Reins {
        &self.reins
    }

    /// The file that is being recorded to.
    pub(crate) fn recording(&self) -> Option<&Path> {
        self.recordings.writing.as_ref().map(Writing::path)
    }

    /// Begins a recording with the next tick, in a file beside the one called `base` or in that, and not in one that exists. Ends the one that is under way.
    pub(crate) fn record(&mut self, base: &Path) -> anyhow::Result<PathBuf> {
        self.stop_recording()?;
        let path = files::free(base);
        let rows = self.recordings.start(path.clone(), &self.settings)?;
        let ordered = self.recordings.order(Some((rows, self.settings)));
        if ordered.is_err() {
            self.recordings.writing = None;
        }
        ordered.map(|()| path)
    }

    /// Ends the recording that is under way; answers its file.
    pub(crate) fn stop_recording(&mut self) -> anyhow::Result<Option<PathBuf>> {
        self.recordings.stop()
    }
}

/// The recordings of a session, one after the other.
struct Recordings {
    header: RecordingHeader,
    orders: rtrb::Producer<Order>,
    over: rtrb::Consumer<Rows>,
    writing: Option<Writing>,
    written: Vec<PathBuf>,
    notes: Vec<String>,
}

/// For so long the servo thread may be waited for to put a recording down: many ticks; a paused loop does not answer.
const PATIENCE: Duration = Duration::from_millis(50);

impl Recordings {
    /// And the servo thread's ends of the queues.
    fn new(header: RecordingHeader) -> (Self, rtrb::Consumer<Order>, rtrb::Producer<Rows>) {
        let (orders, ordered) = rtrb::RingBuffer::new(ORDERS);
        // One more than can be ordered: the first is not ordered.
        let (put_down, over) = rtrb::RingBuffer::new(ORDERS + 1);
        (Self { header, orders, over, writing: None, written: Vec::new(), notes: Vec::new() }, ordered, put_down)
    }

    /// Creates a file and what writes to it; `settings` are those that are in force.
    fn start(&mut self, path: PathBuf, settings: &Settings) -> anyhow::Result<Rows> {
        self.header.scene.render = *settings;
        let Recording { rows, writing } = Recording::start(&path, &self.header)?;
        self.writing = Some(writing);
        Ok(rows)
    }

    fn order(&mut self, order: Order) -> anyhow::Result<()> {
        while self.over.pop().is_ok() {}
        self.orders.push(order).map_err(|_| anyhow!("the loop does not answer; let it go on first"))
    }

    fn stop(&mut self) -> anyhow::Result<Option<PathBuf>> {
        let Some(writing) = self.writing.take() else { return Ok(None) };
        self.order(None)?;
        let begin = Instant::now();
        while self.over.is_empty() && begin.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_micros(200));
        }
        let path = writing.path().to_owned();
        self.notes.extend(writing.finish()?);
        self.written.push(path.clone());
        Ok(Some(path))
    }

    /// The files, and what there is to say of them, when the loop is over.
    fn finish(mut self) -> anyhow::Result<(Vec<PathBuf>, Vec<String>)> {
        if let Some(writing) = self.writing.take() {
            let path = writing.path().to_owned();
            self.notes.extend(writing.finish()?);
            self.written.push(path);
        }
        Ok((self.written, self.notes))
    }
}
