//! The overlay of the scene: the legend, the control of the probe, progress, and messages.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use eframe::egui::{self, Align2, FontId, ProgressBar, Rect, RichText, Stroke, Ui, UiBuilder, pos2, vec2};
use glam::DVec3;

use super::run::{Loading, Run};
use super::run_keys::Action;
use super::theme::thin;
use super::view3d::{Area, View3d, colour};
use crate::picture::Rgb;
use crate::scene::Scene;
use crate::style::{Colours, Style};

/// Time for which a message and an error stay visible.
const TOLD: Duration = Duration::from_secs(6);
const TOLD_ERROR: Duration = Duration::from_secs(15);
/// Distance from the edges of the picture, points.
const MARGIN: f32 = 14.0;
/// Height of a line of the legend, points.
const LINE: f32 = 21.0;
/// Size of the letters, points.
const LETTERS: f32 = 14.5;
/// Width of the dot before an entry of the legend, points.
const DOT: f32 = 20.0;
/// Distance of entries in a row, points.
const GAP: f32 = 16.0;
/// In pictures narrower than this, the legend has rows, points.
const NARROW: f32 = 660.0;
/// Space beside a legend with rows, points.
const BESIDE: f32 = 150.0;
/// Space beside a message on each side, for the legend, points.
const BESIDE_CARD: f32 = 190.0;
/// A legend is drawn only if the picture is higher than the legend by this number of lines.
const LEAST_ROWS: f32 = 10.0;
/// The same for a legend with rows.
const LEAST_ROWS_NARROW: f32 = 18.0;
/// A legend is drawn only in pictures at least this wide, points.
const LEAST_WIDTH: f32 = 460.0;
/// Width of the progress bar, points.
const PROGRESS: f32 = 420.0;
/// Height below which a picture has smaller notices, so that the scene stays visible, points.
const LOW: f32 = 360.0;
/// Shortest arrow, points.
const LEAST_ARROW: f32 = 36.0;

/// Messages from any thread.
#[derive(Clone, Default)]
pub(super) struct Notices(Arc<Mutex<Option<Notice>>>);

struct Notice {
    words: String,
    is_error: bool,
    since: Instant,
}

impl Notices {
    pub(super) fn tell(&self, words: impl Into<String>) {
        self.set(words.into(), false);
    }

    pub(super) fn complain(&self, words: impl Into<String>) {
        self.set(words.into(), true);
    }

    /// Shows an error message, if there is one.
    pub(super) fn check<T>(&self, result: Result<T, String>) -> Option<T> {
        result.map_err(|error| self.complain(error)).ok()
    }

    fn set(&self, words: String, is_error: bool) {
        if let Ok(mut notice) = self.0.lock() {
            *notice = Some(Notice { words, is_error, since: Instant::now() });
        }
    }

    fn now(&self) -> Option<(String, bool)> {
        let notice = self.0.lock().ok()?;
        let notice = notice.as_ref()?;
        let span = if notice.is_error { TOLD_ERROR } else { TOLD };
        (notice.since.elapsed() < span).then(|| (notice.words.clone(), notice.is_error))
    }
}

/// Draws an arrow from the grip to the place at which the force begins.
pub(super) fn way_out(ui: &Ui, area: &Area, view: &View3d, scene: &Scene, way: DVec3, ink: Rgb) {
    let Some(moment) = &scene.moment else { return };
    let from = scene.moment_pose.point(moment.grip);
    let [Some(tail), Some(tip)] = [from, from + way].map(|end| view.seen_at(area, end)) else { return };
    let seen = tip - tail;
    // A short way is drawn longer in its direction.
    let arrow = seen.normalized() * seen.length().max(LEAST_ARROW);
    ui.painter_at(area.rect).arrow(tail, arrow, Stroke::new(2.5, colour(ink)));
}

/// The legend at the bottom left: a column, or several entries in a row in a narrow picture.
pub(super) struct Legend {
    /// Place of the background plate.
    pub(super) plate: Rect,
    /// Colour, text, and left end of the middle line of each entry.
    entries: Vec<(Rgb, Arc<egui::Galley>, egui::Pos2)>,
}

