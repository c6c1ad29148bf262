//! Curves over a whole run, one below the other, with a cursor. A drag on a curve moves to the time
//! under the mouse.
//!
//! Each column of pixels shows the smallest and the largest value of its ticks, so that no peak is
//! lost in a long run. The columns are computed again only when the width changes. Late ticks and
//! faults are lines through all curves; intervals of overlap are shaded.

use eframe::egui::{self, Color32, FontId, Pos2, Rect, Sense, Stroke, vec2};

use super::ReplayedTick;
use crate::picture::Rgb;
use crate::style::Theme;
use crate::window::columns::{Column, columns};
use crate::window::plots::round_up;
use crate::window::view3d::colour;

/// A value of every tick.
struct Curve {
    /// Name with its unit.
    name: &'static str,
    values: Vec<f64>,
    colour: fn(Theme) -> Rgb,
}

/// Remarkable property of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Late,
    Fault,
}

/// The curves of a run.
pub(super) struct Timeline {
    /// Time of every tick, s; ascending.
    times: Vec<f64>,
    curves: Vec<Curve>,
    overlapping: Vec<bool>,
    /// Marks, each with its tick.
    pub(super) marks: Vec<(usize, Mark)>,
    columns: Option<Columns>,
}

/// Assignment of ticks to columns, for one width.
struct Columns {
    width: usize,
    /// The range of each curve in each column.
    ranges: Vec<Vec<Column>>,
    overlapping: Vec<bool>,
    marked: Vec<Option<Mark>>,
}

/// Width of the names of the curves, points.
const LABEL: f32 = 108.0;
/// A strip lower than this has its name and its value side by side.
const LOW: f32 = 30.0;
/// Height of the times below the curves, points.
const AXIS: f32 = 14.0;
/// Smallest distance of two times below the curves, points.
const BETWEEN_TIMES: f32 = 64.0;
/// Gap between two strips, points.
const GAP: f32 = 3.0;
/// Size of the letters, points.
const WORDS: f32 = 11.5;
/// Smallest upper end of the range of a strip, in the unit of its values.
const LEAST_RANGE: f64 = 1e-9;

impl Timeline {
    /// Makes the curves and marks of a run.
    pub(super) fn of(ticks: &[ReplayedTick]) -> Self {
        let of = |value: fn(&ReplayedTick) -> f64| ticks.iter().map(value).collect::<Vec<f64>>();
        let curves = vec![
            Curve { name: "force, N", values: of(|t| t.force), colour: |theme| theme.colours().force },
            Curve { name: "torque, mN·m", values: of(|t| t.torque * 1e3), colour: |theme| theme.colours().torque },
            Curve { name: "contacts", values: of(|t| f64::from(t.contacts)), colour: |theme| theme.colours().disjoint },
            Curve { name: "query, µs", values: of(|t| t.query * 1e6), colour: |theme| theme.colours().cluster },
        ];
        let marks = ticks.iter().enumerate().filter_map(|(k, tick)| match tick {
            tick if tick.cuts.is_fault() => Some((k, Mark::Fault)),
            tick if tick.late => Some((k, Mark::Late)),
            _ => None,
        });
        Self::new(of(|t| t.time), curves, ticks.iter().map(|t| t.separation < 0.0).collect(), marks.collect())
    }

    fn new(times: Vec<f64>, curves: Vec<Curve>, overlapping: Vec<bool>, marks: Vec<(usize, Mark)>) -> Self {
        Self { times, curves, overlapping, marks, columns: None }
    }

    /// Returns the time of the last tick, s.
    pub(super) fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// Returns the time of a tick, s.
    pub(super) fn time(&self, tick: usize) -> f64 {
        self.times.get(tick).copied().unwrap_or(0.0)
    }

    /// Returns the last tick up to `time`.
    pub(super) fn tick(&self, time: f64) -> usize {
        self.times.partition_point(|t| *t <= time).saturating_sub(1)
    }

