//! The compass in the lower right corner of a scene: directions of the world's axes, and a scale
//! for the middle of the picture.

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use super::view3d::{Area, colour};
use crate::camera::Camera;
use crate::paint::round_length;
use crate::scene::Scene;
use crate::style::Style;

/// Distance from the edges of the picture, points.
const MARGIN: f32 = 16.0;
/// Length of an axis, points.
const AXIS: f32 = 26.0;
/// Approximate length of the scale, points.
const SCALE: f64 = 110.0;
/// Size of the letters, points.
const LETTERS: f32 = 12.5;
/// An axis that appears shorter than this share of its length has no label, because its label would
/// overlap the other labels.
const SEEN: f32 = 0.25;

/// Returns the place of the axes and the scale.
pub(super) fn place(rect: Rect) -> Rect {
    let corner = rect.right_bottom() - vec2(MARGIN, MARGIN);
    let size = vec2(2.0 * AXIS + 2.0 * LETTERS, 2.0 * AXIS + 4.2 * LETTERS);
    Rect::from_min_max(corner - size, rect.right_bottom())
}

/// Draws the axes and the scale.
pub(super) fn draw(ui: &Ui, area: &Area, camera: &Camera, scene: &Scene, style: &Style) {
    let painter = ui.painter_at(area.rect);
    let colours = style.theme.colours();
    let corner = area.rect.right_bottom() - vec2(MARGIN, MARGIN);
    scale(&painter, corner, area.rect, camera, scene, colour(colours.faint));
    let middle = corner - vec2(AXIS + LETTERS, AXIS + 3.2 * LETTERS);
    let [right, up, back] = camera.axes();
    let mut axes =
        [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)].into_iter().zip(colours.axes).collect::<Vec<_>>();
    // Axes that point away are drawn first, so that the other axes cover them.
    axes.sort_by(|((_, one), _), ((_, other), _)| one.dot(back).total_cmp(&other.dot(back)));
    for ((name, axis), rgb) in axes {
        let way = vec2(axis.dot(right) as f32, -axis.dot(up) as f32) * AXIS;
        painter.line_segment([middle, middle + way], Stroke::new(2.0, colour(rgb)));
        if way.length() > SEEN * AXIS {
            let beyond = middle + way + way.normalized() * (0.65 * LETTERS);
            painter.text(beyond, Align2::CENTER_CENTER, name, FontId::proportional(LETTERS), colour(rgb));
        }
    }
}

fn scale(painter: &Painter, corner: Pos2, rect: Rect, camera: &Camera, scene: &Scene, ink: Color32) {
    let metres = camera.metres_per_pixel(camera.distance, f64::from(rect.height()).max(1.0));
    let (length, name) = round_length(metres * SCALE, scene.unit);
    let left = corner - vec2((length / metres) as f32, 0.0);
    let stroke = Stroke::new(1.5, ink);
    painter.line_segment([left, corner], stroke);
    for end in [left, corner] {
        painter.line_segment([end, end - vec2(0.0, 5.0)], stroke);
    }
    let above = pos2(corner.x, corner.y - 5.0);
    painter.text(above, Align2::RIGHT_BOTTOM, name, FontId::proportional(LETTERS), ink);
}
