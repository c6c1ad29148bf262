//! The page of one recorded run.
//!
//! 1. The recording is read and measured from its rows ([`measures`]).
//! 2. The engine replays it: every wrench is compared bit for bit, and moments for pictures are
//!    kept.
//! 3. Pictures are painted without a display. Plots, tables and facts ([`facts`]) complete the
//!    page.
//!
//! The page is always made, and lists parts that could not be made. For example, if the meshes of a
//! recording are missing, its rows are still available.

mod facts;
mod measures;

use std::ops::ControlFlow;
use std::path::Path;

use palpus_io::scene::FilePolicy;
use palpus_io::{Recording, read_recording};
use palpus_window::{Moment, View};

use self::measures::{Choice, Measures, choices};
use super::html::{Html, Tone};
use super::pictures::{self, Frame, Shot};
use crate::durations::duration;
use crate::numbers::{counted, number_of, said};
use crate::plots::{self, Mark};
use crate::rerun::Rerun;
use crate::rerun::places::Places;
use crate::stage::Stage;
use crate::summary::Micros;
use crate::table::Table;

/// A run with everything that its page shows.
pub(super) struct Run {
    file: String,
    recording: Recording,
    measures: Measures,
    choices: Vec<Choice>,
    again: Result<Again, String>,
}

/// Results of the replay.
struct Again {
    stage: Stage,
    moments: Vec<Moment>,
    identical: usize,
    first_difference: Option<u64>,
}