    /// Fills the space of `ui` with the curves. Returns the time to which the user moves, if any.
    /// Ticks after `known` are paler.
    pub(super) fn show(&mut self, ui: &mut egui::Ui, theme: Theme, tick: usize, known: usize) -> Option<f64> {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let plot = Rect::from_min_max(rect.min + vec2(LABEL, 0.0), rect.max - vec2(0.0, AXIS));
        let width = (plot.width().max(2.0)) as usize;
        if self.columns.as_ref().is_none_or(|columns| columns.width != width) {
            self.columns = Some(self.divided(width));
        }
        let Some(divided) = &self.columns else { return None };
        let tall = plot.height() / self.curves.len().max(1) as f32;
        for (k, curve) in self.curves.iter().enumerate() {
            let top = plot.top() + k as f32 * tall;
            let strip = Rect::from_min_max(Pos2::new(plot.left(), top), Pos2::new(plot.right(), top + tall - GAP));
            self.strip(ui, divided, k, curve, strip, theme, tick);
        }
        let end = self.end().max(f64::MIN_POSITIVE);
        let x = |time: f64| plot.left() + (time / end) as f32 * plot.width();
        let colours = theme.colours();
        self.axis(ui, plot, theme);
        if known + 1 < self.times.len() {
            let rest = Rect::from_min_max(Pos2::new(x(self.time(known)), plot.top()), plot.max);
            ui.painter().rect_filled(rest, 0.0, colour(colours.below).gamma_multiply(0.55));
        }
        ui.painter().vline(x(self.time(tick)), plot.y_range(), Stroke::new(1.6, colour(colours.ink)));
        let at = (response.is_pointer_button_down_on() || response.clicked()).then(|| response.interact_pointer_pos());
        at.flatten().map(|at| f64::from(((at.x - plot.left()) / plot.width()).clamp(0.0, 1.0)) * end)
    }

    /// Draws lines at round times, and the times below the curves.
    fn axis(&self, ui: &egui::Ui, plot: Rect, theme: Theme) {
        let colours = theme.colours();
        let end = self.end().max(f64::MIN_POSITIVE);
        let step = round_up(end * f64::from(BETWEEN_TIMES / plot.width().max(1.0)));
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        for k in 0..=(end / step) as usize {
            let time = step * k as f64;
            let x = plot.left() + (time / end) as f32 * plot.width();
            ui.painter().vline(x, plot.y_range(), Stroke::new(1.0, colour(colours.faint).gamma_multiply(0.25)));
            let align = if k == 0 { egui::Align2::LEFT_TOP } else { egui::Align2::CENTER_TOP };
            if x + 0.4 * BETWEEN_TIMES < plot.right() {
                let words = format!("{time:.decimals$} s");
                let font = FontId::proportional(WORDS);
                ui.painter().text(Pos2::new(x, plot.bottom()), align, words, font, colour(colours.faint));
            }
        }
    }

    /// Draws one curve with its name, its largest value and the value at the cursor.
    #[allow(clippy::too_many_arguments, reason = "what a curve is drawn with; it has one caller")]
    fn strip(
        &self,
        ui: &egui::Ui,
        columns: &Columns,
        number: usize,
        curve: &Curve,
        strip: Rect,
        theme: Theme,
        tick: usize,
    ) {
        let colours = theme.colours();
        let painter = ui.painter();
        painter.rect_filled(strip, 0.0, colour(colours.above));
        let ranges = &columns.ranges[number];
        let largest =
            ranges.iter().flatten().map(|range| range[1]).filter(|v| v.is_finite()).fold(LEAST_RANGE, f64::max);
        let least = ranges.iter().flatten().map(|range| range[0]).filter(|v| v.is_finite()).fold(0.0, f64::min);
        let y = |value: f64| {
            let part = ((value - least) / (largest - least)).clamp(0.0, 1.0) as f32;
            strip.bottom() - 1.0 - part * (strip.height() - 3.0)
        };
        let ink = colour((curve.colour)(theme));
        for (column, range) in ranges.iter().enumerate() {
            let x = strip.left() + column as f32 + 0.5;
            if columns.overlapping[column] {
                painter.vline(x, strip.y_range(), Stroke::new(1.0, colour(colours.penetrating).gamma_multiply(0.14)));
            }
            if let Some([low, high]) = *range {
                let (low, high) = (y(low), y(high));
                painter.vline(x, (high - 0.7)..=(low + 0.7), Stroke::new(1.0, ink));
            }
            if let Some(mark) = columns.marked[column] {
                let rgb = if mark == Mark::Fault { colours.penetrating } else { colours.sliding };
                painter.vline(x, strip.y_range(), Stroke::new(1.2, colour(rgb)));
            }
        }
        let left = strip.left() - LABEL;
        let words = |at: Pos2, align, text: String, colour: Color32| {
            painter.text(at, align, text, FontId::proportional(WORDS), colour);
        };
        let [name_at, value_at] = if strip.height() < LOW {
            let y = strip.center().y;
            [
                (Pos2::new(left, y), egui::Align2::LEFT_CENTER),
                (Pos2::new(strip.left() - 6.0, y), egui::Align2::RIGHT_CENTER),
            ]
        } else {
            let [top, bottom] = [strip.top(), strip.bottom()].map(|y| Pos2::new(left, y));
            [(top, egui::Align2::LEFT_TOP), (bottom, egui::Align2::LEFT_BOTTOM)]
        };
        words(name_at.0, name_at.1, curve.name.to_owned(), colour(colours.faint));
        let now = curve.values.get(tick).copied().unwrap_or(0.0);
        words(value_at.0, value_at.1, said(now), ink);
        let font = FontId::proportional(WORDS);
        let largest = painter.layout_no_wrap(said(largest), font, colour(colours.faint));
        let at = Pos2::new(strip.right() - 4.0 - largest.size().x, strip.top());
        // The background plate makes the text legible over the curve.
        let plate = Rect::from_min_size(at, largest.size()).expand2(vec2(3.0, 0.0));
        painter.rect_filled(plate, 2.0, colour(colours.above).gamma_multiply(0.85));
        painter.galley(at, largest, colour(colours.faint));
    }

