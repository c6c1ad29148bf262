//! Icons on buttons, drawn as shapes, so that no font needs to have them.

use eframe::egui::{Atom, Button, Color32, Rect, Response, Shape, Stroke, StrokeKind, Ui, pos2, vec2};

/// Width and height of an icon, points.
const SIZE: f32 = 13.0;

/// Icons in front of a button's text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    Pause,
    GoOn,
    Tick,
    Record,
    Stop,
    Picture,
    Open,
}

/// Draws a button with an icon in the colour `ink`.
pub(super) fn button(ui: &mut Ui, icon: Icon, words: &str, is_on: bool, ink: Color32, size: [f32; 2]) -> Response {
    let picture = Atom::paint(vec2(SIZE, SIZE), move |ui, place| draw(ui, icon, place.rect, ink));
    ui.add(Button::selectable(is_on, (picture, words)).frame_when_inactive(true).min_size(size.into()))
}

fn draw(ui: &Ui, icon: Icon, rect: Rect, ink: Color32) {
    let painter = ui.painter();
    let at = |x: f32, y: f32| pos2(rect.left() + rect.width() * x, rect.top() + rect.height() * y);
    let bar = |x: f32, wide: f32| {
        painter.rect_filled(Rect::from_min_max(at(x, 0.06), at(x + wide, 0.94)), 1.0, ink);
    };
    let triangle = |left: f32, right: f32| {
        painter.add(Shape::convex_polygon(vec![at(left, 0.04), at(right, 0.5), at(left, 0.96)], ink, Stroke::NONE));
    };
    let line = Stroke::new(1.4, ink);
    match icon {
        Icon::Pause => {
            bar(0.12, 0.26);
            bar(0.62, 0.26);
        }
        Icon::GoOn => triangle(0.12, 0.95),
        Icon::Tick => {
            triangle(0.05, 0.68);
            bar(0.76, 0.18);
        }
        Icon::Record => {
            painter.circle_filled(rect.center(), 0.42 * rect.width(), ink);
        }
        Icon::Stop => {
            painter.rect_filled(Rect::from_min_max(at(0.12, 0.12), at(0.88, 0.88)), 1.0, ink);
        }
        Icon::Picture => {
            painter.rect_stroke(Rect::from_min_max(at(0.0, 0.1), at(1.0, 0.9)), 1.5, line, StrokeKind::Middle);
            painter.add(Shape::line(
                vec![at(0.06, 0.8), at(0.38, 0.42), at(0.6, 0.66), at(0.74, 0.52), at(0.94, 0.8)],
                line,
            ));
        }
        Icon::Open => {
            let folder = [at(0.0, 0.88), at(0.0, 0.14), at(0.36, 0.14), at(0.48, 0.3), at(1.0, 0.3), at(1.0, 0.88)];
            painter.add(Shape::closed_line(folder.to_vec(), line));
        }
    }
}
