//! The window on a recording: the bodies at their recorded poses, contacts and forces as the engine
//! computes them again, and curves of the whole run in which the user moves through time.
//!
//! A thread of the program replays the recording from the beginning and stores the visible state of
//! its ticks in [`Moments`], which the window shows. For a tick that has not been replayed yet,
//! only the recorded pose is shown. In each frame:
//!
//! 1. keys are handled (`keys`), and the time advances during playback;
//! 2. the tick of that time is taken from [`Moments`];
//! 3. the numbers of the tick are drawn on the right, the time line at the bottom (`panels`), and
//!    the scene in the middle.

mod icons;
mod keys;
mod panels;
mod timeline;

use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::egui;
use palpus::algebra::Pose;
use palpus_device::Cuts;

use super::WindowError;
use super::keys::{self as key_list, SceneAction};
use super::overlay::Legend;
use super::shell::{self, Status};
use super::theme::apply_theme;
use super::view3d::View3d;
use crate::moments::{Moments, Progress};
use crate::scene::Scene;
use crate::style::{Style, Theme};
use keys::Action;
use timeline::Timeline;

/// Width of the panel at the right, points.
const SIDE: f32 = 270.0;
/// Height of the panel of curves, points.
const CURVES: f32 = 300.0;
/// Playback speeds.
const SPEEDS: [f64; 9] = [0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0];
/// Index of the speed at which the recording was made.
const AS_IT_WAS: usize = 5;
/// Interval at which the window polls the progress of the replay.
const LOOK: Duration = Duration::from_millis(150);
/// Longest step of the playback in one frame, s, so that a slow frame does not skip.
const LONGEST_FRAME: f64 = 0.2;

/// A recording for the window.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The probe, then the environment.
    pub scene: Scene,
    /// Recorded ticks; at least one.
    pub ticks: Vec<ReplayedTick>,
    /// The replayed ticks.
    pub moments: Arc<Moments>,
    /// The tick that is shown first.
    pub begin: usize,
}

/// A recorded tick.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedTick {
    /// Time since the first tick, s; ascending.
    pub time: f64,
    /// Pose of the probe according to the device, world.
    pub pose: Pose,
    /// Force that the device got, N.
    pub force: f64,
    /// Torque that the device got, N·m.
    pub torque: f64,
    /// Number of contacts within the tolerance.
    pub contacts: u32,
    /// Number of clusters.
    pub clusters: u32,
    /// Separation of the deepest contact, m; negative in overlap, infinite without contact.
    pub separation: f64,
    /// Recorded time for contacts and depths, s.
    pub query: f64,
    /// Recorded time of the whole tick, s.
    pub total: f64,
    /// True if the tick began late.
    pub late: bool,
    /// Interventions of the safety chain.
    pub cuts: Cuts,
}

/// Shows a recording until the user closes the window; must be called on the main thread.
///
/// # Errors
///
/// Fails if no window can be opened.
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
    /// The shown time, s.
    time: f64,
    playing: bool,
    /// Time of the previous frame of the playback; `None` while paused.
    frame_before: Option<Instant>,
    speed: usize,
    /// The tick in the scene, and the tick of its moment, if there is one.
    shown: Option<(usize, Option<usize>)>,
    progress: Progress,
    every: usize,
    /// True if the panel at the right is shown.
    has_side: bool,
    help: bool,
    status: Status,
}

