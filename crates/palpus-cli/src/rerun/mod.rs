//! Replays a recording together with the recordings of the scene's other tools, because the tools
//! touch each other.

pub(crate) mod one;
pub(crate) mod places;

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, bail};
use palpus::algebra::{Twist, Wrench};
use palpus::render::Limits;
#[cfg(feature = "window")]
use palpus_device::Publisher;
use palpus_device::{ContactAccount, Cut, DeviceState, SafetyChain};
use palpus_io::{ContentHash, Recording, read_recording};
use palpus_window::Moment;

use self::one::{check_rows, crease_angle, elapsed, has_stepped, recorded_cuts, stage_of, state, work_allowed};
use self::places::Places;
use crate::divergence::{Comparison, Report};
use crate::engine::{Answer, Engine};
use crate::lead_out::LeadOut;
use crate::stage::{self, Stage};
use crate::{safety, tools};

/// Receives each replayed row: tool, row number, wrench for the device, contacts.
type RowVisitor<'a> = &'a mut dyn FnMut(usize, usize, &Wrench, u32) -> ControlFlow<()>;

/// A recording, the recordings that belong to it, and the engine that replays them.
pub(crate) struct Rerun<'a> {
    /// Number of the tool of the named recording.
    pub(crate) which: usize,
    named: &'a Recording,
    /// Recordings of the other tools, in their order.
    others: Vec<Recording>,
    engine: Engine,
}

impl<'a> Rerun<'a> {
    /// Prepares the recorded scene and the engine as they were when the recordings began. The
    /// engine has memory for the recorded changes of settings.
    pub(crate) fn new(named: &'a Recording, places: &Places<'_>) -> anyhow::Result<(Stage, Self)> {
        let (which, others) = read_others(named, places.recording)?;
        let recordings = in_order(which, named, &others);
        recordings.iter().try_for_each(|recording| check_rows(recording))?;
        let contents: Vec<ContentHash> =
            recordings.iter().skip(1).map(|recording| recording.header.scene.probe.content).collect();
        let stage = stage_of(recordings[0], &contents, places)?;
        if !others.is_empty() && stage.others.len() != others.len() {
            let (now, then) = (stage.others.len() + 1, recordings.len());
            bail!("the scene has {now} tools and the recording {then}; replay needs the same scene");
        }
        for (of_tool, recording) in stage.of_others().zip(recordings.iter().skip(1)) {
            stage::check_content(&of_tool, &recording.header.scene)?;
        }
        let settings: Vec<_> = recordings.iter().map(|recording| recording.header.scene.render).collect();
        let mut engine = Engine::new(&stage, &settings)?;
        if let Some(angle) = recordings.iter().find_map(|recording| crease_angle(recording)) {
            engine = engine.with_surfaces(angle);
        }
        for (tool, recording) in recordings.iter().enumerate() {
            engine.lead_out(tool, LeadOut::of_recording(&recording.header.scene.more));
        }
        Ok((stage, Self { which, named, others, engine }))
    }

    /// Returns the recording of the first tool.
    pub(crate) fn first(&self) -> &Recording {
        in_order(self.which, self.named, &self.others)[0]
    }

    /// Calls `each` with every row of the named recording and its wrench, until `each` breaks.
    pub(crate) fn run(&mut self, each: &mut dyn FnMut(usize, &Wrench) -> ControlFlow<()>) -> anyhow::Result<()> {
        let which = self.which;
        self.run_all(&mut |tool, k, wrench, _| {
            if tool == which { each(k, wrench) } else { ControlFlow::Continue(()) }
        })
    }

    /// Replays all recordings and reports the result of each.
    pub(crate) fn compare(mut self) -> anyhow::Result<Vec<Report>> {
        let others = std::mem::take(&mut self.others);
        let recordings = in_order(self.which, self.named, &others);
        let mut comparisons: Vec<_> = recordings.iter().map(|recording| Comparison::new(recording)).collect();
        run_again(&recordings, &mut self.engine, &mut |tool, k, wrench, contacts| {
            comparisons[tool].add(k, wrench, contacts);
            ControlFlow::Continue(())
        })?;
        Ok(comparisons.iter().map(Comparison::report).collect())
    }

    fn run_all(&mut self, each: RowVisitor<'_>) -> anyhow::Result<()> {
        run_again(&in_order(self.which, self.named, &self.others), &mut self.engine, each)
    }

    /// Keeps the moment of tick number `tick`.
    pub(crate) fn keep(&mut self, tick: u64) {
        self.engine.keep(tick);
    }

    /// Returns the kept ticks for display, in the order of the requests. `period`: length of a
    /// tick, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        self.engine.kept(period)
    }

    /// Returns the moment of the kept tick, or of the last tick. `period`: length of a tick, s.
    pub(crate) fn shown(self, period: f64) -> Moment {
        self.engine.shown(period)
    }

    /// Returns the capacity that a moment needs.
    #[cfg(feature = "window")]
    pub(crate) fn capacity(&self) -> usize {
        self.engine.capacity()
    }

    /// Publishes the moment of every tick through `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: Publisher<Moment>) {
        self.engine.publish(publisher);
    }
}

