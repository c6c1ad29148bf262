//! Actions of the window on a recording, and their keys, in addition to the keys of every window.

use eframe::egui::{self, Key};

use crate::window::keys::{self, Pressed, SceneAction, of_scene, pressed};

/// Actions of keys and buttons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    Play,
    /// Moves by this many ticks.
    Step(i64),
    /// Moves by this many seconds.
    Jump(f64),
    Begin,
    End,
    /// Moves to the previous or the next mark.
    EarlierMark,
    LaterMark,
    Strongest,
    Slower,
    Faster,
    Contacts,
    Clusters,
    Wrench,
    Anchors,
    Glass,
    /// Shows or hides the panel at the right.
    Side,
    Scene(SceneAction),
}

/// Key, whether it needs Shift, action, name and text in the list. Second keys have no name.
const KEYS: [(Key, bool, Action, &str, &str); 22] = [
    (Key::Space, false, Action::Play, "Space", "play, pause"),
    (Key::ArrowRight, false, Action::Step(1), "Right", "one tick on"),
    (Key::ArrowLeft, false, Action::Step(-1), "Left", "one tick back"),
    (Key::ArrowRight, true, Action::Jump(0.1), "Shift Right", "a tenth of a second on"),
    (Key::ArrowLeft, true, Action::Jump(-0.1), "Shift Left", "a tenth of a second back"),
    (Key::PageDown, false, Action::Jump(1.0), "PageDown", "a second on"),
    (Key::PageUp, false, Action::Jump(-1.0), "PageUp", "a second back"),
    (Key::Home, false, Action::Begin, "Home", "to the beginning"),
    (Key::End, false, Action::End, "End", "to the end"),
    (Key::N, false, Action::LaterMark, "N", "to the next late tick or fault"),
    (Key::B, false, Action::EarlierMark, "B", "to the one before"),
    (Key::J, false, Action::Strongest, "J", "to the largest force"),
    (Key::Minus, false, Action::Slower, "−", "half as fast"),
    (Key::Plus, false, Action::Faster, "+", "twice as fast"),
    (Key::Plus, true, Action::Faster, "", ""),
    (Key::Equals, false, Action::Faster, "", ""),
    (Key::C, false, Action::Contacts, "C", "contacts"),
    (Key::A, false, Action::Clusters, "A", "the force of each cluster"),
    (Key::F, false, Action::Wrench, "F", "force and torque on the hand"),
    (Key::H, false, Action::Anchors, "H", "where friction holds"),
    (Key::T, false, Action::Glass, "T", "see through the environment"),
    (Key::M, false, Action::Side, "M", "show or hide the right panel"),
];

const MOUSE: [(&str, &str); 4] = [
    ("drag on a curve", "goes there"),
    ("drag", "turns the view"),
    ("Shift, right or middle drag", "moves it"),
    ("wheel", "nearer, farther"),
];

/// Returns the actions of this frame. `elsewhere`: a control has the focus, so Space belongs to
/// this control.
pub(super) fn asked(context: &egui::Context, elsewhere: bool) -> Vec<Action> {
    let pressed = pressed(context).into_iter().filter(|pressed| !(elsewhere && pressed.key == Key::Space));
    pressed.filter_map(|pressed| meant(&pressed)).collect()
}

/// Returns the action of a key. While a key is held, only actions that move in time repeat.
fn meant(pressed: &Pressed) -> Option<Action> {
    // A question mark needs Shift only on some keyboards, so Shift is ignored.
    let shift = pressed.shift && pressed.key != Key::Questionmark;
    let own = KEYS.iter().find(|(key, with_shift, ..)| *key == pressed.key && *with_shift == shift);
    let of_scene = || of_scene(pressed.key).filter(|_| !shift).map(Action::Scene);
    let action = own.map(|(_, _, action, ..)| *action).or_else(of_scene)?;
    let moves = matches!(action, Action::Step(_) | Action::Jump(_));
    (moves || !pressed.again).then_some(action)
}

/// Writes the list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let own = KEYS.iter().map(|(_, _, _, name, words)| (*name, *words)).filter(|(name, _)| !name.is_empty());
    keys::list(ui, own, MOUSE);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::keys::SCENE_KEYS;

    #[test]
    fn no_key_has_two_actions() {
        let own = KEYS.iter().map(|(key, shift, ..)| (*key, *shift));
        let all: Vec<(Key, bool)> = own.chain(SCENE_KEYS.iter().map(|(key, ..)| (*key, false))).collect();
        for (k, key) in all.iter().enumerate() {
            assert!(!all[k + 1..].contains(key), "{key:?}");
        }
    }

    #[test]
    fn only_time_steps_repeat_and_shift_matters() {
        let meant = |key, shift, again| meant(&Pressed { key, shift, again });
        assert_eq!(meant(Key::ArrowRight, false, true), Some(Action::Step(1)));
        assert_eq!(meant(Key::ArrowRight, true, false), Some(Action::Jump(0.1)));
        assert_eq!(meant(Key::L, false, false), Some(Action::Scene(SceneAction::Theme)));
        assert_eq!(meant(Key::Questionmark, true, false), Some(Action::Scene(SceneAction::Keys)));
        assert!(meant(Key::L, false, true).is_none() && meant(Key::L, true, false).is_none());
    }
}
