//! The window on a recording: the bodies where they were, contacts and forces as the engine finds them again, and curves of the whole run
//! to go to and fro in.
//!
//! A thread of the program runs the recording again from the beginning and leaves what its ticks have to show in [`Moments`]; the window
//! shows what is there. A tick that is not there yet is shown by the recorded pose alone. In each frame:
//!
//! 1. keys (`player_keys`), and time goes on while it plays;
//! 2. the tick that is then shown is taken from what there is;
//! 3. its numbers on the right; to go about in time, below; the scene in the middle.

use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::egui::{self, RichText};
use palpus::algebra::Pose;
use palpus_device::{Cut, Cuts};

use super::WindowError;
use super::dress::dress;
use super::overlay;
use super::player_keys::{self, Action};
use super::shell::{self, Status};
use super::timeline::{Curve, Mark, Timeline};
use super::view3d::{View3d, colour};
use crate::camera::View;
use crate::moments::{Moments, Progress};
use crate::scene::{Scene, ShownBody};
use crate::style::{Style, Theme};

/// Points.
const SIDE: f32 = 270.0;
const CURVES: f32 = 300.0;
const KEYS_WIDTH: f32 = 430.0;
/// How fast it plays.
const SPEEDS: [f64; 9] = [0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0];
const AS_IT_WAS: usize = 5;
/// While the recording is being run again, the window looks so often how far it is.
const LOOK: Duration = Duration::from_millis(150);

/// A recording to be shown.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The probe, then the environment.
    pub scene: Scene,
    /// As recorded; at least one.
    pub ticks: Vec<ReplayedTick>,
    /// What they have to show, as far as they were run again.
    pub moments: Arc<Moments>,
    /// The tick that is shown first.
    pub begin: usize,
}

/// A tick as it was recorded.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedTick {
    /// s since the first one, rising.
    pub time: f64,
    /// Where the device held the probe, world.
    pub pose: Pose,
    /// N, as the device got it.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// Contacts within the tolerance.
    pub contacts: u32,
    /// Clusters of them.
    pub clusters: u32,
    /// m: of the deepest, negative in overlap; infinite without contact.
    pub separation: f64,
    /// s: what finding contacts and depths took then.
    pub query: f64,
    /// s: what the whole tick took then.
    pub total: f64,
    /// It began late.
    pub late: bool,
    /// What the safety chain took away.
    pub cuts: Cuts,
}

/// Shows a recording until the user closes the window; must be called on the main thread.
///
/// # Errors
/// When no window can be opened here.
pub fn show_recording(replayed: Replayed) -> Result<(), WindowError> {
    let title = format!("palpus — {}", replayed.scene.title);
    shell::show(&title, |creation| Ok(Box::new(Player::new(creation, replayed)?)))
}

struct Player {
    scene: Scene,
    ticks: Vec<ReplayedTick>,
    moments: Arc<Moments>,
    timeline: Timeline,
    style: Style,
    view: View3d,
    /// s: where the run is looked at.
    time: f64,
    playing: bool,
    /// While it plays.
    frame_before: Option<Instant>,
    speed: usize,
    /// The tick that is in the scene, and of which tick its moment is, if there is one.
    shown: Option<(usize, Option<usize>)>,
    progress: Progress,
    every: usize,
    help: bool,
    status: Status,
}

impl Player {
    fn new(creation: &eframe::CreationContext<'_>, replayed: Replayed) -> Result<Self, String> {
        let Replayed { mut scene, ticks, moments, begin } = replayed;
        let style = Style { theme: Theme::Dark, ..Style::default() };
        dress(&creation.egui_ctx, style.theme);
        let begin = ticks.get(begin.min(ticks.len().saturating_sub(1))).ok_or("the recording has no ticks")?;
        if let Some(probe) = scene.bodies.first_mut() {
            probe.pose = begin.pose;
        }
        let time = begin.time;
        Ok(Self {
            view: View3d::new(creation, &scene, &style)?,
            timeline: timeline(&ticks),
            scene,
            ticks,
            moments,
            style,
            time,
            playing: false,
            frame_before: None,
            speed: AS_IT_WAS,
            shown: None,
            progress: Progress::default(),
            every: 1,
            help: false,
            status: Status::new("? shows the keys"),
        })
    }

    fn tick(&self) -> usize {
        self.timeline.tick(self.time)
    }

