//! A section as a page: the felt depth, the true depth, and their difference.
//!
//! 1. Panels are arranged side by side or one above the other, so that they are as large as
//!    possible. An open mesh has no inside, so it has only the felt depth.
//! 2. A scale with its unit and a legend of the colours are added.

use crate::letters;
use crate::picture::Picture;
use crate::scene::Unit;
use crate::section::Section;
use crate::section_panel::{
    LESS, MORE, Range, SectionOf, Shown, UNSEEN, contour_step, depth_colour, outside_colour, outside_step, paint_panel,
};
use crate::sheet::{Area, Sheet, WORD_SIZE};
use crate::style::Style;

/// Width that is left for the scale and its numbers, nominal pixels.
const SCALE_ROOM: f64 = 104.0;
/// Width of the scale, nominal pixels.
const SCALE_WIDTH: f64 = 16.0;
/// Gap between panels, and beside the scale, nominal pixels.
const GAP: f64 = 12.0;

/// Draws all panels with text and a scale.
pub fn paint_section(shown: &SectionOf<'_>, style: &Style, width: usize, height: usize) -> Picture {
    let SectionOf { section, name, unit, .. } = shown;
    let numbers = section.numbers();
    let deepest = numbers.deepest.max(numbers.deepest_felt);
    let plane = format!("{} = {}", section.plane.axis.name(), length_name(section.plane.offset, *unit));
    let title = format!("{name} · depth on the plane {plane}");
    let mut sheet = Sheet::new(width, height, style, &title, &caption(shown));
    let area = sheet.area();
    let room = if style.words { SCALE_ROOM * sheet.scale } else { 0.0 };
    let area = Area { width: (area.width - room).max(1.0), ..area };
    let panels: &[(Shown, &str)] = if section.closed {
        &[
            (Shown::Felt, "felt depth"),
            (Shown::True, "true depth: distance to the surface"),
            (Shown::Missing, "true − felt"),
        ]
    } else {
        &[(Shown::Felt, "felt depth")]
    };
    let head = if style.words { 1.6 * WORD_SIZE * sheet.scale } else { 0.0 };
    let gap = GAP * sheet.scale;
    let places = arranged(&area, panels.len(), section, head, gap);
    let step = contour_step(deepest, *unit);
    for ((which, words), place) in panels.iter().zip(places) {
        let [x, y, wide, tall] = place.pixels();
        let panel = paint_panel(shown, *which, &Range { deepest, step }, style.theme, wide, tall);
        sheet.picture.put(&panel, x, y);
        let ink = sheet.colours.ink;
        sheet.write(words, place.x, place.y - 0.6 * WORD_SIZE * sheet.scale, WORD_SIZE, ink);
    }
    if style.words && deepest > 0.0 {
        let right = Area { x: area.width, width: room, ..area };
        draw_scale(&mut sheet, &right, &Range { deepest, step }, *unit);
    }
    let outside = outside_colour(style.theme, 0.0);
    let lines = format!("inside, a line every {}", length_name(step, *unit));
    let beyond = format!("outside, every {}", length_name(outside_step(section, *unit), *unit));
    let mut rows = vec![(sheet.colours.ink, false, lines.as_str()), (outside, false, beyond.as_str())];
    if section.closed {
        rows.extend([
            (UNSEEN, true, "inside, not felt"),
            (LESS, false, "felt too little"),
            (MORE, false, "felt too much"),
        ]);
    }
    sheet.legend(&rows);
    sheet.picture
}

fn caption(shown: &SectionOf<'_>) -> [String; 2] {
    let numbers = shown.section.numbers();
    let felt = format!("felt up to {}", length_name(numbers.deepest_felt, shown.unit));
    if !shown.section.closed {
        let why = "the mesh is open and has no inside: the felt depth is the thickness of its pieces";
        return [felt, why.to_owned()];
    }
    let share = 100.0 * numbers.unseen as f64 / numbers.inside.max(1) as f64;
    let ratio = match numbers.ratio {
        [Some(low), Some(median)] => {
            format!("ratio of felt to true depth: median {:.1} %, first decile {:.1} % · ", 100.0 * median, 100.0 * low)
        }
        _ => String::new(),
    };
    let deep = length_name(numbers.deepest, shown.unit);
    [format!("the solid is up to {deep} deep here, {felt}"), format!("{ratio}{share:.2} % of the inside is not felt")]
}

