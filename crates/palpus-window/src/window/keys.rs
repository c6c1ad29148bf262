//! What can be asked of the window, and by which key.
//!
//! One table says both, so that what `?` lists is what the keys do. Keys that move the probe are in `hand`.

use eframe::egui::{self, Event, Key};

use crate::camera::View;

/// What a key or a button asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Pause,
    Tick,
    Record,
    Picture,
    Open,
    Script,
    Freeze,
    Keys,
    Theme,
    Look(View),
    Everything,
    Contacts,
    Clusters,
    Wrench,
    Anchors,
    Pieces,
    Wires,
    Glass,
    Preset(usize),
    Coupling,
    Clustering,
    Shading,
    Friction,
    EarlierSetting,
    LaterSetting,
    Less,
    More,
}

/// A key and what it does.
pub(super) struct Shortcut {
    pub(super) key: Key,
    pub(super) action: Action,
    /// As `?` lists it.
    pub(super) name: &'static str,
    pub(super) words: &'static str,
    group: Group,
    /// It acts again and again while it is held down.
    repeats: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Run,
    Settings,
    View,
}

const fn once(group: Group, key: Key, action: Action, name: &'static str, words: &'static str) -> Shortcut {
    Shortcut { key, action, name, words, group, repeats: false }
}

const fn held(group: Group, key: Key, action: Action, name: &'static str, words: &'static str) -> Shortcut {
    Shortcut { key, action, name, words, group, repeats: true }
}

/// All of them. A second key for the same has no words.
pub(super) const SHORTCUTS: [Shortcut; 36] = [
    once(Group::Run, Key::Space, Action::Pause, "Space", "pause, go on"),
    held(Group::Run, Key::Period, Action::Tick, ".", "one tick, while it stands"),
    once(Group::Run, Key::E, Action::Record, "E", "begin and end a recording"),
    once(Group::Run, Key::S, Action::Picture, "S", "picture of the window"),
    once(Group::Run, Key::O, Action::Open, "O", "open a mesh or a scene"),
    once(Group::Run, Key::Escape, Action::Script, "Esc", "the hand goes back to its script"),
    once(Group::Run, Key::Z, Action::Freeze, "Z", "hold the picture; the loop goes on"),
    once(Group::Run, Key::Questionmark, Action::Keys, "?", "these keys"),
    once(Group::Run, Key::F1, Action::Keys, "F1", ""),
    once(Group::Settings, Key::B, Action::Preset(0), "B", "settings: palpus's own"),
    once(Group::Settings, Key::V, Action::Preset(1), "V", "settings: the paper's"),
    once(Group::Settings, Key::D, Action::Coupling, "D", "coupled or direct"),
    once(Group::Settings, Key::K, Action::Clustering, "K", "smooth or linkage clusters"),
    once(Group::Settings, Key::X, Action::Shading, "X", "force shading"),
    once(Group::Settings, Key::I, Action::Friction, "I", "friction"),
    held(Group::Settings, Key::OpenBracket, Action::EarlierSetting, "[", "the setting above"),
    held(Group::Settings, Key::CloseBracket, Action::LaterSetting, "]", "the setting below"),
    held(Group::Settings, Key::Minus, Action::Less, "−", "less of it"),
    held(Group::Settings, Key::Plus, Action::More, "+", "more of it"),
    held(Group::Settings, Key::Equals, Action::More, "=", ""),
    once(Group::View, Key::R, Action::Everything, "R", "everything in view"),
    once(Group::View, Key::Home, Action::Everything, "Home", ""),
    once(Group::View, Key::Num1, Action::Look(View::Front), "1", "from the front"),
    once(Group::View, Key::Num2, Action::Look(View::Right), "2", "from the right"),
    once(Group::View, Key::Num3, Action::Look(View::Top), "3", "from above"),
    once(Group::View, Key::Num4, Action::Look(View::Back), "4", "from behind"),
    once(Group::View, Key::Num5, Action::Look(View::Left), "5", "from the left"),
    once(Group::View, Key::Num6, Action::Look(View::Bottom), "6", "from below"),
    once(Group::View, Key::C, Action::Contacts, "C", "contacts"),
    once(Group::View, Key::A, Action::Clusters, "A", "the force of each cluster"),
    once(Group::View, Key::F, Action::Wrench, "F", "force and torque on the hand"),
    once(Group::View, Key::H, Action::Anchors, "H", "where friction holds"),
    once(Group::View, Key::P, Action::Pieces, "P", "convex pieces in colours"),
    once(Group::View, Key::W, Action::Wires, "W", "triangles"),
    once(Group::View, Key::T, Action::Glass, "T", "see through the environment"),
    once(Group::View, Key::L, Action::Theme, "L", "light or dark"),
];

