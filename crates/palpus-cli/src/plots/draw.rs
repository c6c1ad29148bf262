//! Draws a figure as SVG text. Attributes hold the colours for white paper. A style sheet replaces
//! them if the reader's system has a dark theme.

use std::fmt::Write;
use std::ops::Range;

use super::axis::{self, Tick};
use super::ink::{dark_style, light};
use super::{Drawn, Figure, LEAST_COUNT, Panel, Series};
use crate::markup::escaped;

/// A drawing in which all text is escaped, so that it can be embedded in a page.
pub(crate) struct Svg(String);

impl Svg {
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

/// Width of a drawing, in its own units: pixels at its natural size.
const WIDTH: f64 = 820.0;
/// Distance of a panel from the left edge.
const LEFT: f64 = 66.0;
/// Distance of a panel from the right edge.
const RIGHT: f64 = 18.0;
/// Height of the title of the figure.
const TITLE_HEIGHT: f64 = 34.0;
/// Height of the title of a panel.
const CAPTION_HEIGHT: f64 = 26.0;
/// Height of a row of the legend.
const LEGEND_HEIGHT: f64 = 17.0;
/// Height of the area of the curves.
const PLOT_HEIGHT: f64 = 140.0;
/// Height of the numbers below a panel.
const TICKS_HEIGHT: f64 = 20.0;
/// Height of the name of the x axis.
const X_LABEL_HEIGHT: f64 = 20.0;
/// Empty height at the bottom.
const BOTTOM: f64 = 6.0;
/// Approximate width of a letter.
const LETTER: f64 = 6.7;
/// Width of the sample of a colour in the legend.
const SWATCH: f64 = 18.0;
/// Curves with at most this many points are drawn without thinning.
const FEW_POINTS: usize = 20;
/// Number of columns of a long curve: about one for each pixel of a phone. Each column shows its
/// smallest and its largest value.
const BINS: usize = 400;
/// Smallest visible width of a band, pixels.
const LEAST_BAND: f64 = 0.75;

/// Returns the figure as SVG text.
pub(crate) fn svg(figure: &Figure) -> Svg {
    let mut pen = Pen { text: String::new() };
    let mut y = if figure.title.is_empty() { 4.0 } else { TITLE_HEIGHT };
    let across = Across { range: figure.x_range(), log: figure.log_x };
    let last = figure.panels.len().saturating_sub(1);
    let mut known: Vec<&str> = Vec::new();
    for (k, panel) in figure.panels.iter().enumerate() {
        let labels: Vec<&str> = panel.series.iter().map(|series| series.label).collect();
        // Omits a legend that repeats the legend of the panel above.
        let legend = if labels.len() > 1 && labels != known { legend_rows(&panel.series) } else { Vec::new() };
        if labels.len() > 1 {
            known = labels;
        }
        y = pen.panel(panel, figure, &across, &legend, y, Ends { first: k == 0, last: k == last });
    }
    let height = y + BOTTOM;
    let title = escaped(&figure.title);
    let name = if title.is_empty() { figure.panels.first().map_or("", |panel| panel.title) } else { &title };
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" role=\"img\" aria-label=\"{name}\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"system-ui,'DejaVu Sans',sans-serif\" font-size=\"12\">\n<style>{}</style>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\" fill=\"{}\"/>\n",
        dark_style(),
        light("paper")
    );
    if !title.is_empty() {
        let _ = writeln!(
            text,
            "<text class=\"ink\" fill=\"{}\" x=\"{}\" y=\"22\" font-size=\"15\" font-weight=\"600\">{title}</text>",
            light("ink"),
            LEFT - 54.0
        );
    }
    Svg(text + &pen.text + "</svg>\n")
}

/// The horizontal axis.
struct Across {
    range: Range<f64>,
    log: bool,
}

impl Across {
    fn pixels(&self, place: f64) -> f64 {
        LEFT + (place - self.range.start) / (self.range.end - self.range.start) * (WIDTH - LEFT - RIGHT)
    }

