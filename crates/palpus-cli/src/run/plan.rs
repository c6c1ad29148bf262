//! Plan of a run: a stage, a device, thresholds and settings.

use std::path::Path;
use std::sync::Arc;

use anyhow::{anyhow, bail};
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::render::{Clustering, Settings, WorkLimit};
use palpus_device::{
    AfterFault, DEVICE_BUTTONS, DeviceSpec, DeviceState, EnableMode, FaultyDevice, Guide, Guided, HOLD_KEY,
    HapticDevice, Publisher, ReplayDevice, SafetyLimits, SafetyOptions, Script, ServoOptions, SimulatedDevice,
    SimulationSettings, Timing, latest,
};
use palpus_io::{RecordRow, RecordingHeader, read_recording};

use super::{DEFAULT_SECONDS, heavy, replayed};
use crate::args::RunArguments;
use crate::engine::Engine;
use crate::lead_out::LeadOut;
use crate::rerun::one::{check_poses, state};
use crate::stage::Stage;
use crate::tools::ToolArguments;
use crate::way_out::InsideStart;
use crate::{devices, faults, output, safety};

/// A prepared run.
pub(crate) struct Plan {
    /// Name of the scene.
    pub(crate) name: String,
    pub(crate) stage: Stage,
    pub(crate) rate_hz: f64,
    pub(crate) options: ServoOptions,
    pub(crate) limits: SafetyLimits,
    pub(crate) settings: Settings,
    pub(crate) device: FaultyDevice<Box<dyn HapticDevice + Send>>,
    /// Moves the simulated hand; `None` if the hand cannot be moved.
    pub(crate) guide: Option<Publisher<Guide>>,
    pub(crate) script: Script,
    /// Set if the probe starts inside the part.
    pub(super) inside: Option<InsideStart>,
    /// Set if the device has to lead the probe out of the overlap.
    pub(super) lead: Option<LeadOut>,
    /// Header of a recording that begins with the run.
    pub(crate) header: RecordingHeader,
    pub(super) enable_mode: EnableMode,
    notes: Vec<String>,
}

impl Plan {
    /// Plans a run on `stage`, called `name`, for the tool with the arguments `typed`. If this tool
    /// starts inside one of the tools `after` it (with their start poses, world), `--lead-out`
    /// moves this tool. `in_window`: the run has keys, and without a duration the run lasts until
    /// it is stopped.
    pub(super) fn new(
        arguments: &RunArguments,
        typed: &ToolArguments<'_>,
        name: &str,
        mut stage: Stage,
        after: &[(Arc<Body>, Pose)],
        in_window: bool,
    ) -> anyhow::Result<Self> {
        if let Some(rendering) = arguments.rendering {
            stage.coupling.mode = rendering.into();
        }
        if let Some(clustering) = arguments.clustering {
            stage.settings.clustering = clustering.into();
        }
        let rate_hz = stage.rate_hz(arguments.rate);
        let script = faults::script(typed.faults, rate_hz, arguments.fast)?;
        let inside = InsideStart::of(&stage, after);
        let end = inside.filter(|_| arguments.lead_out).map(|inside| inside.end());
        let Opened { device, guide, notes } = open(arguments, typed, &stage, rate_hz, end)?;
        let spec = lowered(device.spec(), arguments);
        let device = FaultyDevice::new(device, &script).claiming(spec);
        let settings = stage.settings_for(device.spec(), rate_hz);
        let mut options = ServoOptions {
            rate_hz,
            timing: if arguments.fast { Timing::Simulated } else { Timing::RealTime },
            duration: if in_window { arguments.duration } else { Some(arguments.duration.unwrap_or(DEFAULT_SECONDS)) },
            safety: SafetyOptions {
                after_fault: if arguments.stop_on_fault { AfterFault::Stop } else { AfterFault::Reengage },
                rearm: arguments.rearm.into(),
                enable_mode: arguments.dead_man.then_some(EnableMode::DeadMan(HOLD_KEY | DEVICE_BUTTONS)),
                ..SafetyOptions::default()
            },
            ..ServoOptions::default()
        };
        let mut limits = options.safety.limits(device.spec(), rate_hz);
        if arguments.passive {
            limits.allowance = 0.0;
        }
        options.safety.limits = Some(limits);
        let enable_mode = options.safety.enable_mode(device.spec());
        if arguments.dead_man && device.spec().buttons == 0 && !in_window {
            bail!("--dead-man needs a button or a key: this device has no button, and there is no window");
        }
        let mut header = stage.header(settings, typed.device, rate_hz);
        safety::recorded(&limits, enable_mode, &options.safety, &mut header.scene.more);
        devices::recorded(&notes, &mut header.scene.more);
        replayed::record_spec(device.spec(), &mut header.scene.more);
        let lead = inside.filter(|_| arguments.lead_out).map(|inside| LeadOut::new(&inside, &limits));
        if let Some(lead) = &lead {
            lead.record(&mut header.scene.more);
        }
        let name = name.to_owned();
        Ok(Self {
            name,
            stage,
            rate_hz,
            options,
            limits,
            settings,
            device,
            guide,
            script,
            inside,
            lead,
            header,
            enable_mode,
            notes,
        })
    }

