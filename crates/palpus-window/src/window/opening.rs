//! What is to be felt next: a file that was dropped or whose path was typed, or a built-in scene.
//!
//! 1. A path that names a file is read at once, on a thread of its own, to say whether it is a
//!    scene or a mesh, and how large.
//! 2. A mesh needs two answers: which of the two bodies it becomes, and what a length of 1 in it
//!    means. The second is guessed from its size.
//! 3. Enter, or the button, has the run prepare it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui::{self, Button, Context, Id, Key, Label, Modal, RichText, ScrollArea, TextEdit, Ui};
use glam::DVec3;

use super::dress::small;
use super::run::{FileKind, Part, Run, Wanted};

/// Points.
const WIDTH: f32 = 740.0;
const SCENES_HEIGHT: f32 = 210.0;
/// m: what is held, and what it touches, is about so large.
const LIKELY: [f64; 2] = [4e-3, 1.2];

/// What a length of 1 in a file means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    Millimetre,
    Metre,
    Centimetre,
    Inch,
}

/// Something to open, in the making.
pub(super) struct Opening {
    path: String,
    /// The path that was read, and what came of it.
    read: Option<(PathBuf, Reading)>,
    part: Part,
    unit: Unit,
    scenes: Vec<(String, String)>,
    /// Enter was pressed before the file was read.
    hurries: bool,
    is_new: bool,
}

enum Reading {
    UnderWay(Receiver<Result<FileKind, String>>),
    Done(Result<FileKind, String>),
}

impl Unit {
    /// The likelier first: a size may fit several.
    const ALL: [Self; 4] = [Self::Millimetre, Self::Metre, Self::Centimetre, Self::Inch];

    fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Inch => "inch",
        }
    }

    fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 1e-3,
            Self::Metre => 1.0,
            Self::Centimetre => 1e-2,
            Self::Inch => 25.4e-3,
        }
    }

    /// The first in which the largest side is that of a thing one holds or touches.
    fn likely(size: DVec3) -> Self {
        let largest = size.max_element();
        let fits = |unit: &Self| (LIKELY[0]..=LIKELY[1]).contains(&(largest * unit.metres()));
        Self::ALL.into_iter().find(fits).unwrap_or(Self::Millimetre)
    }
}

impl Opening {
    /// With a file that was dropped, or with nothing yet.
    pub(super) fn new(path: Option<&Path>, run: &dyn Run) -> Self {
        Self {
            path: path.map_or(String::new(), |path| path.display().to_string()),
            read: None,
            part: Part::default(),
            unit: Unit::Millimetre,
            scenes: run.scenes(),
            hurries: false,
            is_new: true,
        }
    }

    /// The dialog. True while it is wanted; an error is what the run says against what was chosen.
    pub(super) fn show(&mut self, context: &Context, run: &mut dyn Run) -> Result<bool, String> {
        self.look(run);
        let mut wanted = None;
        let mut cancelled = false;
        let modal = Modal::new(Id::unique("open")).show(context, |ui| {
            ui.set_width(WIDTH.min(context.content_rect().width() - 60.0));
            ui.heading("Feel something else");
            ui.add_space(4.0);
            self.file(ui, &mut wanted);
            ui.add_space(8.0);
            if !self.scenes.is_empty() {
                ui.label(RichText::new("or one of these").strong());
                self.built_in(ui, &mut wanted);
            }
            ui.add_space(6.0);
            cancelled = ui.button("stay with what there is (Esc)").clicked();
        });
        self.is_new = false;
        if let Some(wanted) = wanted {
            run.load(wanted)?;
            return Ok(false);
        }
        Ok(!(cancelled || modal.should_close()))
    }

    /// Step 1.
    fn look(&mut self, run: &dyn Run) {
        let path = PathBuf::from(self.path.trim());
        let is_read = self.read.as_ref().is_some_and(|(read, _)| *read == path);
        if !is_read {
            self.read = path.is_file().then(|| {
                let (tell, told) = channel();
                let (read, file) = (run.reader(), path.clone());
                // Nobody may be there to hear it any more.
                std::thread::spawn(move || tell.send(read(&file)));
                (path, Reading::UnderWay(told))
            });
        }
        let Some((_, reading)) = &mut self.read else { return };
        let Reading::UnderWay(told) = reading else { return };
        let kind = match told.try_recv() {
            Ok(kind) => kind,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Err("it could not be read".to_owned()),
        };
        if let Ok(FileKind::Mesh { size, .. }) = &kind {
            self.unit = Unit::likely(*size);
        }
        *reading = Reading::Done(kind);
    }

