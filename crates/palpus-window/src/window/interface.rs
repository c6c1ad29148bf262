//! The frames of the window, and the effects of mouse and keys. The module's description has an
//! overview.

mod actions;

use eframe::egui::{self, Color32, Frame, Margin, Panel, ScrollArea, Ui};
use glam::DVec3;
use palpus::algebra::Pose;
use palpus_device::Newest;

use super::bar::{self, Bar};
use super::beside::{self, Beside};
use super::feel::Feel;
use super::hand::Hand;
use super::handles::{Dragged, Handles, Moves};
use super::history::History;
use super::keys;
use super::opening::Opening;
use super::overlay::{self, Legend, Notices};
use super::plots::{Asked, Plots};
use super::run::{Loading, Run};
use super::run_keys::{self, Action};
use super::scale::Scale;
use super::status::Status;
use super::theme::apply_theme;
use super::view3d::View3d;
use crate::moment::Moment;
use crate::scene::Scene;
use crate::style::{Style, Theme};

/// Width of the panel at the right, points.
const SIDE: f32 = 340.0;
/// Height of the line of the state, points.
const STATE: f32 = 28.0;
/// Windows narrower than this show the panel at the right only on request.
const ROOMY: f32 = 900.0;
/// Height of the plots, points.
const PLOTS: f32 = 176.0;
/// In windows lower than this (points), the plots have the height [`LOW_PLOTS`].
const LOW: f32 = 760.0;
/// Height of the plots in low windows, so that the scene keeps its space, points.
const LOW_PLOTS: f32 = 132.0;
/// Margin of the panel at the right, points.
const SIDE_MARGIN: i8 = 14;

/// The state of the window.
pub(super) struct Interface<'a> {
    scene: Scene,
    style: Style,
    view: View3d,
    moments: Newest<Moment>,
    run: &'a mut dyn Run,
    hand: Hand,
    handles: Handles,
    /// The next run starts with the probe held at this pose.
    jump: Option<Pose>,
    feel: Feel,
    status: Status,
    history: History,
    plots: Plots,
    beside: Option<Beside>,
    force_scale: Scale,
    torque_scale: Scale,
    opening: Option<Opening>,
    notices: Notices,
    /// The failure that was reported last.
    failure: Option<String>,
    /// The scene's widget. While it has the keyboard focus, keys move the hand.
    view_id: Option<egui::Id>,
    frozen: bool,
    /// True if the user has moved the probe, so that no hint is needed.
    was_taken: bool,
    /// The user's choice for the panel at the right; `None` shows it if there is space.
    side: Option<bool>,
    help: bool,
    /// The message about the start of this run.
    start: Option<String>,
    /// True if the message about a run without contact was shown.
    untouched: bool,
    /// Translation of the probe to the place at which the force can begin, world, m.
    way_out: Option<DVec3>,
}