    /// Returns the description of the device.
    pub(crate) fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    /// True if the run is in real time.
    pub(super) fn keeps_time(&self) -> bool {
        self.options.timing == Timing::RealTime
    }

    /// Creates an engine for the tools of its stage that have `settings`. `steerable`: with memory
    /// for all later changes of settings.
    pub(super) fn engine(&self, settings: &[Settings], steerable: bool) -> anyhow::Result<Engine> {
        let mut engine = Engine::new(&self.stage, settings)?;
        if self.keeps_time() {
            engine.allow(WorkLimit::TimeBudget);
        }
        Ok(if steerable { engine.with_surfaces(self.stage.crease_angle()) } else { engine })
    }

    /// Describes the run before it starts. `headless`: the reason why there is no window. Returns
    /// true if it printed a note about a heavy pair.
    pub(crate) fn announce(&self, arguments: &RunArguments, headless: Option<&str>) -> anyhow::Result<bool> {
        let (stage, spec) = (&self.stage, self.spec());
        let size = |body: &palpus::body::Body| (body.mesh().triangles().len(), body.pieces().len());
        let ((ta, pa), (tb, pb)) = (size(&stage.probe), size(&stage.environment));
        output::note(format!("{}: probe {ta} triangles in {pa} convex pieces, environment {tb} in {pb}", self.name));
        stage.notes.iter().for_each(output::note);
        let pace = if arguments.fast { "as fast as it goes" } else { "in real time" };
        let how = headless.map_or("in a window".to_owned(), |why| format!("headless ({why})"));
        let until = match self.options.duration {
            None => "until the window is closed".to_owned(),
            Some(seconds) => format!("for {seconds} s"),
        };
        output::note(format!("{how}: {} at {:.0} Hz {pace} {until}; Ctrl-C ends it", spec.name, self.rate_hz));
        if self.device.brake().is_none() && spec.force_max > 0.0 && !self.header.device.starts_with("replay:") {
            output::note(
                "note: this device has no brake; if the loop stalls, the device keeps its force until the loop continues",
            );
        }
        self.notes.iter().for_each(output::note);
        if let Some(not_felt) = devices::not_felt(spec) {
            output::note(format!("note: {not_felt}"));
        } else if self.settings.limits.torque <= 0.0 {
            output::note("note: the torque limit is 0: torques are shown but not felt");
        }
        if self.enable_mode != EnableMode::Automatic {
            let what = match (self.spec().buttons, headless) {
                (0, _) => "G in the window",
                (_, None) => "a button of the device, or G in the window",
                (_, Some(_)) => "a button of the device",
            };
            output::note(format!("there is force only while you hold {what}"));
        }
        output::note(contacts_as_felt(&self.settings));
        // A window shows the first contact sooner without the test, and reports a heavy pair in the
        // run.
        let heavy = headless.is_some() && self.keeps_time() && heavy::is_heavy(self)?;
        if heavy {
            output::note(heavy::IN_WORDS);
        }
        Ok(heavy)
    }
}

