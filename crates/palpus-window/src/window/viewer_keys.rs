//! What can be asked of the window on a model, and by which key: one table, so that what `?` lists is what the keys do.

use eframe::egui::{self, Key, RichText};

use crate::camera::View;
use crate::section::Axis;

/// What a key asks for.
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
    Look(View),
    Everything,
    Pieces,
    Wires,
    Glass,
    Theme,
    Picture,
    Keys,
}

/// Key, what it does, how it is listed; those without words are second keys.
const KEYS: [(Key, Action, &str, &str); 28] = [
    (Key::E, Action::Explode, "E", "pieces apart or together"),
    (Key::OpenBracket, Action::Earlier, "[", "the piece before"),
    (Key::CloseBracket, Action::Later, "]", "the piece after"),
    (Key::Escape, Action::Unpick, "Esc", "no piece"),
    (Key::G, Action::Face, "G", "look at the picked piece's own faces"),
    (Key::D, Action::Section, "D", "depth on a plane"),
    (Key::X, Action::Across(Axis::X), "X", "plane across x"),
    (Key::Y, Action::Across(Axis::Y), "Y", "plane across y"),
    (Key::Z, Action::Across(Axis::Z), "Z", "plane across z"),
    (Key::Comma, Action::Back, ",", "plane back"),
    (Key::Period, Action::Forth, ".", "plane forth"),
    (Key::V, Action::Shown, "V", "felt, true, or what is missing"),
    (Key::Num1, Action::Look(View::Front), "1", "from the front"),
    (Key::Num2, Action::Look(View::Right), "2", "from the right"),
    (Key::Num3, Action::Look(View::Top), "3", "from above"),
    (Key::Num4, Action::Look(View::Back), "4", "from behind"),
    (Key::Num5, Action::Look(View::Left), "5", "from the left"),
    (Key::Num6, Action::Look(View::Bottom), "6", "from below"),
    (Key::R, Action::Everything, "R", "everything in view"),
    (Key::Home, Action::Everything, "", ""),
    (Key::P, Action::Pieces, "P", "convex pieces in colours"),
    (Key::W, Action::Wires, "W", "triangles"),
    (Key::T, Action::Glass, "T", "see through it"),
    (Key::L, Action::Theme, "L", "light or dark"),
    (Key::S, Action::Picture, "S", "picture of the window"),
    (Key::Questionmark, Action::Keys, "?", "these keys"),
    (Key::F1, Action::Keys, "", ""),
    (Key::Slash, Action::Keys, "", ""),
];

const MOUSE: [(&str, &str); 5] = [
    ("click", "picks a piece"),
    ("drag", "turns"),
    ("Shift, right or middle drag", "moves"),
    ("wheel", "nearer, farther"),
    ("over the depth picture", "says depth and distance there"),
];

/// What is asked for in this frame; nothing while a number is typed.
pub(super) fn asked(context: &egui::Context) -> Vec<Action> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    context.input(|input| {
        if input.modifiers.ctrl || input.modifiers.command || input.modifiers.alt {
            return Vec::new();
        }
        KEYS.iter().filter(|(key, ..)| input.key_pressed(*key)).map(|(_, action, ..)| *action).collect()
    })
}

/// The list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let keys = KEYS.iter().map(|(_, _, name, words)| (*name, *words)).filter(|(name, _)| !name.is_empty());
    egui::Grid::new("key list").num_columns(2).spacing([18.0, 2.0]).show(ui, |ui| {
        for (name, words) in MOUSE.into_iter().chain(keys) {
            ui.label(RichText::new(name).strong());
            ui.label(words);
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        for (k, (key, ..)) in KEYS.iter().enumerate() {
            assert!(KEYS[k + 1..].iter().all(|(other, ..)| other != key), "{key:?}");
        }
    }
}
