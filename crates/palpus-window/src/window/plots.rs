//! The last seconds as curves: force, torque, times and contacts, with the newest values at the
//! right.
//!
//! The plots use every tick: a column of pixels shows the smallest and the largest value of its
//! ticks. The background shows the state of contact, as in the paper's Figure 5: green with
//! contacts and no overlap (D), red with overlap (P). Above each chart is its newest value, or the
//! value at the cursor, which all charts share. Above a spectrum are its largest amplitude and the
//! frequency of this amplitude. A drag freezes the charts and moves back in time.

use eframe::egui::{self, Align2, FontId, Painter, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::chart::{Chart, Kind, Series, charts};
use super::columns::{Column, columns, extent};
use super::history::{History, Interval, SPAN, State};
use super::spectrum::{LENGTH, amplitudes};
use super::theme::{large_font, thin};
use super::view3d::colour;
use crate::picture::Rgb;
use crate::style::{Colours, Theme};

/// Height of the line above a chart, points.
const HEAD: f32 = 34.0;
/// Distance between charts, points.
const MARGIN: f32 = 10.0;
/// Size of the letters of a scale, points.
const SCALE: f32 = 11.5;
/// Size of the letters of a title, points.
const TITLE: f32 = 14.0;
/// Size of the letters of a value beside long titles, points.
const VALUE: f32 = 17.0;
/// Smallest size of the letters of a value, points.
const LEAST_VALUE: f32 = 13.5;
/// If a chart would be narrower than this, the charts of times and contacts are left out.
const NARROW: f32 = 130.0;
/// Opacity of the state's colour behind the curves.
const STATE: f32 = 0.13;
/// Distance between two marks of time (s), and of frequency (Hz).
const MARK: f64 = 2.0;
const MARK_HZ: f64 = 100.0;

/// Smallest amplitude of a spectrum that is written, in the unit of its chart.
const LEAST_PEAK: f64 = 0.001;

/// State of the plots.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plots {
    pub(super) kind: Kind,
    /// The selected time in the past, s.
    pub(super) cursor: Option<f64>,
}

/// Actions of the user on the plots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Asked {
    Nothing,
    /// Selects this time, s.
    LookAt(f64),
    /// A click on the name of a chart.
    NextKind,
}

impl Plots {
    /// Draws all charts side by side. `names`: names of the felt and the compared settings, if a
    /// comparison runs.
    pub(super) fn show(&self, ui: &mut Ui, history: &History, theme: Theme, names: Option<[&str; 2]>) -> Asked {
        let colours = theme.colours();
        let (whole, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let mut charts = charts(self.kind, &colours, names);
        if (whole.width() - MARGIN) / (charts.len() as f32) < NARROW {
            charts.truncate(2);
        }
        let width = (whole.width() - MARGIN) / charts.len() as f32;
        let field = |k: usize| {
            let left = whole.left() + MARGIN + width * k as f32;
            Rect::from_min_max(pos2(left, whole.top() + HEAD), pos2(left + width - MARGIN, whole.bottom() - 4.0))
        };
        let end = history.end().max(SPAN);
        let time_at = |at: Pos2| {
            let field = (0..charts.len()).map(field).find(|field| field.x_range().contains(at.x))?;
            Some(end - SPAN * f64::from((field.right() - at.x) / field.width()))
        };
        let hovered = response.hover_pos().and_then(time_at);
        let seen = Seen { history, intervals: &history.intervals(), end, cursor: hovered.or(self.cursor), colours };
        for (k, chart) in charts.iter().enumerate() {
            seen.chart(ui, field(k), chart);
        }
        let at = response.interact_pointer_pos();
        match at {
            Some(at) if response.clicked() && at.y < whole.top() + HEAD => Asked::NextKind,
            Some(at) if at.y >= whole.top() + HEAD && (response.dragged() || response.clicked()) => {
                time_at(at).map_or(Asked::Nothing, Asked::LookAt)
            }
            _ => Asked::Nothing,
        }
    }
}

/// Data that all charts share.
struct Seen<'a> {
    history: &'a History,
    intervals: &'a [Interval],
    /// Time at the right edge, s.
    end: f64,
    /// Selected time in the past, s.
    cursor: Option<f64>,
    colours: Colours,
}