    /// Steps 2 and 3.
    fn file(&mut self, ui: &mut Ui, wanted: &mut Option<Wanted>) {
        ui.label("drop a mesh or a scene file on the window, or write where it is");
        let edit = TextEdit::singleline(&mut self.path)
            .desired_width(f32::INFINITY)
            .hint_text("path of an .obj, .stl, .ply or .toml file");
        let response = ui.add(edit);
        if self.is_new {
            response.request_focus();
        }
        let enters = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        self.hurries |= enters;
        let Some((file, reading)) = &self.read else {
            self.hurries = false;
            if !self.path.trim().is_empty() {
                ui.label(small("there is no such file"));
            }
            return;
        };
        match reading {
            Reading::UnderWay(_) => {
                ui.horizontal(|ui| {
                    ui.spinner();
                    ui.label("reading it");
                });
            }
            Reading::Done(Err(why)) => {
                self.hurries = false;
                ui.label(RichText::new(why).color(ui.visuals().error_fg_color));
            }
            Reading::Done(Ok(FileKind::Scene)) => {
                if ui.button("feel this scene (Enter)").clicked() || self.hurries {
                    *wanted = Some(Wanted::SceneFile(file.clone()));
                }
            }
            Reading::Done(Ok(FileKind::Mesh { size, triangles })) => {
                let (size, triangles) = (*size, *triangles);
                ui.horizontal(|ui| {
                    ui.label("as");
                    ui.radio_value(&mut self.part, Part::Probe, "probe");
                    ui.radio_value(&mut self.part, Part::Environment, "environment");
                    ui.separator();
                    ui.label("its unit");
                    for unit in Unit::ALL {
                        ui.radio_value(&mut self.unit, unit, unit.name());
                    }
                });
                ui.label(format!("{triangles} triangles, {} large", sides(size * self.unit.metres())));
                if ui.add(Button::new(RichText::new("prepare and feel it (Enter)").strong())).clicked() || self.hurries
                {
                    let (file, metres_per_unit) = (file.clone(), self.unit.metres());
                    *wanted = Some(Wanted::Mesh { file, part: self.part, metres_per_unit });
                }
            }
        }
    }

    fn built_in(&self, ui: &mut Ui, wanted: &mut Option<Wanted>) {
        ScrollArea::vertical().max_height(SCENES_HEIGHT).auto_shrink([false, true]).show(ui, |ui| {
            egui::Grid::new("scenes").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
                for (name, summary) in &self.scenes {
                    if ui.button(name).clicked() {
                        *wanted = Some(Wanted::Scene(name.clone()));
                    }
                    ui.add(Label::new(summary).truncate());
                    ui.end_row();
                }
            });
        });
    }
}

/// A box's sides in a unit that suits them.
fn sides(metres: DVec3) -> String {
    let (times, unit, figures) = match metres.max_element() {
        largest if largest >= 1.0 => (1.0, "m", 2),
        largest if largest >= 0.1 => (1e2, "cm", 1),
        _ => (1e3, "mm", 1),
    };
    let [x, y, z] = (metres * times).to_array();
    format!("{x:.figures$} × {y:.figures$} × {z:.figures$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_guessed_from_sizes_of_things() {
        for (largest, unit) in [(80.0, "mm"), (0.12, "m"), (1.0, "m"), (2.0, "cm"), (1.2e3, "mm"), (9e9, "mm")] {
            assert_eq!(Unit::likely(DVec3::new(0.5 * largest, largest, 0.1 * largest)).name(), unit, "{largest}");
        }
        assert_eq!(sides(DVec3::new(0.08, 0.044, 0.03)), "80.0 × 44.0 × 30.0 mm");
    }
}