/// What the mouse does, and the keys that move the probe.
const MOUSE: [(&str, &str); 13] = [
    ("drag the probe", "moves it, by a spring"),
    ("right drag, Shift drag", "turns it; with Ctrl, rolls it"),
    ("wheel while dragging", "nearer, farther"),
    ("arrow keys", "move it in the view"),
    ("PageUp PageDown", "farther, nearer"),
    ("Ctrl with these", "turn it"),
    ("Shift with these", "slowly"),
    ("Alt with these", "turns the view, comes nearer"),
    ("drag beside it", "turns the view"),
    ("right, middle, Shift drag", "moves the view"),
    ("wheel", "nearer, farther"),
    ("Tab, Enter", "from control to control; press it"),
    ("Ctrl + and Ctrl −", "everything larger, smaller"),
];

/// Points that the list leaves of the window, and what it takes whole.
const MARGIN: f32 = 60.0;
const WHOLE: [f32; 2] = [900.0, 520.0];

/// What is asked for in this frame. Nothing while text is written; keys that controls know too are theirs while `elsewhere`, that is, while
/// one of them is chosen.
pub(super) fn asked(context: &egui::Context, elsewhere: bool) -> Vec<Action> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    let mut actions = Vec::new();
    context.input(|input| {
        for event in &input.events {
            let Event::Key { key, pressed: true, repeat, modifiers, .. } = event else { continue };
            if modifiers.ctrl || modifiers.command || modifiers.alt || (elsewhere && is_of_controls(*key)) {
                continue;
            }
            let known = SHORTCUTS.iter().find(|shortcut| shortcut.key == *key && (shortcut.repeats || !*repeat));
            actions.extend(known.map(|shortcut| shortcut.action));
        }
    });
    actions
}

/// Space presses the control that is chosen; Escape leaves it.
fn is_of_controls(key: Key) -> bool {
    matches!(key, Key::Space | Key::Escape)
}

/// The list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let room = ui.ctx().content_rect().size() - egui::Vec2::splat(MARGIN);
    let scrolled = egui::ScrollArea::both().max_width(room.x).max_height(room.y);
    let least = room.min(egui::Vec2::from(WHOLE));
    scrolled.min_scrolled_width(least.x).min_scrolled_height(least.y).show(ui, |ui| {
        // So that all of it is seen at once in a small window.
        ui.style_mut().override_text_style = Some(egui::TextStyle::Small);
        ui.spacing_mut().interact_size.y = 0.0;
        parts(ui);
    });
}

fn parts(ui: &mut egui::Ui) {
    let line = |ui: &mut egui::Ui, name: &str, words: &str| {
        ui.label(egui::RichText::new(name).strong());
        ui.label(words);
        ui.end_row();
    };
    let part = |ui: &mut egui::Ui, title: &str, lines: &[(&str, &str)]| {
        ui.vertical(|ui| {
            ui.add(egui::Label::new(egui::RichText::new(title).heading()).extend());
            egui::Grid::new(title).num_columns(2).spacing([14.0, 5.0]).show(ui, |ui| {
                lines.iter().for_each(|(name, words)| line(ui, name, words));
            });
        });
    };
    let of = |group: Group| -> Vec<(&str, &str)> {
        let listed = SHORTCUTS.iter().filter(|shortcut| shortcut.group == group && !shortcut.words.is_empty());
        listed.map(|shortcut| (shortcut.name, shortcut.words)).collect()
    };
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            part(ui, "The run", &of(Group::Run));
            ui.add_space(10.0);
            part(ui, "What is felt", &of(Group::Settings));
        });
        ui.add_space(22.0);
        part(ui, "What is seen", &of(Group::View));
        ui.add_space(22.0);
        part(ui, "The hand and the mouse", &MOUSE);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        for (k, shortcut) in SHORTCUTS.iter().enumerate() {
            assert!(SHORTCUTS[k + 1..].iter().all(|other| other.key != shortcut.key), "{}", shortcut.name);
        }
    }

    #[test]
    fn every_action_is_listed_once() {
        let listed: Vec<Action> = SHORTCUTS.iter().filter(|s| !s.words.is_empty()).map(|s| s.action).collect();
        for shortcut in &SHORTCUTS {
            assert_eq!(listed.iter().filter(|action| **action == shortcut.action).count(), 1, "{}", shortcut.name);
        }
    }
}