    fn go_to(&mut self, tick: usize) {
        self.time = self.timeline.time(tick.min(self.ticks.len() - 1));
    }

    /// Step 1.
    fn act(&mut self, context: &egui::Context, action: Action) {
        match action {
            Action::Play => {
                self.playing ^= true;
                if self.playing && self.time >= self.timeline.end() {
                    self.time = 0.0;
                }
            }
            Action::Step(by) => {
                self.playing = false;
                self.go_to(self.tick().saturating_add_signed(by as isize));
            }
            Action::Jump(by) => self.time = (self.time + by).clamp(0.0, self.timeline.end()),
            Action::Begin => self.time = 0.0,
            Action::End => self.time = self.timeline.end(),
            Action::EarlierMark | Action::LaterMark => self.go_to_mark(action == Action::LaterMark),
            Action::Strongest => {
                let strongest =
                    (0..self.ticks.len()).max_by(|a, b| self.ticks[*a].force.total_cmp(&self.ticks[*b].force));
                self.go_to(strongest.unwrap_or(0));
            }
            Action::Slower => self.speed = self.speed.saturating_sub(1),
            Action::Faster => self.speed = (self.speed + 1).min(SPEEDS.len() - 1),
            Action::Look(view) => self.view.look(view),
            Action::Everything => self.view.see_everything(),
            Action::Contacts => self.style.contacts ^= true,
            Action::Clusters => self.style.clusters ^= true,
            Action::Wrench => self.style.wrench ^= true,
            Action::Anchors => self.style.anchors ^= true,
            Action::Pieces => self.scene.bodies.iter_mut().for_each(|body| body.look.pieces ^= true),
            Action::Wires => self.scene.bodies.iter_mut().for_each(|body| body.look.wireframe ^= true),
            Action::Glass => self.scene.bodies.iter_mut().skip(1).for_each(|body| body.look.translucent ^= true),
            Action::Theme => self.turn_theme(context),
            Action::Picture => self.status.screenshot(context),
            Action::Keys => self.help ^= true,
        }
    }

    fn go_to_mark(&mut self, later: bool) {
        let (now, marks) = (self.tick(), &self.timeline.marks);
        let found = if later {
            marks.iter().map(|mark| mark.0).find(|tick| *tick > now)
        } else {
            marks.iter().rev().map(|mark| mark.0).find(|tick| *tick < now)
        };
        match found {
            Some(tick) => {
                self.playing = false;
                self.go_to(tick);
            }
            None => self.status.say(if later { "no late tick or fault after this" } else { "none before this" }),
        }
    }

    fn turn_theme(&mut self, context: &egui::Context) {
        self.style.theme = if self.style.theme == Theme::Dark { Theme::Light } else { Theme::Dark };
        dress(context, self.style.theme);
        for (body, colour) in self.scene.bodies.iter_mut().zip(ShownBody::colours(self.style.theme)) {
            body.colour = colour;
        }
        self.view.replace(&self.scene, &self.style);
    }

    /// Step 1, the time.
    fn go_on(&mut self, context: &egui::Context) {
        if self.playing {
            let now = Instant::now();
            let passed = self.frame_before.replace(now).map_or(0.0, |before| (now - before).as_secs_f64());
            self.time += passed.min(LONGEST_FRAME) * SPEEDS[self.speed];
            if self.time >= self.timeline.end() {
                (self.time, self.playing) = (self.timeline.end(), false);
            }
            context.request_repaint_after(self.view.frame());
        } else {
            self.frame_before = None;
        }
        (self.progress, self.every) = self.moments.progress();
        if self.progress.ticks < self.ticks.len() && self.progress.failed.is_none() {
            context.request_repaint_after(LOOK);
        }
    }

    /// Step 2.
    fn take_tick(&mut self) {
        let tick = self.tick();
        let complete = |(shown, moment): (usize, Option<usize>)| shown == tick && moment.is_some();
        if self.shown.is_some_and(complete) {
            return;
        }
        let Some(probe) = self.scene.bodies.first_mut() else { return };
        match self.moments.at(tick) {
            Some((kept, moment)) => {
                probe.pose = self.scene.moment_pose * moment.tool;
                self.scene.moment = Some(moment);
                self.shown = Some((tick, Some(kept)));
            }
            None => {
                probe.pose = self.ticks[tick].pose;
                self.scene.moment = None;
                self.shown = Some((tick, None));
            }
        }
    }

