//! The settings of contact in the window: presets, switches and sliders.
//!
//! The panel shows the run's current settings, and requests other settings only if the user changes
//! something.

use std::time::{Duration, Instant};

use eframe::egui::{Align, Grid, Label, Layout, RichText, Sense, Slider, Ui, vec2};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Settings};

use super::quantity::{Fitting, Quantity};
use super::run::{Preset, Run};
use super::run_keys::Action;

/// Width of a slider, points.
const SLIDER: f32 = 84.0;
/// Width of the name of a row, points.
const CAPTION: f32 = 84.0;
/// Default crease angle, degrees.
const USUAL_CREASE: f64 = 40.0;
/// Default largest angle by which shading turns a force, degrees.
const MOST_TURN: f64 = 45.0;
/// Default coefficients of friction, static and dynamic.
const USUAL_FRICTION: (f64, f64) = (0.4, 0.3);

/// Changes within this time count as one change for undo.
const ONE_CHANGE: Duration = Duration::from_millis(700);

/// See the module's outline.
pub(super) struct Feel {
    presets: Vec<Preset>,
    fitting: Fitting,
    /// The setting that the keys change.
    chosen: usize,
    /// Settings to compare with, if any were kept.
    kept: Option<Settings>,
    /// Earlier settings for undo, oldest first.
    before: Vec<(Settings, Instant)>,
}

impl Feel {
    pub(super) fn of(run: &dyn Run) -> Self {
        let presets = run.presets();
        let fitting = Fitting::of(&presets, &run.settings());
        Self { presets, fitting, chosen: 0, kept: None, before: Vec::new() }
    }

    /// Returns the names of both compared settings, and the settings to compare with `now`: the
    /// kept settings, else the paper's, or palpus's own if the paper's are felt.
    pub(super) fn other(&self, now: &Settings) -> ([&'static str; 2], Settings) {
        let is_of =
            |preset: &Preset| Settings { limits: now.limits, capacity: now.capacity, ..preset.settings } == *now;
        let own = self.presets.iter().find(|preset| is_of(preset)).map_or("these settings", |preset| preset.name);
        if let Some(kept) = self.kept {
            return ([own, "kept settings"], kept);
        }
        let other = self.presets.iter().rev().find(|preset| !is_of(preset));
        other.map_or(([own, own], *now), |preset| ([own, preset.name], preset.settings))
    }

    /// Sets the settings to compare with.
    pub(super) fn keep(&mut self, now: &Settings) {
        self.kept = Some(*now);
    }

    /// Passes `wanted` to the run, and keeps the previous settings for undo.
    fn change(&mut self, run: &mut dyn Run, now: &Settings, wanted: &Settings) -> Result<(), String> {
        if wanted == now {
            return Ok(());
        }
        apply(run, now, wanted)?;
        // All changes by one drag of a slider count as one change.
        let is_going_on = self.before.last().is_some_and(|(_, when)| when.elapsed() < ONE_CHANGE);
        match self.before.last_mut().filter(|_| is_going_on) {
            Some((_, when)) => *when = Instant::now(),
            None => self.before.push((*now, Instant::now())),
        }
        Ok(())
    }

    /// Carries out the action of a key or a button.
    ///
    /// # Errors
    ///
    /// Fails with the run's message.
    pub(super) fn act(&mut self, action: Action, run: &mut dyn Run) -> Result<(), String> {
        let now = run.settings();
        let mut wanted = now;
        match action {
            Action::Preset(k) => match self.presets.get(k) {
                Some(preset) => wanted = preset.settings,
                None => return Err("there is no such preset for this scene".to_owned()),
            },
            Action::Coupling => {
                wanted = self.fitting.switched(&now).ok_or("there is no coupling for this device")?;
            }
            Action::Clustering => {
                wanted.clustering = match now.clustering {
                    Clustering::Smooth => Clustering::Linkage,
                    Clustering::Linkage => Clustering::Smooth,
                }
            }
            Action::Shading => wanted.shading = if now.shading.is_some() { None } else { Some(self.usual_shading()) },
            Action::Friction => {
                wanted.friction = if now.friction.is_some() { None } else { Some(self.usual_friction(&now)) }
            }
            Action::Undo => {
                let (before, _) = self.before.pop().ok_or("there is nothing to undo")?;
                return apply(run, &now, &before);
            }
            Action::EarlierSetting => self.choose(&now, Quantity::ALL.len() - 1),
            Action::LaterSetting => self.choose(&now, 1),
            Action::Less | Action::More => {
                let quantity = Quantity::ALL[self.chosen];
                if let Some(value) = quantity.get(&now) {
                    let range = quantity.range(&self.fitting, &now);
                    quantity.set(&mut wanted, range.pressed(value, action == Action::More));
                }
            }
            _ => {}
        }
        self.change(run, &now, &wanted)
    }

    /// Selects the next applicable setting in the direction of `step`; wraps around.
    fn choose(&mut self, now: &Settings, step: usize) {
        for _ in 0..Quantity::ALL.len() {
            self.chosen = (self.chosen + step) % Quantity::ALL.len();
            if Quantity::ALL[self.chosen].get(now).is_some() {
                return;
            }
        }
    }

    fn usual_shading(&self) -> ShadingSettings {
        let of_presets = self.presets.iter().find_map(|preset| preset.settings.shading);
        of_presets
            .unwrap_or(ShadingSettings { crease_angle: USUAL_CREASE.to_radians(), most_turn: MOST_TURN.to_radians() })
    }

    fn usual_friction(&self, now: &Settings) -> FrictionSettings {
        let of_presets = self.presets.iter().find_map(|preset| preset.settings.friction);
        let (static_coefficient, dynamic_coefficient) =
            of_presets.map_or(USUAL_FRICTION, |friction| (friction.static_coefficient, friction.dynamic_coefficient));
        // The tangential stiffness equals the normal stiffness.
        FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness: now.stiffness }
    }

