//! Pictures as PNG files with eight bits for each channel.

use std::io::{self, Write};

use png::{BitDepth, ColorType, Compression, Encoder, Filter};

/// Writes `pixels` row by row from the top; each pixel is red, green and blue.
pub(crate) fn write_png(out: impl Write, width: u32, height: u32, pixels: &[u8]) -> io::Result<()> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Rgb);
    // Shading is smooth, so differences to the row above are small numbers.
    encoder.set_filter(Filter::Up);
    finish(encoder, pixels)
}

/// Writes a picture of few colours. `palette` has red, green and blue of each colour, and `indices`
/// has an index for every pixel.
pub(crate) fn write_indexed_png(
    out: impl Write,
    width: u32,
    height: u32,
    palette: &[u8],
    indices: &[u8],
) -> io::Result<()> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_palette(palette);
    encoder.set_compression(Compression::High);
    // No filter: differences of palette indices have no meaning.
    encoder.set_filter(Filter::NoFilter);
    finish(encoder, indices)
}

fn finish(mut encoder: Encoder<'_, impl Write>, pixels: &[u8]) -> io::Result<()> {
    encoder.set_depth(BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// Reads width, height and the colours (red, green, blue) of every pixel of a PNG file.
    fn read(file: Vec<u8>) -> (u32, u32, Vec<u8>) {
        let mut decoder = png::Decoder::new(Cursor::new(file));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("the file has a header");
        let mut pixels = vec![0; reader.output_buffer_size().expect("the picture is small enough")];
        let frame = reader.next_frame(&mut pixels).expect("the picture can be read");
        (frame.width, frame.height, pixels)
    }

    #[test]
    fn colours_are_read_back() {
        let pixels: Vec<u8> = (0..18).map(|k| k * 13).collect();
        let mut file = Vec::new();
        write_png(&mut file, 3, 2, &pixels).expect("writing to memory succeeds");
        assert_eq!(read(file), (3, 2, pixels));
    }

    #[test]
    fn colours_of_a_palette_are_read_back() {
        let mut file = Vec::new();
        write_indexed_png(&mut file, 2, 2, &[9, 8, 7, 1, 2, 3], &[1, 0, 0, 1]).expect("writing to memory succeeds");
        assert_eq!(read(file), (2, 2, vec![1, 2, 3, 9, 8, 7, 9, 8, 7, 1, 2, 3]));
    }
}
