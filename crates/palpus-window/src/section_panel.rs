//! A section as a picture without text: the felt depth, the true depth, or their difference.
//!
//! 1. Colours between samples of one kind (felt, unseen, outside) are interpolated. Between kinds
//!    they change abruptly.
//! 2. Contour lines are drawn at round depths in cells whose corners are all of one kind. The
//!    outlines of the pieces on the plane are drawn faintly, and the outline of the mesh too.

use glam::DVec3;
use palpus::body::Body;

use crate::letters;
use crate::paint::round_length;
use crate::picture::{Picture, Rgb};
use crate::scene::Unit;
use crate::section::{Felt, Section};
use crate::style::{Theme, encoded, linear};

/// Quantity that a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Depth that the convex pieces give.
    Felt,
    /// The distance to the surface.
    True,
    /// The true depth minus the felt depth, inside.
    Missing,
}

/// Approximate number of contours up to the largest depth.
const CONTOURS: f64 = 7.0;
/// With more pieces than this, outlines are not drawn, since they would cover the picture.
const MOST_OUTLINED: usize = 300;
/// Width of the stripes, nominal pixels.
const STRIPE: f64 = 5.0;
/// Half the width of the outline of the surface, nominal pixels.
const OUTLINE: f64 = 1.1;
/// Half the width of a contour line, nominal pixels.
const CONTOUR: f64 = 0.55;
/// Half the width of the outline of a piece, nominal pixels.
const PIECE_OUTLINE: f64 = 0.35;
/// Opacity of contour lines.
const CONTOUR_STRENGTH: f64 = 0.65;
/// Opacity of the outlines of pieces.
const PIECE_STRENGTH: f64 = 0.4;
/// Smallest distance between contour lines, pixels.
const CONTOUR_GAP: f64 = 5.0;

/// Colours from shallow to deep: dark blue to yellow, with perceptually uniform steps, also for
/// colour-blind readers (after *viridis*, S. van der Walt and N. Smith, 2015).
const DEPTHS: [Rgb; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [109, 205, 89],
    [180, 222, 44],
    [253, 231, 37],
];
/// Colour of inside points without contact.
pub(crate) const UNSEEN: Rgb = [228, 20, 140];
/// Colours of too small and too large depths.
pub(crate) const LESS: Rgb = [33, 92, 190];
pub(crate) const MORE: Rgb = [200, 40, 30];

/// A section and its body.
#[derive(Clone, Copy, Debug)]
pub struct SectionOf<'a> {
    /// The section.
    pub section: &'a Section,
    /// The body.
    pub body: &'a Body,
    /// Name of the body.
    pub name: &'a str,
    /// Unit of length.
    pub unit: Unit,
}

/// Scale of the colours and of the contour lines, in the body's unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    /// Depth that is shown with the last colour of the scale.
    pub(crate) deepest: f64,
    /// Distance between contour lines.
    pub(crate) step: f64,
}

/// Draws one panel without text, `width` by `height` pixels. `deepest`: depth that is shown with
/// the last colour of the scale.
pub fn paint_section_panel(
    shown: &SectionOf<'_>,
    which: Shown,
    deepest: f64,
    theme: Theme,
    width: usize,
    height: usize,
) -> Picture {
    let step = contour_step(deepest, shown.unit);
    paint_panel(shown, which, &Range { deepest, step }, theme, width, height)
}

/// Returns the distance between contour lines for depths up to `deepest`: a round length.
pub fn contour_step(deepest: f64, unit: Unit) -> f64 {
    round_length(deepest / CONTOURS * STEP_UP, unit).0
}

/// This factor brings the number of contours, after rounding down, close to [`CONTOURS`].
const STEP_UP: f64 = 1.5;

