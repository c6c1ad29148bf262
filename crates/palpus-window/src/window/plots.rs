//! The last seconds as curves: force, torque, times, contacts, newest at the right.
//!
//! Behind the curves stands how the bodies were, as in the paper's Figure 5: green while there were
//! contacts and no overlap (D), red while they overlapped (P). Above each stands its newest value,
//! large.

use eframe::egui::{self, Align2, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

use super::dress::{large_font, thin};
use super::history::{History, Interval, SPAN, Sample, State};
use super::view3d::colour;
use crate::picture::Rgb;
use crate::style::{Colours, Theme};

/// Points.
const HEAD: f32 = 34.0;
const MARGIN: f32 = 10.0;
const SCALE: f32 = 11.5;
const TITLE: f32 = 14.0;
/// How much of a state's colour stands behind the curves, and of a curve's below it.
const STATE: f32 = 0.13;
const BELOW: f32 = 0.16;
/// s between two marks of time.
const MARK: f64 = 2.0;

/// What of a sample, and its colour.
type Curve = (fn(&Sample) -> f64, Rgb);

/// One chart: what it is called, its curves, and how its newest value is told.
struct Chart {
    title: &'static str,
    /// What the second curve is.
    second: Option<&'static str>,
    curves: Vec<Curve>,
    said: fn(&Sample) -> String,
    /// The scale reaches at least so far, so that noise about zero does not fill it.
    least: f64,
}

fn charts(colours: &Colours) -> [Chart; 4] {
    [
        Chart {
            title: "force",
            second: None,
            curves: vec![(|s| s.force, colours.force)],
            said: |s| format!("{:.2} N", s.force),
            least: 0.5,
        },
        Chart {
            title: "torque",
            second: None,
            curves: vec![(|s| s.torque, colours.torque)],
            said: |s| format!("{:.1} mN·m", s.torque),
            least: 5.0,
        },
        Chart {
            title: "query",
            second: Some("forces"),
            curves: vec![(|s| s.query, colours.cluster), (|s| s.force_time, colours.sliding)],
            said: |s| format!("{:.0} µs", s.query),
            least: 20.0,
        },
        Chart {
            title: "contacts",
            second: None,
            curves: vec![(|s| s.contacts, colours.ink)],
            said: |s| format!("{:.0}", s.contacts),
            least: 4.0,
        },
    ]
}

/// All charts, side by side.
pub(super) fn show(ui: &mut Ui, history: &History, theme: Theme) {
    let colours = theme.colours();
    let (whole, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let charts = charts(&colours);
    let width = (whole.width() - MARGIN) / charts.len() as f32;
    let intervals = history.intervals();
    for (k, chart) in charts.iter().enumerate() {
        let left = whole.left() + MARGIN + width * k as f32;
        let rect = Rect::from_min_size(pos2(left, whole.top()), vec2(width - MARGIN, whole.height()));
        let hovered = response.hover_pos().filter(|at| rect.contains(*at));
        draw(ui, rect, chart, history, &intervals, &colours, hovered);
    }
}

fn draw(
    ui: &Ui,
    rect: Rect,
    chart: &Chart,
    history: &History,
    intervals: &[Interval],
    colours: &Colours,
    hovered: Option<Pos2>,
) {
    let painter = ui.painter_at(rect.expand(1.0));
    let field = Rect::from_min_max(pos2(rect.left(), rect.top() + HEAD), rect.max - vec2(0.0, 4.0));
    let (ink, faint) = (colour(colours.ink), colour(colours.faint));
    let end = history.end().max(SPAN);
    let x = |time: f64| field.right() - field.width() * ((end - time) / SPAN) as f32;
    let at = hovered.map(|at| end - SPAN * f64::from((field.right() - at.x) / field.width()));
    let newest = at.and_then(|time| history.samples().find(|sample| sample.time >= time)).or(history.last());

    let title_font = FontId::proportional(TITLE);
    let base = rect.top() + HEAD - 5.0;
    let (_, first_curve) = chart.curves[0];
    let mut after = painter.text(
        pos2(rect.left(), base),
        Align2::LEFT_BOTTOM,
        chart.title,
        title_font.clone(),
        colour(first_curve),
    );
    if let (Some(second), Some((_, rgb))) = (chart.second, chart.curves.get(1)) {
        after =
            painter.text(after.right_bottom() + vec2(8.0, 0.0), Align2::LEFT_BOTTOM, second, title_font, colour(*rgb));
    }
    if let Some(sample) = newest {
        let room = rect.right() - after.right() - 6.0;
        let galley = painter.layout_no_wrap((chart.said)(sample), large_font(), ink);
        if galley.size().x <= room {
            painter.galley(pos2(rect.right(), base + 4.0) - galley.size(), galley, ink);
        } else {
            painter.text(
                pos2(rect.right(), base),
                Align2::RIGHT_BOTTOM,
                (chart.said)(sample),
                FontId::proportional(TITLE + 3.0),
                ink,
            );
        }
    }

    painter.rect_filled(field, 3.0, ui.visuals().faint_bg_color);
    let painter = painter.with_clip_rect(field);
    for interval in intervals {
        let rgb = if interval.state == State::Penetrating { colours.penetrating } else { colours.disjoint };
        let span = Rect::from_x_y_ranges(x(interval.from)..=x(interval.to), field.y_range());
        painter.rect_filled(span, 0.0, thin(rgb, STATE));
    }
    let largest = history.samples().flat_map(|s| chart.curves.iter().map(|(of, _)| of(s))).fold(chart.least, f64::max);
    let top = round_up(largest);
    let y = |value: f64| field.bottom() - field.height() * (0.94 * value / top) as f32;
    let line = Stroke::new(1.0, thin(colours.faint, 0.25));
    for part in [0.5, 1.0] {
        painter.hline(field.x_range(), y(top * part), line);
    }
    let mut mark = (end / MARK).floor() * MARK;
    while mark > end - SPAN {
        painter.vline(x(mark), field.y_range(), line);
        mark -= MARK;
    }
    for (k, (of, rgb)) in chart.curves.iter().enumerate() {
        let points: Vec<Pos2> = history.samples().map(|s| pos2(x(s.time), y(of(s)))).collect();
        if k == 0 {
            painter.add(below(&points, field.bottom(), thin(*rgb, BELOW)));
        }
        painter.add(Shape::line(points, Stroke::new(1.6, colour(*rgb))));
    }
    let scale = FontId::proportional(SCALE);
    painter.text(pos2(field.left() + 4.0, y(top)), Align2::LEFT_TOP, number(top), scale, faint);
    if let Some(at) = hovered {
        painter.vline(at.x, field.y_range(), Stroke::new(1.0, faint));
    }
}

/// What is below a curve, as one mesh.
fn below(points: &[Pos2], bottom: f32, colour: egui::Color32) -> egui::Mesh {
    let mut mesh = egui::Mesh::default();
    for (k, point) in points.iter().enumerate() {
        mesh.colored_vertex(*point, colour);
        mesh.colored_vertex(pos2(point.x, bottom), colour);
        if k > 0 {
            let first = 2 * (k as u32 - 1);
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 2, first + 3);
        }
    }
    mesh
}

/// The next of 1, 2, 5, 10, 20, 50 …
fn round_up(value: f64) -> f64 {
    let ten = 10f64.powf(value.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * ten >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * ten
}

fn number(value: f64) -> String {
    if value < 1.0 { format!("{value:.1}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round() {
        for (value, top) in
            [(0.5, 0.5), (0.51, 1.0), (1.0, 1.0), (1.2, 2.0), (37.0, 50.0), (51.0, 100.0), (900.0, 1000.0)]
        {
            assert!((round_up(value) - top).abs() < 1e-9, "{value} {}", round_up(value));
        }
    }
}
