//! PNG (ISO/IEC 15948), as much of it as a picture of eight bits a channel needs: one header, one deflated stream, the end.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];
/// Bits a channel, true colour, deflate, adaptive filters, not interlaced.
const KIND: [u8; 5] = [8, 2, 0, 0, 0];
/// The same, with a number in a palette instead of a colour.
const INDEXED: [u8; 5] = [8, 3, 0, 0, 0];
const FILTER_NONE: u8 = 0;
/// Every row is stored as differences to the row above: smooth shading becomes small numbers.
const FILTER_UP: u8 = 2;

/// Writes `pixels`, row by row from the top, red, green and blue of each.
pub(crate) fn write_png(out: &mut impl Write, width: u32, height: u32, pixels: &[u8]) -> io::Result<()> {
    out.write_all(&SIGNATURE)?;
    let mut header = Vec::with_capacity(13);
    header.extend_from_slice(&width.to_be_bytes());
    header.extend_from_slice(&height.to_be_bytes());
    header.extend_from_slice(&KIND);
    write_chunk(out, *b"IHDR", &header)?;
    write_chunk(out, *b"IDAT", &deflated(width as usize * 3, pixels)?)?;
    write_chunk(out, *b"IEND", &[])
}

/// Writes a picture of few colours: `palette` has red, green and blue of each, `indices` names one for every pixel.
pub(crate) fn write_indexed_png(
    out: &mut impl Write,
    width: u32,
    height: u32,
    palette: &[u8],
    indices: &[u8],
) -> io::Result<()> {
    out.write_all(&SIGNATURE)?;
    let mut header = Vec::with_capacity(13);
    header.extend_from_slice(&width.to_be_bytes());
    header.extend_from_slice(&height.to_be_bytes());
    header.extend_from_slice(&INDEXED);
    write_chunk(out, *b"IHDR", &header)?;
    write_chunk(out, *b"PLTE", palette)?;
    let mut stream = ZlibEncoder::new(Vec::new(), Compression::best());
    for row in indices.chunks_exact((width as usize).max(1)) {
        // Differences of numbers mean nothing.
        stream.write_all(&[FILTER_NONE])?;
        stream.write_all(row)?;
    }
    write_chunk(out, *b"IDAT", &stream.finish()?)?;
    write_chunk(out, *b"IEND", &[])
}

fn deflated(row_length: usize, pixels: &[u8]) -> io::Result<Vec<u8>> {
    let mut stream = ZlibEncoder::new(Vec::new(), Compression::default());
    let mut above = vec![0; row_length];
    let mut filtered = vec![0; row_length];
    for row in pixels.chunks_exact(row_length.max(1)) {
        for ((out, now), up) in filtered.iter_mut().zip(row).zip(&above) {
            *out = now.wrapping_sub(*up);
        }
        stream.write_all(&[FILTER_UP])?;
        stream.write_all(&filtered)?;
        above.copy_from_slice(row);
    }
    stream.finish()
}

/// Length, name, content, and the checksum of the last two.
fn write_chunk(out: &mut impl Write, name: [u8; 4], content: &[u8]) -> io::Result<()> {
    let length = u32::try_from(content.len()).map_err(|_| io::Error::other("a picture too large for PNG"))?;
    let mut checksum = flate2::Crc::new();
    checksum.update(&name);
    checksum.update(content);
    out.write_all(&length.to_be_bytes())?;
    out.write_all(&name)?;
    out.write_all(content)?;
    out.write_all(&checksum.sum().to_be_bytes())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    /// Reads back what was written, by the standard and by nothing of this file but its constants.
    #[test]
    fn what_is_written_is_read_back() {
        let (width, height) = (3, 2);
        let pixels: Vec<u8> = (0..18).map(|k| k * 13).collect();
        let mut file = Vec::new();
        write_png(&mut file, width, height, &pixels).expect("memory takes all");
        assert_eq!(file[..8], [137, 80, 78, 71, 13, 10, 26, 10]);
        let mut chunks = Vec::new();
        let mut rest = &file[8..];
        while !rest.is_empty() {
            let length = u32::from_be_bytes(rest[..4].try_into().expect("four bytes")) as usize;
            let sum = u32::from_be_bytes(rest[8 + length..12 + length].try_into().expect("four bytes"));
            assert_eq!(crc(&rest[4..8 + length]), sum);
            chunks.push((rest[4..8].to_vec(), rest[8..8 + length].to_vec()));
            rest = &rest[12 + length..];
        }
        assert_eq!(chunks.iter().map(|c| c.0.as_slice()).collect::<Vec<_>>(), [b"IHDR", b"IDAT", b"IEND"]);
        assert_eq!(chunks[0].1, [0, 0, 0, 3, 0, 0, 0, 2, 8, 2, 0, 0, 0]);
        let mut raw = Vec::new();
        flate2::read::ZlibDecoder::new(&chunks[1].1[..]).read_to_end(&mut raw).expect("a zlib stream");
        let (first, second) = raw.split_at(10);
        assert_eq!((first[0], second[0]), (2, 2));
        assert_eq!(first[1..], pixels[..9]);
        let up: Vec<u8> = second[1..].iter().zip(&pixels[..9]).map(|(d, p)| d.wrapping_add(*p)).collect();
        assert_eq!(up, pixels[9..]);
    }

    /// Bit by bit, as the standard defines it.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |sum, byte| {
            (0..8).fold(sum ^ u32::from(*byte), |s, _| if s & 1 == 1 { 0xedb8_8320 ^ (s >> 1) } else { s >> 1 })
        })
    }
}
