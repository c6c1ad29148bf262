//! A picture of pixels.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::png::write_png;

/// Red, green and blue, sRGB.
pub type Rgb = [u8; 3];

/// A picture, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    /// Creates a picture of one colour.
    pub fn new(width: usize, height: usize, colour: Rgb) -> Self {
        Self { width, height, pixels: colour.repeat(width * height) }
    }

    /// Returns the number of pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the colour of the pixel in column `x` of row `y`; both within the picture.
    pub fn pixel(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Colours the pixel in column `x` of row `y`; both within the picture.
    pub fn set_pixel(&mut self, x: usize, y: usize, colour: Rgb) {
        let at = 3 * (y * self.width + x);
        self.pixels[at..at + 3].copy_from_slice(&colour);
    }

    /// Draws another picture over this one, with its upper left corner at column `x` of row `y`.
    /// Parts outside are cut off.
    pub(crate) fn put(&mut self, other: &Self, x: usize, y: usize) {
        let wide = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let (to, from) = (3 * ((y + row) * self.width + x), 3 * row * other.width);
            self.pixels[to..to + 3 * wide].copy_from_slice(&other.pixels[from..from + 3 * wide]);
        }
    }

    /// Returns red, green and blue of every pixel.
    pub fn bytes(&self) -> &[u8] {
        &self.pixels
    }

    /// Writes the picture as a PNG file.
    pub fn write_png(&self, path: &Path) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        write_png(&mut file, self.width as u32, self.height as u32, &self.pixels)?;
        file.flush()
    }
}