impl<'a> Interface<'a> {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        scene: Scene,
        moments: Newest<Moment>,
        run: &'a mut dyn Run,
    ) -> Result<Self, String> {
        let style = Style { theme: Theme::Dark, ..Style::default() };
        let view = View3d::new(creation, &scene, &style)?;
        apply_theme(&creation.egui_ctx, style.theme);
        let notices = Notices::default();
        notices.tell("? shows all keys");
        Ok(Self {
            view,
            scene,
            style,
            moments,
            hand: Hand::default(),
            handles: Handles::default(),
            jump: None,
            feel: Feel::of(run),
            run,
            status: Status::default(),
            history: History::default(),
            plots: Plots::default(),
            beside: None,
            force_scale: Scale::default(),
            torque_scale: Scale::default(),
            opening: None,
            notices,
            failure: None,
            view_id: None,
            frozen: false,
            was_taken: false,
            side: None,
            help: false,
            start: None,
            untouched: false,
            way_out: None,
        })
    }

    /// Takes the newest values (step 1).
    fn take_newest(&mut self, context: &egui::Context) {
        let loading = self.run.loading();
        if let Some((scene, moments)) = self.run.replaced() {
            self.replace(scene, moments);
            context.send_viewport_cmd(egui::ViewportCommand::Title(super::title(&self.scene)));
        }
        let failure = if let Loading::Failed(why) = loading { Some(why) } else { None };
        if failure != self.failure {
            if let Some(why) = &failure {
                self.notices.complain(why);
            }
            self.failure = failure;
        }
        if let Some(why) = self.view.trouble() {
            self.notices.complain(format!("the bodies cannot be drawn: {why}"));
        }
        if self.frozen {
            return;
        }
        let now = self.run.numbers();
        self.status.take(now);
        self.way_out = now.way_out;
        let start = self.run.start();
        if start != self.start {
            if let Some(words) = &start {
                self.notices.complain(words);
            }
            self.start = start;
        }
        let is_scripted = !self.untouched && !self.was_taken;
        if let Some(why) = is_scripted.then(|| self.run.untouched()).flatten() {
            self.untouched = true;
            self.notices.complain(why);
        }
        let moment = self.moments.get();
        self.scene.pose_probes(moment);
        match &mut self.scene.moment {
            Some(shown) => shown.clone_from(moment),
            none => *none = Some(moment.clone()),
        }
        let limits = self.run.settings().limits;
        // Both pictures of a comparison have the same scale.
        let compared = self.beside.as_ref().and_then(|beside| beside.scene.moment.as_ref());
        let [force, torque] =
            compared.map_or([0.0; 2], |moment| [moment.wrench.force, moment.wrench.torque].map(DVec3::length));
        self.scene.force_scale = self.force_scale.follow(now.force.max(force), now.time, limits.force);
        self.scene.torque_scale = self.torque_scale.follow(now.torque.max(torque), now.time, limits.torque);
        let Self { history, beside, run, scene, .. } = self;
        run.ticks(&mut |tick| history.push(tick));
        history.push_moment(self.moments.get());
        if let Some(beside) = beside {
            beside.take_newest(scene, history, *run);
        }
    }

    /// Shows the moment at the time that the user has selected.
    fn look_back(&mut self) {
        let found = self.plots.cursor.and_then(|time| self.history.moment(time));
        if let Some(moment) = found {
            let moment = moment.clone();
            self.scene.pose_probes(&moment);
            self.scene.moment = Some(moment);
        }
    }

    /// Selects the time or the curves that the user chose in the plots.
    fn ask_plots(&mut self, asked: Asked) {
        match asked {
            Asked::Nothing => {}
            Asked::NextKind => self.plots.kind = self.plots.kind.next(),
            Asked::LookAt(time) => {
                if !self.frozen {
                    self.frozen = true;
                    self.notices.tell("showing the past; the loop goes on (Z returns to the present)");
                }
                self.plots.cursor = Some(time);
                self.look_back();
            }
        }
    }

    /// Shows another scene, from the direction in which the camera looked before.
    fn replace(&mut self, mut scene: Scene, moments: Newest<Moment>) {
        for (k, body) in scene.bodies.iter_mut().enumerate() {
            body.colour = body.part.colour(self.style.theme);
            body.look = self.scene.bodies.get(k).map_or(body.look, |before| before.look);
        }
        self.scene = scene;
        self.moments = moments;
        self.view.replace(&self.scene, &self.style);
        self.view.see_everything();
        self.hand.forget();
        if let Some(pose) = self.jump.take() {
            self.hand.hold_at(pose, self.run.settings().grip_a, self.run);
        }
        self.feel = Feel::of(self.run);
        self.history.clear();
        (self.frozen, self.plots.cursor, self.beside) = (false, None, None);
        self.untouched = false;
        self.notices.tell(format!("now: {}", self.scene.title));
    }

    /// True if the panel at the right is visible.
    fn has_side(&self, context: &egui::Context) -> bool {
        self.side.unwrap_or(context.content_rect().width() >= ROOMY)
    }

    /// Draws the panel at the right (step 3).
    fn side(&mut self, ui: &mut Ui, actions: &mut Vec<Action>) {
        self.status.show(ui, self.run, self.style.theme);
        ui.separator();
        let said = self.feel.show(ui, self.run, actions);
        self.notices.check(said);
    }

    /// Returns the position of the handles, world.
    fn pivot(&self) -> DVec3 {
        match (self.handles.moves, self.scene.bodies.first()) {
            (Moves::Grip, Some(probe)) => probe.pose.point(self.run.settings().grip_a),
            _ => self.hand.pivot(&self.scene),
        }
    }

    /// Draws the scene in the middle (step 3). `is_free`: no control has the focus, and no dialog
    /// is open.
    fn middle(&mut self, ui: &mut Ui, is_free: bool, actions: &mut Vec<Action>) {
        let (area, other) = self.view.place_beside(ui, &self.scene, self.beside.is_some());
        let legend = Legend::of(ui, area.rect, &self.scene, &self.style);
        self.view.keep_clear(&area, &self.scene, legend.as_ref().map(|legend| legend.plate));
        self.view_id = Some(area.response.id);
        let has_focus = area.response.has_focus();
        if has_focus {
            // Arrow keys move the probe, not the focus.
            let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(area.response.id, filter));
        }
        let pivot = self.pivot();
        let by_handles = match self.handles.act(ui, &area, &self.view, pivot) {
            Dragged::Nothing => None,
            Dragged::Held => Some(None),
            Dragged::Probe(motion) => Some(Some(motion)),
            Dragged::Grip(way) => {
                self.move_grip(way);
                Some(None)
            }
        };
        let is_taken = self.hand.act(ui, &area, &self.view, &self.scene, is_free, by_handles, self.run);
        if !is_taken {
            self.view.navigate(ui, &area);
            if let Some(other) = &other {
                self.view.navigate(ui, other);
            }
        }
        if self.hand.touches() || self.handles.has_mouse() {
            ui.set_cursor_icon(if is_taken { egui::CursorIcon::Grabbing } else { egui::CursorIcon::Grab });
        }
        if !self.was_taken {
            self.view.keep_in_view(&area, &self.scene);
        }
        // The handles would cover the values at the arrows.
        let style = Style { words: self.handles.moves == Moves::Nothing, ..self.style };
        let values = self.view.draw(ui, &area, &self.scene, &style, &[]);
        if let (Some(other), Some(beside)) = (&other, &self.beside) {
            self.view.draw(ui, other, &beside.scene, &self.style, &[]);
        }
        self.hand.draw(ui, &area, &self.view, &self.scene, self.style.theme.colours().ink);
        self.handles.draw(ui, &area, &self.view, self.pivot(), &self.style);
        if let Some(way) = self.way_out {
            overlay::way_out(ui, &area, &self.view, &self.scene, way, self.style.theme.colours().ink);
        }
        if has_focus {
            let stroke = egui::Stroke::new(1.0, ui.visuals().hyperlink_color);
            ui.painter().rect_stroke(area.rect, 0.0, stroke, egui::StrokeKind::Inside);
        }
        if let Some(legend) = &legend {
            legend.draw(ui, &self.style);
        }
        match (&other, &self.beside) {
            (Some(other), Some(beside)) => {
                beside::title(ui, area.rect, beside.names[0], true, &self.style);
                beside::title(ui, other.rect, beside.names[1], false, &self.style);
            }
            _ => overlay::whose(ui, area.rect, self.hand.holds(), self.hand.cap_trouble(), actions),
        }
        self.was_taken |= self.hand.holds();
        if self.run.can_guide() && !self.was_taken && self.beside.is_none() && self.handles.moves == Moves::Nothing {
            overlay::hint(ui, &area, &self.view, &self.scene, &self.style, &values);
        }
        overlay::messages(ui, area.rect, legend.as_ref(), self.run, &self.notices);
        if ui.input(|input| !input.raw.hovered_files.is_empty()) {
            overlay::drop_here(ui, area.rect, &self.style);
        }
    }

    /// Draws the dialogs on top.
    fn dialogs(&mut self, context: &egui::Context) {
        let dropped: Vec<_> =
            context.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect());
        if !dropped.is_empty() {
            let opening = self.opening.get_or_insert_with(|| Opening::new(self.run));
            dropped.iter().for_each(|path| opening.take(path));
        }
        if let Some(mut opening) = self.opening.take() {
            match opening.show(context, self.run) {
                Ok(true) => self.opening = Some(opening),
                Ok(false) => {}
                Err(why) => self.notices.complain(why),
            }
        }
        keys::show(context, &mut self.help, run_keys::list);
    }
}

