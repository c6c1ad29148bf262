//! Convex pieces (or any polygons) to OBJ, one group each, for use in other programs.

use std::io::{self, Write};

use palpus::body::PolygonSoup;

/// Writes each soup as a group of one OBJ file; numbers are the shortest that read back as the same
/// double.
///
/// Groups come one at a time, so that ten thousand pieces need no memory; `out` should be buffered.
/// White space and control characters in names become `_`. Errors are those of `out`.
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
