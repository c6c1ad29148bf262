//! A file of the dialog: its path, its content, and its unit of length.
//!
//! If the path names a file, the file is read at once on a separate thread, to find out whether it
//! is a scene or a mesh, and its size. The unit of a mesh is guessed from its size, or for two
//! meshes from both sizes, until the user selects a unit.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui::{Key, RichText, TextEdit, Ui};
use glam::DVec3;
use palpus_io::scene::LikelyUnit;

use super::run::{FileKind, MeshFile, Run};
use super::theme::small;

/// See the module's description.
pub(super) struct Slot {
    path: String,
    /// The path that was read, and the result.
    read: Option<(PathBuf, Reading)>,
    unit: LikelyUnit,
    /// True if the user selected the unit.
    is_selected: bool,
}

enum Reading {
    UnderWay(Receiver<Result<FileKind, String>>),
    Done(Result<FileKind, String>),
}

/// State of a slot.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// No path: the current body stays.
    Empty,
    /// The file is being read.
    Busy,
    /// The file cannot be opened.
    Bad,
    Scene(PathBuf),
    Mesh(MeshFile),
}

impl Slot {
    /// Creates a slot with a file, or an empty slot.
    pub(super) fn new(path: Option<&Path>) -> Self {
        let path = path.map_or(String::new(), |path| path.display().to_string());
        Self { path, read: None, unit: LikelyUnit::Millimetre, is_selected: false }
    }

    /// Guesses the units of two meshes together, unless the user selected them.
    pub(super) fn guess_units(first: &mut Self, second: &mut Self) {
        let (Some(one), Some(other)) = (first.size(), second.size()) else { return };
        let selected = [&*first, &*second].map(|slot| slot.is_selected.then_some(slot.unit));
        if let Some(units) = LikelyUnit::of_pair([one, other], selected) {
            [first.unit, second.unit] = units;
        }
    }

    /// Returns the sides of the mesh's box in its unit; `None` if the file is not a mesh.
    fn size(&self) -> Option<DVec3> {
        match &self.read {
            Some((_, Reading::Done(Ok(FileKind::Mesh { size, .. })))) => Some(*size),
            _ => None,
        }
    }

    /// Returns the state.
    pub(super) fn content(&self) -> Content {
        match &self.read {
            None if self.path.trim().is_empty() => Content::Empty,
            None | Some((_, Reading::Done(Err(_)))) => Content::Bad,
            Some((_, Reading::UnderWay(_))) => Content::Busy,
            Some((file, Reading::Done(Ok(FileKind::Scene)))) => Content::Scene(file.clone()),
            Some((file, Reading::Done(Ok(FileKind::Mesh { .. })))) => {
                Content::Mesh(MeshFile { file: file.clone(), metres_per_unit: self.unit.metres() })
            }
        }
    }

    /// Reads the file at the path, if the path is new.
    pub(super) fn look(&mut self, run: &dyn Run) {
        let path = PathBuf::from(self.path.trim());
        let is_read = self.read.as_ref().is_some_and(|(read, _)| *read == path);
        if !is_read {
            self.read = path.is_file().then(|| {
                let (tell, receiver) = channel();
                let (read, file) = (run.reader(), path.clone());
                // The receiver may not exist any more.
                std::thread::spawn(move || tell.send(read(&file)));
                (path, Reading::UnderWay(receiver))
            });
        }
        let Some((_, reading)) = &mut self.read else { return };
        let Reading::UnderWay(receiver) = reading else { return };
        let kind = match receiver.try_recv() {
            Ok(kind) => kind,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Err("it could not be read".to_owned()),
        };
        if let Ok(FileKind::Mesh { size, .. }) = &kind {
            (self.unit, self.is_selected) = (LikelyUnit::of(*size), false);
        }
        *reading = Reading::Done(kind);
    }

    /// Draws the line of the path and the known facts about the file. Returns true if Enter was
    /// pressed in the line. `focus`: the line gets the keyboard.
    pub(super) fn show(&mut self, ui: &mut Ui, hint: &str, focus: bool) -> bool {
        let edit = TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY).hint_text(hint);
        let response = ui.add(edit);
        if focus {
            response.request_focus();
        }
        match &self.read {
            None => {
                let is_empty = self.path.trim().is_empty();
                let words = if is_empty { "stays as it is" } else { "there is no such file" };
                ui.label(small(words));
            }
            Some((_, Reading::UnderWay(_))) => {
                ui.horizontal(|ui| {
                    ui.spinner();
                    ui.label(small("reading it"));
                });
            }
            Some((_, Reading::Done(Err(why)))) => {
                ui.label(RichText::new(why).small().color(ui.visuals().error_fg_color));
            }
            Some((_, Reading::Done(Ok(FileKind::Scene)))) => {
                ui.label(small("a scene file"));
            }
            Some((_, Reading::Done(Ok(FileKind::Mesh { size, triangles })))) => {
                let (size, triangles) = (*size, *triangles);
                ui.horizontal_wrapped(|ui| {
                    ui.label(small("unit"));
                    for unit in LikelyUnit::ALL {
                        self.is_selected |= ui.radio_value(&mut self.unit, unit, unit.name()).clicked();
                    }
                    ui.label(small(format!("{triangles} triangles, {}", sides(size * self.unit.metres()))));
                });
            }
        }
        response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
    }
}

/// Formats the sides of a box in a suitable unit.
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
    fn sides_have_a_suitable_unit() {
        assert_eq!(sides(DVec3::new(0.08, 0.044, 0.03)), "80.0 × 44.0 × 30.0 mm");
    }

    #[test]
    fn empty_slot_changes_nothing() {
        assert_eq!(Slot::new(None).content(), Content::Empty);
        assert_eq!(Slot::new(Some(Path::new("nowhere.obj"))).content(), Content::Bad);
    }
}