impl Legend {
    /// Arranges the legend of a picture. `None` in a small picture, in which it would cover the
    /// scene.
    pub(super) fn of(ui: &Ui, rect: Rect, scene: &Scene, style: &Style) -> Option<Self> {
        let colours = style.theme.colours();
        let meanings = meanings(scene, style, &colours);
        let ink = colour(colours.ink);
        let galley = |words: &str| ui.painter().layout_no_wrap(words.to_owned(), FontId::proportional(LETTERS), ink);
        let words: Vec<_> = meanings.iter().map(|(_, words)| galley(words)).collect();
        let widths: Vec<f32> = words.iter().map(|words| DOT + words.size().x).collect();
        let is_narrow = rect.width() < NARROW;
        let room = if is_narrow { rect.width() - BESIDE } else { 0.0 };
        let places = in_rows(&widths, room);
        let rows = places.last().map_or(0.0, |place| place.y + 1.0);
        let least_rows = if is_narrow { LEAST_ROWS_NARROW } else { LEAST_ROWS };
        if rect.height() < LINE * (rows + least_rows) || rect.width() < LEAST_WIDTH {
            return None;
        }
        let width = places.iter().zip(&widths).map(|(place, width)| place.x + width).fold(0.0, f32::max);
        let size = vec2(width, LINE * rows);
        let at = Rect::from_min_size(pos2(rect.left() + MARGIN, rect.bottom() - MARGIN - size.y), size);
        let middle = |place: egui::Vec2| pos2(at.left() + place.x, at.top() + LINE * (place.y + 0.5));
        let entries = meanings.iter().zip(words).zip(places);
        let entries = entries.map(|(((rgb, _), words), place)| (*rgb, words, middle(place))).collect();
        Some(Self { plate: at.expand2(vec2(8.0, 4.0)), entries })
    }

    pub(super) fn draw(&self, ui: &Ui, style: &Style) {
        let colours = style.theme.colours();
        // The background plate makes the text legible over a body.
        ui.painter().rect_filled(self.plate, 6.0, thin(colours.below, 0.55));
        for (rgb, words, middle) in &self.entries {
            ui.painter().circle_filled(*middle + vec2(6.0, 0.0), 5.5, colour(*rgb));
            let at = *middle + vec2(DOT, -0.5 * words.size().y);
            ui.painter().galley(at, Arc::clone(words), colour(colours.ink));
        }
    }
}

/// Arranges entries of these widths in rows of at most `room` points: the distance from the left
/// (points) and the row of each.
fn in_rows(widths: &[f32], room: f32) -> Vec<egui::Vec2> {
    let mut next = vec2(0.0, 0.0);
    let place = |width: &f32| {
        if next.x > 0.0 && next.x + width > room {
            next = vec2(0.0, next.y + 1.0);
        }
        let place = next;
        next.x += width + GAP;
        place
    };
    widths.iter().map(place).collect()
}

fn meanings(scene: &Scene, style: &Style, colours: &Colours) -> Vec<(Rgb, &'static str)> {
    // Bodies that show their pieces have many colours.
    let body = |k: usize| scene.bodies.get(k).filter(|body| !body.look.pieces).map(|body| body.colour);
    let mut lines = Vec::new();
    // All probes have the same colour, and all objects have the same colour.
    let more = scene.bodies.iter().skip(2).filter(|body| !body.look.pieces).map(|body| body.colour);
    let has_probes = more.clone().any(|rgb| Some(rgb) == body(0));
    lines.extend(body(0).map(|rgb| (rgb, if has_probes { "probes" } else { "probe" })));
    lines.extend(body(1).map(|rgb| (rgb, "environment")));
    // Fixed objects look like the environment.
    let is_other = |rgb: &Rgb| Some(*rgb) != body(0) && Some(*rgb) != body(1);
    lines.extend(more.clone().find(is_other).map(|rgb| (rgb, "objects")));
    if style.contacts {
        lines.extend([(colours.disjoint, "contact, apart"), (colours.penetrating, "contact, overlapping")]);
    }
    if style.clusters {
        lines.push((colours.cluster, "force of a cluster"));
    }
    if style.wrench {
        lines.extend([(colours.force, "force on the hand"), (colours.torque, "torque on the hand")]);
    }
    if style.wrench && scene.is_grip_apart() {
        lines.push((colours.grip, "grip in the hand"));
    }
    if style.anchors && scene.moment.as_ref().is_some_and(|moment| !moment.anchors.is_empty()) {
        lines.extend([(colours.anchor, "friction holds"), (colours.sliding, "friction slides")]);
    }
    lines
}

