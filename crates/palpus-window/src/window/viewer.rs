//! The window on a model: its pieces together or apart, one of them picked with its Gauss map and numbers, depth on a plane through it.
//!
//! In each frame:
//!
//! 1. what threads have finished is taken (`viewer_work`): the window never waits for them;
//! 2. keys (`viewer_keys`);
//! 3. on the right the model and the picked piece, on the left what is felt on the plane; in the middle the scene, where a click picks a piece;
//! 4. what is now wanted and not yet asked for is asked for.
//!
//! Nothing is drawn while nothing changes.

use std::sync::Arc;

use eframe::egui::{self, RichText, TextureHandle};
use palpus::algebra::Pose;
use palpus::body::Body;

use super::WindowError;
use super::behind::Behind;
use super::dress::{dress, small};
use super::shell::{self, Status};
use super::view3d::View3d;
use super::viewer_keys::{self, Action};
use super::viewer_work::{GaussQuestion, SectionAnswer, SectionQuestion, gauss_painter, section_feeler};
use crate::camera::{Camera, View};
use crate::gauss::{before_own_faces, piece_colours};
use crate::marks::{Triangles, rod};
use crate::picture::{Picture, Rgb};
use crate::piece::{PieceNumbers, piece_solids};
use crate::scene::{Look, Scene, ShownBody, Unit};
use crate::section::{Axis, SectionPlane};
use crate::section_picture::{Shown, contour_step, depth_colour, length_name};
use crate::solid::Solid;
use crate::style::{Style, Theme};

/// Points.
const SIDE: f32 = 330.0;
const KEYS_WIDTH: f32 = 430.0;
const GAUSS: f32 = 270.0;
/// Pixels of a point, in pictures.
const SHARPNESS: f32 = 1.5;
/// How far apart pieces come by the key, and at most.
const APART: f64 = 0.6;
const MOST_APART: f64 = 2.0;
/// Of the body's extent: a step of the plane by the keys.
const PLANE_STEP: f64 = 0.02;
/// Lines of the cut that are drawn in the scene: more would be too slow.
const MOST_CUT: usize = 1500;
/// Relative to the body's size: how thick the plane's frame and the cut are.
const FRAME_THICKNESS: f64 = 1.2e-3;
const CUT_THICKNESS: f64 = 1.0e-3;

/// What a window on a model begins with.
#[derive(Clone, Debug)]
pub struct Viewed {
    /// The model.
    pub body: Arc<Body>,
    /// What it is called.
    pub name: String,
    /// What a length of 1 is called.
    pub unit: Unit,
    /// Pieces are apart by so much of their distance from the middle.
    pub spread: f64,
    /// A piece that is picked.
    pub piece: Option<u32>,
    /// A plane on which depth is shown.
    pub plane: Option<SectionPlane>,
    /// Light or dark.
    pub theme: Theme,
}

/// Shows a model until the user closes the window; must be called on the main thread.
///
/// # Errors
/// When no window can be opened here.
pub fn view(viewed: Viewed) -> Result<(), WindowError> {
    let title = format!("palpus — {}", viewed.name);
    shell::show(&title, |creation| Ok(Box::new(Viewer::new(creation, viewed)?)))
}

struct Viewer {
    body: Arc<Body>,
    unit: Unit,
    spread: f64,
    piece: Option<u32>,
    /// Of the picked piece.
    numbers: Option<PieceNumbers>,
    /// Depth is shown.
    cut: bool,
    plane: SectionPlane,
    shown: Shown,
    /// First the body without the picked piece; then the faces of that, those of the mesh and those of the hull.
    scene: Scene,
    look: Look,
    style: Style,
    view: View3d,
    help: bool,
    status: Status,
    gauss: Behind<GaussQuestion, Picture>,
    gauss_asked: Option<GaussQuestion>,
    gauss_picture: Option<TextureHandle>,
    section: Behind<SectionQuestion, SectionAnswer>,
    section_asked: Option<SectionQuestion>,
    section_known: Option<SectionAnswer>,
    section_picture: Option<TextureHandle>,
}

