//! Writes convex pieces (or any polygons) as OBJ, one group for each piece, for use in other
//! programs.

use std::io::{self, Write};

use palpus::body::PolygonSoup;

/// Writes each soup as a group of one OBJ file. Numbers are written with the fewest digits that
/// read back as the same double.
///
/// The groups are an iterator, so that ten thousand pieces are never in memory at the same time.
/// `out` should be buffered. White space and control characters in names are replaced by `_`. Fails
/// if writing to `out` fails.
pub fn write_obj_groups<W: Write, N: AsRef<str>>(
    mut out: W,
    groups: impl IntoIterator<Item = (N, PolygonSoup)>,
) -> io::Result<()> {
    let mut first = 1;
    for (name, soup) in groups {
        let name: String =
            name.as_ref().chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
        writeln!(out, "g {name}")?;
        for v in &soup.vertices {
            writeln!(out, "v {:?} {:?} {:?}", v.x, v.y, v.z)?;
        }
        for face in 0..soup.face_count() {
            write!(out, "f")?;
            for &corner in soup.face(face) {
                write!(out, " {}", first + u64::from(corner))?;
            }
            writeln!(out)?;
        }
        first += soup.vertices.len() as u64;
    }
    out.flush()
}
