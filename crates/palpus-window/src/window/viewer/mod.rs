//! The window on a model: its pieces together or apart, a picked piece with its Gauss map and
//! numbers, and the depth on a plane through the model.
//!
//! In each frame:
//!
//! 1. results of threads are taken (`work`); the window never waits for them;
//! 2. keys are handled (`keys`);
//! 3. the panels are drawn: on the right the model and the picked piece, on the left the depth on
//!    the plane (`panels`), and in the middle the scene (`shown`), in which a click picks a piece;
//! 4. new requests are sent to the worker threads.
//!
//! Nothing is drawn while nothing changes.

mod keys;
mod panels;
mod shown;
mod work;

use std::sync::Arc;

use eframe::egui::{self, TextureHandle};
use palpus::body::Body;

use super::WindowError;
use super::background::Background;
use super::keys::{self as key_list, SceneAction};
use super::shell::{self, Status};
use super::theme::apply_theme;
use super::view3d::View3d;
use crate::camera::Camera;
use crate::gauss::before_surface_faces;
use crate::picture::Picture;
use crate::piece::PieceNumbers;
use crate::scene::{Look, Scene, Unit};
use crate::section::{Axis, SectionPlane};
use crate::section_panel::Shown;
use crate::style::{Style, Theme};
use keys::Action;
use shown::bodies;
use work::{GaussQuestion, SectionAnswer, SectionQuestion, gauss_painter, section_sampler};

/// Width of each panel at a side, points.
const SIDE: f32 = 330.0;
/// Windows narrower than this have one panel, points.
const ROOMY: f32 = 900.0;
/// Width and height of the Gauss map, points.
const GAUSS: f32 = 270.0;
/// Number of pixels per point in pictures.
const SHARPNESS: f32 = 1.5;
/// Spread of the pieces that the key sets.
const APART: f64 = 0.6;
/// Step of the plane by the keys, as a share of the body's extent.
const PLANE_STEP: f64 = 0.02;
/// Start of a window on a model.
#[derive(Clone, Debug)]
pub struct Viewed {
    /// The model.
    pub body: Arc<Body>,
    /// Name of the model.
    pub name: String,
    /// Unit of length.
    pub unit: Unit,
    /// Pieces are apart by this share of their distance from the middle.
    pub spread: f64,
    /// The picked piece.
    pub piece: Option<u32>,
    /// The plane on which depth is shown.
    pub plane: Option<SectionPlane>,
    /// True for the dark theme.
    pub theme: Theme,
}

/// Shows a model until the user closes the window; must be called on the main thread.
///
/// # Errors
///
/// Fails if no window can be opened.
pub fn view(viewed: Viewed) -> Result<(), WindowError> {
    let title = format!("palpus — {}", viewed.name);
    shell::show(&title, |creation| Ok(Box::new(Viewer::new(creation, viewed)?)))
}

struct Viewer {
    body: Arc<Body>,
    unit: Unit,
    spread: f64,
    piece: Option<u32>,
    /// Numbers of the picked piece.
    numbers: Option<PieceNumbers>,
    /// True if the depth on a plane is shown.
    cut: bool,
    plane: SectionPlane,
    shown: Shown,
    /// The body without the picked piece, then the faces of this piece that belong to the mesh, and
    /// the faces that only the hull has.
    scene: Scene,
    look: Look,
    style: Style,
    view: View3d,
    help: bool,
    status: Status,
    gauss: Background<GaussQuestion, Picture>,
    gauss_asked: Option<GaussQuestion>,
    gauss_picture: Option<TextureHandle>,
    section: Background<SectionQuestion, SectionAnswer>,
    section_asked: Option<SectionQuestion>,
    section_known: Option<SectionAnswer>,
    section_picture: Option<TextureHandle>,
}

impl Viewer {
    fn new(creation: &eframe::CreationContext<'_>, viewed: Viewed) -> Result<Self, String> {
        let Viewed { body, name, unit, spread, piece, plane, theme } = viewed;
        let context = &creation.egui_ctx;
        apply_theme(context, theme);
        let look = Look { pieces: true, ..Look::default() };
        let bodies = bodies(&body, spread, piece, look, theme);
        let scene = Scene { bodies, title: name, unit, ..Scene::default() };
        let style = Style { theme, ..Style::default() };
        let view = View3d::new(creation, &scene, &style)?;
        let (for_gauss, for_section) = (context.clone(), context.clone());
        let mut viewer = Self {
            gauss: gauss_painter(Arc::clone(&body), move || for_gauss.request_repaint()),
            section: section_sampler(Arc::clone(&body), unit, move || for_section.request_repaint()),
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

    /// Takes results of threads (step 1).
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

    /// Carries out the action of a key (step 2).
    fn act(&mut self, context: &egui::Context, action: Action) {
        let pieces = self.body.polytopes().len() as u32;
        match action {
            Action::Explode => {
                self.spread = if self.spread > 0.0 { 0.0 } else { APART };
                self.rebuild();
                self.view.reframe();
            }
            Action::Earlier => self.pick(Some(self.piece.map_or(0, |k| (k + pieces - 1) % pieces.max(1)))),
            Action::Later => self.pick(Some(self.piece.map_or(0, |k| (k + 1) % pieces.max(1)))),
            Action::Unpick => self.pick(None),
            Action::Face => {
                if let Some(piece) = self.piece {
                    self.view.turn_as(&before_surface_faces(&self.body, piece));
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
            Action::Glass => self.look.translucent ^= true,
            Action::Scene(action) => self.act_on_scene(context, action),
        }
    }

    fn act_on_scene(&mut self, context: &egui::Context, action: SceneAction) {
        match action {
            SceneAction::Pieces => self.look.pieces ^= true,
            SceneAction::Wires => self.look.wireframe ^= true,
            SceneAction::Picture => self.status.screenshot(context),
            SceneAction::Keys => self.help ^= true,
            of_scene => self.view.act(context, of_scene, &mut self.scene, &mut self.style),
        }
        if action == SceneAction::Theme {
            // The colours of a picked piece depend on the theme.
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

    /// Returns the range of the plane's position.
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

    /// Rebuilds the scene after pieces have moved or another piece is picked.
    fn rebuild(&mut self) {
        self.scene.bodies = bodies(&self.body, self.spread, self.piece, self.look, self.style.theme);
        self.view.replace(&self.scene, &self.style);
    }

    /// Sends new requests to the worker threads (step 4).
    fn ask(&mut self) {
        let theme = self.style.theme;
        if let Some(piece) = self.piece {
            let camera = self.view.camera();
            // The Gauss map depends only on the direction of the camera.
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
        for action in keys::asked(&context) {
            self.act(&context, action);
        }
        // A narrow window has no space for a second panel, so the depth is below the model.
        let is_narrow = ui.available_width() < ROOMY;
        egui::Panel::right("side").default_size(SIDE).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                self.side(ui);
                if self.cut && is_narrow {
                    self.depth_side(ui);
                }
            });
        });
        if self.cut && !is_narrow {
            egui::Panel::left("depth").default_size(SIDE).show(ui, |ui| {
                egui::ScrollArea::vertical().show(ui, |ui| self.depth_side(ui));
            });
        }
        egui::CentralPanel::no_frame().show(ui, |ui| self.middle(ui));
        key_list::show(&context, &mut self.help, keys::list);
        self.ask();
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}
