//! The bar at the top with the controls of the run.

use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{Align, Button, Layout, PopupCloseBehavior, Ui, vec2};

use super::icon::{self, Icon};
use super::keys::SceneAction;
use super::run::Run;
use super::run_keys::Action;
use crate::camera::View;
use crate::scene::{LISTED, ShownBody};
use crate::style::{Style, Theme};

/// Height of the bar, points.
pub(super) const HEIGHT: f32 = 44.0;
/// Width and height of a button with text, points.
const BUTTON: [f32; 2] = [102.0, 32.0];
/// Below this width, buttons show only their icons.
const NARROW_BAR: f32 = 860.0;
/// Width and height of a button without text, points.
const NARROW: [f32; 2] = [52.0, 32.0];
/// The views of the menu, with their names and keys.
const VIEWS: [(View, &str); 6] = [
    (View::Front, "front (1)"),
    (View::Right, "right (2)"),
    (View::Top, "top (3)"),
    (View::Back, "back (4)"),
    (View::Left, "left (5)"),
    (View::Bottom, "bottom (6)"),
];

/// State shown by the bar.
pub(super) struct Bar<'a> {
    pub(super) run: &'a dyn Run,
    pub(super) style: &'a mut Style,
    pub(super) bodies: &'a mut [ShownBody],
    pub(super) frozen: bool,
    /// True if the panel at the right is visible.
    pub(super) side: bool,
}

impl Bar<'_> {
    /// Draws the bar; its buttons add their actions to `actions`.
    pub(super) fn show(&mut self, ui: &mut Ui, actions: &mut Vec<Action>) {
        ui.horizontal_centered(|ui| {
            let text = ui.visuals().text_color();
            let is_narrow = ui.available_width() < NARROW_BAR;
            let mut button = |ui: &mut Ui, icon, words: &str, is_on, ink, hint: &str, action: Action| {
                let (words, size) = if is_narrow { ("", [34.0, BUTTON[1]]) } else { (words, BUTTON) };
                if icon::button(ui, icon, words, is_on, ink, size).on_hover_text(hint).clicked() {
                    actions.push(action);
                }
            };
            let paused = self.run.is_paused();
            let (icon, words) = if paused { (Icon::GoOn, "go on") } else { (Icon::Pause, "pause") };
            button(ui, icon, words, paused, text, "pauses or resumes the run (Space)", Action::Pause);
            button(ui, Icon::Tick, "one tick", false, text, "computes one tick, then pauses (.)", Action::Tick);
            let red = ui.visuals().error_fg_color;
            match self.run.recording() {
                Some(file) => {
                    let hint = format!("stops recording to {} (E)", file.display());
                    button(ui, Icon::Stop, "recording", true, red, &hint, Action::Record);
                }
                None => {
                    let hint = "records every tick to a file that replays bit for bit (E)";
                    button(ui, Icon::Record, "record", false, red, hint, Action::Record);
                }
            }
            let hint = "saves a picture of the whole window as a PNG file (S)";
            button(ui, Icon::Picture, "picture", false, text, hint, Action::Scene(SceneAction::Picture));
            button(
                ui,
                Icon::Open,
                "open",
                false,
                text,
                "opens a mesh, a scene file or another scene (O)",
                Action::Open,
            );
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let mut button = |ui: &mut Ui, text: &str, hint: &str, action: Action| {
                    let button = Button::new(text).min_size(NARROW.into());
                    if ui.add(button).on_hover_text(hint).clicked() {
                        actions.push(action);
                    }
                };
                button(ui, "?", "lists all keys (?)", Action::Scene(SceneAction::Keys));
                let side = if self.side { "hide" } else { "settings" };
                button(ui, side, "shows or hides state and settings (M)", Action::Side);
                let light = if self.style.theme == Theme::Dark { "light" } else { "dark" };
                button(ui, light, "switches between light and dark (L)", Action::Scene(SceneAction::Theme));
                let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
                let view = Button::new("view").min_size(NARROW.into());
                MenuButton::from_button(view).config(config).ui(ui, |ui| self.view(ui, actions));
            });
        });
    }

    /// Draws the controls of the view.
    fn view(&mut self, ui: &mut Ui, actions: &mut Vec<Action>) {
        for (words, shown) in [
            ("contacts (C)", &mut self.style.contacts),
            ("forces of clusters (A)", &mut self.style.clusters),
            ("force and torque (F)", &mut self.style.wrench),
            ("where friction holds (H)", &mut self.style.anchors),
        ] {
            ui.checkbox(shown, words);
        }
        let mut frozen = self.frozen;
        if ui.checkbox(&mut frozen, "hold the picture (Z)").changed() {
            actions.push(Action::Freeze);
        }
        ui.separator();
        for body in self.bodies.iter_mut().take(LISTED) {
            ui.label(body.part.name());
            ui.horizontal(|ui| {
                ui.toggle_value(&mut body.look.pieces, "pieces (P)");
                ui.toggle_value(&mut body.look.wireframe, "wires (W)");
                ui.toggle_value(&mut body.look.translucent, "glass (T)");
            });
        }
        ui.separator();
        for row in VIEWS.chunks(3) {
            ui.horizontal(|ui| {
                for (view, name) in row {
                    if ui.add(Button::new(*name).min_size(vec2(90.0, 0.0))).clicked() {
                        actions.push(Action::Scene(SceneAction::Look(*view)));
                    }
                }
            });
        }
        if ui.button("everything in view (R)").clicked() {
            actions.push(Action::Scene(SceneAction::Everything));
        }
    }
}
