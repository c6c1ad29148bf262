//! The charts: their names, their curves, and the texts of their values.

use glam::DVec3;

use super::run::{ComparedTick, SeenTick};
use crate::picture::Rgb;
use crate::style::Colours;

/// Selects the shown representation of force and torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// Magnitudes of force and torque.
    #[default]
    Size,
    /// Components of force and torque along the world's axes.
    Parts,
    /// Spectrum of the magnitudes in the newest second.
    Spectrum,
}

impl Kind {
    /// Returns the next representation, cyclically.
    pub(super) fn next(self) -> Self {
        match self {
            Self::Size => Self::Parts,
            Self::Parts => Self::Spectrum,
            Self::Spectrum => Self::Size,
        }
    }
}

/// One curve.
pub(super) enum Series {
    Felt { of: fn(&SeenTick) -> f64, colour: Rgb },
    Compared { of: fn(&ComparedTick) -> f64, colour: Rgb },
}

impl Series {
    pub(super) fn colour(&self) -> Rgb {
        match self {
            Self::Felt { colour, .. } | Self::Compared { colour, .. } => *colour,
        }
    }
}

/// Text of a chart's value, for a tick and for the same tick with other settings.
type Said = fn(Option<&SeenTick>, Option<&ComparedTick>) -> String;

/// One chart.
pub(super) struct Chart {
    pub(super) kind: Kind,
    /// True if the chart can show a spectrum.
    pub(super) has_spectrum: bool,
    /// Name of the chart, and names of its curves.
    pub(super) names: Vec<(String, Rgb)>,
    pub(super) series: Vec<Series>,
    pub(super) said: Said,
    /// Unit of the values.
    pub(super) unit: &'static str,
    /// Smallest range of the scale, so that rounding errors near zero do not fill the chart.
    pub(super) least: f64,
}

/// Factors from N·m to mN·m and from s to µs.
const MILLI: f64 = 1e3;
const MICRO: f64 = 1e6;

/// Returns all charts. `names`: names of the felt and the compared settings, if a comparison runs.
pub(super) fn charts(kind: Kind, colours: &Colours, names: Option<[&str; 2]>) -> Vec<Chart> {
    let is_spectrum = kind == Kind::Spectrum;
    let vector = |title: &str, unit, rgb: Rgb, size: [Series; 2], parts: [Series; 3], said: Said, least: [f64; 2]| {
        let title = if is_spectrum { format!("{title}, spectrum") } else { title.to_owned() };
        let mut chart = Chart {
            kind,
            has_spectrum: true,
            names: vec![(title, rgb)],
            series: Vec::new(),
            said,
            unit,
            least: least[usize::from(is_spectrum)],
        };
        if kind == Kind::Parts {
            chart.names.extend(["x", "y", "z"].into_iter().zip(colours.axes).map(|(name, rgb)| (name.to_owned(), rgb)));
            chart.series.extend(parts);
        } else {
            let [felt, compared] = size;
            // The felt curve is drawn over the compared curve.
            if let Some([own, other]) = names {
                chart.names.push((own.to_owned(), felt.colour()));
                chart.names.push((other.to_owned(), compared.colour()));
                chart.series.push(compared);
            }
            chart.series.push(felt);
        }
        chart
    };
    let felt = |of: fn(&SeenTick) -> f64, colour: Rgb| Series::Felt { of, colour };
    let compared = |of: fn(&ComparedTick) -> f64| Series::Compared { of, colour: colours.compared };
    let [x, y, z] = colours.axes;
    let force = vector(
        "force",
        "N",
        colours.force,
        [felt(|t| t.force.length(), colours.force), compared(|t| t.force.length())],
        [felt(|t| t.force.x, x), felt(|t| t.force.y, y), felt(|t| t.force.z, z)],
        |felt, compared| pair(felt.map(|t| t.force), compared.map(|t| t.force), "N", 1.0, 2),
        [0.5, 0.005],
    );
    let torque = vector(
        "torque",
        "mN·m",
        colours.torque,
        [felt(|t| t.torque.length() * MILLI, colours.torque), compared(|t| t.torque.length() * MILLI)],
        [felt(|t| t.torque.x * MILLI, x), felt(|t| t.torque.y * MILLI, y), felt(|t| t.torque.z * MILLI, z)],
        |felt, compared| pair(felt.map(|t| t.torque), compared.map(|t| t.torque), "mN·m", MILLI, 1),
        [5.0, 0.05],
    );
    let one = |names: Vec<(String, Rgb)>, unit, series, said: Said, least| Chart {
        kind,
        has_spectrum: false,
        names,
        series,
        said,
        unit,
        least,
    };
    let time = one(
        vec![("query".to_owned(), colours.cluster), ("forces".to_owned(), colours.sliding)],
        "µs",
        vec![felt(|t| t.query * MICRO, colours.cluster), felt(|t| t.force_time * MICRO, colours.sliding)],
        |felt, _| felt.map_or(String::new(), |t| format!("{:.0} µs", t.query * MICRO)),
        20.0,
    );
    let contacts = one(
        vec![("contacts".to_owned(), colours.ink)],
        "",
        vec![felt(|t| f64::from(t.contacts), colours.ink)],
        |felt, _| felt.map_or(String::new(), |t| t.contacts.to_string()),
        4.0,
    );
    vec![force, torque, time, contacts]
}

/// Formats a magnitude with its unit and, during a comparison, the magnitude with other settings.
fn pair(felt: Option<DVec3>, compared: Option<DVec3>, unit: &str, times: f64, figures: usize) -> String {
    let sizes: Vec<String> =
        [felt, compared].iter().flatten().map(|v| format!("{:.figures$}", v.length() * times)).collect();
    if sizes.is_empty() { String::new() } else { format!("{} {unit}", sizes.join(" | ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::style::Theme;

    #[test]
    fn compared_settings_are_a_second_curve_of_force_and_torque() {
        let colours = Theme::Dark.colours();
        let alone = charts(Kind::Size, &colours, None);
        let beside = charts(Kind::Size, &colours, Some(["palpus", "paper"]));
        let count = |charts: &[Chart]| charts.iter().map(|chart| chart.series.len()).collect::<Vec<usize>>();
        assert_eq!((count(&alone), count(&beside)), (vec![1, 1, 2, 1], vec![2, 2, 2, 1]));
        assert_eq!(count(&charts(Kind::Parts, &colours, None)), [3, 3, 2, 1]);
        let felt = SeenTick { force: DVec3::X * 1.5, ..SeenTick::default() };
        let other = ComparedTick { force: DVec3::Y * 0.25, ..ComparedTick::default() };
        assert_eq!((beside[0].said)(Some(&felt), Some(&other)), "1.50 | 0.25 N");
        assert_eq!((alone[0].said)(Some(&felt), None), "1.50 N");
    }
}
