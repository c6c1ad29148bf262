//! The status panel: the state of the run as text, and numbers of the loop.

use std::time::{Duration, Instant};

use eframe::egui::{self, Color32, Grid, RichText, Ui};
use palpus_device::{Cut, Phase};

use super::run::{Numbers, Run};
use super::theme::{large, small};
use super::view3d::colour;
use crate::picture::Rgb;
use crate::style::Theme;

/// Time over which the rate is measured.
const RATE_SPAN: Duration = Duration::from_millis(500);
/// Time for which a cut stays visible after its last tick.
const CUT_SPAN: Duration = Duration::from_millis(1500);
/// Size of the letters of a value, points.
const VALUE: f32 = 20.0;

/// The state of the panel between frames.
pub(super) struct Status {
    now: Numbers,
    counted: (Instant, u64),
    rate: f64,
    /// When each cut was last seen.
    cuts: [Option<Instant>; Cut::ALL.len()],
}

impl Default for Status {
    fn default() -> Self {
        Self { now: Numbers::default(), counted: (Instant::now(), 0), rate: 0.0, cuts: [None; Cut::ALL.len()] }
    }
}

impl Status {
    /// Updates the panel with the newest numbers.
    pub(super) fn take(&mut self, now: Numbers) {
        self.now = now;
        let passed = self.counted.0.elapsed();
        if passed > RATE_SPAN {
            self.rate = now.ticks.saturating_sub(self.counted.1) as f64 / passed.as_secs_f64();
            self.counted = (Instant::now(), now.ticks);
        }
        for cut in now.cuts.iter() {
            self.cuts[cut as usize] = Some(Instant::now());
        }
    }

    /// Returns recent cuts, except the start-up ramp, which the state shows.
    fn cuts(&self) -> impl Iterator<Item = Cut> {
        Cut::ALL.into_iter().filter(|cut| {
            *cut != Cut::StartUp && self.cuts[*cut as usize].is_some_and(|seen| seen.elapsed() < CUT_SPAN)
        })
    }

    /// Draws the state in one line, if there is no panel.
    pub(super) fn brief(&self, ui: &mut Ui, run: &dyn Run, theme: Theme) {
        let (words, lamp) = self.state(run, theme);
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(12.0, 18.0), egui::Sense::hover());
            ui.painter().circle_filled(rect.center(), 5.0, colour(lamp));
            ui.label(RichText::new(format!("{words} · {:.0} Hz", self.rate)).strong());
        });
    }

    /// Returns the text of the state, and the colour of its lamp.
    fn state(&self, run: &dyn Run, theme: Theme) -> (&'static str, Rgb) {
        let (words, is_well) = if run.is_over() {
            ("the run has ended", true)
        } else if run.is_paused() {
            ("paused", true)
        } else {
            said(self.now.phase)
        };
        let colours = theme.colours();
        let lamp = match (is_well, run.is_paused() || run.is_over()) {
            (true, false) => colours.disjoint,
            (true, true) => colours.faint,
            (false, _) => colours.sliding,
        };
        (words, lamp)
    }

    /// Draws the panel.
    pub(super) fn show(&self, ui: &mut Ui, run: &dyn Run, theme: Theme) {
        let (words, lamp) = self.state(run, theme);
        let waits_for = run.waits_for();
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(16.0, 34.0), egui::Sense::hover());
            ui.painter().circle_filled(rect.center(), 7.0, colour(lamp));
            ui.label(large(words));
        });
        let rate = if self.now.rate_hz > 0.0 { format!(", {:.0} Hz", self.now.rate_hz) } else { String::new() };
        ui.label(small(waits_for.unwrap_or_else(|| format!("{}{rate}", run.device().name))));
        self.numbers(ui);
        let cuts: Vec<&str> = self.cuts().map(reason).collect();
        let mut words = if cuts.is_empty() { String::new() } else { format!("force reduced: {}", cuts.join(", ")) };
        if self.now.carried > CARRIED {
            let comma = if words.is_empty() { "" } else { "; " };
            words += &format!("{comma}{:.0} % of the contacts extrapolated", 100.0 * self.now.carried);
        }
        // The line is always drawn, so that nothing below it moves.
        ui.label(RichText::new(words).small().color(ui.visuals().warn_fg_color));
        Self::trouble(ui, run);
    }

    /// Writes warnings next to the numbers.
    fn trouble(ui: &mut Ui, run: &dyn Run) {
        if let Some(words) = run.recording_trouble() {
            ui.label(RichText::new(words).small().color(ui.visuals().error_fg_color));
        }
    }

    fn numbers(&self, ui: &mut Ui) {
        let now = &self.now;
        let (text, bad) = (ui.visuals().strong_text_color(), ui.visuals().error_fg_color);
        let counted = |n: u64| (n.to_string(), if n > 0 { bad } else { text });
        let separation = match now.separation {
            separation if separation.is_finite() => distance(separation),
            _ => "–".to_owned(),
        };
        let load = (format!("{:.0} %", 100.0 * now.load), if now.load > 1.0 { bad } else { text });
        let rows: [[(&str, (String, Color32)); 3]; 2] = [
            [
                ("rate", (format!("{:.0} Hz", self.rate), text)),
                ("load", load),
                ("time", (format!("{:.1} s", now.time), text)),
            ],
            [("late ticks", counted(now.overruns)), ("faults", counted(now.faults)), ("distance", (separation, text))],
        ];
        let width = ui.available_width() / 3.0;
        Grid::new("numbers").num_columns(3).min_col_width(width - 4.0).spacing([4.0, 3.0]).show(ui, |ui| {
            for row in rows {
                for (name, (value, colour)) in row {
                    ui.vertical(|ui| {
                        ui.spacing_mut().item_spacing.y = 0.0;
                        ui.label(small(name));
                        ui.label(RichText::new(value).size(VALUE).color(colour));
                    });
                }
                ui.end_row();
            }
        });
    }
}

