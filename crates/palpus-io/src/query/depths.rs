//! Writes the results of `palpus depth`.

use std::io::{self, Write};

use palpus::depth::{Containment, DepthBracket};

use crate::table::Line;

/// The columns of a file of depths.
pub const DEPTH_COLUMNS: [&str; 11] =
    ["frame", "lower", "upper", "tx", "ty", "tz", "certified", "contained", "distance", "evaluations", "depth_us"];

/// Writes a file of depths; all lengths are in model units and all vectors in body b's frame.
pub struct DepthWriter<W: Write> {
    out: W,
    line: Line,
}

impl<W: Write> DepthWriter<W> {
    /// Writes the header. `out` should be buffered.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(out, "{}", DEPTH_COLUMNS.join(","))?;
        Ok(Self { out, line: Line::default() })
    }

    /// Writes the result for pose `frame`, whose computation took `depth_us` microseconds.
    ///
    /// The distance is empty if the surfaces intersect. If one body lies inside the other, the
    /// distance is negative and its absolute value is the distance of the surfaces.
    pub fn write(&mut self, frame: u64, answer: &DepthBracket, depth_us: f64) -> io::Result<()> {
        let line = &mut self.line;
        line.clear();
        line.cell(frame);
        line.numbers([answer.lower, answer.upper]);
        line.numbers(answer.translation.to_array());
        line.cell(answer.certified);
        line.cell(containment_number(answer.containment));
        match answer.distance {
            Some(distance) => line.numbers([if answer.upper > 0.0 { -distance } else { distance }]),
            None => line.cell(""),
        }
        line.cell(answer.evaluations);
        line.numbers([depth_us]);
        self.out.write_all(line.end())
    }

    /// Flushes and returns `out`.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Returns the number that files use for a containment: 0 for neither, 1 for a in b, 2 for b in a.
pub fn containment_number(containment: Containment) -> u8 {
    match containment {
        Containment::Neither => 0,
        Containment::AInB => 1,
        Containment::BInA => 2,
    }
}
