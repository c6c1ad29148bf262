//! Colours, and the selection of drawn elements.

use glam::DVec3;

use crate::picture::Rgb;

/// Drawing options of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Light or dark theme.
    pub theme: Theme,
    /// True if contacts are drawn as dots: green where the bodies are apart, red where they
    /// overlap.
    pub contacts: bool,
    /// True if the force of each cluster is drawn as an arrow.
    pub clusters: bool,
    /// True if these arrows have the colours of the contacts, as in the paper's Figure 4,
    /// instead of their own colour.
    pub clusters_as_contacts: bool,
    /// True if the wrench at the grip is drawn as an arrow and a turning arrow. The grip of the
    /// tool is marked too, and the grip of the hand if it is at another place, with a line between
    /// both.
    pub wrench: bool,
    /// True if points with friction are drawn.
    pub anchors: bool,
    /// True if numbers, a legend and a scale are drawn.
    pub words: bool,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            theme: Theme::Light,
            contacts: true,
            clusters: true,
            clusters_as_contacts: false,
            wrench: true,
            anchors: true,
            words: true,
        }
    }
}

/// A theme: dark on light, or light on dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark on light, for paper.
    #[default]
    Light,
    /// Light on dark.
    Dark,
}

/// The colours of a theme, sRGB.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Colours {
    pub(crate) above: Rgb,
    pub(crate) below: Rgb,
    pub(crate) ink: Rgb,
    pub(crate) faint: Rgb,
    pub(crate) outline: Rgb,
    pub(crate) probe: Rgb,
    pub(crate) environment: Rgb,
    pub(crate) object: Rgb,
    pub(crate) disjoint: Rgb,
    pub(crate) penetrating: Rgb,
    pub(crate) cluster: Rgb,
    pub(crate) force: Rgb,
    pub(crate) torque: Rgb,
    pub(crate) anchor: Rgb,
    pub(crate) sliding: Rgb,
    /// Colour of the grip in the hand, if the tool is elsewhere.
    pub(crate) grip: Rgb,
    /// Colour of the curve with other settings.
    #[cfg(feature = "gui")]
    pub(crate) compared: Rgb,
    /// Colours of the patches of contact, for light and for hard pressure.
    pub(crate) light: Rgb,
    pub(crate) heavy: Rgb,
    /// Colour of the ground's shadow, and its largest opacity.
    pub(crate) shadow: Rgb,
    pub(crate) shade: f64,
    /// Colours of the world's axes.
    #[cfg(feature = "gui")]
    pub(crate) axes: [Rgb; 3],
    /// Colours of pieces: saturation and lightness.
    pub(crate) piece_lightness: f64,
}

impl Theme {
    /// Returns the other theme.
    #[cfg(feature = "gui")]
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Light => Self::Dark,
            Self::Dark => Self::Light,
        }
    }

    pub(crate) fn colours(self) -> Colours {
        match self {
            Self::Light => Colours {
                above: [250, 251, 253],
                below: [222, 228, 236],
                ink: [28, 33, 43],
                faint: [110, 118, 132],
                outline: [38, 44, 56],
                probe: [232, 164, 82],
                environment: [176, 189, 205],
                object: [150, 182, 132],
                disjoint: [26, 158, 60],
                penetrating: [214, 28, 36],
                cluster: [122, 62, 188],
                force: [18, 84, 204],
                torque: [0, 138, 148],
                anchor: [24, 24, 28],
                sliding: [222, 110, 0],
                grip: [176, 34, 122],
                #[cfg(feature = "gui")]
                compared: [214, 96, 0],
                light: [250, 205, 60],
                heavy: [220, 40, 30],
                shadow: [40, 50, 68],
                shade: 0.42,
                #[cfg(feature = "gui")]
                axes: [[200, 44, 44], [38, 136, 52], [40, 84, 214]],
                piece_lightness: 0.66,
            },
            Self::Dark => Colours {
                above: [42, 48, 58],
                below: [24, 28, 35],
                ink: [238, 241, 246],
                faint: [150, 158, 172],
                outline: [6, 7, 10],
                probe: [236, 170, 92],
                environment: [134, 150, 172],
                object: [142, 180, 122],
                disjoint: [70, 220, 104],
                penetrating: [255, 74, 74],
                cluster: [204, 150, 255],
                force: [96, 164, 255],
                torque: [64, 214, 222],
                anchor: [250, 250, 250],
                sliding: [255, 170, 60],
                grip: [255, 132, 204],
                #[cfg(feature = "gui")]
                compared: [255, 150, 60],
                light: [255, 220, 90],
                heavy: [255, 70, 50],
                shadow: [0, 0, 0],
                shade: 0.75,
                #[cfg(feature = "gui")]
                axes: [[255, 104, 104], [112, 220, 122], [122, 164, 255]],
                piece_lightness: 0.60,
            },
        }
    }
}

/// Converts sRGB to linear light. The curve is a plain square, which is close to the curve of sRGB
/// and exact on every machine.
pub(crate) fn linear(colour: Rgb) -> DVec3 {
    let part = |c: u8| (f64::from(c) / 255.0).powi(2);
    DVec3::new(part(colour[0]), part(colour[1]), part(colour[2]))
}

/// Converts linear light to sRGB.
pub(crate) fn encoded(light: DVec3) -> Rgb {
    let part = |c: f64| (c.clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8;
    [part(light.x), part(light.y), part(light.z)]
}

/// Difference between the hues of consecutive pieces, as a share of a full turn: the golden ratio,
/// for which consecutive hues are far apart.
const HUE_STEP: f64 = 0.618_033_988_749_894_9;
/// Consecutive pieces also alternate in lightness by this much.
const LIGHTNESS_STEPS: [f64; 3] = [0.0, 0.07, -0.08];
/// Saturation of the colours, from 0 to 1.
const SATURATION: f64 = 0.44;

/// Returns the colour of piece `k`, as linear light.
pub(crate) fn piece_colour(k: u32, lightness: f64) -> DVec3 {
    let hue = (f64::from(k) * HUE_STEP + 0.08).fract();
    let lightness = lightness + LIGHTNESS_STEPS[k as usize % LIGHTNESS_STEPS.len()];
    let swing = SATURATION * lightness.min(1.0 - lightness);
    let part = |offset: f64| {
        let at = (offset + hue * 12.0) % 12.0;
        let value = lightness - swing * (at - 3.0).min(9.0 - at).clamp(-1.0, 1.0);
        value * value
    };
    DVec3::new(part(0.0), part(8.0), part(4.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_the_conversion_to_light() {
        for c in 0..=255u8 {
            assert_eq!(encoded(linear([c, 255 - c, 7])), [c, 255 - c, 7]);
        }
    }

    #[test]
    fn pieces_with_adjacent_numbers_differ_in_colour() {
        for k in 0..200 {
            let now = piece_colour(k, 0.6);
            for j in k + 1..k + 4 {
                assert!((now - piece_colour(j, 0.6)).length() > 0.08, "{k} {j}");
            }
        }
    }
}