    /// Step 3, on the right.
    fn side(&mut self, ui: &mut egui::Ui) {
        let tick = self.tick();
        let now = self.ticks[tick];
        ui.heading(&self.scene.title);
        self.words_of_progress(ui, tick);
        ui.separator();
        let separation = match now.separation {
            s if s.is_finite() => format!("{:.3} mm", s * 1e3),
            _ => "none near".to_owned(),
        };
        shell::rows(
            ui,
            "numbers",
            [
                ("tick", format!("{tick} of {}", self.ticks.len())),
                ("time", format!("{:.3} s", now.time)),
                ("force", format!("{:.3} N", now.force)),
                ("torque", format!("{:.2} mN·m", now.torque * 1e3)),
                ("contacts", now.contacts.to_string()),
                ("clusters", now.clusters.to_string()),
                ("separation", separation),
                ("query then", format!("{:.1} µs", now.query * 1e6)),
                ("tick then", format!("{:.1} µs", now.total * 1e6)),
            ],
        );
        let colours = self.style.theme.colours();
        let cuts: Vec<&str> = now.cuts.iter().map(Cut::name).chain(now.late.then_some("late tick")).collect();
        let of_cuts = if now.cuts.is_fault() { colours.penetrating } else { colours.sliding };
        let cuts = if cuts.is_empty() { "nothing cut".to_owned() } else { cuts.join(", ").replace('_', " ") };
        ui.label(RichText::new(cuts).color(colour(if now.cuts.is_none() && !now.late {
            colours.faint
        } else {
            of_cuts
        })));
        ui.separator();
        for (words, shown) in [
            ("contacts (C)", &mut self.style.contacts),
            ("forces of clusters (A)", &mut self.style.clusters),
            ("force and torque (F)", &mut self.style.wrench),
            ("where friction holds (H)", &mut self.style.anchors),
        ] {
            ui.checkbox(shown, words);
        }
        for (body, name) in self.scene.bodies.iter_mut().zip(["probe", "environment"]) {
            ui.horizontal(|ui| {
                ui.label(name);
                ui.toggle_value(&mut body.look.pieces, "pieces");
                ui.toggle_value(&mut body.look.wireframe, "wires");
                ui.toggle_value(&mut body.look.translucent, "glass");
            });
        }
        ui.separator();
        self.views(ui);
        ui.separator();
        self.status.show(ui);
    }

    /// How far the recording has been run again, and whether it came out as recorded.
    fn words_of_progress(&self, ui: &mut egui::Ui, tick: usize) {
        let (colours, progress) = (self.style.theme.colours(), &self.progress);
        if let Some(why) = &progress.failed {
            ui.label(
                RichText::new(format!("run again as far as {:.2} s: {why}", self.timeline.time(progress.ticks)))
                    .color(colour(colours.penetrating)),
            );
        } else if progress.ticks < self.ticks.len() {
            let part = progress.ticks as f32 / self.ticks.len() as f32;
            ui.add(egui::ProgressBar::new(part).text("running it again"));
        }
        let (words, rgb) = match progress.first_difference {
            None if progress.ticks == 0 => ("nothing run again yet".to_owned(), colours.faint),
            None => (format!("{} wrenches as recorded, bit for bit", progress.ticks), colours.disjoint),
            Some(first) => (
                format!("{} of {} wrenches differ, from tick {first} on", progress.differing, progress.ticks),
                colours.penetrating,
            ),
        };
        ui.label(RichText::new(words).color(colour(rgb)));
        match self.shown {
            Some((_, None)) => drop(ui.label("not run again yet: the recorded pose alone")),
            Some((_, Some(kept))) if kept != tick => {
                ui.label(format!("for want of memory one tick of {} is kept; shown is {kept}", self.every));
            }
            _ => {}
        }
    }

    fn views(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        ui.horizontal_wrapped(|ui| {
            let named = [View::Front, View::Right, View::Top, View::Back, View::Left, View::Bottom];
            let views = named.map(Action::Look).into_iter().zip(["front", "right", "top", "back", "left", "bottom"]);
            let more = [
                (Action::Everything, "all (R)"),
                (Action::Theme, "light / dark (L)"),
                (Action::Picture, "picture (S)"),
                (Action::Keys, "?"),
            ];
            for (action, name) in views.chain(more) {
                if ui.button(name).clicked() {
                    self.act(&context, action);
                }
            }
        });
    }