    /// Draws the panel, and adds the actions of its buttons to `actions`.
    ///
    /// # Errors
    ///
    /// Fails with the run's message about a slider.
    pub(super) fn show(&mut self, ui: &mut Ui, run: &mut dyn Run, actions: &mut Vec<Action>) -> Result<(), String> {
        let now = run.settings();
        let mut wanted = now;
        ui.horizontal(|ui| {
            caption(ui, "settings");
            for (k, (preset, key)) in self.presets.iter().zip(["B", "V", "", ""]).enumerate() {
                let is_on = Settings { limits: now.limits, capacity: now.capacity, ..preset.settings } == now;
                if ui
                    .selectable_label(is_on, preset.name)
                    .on_hover_text(format!("sets all settings to this preset ({key})"))
                    .clicked()
                {
                    actions.push(Action::Preset(k));
                }
            }
        });
        let mut switch =
            |ui: &mut Ui, of: &str, action: Action, key: &str, is_first: bool, names: [&str; 2], words: [&str; 2]| {
                ui.horizontal(|ui| {
                    caption(ui, of);
                    for (k, (name, words)) in names.into_iter().zip(words).enumerate() {
                        let is_on = is_first == (k == 0);
                        let response = ui.selectable_label(is_on, name).on_hover_text(format!("{words} ({key})"));
                        if response.clicked() && !is_on {
                            actions.push(action);
                        }
                    }
                });
            };
        switch(
            ui,
            "rendering",
            Action::Coupling,
            "D",
            now.coupling.is_some(),
            ["coupled", "direct"],
            [
                "a tool on a spring touches the part: palpus's method",
                "the device moves the tool directly: the paper's method",
            ],
        );
        switch(
            ui,
            "clustering",
            Action::Clustering,
            "K",
            now.clustering == Clustering::Smooth,
            ["smooth", "linkage"],
            [
                "contacts share a force without jumps: palpus's method",
                "contacts are grouped by distance: the paper's method",
            ],
        );
        ui.horizontal(|ui| {
            for (words, is_on, action, key) in [
                ("friction", now.friction.is_some(), Action::Friction, "I"),
                ("shading", now.shading.is_some(), Action::Shading, "X"),
            ] {
                let mut ticked = is_on;
                if ui.checkbox(&mut ticked, words).on_hover_text(key).changed() {
                    actions.push(action);
                }
            }
        });
        ui.add_space(4.0);
        self.sliders(ui, &now, &mut wanted);
        self.change(run, &now, &wanted)?;
        ui.horizontal_wrapped(|ui| {
            for (words, hint, action) in [
                (
                    "compare",
                    "compares with the paper's settings, or the kept ones, on the same hand (Y)",
                    Action::Beside,
                ),
                ("keep to compare", "keeps these settings for the comparison (N)", Action::Keep),
                ("undo", "undoes one change (U)", Action::Undo),
            ] {
                if ui.button(words).on_hover_text(hint).clicked() {
                    actions.push(action);
                }
            }
            if ui
                .button("save scene")
                .on_hover_text("saves the scene with these settings as a scene file (F2)")
                .clicked()
            {
                actions.push(Action::Save);
            }
            if ui.button("copy as TOML").on_hover_text("copies these settings for a scene file").clicked() {
                ui.ctx().copy_text(run.settings_as_toml());
            }
        });
        Ok(())
    }

    /// Returns the default value of a quantity: from palpus's own settings, or from the paper's for
    /// direct rendering.
    fn usual(&self, quantity: Quantity, now: &Settings) -> Option<f64> {
        let alike = |preset: &&Preset| preset.settings.coupling.is_some() == now.coupling.is_some();
        quantity.get(&self.presets.iter().find(alike)?.settings)
    }

