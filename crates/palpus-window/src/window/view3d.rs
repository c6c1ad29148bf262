//! A scene in three dimensions that the mouse turns, moves and zooms: the middle of every window
//! with bodies.
//!
//! In each frame, a window
//!
//! 1. gives the view its place ([`View3d::place`]); the first time, this moves the camera so that
//!    everything is visible;
//! 2. uses the mouse for its own purposes, or leaves it to the camera ([`View3d::navigate`]);
//! 3. lets the view draw the scene ([`View3d::draw`]), with additional marks.
//!
//! Code that needs the graphics library runs while egui paints, when its context is current. A
//! replaced scene is therefore uploaded in the next frame. Places in the window are in egui's
//! points.

mod painting;

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use eframe::egui::{self, Color32, Key, PointerButton, Pos2, Rect, Response, Sense};
use eframe::glow;
use glam::DVec3;

use super::backdrop::Backdrop;
use super::compass;
use super::gl::{GlScene, is_by_processor};
use super::keys::SceneAction;
use super::pace::Pace;
use super::run::Painted;
use super::theme::apply_theme;
use crate::camera::{Camera, View};
use crate::ground::Ground;
use crate::picture::Rgb;
use crate::scene::{Scene, ShownBody};
use crate::solid::Solid;
use crate::style::Style;

/// Rotation of the view for each point of the mouse, rad.
const TURN: f32 = 0.008;
/// Zoom by the wheel: the exponent for each point of scrolling.
const ZOOM: f32 = 0.0025;
/// Angular velocity of the camera while a key is held, rad/s.
const KEY_TURN: f32 = 1.2;
/// Rate of the zoom exponent while a key is held, 1/s.
const KEY_ZOOM: f32 = 1.0;
/// Zoom of one step that moves the camera back, and the largest number of steps.
const BACK: f64 = 0.97;
const MOST_BACK: u32 = 12;
/// Largest number of a body's vertices or triangles that are examined for its place in the window.
const MOST_EXAMINED: usize = 500;
/// Number of parts into which the side of a triangle is divided.
const ALONG: u32 = 16;
/// Longest time for which a key acts in one frame, s.
const LONGEST_FRAME: f32 = 0.1;
/// See the module's outline.
pub(super) struct View3d {
    camera: Camera,
    framed: bool,
    /// True if the camera was moved to show everything, in this frame.
    is_new: bool,
    /// True if the user has moved the camera.
    is_users: bool,
    /// True if the next framing keeps the contents of the last framing.
    widens: bool,
    /// Boxes around all bodies at the last framing, world.
    corners: Vec<DVec3>,
    ground: Option<Ground>,
    /// Simplified bodies for their shadow.
    shadowed: Vec<Arc<Solid>>,
    /// True with software rendering.
    by_processor: bool,
    paint: Arc<Mutex<PaintState>>,
    pace: Pace,
}

/// State that only the painting thread uses, while the graphics context is current.
struct PaintState {
    backdrop: Backdrop,
    gl_scene: GlScene,
    piece_lightness: f64,
    wanted: Option<Vec<Arc<Solid>>>,
    trouble: Option<String>,
    frames: u64,
    /// Times of the first and the last frame.
    drawn: Option<[Instant; 2]>,
}

/// Place of a view in a frame, and the mouse in it.
pub(super) struct Area {
    pub(super) rect: Rect,
    pub(super) response: Response,
    /// True if the picture has a title, which arrows must not cross.
    pub(super) is_titled: bool,
}

/// A ray in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) origin: DVec3,
    /// Unit direction.
    pub(super) direction: DVec3,
}

impl Area {
    /// Returns width and height, points.
    pub(super) fn size(&self) -> (f64, f64) {
        (f64::from(self.rect.width()).max(1.0), f64::from(self.rect.height()).max(1.0))
    }

    fn aspect(&self) -> f64 {
        let (width, height) = self.size();
        width / height
    }
}

