//! Plots as SVG: stacked panels over a common horizontal axis, with the penetrating intervals shaded.

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

/// One curve of a panel.
pub(crate) struct Series {
    /// What it is, with its unit.
    pub(crate) label: &'static str,
    /// Its colour.
    pub(crate) color: RGBColor,
    /// (x, y); a `NaN` y interrupts the curve.
    pub(crate) points: Vec<(f64, f64)>,
}

/// One panel of a figure.
pub(crate) struct Panel {
    /// Above the panel.
    pub(crate) title: &'static str,
    /// Beside the vertical axis.
    pub(crate) unit: &'static str,
    /// The curves, drawn in this order.
    pub(crate) series: Vec<Series>,
    /// The curve is drawn thick within the shaded intervals (the paper's Figure 6).
    pub(crate) thick_in_bands: bool,
}

/// A figure: panels from top to bottom.
pub(crate) struct Figure {
    /// Above all.
    pub(crate) title: String,
    /// Below the horizontal axis.
    pub(crate) x_label: &'static str,
    /// x is drawn by its logarithm; it is then positive.
    pub(crate) log_x: bool,
    /// Intervals of x in which the bodies penetrate.
    pub(crate) bands: Vec<Range<f64>>,
    /// Top to bottom.
    pub(crate) panels: Vec<Panel>,
}

/// Colours that stay apart on white and for the colour-blind (after Okabe and Ito).
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
/// See [`BLUE`].
pub(crate) const VERMILION: RGBColor = RGBColor(213, 94, 0);
/// See [`BLUE`].
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);

const SHADE: RGBColor = RGBColor(250, 226, 218);
const WIDTH: u32 = 1000;
const PANEL_HEIGHT: u32 = 230;
const TITLE_HEIGHT: u32 = 60;
/// Curves of no more points show each of them.
const FEW_POINTS: usize = 20;
/// Share of the curves' width.
const LEGEND_ROOM: f64 = 0.14;

/// The intervals of x over which `inside` holds, from samples in order of x.
pub(crate) fn bands(samples: impl Iterator<Item = (f64, bool)>) -> Vec<Range<f64>> {
    let mut bands = Vec::new();
    let mut open: Option<Range<f64>> = None;
    for (x, inside) in samples {
        match (&mut open, inside) {
            (Some(band), true) => band.end = x,
            (None, true) => open = Some(x..x),
            (Some(band), false) => {
                band.end = x;
                bands.extend(open.take());
            }
            (None, false) => {}
        }
    }
    bands.extend(open);
    bands
}

/// Writes the figure to `path`.
pub(crate) fn write_svg(figure: &Figure, path: &Path) -> anyhow::Result<()> {
    std::fs::write(path, svg(figure)?).with_context(|| format!("{} could not be written", path.display()))
}

/// The figure as text.
pub(crate) fn svg(figure: &Figure) -> anyhow::Result<String> {
    let height = TITLE_HEIGHT + PANEL_HEIGHT * figure.panels.len() as u32;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        draw(figure, &root).map_err(|error| anyhow!("the figure could not be drawn: {error}"))?;
    }
    Ok(text)
}

type Answer = Result<(), Box<dyn std::error::Error>>;

fn draw(figure: &Figure, root: &DrawingArea<SVGBackend<'_>, Shift>) -> Answer {
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(TITLE_HEIGHT);
    head.titled(&figure.title, ("sans-serif", 22))?;
    let x_range = x_range(figure);
    let axis = if figure.log_x { power_label } else { tick_label };
    let last = figure.panels.len().saturating_sub(1);
    for (k, (panel, area)) in figure.panels.iter().zip(body.split_evenly((figure.panels.len(), 1))).enumerate() {
        let x_label = if k == last { figure.x_label } else { "" };
        draw_panel(panel, figure, x_range.clone(), (x_label, axis), &area)?;
    }
    root.present()?;
    Ok(())
}

fn x_range(figure: &Figure) -> Range<f64> {
    let curves = figure.panels.iter().flat_map(|panel| &panel.series);
    let points = curves.flat_map(|series| figure.on_axis(&series.points));
    let (low, high) = points.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.0), h.max(p.0)));
    // Room on the right, so that the legend covers no curve.
    if low < high { low..high + LEGEND_ROOM * (high - low) } else { 0.0..1.0 }
}

