//! Icons of the player's buttons. They are drawn, because the font of the window has no such signs.

use eframe::egui::{self, Color32, Pos2, Rect, Shape, Stroke, Ui, pos2, vec2};

/// Size of an icon, points.
const SIZE: f32 = 12.0;
/// Width of a bar, relative to the icon.
const BAR: f32 = 0.2;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    Begin,
    Back,
    Play,
    Pause,
    On,
    End,
}

impl Icon {
    /// Draws a button with this icon. `hint` is its name for screen readers and under the mouse.
    pub(super) fn button(self, ui: &mut Ui, hint: &str) -> egui::Response {
        let height = ui.spacing().interact_size.y;
        let response = ui.add(egui::Button::new("").min_size(vec2(1.3 * height, height)));
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, hint));
        let ink = ui.style().interact(&response).text_color();
        let room = Rect::from_center_size(response.rect.center(), vec2(SIZE, SIZE));
        ui.painter().extend(self.shapes(room, ink));
        response.on_hover_text(hint)
    }

    fn shapes(self, room: Rect, ink: Color32) -> Vec<Shape> {
        let at = |x: f32, y: f32| pos2(room.left() + x * room.width(), room.top() + y * room.height());
        let polygon = |points: Vec<Pos2>| Shape::convex_polygon(points, ink, Stroke::NONE);
        let bar = |x: f32| polygon(vec![at(x, 0.0), at(x + BAR, 0.0), at(x + BAR, 1.0), at(x, 1.0)]);
        // The points of a triangle are in clockwise order on the screen.
        let right = |x: f32, tip: f32| polygon(vec![at(x, 0.0), at(tip, 0.5), at(x, 1.0)]);
        let left = |x: f32, tip: f32| polygon(vec![at(tip, 0.5), at(x, 0.0), at(x, 1.0)]);
        match self {
            Self::Begin => vec![bar(0.0), left(1.0, BAR)],
            Self::Back => vec![left(0.6, 0.0), bar(0.8)],
            Self::Play => vec![right(0.1, 1.0)],
            Self::Pause => vec![bar(0.15), bar(0.65)],
            Self::On => vec![bar(0.0), right(0.4, 1.0)],
            Self::End => vec![right(0.0, 1.0 - BAR), bar(1.0 - BAR)],
        }
    }
}
