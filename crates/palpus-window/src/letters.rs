//! A font made of strokes, so that pictures can have text at any size without a font file.
//!
//! A letter is a list of lines through points of a grid. The first digit of a point counts to the
//! right (0 to 4), the second upwards (2 is the baseline, 6 the height of small letters, 8 the
//! height of capitals, 0 the lowest descender). Lines have round ends; a line with one point is a
//! dot.

use glam::DVec3;

use crate::picture::{Picture, Rgb};
use crate::style::{encoded, linear};

/// Grid steps from the baseline to the top of a capital.
const CAPITAL: f64 = 6.0;
/// Height of the baseline above the bottom of the grid, grid steps.
const BASELINE: f64 = 2.0;
/// Half the width of a stroke, grid steps.
const STROKE: f64 = 0.44;
/// The radius of a dot, grid steps.
const DOT: f64 = 0.62;
/// Width of the background colour around a stroke (grid steps), and its opacity.
const HALO: f64 = 1.3;
const HALO_STRENGTH: f64 = 0.7;
/// Gap between two letters, and width of a space, grid steps.
const GAP: f64 = 1.7;
const SPACE: f64 = 2.0;

/// Shape for letters that the font does not have.
const UNKNOWN: &str = "02 08 48 42 02";

/// Returns the strokes of a letter.
fn strokes(letter: char) -> &'static str {
    match letter {
        '0' => "12 03 07 18 38 47 43 32 12",
        '1' => "06 28 22|02 42",
        '2' => "07 18 38 47 46 02 42",
        '3' => "07 18 38 47 46 35 15|35 44 43 32 12 03",
        '4' => "32 38 04 44",
        '5' => "48 08 05 35 44 43 32 12 03",
        '6' => "47 38 18 07 03 12 32 43 44 35 15 04",
        '7' => "08 48 12",
        '8' => "15 06 07 18 38 47 46 35 15 04 03 12 32 43 44 35",
        '9' => "03 12 32 43 47 38 18 07 06 15 35 46",
        'a' => "05 16 36 45 42|44 14 03 12 32 43",
        'b' => "08 02|05 16 36 45 43 32 12 03",
        'c' => "45 36 16 05 03 12 32 43",
        'd' => "48 42|45 36 16 05 03 12 32 43",
        'e' => "04 44 45 36 16 05 03 12 32 43",
        'f' => "38 28 17 12|06 36",
        'g' => "46 41 30 10 01|45 36 16 05 03 12 32 43",
        'h' => "08 02|05 16 36 45 42",
        'i' => "06 02|08",
        'j' => "16 11 00|18",
        'k' => "08 02|36 04 32",
        'l' => "08 03 12",
        'm' => "02 06|05 16 25 22|25 36 45 42",
        'n' => "02 06|05 16 36 45 42",
        'o' => "16 05 03 12 32 43 45 36 16",
        'p' => "06 00|05 16 36 45 43 32 12 03",
        'q' => "46 40|45 36 16 05 03 12 32 43",
        'r' => "02 06|05 16 36",
        's' => "45 36 16 05 14 34 43 32 12 03",
        't' => "18 13 22 32|06 36",
        'u' => "06 03 12 32 43|46 42",
        'v' => "06 22 46",
        'w' => "06 12 25 32 46",
        'x' => "06 42|02 46",
        'y' => "06 22|46 22 10 00",
        'z' => "06 46 02 42",
        'A' => "02 28 42|14 34",
        'B' => "02 08 38 47 46 35 05|35 44 43 32 02",
        'C' => "47 38 18 07 03 12 32 43",
        'D' => "02 08 28 46 44 22 02",
        'E' => "48 08 02 42|05 35",
        'F' => "48 08 02|05 35",
        'G' => "47 38 18 07 03 12 32 43 45 25",
        'H' => "02 08|42 48|05 45",
        'I' => "08 02",
        'J' => "38 33 22 12 03",
        'K' => "08 02|48 05 42",
        'L' => "08 02 42",
        'M' => "02 08 25 48 42",
        'N' => "02 08 42 48",
        'O' => "18 07 03 12 32 43 47 38 18",
        'P' => "02 08 38 47 46 35 05",
        'Q' => "18 07 03 12 32 43 47 38 18|24 42",
        'R' => "02 08 38 47 46 35 05|25 42",
        'S' => "47 38 18 07 06 15 35 44 43 32 12 03",
        'T' => "08 48|28 22",
        'U' => "08 03 12 32 43 48",
        'V' => "08 22 48",
        'W' => "08 12 26 32 48",
        'X' => "02 48|08 42",
        'Y' => "08 25 48|25 22",
        'Z' => "08 48 02 42",
        '.' => "02",
        ',' => "12 01",
        ':' => "02|05",
        ';' => "12 01|15",
        '!' => "08 04|02",
        '?' => "07 18 38 47 46 25 24|22",
        '-' | '–' => "05 35",
        '_' => "01 41",
        '+' => "05 45|23 27",
        '=' => "04 44|06 46",
        '·' => "05",
        '(' => "18 07 03 12",
        ')' => "08 17 13 02",
        '[' => "18 08 02 12",
        ']' => "08 18 12 02",
        '/' => "02 48",
        '\\' => "08 42",
        '%' => "02 48|07|43",
        '\'' => "08 07",
        '"' => "08 07|28 27",
        '<' => "46 05 44",
        '>' => "06 45 04",
        '#' => "04 44|06 46|12 18|32 38",
        '*' => "13 37|17 33|05 45",
        '@' => "33 36 16 14 34 44 47 38 18 07 03 12 42",
        '~' => "04 15 34 45",
        'µ' => "06 00|03 12 32 43|46 42",
        '²' => "08 18 17 06 16",
        '³' => "08 18 16 06|07 17",
        '≥' => "07 45 03|02 42",
        '°' => "08 18 17 07 08",
        '×' => "03 36|06 33",
        '→' => "05 45|36 45 34",
        'δ' => "47 38 18 17 36 45 43 32 12 03 05 16 36",
        _ => UNKNOWN,
    }
}

