//! The dialog that chooses the next scene: meshes for the probe and the environment, a scene file,
//! a recent file, or a built-in scene.
//!
//! 1. Each body has a [`Slot`] for a file that was dropped, typed or chosen from the recent files.
//!    A body without a new file stays.
//! 2. Enter or the button starts the preparation of both.

use std::path::{Path, PathBuf};

use eframe::egui::{self, Button, Context, Id, Label, Modal, RichText, ScrollArea, Ui};

use super::run::{MeshFile, Run, Wanted};
use super::slot::{Content, Slot};
use super::theme::small;

/// Width of the dialog, points.
const WIDTH: f32 = 740.0;
/// Smallest difference between the size of the window and the size of the dialog, points.
const MARGIN: f32 = 50.0;
/// Smallest height of the list of scenes, points.
const SCENES_HEIGHT: f32 = 160.0;
/// Distance between the rows of that list, points.
const SCENES_GAP: f32 = 5.0;
/// Width of the column of names.
const SCENE_NAME: f32 = 120.0;
/// Number of recent files in the dialog.
const MOST_RECENT: usize = 5;

/// State of the dialog.
pub(super) struct Opening {
    probe: Slot,
    environment: Slot,
    scenes: Vec<(String, String)>,
    recent: Vec<PathBuf>,
    /// True if Enter was pressed before the files were read.
    hurries: bool,
    is_new: bool,
}

impl Opening {
    pub(super) fn new(run: &dyn Run) -> Self {
        let recent = run.recent().into_iter().take(MOST_RECENT).collect();
        let (probe, environment) = (Slot::new(None), Slot::new(None));
        Self { probe, environment, scenes: run.scenes(), recent, hurries: false, is_new: true }
    }

    /// Takes a file that was dropped or chosen: for the probe if it has no file yet, else for the
    /// environment.
    pub(super) fn take(&mut self, path: &Path) {
        let is_free = self.probe.content() == Content::Empty;
        *(if is_free { &mut self.probe } else { &mut self.environment }) = Slot::new(Some(path));
    }

    /// Draws the dialog. Returns true while the dialog stays open. The error is the run's message
    /// about the choice.
    pub(super) fn show(&mut self, context: &Context, run: &mut dyn Run) -> Result<bool, String> {
        self.probe.look(run);
        self.environment.look(run);
        Slot::guess_units(&mut self.probe, &mut self.environment);
        let mut wanted = None;
        let mut cancelled = false;
        let room = context.content_rect().size() - egui::Vec2::splat(MARGIN);
        let modal = Modal::new(Id::unique("open")).show(context, |ui| {
            ui.set_width(WIDTH.min(room.x));
            ScrollArea::vertical().max_height(room.y).min_scrolled_height(room.y).show(ui, |ui| {
                let top = ui.cursor().top();
                ui.horizontal(|ui| {
                    ui.heading("Feel something else");
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        cancelled = ui.button("cancel (Esc)").clicked();
                    });
                });
                ui.label(small("Drop meshes or a scene file on the window, or type their paths."));
                ui.add_space(4.0);
                self.files(ui, &mut wanted);
                self.recent(ui);
                if !self.scenes.is_empty() {
                    ui.add_space(8.0);
                    ui.label(RichText::new("Built-in scenes").strong());
                    let rest = room.y - (ui.cursor().top() - top);
                    self.built_in(ui, rest.max(SCENES_HEIGHT), &mut wanted);
                }
            });
        });
        self.is_new = false;
        if let Some(wanted) = wanted {
            run.load(wanted)?;
            return Ok(false);
        }
        Ok(!(cancelled || modal.should_close()))
    }

    /// Draws both slots and starts the preparation (steps 1 and 2).
    fn files(&mut self, ui: &mut Ui, wanted: &mut Option<Wanted>) {
        ui.label(RichText::new("Probe").strong());
        let hint = "a mesh (.obj, .stl, .ply, .glb …), or a scene file (.toml)";
        self.hurries |= self.probe.show(ui, hint, self.is_new);
        ui.label(RichText::new("Environment").strong());
        self.hurries |= self.environment.show(ui, "a mesh", false);
        let chosen = chosen(self.probe.content(), self.environment.content());
        ui.horizontal(|ui| {
            let feel = Button::new(RichText::new("prepare and feel (Enter)").strong());
            let is_clicked = ui.add_enabled(matches!(chosen, Chosen::Ready(_)), feel).clicked();
            if ui.button("swap").on_hover_text("the probe becomes the environment").clicked() {
                std::mem::swap(&mut self.probe, &mut self.environment);
            }
            match chosen {
                Chosen::Ready(ready) if is_clicked || self.hurries => *wanted = Some(ready),
                Chosen::Ready(_) | Chosen::Soon => {}
                Chosen::Nothing => self.hurries = false,
            }
        });
    }

    fn recent(&mut self, ui: &mut Ui) {
        if self.recent.is_empty() {
            return;
        }
        ui.add_space(8.0);
        ui.label(RichText::new("Recent files").strong());
        let mut clicked = None;
        ui.horizontal_wrapped(|ui| {
            for file in &self.recent {
                if ui.button(short(file)).on_hover_text(file.display().to_string()).clicked() {
                    clicked = Some(file.clone());
                }
            }
        });
        if let Some(file) = clicked {
            self.take(&file);
        }
    }

    /// Lists the built-in scenes in whole rows, in at most `height` points.
    fn built_in(&self, ui: &mut Ui, height: f32, wanted: &mut Option<Wanted>) {
        let row = ui.spacing().interact_size.y + SCENES_GAP;
        let height = (height / row).floor() * row;
        ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            let wide = ui.available_width() - SCENE_NAME;
            egui::Grid::new("scenes").num_columns(2).spacing([10.0, SCENES_GAP]).max_col_width(wide).show(ui, |ui| {
                for (name, summary) in &self.scenes {
                    if ui.button(name).clicked() {
                        *wanted = Some(Wanted::Scene(name.clone()));
                    }
                    ui.add(Label::new(summary).wrap());
                    ui.end_row();
                }
            });
        });
    }
}