/// Returns the device's description, with the limits that the user lowered.
fn lowered(spec: &DeviceSpec, arguments: &RunArguments) -> DeviceSpec {
    let lower = |stated: f64, asked: Option<f64>| asked.map_or(stated, |asked| stated.min(asked));
    DeviceSpec {
        force_max: lower(spec.force_max, arguments.max_force),
        torque_max: lower(spec.torque_max, arguments.max_torque),
        force_continuous: spec.force_continuous.map(|force| lower(force, arguments.max_force)),
        torque_continuous: spec.torque_continuous.map(|torque| lower(torque, arguments.max_torque)),
        ..spec.clone()
    }
}

/// A device with its description.
struct Opened {
    device: Box<dyn HapticDevice + Send>,
    guide: Option<Publisher<Guide>>,
    notes: Vec<String>,
}

/// Opens the device. `led_to`: the simulated hand exerts no force before this plane (a point and a
/// normal, world).
fn open(
    arguments: &RunArguments,
    &ToolArguments { device: named, hand, .. }: &ToolArguments<'_>,
    stage: &Stage,
    rate_hz: f64,
    led_to: Option<[DVec3; 2]>,
) -> anyhow::Result<Opened> {
    let mut notes = Vec::new();
    if let Some(file) = named.strip_prefix("replay:") {
        let device = replay(Path::new(file))?;
        return Ok(Opened { device, guide: None, notes });
    }
    if named != "sim" {
        if arguments.fast {
            bail!("only `sim` and `replay:FILE` run in simulated time; leave out --fast");
        }
        let device = devices::open(named, stage.grip(stage.path.pose(0.0)), !arguments.no_realtime, &mut notes)?
            .ok_or_else(|| anyhow!("there is no device `{}`; there are: {}", named, devices::NAMES))?;
        return Ok(Opened { device, guide: None, notes });
    }
    let hand = stage.hand(hand)?;
    let settings = SimulationSettings { rate_hz, hand, ..SimulationSettings::default() };
    let (publisher, guide) = latest(Guide::Script);
    let intent = Guided::new(stage.intent(), guide).yielding(led_to);
    let device = Box::new(SimulatedDevice::new(settings, intent)?);
    // With zero hand stiffness the target has no effect, so guidance is off.
    Ok(Opened { device, guide: Some(publisher).filter(|_| hand.stiffness > 0.0), notes })
}

/// Creates a device that replays the hand of a recording, with the recorded device's limits.
fn replay(file: &Path) -> anyhow::Result<Box<dyn HapticDevice + Send>> {
    let recording = read_recording(file)?;
    check_poses(&recording)?;
    let spec = replayed::spec_of(&recording.header.scene.more);
    Ok(Box::new(ReplayDevice::new(spec, recording.rows.iter().map(felt).collect())))
}

/// Converts a recorded state to a device state; the sample times are a nominal period apart.
fn felt(row: &RecordRow) -> DeviceState {
    DeviceState { time: row.time_ns as f64 * 1e-9, ..state(row) }
}

/// Describes how contacts are rendered.
fn contacts_as_felt(settings: &Settings) -> String {
    let clustering = match settings.clustering {
        Clustering::Linkage => "linkage clusters",
        Clustering::Smooth => "smooth clustering",
    };
    let Some(coupling) = settings.coupling else {
        return format!("direct rendering: contacts of {:.0} N/m, {clustering}", settings.stiffness);
    };
    let tool = if coupling.mass > 0.0 { format!(", tool of {:.1} g", coupling.mass * 1e3) } else { String::new() };
    format!(
        "coupled: {:.0} N/m and {:.1} N·s/m, {:.2} N·m/rad and {:.2} mN·m·s/rad{tool}; contacts of {:.0} N/m, {clustering}",
        coupling.stiffness,
        coupling.damping,
        coupling.angular_stiffness,
        coupling.angular_damping * 1e3,
        settings.stiffness
    )
}
