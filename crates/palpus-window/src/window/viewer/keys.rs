//! Actions of the window on a model, and their keys, in addition to the keys of every window.

use eframe::egui::{self, Key};

use crate::section::Axis;
use crate::window::keys::{self, SceneAction, of_scene, pressed};

/// Actions of keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    Explode,
    Earlier,
    Later,
    Unpick,
    Face,
    Section,
    Across(Axis),
    Back,
    Forth,
    Shown,
    Glass,
    Scene(SceneAction),
}

/// Key, action, name and text in the list. Second keys have no text.
const KEYS: [(Key, Action, &str, &str); 16] = [
    (Key::E, Action::Explode, "E", "pieces apart or together"),
    (Key::OpenBracket, Action::Earlier, "[", "the piece before"),
    (Key::CloseBracket, Action::Later, "]", "the piece after"),
    (Key::Escape, Action::Unpick, "Esc", "no piece"),
    (Key::G, Action::Face, "G", "look at the picked piece's faces on the surface"),
    (Key::D, Action::Section, "D", "depth on a plane"),
    (Key::X, Action::Across(Axis::X), "X", "plane across x"),
    (Key::Y, Action::Across(Axis::Y), "Y", "plane across y"),
    (Key::Z, Action::Across(Axis::Z), "Z", "plane across z"),
    (Key::Comma, Action::Back, ",", "plane back"),
    (Key::Period, Action::Forth, ".", "plane forth"),
    (Key::V, Action::Shown, "V", "felt depth, true depth, or their difference"),
    (Key::T, Action::Glass, "T", "see through it"),
    (Key::Home, Action::Scene(SceneAction::Everything), "", ""),
    (Key::F1, Action::Scene(SceneAction::Keys), "", ""),
    (Key::Slash, Action::Scene(SceneAction::Keys), "", ""),
];

const MOUSE: [(&str, &str); 5] = [
    ("click", "picks a piece"),
    ("drag", "turns"),
    ("Shift, right or middle drag", "moves"),
    ("wheel", "nearer, farther"),
    ("over the depth picture", "shows depth and distance there"),
];

/// Returns the actions of this frame.
pub(super) fn asked(context: &egui::Context) -> Vec<Action> {
    pressed(context).into_iter().filter_map(|pressed| meant(pressed.key)).collect()
}

fn meant(key: Key) -> Option<Action> {
    let own = KEYS.iter().find(|known| known.0 == key).map(|known| known.1);
    own.or_else(|| of_scene(key).map(Action::Scene))
}

/// Writes the list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let own = KEYS.iter().map(|(_, _, name, words)| (*name, *words)).filter(|(name, _)| !name.is_empty());
    keys::list(ui, own, MOUSE);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::keys::SCENE_KEYS;

    #[test]
    fn no_key_has_two_actions() {
        let own = KEYS.iter().map(|known| known.0);
        let all: Vec<Key> = own.chain(SCENE_KEYS.iter().map(|known| known.0)).collect();
        for (k, key) in all.iter().enumerate() {
            assert!(!all[k + 1..].contains(key), "{key:?}");
        }
    }
}
