//! A page with a title, a caption, flat drawings between margins, and a legend below.

use crate::letters::{self, Setting};
use crate::marks::NOMINAL_HEIGHT;
use crate::picture::{Picture, Rgb};
use crate::style::{Colours, Style};

/// Distance of the text from the edges, nominal pixels.
const MARGIN: f64 = 22.0;
/// Size of the letters of the title, nominal pixels.
const TITLE_SIZE: f64 = 19.0;
/// Size of the other letters, nominal pixels.
pub(crate) const WORD_SIZE: f64 = 13.0;
/// Height of the head (title and caption), nominal pixels.
const HEAD: f64 = 98.0;
/// Distance between two lines of the caption, nominal pixels.
const LINE: f64 = 1.7 * WORD_SIZE;
/// Height of the legend, nominal pixels.
const FOOT: f64 = 46.0;

/// A part of a page, pixels: left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Area {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Area {
    /// Returns the part between two shares of the width (`across`) and of the height (`down`), with
    /// `gap` pixels left free on all sides.
    pub(crate) fn part(&self, across: [f64; 2], down: [f64; 2], gap: f64) -> Self {
        Self {
            x: self.x + across[0] * self.width + gap,
            y: self.y + down[0] * self.height + gap,
            width: ((across[1] - across[0]) * self.width - 2.0 * gap).max(1.0),
            height: ((down[1] - down[0]) * self.height - 2.0 * gap).max(1.0),
        }
    }

    /// Returns whole pixels: column, row, width, height.
    pub(crate) fn pixels(&self) -> [usize; 4] {
        let to = |end: f64, from: usize| (end as usize).saturating_sub(from).max(1);
        let (x, y) = (self.x as usize, self.y as usize);
        [x, y, to(self.x + self.width, x), to(self.y + self.height, y)]
    }
}

/// The page during drawing.
pub(crate) struct Sheet {
    pub(crate) picture: Picture,
    pub(crate) colours: Colours,
    /// Pixels for each nominal pixel.
    pub(crate) scale: f64,
    pub(crate) words: bool,
}

impl Sheet {
    /// Creates an empty page with its title and caption.
    pub(crate) fn new(width: usize, height: usize, style: &Style, title: &str, caption: &[String]) -> Self {
        let colours = style.theme.colours();
        // In narrow pages, the width limits the size of the text.
        let scale = (height as f64 / NOMINAL_HEIGHT).min(width as f64 / NOMINAL_WIDTH);
        let mut sheet =
            Self { picture: Picture::new(width, height, colours.above), colours, scale, words: style.words };
        let margin = MARGIN * scale;
        sheet.write(title, margin, margin + TITLE_SIZE * scale, TITLE_SIZE, colours.ink);
        let below = margin + (TITLE_SIZE + 2.2 * WORD_SIZE) * scale;
        for (k, line) in caption.iter().enumerate() {
            sheet.write(line, margin, below + k as f64 * LINE * scale, WORD_SIZE, colours.ink);
        }
        sheet
    }

    /// Returns the free area between the texts above and below.
    pub(crate) fn area(&self) -> Area {
        let (head, foot) = if self.words { (HEAD * self.scale, FOOT * self.scale) } else { (0.0, 0.0) };
        let (width, height) = (self.picture.width() as f64, self.picture.height() as f64);
        Area { x: 0.0, y: head, width, height: (height - head - foot).max(1.0) }
    }

    /// Writes to the right from `x` on the baseline `y`, pixels; `size` is nominal.
    pub(crate) fn write(&mut self, text: &str, x: f64, y: f64, size: f64, colour: Rgb) {
        if self.words {
            let setting = Setting { x, y, size: size * self.scale, colour, halo: self.colours.above };
            letters::write(&mut self.picture, text, &setting);
        }
    }

    /// Writes with `x` in the middle of the text.
    pub(crate) fn write_about(&mut self, text: &str, x: f64, y: f64, size: f64, colour: Rgb) {
        let half = 0.5 * letters::width(text, size * self.scale);
        self.write(text, x - half, y, size, colour);
    }

    /// Writes the legend at the bottom; a hollow mark is a ring.
    pub(crate) fn legend(&mut self, rows: &[(Rgb, bool, &str)]) {
        if !self.words {
            return;
        }
        let margin = MARGIN * self.scale;
        let (last, radius) = (self.picture.height() as f64 - margin, 0.45 * WORD_SIZE * self.scale);
        let mut x = margin;
        for &(colour, hollow, meaning) in rows {
            letters::disc(&mut self.picture, x + radius, last - radius, radius, colour);
            if hollow {
                letters::disc(&mut self.picture, x + radius, last - radius, 0.55 * radius, self.colours.above);
            }
            x += 3.0 * radius;
            self.write(meaning, x, last, WORD_SIZE, self.colours.faint);
            x += letters::width(meaning, WORD_SIZE * self.scale) + 1.4 * WORD_SIZE * self.scale;
        }
    }
}

/// The width of a page for which sizes are stated.
const NOMINAL_WIDTH: f64 = 1280.0;