impl View3d {
    /// Creates a view of `scene`.
    ///
    /// # Errors
    ///
    /// Fails with the message of the graphics library.
    pub(super) fn new(creation: &eframe::CreationContext<'_>, scene: &Scene, style: &Style) -> Result<Self, String> {
        let gl = creation.gl.as_ref().ok_or("there is no OpenGL here")?;
        let piece_lightness = style.theme.colours().piece_lightness;
        let by_processor = is_by_processor(gl);
        let (drawn, shadowed) = simplified(scene, by_processor);
        let gl_scene = GlScene::new(gl, &drawn, piece_lightness)?;
        Ok(Self {
            camera: Camera::framing(scene.corners(), View::Oblique, 1.5),
            framed: false,
            is_new: false,
            is_users: false,
            widens: false,
            corners: Vec::new(),
            ground: None,
            shadowed,
            by_processor,
            pace: Pace::new(by_processor),
            paint: Arc::new(Mutex::new(PaintState {
                backdrop: Backdrop::new(gl, by_processor)?,
                gl_scene,
                piece_lightness,
                wanted: None,
                trouble: None,
                frames: 0,
                drawn: None,
            })),
        })
    }

    /// Returns the wait after the frame that begins now.
    pub(super) fn wait(&mut self) -> Duration {
        self.pace.wait(Instant::now())
    }

    /// Returns the camera.
    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Looks at the present target from a standard side.
    pub(super) fn look(&mut self, view: View) {
        self.camera.look(view);
        self.is_users = true;
    }

    /// Looks in the direction of another camera.
    pub(super) fn turn_as(&mut self, other: &Camera) {
        (self.camera.yaw, self.camera.pitch) = (other.yaw, other.pitch);
    }

    /// Shows everything in the next frame, from the first side.
    pub(super) fn see_everything(&mut self) {
        (self.framed, self.is_users) = (false, false);
        self.camera.look(View::Oblique);
    }

    /// Shows everything in the next frame, from the present side.
    pub(super) fn reframe(&mut self) {
        self.framed = false;
    }

    /// Shows everything in the next frame, including the places of the bodies at the last framing.
    pub(super) fn widen(&mut self) {
        (self.framed, self.widens) = (false, true);
    }

    /// Widens the view if a body leaves the view, unless the user has moved the camera.
    pub(super) fn keep_in_view(&mut self, area: &Area, scene: &Scene) {
        let is_out = |corner: DVec3| self.seen_at(area, corner).is_none_or(|at| !area.rect.contains(at));
        if self.framed && !self.is_users && scene.corners().any(is_out) {
            self.widen();
        }
    }

    /// After a new framing, moves the camera back until no body is below the `plate` of the legend
    /// or below the compass.
    pub(super) fn keep_clear(&mut self, area: &Area, scene: &Scene, plate: Option<Rect>) {
        if !std::mem::take(&mut self.is_new) {
            return;
        }
        let plates: Vec<Rect> = plate.into_iter().chain([compass::place(area.rect)]).collect();
        let is_below = |view: &Self| {
            let hides = |body: &ShownBody| plates.iter().any(|plate| view.is_below(area, body, *plate));
            scene.bodies.iter().any(hides)
        };
        for _ in 0..MOST_BACK {
            if !is_below(self) {
                return;
            }
            self.camera.zoom(BACK);
        }
    }

    /// True if a side of the body's triangles is visible in this rectangle. Of large bodies, only
    /// some triangles are examined.
    fn is_below(&self, area: &Area, body: &ShownBody, rect: Rect) -> bool {
        let triangles = &body.solid.triangles;
        let seen = |v: u32| self.seen_at(area, body.pose.point(body.solid.vertices[v as usize]));
        let crosses = |from: u32, to: u32| {
            let (Some(from), Some(to)) = (seen(from), seen(to)) else { return false };
            (0..=ALONG).any(|k| rect.contains(from.lerp(to, k as f32 / ALONG as f32)))
        };
        let mut some = triangles.iter().step_by(1 + triangles.len() / MOST_EXAMINED);
        some.any(|[a, b, c]| crosses(*a, *b) || crosses(*b, *c) || crosses(*c, *a))
    }

    /// Returns the rectangle around a body in the window. Of large bodies, only some vertices are
    /// examined.
    pub(super) fn bounds(&self, area: &Area, body: &ShownBody) -> Rect {
        let vertices = &body.solid.vertices;
        let some = vertices.iter().step_by(1 + vertices.len() / MOST_EXAMINED);
        let seen = some.filter_map(|vertex| self.seen_at(area, body.pose.point(*vertex)));
        seen.fold(Rect::NOTHING, |bounds, at| bounds.union(Rect::from_min_max(at, at)))
    }

