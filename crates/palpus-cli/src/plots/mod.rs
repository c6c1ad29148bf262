//! Plots as SVG: stacked panels over a common horizontal axis, with the intervals of penetration
//! shaded.
//!
//! 1. *Values*: a [`Figure`] of [`Panel`]s of [`Series`] ([`mod@self`]).
//! 2. *Ticks* at round numbers, or at 1, 2 and 5 times powers of ten ([`axis`]).
//! 3. *Drawing* ([`draw`]): long curves are reduced to the smallest and the largest value of each
//!    bin, so that no peak is lost and a figure stays small. Colours are light by default and dark
//!    if the reader's system is dark ([`ink`]).

mod axis;
mod draw;
mod ink;
mod run;

use std::ops::Range;
use std::path::Path;

pub(crate) use draw::{Svg, svg};
pub(crate) use ink::{BLUE, GREEN, Ink, VERMILION};
pub(crate) use run::{query_us, run_figure, run_histograms, seconds};

use crate::files;

/// One curve of a panel.
pub(crate) struct Series {
    /// Name of the quantity, with its unit.
    pub(crate) label: &'static str,
    /// Colour of the curve.
    pub(crate) color: Ink,
    /// (x, y); a `NaN` y interrupts the curve.
    pub(crate) points: Vec<(f64, f64)>,
}

/// How a panel's series are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drawn {
    /// Curves of constant width.
    Lines,
    /// Curves that are thicker within the shaded intervals (the paper's Figure 6).
    ThickInBands,
    /// A [`histogram`]: x are the middles of its bins, and y are the numbers of samples on a
    /// logarithmic scale.
    Bars,
}

/// One panel of a figure.
pub(crate) struct Panel {
    /// Title above the panel.
    pub(crate) title: &'static str,
    /// Explanation beside the title.
    pub(crate) unit: &'static str,
    /// The curves, drawn in this order.
    pub(crate) series: Vec<Series>,
    /// How the series are drawn.
    pub(crate) drawn: Drawn,
}

/// A labelled position on the horizontal axis.
pub(crate) struct Mark {
    /// Position on the axis.
    pub(crate) x: f64,
    /// Label: a letter or two, above the first panel.
    pub(crate) label: String,
}

/// A figure: panels from top to bottom.
pub(crate) struct Figure {
    /// Title above all panels; omitted if empty.
    pub(crate) title: String,
    /// Label below the horizontal axis.
    pub(crate) x_label: &'static str,
    /// True for a logarithmic horizontal axis; all x are then positive.
    pub(crate) log_x: bool,
    /// Intervals of x in which the bodies overlap.
    pub(crate) bands: Vec<Range<f64>>,
    /// Labelled positions.
    pub(crate) marks: Vec<Mark>,
    /// Panels from top to bottom.
    pub(crate) panels: Vec<Panel>,
}

/// Returns the intervals of x in which `inside` is true, from samples in order of x.
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

/// Number of bins of a histogram.
const BINS: usize = 60;

/// Values more than this many powers of ten below the largest value count as rounding errors.
const DECADES: f64 = 5.0;

/// Returns a histogram of the positive `values` over equal bins of their logarithm: the middle and
/// the count of each bin.
pub(crate) fn histogram(values: impl Iterator<Item = f64> + Clone) -> Vec<(f64, f64)> {
    let logs = values.filter(|value| *value > 0.0 && value.is_finite()).map(f64::log10);
    let (low, high) = logs.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if low > high {
        return Vec::new();
    }
    let low = low.max(high - DECADES);
    // A single distinct value gets one bin, a tenth of a decade wide.
    let width = ((high - low) / BINS as f64).max(0.1 / BINS as f64);
    let mut counts = vec![0.0; BINS];
    for log in logs {
        counts[(((log - low) / width).max(0.0) as usize).min(BINS - 1)] += 1.0;
    }
    let middle = |k: usize| 10f64.powf(low + (k as f64 + 0.5) * width);
    counts.into_iter().enumerate().map(|(k, count)| (middle(k), count)).collect()
}

/// Writes the figure to `path`.
pub(crate) fn write_svg(figure: &Figure, path: &Path) -> anyhow::Result<()> {
    files::write(path, svg(figure).as_str())
}

impl Series {
    pub(crate) fn new(label: &'static str, color: Ink, points: Vec<(f64, f64)>) -> Self {
        Self { label, color, points }
    }
}

impl Figure {
    /// Creates a figure with a linear horizontal axis, without shaded intervals and labelled
    /// positions.
    pub(crate) fn new(title: impl Into<String>, x_label: &'static str, panels: Vec<Panel>) -> Self {
        Self { title: title.into(), x_label, log_x: false, bands: Vec::new(), marks: Vec::new(), panels }
    }

    /// Returns the points with their positions on the horizontal axis.
    fn on_axis(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        points.iter().map(|&(x, y)| (self.place(x), y)).collect()
    }

    /// Returns the position of x on the horizontal axis.
    fn place(&self, x: f64) -> f64 {
        if self.log_x { x.log10() } else { x }
    }

    fn x_range(&self) -> Range<f64> {
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        let xs = series.flat_map(|series| &series.points).map(|point| self.place(point.0)).filter(|x| x.is_finite());
        let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if low >= high {
            return 0.0..1.0;
        }
        // A bar reaches half a bin beyond its middle.
        let is_bars = self.panels.iter().any(|panel| panel.drawn == Drawn::Bars);
        let room = if is_bars { 0.5 * (high - low) / (BINS - 1) as f64 } else { 0.0 };
        low - room..high + room
    }
}

impl Panel {
    /// Creates a panel of curves.
    pub(crate) fn lines(title: &'static str, unit: &'static str, series: Vec<Series>) -> Self {
        Self { title, unit, series, drawn: Drawn::Lines }
    }

    fn y_range(&self) -> Range<f64> {
        let values = self.series.iter().flat_map(|s| &s.points).map(|p| p.1).filter(|y| y.is_finite());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        if self.drawn == Drawn::Bars {
            return LEAST_COUNT.log10()..(1.3 * high.max(10.0)).log10();
        }
        if low > high {
            return 0.0..1.0;
        }
        let (low, high) = (low.min(0.0), high.max(0.0));
        let room = if high > low { 0.06 * (high - low) } else { 1.0 };
        let floor = if low < 0.0 { low - room } else { low };
        floor..high + room
    }
}

/// Base line of bars, so that a single sample is visible.
const LEAST_COUNT: f64 = 0.7;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_open_and_close_with_the_samples() {
        let samples = [(0.0, false), (1.0, true), (2.0, true), (3.0, false), (4.0, false), (5.0, true)];
        assert_eq!(bands(samples.into_iter()), vec![1.0..3.0, 5.0..5.0]);
    }

    #[test]
    fn histogram_counts_every_positive_value_once() {
        let values = (0..1000).map(|k| f64::from(k) - 10.0);
        let bars = histogram(values);
        assert_eq!(bars.len(), BINS);
        assert_eq!(bars.iter().map(|bar| bar.1).sum::<f64>(), 989.0);
        assert!(bars.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(histogram([5.0; 7].into_iter()).iter().map(|bar| bar.1).sum::<f64>(), 7.0);
        assert!(histogram([0.0, -1.0, f64::NAN, f64::INFINITY].into_iter()).is_empty());
    }
}