impl Viewer {
    fn new(creation: &eframe::CreationContext<'_>, viewed: Viewed) -> Result<Self, String> {
        let Viewed { body, name, unit, spread, piece, plane, theme } = viewed;
        let context = &creation.egui_ctx;
        dress(context, theme);
        let look = Look { pieces: true, ..Look::default() };
        let scene = Scene { bodies: bodies(&body, spread, piece, look, theme), title: name, ..Scene::default() };
        let style = Style { theme, ..Style::default() };
        let view = View3d::new(creation, &scene, &style)?;
        let (for_gauss, for_section) = (context.clone(), context.clone());
        let mut viewer = Self {
            gauss: gauss_painter(Arc::clone(&body), move || for_gauss.request_repaint()),
            section: section_feeler(Arc::clone(&body), unit, move || for_section.request_repaint()),
            plane: plane.unwrap_or_else(|| SectionPlane::through(&body, Axis::Y, 0.5)),
            cut: plane.is_some(),
            shown: Shown::Felt,
            numbers: None,
            body,
            unit,
            spread,
            piece: None,
            scene,
            look,
            style,
            view,
            help: false,
            status: Status::new("? shows the keys"),
            gauss_asked: None,
            gauss_picture: None,
            section_asked: None,
            section_known: None,
            section_picture: None,
        };
        viewer.pick(piece);
        Ok(viewer)
    }

    /// Step 1.
    fn take_answers(&mut self, context: &egui::Context) {
        if let Some(picture) = self.gauss.answer() {
            shell::show_picture(context, &mut self.gauss_picture, &picture);
        }
        if let Some(answer) = self.section.answer() {
            shell::show_picture(context, &mut self.section_picture, &answer.picture);
            self.section_known = Some(answer);
        }
        if let Some(trouble) = self.view.trouble() {
            self.status.say(trouble);
        }
    }

    /// Step 2.
    fn act(&mut self, context: &egui::Context, action: Action) {
        let pieces = self.body.polytopes().len() as u32;
        match action {
            Action::Explode => self.spread = if self.spread > 0.0 { 0.0 } else { APART },
            Action::Earlier => self.pick(Some(self.piece.map_or(0, |k| (k + pieces - 1) % pieces.max(1)))),
            Action::Later => self.pick(Some(self.piece.map_or(0, |k| (k + 1) % pieces.max(1)))),
            Action::Unpick => self.pick(None),
            Action::Face => {
                if let Some(piece) = self.piece {
                    self.view.turn_as(&before_own_faces(&self.body, piece));
                }
            }
            Action::Section => self.cut ^= true,
            Action::Across(axis) => self.put_plane(axis, 0.5),
            Action::Back => self.move_plane(-PLANE_STEP),
            Action::Forth => self.move_plane(PLANE_STEP),
            Action::Shown if self.body.mesh().is_closed() => {
                self.shown = match self.shown {
                    Shown::Felt => Shown::True,
                    Shown::True => Shown::Missing,
                    Shown::Missing => Shown::Felt,
                }
            }
            Action::Shown => {}
            Action::Look(view) => self.view.look(view),
            Action::Everything => self.view.see_everything(),
            Action::Pieces => self.look.pieces ^= true,
            Action::Wires => self.look.wireframe ^= true,
            Action::Glass => self.look.translucent ^= true,
            Action::Theme => {
                self.style.theme = if self.style.theme == Theme::Dark { Theme::Light } else { Theme::Dark };
                dress(context, self.style.theme);
            }
            Action::Picture => self.status.screenshot(context),
            Action::Keys => self.help ^= true,
        }
        if matches!(action, Action::Explode | Action::Theme) {
            self.rebuild();
        }
    }

    fn put_plane(&mut self, axis: Axis, part: f64) {
        self.plane = SectionPlane::through(&self.body, axis, part);
        self.cut = true;
    }

    fn move_plane(&mut self, part: f64) {
        let [low, high] = self.range();
        self.plane.offset = (self.plane.offset + part * (high - low)).clamp(low, high);
        self.cut = true;
    }

    /// Where the plane may be.
    fn range(&self) -> [f64; 2] {
        [0.0, 1.0].map(|part| SectionPlane::through(&self.body, self.plane.axis, part).offset)
    }

    fn pick(&mut self, piece: Option<u32>) {
        let piece = piece.filter(|k| (*k as usize) < self.body.polytopes().len());
        self.numbers = piece.map(|k| PieceNumbers::of(&self.body, k));
        if piece != self.piece {
            self.gauss_picture = None;
        }
        self.piece = piece;
        self.rebuild();
    }

    /// The scene anew, after pieces have moved or another is picked.
    fn rebuild(&mut self) {
        self.scene.bodies = bodies(&self.body, self.spread, self.piece, self.look, self.style.theme);
        self.view.replace(&self.scene, &self.style);
    }

