//! What can be asked of the window on a recording, and by which key: one table, so that what `?` lists is what the keys do.

use eframe::egui::{self, Key, RichText};

use crate::camera::View;

/// What a key or a button asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    Play,
    /// By so many ticks.
    Step(i64),
    /// By so many seconds.
    Jump(f64),
    Begin,
    End,
    /// To the mark before or after.
    EarlierMark,
    LaterMark,
    Strongest,
    Slower,
    Faster,
    Look(View),
    Everything,
    Contacts,
    Clusters,
    Wrench,
    Anchors,
    Pieces,
    Wires,
    Glass,
    Theme,
    Picture,
    Keys,
}

/// Key, with Shift or without, what it does, how it is listed; those without a name are second keys.
const KEYS: [(Key, bool, Action, &str, &str); 33] = [
    (Key::Space, false, Action::Play, "Space", "play, stand still"),
    (Key::ArrowRight, false, Action::Step(1), "→", "one tick on"),
    (Key::ArrowLeft, false, Action::Step(-1), "←", "one tick back"),
    (Key::ArrowRight, true, Action::Jump(0.1), "Shift →", "a tenth of a second on"),
    (Key::ArrowLeft, true, Action::Jump(-0.1), "Shift ←", "a tenth of a second back"),
    (Key::PageDown, false, Action::Jump(1.0), "PageDown", "a second on"),
    (Key::PageUp, false, Action::Jump(-1.0), "PageUp", "a second back"),
    (Key::Home, false, Action::Begin, "Home", "to the beginning"),
    (Key::End, false, Action::End, "End", "to the end"),
    (Key::N, false, Action::LaterMark, "N", "to the next late tick or fault"),
    (Key::B, false, Action::EarlierMark, "B", "to the one before"),
    (Key::M, false, Action::Strongest, "M", "to the largest force"),
    (Key::Minus, false, Action::Slower, "−", "half as fast"),
    (Key::Plus, false, Action::Faster, "+", "twice as fast"),
    (Key::Plus, true, Action::Faster, "", ""),
    (Key::Equals, false, Action::Faster, "", ""),
    (Key::Num1, false, Action::Look(View::Front), "1", "from the front"),
    (Key::Num2, false, Action::Look(View::Right), "2", "from the right"),
    (Key::Num3, false, Action::Look(View::Top), "3", "from above"),
    (Key::Num4, false, Action::Look(View::Back), "4", "from behind"),
    (Key::Num5, false, Action::Look(View::Left), "5", "from the left"),
    (Key::Num6, false, Action::Look(View::Bottom), "6", "from below"),
    (Key::R, false, Action::Everything, "R", "everything in view"),
    (Key::C, false, Action::Contacts, "C", "contacts"),
    (Key::A, false, Action::Clusters, "A", "the force of each cluster"),
    (Key::F, false, Action::Wrench, "F", "force and torque on the hand"),
    (Key::H, false, Action::Anchors, "H", "where friction holds"),
    (Key::P, false, Action::Pieces, "P", "convex pieces in colours"),
    (Key::W, false, Action::Wires, "W", "triangles"),
    (Key::T, false, Action::Glass, "T", "see through the environment"),
    (Key::L, false, Action::Theme, "L", "light or dark"),
    (Key::S, false, Action::Picture, "S", "picture of the window"),
    (Key::Questionmark, false, Action::Keys, "?", "these keys"),
];

const MOUSE: [(&str, &str); 4] = [
    ("drag on a curve", "goes there"),
    ("drag", "turns the view"),
    ("Shift, right or middle drag", "moves it"),
    ("wheel", "nearer, farther"),
];

/// What is asked for in this frame. Keys act again while they are held down. `elsewhere`: a control is chosen, and Space is its.
pub(super) fn asked(context: &egui::Context, elsewhere: bool) -> Vec<Action> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    context.input(|input| {
        let modifiers = input.modifiers;
        if modifiers.ctrl || modifiers.command || modifiers.alt {
            return Vec::new();
        }
        let mut actions = Vec::new();
        for event in &input.events {
            let egui::Event::Key { key, pressed: true, repeat, .. } = event else { continue };
            if elsewhere && *key == Key::Space {
                continue;
            }
            // Which of the two a question mark is depends on the keyboard.
            let shift = modifiers.shift && *key != Key::Questionmark;
            let known = KEYS.iter().find(|(known, with_shift, ..)| known == key && *with_shift == shift);
            let moves = |action: &Action| matches!(action, Action::Step(_) | Action::Jump(_));
            actions.extend(known.map(|(_, _, action, ..)| *action).filter(|action| !*repeat || moves(action)));
        }
        actions
    })
}

/// The list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let keys = KEYS.iter().map(|(_, _, _, name, words)| (*name, *words)).filter(|(name, _)| !name.is_empty());
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
        for (k, (key, shift, ..)) in KEYS.iter().enumerate() {
            assert!(KEYS[k + 1..].iter().all(|(other, with, ..)| other != key || with != shift), "{key:?}");
        }
    }
}
