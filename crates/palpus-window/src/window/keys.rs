//! Keys: which keys were pressed, which keys have the same action in every window, and the list of
//! `?`.
//!
//! Each window has a table of its own keys ([`super::run_keys`], [`super::player`],
//! [`super::viewer`]) in addition to the table here. A table has both a key's action and its text
//! in the list, so that the two agree.

use eframe::egui::{self, Event, Key, RichText};

use crate::camera::View;

/// Actions of every window that shows a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SceneAction {
    Look(View),
    Everything,
    Pieces,
    Wires,
    Theme,
    Picture,
    Keys,
}

/// A key, its action, its name and its text in the list.
pub(super) const SCENE_KEYS: [(Key, SceneAction, &str, &str); 12] = [
    (Key::Num1, SceneAction::Look(View::Front), "1", "from the front"),
    (Key::Num2, SceneAction::Look(View::Right), "2", "from the right"),
    (Key::Num3, SceneAction::Look(View::Top), "3", "from above"),
    (Key::Num4, SceneAction::Look(View::Back), "4", "from behind"),
    (Key::Num5, SceneAction::Look(View::Left), "5", "from the left"),
    (Key::Num6, SceneAction::Look(View::Bottom), "6", "from below"),
    (Key::R, SceneAction::Everything, "R", "everything in view"),
    (Key::P, SceneAction::Pieces, "P", "convex pieces in colours"),
    (Key::W, SceneAction::Wires, "W", "triangles"),
    (Key::L, SceneAction::Theme, "L", "light or dark"),
    (Key::S, SceneAction::Picture, "S", "picture of the window"),
    (Key::Questionmark, SceneAction::Keys, "?", "these keys"),
];

/// Returns the action of `key` in a window that shows a scene.
pub(super) fn of_scene(key: Key) -> Option<SceneAction> {
    SCENE_KEYS.iter().find(|known| known.0 == key).map(|known| known.1)
}

/// A pressed key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    pub(super) key: Key,
    pub(super) shift: bool,
    /// True if the key was pressed before and is held.
    pub(super) again: bool,
}

/// Returns the keys of this frame. The list is empty while text is typed, and with Ctrl or Alt,
/// which belong to the window and the camera.
pub(super) fn pressed(context: &egui::Context) -> Vec<Pressed> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    // In a slow frame, a held key may be reported several times.
    let mut seen: Vec<Key> = Vec::new();
    let pressed = |event: &Event| match *event {
        Event::Key { key, pressed: true, repeat: again, modifiers, .. }
            if !(modifiers.ctrl || modifiers.command || modifiers.alt) =>
        {
            let again = again || seen.contains(&key);
            seen.push(key);
            Some(Pressed { key, shift: modifiers.shift, again })
        }
        _ => None,
    };
    context.input(|input| input.events.iter().filter_map(pressed).collect())
}

/// Longest name of a single key, in letters.
const LONGEST_KEY: usize = 9;

/// Margin of the window around a list of keys, points.
const MARGIN: f32 = 60.0;

/// Shows a list of keys on top of everything while `is_shown`.
pub(super) fn show(context: &egui::Context, is_shown: &mut bool, list: impl FnOnce(&mut egui::Ui)) {
    if *is_shown {
        let modal = egui::Modal::new(egui::Id::unique("keys")).show(context, list);
        *is_shown = !modal.should_close();
    }
}

/// Returns the size of the largest list that the window can show, in points.
pub(super) fn room(ui: &egui::Ui) -> egui::Vec2 {
    ui.ctx().content_rect().size() - egui::Vec2::splat(MARGIN)
}

/// Writes small text, so that the whole list is visible. It scrolls in windows that are too low.
pub(super) fn scrolled(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    let room = room(ui);
    let area = egui::ScrollArea::both().max_width(room.x).max_height(room.y);
    area.min_scrolled_width(room.x).min_scrolled_height(room.y).show(ui, |ui| {
        ui.style_mut().override_text_style = Some(egui::TextStyle::Small);
        ui.spacing_mut().interact_size.y = 0.0;
        // Margin for the scroll bar.
        egui::Frame::NONE.inner_margin(egui::Margin { right: 12, ..egui::Margin::ZERO }).show(ui, contents);
    });
}

/// Lists the `own` keys and the actions of the mouse, then the keys of every window.
pub(super) fn list<'a>(
    ui: &mut egui::Ui,
    own: impl IntoIterator<Item = (&'a str, &'a str)>,
    mouse: impl IntoIterator<Item = (&'a str, &'a str)>,
) {
    let part = |ui: &mut egui::Ui, name: &str, lines: Vec<(&str, &str)>| {
        ui.vertical(|ui| {
            ui.heading(name);
            grid(ui, name, [14.0, 5.0], lines);
        });
    };
    scrolled(ui, |ui| {
        ui.horizontal_top(|ui| {
            part(ui, "This window", own.into_iter().collect());
            ui.add_space(12.0);
            part(ui, "View", scene_lines().collect());
        });
        ui.add_space(10.0);
        part(ui, "Mouse", mouse.into_iter().collect());
    });
}

/// Returns the keys of every window, for the list.
pub(super) fn scene_lines<'a>() -> impl Iterator<Item = (&'a str, &'a str)> {
    SCENE_KEYS.into_iter().map(|(_, _, name, words)| (name, words))
}

/// Draws keys and their actions in two columns; `spacing` in points.
pub(super) fn grid<'a>(
    ui: &mut egui::Ui,
    name: &str,
    spacing: [f32; 2],
    lines: impl IntoIterator<Item = (&'a str, &'a str)>,
) {
    egui::Grid::new(name).num_columns(2).spacing(spacing).show(ui, |ui| {
        for (key, words) in lines {
            // The names of mouse actions begin with a lower-case letter.
            let is_key = key.chars().count() <= LONGEST_KEY && !key.starts_with(char::is_lowercase);
            let name = RichText::new(if is_key { format!(" {key} ") } else { key.to_owned() }).strong();
            // Draws the name of a single key as a key cap.
            ui.label(if is_key { name.background_color(ui.visuals().extreme_bg_color) } else { name });
            ui.label(words);
            ui.end_row();
        }
    });
}

/// Draws buttons for actions that the mouse cannot do otherwise; returns the action of a pressed
/// button.
pub(super) fn buttons(ui: &mut egui::Ui) -> Option<SceneAction> {
    let mut asked = None;
    ui.horizontal_wrapped(|ui| {
        for (action, name) in [
            (SceneAction::Look(View::Front), "front"),
            (SceneAction::Look(View::Right), "right"),
            (SceneAction::Look(View::Top), "top"),
            (SceneAction::Look(View::Back), "back"),
            (SceneAction::Look(View::Left), "left"),
            (SceneAction::Look(View::Bottom), "bottom"),
            (SceneAction::Everything, "all (R)"),
            (SceneAction::Theme, "light / dark (L)"),
            (SceneAction::Picture, "picture (S)"),
            (SceneAction::Keys, "?"),
        ] {
            if ui.button(name).clicked() {
                asked = Some(action);
            }
        }
    });
    asked
}