    /// Carries out an action of every window on the view, its scene and its style. The window
    /// itself saves pictures and shows the list of keys.
    pub(super) fn act(&mut self, context: &egui::Context, action: SceneAction, scene: &mut Scene, style: &mut Style) {
        match action {
            SceneAction::Look(view) => self.look(view),
            SceneAction::Everything => self.see_everything(),
            SceneAction::Pieces => scene.bodies.iter_mut().for_each(|body| body.look.pieces ^= true),
            SceneAction::Wires => scene.bodies.iter_mut().for_each(|body| body.look.wireframe ^= true),
            SceneAction::Theme => self.turn_theme(context, scene, style),
            SceneAction::Picture | SceneAction::Keys => {}
        }
    }

    /// Changes to the other theme, with new colours for all bodies.
    pub(super) fn turn_theme(&mut self, context: &egui::Context, scene: &mut Scene, style: &mut Style) {
        style.theme = style.theme.other();
        apply_theme(context, style.theme);
        for body in &mut scene.bodies {
            body.colour = body.part.colour(style.theme);
        }
        if let Ok(mut paint) = self.paint.lock() {
            paint.piece_lightness = style.theme.colours().piece_lightness;
            let solids = paint.gl_scene.solids();
            paint.wanted.get_or_insert(solids);
        }
    }

    /// Replaces the bodies; the camera stays in place.
    pub(super) fn replace(&mut self, scene: &Scene, style: &Style) {
        let (drawn, shadowed) = simplified(scene, self.by_processor);
        self.shadowed = shadowed;
        if let Ok(mut paint) = self.paint.lock() {
            paint.piece_lightness = style.theme.colours().piece_lightness;
            paint.wanted = Some(drawn);
        }
    }

    /// Returns once the reason why bodies cannot be drawn.
    pub(super) fn trouble(&mut self) -> Option<String> {
        self.paint.lock().ok()?.trouble.take()
    }

    /// Returns the statistics of drawing so far.
    pub(super) fn painted(&self) -> Painted {
        let Ok(paint) = self.paint.lock() else { return Painted::default() };
        let seconds = paint.drawn.map_or(0.0, |[first, last]| (last - first).as_secs_f64());
        Painted {
            frames: paint.frames,
            rate_hz: if seconds > 0.0 { (paint.frames - 1) as f64 / seconds } else { 0.0 },
            renderer: paint.gl_scene.renderer.clone(),
            triangles: paint.gl_scene.triangles(),
            samples: paint.gl_scene.samples() as u32,
        }
    }

    /// Releases the objects of the graphics library.
    pub(super) fn destroy(&self, gl: &glow::Context) {
        if let Ok(paint) = self.paint.lock() {
            paint.gl_scene.destroy(gl);
            paint.backdrop.destroy(gl);
        }
    }

    /// Gives the view all the space of `ui`.
    pub(super) fn place(&mut self, ui: &mut egui::Ui, scene: &Scene) -> Area {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let area = Area { rect, response, is_titled: false };
        if !self.framed {
            if !self.widens {
                self.corners.clear();
            }
            self.corners.extend(scene.corners());
            self.camera.frame(self.corners.iter().copied(), area.aspect());
            self.ground = Ground::below(scene);
            (self.framed, self.widens, self.is_new) = (true, false, true);
        }
        area
    }

    /// Divides the space of `ui` for one picture, or for two of the same size side by side with the
    /// same camera.
    pub(super) fn place_beside(&mut self, ui: &mut egui::Ui, scene: &Scene, two: bool) -> (Area, Option<Area>) {
        if !two {
            return (self.place(ui, scene), None);
        }
        let whole = ui.available_rect_before_wrap();
        let [left, right] = [0.0, 0.5].map(|part| {
            let low = whole.min + egui::vec2((part * whole.width()).floor(), 0.0);
            Rect::from_min_size(low, egui::vec2((0.5 * whole.width()).floor(), whole.height()))
        });
        let mut first = ui.new_child(egui::UiBuilder::new().max_rect(left));
        let area = Area { is_titled: true, ..self.place(&mut first, scene) };
        let response = ui.interact(right, ui.scope_id().with("beside"), Sense::click_and_drag());
        ui.allocate_rect(whole, Sense::hover());
        (area, Some(Area { rect: right, response, is_titled: true }))
    }