/// Returns the colour of a depth that is the share `part` of the deepest depth.
pub fn depth_colour(part: f64) -> Rgb {
    let at = part.clamp(0.0, 1.0) * (DEPTHS.len() - 1) as f64;
    let k = (at as usize).min(DEPTHS.len() - 2);
    let mix = |i: usize| {
        let (low, high) = (f64::from(DEPTHS[k][i]), f64::from(DEPTHS[k + 1][i]));
        (low + (high - low) * (at - k as f64) + 0.5) as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// Returns the distance between contour lines outside.
pub(crate) fn outside_step(section: &Section, unit: Unit) -> f64 {
    let farthest = section.samples.iter().filter(|felt| !felt.inside && felt.distance.is_finite());
    contour_step(farthest.map(|felt| felt.distance).fold(0.0, f64::max), unit)
}

/// Kind of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Deep,
    Unseen,
    Outside,
}

fn kind(felt: &Felt, closed: bool, which: Shown) -> Kind {
    let inside = if closed { felt.inside } else { felt.depth > 0.0 };
    match which {
        _ if !inside => Kind::Outside,
        Shown::Felt if felt.depth <= 0.0 => Kind::Unseen,
        _ => Kind::Deep,
    }
}

/// Returns the value that colours a sample; outside it is always the distance.
fn value(felt: &Felt, kind: Kind, which: Shown) -> f64 {
    match (kind, which) {
        (Kind::Outside, _) | (_, Shown::True) => felt.distance,
        (_, Shown::Felt) => felt.depth,
        (_, Shown::Missing) => felt.distance - felt.depth,
    }
}

pub(crate) fn paint_panel(
    shown: &SectionOf<'_>,
    which: Shown,
    range: &Range,
    theme: Theme,
    width: usize,
    height: usize,
) -> Picture {
    let section = shown.section;
    let colours = theme.colours();
    let mut picture = Picture::new(width, height, colours.below);
    let pixel = (width as f64 / section.columns as f64).min(height as f64 / section.rows as f64);
    let scale = (height as f64).max(width as f64) / NOMINAL_SIDE;
    let stripe = (STRIPE * scale).max(2.0);
    let size = section.cell * section.columns.max(section.rows) as f64;
    for y in 0..height {
        for x in 0..width {
            let at = [(x as f64 + 0.5) / pixel - 0.5, (height as f64 - y as f64 - 0.5) / pixel - 0.5];
            let Some((kind, value)) = mixed(section, at, which) else { continue };
            let part = value / range.deepest.max(f64::MIN_POSITIVE);
            let colour = match kind {
                Kind::Outside => outside_colour(theme, value / size),
                Kind::Unseen if (((x as f64 + y as f64) / stripe) as usize).is_multiple_of(2) => UNSEEN,
                Kind::Unseen => depth_colour(0.0),
                Kind::Deep if which == Shown::Missing => missing_colour(theme, part),
                Kind::Deep => depth_colour(part),
            };
            picture.set_pixel(x, y, colour);
        }
    }
    let place = |[u, v]: [f64; 2]| {
        let (i, j) = ((u - section.low[0]) / section.cell + 0.5, (v - section.low[1]) / section.cell + 0.5);
        (i * pixel, height as f64 - j * pixel)
    };
    let lines = |lines: &[[[f64; 2]; 2]]| lines.iter().map(|[a, b]| (place(*a), place(*b))).collect::<Vec<_>>();
    if which != Shown::Missing {
        let beyond = outside_step(section, shown.unit);
        for (kind, colour, step) in [(Kind::Outside, colours.faint, beyond), (Kind::Deep, colours.outline, range.step)]
        {
            if step / section.cell * pixel < CONTOUR_GAP {
                continue;
            }
            let found = contours(section, which, kind, step);
            letters::rules(&mut picture, &lines(&found), CONTOUR * scale, colour, CONTOUR_STRENGTH);
        }
    }
    if which == Shown::Felt {
        let found = cut_pieces(shown);
        letters::rules(&mut picture, &lines(&found), PIECE_OUTLINE * scale, [255; 3], PIECE_STRENGTH);
    }
    let mesh = shown.body.mesh();
    let triangles = (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t).to_vec());
    let outline = section.plane.cut(triangles);
    letters::rules(&mut picture, &lines(&outline), OUTLINE * scale, colours.ink, 1.0);
    picture
}

/// Side of a panel for which line widths are stated, pixels.
const NOMINAL_SIDE: f64 = 420.0;

/// Returns the kind of the nearest sample to a position on the grid, and the mean value of the
/// neighbouring samples of this kind.
fn mixed(section: &Section, at: [f64; 2], which: Shown) -> Option<(Kind, f64)> {
    let sample = |column: f64, row: f64| {
        let column = column.clamp(0.0, (section.columns - 1) as f64) as usize;
        let row = row.clamp(0.0, (section.rows - 1) as f64) as usize;
        section.at(column, row)
    };
    let of = |felt: &Felt| kind(felt, section.closed, which);
    let own = of(sample(at[0].round(), at[1].round())?);
    let (column, row) = (at[0].floor(), at[1].floor());
    let (u, v) = (at[0] - column, at[1] - row);
    let (mut sum, mut weight) = (0.0, 0.0);
    for (i, j, part) in
        [(0.0, 0.0, (1.0 - u) * (1.0 - v)), (1.0, 0.0, u * (1.0 - v)), (0.0, 1.0, (1.0 - u) * v), (1.0, 1.0, u * v)]
    {
        if let Some(felt) = sample(column + i, row + j).filter(|felt| of(felt) == own) {
            sum += part * value(felt, own, which);
            weight += part;
        }
    }
    Some((own, if weight > 0.0 { sum / weight } else { 0.0 }))
}

