//! The fault log: a file with the reasons why the force was removed, whether the run is recorded or
//! not.
//!
//! 1. The servo thread passes every tick to [`FaultWatch::see`]. This function puts an entry into a
//!    bounded queue when new faults begin and when the force may return. The function never waits.
//! 2. A separate thread writes each entry as a line of JSON and syncs it to the disk before it
//!    takes the next entry.
//! 3. [`FaultLog::finish`] returns the path of the log, if anything was written.
//!
//! The file is opened only at the first fault. A large log is renamed to `faults.jsonl.old` at the
//! next run. The log keeps the first [`MOST`] lines of each run.

use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{Cut, Cuts, Phase, Recorder, Recording, ServoTick, Sink, record};
use palpus_io::RecordingHeader;
use serde::Serialize;

use crate::{files, output, tools, when};

/// Largest number of entries that wait for the writer; faults are rare.
const QUEUED: usize = 1 << 10;
/// Largest number of lines of a run.
const MOST: u64 = 10_000;
/// Size in bytes above which a log is renamed.
const LARGE: u64 = 8 << 20;

/// An entry in the queue to the writer.
#[derive(Clone, Copy)]
struct Entry {
    utc_ns: u64,
    /// True when a fault begins, false when it is over.
    fault: bool,
    tick: ServoTick,
    phase_before: Phase,
    wrench_before: Wrench,
    /// Number of ticks since the fault began.
    lasted: u64,
}

/// The servo thread's end of the queue.
pub(crate) struct FaultWatch {
    queue: Recorder<Entry>,
    faults: Cuts,
    phase: Phase,
    wrench: Wrench,
    since: u64,
}

impl FaultWatch {
    /// Examines a tick. Never waits or allocates.
    pub(crate) fn see(&mut self, tick: &ServoTick) {
        let faults = tick.cuts.and(Cuts::FAULTS);
        let is_new = faults.or(self.faults) != self.faults;
        let is_over = self.phase.is_faulted() && !tick.phase.is_faulted();
        if is_new && !self.phase.is_faulted() {
            self.since = tick.index;
        }
        if is_new || is_over {
            self.queue.push(Entry {
                utc_ns: when::utc_ns(),
                fault: is_new,
                tick: *tick,
                phase_before: self.phase,
                wrench_before: self.wrench,
                lasted: tick.index - self.since,
            });
        }
        (self.faults, self.phase, self.wrench) = (faults, tick.phase, tick.wrench);
    }
}

/// An open log.
pub(crate) struct FaultLog {
    path: PathBuf,
    thread: Recording,
    lines: Arc<AtomicU64>,
}

impl FaultLog {
    /// Starts the writer of the log of device `which` at `path`, or at the default place; `header`
    /// describes the run. `None` if the user has no folder for logs.
    pub(crate) fn start(path: Option<&Path>, header: &RecordingHeader, which: usize) -> Option<(FaultWatch, Self)> {
        let path = path.map(Path::to_owned).or_else(of_user)?;
        let lines = Arc::new(AtomicU64::new(0));
        let pen = Pen { file: None, path: path.clone(), run: Run::of(header, which), lines: Arc::clone(&lines) };
        let (queue, thread) = record(QUEUED, pen);
        let (phase, faults) = (Phase::default(), Cuts::NONE);
        let watch = FaultWatch { queue, faults, phase, wrench: Wrench::ZERO, since: 0 };
        Some((watch, Self { path, thread, lines }))
    }

    /// Writes the remaining lines; returns the messages for the user, if anything was logged.
    pub(crate) fn finish(self) -> Option<String> {
        let written = self.thread.finish();
        let (path, lines) = (self.path.display(), self.lines.load(Ordering::Relaxed));
        if let Some(error) = written.error {
            return Some(format!(
                "note: faults could not be logged in {path} ({error}); --fault-log names another file"
            ));
        }
        let lost = written.dropped + written.written - lines;
        let more = if lost > 0 { format!(", {lost} more were not stored") } else { String::new() };
        (lines > 0).then(|| format!("faults: {lines} lines in {path}{more}"))
    }
}