    /// Moves the camera with the mouse: a drag turns it, a drag with Shift or another button shifts
    /// it, and the wheel zooms. Alt with arrows, PageUp and PageDown does the same.
    pub(super) fn navigate(&mut self, ui: &egui::Ui, area: &Area) {
        let response = &area.response;
        let moved = response.drag_delta();
        let before = self.camera;
        let shift = ui.input(|input| input.modifiers.shift);
        if response.dragged_by(PointerButton::Primary) && !shift {
            self.camera.orbit(f64::from(-moved.x * TURN), f64::from(moved.y * TURN));
        } else if response.dragged() {
            self.camera.pan(f64::from(moved.x), f64::from(moved.y), area.size().1);
        }
        if response.hovered() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            self.camera.zoom(f64::from((wheel * ZOOM).exp() * pinch));
        }
        self.by_keys(ui);
        self.is_users |= self.camera != before;
    }

    fn by_keys(&mut self, ui: &egui::Ui) {
        let (alt, frame) = ui.input(|input| (input.modifiers.alt, input.stable_dt.min(LONGEST_FRAME)));
        if !alt {
            return;
        }
        let axis = |more, less| ui.input(|input| f32::from(input.key_down(more)) - f32::from(input.key_down(less)));
        let (around, up) = (axis(Key::ArrowLeft, Key::ArrowRight), axis(Key::ArrowDown, Key::ArrowUp));
        self.camera.orbit(f64::from(-around * KEY_TURN * frame), f64::from(-up * KEY_TURN * frame));
        self.camera.zoom(f64::from((axis(Key::PageUp, Key::PageDown) * KEY_ZOOM * frame).exp()));
    }

    /// Returns the ray from the camera through a point of the window.
    pub(super) fn ray(&self, area: &Area, at: Pos2) -> Ray {
        let (_, height) = area.size();
        let metres = self.camera.metres_per_pixel(1.0, height);
        let [right, up, back] = self.camera.axes();
        let from_middle = at - area.rect.center();
        let direction = right * (f64::from(from_middle.x) * metres) - up * (f64::from(from_middle.y) * metres) - back;
        Ray { origin: self.camera.eye(), direction: direction.normalize() }
    }

    /// Returns the position of a point of the world in the window; `None` if it is behind the
    /// camera.
    pub(super) fn seen_at(&self, area: &Area, point: DVec3) -> Option<Pos2> {
        let (width, height) = area.size();
        let seen = self.camera.project(point, width, height)?;
        Some(area.rect.min + egui::vec2(seen.x as f32, seen.y as f32))
    }

    /// Returns the length in metres of one point (egui's unit) at `point` of the world.
    pub(super) fn metres_per_point(&self, area: &Area, point: DVec3) -> f64 {
        self.camera.metres_per_pixel(self.depth(point), area.size().1)
    }

    fn depth(&self, point: DVec3) -> f64 {
        let [_, _, back] = self.camera.axes();
        (self.camera.eye() - point).dot(back).max(self.camera.nearest())
    }
}

/// Returns the bodies of a scene as they are drawn, and copies with so few triangles that the
/// shadow can be computed in every frame.
fn simplified(scene: &Scene, by_processor: bool) -> (Vec<Arc<Solid>>, Vec<Arc<Solid>>) {
    let few = |solid: &Arc<Solid>, most| solid.coarse(most).map_or_else(|| Arc::clone(solid), Arc::new);
    let mut known: Vec<(*const Solid, [Arc<Solid>; 2])> = Vec::new();
    let of_body = |body: &ShownBody| {
        let whole = Arc::as_ptr(&body.solid);
        if let Some((_, copies)) = known.iter().find(|(other, _)| *other == whole) {
            return copies.clone().into();
        }
        let drawn = if by_processor { few(&body.solid, MOST_BY_PROCESSOR) } else { Arc::clone(&body.solid) };
        let copies = [Arc::clone(&drawn), few(&drawn, MOST_SHADOWING)];
        known.push((whole, copies.clone()));
        copies.into()
    };
    scene.bodies.iter().map(of_body).unzip()
}

/// Largest number of triangles of a body with software rendering.
const MOST_BY_PROCESSOR: usize = 14_000;
/// Largest number of triangles of a body for the shadow.
const MOST_SHADOWING: usize = 3000;

/// Converts a colour to egui's type.
pub(super) fn colour(rgb: Rgb) -> Color32 {
    Color32::from_rgb(rgb[0], rgb[1], rgb[2])
}
