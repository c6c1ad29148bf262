//! One device of a session: its controls, its newest values, and its results.

use std::path::PathBuf;

use palpus::render::{Clustering, Settings, SettingsError, VirtualCoupling};
use palpus_device::{DeviceSpec, Guide, HapticDevice, Newest, Publisher, RealTimeClaims, RunEnd, SafetyLimits, latest};
use palpus_io::scene::CouplingMode;

use super::recordings::Recordings;
use super::servo_thread::{Log, ServoObserver, Worked, Working};
use super::watched::{self, WatchedTick};
use super::{Beginning, Live, Plan};
use crate::fault_log::FaultLog;
use crate::stage::Stage;
use crate::summary::{Gatherer, Summary};

/// See the module's description.
pub(super) struct SessionDevice {
    pub(super) spec: DeviceSpec,
    limits: SafetyLimits,
    /// Settings for the next tick.
    pub(super) settings: Settings,
    /// The coupling that fits the device.
    coupling: Option<VirtualCoupling>,
    crease_angle: Option<f64>,
    asked: Publisher<Settings>,
    pub(super) guide: Option<Publisher<Guide>>,
    pub(super) live: Newest<Live>,
    /// Queue with every tick, for an observer of this device.
    pub(super) watched: Option<rtrb::Consumer<WatchedTick>>,
    pub(super) recordings: Recordings,
    faults: Option<FaultLog>,
}

/// Results of a run for one device.
pub(crate) struct EndedDevice {
    pub(crate) summary: Summary,
    pub(crate) end: RunEnd,
    /// Files that were recorded.
    pub(crate) recordings: Vec<PathBuf>,
}

/// Parts that [`SessionDevice::take`] makes of a plan.
pub(super) struct Taken {
    pub(super) device: SessionDevice,
    /// The servo thread's part.
    pub(super) working: Working,
    /// The queue from which the engine takes settings.
    pub(super) newest: Newest<Settings>,
    pub(super) stage: Stage,
}

impl SessionDevice {
    /// Divides the plan of device `which` into its parts. If there are `files`, the run is recorded
    /// from the beginning to this device's file. `crease_angle`: the angle for which the engine can
    /// shade. `beginning`: options of recordings and of the fault log.
    pub(super) fn take(
        plan: Plan,
        which: usize,
        files: Option<&[PathBuf]>,
        crease_angle: Option<f64>,
        beginning: &Beginning<'_>,
    ) -> anyhow::Result<Taken> {
        let Plan { stage, rate_hz, limits, settings, device, guide, header, inside, .. } = plan;
        let spec = device.spec().clone();
        let coupling = preset(&stage, &spec, rate_hz, CouplingMode::Coupled).coupling;
        let (asked, newest) = latest(settings);
        let (publisher, live) = latest(Live::new(rate_hz, inside));
        let logged = beginning.fault_log.and_then(|file| FaultLog::start(file, &header, which));
        let (watch, faults) = logged.map_or((None, None), |(watch, log)| (Some(watch), Some(log)));
        let (mut recordings, (orders, over)) = Recordings::new(header, which, beginning.keep);
        let rows = files.map(|files| recordings.start(files, &settings)).transpose()?;
        let is_watched = beginning.watched && which == 0;
        let (watching, watched) = is_watched.then(watched::queue).unzip();
        let sight = ServoObserver {
            gatherer: Gatherer::new(settings.grip_a)?,
            log: Log { rows, in_force: settings, orders, over },
            live: (publisher, Live::new(rate_hz, inside)),
            faults: watch,
            watched: watching,
        };
        let working = Working { device, sight };
        let taken =
            Self { spec, limits, settings, coupling, crease_angle, asked, guide, live, watched, recordings, faults };
        Ok(Taken { device: taken, working, newest, stage })
    }

    /// Returns `wanted`, limited to what is possible for this tool. The engine's memory, the device
    /// and the grip stay the same, and the tool's contact offset is at most the tolerance.
    pub(super) fn fit(&self, wanted: &Settings) -> Settings {
        let Settings { capacity, time_budget, limits, grip_a, .. } = self.settings;
        let mut settings = Settings { capacity, time_budget, limits, grip_a, ..*wanted };
        if let (Some(shading), Some(crease_angle)) = (&mut settings.shading, self.crease_angle) {
            shading.crease_angle = crease_angle;
        }
        if let Some(coupling) = &mut settings.coupling {
            coupling.contact_offset = coupling.contact_offset.min(settings.contact_tolerance);
        }
        settings
    }

    /// Converts settings that were `wanted` for another device's tool to this tool, with the
    /// coupling of its own device.
    pub(super) fn fit_of_other(&self, wanted: &Settings) -> Settings {
        let Settings { saturation, .. } = self.settings;
        self.fit(&Settings { coupling: wanted.coupling.and(self.coupling), saturation, ..*wanted })
    }

    /// Passes these settings to the engine.
    pub(super) fn set(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        settings.validate()?;
        if *settings != self.settings {
            self.settings = *settings;
            self.asked.publish(*settings);
        }
        Ok(())
    }

    /// Returns the results after the loop has ended, with messages for the user.
    pub(super) fn end(
        self,
        worked: Worked,
        claims: Option<&RealTimeClaims>,
        rate_hz: f64,
    ) -> (EndedDevice, Vec<String>) {
        let Worked { statistics, gatherer } = worked;
        let (recordings, mut notes) = self.recordings.finish();
        notes.extend(self.faults.and_then(FaultLog::finish));
        let summary = gatherer.finish(&statistics, &self.limits, claims, rate_hz);
        (EndedDevice { summary, end: statistics.end, recordings }, notes)
    }
}

/// Returns the settings of a scene on a device, coupled or direct, without overrides.
pub(super) fn preset(stage: &Stage, spec: &DeviceSpec, rate_hz: f64, mode: CouplingMode) -> Settings {
    let clustering = match mode {
        CouplingMode::Coupled => Clustering::Smooth,
        CouplingMode::Direct => Clustering::Linkage,
    };
    Settings { clustering, ..stage.settings_in(mode, spec, rate_hz) }
}