    fn sliders(&self, ui: &mut Ui, now: &Settings, wanted: &mut Settings) {
        ui.spacing_mut().slider_width = SLIDER;
        Grid::new("settings").num_columns(2).spacing([8.0, 5.0]).show(ui, |ui| {
            for (k, quantity) in Quantity::ALL.into_iter().enumerate() {
                let Some(mut value) = quantity.get(now) else { continue };
                let name = RichText::new(quantity.name());
                let name = if k == self.chosen { name.strong().underline() } else { name };
                let usual = self.usual(quantity, now);
                let is_changed = usual.is_some_and(|usual| (usual - value).abs() > 1e-9 * usual.abs());
                let label = if is_changed {
                    let hint = format!("{}; click to reset it", quantity.words());
                    ui.add(Label::new(name.color(ui.visuals().hyperlink_color)).sense(Sense::click()))
                        .on_hover_text(hint)
                } else {
                    ui.label(name).on_hover_text(quantity.words())
                };
                if let Some(usual) = usual.filter(|_| is_changed && label.clicked()) {
                    quantity.set(wanted, usual);
                }
                let range = quantity.range(&self.fitting, now);
                let slider = Slider::new(&mut value, range.low..=range.high)
                    .logarithmic(range.logarithmic)
                    .custom_formatter(|value, _| rounded(value, quantity.unit()))
                    .custom_parser(|text| parsed(text, quantity.unit()));
                if ui.add(slider).labelled_by(label.id).on_hover_text(quantity.words()).changed() {
                    quantity.set(wanted, value);
                }
                ui.end_row();
            }
        });
    }
}

/// Writes the name of a row of choices.
fn caption(ui: &mut Ui, words: &str) {
    let size = vec2(CAPTION, ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(CAPTION);
        ui.label(words);
    });
}

fn apply(run: &mut dyn Run, now: &Settings, wanted: &Settings) -> Result<(), String> {
    if wanted == now {
        return Ok(());
    }
    // The device sets the limits and the run sets the capacity, so neither changes here.
    let wanted = Settings { limits: now.limits, capacity: now.capacity, ..*wanted };
    run.set_settings(&wanted)
}

/// Returns a value with its `unit`, rounded to three significant digits. Long numbers have a prefix
/// of the unit.
fn rounded(value: f64, unit: &str) -> String {
    let (number, prefix) = match value {
        v if v >= 9.995e6 => (format!("{:.1}", v / 1e6), "M"),
        v if v >= 9995.0 => (format!("{:.0}", v / 1e3), "k"),
        v if v >= 99.95 => (format!("{v:.0}"), ""),
        v if v >= 9.995 => (format!("{v:.1}"), ""),
        v if v >= 0.9995 || v == 0.0 => (format!("{v:.2}"), ""),
        v if v < 0.00995 && unit == MILLIMETRES => return rounded(v * 1e3, MICROMETRES),
        v => (format!("{v:.3}"), ""),
    };
    match unit.strip_prefix(' ') {
        Some(name) => format!("{number} {prefix}{name}"),
        None => format!("{number}{prefix}{unit}"),
    }
}

const MILLIMETRES: &str = " mm";
const MICROMETRES: &str = " µm";

/// Reads a value that [`rounded`] has written with this `unit`, or a number without a unit.
fn parsed(text: &str, unit: &str) -> Option<f64> {
    let text = text.trim();
    if let Some(micrometres) = text.strip_suffix(MICROMETRES.trim_start()).filter(|_| unit == MILLIMETRES) {
        return micrometres.trim().parse::<f64>().ok().map(|value| value * 1e-3);
    }
    let number = text.strip_suffix(unit.trim_start()).unwrap_or(text).trim_end();
    let (digits, factor) = match (number.strip_suffix('k'), number.strip_suffix('M')) {
        (Some(thousands), _) => (thousands, 1e3),
        (_, Some(millions)) => (millions, 1e6),
        _ => (number, 1.0),
    };
    digits.trim().parse::<f64>().ok().map(|value| value * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_keep_three_figures() {
        let values = [0.0, 0.1234, 1.0, 12.34, 123.4, 1234.0, 170e3, 14.59e6];
        let words = values.map(|value| rounded(value, " N/m"));
        assert_eq!(
            words,
            ["0.00 N/m", "0.123 N/m", "1.00 N/m", "12.3 N/m", "123 N/m", "1234 N/m", "170 kN/m", "14.6 MN/m"]
        );
        let read = words.map(|text| parsed(&text, " N/m"));
        assert_eq!(read, [0.0, 0.123, 1.0, 12.3, 123.0, 1234.0, 170e3, 14.6e6].map(Some));
        assert_eq!(
            [(40.0, "°"), (0.4, ""), (0.00021, " mm")].map(|(v, u)| rounded(v, u)),
            ["40.0°", "0.400", "0.210 µm"]
        );
        assert_eq!(
            [("40.0°", "°"), ("0.4", ""), ("3 mm", " mm")].map(|(t, u)| parsed(t, u)),
            [40.0, 0.4, 3.0].map(Some)
        );
        let read = parsed("0.210 µm", " mm").expect("the text is a length");
        assert!((read - 0.00021).abs() < 1e-12, "{read}");
    }
}