    fn ticks(&self) -> Vec<Tick> {
        if self.log { axis::powers(&self.range) } else { axis::even(&self.range, 10) }
    }
}

/// The vertical axis of a panel.
struct VerticalAxis {
    range: Range<f64>,
    top: f64,
}

impl VerticalAxis {
    fn pixels(&self, value: f64) -> f64 {
        let value = value.clamp(self.range.start, self.range.end);
        self.top + PLOT_HEIGHT * (self.range.end - value) / (self.range.end - self.range.start)
    }

    fn bottom(&self) -> f64 {
        self.top + PLOT_HEIGHT
    }
}

/// Arranges legend labels in rows. Returns the index of each series and the position of its label.
fn legend_rows(series: &[Series]) -> Vec<Vec<(usize, f64)>> {
    let mut rows = vec![Vec::new()];
    let mut x = LEFT;
    for (k, series) in series.iter().enumerate() {
        let width = SWATCH + 6.0 + LETTER * series.label.chars().count() as f64 + 14.0;
        if x + width > WIDTH - RIGHT && x > LEFT {
            rows.push(Vec::new());
            x = LEFT;
        }
        if let Some(row) = rows.last_mut() {
            row.push((k, x));
        }
        x += width;
    }
    rows
}

/// The position of a panel in its figure: true if it is the first, and if it is the last.
#[derive(Clone, Copy)]
struct Ends {
    first: bool,
    last: bool,
}

struct Pen {
    text: String,
}