/// Share of extrapolated contacts below which the panel does not mention them.
const CARRIED: f64 = 0.01;

/// Returns a length (m) as text with three digits at most.
fn distance(length: f64) -> String {
    match length.abs() * 1e3 {
        below if below < 9.5e-5 => "0.00 mm".to_owned(),
        below if below < 0.095 => format!("{:.1} µm", length * 1e6),
        below if below < 9.5 => format!("{:.2} mm", length * 1e3),
        _ => format!("{:.1} mm", length * 1e3),
    }
}

/// Returns the reason for a smaller force, for the panel.
fn reason(cut: Cut) -> &'static str {
    match cut {
        Cut::NonFiniteState => "invalid state of the device",
        Cut::NonFiniteWrench => "invalid force",
        Cut::PoseJump => "the grip jumped",
        Cut::Speed => "the grip is too fast",
        Cut::FrozenState => "the device repeats its state",
        Cut::DeviceClock => "the device's clock jumped",
        Cut::Passivity => "damping of energy",
        Cut::Slew => "limit of change",
        Cut::Saturation => "limit of the device",
        Cut::Heat => "warm motors",
        Cut::StartUp => "start",
        Cut::LateLoop | Cut::Watchdog => "the loop stood still",
        Cut::Panic => "error in the program",
        Cut::Device => "error of the device",
        Cut::Paused => "paused",
        Cut::LimitCycle => "vibration",
        Cut::Withheld => "withheld by the device",
        Cut::Overrun => "many late ticks",
        Cut::Suspended => "the computer slept",
        Cut::Settings => "new settings",
        Cut::Ending => "end of the run",
    }
}

/// Returns the text for a phase of the start-up, and whether the phase is normal.
fn said(phase: Phase) -> (&'static str, bool) {
    match phase {
        Phase::Engaged => ("force is on", true),
        Phase::Idle => ("hold the button, or G", true),
        Phase::Waiting => ("move clear of the part", false),
        Phase::Ramping => ("force is rising", true),
        Phase::Faulted => ("a fault: no force", false),
        Phase::Stopped => ("stopped by a fault", false),
        Phase::Latched => ("faults: press G", false),
    }
}