/// Returns a colour that is paler with the distance, given as the share `part` of the picture's
/// size.
pub(crate) fn outside_colour(theme: Theme, part: f64) -> Rgb {
    let (near, far) = match theme {
        Theme::Light => ([206, 214, 222], [250, 251, 252]),
        Theme::Dark => ([66, 74, 84], [22, 25, 31]),
    };
    encoded(linear(near).lerp(linear(far), (3.0 * part).clamp(0.0, 1.0)))
}

/// Returns the colour of a missing depth, by its share of the deepest depth. From a fifth on, the
/// colour is fully saturated.
fn missing_colour(theme: Theme, part: f64) -> Rgb {
    let none = match theme {
        Theme::Light => [246, 246, 246],
        Theme::Dark => [52, 54, 58],
    };
    let full = if part > 0.0 { LESS } else { MORE };
    encoded(linear(none).lerp(linear(full), (part.abs() / FULLY_MISSING).min(1.0)))
}

/// Share of the deepest depth from which a missing depth is fully saturated.
const FULLY_MISSING: f64 = 0.2;

/// Draws contour lines at the multiples of the step, by marching squares over cells whose corners
/// are all of one kind.
fn contours(section: &Section, which: Shown, wanted: Kind, step: f64) -> Vec<[[f64; 2]; 2]> {
    let mut lines = Vec::new();
    let corner = |column: usize, row: usize| {
        let felt = section.at(column, row)?;
        let kind = kind(felt, section.closed, which);
        (kind == wanted).then(|| {
            let p = [section.low[0] + column as f64 * section.cell, section.low[1] + row as f64 * section.cell];
            (p, value(felt, kind, which))
        })
    };
    for row in 1..section.rows {
        for column in 1..section.columns {
            let around = [(column - 1, row - 1), (column, row - 1), (column, row), (column - 1, row)];
            let [Some(a), Some(b), Some(c), Some(d)] = around.map(|(column, row)| corner(column, row)) else {
                continue;
            };
            // Each cell is divided into two triangles, so that its contour lines are unambiguous.
            for triangle in [[a, b, c], [a, c, d]] {
                cross_levels(&triangle, step, &mut lines);
            }
        }
    }
    lines
}

fn cross_levels(triangle: &[([f64; 2], f64); 3], step: f64, lines: &mut Vec<[[f64; 2]; 2]>) {
    let values = triangle.map(|corner| corner.1);
    let (low, high) = (values[0].min(values[1]).min(values[2]), values[0].max(values[1]).max(values[2]));
    let (first, last) = ((low / step).ceil().max(1.0), (high / step).floor());
    if !(last - first).is_finite() || last - first > MOST_LEVELS {
        return;
    }
    let mut k = first;
    while k <= last {
        let level = k * step;
        let mut ends = Vec::new();
        for (i, (from, value)) in triangle.iter().enumerate() {
            let (to, next) = &triangle[(i + 1) % 3];
            if (*value < level) != (*next < level) {
                let part = (level - value) / (next - value);
                ends.push([from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]);
            }
        }
        if let [a, b] = ends[..] {
            lines.push([a, b]);
        }
        k += 1.0;
    }
}

/// A cell that is crossed by more levels than this is a discontinuity and gets no lines.
const MOST_LEVELS: f64 = 50.0;

/// Returns the outlines of the pieces on the plane, unless there are too many.
fn cut_pieces(shown: &SectionOf<'_>) -> Vec<[[f64; 2]; 2]> {
    let (plane, across) = (&shown.section.plane, shown.section.plane.axis.coordinates()[0]);
    let is_cut = |vertices: &[DVec3]| {
        vertices.iter().any(|v| v[across] < plane.offset) && vertices.iter().any(|v| v[across] >= plane.offset)
    };
    let met: Vec<_> = shown.body.polytopes().iter().filter(|piece| is_cut(piece.vertices())).collect();
    if met.len() > MOST_OUTLINED {
        return Vec::new();
    }
    let faces = met.into_iter().flat_map(|piece| {
        let loops = (0..piece.face_count() as u32).filter(|&f| !piece.is_rim(f));
        loops.map(|f| piece.face_vertices(f).iter().map(|v| piece.vertex(v)).collect::<Vec<DVec3>>())
    });
    plane.cut(faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_has_a_contour_line_for_every_level() {
        let triangle = [([0.0, 0.0], 0.0), ([1.0, 0.0], 3.5), ([0.0, 1.0], 0.0)];
        let mut lines = Vec::new();
        cross_levels(&triangle, 1.0, &mut lines);
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().zip([1.0, 2.0, 3.0]).all(|([a, _], level)| (a[0] * 3.5 - level).abs() < 1e-12));
    }
}