    /// Step 3, below.
    fn below(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        ui.horizontal(|ui| {
            for (action, name) in [
                (Action::Begin, "|<"),
                (Action::Step(-1), "<"),
                (Action::Play, if self.playing { "stand" } else { "play" }),
                (Action::Step(1), ">"),
                (Action::End, ">|"),
            ] {
                if ui.button(name).clicked() {
                    self.act(&context, action);
                }
            }
            egui::ComboBox::from_id_salt("speed")
                .selected_text(format!("{}×", SPEEDS[self.speed]))
                .width(64.0)
                .show_ui(ui, |ui| {
                    for (k, speed) in SPEEDS.iter().enumerate() {
                        ui.selectable_value(&mut self.speed, k, format!("{speed}×"));
                    }
                });
            for (action, name) in [
                (Action::EarlierMark, "mark before (B)"),
                (Action::LaterMark, "next mark (N)"),
                (Action::Strongest, "largest force (M)"),
            ] {
                if ui.button(name).clicked() {
                    self.act(&context, action);
                }
            }
            let counted = |mark: Mark| self.timeline.marks.iter().filter(|(_, m)| *m == mark).count();
            ui.label(format!(
                "{:.3} of {:.3} s · {} late, {} with faults",
                self.time,
                self.timeline.end(),
                counted(Mark::Late),
                counted(Mark::Fault)
            ));
        });
        ui.spacing_mut().slider_width = (ui.available_width() - SLIDER_NUMBER).max(50.0);
        let end = self.timeline.end().max(f64::MIN_POSITIVE);
        ui.add(egui::Slider::new(&mut self.time, 0.0..=end).fixed_decimals(3).suffix(" s"));
        let known = if self.progress.ticks == 0 { 0 } else { self.progress.ticks - 1 };
        let tick = self.tick();
        if let Some(time) = self.timeline.show(ui, self.style.theme, tick, known) {
            self.time = time;
        }
    }

    /// Step 3, in the middle.
    fn middle(&mut self, ui: &mut egui::Ui) {
        let area = self.view.place(ui, &self.scene);
        self.view.navigate(ui, &area);
        self.view.draw(ui, &area, &self.scene, &self.style, &[]);
        overlay::legend(ui, area.rect, &self.scene, &self.style);
    }
}

/// s: a frame that took longer does not skip.
const LONGEST_FRAME: f64 = 0.2;
/// Points, of the number beside the slider.
const SLIDER_NUMBER: f32 = 90.0;

impl eframe::App for Player {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let elsewhere = context.memory(|memory| memory.focused().is_some());
        for action in player_keys::asked(&context, elsewhere) {
            self.act(&context, action);
        }
        self.go_on(&context);
        self.take_tick();
        if let Some(trouble) = self.view.trouble() {
            self.status.say(trouble);
        }
        egui::Panel::right("side").default_size(SIDE).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| self.side(ui));
        });
        egui::Panel::bottom("time").default_size(CURVES).resizable(true).show(ui, |ui| self.below(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.middle(ui));
        if self.help {
            egui::Window::new("keys").default_width(KEYS_WIDTH).open(&mut self.help).show(&context, player_keys::list);
        }
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}

/// The run's curves and marks.
fn timeline(ticks: &[ReplayedTick]) -> Timeline {
    let of = |value: fn(&ReplayedTick) -> f64| ticks.iter().map(value).collect::<Vec<f64>>();
    let curves = vec![
        Curve { name: "force, N", values: of(|t| t.force), colour: |theme| theme.colours().force },
        Curve { name: "torque, mN·m", values: of(|t| t.torque * 1e3), colour: |theme| theme.colours().torque },
        Curve { name: "contacts", values: of(|t| f64::from(t.contacts)), colour: |theme| theme.colours().disjoint },
        Curve { name: "query, µs", values: of(|t| t.query * 1e6), colour: |theme| theme.colours().cluster },
    ];
    let marks = ticks.iter().enumerate().filter_map(|(k, tick)| match tick {
        tick if tick.cuts.is_fault() => Some((k, Mark::Fault)),
        tick if tick.late => Some((k, Mark::Late)),
        _ => None,
    });
    Timeline::new(of(|t| t.time), curves, ticks.iter().map(|t| t.separation < 0.0).collect(), marks.collect())
}
