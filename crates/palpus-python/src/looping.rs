//! The device loop: runs a world, a device and the safety chain between them in a Rust thread.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use numpy::PyArray1;
use palpus::Pose;
use palpus_device::{
    Guide, Guided, HapticDevice, HelperThread, Newest, Publisher, RealTimeOptions, RunEnd, RunStatistics, Servo,
    ServoOptions, SimulatedDevice, SimulationSettings, Timing, hand_preset, latest,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{of_pair, of_pose, pose, twist};
use crate::refused::{failed, refused};
use crate::servo_thread::{Drive, Ended, Now, ServoThread};
use crate::settings::Settings;
use crate::world::{World, row};

/// Runs a world's tool on a device at 1 kHz, in a separate thread, with the safety chain in
/// between.
///
/// `device` is a name as for `palpus run --device`: "simulated" (a device that a simulated operator
/// holds), "haply", "bridge:/path/to.sock", and so on. The tool's frame starts at the pose `start`.
/// The world must have exactly one tool, and the loop owns the world while it runs. Use the loop in
/// a with-statement, or call `start` and `stop`.
///
/// `hand` is the simulated operator's grip on a simulated device: relaxed, normal, firm, tight or
/// none. With `duration` (s) the loop ends by itself. If `real_time` is False, ticks follow each
/// other as fast as possible, which only simulated devices allow. With `priority`, the loop
/// requests real-time priority, locked memory, large pages and a processor core from the system.
#[pyclass(module = "palpus")]
pub(crate) struct Loop {
    world: Py<World>,
    device: String,
    start: Pose,
    options: ServoOptions,
    hand: String,
    priority: bool,
    running: Option<Running>,
    ended: Option<(RunStatistics, u64)>,
    last: Option<Now>,
}

/// State of a loop while it runs.
struct Running {
    thread: JoinHandle<Ended>,
    stop: Arc<AtomicBool>,
    now: Newest<Now>,
    settings: Publisher<palpus::Settings>,
    drives: Mutex<rtrb::Producer<Drive>>,
    /// Target of the simulated operator. `None` for a real device.
    guide: Option<Publisher<Guide>>,
    grip_a: glam::DVec3,
    /// Takes part in the steps of close-fitting parts until the loop ends.
    _helper: Option<HelperThread>,
}

/// Maximum number of updates of driven bodies that wait for the next tick.
const DRIVES: usize = 1024;

#[pymethods]
impl Loop {
    #[new]
    #[pyo3(signature = (world, start, *, device="simulated", hand="normal", rate=1000.0, duration=None,
        real_time=true, priority=false))]
    #[expect(clippy::too_many_arguments, reason = "in Python they are passed by name")]
    fn new(
        world: Py<World>,
        start: &Bound<'_, PyAny>,
        device: &str,
        hand: &str,
        rate: f64,
        duration: Option<f64>,
        real_time: bool,
        priority: bool,
    ) -> PyResult<Self> {
        let start = pose("start", start)?;
        let timing = if real_time { Timing::RealTime } else { Timing::Simulated };
        let options = ServoOptions { rate_hz: rate, timing, duration, ..ServoOptions::default() };
        Servo::new(options).map_err(|error| failed(&error))?;
        if !real_time && device != SIMULATED {
            return Err(refused(format!("device {device:?} keeps its own time; leave real_time on")));
        }
        let (device, hand) = (device.to_owned(), hand.to_owned());
        Ok(Self { world, device, start, options, hand, priority, running: None, ended: None, last: None })
    }

    /// Opens and tests the device, and starts the loop. Forces increase gradually as soon as the
    /// tool is free of contact or presses only lightly.
    fn start(&mut self, py: Python<'_>) -> PyResult<()> {
        if self.running.is_some() {
            return Err(refused("the loop is already running"));
        }
        let servo = Servo::new(self.options).map_err(|error| failed(&error))?;
        let settings = self.world.borrow(py).tool_settings()?;
        let start = self.start.with_origin(settings.grip_a);
        let (device, guide) = self.open(py, start)?;
        let (world, tool) = self.world.borrow_mut(py).lend()?;
        let first = Now {
            tick: 0,
            time: 0.0,
            tool: self.start,
            grip: start,
            wrench: palpus::Wrench::ZERO,
            contacts: 0,
            phase: palpus_device::Phase::Idle,
        };
        let (published, now) = latest(first);
        let (asked, newest_settings) = latest(settings);
        let (sent, drives) = rtrb::RingBuffer::new(DRIVES);
        let stop = Arc::new(AtomicBool::new(false));
        let servo_thread = ServoThread {
            servo,
            device,
            world,
            tool,
            time_budget: (self.options.timing == Timing::RealTime)
                .then(|| palpus::Settings::time_budget_of(1.0 / self.options.rate_hz)),
            claims: self.priority,
            settings: newest_settings,
            drives,
            now: published,
            stop: stop.clone(),
        };
        let helper = servo_thread.world.helper();
        let thread = thread::spawn(move || servo_thread.turn());
        let priority = RealTimeOptions::default().priority.filter(|_| self.priority);
        let helper = priority.and_then(|priority| HelperThread::start(helper, Some(priority), None));
        self.ended = None;
        let drives = Mutex::new(sent);
        let (settings, grip_a) = (asked, settings.grip_a);
        self.running = Some(Running { thread, stop, now, settings, drives, guide, grip_a, _helper: helper });
        Ok(())
    }

    /// Stops the loop. The last wrench sent to the device is zero. Returns the summary of the run.
    fn stop<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.join(py, true)?;
        self.summary(py)
    }

    /// Waits until the loop ends, and returns the summary of the run. Ctrl-C stops the loop.
    fn wait<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        while self.is_running() {
            py.detach(|| thread::sleep(std::time::Duration::from_millis(5)));
            if let Err(interrupt) = py.check_signals() {
                self.join(py, true)?;
                return Err(interrupt);
            }
        }
        self.join(py, false)?;
        self.summary(py)
    }

    /// True while the loop's thread is running.
    #[getter]
    fn is_running(&self) -> bool {
        self.running.as_ref().is_some_and(|running| !running.thread.is_finished())
    }

    /// Returns the state of the newest tick: `tick`, `time` (s), `tool` (7, pose of its frame in
    /// the world), `grip` (7, pose reported by the device), `wrench` (6, as sent to the device),
    /// `contacts` (their number), `phase` of the engagement ("engaged" when the whole wrench is
    /// applied) and `running`.
    fn status<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let is_running = self.is_running();
        if let Some(running) = &mut self.running {
            self.last = Some(*running.now.get());
        }
        let now = self.last.ok_or_else(|| refused("the loop has not been started"))?;
        let status = PyDict::new(py);
        status.set_item("tick", now.tick)?;
        status.set_item("time", now.time)?;
        status.set_item("tool", row(py, of_pose(&now.tool)))?;
        status.set_item("grip", row(py, of_pose(&now.grip)))?;
        status.set_item("wrench", row(py, of_pair(now.wrench.force, now.wrench.torque)))?;
        status.set_item("contacts", now.contacts)?;
        status.set_item("phase", now.phase.name())?;
        status.set_item("running", is_running)?;
        Ok(status)
    }

    /// The last wrench sent to the device (6,), about the grip.
    #[getter]
    fn wrench<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        if let Some(running) = &mut self.running {
            self.last = Some(*running.now.get());
        }
        let now = self.last.ok_or_else(|| refused("the loop has not been started"))?;
        Ok(row(py, of_pair(now.wrench.force, now.wrench.torque)))
    }

    /// Makes the simulated operator move the tool's frame to this pose (in the world), no faster
    /// than a person's hand moves.
    fn lead(&mut self, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = self::pose("pose", pose)?;
        let running = self.running.as_mut().ok_or_else(still)?;
        let refuse = || {
            refused(format!(
                "device {:?} is held by a person; only the operator of a simulated device can be led",
                self.device
            ))
        };
        let guide = running.guide.as_mut().ok_or_else(refuse)?;
        guide.publish(Guide::Held(pose.with_origin(running.grip_a)));
        Ok(())
    }

    /// Moves a driven body like `World.drive`, from the next tick on.
    #[pyo3(signature = (body, pose, twist=None))]
    fn drive(
        &mut self,
        py: Python<'_>,
        body: usize,
        pose: &Bound<'_, PyAny>,
        twist: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let id = self.world.borrow(py).driven(body)?;
        let update = (id, self::pose("pose", pose)?, self::twist("twist", twist)?);
        let running = self.running.as_ref().ok_or_else(still)?;
        let mut drives = running.drives.lock().unwrap_or_else(PoisonError::into_inner);
        let full = |_| refused(format!("{DRIVES} updates are waiting for the next tick; drive bodies less often"));
        drives.push(update).map_err(full)
    }

    /// Changes the tool's settings from the next tick on. The grip must stay the same.
    fn set_settings(&mut self, settings: &Bound<'_, Settings>) -> PyResult<()> {
        let running = self.running.as_mut().ok_or_else(still)?;
        let settings = settings.get().settings;
        if settings.grip_a != running.grip_a {
            return Err(refused("the grip cannot move while the loop runs; stop it first"));
        }
        running.settings.publish(settings);
        Ok(())
    }

    fn __enter__(slf: Py<Self>, py: Python<'_>) -> PyResult<Py<Self>> {
        slf.borrow_mut(py).start(py)?;
        Ok(slf)
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&mut self, py: Python<'_>, _raised: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.join(py, true)
    }

    /// Returns the summary of the last run: `ticks`, `duration` (s), `rate` (Hz), `late` (ticks
    /// more than half a millisecond late), `skipped`, `step_us` (p50, p99, p99.9, maximum),
    /// `force_max` (N), `torque_max` (N·m), `faults`, `allocations` during the ticks, and `end`
    /// (the reason as text).
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (run, allocations) = self.ended.as_ref().ok_or_else(|| refused("no run of the loop has ended yet"))?;
        let summary = PyDict::new(py);
        summary.set_item("ticks", run.ticks)?;
        summary.set_item("duration", run.duration_s)?;
        summary.set_item("rate", run.rate_hz)?;
        summary.set_item("late", run.late_ticks)?;
        summary.set_item("skipped", run.skipped)?;
        summary.set_item("step_us", (run.step_us.p50, run.step_us.p99, run.step_us.p999, run.step_us.max))?;
        summary.set_item("force_max", run.force_max)?;
        summary.set_item("torque_max", run.torque_max)?;
        summary.set_item("faults", run.safety.faults())?;
        summary.set_item("allocations", allocations)?;
        summary.set_item("end", palpus_cli::end_in_words(&run.end))?;
        Ok(summary)
    }

    fn __repr__(&self) -> String {
        let state = if self.is_running() { "running" } else { "stopped" };
        format!("<palpus.Loop: {} at {} Hz, {state}>", self.device, self.options.rate_hz)
    }
}

