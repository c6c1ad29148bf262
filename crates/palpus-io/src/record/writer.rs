//! Writes a recording, line by line.

use std::io::{self, Write};

use palpus::render::Settings;

use super::change::{self, Pending};
use super::{COLUMNS, FORMAT, RecordRow, RecordingHeader};
use crate::table::Line;

/// Writes a recording to any stream. Not for the servo thread: it allocates and waits for the stream.
pub struct RecordingWriter<W: Write> {
    out: W,
    line: Line,
    pending: Pending,
}

impl<W: Write> RecordingWriter<W> {
    /// Writes the header and flushes it. `out` should be buffered. Errors are those of `out`, or a header that TOML
    /// cannot hold (a very large integer in `more`).
    pub fn new(mut out: W, header: &RecordingHeader) -> io::Result<Self> {
        let toml = toml::to_string(header).map_err(io::Error::other)?;
        let mut text = format!("# format = {FORMAT}\n");
        for line in toml.lines() {
            text.push('#');
            if !line.is_empty() {
                text.push(' ');
                text.push_str(line);
            }
            text.push('\n');
        }
        text.push_str(&COLUMNS.join(","));
        text.push('\n');
        out.write_all(text.as_bytes())?;
        out.flush()?;
        Ok(Self { out, line: Line::default(), pending: Pending::default() })
    }

    /// The engine was told other settings between two ticks: those from tick `tick` on are stepped with them. Written before the next row
    /// from there on, and not at all when none follows; of several before the same tick, only the last.
    pub fn change(&mut self, tick: u64, settings: &Settings) {
        self.pending.add(tick, settings);
    }

    /// Writes one tick as one whole line.
    pub fn write(&mut self, row: &RecordRow) -> io::Result<()> {
        for (tick, settings) in self.pending.before(row.tick) {
            writeln!(self.out, "# {}", change::write(tick, &settings)?)?;
        }
        let line = &mut self.line;
        line.clear();
        line.cell(row.tick);
        line.cell(row.time_ns);
        line.numbers([row.dt]);
        line.numbers(row.pose.translation.to_array());
        line.numbers(row.pose.rotation.to_array());
        line.numbers([row.twist.angular, row.twist.linear].iter().flat_map(|v| v.to_array()));
        line.cell(row.buttons);
        line.numbers([row.wrench.torque, row.wrench.force].iter().flat_map(|v| v.to_array()));
        line.cell(row.contacts);
        line.cell(row.clusters);
        line.numbers([row.separation, row.query_us]);
        match row.depth_us {
            Some(depth_us) => line.numbers([depth_us]),
            None => line.cell(""),
        }
        line.numbers([row.force_us, row.total_us]);
        line.cell(u8::from(row.saturated));
        line.cell(row.faults);
        self.out.write_all(line.end())
    }

    /// Hands what is buffered to the system: call it now and then, so that a crash loses little.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Flushes and gives `out` back.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