    /// Step 3, on the right.
    fn side(&mut self, ui: &mut egui::Ui) {
        let mesh = self.body.mesh();
        ui.heading(&self.scene.title);
        let state = if mesh.is_closed() { "closed" } else { "open" };
        let size = length_name(self.body.size(), self.unit);
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
            }
        });
        ui.horizontal(|ui| {
            ui.toggle_value(&mut self.look.pieces, "pieces (P)");
            ui.toggle_value(&mut self.look.wireframe, "wires (W)");
            ui.toggle_value(&mut self.look.translucent, "glass (T)");
        });
        self.views(ui);
        ui.separator();
        self.piece_side(ui);
        ui.separator();
        self.section_side(ui);
        ui.separator();
        self.status.show(ui);
    }

    fn views(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        ui.horizontal_wrapped(|ui| {
            let named = [View::Front, View::Right, View::Top, View::Back, View::Left, View::Bottom];
            for (view, name) in named.into_iter().zip(["front", "right", "top", "back", "left", "bottom"]) {
                if ui.button(name).clicked() {
                    self.view.look(view);
                }
            }
            for (action, name) in [
                (Action::Everything, "all (R)"),
                (Action::Theme, "light / dark (L)"),
                (Action::Picture, "picture (S)"),
                (Action::Keys, "?"),
            ] {
                if ui.button(name).clicked() {
                    self.act(&context, action);
                }
            }
        });
    }

    /// The picked piece.
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
                if ui.button("its own side (G)").clicked() {
                    self.act(&ui.ctx().clone(), Action::Face);
                }
                if ui.button("none (Esc)").clicked() {
                    self.pick(None);
                }
            }
        });
        let (Some(_), Some(numbers)) = (self.piece, &self.numbers) else {
            ui.label(
                "Click a piece to see its Gauss map: which directions it has of the mesh, and which only its hull has.",
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
                ("edges, own arcs", format!("{}, {}", numbers.edges, numbers.arcs)),
                ("owned directions", format!("{:.1} %", 100.0 * numbers.owned)),
                ("triangles", numbers.triangles.to_string()),
                ("volume", format!("{:.4e} {unit}", numbers.volume)),
            ],
        );
        let size = egui::vec2(GAUSS, GAUSS);
        match &self.gauss_picture {
            Some(texture) => drop(ui.image((texture.id(), size))),
            None => drop(ui.allocate_space(size)),
        }
        let meaning = "Gauss map, as the piece is turned: blue is the mesh's, grey only the hull's, orange a neighbour's normal at the end of an arc.";
        ui.label(small(meaning));
    }

    /// The plane.
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

    /// What is felt on the plane, on the left.
    fn depth_side(&mut self, ui: &mut egui::Ui) {
        let [low, high] = self.range();
        ui.horizontal(|ui| {
            ui.label("at (, .)");
            ui.add(egui::Slider::new(&mut self.plane.offset, low..=high));
        });
        if self.body.mesh().is_closed() {
            ui.horizontal(|ui| {
                for (shown, name) in [(Shown::Felt, "felt"), (Shown::True, "true"), (Shown::Missing, "true less felt")]
                {
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

    /// Step 3, in the middle.
    fn middle(&mut self, ui: &mut egui::Ui) {
        let area = self.view.place(ui, &self.scene);
        self.view.navigate(ui, &area);
        if area.response.clicked()
            && let Some(at) = area.response.interact_pointer_pos()
        {
            let ray = self.view.ray(&area, at);
            let met = self.scene.bodies.iter().filter_map(|body| {
                let (origin, direction) =
                    (body.pose.inverse().point(ray.origin), body.pose.inverse().vector(ray.direction));
                body.solid.first_met(origin, direction)
            });
            let nearest = met.min_by(|a, b| a.0.total_cmp(&b.0));
            self.pick(nearest.map(|(_, piece)| piece));
        }
        for (k, body) in self.scene.bodies.iter_mut().enumerate() {
            let picked = k > 0;
            body.look = Look {
                pieces: self.look.pieces && !picked,
                // What is picked is seen, and what is cut, too.
                translucent: !picked
                    && (self.look.translucent || (self.piece.is_some() && self.spread == 0.0) || self.cut),
                ..self.look
            };
        }
        let marks = if self.cut { self.plane_marks() } else { Vec::new() };
        self.view.draw(ui, &area, &self.scene, &self.style, &marks);
    }

    /// The plane's frame, and where it cuts the mesh.
    fn plane_marks(&self) -> Vec<(Triangles, Rgb)> {
        let colours = self.style.theme.colours();
        let corners = self.plane.corners(&self.body);
        let size = self.body.size();
        let frame: Triangles =
            (0..4).flat_map(|k| rod(corners[k], corners[(k + 1) % 4], FRAME_THICKNESS * size)).collect();
        let mut marks = vec![(frame, colours.faint)];
        if self.spread == 0.0 {
            let mesh = self.body.mesh();
            let triangles = (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t).to_vec());
            let cut = self.plane.cut(triangles);
            if cut.len() <= MOST_CUT {
                let at = |[u, v]: [f64; 2]| self.plane.point(u, v);
                let cut = cut.into_iter().flat_map(|[a, b]| rod(at(a), at(b), CUT_THICKNESS * size)).collect();
                marks.push((cut, colours.force));
            }
        }
        marks
    }

    /// Step 4.
    fn ask(&mut self) {
        let theme = self.style.theme;
        if let Some(piece) = self.piece {
            let camera = self.view.camera();
            // Only the direction matters.
            let from = Camera { target: glam::DVec3::ZERO, distance: 1.0, ..*camera };
            let wanted = GaussQuestion { piece, from, theme, size: (GAUSS * SHARPNESS) as usize };
            if self.gauss_asked != Some(wanted) {
                self.gauss.ask(wanted);
                self.gauss_asked = Some(wanted);
            }
        }
        if self.cut {
            let wanted =
                SectionQuestion { plane: self.plane, shown: self.shown, theme, width: (SIDE * SHARPNESS) as usize };
            if self.section_asked != Some(wanted) {
                self.section.ask(wanted);
                self.section_asked = Some(wanted);
            }
        }
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        self.take_answers(&context);
        for action in viewer_keys::asked(&context) {
            self.act(&context, action);
        }
        egui::Panel::right("side").default_size(SIDE).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| self.side(ui));
        });
        if self.cut {
            egui::Panel::left("depth").default_size(SIDE).show(ui, |ui| {
                egui::ScrollArea::vertical().show(ui, |ui| self.depth_side(ui));
            });
        }
        egui::CentralPanel::no_frame().show(ui, |ui| self.middle(ui));
        if self.help {
            egui::Window::new("keys").default_width(KEYS_WIDTH).open(&mut self.help).show(&context, viewer_keys::list);
        }
        self.ask();
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}

/// The scene: see [`Viewer::scene`].
fn bodies(body: &Body, spread: f64, piece: Option<u32>, look: Look, theme: Theme) -> Vec<ShownBody> {
    let [_, environment] = ShownBody::colours(theme);
    let all = if spread > 0.0 { Solid::exploded(body, spread) } else { Solid::of_body(body) };
    let shown = |solid: Solid, pose, colour, look| ShownBody { solid: Arc::new(solid), pose, colour, look };
    let Some(piece) = piece else { return vec![shown(all, Pose::IDENTITY, environment, look)] };
    let pose = Pose { translation: Solid::shift(body, piece, spread), ..Pose::IDENTITY };
    let [own, hull] = piece_solids(body, piece);
    let [own_colour, hull_colour] = piece_colours(theme);
    let plain = Look::default();
    vec![
        shown(all.without(piece), Pose::IDENTITY, environment, look),
        shown(own, pose, own_colour, plain),
        shown(hull, pose, hull_colour, plain),
    ]
}

/// The section in words.
fn section_words(known: &SectionAnswer, unit: Unit, busy: bool) -> String {
    let numbers = &known.numbers;
    let going = if busy { " · getting finer…" } else { "" };
    let felt = length_name(numbers.deepest_felt, unit);
    if !known.section.closed {
        return format!("open mesh: no inside; felt up to {felt}{going}");
    }
    let median = numbers.ratio[1].map_or(String::new(), |ratio| format!(" · median {:.1} % of it", 100.0 * ratio));
    let unseen = 100.0 * numbers.unseen as f64 / numbers.inside.max(1) as f64;
    let deepest = length_name(numbers.deepest, unit);
    format!("up to {deepest} deep, felt {felt}{median} · not felt {unseen:.2} % of the inside{going}")
}

/// The colours of depths up to `deepest`.
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

/// Points.
const SCALE: f32 = 10.0;
const SCALE_PARTS: usize = 64;