impl Seen<'_> {
    fn chart(&self, ui: &Ui, field: Rect, chart: &Chart) {
        let rest = self.head(ui, field, chart);
        let painter = ui.painter_at(field);
        painter.rect_filled(field, 3.0, ui.visuals().faint_bg_color);
        let width = field.width().max(1.0) as usize;
        if self.is_spectrum(chart) {
            self.spectra(&painter, field, width, chart);
        } else {
            self.curves(&painter, field, width, chart);
        }
        // The times or frequencies are in the first line.
        let top = field.top() + 1.3 * SCALE;
        let mut right = field.right() - 4.0;
        for (name, rgb) in rest.iter().rev() {
            let words = painter.layout_no_wrap(name.clone(), FontId::proportional(SCALE), colour(*rgb));
            let at = Rect::from_min_size(pos2(right - words.size().x, top), words.size());
            painter.rect_filled(at.expand2(vec2(2.0, 0.0)), 2.0, thin(self.colours.below, 0.7));
            right = at.left() - 6.0;
            painter.galley(at.min, words, colour(*rgb));
        }
    }

    fn is_spectrum(&self, chart: &Chart) -> bool {
        chart.kind == Kind::Spectrum && chart.has_spectrum
    }

    fn x(&self, field: &Rect, time: f64) -> f32 {
        field.right() - field.width() * ((self.end - time) / SPAN) as f32
    }

    fn values<'s>(&'s self, series: &'s Series) -> Box<dyn Iterator<Item = (f64, f64)> + 's> {
        match series {
            Series::Felt { of, .. } => Box::new(self.history.ticks().map(|tick| (tick.time, of(tick)))),
            Series::Compared { of, .. } => Box::new(self.history.compared().map(|tick| (tick.time, of(tick)))),
        }
    }

    fn curves(&self, painter: &Painter, field: Rect, width: usize, chart: &Chart) {
        for interval in self.intervals {
            let rgb =
                if interval.state == State::Penetrating { self.colours.penetrating } else { self.colours.disjoint };
            let span = self.x(&field, interval.from)..=self.x(&field, interval.to);
            painter.rect_filled(Rect::from_x_y_ranges(span, field.y_range()), 0.0, thin(rgb, STATE));
        }
        let place = |time: f64| 1.0 - (self.end - time) / SPAN;
        let shown: Vec<Vec<Column>> = (chart.series.iter())
            .map(|series| columns(self.values(series).map(|(time, value)| (place(time), value)), width))
            .collect();
        let lines = |painter: &Painter, stroke: Stroke| {
            let mut mark = (self.end / MARK).floor() * MARK;
            while mark > self.end - SPAN {
                let x = self.x(&field, mark);
                painter.vline(x, field.y_range(), stroke);
                self.mark(painter, field, x, format!("{mark:.0} s"), field.width() * (MARK / SPAN) as f32);
                mark -= MARK;
            }
        };
        self.draw(painter, field, chart, &shown, lines);
        if let Some(time) = self.cursor {
            let stroke = Stroke::new(1.0, colour(self.colours.ink));
            painter.vline(self.x(&field, time), field.y_range(), stroke);
        }
    }

    fn spectra(&self, painter: &Painter, field: Rect, width: usize, chart: &Chart) {
        let half_rate = 0.5 * self.rate();
        let shown: Vec<Vec<Column>> = (chart.series.iter())
            .map(|series| {
                let values: Vec<f64> = self.values(series).map(|(_, value)| value).collect();
                let amplitudes = amplitudes(&values).unwrap_or_default();
                let last = (LENGTH / 2) as f64;
                columns(amplitudes.into_iter().enumerate().map(|(k, a)| (k as f64 / last, a)), width)
            })
            .collect();
        let lines = |painter: &Painter, stroke: Stroke| {
            let mut mark = MARK_HZ;
            while mark < half_rate {
                let x = field.left() + field.width() * (mark / half_rate) as f32;
                painter.vline(x, field.y_range(), stroke);
                self.mark(painter, field, x, format!("{mark:.0} Hz"), field.width() * (MARK_HZ / half_rate) as f32);
                mark += MARK_HZ;
            }
        };
        self.draw(painter, field, chart, &shown, lines);
    }

    /// Writes `words` beside a vertical line at `x`, if there is space. `spacing` is the distance
    /// of the lines, points.
    fn mark(&self, painter: &Painter, field: Rect, x: f32, words: String, spacing: f32) {
        // The text of the scale is at the left.
        let is_free = x > field.left() + 3.0 * SCALE && x < field.right() - 2.5 * SCALE;
        if is_free && spacing > 3.5 * SCALE {
            let faint = colour(self.colours.faint);
            painter.text(pos2(x + 2.0, field.top()), Align2::LEFT_TOP, words, FontId::proportional(SCALE), faint);
        }
    }

    /// Returns the largest amplitude of the felt curve and its frequency as text.
    fn peak(&self, chart: &Chart) -> String {
        let felt = chart.series.last().map(|series| self.values(series).map(|(_, value)| value).collect::<Vec<f64>>());
        let amplitudes = felt.and_then(|values| amplitudes(&values)).unwrap_or_default();
        let peak = amplitudes.iter().enumerate().max_by(|x, y| x.1.total_cmp(y.1));
        peak.map_or(String::new(), |(k, amplitude)| {
            let frequency = (k + 1) as f64 * self.rate() / LENGTH as f64;
            match chart.unit {
                unit if *amplitude < LEAST_PEAK => format!("below {LEAST_PEAK} {unit}"),
                unit => format!("{amplitude:.3} {unit} at {frequency:.0} Hz"),
            }
        })
    }

    /// Returns the number of ticks per second.
    fn rate(&self) -> f64 {
        let mut ticks = self.history.ticks();
        let (first, second) = (ticks.next(), ticks.next());
        let period = first.zip(second).map_or(1e-3, |(first, second)| second.time - first.time);
        1.0 / period.max(1e-6)
    }

    fn draw(
        &self,
        painter: &Painter,
        field: Rect,
        chart: &Chart,
        shown: &[Vec<Column>],
        lines: impl Fn(&Painter, Stroke),
    ) {
        let [low, high] = shown.iter().map(|columns| extent(columns)).fold([0.0f64, chart.least], |[low, high], of| {
            [low.min(of[0]), high.max(of[1]).max(-of[0] * f64::from(u8::from(of[0] < 0.0)))]
        });
        let top = round_up(high.max(-low));
        // The scale of components is symmetric about zero.
        let bottom = if low < 0.0 { -top } else { 0.0 };
        let y = |value: f64| field.bottom() - field.height() * (0.94 * (value - bottom) / (top - bottom)) as f32;
        let faint = colour(self.colours.faint);
        let line = Stroke::new(1.0, thin(self.colours.faint, 0.25));
        for part in [0.5, 1.0] {
            painter.hline(field.x_range(), y(bottom + (top - bottom) * part), line);
        }
        lines(painter, line);
        for (columns, series) in shown.iter().zip(&chart.series) {
            let mut mesh = egui::Mesh::default();
            let ink = colour(series.colour());
            for (k, column) in columns.iter().enumerate() {
                let Some([low, high]) = *column else { continue };
                let x = field.left() + k as f32;
                let range = Rect::from_min_max(pos2(x, y(high) - 0.8), pos2(x + 1.0, y(low) + 0.8));
                mesh.add_colored_rect(range, ink);
            }
            painter.add(mesh);
        }
        let font = FontId::proportional(SCALE);
        painter.text(pos2(field.left() + 4.0, y(top)), Align2::LEFT_TOP, number(top), font, faint);
    }

    /// Writes the chart's name and its value as large as possible. In a chart that is too narrow,
    /// only the name is written. Returns the names of curves for which there was no space.
    fn head<'c>(&self, ui: &Ui, field: Rect, chart: &'c Chart) -> &'c [(String, Rgb)] {
        let base = field.top() - 5.0;
        let painter = ui.painter();
        let ink = colour(self.colours.ink);
        let names: Vec<_> = (chart.names.iter())
            .map(|(name, rgb)| painter.layout_no_wrap(name.clone(), FontId::proportional(TITLE), colour(*rgb)))
            .collect();
        let widths: Vec<f32> = names.iter().map(|name| name.size().x + 8.0).collect();
        let wide = |count: usize| widths.iter().take(count).sum::<f32>();
        let value = if self.is_spectrum(chart) {
            self.peak(chart)
        } else {
            (chart.said)(self.history.at(self.cursor), self.history.compared_at(self.cursor))
        };
        let galley = |font: FontId| painter.layout_no_wrap(value.clone(), font, ink);
        let large = galley(large_font());
        let [small, least] = [VALUE, LEAST_VALUE].map(|size| galley(FontId::proportional(size)));
        let fits = |galley: &egui::Galley, count: usize| wide(count) + galley.size().x <= field.width();
        let all = names.len();
        let (shown, galley) = match () {
            () if fits(&large, all) => (all, large),
            () if fits(&small, all) => (all, small),
            () if fits(&small, 1) => (1, small),
            () => (1, least),
        };
        let mut left = field.left();
        for name in names.into_iter().take(shown) {
            let width = name.size().x;
            painter.galley(pos2(left, base - name.size().y), name, ink);
            left += width + 8.0;
        }
        if fits(&galley, shown) {
            painter.galley(pos2(field.right(), base + 3.0) - galley.size(), galley, ink);
        }
        &chart.names[shown..]
    }
}

/// Rounds up to the next of 1, 2, 5, 10, 20, 50, ….
pub(super) fn round_up(value: f64) -> f64 {
    let ten = 10f64.powf(value.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * ten >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * ten
}

fn number(value: f64) -> String {
    match value {
        small if small < 0.095 => format!("{small:.3}"),
        below_one if below_one < 0.95 => format!("{below_one:.1}"),
        value => format!("{value:.0}"),
    }
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
        assert_eq!([0.002, 0.5, 1.0, 200.0].map(number), ["0.002", "0.5", "1", "200"]);
    }
}