impl Pen {
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(line);
        self.text.push('\n');
    }

    fn words(&mut self, class: &str, x: f64, y: f64, anchor: &str, words: &str) {
        let (fill, words) = (light(class), escaped(words));
        self.line(format_args!(
            "<text class=\"{class}\" fill=\"{fill}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>"
        ));
    }

    /// Draws a panel with its top at `y`; returns the position of its end.
    fn panel(
        &mut self,
        panel: &Panel,
        figure: &Figure,
        across: &Across,
        legend: &[Vec<(usize, f64)>],
        y: f64,
        Ends { first, last }: Ends,
    ) -> f64 {
        let unit = if panel.unit.is_empty() { String::new() } else { format!(" ({})", panel.unit) };
        self.words("ink", LEFT, y + 17.0, "start", &format!("{}{unit}", panel.title));
        let top = y + CAPTION_HEIGHT + LEGEND_HEIGHT * legend.len() as f64;
        for (row, entries) in legend.iter().enumerate() {
            self.legend(panel, entries, y + CAPTION_HEIGHT + LEGEND_HEIGHT * row as f64);
        }
        let up = VerticalAxis { range: panel.y_range(), top };
        self.bands(figure, across, &up);
        self.grid(panel, across, &up, last);
        for series in &panel.series {
            match panel.drawn {
                Drawn::Bars => self.bars(series, figure, across, &up),
                Drawn::Lines | Drawn::ThickInBands => self.curve(series, panel, figure, across, &up),
            }
        }
        self.marks(figure, across, &up, first);
        let end = up.bottom() + TICKS_HEIGHT;
        if last && !figure.x_label.is_empty() {
            self.words("faint", (LEFT + WIDTH - RIGHT) / 2.0, end + 11.0, "middle", figure.x_label);
            return end + X_LABEL_HEIGHT;
        }
        end
    }

    fn legend(&mut self, panel: &Panel, entries: &[(usize, f64)], y: f64) {
        for &(k, x) in entries {
            let series = &panel.series[k];
            let ([_, fill], colour) = (series.color.classes(), series.color.light());
            self.line(format_args!(
                "<rect class=\"{fill}\" fill=\"{colour}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{SWATCH}\" height=\"3\"/>",
                y + 6.0
            ));
            self.words("ink", x + SWATCH + 6.0, y + 12.0, "start", series.label);
        }
    }

    fn bands(&mut self, figure: &Figure, across: &Across, up: &VerticalAxis) {
        if figure.bands.is_empty() {
            return;
        }
        let mut path = String::new();
        for band in &figure.bands {
            let (from, to) = (across.pixels(figure.place(band.start)), across.pixels(figure.place(band.end)));
            let width = (to - from).max(LEAST_BAND);
            let _ = write!(path, "M{from:.1} {:.1}h{width:.1}v{PLOT_HEIGHT}h-{width:.1}z", up.top);
        }
        self.line(format_args!("<path class=\"band\" fill=\"{}\" d=\"{path}\"/>", light("band")));
    }

    fn grid(&mut self, panel: &Panel, across: &Across, up: &VerticalAxis, last: bool) {
        let right = WIDTH - RIGHT;
        let heights = if panel.drawn == Drawn::Bars { axis::powers(&up.range) } else { axis::even(&up.range, 5) };
        let mut path = String::new();
        for tick in &heights {
            let _ = write!(path, "M{LEFT} {:.1}H{right}", up.pixels(tick.at));
        }
        let places = across.ticks();
        for tick in &places {
            let _ = write!(path, "M{:.1} {:.1}v{PLOT_HEIGHT}", across.pixels(tick.at), up.top);
        }
        self.line(format_args!("<path class=\"grid\" stroke=\"{}\" fill=\"none\" d=\"{path}\"/>", light("grid")));
        for tick in &heights {
            self.words("faint", LEFT - 7.0, up.pixels(tick.at) + 4.0, "end", &tick.label);
        }
        if last {
            for tick in &places {
                self.words("faint", across.pixels(tick.at), up.bottom() + 15.0, "middle", &tick.label);
            }
        }
    }

    fn curve(&mut self, series: &Series, panel: &Panel, figure: &Figure, across: &Across, up: &VerticalAxis) {
        let points = figure.on_axis(&series.points);
        let ([stroke, fill], colour) = (series.color.classes(), series.color.light());
        for run in runs(&points) {
            self.polyline(&thinned(run), 1.3, &stroke, colour, across, up);
            if run.len() <= FEW_POINTS {
                for point in run {
                    let (x, y) = (across.pixels(point.0), up.pixels(point.1));
                    self.line(format_args!(
                        "<circle class=\"{fill}\" fill=\"{colour}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>"
                    ));
                }
            }
            if panel.drawn == Drawn::ThickInBands {
                for band in &figure.bands {
                    let inside = figure.place(band.start)..=figure.place(band.end);
                    let thick: Vec<_> = run.iter().copied().filter(|point| inside.contains(&point.0)).collect();
                    self.polyline(&thinned(&thick), 3.0, &stroke, colour, across, up);
                }
            }
        }
    }

    fn polyline(
        &mut self,
        points: &[(f64, f64)],
        width: f64,
        class: &str,
        colour: &str,
        across: &Across,
        up: &VerticalAxis,
    ) {
        if points.is_empty() {
            return;
        }
        let mut text = String::new();
        for (x, y) in points {
            let _ = write!(text, "{:.1},{:.1} ", across.pixels(*x), up.pixels(*y));
        }
        self.line(format_args!(
            "<polyline class=\"{class}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\" fill=\"none\" points=\"{}\"/>",
            text.trim_end()
        ));
    }

    fn bars(&mut self, series: &Series, figure: &Figure, across: &Across, up: &VerticalAxis) {
        let points = figure.on_axis(&series.points);
        let [first, second, ..] = points[..] else { return };
        let width = across.pixels(second.0) - across.pixels(first.0);
        let mut path = String::new();
        for (x, count) in points.iter().filter(|point| point.1 > 0.0) {
            let (left, y) = (across.pixels(*x) - width / 2.0, up.pixels(count.max(LEAST_COUNT).log10()));
            let _ = write!(path, "M{left:.1} {:.1}V{y:.1}h{:.1}V{:.1}z", up.bottom(), width * 0.86, up.bottom());
        }
        let ([_, fill], colour) = (series.color.classes(), series.color.light());
        self.line(format_args!("<path class=\"{fill}\" fill=\"{colour}\" d=\"{path}\"/>"));
    }

    fn marks(&mut self, figure: &Figure, across: &Across, up: &VerticalAxis, first: bool) {
        for mark in &figure.marks {
            let (x, colour) = (across.pixels(figure.place(mark.x)), light("mark"));
            self.line(format_args!(
                "<path class=\"mark\" stroke=\"{colour}\" stroke-dasharray=\"3 3\" d=\"M{x:.1} {:.1}v{PLOT_HEIGHT}\"/>",
                up.top
            ));
            if first {
                self.words("ink", x + 3.0, up.top + 11.0, "start", &mark.label);
            }
        }
    }
}