/// Returns the lines of a letter in grid steps, relative to its place on the baseline.
fn lines(letter: char) -> Vec<Vec<(f64, f64)>> {
    let place = |pair: &str| {
        let digit = |k: usize| f64::from(pair.as_bytes()[k] - b'0');
        (digit(0), digit(1) - BASELINE)
    };
    strokes(letter).split('|').map(|line| line.split(' ').map(place).collect()).collect()
}

/// Returns the grid steps from a letter to the next.
fn advance(letter: char) -> f64 {
    if letter == ' ' {
        return SPACE + GAP;
    }
    lines(letter).iter().flatten().map(|place| place.0).fold(0.0, f64::max) + GAP
}

/// Returns the width of a text in pixels, if its capitals are `size` pixels high.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(advance).sum::<f64>() * size / CAPITAL
}

/// Place and style of a text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    /// Pixels from the left edge to the first letter.
    pub(crate) x: f64,
    /// Pixels from the upper edge to the baseline.
    pub(crate) y: f64,
    /// Height of capitals, pixels.
    pub(crate) size: f64,
    pub(crate) colour: Rgb,
    /// Colour around the letters, so that they are legible on any background.
    pub(crate) halo: Rgb,
}

/// Writes a text on a picture.
pub(crate) fn write(picture: &mut Picture, text: &str, setting: &Setting) {
    let step = setting.size / CAPITAL;
    let mut pen = setting.x;
    let (mut segments, mut dots) = (Vec::new(), Vec::new());
    for letter in text.chars() {
        if letter != ' ' {
            for line in lines(letter) {
                let at = |k: usize| (pen + line[k].0 * step, setting.y - line[k].1 * step);
                segments.extend((1..line.len()).map(|k| (at(k - 1), at(k))));
                dots.extend((line.len() == 1).then(|| (at(0), at(0))));
            }
        }
        pen += advance(letter) * step;
    }
    let all = [&segments[..], &dots[..]].concat();
    draw(picture, &all, HALO * step, setting.halo, HALO_STRENGTH);
    draw(picture, &segments, STROKE * step, setting.colour, 1.0);
    draw(picture, &dots, DOT * step, setting.colour, 1.0);
}

/// Draws a filled circle, as used in a legend.
pub(crate) fn disc(picture: &mut Picture, x: f64, y: f64, radius: f64, colour: Rgb) {
    draw(picture, &[((x, y), (x, y))], radius, colour, 1.0);
}

/// Draws a polyline; each pixel is covered once.
pub(crate) fn line(picture: &mut Picture, points: &[(f64, f64)], radius: f64, colour: Rgb) {
    let parts: Vec<Segment> = points.windows(2).map(|pair| (pair[0], pair[1])).collect();
    draw(picture, &parts, radius, colour, 1.0);
}