    /// Assigns ticks to columns.
    fn divided(&self, width: usize) -> Columns {
        let end = self.end().max(f64::MIN_POSITIVE);
        let column = |time: f64| ((time / end * width as f64) as usize).min(width - 1);
        let mut overlapping = vec![false; width];
        let mut marked: Vec<Option<Mark>> = vec![None; width];
        for (time, overlap) in self.times.iter().zip(&self.overlapping) {
            overlapping[column(*time)] |= overlap;
        }
        for (tick, mark) in &self.marks {
            let slot = &mut marked[column(self.time(*tick))];
            if *slot != Some(Mark::Fault) {
                *slot = Some(*mark);
            }
        }
        let place = |time: f64| time / end;
        let ranges = self.curves.iter().map(|curve| {
            columns(self.times.iter().zip(&curve.values).map(|(time, value)| (place(*time), *value)), width)
        });
        let ranges = ranges.collect();
        Columns { width, ranges, overlapping, marked }
    }
}

/// Formats with three significant digits, and whole numbers without a fraction.
fn said(value: f64) -> String {
    match value.abs() {
        _ if !value.is_finite() => "none".to_owned(),
        size if size.fract() == 0.0 => format!("{value:.0}"),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timeline() -> Timeline {
        let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let values = (0..1000).map(|k| if k == 437 { 9.0 } else { 1.0 }).collect();
        let curve = Curve { name: "force", values, colour: |theme| theme.colours().force };
        let marks = vec![(600, Mark::Fault), (601, Mark::Late), (20, Mark::Late)];
        Timeline::new(times, vec![curve], (0..1000).map(|k| k >= 900).collect(), marks)
    }

    #[test]
    fn no_peak_is_lost_at_any_width() {
        for width in [2, 37, 640, 5000] {
            let columns = timeline().divided(width);
            let largest = columns.ranges[0].iter().flatten().map(|range| range[1]).fold(0.0, f64::max);
            assert_eq!((largest, columns.ranges[0].iter().flatten().count()), (9.0, width));
            assert_eq!(columns.marked[(0.6 / 0.999 * width as f64) as usize], Some(Mark::Fault));
            assert!(columns.overlapping[width - 1] && !columns.overlapping[0]);
        }
    }

    #[test]
    fn steps_between_columns_are_joined() {
        let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let values = (0..1000).map(|k| f64::from(k % 2)).collect();
        let curve = Curve { name: "contacts", values, colour: |theme| theme.colours().force };
        let columns = Timeline::new(times, vec![curve], vec![false; 1000], Vec::new()).divided(1000);
        assert!(columns.ranges[0][2..].iter().all(|range| *range == Some([0.0, 1.0])));
    }

    #[test]
    fn ticks_are_found_by_their_time() {
        let timeline = timeline();
        assert_eq!([-1.0, 0.0, 0.0104, 5.0].map(|time| timeline.tick(time)), [0, 0, 10, 999]);
    }
}