/// Returns the user's folder for logs.
fn of_user() -> Option<PathBuf> {
    files::of_user("faults.jsonl")
}

/// Writes the entries.
struct Pen {
    /// `None` before the first fault.
    file: Option<File>,
    path: PathBuf,
    run: Run,
    lines: Arc<AtomicU64>,
}

impl Pen {
    fn opened(&mut self) -> io::Result<&mut File> {
        if self.file.is_none() {
            if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
                std::fs::create_dir_all(folder)?;
            }
            if std::fs::metadata(&self.path).is_ok_and(|file| file.is_file() && file.len() > LARGE) {
                let mut aside = self.path.clone().into_os_string();
                aside.push(".old");
                std::fs::rename(&self.path, aside)?;
            }
            self.file = Some(OpenOptions::new().create(true).append(true).open(&self.path)?);
        }
        self.file.as_mut().ok_or_else(|| io::Error::other("it is not open"))
    }

    fn put(&mut self, entry: &Entry) -> io::Result<()> {
        let mut line = serde_json::to_vec(&Line::new(entry, &self.run))?;
        line.push(b'\n');
        let file = self.opened()?;
        file.write_all(&line)?;
        file.sync_data()
    }
}

impl Sink<Entry> for Pen {
    fn write(&mut self, entry: &Entry) -> io::Result<()> {
        if self.lines.load(Ordering::Relaxed) >= MOST {
            return Ok(());
        }
        let put = self.put(entry);
        match &put {
            Ok(()) => _ = self.lines.fetch_add(1, Ordering::Relaxed),
            Err(error) => output::note(format!(
                "note: a fault could not be logged in {} ({error}); the run goes on",
                self.path.display()
            )),
        }
        put
    }
}

/// Description of the run, equal in all lines of a run.
#[derive(Serialize)]
struct Run {
    /// Name of the hand.
    hand: Cow<'static, str>,
    palpus: String,
    device: String,
    scene: String,
    /// Hash of meshes and scene file; equal scenes have equal hashes.
    scene_hash: String,
    rate_hz: f64,
}

impl Run {
    fn of(header: &RecordingHeader, which: usize) -> Self {
        use palpus_io::record::SceneSource;
        let scene = &header.scene;
        let (SceneSource::BuiltIn(name) | SceneSource::File(name)) = &scene.source;
        let text = scene.text.as_deref().unwrap_or_default();
        let all = format!("{}\n{}\n{name}\n{text}", scene.probe.content, scene.environment.content);
        Self {
            hand: tools::name(which),
            palpus: header.palpus_version.clone(),
            device: header.device.clone(),
            scene: name.clone(),
            scene_hash: palpus_io::ContentHash::of_bytes(all.as_bytes()).to_string(),
            rate_hz: header.rate_hz,
        }
    }
}

/// A line of the log; its field names are a public interface.
#[derive(Serialize)]
struct Line<'a> {
    utc: String,
    event: &'static str,
    tick: u64,
    time_s: f64,
    /// The reasons why the force was removed.
    faults: Vec<&'static str>,
    phase_before: &'static str,
    phase: &'static str,
    wrench_before: Felt,
    /// The engine's wrench; `null` where a value is not a number.
    computed: Felt,
    wrench: Felt,
    /// Lateness of the tick, and time since the previous tick, s.
    lateness_s: f64,
    elapsed_s: f64,
    /// Position of the grip as read, m.
    position_m: [f64; 3],
    /// Time since the fault began, counted in ticks, s.
    lasted_s: f64,
    #[serde(flatten)]
    run: &'a Run,
}

#[derive(Serialize)]
struct Felt {
    force_n: [f64; 3],
    torque_nm: [f64; 3],
}

impl Felt {
    fn new(wrench: &Wrench) -> Self {
        let array = |vector: DVec3| vector.to_array();
        Self { force_n: array(wrench.force), torque_nm: array(wrench.torque) }
    }
}