/// Formats a length with three digits and a unit.
pub(crate) fn length_name(length: f64, unit: Unit) -> String {
    let digits = |value: f64| {
        let decade = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
        format!("{value:.*}", (2 - decade).clamp(0, 12) as usize)
    };
    let trimmed = |value: f64| {
        let text = digits(value);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    };
    match unit {
        Unit::Model => format!("{} units", trimmed(length)),
        Unit::Metre if length.abs() < 1.0 => format!("{} mm", trimmed(length * 1e3)),
        Unit::Metre => format!("{} m", trimmed(length)),
    }
}

/// Arranges `count` panels, with `head` pixels above each, in the number of columns that makes the
/// panels largest.
fn arranged(area: &Area, count: usize, section: &Section, head: f64, gap: f64) -> Vec<Area> {
    let (wide, tall) = (section.columns as f64, section.rows as f64);
    let size = |across: usize| {
        let width = area.width / across as f64 - 2.0 * gap;
        let height = area.height / count.div_ceil(across) as f64 - 2.0 * gap - head;
        (width / wide).min(height / tall).max(0.0)
    };
    let across = (1..=count).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(1);
    let (down, pixel) = (count.div_ceil(across), size(across));
    let place = |k: usize, of: usize| [k as f64 / of as f64, (k + 1) as f64 / of as f64];
    (0..count)
        .map(|k| {
            let slot = area.part(place(k % across, across), place(k / across, down), gap);
            let (width, height) = ((wide * pixel).max(1.0), (tall * pixel).max(1.0));
            Area {
                x: slot.x + 0.5 * (slot.width - width).max(0.0),
                y: slot.y + head + 0.5 * (slot.height - head - height).max(0.0),
                width,
                height,
            }
        })
        .collect()
}

/// Draws a colour bar of the depths with round numbers.
fn draw_scale(sheet: &mut Sheet, area: &Area, range: &Range, unit: Unit) {
    let (wide, tall) = (SCALE_WIDTH * sheet.scale, 0.7 * area.height);
    let (x, top) = (area.x + GAP * sheet.scale, area.y + 0.5 * (area.height - tall));
    let bar = Area { x, y: top, width: wide, height: tall };
    let [column, row, width, height] = bar.pixels();
    let mut picture = Picture::new(width, height, sheet.colours.ink);
    for y in 0..height {
        let colour = depth_colour(1.0 - (y as f64 + 0.5) / height as f64);
        (0..width).for_each(|x| picture.set_pixel(x, y, colour));
    }
    sheet.picture.put(&picture, column, row);
    let faint = sheet.colours.ink;
    let name = length_name(range.step, unit);
    let named = name.split(' ').next_back().unwrap_or_default();
    sheet.write(named, x, top - 0.8 * WORD_SIZE * sheet.scale, WORD_SIZE, faint);
    // Writes as many lines as fit.
    let room = 1.6 * WORD_SIZE * sheet.scale;
    let every = (room / (tall * range.step / range.deepest)).ceil().max(1.0);
    let mut k = 0.0;
    while k * range.step <= range.deepest * (1.0 + 1e-9) {
        let y = top + tall * (1.0 - k * range.step / range.deepest);
        letters::rule(&mut sheet.picture, (x + wide, y), (x + 1.4 * wide, y), 0.6 * sheet.scale, faint);
        let name = length_name(k * range.step, unit);
        let number = name.split(' ').next().unwrap_or_default();
        sheet.write(number, x + 1.7 * wide, y + 0.4 * WORD_SIZE * sheet.scale, 0.9 * WORD_SIZE, faint);
        k += every;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_three_digits() {
        assert_eq!(length_name(0.0123456, Unit::Metre), "12.3 mm");
        assert_eq!(length_name(0.0005, Unit::Metre), "0.5 mm");
        assert_eq!(length_name(12.0, Unit::Model), "12 units");
        assert_eq!(length_name(100.0, Unit::Model), "100 units");
        assert_eq!(length_name(0.0, Unit::Model), "0 units");
        assert_eq!(length_name(-0.25, Unit::Model), "-0.25 units");
    }
}