impl eframe::App for Interface<'_> {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        self.take_newest(&context);
        let is_open = self.opening.is_some();
        let chosen = context.memory(|memory| memory.focused()).is_some_and(|id| Some(id) != self.view_id);
        let mut actions = if is_open { Vec::new() } else { run_keys::asked(&context, chosen) };
        let holds = context.input(|input| input.focused && input.key_down(run_keys::HOLD));
        self.run.hold(holds && !is_open && !context.text_edit_focused());
        let height = ui.available_height();
        // The window is cleared with the colour of the panels ([`Self::clear_color`]). To fill them
        // again would take a tenth of a frame with software rendering.
        let bare = Frame::side_top_panel(ui.style()).fill(Color32::TRANSPARENT);
        let margin = |side: i8, upright: i8| bare.inner_margin(Margin::symmetric(side, upright));
        let (of_bar, of_side, of_plots) = (margin(10, 0), margin(SIDE_MARGIN, 8), margin(4, 2));
        Panel::top("bar").exact_size(bar::HEIGHT).frame(of_bar).show(ui, |ui| {
            let side = self.has_side(&context);
            let Self { run, style, scene, frozen, .. } = self;
            Bar { run: &**run, style, bodies: &mut scene.bodies, frozen: *frozen, side }.show(ui, &mut actions);
        });
        if self.has_side(&context) {
            Panel::right("side").exact_size(SIDE).resizable(false).frame(of_side).show(ui, |ui| {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| self.side(ui, &mut actions));
            });
        } else {
            Panel::top("state").exact_size(STATE).resizable(false).frame(bare).show(ui, |ui| {
                self.status.brief(ui, self.run, self.style.theme);
            });
        }
        let plots_height = if height < LOW { LOW_PLOTS } else { PLOTS };
        Panel::bottom("plots").exact_size(plots_height).resizable(false).frame(of_plots).show(ui, |ui| {
            let names = self.beside.as_ref().map(|beside| beside.names);
            let asked = self.plots.show(ui, &self.history, self.style.theme, names);
            self.ask_plots(asked);
        });
        egui::CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            self.middle(ui, !chosen && !is_open && !self.help, &mut actions);
        });
        for action in actions {
            self.act(&context, action);
        }
        self.dialogs(&context);
        if self.run.is_over() && self.run.closes_when_over() {
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        context.request_repaint_after(self.view.wait());
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        self.run.painted(self.view.painted());
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}