impl<'a> Line<'a> {
    fn new(entry: &Entry, run: &'a Run) -> Self {
        let tick = &entry.tick;
        Self {
            utc: when::rfc_3339(entry.utc_ns),
            event: if entry.fault { "fault" } else { "over" },
            tick: tick.index,
            time_s: tick.time,
            faults: tick.cuts.and(Cuts::FAULTS).iter().map(Cut::name).collect(),
            phase_before: entry.phase_before.name(),
            phase: tick.phase.name(),
            wrench_before: Felt::new(&entry.wrench_before),
            computed: Felt::new(&tick.computed),
            wrench: Felt::new(&tick.wrench),
            lateness_s: tick.lateness_s,
            elapsed_s: tick.elapsed_s,
            position_m: tick.read.pose.translation.to_array(),
            lasted_s: entry.lasted as f64 / run.rate_hz,
            run,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::atomic::AtomicBool;

    use palpus::algebra::{Pose, Twist};
    use palpus_alloc::allocations_of_this_thread;
    use palpus_device::{
        DeviceState, ReplayDevice, Servo, ServoOptions, SimulationSettings, StepOutcome, TickObserver, Timing,
    };
    use palpus_io::scene::FilePolicy;

    use super::*;

    /// Keeps every tick.
    struct Ticks(Vec<ServoTick>);

    impl TickObserver for Ticks {
        fn observe(&mut self, tick: &ServoTick, (): &()) {
            self.0.push(*tick);
        }
    }

    /// Returns a run of 800 ticks in which the wrench is NaN in tick 400.
    pub(crate) fn ticks() -> Vec<ServoTick> {
        let state =
            |time| DeviceState { pose: Pose::IDENTITY, twist: Twist::default(), buttons: 0, time, withheld: false };
        let states = (0..800).map(|k| state(f64::from(k) * 1e-3)).collect();
        let mut device = ReplayDevice::new(SimulationSettings::default().spec, states);
        let mut count = 0;
        let step = |_: &DeviceState, _| {
            count += 1;
            let force = if count == 401 { DVec3::NAN } else { DVec3::X * 0.1 };
            StepOutcome::of(Wrench { torque: DVec3::ZERO, force })
        };
        let mut seen = Ticks(Vec::new());
        let options = ServoOptions { timing: Timing::Simulated, ..ServoOptions::default() };
        Servo::new(options).expect("options").run(&mut device, step, &mut seen, &AtomicBool::new(false));
        seen.0
    }

    #[test]
    fn watching_for_faults_obtains_no_memory() {
        crate::bodies::use_cache(false);
        let stage = crate::stage::prepare("pen-sphere", FilePolicy::Inside).expect("a built-in scene");
        let header = stage.header(stage.settings, "sim", 1000.0);
        let path = std::env::temp_dir().join(format!("palpus-faults-{}.jsonl", std::process::id()));
        let (mut watch, log) = FaultLog::start(Some(&path), &header, 0).expect("a place");
        let ticks = ticks();
        assert_eq!(ticks.len(), 800);
        let before = allocations_of_this_thread();
        ticks.iter().for_each(|tick| watch.see(tick));
        assert_eq!(allocations_of_this_thread(), before, "the servo thread allocates");
        let said = log.finish().expect("something was logged");
        let text = std::fs::read_to_string(&path).expect("a log");
        std::fs::remove_file(&path).expect("the file can be deleted");
        assert!(said.starts_with("faults: 2 lines in "), "{said}");
        let lines: Vec<serde_json::Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("a document")).collect();
        let [fault, over] = lines.as_slice() else { panic!("{text}") };
        assert_eq!((&fault["tick"], &fault["faults"][0]), (&400.into(), &"non_finite_wrench".into()));
        assert!(fault["computed"]["force_n"][0].is_null() && fault["wrench_before"]["force_n"][0] == 0.1, "{fault}");
        assert!(over["event"] == "over" && over["tick"].as_u64() > Some(400), "{over}");
    }
}