const SIMULATED: &str = "simulated";

fn still() -> PyErr {
    refused("the loop is not running; start it first")
}

type Opened = (Box<dyn HapticDevice + Send>, Option<Publisher<Guide>>);

impl Loop {
    /// Opens the device, with its grip at `start`.
    fn open(&self, py: Python<'_>, start: Pose) -> PyResult<Opened> {
        if self.device == SIMULATED {
            let hand = hand_preset(&self.hand).ok_or_else(|| {
                refused(format!("there is no hand {:?}; use relaxed, normal, firm, tight or none", self.hand))
            })?;
            let (guide, guided) = latest(Guide::Script);
            let hand = SimulationSettings { hand, rate_hz: self.options.rate_hz, ..SimulationSettings::default() };
            let device = SimulatedDevice::new(hand, Guided::new(move |_| start, guided));
            return Ok((Box::new(device.map_err(|error| failed(&error))?), Some(guide)));
        }
        let opened = py.detach(|| palpus_cli::open_device(&self.device, start, self.priority, &mut Vec::new()));
        match opened.map_err(|error| refused(format!("{error:#}")))? {
            Some(device) => Ok((device, None)),
            None => Err(refused(format!(
                "there is no device {:?}; give \"simulated\", or a name as for `palpus run --device`",
                self.device
            ))),
        }
    }

    /// Joins the thread, and gives the world back to Python. With `end`, stops the loop first.
    fn join(&mut self, py: Python<'_>, end: bool) -> PyResult<()> {
        let Some(mut running) = self.running.take() else { return Ok(()) };
        running.stop.fetch_or(end, Ordering::Relaxed);
        let ended = py.detach(|| running.thread.join());
        let ended = ended.map_err(|_| refused("the loop's thread failed outside a step; please report this"))?;
        self.last = Some(*running.now.get());
        self.world.borrow_mut(py).give_back(ended.world);
        let failure = match &ended.statistics.end {
            RunEnd::DeviceFailed(_) | RunEnd::Panicked(_) | RunEnd::Faulted(_) => {
                Some(refused(format!("the loop ended: {}", palpus_cli::end_in_words(&ended.statistics.end))))
            }
            RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded => None,
        };
        self.ended = Some((ended.statistics, ended.allocations));
        failure.map_or(Ok(()), Err)
    }
}

impl Drop for Loop {
    /// If Python drops the loop, the loop must stop, because it still sends forces.
    fn drop(&mut self) {
        if let Some(running) = self.running.take() {
            running.stop.store(true, Ordering::Relaxed);
        }
    }
}
