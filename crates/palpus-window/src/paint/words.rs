//! The text of a picture: title, caption, legend, and the length of the scale.

use glam::DVec3;

use crate::camera::Camera;
use crate::letters::{self, Setting};
use crate::moment::Moment;
use crate::picture::{Picture, Rgb};
use crate::scene::{Scene, Unit};
use crate::style::{Colours, Style};

/// Distance of the text from the edges, nominal pixels.
const MARGIN: f64 = 22.0;
/// Size of the letters of the title, nominal pixels.
const TITLE_SIZE: f64 = 19.0;
/// Size of the other letters, nominal pixels.
pub(super) const WORD_SIZE: f64 = 13.0;

/// Draws the title, the caption, the legend and a scale.
pub(super) fn words(picture: &mut Picture, scene: &Scene, camera: &Camera, style: &Style, scale: f64) {
    let colours = style.theme.colours();
    let margin = MARGIN * scale;
    let (width, height) = (picture.width() as f64, picture.height() as f64);
    let ink =
        |x: f64, y: f64, size: f64| Setting { x, y, size: size * scale, colour: colours.ink, halo: colours.above };
    letters::write(picture, &scene.title, &ink(margin, margin + TITLE_SIZE * scale, TITLE_SIZE));
    let faint = |x: f64, y: f64| Setting { colour: colours.faint, ..ink(x, y, WORD_SIZE) };
    let below = margin + (TITLE_SIZE + 2.2 * WORD_SIZE) * scale;
    letters::write(picture, &scene.caption, &Setting { colour: colours.ink, ..faint(margin, below) });

    let last = height - margin;
    let mut x = margin;
    for (colour, meaning) in
        scene.moment.as_ref().map_or_else(Vec::new, |moment| legend(scene, moment, style, &colours))
    {
        let radius = 0.45 * WORD_SIZE * scale;
        letters::disc(picture, x + radius, last - radius, radius, colour);
        x += 3.2 * radius;
        let setting = Setting { halo: colours.below, ..faint(x, last) };
        letters::write(picture, meaning, &setting);
        x += letters::width(meaning, setting.size) + 1.6 * WORD_SIZE * scale;
    }

    let (length, name) =
        round_length(camera.metres_per_pixel(camera.distance, height) * SCALE_LENGTH * scale, scene.unit);
    let pixels = length / camera.metres_per_pixel(camera.distance, height);
    let (right, thick) = (width - margin, 1.2 * scale);
    letters::rule(picture, (right - pixels, last), (right, last), thick, colours.faint);
    for end in [right - pixels, right] {
        letters::rule(picture, (end, last - 5.0 * scale), (end, last), thick, colours.faint);
    }
    let wide = letters::width(&name, WORD_SIZE * scale);
    let above = Setting {
        halo: colours.below,
        ..faint((right - 0.5 * (pixels + wide)).min(right - wide), last - 0.7 * WORD_SIZE * scale)
    };
    letters::write(picture, &name, &above);
}

/// Approximate length of the scale, pixels.
const SCALE_LENGTH: f64 = 130.0;

/// Returns the entries of the legend for the marks in the picture.
fn legend(scene: &Scene, moment: &Moment, style: &Style, colours: &Colours) -> Vec<(Rgb, &'static str)> {
    let contacts = |overlap: bool| style.contacts && moment.contacts.iter().any(|c| (c.separation < 0.0) == overlap);
    let anchors = |sliding: bool| style.anchors && moment.anchors.iter().any(|a| a.sliding == sliding);
    let force = style.wrench && moment.wrench.force != DVec3::ZERO;
    let torque = style.wrench && moment.wrench.torque != DVec3::ZERO;
    let rows = [
        (contacts(false), colours.disjoint, "apart"),
        (contacts(true), colours.penetrating, "overlapping"),
        (
            style.clusters && !style.clusters_as_contacts && !moment.clusters.is_empty(),
            colours.cluster,
            "forces of clusters",
        ),
        (force, colours.force, "force at the grip"),
        (torque, colours.torque, "torque"),
        (style.wrench && scene.is_grip_apart(), colours.grip, "grip in the hand"),
        (anchors(false), colours.anchor, "friction holds"),
        (anchors(true), colours.sliding, "friction slides"),
    ];
    rows.into_iter().filter(|row| row.0).map(|(_, colour, meaning)| (colour, meaning)).collect()
}

/// Returns the largest of 1, 2 or 5 times a power of ten that is at most `most`, with its text.
pub(crate) fn round_length(most: f64, unit: Unit) -> (f64, String) {
    let mut decade = -12i32;
    while 10f64.powi(decade + 1) <= most && decade < 12 {
        decade += 1;
    }
    let digit = [5, 2, 1].into_iter().find(|d| f64::from(*d) * 10f64.powi(decade) <= most).unwrap_or(1);
    let length = f64::from(digit) * 10f64.powi(decade);
    let name = match unit {
        Unit::Model if length == 1.0 => "1 unit".to_owned(),
        Unit::Model if decade >= 0 => format!("{length:.0} units"),
        Unit::Model => format!("{length:.*} units", -decade as usize),
        Unit::Metre if decade >= 0 => format!("{length:.0} m"),
        Unit::Metre if decade >= -3 => format!("{:.0} mm", length * 1e3),
        Unit::Metre => format!("{:.0} µm", length * 1e6),
    };
    (length, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round() {
        let name = |most: f64, unit: Unit| round_length(most, unit).1;
        assert_eq!(name(0.013, Unit::Metre), "10 mm");
        assert_eq!(name(0.0051, Unit::Metre), "5 mm");
        assert_eq!(name(0.00025, Unit::Metre), "200 µm");
        assert_eq!(name(3.0, Unit::Metre), "2 m");
        assert_eq!(name(0.03, Unit::Model), "0.02 units");
        assert_eq!(name(70.0, Unit::Model), "50 units");
        assert_eq!(name(1.2, Unit::Model), "1 unit");
        for most in [1e-5, 3.3e-3, 0.2, 1.0, 47.0] {
            let (length, _) = round_length(most, Unit::Metre);
            assert!(length <= most * (1.0 + 1e-9) && length > 0.39 * most, "{most} {length}");
        }
    }
}
