//! The panels of the window on a recording: the numbers of the shown tick, the progress of the
//! replay, and the time line.

use eframe::egui::{self, RichText};
use palpus_device::Cut;

use super::icons::Icon;
use super::keys::Action;
use super::timeline::Mark;
use super::{Player, SPEEDS};
use crate::scene::LISTED;
use crate::window::view3d::colour;
use crate::window::{keys, shell};

/// Width of the number beside the slider, points.
const SLIDER_NUMBER: f32 = 90.0;

impl Player {
    /// Draws the numbers on the right (step 3).
    pub(super) fn side(&mut self, ui: &mut egui::Ui) {
        let tick = self.tick();
        let now = self.ticks[tick];
        ui.add_space(shell::TOP);
        ui.heading(&self.scene.title);
        self.words_of_progress(ui, tick);
        ui.separator();
        let separation = match now.separation {
            s if s.is_finite() => format!("{:.3} mm", s * 1e3),
            _ => "none near".to_owned(),
        };
        shell::rows(
            ui,
            "numbers",
            [
                ("tick", format!("{tick} of {}", self.ticks.len())),
                ("time", format!("{:.3} s", now.time)),
                ("force", format!("{:.3} N", now.force)),
                ("torque", format!("{:.2} mN·m", now.torque * 1e3)),
                ("contacts", now.contacts.to_string()),
                ("clusters", now.clusters.to_string()),
                ("separation", separation),
                ("query, recorded", format!("{:.1} µs", now.query * 1e6)),
                ("tick, recorded", format!("{:.1} µs", now.total * 1e6)),
            ],
        );
        let colours = self.style.theme.colours();
        let cuts: Vec<&str> = now.cuts.iter().map(Cut::name).chain(now.late.then_some("late tick")).collect();
        let of_cuts = if now.cuts.is_fault() { colours.penetrating } else { colours.sliding };
        let cuts = if cuts.is_empty() { "force not reduced".to_owned() } else { cuts.join(", ").replace('_', " ") };
        ui.label(RichText::new(cuts).color(colour(if now.cuts.is_none() && !now.late {
            colours.faint
        } else {
            of_cuts
        })));
        ui.separator();
        for (words, shown) in [
            ("contacts (C)", &mut self.style.contacts),
            ("forces of clusters (A)", &mut self.style.clusters),
            ("force and torque (F)", &mut self.style.wrench),
            ("where friction holds (H)", &mut self.style.anchors),
        ] {
            ui.checkbox(shown, words);
        }
        for body in self.scene.bodies.iter_mut().take(LISTED) {
            ui.horizontal(|ui| {
                ui.label(body.part.name());
                ui.toggle_value(&mut body.look.pieces, "pieces");
                ui.toggle_value(&mut body.look.wireframe, "wires");
                ui.toggle_value(&mut body.look.translucent, "glass");
            });
        }
        ui.separator();
        if let Some(action) = keys::buttons(ui) {
            self.act_on_scene(&ui.ctx().clone(), action);
        }
        ui.separator();
        self.status.show(ui);
    }

    /// Writes the progress of the replay, and whether it matches the recording.
    fn words_of_progress(&self, ui: &mut egui::Ui, tick: usize) {
        let (colours, progress) = (self.style.theme.colours(), &self.progress);
        if let Some(why) = &progress.failed {
            ui.label(
                RichText::new(format!("replayed up to {:.2} s: {why}", self.timeline.time(progress.ticks)))
                    .color(colour(colours.penetrating)),
            );
        } else if progress.ticks < self.ticks.len() {
            let part = progress.ticks as f32 / self.ticks.len() as f32;
            ui.add(egui::ProgressBar::new(part).text("running it again"));
        }
        let (words, rgb) = match progress.first_difference {
            None if progress.ticks == 0 => ("nothing run again yet".to_owned(), colours.faint),
            None => (format!("{} wrenches as recorded, bit for bit", progress.ticks), colours.disjoint),
            Some(first) => (
                format!("{} of {} wrenches differ, from tick {first} on", progress.differing, progress.ticks),
                colours.penetrating,
            ),
        };
        ui.label(RichText::new(words).color(colour(rgb)));
        match self.shown {
            Some((_, None)) => drop(ui.label("not replayed yet: only the recorded pose is shown")),
            Some((_, Some(kept))) if kept != tick => {
                ui.label(format!("to save memory, one tick of {} is kept; tick {kept} is shown", self.every));
            }
            _ => {}
        }
    }

    /// Draws the time line at the bottom (step 3).
    pub(super) fn below(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        ui.horizontal_wrapped(|ui| {
            let play = if self.playing { Icon::Pause } else { Icon::Play };
            for (action, icon, hint) in [
                (Action::Begin, Icon::Begin, "to the beginning (Home)"),
                (Action::Step(-1), Icon::Back, "one tick back (Left)"),
                (Action::Play, play, "play, pause (Space)"),
                (Action::Step(1), Icon::On, "one tick on (Right)"),
                (Action::End, Icon::End, "to the end (End)"),
            ] {
                if icon.button(ui, hint).clicked() {
                    self.act(&context, action);
                }
            }
            egui::ComboBox::from_id_salt("speed")
                .selected_text(format!("{}×", SPEEDS[self.speed]))
                .width(64.0)
                .show_ui(ui, |ui| {
                    for (k, speed) in SPEEDS.iter().enumerate() {
                        ui.selectable_value(&mut self.speed, k, format!("{speed}×"));
                    }
                });
            for (action, name) in [
                (Action::EarlierMark, "earlier fault (B)"),
                (Action::LaterMark, "next fault (N)"),
                (Action::Strongest, "largest force (J)"),
            ] {
                if ui.button(name).clicked() {
                    self.act(&context, action);
                }
            }
            let counted = |mark: Mark| self.timeline.marks.iter().filter(|(_, m)| *m == mark).count();
            ui.label(format!(
                "{:.3} of {:.3} s · {} late, {} with faults",
                self.time,
                self.timeline.end(),
                counted(Mark::Late),
                counted(Mark::Fault)
            ));
        });
        ui.spacing_mut().slider_width = (ui.available_width() - SLIDER_NUMBER).max(50.0);
        let end = self.timeline.end().max(f64::MIN_POSITIVE);
        // A fixed number of decimals would round the time, and the tick before would be shown.
        let written = |time: f64, _| format!("{time:.3} s");
        ui.add(egui::Slider::new(&mut self.time, 0.0..=end).custom_formatter(written));
        let known = if self.progress.ticks == 0 { 0 } else { self.progress.ticks - 1 };
        let tick = self.tick();
        if let Some(time) = self.timeline.show(ui, self.style.theme, tick, known) {
            self.time = time;
        }
    }
}
