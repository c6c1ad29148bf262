//! Draws the scene with the graphics library, and the labels over it.

use std::sync::Arc;
use std::time::Instant;

use eframe::egui::{self, Align2, FontId, Rect};
use eframe::{egui_glow, glow};
use glam::{DMat4, DVec3};
use palpus::algebra::Pose;

use super::{Area, PaintState, View3d, colour};
use crate::marks::{self, Label, Marks, NOMINAL_HEIGHT, Triangles};
use crate::paint::{COVER_ALONG, COVER_SQUARE, GHOST_COVER};
use crate::picture::Rgb;
use crate::scene::{Look, Scene};
use crate::style::Style;
use crate::window::gl::{Drawing, DrawnBody, GlScene, projection, view};
use crate::window::{compass, floor};

/// Largest number of drawn dots; more could not be distinguished.
const MOST_DOTS: usize = 1000;
/// Size of the letters, points.
const LETTERS: f32 = 14.0;
/// Height of titles, points.
const TITLE: f32 = 36.0;
/// Distance of a value from its mark, points.
const BESIDE: f32 = 9.0;
/// Distance of arrows from the edge of the picture, points.
const EDGE: f32 = 8.0;

impl View3d {
    /// Draws `scene` and the additional marks `more` in the world. Returns the places of the values
    /// at the marks.
    pub(in crate::window) fn draw(
        &self,
        ui: &egui::Ui,
        area: &Area,
        scene: &Scene,
        style: &Style,
        more: &[(Triangles, Rgb)],
    ) -> Vec<Rect> {
        self.background(ui, area.rect, style);
        if let Some(ground) = &self.ground {
            let bodies = self.shadowed.iter().zip(&scene.bodies).map(|(solid, body)| (&**solid, body.pose));
            floor::draw(ui, area, &self.camera, ground, &ground.shadow(bodies), style);
        }
        let (mut drawing, labels) = self.drawing(area, scene, style, f64::from(ui.pixels_per_point()));
        let view = view(&self.camera);
        for (triangles, colour) in more {
            drawing.mark(&view, triangles, *colour);
        }
        let paint = Arc::clone(&self.paint);
        let callback = egui_glow::CallbackFn::new(move |info, painter| {
            if let Ok(mut paint) = paint.lock() {
                let seen = info.viewport_in_pixels();
                paint.draw(painter.gl(), &drawing, [seen.left_px, seen.from_bottom_px, seen.width_px, seen.height_px]);
            }
        });
        ui.painter().add(egui::PaintCallback { rect: area.rect, callback: Arc::new(callback) });
        compass::draw(ui, area, &self.camera, scene, style);
        if style.words { self.label(ui, area, &labels, style) } else { Vec::new() }
    }

    /// Fills the view in the background.
    fn background(&self, ui: &egui::Ui, rect: Rect, style: &Style) {
        let colours = style.theme.colours();
        let paint = Arc::clone(&self.paint);
        let callback = egui_glow::CallbackFn::new(move |_, painter| {
            if let Ok(paint) = paint.lock() {
                paint.backdrop.draw(painter.gl(), colours.above, colours.below);
            }
        });
        ui.painter().add(egui::PaintCallback { rect, callback: Arc::new(callback) });
    }

    /// Describes the scene for the graphics library.
    fn drawing(&self, area: &Area, scene: &Scene, style: &Style, pixels: f64) -> (Drawing, Vec<Label>) {
        let view = view(&self.camera);
        let size = [area.size().0 * pixels, area.size().1 * pixels];
        let mut xrays = scene.xrays(&self.camera, size, pixels);
        // The graphics library counts from below.
        xrays.iter_mut().flat_map(|xray| &mut xray.ends).for_each(|end| end.y = size[1] - end.y);
        let projection = projection(&self.camera, area.aspect());
        let mut drawing = Drawing { projection, xrays, ..Drawing::default() };
        let placed = |pose: &Pose| view * DMat4::from_rotation_translation(pose.rotation, pose.translation);
        for (solid, body) in scene.bodies.iter().enumerate() {
            let Look { pieces, wireframe, translucent, xray } = body.look;
            let glass = (translucent || xray).then_some((COVER_SQUARE, COVER_ALONG));
            let (model_view, colour, xray) = (placed(&body.pose), body.colour, xray && !translucent);
            drawing.bodies.push(DrawnBody { solid, model_view, colour, pieces, wireframe, glass, xray });
        }
        if let (Some(moment), Some(probe)) = (&scene.moment, scene.bodies.first())
            && scene.is_device_apart(moment, probe)
        {
            let model_view = placed(&(scene.moment_pose * moment.device));
            let glass = Some((0.5 * GHOST_COVER, GHOST_COVER));
            drawing.bodies.push(DrawnBody { model_view, glass, wireframe: false, xray: false, ..drawing.bodies[0] });
        }
        let (_, height) = area.size();
        let metres = |point: DVec3, pixels: f64| {
            let least = (NOMINAL_HEIGHT / height).max(1.0);
            self.camera.metres_per_pixel(self.depth(point), NOMINAL_HEIGHT) * pixels * least
        };
        let marks = Marks::of(scene, style, &metres, &|tail, way| self.visible_part(area, tail, way));
        for patch in marks.patches.iter().take(MOST_DOTS) {
            drawing.patch(&view, patch, metres(patch.point, patch.radius));
        }
        for dot in marks.dots.iter().take(MOST_DOTS) {
            let radius = metres(dot.point, dot.radius);
            drawing.mark(&view, &marks::ball(dot.point, radius), dot.colour);
        }
        for (triangles, colour) in &marks.solids {
            drawing.mark(&view, triangles, *colour);
        }
        (drawing, marks.labels)
    }