/// Result of both slots.
#[derive(Debug, PartialEq)]
enum Chosen {
    /// Not a valid choice.
    Nothing,
    /// Files are still being read.
    Soon,
    Ready(Wanted),
}

fn chosen(probe: Content, environment: Content) -> Chosen {
    let mesh =
        |content: Content| -> Option<MeshFile> { if let Content::Mesh(mesh) = content { Some(mesh) } else { None } };
    match (probe, environment) {
        (Content::Scene(file), _) | (_, Content::Scene(file)) => Chosen::Ready(Wanted::SceneFile(file)),
        (Content::Bad, _) | (_, Content::Bad) | (Content::Empty, Content::Empty) => Chosen::Nothing,
        (Content::Busy, _) | (_, Content::Busy) => Chosen::Soon,
        (probe, environment) => Chosen::Ready(Wanted::Meshes { probe: mesh(probe), environment: mesh(environment) }),
    }
}

/// Returns the text for a file: its name, and for a scene file also its folder, because many are
/// called `scene.toml`.
fn short(file: &Path) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_scene = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    match file.parent().filter(|_| is_scene) {
        Some(folder) => format!("{}/{}", name(folder), name(file)),
        None => name(file),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_meshes_are_opened_together() {
        let mesh = |name: &str| MeshFile { file: PathBuf::from(name), metres_per_unit: 1e-3 };
        let of = |name: &str| Content::Mesh(mesh(name));
        let both = Wanted::Meshes { probe: Some(mesh("a.obj")), environment: Some(mesh("b.obj")) };
        assert_eq!(chosen(of("a.obj"), of("b.obj")), Chosen::Ready(both));
        let one = Wanted::Meshes { probe: None, environment: Some(mesh("b.obj")) };
        assert_eq!(chosen(Content::Empty, of("b.obj")), Chosen::Ready(one));
        assert_eq!(chosen(of("a.obj"), Content::Busy), Chosen::Soon);
        assert_eq!(chosen(of("a.obj"), Content::Bad), Chosen::Nothing);
        let scene = PathBuf::from("s.toml");
        let wanted = Wanted::SceneFile(scene.clone());
        assert_eq!(chosen(Content::Empty, Content::Scene(scene)), Chosen::Ready(wanted));
    }
}