/// Shows at the top left what moves the probe, and how to change this.
pub(super) fn whose(ui: &mut Ui, rect: Rect, holds: bool, cap: Option<&str>, actions: &mut Vec<Action>) {
    let place = Rect::from_min_max(rect.min + vec2(MARGIN, MARGIN), pos2(rect.right() - MARGIN, rect.top() + 90.0));
    let mut ui = ui.new_child(UiBuilder::new().max_rect(place));
    if holds {
        ui.horizontal(|ui| {
            ui.label(RichText::new("the probe is yours").strong());
            if ui.button("back to the script (Esc)").clicked() {
                actions.push(Action::Script);
            }
        });
    }
    if let Some(why) = cap {
        ui.label(RichText::new(why).small().color(ui.visuals().warn_fg_color));
    }
}

/// Draws a hint on the probe that the mouse can drag it, until the user has dragged it once. The
/// hint is at the side of the probe, because the arrow of the force mostly points up, and does not
/// cover the `values` at the arrows.
pub(super) fn hint(ui: &Ui, area: &Area, view: &View3d, scene: &Scene, style: &Style, values: &[Rect]) {
    let Some(probe) = scene.bodies.first() else { return };
    let vertices = &probe.solid.vertices;
    let some = vertices.iter().step_by(1 + vertices.len() / MOST_HINTED);
    let seen = some.filter_map(|vertex| view.seen_at(area, probe.pose.point(*vertex)));
    let seen: Vec<egui::Pos2> = seen.filter(|at| area.rect.contains(*at)).collect();
    let end = |sign: f32| seen.iter().copied().min_by(|a, b| (sign * a.x).total_cmp(&(sign * b.x)));
    let (Some(left), Some(right)) = (end(1.0), end(-1.0)) else { return };
    let colours = style.theme.colours();
    let painter = ui.painter_at(area.rect);
    let words = painter.layout_no_wrap(HINT.to_owned(), FontId::proportional(LETTERS), colour(colours.ink));
    let frame = words.size() + vec2(16.0, 8.0);
    let room = area.rect.shrink(4.0);
    let place = |tip: egui::Pos2, side: f32, align: Align2| {
        let at = align.anchor_size(tip + vec2(side * POINTER, 0.0), frame);
        at.translate(vec2(0.0, (room.top() - at.top()).max(0.0) + (room.bottom() - at.bottom()).min(0.0)))
    };
    let is_free = |at: &Rect| room.contains_rect(*at) && !values.iter().any(|value| value.intersects(*at));
    let sides = [(left, -1.0, Align2::RIGHT_CENTER), (right, 1.0, Align2::LEFT_CENTER)];
    let places = sides.map(|(tip, side, align)| (tip, side, place(tip, side, align)));
    // The side on which the hint covers less of the other bodies.
    let others: Vec<Rect> = scene.bodies.iter().skip(1).map(|body| view.bounds(area, body)).collect();
    let covered =
        |at: &Rect| others.iter().map(|body| body.intersect(*at)).filter(Rect::is_positive).map(|r| r.area()).sum();
    let free = places.into_iter().filter(|(_, _, at)| is_free(at));
    let less = |a: &(egui::Pos2, f32, Rect), b: &(egui::Pos2, f32, Rect)| -> std::cmp::Ordering {
        let [a, b]: [f32; 2] = [&a.2, &b.2].map(covered);
        a.total_cmp(&b)
    };
    let Some((tip, side, at)) = free.min_by(less) else { return };
    let (fill, edge) = (thin(colours.below, 0.9), Stroke::new(1.0, thin(colours.faint, 0.9)));
    painter.rect(at, 6.0, fill, edge, egui::StrokeKind::Inside);
    let base = tip + vec2(side * (POINTER - 0.5), 0.0);
    let tip = [base - vec2(0.0, 5.0), tip, base + vec2(0.0, 5.0)];
    painter.add(egui::Shape::convex_polygon(tip.to_vec(), fill, Stroke::NONE));
    painter.line(tip.to_vec(), edge);
    painter.galley(at.min + vec2(8.0, 4.0), words, colour(colours.ink));
}

