//! The panels of the window on a model: on the right the model and the picked piece, on the left
//! the depth on the plane.

use eframe::egui::{self, RichText};

use super::keys::Action;
use super::work::SectionAnswer;
use super::{GAUSS, Viewer};
use crate::scene::Unit;
use crate::section::Axis;
use crate::section_panel::{Shown, contour_step, depth_colour};
use crate::section_picture::length_name;
use crate::window::theme::small;
use crate::window::{keys, shell};

/// Largest spread of the pieces.
const MOST_APART: f64 = 2.0;
/// Height of the scale of depths, points.
const SCALE: f32 = 10.0;
/// Number of colours of the scale of depths.
const SCALE_PARTS: usize = 64;

impl Viewer {
    /// Draws the panel on the right (step 3).
    pub(super) fn side(&mut self, ui: &mut egui::Ui) {
        let mesh = self.body.mesh();
        ui.add_space(shell::TOP);
        ui.heading(&self.scene.title);
        let state = if mesh.is_closed() { "closed" } else { "open" };
        // A number and its unit stay on one line.
        let size = length_name(self.body.size(), self.unit).replace(' ', "\u{a0}");
        ui.label(format!(
            "{} triangles, {state} · {} pieces · {size} across",
            mesh.triangles().len(),
            self.body.pieces().len()
        ));
        ui.horizontal(|ui| {
            ui.label("apart (E)");
            let slider = egui::Slider::new(&mut self.spread, 0.0..=MOST_APART).fixed_decimals(2);
            if ui.add(slider).changed() {
                self.rebuild();
                self.view.reframe();
            }
        });
        ui.horizontal(|ui| {
            ui.toggle_value(&mut self.look.pieces, "pieces (P)");
            ui.toggle_value(&mut self.look.wireframe, "wires (W)");
            ui.toggle_value(&mut self.look.translucent, "glass (T)");
        });
        if let Some(action) = keys::buttons(ui) {
            self.act_on_scene(&ui.ctx().clone(), action);
        }
        ui.separator();
        self.piece_side(ui);
        ui.separator();
        self.section_side(ui);
        ui.separator();
        self.status.show(ui);
    }

    /// Draws the controls of the picked piece.
    fn piece_side(&mut self, ui: &mut egui::Ui) {
        let count = self.body.polytopes().len() as u32;
        ui.horizontal(|ui| {
            ui.label(RichText::new("piece").strong());
            let mut piece = self.piece.unwrap_or(0);
            let number = egui::DragValue::new(&mut piece).range(0..=count.saturating_sub(1)).speed(0.2);
            let changed = ui.add(number).changed();
            if changed || (self.piece.is_none() && ui.button("pick").clicked()) {
                self.pick(Some(piece));
            }
            if self.piece.is_some() {
                if ui.button("face it (G)").clicked() {
                    self.act(&ui.ctx().clone(), Action::Face);
                }
                if ui.button("none (Esc)").clicked() {
                    self.pick(None);
                }
            }
        });
        let (Some(_), Some(numbers)) = (self.piece, &self.numbers) else {
            ui.label(
                "Click a piece to see its Gauss map: the directions of its faces, blue where the mesh has them too.",
            );
            return;
        };
        let unit = if self.unit == Unit::Model { "units³" } else { "m³" };
        let rims = if numbers.rims > 0 { format!(" + {} rims", numbers.rims) } else { String::new() };
        shell::rows(
            ui,
            "piece numbers",
            [
                ("faces", format!("{}{rims}", numbers.faces)),
                ("of the mesh", numbers.original_faces.to_string()),
                ("virtual", numbers.virtual_faces.to_string()),
                ("vertices", numbers.vertices.to_string()),
                ("edges, surface arcs", format!("{}, {}", numbers.edges, numbers.arcs)),
                ("admissible directions", format!("{:.1} %", 100.0 * numbers.owned)),
                ("triangles", numbers.triangles.to_string()),
                ("volume", format!("{:.4e} {unit}", numbers.volume)),
            ],
        );
        let size = egui::vec2(GAUSS, GAUSS);
        match &self.gauss_picture {
            Some(texture) => drop(ui.image((texture.id(), size))),
            None => drop(ui.allocate_space(size)),
        }
        let meaning = "Gauss map, turned like the piece. Blue: on the mesh. Grey: only on the hull. Orange: a neighbour's normal at the end of an arc. Contacts push along admissible directions.";
        ui.label(small(meaning));
    }

