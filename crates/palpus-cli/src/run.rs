//! `palpus run`: the closed loop.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::{anyhow, bail};
use palpus::render::{Clustering, Settings};
use palpus_device::{
    AfterFault, DeviceState, Engagement, FaultyDevice, HapticDevice, Newest, Phase, RealTimeClaims, RealTimeOptions,
    ReplayDevice, RunEnd, RunStatistics, SafetyOptions, Script, Servo, ServoOptions, ServoTick, SimulatedDevice,
    SimulationSettings, Timing, claim, hand_preset, latest,
};
use palpus_io::scene::FilePolicy;
use palpus_io::{RecordRow, RecordingHeader, read_recording};

use crate::args::RunArguments;
use crate::engine::{Detail, Engine};
use crate::recording::{Recording, Rows};
use crate::stage::{self, Stage};
use crate::summary::{self, Gatherer, Summary};
#[cfg(feature = "window")]
use crate::window::Numbers;
use crate::window::Window;
use crate::{devices, faults, output, picture, plots, safety, window};

pub(crate) fn run(arguments: &RunArguments) -> anyhow::Result<ExitCode> {
    if arguments.list {
        list();
        return Ok(ExitCode::SUCCESS);
    }
    let policy = if arguments.allow_outside { FilePolicy::Anywhere } else { FilePolicy::Inside };
    let mut stage = stage::prepare(&arguments.scene, policy)?;
    if let Some(file) = &arguments.hand_path {
        stage.follow(file, arguments.hand_scale, arguments.hand_speed)?;
    }
    if let Some(rendering) = arguments.rendering {
        stage.coupling.mode = rendering.into();
    }
    if let Some(clustering) = arguments.clustering {
        stage.settings.clustering = clustering.into();
    }
    let rate_hz = arguments.rate.or(stage.rate_hz).unwrap_or(DEFAULT_RATE_HZ);
    let script = faults::script(&arguments.fault, rate_hz)?;
    let mut notes = Vec::new();
    let mut device = FaultyDevice::new(device(arguments, &stage, rate_hz, &mut notes)?, &script);
    let settings = stage.settings_for(device.spec(), rate_hz);
    let headless = window::reason_for_none(arguments);
    let seconds = arguments.duration.unwrap_or(DEFAULT_SECONDS);
    let mut options = ServoOptions {
        rate_hz,
        timing: if arguments.fast { Timing::Simulated } else { Timing::RealTime },
        duration: if headless.is_some() { Some(seconds) } else { arguments.duration },
        safety: SafetyOptions {
            after_fault: if arguments.stop_on_fault { AfterFault::Stop } else { AfterFault::Reengage },
            ..SafetyOptions::default()
        },
        ..ServoOptions::default()
    };
    let mut limits = options.safety.limits(device.spec(), rate_hz);
    if arguments.passive {
        limits.allowance = 0.0;
    }
    options.safety.limits = Some(limits);
    if arguments.limits {
        safety::print(device.spec(), &limits, arguments.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut engine = Engine::new(&stage, settings)?;
    if let Some(at) = arguments.at {
        if !(0.0..seconds).contains(&at) {
            bail!("--at {at} is not within the {seconds} s of the run; see --duration");
        }
        engine.keep((at * rate_hz).round() as u64);
    }
    let mut header = header(&stage, settings, arguments, rate_hz);
    let engagement = options.safety.engagement(device.spec());
    safety::recorded(&limits, engagement, &options.safety, &mut header.scene.more);
    devices::recorded(&notes, &mut header.scene.more);
    if !arguments.json {
        announce(arguments, &stage, &device, rate_hz, headless);
        if device.brake().is_none() && device.spec().force_max > 0.0 && !arguments.device.starts_with("replay:") {
            output::note(
                "note: this device has no brake; should the loop stall, it holds its force until the loop goes on",
            );
        }
        notes.iter().for_each(output::note);
        if let Some(not_felt) = devices::not_felt(device.spec()) {
            output::note(format!("note: {not_felt}"));
        }
        if engagement != Engagement::Automatic {
            output::note("forces come when you press a button of the device");
        }
        output::note(contacts_as_felt(&settings));
    }
    let window = headless
        .is_none()
        .then(|| Window::on(&arguments.scene, &stage, &settings, &mut engine, arguments.duration.is_some()));
    let without = arguments.duration.is_none().then(|| Duration::from_secs_f64(DEFAULT_SECONDS));
    let servo = Servo::new(options)?;
    let recording = (!arguments.no_record).then(|| Recording::start(&arguments.record, &header)).transpose()?;
    let (rows, writing) = recording.map_or((None, None), |r| (Some(r.rows), Some(r.writing)));
    let claims = (!arguments.fast && !arguments.no_realtime).then(RealTimeOptions::default);
    let Turned { statistics, gatherer, claims, engine } =
        turn(servo, engine, &mut device, &script, Beside { rows, claims, window, without, quiet: arguments.json })?;
    let summary = gatherer.finish(&statistics, &limits, claims.as_ref());
    if let Some(writing) = writing {
        writing.finish()?.iter().for_each(output::note);
    }
    report(arguments, &summary)?;
    if let Some(file) = &arguments.screenshot {
        let moment = engine.shown(1.0 / rate_hz);
        picture::write_run(&arguments.scene, &stage, settings.limits.torque, moment, file, &arguments.picture)?;
    }
    let failed = matches!(statistics.end, RunEnd::DeviceFailed(_) | RunEnd::Panicked(_) | RunEnd::Faulted(_));
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Ticks per second when nobody says.
const DEFAULT_RATE_HZ: f64 = 1000.0;

/// How long a run without a window goes when nobody says, s.
const DEFAULT_SECONDS: f64 = 10.0;

fn list() {
    for scene in palpus_scenes::scenes() {
        output::line(format!("{:12} {}", scene.name, scene.summary));
    }
}

fn device(
    arguments: &RunArguments,
    stage: &Stage,
    rate_hz: f64,
    notes: &mut Vec<String>,
) -> anyhow::Result<Box<dyn HapticDevice + Send>> {
    if let Some(file) = arguments.device.strip_prefix("replay:") {
        let recording = read_recording(Path::new(file))?;
        let state = |row: &RecordRow| DeviceState {
            pose: row.pose,
            twist: row.twist,
            buttons: row.buttons,
            time: row.time_ns as f64 * 1e-9,
        };
        let spec = SimulationSettings::default().spec;
        return Ok(Box::new(ReplayDevice::new(spec, recording.rows.iter().map(state).collect())));
    }
    if arguments.device != "sim" {
        if arguments.fast {
            bail!("only `sim` and `replay:FILE` run faster than time; leave --fast out");
        }
        return devices::open(&arguments.device, stage.path.pose(0.0), !arguments.no_realtime, notes)?
            .ok_or_else(|| anyhow!("there is no device `{}`; there are: {}", arguments.device, devices::NAMES));
    }
    let name = arguments.hand.as_deref().or(stage.hand).unwrap_or("normal");
    let Some(hand) = hand_preset(name) else {
        bail!("there is no hand `{name}`; hands are relaxed, normal, firm, tight and none");
    };
    let path = stage.path.clone();
    let settings = SimulationSettings { rate_hz, hand, ..SimulationSettings::default() };
    Ok(Box::new(SimulatedDevice::new(settings, move |time| path.pose(time))?))
}

fn header(stage: &Stage, settings: Settings, arguments: &RunArguments, rate_hz: f64) -> RecordingHeader {
    let mut scene = stage.recorded.clone();
    scene.render = settings;
    RecordingHeader {
        palpus_version: env!("CARGO_PKG_VERSION").to_owned(),
        device: arguments.device.clone(),
        rate_hz,
        seed: 0,
        scene,
    }
}

fn announce(arguments: &RunArguments, stage: &Stage, device: &dyn HapticDevice, rate_hz: f64, headless: Option<&str>) {
    let size = |body: &palpus::body::Body| (body.mesh().triangles().len(), body.pieces().len());
    let ((ta, pa), (tb, pb)) = (size(&stage.probe), size(&stage.environment));
    output::note(format!("{}: probe {ta} triangles in {pa} convex pieces, environment {tb} in {pb}", arguments.scene));
    let pace = if arguments.fast { "as fast as it goes" } else { "in real time" };
    let how = headless.map_or("in a window".to_owned(), |why| format!("headless ({why})"));
    let until = match (arguments.duration, headless) {
        (None, None) => "until the window is closed".to_owned(),
        (seconds, _) => format!("for {} s", seconds.unwrap_or(DEFAULT_SECONDS)),
    };
    output::note(format!("{how}: {} at {rate_hz:.0} Hz {pace} {until}; Ctrl-C ends it", device.spec().name));
}

/// How contacts come to the hand.
fn contacts_as_felt(settings: &Settings) -> String {
    let clustering = match settings.clustering {
        Clustering::Linkage => "linkage clusters",
        Clustering::Smooth => "smooth clustering",
    };
    let Some(coupling) = settings.coupling else {
        return format!("direct rendering: contacts of {:.0} N/m, {clustering}", settings.stiffness);
    };
    format!(
        "coupled: {:.0} N/m and {:.1} N·s/m, {:.2} N·m/rad and {:.2} mN·m·s/rad, tool of {:.1} g; contacts of {:.0} N/m, {clustering}",
        coupling.stiffness,
        coupling.damping,
        coupling.angular_stiffness,
        coupling.angular_damping * 1e3,
        coupling.mass * 1e3,
        settings.stiffness
    )
}

/// What the live line and the window show.
#[derive(Clone, Copy, Default)]
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only the window shows all of it"))]
pub(crate) struct Live {
    ticks: u64,
    time: f64,
    query_ns: u64,
    contacts: u32,
    force: f64,
    torque: f64,
    worst_step_s: f64,
    overruns: u64,
    faults: u64,
    phase: Phase,
}

impl Live {
    /// After one tick more.
    fn after(&self, tick: &ServoTick, detail: &Detail) -> Self {
        let faulted = tick.phase == Phase::Faulted && self.phase != Phase::Faulted;
        Self {
            ticks: tick.index + 1,
            time: tick.time,
            query_ns: detail.tick.times.query + detail.tick.times.depth,
            contacts: detail.tick.contacts,
            force: tick.wrench.force.length(),
            torque: tick.wrench.torque.length(),
            worst_step_s: self.worst_step_s.max(tick.step_s),
            overruns: self.overruns + u64::from(tick.overrun),
            faults: self.faults + u64::from(faulted),
            phase: tick.phase,
        }
    }
}

#[cfg(feature = "window")]
impl From<Live> for Numbers {
    fn from(live: Live) -> Self {
        Self {
            ticks: live.ticks,
            time: live.time,
            force: live.force,
            torque: live.torque,
            query: live.query_ns as f64 * 1e-9,
            worst_step: live.worst_step_s,
            overruns: live.overruns,
            faults: live.faults,
            contacts: live.contacts,
            phase: live.phase,
            ..Self::default()
        }
    }
}

/// What goes on beside the loop.
struct Beside {
    rows: Option<Rows>,
    claims: Option<RealTimeOptions>,
    window: Option<Window>,
    /// How long the run goes if the window cannot be opened, where its duration is not given.
    without: Option<Duration>,
    /// Nothing is said while it runs.
    quiet: bool,
}

/// What a run leaves behind.
struct Turned {
    statistics: RunStatistics,
    gatherer: Gatherer,
    claims: Option<RealTimeClaims>,
    /// As it is after its last step.
    engine: Engine,
}

/// Runs the loop on a thread of its own while this one shows how it goes.
fn turn(
    mut servo: Servo,
    mut engine: Engine,
    device: &mut (dyn HapticDevice + Send),
    script: &Script,
    beside: Beside,
) -> anyhow::Result<Turned> {
    let Beside { mut rows, claims, window, without, quiet } = beside;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // When there is a handler already, Ctrl-C simply ends the process; that is no reason not to run.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    let (mut live, newest) = latest(Live::default());
    let (granted, claimed) = mpsc::channel();
    let over = AtomicBool::new(false);
    let mut gatherer = Gatherer::new()?;
    std::thread::scope(|scope| {
        let (over, stop) = (&over, &stop);
        let loop_thread = std::thread::Builder::new().name("servo".to_owned()).spawn_scoped(scope, move || {
            let mut now = Live::default();
            let mut observe = |tick: &ServoTick, detail: &Detail| {
                gatherer.add(tick, detail);
                if let Some(rows) = &mut rows {
                    rows.row(tick, detail);
                }
                now = now.after(tick, detail);
                live.publish(now);
            };
            // The other end is there until this thread is joined.
            let _ = granted.send(claims.as_ref().map(claim));
            let step = script.step(|state: &DeviceState, dt| engine.step(state, dt));
            let statistics = servo.run(device, step, &mut observe, stop);
            over.store(true, Ordering::Relaxed);
            (statistics, gatherer, engine)
        })?;
        let claims = claimed.recv().ok().flatten();
        if !quiet {
            if let Some(claims) = &claims {
                safety::tell_claims(claims);
            }
            match window {
                Some(window) => show(window, newest, over, stop, without),
                None => watch(newest, over, stop, None),
            }
        }
        let (statistics, gatherer, engine) =
            loop_thread.join().map_err(|_| anyhow!("the servo thread failed outside of a step; please report this"))?;
        Ok(Turned { statistics, gatherer, claims, engine })
    })
}

/// Between two live lines.
const LIVE_PERIOD: Duration = Duration::from_millis(100);

/// Shows the window; the run ends with it. Where none can be opened, goes on without it, for the time `without` where the run has no end of its own.
fn show(window: Window, mut newest: Newest<Live>, over: &AtomicBool, stop: &AtomicBool, without: Option<Duration>) {
    match window.show(&mut || (*newest.get()).into(), over, stop) {
        Ok(()) => stop.store(true, Ordering::Relaxed),
        Err(why) => {
            output::note(format!("no window could be opened here ({why}); headless"));
            watch(newest, over, stop, without.map(|time| Instant::now() + time));
        }
    }
}

/// Shows the newest values until the run is over: a line drawn over on a terminal, nothing elsewhere. Stops it at `end`.
fn watch(mut newest: Newest<Live>, over: &AtomicBool, stop: &AtomicBool, end: Option<Instant>) {
    let shown = output::watched();
    let mut last = 0;
    while !over.load(Ordering::Relaxed) {
        std::thread::sleep(LIVE_PERIOD);
        if end.is_some_and(|end| Instant::now() >= end) {
            stop.store(true, Ordering::Relaxed);
        }
        let live = *newest.get();
        if shown {
            output::live(&format!(
                "{:6.0} Hz   query {:7.1} µs   {:3} contacts   {:5.2} N   {}",
                (live.ticks - last) as f64 / LIVE_PERIOD.as_secs_f64(),
                live.query_ns as f64 / 1e3,
                live.contacts,
                live.force,
                said(live.phase),
            ));
        }
        last = live.ticks;
    }
    if shown {
        output::live_end();
    }
}

/// Why there is no force, or not the whole.
fn said(phase: Phase) -> &'static str {
    match phase {
        Phase::Engaged => "",
        Phase::Idle => "press a button to feel it",
        Phase::Waiting => "out of contact first",
        Phase::Ramping => "engaging",
        Phase::Faulted => "a fault: no force",
        Phase::Stopped => "stopped by a fault",
    }
}

fn report(arguments: &RunArguments, summary: &Summary) -> anyhow::Result<()> {
    if arguments.json {
        return output::json(summary);
    }
    summary::print(summary);
    if !arguments.no_record {
        let plot: PathBuf = arguments.record.with_extension("svg");
        let recording = read_recording(&arguments.record)?;
        if recording.rows.len() > 1 {
            plots::write_svg(&crate::bench::run_figure(&arguments.scene, &recording.rows), &plot)?;
            output::line(format!("{:>14}  {} (plot: {})", "recorded", arguments.record.display(), plot.display()));
            output::line(format!("{:>14}  palpus replay {}", "again", arguments.record.display()));
        }
    }
    Ok(())
}
