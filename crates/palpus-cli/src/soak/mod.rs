//! `palpus soak`: runs the loop in real time for a long time with a hand that moves at random, and
//! reports lateness and faults.
//!
//! 1. A bare timer is measured, as in `palpus doctor`. It shows the lateness that this machine
//!    causes for any loop.
//! 2. The scene's loop runs in real time with the same simulated device, safety chain, watchdog and
//!    priority as `palpus run`. The hand ([`scene`]) moves about the scene, into and out of
//!    contact, without end. The same seed gives the same motion.
//! 3. The servo thread keeps statistics ([`tally`]) in preallocated memory and publishes them once
//!    in each interval (a minute in a long run). At the same time, this thread measures the machine
//!    ([`machine`]): memory, frequency, load by other programs.
//! 4. After every interval the report ([`report`], [`figures`]) is rewritten, so that a report
//!    exists after a crash.
//! 5. When the time is over, or at Ctrl-C, the bare timer is measured again.
//!
//! The exit status is 1 if there was a fault, an allocation in the loop, or too many late ticks.

mod buckets;
mod figures;
mod machine;
mod report;
mod scene;
mod tally;

use std::cell::Cell;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::bail;
use palpus::render::{Limits, Settings, WorkLimit};
use palpus_device::{
    DeviceSpec, DeviceState, HandImpedance, HapticDevice, Newest, RealTimeClaims, RealTimeOptions, Rearm,
    RunStatistics, SafetyOptions, Servo, ServoOptions, ServoTick, SimulatedDevice, SimulationSettings, claim,
    latest_of,
};
use palpus_io::RecordingHeader;

use crate::args::SoakArguments;
use crate::doctor::timer;
use crate::engine::{Answer, Detail, Engine};
use crate::interrupt::stop_at_signal;
use crate::output;
use crate::recording::{self, Recording, RecordingOptions, Writing};
use crate::run::joined;
use crate::stage::Stage;
use crate::tools::name_recordings;
use buckets::Buckets;
use machine::Watch;
use report::{Report, Stretch};
use scene::{Ground, Hand};
use tally::{Interval, Tally};