    /// Draws the controls of the plane.
    fn section_side(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.cut, RichText::new("depth on a plane (D)").strong());
            for axis in Axis::ALL {
                let chosen = self.cut && self.plane.axis == axis;
                if ui.selectable_label(chosen, axis.name()).clicked() {
                    self.put_plane(axis, 0.5);
                }
            }
        });
    }

    /// Draws the panel of depths on the plane, on the left.
    pub(super) fn depth_side(&mut self, ui: &mut egui::Ui) {
        let [low, high] = self.range();
        ui.add_space(shell::TOP);
        ui.horizontal(|ui| {
            ui.label("position").on_hover_text("the keys , and . move the plane");
            ui.add(egui::Slider::new(&mut self.plane.offset, low..=high));
        });
        if self.body.mesh().is_closed() {
            ui.horizontal(|ui| {
                for (shown, name) in [(Shown::Felt, "felt"), (Shown::True, "true"), (Shown::Missing, "true − felt")] {
                    ui.selectable_value(&mut self.shown, shown, name);
                }
                ui.label("(V)");
            });
        }
        let (Some(texture), Some(known)) = (&self.section_picture, &self.section_known) else {
            ui.label("feeling…");
            return;
        };
        let wide = ui.available_width();
        let [width, height] = texture.size();
        let image = ui.image((texture.id(), egui::vec2(wide, wide * height as f32 / width.max(1) as f32)));
        let deepest = known.numbers.deepest.max(known.numbers.deepest_felt);
        if self.shown != Shown::Missing {
            scale(ui, deepest, self.unit);
        }
        let here = image.hover_pos().and_then(|at| {
            let part = (at - image.rect.min) / image.rect.size();
            let column = (part.x * known.section.columns as f32) as usize;
            known.section.at(column, ((1.0 - part.y) * known.section.rows as f32) as usize)
        });
        let words = match here {
            Some(felt) if felt.inside || felt.depth > 0.0 => {
                let (depth, distance) = (length_name(felt.depth, self.unit), length_name(felt.distance, self.unit));
                format!("here: felt {depth}, to the surface {distance}")
            }
            Some(felt) => format!("here: outside, {} away", length_name(felt.distance, self.unit)),
            None => section_words(known, self.unit, self.section.is_busy()),
        };
        ui.label(small(words));
    }
}

/// Describes the section as text.
fn section_words(known: &SectionAnswer, unit: Unit, busy: bool) -> String {
    let numbers = &known.numbers;
    let going = if busy { " · getting finer…" } else { "" };
    let felt = length_name(numbers.deepest_felt, unit);
    if !known.section.closed {
        return format!("open mesh: no inside; felt up to {felt}{going}");
    }
    let median = numbers.ratio[1]
        .map_or(String::new(), |ratio| format!(" · felt / true depth: median {:.1}\u{a0}%", 100.0 * ratio));
    let unseen = 100.0 * numbers.unseen as f64 / numbers.inside.max(1) as f64;
    let deepest = length_name(numbers.deepest, unit);
    format!(
        "true depth up to {deepest} · felt up to {felt}{median} · no contact in {unseen:.2}\u{a0}% of the inside{going}"
    )
}

/// Draws the colours of depths up to `deepest`.
fn scale(ui: &mut egui::Ui, deepest: f64, unit: Unit) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), SCALE), egui::Sense::hover());
    let step = rect.width() / SCALE_PARTS as f32;
    for k in 0..SCALE_PARTS {
        let [r, g, b] = depth_colour((k as f64 + 0.5) / SCALE_PARTS as f64);
        let low = rect.min + egui::vec2(k as f32 * step, 0.0);
        let part = egui::Rect::from_min_size(low, egui::vec2(step + 0.5, rect.height()));
        ui.painter().rect_filled(part, 0.0, egui::Color32::from_rgb(r, g, b));
    }
    ui.horizontal(|ui| {
        let line = length_name(contour_step(deepest, unit), unit);
        ui.label(small(format!("0 to {} · a line every {line}", length_name(deepest, unit))));
    });
}
