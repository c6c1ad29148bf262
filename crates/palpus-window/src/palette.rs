//! Pictures with at most 256 colours: a third of the size, for pages that are sent by mail.
//!
//! 1. The colours are counted.
//! 2. The box of colours with the largest weight (squared length times the cube root of its
//!    number of pixels) is divided in the middle of its longest side, until there are enough boxes.
//!    *Median cut* (Heckbert 1982) halves the number of pixels instead, which leaves rare colours
//!    in large boxes.
//! 3. The mean of a box replaces its colours. There is no dithering, because it would make the file
//!    as large as a file without a palette.

use std::io;

use crate::picture::Picture;
use crate::png::write_indexed_png;

/// Number of colours that a byte can index.
const COLOURS: usize = 256;

impl Picture {
    /// Returns the picture as a PNG file of at most 256 colours, in memory.
    pub fn small_png(&self) -> io::Result<Vec<u8>> {
        let (palette, indices) = reduced(self.bytes());
        let mut file = Vec::new();
        write_indexed_png(&mut file, self.width() as u32, self.height() as u32, &palette, &indices)?;
        Ok(file)
    }
}

/// A colour, and its number of pixels.
#[derive(Clone, Copy, Debug)]
struct Counted {
    colour: [u8; 3],
    count: u64,
}

/// Returns the palette (red, green and blue of each colour) and the colour index of each pixel.
fn reduced(pixels: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let (pixels, _) = pixels.as_chunks::<3>();
    let mut sorted = pixels.to_vec();
    sorted.sort_unstable();
    let counted = |run: &[[u8; 3]]| Counted { colour: run[0], count: run.len() as u64 };
    let all: Vec<Counted> = sorted.chunk_by(|a, b| a == b).map(counted).collect();
    let mut numbers: Vec<([u8; 3], u8)> = Vec::with_capacity(all.len());
    let mut palette = Vec::new();
    for (k, colours) in boxes(all).iter().enumerate() {
        let count: u64 = colours.iter().map(|one| one.count).sum();
        let sum = |channel: usize| colours.iter().map(|one| one.count * u64::from(one.colour[channel])).sum::<u64>();
        palette.extend([0, 1, 2].map(|channel| ((sum(channel) + count / 2) / count.max(1)) as u8));
        numbers.extend(colours.iter().map(|one| (one.colour, k as u8)));
    }
    numbers.sort_unstable();
    let number = |pixel: &[u8; 3]| {
        let place = numbers.binary_search_by(|known| known.0.cmp(pixel));
        // Every pixel's colour was counted.
        place.map_or(0, |place| numbers[place].1)
    };
    (palette, pixels.iter().map(number).collect())
}

/// Returns the longest side of the box around all colours: its channel, and its smallest and
/// largest value.
fn longest(colours: &[Counted]) -> (usize, [u8; 2]) {
    let side = |channel: usize| {
        let values = colours.iter().map(|one| one.colour[channel]);
        (channel, values.fold([u8::MAX, 0], |[low, high], value| [low.min(value), high.max(value)]))
    };
    [1, 2]
        .into_iter()
        .map(side)
        .fold(side(0), |best, other| if length(other.1) > length(best.1) { other } else { best })
}

fn length([low, high]: [u8; 2]) -> u8 {
    high.saturating_sub(low)
}

fn boxes(all: Vec<Counted>) -> Vec<Vec<Counted>> {
    let weight = |colours: &[Counted]| {
        let count: u64 = colours.iter().map(|one| one.count).sum();
        // The cube root keeps wide boxes of few pixels important, since a dot has few pixels.
        f64::from(length(longest(colours).1)).powi(2) * (count as f64).cbrt()
    };
    let mut boxes = vec![(weight(&all), all)];
    while boxes.len() < COLOURS {
        let widest = (0..boxes.len()).max_by(|j, k| boxes[*j].0.total_cmp(&boxes[*k].0));
        let Some(widest) = widest.filter(|k| boxes[*k].0 > 0.0) else { break };
        let colours = std::mem::take(&mut boxes[widest].1);
        let (channel, [low, high]) = longest(&colours);
        let middle = low.midpoint(high);
        let (lower, upper): (Vec<_>, Vec<_>) = colours.into_iter().partition(|one| one.colour[channel] <= middle);
        boxes[widest] = (weight(&lower), lower);
        boxes.push((weight(&upper), upper));
    }
    boxes.into_iter().map(|(_, colours)| colours).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept_exactly() {
        let colours = [[0, 0, 0], [250, 10, 10], [10, 250, 10], [128, 128, 128]];
        let pixels: Vec<u8> = (0..100).flat_map(|k| colours[k * k % 4]).collect();
        let (palette, indices) = reduced(&pixels);
        assert!(palette.len() <= 4 * 3);
        let again: Vec<u8> = indices.iter().flat_map(|k| palette[3 * usize::from(*k)..][..3].to_vec()).collect();
        assert_eq!(again, pixels);
    }

    #[test]
    fn many_colours_are_approximated_and_rare_ones_kept() {
        let mut pixels: Vec<u8> = (0..90_000u32).flat_map(|k| [(k % 200) as u8, (k / 450) as u8, 120]).collect();
        pixels[300..303].copy_from_slice(&[255, 0, 0]);
        let (palette, indices) = reduced(&pixels);
        assert_eq!(palette.len(), COLOURS * 3);
        let near = |pixel: &[u8], k: u8| {
            let colour = &palette[3 * usize::from(k)..][..3];
            pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(*b) < 16)
        };
        assert!(pixels.chunks_exact(3).zip(&indices).all(|(pixel, k)| near(pixel, *k)));
        assert!(reduced(&[]).1.is_empty());
    }
}