/// Returns the stretches of finite points.
fn runs(points: &[(f64, f64)]) -> Vec<&[(f64, f64)]> {
    points.split(|p| !(p.0.is_finite() && p.1.is_finite())).filter(|run| !run.is_empty()).collect()
}

/// Returns the smallest and the largest sample of each bin, in their original order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= 2 * BINS {
        return points.to_vec();
    }
    let mut thinned = Vec::with_capacity(2 * BINS);
    for bin in points.chunks(points.len().div_ceil(BINS)) {
        let by_height = |a: &(usize, &(f64, f64)), b: &(usize, &(f64, f64))| a.1.1.total_cmp(&b.1.1);
        let low = bin.iter().enumerate().min_by(by_height);
        let high = bin.iter().enumerate().max_by(by_height);
        let (Some((j, low)), Some((k, high))) = (low, high) else { continue };
        match j.cmp(&k) {
            std::cmp::Ordering::Less => thinned.extend([*low, *high]),
            std::cmp::Ordering::Equal => thinned.push(*low),
            std::cmp::Ordering::Greater => thinned.extend([*high, *low]),
        }
    }
    thinned
}

#[cfg(test)]
mod tests {
    use super::super::{BLUE, Mark};
    use super::*;

    #[test]
    fn curve_is_interrupted_at_missing_values() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 2.0), (3.0, 4.0)];
        assert_eq!(runs(&points), vec![&points[0..1], &points[2..4]]);
    }

    #[test]
    fn thinned_curve_keeps_the_extremes() {
        let points: Vec<(f64, f64)> = (0..10_000).map(|k| (f64::from(k), if k == 7777 { 9.0 } else { 1.0 })).collect();
        let thin = thinned(&points);
        assert!(thin.len() <= 2 * BINS && thin.contains(&(7777.0, 9.0)));
        assert!(thin.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(thinned(&[(0.0, 1.0), (1.0, 2.0)]), [(0.0, 1.0), (1.0, 2.0)]);
    }

    #[test]
    fn figure_of_any_data_is_finite_and_escaped() {
        for points in [vec![], vec![(0.0, f64::NAN)], vec![(1.0, 2.0)], vec![(0.0, f64::INFINITY), (1.0, 1e300)]] {
            for drawn in [Drawn::Lines, Drawn::ThickInBands, Drawn::Bars] {
                let series = |label| Series { label, color: BLUE, points: points.clone() };
                let figure = Figure {
                    title: "<script>\"&'\u{0}\u{202e}".to_owned(),
                    x_label: "x",
                    log_x: drawn == Drawn::Bars,
                    bands: vec![0.0..0.5],
                    marks: vec![Mark { x: 0.5, label: "<b>".to_owned() }],
                    panels: vec![Panel { title: "t", unit: "N", series: vec![series("a"), series("b")], drawn }],
                };
                let Svg(text) = svg(&figure);
                assert!(text.contains("&lt;script&gt;&quot;&amp;&#39;\u{fffd}\u{fffd}") && !text.contains("<script"));
                assert!(!text.contains("NaN"), "{text}");
            }
        }
    }
}