/// Length of an interval of the report, except in short runs.
const INTERVAL: Duration = Duration::from_secs(60);
/// Smallest number of intervals; intervals are shorter in short runs.
const INTERVALS_AT_LEAST: u32 = 20;
/// Shortest length of an interval.
const SHORTEST_INTERVAL: Duration = Duration::from_millis(500);
/// Polling interval of this thread.
const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn soak(arguments: &SoakArguments) -> anyhow::Result<ExitCode> {
    let ground = scene::prepare(arguments)?;
    let rate_hz = ground.hands[0].stage.rate_hz(arguments.rate);
    let duration = arguments.duration.0;
    let interval = INTERVAL.min(duration / INTERVALS_AT_LEAST).max(SHORTEST_INTERVAL);
    let mut report = Report::new(arguments, &ground, rate_hz, interval)?;
    let tell = |text: String| {
        if !arguments.json {
            output::note(text);
        }
    };
    tell(report.announced());
    let timer = arguments.timer.0;
    let real_time = !arguments.no_realtime;
    report.before = bare(timer, rate_hz, real_time, &tell, "before")?;
    let stop = stop_at_signal();
    let run = Run { duration, interval, rate_hz, real_time };
    let (statistics, claims) = run.turn(&ground, arguments, &mut report, &stop)?;
    report.end(&statistics, claims.as_ref());
    report.write()?;
    if !timer.is_zero() {
        report.after = bare(timer, rate_hz, real_time, &tell, "after")?;
        report.write()?;
    }
    if arguments.json {
        output::json(&report.document())?;
    } else {
        report.print();
    }
    Ok(if report.held() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Measures the bare timer for this long, with the loop's real-time options.
fn bare(
    duration: Duration,
    rate_hz: f64,
    real_time: bool,
    tell: &dyn Fn(String),
    when: &str,
) -> anyhow::Result<Option<Stretch>> {
    if duration.is_zero() {
        return Ok(None);
    }
    tell(format!("{:.0} s of a bare timer {when}", duration.as_secs_f64()));
    let options = real_time.then(RealTimeOptions::default);
    let (lateness, _) = timer::lateness(duration.as_secs_f64(), rate_hz, options)?;
    let mut buckets = Buckets::default();
    lateness.iter().for_each(|nanos| buckets.add(*nanos));
    Ok(Some(Stretch::of(&buckets)))
}

/// Options of the run.
struct Run {
    duration: Duration,
    interval: Duration,
    rate_hz: f64,
    real_time: bool,
}

impl Run {
    /// Runs the loop on its own thread while this thread updates the report.
    fn turn(
        &self,
        ground: &Ground,
        arguments: &SoakArguments,
        report: &mut Report,
        stop: &AtomicBool,
    ) -> anyhow::Result<(Vec<RunStatistics>, Option<RealTimeClaims>)> {
        // The wall clock ends the run, not the number of ticks, because a late loop makes fewer
        // ticks. After three faults the loop engages by itself, because no person is there to press
        // a key.
        let safety = SafetyOptions { rearm: Rearm::Automatic, ..SafetyOptions::default() };
        let mut servo = Servo::new(ServoOptions { rate_hz: self.rate_hz, safety, ..ServoOptions::default() })?;
        let count = ground.hands.len();
        let files =
            arguments.record.as_deref().map(|file| recording::of_run(file, count, &RecordingOptions::default()));
        let (mut devices, mut settings, mut rows, mut writing) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (which, hand) in ground.hands.iter().enumerate() {
            if which > 0 {
                servo = servo.with_device(safety)?;
            }
            let device = self.device(hand, arguments)?;
            settings.push(hand.stage.settings_for(device.spec(), self.rate_hz));
            if let Some(files) = &files {
                let mut header = self.header(&hand.stage, settings[which], device.spec(), &safety);
                if count > 1 {
                    name_recordings(which, files, &mut header.scene.more);
                }
                let recording = Recording::start(&files[which], &header, &RecordingOptions::default())?;
                rows.push(recording.rows);
                writing.push(recording.writing);
            }
            devices.push(device);
        }
        let mut engine = Engine::new(&ground.hands[0].stage, &settings)?;
        engine.allow(WorkLimit::TimeBudget);
        let (publisher, newest) = latest_of(Interval::default);
        let mut tally = Tally::new(self.interval, count, publisher);
        let over = AtomicBool::new(false);
        let (granted, claimed) = mpsc::channel();
        let claims_of = self.real_time.then(RealTimeOptions::default);
        let (statistics, claims) = std::thread::scope(|scope| {
            let over = &over;
            let thread = std::thread::Builder::new().name("servo".to_owned()).spawn_scoped(scope, move || {
                // The receiver exists until this thread is joined.
                let _ = granted.send(claims_of.as_ref().map(claim));
                let available = vec![Cell::new(Limits::UNLIMITED); count];
                let step = |states: &[DeviceState], dt: f64, answers: &mut [Answer]| {
                    for (which, available) in available.iter().enumerate() {
                        engine.set_available(which, &available.get());
                    }
                    engine.step(states, dt, answers);
                };
                tally.begin();
                let mut observe = |tick: &ServoTick, detail: &Detail| {
                    available[tick.device].set(tick.available);
                    tally.add(tick, detail);
                    if let Some(rows) = rows.get_mut(tick.device) {
                        rows.row(tick, Some(detail));
                    }
                };
                let mut devices: Vec<_> = devices.iter_mut().collect();
                let statistics = servo.run_all(&mut devices, step, &mut observe, stop);
                over.store(true, Ordering::Relaxed);
                (statistics, tally.finish())
            })?;
            let claims = claimed.recv().ok().flatten();
            let kept = self.keep(report, newest, over, stop);
            // Stops and joins the loop even if the report failed.
            stop.store(true, Ordering::Relaxed);
            let (statistics, last) = joined(thread.join())?;
            kept?;
            report.add(&last, machine::Sample::take());
            anyhow::Ok((statistics?, claims))
        })?;
        writing.into_iter().flat_map(Writing::finish).for_each(output::note);
        Ok((statistics, claims))
    }

    /// Returns the recording header for the simulated device.
    fn header(&self, stage: &Stage, settings: Settings, spec: &DeviceSpec, safety: &SafetyOptions) -> RecordingHeader {
        let mut header = stage.header(settings, "sim", self.rate_hz);
        let (limits, enable_mode) = (safety.limits(spec, self.rate_hz), safety.enable_mode(spec));
        crate::safety::recorded(&limits, enable_mode, safety, &mut header.scene.more);
        header
    }

    fn device(
        &self,
        Hand { stage, wander }: &Hand,
        arguments: &SoakArguments,
    ) -> anyhow::Result<SimulatedDevice<impl palpus_device::Intent + use<>>> {
        let hand = stage.hand(arguments.hand.as_deref())?;
        if hand == HandImpedance::NONE {
            bail!("the hand must hold the device; choose another hand than `none`");
        }
        let (wander, grip_a) = (wander.clone(), stage.settings.grip_a);
        let settings = SimulationSettings { rate_hz: self.rate_hz, hand, ..SimulationSettings::default() };
        Ok(SimulatedDevice::new(settings, move |time| wander.pose(time).with_origin(grip_a))?)
    }

    /// Updates the report until the loop ends; stops the loop at the end of its duration.
    fn keep(
        &self,
        report: &mut Report,
        mut newest: Newest<Interval>,
        over: &AtomicBool,
        stop: &AtomicBool,
    ) -> anyhow::Result<()> {
        let begun = Instant::now();
        let mut watch = Watch::new();
        while !over.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
            if begun.elapsed() >= self.duration {
                stop.store(true, Ordering::Relaxed);
            }
            report.see(&mut watch, begun.elapsed());
            if let Some(interval) = newest.take() {
                report.add(interval, machine::Sample::take());
                report.write()?;
                if output::watched() {
                    output::live(&report.live());
                }
            }
        }
        if output::watched() {
            output::live_end();
        }
        Ok(())
    }
}