/// Draws several line segments; each pixel is covered once.
pub(crate) fn rules(picture: &mut Picture, parts: &[Segment], radius: f64, colour: Rgb, strength: f64) {
    draw(picture, parts, radius, colour, strength);
}

/// Draws a line segment.
pub(crate) fn rule(picture: &mut Picture, from: (f64, f64), to: (f64, f64), radius: f64, colour: Rgb) {
    draw(picture, &[(from, to)], radius, colour, 1.0);
}

/// Ends of the segment, pixels.
pub(crate) type Segment = ((f64, f64), (f64, f64));

/// Covers the pixels within `radius` of any of the segments, each once.
fn draw(picture: &mut Picture, segments: &[Segment], radius: f64, colour: Rgb, strength: f64) {
    if segments.is_empty() {
        return;
    }
    let reach = radius + 1.0;
    let bounds = |pick: fn(&Segment) -> [f64; 2], end: usize| {
        let ends = segments.iter().flat_map(pick);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        ((low - reach).floor() as usize).min(end)..((high + reach).ceil().max(0.0) as usize).min(end)
    };
    let columns = bounds(|s| [s.0.0, s.1.0], picture.width());
    let rows = bounds(|s| [s.0.1, s.1.1], picture.height());
    let ink = linear(colour);
    let wide = columns.len();
    let mut cover = vec![0.0f64; wide * rows.len()];
    for &((ax, ay), (bx, by)) in segments {
        let inside = |low: f64, high: f64, range: &std::ops::Range<usize>| {
            ((low.min(high) - reach).floor() as usize).clamp(range.start, range.end)
                ..((low.max(high) + reach).ceil().max(0.0) as usize).clamp(range.start, range.end)
        };
        for y in inside(ay, by, &rows) {
            for x in inside(ax, bx, &columns) {
                let (px, py) = (x as f64 + 0.5 - ax, y as f64 + 0.5 - ay);
                let (dx, dy) = (bx - ax, by - ay);
                let squared = dx * dx + dy * dy;
                let part = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
                let distance = (px - dx * part).hypot(py - dy * part);
                let slot = &mut cover[(y - rows.start) * wide + (x - columns.start)];
                *slot = slot.max((radius + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }
    for (row, y) in cover.chunks_exact(wide.max(1)).zip(rows) {
        for (part, x) in row.iter().zip(columns.clone()).filter(|(part, _)| **part > 0.0) {
            let under: DVec3 = linear(picture.pixel(x, y));
            picture.set_pixel(x, y, encoded(under.lerp(ink, part * strength)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_used_letter_exists_within_the_grid() {
        for letter in (33u8..127).map(char::from).filter(|c| !"$&^`{|}".contains(*c)).chain("µ°×·→–²³≥".chars())
        {
            assert_ne!(strokes(letter), UNKNOWN, "{letter}");
            for (x, y) in lines(letter).into_iter().flatten() {
                assert!((0.0..=4.0).contains(&x) && (-2.0..=6.0).contains(&y), "{letter}: {x} {y}");
            }
        }
    }

    #[test]
    fn words_are_drawn_only_at_their_place() {
        let mut picture = Picture::new(200, 40, [255; 3]);
        let setting = Setting { x: 10.0, y: 30.0, size: 18.0, colour: [0; 3], halo: [255; 3] };
        write(&mut picture, "Wrench", &setting);
        let end = 10.0 + width("Wrench", 18.0);
        let inked: Vec<(usize, usize)> = (0..40)
            .flat_map(|y| (0..200).map(move |x| (x, y)))
            .filter(|&(x, y)| picture.pixel(x, y) != [255; 3])
            .collect();
        assert!(inked.len() > 200, "{}", inked.len());
        assert!(inked.iter().all(|&(x, y)| x >= 7 && (x as f64) < end && (9..34).contains(&y)));
    }

    #[test]
    fn text_outside_the_picture_is_clipped() {
        let mut picture = Picture::new(20, 20, [255; 3]);
        let setting = Setting { x: -30.0, y: 5.0, size: 30.0, colour: [0; 3], halo: [255; 3] };
        write(&mut picture, "far too long for it", &setting);
        disc(&mut picture, 500.0, -500.0, 20.0, [0; 3]);
    }
}
