//! Actions of the window of a run, and their keys, in addition to the keys of every window.
//! Keys that move the probe are in `hand`.

use eframe::egui::{self, Key};

use super::keys::{self, Pressed, SceneAction, of_scene, pressed};

/// Actions of keys and buttons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Pause,
    Tick,
    Record,
    Restart,
    /// Restarts the scene at the pose at which the hand holds the probe.
    Jump,
    /// Restarts the scene at this pose, and the device leads the probe out of the part.
    LeadOut,
    Open,
    Save,
    Handles,
    Script,
    Freeze,
    Contacts,
    Clusters,
    Wrench,
    Anchors,
    Glass,
    /// Compares the felt settings with other settings.
    Beside,
    /// Keeps these settings for the comparison.
    Keep,
    Undo,
    PlotKind,
    Preset(usize),
    Coupling,
    Clustering,
    Shading,
    Friction,
    EarlierSetting,
    LaterSetting,
    Less,
    More,
    /// Shows or hides the panel at the right.
    Side,
    Scene(SceneAction),
}

/// A key and its action.
struct Shortcut {
    key: Key,
    action: Action,
    /// Text in the list of `?`.
    name: &'static str,
    words: &'static str,
    group: Group,
    /// True if the action repeats while the key is held.
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

/// The window's own keys. A second key for the same action has no text.
const SHORTCUTS: [Shortcut; 34] = [
    once(Group::Run, Key::Space, Action::Pause, "Space", "pause, go on"),
    held(Group::Run, Key::Period, Action::Tick, ".", "one tick, while paused"),
    once(Group::Run, Key::E, Action::Record, "E", "start or end a recording"),
    once(Group::Run, Key::Backspace, Action::Restart, "Backspace", "start the scene again"),
    once(Group::Run, Key::J, Action::Jump, "J", "jump: restart where the hand holds it"),
    once(Group::Run, Key::F4, Action::LeadOut, "F4", "lead the probe out of the part"),
    once(Group::Run, Key::O, Action::Open, "O", "open meshes or a scene"),
    once(Group::Run, Key::F2, Action::Save, "F2", "save the scene as a file"),
    once(Group::Run, Key::Escape, Action::Script, "Esc", "the hand goes back to its script"),
    once(Group::Run, Key::Z, Action::Freeze, "Z", "freeze the plots; the loop goes on"),
    once(Group::Run, Key::F1, Action::Scene(SceneAction::Keys), "F1", ""),
    once(Group::Settings, Key::Y, Action::Beside, "Y", "compare with the paper's method"),
    once(Group::Settings, Key::N, Action::Keep, "N", "keep these settings to compare with"),
    once(Group::Settings, Key::U, Action::Undo, "U", "undo the last change"),
    once(Group::Settings, Key::B, Action::Preset(0), "B", "settings: palpus's own"),
    once(Group::Settings, Key::V, Action::Preset(1), "V", "settings: the paper's"),
    once(Group::Settings, Key::D, Action::Coupling, "D", "coupled or direct"),
    once(Group::Settings, Key::K, Action::Clustering, "K", "smooth or linkage clusters"),
    once(Group::Settings, Key::X, Action::Shading, "X", "force shading"),
    once(Group::Settings, Key::I, Action::Friction, "I", "friction"),
    held(Group::Settings, Key::OpenBracket, Action::EarlierSetting, "[", "select the setting above"),
    held(Group::Settings, Key::CloseBracket, Action::LaterSetting, "]", "select the setting below"),
    held(Group::Settings, Key::Minus, Action::Less, "−", "decrease the setting"),
    held(Group::Settings, Key::Plus, Action::More, "+", "increase the setting"),
    held(Group::Settings, Key::Equals, Action::More, "=", ""),
    once(Group::View, Key::Home, Action::Scene(SceneAction::Everything), "Home", ""),
    once(Group::View, Key::Q, Action::PlotKind, "Q", "plots: size, axes, spectrum"),
    once(Group::View, Key::F3, Action::Handles, "F3", "handles: probe, grip, none"),
    once(Group::View, Key::M, Action::Side, "M", "show or hide the right panel"),
    once(Group::View, Key::C, Action::Contacts, "C", "contacts"),
    once(Group::View, Key::A, Action::Clusters, "A", "the force of each cluster"),
    once(Group::View, Key::F, Action::Wrench, "F", "force and torque on the hand"),
    once(Group::View, Key::H, Action::Anchors, "H", "where friction holds"),
    once(Group::View, Key::T, Action::Glass, "T", "environment: x-ray, glass, solid"),
];

/// This key replaces the device's button for force while it is held.
pub(super) const HOLD: Key = Key::G;

/// Actions of the mouse and of held keys.
const MOUSE: [(&str, &str); 14] = [
    ("G", "held, allows force, as a device's button does"),
    ("drag the probe", "moves it, by a spring"),
    ("right drag, Shift drag", "turns it; with Ctrl, rolls it"),
    ("wheel while dragging", "nearer, farther"),
    ("arrow keys", "move it in the view"),
    ("PageUp PageDown", "farther, nearer"),
    ("Ctrl with these keys", "turn it"),
    ("Shift with these keys", "move or turn it slowly"),
    ("Alt with these keys", "turn the view, come nearer"),
    ("drag the background", "turns the view"),
    ("right, middle, Shift drag", "moves the view"),
    ("wheel", "nearer, farther"),
    ("Tab, Enter", "next control; press it"),
    ("Ctrl + and Ctrl −", "everything larger, smaller"),
];

/// Width of the list in three columns, points.
const WIDE: f32 = 960.0;

/// Returns the actions of this frame. `elsewhere`: a control has the focus, so keys that controls
/// use belong to the control.
pub(super) fn asked(context: &egui::Context, elsewhere: bool) -> Vec<Action> {
    let pressed = pressed(context).into_iter().filter(|pressed| !(elsewhere && is_of_controls(pressed.key)));
    pressed.filter_map(|pressed| meant(&pressed)).collect()
}

fn meant(pressed: &Pressed) -> Option<Action> {
    let own = SHORTCUTS.iter().find(|own| own.key == pressed.key && (own.repeats || !pressed.again));
    let of_scene = || of_scene(pressed.key).filter(|_| !pressed.again).map(Action::Scene);
    own.map(|own| own.action).or_else(of_scene)
}

/// True for keys that a focused control uses: Space presses it, and Escape removes the focus.
fn is_of_controls(key: Key) -> bool {
    matches!(key, Key::Space | Key::Escape)
}

/// Writes the list that `?` shows.
pub(super) fn list(ui: &mut egui::Ui) {
    let is_wide = keys::room(ui).x >= WIDE;
    keys::scrolled(ui, |ui| parts(ui, is_wide));
}

fn parts(ui: &mut egui::Ui, is_wide: bool) {
    let part = |ui: &mut egui::Ui, title: &str, lines: &[(&str, &str)]| {
        ui.vertical(|ui| {
            ui.add(egui::Label::new(egui::RichText::new(title).heading()).extend());
            keys::grid(ui, title, [14.0, 5.0], lines.iter().copied());
        });
    };
    let of = |group: Group| -> Vec<(&str, &str)> {
        let listed = SHORTCUTS.iter().filter(|shortcut| shortcut.group == group && !shortcut.words.is_empty());
        listed.map(|shortcut| (shortcut.name, shortcut.words)).collect()
    };
    let seen: Vec<_> = of(Group::View).into_iter().chain(keys::scene_lines()).collect();
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            part(ui, "The run", &of(Group::Run));
            ui.add_space(10.0);
            part(ui, "What is felt", &of(Group::Settings));
        });
        ui.add_space(if is_wide { 22.0 } else { 6.0 });
        part(ui, "What is seen", &seen);
        if is_wide {
            ui.add_space(22.0);
            part(ui, "The hand and the mouse", &MOUSE);
        }
    });
    if !is_wide {
        ui.add_space(10.0);
        part(ui, "The hand and the mouse", &MOUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::keys::SCENE_KEYS;

    #[test]
    fn no_key_has_two_actions() {
        let own = SHORTCUTS.iter().map(|shortcut| shortcut.key);
        let all: Vec<Key> = own.chain(SCENE_KEYS.iter().map(|known| known.0)).chain([HOLD]).collect();
        for (k, key) in all.iter().enumerate() {
            assert!(!all[k + 1..].contains(key), "{key:?}");
        }
    }

    #[test]
    fn every_action_is_listed_once() {
        let own = SHORTCUTS.iter().filter(|s| !s.words.is_empty()).map(|s| s.action);
        let listed: Vec<Action> = own.chain(SCENE_KEYS.iter().map(|known| Action::Scene(known.1))).collect();
        for action in SHORTCUTS.iter().map(|shortcut| shortcut.action).chain(listed.iter().copied()) {
            assert_eq!(listed.iter().filter(|other| **other == action).count(), 1, "{action:?}");
        }
    }
}