    /// Returns the part (0 to 1) of an arrow from `tail` along `way` (world) that is in the
    /// picture. An arrow that begins outside of the picture counts as visible.
    fn visible_part(&self, area: &Area, tail: DVec3, way: DVec3) -> f64 {
        let [Some(from), Some(to)] = [tail, tail + way].map(|end| self.seen_at(area, end)) else { return 1.0 };
        let mut room = area.rect.shrink(EDGE);
        if area.is_titled {
            room.set_top(area.rect.top() + TITLE);
        }
        if !room.contains(from) || room.contains(to) {
            return 1.0;
        }
        let part = |from: f32, to: f32, low: f32, high: f32| (to.clamp(low, high) - from) / (to - from);
        let across = if from.x == to.x { 1.0 } else { part(from.x, to.x, room.left(), room.right()) };
        let along = if from.y == to.y { 1.0 } else { part(from.y, to.y, room.top(), room.bottom()) };
        f64::from(across.min(along))
    }

    /// Draws values next to the marks, each beyond the end of its arrow. Returns their places.
    fn label(&self, ui: &egui::Ui, area: &Area, labels: &[Label], style: &Style) -> Vec<Rect> {
        let painter = ui.painter_at(area.rect);
        let halo = colour(style.theme.colours().below).gamma_multiply(0.75);
        // The text stays in the picture and below titles, wherever the arrow points.
        let room = area.rect.shrink(4.0);
        let room = room.with_min_y((room.top() + TITLE).min(room.bottom()));
        let mut taken: Vec<Rect> = Vec::new();
        for label in labels {
            let Some(at) = self.seen_at(area, label.point) else { continue };
            let words =
                painter.layout_no_wrap(label.words.clone(), FontId::proportional(LETTERS), colour(label.colour));
            let is_left = self.seen_at(area, label.from).is_some_and(|from| at.x < from.x - BESIDE);
            let (align, side) = if is_left { (Align2::RIGHT_CENTER, -1.0) } else { (Align2::LEFT_CENTER, 1.0) };
            let place = align.anchor_size(at + egui::vec2(side * BESIDE, 0.0), words.size());
            let place = place.translate(room.clamp(place.min) - place.min);
            let mut place = place.translate((room.max - place.max).min(egui::Vec2::ZERO));
            while let Some(other) = taken.iter().find(|other| other.intersects(place)) {
                place = place.translate(egui::vec2(0.0, other.bottom() + 1.0 - place.top()));
            }
            taken.push(place);
            painter.rect_filled(place.expand2(egui::vec2(4.0, 1.0)), 4.0, halo);
            painter.galley(place.min, words, colour(label.colour));
        }
        taken
    }
}

impl PaintState {
    fn draw(&mut self, gl: &glow::Context, drawing: &Drawing, viewport: [i32; 4]) {
        if let Some(solids) = self.wanted.take() {
            match GlScene::new(gl, &solids, self.piece_lightness) {
                Ok(gl_scene) => std::mem::replace(&mut self.gl_scene, gl_scene).destroy(gl),
                Err(error) => self.trouble = Some(error),
            }
        }
        self.gl_scene.draw(gl, drawing, viewport);
        let now = Instant::now();
        self.frames += 1;
        self.drawn.get_or_insert([now, now])[1] = now;
    }
}