/// Returns the number of the tool of `recording`, which was read from `path`, and the recordings of
/// the other tools from the same folder.
fn read_others(recording: &Recording, path: &Path) -> anyhow::Result<(usize, Vec<Recording>)> {
    let Some((which, names)) = tools::named_by(recording) else { return Ok((0, Vec::new())) };
    let mut others = Vec::new();
    for (k, name) in names.iter().enumerate().filter(|(k, _)| *k != which) {
        // Only file names without a path are accepted, so that a recording cannot make the program
        // read other files.
        if Path::new(name).file_name().is_none_or(|file| file != *name) || name.contains('\\') {
            bail!("{name:?} is not the name of a file in the folder of {}", path.display());
        }
        let beside = path.with_file_name(name);
        let other = read_recording(&beside).with_context(|| {
            format!(
                "{} is the recording of one of {} tools; the recordings of the others are needed",
                path.display(),
                names.len()
            )
        })?;
        if tools::named_by(&other).is_none_or(|(of, all)| of != k || all.len() != names.len()) {
            bail!("{} is not the recording of the {} tool", beside.display(), tools::name(k));
        }
        others.push(other);
    }
    Ok((which, others))
}

/// Returns all recordings in the order of their tools. `named` is the recording of tool `which`.
fn in_order<'a>(which: usize, named: &'a Recording, others: &'a [Recording]) -> Vec<&'a Recording> {
    let mut all: Vec<&Recording> = others.iter().collect();
    all.insert(which.min(all.len()), named);
    all
}

/// Replays recordings on a prepared engine and calls `each` with every row, until `each` breaks.
fn run_again(recordings: &[&Recording], engine: &mut Engine, each: RowVisitor<'_>) -> anyhow::Result<()> {
    let mut chains = chains(recordings)?;
    let mut contact = ContactAccount::new(chains.iter().flatten().map(SafetyChain::limits));
    let mut states: Vec<DeviceState> = recordings.iter().map(|recording| state(&recording.rows[0])).collect();
    let mut changes: Vec<_> = recordings.iter().map(|recording| recording.changes.iter().peekable()).collect();
    let mut answers: Vec<Answer> = vec![None; recordings.len()];
    let mut works = vec![[0.0; 2]; recordings.len()];
    let ticks = recordings.iter().map(|recording| recording.rows.len()).max().unwrap_or_default();
    for k in 0..ticks {
        // Takes only recordings with rows left. A lost device has no more rows, and its tool stays
        // in place.
        let rows = || recordings.iter().filter_map(|recording| recording.rows.get(k));
        for (held, recording) in states.iter_mut().zip(recordings) {
            *held = recording.rows.get(k).map_or(DeviceState { twist: Twist::default(), ..*held }, state);
        }
        for (which, changes) in changes.iter_mut().enumerate() {
            while let Some((tick, settings)) = changes.next_if(|(tick, _)| *tick <= k as u64) {
                let tool = tools::name(which);
                let problem = || format!("the settings of the {tool} tool from tick {tick} on cannot be set");
                engine.set_settings(which, settings).with_context(problem)?;
            }
        }
        answers.fill(None);
        if rows().all(has_stepped) {
            engine.allow(rows().find_map(work_allowed).into());
            let dt = rows().next().map_or(0.0, |row| row.dt);
            engine.step(&states, dt, &mut answers);
        }
        if rows().any(|row| recorded_cuts(row).has(Cut::Panic)) {
            engine.forget();
        }
        for (work, answer) in works.iter_mut().zip(&answers) {
            *work = answer.as_ref().map_or([0.0; 2], |answer| answer.from_others);
        }
        contact.pass(&mut works);
        for (which, recording) in recordings.iter().enumerate() {
            let Some(row) = recording.rows.get(k) else { continue };
            let (recorded_cuts, answer) = (recorded_cuts(row), answers[which].as_ref());
            let computed = answer.map_or(Wrench::ZERO, |answer| answer.wrench);
            let mut wrench = computed;
            if let Some(chain) = &mut chains[which] {
                let own = answer.map_or([0.0; 2], |answer| answer.received);
                chain.receive([works[which][0] + own[0], works[which][1] + own[1]]);
                let shaped = chain.shape(&states[which], &computed, recorded_cuts, elapsed(row));
                // In the tick in which a device was lost, the brake gave its last wrench.
                let lost = recorded_cuts.has(Cut::Device);
                engine.set_available(which, if lost { &Limits::UNLIMITED } else { &shaped.available });
                wrench = if lost { Wrench::ZERO } else { shaped.wrench };
            }
            let contacts = answer.map_or(row.contacts, |answer| answer.detail.tick.contacts);
            if each(which, k, &wrench, contacts).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// Returns the safety chain of each recording. Old recordings of a single tool have no safety
/// chain.
fn chains(recordings: &[&Recording]) -> anyhow::Result<Vec<Option<SafetyChain>>> {
    let chain = |recording: &&Recording| {
        let header = &recording.header;
        let chain = safety::of_recording(&header.scene.more, 1.0 / header.rate_hz)?;
        if chain.is_none() && recordings.len() > 1 {
            bail!("the recording's header lacks values of its safety chain");
        }
        Ok(chain)
    };
    recordings.iter().map(chain).collect()
}