fn y_range(panel: &Panel) -> Range<f64> {
    let values = panel.series.iter().flat_map(|s| &s.points).map(|p| p.1).filter(|y| y.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    if low > high {
        return 0.0..1.0;
    }
    let low = low.min(0.0);
    let room = if high > low { 0.06 * (high - low) } else { 1.0 };
    let floor = if low < 0.0 { low - room } else { low };
    floor..high + room
}

fn draw_panel(
    panel: &Panel,
    figure: &Figure,
    x_range: Range<f64>,
    (x_label, x_tick): (&str, fn(&f64) -> String),
    area: &DrawingArea<SVGBackend<'_>, Shift>,
) -> Answer {
    let bands = &figure.bands;
    let y_range = y_range(panel);
    let mut chart = ChartBuilder::on(area)
        .caption(panel.title, ("sans-serif", 16))
        .margin_left(12)
        .margin_right(24)
        .margin_bottom(6)
        .x_label_area_size(if x_label.is_empty() { 22 } else { 40 })
        .y_label_area_size(70)
        .build_cartesian_2d(x_range.clone(), y_range.clone())?;
    chart.draw_series(
        bands.iter().map(|band| Rectangle::new([(band.start, y_range.start), (band.end, y_range.end)], SHADE.filled())),
    )?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 225, 225))
        .x_desc(x_label)
        .y_desc(panel.unit)
        .x_labels(11)
        .y_labels(6)
        .x_label_formatter(&x_tick)
        .y_label_formatter(&tick_label)
        .label_style(("sans-serif", 13))
        .draw()?;
    for series in &panel.series {
        let color = series.color;
        let points = figure.on_axis(&series.points);
        let runs = runs(&points);
        let mut labelled = false;
        for run in runs {
            let drawn = chart.draw_series(LineSeries::new(run.iter().copied(), color.stroke_width(1)))?;
            if !labelled {
                drawn
                    .label(series.label)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(3)));
                labelled = true;
            }
            if run.len() <= FEW_POINTS {
                chart.draw_series(run.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
            }
            if panel.thick_in_bands {
                for band in bands {
                    let inside = run.iter().copied().filter(|p| band.start <= p.0 && p.0 <= band.end);
                    chart.draw_series(LineSeries::new(inside, color.stroke_width(3)))?;
                }
            }
        }
    }
    if panel.series.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(200, 200, 200))
            .label_font(("sans-serif", 13))
            .draw()?;
    }
    Ok(())
}

/// A number as short as it can be said: 2000, 0.5, −3.
fn tick_label(value: &f64) -> String {
    // The axis steps are round numbers, but sums of them carry rounding.
    let rounded = (value * 1e6).round() / 1e6;
    // Adding zero turns −0 into 0.
    format!("{}", rounded + 0.0)
}

/// The number whose decimal logarithm stands on the axis, with the letter of its thousands.
fn power_label(log: &f64) -> String {
    let value = 10f64.powf(*log);
    match value {
        _ if value >= 1e6 => format!("{:.1} M", value / 1e6),
        _ if value >= 1e3 => format!("{:.0} k", value / 1e3),
        _ if value >= 10.0 => format!("{value:.0}"),
        _ => format!("{value:.1}"),
    }
}

impl Figure {
    /// Points as they lie on the horizontal axis.
    fn on_axis(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        points.iter().map(|&(x, y)| (if self.log_x { x.log10() } else { x }, y)).collect()
    }
}

/// The stretches of finite points.
fn runs(points: &[(f64, f64)]) -> Vec<&[(f64, f64)]> {
    points.split(|p| !p.1.is_finite()).filter(|run| !run.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_open_and_close_with_the_samples() {
        let samples = [(0.0, false), (1.0, true), (2.0, true), (3.0, false), (4.0, false), (5.0, true)];
        assert_eq!(bands(samples.into_iter()), vec![1.0..3.0, 5.0..5.0]);
    }

    #[test]
    fn a_curve_is_interrupted_where_it_has_no_value() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 2.0), (3.0, 4.0)];
        assert_eq!(runs(&points), vec![&points[0..1], &points[2..4]]);
    }
}