impl Run {
    /// Reads a recording and replays it.
    pub(super) fn of(path: &Path, policy: FilePolicy) -> anyhow::Result<Self> {
        let recording = read_recording(path)?;
        let choices = choices(&recording.rows);
        let again = again(path, &recording, policy, &choices).map_err(|error| {
            let causes: Vec<String> = error.chain().map(ToString::to_string).collect();
            causes.join(": ")
        });
        let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { file, measures: Measures::of(&recording.rows), choices, again, recording })
    }

    /// Returns the whole page.
    pub(super) fn page(&self) -> anyhow::Result<String> {
        let name = facts::name(&self.recording.header);
        let title = format!("{name}: a run of {}", duration(self.measures.duration_s));
        let mut page = Html::new();
        page.element("header", "", |header| {
            header.text_in("h1", "", &title);
            header.text_in("p", "lead", &self.subtitle());
            self.badges(header);
        });
        self.tell(&mut page)?;
        page.prose_in("footer", "", &format!(
                "Made by palpus {} from the recording `{}`. This page loads no other files, so it can be mailed and stored.",
                env!("CARGO_PKG_VERSION"),
                self.file.replace('`', "'")
            ));
        Ok(page.page(&title))
    }

    fn subtitle(&self) -> String {
        let header = &self.recording.header;
        format!(
            "device {}, {} Hz, {} rendering; recorded by palpus {}",
            header.device,
            said(header.rate_hz, 4),
            if header.scene.render.coupling.is_some() { "coupled" } else { "direct" },
            header.palpus_version
        )
    }

    /// Writes the most important results in one or two words each.
    pub(super) fn badges(&self, html: &mut Html) {
        html.element("p", "", |badges| {
            match &self.again {
                Ok(Again { first_difference: None, .. }) => badges.badge(Tone::Good, "replays bit for bit"),
                Ok(Again { first_difference: Some(tick), .. }) => {
                    badges.badge(Tone::Bad, &format!("replays differently from tick {tick} on"))
                }
                Err(_) => badges.badge(Tone::Warning, "could not be replayed"),
            };
            match self.measures.fault_ticks() {
                0 => badges.badge(Tone::Good, "no faults"),
                ticks => badges.badge(Tone::Bad, &format!("faults in {}", number_of(ticks, "tick"))),
            };
            if self.recording.notice.is_some() {
                badges.badge(Tone::Warning, "the recording was cut off");
            }
            if !self.recording.changes.is_empty() {
                let changes = number_of(self.recording.changes.len() as u64, "change");
                badges.badge(Tone::Plain, &format!("{changes} of settings"));
            }
        });
    }

    /// Writes all content below the title.
    fn tell(&self, html: &mut Html) -> anyhow::Result<()> {
        self.tiles(html);
        let parts = [
            ("moments", "Moments"),
            ("felt", "What the hand felt"),
            ("cuts", "Faults and cuts"),
            ("again", "Run again"),
            ("settings", "Scene, device, settings"),
        ];
        let has_moments = self.again.as_ref().is_ok_and(|again| !again.moments.is_empty());
        let there = parts.into_iter().filter(|(id, _)| has_moments || *id != "moments");
        html.contents(&there.map(|(id, title)| (id, title.to_owned())).collect::<Vec<_>>());
        if has_moments {
            let mut moments = Html::new();
            self.moments(&mut moments)?;
            html.section("moments", "Moments", |section| {
                section.append(moments);
            });
        }
        html.section("felt", "What the hand felt", |section| {
            section.paragraph(
                "Shaded: the bodies overlap; elsewhere they are apart. With the virtual coupling, the tool stays \
                outside and only the hand moves inside. The numbered lines are the moments above; `s`: settings \
                changed.",
            );
            self.plots(section);
        });
        html.section("cuts", "Faults and cuts", |section| self.cuts(section));
        html.section("again", "Run again", |section| self.replayed(section));
        html.section("settings", "Scene, device, settings", |section| self.settings(section));
        Ok(())
    }

    /// Writes the key figures at the top.
    pub(super) fn tiles(&self, html: &mut Html) {
        let m = &self.measures;
        let depth = match m.least_separation {
            s if s < 0.0 => ("deepest contact", format!("{} mm", said(-s * 1e3, 3))),
            s if s.is_finite() => ("never penetrating; nearest", format!("{} mm", said(s * 1e3, 3))),
            _ => ("nearest", "never near".to_owned()),
        };
        let period = 1e6 / self.recording.header.rate_hz;
        let slow = if m.step.p999 > period { Tone::Warning } else { Tone::Plain };
        let tile = |what: &str, value: String, tone| (what.to_owned(), value, tone);
        let mut tiles = vec![
            tile("ticks", counted(m.ticks), Tone::Plain),
            tile("ticks a second", format!("{} Hz", said(m.rate_hz, 4)), Tone::Plain),
            tile("engine step, median", format!("{} µs", said(m.step.p50, 3)), Tone::Plain),
            tile("engine step, p99.9", format!("{} µs", said(m.step.p999, 3)), slow),
            tile("largest force", format!("{} N", said(m.force_max, 3)), Tone::Plain),
            tile("largest torque", format!("{} mN·m", said(m.torque_max * 1e3, 3)), Tone::Plain),
            tile("largest step of the force", format!("{} mN", said(m.force_step_max * 1e3, 3)), Tone::Plain),
            tile("most contacts", counted(m.contacts_max.into()), Tone::Plain),
            tile(depth.0, depth.1, Tone::Plain),
        ];
        if m.lateness.is_some() {
            tiles.push(tile("ticks late by over half a period", counted(m.late), Tone::Plain));
        }
        html.tiles(&tiles);
        html.folded("All numbers of the run", |inner| {
            let time = |name: &str, micros: &Micros| {
                let each = [micros.p50, micros.p99, micros.p999, micros.max].map(|value| said(value, 3));
                [vec![name.to_owned()], each.to_vec()].concat()
            };
            let mut rows = vec![
                time("engine step", &m.step),
                time("contact query", &m.query),
                time("force computation", &m.force),
                time("from tick to tick", &m.period),
            ];
            rows.extend(m.lateness.as_ref().map(|lateness| time("lateness of the tick", lateness)));
            inner.table(&Table::new(&["time (µs)", "median", "p99", "p99.9", "largest"], 1, rows));
            let fact = |name: &str, value: String| (name.to_owned(), value);
            let share = |ticks: u64| {
                format!("{} ({} %)", number_of(ticks, "tick"), said(100.0 * ticks as f64 / m.ticks.max(1) as f64, 3))
            };
            inner.facts(&[
                fact("duration", format!("{} s", said(m.duration_s, 5))),
                fact("in contact", share(m.touching)),
                fact("penetrating", share(m.penetrating)),
                fact("contacts a tick", format!("mean {}, most {}", said(m.contacts_mean, 3), m.contacts_max)),
                fact("most clusters", m.clusters_max.to_string()),
                fact("largest step of the torque", format!("{} mN·m", said(m.torque_step_max * 1e3, 3))),
                fact("saturated at the device's limits", share(m.saturated)),
            ]);
        });
    }

    /// Writes pictures of moments, and the meanings of their colours; nothing if there was no
    /// contact.
    pub(super) fn moments(&self, html: &mut Html) -> anyhow::Result<()> {
        let Ok(again) = &self.again else { return Ok(()) };
        let mut shots = Vec::new();
        for (k, (choice, moment)) in self.choices.iter().zip(&again.moments).enumerate() {
            let torque_max = self.recording.header.scene.render.limits.torque;
            let what = format!("{}: {}, at {}", k + 1, choice.what, pictures::caption(moment));
            let frames: &[Frame] = if k == 0 { &[Frame::Whole, Frame::Contacts] } else { &[Frame::Contacts] };
            for frame in frames {
                let shot = Shot { frame: *frame, view: View::Oblique, torque_max, as_in_the_paper: false };
                let near = if *frame == Frame::Contacts { "; seen from near" } else { "" };
                shots.push((format!("{what}{near}"), pictures::of_moment(&again.stage, moment, &shot)?));
            }
        }
        html.element("div", "shots", |all| {
            for (what, shot) in &shots {
                all.picture_pair(&shot.light, &shot.dark, what);
            }
        });
        html.key(&[
            ("disjoint", "contact, apart"),
            ("penetrating", "contact, overlapping"),
            ("cluster", "force of a cluster"),
            ("force", "force at the grip"),
            ("torque", "torque"),
            ("anchor", "friction holds"),
            ("sliding", "friction slides"),
        ]);
        Ok(())
    }

    /// Writes plots of force, torque, contacts, separation and times, and the histograms.
    pub(super) fn plots(&self, html: &mut Html) {
        let rows = &self.recording.rows;
        if rows.len() < 2 {
            html.paragraph("Too few ticks for a plot.");
            return;
        }
        let mut figure = plots::run_figure("", rows);
        let time_of = |tick: u64| rows.iter().find(|row| row.tick >= tick).map(plots::seconds);
        let moments = self.choices.iter().enumerate();
        let moments = moments.filter_map(|(k, choice)| Some((time_of(choice.tick)?, (k + 1).to_string())));
        let changes = self.recording.changes.iter().filter_map(|(tick, _)| Some((time_of(*tick)?, "s".to_owned())));
        figure.marks = moments.chain(changes).map(|(x, label)| Mark { x, label }).collect();
        html.plot(&plots::svg(&figure), "");
        for histogram in plots::run_histograms(rows) {
            html.plot(&plots::svg(&histogram), "");
        }
    }

    fn cuts(&self, html: &mut Html) {
        if self.measures.cuts.is_empty() {
            html.paragraph("The safety chain changed no wrench: the device got the computed ones.");
            return;
        }
        let row = |cut: &measures::CutTime| {
            vec![
                cut.cut.name().replace('_', " "),
                if cut.cut.is_fault() { "fault" } else { "shaping" }.to_owned(),
                counted(cut.ticks),
                said(cut.first, 4),
                said(cut.last, 4),
            ]
        };
        html.paragraph(
            "A fault removes the force, which returns only through a start-up. All other cuts change the \
            wrench without removing it. Every run begins with a start-up.",
        );
        let head = ["what was cut", "kind", "ticks", "first at (s)", "last at (s)"];
        html.table(&Table::new(&head, 2, self.measures.cuts.iter().map(row)));
    }

    fn replayed(&self, html: &mut Html) {
        match &self.again {
            Ok(Again { identical, first_difference: None, .. }) => html.paragraph(&format!(
                "While this page was made, the engine computed the run again from the recorded device states: all {} wrenches are the same, bit for bit.",
                counted(*identical as u64)
            )),
            Ok(Again { identical, first_difference: Some(tick), .. }) => html.paragraph(&format!(
                "While this page was made, the engine computed the run again from the recorded device states: {} \
                of {} wrenches are the same; the first difference is at tick {tick}. Another version, build or \
                processor may round differently.",
                counted(*identical as u64),
                counted(self.measures.ticks)
            )),
            Err(why) => html.element("p", "", |p| {
                p.text("It could not be replayed, so there are no pictures: ").text(why);
            }),
        };
        if let Some(notice) = &self.recording.notice {
            html.text_in("p", "", notice);
        }
        html.element("p", "", |p| {
            p.text("By hand: ").text_in("code", "", &format!("palpus replay {}", self.file));
        });
    }

    fn settings(&self, html: &mut Html) {
        let header = &self.recording.header;
        html.facts(&facts::of_header(header));
        html.heading("The engine's settings");
        html.facts(&facts::of_settings(&header.scene.render));
        if !self.recording.changes.is_empty() {
            html.heading("Changes within the run");
            let mut before = header.scene.render;
            let mut list = Vec::new();
            for (tick, settings) in &self.recording.changes {
                list.push((format!("from tick {tick}"), facts::changed(&before, settings)));
                before = *settings;
            }
            html.facts(&list);
        }
        let more = facts::of_more(&header.scene.more);
        if !more.is_empty() {
            html.folded("Other parameters of the run: safety chain, device", |inner| {
                inner.facts(&more);
            });
        }
    }
}

fn again(path: &Path, recording: &Recording, policy: FilePolicy, choices: &[Choice]) -> anyhow::Result<Again> {
    let (mut identical, mut first_difference) = (0, None);
    let (stage, mut rerun) = Rerun::new(recording, &Places::of(path, policy))?;
    choices.iter().for_each(|choice| rerun.keep(choice.tick));
    rerun.run(&mut |k, wrench| {
        let row = &recording.rows[k];
        if row.same_wrench(wrench) {
            identical += 1;
        } else {
            first_difference = first_difference.or(Some(row.tick));
        }
        ControlFlow::Continue(())
    })?;
    let moments = rerun.kept(1.0 / recording.header.rate_hz);
    Ok(Again { stage, moments, identical, first_difference })
}
