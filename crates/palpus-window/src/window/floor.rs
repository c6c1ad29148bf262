//! The ground below a scene, drawn with egui behind everything that the graphics library draws.
//!
//! All bodies are above the ground, so the ground needs no depth test. The ground is not drawn if
//! the camera is below it.

use eframe::egui::{Color32, Mesh, Painter, Pos2, Stroke, Ui, pos2};
use glam::DVec3;

use super::view3d::Area;
use crate::camera::Camera;
use crate::ground::{Ground, Shadow};
use crate::style::{Colours, Style};

/// Number of parts of a grid line. Each part fades with its distance.
const PARTS: i32 = 16;
/// Strength of the lines in the middle, and of the lines through the middle.
const LINE: f64 = 0.17;
const AXIS_LINE: f64 = 0.34;

/// Shade below which nothing is drawn.
const LEAST_SHADE: f64 = 2e-3;

/// Draws the grid and the shadow.
pub(super) fn draw(ui: &Ui, area: &Area, camera: &Camera, ground: &Ground, shadow: &Shadow, style: &Style) {
    if !ground.is_seen_from(camera.eye()) {
        return;
    }
    let painter = ui.painter_at(area.rect);
    let colours = style.theme.colours();
    let seen = seen(area, camera);
    cast(&painter, shadow, &colours, &seen);
    for (ends, through_middle) in ground.lines() {
        let most = if through_middle { AXIS_LINE } else { LINE };
        let at = |part: i32| ends[0].lerp(ends[1], f64::from(part) / f64::from(PARTS));
        for part in 0..PARTS {
            let (from, to) = (at(part), at(part + 1));
            let strength = most * ground.strength(0.5 * (from + to));
            if let ([Some(from), Some(to)], true) = ([from, to].map(&seen), strength > 0.01) {
                painter.line_segment([from, to], Stroke::new(1.0, ink(colours.ink, strength)));
            }
        }
    }
}

fn cast(painter: &Painter, shadow: &Shadow, colours: &Colours, seen: &impl Fn(DVec3) -> Option<Pos2>) {
    let (vertices, row) = shadow.vertices();
    let vertices: Vec<(Option<Pos2>, f64)> = vertices.map(|(place, shade)| (seen(place), shade)).collect();
    let mut mesh = Mesh::default();
    for (at, shade) in &vertices {
        // A point behind the camera is in no triangle.
        mesh.colored_vertex(at.unwrap_or(Pos2::ZERO), ink(colours.shadow, colours.shade * shade));
    }
    for k in (0..vertices.len() - row).filter(|k| k % row + 1 < row) {
        let corners = [k, k + 1, k + row, k + row + 1];
        let is_shaded = corners.iter().any(|k| vertices[*k].1 > LEAST_SHADE);
        if is_shaded && corners.iter().all(|k| vertices[*k].0.is_some()) {
            let [a, b, c, d] = corners.map(|k| k as u32);
            mesh.add_triangle(a, b, c);
            mesh.add_triangle(b, c, d);
        }
    }
    painter.add(mesh);
}

/// Projects points of the world into the window.
fn seen(area: &Area, camera: &Camera) -> impl Fn(DVec3) -> Option<Pos2> {
    let ([right, up, back], eye, nearest) = (camera.axes(), camera.eye(), camera.nearest());
    let (middle, scale) = (area.rect.center(), area.size().1 / camera.metres_per_pixel(1.0, 1.0));
    move |point| {
        let from_eye = point - eye;
        let depth = -back.dot(from_eye);
        let (x, y) = (right.dot(from_eye) * scale / depth, up.dot(from_eye) * scale / depth);
        // Points near the plane of the camera are projected very far out.
        let is_near = depth > nearest && x.abs() < FAR && y.abs() < FAR;
        is_near.then(|| pos2(middle.x + x as f32, middle.y - y as f32))
    }
}

/// Distance from the middle beyond which nothing is drawn, points.
const FAR: f64 = 2e4;

fn ink([r, g, b]: [u8; 3], strength: f64) -> Color32 {
    Color32::from_rgba_unmultiplied(r, g, b, (255.0 * strength.clamp(0.0, 1.0)) as u8)
}