/// Length of the hint's pointer, points.
const POINTER: f32 = 8.0;
/// Number of the probe's vertices among which its top is searched.
const MOST_HINTED: usize = 3000;

/// Text of the hint.
const HINT: &str = "drag me";

/// Draws progress and messages at the bottom, beside a legend in a column and above a legend in
/// rows.
pub(super) fn messages(ui: &mut Ui, rect: Rect, legend: Option<&Legend>, run: &mut dyn Run, notices: &Notices) {
    let rows = legend.map(|legend| legend.plate).filter(|_| rect.width() < NARROW);
    let mut bottom = rows.map_or(rect.bottom(), |plate| plate.top()) - MARGIN;
    if let Some((words, is_error)) = notices.now() {
        let ink = if is_error { ui.visuals().error_fg_color } else { ui.visuals().text_color() };
        let height = card(ui, rect, bottom, |ui| {
            let words = RichText::new(words).color(ink);
            ui.label(if rect.height() < LOW { words.small() } else { words });
        });
        bottom -= height + 8.0;
    }
    if let Loading::UnderWay { words, part } = run.loading() {
        card(ui, rect, bottom, |ui| {
            ui.set_width(PROGRESS.min(rect.width() - 60.0));
            let bar = ProgressBar::new(part.unwrap_or(0.0) as f32).text(words);
            ui.add(if part.is_some() { bar } else { bar.animate(true) });
        });
    }
}

/// Draws a raised frame above `bottom`: in the middle, or in a low picture, which has no legend, at
/// the left beside the scene. Returns its height.
fn card(ui: &mut Ui, rect: Rect, bottom: f32, contents: impl FnOnce(&mut Ui)) -> f32 {
    let id = ui.scope_id().with(("card", bottom as i32));
    let (left, pivot) = match rect.height() < LOW {
        true => (rect.left() + MARGIN, Align2::LEFT_BOTTOM),
        false => (rect.center().x, Align2::CENTER_BOTTOM),
    };
    let response =
        egui::Area::new(id).fixed_pos(pos2(left, bottom)).pivot(pivot).constrain_to(rect).show(ui.ctx(), |ui| {
            // The legend at the left and the scale and the compass at the right stay visible.
            let is_low = rect.height() < LOW;
            let beside = if rect.width() < NARROW { BESIDE } else { 2.0 * BESIDE_CARD };
            ui.set_max_width(rect.width() - if is_low { MARGIN + BESIDE } else { beside });
            let frame = egui::Frame::popup(ui.style());
            let frame = if is_low { frame.inner_margin(egui::Margin::symmetric(8, 3)) } else { frame };
            frame.show(ui, contents);
        });
    response.response.rect.height()
}

/// Draws a message on top while a file is dragged over the window.
pub(super) fn drop_here(ui: &Ui, rect: Rect, style: &Style) {
    let colours = style.theme.colours();
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, thin(colours.below, 0.8));
    let font = FontId::proportional(26.0);
    painter.text(rect.center(), Align2::CENTER_CENTER, "drop a mesh or a scene here", font, colour(colours.ink));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legend_fills_rows() {
        let places = |room| in_rows(&[50.0, 60.0, 70.0, 300.0], room).into_iter().map(|place| [place.x, place.y]);
        assert_eq!(places(0.0).collect::<Vec<_>>(), [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [0.0, 3.0]]);
        assert_eq!(places(150.0).collect::<Vec<_>>(), [[0.0, 0.0], [66.0, 0.0], [0.0, 1.0], [0.0, 2.0]]);
    }
}