impl Player {
    fn new(creation: &eframe::CreationContext<'_>, replayed: Replayed) -> Result<Self, String> {
        let Replayed { mut scene, ticks, moments, begin } = replayed;
        let style = Style { theme: Theme::Dark, ..Style::default() };
        apply_theme(&creation.egui_ctx, style.theme);
        let begin = ticks.get(begin.min(ticks.len().saturating_sub(1))).ok_or("the recording has no ticks")?;
        if let Some(probe) = scene.bodies.first_mut() {
            probe.pose = begin.pose;
        }
        let time = begin.time;
        Ok(Self {
            view: View3d::new(creation, &scene, &style)?,
            timeline: Timeline::of(&ticks),
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
            has_side: true,
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

    /// Carries out the action of a key (step 1).
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
            Action::Contacts => self.style.contacts ^= true,
            Action::Clusters => self.style.clusters ^= true,
            Action::Wrench => self.style.wrench ^= true,
            Action::Anchors => self.style.anchors ^= true,
            Action::Glass => self.scene.turn_glass(),
            Action::Side => self.has_side ^= true,
            Action::Scene(action) => self.act_on_scene(context, action),
        }
    }

    fn act_on_scene(&mut self, context: &egui::Context, action: SceneAction) {
        match action {
            SceneAction::Picture => self.status.screenshot(context),
            SceneAction::Keys => self.help ^= true,
            of_scene => self.view.act(context, of_scene, &mut self.scene, &mut self.style),
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

    /// Advances the time during playback (step 1).
    fn go_on(&mut self, context: &egui::Context) {
        if self.playing {
            let now = Instant::now();
            let passed = self.frame_before.replace(now).map_or(0.0, |before| (now - before).as_secs_f64());
            self.time += passed.min(LONGEST_FRAME) * SPEEDS[self.speed];
            if self.time >= self.timeline.end() {
                (self.time, self.playing) = (self.timeline.end(), false);
            }
            context.request_repaint_after(self.view.wait());
        } else {
            self.frame_before = None;
        }
        (self.progress, self.every) = self.moments.progress();
        if self.progress.ticks < self.ticks.len() && self.progress.failed.is_none() {
            context.request_repaint_after(LOOK);
        }
    }

    /// Takes the tick of the current time (step 2).
    fn take_tick(&mut self) {
        let tick = self.tick();
        let complete = |(shown, moment): (usize, Option<usize>)| shown == tick && moment.is_some();
        if self.shown.is_some_and(complete) {
            return;
        }
        match self.moments.at(tick) {
            Some((kept, moment)) => {
                self.scene.pose_probes(&moment);
                self.scene.moment = Some(moment);
                self.shown = Some((tick, Some(kept)));
            }
            None => {
                if let Some(probe) = self.scene.bodies.first_mut() {
                    probe.pose = self.ticks[tick].pose;
                }
                self.scene.moment = None;
                self.shown = Some((tick, None));
            }
        }
    }

    /// Draws the scene in the middle (step 3).
    fn middle(&mut self, ui: &mut egui::Ui) {
        let area = self.view.place(ui, &self.scene);
        let legend = Legend::of(ui, area.rect, &self.scene, &self.style);
        self.view.keep_clear(&area, &self.scene, legend.as_ref().map(|legend| legend.plate));
        self.view.navigate(ui, &area);
        self.view.draw(ui, &area, &self.scene, &self.style, &[]);
        if let Some(legend) = &legend {
            legend.draw(ui, &self.style);
        }
    }
}

impl eframe::App for Player {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let elsewhere = context.memory(|memory| memory.focused().is_some());
        for action in keys::asked(&context, elsewhere) {
            self.act(&context, action);
        }
        self.go_on(&context);
        self.take_tick();
        if let Some(trouble) = self.view.trouble() {
            self.status.say(trouble);
        }
        // In a small window the panels are smaller, so that the scene keeps its space.
        let whole = context.content_rect().size();
        if self.has_side {
            egui::Panel::right("side").default_size(SIDE.min(0.42 * whole.x)).show(ui, |ui| {
                egui::ScrollArea::vertical().show(ui, |ui| self.side(ui));
            });
        }
        egui::Panel::bottom("time")
            .default_size(CURVES.min(0.5 * whole.y))
            .resizable(true)
            .show(ui, |ui| self.below(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.middle(ui));
        key_list::show(&context, &mut self.help, keys::list);
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}
